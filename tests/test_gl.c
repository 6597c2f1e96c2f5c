/*
 * What the OpenGL back end adds to drawing: blocks on the card, what stands in for missing ones, frozen
 * tests, several archives, leaving out what is hidden, colours that say something, and the window.
 */
#include "bytes.h"
#include "kept.h"
#include "ctx.h"
#include "draw_gl_int.h"
#include "mesh_case.h"
#include "paint.h"
#include "picture_case.h"
#include "suite.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const struct spv_draw_options EXACT = {.splat = SPV_SPLAT_EXACT, .ambient = 0.2f};
static const struct spv_draw_options FAST = {.splat = SPV_SPLAT_FAST, .ambient = 0.2f};
enum { SIDE = 200, PX = SIDE * SIDE, PARTS = 3 };

static struct spv_ctx *ctx;
static struct spv_draw *draw;
static struct spv_store store;

static void start(void)
{
    struct spc_error err = {0};
    case_start();
    if (spv_ctx_osmesa(&ctx, &err) != SPC_OK || spv_gl_create(ctx, &draw, &err) != SPC_OK)
        ck_abort_msg("no renderer: %s", err.what);
    spv_draw_store(draw, &store);
}

static void finish(void)
{
    spv_draw_free(draw);
    spv_ctx_free(ctx);
    case_finish();
}

struct scene {
    struct spv_part parts[PARTS];
    struct spv_item *items[PARTS];
    uint32_t *tops[PARTS];
    uint32_t count;
};

static struct picture_view seen_from(double x, double y, double z, double eps_px, enum spv_mode mode)
{
    return (struct picture_view){.eye = {x, y, z}, .up = {0.1, 0.9, 0.3}, .fov_rad = 0.8, .width = SIDE,
                                 .height = SIDE, .eps_px = eps_px, .mode = mode};
}

/* Adds what is selected of an archive. */
static void scene_add(struct scene *s, const struct spc_reader *r, const struct spv_view *view)
{
    struct spv_selection selection = {0};
    const uint32_t p = s->count++;
    ck_assert_int_eq(spv_select(r, view, &selection, NULL), SPC_OK);
    s->items[p] = malloc((selection.block_count + 1) * sizeof **s->items);
    s->tops[p] = malloc(spc_reader_header(r)->cluster_count * sizeof **s->tops);
    for (uint32_t i = 0; i < selection.block_count; i++)
        s->items[p][i] = (struct spv_item){selection.blocks[i].block, NULL, -1};
    s->parts[p] = (struct spv_part){.reader = r, .items = s->items[p], .item_count = selection.block_count};
    spv_selection_release(&selection);
}

static void scene_release(struct scene *s)
{
    for (uint32_t p = 0; p < s->count; p++) {
        for (uint32_t i = 0; i < s->parts[p].item_count; i++)
            store.drop(draw, s->items[p][i].kept);
        free(s->items[p]);
        free(s->tops[p]);
    }
    *s = (struct scene){0};
}

static void scene_keep(struct scene *s)
{
    for (uint32_t p = 0; p < s->count; p++)
        for (uint32_t i = 0; i < s->parts[p].item_count; i++) {
            struct spv_item *item = &s->items[p][i];
            struct spc_block b;
            spc_reader_block(s->parts[p].reader, item->block, &b);
            uint8_t *payload = malloc(b.raw_bytes);
            ck_assert_int_eq(spc_block_decode(s->parts[p].reader, item->block, true, payload, NULL), SPC_OK);
            ck_assert_int_eq(spv_kept_sort(s->parts[p].reader, item->block, payload, NULL), SPC_OK);
            item->kept = store.keep(draw, s->parts[p].reader, item->block, payload);
            ck_assert_ptr_nonnull(item->kept);
        }
}

static struct spv_drawn scene_draw(struct scene *s, const struct spv_view *view, const struct spv_view *tested,
                                   const struct spv_draw_options *o, uint8_t *rgba)
{
    struct spc_error err = {0};
    struct spv_drawn drawn;
    if (spv_draw_frame(draw, view, tested, s->parts, s->count, o, rgba, &drawn, &err) != SPC_OK)
        ck_abort_msg("cannot draw: %s", err.what);
    return drawn;
}

static void expect_same(const uint8_t *a, const uint8_t *b, const char *what, int number)
{
    for (size_t i = 0; i < (size_t)PX * 4; i++)
        if (a[i] != b[i])
            ck_abort_msg("%s %d: pixel %zu, %zu is %d, not %d", what, number, i / 4 % SIDE, i / 4 / SIDE, a[i], b[i]);
}

static size_t covered(const uint8_t *rgba)
{
    size_t n = 0;
    for (size_t i = 0; i < (size_t)PX; i++)
        n += rgba[4 * i + 3] != 0;
    return n;
}

