#include "oracle_tree.h"

#include <check.h>
#include <math.h>
#include <stdlib.h>

static void *get(size_t n, size_t size)
{
    void *p = calloc(n + 1, size);
    ck_assert_ptr_nonnull(p);
    return p;
}

/* ck_assert reports each success through a pipe: too slow for what is said of every node. */
static void must(bool ok, const char *what, uint32_t where)
{
    if (!ok)
        ck_abort_msg("%s: %u", what, where);
}

/* ---- loading --------------------------------------------------------------------------------- */

static void fill_node(struct oracle_node *out, const struct spc_node *n)
{
    for (int a = 0; a < 3; a++) {
        out->center[a] = n->center[a];
        out->normal[a] = n->normal[a];
    }
    out->radius = n->radius;
    out->height = n->height;
    out->link = n->link;
    out->code_self = n->e_self;
    out->code_parent = n->e_parent;
    out->e_self = (double)spc_len_decode(n->e_self);
    out->e_parent = (double)spc_len_decode(n->e_parent);
}

/* Appends a cluster. owner[cluster]: the node whose children its tops are, SPC_NONE where not met. */
static void load_cluster(struct oracle_tree *t, uint32_t id, uint32_t *owner)
{
    struct spc_tree *s;
    struct spc_error err = {0};
    if (spc_tree_load(t->reader, id, &s, &err) != SPC_OK)
        ck_abort_msg("cluster %u: %s", id, err.what);
    uint32_t *at = get(s->node_count, sizeof *at);
    uint32_t tops = 0;
    ck_assert_uint_le(t->node_count + s->node_count, t->header->node_count);
    for (uint32_t k = 0; k < s->node_count; k++) {
        const uint32_t i = s->order[k], me = t->node_count + k;
        struct oracle_node *n = &t->nodes[me];
        at[i] = me;
        fill_node(n, &s->nodes[i]);
        n->leaf = i >= s->inner_count;
        n->cluster = id;
        n->block = s->block_of[i];
        n->index_in_block = s->index_in_block[i];
        n->parent = s->parent[i] == SPC_PARENT_OWNER ? owner[id] : at[s->parent[i]];
        tops += s->parent[i] == SPC_PARENT_OWNER;
        must(id == 0 && k == 0 ? n->parent == SPC_NONE : n->parent < me, "no parent before node", me);
        if (n->leaf)
            n->triangle = t->leaf_count++;
        if (n->leaf || s->child_cluster[i] == SPC_NO_CHILD_CLUSTER)
            continue;
        must(s->child_cluster[i] < t->header->cluster_count && owner[s->child_cluster[i]] == SPC_NONE &&
                 t->clusters[s->child_cluster[i]].parent == id, "not the owner of a cluster", me);
        owner[s->child_cluster[i]] = me;
    }
    ck_assert_uint_eq(tops, t->clusters[id].top_count);
    t->node_count += s->node_count;
    free(at);
    spc_tree_free(s);
}

static void link_children(struct oracle_tree *t)
{
    for (uint32_t i = 1; i < t->node_count; i++)
        t->nodes[t->nodes[i].parent].child_count++;
    uint32_t next = 0;
    for (uint32_t i = 0; i < t->node_count; i++) {
        struct oracle_node *n = &t->nodes[i];
        must(n->leaf ? n->child_count == 0 : n->child_count >= 2 && n->child_count <= 4,
             "too many or too few children of node", i);
        n->child_first = next;
        next += n->child_count;
        n->child_count = 0;
    }
    for (uint32_t i = 1; i < t->node_count; i++) {
        struct oracle_node *p = &t->nodes[t->nodes[i].parent];
        t->child[p->child_first + p->child_count++] = i;
    }
}

/* The record must say what the decoded node says: both sides of the judgement see one place. */
static void take_record(const struct oracle_tree *t, struct oracle_node *n, const uint8_t *record)
{
    const struct spc_block *b = &t->blocks[n->block];
    memcpy(n->record, record, SPC_NODE_BYTES);
    bool same = n->radius == (double)spc_len_decode(load_u16(record + ND_RADIUS)) &&
                n->code_self == load_u16(record + ND_E_SELF) &&
                n->code_parent == load_u16(record + ND_E_PARENT) && (b->kind == SPC_BLOCK_LEAF) == n->leaf;
    for (int a = 0; a < 3; a++)
        same = same && n->center[a] == t->clusters[b->cluster].origin[a] +
                                           ldexp(load_u16(record + ND_X + 2 * a), b->step_exp);
    must(same, "a record does not say what its node says: block", n->block);
}

