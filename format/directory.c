/*
 * directory.c - cluster and block records, and the checks that make them safe to trust
 * (spec section 4).
 */
#include "format_int.h"

#include "bytes.h"

#include <math.h>
#include <xxhash.h>

static void store_floats(uint8_t *p, const float *v, int n)
{
    for (int i = 0; i < n; i++)
        store_f32(p + 4 * i, v[i]);
}

static void load_floats(const uint8_t *p, float *v, int n)
{
    for (int i = 0; i < n; i++)
        v[i] = load_f32(p + 4 * i);
}

void spc_cluster_encode(const struct spc_cluster *c, uint8_t *out)
{
    uint32_t leaf_bits = 0;
    memset(out, 0, CL_SIZE);
    store_u32(out + CL_PARENT, c->parent);
    store_u32(out + CL_CHILD_FIRST, c->child_first);
    store_u32(out + CL_CHILD_COUNT, c->child_count);
    store_u16(out + CL_LEVEL, (uint16_t)c->level);
    out[CL_TOP_COUNT] = (uint8_t)c->top_count;
    store_u32(out + CL_INNER_COUNT, c->inner_count);
    store_u32(out + CL_LEAF_COUNT, c->leaf_count);
    store_u32(out + CL_BLOCK_FIRST, c->block_first);
    store_u32(out + CL_BLOCK_COUNT, c->block_count);
    store_u64(out + CL_DATA_OFF, c->data_off);
    store_u64(out + CL_DATA_BYTES, c->data_bytes);
    store_u64(out + CL_LEAVES_BELOW, c->leaves_below);
    for (int a = 0; a < 3; a++)
        store_f64(out + CL_ORIGIN + 8 * a, c->origin[a]);
    store_floats(out + CL_BOX, c->box, 6);
    store_floats(out + CL_SUB_BOX, c->sub_box, 6);
    store_floats(out + CL_SPHERE, c->sphere, 4);
    store_floats(out + CL_SUB_SPHERE, c->sub_sphere, 4);
    store_f32(out + CL_E_SELF_MIN, c->e_self_min);
    store_f32(out + CL_E_SELF_MAX, c->e_self_max);
    store_f32(out + CL_E_PARENT_MIN, c->e_parent_min);
    store_f32(out + CL_E_PARENT_MAX, c->e_parent_max);
    store_f32(out + CL_RADIUS_MIN, c->radius_min);
    store_f32(out + CL_RADIUS_MAX, c->radius_max);
    store_f32(out + CL_SUB_RADIUS_MAX, c->sub_radius_max);
    store_f32(out + CL_LINK_MAX, c->link_max);
    store_f32(out + CL_SUB_LINK_MAX, c->sub_link_max);
    store_floats(out + CL_CONE, c->cone, 4);
    for (uint32_t t = 0; t < c->top_count; t++) {
        uint8_t *p = out + CL_TOPS + TP_SIZE * t;
        memcpy(p + TP_NODE, c->tops[t].record, TP_NODE_LEN);
        memcpy(p + TP_RGBA, c->tops[t].rgba, TP_RGBA_LEN);
        store_u16(p + TP_STEP_EXP, (uint16_t)c->tops[t].step_exp);
        store_u16(p + TP_LINK_BASE, (uint16_t)c->tops[t].link_base);
        leaf_bits |= (uint32_t)c->tops_are_leaf[t] << t;
    }
    out[CL_TOP_LEAF_BITS] = (uint8_t)leaf_bits;
}

