/*
 * soft_triangle.c - triangles into the framebuffer.
 *
 * Corners are lattice points, computed in double from the lattice and the eye alone: the same
 * numbers whichever block they come from. A pixel is covered when its centre lies inside or within
 * 1/64 px of the triangle, so that neither an edge between two triangles nor the rim of a surface
 * loses a pixel to rounding. No corner moves for it: a needle's tip stays where it is.
 *
 * Triangles of ordinary size have edge functions in float32, from the corner of their own rectangle;
 * those that reach behind the eye or far out of the picture are tested by planes through the eye, in
 * double, without being clipped: a ray meets the triangle where it lies on one side of all three.
 */
#include "soft_int.h"

#include "bytes.h"

#include <math.h>
#include <stdlib.h>

enum { PLAIN_PX = 4096 };           /* side of what float32 edge functions are good for */

struct triangle {
    const struct soft_frame *frame;
    uint32_t number;                /* in the block */
    struct soft_vertex v[3];
    uint32_t color[3];
    float normal[3];
    float light;                    /* of all pixels, when flat */
    int x0, x1, y0, y1;             /* px, inclusive */
    bool flat, one_color;
};

/* ---- corners ----------------------------------------------------------------------------------- */

struct lattice {                    /* units */
    double base[3], step, eye[3];
};

static void make_lattice(const struct soft_block *b, struct lattice *out)
{
    const struct spc_header *h = b->frame->header;
    out->step = ldexp(1, h->vertex_exp - h->unit_exp);
    for (int a = 0; a < 3; a++) {
        out->base[a] = (double)(int64_t)load_u64(b->payload + b->l.vertex_base + 8 * a);
        out->eye[a] = b->frame->eye[a];
    }
}

/* Base and offset, and their sum, are integers that a double holds. */
SPV_INLINE void corner_at(const struct soft_block *b, const struct lattice *l, uint32_t width,
                          uint32_t i, double out[3])
{
    const uint8_t *p = b->payload + b->l.vertices + (size_t)3 * width * i;
    double from_eye[3];
    for (uint32_t a = 0; a < 3; a++, p += width) {
        const double off = width == 2   ? (double)load_u16(p)
                           : width == 4 ? (double)load_u32(p) : (double)load_u64(p);
        from_eye[a] = (l->base[a] + off) * l->step - l->eye[a];
    }
    for (int v = 0; v < 3; v++) {
        const double *axis = b->frame->axes[v];
        out[v] = axis[0] * from_eye[0] + axis[1] * from_eye[1] + axis[2] * from_eye[2];
    }
}

SPV_INLINE void project_body(const struct soft_block *b, const struct lattice *l, uint32_t width,
                             struct soft_vertex *out)
{
    const struct soft_frame *f = b->frame;
    for (uint32_t i = 0; i < b->b.vertex_count; i++) {
        double at[3];
        corner_at(b, l, width, i, at);
        const bool before = at[2] > 4 * (double)SOFT_NEAR;
        const double w = 1 / (before ? at[2] : 1), scale = f->focal * w;
        out[i].x = f->center[0] + scale * at[0];
        out[i].y = f->center[1] + scale * at[1];
        out[i].w = before ? (float)w * f->unit : 0;
    }
}

/* fails (false): no memory */
static bool project(const struct soft_block *b, struct soft_scratch *s)
{
    struct lattice l;
    if (s->vertices_max < b->b.vertex_count) {
        free(s->vertices);
        s->vertices_max = 0;
        s->vertices = malloc(b->b.vertex_count * sizeof *s->vertices);
        if (s->vertices == NULL)
            return false;
        s->vertices_max = b->b.vertex_count;
    }
    make_lattice(b, &l);
    if (b->b.vertex_width == 2)
        project_body(b, &l, 2, s->vertices);
    else if (b->b.vertex_width == 4)
        project_body(b, &l, 4, s->vertices);
    else
        project_body(b, &l, 8, s->vertices);
    s->projected = true;
    return true;
}

