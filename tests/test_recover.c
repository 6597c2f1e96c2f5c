/* Archives as scans: rebuilt whole, and from what is left of them. */
#include "bytes.h"
#include "layout.h"
#include "mesh_case.h"
#include "suite.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <xxhash.h>

/* ---- triangles as a multiset ------------------------------------------------------------------- */

struct triangle {
    double xyz[3][3];
    uint8_t rgba[3][4];
};

struct triangles {
    struct triangle *t;
    size_t count;
};

static int compare(const void *a, const void *b)
{
    return memcmp(a, b, sizeof(struct triangle));
}

/* Any corner may come first: here the one that makes the smallest bytes. */
static void turn(struct triangle *t)
{
    struct triangle all[3];
    memset(all, 0, sizeof all);
    for (int k = 0; k < 3; k++)
        for (int c = 0; c < 3; c++) {
            memcpy(all[k].xyz[c], t->xyz[(c + k) % 3], sizeof t->xyz[0]);
            memcpy(all[k].rgba[c], t->rgba[(c + k) % 3], 4);
        }
    qsort(all, 3, sizeof *all, compare);
    *t = all[0];
}

/* Leaves of the blocks for which wanted[index] holds (NULL: all), sorted. */
static struct triangles collect(const struct spc_reader *r, const bool *wanted)
{
    const struct spc_header *h = spc_reader_header(r);
    struct triangles out = {calloc(h->leaf_count + 1, sizeof *out.t), 0};
    for (uint32_t k = 0; k < h->block_count; k++) {
        struct spc_block b;
        struct spc_block_layout l;
        spc_reader_block(r, k, &b);
        if (b.kind != SPC_BLOCK_LEAF || (wanted && !wanted[k]))
            continue;
        spc_block_layout(&b, h->flags, h->normal_clusters, &l);
        uint8_t *payload = malloc(l.bytes);
        ck_assert_int_eq(spc_block_decode(r, k, true, payload, NULL), SPC_OK);
        for (uint32_t i = 0; i < b.node_count; i++) {
            struct triangle *t = &out.t[out.count++];
            for (uint32_t c = 0; c < 3; c++)
                spc_vertex_decode(r, &b, &l, payload,
                                  load_u16(payload + l.indices + 6 * i + 2 * c), t->xyz[c],
                                  t->rgba[c]);
            turn(t);
        }
        free(payload);
    }
    qsort(out.t, out.count, sizeof *out.t, compare);
    return out;
}

/* ---- archives to damage ------------------------------------------------------------------------ */

struct patient {
    uint8_t *bytes;
    size_t size;
    struct spc_reader *whole;       /* over a copy */
    uint8_t *copy;
    uint32_t blocks;
    bool *alive;                    /* [blocks] what is expected to be found */
};

static struct patient admit(const struct spb_build_options *o)
{
    struct patient p = {0};
    spc_reader_close(case_build(o));
    p.bytes = case_slurp(o->out, &p.size);
    p.copy = case_slurp(o->out, &p.size);
    ck_assert_int_eq(spc_reader_open_memory(p.copy, p.size, &p.whole, NULL), SPC_OK);
    p.blocks = spc_reader_header(p.whole)->block_count;
    p.alive = malloc(p.blocks);
    memset(p.alive, true, p.blocks);
    return p;
}

static struct patient admit_mesh(struct case_mesh m, enum spc_codec codec)
{
    struct spb_build_options o = case_options(case_write(&m, "a.ply"), case_path("a.spc"));
    o.codec = codec;
    case_mesh_free(&m);
    return admit(&o);
}

static void discharge(struct patient *p)
{
    spc_reader_close(p->whole);
    free(p->copy);
    free(p->bytes);
    free(p->alive);
}

static struct spc_block block_of(const struct patient *p, uint32_t k)
{
    struct spc_block b;
    spc_reader_block(p->whole, k, &b);
    return b;
}

