/*
 * triangle_columns.c - triangles from edges, vertices from triangles, leaves from both (spec
 * sections 6.4.3 and 6.5).
 */
#include "columns.h"

#include "bytes.h"
#include "edge_index.h"
#include "layout.h"
#include "leaf_record.h"

#include <stdlib.h>

struct triangle_arrays {            /* columns of n triangles and v vertices, in one allocation */
    uint64_t *residual[3];          /* [v] */
    uint64_t (*vertex)[3];          /* [v] offsets from the base, modulo 2^(8 width) */
    uint16_t (*model)[3];           /* [v + 1] vertices that it is told from: see tell_from */
    uint16_t *explicit;             /* [3 n] */
    uint16_t (*corner)[3];          /* [n] vertices of the triangles */
    double (*at)[3];                /* [v] vertices, from the cluster's origin */
    uint8_t *edge, *third;          /* [n] */
    uint8_t *loose;                 /* [3 n] */
    uint8_t *color[4];              /* [v] */
};

static void *arrays_create(uint32_t n, uint32_t v, struct triangle_arrays *out)
{
    uint64_t *wide = malloc((size_t)v * (9 * sizeof *wide + 6 + 4) + (size_t)n * (12 + 5) + 16);
    if (wide == NULL)
        return NULL;
    for (uint32_t a = 0; a < 3; a++)
        out->residual[a] = wide + (size_t)v * a;
    out->vertex = (uint64_t (*)[3])(wide + (size_t)v * 3);
    out->at = (double (*)[3])(wide + (size_t)v * 6);
    out->model = (uint16_t (*)[3])(wide + (size_t)v * 9);
    out->corner = out->model + v + 1;
    out->explicit = (uint16_t *)(out->corner + n);
    uint8_t *byte = (uint8_t *)(out->explicit + (size_t)3 * n);
    out->edge = byte;
    out->third = byte + n;
    out->loose = byte + (size_t)2 * n;
    for (uint32_t k = 0; k < 4; k++)
        out->color[k] = byte + (size_t)5 * n + (size_t)v * k;
    return wide;
}

struct triangle_state {
    struct edge_ring ring;
    uint32_t seen;                  /* vertices used so far: they are numbered by first use */
    uint32_t thirds, looses, explicits;
};

/*
 * A new vertex is told from the parallelogram a + b - opposite over the shared edge, its colour
 * from the middle of a and b. Without an edge all three are the vertex before.
 */
static void tell_from(uint16_t model[3], uint32_t a, uint32_t b, uint32_t opposite)
{
    model[0] = (uint16_t)a;
    model[1] = (uint16_t)b;
    model[2] = (uint16_t)opposite;
}

static void model_color(const uint8_t *colors, uint32_t v, const uint16_t model[3], uint8_t out[4])
{
    for (int k = 0; k < 4; k++)
        out[k] = v == 0 ? 255 : (uint8_t)((colors[4 * model[0] + k] + colors[4 * model[1] + k]) / 2);
}

static uint64_t mask_of(uint32_t width)
{
    return width == 8 ? UINT64_MAX : ((uint64_t)1 << 8 * width) - 1;
}

/* ---- encoding ---------------------------------------------------------------------------------- */

static void load_vertices(const struct columns *c, const uint8_t *payload,
                          struct triangle_arrays *t)
{
    const uint32_t width = c->block->vertex_width;
    const uint8_t *p = payload + c->layout->vertices;
    for (uint32_t i = 0; i < c->block->vertex_count; i++)
        for (int a = 0; a < 3; a++, p += width)
            t->vertex[i][a] = width == 2 ? load_u16(p) : width == 4 ? load_u32(p) : load_u64(p);
}

/* Difference modulo 2^(8 width), as a signed number of that width, zigzag. */
static uint64_t difference(uint64_t d, uint32_t width)
{
    const uint32_t unused = 64 - 8 * width;
    return zigzag64((uint64_t)((int64_t)(d << unused) >> unused));
}

