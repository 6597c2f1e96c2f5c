/*
 * values.c - codes for lengths, normals and links (spec section 5).
 *
 * All of it is integer arithmetic, correctly rounded float arithmetic and sqrt: the same bits on
 * every machine.
 */
#include "format_int.h"

#include <assert.h>
#include <math.h>
#include <string.h>

static uint32_t float_bits(float v)
{
    uint32_t bits;
    memcpy(&bits, &v, sizeof bits);
    return bits;
}

uint16_t spc_len_encode_up(double v)
{
    assert(v >= 0);
    if (v == 0)
        return SPC_LEN_ZERO;
    if (v <= (double)spc_len_decode(SPC_LEN_MIN))
        return SPC_LEN_MIN;
    if (v >= (double)spc_len_decode(SPC_LEN_MAX))
        return SPC_LEN_MAX;
    float f = (float)v;             /* to nearest: may lie below v, by less than a code's step */
    uint32_t code = float_bits(f) >> 15;
    while ((double)spc_len_decode((uint16_t)code) < v)
        code++;
    return (uint16_t)code;
}

uint16_t spc_len_encode_down(double v)
{
    assert(v >= 0);
    if (v < (double)spc_len_decode(SPC_LEN_MIN))
        return SPC_LEN_ZERO;
    if (v >= (double)spc_len_decode(SPC_LEN_MAX))
        return SPC_LEN_MAX;
    uint32_t code = float_bits((float)v) >> 15;
    while ((double)spc_len_decode((uint16_t)code) > v)
        code--;
    return (uint16_t)code;
}

/* ---- normals ---------------------------------------------------------------------------------- */

enum { OCT_HALF = 127 };            /* codes 0..254 stand for -127..127: the axes are exact */

void spc_normal_decode_int(uint16_t code, int n[3])
{
    const int u = (code & 0xFF) - OCT_HALF;
    const int v = (code >> 8) - OCT_HALF;
    const int au = u < 0 ? -u : u;
    const int av = v < 0 ? -v : v;
    n[2] = OCT_HALF - au - av;
    if (n[2] >= 0) {
        n[0] = u;
        n[1] = v;
    } else {                        /* the lower half is folded over the diagonals */
        n[0] = u < 0 ? av - OCT_HALF : OCT_HALF - av;
        n[1] = v < 0 ? au - OCT_HALF : OCT_HALF - au;
    }
}

void spc_normal_decode(uint16_t code, double n[3])
{
    int i[3];
    spc_normal_decode_int(code, i);
    const double length = sqrt((double)(i[0] * i[0] + i[1] * i[1] + i[2] * i[2]));
    for (int a = 0; a < 3; a++)
        n[a] = i[a] / length;
}

static double clamp_oct(double v)
{
    return v < -OCT_HALF ? -OCT_HALF : v > OCT_HALF ? OCT_HALF : v;
}

/*
 * The nearest code is among the four around the projected point: the octahedral map is smooth
 * inside a facet, and its folds lie on code lines.
 */
uint16_t spc_normal_encode(const double n[3])
{
    const double sum = fabs(n[0]) + fabs(n[1]) + fabs(n[2]);
    if (!(sum > 0))
        return (uint16_t)(OCT_HALF | OCT_HALF << 8);
    double u = n[0] / sum;
    double v = n[1] / sum;
    if (n[2] < 0) {
        const double fu = (1 - fabs(v)) * (u < 0 ? -1 : 1);
        const double fv = (1 - fabs(u)) * (v < 0 ? -1 : 1);
        u = fu;
        v = fv;
    }
    const double bu = floor(u * OCT_HALF);
    const double bv = floor(v * OCT_HALF);
    uint16_t best = 0;
    double best_dot = -HUGE_VAL;
    for (int k = 0; k < 4; k++) {
        const int cu = (int)clamp_oct(bu + (k & 1)) + OCT_HALF;
        const int cv = (int)clamp_oct(bv + (k >> 1)) + OCT_HALF;
        const uint16_t code = (uint16_t)(cu | cv << 8);
        double d[3];
        spc_normal_decode(code, d);
        const double dot = d[0] * n[0] + d[1] * n[1] + d[2] * n[2];
        if (dot > best_dot) {
            best_dot = dot;
            best = code;
        }
    }
    return best;
}

/* ---- links ------------------------------------------------------------------------------------ */

enum { LINK_BASE_MIN = -126, LINK_BASE_MAX = 96 };      /* value stays a normal float32 */

int spc_link_base(double link_max)
{
    int exponent = 0;
    frexp(link_max, &exponent);     /* link_max < 2^exponent */
    int base = exponent - 31;
    if (link_max <= 0 || base < LINK_BASE_MIN)
        base = LINK_BASE_MIN;
    return base > LINK_BASE_MAX ? LINK_BASE_MAX : base;
}

uint8_t spc_link_encode_up(double v, int base)
{
    const uint8_t code = spc_link_bound(v, base);
    assert((double)spc_link_decode(code, base) >= v);
    return code;
}
