/* pack_int.h - a cluster on its way through the stages of packing. */
#ifndef SPB_PACK_INT_H
#define SPB_PACK_INT_H

#include "pack.h"

#include <string.h>

#define PACK_OWNER UINT32_MAX       /* parent of the tops */

struct pack_node {                  /* one node of the cluster; parents before children */
    uint32_t node;                  /* in the tree */
    uint32_t parent;                /* in pack.nodes, or PACK_OWNER */
    uint32_t child_first;           /* in pack.nodes; children are adjacent; 0 for leaves, owners */
    uint32_t leaf_number;           /* in pack.leaves */
    bool leaf;
    int step_exp;                   /* lattice of its center, exponent in units */
    double center[3];               /* decoded, build coordinates */
    double radius, height;          /* decoded, units */
    uint16_t radius_code, e_self, e_parent, normal;
    uint8_t height_code;
    double link;                    /* needed, before coding */
    uint32_t block;                 /* in pack.blocks */
    uint16_t number;                /* in its block, canonical order */
};

struct pack_leaf {                  /* a triangle as the archive will hold it */
    int64_t corner[3][3];           /* lattice numbers, counted from file coordinate 0 */
    uint8_t rgba[3][4];
};

struct pack_family {                /* inner children or leaf children of one node */
    uint32_t first;                 /* in the sequence */
    uint32_t count;
    uint32_t group;                 /* normal cluster */
    uint32_t parent;                /* in pack.nodes, or PACK_OWNER */
    uint16_t e_parent;
};

struct pack_block {
    enum spc_block_kind kind;
    uint32_t family_first, family_count;        /* in the sequence's list */
    uint32_t count;                 /* nodes */
};

struct pack_sequence {              /* nodes of one kind */
    uint32_t *nodes;                /* [node_count] canonical order */
    uint32_t node_count;
    struct pack_family *families;   /* [family_count] canonical order */
    uint32_t *list;                 /* [family_count] block after block, canonical in a block */
    uint32_t family_count;
};

struct pack {
    const struct spb_pack_tree *tree;
    const struct spb_pack_shared *shared;
    const struct spb_node *owner;   /* NULL for the root's cluster */
    struct pack_node *nodes;
    uint32_t node_count, inner_count, owner_count;
    struct pack_leaf *leaves;       /* [node_count - inner_count] */
    struct pack_sequence sequence[2];           /* by enum spc_block_kind */
    struct pack_block *blocks;      /* prefix order */
    uint32_t block_count;
    double origin[3];               /* build coordinates */
    float box[6];                   /* of pills' balls, relative to origin, outward */
    double diagonal;
    double owner_radius, owner_shift;           /* declared: see quantise.c */
    uint16_t owner_e;               /* e_parent of the tops */
    uint32_t *children;             /* spool numbers of the owners' clusters, canonical order */
    struct spb_cluster *out;
};

/* quantise.c: origin, steps, decoded centres, radii, heights; errors; box; links. */
void pack_quantise(struct pack *p);

/* order.c: canonical order, families, blocks. fails SPC_NO_MEMORY */
enum spc_status pack_order(struct pack *p, struct spc_error *err);

/* What the cluster's blocks count from; once its origin is known. */
struct spc_frame pack_frame(const struct pack *p);

/* Family k of a block, canonical order. */
static inline const struct pack_family *pack_family_of(const struct pack *p,
                                                       const struct pack_block *b, uint32_t k)
{
    const struct pack_sequence *s = &p->sequence[b->kind];
    return &s->families[s->list[b->family_first + k]];
}

/* payload.c: encodes block k and appends it to the spool's file. Fills p->out->blocks[k]. */
enum spc_status pack_payload(struct pack *p, uint32_t k, struct spc_error *err);

/* Copies the record of a node to the directory record if it is a top. */
void pack_copy_top(struct pack *p, uint32_t node, const struct spc_block *b,
                   const uint8_t *record);

/* Cosine of the cone about axis that holds the node's cone; -1 for every direction. */
double pack_cone_about(const double axis[3], const struct spb_node *node);

#endif
