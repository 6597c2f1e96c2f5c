/*
 * The back end without GL: several archives, parts of clusters, frozen views, colours that say what is what.
 * What is drawn is counted by a tree of all nodes; what is seen is compared with the reference.
 */
#include "count.h"
#include "mesh_case.h"
#include "oracle_case.h"
#include "paint.h"
#include "picture_case.h"
#include "suite.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const struct spv_draw_options EXACT = {.splat = SPV_SPLAT_EXACT, .ambient = 0.2f};
enum { SIDE = 200 };

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

/* ---- parts of clusters ------------------------------------------------------------------------- */

struct ragged {                     /* of each cluster that is wanted the first blocks, or none */
    struct spv_item *items;
    uint32_t *tops;
    uint32_t item_count, top_count;
};

static void rag_cluster(const struct spc_reader *reader, uint32_t id, const struct spv_chosen *chosen, uint32_t count,
                        uint64_t *state, struct ragged *out)
{
    struct spc_cluster c;
    struct spc_block missing;
    spc_reader_cluster(reader, id, &c);
    const uint32_t here = c.block_first + (uint32_t)(case_random(state) * (c.block_count + 1));
    if (chosen[count - 1].block < here) {
        for (uint32_t i = 0; i < count; i++)
            out->items[out->item_count++] = (struct spv_item){chosen[i].block, NULL, -1};
        return;
    }
    spc_reader_block(reader, here, &missing);
    if (missing.e_parent_max >= c.e_parent_max)
        out->tops[out->top_count++] = id;
    for (uint32_t k = c.block_first; k < here; k++)
        out->items[out->item_count++] = (struct spv_item){k, NULL, missing.e_parent_max};
}

static struct ragged rag(const struct spc_reader *reader, const struct spv_selection *s, uint64_t *state)
{
    const struct spc_header *h = spc_reader_header(reader);
    struct ragged out = {calloc(h->block_count, sizeof *out.items), calloc(h->cluster_count, sizeof *out.tops), 0, 0};
    for (uint32_t i = 0, n; i < s->block_count; i += n) {
        struct spc_block b, other;
        spc_reader_block(reader, s->blocks[i].block, &b);
        for (n = 1; i + n < s->block_count; n++) {
            spc_reader_block(reader, s->blocks[i + n].block, &other);
            if (other.cluster != b.cluster)
                break;
        }
        rag_cluster(reader, b.cluster, &s->blocks[i], n, state, &out);
    }
    return out;
}

static struct spv_part part_of(const struct spc_reader *reader, const struct ragged *r)
{
    return (struct spv_part){.reader = reader, .items = r->items, .item_count = r->item_count, .tops = r->tops,
                             .top_count = r->top_count};
}

static void rag_free(struct ragged *r)
{
    free(r->items);
    free(r->tops);
}

struct expected {
    uint64_t nodes, triangles, processed;
};

static void expect_item(const struct oracle_case *c, const struct spv_item *item, struct expected *e)
{
    const struct oracle_tree *t = &c->tree;
    const bool leaf = t->blocks[item->block].kind == SPC_BLOCK_LEAF;
    struct spv_interval in = oracle_interval(t, item->block, &c->view);
    in.missing = item->missing;
    for (uint32_t s = t->stored_first[item->block]; s < t->stored_first[item->block + 1]; s++) {
        const struct oracle_node *n = &t->nodes[t->stored[s]];
        const bool all = c->view.mode == SPV_TRIANGLES;
        const bool point = !all && spv_interval_point(&in, n->record);
        const bool triangle = leaf && (t->header->flags & SPC_FLAG_TRIANGLES) && c->view.mode != SPV_POINTS &&
                              (all || spv_interval_triangle(&in, n->record));
        c->shader[t->stored[s]] |= (uint8_t)((point ? ORACLE_POINT : 0) | (triangle ? ORACLE_TRIANGLE : 0));
        e->nodes += point;
        e->triangles += triangle;
        e->processed++;
    }
}

