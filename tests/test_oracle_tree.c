#include "mesh_case.h"
#include "oracle_case.h"
#include "suite.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/*
 * What the values of an archive promise (spec sections 4, 8 and 11), computed from all decoded
 * nodes and triangles of the joined tree; verification is not asked.
 */

static void *get(size_t n, size_t size)
{
    void *p = calloc(n + 1, size);
    ck_assert_ptr_nonnull(p);
    return p;
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* ---- the tree -------------------------------------------------------------------------------- */

static void law(struct oracle_case *c)
{
    uint64_t *weight = get(c->tree.node_count, sizeof *weight);
    uint64_t *bin = get(0x10000, sizeof *bin), total = 0;
    for (uint32_t i = c->tree.node_count; i-- > 0;) {
        const struct oracle_node *n = &c->tree.nodes[i];
        if (n->leaf) {
            weight[i] = (uint64_t)(case_random(&c->state) * 0x1p53) * 0x9E3779B97F4A7C15u;
            total += weight[i];
            bin[0] += weight[i];    /* its triangle */
            bin[n->code_self] -= weight[i];
        }
        bin[n->code_self] += weight[i];
        bin[n->code_parent] -= weight[i];
        if (n->parent != SPC_NONE)
            weight[n->parent] += weight[i];
    }
    for (uint32_t k = 0; k < 0x10000; k++)
        if (bin[k] != (k == 0 ? total : k == SPC_LEN_ROOT ? 0 - total : 0))
            oracle_fail(c, "bin %#x holds a weight", k);
    free(weight);
    free(bin);
}

START_TEST(random_weights_cancel_in_every_bin_between_leaves_and_root)
{
    oracle_each(law);
}
END_TEST

static void assert_in_pill(const struct oracle_case *c, uint32_t leaf, uint32_t above)
{
    const struct oracle_node *n = &c->tree.nodes[above];
    for (int v = 0; v < 3; v++) {
        double d[3];
        for (int a = 0; a < 3; a++)
            d[a] = ldexp(c->tree.corner[c->tree.nodes[leaf].triangle][v][a] - n->center[a],
                         -c->tree.header->unit_exp);
        const double off = 1e-13 * n->radius;
        if (sqrt(dot(d, d)) > n->radius + off)
            oracle_fail(c, "corner %d of leaf %u lies outside the ball of node %u", v, leaf, above);
        if (fabs(dot(d, n->normal)) > n->height + off)
            oracle_fail(c, "corner %d of leaf %u lies outside the slab of node %u", v, leaf, above);
    }
}

static double diagonal(const struct spc_cluster *k)
{
    double d2 = 0;
    for (int a = 0; a < 3; a++) {
        const double d = (double)k->box[a + 3] - (double)k->box[a];
        d2 += d * d;
    }
    return sqrt(d2);
}

static void assert_link(const struct oracle_case *c, uint32_t i)
{
    const struct oracle_node *n = &c->tree.nodes[i], *p = &c->tree.nodes[n->parent];
    double d[3];
    for (int a = 0; a < 3; a++)
        d[a] = ldexp(n->center[a] - p->center[a], -c->tree.header->unit_exp);
    const double least = sqrt(dot(d, d)) + fmax(0, p->radius - n->radius) +
                         0x1p-21 * (diagonal(&c->tree.clusters[n->cluster]) +
                                    diagonal(&c->tree.clusters[p->cluster]));
    if (n->link < least * (1 - 1e-14))
        oracle_fail(c, "link of node %u: %g, not %g", i, n->link, least);
}

static void nest(struct oracle_case *c)
{
    const bool paper = c->tree.header->flags & SPC_FLAG_ERROR_PAPER;
    double e_min = INFINITY, e_max = 0;
    for (uint32_t i = 0; i < c->tree.node_count; i++) {
        const struct oracle_node *n = &c->tree.nodes[i];
        if (!n->leaf) {
            e_min = fmin(e_min, n->e_self);
            e_max = fmax(e_max, n->e_self);
            if (!paper && n->e_self < n->height)
                oracle_fail(c, "node %u: e_self %g < H %g", i, n->e_self, n->height);
        }
        if (n->parent == SPC_NONE) {
            if (n->code_parent != SPC_LEN_ROOT)
                oracle_fail(c, "the root has e_parent %#x", n->code_parent);
        } else {
            const struct oracle_node *p = &c->tree.nodes[n->parent];
            if (n->e_self > p->e_self || n->code_parent != p->code_self)
                oracle_fail(c, "node %u: e_self %#x, e_parent %#x, its parent's e_self %#x", i, n->code_self,
                            n->code_parent, p->code_self);
            assert_link(c, i);
        }
        for (uint32_t up = i; n->leaf && c->tree.header->triangle_count && up != SPC_NONE;
             up = c->tree.nodes[up].parent)
            assert_in_pill(c, i, up);
    }
    if (c->tree.node_count > 1)
        ck_assert((double)c->tree.header->e_min == e_min && (double)c->tree.header->e_max == e_max);
}

START_TEST(errors_grow_to_the_root_and_pills_hold_all_triangles_below)
{
    oracle_each(nest);
}
END_TEST

/* A leaf's t is its longest edge, rounded up; DESIGN I6. */
static void edges(struct oracle_case *c)
{
    uint32_t above = 0;
    for (uint32_t i = 0; i < c->tree.node_count && c->tree.header->triangle_count > 0; i++) {
        const struct oracle_node *n = &c->tree.nodes[i];
        double longest = 0;
        for (int v = 0; n->leaf && v < 3; v++) {
            double d[3];
            for (int a = 0; a < 3; a++)
                d[a] = ldexp(c->tree.corner[n->triangle][v][a] - c->tree.corner[n->triangle][(v + 1) % 3][a],
                             -c->tree.header->unit_exp);
            longest = fmax(longest, sqrt(dot(d, d)));
        }
        if (!n->leaf)
            continue;
        if (n->e_self < longest * (1 - 1e-14))
            oracle_fail(c, "leaf %u: t %g is below its longest edge %g", i, n->e_self, longest);
        above += n->e_self > longest * (1 + 1.0 / 128);
    }
    printf("%-36s %u of %u leaves have a t of more than their longest edge\n", c->name, above,
           c->tree.header->triangle_count > 0 ? c->tree.leaf_count : 0);
}

START_TEST(a_leaf_has_its_longest_edge_as_error)
{
    oracle_each(edges);
}
END_TEST

/* ---- the directory's ranges ------------------------------------------------------------------ */

struct ranges {                     /* over the nodes of a cluster */
    double self_min, self_max, parent_min, parent_max, radius_min, radius_max, link_max;
    double sub_radius_max, sub_link_max;        /* over all below too */
    uint64_t leaves_below;
};

static void assert_holds_ball(const struct oracle_case *c, uint32_t id, const struct oracle_node *n)
{
    const struct spc_cluster *k = &c->tree.clusters[id];
    double own = 0, sub = 0;
    for (int a = 0; a < 3; a++) {
        const double x = ldexp(n->center[a] - k->origin[a], -c->tree.header->unit_exp);
        const double off = 1e-13 * (fabs(x) + n->radius);
        const bool in = x - n->radius >= (double)k->box[a] - off &&
                        x + n->radius <= (double)k->box[a + 3] + off;
        const bool in_sub = x - n->radius >= (double)k->sub_box[a] - off &&
                            x + n->radius <= (double)k->sub_box[a + 3] + off;
        if ((n->cluster == id && !in) || !in_sub)
            oracle_fail(c, "a ball of cluster %u leaves the box of cluster %u", n->cluster, id);
        own += (x - (double)k->sphere[a]) * (x - (double)k->sphere[a]);
        sub += (x - (double)k->sub_sphere[a]) * (x - (double)k->sub_sphere[a]);
    }
    if ((n->cluster == id && sqrt(own) + n->radius > (double)k->sphere[3] * (1 + 1e-13)) ||
        sqrt(sub) + n->radius > (double)k->sub_sphere[3] * (1 + 1e-13))
        oracle_fail(c, "a ball of cluster %u leaves the sphere of cluster %u", n->cluster, id);
}

static void assert_in_cones(const struct oracle_case *c, const double normal[3], uint32_t leaf)
{
    uint32_t cluster = SPC_NONE;
    for (uint32_t up = leaf; up != SPC_NONE; up = c->tree.nodes[up].parent) {
        const struct oracle_node *n = &c->tree.nodes[up];
        double axis[3], along;
        spc_reader_axis(c->reader, n->axis, axis);
        along = normal == NULL ? -1 : dot(axis, normal);
        if (along < n->cosine - 1e-9)
            oracle_fail(c, "the normal of leaf %u leaves the cone of node %u's normal cluster", leaf, up);
        if (n->cluster == cluster)
            continue;
        cluster = n->cluster;
        const float *cone = c->tree.clusters[cluster].cone;
        for (int a = 0; a < 3; a++)
            axis[a] = (double)cone[a];
        along = normal == NULL ? -1 : dot(axis, normal);
        if (along < (double)cone[3] - 1e-6)
            oracle_fail(c, "the normal of leaf %u leaves the cone of cluster %u", leaf, cluster);
    }
}

static void cones(struct oracle_case *c)
{
    for (uint32_t i = 0; i < c->tree.node_count && c->tree.header->triangle_count > 0; i++) {
        const struct oracle_node *n = &c->tree.nodes[i];
        double u[3], v[3], normal[3];
        for (int a = 0; n->leaf && a < 3; a++) {
            double(*corner)[3] = c->tree.corner[n->triangle];
            u[a] = ldexp(corner[1][a] - corner[0][a], -c->tree.header->unit_exp);
            v[a] = ldexp(corner[2][a] - corner[0][a], -c->tree.header->unit_exp);
        }
        for (int a = 0; n->leaf && a < 3; a++)
            normal[a] = u[(a + 1) % 3] * v[(a + 2) % 3] - u[(a + 2) % 3] * v[(a + 1) % 3];
        if (!n->leaf)
            continue;
        const double area = sqrt(dot(normal, normal)), product = sqrt(dot(u, u) * dot(v, v));
        if (area > 0 && area <= 1e-10 * product)
            continue;               /* its normal is rounding noise */
        for (int a = 0; a < 3; a++)
            normal[a] /= area;
        assert_in_cones(c, area > 0 ? normal : NULL, i);
    }
}

static void gather_ranges(const struct oracle_case *c, struct ranges *of)
{
    for (uint32_t id = 0; id < c->tree.header->cluster_count; id++)
        of[id] = (struct ranges){.self_min = INFINITY, .parent_min = INFINITY, .radius_min = INFINITY};
    for (uint32_t i = 0; i < c->tree.node_count; i++) {
        const struct oracle_node *n = &c->tree.nodes[i];
        struct ranges *r = &of[n->cluster];
        r->self_min = fmin(r->self_min, n->e_self);
        r->self_max = fmax(r->self_max, n->e_self);
        r->parent_min = fmin(r->parent_min, n->e_parent);
        r->parent_max = fmax(r->parent_max, n->e_parent);
        r->radius_min = fmin(r->radius_min, n->radius);
        r->radius_max = fmax(r->radius_max, n->radius);
        r->link_max = fmax(r->link_max, n->parent == SPC_NONE ? 0 : n->link);
        for (uint32_t id = n->cluster; id != SPC_NONE; id = c->tree.clusters[id].parent) {
            of[id].sub_radius_max = fmax(of[id].sub_radius_max, n->radius);
            of[id].sub_link_max = fmax(of[id].sub_link_max, n->parent == SPC_NONE ? 0 : n->link);
            of[id].leaves_below += n->leaf;
            assert_holds_ball(c, id, n);
        }
    }
}

static void assert_blocks(const struct oracle_case *c, uint32_t id)
{
    const struct spc_cluster *k = &c->tree.clusters[id];
    double link = 0, last = -1;
    for (uint32_t b = k->block_first + k->block_count; b-- > k->block_first;) {
        const struct spc_block *block = &c->tree.blocks[b];
        double self_min = INFINITY, parent_min = INFINITY, parent_max = 0, radius = 0;
        for (uint32_t s = c->tree.stored_first[b]; s < c->tree.stored_first[b + 1]; s++) {
            const struct oracle_node *n = &c->tree.nodes[c->tree.stored[s]];
            self_min = fmin(self_min, n->e_self);
            parent_min = fmin(parent_min, n->e_parent);
            parent_max = fmax(parent_max, n->e_parent);
            radius = fmax(radius, n->radius);
            link = fmax(link, n->parent == SPC_NONE ? 0 : n->link);
        }
        if ((double)block->e_parent_max != parent_max || (double)block->e_parent_min != parent_min ||
            (double)block->e_self_min != self_min || (double)block->radius_max != radius ||
            (double)block->link_max < link || block->cluster != id)
            oracle_fail(c, "block %u: its ranges are not those of its nodes", b);
        if (parent_max < last)
            oracle_fail(c, "block %u stands before one of larger e_parent", b);
        last = parent_max;
    }
}

/* The directory's copies, inner ones first, each kind in the order of the file. */
static void assert_tops(const struct oracle_case *c, uint32_t id)
{
    const struct spc_cluster *k = &c->tree.clusters[id];
    uint32_t met = 0;
    for (int kind = 0; kind < 2; kind++)
        for (uint32_t s = c->tree.stored_first[k->block_first];
             s < c->tree.stored_first[k->block_first + k->block_count]; s++) {
            const struct oracle_node *n = &c->tree.nodes[c->tree.stored[s]];
            struct spc_node top;
            if (n->leaf != kind || (n->parent != SPC_NONE && c->tree.nodes[n->parent].cluster == id))
                continue;
            spc_top_decode(c->reader, k, met, &top);
            bool same = k->tops_are_leaf[met] == n->leaf && top.e_self == n->code_self &&
                        top.e_parent == n->code_parent && top.radius == n->radius &&
                        top.height == n->height && top.link == n->link;
            for (int a = 0; a < 3; a++)
                same = same && top.center[a] == n->center[a] && top.normal[a] == n->normal[a];
            if (!same)
                oracle_fail(c, "top %u of cluster %u is not the node it copies", met, id);
            met++;
        }
    if (met != k->top_count)
        oracle_fail(c, "cluster %u has %u tops, the directory %u", id, met, k->top_count);
}

static void ranges(struct oracle_case *c)
{
    struct ranges *of = get(c->tree.header->cluster_count, sizeof *of);
    gather_ranges(c, of);
    for (uint32_t id = 0; id < c->tree.header->cluster_count; id++) {
        const struct spc_cluster *k = &c->tree.clusters[id];
        const struct ranges *r = &of[id];
        if ((double)k->e_self_min != r->self_min || (double)k->e_self_max != r->self_max ||
            (double)k->e_parent_min != r->parent_min || (double)k->e_parent_max != r->parent_max ||
            (double)k->radius_min != r->radius_min || (double)k->radius_max != r->radius_max)
            oracle_fail(c, "cluster %u: its ranges are not those of its nodes", id);
        if ((double)k->link_max < r->link_max || (double)k->sub_link_max < r->sub_link_max ||
            (double)k->sub_radius_max < r->sub_radius_max || k->leaves_below != r->leaves_below)
            oracle_fail(c, "cluster %u: its sums are not those of what is below", id);
        assert_blocks(c, id);
        assert_tops(c, id);
    }
    free(of);
}

START_TEST(directory_ranges_hold_what_they_stand_for)
{
    oracle_each(ranges);
}
END_TEST

START_TEST(cones_hold_the_winding_normals_of_all_triangles_below)
{
    oracle_each(cones);
}
END_TEST

int main(void)
{
    if (!oracle_start())
        return 1;
    const int failed = SUITE("oracle_tree", case_start, case_finish,
                             random_weights_cancel_in_every_bin_between_leaves_and_root,
                             errors_grow_to_the_root_and_pills_hold_all_triangles_below,
                             a_leaf_has_its_longest_edge_as_error, directory_ranges_hold_what_they_stand_for,
                             cones_hold_the_winding_normals_of_all_triangles_below);
    oracle_finish();
    return failed;
}
