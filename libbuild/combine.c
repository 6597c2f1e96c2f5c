/*
 * combine.c - an inner node from its children.
 *
 * Averages run in child order and use only correctly rounded operations, so the same children
 * give the same node anywhere. R and H each are the smaller of a bound over the children's pills
 * and one over the box of all triangles below: the first is tight for flat families, the second
 * does not grow from level to level. Measured, the box alone draws 5-10 % fewer nodes.
 *
 * A disk has no sides: normals are averaged as lines, opposed ones (a thin wall, a scan wound at
 * random) do not cancel. Up to 27 % fewer nodes on rough photogrammetry, no change on closed
 * statues. Cones are about winding normals and take them as they are.
 */
#include "codes.h"
#include "family.h"

#include <string.h>

enum { N = SPB_CHILDREN_MAX };

static const double OUTWARD = 1 + 0x1p-44;

/* ---- averages ---------------------------------------------------------------------------------- */

SPB_INLINE void load_family(const struct spb_node *children, uint32_t count, struct spb_family *f)
{
    double u[N], v[N];
    f->count = count;
    for (uint32_t i = 0; i < N; i++) {
        const struct spb_node *c = &children[i < count ? i : 0];
        for (int a = 0; a < 3; a++)
            f->center[a][i] = c->center[a];
        f->radius[i] = c->radius;
        f->height[i] = c->height;
        f->reach[i] = c->reach;
        f->cone[i] = (double)c->cone;
        f->share[i] = i < count ? c->area : 0;
        u[i] = (double)((c->normal & 0xFF) - 127);
        v[i] = (double)((c->normal >> 8) - 127);
    }
    for (int i = 0; i < N; i++) {
        const struct oct o = oct_decode(u[i], v[i]);
        f->normal[0][i] = o.x;
        f->normal[1][i] = o.y;
        f->normal[2][i] = o.z;
    }
}

/* Areas become shares. Returns the area of all. */
SPB_INLINE double share_area(struct spb_family *f)
{
    const double area = f->share[0] + f->share[1] + f->share[2] + f->share[3];
    for (uint32_t i = 0; i < N; i++)
        f->share[i] = area > 0 ? f->share[i] / area : i < f->count ? 1 / (double)f->count : 0;
    return area;
}

SPB_INLINE void average_center(const struct spb_family *f, double center[3])
{
    for (int a = 0; a < 3; a++) {
        center[a] = 0;
        for (int i = 0; i < N; i++)
            center[a] += f->share[i] * f->center[a][i];
    }
}

SPB_INLINE void average_normal(const struct spb_family *f, double n[3])
{
    n[0] = n[1] = n[2] = 0;
    for (int i = 0; i < N; i++) {
        const double m[3] = {f->normal[0][i], f->normal[1][i], f->normal[2][i]};
        const double side = vec_dot(n, m) < 0 ? -1 : 1;
        for (int a = 0; a < 3; a++)
            n[a] += side * (f->share[i] * m[a]);
    }
}

SPB_INLINE void average_color(const struct spb_node *children, const struct spb_family *f,
                              uint8_t rgba[4])
{
    double color[4] = {0, 0, 0, 0};
    uint32_t all = UINT32_MAX, one;
    for (uint32_t i = 0; i < f->count; i++) {
        memcpy(&one, children[i].rgba, sizeof one);
        all &= one;
    }
    memcpy(rgba, &all, sizeof all);
    if (all == UINT32_MAX)          /* scans without colours */
        return;
    for (uint32_t i = 0; i < f->count; i++)
        for (int a = 0; a < 4; a++)
            color[a] += f->share[i] * children[i].rgba[a];
    for (int a = 0; a < 4; a++)
        rgba[a] = (uint8_t)(color[a] + 0.5);
}

