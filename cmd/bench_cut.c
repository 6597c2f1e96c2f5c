#include "bench_cut.h"

#include "bench_trade.h"
#include "interval.h"

#include <math.h>
#include <stdlib.h>

struct frustum {
    double plane[5][3];             /* inward normals of length 1, through the eye */
};

static struct frustum frustum_of(const struct spv_camera *c)
{
    struct frustum f;
    const double x = c->width / 2.0 / c->focal_px, y = c->height / 2.0 / c->focal_px;
    const double lx = 1 / hypot(1, x), ly = 1 / hypot(1, y);
    for (int a = 0; a < 3; a++) {
        f.plane[0][a] = (c->forward[a] * x + c->right[a]) * lx;
        f.plane[1][a] = (c->forward[a] * x - c->right[a]) * lx;
        f.plane[2][a] = (c->forward[a] * y + c->up[a]) * ly;
        f.plane[3][a] = (c->forward[a] * y - c->up[a]) * ly;
        f.plane[4][a] = c->forward[a];
    }
    return f;
}

/* center: from the eye. Outside the planes it may still touch, near an edge of the pyramid: told as touching. */
static bool touches(const struct frustum *f, const double center[3], double radius)
{
    for (int p = 0; p < 5; p++) {
        double d = 0;
        for (int a = 0; a < 3; a++)
            d += f->plane[p][a] * center[a];
        if (d < -radius)
            return false;
    }
    return true;
}

/* ---- the frame's own ---------------------------------------------------------------------------- */

struct counting {
    const struct spc_reader *reader;
    const struct spc_header *header;
    const struct spv_view *view;
    struct frustum frustum;
    struct bench_cut *out;
};

static bool record_touches(const struct counting *k, const struct spv_interval *in, const uint8_t *record)
{
    const double step = (double)in->step;
    const double center[3] = {(double)in->origin[0] + load_u16(record + ND_X) * step,
                              (double)in->origin[1] + load_u16(record + ND_Y) * step,
                              (double)in->origin[2] + load_u16(record + ND_Z) * step};
    return touches(&k->frustum, center, (double)spc_len_decode(load_u16(record + ND_RADIUS)));
}

static void count_block(struct counting *k, const struct spc_block *b, const double eye[3], const uint8_t *nodes,
                        const struct spv_ranges *ranges)
{
    const enum spv_mode mode = k->view->mode;
    const bool leaf = b->kind == SPC_BLOCK_LEAF;
    const bool triangles = leaf && (k->header->flags & SPC_FLAG_TRIANGLES) && mode != SPV_POINTS;
    const struct spv_interval in = {
        .origin = {(float)-eye[0], (float)-eye[1], (float)-eye[2]},
        .step = ldexpf(1, b->step_exp - k->header->unit_exp),
        .eps = (float)k->view->eps, .link_base = b->link_base, .lower = !leaf || triangles, .missing = -1,
    };
    const double bytes = (double)spc_block_chunk_bytes(b) / b->node_count;
    k->out->processed += b->node_count;
    k->out->bytes += spc_block_chunk_bytes(b);
    for (uint32_t r = 0; r < ranges->count; r++)
        for (int i = ranges->first[r]; i < ranges->first[r] + ranges->nodes[r]; i++) {
            const uint8_t *record = nodes + SPC_NODE_BYTES * (size_t)i;
            const bool point = mode != SPV_TRIANGLES && spv_interval_point(&in, record);
            const bool triangle = triangles && (mode == SPV_TRIANGLES || spv_interval_triangle(&in, record));
            const unsigned drawn = (unsigned)point + triangle;
            k->out->nodes += point;
            k->out->triangles += triangle;
            if (drawn == 0 || !record_touches(k, &in, record))
                continue;
            k->out->exact += drawn;
            k->out->exact_bytes += bytes;
        }
}

enum spc_status bench_cut_count(const struct spc_reader *reader, const struct spv_view *view,
                                const struct spv_selection *selection, struct bench_cut *out, struct spc_error *err)
{
    struct counting k = {.reader = reader, .header = spc_reader_header(reader), .view = view,
                         .frustum = frustum_of(&view->camera), .out = out};
    enum spc_status status = SPC_OK;
    *out = (struct bench_cut){0};
    for (uint32_t i = 0; i < selection->block_count && status == SPC_OK; i++) {
        struct spc_block b;
        struct spc_cluster c;
        struct spc_block_layout l;
        struct spv_ranges ranges;
        double eye[3];
        spc_reader_block(reader, selection->blocks[i].block, &b);
        spc_reader_cluster(reader, b.cluster, &c);
        spv_eye_of_cluster(reader, &c, &view->camera, eye);
        spc_block_layout(&b, k.header->flags, k.header->normal_clusters, &l);
        uint8_t *payload = malloc(l.bytes);
        if (payload == NULL)
            return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to decode a block");
        status = spc_block_decode(reader, selection->blocks[i].block, false, payload, err);
        if (status == SPC_OK) {
            spv_visible_ranges(reader, view, &b, &c, eye, payload + l.groups, &ranges);
            count_block(&k, &b, eye, payload + l.nodes, &ranges);
        }
        free(payload);
    }
    return status;
}

/* ---- one cluster -------------------------------------------------------------------------------- */

