/*
 * relation.c - a cluster's nodes with their parents, from child counts alone (spec section 7).
 *
 * Canonical order is depth first: the children of a node, its inner ones, then its leaves; then
 * the same for each of the inner ones. A family lies in the block of its kind whose e_parent range
 * it belongs to, in the normal cluster of its parent's normal, behind those that came before it in
 * canonical order; so its place is known from the counts, and nothing else is stored.
 */
#include "format_int.h"

#include "bytes.h"

#include <stdlib.h>

struct kind {                       /* the inner or the leaf blocks of the cluster */
    uint32_t *blocks;               /* [count] numbers in the cluster, prefix order */
    uint32_t count;
    uint16_t *e_min;                /* [count] smallest e_parent */
    uint32_t *left;                 /* [count] places for families of that e_parent */
    uint32_t *from;                 /* [count] where the search for such a place goes on */
};

struct replay {
    const struct spc_reader *r;
    struct spc_cluster c;
    struct spc_block *blocks;       /* [block_count] */
    uint32_t *first_node;           /* [block_count] node number of its node 0 */
    uint8_t *child_codes;           /* [inner_count] */
    struct kind kinds[2];           /* inner, leaf */
    uint32_t *next;                 /* [2][block_count][normal_clusters]: next place; group start */
    uint32_t *stack;                /* [inner_count] nodes whose children come next */
    uint32_t depth, emitted, owners;
    int16_t axes[SPC_NORMAL_CLUSTERS_MAX][3];
    struct spc_tree *tree;
};

static enum spc_status broken(const struct replay *p, const char *what, struct spc_error *err)
{
    return spc_fail(err, SPC_CORRUPT, p->c.data_off, "parent relation: %s", what);
}

/*
 * The first block whose smallest e_parent is at most e and that has room: always when its smallest
 * is less than e, else as long as places for e are left. UINT32_MAX: there is none.
 */
static uint32_t find_block(struct kind *k, uint16_t e, uint32_t size)
{
    uint32_t low = 0, high = k->count;
    while (low < high) {
        const uint32_t mid = (low + high) / 2;
        if (k->e_min[mid] <= e)
            high = mid;
        else
            low = mid + 1;
    }
    if (low == k->count)
        return UINT32_MAX;
    if (k->e_min[low] < e)
        return k->blocks[low];
    uint32_t at = k->from[low];
    while (at < k->count && k->e_min[at] == e && k->left[at] < size)
        at++;
    k->from[low] = at;
    if (at == k->count)
        return UINT32_MAX;
    if (k->e_min[at] == e)
        k->left[at] -= size;
    return k->blocks[at];
}

