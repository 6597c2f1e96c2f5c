/*
 * Scans and views at the ends of what numbers can say: each gives the right picture or a clear
 * refusal. SPC_EXTREMES=full tries all of them, some minutes; otherwise a sample.
 *
 * The reference is drawn from the scan itself, not from the archive, and from the eye: corners less
 * the eye, by a power of two that makes them of ordinary size. So it is right at any scale.
 */
#include "mesh_case.h"
#include "oracle_tree.h"
#include "picture_case.h"
#include "suite.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct spv_draw_options EXACT = {.splat = SPV_SPLAT_EXACT, .ambient = 0.2f};
static const struct spv_draw_options FAST = {.splat = SPV_SPLAT_FAST, .ambient = 0.2f};
static const double PI = 3.14159265358979323846;
enum { SIDE = 160 };

static void start(void)
{
    case_start();
    picture_use(PICTURE_BY_SOFT, 2);
}

static void finish(void)
{
    picture_use(PICTURE_BY_GL, 0);
    case_finish();
}

static bool full(void)
{
    const char *text = getenv("SPC_EXTREMES");
    return text != NULL && strcmp(text, "full") == 0;
}

/* ---- judging ----------------------------------------------------------------------------------- */

static void *get(size_t n, size_t size)
{
    void *p = calloc(n + 1, size);
    ck_assert_ptr_nonnull(p);
    return p;
}

/* What the file holds: a float, where it holds floats. */
static double in_file(const struct case_mesh *m, double x)
{
    return m->wide ? x : (double)(float)x;
}

static struct ref_image reference(const struct case_mesh *m, const struct picture_view *v, int unit_exp)
{
    struct ref_triangle *triangles = get(m->face_count, sizeof *triangles);
    struct ref_camera camera = {.fov_y_deg = v->fov_rad * 180 / PI, .width = v->width, .height = v->height};
    struct ref_image image;
    for (uint32_t i = 0; i < m->face_count; i++) {
        memset(triangles[i].rgba, 255, sizeof triangles[i].rgba);
        for (int c = 0; c < 3; c++)
            for (int a = 0; a < 3; a++)
                triangles[i].corner[c][a] = ldexp(in_file(m, m->xyz[m->face[i][c]][a]) - v->eye[a], -unit_exp);
    }
    double most = 0;
    for (int a = 0; a < 3; a++)
        most = fmax(most, fabs(v->target[a] - v->eye[a]));
    for (int a = 0; a < 3; a++) {               /* of length 1 or so: nearer than 1e-12 of it is nothing */
        camera.target[a] = (v->target[a] - v->eye[a]) / most;
        camera.up[a] = v->up[a];
    }
    ck_assert_int_eq(ref_raster(triangles, m->face_count, &camera, 0.2, &image), 0);
    free(triangles);
    return image;
}

/* No number of the directory, no node and no error of a selection is NaN or infinite. */
static void expect_numbers(const struct spc_reader *r, const char *what)
{
    const struct spc_header *h = spc_reader_header(r);
    bool finite = isfinite(h->e_min) && isfinite(h->e_max);
    for (int a = 0; a < 3; a++)
        finite = finite && isfinite(h->box_min[a]) && isfinite(h->box_max[a]) && h->box_min[a] <= h->box_max[a];
    for (uint32_t c = 0; c < h->cluster_count; c++) {
        struct spc_cluster k;
        struct spc_tree *t;
        spc_reader_cluster(r, c, &k);
        for (int a = 0; a < 6; a++)
            finite = finite && isfinite(k.box[a]) && isfinite(k.sub_box[a]) && isfinite(k.origin[a % 3]);
        for (int a = 0; a < 4; a++)
            finite = finite && isfinite(k.sphere[a]) && isfinite(k.sub_sphere[a]) && isfinite(k.cone[a]);
        ck_assert_int_eq(spc_tree_load(r, c, &t, NULL), SPC_OK);
        for (uint32_t i = 0; i < t->node_count; i++) {
            const struct spc_node *n = &t->nodes[i];
            finite = finite && isfinite(n->radius) && isfinite(n->height) && isfinite(n->link);
            for (int a = 0; a < 3; a++)
                finite = finite && isfinite(n->center[a]) && isfinite(n->normal[a]);
        }
        spc_tree_free(t);
    }
    ck_assert_msg(finite, "%s: a number is none", what);
}

static void expect_depths(const struct picture *p, const char *what)
{
    for (int y = 0; y < p->height; y += 7)
        for (int x = 0; x < p->width; x += 7) {
            double depth = 1;
            const bool some = spv_draw_depth(picture_soft(), x, y, &depth);
            if (some && !(depth > 0 && isfinite(depth)))
                ck_abort_msg("%s: the depth at %d, %d is %g", what, x, y, depth);
            if (some != (p->cover[(size_t)y * (size_t)p->width + (size_t)x] != 0))
                ck_abort_msg("%s: cover and depth differ at %d, %d", what, x, y);
        }
}

/* Pixels that the reference covers, in the last comparison. */
static uint64_t covered;

