#include "bench_metrics.h"

#include <math.h>
#include <stdlib.h>

enum { WINDOW = 8, STRIDE = 4, SAMPLES = BENCH_SAMPLES * BENCH_SAMPLES };

/* ---- the reference ------------------------------------------------------------------------------ */

/* Mean colour of a pixel, samples that miss counting as background, and how many hit. */
static uint8_t average(const struct ref_image *fine, int x, int y, const uint8_t background[3], uint8_t rgb[3])
{
    unsigned sum[3] = {0, 0, 0};
    uint8_t hits = 0;
    for (int k = 0; k < SAMPLES; k++) {
        const size_t at = (size_t)(y * BENCH_SAMPLES + k / BENCH_SAMPLES) * (size_t)fine->width +
                          (size_t)(x * BENCH_SAMPLES + k % BENCH_SAMPLES);
        const bool hit = fine->triangle[at] != UINT32_MAX;
        for (int c = 0; c < 3; c++)
            sum[c] += hit ? fine->rgb[3 * at + (size_t)c] : background[c];
        hits = (uint8_t)(hits + hit);
    }
    for (int c = 0; c < 3; c++)
        rgb[c] = (uint8_t)((sum[c] + SAMPLES / 2) / SAMPLES);
    return hits;
}

bool bench_truth_init(struct bench_truth *t, struct ref_image *fine, struct ref_image *centre,
                      const uint8_t background[3])
{
    const size_t pixels = (size_t)centre->width * (size_t)centre->height;
    *t = (struct bench_truth){.width = centre->width, .height = centre->height, .outline = *centre};
    free(centre->depth);
    free(centre->rgb);
    t->outline.depth = NULL;
    t->outline.rgb = NULL;
    t->rgb = malloc(pixels * 3);
    t->share = malloc(pixels);
    const bool made = t->rgb != NULL && t->share != NULL;
    for (size_t i = 0; i < pixels && made; i++)
        t->share[i] = average(fine, (int)(i % (size_t)t->width), (int)(i / (size_t)t->width), background,
                              t->rgb + 3 * i);
    ref_image_release(fine);
    *centre = (struct ref_image){0};
    if (!made)
        bench_truth_release(t);
    return made;
}

void bench_truth_release(struct bench_truth *t)
{
    free(t->rgb);
    free(t->share);
    ref_image_release(&t->outline);
    *t = (struct bench_truth){0};
}

/* ---- comparing ---------------------------------------------------------------------------------- */

struct pair {
    const struct bench_truth *truth;
    const uint8_t *rgba, *background;
};

/* The picture's colour at a pixel, over the background. */
static const uint8_t *ours(const struct pair *p, size_t at)
{
    return p->rgba[4 * at + 3] != 0 ? p->rgba + 4 * at : p->background;
}

static bool in_either(const struct pair *p, size_t at)
{
    return p->truth->share[at] > 0 || p->rgba[4 * at + 3] != 0;
}

/* In thousandths, which is exact: what is a step off is so wherever it lies. */
static int luminance(const uint8_t *rgb)
{
    return 299 * rgb[0] + 587 * rgb[1] + 114 * rgb[2];
}

static double psnr(const struct pair *p, size_t pixels)
{
    double sum = 0;
    uint64_t count = 0;
    for (size_t i = 0; i < pixels; i++) {
        if (!in_either(p, i))
            continue;
        count += 3;
        for (size_t c = 0; c < 3; c++) {
            const double d = (double)ours(p, i)[c] - (double)p->truth->rgb[3 * i + c];
            sum += d * d;
        }
    }
    return sum > 0 ? 10 * log10(255.0 * 255.0 * (double)count / sum) : INFINITY;
}

static void shades(const struct pair *p, size_t pixels, struct bench_image *out)
{
    uint64_t sum = 0, count = 0;
    int most = 0;
    for (size_t i = 0; i < pixels; i++) {
        if (p->truth->share[i] < SAMPLES || p->rgba[4 * i + 3] == 0)
            continue;
        const int d = abs(luminance(ours(p, i)) - luminance(p->truth->rgb + 3 * i));
        sum += (uint64_t)d;
        count++;
        most = d > most ? d : most;
        out->off += d > BENCH_SHADE_STEP * 1000;
    }
    out->shade_max = most / 1e3;
    out->shade_mean = count > 0 ? (double)sum / 1e3 / (double)count : 0;
}

/* False: less than half of the window is covered. */
static bool window_ssim(const struct pair *p, int x0, int y0, double *out)
{
    const double n = WINDOW * WINDOW, c1 = 0.01 * 255 * 0.01 * 255, c2 = 0.03 * 255 * 0.03 * 255;
    double a = 0, b = 0, aa = 0, bb = 0, ab = 0;
    int covered = 0;
    for (int k = 0; k < WINDOW * WINDOW; k++) {
        const size_t at = (size_t)(y0 + k / WINDOW) * (size_t)p->truth->width + (size_t)(x0 + k % WINDOW);
        const double u = luminance(p->truth->rgb + 3 * at) / 1e3, v = luminance(ours(p, at)) / 1e3;
        covered += in_either(p, at);
        a += u;
        b += v;
        aa += u * u;
        bb += v * v;
        ab += u * v;
    }
    a /= n;
    b /= n;
    const double va = fmax(0, aa / n - a * a), vb = fmax(0, bb / n - b * b), cov = ab / n - a * b;
    *out = (2 * a * b + c1) * (2 * cov + c2) / ((a * a + b * b + c1) * (va + vb + c2));
    return 2 * covered >= WINDOW * WINDOW;
}

static double ssim(const struct pair *p)
{
    double sum = 0, one;
    uint64_t count = 0;
    for (int y = 0; y + WINDOW <= p->truth->height; y += STRIDE)
        for (int x = 0; x + WINDOW <= p->truth->width; x += STRIDE)
            if (window_ssim(p, x, y, &one)) {
                sum += one;
                count++;
            }
    return count > 0 ? sum / (double)count : 1;
}

static bool outlines(const struct pair *p, size_t pixels, struct bench_image *out)
{
    struct ref_compare c;
    uint8_t *cover = malloc(pixels);
    if (cover == NULL)
        return false;
    for (size_t i = 0; i < pixels; i++) {
        cover[i] = p->rgba[4 * i + 3] >= 128;          /* half of its samples */
        out->covered += p->truth->outline.triangle[i] != UINT32_MAX;
    }
    ref_compare_cover(&p->truth->outline, cover, &c);
    free(cover);
    out->overlap = c.overlap;
    out->overlap_tolerant = c.overlap_tolerant;
    out->holes = c.holes;
    return true;
}

bool bench_compare(const struct bench_truth *t, const uint8_t *rgba, const uint8_t background[3],
                   struct bench_image *out)
{
    const struct pair p = {t, rgba, background};
    const size_t pixels = (size_t)t->width * (size_t)t->height;
    *out = (struct bench_image){.psnr_db = psnr(&p, pixels), .ssim = ssim(&p)};
    shades(&p, pixels, out);
    return outlines(&p, pixels, out);
}
