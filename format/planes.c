/*
 * planes.c - the zstd codec: a payload as byte planes, each its own zstd frame (spec section 6.4).
 *
 * A column is one little-endian field of an array. Positions, normals and vertices are stored as
 * zigzag differences to the element before, everything else as it is: differences hurt radii and
 * errors. The bytes of a column of equal weight form a plane. Measured on real hierarchies, planes
 * compressed alone beat planes in one frame, and levels above 1 gain two per cent.
 */
#include "format_int.h"

#include "bytes.h"

#include <stdlib.h>
#include <zstd.h>

struct column {
    uint32_t off, stride, width, count;
    bool delta;
};

enum { COLUMNS_MAX = 40, WIDTH_MAX = 8 };

/* A plane's table entry: mode in the upper two bits, stored bytes in the others. */
enum { PLANE_ZSTD = 0, PLANE_PLAIN = 1, PLANE_CONSTANT = 2, PLANE_MODE_SHIFT = 30 };

static void add(struct column *columns, int *n, uint32_t off, uint32_t stride, uint32_t width,
                uint32_t count, bool delta)
{
    columns[(*n)++] = (struct column){off, stride, width, count, delta};
}

/* The columns of a payload, in the order of the spec. */
static int list_columns(const struct spc_block *b, const struct spc_block_layout *l,
                        uint32_t normal_clusters, struct column *columns)
{
    static const uint8_t fields[][3] = {        /* offset, width, delta */
        {ND_X, 2, 1}, {ND_Y, 2, 1}, {ND_Z, 2, 1}, {ND_NORMAL, 1, 1}, {ND_NORMAL + 1, 1, 1},
        {ND_E_SELF, 2, 0}, {ND_E_PARENT, 2, 0}, {ND_RADIUS, 2, 0}, {ND_HEIGHT, 1, 0},
        {ND_LINK, 1, 0},
    };
    int n = 0;
    for (size_t f = 0; f < sizeof fields / sizeof *fields; f++)
        add(columns, &n, l->nodes + fields[f][0], ND_SIZE, fields[f][1], b->node_count,
            fields[f][2] != 0);
    if (l->colors)
        for (uint32_t a = 0; a < 4; a++)
            add(columns, &n, l->colors + a, 4, 1, b->node_count, true);
    add(columns, &n, l->groups, 4, 2, normal_clusters, false);
    add(columns, &n, l->groups + 2, 4, 2, normal_clusters, false);
    if (l->children)
        add(columns, &n, l->children, 1, 1, (b->node_count + 1) / 2, false);
    if (l->indices)
        for (uint32_t a = 0; a < 3; a++)
            add(columns, &n, l->indices + 2 * a, 6, 2, b->node_count, true);
    if (l->vertices) {
        const uint32_t w = b->vertex_width;
        add(columns, &n, l->vertex_base, 8, 8, 3, false);
        for (uint32_t a = 0; a < 3; a++)
            add(columns, &n, l->vertices + w * a, 3 * w, w, b->vertex_count, true);
    }
    if (l->vertex_colors)
        for (uint32_t a = 0; a < 4; a++)
            add(columns, &n, l->vertex_colors + a, 4, 1, b->vertex_count, true);
    return n;
}

static uint32_t plane_count(const struct column *columns, int n)
{
    uint32_t planes = 0;
    for (int i = 0; i < n; i++)
        planes += columns[i].width;
    return planes;
}

static uint64_t load_field(const uint8_t *p, uint32_t width)
{
    uint64_t v = 0;
    for (uint32_t k = 0; k < width; k++)
        v |= (uint64_t)p[k] << 8 * k;
    return v;
}

static uint64_t field_mask(uint32_t width)
{
    return width == 8 ? UINT64_MAX : ((uint64_t)1 << 8 * width) - 1;
}

/* Splits a column into planes[width][count]. */
static void split(const uint8_t *payload, const struct column *c, uint8_t *planes)
{
    const uint64_t mask = field_mask(c->width);
    const uint32_t top = 8 * c->width - 1;
    uint64_t before = 0;
    for (uint32_t i = 0; i < c->count; i++) {
        const uint64_t v = load_field(payload + c->off + (size_t)c->stride * i, c->width);
        uint64_t d = v;
        if (c->delta) {
            d = (v - before) & mask;
            d = (d << 1 & mask) ^ (d >> top ? mask : 0);
            before = v;
        }
        for (uint32_t k = 0; k < c->width; k++)
            planes[(size_t)k * c->count + i] = (uint8_t)(d >> 8 * k);
    }
}

static void join(const uint8_t *planes, const struct column *c, uint8_t *payload)
{
    const uint64_t mask = field_mask(c->width);
    uint64_t before = 0;
    for (uint32_t i = 0; i < c->count; i++) {
        uint64_t v = 0;
        for (uint32_t k = 0; k < c->width; k++)
            v |= (uint64_t)planes[(size_t)k * c->count + i] << 8 * k;
        if (c->delta) {
            v = (v >> 1) ^ (v & 1 ? mask : 0);
            v = (before + v) & mask;
            before = v;
        }
        uint8_t *p = payload + c->off + (size_t)c->stride * i;
        for (uint32_t k = 0; k < c->width; k++)
            p[k] = (uint8_t)(v >> 8 * k);
    }
}

