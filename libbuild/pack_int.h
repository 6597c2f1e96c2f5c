/* pack_int.h - a cluster on its way through the stages of packing. */
#ifndef SPB_PACK_INT_H
#define SPB_PACK_INT_H

#include "pack.h"

#define PACK_OWNER UINT32_MAX       /* parent of the tops */

struct pack_node {                  /* one node of the cluster; parents before children */
    uint32_t node;                  /* in the tree */
    uint32_t parent;                /* in pack.nodes, or PACK_OWNER */
    uint32_t child_first;           /* in pack.nodes; children are adjacent; 0 for leaves, owners */
    bool leaf;
    int step_exp;                   /* lattice of its center, exponent in units */
    double center[3];               /* decoded, build coordinates */
    double radius, height;          /* decoded, units */
    uint16_t radius_code, e_self, e_parent;
    uint8_t height_code;
    double link;                    /* needed, before coding */
};

struct pack_family {                /* inner children or leaf children of one node */
    uint32_t first;                 /* position in the sequence */
    uint32_t count;
    uint32_t group;                 /* normal cluster */
};

struct pack_block {
    enum spc_block_kind kind;
    uint32_t family_first, family_count;
    uint32_t first, count;          /* in the sequence, which is stored order then */
};

struct pack_sequence {              /* nodes of one kind */
    uint32_t *nodes;                /* [node_count] canonical order, then stored order */
    uint32_t node_count;
    struct pack_family *families;
    uint32_t family_count;
};

struct pack {
    const struct spb_pack_tree *tree;
    const struct spb_pack_shared *shared;
    const struct spb_node *owner;   /* NULL for the root's cluster */
    struct pack_node *nodes;
    uint32_t node_count, inner_count, owner_count;
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

/* payload.c: encodes block k and appends it to the spool's file. Fills p->out->blocks[k]. */
enum spc_status pack_payload(struct pack *p, uint32_t k, struct spc_error *err);

/* Copies the records of tops that lie in a block (nodes: its records) to the directory record. */
void pack_copy_tops(struct pack *p, const struct pack_block *pb, const struct spc_block *b,
                    const uint8_t *nodes);

/* Cosine of the cone about axis that holds the node's cone; -1 for every direction. */
double pack_cone_about(const double axis[3], const struct spb_node *node);

#endif