static void tell_vertices(const struct columns *c, const uint8_t *payload,
                          struct triangle_arrays *t)
{
    static const uint64_t zero[3];
    const uint8_t *colors = payload + c->layout->vertex_colors;
    for (uint32_t v = 0; v < c->block->vertex_count; v++) {
        const uint16_t *m = t->model[v];
        const uint64_t *x = v ? t->vertex[m[0]] : zero, *y = v ? t->vertex[m[1]] : zero;
        const uint64_t *o = v ? t->vertex[m[2]] : zero;
        for (int a = 0; a < 3; a++)
            t->residual[a][v] = difference(t->vertex[v][a] - (x[a] + y[a] - o[a]),
                                           c->block->vertex_width);
        if (c->layout->vertex_colors) {
            uint8_t was[4], d[4];
            model_color(colors, v, m, was);
            columns_color_difference(colors + (size_t)4 * v, was, d);
            for (int k = 0; k < 4; k++)
                t->color[k][v] = d[k];
        }
    }
}

/* What has been told: the ring with its index, and how many of everything. */
struct telling {
    struct edge_index index;
    uint32_t seen;                  /* vertices used so far: they are numbered by first use */
    uint32_t thirds, looses, explicits;
};

/* Code of a corner that is no part of a shared edge. False: not numbered by first use. */
static inline bool tell_corner(const struct columns *c, struct triangle_arrays *t, struct telling *s,
                               uint32_t v, uint8_t *code)
{
    if (v > s->seen || v >= c->block->vertex_count)
        return false;
    if (v == s->seen) {
        *code = CORNER_NEW;
        edge_index_add_vertex(&s->index, s->seen++);
    } else {
        *code = (uint8_t)corner_index_find(&s->index, v);
        if (*code == CORNER_EXPLICIT)
            t->explicit[s->explicits++] = (uint16_t)v;
    }
    corner_index_push(&s->index, v);
    return true;
}

static inline bool tell_triangle(const struct columns *c, struct triangle_arrays *t, struct telling *s,
                                 const uint32_t q[3], uint8_t *edge)
{
    const uint32_t known = s->seen;         /* an edge has been seen only between these */
    const uint32_t code = q[0] < known && q[1] < known ? edge_index_find(&s->index, q[0], q[1])
                                                       : EDGE_LOOSE;
    *edge = (uint8_t)code;
    if (code != EDGE_LOOSE) {
        const struct edge_ring *ring = &s->index.ring;
        const uint32_t k = (ring->edges - 1 - edge_age(code)) & 255;
        if (q[2] == s->seen && s->seen < c->block->vertex_count)
            tell_from(t->model[s->seen], q[0], q[1], ring->opposite[k]);
        if (!tell_corner(c, t, s, q[2], &t->third[s->thirds++]))
            return false;
    } else {
        for (int k = 0; k < 3; k++) {
            if (q[k] == s->seen && s->seen < c->block->vertex_count)
                tell_from(t->model[s->seen], s->seen - 1, s->seen - 1, s->seen - 1);
            if (!tell_corner(c, t, s, q[k], &t->loose[s->looses++]))
                return false;
        }
    }
    edge_index_push_triangle(&s->index, q[0], q[1], q[2], code == EDGE_LOOSE);
    return true;
}

/* Bytes an entry of the arrays below: of vertices, of triangles. */
enum { VERTEX_ARRAYS = 3 * 8 + 24 + 6 + 8 + 4, TRIANGLE_ARRAYS = 6 + 1 + 1 + 3, ARRAYS = 14 };

size_t triangle_columns_memory(uint32_t n, uint32_t v)
{
    return (size_t)v * VERTEX_ARRAYS + (size_t)n * TRIANGLE_ARRAYS + ARRAYS * encoder_share(1);
}

