/*
 * faults_stops BUILD FOLDER fast|full SEED: builds that are killed, asked to end, or meet another one.
 *
 * FOLDER holds scan.ply, small, large.ply, which takes some tenths of a second, and huge.ply, which
 * takes seconds when it is to show how soon a build ends.
 * Killed builds leave nothing that the next one does not remove. Two builds of one target stop each
 * other at chosen calls (SIGSTOP), so that each meeting happens every time.
 */
#define _GNU_SOURCE
#include "faults_run.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define SMALL "--threads", "1", "--part-faces", "300", "--cluster-nodes", "256", "--block-nodes", "64"
#define TARGET "-o", "out/t.spc", NULL

typedef const char *const command[FAULTS_ARGS];

static command small = {"spc-build", "-q", SMALL, "--temp", "temp", "scan.ply", TARGET};
static command small_force = {"spc-build", "-q", "--force", SMALL, "--temp", "temp", "scan.ply", TARGET};
static command raw = {"spc-build", "-q", "--codec", "raw", SMALL, "--temp", "temp", "scan.ply", TARGET};
static command raw_force = {"spc-build", "-q", "--codec", "raw", "--force", SMALL, "--temp", "temp", "scan.ply",
                            TARGET};
static command large = {"spc-build", "-q", "--threads", "2", "--temp", "temp", "large.ply", TARGET};
static command huge = {"spc-build", "-q", "--threads", "2", "--temp", "temp", "huge.ply", TARGET};
static command huge_raw = {"spc-build", "-q", "--codec", "raw", "--temp", "temp", "huge.ply", TARGET};
static command verify = {"spc-info", "--verify", "out/t.spc", NULL};

struct bytes {
    char *all;
    size_t n;
};

static struct bytes made_by(command argv, bool old)
{
    struct bytes b = {0};
    struct outcome o;
    const struct fault none = {.kind = -1};
    faults_clean(old);
    faults_run(argv, NULL, &o);
    b.all = faults_bytes("out/t.spc", &b.n);
    if (o.code != 0 || b.all == NULL) {
        faults_problem("the run without faults fails", argv, &none, &o);
        exit(1);
    }
    return b;
}

static bool is(const struct bytes *b)
{
    return faults_same("out/t.spc", b->all, b->n);
}

/* ---- killed ------------------------------------------------------------------------------------ */

/* After a kill: no target, or a whole one; and the next run makes one and clears all else away. */
static void judge_killed(command argv, command again, const struct fault *f, bool old, const struct bytes *whole)
{
    struct outcome o;
    const struct fault next = {.kind = -1, .no_tmpfile = f->no_tmpfile};
    if (!(old ? faults_is_old() : faults_is_absent()) && !is(whole)) {
        o = (struct outcome){.code = FAULTS_SIGNALLED + SIGKILL};
        faults_problem("a kill leaves half a target", argv, f, &o);
    }
    if (!old)
        unlink("out/t.spc");
    faults_run(again, &next, &o);
    if (o.code != 0 || !is(whole))
        faults_problem("the run after a kill fails", argv, f, &o);
    if (faults_left() != NULL)
        faults_problem(faults_left(), argv, f, &o);
}

static void kill_at_calls(bool full, const struct bytes *whole)
{
    static const int kinds[] = {FAULTS_open, FAULTS_pwrite, FAULTS_pread, FAULTS_fsync, FAULTS_flock, FAULTS_stat,
                                FAULTS_link, FAULTS_rename, FAULTS_unlink};
    struct outcome o;
    for (int mode = 0; mode < 4; mode++) {
        const bool old = mode & 1;
        command *argv = old ? &small_force : &small;
        struct fault f = {.kind = -1, .no_tmpfile = mode & 2};
        faults_clean(old);
        faults_run(*argv, &f, &o);
        const struct faults_report counted = o.report;
        for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
            const uint64_t count = counted.calls[kinds[k]], most = full ? 40 : 2;
            for (uint64_t n = 1; n <= count; n += count > most ? count / most : 1) {
                f = (struct fault){.kind = kinds[k], .nth = n, .signal = SIGKILL, .no_tmpfile = mode & 2};
                faults_clean(old);
                faults_run(*argv, &f, &o);
                judge_killed(*argv, *argv, &f, old, whole);
            }
        }
    }
}

static void sleep_until(double when)
{
    const double left = when - faults_now();
    if (left > 0)
        nanosleep(&(struct timespec){(time_t)left, (long)((left - (double)(time_t)left) * 1e9)}, NULL);
}

static void kill_at_random(unsigned times, bool no_tmpfile, const struct bytes *whole, double seconds)
{
    const struct fault f = {.kind = -1, .no_tmpfile = no_tmpfile};
    struct outcome o;
    for (unsigned i = 0; i < times; i++) {
        faults_clean(false);
        struct process p = faults_start(large, &f);
        sleep_until(p.began + seconds * drand48());
        kill(p.pid, SIGKILL);
        faults_wait(&p, 10, &o);
        judge_killed(large, large, &f, false, whole);
    }
}