static void judge(const struct spc_reader *r, const struct case_mesh *m, const struct picture_view *v,
                  const struct spv_draw_options *o, double overlap, const char *what)
{
    const struct spv_view view = picture_view(v);
    struct picture p = picture_draw(r, &view, o);
    struct ref_image image = reference(m, v, spc_reader_header(r)->unit_exp);
    struct ref_compare c;
    ref_compare_cover(&image, p.cover, &c);
    covered = 0;
    for (size_t i = 0; i < (size_t)v->width * (size_t)v->height; i++)
        covered += image.triangle[i] != UINT32_MAX;
    expect_depths(&p, what);
    for (uint32_t k = 0; k < p.selection.block_count; k++)
        if (!(p.selection.blocks[k].error >= 0) || !isfinite(p.selection.blocks[k].error))
            ck_abort_msg("%s: a block's error is %g", what, (double)p.selection.blocks[k].error);
    if (c.holes > 0 || c.overlap_tolerant < overlap)
        ck_abort_msg("%s, eye %g %g %g, mode %d, eps %g, fov %g: %d holes of %d pixels, the first at %d, %d; "
                     "overlap %g", what, v->eye[0], v->eye[1], v->eye[2], (int)v->mode, v->eps_px, v->fov_rad,
                     (int)c.holes, (int)covered, c.hole_x, c.hole_y, c.overlap_tolerant);
    picture_release(&p);
    ref_image_release(&image);
}

/* From outside, all around; the model's middle and about half its size. */
static struct picture_view look(int i, const double middle[3], double size, double eps_px, enum spv_mode mode)
{
    static const double from[6][3] = {{1, 0.2, 0.3}, {-1, 0.1, 0}, {0.3, 1, 0.5},
                                      {0.1, -1, 0.2}, {0.7, 0.5, 1}, {0, 0.3, -1}};
    struct picture_view v = {.up = {0.1, 0.9, 0.3}, .fov_rad = 0.8, .width = SIDE, .height = SIDE,
                             .eps_px = eps_px, .mode = mode};
    for (int a = 0; a < 3; a++) {
        v.eye[a] = middle[a] + from[i % 6][a] * 3 * size;
        v.target[a] = middle[a];
    }
    return v;
}

/* A few views from outside: fine ones show the outline, coarse ones no hole. */
static void judge_around(const struct spc_reader *r, const struct case_mesh *m, const double middle[3], double size,
                         int views, const char *what)
{
    expect_numbers(r, what);
    for (int i = 0; i < views; i++) {
        const struct picture_view fine = look(i, middle, size, 0.5, SPV_HYBRID);
        judge(r, m, &fine, &EXACT, 0.98, what);
        const struct picture_view points = look(i + 1, middle, size, i % 2 ? 4 : 30, SPV_POINTS);
        judge(r, m, &points, i % 3 == 2 ? &FAST : &EXACT, 0, what);
        const struct picture_view coarse = look(i + 2, middle, size, i % 2 ? 12 : 3, SPV_HYBRID);
        judge(r, m, &coarse, &EXACT, 0, what);
    }
}

/* ---- scale ------------------------------------------------------------------------------------- */

/* Coordinates of 21 bits, so that none becomes subnormal before its scan does. */
static struct case_mesh scaled(int exponent, bool wide)
{
    struct case_mesh m = case_sphere(700, 3);
    m.wide = wide;
    for (uint32_t v = 0; v < m.vertex_count; v++)
        for (int a = 0; a < 3; a++)
            m.xyz[v][a] = ldexp(floor(ldexp(m.xyz[v][a], 20) + 0.5), exponent - 20);
    return m;
}

static struct spc_reader *build_named(const struct case_mesh *m, const char *name)
{
    char scan[100], out[100];
    snprintf(scan, sizeof scan, "%s.ply", name);
    snprintf(out, sizeof out, "%s.spc", name);
    const struct spb_build_options o = case_options(case_write(m, scan), case_path(out));
    return case_build(&o);
}

/* Decoded blocks: byte for byte, but for what the scale itself is. */
static void expect_same_blocks(const struct spc_reader *a, const struct spc_reader *b, int exponent)
{
    const struct spc_header *h = spc_reader_header(a), *g = spc_reader_header(b);
    ck_assert_int_eq(g->unit_exp, h->unit_exp + exponent);
    ck_assert_int_eq(g->vertex_exp, h->vertex_exp + exponent);
    ck_assert_uint_eq(g->block_count, h->block_count);
    for (uint32_t k = 0; k < h->block_count; k++) {
        struct spc_block x, y;
        spc_reader_block(a, k, &x);
        spc_reader_block(b, k, &y);
        ck_assert_int_eq(y.step_exp, x.step_exp + exponent);
        ck_assert_uint_eq(x.raw_bytes, y.raw_bytes);
        uint8_t *p = get(x.raw_bytes, 1), *q = get(x.raw_bytes, 1);
        ck_assert_int_eq(spc_block_decode(a, k, true, p, NULL), SPC_OK);
        ck_assert_int_eq(spc_block_decode(b, k, true, q, NULL), SPC_OK);
        ck_assert_msg(memcmp(p, q, x.raw_bytes) == 0, "block %u differs at scale 2^%d", k, exponent);
        free(p);
        free(q);
    }
}

