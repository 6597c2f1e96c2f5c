/*
 * pool.c - the only file that knows libuv.
 *
 * libuv's pool is global and takes its size from the environment when it is first used. Jobs do
 * their own pread: a job that waited for a uv_fs_* request would wait for a thread of its own
 * pool. No more than threads jobs are queued at a time, so a pool that is larger does not matter.
 *
 * libuv ends the process when it cannot start a thread (a limit of processes, say). So as many as
 * are wanted are started here first and ended; where not even one can be, the jobs run in line.
 */
#include "pool.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <uv.h>

enum { TICK_MS = 100, THREADS_MAX = 1024 };

struct pool {
    spb_job_fn job;
    spb_tick_fn tick;
    void *ctx;
    size_t count, next, done, failed_index;
    unsigned running;               /* jobs that are queued or under way */
    bool in_line;
    atomic_bool stop;
    struct spc_error failed;
    uv_timer_t timer;
};

struct work {
    uv_work_t uv;
    struct pool *pool;
    size_t index;
    enum spc_status status;
    struct spc_error error;
};

static _Thread_local struct pool *current;  /* of the job under way on this thread */

static void ask(struct pool *p)
{
    if (p->tick == NULL || p->tick(p->ctx, p->done) == 0 || p->failed.status != SPC_OK)
        return;
    spc_fail(&p->failed, SPC_CANCELLED, SPC_NO_OFF, "cancelled");
    p->failed_index = SIZE_MAX;
    p->stop = true;
}

bool spb_pool_cancelled(void)
{
    struct pool *p = current;
    if (p != NULL && p->in_line)
        ask(p);
    return p != NULL && p->stop;
}

static void run(uv_work_t *uv)
{
    struct work *w = uv->data;
    current = w->pool;
    w->status = w->pool->job(w->pool->ctx, w->index, &w->error);
    current = NULL;
}

/* The first cause counts: jobs that end because of it are its echo. */
static void take_status(struct pool *p, const struct work *w)
{
    if (w->status == SPC_OK || (p->failed.status != SPC_OK &&
                                (w->index >= p->failed_index || w->status == SPC_CANCELLED)))
        return;
    p->failed = w->error;
    p->failed.status = w->status;
    p->failed_index = w->index;
    p->stop = true;
}

static void finished(uv_work_t *uv, int uv_status)
{
    struct work *w = uv->data;
    struct pool *p = w->pool;
    (void)uv_status;
    p->done++;
    take_status(p, w);
    ask(p);
    if (p->stop || p->next == p->count) {
        if (--p->running == 0)
            uv_close((uv_handle_t *)&p->timer, NULL);
        return;
    }
    w->index = p->next++;
    w->error = (struct spc_error){0};
    uv_queue_work(uv->loop, uv, run, finished);
}

static void on_timer(uv_timer_t *timer)
{
    ask(timer->data);
}

static void *wait_for_lock(void *lock)
{
    pthread_mutex_lock(lock);
    pthread_mutex_unlock(lock);
    return NULL;
}

/* How many of so many threads the system lets us have at once. */
static unsigned startable(unsigned threads)
{
    pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
    pthread_t *started = malloc(threads * sizeof *started);
    unsigned n = 0;
    pthread_mutex_lock(&lock);
    while (started != NULL && n < threads && pthread_create(&started[n], NULL, wait_for_lock, &lock) == 0)
        n++;
    pthread_mutex_unlock(&lock);
    for (unsigned i = 0; i < n; i++)
        pthread_join(started[i], NULL);
    free(started);
    return n;
}

/* How many threads libuv's pool has or may have: it is started once, by whoever is first. */
static unsigned pool_size(unsigned threads)
{
    static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
    static unsigned started;        /* 0: not known yet, or not one */
    char size[16];
    if (threads < 1)
        threads = 1;
    if (threads > THREADS_MAX)
        threads = THREADS_MAX;
    pthread_mutex_lock(&lock);
    if (started == 0) {
        started = startable(threads);
        snprintf(size, sizeof size, "%u", started);
        setenv("UV_THREADPOOL_SIZE", size, 0);
    }
    threads = threads < started ? threads : started;
    pthread_mutex_unlock(&lock);
    return threads;
}

void spb_pool_reserve(unsigned threads)
{
    (void)pool_size(threads);
}

static void run_in_line(struct pool *p)
{
    p->in_line = true;
    current = p;
    for (size_t i = 0; i < p->count && !p->stop; i++) {
        struct work w = {.index = i};
        w.status = p->job(p->ctx, i, &w.error);
        p->done++;
        take_status(p, &w);
        ask(p);
    }
    current = NULL;
}

static enum spc_status hand_on(const struct spc_error *failed, struct spc_error *err)
{
    const enum spc_status status = failed->status;
    if (err != NULL && status != SPC_OK)
        *err = *failed;
    return status;
}

static enum spc_status no_memory(struct spc_error *err)
{
    return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to start threads");
}

enum spc_status spb_pool_run(size_t count, unsigned threads, spb_job_fn job, spb_tick_fn tick,
                             void *ctx, struct spc_error *err)
{
    struct pool pool = {.job = job, .tick = tick, .ctx = ctx, .count = count};
    uv_loop_t loop;
    threads = pool_size(threads);
    if (threads == 0) {
        run_in_line(&pool);
        return hand_on(&pool.failed, err);
    }
    struct work *work = calloc(threads, sizeof *work);
    if (work == NULL || uv_loop_init(&loop) != 0) {
        free(work);
        return no_memory(err);
    }
    uv_timer_init(&loop, &pool.timer);
    pool.timer.data = &pool;
    uv_timer_start(&pool.timer, on_timer, TICK_MS, TICK_MS);
    for (unsigned t = 0; t < threads && pool.next < count; t++) {
        work[t].pool = &pool;
        work[t].uv.data = &work[t];
        work[t].index = pool.next++;
        pool.running++;
        uv_queue_work(&loop, &work[t].uv, run, finished);
    }
    if (pool.running == 0)
        uv_close((uv_handle_t *)&pool.timer, NULL);
    uv_run(&loop, UV_RUN_DEFAULT);
    uv_loop_close(&loop);
    free(work);
    return hand_on(&pool.failed, err);
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
    threads = threads > 1 ? pool_size(threads) : 1;
    if (threads <= 1)
        return pipe_alone(pipe, err);
    struct line line = {.pipe = pipe, .loop = &loop, .slot_count = slots,
                        .slots = calloc(slots, sizeof *line.slots)};
    if (line.slots == NULL || uv_loop_init(&loop) != 0) {
        free(line.slots);
        return no_memory(err);
    }
    for (size_t i = 0; i < slots; i++) {
        line.slots[i].line = &line;
        line.slots[i].number = i;
        line.slots[i].uv.data = &line.slots[i];
    }
    make_batches(&line);
    uv_run(&loop, UV_RUN_DEFAULT);
    uv_loop_close(&loop);
    free(line.slots);
    return hand_on(&line.failed, err);
}

unsigned spb_pool_cores(void)
{
    return uv_available_parallelism();
}
