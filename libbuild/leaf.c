/*
 * leaf.c - triangles as disks.
 *
 * The archive's geometry is the scan with its vertices on the lattice; leaves are made from
 * those, so pills hold the triangles that a viewer will draw, exactly.
 */
#include "tree.h"

#include "vec.h"

#include <string.h>

/* Outward, far more than the few roundings of the formulas here and in verification. */
static const double OUTWARD = 1 + 0x1p-44;

void spb_leaf_snap(const struct spb_space *space, const struct spb_face *face,
                   struct spb_leaf_shape *out)
{
    double ab[3], ac[3], bc[3], n[3];
    for (int k = 0; k < 3; k++)
        for (int a = 0; a < 3; a++)
            out->corner[k][a] =
                spb_space_from_lattice(space, spb_space_snap(space, face->corner[k][a]));
    vec_sub(out->corner[1], out->corner[0], ab);
    vec_sub(out->corner[2], out->corner[0], ac);
    vec_sub(out->corner[2], out->corner[1], bc);
    vec_cross(ab, ac, n);
    const double twice = vec_length(n);
    out->area = twice / 2;
    out->normal[0] = out->normal[1] = 0;
    out->normal[2] = 1;
    if (twice > 0)
        vec_scale(n, 1 / twice, out->normal);
    out->longest = larger_of(vec_length(ab), larger_of(vec_length(bc), vec_length(ac)));
}

/* Disk of the triangle: center, radius, and how far its rim is from the triangle. */
static void make_disk(const struct spb_leaf_shape *s, double center[3], double *radius,
                      double *reach)
{
    double sq[3];                   /* squared edge opposite to corner k */
    for (int k = 0; k < 3; k++) {
        double e[3];
        vec_sub(s->corner[(k + 2) % 3], s->corner[(k + 1) % 3], e);
        sq[k] = vec_dot(e, e);
    }
    const int l = sq[0] >= sq[1] && sq[0] >= sq[2] ? 0 : sq[1] >= sq[2] ? 1 : 2;
    double w[3], sum = 0;           /* barycentric weights of the circumcentre */
    for (int k = 0; k < 3; k++) {
        w[k] = sq[k] * (sq[(k + 1) % 3] + sq[(k + 2) % 3] - sq[k]);
        sum += w[k];
    }
    const bool acute = s->area > 0 && sq[l] < sq[(l + 1) % 3] + sq[(l + 2) % 3] && sum > 0;
    for (int a = 0; a < 3; a++)
        center[a] = acute
            ? (w[0] * s->corner[0][a] + w[1] * s->corner[1][a] + w[2] * s->corner[2][a]) / sum
            : (s->corner[(l + 1) % 3][a] + s->corner[(l + 2) % 3][a]) / 2;
    double nearest = HUGE_VAL;
    *radius = 0;
    for (int k = 0; k < 3; k++) {
        const double d = vec_distance(center, s->corner[k]);
        *radius = larger_of(*radius, d);
        nearest = smaller_of(nearest, d);
    }
    *reach = *radius;               /* a right or obtuse triangle reaches its disk's centre */
    if (!acute)
        return;
    /*
     * Beyond an edge the disk bulges by radius minus the centre's distance from that edge. The
     * computed centre of a needle may be off: stray is how far its corners are from one circle.
     */
    const double stray = *radius - nearest;
    *reach = 0;
    for (int k = 0; k < 3; k++) {
        const double inner = nearest * nearest - sq[k] / 4;
        *reach = larger_of(*reach, *radius - (inner > 0 ? sqrt(inner) : 0) + stray);
    }
}

void spb_leaf_make(const struct spb_space *space, const struct spb_face *face, uint32_t number,
                   struct spb_node *out)
{
    struct spb_leaf_shape s;
    double n[3];
    spb_leaf_snap(space, face, &s);
    memset(out, 0, sizeof *out);
    make_disk(&s, out->center, &out->radius, &out->reach);
    out->normal = spc_normal_encode(s.normal);
    spc_normal_decode(out->normal, n);
    for (int k = 0; k < 3; k++) {
        double d[3];
        vec_sub(s.corner[k], out->center, d);
        out->height = larger_of(out->height, fabs(vec_dot(d, n)));
    }
    out->radius *= OUTWARD;
    out->reach *= OUTWARD;
    out->height = smaller_of(out->radius, (out->height + 0x1p-48 * out->radius) * OUTWARD);
    out->area = s.area;
    for (int a = 0; a < 3; a++) {
        const double *p = s.corner[0], *q = s.corner[1], *r = s.corner[2];
        out->box[a] = float_below(smaller_of(p[a], smaller_of(q[a], r[a])));
        out->box[a + 3] = float_above(larger_of(p[a], larger_of(q[a], r[a])));
    }
    out->cone = s.area > 0 ? float_below(vec_dot(n, s.normal) - 1e-12) : -1;
    out->link = number;
    out->e_self = spc_len_encode_up(s.longest);
    for (int a = 0; a < 4; a++)
        out->rgba[a] =
            (uint8_t)((face->rgba[0][a] + face->rgba[1][a] + face->rgba[2][a] + 1) / 3);
}
