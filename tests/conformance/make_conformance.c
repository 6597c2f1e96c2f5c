/*
 * make_conformance.c - writes the archives of spec/conformance: good ones that a reader must
 * decode, and bad ones with the status that it must give.
 *
 * Run by hand (make conformance) when the format has changed; the files are committed, so that
 * readers are held to bytes and not to what this tree's writer does today.
 */
#include "bytes.h"
#include "layout.h"
#include "mesh_case.h"
#include "reseal.h"
#include "suite.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <xxhash.h>

enum { ALL = RESEAL_HASHES | RESEAL_CHUNKS | RESEAL_COUNTS };

static void write_file(const char *kind, const char *name, const uint8_t *bytes, size_t size)
{
    char path[400];
    snprintf(path, sizeof path, "%s/%s/%s.spc", getenv("SPC_CONFORMANCE"), kind, name);
    FILE *f = fopen(path, "wb");
    ck_assert_msg(f != NULL, "cannot write %s", path);
    ck_assert_uint_eq(fwrite(bytes, 1, size, f), size);
    ck_assert_int_eq(fclose(f), 0);
    ck_assert_msg(size <= 65536, "%s has %zu bytes", name, size);
}

/* ---- good -------------------------------------------------------------------------------------- */

enum shape { ONE, TWO, SOUP, SPHERE, SHEET };

static const struct good {
    const char *name;
    enum shape shape;
    uint32_t triangles, cluster_nodes, block_nodes, normal_clusters;
    bool zstd, colors, points, wide, paper;
    double scale, offset[3];
    double tiny;                    /* triangles this much smaller, where they are */
} GOOD[] = {
    {.name = "one-triangle", .shape = ONE},
    {.name = "two-triangles", .shape = TWO, .zstd = true},
    {.name = "soup-raw", .shape = SOUP, .triangles = 24, .cluster_nodes = 24, .block_nodes = 8},
    {.name = "soup-zstd", .shape = SOUP, .triangles = 70, .cluster_nodes = 40, .block_nodes = 20,
     .zstd = true},
    {.name = "sphere-one-block", .shape = SPHERE, .triangles = 400, .zstd = true},
    {.name = "sphere-raw-128-axes", .shape = SPHERE, .triangles = 120, .normal_clusters = 128},
    {.name = "sphere-clusters-17-axes", .shape = SPHERE, .triangles = 200, .cluster_nodes = 100,
     .block_nodes = 30, .normal_clusters = 17, .zstd = true},
    {.name = "colours-raw", .shape = SHEET, .triangles = 60, .colors = true},
    {.name = "colours-zstd", .shape = SHEET, .triangles = 150, .cluster_nodes = 100,
     .block_nodes = 40, .colors = true, .zstd = true},
    {.name = "points-raw", .shape = SPHERE, .triangles = 100, .points = true},
    {.name = "points-colours-zstd", .shape = SHEET, .triangles = 120, .cluster_nodes = 100,
     .block_nodes = 40, .points = true, .colors = true, .zstd = true},
    {.name = "georeferenced", .shape = SHEET, .triangles = 100, .wide = true, .zstd = true,
     .scale = 10, .offset = {500000, 5400000, 120}},
    {.name = "scale-1e-12", .shape = SPHERE, .triangles = 100, .zstd = true, .scale = 1e-12},
    {.name = "scale-1e12", .shape = SOUP, .triangles = 100, .scale = 1e12},
    {.name = "far-apart-raw", .shape = SOUP, .triangles = 20, .wide = true, .tiny = 1e-9},
    {.name = "far-apart-zstd", .shape = SOUP, .triangles = 40, .wide = true, .tiny = 1e-6,
     .zstd = true},
    {.name = "error-paper", .shape = SPHERE, .triangles = 150, .paper = true, .zstd = true},
    {.name = "deep-clusters", .shape = SOUP, .triangles = 40, .cluster_nodes = 16, .block_nodes = 4,
     .normal_clusters = 5, .zstd = true},
};