void spc_cluster_decode(const uint8_t *in, struct spc_cluster *c)
{
    c->parent = load_u32(in + CL_PARENT);
    c->child_first = load_u32(in + CL_CHILD_FIRST);
    c->child_count = load_u32(in + CL_CHILD_COUNT);
    c->level = load_u16(in + CL_LEVEL);
    c->top_count = in[CL_TOP_COUNT];
    c->inner_count = load_u32(in + CL_INNER_COUNT);
    c->leaf_count = load_u32(in + CL_LEAF_COUNT);
    c->block_first = load_u32(in + CL_BLOCK_FIRST);
    c->block_count = load_u32(in + CL_BLOCK_COUNT);
    c->data_off = load_u64(in + CL_DATA_OFF);
    c->data_bytes = load_u64(in + CL_DATA_BYTES);
    c->leaves_below = load_u64(in + CL_LEAVES_BELOW);
    for (int a = 0; a < 3; a++)
        c->origin[a] = load_f64(in + CL_ORIGIN + 8 * a);
    load_floats(in + CL_BOX, c->box, 6);
    load_floats(in + CL_SUB_BOX, c->sub_box, 6);
    load_floats(in + CL_SPHERE, c->sphere, 4);
    load_floats(in + CL_SUB_SPHERE, c->sub_sphere, 4);
    c->e_self_min = load_f32(in + CL_E_SELF_MIN);
    c->e_self_max = load_f32(in + CL_E_SELF_MAX);
    c->e_parent_min = load_f32(in + CL_E_PARENT_MIN);
    c->e_parent_max = load_f32(in + CL_E_PARENT_MAX);
    c->radius_min = load_f32(in + CL_RADIUS_MIN);
    c->radius_max = load_f32(in + CL_RADIUS_MAX);
    c->sub_radius_max = load_f32(in + CL_SUB_RADIUS_MAX);
    c->link_max = load_f32(in + CL_LINK_MAX);
    c->sub_link_max = load_f32(in + CL_SUB_LINK_MAX);
    load_floats(in + CL_CONE, c->cone, 4);
    for (uint32_t t = 0; t < SPC_TOPS_MAX; t++) {
        const uint8_t *p = in + CL_TOPS + TP_SIZE * t;
        memcpy(c->tops[t].record, p + TP_NODE, TP_NODE_LEN);
        memcpy(c->tops[t].rgba, p + TP_RGBA, TP_RGBA_LEN);
        c->tops[t].step_exp = (int16_t)load_u16(p + TP_STEP_EXP);
        c->tops[t].link_base = (int16_t)load_u16(p + TP_LINK_BASE);
        c->tops_are_leaf[t] = (in[CL_TOP_LEAF_BITS] >> t & 1) != 0;
    }
}

void spc_block_record_encode(const struct spc_block *b, uint8_t *out)
{
    store_u64(out + BL_OFF, b->off);
    store_u32(out + BL_STORED_BYTES, b->stored_bytes);
    store_f32(out + BL_DIAGONAL, b->diagonal);
    store_u32(out + BL_NODE_COUNT, b->node_count);
    store_u32(out + BL_VERTEX_COUNT, b->vertex_count);
    store_u32(out + BL_CLUSTER, b->cluster);
    out[BL_KIND] = (uint8_t)b->kind;
    out[BL_CODEC] = (uint8_t)b->codec;
    out[BL_VERTEX_WIDTH] = (uint8_t)b->vertex_width;
    out[BL_ZERO] = 0;
    store_f32(out + BL_E_PARENT_MAX, b->e_parent_max);
    store_f32(out + BL_E_PARENT_MIN, b->e_parent_min);
    store_f32(out + BL_E_SELF_MIN, b->e_self_min);
    store_f32(out + BL_LINK_MAX, b->link_max);
    store_f32(out + BL_RADIUS_MAX, b->radius_max);
    store_u16(out + BL_STEP_EXP, (uint16_t)b->step_exp);
    store_u16(out + BL_LINK_BASE, (uint16_t)b->link_base);
    store_u64(out + BL_HASH, b->hash);
}

void spc_block_record_decode(const uint8_t *in, struct spc_block *b)
{
    b->off = load_u64(in + BL_OFF);
    b->stored_bytes = load_u32(in + BL_STORED_BYTES);
    b->diagonal = load_f32(in + BL_DIAGONAL);
    b->node_count = load_u32(in + BL_NODE_COUNT);
    b->vertex_count = load_u32(in + BL_VERTEX_COUNT);
    b->cluster = load_u32(in + BL_CLUSTER);
    b->kind = (enum spc_block_kind)in[BL_KIND];
    b->codec = (enum spc_codec)in[BL_CODEC];
    b->vertex_width = in[BL_VERTEX_WIDTH];
    b->e_parent_max = load_f32(in + BL_E_PARENT_MAX);
    b->e_parent_min = load_f32(in + BL_E_PARENT_MIN);
    b->e_self_min = load_f32(in + BL_E_SELF_MIN);
    b->link_max = load_f32(in + BL_LINK_MAX);
    b->radius_max = load_f32(in + BL_RADIUS_MAX);
    b->step_exp = (int16_t)load_u16(in + BL_STEP_EXP);
    b->link_base = (int16_t)load_u16(in + BL_LINK_BASE);
    b->hash = load_u64(in + BL_HASH);
}

