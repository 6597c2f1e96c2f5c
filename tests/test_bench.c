#include "bench_trade.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

/* spc-bench's own is that of a tool with a terminal. */
enum spc_status bench_tell(const char *phase, uint64_t done, uint64_t total, struct spc_error *err)
{
    (void)phase, (void)done, (void)total, (void)err;
    return SPC_OK;
}

/* ---- which eps to take -------------------------------------------------------------------------- */

enum { EPS = 4, VIEWS = 2 };
static struct bench_options options;
static struct bench_result result;
static struct bench_row rows[2 * EPS * VIEWS];

/* Hybrid and points at eps 1, 2, 4, 8 in two views; of points everything is better, and nobody asks for them. */
static void setup(void)
{
    static const double ms[VIEWS][EPS] = {{80, 40, 20, 10}, {60, 50, 30, 5}};
    static const double error[VIEWS][EPS] = {{0.4, 0.9, 1.6, 3}, {0.2, 1.0, 1.5, 6}};
    static const double shade[VIEWS][EPS] = {{1, 2, 3, 4}, {2, 3, 4, 5}};
    options = (struct bench_options){.eps_px = {1, 2, 4, 8}, .eps_count = EPS, .kinds = {true, true}};
    result = (struct bench_result){.options = &options, .view_count = VIEWS, .rows = rows};
    result.views[0].name = "front";
    result.views[1].name = "near";
    for (uint32_t kind = 0; kind < 2; kind++)
        for (uint32_t v = 0; v < VIEWS; v++)
            for (uint32_t e = 0; e < EPS; e++) {
                struct bench_row *row = &rows[result.row_count++];
                *row = (struct bench_row){.view = v, .kind = (enum bench_kind)kind, .eps_px = options.eps_px[e]};
                row->value[BENCH_FRAME_MS] = kind == 1 ? 1 : ms[v][e];
                row->value[BENCH_ERROR_MAX] = kind == 1 ? 0 : error[v][e];
                row->value[BENCH_SHADE_MEAN] = kind == 1 ? 0 : shade[v][e];
            }
}

static void expect(bool met, double eps_px, const char *part)
{
    struct bench_choice c;
    bench_recommend(&result, &c);
    ck_assert_msg(c.met == met && c.eps_px == eps_px, "eps %g: %s", c.eps_px, c.text);
    ck_assert_int_eq(c.kind, BENCH_HYBRID);
    ck_assert_msg(strstr(c.text, part) != NULL, "'%s' lacks '%s'", c.text, part);
}

START_TEST(speed_takes_the_finest_eps_that_the_slowest_view_keeps)
{
    options.fps = 30;
    expect(true, 4, "slowest view 'near' 30.0 ms");
    options.fps = 20;
    expect(true, 2, "'near' 50.0 ms");
    options.fps = 12;
    expect(true, 1, "'front' 80.0 ms");
}
END_TEST

START_TEST(accuracy_takes_the_coarsest_eps_that_the_worst_view_keeps)
{
    options.error_px = 1;
    expect(true, 2, "largest error 1.00 px in 'near'");
    options.error_px = 5.9;
    expect(true, 4, "1.60 px in 'front'");
    options.error_px = 0;
    options.shade = 4;
    expect(true, 4, "4.00 of 255 in 'near'");
}
END_TEST

START_TEST(a_hole_pixel_keeps_no_accuracy)
{
    options.error_px = 1;
    rows[1].value[BENCH_HOLES] = 1; /* eps 2, front */
    expect(true, 1, "0 hole pixels");
}
END_TEST

START_TEST(both_together_are_kept_or_the_nearest_is_named)
{
    options.fps = 30;
    options.error_px = 1.6;
    expect(true, 4, "30 frames/s and an error of 1.6 px");
    options.error_px = 1;           /* eps 4 misses the error by 1.6 times, eps 2 the speed by 1.5 times */
    expect(false, 2, "comes nearest");
    options.fps = 1000;
    expect(false, 8, "comes nearest");
}
END_TEST

