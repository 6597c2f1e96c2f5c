#include "top.h"

#include "pool.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* What a built plan node leaves: itself and the pending nodes below it, with their leaves' records. */
struct tree {
    struct spb_node *nodes;         /* node 0 is the root; children after their parent */
    uint32_t node_count;
    uint8_t *records;               /* of the leaves among them; nodes' link counts here */
    uint32_t record_count;
    uint32_t height;                /* levels, closed clusters included */
};

struct spb_subtree {
    struct tree tree;
    bool on_disk;                   /* nodes, then records, at off */
    uint64_t off;
    uint32_t parent;                /* plan node; SPC_NONE for the root */
    atomic_uint missing;            /* children that are not built */
};

static void tree_release(struct tree *tree)
{
    free(tree->nodes);
    free(tree->records);
    *tree = (struct tree){0};
}

static enum spc_status no_memory(struct spc_error *err)
{
    return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to build the tree");
}

/* Inner nodes among [begin, end), then where clusters end: from last to first, children before parents. */
static enum spc_status finish_nodes(const struct spb_pack_tree *tree, uint32_t begin, uint32_t end,
                                    struct spc_error *err)
{
    const struct spb_pack_shared *shared = tree->shared;
    enum spc_status status = SPC_OK;
    spb_inner_make(tree->nodes, begin, end, (shared->options.flags & SPC_FLAG_ERROR_PAPER) != 0,
                   spb_space_finest(shared->space));
    for (uint32_t i = end; i-- > begin && status == SPC_OK;)
        if (tree->nodes[i].child_count > 0)
            status = spb_cut(tree, i, err);
    return status;
}

/* ---- memory of a part -------------------------------------------------------------------------- */

/* Kept for the next part: fresh memory costs more time than splitting does. */
struct spb_workspace {
    struct spb_workspace *next;
    uint8_t *records;
    size_t records_max;             /* bytes */
    struct spb_key *keys;
    uint64_t keys_max;
    struct spb_tree tree;
};

static void workspace_free(struct spb_workspace *w)
{
    if (w == NULL)
        return;
    free(w->records);
    free(w->keys);
    free(w->tree.nodes);
    free(w);
}

static struct spb_workspace *workspace_take(struct spb_top *top)
{
    pthread_mutex_lock(&top->lock);
    struct spb_workspace *w = top->idle;
    if (w != NULL)
        top->idle = w->next;
    pthread_mutex_unlock(&top->lock);
    return w != NULL ? w : calloc(1, sizeof *w);
}

static void workspace_give(struct spb_top *top, struct spb_workspace *w)
{
    pthread_mutex_lock(&top->lock);
    w->next = top->idle;
    top->idle = w;
    pthread_mutex_unlock(&top->lock);
}

static void workspaces_free(struct spb_top *top)
{
    while (top->idle != NULL) {
        struct spb_workspace *w = top->idle;
        top->idle = w->next;
        workspace_free(w);
    }
}

static enum spc_status workspace_reserve(struct spb_workspace *w, uint64_t count, uint32_t bytes,
                                         struct spc_error *err)
{
    if (count * bytes > w->records_max) {
        free(w->records);
        w->records = malloc((size_t)count * bytes);
        w->records_max = w->records ? (size_t)count * bytes : 0;
    }
    if (count > w->keys_max) {
        free(w->keys);
        w->keys = malloc((size_t)count * sizeof *w->keys);
        w->keys_max = w->keys ? count : 0;
    }
    return w->records != NULL && w->keys != NULL ? SPC_OK : no_memory(err);
}

/* ---- one part ---------------------------------------------------------------------------------- */

/* The pending part of a tree, renumbered; closed subtrees end at their owners. */
static enum spc_status keep_pending(const struct spb_pack_tree *tree, uint32_t record_bytes,
                                    struct tree *out, struct spc_error *err)
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
    out->record_count = leaves;
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

/* Nodes [begin, end), of which all that is below was made or is among them: from last to first. */
static enum spc_status make_nodes(const struct spb_pack_tree *pack, uint32_t begin, uint32_t end,
                                  struct spc_error *err)
{
    const struct spb_pack_shared *shared = pack->shared;
    if (spb_pool_cancelled())
        return spc_fail(err, SPC_CANCELLED, SPC_NO_OFF, "cancelled");
    spb_leaves_make(shared->space, &shared->format, pack->records, &pack->nodes[begin],
                    end - begin);
    return finish_nodes(pack, begin, end, err);
}

static enum spc_status make_tree(const struct spb_pack_shared *shared, struct spb_workspace *w,
                                 uint32_t count, struct spc_error *err)
{
    struct spb_splitter splitter;
    uint32_t begin = 0, end = 1;
    enum spc_status status = spb_split_begin(&splitter, w->keys, count, &w->tree, err);
    while (status == SPC_OK && begin < end) {
        status = spb_split_next(&splitter, &begin, &end, err);
        const struct spb_pack_tree pack = {shared, w->tree.nodes, w->records};
        if (status == SPC_OK)
            status = make_nodes(&pack, begin, end, err);
    }
    spb_split_end(&splitter);
    return status;
}

