/*
 * bound.c - how far a node's disk may be from the surface it stands for.
 *
 * Two distances make e_self. From the triangles to the disk: every triangle lies in the pill and
 * projects into the disk, so it is H. From the disk to the triangles: the reach, bounded here for families
 * of leaves. Above them samples.c bounds it by points: what is added from level to level here was
 * half of the error of coarse nodes.
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
 */
#include "family.h"

enum { SECTORS = 8, RINGS = 3, PATCHES = SECTORS * RINGS, N = SPB_CHILDREN_MAX };

/* Unit octagon; outer corners of a ring lie at 1 / cos(pi / 8) so that its edges clear the circle. */
#define HALF 0x1.6a09e667f3bcdp-1
static const double OCTAGON[SECTORS + 1][2] = {
    {1, 0}, {HALF, HALF}, {0, 1}, {-HALF, HALF}, {-1, 0}, {-HALF, -HALF}, {0, -1}, {HALF, -HALF}, {1, 0},
};
/* As in combine.c. */
static const double OUTWARD = 1 + 0x1p-44;

static const double RING_RADIUS[RINGS + 1] = {0, 0.5, 0.8660, 1.0823922002923941};

struct frames {                     /* of all nodes */
    spb_lane u[3], v[3];
};

SPB_INLINE void find_frames(const struct spb_families *f, struct frames *t)
{
    for (uint32_t i = 0; i < f->lanes; i++) {
        const double n[3] = {f->normal[0][i], f->normal[1][i], f->normal[2][i]};
        double u[3], v[3];
        tangents(n, u, v);
        for (int a = 0; a < 3; a++) {
            t->u[a][i] = u[a];
            t->v[a][i] = v[a];
        }
    }
}

struct child_views {                /* children's disks in the frame of their parent's: [child][lane] */
    spb_lane x[N], y[N];            /* centre in the plane */
    spb_lane inner[N];              /* radius of the circle that its projection holds */
    spb_lane off[N];                /* bound on the distance from the plane */
};

SPB_INLINE void view_children(const struct spb_families *f, struct child_views *c)
{
    struct frames t;
    find_frames(f, &t);
    for (int k = 0; k < N; k++)
        for (uint32_t i = 0; i < f->lanes; i++) {
            const double x = f->away[0][k][i], y = f->away[1][k][i], z = f->away[2][k][i];
            c->x[k][i] = x * t.u[0][i] + y * t.u[1][i] + z * t.u[2][i];
            c->y[k][i] = x * t.v[0][i] + y * t.v[1][i] + z * t.v[2][i];
            c->inner[k][i] = f->from_radius[k][i] * f->cosine[k][i];
            c->off[k][i] = f->off[k][i] + f->from_radius[k][i] * f->sine[k][i];
        }
}

/* ---- about, in floats -------------------------------------------------------------------------- */

SPB_INLINE float float_larger(float a, float b)
{
    return a > b ? a : b;
}

SPB_INLINE float float_smaller(float a, float b)
{
    return a < b ? a : b;
}

struct about {                      /* [child][lane] */
    float x[N][SPB_LANES], y[N][SPB_LANES], inner[N][SPB_LANES], off[N][SPB_LANES], add[N][SPB_LANES];
    float reach[SECTORS][SPB_LANES];            /* of the patches of the outer ring */
    float least[SPB_LANES];                     /* what a patch of the largest reach has at least */
    uint32_t found[SPB_LANES];                  /* patches, a bit each, one of which has the largest reach */
};

SPB_INLINE void round_views(const struct spb_families *f, const struct child_views *c,
                            struct about *t)
{
    for (int k = 0; k < N; k++)
        for (uint32_t i = 0; i < f->lanes; i++) {
            t->x[k][i] = (float)c->x[k][i];
            t->y[k][i] = (float)c->y[k][i];
            t->inner[k][i] = (float)c->inner[k][i];
            t->off[k][i] = (float)c->off[k][i];
            t->add[k][i] = (float)f->from_reach[k][i];
        }
}

/* Squared, from the corners of the octagon of radius r to a point. */
SPB_INLINE void distances(float r, float x, float y, float out[SECTORS + 1])
{
    const float h = r * (float)HALF, to_x[5] = {r - x, h - x, x, h + x, r + x};
    const float to_y[5] = {r - y, h - y, y, h + y, r + y};
    float xx[5], yy[5];
    for (int k = 0; k < 5; k++) {
        xx[k] = to_x[k] * to_x[k];
        yy[k] = to_y[k] * to_y[k];
    }
    out[0] = out[SECTORS] = xx[0] + yy[2];
    out[1] = xx[1] + yy[1];
    out[2] = xx[2] + yy[0];
    out[3] = xx[3] + yy[1];
    out[4] = xx[4] + yy[2];
    out[5] = xx[3] + yy[3];
    out[6] = xx[2] + yy[4];
    out[7] = xx[1] + yy[3];
}

