#include "oracle_case.h"

#include "mesh_case.h"

#include <check.h>
#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

/* ---- archives -------------------------------------------------------------------------------- */

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

enum { ALL = 1 << 20 };             /* nodes: everything in one cluster, of few blocks */

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
    {.name = "sphere, one cluster, 128 normals", .shape = SPHERE, .faces = 2400, .cluster_nodes = ALL,
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

static void build(const struct recipe *r, uint64_t seed, const char *path)
{
    struct case_mesh m = r->shape == SPHERE ? case_sphere(r->faces, seed)
                         : r->shape == SOUP ? case_soup(r->faces, seed)
                                            : case_sheet(r->faces, seed);
    case_transform(&m, r->scale > 0 ? r->scale : 1, r->offset);
    m.wide = true;
    if (r->colors)
        case_color(&m);
    const char *scan = case_write(&m, "oracle.ply");
    struct spb_build_options o = case_options(scan, path);
    o.cluster_nodes = r->cluster_nodes;
    o.block_nodes = r->block_nodes;
    o.codec = r->codec;
    o.triangles = !r->points;
    o.cull = r->cull;
    o.paper_error = r->paper;
    o.normal_clusters = r->normal_clusters > 0 ? r->normal_clusters : o.normal_clusters;
    struct spc_reader *reader = case_build(&o);
    ck_assert_uint_eq(spc_reader_header(reader)->leaf_count, m.face_count);
    spc_reader_close(reader);
    case_mesh_free(&m);
}

static char folder[64];             /* of the archives; the program's, not a test's */

bool oracle_start(void)
{
    strcpy(folder, "/tmp/spc-oracle-XXXXXX");
    return mkdtemp(folder) != NULL;
}

static void archive_path(uint32_t r, char path[100])
{
    snprintf(path, 100, "%s/%u.spc", folder, r);
}

void oracle_finish(void)
{
    char path[100];
    for (uint32_t r = 0; r < RECIPES; r++) {
        archive_path(r, path);
        unlink(path);
    }
    rmdir(folder);
}

/* Builds what no test before has built. */
static struct spc_reader *archive(uint32_t r, uint64_t seed)
{
    char path[100];
    struct spc_reader *reader;
    struct spc_error err = {0};
    archive_path(r, path);
    if (access(path, F_OK) != 0)
        build(&recipes[r], seed, path);
    if (spc_reader_open(path, &reader, &err) != SPC_OK)
        ck_abort_msg("%s: %s", recipes[r].name, err.what);
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
        c.reader = archive(r, c.seed);
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

/* ---- views ----------------------------------------------------------------------------------- */

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

enum { EYE_BEYOND = 2, EYE_FRAMED = 9, EYES = 12, VIEWS = 16 };

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
    case EYE_BEYOND:
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

static double accept(struct oracle_case *c)
{
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
    return spv_camera_eps(&c->view.camera, log_between(c, 0.25, 16));
}

static void assert_camera(const struct oracle_case *c, const double target[3], double fov)
{
    const struct spv_camera *k = &c->view.camera;
    const double *axis[3] = {k->right, k->up, k->forward};
    double toward = 0, length2 = 0;
    bool good = true;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const double dot = axis[i][0] * axis[j][0] + axis[i][1] * axis[j][1] + axis[i][2] * axis[j][2];
            good = good && fabs(dot - (i == j)) < 1e-12;
        }
    for (int a = 0; a < 3; a++) {
        const int b = (a + 1) % 3, d = (a + 2) % 3;
        good = good && fabs(k->forward[b] * k->up[d] - k->forward[d] * k->up[b] - k->right[a]) < 1e-12;
        toward += k->forward[a] * (target[a] - k->eye[a]);
        length2 += (target[a] - k->eye[a]) * (target[a] - k->eye[a]);
    }
    if (!good || fabs(toward / sqrt(length2) - 1) > 1e-12 ||
        fabs(k->focal_px * 2 * tan(fov / 2) / k->height - 1) > 1e-12)
        oracle_fail(c, "the camera does not look where it should");
}

static void aim(struct oracle_case *c, const double eye[3], const double target[3], const double up[3])
{
    const double fov = between(c, 0.3, 1.8);
    const int width = 64 + (int)oracle_pick(c, 2000), height = 64 + (int)oracle_pick(c, 1000);
    ck_assert(spv_camera_look(&c->view.camera, eye, target, up, fov, width, height));
    assert_camera(c, target, fov);
}

void oracle_look_at(struct oracle_case *c, const double eye[3], const double target[3])
{
    double up[3], to[3] = {target[0], target[1], target[2]};
    for (double far = c->tree.size; to[0] == eye[0] && to[1] == eye[1] && to[2] == eye[2]; far *= 1024)
        around(c, eye, far, to);
    direction(c, up);
    aim(c, eye, to, up);
}

/* ---- views made to fail ---------------------------------------------------------------------- */

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static void perpendicular(struct oracle_case *c, const double d[3], double out[3])
{
    double other[3], length;
    do {
        direction(c, other);
        cross(d, other, out);
        length = sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
    } while (length < 0.01);
    for (int a = 0; a < 3; a++)
        out[a] /= length;
}

/* An eps at which the node is drawn from where the eye is, where there is one. */
static void draw_node(struct oracle_case *c, const struct oracle_node *n)
{
    c->view.eps = 1;
    const double rho = fmax(oracle_q(&c->tree, n, &c->view), 1e-9 * n->radius);
    const double most = fmin(n->e_parent, 4 * n->e_self);
    c->view.eps = between(c, n->e_self, most) * (1 + 1e-6) / rho;
}

/* A node just inside one of the picture's edges, the rest of its cluster perhaps beyond. */
static void look_past(struct oracle_case *c)
{
    const struct oracle_node *n = some_node(c);
    double eye[3], d[3], e[3], other[3], target[3], forward[3], side[3];
    direction(c, d);
    perpendicular(c, d, e);
    const double away = c->tree.size * log_between(c, 0.01, 1e4);
    for (int a = 0; a < 3; a++)
        eye[a] = n->center[a] - away * d[a];
    aim(c, eye, n->center, e);      /* a lens; then the direction from which it just sees the node */
    struct spv_camera *k = &c->view.camera;
    const bool across = oracle_pick(c, 2);
    const double in = 1 - log_between(c, 1e-7, 0.2);
    const double angle = atan(in * (across ? k->width : k->height) / 2 / k->focal_px);
    for (int a = 0; a < 3; a++) {
        forward[a] = cos(angle) * d[a] - sin(angle) * e[a];
        side[a] = sin(angle) * d[a] + cos(angle) * e[a];
        target[a] = eye[a] + 1000 * away * forward[a];
    }
    cross(side, forward, other);
    const double fov = 2 * atan(k->height / (2 * k->focal_px));
    ck_assert(spv_camera_look(k, eye, target, across ? other : side, fov, k->width, k->height));
    draw_node(c, n);
}

static double reach_along(const struct oracle_case *c, const struct oracle_node *n, const double m[3])
{
    double along = 0, at = 0;
    for (int a = 0; a < 3; a++) {
        along += n->normal[a] * m[a];
        at += ldexp(n->center[a] - c->tree.nodes[0].center[a], -c->tree.header->unit_exp) * m[a];
    }
    return at + fabs(along) * n->height + n->radius * sqrt(fmax(0, 1 - along * along));
}

static bool is_below(const struct oracle_case *c, uint32_t cluster, uint32_t above)
{
    while (cluster > above)         /* parents have smaller ids */
        cluster = c->tree.clusters[cluster].parent;
    return cluster == above;
}

/* An axis, or any direction. */
static void axis_or_any(struct oracle_case *c, double m[3])
{
    direction(c, m);
    if (oracle_pick(c, 4) == 0)
        return;
    const uint32_t axis = oracle_pick(c, 3);
    for (uint32_t a = 0; a < 3; a++)
        m[a] = a != axis ? 0 : m[a] < 0 ? -1 : 1;
}

/* The eye in the outermost pill of a cluster, or of all below, looking out: its tip alone is in front. */
static void look_out(struct oracle_case *c)
{
    const uint32_t cluster = oracle_pick(c, c->tree.header->cluster_count);
    const bool below = oracle_pick(c, 2);
    const struct oracle_node *n = NULL;
    double m[3], eye[3], target[3], along = 0, length2 = 0, flat[3];
    axis_or_any(c, m);
    for (uint32_t i = 0; i < c->tree.node_count; i++) {
        const struct oracle_node *o = &c->tree.nodes[i];
        if (below ? !is_below(c, o->cluster, cluster) : o->cluster != cluster)
            continue;
        if (n == NULL || reach_along(c, o, m) > reach_along(c, n, m))
            n = o;
    }
    for (int a = 0; a < 3; a++)
        along += n->normal[a] * m[a];
    for (int a = 0; a < 3; a++) {
        flat[a] = m[a] - along * n->normal[a];
        length2 += flat[a] * flat[a];
    }
    const double back = n->radius * log_between(c, 1e-4, 0.4);
    for (int a = 0; a < 3; a++) {
        const double tip = (along < 0 ? -1 : 1) * n->height * n->normal[a] +
                           (length2 > 0 ? n->radius * flat[a] / sqrt(length2) : 0);
        eye[a] = n->center[a] + file_units(c, tip - back * m[a]);
        target[a] = eye[a] + c->tree.size * m[a];
    }
    oracle_look_at(c, eye, target);
    draw_node(c, n);
}

/* The axis along which the node's ball comes nearest to a face of what a cluster has below. */
static void way_out(const struct oracle_case *c, const struct oracle_node *n, uint32_t cluster, double m[3])
{
    const struct spc_cluster *k = &c->tree.clusters[cluster];
    double best = INFINITY;
    for (int face = 0; face < 6; face++) {
        const int axis = face % 3, sign = face < 3 ? -1 : 1;
        const double at = ldexp(n->center[axis] - k->origin[axis], -c->tree.header->unit_exp);
        const double gap = sign * ((double)k->sub_box[face] - at) - n->radius;
        if (gap >= best)
            continue;
        best = gap;
        for (int a = 0; a < 3; a++)
            m[a] = a == axis ? sign : 0;
    }
}

/*
 * A node at the border of its upper test. Below a cluster there may be longer links than in it:
 * takes the longest, where there is such a cluster, and looks from outside.
 */
static void look_from_border(struct oracle_case *c)
{
    const struct oracle_node *n = some_node(c);
    double m[3], eye[3];
    axis_or_any(c, m);
    for (int tries = 0; tries < 20 && oracle_pick(c, 20); tries++) {
        const uint32_t cluster = oracle_pick(c, c->tree.header->cluster_count);
        const struct spc_cluster *k = &c->tree.clusters[cluster];
        if (k->sub_link_max <= k->link_max)
            continue;
        for (uint32_t i = 0; i < c->tree.node_count; i++)
            if (c->tree.nodes[i].link > (double)k->link_max && is_below(c, c->tree.nodes[i].cluster, cluster))
                n = oracle_pick(c, 2) || n->cluster <= cluster ? &c->tree.nodes[i] : n;
        way_out(c, n, cluster, m);
        break;
    }
    c->view.eps = oracle_pick(c, 2) ? log_between(c, 1, 1e6) : log_between(c, 1e-4, 1);
    const double border = n->parent == SPC_NONE ? 1 : n->e_parent / c->view.eps + n->link;
    const double away = n->radius + border * (1 + between(c, -2e-6, 2e-6));
    for (int a = 0; a < 3; a++)
        eye[a] = n->center[a] + file_units(c, away * m[a]);
    oracle_look_at(c, eye, n->center);
}

/*
 * In one line behind a node and its parent, which is all but fine enough: no link may be shorter.
 * Near them, rounding counts most.
 */
static void look_from_behind_parent(struct oracle_case *c)
{
    const struct oracle_node *n = &c->tree.nodes[oracle_pick(c, c->tree.node_count)];
    const struct oracle_node *p = n->parent == SPC_NONE ? n : &c->tree.nodes[n->parent];
    double m[3], eye[3], length = 0;
    direction(c, m);
    for (int a = 0; a < 3; a++)
        length = hypot(length, p->center[a] - n->center[a]);
    const double rho = p->radius * log_between(c, 1e-4, 10);
    for (int a = 0; a < 3; a++) {
        m[a] = length > 0 ? (p->center[a] - n->center[a]) / length : m[a];
        eye[a] = p->center[a] + file_units(c, (p->radius + rho) * m[a]);
    }
    oracle_look_at(c, eye, n->center);
    c->view.eps = 1;
    c->view.eps = p->e_self / oracle_q(&c->tree, p, &c->view) * (1 + between(c, -3e-7, 3e-7));
}

static void look_hard(struct oracle_case *c, uint32_t kind)
{
    switch (kind) {
    case 0:
        look_past(c);
        break;
    case 1:
        look_out(c);
        break;
    case 2:
        look_from_border(c);
        break;
    default:
        look_from_behind_parent(c);
    }
    c->view.eps = c->view.eps > 1e-12 ? fmin(c->view.eps, 0x1.fffffep19) : 1;
}

/* ---------------------------------------------------------------------------------------------- */

static void look_anywhere(struct oracle_case *c, uint32_t kind)
{
    double eye[3], target[3];
    place_eye(c, kind, eye);
    const double *at = some_node(c)->center;
    if (oracle_pick(c, 4) > 0)
        memcpy(target, at, sizeof target);
    else
        around(c, eye, c->tree.size, target);
    oracle_look_at(c, eye, target);
    c->view.eps = accept(c);
    if (kind == EYE_BEYOND)         /* there distances in float32 are infinite, and so must errors be */
        c->view.eps = fmax(c->view.eps, 1e-6);
}

static void start_view(struct oracle_case *c, uint32_t k)
{
    const uint64_t archive = c->seed & 0xFFFFFFFF;
    c->seed = archive | (uint64_t)k << 32;
    c->state = c->seed * 0x9E3779B97F4A7C15u;
    c->view.mode = oracle_pick(c, 3) ? SPV_HYBRID : SPV_POINTS;
    c->view.cull = false;
}

void oracle_look(struct oracle_case *c, uint32_t k)
{
    start_view(c, k);
    if (k % VIEWS < EYES)
        look_anywhere(c, k % VIEWS);
    else
        look_hard(c, k % VIEWS - EYES);
    ck_assert(c->view.eps > 0 && c->view.eps < 0x1p20);
}

void oracle_frame(struct oracle_case *c, uint32_t k)
{
    start_view(c, k);
    look_anywhere(c, EYE_FRAMED);
    c->view.eps = spv_camera_eps(&c->view.camera, log_between(c, 0.25, 16));
}

void oracle_select(struct oracle_case *c)
{
    struct spc_error err = {0};
    if (spv_select(c->reader, &c->view, &c->selection, &err) != SPC_OK)
        oracle_fail(c, "select: %s", err.what);
    memset(c->chosen, 0, c->tree.header->block_count * sizeof *c->chosen);
    for (uint32_t k = 0; k < c->selection.block_count; k++) {
        if (c->selection.blocks[k].block >= c->tree.header->block_count)
            oracle_fail(c, "block %u is chosen", c->selection.blocks[k].block);
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
                 (const char *[]){"hybrid", "points", "triangles"}[c->view.mode],
                 c->view.cull ? ", culled" : "", what);
    abort();
}