START_TEST(with_holes_everywhere_that_with_the_fewest_comes_nearest)
{
    options.error_px = 100;
    for (size_t i = 0; i < result.row_count; i++)
        rows[i].value[BENCH_HOLES] = rows[i].eps_px == 4 ? 2 : 3;
    expect(false, 4, "4 hole pixels");
}
END_TEST

START_TEST(all_that_was_asked_for_is_told_to_its_end)
{
    options.fps = 1e300;
    options.error_px = options.shade = 1e-300;
    options.eps_px[0] = 0.0012345678;
    for (size_t i = 0; i < result.row_count; i++)
        rows[i].eps_px = rows[i].eps_px == 1 ? options.eps_px[0] : rows[i].eps_px;
    struct bench_choice c;
    bench_recommend(&result, &c);
    ck_assert_msg(c.text[strlen(c.text) - 1] == '\'', "it ends in the middle: '%s'", c.text);
    ck_assert_msg(strstr(c.text, "; shades off by 2.00 of 255 in 'near'") != NULL, "'%s' lacks the shades", c.text);
}
END_TEST

START_TEST(what_was_not_measured_is_kept_by_no_eps)
{
    struct bench_choice c;
    options.error_px = 100;
    rows[3].value[BENCH_ERROR_MAX] = NAN;       /* eps 8, in the first of two views */
    expect(true, 4, "eps 4");
    for (size_t i = 0; i < result.row_count; i++)
        rows[i].value[BENCH_ERROR_MAX] = NAN;
    bench_recommend(&result, &c);
    ck_assert(!c.met && isnan(c.eps_px));
}
END_TEST

/* ---- how far the surface is from what is drawn --------------------------------------------------- */

/*
 * An eye at (0, 0, 10) sees a triangle of edge 1/4 at the origin; its leaf's disk lies in it, its parent's, of
 * radius 1, is lifted by 1/8.
 */
static struct spv_view view_with(double eps_px, enum spv_mode mode)
{
    const double eye[3] = {0, 0, 10}, target[3] = {0, 0, 0}, up[3] = {0, 1, 0};
    struct spv_view v = {.mode = mode, .cull = true};
    ck_assert(spv_camera_look(&v.camera, eye, target, up, 0.8, 200, 100));
    v.eps = spv_camera_eps(&v.camera, eps_px);
    return v;
}

static struct bench_distance measure(double eps_px, enum spv_mode mode)
{
    struct bench_path_node nodes[2] = {
        {.center = {0, 0, 0.125}, .normal = {0, 0, 1}, .radius = 1, .e_self = 0.5, .e_parent = INFINITY,
         .parent = SPC_NONE},
        {.center = {0, 0, 0}, .normal = {0, 0, 1}, .radius = 0.125, .e_self = 0.25, .e_parent = 0.5, .link = 1.25,
         .parent = 0},
    };
    struct bench_leaf leaf = {.node = 1, .point = {{0, 0, 0}, {0.25, 0, 0}, {0, 0.25, 0}, {0.125, 0, 0},
                                                   {0.125, 0.125, 0}, {0, 0.125, 0}, {1000, 0, 0}}};
    const struct bench_paths paths = {.point_count = BENCH_LEAF_POINTS, .nodes = nodes, .leaves = &leaf,
                                      .node_count = 2, .leaf_count = 1};
    const struct spv_view view = view_with(eps_px, mode);
    struct bench_distance out;
    ck_assert_int_eq(bench_paths_measure(&paths, &view, true, &out, NULL), SPC_OK);
    return out;
}

/* Pixels of a length at a distance, as eps counts them: 1 px of eps over its angle. */
static double px(double length, double distance)
{
    return length / distance / view_with(1, SPV_HYBRID).eps;
}

static void near_to(double a, double b)
{
    ck_assert_msg(fabs(a - b) < 1e-9 * (1 + fabs(b)), "%.12g is not %.12g", a, b);
}

