/*
 * The back end without GL: the picture of GL, the same for any number of threads, at any scale.
 * test_picture.c compares both with the reference.
 */
#include "bytes.h"
#include "count.h"
#include "interval.h"
#include "mesh_case.h"
#include "picture_case.h"
#include "kept.h"
#include "soft_int.h"
#include "suite.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const struct spv_draw_options EXACT = {.splat = SPV_SPLAT_EXACT, .ambient = 0.2f};
static const struct spv_draw_options FAST = {.splat = SPV_SPLAT_FAST, .ambient = 0.2f};
enum { SIDE = 256 };

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

/* View i of a mesh around middle, now from afar, now from close by, from 6 on from within; never along up. */
static struct picture_view around(int i, double middle, enum spv_mode mode, double eps_px)
{
    static const double from[6][3] = {{1, 0.2, 0.3}, {-1, 0.1, 0}, {0.3, 1, 0.5},
                                      {0.1, -1, 0.2}, {0.7, 0.5, 1}, {0, 0.3, -1}};
    struct picture_view v = {.up = {0.1, 0.9, 0.3}, .fov_rad = 0.9, .width = SIDE, .height = SIDE,
                             .eps_px = eps_px, .mode = mode};
    for (int a = 0; a < 3; a++) {
        v.eye[a] = middle + from[i % 6][a] * (i >= 6 ? 0.15 * (i - 5) : i % 2 ? 1.4 : 2.6);
        v.target[a] = middle + (i >= 6) * 2 * from[(i + 1) % 6][a];
    }
    return v;
}

/* Share of covered pixels of which some channel differs by more than limit. */
static double differ(const struct picture *a, const struct picture *b, int limit)
{
    size_t covered = 0, other = 0;
    for (size_t i = 0; i < (size_t)a->width * (size_t)a->height; i++) {
        int most = 0;
        for (size_t c = 4 * i; c < 4 * i + 4; c++) {
            const int d = abs(a->rgba[c] - b->rgba[c]);
            most = d > most ? d : most;
        }
        covered += a->cover[i] || b->cover[i];
        other += most > limit;
    }
    ck_assert_uint_gt(covered, 100);
    return (double)other / (double)covered;
}

/*
 * What may differ: pixels on an outline or on a seam of two surfaces. GL snaps corners to 1/256 px and
 * moves a triangle's corners outward instead of its edges, which needles show most; disks that lie in
 * each other, as those of the two halves of a rectangle do, are parted by the last bit of their depth,
 * and of equal ones GL shows the first.
 */
START_TEST(pictures_are_those_of_gl)
{
    struct case_mesh meshes[] = {case_sphere(6000, 3), case_sheet(3000, 4), case_soup(500, 5)};
    double sum = 0;
    for (int m = 0; m < 3; m++) {
        if (m < 2)
            case_color(&meshes[m]);
        struct spc_reader *r = case_archive(&meshes[m]);
        for (int i = 0; i < (m == 0 ? 10 : 6); i++)
            for (int mode = 0; mode < 3; mode++) {
                const double eps_px = i < 6 ? 1 + 2 * i : 40 * (i - 5);
                const struct picture_view v = around(i, m == 0 ? 0 : 0.5, (enum spv_mode)mode, eps_px);
                const struct spv_view view = picture_view(&v);
                picture_use(PICTURE_BY_SOFT, 2);
                struct picture soft = picture_draw(r, &view, &EXACT);
                picture_use(PICTURE_BY_GL, 0);
                struct picture gl = picture_draw(r, &view, &EXACT);
                const double d = differ(&soft, &gl, 16);
                sum += d;
                ck_assert_msg(d <= 0.03, "mesh %d, view %d, mode %d: %.4f of the pixels differ", m, i,
                              mode, d);
                picture_release(&soft);
                picture_release(&gl);
            }
        spc_reader_close(r);
        case_mesh_free(&meshes[m]);
    }
    ck_assert_msg(sum <= 66 * 0.005, "%.4f of the pixels differ", sum / 66);
}
END_TEST

