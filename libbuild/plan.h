/*
 * plan.h - the top of the tree, down to subtrees small enough to be built in memory.
 *
 * The plan applies the split rule to whole buckets. Sets that are too large and too narrow for
 * their grid are distributed again over a finer one. What the plan calls a part is a subtree of
 * the one tree that the data define; where the plan stops depends on memory, the tree does not.
 */
#ifndef SPB_PLAN_H
#define SPB_PLAN_H

#include "distribute.h"
#include "progress.h"

struct spb_piece {                  /* records [first, first + count) of a bucket */
    const struct spb_bucket *bucket;
    uint64_t first, count;
};

struct spb_part {
    struct spb_piece *pieces;
    uint32_t piece_count;
    uint64_t count;                 /* records */
    uint32_t node;                  /* plan node it is */
};

struct spb_plan_node {              /* inner node above the parts, or a part */
    uint32_t child[4];              /* plan nodes, in the tree's child order */
    uint32_t child_count;           /* 0: a part */
    uint32_t part;
};

struct spb_plan {
    struct spb_plan_node *nodes;    /* node 0 is the root; children after their parent */
    uint32_t node_count, node_max;
    struct spb_part *parts;
    uint32_t part_count, part_max;
    struct spb_bucket **buckets;    /* all buckets, owned */
    uint32_t bucket_count, bucket_max;
};

/*
 * Plans the flushed distributor's buckets (taken over, also on failure) into parts of at most
 * part_faces records. memory: bytes that distributing again may take for buffers.
 * fails  SPC_NO_MEMORY, SPC_IO, SPC_CANCELLED
 */
enum spc_status spb_plan_make(struct spb_plan *plan, struct spb_distributor *distributor,
                              struct spb_tmpfile *file, const struct spb_space *space,
                              uint64_t part_faces, uint64_t memory, struct spb_progress *progress,
                              struct spc_error *err);
void spb_plan_release(struct spb_plan *plan);

/* A part whose records will be read soon. */
void spb_part_prefetch(const struct spb_part *part, struct spb_tmpfile *file);

/*
 * Reads a part's records: records[part->count * record_bytes], input order within equal keys. Once:
 * their disk space is given back.
 */
enum spc_status spb_part_read(const struct spb_part *part, struct spb_tmpfile *file,
                              uint32_t record_bytes, uint8_t *records, struct spc_error *err);

#endif
