#include "sample.h"

struct spv_camera spv_sample_camera(const struct spv_camera *camera, int n)
{
    struct spv_camera c = *camera;
    c.width *= n;
    c.height *= n;
    c.focal_px *= n;
    return c;
}

/* A pixel is written behind all samples that are still to be read: rows and columns only shrink. */
void spv_sample_average(const uint8_t *samples, int n, int width, int height, uint8_t *rgba)
{
    const size_t row = (size_t)width * (size_t)n * 4;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            const uint8_t *at = samples + (size_t)y * (size_t)n * row + (size_t)x * (size_t)n * 4;
            uint32_t sum[4] = {0, 0, 0, 0}, covered = 0;
            for (int k = 0; k < n * n; k++) {
                const uint8_t *p = at + (size_t)(k / n) * row + (size_t)(k % n) * 4;
                if (p[3] == 0)
                    continue;
                covered++;
                for (int c = 0; c < 4; c++)
                    sum[c] += p[c];
            }
            uint8_t *out = rgba + ((size_t)y * (size_t)width + (size_t)x) * 4;
            for (int c = 0; c < 3; c++)
                out[c] = (uint8_t)(covered > 0 ? (sum[c] + covered / 2) / covered : 0);
            out[3] = (uint8_t)((sum[3] + (uint32_t)(n * n) / 2) / (uint32_t)(n * n));
        }
}
