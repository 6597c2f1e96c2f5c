/*
 * fuzz_open.c - what opening lets through is what the rest of the library trusts: ranges lie in
 * the file, sizes are those of the layout, numbers are numbers.
 */
#include "fuzz.h"

#include "spc.h"

#include <assert.h>
#include <math.h>
#include <string.h>

static void hold_header(const struct spc_reader *r, size_t size)
{
    const struct spc_header *h = spc_reader_header(r);
    uint64_t bytes = 0;
    size_t meta_bytes = 0;
    const uint8_t *begin = spc_reader_bytes(r, &bytes);
    const char *meta = spc_reader_meta(r, &meta_bytes);
    assert(bytes == size && h->file_bytes == size && h->head_bytes <= size);
    assert((const uint8_t *)meta >= begin && (const uint8_t *)meta + meta_bytes <= begin + size);
    assert(h->node_count >= h->leaf_count && h->cluster_count > 0 && h->block_count > 0);
    for (uint32_t k = 0; k < h->normal_clusters; k++) {
        double axis[3];
        spc_reader_axis(r, k, axis);
        const double length = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
        assert(fabs(length - 1) < 1e-9);
    }
}

static void hold_top(const struct spc_reader *r, const struct spc_cluster *c, uint32_t i)
{
    struct spc_node top;
    spc_top_decode(r, c, i, &top);
    for (int a = 0; a < 3; a++)
        assert(isfinite(top.center[a]) && fabs(top.normal[a]) <= 1);
    assert(top.radius >= 0 && isfinite(top.radius) && isfinite(top.height) && isfinite(top.link));
    assert(spc_len_valid(top.e_self) && top.e_self <= top.e_parent);
    assert(spc_len_valid(top.e_parent) || top.e_parent == SPC_LEN_ROOT);
}

static void hold_cluster(const struct spc_reader *r, uint32_t id, struct spc_cluster *c)
{
    const struct spc_header *h = spc_reader_header(r);
    spc_reader_cluster(r, id, c);
    assert(id == 0 ? c->parent == SPC_NONE : c->parent < id);
    assert(c->child_first <= h->cluster_count &&
           c->child_count <= h->cluster_count - c->child_first);
    assert(c->block_first < h->block_count && c->block_count > 0 &&
           c->block_count <= h->block_count - c->block_first);
    assert(c->data_off >= h->head_bytes && c->data_off <= h->file_bytes &&
           c->data_bytes <= h->file_bytes - c->data_off);
    assert(c->top_count >= 1 && c->top_count <= SPC_TOPS_MAX);
    assert((uint64_t)c->inner_count + c->leaf_count <= h->cluster_nodes);
    for (uint32_t t = 0; t < c->top_count; t++)
        hold_top(r, c, t);
}

/* Adds the block's nodes to counts[kind]; at moves from chunk to chunk. */
static void hold_block(const struct spc_reader *r, uint32_t index, uint32_t cluster, uint64_t *at,
                       uint64_t counts[2])
{
    const struct spc_header *h = spc_reader_header(r);
    struct spc_block b;
    struct spc_block_layout layout;
    spc_reader_block(r, index, &b);
    assert(b.cluster == cluster && b.kind <= SPC_BLOCK_LEAF && b.off == *at);
    assert(b.node_count > 0 && b.node_count <= h->block_nodes);
    assert(spc_block_layout(&b, h->flags, h->normal_clusters, &layout));
    assert(layout.bytes == b.raw_bytes);
    *at += spc_block_chunk_bytes(&b);
    assert(*at > b.off + b.stored_bytes && *at <= h->file_bytes);
    assert(!isnan(b.e_parent_min) && b.e_parent_min <= b.e_parent_max && b.e_self_min >= 0);
    assert(b.link_max >= 0 && isfinite(b.link_max) && b.radius_max >= 0 && isfinite(b.radius_max));
    counts[b.kind] += b.node_count;
}

int fuzz_open(const uint8_t *bytes, size_t size)
{
    struct spc_reader *r = NULL;
    struct spc_error err = {0};
    const enum spc_status status = spc_reader_open_memory(bytes, size, &r, &err);
    assert(status == err.status && (status == SPC_OK) == (r != NULL));
    if (status != SPC_OK) {
        assert(err.what[0] != '\0' && memchr(err.what, '\0', sizeof err.what) != NULL);
        return 0;
    }
    const struct spc_header *h = spc_reader_header(r);
    hold_header(r, size);
    uint64_t nodes = 0, at = 0;
    for (uint32_t id = 0; id < h->cluster_count; id++) {
        struct spc_cluster c;
        uint64_t counts[2] = {0, 0};
        hold_cluster(r, id, &c);
        at = id == 0 ? c.data_off : at;
        for (uint32_t k = 0; k < c.block_count; k++)
            hold_block(r, c.block_first + k, id, &at, counts);
        assert(counts[SPC_BLOCK_INNER] == c.inner_count && counts[SPC_BLOCK_LEAF] == c.leaf_count);
        nodes += counts[SPC_BLOCK_INNER] + counts[SPC_BLOCK_LEAF];
    }
    assert(nodes == h->node_count && at == size);
    spc_reader_close(r);
    return 0;
}
