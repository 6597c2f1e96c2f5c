/*
 * payload.c - a block's arrays, encoded (spec section 6).
 */
#include "pack_int.h"

#include "bytes.h"
#include "edge_ring.h"
#include "layout.h"
#include "vec.h"

#include <assert.h>
#include <stdlib.h>

/* ---- vertices: equal corners of a block become one --------------------------------------------- */

struct vertex {
    int64_t at[3];                  /* lattice number */
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

static uint32_t vertex_known(const struct vertex_set *set, const struct vertex *v)
{
    for (uint32_t slot = slot_of(v) & set->mask; set->slots[slot] != 0;
         slot = (slot + 1) & set->mask)
        if (same_vertex(&set->vertices[set->slots[slot] - 1], v))
            return set->slots[slot] - 1;
    return SPC_NONE;
}

/*
 * Which corner comes first: the one that starts the edge seen last, so that the triangle is told
 * from it. Turning keeps the winding.
 */
static int turn_of(const struct vertex_set *set, const struct edge_ring *ring,
                   const struct vertex v[3], bool *loose)
{
    uint32_t number[3], best = EDGE_LOOSE;
    int turn = 0;
    for (int k = 0; k < 3; k++)
        number[k] = vertex_known(set, &v[k]);
    for (int k = 0; k < 3; k++) {
        const uint32_t from = number[k], to = number[(k + 1) % 3];
        const uint32_t code = from == SPC_NONE || to == SPC_NONE ? EDGE_LOOSE
                                                                 : edge_find(ring, from, to);
        if (code != EDGE_LOOSE && (best == EDGE_LOOSE || edge_age(code) < edge_age(best))) {
            best = code;
            turn = k;
        }
    }
    *loose = best == EDGE_LOOSE;
    return turn;
}

/* Corners of the block's leaves, numbered by first use in canonical order: indices[count][3]. */
static void collect_vertices(const struct pack *p, const struct pack_block *b,
                             struct vertex_set *set, uint16_t *indices)
{
    const struct pack_sequence *s = &p->sequence[b->kind];
    struct edge_ring ring = {.edges = 0};
    uint32_t i = 0;
    for (uint32_t f = 0; f < b->family_count; f++) {
        const struct pack_family *family = pack_family_of(p, b, f);
        for (uint32_t m = 0; m < family->count; m++, i++) {
            const struct pack_leaf *leaf =
                &p->leaves[p->nodes[s->nodes[family->first + m]].leaf_number];
            struct vertex v[3];
            for (int k = 0; k < 3; k++) {
                memcpy(v[k].at, leaf->corner[k], sizeof v[k].at);
                memcpy(v[k].rgba, leaf->rgba[k], 4);
            }
            bool loose;
            const int turn = turn_of(set, &ring, v, &loose);
            for (int k = 0; k < 3; k++)
                indices[3 * i + (uint32_t)k] = (uint16_t)vertex_number(set, &v[(turn + k) % 3]);
            edge_push_triangle(&ring, indices[3 * i], indices[3 * i + 1], indices[3 * i + 2],
                               loose);
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

static void store_triangles(const struct pack_block *b, const uint32_t *place,
                            const struct vertex_set *set, const uint16_t *indices,
                            const int64_t base[3], uint32_t width,
                            const struct spc_block_layout *l, uint8_t *out)
{
    for (uint32_t i = 0; i < b->count; i++)
        for (uint32_t k = 0; k < 3; k++)
            store_u16(out + l->indices + 6 * place[i] + 2 * k, indices[3 * i + k]);
    for (int a = 0; a < 3; a++)
        store_u64(out + l->vertex_base + 8 * a, (uint64_t)base[a]);
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
        const double at = times_exp2(q->center[a] - p->origin[a],
                                p->shared->space->unit_exp - b->step_exp);
        assert(at >= 0 && at <= 65535);
        store_u16(out + ND_X + 2 * a, (uint16_t)at);
    }
    store_u16(out + ND_NORMAL, q->normal);
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
    const double a = larger_of(-1, smaller_of(1, vec_dot(axis, n)));
    const double b = (double)node->cone;
    if (b <= -1 || a <= -b)
        return -1;
    return larger_of(-1, a * b - sqrt(1 - a * a) * sqrt(1 - b * b) - 1e-7);
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
    for (uint32_t f = 0; f < b->family_count; f++) {
        const struct pack_family *family = pack_family_of(p, b, f);
        const uint32_t g = family->group;
        counts[g] += family->count;
        for (uint32_t k = 0; k < family->count; k++)
            cones[g] = smaller_of(cones[g],
                            pack_cone_about(p->shared->axis[g],
                                &p->tree->nodes[p->nodes[s->nodes[family->first + k]].node]));
    }
    for (uint32_t g = 0; g < groups; g++) {
        store_u16(out + 4 * g, (uint16_t)counts[g]);
        store_u16(out + 4 * g + 2, (uint16_t)(int16_t)floor(cones[g] * 32767));
    }
}

/* Leaves of a family share the longest of their links: they are stored as one. */
static void share_links(struct pack *p, const struct pack_block *pb)
{
    const uint32_t *nodes = p->sequence[pb->kind].nodes;
    for (uint32_t f = 0; f < pb->family_count && pb->kind == SPC_BLOCK_LEAF; f++) {
        const struct pack_family *family = pack_family_of(p, pb, f);
        double link = 0;
        for (uint32_t k = 0; k < family->count; k++)
            link = larger_of(link, p->nodes[nodes[family->first + k]].link);
        for (uint32_t k = 0; k < family->count; k++)
            p->nodes[nodes[family->first + k]].link = link;
    }
}

/* Ranges of the block's record; link_max is of this block alone until pack.c widens it. */
static void measure_block(const struct pack *p, const struct pack_block *pb, struct spc_block *b)
{
    const uint32_t *nodes = p->sequence[pb->kind].nodes;
    double link = 0;
    int step = INT32_MAX;
    uint16_t parent_min = UINT16_MAX, parent_max = 0, self_min = UINT16_MAX, radius_max = 0;
    for (uint32_t f = 0; f < pb->family_count; f++) {
        const struct pack_family *family = pack_family_of(p, pb, f);
        parent_min = family->e_parent < parent_min ? family->e_parent : parent_min;
        parent_max = family->e_parent > parent_max ? family->e_parent : parent_max;
        for (uint32_t k = 0; k < family->count; k++) {
            const struct pack_node *q = &p->nodes[nodes[family->first + k]];
            link = larger_of(link, q->link);
            step = q->step_exp < step ? q->step_exp : step;
            self_min = q->e_self < self_min ? q->e_self : self_min;
            radius_max = q->radius_code > radius_max ? q->radius_code : radius_max;
        }
    }
    b->kind = pb->kind;
    b->node_count = pb->count;
    b->codec = p->shared->options.codec;
    b->e_parent_max = spc_len_decode(parent_max);
    b->e_parent_min = spc_len_decode(parent_min);
    b->e_self_min = spc_len_decode(self_min);
    b->radius_max = spc_len_decode(radius_max);
    b->diagonal = (float)p->diagonal;
    b->step_exp = step + p->shared->space->unit_exp;
    b->link_base = spc_link_base(link);
    b->link_max = spc_link_decode(spc_link_encode_up(link, b->link_base), b->link_base);
}

/* Where each node of the block goes, by canonical number: families of a group in their order. */
static void place_nodes(const struct pack *p, const struct pack_block *pb, uint32_t *place)
{
    uint32_t next[129] = {0}, i = 0;
    for (uint32_t f = 0; f < pb->family_count; f++)
        next[pack_family_of(p, pb, f)->group + 1] += pack_family_of(p, pb, f)->count;
    for (uint32_t g = 0; g < 128; g++)
        next[g + 1] += next[g];
    for (uint32_t f = 0; f < pb->family_count; f++) {
        const struct pack_family *family = pack_family_of(p, pb, f);
        for (uint32_t k = 0; k < family->count; k++)
            place[i++] = next[family->group]++;
    }
}

static void fill_families(const struct pack *p, const struct pack_block *pb, uint32_t block,
                          struct spc_family *out)
{
    for (uint32_t f = 0; f < pb->family_count; f++) {
        const struct pack_family *family = pack_family_of(p, pb, f);
        const bool here = family->parent != PACK_OWNER && pb->kind == SPC_BLOCK_INNER &&
                          p->nodes[family->parent].block == block;
        out[f] = (struct spc_family){
            .parent = here ? p->nodes[family->parent].number : UINT16_MAX,
            .size = (uint8_t)family->count, .group = (uint8_t)family->group};
    }
}

static void store_nodes(struct pack *p, const struct pack_block *pb, const uint32_t *place,
                        const struct spc_block *b, const struct spc_block_layout *l, uint8_t *out)
{
    const struct pack_sequence *s = &p->sequence[pb->kind];
    uint32_t i = 0;
    for (uint32_t f = 0; f < pb->family_count; f++) {
        const struct pack_family *family = pack_family_of(p, pb, f);
        for (uint32_t k = 0; k < family->count; k++, i++) {
            const uint32_t node = s->nodes[family->first + k], at = place[i];
            const struct pack_node *q = &p->nodes[node];
            uint8_t *record = out + l->nodes + (size_t)ND_SIZE * at;
            store_node(p, b, q, record);
            pack_copy_top(p, node, b, record);
            if (l->colors)
                memcpy(out + l->colors + 4 * (size_t)at, p->tree->nodes[q->node].rgba, 4);
            if (l->children)
                out[l->children + at / 2] |= (uint8_t)(child_code(p, q) << 4 * (at & 1));
        }
    }
    store_groups(p, pb, out + l->groups);
}

struct scratch {                    /* of one block */
    struct vertex_set set;
    uint16_t *indices;              /* [3 count] */
    uint32_t *place;                /* [count] */
    struct spc_family *families;
    uint8_t *payload, *stored;
};

static void scratch_release(struct scratch *t)
{
    free(t->set.vertices);
    free(t->set.slots);
    free(t->indices);
    free(t->place);
    free(t->families);
    free(t->payload);
    free(t->stored);
}

static enum spc_status encode_block(struct pack *p, uint32_t k, struct scratch *t,
                                    struct spc_error *err)
{
    const struct spb_pack_options *o = &p->shared->options;
    const struct pack_block *pb = &p->blocks[k];
    struct spc_block *b = &p->out->blocks[k];
    const struct spc_frame frame = pack_frame(p);
    const bool triangles = pb->kind == SPC_BLOCK_LEAF && (o->flags & SPC_FLAG_TRIANGLES);
    int64_t base[3] = {0, 0, 0};
    struct spc_block_layout l;
    share_links(p, pb);
    measure_block(p, pb, b);
    t->place = malloc(pb->count * sizeof *t->place);
    t->families = malloc(pb->family_count * sizeof *t->families);
    t->indices = malloc((size_t)6 * pb->count);
    if (!t->place || !t->families || !t->indices ||
        (triangles && !vertex_set_init(&t->set, pb->count)))
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to pack a block");
    if (triangles) {
        collect_vertices(p, pb, &t->set, t->indices);
        b->vertex_count = t->set.count;
        b->vertex_width = vertex_range(&t->set, base);
    }
    if (!spc_block_layout(b, o->flags, o->normal_clusters, &l))
        return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "a block is over the limits");
    t->payload = calloc(1, l.bytes);
    t->stored = malloc(spc_block_stored_bound(l.bytes));
    if (t->payload == NULL || t->stored == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to pack a block");
    place_nodes(p, pb, t->place);
    store_nodes(p, pb, t->place, b, &l, t->payload);
    if (triangles)
        store_triangles(pb, t->place, &t->set, t->indices, base, b->vertex_width, &l, t->payload);
    fill_families(p, pb, k, t->families);
    return spc_block_encode(b, &l, &frame, t->families, pb->family_count, t->payload, o->level,
                            t->stored, err);
}

enum spc_status pack_payload(struct pack *p, uint32_t k, struct spc_error *err)
{
    struct scratch t = {.indices = NULL};
    enum spc_status status = encode_block(p, k, &t, err);
    if (status == SPC_OK)
        status = spb_tmpfile_append(spb_spool_file(p->shared->spool), t.stored,
                                    p->out->blocks[k].stored_bytes, &p->out->stored_off[k], err);
    scratch_release(&t);
    return status;
}
