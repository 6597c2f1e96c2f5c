/*
 * knn.h - the nearest places of many points: a k-d tree, searched by groups of neighbours.
 *
 * A place is where one point or more are. What is nearest is a function of the data alone: places are
 * ordered by squared distance, those equally far by x, y, z. So a search may go through the data in
 * any order and in pieces, each of them more than once.
 */
#ifndef SPB_KNN_H
#define SPB_KNN_H

#include "tree.h"

/* Settable when compiling, so that other choices can be measured. */
#ifndef SPB_NEAR
#define SPB_NEAR 12                 /* places that are looked for, */
#endif
#ifndef SPB_NEAR_MAX
#define SPB_NEAR_MAX 32             /* and where so many are on a line */
#endif

enum { SPB_BUCKET = 16 };           /* points, where they are not all in one place */

struct spb_kd_node {                /* preorder: the left child is the next node */
    double min[3], max[3];          /* tight */
    uint32_t first, count;          /* points */
    uint32_t right;                 /* 0: a bucket; of more than SPB_BUCKET points only in one place */
};

struct spb_kd {
    struct spb_kd_node *nodes;      /* [node_count <= 2 count] */
    uint32_t node_count;
    const double *axis[3];          /* [count] coordinates, set by spb_kd_coordinates */
};

/*
 * Orders keys by place: nodes are ranges of them. Points that are in one place stay in their order, and
 * so do all when they were ordered before. scratch has room for as many keys.
 *
 * in   count  at least 1, below 2^31
 */
void spb_kd_build(struct spb_key *keys, struct spb_key *scratch, uint32_t count,
                  struct spb_kd_node *nodes, struct spb_kd *out);

/* Coordinates of the keys as three arrays, into room for count keys that outlives the searches. */
void spb_kd_coordinates(struct spb_kd *kd, const struct spb_key *keys, struct spb_key *room,
                        uint32_t count);

/* What is nearest to a point, of what was looked at; its own place is not. */
struct spb_near {
    double at[SPB_NEAR_MAX][4];     /* squared distance, x, y, z: ascending */
    double worst;                   /* squared distance of the last; infinite while there is room */
    uint32_t count, room;
};

struct spb_group {                  /* points of one bucket; one for all that are in one place */
    uint32_t count;
    double axis[3][SPB_BUCKET];
    double min[3], max[3];          /* tight */
    double worst;                   /* of all near */
    struct spb_near near[SPB_BUCKET];
};

/* Looks through all of kd for what is nearest to the points of its bucket: up to room places. */
void spb_group_init(struct spb_group *group, const struct spb_kd *kd, uint32_t bucket, uint32_t room);

/* Looks at up to SPB_BUCKET points more, in the box min..max. */
void spb_group_look(struct spb_group *group, const double *const axis[3], uint32_t count,
                    const double min[3], const double max[3]);

/* Squared distance between two boxes; never above the computed one of points inside. */
double spb_box_distance(const double min[3], const double max[3], const double other_min[3],
                        const double other_max[3]);

#endif
