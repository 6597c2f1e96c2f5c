#include "oracle_case.h"

#include "mesh_case.h"

#include <check.h>
#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

/* ---- archives ---------------------------------------------------------------------------------- */

enum shape { SPHERE, SOUP, SHEET };

struct recipe {
    const char *name;
    enum shape shape;
    uint32_t faces, cluster_nodes, block_nodes;
    enum spc_codec codec;
    bool points;                    /* without triangles */
    double scale, offset[3];        /* scale 0: as it is */
    enum spb_cull cull;
    uint32_t normal_clusters;       /* 0: the default */
    bool colors, paper;
};

enum { ALL = 1 << 20 };             /* nodes: everything in one cluster, or in one block a kind */

static const struct recipe recipes[] = {
    {.name = "one triangle", .shape = SOUP, .faces = 1, .cluster_nodes = 16, .block_nodes = 16},
    {.name = "five triangles", .shape = SOUP, .faces = 5, .cluster_nodes = 16, .block_nodes = 16},
    {.name = "sphere, 16", .shape = SPHERE, .faces = 1200, .cluster_nodes = 16, .block_nodes = 8},
    {.name = "sphere, 100, zstd", .shape = SPHERE, .faces = 2400, .cluster_nodes = 100,
     .block_nodes = 40, .codec = SPC_CODEC_ZSTD},
    {.name = "sphere, 700, points", .shape = SPHERE, .faces = 2400, .cluster_nodes = 700,
     .block_nodes = 150, .points = true},
    {.name = "sphere, one cluster, zstd, points", .shape = SPHERE, .faces = 2400,
     .cluster_nodes = ALL, .block_nodes = 100, .codec = SPC_CODEC_ZSTD, .points = true},
    {.name = "sphere, one block", .shape = SPHERE, .faces = 2400, .cluster_nodes = ALL,
     .block_nodes = 65535, .normal_clusters = 128},
    {.name = "soup, 16, zstd", .shape = SOUP, .faces = 1000, .cluster_nodes = 16,
     .block_nodes = 4, .codec = SPC_CODEC_ZSTD},
    {.name = "soup, 100, points", .shape = SOUP, .faces = 2000, .cluster_nodes = 100,
     .block_nodes = 30, .points = true},
    {.name = "soup, 700, said to be closed", .shape = SOUP, .faces = 2000, .cluster_nodes = 700,
     .block_nodes = 60, .cull = SPB_CULL_BACK},
    {.name = "soup, 16, said to be closed", .shape = SOUP, .faces = 1000, .cluster_nodes = 16,
     .block_nodes = 16, .cull = SPB_CULL_BACK, .normal_clusters = 1},
    {.name = "soup, one cluster", .shape = SOUP, .faces = 2000, .cluster_nodes = ALL,
     .block_nodes = 150, .codec = SPC_CODEC_ZSTD},
    {.name = "sheet, 16", .shape = SHEET, .faces = 1000, .cluster_nodes = 16, .block_nodes = 16,
     .codec = SPC_CODEC_ZSTD, .colors = true},
    {.name = "sheet, 100", .shape = SHEET, .faces = 2000, .cluster_nodes = 100, .block_nodes = 30},
    {.name = "sheet, 700", .shape = SHEET, .faces = 2000, .cluster_nodes = 700,
     .block_nodes = 100, .colors = true},
    {.name = "sheet, one cluster, points", .shape = SHEET, .faces = 2000, .cluster_nodes = ALL,
     .block_nodes = 200, .codec = SPC_CODEC_ZSTD, .points = true},
    {.name = "sphere, thesis' errors", .shape = SPHERE, .faces = 1200, .cluster_nodes = 100,
     .block_nodes = 50, .paper = true},
    {.name = "sphere by 1e-12", .shape = SPHERE, .faces = 1200, .cluster_nodes = 100,
     .block_nodes = 40, .scale = 1e-12},
    {.name = "soup by 1e12", .shape = SOUP, .faces = 1000, .cluster_nodes = 100,
     .block_nodes = 40, .scale = 1e12},
    {.name = "sphere at 1e9", .shape = SPHERE, .faces = 1200, .cluster_nodes = 100,
     .block_nodes = 40, .offset = {1e9, -1e9, 1e9}},
    {.name = "sheet of 1 km, georeferenced", .shape = SHEET, .faces = 1200, .cluster_nodes = 100,
     .block_nodes = 40, .codec = SPC_CODEC_ZSTD, .scale = 1000, .offset = {500000, 5400000, 300}},
    {.name = "soup of 1 m at 1e9", .shape = SOUP, .faces = 1000, .cluster_nodes = 700,
     .block_nodes = 100, .points = true, .offset = {1e9, 1e9, 1e9}},
};
enum { RECIPES = sizeof recipes / sizeof *recipes };