static struct case_mesh shape_of(const struct good *g)
{
    struct case_mesh m = g->shape == SPHERE  ? case_sphere(g->triangles, 7)
                         : g->shape == SHEET ? case_sheet(g->triangles, 7)
                                             : case_soup(g->triangles ? g->triangles : 2, 7);
    if (g->shape == ONE || g->shape == TWO) {
        static const double corners[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0.25}, {1, 1, 0.5}};
        static const uint32_t faces[2][3] = {{0, 1, 2}, {2, 1, 3}};
        memcpy(m.xyz, corners, sizeof corners);
        memcpy(m.face, faces, sizeof faces);
        m.face_count = g->shape == ONE ? 1 : 2;
        m.vertex_count = m.face_count + 2;
    }
    if (g->colors)
        case_color(&m);
    m.wide = g->wide;
    for (uint32_t i = 0; g->tiny > 0 && i < m.vertex_count; i++)
        for (int a = 0; a < 3; a++) {
            const double first = m.xyz[i - i % 3][a];
            m.xyz[i][a] = first + g->tiny * (m.xyz[i][a] - first);
        }
    if (g->scale > 0)
        case_transform(&m, g->scale, g->offset);
    return m;
}

static uint8_t *make_good(const struct good *g, size_t *size)
{
    struct case_mesh m = shape_of(g);
    struct spb_build_options o;
    spb_build_defaults(&o);
    o.scan = case_write(&m, "scan.ply");
    o.out = case_path("scan.spc");
    o.force = true;
    o.codec = g->zstd ? SPC_CODEC_ZSTD : SPC_CODEC_RAW;
    o.triangles = !g->points;
    o.paper_error = g->paper;
    o.cluster_nodes = g->cluster_nodes ? g->cluster_nodes : o.cluster_nodes;
    o.block_nodes = g->block_nodes ? g->block_nodes : o.block_nodes;
    o.normal_clusters = g->normal_clusters;
    struct spc_reader *r = case_build(&o);
    case_verify(r);
    spc_reader_close(r);
    case_mesh_free(&m);
    return case_slurp(o.out, size);
}

static uint8_t *good_named(const char *name, size_t *size)
{
    for (size_t i = 0; i < sizeof GOOD / sizeof *GOOD; i++)
        if (strcmp(GOOD[i].name, name) == 0)
            return make_good(&GOOD[i], size);
    ck_abort_msg("no archive %s", name);
}

/* An optional section behind the metadata: readers check it and pass it over. */
static void write_optional(void)
{
    static const char text[] = "a picture would be here";
    size_t size;
    uint8_t *bytes = good_named("two-triangles", &size);
    const size_t data = (size_t)align_up(load_u64(bytes + HD_HEAD_BYTES), SPC_CHUNK_ALIGN);
    bytes = realloc(bytes, size + SPC_CHUNK_ALIGN);
    memmove(bytes + data + SPC_CHUNK_ALIGN, bytes + data, size - data);
    memset(bytes + data, 0, SPC_CHUNK_ALIGN);
    memcpy(bytes + data, text, sizeof text);
    uint8_t *se = bytes + HD_SECTIONS + SE_SIZE * SE_COUNT;
    memcpy(se + SE_TAG, "THMB", 4);
    store_u32(se + SE_RECORD_BYTES, 1);
    store_u64(se + SE_OFF, data);
    store_u64(se + SE_BYTES, sizeof text);
    store_u64(se + SE_HASH, XXH64(text, sizeof text, 0));
    store_u64(bytes + HD_HEAD_BYTES, data + sizeof text);
    size = reseal(bytes, size + SPC_CHUNK_ALIGN, ALL);
    write_file("good", "optional-section", bytes, size);
    free(bytes);
}

START_TEST(good_archives)
{
    for (size_t i = 0; i < sizeof GOOD / sizeof *GOOD; i++) {
        size_t size;
        uint8_t *bytes = make_good(&GOOD[i], &size);
        write_file("good", GOOD[i].name, bytes, size);
        free(bytes);
    }
    write_optional();
}
END_TEST