/* From afar through a narrow view, where splats are of none, one or a few pixels, and few hide each other. */
START_TEST(small_splats_are_those_of_gl)
{
    struct case_mesh m = case_soup(3000, 16);
    case_color(&m);
    struct spc_reader *r = case_archive(&m);
    for (int i = 0; i < 12; i++) {
        struct picture_view v = around(i % 6, 0.5, SPV_POINTS, 1e-3);
        v.fov_rad = 0.06;
        for (int a = 0; a < 3; a++)
            v.eye[a] = 0.5 + (v.eye[a] - 0.5) * 8 * (1 + i);
        const struct spv_view view = picture_view(&v);
        picture_use(PICTURE_BY_SOFT, 1 + (unsigned)i % 2);
        struct picture soft = picture_draw(r, &view, &EXACT);
        picture_use(PICTURE_BY_GL, 0);
        struct picture gl = picture_draw(r, &view, &EXACT);
        const double d = differ(&soft, &gl, 8);
        ck_assert_msg(d <= 0.003, "view %d: %.4f of the pixels differ", i, d);
        picture_use(PICTURE_BY_SOFT, 1 + (unsigned)i % 2);
        struct picture fast = picture_draw(r, &view, &FAST);
        for (size_t k = 0; k < (size_t)SIDE * SIDE; k++)
            ck_assert_msg(fast.cover[k] || !soft.cover[k], "view %d: pixel %zu is only drawn exactly", i, k);
        picture_release(&soft);
        picture_release(&gl);
        picture_release(&fast);
    }
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

/* Large pills that cross the eye's plane beside the eye: a ray's other half does not meet them. */
START_TEST(pills_beside_the_eye_are_those_of_gl)
{
    struct case_mesh m = case_sphere(2000, 15);
    struct spc_reader *r = case_archive(&m);
    for (int i = 0; i < 24; i++) {
        struct picture_view v = around(i, 0, SPV_POINTS, i % 2 ? 1e5 : 400);
        const double length = sqrt(v.eye[0] * v.eye[0] + v.eye[1] * v.eye[1] + v.eye[2] * v.eye[2]);
        v.fov_rad = 2.4;
        for (int a = 0; a < 3; a++) {
            v.eye[a] *= (1.1 + 0.1 * (i / 2)) / length;
            v.target[a] = v.eye[a] + (i % 3 - 0.7) * v.eye[a] + v.eye[(a + 1) % 3] - v.eye[(a + 2) % 3];
        }
        const struct spv_view view = picture_view(&v);
        picture_use(PICTURE_BY_SOFT, 2);
        struct picture soft = picture_draw(r, &view, &EXACT);
        picture_use(PICTURE_BY_GL, 0);
        struct picture gl = picture_draw(r, &view, &EXACT);
        size_t covered = 0, other = 0;
        for (size_t k = 0; k < (size_t)SIDE * SIDE; k++) {
            covered += gl.cover[k] != 0;
            other += soft.cover[k] != gl.cover[k];
        }
        ck_assert_msg(other <= 8 + covered / 500, "view %d: %zu of %zu pixels differ", i, other, covered);
        picture_release(&soft);
        picture_release(&gl);
    }
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

static void expect_same(const struct picture *a, const struct picture *b, const char *what)
{
    const size_t n = (size_t)4 * (size_t)a->width * (size_t)a->height;
    size_t at = 0;
    while (at < n && a->rgba[at] == b->rgba[at])
        at++;
    ck_assert_msg(at == n, "%s: byte %zu is %d, not %d", what, at, at < n ? b->rgba[at] : 0,
                  at < n ? a->rgba[at] : 0);
}

START_TEST(any_threads_and_vectors_give_the_same_bytes)
{
    static const unsigned threads[] = {1, 2, 5, 5, 1, 1, 2};
    static const char *const what[] = {"one thread", "two threads", "five threads", "no vectors, five threads",
                                       "no vectors", "AVX2", "AVX2, two threads"};
    struct case_mesh m = case_sheet(20000, 6);
    case_color(&m);
    struct spc_reader *r = case_archive(&m);
    for (int i = 0; i < 8; i++) {
        const struct picture_view v = around(i, 0.5, (enum spv_mode)(i % 3), i < 4 ? 1 : 6);
        const struct spv_view view = picture_view(&v);
        struct picture first = {0};
        for (int k = 0; k < 7; k++) {
            picture_use(PICTURE_BY_SOFT, threads[k]);
            if (k >= 3)
                spv_soft_narrow(picture_soft(), k < 5 ? SPV_LANES_PLAIN : SPV_LANES_AVX2);
            struct picture p = picture_draw(r, &view, i % 2 ? &EXACT : &FAST);
            if (k == 0) {
                first = p;
                continue;
            }
            expect_same(&first, &p, what[k]);
            picture_release(&p);
        }
        picture_release(&first);
    }
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

START_TEST(counts_are_those_of_the_processor)
{
    struct case_mesh m = case_sphere(20000, 7);
    struct spc_reader *r = case_archive(&m);
    const struct spv_draw_options all = {.ambient = 0.2f, .no_occlusion = true};
    for (int i = 0; i < 18; i++) {
        const struct picture_view v = around(i, i < 6 ? 0 : 0.4, (enum spv_mode)(i % 3), 0.5 * (i + 1));
        struct spv_view view = picture_view(&v);
        struct spv_count c;
        view.cull = i % 2;
        struct picture p = picture_draw(r, &view, &all);
        ck_assert_int_eq(spv_count(r, &view, &p.selection, &c, NULL), SPC_OK);
        const uint64_t nodes = p.drawn.nodes, triangles = p.drawn.triangles;
        if (!spv_culls_back(r, &view)) {
            ck_assert_uint_eq(nodes, c.nodes_drawn);
            ck_assert_uint_eq(triangles, c.triangles_drawn);
        } else {                    /* those of normal clusters that face away are not looked at */
            ck_assert_uint_le(nodes, c.nodes_drawn);
            ck_assert_uint_le(triangles, c.triangles_drawn);
        }
        ck_assert_uint_gt(nodes + triangles, 0);
        picture_release(&p);
    }
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

/* I9: the scan and the camera times a power of two are the same picture. */
START_TEST(scale_leaves_every_byte_as_it_is)
{
    static const int exponents[] = {0, 100, -100, 37};
    struct picture first[6] = {{0}};
    for (int k = 0; k < 4; k++) {
        const double zero[3] = {0, 0, 0}, scale = ldexp(1, exponents[k]);
        struct case_mesh m = case_sphere(3000, 6);
        case_transform(&m, scale, zero);
        struct spc_reader *r = case_archive(&m);
        for (int i = 0; i < 6; i++) {
            struct picture_view v = around(i, i == 5 ? 0.3 : 0, (enum spv_mode)(i % 2), 1 + 3 * i);
            for (int a = 0; a < 3; a++) {
                v.eye[a] *= scale;
                v.target[a] *= scale;
            }
            const struct spv_view view = picture_view(&v);
            struct picture p = picture_draw(r, &view, &EXACT);
            if (k == 0) {
                first[i] = p;
                continue;
            }
            expect_same(&first[i], &p, "scale");
            picture_release(&p);
        }
        spc_reader_close(r);
        case_mesh_free(&m);
    }
    for (int i = 0; i < 6; i++)
        picture_release(&first[i]);
}
END_TEST

START_TEST(narrow_and_wide_views_have_no_hole)
{
    struct case_mesh m = case_sphere(6000, 9);
    struct spc_reader *r = case_archive(&m);
    const double degree = acos(-1) / 180;
    for (int i = 0; i < 18; i++) {
        struct picture_view v = {.up = {0, 1, 0}, .width = i % 3 ? 200 : 1, .height = i % 3 == 2 ? 31 : 200,
                                 .eps_px = i % 2 ? 1 : 8, .mode = i % 4 ? SPV_HYBRID : SPV_POINTS};
        const bool narrow = i < 12;
        v.fov_rad = i < 6 ? 0.01 * degree : narrow ? 1e-6 : 179 * degree;
        v.eye[0] = i < 6 ? 12000 : narrow ? 2e6 : i % 2 ? 0.2 : 1.15;  /* inside, or near the surface */
        v.eye[2] = i < 6 ? 5000 : narrow ? 1e6 : 0.1;
        const struct ref_compare c = picture_compare(r, &v, i % 2 ? &EXACT : &FAST, "fov");
        ck_assert_msg(c.holes == 0, "view %d: %d holes, the first at %d, %d", i, (int)c.holes, c.hole_x,
                      c.hole_y);
        if (narrow && i % 2 && i % 3)
            ck_assert_msg(c.overlap > 0.98, "view %d: overlap %.4f", i, c.overlap);
    }
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

/* A picture of one pixel, and eyes where no number is left for a distance. */
START_TEST(the_smallest_picture_and_the_farthest_eye_are_drawn)
{
    struct case_mesh m = case_sphere(2000, 10);
    struct spc_reader *r = case_archive(&m);
    struct picture_view v = around(0, 0, SPV_HYBRID, 1);
    v.width = v.height = 1;
    struct spv_view view = picture_view(&v);
    struct picture p = picture_draw(r, &view, &EXACT);
    ck_assert_uint_eq(p.cover[0], 255);
    picture_release(&p);
    static const double far[] = {1e12, 1e30, 1e150, 1e300};
    for (int i = 0; i < 8; i++) {
        v = around(1, 0, i % 2 ? SPV_POINTS : SPV_HYBRID, 1);
        v.eye[0] = far[i / 2];
        view = picture_view(&v);
        view.cull = i < 4;
        p = picture_draw(r, &view, i < 6 ? &EXACT : &FAST);
        picture_release(&p);
    }
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

/* Of two that lie equally far the one with more blue is seen, whichever comes first. */
START_TEST(of_equal_depths_the_larger_colour_is_seen)
{
    static const uint8_t red[4] = {255, 0, 0, 255}, blue[4] = {0, 0, 255, 255};
    for (int order = 0; order < 2; order++) {
        struct case_mesh m = case_sheet(200, 3);
        const uint32_t n = m.vertex_count, f = m.face_count;
        m.xyz = realloc(m.xyz, 2 * n * sizeof *m.xyz);
        m.rgba = realloc(m.rgba, 2 * n * sizeof *m.rgba);
        m.face = realloc(m.face, 2 * f * sizeof *m.face);
        memcpy(m.xyz + n, m.xyz, n * sizeof *m.xyz);
        for (uint32_t i = 0; i < 2 * n; i++)
            memcpy(m.rgba[i], (i < n) == (order == 0) ? red : blue, 4);
        for (uint32_t i = 0; i < f; i++)
            for (int c = 0; c < 3; c++)
                m.face[f + i][c] = m.face[i][c] + n;
        m.vertex_count = 2 * n;
        m.face_count = 2 * f;
        struct spc_reader *r = case_archive(&m);
        const struct picture_view v = around(0, 0.5, SPV_TRIANGLES, 1);
        const struct spv_view view = picture_view(&v);
        struct picture p = picture_draw(r, &view, &EXACT);
        size_t covered = 0;
        for (size_t i = 0; i < (size_t)SIDE * SIDE; i++) {
            covered += p.cover[i] != 0;
            if (p.cover[i] && (p.rgba[4 * i] != 0 || p.rgba[4 * i + 2] == 0))
                ck_abort_msg("order %d: pixel %zu is not blue", order, i);
        }
        ck_assert_uint_gt(covered, 1000);
        picture_release(&p);
        spc_reader_close(r);
        case_mesh_free(&m);
    }
}
END_TEST

/* Tiles that most clusters do not reach into. */
START_TEST(tiles_are_the_whole_picture)
{
    static const struct spv_draw_options tiles = {.splat = SPV_SPLAT_EXACT, .ambient = 0.2f, .tile = 50};
    struct case_mesh m = case_sheet(20000, 13);
    case_color(&m);
    struct spc_reader *r = case_archive(&m);
    for (int i = 0; i < 6; i++) {
        const struct picture_view v = around(i, 0.5, i % 2 ? SPV_POINTS : SPV_HYBRID, 2);
        const struct spv_view view = picture_view(&v);
        struct picture whole = picture_draw(r, &view, &EXACT), tiled = picture_draw(r, &view, &tiles);
        const double d = differ(&whole, &tiled, 2);
        ck_assert_msg(d <= 0.001, "view %d: %.4f of the pixels differ", i, d);
        picture_release(&whole);
        picture_release(&tiled);
    }
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

/* Ground that reaches past the eye on all sides, seen from above and from below. */
START_TEST(triangles_through_the_eyes_plane_are_seen_from_both_sides)
{
    struct case_mesh m = case_sheet(2, 14);
    m.vertex_count = 4;
    m.face_count = 2;
    m.xyz = realloc(m.xyz, 4 * sizeof *m.xyz);
    m.face = realloc(m.face, 2 * sizeof *m.face);
    for (int i = 0; i < 4; i++)
        memcpy(m.xyz[i], (double[3]){i & 1 ? 9 : -11, 0.125 * i, i & 2 ? 13 : -7}, sizeof *m.xyz);
    memcpy(m.face[0], (uint32_t[3]){0, 1, 2}, sizeof *m.face);
    memcpy(m.face[1], (uint32_t[3]){1, 3, 2}, sizeof *m.face);
    struct spc_reader *r = case_archive(&m);
    for (int i = 0; i < 8; i++) {
        struct picture_view v = {.eye = {0.3, i < 4 ? 1 : -1, 0.2}, .up = {0, 1, 0}, .fov_rad = 1.2,
                                 .width = 200, .height = 160, .eps_px = 1, .mode = SPV_TRIANGLES};
        v.target[0] = i % 4 == 0 ? 5 : i % 4 == 1 ? -5 : 0.1;
        v.target[2] = i % 4 == 2 ? 5 : i % 4 == 3 ? -5 : 0;
        const struct ref_compare c = picture_compare(r, &v, &EXACT, "ground");
        ck_assert_msg(c.holes == 0 && c.overlap > 0.99, "view %d: %d holes, overlap %.4f", i,
                      (int)c.holes, c.overlap);
        const struct spv_view view = picture_view(&v);
        picture_use(PICTURE_BY_SOFT, 2);
        struct picture soft = picture_draw(r, &view, &EXACT);
        picture_use(PICTURE_BY_GL, 0);
        struct picture gl = picture_draw(r, &view, &EXACT);
        ck_assert(differ(&soft, &gl, 3) < 0.02);
        picture_use(PICTURE_BY_SOFT, 2);
        picture_release(&soft);
        picture_release(&gl);
    }
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

/* Blocks of which some are decoded already, in any order. */
START_TEST(decoded_blocks_in_any_order_are_the_same_picture)
{
    struct case_mesh m = case_sphere(8000, 11);
    struct spc_reader *r = case_archive(&m);
    const uint32_t blocks = spc_reader_header(r)->block_count;
    uint8_t **payloads = calloc(blocks, sizeof *payloads);
    for (uint32_t i = 0; i < blocks; i++) {
        struct spc_block b;
        spc_reader_block(r, i, &b);
        payloads[i] = malloc(b.raw_bytes);
        ck_assert_int_eq(spc_block_decode(r, i, true, payloads[i], NULL), SPC_OK);
        ck_assert_int_eq(spv_kept_sort(r, i, payloads[i], NULL), SPC_OK);
    }
    const struct picture_view v = around(0, 0, SPV_HYBRID, 3);
    const struct spv_view view = picture_view(&v);
    struct picture whole = picture_draw(r, &view, &EXACT), parts = picture_draw(r, &view, &EXACT);
    const uint32_t n = whole.selection.block_count;
    struct spv_item *items = calloc(n, sizeof *items);
    struct spv_part part = {.reader = r, .items = items, .item_count = n};
    memset(parts.rgba, 1, (size_t)4 * SIDE * SIDE);
    for (uint32_t i = 0; i < n; i++) {
        const uint32_t block = whole.selection.blocks[n - 1 - i].block;
        items[i] = (struct spv_item){block, i % 3 ? payloads[block] : NULL, -1};
    }
    ck_assert_int_eq(spv_draw_frame(picture_soft(), &view, NULL, &part, 1, &EXACT, parts.rgba, NULL, NULL), SPC_OK);
    free(items);
    expect_same(&whole, &parts, "parts");
    picture_release(&whole);
    picture_release(&parts);
    for (uint32_t i = 0; i < blocks; i++)
        free(payloads[i]);
    free(payloads);
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

START_TEST(a_damaged_block_is_named_and_the_next_frame_is_whole)
{
    struct case_mesh m = case_sphere(8000, 12);
    struct spc_reader *whole = case_archive(&m), *broken;
    uint64_t size;
    const uint8_t *bytes = spc_reader_bytes(whole, &size);
    uint8_t *copy = malloc(size), *rgba = malloc((size_t)4 * SIDE * SIDE);
    const struct picture_view v = around(0, 0, SPV_HYBRID, 1);
    const struct spv_view view = picture_view(&v);
    struct picture p = picture_draw(whole, &view, &EXACT), again;
    struct spc_block b;
    spc_reader_block(whole, p.selection.blocks[p.selection.block_count / 2].block, &b);
    memcpy(copy, bytes, size);
    copy[b.off + 70] ^= 1;
    ck_assert_int_eq(spc_reader_open_memory(copy, size, &broken, NULL), SPC_OK);
    for (int k = 0; k < 3; k++) {
        struct spc_error err = {0};
        ck_assert_int_eq(spv_draw_selection(picture_soft(), broken, &view, &p.selection, &EXACT, rgba, NULL, &err),
                         SPC_CHECKSUM);
        ck_assert_int_eq(err.status, SPC_CHECKSUM);
        ck_assert_uint_eq(err.at_off, b.off);
    }
    again = picture_draw(whole, &view, &EXACT);
    expect_same(&p, &again, "after a failure");
    picture_release(&p);
    picture_release(&again);
    spc_reader_close(broken);
    spc_reader_close(whole);
    free(copy);
    free(rgba);
    case_mesh_free(&m);
}
END_TEST

/*
 * Nodes on a line from the eye, at whole numbers of steps, with errors that are q itself or a code
 * beside it: there half-open intervals show.
 */
START_TEST(tests_of_nodes_are_those_of_the_processor_to_the_last_bit)
{
    enum { COUNT = SOFT_CHUNK };
    static uint8_t records[COUNT * SPC_NODE_BYTES];
    struct soft_scratch *s = malloc(sizeof *s);
    uint64_t state = 5, equal = 0;
    for (int round = 0; round < 200; round++) {
        const struct spc_header h = {.unit_exp = 4};
        const struct spv_view view = {.eps = ldexp(1, -round % 20), .mode = SPV_HYBRID};
        const float missing = round % 3 ? -1 : spc_len_decode(spc_len_encode_up(view.eps * case_random(&state)));
        const struct soft_frame f = {.header = &h, .view = &view, .tested = &view,
                                     .lanes = (enum spv_lanes)(round % (1 + (int)spv_lanes_here()))};
        const struct soft_block b = {.frame = &f, .b = {.step_exp = -4, .link_base = -40 + round % 9},
                                     .payload = records, .missing = missing, .lower = round % 4 < 2};
        const struct spv_interval in = {.step = 0x1p-8f, .eps = (float)view.eps,
                                        .link_base = b.b.link_base, .lower = b.lower, .missing = missing};
        for (int i = 0; i < COUNT; i++) {
            uint8_t *r = records + (size_t)SPC_NODE_BYTES * (size_t)i;
            const int x = (int)(case_random(&state) * 256), radius = (int)(case_random(&state) * x);
            const int off = (int)(case_random(&state) * 3) - 1;
            const double q = view.eps * (x - radius) * 0x1p-8;
            const int code = q > 0 ? spc_len_encode_up(q) + off : 0;
            memset(r, 0, SPC_NODE_BYTES);
            store_u16(r + ND_X, (uint16_t)x);
            store_u16(r + ND_NORMAL, (uint16_t)(i * 251 % 255 | i % 255 << 8));
            store_u16(r + ND_RADIUS, spc_len_encode_up(radius * 0x1p-8));
            store_u16(r + ND_E_SELF, (uint16_t)code);
            store_u16(r + ND_E_PARENT, (uint16_t)(i % 7 ? code + i % 3 : SPC_LEN_ROOT));
            r[ND_LINK] = (uint8_t)i;
            equal += off == 0 && q > 0;
        }
        for (int triangles = 0; triangles < 2; triangles++) {
            const uint32_t n = spv_soft_gather(&b, s, 0, COUNT, triangles);
            uint32_t k = 0;
            for (uint32_t i = 0; i < COUNT; i++) {
                const uint8_t *r = records + (size_t)SPC_NODE_BYTES * i;
                if (triangles ? spv_interval_triangle(&in, r) : spv_interval_point(&in, r))
                    if (k == n || s->index[k++] != i)
                        ck_abort_msg("round %d: node %u is not drawn", round, i);
            }
            ck_assert_uint_eq(k, n);
        }
    }
    ck_assert_uint_gt(equal, 1000);
    free(s);
}
END_TEST

int main(void)
{
    return SUITE("soft", start, finish, pictures_are_those_of_gl, small_splats_are_those_of_gl,
                 pills_beside_the_eye_are_those_of_gl,
                 any_threads_and_vectors_give_the_same_bytes, counts_are_those_of_the_processor,
                 tests_of_nodes_are_those_of_the_processor_to_the_last_bit,
                 scale_leaves_every_byte_as_it_is, narrow_and_wide_views_have_no_hole,
                 the_smallest_picture_and_the_farthest_eye_are_drawn,
                 of_equal_depths_the_larger_colour_is_seen,
                 tiles_are_the_whole_picture,
                 triangles_through_the_eyes_plane_are_seen_from_both_sides,
                 decoded_blocks_in_any_order_are_the_same_picture,
                 a_damaged_block_is_named_and_the_next_frame_is_whole);
}
