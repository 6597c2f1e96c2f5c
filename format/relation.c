/*
 * relation.c - a cluster's nodes with their parents, from child counts alone (spec section 7).
 *
 * The canonical order: the tops first; then, again and again, the children of the emitted inner
 * node with the largest e_self, ties to the earliest emitted: its inner children, then its
 * leaves. e_self never grows downwards, so this is the e_parent order of the blocks. Inside a
 * block a family is stored in the normal cluster of its parent's normal, families in canonical
 * order; so each family's place is known from the counts, and nothing else is stored.
 */
#include "format_int.h"

#include "bytes.h"
#include "heap.h"

#include <stdlib.h>

/* Where the next family of each normal cluster of each block goes. */
struct cursor {
    uint32_t block, used;           /* block being filled, nodes placed in it */
    uint32_t *next;                 /* [block_count][normal_clusters] index in block */
};

struct replay {
    const struct spc_reader *r;
    struct spc_cluster c;
    struct spc_block *blocks;       /* [block_count] */
    uint32_t *first_node;           /* [block_count] node number of its node 0 */
    uint8_t *child_codes;           /* [inner_count] */
    struct cursor cursor[2];        /* inner, leaf */
    uint32_t *next;
    struct heap heap;
    uint32_t emitted, owners;
    int16_t axes[SPC_NORMAL_CLUSTERS_MAX][3];
    struct spc_tree *tree;
};

static uint32_t next_block_of(const struct replay *p, enum spc_block_kind kind, uint32_t from)
{
    while (from < p->c.block_count && p->blocks[from].kind != kind)
        from++;
    return from;
}

static enum spc_status broken(const struct replay *p, const char *what, struct spc_error *err)
{
    return spc_fail(err, SPC_CORRUPT, p->c.data_off, "parent relation: %s", what);
}

/* Places a family of n nodes of one kind under parent, in normal cluster group. */
static enum spc_status place_family(struct replay *p, enum spc_block_kind kind, uint32_t n,
                                    uint32_t parent, uint32_t group, struct spc_error *err)
{
    struct cursor *cur = &p->cursor[kind];
    const uint32_t groups = p->r->header.normal_clusters;
    if (n == 0)
        return SPC_OK;
    if (cur->block < p->c.block_count && cur->used == p->blocks[cur->block].node_count) {
        cur->block = next_block_of(p, kind, cur->block + 1);
        cur->used = 0;
    }
    if (cur->block >= p->c.block_count || cur->used + n > p->blocks[cur->block].node_count)
        return broken(p, "a family does not fit its block", err);
    uint32_t *next = &p->next[(size_t)cur->block * groups + group];
    const uint32_t limit = group + 1 < groups
        ? p->next[(size_t)(p->c.block_count + cur->block) * groups + group + 1]
        : p->blocks[cur->block].node_count;
    if (*next + n > limit)
        return broken(p, "a family does not fit its normal cluster", err);
    for (uint32_t k = 0; k < n; k++) {
        const uint32_t node = p->first_node[cur->block] + *next + k;
        p->tree->parent[node] = parent;
        p->tree->order[p->emitted] = node;
        if (kind == SPC_BLOCK_INNER) {
            if (p->child_codes[node] != 0)
                heap_push(&p->heap, heap_key(p->tree->nodes[node].e_self, p->emitted));
            else
                p->owners++;
        }
        p->emitted++;
    }
    *next += n;
    cur->used += n;
    return SPC_OK;
}

static uint32_t group_of(const struct replay *p, uint16_t normal_code)
{
    return spc_axis_nearest(p->axes, p->r->header.normal_clusters, normal_code);
}

static enum spc_status run(struct replay *p, struct spc_error *err)
{
    struct spc_tree *t = p->tree;
    uint32_t top_inner = 0;
    for (uint32_t k = 0; k < p->c.top_count; k++)
        top_inner += !p->c.tops_are_leaf[k];
    uint32_t group = group_of(p, load_u16(p->c.tops[0].record + ND_NORMAL));
    enum spc_status status =
        place_family(p, SPC_BLOCK_INNER, top_inner, SPC_PARENT_OWNER, group, err);
    if (status == SPC_OK)
        status = place_family(p, SPC_BLOCK_LEAF, p->c.top_count - top_inner, SPC_PARENT_OWNER,
                              group, err);
    while (status == SPC_OK && p->heap.count > 0) {
        const uint32_t parent = t->order[heap_key_emitted(heap_pop(&p->heap))];
        const uint32_t code = p->child_codes[parent];
        const uint32_t total = code < 4 ? 2 : code < 8 ? 3 : 4;
        const uint32_t inner = code - (total == 2 ? 1 : total == 3 ? 4 : 8);
        group = group_of(p, t->nodes[parent].normal_code);
        status = place_family(p, SPC_BLOCK_INNER, inner, parent, group, err);
        if (status == SPC_OK)
            status = place_family(p, SPC_BLOCK_LEAF, total - inner, parent, group, err);
    }
    if (status == SPC_OK && p->emitted != t->node_count)
        status = broken(p, "nodes are left without a parent", err);
    if (status == SPC_OK && p->owners != p->c.child_count)
        status = broken(p, "child clusters and their owners differ in number", err);
    return status;
}

