/*
 * What the back end without GL leaves out because something lies before it: no picture shows it, and what it says of
 * clusters that are asked about is so.
 */
#include "mesh_case.h"
#include "picture_case.h"
#include "suite.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

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

/* Several meshes as one. */
static void append(struct case_mesh *to, struct case_mesh from)
{
    const uint32_t v = to->vertex_count, f = to->face_count;
    to->xyz = realloc(to->xyz, (v + from.vertex_count) * sizeof *to->xyz);
    to->face = realloc(to->face, (f + from.face_count) * sizeof *to->face);
    memcpy(to->xyz + v, from.xyz, from.vertex_count * sizeof *to->xyz);
    for (uint32_t i = 0; i < from.face_count; i++)
        for (int c = 0; c < 3; c++)
            to->face[f + i][c] = from.face[i][c] + v;
    to->vertex_count += from.vertex_count;
    to->face_count += from.face_count;
    case_mesh_free(&from);
}

/* Surfaces behind and inside of each other, of all sizes; every seed another. */
static struct spc_reader *scene(uint64_t seed, double scale)
{
    uint64_t state = seed;
    struct case_mesh all = {0};
    const double zero[3] = {0, 0, 0};
    for (int k = 0; k < 6; k++) {
        struct case_mesh m = k % 3 == 2 ? case_soup(300, seed + (uint64_t)k)
                             : k % 3 ? case_sheet(1000, seed + (uint64_t)k) : case_sphere(1000, seed + (uint64_t)k);
        double offset[3];
        for (int a = 0; a < 3; a++)
            offset[a] = 4 * case_random(&state) - 2;
        case_transform(&m, 0.2 + 1.5 * case_random(&state), offset);
        append(&all, m);
    }
    case_transform(&all, scale, zero);
    all.wide = true;
    case_color(&all);
    struct spb_build_options o = case_options(case_write(&all, "scene.ply"), case_path("scene.spc"));
    o.cluster_nodes = 80;
    o.block_nodes = 60;
    struct spc_reader *reader = case_build(&o);
    case_mesh_free(&all);
    return reader;
}

static struct picture_view random_view(uint64_t *state, double scale)
{
    struct picture_view v = {.up = {0.1, 0.9, 0.3}, .width = 40 + (int)(200 * case_random(state)),
                             .height = 40 + (int)(200 * case_random(state))};
    const double far = case_random(state) < 0.3 ? 1.5 : 7;
    for (int a = 0; a < 3; a++) {
        v.eye[a] = scale * far * (2 * case_random(state) - 1);
        v.target[a] = scale * (2 * case_random(state) - 1);
    }
    v.fov_rad = case_random(state) < 0.2 ? 2.9 : 0.2 + case_random(state);
    v.eps_px = exp(log(0.3) + 5 * case_random(state));
    v.mode = (enum spv_mode)(3 * case_random(state));
    return v;
}

struct blocks {
    struct spv_item *items;
    uint32_t count, *clusters;      /* [count] of items */
};

static struct blocks blocks_of(const struct spc_reader *reader, const struct spv_view *view)
{
    struct spv_selection s = {0};
    ck_assert_int_eq(spv_select(reader, view, &s, NULL), SPC_OK);
    struct blocks b = {calloc(s.block_count + 1, sizeof *b.items), s.block_count,
                       calloc(s.block_count + 1, sizeof *b.clusters)};
    for (uint32_t i = 0; i < s.block_count; i++) {
        struct spc_block block;
        b.items[i] = (struct spv_item){s.blocks[i].block, NULL, -1};
        spc_reader_block(reader, s.blocks[i].block, &block);
        b.clusters[i] = block.cluster;
    }
    spv_selection_release(&s);
    return b;
}

static void blocks_free(struct blocks *b)
{
    free(b->items);
    free(b->clusters);
}

static uint8_t *frame(const struct spv_view *view, struct spv_part *parts, uint32_t count,
                      const struct spv_draw_options *options, struct spv_drawn *drawn)
{
    struct spc_error err = {0};
    uint8_t *rgba = malloc((size_t)4 * (size_t)view->camera.width * (size_t)view->camera.height);
    if (spv_draw_frame(picture_soft(), view, NULL, parts, count, options, rgba, drawn, &err) != SPC_OK)
        ck_abort_msg("cannot draw: %s", err.what);
    return rgba;
}