static void expect_tops(const struct oracle_case *c, uint32_t id, struct expected *e)
{
    const struct oracle_tree *t = &c->tree;
    for (uint32_t i = 0; i < t->node_count && c->view.mode != SPV_TRIANGLES; i++) {
        const struct oracle_node *n = &t->nodes[i];
        if (n->cluster != id || (n->parent != SPC_NONE && t->nodes[n->parent].cluster == id))
            continue;
        struct spv_interval upper = oracle_interval(t, n->block, &c->view);
        upper.lower = false;
        const bool drawn = spv_interval_point(&upper, n->record);
        c->shader[i] |= drawn ? ORACLE_POINT : 0;
        e->nodes += drawn;
        e->processed++;
    }
}

/* What the back end draws of random prefixes is what the rule says of each node, and cuts every path. */
static void ragged(struct oracle_case *c)
{
    struct spv_draw_options options = {.ambient = 0.2f, .no_occlusion = true};
    uint8_t *rgba = malloc(4 * 64 * 64);
    for (uint32_t k = 0; k < oracle_views(12); k++) {
        oracle_look(c, k);
        oracle_select(c);
        struct ragged r = rag(c->reader, &c->selection, &c->state);
        struct spv_part part = part_of(c->reader, &r);
        struct spv_drawn drawn;
        struct expected e = {0};
        uint32_t bare;
        memset(c->shader, 0, c->tree.node_count);
        for (uint32_t i = 0; i < r.item_count; i++)
            expect_item(c, &r.items[i], &e);
        for (uint32_t i = 0; i < r.top_count; i++)
            expect_tops(c, r.tops[i], &e);
        struct spv_view view = c->view;
        view.camera.width = view.camera.height = 64;    /* what is drawn does not depend on it */
        options.splat = k % 2 ? SPV_SPLAT_FAST : SPV_SPLAT_EXACT;
        options.tile = k % 3 == 2 ? 40 : 0;
        ck_assert_int_eq(spv_draw_frame(picture_soft(), &view, NULL, &part, 1, &options, rgba, &drawn, NULL), SPC_OK);
        if (!options.tile && (drawn.nodes != e.nodes || drawn.triangles != e.triangles ||
                              drawn.nodes_processed > e.processed))
            oracle_fail(c, "view %u: %llu nodes, %llu triangles of %llu, not %llu, %llu of %llu", k,
                        (unsigned long long)drawn.nodes, (unsigned long long)drawn.triangles,
                        (unsigned long long)drawn.nodes_processed, (unsigned long long)e.nodes,
                        (unsigned long long)e.triangles, (unsigned long long)e.processed);
        oracle_paths(&c->tree, c->shader, &bare);
        if (bare != SPC_NONE && c->view.mode != SPV_TRIANGLES)
            oracle_fail(c, "view %u: nothing is drawn from the root to leaf %u", k, bare);
        rag_free(&r);
    }
    free(rgba);
}

START_TEST(parts_of_clusters_are_drawn_by_the_rule)
{
    oracle_each(ragged);
}
END_TEST

/* ---- pictures ---------------------------------------------------------------------------------- */

static struct picture_view around(int i, double middle, enum spv_mode mode, double eps_px)
{
    static const double from[6][3] = {{1, 0.2, 0.3}, {-1, 0.1, 0}, {0.3, 1, 0.5},
                                      {0.1, -1, 0.2}, {0.7, 0.5, 1}, {0, 0.3, -1}};
    struct picture_view v = {.up = {0.1, 0.9, 0.3}, .fov_rad = 0.9, .width = SIDE, .height = SIDE,
                             .eps_px = eps_px, .mode = mode};
    for (int a = 0; a < 3; a++) {
        v.eye[a] = middle + from[i % 6][a] * (i % 2 ? 1.4 : 2.6);
        v.target[a] = middle;
    }
    return v;
}

