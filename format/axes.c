/*
 * axes.c - the directions that nodes are grouped by (spec section 6.3).
 *
 * The table is data of every archive; readers take it from there. Only the builder asks here.
 */
#include "spc.h"

#include <assert.h>

static const int16_t AXES[128][4] = {
#include "axes_table.inc"
};

void spc_axes_standard(uint32_t count, int16_t axes[][3])
{
    assert(count >= 1 && count <= 128);
    uint32_t n = 0;
    for (uint32_t k = 0; k < 128; k++) {
        if ((uint32_t)AXES[k][3] >= count)
            continue;
        for (int a = 0; a < 3; a++)
            axes[n][a] = AXES[k][a];
        n++;
    }
    assert(n == count);
}

uint32_t spc_axis_nearest(const int16_t axes[][3], uint32_t count, uint16_t normal_code)
{
    int n[3];
    spc_normal_decode_int(normal_code, n);
    uint32_t best = 0;
    int32_t best_dot = INT32_MIN;
    for (uint32_t k = 0; k < count; k++) {
        const int32_t dot = n[0] * axes[k][0] + n[1] * axes[k][1] + n[2] * axes[k][2];
        if (dot > best_dot) {
            best_dot = dot;
            best = k;
        }
    }
    return best;
}
