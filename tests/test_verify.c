/*
 * Can verification fail? One rule of the format is broken at a time, checksums put right again, and
 * the invariant that guards the rule must be the one that complains.
 */
#include "bytes.h"
#include "layout.h"
#include "mesh_case.h"
#include "suite.h"

#include <stdio.h>
#include <stdlib.h>
#include <xxhash.h>

struct patch {
    uint8_t *bytes;
    size_t size;
    uint64_t clus, blks;            /* offsets of the sections */
    uint32_t clusters, blocks;
};

static uint64_t section(const uint8_t *bytes, int s, int field)
{
    return load_u64(bytes + HD_SECTIONS + SE_SIZE * s + field);
}

/* A raw archive in memory, so that a node's bytes are where they are. */
static struct patch begin(void)
{
    struct case_mesh m = case_sphere(2500, 3);
    struct spb_build_options o = case_options(case_write(&m, "a.ply"), case_path("a.spc"));
    struct patch p = {0};
    o.codec = SPC_CODEC_RAW;
    spc_reader_close(case_build(&o));
    p.bytes = case_slurp(o.out, &p.size);
    p.clus = section(p.bytes, SE_CLUS, SE_OFF);
    p.blks = section(p.bytes, SE_BLKS, SE_OFF);
    p.clusters = load_u32(p.bytes + HD_CLUSTER_COUNT);
    p.blocks = load_u32(p.bytes + HD_BLOCK_COUNT);
    case_mesh_free(&m);
    return p;
}

static uint8_t *block_record(const struct patch *p, uint32_t block)
{
    return p->bytes + p->blks + (uint64_t)BL_SIZE * block;
}

static uint8_t *payload(const struct patch *p, uint32_t block)
{
    return p->bytes + load_u64(block_record(p, block) + BL_OFF) + CH_SIZE;
}

/* All checksums again, from the chunks up. */
static void seal(struct patch *p)
{
    for (uint32_t k = 0; k < p->blocks; k++) {
        uint8_t *b = block_record(p, k);
        const uint64_t bytes = align_up(CH_SIZE + (uint64_t)load_u32(b + BL_STORED_BYTES), 64);
        uint8_t *chunk = p->bytes + load_u64(b + BL_OFF);
        const uint64_t hash = XXH64(chunk + CH_KIND, bytes - CH_KIND, load_u64(chunk));
        store_u64(b + BL_HASH, hash);
        store_u64(chunk + CH_HASH, hash);
    }
    for (int s = 0; s < SE_COUNT; s++)
        store_u64(p->bytes + HD_SECTIONS + SE_SIZE * s + SE_HASH,
                  XXH64(p->bytes + section(p->bytes, s, SE_OFF), section(p->bytes, s, SE_BYTES), 0));
    store_u64(p->bytes + HD_HASH, XXH64(p->bytes, HD_HASH, 0));
}

struct heard {
    const char *want;
    bool heard;
    char others[400];
};

static void listen(void *ctx, const struct spc_finding *f)
{
    struct heard *h = ctx;
    if (f->ok)
        return;
    if (strncmp(f->invariant, h->want, strlen(h->want)) == 0)
        h->heard = true;
    else
        snprintf(h->others + strlen(h->others), sizeof h->others - strlen(h->others), " [%s]",
                 f->invariant);
}

/* want: how the invariant begins that must be found broken. */
static void expect_found(struct patch *p, const char *want)
{
    struct spc_reader *r = NULL;
    struct spc_error err = {0};
    struct heard h = {.want = want};
    seal(p);
    const enum spc_status status = spc_reader_open_memory(p->bytes, p->size, &r, &err);
    if (status == SPC_OK) {
        ck_assert_int_eq(spc_verify(r, 3, listen, &h, NULL), SPC_CORRUPT);
        spc_reader_close(r);
        ck_assert_msg(h.heard, "'%s' did not complain, only%s", want, h.others);
    } else {
        ck_assert_msg(strcmp(want, "open") == 0, "'%s' should complain, but it does not open: %s",
                      want, err.what);
    }
    free(p->bytes);
}

/* First block of a kind in a cluster below the root's, so that it has a parent elsewhere. */
static uint32_t find_block(const struct patch *p, int kind)
{
    for (uint32_t k = 0; k < p->blocks; k++)
        if (block_record(p, k)[BL_KIND] == kind && load_u32(block_record(p, k) + BL_CLUSTER) > 0)
            return k;
    ck_abort_msg("no such block");
}

START_TEST(an_untouched_archive_is_whole_after_sealing)
{
    struct patch p = begin();
    struct spc_reader *r = NULL;
    seal(&p);
    ck_assert_int_eq(spc_reader_open_memory(p.bytes, p.size, &r, NULL), SPC_OK);
    case_verify(r);
    spc_reader_close(r);
    free(p.bytes);
}
END_TEST

