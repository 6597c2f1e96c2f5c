/* vec.h - three doubles, and floats rounded outward. */
#ifndef SPB_VEC_H
#define SPB_VEC_H

#include <math.h>

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