static uint8_t *frame(const struct spv_view *view, const struct spv_view *tested, struct spv_part *parts,
                      uint32_t count, const struct spv_draw_options *options, struct spv_drawn *drawn)
{
    const size_t n = (size_t)4 * (size_t)view->camera.width * (size_t)view->camera.height;
    struct spc_error err = {0};
    uint8_t *rgba = malloc(n);
    memset(rgba, 7, n);
    if (spv_draw_frame(picture_soft(), view, tested, parts, count, options, rgba, drawn, &err) != SPC_OK)
        ck_abort_msg("cannot draw: %s", err.what);
    return rgba;
}

static uint64_t holes(const struct spc_reader *reader, const struct picture_view *v, const uint8_t *rgba)
{
    const struct spv_view view = picture_view(v);
    struct ref_image r = picture_reference(reader, &view, v->fov_rad, v->eye, v->target, v->up);
    const size_t n = (size_t)v->width * (size_t)v->height;
    uint8_t *cover = malloc(n);
    struct ref_compare c;
    for (size_t i = 0; i < n; i++)
        cover[i] = rgba[4 * i + 3];
    ref_compare_cover(&r, cover, &c);
    ref_image_release(&r);
    free(cover);
    return c.holes;
}

START_TEST(whatever_is_missing_no_pixel_is_empty)
{
    struct case_mesh meshes[] = {case_sphere(3000, 21), case_sheet(3000, 22)};
    uint64_t state = 23;
    for (int m = 0; m < 2; m++) {
        struct spc_reader *reader = case_archive(&meshes[m]);
        for (int i = 0; i < 8; i++) {
            const struct picture_view v = around(i, m == 0 ? 0 : 0.5, i % 2 ? SPV_POINTS : SPV_HYBRID, 1 + i);
            const struct spv_view view = picture_view(&v);
            struct spv_selection s = {0};
            ck_assert_int_eq(spv_select(reader, &view, &s, NULL), SPC_OK);
            struct ragged r = rag(reader, &s, &state);
            struct spv_part part = part_of(reader, &r);
            uint8_t *rgba = frame(&view, NULL, &part, 1, &EXACT, NULL);
            ck_assert_msg(holes(reader, &v, rgba) == 0, "mesh %d, view %d: holes", m, i);
            free(rgba);
            rag_free(&r);
            spv_selection_release(&s);
        }
        spc_reader_close(reader);
        case_mesh_free(&meshes[m]);
    }
}
END_TEST

static struct ragged everything(const struct spv_selection *s)
{
    struct ragged r = {calloc(s->block_count + 1, sizeof *r.items), NULL, s->block_count, 0};
    for (uint32_t i = 0; i < s->block_count; i++)
        r.items[i] = (struct spv_item){s->blocks[i].block, NULL, -1};
    return r;
}

/* What one eye draws, seen by another: the same nodes, and no hole, for they cut every path. */
START_TEST(a_frozen_view_is_drawn_by_its_own_eye)
{
    struct case_mesh m = case_sphere(6000, 31);
    struct spb_build_options o = case_options(case_write(&m, "many.ply"), case_path("many.spc"));
    o.cluster_nodes = o.block_nodes = 32768;        /* blocks of so many leaves keep their normal clusters */
    struct spc_reader *few = case_archive(&m), *many = case_build(&o);
    for (int i = 0; i < 9; i++) {
        struct spc_reader *reader = i < 6 ? few : many;
        const struct picture_view v = around(i, 0, (enum spv_mode)(i % 3), i < 6 ? 2 + i : 0.05),
                                  w = around(i + 2, 0, (enum spv_mode)(i % 3), 4);
        struct spv_view view = picture_view(&w), tested = picture_view(&v);
        struct spv_draw_options options = EXACT;
        struct spv_selection s = {0};
        struct spv_count count;
        struct spv_drawn drawn, own;
        options.no_occlusion = true;
        tested.cull = i >= 6;
        ck_assert_int_eq(spv_select(reader, &tested, &s, NULL), SPC_OK);
        struct ragged r = everything(&s);
        struct spv_part part = part_of(reader, &r);
        uint8_t *rgba = frame(&view, &tested, &part, 1, &options, &drawn);
        if (!tested.cull) {
            ck_assert_int_eq(spv_count(reader, &tested, &s, &count, NULL), SPC_OK);
            ck_assert_uint_eq(drawn.nodes, count.nodes_drawn);
            ck_assert_uint_eq(drawn.triangles, count.triangles_drawn);
            ck_assert_msg(holes(reader, &w, rgba) == 0, "view %d: holes", i);
        }
        free(rgba);
        rgba = frame(&tested, NULL, &part, 1, &options, &own);
        ck_assert_uint_eq(own.nodes, drawn.nodes);
        ck_assert_uint_eq(own.triangles, drawn.triangles);
        ck_assert_uint_eq(own.nodes_processed, drawn.nodes_processed);
        ck_assert(i < 6 || i % 2 || drawn.nodes_processed < s.nodes);      /* near by no cone is behind all */
        free(rgba);
        rag_free(&r);
        spv_selection_release(&s);
    }
    spc_reader_close(few);
    spc_reader_close(many);
    case_mesh_free(&m);
}
END_TEST

