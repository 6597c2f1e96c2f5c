/*
 * family.h - the children of a node side by side, so that loops over them become vectors.
 */
#ifndef SPB_FAMILY_H
#define SPB_FAMILY_H

#include "tree.h"
#include "vec.h"
#include "vectors.h"

struct spb_family {                 /* [..][child]; places beyond count repeat child 0, without a share */
    uint32_t count;
    double center[3][SPB_CHILDREN_MAX];
    double normal[3][SPB_CHILDREN_MAX];         /* decoded */
    double radius[SPB_CHILDREN_MAX], height[SPB_CHILDREN_MAX], reach[SPB_CHILDREN_MAX];
    double cone[SPB_CHILDREN_MAX];
    double share[SPB_CHILDREN_MAX];             /* of the area; of the count when there is none */
};

SPB_INLINE double family_largest(const double v[SPB_CHILDREN_MAX])
{
    return larger_of(larger_of(v[0], v[1]), larger_of(v[2], v[3]));
}

SPB_INLINE double family_smallest(const double v[SPB_CHILDREN_MAX])
{
    return smaller_of(smaller_of(v[0], v[1]), smaller_of(v[2], v[3]));
}

/* Direction . normal of every child. */
SPB_INLINE void family_dots(const struct spb_family *f, const double n[3],
                            double out[SPB_CHILDREN_MAX])
{
    for (int i = 0; i < SPB_CHILDREN_MAX; i++)
        out[i] = n[0] * f->normal[0][i] + n[1] * f->normal[1][i] + n[2] * f->normal[2][i];
}

/* Every child's disk seen from a node with center and normal. */
struct spb_family_view {
    double from[3][SPB_CHILDREN_MAX];           /* child's centre - center */
    double off[SPB_CHILDREN_MAX];               /* its distance from the node's plane */
    double cosine[SPB_CHILDREN_MAX], sine[SPB_CHILDREN_MAX];    /* of the angle of the disks, >= 0 */
};

/*
 * Largest distance from a point of the disk to the triangles below, proved: see bound.c.
 * n: its normal, decoded
 */
double spb_reach_bound(double radius, const double n[3], const struct spb_family *f,
                       const struct spb_family_view *view);

/* e_g = min(hypot(e_p, e_t), 2 R) over the children's disks. src [Oka04] eq. 2.1-2.5, [DVS03] 3 */
double spb_paper_error(double radius, const double n[3], const struct spb_family *f,
                       const struct spb_family_view *view);

#endif