/* ---- colour ------------------------------------------------------------------------------------ */

SPV_INLINE uint32_t blend(const uint32_t color[3], float b0, float b1, float b2, float light)
{
    uint32_t out = 0xFF000000u;
    for (int shift = 0; shift < 24; shift += 8) {
        const float v = b0 * soft_channel(color[0], shift) + b1 * soft_channel(color[1], shift) +
                        b2 * soft_channel(color[2], shift);
        out |= (uint32_t)(int)soft_min(v * light + 0.5f, 255) << shift;
    }
    return out;
}

/* Light on the pixel: the ray through its centre against the leaf's normal. */
SPV_INLINE float light_at(const struct triangle *t, float x, float y)
{
    const struct soft_frame *f = t->frame;
    const float inverse = (float)(1 / f->focal);
    const float dx = (x + 0.5f - (float)f->center[0]) * inverse;
    const float dy = (y + 0.5f - (float)f->center[1]) * inverse;
    const float dot = t->normal[0] * dx + t->normal[1] * dy + t->normal[2];
    return f->ambient + (1 - f->ambient) * soft_min(soft_abs(dot) / sqrtf(dx * dx + dy * dy + 1), 1);
}

/* ---- ordinary triangles ------------------------------------------------------------------------ */

struct edges {                      /* E = a x + b y + c, from the first pixel's centre, px */
    float a[3], b[3], c[3];         /* inside: E >= -margin */
    float margin[3], per_area;
    float w, w_x, w_y, w_min, w_max;
};

/* False: no area, nothing to see. */
SPV_INLINE bool make_edges(const struct triangle *t, struct edges *e)
{
    const struct soft_vertex *v = t->v;
    const double area = (v[1].x - v[0].x) * (v[2].y - v[0].y) -
                        (v[2].x - v[0].x) * (v[1].y - v[0].y);
    const float sign = area < 0 ? -1 : 1;
    if (area == 0)
        return false;
    float x[3], y[3];
    for (int k = 0; k < 3; k++) {
        x[k] = (float)(v[k].x - (t->x0 + 0.5));
        y[k] = (float)(v[k].y - (t->y0 + 0.5));
    }
    for (int k = 0; k < 3; k++) {
        const int i = k == 2 ? 0 : k + 1, j = k == 0 ? 2 : k - 1;
        const float a = y[i] - y[j], b = x[j] - x[i];
        e->a[k] = sign * a;
        e->b[k] = sign * b;
        e->c[k] = sign * (x[i] * y[j] - x[j] * y[i]);
        e->margin[k] = SOFT_MARGIN_PX * sqrtf(a * a + b * b);
    }
    const float d1 = v[1].w - v[0].w, d2 = v[2].w - v[0].w;
    e->per_area = 1 / soft_max((float)fabs(area), 1e-30f);
    e->w_x = (d1 * e->a[1] + d2 * e->a[2]) * e->per_area;
    e->w_y = (d1 * e->b[1] + d2 * e->b[2]) * e->per_area;
    e->w = v[0].w - (e->w_x * x[0] + e->w_y * y[0]);
    e->w_min = soft_min(v[0].w, soft_min(v[1].w, v[2].w));
    e->w_max = soft_max(v[0].w, soft_max(v[1].w, v[2].w));
    return true;
}

