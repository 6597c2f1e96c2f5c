/*
 * payload.c - a block's arrays, encoded (spec section 6).
 */
#include "pack_int.h"

#include "bytes.h"
#include "layout.h"
#include "vec.h"

#include <assert.h>
#include <stdlib.h>

/* ---- vertices: equal corners of a block become one --------------------------------------------- */

struct vertex {
    int64_t at[3];                  /* lattice, counted from the space's origin */
    uint8_t rgba[4];
};

struct vertex_set {
    struct vertex *vertices;        /* by first use */
    uint32_t count;
    uint32_t *slots;                /* open addressing: vertex number + 1, 0 is free */
    uint32_t mask;
};

static uint32_t slot_of(const struct vertex *v)
{
    uint64_t h = 0;
    for (int a = 0; a < 3; a++)
        h = (h ^ (uint64_t)v->at[a]) * 0x9E3779B97F4A7C15u;
    h = (h ^ load_u32(v->rgba)) * 0xD6E8FEB86659FD93u;
    return (uint32_t)(h >> 32);
}

static bool same_vertex(const struct vertex *a, const struct vertex *b)
{
    return a->at[0] == b->at[0] && a->at[1] == b->at[1] && a->at[2] == b->at[2] &&
           memcmp(a->rgba, b->rgba, 4) == 0;
}

static uint32_t vertex_number(struct vertex_set *set, const struct vertex *v)
{
    uint32_t slot = slot_of(v) & set->mask;
    while (set->slots[slot] != 0) {
        if (same_vertex(&set->vertices[set->slots[slot] - 1], v))
            return set->slots[slot] - 1;
        slot = (slot + 1) & set->mask;
    }
    set->vertices[set->count] = *v;
    set->slots[slot] = ++set->count;
    return set->count - 1;
}

static bool vertex_set_init(struct vertex_set *set, uint32_t leaves)
{
    uint32_t slots = 16;
    while (slots < 6 * leaves)
        slots *= 2;
    *set = (struct vertex_set){.mask = slots - 1};
    set->vertices = malloc((size_t)3 * leaves * sizeof *set->vertices);
    set->slots = calloc(slots, sizeof *set->slots);
    return set->vertices != NULL && set->slots != NULL;
}

/* Corners of the block's leaves in stored order: indices[count][3] into the set. */
static void collect_vertices(const struct pack *p, const struct pack_block *b,
                             struct vertex_set *set, uint16_t *indices)
{
    const struct spb_pack_shared *shared = p->shared;
    const uint32_t *nodes = p->sequence[b->kind].nodes + b->first;
    for (uint32_t i = 0; i < b->count; i++) {
        const struct spb_node *n = &p->tree->nodes[p->nodes[nodes[i]].node];
        struct spb_face face;
        spb_record_load(&shared->format, shared->space,
                        p->tree->records + (size_t)n->link * shared->format.bytes, &face);
        for (uint32_t k = 0; k < 3; k++) {
            struct vertex v = {.rgba = {255, 255, 255, 255}};
            for (int a = 0; a < 3; a++)
                v.at[a] = (int64_t)spb_space_snap(shared->space, face.corner[k][a]);
            if (shared->options.flags & SPC_FLAG_COLORS)
                memcpy(v.rgba, face.rgba[k], 4);
            indices[3 * i + k] = (uint16_t)vertex_number(set, &v);
        }
    }
}

static uint32_t vertex_range(const struct vertex_set *set, int64_t base[3])
{
    int64_t widest = 0;
    for (int a = 0; a < 3; a++) {
        int64_t min = INT64_MAX, max = INT64_MIN;
        for (uint32_t i = 0; i < set->count; i++) {
            min = set->vertices[i].at[a] < min ? set->vertices[i].at[a] : min;
            max = set->vertices[i].at[a] > max ? set->vertices[i].at[a] : max;
        }
        base[a] = min;
        widest = max - min > widest ? max - min : widest;
    }
    return widest <= UINT16_MAX ? 2 : widest <= UINT32_MAX ? 4 : 8;
}