static void change_u16(uint8_t *at, int by)
{
    store_u16(at, (uint16_t)(load_u16(at) + by));
}


/*
 * Adds to a field of one node of a block, one node after the other: each archive is broken, and
 * some say so by want. A family's block follows from its errors, so others lose the relation.
 */
static void expect_found_in(int kind, uint32_t field, int by, const char *want)
{
    uint32_t found = 0;
    for (uint32_t i = 0; i < 24; i++) {
        struct patch p = begin();
        struct spc_reader *r = NULL;
        struct heard h = {.want = want};
        change_u16(payload(&p, find_block(&p, kind)) + 16 * i + field, by);
        seal(&p);
        ck_assert_int_eq(spc_reader_open_memory(p.bytes, p.size, &r, NULL), SPC_OK);
        ck_assert_int_eq(spc_verify(r, 3, listen, &h, NULL), SPC_CORRUPT);
        spc_reader_close(r);
        free(p.bytes);
        found += h.heard;
    }
    ck_assert_msg(found > 4, "'%s' complained %u times", want, found);
}

START_TEST(a_changed_error_is_found)
{
    expect_found_in(0, ND_E_SELF, 1, "errors");
    expect_found_in(1, ND_E_PARENT, 1, "errors");
    expect_found_in(1, ND_E_PARENT, 1, "law");
    expect_found_in(1, ND_E_SELF, -40, "triangles");
}
END_TEST

/* A link of its block number after of a kind a step too long: only those that nothing else tells go unseen. */
static void expect_link_found(int kind, uint32_t after, const char *want)
{
    uint32_t found = 0;
    for (uint32_t i = 0; i < 24; i++) {
        struct patch p = begin();
        struct spc_reader *r = NULL;
        struct heard h = {.want = want};
        uint32_t k = find_block(&p, kind);
        for (uint32_t skip = after; skip > 0; skip -= block_record(&p, k)[BL_KIND] == kind)
            k++;
        payload(&p, k)[16 * i + ND_LINK]++;
        seal(&p);
        ck_assert_int_eq(spc_reader_open_memory(p.bytes, p.size, &r, NULL), SPC_OK);
        spc_verify(r, 3, listen, &h, NULL);
        spc_reader_close(r);
        free(p.bytes);
        found += h.heard;
    }
    ck_assert_msg(found > 4, "'%s' complained %u times", want, found);
}

START_TEST(a_shrunken_pill_is_found)
{
    struct patch p = begin();
    change_u16(payload(&p, find_block(&p, 0)) + 16 * 3 + ND_RADIUS, -60);
    expect_found(&p, "pills");
    p = begin();
    payload(&p, find_block(&p, 0))[16 * 3 + ND_HEIGHT] = 0;
    expect_found(&p, "pills");
    p = begin();
    change_u16(payload(&p, find_block(&p, 1)) + 16 * 3 + ND_X, 40);
    expect_found(&p, "pills");
}
END_TEST

START_TEST(a_shortened_link_is_found)
{
    for (int kind = 0; kind < 2; kind++) {
        struct patch p = begin();
        payload(&p, find_block(&p, kind))[16 * 7 + ND_LINK] -= 16;
        expect_found(&p, "links are long enough");
    }
    struct patch p = begin();       /* the longest of its block and of all later ones */
    uint8_t *record = block_record(&p, 0);
    store_f32(record + BL_LINK_MAX, load_f32(record + BL_LINK_MAX) * 0.5f);
    expect_found(&p, "blocks are in prefix order");
}
END_TEST

START_TEST(links_that_are_told_once_are_looked_at)
{
    expect_link_found(0, 0, "links are long enough");
    expect_link_found(0, 1, "links are long enough");   /* most of their parents are in the block before */
    expect_link_found(1, 0, "links are long enough");
}
END_TEST

START_TEST(a_changed_range_is_found)
{
    static const struct { int off; float factor; const char *want; } cluster[] = {
        {CL_E_SELF_MIN, 0.99f, "ranges"}, {CL_E_SELF_MAX, 1.01f, "ranges"},
        {CL_E_PARENT_MIN, 0.99f, "ranges"}, {CL_RADIUS_MIN, 0.99f, "ranges"},
        {CL_SUB_LINK_MAX, 1.1f, "boxes, spheres and counts"}, {CL_BOX + 12, 0.9f, "boxes and spheres"},
        {CL_SUB_RADIUS_MAX, 1.1f, "boxes, spheres and counts"},
        {CL_SPHERE + 12, 0.9f, "boxes and spheres"}, {CL_SUB_SPHERE + 12, 0.8f, "boxes, spheres and"},
        {CL_SUB_BOX + 12, 0.8f, "boxes, spheres and counts"},
    };
    for (size_t i = 0; i < sizeof cluster / sizeof *cluster; i++) {
        struct patch p = begin();
        uint8_t *at = p.bytes + p.clus + CL_SIZE * (i < 6 ? 1 : 0) + cluster[i].off;
        store_f32(at, load_f32(at) * cluster[i].factor);
        expect_found(&p, cluster[i].want);
    }
    struct patch p = begin();
    uint8_t *at = block_record(&p, 0) + BL_E_SELF_MIN;
    store_f32(at, load_f32(at) * 1.01f);
    expect_found(&p, "ranges");
}
END_TEST