/* The n'th block of a kind. */
static uint32_t find_block(const struct patient *p, enum spc_block_kind kind, uint32_t n)
{
    for (uint32_t k = 0; k < p->blocks; k++)
        if (block_of(p, k).kind == kind && n-- == 0)
            return k;
    ck_abort_msg("no such block");
}

static const char *save(const struct patient *p, const char *name)
{
    const char *path = case_path(name);
    FILE *f = fopen(path, "wb");
    ck_assert_ptr_nonnull(f);
    ck_assert_uint_eq(fwrite(p->bytes, 1, p->size, f), p->size);
    ck_assert_int_eq(fclose(f), 0);
    return path;
}

static struct spb_build_options rescue_options(const struct patient *p)
{
    struct spb_build_options o = case_options(save(p, "bad.spc"), case_path("out.spc"));
    o.salvage = true;
    return o;
}

/* Rebuilds, verifies, and finds the triangles of the blocks alive, no other. */
static struct spb_build_report rescue(const struct patient *p)
{
    const struct spb_build_options o = rescue_options(p);
    struct spb_build_report report;
    struct spc_error err = {0};
    struct spc_reader *r = NULL;
    if (spb_build(&o, &report, NULL, &err) != SPC_OK)
        ck_abort_msg("nothing is rescued: %s", err.what);
    ck_assert_int_eq(spc_reader_open(o.out, &r, NULL), SPC_OK);
    case_verify(r);
    struct triangles want = collect(p->whole, p->alive), got = collect(r, NULL);
    ck_assert_uint_eq(got.count, want.count);
    ck_assert_mem_eq(got.t, want.t, want.count * sizeof *want.t);
    ck_assert_uint_eq(report.salvage.triangles, want.count);
    ck_assert_int_eq(spc_reader_header(r)->vertex_exp, spc_reader_header(p->whole)->vertex_exp);
    free(want.t);
    free(got.t);
    spc_reader_close(r);
    return report;
}

/* Without salvage a damaged archive is refused, as the reader would. */
static void expect_refused(const struct patient *p, enum spc_status status)
{
    struct spb_build_options o = rescue_options(p);
    struct spb_build_report report;
    struct spc_error err = {0};
    const char *file = NULL;
    o.out = case_path("none.spc");
    o.salvage = false;
    ck_assert_int_eq(spb_build(&o, &report, &file, &err), status);
    ck_assert_ptr_eq(file, o.scan);
    ck_assert_str_ne(err.what, "");
}

/* ---- whole ------------------------------------------------------------------------------------- */

static struct case_mesh mesh_of(int kind)
{
    struct case_mesh m = kind % 3 == 0 ? case_sphere(3000, 5)
                         : kind % 3 == 1 ? case_soup(2500, 6) : case_sheet(2500, 7);
    if (kind == 3 || kind == 4)
        case_color(&m);
    if (kind == 6) {
        m.wide = true;
        case_transform(&m, 0.5, (double[3]){500000, 5400000, 120});
    }
    if (kind == 7)
        case_transform(&m, 1e-12, (double[3]){0, 0, 0});
    return m;
}

START_TEST(a_whole_archive_is_rebuilt_triangle_by_triangle)
{
    for (int kind = 0; kind < 8; kind++) {
        struct patient p = admit_mesh(mesh_of(kind), kind % 2 ? SPC_CODEC_RAW : SPC_CODEC_ZSTD);
        const struct spb_build_report report = rescue(&p);
        const struct spb_salvage *v = &report.salvage;
        const struct spc_header *h = spc_reader_header(p.whole);
        ck_assert(v->header && v->directory && v->meta);
        ck_assert_int_eq(v->fault.status, SPC_OK);
        ck_assert_uint_eq(v->blocks, p.blocks);
        ck_assert_uint_eq(v->blocks_of, p.blocks);
        ck_assert_uint_eq(v->triangles_of, h->leaf_count);
        ck_assert_uint_eq(v->lost_clusters, 0);
        ck_assert_int_eq(report.closed, (h->flags & SPC_FLAG_CULL_BACK) != 0);
        discharge(&p);
    }
}
END_TEST

