#include "planes.h"

#include "bytes.h"

#include <stdlib.h>
#include <zstd.h>
#include <zstd_errors.h>

enum { PLANE_ZSTD = 0, PLANE_PLAIN = 1, PLANE_CONSTANT = 2 };

/* ---- writing ----------------------------------------------------------------------------------- */

enum spc_status planes_begin(struct planes_writer *w, struct spc_encoder *encoder,
                             uint32_t plane_count, uint32_t count_max, uint8_t *out, size_t out_max,
                             struct spc_error *err)
{
    *w = (struct planes_writer){.encoder = encoder, .out = out, .out_max = out_max,
                                .plane_count = plane_count, .used = (size_t)4 * plane_count};
    w->scratch = encoder_take(encoder, count_max);
    if (w->used > out_max)
        return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "no room for the planes of a block");
    return SPC_OK;
}

static bool is_constant(const uint8_t *p, uint32_t n)
{
    return memcmp(p, p + 1, n - 1) == 0;
}

static void put_plane(struct planes_writer *w, const uint8_t *plane, uint32_t n)
{
    const size_t room = w->out_max - w->used;
    uint8_t *out = w->out + w->used;
    uint32_t mode = PLANE_ZSTD;
    size_t size = 0;
    if (w->status != SPC_OK)
        return;
    if (w->plane == w->plane_count || room < n) {
        w->status = SPC_INTERNAL;
        return;
    }
    if (n > 0 && is_constant(plane, n)) {
        mode = PLANE_CONSTANT;
        size = plane[0] != 0;           /* zeros cost nothing */
        if (size)
            out[0] = plane[0];
    } else if (n > 0) {
        size = ZSTD_compressCCtx(w->encoder->zstd, out, room, plane, n, w->encoder->level);
        if (ZSTD_isError(size) && ZSTD_getErrorCode(size) != ZSTD_error_dstSize_tooSmall) {
            w->status = SPC_NO_MEMORY;  /* stored plain, bytes would depend on the machine */
            return;
        }
        if (ZSTD_isError(size) || size >= n) {
            mode = PLANE_PLAIN;
            size = n;
            memcpy(out, plane, n);
        }
    }
    store_u32(w->out + 4 * w->plane++, mode << PLANE_MODE_SHIFT | (uint32_t)size);
    w->used += size;
}

void planes_put8(struct planes_writer *w, const uint8_t *values, uint32_t count)
{
    put_plane(w, values, count);
}

void planes_put16(struct planes_writer *w, const uint16_t *values, uint32_t count)
{
    for (int k = 0; k < 2; k++) {
        for (uint32_t i = 0; i < count; i++)
            w->scratch[i] = (uint8_t)(values[i] >> 8 * k);
        put_plane(w, w->scratch, count);
    }
}

void planes_put64(struct planes_writer *w, const uint64_t *values, uint32_t width, uint32_t count)
{
    for (uint32_t k = 0; k < width; k++) {
        for (uint32_t i = 0; i < count; i++)
            w->scratch[i] = (uint8_t)(values[i] >> 8 * k);
        put_plane(w, w->scratch, count);
    }
}

enum spc_status planes_finish(struct planes_writer *w, size_t *bytes, struct spc_error *err)
{
    if (w->status == SPC_OK && w->plane != w->plane_count)
        w->status = SPC_INTERNAL;
    *bytes = w->used;
    if (w->status == SPC_NO_MEMORY)
        return spc_fail(err, w->status, SPC_NO_OFF, "no memory to compress a block");
    if (w->status != SPC_OK)
        return spc_fail(err, w->status, SPC_NO_OFF, "a block does not fit its planes");
    return SPC_OK;
}

/* ---- reading ----------------------------------------------------------------------------------- */

