#include "bench_metrics.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

/* Pictures made by hand, of which every figure can be worked out. */

enum { W = 24, H = 16, PIXELS = W * H };
static const uint8_t BACKGROUND[3] = {32, 32, 32};

struct scene {
    struct ref_image fine, centre;
    uint8_t rgba[PIXELS * 4];
};

static struct ref_image empty(int width, int height)
{
    const size_t pixels = (size_t)width * (size_t)height;
    struct ref_image i = {.width = width, .height = height, .depth = malloc(pixels * sizeof *i.depth),
                          .triangle = malloc(pixels * sizeof *i.triangle), .rgb = calloc(pixels, 3)};
    for (size_t k = 0; k < pixels; k++) {
        i.depth[k] = INFINITY;
        i.triangle[k] = UINT32_MAX;
    }
    return i;
}

static struct scene *scene_new(void)
{
    struct scene *s = calloc(1, sizeof *s);
    s->fine = empty(W * BENCH_SAMPLES, H * BENCH_SAMPLES);
    s->centre = empty(W, H);
    return s;
}

/* The first so many samples of a pixel of the reference; the centre counts as covered from the half on. */
static void truth_pixel(struct scene *s, int x, int y, int samples, uint8_t r, uint8_t g, uint8_t b)
{
    const uint8_t rgb[3] = {r, g, b};
    for (int k = 0; k < samples; k++) {
        const size_t at = (size_t)((y * BENCH_SAMPLES + k / BENCH_SAMPLES) * W * BENCH_SAMPLES + x * BENCH_SAMPLES +
                                   k % BENCH_SAMPLES);
        s->fine.triangle[at] = 1;
        memcpy(s->fine.rgb + 3 * at, rgb, 3);
    }
    if (samples >= BENCH_SAMPLES * BENCH_SAMPLES / 2)
        s->centre.triangle[y * W + x] = 1;
}

static void our_pixel(struct scene *s, int x, int y, uint8_t r, uint8_t g, uint8_t b)
{
    const uint8_t rgba[4] = {r, g, b, 255};
    memcpy(s->rgba + 4 * (y * W + x), rgba, 4);
}

/* A grey rectangle in both, x0..x1-1 and y0..y1-1. */
static void grey(struct scene *s, int x0, int x1, int y0, int y1, uint8_t theirs, uint8_t our)
{
    for (int y = y0; y < y1; y++)
        for (int x = x0; x < x1; x++) {
            truth_pixel(s, x, y, 16, theirs, theirs, theirs);
            our_pixel(s, x, y, our, our, our);
        }
}

/* Uses the scene up. */
static struct bench_image judge(struct scene *s)
{
    struct bench_truth truth;
    struct bench_image out;
    ck_assert(bench_truth_init(&truth, &s->fine, &s->centre, BACKGROUND));
    ck_assert(bench_compare(&truth, s->rgba, BACKGROUND, &out));
    bench_truth_release(&truth);
    free(s);
    return out;
}

static void same(double a, double b)
{
    ck_assert_msg(fabs(a - b) < 1e-9, "%.12g is not %.12g", a, b);
}

START_TEST(equal_pictures_have_no_error)
{
    struct scene *s = scene_new();
    grey(s, 4, 20, 2, 14, 120, 120);
    const struct bench_image m = judge(s);
    ck_assert(isinf(m.psnr_db));
    same(m.ssim, 1);
    same(m.shade_mean, 0);
    same(m.shade_max, 0);
    same(m.overlap, 1);
    same(m.overlap_tolerant, 1);
    ck_assert_uint_eq(m.covered, 16 * 12);
    ck_assert_uint_eq(m.holes + m.off, 0);
}
END_TEST

START_TEST(empty_pictures_are_equal)
{
    const struct bench_image m = judge(scene_new());
    ck_assert(isinf(m.psnr_db));
    same(m.ssim, 1);
    same(m.overlap, 1);
    ck_assert_uint_eq(m.covered, 0);
}
END_TEST

/* The empty rest of the picture, where both agree, must not dilute it. */
START_TEST(psnr_is_of_what_is_covered_in_either)
{
    struct scene *s = scene_new();
    grey(s, 0, 8, 0, 8, 100, 110);
    same(judge(s).psnr_db, 20 * log10(255.0 / 10));

    s = scene_new();                /* half of the pixels, one of three channels: a sixth of the squares */
    grey(s, 0, 8, 0, 8, 100, 100);
    for (int i = 0; i < 32; i++)
        our_pixel(s, i % 8, i / 8, 110, 100, 100);
    same(judge(s).psnr_db, 20 * log10(255.0 / 10) + 10 * log10(6));

    s = scene_new();                /* only ours, only theirs: against the background */
    our_pixel(s, 1, 1, 42, 42, 42);
    truth_pixel(s, 5, 5, 16, 52, 52, 52);
    same(judge(s).psnr_db, 10 * log10(255.0 * 255.0 / ((10 * 10 + 20 * 20) / 2.0)));
}
END_TEST

START_TEST(samples_of_a_pixel_are_averaged_with_the_background)
{
    struct scene *s = scene_new();
    struct bench_truth truth;
    truth_pixel(s, 3, 2, 5, 200, 100, 0);
    ck_assert(bench_truth_init(&truth, &s->fine, &s->centre, BACKGROUND));
    const uint8_t *p = truth.rgb + 3 * (2 * W + 3);
    ck_assert_uint_eq(truth.share[2 * W + 3], 5);
    ck_assert_uint_eq(truth.share[2 * W + 4], 0);
    ck_assert_uint_eq(p[0], (5 * 200 + 11 * 32 + 8) / 16);
    ck_assert_uint_eq(p[1], (5 * 100 + 11 * 32 + 8) / 16);
    ck_assert_uint_eq(p[2], (11 * 32 + 8) / 16);
    ck_assert_uint_eq(p[5], 32);
    bench_truth_release(&truth);
    free(s);
}
END_TEST