static void store_triangles(const struct pack *p, const struct vertex_set *set,
                            const uint16_t *indices, const int64_t base[3], uint32_t leaves,
                            uint32_t width, const struct spc_block_layout *l, uint8_t *out)
{
    for (uint32_t i = 0; i < 3 * leaves; i++)
        store_u16(out + l->indices + 2 * i, indices[i]);
    for (int a = 0; a < 3; a++) {
        const int64_t number = base[a] + spb_space_origin_number(p->shared->space, a);
        store_u64(out + l->vertex_base + 8 * a, (uint64_t)number);
    }
    for (uint32_t i = 0; i < set->count; i++) {
        uint8_t *at = out + l->vertices + (size_t)3 * width * i;
        for (int a = 0; a < 3; a++, at += width) {
            const uint64_t off = (uint64_t)(set->vertices[i].at[a] - base[a]);
            if (width == 2)
                store_u16(at, (uint16_t)off);
            else if (width == 4)
                store_u32(at, (uint32_t)off);
            else
                store_u64(at, off);
        }
        if (l->vertex_colors)
            memcpy(out + l->vertex_colors + 4 * (size_t)i, set->vertices[i].rgba, 4);
    }
}

/* ---- nodes ------------------------------------------------------------------------------------- */

/* Child counts of an inner node: 0 for an owner, else by their sum and the inner ones (section 7). */
static uint32_t child_code(const struct pack *p, const struct pack_node *q)
{
    const struct spb_node *n = &p->tree->nodes[q->node];
    uint32_t inner = 0;
    if (n->owner)
        return 0;
    for (uint32_t k = 0; k < n->child_count; k++)
        inner += !p->nodes[q->child_first + k].leaf;
    return (n->child_count == 2 ? 1u : n->child_count == 3 ? 4u : 8u) + inner;
}

static void store_node(const struct pack *p, const struct spc_block *b, const struct pack_node *q,
                       uint8_t *out)
{
    for (int a = 0; a < 3; a++) {
        const double at = ldexp(q->center[a] - p->origin[a],
                                p->shared->space->unit_exp - b->step_exp);
        assert(at >= 0 && at <= 65535);
        store_u16(out + ND_X + 2 * a, (uint16_t)at);
    }
    store_u16(out + ND_NORMAL, p->tree->nodes[q->node].normal);
    store_u16(out + ND_E_SELF, q->e_self);
    store_u16(out + ND_E_PARENT, q->e_parent);
    store_u16(out + ND_RADIUS, q->radius_code);
    out[ND_HEIGHT] = q->height_code;
    out[ND_LINK] = spc_link_encode_up(q->link, b->link_base);
}

double pack_cone_about(const double axis[3], const struct spb_node *node)
{
    double n[3];
    spc_normal_decode(node->normal, n);
    const double a = fmax(-1, fmin(1, vec_dot(axis, n)));
    const double b = (double)node->cone;
    if (b <= -1 || a <= -b)
        return -1;
    return fmax(-1, a * b - sqrt(1 - a * a) * sqrt(1 - b * b) - 1e-7);
}

/* Counts of the normal clusters, and for each the cosine of its cone about its axis, Q15 down. */
static void store_groups(const struct pack *p, const struct pack_block *b, uint8_t *out)
{
    const struct pack_sequence *s = &p->sequence[b->kind];
    uint32_t counts[128] = {0};
    double cones[128];
    const uint32_t groups = p->shared->options.normal_clusters;
    for (uint32_t g = 0; g < groups; g++)
        cones[g] = 1;
    for (uint32_t f = b->family_first; f < b->family_first + b->family_count; f++)
        counts[s->families[f].group] += s->families[f].count;
    uint32_t at = b->first;
    for (uint32_t g = 0; g < groups; g++)
        for (uint32_t i = 0; i < counts[g]; i++, at++)
            cones[g] = fmin(cones[g], pack_cone_about(p->shared->axis[g],
                                          &p->tree->nodes[p->nodes[s->nodes[at]].node]));
    for (uint32_t g = 0; g < groups; g++) {
        store_u16(out + 4 * g, (uint16_t)counts[g]);
        store_u16(out + 4 * g + 2, (uint16_t)(int16_t)floor(cones[g] * 32767));
    }
}