/* Child clusters belong to the owners in canonical order. */
static void assign_children(struct replay *p)
{
    struct spc_tree *t = p->tree;
    uint32_t id = p->c.child_first;
    for (uint32_t i = 0; i < t->node_count; i++) {
        const uint32_t node = t->order[i];
        if (node < t->inner_count)
            t->child_cluster[node] = p->child_codes[node] == 0 ? id++ : SPC_NO_CHILD_CLUSTER;
    }
}

static void load_block(struct replay *p, uint32_t k, const struct spc_block_layout *layout,
                       const uint8_t *payload)
{
    const struct spc_block *b = &p->blocks[k];
    const uint32_t groups = p->r->header.normal_clusters;
    for (uint32_t i = 0; i < b->node_count; i++) {
        const uint32_t node = p->first_node[k] + i;
        spc_node_decode(p->r, b, layout, payload, i, &p->tree->nodes[node]);
        p->tree->block_of[node] = p->c.block_first + k;
        p->tree->index_in_block[node] = i;
        if (b->kind == SPC_BLOCK_INNER)
            p->child_codes[node] = payload[layout->children + i / 2] >> 4 * (i & 1) & 15;
    }
    uint32_t start = 0;             /* the cursors, and a second copy that keeps the starts */
    for (uint32_t g = 0; g < groups; g++) {
        p->next[(size_t)k * groups + g] = start;
        p->next[(size_t)(p->c.block_count + k) * groups + g] = start;
        start += load_u16(payload + layout->groups + 4 * g);
    }
}

static enum spc_status load_blocks(struct replay *p, struct spc_error *err)
{
    uint32_t next[2] = {0, p->c.inner_count};
    enum spc_status status = SPC_OK;
    for (uint32_t k = 0; k < p->c.block_count && status == SPC_OK; k++) {
        struct spc_block *b = &p->blocks[k];
        struct spc_block_layout layout;
        spc_reader_block(p->r, p->c.block_first + k, b);
        p->first_node[k] = next[b->kind];
        next[b->kind] += b->node_count;
        if (!spc_block_layout(b, p->r->header.flags, p->r->header.normal_clusters, &layout))
            return spc_fail(err, SPC_LIMIT, b->off, "block over the limits");
        uint8_t *payload = malloc(layout.bytes);
        if (payload == NULL)
            return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a block");
        status = spc_block_decode(p->r, p->c.block_first + k, true, payload, err);
        if (status == SPC_OK)
            load_block(p, k, &layout, payload);
        free(payload);
    }
    return status;
}

static struct spc_tree *tree_create(const struct spc_cluster *c)
{
    struct spc_tree *t = calloc(1, sizeof *t);
    if (t == NULL)
        return NULL;
    t->inner_count = c->inner_count;
    t->node_count = c->inner_count + c->leaf_count;
    t->nodes = calloc(t->node_count, sizeof *t->nodes);
    t->parent = calloc(t->node_count, sizeof *t->parent);
    t->child_cluster = calloc((size_t)t->inner_count + 1, sizeof *t->child_cluster);
    t->order = calloc(t->node_count, sizeof *t->order);
    t->block_of = calloc(t->node_count, sizeof *t->block_of);
    t->index_in_block = calloc(t->node_count, sizeof *t->index_in_block);
    if (t->nodes && t->parent && t->child_cluster && t->order && t->block_of && t->index_in_block)
        return t;
    spc_tree_free(t);
    return NULL;
}

void spc_tree_free(struct spc_tree *t)
{
    if (t == NULL)
        return;
    free(t->nodes);
    free(t->parent);
    free(t->child_cluster);
    free(t->order);
    free(t->block_of);
    free(t->index_in_block);
    free(t);
}

enum spc_status spc_tree_load(const struct spc_reader *reader, uint32_t cluster,
                              struct spc_tree **out, struct spc_error *err)
{
    struct replay p = {.r = reader};
    enum spc_status status = SPC_OK;
    const uint32_t groups = reader->header.normal_clusters;
    *out = NULL;
    spc_reader_cluster(reader, cluster, &p.c);
    for (uint32_t k = 0; k < groups; k++)
        for (uint32_t a = 0; a < 3; a++)
            p.axes[k][a] = (int16_t)load_u16(reader->bytes + reader->sections[SE_AXES].off +
                                             6 * k + 2 * a);
    p.blocks = calloc(p.c.block_count, sizeof *p.blocks);
    p.first_node = calloc(p.c.block_count, sizeof *p.first_node);
    p.child_codes = calloc((size_t)p.c.inner_count + 1, 1);
    p.next = calloc((size_t)2 * p.c.block_count * groups, sizeof *p.next);
    p.heap.keys = calloc((size_t)p.c.inner_count + 1, sizeof *p.heap.keys);
    p.tree = tree_create(&p.c);
    if (!p.blocks || !p.first_node || !p.child_codes || !p.next || !p.heap.keys || !p.tree)
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for cluster %u", cluster);
    if (status == SPC_OK)
        status = load_blocks(&p, err);
    if (status == SPC_OK) {
        p.cursor[SPC_BLOCK_INNER].block = next_block_of(&p, SPC_BLOCK_INNER, 0);
        p.cursor[SPC_BLOCK_LEAF].block = next_block_of(&p, SPC_BLOCK_LEAF, 0);
        status = run(&p, err);
    }
    if (status == SPC_OK) {
        assign_children(&p);
        *out = p.tree;
        p.tree = NULL;
    }
    spc_tree_free(p.tree);
    free(p.heap.keys);
    free(p.next);
    free(p.child_codes);
    free(p.first_node);
    free(p.blocks);
    return status;
}
