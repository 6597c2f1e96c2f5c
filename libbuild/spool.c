#include "spool.h"

#include "vec.h"

#include <pthread.h>
#include <stdlib.h>

struct spb_spool {
    struct spb_tmpfile *file;
    pthread_mutex_t lock;
    struct spb_cluster **clusters;
    uint32_t count, max;
};

enum spc_status spb_spool_create(struct spb_tmpfile *file, struct spb_spool **out,
                                 struct spc_error *err)
{
    struct spb_spool *s = calloc(1, sizeof *s);
    *out = s;
    if (s == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for the list of clusters");
    s->file = file;
    pthread_mutex_init(&s->lock, NULL);
    return SPC_OK;
}

void spb_cluster_free(struct spb_cluster *c)
{
    if (c == NULL)
        return;
    free(c->blocks);
    free(c->stored_off);
    free(c->children);
    free(c);
}

void spb_spool_free(struct spb_spool *s)
{
    if (s == NULL)
        return;
    for (uint32_t i = 0; i < s->count; i++)
        spb_cluster_free(s->clusters[i]);
    free(s->clusters);
    pthread_mutex_destroy(&s->lock);
    free(s);
}

static bool add_locked(struct spb_spool *s, struct spb_cluster *c, uint32_t *number)
{
    if (s->count == s->max) {
        const uint32_t grown = s->max ? 2 * s->max : 256;
        struct spb_cluster **clusters = realloc(s->clusters, grown * sizeof *clusters);
        if (clusters == NULL)
            return false;
        s->clusters = clusters;
        s->max = grown;
    }
    *number = s->count;
    s->clusters[s->count++] = c;
    return true;
}

enum spc_status spb_spool_add(struct spb_spool *s, struct spb_cluster *c, uint32_t *number,
                              struct spc_error *err)
{
    pthread_mutex_lock(&s->lock);
    const bool added = add_locked(s, c, number);
    pthread_mutex_unlock(&s->lock);
    if (added)
        return SPC_OK;
    spb_cluster_free(c);
    return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for the list of clusters");
}

const struct spb_cluster *spb_spool_get(struct spb_spool *s, uint32_t number)
{
    pthread_mutex_lock(&s->lock);
    const struct spb_cluster *c = s->clusters[number];
    pthread_mutex_unlock(&s->lock);
    return c;
}

struct spb_tmpfile *spb_spool_file(struct spb_spool *s)
{
    return s->file;
}

void spb_spool_count(const struct spb_spool *s, struct spc_header *h)
{
    h->cluster_count = s->count;
    h->block_count = 0;
    h->node_count = h->leaf_count = h->vertex_count = 0;
    uint16_t e_min = UINT16_MAX, e_max = 0;
    for (uint32_t i = 0; i < s->count; i++) {
        const struct spc_cluster *c = &s->clusters[i]->record;
        h->block_count += c->block_count;
        h->node_count += (uint64_t)c->inner_count + c->leaf_count;
        h->leaf_count += c->leaf_count;
        for (uint32_t k = 0; k < c->block_count; k++)
            h->vertex_count += s->clusters[i]->blocks[k].vertex_count;
        e_min = s->clusters[i]->inner_e_min < e_min ? s->clusters[i]->inner_e_min : e_min;
        e_max = s->clusters[i]->inner_e_max > e_max ? s->clusters[i]->inner_e_max : e_max;
    }
    h->e_min = e_min <= e_max ? spc_len_decode(e_min) : 0;
    h->e_max = spc_len_decode(e_max);
}

void spb_spool_shapes(const struct spb_spool *s, struct spb_shapes *shapes, double corner_min[3],
                      double corner_max[3])
{
    *shapes = (struct spb_shapes){.moved = 0};
    for (int a = 0; a < 3; a++) {
        corner_min[a] = HUGE_VAL;
        corner_max[a] = -HUGE_VAL;
    }
    for (uint32_t i = 0; i < s->count; i++) {
        const struct spb_cluster *c = s->clusters[i];
        for (int a = 0; a < 3; a++) {
            corner_min[a] = smaller_of(corner_min[a], c->corner_min[a]);
            corner_max[a] = larger_of(corner_max[a], c->corner_max[a]);
        }
        if (c->shapes.moved > 0) {
            shapes->least = shapes->moved == 0 ? c->shapes.least : smaller_of(shapes->least, c->shapes.least);
            shapes->most = larger_of(shapes->most, c->shapes.most);
        }
        shapes->moved += c->shapes.moved;
        shapes->flat += c->shapes.flat;
    }
}

/* Numbers in file order: a cluster's children follow each other, behind all coarser ones. */
static void order_by_level(const struct spb_spool *s, uint32_t root, uint32_t *order)
{
    uint32_t n = 0;
    order[n++] = root;
    s->clusters[root]->record.parent = SPC_NONE;
    s->clusters[root]->record.level = 0;
    for (uint32_t i = 0; i < n; i++) {
        struct spb_cluster *c = s->clusters[order[i]];
        c->record.child_first = c->record.child_count ? n : 0;
        for (uint32_t k = 0; k < c->record.child_count; k++) {
            struct spc_cluster *child = &s->clusters[c->children[k]]->record;
            child->parent = i;
            child->level = c->record.level + 1;
            order[n++] = c->children[k];
        }
    }
}

static enum spc_status write_cluster(struct spb_spool *s, struct spb_cluster *c, uint32_t id,
                                     struct spc_writer *writer, struct spc_error *err)
{
    size_t bytes = 0, at = 0;
    for (uint32_t k = 0; k < c->record.block_count; k++)
        bytes += c->blocks[k].stored_bytes;
    uint8_t *stored = malloc(bytes);
    const void **payloads = malloc(c->record.block_count * sizeof *payloads);
    enum spc_status status = SPC_OK;
    if (stored == NULL || payloads == NULL)
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to write a cluster");
    for (uint32_t k = 0; k < c->record.block_count && status == SPC_OK; k++) {
        payloads[k] = stored + at;
        status = spb_tmpfile_read(s->file, c->stored_off[k], stored + at,
                                  c->blocks[k].stored_bytes, err);
        at += c->blocks[k].stored_bytes;
    }
    if (status == SPC_OK)
        status = spc_writer_cluster(writer, id, &c->record, c->blocks, payloads, err);
    free(payloads);
    free(stored);
    return status;
}

enum spc_status spb_spool_write(struct spb_spool *s, uint32_t root, struct spc_writer *writer,
                                struct spb_progress *progress, struct spc_error *err)
{
    enum spc_status status = SPC_OK;
    uint32_t *order = malloc(s->count * sizeof *order);
    if (order == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to order the clusters");
    order_by_level(s, root, order);
    for (uint32_t id = 0; id < s->count && status == SPC_OK; id++) {
        status = write_cluster(s, s->clusters[order[id]], id, writer, err);
        if (status == SPC_OK && spb_progress_tell(progress, "write archive", id + 1, s->count))
            status = spc_fail(err, SPC_CANCELLED, SPC_NO_OFF, "cancelled");
    }
    free(order);
    return status;
}
