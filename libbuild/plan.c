#include "plan.h"

#include "split.h"

#include <stdlib.h>
#include <string.h>

struct set {                        /* some pieces, with the tight box of their keys */
    struct spb_piece *pieces;
    uint32_t piece_count;
    uint64_t count;
    double min[3], max[3];
};

struct planner {
    struct spb_plan *plan;
    struct spb_tmpfile *file;
    struct spb_record_format format;
    const struct spb_space *space;
    uint64_t part_faces;
    uint64_t memory;                /* for the buffers of a finer grid */
    struct spb_progress *progress;
    uint64_t moved;                 /* records distributed again */
};

enum { COPY_RECORDS = 1024 };

static enum spc_status no_memory(struct spc_error *err)
{
    return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to plan the parts");
}

static enum spc_status adopt_buckets(struct spb_plan *plan, struct spb_distributor *d,
                                     struct spc_error *err)
{
    const uint32_t total = plan->bucket_count + d->bucket_count;
    if (total > plan->bucket_max) {
        struct spb_bucket **buckets = realloc(plan->buckets, 2 * (size_t)total * sizeof *buckets);
        if (buckets == NULL) {
            for (uint32_t i = 0; i < d->bucket_count; i++)
                spb_bucket_free(d->buckets[i]);
            return no_memory(err);
        }
        plan->buckets = buckets;
        plan->bucket_max = 2 * total;
    }
    for (uint32_t i = 0; i < d->bucket_count; i++)
        plan->buckets[plan->bucket_count++] = d->buckets[i];
    return SPC_OK;
}

static void set_measure(struct set *s)
{
    s->count = 0;
    for (int a = 0; a < 3; a++) {
        s->min[a] = INFINITY;
        s->max[a] = -INFINITY;
    }
    for (uint32_t i = 0; i < s->piece_count; i++) {
        const struct spb_bucket *b = s->pieces[i].bucket;
        s->count += s->pieces[i].count;
        for (int a = 0; a < 3; a++) {
            s->min[a] = b->min[a] < s->min[a] ? b->min[a] : s->min[a];
            s->max[a] = b->max[a] > s->max[a] ? b->max[a] : s->max[a];
        }
    }
}

static enum spc_status set_of_buckets(struct spb_bucket *const *buckets, uint32_t n, struct set *s,
                                      struct spc_error *err)
{
    s->pieces = malloc(((size_t)n + 1) * sizeof *s->pieces);
    if (s->pieces == NULL)
        return no_memory(err);
    for (uint32_t i = 0; i < n; i++)
        s->pieces[i] = (struct spb_piece){buckets[i], 0, buckets[i]->pile.count};
    s->piece_count = n;
    set_measure(s);
    return SPC_OK;
}

struct copy_buffer {
    uint8_t records[COPY_RECORDS * 84];
    double keys[COPY_RECORDS][4];
    uint32_t cells[COPY_RECORDS];
};

static enum spc_status add_records(const struct planner *p, struct spb_distributor *d,
                                   struct copy_buffer *buffer, uint32_t n, struct spc_error *err)
{
    enum spc_status status = SPC_OK;
    spb_record_keys(&p->format, p->space, buffer->records, n, buffer->keys);
    spb_distributor_cells(d, (const double(*)[4])buffer->keys, n, buffer->cells);
    for (uint32_t k = 0; k < n && status == SPC_OK; k++)
        status = spb_distributor_add(d, buffer->cells[k], buffer->keys[k],
                                     buffer->records + (size_t)k * p->format.bytes, err);
    return status;
}

/* Copies the set's records to the buckets of a finer grid over its own box. */
static enum spc_status copy_piece(struct planner *p, const struct spb_piece *piece,
                                  struct spb_distributor *d, struct copy_buffer *buffer,
                                  struct spc_error *err)
{
    const uint32_t bytes = p->format.bytes;
    struct spb_pile_reader reader = {&piece->bucket->pile, p->file, 0, 0};
    enum spc_status status = SPC_OK;
    spb_pile_skip(&reader, piece->first * bytes);
    for (uint64_t left = piece->count; left > 0 && status == SPC_OK;) {
        const uint64_t n = left < COPY_RECORDS ? left : COPY_RECORDS;
        status = spb_pile_read(&reader, buffer->records, n * bytes, err);
        if (status == SPC_OK)
            status = add_records(p, d, buffer, (uint32_t)n, err);
        left -= n;
        p->moved += n;
        if (status == SPC_OK && spb_progress_tell(p->progress, "plan parts", p->moved, 0))
            status = spc_fail(err, SPC_CANCELLED, SPC_NO_OFF, "cancelled");
    }
    if (status == SPC_OK && piece->count == piece->bucket->pile.count)
        spb_pile_discard(&piece->bucket->pile, p->file);
    return status;
}

