/*
 * soft_hidden.c - which clusters lie behind what is drawn already.
 *
 * A coarse map holds the farthest depth of each square of pixels. A cluster whose box, with all that its
 * splats may stick out of it, is farther than that on all squares it could reach cannot change a pixel:
 * pixels take the larger word, and every word of it would be smaller. So the picture is the same without it.
 */
#include "soft_int.h"

#include "threads.h"

#include <math.h>
#include <stdlib.h>

enum { SQUARE_PX = 8 };

struct mapping {
    const struct soft_frame *frame;
    struct soft_map *map;
};

/* A row of squares. Nobody draws meanwhile, so pixels are read as plain words: vectors, eight at a time. */
static bool map_row(void *ctx, unsigned worker, size_t row)
{
    const struct mapping *m = ctx;
    const int width = m->frame->tile.width, y0 = (int)row * SQUARE_PX;
    const int y1 = y0 + SQUARE_PX < m->frame->tile.height ? y0 + SQUARE_PX : m->frame->tile.height;
    uint32_t *out = m->map->farthest + row * (size_t)m->map->width;
    (void)worker;
    for (int x = 0; x < width; x += SQUARE_PX, out++) {
        const int n = width - x < SQUARE_PX ? width - x : SQUARE_PX;
        uint64_t least = UINT64_MAX;
        for (int y = y0; y < y1; y++) {
            const uint64_t *words = (const uint64_t *)(const void *)m->frame->words + (size_t)y * m->frame->pitch + x;
            for (int k = 0; k < n; k++)
                least = words[k] < least ? words[k] : least;
        }
        *out = (uint32_t)(least >> 32);
    }
    return true;
}

bool spv_soft_map(struct spv_threads *threads, const struct soft_frame *f, struct soft_map *map)
{
    map->width = (f->tile.width + SQUARE_PX - 1) / SQUARE_PX;
    map->height = (f->tile.height + SQUARE_PX - 1) / SQUARE_PX;
    const size_t n = (size_t)map->width * (size_t)map->height;
    if (n > map->max) {
        free(map->farthest);
        map->farthest = malloc(n * sizeof *map->farthest);
        map->max = map->farthest != NULL ? n : 0;
    }
    if (map->farthest == NULL)
        return false;
    struct mapping m = {f, map};
    spv_threads_run(threads, (size_t)map->height, map_row, &m);
    return true;
}

/* Of a cylinder out of its ball, which the box holds. */
static double rim_of(const struct spc_cluster *c)
{
    return 0.4143 * (double)c->radius_max;
}

/* The box lies wholly outside of a side of the tile, which is one pixel wider. */
static bool outside(const struct soft_frame *f, const struct spc_cluster *c, const double eye[3])
{
    const double pad = rim_of(c), edges[4] = {-1, f->tile.width + 1, -1, f->tile.height + 1};       /* px */
    for (int p = 0; p < 4; p++) {
        double far = 0, scale = 0;
        for (int a = 0; a < 3; a++) {
            const double slope = (edges[p] - f->center[p / 2]) / f->focal;
            const double n = (p % 2 ? -1 : 1) * (f->axes[p / 2][a] - slope * f->axes[2][a]);
            const double at = (n > 0 ? (double)c->box[a + 3] + pad : (double)c->box[a] - pad) - eye[a];
            far += n * at;
            scale += fabs(n * at);
        }
        if (far < -1e-6 * scale)
            return true;
    }
    return false;
}

struct view_box {
    double low[3], high[3];         /* along the view's axes, units */
};

/* Grown by all that a splat may reach beyond: its rim, 1/64 px and roundings in float32. */
static void along_view(const struct soft_frame *f, const struct spc_cluster *c, const double eye[3],
                       struct view_box *out)
{
    const double pad = rim_of(c);
    double far2 = 0;
    for (int v = 0; v < 3; v++) {
        double low = 0, high = 0;
        for (int a = 0; a < 3; a++) {
            const double n = f->axes[v][a], l = (double)c->box[a] - pad - eye[a],
                         h = (double)c->box[a + 3] + pad - eye[a];
            low += n * (n > 0 ? l : h);
            high += n * (n > 0 ? h : l);
        }
        const double far = fmax(fabs(low), fabs(high));
        far2 += far * far;
        out->low[v] = low;
        out->high[v] = high;
    }
    const double slack = sqrt(far2) * (2 * (double)SOFT_MARGIN_PX / f->focal + 0x1p-18);
    for (int v = 0; v < 3; v++) {
        out->low[v] -= slack;
        out->high[v] += slack;
    }
}

/* Pixels from the projections of low and high, one wider, as squares of size px; false: none in the tile. */
static bool squares_between(double low, double high, int size, int *first, int *last)
{
    *first = (int)fmin(fmax(floor(low) - 1, 0), size);
    *last = (int)fmax(fmin(ceil(high) + 1, size - 1), -1);
    const bool some = *first <= *last;
    *first /= SQUARE_PX;
    *last = some ? *last / SQUARE_PX : -1;
    return some;
}

enum soft_sight spv_soft_sight(const struct soft_frame *f, const struct soft_map *map, const struct spc_cluster *c,
                               const double eye[3])
{
    struct view_box box;
    int from[2], to[2];
    const bool whole = f->tile.width == f->view->camera.width && f->tile.height == f->view->camera.height;
    if (!whole && outside(f, c, eye))
        return SOFT_OUTSIDE;
    along_view(f, c, eye, &box);
    const double near = box.low[2], far = box.high[2];
    if (map == NULL || !(near > 4 * (double)SOFT_NEAR))
        return SOFT_SEEN;
    for (int a = 0; a < 2; a++) {
        const double low = box.low[a] / (box.low[a] < 0 ? near : far);
        const double high = box.high[a] / (box.high[a] > 0 ? near : far);
        if (!squares_between(f->center[a] + f->focal * low, f->center[a] + f->focal * high,
                             a ? f->tile.height : f->tile.width, &from[a], &to[a]))
            return SOFT_OUTSIDE;
    }
    const uint32_t w = soft_bits(nextafterf((float)((double)f->unit / near), INFINITY));
    for (int y = from[1]; y <= to[1]; y++)
        for (int x = from[0]; x <= to[0]; x++)
            if (map->farthest[(size_t)y * (size_t)map->width + (size_t)x] <= w)
                return SOFT_SEEN;
    return SOFT_HIDDEN;
}
