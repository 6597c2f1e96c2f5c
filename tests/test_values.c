#include "spc.h"

#include "suite.h"

#include <math.h>
#include <stdlib.h>

START_TEST(length_codes_grow_with_their_values_and_round_up_to_themselves)
{
    double before = 0;
    for (uint32_t code = SPC_LEN_MIN; code <= SPC_LEN_MAX; code++) {
        const double v = (double)spc_len_decode((uint16_t)code);
        if (!(v > before) || !isfinite(v) || !spc_len_valid((uint16_t)code) ||
            spc_len_encode_up(v) != code || spc_len_encode_down(v) != code)
            ck_abort_msg("code %u", code);
        const double above = nextafter(v, HUGE_VAL), below = nextafter(v, 0);
        if (code < SPC_LEN_MAX && spc_len_encode_up(above) != code + 1)
            ck_abort_msg("just above code %u", code);
        if (spc_len_encode_up(below) != code)
            ck_abort_msg("just below code %u", code);
        if (code > SPC_LEN_MIN && spc_len_encode_down(below) != code - 1)
            ck_abort_msg("down from just below code %u", code);
        before = v;
    }
}
END_TEST

START_TEST(length_codes_keep_their_ends)
{
    ck_assert_uint_eq(spc_len_encode_up(0), SPC_LEN_ZERO);
    ck_assert_uint_eq(spc_len_encode_up(0x1p-1074), SPC_LEN_MIN);
    ck_assert_uint_eq(spc_len_encode_up(1e300), SPC_LEN_MAX);
    ck_assert_uint_eq(spc_len_encode_down(0x1p-1074), SPC_LEN_ZERO);
    ck_assert(isinf(spc_len_decode(SPC_LEN_ROOT)));
    ck_assert(!spc_len_valid(SPC_LEN_ROOT));
    ck_assert(!spc_len_valid(1) && !spc_len_valid(0xFF) && !spc_len_valid(0xFF01));
}
END_TEST

static double angle(const double a[3], const double b[3])
{
    const double c[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                         a[0] * b[1] - a[1] * b[0]};
    return atan2(sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]),
                 a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
}

START_TEST(normal_codes_are_within_a_degree_and_exact_on_the_axes)
{
    double worst = 0;
    srand(7);
    for (int i = 0; i < 200000; i++) {
        double n[3], d[3];
        for (int a = 0; a < 3; a++)
            n[a] = rand() / (double)RAND_MAX - 0.5;
        const uint16_t code = spc_normal_encode(n);
        spc_normal_decode(code, d);
        worst = fmax(worst, angle(n, d));
    }
    ck_assert_double_lt(worst, 0.0175);
    for (int a = 0; a < 6; a++) {
        double n[3] = {0, 0, 0}, d[3];
        n[a % 3] = a < 3 ? 1 : -1;
        spc_normal_decode(spc_normal_encode(n), d);
        for (int k = 0; k < 3; k++)
            ck_assert_double_eq(d[k], n[k]);
    }
}
END_TEST

/* The four candidates around the projection hold the nearest code of all. */
START_TEST(normal_encoding_finds_the_nearest_of_all_codes)
{
    srand(11);
    for (int i = 0; i < 60; i++) {
        double n[3], d[3], best = 10, got;
        for (int a = 0; a < 3; a++)
            n[a] = rand() / (double)RAND_MAX - 0.5;
        if (i % 3 == 0)
            n[i % 2] = 0;           /* on a fold */
        spc_normal_decode(spc_normal_encode(n), d);
        got = angle(n, d);
        for (uint32_t code = 0; code < 65536; code++)
            if (spc_normal_valid((uint16_t)code)) {
                spc_normal_decode((uint16_t)code, d);
                best = fmin(best, angle(n, d));
            }
        ck_assert_double_le(got, best + 1e-3);
    }
}
END_TEST

START_TEST(every_valid_normal_code_decodes_to_a_unit_vector_near_itself)
{
    for (uint32_t code = 0; code < 65536; code++) {
        double n[3], d[3];
        int whole[3];
        if (!spc_normal_valid((uint16_t)code))
            continue;
        spc_normal_decode_int((uint16_t)code, whole);
        if (abs(whole[0]) + abs(whole[1]) + abs(whole[2]) != 127)
            ck_abort_msg("code %u is off the octahedron", code);
        spc_normal_decode((uint16_t)code, n);
        spc_normal_decode(spc_normal_encode(n), d);     /* folds have two codes for one vector */
        if (angle(n, d) > 1e-9)
            ck_abort_msg("code %u", code);
    }
}
END_TEST

START_TEST(link_codes_round_up_by_at_most_an_eighth)
{
    srand(3);
    for (int i = 0; i < 20000; i++) {
        const double most = ldexp(0.5 + rand() / (2.0 * RAND_MAX), rand() % 60 - 50);
        const int base = spc_link_base(most);
        const double v = most * ldexp(rand() / (double)RAND_MAX, -(rand() % 28));
        const double got = (double)spc_link_decode(spc_link_encode_up(v, base), base);
        ck_assert_double_ge(got, v);
        if (v > ldexp(1, base))
            ck_assert_double_le(got, v * 1.125);
    }
    for (int code = 1; code < 256; code++)
        ck_assert(spc_link_decode((uint8_t)code, -20) > spc_link_decode((uint8_t)(code - 1), -20));
    ck_assert_int_ge(spc_link_base(0), -126);
}
END_TEST

START_TEST(axes_are_spread_for_every_count)
{
    for (uint32_t n = 1; n <= 128; n++) {
        int16_t axes[128][3];
        spc_axes_standard(n, axes);
        for (uint32_t i = 0; i < n; i++) {
            const double x = axes[i][0], y = axes[i][1], z = axes[i][2];
            ck_assert_double_eq_tol(sqrt(x * x + y * y + z * z) / 32767, 1, 1e-4);
        }
    }
    int16_t axes[128][3];
    double worst = 0;
    spc_axes_standard(128, axes);
    for (uint32_t code = 0; code < 65536; code += 7) {
        double n[3];
        if (!spc_normal_valid((uint16_t)code))
            continue;
        spc_normal_decode((uint16_t)code, n);
        const int16_t *axis = axes[spc_axis_nearest((const int16_t(*)[3])axes, 128, (uint16_t)code)];
        const double a[3] = {axis[0], axis[1], axis[2]};
        worst = fmax(worst, angle(n, a));
    }
    ck_assert_double_lt(worst, 0.24);
}
END_TEST

int main(void)
{
    return SUITE("values", NULL, NULL,
                 length_codes_grow_with_their_values_and_round_up_to_themselves,
                 length_codes_keep_their_ends,
                 normal_codes_are_within_a_degree_and_exact_on_the_axes,
                 normal_encoding_finds_the_nearest_of_all_codes,
                 every_valid_normal_code_decodes_to_a_unit_vector_near_itself,
                 link_codes_round_up_by_at_most_an_eighth, axes_are_spread_for_every_count);
}
