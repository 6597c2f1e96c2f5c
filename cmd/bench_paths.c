/*
 * bench_paths.c - samples of the surface and what stands for them.
 *
 * Memory is that of one cluster, the sampled leaves, and the nodes above them and above the clusters, each once.
 */
#include "bench_paths.h"

#include "bytes.h"
#include "bench_trade.h"

#include <math.h>
#include <stdlib.h>

struct reading {
    const struct spc_reader *reader;
    const struct spc_header *header;
    struct bench_paths *out;
    uint32_t *owner;                /* [cluster_count] node above a cluster, SPC_NONE: not known, or none */
    uint64_t step, seen;            /* every step-th leaf is taken; of all clusters so far */
    /* of the cluster in hand */
    uint32_t cluster;
    struct spc_tree *tree;
    uint32_t *kept;                 /* [tree->node_count] number in out->nodes, or SPC_NONE */
};

static enum spc_status no_memory(struct spc_error *err)
{
    return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for samples of the surface");
}

/* ---- nodes -------------------------------------------------------------------------------------- */

static enum spc_status push(struct reading *r, uint32_t i, struct spc_error *err)
{
    struct bench_paths *p = r->out;
    const struct spc_node *n = &r->tree->nodes[i];
    const double unit = ldexp(1, r->header->unit_exp);
    if (p->node_count == p->node_max) {
        const uint32_t grown = p->node_max ? 2 * p->node_max : 4096;
        struct bench_path_node *nodes = grown > p->node_max ? realloc(p->nodes, grown * sizeof *nodes) : NULL;
        if (nodes == NULL)
            return no_memory(err);
        p->nodes = nodes;
        p->node_max = grown;
    }
    const uint32_t parent = r->tree->parent[i];
    struct bench_path_node *out = &p->nodes[p->node_count];
    *out = (struct bench_path_node){
        .radius = n->radius * unit, .e_self = (double)spc_len_decode(n->e_self) * unit,
        .e_parent = (double)spc_len_decode(n->e_parent) * unit, .link = n->link * unit,
        .parent = parent == SPC_PARENT_OWNER ? r->owner[r->cluster] : r->kept[parent]};
    memcpy(out->center, n->center, sizeof out->center);
    memcpy(out->normal, n->normal, sizeof out->normal);
    r->kept[i] = p->node_count++;
    return SPC_OK;
}

/* Node i of the cluster and all above it, the uppermost first. */
static enum spc_status keep(struct reading *r, uint32_t i, struct spc_error *err)
{
    while (r->kept[i] == SPC_NONE) {
        uint32_t top = i;
        while (r->tree->parent[top] != SPC_PARENT_OWNER && r->kept[r->tree->parent[top]] == SPC_NONE)
            top = r->tree->parent[top];
        const enum spc_status status = push(r, top, err);
        if (status != SPC_OK)
            return status;
    }
    return SPC_OK;
}

/* ---- leaves ------------------------------------------------------------------------------------- */

static void put_points(double corner[3][3], struct bench_leaf *leaf)
{
    for (int a = 0; a < 3; a++)
        for (int k = 0; k < 3; k++) {
            leaf->point[k][a] = corner[k][a];
            leaf->point[3 + k][a] = corner[k][a] / 2 + corner[(k + 1) % 3][a] / 2;
            leaf->point[6][a] += corner[k][a] / 3;
        }
}

/* The points of the leaves first..end-1, which lie in one block. */
static enum spc_status read_triangles(struct reading *r, const uint32_t *node_of, uint32_t first, uint32_t end,
                                      struct spc_error *err)
{
    struct spc_block b;
    struct spc_block_layout l;
    const uint32_t block = r->tree->block_of[node_of[first]];
    spc_reader_block(r->reader, block, &b);
    spc_block_layout(&b, r->header->flags, r->header->normal_clusters, &l);
    uint8_t *payload = malloc(l.bytes);
    enum spc_status status = payload != NULL ? spc_block_decode(r->reader, block, false, payload, err) : no_memory(err);
    for (uint32_t k = first; k < end && status == SPC_OK; k++) {
        const uint32_t i = r->tree->index_in_block[node_of[k]];
        double corner[3][3];
        for (uint32_t c = 0; c < 3; c++) {
            const uint32_t vertex = load_u16(payload + l.indices + 6 * i + 2 * c);
            spc_vertex_decode(r->reader, &b, &l, payload, vertex, corner[c], NULL);
        }
        put_points(corner, &r->out->leaves[k]);
    }
    free(payload);
    return status;
}