/* ---- blocks on the card ------------------------------------------------------------------------ */

static unsigned uploads;
static PFNGLBUFFERDATAPROC upload;

static void APIENTRY count_upload(GLenum target, GLsizeiptr size, const void *data, GLenum usage)
{
    uploads++;
    upload(target, size, data, usage);
}

START_TEST(kept_blocks_are_the_picture_of_decoded_ones_and_upload_nothing)
{
    static const double offset[3] = {5e6, 0, 0}, none[3] = {0, 0, 0};
    for (int k = 0; k < 3; k++) {
        struct case_mesh m = k == 0 ? case_sphere(3000, 1) : k == 1 ? case_sphere(2000, 2) : case_soup(800, 3);
        m.wide = k == 1;
        if (k < 2)
            case_color(&m);
        case_transform(&m, 1, k == 1 ? offset : none);
        struct spc_reader *r = case_archive(&m);
        for (int i = 0; i < 4; i++) {
            struct picture_view v = seen_from(i < 2 ? 2 : 1.1, 1, i, i < 2 ? 3 : 0.5, i % 2 ? SPV_POINTS : SPV_HYBRID);
            v.eye[0] += k == 1 ? offset[0] : 0;
            v.target[0] = k == 1 ? offset[0] : 0.1;
            const struct spv_view view = picture_view(&v);
            uint8_t *streamed = malloc((size_t)PX * 4), *kept = malloc((size_t)PX * 4);
            struct scene s = {0};
            scene_add(&s, r, &view);
            const struct spv_drawn first = scene_draw(&s, &view, NULL, &EXACT, streamed);
            scene_keep(&s);
            struct spv_gl_api *api = &spv_gl_of(draw)->api;
            upload = api->BufferData;
            api->BufferData = count_upload;
            uploads = 0;
            const struct spv_drawn second = scene_draw(&s, &view, NULL, &EXACT, kept);
            api->BufferData = upload;
            ck_assert_uint_eq(uploads, 0);
            ck_assert_uint_gt(covered(kept), 500);
            ck_assert_uint_gt(first.nodes_processed, 0);
            ck_assert_uint_gt(second.nodes_processed, 0);
            expect_same(kept, streamed, "kept", i);
            scene_release(&s);
            free(streamed);
            free(kept);
        }
        spc_reader_close(r);
        case_mesh_free(&m);
    }
}
END_TEST

/* ---- what is missing --------------------------------------------------------------------------- */

/* Takes the end of each cluster's blocks away, and lets what is left stand in for it, or the tops. */
static void scene_lose(struct scene *s, uint64_t *state)
{
    struct spv_part *p = &s->parts[0];
    struct spv_item *left = malloc(spc_reader_header(p->reader)->block_count * sizeof *left);
    uint32_t n = 0;
    for (uint32_t first = 0, end; first < p->item_count; first = end) {
        struct spc_block b;
        struct spc_cluster c;
        spc_reader_block(p->reader, s->items[0][first].block, &b);
        spc_reader_cluster(p->reader, b.cluster, &c);
        for (end = first; end < p->item_count && s->items[0][end].block - c.block_first < c.block_count; end++)
            ;
        const uint32_t here = c.block_first + (uint32_t)(case_random(state) * (c.block_count + 1));
        if (s->items[0][end - 1].block < here) {
            memcpy(left + n, s->items[0] + first, (end - first) * sizeof *left);
            n += end - first;
            continue;
        }
        spc_reader_block(p->reader, here, &b);
        if (b.e_parent_max >= c.e_parent_max)       /* some top may be in it */
            s->tops[0][p->top_count++] = b.cluster;
        for (uint32_t k = c.block_first; k < here; k++)
            left[n++] = (struct spv_item){k, NULL, b.e_parent_max};
    }
    free(s->items[0]);
    p->items = s->items[0] = left;
    p->item_count = n;
    p->tops = s->tops[0];
}

static void expect_no_hole(const struct spc_reader *r, const struct picture_view *v, const uint8_t *rgba,
                           const char *what, int number)
{
    const struct spv_view view = picture_view(v);
    struct ref_image ref = picture_reference(r, &view, v->fov_rad, v->eye, v->target, v->up);
    struct ref_compare c;
    uint8_t *cover = malloc((size_t)PX);
    for (size_t i = 0; i < (size_t)PX; i++)
        cover[i] = rgba[4 * i + 3];
    ref_compare_cover(&ref, cover, &c);
    ck_assert_msg(c.holes == 0, "%s %d: %d holes, the first at %d, %d", what, number, (int)c.holes, c.hole_x, c.hole_y);
    free(cover);
    ref_image_release(&ref);
}

