/*
 * interval.h - the drawing tests of single nodes and triangles in float32 (I1, I4, I6).
 *
 * The same operations as in glsl.h, in the same order: what this counts is what a shader draws, up
 * to the rounding that I4 allows for.
 */
#ifndef SPV_INTERVAL_H
#define SPV_INTERVAL_H

#include "bytes.h"
#include "layout.h"
#include "spc.h"

#include <math.h>

struct spv_interval {               /* what a block's nodes share */
    float origin[3];                /* of the cluster, from the eye, units */
    float step;                     /* of positions, units */
    float eps;
    int link_base;
    bool lower;                     /* false: leaves that have no triangle to give way to */
    float missing;                  /* E of spec section 9: e_self up to this passes the lower test; -1: none */
};

/* q = eps rho of a record. */
static inline float spv_interval_q(const struct spv_interval *in, const uint8_t *record)
{
    const float x = in->origin[0] + (float)load_u16(record + ND_X) * in->step;
    const float y = in->origin[1] + (float)load_u16(record + ND_Y) * in->step;
    const float z = in->origin[2] + (float)load_u16(record + ND_Z) * in->step;
    const float rho = sqrtf(x * x + y * y + z * z) - spc_len_decode(load_u16(record + ND_RADIUS));
    return in->eps * rho;
}

/* Is the node's splat drawn? */
static inline bool spv_interval_point(const struct spv_interval *in, const uint8_t *record)
{
    const float q = spv_interval_q(in, record);
    const uint16_t e_parent = load_u16(record + ND_E_PARENT);
    const float e_self = spc_len_decode(load_u16(record + ND_E_SELF));
    if (in->lower && !(e_self < q || e_self <= in->missing))
        return false;
    return e_parent == SPC_LEN_ROOT ||
           q * (1 - 0x1p-20f) <= spc_len_decode(e_parent) +
                                     in->eps * spc_link_decode(record[ND_LINK], in->link_base);
}

/* Is the leaf's triangle drawn? Its point then fails the lower test. */
static inline bool spv_interval_triangle(const struct spv_interval *in, const uint8_t *record)
{
    return spv_interval_q(in, record) <= spc_len_decode(load_u16(record + ND_E_SELF));
}

#endif
