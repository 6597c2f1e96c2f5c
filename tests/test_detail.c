/*
 * Scans that are much finer in one place than elsewhere: the fine part keeps its shape, or the build says
 * what does not.
 */
#include "detail.h"
#include "mesh_case.h"
#include "suite.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A sphere, and beside it one so much smaller: few of its triangles are in the tenth percentile. */
static struct case_mesh inset(uint32_t fine, double scale, const double at[3])
{
    struct case_mesh m = case_sphere(3000, 1);
    m.wide = true;
    case_add(&m, case_sphere(fine, 2), scale, at);
    return m;
}

static const double BESIDE[3] = {0.91, -0.33, 0.57};

static struct spb_build_report build(const struct case_mesh *m, double detail, const char *out)
{
    struct spb_build_options o = case_options(case_write(m, "scan.ply"), case_path(out));
    struct spb_build_report report;
    struct spc_error err = {0};
    o.detail = detail;
    o.force = true;
    ck_assert_msg(spb_build(&o, &report, NULL, &err) == SPC_OK, "%s", err.what);
    return report;
}

/* ---- judging ----------------------------------------------------------------------------------- */

static double distance2(const double a[3], const double b[3])
{
    double sum = 0;
    for (int k = 0; k < 3; k++)
        sum += (a[k] - b[k]) * (a[k] - b[k]);
    return sum;
}

static double longest2(const struct case_mesh *m, uint32_t face)
{
    double most = 0;
    for (int k = 0; k < 3; k++)
        most = fmax(most, distance2(m->xyz[m->face[face][k]], m->xyz[m->face[face][(k + 1) % 3]]));
    return most;
}

/*
 * The number of the faces from the first on for which the archive holds no triangle with all three corners, turned as
 * they may be, within 1/16 of the longest edge.
 */
static uint32_t faces_lost(const char *archive, const struct case_mesh *m, uint32_t first_face)
{
    struct spc_reader *r;
    size_t n = 0;
    uint32_t lost = 0;
    ck_assert_int_eq(spc_reader_open(case_path(archive), &r, NULL), SPC_OK);
    case_verify(r);
    double (*t)[3][3] = case_triangles(r, &n);
    for (uint32_t i = first_face; i < m->face_count; i++) {
        const double near2 = longest2(m, i) / 256 * (1 + 1e-9);
        const double *first = m->xyz[m->face[i][0]];
        bool found = false;
        for (size_t k = 0; k < 3 * n && !found; k++) {
            const double (*c)[3] = (const double(*)[3])t[k / 3];
            found = distance2(c[k % 3], first) <= near2 &&
                    distance2(c[(k + 1) % 3], m->xyz[m->face[i][1]]) <= near2 &&
                    distance2(c[(k + 2) % 3], m->xyz[m->face[i][2]]) <= near2;
        }
        lost += !found;
    }
    free(t);
    spc_reader_close(r);
    return lost;
}

static int by_place(const void *a, const void *b)
{
    return memcmp(a, b, 3 * sizeof(double));
}

/* Places of corners: a corner that two triangles have at two places would be a crack, and one more. */
static size_t places(const char *archive)
{
    struct spc_reader *r;
    size_t n = 0, count = 0;
    ck_assert_int_eq(spc_reader_open(case_path(archive), &r, NULL), SPC_OK);
    double (*t)[3][3] = case_triangles(r, &n);
    double (*at)[3] = (double (*)[3])t;
    qsort(at, 3 * n, sizeof *at, by_place);
    for (size_t i = 0; i < 3 * n; i++)
        count += i == 0 || by_place(at[i], at[i - 1]) != 0;
    free(t);
    spc_reader_close(r);
    return count;
}

/* ---- tests ------------------------------------------------------------------------------------- */

START_TEST(a_fine_inset_keeps_its_shape_at_any_ratio)
{
    static const double scales[] = {3e-3, 1e-4, 1e-5, 1e-7, 1e-9};
    for (int i = 0; i < 5; i++) {
        struct case_mesh m = inset(200, scales[i], BESIDE);
        const struct spb_build_report report = build(&m, SPB_DETAIL_AUTO, "a.spc");
        ck_assert_uint_eq(report.shapes.moved, 0);
        ck_assert_uint_eq(report.shapes.flat, 0);
        ck_assert_int_gt(report.coarse_exp, report.header.vertex_exp);
        ck_assert_uint_eq(faces_lost("a.spc", &m, 0), 0);
        ck_assert_uint_eq(places("a.spc"), m.vertex_count);
        case_mesh_free(&m);
    }
}
END_TEST

