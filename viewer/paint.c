#include "paint.h"

/* No channel is without light, so that light shows the shape whatever the hue. */
enum { LOW = 48, HIGH = 255 };

/*
 * A hue of the six-sided colour wheel, at full saturation but for LOW. The key times the golden ratio is a
 * place on the wheel, as a fraction of 2^32: keys that follow each other lie far apart, and none fall
 * together for long.
 */
static uint32_t hue(uint32_t key)
{
    static const uint8_t from[6][3] = {             /* channel: 0 low, 1 high, 2 rising, 3 falling */
        {1, 2, 0}, {3, 1, 0}, {0, 1, 2}, {0, 3, 1}, {2, 0, 1}, {1, 0, 3},
    };
    const uint64_t place = 6 * (uint64_t)(key * 0x9E3779B9u);
    const uint32_t side = (uint32_t)(place >> 32);
    const uint32_t rising = LOW + (uint32_t)((place & 0xFFFFFFFFu) * (HIGH - LOW) >> 32);
    const uint32_t value[4] = {LOW, HIGH, rising, HIGH + LOW - rising};
    return value[from[side][0]] | value[from[side][1]] << 8 | value[from[side][2]] << 16 | 0xFF000000u;
}

uint32_t spv_paint_color(enum spv_paint paint, uint32_t cluster, uint32_t level, uint32_t group, bool triangle)
{
    switch (paint) {
    case SPV_PAINT_CLUSTERS: return hue(cluster);
    case SPV_PAINT_LEVELS:   return hue(level);
    case SPV_PAINT_NORMALS:  return hue(group);
    case SPV_PAINT_KINDS:    return triangle ? 0xFFFFA040u : 0xFF40A0FFu;
    default:                 return 0xFFFFFFFFu;
    }
}
