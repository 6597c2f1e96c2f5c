/*
 * faults_sweep BUILD FOLDER fast|full SHARE OF: every call of the tools fails once.
 *
 * A run without faults counts the calls. Then, for every kind of call and every n, the nth call
 * fails, and what the tool says and leaves is judged: all or nothing, one line. fast takes some n
 * of each kind, full all of them. SHARE of OF: this process takes every OFth run.
 *
 * FOLDER holds scan.ply, in.spc (an archive) and lost.spc (a damaged one).
 */
#define _GNU_SOURCE
#include "faults_run.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define BUILD_OPTIONS "--threads", "1", "--part-faces", "300", "--cluster-nodes", "256", "--block-nodes", "64"

struct scenario {
    const char *argv[FAULTS_ARGS];
    bool no_tmpfile, old;
    bool exact;                     /* standard output never changes */
    bool loose;                     /* the number of calls varies a little */
    bool head;                      /* reads no more than the head of an archive */
    int dense;                      /* so many times the n of fast */
};

static const struct scenario scenarios[] = {
    {{"spc-build", "-q", BUILD_OPTIONS, "--temp", "temp", "sc\303\244n.ply", "-o", "out/t.spc", NULL}, .dense = 4},
    {{"spc-build", "-q", BUILD_OPTIONS, "--temp", "temp", "--force", "sc\303\244n.ply", "-o", "out/t.spc", NULL},
     .old = true, .dense = 1},
    {{"spc-build", "-q", BUILD_OPTIONS, "--json", "sc\303\244n.ply", "-o", "out/t.spc", NULL},
     .no_tmpfile = true, .dense = 1},
    {{"spc-build", "-q", BUILD_OPTIONS, "--force", "sc\303\244n.ply", "-o", "out/t.spc", NULL},
     .no_tmpfile = true, .old = true, .dense = 1},
    {{"spc-build", "-q", BUILD_OPTIONS, "--codec", "raw", "in.spc", "-o", "out/t.spc", NULL}, .dense = 2},
    {{"spc-build", "-q", "--threads", "3", "--part-faces", "100", "sc\303\244n.ply", "-o", "out/t.spc", NULL},
     .loose = true, .dense = 1},
    {{"spc-info", "--verify", "in.spc", NULL}, .exact = true, .dense = 2},
    {{"spc-info", "--verify", "--json", "in.spc", NULL}, .exact = true, .dense = 1},
    {{"spc-info", "--json", "in.spc", NULL}, .exact = true, .head = true, .dense = 1},
    {{"spc-info", "--json", "--recover", "out/t.spc", "lost.spc", NULL}, .exact = true, .dense = 2},
    {{"spc-info", "--recover", "out/t.spc", "in.spc", "--force", NULL}, .exact = true, .old = true, .dense = 1},
};

/* What a kind may fail with. EINTR must be survived. */
static const struct { int kind, errors[3]; } causes[] = {
    {FAULTS_open, {EMFILE, EINTR, EACCES}}, {FAULTS_mkstemp, {ENOSPC}}, {FAULTS_stat, {EIO}},
    {FAULTS_read, {EIO, EINTR}}, {FAULTS_pread, {EIO, EINTR}}, {FAULTS_write, {ENOSPC, EIO, EINTR}},
    {FAULTS_pwrite, {ENOSPC, EIO, EINTR}}, {FAULTS_fsync, {EIO, EINTR, EDQUOT}},
    {FAULTS_ftruncate, {EIO}}, {FAULTS_fallocate, {ENOSPC}}, {FAULTS_sync_range, {EIO, EINTR}},
    {FAULTS_rename, {EIO}}, {FAULTS_link, {EIO, EMLINK}}, {FAULTS_unlink, {EIO}},
    {FAULTS_flock, {ENOLCK, EINTR}}, {FAULTS_fcntl, {ENOLCK}}, {FAULTS_mmap, {ENOMEM}},
    {FAULTS_malloc, {ENOMEM}},
};

/* What is done to all calls of a run at once. true: the run must survive. */
static const struct { const char *more; bool harmless; } climates[] = {
    {"FAULTS_SHORT=1", true}, {"FAULTS_SHORT=half", true}, {"FAULTS_EINTR=1", true},
    {"FAULTS_NO_TMPFILE=1", true}, {"FAULTS_NO_THREADS=1", true}, {"FAULTS_BUS=1", false},
};

static struct outcome whole;        /* the run without faults */
static char *archive;               /* what it made, or NULL */
static size_t archive_bytes;
static unsigned long runs, share, of;

static bool builds(const struct scenario *s)
{
    return archive != NULL && s != NULL;
}