/* The corner of eight cells that is nearest to a place. */
static void find_border(const struct case_mesh *m, const double near[3], double out[3])
{
    double min[3], max[3];
    struct spb_space space;
    for (int a = 0; a < 3; a++) {
        min[a] = max[a] = m->xyz[0][a];
        for (uint32_t v = 0; v < m->vertex_count; v++) {
            min[a] = fmin(min[a], m->xyz[v][a]);
            max[a] = fmax(max[a], m->xyz[v][a]);
        }
    }
    ck_assert(spb_space_init(&space, min, max));
    const double side = ldexp(1, space.unit_exp - SPB_DETAIL_LOG2);
    for (int a = 0; a < 3; a++)
        out[a] = space.origin[a] + side * floor((near[a] - space.origin[a]) / side + 0.5);
}

/* In eight cells: some have too few of its faces to be fine for themselves. */
START_TEST(an_inset_across_cells_has_no_cracks)
{
    struct case_mesh m = case_sphere(9000, 5);
    const uint32_t coarse = m.face_count;
    double border[3];
    m.wide = true;
    find_border(&m, BESIDE, border);
    border[0] -= 9e-4;
    border[1] += 3e-4;
    case_add(&m, case_sphere(700, 2), 1e-3, border);
    const struct spb_build_report report = build(&m, SPB_DETAIL_AUTO, "a.spc");
    ck_assert_int_gt(report.coarse_exp, report.header.vertex_exp);
    ck_assert_uint_eq(report.shapes.moved, 0);
    ck_assert_uint_eq(faces_lost("a.spc", &m, coarse), 0);
    ck_assert_uint_eq(places("a.spc"), m.vertex_count);
    ck_assert(report.closed);
    case_mesh_free(&m);
}
END_TEST

/* Few of the fine ones are finer still, but more than 1 in 64. */
START_TEST(insets_in_an_inset_keep_their_shape)
{
    struct case_mesh m = inset(200, 1e-3, BESIDE);
    case_add(&m, case_sphere(30, 4), 1e-6, BESIDE);
    ck_assert_uint_eq(build(&m, SPB_DETAIL_AUTO, "a.spc").shapes.moved, 0);
    ck_assert_uint_eq(faces_lost("a.spc", &m, 0), 0);
    case_mesh_free(&m);
}
END_TEST

/* Too few for the rule: they are counted, each of them and no other, and --detail keeps them. */
START_TEST(what_loses_its_shape_is_counted_and_can_be_kept)
{
    struct case_mesh m = inset(40, 1e-4, BESIDE);
    struct spb_build_report report = build(&m, SPB_DETAIL_AUTO, "a.spc");
    ck_assert_uint_gt(report.shapes.moved, 20);
    ck_assert_uint_eq(report.shapes.moved, faces_lost("a.spc", &m, 0));
    ck_assert_int_eq(report.coarse_exp, report.header.vertex_exp);
    const double least = report.shapes.least, most = report.shapes.most;
    ck_assert_double_lt(most, 4e-4);
    ck_assert_double_gt(least, 1e-5);
    ck_assert_double_gt(least, report.detail_least);

    report = build(&m, least * 0.999, "a.spc");
    ck_assert_uint_eq(report.shapes.moved, 0);
    ck_assert_uint_eq(faces_lost("a.spc", &m, 0), 0);
    ck_assert_uint_eq(places("a.spc"), m.vertex_count);

    report = build(&m, most * 1.001, "a.spc");      /* larger than any: nothing is asked for */
    ck_assert_uint_gt(report.shapes.moved, 20);
    ck_assert_int_eq(report.coarse_exp, report.header.vertex_exp);
    case_mesh_free(&m);
}
END_TEST

