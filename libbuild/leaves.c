/*
 * leaves.c - triangles of a cluster on the vertex lattice, and their disks, as readers make them.
 *
 * A batch of triangles at a time, number beside number: loops that become vectors. Every operation is
 * that of space.c, one triangle at a time; the scale is a power of two, so it does not matter that it
 * is applied at once.
 */
#include "pack_int.h"

#include "vec.h"
#include "vectors.h"

#include <assert.h>

enum { KEY_BITS = 21 };

struct batch {
    double file[3][3][PACK_BATCH];  /* coordinates as the scan has them, [corner][axis] */
    struct leaf_batch leaf;
    double radius[PACK_BATCH];
};

struct snapping {                   /* file coordinate -> lattice number from the cluster's origin */
    double origin[3], scale, shift[3];
};

static void gather(const struct pack *p, uint32_t first, uint32_t count, struct batch *b)
{
    const struct spb_record_format *format = &p->shared->format;
    const uint32_t *record = p->leaves.record + first;
    const size_t coordinates = format->wide ? 72 : 36;
    for (uint32_t i = 0; i < count; i++) {
        const uint8_t *r = p->tree->records + (size_t)record[i] * format->bytes;
        float narrow[9];
        double xyz[9];
        if (format->points)
            spb_point_corners(format, p->shared->space, r, xyz);
        else if (format->wide)
            memcpy(xyz, r, sizeof xyz);
        else
            memcpy(narrow, r, sizeof narrow);
        for (int k = 0; k < 9; k++)
            b->file[k / 3][k % 3][i] = format->wide || format->points ? xyz[k] : (double)narrow[k];
        if (p->leaves.rgba != NULL && !format->points)
            memcpy(p->leaves.rgba[first + i], r + coordinates, 12);
    }
}

/* Far records, so that they are there when their batch comes. */
static void prefetch(const struct pack *p, uint32_t first)
{
    const uint32_t count = p->kind[SPC_BLOCK_LEAF].count, bytes = p->shared->format.bytes;
    const uint32_t end = first + PACK_BATCH < count ? first + PACK_BATCH : count;
    for (uint32_t i = first; i < end; i++) {
        const uint8_t *r = p->tree->records + (size_t)p->leaves.record[i] * bytes;
        __builtin_prefetch(r);
        __builtin_prefetch(r + bytes - 1);
    }
}

SPB_VECTORS static void snap(const struct snapping *s, struct batch *b, uint32_t count)
{
    for (int k = 0; k < 3; k++)
        for (int a = 0; a < 3; a++) {
            const double origin = s->origin[a], scale = s->scale, shift = s->shift[a];
            const double *in = b->file[k][a];
            double *out = b->leaf.corner[k][a];
            for (uint32_t i = 0; i < count; i++)
                out[i] = floor((in[i] - origin) * scale + 0.5) + shift;
        }
}

/* The same where cells have lattices of their own. */
static void snap_in_cells(const struct spb_space *space, const struct snapping *s, struct batch *b,
                          uint32_t count)
{
    for (uint32_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++) {
            double u[3], number[3];
            for (int a = 0; a < 3; a++)
                u[a] = spb_space_from_file(space, a, b->file[k][a][i]);
            spb_space_snap_corner(space, u, number);
            for (int a = 0; a < 3; a++)
                b->leaf.corner[k][a][i] = number[a] + s->shift[a];
        }
}

static void keep_keys(struct pack_leaves *l, uint32_t first, const struct leaf_batch *b, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++)
            l->key[first + i][k] = (uint64_t)(int64_t)b->corner[k][0][i] |
                                   (uint64_t)(int64_t)b->corner[k][1][i] << KEY_BITS |
                                   (uint64_t)(int64_t)b->corner[k][2][i] << 2 * KEY_BITS;
}

static void keep_wide(struct pack_leaves *l, uint32_t first, const struct leaf_batch *b, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++)
            for (int a = 0; a < 3; a++)
                l->wide[first + i][k][a] = b->corner[k][a][i];
}

/* False when a centre is not on the lattice of its block. */
SPB_VECTORS static bool keep_disks(struct pack_leaves *l, uint32_t first, const struct leaf_batch *b,
                                   uint32_t count)
{
    int32_t any = 0;
    for (int a = 0; a < 3; a++)
        for (uint32_t i = 0; i < count; i++) {
            any |= b->position[a][i];
            l->at[a][first + i] = (uint16_t)b->position[a][i];
        }
    for (uint32_t i = 0; i < count; i++)
        l->normal[first + i] = (uint16_t)(b->normal[0][i] | b->normal[1][i] << 8);
    for (uint32_t i = 0; i < count; i++)
        l->e_self[first + i] = (uint16_t)b->e_self[i];
    for (uint32_t i = 0; i < count; i++)
        l->radius[first + i] = (uint16_t)b->radius[i];
    for (uint32_t i = 0; i < count; i++)
        l->height[first + i] = (uint8_t)b->height[i];
    return any >= 0;
}

/* Values of length codes, as spc_len_decode. */
SPB_INLINE void decode_lengths(const uint16_t *code, double *out, uint32_t count)
{
    uint32_t bits[PACK_BATCH];
    float value[PACK_BATCH];
    for (uint32_t i = 0; i < count; i++)
        bits[i] = (uint32_t)code[i] << 15;
    memcpy(value, bits, count * sizeof *value);
    for (uint32_t i = 0; i < count; i++)
        out[i] = (double)value[i];
}