static const char *judge_success(const struct scenario *s, const struct fault *f, const struct outcome *o)
{
    if (builds(s) && !faults_same("out/t.spc", archive, archive_bytes))
        return "success, but not the archive that should be";
    if (strcmp(o->err, whole.err) != 0)
        return "success, with words on stderr";
    if (s->exact ? strcmp(o->out, whole.out) != 0 : faults_lines(o->out) != faults_lines(whole.out))
        return "success, but not all of standard output";
    if (f->kind == FAULTS_fsync && f->error != 0 && f->error != EINTR)
        return "success, though the archive may not be on the disk";
    return NULL;
}

static const char *judge_failure(const struct scenario *s, const struct fault *f, const struct outcome *o)
{
    if (f->error == EINTR)
        return "an interrupted call is not a failure";
    if (faults_lines(o->err) != 1)
        return "not one line";
    if (strncmp(o->err, s->argv[0], strlen(s->argv[0])) != 0 ||
        (strstr(o->err, "n.ply") == NULL && strstr(o->err, ".spc") == NULL))
        return "the line does not name tool and file";
    if ((f->error == ENOSPC || f->error == EDQUOT) && strstr(o->err, "free some space") == NULL)
        return "a full disk without a remedy";
    if (strstr(o->err, "the archive is complete") != NULL)
        return faults_same("out/t.spc", archive, archive_bytes) ? NULL : "the archive is not complete";
    if (s->old ? !faults_is_old() : !faults_is_absent())
        return s->old ? "the old target is gone" : "failure, but there is a target";
    return NULL;
}

static void judge(const struct scenario *s, const struct fault *f, const struct outcome *o)
{
    const char *left = faults_left(), *what = NULL;
    if (o->code == FAULTS_TIMED_OUT)
        what = "it hangs";
    else if (o->code >= FAULTS_SIGNALLED)
        what = "it crashes";
    else if (o->report.delivered == 0 && !s->loose)
        what = "the fault did not come";
    else if (left != NULL && f->kind != FAULTS_unlink)
        what = "something is left behind";
    else if (o->code == whole.code && (o->code == 0 || o->err[0] == '\0'))
        what = judge_success(s, f, o);
    else if (o->code == 1)
        what = judge_failure(s, f, o);
    else
        what = "another exit code";
    if (what != NULL)
        faults_problem(what, s->argv, f, o);
}

static void try(const struct scenario *s, const struct fault *f)
{
    struct outcome o;
    if (runs++ % of != share)
        return;
    faults_clean(s->old);
    faults_run(s->argv, f, &o);
    judge(s, f, &o);
}

/* fast: the first and last few, and some between, evenly. */
static uint64_t step_after(uint64_t n, uint64_t count, uint64_t most)
{
    if (most == 0 || count <= most || n < most / 4 || n + most / 4 >= count)
        return n + 1;
    const uint64_t step = 2 * (count - most / 2) / most + 1;
    return n + step < count - most / 4 ? n + step : count - most / 4;
}

static void sweep_kind(const struct scenario *s, int kind, const int errors[3], bool full)
{
    const uint64_t count = whole.report.calls[kind];
    const bool many = kind == FAULTS_malloc || kind == FAULTS_pread || kind == FAULTS_pwrite;
    for (int e = 0; e < 3 && errors[e] != 0; e++) {
        const uint64_t most = full ? 0 : e > 0 ? 3 : (uint64_t)(many ? 8 : 5) * (uint64_t)s->dense;
        for (uint64_t n = 1; n <= count; n = step_after(n, count, most))
            try(s, &(struct fault){.kind = kind, .nth = n, .error = errors[e], .no_tmpfile = s->no_tmpfile});
    }
}

static void sweep_climates(const struct scenario *s)
{
    for (size_t i = 0; i < sizeof climates / sizeof *climates; i++) {
        const struct fault f = {.kind = -1, .more = climates[i].more, .no_tmpfile = s->no_tmpfile};
        struct outcome o;
        if (runs++ % of != share)
            continue;
        faults_clean(s->old);
        faults_run(s->argv, &f, &o);
        if (climates[i].harmless) {
            o.report.delivered = 1; /* not every tool makes such calls */
            judge(s, &f, &o);
            if (o.code != whole.code)
                faults_problem("this should not matter", s->argv, &f, &o);
        } else if (o.report.delivered > 0 && !s->head && (o.code != 1 || faults_lines(o.err) != 1)) {
            faults_problem("not one line and exit 1", s->argv, &f, &o);
        }
    }
}

