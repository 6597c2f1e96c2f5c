#include "resident.h"

#include <stdlib.h>
#include <string.h>
#include <uv.h>

enum { RETRY_AFTER = 30 };          /* frames until a block that could not be read is asked for again */

enum state { ABSENT, UNDER_WAY, RESIDENT };

struct entry {                      /* of a block */
    uint8_t *payload;
    enum state state;
    uint32_t wanted;                /* frame that wanted it last; 0: never */
    uint32_t failed;                /* frame of the last failed read; 0: none */
    float error;                    /* as of the selection that wanted it last */
};

struct job {
    uv_work_t work;
    struct spv_resident *resident;
    uint32_t block;
    uint8_t *payload;
    enum spc_status status;
    struct spc_error err;
};

struct spv_resident {
    const struct spc_reader *reader;
    struct spv_resident_options options;
    uv_loop_t loop;
    bool loop_open;
    struct entry *entries;          /* [block_count] of the archive */
    uint32_t entry_count;
    uint32_t frame;                 /* number, from 1 */
    unsigned under_way;
    uint64_t bytes;                 /* of payloads, those under way included */
    uint32_t *here;                 /* [here_count] resident blocks, in no order */
    uint32_t here_count;
    struct spv_chosen *asked;       /* [asked_count] what is missing in this frame */
    uint32_t asked_count;
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
    return spc_block_decode(reader, block, true, payload, err);
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

static void drop(struct spv_resident *r, struct entry *e, uint64_t bytes)
{
    free(e->payload);
    e->payload = NULL;
    e->state = ABSENT;
    r->bytes -= bytes;
}

static void take(uv_work_t *request, int cancelled)
{
    struct job *job = request->data;
    struct spv_resident *r = job->resident;
    struct entry *e = &r->entries[job->block];
    struct spc_block b;
    spc_reader_block(r->reader, job->block, &b);
    r->under_way--;
    if (cancelled || job->status != SPC_OK) {
        drop(r, e, b.raw_bytes);
        e->failed = cancelled ? 0 : r->frame;
        if (!cancelled) {
            r->error = job->err;
            r->error_block = job->block;
        }
    } else {
        e->state = RESIDENT;
        e->failed = 0;
        r->here[r->here_count++] = job->block;
        r->read_bytes += spc_block_chunk_bytes(&b);
    }
    free(job);
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
        if (uv_queue_work(&r->loop, &job->work, work, take) == 0) {
            e->payload = payload;
            e->state = UNDER_WAY;
            r->bytes += bytes;
            r->under_way++;
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
    const struct spv_chosen *x = a, *y = b;
    if (x->error != y->error)
        return x->error > y->error ? -1 : 1;
    return x->block < y->block ? -1 : x->block > y->block;
}

static bool may_start(const struct spv_resident *r, const struct entry *e)
{
    return e->state == ABSENT && (e->failed == 0 || r->frame - e->failed >= RETRY_AFTER);
}

/* Two a thread keep all busy; more would read what the next frame no longer wants. */
static void ask(struct spv_resident *r, const struct spv_chosen *blocks, uint32_t count, bool wanted)
{
    for (uint32_t i = 0; i < count && r->under_way < 2 * r->options.threads; i++) {
        const uint32_t block = blocks[i].block;
        if (!may_start(r, &r->entries[block]))
            continue;
        if (!make_room(r, raw_bytes(r, block), blocks[i].error, wanted) || !start(r, block))
            return;
    }
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

static bool all_here(const struct spv_resident *r, const struct group *g)
{
    for (uint32_t i = 0; i < g->count; i++)
        if (!is_here(r, g->chosen[i].block))
            return false;
    return true;
}

static void want(struct spv_resident *r, uint32_t block, float error)
{
    struct entry *e = &r->entries[block];
    if (e->wanted == r->frame)
        return;
    e->wanted = r->frame;
    e->error = error;
    if (e->state != RESIDENT)
        r->asked[r->asked_count++] = (struct spv_chosen){block, error};
}

static void want_group(struct spv_resident *r, const struct group *g)
{
    for (uint32_t i = 0; i < g->count; i++)
        want(r, g->chosen[i].block, g->chosen[i].error);
}

static void draw(struct spv_resident *r, uint32_t block, float missing)
{
    r->out.blocks[r->out.block_count++] = (struct spv_ready){block, r->entries[block].payload, missing};
}

static void draw_group(struct spv_resident *r, const struct group *g)
{
    uint32_t block = g->cluster.block_first;
    struct spc_block b;
    for (uint32_t i = 0; i < g->count; i++) {
        r->out.missing += !is_here(r, g->chosen[i].block);
        r->out.failed += r->entries[g->chosen[i].block].failed > 0;
    }
    if (all_here(r, g)) {
        for (uint32_t i = 0; i < g->count; i++)
            draw(r, g->chosen[i].block, -1);
        return;
    }
    /* Blocks that were left out as too coarse may stand in, if they happen to be here. */
    while (is_here(r, block))       /* one is missing: it ends */
        block++;
    spc_reader_block(r->reader, block, &b);
    if (b.e_parent_max >= g->cluster.e_parent_max)      /* a top may be in it: inner nodes come first */
        r->out.tops[r->out.tops_count++] = g->id;
    for (uint32_t k = g->cluster.block_first; k < block; k++)
        draw(r, k, b.e_parent_max);
}

static void each_group(struct spv_resident *r, const struct spv_selection *s,
                       void (*visit)(struct spv_resident *, const struct group *))
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

/* Room is made before anything is handed out: what the caller draws stays for the frame. */
const struct spv_resident_frame *spv_resident_frame(struct spv_resident *r,
                                                    const struct spv_selection *selection)
{
    uv_run(&r->loop, UV_RUN_NOWAIT);
    r->frame++;
    r->asked_count = 0;
    r->out.block_count = r->out.tops_count = r->out.missing = r->out.failed = 0;
    each_group(r, selection, want_group);
    qsort(r->asked, r->asked_count, sizeof *r->asked, by_error);
    ask(r, r->asked, r->asked_count, true);
    each_group(r, selection, draw_group);
    r->out.read_bytes = r->read_bytes;
    r->out.resident_bytes = r->bytes;
    r->read_bytes = 0;
    return &r->out;
}

void spv_resident_prefetch(struct spv_resident *r, const struct spv_selection *selection)
{
    if (r->asked_count == 0 || r->under_way < r->options.threads)
        ask(r, selection->blocks, selection->block_count, false);
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
    if (r->options.decode == NULL)
        r->options.decode = decode_block;
    r->entry_count = h->block_count;
    r->entries = calloc(h->block_count, sizeof *r->entries);
    r->here = calloc(h->block_count, sizeof *r->here);
    r->asked = calloc(h->block_count, sizeof *r->asked);
    r->out.blocks = calloc(h->block_count, sizeof *r->out.blocks);
    r->out.tops = calloc(h->cluster_count, sizeof *r->out.tops);
    r->loop_open = uv_loop_init(&r->loop) == 0;
    if (!r->entries || !r->here || !r->asked || !r->out.blocks || !r->out.tops || !r->loop_open) {
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
    for (uint32_t i = 0; r->entries != NULL && i < r->entry_count; i++)
        free(r->entries[i].payload);
    free(r->entries);
    free(r->here);
    free(r->asked);
    free(r->out.blocks);
    free(r->out.tops);
    free(r);
}