/* ---- asked to end ------------------------------------------------------------------------------ */

/* At moments spread over a long build: at most so many seconds until it has ended, all cleared away. */
static void end_at_moments(unsigned times, bool no_tmpfile, const struct bytes *whole, double seconds,
                           double most)
{
    static const int signals[] = {SIGINT, SIGTERM, SIGHUP};
    const struct fault f = {.kind = -1, .no_tmpfile = no_tmpfile};
    double slowest = 0;
    struct outcome o;
    for (unsigned i = 0; i < times; i++) {
        faults_clean(false);
        struct process p = faults_start(huge, &f);
        sleep_until(p.began + 0.02 + seconds * i / times);
        const double asked = faults_now();
        kill(p.pid, signals[i % 3]);
        faults_wait(&p, 20, &o);
        const double took = faults_now() - asked;
        slowest = took > slowest ? took : slowest;
        if (faults_left() != NULL || (o.code != 0 && !faults_is_absent()) || (o.code == 0 && !is(whole)))
            faults_problem("a signal leaves something", huge, &f, &o);
        const bool begun = o.code != FAULTS_SIGNALLED + signals[i % 3] || o.report.calls[FAULTS_pwrite] > 0;
        if ((o.code > 1 && begun) || (o.code == 1 && (faults_lines(o.err) != 1 || strstr(o.err, "cancelled") == NULL)))
            faults_problem("a signal is not one line and exit 1", huge, &f, &o);
        if (took > most)
            faults_problem("it takes long to end", huge, &f, &o);
    }
    printf("asked to end: after %.2f s at the latest\n", slowest);
}

/* ---- two builds of one target ------------------------------------------------------------------ */

struct meeting {
    command *first, *second;        /* the first stops at a call, the second runs, the first goes on */
    struct fault stop;
    bool second_no_tmpfile, old;
    const char *first_says, *second_says;   /* NULL: success */
    int winner;                     /* whose archive stays: 0 the first's, 1 the second's */
};

#define BUSY "another run is writing 't.spc.part'; wait for it, or choose another name"
#define APPEARED "the target appeared in the meantime; --force replaces it"
#define EXISTS "the target exists; --force replaces it"
#define AT(which, n, part) {.kind = FAULTS_##which, .nth = n, .signal = SIGSTOP, .no_tmpfile = part}

static const struct meeting meetings[] = {
    /* unnamed files: whoever is named first wins; with --force, last */
    {&small, &raw, AT(pwrite, 9, false), false, false, APPEARED, NULL, 1},
    {&small, &raw, AT(link, 1, false), false, false, APPEARED, NULL, 1},
    {&small, &raw, AT(fsync, 2, false), false, false, NULL, EXISTS, 0},
    {&small_force, &raw, AT(pwrite, 9, false), false, false, NULL, NULL, 0},
    {&small_force, &raw_force, AT(pwrite, 9, false), false, true, NULL, NULL, 0},
    {&small_force, &raw_force, AT(link, 1, false), false, true, NULL, NULL, 0},
    {&small, &raw_force, AT(pwrite, 9, false), false, false, APPEARED, NULL, 1},
    /* stopped while it holds path.part: the second waits for two seconds */
    {&small_force, &raw_force, AT(rename, 1, false), false, true, NULL, BUSY, 0},
    {&small_force, &raw_force, AT(fsync, 2, false), false, true, NULL, BUSY, 0},
    {&small_force, &raw, AT(rename, 1, false), false, false, NULL, NULL, 0},
    /* no unnamed files: path.part is locked from the beginning */
    {&small, &raw, AT(pwrite, 9, true), true, false, NULL, BUSY, 0},
    {&small, &raw, AT(flock, 1, true), true, false, APPEARED, NULL, 1},
    {&small_force, &raw_force, AT(pwrite, 9, true), true, true, NULL, BUSY, 0},
    {&small_force, &raw_force, AT(rename, 1, true), true, true, NULL, BUSY, 0},
    {&small, &raw, AT(link, 1, true), true, false, NULL, BUSY, 0},
    {&small, &raw, AT(unlink, 3, true), true, false, NULL, EXISTS, 0},
    /* one of each kind */
    {&small, &raw, AT(pwrite, 9, true), false, false, APPEARED, NULL, 1},
    {&small, &raw, AT(pwrite, 9, false), true, false, APPEARED, NULL, 1},
    {&small_force, &raw_force, AT(pwrite, 9, false), true, true, NULL, NULL, 0},
    {&small_force, &raw_force, AT(pwrite, 9, true), false, true, NULL, BUSY, 0},
};

static bool says(const struct outcome *o, const char *text)
{
    if (text == NULL)
        return o->code == 0 && o->err[0] == '\0';
    return o->code == 1 && faults_lines(o->err) == 1 && strstr(o->err, text) != NULL;
}