/* The one of four codes that is nearest to n, of equals the first. Codes outside of the range lose. */
SPB_INLINE struct oct nearest_code(const double u[N], const double v[N], const double n[3])
{
    double x[N], y[N], z[N], dot[N];
    for (int k = 0; k < N; k++) {
        const struct oct o = oct_decode(u[k], v[k]);
        const bool in_range = (fabs(u[k]) <= OCT_HALF) & (fabs(v[k]) <= OCT_HALF);
        x[k] = o.x;
        y[k] = o.y;
        z[k] = o.z;
        dot[k] = in_range ? oct_dot(&o, n[0], n[1], n[2]) : -HUGE_VAL;
    }
    const double most = family_largest(dot);
    const int k = dot[0] == most ? 0 : dot[1] == most ? 1 : dot[2] == most ? 2 : 3;
    return (struct oct){u[k], v[k], x[k], y[k], z[k]};
}

/*
 * Inner nodes use half the steps of a normal code along each axis, which a degree or so between
 * neighbours hides: the best of the four such codes around the best code of all.
 */
SPB_INLINE struct oct coarse_normal(const double n[3])
{
    static const double RIGHT[N] = {0, 1, 0, 1}, ABOVE[N] = {0, 0, 1, 1};
    double at_u = 0, at_v = 0, u[N], v[N];
    if (fabs(n[0]) + fabs(n[1]) + fabs(n[2]) > 0)
        oct_square(n[0], n[1], n[2], &at_u, &at_v);
    for (int k = 0; k < N; k++) {
        u[k] = oct_clamp(at_u + RIGHT[k]);
        v[k] = oct_clamp(at_v + ABOVE[k]);
    }
    const struct oct fine = nearest_code(u, v, n);
    const bool odd_u = floor(fine.u / 2) * 2 != fine.u, odd_v = floor(fine.v / 2) * 2 != fine.v;
    for (int k = 0; k < N; k++) {
        u[k] = fine.u + (odd_u ? 2 * RIGHT[k] - 1 : 0);
        v[k] = fine.v + (odd_v ? 2 * ABOVE[k] - 1 : 0);
    }
    return nearest_code(u, v, n);
}

/* ---- bounds ------------------------------------------------------------------------------------ */

SPB_INLINE void join_boxes(const struct spb_node *children, uint32_t count, float box[6])
{
    memcpy(box, children[0].box, sizeof children[0].box);
    for (uint32_t i = 1; i < count; i++)
        for (int a = 0; a < 3; a++) {
            const float lo = children[i].box[a], hi = children[i].box[a + 3];
            box[a] = lo < box[a] ? lo : box[a];
            box[a + 3] = hi > box[a + 3] ? hi : box[a + 3];
        }
}

/* R over the children's balls, and over the box of all triangles: far is its farthest corner. */
SPB_INLINE double bound_radius(const struct spb_family *f, const float box[6],
                               const double center[3], double far[3])
{
    double radius[N];
    for (int i = 0; i < N; i++) {
        const double x = f->center[0][i] - center[0], y = f->center[1][i] - center[1];
        const double z = f->center[2][i] - center[2];
        radius[i] = sqrt(x * x + y * y + z * z) + f->radius[i];
    }
    for (int a = 0; a < 3; a++)
        far[a] = larger_of((double)box[a + 3] - center[a], center[a] - (double)box[a]);
    return smaller_of(family_largest(radius), vec_length(far)) * OUTWARD;
}

SPB_INLINE uint16_t length_code(double v)
{
    const uint32_t unused = (1u << (8 - SPB_LENGTH_BITS)) - 1;
    return (uint16_t)((length_code_up(v) + unused) & ~unused);
}

uint16_t spb_length_code(double v)
{
    return length_code(v);
}

SPB_INLINE int center_step(double radius)
{
    return (length_code(radius) >> 8) - 127 - SPB_STEP_BITS;
}

int spb_center_step(double radius)
{
    return center_step(radius);
}

