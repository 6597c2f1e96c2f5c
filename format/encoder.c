#include "encoder.h"

#include <assert.h>
#include <stdlib.h>
#include <zstd.h>

enum spc_status spc_encoder_create(int level, struct spc_encoder **out, struct spc_error *err)
{
    struct spc_encoder *e = calloc(1, sizeof *e);
    *out = e;
    if (e != NULL)
        e->zstd = ZSTD_createCCtx();
    if (e == NULL || e->zstd == NULL) {
        spc_encoder_free(e);
        *out = NULL;
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to compress blocks");
    }
    e->level = level;
    return SPC_OK;
}

void spc_encoder_free(struct spc_encoder *e)
{
    if (e == NULL)
        return;
    ZSTD_freeCCtx(e->zstd);
    free(e->memory);
    free(e);
}

enum spc_status encoder_reserve(struct spc_encoder *e, size_t bytes, struct spc_error *err)
{
    e->used = 0;
    if (bytes <= e->bytes)
        return SPC_OK;
    free(e->memory);
    e->memory = malloc(bytes);
    e->bytes = e->memory ? bytes : 0;
    return e->memory ? SPC_OK : spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to encode a block");
}

void *encoder_take(struct spc_encoder *e, size_t bytes)
{
    const size_t share = encoder_share(bytes);
    uint8_t *array = e->memory + e->used;
    assert(share <= e->bytes - e->used);
    e->used += share;
    return array;
}
