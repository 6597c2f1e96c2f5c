/*
 * weld.c - equal corners of a block become one vertex.
 *
 * A corner is a key of three coordinates, 21 bits each, and its colour. Where lattice numbers are
 * larger, the block's distinct numbers are counted off instead, axis by axis: at most 65535.
 */
#include "pack_int.h"

#include "bytes.h"
#include "edge_index.h"

#include <stdlib.h>

struct corner {
    uint64_t key;
    uint32_t rgba;
    uint32_t hash;
};

struct set {
    struct pack_vertex *vertices;
    uint32_t count;
    uint32_t *slots;                /* open addressing: vertex + 1, and a tag of the hash; 0 is free */
    uint32_t mask;
};

enum { NUMBER_BITS = 16 };          /* of a slot; the tag above */

static inline uint32_t hash_of(uint64_t key, uint32_t rgba)
{
    const uint64_t h = (key ^ (uint64_t)rgba << 31) * 0x9E3779B97F4A7C15u;
    return (uint32_t)(h >> 32 ^ h >> 58);
}

static inline uint32_t tag_of(uint32_t hash)
{
    return hash & ~(((uint32_t)1 << NUMBER_BITS) - 1);
}

static inline uint32_t start_of(const struct set *set, uint32_t hash)
{
    return hash * 0x85EBCA6Bu >> 8 & set->mask;
}

/* The slot from there on that holds the corner's vertex, or the free one where it belongs. */
static inline uint32_t find(const struct set *set, const struct corner *c, uint32_t slot)
{
    for (;; slot = (slot + 1) & set->mask) {
        const uint32_t at = set->slots[slot];
        if (at == 0)
            return slot;
        const struct pack_vertex *v = &set->vertices[(at & 0xFFFF) - 1];
        if (tag_of(at) == tag_of(c->hash) && v->key == c->key && load_u32(v->rgba) == c->rgba)
            return slot;
    }
}

/* Twice as many slots. */
static void grow(struct set *set)
{
    const uint32_t slots = 2 * (set->mask + 1);
    memset(set->slots, 0, slots * sizeof *set->slots);
    set->mask = slots - 1;
    for (uint32_t i = 0; i < set->count; i++) {
        const struct pack_vertex *v = &set->vertices[i];
        const uint32_t hash = hash_of(v->key, load_u32(v->rgba));
        uint32_t slot = start_of(set, hash);
        while (set->slots[slot] != 0)
            slot = (slot + 1) & set->mask;
        set->slots[slot] = (i + 1) | tag_of(hash);
    }
}

/* Number of the corner's vertex, from a slot that find gave; a new one where that is free. */
static inline uint32_t vertex_of(struct set *set, struct edge_index *index, const struct corner *c,
                                 uint32_t slot, uint32_t corner)
{
    if (set->slots[slot] == 0) {    /* or taken meanwhile, by a corner of the same triangle */
        edge_index_add_vertex(index, set->count);
        struct pack_vertex *v = &set->vertices[set->count++];
        *v = (struct pack_vertex){.key = c->key, .corner = corner};
        store_u32(v->rgba, c->rgba);
        set->slots[slot] = set->count | tag_of(c->hash);
        return set->count - 1;
    }
    return (set->slots[slot] & 0xFFFF) - 1;
}

/*
 * Which corner comes first: the one that starts the edge seen last, so that the triangle is told
 * from it. Turning keeps the winding.
 */
static inline int turn_of(const struct edge_index *index, const uint32_t number[3], bool *loose)
{
    uint32_t best = EDGE_LOOSE;
    int turn = 0;
    for (int k = 0; k < 3; k++) {
        const uint32_t from = number[k], to = number[(k + 1) % 3];
        const uint32_t code = from == SPC_NONE || to == SPC_NONE ? EDGE_LOOSE
                                                                 : edge_index_find(index, from, to);
        if (code != EDGE_LOOSE && (best == EDGE_LOOSE || edge_age(code) < edge_age(best))) {
            best = code;
            turn = k;
        }
    }
    *loose = best == EDGE_LOOSE;
    return turn;
}

static void weld_triangle(struct set *set, struct edge_index *index, const struct corner c[3],
                          uint32_t leaf, uint16_t out[3])
{
    uint32_t slot[3], number[3], q[3];
    bool loose;
    for (int k = 0; k < 3; k++) {
        slot[k] = find(set, &c[k], start_of(set, c[k].hash));
        number[k] = set->slots[slot[k]] ? (set->slots[slot[k]] & 0xFFFF) - 1 : SPC_NONE;
    }
    const int turn = turn_of(index, number, &loose);
    for (int k = 0; k < 3; k++) {
        const int from = turn + k < 3 ? turn + k : turn + k - 3;
        q[k] = number[from];
        if (q[k] == SPC_NONE)
            q[k] = vertex_of(set, index, &c[from], find(set, &c[from], slot[from]),
                             3 * leaf + (uint32_t)from);
        out[k] = (uint16_t)q[k];
    }
    edge_index_push_triangle(index, q[0], q[1], q[2], loose);
}

