/*
 * edge_index.h - an edge_ring that writers search by vertex.
 *
 * The codes are those of edge_find and corner_find, without looking through the ring: edges hang in
 * chains by their vertex of larger number, the newest first; corners are known by when they came last.
 */
#ifndef SPC_EDGE_INDEX_H
#define SPC_EDGE_INDEX_H

#include "edge_ring.h"

enum { EDGE_FIRST = EDGE_DEPTH + 1 };           /* number of the first edge: 0 is always too old */

struct edge_index {
    struct edge_ring ring;
    struct {
        uint32_t pair;              /* of an edge: its vertices, the one of larger number above */
        uint32_t before;            /* the edge before it in its chain, as edge_at */
    } link[256];
    uint32_t *edge_at;              /* [vertices] newest edge of the chain: its number, or 0 */
    uint32_t *corner_at;            /* [vertices] when it was pushed last, counted from 1; 0: never */
};

/* memory: 2 * vertices numbers, which the index uses until it is no longer needed. */
static inline void edge_index_init(struct edge_index *x, uint32_t *memory, uint32_t vertices)
{
    x->ring.edges = x->ring.corners = 0;
    x->edge_at = memory;
    x->corner_at = memory + vertices;
}

/* Once for every vertex, before its first edge or corner. */
static inline void edge_index_add_vertex(struct edge_index *x, uint32_t v)
{
    x->edge_at[v] = x->corner_at[v] = 0;
}

static inline uint32_t edge_pair(uint32_t from, uint32_t to)
{
    return from > to ? from << 16 | to : to << 16 | from;
}

static inline void edge_index_push(struct edge_index *x, uint32_t from, uint32_t to, uint32_t opposite)
{
    const uint32_t k = x->ring.edges & 255, pair = edge_pair(from, to), end = pair >> 16;
    x->link[k].pair = pair;
    x->link[k].before = x->edge_at[end];
    x->edge_at[end] = x->ring.edges + EDGE_FIRST;
    edge_push(&x->ring, from, to, opposite);
}

/* As edge_push_triangle. */
static inline void edge_index_push_triangle(struct edge_index *x, uint32_t a, uint32_t b, uint32_t c,
                                            bool loose)
{
    if (loose)
        edge_index_push(x, b, a, c);
    edge_index_push(x, c, b, a);
    edge_index_push(x, a, c, b);
}

/* As edge_find. */
static inline uint32_t edge_index_find(const struct edge_index *x, uint32_t from, uint32_t to)
{
    const uint32_t pair = edge_pair(from, to), now = x->ring.edges + EDGE_FIRST;
    uint32_t at = x->edge_at[pair >> 16];
    while (now - at <= EDGE_DEPTH) {
        const uint32_t k = (at - EDGE_FIRST) & 255;
        if (x->link[k].pair == pair)
            return now - at - 1 + (x->ring.from[k] == from ? 1 : (uint32_t)EDGE_AGAINST);
        at = x->link[k].before;
    }
    return EDGE_LOOSE;
}

static inline void corner_index_push(struct edge_index *x, uint32_t v)
{
    corner_push(&x->ring, v);
    x->corner_at[v] = x->ring.corners;
}

/* As corner_find. */
static inline uint32_t corner_index_find(const struct edge_index *x, uint32_t v)
{
    const uint32_t at = x->corner_at[v];
    return at != 0 && x->ring.corners - at < 254 ? 1 + x->ring.corners - at : CORNER_EXPLICIT;
}

#endif
