/*
 * header.c - the file header and its section table (spec sections 2 and 3).
 */
#include "format_int.h"

#include "bytes.h"

#include <math.h>
#include <xxhash.h>

static const uint32_t TAGS[SE_COUNT] = {SE_TAG_AXES, SE_TAG_CLUS, SE_TAG_BLKS, SE_TAG_META};
static const uint32_t RECORDS[SE_COUNT] = {6, CL_SIZE, BL_SIZE, 1};
static const uint32_t KNOWN_FLAGS =
    SPC_FLAG_TRIANGLES | SPC_FLAG_COLORS | SPC_FLAG_CULL_BACK | SPC_FLAG_ERROR_PAPER;

void spc_header_encode(const struct spc_header *h, const struct spc_section sections[SE_COUNT],
                       uint8_t *out)
{
    memset(out, 0, HD_SIZE);
    memcpy(out + HD_MAGIC, SPC_MAGIC, HD_MAGIC_LEN);
    store_u16(out + HD_VERSION, SPC_VERSION_DEVELOPMENT);
    store_u16(out + HD_BYTES, HD_SIZE);
    store_u32(out + HD_FLAGS, h->flags);
    memcpy(out + HD_ID, h->id, HD_ID_LEN);
    store_u64(out + HD_FILE_BYTES, h->file_bytes);
    store_u64(out + HD_HEAD_BYTES, h->head_bytes);
    store_u64(out + HD_NODE_COUNT, h->node_count);
    store_u64(out + HD_LEAF_COUNT, h->leaf_count);
    store_u64(out + HD_TRIANGLE_COUNT, h->triangle_count);
    store_u64(out + HD_VERTEX_COUNT, h->vertex_count);
    store_u32(out + HD_CLUSTER_COUNT, h->cluster_count);
    store_u32(out + HD_BLOCK_COUNT, h->block_count);
    store_u32(out + HD_CLUSTER_NODES, h->cluster_nodes);
    store_u32(out + HD_BLOCK_NODES, h->block_nodes);
    store_u32(out + HD_NORMAL_CLUSTERS, h->normal_clusters);
    store_u32(out + HD_HEIGHT, h->height);
    store_u32(out + HD_UNIT_EXP, (uint32_t)h->unit_exp);
    store_u32(out + HD_VERTEX_EXP, (uint32_t)h->vertex_exp);
    for (int a = 0; a < 3; a++) {
        store_f64(out + HD_BOX + 8 * a, h->box_min[a]);
        store_f64(out + HD_BOX + 24 + 8 * a, h->box_max[a]);
    }
    store_u64(out + HD_FACES_IN, h->faces_in);
    store_u64(out + HD_SPLIT_EXTRA, h->split_extra);
    store_u64(out + HD_POINTS_IN, h->points_in);
    store_u64(out + HD_DROPPED_BAD_INDEX, h->dropped_bad_index);
    store_u64(out + HD_DROPPED_NON_FINITE, h->dropped_non_finite);
    store_u64(out + HD_DROPPED_DEGENERATE, h->dropped_degenerate);
    store_f32(out + HD_E_MIN, h->e_min);
    store_f32(out + HD_E_MAX, h->e_max);
    for (int s = 0; s < SE_COUNT; s++) {
        uint8_t *p = out + HD_SECTIONS + SE_SIZE * s;
        store_u32(p + SE_TAG, TAGS[s]);
        store_u32(p + SE_RECORD_BYTES, RECORDS[s]);
        store_u64(p + SE_OFF, sections[s].off);
        store_u64(p + SE_BYTES, sections[s].bytes);
        store_u64(p + SE_HASH, sections[s].hash);
    }
    store_u64(out + HD_HASH, XXH64(out, HD_HASH, 0));
}

static void load_fields(const uint8_t *in, struct spc_header *h)
{
    h->flags = load_u32(in + HD_FLAGS);
    memcpy(h->id, in + HD_ID, HD_ID_LEN);
    h->file_bytes = load_u64(in + HD_FILE_BYTES);
    h->head_bytes = load_u64(in + HD_HEAD_BYTES);
    h->node_count = load_u64(in + HD_NODE_COUNT);
    h->leaf_count = load_u64(in + HD_LEAF_COUNT);
    h->triangle_count = load_u64(in + HD_TRIANGLE_COUNT);
    h->vertex_count = load_u64(in + HD_VERTEX_COUNT);
    h->cluster_count = load_u32(in + HD_CLUSTER_COUNT);
    h->block_count = load_u32(in + HD_BLOCK_COUNT);
    h->cluster_nodes = load_u32(in + HD_CLUSTER_NODES);
    h->block_nodes = load_u32(in + HD_BLOCK_NODES);
    h->normal_clusters = load_u32(in + HD_NORMAL_CLUSTERS);
    h->height = load_u32(in + HD_HEIGHT);
    h->unit_exp = (int32_t)load_u32(in + HD_UNIT_EXP);
    h->vertex_exp = (int32_t)load_u32(in + HD_VERTEX_EXP);
    for (int a = 0; a < 3; a++) {
        h->box_min[a] = load_f64(in + HD_BOX + 8 * a);
        h->box_max[a] = load_f64(in + HD_BOX + 24 + 8 * a);
    }
    h->faces_in = load_u64(in + HD_FACES_IN);
    h->split_extra = load_u64(in + HD_SPLIT_EXTRA);
    h->points_in = load_u64(in + HD_POINTS_IN);
    h->dropped_bad_index = load_u64(in + HD_DROPPED_BAD_INDEX);
    h->dropped_non_finite = load_u64(in + HD_DROPPED_NON_FINITE);
    h->dropped_degenerate = load_u64(in + HD_DROPPED_DEGENERATE);
    h->e_min = load_f32(in + HD_E_MIN);
    h->e_max = load_f32(in + HD_E_MAX);
}

