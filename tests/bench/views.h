/* views.h - the pictures that choices are measured on: six directions, five accuracies. */
#ifndef BENCH_VIEWS_H
#define BENCH_VIEWS_H

#include "bench.h"
#include "camera.h"
#include "select.h"

#include <math.h>

enum { VIEWS = 6, ACCURACIES = 5, SIZE_PX = 1024 };
static const double ACCURACY_PX[ACCURACIES] = {1, 2, 4, 8, 16};

/* Frames the whole model from direction v, at accuracy k. */
static inline struct spv_view views_at(const struct spc_header *h, int v, int k)
{
    static const double ORBITS[VIEWS][2] = {{0, 0}, {90, 0}, {180, 0}, {270, 0}, {45, 35}, {225, -35}};
    static const double UP[3] = {0, 1, 0};
    const double degree = acos(-1) / 180;
    struct spv_view view = {.mode = SPV_HYBRID, .cull = true};
    spv_camera_orbit(&view.camera, h->box_min, h->box_max, ORBITS[v][0] * degree,
                     ORBITS[v][1] * degree, 0, UP, 45 * degree, SIZE_PX, SIZE_PX);
    view.eps = spv_camera_eps(&view.camera, ACCURACY_PX[k]);
    return view;
}

#endif