START_TEST(a_picture_of_no_archive_is_empty)
{
    const struct picture_view v = around(0, 0, SPV_HYBRID, 1);
    const struct spv_view view = picture_view(&v);
    uint8_t *rgba = frame(&view, NULL, NULL, 0, &EXACT, NULL);
    for (size_t i = 0; i < (size_t)4 * SIDE * SIDE; i++)
        if (rgba[i] != 0)
            ck_abort_msg("byte %zu is %d", i, rgba[i]);
    free(rgba);
}
END_TEST

/* ---- archives of different units --------------------------------------------------------------- */

struct whole {                      /* an archive with all of its blocks */
    struct spc_reader *reader;
    struct ragged blocks;
};

static struct whole sphere_at(double scale, double x, uint64_t seed, const uint8_t color[4])
{
    struct case_mesh m = case_sphere(2000, seed);
    const double offset[3] = {x, 0, 0};
    case_transform(&m, scale, offset);
    m.wide = true;
    case_color(&m);
    for (uint32_t i = 0; i < m.vertex_count; i++)
        memcpy(m.rgba[i], color, 4);
    struct whole w = {.reader = case_archive(&m)};
    const uint32_t n = spc_reader_header(w.reader)->block_count;
    w.blocks = (struct ragged){calloc(n, sizeof *w.blocks.items), NULL, n, 0};
    for (uint32_t i = 0; i < n; i++)
        w.blocks.items[i] = (struct spv_item){i, NULL, -1};
    case_mesh_free(&m);
    return w;
}

/* Pixels that show red, and that show blue. */
static void count_colors(const uint8_t *rgba, size_t n, size_t *red, size_t *blue)
{
    *red = *blue = 0;
    for (size_t i = 0; i < n; i++) {
        *red += rgba[4 * i + 3] && rgba[4 * i] > rgba[4 * i + 2];
        *blue += rgba[4 * i + 3] && rgba[4 * i] < rgba[4 * i + 2];
    }
}