/* Perspective: weights on screen times w. */
SPV_INLINE void shade_body(const struct triangle *t, const struct edges *e, int x, int y,
                           uint32_t out[LANES])
{
    const uint32_t color[3] = {t->color[0], t->color[1], t->color[2]};
    const float w0 = t->v[0].w, w1 = t->v[1].w, w2 = t->v[2].w, left = (float)x, top = (float)y;
    SPV_ROLLED
    for (int k = 0; k < LANES; k++) {
        const float px = left + LANE_X[k], py = top + LANE_Y[k];
        const float light = light_at(t, px + (float)t->x0, py + (float)t->y0);
        const float l1 = soft_max((e->a[1] * px + e->b[1] * py + e->c[1]) * e->per_area, 0);
        const float l2 = soft_max((e->a[2] * px + e->b[2] * py + e->c[2]) * e->per_area, 0);
        const float b0 = soft_max(1 - l1 - l2, 0) * w0, b1 = l1 * w1, b2 = l2 * w2;
        const float scale = 1 / soft_max(b0 + b1 + b2, 0x1p-126f);
        out[k] = blend(color, b0 * scale, b1 * scale, b2 * scale, light);
    }
}

SPV_INLINE uint32_t cover_body(const struct triangle *t, const struct edges *e, int x, int y,
                               const uint32_t behind[LANES], uint32_t w[LANES])
{
    const float left = (float)x, top = (float)y;
    const float last_x = (float)(t->x1 - t->x0 - x), last_y = (float)(t->y1 - t->y0 - y);
    uint32_t mask = 0;
    SPV_ROLLED
    for (int k = 0; k < LANES; k++) {
        const float px = left + LANE_X[k], py = top + LANE_Y[k];
        const float e0 = e->a[0] * px + e->b[0] * py + e->c[0];
        const float e1 = e->a[1] * px + e->b[1] * py + e->c[1];
        const float e2 = e->a[2] * px + e->b[2] * py + e->c[2];
        const float at = e->w + e->w_x * px + e->w_y * py;
        const uint32_t bits = soft_bits(soft_min(soft_max(at, e->w_min), e->w_max));
        const bool hit = (e0 >= -e->margin[0]) & (e1 >= -e->margin[1]) & (e2 >= -e->margin[2]) &
                         (LANE_X[k] <= last_x) & (LANE_Y[k] <= last_y) &
                         ((int)bits >= (int)behind[k]);
        w[k] = bits;
        mask |= hit ? LANE_BIT[k] : 0;
    }
    return mask;
}

SPV_INLINE void draw_ordinary(const struct triangle *t, const struct edges *e)
{
    const struct soft_frame *f = t->frame;
    uint32_t one[LANES], many[LANES], behind[LANES], w[LANES];
    const bool flat = t->flat && t->one_color;
    for (int k = 0; k < LANES && flat; k++)
        one[k] = blend(t->color, 1, 0, 0, t->light);
    for (int y = 0; y <= t->y1 - t->y0; y += LANES_HIGH)
        for (int x = 0; x <= t->x1 - t->x0; x += LANES_WIDE) {
            soft_depths(f, t->x0 + x, t->y0 + y, behind);
            const uint32_t mask = cover_body(t, e, x, y, behind, w);
            if (mask == 0)
                continue;
            if (!flat)
                shade_body(t, e, x, y, many);
            soft_put_lanes(f, t->x0 + x, t->y0 + y, mask, w, flat ? one : many);
        }
}

/* ---- through the eye's plane, or far out ------------------------------------------------------- */

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

struct extent {
    double low[2], high[2];         /* px */
};

static void extend(const struct soft_frame *f, struct extent *e, double x, double y, double z)
{
    const double at[2] = {f->center[0] + f->focal * x / z, f->center[1] + f->focal * y / z};
    for (int a = 0; a < 2; a++) {
        e->low[a] = fmin(e->low[a], at[a]);
        e->high[a] = fmax(e->high[a], at[a]);
    }
}

