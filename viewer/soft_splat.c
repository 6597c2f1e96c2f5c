/*
 * soft_splat.c - splats into the framebuffer (I5).
 *
 * A pill's box along the view axes has a rectangle on screen. Its pixels are looked at in groups of
 * eight: exactly, the ray through each pixel's centre against the cylinder, or, where fast is asked
 * for, all of them. Everything about a pixel is counted from where its ray meets the plane through
 * the pill's centre parallel to the picture: numbers of the size of the pill, so nothing large
 * cancels.
 */
#include "soft_int.h"

#include <math.h>

enum { SMALL_PX = 4 };              /* side of what is small */

struct splats {                     /* what a chunk's splats share */
    const struct soft_frame *frame;
    float unit, focal, inverse, center[2], pad, ambient, flat_px;
    float near, zero;               /* SOFT_NEAR and 0: as constants they would leave branches in the loop */
    int width, height, pitch;
    const uint8_t *next;            /* records of the next chunk, which are read ahead */
    bool fast;
};

/* Light from the eye on a pill: facing is the cosine, squared (glsl.h). */
SPV_INLINE float light_of(float facing2, float rough, float ambient)
{
    const float mix = facing2 + (0.4f - facing2) * (rough * rough);
    return ambient + (1 - ambient) * sqrtf(mix);
}

SPV_INLINE uint32_t lit(float r, float g, float b, float light)
{
    return (uint32_t)(int)(r * light + 0.5f) | (uint32_t)(int)(g * light + 0.5f) << 8 |
           (uint32_t)(int)(b * light + 0.5f) << 16 | 0xFF000000u;
}

/* soft_first, soft_last */
SPV_INLINE int first_px(float v, float zero, float size)
{
    const float at = soft_min(soft_max(v - 0.5f, zero), size);
    const int i = (int)at;
    return i + ((float)i < at);
}

SPV_INLINE int last_px(float v, float zero, float size)
{
    return (int)soft_min(soft_max(v + 0.5f, zero), size) - 1;
}

/* Rectangles on screen, and the colour of what is small. Those behind the eye get an empty one. */
SPV_INLINE void bounds_body(const struct splats *all, struct soft_scratch *s, uint32_t count)
{
    const struct splats own = *all, *p = &own;      /* a copy: no store below can change it */
    const float wide = (float)p->width, high = (float)p->height;
    for (uint32_t i = 0; i < count; i++) {
        const float x = s->center[0][i], y = s->center[1][i], z = s->center[2][i];
        const float nx = s->normal[0][i], ny = s->normal[1][i], nz = s->normal[2][i];
        const uint32_t rest = s->record[2][i];
        const float distance2 = x * x + y * y + z * z;
        float r = soft_float((rest & 0xFFFF) << 15);
        float h = r * (float)(int)((rest >> 16 & 0xFF) + 1) * (1.0f / 256);
        const float pad = p->pad * (sqrtf(distance2) + r);
        r += pad;
        h += pad;
        const float half_x = r * sqrtf(soft_max(1 - nx * nx, 0)) + h * soft_abs(nx);
        const float half_y = r * sqrtf(soft_max(1 - ny * ny, 0)) + h * soft_abs(ny);
        const float half_z = r * sqrtf(soft_max(1 - nz * nz, 0)) + h * soft_abs(nz);
        const float far = 1 / soft_max(z + half_z, p->near);
        const float near = 1 / soft_max(z - half_z, p->near);     /* what is before the eye */
        const float left = x - half_x, right = x + half_x, top = y - half_y, bottom = y + half_y;
        const float px0 = p->center[0] + p->focal * soft_min(left * near, left * far);
        const float px1 = p->center[0] + p->focal * soft_max(right * near, right * far);
        const float py0 = p->center[1] + p->focal * soft_min(top * near, top * far);
        const float py1 = p->center[1] + p->focal * soft_max(bottom * near, bottom * far);
        const int x0 = first_px(px0, p->zero, wide), x1 = last_px(px1, p->zero, wide);
        const int y0 = first_px(py0, p->zero, high), y1 = last_px(py1, p->zero, high);
        const int some = (z + half_z > p->near) & (x0 <= x1) & (y0 <= y1);
        const int small = (soft_max(px1 - px0, py1 - py0) <= p->flat_px) & (x1 - x0 < SMALL_PX) & (y1 - y0 < SMALL_PX);
        s->small[i] = (small & some) + (small & some & (x0 == x1) & (y0 == y1)) + some - 1;
        s->at[i] = (uint32_t)(-some & (y0 * p->pitch + x0));
        s->x0[i] = x0;
        s->x1[i] = x1;
        s->y0[i] = y0;
        s->y1[i] = y1;
        s->radius[i] = r;
        s->height[i] = h;
        s->w_max[i] = p->unit * soft_min(near, 0.5f / SOFT_NEAR);    /* of no pixel more: what is hidden is left out */
        s->flat[i] = soft_max(px1 - px0, py1 - py0) <= p->flat_px;
        const float dot = nx * x + ny * y + nz * z;
        const float rough = (float)(int)(rest >> 16 & 0xFF) * (1.0f / 255);
        const float facing2 = soft_min(dot * dot / soft_max(distance2, 0x1p-120f), 1);
        const uint32_t color = s->base[i];
        s->color[i] = lit(soft_channel(color, 0), soft_channel(color, 8), soft_channel(color, 16),
                          light_of(facing2, rough, p->ambient));
    }
}