START_TEST(a_whole_archive_is_a_scan_like_others)
{
    for (int kind = 0; kind < 7; kind += 3) {
        struct patient p = admit_mesh(mesh_of(kind), SPC_CODEC_ZSTD);
        struct spb_build_options o = case_options(case_path("a.spc"), case_path("b.spc"));
        struct spb_build_options t = o;
        o.codec = SPC_CODEC_RAW;
        struct spc_reader *r = case_build(&o);
        struct triangles want = collect(p.whole, NULL), got = collect(r, NULL);
        case_verify(r);
        ck_assert_uint_eq(got.count, want.count);
        ck_assert_mem_eq(got.t, want.t, want.count * sizeof *want.t);
        ck_assert_uint_eq(spc_reader_header(r)->flags, spc_reader_header(p.whole)->flags);
        t.out = case_path("c.spc");             /* parts and threads leave no trace */
        t.codec = SPC_CODEC_RAW;
        t.threads = 1;
        t.part_faces = 200;
        spc_reader_close(case_build(&t));
        size_t x = 0, y = 0;
        uint8_t *a = case_slurp(o.out, &x), *b = case_slurp(t.out, &y);
        ck_assert_uint_eq(x, y);
        ck_assert_mem_eq(a, b, x);
        free(a);
        free(b);
        free(want.t);
        free(got.t);
        spc_reader_close(r);
        discharge(&p);
    }
}
END_TEST

/* Corners that fell together on the lattice, and blocks that equal each other byte for byte. */
START_TEST(triangles_without_extent_are_kept)
{
    struct case_mesh m = case_sheet(3000, 9);
    for (uint32_t i = 0; i < m.vertex_count; i++)
        for (int a = 0; a < 3; a++)
            m.xyz[i][a] = i % 7 == 0 ? m.xyz[i][a] : 0.5;
    struct patient p = admit_mesh(m, SPC_CODEC_ZSTD);
    rescue(&p);
    discharge(&p);
    m = case_sheet(3000, 9);
    for (uint32_t f = 0; f < m.face_count; f++)
        memcpy(m.face[f], m.face[0], sizeof m.face[0]);
    p = admit_mesh(m, SPC_CODEC_RAW);
    rescue(&p);
    discharge(&p);
}
END_TEST

/* ---- damaged ----------------------------------------------------------------------------------- */

static void check_lost(const struct patient *p, const struct spb_salvage *v, uint32_t block)
{
    const struct spc_block b = block_of(p, block);
    bool *only = calloc(p->blocks, sizeof *only);
    only[block] = true;
    struct triangles lost = collect(p->whole, only);
    ck_assert_uint_eq(v->lost_clusters, 1);
    ck_assert_uint_eq(v->lost[0].cluster, b.cluster);
    ck_assert_uint_eq(v->lost[0].triangles, b.node_count);
    ck_assert_uint_ge(v->lost[0].triangles_of, b.node_count);
    for (size_t i = 0; i < lost.count; i++)
        for (int k = 0; k < 9; k++) {
            const double x = lost.t[i].xyz[k / 3][k % 3];
            ck_assert(x >= v->lost[0].min[k % 3] && x <= v->lost[0].max[k % 3]);
        }
    free(lost.t);
    free(only);
}

