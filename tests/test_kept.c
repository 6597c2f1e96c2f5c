/* Blocks as they are kept: nothing is lost when they are sorted, and nothing that is drawn lies behind the prefix. */
#include "bytes.h"
#include "kept.h"
#include "mesh_case.h"
#include "oracle_case.h"
#include "suite.h"

#include <stdlib.h>
#include <string.h>

struct pair {                       /* a block as the file has it, and sorted */
    struct spc_block b;
    struct spc_block_layout l;
    uint8_t *stored, *kept;
};

static struct pair pair_of(const struct spc_reader *reader, uint32_t block)
{
    const struct spc_header *h = spc_reader_header(reader);
    struct pair p;
    spc_reader_block(reader, block, &p.b);
    spc_block_layout(&p.b, h->flags, h->normal_clusters, &p.l);
    p.stored = malloc(p.l.bytes);
    p.kept = malloc(p.l.bytes);
    ck_assert_int_eq(spc_block_decode(reader, block, true, p.stored, NULL), SPC_OK);
    memcpy(p.kept, p.stored, p.l.bytes);
    ck_assert_int_eq(spv_kept_sort(reader, block, p.kept, NULL), SPC_OK);
    return p;
}

static void pair_free(struct pair *p)
{
    free(p->stored);
    free(p->kept);
}

/* All that is stored of a node: record, colour, corners. */
static size_t facts_of(const struct pair *p, const uint8_t *payload, uint32_t node, uint8_t out[32])
{
    size_t n = SPC_NODE_BYTES;
    memcpy(out, payload + p->l.nodes + (size_t)SPC_NODE_BYTES * node, SPC_NODE_BYTES);
    if (p->l.colors) {
        memcpy(out + n, payload + p->l.colors + 4 * (size_t)node, 4);
        n += 4;
    }
    if (p->l.indices) {
        memcpy(out + n, payload + p->l.indices + 6 * (size_t)node, 6);
        n += 6;
    }
    return n;
}

/* The sorted block by the slow way: the largest e_parent that is left, the first of equal ones. */
static void expect_sorted(const struct oracle_case *c, const struct pair *p)
{
    bool *used = calloc(p->b.node_count, 1);
    const uint32_t step = p->b.node_count / 50 + 1;
    for (uint32_t i = 0; i < p->b.node_count; i++) {
        uint8_t want[32], got[32];
        uint32_t best = SPC_NONE;
        uint16_t most = 0;
        for (uint32_t k = 0; k < p->b.node_count; k++) {
            const uint16_t code = load_u16(p->stored + p->l.nodes + (size_t)SPC_NODE_BYTES * k + ND_E_PARENT);
            if (!used[k] && (best == SPC_NONE || code > most)) {
                best = k;
                most = code;
            }
        }
        used[best] = true;
        const size_t n = facts_of(p, p->stored, best, want);
        if (i % step == 0 && (facts_of(p, p->kept, i, got) != n || memcmp(want, got, n) != 0))
            oracle_fail(c, "node %u of %u is not the one of its place", i, p->b.node_count);
    }
    free(used);
}

static void sort_all(struct oracle_case *c)
{
    for (uint32_t k = 0; k < c->tree.header->block_count && k < 12; k++) {
        struct pair p = pair_of(c->reader, k * 7 % c->tree.header->block_count);
        expect_sorted(c, &p);
        if (p.l.indices && memcmp(p.stored + p.l.vertex_base, p.kept + p.l.vertex_base,
                                  p.l.bytes - p.l.vertex_base) != 0)
            oracle_fail(c, "vertices have changed");
        pair_free(&p);
    }
}

START_TEST(sorting_moves_all_of_a_node)
{
    oracle_each(sort_all);
}
END_TEST

static uint64_t tested, looked_at;

/* Not one that passes its upper test, and no triangle that is drawn, lies behind. */
static void look(struct oracle_case *c)
{
    for (uint32_t v = 0; v < oracle_views(8); v++) {
        if (v % 2)
            oracle_frame(c, v);
        else
            oracle_look(c, v);
        for (uint32_t k = 0; k < c->tree.header->block_count; k++) {
            struct pair p = pair_of(c->reader, (k * 5 + v) % c->tree.header->block_count);
            const uint32_t block = (k * 5 + v) % c->tree.header->block_count;
            struct spv_interval in = oracle_interval(&c->tree, block, &c->view);
            double eye[3];
            spv_eye_of_cluster(c->reader, &c->tree.clusters[p.b.cluster], &c->view.camera, eye);
            const uint32_t n = spv_kept_prefix(&c->view, &p.b, &c->tree.clusters[p.b.cluster], eye,
                                               p.kept + p.l.nodes + ND_E_PARENT, SPC_NODE_BYTES);
            in.lower = false;
            for (uint32_t i = n; i < p.b.node_count; i++) {
                const uint8_t *record = p.kept + p.l.nodes + (size_t)SPC_NODE_BYTES * i;
                if (spv_interval_point(&in, record) ||
                    (p.b.kind == SPC_BLOCK_LEAF && spv_interval_triangle(&in, record)))
                    oracle_fail(c, "node %u of block %u is drawn, but the prefix ends at %u", i, block, n);
            }
            ck_assert_uint_le(n, p.b.node_count);
            looked_at += n;
            tested += p.b.node_count;
            pair_free(&p);
            if (k > 20)
                break;
        }
    }
}

START_TEST(nothing_that_is_drawn_lies_behind_the_prefix)
{
    oracle_each(look);
    ck_assert_msg(looked_at < tested / 10 * 9, "%llu of %llu nodes are in prefixes", (unsigned long long)looked_at,
                  (unsigned long long)tested);
}
END_TEST

int main(void)
{
    if (!oracle_start())
        return 1;
    const int failed = SUITE("kept", case_start, case_finish, sorting_moves_all_of_a_node,
                             nothing_that_is_drawn_lies_behind_the_prefix);
    oracle_finish();
    return failed;
}
