/*
 * collect.c - the nodes of a cluster in canonical order.
 *
 * Depth first, families together: that is how the tree lies in memory, and neighbours in space are
 * neighbours in it. All that later stages need of the tree's nodes but the pills is copied here.
 */
#include "pack_int.h"

#include "vec.h"

struct walk {
    struct pack *p;
    uint32_t *stack;                /* inner nodes whose children come next */
    uint32_t depth;
    uint32_t *level;                /* [inner nodes] below the owner */
    uint32_t *met_level;            /* [met] of all nodes, in child order, with their normals */
    uint16_t *met_normal;
    uint32_t met;
};

/* Where centres may lie: an inner node's does not move far, a leaf's lies in its triangle's box. */
static void reach_out(struct pack *p, const struct spb_node *n)
{
    const bool leaf = n->child_count == 0;
    for (int a = 0; a < 3; a++) {
        p->min[a] = smaller_of(p->min[a], leaf ? (double)n->box[a] : n->center[a]);
        p->max[a] = larger_of(p->max[a], leaf ? (double)n->box[a + 3] : n->center[a]);
    }
}

static void add_inner(struct walk *w, uint32_t node, uint32_t parent, uint32_t level)
{
    struct pack *p = w->p;
    const struct spb_node *n = &p->tree->nodes[node];
    const uint32_t i = p->kind[SPC_BLOCK_INNER].count;
    p->inner[i] = (struct pack_inner){.node = node, .parent = parent,
                                      .children = {PACK_NONE, PACK_NONE},
                                      .step_exp = spb_center_step(n->radius)};
    if (p->inner[i].step_exp > p->coarsest_wanted)
        p->coarsest_wanted = p->inner[i].step_exp;
    w->level[i] = level;
    if (n->owner)
        p->children[p->owner_count++] = n->link;
}

static void add_node(struct walk *w, uint32_t node, uint32_t parent, uint32_t level)
{
    struct pack *p = w->p;
    const struct spb_node *n = &p->tree->nodes[node];
    struct pack_kind *s = &p->kind[n->child_count == 0 ? SPC_BLOCK_LEAF : SPC_BLOCK_INNER];
    if (n->child_count == 0)
        p->leaves.record[s->count] = n->link;
    else
        add_inner(w, node, parent, level);
    s->normal[s->count] = n->normal;
    s->cone[s->count] = n->cone;
    memcpy(s->rgba[s->count], n->rgba, 4);
    s->count++;
    w->met_level[w->met] = level;
    w->met_normal[w->met++] = n->normal;
    reach_out(p, n);
}

static void end_family(struct pack *p, enum spc_block_kind kind, uint32_t first, uint32_t parent,
                       uint32_t group)
{
    struct pack_kind *s = &p->kind[kind];
    if (s->count == first)
        return;
    if (parent != PACK_OWNER)
        p->inner[parent].children[kind] = s->family_count;
    s->families[s->family_count++] = (struct pack_family){
        .first = first, .count = s->count - first, .group = group, .parent = parent};
}

/* Nodes [first, first + n) of the tree: an inner family and a leaf family. */
static void add_children(struct walk *w, uint32_t first, uint32_t n, uint32_t parent, uint32_t level,
                         uint32_t group)
{
    struct pack *p = w->p;
    const uint32_t inner = p->kind[SPC_BLOCK_INNER].count, leaf = p->kind[SPC_BLOCK_LEAF].count;
    for (uint32_t k = 0; k < n; k++)
        add_node(w, first + k, parent, level);
    end_family(p, SPC_BLOCK_INNER, inner, parent, group);
    end_family(p, SPC_BLOCK_LEAF, leaf, parent, group);
    const uint32_t inner_end = p->kind[SPC_BLOCK_INNER].count;
    if (parent != PACK_OWNER)
        p->inner[parent].child_code =
            (uint8_t)((n == 2 ? 1 : n == 3 ? 4 : 8) + inner_end - inner);
    for (uint32_t i = inner_end; i-- > inner;)
        if (!p->tree->nodes[p->inner[i].node].owner)
            w->stack[w->depth++] = i;
}

/* Normals level by level from the tops: the order in which they are added up. */
static void sum_normals(struct walk *w)
{
    struct pack *p = w->p;
    uint16_t *sorted = p->normals + p->node_max;
    uint32_t levels = 0, at = 0;
    for (uint32_t i = 0; i < w->met; i++)
        levels = w->met_level[i] + 1 > levels ? w->met_level[i] + 1 : levels;
    uint32_t *start = w->level;     /* no longer needed */
    memset(start, 0, levels * sizeof *start);
    for (uint32_t i = 0; i < w->met; i++)
        start[w->met_level[i]]++;
    for (uint32_t k = 0; k < levels; k++) {
        const uint32_t count = start[k];
        start[k] = at;
        at += count;
    }
    for (uint32_t i = 0; i < w->met; i++)
        sorted[start[w->met_level[i]]++] = w->met_normal[i];
    pack_normals_sum(sorted, w->met, p->normal_sum);
}

/* Tops have their owner elsewhere: they are grouped by the first inner one of them, if there is one. */
static uint32_t group_of_tops(const struct pack *p, uint32_t first, uint32_t n)
{
    for (uint32_t k = 0; k < n; k++)
        if (p->tree->nodes[first + k].child_count != 0)
            return p->shared->axis_of[p->tree->nodes[first + k].normal];
    return 0;                       /* quantise.c: the first leaf's normal is not known yet */
}

void pack_collect(struct pack *p)
{
    struct walk w = {.p = p, .stack = p->scratch, .level = p->scratch + p->node_max,
                     .met_level = p->levels, .met_normal = p->normals};
    const uint32_t first = p->owner ? p->owner->child_first : 0;
    const uint32_t tops = p->owner ? p->owner->child_count : 1;
    for (int a = 0; a < 3; a++) {
        p->min[a] = HUGE_VAL;
        p->max[a] = -HUGE_VAL;
    }
    p->coarsest_wanted = -1000;
    add_children(&w, first, tops, PACK_OWNER, 0, group_of_tops(p, first, tops));
    while (w.depth > 0) {
        const uint32_t i = w.stack[--w.depth];
        const struct spb_node *n = &p->tree->nodes[p->inner[i].node];
        add_children(&w, n->child_first, n->child_count, i, w.level[i] + 1,
                     p->shared->axis_of[n->normal]);
    }
    sum_normals(&w);
}
