/*
 * faults.h - what inject.c, a library that LD_PRELOAD puts before libc, and those who use it agree on.
 *
 * The library is told by the environment, all of it optional:
 *
 *   FAULTS_REPORT=FILE      a file of sizeof(struct faults_report) bytes: mapped and filled as calls
 *                           come, so that it is right however the process ends
 *   FAULTS_KIND=NAME        with FAULTS_NTH=N, one of:
 *     FAULTS_ERRNO=E          the Nth call of this kind fails
 *     FAULTS_SIGNAL=S         before the Nth call of this kind the process gets a signal
 *   FAULTS_SHORT=1|half     reads and writes move one byte, or half of what they are asked for
 *   FAULTS_EINTR=1          every call that may be interrupted is, the first time
 *   FAULTS_SPACE=N          a disk of N bytes: what is written beyond them fails with ENOSPC
 *   FAULTS_NO_TMPFILE=1     a file system without O_TMPFILE
 *   FAULTS_NO_THREADS=1     no thread can be started
 *   FAULTS_BUS=1            files that are mapped have an unreadable second half
 */
#ifndef FAULTS_H
#define FAULTS_H

#include <stdint.h>

#define FAULTS_KINDS(X)                                                                            \
    X(open) X(mkstemp) X(stat) X(read) X(pread) X(write) X(pwrite) X(fsync) X(ftruncate) X(fallocate) \
    X(sync_range) X(rename) X(link) X(unlink) X(flock) X(fcntl) X(mmap) X(thread) X(malloc)

enum faults_kind {
#define X(name) FAULTS_##name,
    FAULTS_KINDS(X)
#undef X
    FAULTS_KIND_COUNT
};

struct faults_report {
    uint64_t calls[FAULTS_KIND_COUNT];
    uint64_t delivered;             /* faults that took place */
};

#endif
