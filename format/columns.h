/*
 * columns.h - blocks as columns of small numbers (spec section 6.4, codec zstd).
 *
 * A block in canonical order says more about itself than in drawing order: a child is like its
 * parent, a triangle shares an edge with one just seen, a leaf follows from its triangle. Stages,
 * a file each: columns.c families, order and the prelude; node_columns.c nodes from the nodes they
 * are like; triangle_columns.c triangles from edges, vertices from triangles; planes.c bytes.
 * Encoding and decoding of a stage stand side by side.
 */
#ifndef SPC_COLUMNS_H
#define SPC_COLUMNS_H

#include "planes.h"

enum { COLUMNS_NO_NODE = 0xFFFF };  /* number of no node of a block: blocks hold at most 65535 */

struct columns {
    const struct spc_block *block;
    const struct spc_block_layout *layout;
    const struct spc_frame *frame;
    uint32_t n;                     /* nodes */
    bool triangles;
    struct spc_family *families;    /* [family_count] canonical order */
    uint32_t family_count;
    uint32_t *place;                /* [n] canonical number -> index in the payload */
    uint16_t *like;                 /* [n] node that it is predicted from, canonical, or NO_NODE */
    int e_shift, radius_shift, height_shift;    /* low bits that no code uses */
    int position_bits;              /* steps per radius: see position_shift */
};

/*
 * Low bits of a node's position that are 0, by its radius code: a disk's centre lies on a lattice
 * of 2^position_bits to twice as many steps per radius.
 */
static inline int position_shift(const struct columns *c, uint16_t radius_code)
{
    const int step = c->block->step_exp - c->frame->unit_exp;
    const int shift = (radius_code >> 8) - 127 - c->position_bits - step;
    return shift < 0 ? 0 : shift > 15 ? 15 : shift;
}

/* e_self, radius, height, normal, position and colour of all nodes from those they are like. Putting
 * takes node_columns_memory of what is reserved in the encoder. */
size_t node_columns_memory(uint32_t n);
void node_columns_measure(struct columns *c, const uint8_t *payload);
void node_columns_put(const struct columns *c, const uint8_t *payload, struct planes_writer *w);
enum spc_status node_columns_get(const struct columns *c, struct planes_reader *r,
                                 uint8_t *payload, struct spc_error *err);

/* A colour from one that it is like: green, and what red and blue change beside it, zigzag. */
void columns_color_difference(const uint8_t *rgba, const uint8_t *was, uint8_t d[4]);
void columns_color_sum(const uint8_t d[4], const uint8_t *was, uint8_t *rgba);

/*
 * Triangles and vertices, v of them; putting takes triangle_columns_memory. Getting them fills the
 * leaves' records but e_parent and link.
 */
size_t triangle_columns_memory(uint32_t n, uint32_t v);
enum spc_status triangle_columns_put(const struct columns *c, const uint8_t *payload,
                                     struct planes_writer *w, struct spc_error *err);
enum spc_status triangle_columns_get(const struct columns *c, struct planes_reader *r,
                                     uint8_t *payload, struct spc_error *err);

/* Whole payloads. fails SPC_NO_MEMORY, SPC_CORRUPT (decode), SPC_INTERNAL (encode) */
enum spc_status columns_encode(const struct spc_block *block, const struct spc_block_layout *layout,
                               const struct spc_frame *frame, const struct spc_family *families,
                               uint32_t family_count, const uint8_t *payload,
                               struct spc_encoder *encoder, uint8_t *out, size_t out_max,
                               size_t *out_bytes, struct spc_error *err);
enum spc_status columns_decode(const struct spc_block *block, const struct spc_block_layout *layout,
                               const struct spc_frame *frame, const uint8_t *in, size_t in_bytes,
                               uint8_t *payload, struct spc_error *err);

#endif
