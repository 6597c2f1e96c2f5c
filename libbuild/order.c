/*
 * order.c - blocks of a cluster's families (spec section 7).
 *
 * A block takes the families of a range of e_parent, so that a viewer reads a prefix of the blocks; in
 * a block they are in canonical order (collect.c). Families stay whole, so the parent relation costs
 * half a byte an inner node.
 *
 * Inner blocks are bands that grow: whatever prefix a picture needs, the last block read holds a few times
 * as many nodes as those that are drawn, not all of the cluster's. Of the leaves, the few whose parents are
 * far coarser than the others' have a block of their own, or each picture that draws one of them would read
 * all. Smaller steps test fewer nodes in vain, but cost more blocks, of which each has a record in the head,
 * and more nodes whose parents lie in another block: spec/decisions.md has the table.
 */
#include "pack_int.h"

/* scripts/decisions measures others. */
#ifndef SPB_BAND_GROWTH
#define SPB_BAND_GROWTH 5           /* a band has so many times the nodes of the one before */
#endif
#ifndef SPB_BAND_FIRST
#define SPB_BAND_FIRST 52           /* the first has at least so many, else there is one band less */
#endif
#ifndef SPB_OUTLIERS_SHARE
#define SPB_OUTLIERS_SHARE 64       /* one of so many leaves is in the first block */
#endif

enum { OUTLIERS_LEAST = 32 };       /* fewer get no block of their own */
enum { BANDS_MAX = 32 };            /* more than 2^32 nodes have */
_Static_assert(SPB_BAND_GROWTH > 1 && SPB_BAND_FIRST > 1, "bands grow");

struct bands {                      /* nodes up to the end of each block that is wanted */
    uint32_t end[BANDS_MAX], count;
};

/* As many bands as leave the first large enough, in proportions 1, g, g^2 ... */
static struct bands inner_bands(uint32_t n)
{
    struct bands b = {.count = 1};
    uint64_t all = 1, upto = 0;
    while (b.count < BANDS_MAX && n / (all * SPB_BAND_GROWTH + 1) >= SPB_BAND_FIRST) {
        all = all * SPB_BAND_GROWTH + 1;
        b.count++;
    }
    for (uint32_t k = 0; k < b.count; k++) {
        upto = upto * SPB_BAND_GROWTH + 1;
        b.end[k] = (uint32_t)(n * upto / all);
    }
    return b;
}

static struct bands leaf_bands(uint32_t n)
{
    if (n / SPB_OUTLIERS_SHARE < OUTLIERS_LEAST)
        return (struct bands){.end = {n}, .count = 1};
    return (struct bands){.end = {n / SPB_OUTLIERS_SHARE, n}, .count = 2};
}

uint32_t spb_pack_bands(uint32_t cluster_nodes)
{
    return inner_bands(cluster_nodes).count + 2;
}

/* By e_parent, largest first, then canonical order: a counting sort over the codes, start[65537]. */
static void sort_families(const struct pack_kind *s, uint32_t *start)
{
    memset(start, 0, 65537 * sizeof *start);
    for (uint32_t f = 0; f < s->family_count; f++)
        start[65536 - s->families[f].e_parent]++;
    for (uint32_t k = 1; k <= 65536; k++)
        start[k] += start[k - 1];
    for (uint32_t f = s->family_count; f-- > 0;)
        s->list[--start[65536 - s->families[f].e_parent]] = f;
}

/* Whole families, as many as fit; another block, too, where a band has got its share. */
static void slice(struct pack *p, enum spc_block_kind kind, const struct bands *bands, uint32_t limit)
{
    const struct pack_kind *s = &p->kind[kind];
    struct pack_block *b = NULL;
    uint32_t done = 0, band = 0;
    for (uint32_t f = 0; f < s->family_count; f++) {
        const uint32_t count = s->families[s->list[f]].count;
        if (b == NULL || b->count + count > limit || done >= bands->end[band]) {
            band += done >= bands->end[band];
            b = &p->blocks[p->block_count++];
            *b = (struct pack_block){.kind = kind, .family_first = f};
        }
        b->family_count++;
        b->count += count;
        done += count;
    }
}

