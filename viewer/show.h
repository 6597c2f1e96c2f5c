/*
 * show.h - pictures of the processor onto a window.
 *
 * They depend on no state that the back end sets, and leave it as it was but for the clear colour and the
 * function of blending. On a window whose GL is software, blending costs twice what replacing does: there a
 * picture that is on the processor anyway is better mixed there, and shown once.
 */
#ifndef SPV_SHOW_H
#define SPV_SHOW_H

#include "spc.h"

struct spv_ctx;
struct spv_show;

/* For the current context, which must outlive it. fails SPC_FEATURE, SPC_NO_MEMORY */
enum spc_status spv_show_create(const struct spv_ctx *ctx, struct spv_show **out, struct spc_error *err);
void spv_show_free(struct spv_show *show);

/* Size of the window, px, to be told before the first picture and whenever it changes. */
void spv_show_size(struct spv_show *show, int width, int height);

void spv_show_clear(struct spv_show *show, uint32_t rgb);           /* 0xRRGGBB, the whole window */

enum { SPV_SHOW_BLEND = 1 };        /* over what is there, by the picture's alpha; else in its place */

/*
 * A picture onto the window, pixel by pixel, its top left at x, y from the window's; what does not fit is
 * not shown. Row 0 is the top one.
 *
 * in     rgba[height][width][4]   straight alpha (colours are not multiplied by it); read until return
 * fails  SPC_NO_MEMORY (OpenGL has none)
 */
enum spc_status spv_show_picture(struct spv_show *show, const uint8_t *rgba, int width, int height, int x, int y,
                                 unsigned flags, struct spc_error *err);

/* The window as it was drawn since the last swap, rgba[height][width][4], row 0 the top one, alpha 255. */
void spv_show_read(struct spv_show *show, uint8_t *rgba);

#endif
