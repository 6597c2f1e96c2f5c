/*
 * codes.h - codes of normals and lengths (spc.h), inline, for loops that become vectors.
 *
 * The same operations in the same order as spc_normal_*, spc_len_encode_up and nextafterf, so the
 * same values; numbers of codes are doubles here, which costs nothing and spares conversions.
 */
#ifndef SPB_CODES_H
#define SPB_CODES_H

#include "spc.h"
#include "vec.h"
#include "vectors.h"

#include <stdbool.h>

#define OCT_HALF 127.0              /* u and v are -127..127 */

struct oct {                        /* normal code (u + 127) | (v + 127) << 8, decoded */
    double u, v, x, y, z;
};

SPB_INLINE struct oct oct_decode(double u, double v)
{
    const double au = fabs(u), av = fabs(v), z = OCT_HALF - au - av;
    const double fu = u < 0 ? av - OCT_HALF : OCT_HALF - av;
    const double fv = v < 0 ? au - OCT_HALF : OCT_HALF - au;
    const double x = z >= 0 ? u : fu, y = z >= 0 ? v : fv;
    const double length = sqrt(x * x + y * y + z * z);
    return (struct oct){u, v, x / length, y / length, z / length};
}

SPB_INLINE double oct_clamp(double v)
{
    return v < -OCT_HALF ? -OCT_HALF : v > OCT_HALF ? OCT_HALF : v;
}

SPB_INLINE double oct_dot(const struct oct *o, double x, double y, double z)
{
    return o->x * x + o->y * y + o->z * z;
}

/* Corner of the square of codes that holds the vector's: the smallest u and v. The vector is not 0. */
SPB_INLINE void oct_square(double x, double y, double z, double *u, double *v)
{
    const double sum = fabs(x) + fabs(y) + fabs(z);
    const double pu = x / sum, pv = y / sum;
    const double fu = (1 - fabs(pv)) * (pu < 0 ? -1 : 1), fv = (1 - fabs(pu)) * (pv < 0 ? -1 : 1);
    *u = floor((z < 0 ? fu : pu) * OCT_HALF);
    *v = floor((z < 0 ? fv : pv) * OCT_HALF);
}

SPB_INLINE uint16_t oct_code(double u, double v)
{
    return (uint16_t)(((int)u + 127) | ((int)v + 127) << 8);
}

/* Takes the code, when it may, if it is nearer to the vector than the best so far. */
SPB_INLINE void oct_try(struct oct *best, double *best_dot, bool may, double u, double v, double x,
                        double y, double z)
{
    const struct oct o = oct_decode(u, v);
    const double dot = oct_dot(&o, x, y, z);
    const bool better = may & (dot > *best_dot);
    best->u = better ? o.u : best->u;
    best->v = better ? o.v : best->v;
    best->x = better ? o.x : best->x;
    best->y = better ? o.y : best->y;
    best->z = better ? o.z : best->z;
    *best_dot = better ? dot : *best_dot;
}

/* Smallest length code whose value is >= v >= 0. */
SPB_INLINE uint32_t length_code_up(double v)
{
    const double least = 0x1p-126, most = 0x1.ffp127;
    const double kept = smaller_of(larger_of(v, least), most);
    const float nearest = (float)kept;
    uint32_t bits;
    float value;
    memcpy(&bits, &nearest, sizeof bits);
    bits = bits >> 15 << 15;
    memcpy(&value, &bits, sizeof value);
    return v > 0 ? (bits >> 15) + ((double)value < kept) : 0;
}

enum { CODES_MAX = 64 };

/* The same of n lengths, at most CODES_MAX. */
SPB_INLINE void length_codes_up(const double *v, int32_t *code, uint32_t n)
{
    const double least = 0x1p-126, most = 0x1.ffp127;
    double kept[CODES_MAX];
    float value[CODES_MAX];
    int32_t bits[CODES_MAX];
    for (uint32_t i = 0; i < n; i++) {
        kept[i] = smaller_of(larger_of(v[i], least), most);
        value[i] = (float)kept[i];
    }
    memcpy(bits, value, n * sizeof *bits);
    for (uint32_t i = 0; i < n; i++)
        bits[i] = bits[i] >> 15 << 15;
    memcpy(value, bits, n * sizeof *bits);
    for (uint32_t i = 0; i < n; i++) {
        const int32_t up = (double)value[i] < kept[i] ? 1 : 0;
        code[i] = v[i] > 0 ? (bits[i] >> 15) + up : 0;
    }
}

/* Number to add to the bits of a float that was rounded from v, so that it is not above, or below, v. */
SPB_INLINE int32_t bits_down(float f, int32_t bits, double v)
{
    const int32_t step = bits < 0 ? 1 : -1;
    return (double)f > v ? step : 0;
}

SPB_INLINE int32_t bits_up(float f, int32_t bits, double v)
{
    const int32_t step = bits < 0 ? -1 : 1;
    return (double)f < v ? step : 0;
}

/* Floats not above v, or not below, as float_below and float_above; at most CODES_MAX. */
SPB_INLINE void floats_outward(const double *v, bool up, float *out, uint32_t n)
{
    int32_t bits[CODES_MAX];
    for (uint32_t i = 0; i < n; i++)
        out[i] = (float)v[i];
    memcpy(bits, out, n * sizeof *bits);
    for (uint32_t i = 0; i < n; i++)
        bits[i] += up ? bits_up(out[i], bits[i], v[i]) : bits_down(out[i], bits[i], v[i]);
    memcpy(out, bits, n * sizeof *bits);
}

#endif
