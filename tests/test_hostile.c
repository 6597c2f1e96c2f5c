/*
 * Archives made to deceive: each is changed in one way and then made to agree with itself again,
 * checksums and all, so that nothing but the rule in question can refuse it.
 */
#include "bytes.h"
#include "fuzz_seeds.h"
#include "layout.h"
#include "mesh_case.h"
#include "reseal.h"
#include "suite.h"

#include <stdlib.h>

enum { ALL = RESEAL_HASHES | RESEAL_CHUNKS | RESEAL_COUNTS };

static struct { uint8_t *bytes; size_t size; } a;

static void begin(uint32_t seed)
{
    free(a.bytes);
    a.bytes = fuzz_seed(seed, &a.size);
}

static uint8_t *record(int section, uint32_t i)
{
    uint64_t first = 0;
    const uint32_t n = reseal_records(a.bytes, a.size, section, &first);
    ck_assert_uint_lt(i, n);
    return a.bytes + first + (uint64_t)(section == SE_CLUS ? CL_SIZE : BL_SIZE) * i;
}

static enum spc_status open_status(void)
{
    struct spc_reader *r = NULL;
    a.size = reseal(a.bytes, a.size, ALL);
    const enum spc_status status = spc_reader_open_memory(a.bytes, a.size, &r, NULL);
    spc_reader_close(r);
    return status;
}

START_TEST(tops_of_invalid_codes_do_not_open)
{
    static const struct { int off, bytes; uint16_t value; } codes[] = {
        {ND_RADIUS, 2, 0xFFFF}, {ND_RADIUS, 2, SPC_LEN_ROOT}, {ND_E_SELF, 2, 0x0001},
        {ND_E_SELF, 2, SPC_LEN_MAX}, {ND_E_PARENT, 2, SPC_LEN_ROOT + 1}, {ND_NORMAL, 1, 0xFF},
    };
    for (size_t i = 0; i < sizeof codes / sizeof *codes; i++) {
        begin(2);
        uint8_t value[2];
        store_u16(value, codes[i].value);
        memcpy(record(SE_CLUS, 1) + CL_TOPS + TP_NODE + codes[i].off, value, (size_t)codes[i].bytes);
        ck_assert_int_eq(open_status(), SPC_CORRUPT);
    }
}
END_TEST

START_TEST(nodes_at_infinity_do_not_open)
{
    begin(2);
    store_u16(record(SE_CLUS, 1) + CL_TOPS + TP_STEP_EXP, SPC_EXP_MAX);
    ck_assert_int_eq(open_status(), SPC_CORRUPT);
    begin(2);
    store_u16(record(SE_BLKS, 1) + BL_STEP_EXP, SPC_EXP_MAX);
    ck_assert_int_eq(open_status(), SPC_CORRUPT);
}
END_TEST

/*
 * Nodes of many blocks that add up to 2^32 and a few: whoever counts in 32 bits takes memory for
 * the few. The blocks need not decode for that.
 */
START_TEST(counts_that_wrap_do_not_open)
{
    enum { EXTRA = 65538 };         /* 65537 x 65535 is 2^32 - 1 */
    begin(4);
    uint8_t *head = a.bytes;
    const uint64_t blks = load_u64(head + HD_SECTIONS + SE_SIZE * SE_BLKS + SE_OFF);
    const uint64_t clus = load_u64(head + HD_SECTIONS + SE_SIZE * SE_CLUS + SE_OFF);
    const uint32_t blocks = load_u32(head + HD_BLOCK_COUNT);
    const uint64_t end = blks + (uint64_t)BL_SIZE * (blocks + EXTRA);
    const size_t size = end + (uint64_t)CH_SIZE * (blocks + EXTRA);
    uint8_t *bytes = calloc(size, 1);
    memcpy(bytes, head, blks + (uint64_t)BL_SIZE * blocks);
    for (uint32_t k = 0; k < blocks + EXTRA; k++) {     /* last cluster, its last kind of block */
        uint8_t *b = bytes + blks + (uint64_t)BL_SIZE * k;
        if (k >= blocks) {
            memcpy(b, b - BL_SIZE, BL_SIZE);
            store_u32(b + BL_NODE_COUNT, k + 1 < blocks + EXTRA ? 65535 : 1);
        }
        b[BL_CODEC] = SPC_CODEC_ZSTD;
        store_u32(b + BL_STORED_BYTES, 0);
    }
    uint8_t *last = bytes + clus + (uint64_t)CL_SIZE * (load_u32(head + HD_CLUSTER_COUNT) - 1);
    store_u32(last + CL_BLOCK_COUNT, load_u32(last + CL_BLOCK_COUNT) + EXTRA);
    store_u32(bytes + HD_BLOCK_NODES, 65535);
    uint8_t *se = bytes + HD_SECTIONS + SE_SIZE * SE_BLKS;
    store_u64(se + SE_BYTES, (uint64_t)BL_SIZE * (blocks + EXTRA));
    store_u64(se + SE_SIZE + SE_OFF, end);              /* metadata: none */
    store_u64(se + SE_SIZE + SE_BYTES, 0);
    store_u64(bytes + HD_HEAD_BYTES, end);
    free(a.bytes);
    a.bytes = bytes;
    a.size = size;
    ck_assert_int_eq(open_status(), SPC_CORRUPT);
    ck_assert_uint_eq(a.size, size);
}
END_TEST