bool spc_units_ok(int32_t unit, int32_t vertex)
{
    return unit >= SPC_EXP_MIN && unit <= SPC_EXP_MAX && vertex >= SPC_EXP_MIN &&
           vertex <= SPC_EXP_MAX && vertex - unit >= -SPC_EXP_SPAN && vertex - unit <= SPC_EXP_SPAN;
}

static enum spc_status check_limits(const struct spc_header *h, struct spc_error *err)
{
    if (h->cluster_count > SPC_CLUSTERS_MAX)
        return spc_fail(err, SPC_LIMIT, HD_CLUSTER_COUNT, "%u clusters are over the limit of %u",
                        h->cluster_count, SPC_CLUSTERS_MAX);
    if (h->block_count > SPC_BLOCKS_MAX)
        return spc_fail(err, SPC_LIMIT, HD_BLOCK_COUNT, "%u blocks are over the limit of %u",
                        h->block_count, SPC_BLOCKS_MAX);
    if (h->normal_clusters < 1 || h->normal_clusters > SPC_NORMAL_CLUSTERS_MAX)
        return spc_fail(err, SPC_LIMIT, HD_NORMAL_CLUSTERS, "%u normal clusters are not 1 to %u",
                        h->normal_clusters, SPC_NORMAL_CLUSTERS_MAX);
    if (h->block_nodes < 1 || h->block_nodes > SPC_BLOCK_NODES_MAX || h->cluster_nodes < 1 ||
        h->cluster_nodes > SPC_CLUSTER_NODES_MAX)
        return spc_fail(err, SPC_LIMIT, HD_CLUSTER_NODES, "cluster or block size over the limit");
    if (!spc_units_ok(h->unit_exp, h->vertex_exp))
        return spc_fail(err, SPC_LIMIT, HD_UNIT_EXP, "unit or lattice exponent out of range");
    return SPC_OK;
}

/* faces_in + split_extra + points_in = leaves + dropped, without wrapping (I11) */
static bool counts_reconcile(const struct spc_header *h)
{
    const unsigned __int128 in = (unsigned __int128)h->faces_in + h->split_extra + h->points_in;
    const unsigned __int128 out = (unsigned __int128)h->leaf_count + h->dropped_bad_index +
                                  h->dropped_non_finite + h->dropped_degenerate;
    return in == out;
}

static enum spc_status check_values(const struct spc_header *h, struct spc_error *err)
{
    enum spc_status status = check_limits(h, err);
    if (status != SPC_OK)
        return status;
    if (h->cluster_count == 0 || h->block_count == 0 || h->leaf_count == 0 ||
        h->leaf_count > h->node_count || h->height < 1 || h->height > SPC_HEIGHT_MAX)
        return spc_fail(err, SPC_CORRUPT, HD_NODE_COUNT, "header counts contradict each other");
    const bool hybrid = (h->flags & SPC_FLAG_TRIANGLES) != 0;
    if (h->triangle_count != (hybrid ? h->leaf_count : 0) || (!hybrid && h->vertex_count != 0))
        return spc_fail(err, SPC_CORRUPT, HD_TRIANGLE_COUNT,
                        "triangle and vertex counts contradict the flags");
    for (int a = 0; a < 3; a++)
        if (!isfinite(h->box_min[a]) || !isfinite(h->box_max[a]) || h->box_min[a] > h->box_max[a])
            return spc_fail(err, SPC_CORRUPT, HD_BOX, "box is not a box");
    if (!counts_reconcile(h))
        return spc_fail(err, SPC_CORRUPT, HD_FACES_IN,
                        "faces read do not add up to leaves and dropped faces");
    if (!(h->e_min >= 0 && h->e_min <= h->e_max && isfinite(h->e_max)))
        return spc_fail(err, SPC_CORRUPT, HD_E_MIN, "error range is not a range");
    return SPC_OK;
}

