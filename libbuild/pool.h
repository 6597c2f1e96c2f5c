/*
 * pool.h - independent jobs on all cores.
 */
#ifndef SPB_POOL_H
#define SPB_POOL_H

#include "spc.h"

#include <stdbool.h>

/*
 * The most threads that any run to come may use. libuv starts its pool once, for whoever is first: without
 * this a first run on few threads would leave no more to all others.
 */
void spb_pool_reserve(unsigned threads);

/*
 * Runs job(ctx, i, err) for every i below count, on up to threads threads at a time, in no
 * particular order. After a failure no new job starts. Returns the first failure by job number
 * among those that ran, so that the message does not depend on timing more than it must.
 *
 * tick (may be NULL) runs on the calling thread after each job and every tenth of a second;
 * non-zero cancels. Where no thread can be started the jobs run on the calling one.
 * fails  what a job failed with; SPC_CANCELLED; SPC_NO_MEMORY
 */
typedef enum spc_status (*spb_job_fn)(void *ctx, size_t i, struct spc_error *err);
typedef int (*spb_tick_fn)(void *ctx, size_t jobs_done);
enum spc_status spb_pool_run(size_t count, unsigned threads, spb_job_fn job, spb_tick_fn tick,
                             void *ctx, struct spc_error *err);

/*
 * A stream of batches through slots: make fills a slot, work changes it, take uses it up. make and
 * take run on the calling thread, each in the order of the batches; work runs on the pool's threads,
 * in no order. With one thread all run on the calling one. make sets *end instead when
 * there is no further batch. Stops at the first failure by order.
 * fails  what a step failed with; SPC_NO_MEMORY
 */
typedef enum spc_status (*spb_make_fn)(void *ctx, size_t slot, bool *end, struct spc_error *err);
struct spb_pipe {
    spb_make_fn make;
    spb_job_fn work, take;          /* i is the slot */
    void *ctx;
};
enum spc_status spb_pool_pipe(const struct spb_pipe *pipe, size_t slots, unsigned threads,
                              struct spc_error *err);

/* Inside a job: true when it is to end soon, with SPC_CANCELLED. Long jobs ask now and then. */
bool spb_pool_cancelled(void);

/* Cores that this process may use. */
unsigned spb_pool_cores(void);

#endif