/* The rectangle of what lies before the eye; false when nothing does, or none of it in the tile. */
static bool find_rectangle(struct triangle *t, double v[3][3])
{
    const struct soft_frame *f = t->frame;
    const double near = (double)SOFT_NEAR;
    struct extent e = {{HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL}};
    for (int k = 0; k < 3; k++) {
        const double *a = v[k], *b = v[k == 2 ? 0 : k + 1];
        if (a[2] >= near)
            extend(f, &e, a[0], a[1], a[2]);
        if ((a[2] >= near) != (b[2] >= near)) {
            const double s = (near - a[2]) / (b[2] - a[2]);
            extend(f, &e, a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), near);
        }
    }
    if (!(e.low[0] <= f->tile.width + 1 && e.high[0] >= -1 && e.low[1] <= f->tile.height + 1 &&
          e.high[1] >= -1))
        return false;
    t->x0 = soft_first((float)fmax(e.low[0] - 1, -1), f->tile.width);
    t->x1 = soft_last((float)fmin(e.high[0] + 1, f->tile.width + 1), f->tile.width);
    t->y0 = soft_first((float)fmax(e.low[1] - 1, -1), f->tile.height);
    t->y1 = soft_last((float)fmin(e.high[1] + 1, f->tile.height + 1), f->tile.height);
    return true;
}

/*
 * With e the cross products of corners, e[k] . d are the weights by which the corners give the
 * point that the ray d meets, and 1 / z is their sum over the determinant.
 */
static void draw_any(struct triangle *t, double v[3][3])
{
    const struct soft_frame *f = t->frame;
    double e[3][3], margin[3];
    if (!find_rectangle(t, v))
        return;
    for (int k = 0; k < 3; k++)
        cross(v[(k + 1) % 3], v[(k + 2) % 3], e[k]);
    double det = e[0][0] * v[0][0] + e[0][1] * v[0][1] + e[0][2] * v[0][2];
    const double sign = det < 0 ? -1 : 1;
    det *= sign;
    if (!(det > 0))
        return;
    const double near = fmin(v[0][2], fmin(v[1][2], v[2][2]));      /* a margin is no nearer than its triangle */
    const float w_max = near > 2 * (double)SOFT_NEAR ? (float)(1 / near) : 0.5f / SOFT_NEAR;
    for (int k = 0; k < 3; k++) {
        for (int a = 0; a < 3; a++)
            e[k][a] *= sign;
        margin[k] = -(double)SOFT_MARGIN_PX / f->focal * sqrt(e[k][0] * e[k][0] + e[k][1] * e[k][1]);
    }
    for (int y = t->y0; y <= t->y1; y++)
        for (int x = t->x0; x <= t->x1; x++) {
            const double dx = (x + 0.5 - f->center[0]) / f->focal;
            const double dy = (y + 0.5 - f->center[1]) / f->focal;
            const double b0 = e[0][0] * dx + e[0][1] * dy + e[0][2];
            const double b1 = e[1][0] * dx + e[1][1] * dy + e[1][2];
            const double b2 = e[2][0] * dx + e[2][1] * dy + e[2][2];
            const double sum = b0 + b1 + b2;
            if (!(b0 >= margin[0] && b1 >= margin[1] && b2 >= margin[2] && sum > 0))
                continue;
            const float scale = (float)(1 / sum), light = light_at(t, (float)x, (float)y);
            const uint32_t color =
                blend(t->color, soft_max((float)b0 * scale, 0), soft_max((float)b1 * scale, 0),
                      soft_max((float)b2 * scale, 0), light);
            soft_put(f, (size_t)y * f->pitch + (size_t)x,
                     soft_word(soft_bits(f->unit * soft_min((float)(sum / det), w_max)), color));
        }
}

/* ---- blocks ------------------------------------------------------------------------------------ */

static void draw_far(const struct soft_block *b, struct triangle *t)
{
    const uint8_t *corners = b->payload + b->l.indices + 6 * (size_t)t->number;
    struct lattice l;
    double v[3][3];
    make_lattice(b, &l);
    for (int k = 0; k < 3; k++)
        corner_at(b, &l, b->b.vertex_width, load_u16(corners + 2 * k), v[k]);
    draw_any(t, v);
}

SPV_INLINE double less(double a, double b)
{
    return a < b ? a : b;
}