static void expect_same_picture(const struct spc_reader *a, const struct spc_reader *b, int exponent, int i)
{
    const double middle[3] = {0, 0, 0};
    const struct picture_view v = look(i, middle, 1, i % 2 ? 4 : 1, i % 3 ? SPV_HYBRID : SPV_POINTS);
    struct picture_view w = v;
    for (int k = 0; k < 3; k++) {
        w.eye[k] = ldexp(v.eye[k], exponent);
        w.target[k] = ldexp(v.target[k], exponent);
    }
    const struct spv_view first = picture_view(&v), second = picture_view(&w);
    struct picture p = picture_draw(a, &first, &EXACT), q = picture_draw(b, &second, &EXACT);
    ck_assert_uint_gt(p.drawn.nodes + p.drawn.triangles, 0);
    ck_assert_msg(memcmp(p.rgba, q.rgba, (size_t)4 * SIDE * SIDE) == 0, "the picture differs at scale 2^%d", exponent);
    expect_depths(&q, "scaled");
    picture_release(&p);
    picture_release(&q);
}

static void expect_scale(const struct spc_reader *plain, int exponent, bool wide)
{
    struct case_mesh m = scaled(exponent, wide);
    struct spc_reader *r = build_named(&m, "b");
    expect_same_blocks(plain, r, exponent);
    expect_same_picture(plain, r, exponent, abs(exponent) % 6);
    spc_reader_close(r);
    case_mesh_free(&m);
}

START_TEST(scaled_by_any_power_of_two_codes_and_pictures_are_the_same)
{
    static const int narrow[] = {-129, -100, -99, -64, -31, -7, -1, 1, 13, 52, 77, 99, 100};
    static const int wide[] = {-1005, -600, -300, -128, 127, 300, 512, 998};
    struct case_mesh m = scaled(0, false);
    struct spc_reader *plain = build_named(&m, "a");
    const double middle[3] = {0, 0, 0};
    judge_around(plain, &m, middle, 1, full() ? 6 : 1, "unscaled");
    for (size_t i = 0; i < sizeof narrow / sizeof *narrow && !full(); i++)
        expect_scale(plain, narrow[i], false);
    for (int k = -100; k <= 100 && full(); k++)
        expect_scale(plain, k, false);
    for (size_t i = 0; i < sizeof wide / sizeof *wide; i++)
        expect_scale(plain, wide[i], true);
    for (int k = -1005; k <= 998 && full(); k += 7)
        expect_scale(plain, k, true);
    spc_reader_close(plain);
    case_mesh_free(&m);
}
END_TEST

static void expect_refused(const struct case_mesh *m, const char *part)
{
    const struct spb_build_options o = case_options(case_write(m, "bad.ply"), case_path("bad.spc"));
    struct spb_build_report report;
    struct spc_error err = {0};
    const enum spc_status status = spb_build(&o, &report, NULL, &err);
    ck_assert_msg(status == SPC_INPUT_BAD && strstr(err.what, part) != NULL, "status %d: %s", (int)status, err.what);
}

START_TEST(scans_too_large_to_measure_are_refused)
{
    static const int exponents[] = {1000, 1001, 1010, 1022};
    for (int i = 0; i < 4; i++) {
        struct case_mesh m = scaled(exponents[i], true);
        expect_refused(&m, "span more than a double can measure");
        case_mesh_free(&m);
    }
    struct case_mesh m = scaled(0, true);
    m.xyz[0][0] = DBL_MAX;
    m.xyz[1][0] = -DBL_MAX;
    expect_refused(&m, "span more than a double can measure");
    case_mesh_free(&m);
}
END_TEST

/*
 * Of coordinates that are no normal numbers any more. A float's are, as doubles, down to its last; below
 * that they must be refused, not become a point.
 */
START_TEST(scans_too_small_to_measure_are_refused)
{
    static const int exponents[] = {-1015, -1021, -1030, -1050, -1070};
    for (int i = 0; i < 5; i++) {
        struct case_mesh m = case_sphere(700, 3);
        m.wide = true;
        case_transform(&m, ldexp(1, exponents[i]), (double[3]){0, 0, 0});
        expect_refused(&m, "--scale");
        case_mesh_free(&m);
    }
    struct case_mesh m = case_sphere(700, 3);       /* a stray vertex that no face uses does not help */
    m.wide = true;
    case_transform(&m, 0x1p-1030, (double[3]){0, 0, 0});
    m.xyz = realloc(m.xyz, (m.vertex_count + 1) * sizeof *m.xyz);
    ck_assert_ptr_nonnull(m.xyz);
    for (int a = 0; a < 3; a++)
        m.xyz[m.vertex_count][a] = 1;
    m.vertex_count++;
    expect_refused(&m, "--scale");
    case_mesh_free(&m);
}
END_TEST

/* The smallest that are not refused are coarse, but not a point: what they lose is counted. */
START_TEST(scans_just_large_enough_to_measure_tell_what_they_lose)
{
    struct case_mesh m = case_sphere(700, 3);
    m.wide = true;
    case_transform(&m, 0x1p-1014, (double[3]){0, 0, 0});        /* 2^10 steps across */
    const struct spb_build_options o = case_options(case_write(&m, "a.ply"), case_path("a.spc"));
    struct spb_build_report report;
    struct spc_error err = {0};
    ck_assert_int_eq(spb_build(&o, &report, NULL, &err), SPC_OK);
    ck_assert_uint_eq(report.shapes.moved, 0);
    ck_assert_int_eq(report.header.vertex_exp, -1022);
    case_mesh_free(&m);
}
END_TEST

