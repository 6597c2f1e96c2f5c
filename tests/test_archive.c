/* Whole archives: built from small scans of many kinds, verified, compared, broken. */
#include "bytes.h"
#include "layout.h"
#include "mesh_case.h"
#include "suite.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

/* ---- they are whole ----------------------------------------------------------------------------- */

static void expect_whole(struct case_mesh mesh, const struct spb_build_options *options)
{
    struct spc_reader *r = case_build(options);
    case_verify(r);
    ck_assert_uint_eq(spc_reader_header(r)->leaf_count, mesh.face_count);
    spc_reader_close(r);
    case_mesh_free(&mesh);
}

START_TEST(archives_of_every_shape_verify)
{
    struct case_mesh meshes[] = {case_sphere(3000, 1), case_soup(2000, 2), case_sheet(2500, 3)};
    for (int i = 0; i < 6; i++) {
        struct case_mesh *m = &meshes[i % 3];
        if (i == 3)
            for (int k = 0; k < 3; k++)
                case_color(&meshes[k]);
        struct spc_reader *r = case_archive(m);
        case_verify(r);
        ck_assert_uint_eq(spc_reader_header(r)->leaf_count, m->face_count);
        ck_assert_uint_gt(spc_reader_header(r)->cluster_count, 3);
        spc_reader_close(r);
    }
    for (int i = 0; i < 3; i++)
        case_mesh_free(&meshes[i]);
}
END_TEST

START_TEST(archives_verify_with_every_option)
{
    for (int i = 0; i < 9; i++) {
        struct case_mesh m = i % 2 ? case_sphere(1500, 5) : case_soup(1500, 6);
        if (i % 3 == 0)
            case_color(&m);
        struct spb_build_options o = case_options(case_write(&m, "a.ply"), case_path("a.spc"));
        o.codec = i == 1 ? SPC_CODEC_RAW : SPC_CODEC_ZSTD;
        o.paper_error = i == 2;
        o.triangles = i != 3;
        o.normal_clusters = i == 4 ? 1 : i == 5 ? 17 : 128;
        o.cluster_nodes = i == 6 ? 16 : i == 7 ? 100000 : 700;
        o.block_nodes = i == 6 ? 4 : i == 7 ? 65535 : 150;
        o.level = i == 8 ? 19 : 1;
        expect_whole(m, &o);
    }
}
END_TEST

START_TEST(archives_of_very_few_triangles_verify)
{
    for (uint32_t n = 1; n <= 9; n++) {
        struct case_mesh m = case_soup(n, n);
        struct spb_build_options o = case_options(case_write(&m, "a.ply"), case_path("a.spc"));
        o.cluster_nodes = 16;
        expect_whole(m, &o);
    }
}
END_TEST

/* What a split rule could choke on: no extent in one, two or all directions. */
START_TEST(archives_of_flat_thin_and_equal_triangles_verify)
{
    for (int kind = 0; kind < 5; kind++) {
        struct case_mesh m = case_sheet(2000, 9);
        for (uint32_t i = 0; i < m.vertex_count; i++) {
            double *v = m.xyz[i];
            v[2] = 0;
            if (kind >= 1)
                v[1] = 0;           /* a line */
            if (kind >= 2)
                v[0] = 0;           /* a point */
            if (kind == 4 && i == 0)
                v[0] = 1e9;         /* one far outlier */
        }
        if (kind == 3)              /* the same triangle again and again */
            for (uint32_t f = 0; f < m.face_count; f++)
                memcpy(m.face[f], m.face[0], sizeof m.face[0]);
        struct spb_build_options o = case_options(case_write(&m, "a.ply"), case_path("a.spc"));
        o.part_faces = 300;
        expect_whole(m, &o);
    }
}
END_TEST