/* ---- keys of wide corners ---------------------------------------------------------------------- */

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static uint32_t rank_of(const double *sorted, uint32_t count, double v)
{
    uint32_t low = 0, high = count;
    while (high - low > 1) {
        const uint32_t middle = low + (high - low) / 2;
        if (sorted[middle] <= v)
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* keys[count] of the block's leaves; values[3 count] is for use here. */
static void rank_corners(const struct pack *p, const uint32_t *leaves, uint32_t count, double *values,
                         uint64_t (*keys)[3])
{
    memset(keys, 0, count * sizeof *keys);
    for (int a = 0; a < 3; a++) {
        for (uint32_t i = 0; i < 3 * count; i++)
            values[i] = p->leaves.wide[leaves[i / 3]][i % 3][a];
        qsort(values, 3 * (size_t)count, sizeof *values, by_value);
        uint32_t distinct = 1;
        for (uint32_t i = 1; i < 3 * count; i++)
            if (values[i] != values[distinct - 1])
                values[distinct++] = values[i];
        for (uint32_t i = 0; i < 3 * count; i++)
            keys[i / 3][i % 3] |=
                (uint64_t)rank_of(values, distinct, p->leaves.wide[leaves[i / 3]][i % 3][a]) << 21 * a;
    }
}

/* ---- a block ----------------------------------------------------------------------------------- */

struct memory {                     /* of a block of count leaves */
    struct pack_vertex *vertices;   /* [3 count] */
    uint32_t *slots;                /* [slots_max] */
    uint32_t *edges;                /* [6 count] */
    uint32_t *leaves;               /* [count] canonical order */
    uint16_t *indices;              /* [3 count] */
    double *values;                 /* [3 count] with wide corners */
    uint64_t (*keys)[3];            /* [count] with wide corners */
    uint32_t slots_max;
};

/* Slots to begin with: a mesh has half a vertex a triangle. */
static uint32_t slots_for(uint32_t count)
{
    uint32_t slots = 16;
    while (slots < count)
        slots *= 2;
    return slots;
}

static bool lay_out(const struct pack *p, uint32_t count, struct memory *m)
{
    const bool wide = p->leaves.wide != NULL;
    m->slots_max = slots_for(6 * count);
    const size_t bytes = (size_t)count * (3 * sizeof *m->vertices + 6 * sizeof *m->edges +
                                          sizeof *m->leaves + 3 * sizeof *m->indices + 2 +
                                          (wide ? 3 * sizeof *m->values + sizeof *m->keys : 0)) +
                         m->slots_max * sizeof *m->slots + 8;
    uint8_t *at = pack_scratch_buffer(p->memory, PACK_WELD, bytes);
    if (at == NULL)
        return false;
    m->vertices = (struct pack_vertex *)at;
    m->values = (double *)(m->vertices + 3 * (size_t)count);
    m->keys = (uint64_t (*)[3])(m->values + (wide ? 3 * (size_t)count : 0));
    m->slots = (uint32_t *)(m->keys + (wide ? count : 0));
    m->edges = m->slots + m->slots_max;
    m->leaves = m->edges + 6 * (size_t)count;
    m->indices = (uint16_t *)(m->leaves + count);
    return true;
}

static void list_leaves(const struct pack *p, const struct pack_block *b, uint32_t *leaves)
{
    uint32_t n = 0;
    for (uint32_t f = 0; f < b->family_count; f++) {
        const struct pack_family *family = pack_family_of(p, b, f);
        for (uint32_t k = 0; k < family->count; k++)
            leaves[n++] = family->first + k;
    }
}

enum { AHEAD = 8 };                 /* leaves whose slots are asked for ahead; a power of two */

/* Corners of leaf i of the block. */
static inline void load_corners(const struct pack *p, const struct memory *m, uint32_t i,
                                const struct set *set, struct corner c[3])
{
    const uint32_t leaf = m->leaves[i];
    const uint64_t *key = p->leaves.wide ? m->keys[i] : p->leaves.key[leaf];
    for (int k = 0; k < 3; k++) {
        c[k].key = key[k];
        c[k].rgba = p->leaves.rgba ? load_u32(p->leaves.rgba[leaf][k]) : UINT32_MAX;
        c[k].hash = hash_of(c[k].key, c[k].rgba);
        __builtin_prefetch(&set->slots[start_of(set, c[k].hash)]);
    }
}

static void weld_all(const struct pack *p, const struct memory *m, uint32_t count, struct set *set)
{
    struct edge_index index;
    struct corner c[AHEAD][3];
    edge_index_init(&index, m->edges, 3 * count);
    memset(set->slots, 0, (set->mask + 1) * sizeof *set->slots);
    for (uint32_t i = 0; i < AHEAD && i < count; i++)
        load_corners(p, m, i, set, c[i]);
    for (uint32_t i = 0; i < count; i++) {
        if (set->count + 3 > set->mask / 2)
            grow(set);
        weld_triangle(set, &index, c[i % AHEAD], m->leaves[i], m->indices + 3 * (size_t)i);
        if (i + AHEAD < count)
            load_corners(p, m, i + AHEAD, set, c[i % AHEAD]);
    }
}

enum spc_status pack_weld(const struct pack *p, const struct pack_block *b, struct pack_weld *out,
                          struct spc_error *err)
{
    struct memory m;
    if (!lay_out(p, b->count, &m))
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to pack a block");
    struct set set = {.vertices = m.vertices, .slots = m.slots, .mask = slots_for(b->count) - 1};
    list_leaves(p, b, m.leaves);
    if (p->leaves.wide)
        rank_corners(p, m.leaves, b->count, m.values, m.keys);
    weld_all(p, &m, b->count, &set);
    *out = (struct pack_weld){.vertices = m.vertices, .count = set.count, .indices = m.indices};
    return SPC_OK;
}