/* ---- place ------------------------------------------------------------------------------------- */

static void expect_moved(double away, bool wide, int views)
{
    struct case_mesh m = case_sphere(700, 6);
    const double middle[3] = {2 * away, -1.3 * away, 0.7 * away};
    char what[60];
    m.wide = wide;
    case_transform(&m, 1, middle);
    snprintf(what, sizeof what, "%s moved by %g", wide ? "double" : "float", away);
    struct spc_reader *r = build_named(&m, "a");
    judge_around(r, &m, middle, 1, views, what);
    spc_reader_close(r);
    case_mesh_free(&m);
}

START_TEST(moved_far_from_the_origin_scans_look_as_they_are)
{
    const int views = full() ? 6 : 1;
    for (double away = 1e3; away < 2e9; away *= full() ? 10 : 100)
        expect_moved(away, true, views);
    for (double away = 1e3; away < 2e6; away *= full() ? 10 : 100)
        expect_moved(away, false, views);
    if (full())                             /* farther out the lattice of the largest coordinate shows */
        for (double away = 1e10; away < 2e13; away *= 10)
            expect_moved(away, true, 2);
}
END_TEST

/* ---- detail ------------------------------------------------------------------------------------ */

/* Spheres, each a thousandth of the last; the largest triangle is 1e9 times the smallest and more. */
START_TEST(detail_of_a_billionth_is_seen_from_both_ends)
{
    static const double places[][3] = {{0, 0, 0}, {1.5, 0.1, 0.2}, {1.6, 1.1, 0}, {1.7, -0.9, 0.4}};
    struct case_mesh m = case_sphere(400, 1);
    m.wide = true;
    for (int k = 1; k < 4; k++)
        case_add(&m, case_sphere(600, (uint64_t)k), pow(10, -3 * k), places[k]);
    struct spc_reader *r = build_named(&m, "a");
    for (int k = 0; k < 4; k++) {
        char what[60];
        snprintf(what, sizeof what, "detail of 1e-%d", 3 * k);
        for (int i = 0; i < (full() ? 6 : 1); i++) {
            const struct picture_view fine = look(i + 4, places[k], pow(10, -3 * k), 0.5, SPV_HYBRID);
            judge(r, &m, &fine, &EXACT, 0.98, what);
            ck_assert_uint_gt(covered, 2000);
            const struct picture_view points = look(i + 4, places[k], pow(10, -3 * k), 5, SPV_POINTS);
            judge(r, &m, &points, &EXACT, 0, what);
        }
    }
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

/* ---- shapes ------------------------------------------------------------------------------------ */

static struct case_mesh triangles_of(const double (*corners)[3], uint32_t n)
{
    struct case_mesh m = {.vertex_count = 3 * n, .face_count = n, .wide = true};
    m.xyz = get(3 * n, sizeof *m.xyz);
    m.face = get(n, sizeof *m.face);
    memcpy(m.xyz, corners, 3 * n * sizeof *m.xyz);
    for (uint32_t i = 0; i < n; i++)
        memcpy(m.face[i], (uint32_t[3]){3 * i, 3 * i + 1, 3 * i + 2}, 12);
    return m;
}

struct needle {                     /* of length 1; wide: its one end, along thin */
    double tip[3], along[3], thin[3], wide;
};

static struct needle some_needle(uint64_t *state, double aspect)
{
    struct needle n = {.wide = 1 / aspect};
    double length = 0, flat = 0;
    for (int a = 0; a < 3; a++) {
        n.tip[a] = case_random(state);
        n.along[a] = case_random(state) - 0.5;
        length += n.along[a] * n.along[a];
        flat += a < 2 ? n.along[a] * n.along[a] : 0;
    }
    n.thin[0] = n.along[1] / sqrt(flat);
    n.thin[1] = -n.along[0] / sqrt(flat);
    for (int a = 0; a < 3; a++)
        n.along[a] /= sqrt(length);
    return n;
}

static void on_needle(const struct needle *n, double along, double across, double out[3])
{
    for (int a = 0; a < 3; a++)
        out[a] = n->tip[a] + along * n->along[a] + across * along * n->wide * n->thin[a];
}

/* What is seen of it from close by: a piece, of which the reference can tell the sides. */
static struct case_mesh piece(const struct needle *n, double from, double to)
{
    double corner[2][3][3];
    on_needle(n, from, 0, corner[0][0]);
    on_needle(n, to, 0, corner[0][1]);
    on_needle(n, to, 1, corner[0][2]);
    on_needle(n, from, 0, corner[1][0]);
    on_needle(n, to, 1, corner[1][1]);
    on_needle(n, from, 1, corner[1][2]);
    return triangles_of(corner[0], 2);
}

static void judge_needle(const struct needle *n, const struct spc_reader *r, int k)
{
    const double at = 0.3 + 0.1 * k, wide = at * n->wide;
    struct picture_view v = {.fov_rad = 0.8, .width = SIDE, .height = SIDE, .eps_px = k % 2 ? 3 : 0.5,
                             .mode = k < 2 ? SPV_HYBRID : SPV_POINTS};
    on_needle(n, at, 0.5, v.target);
    for (int a = 0; a < 3; a++) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        v.eye[a] = v.target[a] + 3 * wide * (n->along[b] * n->thin[c] - n->along[c] * n->thin[b]);
        v.up[a] = n->along[a];
    }
    struct case_mesh seen = piece(n, at - 4 * wide, at + 4 * wide);
    judge(r, &seen, &v, &EXACT, k < 2 ? 0.95 : 0, "needle");
    ck_assert_uint_gt(covered, 2000);
    case_mesh_free(&seen);
}

