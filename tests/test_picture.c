/* Pictures of both back ends against the reference rasteriser: silhouettes, and never a hole. */
#include "mesh_case.h"
#include "picture_case.h"
#include "suite.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct spv_draw_options EXACT = {.splat = SPV_SPLAT_EXACT, .ambient = 0.2f};
static const struct spv_draw_options FAST = {.splat = SPV_SPLAT_FAST, .ambient = 0.2f};

/* Six sides, a corner and a close-up of the unit-sized meshes of mesh_case.h. */
static struct picture_view side(int i, double distance, double eps_px, enum spv_mode mode)
{
    static const double from[8][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0},
                                      {0, 0, 1}, {0, 0, -1}, {1, 2, 3}, {-3, 1, 2}};
    struct picture_view v = {.up = {0, 1, 0}, .fov_rad = 0.785, .width = 400, .height = 400,
                             .eps_px = eps_px, .mode = mode};
    const double length = sqrt(from[i][0] * from[i][0] + from[i][1] * from[i][1] +
                               from[i][2] * from[i][2]);
    for (int a = 0; a < 3; a++)
        v.eye[a] = from[i][a] / length * distance;
    if (i == 2 || i == 3) {
        v.up[1] = 0;
        v.up[2] = 1;
    }
    return v;
}

static void expect_no_hole(const struct spc_reader *r, const struct picture_view *v,
                           const struct spv_draw_options *o, double overlap, const char *what)
{
    char name[100];
    snprintf(name, sizeof name, "%s-%g-%d", what, v->eps_px, (int)v->mode);
    const struct ref_compare c = picture_compare(r, v, o, name);
    ck_assert_msg(c.holes == 0, "%s: %d holes, the first at %d, %d", name, (int)c.holes, c.hole_x,
                  c.hole_y);
    ck_assert_msg(c.overlap >= overlap, "%s: overlap %.4f is below %.4f", name, c.overlap, overlap);
}