START_TEST(a_flipped_bit_loses_the_triangles_of_its_block_alone)
{
    for (int kind = 3; kind < 7; kind++) {
        struct patient p = admit_mesh(mesh_of(kind), kind % 2 ? SPC_CODEC_RAW : SPC_CODEC_ZSTD);
        for (uint32_t n = 0; n < 9; n += 2) {
            const uint32_t k = find_block(&p, SPC_BLOCK_LEAF, n);
            const struct spc_block b = block_of(&p, k);
            uint8_t *at = p.bytes + b.off + (n == 4 ? 0 : n == 6 ? 20 : 64 + b.stored_bytes / 2);
            *at ^= 16;
            p.alive[k] = false;
            const struct spb_build_report report = rescue(&p);
            ck_assert_uint_eq(report.salvage.blocks, p.blocks - 1);
            check_lost(&p, &report.salvage, k);
            expect_refused(&p, SPC_CHECKSUM);
            *at ^= 16;
            p.alive[k] = true;
        }
        const struct spc_block inner = block_of(&p, find_block(&p, SPC_BLOCK_INNER, 2));
        p.bytes[inner.off + 70] ^= 1;           /* inner nodes are made anew */
        const struct spb_build_report report = rescue(&p);
        ck_assert_uint_eq(report.salvage.blocks, p.blocks - 1);
        ck_assert_uint_eq(report.salvage.lost_clusters, 0);
        discharge(&p);
    }
}
END_TEST

START_TEST(many_lost_clusters_are_counted_and_some_named)
{
    struct case_mesh m = case_sphere(9000, 5);
    struct spb_build_options o = case_options(case_write(&m, "a.ply"), case_path("a.spc"));
    o.cluster_nodes = 200;
    o.block_nodes = 40;             /* several blocks a cluster */
    case_mesh_free(&m);
    struct patient p = admit(&o);
    uint32_t clusters = 0, last = SPC_NONE, lost = 0;
    uint64_t named = 0;
    for (uint32_t k = 0; k < p.blocks; k++) {
        const struct spc_block b = block_of(&p, k);
        if (b.kind != SPC_BLOCK_LEAF || k > p.blocks / 2)
            continue;
        p.alive[k] = false;
        p.bytes[b.off + 9] ^= 1;
        clusters += b.cluster != last;
        last = b.cluster;
        lost += b.node_count;
        named += clusters <= SPB_LOST_MAX ? b.node_count : 0;
    }
    ck_assert_uint_gt(clusters, SPB_LOST_MAX + 2);
    const struct spb_build_report report = rescue(&p);
    ck_assert_uint_eq(report.salvage.lost_clusters, clusters);
    ck_assert_uint_eq(report.salvage.triangles, report.salvage.triangles_of - lost);
    for (int i = 0; i < SPB_LOST_MAX; i++)
        named -= report.salvage.lost[i].triangles;
    ck_assert_uint_eq(named, 0);
    discharge(&p);
}
END_TEST

START_TEST(a_destroyed_head_loses_no_triangle)
{
    for (int kind = 3; kind < 7; kind++) {
        struct patient p = admit_mesh(mesh_of(kind), kind % 2 ? SPC_CODEC_ZSTD : SPC_CODEC_RAW);
        const struct spc_header h = *spc_reader_header(p.whole);
        memset(p.bytes + load_u64(p.bytes + HD_SECTIONS + SE_SIZE * SE_CLUS + SE_OFF) + 30, 0x5A, 99);
        struct spb_build_report report = rescue(&p);
        ck_assert(report.salvage.header && !report.salvage.directory && report.salvage.meta);
        ck_assert_uint_eq(report.salvage.triangles_of, h.leaf_count);
        expect_refused(&p, SPC_CHECKSUM);
        p.bytes[HD_BOX] ^= 2;
        report = rescue(&p);
        ck_assert(!report.salvage.header && !report.salvage.meta);
        ck_assert_uint_eq(report.salvage.triangles_of, 0);
        expect_refused(&p, SPC_CHECKSUM);
        memset(p.bytes, 0, h.head_bytes);
        report = rescue(&p);
        ck_assert_uint_eq(report.salvage.blocks, p.blocks);
        expect_refused(&p, SPC_INPUT_FORMAT);
        discharge(&p);
    }
}
END_TEST