SPV_INLINE double more(double a, double b)
{
    return a > b ? a : b;
}

/* The rectangle in the tile; false when there is none. *ordinary: float32 will do. */
SPV_INLINE bool place(struct triangle *t, bool *ordinary)
{
    const struct soft_vertex *v = t->v;
    const struct spv_tile *tile = &t->frame->tile;
    const double margin = (double)SOFT_MARGIN_PX;
    const double left = less(v[0].x, less(v[1].x, v[2].x)) - margin;
    const double right = more(v[0].x, more(v[1].x, v[2].x)) + margin;
    const double top = less(v[0].y, less(v[1].y, v[2].y)) - margin;
    const double bottom = more(v[0].y, more(v[1].y, v[2].y)) + margin;
    *ordinary = v[0].w > 0 && v[1].w > 0 && v[2].w > 0 && right - left < PLAIN_PX &&
                bottom - top < PLAIN_PX;
    if (!*ordinary)
        return true;
    t->x0 = soft_first((float)left, tile->width);
    t->x1 = soft_last((float)right, tile->width);
    t->y0 = soft_first((float)top, tile->height);
    t->y1 = soft_last((float)bottom, tile->height);
    t->flat = (float)(right - left) <= t->frame->flat_px && (float)(bottom - top) <= t->frame->flat_px;
    return t->x0 <= t->x1 && t->y0 <= t->y1;
}

SPV_INLINE void draw_body(const struct soft_block *b, struct soft_scratch *s, uint32_t count)
{
    const struct soft_frame *f = b->frame;
    const bool painted = f->paint != SPV_PAINT_SCAN;
    const uint8_t *colors = b->l.vertex_colors && !painted ? b->payload + b->l.vertex_colors : NULL;
    struct triangle t = {.frame = f, .color = {0xFFFFFFFFu, 0xFFFFFFFFu, 0xFFFFFFFFu}, .one_color = true};
    struct edges e;
    bool ordinary;
    for (uint32_t i = 0; i < count; i++) {
        t.number = s->index[i];
        const uint8_t *corners = b->payload + b->l.indices + 6 * (size_t)t.number;
        for (int k = 0; k < 3; k++)
            t.v[k] = s->vertices[load_u16(corners + 2 * k)];
        if (!place(&t, &ordinary))
            continue;
        for (int k = 0; k < 3 && colors; k++)
            t.color[k] = load_u32(colors + 4 * (size_t)load_u16(corners + 2 * k)) & 0xFFFFFFu;
        if (painted)
            t.color[0] = t.color[1] = t.color[2] = s->base[i] & 0xFFFFFFu;
        t.one_color = t.color[0] == t.color[1] && t.color[0] == t.color[2];
        for (int a = 0; a < 3; a++)
            t.normal[a] = s->normal[a][i];
        if (!ordinary) {
            draw_far(b, &t);
            continue;
        }
        if (t.flat)
            t.light = light_at(&t, (float)(t.x0 + t.x1) / 2, (float)(t.y0 + t.y1) / 2);
        if (make_edges(&t, &e))
            draw_ordinary(&t, &e);
    }
}

SPV_VERSIONS(draw, draw_body, (const struct soft_block *b, struct soft_scratch *s, uint32_t count), (b, s, count));

bool spv_soft_triangles(const struct soft_block *b, struct soft_scratch *s, uint32_t first,
                        uint32_t count)
{
    for (uint32_t at = 0; at < count; at += SOFT_CHUNK) {
        const uint32_t n = count - at < SOFT_CHUNK ? count - at : SOFT_CHUNK;
        const uint32_t k = spv_soft_gather(b, s, first + at, n, true);
        s->counts.triangles += k;
        if (k > 0 && !s->projected && !project(b, s))
            return false;
        if (b->frame->paint != SPV_PAINT_SCAN)
            spv_soft_colors(b, s, k, true);
        draw[b->frame->lanes](b, s, k);
    }
    return true;
}