START_TEST(a_narrowed_cone_is_found)
{
    struct patch p = begin();
    store_f32(p.bytes + p.clus + CL_SIZE + CL_CONE + 12, 0.999f);
    expect_found(&p, "cones");
    p = begin();
    const uint32_t k = find_block(&p, 1);
    struct spc_block b = {.node_count = load_u32(block_record(&p, k) + BL_NODE_COUNT),
                          .vertex_count = load_u32(block_record(&p, k) + BL_VERTEX_COUNT),
                          .kind = SPC_BLOCK_LEAF, .vertex_width = block_record(&p, k)[BL_VERTEX_WIDTH]};
    struct spc_block_layout l;
    spc_block_layout(&b, load_u32(p.bytes + HD_FLAGS), 128, &l);
    for (uint32_t g = 0; g < 128; g++)
        if (load_u16(payload(&p, k) + l.groups + 4 * g) > 0)
            store_u16(payload(&p, k) + l.groups + 4 * g + 2, 32766);
    expect_found(&p, "cones");
}
END_TEST

START_TEST(a_changed_top_is_found)
{
    struct patch p = begin();
    change_u16(p.bytes + p.clus + CL_SIZE + CL_TOPS + TP_SIZE + ND_Y, 1);
    expect_found(&p, "tops");
}
END_TEST

START_TEST(a_changed_family_is_found)
{
    struct patch p = begin();
    const uint32_t k = find_block(&p, 0);
    const uint32_t n = load_u32(block_record(&p, k) + BL_NODE_COUNT);
    uint8_t *children = payload(&p, k) + align_up(align_up(16 * n, 16) + 4 * 128, 16);
    for (uint32_t i = 0; i < n; i++)            /* one child more or less for some node */
        if ((children[i / 2] >> 4 * (i & 1) & 15) == 8) {
            children[i / 2] = (uint8_t)(children[i / 2] ^ (8 ^ 4) << 4 * (i & 1));
            expect_found(&p, "parent relation");
            return;
        }
    ck_abort_msg("no node with four leaves");
}
END_TEST

/* Two nodes of one normal cluster exchanged: every code is valid, yet families are mixed up. */
START_TEST(exchanged_nodes_are_found)
{
    struct patch p = begin();
    const uint32_t k = find_block(&p, 1);
    uint8_t *nodes = payload(&p, k), a[16];
    const uint32_t n = load_u32(block_record(&p, k) + BL_NODE_COUNT);
    for (uint32_t i = 8; i < n; i++)
        if (load_u16(nodes + ND_E_PARENT) != load_u16(nodes + 16 * i + ND_E_PARENT)) {
            memcpy(a, nodes, 16);
            memcpy(nodes, nodes + 16 * i, 16);
            memcpy(nodes + 16 * i, a, 16);
            break;
        }
    expect_found(&p, "errors");
}
END_TEST

START_TEST(bytes_that_must_be_zero_are_looked_at)
{
    struct patch p = begin();
    uint32_t k = find_block(&p, 0);
    uint64_t used = 0;                                          /* a block with padding behind it */
    for (; k < p.blocks; k++) {
        used = CH_SIZE + (uint64_t)load_u32(block_record(&p, k) + BL_STORED_BYTES);
        if (used % 64 != 0)
            break;
    }
    ck_assert_uint_lt(k, p.blocks);
    p.bytes[load_u64(block_record(&p, k) + BL_OFF) + used] = 1;
    expect_found(&p, "every chunk");
    p = begin();
    p.bytes[load_u64(block_record(&p, 2) + BL_OFF) + CH_FLAGS] ^= 1;
    expect_found(&p, "every chunk");
    p = begin();                                                /* behind the last array of a payload */
    for (k = 0; k < p.blocks; k++) {
        const uint32_t n = load_u32(block_record(&p, k) + BL_NODE_COUNT);
        used = align_up(align_up(16 * n, 16) + 4 * 128, 16) + (n + 1) / 2;
        if (block_record(&p, k)[BL_KIND] == SPC_BLOCK_INNER && used % 16 != 0)
            break;
    }
    ck_assert_uint_lt(k, p.blocks);
    payload(&p, k)[used] = 1;
    expect_found(&p, "every chunk");
    p = begin();                                                /* between the head and the chunks */
    p.bytes[section(p.bytes, SE_META, SE_OFF) + section(p.bytes, SE_META, SE_BYTES)] = 1;
    expect_found(&p, "open");
    p = begin();
    p.bytes[HD_ZERO + 7] = 1;
    expect_found(&p, "open");
}
END_TEST