SPB_VECTORS static void widen_box(struct pack_leaves *l, uint32_t first, double step, uint32_t count)
{
    double radius[PACK_BATCH];
    decode_lengths(l->radius + first, radius, count);
    for (int a = 0; a < 3; a++) {
        double min = l->min[a], max = l->max[a], low[PACK_BATCH], high[PACK_BATCH];
        for (uint32_t i = 0; i < count; i++) {
            const double at = l->at[a][first + i] * step;
            low[i] = at - radius[i];
            high[i] = at + radius[i];
        }
        for (uint32_t i = 0; i < count; i++) {
            min = low[i] < min ? low[i] : min;
            max = high[i] > max ? high[i] : max;
        }
        l->min[a] = min;
        l->max[a] = max;
    }
}

SPB_VECTORS static double reach_of(const struct pack_leaves *l, uint32_t first, double step,
                                   const double from[3], uint32_t count)
{
    double radius[PACK_BATCH], reach[PACK_BATCH], most = 0;
    decode_lengths(l->radius + first, radius, count);
    for (uint32_t i = 0; i < count; i++) {
        const double x = l->at[0][first + i] * step - from[0];
        const double y = l->at[1][first + i] * step - from[1];
        const double z = l->at[2][first + i] * step - from[2];
        reach[i] = sqrt(x * x + y * y + z * z) + radius[i];
    }
    for (uint32_t i = 0; i < count; i++)
        most = reach[i] > most ? reach[i] : most;
    return most;
}

double pack_leaves_reach(const struct pack *p, const double from[3])
{
    const uint32_t count = p->kind[SPC_BLOCK_LEAF].count;
    const double step = times_exp2(1, p->leaves.step_exp);
    double most = 0;
    for (uint32_t first = 0; first < count; first += PACK_BATCH) {
        const uint32_t n = count - first < PACK_BATCH ? count - first : PACK_BATCH;
        most = larger_of(most, reach_of(&p->leaves, first, step, from, n));
    }
    return most;
}

/* Where all corners are, from the space's origin. */
static void widen_corners(struct spb_cluster *out, const struct leaf_batch *b, const double shift[3],
                          uint32_t count)
{
    for (int k = 0; k < 9; k++)
        for (uint32_t i = 0; i < count; i++) {
            const double at = b->corner[k / 3][k % 3][i] - shift[k % 3];
            out->corner_min[k % 3] = smaller_of(at, out->corner_min[k % 3]);
            out->corner_max[k % 3] = larger_of(at, out->corner_max[k % 3]);
        }
}

/* Whether every corner has 21 bits an axis. */
static bool keys_fit(const struct pack *p)
{
    const struct spb_space *space = p->shared->space;
    bool fit = true;
    for (int a = 0; a < 3; a++)
        fit &= times_exp2(p->max[a] - p->origin[a], space->unit_exp - space->vertex_exp) <
               (1 << KEY_BITS) - 1;
    return fit;
}

enum spc_status pack_leaves(struct pack *p, int step_exp, struct spc_error *err)
{
    const struct spb_space *space = p->shared->space;
    const uint32_t count = p->kind[SPC_BLOCK_LEAF].count;
    struct pack_leaves *l = &p->leaves;
    const double step = times_exp2(1, step_exp);
    struct leaf_frame frame;
    struct snapping s = {.scale = ldexp(1, -space->vertex_exp)};
    struct batch b;
    bool fits = leaf_frame_init(&frame, p->frame.origin, step_exp + space->unit_exp, space->vertex_exp,
                                space->unit_exp);
    for (int a = 0; a < 3; a++) {
        s.origin[a] = space->origin[a];
        s.shift[a] = (double)(spb_space_origin_number(space, a) - frame.origin[a]);
        l->min[a] = HUGE_VAL;
        l->max[a] = -HUGE_VAL;
        p->out->corner_min[a] = HUGE_VAL;
        p->out->corner_max[a] = -HUGE_VAL;
    }
    l->step_exp = step_exp;
    if (!keys_fit(p) && count > 0) {
        l->wide = pack_scratch_buffer(p->memory, PACK_WIDE, count * sizeof *l->wide);
        if (l->wide == NULL)
            return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to pack a cluster");
    }
    prefetch(p, 0);
    for (uint32_t first = 0; first < count; first += PACK_BATCH) {
        const uint32_t n = count - first < PACK_BATCH ? count - first : PACK_BATCH;
        prefetch(p, first + PACK_BATCH);
        gather(p, first, n, &b);
        if (space->cells != NULL) {
            snap_in_cells(space, &s, &b, n);
            widen_corners(p->out, &b.leaf, s.shift, n);
        } else {
            snap(&s, &b, n);
        }
        pack_shapes(p, (const double(*)[3][PACK_BATCH])b.file, &b.leaf, s.shift, n);
        if (l->wide)
            keep_wide(l, first, &b.leaf, n);
        else
            keep_keys(l, first, &b.leaf, n);
        leaf_batch_run(&frame, &b.leaf, n);
        fits &= keep_disks(l, first, &b.leaf, n);
        widen_box(l, first, step, n);
    }
    assert(fits);
    (void)fits;
    return SPC_OK;
}
