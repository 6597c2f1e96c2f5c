/*
 * Archives on their way into pictures, by the back end without GL: what is open, what a picture becomes, what
 * is said of blocks that cannot be read.
 */
#include "mesh_case.h"
#include "scene.h"
#include "suite.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 96, HEIGHT = 72, BYTES = WIDTH * HEIGHT * 4, FRAMES_MAX = 400 };

static const struct spv_draw_options OPTIONS = {.ambient = 0.2f, .background = {1, 2, 3, 255}};
static struct spv_draw *draw;
static uint8_t picture[BYTES], wanted[BYTES];

static void start(void)
{
    case_start();
    ck_assert_int_eq(spv_soft_create(2, &draw, NULL), SPC_OK);
}

static void finish(void)
{
    spv_draw_free(draw);
    case_finish();
}

/* Path of an archive of about n triangles. */
static const char *archive(uint32_t n, const char *name)
{
    char scan[64];
    struct case_mesh mesh = case_sphere(n, n);
    snprintf(scan, sizeof scan, "%s.ply", name);
    const struct spb_build_options o = case_options(case_write(&mesh, scan), case_path(name));
    spc_reader_close(case_build(&o));
    case_mesh_free(&mesh);
    return o.out;
}

static struct spv_scene *scene_of(uint64_t budget)
{
    struct spv_scene *scene = NULL;
    const struct spv_scene_options o = {.budget = budget, .threads = 2};
    ck_assert_int_eq(spv_scene_create(&o, draw, &scene, NULL), SPC_OK);
    return scene;
}

static struct spv_view view_from(double x, double eps)
{
    static const double UP[3] = {0, 1, 0}, TARGET[3] = {0, 0, 0};
    const double eye[3] = {x, 0.5, 3};
    struct spv_view view = {.cull = true};
    ck_assert(spv_camera_look(&view.camera, eye, TARGET, UP, 0.9, WIDTH, HEIGHT));
    view.eps = spv_camera_eps(&view.camera, eps);
    return view;
}

static struct spv_scene_stats frame(struct spv_scene *scene, const struct spv_view *view)
{
    struct spv_scene_stats stats;
    struct spc_error err = {0};
    memset(picture, 0x5A, sizeof picture);
    ck_assert_msg(spv_scene_frame(scene, view, NULL, &OPTIONS, picture, &stats, &err) == SPC_OK, "%s", err.what);
    return stats;
}

/* Frames until nothing is missing that could be seen. */
static struct spv_scene_stats settle(struct spv_scene *scene, const struct spv_view *view)
{
    struct spv_scene_stats stats = frame(scene, view);
    for (int k = 0; k < FRAMES_MAX && stats.blocks_missing > stats.blocks_hidden; k++) {
        while (spv_scene_wait(scene))
            ;
        stats = frame(scene, view);
    }
    ck_assert_uint_eq(stats.blocks_missing, stats.blocks_hidden);
    return stats;
}

static void draw_alone(const char *path, const struct spv_view *view)
{
    struct spc_reader *reader = NULL;
    struct spv_selection selection = {0};
    ck_assert_int_eq(spc_reader_open(path, &reader, NULL), SPC_OK);
    ck_assert_int_eq(spv_select(reader, view, &selection, NULL), SPC_OK);
    ck_assert_int_eq(spv_draw_selection(draw, reader, view, &selection, &OPTIONS, wanted, NULL, NULL), SPC_OK);
    spv_selection_release(&selection);
    spc_reader_close(reader);
}

/* ---- pictures ---------------------------------------------------------------------------------- */

START_TEST(frames_become_the_picture_that_is_drawn_at_once)
{
    const char *path = archive(6000, "a.spc");
    struct spv_scene *scene = scene_of(1 << 26);
    ck_assert_int_eq(spv_scene_open(scene, path, NULL), SPC_OK);
    for (int k = 0; k < 4; k++) {
        const struct spv_view view = view_from(k - 1.5, 0.5 + k);
        const struct spv_scene_stats stats = settle(scene, &view);
        draw_alone(path, &view);
        ck_assert_mem_eq(picture, wanted, BYTES);
        ck_assert_uint_gt(stats.nodes_chosen, 0);
        ck_assert_uint_le(stats.nodes_chosen, stats.nodes_total);
        while (spv_scene_wait(scene))
            ;                       /* what was asked for because the camera came along */
        frame(scene, &view);
        ck_assert_uint_eq(frame(scene, &view).bytes_read, 0);
        ck_assert_uint_eq(spv_scene_busy(scene), 0);
    }
    spv_scene_free(scene);
}
END_TEST

