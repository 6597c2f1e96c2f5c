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

struct splats {                     /* what a chunk's splats share */
    const struct soft_frame *frame;
    float unit, focal, inverse, center[2], pad, ambient, flat_px;
    int width, height;
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

/* Rectangles on screen, and the colour of what is small. Those behind the eye get an empty one. */
SPV_INLINE void bounds_body(const struct splats *all, struct soft_scratch *s, uint32_t count)
{
    const struct splats own = *all, *p = &own;      /* a copy: no store below can change it */
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
        const float far = 1 / soft_max(z + half_z, SOFT_NEAR);
        const float near = 1 / soft_max(z - half_z, SOFT_NEAR);     /* what is before the eye */
        const float left = x - half_x, right = x + half_x, top = y - half_y, bottom = y + half_y;
        const float px0 = p->center[0] + p->focal * soft_min(left * near, left * far);
        const float px1 = p->center[0] + p->focal * soft_max(right * near, right * far);
        const float py0 = p->center[1] + p->focal * soft_min(top * near, top * far);
        const float py1 = p->center[1] + p->focal * soft_max(bottom * near, bottom * far);
        const bool before = z + half_z > SOFT_NEAR;
        const int first = soft_first(px0, p->width);
        s->x0[i] = before ? first : p->width;
        s->x1[i] = soft_last(px1, p->width);
        s->y0[i] = soft_first(py0, p->height);
        s->y1[i] = soft_last(py1, p->height);
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

static void bounds_plain(const struct splats *p, struct soft_scratch *s, uint32_t count)
{
    bounds_body(p, s, count);
}

SPV_WIDE static void bounds_wide(const struct splats *p, struct soft_scratch *s, uint32_t count)
{
    bounds_body(p, s, count);
}

struct pixels {                     /* eight of a splat, from x, y on */
    int x, y;
    uint32_t mask;                  /* covered, and not hidden */
    uint32_t w[LANES];              /* bits */
    uint32_t color[LANES];
};

/* Does the ray meet the cylinder? Depth is that of the disk's plane, kept inside the cylinder. */
SPV_INLINE void cover_body(const struct splats *p, const struct soft_scratch *s, uint32_t i,
                           const uint32_t behind[LANES], struct pixels *out)
{
    const float cx = s->center[0][i], cy = s->center[1][i], cz = s->center[2][i];
    const float nx = s->normal[0][i], ny = s->normal[1][i], nz = s->normal[2][i];
    const float r2 = s->radius[i] * s->radius[i], h = s->height[i], w_max = s->w_max[i];
    const float left = (float)out->x + 0.5f - p->center[0], top = (float)out->y + 0.5f - p->center[1];
    const float last_x = (float)(s->x1[i] - out->x), last_y = (float)(s->y1[i] - out->y);
    uint32_t mask = 0;
    SPV_ROLLED
    for (int k = 0; k < LANES; k++) {
        const float dx = (left + LANE_X[k]) * p->inverse, dy = (top + LANE_Y[k]) * p->inverse;
        const float gx = cz * dx - cx, gy = cz * dy - cy;   /* the ray at the centre's depth */
        const float a = nx * dx + ny * dy + nz, b = nx * gx + ny * gy;
        const float ax = dx - nx * a, ay = dy - ny * a, az = 1 - nz * a;
        const float bx = gx - nx * b, by = gy - ny * b, bz = -nz * b;
        const float A = soft_max(ax * ax + ay * ay + az * az, 1e-12f);
        const float B = bx * ax + by * ay + bz * az;
        const float C = bx * bx + by * by + bz * bz - r2;
        const float D = B * B - A * C;
        const bool steep = soft_abs(a) > 1e-6f;
        const float per_a = 1 / (steep ? a : 1), per_A = 1 / A, root = sqrtf(soft_max(D, 0));
        const float plane = steep ? -b * per_a : 0;
        const float slab = steep ? h * soft_abs(per_a) : 1e30f;
        const float lo = soft_max(plane - slab, (-B - root) * per_A);
        const float hi = soft_min(plane + slab, (-B + root) * per_A);
        const float at = soft_max(cz + soft_max(soft_min(plane, hi), lo), 2 * SOFT_NEAR);
        const uint32_t w = soft_bits(soft_min(p->unit / at, w_max));
        const bool hit = (steep | (soft_abs(b) <= h)) & (D >= 0) & (lo <= hi) & (cz + hi > 0) &
                         (LANE_X[k] <= last_x) & (LANE_Y[k] <= last_y) & ((int)w >= (int)behind[k]);
        out->w[k] = w;
        mask |= hit ? LANE_BIT[k] : 0;
    }
    out->mask = mask;
}

/* The rectangle of the fast mode: no test, the depth of the centre. */
SPV_INLINE void fill_body(const struct splats *p, const struct soft_scratch *s, uint32_t i,
                          const uint32_t behind[LANES], struct pixels *out)
{
    const uint32_t w =
        soft_bits(soft_min(p->unit / soft_max(s->center[2][i], 2 * SOFT_NEAR), s->w_max[i]));
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

SPV_INLINE void draw_body(const struct splats *p, struct soft_scratch *s, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        if (s->x0[i] > s->x1[i] || s->y0[i] > s->y1[i] ||
            soft_hidden(p->frame, s->x0[i], s->x1[i], s->y0[i], s->y1[i], soft_bits(s->w_max[i])))
            continue;
        for (int y = s->y0[i]; y <= s->y1[i]; y += LANES_HIGH)
            for (int x = s->x0[i]; x <= s->x1[i]; x += LANES_WIDE)
                draw_pixels(p, s, i, x, y);
    }
}

static void draw_plain(const struct splats *p, struct soft_scratch *s, uint32_t count)
{
    draw_body(p, s, count);
}

SPV_WIDE static void draw_wide(const struct splats *p, struct soft_scratch *s, uint32_t count)
{
    draw_body(p, s, count);
}

void spv_soft_points(const struct soft_block *b, struct soft_scratch *s, uint32_t first,
                     uint32_t count)
{
    const struct soft_frame *f = b->frame;
    const struct splats p = {
        .frame = f,
        .unit = f->unit,
        .focal = (float)f->focal, .inverse = (float)(1 / f->focal),
        .center = {(float)f->center[0], (float)f->center[1]},
        .pad = (float)(1.05 * (double)SOFT_MARGIN_PX / f->focal),       /* and roundings */
        .ambient = f->ambient, .flat_px = f->flat_px,
        .width = f->tile.width, .height = f->tile.height,
        .fast = f->splat == SPV_SPLAT_FAST,
    };
    for (uint32_t at = 0; at < count; at += SOFT_CHUNK) {
        const uint32_t n = count - at < SOFT_CHUNK ? count - at : SOFT_CHUNK;
        const uint32_t k = spv_soft_gather(b, s, first + at, n, false);
        s->counts.points += k;
        spv_soft_colors(b, s, k, false);
        (f->wide ? bounds_wide : bounds_plain)(&p, s, k);
        (f->wide ? draw_wide : draw_plain)(&p, s, k);
    }
}
