/*
 * bound.c - how far a node's disk may be from the surface it stands for.
 *
 * Two distances make e_self. From the triangles to the disk: every triangle lies in the pill and
 * projects into the disk, so it is H. From the disk to the triangles: the reach, bounded here.
 *
 * Let p be a point of the disk's plane and D a child's disk with reach h. D's projection holds a
 * circle of radius r |n.n'| around its centre's; the point of D above the nearest point of that
 * circle is at most |n.(c'-c)| + r sqrt(1 - (n.n')^2) off the plane. So
 *     g(p) = hypot(max(0, |p - c'| - r |n.n'|), |n.(c'-c)| + r sqrt(1 - (n.n')^2)) + h
 * bounds the distance from p to the triangles below the child, and is convex in p. The disk is
 * covered by 24 patches, convex polygons; over a patch the reach is at most the smallest, over the
 * children, of the largest g at the patch's corners. Interior gaps between children count.
 *
 * g grows with the distance from c' alone, so over a patch it is largest at the corner that is
 * farthest from c'. Floats tell the reach over every patch up to a margin; only the few patches
 * that may have the largest are computed in double.
 *
 * Measured (nodes drawn on three scans at 8 px against gap + largest h of the children): 30 % fewer.
 */
#include "family.h"

enum { SECTORS = 8, RINGS = 3, PATCHES = SECTORS * RINGS, N = SPB_CHILDREN_MAX };

/* Unit octagon; outer corners of a ring lie at 1 / cos(pi / 8) so that its edges clear the circle. */
#define HALF 0x1.6a09e667f3bcdp-1
static const double OCTAGON[SECTORS + 1][2] = {
    {1, 0}, {HALF, HALF}, {0, 1}, {-HALF, HALF}, {-1, 0}, {-HALF, -HALF}, {0, -1}, {HALF, -HALF}, {1, 0},
};
static const double RING_RADIUS[RINGS + 1] = {0, 0.5, 0.8660, 1.0823922002923941};

/* Two directions that with n make a frame. */
SPB_INLINE void tangents(const double n[3], double u[3], double v[3])
{
    const double axis[3] = {fabs(n[0]) < 0.6, fabs(n[0]) >= 0.6, 0};
    vec_cross(n, axis, u);
    vec_scale(u, 1 / vec_length(u), u);
    vec_cross(n, u, v);
}

struct child_views {                /* children's disks in the frame of their parent's */
    double x[N], y[N];              /* centre in the plane */
    double inner[N];                /* radius of the circle that its projection holds */
    double off[N];                  /* bound on the distance from the plane */
};

SPB_INLINE void view_children(const double n[3], const struct spb_family *f,
                              const struct spb_family_view *view, struct child_views *c)
{
    double u[3], v[3];
    tangents(n, u, v);
    for (int i = 0; i < N; i++) {
        const double x = view->from[0][i], y = view->from[1][i], z = view->from[2][i];
        c->x[i] = x * u[0] + y * u[1] + z * u[2];
        c->y[i] = x * v[0] + y * v[1] + z * v[2];
        c->inner[i] = f->radius[i] * view->cosine[i];
        c->off[i] = view->off[i] + f->radius[i] * view->sine[i];
    }
}

/* ---- about, in floats -------------------------------------------------------------------------- */

#define H ((float)HALF)
struct edges {                      /* outer edges of all patches: both corners */
    float x[2][PATCHES], y[2][PATCHES];
};
static const float EDGE_X[2][SECTORS] = {{1, H, 0, -H, -1, -H, 0, H}, {H, 0, -H, -1, -H, 0, H, 1}};
static const float EDGE_Y[2][SECTORS] = {{0, H, 1, H, 0, -H, -1, -H}, {H, 1, H, 0, -H, -1, -H, 0}};
#undef H

SPB_INLINE float float_larger(float a, float b)
{
    return a > b ? a : b;
}

SPB_INLINE float float_smaller(float a, float b)
{
    return a < b ? a : b;
}

SPB_INLINE void place_edges(double radius, struct edges *e)
{
    for (int ring = 0; ring < RINGS; ring++) {
        const float r = (float)(radius * RING_RADIUS[ring + 1]);
        for (int end = 0; end < 2; end++)
            for (int s = 0; s < SECTORS; s++) {
                e->x[end][ring * SECTORS + s] = r * EDGE_X[end][s];
                e->y[end][ring * SECTORS + s] = r * EDGE_Y[end][s];
            }
    }
}

/* Child i's g over all patches: reach becomes the smaller. */
SPB_INLINE void reach_of_child(const struct edges *e, const struct child_views *c,
                               const struct spb_family *f, int i, float reach[PATCHES])
{
    const float x = (float)c->x[i], y = (float)c->y[i];
    const float inner = (float)c->inner[i], off = (float)c->off[i], add = (float)f->reach[i];
    float far[SECTORS + PATCHES];   /* squared, of an edge: the innermost one is the centre */
    for (int p = 0; p < SECTORS; p++)
        far[p] = x * x + y * y;
    for (int p = 0; p < PATCHES; p++) {
        const float ax = e->x[0][p] - x, ay = e->y[0][p] - y;
        const float bx = e->x[1][p] - x, by = e->y[1][p] - y;
        far[SECTORS + p] = float_larger(ax * ax + ay * ay, bx * bx + by * by);
    }
    for (int p = 0; p < PATCHES; p++) {
        const float farthest = float_larger(far[p], far[p + SECTORS]);
        const float in_plane = float_larger(0, sqrtf(farthest) - inner);
        reach[p] = float_smaller(reach[p], sqrtf(in_plane * in_plane + off * off) + add);
    }
}