/* Places a family of n nodes of one kind under parent, in normal cluster group. */
static enum spc_status place_family(struct replay *p, enum spc_block_kind kind, uint32_t n,
                                    uint32_t parent, uint16_t e, uint32_t group,
                                    struct spc_error *err)
{
    const uint32_t groups = p->r->header.normal_clusters;
    if (n == 0)
        return SPC_OK;
    const uint32_t block = find_block(&p->kinds[kind], e, n);
    if (block == UINT32_MAX)
        return broken(p, "a family fits no block", err);
    uint32_t *next = &p->next[(size_t)block * groups + group];
    const uint32_t limit = group + 1 < groups
        ? p->next[(size_t)(p->c.block_count + block) * groups + group + 1]
        : p->blocks[block].node_count;
    if (*next + n > limit)
        return broken(p, "a family does not fit its normal cluster", err);
    for (uint32_t k = 0; k < n; k++) {
        const uint32_t node = p->first_node[block] + *next + k;
        p->tree->parent[node] = parent;
        p->tree->order[p->emitted++] = node;
        if (kind == SPC_BLOCK_INNER)
            p->owners += p->child_codes[node] == 0;
    }
    if (kind == SPC_BLOCK_INNER)
        for (uint32_t k = n; k-- > 0;) {
            const uint32_t node = p->first_node[block] + *next + k;
            if (p->child_codes[node] != 0)
                p->stack[p->depth++] = node;
        }
    *next += n;
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
    const uint16_t e = load_u16(p->c.tops[0].record + ND_E_PARENT);
    enum spc_status status =
        place_family(p, SPC_BLOCK_INNER, top_inner, SPC_PARENT_OWNER, e, group, err);
    if (status == SPC_OK)
        status = place_family(p, SPC_BLOCK_LEAF, p->c.top_count - top_inner, SPC_PARENT_OWNER, e,
                              group, err);
    while (status == SPC_OK && p->depth > 0) {
        const uint32_t parent = p->stack[--p->depth];
        const struct spc_node *node = &t->nodes[parent];
        const uint32_t code = p->child_codes[parent];
        const uint32_t total = spc_children_of(code), inner = spc_inner_children_of(code);
        group = group_of(p, node->normal_code);
        status = place_family(p, SPC_BLOCK_INNER, inner, parent, node->e_self, group, err);
        if (status == SPC_OK)
            status = place_family(p, SPC_BLOCK_LEAF, total - inner, parent, node->e_self, group,
                                  err);
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
    struct kind *kind = &p->kinds[b->kind];
    uint16_t e_min = UINT16_MAX;
    uint32_t left = 0;
    for (uint32_t i = 0; i < b->node_count; i++) {
        const uint32_t node = p->first_node[k] + i;
        spc_node_decode(p->r, b, layout, payload, i, &p->tree->nodes[node]);
        p->tree->block_of[node] = p->c.block_first + k;
        p->tree->index_in_block[node] = i;
        if (b->kind == SPC_BLOCK_INNER)
            p->child_codes[node] = payload[layout->children + i / 2] >> 4 * (i & 1) & 15;
        const uint16_t e = p->tree->nodes[node].e_parent;
        left = e < e_min ? 1 : left + (e == e_min);
        e_min = e < e_min ? e : e_min;
    }
    kind->blocks[kind->count] = k;
    kind->e_min[kind->count] = e_min;
    kind->left[kind->count] = left;
    kind->from[kind->count] = kind->count;
    kind->count++;
    uint32_t start = 0;             /* the places, and a second copy that keeps the starts */
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

static bool kind_create(struct kind *k, uint32_t blocks)
{
    k->blocks = calloc(blocks, sizeof *k->blocks);
    k->e_min = calloc(blocks, sizeof *k->e_min);
    k->left = calloc(blocks, sizeof *k->left);
    k->from = calloc(blocks, sizeof *k->from);
    return k->blocks && k->e_min && k->left && k->from;
}

static void replay_release(struct replay *p)
{
    for (int k = 0; k < 2; k++) {
        free(p->kinds[k].blocks);
        free(p->kinds[k].e_min);
        free(p->kinds[k].left);
        free(p->kinds[k].from);
    }
    spc_tree_free(p->tree);
    free(p->stack);
    free(p->next);
    free(p->child_codes);
    free(p->first_node);
    free(p->blocks);
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
            p.axes[k][a] = (int16_t)load_u16(reader->head + reader->sections[SE_AXES].off +
                                             6 * k + 2 * a);
    p.blocks = calloc(p.c.block_count, sizeof *p.blocks);
    p.first_node = calloc(p.c.block_count, sizeof *p.first_node);
    p.child_codes = calloc((size_t)p.c.inner_count + 1, 1);
    p.next = calloc((size_t)2 * p.c.block_count * groups, sizeof *p.next);
    p.stack = calloc((size_t)p.c.inner_count + 1, sizeof *p.stack);
    p.tree = tree_create(&p.c);
    if (!p.blocks || !p.first_node || !p.child_codes || !p.next || !p.stack || !p.tree ||
        !kind_create(&p.kinds[0], p.c.block_count) || !kind_create(&p.kinds[1], p.c.block_count))
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for cluster %u", cluster);
    if (status == SPC_OK)
        status = load_blocks(&p, err);
    if (status == SPC_OK)
        status = run(&p, err);
    if (status == SPC_OK) {
        assign_children(&p);
        *out = p.tree;
        p.tree = NULL;
    }
    replay_release(&p);
    return status;
}
