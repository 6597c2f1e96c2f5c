/*
 * soft_int.h - what the files of the back end without GL share.
 *
 * View coordinates here: units, from the eye; x to the right, y down, z forward. w is 1 / z, in units that
 * are one for all parts: powers of two lie between them.
 *
 * A pixel is one word: the bits of w above, larger is nearer, the colour (r, g, b, 255 from the low
 * byte up) below; 0 is empty. What is drawn takes the pixel's maximum, which does not depend on
 * order: the same picture from any number of threads. Of two that lie equally far the colour with the
 * larger word is seen: more blue, then more green, then more red. w keeps its relative precision from
 * 2^-39 to 2^100 units.
 */
#ifndef SPV_SOFT_INT_H
#define SPV_SOFT_INT_H

#include "lanes.h"
#include "draw_int.h"

#include <stdatomic.h>

enum { SOFT_CHUNK = 256, SOFT_PAIRS = 1024, SOFT_STRIDE = 8, LANES = 8 };
#define SOFT_NEAR 0x1p-40f          /* units: nearer than that nothing is drawn */
static const float SOFT_MARGIN_PX = 1.0f / 64;      /* by which what is drawn is widened (I5) */

/* Eight pixels that are looked at together: two rows of four. */
static const float LANE_X[LANES] = {0, 1, 2, 3, 0, 1, 2, 3};
static const float LANE_Y[LANES] = {0, 0, 0, 0, 1, 1, 1, 1};
static const uint32_t LANE_BIT[LANES] = {1, 2, 4, 8, 16, 32, 64, 128};
enum { LANES_WIDE = 4, LANES_HIGH = 2 };

struct spv_tile {                   /* part of a picture, px, from its top left */
    int x0, y0, width, height;
};

struct soft_frame {                 /* what all blocks of a part share */
    const struct spc_reader *reader;
    const struct spc_header *header;
    const struct spv_view *view, *tested;
    enum spv_splat splat;
    float ambient;
    double axes[3][3];              /* right, down, forward */
    double eye[3];                  /* units */
    double focal, center[2];        /* px; centre in the tile */
    float flat_px;                  /* light is one for what is at most as large as that */
    struct spv_tile tile;
    _Atomic uint64_t *words;        /* [tile.height][pitch], of which tile.width count */
    size_t pitch;
    float unit;                     /* of depths: w is unit / z, in units that all parts share */
    enum spv_paint paint;
    bool alone;                     /* one thread */
    enum spv_lanes lanes;
};

struct soft_block {
    const struct soft_frame *frame;
    struct spc_block b;
    struct spc_cluster c;
    struct spc_block_layout l;
    const uint8_t *payload;
    double eye[3];                  /* in the cluster's coordinates */
    double tested_eye[3];           /* the one that decides what is drawn */
    float missing;                  /* struct spv_interval */
    bool lower;
};

struct soft_vertex {                /* projected */
    double x, y;                    /* px in the tile */
    float w;                        /* 0: not before the eye, no projection */
};

struct soft_counts {
    uint64_t points, triangles;     /* that passed their tests */
    uint64_t tested;                /* nodes, once each */
};

/* Small splats have few pixels each: they are tested together, whichever splat they are of. */
struct soft_pairs {
    uint32_t count;
    uint32_t node[SOFT_PAIRS];      /* in the chunk */
    int x[SOFT_PAIRS], y[SOFT_PAIRS];
    uint32_t w[SOFT_PAIRS];         /* bits */
    uint32_t hit[SOFT_PAIRS];
};

struct soft_scratch {               /* one a thread */
    struct soft_counts counts;
    struct soft_vertex *vertices;
    size_t vertices_max;
    bool projected;                 /* the block's; false at its begin */
    uint8_t pass[SOFT_CHUNK + SOFT_STRIDE];
    /* Nodes of a chunk that passed: number in the block; record without its errors; by view axes. */
    uint32_t index[SOFT_CHUNK], record[3][SOFT_CHUNK];
    uint32_t base[SOFT_CHUNK];      /* colour without light */
    float center[3][SOFT_CHUNK], normal[3][SOFT_CHUNK];
    float radius[SOFT_CHUNK], height[SOFT_CHUNK], w_max[SOFT_CHUNK];
    int x0[SOFT_CHUNK], x1[SOFT_CHUNK], y0[SOFT_CHUNK], y1[SOFT_CHUNK];     /* px, inclusive */
    uint32_t color[SOFT_CHUNK];
    int flat[SOFT_CHUNK];           /* one light for all of it */
    int small[SOFT_CHUNK];          /* 2: one pixel, 1: few, of one light; 0: more; -1: none */
    uint32_t larger[SOFT_CHUNK];    /* those of more than one pixel */
    uint32_t at[SOFT_CHUNK];        /* of their first pixel in the tile, or 0 */
    struct soft_pairs pairs;
};

/*
 * Tests nodes first to first + n <= SOFT_CHUNK for their splats or their triangles, and decodes those
 * that pass into s: index, record, center, normal. Returns how many.
 */
uint32_t spv_soft_gather(const struct soft_block *block, struct soft_scratch *s, uint32_t first,
                         uint32_t n, bool triangles);

/* Colours of the nodes that s->index names into s->base: their own, white, or what is painted. */
void spv_soft_colors(const struct soft_block *block, struct soft_scratch *s, uint32_t count, bool triangles);

/* Draws splats and triangles of nodes first to first + count. */
void spv_soft_points(const struct soft_block *block, struct soft_scratch *s, uint32_t first,
                     uint32_t count);