static void expect_same(const struct spv_view *view, const uint8_t *a, const uint8_t *b, uint64_t seed, int i)
{
    const size_t n = (size_t)view->camera.width * (size_t)view->camera.height;
    for (size_t k = 0; k < n; k++)
        if (memcmp(a + 4 * k, b + 4 * k, 4) != 0)
            ck_abort_msg("seed %llu, view %d, mode %d: pixel %zu, %zu of %d x %d differs", (unsigned long long)seed, i,
                         (int)view->mode, k % (size_t)view->camera.width, k / (size_t)view->camera.width,
                         view->camera.width, view->camera.height);
}

static struct spv_draw_options random_options(uint64_t *state)
{
    return (struct spv_draw_options){.splat = case_random(state) < 0.3 ? SPV_SPLAT_FAST : SPV_SPLAT_EXACT,
                                     .ambient = 0.2f, .tile = case_random(state) < 0.3 ? 61 : 0};
}

/* One or two archives, of different units; some clusters as their tops. */
START_TEST(what_is_left_out_no_pixel_shows)
{
    uint64_t hidden = 0, processed[2] = {0};
    for (uint64_t seed = 1; seed <= 6; seed++) {
        uint64_t state = seed;
        struct spc_reader *readers[2] = {scene(seed, 1), scene(seed + 100, 0.125)};
        for (int i = 0; i < 40; i++) {
            const struct picture_view v = random_view(&state, 1);
            const struct spv_view view = picture_view(&v);
            struct spv_draw_options options = random_options(&state);
            const uint32_t count = i % 2 ? 2 : 1;
            struct blocks b[2];
            struct spv_part parts[2];
            struct spv_drawn drawn[2];
            uint8_t *rgba[2];
            for (uint32_t p = 0; p < count; p++) {
                b[p] = blocks_of(readers[p], &view);
                parts[p] = (struct spv_part){.reader = readers[p], .items = b[p].items, .item_count = b[p].count};
                if (i % 5 == 0 && b[p].count > 1) {     /* the last item's cluster by its tops, too */
                    parts[p].tops = &b[p].clusters[b[p].count - 1];
                    parts[p].top_count = 1;
                }
            }
            for (int k = 0; k < 2; k++) {
                options.no_occlusion = k;
                rgba[k] = frame(&view, parts, count, &options, &drawn[k]);
                processed[k] += drawn[k].nodes_processed;
            }
            expect_same(&view, rgba[0], rgba[1], seed, i);
            ck_assert_uint_eq(drawn[1].clusters_hidden, 0);
            ck_assert(drawn[0].nodes_processed <= drawn[1].nodes_processed);
            hidden += drawn[0].clusters_hidden;
            free(rgba[0]);
            free(rgba[1]);
            for (uint32_t p = 0; p < count; p++)
                blocks_free(&b[p]);
        }
        spc_reader_close(readers[0]);
        spc_reader_close(readers[1]);
    }
    ck_assert_msg(hidden > 1000 && processed[0] < processed[1] * 95 / 100, "%llu clusters, %llu of %llu nodes",
                  (unsigned long long)hidden, (unsigned long long)processed[0], (unsigned long long)processed[1]);
}
END_TEST

/* Some clusters are drawn and all are asked about: those that are said to be hidden change nothing. */
START_TEST(clusters_said_to_be_hidden_change_nothing)
{
    uint64_t hidden = 0, asked = 0;
    for (uint64_t seed = 11; seed <= 16; seed++) {
        uint64_t state = seed;
        struct spc_reader *reader = scene(seed, 1);
        for (int i = 0; i < 30; i++) {
            const struct picture_view v = random_view(&state, 1);
            const struct spv_view view = picture_view(&v);
            struct spv_draw_options options = random_options(&state);
            struct blocks b = blocks_of(reader, &view);
            uint8_t *flags = malloc(b.count + 1);
            struct spv_part part = {.reader = reader, .items = b.items, .item_count = b.count * 2 / 3,
                                    .probes = b.clusters, .probe_count = b.count, .hidden = flags};
            memset(flags, 9, b.count + 1);
            uint8_t *first = frame(&view, &part, 1, &options, NULL);
            for (uint32_t k = part.item_count; k < b.count; k++)
                if (flags[k])
                    b.items[part.item_count++] = b.items[k];
            for (uint32_t k = 0; k < b.count; k++) {
                ck_assert_uint_le(flags[k], 1);
                hidden += flags[k];
                asked++;
            }
            part.probe_count = 0;
            options.no_occlusion = true;
            uint8_t *again = frame(&view, &part, 1, &options, NULL);
            expect_same(&view, first, again, seed, i);
            free(first);
            free(again);
            free(flags);
            blocks_free(&b);
        }
        spc_reader_close(reader);
    }
    ck_assert_msg(hidden > asked / 100 && hidden < asked / 2, "%llu of %llu are hidden", (unsigned long long)hidden,
                  (unsigned long long)asked);
}
END_TEST