/* Disks of so many bytes, from none to what a whole run writes. */
static void sweep_space(const struct scenario *s, bool full)
{
    const unsigned steps = full ? 200 : 6;
    struct outcome o;
    uint64_t total = 0;
    char more[64];
    if (archive == NULL)
        return;
    for (uint64_t lo = 0, hi = (uint64_t)1 << 24; lo + 1 < hi; total = hi) {    /* what is enough */
        const uint64_t middle = lo + (hi - lo) / 2;
        snprintf(more, sizeof more, "FAULTS_SPACE=%llu", (unsigned long long)middle);
        faults_clean(s->old);
        faults_run(s->argv, &(struct fault){.kind = -1, .more = more, .no_tmpfile = s->no_tmpfile}, &o);
        if (o.report.delivered == 0)
            hi = middle;
        else
            lo = middle;
    }
    for (unsigned i = 0; i <= steps; i++) {
        const uint64_t space = i == steps ? total - 1 : total * i / steps;
        snprintf(more, sizeof more, "FAULTS_SPACE=%llu", (unsigned long long)space);
        const struct fault f = {.kind = -1, .error = ENOSPC, .more = more, .no_tmpfile = s->no_tmpfile};
        try(s, &f);
    }
}

/* Behind the name it is too late, and before the handlers nothing has begun. */
static void judge_signal(const struct scenario *s, const struct fault *f, const struct outcome *o)
{
    const bool early = f->kind == FAULTS_pwrite || f->kind == FAULTS_pread ||
                       (f->kind == FAULTS_fsync && f->nth == 1);
    if (o->code == FAULTS_SIGNALLED + f->signal && o->report.calls[FAULTS_pwrite] == 0 &&
        faults_left() == NULL && (s->old ? faults_is_old() : faults_is_absent()))
        return;
    if (o->err[0] == '\0' && early)
        faults_problem("a signal is ignored", s->argv, f, o);
    else if (o->err[0] != '\0' && strstr(o->err, "cancelled") == NULL)
        faults_problem("not cancelled", s->argv, f, o);
    else
        judge(s, f, o);
}

/* Signals ask it to end, at the nth call. */
static void sweep_signals(const struct scenario *s, bool full)
{
    static const int kinds[] = {FAULTS_open, FAULTS_pread, FAULTS_pwrite, FAULTS_fsync, FAULTS_malloc,
                                FAULTS_link, FAULTS_rename};
    static const int signals[] = {SIGINT, SIGTERM, SIGHUP};
    struct outcome o;
    if (archive == NULL)
        return;
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        const uint64_t count = whole.report.calls[kinds[k]];
        for (uint64_t n = 1; n <= count; n = step_after(n, count, full ? 400 : 4)) {
            const struct fault f = {.kind = kinds[k], .nth = n, .signal = signals[n % 3],
                                    .no_tmpfile = s->no_tmpfile};
            if (runs++ % of != share)
                continue;
            faults_clean(s->old);
            faults_run(s->argv, &f, &o);
            judge_signal(s, &f, &o);
        }
    }
}

static void sweep(const struct scenario *s, bool full)
{
    const struct fault none = {.kind = -1, .no_tmpfile = s->no_tmpfile};
    faults_clean(s->old);
    faults_run(s->argv, &none, &whole);
    free(archive);
    archive = faults_is_absent() ? NULL : faults_bytes("out/t.spc", &archive_bytes);
    const bool recovers = archive != NULL && strcmp(s->argv[0], "spc-info") == 0;
    if (whole.code > (recovers ? 1 : 0) || faults_left() != NULL) {
        faults_problem("the run without faults fails", s->argv, &none, &whole);
        return;
    }
    if (share == 0 && getenv("FAULTS_VERBOSE") != NULL) {
        printf("%s %s:", s->argv[0], s->argv[1]);
        for (int k = 0; k < FAULTS_KIND_COUNT; k++)
            printf(" %s %llu", faults_kind_name(k), (unsigned long long)whole.report.calls[k]);
        putchar('\n');
    }
    for (size_t i = 0; i < sizeof causes / sizeof *causes; i++)
        sweep_kind(s, causes[i].kind, causes[i].errors, full);
    sweep_climates(s);
    sweep_space(s, full);
    sweep_signals(s, full);
}

int main(int argc, char **argv)
{
    if (argc < 6) {
        fputs("usage: faults_sweep BUILD FOLDER fast|full SHARE OF\n", stderr);
        return 2;
    }
    faults_begin(argv[1], argv[2]);
    share = strtoul(argv[4], NULL, 10);
    of = strtoul(argv[5], NULL, 10);
    for (size_t i = 0; i < sizeof scenarios / sizeof *scenarios; i++) {
        const double began = faults_now();
        const unsigned long before = runs;
        sweep(&scenarios[i], strcmp(argv[3], "full") == 0);
        if (getenv("FAULTS_VERBOSE") != NULL)
            printf("  %.1f s, %lu runs\n", faults_now() - began, (runs - before) / of);
    }
    printf("%lu faults, %d problems\n", runs / of, faults_problems());
    return faults_problems() > 0;
}