void spc_chunk_encode(const struct spc_block *b, const struct spc_frame *frame, uint8_t *out)
{
    store_u32(out + CH_MAGIC, CH_MAGIC_VALUE);
    store_u16(out + CH_UNIT_EXP, (uint16_t)frame->unit_exp);
    store_u16(out + CH_VERTEX_EXP, (uint16_t)frame->vertex_exp);
    store_u64(out + CH_HASH, b->hash);
    out[CH_KIND] = (uint8_t)b->kind;
    out[CH_CODEC] = (uint8_t)b->codec;
    out[CH_VERTEX_WIDTH] = (uint8_t)b->vertex_width;
    out[CH_FLAGS] = (uint8_t)frame->flags;
    store_u32(out + CH_NODE_COUNT, b->node_count);
    store_u32(out + CH_VERTEX_COUNT, b->vertex_count);
    store_u32(out + CH_STORED_BYTES, b->stored_bytes);
    store_f32(out + CH_DIAGONAL, b->diagonal);
    store_u16(out + CH_STEP_EXP, (uint16_t)b->step_exp);
    out[CH_LINK_BASE] = (uint8_t)b->link_base;
    out[CH_NORMAL_CLUSTERS] = (uint8_t)frame->normal_clusters;
    for (int a = 0; a < 3; a++)
        store_f64(out + CH_ORIGIN + 8 * a, frame->origin[a]);
}

void spc_chunk_parse(const uint8_t *in, uint64_t off, struct spc_block *b, struct spc_frame *frame)
{
    *b = (struct spc_block){
        .off = off, .hash = load_u64(in + CH_HASH), .cluster = SPC_NONE,
        .kind = (enum spc_block_kind)in[CH_KIND], .codec = (enum spc_codec)in[CH_CODEC],
        .vertex_width = in[CH_VERTEX_WIDTH], .node_count = load_u32(in + CH_NODE_COUNT),
        .vertex_count = load_u32(in + CH_VERTEX_COUNT),
        .stored_bytes = load_u32(in + CH_STORED_BYTES), .diagonal = load_f32(in + CH_DIAGONAL),
        .step_exp = (int16_t)load_u16(in + CH_STEP_EXP), .link_base = (int8_t)in[CH_LINK_BASE],
    };
    *frame = (struct spc_frame){
        .flags = in[CH_FLAGS], .normal_clusters = in[CH_NORMAL_CLUSTERS],
        .unit_exp = (int16_t)load_u16(in + CH_UNIT_EXP),
        .vertex_exp = (int16_t)load_u16(in + CH_VERTEX_EXP),
    };
    for (int a = 0; a < 3; a++)
        frame->origin[a] = load_f64(in + CH_ORIGIN + 8 * a);
}

uint64_t spc_chunk_hash(const uint8_t *chunk, uint64_t chunk_bytes)
{
    return XXH64(chunk + CH_KIND, chunk_bytes - CH_KIND, load_u64(chunk));
}

bool spc_block_ok(const struct spc_block *b, uint32_t flags, uint32_t normal_clusters,
                  struct spc_block_layout *layout)
{
    const bool triangles = b->kind == SPC_BLOCK_LEAF && (flags & SPC_FLAG_TRIANGLES) != 0;
    const bool width_ok = triangles
        ? b->vertex_width == 2 || b->vertex_width == 4 || b->vertex_width == 8
        : b->vertex_width == 0;
    return width_ok && (triangles ? b->vertex_count > 0 : b->vertex_count == 0) &&
           spc_block_layout(b, flags, normal_clusters, layout) && b->diagonal >= 0 &&
           isfinite(b->diagonal) &&
           (b->codec == SPC_CODEC_RAW ? b->stored_bytes == layout->bytes
                                      : b->stored_bytes <= spc_block_stored_bound(layout->bytes));
}

/* ---- checks ------------------------------------------------------------------------------------ */

static bool range_ok(float lo, float hi)    /* 0 <= lo <= hi; hi may be +inf; no NaN */
{
    return lo >= 0 && lo <= hi;
}

static bool box_ok(const float b[6])
{
    for (int a = 0; a < 3; a++)
        if (!(isfinite(b[a]) && isfinite(b[a + 3]) && b[a] <= b[a + 3]))
            return false;
    return true;
}

static bool sphere_ok(const float s[4])
{
    return isfinite(s[0]) && isfinite(s[1]) && isfinite(s[2]) && s[3] >= 0 && isfinite(s[3]);
}

static bool cone_ok(const float c[4])
{
    const double x = (double)c[0], y = (double)c[1], z = (double)c[2];
    return fabs(sqrt(x * x + y * y + z * z) - 1) <= 1e-5 && fabsf(c[3]) <= 1;
}