/* A flat sheet, z up to top, from x and y -half to half, turned about x and y. */
static struct spc_reader *flat(double half, double top, double about_x, double about_y)
{
    struct case_mesh m = case_sheet(1500, 41);
    double most = -HUGE_VAL;
    for (uint32_t i = 0; i < m.vertex_count; i++) {
        double *p = m.xyz[i];
        const double x = half * (2 * p[0] - 1), y = half * (2 * p[1] - 1), z = y * sin(about_x);
        p[0] = x * cos(about_y) + z * sin(about_y);
        p[1] = y * cos(about_x);
        p[2] = z * cos(about_y) - x * sin(about_y);
        most = fmax(most, p[2]);
    }
    for (uint32_t i = 0; i < m.vertex_count; i++)
        m.xyz[i][2] += top - most;
    m.wide = true;
    struct spb_build_options o = case_options(case_write(&m, "flat.ply"), case_path("flat.spc"));
    o.cluster_nodes = 80;
    o.block_nodes = 60;
    struct spc_reader *reader = case_build(&o);
    case_mesh_free(&m);
    return reader;
}

/* A wall, and a sheet that leans through it: of many clusters a little is before the wall, most of it behind. */
START_TEST(what_sticks_out_of_a_wall_is_seen)
{
    struct spc_reader *wall = flat(8, 0, 0, 0);
    uint32_t hidden = 0, asked = 0;
    for (int i = 0; i < 24; i++) {
        struct spc_reader *leaning = flat(1, 0.05 * (1 + i % 8), 0.3 + 0.05 * i, i % 3 * 0.2);
        const struct picture_view v = {.eye = {0.1, 0.2, 5}, .target = {0, 0, 0}, .up = {0, 1, 0}, .fov_rad = 1,
                                       .width = 160, .height = 120, .eps_px = i % 2 ? 1 : 6,
                                       .mode = (enum spv_mode)(i % 3)};
        const struct spv_view view = picture_view(&v);
        struct spv_draw_options options = {.ambient = 0.2f, .splat = i % 5 ? SPV_SPLAT_EXACT : SPV_SPLAT_FAST};
        struct blocks b[2] = {blocks_of(wall, &view), blocks_of(leaning, &view)};
        uint8_t *flags = malloc(b[1].count);
        struct spv_part parts[2] = {{.reader = wall, .items = b[0].items, .item_count = b[0].count},
                                    {.reader = leaning, .items = b[1].items, .probes = b[1].clusters,
                                     .probe_count = b[1].count, .hidden = flags}};
        uint8_t *first = frame(&view, parts, 2, &options, NULL);
        options.no_occlusion = true;
        parts[1].probe_count = 0;
        for (uint32_t k = 0; k < b[1].count; k++, asked++)
            if (flags[k])
                b[1].items[parts[1].item_count++] = b[1].items[k];
        hidden += parts[1].item_count;
        uint8_t *again = frame(&view, parts, 2, &options, NULL);
        expect_same(&view, first, again, 41, i);
        free(first);
        free(again);
        free(flags);
        blocks_free(&b[0]);
        blocks_free(&b[1]);
        spc_reader_close(leaning);
    }
    ck_assert_msg(hidden > asked / 3, "%u of %u are hidden", hidden, asked);
    spc_reader_close(wall);
}
END_TEST

