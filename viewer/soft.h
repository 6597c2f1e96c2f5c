/*
 * soft.h - the back end without GL, step by step: decoded blocks into a framebuffer.
 *
 * spv_soft_frame of draw.h is begin, draw, end over tiles, with blocks that are decoded as they are
 * drawn. Whoever keeps decoded blocks draws those, in as many calls as it likes, in any order: the
 * picture depends on what was drawn alone.
 */
#ifndef SPV_SOFT_H
#define SPV_SOFT_H

#include "draw.h"

struct spv_tile {                   /* part of a picture, px, from its top left */
    int x0, y0, width, height;
};

/*
 * Clears the framebuffer and takes the camera. reader, view and options stay until the end.
 * fails  SPC_NO_MEMORY
 */
enum spc_status spv_soft_begin(struct spv_soft *soft, const struct spc_reader *reader,
                               const struct spv_view *view, const struct spv_draw_options *options,
                               const struct spv_tile *tile, struct spc_error *err);

/*
 * Where payloads come from. Called on several threads at a time, each with a worker's number below
 * spv_soft_threads; what it returns must stay until that worker's next call.
 */
struct spv_soft_source {
    const uint8_t *(*payload)(void *ctx, unsigned worker, uint32_t block, struct spc_error *err);
    void *ctx;                      /* NULL from payload: the status is in err */
};
unsigned spv_soft_threads(const struct spv_soft *soft);

/*
 * Draws blocks[count] of the reader, by their numbers. Those near the eye first is fastest.
 * fails  what the source failed with for the first block by order that failed
 */
enum spc_status spv_soft_draw(struct spv_soft *soft, const struct spv_soft_source *source,
                              const uint32_t *blocks, size_t count, struct spc_error *err);

/* Writes the tile into the picture rgba[height][width][4]. */
void spv_soft_end(struct spv_soft *soft, uint8_t *rgba);

#endif
