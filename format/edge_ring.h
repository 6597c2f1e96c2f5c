/*
 * edge_ring.h - the edges and vertices that the next triangle is likely to touch (spec 6.4.3).
 *
 * A triangle that continues a surface shares an edge with one of the last: it is told by how long
 * ago that edge was seen, and by its third corner. Writers turn triangles so that the shared edge
 * comes first, which keeps the winding.
 */
#ifndef SPC_EDGE_RING_H
#define SPC_EDGE_RING_H

#include <stdbool.h>
#include <stdint.h>

enum {
    EDGE_DEPTH = 127,               /* edges looked back at */
    EDGE_LOOSE = 0,                 /* no such edge: three corners follow */
    EDGE_AGAINST = 128,             /* codes from here: the same direction, against the winding */
    CORNER_NEW = 0,                 /* the next vertex that has not been used */
    CORNER_EXPLICIT = 255,          /* its number follows */
};

struct edge_ring {
    uint16_t from[256], to[256];    /* the edge as the next triangle walks it */
    uint16_t opposite[256];         /* third corner of the triangle it was seen in */
    uint16_t corner[256];           /* third corners and loose ones, as they came */
    uint32_t edges, corners;        /* pushed so far */
};

static inline void edge_push(struct edge_ring *r, uint32_t from, uint32_t to, uint32_t opposite)
{
    const uint32_t k = r->edges++ & 255;
    r->from[k] = (uint16_t)from;
    r->to[k] = (uint16_t)to;
    r->opposite[k] = (uint16_t)opposite;
}

static inline void corner_push(struct edge_ring *r, uint32_t v)
{
    r->corner[r->corners++ & 255] = (uint16_t)v;
}

/* After triangle a b c: its edges, but for the shared one a b, as a neighbour walks them. */
static inline void edge_push_triangle(struct edge_ring *r, uint32_t a, uint32_t b, uint32_t c,
                                      bool loose)
{
    if (loose)
        edge_push(r, b, a, c);
    edge_push(r, c, b, a);
    edge_push(r, a, c, b);
}

/* Code of edge from-to: its age, and its direction; EDGE_LOOSE when it is not there. */
static inline uint32_t edge_find(const struct edge_ring *r, uint32_t from, uint32_t to)
{
    const uint32_t depth = r->edges < EDGE_DEPTH ? r->edges : EDGE_DEPTH;
    for (uint32_t d = 0; d < depth; d++) {
        const uint32_t k = (r->edges - 1 - d) & 255;
        if (r->from[k] == from && r->to[k] == to)
            return 1 + d;
        if (r->from[k] == to && r->to[k] == from)
            return EDGE_AGAINST + d;
    }
    return EDGE_LOOSE;
}

static inline uint32_t edge_age(uint32_t code)
{
    return code >= EDGE_AGAINST ? code - EDGE_AGAINST : code - 1;
}

/* Code of a vertex that has been used: its age among the corners. */
static inline uint32_t corner_find(const struct edge_ring *r, uint32_t v)
{
    const uint32_t depth = r->corners < 254 ? r->corners : 254;
    for (uint32_t d = 0; d < depth; d++)
        if (r->corner[(r->corners - 1 - d) & 255] == v)
            return 1 + d;
    return CORNER_EXPLICIT;
}

#endif