/* ---- bad --------------------------------------------------------------------------------------- */

static struct archive {
    uint8_t *bytes;
    size_t size;
} a;

static uint8_t *record(int section, uint32_t k)
{
    uint64_t first = 0;
    const uint32_t n = reseal_records(a.bytes, a.size, section, &first);
    ck_assert_uint_lt(k, n);
    return a.bytes + first + (uint64_t)(section == SE_CLUS ? CL_SIZE : BL_SIZE) * k;
}

/* Payload of the first block of a kind. */
static uint8_t *payload(enum spc_block_kind kind, struct spc_block *b, struct spc_block_layout *l)
{
    struct spc_reader *r = NULL;
    ck_assert_int_eq(spc_reader_open_memory(a.bytes, a.size, &r, NULL), SPC_OK);
    const struct spc_header *h = spc_reader_header(r);
    uint32_t k = 0;
    for (spc_reader_block(r, k, b); b->kind != kind; k++)
        spc_reader_block(r, k + 1, b);
    ck_assert(spc_block_layout(b, h->flags, h->normal_clusters, l));
    spc_reader_close(r);
    return a.bytes + b->off + CH_SIZE;
}

static void header_u32(int field, uint32_t value)
{
    store_u32(a.bytes + field, value);
}

static void node_u16(enum spc_block_kind kind, uint32_t node, int field, int by)
{
    struct spc_block b;
    struct spc_block_layout l;
    uint8_t *p = payload(kind, &b, &l) + l.nodes + (size_t)ND_SIZE * node + field;
    store_u16(p, (uint16_t)(load_u16(p) + by));
}

static void break_it(const char *name)
{
    struct spc_block b;
    struct spc_block_layout l;
    if (strcmp(name, "empty") == 0) {
        a.size = 0;
    } else if (strcmp(name, "text") == 0) {
        a.size = (size_t)snprintf((char *)a.bytes, 40, "ply\nformat ascii 1.0\n");
    } else if (strcmp(name, "cut-in-header") == 0) {
        a.size = 300;
    } else if (strcmp(name, "cut-in-data") == 0) {
        a.size -= 100;
    } else if (strcmp(name, "byte-behind") == 0) {
        a.bytes[a.size++] = 0;
    } else if (strcmp(name, "version-2") == 0) {
        store_u16(a.bytes + HD_VERSION, 2);
        store_u64(a.bytes + HD_HASH, XXH64(a.bytes, HD_HASH, 0));
    } else if (strcmp(name, "header-bit") == 0) {
        a.bytes[HD_BOX] ^= 1;
    } else if (strcmp(name, "directory-bit") == 0) {
        record(SE_CLUS, 0)[CL_BOX] ^= 1;
    } else if (strcmp(name, "chunk-bit") == 0) {
        payload(SPC_BLOCK_LEAF, &b, &l)[20] ^= 16;
    } else if (strcmp(name, "reserved-bit") == 0) {
        header_u32(HD_RESERVED_BITS, 1u << 31);
    } else if (strcmp(name, "unknown-flag") == 0) {
        header_u32(HD_FLAGS, load_u32(a.bytes + HD_FLAGS) | 1u << 7);
    } else if (strcmp(name, "unknown-codec") == 0) {
        record(SE_BLKS, 0)[BL_CODEC] = 2;
    } else if (strcmp(name, "blocks-too-large") == 0) {
        header_u32(HD_BLOCK_NODES, 65536);
    } else if (strcmp(name, "too-many-axes") == 0) {
        header_u32(HD_NORMAL_CLUSTERS, 129);
    } else if (strcmp(name, "children-out-of-order") == 0) {
        store_u32(record(SE_CLUS, 0) + CL_CHILD_FIRST, 2);
    } else if (strcmp(name, "invalid-normal") == 0) {
        payload(SPC_BLOCK_INNER, &b, &l)[l.nodes + ND_NORMAL] = 0xFF;
    } else if (strcmp(name, "padding") == 0) {
        record(SE_BLKS, 0);
        payload(SPC_BLOCK_LEAF, &b, &l)[b.stored_bytes] = 1;
    } else if (strcmp(name, "prelude") == 0) {
        payload(SPC_BLOCK_LEAF, &b, &l)[CO_E_SHIFT] = 9;
    } else if (strcmp(name, "plane-too-long") == 0) {
        uint8_t *entry = payload(SPC_BLOCK_LEAF, &b, &l) + CO_SIZE;
        store_u32(entry, load_u32(entry) + 1);
    } else if (strcmp(name, "relation") == 0) {
        payload(SPC_BLOCK_INNER, &b, &l)[l.children] &= 0xF0;       /* an owner without a cluster */
    } else if (strcmp(name, "error-changed") == 0) {
        node_u16(SPC_BLOCK_LEAF, 1, ND_E_PARENT, 1);
    } else if (strcmp(name, "short-link") == 0) {
        payload(SPC_BLOCK_LEAF, &b, &l)[l.nodes + ND_LINK] -= 40;
    } else if (strcmp(name, "pill-too-flat") == 0) {
        payload(SPC_BLOCK_INNER, &b, &l)[l.nodes + ND_HEIGHT] = 0;
    } else if (strcmp(name, "leaf-is-not-its-disk") == 0) {
        node_u16(SPC_BLOCK_LEAF, 2, ND_RADIUS, 1);
    } else if (strcmp(name, "vertex-outside") == 0) {
        store_u16(payload(SPC_BLOCK_LEAF, &b, &l) + l.vertices, 0xFFFF);
    } else {
        ck_abort_msg("nothing makes %s", name);
    }
}

