/*
 * scratch.h - memory of packing, kept from cluster to cluster.
 *
 * Whoever packs a cluster takes a scratch and gives it back; so there are as many as threads that pack.
 * Its buffers grow to what the largest cluster so far needed: with n nodes a cluster, m leaves a block,
 * v vertices and f families in them, at most
 *     n (300 + 12 with colours, + 72 where corners need more than 21 bits an axis)
 *     + m (140 + 6 + 22) + v (2 (3 + colours) 8) + 65536 for the block, and in the encoder
 *     m (6 + 9 + 12) + v 68.
 */
#ifndef SPB_SCRATCH_H
#define SPB_SCRATCH_H

#include "spc.h"

enum pack_buffer { PACK_ARRAYS, PACK_WIDE, PACK_WELD, PACK_PAYLOAD, PACK_STORED, PACK_BUFFERS };

struct pack_scratch {
    struct pack_scratch *next;
    struct spc_encoder *encoder;
    void *bytes[PACK_BUFFERS];
    size_t size[PACK_BUFFERS];
};

/* A buffer of at least that many bytes, not cleared; what it held is lost. NULL: no memory. */
void *pack_scratch_buffer(struct pack_scratch *scratch, enum pack_buffer buffer, size_t bytes);

/* Scratches that nobody has taken. */
struct pack_scratches;
/* level: zstd's. NULL: no memory. */
struct pack_scratches *pack_scratches_create(int level);
void pack_scratches_free(struct pack_scratches *scratches);

/* NULL: no memory. */
struct pack_scratch *pack_scratch_take(struct pack_scratches *scratches);
void pack_scratch_give(struct pack_scratches *scratches, struct pack_scratch *scratch);

#endif
