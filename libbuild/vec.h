/* vec.h - three doubles, and floats rounded outward. */
#ifndef SPB_VEC_H
#define SPB_VEC_H

#include <math.h>
#include <stdint.h>
#include <string.h>

/* fmax and fmin of numbers, a squared length, ldexp; without a call: builds spend a fifth of their time in these. */
static inline double larger_of(double a, double b)
{
    return a > b ? a : b;
}

static inline double smaller_of(double a, double b)
{
    return a < b ? a : b;
}

static inline double square_of(double x, double y, double z)
{
    return x * x + y * y + z * z;
}

static inline double times_exp2(double v, int e)    /* v 2^e, rounded once */
{
    if (e < -1022 || e > 1023)
        return ldexp(v, e);
    const uint64_t bits = (uint64_t)(e + 1023) << 52;
    double power;
    memcpy(&power, &bits, sizeof power);
    return v * power;
}

static inline int exponent_above(double v)         /* of the smallest power of two above v > 0 */
{
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits);
    if (bits >> 52 == 0)            /* below normal numbers */
        return exponent_above(v * 0x1p64) - 64;
    return (int)(bits >> 52) - 1022;
}

static inline void vec_sub(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[i] - b[i];
}

static inline void vec_scale(const double a[3], double s, double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[i] * s;
}

static inline double vec_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void vec_cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static inline double vec_length(const double a[3])
{
    return sqrt(vec_dot(a, a));
}

static inline double vec_distance(const double a[3], const double b[3])
{
    double d[3];
    vec_sub(a, b, d);
    return vec_length(d);
}

static inline float float_below(double v)   /* largest float <= v */
{
    float f = (float)v;
    return (double)f > v ? nextafterf(f, -HUGE_VALF) : f;
}

static inline float float_above(double v)   /* smallest float >= v */
{
    float f = (float)v;
    return (double)f < v ? nextafterf(f, HUGE_VALF) : f;
}

#endif
