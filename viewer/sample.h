/*
 * sample.h - several samples a pixel: a larger picture, averaged.
 */
#ifndef SPV_SAMPLE_H
#define SPV_SAMPLE_H

#include "camera.h"

enum { SPV_SAMPLES_MAX = 8 };

/* The same view with n x n samples for a pixel, 1 <= n <= SPV_SAMPLES_MAX. eps stays an angle: it does not change. */
struct spv_camera spv_sample_camera(const struct spv_camera *camera, int n);

/*
 * Averages n x n samples a pixel.
 *
 * in   samples[n height][n width][4]  not covered: alpha 0, whatever its colour
 * out  rgba[height][width][4]         alpha: share that is covered; colour: mean of what is covered; may be samples
 */
void spv_sample_average(const uint8_t *samples, int n, int width, int height, uint8_t *rgba);

#endif
