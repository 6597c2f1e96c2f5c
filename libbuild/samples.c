/*
 * samples.c - how far a node's disk may be from the triangles below it, by points of these.
 *
 * Every node carries 16 points that lie on triangles below it, up to a slack: corners of its triangles
 * for a family of leaves, above that those of its children's points that are nearest to 16 places of its
 * rim. The rim is where a disk is farthest from what it stands for.
 *
 * Let p be a point of a convex patch of the disk and s such a point of a triangle. |p - s| is convex in
 * p, so the distance of every p of the patch from the triangles is at most that of the patch's farthest
 * corner from s, plus the slack. Any s will do: the one nearest to a place of the patch is taken, found in
 * floats. 24 patches hold the disk, 16 along the rim and 8 within, and a circle in the middle, of which
 * no point is farther from s than its centre is and its radius. The largest of their bounds is the reach.
 *
 * Nothing accumulates from level to level but the slack: a point is stored as steps of 1/127 of
 * the radius from the centre, which is off by sqrt(3) / 2 steps at most, 0.7 % of the radius, and radii halve.
 * Measured against the distance by brute force: the bound over gaps and children was 2.0 to 2.5 times as
 * much at every level; this is 1.15 to 1.25 times from 16 triangles a node on.
 */
#include "family.h"

#include "family.h"

enum { N = SPB_CHILDREN_MAX, K = SPB_SAMPLES, RIM = 16, MIDDLE = 8, PATCHES = SPB_PATCHES, CANDIDATES = N * K };
_Static_assert(CANDIDATES == 64, "six bits");

static const double OUTWARD = 1 + 0x1p-44;
static const double ROUNDED_UP = 1 + 0x1p-22;   /* to float, and not below */
static const double HALF_DIAGONAL = 0.8661;     /* above sqrt(3) / 2 */

/* cos(k pi / 16); a ring's outer corners lie at 1 / cos(half a sector) so that its edges clear the circle. */
static const double COSINE[32] = {
    1, 0.98078528040323043, 0.92387953251128674, 0.83146961230254524, 0.70710678118654757,
    0.55557023301960218, 0.38268343236508978, 0.19509032201612828, 0, -0.19509032201612828,
    -0.38268343236508978, -0.55557023301960218, -0.70710678118654757, -0.83146961230254524,
    -0.92387953251128674, -0.98078528040323043, -1, -0.98078528040323043, -0.92387953251128674,
    -0.83146961230254524, -0.70710678118654757, -0.55557023301960218, -0.38268343236508978,
    -0.19509032201612828, 0, 0.19509032201612828, 0.38268343236508978, 0.55557023301960218,
    0.70710678118654757, 0.83146961230254524, 0.92387953251128674, 0.98078528040323043,
};
static const double RIM_INNER = 0.75, RIM_OUTER = 1.0196, MIDDLE_INNER = 0.4, MIDDLE_OUTER = 0.8119;
static const double CIRCLE = 0.4;               /* polygons of MIDDLE_INNER lie in it */

void spb_patches_make(struct spb_patches *out)
{
    for (int p = 0; p < PATCHES; p++) {
        const int wide = p < RIM ? 2 : 4, from = p < RIM ? 2 * p : 4 * (p - RIM);
        const double place = p < RIM ? 1 : 0.6;     /* the disk's end; half-way between the rings */
        const int middle = from + wide / 2;
        out->x[p] = (float)(place * COSINE[middle & 31]);
        out->y[p] = (float)(place * COSINE[(middle + 24) & 31]);
        for (int k = 0; k < 4; k++) {
            const int at = from + (k & 1 ? wide : 0);
            const double r = p < RIM ? k & 2 ? RIM_OUTER : RIM_INNER : k & 2 ? MIDDLE_OUTER : MIDDLE_INNER;
            out->corner_x[k][p] = r * COSINE[at & 31];
            out->corner_y[k][p] = r * COSINE[(at + 24) & 31];
        }
    }
}