START_TEST(what_was_loaded_is_drawn_in_the_first_frame)
{
    const char *path = archive(6000, "a.spc");
    const struct spv_view view = view_from(1, 0.5);
    struct spv_scene *scene = scene_of(1 << 26), *small = scene_of(40000);
    uint32_t missing = 1;
    ck_assert_int_eq(spv_scene_open(scene, path, NULL), SPC_OK);
    ck_assert_int_eq(spv_scene_load(scene, &view, &missing, NULL), SPC_OK);
    ck_assert_uint_eq(missing, 0);
    ck_assert_uint_eq(frame(scene, &view).blocks_missing, 0);
    draw_alone(path, &view);
    ck_assert_mem_eq(picture, wanted, BYTES);
    ck_assert_int_eq(spv_scene_open(small, path, NULL), SPC_OK);
    ck_assert_int_eq(spv_scene_load(small, &view, &missing, NULL), SPC_OK);
    ck_assert_uint_gt(missing, 0);
    spv_scene_free(scene);
    spv_scene_free(small);
}
END_TEST

START_TEST(another_back_end_draws_the_same)
{
    const char *path = archive(6000, "a.spc");
    const struct spv_view view = view_from(1, 0.5);
    struct spv_draw *other = NULL;
    struct spv_scene *scene = scene_of(1 << 26);
    ck_assert_int_eq(spv_soft_create(1, &other, NULL), SPC_OK);
    ck_assert_int_eq(spv_scene_open(scene, path, NULL), SPC_OK);
    frame(scene, &view);            /* some blocks are on their way to the first one */
    ck_assert_int_eq(spv_scene_use(scene, other, NULL), SPC_OK);
    settle(scene, &view);
    draw_alone(path, &view);
    ck_assert_mem_eq(picture, wanted, BYTES);
    ck_assert_int_eq(spv_scene_use(scene, draw, NULL), SPC_OK);
    spv_draw_free(other);           /* nothing of it is left in the scene */
    settle(scene, &view);
    ck_assert_mem_eq(picture, wanted, BYTES);
    spv_scene_free(scene);
}
END_TEST

/* ---- archives ---------------------------------------------------------------------------------- */

START_TEST(an_archive_that_cannot_be_opened_changes_nothing)
{
    const char *path = archive(3000, "a.spc"), *scan = case_path("a.spc.ply");
    const struct spv_view view = view_from(1, 1);
    double low[3], high[3];
    struct spc_error err = {0};
    struct spv_scene *scene = scene_of(1 << 26);
    ck_assert(!spv_scene_box(scene, low, high));
    ck_assert_int_eq(spv_scene_open(scene, scan, &err), SPC_NOT_SPC);
    ck_assert_str_ne(err.what, "");
    ck_assert_uint_eq(spv_scene_count(scene), 0);
    frame(scene, &view);
    for (size_t i = 0; i < BYTES; i++)
        ck_assert_uint_eq(picture[i], OPTIONS.background[i % 4]);
    ck_assert_int_eq(spv_scene_open(scene, path, NULL), SPC_OK);
    settle(scene, &view);
    memcpy(wanted, picture, BYTES);
    ck_assert_int_eq(spv_scene_open(scene, case_path("none.spc"), NULL), SPC_IO);
    ck_assert_int_eq(spv_scene_open(scene, scan, NULL), SPC_NOT_SPC);
    ck_assert_uint_eq(spv_scene_count(scene), 1);
    ck_assert_str_eq(spv_scene_path(scene, 0), path);
    ck_assert_uint_eq(frame(scene, &view).blocks_missing, 0);       /* what was read is still there */
    ck_assert_mem_eq(picture, wanted, BYTES);
    ck_assert(spv_scene_box(scene, low, high) && low[0] < -0.5 && high[0] > 0.5);
    spv_scene_free(scene);
}
END_TEST

START_TEST(archives_share_the_budget)
{
    const char *large = archive(8000, "a.spc"), *small = archive(2000, "b.spc");
    const uint64_t budget = 200000;
    const struct spv_view view = view_from(1, 0.01);
    struct spv_scene *scene = scene_of(budget);
    uint64_t most = 0;
    ck_assert_int_eq(spv_scene_open(scene, large, NULL), SPC_OK);
    ck_assert_int_eq(spv_scene_open(scene, small, NULL), SPC_OK);
    for (int k = 0; k < 40; k++) {
        const struct spv_scene_stats stats = frame(scene, &view);
        ck_assert_uint_le(stats.bytes_resident, budget);
        ck_assert_uint_eq(stats.nodes_total, spc_reader_header(spv_scene_reader(scene, 0))->node_count +
                                                 spc_reader_header(spv_scene_reader(scene, 1))->node_count);
        most = stats.bytes_resident > most ? stats.bytes_resident : most;
        while (spv_scene_wait(scene))
            ;
    }
    ck_assert_uint_gt(most, budget / 2);
    ck_assert_uint_gt(frame(scene, &view).blocks_missing, 0);
    spv_scene_free(scene);
}
END_TEST