SPV_VERSIONS(bounds, bounds_body, (const struct splats *p, struct soft_scratch *s, uint32_t count), (p, s, count));

struct pixels {                     /* eight of a splat, from x, y on */
    int x, y;
    uint32_t mask;                  /* covered, and not hidden */
    uint32_t w[LANES];              /* bits */
    uint32_t color[LANES];
};

struct pill {
    float center[3], normal[3], radius, height, w_max;
};

SPV_INLINE struct pill pill_of(const struct soft_scratch *s, uint32_t i)
{
    return (struct pill){{s->center[0][i], s->center[1][i], s->center[2][i]},
                         {s->normal[0][i], s->normal[1][i], s->normal[2][i]},
                         s->radius[i], s->height[i], s->w_max[i]};
}

/* Does the ray dx, dy, 1 meet the cylinder? Depth is that of the disk's plane, kept inside the cylinder. */
SPV_INLINE uint32_t meets(const struct pill *s, float unit, float dx, float dy, uint32_t *w)
{
    const float cx = s->center[0], cy = s->center[1], cz = s->center[2];
    const float nx = s->normal[0], ny = s->normal[1], nz = s->normal[2], h = s->height;
    const float gx = cz * dx - cx, gy = cz * dy - cy;       /* the ray at the centre's depth */
    const float a = nx * dx + ny * dy + nz, b = nx * gx + ny * gy;
    const float ax = dx - nx * a, ay = dy - ny * a, az = 1 - nz * a;
    const float bx = gx - nx * b, by = gy - ny * b, bz = -nz * b;
    const float A = soft_max(ax * ax + ay * ay + az * az, 1e-12f);
    const float B = bx * ax + by * ay + bz * az;
    const float C = bx * bx + by * by + bz * bz - s->radius * s->radius;
    const float D = B * B - A * C;
    const bool steep = soft_abs(a) > 1e-6f;
    const float per_a = 1 / (steep ? a : 1), per_A = 1 / A, root = sqrtf(soft_max(D, 0));
    const float plane = steep ? -b * per_a : 0;
    const float slab = steep ? h * soft_abs(per_a) : 1e30f;
    const float lo = soft_max(plane - slab, (-B - root) * per_A);
    const float hi = soft_min(plane + slab, (-B + root) * per_A);
    const float at = soft_max(cz + soft_max(soft_min(plane, hi), lo), 2 * SOFT_NEAR);
    *w = soft_bits(soft_min(unit / at, s->w_max));
    return (steep | (soft_abs(b) <= h)) & (D >= 0) & (lo <= hi) & (cz + hi > 0);
}

