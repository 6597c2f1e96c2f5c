/*
 * pack_int.h - a cluster on its way through the stages of packing.
 *
 * Nodes are kept by kind, each kind in canonical order (collect.c), so that every stage walks through
 * memory: children of a node are a family of inner nodes and one of leaves. Positions are relative to
 * the cluster's origin, in units; they are exact.
 */
#ifndef SPB_PACK_INT_H
#define SPB_PACK_INT_H

#include "layout.h"
#include "leaf_record.h"
#include "pack.h"
#include "scratch.h"

#include <string.h>

enum { PACK_BATCH = LEAF_BATCH };   /* nodes that vector loops take at once */
#define PACK_OWNER UINT32_MAX       /* parent of the tops */
#define PACK_NONE UINT32_MAX        /* no family */

struct pack_inner {                 /* one inner node of the cluster */
    uint32_t node;                  /* in the tree */
    uint32_t parent;                /* inner node, or PACK_OWNER */
    uint32_t children[2];           /* families of its children, by kind; PACK_NONE; none of an owner */
    double at[3];                   /* decoded centre */
    double radius, height;          /* decoded, units */
    double link;                    /* needed, before coding */
    int step_exp;                   /* lattice of its center, exponent in units */
    uint16_t radius_code, e_self;
    uint8_t height_code, child_code;            /* section 7 of the spec */
    uint16_t number;                /* in its block, canonical order */
    uint32_t block;                 /* in pack.blocks */
};

struct pack_leaves {                /* numbers of the leaves side by side: the disks of their triangles */
    uint32_t *record;               /* in the tree's records */
    uint16_t *at[3];                /* steps from the origin */
    uint16_t *normal, *e_self, *radius;
    uint8_t *height;
    uint64_t (*key)[3];             /* corners: lattice numbers from the origin, 21 bits each */
    double (*wide)[3][3];           /* instead, where 21 bits do not reach; else NULL */
    uint8_t (*rgba)[3][4];          /* of the corners; NULL without SPC_FLAG_COLORS */
    int step_exp;                   /* lattice of the centres, exponent in units */
    double min[3], max[3];          /* box of their balls */
};

struct pack_family {                /* inner children or leaf children of one node */
    uint32_t first, count;          /* nodes of the kind */
    uint32_t parent;                /* inner node, or PACK_OWNER */
    uint32_t group;                 /* normal cluster */
    double link;                    /* the longest of its leaves': they are stored as one */
    uint16_t e_parent;
};

struct pack_kind {                  /* nodes of one kind, canonical order */
    uint32_t count;
    uint16_t *normal;               /* [count] with their cones: as the tree has them */
    float *cone;
    uint8_t (*rgba)[4];
    struct pack_family *families;   /* [family_count] canonical order */
    uint32_t *list;                 /* [family_count] block after block, canonical in a block */
    uint32_t family_count;
};

struct pack_block {
    enum spc_block_kind kind;
    uint32_t family_first, family_count;        /* in the kind's list */
    uint32_t count;                 /* nodes */
};

struct pack_range {                 /* codes of some nodes */
    uint16_t e_self[2], e_parent[2], radius[2];
};