/* By its share of nodes it would have less than a block: that would never be loaded, however much is free. */
START_TEST(a_small_archive_beside_a_large_one_is_loaded)
{
    const char *const paths[2] = {archive(40000, "a.spc"), archive(60, "b.spc")};
    const struct spv_draw_options all = {.ambient = 0.2f, .no_occlusion = true};
    const struct spv_view view = view_from(1, 100);
    for (int first = 0; first < 2; first++) {
        struct spv_scene *scene = scene_of(1000000);
        struct spv_scene_stats stats = {.blocks_missing = 1};
        ck_assert_int_eq(spv_scene_open(scene, paths[first], NULL), SPC_OK);
        ck_assert_int_eq(spv_scene_open(scene, paths[1 - first], NULL), SPC_OK);
        for (int k = 0; k < FRAMES_MAX && stats.blocks_missing > 0; k++) {
            ck_assert_int_eq(spv_scene_frame(scene, &view, NULL, &all, picture, &stats, NULL), SPC_OK);
            while (spv_scene_wait(scene))
                ;
        }
        ck_assert_uint_eq(stats.blocks_missing, 0);
        ck_assert_uint_le(stats.bytes_resident, 1000000);
        spv_scene_free(scene);
    }
}
END_TEST

START_TEST(so_many_archives_and_no_more)
{
    const char *path = archive(300, "a.spc");
    struct spc_error err = {0};
    struct spv_scene *scene = scene_of(1 << 26);
    const struct spv_view view = view_from(1, 0.5);
    for (int i = 0; i < SPV_SCENE_ARCHIVES_MAX; i++)
        ck_assert_int_eq(spv_scene_open(scene, path, NULL), SPC_OK);
    ck_assert_int_eq(spv_scene_open(scene, path, &err), SPC_LIMIT);
    ck_assert_uint_eq(spv_scene_count(scene), SPV_SCENE_ARCHIVES_MAX);
    settle(scene, &view);
    draw_alone(path, &view);
    ck_assert_mem_eq(picture, wanted, BYTES);
    spv_scene_free(scene);
}
END_TEST

/* ---- faults ------------------------------------------------------------------------------------ */

static void flip(const char *path, uint64_t off)
{
    FILE *f = fopen(path, "r+b");
    ck_assert_ptr_nonnull(f);
    ck_assert_int_eq(fseek(f, (long)off, SEEK_SET), 0);
    const int c = fgetc(f);
    ck_assert_int_eq(fseek(f, (long)off, SEEK_SET), 0);
    fputc(c ^ 0xFF, f);
    ck_assert_int_eq(fclose(f), 0);
}

/* Of the second archive; the last block of the file holds leaves, which a fine picture needs. */
START_TEST(a_damaged_block_is_told_of_until_it_is_mended)
{
    const char *good = archive(2000, "a.spc"), *bad = archive(3000, "b.spc");
    struct spv_view view = view_from(1, 0.001);
    struct spv_scene *scene = scene_of(1 << 26);
    struct spv_scene_stats stats = {0};
    struct spc_error err = {0};
    size_t bytes;
    free(case_slurp(bad, &bytes));
    view.cull = false;
    ck_assert_int_eq(spv_scene_open(scene, good, NULL), SPC_OK);
    ck_assert_int_eq(spv_scene_open(scene, bad, NULL), SPC_OK);
    flip(bad, bytes - 64);
    for (int k = 0; k < 20; k++) {
        stats = frame(scene, &view);
        while (spv_scene_wait(scene))
            ;
    }
    stats = frame(scene, &view);
    ck_assert_uint_eq(stats.blocks_failed, 1);
    ck_assert_uint_eq(stats.blocks_missing, 1);
    ck_assert_uint_eq(spv_scene_fault(scene, &err), 1);
    ck_assert_int_eq(err.status, SPC_CHECKSUM);
    flip(bad, bytes - 64);
    settle(scene, &view);
    ck_assert_uint_eq(spv_scene_fault(scene, &err), SPV_SCENE_ARCHIVES_MAX);
    spv_scene_free(scene);
}
END_TEST

START_TEST(an_empty_scene_has_nothing_to_wait_for)
{
    struct spv_scene *scene = scene_of(1);
    struct spc_error err;
    const struct spv_view view = view_from(1, 1);
    uint32_t missing = 1;
    ck_assert(!spv_scene_wait(scene));
    ck_assert_uint_eq(spv_scene_busy(scene), 0);
    ck_assert_uint_eq(spv_scene_fault(scene, &err), SPV_SCENE_ARCHIVES_MAX);
    ck_assert_int_eq(spv_scene_load(scene, &view, &missing, NULL), SPC_OK);
    ck_assert_uint_eq(missing, 0);
    spv_scene_free(scene);
    spv_scene_free(NULL);
}
END_TEST

int main(void)
{
    return SUITE("scene", start, finish, frames_become_the_picture_that_is_drawn_at_once,
                 what_was_loaded_is_drawn_in_the_first_frame, another_back_end_draws_the_same,
                 an_archive_that_cannot_be_opened_changes_nothing, archives_share_the_budget,
                 a_small_archive_beside_a_large_one_is_loaded, so_many_archives_and_no_more,
                 a_damaged_block_is_told_of_until_it_is_mended,
                 an_empty_scene_has_nothing_to_wait_for);
}
