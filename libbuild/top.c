#include "top.h"

#include <stdlib.h>
#include <string.h>

void spb_part_tree_release(struct spb_part_tree *part)
{
    free(part->nodes);
    free(part->records);
    *part = (struct spb_part_tree){0};
}

static enum spc_status no_memory(struct spc_error *err)
{
    return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to build the tree");
}

/* Children before parents: combine, then cut. Keeps what split.c has set. */
static enum spc_status finish_node(const struct spb_pack_tree *tree, uint32_t i,
                                   struct spc_error *err)
{
    struct spb_node *n = &tree->nodes[i];
    const uint32_t first = n->child_first;
    const uint8_t count = n->child_count;
    spb_node_combine(&tree->nodes[first], count,
                     (tree->shared->options.flags & SPC_FLAG_ERROR_PAPER) != 0,
                     spb_space_finest(tree->shared->space), n);
    n->child_first = first;
    n->child_count = count;
    return spb_cut(tree, i, err);
}

/* ---- one part ---------------------------------------------------------------------------------- */

static enum spc_status split_part(const struct spb_part *part,
                                  const struct spb_pack_shared *shared, const uint8_t *records,
                                  struct spb_tree *tree, struct spc_error *err)
{
    struct spb_key *keys = malloc((size_t)part->count * sizeof *keys);
    if (keys == NULL)
        return no_memory(err);
    for (uint64_t i = 0; i < part->count; i++) {
        struct spb_face face;
        spb_record_load(&shared->format, shared->space, records + i * shared->format.bytes, &face);
        spb_face_key(&face, keys[i].v);
        keys[i].face = i;
    }
    const enum spc_status status = spb_tree_split(keys, (uint32_t)part->count, tree, err);
    free(keys);
    return status;
}

/* The pending part of a tree, renumbered; closed subtrees end at their owners. */
static enum spc_status keep_pending(const struct spb_pack_tree *tree, uint32_t record_bytes,
                                    struct spb_part_tree *out, struct spc_error *err)
{
    const uint32_t max = tree->nodes[0].pending + 1;
    uint32_t leaves = 0;
    out->nodes = malloc(max * sizeof *out->nodes);
    if (out->nodes == NULL)
        return no_memory(err);
    out->nodes[0] = tree->nodes[0];
    out->node_count = 1;
    for (uint32_t i = 0; i < out->node_count; i++) {
        struct spb_node *n = &out->nodes[i];
        leaves += n->child_count == 0;
        if (n->owner)
            continue;               /* its children stay behind; child_count is kept */
        memcpy(&out->nodes[out->node_count], &tree->nodes[n->child_first],
               n->child_count * sizeof *n);
        n->child_first = out->node_count;
        out->node_count += n->child_count;
    }
    out->records = malloc((size_t)leaves * record_bytes + 1);
    if (out->records == NULL)
        return no_memory(err);
    uint32_t leaf = 0;
    for (uint32_t i = 0; i < out->node_count; i++) {
        struct spb_node *n = &out->nodes[i];
        if (n->child_count != 0)
            continue;
        memcpy(out->records + (size_t)leaf * record_bytes,
               tree->records + (size_t)n->link * record_bytes, record_bytes);
        n->link = leaf++;
    }
    return SPC_OK;
}

enum spc_status spb_part_build(const struct spb_part *part, struct spb_tmpfile *file,
                               const struct spb_pack_shared *shared, struct spb_part_tree *out,
                               struct spc_error *err)
{
    const uint32_t bytes = shared->format.bytes;
    struct spb_tree tree = {0};
    *out = (struct spb_part_tree){0};
    if (part->count >= (uint64_t)1 << 31)
        return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "a part is too large to build in memory");
    uint8_t *records = malloc((size_t)part->count * bytes);
    enum spc_status status = records ? spb_part_read(part, file, bytes, records, err)
                                     : no_memory(err);
    if (status == SPC_OK)
        status = split_part(part, shared, records, &tree, err);
    const struct spb_pack_tree pack = {shared, tree.nodes, records};
    for (uint32_t i = tree.node_count; i-- > 0 && status == SPC_OK;) {
        struct spb_node *n = &tree.nodes[i];
        if (n->child_count == 0) {
            struct spb_face face;
            const uint32_t number = n->link;
            spb_record_load(&shared->format, shared->space, records + (size_t)number * bytes,
                            &face);
            spb_leaf_make(shared->space, &face, number, n);
        } else {
            status = finish_node(&pack, i, err);
        }
    }
    if (status == SPC_OK)
        status = keep_pending(&pack, bytes, out, err);
    out->height = tree.height;
    if (status != SPC_OK)
        spb_part_tree_release(out);
    free(tree.nodes);
    free(records);
    return status;
}

