/*
 * payload.c - a block's arrays, encoded (spec section 6).
 */
#include "pack_int.h"

#include "bytes.h"
#include "layout.h"
#include "vec.h"

#include <assert.h>
#include <math.h>

/* ---- triangles --------------------------------------------------------------------------------- */

static uint32_t vertex_range(const struct pack *p, const struct pack_weld *weld, int64_t base[3])
{
    int64_t widest = 0;
    for (int a = 0; a < 3; a++) {
        int64_t min = INT64_MAX, max = INT64_MIN;
        for (uint32_t i = 0; i < weld->count; i++) {
            const int64_t at = pack_vertex_at(p, &weld->vertices[i], a);
            min = at < min ? at : min;
            max = at > max ? at : max;
        }
        base[a] = min;
        widest = max - min > widest ? max - min : widest;
    }
    return widest <= UINT16_MAX ? 2 : widest <= UINT32_MAX ? 4 : 8;
}

/* base: from the cluster's origin, which is a lattice point. */
static void store_vertices(const struct pack *p, const struct pack_weld *weld, const int64_t base[3],
                           uint32_t width, const struct spc_block_layout *l, uint8_t *out)
{
    for (int a = 0; a < 3; a++)
        store_u64(out + l->vertex_base + 8 * a,
                  (uint64_t)((int64_t)times_exp2(p->frame.origin[a], -p->frame.vertex_exp) + base[a]));
    uint8_t *at = out + l->vertices;
    for (uint32_t i = 0; i < weld->count; i++) {
        const struct pack_vertex *v = &weld->vertices[i];
        for (int a = 0; a < 3; a++, at += width) {
            const uint64_t off = (uint64_t)(pack_vertex_at(p, v, a) - base[a]);
            if (width == 2)
                store_u16(at, (uint16_t)off);
            else if (width == 4)
                store_u32(at, (uint32_t)off);
            else
                store_u64(at, off);
        }
        if (l->vertex_colors)
            memcpy(out + l->vertex_colors + 4 * (size_t)i, v->rgba, 4);
    }
}

static void store_indices(const struct pack_block *b, const uint32_t *place, const uint16_t *indices,
                          uint8_t *out)
{
    for (uint32_t i = 0; i < b->count; i++)
        for (uint32_t k = 0; k < 3; k++)
            store_u16(out + 6 * (size_t)place[i] + 2 * k, indices[3 * i + k]);
}

/* ---- nodes ------------------------------------------------------------------------------------- */

static void store_inner(const struct pack *p, const struct spc_block *b,
                        const struct pack_family *family, uint8_t link, uint32_t i, uint8_t *out)
{
    const struct pack_inner *q = &p->inner[i];
    for (int a = 0; a < 3; a++) {
        const double at = times_exp2(q->at[a], p->frame.unit_exp - b->step_exp);
        assert(at >= 0 && at <= 65535);
        store_u16(out + ND_X + 2 * a, (uint16_t)at);
    }
    store_u16(out + ND_NORMAL, p->kind[SPC_BLOCK_INNER].normal[i]);
    store_u16(out + ND_E_SELF, q->e_self);
    store_u16(out + ND_E_PARENT, family->e_parent);
    store_u16(out + ND_RADIUS, q->radius_code);
    out[ND_HEIGHT] = q->height_code;
    out[ND_LINK] = link;
}

static void store_leaf(const struct pack *p, const struct pack_family *family, uint8_t link, uint32_t i,
                       uint8_t *out)
{
    const struct pack_leaves *l = &p->leaves;
    for (int a = 0; a < 3; a++)
        store_u16(out + ND_X + 2 * a, l->at[a][i]);
    store_u16(out + ND_NORMAL, l->normal[i]);
    store_u16(out + ND_E_SELF, l->e_self[i]);
    store_u16(out + ND_E_PARENT, family->e_parent);
    store_u16(out + ND_RADIUS, l->radius[i]);
    out[ND_HEIGHT] = l->height[i];
    out[ND_LINK] = link;
}

/* Counts of the normal clusters, and for each the cosine of its cone about its axis, Q15 down. */
static void store_groups(struct pack *p, const struct pack_block *b, uint8_t *out)
{
    uint32_t counts[SPC_NORMAL_CLUSTERS_MAX] = {0};
    double cosine[SPC_NORMAL_CLUSTERS_MAX];
    pack_cones(p, b, cosine);
    for (uint32_t f = 0; f < b->family_count; f++)
        counts[pack_family_of(p, b, f)->group] += pack_family_of(p, b, f)->count;
    for (uint32_t g = 0; g < p->shared->options.normal_clusters; g++) {
        store_u16(out + 4 * g, (uint16_t)counts[g]);
        store_u16(out + 4 * g + 2, (uint16_t)(int16_t)floor(cosine[g] * 32767));
    }
}

