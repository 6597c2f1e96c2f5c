/* info_walk.c - every block of an archive, decoded one after another into one buffer. */
#include "info.h"

#include <stdlib.h>

static size_t largest_payload(const struct spc_reader *r)
{
    const struct spc_header *h = spc_reader_header(r);
    size_t largest = 16;
    for (uint32_t i = 0; i < h->block_count; i++) {
        struct spc_block block;
        spc_reader_block(r, i, &block);
        largest = block.raw_bytes > largest ? block.raw_bytes : largest;
    }
    return (largest + 15) / 16 * 16;
}

static enum spc_status visit(const struct spc_reader *r, uint32_t index, uint8_t *payload,
                             info_block_fn fn, void *ctx, struct spc_error *err)
{
    const struct spc_header *h = spc_reader_header(r);
    struct info_block b = {.index = index, .payload = payload};
    spc_reader_block(r, index, &b.block);
    if (!spc_block_layout(&b.block, h->flags, h->normal_clusters, &b.layout))
        return spc_fail(err, SPC_LIMIT, b.block.off, "block %u is over the limits", index);
    const enum spc_status status = spc_block_decode(r, index, true, payload, err);
    return status == SPC_OK ? fn(ctx, &b, err) : status;
}

enum spc_status info_walk(const struct spc_reader *r, const char *phase, info_block_fn fn,
                          void *ctx, struct spc_error *err)
{
    const uint32_t count = spc_reader_header(r)->block_count;
    const size_t bytes = largest_payload(r);
    uint8_t *payload = aligned_alloc(16, bytes);
    enum spc_status status = SPC_OK;
    if (payload == NULL)
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a block of %zu bytes", bytes);
    for (uint32_t i = 0; i < count && status == SPC_OK; i++) {
        cli_progress(NULL, phase, i, count);
        status = visit(r, i, payload, fn, ctx, err);
    }
    free(payload);
    return status;
}