static enum spc_status build_part(const struct spb_part *part, struct spb_tmpfile *file,
                                  const struct spb_pack_shared *shared, struct spb_workspace *w,
                                  struct tree *out, struct spc_error *err)
{
    const uint32_t bytes = shared->format.bytes;
    *out = (struct tree){0};
    if (part->count >= (uint64_t)1 << 31)
        return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "a part is too large to build in memory");
    enum spc_status status = workspace_reserve(w, part->count, bytes, err);
    if (status == SPC_OK)
        status = spb_part_read(part, file, bytes, w->records, err);
    if (status == SPC_OK) {
        spb_record_keys(&shared->format, shared->space, w->records, (uint32_t)part->count,
                        &w->keys[0].v);
        status = make_tree(shared, w, (uint32_t)part->count, err);
    }
    const struct spb_pack_tree pack = {shared, w->tree.nodes, w->records};
    if (status == SPC_OK)
        status = keep_pending(&pack, bytes, out, err);
    out->height = w->tree.height;
    if (status != SPC_OK)
        tree_release(out);
    return status;
}

/* ---- above the parts --------------------------------------------------------------------------- */

/* A tree's nodes but its root, which is root_at already, to the end of out; its records, too. */
static void append(const struct tree *tree, uint32_t record_bytes, uint32_t root_at,
                   struct tree *out)
{
    const uint32_t base = out->node_count;
    for (uint32_t i = 0; i < tree->node_count; i++) {
        struct spb_node *n = &out->nodes[i == 0 ? root_at : base + i - 1];
        *n = tree->nodes[i];
        if (n->child_count == 0)
            n->link += out->record_count;
        else if (!n->owner)
            n->child_first = base + n->child_first - 1;
    }
    memcpy(out->records + (size_t)out->record_count * record_bytes, tree->records,
           (size_t)tree->record_count * record_bytes);
    out->node_count += tree->node_count - 1;
    out->record_count += tree->record_count;
    out->height = tree->height + 1 > out->height ? tree->height + 1 : out->height;
}

static uint64_t tree_bytes(const struct spb_top *top, const struct tree *tree)
{
    return (uint64_t)tree->node_count * sizeof *tree->nodes +
           (uint64_t)tree->record_count * top->shared->format.bytes;
}

/* A built tree waits for its siblings: in memory while there is room, else on disk. */
static enum spc_status wait_for_siblings(struct spb_top *top, struct spb_subtree *s,
                                         struct spc_error *err)
{
    const uint64_t bytes = tree_bytes(top, &s->tree);
    pthread_mutex_lock(&top->lock);
    s->on_disk = bytes > top->waiting_max - top->waiting;
    if (!s->on_disk)
        top->waiting += bytes;
    pthread_mutex_unlock(&top->lock);
    if (!s->on_disk)
        return SPC_OK;
    struct iovec parts[2] = {
        {s->tree.nodes, s->tree.node_count * sizeof *s->tree.nodes},
        {s->tree.records, (size_t)s->tree.record_count * top->shared->format.bytes},
    };
    const enum spc_status status = spb_tmpfile_append_parts(top->file, parts, 2, &s->off, err);
    free(s->tree.nodes);
    free(s->tree.records);
    s->tree.nodes = NULL;
    s->tree.records = NULL;
    return status;
}

static enum spc_status end_waiting(struct spb_top *top, struct spb_subtree *s, struct spc_error *err)
{
    const uint64_t bytes = tree_bytes(top, &s->tree);
    if (!s->on_disk) {
        pthread_mutex_lock(&top->lock);
        top->waiting -= bytes;
        pthread_mutex_unlock(&top->lock);
        return SPC_OK;
    }
    const size_t node_bytes = s->tree.node_count * sizeof *s->tree.nodes;
    s->tree.nodes = malloc(node_bytes);
    s->tree.records = malloc((size_t)(bytes - node_bytes) + 1);
    if (s->tree.nodes == NULL || s->tree.records == NULL)
        return no_memory(err);
    enum spc_status status = spb_tmpfile_read(top->file, s->off, s->tree.nodes, node_bytes, err);
    if (status == SPC_OK)
        status = spb_tmpfile_read(top->file, s->off + node_bytes, s->tree.records,
                                  (size_t)(bytes - node_bytes), err);
    spb_tmpfile_discard(top->file, s->off, bytes);
    return status;
}