START_TEST(whatever_is_missing_there_is_no_hole)
{
    struct case_mesh m = case_sphere(4000, 5);
    case_color(&m);
    struct spc_reader *r = case_archive(&m);
    uint64_t state = 9, tops = 0;
    uint8_t *rgba = malloc((size_t)PX * 4);
    for (int i = 0; i < 16; i++) {
        const enum spv_mode mode = i % 2 ? SPV_POINTS : SPV_HYBRID;
        const struct picture_view v = seen_from(i % 4 ? 2.6 : 1.3, i - 8, 1, i % 3 ? 1 : 4, mode);
        const struct spv_view view = picture_view(&v);
        struct scene s = {0};
        scene_add(&s, r, &view);
        scene_lose(&s, &state);
        tops += s.parts[0].top_count;
        if (i % 2)
            scene_keep(&s);
        scene_draw(&s, &view, NULL, i % 5 ? &EXACT : &FAST, rgba);
        expect_no_hole(r, &v, rgba, "missing", i);
        scene_release(&s);
    }
    ck_assert_uint_gt(tops, 20);
    free(rgba);
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

/* ---- frozen ------------------------------------------------------------------------------------ */

START_TEST(frozen_tests_draw_the_same_nodes_from_anywhere)
{
    struct case_mesh m = case_sphere(6000, 7);
    m.rgba = calloc(m.vertex_count, sizeof *m.rgba);
    for (uint32_t i = 0; i < m.vertex_count; i++)
        memcpy(m.rgba[i], m.xyz[i][0] > 0 ? (uint8_t[4]){250, 0, 0, 255} : (uint8_t[4]){0, 0, 250, 255}, 4);
    struct spc_reader *r = case_archive(&m);
    uint8_t *rgba = malloc((size_t)PX * 4), *other = malloc((size_t)PX * 4);
    for (int i = 0; i < 6; i++) {
        const struct picture_view v = seen_from(-2.5, 0.2, i, 1, i % 2 ? SPV_POINTS : SPV_HYBRID);
        const struct picture_view w = seen_from(i < 3 ? 8 : 40, 0.3, i, 3, v.mode);
        struct spv_view view = picture_view(&v), tested = picture_view(&w);
        struct scene s = {0};
        tested.cull = false;
        scene_add(&s, r, &tested);
        scene_draw(&s, &view, &tested, &EXACT, rgba);
        expect_no_hole(r, &v, rgba, "frozen", i);
        ck_assert_uint_gt(covered(rgba), 2000);
        view.eps = 3 * tested.eps;      /* not that of the picture */
        scene_draw(&s, &view, &tested, &EXACT, other);
        expect_same(rgba, other, "frozen", i);
        scene_release(&s);
    }
    /* What is far from the tests' eye is no triangle, however near it is now. */
    const struct spv_draw_options kinds = {.paint = SPV_PAINT_KINDS, .ambient = 1};
    const uint32_t point = spv_paint_color(SPV_PAINT_KINDS, 0, 0, 0, false);
    const struct picture_view n = seen_from(-1.5, 0.1, 0, 1, SPV_HYBRID), a = seen_from(60, 0.1, 0, 1, SPV_HYBRID);
    const struct spv_view here = picture_view(&n), afar = picture_view(&a);
    struct scene all = {0};
    scene_add(&all, r, &here);
    scene_draw(&all, &here, &afar, &kinds, rgba);
    for (size_t i = 0; i < (size_t)PX; i++)
        ck_assert(rgba[4 * i + 3] == 0 || memcmp(rgba + 4 * i, &point, 3) == 0);
    scene_release(&all);
    /* Of what the tests' eye does not see nothing is drawn: from behind one looks into the front. */
    struct spb_build_options o = case_options(case_write(&m, "many.ply"), case_path("many.spc"));
    o.cluster_nodes = o.block_nodes = 32768;        /* blocks of so many leaves keep their normal clusters */
    struct spc_reader *many = case_build(&o);
    const struct picture_view v = seen_from(-3, 0.1, 0, 0.02, SPV_HYBRID), w = seen_from(3, 0.1, 0, 0.02, SPV_HYBRID);
    const struct spv_view view = picture_view(&v), tested = picture_view(&w);
    struct scene s = {0};
    scene_add(&s, many, &tested);
    scene_draw(&s, &view, &tested, &EXACT, rgba);
    const uint8_t *middle = rgba + 4 * ((size_t)SIDE * (SIDE / 2) + SIDE / 2);
    ck_assert_msg(middle[0] > 40 && middle[2] < 20, "the middle is %d, %d, %d", middle[0], middle[1], middle[2]);
    scene_release(&s);
    spc_reader_close(many);
    free(rgba);
    free(other);
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

/* ---- several archives -------------------------------------------------------------------------- */

struct balls {                      /* red, green, blue; sizes of very different units */
    struct case_mesh m[PARTS];
    struct spc_reader *r[PARTS];
};

static struct balls make_balls(void)
{
    static const struct { double radius, at[3]; } where[PARTS] = {
        {1e-8, {0.3, 0, 0}}, {1, {1.4, 0.8, 0.1}}, {3e4, {4e4, 5e3, 0}}};
    struct balls b;
    for (int k = 0; k < PARTS; k++) {
        b.m[k] = case_sphere(1500, (uint64_t)k + 1);
        case_transform(&b.m[k], where[k].radius, where[k].at);
        b.m[k].wide = true;
        b.m[k].rgba = calloc(b.m[k].vertex_count, sizeof *b.m[k].rgba);
        for (uint32_t i = 0; i < b.m[k].vertex_count; i++) {
            b.m[k].rgba[i][k] = 250;
            b.m[k].rgba[i][3] = 255;
        }
        b.r[k] = case_archive(&b.m[k]);
    }
    return b;
}

static void balls_release(struct balls *b)
{
    for (int k = 0; k < PARTS; k++) {
        spc_reader_close(b->r[k]);
        case_mesh_free(&b->m[k]);
    }
}

/* The reference picture of all triangles, and which archive each is of. */
static struct ref_image reference_of_balls(const struct balls *b, const struct picture_view *v, size_t first[PARTS + 1])
{
    struct ref_triangle *all = NULL;
    struct ref_image image;
    size_t n = 0;
    for (int k = 0; k < PARTS; k++) {
        size_t count;
        double (*corners)[3][3] = case_triangles(b->r[k], &count);
        all = realloc(all, (n + count) * sizeof *all);
        memset(all + n, 0, count * sizeof *all);
        first[k] = n;
        for (size_t i = 0; i < count; i++)
            memcpy(all[n++].corner, corners[i], sizeof all->corner);
        free(corners);
    }
    first[PARTS] = n;
    struct ref_camera camera = {.fov_y_deg = v->fov_rad * 180 / 3.14159265358979323846, .width = SIDE, .height = SIDE};
    memcpy(camera.eye, v->eye, sizeof camera.eye);
    memcpy(camera.target, v->target, sizeof camera.target);
    memcpy(camera.up, v->up, sizeof camera.up);
    ck_assert_int_eq(ref_raster(all, n, &camera, 0.2, &image), 0);
    free(all);
    return image;
}

static int part_of(const struct ref_image *ref, const size_t first[PARTS + 1], size_t px)
{
    int k = 0;
    if (ref->triangle[px] == UINT32_MAX)
        return -1;
    while (ref->triangle[px] >= first[k + 1])
        k++;
    return k;
}

START_TEST(archives_of_any_scale_hide_each_other)
{
    struct balls b = make_balls();
    uint8_t *rgba = malloc((size_t)PX * 4);
    uint64_t seen[PARTS] = {0};
    for (int i = 0; i < 6; i++) {
        const double eye_x = i == 1 ? 0.3 - 2.5e-8 : i < 3 ? 0.3 - 5e-8 : i == 5 ? 1e5 : 3;
        struct picture_view v = seen_from(eye_x, i == 2 ? 1e-8 : 0,
                                          i > 2 ? 0.2 * i - 0.7 : 0, 0.5, SPV_HYBRID);
        memcpy(v.target, i < 3 || i == 5 ? (double[3]){0.3, 0, 0} : (double[3]){1.4, 0.8, 0.1}, sizeof v.target);
        const struct spv_view view = picture_view(&v);
        struct scene s = {0};
        size_t first[PARTS + 1], wrong = 0;
        for (int k = 0; k < PARTS; k++)
            scene_add(&s, b.r[(k + i) % PARTS], &view);
        scene_draw(&s, &view, NULL, &EXACT, rgba);
        struct ref_image ref = reference_of_balls(&b, &v, first);
        for (size_t y = 1; y + 1 < SIDE; y++)
            for (size_t x = 1; x + 1 < SIDE; x++) {
                const int part = part_of(&ref, first, y * SIDE + x);
                bool inner = true;
                for (size_t n = 0; n < 9; n++)
                    inner &= part_of(&ref, first, (y + n / 3 - 1) * SIDE + x + n % 3 - 1) == part;
                const uint8_t *px = rgba + 4 * (y * SIDE + x);
                wrong += inner && part >= 0 && (px[part] == 0 || px[(part + 1) % 3] != 0 || px[(part + 2) % 3] != 0);
                seen[part >= 0 ? part : 0] += inner && part >= 0;
            }
        ck_assert_msg(wrong == 0, "view %d: %zu pixels show another archive", i, wrong);
        ref_image_release(&ref);
        scene_release(&s);
    }
    for (int k = 0; k < PARTS; k++)
        ck_assert_msg(seen[k] > 2000, "archive %d is seen in %llu pixels", k, (unsigned long long)seen[k]);
    free(rgba);
    balls_release(&b);
}
END_TEST

START_TEST(nothing_is_an_empty_picture)
{
    const struct picture_view v = seen_from(1, 1, 1, 1, SPV_HYBRID);
    const struct spv_view view = picture_view(&v);
    uint8_t *rgba = malloc((size_t)PX * 4);
    struct scene s = {0};
    memset(rgba, 7, (size_t)PX * 4);
    scene_draw(&s, &view, NULL, &EXACT, rgba);
    for (size_t i = 0; i < (size_t)PX * 4; i++)
        ck_assert_uint_eq(rgba[i], 0);
    free(rgba);
}
END_TEST

/* ---- what is hidden ---------------------------------------------------------------------------- */

/* Layers one behind the other, coloured: whoever is left out wrongly is missed. */
static struct case_mesh layers(void)
{
    struct case_mesh all = {0};
    for (int k = 0; k < 5; k++) {
        struct case_mesh m = case_sheet(2500, (uint64_t)k);
        case_color(&m);
        const double offset[3] = {0.07 * k, 0.02 * k, 0.5 * k};
        case_transform(&m, 1, offset);
        all.xyz = realloc(all.xyz, (all.vertex_count + m.vertex_count) * sizeof *all.xyz);
        all.rgba = realloc(all.rgba, (all.vertex_count + m.vertex_count) * sizeof *all.rgba);
        all.face = realloc(all.face, (all.face_count + m.face_count) * sizeof *all.face);
        memcpy(all.xyz + all.vertex_count, m.xyz, m.vertex_count * sizeof *all.xyz);
        memcpy(all.rgba + all.vertex_count, m.rgba, m.vertex_count * sizeof *all.rgba);
        for (uint32_t f = 0; f < m.face_count; f++)
            for (int c = 0; c < 3; c++)
                all.face[all.face_count + f][c] = m.face[f][c] + all.vertex_count;
        all.vertex_count += m.vertex_count;
        all.face_count += m.face_count;
        case_mesh_free(&m);
    }
    return all;
}

static struct picture_view layers_from(int i)
{
    struct picture_view v = seen_from(0.5 + 0.2 * (i % 3), 0.5, i < 6 ? -1.0 - 0.3 * i : 4 - 0.4 * i,
                                      i % 3 ? 1 : 5, i % 2 ? SPV_POINTS : SPV_HYBRID);
    memcpy(v.target, i == 5 ? (double[3]){3, 0.5, 1} : (double[3]){0.55, 0.5, 0.3}, sizeof v.target);
    return v;
}

START_TEST(leaving_out_what_is_hidden_changes_no_byte)
{
    struct case_mesh m = layers();
    struct spc_reader *r = case_archive(&m);
    uint8_t *all = malloc((size_t)PX * 4), *some = malloc((size_t)PX * 4);
    uint64_t hidden = 0, less = 0;
    for (int i = 0; i < 10; i++) {
        const struct picture_view v = layers_from(i);
        const struct spv_view view = picture_view(&v);
        struct spv_draw_options o = i % 4 == 3 ? FAST : EXACT;
        struct scene s = {0};
        o.tile = i == 4 || i == 7 ? 90 : 0;
        scene_add(&s, r, &view);
        scene_keep(&s);
        spv_gl_occlude(draw, true);
        const struct spv_drawn with = scene_draw(&s, &view, NULL, &o, some);
        o.no_occlusion = true;
        const struct spv_drawn without = scene_draw(&s, &view, NULL, &o, all);
        expect_same(some, all, "occlusion", i);
        ck_assert_uint_eq(without.clusters_hidden, 0);
        hidden += with.clusters_hidden;
        less += with.nodes_processed < without.nodes_processed;
        scene_release(&s);
    }
    ck_assert_uint_gt(hidden, 50);
    ck_assert_uint_gt(less, 4);
    free(all);
    free(some);
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

/* Nothing of a cluster is drawn outside of its rectangle, nor as near. Returns whether it has one. */
static bool expect_within(struct scene *one, uint32_t cluster, const struct spv_view *view,
                          const struct spv_draw_options *o, uint8_t *rgba, float *depth)
{
    const struct frame_input in = {view, view, one->parts, 1, o};
    const struct gl_frame f = {.gl = spv_gl_of(draw), .in = &in, .width = SIDE, .height = SIDE,
                               .center = {GUARD + SIDE / 2.0, GUARD + SIDE / 2.0}};
    struct gl_rect rect;
    scene_draw(one, view, NULL, o, rgba);
    if (!spv_gl_rect(&f, 0, cluster, &rect))
        return false;
    const struct spv_gl_api *api = &f.gl->api;
    api->BindFramebuffer(GL_FRAMEBUFFER, f.gl->frame);
    api->ReadPixels(GUARD, GUARD, SIDE, SIDE, GL_DEPTH_COMPONENT, GL_FLOAT, depth);
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            const double px = x + 0.5 + GUARD, py = y + 0.5 + GUARD;
            const float d = depth[SIDE * y + x];
            if (d > 0 && (px < (double)rect.px[0] || px > (double)rect.px[2] || py < (double)rect.px[1] ||
                          py > (double)rect.px[3] || d >= rect.depth || !rect.inside))
                ck_abort_msg("cluster %u: pixel %d, %d of depth %g lies outside of %g, %g, %g, %g, %g", cluster, x, y,
                             (double)d, (double)rect.px[0], (double)rect.px[1], (double)rect.px[2],
                             (double)rect.px[3], (double)rect.depth);
        }
    return true;
}

START_TEST(nothing_is_drawn_outside_of_its_rectangle)
{
    struct case_mesh meshes[] = {case_sphere(3000, 2), case_soup(600, 4)};
    uint8_t *rgba = malloc((size_t)PX * 4);
    float *depth = malloc((size_t)PX * sizeof *depth);
    for (int k = 0; k < 2; k++) {
        struct spc_reader *r = case_archive(&meshes[k]);
        uint32_t with = 0;
        for (int i = 0; i < 20; i++) {
            struct picture_view v = seen_from(i % 2 ? 3 : 1.4, i % 5 - 2, i % 7 - 3, i % 3 ? 3 : 20,
                                              i % 2 ? SPV_POINTS : SPV_HYBRID);
            v.fov_rad = i % 4 == 0 ? 2.2 : i % 4 == 1 ? 0.1 : 0.8;
            const struct spv_view view = picture_view(&v);
            struct scene s = {0};
            scene_add(&s, r, &view);
            struct scene one = s;
            for (uint32_t first = 0, end; first < s.parts[0].item_count; first = end) {
                struct spc_block b, next;
                spc_reader_block(r, s.items[0][first].block, &b);
                for (end = first + 1; end < s.parts[0].item_count; end++) {
                    spc_reader_block(r, s.items[0][end].block, &next);
                    if (next.cluster != b.cluster)
                        break;
                }
                one.parts[0].items = s.items[0] + first;
                one.parts[0].item_count = end - first;
                with += expect_within(&one, b.cluster, &view, i % 3 == 1 ? &FAST : &EXACT, rgba, depth);
            }
            scene_release(&s);
        }
        ck_assert_uint_gt(with, 20);
        spc_reader_close(r);
        case_mesh_free(&meshes[k]);
    }
    free(rgba);
    free(depth);
}
END_TEST

/* Without the clusters that a probe calls hidden it is the same picture. */
START_TEST(probes_tell_what_is_hidden)
{
    struct case_mesh m = layers();
    struct spc_reader *r = case_archive(&m);
    const uint32_t clusters = spc_reader_header(r)->cluster_count;
    uint8_t *all = malloc((size_t)PX * 4), *some = malloc((size_t)PX * 4), *hidden = malloc(clusters);
    uint32_t *probes = malloc(clusters * sizeof *probes), taken = 0;
    for (uint32_t c = 0; c < clusters; c++)
        probes[c] = c;
    for (int i = 0; i < 10; i++) {
        const struct picture_view v = layers_from(i);
        const struct spv_view view = picture_view(&v);
        struct spv_draw_options o = i % 4 == 3 ? FAST : EXACT;
        struct scene s = {0};
        o.tile = i == 4 || i == 7 ? 90 : 0;
        scene_add(&s, r, &view);
        struct spv_part *p = &s.parts[0];
        p->probes = probes;
        p->probe_count = clusters;
        p->hidden = hidden;
        memset(hidden, 9, clusters);
        scene_draw(&s, &view, NULL, &o, all);
        uint32_t left = 0;
        for (uint32_t k = 0; k < p->item_count; k++) {
            struct spc_block b;
            spc_reader_block(r, s.items[0][k].block, &b);
            ck_assert_uint_le(hidden[b.cluster], 1);
            if (!hidden[b.cluster])
                s.items[0][left++] = s.items[0][k];
        }
        taken += p->item_count - left;
        p->item_count = left;
        p->probe_count = 0;
        scene_draw(&s, &view, NULL, &o, some);
        expect_same(some, all, "probes", i);
        scene_release(&s);
    }
    ck_assert_uint_gt(taken, 100);
    free(all);
    free(some);
    free(hidden);
    free(probes);
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

/* ---- paint ------------------------------------------------------------------------------------- */

static bool is_color(const uint8_t *px, uint32_t rgb)
{
    for (int c = 0; c < 3; c++)
        if (abs(px[c] - (int)(rgb >> 8 * c & 0xFF)) > 1)
            return false;
    return true;
}

/* In light from everywhere each pixel has one of these colours; how many of them are there? */
static uint32_t count_colors(const uint8_t *rgba, const uint32_t *colors, uint32_t count, int paint)
{
    uint32_t used = 0;
    bool *found = calloc(count, sizeof *found);
    for (size_t i = 0; i < (size_t)PX; i++) {
        uint32_t k = 0;
        if (rgba[4 * i + 3] == 0)
            continue;
        while (k < count && !is_color(rgba + 4 * i, colors[k]))
            k++;
        ck_assert_msg(k < count, "paint %d: pixel %zu has a colour of nothing", paint, i);
        found[k] = true;
    }
    for (uint32_t k = 0; k < count; k++)
        used += found[k];
    free(found);
    return used;
}

START_TEST(paint_is_the_colour_of_what_is_painted)
{
    struct case_mesh m = case_sphere(12000, 3);
    case_color(&m);
    struct spc_reader *r = case_archive(&m);
    const struct spc_header *h = spc_reader_header(r);
    const struct picture_view v = seen_from(2.4, 0.4, 0.3, 10, SPV_HYBRID);
    const struct spv_view view = picture_view(&v);
    uint8_t *rgba = malloc((size_t)PX * 4);
    static const uint32_t at_least[SPV_PAINT_COUNT] = {0, 4, 2, 16, 2};
    struct scene s = {0};
    scene_add(&s, r, &view);
    for (int paint = SPV_PAINT_CLUSTERS; paint < SPV_PAINT_COUNT; paint++) {
        const struct spv_draw_options o = {.paint = (enum spv_paint)paint, .ambient = 1};
        uint32_t colors[512], count = 0;
        const uint32_t n = paint == SPV_PAINT_CLUSTERS ? h->cluster_count :
                           paint == SPV_PAINT_LEVELS ? 20 : paint == SPV_PAINT_NORMALS ? h->normal_clusters : 2;
        ck_assert_uint_le(n, 512);
        for (uint32_t k = 0; k < n; k++)
            colors[count++] = spv_paint_color(o.paint, k, k, k, k == 1);
        scene_draw(&s, &view, NULL, &o, rgba);
        const uint32_t used = count_colors(rgba, colors, count, paint);
        ck_assert_msg(used >= at_least[paint], "paint %d: %u colours", paint, used);
    }
    scene_release(&s);
    free(rgba);
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

/* ---- the window -------------------------------------------------------------------------------- */

enum { WINDOW = 16 };               /* as large as the context's own framebuffer */

static void expect_shown(const uint8_t *rgba, const uint8_t background[3], int side)
{
    uint8_t shown[WINDOW * WINDOW * 4];
    const struct spv_gl_api *api = &spv_gl_of(draw)->api;
    spv_gl_present(draw, background, side, side);
    api->ReadPixels(0, 0, side, side, GL_RGBA, GL_UNSIGNED_BYTE, shown);
    for (int y = 0; y < side; y++)
        for (int x = 0; x < side; x++)
            for (int c = 0; c < 3; c++) {
                const int fx = (2 * x + 1) * WINDOW / (2 * side), fy = (2 * y + 1) * WINDOW / (2 * side);
                const uint8_t *from = rgba + 4 * (WINDOW * (WINDOW - 1 - fy) + fx);
                ck_assert_uint_eq(shown[4 * (side * y + x) + c], from[3] ? from[c] : background[c]);
            }
}

START_TEST(a_window_shows_the_picture_over_its_background)
{
    static const uint8_t background[3] = {10, 200, 30};
    struct case_mesh m = case_sphere(500, 3);
    struct spc_reader *r = case_archive(&m);
    struct picture_view v = seen_from(2.6, 0.4, 0.3, 1, SPV_HYBRID);
    v.width = v.height = WINDOW;
    const struct spv_view view = picture_view(&v);
    uint8_t rgba[WINDOW * WINDOW * 4], empty[WINDOW * WINDOW * 4] = {0};
    struct scene s = {0};
    expect_shown(empty, background, WINDOW);        /* before there is a picture */
    scene_add(&s, r, &view);
    const struct spv_drawn read = scene_draw(&s, &view, NULL, &EXACT, rgba);
    for (int k = 0; k < 3; k++) {                   /* figures may be those of the frame before */
        const struct spv_drawn shown = scene_draw(&s, &view, NULL, &EXACT, NULL);
        ck_assert_uint_eq(shown.nodes_processed, read.nodes_processed);
        expect_shown(rgba, background, WINDOW);
    }
    expect_shown(rgba, background, WINDOW / 2);     /* the window has shrunk since */
    scene_release(&s);
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

static unsigned allocations;
static PFNGLRENDERBUFFERSTORAGEPROC allocate;

static void APIENTRY count_allocation(GLenum target, GLenum format, GLsizei width, GLsizei height)
{
    allocations++;
    allocate(target, format, width, height);
}

START_TEST(a_window_that_is_dragged_is_not_allocated_anew_each_time)
{
    struct case_mesh m = case_sphere(500, 3);
    struct spc_reader *r = case_archive(&m);
    struct spv_gl_api *api = &spv_gl_of(draw)->api;
    allocate = api->RenderbufferStorage;
    api->RenderbufferStorage = count_allocation;
    allocations = 0;
    for (int side = SIDE; side > 20; side -= 20) {
        struct picture_view v = seen_from(2.6, 0.4, 0.3, 1, SPV_HYBRID);
        v.width = v.height = side;
        const struct spv_view view = picture_view(&v);
        struct scene s = {0};
        scene_add(&s, r, &view);
        uint8_t *reused = malloc((size_t)PX * 4), *fresh = malloc((size_t)PX * 4);
        scene_draw(&s, &view, NULL, &EXACT, reused);
        struct spv_draw *other;
        ck_assert_int_eq(spv_gl_create(ctx, &other, NULL), SPC_OK);
        ck_assert_int_eq(spv_draw_frame(other, &view, NULL, s.parts, 1, &EXACT, fresh, NULL, NULL), SPC_OK);
        spv_draw_free(other);
        ck_assert_msg(memcmp(reused, fresh, (size_t)side * (size_t)side * 4) == 0, "%d px differ", side);
        free(reused);
        free(fresh);
        scene_release(&s);
    }
    api->RenderbufferStorage = allocate;
    ck_assert_uint_le(allocations, 1);
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

/* ---- faults ------------------------------------------------------------------------------------ */

static GLenum APIENTRY lost(void)
{
    return GL_CONTEXT_LOST;
}

static GLenum complaint = GL_NO_ERROR;
static void APIENTRY no_room(GLenum target, GLsizeiptr size, const void *data, GLenum usage)
{
    complaint = size > 1000 ? GL_OUT_OF_MEMORY : GL_NO_ERROR;
    upload(target, size, data, usage);
}

static GLenum APIENTRY complain(void)
{
    const GLenum now = complaint;
    complaint = GL_NO_ERROR;
    return now;
}

START_TEST(a_card_that_fails_is_a_status)
{
    struct case_mesh m = case_sphere(2000, 3);
    struct spc_reader *r = case_archive(&m);
    const struct picture_view v = seen_from(2.6, 0.4, 0.3, 1, SPV_HYBRID);
    const struct spv_view view = picture_view(&v);
    struct spv_gl_api *api = &spv_gl_of(draw)->api, whole = *api;
    uint8_t *rgba = malloc((size_t)PX * 4);
    struct scene s = {0};
    scene_add(&s, r, &view);
    api->GetError = lost;
    ck_assert_int_eq(spv_draw_frame(draw, &view, NULL, s.parts, 1, &EXACT, rgba, NULL, NULL), SPC_FEATURE);
    *api = whole;
    upload = api->BufferData;
    api->BufferData = no_room;
    api->GetError = complain;
    ck_assert_int_eq(spv_draw_frame(draw, &view, NULL, s.parts, 1, &EXACT, rgba, NULL, NULL), SPC_NO_MEMORY);
    struct spc_block b;
    spc_reader_block(r, s.items[0][0].block, &b);
    uint8_t *payload = malloc(b.raw_bytes);
    ck_assert_int_eq(spc_block_decode(r, s.items[0][0].block, true, payload, NULL), SPC_OK);
    ck_assert_ptr_null(store.keep(draw, r, s.items[0][0].block, payload));
    *api = whole;
    scene_draw(&s, &view, NULL, &EXACT, rgba);      /* and then it works again */
    expect_no_hole(r, &v, rgba, "again", 0);
    struct picture_view large = v;
    large.width = large.height = 100000;
    const struct spv_view too_large = picture_view(&large);
    ck_assert_int_eq(spv_draw_frame(draw, &too_large, NULL, s.parts, 1, &EXACT, NULL, NULL, NULL), SPC_FEATURE);
    scene_release(&s);
    free(rgba);
    spc_reader_close(r);
    case_mesh_free(&m);
}
END_TEST

int main(void)
{
    return SUITE("gl", start, finish, kept_blocks_are_the_picture_of_decoded_ones_and_upload_nothing,
                 whatever_is_missing_there_is_no_hole, frozen_tests_draw_the_same_nodes_from_anywhere,
                 archives_of_any_scale_hide_each_other, nothing_is_an_empty_picture,
                 leaving_out_what_is_hidden_changes_no_byte,
                 nothing_is_drawn_outside_of_its_rectangle, probes_tell_what_is_hidden,
                 paint_is_the_colour_of_what_is_painted, a_window_shows_the_picture_over_its_background,
                 a_window_that_is_dragged_is_not_allocated_anew_each_time, a_card_that_fails_is_a_status);
}