SPV_INLINE void cover_body(const struct splats *p, const struct soft_scratch *s, uint32_t i,
                           const uint32_t behind[LANES], struct pixels *out)
{
    const struct pill pill = pill_of(s, i);
    const float left = (float)out->x + 0.5f - p->center[0], top = (float)out->y + 0.5f - p->center[1];
    const float last_x = (float)(s->x1[i] - out->x), last_y = (float)(s->y1[i] - out->y);
    const float unit = p->unit, inverse = p->inverse;
    uint32_t mask = 0;
    SPV_ROLLED
    for (int k = 0; k < LANES; k++) {
        uint32_t w;
        const uint32_t met = meets(&pill, unit, (left + LANE_X[k]) * inverse, (top + LANE_Y[k]) * inverse, &w);
        const bool hit = met & (LANE_X[k] <= last_x) & (LANE_Y[k] <= last_y) & ((int)w >= (int)behind[k]);
        out->w[k] = w;
        mask |= hit ? LANE_BIT[k] : 0;
    }
    out->mask = mask;
}

/* Depth of the fast mode, as bits of w: the centre's. */
SPV_INLINE uint32_t center_w(const struct splats *p, const struct soft_scratch *s, uint32_t i)
{
    return soft_bits(soft_min(p->unit / soft_max(s->center[2][i], 2 * SOFT_NEAR), s->w_max[i]));
}

/* The rectangle of the fast mode: no test. */
SPV_INLINE void fill_body(const struct splats *p, const struct soft_scratch *s, uint32_t i,
                          const uint32_t behind[LANES], struct pixels *out)
{
    const uint32_t w = center_w(p, s, i);
    const float last_x = (float)(s->x1[i] - out->x), last_y = (float)(s->y1[i] - out->y);
    uint32_t mask = 0;
    SPV_ROLLED
    for (int k = 0; k < LANES; k++) {
        const bool hit =
            (LANE_X[k] <= last_x) & (LANE_Y[k] <= last_y) & ((int)w >= (int)behind[k]);
        out->w[k] = w;
        mask |= hit ? LANE_BIT[k] : 0;
    }
    out->mask = mask;
}

SPV_INLINE void shade_body(const struct splats *p, const struct soft_scratch *s, uint32_t i,
                           struct pixels *out)
{
    const float nx = s->normal[0][i], ny = s->normal[1][i], nz = s->normal[2][i];
    const float left = (float)out->x + 0.5f - p->center[0], top = (float)out->y + 0.5f - p->center[1];
    const float rough = (float)(int)(s->record[2][i] >> 16 & 0xFF) * (1.0f / 255);
    const uint32_t color = s->base[i];
    const float r = soft_channel(color, 0), g = soft_channel(color, 8), b = soft_channel(color, 16);
    SPV_ROLLED
    for (int k = 0; k < LANES; k++) {
        const float dx = (left + LANE_X[k]) * p->inverse, dy = (top + LANE_Y[k]) * p->inverse;
        const float a = nx * dx + ny * dy + nz;
        const float facing2 = soft_min(a * a / (dx * dx + dy * dy + 1), 1);
        out->color[k] = lit(r, g, b, light_of(facing2, rough, p->ambient));
    }
}

SPV_INLINE void draw_pixels(const struct splats *p, const struct soft_scratch *s, uint32_t i, int x,
                            int y)
{
    struct pixels out = {.x = x, .y = y};
    uint32_t behind[LANES];
    soft_depths(p->frame, x, y, behind);
    if (p->fast)
        fill_body(p, s, i, behind, &out);
    else
        cover_body(p, s, i, behind, &out);
    if (out.mask == 0)
        return;
    if (!s->flat[i])
        shade_body(p, s, i, &out);
    else
        for (int k = 0; k < LANES; k++)
            out.color[k] = s->color[i];
    soft_put_lanes(p->frame, x, y, out.mask, out.w, out.color);
}

