#define _GNU_SOURCE
#include "faults_run.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static const char OLD[] = "the target that was here before\n";
static char build_folder[4096];
static int problems;

double faults_now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

static void die(const char *what)
{
    fprintf(stderr, "%s: %s\n", what, strerror(errno));
    exit(2);
}

void faults_begin(const char *build, const char *folder)
{
    if (realpath(build, build_folder) == NULL)
        die(build);
    if (chdir(folder) != 0)
        die(folder);
    if ((mkdir("out", 0777) != 0 && errno != EEXIST) || (mkdir("temp", 0777) != 0 && errno != EEXIST))
        die("mkdir");
    setvbuf(stdout, NULL, _IOLBF, 0);
}

/* ---- processes --------------------------------------------------------------------------------- */

static int memory_file(size_t bytes)
{
    const int fd = memfd_create("faults", 0);
    if (fd < 0 || ftruncate(fd, (off_t)bytes) != 0)
        die("memfd_create");
    return fd;
}

static void set_number(const char *name, uint64_t value)
{
    char text[32];
    snprintf(text, sizeof text, "%llu", (unsigned long long)value);
    setenv(name, text, 1);
}

static void set_environment(const struct fault *fault, int report_fd)
{
    char path[sizeof build_folder + 64];
    snprintf(path, sizeof path, "/proc/self/fd/%d", report_fd);
    setenv("FAULTS_REPORT", path, 1);
    if (fault->kind >= 0) {
        setenv("FAULTS_KIND", faults_kind_name(fault->kind), 1);
        set_number("FAULTS_NTH", fault->nth);
        set_number("FAULTS_ERRNO", (uint64_t)fault->error);
        set_number("FAULTS_SIGNAL", (uint64_t)fault->signal);
    }
    if (fault->no_tmpfile)
        setenv("FAULTS_NO_TMPFILE", "1", 1);
    if (fault->more != NULL) {
        char name[64];
        const size_t n = strcspn(fault->more, "=");
        snprintf(name, sizeof name, "%.*s", (int)n, fault->more);
        setenv(name, fault->more + n + 1, 1);
    }
    snprintf(path, sizeof path, "%s/tests/faults_inject.so", build_folder);
    setenv("LD_PRELOAD", path, 1);
}

struct process faults_start(const char *const *argv, const struct fault *fault)
{
    static const struct fault none = {.kind = -1};
    char path[sizeof build_folder + 64];
    struct process p = {.out_fd = memory_file(0), .err_fd = memory_file(0),
                        .report_fd = memory_file(sizeof(struct faults_report)), .began = faults_now()};
    snprintf(path, sizeof path, "%s/%s", build_folder, argv[0]);
    fflush(NULL);
    p.pid = fork();
    if (p.pid < 0)
        die("fork");
    if (p.pid > 0)
        return p;
    dup2(p.out_fd, STDOUT_FILENO);
    dup2(p.err_fd, STDERR_FILENO);
    signal(SIGINT, SIG_DFL);        /* a shell's background job has it ignored */
    set_environment(fault ? fault : &none, p.report_fd);
    execv(path, (char *const *)argv);
    _exit(127);
}

static void read_text(int fd, char text[FAULTS_TEXT])
{
    const ssize_t n = pread(fd, text, FAULTS_TEXT - 1, 0);
    text[n > 0 ? n : 0] = '\0';
    close(fd);
}

/* The process changes state, or time is up. */
static bool wait_until(pid_t pid, int options, double deadline, int *status)
{
    for (long pause_ns = 50000;;) {
        const pid_t got = waitpid(pid, status, options | WNOHANG);
        if (got == pid)
            return true;
        if (got < 0 && errno != EINTR)
            die("waitpid");
        if (faults_now() > deadline)
            return false;
        nanosleep(&(struct timespec){.tv_nsec = pause_ns}, NULL);
        if (pause_ns < 1000000)
            pause_ns += pause_ns / 4;
    }
}

void faults_wait(struct process *p, double seconds, struct outcome *out)
{
    int status = 0;
    const bool ended = wait_until(p->pid, 0, faults_now() + seconds, &status);
    if (!ended) {
        kill(p->pid, SIGKILL);
        waitpid(p->pid, &status, 0);
    }
    out->seconds = faults_now() - p->began;
    out->code = !ended ? FAULTS_TIMED_OUT
                : WIFEXITED(status) ? WEXITSTATUS(status) : FAULTS_SIGNALLED + WTERMSIG(status);
    read_text(p->out_fd, out->out);
    read_text(p->err_fd, out->err);
    if (pread(p->report_fd, &out->report, sizeof out->report, 0) != sizeof out->report)
        die("report");
    close(p->report_fd);
}