/* Squared, to the farthest corners of the patches between two octagons; inner: of the smaller one. */
SPB_INLINE void farthest(const float inner[SECTORS + 1], const float outer[SECTORS + 1],
                         float out[SECTORS])
{
    float both[SECTORS + 1];
    for (int s = 0; s <= SECTORS; s++)
        both[s] = float_larger(inner[s], outer[s]);
    for (int s = 0; s < SECTORS; s++)
        out[s] = float_larger(both[s], both[s + 1]);
}

/* g of child k over the outer ring: reach becomes the smaller. */
SPB_INLINE void reach_outside(const struct spb_families *f, int k, struct about *t)
{
    for (uint32_t i = 0; i < f->lanes; i++) {
        const float x = t->x[k][i], y = t->y[k][i], off = t->off[k][i];
        const float r1 = (float)(f->radius[i] * RING_RADIUS[2]);
        const float r2 = (float)(f->radius[i] * RING_RADIUS[3]);
        float inner[SECTORS + 1], outer[SECTORS + 1], far[SECTORS];
        distances(r1, x, y, inner);
        distances(r2, x, y, outer);
        farthest(inner, outer, far);
        for (int s = 0; s < SECTORS; s++) {
            const float in_plane = float_larger(0, sqrtf(far[s]) - t->inner[k][i]);
            const float g = sqrtf(in_plane * in_plane + off * off) + t->add[k][i];
            t->reach[s][i] = float_smaller(t->reach[s][i], g);
        }
    }
}

/*
 * All lengths are parts of the sum s of one child at least, or of the radius: some 35 roundings of
 * 2^-24 s, so values are off by less than 2^-18 s and the largest by no more than 2^-17 s against
 * another. Squares do not underflow: lengths are 0 or above 2^-50.
 */
SPB_INLINE void find_least(const struct spb_families *f, const struct child_views *c,
                           struct about *t)
{
    for (uint32_t i = 0; i < f->lanes; i++) {
        double sum[N];
        float most = t->reach[0][i];
        for (int k = 0; k < N; k++)
            sum[k] = fabs(c->x[k][i]) + fabs(c->y[k][i]) + c->inner[k][i] + c->off[k][i] +
                     f->from_reach[k][i];
        for (int s = 1; s < SECTORS; s++)
            most = float_larger(most, t->reach[s][i]);
        const float margin = (float)(2 * f->radius[i] + largest_of_four(sum)) * 0x1p-16f;
        t->least[i] = most - margin;
    }
}

/*
 * Patches inside of the outer ring over which g of child k is below least are not the ones: where
 * the distance in the plane is below inner + sqrt((least - h)^2 - off^2). Roundings before that root are
 * as of 2^-22 (least - h), far below the margin.
 */
SPB_INLINE void cover_inside(const struct spb_families *f, int k, struct about *t)
{
    for (uint32_t i = 0; i < f->lanes; i++) {
        const float x = t->x[k][i], y = t->y[k][i], off = t->off[k][i];
        const float left = t->least[i] - t->add[k][i], square = left * left - off * off;
        const float in_plane = t->inner[k][i] + sqrtf(float_larger(square, 0));
        const float limit = left >= 0 && square >= 0 ? in_plane * in_plane : -1;
        const float r0 = (float)(f->radius[i] * RING_RADIUS[1]);
        const float r1 = (float)(f->radius[i] * RING_RADIUS[2]);
        float center[SECTORS + 1], inner[SECTORS + 1], outer[SECTORS + 1], far[2 * SECTORS];
        uint32_t covered = 0;
        for (int s = 0; s <= SECTORS; s++)
            center[s] = x * x + y * y;
        distances(r0, x, y, inner);
        distances(r1, x, y, outer);
        farthest(center, inner, far);
        farthest(inner, outer, far + SECTORS);
        for (int p = 0; p < 2 * SECTORS; p++)
            covered |= far[p] <= limit ? 1u << p : 0;
        t->found[i] &= ~covered;
    }
}

SPB_INLINE void find_patches(const struct spb_families *f, const struct child_views *c,
                             struct about *t)
{
    round_views(f, c, t);
    for (int s = 0; s < SECTORS; s++)
        for (uint32_t i = 0; i < f->lanes; i++)
            t->reach[s][i] = HUGE_VALF;
    for (int k = 0; k < N; k++)
        reach_outside(f, k, t);
    find_least(f, c, t);
    for (uint32_t i = 0; i < f->lanes; i++) {
        uint32_t found = (1u << 2 * SECTORS) - 1;
        for (int s = 0; s < SECTORS; s++)
            found |= t->reach[s][i] >= t->least[i] ? 1u << (s + 2 * SECTORS) : 0;
        t->found[i] = found;
    }
    for (int k = 0; k < N; k++)
        cover_inside(f, k, t);
}