START_TEST(a_cut_archive_gives_the_blocks_before_the_cut)
{
    for (int kind = 3; kind < 7; kind++) {
        struct patient p = admit_mesh(mesh_of(kind), kind % 2 ? SPC_CODEC_RAW : SPC_CODEC_ZSTD);
        const size_t size = p.size;
        for (int part = 9; part > 3; part -= 2) {
            p.size = size * (size_t)part / 10;
            for (uint32_t k = 0; k < p.blocks; k++) {
                const struct spc_block b = block_of(&p, k);
                p.alive[k] = b.off + spc_block_chunk_bytes(&b) <= p.size;
            }
            const struct spb_build_report report = rescue(&p);
            ck_assert(report.salvage.header && report.salvage.directory);
            ck_assert_uint_lt(report.salvage.triangles, report.salvage.triangles_of);
            ck_assert_uint_gt(report.salvage.lost_clusters, 0);
            expect_refused(&p, SPC_TRUNCATED);
        }
        discharge(&p);
    }
}
END_TEST

/* A copy that left out unreadable sectors: what follows lies elsewhere, and is found. */
START_TEST(blocks_behind_missing_sectors_are_found)
{
    struct patient p = admit_mesh(mesh_of(3), SPC_CODEC_ZSTD);
    const struct spc_block b = block_of(&p, find_block(&p, SPC_BLOCK_LEAF, 3));
    const size_t from = b.off + 64, gap = 512;
    for (uint32_t k = 0; k < p.blocks; k++) {
        const struct spc_block c = block_of(&p, k);
        p.alive[k] = c.off + spc_block_chunk_bytes(&c) <= from || c.off >= from + gap;
    }
    memmove(p.bytes + from, p.bytes + from + gap, p.size - from - gap);
    p.size -= gap;
    rescue(&p);
    discharge(&p);
}
END_TEST

static void append(struct patient *p, const uint8_t *bytes, size_t count)
{
    const size_t at = align_up(p->size, 64);
    p->bytes = realloc(p->bytes, at + count);
    memset(p->bytes + p->size, 0, at - p->size);
    memcpy(p->bytes + at, bytes, count);
    p->size = at + count;
}

START_TEST(blocks_that_do_not_belong_are_passed_over)
{
    struct patient p = admit_mesh(mesh_of(0), SPC_CODEC_ZSTD);
    struct case_mesh other = case_sphere(2000, 99);
    case_transform(&other, 5, (double[3]){1, 2, 3});
    struct spb_build_options o = case_options(case_write(&other, "o.ply"), case_path("o.spc"));
    struct spc_reader *r = case_build(&o);
    ck_assert_int_ne(spc_reader_header(r)->unit_exp, spc_reader_header(p.whole)->unit_exp);
    spc_reader_close(r);
    case_mesh_free(&other);
    size_t bytes = 0;
    uint8_t *stranger = case_slurp(o.out, &bytes);
    append(&p, p.copy, p.size);                 /* its own blocks again */
    struct spb_build_report report = rescue(&p);
    ck_assert_uint_eq(report.salvage.blocks_foreign, p.blocks);
    append(&p, stranger, bytes);                /* and another archive */
    report = rescue(&p);
    ck_assert_uint_gt(report.salvage.blocks_foreign, p.blocks);
    discharge(&p);

    p = admit_mesh(mesh_of(0), SPC_CODEC_ZSTD);
    append(&p, stranger, bytes);
    memset(p.bytes, 0, spc_reader_header(p.whole)->head_bytes);
    report = rescue(&p);                        /* told by their exponents alone */
    ck_assert_uint_gt(report.salvage.blocks_foreign, 0);
    free(stranger);
    discharge(&p);
}
END_TEST