/* fails (false): no memory for the block's vertices, which the first triangle that is drawn projects. */
bool spv_soft_triangles(const struct soft_block *block, struct soft_scratch *s, uint32_t first,
                        uint32_t count);

/* ---- what is hidden ---------------------------------------------------------------------------- */

struct spv_threads;

struct soft_map {                   /* of each square of pixels the farthest, as bits of w; 0: some are empty */
    uint32_t *farthest;             /* [height][width] */
    int width, height;              /* squares */
    size_t max;
};

/* Of what is drawn in the frame's tile. map: zeroed, or of an earlier frame. fails (false): no memory */
bool spv_soft_map(struct spv_threads *threads, const struct soft_frame *frame, struct soft_map *map);

enum soft_sight { SOFT_OUTSIDE, SOFT_SEEN, SOFT_HIDDEN };

/* A cluster's nodes, in the tile, behind what map says. map may be NULL. eye: of spv_eye_of_cluster */
enum soft_sight spv_soft_sight(const struct soft_frame *frame, const struct soft_map *map,
                               const struct spc_cluster *cluster, const double eye[3]);

/* ---- values ------------------------------------------------------------------------------------ */

SPV_INLINE uint32_t soft_bits(float v)
{
    uint32_t bits;
    memcpy(&bits, &v, sizeof bits);
    return bits;
}

SPV_INLINE float soft_float(uint32_t bits)
{
    float v;
    memcpy(&v, &bits, sizeof v);
    return v;
}

/* Not fminf: these are one instruction, and take b where a is no number. */
SPV_INLINE float soft_min(float a, float b)
{
    return a < b ? a : b;
}

SPV_INLINE float soft_max(float a, float b)
{
    return a > b ? a : b;
}

SPV_INLINE float soft_abs(float v)
{
    return soft_float(soft_bits(v) & 0x7FFFFFFFu);
}

/* First and last pixel whose centre lies at or behind v, at or before v; from 0, and to size - 1. */
SPV_INLINE int soft_first(float v, int size)
{
    const float at = soft_min(soft_max(v - 0.5f, 0), (float)size);
    const int i = (int)at;
    return i + ((float)i < at);
}

SPV_INLINE int soft_last(float v, int size)
{
    const float at = soft_max(soft_min(v - 0.5f, (float)(size - 1)), -1);
    const int i = (int)at;
    return i - ((float)i > at);
}

SPV_INLINE float soft_channel(uint32_t color, int shift)
{
    return (float)(int)(color >> shift & 0xFF);
}

/* ---- pixels ------------------------------------------------------------------------------------ */

SPV_INLINE uint64_t soft_word(uint32_t w_bits, uint32_t color)
{
    return (uint64_t)w_bits << 32 | color;
}

SPV_INLINE void soft_put(const struct soft_frame *f, size_t at, uint64_t word)
{
    _Atomic uint64_t *pixel = &f->words[at];
    uint64_t old = atomic_load_explicit(pixel, memory_order_relaxed);
    if (old >= word)
        return;
    if (f->alone)
        atomic_store_explicit(pixel, word, memory_order_relaxed);
    else
        while (old < word && !atomic_compare_exchange_weak_explicit(
                                 pixel, &old, word, memory_order_relaxed, memory_order_relaxed))
            ;
}

/*
 * Depth of the eight pixels from x, y on, as bits of w; those outside of the tile count as near as can
 * be. A pixel only comes nearer, so what lies behind now need not be put.
 */
SPV_INLINE void soft_depths(const struct soft_frame *f, int x, int y, uint32_t w[LANES])
{
    const size_t at = (size_t)y * f->pitch + (size_t)x;
    if (x + LANES_WIDE <= f->tile.width && y + LANES_HIGH <= f->tile.height) {
        for (size_t k = 0; k < LANES; k++)
            w[k] = (uint32_t)(atomic_load_explicit(
                                  &f->words[at + k / LANES_WIDE * f->pitch + k % LANES_WIDE],
                                  memory_order_relaxed) >> 32);
        return;
    }
    for (int k = 0; k < LANES; k++)
        w[k] = x + k % LANES_WIDE < f->tile.width && y + k / LANES_WIDE < f->tile.height
                   ? (uint32_t)(atomic_load_explicit(
                                    &f->words[at + (size_t)(k / LANES_WIDE) * f->pitch +
                                              (size_t)(k % LANES_WIDE)],
                                    memory_order_relaxed) >> 32)
                   : INT32_MAX;
}

/* Puts those of eight pixels whose bit is set in mask. */
SPV_INLINE void soft_put_lanes(const struct soft_frame *f, int x, int y, uint32_t mask,
                               const uint32_t w[LANES], const uint32_t color[LANES])
{
    const size_t at = (size_t)y * f->pitch + (size_t)x;
    for (; mask != 0; mask &= mask - 1) {
        const unsigned k = (unsigned)__builtin_ctz(mask);
        soft_put(f, at + k / LANES_WIDE * f->pitch + k % LANES_WIDE, soft_word(w[k], color[k]));
    }
}

/* Does something nearer than w_bits already lie on all pixels? */
SPV_INLINE bool soft_hidden(const struct soft_frame *f, int x0, int x1, int y0, int y1,
                            uint32_t w_bits)
{
    const uint64_t word = (uint64_t)w_bits << 32 | 0xFFFFFFFFu;
    for (int y = y0; y <= y1; y++) {
        const _Atomic uint64_t *row = f->words + (size_t)y * f->pitch;
        for (int x = x0; x <= x1; x++)
            if (atomic_load_explicit(&row[x], memory_order_relaxed) <= word)
                return false;
    }
    return true;
}

#endif
