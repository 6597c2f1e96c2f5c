/*
 * spool.h - finished clusters on disk until the tree is complete and their order is known.
 *
 * Clusters arrive as parts finish, in any order and from several threads; they leave parents
 * first, level by level, so the bytes of the archive do not depend on timing.
 */
#ifndef SPB_SPOOL_H
#define SPB_SPOOL_H

#include "progress.h"
#include "tmpfile.h"

struct spb_shapes {                 /* triangles that coding has changed by more than a stated share */
    uint64_t moved;                 /* a corner went by more than 1/16 of their longest edge, */
    uint64_t flat;                  /* or that did not, but their area is lost */
    double least, most;             /* longest edges of those moved, units */
};

struct spb_cluster {                /* finished; place in the file, ids and offsets not yet known */
    struct spc_cluster record;
    struct spc_block *blocks;       /* [record.block_count] */
    uint64_t *stored_off;           /* [record.block_count] payloads in the temporary file */
    uint32_t *children;             /* [record.child_count] spool numbers, canonical order */
    uint16_t inner_e_min, inner_e_max;          /* e_self of inner nodes; min > max without */
    struct spb_shapes shapes;
    double corner_min[3], corner_max[3];        /* lattice numbers, from the space's origin */
};

struct spb_spool;

/* The file stays the caller's. fails SPC_NO_MEMORY */
enum spc_status spb_spool_create(struct spb_tmpfile *file, struct spb_spool **out,
                                 struct spc_error *err);
void spb_spool_free(struct spb_spool *spool);

/* Takes the cluster over, also on failure. *number names it from now on. */
enum spc_status spb_spool_add(struct spb_spool *spool, struct spb_cluster *cluster,
                              uint32_t *number, struct spc_error *err);

/* A cluster that was added; it no longer changes and lives as long as the spool. */
const struct spb_cluster *spb_spool_get(struct spb_spool *spool, uint32_t number);

/* Where payloads of clusters are kept. */
struct spb_tmpfile *spb_spool_file(struct spb_spool *spool);

/* Frees a cluster that was never added. */
void spb_cluster_free(struct spb_cluster *cluster);

/* Sums over all clusters, for the header: counts of clusters, blocks, nodes, leaves, vertices,
 * and the range of inner nodes' errors. */
void spb_spool_count(const struct spb_spool *spool, struct spc_header *header);

/* What coding has done to all of them, and the box of their corners. */
void spb_spool_shapes(const struct spb_spool *spool, struct spb_shapes *shapes, double corner_min[3],
                      double corner_max[3]);

/*
 * Writes all clusters below and with root, level by level.
 * fails  SPC_IO, SPC_NO_MEMORY, SPC_CANCELLED
 */
enum spc_status spb_spool_write(struct spb_spool *spool, uint32_t root, struct spc_writer *writer,
                                struct spb_progress *progress, struct spc_error *err);

#endif