void bench_cut_one_cluster(const struct spc_reader *reader, const struct bench_paths *paths,
                           const struct spv_view *view, struct bench_cut *out)
{
    const struct spc_header *h = spc_reader_header(reader);
    double square = 0;
    for (int a = 0; a < 3; a++) {
        const double eye = view->camera.eye[a];
        const double off = fmax(0, fmax(h->box_min[a] - eye, eye - h->box_max[a]));
        square += off * off;
    }
    const double least = view->eps * ldexp(sqrt(square), -h->unit_exp);
    *out = (struct bench_cut){0};
    for (uint32_t code = 0; code <= SPC_LEN_ROOT; code++)
        if ((double)spc_len_decode((uint16_t)code) >= least)
            out->processed += paths->parents[code];
    out->bytes = (uint64_t)((double)out->processed / (double)h->node_count * (double)(h->file_bytes - h->head_bytes));
}

/* ---- traversal ---------------------------------------------------------------------------------- */

/* Which accuracies, by bit, come to a node, or go on to its children; of each view. */
struct marks {
    uint16_t of[BENCH_VIEWS];
};

struct traversal {
    const struct spc_header *header;
    const struct bench_view *views;
    uint32_t view_count, eps_count;
    struct frustum frustum[BENCH_VIEWS];
    double eps[BENCH_VIEWS][BENCH_EPS_MAX];
    struct bench_cut *out;
};

/* Visits a node in one view; returns the accuracies that go on. */
static uint16_t visit(const struct traversal *t, uint32_t v, const struct spc_node *n, bool leaf, uint16_t come)
{
    const double unit = ldexp(1, t->header->unit_exp);
    const double error = (double)spc_len_decode(n->e_self) * unit;
    double center[3], square = 0;
    uint16_t on = 0;
    for (int a = 0; a < 3; a++) {
        center[a] = n->center[a] - t->views[v].camera.eye[a];
        square += center[a] * center[a];
    }
    const bool seen = touches(&t->frustum[v], center, n->radius * unit);
    const double rho = sqrt(square) - n->radius * unit;
    for (uint32_t e = 0; e < t->eps_count; e++) {
        struct bench_cut *out = &t->out[v * t->eps_count + e];
        if (!(come >> e & 1))
            continue;
        out->processed++;
        if (!seen)
            continue;
        const bool fine = error < t->eps[v][e] * rho;
        const bool triangle = leaf && !fine && (t->header->flags & SPC_FLAG_TRIANGLES);
        out->triangles += triangle;
        out->nodes += (fine || leaf) && !triangle;
        if (!fine && !leaf)
            on = (uint16_t)(on | 1u << e);
    }
    return on;
}

static void traverse_cluster(const struct traversal *t, const struct spc_tree *tree, uint32_t cluster,
                             struct marks *at_cluster, struct marks *marks)
{
    for (uint32_t k = 0; k < tree->node_count; k++) {
        const uint32_t i = tree->order[k], parent = tree->parent[i];
        const struct marks *come = parent == SPC_PARENT_OWNER ? &at_cluster[cluster] : &marks[parent];
        for (uint32_t v = 0; v < t->view_count; v++)
            marks[i].of[v] = come->of[v] == 0 ? 0
                                              : visit(t, v, &tree->nodes[i], i >= tree->inner_count, come->of[v]);
        if (i < tree->inner_count && tree->child_cluster[i] != SPC_NO_CHILD_CLUSTER)
            at_cluster[tree->child_cluster[i]] = marks[i];
    }
}

static bool any(const struct marks *m)
{
    for (uint32_t v = 0; v < BENCH_VIEWS; v++)
        if (m->of[v] != 0)
            return true;
    return false;
}

static enum spc_status traverse(const struct traversal *t, const struct spc_reader *reader, uint32_t cluster,
                                struct marks *at_cluster, struct spc_error *err)
{
    struct spc_tree *tree = NULL;
    enum spc_status status = bench_tell("traverse", cluster, t->header->cluster_count, err);
    if (status != SPC_OK || !any(&at_cluster[cluster]))
        return status;
    status = spc_tree_load(reader, cluster, &tree, err);
    struct marks *marks = status == SPC_OK ? calloc(tree->node_count + (size_t)1, sizeof *marks) : NULL;
    if (status == SPC_OK && marks == NULL)
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to go through the tree");
    if (status == SPC_OK)
        traverse_cluster(t, tree, cluster, at_cluster, marks);
    free(marks);
    spc_tree_free(tree);
    return status;
}

enum spc_status bench_cut_traversal(const struct spc_reader *reader, const struct bench_view *views, uint32_t count,
                                    const double *eps_px, uint32_t eps_count, struct bench_cut *out,
                                    struct spc_error *err)
{
    struct traversal t = {.header = spc_reader_header(reader), .views = views, .view_count = count,
                          .eps_count = eps_count, .out = out};
    struct marks *at_cluster = calloc(t.header->cluster_count, sizeof *at_cluster);
    enum spc_status status = SPC_OK;
    if (at_cluster == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to go through the tree");
    memset(out, 0, (size_t)count * eps_count * sizeof *out);
    for (uint32_t v = 0; v < count; v++) {
        t.frustum[v] = frustum_of(&views[v].camera);
        at_cluster[0].of[v] = (uint16_t)((1u << eps_count) - 1);
        for (uint32_t e = 0; e < eps_count; e++)
            t.eps[v][e] = spv_camera_eps(&views[v].camera, eps_px[e]);
    }
    for (uint32_t k = 0; k < t.header->cluster_count && status == SPC_OK; k++)
        status = traverse(&t, reader, k, at_cluster, err);
    free(at_cluster);
    return status;
}