static void load_block(struct oracle_tree *t, uint32_t block)
{
    const struct spc_block *b = &t->blocks[block];
    struct spc_block_layout l;
    ck_assert(spc_block_layout(b, t->header->flags, t->header->normal_clusters, &l));
    uint8_t *payload = get(l.bytes, 1);
    ck_assert_int_eq(spc_block_decode(t->reader, block, true, payload, NULL), SPC_OK);
    uint32_t axis = 0, axis_end = load_u16(payload + l.groups);
    for (uint32_t i = 0; i < b->node_count; i++) {
        struct oracle_node *n = &t->nodes[t->stored[t->stored_first[block] + i]];
        must(n->block == block && n->index_in_block == i, "wrong places in block", block);
        take_record(t, n, payload + l.nodes + SPC_NODE_BYTES * i);
        while (i >= axis_end)
            axis_end += load_u16(payload + l.groups + 4 * ++axis);
        n->axis = axis;
        n->cosine = (int16_t)load_u16(payload + l.groups + 4 * axis + 2) / 32767.0;
        if (n->leaf && (t->header->flags & SPC_FLAG_TRIANGLES))
            for (uint32_t c = 0; c < 3; c++)
                spc_vertex_decode(t->reader, b, &l, payload,
                                  load_u16(payload + l.indices + 6 * i + 2 * c),
                                  t->corner[n->triangle][c], NULL);
    }
    free(payload);
}

static void load_blocks(struct oracle_tree *t)
{
    const uint32_t count = t->header->block_count;
    for (uint32_t k = 0; k < count; k++)
        t->stored_first[k + 1] = t->stored_first[k] + t->blocks[k].node_count;
    ck_assert_uint_eq(t->stored_first[count], t->node_count);
    memset(t->stored, 0xFF, t->node_count * sizeof *t->stored);
    for (uint32_t i = 0; i < t->node_count; i++) {
        uint32_t *place = &t->stored[t->stored_first[t->nodes[i].block] + t->nodes[i].index_in_block];
        must(*place == SPC_NONE, "its place is taken: node", i);
        *place = i;
    }
    for (uint32_t k = 0; k < count; k++)
        load_block(t, k);
}

void oracle_load(struct oracle_tree *t, const struct spc_reader *reader)
{
    const struct spc_header *h = spc_reader_header(reader);
    *t = (struct oracle_tree){.reader = reader, .header = h};
    t->clusters = get(h->cluster_count, sizeof *t->clusters);
    t->blocks = get(h->block_count, sizeof *t->blocks);
    t->nodes = get(h->node_count, sizeof *t->nodes);
    t->child = get(h->node_count, sizeof *t->child);
    t->stored = get(h->node_count, sizeof *t->stored);
    t->stored_first = get(h->block_count + 1, sizeof *t->stored_first);
    t->corner = get(h->leaf_count, sizeof *t->corner);
    for (uint32_t c = 0; c < h->cluster_count; c++)
        spc_reader_cluster(reader, c, &t->clusters[c]);
    for (uint32_t k = 0; k < h->block_count; k++)
        spc_reader_block(reader, k, &t->blocks[k]);
    uint32_t *owner = get(h->cluster_count, sizeof *owner);
    memset(owner, 0xFF, h->cluster_count * sizeof *owner);
    for (uint32_t c = 0; c < h->cluster_count; c++)
        load_cluster(t, c, owner);
    free(owner);
    ck_assert_uint_eq(t->node_count, h->node_count);
    ck_assert_uint_eq(t->leaf_count, h->leaf_count);
    link_children(t);
    load_blocks(t);
    double d2 = 0;
    for (int a = 0; a < 3; a++)
        d2 += (h->box_max[a] - h->box_min[a]) * (h->box_max[a] - h->box_min[a]);
    t->size = sqrt(d2);
}

void oracle_free(struct oracle_tree *t)
{
    free(t->clusters);
    free(t->blocks);
    free(t->nodes);
    free(t->child);
    free(t->stored);
    free(t->stored_first);
    free(t->corner);
    *t = (struct oracle_tree){0};
}

/* ---- drawing --------------------------------------------------------------------------------- */

bool oracle_hybrid(const struct oracle_tree *t, const struct spv_view *view)
{
    return view->mode == SPV_HYBRID && (t->header->flags & SPC_FLAG_TRIANGLES);
}