/* Families of each of a kind's blocks back into canonical order: block by block, as they come. */
static void restore_order(struct pack *p, uint32_t block_first, uint32_t *block_of)
{
    const struct pack_kind *s = &p->kind[p->blocks[block_first].kind];
    for (uint32_t k = block_first; k < p->block_count; k++)
        for (uint32_t f = 0; f < p->blocks[k].family_count; f++)
            block_of[s->list[p->blocks[k].family_first + f]] = k;
    for (uint32_t f = 0; f < s->family_count; f++)
        s->list[p->blocks[block_of[f]].family_first++] = f;
    for (uint32_t k = block_first; k < p->block_count; k++)
        p->blocks[k].family_first -= p->blocks[k].family_count;
}

/* A leaf block has at most three vertices a leaf: 16-bit numbers. */
static void make_blocks(struct pack *p, enum spc_block_kind kind, uint32_t *start)
{
    struct pack_kind *s = &p->kind[kind];
    const uint32_t block_first = p->block_count;
    uint32_t limit = p->shared->options.block_nodes;
    if (kind == SPC_BLOCK_LEAF && limit > 65535 / 3)
        limit = 65535 / 3;
    if (s->count == 0)
        return;
    const struct bands bands = kind == SPC_BLOCK_LEAF ? leaf_bands(s->count) : inner_bands(s->count);
    if (s->count <= limit && bands.count == 1) {
        for (uint32_t f = 0; f < s->family_count; f++)
            s->list[f] = f;
        p->blocks[p->block_count++] = (struct pack_block){
            .kind = kind, .family_count = s->family_count, .count = s->count};
        return;
    }
    sort_families(s, start);
    slice(p, kind, &bands, limit);
    restore_order(p, block_first, p->scratch);
}

/* Largest e_parent of a block. */
static uint16_t key_of(const struct pack *p, const struct pack_block *b)
{
    uint16_t key = 0;
    for (uint32_t f = 0; f < b->family_count; f++)
        key = pack_family_of(p, b, f)->e_parent > key ? pack_family_of(p, b, f)->e_parent : key;
    return key;
}

/* Inner and leaf blocks, each in order, into one prefix order: inner first on equal keys. */
static void merge_blocks(struct pack *p, uint32_t inner_count)
{
    struct pack_block *merged = p->blocks + p->node_max;
    uint32_t i = 0, l = inner_count;
    for (uint32_t k = 0; k < p->block_count; k++) {
        const bool inner = l == p->block_count ||
                           (i < inner_count && key_of(p, &p->blocks[i]) >= key_of(p, &p->blocks[l]));
        merged[k] = p->blocks[inner ? i++ : l++];
    }
    memcpy(p->blocks, merged, p->block_count * sizeof *merged);
}

static void number_nodes(struct pack *p, uint32_t block)
{
    const struct pack_block *b = &p->blocks[block];
    uint16_t number = 0;
    for (uint32_t f = 0; f < b->family_count && b->kind == SPC_BLOCK_INNER; f++) {
        const struct pack_family *family = pack_family_of(p, b, f);
        for (uint32_t i = family->first; i < family->first + family->count; i++) {
            p->inner[i].block = block;
            p->inner[i].number = number++;
        }
    }
}

void pack_order(struct pack *p)
{
    make_blocks(p, SPC_BLOCK_INNER, p->levels);
    const uint32_t inner_blocks = p->block_count;
    make_blocks(p, SPC_BLOCK_LEAF, p->levels);
    merge_blocks(p, inner_blocks);
    for (uint32_t k = 0; k < p->block_count; k++)
        number_nodes(p, k);
}