static void take_arrays(const struct columns *c, struct spc_encoder *e, struct triangle_arrays *t,
                        struct telling *s)
{
    const size_t n = c->n, v = c->block->vertex_count;
    for (int a = 0; a < 3; a++)
        t->residual[a] = encoder_take(e, v * sizeof *t->residual[a]);
    t->vertex = encoder_take(e, v * sizeof *t->vertex);
    t->model = encoder_take(e, v * sizeof *t->model);
    t->explicit = encoder_take(e, 3 * n * sizeof *t->explicit);
    t->edge = encoder_take(e, n);
    t->third = encoder_take(e, n);
    t->loose = encoder_take(e, 3 * n);
    for (int k = 0; k < 4; k++)
        t->color[k] = encoder_take(e, v);
    edge_index_init(&s->index, encoder_take(e, 2 * v * sizeof(uint32_t)), (uint32_t)v);
}

enum spc_status triangle_columns_put(const struct columns *c, const uint8_t *payload,
                                     struct planes_writer *w, struct spc_error *err)
{
    const uint32_t v = c->block->vertex_count;
    struct triangle_arrays t;
    struct telling s = {.seen = 0};
    bool ok = true;
    take_arrays(c, w->encoder, &t, &s);
    load_vertices(c, payload, &t);
    for (uint32_t i = 0; i < c->n && ok; i++) {
        const uint8_t *p = payload + c->layout->indices + (size_t)6 * c->place[i];
        const uint32_t q[3] = {load_u16(p), load_u16(p + 2), load_u16(p + 4)};
        ok = tell_triangle(c, &t, &s, q, &t.edge[i]);
    }
    ok = ok && s.seen == v;
    if (ok) {
        tell_vertices(c, payload, &t);
        planes_put8(w, t.edge, c->n);
        planes_put8(w, t.third, s.thirds);
        planes_put8(w, t.loose, s.looses);
        planes_put16(w, t.explicit, s.explicits);
        for (int a = 0; a < 3; a++)
            planes_put64(w, t.residual[a], c->block->vertex_width, v);
        for (int k = 0; k < 4 && c->layout->vertex_colors; k++)
            planes_put8(w, t.color[k], v);
    }
    return ok ? SPC_OK : spc_fail(err, SPC_INTERNAL, SPC_NO_OFF,
                                  "vertices of a block are not numbered by first use");
}

/* ---- decoding ---------------------------------------------------------------------------------- */

struct hearing {
    const struct columns *c;
    struct triangle_arrays t;
    struct triangle_state s;
    uint32_t third_max, loose_max, explicit_max;    /* entries there are */
};

static bool hear_corner(struct hearing *h, uint32_t code, uint32_t *out)
{
    struct triangle_state *s = &h->s;
    if (code == CORNER_NEW) {
        if (s->seen == h->c->block->vertex_count)
            return false;
        *out = s->seen++;
    } else if (code == CORNER_EXPLICIT) {
        if (s->explicits == h->explicit_max || h->t.explicit[s->explicits] >= s->seen)
            return false;
        *out = h->t.explicit[s->explicits++];
    } else {
        if (code > s->ring.corners)
            return false;
        *out = s->ring.corner[(s->ring.corners - code) & 255];
    }
    corner_push(&s->ring, *out);
    return true;
}

static bool hear_loose(struct hearing *h, uint32_t q[3])
{
    struct triangle_state *s = &h->s;
    for (int k = 0; k < 3; k++) {
        const uint32_t seen = s->seen;
        if (!hear_corner(h, h->t.loose[s->looses++], &q[k]))
            return false;
        if (s->seen > seen)
            tell_from(h->t.model[seen], seen - 1, seen - 1, seen - 1);
    }
    return true;
}

/*
 * A triangle on a known edge. Whether its third corner is new cannot be foreseen, so that choice
 * is made without a branch: the model is written either way, and counts only if seen moves on.
 */