static struct spc_reader *build(const struct recipe *r, uint64_t seed)
{
    struct case_mesh m = r->shape == SPHERE ? case_sphere(r->faces, seed)
                         : r->shape == SOUP ? case_soup(r->faces, seed)
                                            : case_sheet(r->faces, seed);
    case_transform(&m, r->scale > 0 ? r->scale : 1, r->offset);
    m.wide = true;
    if (r->colors)
        case_color(&m);
    const char *scan = case_write(&m, "oracle.ply");
    struct spb_build_options o = case_options(scan, case_path("oracle.spc"));
    o.cluster_nodes = r->cluster_nodes;
    o.block_nodes = r->block_nodes;
    o.codec = r->codec;
    o.triangles = !r->points;
    o.cull = r->cull;
    o.paper_error = r->paper;
    o.normal_clusters = r->normal_clusters > 0 ? r->normal_clusters : o.normal_clusters;
    struct spc_reader *reader = case_build(&o);
    ck_assert_uint_eq(spc_reader_header(reader)->leaf_count, m.face_count);
    case_mesh_free(&m);
    return reader;
}

static uint64_t number_from(const char *name, uint64_t otherwise)
{
    const char *text = getenv(name);
    return text != NULL ? strtoull(text, NULL, 10) : otherwise;
}

uint32_t oracle_views(uint32_t n)
{
    return n * (uint32_t)number_from("ORACLE_VIEWS", 1);
}

static void *get(size_t n, size_t size)
{
    void *p = calloc(n + 1, size);
    ck_assert_ptr_nonnull(p);
    return p;
}

void oracle_each(void (*check)(struct oracle_case *c))
{
    const uint64_t seed = number_from("ORACLE_SEED", 1);
    for (uint32_t r = 0; r < RECIPES; r++) {
        struct oracle_case c = {.name = recipes[r].name, .seed = 1000 * seed + r};
        c.reader = build(&recipes[r], c.seed);
        oracle_load(&c.tree, c.reader);
        c.exact = get(c.tree.node_count, 1);
        c.shader = get(c.tree.node_count, 1);
        c.walk = get(c.tree.node_count, 1);
        c.chosen = get(c.tree.header->block_count, sizeof *c.chosen);
        oracle_look(&c, 0);
        check(&c);
        spv_selection_release(&c.selection);
        free(c.exact);
        free(c.shader);
        free(c.walk);
        free(c.chosen);
        oracle_free(&c.tree);
        spc_reader_close(c.reader);
    }
}

/* ---- views ------------------------------------------------------------------------------------- */

uint32_t oracle_pick(struct oracle_case *c, uint32_t n)
{
    return (uint32_t)(n * case_random(&c->state));
}

static double between(struct oracle_case *c, double low, double high)
{
    return low + (high - low) * case_random(&c->state);
}

static double log_between(struct oracle_case *c, double low, double high)
{
    return exp(between(c, log(low), log(high)));
}

static void direction(struct oracle_case *c, double d[3])
{
    double length;
    do {
        for (int a = 0; a < 3; a++)
            d[a] = between(c, -1, 1);
        length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    } while (length > 1 || length < 0.01);
    for (int a = 0; a < 3; a++)
        d[a] /= length;
}

/* from + distance in a random direction */
static void around(struct oracle_case *c, const double from[3], double distance, double out[3])
{
    double d[3];
    direction(c, d);
    for (int a = 0; a < 3; a++)
        out[a] = from[a] + distance * d[a];
}

static const struct oracle_node *some_node(struct oracle_case *c)
{
    return &c->tree.nodes[oracle_pick(c, c->tree.node_count)];
}

static double file_units(const struct oracle_case *c, double units)
{
    return ldexp(units, c->tree.header->unit_exp);
}

enum { EYES = 12, EYE_FRAMED = 9 };

static void place_eye(struct oracle_case *c, uint32_t kind, double eye[3])
{
    const struct spc_header *h = c->tree.header;
    const struct oracle_node *n = some_node(c);
    double middle[3], inside[3];
    for (int a = 0; a < 3; a++) {
        middle[a] = h->box_min[a] + 0.5 * (h->box_max[a] - h->box_min[a]);
        inside[a] = between(c, h->box_min[a], h->box_max[a]);
    }
    const double radius = file_units(c, n->radius), size = c->tree.size;
    switch (kind) {
    case 0:                         /* far, farther than any scene, farther than float32 */
        around(c, middle, size * log_between(c, 10, 1e4), eye);
        break;
    case 1:
        around(c, middle, size * 1e6, eye);
        break;
    case 2:
        around(c, middle, size * (oracle_pick(c, 2) ? 1e20 : 1e40), eye);
        break;
    case 3:                         /* exactly on a node, in its ball, on its ball's edge */
        around(c, n->center, 0, eye);
        break;
    case 4:
        around(c, n->center, radius * case_random(&c->state), eye);
        break;
    case 5:
        around(c, n->center, radius * (1 + between(c, -1e-6, 1e-6)), eye);
        break;
    case 6:                         /* inside the model, on its surface, close to that */
        around(c, inside, 0, eye);
        break;
    case 7:
        around(c, n->leaf && h->triangle_count ? c->tree.corner[n->triangle][0] : n->center, 0, eye);
        break;
    case 8:
        around(c, n->center, size * log_between(c, 1e-6, 0.3), eye);
        break;
    default:                        /* the model framed, more or less */
        around(c, middle, size * between(c, 0.6, 4), eye);
    }
}

