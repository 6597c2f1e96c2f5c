/*
 * block.c - payloads of blocks: their arrays, their checks, and single nodes and vertices
 * (spec section 6).
 */
#include "format_int.h"

#include "bytes.h"
#include "columns.h"

#include <math.h>
#include <xxhash.h>

/* ---- layout ------------------------------------------------------------------------------------ */

static uint32_t place(uint64_t *at, uint64_t bytes)
{
    const uint64_t off = *at;
    *at = align_up(off + bytes, SPC_ARRAY_ALIGN);
    return (uint32_t)off;
}

/* Within the limits the largest payload is below 65535 x 64 bytes: nothing here can wrap. */
bool spc_block_layout(const struct spc_block *b, uint32_t flags, uint32_t normal_clusters,
                      struct spc_block_layout *out)
{
    const uint64_t n = b->node_count;
    const uint64_t v = b->vertex_count;
    uint64_t at = 0;
    *out = (struct spc_block_layout){0};
    if (n > SPC_BLOCK_NODES_MAX || v > SPC_BLOCK_VERTICES_MAX ||
        normal_clusters > SPC_NORMAL_CLUSTERS_MAX || b->vertex_width > 8)
        return false;
    out->nodes = place(&at, n * SPC_NODE_BYTES);
    if (flags & SPC_FLAG_COLORS)
        out->colors = place(&at, n * 4);
    out->groups = place(&at, (uint64_t)normal_clusters * 4);
    if (b->kind == SPC_BLOCK_INNER) {
        out->children = place(&at, (n + 1) / 2);
    } else if (flags & SPC_FLAG_TRIANGLES) {
        out->indices = place(&at, n * 6);
        out->vertex_base = place(&at, 24);
        out->vertices = place(&at, v * 3 * b->vertex_width);
        if (flags & SPC_FLAG_COLORS)
            out->vertex_colors = place(&at, v * 4);
    }
    out->bytes = (uint32_t)at;
    return true;
}

uint64_t spc_block_chunk_bytes(const struct spc_block *b)
{
    return align_up((uint64_t)CH_SIZE + b->stored_bytes, SPC_CHUNK_ALIGN);
}

/* ---- checks ------------------------------------------------------------------------------------ */

bool spc_record_ok(const uint8_t *p)
{
    const uint16_t e_self = load_u16(p + ND_E_SELF);
    const uint16_t e_parent = load_u16(p + ND_E_PARENT);
    if (!spc_normal_valid(load_u16(p + ND_NORMAL)) || !spc_len_valid(e_self) ||
        !spc_len_valid(load_u16(p + ND_RADIUS)))
        return false;
    return e_parent == SPC_LEN_ROOT || (spc_len_valid(e_parent) && e_self <= e_parent);
}

static bool padding_ok(const uint8_t *payload, uint64_t end)
{
    return all_zero(payload + end, align_up(end, SPC_ARRAY_ALIGN) - end);
}

static bool children_ok(const uint8_t *nibbles, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++)
        if ((nibbles[i / 2] >> 4 * (i & 1) & 15) > 12)
            return false;
    return (n & 1) == 0 || nibbles[n / 2] >> 4 == 0;
}

static bool indices_ok(const uint8_t *indices, uint32_t corners, uint32_t vertex_count)
{
    uint32_t largest = 0;
    for (uint32_t i = 0; i < corners; i++) {
        const uint32_t v = load_u16(indices + 2 * i);
        largest = v > largest ? v : largest;
    }
    return largest < vertex_count;
}

/* Coordinates of the lattice stay far from overflow, and exact in a double. */
static bool vertex_base_ok(const uint8_t *p)
{
    for (int a = 0; a < 3; a++) {
        const int64_t base = (int64_t)load_u64(p + 8 * a);
        if (base < -((int64_t)1 << 53) || base > (int64_t)1 << 53)
            return false;
    }
    return true;
}