/* Inner nodes five times as many from block to block, one leaf of 64 apart: prefixes of every size. */
START_TEST(blocks_are_bands_that_grow)
{
    struct case_mesh m = case_sphere(20000, 8);
    struct spb_build_options o = case_options(case_write(&m, "a.ply"), case_path("a.spc"));
    uint32_t count[2] = {0, 0}, first[2] = {0, 0}, last = 0;
    o.cluster_nodes = 1 << 20;
    o.block_nodes = 65535;
    struct spc_reader *r = case_build(&o);
    const struct spc_header *h = spc_reader_header(r);
    case_verify(r);
    ck_assert_uint_eq(h->cluster_count, 1);
    for (uint32_t k = 0; k < h->block_count; k++) {
        struct spc_block b;
        spc_reader_block(r, k, &b);
        first[b.kind] = count[b.kind]++ == 0 ? b.node_count : first[b.kind];
        if (b.kind == SPC_BLOCK_LEAF)
            continue;
        ck_assert_msg(last == 0 || (b.node_count > last * 4 && b.node_count < last * 6),
                      "%u nodes, and then %u", last, b.node_count);
        last = b.node_count;
    }
    ck_assert_uint_ge(count[SPC_BLOCK_INNER], 3);
    ck_assert(first[SPC_BLOCK_INNER] >= 52 && first[SPC_BLOCK_INNER] < 5 * 60);
    ck_assert_uint_eq(count[SPC_BLOCK_LEAF], 2);
    ck_assert(first[SPC_BLOCK_LEAF] >= m.face_count / 64 && first[SPC_BLOCK_LEAF] < m.face_count / 64 + 4);
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

/* ---- nothing is lost ---------------------------------------------------------------------------- */

static int compare_corners(const void *a, const void *b)
{
    return memcmp(a, b, 9 * sizeof(int64_t));
}

/* The archive may start a triangle at any of its corners: here it starts at the smallest. */
static void turn(int64_t t[9])
{
    int64_t all[3][9];
    for (int k = 0; k < 3; k++)
        for (int m = 0; m < 9; m++)
            all[k][m] = t[(m + 3 * k) % 9];
    qsort(all, 3, sizeof *all, compare_corners);
    memcpy(t, all[0], sizeof all[0]);
}

/* Triangles as lattice points, sorted: a multiset to compare. */
static int64_t (*lattice_of(const double (*corners)[3][3], size_t n, int vertex_exp))[9]
{
    int64_t (*out)[9] = malloc((n + 1) * sizeof *out);
    for (size_t i = 0; i < n; i++)
        for (int k = 0; k < 9; k++)
            out[i][k] = (int64_t)floor(ldexp(corners[i][k / 3][k % 3], -vertex_exp) + 0.5);
    for (size_t i = 0; i < n; i++)
        turn(out[i]);
    qsort(out, n, sizeof *out, compare_corners);
    return out;
}

START_TEST(every_triangle_survives_within_half_a_lattice_step)
{
    const double far[3] = {500000, 5400000, 120};
    for (int i = 0; i < 4; i++) {
        struct case_mesh m = i == 0 ? case_soup(3000, 4) : case_sphere(3000, 4);
        size_t n = 0;
        if (i == 2) {
            m.wide = true;
            case_transform(&m, 0.5, far);
        }
        if (i == 3)
            case_transform(&m, 1e-12, (double[3]){0, 0, 0});
        struct spc_reader *r = case_archive(&m);
        const int lattice = spc_reader_header(r)->vertex_exp;
        double (*in)[3][3] = malloc(m.face_count * sizeof *in);
        double (*out)[3][3] = case_triangles(r, &n);
        ck_assert_uint_eq(n, m.face_count);
        for (uint32_t f = 0; f < m.face_count; f++)
            for (int k = 0; k < 9; k++) {
                const double x = m.xyz[m.face[f][k / 3]][k % 3];
                in[f][k / 3][k % 3] = m.wide ? x : (double)(float)x;
            }
        int64_t (*a)[9] = lattice_of((const double(*)[3][3])in, n, lattice);
        int64_t (*b)[9] = lattice_of((const double(*)[3][3])out, n, lattice);
        ck_assert_msg(memcmp(a, b, n * sizeof *a) == 0, "triangles differ, case %d", i);
        free(a);
        free(b);
        free(in);
        free(out);
        spc_reader_close(r);
        case_mesh_free(&m);
    }
}
END_TEST

/* A stray vertex that no face uses: far away, at the largest float, at 0 of a georeferenced scan. */
START_TEST(a_vertex_that_no_face_uses_does_not_coarsen_the_rest)
{
    static const double strays[][3] = {{1e9, 0, 0}, {-3e38, 3e38, 1}, {0, 0, 0}};
    static const double offset[3] = {500000, 5400000, 100};
    for (int i = 0; i < 3; i++) {
        struct case_mesh m = case_sphere(1000, 4);
        m.wide = i == 2;
        if (i == 2)
            case_transform(&m, 1, offset);
        struct spc_reader *a = case_archive(&m);
        m.xyz = realloc(m.xyz, (m.vertex_count + 1) * sizeof *m.xyz);
        memcpy(m.xyz[m.vertex_count++], strays[i], sizeof strays[i]);
        struct spb_build_options o = case_options(case_write(&m, "b.ply"), case_path("b.spc"));
        struct spc_reader *b = case_build(&o);
        const struct spc_header *x = spc_reader_header(a), *y = spc_reader_header(b);
        case_verify(b);
        ck_assert_int_eq(x->unit_exp, y->unit_exp);
        ck_assert_int_eq(x->vertex_exp, y->vertex_exp);
        ck_assert_mem_eq(x->box_min, y->box_min, sizeof x->box_min);
        ck_assert_mem_eq(x->box_max, y->box_max, sizeof x->box_max);
        size_t n = 0, k = 0;
        double (*p)[3][3] = case_triangles(a, &n);
        double (*q)[3][3] = case_triangles(b, &k);
        ck_assert_uint_eq(n, k);
        ck_assert_mem_eq(p, q, n * sizeof *p);
        free(p);
        free(q);
        spc_reader_close(a);
        spc_reader_close(b);
        case_mesh_free(&m);
    }
}
END_TEST

/* All faces in one place: a scan of any size, as long as its numbers are. */
START_TEST(subnormal_scans_of_one_place_build)
{
    for (int k = -1074; k <= -1020; k += 6) {
        struct case_mesh m = case_sphere(300, 4);
        m.wide = true;
        case_transform(&m, 0, (double[3]){ldexp(1, k), 0, 0});
        struct spb_build_options o = case_options(case_write(&m, "a.ply"), case_path("a.spc"));
        struct spc_reader *r = case_build(&o);
        ck_assert_uint_eq(spc_reader_header(r)->leaf_count, m.face_count);
        case_verify(r);
        spc_reader_close(r);
        case_mesh_free(&m);
    }
}
END_TEST

START_TEST(unusable_faces_are_dropped_and_counted)
{
    struct case_mesh m = case_sphere(500, 8);
    m.face[3][1] = m.face[3][0];                    /* degenerate */
    for (int k = 0; k < 3; k++)
        m.face[40 + k][k] = m.vertex_count;         /* bad index */
    m.face[48][0] = 0x80000001;                     /* negative in the file */
    m.xyz[m.face[11][0]][1] = NAN;                  /* and every face at that vertex */
    uint32_t at_nan = 0;
    for (uint32_t f = 0; f < m.face_count; f++)
        for (int k = 0; k < 3; k++)
            at_nan += m.face[f][k] == m.face[11][0];
    struct spc_reader *r = case_archive(&m);
    const struct spc_header *h = spc_reader_header(r);
    case_verify(r);
    ck_assert_uint_eq(h->faces_in, m.face_count);
    ck_assert_uint_eq(h->dropped_degenerate, 1);
    ck_assert_uint_eq(h->dropped_bad_index, 4);
    ck_assert_uint_eq(h->dropped_non_finite, at_nan);
    ck_assert_uint_eq(h->leaf_count, m.face_count - 5 - at_nan);
    spc_reader_close(r);

    struct spb_build_options o = case_options(case_path("scan.ply"), case_path("b.spc"));
    struct spb_build_report report;
    struct spc_error err = {0};
    o.strict = true;
    ck_assert_int_eq(spb_build(&o, &report, NULL, &err), SPC_INPUT_BAD);
    ck_assert_int_ne(access(o.out, F_OK), 0);
    case_mesh_free(&m);
}
END_TEST

START_TEST(closed_surfaces_are_told_from_open_and_inside_out_ones)
{
    for (int i = 0; i < 4; i++) {
        struct case_mesh m = case_sphere(600, 2);
        if (i == 1)
            m.face_count--;                         /* a hole */
        if (i == 2)
            memcpy(m.face[5], (uint32_t[3]){m.face[5][1], m.face[5][0], m.face[5][2]}, 12);
        for (uint32_t f = 0; i == 3 && f < m.face_count; f++)       /* inside out */
            memcpy(m.face[f], (uint32_t[3]){m.face[f][1], m.face[f][0], m.face[f][2]}, 12);
        struct spc_reader *r = case_archive(&m);
        ck_assert_int_eq((spc_reader_header(r)->flags & SPC_FLAG_CULL_BACK) != 0, i == 0);
        case_verify(r);
        spc_reader_close(r);
        case_mesh_free(&m);
    }
}
END_TEST

/* ---- the same bytes ----------------------------------------------------------------------------- */

static void expect_same_file(const char *a, const char *b, const char *why)
{
    size_t n, m;
    uint8_t *x = case_slurp(a, &n), *y = case_slurp(b, &m);
    size_t at = 0;
    while (at < n && at < m && x[at] == y[at])
        at++;
    if (n != m || at != n)
        ck_abort_msg("%s: files of %zu and %zu bytes differ at %zu", why, n, m, at);
    free(x);
    free(y);
}

START_TEST(parts_and_threads_leave_no_trace)
{
    struct case_mesh meshes[] = {case_sphere(6000, 1), case_soup(5000, 2), case_sheet(6000, 3)};
    for (int i = 0; i < 3; i++) {
        static const uint64_t sizes[] = {0, 3000, 250, 37, 1};
        const char *scan = case_write(&meshes[i], "a.ply");
        uint32_t parts_before = 0;
        for (int k = 0; k < 5; k++) {
            struct spb_build_options o = case_options(scan, case_path(k ? "b.spc" : "a.spc"));
            struct spb_build_report report;
            struct spc_error err = {0};
            o.part_faces = k == 0 ? meshes[i].face_count : sizes[k];
            o.threads = k == 0 ? 1 : k == 2 ? 8 : 2;
            if (k == 4)
                o.temp = "/tmp";
            ck_assert_int_eq(spb_build(&o, &report, NULL, &err), SPC_OK);
            ck_assert_uint_gt(report.parts, parts_before);
            if (k == 0)
                ck_assert_uint_eq(report.parts, 1);
            if (k == 2)
                ck_assert_uint_ge(report.parts, 17);
            parts_before = report.parts;
            if (k > 0)
                expect_same_file(case_path("a.spc"), case_path("b.spc"), "parts");
        }
        case_mesh_free(&meshes[i]);
    }
}
END_TEST

/* Directory records and payloads of two archives, but for what scales. */
static void expect_same_codes(const struct spc_reader *a, const struct spc_reader *b, int k)
{
    const struct spc_header *h = spc_reader_header(a), *g = spc_reader_header(b);
    ck_assert_uint_eq(h->block_count, g->block_count);
    ck_assert_int_eq(h->unit_exp + k, g->unit_exp);
    ck_assert_int_eq(h->vertex_exp + k, g->vertex_exp);
    for (uint32_t i = 0; i < h->cluster_count; i++) {
        struct spc_cluster c, d;
        spc_reader_cluster(a, i, &c);
        spc_reader_cluster(b, i, &d);
        for (int x = 0; x < 3; x++)
            ck_assert_double_eq(ldexp(c.origin[x], k), d.origin[x]);
        ck_assert_int_eq(memcmp(c.box, d.box, sizeof c.box), 0);
        ck_assert_int_eq(memcmp(c.sub_sphere, d.sub_sphere, sizeof c.sub_sphere), 0);
    }
    for (uint32_t i = 0; i < h->block_count; i++) {
        struct spc_block c, d;
        spc_reader_block(a, i, &c);
        spc_reader_block(b, i, &d);
        ck_assert_uint_eq(c.raw_bytes, d.raw_bytes);
        uint8_t *x = malloc(c.raw_bytes), *y = malloc(d.raw_bytes);
        ck_assert_int_eq(spc_block_decode(a, i, true, x, NULL), SPC_OK);
        ck_assert_int_eq(spc_block_decode(b, i, true, y, NULL), SPC_OK);
        if (memcmp(x, y, c.raw_bytes) != 0)
            ck_abort_msg("block %u differs at scale 2^%d", i, k);
        free(x);
        free(y);
    }
}

/* As floats, and no coordinate so small that a scale makes it denormal. */
static struct case_mesh scaled_sphere(int exponent)
{
    struct case_mesh m = case_sphere(1500, 3);
    for (uint32_t v = 0; v < m.vertex_count; v++)
        for (int x = 0; x < 3; x++)
            m.xyz[v][x] = ldexp(floor(ldexp(m.xyz[v][x], 20) + 0.5), exponent - 20);
    return m;
}

START_TEST(scaling_by_a_power_of_two_changes_no_code)
{
    static const int exponents[] = {-100, -37, -1, 1, 50, 100};
    struct case_mesh plain = scaled_sphere(0);
    struct spc_reader *a = case_archive(&plain);
    for (int i = 0; i < 6; i++) {
        struct case_mesh m = scaled_sphere(exponents[i]);
        const char *scan = case_write(&m, "b.ply");
        const struct spb_build_options o = case_options(scan, case_path("b.spc"));
        struct spc_reader *b = case_build(&o);
        expect_same_codes(a, b, exponents[i]);
        spc_reader_close(b);
        case_mesh_free(&m);
    }
    spc_reader_close(a);
    case_mesh_free(&plain);
}
END_TEST

/* Where squares of lengths in file units leave the doubles, and the factor to units does. */
START_TEST(archives_of_huge_and_tiny_scans_verify)
{
    static const int exponents[] = {-1013, -1010, -600, 600, 900};
    for (int i = 0; i < 5; i++) {
        struct case_mesh m = case_sphere(600, 3);
        struct spb_build_options o;
        m.wide = true;
        for (uint32_t v = 0; v < m.vertex_count; v++)
            for (int a = 0; a < 3; a++)
                m.xyz[v][a] = ldexp(m.xyz[v][a], exponents[i]);
        o = case_options(case_write(&m, "a.ply"), case_path("a.spc"));
        expect_whole(m, &o);
    }
}
END_TEST

/* ---- damage is found ------------------------------------------------------------------------------ */

/* Opens bytes and verifies them; SPC_OK when nothing is found. */
static enum spc_status examine(const uint8_t *bytes, size_t n)
{
    struct spc_reader *r = NULL;
    uint8_t *copy = malloc(n + 1);                  /* exact size: a sanitizer sees one byte more */
    memcpy(copy, bytes, n);
    enum spc_status status = spc_reader_open_memory(copy, n, &r, NULL);
    if (status == SPC_OK)
        status = spc_verify(r, 2, NULL, NULL, NULL);
    spc_reader_close(r);
    free(copy);
    return status;
}

START_TEST(every_flipped_bit_is_found)
{
    for (int codec = 0; codec < 2; codec++) {
        struct case_mesh m = case_soup(300, 5);
        case_color(&m);
        struct spb_build_options o = case_options(case_write(&m, "a.ply"), case_path("a.spc"));
        o.codec = codec ? SPC_CODEC_ZSTD : SPC_CODEC_RAW;
        spc_reader_close(case_build(&o));
        size_t n;
        uint64_t state = 17;
        uint8_t *bytes = case_slurp(o.out, &n);
        ck_assert_int_eq(examine(bytes, n), SPC_OK);
        for (size_t i = 0; i < 2000 + 8 * HD_SIZE; i++) {
            const size_t bit = i < 8 * HD_SIZE ? i : (size_t)(case_random(&state) * (double)(8 * n));
            bytes[bit / 8] ^= (uint8_t)(1 << bit % 8);
            if (examine(bytes, n) == SPC_OK)
                ck_abort_msg("bit %zu of byte %zu may be flipped", bit % 8, bit / 8);
            bytes[bit / 8] ^= (uint8_t)(1 << bit % 8);
        }
        free(bytes);
        case_mesh_free(&m);
    }
}
END_TEST

START_TEST(every_truncation_and_extension_is_found)
{
    struct case_mesh m = case_soup(40, 5);
    struct spb_build_options o = case_options(case_write(&m, "a.ply"), case_path("a.spc"));
    o.cluster_nodes = 16;
    spc_reader_close(case_build(&o));
    size_t n;
    uint8_t *bytes = case_slurp(o.out, &n);
    for (size_t cut = 0; cut < n; cut++) {
        const enum spc_status status = examine(bytes, cut);
        const enum spc_status want = cut == 0 ? SPC_NOT_SPC : SPC_TRUNCATED;
        if (status != want)
            ck_abort_msg("cut at %zu of %zu: %s", cut, n, spc_status_name(status));
    }
    uint8_t *longer = calloc(n + 64, 1);
    memcpy(longer, bytes, n);
    ck_assert_int_eq(examine(longer, n + 64), SPC_CORRUPT);
    free(longer);
    free(bytes);
    case_mesh_free(&m);
}
END_TEST

START_TEST(what_no_reader_would_open_is_not_written)
{
    struct spc_writer *w = NULL;
    ck_assert_int_eq(spc_writer_create(case_path("limit.spc"), false, &w, NULL), SPC_OK);
    const struct spc_header clusters = {.cluster_count = SPC_CLUSTERS_MAX + 1, .block_count = 1,
                                        .normal_clusters = 1};
    const struct spc_header blocks = {.cluster_count = 1, .block_count = SPC_BLOCKS_MAX + 1,
                                      .normal_clusters = 1};
    ck_assert_int_eq(spc_writer_begin(w, &clusters, 2, NULL), SPC_LIMIT);
    ck_assert_int_eq(spc_writer_begin(w, &blocks, 2, NULL), SPC_LIMIT);
    spc_writer_close(w);
}
END_TEST

int main(void)
{
    return SUITE("archive", case_start, case_finish, archives_of_every_shape_verify,
                 archives_verify_with_every_option, archives_of_very_few_triangles_verify, blocks_are_bands_that_grow,
                 archives_of_flat_thin_and_equal_triangles_verify,
                 every_triangle_survives_within_half_a_lattice_step,
                 a_vertex_that_no_face_uses_does_not_coarsen_the_rest, subnormal_scans_of_one_place_build,
                 unusable_faces_are_dropped_and_counted,
                 closed_surfaces_are_told_from_open_and_inside_out_ones,
                 parts_and_threads_leave_no_trace, scaling_by_a_power_of_two_changes_no_code,
                 archives_of_huge_and_tiny_scans_verify,
                 every_flipped_bit_is_found, every_truncation_and_extension_is_found,
                 what_no_reader_would_open_is_not_written);
}
