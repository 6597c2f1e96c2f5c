/*
 * draw.h - selected blocks become a picture.
 *
 * One header for all back ends. A back end decodes the blocks it is given, applies the exact
 * tests of I1, I4 and I6 to each node and triangle, and draws what passes: splats that contain
 * their pill (I5), triangles near the eye. Light comes from the eye, both sides are lit.
 */
#ifndef SPV_DRAW_H
#define SPV_DRAW_H

#include "select.h"

struct spv_ctx;

enum spv_splat {
    SPV_SPLAT_EXACT,                /* the pill's own outline, tested at each pixel */
    SPV_SPLAT_FAST,                 /* the square around it: no test, no depth of its own */
};

struct spv_draw_options {
    enum spv_splat splat;
    float ambient;                  /* share of light from everywhere, 0..1 */
    int tile;                       /* largest side drawn at once, px; 0: the default */
};

struct spv_gl;

/* A GL 3.3 back end on the current context. fails SPC_FEATURE, SPC_NO_MEMORY */
enum spc_status spv_gl_create(const struct spv_ctx *ctx, struct spv_gl **out,
                              struct spc_error *err);
void spv_gl_free(struct spv_gl *gl);

/* "renderer, version" of the context. Borrowed. */
const char *spv_gl_name(const struct spv_gl *gl);

/*
 * Draws a frame.
 *
 * in     selection  of spv_select for the same reader and view
 * out    rgba[height][width][4], row 0 the top one; not covered: 0, 0, 0, 0; covered: alpha 255
 * fails  SPC_CHECKSUM, SPC_CORRUPT, SPC_NO_MEMORY, SPC_FEATURE (the picture is too large)
 */
enum spc_status spv_gl_frame(struct spv_gl *gl, const struct spc_reader *reader,
                             const struct spv_view *view, const struct spv_selection *selection,
                             const struct spv_draw_options *options, uint8_t *rgba,
                             struct spc_error *err);

struct spv_soft;

/*
 * A back end without GL, on up to threads threads; 0: one a core. The picture is the same for any
 * number of them. options.tile 0: the whole picture, in bands when it is larger than 2^26 pixels.
 * fails  SPC_NO_MEMORY
 */
enum spc_status spv_soft_create(unsigned threads, struct spv_soft **out, struct spc_error *err);
void spv_soft_free(struct spv_soft *soft);
const char *spv_soft_name(const struct spv_soft *soft);         /* borrowed */

/* As spv_gl_frame. fails  SPC_CHECKSUM, SPC_CORRUPT, SPC_NO_MEMORY */
enum spc_status spv_soft_frame(struct spv_soft *soft, const struct spc_reader *reader,
                               const struct spv_view *view, const struct spv_selection *selection,
                               const struct spv_draw_options *options, uint8_t *rgba,
                               struct spc_error *err);

/* Splats and triangles that passed their tests in the last tile, or frame of one tile. */
void spv_soft_drawn(const struct spv_soft *soft, uint64_t *nodes, uint64_t *triangles);

/* For tests: does without 256-bit vectors. The picture is the same. */
void spv_soft_narrow(struct spv_soft *soft);

#endif
