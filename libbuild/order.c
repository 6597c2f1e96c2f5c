/*
 * order.c - the order of a cluster's nodes (spec section 7).
 *
 * Canonical order is e_parent order, families together; slices of it are blocks; inside a block
 * families are sorted by the normal cluster of their parent. Families stay whole, so the parent relation
 * costs half a byte an inner node.
 */
#include "pack_int.h"

#include "heap.h"

#include <stdlib.h>
#include <string.h>

struct emission {
    struct pack *p;
    uint32_t *emitted;              /* [node_count] by order of emission */
    uint32_t count;
    struct heap heap;
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
        if (kind == SPC_BLOCK_INNER && !node->owner)
            heap_push(&e->heap, heap_key(q->e_self, e->count));
        if (node->owner)
            p->children[p->owner_count++] = node->link;
        e->emitted[e->count++] = i;
    }
    if (s->node_count > start)
        s->families[s->family_count++] =
            (struct pack_family){start, s->node_count - start, group};
}

static void emit_children(struct emission *e, uint32_t first, uint32_t n, uint16_t normal)
{
    const uint32_t group = e->p->shared->axis_of[normal];
    emit_family(e, SPC_BLOCK_INNER, first, n, group);
    emit_family(e, SPC_BLOCK_LEAF, first, n, group);
}

static uint16_t normal_of(const struct pack *p, uint32_t i)
{
    return p->tree->nodes[p->nodes[i].node].normal;
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
    emit_children(e, 0, tops, normal_of(p, first_top(p, tops)));
    while (e->heap.count > 0) {
        const uint32_t i = e->emitted[heap_key_emitted(heap_pop(&e->heap))];
        const struct pack_node *q = &p->nodes[i];
        emit_children(e, q->child_first, p->tree->nodes[q->node].child_count, normal_of(p, i));
    }
}

/* Whole families, as many as fit. A leaf block has at most three vertices a leaf: 16-bit numbers. */
static void slice(struct pack *p, enum spc_block_kind kind)
{
    const struct pack_sequence *s = &p->sequence[kind];
    uint32_t limit = p->shared->options.block_nodes;
    if (kind == SPC_BLOCK_LEAF && limit > 65535 / 3)
        limit = 65535 / 3;
    struct pack_block *b = NULL;
    for (uint32_t f = 0; f < s->family_count; f++) {
        if (b == NULL || b->count + s->families[f].count > limit) {
            b = &p->blocks[p->block_count++];
            *b = (struct pack_block){.kind = kind, .family_first = f,
                                     .first = s->families[f].first};
        }
        b->family_count++;
        b->count += s->families[f].count;
    }
}

/* A counting sort: families of a group stay in canonical order. */
static void group_block(struct pack *p, const struct pack_block *b, uint32_t *scratch)
{
    struct pack_sequence *s = &p->sequence[b->kind];
    uint32_t start[129] = {0};
    for (uint32_t f = b->family_first; f < b->family_first + b->family_count; f++)
        start[s->families[f].group + 1] += s->families[f].count;
    for (uint32_t g = 0; g < 128; g++)
        start[g + 1] += start[g];
    for (uint32_t f = b->family_first; f < b->family_first + b->family_count; f++) {
        const struct pack_family *family = &s->families[f];
        memcpy(scratch + start[family->group], s->nodes + family->first,
               family->count * sizeof *scratch);
        start[family->group] += family->count;
    }
    memcpy(s->nodes + b->first, scratch, b->count * sizeof *scratch);
}

static uint16_t key_of(const struct pack *p, const struct pack_block *b)
{
    return p->nodes[p->sequence[b->kind].nodes[b->first]].e_parent;     /* the largest of its nodes */
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

enum spc_status pack_order(struct pack *p, struct spc_error *err)
{
    const uint32_t n = p->node_count;
    struct emission e = {.p = p};
    enum spc_status status = SPC_OK;
    struct pack_block *merged = malloc(n * sizeof *merged);
    uint32_t *scratch = malloc(n * sizeof *scratch);
    e.emitted = malloc(n * sizeof *e.emitted);
    e.heap.keys = malloc(n * sizeof *e.heap.keys);
    p->blocks = malloc(n * sizeof *p->blocks);
    p->children = malloc(n * sizeof *p->children);
    for (int k = 0; k < 2; k++) {
        p->sequence[k].nodes = malloc(n * sizeof *p->sequence[k].nodes);
        p->sequence[k].families = malloc(n * sizeof *p->sequence[k].families);
    }
    if (!merged || !scratch || !e.emitted || !e.heap.keys || !p->blocks || !p->children ||
        !p->sequence[0].nodes || !p->sequence[0].families || !p->sequence[1].nodes ||
        !p->sequence[1].families) {
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to order a cluster");
        goto out;
    }
    emit_all(&e);
    slice(p, SPC_BLOCK_INNER);
    const uint32_t inner_blocks = p->block_count;
    slice(p, SPC_BLOCK_LEAF);
    merge_blocks(p, inner_blocks, merged);
    for (uint32_t k = 0; k < p->block_count; k++)
        group_block(p, &p->blocks[k], scratch);
out:
    free(e.heap.keys);
    free(e.emitted);
    free(scratch);
    free(merged);
    return status;
}