/* The first four are these; any behind them are optional and have names of their own. */
static bool is_section(const struct spc_section *se, int s)
{
    if (s < SE_COUNT)
        return se->tag == TAGS[s] && se->record_bytes == RECORDS[s];
    for (int k = 0; k < SE_COUNT; k++)
        if (se->tag == TAGS[k])
            return false;
    return se->record_bytes > 0 && se->bytes % se->record_bytes == 0;
}

/* Sections lie one after another behind the header; what is between them is checked at open. */
static enum spc_status check_sections(const struct spc_header *h, const uint8_t *in,
                                      struct spc_section sections[SE_SLOTS], struct spc_error *err)
{
    const uint64_t counts[SE_COUNT] = {h->normal_clusters, h->cluster_count, h->block_count, 0};
    uint64_t at = HD_SIZE, end = HD_SIZE;
    for (int s = 0; s < SE_SLOTS; s++) {
        const uint64_t field = (uint64_t)(HD_SECTIONS + SE_SIZE * s);
        const uint8_t *p = in + field;
        struct spc_section *se = &sections[s];
        *se = (struct spc_section){load_u32(p + SE_TAG), load_u32(p + SE_RECORD_BYTES),
                                   load_u64(p + SE_OFF), load_u64(p + SE_BYTES),
                                   load_u64(p + SE_HASH)};
        if (s >= SE_COUNT && se->tag == 0) {
            if (!all_zero(p, (uint64_t)SE_SIZE * (uint64_t)(SE_SLOTS - s)))
                return spc_fail(err, SPC_CORRUPT, field, "an unused section record is not zero");
            break;
        }
        if (!is_section(se, s))
            return spc_fail(err, SPC_CORRUPT, field, "section %d is not the one that belongs there",
                            s);
        if (se->off != at || !range_fits(se->off, se->bytes, h->head_bytes))
            return spc_fail(err, SPC_CORRUPT, field, "section %d lies outside the head", s);
        if (s < SE_META && se->bytes != counts[s] * RECORDS[s])
            return spc_fail(err, SPC_CORRUPT, field, "section %d has the wrong size", s);
        end = se->off + se->bytes;
        at = align_up(end, SPC_CHUNK_ALIGN);
    }
    if (sections[SE_META].bytes > SPC_META_BYTES_MAX)
        return spc_fail(err, SPC_LIMIT, HD_SECTIONS, "metadata is over the limit");
    if (h->head_bytes != end)
        return spc_fail(err, SPC_CORRUPT, HD_HEAD_BYTES, "head does not end with its last section");
    return SPC_OK;
}

enum spc_status spc_header_decode(const uint8_t *in, uint64_t size, struct spc_header *out,
                                  struct spc_section sections[SE_SLOTS], struct spc_error *err)
{
    const uint64_t magic_bytes = size < HD_MAGIC_LEN ? size : HD_MAGIC_LEN;
    if (size == 0 || memcmp(in, SPC_MAGIC, magic_bytes) != 0)
        return spc_fail(err, SPC_NOT_SPC, 0, "the file does not begin like an .spc archive");
    if (size < HD_SIZE)
        return spc_fail(err, SPC_TRUNCATED, size, "the file ends inside its header");
    const uint16_t version = load_u16(in + HD_VERSION);
    if (version != SPC_VERSION_DEVELOPMENT)
        return spc_fail(err, SPC_VERSION, HD_VERSION,
                        "format version %u; this program reads the development version %u",
                        version, SPC_VERSION_DEVELOPMENT);
    if (load_u64(in + HD_HASH) != XXH64(in, HD_HASH, 0))
        return spc_fail(err, SPC_CHECKSUM, HD_HASH, "header checksum does not match");
    if (load_u32(in + HD_RESERVED_BITS) != 0 || (load_u32(in + HD_FLAGS) & ~KNOWN_FLAGS) != 0)
        return spc_fail(err, SPC_FEATURE, HD_RESERVED_BITS, "unknown feature bits are set");
    load_fields(in, out);
    if (size < out->file_bytes)
        return spc_fail(err, SPC_TRUNCATED, size, "the file ends at byte %llu of %llu",
                        (unsigned long long)size, (unsigned long long)out->file_bytes);
    if (size > out->file_bytes)
        return spc_fail(err, SPC_CORRUPT, out->file_bytes, "%llu bytes lie behind the archive",
                        (unsigned long long)(size - out->file_bytes));
    if (load_u16(in + HD_BYTES) != HD_SIZE || !all_zero(in + HD_ZERO, HD_ZERO_LEN) ||
        out->head_bytes > out->file_bytes)
        return spc_fail(err, SPC_CORRUPT, HD_BYTES, "header size or padding is wrong");
    const enum spc_status status = check_values(out, err);
    if (status != SPC_OK)
        return status;
    return check_sections(out, in, sections, err);
}
