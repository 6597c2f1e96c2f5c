/*
 * bench_metrics.h - how far a picture is from the reference.
 *
 * Luminance is 0.299 R + 0.587 G + 0.114 B of bytes, as all shades here: levels of 255.
 */
#ifndef BENCH_METRICS_H
#define BENCH_METRICS_H

#include "ref_raster.h"

#include <stdbool.h>

enum { BENCH_SAMPLES = 4 };         /* a side, of a pixel of the reference */

/*
 * A step of the normals' code is at most 0.024 rad, and light falls by at most 204 levels a radian: a pixel
 * that is further off than this is not explained by the code.
 */
enum { BENCH_SHADE_STEP = 5 };

struct bench_truth {
    int width, height;
    uint8_t *rgb;                   /* [height][width][3] mean of the samples, over the background */
    uint8_t *share;                 /* [height][width] samples that are covered */
    struct ref_image outline;       /* one sample at each pixel's centre; its triangle alone */
};

/*
 * Takes the reference together.
 *
 * in   fine     BENCH_SAMPLES as wide and high as centre; both are used up, whatever comes back
 * out  (return) false without memory
 */
bool bench_truth_init(struct bench_truth *truth, struct ref_image *fine, struct ref_image *centre,
                      const uint8_t background[3]);
void bench_truth_release(struct bench_truth *truth);

struct bench_image {
    double psnr_db;                 /* of RGB, over the pixels covered in either picture; INFINITY: equal there */
    /*
     * [WBSS04] of luminance: mean over windows of 8 x 8 pixels, one every 4, of which at least half is covered in
     * either picture; 1 where there is none.
     */
    double ssim;
    double shade_mean, shade_max;   /* of luminance, over the pixels covered wholly in both; 0 without */
    double overlap, overlap_tolerant;           /* of ref_compare_cover */
    uint64_t covered;               /* pixels, of the reference, at their centres */
    uint64_t holes;                 /* of ref_compare_cover */
    uint64_t off;                   /* shades off by more than BENCH_SHADE_STEP */
};

/* rgba[height][width][4]: alpha 0 where nothing is drawn. False without memory. */
bool bench_compare(const struct bench_truth *truth, const uint8_t *rgba, const uint8_t background[3],
                   struct bench_image *out);

#endif
