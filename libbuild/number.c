/*
 * Three ways from digits to a double, all correctly rounded.
 *
 * 1. Whole digits below 2^53 and a power of ten up to 10^22 are both exact doubles, so one IEEE
 *    multiplication or division rounds once [Clinger 1990]. This is nearly every number in a scan.
 * 2. Up to 19 digits and a power up to 10^27: 5^27 < 2^63, so product or quotient is formed exactly
 *    in 128 bits and rounded by hand. This is what "%.17g" prints, and it is some five times
 *    faster than strtod.
 * 3. All else: strtod on the digits without their point. strtod takes the point from the locale;
 *    a text without one reads the same in each, whether or not some caller runs setlocale (our own
 *    programs never do).
 */
#include "number.h"

#include <float.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

__extension__ typedef unsigned __int128 uint128;

enum {
    EXACT_POW10 = 22,           /* 10^22 is the last power of ten that is a double */
    EXACT_POW5 = 27,            /* 5^27 is the last power of five below 2^63 */
    EXACT_DIGITS = 19,          /* 10^19 - 1 < 2^64 */
    EXPONENT_MAX = 100000       /* far past the range of double, far inside int */
};

static const double pow10_exact[EXACT_POW10 + 1] = {
    1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
    1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22
};

static const uint64_t pow5_exact[EXACT_POW5 + 1] = {
    1u, 5u, 25u, 125u, 625u, 3125u, 15625u, 78125u, 390625u, 1953125u, 9765625u, 48828125u,
    244140625u, 1220703125u, 6103515625u, 30517578125u, 152587890625u, 762939453125u,
    3814697265625u, 19073486328125u, 95367431640625u, 476837158203125u, 2384185791015625u,
    11920928955078125u, 59604644775390625u, 298023223876953125u, 1490116119384765625u,
    7450580596923828125u
};

struct decimal {                /* a number's text, taken apart */
    const uint8_t *begin, *end; /* digits and point, without sign and exponent */
    uint64_t mantissa;          /* all digits, modulo 2^64 */
    int fraction_digits;
    int exponent;               /* as written */
};

static inline bool is_digit(uint8_t c)
{
    return (unsigned)(c - '0') < 10u;
}

static bool starts_with(const uint8_t *p, const char *word)
{
    while (*word && (*p | 32) == *word) {
        p++;
        word++;
    }
    return !*word;
}

/* nan and inf; p is behind the sign. */
static const uint8_t *special(const uint8_t *p, bool negative, double *out)
{
    if (starts_with(p, "inf")) {
        *out = negative ? -(double)__builtin_inf() : (double)__builtin_inf();
        return p + (starts_with(p, "infinity") ? 8 : 3);
    }
    if (!starts_with(p, "nan"))
        return NULL;
    *out = __builtin_nan("");
    p += 3;
    if (*p == '(') {
        const uint8_t *close = p + 1;
        while (is_digit(*close) || (unsigned)((*close | 32) - 'a') < 26u || *close == '_')
            close++;
        if (*close == ')')
            p = close + 1;
    }
    return p;
}

/* 1.#INF and its kin; p points to '#'. */
static const uint8_t *special_msvc(const uint8_t *p, bool negative, double *out)
{
    static const char *const names[] = { "inf", "ind", "qnan", "snan" };
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        if (!starts_with(p + 1, names[i]))
            continue;
        *out = __builtin_nan("");
        if (i == 0)
            *out = negative ? -(double)__builtin_inf() : (double)__builtin_inf();
        p += 1 + strlen(names[i]);
        while (is_digit(*p))
            p++;                                /* "%.4f" leaves zeros behind the name */
        return p;
    }
    return NULL;
}

/* value * 2^power for a result in the normal range, where it is exact. */
static double scale_exact(uint64_t value, int power)
{
    const uint64_t bits = (uint64_t)(1023 + power) << 52;
    double two_to;
    memcpy(&two_to, &bits, sizeof two_to);
    return (double)value * two_to;
}

/* (q plus something in [0, 1), zero unless sticky) * 2^power, rounded to 53 bits, ties to even. */
static double round_53(uint128 q, bool sticky, int power)
{
    const uint64_t high = (uint64_t)(q >> 64), low = (uint64_t)q;
    const int bits = high ? 128 - __builtin_clzll(high) : 64 - __builtin_clzll(low);
    const int drop = bits - 53;
    if (drop <= 0)
        return scale_exact(low, power);         /* only without sticky: quotients have 64 bits */
    uint64_t kept = (uint64_t)(q >> drop);
    const uint128 lost = q & (((uint128)1 << drop) - 1);
    const uint128 half = (uint128)1 << (drop - 1);
    if (lost > half || (lost == half && (sticky || (kept & 1))))
        kept++;                                 /* 2^53 itself is a double too */
    return scale_exact(kept, power + drop);
}