static bool hear_on_edge(struct hearing *h, uint32_t code, uint32_t q[3])
{
    struct triangle_state *s = &h->s;
    struct edge_ring *r = &s->ring;
    const uint32_t age = edge_age(code), k = (r->edges - 1 - age) & 255;
    const bool against = code >= EDGE_AGAINST;
    const uint32_t third = h->t.third[s->thirds++];
    if (age >= r->edges)
        return false;
    q[0] = against ? r->to[k] : r->from[k];
    q[1] = against ? r->from[k] : r->to[k];
    tell_from(h->t.model[s->seen], q[0], q[1], r->opposite[k]);
    if (third == CORNER_EXPLICIT)
        return hear_corner(h, third, &q[2]);
    const uint32_t is_new = third == CORNER_NEW, known = r->corner[(r->corners - third) & 255];
    if (third > r->corners || s->seen + is_new > h->c->block->vertex_count)
        return false;
    q[2] = is_new ? s->seen : known;
    s->seen += is_new;
    corner_push(r, q[2]);
    return true;
}

static bool hear_triangle(struct hearing *h, uint32_t code, uint32_t q[3])
{
    const bool loose = code == EDGE_LOOSE;
    if (code == 255 || !(loose ? hear_loose(h, q) : hear_on_edge(h, code, q)))
        return false;
    edge_push_triangle(&h->s.ring, q[0], q[1], q[2], loose);
    return true;
}

static bool hear_triangles(struct hearing *h)
{
    const struct columns *c = h->c;
    const struct triangle_state *s = &h->s;
    for (uint32_t i = 0; i < c->n; i++) {
        uint32_t q[3];
        if (!hear_triangle(h, h->t.edge[i], q))
            return false;
        for (int k = 0; k < 3; k++)
            h->t.corner[i][k] = (uint16_t)q[k];
    }
    return s->seen == c->block->vertex_count && s->thirds == h->third_max &&
           s->looses == h->loose_max && s->explicits == h->explicit_max;
}

/* False when an offset is over the limit. */
static bool hear_vertices(const struct columns *c, struct triangle_arrays *t, uint8_t *payload)
{
    static const uint64_t zero[3];
    const uint64_t mask = mask_of(c->block->vertex_width);
    uint8_t *colors = payload + c->layout->vertex_colors;
    uint64_t any = 0;
    for (uint32_t v = 0; v < c->block->vertex_count; v++) {
        const uint16_t *m = t->model[v];
        const uint64_t *x = v ? t->vertex[m[0]] : zero, *y = v ? t->vertex[m[1]] : zero;
        const uint64_t *o = v ? t->vertex[m[2]] : zero;
        for (int a = 0; a < 3; a++) {
            const uint64_t at = (x[a] + y[a] - o[a] + unzigzag64(t->residual[a][v])) & mask;
            t->vertex[v][a] = at;
            any |= at;
        }
        if (c->layout->vertex_colors) {
            const uint8_t d[4] = {t->color[0][v], t->color[1][v], t->color[2][v], t->color[3][v]};
            uint8_t was[4];
            model_color(colors, v, m, was);
            columns_color_sum(d, was, colors + (size_t)4 * v);
        }
    }
    return any >> 55 == 0;
}

static void store_vertices(const struct columns *c, const struct triangle_arrays *t,
                           uint8_t *payload)
{
    const uint32_t width = c->block->vertex_width;
    uint8_t *p = payload + c->layout->vertices;
    for (uint32_t i = 0; i < c->block->vertex_count; i++)
        for (int a = 0; a < 3; a++, p += width) {
            if (width == 2)
                store_u16(p, (uint16_t)t->vertex[i][a]);
            else if (width == 4)
                store_u32(p, (uint32_t)t->vertex[i][a]);
            else
                store_u64(p, t->vertex[i][a]);
        }
}

/* ---- leaves ------------------------------------------------------------------------------------ */

/* Records and corners of the triangles [first, first + count). */
static bool make_leaves(const struct columns *c, const struct triangle_arrays *t,
                        const struct leaf_frame *frame, uint32_t first, uint32_t count,
                        uint8_t *payload)
{
    struct leaf_batch batch;
    bool ok = true;
    for (uint32_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++) {
            const double *at = t->at[t->corner[first + i][k]];
            for (int a = 0; a < 3; a++)
                batch.corner[k][a][i] = at[a];
        }
    leaf_batch_run(frame, &batch, count);
    for (uint32_t i = 0; i < count; i++) {
        const size_t place = c->place[first + i];
        uint8_t *p = payload + c->layout->indices + 6 * place;
        ok &= leaf_batch_store(&batch, i, payload + c->layout->nodes + ND_SIZE * place);
        for (int k = 0; k < 3; k++)
            store_u16(p + 2 * k, t->corner[first + i][k]);
    }
    return ok;
}