struct candidates {                 /* points, from the node's centre */
    double at[3][CANDIDATES + K];   /* along the axes; 16 are written at once */
    double x[CANDIDATES], y[CANDIDATES], z[CANDIDATES];     /* in the node's frame */
    float fx[CANDIDATES], fy[CANDIDATES], fz[CANDIDATES];   /* in radii */
    double slack;                   /* of the worst */
    int count;
};

/* Squares of distances as bits, their last six a candidate's number: the smallest is of one of the nearest. */
SPB_INLINE void find_nearest(const struct spb_patches *patches, const struct candidates *c,
                             int32_t at[PATCHES])
{
    float square[PATCHES];
    int32_t bits[PATCHES];
    for (int p = 0; p < PATCHES; p++)
        at[p] = INT32_MAX;
    for (int32_t i = 0; i < c->count; i++) {
        const float x = c->fx[i], y = c->fy[i], zz = c->fz[i] * c->fz[i];
        for (int p = 0; p < PATCHES; p++) {
            const float dx = patches->x[p] - x, dy = patches->y[p] - y;
            square[p] = dx * dx + dy * dy + zz;
        }
        memcpy(bits, square, sizeof bits);
        for (int p = 0; p < PATCHES; p++) {
            const int32_t key = (bits[p] & ~(CANDIDATES - 1)) | i;
            at[p] = key < at[p] ? key : at[p];
        }
    }
    for (int p = 0; p < PATCHES; p++)
        at[p] &= CANDIDATES - 1;
}

SPB_INLINE double bound_reach(const struct spb_patches *patches, const struct candidates *c,
                              const int32_t at[PATCHES], double radius)
{
    double x[PATCHES], y[PATCHES], zz[PATCHES], square[PATCHES];
    for (int p = 0; p < PATCHES; p++) {
        x[p] = c->x[at[p]];
        y[p] = c->y[at[p]];
        zz[p] = c->z[at[p]] * c->z[at[p]];
        square[p] = 0;
    }
    for (int k = 0; k < 4; k++)
        for (int p = 0; p < PATCHES; p++) {
            const double dx = patches->corner_x[k][p] * radius - x[p];
            const double dy = patches->corner_y[k][p] * radius - y[p];
            square[p] = larger_of(square[p], dx * dx + dy * dy + zz[p]);
        }
    double most = 0, center = HUGE_VAL;         /* squares; any point will do, this is the nearest */
    for (int p = 0; p < PATCHES; p++)
        most = larger_of(most, square[p]);
    for (int i = 0; i < c->count; i++)
        center = smaller_of(center, c->x[i] * c->x[i] + c->y[i] * c->y[i] + c->z[i] * c->z[i]);
    return larger_of(sqrt(most), sqrt(center) + CIRCLE * radius) + c->slack;
}

/* ---- points of a node -------------------------------------------------------------------------- */

/* Steps over points that are up to slack beyond the radius; storing adds to the slack. */
SPB_INLINE void set_steps(struct spb_node *node, double slack)
{
    node->sample_step = (float)((node->radius + slack) * (ROUNDED_UP / 127));
    node->slack = (float)((slack + (double)node->sample_step * HALF_DIAGONAL) * ROUNDED_UP);
}

SPB_INLINE int32_t in_steps(double from_center, double per)
{
    const double steps = floor(from_center * per + 0.5);
    return (int32_t)smaller_of(127, larger_of(-127, steps));
}

SPB_VECTORS void spb_samples_of_leaf(const double corner[3][3], struct spb_node *leaf)
{
    set_steps(leaf, 0);
    leaf->sample_count = 3;
    const double per = leaf->sample_step > 0 ? 1 / (double)leaf->sample_step : 0;
    for (int a = 0; a < 3; a++)
        for (int k = 0; k < 3; k++)
            leaf->sample[a][k] = (int8_t)in_steps(corner[k][a] - leaf->center[a], per);
}

