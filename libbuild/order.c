/*
 * order.c - the order of a cluster's nodes (spec section 7).
 *
 * Canonical order is depth first, families together: neighbours in space are neighbours in it. A
 * block takes the families of a range of e_parent, so that a viewer reads a prefix of the blocks;
 * inside a block they are sorted by the normal cluster of their parent. Families stay whole, so
 * the parent relation costs half a byte an inner node.
 */
#include "pack_int.h"

#include <stdlib.h>

struct emission {
    struct pack *p;
    uint32_t *stack;                /* inner nodes whose children come next */
    uint32_t depth;
};

static void emit_family(struct emission *e, enum spc_block_kind kind, uint32_t first, uint32_t n,
                        uint32_t group)
{
    struct pack *p = e->p;
    struct pack_sequence *s = &p->sequence[kind];
    const uint32_t start = s->node_count;
    for (uint32_t i = first; i < first + n; i++) {
        const struct pack_node *q = &p->nodes[i];
        const struct spb_node *node = &p->tree->nodes[q->node];
        if (q->leaf != (kind == SPC_BLOCK_LEAF))
            continue;
        s->nodes[s->node_count++] = i;
        if (node->owner)
            p->children[p->owner_count++] = node->link;
    }
    if (s->node_count > start)
        s->families[s->family_count++] = (struct pack_family){
            .first = start, .count = s->node_count - start, .group = group,
            .parent = p->nodes[first].parent, .e_parent = p->nodes[first].e_parent};
    for (uint32_t i = s->node_count; kind == SPC_BLOCK_INNER && i-- > start;)
        if (!p->tree->nodes[p->nodes[s->nodes[i]].node].owner)
            e->stack[e->depth++] = s->nodes[i];
}

static void emit_children(struct emission *e, uint32_t first, uint32_t n, uint16_t normal)
{
    const uint32_t group = e->p->shared->axis_of[normal];
    emit_family(e, SPC_BLOCK_INNER, first, n, group);
    emit_family(e, SPC_BLOCK_LEAF, first, n, group);
}

/* Tops have their owner elsewhere: they are grouped by the first of them, inner ones first. */
static uint32_t first_top(const struct pack *p, uint32_t top_count)
{
    for (uint32_t i = 0; i < top_count; i++)
        if (!p->nodes[i].leaf)
            return i;
    return 0;
}

static void emit_all(struct emission *e)
{
    struct pack *p = e->p;
    const uint32_t tops = p->owner ? p->owner->child_count : 1;
    emit_children(e, 0, tops, p->nodes[first_top(p, tops)].normal);
    while (e->depth > 0) {
        const struct pack_node *q = &p->nodes[e->stack[--e->depth]];
        emit_children(e, q->child_first, p->tree->nodes[q->node].child_count, q->normal);
    }
}

/* By e_parent, largest first, then canonical order: a counting sort over the codes. */
static void sort_families(const struct pack_sequence *s, uint32_t *start)
{
    memset(start, 0, 65537 * sizeof *start);
    for (uint32_t f = 0; f < s->family_count; f++)
        start[65536 - s->families[f].e_parent]++;
    for (uint32_t k = 1; k <= 65536; k++)
        start[k] += start[k - 1];
    for (uint32_t f = s->family_count; f-- > 0;)
        s->list[--start[65536 - s->families[f].e_parent]] = f;
}

static int by_number(const void *a, const void *b)
{
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return x < y ? -1 : x > y;
}

/* Whole families, as many as fit. A leaf block has at most three vertices a leaf: 16-bit numbers. */
static void slice(struct pack *p, enum spc_block_kind kind)
{
    struct pack_sequence *s = &p->sequence[kind];
    uint32_t limit = p->shared->options.block_nodes;
    if (kind == SPC_BLOCK_LEAF && limit > 65535 / 3)
        limit = 65535 / 3;
    struct pack_block *b = NULL;
    for (uint32_t f = 0; f < s->family_count; f++) {
        const uint32_t count = s->families[s->list[f]].count;
        if (b == NULL || b->count + count > limit) {
            b = &p->blocks[p->block_count++];
            *b = (struct pack_block){.kind = kind, .family_first = f};
        }
        b->family_count++;
        b->count += count;
    }
}

/* Largest e_parent of a block whose families still are in that order. */
static uint16_t key_of(const struct pack *p, const struct pack_block *b)
{
    return pack_family_of(p, b, 0)->e_parent;
}

/* Inner and leaf blocks, each in order, into one prefix order: inner first on equal keys. */
static void merge_blocks(struct pack *p, uint32_t inner_count, struct pack_block *scratch)
{
    uint32_t i = 0, l = inner_count;
    for (uint32_t k = 0; k < p->block_count; k++) {
        const bool inner = l == p->block_count ||
                           (i < inner_count && key_of(p, &p->blocks[i]) >= key_of(p, &p->blocks[l]));
        scratch[k] = p->blocks[inner ? i++ : l++];
    }
    memcpy(p->blocks, scratch, p->block_count * sizeof *scratch);
}

static void number_nodes(struct pack *p, uint32_t block)
{
    const struct pack_block *b = &p->blocks[block];
    const struct pack_sequence *s = &p->sequence[b->kind];
    uint16_t number = 0;
    qsort(s->list + b->family_first, b->family_count, sizeof *s->list, by_number);
    for (uint32_t f = 0; f < b->family_count; f++) {
        const struct pack_family *family = pack_family_of(p, b, f);
        for (uint32_t k = 0; k < family->count; k++) {
            struct pack_node *q = &p->nodes[s->nodes[family->first + k]];
            q->block = block;
            q->number = number++;
        }
    }
}

enum spc_status pack_order(struct pack *p, struct spc_error *err)
{
    const uint32_t n = p->node_count;
    struct emission e = {.p = p};
    enum spc_status status = SPC_OK;
    struct pack_block *merged = malloc(n * sizeof *merged);
    uint32_t *start = malloc(65537 * sizeof *start);
    e.stack = malloc(n * sizeof *e.stack);
    p->blocks = malloc(n * sizeof *p->blocks);
    p->children = malloc(n * sizeof *p->children);
    bool ok = merged && start && e.stack && p->blocks && p->children;
    for (int k = 0; k < 2; k++) {
        struct pack_sequence *s = &p->sequence[k];
        s->nodes = malloc(n * sizeof *s->nodes);
        s->families = malloc(n * sizeof *s->families);
        s->list = malloc(n * sizeof *s->list);
        ok = ok && s->nodes && s->families && s->list;
    }
    if (!ok) {
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to order a cluster");
        goto out;
    }
    emit_all(&e);
    sort_families(&p->sequence[SPC_BLOCK_INNER], start);
    slice(p, SPC_BLOCK_INNER);
    const uint32_t inner_blocks = p->block_count;
    sort_families(&p->sequence[SPC_BLOCK_LEAF], start);
    slice(p, SPC_BLOCK_LEAF);
    merge_blocks(p, inner_blocks, merged);
    for (uint32_t k = 0; k < p->block_count; k++)
        number_nodes(p, k);
out:
    free(e.stack);
    free(start);
    free(merged);
    return status;
}
