/*
 * verify_tree.c - level 3: what holds between nodes (spec section 9).
 *
 * Walks the clusters depth first with the chain of ancestors at hand: memory grows with the
 * levels of clusters, not with the archive. Each triangle is held against the pill and the cones
 * of every node above it.
 */
#include "verify_int.h"

#include "bytes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { L3_RELATION, L3_TOPS, L3_ERRORS, L3_LINKS, L3_PILLS, L3_CONES, L3_TRIANGLES, L3_LEAVES,
       L3_LAW, L3_HEADER, L3_COUNT };
static const char *const L3_NAMES[L3_COUNT] = {
    "parent relation: every node has its parent, every cluster its owner",
    "tops in the directory are the nodes they copy",
    "errors: e_parent is the parent's e_self, e_self never grows downwards and is at least H",
    "links are long enough for decoded centres and radii, and shared where they are told once",
    "pills hold every triangle below",
    "cones hold the winding normal of every triangle below",
    "triangles: t is at least the longest edge, corners lie in the box of all vertices",
    "leaves are the disks of their triangles, in the mean colour of their corners",
    "law: every path is cut exactly once at any common q",
    "header: height, error range and box are those of the tree",
};


struct frame {                      /* one cluster on the path from the root */
    uint32_t id;
    struct spc_cluster c;
    struct spc_tree *tree;
    uint64_t *weight;               /* [node_count] sum of leaf weights below */
    uint32_t *levels;               /* [node_count] of the tree below, the node not counted */
    double *cosine;                 /* [node_count] of the node's group cone */
    uint32_t *axis;                 /* [node_count] its axis */
    uint32_t owner;                 /* node of the parent frame */
    uint32_t next;                  /* position in canonical order where the walk goes on */
    double diagonal;
};

struct verify {
    const struct spc_reader *r;
    struct spc_check *checks;
    struct frame *frames;
    uint32_t depth, depth_max;
    uint64_t *bins;                 /* [65536] the law */
    uint64_t leaf_index;
    bool hybrid;
    uint32_t height;                /* what the header should say */
    float e_min, e_max;
    double box_min[3], box_max[3];
    double scale[2];                /* their product takes file units to units */
    double axes[SPC_NORMAL_CLUSTERS_MAX][3];
};

static uint64_t hash64(uint64_t x)  /* splitmix64 */
{
    x += 0x9E3779B97F4A7C15u;
    x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9u;
    x = (x ^ x >> 27) * 0x94D049BB133111EBu;
    return x ^ x >> 31;
}

static double dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/*
 * d = a - b in units, before anything is squared: in file units a square may leave the doubles. The
 * factor itself may, too; its halves do not.
 */
static void between(const struct verify *v, const double a[3], const double b[3], double d[3])
{
    for (int i = 0; i < 3; i++)
        d[i] = (a[i] - b[i]) * v->scale[0] * v->scale[1];
}

static double distance(const struct verify *v, const double a[3], const double b[3])
{
    double d[3];
    between(v, a, b, d);
    return sqrt(dot3(d, d));
}

static void fault(struct verify *v, int check, const struct frame *f, uint32_t node,
                  const char *what)
{
    struct spc_block b;
    char text[160];
    spc_reader_block(v->r, f->tree->block_of[node], &b);
    snprintf(text, sizeof text, "%s (cluster %u, block %u, node %u)", what, f->id,
             f->tree->block_of[node], f->tree->index_in_block[node]);
    spc_check_fault(&v->checks[check], SPC_CORRUPT, b.off, text);
}

/* Parent of a node: in its frame, or the owner in the frame above. NULL for the root. */
static const struct spc_node *parent_of(const struct verify *v, uint32_t depth, uint32_t node)
{
    const struct frame *f = &v->frames[depth];
    const uint32_t parent = f->tree->parent[node];
    if (parent != SPC_PARENT_OWNER)
        return &f->tree->nodes[parent];
    return depth == 0 ? NULL : &v->frames[depth - 1].tree->nodes[f->owner];
}

