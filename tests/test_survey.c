/* What faces measure, in batches of vectors, against one face at a time. */
#include "plain_face.h"
#include "suite.h"
#include "survey.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 300 };

static double random_unit(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 40) / 0x1p24;
}

/* Corners of all sizes, some of them equal. */
static void make_records(bool wide, uint32_t count, uint8_t *records)
{
    const struct spb_record_format format = spb_record_format(wide, false);
    const uint8_t none[3][4] = {{0}};
    uint64_t state = count * 2 + wide;
    for (uint32_t i = 0; i < count; i++) {
        double corner[3][3];
        const double size = ldexp(1, -(int)(i % 20));
        for (int k = 0; k < 9; k++)
            corner[k / 3][k % 3] = 5 + (double)(float)(size * random_unit(&state));
        if (i % 7 == 0)
            memcpy(corner[1], corner[0], sizeof corner[0]);
        if (i % 21 == 0)
            memcpy(corner[2], corner[0], sizeof corner[0]);
        plain_record_store(&format, (const double(*)[3])corner, none, records + i * format.bytes);
    }
}

/* Of the shortest edge, or the longest. */
static int plain_bin(const struct plain_face *f, bool longest)
{
    double shortest = HUGE_VAL, most = 0;
    int exponent = 0;
    for (int k = 0; k < 3; k++) {
        double square = 0;
        for (int a = 0; a < 3; a++)
            square += (f->corner[(k + 1) % 3][a] - f->corner[k][a]) * (f->corner[(k + 1) % 3][a] - f->corner[k][a]);
        if (square > 0 && square < shortest)
            shortest = square;
        most = fmax(most, square);
    }
    frexp(longest ? most : shortest, &exponent);
    return shortest < HUGE_VAL ? exponent + SPB_EDGE_BINS - 64 : -1;
}

static double plain_volume(const struct plain_face *f)
{
    const double *p = f->corner[0], *q = f->corner[1], *r = f->corner[2];
    return p[0] * (q[1] * r[2] - q[2] * r[1]) + p[1] * (q[2] * r[0] - q[0] * r[2]) +
           p[2] * (q[0] * r[1] - q[1] * r[0]);
}

static void compare(bool wide, uint32_t count)
{
    static uint8_t records[MOST * 72];
    const struct spb_record_format format = spb_record_format(wide, false);
    struct spb_space space;
    struct spb_measures m;
    struct spb_bins bins[MOST];
    double volume = 0, min[3] = {9, 9, 9}, max[3] = {0, 0, 0};
    spb_space_init(&space, (const double[3]){5, 5, 5}, (const double[3]){6, 6, 6});
    make_records(wide, count, records);
    spb_survey_measure(&format, &space, records, count, &m, bins);
    for (uint32_t i = 0; i < count; i++) {
        struct plain_face face;
        plain_record_load(&format, &space, records + i * format.bytes, &face);
        ck_assert_int_eq(bins[i].edge, plain_bin(&face, false));
        ck_assert_int_eq(bins[i].size, plain_bin(&face, true));
        volume += plain_volume(&face);
        for (int k = 0; k < 9; k++) {
            const double x = face.corner[k / 3][k % 3] * ldexp(1, space.unit_exp) + space.origin[k % 3];
            min[k % 3] = fmin(min[k % 3], x);
            max[k % 3] = fmax(max[k % 3], x);
        }
    }
    ck_assert_double_eq_tol(m.volume, volume, 1e-12 * count);
    for (int a = 0; a < 3; a++) {
        ck_assert_double_eq(m.file_min[a], min[a]);
        ck_assert_double_eq(m.file_max[a], max[a]);
    }
}

START_TEST(batches_measure_what_faces_do)
{
    for (uint32_t count = 1; count <= MOST; count = count < 4 ? count + 1 : count * 2 + 1) {
        compare(false, count);
        compare(true, count);
    }
}
END_TEST

START_TEST(the_short_edge_is_the_tenth_percentile_and_sizes_are_counted)
{
    struct spb_survey *s = malloc(sizeof *s);
    const struct spb_measures none = {{0}, {0}, 0};
    const int one = SPB_EDGE_BINS - 64 + 1;         /* squares in [1, 2) */
    struct spb_bins bins[100];
    spb_survey_init(s);
    ck_assert_double_eq(spb_survey_short_edge(s), 0);
    for (int i = 0; i < 100; i++)
        bins[i] = (struct spb_bins){(int16_t)(i < 10 ? one - 40 : i < 60 ? one - 4 : one),
                                    (int16_t)(i < 20 ? one - 20 : one + 1)};
    spb_survey_add(s, &none, bins, 100);
    ck_assert_double_eq(spb_survey_short_edge(s), 0.25);
    ck_assert_uint_eq(spb_survey_smaller(s, -10), 0);       /* sizes in [2^-10, 2^-9.5) */
    ck_assert_uint_eq(spb_survey_smaller(s, -9), 20);
    ck_assert_uint_eq(spb_survey_smaller(s, 0), 20);
    ck_assert_uint_eq(spb_survey_smaller(s, 1), 100);
    for (int i = 90; i < 100; i++)
        bins[i] = (struct spb_bins){-1, -1};        /* no edges: not counted */
    spb_survey_init(s);
    spb_survey_add(s, &none, bins, 100);
    ck_assert_double_eq(spb_survey_short_edge(s), 0x1p-20);
    ck_assert_uint_eq(spb_survey_smaller(s, 1), 90);
    free(s);
}
END_TEST

int main(void)
{
    return SUITE("survey", NULL, NULL, batches_measure_what_faces_do,
                 the_short_edge_is_the_tenth_percentile_and_sizes_are_counted);
}
