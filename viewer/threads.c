/*
 * threads.c - a crew of threads.
 *
 * Threads of libuv, not its pool: that one is the process's, of a size that is fixed by whoever uses
 * it first, and ends the process when a thread cannot be started.
 */
#include "threads.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <uv.h>

struct worker {
    struct spv_threads *crew;
    uv_thread_t thread;
    unsigned number;
};

struct spv_threads {
    unsigned count;                 /* with the caller's, which is number 0 */
    uv_mutex_t lock;                /* guards what follows, up to the job */
    uv_cond_t begin, end;
    unsigned round, running;        /* runs so far; threads that have not finished this one */
    bool stop;
    spv_job_fn job;
    void *ctx;
    size_t job_count;
    atomic_size_t next;
    struct worker workers[];
};

static void work(struct spv_threads *crew, unsigned number)
{
    size_t i;
    while ((i = atomic_fetch_add(&crew->next, 1)) < crew->job_count)
        if (!crew->job(crew->ctx, number, i))
            atomic_store(&crew->next, crew->job_count);
}

static void serve(void *at)
{
    const struct worker *w = at;
    struct spv_threads *crew = w->crew;
    unsigned seen = 0;
    uv_mutex_lock(&crew->lock);
    for (;;) {
        while (!crew->stop && crew->round == seen)
            uv_cond_wait(&crew->begin, &crew->lock);
        if (crew->stop)
            break;
        seen = crew->round;
        uv_mutex_unlock(&crew->lock);
        work(crew, w->number);
        uv_mutex_lock(&crew->lock);
        if (--crew->running == 0)
            uv_cond_signal(&crew->end);
    }
    uv_mutex_unlock(&crew->lock);
}

static bool init(struct spv_threads *crew)
{
    if (uv_mutex_init(&crew->lock) != 0)
        return false;
    if (uv_cond_init(&crew->begin) == 0) {
        if (uv_cond_init(&crew->end) == 0)
            return true;
        uv_cond_destroy(&crew->begin);
    }
    uv_mutex_destroy(&crew->lock);
    return false;
}

unsigned spv_threads_cores(void)
{
    return uv_available_parallelism();
}

struct spv_threads *spv_threads_create(unsigned count)
{
    if (count == 0)
        count = spv_threads_cores();
    if (count > SPV_THREADS_MAX)
        count = SPV_THREADS_MAX;
    struct spv_threads *crew = calloc(1, sizeof *crew + count * sizeof *crew->workers);
    if (crew == NULL || !init(crew)) {
        free(crew);
        return NULL;
    }
    for (crew->count = 1; crew->count < count; crew->count++) {
        struct worker *w = &crew->workers[crew->count];
        *w = (struct worker){.crew = crew, .number = crew->count};
        if (uv_thread_create(&w->thread, serve, w) != 0)
            break;
    }
    return crew;
}

void spv_threads_free(struct spv_threads *crew)
{
    if (crew == NULL)
        return;
    uv_mutex_lock(&crew->lock);
    crew->stop = true;
    uv_cond_broadcast(&crew->begin);
    uv_mutex_unlock(&crew->lock);
    for (unsigned t = 1; t < crew->count; t++)
        uv_thread_join(&crew->workers[t].thread);
    uv_cond_destroy(&crew->end);
    uv_cond_destroy(&crew->begin);
    uv_mutex_destroy(&crew->lock);
    free(crew);
}

unsigned spv_threads_count(const struct spv_threads *crew)
{
    return crew->count;
}

void spv_threads_run(struct spv_threads *crew, size_t count, spv_job_fn job, void *ctx)
{
    crew->job = job;
    crew->ctx = ctx;
    crew->job_count = count;
    atomic_store(&crew->next, 0);
    if (crew->count > 1 && count > 1) {
        uv_mutex_lock(&crew->lock);
        crew->running = crew->count - 1;
        crew->round++;
        uv_cond_broadcast(&crew->begin);
        uv_mutex_unlock(&crew->lock);
    }
    work(crew, 0);
    if (crew->count > 1 && count > 1) {
        uv_mutex_lock(&crew->lock);
        while (crew->running > 0)
            uv_cond_wait(&crew->end, &crew->lock);
        uv_mutex_unlock(&crew->lock);
    }
}