/* Triangles thinner than the lattice are no longer triangles, though their corners have hardly moved. */
START_TEST(areas_that_the_lattice_takes_are_counted)
{
    struct case_mesh m = case_sphere(2000, 4), thin = case_sphere(4, 1);
    m.wide = true;
    const double corners[3][3] = {{0, 0, 0}, {0.5, 0.25, 0}, {0.25, 0.125 + 1e-6, 0}};
    thin.face_count = 1;
    thin.vertex_count = 3;
    memcpy(thin.xyz, corners, sizeof corners);
    memcpy(thin.face[0], (uint32_t[3]){0, 1, 2}, 12);
    case_add(&m, thin, 1, (double[3]){0, 0, 0});
    ck_assert_uint_eq(build(&m, SPB_DETAIL_AUTO, "a.spc").shapes.flat, 1);
    m.xyz[m.vertex_count - 1][1] = 0.125;   /* flat before: not the lattice's doing */
    ck_assert_uint_eq(build(&m, SPB_DETAIL_AUTO, "a.spc").shapes.flat, 0);
    case_mesh_free(&m);
}
END_TEST

/* Below a lattice of 46 bits nothing can be kept: told, and strict refuses. */
START_TEST(what_no_lattice_holds_is_told_and_strict_refuses_it)
{
    struct case_mesh m = case_sphere(3000, 1);
    const double at[3] = {m.xyz[7][0], m.xyz[7][1], m.xyz[7][2]};   /* among faces that must stay */
    m.wide = true;
    case_add(&m, case_sphere(200, 2), 1e-14, at);
    struct case_mesh fine = case_sphere(200, 2);
    const struct spb_build_report report = build(&m, 0, "a.spc");
    ck_assert_uint_eq(report.shapes.moved, fine.face_count);
    case_mesh_free(&fine);
    ck_assert_double_lt(report.shapes.most, report.detail_least);

    struct spb_build_options o = case_options(case_write(&m, "b.ply"), case_path("b.spc"));
    struct spb_build_report failed;
    struct spc_error err = {0};
    struct spc_reader *r;
    o.strict = true;
    ck_assert_int_eq(spb_build(&o, &failed, NULL, &err), SPC_INPUT_BAD);
    ck_assert_ptr_nonnull(strstr(err.what, "lose their shape"));
    ck_assert_int_ne(spc_reader_open(case_path("b.spc"), &r, NULL), SPC_OK);
    case_mesh_free(&m);
}
END_TEST

/* What has moved by more than 1/16 of its size, from where all have to where none has. */
START_TEST(the_count_is_that_of_the_faces_that_moved)
{
    static const double scales[] = {1e-2, 5e-3, 3e-3, 2e-3, 1e-3, 5e-4};
    uint32_t between = 0;
    for (int i = 0; i < 6; i++) {
        struct case_mesh m = inset(60, scales[i], BESIDE);
        const uint32_t moved = (uint32_t)build(&m, 1e9, "a.spc").shapes.moved;
        ck_assert_uint_eq(moved, faces_lost("a.spc", &m, 0));
        between += moved > 0 && moved < 40;
        case_mesh_free(&m);
    }
    ck_assert_uint_ge(between, 2);
}
END_TEST

/* An archive of an archive has its vertices where they were. */
START_TEST(archives_built_anew_keep_all)
{
    struct case_mesh m = inset(200, 1e-6, BESIDE);
    const int vertex_exp = build(&m, SPB_DETAIL_AUTO, "a.spc").header.vertex_exp;
    struct spb_build_options o = case_options(case_path("a.spc"), case_path("b.spc"));
    struct spb_build_report report;
    struct spc_error err = {0};
    ck_assert_msg(spb_build(&o, &report, NULL, &err) == SPC_OK, "%s", err.what);
    ck_assert_uint_eq(report.shapes.moved, 0);
    ck_assert_int_eq(report.header.vertex_exp, vertex_exp);
    ck_assert_uint_eq(faces_lost("b.spc", &m, 0), 0);
    ck_assert_uint_eq(places("b.spc"), m.vertex_count);
    case_mesh_free(&m);
}
END_TEST

/* Disks of points, as small as these are near each other. */
START_TEST(points_have_detail_too)
{
    struct case_mesh m = inset(250, 1e-5, BESIDE);
    struct spc_reader *r;
    m.face_count = 0;
    const struct spb_build_report report = build(&m, SPB_DETAIL_AUTO, "a.spc");
    ck_assert_int_gt(report.coarse_exp, report.header.vertex_exp);
    ck_assert_uint_eq(report.shapes.moved, 0);
    ck_assert_int_eq(spc_reader_open(case_path("a.spc"), &r, NULL), SPC_OK);
    case_verify(r);
    spc_reader_close(r);
    ck_assert_uint_gt(build(&m, 1e9, "b.spc").shapes.moved, 90);
    case_mesh_free(&m);
}
END_TEST

