#include "draw_int.h"

#include <stdlib.h>

void spv_draw_free(struct spv_draw *draw)
{
    if (draw != NULL)
        draw->ops->free(draw);
}

const char *spv_draw_name(const struct spv_draw *draw)
{
    return draw->name;
}

enum spc_status spv_draw_frame(struct spv_draw *draw, const struct spv_view *view, const struct spv_view *tested,
                               struct spv_part *parts, uint32_t part_count, const struct spv_draw_options *options,
                               uint8_t *rgba, struct spv_drawn *drawn, struct spc_error *err)
{
    struct spv_drawn own;
    const struct frame_input in = {view, tested != NULL ? tested : view, parts, part_count, options};
    if (drawn == NULL)
        drawn = &own;
    *drawn = (struct spv_drawn){0};
    for (uint32_t p = 0; p < part_count; p++)
        if (parts[p].probe_count > 0)
            memset(parts[p].hidden, 0, parts[p].probe_count);
    return draw->ops->frame(draw, &in, rgba, drawn, err);
}

enum spc_status spv_draw_selection(struct spv_draw *draw, const struct spc_reader *reader,
                                   const struct spv_view *view, const struct spv_selection *selection,
                                   const struct spv_draw_options *options, uint8_t *rgba,
                                   struct spv_drawn *drawn, struct spc_error *err)
{
    struct spv_item *items = malloc((selection->block_count + 1) * sizeof *items);
    struct spv_part part = {.reader = reader, .items = items, .item_count = selection->block_count};
    if (items == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to draw");
    for (uint32_t i = 0; i < selection->block_count; i++)
        items[i] = (struct spv_item){.block = selection->blocks[i].block, .missing = -1};
    const enum spc_status status = spv_draw_frame(draw, view, NULL, &part, 1, options, rgba, drawn, err);
    free(items);
    return status;
}

bool spv_draw_depth(struct spv_draw *draw, int x, int y, double *depth)
{
    return draw->ops->depth(draw, x, y, depth);
}

void spv_draw_store(struct spv_draw *draw, struct spv_store *out)
{
    *out = (struct spv_store){draw, draw->ops->keep, draw->ops->drop};
}
