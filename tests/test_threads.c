/* Crews of threads: every job once, each worker one at a time, an end at the first failure. */
#include "suite.h"
#include "threads.h"

#include <stdatomic.h>
#include <stdlib.h>

enum { JOBS = 5000 };

struct counts {
    atomic_uint runs[JOBS], busy[SPV_THREADS_MAX];
    unsigned workers;
    size_t fail_at;
    atomic_size_t begun;
};

static bool count(void *ctx, unsigned worker, size_t i)
{
    struct counts *c = ctx;
    if (worker >= c->workers || atomic_fetch_add(&c->busy[worker], 1) != 0)
        abort();
    atomic_fetch_add(&c->runs[i], 1);
    atomic_fetch_add(&c->begun, 1);
    atomic_fetch_sub(&c->busy[worker], 1);
    return i != c->fail_at;
}

START_TEST(every_job_runs_once_and_no_worker_twice_at_a_time)
{
    static const unsigned crews[] = {1, 2, 5, 33};
    for (size_t k = 0; k < sizeof crews / sizeof *crews; k++) {
        struct spv_threads *t = spv_threads_create(crews[k]);
        ck_assert_ptr_nonnull(t);
        ck_assert_uint_eq(spv_threads_count(t), crews[k]);
        struct counts *c = calloc(1, sizeof *c);
        c->workers = crews[k];
        c->fail_at = SIZE_MAX;
        for (unsigned run = 1; run <= 20; run++) {
            spv_threads_run(t, run == 7 ? 1 : JOBS, count, c);
            for (size_t i = 0; i < JOBS; i++)
                if (atomic_load(&c->runs[i]) != run - (run >= 7 && i > 0))
                    ck_abort_msg("job %zu ran %u times", i, atomic_load(&c->runs[i]));
        }
        spv_threads_run(t, 0, count, c);
        free(c);
        spv_threads_free(t);
    }
    spv_threads_free(NULL);
}
END_TEST

START_TEST(a_failure_ends_the_run_and_the_next_run_is_whole)
{
    struct spv_threads *t = spv_threads_create(4);
    struct counts *c = calloc(1, sizeof *c);
    c->workers = 4;
    c->fail_at = 10;
    spv_threads_run(t, JOBS, count, c);
    for (size_t i = 0; i <= 10; i++)
        ck_assert_uint_eq(atomic_load(&c->runs[i]), 1);
    ck_assert_uint_le(atomic_load(&c->runs[JOBS - 1]), 1);
    c->fail_at = 0;
    struct spv_threads *one = spv_threads_create(1);
    atomic_store(&c->begun, 0);
    spv_threads_run(one, JOBS, count, c);
    ck_assert_uint_eq(atomic_load(&c->begun), 1);
    spv_threads_free(one);
    c->fail_at = SIZE_MAX;
    atomic_store(&c->begun, 0);
    spv_threads_run(t, JOBS, count, c);
    ck_assert_uint_eq(atomic_load(&c->begun), JOBS);
    spv_threads_free(t);
    free(c);
}
END_TEST

START_TEST(without_a_number_there_is_at_least_one)
{
    struct spv_threads *t = spv_threads_create(0);
    ck_assert_uint_ge(spv_threads_count(t), 1);
    spv_threads_free(t);
    t = spv_threads_create(1000000);
    ck_assert_uint_le(spv_threads_count(t), SPV_THREADS_MAX);
    spv_threads_free(t);
}
END_TEST

int main(void)
{
    return SUITE("threads", NULL, NULL, every_job_runs_once_and_no_worker_twice_at_a_time,
                 a_failure_ends_the_run_and_the_next_run_is_whole,
                 without_a_number_there_is_at_least_one);
}