START_TEST(what_is_drawn_for_a_leaf_is_measured_to_its_triangle)
{
    const double far = hypot(10, 0.25);         /* of a corner */
    struct bench_distance d = measure(px(0.1, 10), SPV_HYBRID);             /* fine: the triangle itself */
    ck_assert_uint_eq(d.points, 6); /* one is not in the picture */
    ck_assert_uint_eq(d.missed, 0);
    near_to(d.max, 0);

    d = measure(px(0.1, 10), SPV_POINTS);       /* the leaf: corners lie beside it by 1/8 */
    near_to(d.max, px(0.125, far));
    near_to(d.mean, (2 * px(0.125, far) + px(sqrt(2) / 8 - 0.125, hypot(10, sqrt(2) / 8))) / 6);

    d = measure(px(0.35, 10), SPV_HYBRID);      /* the leaf, in hybrid mode */
    near_to(d.max, px(0.125, far));

    d = measure(px(1, 10), SPV_HYBRID);         /* the parent: all lies below it by 1/8 */
    near_to(d.max, px(0.125, 10));
    near_to(d.p999, px(0.125, hypot(10, 0.125)));
    near_to(d.doubles, 0);
    d = measure(px(1, 10), SPV_TRIANGLES);
    near_to(d.max, 0);
}
END_TEST

/* q of the parent is above its error, that of the leaf within its upper bound, by its link: both are drawn. */
START_TEST(a_path_drawn_twice_counts_with_the_worse_disk)
{
    const struct bench_distance d = measure(px(0.57, 10), SPV_HYBRID);
    near_to(d.doubles, 1);
    near_to(d.max, px(0.125, 10));
}
END_TEST

/* ---- views -------------------------------------------------------------------------------------- */

START_TEST(close_ups_look_at_the_nearest_point_of_the_middle)
{
    const struct spc_header h = {.box_min = {-1, -2, -3}, .box_max = {1, 2, 3}};
    struct picture_options o = {.width = 200, .height = 100, .fov_deg = 45, .up = {0, 1, 0}};
    struct bench_view views[BENCH_VIEWS], again[BENCH_VIEWS];
    ck_assert(bench_views(&o, &h, NULL, 0, views));
    const double *along = views[4].camera.forward;          /* of the framed view that close-ups come from */
    const double points[3][3] = {{-along[0], -along[1], -along[2]}, {along[0], along[1], along[2]}, {1, 2, 3}};
    const double half[3] = {1, 2, 3};
    ck_assert(bench_views(&o, &h, points, 3, views));
    ck_assert(bench_views(&o, &h, points, 3, again));
    const double framing = spv_camera_framing(&views[4].camera, half);
    for (int v = 6; v < 8; v++)
        for (int a = 0; a < 3; a++)
            near_to(points[0][a] - views[v].camera.eye[a], framing / (v == 6 ? 4 : 16) * along[a]);
    for (int a = 0; a < 3; a++) {
        near_to(views[8].camera.eye[a], 0);
        near_to(views[4].reference.target[a] - views[4].camera.eye[a], framing * along[a]);
        ck_assert(views[7].camera.eye[a] == again[7].camera.eye[a]);
    }
    o.up[1] = 0;
    ck_assert(!bench_views(&o, &h, points, 3, views));
}
END_TEST

int main(void)
{
    return SUITE("bench", setup, NULL, speed_takes_the_finest_eps_that_the_slowest_view_keeps,
                 accuracy_takes_the_coarsest_eps_that_the_worst_view_keeps, a_hole_pixel_keeps_no_accuracy,
                 both_together_are_kept_or_the_nearest_is_named,
                 with_holes_everywhere_that_with_the_fewest_comes_nearest, all_that_was_asked_for_is_told_to_its_end,
                 what_was_not_measured_is_kept_by_no_eps,
                 what_is_drawn_for_a_leaf_is_measured_to_its_triangle, a_path_drawn_twice_counts_with_the_worse_disk,
                 close_ups_look_at_the_nearest_point_of_the_middle);
}