SPB_INLINE void load_points(const struct spb_node *children, const struct spb_node *node,
                            struct candidates *c)
{
    c->count = 0;
    c->slack = 0;
    for (int k = 0; k < node->child_count; k++) {
        const struct spb_node *child = &children[k];
        for (int a = 0; a < 3; a++) {
            const double away = child->center[a] - node->center[a], step = (double)child->sample_step;
            for (int i = 0; i < K; i++)         /* those beyond the count are written over */
                c->at[a][c->count + i] = away + step * child->sample[a][i];
        }
        c->count += child->sample_count;
        c->slack = larger_of(c->slack, (double)child->slack);
    }
}

SPB_INLINE void view_points(const double n[3], double radius, struct candidates *c)
{
    const double per = radius > 0 ? 1 / radius : 0;
    double u[3], v[3];
    tangents(n, u, v);
    for (int i = 0; i < c->count; i++) {
        const double x = c->at[0][i], y = c->at[1][i], z = c->at[2][i];
        c->x[i] = x * u[0] + y * u[1] + z * u[2];
        c->y[i] = x * v[0] + y * v[1] + z * v[2];
        c->z[i] = x * n[0] + y * n[1] + z * n[2];
        c->fx[i] = (float)(c->x[i] * per);
        c->fy[i] = (float)(c->y[i] * per);
        c->fz[i] = (float)(c->z[i] * per);
    }
}

/* Corners that triangles share are stored once. */
SPB_INLINE void store_corners(const struct candidates *c, struct spb_node *node)
{
    const double per = node->sample_step > 0 ? 1 / (double)node->sample_step : 0;
    int32_t all[K], seen[K];        /* three a leaf: no more than K */
    uint32_t count = 0;
    for (int i = 0; i < c->count; i++)
        all[i] = (in_steps(c->at[0][i], per) & 0xFF) << 16 | (in_steps(c->at[1][i], per) & 0xFF) << 8 |
                 (in_steps(c->at[2][i], per) & 0xFF);
    for (int i = 0; i < c->count; i++) {
        uint32_t same = 0;
        seen[count] = all[i];
        while (seen[same] != all[i])
            same++;
        node->sample[0][count] = (int8_t)(all[i] >> 16);
        node->sample[1][count] = (int8_t)(all[i] >> 8);
        node->sample[2][count] = (int8_t)all[i];
        count += same == count;
    }
    for (uint32_t i = count; i < K; i++)        /* bytes of their own, whatever was there before */
        node->sample[0][i] = node->sample[1][i] = node->sample[2][i] = 0;
    node->sample_count = count & 127;
}

SPB_INLINE void store_nearest(const struct candidates *c, const int32_t nearest[PATCHES],
                              struct spb_node *node)
{
    const double per = node->sample_step > 0 ? 1 / (double)node->sample_step : 0;
    for (int a = 0; a < 3; a++) {
        double at[K];
        for (int k = 0; k < K; k++)
            at[k] = c->at[a][nearest[k]];
        for (int k = 0; k < K; k++)
            node->sample[a][k] = (int8_t)in_steps(at[k], per);
    }
    node->sample_count = K;
}

SPB_VECTORS void spb_samples_of_node(const struct spb_patches *patches, const struct spb_node *children,
                                     const double normal[3], struct spb_node *node)
{
    struct candidates c;
    int32_t nearest[PATCHES];
    bool inner = false;
    load_points(children, node, &c);
    set_steps(node, c.slack);
    for (int k = 0; k < node->child_count; k++)
        inner |= children[k].child_count > 0;
    if (!inner) {
        store_corners(&c, node);
        return;
    }
    view_points(normal, node->radius, &c);
    find_nearest(patches, &c, nearest);
    node->reach = smaller_of(bound_reach(patches, &c, nearest, node->radius), 2 * node->radius) * OUTWARD;
    store_nearest(&c, nearest, node);
}