/*
 * Patches, a bit each, one of which has the largest reach. All lengths are parts of the sum s of
 * one child at least, or of the radius: some 35 roundings of 2^-24 s, so values are off by less
 * than 2^-18 s and the largest by no more than 2^-17 s against another. Squares do not underflow:
 * lengths are 0 or above 2^-50.
 */
SPB_INLINE uint32_t find_patches(double radius, const struct child_views *c,
                                 const struct spb_family *f)
{
    struct edges e;
    float reach[PATCHES], most[SECTORS];
    double sum[N];
    uint32_t found = 0;
    place_edges(radius, &e);
    for (int p = 0; p < PATCHES; p++)
        reach[p] = HUGE_VALF;
    for (uint32_t i = 0; i < f->count; i++)
        reach_of_child(&e, c, f, (int)i, reach);
    for (int i = 0; i < N; i++)
        sum[i] = fabs(c->x[i]) + fabs(c->y[i]) + c->inner[i] + c->off[i] + f->reach[i];
    const float margin = (float)(2 * radius + family_largest(sum)) * 0x1p-16f;
    for (int s = 0; s < SECTORS; s++)
        most[s] = float_larger(reach[s], float_larger(reach[s + SECTORS], reach[s + 2 * SECTORS]));
    for (int half = SECTORS / 2; half > 0; half /= 2)
        for (int s = 0; s < half; s++)
            most[s] = float_larger(most[s], most[s + half]);
    const float least = most[0] - margin;
    for (int p = 0; p < PATCHES; p++)
        found |= (uint32_t)(reach[p] >= least) << p;
    return found;
}

/* ---- exactly ----------------------------------------------------------------------------------- */

/* From the centre of child i. */
SPB_INLINE double square_to(const struct child_views *c, int i, double x, double y)
{
    return (x - c->x[i]) * (x - c->x[i]) + (y - c->y[i]) * (y - c->y[i]);
}

SPB_INLINE double reach_of_patch(double radius, const struct child_views *c,
                                 const struct spb_family *f, int patch)
{
    const int ring = patch / SECTORS, sector = patch % SECTORS;
    double g[N], far[N], x[4], y[4];
    for (int k = 0; k < 4; k++) {
        const double r = radius * RING_RADIUS[ring + (k >> 1)];
        x[k] = r * OCTAGON[sector + (k & 1)][0];
        y[k] = r * OCTAGON[sector + (k & 1)][1];
    }
    SPB_ROLLED
    for (int i = 0; i < N; i++) {
        const double inner = larger_of(square_to(c, i, x[0], y[0]), square_to(c, i, x[1], y[1]));
        const double outer = larger_of(square_to(c, i, x[2], y[2]), square_to(c, i, x[3], y[3]));
        far[i] = larger_of(inner, outer);
    }
    SPB_ROLLED
    for (int i = 0; i < N; i++) {
        const double in_plane = larger_of(0, sqrt(far[i]) - c->inner[i]);
        g[i] = sqrt(in_plane * in_plane + c->off[i] * c->off[i]) + f->reach[i];
    }
    return family_smallest(g);
}

SPB_VECTORS double spb_reach_bound(double radius, const double n[3], const struct spb_family *f,
                                   const struct spb_family_view *view)
{
    struct child_views c;
    double reach = 0;
    view_children(n, f, view, &c);
    for (uint32_t found = find_patches(radius, &c, f); found != 0; found &= found - 1)
        reach = larger_of(reach, reach_of_patch(radius, &c, f, __builtin_ctz(found)));
    return smaller_of(reach, 2 * radius);
}

/* ---- as in the papers -------------------------------------------------------------------------- */

/* Extent of the children's disks along a direction, from the node's centre. */
SPB_INLINE void extent_along(const double dir[3], const struct spb_family *f,
                             const struct spb_family_view *view, double *lo, double *hi)
{
    double dot[N], low[N], high[N];
    family_dots(f, dir, dot);
    for (int i = 0; i < N; i++) {
        const double half = f->radius[i] * sqrt(larger_of(0, 1 - dot[i] * dot[i]));
        const double at = view->from[0][i] * dir[0] + view->from[1][i] * dir[1] +
                          view->from[2][i] * dir[2];
        low[i] = at - half;
        high[i] = at + half;
    }
    *lo = family_smallest(low);
    *hi = family_largest(high);
}

SPB_VECTORS double spb_paper_error(double radius, const double n[3], const struct spb_family *f,
                                   const struct spb_family_view *view)
{
    double u[3], v[3], dir[3], down, up, width = HUGE_VAL;
    tangents(n, u, v);
    extent_along(n, f, view, &down, &up);           /* (2.1) */
    for (int k = 0; k < SECTORS; k++) {             /* (2.3) */
        double lo, hi;
        for (int a = 0; a < 3; a++)
            dir[a] = u[a] * OCTAGON[k][0] + v[a] * OCTAGON[k][1];
        extent_along(dir, f, view, &lo, &hi);
        width = smaller_of(width, hi - lo);
    }
    const double e_p = up - down;
    const double e_t = larger_of(0, 2 * radius - width);
    return smaller_of(sqrt(e_p * e_p + e_t * e_t), 2 * radius);
}