static bool make_all_leaves(const struct columns *c, const struct triangle_arrays *t,
                            uint8_t *payload)
{
    struct leaf_frame frame;
    int64_t base[3];                /* of the vertices, from the cluster's origin */
    if (!leaf_frame_init(&frame, c->frame->origin, c->block->step_exp, c->frame->vertex_exp,
                         c->frame->unit_exp))
        return false;
    for (int a = 0; a < 3; a++) {
        base[a] = (int64_t)load_u64(payload + c->layout->vertex_base + 8 * a);
        if (base[a] < -((int64_t)1 << 53) || base[a] > (int64_t)1 << 53)
            return false;
        base[a] -= frame.origin[a];
    }
    for (uint32_t v = 0; v < c->block->vertex_count; v++)
        for (int a = 0; a < 3; a++)
            t->at[v][a] = (double)((int64_t)t->vertex[v][a] + base[a]);
    for (uint32_t first = 0; first < c->n; first += LEAF_BATCH) {
        const uint32_t count = c->n - first < LEAF_BATCH ? c->n - first : LEAF_BATCH;
        if (!make_leaves(c, t, &frame, first, count, payload))
            return false;
    }
    return true;
}

/* A leaf has the mean colour of its corners. */
static void make_leaf_colors(const struct columns *c, uint8_t *payload)
{
    const uint8_t *colors = payload + c->layout->vertex_colors;
    for (uint32_t i = 0; i < c->n; i++) {
        const uint8_t *p = payload + c->layout->indices + (size_t)6 * i;
        const uint8_t *x = colors + (size_t)4 * load_u16(p), *y = colors + (size_t)4 * load_u16(p + 2);
        const uint8_t *z = colors + (size_t)4 * load_u16(p + 4);
        for (int k = 0; k < 4; k++)
            payload[c->layout->colors + (size_t)4 * i + (size_t)k] =
                (uint8_t)((x[k] + y[k] + z[k] + 1) / 3);
    }
}

static uint32_t count_of(const uint8_t *p, uint32_t n, uint8_t value)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < n; i++)
        count += p[i] == value;
    return count;
}

enum spc_status triangle_columns_get(const struct columns *c, struct planes_reader *r,
                                     uint8_t *payload, struct spc_error *err)
{
    const uint32_t v = c->block->vertex_count;
    struct hearing h = {.c = c};
    void *memory = arrays_create(c->n, v, &h.t);
    if (memory == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for the columns of a block");
    planes_get8(r, h.t.edge, c->n);
    h.loose_max = 3 * count_of(h.t.edge, c->n, EDGE_LOOSE);
    h.third_max = c->n - h.loose_max / 3;
    planes_get8(r, h.t.third, h.third_max);
    planes_get8(r, h.t.loose, h.loose_max);
    h.explicit_max = count_of(h.t.third, h.third_max, CORNER_EXPLICIT) +
                     count_of(h.t.loose, h.loose_max, CORNER_EXPLICIT);
    planes_get16(r, h.t.explicit, h.explicit_max);
    for (int a = 0; a < 3; a++)
        planes_get64(r, h.t.residual[a], c->block->vertex_width, v);
    for (int k = 0; k < 4 && c->layout->vertex_colors; k++)
        planes_get8(r, h.t.color[k], v);
    const bool ok = !r->broken && hear_triangles(&h) && hear_vertices(c, &h.t, payload) &&
                    make_all_leaves(c, &h.t, payload);
    if (ok) {
        store_vertices(c, &h.t, payload);
        if (c->layout->vertex_colors)
            make_leaf_colors(c, payload);
    }
    free(memory);
    return ok ? SPC_OK
              : spc_fail(err, SPC_CORRUPT, c->block->off, "columns of the block: triangles");
}
