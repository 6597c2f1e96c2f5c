/*
 * split.c - keys into a tree, top down, in memory.
 *
 * Most of the time goes into small sets: no branch depends on where a key lies, only on counts.
 */
#include "split.h"

#include "tree.h"
#include "vectors.h"

#include <stdlib.h>
#include <string.h>

struct spb_job {                      /* keys [begin, end), more than one, become the node; or none: */
    uint32_t node, begin, end, level;           /* it is ready, all below it was given out */
};

/* A key as one vector. The number takes part in everything; nobody asks for its bounds. */
typedef double key_vector __attribute__((vector_size(sizeof(struct spb_key))));
typedef int64_t key_mask __attribute__((vector_size(sizeof(struct spb_key))));

SPB_INLINE void tight_box(const struct spb_key *keys, uint32_t n, double min[4], double max[4])
{
    key_vector key, lo, hi;
    memcpy(&lo, &keys[0], sizeof lo);
    hi = lo;
    for (uint32_t i = 1; i < n; i++) {
        memcpy(&key, &keys[i], sizeof key);
        const key_mask below = key < lo, above = key > hi;
        lo = (key_vector)(((key_mask)key & below) | ((key_mask)lo & ~below));
        hi = (key_vector)(((key_mask)key & above) | ((key_mask)hi & ~above));
    }
    memcpy(min, &lo, sizeof lo);
    memcpy(max, &hi, sizeof hi);
}

static int by_face(const void *a, const void *b)
{
    const double x = ((const struct spb_key *)a)->v[SPB_KEY_FACE];
    const double y = ((const struct spb_key *)b)->v[SPB_KEY_FACE];
    return (x > y) - (x < y);
}

/*
 * Number of keys of the left half, which come first. Order inside a half is of no importance,
 * except between equal keys: they are put into input order when they are all that is left.
 */
SPB_INLINE uint32_t halve(struct spb_key *keys, uint32_t n)
{
    double min[4], max[4];
    struct spb_split split;
    tight_box(keys, n, min, max);
    if (!spb_split_box(min, max, &split)) {
        qsort(keys, n, sizeof *keys, by_face);
        return (uint32_t)spb_split_middle(n);
    }
    uint32_t left = 0;
    for (uint32_t i = 0; i < n; i++) {      /* always a swap: of a key with itself, or to its half */
        const bool below = keys[i].v[split.axis] < split.plane;
        key_vector key, other;
        memcpy(&key, &keys[i], sizeof key);
        memcpy(&other, &keys[left], sizeof other);
        memcpy(&keys[i], &other, sizeof other);
        memcpy(&keys[left], &key, sizeof key);
        left += below;
    }
    return left;
}

SPB_INLINE bool key_below(const struct spb_key *x, const struct spb_key *y)
{
    bool below = x->v[SPB_KEY_FACE] < y->v[SPB_KEY_FACE];
    for (int a = 2; a >= 0; a--)
        below = (x->v[a] < y->v[a]) | ((x->v[a] == y->v[a]) & below);
    return below;
}

/* All of a half as leaves, by place and then by number: nodes [0, n). */
SPB_INLINE void make_leaves(const struct spb_key *keys, uint32_t n, struct spb_node *nodes)
{
    uint32_t rank[SPB_FAMILY_MAX] = {0};
    for (uint32_t i = 1; i < n; i++)
        for (uint32_t k = 0; k < i; k++) {
            const bool below = key_below(&keys[i], &keys[k]);
            rank[i] += !below;
            rank[k] += below;
        }
    for (uint32_t i = 0; i < n; i++) {
        nodes[rank[i]].child_count = 0;
        nodes[rank[i]].link = (uint32_t)keys[i].v[SPB_KEY_FACE];
    }
}

struct family {                     /* 2..4 children; child k has keys [border[k], border[k + 1]) */
    uint32_t border[SPB_CHILDREN_MAX + 1];
    uint32_t count;
    uint32_t leaf_first, leaf_end;  /* children that were made to leaves together */
};

SPB_INLINE void add_leaves(struct family *f, uint32_t end)
{
    f->leaf_first = f->count;
    while (f->border[f->count] < end) {
        f->border[f->count + 1] = f->border[f->count] + 1;
        f->count++;
    }
    f->leaf_end = f->count;
}

SPB_INLINE void add_child(struct family *f, uint32_t end)
{
    f->border[++f->count] = end;
}

/* Children of [begin, end), by the rule of split.h. */
SPB_INLINE void split_family(struct spb_key *keys, uint32_t begin, uint32_t end, struct family *f)
{
    *f = (struct family){.border = {begin}};
    if (end - begin <= SPB_FAMILY_MAX) {
        add_leaves(f, end);
        return;
    }
    uint32_t from[3] = {begin, 0, end};
    from[1] = begin + halve(keys + begin, end - begin);
    const uint32_t count[2] = {from[1] - begin, end - from[1]};
    const int small = count[0] <= count[1] ? 0 : 1;
    for (int h = 0; h < 2; h++) {
        if (h == small && count[h] < SPB_FAMILY_MAX && count[1 - h] <= SPB_FAMILY_MAX) {
            add_leaves(f, from[h + 1]);
            continue;
        }
        if (count[h] > SPB_FAMILY_MAX)
            add_child(f, from[h] + halve(keys + from[h], count[h]));
        add_child(f, from[h + 1]);
    }
}

