/*
 * family.h - families of nodes side by side, so that loops over them become vectors.
 */
#ifndef SPB_FAMILY_H
#define SPB_FAMILY_H

#include "tree.h"
#include "vec.h"
#include "vectors.h"

enum { SPB_LANES = 16 };            /* families at once; a multiple of 8 */

typedef double spb_lane[SPB_LANES];

/*
 * A lane is a node and its children. Children beyond count repeat child 0, without a share. Lanes
 * beyond the families there are hold what an earlier family left, or zeros: nobody reads their results.
 */
struct spb_families {
    uint32_t used;                  /* families there are */
    uint32_t lanes;                 /* of which loops run over, a multiple of 8 */
    uint32_t count[SPB_LANES];
    /* of the children */
    spb_lane from_center[3][SPB_CHILDREN_MAX], from_normal[3][SPB_CHILDREN_MAX];    /* decoded */
    spb_lane from_radius[SPB_CHILDREN_MAX], from_height[SPB_CHILDREN_MAX];
    spb_lane from_reach[SPB_CHILDREN_MAX], from_cone[SPB_CHILDREN_MAX];
    spb_lane share[SPB_CHILDREN_MAX];           /* of the area; of the count when there is none */
    /* of the node */
    spb_lane center[3], normal[3], radius, height, reach, area;
    /* every child's disk seen from the node */
    spb_lane away[3][SPB_CHILDREN_MAX];         /* child's centre - center */
    spb_lane off[SPB_CHILDREN_MAX];             /* its distance from the node's plane */
    spb_lane cosine[SPB_CHILDREN_MAX], sine[SPB_CHILDREN_MAX];  /* of the angle of the disks, >= 0 */
};

SPB_INLINE double largest_of_four(const double v[SPB_CHILDREN_MAX])
{
    return larger_of(larger_of(v[0], v[1]), larger_of(v[2], v[3]));
}

SPB_INLINE double smallest_of_four(const double v[SPB_CHILDREN_MAX])
{
    return smaller_of(smaller_of(v[0], v[1]), smaller_of(v[2], v[3]));
}

/* Two directions that with n make a frame. */
SPB_INLINE void tangents(const double n[3], double u[3], double v[3])
{
    const double axis[3] = {fabs(n[0]) < 0.6 ? 1 : 0, fabs(n[0]) >= 0.6 ? 1 : 0, 0};
    vec_cross(n, axis, u);
    vec_scale(u, 1 / vec_length(u), u);
    vec_cross(n, u, v);
}

/* reach: largest distance from a point of the disk to the triangles below, proved: see bound.c. */
void spb_reach_bounds(struct spb_families *f);

/*
 * Points of the triangles below: of a leaf its corners; of a node some of its children's, and unless all of
 * these are leaves its reach by them: see samples.c. Centre, radius and child_count are set before.
 */
void spb_samples_of_leaf(const double corner[3][3], struct spb_node *leaf);
enum { SPB_PATCHES = 24 };
struct spb_patches {                /* of a disk of radius 1 */
    float x[SPB_PATCHES], y[SPB_PATCHES];       /* a place of each */
    double corner_x[4][SPB_PATCHES], corner_y[4][SPB_PATCHES];
};
void spb_patches_make(struct spb_patches *out);
void spb_samples_of_node(const struct spb_patches *patches, const struct spb_node *children,
                         const double normal[3], struct spb_node *node);

/* reach: e_g = min(hypot(e_p, e_t), 2 R) over the children's disks. src [Oka04] eq. 2.1-2.5, [DVS03] 3 */
void spb_paper_errors(struct spb_families *f);

#endif