/* Every vertex is a lattice number that a double holds. Near the limit each one is looked at. */
static bool vertices_ok(const uint8_t *base, const uint8_t *p, uint32_t count, uint32_t width)
{
    const int64_t limit = (int64_t)1 << 53;
    for (uint32_t a = 0; a < 3; a++) {
        const uint64_t room = (uint64_t)(limit - (int64_t)load_u64(base + 8 * a));
        if (width < 8 && room >> 8 * width != 0)
            continue;
        for (uint32_t i = 0; i < count; i++) {
            const uint8_t *at = p + (size_t)width * (3 * i + a);
            if ((width == 2 ? load_u16(at) : width == 4 ? load_u32(at) : load_u64(at)) > room)
                return false;
        }
    }
    return true;
}

static bool triangles_ok(const struct spc_block *b, const struct spc_block_layout *l,
                         const uint8_t *payload)
{
    const uint32_t n = b->node_count;
    const uint64_t vertex_bytes = (uint64_t)b->vertex_count * 3 * b->vertex_width;
    if (!indices_ok(payload + l->indices, 3 * n, b->vertex_count) ||
        !padding_ok(payload, l->indices + (uint64_t)n * 6) ||
        !vertex_base_ok(payload + l->vertex_base) || !padding_ok(payload, l->vertex_base + 24) ||
        !padding_ok(payload, l->vertices + vertex_bytes))
        return false;
    if (!vertices_ok(payload + l->vertex_base, payload + l->vertices, b->vertex_count,
                     b->vertex_width))
        return false;
    return l->vertex_colors == 0 ||
           padding_ok(payload, l->vertex_colors + (uint64_t)b->vertex_count * 4);
}

static bool groups_ok(const uint8_t *groups, uint32_t normal_clusters, uint32_t n)
{
    uint32_t sum = 0;
    for (uint32_t k = 0; k < normal_clusters; k++) {
        const int16_t cosine = (int16_t)load_u16(groups + 4 * k + 2);
        if (cosine == INT16_MIN)
            return false;
        sum += load_u16(groups + 4 * k);
    }
    return sum == n;
}

enum spc_status spc_payload_check(const struct spc_block *b, const struct spc_block_layout *l,
                                  uint32_t normal_clusters, const uint8_t *payload,
                                  struct spc_error *err)
{
    const uint32_t n = b->node_count;
    for (uint32_t i = 0; i < n; i++)
        if (!spc_record_ok(payload + l->nodes + (size_t)SPC_NODE_BYTES * i))
            return spc_fail(err, SPC_CORRUPT, b->off, "node %u of the block holds invalid codes", i);
    if (!groups_ok(payload + l->groups, normal_clusters, n) ||
        !padding_ok(payload, l->groups + 4 * (uint64_t)normal_clusters))
        return spc_fail(err, SPC_CORRUPT, b->off, "normal clusters do not add up to the block");
    if (l->colors != 0 && !padding_ok(payload, l->colors + 4 * (uint64_t)n))
        return spc_fail(err, SPC_CORRUPT, b->off, "padding of the block is not zero");
    if (l->children != 0 && (!children_ok(payload + l->children, n) ||
                             !padding_ok(payload, l->children + (n + 1) / 2)))
        return spc_fail(err, SPC_CORRUPT, b->off, "children counts of the block are invalid");
    if (l->indices != 0 && !triangles_ok(b, l, payload))
        return spc_fail(err, SPC_CORRUPT, b->off, "triangles of the block are invalid");
    return SPC_OK;
}

/* ---- decode and encode ------------------------------------------------------------------------- */