static void expect_same(const struct spb_build_options *o, const char *other, const char *what)
{
    struct spb_build_report report;
    struct spc_error err = {0};
    size_t n = 0, k = 0;
    ck_assert_msg(spb_build(o, &report, NULL, &err) == SPC_OK, "%s", err.what);
    uint8_t *a = case_slurp(case_path("a.spc"), &n), *b = case_slurp(case_path(other), &k);
    ck_assert_msg(n == k && memcmp(a, b, n) == 0, "%s", what);
    free(a);
    free(b);
}

START_TEST(parts_threads_and_disk_leave_no_trace)
{
    struct case_mesh m = inset(200, 1e-4, BESIDE);
    build(&m, SPB_DETAIL_AUTO, "a.spc");
    struct spb_build_options o = case_options(case_write(&m, "scan.ply"), case_path("b.spc"));
    o.part_faces = 97;
    o.threads = 4;
    expect_same(&o, "b.spc", "many parts");
    o.out = case_path("c.spc");
    o.vertices_on_disk = true;
    o.threads = 1;
    expect_same(&o, "c.spc", "one thread, vertices on disk");
    case_mesh_free(&m);
}
END_TEST

START_TEST(scale_changes_no_code)
{
    struct case_mesh m = inset(200, 1e-4, BESIDE);
    for (uint32_t v = 0; v < m.vertex_count; v++)
        for (int a = 0; a < 3; a++)
            m.xyz[v][a] = ldexp(floor(ldexp(m.xyz[v][a], 40)), -40);
    const struct spb_build_report first = build(&m, SPB_DETAIL_AUTO, "a.spc");
    case_transform(&m, 0x1p77, (double[3]){0, 0, 0});
    const struct spb_build_report second = build(&m, SPB_DETAIL_AUTO, "b.spc");
    ck_assert_int_eq(second.header.vertex_exp, first.header.vertex_exp + 77);
    ck_assert_int_eq(second.coarse_exp, first.coarse_exp + 77);
    ck_assert_uint_eq(second.header.file_bytes, first.header.file_bytes);
    case_mesh_free(&m);
}
END_TEST

/* Tiny triangles here and there, as marching cubes make them: no reason for finer lattices. */
START_TEST(a_few_tiny_triangles_everywhere_change_nothing)
{
    struct case_mesh m = case_sphere(20000, 6);
    const struct spb_build_report clean = build(&m, SPB_DETAIL_AUTO, "a.spc");
    struct case_mesh dusty = case_sphere(20000, 6);
    dusty.wide = m.wide = true;
    for (uint32_t i = 0; i < 100; i++) {            /* 1 in 200 shrinks to almost nothing */
        const uint32_t *f = dusty.face[i * 197];
        for (int k = 1; k < 3; k++)
            for (int a = 0; a < 3; a++)
                dusty.xyz[f[k]][a] = dusty.xyz[f[0]][a] + (dusty.xyz[f[k]][a] - dusty.xyz[f[0]][a]) * 1e-3;
    }
    const struct spb_build_report report = build(&dusty, SPB_DETAIL_AUTO, "b.spc");
    ck_assert_int_eq(report.header.vertex_exp, report.coarse_exp);
    ck_assert_uint_ge(report.shapes.moved, 90);
    ck_assert_uint_eq(clean.shapes.moved, 0);
    case_mesh_free(&m);
    case_mesh_free(&dusty);
}
END_TEST

int main(void)
{
    return SUITE("detail", case_start, case_finish, a_fine_inset_keeps_its_shape_at_any_ratio,
                 an_inset_across_cells_has_no_cracks,
                 insets_in_an_inset_keep_their_shape, what_loses_its_shape_is_counted_and_can_be_kept,
                 areas_that_the_lattice_takes_are_counted, what_no_lattice_holds_is_told_and_strict_refuses_it,
                 the_count_is_that_of_the_faces_that_moved,
                 archives_built_anew_keep_all, points_have_detail_too,
                 parts_threads_and_disk_leave_no_trace, scale_changes_no_code,
                 a_few_tiny_triangles_everywhere_change_nothing);
}
