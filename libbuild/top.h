/*
 * top.h - parts into one tree: build each part, then what lies above them.
 *
 * A plan node is built as soon as all its children are, and clusters close as they fill. Parts are
 * in the plan's depth-first order, so what waits is the pending nodes of some siblings a level of
 * the plan, not of all parts: in memory, or on disk where that would be too much.
 */
#ifndef SPB_TOP_H
#define SPB_TOP_H

#include "pack.h"
#include "plan.h"

#include <pthread.h>

struct spb_subtree;
struct spb_workspace;

struct spb_top {
    const struct spb_plan *plan;
    const struct spb_pack_shared *shared;
    struct spb_tmpfile *file;       /* of the parts' records, and of trees that wait */
    struct spb_subtree *subtrees;   /* [plan->node_count] built, and not yet in their parent's */
    pthread_mutex_t lock;
    pthread_cond_t joined;
    struct spb_workspace *idle;     /* memory of parts that were built, for the next ones */
    uint64_t waiting, waiting_max;  /* bytes of built trees in memory; others wait on disk */
    unsigned ahead;
    unsigned joins;                 /* plan nodes that may be built at once, less those that are */
};

/*
 * waiting  bytes of trees that may wait in memory
 * joins    plan nodes above the parts that are built at once, at least 1; each takes up to five
 *          times the pending nodes of a cluster, with their leaves' records
 * ahead    parts by which fetching records from disk goes before building: those built at once
 * fails    SPC_NO_MEMORY
 */
enum spc_status spb_top_init(struct spb_top *top, const struct spb_plan *plan,
                             struct spb_tmpfile *file, const struct spb_pack_shared *shared,
                             uint64_t waiting, unsigned joins, unsigned ahead, struct spc_error *err);
void spb_top_release(struct spb_top *top);

/*
 * Builds one part, then all plan nodes that it completes: splits faces, combines bottom-up, closes
 * clusters into the spool. Any thread, any order.
 * fails  SPC_NO_MEMORY, SPC_IO
 */
enum spc_status spb_top_part(struct spb_top *top, uint32_t part, struct spc_error *err);

/*
 * When all parts are built: closes the last cluster.
 * out  *root  spool number of the root's cluster; *height levels of the whole tree
 */
enum spc_status spb_top_finish(struct spb_top *top, uint32_t *root, uint32_t *height,
                               struct spc_error *err);

#endif
