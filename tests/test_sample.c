/* Several samples a pixel become one: means of what is covered, alpha as the share of it, also in place. */
#include "sample.h"
#include "suite.h"

#include <stdlib.h>
#include <string.h>

enum { WIDTH = 7, HEIGHT = 5, BYTES_MAX = WIDTH * HEIGHT * 4 * SPV_SAMPLES_MAX * SPV_SAMPLES_MAX };

static uint8_t samples[BYTES_MAX], out[WIDTH * HEIGHT * 4];

static uint8_t *sample_at(int n, int x, int y)
{
    return samples + ((size_t)y * WIDTH * (size_t)n + (size_t)x) * 4;
}

/* Random bytes, of which some samples are not covered; those keep a colour, that must not show. */
static void fill(int n, unsigned seed)
{
    uint32_t state = seed;
    for (int i = 0; i < WIDTH * HEIGHT * n * n; i++) {
        for (int c = 0; c < 4; c++) {
            state = state * 1664525 + 1013904223;
            samples[4 * i + c] = (uint8_t)(state >> 24);
        }
        samples[4 * i + 3] = samples[4 * i + 3] < 100 ? 0 : 255;
    }
}

/* One pixel by hand, in floating point. */
static void expect_mean(const uint8_t *pixel, int n, int x, int y)
{
    double sum[4] = {0, 0, 0, 0}, covered = 0;
    for (int v = 0; v < n; v++)
        for (int u = 0; u < n; u++) {
            const uint8_t *p = sample_at(n, x * n + u, y * n + v);
            covered += p[3] > 0;
            for (int c = 0; c < 4; c++)
                sum[c] += p[3] > 0 ? p[c] : 0;
        }
    for (int c = 0; c < 3; c++) {
        const double wanted = covered > 0 ? sum[c] / covered : 0;
        ck_assert_msg(pixel[c] > wanted - 0.51 && pixel[c] < wanted + 0.51, "%d x %d samples at %d %d: %d, not %g", n,
                      n, x, y, pixel[c], wanted);
    }
    ck_assert(pixel[3] > sum[3] / (n * n) - 0.51 && pixel[3] < sum[3] / (n * n) + 0.51);
}

START_TEST(a_pixel_is_the_mean_of_what_is_covered)
{
    for (int n = 1; n <= SPV_SAMPLES_MAX; n++) {
        fill(n, 17u * (unsigned)n);
        spv_sample_average(samples, n, WIDTH, HEIGHT, out);
        for (int y = 0; y < HEIGHT; y++)
            for (int x = 0; x < WIDTH; x++)
                expect_mean(out + 4 * (y * WIDTH + x), n, x, y);
    }
}
END_TEST

START_TEST(nothing_and_all_stay_what_they_are)
{
    for (int n = 1; n <= SPV_SAMPLES_MAX; n++) {
        memset(samples, 255, sizeof samples);
        spv_sample_average(samples, n, WIDTH, HEIGHT, out);
        for (size_t i = 0; i < sizeof out; i++)
            ck_assert_uint_eq(out[i], 255);
        for (size_t i = 3; i < sizeof samples; i += 4)
            samples[i] = 0;
        spv_sample_average(samples, n, WIDTH, HEIGHT, out);
        for (size_t i = 0; i < sizeof out; i++)
            ck_assert_uint_eq(out[i], 0);
    }
}
END_TEST

START_TEST(the_picture_may_take_the_place_of_its_samples)
{
    for (int n = 1; n <= SPV_SAMPLES_MAX; n++) {
        fill(n, 5u + (unsigned)n);
        spv_sample_average(samples, n, WIDTH, HEIGHT, out);
        spv_sample_average(samples, n, WIDTH, HEIGHT, samples);
        ck_assert_mem_eq(samples, out, sizeof out);
    }
}
END_TEST

/* A direction is seen at the same place, n times as far from the top left. */
START_TEST(the_camera_of_samples_sees_the_same)
{
    static const double EYE[3] = {1, 2, 5}, TARGET[3] = {0, 0.5, 0}, UP[3] = {0, 1, 0};
    struct spv_camera camera;
    ck_assert(spv_camera_look(&camera, EYE, TARGET, UP, 0.8, 320, 200));
    for (int n = 1; n <= SPV_SAMPLES_MAX; n++) {
        struct spv_camera larger, wanted = spv_sample_camera(&camera, n);
        ck_assert(spv_camera_look(&larger, EYE, TARGET, UP, 0.8, 320 * n, 200 * n));
        ck_assert_int_eq(wanted.width, larger.width);
        ck_assert_int_eq(wanted.height, larger.height);
        ck_assert(wanted.focal_px > larger.focal_px * (1 - 1e-14) && wanted.focal_px < larger.focal_px * (1 + 1e-14));
        ck_assert_mem_eq(wanted.eye, camera.eye, sizeof camera.eye);
        ck_assert_mem_eq(wanted.forward, camera.forward, sizeof camera.forward);
    }
}
END_TEST

int main(void)
{
    return SUITE("sample", NULL, NULL, a_pixel_is_the_mean_of_what_is_covered, nothing_and_all_stay_what_they_are,
                 the_picture_may_take_the_place_of_its_samples, the_camera_of_samples_sees_the_same);
}