/* As the archive has it: on the lattice, which moves it by pixels where pixels are that small. */
static struct needle stored_needle(const struct spc_reader *r)
{
    struct needle n = {.wide = 0};
    size_t count;
    double (*t)[3][3] = case_triangles(r, &count), length = 0;
    int tip = 0;                    /* opposite the shortest edge */
    for (int k = 0; k < 3; k++) {
        const double *p = t[0][(k + 1) % 3], *q = t[0][(k + 2) % 3];
        const double edge = hypot(hypot(q[0] - p[0], q[1] - p[1]), q[2] - p[2]);
        tip = k == 0 || edge < n.wide ? k : tip;
        n.wide = k == 0 || edge < n.wide ? edge : n.wide;
    }
    for (int a = 0; a < 3; a++) {
        n.tip[a] = t[0][tip][a];
        n.along[a] = t[0][(tip + 1) % 3][a] - n.tip[a];
        n.thin[a] = (t[0][(tip + 2) % 3][a] - t[0][(tip + 1) % 3][a]) / n.wide;
        length += n.along[a] * n.along[a];
    }
    ck_assert_double_eq_tol(sqrt(length), 1, 1e-4);
    free(t);
    return n;
}

/* Seen whole it is a line, from close by a band. */
START_TEST(needles_of_aspect_1e8_are_seen_from_close_by)
{
    uint64_t state = 8;
    for (int i = 0; i < (full() ? 60 : 6); i++) {
        const struct needle n = some_needle(&state, i % 3 == 2 ? 1e5 : 1e8);
        double corner[3][3];
        on_needle(&n, 0, 0, corner[0]);
        on_needle(&n, 1, 0, corner[1]);
        on_needle(&n, 1, 1, corner[2]);
        struct case_mesh m = triangles_of(corner, 1);
        struct spc_reader *r = build_named(&m, "a");
        case_verify(r);
        expect_numbers(r, "needle");
        const struct needle stored = stored_needle(r);
        ck_assert(stored.wide > 0.9 * n.wide && stored.wide < 1.1 * n.wide);
        for (int k = 0; k < 4; k++)
            judge_needle(&stored, r, k);
        spc_reader_close(r);
        case_mesh_free(&m);
    }
}
END_TEST

/*
 * Triangles whose disk changes its kind: right-angled to the last bit, one step of the lattice acute,
 * one obtuse; flat; of equal corners. Tiny ones beside them make the lattice that fine.
 */
static struct case_mesh borders(uint64_t *state)
{
    enum { N = 120 };
    static double corner[N][3][3];
    for (int i = 0; i < N; i++) {
        double (*c)[3] = corner[i];
        const double ulp = 0x1p-44, size = i % 6 == 5 ? 0x1p-41 : 0x1p-3 * (1 + floor(7 * case_random(state)));
        for (int a = 0; a < 3; a++)
            c[0][a] = c[1][a] = c[2][a] = floor(1024 * case_random(state)) / 1024;
        const int x = i % 3, y = (i + 1) % 3;
        c[1][x] += size;
        c[2][y] += size * (i % 2 ? 1 : 0.75);
        switch (i % 12) {
        case 0: case 1: case 2:
            c[2][x] += (i % 12 - 1) * ulp;      /* obtuse, right, acute by the angle at corner 0 */
            break;
        case 3: case 4:
            c[1][y] += (i % 12 == 3 ? -1 : 1) * ulp;
            break;
        case 6:
            memcpy(c[2], c[1], sizeof c[2]);    /* coincident corners: a line */
            break;
        case 7:
            c[2][y] = c[0][y];                  /* on a line */
            c[2][x] += size / 4;
            break;
        case 8:
            memcpy(c[1], c[0], sizeof c[1]);    /* a point */
            memcpy(c[2], c[0], sizeof c[2]);
            break;
        case 9:
            c[2][y] = c[0][y] + ulp;            /* all but flat */
            break;
        }
    }
    return triangles_of(corner[0], N);
}

/* The circumcircle of an acute triangle, the circle on the longest edge of others: never above s / sqrt(3). */
static void expect_small_disks(const struct spc_reader *r)
{
    struct oracle_tree t;
    oracle_load(&t, r);
    for (uint32_t i = 0; i < t.node_count; i++) {
        const struct oracle_node *n = &t.nodes[i];
        double longest = 0;
        for (int k = 0; n->leaf && k < 3; k++) {
            const double *p = t.corner[n->triangle][k], *q = t.corner[n->triangle][(k + 1) % 3];
            longest = fmax(longest, hypot(hypot(q[0] - p[0], q[1] - p[1]), q[2] - p[2]));
        }
        const double step = ldexp(1, t.blocks[n->block].step_exp);
        const double most = (0.57736 * longest + step) * (1 + 1.0 / 128);     /* on its lattice, rounded up */
        if (n->leaf && ldexp(n->radius, t.header->unit_exp) > most)
            ck_abort_msg("leaf %u: a radius of %g for edges up to %g", i, ldexp(n->radius, t.header->unit_exp),
                         longest);
    }
    oracle_free(&t);
}

