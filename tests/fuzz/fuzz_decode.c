/*
 * fuzz_decode.c - a payload that nobody vouches for: without its checksum, into a buffer of just
 * the promised size, and then every node and vertex of it.
 */
#include "fuzz.h"

#include "bytes.h"
#include "spc.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

/* A few bytes may stand for many equal nodes: no run looks at more than these. */
enum { NODES_MAX = 200000 };

static void hold_nodes(const struct spc_reader *r, const struct spc_block *b,
                       const struct spc_block_layout *l, const uint8_t *payload)
{
    for (uint32_t i = 0; i < b->node_count; i++) {
        struct spc_node n;
        spc_node_decode(r, b, l, payload, i, &n);
        for (int a = 0; a < 3; a++)
            assert(isfinite(n.center[a]) && fabs(n.normal[a]) <= 1);
        assert(n.radius >= 0 && isfinite(n.radius) && n.height <= n.radius);
        assert(n.link > 0 && isfinite(n.link) && spc_len_valid(n.e_self));
        assert(n.e_self <= n.e_parent && n.e_parent <= SPC_LEN_ROOT);
    }
}

static void hold_triangles(const struct spc_reader *r, const struct spc_block *b,
                           const struct spc_block_layout *l, const uint8_t *payload)
{
    for (uint32_t i = 0; i < 3 * b->node_count; i++)
        assert(load_u16(payload + l->indices + 2 * i) < b->vertex_count);
    for (uint32_t i = 0; i < b->vertex_count; i++) {
        double xyz[3];
        uint8_t rgba[4];
        spc_vertex_decode(r, b, l, payload, i, xyz, rgba);
        for (int a = 0; a < 3; a++)         /* base and offset within their limits: exact */
            assert(fabs(xyz[a]) <= ldexp(0x1p53 + 0x1p54, spc_reader_header(r)->vertex_exp));
    }
}

static void decode(const struct spc_reader *r, uint32_t index)
{
    const struct spc_header *h = spc_reader_header(r);
    struct spc_block b;
    struct spc_block_layout layout;
    struct spc_error err = {0};
    spc_reader_block(r, index, &b);
    assert(spc_block_layout(&b, h->flags, h->normal_clusters, &layout));
    uint8_t *payload = malloc(b.raw_bytes);
    assert(payload != NULL);
    const enum spc_status status = spc_block_decode(r, index, false, payload, &err);
    assert(status == err.status);
    if (status == SPC_OK) {
        hold_nodes(r, &b, &layout, payload);
        if (layout.indices != 0)
            hold_triangles(r, &b, &layout, payload);
    }
    free(payload);
}

int fuzz_decode(const uint8_t *bytes, size_t size)
{
    struct spc_reader *r = NULL;
    uint64_t nodes = 0;
    if (spc_reader_open_memory(bytes, size, &r, NULL) != SPC_OK)
        return 0;
    const uint32_t blocks = spc_reader_header(r)->block_count;
    for (uint32_t k = 0; k < blocks && nodes < NODES_MAX; k++) {
        struct spc_block b;
        spc_reader_block(r, k, &b);
        nodes += (uint64_t)b.node_count + b.vertex_count;
        decode(r, k);
    }
    spc_reader_close(r);
    return 0;
}
