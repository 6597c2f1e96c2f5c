/*
 * pool.c - the only file that knows libuv.
 *
 * libuv's pool is global and takes its size from the environment when it is first used. Jobs do
 * their own pread: a job that waited for a uv_fs_* request would wait for a thread of its own
 * pool. No more than threads jobs are queued at a time, so a pool that is larger does not matter.
 */
#include "pool.h"

#include <stdio.h>
#include <stdlib.h>
#include <uv.h>

enum { THREADS_MAX = 1024 };

struct pool {
    spb_job_fn job;
    spb_tick_fn tick;
    void *ctx;
    size_t count, next, done, failed_index;
    bool stop;
    struct spc_error failed;
};

struct work {
    uv_work_t uv;
    struct pool *pool;
    size_t index;
    enum spc_status status;
    struct spc_error error;
};

static void run(uv_work_t *uv)
{
    struct work *w = uv->data;
    w->status = w->pool->job(w->pool->ctx, w->index, &w->error);
}

static void finished(uv_work_t *uv, int uv_status)
{
    struct work *w = uv->data;
    struct pool *p = w->pool;
    (void)uv_status;
    p->done++;
    if (w->status != SPC_OK && (p->failed.status == SPC_OK || w->index < p->failed_index)) {
        p->failed = w->error;
        p->failed.status = w->status;
        p->failed_index = w->index;
        p->stop = true;
    }
    if (p->tick != NULL && p->tick(p->ctx, p->done) != 0 && p->failed.status == SPC_OK) {
        spc_fail(&p->failed, SPC_CANCELLED, SPC_NO_OFF, "cancelled");
        p->failed_index = SIZE_MAX;
        p->stop = true;
    }
    if (p->stop || p->next == p->count)
        return;
    w->index = p->next++;
    w->error = (struct spc_error){0};
    uv_queue_work(uv->loop, uv, run, finished);
}

static enum spc_status start_loop(uv_loop_t *loop, unsigned threads, struct spc_error *err)
{
    char size[16];
    snprintf(size, sizeof size, "%u", threads);
    setenv("UV_THREADPOOL_SIZE", size, 0);
    return uv_loop_init(loop) == 0
        ? SPC_OK
        : spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to start threads");
}

static enum spc_status hand_on(const struct spc_error *from, struct spc_error *err)
{
    struct spc_error copy = *from;
    if (err != NULL)
        *err = copy;
    return copy.status;
}

enum spc_status spb_pool_run(size_t count, unsigned threads, spb_job_fn job, spb_tick_fn tick,
                             void *ctx, struct spc_error *err)
{
    struct pool pool = {.job = job, .tick = tick, .ctx = ctx, .count = count};
    uv_loop_t loop;
    if (threads < 1)
        threads = 1;
    if (threads > THREADS_MAX)
        threads = THREADS_MAX;
    enum spc_status status = start_loop(&loop, threads, err);
    if (status != SPC_OK)
        return status;
    struct work *work = calloc(threads, sizeof *work);
    if (work == NULL)
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to start threads");
    for (unsigned t = 0; work != NULL && t < threads && pool.next < count; t++) {
        work[t].pool = &pool;
        work[t].uv.data = &work[t];
        work[t].index = pool.next++;
        uv_queue_work(&loop, &work[t].uv, run, finished);
    }
    uv_run(&loop, UV_RUN_DEFAULT);
    uv_loop_close(&loop);
    free(work);
    return status == SPC_OK ? hand_on(&pool.failed, err) : status;
}

/* ---- batches in order --------------------------------------------------------------------------- */

struct slot {
    uv_work_t uv;
    struct line *line;
    size_t number;
    bool done;                      /* worked, not yet taken */
    enum spc_status status;
    struct spc_error error;
};

struct line {
    const struct spb_pipe *pipe;
    uv_loop_t *loop;
    struct slot *slots;             /* batch b is in slot b % slot_count */
    size_t slot_count, made, taken;
    bool ended;
    struct spc_error failed;
};

static void fail(struct line *l, enum spc_status status, const struct spc_error *error)
{
    l->ended = true;
    if (l->failed.status == SPC_OK) {
        l->failed = *error;
        l->failed.status = status;
    }
}

static void work_slot(uv_work_t *uv)
{
    struct slot *s = uv->data;
    s->status = s->line->pipe->work(s->line->pipe->ctx, s->number, &s->error);
}

static void slot_finished(uv_work_t *uv, int uv_status);

static void make_batches(struct line *l)
{
    while (!l->ended && l->made - l->taken < l->slot_count) {
        struct slot *s = &l->slots[l->made % l->slot_count];
        bool end = false;
        s->done = false;
        s->error = (struct spc_error){0};
        s->status = l->pipe->make(l->pipe->ctx, s->number, &end, &s->error);
        if (s->status != SPC_OK)
            fail(l, s->status, &s->error);
        l->ended = l->ended || end;
        if (l->ended)
            return;
        l->made++;
        uv_queue_work(l->loop, &s->uv, work_slot, slot_finished);
    }
}

/* Batches after a failed one are passed over. */
static void take_batches(struct line *l)
{
    for (; l->taken < l->made && l->slots[l->taken % l->slot_count].done; l->taken++) {
        struct slot *s = &l->slots[l->taken % l->slot_count];
        if (s->status == SPC_OK && l->failed.status == SPC_OK)
            s->status = l->pipe->take(l->pipe->ctx, s->number, &s->error);
        if (s->status != SPC_OK)
            fail(l, s->status, &s->error);
    }
}

static void slot_finished(uv_work_t *uv, int uv_status)
{
    struct slot *s = uv->data;
    struct line *l = s->line;
    (void)uv_status;
    s->done = true;
    take_batches(l);
    make_batches(l);
}

static enum spc_status pipe_alone(const struct spb_pipe *pipe, struct spc_error *err)
{
    enum spc_status status = SPC_OK;
    for (;;) {
        bool end = false;
        status = pipe->make(pipe->ctx, 0, &end, err);
        if (status != SPC_OK || end)
            return status;
        status = pipe->work(pipe->ctx, 0, err);
        if (status == SPC_OK)
            status = pipe->take(pipe->ctx, 0, err);
        if (status != SPC_OK)
            return status;
    }
}

enum spc_status spb_pool_pipe(const struct spb_pipe *pipe, size_t slots, unsigned threads,
                              struct spc_error *err)
{
    uv_loop_t loop;
    if (threads <= 1)
        return pipe_alone(pipe, err);
    enum spc_status status = start_loop(&loop, threads, err);
    if (status != SPC_OK)
        return status;
    struct line line = {.pipe = pipe, .loop = &loop, .slot_count = slots,
                        .slots = calloc(slots, sizeof *line.slots)};
    if (line.slots == NULL)
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to start threads");
    for (size_t i = 0; line.slots != NULL && i < slots; i++) {
        line.slots[i].line = &line;
        line.slots[i].number = i;
        line.slots[i].uv.data = &line.slots[i];
    }
    if (status == SPC_OK)
        make_batches(&line);
    uv_run(&loop, UV_RUN_DEFAULT);
    uv_loop_close(&loop);
    free(line.slots);
    return status == SPC_OK ? hand_on(&line.failed, err) : status;
}

unsigned spb_pool_cores(void)
{
    return uv_available_parallelism();
}