/* A picture of nothing but tops, as the first one is. */
START_TEST(tops_alone_are_a_picture)
{
    struct spc_reader *reader = flat(4, 0.3, 0.2, 0);
    const uint32_t clusters = spc_reader_header(reader)->cluster_count;
    const struct picture_view v = {.eye = {0.1, 0.2, 5}, .target = {0, 0, 0}, .up = {0, 1, 0}, .fov_rad = 1,
                                   .width = 160, .height = 120, .eps_px = 1, .mode = SPV_HYBRID};
    const struct spv_view view = picture_view(&v);
    struct spv_draw_options options = {.ambient = 0.2f};
    uint32_t *tops = malloc(clusters * sizeof *tops);
    for (uint32_t k = 0; k < clusters; k++)
        tops[k] = k;
    struct spv_part part = {.reader = reader, .tops = tops, .top_count = clusters};
    uint8_t *first = frame(&view, &part, 1, &options, NULL);
    options.no_occlusion = true;
    uint8_t *again = frame(&view, &part, 1, &options, NULL);
    expect_same(&view, first, again, 42, 0);
    size_t covered = 0;
    for (size_t i = 3; i < (size_t)4 * 160 * 120; i += 4)
        covered += first[i] != 0;
    ck_assert_uint_gt(covered, 1000);
    free(first);
    free(again);
    free(tops);
    spc_reader_close(reader);
}
END_TEST

/* What is not in the picture is not hidden by it, nor is anything by an empty one. */
START_TEST(what_is_outside_is_not_hidden)
{
    struct spc_reader *reader = scene(21, 1);
    const uint32_t n = spc_reader_header(reader)->cluster_count;
    uint32_t *all = calloc(n, sizeof *all);
    uint8_t *flags = calloc(n, 1);
    for (uint32_t i = 0; i < n; i++)
        all[i] = i;
    for (int k = 0; k < 4; k++) {
        const struct picture_view v = {.eye = {9, 1, 0}, .target = {k % 2 ? 20 : 0, 1, 0}, .up = {0, 1, 0},
                                       .fov_rad = 1, .width = 100, .height = 100, .eps_px = 1, .mode = SPV_HYBRID};
        const struct spv_view view = picture_view(&v);
        const struct spv_draw_options options = {.tile = k >= 2 ? 40 : 0};
        struct blocks b = blocks_of(reader, &view);
        struct spv_part part = {.reader = reader, .items = b.items, .item_count = k % 2 ? b.count : 0, .probes = all,
                                .probe_count = n, .hidden = flags};
        uint8_t *rgba = frame(&view, &part, 1, &options, NULL);
        for (uint32_t i = 0; i < n; i++)
            ck_assert_msg(flags[i] == 0, "cluster %u of case %d is hidden", i, k);
        free(rgba);
        blocks_free(&b);
    }
    free(all);
    free(flags);
    spc_reader_close(reader);
}
END_TEST

/* Batches end where nodes say, whatever the number of threads. */
START_TEST(any_threads_hide_the_same)
{
    struct spc_reader *reader = scene(31, 1);
    uint64_t state = 31;
    for (int i = 0; i < 8; i++) {
        const struct picture_view v = random_view(&state, 1);
        const struct spv_view view = picture_view(&v);
        const struct spv_draw_options options = random_options(&state);
        struct blocks b = blocks_of(reader, &view);
        struct spv_part part = {.reader = reader, .items = b.items, .item_count = b.count};
        struct spv_drawn drawn[3];
        for (int k = 0; k < 3; k++) {
            picture_use(PICTURE_BY_SOFT, k == 0 ? 1 : 3 * (unsigned)k);
            free(frame(&view, &part, 1, &options, &drawn[k]));
            ck_assert_uint_eq(drawn[k].clusters_hidden, drawn[0].clusters_hidden);
            ck_assert_uint_eq(drawn[k].nodes_processed, drawn[0].nodes_processed);
            ck_assert_uint_eq(drawn[k].nodes, drawn[0].nodes);
        }
        blocks_free(&b);
    }
    spc_reader_close(reader);
}
END_TEST

int main(void)
{
    return SUITE("soft hidden", start, finish, what_is_left_out_no_pixel_shows,
                 clusters_said_to_be_hidden_change_nothing, what_sticks_out_of_a_wall_is_seen,
                 what_is_outside_is_not_hidden, tops_alone_are_a_picture, any_threads_hide_the_same);
}