struct pack {
    const struct spb_pack_tree *tree;
    const struct spb_pack_shared *shared;
    const struct spb_node *owner;   /* NULL for the root's cluster */
    uint32_t node_max;
    struct pack_scratch *memory;    /* of all arrays here, node_max nodes each */
    struct pack_kind kind[2];       /* by enum spc_block_kind */
    struct pack_inner *inner;
    struct pack_leaves leaves;
    uint32_t *levels, *scratch;     /* [node_max + 1] and [2 node_max + 2] for one stage */
    uint16_t *normals;              /* [2 node_max] */
    struct pack_block *blocks;      /* prefix order */
    uint32_t block_count;
    double min[3], max[3];          /* where centres may lie, build coordinates */
    int coarsest_wanted;            /* step of the coarsest centre */
    double normal_sum[3], axis[3];  /* of all nodes; axis of the cluster's cone, unit */
    double cosine;                  /* of the cone, so far */
    struct spc_frame frame;         /* what blocks count from; once the origin is known */
    double origin[3];               /* build coordinates */
    float box[6];                   /* of pills' balls, relative to origin, outward */
    double diagonal;
    double owner_radius, owner_shift;           /* declared: see quantise.c */
    uint16_t owner_e, tops_e;       /* e_parent of the tops; the largest e_self of them */
    struct pack_range range;        /* of all blocks so far */
    uint32_t owner_count;
    uint32_t *children;             /* spool numbers of the owners' clusters, canonical order */
    struct spb_cluster *out;
};

/* collect.c: nodes and families in canonical order, their box, the sum of their normals. */
void pack_collect(struct pack *p);

/* quantise.c: origin, steps, decoded centres, radii, heights; errors; box; links. fails SPC_NO_MEMORY */
enum spc_status pack_quantise(struct pack *p, struct spc_error *err);

/* leaves.c: triangles and disks of all leaves, once the origin is known. fails SPC_NO_MEMORY */
enum spc_status pack_leaves(struct pack *p, int step_exp, struct spc_error *err);

/*
 * shapes.c: counts what became of count triangles, in p->out. file: their corners as the scan has them;
 * batch: as lattice numbers, counted from shift beside the space's origin.
 */
void pack_shapes(struct pack *p, const double file[3][3][PACK_BATCH], const struct leaf_batch *batch,
                 const double shift[3], uint32_t count);

/* Largest distance from a point, units from the origin, to the far side of a leaf's ball. */
double pack_leaves_reach(const struct pack *p, const double from[3]);

/* order.c: blocks. */
void pack_order(struct pack *p);

/* Family k of a block, canonical order. */
static inline const struct pack_family *pack_family_of(const struct pack *p,
                                                       const struct pack_block *b, uint32_t k)
{
    const struct pack_kind *s = &p->kind[b->kind];
    return &s->families[s->list[b->family_first + k]];
}

/* weld.c: equal corners of a block become one vertex. */
struct pack_vertex {
    uint64_t key;
    uint8_t rgba[4];
    uint32_t corner;                /* where it was met first: 3 leaf + corner */
};
struct pack_weld {
    struct pack_vertex *vertices;   /* by first use in canonical order */
    uint32_t count;
    uint16_t *indices;              /* [3 leaves] canonical order */
};
/* Arrays live until the next block. fails SPC_NO_MEMORY */
enum spc_status pack_weld(const struct pack *p, const struct pack_block *b, struct pack_weld *out,
                          struct spc_error *err);

/* Lattice number of a vertex, from the origin. */
static inline int64_t pack_vertex_at(const struct pack *p, const struct pack_vertex *v, int a)
{
    return p->leaves.wide ? (int64_t)p->leaves.wide[v->corner / 3][v->corner % 3][a]
                          : (int64_t)(v->key >> 21 * a & 0x1FFFFF);
}

/* cones.c: sum of the normals; order matters. */
void pack_normals_sum(const uint16_t *normals, uint32_t count, double sum[3]);

/*
 * A unit float vector near a sum, as it is stored, and exactly that direction in doubles: cosines against
 * it are measured, so its rounding does not matter.
 */
void pack_cone_axis(const double sum[3], float cone[3], double axis[3]);

/* Least cosine of a block's cones about the axes of their groups; also about p->axis: p->cosine. */
void pack_cones(struct pack *p, const struct pack_block *b, double cosine[SPC_NORMAL_CLUSTERS_MAX]);

/* payload.c: encodes block k and appends it to the spool's file. Fills p->out->blocks[k]. */
enum spc_status pack_payload(struct pack *p, uint32_t k, struct spc_error *err);

#endif