START_TEST(right_angles_lines_and_points_are_disks_that_hold_them)
{
    static const double middle[3] = {0.5, 0.5, 0.5};
    uint64_t state = 3;
    for (int i = 0; i < (full() ? 30 : 2); i++) {
        struct case_mesh m = borders(&state);
        struct spc_reader *r = build_named(&m, "a");
        ck_assert_int_le(spc_reader_header(r)->vertex_exp, -44);
        ck_assert_uint_eq(spc_reader_header(r)->leaf_count, m.face_count);
        case_verify(r);
        expect_small_disks(r);
        judge_around(r, &m, middle, 0.7, full() ? 6 : 2, "borders");
        spc_reader_close(r);
        case_mesh_free(&m);
    }
}
END_TEST

/* A sphere, and vertices at 0 but for the smallest numbers there are. */
static void denormal(struct case_mesh *m, uint64_t *state)
{
    static const double tiny[] = {5e-324, 1e-310, 2e-45, 1e-40, -1e-41, 0, -0.0, 1e-38};
    for (uint32_t v = 0; v < m->vertex_count; v += 3)
        for (int a = 0; a < 3; a++)
            if (fabs(m->xyz[v][a]) < 0.1)
                m->xyz[v][a] = tiny[(int)(8 * case_random(state))];
}

START_TEST(the_smallest_and_the_largest_numbers_are_coordinates_like_others)
{
    static const struct { double scale, away; bool wide, denormal; } cases[] = {
        {1, 0, false, true}, {1, 0, true, true},
        {1.5e38, 0, false, false}, {1e38, 1.5e38, false, false},        /* to 3e38, the limit of float */
        {1e39, 0, true, false}, {1e100, 2e100, true, false}, {1e300, 0, true, false}, {1e290, 1e300, true, false},
        {1e-35, 0, false, false}, {1e-38, 0, false, false}, {1e-300, 0, true, false},
    };
    uint64_t state = 4;
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct case_mesh m = case_sphere(500, k + 1);
        const double middle[3] = {cases[k].away, 0, -cases[k].away};
        char what[80];
        m.wide = cases[k].wide;
        case_transform(&m, cases[k].scale, middle);
        if (cases[k].denormal)
            denormal(&m, &state);
        snprintf(what, sizeof what, "scale %g at %g", cases[k].scale, cases[k].away);
        struct spc_reader *r = build_named(&m, "a");
        case_verify(r);
        judge_around(r, &m, middle, cases[k].scale, full() ? 6 : 1, what);
        spc_reader_close(r);
        case_mesh_free(&m);
    }
}
END_TEST

/* Pixels whose rays pass the rim of a lone disk by less than a 64th of a pixel, seen head-on from afar. */
static uint32_t judge_rim(const struct spc_reader *r, const struct oracle_node *n, double radius, uint64_t *state)
{
    const double away = 3000 * radius, px = 20 + 40 * case_random(state);
    const double shift[2] = {case_random(state), case_random(state)};
    struct picture_view v = {.up = {0.3, 0.5, 0.1}, .width = SIDE, .height = SIDE, .eps_px = 1e-3, .mode = SPV_POINTS};
    v.fov_rad = 2 * atan(SIDE / 2 / (px * away / radius));
    for (int a = 0; a < 3; a++) {
        v.eye[a] = n->center[a] + away * n->normal[a];
        v.target[a] = n->center[a];
    }
    struct spv_view view = picture_view(&v);
    for (int a = 0; a < 3; a++)
        view.camera.eye[a] += radius / px * (shift[0] * view.camera.right[a] + shift[1] * view.camera.up[a]);
    struct picture p = picture_draw(r, &view, &EXACT);
    uint32_t beyond = 0;
    for (int i = 0; i < SIDE * SIDE; i++) {
        const double x = i % SIDE + 0.5 - SIDE / 2 + shift[0], y = SIDE / 2 - (i / SIDE + 0.5) + shift[1];
        const double from_center = hypot(x, y);
        if (from_center > px + 0.95 / 64)
            continue;
        beyond += from_center > px + 0.5 / 64;
        if (!p.cover[i])
            ck_abort_msg("a pixel %g px from the middle of a disk of %g px is not covered", from_center, px);
    }
    picture_release(&p);
    return beyond;
}