START_TEST(impossible_directories_do_not_open)
{
    static const struct { int section, off, bytes; uint64_t value; } cases[] = {
        {SE_CLUS, CL_PARENT, 4, 0}, {SE_CLUS, CL_CHILD_FIRST, 4, 2}, {SE_CLUS, CL_CHILD_COUNT, 4, 1u << 30},
        {SE_CLUS, CL_LEVEL, 2, 3}, {SE_CLUS, CL_TOP_COUNT, 1, 5}, {SE_CLUS, CL_TOP_LEAF_BITS, 1, 0xF0},
        {SE_CLUS, CL_INNER_COUNT, 4, 0xFFFFFFFF}, {SE_CLUS, CL_BLOCK_FIRST, 4, 1},
        {SE_CLUS, CL_BLOCK_COUNT, 4, 0xFFFFFFF0}, {SE_CLUS, CL_DATA_OFF, 8, 64},
        {SE_CLUS, CL_DATA_BYTES, 8, 1}, {SE_CLUS, CL_ORIGIN, 8, 0x7FF8000000000000},
        {SE_CLUS, CL_BOX, 4, 0x7FC00000}, {SE_CLUS, CL_SPHERE + 12, 4, 0xBF800000},
        {SE_CLUS, CL_CONE, 4, 0x7FC00000}, {SE_CLUS, CL_ZERO_1, 1, 1}, {SE_CLUS, CL_ZERO_2, 1, 1},
        {SE_CLUS, CL_E_PARENT_MAX, 4, 0x3F800000},
        {SE_BLKS, BL_OFF, 8, UINT64_MAX - 8}, {SE_BLKS, BL_STORED_BYTES, 4, 0xFFFFFFFF},
        {SE_BLKS, BL_DIAGONAL, 4, 0x7FC00000}, {SE_BLKS, BL_NODE_COUNT, 4, 0},
        {SE_BLKS, BL_NODE_COUNT, 4, 0xFFFFFFFF}, {SE_BLKS, BL_VERTEX_COUNT, 4, 9},
        {SE_BLKS, BL_CLUSTER, 4, 1}, {SE_BLKS, BL_KIND, 1, 2}, {SE_BLKS, BL_CODEC, 1, 2},
        {SE_BLKS, BL_VERTEX_WIDTH, 1, 3}, {SE_BLKS, BL_ZERO, 1, 1}, {SE_BLKS, BL_STEP_EXP, 2, 0x7FFF},
        {SE_BLKS, BL_LINK_BASE, 2, 97}, {SE_BLKS, BL_E_SELF_MIN, 4, 0x7FC00000},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct patch p = begin();
        uint8_t *at = p.bytes + section(p.bytes, cases[i].section, SE_OFF) + cases[i].off;
        struct spc_reader *r = NULL;
        uint8_t value[8];
        store_u64(value, cases[i].value);
        ck_assert_int_ne(memcmp(at, value, (size_t)cases[i].bytes), 0);
        memcpy(at, value, (size_t)cases[i].bytes);
        /* Chunk checksums are left alone: records may now point anywhere. */
        for (int s = 0; s < SE_COUNT; s++)
            store_u64(p.bytes + HD_SECTIONS + SE_SIZE * s + SE_HASH,
                      XXH64(p.bytes + section(p.bytes, s, SE_OFF), section(p.bytes, s, SE_BYTES), 0));
        store_u64(p.bytes + HD_HASH, XXH64(p.bytes, HD_HASH, 0));
        if (spc_reader_open_memory(p.bytes, p.size, &r, NULL) == SPC_OK)
            ck_abort_msg("case %zu opens", i);
        free(p.bytes);
    }
}
END_TEST

int main(void)
{
    return SUITE("verify", case_start, case_finish, an_untouched_archive_is_whole_after_sealing,
                 a_changed_error_is_found, a_shrunken_pill_is_found, a_shortened_link_is_found,
                 links_that_are_told_once_are_looked_at,
                 a_changed_range_is_found, a_narrowed_cone_is_found, a_changed_top_is_found,
                 a_changed_family_is_found, exchanged_nodes_are_found,
                 bytes_that_must_be_zero_are_looked_at, impossible_directories_do_not_open);
}
