/*
 * threads.h - a crew of threads that share the jobs of one caller.
 *
 * Threads wait between runs, so a run costs microseconds. The calling thread works, too: where no
 * other can be started, it works alone.
 */
#ifndef SPV_THREADS_H
#define SPV_THREADS_H

#include <stdbool.h>
#include <stddef.h>

struct spv_threads;

enum { SPV_THREADS_MAX = 1024 };

/* Cores that this process may use. */
unsigned spv_threads_cores(void);

/* As many of count threads as the system gives, the caller's included; 0: one a core. NULL: no memory. */
struct spv_threads *spv_threads_create(unsigned count);
void spv_threads_free(struct spv_threads *threads);

/* How many there are, the caller's included. */
unsigned spv_threads_count(const struct spv_threads *threads);

/*
 * Runs job(ctx, worker, i) for every i below count, each once, lower ones begun earlier; worker is
 * below the number of threads, and no two jobs run with the same one at a time. When a job returns
 * false no further one is begun. Returns when all that were begun have ended. Not reentrant.
 */
typedef bool (*spv_job_fn)(void *ctx, unsigned worker, size_t i);
void spv_threads_run(struct spv_threads *threads, size_t count, spv_job_fn job, void *ctx);

#endif
