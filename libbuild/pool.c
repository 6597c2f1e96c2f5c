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

enum spc_status spb_pool_run(size_t count, unsigned threads, spb_job_fn job, spb_tick_fn tick,
                             void *ctx, struct spc_error *err)
{
    struct pool pool = {.job = job, .tick = tick, .ctx = ctx, .count = count};
    uv_loop_t loop;
    char size[16];
    if (threads < 1)
        threads = 1;
    if (threads > 1024)
        threads = 1024;
    snprintf(size, sizeof size, "%u", threads);
    setenv("UV_THREADPOOL_SIZE", size, 0);
    struct work *work = calloc(threads, sizeof *work);
    if (work == NULL || uv_loop_init(&loop) != 0) {
        free(work);
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to start threads");
    }
    for (unsigned t = 0; t < threads && pool.next < count; t++) {
        work[t].pool = &pool;
        work[t].uv.data = &work[t];
        work[t].index = pool.next++;
        uv_queue_work(&loop, &work[t].uv, run, finished);
    }
    uv_run(&loop, UV_RUN_DEFAULT);
    uv_loop_close(&loop);
    free(work);
    if (pool.failed.status != SPC_OK)
        return spc_fail(err, pool.failed.status, pool.failed.at_off, "%s", pool.failed.what);
    return SPC_OK;
}

unsigned spb_pool_cores(void)
{
    return uv_available_parallelism();
}