START_TEST(disks_are_drawn_a_64th_of_a_pixel_wider_than_they_are)
{
    static const double corner[3][3] = {{0.1, 0.2, 0.3}, {1.1, 0.2, 0.3}, {0.4, 1.2, 0.3}};
    struct case_mesh m = triangles_of(corner, 1);
    struct spc_reader *r = build_named(&m, "a");
    struct oracle_tree t;
    uint64_t state = 6;
    uint32_t beyond = 0;
    oracle_load(&t, r);
    for (int i = 0; i < 40; i++)
        beyond += judge_rim(r, &t.nodes[0], ldexp(t.nodes[0].radius, t.header->unit_exp), &state);
    ck_assert_uint_gt(beyond, 20);
    oracle_free(&t);
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

/* ---- eyes -------------------------------------------------------------------------------------- */

/* Kind of place of an eye: on a corner, in a disk, on a triangle's plane, at an edge, in the middle of nothing. */
static void place(const struct case_mesh *m, int kind, uint64_t *state, double eye[3])
{
    const uint32_t f = (uint32_t)(m->face_count * case_random(state));
    double *c[3];
    for (int k = 0; k < 3; k++)
        c[k] = m->xyz[m->face[f][k]];
    for (int a = 0; a < 3; a++) {
        const double middle = (in_file(m, c[0][a]) + in_file(m, c[1][a]) + in_file(m, c[2][a])) / 3;
        switch (kind) {
        case 0: eye[a] = in_file(m, c[0][a]); break;
        case 1: eye[a] = middle; break;
        case 2: eye[a] = 3 * in_file(m, c[0][a]) - in_file(m, c[1][a]) - in_file(m, c[2][a]); break;
        case 3: eye[a] = (in_file(m, c[0][a]) + in_file(m, c[1][a])) / 2; break;
        case 4: eye[a] = middle * (1 + 1e-7); break;
        default: eye[a] = middle / 2; break;
        }
    }
}

/* The scan as the archive has it, on the lattice: from on a surface, a step of that is large. */
static struct case_mesh stored(const struct spc_reader *r)
{
    size_t n;
    double (*t)[3][3] = case_triangles(r, &n);
    struct case_mesh m = triangles_of(t[0], (uint32_t)n);
    free(t);
    return m;
}

START_TEST(eyes_on_corners_in_disks_and_on_planes_see_no_hole)
{
    static const double eps[] = {0.5, 8, 200, 1e4};
    static const double fovs[] = {60, 0.5, 150, 179, 20};
    struct case_mesh meshes[] = {case_sphere(700, 2), case_sheet(700, 2)};
    uint64_t state = 5;
    for (int k = 0; k < 2; k++) {
        struct spc_reader *r = build_named(&meshes[k], "a");
        struct case_mesh m = stored(r);
        expect_small_disks(r);
        for (int i = 0; i < (full() ? 1500 : 60); i++) {
            struct picture_view v = {.up = {0.3, 0.2, 1}, .fov_rad = fovs[i % 5] * PI / 180, .width = 96, .height = 64,
                                     .eps_px = eps[i % 4], .mode = i % 7 % 2 ? SPV_POINTS : SPV_HYBRID};
            place(&m, i % 6, &state, v.eye);
            for (int a = 0; a < 3; a++)
                v.target[a] = v.eye[a] + case_random(&state) - 0.5;
            judge(r, &m, &v, i % 4 == 3 ? &FAST : &EXACT, 0, "eye on the surface");
        }
        case_mesh_free(&m);
        spc_reader_close(r);
        case_mesh_free(&meshes[k]);
    }
}
END_TEST

/* From 1e30 away the model is a point, or with a lens to match less than rounding can aim at. */
START_TEST(eyes_far_beyond_the_model_see_a_point_or_nothing)
{
    static const double away[] = {1e5, 1e8, 1e12, 1e20, 1e30, 1e100, 1e300};
    struct case_mesh m = case_sphere(700, 2);
    struct spc_reader *r = build_named(&m, "a");
    const double middle[3] = {0, 0, 0};
    for (int i = 0; i < 7 * 4; i++) {
        const double eps_px[] = {1e-6, 1, 100, 1e6};
        struct picture_view v = look(i, middle, 1, eps_px[i % 4], i % 3 ? SPV_HYBRID : SPV_POINTS);
        v.eye[0] = away[i / 4];
        v.eye[1] = v.eye[2] = 0;
        judge(r, &m, &v, &EXACT, 0, "far away");
        v.fov_rad = fmax(1e-8, 3 / away[i / 4]);
        judge(r, &m, &v, &EXACT, 0, "far away, by a lens");
        if (away[i / 4] < 1e7)
            ck_assert_uint_gt(covered, 2000);
    }
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

START_TEST(any_eps_and_angle_of_view_give_no_hole)
{
    static const double fovs[] = {0.01, 0.1, 1, 30, 90, 150, 175, 179};
    struct case_mesh m = case_sphere(700, 12);
    struct spc_reader *r = build_named(&m, "a");
    const double middle[3] = {0, 0, 0};
    int i = 0;
    for (double eps_px = 1e-6; eps_px < 2e6; eps_px *= full() ? 10 : 1000)
        for (int f = 0; f < 8; f++, i++) {
            struct picture_view v = look(i, middle, 1, eps_px, i % 3 ? SPV_HYBRID : SPV_POINTS);
            v.width = v.height = 96;
            v.fov_rad = fovs[f] * PI / 180;
            const bool fine = eps_px <= 1e-3 && i % 3;
            judge(r, &m, &v, &EXACT, fine && fovs[f] > 0.2 && fovs[f] < 160 ? 0.98 : 0, "eps and fov");
            for (int a = 0; a < 3; a++)         /* so far that the model is framed */
                v.eye[a] *= 0.4 / tan(v.fov_rad / 2);
            if (fovs[f] < 60)
                judge(r, &m, &v, &EXACT, fine ? 0.98 : 0, "eps and fov, framed");
        }
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

/* ---- sizes of pictures ------------------------------------------------------------------------- */

START_TEST(pictures_of_one_pixel_and_of_one_row_are_whole)
{
    static const int sizes[][2] = {{1, 1}, {1, 4096}, {4096, 1}, {2, 3}, {3, 1000}, {1000, 5}};
    struct case_mesh m = case_sphere(2000, 7);
    struct spc_reader *r = build_named(&m, "a");
    const double middle[3] = {0, 0, 0};
    for (int i = 0; i < 6 * 6; i++) {
        struct picture_view v = look(i, middle, 1, i % 2 ? 1 : 20, i % 3 ? SPV_HYBRID : SPV_POINTS);
        v.width = sizes[i / 6][0];
        v.height = sizes[i / 6][1];
        const struct spv_view view = picture_view(&v);
        struct picture p = picture_draw(r, &view, i % 4 ? &EXACT : &FAST);
        struct ref_image image = reference(&m, &v, spc_reader_header(r)->unit_exp);
        for (int k = 1; k + 1 < v.width * v.height; k++)    /* no neighbourhoods in one row: those beside */
            if (image.triangle[k - 1] != UINT32_MAX && image.triangle[k] != UINT32_MAX &&
                image.triangle[k + 1] != UINT32_MAX && !p.cover[k])
                ck_abort_msg("%d x %d, view %d: a hole at %d", v.width, v.height, i, k);
        ck_assert(v.width * v.height > 1 || p.cover[0] != 0);
        picture_release(&p);
        ref_image_release(&image);
    }
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

/* Each pixel of a large picture whose place in a small one is well inside the model, or the refusal. */
static void expect_large(const struct spc_reader *r, const struct case_mesh *m, int side, enum spv_mode mode)
{
    enum { SMALL = 512 };
    const double middle[3] = {0, 0, 0};
    struct picture_view v = look(4, middle, 1, 4, mode);
    v.width = v.height = SMALL;
    struct ref_image image = reference(m, &v, spc_reader_header(r)->unit_exp);
    v.width = v.height = side;
    const struct spv_view view = picture_view(&v);
    struct spv_selection s = {0};
    struct spv_drawn drawn;
    struct spc_error err = {0};
    uint8_t *rgba = malloc((size_t)4 * (size_t)side * (size_t)side);
    ck_assert_ptr_nonnull(rgba);
    ck_assert_int_eq(spv_select(r, &view, &s, &err), SPC_OK);
    const enum spc_status status = spv_draw_selection(picture_soft(), r, &view, &s, &EXACT, rgba, &drawn, &err);
    ck_assert_msg(status == SPC_OK || ((status == SPC_NO_MEMORY || status == SPC_FEATURE) && err.what[0]),
                  "status %d: %s", (int)status, err.what);
    const size_t per = (size_t)(side / SMALL);
    for (size_t y = 1; y + 1 < SMALL && status == SPC_OK; y++)
        for (size_t x = 1; x + 1 < SMALL; x++) {
            bool inside = true;
            for (size_t k = 0; k < 9; k++)
                inside = inside && image.triangle[(y + k / 3 - 1) * SMALL + x + k % 3 - 1] != UINT32_MAX;
            for (size_t k = 0; inside && k < per * per; k++)
                if (rgba[4 * ((y * per + k / per) * (size_t)side + x * per + k % per) + 3] == 0)
                    ck_abort_msg("%d x %d: a hole in place %zu, %zu", side, side, x, y);
        }
    spv_selection_release(&s);
    ref_image_release(&image);
    free(rgba);
}

START_TEST(the_largest_pictures_have_no_hole)
{
    struct case_mesh m = case_sphere(5000, 7);
    struct spc_reader *r = build_named(&m, "a");
    expect_large(r, &m, 2048, SPV_HYBRID);
    if (full()) {
        expect_large(r, &m, 16384, SPV_HYBRID);
        expect_large(r, &m, 16384, SPV_POINTS);
    }
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

int main(void)
{
    return SUITE("extremes", start, finish,
                 scaled_by_any_power_of_two_codes_and_pictures_are_the_same,
                 scans_too_large_to_measure_are_refused,
                 scans_too_small_to_measure_are_refused,
                 scans_just_large_enough_to_measure_tell_what_they_lose,
                 moved_far_from_the_origin_scans_look_as_they_are,
                 detail_of_a_billionth_is_seen_from_both_ends,
                 needles_of_aspect_1e8_are_seen_from_close_by,
                 right_angles_lines_and_points_are_disks_that_hold_them,
                 the_smallest_and_the_largest_numbers_are_coordinates_like_others,
                 disks_are_drawn_a_64th_of_a_pixel_wider_than_they_are,
                 eyes_on_corners_in_disks_and_on_planes_see_no_hole,
                 eyes_far_beyond_the_model_see_a_point_or_nothing,
                 any_eps_and_angle_of_view_give_no_hole,
                 pictures_of_one_pixel_and_of_one_row_are_whole,
                 the_largest_pictures_have_no_hole);
}