static double accept(struct oracle_case *c, bool *pixels)
{
    *pixels = false;
    const uint32_t kind = oracle_pick(c, 10);
    if (kind < 3)
        return log_between(c, 1e-6, 1e4);
    if (kind == 3)
        return (const double[]){1e-6, 1e4, 0x1.fffffep19, 0x1p-60, 1}[oracle_pick(c, 5)];
    if (kind < 7) {                 /* where the cut goes through some node, or almost */
        const struct oracle_node *n = some_node(c);
        c->view.eps = 1;
        const double eps = n->e_self / oracle_q(&c->tree, n, &c->view) * (1 + between(c, -1e-7, 1e-7));
        if (eps > 1e-30 && eps < 0x1p20)
            return eps;
    }
    *pixels = true;
    return spv_camera_eps(&c->view.camera, log_between(c, 0.25, 16));
}

static void assert_camera(const struct oracle_case *c, const double target[3], double fov)
{
    const struct spv_camera *k = &c->view.camera;
    const double *axis[3] = {k->right, k->up, k->forward};
    double toward = 0, length2 = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const double dot = axis[i][0] * axis[j][0] + axis[i][1] * axis[j][1] + axis[i][2] * axis[j][2];
            ck_assert_double_eq_tol(dot, i == j, 1e-12);
        }
    for (int a = 0; a < 3; a++) {
        const int b = (a + 1) % 3, d = (a + 2) % 3;
        ck_assert_double_eq_tol(k->right[a], k->forward[b] * k->up[d] - k->forward[d] * k->up[b], 1e-12);
        toward += k->forward[a] * (target[a] - k->eye[a]);
        length2 += (target[a] - k->eye[a]) * (target[a] - k->eye[a]);
    }
    ck_assert_double_eq_tol(toward / sqrt(length2), 1, 1e-12);
    ck_assert_double_eq_tol(k->focal_px * 2 * tan(fov / 2) / k->height, 1, 1e-12);
}

void oracle_look_at(struct oracle_case *c, const double eye[3], const double target[3])
{
    const double fov = between(c, 0.3, 1.8);
    const int width = 64 + (int)oracle_pick(c, 2000), height = 64 + (int)oracle_pick(c, 1000);
    double up[3], to[3] = {target[0], target[1], target[2]};
    if (to[0] == eye[0] && to[1] == eye[1] && to[2] == eye[2])
        around(c, eye, c->tree.size, to);
    direction(c, up);
    ck_assert(spv_camera_look(&c->view.camera, eye, to, up, fov, width, height));
    assert_camera(c, to, fov);
}

void oracle_look(struct oracle_case *c, uint32_t k)
{
    const uint64_t archive = c->seed & 0xFFFFFFFF;
    c->seed = archive | (uint64_t)k << 32;
    c->state = c->seed * 0x9E3779B97F4A7C15u;
    double eye[3], target[3];
    const uint32_t kind = k % EYES;
    place_eye(c, kind, eye);
    const double *at = some_node(c)->center;
    if (oracle_pick(c, 4) > 0)
        memcpy(target, at, sizeof target);
    else
        around(c, eye, c->tree.size, target);
    oracle_look_at(c, eye, target);
    bool pixels;
    c->view.eps = accept(c, &pixels);
    c->view.mode = oracle_pick(c, 3) ? SPV_HYBRID : SPV_POINTS;
    c->view.cull = false;
    c->useful = pixels && kind >= EYE_FRAMED;
    ck_assert(c->view.eps > 0 && c->view.eps < 0x1p20);
}

void oracle_select(struct oracle_case *c)
{
    struct spc_error err = {0};
    if (spv_select(c->reader, &c->view, &c->selection, &err) != SPC_OK)
        oracle_fail(c, "select: %s", err.what);
    memset(c->chosen, 0, c->tree.header->block_count * sizeof *c->chosen);
    for (uint32_t k = 0; k < c->selection.block_count; k++) {
        ck_assert_uint_lt(c->selection.blocks[k].block, c->tree.header->block_count);
        c->chosen[c->selection.blocks[k].block] = true;
    }
}

void oracle_fail(const struct oracle_case *c, const char *format, ...)
{
    char what[400];
    va_list args;
    va_start(args, format);
    vsnprintf(what, sizeof what, format, args);
    va_end(args);
    const double *eye = c->view.camera.eye;
    ck_abort_msg("%s, archive seed %u, view %u, eye %.17g %.17g %.17g, eps %.17g, %s%s: %s", c->name,
                 (unsigned)c->seed, (unsigned)(c->seed >> 32), eye[0], eye[1], eye[2], c->view.eps,
                 c->view.mode == SPV_HYBRID ? "hybrid" : "points", c->view.cull ? ", culled" : "", what);
    abort();
}
