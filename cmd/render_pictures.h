/* render_pictures.h - pictures of one archive into files. */
#ifndef RENDER_PICTURES_H
#define RENDER_PICTURES_H

#include "picture.h"
#include "sample.h"

enum { RENDER_FRAMES_MAX = 99999 };

struct render_options {
    struct picture_options picture;
    const char *archive, *out, *stats;          /* stats may be NULL */
    uint32_t frames;                /* 0: one picture, named out */
    double turn_deg;                /* of all frames together */
    bool has_turn;
    bool six_views;
    uint32_t samples;               /* a pixel and axis, 1..SPV_SAMPLES_MAX */
};

/* Draws and writes what was asked for. Returns an exit code; says on stderr what failed. */
int render(const struct render_options *o);

#endif
