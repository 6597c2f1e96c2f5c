/*
 * tree.h - the hierarchy of disks over a set of faces.
 *
 * A node is a disk with a pill: every triangle below lies in ball(center, radius) and in the slab
 * |n . (x - center)| <= height. Lengths are in units, positions in build coordinates (space.h).
 * Values here are exact up to double rounding, outward; coding them is pack.c's work.
 */
#ifndef SPB_TREE_H
#define SPB_TREE_H

#include "space.h"

enum { SPB_CHILDREN_MAX = 4, SPB_SAMPLES = 16 };

/* Settable when compiling, so that scripts/decisions measures other choices. */
#ifndef SPB_STEP_BITS
#define SPB_STEP_BITS 3             /* lattice steps per radius of a centre: 2^3 to 2^4 */
#endif
#ifndef SPB_LENGTH_BITS
#define SPB_LENGTH_BITS 4           /* of the 8 that a length code has below its exponent */
#endif

/* Inner nodes use few bits of a length code: the smallest such code that is >= v. */
uint16_t spb_length_code(double v);

/* Lattice of an inner node's centre: the exponent of its step, in units, by its radius. */
int spb_center_step(double radius);

struct spb_node {
    double center[3];
    double radius, height;          /* R, H */
    double reach;                   /* h: no point of the disk is further from the triangles below;
                                       with paper errors: e_g of the thesis */
    double area;                    /* of all triangles below */
    float sample_step, slack;       /* points of triangles below are center + step * sample, up to slack */
    float spread;                   /* variance of normals and colours below: see combine.c */
    float box[6];                   /* of all triangles below, rounded outward */
    float cone;                     /* cosine: winding normals below lie that near to the normal */
    uint32_t child_first;           /* children are adjacent, after their parent */
    uint32_t pending;               /* nodes below that are in no cluster yet */
    uint32_t link;                  /* leaf: face number; owner: cluster number */
    uint16_t normal;                /* code; the disk's normal is its decoded value */
    uint16_t e_self;                /* code; leaf: longest edge; owner: final; else set when packed */
    uint16_t e_below;               /* owner: largest e_self of its cluster's tops */
    uint8_t child_count;            /* 0: leaf */
    bool owner : 1;                 /* everything below is in closed clusters */
    uint8_t sample_count : 7;
    int8_t sample[3][SPB_SAMPLES];
    uint8_t rgba[4];
};

/*
 * Leaves of faces, those among nodes [0, count) that have no children: circumcircle of an acute
 * triangle, else the circle on the longest edge. link: number of the face's record, stays.
 * src  [Oka04] 2.3.2; reach: the largest distance from a point of the disk to the triangle
 */
void spb_leaves_make(const struct spb_space *space, const struct spb_record_format *format,
                     const uint8_t *records, struct spb_node *nodes, uint32_t count);

/*
 * Inner nodes among nodes [begin, end), each over its 2..4 children, which come after it and are among
 * them or were made before: center, normal and colour are averages weighted by area (plain when
 * there is none), R and H the smaller of two proved bounds each. The center is moved to its lattice
 * (spb_center_step, but not below 2^finest units) before anything is measured from it. child_first
 * and child_count stay as they are.
 */
void spb_inner_make(struct spb_node *nodes, uint32_t begin, uint32_t end, bool paper, int finest);

/* ---- splitting --------------------------------------------------------------------------------- */

struct spb_tree {                  /* all zero: empty, without memory */
    struct spb_node *nodes;         /* children after their parent; node 0 is the root */
    uint32_t node_count, node_max;
    uint32_t height;                /* levels */
};

enum { SPB_KEY_FACE = 3 };
struct spb_key {                    /* one vector, as of spb_record_keys: the place, then the face's number */
    double v[4];
};

/*
 * Splits faces [0, count) by split.h into a tree of nodes whose child_first, child_count and link
 * are set; nothing else is. Some at a time, so that they can be made while they are in a near cache:
 *
 *     spb_split_begin, then spb_split_next until it gives no nodes, then spb_split_end
 *
 * spb_split_next gives nodes [*begin, *end). What is below them is among them or was given before,
 * so they can be made from the last to the first. Each node is given once. tree->nodes may move.
 * keys[count] is reordered. An earlier tree's memory is used again.
 *
 * in   count  at least 1, below 2^31
 * out  tree->nodes  from malloc, the caller's to free, also on failure
 * fails  SPC_NO_MEMORY
 */
struct spb_splitter {
    struct spb_key *keys;
    struct spb_tree *tree;
    struct spb_job *stack;
    uint32_t waiting;               /* jobs */
};
enum spc_status spb_split_begin(struct spb_splitter *s, struct spb_key *keys, uint32_t count,
                                struct spb_tree *tree, struct spc_error *err);
enum spc_status spb_split_next(struct spb_splitter *s, uint32_t *begin, uint32_t *end,
                               struct spc_error *err);
void spb_split_end(struct spb_splitter *s);     /* also when spb_split_begin has failed */

#endif
