/*
 * leaf.c - triangles as disks, some at a time.
 *
 * The archive's geometry is the scan with its vertices on the lattice; leaves are made from
 * those, so pills hold the triangles that a viewer will draw, exactly. Loops have no branches, so
 * that they become vectors.
 */
#include "codes.h"
#include "family.h"

#include <string.h>

enum { BATCH = CODES_MAX };

/* Outward, far more than the few roundings of the formulas here and in verification. */
static const double OUTWARD = 1 + 0x1p-44;

struct batch {                      /* triangles, from step to step */
    uint32_t node[BATCH];
    double corner[3][3][BATCH];     /* [corner][axis]; build coordinates, exact lattice points */
    double center[3][BATCH];
    double radius[BATCH], reach[BATCH], height[BATCH];
    double area[BATCH], longest[BATCH];
    double winding[3][BATCH];       /* unit normal; zero area: 0, 0, 1 */
    double normal[3][BATCH];        /* of the code */
    double cone[BATCH];
    float box[6][BATCH];
    int32_t code[BATCH], e_self[BATCH];
    uint8_t rgba[BATCH][4];
};

/* ---- from the records -------------------------------------------------------------------------- */

static void load_point(const struct spb_record_format *format, const struct spb_space *space,
                       const uint8_t *record, struct batch *b, uint32_t i)
{
    double corner[9];
    spb_point_corners(format, space, record, corner);
    for (int k = 0; k < 9; k++)
        b->corner[k / 3][k % 3][i] = corner[k];
    memset(b->rgba[i], 255, 4);
    if (format->colors)
        memcpy(b->rgba[i], record + format->bytes - 4, 4);
}

static void load_record(const struct spb_record_format *format, const struct spb_space *space,
                        const uint8_t *record, struct batch *b, uint32_t i)
{
    double wide[9];
    float narrow[9];
    if (format->points) {
        load_point(format, space, record, b, i);
        return;
    }
    if (format->wide) {
        memcpy(wide, record, sizeof wide);
        record += sizeof wide;
    } else {
        memcpy(narrow, record, sizeof narrow);
        record += sizeof narrow;
        for (int k = 0; k < 9; k++)
            wide[k] = (double)narrow[k];
    }
    for (int k = 0; k < 9; k++)
        b->corner[k / 3][k % 3][i] = wide[k];
    memset(b->rgba[i], 255, 4);
    for (int a = 0; a < 4 && format->colors; a++)
        b->rgba[i][a] = (uint8_t)((record[a] + record[4 + a] + record[8 + a] + 1) / 3);
}

/* File coordinates to lattice points, as spb_space_from_file, _snap and _from_lattice. */
SPB_VECTORS static void snap(const struct spb_space *space, struct batch *b, uint32_t n)
{
    const double to_units = ldexp(1, -space->unit_exp);     /* never below 2^-1074 nor above 2^1023 */
    const double to_steps = ldexp(1, space->unit_exp - space->vertex_exp);
    const double step = ldexp(1, space->vertex_exp - space->unit_exp);
    for (int k = 0; k < 9; k++) {
        const double origin = space->origin[k % 3];
        double *at = b->corner[k / 3][k % 3];
        for (uint32_t i = 0; i < n; i++)
            at[i] = floor((at[i] - origin) * to_units * to_steps + 0.5) * step;
    }
}

/* The same where cells have lattices of their own. */
static void snap_in_cells(const struct spb_space *space, struct batch *b, uint32_t n)
{
    const double step = ldexp(1, space->vertex_exp - space->unit_exp);
    for (uint32_t i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) {
            double u[3], number[3];
            for (int a = 0; a < 3; a++)
                u[a] = spb_space_from_file(space, a, b->corner[k][a][i]);
            spb_space_snap_corner(space, u, number);
            for (int a = 0; a < 3; a++)
                b->corner[k][a][i] = number[a] * step;
        }
}

/* ---- the disk ---------------------------------------------------------------------------------- */

SPB_INLINE double largest_of(double a, double b, double c)
{
    return larger_of(a, larger_of(b, c));
}

SPB_VECTORS static void find_windings(struct batch *b, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        const double ax = b->corner[1][0][i] - b->corner[0][0][i];
        const double ay = b->corner[1][1][i] - b->corner[0][1][i];
        const double az = b->corner[1][2][i] - b->corner[0][2][i];
        const double bx = b->corner[2][0][i] - b->corner[0][0][i];
        const double by = b->corner[2][1][i] - b->corner[0][1][i];
        const double bz = b->corner[2][2][i] - b->corner[0][2][i];
        const double x = ay * bz - az * by, y = az * bx - ax * bz, z = ax * by - ay * bx;
        const double twice = sqrt(square_of(x, y, z));
        const bool flat = !(twice > 0);
        const double per = 1 / (flat ? 1 : twice);
        b->area[i] = twice / 2;
        b->winding[0][i] = flat ? 0 : x * per;
        b->winding[1][i] = flat ? 0 : y * per;
        b->winding[2][i] = flat ? 1 : z * per;
    }
}

