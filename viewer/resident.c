#include "resident.h"

#include "kept.h"

#include <stdlib.h>
#include <string.h>
#include <uv.h>

enum {
    RETRY_AFTER = 30,               /* frames until a block that could not be read is asked for again */
    QUEUE_BYTES = 16 << 20,         /* decoded, that threads have to do while a frame is drawn: some 50 ms each */
};

enum state { ABSENT, UNDER_WAY, RESIDENT };

struct entry {                      /* of a block */
    void *kept;                     /* by the store */
    enum state state;
    uint32_t wanted;                /* frame that wanted it last; 0: never */
    uint32_t failed;                /* frame of the last failed read; 0: none */
    float error;                    /* as of the selection that wanted it last */
};

struct job {
    uv_work_t work;
    struct job *next;
    struct spv_resident *resident;
    uint32_t block;
    uint8_t *payload;
    enum spc_status status;
    struct spc_error err;
};

struct missed {
    struct spv_chosen chosen;
    uint32_t probe;                 /* its cluster's, of the frame */
};

struct spv_resident {
    const struct spc_reader *reader;
    struct spv_resident_options options;
    uv_loop_t loop;
    bool loop_open;
    struct entry *entries;          /* [block_count] of the archive */
    uint32_t entry_count;
    uint32_t frame;                 /* number, from 1 */
    unsigned under_way;             /* reads */
    uint64_t under_way_bytes;       /* decoded */
    struct job *done, **done_end;   /* read, not yet given to the store */
    uint64_t bytes;                 /* of payloads, those under way included */
    uint32_t *here;                 /* [here_count] resident blocks, in no order */
    uint32_t here_count;
    struct missed *missed;          /* [missed_count] in this frame */
    uint32_t missed_count;
    struct spv_item *items;         /* of out.part */
    uint32_t *tops, *probes;
    uint8_t *hidden;
    struct spv_resident_frame out;
    uint64_t read_bytes;
    struct spc_error error;
    uint32_t error_block;
};

/* ---- reading ----------------------------------------------------------------------------------- */

static enum spc_status decode_block(void *ctx, const struct spc_reader *reader, uint32_t block,
                                    uint8_t *payload, struct spc_error *err)
{
    (void)ctx;
    const enum spc_status status = spc_block_decode(reader, block, true, payload, err);
    return status == SPC_OK ? spv_kept_sort(reader, block, payload, err) : status;
}

static uint64_t raw_bytes(const struct spv_resident *r, uint32_t block)
{
    struct spc_block b;
    spc_reader_block(r->reader, block, &b);
    return b.raw_bytes;
}

static void work(uv_work_t *request)
{
    struct job *job = request->data;
    const struct spv_resident_options *o = &job->resident->options;
    job->status = o->decode(o->decode_ctx, job->resident->reader, job->block, job->payload, &job->err);
}

/* ---- the store --------------------------------------------------------------------------------- */

static void *keep_plain(struct spv_draw *draw, const struct spc_reader *reader, uint32_t block, uint8_t *payload)
{
    (void)draw;
    (void)reader;
    (void)block;
    return payload;
}

static void drop_plain(struct spv_draw *draw, void *kept)
{
    (void)draw;
    free(kept);
}

static void drop(struct spv_resident *r, struct entry *e, uint64_t bytes)
{
    if (e->kept != NULL)
        r->options.store.drop(r->options.store.draw, e->kept);
    e->kept = NULL;
    e->state = ABSENT;
    r->bytes -= bytes;
}

static void read_done(uv_work_t *request, int cancelled)
{
    struct job *job = request->data;
    struct spv_resident *r = job->resident;
    (void)cancelled;                /* nothing is */
    r->under_way--;
    r->under_way_bytes -= raw_bytes(r, job->block);
    *r->done_end = job;
    r->done_end = &job->next;
}