/* ---- exactly ----------------------------------------------------------------------------------- */

/* From the centre of child k. */
SPB_INLINE double square_to(const struct child_views *c, int k, uint32_t lane, double x, double y)
{
    return (x - c->x[k][lane]) * (x - c->x[k][lane]) + (y - c->y[k][lane]) * (y - c->y[k][lane]);
}

SPB_INLINE double reach_of_patch(const struct spb_families *f, const struct child_views *c,
                                 uint32_t lane, int patch)
{
    const int ring = patch / SECTORS, sector = patch % SECTORS;
    double g[N], far[N], x[4], y[4];
    for (int k = 0; k < 4; k++) {
        const double r = f->radius[lane] * RING_RADIUS[ring + (k >> 1)];
        x[k] = r * OCTAGON[sector + (k & 1)][0];
        y[k] = r * OCTAGON[sector + (k & 1)][1];
    }
    SPB_ROLLED
    for (int k = 0; k < N; k++) {
        const double inner = larger_of(square_to(c, k, lane, x[0], y[0]),
                                       square_to(c, k, lane, x[1], y[1]));
        const double outer = larger_of(square_to(c, k, lane, x[2], y[2]),
                                       square_to(c, k, lane, x[3], y[3]));
        far[k] = larger_of(inner, outer);
    }
    SPB_ROLLED
    for (int k = 0; k < N; k++) {
        const double in_plane = larger_of(0, sqrt(far[k]) - c->inner[k][lane]);
        g[k] = sqrt(in_plane * in_plane + c->off[k][lane] * c->off[k][lane]) +
               f->from_reach[k][lane];
    }
    return smallest_of_four(g);
}

SPB_VECTORS void spb_reach_bounds(struct spb_families *f)
{
    struct child_views c;
    struct about t;
    view_children(f, &c);
    find_patches(f, &c, &t);
    for (uint32_t i = 0; i < f->used; i++) {
        double reach = 0;
        for (uint32_t found = t.found[i]; found != 0; found &= found - 1)
            reach = larger_of(reach, reach_of_patch(f, &c, i, __builtin_ctz(found)));
        f->reach[i] = smaller_of(reach, 2 * f->radius[i]) * OUTWARD;
    }
}

/* ---- as in the papers -------------------------------------------------------------------------- */

/* Extents of the children's disks along directions, from the nodes' centres. */
SPB_INLINE void extents_along(const spb_lane dir[3], const struct spb_families *f, spb_lane lo,
                              spb_lane hi)
{
    for (uint32_t i = 0; i < f->lanes; i++) {
        double low[N], high[N];
        for (int k = 0; k < N; k++) {
            const double dot = dir[0][i] * f->from_normal[0][k][i] +
                               dir[1][i] * f->from_normal[1][k][i] +
                               dir[2][i] * f->from_normal[2][k][i];
            const double half = f->from_radius[k][i] * sqrt(larger_of(0, 1 - dot * dot));
            const double at = f->away[0][k][i] * dir[0][i] + f->away[1][k][i] * dir[1][i] +
                              f->away[2][k][i] * dir[2][i];
            low[k] = at - half;
            high[k] = at + half;
        }
        lo[i] = smallest_of_four(low);
        hi[i] = largest_of_four(high);
    }
}

SPB_VECTORS void spb_paper_errors(struct spb_families *f)
{
    struct frames t;
    spb_lane dir[3], down, up, lo, hi, width;
    find_frames(f, &t);
    extents_along((const spb_lane *)f->normal, f, down, up);    /* (2.1) */
    for (uint32_t i = 0; i < f->lanes; i++)
        width[i] = HUGE_VAL;
    for (int k = 0; k < SECTORS; k++) {             /* (2.3) */
        for (int a = 0; a < 3; a++)
            for (uint32_t i = 0; i < f->lanes; i++)
                dir[a][i] = t.u[a][i] * OCTAGON[k][0] + t.v[a][i] * OCTAGON[k][1];
        extents_along((const spb_lane *)dir, f, lo, hi);
        for (uint32_t i = 0; i < f->lanes; i++)
            width[i] = smaller_of(width[i], hi[i] - lo[i]);
    }
    for (uint32_t i = 0; i < f->lanes; i++) {
        const double e_p = up[i] - down[i];
        const double e_t = larger_of(0, 2 * f->radius[i] - width[i]);
        f->reach[i] = smaller_of(sqrt(e_p * e_p + e_t * e_t), 2 * f->radius[i]);
    }
}
