/*
 * pack.h - closed clusters of the tree as blocks.
 *
 * cut.c decides which nodes make a cluster; here they are put in order, quantised, get their final
 * errors and links, are grouped by normal, and encoded. Stages, a file each: collect.c, quantise.c with
 * leaves.c, order.c, payload.c with weld.c and cones.c; pack.c runs them and keeps the directory record.
 */
#ifndef SPB_PACK_H
#define SPB_PACK_H

#include "spool.h"
#include "tree.h"

struct spb_pack_options {
    uint32_t cluster_nodes, block_nodes, normal_clusters;
    uint32_t flags;                 /* enum spc_flags of the archive */
    enum spc_codec codec;
    int level;                      /* zstd */
};

struct pack_scratches;

/* Shared by all threads of a build, read only but for what locks itself. */
struct spb_pack_shared {
    struct spb_pack_options options;
    const struct spb_space *space;
    struct spb_record_format format;
    int16_t axes[128][3];
    double axis[128][3];            /* unit */
    uint8_t *axis_of;               /* [65536] nearest axis of a normal code */
    struct spb_spool *spool;
    struct pack_scratches *scratches;           /* scratch.h: memory of packing, in turns */
};
enum spc_status spb_pack_shared_init(struct spb_pack_shared *shared,
                                     const struct spb_pack_options *options,
                                     const struct spb_space *space, struct spb_spool *spool,
                                     const struct spb_record_format *format, struct spc_error *err);
void spb_pack_shared_release(struct spb_pack_shared *shared);

/* Most blocks of a cluster of so many nodes, as long as none is over block_nodes. */
uint32_t spb_pack_bands(uint32_t cluster_nodes);

/* A tree being built, and the records of its leaves (nodes' link). */
struct spb_pack_tree {
    const struct spb_pack_shared *shared;
    struct spb_node *nodes;
    const uint8_t *records;
};

/*
 * Closes the cluster of all pending nodes below node owner: packs it into the spool and makes the
 * node its owner, with its final e_self. The owner must not be a leaf.
 * fails  SPC_NO_MEMORY, SPC_IO
 */
enum spc_status spb_pack_close(const struct spb_pack_tree *tree, uint32_t owner,
                               struct spc_error *err);

/* Closes the last cluster: the root (node 0) and all pending nodes below it. *number: in the spool. */
enum spc_status spb_pack_close_root(const struct spb_pack_tree *tree, uint32_t *number,
                                    struct spc_error *err);

/*
 * Cuts after node index has been combined: while more than cluster_nodes nodes below it are
 * pending, the child with most pending nodes becomes an owner (first child on ties). So clusters
 * hold at most cluster_nodes nodes, and all but the root's at least a quarter of that, about.
 */
enum spc_status spb_cut(const struct spb_pack_tree *tree, uint32_t index, struct spc_error *err);

#endif