/* A small red sphere before, behind and within a large blue one; the order of the parts does not matter. */
START_TEST(archives_of_any_units_hide_each_other_as_they_lie)
{
    static const uint8_t red[4] = {255, 0, 0, 255}, blue[4] = {0, 0, 255, 255};
    static const struct {
        double scale, at, eye;
        bool seen;
    } cases[] = {{1, 2.5, 6, true}, {0.1, 2.5, 3.3, true}, {0.1, -2.5, 4.5, false}, {0x1p-12, 2.5, 2.5 + 0x1p-9, true},
                 {0x1p-12, -2.5, 4.5, false}, {0x1p-40, 0, 0x3p-40, true}, {1e-30, 0, 3e-30, true},
                 {1e-30, 0, 4.5, false}, {1e-60, 0, 3e-60, true}, {1e-60, 0, 4.5, false}};
    struct whole large = sphere_at(1, 0, 41, blue);
    for (size_t i = 0; i < 3 * sizeof cases / sizeof *cases; i++) {
        const double scale = cases[i / 3].scale;
        struct whole small = sphere_at(scale, cases[i / 3].at, 42, red);
        const struct picture_view v = {.eye = {cases[i / 3].eye}, .up = {0, 1, 0}, .fov_rad = 0.9, .width = SIDE,
                                       .height = SIDE, .eps_px = 1, .mode = (enum spv_mode)(i % 3)};
        const struct spv_view view = picture_view(&v);
        size_t r[2], b[2];
        for (int order = 0; order < 2; order++) {
            struct spv_part parts[2];
            parts[order] = part_of(large.reader, &large.blocks);
            parts[!order] = part_of(small.reader, &small.blocks);
            uint8_t *rgba = frame(&view, NULL, parts, 2, &EXACT, NULL);
            count_colors(rgba, (size_t)SIDE * SIDE, &r[order], &b[order]);
            free(rgba);
        }
        ck_assert_uint_eq(r[0], r[1]);
        ck_assert_uint_eq(b[0], b[1]);
        if (cases[i / 3].seen ? r[0] < 1000 : r[0] > 0 || b[0] < 1000)
            ck_abort_msg("case %zu, scale %g: %zu red, %zu blue", i, scale, r[0], b[0]);
        spc_reader_close(small.reader);
        rag_free(&small.blocks);
    }
    spc_reader_close(large.reader);
    rag_free(&large.blocks);
}
END_TEST

/* ---- colours that say what is what ------------------------------------------------------------- */

static bool is_of(uint32_t color, enum spv_paint paint, const struct spc_reader *reader)
{
    const struct spc_header *h = spc_reader_header(reader);
    if (paint == SPV_PAINT_KINDS)
        return color == spv_paint_color(paint, 0, 0, 0, false) || color == spv_paint_color(paint, 0, 0, 0, true);
    const uint32_t n = paint == SPV_PAINT_CLUSTERS ? h->cluster_count
                       : paint == SPV_PAINT_NORMALS ? h->normal_clusters : 64;
    for (uint32_t k = 0; k < n; k++)
        if (color == spv_paint_color(SPV_PAINT_CLUSTERS, k, 0, 0, false))
            return true;
    return false;
}

/* Without shades a pixel is its paint; and of one cluster all are of one colour. */
START_TEST(paint_says_what_a_pixel_is_of)
{
    struct case_mesh m = case_sphere(3000, 51);
    case_color(&m);
    struct spc_reader *reader = case_archive(&m);
    for (int i = 0; i < 24; i++) {
        const struct picture_view v = around(i / 4, 0, i % 3 == 2 ? SPV_TRIANGLES : (enum spv_mode)(i % 3), 2);
        const struct spv_view view = picture_view(&v);
        const enum spv_paint paint = (enum spv_paint)(1 + i % 4);
        const struct spv_draw_options options = {.ambient = 1, .paint = paint};
        struct spv_selection s = {0};
        struct spc_block b;
        struct spc_cluster c;
        ck_assert_int_eq(spv_select(reader, &view, &s, NULL), SPC_OK);
        struct ragged r = everything(&s);
        struct spv_part part = part_of(reader, &r);
        for (int one = 0; one < 2; one++) {
            uint32_t first = 0;
            bool two = false;
            if (one)
                r.items[0] = r.items[r.item_count - 1];
            spc_reader_block(reader, r.items[0].block, &b);
            spc_reader_cluster(reader, b.cluster, &c);
            part.item_count = one ? 1 : r.item_count;
            uint8_t *rgba = frame(&view, NULL, &part, 1, &options, NULL);
            for (size_t k = 0; k < (size_t)SIDE * SIDE; k++) {
                const uint8_t *p = rgba + 4 * k;
                const uint32_t color = p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
                if (color == 0)
                    continue;
                if (!is_of(color, paint, reader))
                    ck_abort_msg("frame %d, pixel %zu: %08x is no paint", i, k, color);
                if (one && paint <= SPV_PAINT_LEVELS)
                    ck_assert_uint_eq(color, spv_paint_color(paint, b.cluster, c.level, 0, false));
                two |= first != 0 && color != first;
                first = color;
            }
            if (!one)
                ck_assert_msg(two || paint == SPV_PAINT_KINDS, "frame %d is of one colour", i);
            free(rgba);
        }
        rag_free(&r);
        spv_selection_release(&s);
    }
    spc_reader_close(reader);
    case_mesh_free(&m);
}
END_TEST