static void widen(uint16_t range[2], uint16_t code)
{
    range[0] = code < range[0] ? code : range[0];
    range[1] = code > range[1] ? code : range[1];
}

static void widen_by(uint16_t range[2], const uint16_t other[2])
{
    widen(range, other[0]);
    widen(range, other[1]);
}

static const struct pack_range NOTHING = {{UINT16_MAX, 0}, {UINT16_MAX, 0}, {UINT16_MAX, 0}};

/* Codes of the block's nodes; step and link of the coarsest. */
static struct pack_range measure_nodes(const struct pack *p, const struct pack_block *b, int *step,
                                       double *link)
{
    const bool leaves = b->kind == SPC_BLOCK_LEAF;
    struct pack_range r = NOTHING;
    *step = leaves ? p->leaves.step_exp : INT32_MAX;
    *link = 0;
    for (uint32_t f = 0; f < b->family_count; f++) {
        const struct pack_family *family = pack_family_of(p, b, f);
        widen(r.e_parent, family->e_parent);
        if (leaves)
            *link = larger_of(*link, family->link);
        for (uint32_t i = family->first; i < family->first + family->count; i++) {
            widen(r.e_self, leaves ? p->leaves.e_self[i] : p->inner[i].e_self);
            widen(r.radius, leaves ? p->leaves.radius[i] : p->inner[i].radius_code);
            if (leaves)
                continue;
            *link = larger_of(*link, p->inner[i].link);
            *step = p->inner[i].step_exp < *step ? p->inner[i].step_exp : *step;
        }
    }
    return r;
}

/* Ranges of the block's record; link_max is of this block alone until pack.c widens it. */
static void measure_block(struct pack *p, const struct pack_block *pb, struct spc_block *b)
{
    double link;
    int step;
    const struct pack_range r = measure_nodes(p, pb, &step, &link);
    b->kind = pb->kind;
    b->node_count = pb->count;
    b->codec = p->shared->options.codec;
    b->e_parent_max = spc_len_decode(r.e_parent[1]);
    b->e_parent_min = spc_len_decode(r.e_parent[0]);
    b->e_self_min = spc_len_decode(r.e_self[0]);
    b->radius_max = spc_len_decode(r.radius[1]);
    b->diagonal = (float)p->diagonal;
    b->step_exp = step + p->frame.unit_exp;
    b->link_base = spc_link_base(link);
    b->link_max = spc_link_decode(spc_link_encode_up(link, b->link_base), b->link_base);
    widen_by(p->range.e_self, r.e_self);
    widen_by(p->range.e_parent, r.e_parent);
    widen_by(p->range.radius, r.radius);
    if (pb->kind == SPC_BLOCK_LEAF)
        return;
    p->out->inner_e_min = r.e_self[0] < p->out->inner_e_min ? r.e_self[0] : p->out->inner_e_min;
    p->out->inner_e_max = r.e_self[1] > p->out->inner_e_max ? r.e_self[1] : p->out->inner_e_max;
}

/* Where each node of the block goes, by canonical number: families of a group in their order. */
static void place_nodes(const struct pack *p, const struct pack_block *pb, uint32_t *place)
{
    uint32_t next[SPC_NORMAL_CLUSTERS_MAX + 1] = {0}, i = 0;
    for (uint32_t f = 0; f < pb->family_count; f++)
        next[pack_family_of(p, pb, f)->group + 1] += pack_family_of(p, pb, f)->count;
    for (uint32_t g = 0; g < SPC_NORMAL_CLUSTERS_MAX; g++)
        next[g + 1] += next[g];
    for (uint32_t f = 0; f < pb->family_count; f++) {
        const struct pack_family *family = pack_family_of(p, pb, f);
        for (uint32_t k = 0; k < family->count; k++)
            place[i++] = next[family->group]++;
    }
}

/* Is the parent of a family of inner nodes in the same block? */
static bool parent_is_here(const struct pack *p, const struct pack_family *family)
{
    return family->parent != PACK_OWNER && p->inner[family->parent].block == p->inner[family->first].block;
}

static void fill_families(const struct pack *p, const struct pack_block *pb, struct spc_family *out)
{
    for (uint32_t f = 0; f < pb->family_count; f++) {
        const struct pack_family *family = pack_family_of(p, pb, f);
        const bool here = pb->kind == SPC_BLOCK_INNER && parent_is_here(p, family);
        out[f] = (struct spc_family){
            .parent = here ? p->inner[family->parent].number : UINT16_MAX,
            .size = (uint8_t)family->count, .group = (uint8_t)family->group};
    }
}