/* mantissa * 10^power, mantissa > 0, |power| <= EXACT_POW5. */
static double scale_128(uint64_t mantissa, int power)
{
    if (power >= 0)
        return round_53((uint128)mantissa * pow5_exact[power], false, power);
    const int zeros = __builtin_clzll(mantissa);
    const uint128 above = (uint128)(mantissa << zeros) << 64;
    const uint64_t below = pow5_exact[-power];
    const uint128 quotient = above / below;
    return round_53(quotient, quotient * below != above, power - 64 - zeros);
}

static bool scale_by_strtod(const struct decimal *d, double *out)
{
    char text[SPB_NUMBER_MAX + 16];
    size_t length = 0;

    if (d->end - d->begin > SPB_NUMBER_MAX)
        return false;
    for (const uint8_t *p = d->begin; p < d->end; p++) {
        if (*p != '.')
            text[length++] = (char)*p;
    }
    snprintf(text + length, sizeof text - length, "e%d", d->exponent - d->fraction_digits);
    *out = strtod(text, NULL);
    return true;
}

static bool to_double(const struct decimal *d, double *out)
{
    const int power = d->exponent - d->fraction_digits;
    ptrdiff_t digits = d->end - d->begin;       /* an upper bound: the point counts too */

    if (digits > EXACT_DIGITS) {
        const uint8_t *p = d->begin;
        while (p < d->end && (*p == '0' || *p == '.'))
            p++;
        digits = d->end - p;
        if (memchr(p, '.', (size_t)digits))
            digits--;
    }
    if (digits > EXACT_DIGITS)
        return scale_by_strtod(d, out);
    if (d->mantissa == 0) {
        *out = 0;
    } else if (FLT_EVAL_METHOD <= 1 && FLT_EVAL_METHOD >= 0 &&
               d->mantissa <= UINT64_C(1) << 53 && power >= -EXACT_POW10 && power <= EXACT_POW10) {
        const double whole = (double)d->mantissa;
        *out = power < 0 ? whole / pow10_exact[-power] : whole * pow10_exact[power];
    } else if (power >= -EXACT_POW5 && power <= EXACT_POW5) {
        *out = scale_128(d->mantissa, power);
    } else {
        return scale_by_strtod(d, out);
    }
    return true;
}

/* [+-] digits behind an 'e'; NULL when there are none. */
static const uint8_t *read_exponent(const uint8_t *p, int *out)
{
    const bool negative = *p == '-';
    int exponent = 0;

    if (*p == '-' || *p == '+')
        p++;
    if (!is_digit(*p))
        return NULL;
    for (; is_digit(*p); p++) {
        if (exponent < EXPONENT_MAX)
            exponent = exponent * 10 + (*p - '0');
    }
    *out = negative ? -exponent : exponent;
    return p;
}

const uint8_t *spb_number_real(const uint8_t *p, double *out)
{
    struct decimal d = { .mantissa = 0 };
    const bool negative = *p == '-';
    ptrdiff_t digits, fraction = 0;

    if (*p == '-' || *p == '+')
        p++;
    d.begin = p;
    for (; is_digit(*p); p++)
        d.mantissa = d.mantissa * 10 + (uint64_t)(*p - '0');
    digits = p - d.begin;
    if (*p == '.') {
        const uint8_t *const first = ++p;
        for (; is_digit(*p); p++)
            d.mantissa = d.mantissa * 10 + (uint64_t)(*p - '0');
        fraction = p - first;
    }
    if (digits + fraction == 0)
        return *d.begin == '.' ? NULL : special(p, negative, out);
    if (*p == '#')
        return special_msvc(p, negative, out);
    d.end = p;
    if (digits + fraction > SPB_NUMBER_MAX)
        return NULL;
    d.fraction_digits = (int)fraction;
    if ((*p | 32) == 'e') {
        p = read_exponent(p + 1, &d.exponent);
        if (!p)
            return NULL;
    }
    if (!to_double(&d, out))
        return NULL;
    if (negative)
        *out = -*out;
    return p;
}

const uint8_t *spb_number_int(const uint8_t *p, int64_t *out)
{
    const uint8_t *const begin = p;
    const bool negative = *p == '-';
    uint64_t value = 0;
    double real;

    if (*p == '-' || *p == '+')
        p++;
    const uint8_t *const first = p;
    for (; is_digit(*p); p++)
        value = value * 10 + (uint64_t)(*p - '0');
    /* 18 digits fit; a point, an exponent, a name or a longer number takes the other way. */
    if (p > first && p - first <= 18 && *p != '.' && (*p | 32) != 'e') {
        *out = negative ? -(int64_t)value : (int64_t)value;
        return p;
    }
    p = spb_number_real(begin, &real);
    if (!p)
        return NULL;
    *out = SPB_NOT_WHOLE;
    if (real > -0x1p63 && real < 0x1p63 && (double)(int64_t)real == real)
        *out = (int64_t)real;
    return p;
}