static bool cluster_values_ok(const struct spc_cluster *c, uint32_t id)
{
    const bool root = id == 0;
    if (c->top_count < 1 || c->top_count > SPC_TOPS_MAX || (!root && c->top_count < 2))
        return false;
    if (!isfinite(c->origin[0]) || !isfinite(c->origin[1]) || !isfinite(c->origin[2]))
        return false;
    if (!box_ok(c->box) || !box_ok(c->sub_box) || !sphere_ok(c->sphere) ||
        !sphere_ok(c->sub_sphere) || !cone_ok(c->cone))
        return false;
    if (!range_ok(c->e_self_min, c->e_self_max) || !isfinite(c->e_self_max) ||
        !range_ok(c->e_parent_min, c->e_parent_max) || isinf(c->e_parent_max) != root)
        return false;
    return range_ok(c->radius_min, c->radius_max) && isfinite(c->sub_radius_max) &&
           range_ok(c->radius_max, c->sub_radius_max) &&
           range_ok(c->link_max, c->sub_link_max) && isfinite(c->sub_link_max);
}

static bool exponents_ok(int32_t step_exp, int32_t link_base, int32_t unit_exp)
{
    return step_exp >= SPC_EXP_MIN && step_exp <= SPC_EXP_MAX && link_base >= -126 &&
           link_base <= 96 && step_exp - unit_exp >= -SPC_EXP_SPAN &&
           step_exp - unit_exp <= SPC_EXP_SPAN;
}

/* No node of a cluster with this origin lies at infinity. */
static bool positions_ok(const double origin[3], int32_t step_exp)
{
    const double far = ldexp(UINT16_MAX, step_exp);
    for (int a = 0; a < 3; a++)
        if (!isfinite(origin[a] + far))
            return false;
    return true;
}

static bool tops_ok(const struct spc_cluster *c, const uint8_t *record, int32_t unit_exp)
{
    if (record[CL_TOP_LEAF_BITS] >> c->top_count != 0 ||
        !all_zero(record + CL_ZERO_1, CL_ZERO_1_LEN) ||
        !all_zero(record + CL_ZERO_2, CL_ZERO_2_LEN) ||
        !all_zero(record + CL_TOPS + TP_SIZE * c->top_count,
                  (uint64_t)TP_SIZE * (SPC_TOPS_MAX - c->top_count)))
        return false;
    for (uint32_t t = 0; t < c->top_count; t++)
        if (!exponents_ok(c->tops[t].step_exp, c->tops[t].link_base, unit_exp) ||
            !positions_ok(c->origin, c->tops[t].step_exp) ||
            !spc_record_ok(c->tops[t].record))
            return false;
    return true;
}

bool spc_exponents_ok(const struct spc_block *b, const struct spc_frame *frame)
{
    return exponents_ok(b->step_exp, b->link_base, frame->unit_exp) &&
           positions_ok(frame->origin, b->step_exp) &&
           spc_units_ok(frame->unit_exp, frame->vertex_exp);
}

static enum spc_status check_block(const struct spc_reader *r, const struct spc_cluster *c,
                                   uint32_t id, uint32_t index, uint64_t *at, uint64_t counts[2],
                                   uint64_t *vertices, struct spc_error *err)
{
    const uint64_t record = r->sections[SE_BLKS].off + (uint64_t)index * BL_SIZE;
    struct spc_block b;
    struct spc_block_layout layout;
    spc_block_record_decode(r->head + record, &b);
    if (b.cluster != id || b.kind > SPC_BLOCK_LEAF || r->head[record + BL_ZERO] != 0 ||
        b.node_count == 0 || b.node_count > r->header.block_nodes)
        return spc_fail(err, SPC_CORRUPT, record, "block %u is not a block of cluster %u", index,
                        id);
    if (b.codec > SPC_CODEC_ZSTD)
        return spc_fail(err, SPC_FEATURE, record + BL_CODEC, "block %u has an unknown codec", index);
    if (!spc_block_ok(&b, r->header.flags, r->header.normal_clusters, &layout))
        return spc_fail(err, SPC_CORRUPT, record, "block %u has sizes that contradict each other",
                        index);
    if (b.off != *at || !range_fits(b.off, spc_block_chunk_bytes(&b), r->size))
        return spc_fail(err, SPC_CORRUPT, record + BL_OFF, "block %u does not lie where it should",
                        index);
    if (!range_ok(b.e_parent_min, b.e_parent_max) || !(b.e_parent_max <= c->e_parent_max) ||
        !(b.e_self_min >= c->e_self_min) || !isfinite(b.e_self_min) || !(b.link_max >= 0) ||
        !(b.link_max <= c->link_max) || !(b.radius_max >= 0) || !(b.radius_max <= c->radius_max) ||
        !exponents_ok(b.step_exp, b.link_base, r->header.unit_exp) || !positions_ok(c->origin, b.step_exp))
        return spc_fail(err, SPC_CORRUPT, record, "block %u has ranges outside its cluster's",
                        index);
    *at += spc_block_chunk_bytes(&b);
    counts[b.kind] += b.node_count;
    *vertices += b.vertex_count;
    return SPC_OK;
}