void faults_run(const char *const *argv, const struct fault *fault, struct outcome *out)
{
    struct process p = faults_start(argv, fault);
    faults_wait(&p, 20, out);
}

bool faults_stopped(const struct process *p, double seconds)
{
    siginfo_t info = {0};
    const double deadline = faults_now() + seconds;
    while (faults_now() < deadline) {
        info.si_pid = 0;
        if (waitid(P_PID, (id_t)p->pid, &info, WSTOPPED | WEXITED | WNOWAIT | WNOHANG) == 0 &&
            info.si_pid == p->pid)
            return info.si_code == CLD_STOPPED;
        nanosleep(&(struct timespec){.tv_nsec = 200000}, NULL);
    }
    return false;
}

/* ---- files ------------------------------------------------------------------------------------- */

static void empty(const char *folder)
{
    DIR *dir = opendir(folder);
    char path[512];
    if (dir == NULL)
        die(folder);
    for (const struct dirent *e; (e = readdir(dir)) != NULL;) {
        snprintf(path, sizeof path, "%s/%s", folder, e->d_name);
        if (strcmp(e->d_name, ".") != 0 && strcmp(e->d_name, "..") != 0 && unlink(path) != 0)
            die(path);
    }
    closedir(dir);
}

void faults_clean(bool old)
{
    empty("out");
    empty("temp");
    if (!old)
        return;
    FILE *f = fopen("out/t.spc", "w");
    if (f == NULL || fputs(OLD, f) < 0 || fclose(f) != 0)
        die("out/t.spc");
}

const char *faults_left(void)
{
    static const char *const folders[] = {"out", "temp"};
    static char path[512];
    for (int i = 0; i < 2; i++) {
        DIR *dir = opendir(folders[i]);
        bool found = false;
        if (dir == NULL)
            die(folders[i]);
        for (const struct dirent *e; !found && (e = readdir(dir)) != NULL;) {
            snprintf(path, sizeof path, "%s/%s", folders[i], e->d_name);
            found = strcmp(e->d_name, ".") != 0 && strcmp(e->d_name, "..") != 0 &&
                    strcmp(path, "out/t.spc") != 0;
        }
        closedir(dir);
        if (found)
            return path;
    }
    return NULL;
}

char *faults_bytes(const char *path, size_t *bytes)
{
    struct stat st;
    const int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        return NULL;
    if (fstat(fd, &st) != 0)
        die(path);
    char *all = malloc((size_t)st.st_size + 1);
    if (all == NULL || read(fd, all, (size_t)st.st_size) != st.st_size)
        die(path);
    close(fd);
    *bytes = (size_t)st.st_size;
    return all;
}

bool faults_same(const char *path, const char *bytes, size_t n)
{
    size_t have = 0;
    char *all = faults_bytes(path, &have);
    const bool same = all != NULL && have == n && memcmp(all, bytes, n) == 0;
    free(all);
    return same;
}

bool faults_is_old(void)
{
    return faults_same("out/t.spc", OLD, strlen(OLD));
}

bool faults_is_absent(void)
{
    return access("out/t.spc", F_OK) != 0;
}

/* ---- words ------------------------------------------------------------------------------------- */

const char *faults_kind_name(int kind)
{
    static const char *const names[] = {
#define X(name) #name,
        FAULTS_KINDS(X)
#undef X
    };
    return kind < 0 ? "none" : names[kind];
}

int faults_lines(const char *text)
{
    int n = 0;
    for (; *text; text++)
        n += *text == '\n';
    return n;
}

void faults_problem(const char *what, const char *const *argv, const struct fault *fault,
                    const struct outcome *o)
{
    problems++;
    printf("%s:", what);
    for (int i = 0; argv[i] != NULL; i++)
        printf(" %s", argv[i]);
    if (fault->kind >= 0)
        printf(" [%s %llu %s%s]", faults_kind_name(fault->kind), (unsigned long long)fault->nth,
               fault->signal ? "SIG" : "",
               fault->signal ? sigabbrev_np(fault->signal) : strerrorname_np(fault->error));
    printf("%s%s%s", fault->no_tmpfile ? " [no O_TMPFILE]" : "", fault->more ? " " : "",
           fault->more ? fault->more : "");
    printf("\n    code %d, %.2f s, stderr: %s%s", o->code, o->seconds, o->err,
           o->err[0] == '\0' || o->err[strlen(o->err) - 1] != '\n' ? "\n" : "");
}

int faults_problems(void)
{
    return problems;
}
