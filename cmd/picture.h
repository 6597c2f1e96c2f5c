/* picture.h - options of the tools that draw: camera, accuracy, what draws. */
#ifndef PICTURE_H
#define PICTURE_H

#include "cli.h"
#include "ctx.h"
#include "draw.h"

/* Values of getopt_long for the options below; a tool's own ones come before. */
enum { PICTURE_SIZE = 512, PICTURE_ORBIT, PICTURE_EYE, PICTURE_TARGET, PICTURE_UP, PICTURE_FOV, PICTURE_EPS,
       PICTURE_MODE, PICTURE_SPLAT, PICTURE_RENDERER, PICTURE_THREADS, PICTURE_BACKGROUND, PICTURE_NO_CULL,
       PICTURE_MEMORY };

enum picture_renderer { PICTURE_AUTO, PICTURE_SOFT, PICTURE_GL };

struct picture_options {
    int width, height;
    double azimuth, elevation, distance;            /* degrees; distance 0: framed */
    double eye[3], target[3], up[3];
    bool has_eye, has_target, has_up, has_orbit;
    double fov_deg, eps_px;
    enum spv_mode mode;
    enum spv_splat splat;
    enum picture_renderer renderer;
    uint32_t threads;               /* 0: all cores */
    bool no_cull, transparent;
    uint8_t background[3];
    uint64_t memory;                /* bytes of decoded blocks */
};

enum { PICTURE_SIDE_MAX = 65535 };

/* What holds where no option says otherwise. */
struct picture_options picture_defaults(void);

/* Takes one option of getopt_long. Returns EXIT_DONE, or EXIT_USAGE with a message. */
int picture_option(int option, const char *value, struct picture_options *o);

/* Options that exclude or need each other. */
int picture_check(const struct picture_options *o);

/* The vertical axis that the archive's metadata names, unless an option did. */
void picture_take_up(const struct spc_reader *reader, struct picture_options *o);

/* False: the options give no view, such as one along the vertical axis. */
bool picture_camera(const struct picture_options *o, const double box_min[3], const double box_max[3],
                    struct spv_camera *camera);

/*
 * A back end without a display: with GL through EGL or OSMesa where it was asked for, or where a graphics
 * card draws it; else without GL. *ctx is freed after *draw.
 */
enum spc_status picture_renderer(const struct picture_options *o, struct spv_ctx **ctx, struct spv_draw **draw,
                                 struct spc_error *err);

#endif
