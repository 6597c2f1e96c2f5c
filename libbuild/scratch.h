/*
 * scratch.h - memory of packing, kept from cluster to cluster.
 *
 * Whoever packs a cluster takes a scratch and gives it back; so there are as many as threads that pack.
 * Its buffers grow to what the largest cluster so far needed and a quarter more. With n nodes a cluster,
 * m nodes a block and v vertices in it (v <= 3 m; m / 2 in a mesh), w bytes a coordinate, in bytes:
 *     arrays of the cluster   n (265 + 12 with colours + 72 where corners exceed 21 bits an axis)
 *     vertices of a block     m (132 + 48 where corners exceed 21 bits an axis)
 *     payload, and as stored  2 (m (22 + 4) + v (3 w + 4)) + 65536
 *     encoder                 m (26 + 11) + v 66, and zstd's context
 * and 257 KiB. With 28,672 nodes a cluster and a mesh that is 16 MiB, of which 10 are touched.
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
