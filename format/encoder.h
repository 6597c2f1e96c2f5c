/*
 * encoder.h - what encoding blocks needs, kept from block to block: memory and zstd's tables.
 */
#ifndef SPC_ENCODER_H
#define SPC_ENCODER_H

#include "spc.h"

struct spc_encoder {
    void *zstd;
    int level;
    uint8_t *memory;                /* [bytes] of the arrays of one block */
    size_t bytes, used;
};

/* An array's share of encoder_reserve. */
static inline size_t encoder_share(size_t bytes)
{
    return (bytes + 15) / 16 * 16;
}

/* Memory for the arrays of another block: the sum of their shares. fails SPC_NO_MEMORY */
enum spc_status encoder_reserve(struct spc_encoder *encoder, size_t bytes, struct spc_error *err);

/* An array of the block, uncleared, aligned to 16 bytes; no more than was reserved. */
void *encoder_take(struct spc_encoder *encoder, size_t bytes);

#endif