START_TEST(pictures_of_a_closed_surface_have_its_outline_and_no_hole)
{
    struct case_mesh m = case_sphere(8000, 1);
    struct spc_reader *r = case_archive(&m);
    static const double eps[] = {0.5, 2, 8, 32};
    static const double hybrid[] = {0.995, 0.98, 0.93, 0.8};
    for (int e = 0; e < 4; e++)
        for (int i = e; i < 8; i += 2) {
            const struct picture_view v = side(i, 3.2, eps[e], SPV_HYBRID);
            expect_no_hole(r, &v, &EXACT, hybrid[e], "sphere");
            const struct picture_view p = side(i, 3.2, eps[e], SPV_POINTS);
            expect_no_hole(r, &p, &EXACT, e < 2 ? 0.95 : hybrid[e] - 0.03, "sphere");
            expect_no_hole(r, &p, &FAST, 0.6, "sphere-fast");
        }
    const struct picture_view t = side(6, 3.2, 1, SPV_TRIANGLES);
    expect_no_hole(r, &t, &EXACT, 0.999, "sphere");
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

START_TEST(pictures_of_open_and_broken_surfaces_have_no_hole)
{
    struct case_mesh meshes[] = {case_soup(3000, 2), case_sheet(4000, 3)};
    for (int k = 0; k < 2; k++) {
        case_color(&meshes[k]);
        struct spc_reader *r = case_archive(&meshes[k]);
        for (int i = 0; i < 8; i++) {
            struct picture_view v = side(i, 2, i % 3 == 0 ? 1 : i % 3 == 1 ? 4 : 16,
                                         i % 2 ? SPV_POINTS : SPV_HYBRID);
            for (int a = 0; a < 3; a++) {
                v.eye[a] += 0.5;
                v.target[a] = 0.5;
            }
            expect_no_hole(r, &v, &EXACT, 0.1, k ? "sheet" : "soup");
        }
        spc_reader_close(r);
        case_mesh_free(&meshes[k]);
    }
}
END_TEST

/* The eye inside the model, inside splats, near a surface; wide and narrow views. */
START_TEST(pictures_from_inside_and_from_close_by_have_no_hole)
{
    struct case_mesh m = case_sphere(6000, 4);
    struct spc_reader *r = case_archive(&m);
    uint64_t state = 3;
    for (int i = 0; i < 24; i++) {
        struct picture_view v = {.up = {0, 0, 1}, .width = 300, .height = 200};
        static const double eps[] = {0.3, 1, 5, 20, 100, 1000};
        v.eps_px = eps[i % 6];
        v.mode = i % 2 ? SPV_POINTS : SPV_HYBRID;
        v.fov_rad = i % 5 == 0 ? 2.9 : i % 5 == 1 ? 0.05 : 1;
        const double reach = i % 4 == 0 ? 0.3 : i % 4 == 1 ? 0.95 : i % 4 == 2 ? 1.02 : 1.3;
        double at[3], length = 0;
        for (int a = 0; a < 3; a++) {
            at[a] = case_random(&state) - 0.5;
            length += at[a] * at[a];
            v.target[a] = case_random(&state) - 0.5;
        }
        for (int a = 0; a < 3; a++)
            v.eye[a] = at[a] / sqrt(length) * reach;
        expect_no_hole(r, &v, &EXACT, 0, "inside");
        if (i % 3 == 0)
            expect_no_hole(r, &v, &FAST, 0, "inside-fast");
    }
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

START_TEST(pictures_at_the_extremes_of_scale_and_place_have_no_hole)
{
    static const struct { double scale, offset; bool wide; } cases[] = {
        {1e-12, 0, false}, {1e12, 0, false}, {0.5, 5.4e6, true}, {1, 1e9, true}, {1e-3, 1000, true},
        {1, 3000, false},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct case_mesh m = case_sphere(3000, 6);
        const double offset[3] = {cases[k].offset, -cases[k].offset, cases[k].offset / 3};
        m.wide = cases[k].wide;
        case_transform(&m, cases[k].scale, offset);
        struct spc_reader *r = case_archive(&m);
        for (int i = 0; i < 3; i++) {
            struct picture_view v = side(2 * i + 1, 3.2 * cases[k].scale, i == 0 ? 1 : 6,
                                         i == 2 ? SPV_POINTS : SPV_HYBRID);
            for (int a = 0; a < 3; a++) {
                v.eye[a] += offset[a];
                v.target[a] = offset[a];
            }
            expect_no_hole(r, &v, &EXACT, i == 0 ? 0.98 : 0.85, "extreme");
        }
        spc_reader_close(r);
        case_mesh_free(&m);
    }
}
END_TEST

/*
 * Triangles alone, without neighbours to help out at their edges: every pixel whose ray meets one is
 * covered, however near to the edge. Needles in projection may lose their tips.
 */
START_TEST(no_pixel_of_a_lone_triangle_is_lost)
{
    struct case_mesh m = case_soup(600, 12);
    struct spc_reader *r = case_archive(&m);
    uint64_t state = 77, covered = 0, lost = 0;
    for (int i = 0; i < 40; i++) {
        struct picture_view v = {.up = {0, 0, 1}, .fov_rad = 0.8, .width = 200, .height = 200,
                                 .eps_px = 0.01, .mode = SPV_HYBRID};
        for (int a = 0; a < 3; a++) {
            v.eye[a] = 0.5 + 3 * (case_random(&state) - 0.5);
            v.target[a] = 0.3 + 0.4 * case_random(&state);
        }
        const struct spv_view view = picture_view(&v);
        struct picture p = picture_draw(r, &view, &EXACT);
        struct ref_image ref = picture_reference(r, &view, v.fov_rad, v.eye, v.target, v.up);
        for (size_t k = 0; k < (size_t)200 * 200; k++) {
            covered += ref.triangle[k] != UINT32_MAX;
            lost += ref.triangle[k] != UINT32_MAX && !p.cover[k];
        }
        picture_release(&p);
        ref_image_release(&ref);
    }
    ck_assert_uint_gt(covered, 50000);
    ck_assert_uint_le(lost, covered / 50000);
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

/* Culling must not change what is seen (I7): the same picture, pixel by pixel. */
START_TEST(culling_leaves_the_picture_as_it_is)
{
    struct case_mesh m = case_sheet(5000, 8);
    case_color(&m);
    struct spc_reader *r = case_archive(&m);
    for (int i = 0; i < 10; i++) {
        struct picture_view v = side(i % 8, i < 5 ? 0.4 : 1.1, i % 2 ? 3 : 12, SPV_HYBRID);
        for (int a = 0; a < 3; a++)
            v.target[a] = v.eye[a] / 5 + 0.5;
        struct spv_view view = picture_view(&v);
        struct picture with = picture_draw(r, &view, &EXACT);
        view.cull = false;
        struct picture without = picture_draw(r, &view, &EXACT);
        ck_assert_uint_le(with.selection.block_count, without.selection.block_count);
        if (memcmp(with.rgba, without.rgba, (size_t)4 * 400 * 400) != 0)
            ck_abort_msg("view %d differs", i);
        picture_release(&with);
        picture_release(&without);
    }
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

/* On a closed surface culled back faces hide behind front ones: same cover, and it does cull. */
START_TEST(culling_back_faces_leaves_the_cover_of_a_closed_surface)
{
    struct case_mesh m = case_sphere(20000, 8);
    struct spc_reader *r = case_archive(&m);
    uint64_t culled = 0;
    for (int i = 0; i < 8; i++) {
        const struct picture_view v = side(i, 4, i % 2 ? 0.5 : 4, SPV_HYBRID);
        struct spv_view view = picture_view(&v);
        struct picture with = picture_draw(r, &view, &EXACT);
        culled += with.selection.culled_backface;
        const struct ref_compare c = picture_compare(r, &v, &EXACT, "backface");
        ck_assert_uint_eq(c.holes, 0);
        picture_release(&with);
    }
    ck_assert_uint_gt(culled, 0);
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

/* Splats larger than points may be, crossing the border and the eye's plane, in tiles or not. */
START_TEST(tiles_and_borders_leave_no_seam)
{
    struct case_mesh m = case_sphere(400, 2);
    struct spc_reader *r = case_archive(&m);
    const struct spv_draw_options tiles = {.splat = SPV_SPLAT_EXACT, .ambient = 0.2f, .tile = 64};
    for (int i = 0; i < 6; i++) {
        struct picture_view v = side(i, i < 3 ? 1.6 : 2.5, i % 2 ? 10 : 60, SPV_POINTS);
        v.width = 301;
        v.height = 173;
        const struct spv_view view = picture_view(&v);
        struct picture whole = picture_draw(r, &view, &EXACT);
        struct picture tiled = picture_draw(r, &view, &tiles);
        size_t differ = 0;
        for (size_t p = 0; p < (size_t)301 * 173; p++)
            differ += whole.cover[p] != tiled.cover[p];
        ck_assert_uint_le(differ, 8);           /* pixels whose ray grazes a splat's rim */
        expect_no_hole(r, &v, &tiles, 0, "tiles");
        picture_release(&whole);
        picture_release(&tiled);
    }
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

/* One wild vertex makes the unit large; what lies near the eye is still seen. */
START_TEST(a_face_that_reaches_far_away_hides_nothing_near)
{
    static const double far[] = {1e6, 1e9};
    for (int i = 0; i < 2; i++) {
        struct case_mesh m = case_sphere(2000, 3);
        m.xyz = realloc(m.xyz, (m.vertex_count + 1) * sizeof *m.xyz);
        m.face = realloc(m.face, (m.face_count + 1) * sizeof *m.face);
        memcpy(m.xyz[m.vertex_count], (double[3]){0, -far[i], 0}, sizeof *m.xyz);
        memcpy(m.face[m.face_count++], (uint32_t[3]){0, 1, m.vertex_count++}, sizeof *m.face);
        struct spc_reader *r = case_archive(&m);
        for (int s = 4; s < 8; s++) {
            const struct picture_view v = side(s, 3.2, 1, SPV_HYBRID);
            expect_no_hole(r, &v, &EXACT, 0.98, "far");
        }
        spc_reader_close(r);
        case_mesh_free(&m);
    }
}
END_TEST

static void start_soft(void)
{
    case_start();
    picture_use(PICTURE_BY_SOFT, 2);
}

static void finish_soft(void)
{
    picture_use(PICTURE_BY_GL, 0);
    case_finish();
}

static int both(const TTest *const *tests, size_t count)
{
    return suite_run("picture", case_start, case_finish, tests, count) |
           suite_run("picture without GL", start_soft, finish_soft, tests, count);
}

int main(void)
{
    const TTest *const tests[] = {
        pictures_of_a_closed_surface_have_its_outline_and_no_hole,
        pictures_of_open_and_broken_surfaces_have_no_hole,
        pictures_from_inside_and_from_close_by_have_no_hole,
        pictures_at_the_extremes_of_scale_and_place_have_no_hole,
        a_face_that_reaches_far_away_hides_nothing_near,
        no_pixel_of_a_lone_triangle_is_lost,
        culling_leaves_the_picture_as_it_is,
        culling_back_faces_leaves_the_cover_of_a_closed_surface,
        tiles_and_borders_leave_no_seam,
    };
    return both(tests, sizeof tests / sizeof *tests);
}