/* Ranges of the block's record; link_max is of this block alone until pack.c widens it. */
static void measure_block(const struct pack *p, const struct pack_block *pb, struct spc_block *b)
{
    const uint32_t *nodes = p->sequence[pb->kind].nodes + pb->first;
    double link = 0;
    int step = INT32_MAX;
    uint16_t parent_min = UINT16_MAX, parent_max = 0, self_min = UINT16_MAX, radius_max = 0;
    for (uint32_t i = 0; i < pb->count; i++) {
        const struct pack_node *q = &p->nodes[nodes[i]];
        link = fmax(link, q->link);
        step = q->step_exp < step ? q->step_exp : step;
        parent_min = q->e_parent < parent_min ? q->e_parent : parent_min;
        parent_max = q->e_parent > parent_max ? q->e_parent : parent_max;
        self_min = q->e_self < self_min ? q->e_self : self_min;
        radius_max = q->radius_code > radius_max ? q->radius_code : radius_max;
    }
    b->kind = pb->kind;
    b->node_count = pb->count;
    b->codec = p->shared->options.codec;
    b->e_parent_max = spc_len_decode(parent_max);
    b->e_parent_min = spc_len_decode(parent_min);
    b->e_self_min = spc_len_decode(self_min);
    b->radius_max = spc_len_decode(radius_max);
    b->step_exp = step + p->shared->space->unit_exp;
    b->link_base = spc_link_base(link);
    b->link_max = spc_link_decode(spc_link_encode_up(link, b->link_base), b->link_base);
}

static void store_nodes(const struct pack *p, const struct pack_block *pb,
                        const struct spc_block *b, const struct spc_block_layout *l, uint8_t *out)
{
    const uint32_t *nodes = p->sequence[pb->kind].nodes + pb->first;
    for (uint32_t i = 0; i < pb->count; i++) {
        const struct pack_node *q = &p->nodes[nodes[i]];
        store_node(p, b, q, out + l->nodes + (size_t)ND_SIZE * i);
        if (l->colors)
            memcpy(out + l->colors + 4 * (size_t)i, p->tree->nodes[q->node].rgba, 4);
        if (l->children)
            out[l->children + i / 2] |= (uint8_t)(child_code(p, q) << 4 * (i & 1));
    }
    store_groups(p, pb, out + l->groups);
}

enum spc_status pack_payload(struct pack *p, uint32_t k, struct spc_error *err)
{
    const struct spb_pack_options *o = &p->shared->options;
    const struct pack_block *pb = &p->blocks[k];
    struct spc_block *b = &p->out->blocks[k];
    const bool triangles = pb->kind == SPC_BLOCK_LEAF && (o->flags & SPC_FLAG_TRIANGLES);
    struct vertex_set set = {0};
    uint16_t *indices = NULL;
    uint8_t *payload = NULL, *stored = NULL;
    int64_t base[3] = {0, 0, 0};
    struct spc_block_layout l;
    enum spc_status status = SPC_OK;
    measure_block(p, pb, b);
    if (triangles) {
        indices = malloc((size_t)6 * pb->count);
        if (!vertex_set_init(&set, pb->count) || indices == NULL)
            goto no_memory;
        collect_vertices(p, pb, &set, indices);
        b->vertex_count = set.count;
        b->vertex_width = vertex_range(&set, base);
    }
    if (!spc_block_layout(b, o->flags, o->normal_clusters, &l)) {
        status = spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "a block is over the limits");
        goto out;
    }
    b->raw_bytes = l.bytes;
    payload = calloc(1, l.bytes);
    stored = malloc(spc_block_stored_bound(l.bytes));
    if (payload == NULL || stored == NULL)
        goto no_memory;
    store_nodes(p, pb, b, &l, payload);
    pack_copy_tops(p, pb, b, payload + l.nodes);
    if (triangles)
        store_triangles(p, &set, indices, base, pb->count, b->vertex_width, &l, payload);
    status = spc_block_encode(b, &l, o->normal_clusters, payload, o->level, stored, err);
    if (status == SPC_OK)
        status = spb_tmpfile_append(spb_spool_file(p->shared->spool), stored, b->stored_bytes,
                                    &p->out->stored_off[k], err);
    goto out;
no_memory:
    status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to pack a block");
out:
    free(stored);
    free(payload);
    free(indices);
    free(set.vertices);
    free(set.slots);
    return status;
}