/* ---- small splats ------------------------------------------------------------------------------ */

SPV_INLINE void pairs_body(const struct splats *p, const struct soft_scratch *s, struct soft_pairs *pairs)
{
    const float unit = p->unit, inverse = p->inverse, left = 0.5f - p->center[0], top = 0.5f - p->center[1];
    const uint32_t count = pairs->count;
    if (p->fast) {
        for (uint32_t k = 0; k < count; k++) {
            const uint32_t i = pairs->node[k];
            pairs->hit[k] = 1;
            pairs->w[k] = center_w(p, s, i);
        }
        return;
    }
    for (uint32_t k = 0; k < count; k++) {
        const struct pill pill = pill_of(s, pairs->node[k]);
        const float dx = ((float)pairs->x[k] + left) * inverse, dy = ((float)pairs->y[k] + top) * inverse;
        pairs->hit[k] = meets(&pill, unit, dx, dy, &pairs->w[k]);
    }
}

SPV_INLINE void put_pairs(const struct splats *p, struct soft_scratch *s)
{
    struct soft_pairs *pairs = &s->pairs;
    const struct soft_frame *f = p->frame;
    const size_t pitch = (size_t)p->pitch;
    const uint32_t count = pairs->count;
    const bool alone = f->alone;
    pairs_body(p, s, pairs);
    for (uint32_t k = 0; k < count; k++) {
        const uint64_t hit = (uint64_t)0 - pairs->hit[k];       /* no branch: half of them miss, at random */
        const uint64_t word = soft_word(pairs->w[k], s->color[pairs->node[k]]) & hit;
        const size_t at = (size_t)pairs->y[k] * pitch + (size_t)pairs->x[k];
        if (alone) {
            const uint64_t old = atomic_load_explicit(&f->words[at], memory_order_relaxed);
            atomic_store_explicit(&f->words[at], old > word ? old : word, memory_order_relaxed);
        } else
            soft_put(f, at, word);
    }
    pairs->count = 0;
}

/* Written first, kept if it counts and is not hidden: no branch. */
SPV_INLINE uint32_t add_pair(struct soft_pairs *pairs, uint32_t n, uint32_t node, int x, int y,
                             const _Atomic uint64_t *pixel, uint32_t w_max, bool counts)
{
    const uint64_t there = atomic_load_explicit(pixel, memory_order_relaxed);
    pairs->node[n] = node;
    pairs->x[n] = x;
    pairs->y[n] = y;
    return n + (counts & ((uint32_t)(there >> 32) <= w_max));
}

SPV_INLINE void add_splat(const struct splats *p, struct soft_scratch *s, uint32_t i)
{
    struct soft_pairs *pairs = &s->pairs;
    const uint32_t w_max = soft_bits(s->w_max[i]);
    const int x0 = s->x0[i], x1 = s->x1[i], y0 = s->y0[i], y1 = s->y1[i];
    const _Atomic uint64_t *row = &p->frame->words[s->at[i]];
    uint32_t n = pairs->count;
    if (x1 - x0 < 2 && y1 - y0 < 2) {
        const _Atomic uint64_t *below = y1 > y0 ? row + p->pitch : row;
        n = add_pair(pairs, n, i, x0, y0, row, w_max, true);
        n = add_pair(pairs, n, i, x1, y0, row + (x1 - x0), w_max, x1 > x0);
        n = add_pair(pairs, n, i, x0, y1, below, w_max, y1 > y0);
        n = add_pair(pairs, n, i, x1, y1, below + (x1 - x0), w_max, (x1 > x0) & (y1 > y0));
    } else {
        for (int y = y0; y <= y1; y++, row += p->pitch)
            for (int x = x0; x <= x1; x++)
                n = add_pair(pairs, n, i, x, y, row + (x - x0), w_max, true);
    }
    pairs->count = n;
}

