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

/* Normal cluster of a node in the file's order; of blocks that give theirs up always 0. */
static uint32_t group_of(const struct oracle_case *c, const struct pair *p, uint32_t node)
{
    uint32_t g = 0, end = load_u16(p->stored + p->l.groups);
    if (!spv_kept_grouped(&p->b))
        return 0;
    while (node >= end && g + 1 < c->tree.header->normal_clusters)
        end += load_u16(p->stored + p->l.groups + 4 * (size_t)++g);
    return g;
}

/* The sorted block by the slow way: the first group, its largest e_parent that is left, the first of equal ones. */
static void expect_sorted(const struct oracle_case *c, const struct pair *p)
{
    const uint32_t n = p->b.node_count, step = n / 50 + 1;
    bool *used = calloc(n, 1);
    uint32_t *group = malloc(n * sizeof *group);
    for (uint32_t k = 0; k < n; k++)
        group[k] = group_of(c, p, k);
    for (uint32_t i = 0; i < n; i++) {
        uint8_t want[32], got[32];
        uint32_t best = SPC_NONE;
        uint16_t most = 0;
        for (uint32_t k = 0; k < n; k++) {
            const uint16_t code = load_u16(p->stored + p->l.nodes + (size_t)SPC_NODE_BYTES * k + ND_E_PARENT);
            if (!used[k] && (best == SPC_NONE || group[k] < group[best] || (group[k] == group[best] && code > most))) {
                best = k;
                most = code;
            }
        }
        used[best] = true;
        const size_t bytes = facts_of(p, p->stored, best, want);
        if (i % step == 0 && (facts_of(p, p->kept, i, got) != bytes || memcmp(want, got, bytes) != 0))
            oracle_fail(c, "node %u of %u is not the one of its place", i, n);
    }
    free(used);
    free(group);
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

/* Those that are not in the ranges, behind the eye's back or not. */
static void mark(const struct spv_ranges *ranges, bool *in)
{
    for (uint32_t r = 0; r < ranges->count; r++)
        for (int i = 0; i < ranges->nodes[r]; i++)
            in[ranges->first[r] + i] = true;
}

/* Not one that passes its upper test, and no triangle that is drawn, is left out. */
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
            struct spv_ranges ranges;
            bool *taken = calloc(p.b.node_count, 1);
            spv_kept_ranges(c->reader, &c->view, &p.b, &c->tree.clusters[p.b.cluster], eye,
                            p.kept + p.l.nodes + ND_E_PARENT, SPC_NODE_BYTES, p.kept + p.l.groups, &ranges);
            mark(&ranges, taken);
            in.lower = false;
            for (uint32_t i = 0; i < p.b.node_count; i++) {
                const uint8_t *record = p.kept + p.l.nodes + (size_t)SPC_NODE_BYTES * i;
                looked_at += taken[i];
                if (!taken[i] && (spv_interval_point(&in, record) ||
                                  (p.b.kind == SPC_BLOCK_LEAF && spv_interval_triangle(&in, record))))
                    oracle_fail(c, "node %u of block %u is drawn, but left out", i, block);
            }
            tested += p.b.node_count;
            free(taken);
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

/* ---- many leaves: by normal cluster ------------------------------------------------------------- */

/* Does the leaf's triangle turn its front to the eye? */
static bool faces(const struct oracle_case *c, const struct pair *p, uint32_t leaf)
{
    double v[3][3], a[3], b[3], sum = 0;
    for (uint32_t k = 0; k < 3; k++)
        spc_vertex_decode(c->reader, &p->b, &p->l, p->kept, load_u16(p->kept + p->l.indices + 6 * leaf + 2 * k), v[k],
                          NULL);
    for (int i = 0; i < 3; i++) {
        a[i] = v[1][i] - v[0][i];
        b[i] = v[2][i] - v[0][i];
    }
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        sum += (a[j] * b[k] - a[k] * b[j]) * (c->view.camera.eye[i] - v[0][i]);
    }
    return sum > 0;
}

/* What is left out is not drawn, or seen from behind. Returns how many of the drawn ones are left out. */
static uint32_t left_out(const struct oracle_case *c, uint32_t block, const struct pair *p)
{
    struct spv_interval in = oracle_interval(&c->tree, block, &c->view);
    struct spv_ranges ranges;
    double eye[3];
    bool *taken = calloc(p->b.node_count, 1);
    uint32_t count = 0;
    spv_eye_of_cluster(c->reader, &c->tree.clusters[p->b.cluster], &c->view.camera, eye);
    spv_kept_ranges(c->reader, &c->view, &p->b, &c->tree.clusters[p->b.cluster], eye,
                    p->kept + p->l.nodes + ND_E_PARENT, SPC_NODE_BYTES, p->kept + p->l.groups, &ranges);
    mark(&ranges, taken);
    in.lower = false;
    for (uint32_t i = 0; i < p->b.node_count; i++) {
        const uint8_t *record = p->kept + p->l.nodes + (size_t)SPC_NODE_BYTES * i;
        if (taken[i] || !(spv_interval_point(&in, record) || spv_interval_triangle(&in, record)))
            continue;
        count++;
        if (faces(c, p, i))
            oracle_fail(c, "leaf %u of block %u is drawn and faces the eye, but is left out", i, block);
    }
    free(taken);
    return count;
}

START_TEST(of_many_leaves_those_that_face_away_are_left_out)
{
    struct case_mesh m = case_sphere(30000, 5);
    struct spb_build_options o = case_options(case_write(&m, "many.ply"), case_path("many.spc"));
    o.cluster_nodes = 28672;
    o.block_nodes = 32768;
    struct oracle_case c = {.name = "many leaves", .reader = case_build(&o)};
    uint32_t away = 0, grouped = 0;
    oracle_load(&c.tree, c.reader);
    for (uint32_t v = 0; v < 9; v++) {
        const double eye[3] = {3 + v, 2.0 * (v % 3) - 2, v % 2 ? 2 : -1}, middle[3] = {0, 0, 0}, up[3] = {0, 0, 1};
        c.view = (struct spv_view){.mode = SPV_HYBRID, .cull = true};
        ck_assert(spv_camera_look(&c.view.camera, eye, middle, up, 0.8, 600, 400));
        c.view.eps = spv_camera_eps(&c.view.camera, 0.1 * (1 << v % 5));
        for (uint32_t k = 0; k < c.tree.header->block_count; k++) {
            struct pair p = pair_of(c.reader, k);
            if (spv_kept_grouped(&p.b)) {
                if (v == 0)
                    expect_sorted(&c, &p);
                grouped++;
                away += left_out(&c, k, &p);
            }
            pair_free(&p);
        }
    }
    ck_assert_uint_gt(grouped, 0);
    ck_assert_uint_gt(away, 1000);
    oracle_free(&c.tree);
    spc_reader_close((struct spc_reader *)c.reader);
    case_mesh_free(&m);
}
END_TEST

int main(void)
{
    if (!oracle_start())
        return 1;
    const int failed = SUITE("kept", case_start, case_finish, sorting_moves_all_of_a_node,
                             nothing_that_is_drawn_lies_behind_the_prefix,
                             of_many_leaves_those_that_face_away_are_left_out);
    oracle_finish();
    return failed;
}