static bool reserve(struct spb_tree *tree, uint32_t more)
{
    const uint32_t needed = tree->node_count + more;
    const uint32_t half_more = tree->node_max + tree->node_max / 2;
    const uint32_t grown = needed > half_more ? needed : half_more;
    if (needed <= tree->node_max)
        return true;
    struct spb_node *nodes = realloc(tree->nodes, (size_t)grown * sizeof *nodes);
    if (nodes == NULL)
        return false;
    tree->nodes = nodes;
    tree->node_max = grown;
    return true;
}

static enum spc_status no_memory(struct spc_error *err)
{
    return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for the nodes of a tree");
}

/* The stack holds at most four jobs a level; every plane takes at least a quarter off a side. */
enum { STACK_MAX = 4096 };
enum { BLOCK_MAX = 2048 };          /* faces whose nodes stay in a near cache */

/* Nodes of the family and jobs for those that are more than a face. Returns how many jobs. */
SPB_INLINE uint32_t make_family(const struct spb_key *keys, const struct family *f,
                                const struct spb_job *job, struct spb_tree *tree,
                                struct spb_job *jobs)
{
    uint32_t waiting = 0;
    struct spb_node *nodes = &tree->nodes[tree->node_count];
    tree->nodes[job->node].child_first = tree->node_count;
    tree->nodes[job->node].child_count = (uint8_t)f->count;
    for (uint32_t k = f->count; k-- > 0;) {
        if (k >= f->leaf_first && k < f->leaf_end)
            continue;
        if (f->border[k + 1] - f->border[k] == 1)
            make_leaves(keys + f->border[k], 1, nodes + k);
        else
            jobs[waiting++] = (struct spb_job){tree->node_count + k, f->border[k],
                                               f->border[k + 1], job->level + 1};
    }
    make_leaves(keys + f->border[f->leaf_first], f->leaf_end - f->leaf_first,
                nodes + f->leaf_first);
    tree->node_count += f->count;
    return waiting;
}

static uint32_t push_ready(struct spb_job *jobs, uint32_t node)
{
    jobs[0] = (struct spb_job){.node = node};
    return 1;
}

/* The leaves of a family whose first child is the node. */
static uint32_t push_leaves(const struct family *f, uint32_t node, struct spb_job *jobs)
{
    uint32_t count = 0;
    for (uint32_t k = 0; k < f->count; k++)
        if (f->border[k + 1] - f->border[k] == 1)
            count += push_ready(jobs + count, node + k);
    return count;
}

SPB_VECTORS enum spc_status spb_split_next(struct spb_splitter *s, uint32_t *begin, uint32_t *end,
                                           struct spc_error *err)
{
    struct spb_tree *tree = s->tree;
    uint32_t waiting = s->waiting, block = 0;       /* jobs below the block's */
    *begin = *end = tree->node_count;
    while (waiting > block) {
        const struct spb_job job = s->stack[--waiting];
        if (job.begin == job.end) {
            *begin = job.node;
            *end = job.node + 1;
            s->waiting = waiting;
            return SPC_OK;
        }
        if (waiting + 2 * SPB_CHILDREN_MAX > STACK_MAX)
            return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "the tree is deeper than it can be");
        if (block == 0)
            waiting += push_ready(s->stack + waiting, job.node);
        if (block == 0 && job.end - job.begin <= BLOCK_MAX) {
            block = waiting;
            *begin = tree->node_count;
        }
        struct family family;
        split_family(s->keys, job.begin, job.end, &family);
        if (job.level + 1 > tree->height)
            tree->height = job.level + 1;
        if (!reserve(tree, family.count))
            return no_memory(err);
        waiting += make_family(s->keys, &family, &job, tree, s->stack + waiting);
        if (block == 0)
            waiting += push_leaves(&family, tree->nodes[job.node].child_first,
                                   s->stack + waiting);
    }
    *end = tree->node_count;
    s->waiting = waiting;
    return SPC_OK;
}

enum spc_status spb_split_begin(struct spb_splitter *s, struct spb_key *keys, uint32_t count,
                                struct spb_tree *tree, struct spc_error *err)
{
    *s = (struct spb_splitter){.keys = keys, .tree = tree,
                               .stack = malloc(STACK_MAX * sizeof *s->stack)};
    tree->node_count = 0;
    tree->height = 1;
    if (s->stack == NULL || !reserve(tree, count + count / 2 + 64))     /* mostly enough for all */
        return no_memory(err);
    tree->node_count = 1;
    s->waiting = 1;
    s->stack[0] = (struct spb_job){0, 0, count, 1};
    if (count == 1) {
        make_leaves(keys, 1, tree->nodes);
        push_ready(s->stack, 0);
    }
    return SPC_OK;
}

void spb_split_end(struct spb_splitter *s)
{
    free(s->stack);
    s->stack = NULL;
}
