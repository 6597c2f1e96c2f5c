/* views.h - the pictures that choices are measured on: six directions, and from near; five accuracies. */
#ifndef BENCH_VIEWS_H
#define BENCH_VIEWS_H

#include "bench.h"
#include "camera.h"
#include "select.h"

#include <math.h>

enum { VIEWS = 6, NEAR_VIEWS = 4, ACCURACIES = 5, SIZE_PX = 1024 };
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

/* Looks along the normals of cluster v of NEAR_VIEWS from a tenth of the distance that shows all, about. */
static inline struct spv_view views_near(const struct spc_reader *reader, int v, int k)
{
    const struct spc_header *h = spc_reader_header(reader);
    struct spc_cluster c;
    double eye[3], target[3], square = 0;
    spc_reader_cluster(reader, (uint32_t)((uint64_t)h->cluster_count * (2 * (uint64_t)v + 1) / (2 * NEAR_VIEWS)), &c);
    for (int a = 0; a < 3; a++)
        square += (h->box_max[a] - h->box_min[a]) * (h->box_max[a] - h->box_min[a]);
    for (int a = 0; a < 3; a++) {
        target[a] = c.origin[a] + ldexp((double)c.sphere[a], h->unit_exp);
        eye[a] = target[a] + (double)c.cone[a] * sqrt(square) / 8;
    }
    const double up[3] = {fabsf(c.cone[1]) > 0.9f, fabsf(c.cone[1]) <= 0.9f, 0};
    struct spv_view view = {.mode = SPV_HYBRID, .cull = true};
    spv_camera_look(&view.camera, eye, target, up, acos(-1) / 4, SIZE_PX, SIZE_PX);
    view.eps = spv_camera_eps(&view.camera, ACCURACY_PX[k]);
    return view;
}

/* View v of count around the whole model, or from a third of that distance to its middle. */
static inline struct spv_view views_around(const struct spc_header *h, int v, int count, bool near, double eps_px)
{
    static const double UP[3] = {0, 0, 1};
    struct spv_view view = {.mode = SPV_HYBRID, .cull = true};
    const double turn = 2 * acos(-1) / count;
    spv_camera_orbit(&view.camera, h->box_min, h->box_max, v * turn, 0.3 * (v % 3 - 1), 0, UP, 45 * acos(-1) / 180,
                     SIZE_PX, SIZE_PX);
    for (int a = 0; a < 3 && near; a++) {
        const double middle = h->box_min[a] / 2 + h->box_max[a] / 2;
        view.camera.eye[a] = middle + (view.camera.eye[a] - middle) / 3;
    }
    view.eps = spv_camera_eps(&view.camera, eps_px);
    return view;
}

#endif
