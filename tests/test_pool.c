#include "mesh_case.h"
#include "pool.h"
#include "suite.h"

#include <dirent.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>

/* ---- how many threads -------------------------------------------------------------------------- */

static unsigned threads_now(void)
{
    unsigned n = 0;
    DIR *tasks = opendir("/proc/self/task");
    for (struct dirent *d; tasks != NULL && (d = readdir(tasks)) != NULL;)
        n += d->d_name[0] != '.';
    if (tasks != NULL)
        closedir(tasks);
    return n;
}

static int look(void *ctx, const char *phase, uint64_t done, uint64_t total)
{
    unsigned *most = ctx;
    (void)done, (void)total;
    if (strcmp(phase, "build parts") == 0 && threads_now() > *most)
        *most = threads_now();
    return 0;
}

/* First in this file: the pool is started once. Faces are read on fewer threads, before. */
START_TEST(parts_are_built_on_as_many_threads_as_were_asked_for)
{
    unsigned most = 0;
    struct case_mesh mesh = case_soup(4000, 1);
    struct spb_build_options options = case_options(case_write(&mesh, "scan.ply"), case_path("a.spc"));
    options.threads = 9;
    options.part_faces = 100;
    options.progress = (struct spb_progress){look, &most};
    spc_reader_close(case_build(&options));
    ck_assert_uint_ge(most, 9);
    case_mesh_free(&mesh);
}
END_TEST

/* ---- batches ------------------------------------------------------------------------------------ */

enum { SLOTS = 5, BATCHES = 200 };

struct batches {
    uint32_t made, taken;
    uint32_t in[SLOTS], out[SLOTS];
    uint32_t fail_make, fail_work, fail_take;       /* at this batch; or BATCHES */
};

static enum spc_status make(void *ctx, size_t slot, bool *end, struct spc_error *err)
{
    struct batches *b = ctx;
    *end = b->made == BATCHES;
    if (b->made == b->fail_make && !*end)
        return spc_fail(err, SPC_INPUT_BAD, SPC_NO_OFF, "make");
    b->in[slot] = b->made++;
    return SPC_OK;
}

static enum spc_status work(void *ctx, size_t slot, struct spc_error *err)
{
    struct batches *b = ctx;
    uint32_t x = b->in[slot];
    for (uint32_t i = 0; i < b->in[slot] % 7 * 10000; i++)      /* some take longer */
        x = x * 1664525 + 1013904223;
    b->out[slot] = b->in[slot] + (x & 0);
    return b->in[slot] == b->fail_work ? spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "work") : SPC_OK;
}

static enum spc_status take(void *ctx, size_t slot, struct spc_error *err)
{
    struct batches *b = ctx;
    ck_assert_uint_eq(b->out[slot], b->taken);
    if (b->taken == b->fail_take)
        return spc_fail(err, SPC_IO, SPC_NO_OFF, "take");
    b->taken++;
    return SPC_OK;
}

static enum spc_status flow(struct batches *b, unsigned threads, struct spc_error *err)
{
    const struct spb_pipe pipe = {make, work, take, b};
    return spb_pool_pipe(&pipe, SLOTS, threads, err);
}

START_TEST(batches_are_taken_in_order_whatever_the_threads)
{
    for (unsigned threads = 1; threads <= 4; threads++) {
        struct batches b = {.fail_make = BATCHES, .fail_work = BATCHES, .fail_take = BATCHES};
        ck_assert_int_eq(flow(&b, threads, NULL), SPC_OK);
        ck_assert_uint_eq(b.taken, BATCHES);
    }
}
END_TEST

START_TEST(batches_before_one_that_fails_in_work_or_in_taking_are_taken_and_none_behind_it)
{
    for (unsigned threads = 1; threads <= 4; threads++)
        for (uint32_t at = 0; at < BATCHES; at += 37)
            for (int step = 0; step < 2; step++) {
                struct spc_error err = {0};
                struct batches b = {.fail_make = BATCHES, .fail_work = step == 0 ? at : BATCHES,
                                    .fail_take = step == 1 ? at : BATCHES};
                const enum spc_status status = flow(&b, threads, &err);
                ck_assert_int_eq(status, step == 0 ? SPC_NO_MEMORY : SPC_IO);
                ck_assert_int_eq(err.status, status);
                ck_assert_str_eq(err.what, step == 0 ? "work" : "take");
                ck_assert_uint_eq(b.taken, at);
            }
}
END_TEST

START_TEST(a_failure_of_making_ends_the_stream)
{
    for (unsigned threads = 1; threads <= 4; threads++)
        for (uint32_t at = 0; at < BATCHES; at += 37) {
            struct spc_error err = {0};
            struct batches b = {.fail_make = at, .fail_work = BATCHES, .fail_take = BATCHES};
            ck_assert_int_eq(flow(&b, threads, &err), SPC_INPUT_BAD);
            ck_assert_str_eq(err.what, "make");
            ck_assert_uint_le(b.taken, at);
        }
}
END_TEST

int main(void)
{
    return SUITE("pool", case_start, case_finish, parts_are_built_on_as_many_threads_as_were_asked_for,
                 batches_are_taken_in_order_whatever_the_threads,
                 batches_before_one_that_fails_in_work_or_in_taking_are_taken_and_none_behind_it,
                 a_failure_of_making_ends_the_stream);
}
