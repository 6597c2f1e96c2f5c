/* draw_int.h - what a back end is, for draw.c. */
#ifndef SPV_DRAW_INT_H
#define SPV_DRAW_INT_H

#include "draw.h"

struct frame_input {                /* the arguments of spv_draw_frame; tested is never NULL */
    const struct spv_view *view, *tested;
    struct spv_part *parts;
    uint32_t part_count;
    const struct spv_draw_options *options;
};

struct draw_ops {
    void (*free)(struct spv_draw *draw);
    enum spc_status (*frame)(struct spv_draw *draw, const struct frame_input *in, uint8_t *rgba,
                             struct spv_drawn *drawn, struct spc_error *err);
    bool (*depth)(struct spv_draw *draw, int x, int y, double *depth);      /* x, y in the picture */
    void *(*keep)(struct spv_draw *draw, const struct spc_reader *reader, uint32_t block, uint8_t *payload);
    void (*drop)(struct spv_draw *draw, void *kept);
};

struct spv_draw {                   /* the first member of every back end's own */
    const struct draw_ops *ops;
    char name[128];
};

#endif