static uint32_t longest(const struct column *columns, int n)
{
    uint32_t max = 0;
    for (int i = 0; i < n; i++)
        max = columns[i].count > max ? columns[i].count : max;
    return max;
}

static bool is_constant(const uint8_t *p, uint32_t n)
{
    for (uint32_t i = 1; i < n; i++)
        if (p[i] != p[0])
            return false;
    return true;
}

static enum spc_status put_plane(ZSTD_CCtx *zstd, const uint8_t *plane, uint32_t n, int level,
                                 uint8_t *out, size_t room, size_t *used, uint32_t *entry,
                                 struct spc_error *err)
{
    if (is_constant(plane, n)) {
        out[0] = plane[0];
        *used = 1;
        *entry = (uint32_t)PLANE_CONSTANT << PLANE_MODE_SHIFT | 1;
        return SPC_OK;
    }
    const size_t size = ZSTD_compressCCtx(zstd, out, room, plane, n, level);
    if (!ZSTD_isError(size) && size < n) {
        *used = size;
        *entry = (uint32_t)PLANE_ZSTD << PLANE_MODE_SHIFT | (uint32_t)size;
        return SPC_OK;
    }
    if (room < n)
        return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "no room to store a plane");
    memcpy(out, plane, n);
    *used = n;
    *entry = (uint32_t)PLANE_PLAIN << PLANE_MODE_SHIFT | n;
    return SPC_OK;
}

enum spc_status spc_planes_encode(const struct spc_block *b, const struct spc_block_layout *l,
                                  uint32_t normal_clusters, const uint8_t *payload, int level,
                                  uint8_t *out, size_t out_max, size_t *out_bytes,
                                  struct spc_error *err)
{
    struct column columns[COLUMNS_MAX];
    const int n = list_columns(b, l, normal_clusters, columns);
    uint8_t *planes = malloc((size_t)longest(columns, n) * WIDTH_MAX);
    ZSTD_CCtx *zstd = ZSTD_createCCtx();
    enum spc_status status = SPC_OK;
    size_t at = 4 * (size_t)plane_count(columns, n);
    uint32_t plane = 0;
    if (planes == NULL || zstd == NULL) {
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to compress a block");
        goto out;
    }
    for (int i = 0; i < n; i++) {
        split(payload, &columns[i], planes);
        for (uint32_t k = 0; k < columns[i].width; k++, plane++) {
            uint32_t entry = 0;
            size_t used = 0;
            status = put_plane(zstd, planes + (size_t)k * columns[i].count, columns[i].count, level,
                               out + at, out_max - at, &used, &entry, err);
            if (status != SPC_OK)
                goto out;
            store_u32(out + 4 * plane, entry);
            at += used;
        }
    }
    *out_bytes = at;
out:
    ZSTD_freeCCtx(zstd);
    free(planes);
    return status;
}

static bool get_plane(ZSTD_DCtx *zstd, const uint8_t *in, uint32_t bytes, uint32_t mode,
                      uint8_t *plane, uint32_t n)
{
    switch (mode) {
    case PLANE_CONSTANT:
        if (bytes != 1)
            return false;
        memset(plane, in[0], n);
        return true;
    case PLANE_PLAIN:
        if (bytes != n)
            return false;
        memcpy(plane, in, n);
        return true;
    case PLANE_ZSTD:
        return ZSTD_decompressDCtx(zstd, plane, n, in, bytes) == n;
    default:
        return false;
    }
}

enum spc_status spc_planes_decode(const struct spc_block *b, const struct spc_block_layout *l,
                                  uint32_t normal_clusters, const uint8_t *in, size_t in_bytes,
                                  uint8_t *payload, struct spc_error *err)
{
    struct column columns[COLUMNS_MAX];
    const int n = list_columns(b, l, normal_clusters, columns);
    const uint32_t plane_total = plane_count(columns, n);
    uint64_t at = 4 * (uint64_t)plane_total;
    uint32_t plane = 0;
    enum spc_status status = SPC_OK;
    if (at > in_bytes)
        return spc_fail(err, SPC_CORRUPT, b->off, "block ends inside its table of planes");
    uint8_t *planes = malloc((size_t)longest(columns, n) * WIDTH_MAX);
    ZSTD_DCtx *zstd = ZSTD_createDCtx();
    if (planes == NULL || zstd == NULL) {
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to decompress a block");
        goto out;
    }
    memset(payload, 0, l->bytes);
    for (int i = 0; i < n; i++) {
        for (uint32_t k = 0; k < columns[i].width; k++, plane++) {
            const uint32_t entry = load_u32(in + 4 * plane);
            const uint32_t bytes = entry & (((uint32_t)1 << PLANE_MODE_SHIFT) - 1);
            if (!range_fits(at, bytes, in_bytes) ||
                !get_plane(zstd, in + at, bytes, entry >> PLANE_MODE_SHIFT,
                           planes + (size_t)k * columns[i].count, columns[i].count)) {
                status = spc_fail(err, SPC_CORRUPT, b->off, "plane %u of the block is broken",
                                  plane);
                goto out;
            }
            at += bytes;
        }
        join(planes, &columns[i], payload);
    }
    if (at != in_bytes)
        status = spc_fail(err, SPC_CORRUPT, b->off, "bytes are left over behind the last plane");
out:
    ZSTD_freeDCtx(zstd);
    free(planes);
    return status;
}