static void meet(const struct meeting *m, const struct bytes of[2])
{
    const struct fault second = {.kind = -1, .no_tmpfile = m->second_no_tmpfile};
    struct outcome a, b, v;
    faults_clean(m->old);
    struct process p = faults_start(*m->first, &m->stop);
    const bool stopped = faults_stopped(&p, 20);
    if (stopped)
        faults_run(*m->second, &second, &b);
    kill(p.pid, SIGCONT);
    faults_wait(&p, 20, &a);
    if (!stopped) {
        faults_problem("it never came to that call", *m->first, &m->stop, &a);
        return;
    }
    if (!says(&a, m->first_says))
        faults_problem("the first of two builds", *m->first, &m->stop, &a);
    if (!says(&b, m->second_says))
        faults_problem("the second of two builds", *m->second, &m->stop, &b);
    faults_run(verify, NULL, &v);
    if (v.code != 0)
        faults_problem("the archive of two builds", verify, &m->stop, &v);
    if (!is(&of[m->winner]))
        faults_problem("of two builds the other one stays", *m->first, &m->stop, &a);
    if (faults_left() != NULL)
        faults_problem(faults_left(), *m->first, &m->stop, &a);
}

/* Both at once, without order: whatever happens is one of the things that may. */
static void race(unsigned times, bool no_tmpfile, const struct bytes of[2])
{
    const struct fault f = {.kind = -1, .no_tmpfile = no_tmpfile};
    for (unsigned i = 0; i < times; i++) {
        const bool force = i % 2;
        struct outcome a, b;
        faults_clean(force);
        struct process p = faults_start(force ? small_force : small, &f);
        sleep_until(p.began + 0.01 * drand48());
        struct process q = faults_start(force ? raw_force : raw, &f);
        faults_wait(&p, 20, &a);
        faults_wait(&q, 20, &b);
        const bool known = (a.code == 0 || says(&a, APPEARED) || says(&a, EXISTS) || says(&a, BUSY)) &&
                           (b.code == 0 || says(&b, APPEARED) || says(&b, EXISTS) || says(&b, BUSY));
        if (!known || (a.code != 0 && b.code != 0))
            faults_problem("two builds at once", small, &f, a.code != 0 ? &a : &b);
        if (!(a.code == 0 && is(&of[0])) && !(b.code == 0 && is(&of[1])))
            faults_problem("no archive of two builds at once", small, &f, &a);
        if (faults_left() != NULL)
            faults_problem(faults_left(), small, &f, &a);
    }
}

/* ---- a large archive, which is sent to the disk while it is written ------------------------------ */

static void sync_on_the_way(void)
{
    static const int errors[] = {EIO, ENOSPC, EINTR, EINVAL};
    const struct bytes whole = made_by(huge_raw, false);
    struct outcome o;
    const uint64_t steps = whole.n >> 23;
    for (uint64_t n = 1; n <= steps; n++)
        for (size_t e = 0; e < sizeof errors / sizeof *errors; e++) {
            const struct fault f = {.kind = FAULTS_sync_range, .nth = n, .error = errors[e]};
            faults_clean(false);
            faults_run(huge_raw, &f, &o);
            if (o.report.delivered == 0 || faults_left() != NULL || o.code != (e < 2 ? 1 : 0) ||
                (e < 2 ? !faults_is_absent() || faults_lines(o.err) != 1 : !is(&whole)))
                faults_problem("a write that fails on its way to the disk", huge_raw, &f, &o);
        }
}

/* ---- all --------------------------------------------------------------------------------------- */

int main(int argc, char **argv)
{
    if (argc < 5) {
        fputs("usage: faults_stops BUILD FOLDER fast|full SEED\n", stderr);
        return 2;
    }
    const bool full = strcmp(argv[3], "full") == 0;
    faults_begin(argv[1], argv[2]);
    srand48(strtol(argv[4], NULL, 10));
    const struct bytes of[2] = {made_by(small, false), made_by(raw, false)};
    kill_at_calls(full, &of[0]);
    for (size_t i = 0; i < sizeof meetings / sizeof *meetings; i++)
        meet(&meetings[i], of);
    race(full ? 200 : 6, false, of);
    race(full ? 200 : 6, true, of);
    double seconds = faults_now();
    const struct bytes whole = made_by(large, false);
    seconds = faults_now() - seconds;
    kill_at_random(full ? 200 : 5, false, &whole, seconds);
    kill_at_random(full ? 200 : 5, true, &whole, seconds);
    if (full)
        sync_on_the_way();
    seconds = faults_now();
    const struct bytes most = made_by(huge, false);
    seconds = faults_now() - seconds;
    const double soon = full ? 1 : 1 + seconds;     /* a busy machine is not what make check is to find */
    end_at_moments(full ? 100 : 5, false, &most, seconds, soon);
    end_at_moments(full ? 30 : 2, true, &most, seconds, soon);
    printf("seed %s, %d problems\n", argv[4], faults_problems());
    return faults_problems() > 0;
}