START_TEST(shades_are_compared_where_both_cover_all_of_a_pixel)
{
    struct scene *s = scene_new();
    truth_pixel(s, 0, 0, 16, 100, 100, 100);
    our_pixel(s, 0, 0, 110, 100, 100);          /* red counts 0.299 */
    truth_pixel(s, 2, 0, 16, 100, 100, 100);
    our_pixel(s, 2, 0, 100, 90, 100);           /* green 0.587: more than a step */
    truth_pixel(s, 4, 0, 16, 100, 100, 100);
    our_pixel(s, 4, 0, 100, 100, 100 + 40);     /* blue 0.114 */
    truth_pixel(s, 6, 0, 15, 100, 100, 100);
    our_pixel(s, 6, 0, 255, 255, 255);          /* an edge */
    truth_pixel(s, 8, 0, 16, 100, 100, 100);    /* not ours */
    our_pixel(s, 10, 0, 255, 255, 255);         /* not theirs */
    const struct bench_image m = judge(s);
    same(m.shade_mean, (2.99 + 5.87 + 4.56) / 3);
    same(m.shade_max, 5.87);
    ck_assert_uint_eq(m.off, 1);
}
END_TEST

START_TEST(a_shade_is_off_when_it_is_more_than_a_step_away)
{
    for (uint8_t d = 0; d < 12; d++) {
        struct scene *s = scene_new();
        grey(s, 0, 3, 0, 3, 100, (uint8_t)(100 - d));
        ck_assert_uint_eq(judge(s).off, d > BENCH_SHADE_STEP ? 9 : 0);
    }
}
END_TEST

START_TEST(outlines_overlap_by_pixels_at_their_centres)
{
    struct scene *s = scene_new();
    grey(s, 4, 14, 3, 13, 100, 100);            /* 100 pixels in both */
    for (int y = 3; y < 13; y++)
        truth_pixel(s, 14, y, 16, 100, 100, 100);           /* 10 in the reference alone, next to them */
    truth_pixel(s, 0, 0, 7, 100, 100, 100);     /* its centre is empty */
    for (int x = 20; x < 24; x++)
        our_pixel(s, x, 8, 100, 100, 100);      /* 4 of ours alone, far away */
    const struct bench_image m = judge(s);
    same(m.overlap, 100.0 / 114);
    same(m.overlap_tolerant, 110.0 / 114);
    ck_assert_uint_eq(m.covered, 110);
    ck_assert_uint_eq(m.holes, 0);
}
END_TEST

START_TEST(holes_are_empty_pixels_within_the_reference)
{
    struct scene *s = scene_new();
    grey(s, 4, 14, 3, 13, 100, 100);
    s->rgba[4 * (8 * W + 9) + 3] = 0;           /* inside */
    s->rgba[4 * (3 * W + 4) + 3] = 0;           /* at the rim */
    const struct bench_image m = judge(s);
    ck_assert_uint_eq(m.holes, 1);
    same(m.overlap, 98.0 / 100);
}
END_TEST

/* One window of 8 x 8: without variance only the means are left. */
START_TEST(ssim_of_flat_windows_follows_from_their_means)
{
    struct scene *s = scene_new();
    const double a = 80, b = 160, c1 = 6.5025;
    grey(s, 0, 8, 0, 8, 80, 160);               /* windows next to it, at 4, are half covered: mixed */
    for (int y = 0; y < H; y++)                 /* so cover all of both */
        for (int x = 0; x < W; x++) {
            truth_pixel(s, x, y, 16, 80, 80, 80);
            our_pixel(s, x, y, 160, 160, 160);
        }
    same(judge(s).ssim, (2 * a * b + c1) / (a * a + b * b + c1));
}
END_TEST

/* Stripes against the opposite stripes: equal means and variances, covariance their negative. */
START_TEST(ssim_of_opposite_stripes_is_negative)
{
    struct scene *s = scene_new();
    const double v = 20 * 20, c2 = 58.5225;
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) {
            const uint8_t light = 120, dark = 80;
            const uint8_t t = x % 2 ? light : dark, o = x % 2 ? dark : light;
            truth_pixel(s, x, y, 16, t, t, t);
            our_pixel(s, x, y, o, o, o);
        }
    same(judge(s).ssim, (-2 * v + c2) / (2 * v + c2));
}
END_TEST

/* Windows begin at multiples of 4; these are empty but for a quarter of one, which does not count. */
START_TEST(windows_less_than_half_covered_do_not_count)
{
    struct scene *s = scene_new();
    grey(s, 0, 4, 0, 4, 50, 200);
    same(judge(s).ssim, 1);
    s = scene_new();
    grey(s, 0, 4, 0, 8, 50, 200);               /* half of the first window, no more of any other */
    ck_assert(judge(s).ssim < 0.9);
}
END_TEST

int main(void)
{
    return SUITE("metrics", NULL, NULL, equal_pictures_have_no_error, empty_pictures_are_equal,
                 psnr_is_of_what_is_covered_in_either, samples_of_a_pixel_are_averaged_with_the_background,
                 shades_are_compared_where_both_cover_all_of_a_pixel, a_shade_is_off_when_it_is_more_than_a_step_away,
                 outlines_overlap_by_pixels_at_their_centres, holes_are_empty_pixels_within_the_reference,
                 ssim_of_flat_windows_follows_from_their_means, ssim_of_opposite_stripes_is_negative,
                 windows_less_than_half_covered_do_not_count);
}