/* The link of a node whose parent lies in the same block: it follows from both (spec 6.4.1). */
static double link_inside(const struct verify *v, const struct frame *f, uint32_t node,
                          const struct spc_node *n, const struct spc_node *p)
{
    struct spc_block b;
    spc_reader_block(v->r, f->tree->block_of[node], &b);
    const double more = p->radius > n->radius ? p->radius - n->radius : 0;
    const double need = (distance(v, n->center, p->center) + more +
                         (double)b.diagonal * 0x1p-20) * (1 + 0x1p-40);
    return (double)spc_link_decode(spc_link_bound(need, b.link_base), b.link_base);
}

/* Leaves of one family share their link, and so do inner nodes whose parent lies in another block. */
static enum spc_status check_families(struct verify *v, const struct frame *f,
                                      struct spc_error *err)
{
    const struct spc_tree *t = f->tree;
    double *shared = malloc(2 * ((size_t)t->inner_count + 1) * sizeof *shared);     /* by kind; tops last */
    if (shared == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to verify cluster %u", f->id);
    for (uint32_t i = 0; i < 2 * (t->inner_count + 1); i++)
        shared[i] = -1;
    for (uint32_t node = 0; node < t->node_count; node++) {
        const bool leaf = node >= t->inner_count;
        const uint32_t parent = t->parent[node];
        double *of = &shared[2 * (parent == SPC_PARENT_OWNER ? t->inner_count : parent) + leaf];
        if (!leaf && parent != SPC_PARENT_OWNER && t->block_of[node] == t->block_of[parent])
            continue;
        if (*of >= 0 && *of != t->nodes[node].link)
            fault(v, L3_LINKS, f, node, "nodes of a family that is told alone have different links");
        *of = t->nodes[node].link;
    }
    free(shared);
    return SPC_OK;
}

static void check_node(struct verify *v, uint32_t depth, uint32_t node)
{
    const struct frame *f = &v->frames[depth];
    const struct spc_node *n = &f->tree->nodes[node];
    const struct spc_node *p = parent_of(v, depth, node);
    const bool leaf = node >= f->tree->inner_count;
    if (!leaf) {
        v->e_min = fminf(v->e_min, spc_len_decode(n->e_self));
        v->e_max = fmaxf(v->e_max, spc_len_decode(n->e_self));
    }
    if (!leaf && !(v->r->header.flags & SPC_FLAG_ERROR_PAPER) &&
        (double)spc_len_decode(n->e_self) < n->height)
        fault(v, L3_ERRORS, f, node, "e_self is below H");
    if (p == NULL) {
        if (n->e_parent != SPC_LEN_ROOT)
            fault(v, L3_ERRORS, f, node, "the root has a parent's error");
        return;
    }
    if (n->e_parent != p->e_self || n->e_self > p->e_self)
        fault(v, L3_ERRORS, f, node, "e_parent is not the parent's e_self");
    const bool top = f->tree->parent[node] == SPC_PARENT_OWNER;
    const double diagonals = f->diagonal + (top ? v->frames[depth - 1].diagonal : f->diagonal);
    const double need = distance(v, n->center, p->center) + fmax(0, p->radius - n->radius) +
                        diagonals * 0x1p-21;
    if (n->link < need)
        fault(v, L3_LINKS, f, node, "a link is too short");
    if (!leaf && !top && f->tree->block_of[node] == f->tree->block_of[f->tree->parent[node]] &&
        n->link != link_inside(v, f, node, n, p))
        fault(v, L3_LINKS, f, node, "a link is not that of its two nodes");
}

/* ---- triangles ----------------------------------------------------------------------------------- */

static bool in_pill(const struct verify *v, const struct spc_node *n, const double corner[3])
{
    double d[3];
    between(v, corner, n->center, d);
    const double slack = 1 + 1e-12;     /* the check's own rounding */
    return dot3(d, d) <= n->radius * n->radius * slack &&
           fabs(dot3(d, n->normal)) <= n->height * slack + 1e-14 * n->radius;
}

struct triangle {
    uint8_t rgba[3][4];
    double corner[3][3];
    double normal[3];               /* unit winding normal; zero area: area is false */
    bool area;
};

static void check_above(struct verify *v, const struct triangle *t, uint32_t node)
{
    uint32_t depth = v->depth - 1;
    for (;;) {
        const struct frame *f = &v->frames[depth];
        const struct spc_node *n = &f->tree->nodes[node];
        for (int k = 0; k < 3; k++)
            if (!in_pill(v, n, t->corner[k]))
                fault(v, L3_PILLS, f, node, "a triangle sticks out of a pill");
        const double cosine = f->cosine[node];
        if (cosine > -1 && (!t->area || dot3(t->normal, v->axes[f->axis[node]]) < cosine - 1e-9))
            fault(v, L3_CONES, f, node, "a winding normal lies outside its cone");
        const float *cone = f->c.cone;
        const double axis[3] = {(double)cone[0], (double)cone[1], (double)cone[2]};
        if (cone[3] > -1 && (!t->area || dot3(t->normal, axis) < (double)cone[3] - 1e-6))
            fault(v, L3_CONES, f, node, "a winding normal lies outside its cluster's cone");
        if (f->tree->parent[node] != SPC_PARENT_OWNER) {
            node = f->tree->parent[node];
        } else if (depth > 0) {
            node = f->owner;
            depth--;
        } else {
            return;
        }
    }
}

static void load_triangle(const struct verify *v, const struct spc_block *b,
                          const struct spc_block_layout *l, const uint8_t *payload, uint32_t i,
                          struct triangle *t)
{
    for (uint32_t k = 0; k < 3; k++)
        spc_vertex_decode(v->r, b, l, payload, load_u16(payload + l->indices + 6 * i + 2 * k),
                          t->corner[k], t->rgba[k]);
    double e[2][3];
    between(v, t->corner[1], t->corner[0], e[0]);
    between(v, t->corner[2], t->corner[0], e[1]);
    for (int a = 0; a < 3; a++)
        t->normal[a] = e[0][(a + 1) % 3] * e[1][(a + 2) % 3] - e[0][(a + 2) % 3] * e[1][(a + 1) % 3];
    const double length = sqrt(dot3(t->normal, t->normal));
    t->area = length > 0;
    for (int a = 0; a < 3 && t->area; a++)
        t->normal[a] /= length;
}

/* All of a leaf but e_parent and link follows from the triangle (spec sections 6.3 and 6.5). */
static bool is_disk_of(const struct verify *v, const struct spc_block *b, const uint8_t *record,
                       const uint8_t *rgba, const struct triangle *t)
{
    for (int k = 0; k < 4; k++)
        if (rgba[k] != (t->rgba[0][k] + t->rgba[1][k] + t->rgba[2][k] + 1) / 3)
            return false;
    uint8_t want[ND_SIZE];
    int64_t lattice[3][3];
    const struct spc_frame frame = spc_reader_frame(v->r, b->cluster);
    for (int k = 0; k < 3; k++)
        for (int a = 0; a < 3; a++)
            lattice[k][a] = (int64_t)ldexp(t->corner[k][a], -frame.vertex_exp);
    memcpy(want, record, ND_SIZE);
    return spc_leaf_record(&frame, b->step_exp, (const int64_t(*)[3])lattice, want) &&
           memcmp(want, record, ND_SIZE) == 0;
}

static double longest_edge(const struct verify *v, const struct triangle *t)
{
    return fmax(distance(v, t->corner[0], t->corner[1]),
                fmax(distance(v, t->corner[1], t->corner[2]),
                     distance(v, t->corner[2], t->corner[0])));
}

static void widen_box(struct verify *v, const struct triangle *t)
{
    for (int i = 0; i < 9; i++) {
        const int a = i % 3;
        v->box_min[a] = fmin(v->box_min[a], t->corner[i / 3][a]);
        v->box_max[a] = fmax(v->box_max[a], t->corner[i / 3][a]);
    }
}

/* A finite box, so what lies in it is finite too, and every later comparison says something. */
static bool in_box(const struct verify *v, const struct triangle *t)
{
    const struct spc_header *h = &v->r->header;
    for (int i = 0; i < 9; i++) {
        const double x = t->corner[i / 3][i % 3];
        if (!(x >= h->box_min[i % 3] && x <= h->box_max[i % 3]))
            return false;
    }
    return true;
}

static bool every_vertex_used(const struct spc_block *b, const uint8_t *indices)
{
    uint64_t used[(SPC_BLOCK_VERTICES_MAX + 63) / 64] = {0};
    uint32_t count = 0;
    for (uint32_t i = 0; i < 3 * b->node_count; i++) {
        const uint32_t v = load_u16(indices + 2 * i);
        count += !(used[v / 64] >> v % 64 & 1);
        used[v / 64] |= (uint64_t)1 << v % 64;
    }
    return count == b->vertex_count;
}

static enum spc_status check_triangles(struct verify *v, struct spc_error *err)
{
    const struct frame *f = &v->frames[v->depth - 1];
    uint32_t node = f->tree->inner_count;
    for (uint32_t k = 0; k < f->c.block_count; k++) {
        struct spc_block b;
        struct spc_block_layout l;
        spc_reader_block(v->r, f->c.block_first + k, &b);
        if (b.kind != SPC_BLOCK_LEAF)
            continue;
        spc_block_layout(&b, v->r->header.flags, v->r->header.normal_clusters, &l);
        uint8_t *payload = malloc(l.bytes);
        if (payload == NULL)
            return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a block");
        enum spc_status status =
            spc_block_decode(v->r, f->c.block_first + k, false, payload, err);
        if (status == SPC_OK && !every_vertex_used(&b, payload + l.indices))
            fault(v, L3_TRIANGLES, f, node, "a block holds a vertex that none of its triangles uses");
        for (uint32_t i = 0; i < b.node_count && status == SPC_OK; i++, node++) {
            struct triangle t;
            load_triangle(v, &b, &l, payload, i, &t);
            if (!in_box(v, &t)) {
                fault(v, L3_TRIANGLES, f, node, "a vertex lies outside the box of all vertices");
                continue;
            }
            if (f->tree->nodes[node].e_self < spc_len_encode_up(longest_edge(v, &t)))
                fault(v, L3_TRIANGLES, f, node, "t is below the longest edge");
            if (!is_disk_of(v, &b, payload + l.nodes + (size_t)ND_SIZE * i,
                            f->tree->nodes[node].rgba, &t))
                fault(v, L3_LEAVES, f, node, "a leaf is not the disk of its triangle");
            widen_box(v, &t);
            check_above(v, &t, node);
        }
        free(payload);
        if (status != SPC_OK)
            return status;
    }
    return SPC_OK;
}

/* ---- the walk ------------------------------------------------------------------------------------ */

static enum spc_status load_cones(struct verify *v, struct frame *f, struct spc_error *err)
{
    const uint32_t groups = v->r->header.normal_clusters;
    uint32_t next[2] = {0, f->tree->inner_count};
    for (uint32_t k = 0; k < f->c.block_count; k++) {
        struct spc_block b;
        struct spc_block_layout l;
        spc_reader_block(v->r, f->c.block_first + k, &b);
        spc_block_layout(&b, v->r->header.flags, groups, &l);
        uint8_t *payload = malloc(l.bytes);
        if (payload == NULL)
            return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a block");
        const enum spc_status status =
            spc_block_decode(v->r, f->c.block_first + k, false, payload, err);
        for (uint32_t g = 0; g < groups && status == SPC_OK; g++) {
            const uint8_t *group = payload + l.groups + 4 * g;
            for (uint32_t i = load_u16(group); i > 0; i--) {
                f->axis[next[b.kind]] = g;
                f->cosine[next[b.kind]++] = (int16_t)load_u16(group + 2) / 32767.0;
            }
        }
        free(payload);
        if (status != SPC_OK)
            return status;
    }
    return SPC_OK;
}

static void frame_release(struct frame *f)
{
    spc_tree_free(f->tree);
    free(f->weight);
    free(f->levels);
    free(f->cosine);
    free(f->axis);
    *f = (struct frame){0};
}

/* The family without a parent is what the directory says it is. */
static void check_tops(struct verify *v, const struct frame *f)
{
    const struct spc_tree *t = f->tree;
    uint32_t inner = 0;
    for (uint32_t k = 0; k < f->c.top_count; k++)
        inner += !f->c.tops_are_leaf[k];
    for (uint32_t k = 0; k < f->c.top_count; k++) {
        const uint32_t node = t->order[k];
        struct spc_node top;
        spc_top_decode(v->r, &f->c, k, &top);
        const struct spc_node *n = &t->nodes[node];
        const bool same = memcmp(top.center, n->center, sizeof top.center) == 0 &&
                          top.normal_code == n->normal_code && top.radius == n->radius &&
                          top.height == n->height && top.link == n->link &&
                          top.e_self == n->e_self && top.e_parent == n->e_parent &&
                          memcmp(top.rgba, n->rgba, 4) == 0 &&
                          f->c.tops_are_leaf[k] == (k >= inner) &&
                          (node >= t->inner_count) == (k >= inner);
        if (!same)
            fault(v, L3_TOPS, f, node, "a top is not the node it copies");
    }
}

static enum spc_status enter(struct verify *v, uint32_t id, uint32_t owner, struct spc_error *err)
{
    if (v->depth == v->depth_max) {
        const uint32_t grown = v->depth_max ? 2 * v->depth_max : 16;
        struct frame *frames = realloc(v->frames, grown * sizeof *frames);
        if (frames == NULL)
            return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to verify");
        v->frames = frames;
        v->depth_max = grown;
    }
    struct frame *f = &v->frames[v->depth];
    *f = (struct frame){.id = id, .owner = owner};
    spc_reader_cluster(v->r, id, &f->c);
    struct spc_error error = {0};
    enum spc_status status = spc_tree_load(v->r, id, &f->tree, &error);
    if (status == SPC_CORRUPT || status == SPC_CHECKSUM) {
        spc_check_fault(&v->checks[L3_RELATION], status, error.at_off, error.what);
        return SPC_CORRUPT;
    }
    if (status != SPC_OK)
        return spc_fail(err, status, error.at_off, "%s", error.what);
    v->depth++;
    f->weight = calloc(f->tree->node_count, sizeof *f->weight);
    f->levels = calloc(f->tree->node_count, sizeof *f->levels);
    f->cosine = calloc(f->tree->node_count, sizeof *f->cosine);
    f->axis = calloc(f->tree->node_count, sizeof *f->axis);
    if (f->weight == NULL || f->levels == NULL || f->cosine == NULL || f->axis == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to verify cluster %u", id);
    double d2 = 0;
    for (int a = 0; a < 3; a++) {
        const double side = (double)f->c.box[a + 3] - (double)f->c.box[a];
        d2 += side * side;
    }
    f->diagonal = sqrt(d2);
    status = load_cones(v, f, err);
    if (status != SPC_OK)
        return status;
    check_tops(v, f);
    status = check_families(v, f, err);
    if (status != SPC_OK)
        return status;
    for (uint32_t n = 0; n < f->tree->node_count; n++)
        check_node(v, v->depth - 1, n);
    return v->hybrid ? check_triangles(v, err) : SPC_OK;
}

/* Weights and levels of a finished cluster, bottom-up, into the law's bins and the owner above. */
static void leave(struct verify *v)
{
    struct frame *f = &v->frames[v->depth - 1];
    const struct spc_tree *t = f->tree;
    uint64_t tops = 0;
    uint32_t levels = 0;
    for (uint32_t i = t->node_count; i-- > 0;) {
        const uint32_t node = t->order[i];
        const struct spc_node *n = &t->nodes[node];
        const bool leaf = node >= t->inner_count;
        if (leaf)
            f->weight[node] = hash64(v->leaf_index++);
        const uint64_t w = f->weight[node];
        v->bins[leaf ? SPC_LEN_ZERO : n->e_self] += w;  /* a triangle's 0 and t cancel the leaf's t */
        v->bins[n->e_parent] -= w;
        const bool top = t->parent[node] == SPC_PARENT_OWNER;
        uint32_t *above = top ? &levels : &f->levels[t->parent[node]];
        *above = f->levels[node] + 1 > *above ? f->levels[node] + 1 : *above;
        if (top)
            tops += w;
        else
            f->weight[t->parent[node]] += w;
    }
    if (v->depth > 1) {
        v->frames[v->depth - 2].weight[f->owner] = tops;
        v->frames[v->depth - 2].levels[f->owner] = levels;
    } else {
        v->height = levels;
    }
    frame_release(f);
    v->depth--;
}

static enum spc_status walk(struct verify *v, struct spc_error *err)
{
    enum spc_status status = enter(v, 0, 0, err);
    while (status == SPC_OK && v->depth > 0) {
        struct frame *f = &v->frames[v->depth - 1];
        const struct spc_tree *t = f->tree;
        while (f->next < t->node_count &&
               (t->order[f->next] >= t->inner_count ||
                t->child_cluster[t->order[f->next]] == SPC_NO_CHILD_CLUSTER))
            f->next++;
        if (f->next == t->node_count) {
            leave(v);
        } else {
            const uint32_t owner = t->order[f->next++];
            status = enter(v, t->child_cluster[owner], owner, err);
        }
    }
    return status;
}

static void check_law(struct verify *v)
{
    for (uint32_t code = 1; code < 65536; code++)
        if (code != SPC_LEN_ROOT && v->bins[code] != 0) {
            char text[100];
            snprintf(text, sizeof text, "paths are cut twice or never at error code %u", code);
            spc_check_fault(&v->checks[L3_LAW], SPC_CORRUPT, SPC_NO_OFF, text);
        }
    if (v->bins[SPC_LEN_ZERO] + v->bins[SPC_LEN_ROOT] != 0 ||
        v->leaf_index != v->r->header.leaf_count)
        spc_check_fault(&v->checks[L3_LAW], SPC_CORRUPT, SPC_NO_OFF, "paths are lost");
}

static void check_header(struct verify *v)
{
    const struct spc_header *h = &v->r->header;
    const bool inner = h->node_count > h->leaf_count;
    struct spc_check *check = &v->checks[L3_HEADER];
    if (h->height != v->height)
        spc_check_fault(check, SPC_CORRUPT, HD_HEIGHT, "the tree has another height");
    if (h->e_min != (inner ? v->e_min : 0) || h->e_max != v->e_max)
        spc_check_fault(check, SPC_CORRUPT, HD_E_MIN, "the errors of inner nodes span another range");
    for (int a = 0; a < 3 && v->hybrid; a++)
        if (h->box_min[a] != v->box_min[a] || h->box_max[a] != v->box_max[a])
            spc_check_fault(check, SPC_CORRUPT, HD_BOX, "the vertices span another box");
}

enum spc_status spc_verify_tree(const struct spc_reader *reader, spc_finding_fn fn, void *ctx,
                                struct spc_error *total, struct spc_error *err)
{
    struct spc_check checks[L3_COUNT];
    struct verify v = {.r = reader, .checks = checks,
                       .hybrid = (reader->header.flags & SPC_FLAG_TRIANGLES) != 0,
                       .e_min = HUGE_VALF,
                       .box_min = {HUGE_VAL, HUGE_VAL, HUGE_VAL},
                       .box_max = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}};
    for (int i = 0; i < L3_COUNT; i++) {
        spc_check_begin(&checks[i], fn, ctx, L3_NAMES[i]);
        checks[i].total = total;
    }
    for (uint32_t k = 0; k < reader->header.normal_clusters; k++)
        spc_reader_axis(reader, k, v.axes[k]);
    const int half = reader->header.unit_exp / 2;
    v.scale[0] = ldexp(1, -half);
    v.scale[1] = ldexp(1, half - reader->header.unit_exp);
    v.bins = calloc(65536, sizeof *v.bins);
    enum spc_status status = SPC_OK;
    if (v.bins == NULL)
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to verify");
    if (status == SPC_OK)
        status = walk(&v, err);
    if (status == SPC_OK) {
        check_law(&v);
        check_header(&v);
    }
    if (total->status != SPC_OK)
        status = SPC_OK;            /* a broken archive is a finding, not a failure to verify */
    for (int i = 0; i < L3_COUNT && status == SPC_OK; i++)
        spc_check_end(&checks[i]);
    while (v.depth > 0)
        frame_release(&v.frames[--v.depth]);
    free(v.frames);
    free(v.bins);
    return status;
}