/* The children's trees under a new root. They are freed. */
static enum spc_status join(struct spb_top *top, const struct spb_plan_node *plan,
                            struct tree *out, struct spc_error *err)
{
    const uint32_t bytes = top->shared->format.bytes;
    uint64_t nodes = 1, records = 0;
    enum spc_status status = SPC_OK;
    for (uint32_t k = 0; k < plan->child_count; k++) {
        nodes += top->subtrees[plan->child[k]].tree.node_count;
        records += top->subtrees[plan->child[k]].tree.record_count;
    }
    if (nodes >= UINT32_MAX)
        return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "too many nodes above the parts");
    out->nodes = malloc((size_t)nodes * sizeof *out->nodes);
    out->records = malloc((size_t)records * bytes + 1);
    if (out->nodes == NULL || out->records == NULL)
        return no_memory(err);
    out->nodes[0] = (struct spb_node){.child_first = 1, .child_count = (uint8_t)plan->child_count};
    out->node_count = 1 + plan->child_count;
    for (uint32_t k = 0; k < plan->child_count && status == SPC_OK; k++) {
        struct spb_subtree *child = &top->subtrees[plan->child[k]];
        status = end_waiting(top, child, err);
        if (status == SPC_OK)
            append(&child->tree, bytes, 1 + k, out);
        tree_release(&child->tree);
    }
    return status;
}

static void begin_join(struct spb_top *top)
{
    pthread_mutex_lock(&top->lock);
    while (top->joins == 0)
        pthread_cond_wait(&top->joined, &top->lock);
    top->joins--;
    pthread_mutex_unlock(&top->lock);
}

static void end_join(struct spb_top *top)
{
    pthread_mutex_lock(&top->lock);
    top->joins++;
    pthread_cond_signal(&top->joined);
    pthread_mutex_unlock(&top->lock);
}

static enum spc_status build_above(struct spb_top *top, uint32_t node, struct spc_error *err)
{
    struct tree joined = {0};
    struct tree *out = &top->subtrees[node].tree;
    enum spc_status status = join(top, &top->plan->nodes[node], &joined, err);
    const struct spb_pack_tree pack = {top->shared, joined.nodes, joined.records};
    if (status == SPC_OK)
        status = finish_nodes(&pack, 0, 1, err);
    if (status == SPC_OK)
        status = keep_pending(&pack, top->shared->format.bytes, out, err);
    out->height = joined.height;
    tree_release(&joined);
    return status;
}

enum spc_status spb_top_part(struct spb_top *top, uint32_t part, struct spc_error *err)
{
    const struct spb_part *p = &top->plan->parts[part];
    uint32_t node = p->node;
    struct spb_workspace *w = workspace_take(top);
    if (w == NULL)
        return no_memory(err);
    if (part + top->ahead < top->plan->part_count)
        spb_part_prefetch(&top->plan->parts[part + top->ahead], top->file);
    enum spc_status status =
        build_part(p, top->file, top->shared, w, &top->subtrees[node].tree, err);
    workspace_give(top, w);
    while (status == SPC_OK && top->subtrees[node].parent != SPC_NONE) {
        status = wait_for_siblings(top, &top->subtrees[node], err);
        node = top->subtrees[node].parent;
        if (status != SPC_OK || atomic_fetch_sub(&top->subtrees[node].missing, 1) > 1)
            break;                  /* whoever builds the last child goes on */
        begin_join(top);
        status = build_above(top, node, err);
        end_join(top);
    }
    return status;
}

enum spc_status spb_top_init(struct spb_top *top, const struct spb_plan *plan,
                             struct spb_tmpfile *file, const struct spb_pack_shared *shared,
                             uint64_t waiting, unsigned joins, unsigned ahead, struct spc_error *err)
{
    *top = (struct spb_top){.plan = plan, .shared = shared, .file = file, .waiting_max = waiting,
                            .joins = joins, .ahead = ahead,
                            .subtrees = calloc(plan->node_count, sizeof *top->subtrees)};
    if (top->subtrees == NULL)
        return no_memory(err);
    pthread_mutex_init(&top->lock, NULL);
    pthread_cond_init(&top->joined, NULL);
    top->subtrees[0].parent = SPC_NONE;
    for (uint32_t i = 0; i < plan->node_count; i++) {
        atomic_init(&top->subtrees[i].missing, plan->nodes[i].child_count);
        for (uint32_t k = 0; k < plan->nodes[i].child_count; k++)
            top->subtrees[plan->nodes[i].child[k]].parent = i;
    }
    return SPC_OK;
}

void spb_top_release(struct spb_top *top)
{
    if (top->subtrees == NULL)
        return;
    for (uint32_t i = 0; i < top->plan->node_count; i++)
        tree_release(&top->subtrees[i].tree);
    workspaces_free(top);
    pthread_cond_destroy(&top->joined);
    pthread_mutex_destroy(&top->lock);
    free(top->subtrees);
    *top = (struct spb_top){0};
}

enum spc_status spb_top_finish(struct spb_top *top, uint32_t *root, uint32_t *height,
                               struct spc_error *err)
{
    const struct tree *tree = &top->subtrees[0].tree;
    const struct spb_pack_tree pack = {top->shared, tree->nodes, tree->records};
    workspaces_free(top);
    *height = tree->height;
    return spb_pack_close_root(&pack, root, err);
}