/*
 * Circumcircle of an acute triangle, else the circle on the longest edge; and how far its rim is
 * from the triangle: a right or obtuse one reaches its disk's centre. Beyond an edge, the longest
 * most, the disk bulges by radius minus the centre's distance from that edge. The computed centre
 * of a needle may be off: stray is how far its corners are from one circle.
 */
SPB_VECTORS static void find_disks(struct batch *b, uint32_t n)
{
    double weight[3][BATCH], sum[BATCH], most[BATCH];   /* of the corners; squared longest edge */
    for (uint32_t i = 0; i < n; i++) {
        double c[3][3];
        for (int k = 0; k < 9; k++)
            c[k / 3][k % 3] = b->corner[k / 3][k % 3][i];
        const double s0 = square_of(c[2][0] - c[1][0], c[2][1] - c[1][1], c[2][2] - c[1][2]);
        const double s1 = square_of(c[2][0] - c[0][0], c[2][1] - c[0][1], c[2][2] - c[0][2]);
        const double s2 = square_of(c[1][0] - c[0][0], c[1][1] - c[0][1], c[1][2] - c[0][2]);
        const double w0 = s0 * (s1 + s2 - s0), w1 = s1 * (s2 + s0 - s1), w2 = s2 * (s0 + s1 - s2);
        const double all = w0 + w1 + w2;
        const bool is0 = (s0 >= s1) & (s0 >= s2), is1 = !is0 & (s1 >= s2);
        const double others = is0 ? s1 + s2 : is1 ? s2 + s0 : s0 + s1;
        most[i] = largest_of(s0, s1, s2);
        const bool acute = (b->area[i] > 0) & (most[i] < others) & (all > 0);
        weight[0][i] = acute ? w0 : is0 ? 0 : 1;
        weight[1][i] = acute ? w1 : is1 ? 0 : 1;
        weight[2][i] = acute ? w2 : (is0 | is1) ? 1 : 0;
        sum[i] = acute ? all : 2;
        b->reach[i] = acute ? 1 : 0;
        b->longest[i] = sqrt(most[i]);
    }
    for (int a = 0; a < 3; a++)
        for (uint32_t i = 0; i < n; i++)
            b->center[a][i] = (weight[0][i] * b->corner[0][a][i] + weight[1][i] * b->corner[1][a][i] +
                               weight[2][i] * b->corner[2][a][i]) / sum[i];
    for (uint32_t i = 0; i < n; i++) {
        double d[3];
        for (int k = 0; k < 3; k++)
            d[k] = square_of(b->center[0][i] - b->corner[k][0][i],
                             b->center[1][i] - b->corner[k][1][i],
                             b->center[2][i] - b->corner[k][2][i]);
        const double radius = sqrt(largest_of(d[0], d[1], d[2]));
        const double nearest = sqrt(smaller_of(d[0], smaller_of(d[1], d[2])));
        const double inner = nearest * nearest - most[i] / 4;
        const double bulge = radius - sqrt(inner > 0 ? inner : 0) + (radius - nearest);
        b->reach[i] = b->reach[i] > 0 ? larger_of(0, bulge) : radius;
        b->radius[i] = radius;
    }
}

/* The nearest code, as spc_normal_encode: one of the four around the projected vector. */
SPB_VECTORS static void find_normals(struct batch *b, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        const double x = b->winding[0][i], y = b->winding[1][i], z = b->winding[2][i];
        struct oct best = {0, 0, 0, 0, 0};
        double u, v, dot = -HUGE_VAL;
        oct_square(x, y, z, &u, &v);
        oct_try(&best, &dot, true, oct_clamp(u), oct_clamp(v), x, y, z);
        oct_try(&best, &dot, true, oct_clamp(u + 1), oct_clamp(v), x, y, z);
        oct_try(&best, &dot, true, oct_clamp(u), oct_clamp(v + 1), x, y, z);
        oct_try(&best, &dot, true, oct_clamp(u + 1), oct_clamp(v + 1), x, y, z);
        b->code[i] = ((int32_t)best.u + 127) | ((int32_t)best.v + 127) << 8;
        b->normal[0][i] = best.x;
        b->normal[1][i] = best.y;
        b->normal[2][i] = best.z;
    }
}

