/*
 * pool.h - independent jobs on all cores.
 */
#ifndef SPB_POOL_H
#define SPB_POOL_H

#include "spc.h"

/*
 * Runs job(ctx, i, err) for every i below count, on up to threads threads at a time, in no
 * particular order. After a failure no new job starts. Returns the first failure by job number
 * among those that ran, so that the message does not depend on timing more than it must.
 *
 * tick (may be NULL) runs on the calling thread after each job; non-zero cancels.
 * fails  what a job failed with; SPC_CANCELLED; SPC_NO_MEMORY
 */
typedef enum spc_status (*spb_job_fn)(void *ctx, size_t i, struct spc_error *err);
typedef int (*spb_tick_fn)(void *ctx, size_t jobs_done);
enum spc_status spb_pool_run(size_t count, unsigned threads, spb_job_fn job, spb_tick_fn tick,
                             void *ctx, struct spc_error *err);

/* Cores that this process may use. */
unsigned spb_pool_cores(void);

#endif
