/*
 * top.h - parts into one tree: build each part, then what lies above them.
 */
#ifndef SPB_TOP_H
#define SPB_TOP_H

#include "pack.h"
#include "plan.h"

/* What a built part leaves: its root and the pending nodes below it, with their leaves' records. */
struct spb_part_tree {
    struct spb_node *nodes;         /* node 0 is the part's root; children after their parent */
    uint32_t node_count;
    uint8_t *records;               /* of the leaves among them; nodes' link counts here */
    uint32_t height;                /* levels of the whole part, closed clusters included */
};
void spb_part_tree_release(struct spb_part_tree *part);

/*
 * Builds one part: splits its faces, combines bottom-up, closes clusters into the spool.
 * fails  SPC_NO_MEMORY, SPC_IO
 */
enum spc_status spb_part_build(const struct spb_part *part, struct spb_tmpfile *file,
                               const struct spb_pack_shared *shared, struct spb_part_tree *out,
                               struct spc_error *err);

/*
 * Builds the nodes above the parts by the same rules and closes the last cluster.
 * in   parts[plan->part_count], freed as they are taken
 * out  *root  spool number of the root's cluster; *height levels of the whole tree
 */
enum spc_status spb_top_build(const struct spb_plan *plan, struct spb_part_tree *parts,
                              const struct spb_pack_shared *shared, uint32_t *root,
                              uint32_t *height, struct spc_error *err);

#endif