/* node_of: where to note the nodes, by leaf. */
static enum spc_status take_leaves(struct reading *r, uint32_t *node_of, struct spc_error *err)
{
    struct bench_paths *p = r->out;
    const struct spc_tree *t = r->tree;
    const bool triangles = r->header->flags & SPC_FLAG_TRIANGLES;
    const uint32_t before = p->leaf_count;
    enum spc_status status = SPC_OK;
    for (uint32_t i = t->inner_count; i < t->node_count && status == SPC_OK; i++, r->seen++) {
        if (r->seen % r->step != 0)
            continue;
        status = keep(r, i, err);
        struct bench_leaf *leaf = &p->leaves[p->leaf_count];
        *leaf = (struct bench_leaf){.node = r->kept[i]};
        memcpy(leaf->point[0], t->nodes[i].center, sizeof leaf->point[0]);
        node_of[p->leaf_count++] = i;
    }
    for (uint32_t k = before, end; k < p->leaf_count && status == SPC_OK && triangles; k = end) {
        for (end = k + 1; end < p->leaf_count && t->block_of[node_of[end]] == t->block_of[node_of[k]]; end++)
            ;
        status = read_triangles(r, node_of, k, end, err);
    }
    return status;
}

static enum spc_status read_cluster(struct reading *r, uint32_t *node_of, struct spc_error *err)
{
    const struct spc_tree *t = r->tree;
    r->kept = malloc((t->node_count + (size_t)1) * sizeof *r->kept);
    if (r->kept == NULL)
        return no_memory(err);
    for (uint32_t i = 0; i < t->node_count; i++) {
        r->kept[i] = SPC_NONE;
        r->out->parents[t->nodes[i].e_parent]++;
    }
    enum spc_status status = take_leaves(r, node_of, err);
    for (uint32_t i = 0; i < t->inner_count && status == SPC_OK; i++) {
        const uint32_t child = t->child_cluster[i];
        if (child == SPC_NO_CHILD_CLUSTER)
            continue;
        if (child <= r->cluster || child >= r->header->cluster_count)
            return spc_fail(err, SPC_CORRUPT, SPC_NO_OFF, "cluster %u lies below a later one", child);
        status = keep(r, i, err);
        r->owner[child] = r->kept[i];
    }
    free(r->kept);
    r->kept = NULL;
    return status;
}

enum spc_status bench_paths_read(const struct spc_reader *reader, struct bench_paths *out, struct spc_error *err)
{
    const struct spc_header *h = spc_reader_header(reader);
    struct reading r = {.reader = reader, .header = h, .out = out, .step = (h->leaf_count - 1) / BENCH_LEAVES + 1};
    const size_t leaves = (size_t)((h->leaf_count - 1) / r.step + 1);
    *out = (struct bench_paths){.point_count = h->flags & SPC_FLAG_TRIANGLES ? BENCH_LEAF_POINTS : 1};
    out->leaves = malloc(leaves * sizeof *out->leaves);
    uint32_t *node_of = malloc(leaves * sizeof *node_of);
    r.owner = malloc(h->cluster_count * sizeof *r.owner);
    enum spc_status status = out->leaves && node_of && r.owner ? SPC_OK : no_memory(err);
    for (uint32_t k = 0; k < h->cluster_count && status == SPC_OK; k++)
        r.owner[k] = SPC_NONE;
    for (uint32_t k = 0; k < h->cluster_count && status == SPC_OK; k++) {
        r.cluster = k;
        status = bench_tell("sample", k, h->cluster_count, err);
        if (status == SPC_OK)
            status = spc_tree_load(reader, k, &r.tree, err);
        if (status == SPC_OK)
            status = read_cluster(&r, node_of, err);
        spc_tree_free(r.tree);
        free(r.kept);
        r.tree = NULL;
        r.kept = NULL;
    }
    free(r.owner);
    free(node_of);
    return status;
}

void bench_paths_release(struct bench_paths *p)
{
    free(p->nodes);
    free(p->leaves);
    p->nodes = NULL;
    p->leaves = NULL;
}

double (*bench_paths_points(const struct bench_paths *p))[3]
{
    double (*points)[3] = malloc((p->leaf_count + (size_t)1) * sizeof *points);
    for (uint32_t k = 0; k < p->leaf_count && points != NULL; k++)
        memcpy(points[k], p->leaves[k].point[p->point_count - 1], sizeof *points);
    return points;
}

/* ---- measuring ---------------------------------------------------------------------------------- */

static double distance(const double a[3], const double b[3])
{
    double sum = 0;
    for (int k = 0; k < 3; k++)
        sum += (a[k] - b[k]) * (a[k] - b[k]);
    return sqrt(sum);
}

