/*
 * cut.c - where clusters end.
 *
 * A cluster is the nodes below its owner, without the owner. The rule looks at counts below one
 * node only, bottom-up: what happens elsewhere, in another part say, cannot change it.
 */
#include "pack.h"

enum spc_status spb_cut(const struct spb_pack_tree *tree, uint32_t index, struct spc_error *err)
{
    struct spb_node *node = &tree->nodes[index];
    for (;;) {
        uint32_t pending = 0, largest = 0;
        for (uint32_t k = 0; k < node->child_count; k++) {
            pending += 1 + tree->nodes[node->child_first + k].pending;
            if (tree->nodes[node->child_first + k].pending >
                tree->nodes[node->child_first + largest].pending)
                largest = k;
        }
        node->pending = pending;
        if (pending < tree->shared->options.cluster_nodes)     /* the root joins its own */
            return SPC_OK;
        const enum spc_status status = spb_pack_close(tree, node->child_first + largest, err);
        if (status != SPC_OK)
            return status;
    }
}