static enum spc_status decode_payload(const struct spc_block *b, const struct spc_frame *frame,
                                      const struct spc_block_layout *layout, const uint8_t *stored,
                                      uint8_t *out, struct spc_error *err)
{
    enum spc_status status = SPC_OK;
    if (b->codec == SPC_CODEC_RAW)
        memcpy(out, stored, layout->bytes);
    else
        status = columns_decode(b, layout, frame, stored, b->stored_bytes, out, err);
    return status == SPC_OK
        ? spc_payload_check(b, layout, frame->normal_clusters, out, err) : status;
}

enum spc_status spc_block_decode(const struct spc_reader *r, uint32_t index, bool check, void *out,
                                 struct spc_error *err)
{
    struct spc_block b;
    struct spc_block_layout layout;
    uint8_t chunk[CH_SIZE];
    spc_reader_block(r, index, &b);
    if (!spc_block_layout(&b, r->header.flags, r->header.normal_clusters, &layout))
        return spc_fail(err, SPC_LIMIT, b.off, "block %u is over the limits", index);
    const uint8_t *at = r->bytes + b.off;
    const struct spc_frame frame = spc_reader_frame(r, b.cluster);
    if (check) {
        if (spc_chunk_hash(at, spc_block_chunk_bytes(&b)) != b.hash)
            return spc_fail(err, SPC_CHECKSUM, b.off, "checksum of block %u does not match", index);
        spc_chunk_encode(&b, &frame, chunk);
        if (memcmp(chunk, at, CH_SIZE) != 0)
            return spc_fail(err, SPC_CORRUPT, b.off, "header of block %u is not the directory's",
                            index);
        const uint64_t end = (uint64_t)CH_SIZE + b.stored_bytes;
        if (!all_zero(at + end, spc_block_chunk_bytes(&b) - end))
            return spc_fail(err, SPC_CORRUPT, b.off, "padding behind block %u is not zero", index);
    }
    return decode_payload(&b, &frame, &layout, at + CH_SIZE, out, err);
}

bool spc_chunk_find(const uint8_t *bytes, uint64_t size, uint64_t *at, struct spc_block *b,
                    struct spc_frame *frame)
{
    struct spc_block_layout layout;
    for (*at = align_up(*at, SPC_CHUNK_ALIGN); range_fits(*at, CH_SIZE, size);
         *at += SPC_CHUNK_ALIGN) {
        if (load_u32(bytes + *at + CH_MAGIC) != CH_MAGIC_VALUE)
            continue;
        spc_chunk_parse(bytes + *at, *at, b, frame);
        if (range_fits(*at, spc_block_chunk_bytes(b), size) && b->kind <= SPC_BLOCK_LEAF &&
            b->codec <= SPC_CODEC_ZSTD && b->node_count > 0 && frame->normal_clusters > 0 &&
            spc_exponents_ok(b, frame) &&
            spc_block_ok(b, frame->flags, frame->normal_clusters, &layout) &&
            spc_chunk_hash(bytes + *at, spc_block_chunk_bytes(b)) == b->hash) {
            b->raw_bytes = layout.bytes;
            return true;
        }
    }
    return false;
}

enum spc_status spc_chunk_decode(const uint8_t *bytes, const struct spc_block *b,
                                 const struct spc_frame *frame, void *out, struct spc_error *err)
{
    struct spc_block_layout layout;
    if (!spc_block_layout(b, frame->flags, frame->normal_clusters, &layout))
        return spc_fail(err, SPC_LIMIT, b->off, "a block is over the limits");
    return decode_payload(b, frame, &layout, bytes + b->off + CH_SIZE, out, err);
}

/* Room for the table of planes and for the few bytes by which zstd may grow each of them. */
size_t spc_block_stored_bound(uint32_t raw_bytes)
{
    return (size_t)raw_bytes + raw_bytes / 128 + 65536;
}