/* Sealed, so that its checksums hold, yet its indices lead nowhere. */
START_TEST(a_block_that_proves_itself_but_does_not_decode_is_lost)
{
    struct patient p = admit_mesh(mesh_of(2), SPC_CODEC_RAW);
    const uint32_t k = find_block(&p, SPC_BLOCK_LEAF, 1);
    const struct spc_block b = block_of(&p, k);
    const struct spc_header *h = spc_reader_header(p.whole);
    struct spc_block_layout l;
    spc_block_layout(&b, h->flags, h->normal_clusters, &l);
    uint8_t *chunk = p.bytes + b.off;
    store_u16(chunk + CH_SIZE + l.indices, 0xFFFF);
    const uint64_t hash = XXH64(chunk + CH_KIND, spc_block_chunk_bytes(&b) - CH_KIND, load_u64(chunk));
    store_u64(chunk + CH_HASH, hash);
    uint8_t *section = p.bytes + HD_SECTIONS + SE_SIZE * SE_BLKS;
    uint8_t *blocks = p.bytes + load_u64(section + SE_OFF);
    store_u64(blocks + (size_t)BL_SIZE * k + BL_HASH, hash);
    store_u64(section + SE_HASH, XXH64(blocks, load_u64(section + SE_BYTES), 0));
    store_u64(p.bytes + HD_HASH, XXH64(p.bytes, HD_HASH, 0));
    p.alive[k] = false;
    const struct spb_build_report report = rescue(&p);
    ck_assert_uint_eq(report.salvage.blocks, p.blocks - 1);
    check_lost(&p, &report.salvage, k);
    expect_refused(&p, SPC_CORRUPT);
    discharge(&p);
}
END_TEST

static void expect_nothing(const char *path, bool salvage, const char *what)
{
    struct spb_build_options o = case_options(path, case_path("none.spc"));
    struct spb_build_report report;
    struct spc_error err = {0};
    o.salvage = salvage;
    ck_assert_int_eq(spb_build(&o, &report, NULL, &err), SPC_INPUT_EMPTY);
    ck_assert_msg(strstr(err.what, what) != NULL, "says '%s'", err.what);
    FILE *f = fopen(o.out, "rb");
    ck_assert_ptr_null(f);
}

START_TEST(nothing_comes_of_points_scans_and_dust)
{
    struct case_mesh m = case_sphere(1000, 3);
    struct spb_build_options o = case_options(case_write(&m, "a.ply"), case_path("a.spc"));
    o.triangles = false;
    struct patient p = admit(&o);
    expect_nothing(o.out, false, "points only");
    expect_nothing(o.out, true, "points only");
    memset(p.bytes, 0, 300);
    expect_nothing(save(&p, "p.spc"), true, "points only");
    expect_nothing(o.scan, true, "whole block of an .spc archive");
    discharge(&p);
    p = admit_mesh(m, SPC_CODEC_ZSTD);          /* and frees the mesh */
    for (uint32_t k = 0; k < p.blocks; k++)
        p.bytes[block_of(&p, k).off + 40] ^= 1;
    expect_nothing(save(&p, "p.spc"), true, "no block with triangles");
    p.size = 0;
    expect_nothing(save(&p, "p.spc"), true, "the file is empty");
    discharge(&p);
}
END_TEST

int main(void)
{
    return SUITE("recover", case_start, case_finish,
                 a_whole_archive_is_rebuilt_triangle_by_triangle,
                 a_whole_archive_is_a_scan_like_others, triangles_without_extent_are_kept,
                 a_flipped_bit_loses_the_triangles_of_its_block_alone,
                 many_lost_clusters_are_counted_and_some_named, a_destroyed_head_loses_no_triangle,
                 a_cut_archive_gives_the_blocks_before_the_cut,
                 blocks_behind_missing_sectors_are_found,
                 blocks_that_do_not_belong_are_passed_over,
                 a_block_that_proves_itself_but_does_not_decode_is_lost,
                 nothing_comes_of_points_scans_and_dust);
}