static enum spc_status verify_status(struct spc_error *err)
{
    struct spc_reader *r = NULL;
    a.size = reseal(a.bytes, a.size, ALL);
    *err = (struct spc_error){0};
    ck_assert_int_eq(spc_reader_open_memory(a.bytes, a.size, &r, err), SPC_OK);
    const enum spc_status status = spc_verify(r, 3, NULL, NULL, err);
    spc_reader_close(r);
    return status;
}

/* Exponents that take vertices to infinity, or lengths far from what their codes hold. */
START_TEST(exponents_beyond_the_doubles_are_refused)
{
    static const int exponents[] = {SPC_EXP_MIN, -1074, -1023, -500, 500, SPC_EXP_MAX};
    for (uint32_t seed = 0; seed < FUZZ_SEEDS; seed++)
        for (size_t i = 0; i < sizeof exponents / sizeof *exponents; i++)
            for (int both = 0; both < 3; both++) {
                begin(seed);
                if (both != 1)
                    store_u32(a.bytes + HD_UNIT_EXP, (uint32_t)exponents[i]);
                if (both != 0)
                    store_u32(a.bytes + HD_VERTEX_EXP, (uint32_t)exponents[i]);
                const enum spc_status status = open_status();
                ck_assert(status == SPC_LIMIT || status == SPC_CORRUPT);
            }
}
END_TEST

START_TEST(exponents_of_another_scan_are_found)
{
    for (uint32_t seed = 0; seed < FUZZ_SEEDS; seed++)
        for (int by = -5; by <= 5; by += 10)
            for (int field = 0; field < 2; field++) {
                struct spc_error err;
                begin(seed);
                uint8_t *at = a.bytes + (field ? HD_VERTEX_EXP : HD_UNIT_EXP);
                store_u32(at, load_u32(at) + (uint32_t)by);
                if (field == 0 || load_u32(a.bytes + HD_FLAGS) & SPC_FLAG_TRIANGLES)
                    ck_assert_int_eq(verify_status(&err), SPC_CORRUPT);
            }
}
END_TEST

START_TEST(a_header_that_describes_another_tree_is_found)
{
    struct spc_error err;
    begin(2);
    ck_assert_int_eq(verify_status(&err), SPC_OK);
    store_u32(a.bytes + HD_HEIGHT, load_u32(a.bytes + HD_HEIGHT) + 1);
    ck_assert_int_eq(verify_status(&err), SPC_CORRUPT);
    ck_assert_str_eq(err.what, "the tree has another height");
    begin(2);
    store_f32(a.bytes + HD_E_MIN, load_f32(a.bytes + HD_E_MIN) * 0.5f);
    ck_assert_int_eq(verify_status(&err), SPC_CORRUPT);
    ck_assert_str_eq(err.what, "the errors of inner nodes span another range");
    begin(2);
    store_f64(a.bytes + HD_BOX + 24, load_f64(a.bytes + HD_BOX + 24) + 1);
    ck_assert_int_eq(verify_status(&err), SPC_CORRUPT);
    ck_assert_str_eq(err.what, "the vertices span another box");
    begin(2);
    store_f64(a.bytes + HD_BOX + 24, load_f64(a.bytes + HD_BOX + 24) * 0.999);
    ck_assert_int_eq(verify_status(&err), SPC_CORRUPT);
    ck_assert_ptr_nonnull(strstr(err.what, "outside the box of all vertices"));
}
END_TEST

