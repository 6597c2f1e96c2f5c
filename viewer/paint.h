/*
 * paint.h - colours that say what a thing is: the same in all back ends.
 *
 * Numbers that follow each other get hues far apart, by the golden ratio; integers alone, so that every
 * back end has the same bytes.
 */
#ifndef SPV_PAINT_H
#define SPV_PAINT_H

#include "draw.h"

enum { SPV_PAINT_LOW = 48 };        /* of the weakest channel: no colour is without light */

/* r, g, b, 255 from the low byte up. */
static inline uint32_t spv_paint_hue(uint32_t key)
{
    const uint64_t turn = 6 * (uint64_t)(key * 0x9E3779B9u);
    const uint32_t sector = (uint32_t)(turn >> 32), high = 255, low = SPV_PAINT_LOW;
    const uint32_t rise = low + (uint32_t)((turn & 0xFFFFFFFFu) * (high - low) >> 32), fall = high + low - rise;
    const uint32_t channels[6][3] = {{high, rise, low}, {fall, high, low}, {low, high, rise},
                                     {low, fall, high}, {rise, low, high}, {high, low, fall}};
    const uint32_t *c = channels[sector];
    return c[0] | c[1] << 8 | c[2] << 16 | 0xFF000000u;
}

/* Of all but normal clusters, which spv_paint_hue of the group's number paints. */
static inline uint32_t spv_paint_block(enum spv_paint paint, uint32_t cluster, uint32_t level, bool triangles)
{
    if (paint == SPV_PAINT_CLUSTERS)
        return spv_paint_hue(cluster);
    if (paint == SPV_PAINT_LEVELS)
        return spv_paint_hue(level);
    return triangles ? 0xFFFFA040u : 0xFF40A0FFu;       /* kinds */
}

#endif