static enum spc_status copy_records(struct planner *p, const struct set *s,
                                    struct spb_distributor *d, struct spc_error *err)
{
    enum spc_status status = SPC_OK;
    struct copy_buffer *buffer = malloc(sizeof *buffer);
    if (buffer == NULL)
        return no_memory(err);
    for (uint32_t i = 0; i < s->piece_count && status == SPC_OK; i++)
        status = copy_piece(p, &s->pieces[i], d, buffer, err);
    free(buffer);
    return status;
}

/* As parts ask for, but not so fine that the list of buckets outgrows the records. */
static int cells_again(const struct planner *p, const struct set *s)
{
    enum { LEAST = 2, RECORDS_A_CELL = 16 };        /* four cells along: enough for one split */
    int log2 = spb_cells_for_parts(s->count / p->part_faces + 2);
    while (log2 > LEAST && (uint64_t)RECORDS_A_CELL << 3 * log2 > s->count)
        log2--;
    return spb_cells_within(log2, p->memory);
}

static enum spc_status distribute_again(struct planner *p, struct set *s, struct spc_error *err)
{
    struct spb_distributor d;
    struct set finer = {0};
    enum spc_status status = spb_distributor_init(&d, p->file, &p->format, s->min, s->max,
                                                  cells_again(p, s), p->memory, err);
    if (status == SPC_OK)
        status = copy_records(p, s, &d, err);
    if (status == SPC_OK)
        status = spb_distributor_flush(&d, err);
    if (status == SPC_OK)
        status = set_of_buckets(d.buckets, d.bucket_count, &finer, err);
    const enum spc_status adopted = adopt_buckets(p->plan, &d, err);
    if (status == SPC_OK)
        status = adopted;
    spb_distributor_release(&d);
    if (status != SPC_OK) {
        free(finer.pieces);
        return status;
    }
    free(s->pieces);
    *s = finer;
    return SPC_OK;
}

/* Equal keys: the first half of the records by input order, and the rest. */
static void halve_by_order(const struct set *s, struct set halves[2])
{
    uint64_t left = spb_split_middle(s->count);
    for (uint32_t i = 0; i < s->piece_count; i++) {
        const struct spb_piece *piece = &s->pieces[i];
        const uint64_t n = piece->count < left ? piece->count : left;
        if (n > 0)
            halves[0].pieces[halves[0].piece_count++] =
                (struct spb_piece){piece->bucket, piece->first, n};
        if (piece->count > n)
            halves[1].pieces[halves[1].piece_count++] =
                (struct spb_piece){piece->bucket, piece->first + n, piece->count - n};
        left -= n;
    }
}

static void halve_by_plane(const struct set *s, const struct spb_split *split,
                           struct set halves[2])
{
    for (uint32_t i = 0; i < s->piece_count; i++) {
        struct set *half = &halves[s->pieces[i].bucket->min[split->axis] >= split->plane];
        half->pieces[half->piece_count++] = s->pieces[i];
    }
}

static bool cells_fit(const struct set *s, const struct spb_split *split)
{
    for (uint32_t i = 0; i < s->piece_count; i++)
        if (s->pieces[i].bucket->cell_exp > split->plane_exp)
            return false;
    return true;
}

/* Splits s, distributing it again first where its cells are too coarse. */
static enum spc_status halve(struct planner *p, struct set *s, struct set halves[2],
                             struct spc_error *err)
{
    struct spb_split split;
    const bool by_plane = spb_split_box(s->min, s->max, &split);
    if (by_plane && !cells_fit(s, &split)) {
        const enum spc_status status = distribute_again(p, s, err);
        if (status != SPC_OK)
            return status;
    }
    for (int h = 0; h < 2; h++) {
        halves[h].pieces = malloc(s->piece_count * sizeof *halves[h].pieces);
        if (halves[h].pieces == NULL)
            return no_memory(err);
    }
    if (by_plane)
        halve_by_plane(s, &split, halves);
    else
        halve_by_order(s, halves);
    set_measure(&halves[0]);
    set_measure(&halves[1]);
    return SPC_OK;
}

static enum spc_status add_node(struct spb_plan *plan, uint32_t *index, struct spc_error *err)
{
    if (plan->node_count == plan->node_max) {
        const uint32_t grown = plan->node_max ? 2 * plan->node_max : 64;
        struct spb_plan_node *nodes = realloc(plan->nodes, grown * sizeof *nodes);
        if (nodes == NULL)
            return no_memory(err);
        plan->nodes = nodes;
        plan->node_max = grown;
    }
    *index = plan->node_count++;
    plan->nodes[*index] = (struct spb_plan_node){.part = SPC_NONE};
    return SPC_OK;
}