/* Normal clusters of leaves, as the reference numbers their triangles. */
static uint32_t *leaf_axes(const struct spc_reader *reader)
{
    struct oracle_tree t;
    oracle_load(&t, reader);
    uint32_t *axes = calloc(t.leaf_count + 1, sizeof *axes), n = 0;
    for (uint32_t i = 0; i < t.node_count; i++)
        if (t.nodes[t.stored[i]].leaf)
            axes[n++] = t.nodes[t.stored[i]].axis;
    oracle_free(&t);
    return axes;
}

START_TEST(normal_clusters_are_painted_by_their_number)
{
    struct case_mesh m = case_sphere(3000, 52);
    struct spc_reader *reader = case_archive(&m);
    const struct picture_view v = around(0, 0, SPV_TRIANGLES, 1);
    const struct spv_view view = picture_view(&v);
    const struct spv_draw_options options = {.ambient = 1, .paint = SPV_PAINT_NORMALS};
    struct ref_image ref = picture_reference(reader, &view, v.fov_rad, v.eye, v.target, v.up);
    struct picture p = picture_draw(reader, &view, &options);
    uint32_t *axes = leaf_axes(reader);
    size_t same = 0, all = 0;
    for (size_t k = 0; k < (size_t)SIDE * SIDE; k++) {
        const uint8_t *c = p.rgba + 4 * k;
        if (ref.triangle[k] == UINT32_MAX || !p.cover[k])
            continue;
        all++;
        const uint32_t painted = c[0] | (uint32_t)c[1] << 8 | (uint32_t)c[2] << 16 | (uint32_t)c[3] << 24;
        same += spv_paint_color(SPV_PAINT_NORMALS, 0, 0, axes[ref.triangle[k]], false) == painted;
    }
    ck_assert_msg(all > 1000 && same > all * 98 / 100, "%zu of %zu pixels are of their normal cluster", same, all);
    free(axes);
    picture_release(&p);
    ref_image_release(&ref);
    spc_reader_close(reader);
    case_mesh_free(&m);
}
END_TEST

/* ---- tiles ------------------------------------------------------------------------------------- */

START_TEST(tiles_count_what_the_whole_picture_counts)
{
    struct case_mesh m = case_sphere(6000, 61);
    struct spc_reader *reader = case_archive(&m);
    for (int i = 0; i < 6; i++) {
        const struct picture_view v = around(2 * i, 0, (enum spv_mode)(i % 3), 3);
        const struct spv_view view = picture_view(&v);
        struct spv_draw_options options = EXACT;
        struct spv_drawn drawn[2];
        options.no_occlusion = true;
        for (int k = 0; k < 2; k++) {
            options.tile = k * 48;
            struct picture p = picture_draw(reader, &view, &options);
            drawn[k] = p.drawn;
            picture_release(&p);
        }
        ck_assert_uint_gt(drawn[0].nodes_processed, 1000);
        ck_assert_uint_eq(drawn[0].nodes_processed, drawn[1].nodes_processed);
        ck_assert_uint_eq(drawn[0].nodes, drawn[1].nodes);
        ck_assert_uint_eq(drawn[0].triangles, drawn[1].triangles);
    }
    spc_reader_close(reader);
    case_mesh_free(&m);
}
END_TEST

int main(void)
{
    if (!oracle_start())
        return 1;
    const int failed = SUITE("soft parts", start, finish, parts_of_clusters_are_drawn_by_the_rule,
                             whatever_is_missing_no_pixel_is_empty, a_frozen_view_is_drawn_by_its_own_eye,
                             a_picture_of_no_archive_is_empty, archives_of_any_units_hide_each_other_as_they_lie,
                             paint_says_what_a_pixel_is_of, normal_clusters_are_painted_by_their_number,
                             tiles_count_what_the_whole_picture_counts);
    oracle_finish();
    return failed;
}
