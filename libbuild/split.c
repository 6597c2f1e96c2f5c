/*
 * split.c - keys into a tree, top down, in memory.
 */
#include "split.h"

#include "tree.h"

#include <stdlib.h>

struct job {                        /* keys [begin, end) become the node */
    uint32_t node, begin, end, level;
};

static void tight_box(const struct spb_key *keys, uint32_t n, double min[3], double max[3])
{
    for (int a = 0; a < 3; a++)
        min[a] = max[a] = keys[0].v[a];
    for (uint32_t i = 1; i < n; i++)
        for (int a = 0; a < 3; a++) {
            min[a] = keys[i].v[a] < min[a] ? keys[i].v[a] : min[a];
            max[a] = keys[i].v[a] > max[a] ? keys[i].v[a] : max[a];
        }
}

static int by_face(const void *a, const void *b)
{
    const uint64_t x = ((const struct spb_key *)a)->face;
    const uint64_t y = ((const struct spb_key *)b)->face;
    return (x > y) - (x < y);
}

/*
 * Number of keys of the left half, which come first. Order inside a half is of no importance,
 * except between equal keys: they are put into input order when they are all that is left.
 */
static uint32_t halve(struct spb_key *keys, uint32_t n)
{
    double min[3], max[3];
    struct spb_split split;
    tight_box(keys, n, min, max);
    if (!spb_split_box(min, max, &split)) {
        qsort(keys, n, sizeof *keys, by_face);
        return (uint32_t)spb_split_middle(n);
    }
    uint32_t i = 0, j = n;
    for (;;) {
        while (i < j && keys[i].v[split.axis] < split.plane)
            i++;
        while (i < j && keys[j - 1].v[split.axis] >= split.plane)
            j--;
        if (i >= j)
            return i;
        const struct spb_key swap = keys[i];
        keys[i] = keys[j - 1];
        keys[j - 1] = swap;
    }
}

static int by_place(const void *a, const void *b)
{
    const struct spb_key *x = a, *y = b;
    for (int k = 0; k < 3; k++)
        if (x->v[k] != y->v[k])
            return x->v[k] < y->v[k] ? -1 : 1;
    return by_face(a, b);
}

/* All of a half as leaves, one border each. */
static uint32_t split_leaves(struct spb_key *keys, uint32_t begin, uint32_t end, uint32_t *border)
{
    qsort(keys + begin, end - begin, sizeof *keys, by_place);
    for (uint32_t k = begin; k < end; k++)
        *border++ = k + 1;
    return end - begin;
}

/* Borders of the 2..4 children of [begin, end), by the rule of split.h. Returns how many. */
static uint32_t split_family(struct spb_key *keys, uint32_t begin, uint32_t end, uint32_t *border)
{
    border[0] = begin;
    if (end - begin <= SPB_FAMILY_MAX)
        return split_leaves(keys, begin, end, border + 1);
    const uint32_t middle = begin + halve(keys + begin, end - begin);
    const uint32_t from[3] = {begin, middle, end};
    const uint32_t count[2] = {middle - begin, end - middle};
    const int small = count[0] <= count[1] ? 0 : 1;
    uint32_t n = 0;
    for (int h = 0; h < 2; h++) {
        if (h == small && count[h] < SPB_FAMILY_MAX && count[1 - h] <= SPB_FAMILY_MAX) {
            n += split_leaves(keys, from[h], from[h + 1], border + n + 1);
            continue;
        }
        if (count[h] > SPB_FAMILY_MAX)
            border[++n] = from[h] + halve(keys + from[h], count[h]);
        border[++n] = from[h + 1];
    }
    return n;
}

static bool reserve(struct spb_tree *tree, uint32_t *max, uint32_t more)
{
    if (tree->node_count + more <= *max)
        return true;
    const uint32_t grown = *max + *max / 2 + more + 64;
    struct spb_node *nodes = realloc(tree->nodes, (size_t)grown * sizeof *nodes);
    if (nodes == NULL)
        return false;
    tree->nodes = nodes;
    *max = grown;
    return true;
}

/* The stack holds at most three waiting siblings a level; every plane takes at least a quarter off a side. */
enum { STACK_MAX = 4096 };

enum spc_status spb_tree_split(struct spb_key *keys, uint32_t count, struct spb_tree *tree,
                               struct spc_error *err)
{
    struct job *stack = malloc(STACK_MAX * sizeof *stack);
    uint32_t waiting = 0;
    uint32_t max = count + count / 2 + 64;          /* 1.5 nodes a face on scans; more is rare */
    *tree = (struct spb_tree){.nodes = malloc((size_t)max * sizeof *tree->nodes)};
    if (stack == NULL || tree->nodes == NULL)
        goto no_memory;
    tree->node_count = 1;
    stack[waiting++] = (struct job){0, 0, count, 1};
    while (waiting > 0) {
        const struct job job = stack[--waiting];
        if (job.level > tree->height)
            tree->height = job.level;
        if (job.end - job.begin == 1) {
            tree->nodes[job.node] = (struct spb_node){.link = (uint32_t)keys[job.begin].face};
            continue;
        }
        uint32_t border[SPB_CHILDREN_MAX + 1];
        const uint32_t n = split_family(keys, job.begin, job.end, border);
        if (!reserve(tree, &max, n))
            goto no_memory;
        if (waiting + n > STACK_MAX) {
            spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "the tree is deeper than it can be");
            goto fail;
        }
        tree->nodes[job.node] =
            (struct spb_node){.child_first = tree->node_count, .child_count = (uint8_t)n};
        for (uint32_t k = n; k-- > 0;)
            stack[waiting++] =
                (struct job){tree->node_count + k, border[k], border[k + 1], job.level + 1};
        tree->node_count += n;
    }
    free(stack);
    return SPC_OK;
no_memory:
    spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a tree of %u faces", count);
fail:
    free(stack);
    free(tree->nodes);
    *tree = (struct spb_tree){0};
    return err ? err->status : SPC_NO_MEMORY;
}