enum spc_status spc_block_encode(struct spc_block *b, const struct spc_block_layout *layout,
                                 const struct spc_frame *frame, const struct spc_family *families,
                                 uint32_t family_count, const uint8_t *payload,
                                 struct spc_encoder *encoder, uint8_t *stored,
                                 struct spc_error *err)
{
    size_t bytes = layout->bytes;
    if (b->codec == SPC_CODEC_RAW) {
        memcpy(stored, payload, bytes);
    } else {
        const enum spc_status status =
            columns_encode(b, layout, frame, families, family_count, payload, encoder, stored,
                           spc_block_stored_bound(layout->bytes), &bytes, err);
        if (status != SPC_OK)
            return status;
    }
    b->stored_bytes = (uint32_t)bytes;
    return SPC_OK;
}

/* ---- nodes and vertices ------------------------------------------------------------------------ */

static void decode_record(const uint8_t *p, const double origin[3], int step_exp, int link_base,
                          struct spc_node *out)
{
    for (int a = 0; a < 3; a++)
        out->center[a] = origin[a] + ldexp(load_u16(p + ND_X + 2 * a), step_exp);
    out->normal_code = load_u16(p + ND_NORMAL);
    spc_normal_decode(out->normal_code, out->normal);
    out->e_self = load_u16(p + ND_E_SELF);
    out->e_parent = load_u16(p + ND_E_PARENT);
    out->radius = (double)spc_len_decode(load_u16(p + ND_RADIUS));
    out->height = out->radius * (p[ND_HEIGHT] + 1) / 256;
    out->link = (double)spc_link_decode(p[ND_LINK], link_base);
}

void spc_node_decode(const struct spc_reader *r, const struct spc_block *b,
                     const struct spc_block_layout *l, const uint8_t *payload, uint32_t i,
                     struct spc_node *out)
{
    static const uint8_t white[4] = {255, 255, 255, 255};
    const uint8_t *origin =
        r->head + r->sections[SE_CLUS].off + (uint64_t)b->cluster * CL_SIZE + CL_ORIGIN;
    const double o[3] = {load_f64(origin), load_f64(origin + 8), load_f64(origin + 16)};
    decode_record(payload + l->nodes + (size_t)SPC_NODE_BYTES * i, o, b->step_exp, b->link_base,
                  out);
    memcpy(out->rgba, l->colors ? payload + l->colors + 4 * (size_t)i : white, 4);
}

void spc_top_decode(const struct spc_reader *r, const struct spc_cluster *c, uint32_t i,
                    struct spc_node *out)
{
    (void)r;
    decode_record(c->tops[i].record, c->origin, c->tops[i].step_exp, c->tops[i].link_base, out);
    memcpy(out->rgba, c->tops[i].rgba, 4);
}

void spc_vertex_at(const struct spc_block *b, const struct spc_frame *frame,
                   const struct spc_block_layout *l, const uint8_t *payload, uint32_t i,
                   double xyz[3], uint8_t rgba[4])
{
    const uint8_t *base = payload + l->vertex_base;
    const uint8_t *p = payload + l->vertices + (size_t)3 * b->vertex_width * i;
    for (int a = 0; a < 3; a++, p += b->vertex_width) {
        const uint64_t off = b->vertex_width == 2 ? load_u16(p)
                             : b->vertex_width == 4 ? load_u32(p) : load_u64(p);
        const int64_t lattice = (int64_t)load_u64(base + 8 * a) + (int64_t)off;
        xyz[a] = ldexp((double)lattice, frame->vertex_exp);
    }
    if (rgba != NULL && l->vertex_colors != 0)
        memcpy(rgba, payload + l->vertex_colors + 4 * (size_t)i, 4);
    else if (rgba != NULL)
        memset(rgba, 255, 4);
}

void spc_vertex_decode(const struct spc_reader *r, const struct spc_block *b,
                       const struct spc_block_layout *l, const uint8_t *payload, uint32_t i,
                       double xyz[3], uint8_t rgba[4])
{
    const struct spc_frame frame = {.vertex_exp = r->header.vertex_exp};
    spc_vertex_at(b, &frame, l, payload, i, xyz, rgba);
}
