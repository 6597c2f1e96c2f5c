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
#include "tree.h"

#include "vec.h"

#include <string.h>

static const double OUTWARD = 1 + 0x1p-44;

/*
 * Inner nodes use half the steps of a normal code along each axis, which a degree or so between
 * neighbours hides: the best of the four such codes around the direction.
 */
static uint16_t coarse_normal(const double n[3])
{
    const uint16_t fine = spc_normal_encode(n);
    const int u = (fine & 0xFF) - 127, v = (fine >> 8) - 127;
    double best_dot = -HUGE_VAL;
    uint16_t best = fine;
    for (int k = 0; k < 4; k++) {
        const int cu = u + (u & 1 ? (k & 1 ? 1 : -1) : 0), cv = v + (v & 1 ? (k & 2 ? 1 : -1) : 0);
        if (cu < -127 || cu > 127 || cv < -127 || cv > 127)
            continue;
        const uint16_t code = (uint16_t)((cu + 127) | (cv + 127) << 8);
        double d[3];
        spc_normal_decode(code, d);
        const double dot = vec_dot(d, n);
        if (dot > best_dot) {
            best_dot = dot;
            best = code;
        }
    }
    return best;
}

static void average(const struct spb_node *children, uint32_t count, struct spb_node *out)
{
    double weights[SPB_CHILDREN_MAX], sum = 0, n[3] = {0, 0, 0}, color[4] = {0, 0, 0, 0};
    for (uint32_t i = 0; i < count; i++)
        out->area += children[i].area;
    for (uint32_t i = 0; i < count; i++) {
        weights[i] = out->area > 0 ? children[i].area : 1;
        sum += weights[i];
    }
    for (uint32_t i = 0; i < count; i++) {
        double m[3];
        spc_normal_decode(children[i].normal, m);
        const double side = vec_dot(n, m) < 0 ? -1 : 1;
        for (int a = 0; a < 3; a++) {
            out->center[a] += weights[i] / sum * children[i].center[a];
            n[a] += side * weights[i] / sum * m[a];
        }
        for (int a = 0; a < 4; a++)
            color[a] += weights[i] / sum * children[i].rgba[a];
    }
    out->normal = coarse_normal(n);
    for (int a = 0; a < 4; a++)
        out->rgba[a] = (uint8_t)(color[a] + 0.5);
}

static void join_boxes(const struct spb_node *children, uint32_t count, float box[6])
{
    memcpy(box, children[0].box, sizeof children[0].box);
    for (uint32_t i = 1; i < count; i++)
        for (int a = 0; a < 3; a++) {
            box[a] = fminf(box[a], children[i].box[a]);
            box[a + 3] = fmaxf(box[a + 3], children[i].box[a + 3]);
        }
}

static void bound_pill(const struct spb_node *children, uint32_t count, struct spb_node *out)
{
    double n[3], far[3], R = 0, H = 0;
    spc_normal_decode(out->normal, n);
    for (uint32_t i = 0; i < count; i++) {
        double d[3], m[3];
        vec_sub(children[i].center, out->center, d);
        spc_normal_decode(children[i].normal, m);
        const double c = smaller_of(1, fabs(vec_dot(n, m)));
        R = larger_of(R, vec_length(d) + children[i].radius);
        H = larger_of(H, fabs(vec_dot(d, n)) + children[i].height * c +
                        children[i].radius * sqrt(1 - c * c));
    }
    for (int a = 0; a < 3; a++)
        far[a] = larger_of((double)out->box[a + 3] - out->center[a],
                      out->center[a] - (double)out->box[a]);
    const double box_H = fabs(n[0]) * far[0] + fabs(n[1]) * far[1] + fabs(n[2]) * far[2];
    out->radius = smaller_of(R, vec_length(far)) * OUTWARD;
    out->height = smaller_of(out->radius, (smaller_of(H, box_H) + 0x1p-48 * out->radius) * OUTWARD);
}

/* cos(a + b) of the angle a between the normals and the half angle b of the child's cone. */
static float join_cones(const struct spb_node *children, uint32_t count, const double n[3])
{
    float cone = 1;
    for (uint32_t i = 0; i < count; i++) {
        double m[3];
        spc_normal_decode(children[i].normal, m);
        const double a = larger_of(-1, smaller_of(1, vec_dot(n, m)));
        const double b = (double)children[i].cone;
        if (b <= -1 || a <= -b)     /* past 180 degrees */
            return -1;
        const double both = a * b - sqrt(1 - a * a) * sqrt(1 - b * b);
        cone = fminf(cone, float_below(both - 1e-7));
    }
    return cone < -1 ? -1 : cone;
}

uint16_t spb_length_code(double v)
{
    const uint32_t unused = (1u << (8 - SPB_LENGTH_BITS)) - 1;
    return (uint16_t)((spc_len_encode_up(v) + unused) & ~unused);
}

int spb_center_step(double radius)
{
    return (spb_length_code(radius) >> 8) - 127 - SPB_STEP_BITS;
}

/*
 * The lattice depends on the radius, and the radius on where the centre goes: once more when it
 * has grown into the next octave. A lattice may be coarser than its radius asks for, never finer.
 */
static void move_to_lattice(const struct spb_node *children, uint32_t count, int finest,
                            struct spb_node *out)
{
    double center[3];
    memcpy(center, out->center, sizeof center);
    int step = spb_center_step(out->radius), next = step;
    do {
        step = next < finest ? finest : next;
        for (int a = 0; a < 3; a++)
            out->center[a] = times_exp2(floor(times_exp2(center[a], -step) + 0.5), step);
        bound_pill(children, count, out);
        next = spb_center_step(out->radius);
    } while (next > step);
}

void spb_node_combine(const struct spb_node *children, uint32_t count, bool paper, int finest,
                      struct spb_node *out)
{
    double n[3];
    memset(out, 0, sizeof *out);
    average(children, count, out);
    spc_normal_decode(out->normal, n);
    join_boxes(children, count, out->box);
    bound_pill(children, count, out);
    move_to_lattice(children, count, finest, out);
    out->cone = join_cones(children, count, n);
    out->reach = paper ? spb_paper_error(out, children, count)
                       : spb_reach_bound(out, children, count) * OUTWARD;
}