/* A block that was read goes to the store; true when it was given one. */
static bool take(struct spv_resident *r, struct job *job)
{
    struct entry *e = &r->entries[job->block];
    struct spc_block b;
    spc_reader_block(r->reader, job->block, &b);
    const bool read = job->status == SPC_OK;
    if (!read)
        free(job->payload);
    else if ((e->kept = r->options.store.keep(r->options.store.draw, r->reader, job->block, job->payload)) == NULL)
        spc_fail(&job->err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a block");
    if (e->kept == NULL) {
        r->error = job->err;
        r->error_block = job->block;
        drop(r, e, b.raw_bytes);
        e->failed = r->frame;
    } else {
        e->state = RESIDENT;
        e->failed = 0;
        r->here[r->here_count++] = job->block;
        r->read_bytes += spc_block_chunk_bytes(&b);
    }
    free(job);
    return read;
}

static void take_in(struct spv_resident *r)
{
    uint64_t given = 0;
    uv_run(&r->loop, UV_RUN_NOWAIT);
    while (r->done != NULL && (given == 0 || r->options.upload_bytes == 0 || given < r->options.upload_bytes)) {
        struct job *job = r->done;
        const uint64_t bytes = raw_bytes(r, job->block);
        r->done = job->next;
        if (r->done == NULL)
            r->done_end = &r->done;
        given += take(r, job) ? bytes : 0;
    }
}

/* False without memory: then it is absent, and will be asked for again. */
static bool start(struct spv_resident *r, uint32_t block)
{
    struct entry *e = &r->entries[block];
    const uint64_t bytes = raw_bytes(r, block);
    struct job *job = calloc(1, sizeof *job);
    uint8_t *payload = malloc(bytes > 0 ? (size_t)bytes : 1);
    if (job != NULL && payload != NULL) {
        *job = (struct job){.resident = r, .block = block, .payload = payload};
        job->work.data = job;
        if (uv_queue_work(&r->loop, &job->work, work, read_done) == 0) {
            e->state = UNDER_WAY;
            r->bytes += bytes;
            r->under_way++;
            r->under_way_bytes += bytes;
            return true;
        }
    }
    free(payload);
    free(job);
    return false;
}

/* ---- what is asked for, and what has to leave -------------------------------------------------- */

/* What is wanted now stays before all else; of both kinds the coarse stays before the fine. */
static bool leaves_before(const struct spv_resident *r, const struct entry *a, const struct entry *b)
{
    if ((a->wanted == r->frame) != (b->wanted == r->frame))
        return b->wanted == r->frame;
    if (a->wanted != b->wanted && a->wanted != r->frame)
        return a->wanted < b->wanted;
    return a->error < b->error;
}

/* Makes room for bytes of a block of that error; false when all that is here is needed more. */
static bool make_room(struct spv_resident *r, uint64_t bytes, float error, bool wanted)
{
    while (r->bytes + bytes > r->options.budget) {
        uint32_t least = r->here_count;
        for (uint32_t i = 0; i < r->here_count; i++)
            if (least == r->here_count ||
                leaves_before(r, &r->entries[r->here[i]], &r->entries[r->here[least]]))
                least = i;
        if (least == r->here_count)
            return false;
        struct entry *e = &r->entries[r->here[least]];
        if (e->wanted == r->frame && (!wanted || !(e->error < error)))
            return false;
        drop(r, e, raw_bytes(r, r->here[least]));
        r->here[least] = r->here[--r->here_count];
    }
    return true;
}

static int by_error(const void *a, const void *b)
{
    const struct missed *x = a, *y = b;
    if (x->chosen.error != y->chosen.error)
        return x->chosen.error > y->chosen.error ? -1 : 1;
    return x->chosen.block < y->chosen.block ? -1 : x->chosen.block > y->chosen.block;
}

static bool may_start(const struct spv_resident *r, const struct entry *e)
{
    return e->state == ABSENT && (e->failed == 0 || r->frame - e->failed >= RETRY_AFTER);
}

/* Enough to keep all threads busy for a frame; more would read what the next one no longer wants. */
static bool has_idle(const struct spv_resident *r)
{
    return r->under_way < 2 * r->options.threads || r->under_way_bytes < QUEUE_BYTES;
}

/* False when there is no room for more. */
static bool ask_for(struct spv_resident *r, const struct spv_chosen *chosen, bool wanted)
{
    if (!may_start(r, &r->entries[chosen->block]))
        return true;
    return make_room(r, raw_bytes(r, chosen->block), chosen->error, wanted) && start(r, chosen->block);
}

/* ---- a frame ----------------------------------------------------------------------------------- */

/* The chosen blocks of one cluster, next to each other in a selection. */
struct group {
    const struct spv_chosen *chosen;
    uint32_t count;
    uint32_t id;
    struct spc_cluster cluster;
};

static bool is_here(const struct spv_resident *r, uint32_t block)
{
    return r->entries[block].state == RESIDENT;
}

static void want(struct spv_resident *r, const struct spv_chosen *chosen)
{
    struct entry *e = &r->entries[chosen->block];
    e->wanted = r->frame;
    e->error = chosen->error;
    if (e->state == RESIDENT)
        return;
    r->missed[r->missed_count++] = (struct missed){*chosen, r->out.part.probe_count};
    r->out.missing++;
    r->out.failed += e->failed > 0;
}

static void draw(struct spv_resident *r, uint32_t block, float missing)
{
    r->items[r->out.part.item_count++] = (struct spv_item){block, r->entries[block].kept, missing};
}

/*
 * The first block that is missed: the first that is wanted, or one before it that was left out as too
 * coarse but would stand in. What lies before is drawn down to its e_parent.
 */
static uint32_t first_missed(struct spv_resident *r, const struct group *g, uint32_t wanted, float *e_parent)
{
    struct spc_block b;
    uint32_t first = wanted;
    spc_reader_block(r->reader, wanted, &b);
    *e_parent = b.e_parent_max;
    for (uint32_t k = wanted; k-- > g->cluster.block_first;) {
        spc_reader_block(r->reader, k, &b);
        if (is_here(r, k) || b.e_self_min > *e_parent)
            continue;
        first = k;
        *e_parent = b.e_parent_max;
    }
    return first;
}

static void visit(struct spv_resident *r, const struct group *g)
{
    const uint32_t missed_before = r->missed_count;
    float e_parent;
    for (uint32_t i = 0; i < g->count; i++)
        want(r, &g->chosen[i]);
    if (r->missed_count == missed_before) {
        for (uint32_t i = 0; i < g->count; i++)
            draw(r, g->chosen[i].block, -1);
        return;
    }
    const uint32_t first = first_missed(r, g, r->missed[missed_before].chosen.block, &e_parent);
    if (e_parent >= g->cluster.e_parent_max)        /* a top may be missed: inner nodes come first */
        r->tops[r->out.part.top_count++] = g->id;
    for (uint32_t k = g->cluster.block_first; k < first; k++)
        if (is_here(r, k)) {
            if (r->entries[k].wanted != r->frame)
                r->entries[k].error = 0;            /* not chosen: else it could keep out what it stands in for */
            r->entries[k].wanted = r->frame;        /* what stands in stays while there is room */
            draw(r, k, e_parent);
        }
    r->hidden[r->out.part.probe_count] = 0;
    r->probes[r->out.part.probe_count++] = g->id;
}

static void each_group(struct spv_resident *r, const struct spv_selection *s)
{
    struct group g = {.chosen = s->blocks};
    for (const struct spv_chosen *end = s->blocks + s->block_count; g.chosen < end; g.chosen += g.count) {
        struct spc_block b;
        spc_reader_block(r->reader, g.chosen->block, &b);
        g.id = b.cluster;
        spc_reader_cluster(r->reader, g.id, &g.cluster);
        for (g.count = 1; g.chosen + g.count < end; g.count++) {
            const uint32_t block = g.chosen[g.count].block;
            if (block < g.cluster.block_first || block - g.cluster.block_first >= g.cluster.block_count)
                break;
        }
        visit(r, &g);
    }
}

struct spv_resident_frame *spv_resident_frame(struct spv_resident *r, const struct spv_selection *selection)
{
    r->frame++;
    take_in(r);
    r->missed_count = 0;
    r->out = (struct spv_resident_frame){.part = {.reader = r->reader, .items = r->items, .tops = r->tops,
                                                  .probes = r->probes, .hidden = r->hidden}};
    each_group(r, selection);
    r->out.read_bytes = r->read_bytes;
    r->out.resident_bytes = r->bytes;
    r->read_bytes = 0;
    return &r->out;
}

void spv_resident_ask(struct spv_resident *r)
{
    qsort(r->missed, r->missed_count, sizeof *r->missed, by_error);
    for (uint32_t i = 0; i < r->missed_count && has_idle(r); i++)
        if (!r->hidden[r->missed[i].probe] && !ask_for(r, &r->missed[i].chosen, true))
            break;
    r->out.resident_bytes = r->bytes;
}

void spv_resident_prefetch(struct spv_resident *r, const struct spv_selection *selection)
{
    for (uint32_t i = 0; i < selection->block_count && r->under_way < r->options.threads; i++)
        if (!ask_for(r, &selection->blocks[i], false))
            break;
}

uint32_t spv_resident_hidden(const struct spv_resident *r)
{
    uint32_t hidden = 0;
    for (uint32_t i = 0; i < r->missed_count; i++)
        hidden += r->hidden[r->missed[i].probe];
    return hidden;
}

unsigned spv_resident_busy(const struct spv_resident *r)
{
    return r->under_way;
}

bool spv_resident_wait(struct spv_resident *r)
{
    if (r->under_way == 0)
        return false;
    uv_run(&r->loop, UV_RUN_ONCE);
    return true;
}

uint32_t spv_resident_error(const struct spv_resident *r, struct spc_error *err)
{
    *err = r->error;
    return r->error_block;
}

/* ---- life -------------------------------------------------------------------------------------- */

enum spc_status spv_resident_create(const struct spc_reader *reader,
                                    const struct spv_resident_options *options,
                                    struct spv_resident **out, struct spc_error *err)
{
    const struct spc_header *h = spc_reader_header(reader);
    struct spv_resident *r = calloc(1, sizeof *r);
    *out = NULL;
    if (r == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for blocks in memory");
    r->reader = reader;
    r->options = *options;
    r->done_end = &r->done;
    if (r->options.store.keep == NULL)
        r->options.store = (struct spv_store){NULL, keep_plain, drop_plain};
    if (r->options.decode == NULL)
        r->options.decode = decode_block;
    r->entry_count = h->block_count;
    r->entries = calloc(h->block_count, sizeof *r->entries);
    r->here = calloc(h->block_count, sizeof *r->here);
    r->missed = calloc(h->block_count, sizeof *r->missed);
    r->items = calloc(h->block_count, sizeof *r->items);
    r->tops = calloc(h->cluster_count, sizeof *r->tops);
    r->probes = calloc(h->cluster_count, sizeof *r->probes);
    r->hidden = calloc(h->cluster_count, sizeof *r->hidden);
    r->loop_open = uv_loop_init(&r->loop) == 0;
    if (!r->entries || !r->here || !r->missed || !r->items || !r->tops || !r->probes || !r->hidden ||
        !r->loop_open) {
        spv_resident_free(r);
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a list of %u blocks", h->block_count);
    }
    *out = r;
    return SPC_OK;
}

void spv_resident_free(struct spv_resident *r)
{
    if (r == NULL)
        return;
    while (r->loop_open && spv_resident_wait(r))
        ;
    if (r->loop_open)
        uv_loop_close(&r->loop);
    for (struct job *job = r->done, *next; job != NULL; job = next) {
        next = job->next;
        free(job->payload);
        free(job);
    }
    for (uint32_t i = 0; r->entries != NULL && i < r->entry_count; i++)
        if (r->entries[i].kept != NULL)
            r->options.store.drop(r->options.store.draw, r->entries[i].kept);
    free(r->entries);
    free(r->here);
    free(r->missed);
    free(r->items);
    free(r->tops);
    free(r->probes);
    free(r->hidden);
    free(r);
}