/* Payload of the first leaf block with triangles and its layout. */
static uint8_t *leaf_payload(struct spc_block *b, struct spc_block_layout *l)
{
    struct spc_reader *r = NULL;
    uint32_t k = 0;
    ck_assert_int_eq(spc_reader_open_memory(a.bytes, a.size, &r, NULL), SPC_OK);
    for (spc_reader_block(r, k, b); b->kind != SPC_BLOCK_LEAF; k++)
        spc_reader_block(r, k + 1, b);
    const struct spc_header *h = spc_reader_header(r);
    ck_assert(spc_block_layout(b, h->flags, h->normal_clusters, l));
    spc_reader_close(r);
    return a.bytes + b->off + CH_SIZE;
}

START_TEST(a_leaf_in_another_colour_is_found)
{
    struct spc_block b;
    struct spc_block_layout l;
    struct spc_error err;
    struct case_mesh m = case_soup(40, 5);
    case_color(&m);
    struct spb_build_options o = case_options(case_write(&m, "c.ply"), case_path("c.spc"));
    o.codec = SPC_CODEC_RAW;
    spc_reader_close(case_build(&o));
    case_mesh_free(&m);
    free(a.bytes);
    a.bytes = case_slurp(o.out, &a.size);
    leaf_payload(&b, &l)[l.colors + 1] ^= 1;
    ck_assert_int_eq(verify_status(&err), SPC_CORRUPT);
    ck_assert_ptr_nonnull(strstr(err.what, "not the disk of its triangle"));
}
END_TEST

START_TEST(a_prelude_says_nothing_that_has_no_meaning)
{
    struct spc_block b;
    struct spc_block_layout l;
    struct spc_error err;
    begin(5);
    uint8_t *p = leaf_payload(&b, &l);
    ck_assert_int_eq(b.codec, SPC_CODEC_ZSTD);
    p[CO_RADIUS_SHIFT] = 1;
    ck_assert_int_eq(verify_status(&err), SPC_CORRUPT);
}
END_TEST

/* The last triangle takes another's corners; what it had is left over. */
START_TEST(a_vertex_without_a_triangle_is_found)
{
    for (uint32_t k = 0;; k++) {
        struct spc_block_layout l;
        struct spc_reader *r = NULL;
        struct spc_block b;
        struct spc_error err;
        begin(2);
        ck_assert_int_eq(spc_reader_open_memory(a.bytes, a.size, &r, NULL), SPC_OK);
        const struct spc_header *h = spc_reader_header(r);
        spc_reader_block(r, k, &b);
        ck_assert(spc_block_layout(&b, h->flags, h->normal_clusters, &l));
        spc_reader_close(r);
        if (b.kind != SPC_BLOCK_LEAF || b.node_count < 2)
            continue;
        uint8_t *indices = a.bytes + b.off + CH_SIZE + l.indices;
        memcpy(indices + 6 * (b.node_count - 1), indices, 6);
        ck_assert_int_eq(verify_status(&err), SPC_CORRUPT);
        ck_assert_ptr_nonnull(strstr(err.what, "a vertex that none of its triangles uses"));
        return;
    }
}
END_TEST

static void finish(void)
{
    free(a.bytes);
    a.bytes = NULL;
    case_finish();
}

int main(void)
{
    return SUITE("hostile", case_start, finish, tops_of_invalid_codes_do_not_open,
                 nodes_at_infinity_do_not_open, counts_that_wrap_do_not_open,
                 exponents_beyond_the_doubles_are_refused, exponents_of_another_scan_are_found,
                 a_leaf_in_another_colour_is_found, a_prelude_says_nothing_that_has_no_meaning,
                 a_header_that_describes_another_tree_is_found,
                 a_vertex_without_a_triangle_is_found);
}