/* What has been seen of the directory so far; clusters come parents first. */
struct walk {
    uint32_t next_child, next_block;
    uint64_t next_chunk, nodes, leaves, vertices;
};

static enum spc_status check_cluster(const struct spc_reader *r, uint32_t id, struct walk *w,
                                     struct spc_error *err)
{
    const struct spc_header *h = &r->header;
    const uint64_t record = r->sections[SE_CLUS].off + (uint64_t)id * CL_SIZE;
    struct spc_cluster c;
    spc_cluster_decode(r->head + record, &c);
    if (!cluster_values_ok(&c, id) || !tops_ok(&c, r->head + record, h->unit_exp))
        return spc_fail(err, SPC_CORRUPT, record, "cluster %u holds impossible values", id);
    if (c.child_first != (c.child_count ? w->next_child : 0) ||
        c.child_count > h->cluster_count - w->next_child)
        return spc_fail(err, SPC_CORRUPT, record, "cluster %u has children out of order", id);
    for (uint32_t k = 0; k < c.child_count; k++) {
        struct spc_cluster child;
        spc_cluster_decode(r->head + r->sections[SE_CLUS].off +
                               (uint64_t)(c.child_first + k) * CL_SIZE, &child);
        if (child.parent != id || child.level != c.level + 1)
            return spc_fail(err, SPC_CORRUPT, record, "cluster %u is not a child of cluster %u",
                            c.child_first + k, id);
    }
    w->next_child += c.child_count;
    if (id + 1 < h->cluster_count && w->next_child <= id + 1)
        return spc_fail(err, SPC_CORRUPT, record, "cluster %u has no parent", id + 1);
    const uint64_t count = (uint64_t)c.inner_count + c.leaf_count;
    if (count == 0 || count > h->cluster_nodes || c.block_first != w->next_block ||
        c.block_count == 0 || c.block_count > h->block_count - w->next_block ||
        c.data_off != w->next_chunk)
        return spc_fail(err, SPC_CORRUPT, record, "cluster %u has blocks out of order", id);
    uint64_t counts[2] = {0, 0};    /* of blocks that may be many: more than 32 bits */
    for (uint32_t k = 0; k < c.block_count; k++) {
        const enum spc_status status = check_block(r, &c, id, w->next_block + k, &w->next_chunk,
                                                   counts, &w->vertices, err);
        if (status != SPC_OK)
            return status;
    }
    if (counts[SPC_BLOCK_INNER] != c.inner_count || counts[SPC_BLOCK_LEAF] != c.leaf_count ||
        c.data_bytes != w->next_chunk - c.data_off)
        return spc_fail(err, SPC_CORRUPT, record, "cluster %u does not add up", id);
    w->next_block += c.block_count;
    w->nodes += count;
    w->leaves += c.leaf_count;
    return SPC_OK;
}

enum spc_status spc_directory_check(const struct spc_reader *r, struct spc_error *err)
{
    const struct spc_header *h = &r->header;
    struct walk w = {.next_child = 1, .next_chunk = spc_data_start(h->head_bytes)};
    const uint8_t *root = r->head + r->sections[SE_CLUS].off;
    if (load_u32(root + CL_PARENT) != SPC_NONE || load_u16(root + CL_LEVEL) != 0)
        return spc_fail(err, SPC_CORRUPT, r->sections[SE_CLUS].off, "cluster 0 is not the root's");
    for (uint32_t id = 0; id < h->cluster_count; id++) {
        const enum spc_status status = check_cluster(r, id, &w, err);
        if (status != SPC_OK)
            return status;
    }
    if (w.next_child != h->cluster_count || w.next_block != h->block_count ||
        w.nodes != h->node_count || w.leaves != h->leaf_count || w.vertices != h->vertex_count)
        return spc_fail(err, SPC_CORRUPT, HD_NODE_COUNT,
                        "the directory's counts are not the header's");
    if (w.next_chunk != h->file_bytes)
        return spc_fail(err, SPC_CORRUPT, HD_FILE_BYTES, "the last block does not end the file");
    return SPC_OK;
}