static const struct bad {
    const char *name, *from;
    unsigned seal;
} BAD[] = {
    {"empty", "one-triangle", 0}, {"text", "one-triangle", 0}, {"cut-in-header", "soup-raw", 0},
    {"cut-in-data", "soup-raw", 0}, {"byte-behind", "soup-raw", 0}, {"version-2", "soup-raw", 0},
    {"header-bit", "soup-raw", 0}, {"directory-bit", "soup-raw", 0}, {"chunk-bit", "soup-zstd", 0},
    {"reserved-bit", "soup-raw", RESEAL_HASHES}, {"unknown-flag", "soup-raw", RESEAL_HASHES},
    {"unknown-codec", "soup-raw", RESEAL_HASHES | RESEAL_CHUNKS},
    {"blocks-too-large", "soup-raw", RESEAL_HASHES}, {"too-many-axes", "soup-raw", RESEAL_HASHES},
    {"children-out-of-order", "soup-raw", RESEAL_HASHES},
    {"invalid-normal", "soup-raw", RESEAL_HASHES}, {"padding", "soup-zstd", RESEAL_HASHES},
    {"prelude", "soup-zstd", RESEAL_HASHES}, {"plane-too-long", "soup-zstd", RESEAL_HASHES},
    {"relation", "soup-raw", RESEAL_HASHES}, {"error-changed", "soup-raw", RESEAL_HASHES},
    {"short-link", "soup-raw", RESEAL_HASHES}, {"pill-too-flat", "soup-raw", RESEAL_HASHES}, {"leaf-is-not-its-disk", "soup-raw", RESEAL_HASHES},
    {"vertex-outside", "soup-raw", RESEAL_HASHES},
};

START_TEST(bad_archives)
{
    for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++) {
        a.bytes = good_named(BAD[i].from, &a.size);
        a.bytes = realloc(a.bytes, a.size + 64);
        break_it(BAD[i].name);
        if (BAD[i].seal)
            a.size = reseal(a.bytes, a.size, BAD[i].seal);
        write_file("bad", BAD[i].name, a.bytes, a.size);
        free(a.bytes);
    }
}
END_TEST

int main(void)
{
    if (getenv("SPC_CONFORMANCE") == NULL) {
        fprintf(stderr, "set SPC_CONFORMANCE to the folder that good/ and bad/ are in\n");
        return 2;
    }
    return SUITE("conformance", case_start, case_finish, good_archives, bad_archives);
}
