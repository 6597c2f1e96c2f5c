/*
 * faults_run.h - runs a tool in a folder of its own, with faults, and looks at what it leaves.
 *
 * The folder holds the inputs; below it out/ and temp/ are emptied before each run.
 */
#ifndef FAULTS_RUN_H
#define FAULTS_RUN_H

#include "faults.h"

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>

enum { FAULTS_ARGS = 24, FAULTS_TEXT = 8192, FAULTS_TIMED_OUT = 1000, FAULTS_SIGNALLED = 2000 };

struct fault {
    int kind;                       /* of enum faults_kind; -1: none */
    uint64_t nth;
    int error, signal;              /* one of them */
    const char *more;               /* "NAME=VALUE", or NULL */
    bool no_tmpfile;
};

struct outcome {
    int code;                       /* exit code; FAULTS_SIGNALLED + signal; FAULTS_TIMED_OUT */
    double seconds;
    char out[FAULTS_TEXT], err[FAULTS_TEXT];
    struct faults_report report;
};

struct process {
    pid_t pid;
    int out_fd, err_fd, report_fd;
    double began;
};

/* Folder of the build and of this run's files; goes there. Ends the program when it cannot. */
void faults_begin(const char *build, const char *folder);

/* Starts build/argv[0]; waits for its end, at most seconds; both. */
struct process faults_start(const char *const *argv, const struct fault *fault);
void faults_wait(struct process *p, double seconds, struct outcome *out);
void faults_run(const char *const *argv, const struct fault *fault, struct outcome *out);

/* True when the process has stopped itself (SIGSTOP); false when it ended first. */
bool faults_stopped(const struct process *p, double seconds);

/* out/ and temp/ are made empty. With old, out/t.spc holds some bytes that are no archive. */
void faults_clean(bool old);

/* A name below out/ or temp/ that is not out/t.spc, or NULL. Static storage. */
const char *faults_left(void);

/* Whole file, from malloc; NULL: there is none. */
char *faults_bytes(const char *path, size_t *bytes);
bool faults_same(const char *path, const char *bytes, size_t n);
bool faults_is_old(void);           /* out/t.spc as faults_clean left it */
bool faults_is_absent(void);

const char *faults_kind_name(int kind);
int faults_lines(const char *text);

/* Prints what is wrong and how to see it again; counted. */
void faults_problem(const char *what, const char *const *argv, const struct fault *fault,
                    const struct outcome *o);
int faults_problems(void);

double faults_now(void);

#endif