/* ---- above the parts --------------------------------------------------------------------------- */

struct origin {                     /* where a node of the joined tree comes from */
    uint32_t plan;                  /* plan node, while part is SPC_NONE */
    uint32_t part, node;
};

struct joined {
    struct spb_node *nodes;
    struct origin *origins;
    bool *planned;                  /* above the parts: to be combined */
    uint32_t count;
    uint8_t *records;
    uint32_t record_count;
};

static enum spc_status reserve_joined(const struct spb_plan *plan,
                                      const struct spb_part_tree *parts, uint32_t record_bytes,
                                      struct joined *j, struct spc_error *err)
{
    uint64_t nodes = plan->node_count, leaves = 0;
    for (uint32_t i = 0; i < plan->part_count; i++) {
        nodes += parts[i].node_count;
        for (uint32_t k = 0; k < parts[i].node_count; k++)
            leaves += parts[i].nodes[k].child_count == 0;
    }
    if (nodes >= UINT32_MAX)
        return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "too many nodes above the parts");
    j->nodes = malloc((size_t)nodes * sizeof *j->nodes);
    j->origins = malloc((size_t)nodes * sizeof *j->origins);
    j->planned = calloc((size_t)nodes, sizeof *j->planned);
    j->records = malloc((size_t)leaves * record_bytes + 1);
    return j->nodes && j->origins && j->planned && j->records ? SPC_OK : no_memory(err);
}

static struct origin origin_of_plan(const struct spb_plan *plan, uint32_t node)
{
    if (plan->nodes[node].child_count == 0)
        return (struct origin){node, plan->nodes[node].part, 0};
    return (struct origin){node, SPC_NONE, 0};
}

/* Breadth first, so that children are adjacent and behind their parent. */
static void join(const struct spb_plan *plan, const struct spb_part_tree *parts,
                 uint32_t record_bytes, struct joined *j)
{
    j->origins[0] = origin_of_plan(plan, 0);
    j->count = 1;
    for (uint32_t i = 0; i < j->count; i++) {
        const struct origin o = j->origins[i];
        struct spb_node *n = &j->nodes[i];
        if (o.part == SPC_NONE) {
            const struct spb_plan_node *p = &plan->nodes[o.plan];
            *n = (struct spb_node){.child_first = j->count, .child_count = (uint8_t)p->child_count};
            j->planned[i] = true;
            for (uint32_t k = 0; k < p->child_count; k++)
                j->origins[j->count++] = origin_of_plan(plan, p->child[k]);
            continue;
        }
        const struct spb_part_tree *part = &parts[o.part];
        *n = part->nodes[o.node];
        if (n->child_count == 0) {
            memcpy(j->records + (size_t)j->record_count * record_bytes,
                   part->records + (size_t)n->link * record_bytes, record_bytes);
            n->link = j->record_count++;
        } else if (!n->owner) {
            const uint32_t first = n->child_first;
            n->child_first = j->count;
            for (uint32_t k = 0; k < n->child_count; k++)
                j->origins[j->count++] = (struct origin){0, o.part, first + k};
        }
    }
}

static uint32_t height_of(const struct spb_plan *plan, const struct spb_part_tree *parts)
{
    uint32_t height = 0;
    for (uint32_t i = 0; i < plan->part_count; i++) {
        const uint32_t h = plan->parts[i].level + parts[i].height;
        height = h > height ? h : height;
    }
    return height;
}

enum spc_status spb_top_build(const struct spb_plan *plan, struct spb_part_tree *parts,
                              const struct spb_pack_shared *shared, uint32_t *root,
                              uint32_t *height, struct spc_error *err)
{
    struct joined j = {0};
    *height = height_of(plan, parts);
    enum spc_status status = reserve_joined(plan, parts, shared->format.bytes, &j, err);
    if (status == SPC_OK) {
        join(plan, parts, shared->format.bytes, &j);
        for (uint32_t i = 0; i < plan->part_count; i++)
            spb_part_tree_release(&parts[i]);
    }
    const struct spb_pack_tree pack = {shared, j.nodes, j.records};
    for (uint32_t i = j.count; i-- > 0 && status == SPC_OK;)
        if (j.planned[i])
            status = finish_node(&pack, i, err);
    if (status == SPC_OK)
        status = spb_pack_close_root(&pack, root, err);
    free(j.nodes);
    free(j.origins);
    free(j.planned);
    free(j.records);
    return status;
}