enum spc_status planes_open(struct planes_reader *r, uint32_t plane_count, uint32_t count_max,
                            const uint8_t *in, size_t in_bytes, struct spc_error *err)
{
    *r = (struct planes_reader){.in = in, .in_bytes = in_bytes, .plane_count = plane_count,
                                .count_max = count_max, .at = (size_t)4 * plane_count};
    if (r->at > in_bytes) {
        r->broken = true;
        r->plane_count = 0;
    }
    r->zstd = ZSTD_createDCtx();
    r->scratch = malloc((size_t)8 * count_max + 8);
    if (r->zstd == NULL || r->scratch == NULL) {
        ZSTD_freeDCtx(r->zstd);
        free(r->scratch);
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to decompress a block");
    }
    return SPC_OK;
}

/* Decoders that stream take memory for the window: at most 8 MiB (RFC 8878, 3.1.1.1). */
static bool window_ok(const uint8_t *frame)
{
    const bool single_segment = frame[4] & 0x20;    /* the window is the content */
    return single_segment || frame[5] < (13 << 3 | 1);
}

static bool decode_plane(struct planes_reader *r, const uint8_t *in, uint32_t bytes, uint32_t mode,
                         uint8_t *plane, uint32_t n)
{
    switch (mode) {
    case PLANE_CONSTANT:
        if (bytes > 1 || (bytes == 1 && in[0] == 0))
            return false;
        memset(plane, bytes ? in[0] : 0, n);
        return n > 0;
    case PLANE_PLAIN:
        if (bytes != n)
            return false;
        memcpy(plane, in, n);
        return true;
    case PLANE_ZSTD:                /* one frame, not several and none to be skipped */
        if (n == 0)
            return bytes == 0;
        return bytes >= 6 && load_u32(in) == ZSTD_MAGICNUMBER && window_ok(in) &&
               ZSTD_findFrameCompressedSize(in, bytes) == bytes &&
               ZSTD_decompressDCtx(r->zstd, plane, n, in, bytes) == n;
    default:
        return false;
    }
}

static void get_plane(struct planes_reader *r, uint8_t *plane, uint32_t n)
{
    if (r->plane < r->plane_count && n <= r->count_max && !r->broken) {
        const uint32_t entry = load_u32(r->in + 4 * r->plane++);
        const uint32_t bytes = entry & PLANE_BYTES_MASK;
        if (range_fits(r->at, bytes, r->in_bytes) &&
            decode_plane(r, r->in + r->at, bytes, entry >> PLANE_MODE_SHIFT, plane, n)) {
            r->at += bytes;
            return;
        }
    }
    r->broken = true;
    memset(plane, 0, n);
}

void planes_get8(struct planes_reader *r, uint8_t *values, uint32_t count)
{
    get_plane(r, values, count);
}

void planes_get16(struct planes_reader *r, uint16_t *values, uint32_t count)
{
    uint8_t *low = r->scratch, *high = r->scratch + r->count_max;
    if (count > r->count_max) {
        r->broken = true;
        return;
    }
    get_plane(r, low, count);
    get_plane(r, high, count);
    for (uint32_t i = 0; i < count; i++)
        values[i] = (uint16_t)(low[i] | high[i] << 8);
}

void planes_get64(struct planes_reader *r, uint64_t *values, uint32_t width, uint32_t count)
{
    if (count > r->count_max) {
        r->broken = true;
        return;
    }
    for (uint32_t k = 0; k < width; k++)
        get_plane(r, r->scratch + (size_t)k * r->count_max, count);
    for (uint32_t i = 0; i < count; i++) {
        uint64_t v = 0;
        for (uint32_t k = 0; k < width; k++)
            v |= (uint64_t)r->scratch[(size_t)k * r->count_max + i] << 8 * k;
        values[i] = v;
    }
}

bool planes_close(struct planes_reader *r)
{
    ZSTD_freeDCtx(r->zstd);
    free(r->scratch);
    return !r->broken && r->plane == r->plane_count && r->at == r->in_bytes;
}
