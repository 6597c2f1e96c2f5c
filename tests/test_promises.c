/*
 * What decoded values promise (spec section 8), by brute force: distances between disks and
 * triangles by sampling, not by the builder's formulas.
 */
#include "bytes.h"
#include "mesh_case.h"
#include "suite.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double distance(const double a[3], const double b[3])
{
    const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return sqrt(dot(d, d));
}

static double to_segment(const double p[3], const double a[3], const double b[3])
{
    double ab[3], ap[3], at[3];
    for (int i = 0; i < 3; i++) {
        ab[i] = b[i] - a[i];
        ap[i] = p[i] - a[i];
    }
    const double length2 = dot(ab, ab);
    double t = length2 > 0 ? dot(ap, ab) / length2 : 0;
    t = t < 0 ? 0 : t > 1 ? 1 : t;
    for (int i = 0; i < 3; i++)
        at[i] = a[i] + t * ab[i];
    return distance(p, at);
}

/* Distance of a point from a triangle: its plane where the foot is inside, else its edges. */
static double to_triangle(const double p[3], const double (*t)[3])
{
    double u[3], v[3], n[3], w[3];
    for (int i = 0; i < 3; i++) {
        u[i] = t[1][i] - t[0][i];
        v[i] = t[2][i] - t[0][i];
        w[i] = p[i] - t[0][i];
    }
    for (int i = 0; i < 3; i++)
        n[i] = u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3];
    double best = fmin(to_segment(p, t[0], t[1]), fmin(to_segment(p, t[1], t[2]),
                                                       to_segment(p, t[2], t[0])));
    const double n2 = dot(n, n);
    if (n2 > 0) {
        const double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), wu = dot(w, u), wv = dot(w, v);
        const double det = uu * vv - uv * uv;
        const double a = (vv * wu - uv * wv) / det, b = (uu * wv - uv * wu) / det;
        if (a >= 0 && b >= 0 && a + b <= 1)
            best = fmin(best, fabs(dot(w, n)) / sqrt(n2));
    }
    return best;
}

static double to_disk(const double p[3], const struct spc_node *n, double R)
{
    double d[3], in_plane[3];
    for (int i = 0; i < 3; i++)
        d[i] = p[i] - n->center[i];
    const double off = dot(d, n->normal);
    for (int i = 0; i < 3; i++)
        in_plane[i] = d[i] - off * n->normal[i];
    const double out = fmax(0, sqrt(dot(in_plane, in_plane)) - R);
    return sqrt(off * off + out * out);
}

/* ---- a whole tree in memory -------------------------------------------------------------------- */

struct forest {                     /* one cluster only: tests build archives that fit one */
    struct spc_reader *reader;
    struct spc_tree *tree;
    double (*triangle)[3][3];       /* by leaf, in leaf order */
    double unit;                    /* file units */
};

static struct forest load(const struct spb_build_options *o)
{
    struct forest f = {.reader = case_build(o)};
    size_t n;
    ck_assert_uint_eq(spc_reader_header(f.reader)->cluster_count, 1);
    ck_assert_int_eq(spc_tree_load(f.reader, 0, &f.tree, NULL), SPC_OK);
    f.triangle = case_triangles(f.reader, &n);
    f.unit = ldexp(1, spc_reader_header(f.reader)->unit_exp);
    return f;
}

static void unload(struct forest *f)
{
    free(f->triangle);
    spc_tree_free(f->tree);
    spc_reader_close(f->reader);
}

/* Triangles below a node. */
static uint32_t gather(const struct forest *f, uint32_t node, uint32_t *leaves)
{
    uint32_t n = 0;
    for (uint32_t leaf = f->tree->inner_count; leaf < f->tree->node_count; leaf++)
        for (uint32_t up = leaf; up != SPC_PARENT_OWNER; up = f->tree->parent[up])
            if (up == node) {
                leaves[n++] = leaf - f->tree->inner_count;
                break;
            }
    return n;
}

/* Largest distance from sampled points of the disk to the triangles. */
static double disk_to_triangles(const struct forest *f, const struct spc_node *n,
                                const uint32_t *leaves, uint32_t count, uint64_t *state)
{
    const double R = n->radius * f->unit;
    double u[3] = {fabs(n->normal[0]) < 0.6, fabs(n->normal[0]) >= 0.6, 0}, v[3];
    const double along = dot(u, n->normal);
    for (int i = 0; i < 3; i++)
        u[i] -= along * n->normal[i];
    const double length = sqrt(dot(u, u));
    for (int i = 0; i < 3; i++)
        u[i] /= length;
    for (int i = 0; i < 3; i++)
        v[i] = n->normal[(i + 1) % 3] * u[(i + 2) % 3] - n->normal[(i + 2) % 3] * u[(i + 1) % 3];
    double worst = 0;
    for (int s = 0; s < 80; s++) {
        const double angle = 2 * 3.14159265358979 * (s < 40 ? s / 40.0 : case_random(state));
        const double r = s < 40 ? R : R * sqrt(case_random(state));
        double p[3], nearest = HUGE_VAL;
        for (int i = 0; i < 3; i++)
            p[i] = n->center[i] + r * (cos(angle) * u[i] + sin(angle) * v[i]);
        for (uint32_t k = 0; k < count; k++)
            nearest = fmin(nearest, to_triangle(p, (const double(*)[3])f->triangle[leaves[k]]));
        worst = fmax(worst, nearest);
    }
    return worst;
}