static enum spc_status add_part(struct spb_plan *plan, struct set *s, uint32_t node,
                                struct spc_error *err)
{
    if (plan->part_count == plan->part_max) {
        const uint32_t grown = plan->part_max ? 2 * plan->part_max : 64;
        struct spb_part *parts = realloc(plan->parts, grown * sizeof *parts);
        if (parts == NULL)
            return no_memory(err);
        plan->parts = parts;
        plan->part_max = grown;
    }
    plan->nodes[node].part = plan->part_count;
    plan->parts[plan->part_count++] = (struct spb_part){s->pieces, s->piece_count, s->count, node};
    s->pieces = NULL;
    return SPC_OK;
}

/* A set of at most two families of leaves is split by its keys (split.h): it stays in one part. */
enum { PART_MIN = 2 * SPB_FAMILY_MAX };

/*
 * Node index stands for s. Recursion is as deep as the key lattice has bits, some hundred levels,
 * whatever the data: every plane takes a quarter off the longest side.
 */
static enum spc_status plan_set(struct planner *p, struct set *s, uint32_t index,
                                struct spc_error *err)
{
    struct set halves[2] = {{0}, {0}};
    struct set quarters[4] = {{0}, {0}, {0}, {0}};
    int n = 0;
    enum spc_status status;
    if (s->count <= p->part_faces)
        return add_part(p->plan, s, index, err);
    status = halve(p, s, halves, err);
    for (int h = 0; h < 2 && status == SPC_OK; h++) {
        if (halves[h].count <= SPB_FAMILY_MAX) {
            quarters[n++] = halves[h];
            halves[h].pieces = NULL;
        } else {
            status = halve(p, &halves[h], quarters + n, err);
            n += 2;
        }
    }
    for (int q = 0; q < n && status == SPC_OK; q++) {
        uint32_t child = 0;
        status = add_node(p->plan, &child, err);
        if (status == SPC_OK) {
            p->plan->nodes[index].child[q] = child;
            p->plan->nodes[index].child_count++;
        }
    }
    for (int q = 0; q < n && status == SPC_OK; q++)
        status = plan_set(p, &quarters[q], p->plan->nodes[index].child[q], err);
    for (int q = 0; q < 4; q++)
        free(quarters[q].pieces);
    free(halves[0].pieces);
    free(halves[1].pieces);
    return status;
}

enum spc_status spb_plan_make(struct spb_plan *plan, struct spb_distributor *distributor,
                              struct spb_tmpfile *file,
                              const struct spb_space *space, uint64_t part_faces,
                              uint64_t memory, struct spb_progress *progress,
                              struct spc_error *err)
{
    struct planner p = {.plan = plan, .file = file, .format = distributor->format, .space = space,
                        .part_faces = part_faces < PART_MIN ? PART_MIN : part_faces,
                        .memory = memory, .progress = progress};
    struct set all = {0};
    uint32_t root = 0;
    *plan = (struct spb_plan){0};
    enum spc_status status = set_of_buckets(distributor->buckets, distributor->bucket_count, &all,
                                            err);
    const enum spc_status adopted = adopt_buckets(plan, distributor, err);
    spb_distributor_release(distributor);
    if (status == SPC_OK)
        status = adopted;
    if (status == SPC_OK)
        status = add_node(plan, &root, err);
    if (status == SPC_OK)
        status = plan_set(&p, &all, root, err);
    free(all.pieces);
    if (status != SPC_OK)
        spb_plan_release(plan);
    return status;
}

void spb_plan_release(struct spb_plan *plan)
{
    for (uint32_t i = 0; i < plan->part_count; i++)
        free(plan->parts[i].pieces);
    for (uint32_t i = 0; i < plan->bucket_count; i++)
        spb_bucket_free(plan->buckets[i]);
    free(plan->parts);
    free(plan->buckets);
    free(plan->nodes);
    *plan = (struct spb_plan){0};
}

void spb_part_prefetch(const struct spb_part *part, struct spb_tmpfile *file)
{
    for (uint32_t i = 0; i < part->piece_count; i++)
        spb_pile_prefetch(&part->pieces[i].bucket->pile, file);
}

enum spc_status spb_part_read(const struct spb_part *part, struct spb_tmpfile *file,
                              uint32_t record_bytes, uint8_t *records, struct spc_error *err)
{
    for (uint32_t i = 0; i < part->piece_count; i++) {
        const struct spb_piece *piece = &part->pieces[i];
        struct spb_pile_reader reader = {&piece->bucket->pile, file, 0, 0};
        const uint64_t bytes = piece->count * record_bytes;
        spb_pile_skip(&reader, piece->first * record_bytes);
        const enum spc_status status = spb_pile_read(&reader, records, bytes, err);
        if (status != SPC_OK)
            return status;
        if (piece->count == piece->bucket->pile.count)
            spb_pile_discard(&piece->bucket->pile, file);
        records += bytes;
    }
    return SPC_OK;
}