void oracle_from_eye(const struct oracle_tree *t, const struct spv_view *view, const double p[3],
                     double out[3])
{
    for (int a = 0; a < 3; a++)
        out[a] = ldexp(p[a] - view->camera.eye[a], -t->header->unit_exp);
}

double oracle_q(const struct oracle_tree *t, const struct oracle_node *n, const struct spv_view *view)
{
    double d[3];
    oracle_from_eye(t, view, n->center, d);
    return view->eps * (sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) - n->radius);
}

bool oracle_upper(const struct oracle_node *n, double q, double eps)
{
    return n->parent == SPC_NONE || q * (1 - 0x1p-20) <= n->e_parent + eps * n->link;
}

struct spv_interval oracle_interval(const struct oracle_tree *t, uint32_t block,
                                    const struct spv_view *view)
{
    const struct spc_block *b = &t->blocks[block];
    double origin[3];
    oracle_from_eye(t, view, t->clusters[b->cluster].origin, origin);
    return (struct spv_interval){
        .origin = {(float)origin[0], (float)origin[1], (float)origin[2]},
        .step = (float)ldexp(1, b->step_exp - t->header->unit_exp),
        .eps = (float)view->eps,
        .link_base = b->link_base,
        .lower = b->kind == SPC_BLOCK_INNER || oracle_hybrid(t, view),
        .missing = -1,
    };
}

void oracle_draw_double(const struct oracle_tree *t, const struct spv_view *view, uint8_t *drawn)
{
    const bool hybrid = oracle_hybrid(t, view);
    for (uint32_t i = 0; i < t->node_count; i++) {
        const struct oracle_node *n = &t->nodes[i];
        const double q = oracle_q(t, n, view);
        const bool lower = n->e_self < q || (n->leaf && !hybrid);
        drawn[i] = lower && oracle_upper(n, q, view->eps) ? ORACLE_POINT : 0;
        if (n->leaf && hybrid && q <= n->e_self)
            drawn[i] |= ORACLE_TRIANGLE;
    }
}

void oracle_draw_float(const struct oracle_tree *t, const struct spv_view *view, uint8_t *drawn)
{
    const bool hybrid = oracle_hybrid(t, view);
    for (uint32_t k = 0; k < t->header->block_count; k++) {
        const struct spv_interval in = oracle_interval(t, k, view);
        for (uint32_t s = t->stored_first[k]; s < t->stored_first[k + 1]; s++) {
            const uint32_t i = t->stored[s];
            const struct oracle_node *n = &t->nodes[i];
            drawn[i] = spv_interval_point(&in, n->record) ? ORACLE_POINT : 0;
            if (n->leaf && hybrid && spv_interval_triangle(&in, n->record))
                drawn[i] |= ORACLE_TRIANGLE;
        }
    }
}

static void recurse(const struct oracle_tree *t, const struct spv_view *view, uint32_t i,
                    uint8_t *drawn)
{
    const struct oracle_node *n = &t->nodes[i];
    if (n->e_self < oracle_q(t, n, view) || (n->leaf && !oracle_hybrid(t, view)))
        drawn[i] = ORACLE_POINT;
    else if (n->leaf)
        drawn[i] = ORACLE_TRIANGLE;
    else
        for (uint32_t c = 0; c < n->child_count; c++)
            recurse(t, view, t->child[n->child_first + c], drawn);
}

void oracle_draw_recursion(const struct oracle_tree *t, const struct spv_view *view, uint8_t *drawn)
{
    memset(drawn, 0, t->node_count);
    recurse(t, view, 0, drawn);
}

uint32_t oracle_paths(const struct oracle_tree *t, const uint8_t *drawn, uint32_t *bare)
{
    uint32_t *times = get(t->node_count, sizeof *times);
    uint32_t twice = 0;
    *bare = SPC_NONE;
    for (uint32_t i = 0; i < t->node_count; i++) {
        const struct oracle_node *n = &t->nodes[i];
        times[i] = (n->parent == SPC_NONE ? 0 : times[n->parent]) +
                   ((drawn[i] & ORACLE_POINT) != 0) + ((drawn[i] & ORACLE_TRIANGLE) != 0);
        if (n->leaf && times[i] == 0 && *bare == SPC_NONE)
            *bare = i;
        twice += n->leaf && times[i] > 1;
    }
    free(times);
    return twice;
}