/*
 * The lattice depends on the radius, and the radius on where the centre goes: once more when it
 * has grown into the next octave. A lattice may be coarser than its radius asks for, never finer.
 */
SPB_INLINE double move_to_lattice(const struct spb_family *f, const float box[6], int finest,
                                  double center[3], double far[3])
{
    const double from[3] = {center[0], center[1], center[2]};
    double radius = bound_radius(f, box, center, far);
    int step, next = center_step(radius);
    do {
        step = next < finest ? finest : next;
        for (int a = 0; a < 3; a++)
            center[a] = times_exp2(floor(times_exp2(from[a], -step) + 0.5), step);
        radius = bound_radius(f, box, center, far);
        next = center_step(radius);
    } while (next > step);
    return radius;
}

SPB_INLINE void view_family(const struct spb_family *f, const double center[3], const double n[3],
                            struct spb_family_view *view)
{
    double dot[N];
    family_dots(f, n, dot);
    for (int i = 0; i < N; i++) {
        const double x = f->center[0][i] - center[0], y = f->center[1][i] - center[1];
        const double z = f->center[2][i] - center[2];
        const double c = smaller_of(1, fabs(dot[i]));
        view->from[0][i] = x;
        view->from[1][i] = y;
        view->from[2][i] = z;
        view->off[i] = fabs(x * n[0] + y * n[1] + z * n[2]);
        view->cosine[i] = c;
        view->sine[i] = sqrt(1 - c * c);
    }
}

SPB_INLINE double bound_height(const struct spb_family *f, const struct spb_family_view *view,
                               const double n[3], const double far[3], double radius)
{
    double height[N];
    for (int i = 0; i < N; i++)
        height[i] = view->off[i] + f->height[i] * view->cosine[i] + f->radius[i] * view->sine[i];
    const double slab = fabs(n[0]) * far[0] + fabs(n[1]) * far[1] + fabs(n[2]) * far[2];
    const double h = smaller_of(larger_of(0, family_largest(height)), slab);
    return smaller_of(radius, (h + 0x1p-48 * radius) * OUTWARD);
}

/* cos(a + b) of the angle a between the normals and the half angle b of the child's cone. */
SPB_INLINE float join_cones(const struct spb_family *f, const double n[3])
{
    double dot[N], both[N];
    family_dots(f, n, dot);
    for (int i = 0; i < N; i++) {
        const double a = larger_of(-1, smaller_of(1, dot[i])), b = f->cone[i];
        const double cosine = a * b - sqrt(1 - a * a) * sqrt(1 - b * b) - 1e-7;
        const bool full = (b <= -1) | (a <= -b);        /* past 180 degrees */
        both[i] = full ? -2 : cosine;
    }
    const double least = family_smallest(both);
    return least < -1 ? -1 : float_below(smaller_of(1, least));
}

SPB_VECTORS void spb_node_combine(const struct spb_node *children, uint32_t count, bool paper,
                                  int finest, struct spb_node *out)
{
    struct spb_family f;
    struct spb_family_view view;
    double n[3], far[3];
    load_family(children, count, &f);
    out->area = share_area(&f);
    average_center(&f, out->center);
    average_normal(&f, n);
    const struct oct normal = coarse_normal(n);
    n[0] = normal.x;
    n[1] = normal.y;
    n[2] = normal.z;
    out->normal = oct_code(normal.u, normal.v);
    average_color(children, &f, out->rgba);
    join_boxes(children, count, out->box);
    out->radius = move_to_lattice(&f, out->box, finest, out->center, far);
    view_family(&f, out->center, n, &view);
    out->height = bound_height(&f, &view, n, far, out->radius);
    out->cone = join_cones(&f, n);
    out->reach = paper ? spb_paper_error(out->radius, n, &f, &view)
                       : spb_reach_bound(out->radius, n, &f, &view) * OUTWARD;
    out->pending = out->link = 0;
    out->e_self = out->e_below = 0;
    out->owner = false;
}