/*
 * Those of one pixel into pairs, unless hidden, those of more into s->larger; returns how many these are. No branch:
 * what comes is random.
 */
SPV_INLINE uint32_t sort_splats(const struct splats *p, struct soft_scratch *s, uint32_t count)
{
    struct soft_pairs *pairs = &s->pairs;
    const _Atomic uint64_t *words = p->frame->words;
    uint32_t n = 0, m = 0;
    for (uint32_t i = 0; i < count; i++) {
        const int kind = s->small[i];
        __builtin_prefetch(p->next + (size_t)SPC_NODE_BYTES * i);
        const uint32_t there = (uint32_t)(atomic_load_explicit(&words[s->at[i]], memory_order_relaxed) >> 32);
        pairs->node[n] = s->larger[m] = i;
        pairs->x[n] = s->x0[i];
        pairs->y[n] = s->y0[i];
        n += (kind == 2) & (there <= soft_bits(s->w_max[i]));
        m += (uint32_t)kind < 2;
    }
    pairs->count = n;
    return m;
}

SPV_INLINE void draw_large(const struct splats *p, const struct soft_scratch *s, uint32_t i)
{
    if (soft_hidden(p->frame, s->x0[i], s->x1[i], s->y0[i], s->y1[i], soft_bits(s->w_max[i])))
        return;
    for (int y = s->y0[i]; y <= s->y1[i]; y += LANES_HIGH)
        for (int x = s->x0[i]; x <= s->x1[i]; x += LANES_WIDE)
            draw_pixels(p, s, i, x, y);
}

SPV_INLINE void draw_body(const struct splats *p, struct soft_scratch *s, uint32_t count)
{
    const uint32_t larger = sort_splats(p, s, count);
    for (uint32_t k = 0; k < larger; k++) {
        const uint32_t i = s->larger[k];
        if (s->small[i] == 0) {
            draw_large(p, s, i);
            continue;
        }
        add_splat(p, s, i);
        if (s->pairs.count > SOFT_PAIRS - SMALL_PX * SMALL_PX - 1)
            put_pairs(p, s);
    }
    put_pairs(p, s);
}

SPV_VERSIONS(draw, draw_body, (const struct splats *p, struct soft_scratch *s, uint32_t count), (p, s, count));

void spv_soft_points(const struct soft_block *b, struct soft_scratch *s, uint32_t first,
                     uint32_t count)
{
    const struct soft_frame *f = b->frame;
    struct splats p = {
        .frame = f,
        .unit = f->unit, .near = SOFT_NEAR, .zero = 0,
        .focal = (float)f->focal, .inverse = (float)(1 / f->focal),
        .center = {(float)f->center[0], (float)f->center[1]},
        .pad = (float)(1.05 * (double)SOFT_MARGIN_PX / f->focal),       /* and roundings */
        .ambient = f->ambient, .flat_px = f->flat_px,
        .width = f->tile.width, .height = f->tile.height, .pitch = (int)f->pitch,
        .fast = f->splat == SPV_SPLAT_FAST,
    };
    for (uint32_t at = 0; at < count; at += SOFT_CHUNK) {
        const uint32_t n = count - at < SOFT_CHUNK ? count - at : SOFT_CHUNK;
        const uint32_t k = spv_soft_gather(b, s, first + at, n, false);
        const bool whole = count - at - n >= SOFT_CHUNK;
        p.next = b->payload + b->l.nodes + (size_t)SPC_NODE_BYTES * (first + at + (whole ? n : 0));
        s->counts.points += k;
        spv_soft_colors(b, s, k, false);
        bounds[f->lanes](&p, s, k);
        draw[f->lanes](&p, s, k);
    }
}