/* To the flat disk: what lies over it is as far as its plane, what lies beside it as far as its rim. */
static double from_disk(const struct bench_path_node *n, const double p[3])
{
    double over = 0, square = 0;
    for (int a = 0; a < 3; a++) {
        over += (p[a] - n->center[a]) * n->normal[a];
        square += (p[a] - n->center[a]) * (p[a] - n->center[a]);
    }
    const double beside = sqrt(fmax(0, square - over * over)) - n->radius;
    return beside > 0 ? hypot(over, beside) : fabs(over);
}

static bool in_picture(const struct spv_camera *c, const double p[3])
{
    double at[3] = {0, 0, 0};
    for (int a = 0; a < 3; a++) {
        at[0] += (p[a] - c->eye[a]) * c->right[a];
        at[1] += (p[a] - c->eye[a]) * c->up[a];
        at[2] += (p[a] - c->eye[a]) * c->forward[a];
    }
    return at[2] > 0 && fabs(at[0]) * c->focal_px <= at[2] * c->width / 2 &&
           fabs(at[1]) * c->focal_px <= at[2] * c->height / 2;
}

struct measure {
    const struct bench_paths *paths;
    const struct spv_view *view;
    bool triangles;                 /* are drawn for leaves that are near */
    double *found;                  /* px, of each point */
};

/* The tests of I1, I4 and I6 in doubles: which of a leaf's path is drawn. Returns how much is. */
static uint32_t drawn_for(const struct measure *m, uint32_t leaf, bool *as_triangle,
                          const struct bench_path_node *disks[64])
{
    uint32_t count = 0;
    *as_triangle = m->view->mode == SPV_TRIANGLES;
    for (uint32_t i = leaf; i != SPC_NONE && m->view->mode != SPV_TRIANGLES; i = m->paths->nodes[i].parent) {
        const struct bench_path_node *n = &m->paths->nodes[i];
        const double q = m->view->eps * (distance(n->center, m->view->camera.eye) - n->radius);
        const bool lower = (i == leaf && !m->triangles) || n->e_self < q;
        const bool upper = isinf(n->e_parent) || q * (1 - 0x1p-20) <= n->e_parent + m->view->eps * n->link;
        *as_triangle |= i == leaf && m->triangles && q <= n->e_self;
        if (lower && upper && count < 64)
            disks[count++] = n;
    }
    return count + *as_triangle;
}

static void measure_leaf(const struct measure *m, const struct bench_leaf *leaf, uint64_t *seen, uint64_t *twice,
                         struct bench_distance *out)
{
    const struct spv_camera *c = &m->view->camera;
    const double x = c->width / (2 * c->focal_px), y = c->height / (2 * c->focal_px);
    const double px = c->focal_px * (1 + x * x + y * y);        /* of an angle, as spv_camera_eps has it */
    const struct bench_path_node *disks[64];
    bool triangle, inside = false;
    const uint32_t drawn = drawn_for(m, leaf->node, &triangle, disks);
    for (uint32_t k = 0; k < m->paths->point_count; k++) {
        const double *p = leaf->point[k];
        double worst = 0;
        if (!in_picture(c, p))
            continue;
        inside = true;
        for (uint32_t i = 0; i < drawn - triangle; i++)
            worst = fmax(worst, from_disk(disks[i], p));
        m->found[out->points++] = px * worst / distance(p, c->eye);
    }
    *seen += inside;
    *twice += inside && drawn > 1;
    out->missed += inside && drawn == 0;
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

enum spc_status bench_paths_measure(const struct bench_paths *paths, const struct spv_view *view, bool triangles,
                                    struct bench_distance *out, struct spc_error *err)
{
    const size_t most = (size_t)paths->leaf_count * paths->point_count;
    struct measure m = {.paths = paths, .view = view, .triangles = triangles && view->mode != SPV_POINTS};
    uint64_t seen = 0, twice = 0;
    *out = (struct bench_distance){0};
    m.found = malloc((most + 1) * sizeof *m.found);
    if (m.found == NULL)
        return no_memory(err);
    for (uint32_t k = 0; k < paths->leaf_count; k++)
        measure_leaf(&m, &paths->leaves[k], &seen, &twice, out);
    qsort(m.found, out->points, sizeof *m.found, by_size);
    for (uint64_t k = 0; k < out->points; k++)
        out->mean += m.found[k] / (double)out->points;
    if (out->points > 0) {
        out->max = m.found[out->points - 1];
        out->p999 = m.found[(out->points - 1) * 999 / 1000];
        out->doubles = (double)twice / (double)seen;
    }
    free(m.found);
    return SPC_OK;
}