/* The record of a top, for the directory: inner tops come first, each kind in child order. */
static void copy_top(struct pack *p, enum spc_block_kind kind, uint32_t k, const struct spc_block *b,
                     const uint8_t *record)
{
    const struct pack_kind *inner = &p->kind[SPC_BLOCK_INNER];
    struct spc_cluster *c = &p->out->record;
    const uint32_t before = kind == SPC_BLOCK_LEAF && inner->family_count > 0 &&
                            inner->families[0].parent == PACK_OWNER ? inner->families[0].count : 0;
    memcpy(c->tops[before + k].record, record, ND_SIZE);
    memcpy(c->tops[before + k].rgba, p->kind[kind].rgba[k], 4);
    c->tops[before + k].step_exp = (int16_t)b->step_exp;
    c->tops[before + k].link_base = (int16_t)b->link_base;
    c->tops_are_leaf[before + k] = kind == SPC_BLOCK_LEAF;
    c->top_count++;
}

/* Links of a family are one where its parent is elsewhere: nothing in the block would tell them apart. */
static double longest_link(const struct pack *p, enum spc_block_kind kind, const struct pack_family *family)
{
    if (kind == SPC_BLOCK_LEAF)
        return family->link;
    double longest = 0;
    for (uint32_t i = family->first; i < family->first + family->count; i++)
        longest = larger_of(longest, p->inner[i].link);
    return longest;
}

static void store_family(struct pack *p, const struct pack_block *pb, const struct pack_family *family,
                         const uint32_t *place, const struct spc_block *b,
                         const struct spc_block_layout *l, uint8_t *out)
{
    const bool shared = pb->kind == SPC_BLOCK_LEAF || !parent_is_here(p, family);
    const double longest = shared ? longest_link(p, pb->kind, family) : 0;
    for (uint32_t k = 0; k < family->count; k++) {
        const uint32_t i = family->first + k, at = place[k];
        const uint8_t link = spc_link_encode_up(shared ? longest : p->inner[i].link, b->link_base);
        uint8_t *record = out + l->nodes + (size_t)ND_SIZE * at;
        if (pb->kind == SPC_BLOCK_LEAF)
            store_leaf(p, family, link, i, record);
        else
            store_inner(p, b, family, link, i, record);
        if (family->parent == PACK_OWNER)
            copy_top(p, pb->kind, k, b, record);
        if (l->colors)
            memcpy(out + l->colors + 4 * (size_t)at, p->kind[pb->kind].rgba[i], 4);
        if (l->children)
            out[l->children + at / 2] |= (uint8_t)(p->inner[i].child_code << 4 * (at & 1));
    }
}

/* ---- a block ----------------------------------------------------------------------------------- */

static void store_all(struct pack *p, const struct pack_block *pb, const struct pack_weld *weld,
                      const int64_t base[3], const struct spc_block *b,
                      const struct spc_block_layout *l, uint8_t *payload)
{
    uint32_t *place = p->levels;
    memset(payload, 0, l->bytes);
    place_nodes(p, pb, place);
    for (uint32_t f = 0, at = 0; f < pb->family_count; at += pack_family_of(p, pb, f++)->count)
        store_family(p, pb, pack_family_of(p, pb, f), place + at, b, l, payload);
    store_groups(p, pb, payload + l->groups);
    if (l->indices == 0)
        return;
    store_indices(pb, place, weld->indices, payload + l->indices);
    store_vertices(p, weld, base, b->vertex_width, l, payload);
}

enum spc_status pack_payload(struct pack *p, uint32_t k, struct spc_error *err)
{
    const struct spb_pack_options *o = &p->shared->options;
    const struct pack_block *pb = &p->blocks[k];
    struct spc_block *b = &p->out->blocks[k];
    const bool triangles = pb->kind == SPC_BLOCK_LEAF && (o->flags & SPC_FLAG_TRIANGLES);
    struct spc_family *families = (struct spc_family *)p->scratch;
    struct pack_weld weld = {.count = 0};
    int64_t base[3] = {0, 0, 0};
    struct spc_block_layout l;
    enum spc_status status = SPC_OK;
    measure_block(p, pb, b);
    if (triangles)
        status = pack_weld(p, pb, &weld, err);
    if (status != SPC_OK)
        return status;
    if (triangles) {
        b->vertex_count = weld.count;
        b->vertex_width = vertex_range(p, &weld, base);
    }
    if (!spc_block_layout(b, o->flags, o->normal_clusters, &l))
        return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "a block is over the limits");
    uint8_t *payload = pack_scratch_buffer(p->memory, PACK_PAYLOAD, l.bytes);
    uint8_t *stored = pack_scratch_buffer(p->memory, PACK_STORED, spc_block_stored_bound(l.bytes));
    if (payload == NULL || stored == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to pack a block");
    store_all(p, pb, &weld, base, b, &l, payload);
    fill_families(p, pb, families);
    status = spc_block_encode(b, &l, &p->frame, families, pb->family_count, payload, p->memory->encoder,
                              stored, err);
    return status != SPC_OK ? status
                            : spb_tmpfile_append(spb_spool_file(p->shared->spool), stored,
                                                 b->stored_bytes, &p->out->stored_off[k], err);
}
