/*
 * fuzz_verify.c - the proof must say something about every archive that opens, and what it says
 * must fit: nothing broken means that every tree loads.
 */
#include "fuzz.h"

#include "spc.h"

#include <assert.h>
#include <string.h>

/* A few bytes may stand for many equal nodes: larger archives are left to fuzz_decode. */
enum { NODES_MAX = 200000 };

static void listen(void *ctx, const struct spc_finding *finding)
{
    assert(finding->invariant != NULL && finding->ok == (finding->error.status == SPC_OK));
    assert(memchr(finding->error.what, '\0', sizeof finding->error.what) != NULL);
    *(bool *)ctx |= !finding->ok;
}

/* Parents come before their children, and everything has its place once. */
static void hold_tree(const struct spc_tree *t, const struct spc_cluster *c)
{
    assert(t->inner_count == c->inner_count && t->node_count == c->inner_count + c->leaf_count);
    uint32_t owners = 0, orphans = 0;
    for (uint32_t i = 0; i < t->node_count; i++) {
        assert(t->order[i] < t->node_count);
        assert(t->block_of[i] - c->block_first < c->block_count);
        assert(t->parent[i] == SPC_PARENT_OWNER || t->parent[i] < t->inner_count);
        orphans += t->parent[i] == SPC_PARENT_OWNER;
        if (i < t->inner_count && t->child_cluster[i] != SPC_NO_CHILD_CLUSTER) {
            assert(t->child_cluster[i] - c->child_first < c->child_count);
            owners++;
        }
    }
    assert(owners == c->child_count && orphans == c->top_count);
}

int fuzz_verify(const uint8_t *bytes, size_t size)
{
    struct spc_reader *r = NULL;
    struct spc_error err = {0};
    bool broken = false;
    if (spc_reader_open_memory(bytes, size, &r, NULL) != SPC_OK)
        return 0;
    const struct spc_header *h = spc_reader_header(r);
    if (h->node_count + h->vertex_count <= NODES_MAX) {
        const enum spc_status whole = spc_verify(r, 3, listen, &broken, &err);
        assert(whole == err.status && broken == (whole != SPC_OK));
        for (uint32_t id = 0; id < h->cluster_count; id++) {
            struct spc_cluster c;
            struct spc_tree *tree = NULL;
            spc_reader_cluster(r, id, &c);
            const enum spc_status status = spc_tree_load(r, id, &tree, NULL);
            assert((status == SPC_OK) == (tree != NULL));
            assert(status == SPC_OK || whole != SPC_OK);
            if (tree != NULL)
                hold_tree(tree, &c);
            spc_tree_free(tree);
        }
    }
    spc_reader_close(r);
    return 0;
}