SPB_VECTORS static void find_bounds(struct batch *b, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        const double x = b->normal[0][i], y = b->normal[1][i], z = b->normal[2][i];
        double h = 0;
        for (int k = 0; k < 3; k++)
            h = larger_of(h, fabs((b->corner[k][0][i] - b->center[0][i]) * x +
                                  (b->corner[k][1][i] - b->center[1][i]) * y +
                                  (b->corner[k][2][i] - b->center[2][i]) * z));
        const double dot =
            x * b->winding[0][i] + y * b->winding[1][i] + z * b->winding[2][i];
        b->radius[i] *= OUTWARD;
        b->reach[i] *= OUTWARD;
        b->height[i] = smaller_of(b->radius[i], (h + 0x1p-48 * b->radius[i]) * OUTWARD);
        b->cone[i] = b->area[i] > 0 ? dot - 1e-12 : -1;
    }
}

SPB_VECTORS static void round_outward(const double *v, bool up, float *out, uint32_t n)
{
    floats_outward(v, up, out, n);
}

SPB_VECTORS static void find_boxes(struct batch *b, uint32_t n)
{
    double lo[BATCH], hi[BATCH];
    for (int a = 0; a < 3; a++) {
        for (uint32_t i = 0; i < n; i++) {
            const double p = b->corner[0][a][i], q = b->corner[1][a][i], r = b->corner[2][a][i];
            lo[i] = smaller_of(p, smaller_of(q, r));
            hi[i] = largest_of(p, q, r);
        }
        round_outward(lo, false, b->box[a], n);
        round_outward(hi, true, b->box[a + 3], n);
    }
}

/* Codes whose values are not below the longest edges, as spc_len_encode_up. */
SPB_VECTORS static void find_lengths(struct batch *b, uint32_t n)
{
    length_codes_up(b->longest, b->e_self, n);
}

/* ---- to the nodes ------------------------------------------------------------------------------ */

static void store_leaf(const struct batch *b, uint32_t i, struct spb_node *out)
{
    const uint32_t number = out->link;
    *out = (struct spb_node){
        .center = {b->center[0][i], b->center[1][i], b->center[2][i]},
        .radius = b->radius[i], .height = b->height[i], .reach = b->reach[i], .area = b->area[i],
        .box = {b->box[0][i], b->box[1][i], b->box[2][i], b->box[3][i], b->box[4][i], b->box[5][i]},
        .link = number, .normal = (uint16_t)b->code[i], .e_self = (uint16_t)b->e_self[i],
    };
    memcpy(out->rgba, b->rgba[i], sizeof out->rgba);
    double corner[3][3];
    for (int k = 0; k < 9; k++)
        corner[k / 3][k % 3] = b->corner[k / 3][k % 3][i];
    spb_samples_of_leaf(corner, out);
}

static void make_batch(const struct spb_space *space, struct batch *b, uint32_t n,
                       struct spb_node *nodes)
{
    float cone[BATCH];
    if (space->cells != NULL)
        snap_in_cells(space, b, n);
    else
        snap(space, b, n);
    find_windings(b, n);
    find_disks(b, n);
    find_normals(b, n);
    find_bounds(b, n);
    find_boxes(b, n);
    find_lengths(b, n);
    round_outward(b->cone, false, cone, n);
    for (uint32_t i = 0; i < n; i++) {
        struct spb_node *leaf = &nodes[b->node[i]];
        store_leaf(b, i, leaf);
        leaf->cone = cone[i];
    }
}

/* The next leaves from node begin on, at most a batch; their records are on the way. */
static uint32_t find_leaves(const struct spb_record_format *format, const uint8_t *records,
                            const struct spb_node *nodes, uint32_t *begin, uint32_t end,
                            struct batch *b)
{
    uint32_t n = 0;
    for (; *begin < end && n < BATCH; ++*begin) {
        if (nodes[*begin].child_count != 0)
            continue;
        const uint8_t *record = records + (size_t)nodes[*begin].link * format->bytes;
        __builtin_prefetch(record);
        __builtin_prefetch(record + format->bytes - 1);
        b->node[n++] = *begin;
    }
    return n;
}

void spb_leaves_make(const struct spb_space *space, const struct spb_record_format *format,
                     const uint8_t *records, struct spb_node *nodes, uint32_t count)
{
    struct batch b;
    for (uint32_t begin = 0; begin < count;) {
        const uint32_t n = find_leaves(format, records, nodes, &begin, count, &b);
        for (uint32_t i = 0; i < n; i++)
            load_record(format, space, records + (size_t)nodes[b.node[i]].link * format->bytes, &b, i);
        if (n > 0)
            make_batch(space, &b, n, nodes);
    }
}