static double triangles_to_disk(const struct forest *f, const struct spc_node *n,
                                const uint32_t *leaves, uint32_t count)
{
    double worst = 0;               /* the distance to a convex set is convex: corners suffice */
    for (uint32_t k = 0; k < count; k++)
        for (int c = 0; c < 3; c++)
            worst = fmax(worst, to_disk(f->triangle[leaves[k]][c], n, n->radius * f->unit));
    return worst;
}

static void expect_bounds(struct case_mesh mesh, double *tightest)
{
    struct spb_build_options o = case_options(case_write(&mesh, "a.ply"), case_path("a.spc"));
    o.cluster_nodes = 100000;
    struct forest f = load(&o);
    uint32_t *leaves = malloc(f.tree->node_count * sizeof *leaves);
    uint64_t state = 5;
    for (uint32_t i = 0; i < f.tree->node_count; i++) {
        const struct spc_node *n = &f.tree->nodes[i];
        const double e = (double)spc_len_decode(n->e_self) * f.unit;
        const uint32_t count = gather(&f, i, leaves);
        const double there = disk_to_triangles(&f, n, leaves, count, &state);
        const double back = triangles_to_disk(&f, n, leaves, count);
        ck_assert_msg(there <= e * (1 + 1e-9) + 1e-300, "node %u: disk is %g off, bound %g", i,
                      there, e);
        ck_assert_msg(back <= e * (1 + 1e-9) + 1e-300, "node %u: triangles are %g off, bound %g",
                      i, back, e);
        if (i < f.tree->inner_count && e > 0)
            *tightest = fmax(*tightest, fmax(there, back) / e);
    }
    free(leaves);
    unload(&f);
    case_mesh_free(&mesh);
}

START_TEST(e_self_bounds_the_hausdorff_distance_of_disk_and_triangles)
{
    double tightest = 0;
    expect_bounds(case_sphere(500, 1), &tightest);
    expect_bounds(case_sheet(500, 2), &tightest);
    expect_bounds(case_soup(300, 3), &tightest);
    for (uint32_t n = 1; n < 12; n++)
        expect_bounds(case_soup(n, 100 + n), &tightest);
    /* A bound that is never approached would prove little about the sampling. */
    ck_assert_double_gt(tightest, 0.5);
}
END_TEST

START_TEST(the_paper_error_is_smaller_and_exceeded)
{
    struct case_mesh mesh = case_sphere(800, 1);
    struct spb_build_options o = case_options(case_write(&mesh, "a.ply"), case_path("a.spc"));
    o.cluster_nodes = 100000;
    struct forest bound = load(&o);
    o.paper_error = true;
    struct forest paper = load(&o);
    uint32_t *leaves = malloc(paper.tree->node_count * sizeof *leaves);
    uint64_t state = 5;
    double excess = 0, sum[2] = {0, 0};
    for (uint32_t i = 0; i < paper.tree->inner_count; i++) {
        const struct spc_node *n = &paper.tree->nodes[i];
        const uint32_t count = gather(&paper, i, leaves);
        const double e = (double)spc_len_decode(n->e_self) * paper.unit;
        excess = fmax(excess, disk_to_triangles(&paper, n, leaves, count, &state) / e);
        sum[0] += e;
        sum[1] += (double)spc_len_decode(bound.tree->nodes[i].e_self) * bound.unit;
    }
    ck_assert_double_lt(sum[0], sum[1]);
    ck_assert_double_gt(excess, 0);
    free(leaves);
    unload(&bound);
    unload(&paper);
    case_mesh_free(&mesh);
}
END_TEST

/* Sum of e_self / R over inner nodes; each has at least what its looks ask for. */
static double relative_errors(const struct case_mesh *mesh)
{
    struct spb_build_options o = case_options(case_write(mesh, "a.ply"), case_path("a.spc"));
    o.cluster_nodes = 100000;
    struct forest f = load(&o);
    double sum = 0;
    for (uint32_t i = 0; i < f.tree->inner_count; i++) {
        const double e = (double)spc_len_decode(f.tree->nodes[i].e_self) / f.tree->nodes[i].radius;
        ck_assert_double_ge(e, sqrt(0.5));
        sum += e;
    }
    unload(&f);
    return sum;
}

START_TEST(varied_colours_make_larger_errors)
{
    struct case_mesh mesh = case_sheet(2000, 2);
    const double plain = relative_errors(&mesh);
    case_color(&mesh);
    const double coloured = relative_errors(&mesh);
    ck_assert_double_gt(coloured, 1.005 * plain);
    case_mesh_free(&mesh);
}
END_TEST

int main(void)
{
    return SUITE("promises", case_start, case_finish,
                 e_self_bounds_the_hausdorff_distance_of_disk_and_triangles,
                 the_paper_error_is_smaller_and_exceeded, varied_colours_make_larger_errors);
}
