/*
 * inject.c - stands before libc and makes its calls fail; faults.h says how it is told.
 *
 * Allocations go to glibc's own names for them: dlsym allocates itself.
 */
#define _GNU_SOURCE
#include "faults.h"

#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <sys/syscall.h>
#include <unistd.h>

extern void *__libc_malloc(size_t bytes);
extern void *__libc_calloc(size_t count, size_t bytes);
extern void *__libc_realloc(void *old, size_t bytes);
extern void *__libc_memalign(size_t align, size_t bytes);

#define EXPORT __attribute__((visibility("default")))
#define ALSO(name, of) EXPORT extern __typeof__(of) name __attribute__((alias(#of)))

static struct {
    struct faults_report *report;
    int kind, error, signal;
    uint64_t nth;
    int divide;                     /* of reads and writes: 0 whole, 1 one byte, 2 half */
    bool interrupt, limited, no_tmpfile, no_threads, bus;
    atomic_llong space;
} told = {.kind = -1};

static _Thread_local bool spared;
static _Thread_local bool interrupted[FAULTS_KIND_COUNT];

static void deliver(void)
{
    __atomic_fetch_add(&told.report->delivered, 1, __ATOMIC_RELAXED);
}

/* Counts a call. True when it is to fail; errno is set. */
static bool fails(int kind)
{
    if (told.report == NULL || spared)
        return false;
    const uint64_t n = __atomic_add_fetch(&told.report->calls[kind], 1, __ATOMIC_RELAXED);
    if (kind != told.kind || n != told.nth)
        return false;
    deliver();
    if (told.signal != 0) {
        kill(getpid(), told.signal);
        return false;
    }
    errno = told.error;
    return true;
}

/* The same for a call that a signal may interrupt. */
static bool fails_or_stops(int kind)
{
    if (told.interrupt && !spared && !interrupted[kind]) {
        interrupted[kind] = true;
        deliver();
        errno = EINTR;
        return true;
    }
    interrupted[kind] = false;
    return fails(kind);
}

static size_t some_of(size_t n)
{
    return n < 2 || told.divide == 0 ? n : told.divide == 1 ? 1 : (n + 1) / 2;
}

/* How many of n bytes the disk takes; -1: none, errno is set. */
static ssize_t room_for(int fd, size_t n)
{
    long long left = atomic_load(&told.space), take;
    if (!told.limited || fd <= STDERR_FILENO || n == 0)
        return (ssize_t)n;
    do
        take = left < (long long)n ? left : (long long)n;
    while (!atomic_compare_exchange_weak(&told.space, &left, left - take));
    if (take == 0) {
        deliver();
        errno = ENOSPC;
        return -1;
    }
    return (ssize_t)take;
}

#define REAL(name) \
    static __typeof__(name) *real; \
    if (real == NULL) \
        real = (__typeof__(name) *)dlsym(RTLD_NEXT, #name)

/* ---- files ------------------------------------------------------------------------------------- */

static bool refused(int flags)
{
    if (!told.no_tmpfile || (flags & O_TMPFILE) != O_TMPFILE)
        return false;
    errno = EOPNOTSUPP;
    return true;
}

static mode_t mode_of(int flags, va_list args)
{
    return (flags & O_CREAT) || (flags & O_TMPFILE) == O_TMPFILE ? va_arg(args, mode_t) : 0;
}

EXPORT int openat(int dir, const char *path, int flags, ...)
{
    REAL(openat);
    va_list args;
    va_start(args, flags);
    const mode_t mode = mode_of(flags, args);
    va_end(args);
    if (refused(flags) || fails_or_stops(FAULTS_open))
        return -1;
    return real(dir, path, flags, mode);
}
ALSO(openat64, openat);

EXPORT int open(const char *path, int flags, ...)
{
    REAL(open);
    va_list args;
    va_start(args, flags);
    const mode_t mode = mode_of(flags, args);
    va_end(args);
    if (refused(flags) || fails_or_stops(FAULTS_open))
        return -1;
    return real(path, flags, mode);
}
ALSO(open64, open);

EXPORT int mkstemp(char *name)
{
    REAL(mkstemp);
    return fails(FAULTS_mkstemp) ? -1 : real(name);
}
ALSO(mkstemp64, mkstemp);

EXPORT int stat(const char *restrict path, struct stat *restrict out)
{
    REAL(stat);
    return fails(FAULTS_stat) ? -1 : real(path, out);
}

EXPORT int fstat(int fd, struct stat *out)
{
    REAL(fstat);
    return fails(FAULTS_stat) ? -1 : real(fd, out);
}

EXPORT int fstatat(int dir, const char *restrict path, struct stat *restrict out, int flags)
{
    REAL(fstatat);
    return fails(FAULTS_stat) ? -1 : real(dir, path, out, flags);
}

/* struct stat64 is struct stat here, but not to the compiler. */
EXPORT int stat64(const char *restrict path, struct stat64 *restrict out)
{
    return stat(path, (struct stat *)out);
}

EXPORT int fstat64(int fd, struct stat64 *out)
{
    return fstat(fd, (struct stat *)out);
}

EXPORT int fstatat64(int dir, const char *restrict path, struct stat64 *restrict out, int flags)
{
    return fstatat(dir, path, (struct stat *)out, flags);
}

/* Pipes and events are how the thread pool talks to itself. */
static bool is_file(int fd)
{
    struct stat st;
    return syscall(SYS_newfstatat, fd, "", &st, AT_EMPTY_PATH) == 0 && S_ISREG(st.st_mode);
}

EXPORT ssize_t read(int fd, void *bytes, size_t n)
{
    REAL(read);
    if (!is_file(fd))
        return real(fd, bytes, n);
    return fails_or_stops(FAULTS_read) ? -1 : real(fd, bytes, some_of(n));
}

EXPORT ssize_t pread(int fd, void *bytes, size_t n, off_t off)
{
    REAL(pread);
    return fails_or_stops(FAULTS_pread) ? -1 : real(fd, bytes, some_of(n), off);
}
ALSO(pread64, pread);

EXPORT ssize_t write(int fd, const void *bytes, size_t n)
{
    REAL(write);
    if (!is_file(fd))
        return real(fd, bytes, n);
    const ssize_t room = fails_or_stops(FAULTS_write) ? -1 : room_for(fd, some_of(n));
    return room < 0 ? -1 : real(fd, bytes, (size_t)room);
}

EXPORT ssize_t pwrite(int fd, const void *bytes, size_t n, off_t off)
{
    REAL(pwrite);
    const ssize_t room = fails_or_stops(FAULTS_pwrite) ? -1 : room_for(fd, some_of(n));
    return room < 0 ? -1 : real(fd, bytes, (size_t)room, off);
}
ALSO(pwrite64, pwrite);

/* A short write is a legal one: of the first part. */
EXPORT ssize_t pwritev(int fd, const struct iovec *parts, int count, off_t off)
{
    return count > 0 ? pwrite(fd, parts[0].iov_base, parts[0].iov_len, off) : 0;
}
ALSO(pwritev64, pwritev);

EXPORT int fsync(int fd)
{
    REAL(fsync);
    return fails_or_stops(FAULTS_fsync) ? -1 : real(fd);
}

EXPORT int fdatasync(int fd)
{
    REAL(fdatasync);
    return fails_or_stops(FAULTS_fsync) ? -1 : real(fd);
}

EXPORT int sync_file_range(int fd, off64_t off, off64_t bytes, unsigned flags)
{
    REAL(sync_file_range);
    return fails_or_stops(FAULTS_sync_range) ? -1 : real(fd, off, bytes, flags);
}

EXPORT int ftruncate(int fd, off_t bytes)
{
    REAL(ftruncate);
    return fails_or_stops(FAULTS_ftruncate) ? -1 : real(fd, bytes);
}
ALSO(ftruncate64, ftruncate);

EXPORT int fallocate(int fd, int mode, off_t off, off_t bytes)
{
    REAL(fallocate);
    return fails_or_stops(FAULTS_fallocate) ? -1 : real(fd, mode, off, bytes);
}
ALSO(fallocate64, fallocate);

EXPORT int posix_fallocate(int fd, off_t off, off_t bytes)
{
    REAL(posix_fallocate);
    return fails_or_stops(FAULTS_fallocate) ? errno : real(fd, off, bytes);
}
ALSO(posix_fallocate64, posix_fallocate);

/* ---- names and locks --------------------------------------------------------------------------- */

EXPORT int rename(const char *from, const char *to)
{
    REAL(rename);
    return fails(FAULTS_rename) ? -1 : real(from, to);
}

EXPORT int renameat(int from_dir, const char *from, int to_dir, const char *to)
{
    REAL(renameat);
    return fails(FAULTS_rename) ? -1 : real(from_dir, from, to_dir, to);
}

EXPORT int renameat2(int from_dir, const char *from, int to_dir, const char *to, unsigned flags)
{
    REAL(renameat2);
    return fails(FAULTS_rename) ? -1 : real(from_dir, from, to_dir, to, flags);
}

EXPORT int link(const char *from, const char *to)
{
    REAL(link);
    return fails(FAULTS_link) ? -1 : real(from, to);
}

EXPORT int linkat(int from_dir, const char *from, int to_dir, const char *to, int flags)
{
    REAL(linkat);
    return fails(FAULTS_link) ? -1 : real(from_dir, from, to_dir, to, flags);
}

EXPORT int unlink(const char *path)
{
    REAL(unlink);
    return fails(FAULTS_unlink) ? -1 : real(path);
}

EXPORT int unlinkat(int dir, const char *path, int flags)
{
    REAL(unlinkat);
    return fails(FAULTS_unlink) ? -1 : real(dir, path, flags);
}

EXPORT int flock(int fd, int operation)
{
    REAL(flock);
    return fails_or_stops(FAULTS_flock) ? -1 : real(fd, operation);
}

EXPORT int fcntl(int fd, int command, ...)
{
    REAL(fcntl);
    va_list args;
    va_start(args, command);
    void *arg = va_arg(args, void *);
    va_end(args);
    if ((command == F_SETLK || command == F_SETLKW || command == F_OFD_SETLK) && fails_or_stops(FAULTS_fcntl))
        return -1;
    return real(fd, command, arg);
}
ALSO(fcntl64, fcntl);

/* ---- memory and threads ------------------------------------------------------------------------ */

/* The first half of the file; reading behind it raises SIGBUS. */
static int half_of(int fd)
{
    struct stat st;
    const int half = memfd_create("half", MFD_CLOEXEC);
    char page[4096];
    if (half < 0 || fstat(fd, &st) != 0)
        return -1;
    for (off_t at = 0; at < st.st_size / 2; at += (off_t)sizeof page)
        if (pread(fd, page, sizeof page, at) <= 0 || pwrite(half, page, sizeof page, at) < 0)
            return -1;
    return half;
}

EXPORT void *mmap(void *at, size_t bytes, int prot, int flags, int fd, off_t off)
{
    REAL(mmap);
    if (fails(FAULTS_mmap))
        return MAP_FAILED;
    if (!told.bus || fd < 0)
        return real(at, bytes, prot, flags, fd, off);
    const int half = half_of(fd);
    void *map = real(at, bytes, prot, flags, half, off);
    close(half);
    deliver();
    return map;
}
ALSO(mmap64, mmap);

EXPORT int pthread_create(pthread_t *restrict thread, const pthread_attr_t *restrict attr,
                          void *(*run)(void *), void *restrict arg)
{
    REAL(pthread_create);
    if (told.no_threads)
        deliver();
    return told.no_threads ? EAGAIN : fails(FAULTS_thread) ? errno : real(thread, attr, run, arg);
}

/* libuv ends the process when it cannot start: that cannot be mended, and is not tried. */
int uv_loop_init(void *loop);
EXPORT int uv_loop_init(void *loop)
{
    REAL(uv_loop_init);
    spared = true;
    const int result = real(loop);
    spared = false;
    return result;
}

EXPORT void *malloc(size_t bytes)
{
    return fails(FAULTS_malloc) ? NULL : __libc_malloc(bytes);
}

EXPORT void *calloc(size_t count, size_t bytes)
{
    return fails(FAULTS_malloc) ? NULL : __libc_calloc(count, bytes);
}

EXPORT void *realloc(void *old, size_t bytes)
{
    return fails(FAULTS_malloc) ? NULL : __libc_realloc(old, bytes);
}

EXPORT void *aligned_alloc(size_t align, size_t bytes)
{
    return fails(FAULTS_malloc) ? NULL : __libc_memalign(align, bytes);
}

EXPORT int posix_memalign(void **out, size_t align, size_t bytes)
{
    void *p = fails(FAULTS_malloc) ? NULL : __libc_memalign(align, bytes);
    if (p == NULL)
        return ENOMEM;
    *out = p;
    return 0;
}

/* glibc's own copies of these would do: they call the malloc above. Named, so that one sees it. */
EXPORT char *strndup(const char *text, size_t most)
{
    const size_t n = strnlen(text, most);
    char *copy = malloc(n + 1);
    if (copy == NULL)
        return NULL;
    copy[n] = '\0';
    return memcpy(copy, text, n);
}

EXPORT char *strdup(const char *text)
{
    return strndup(text, strlen(text));
}

/* ---- what we are told -------------------------------------------------------------------------- */

static uint64_t number(const char *name)
{
    const char *text = getenv(name);
    return text ? strtoull(text, NULL, 10) : 0;
}

static int kind_named(const char *name)
{
    static const char *const names[] = {
#define X(kind) #kind,
        FAULTS_KINDS(X)
#undef X
    };
    for (int k = 0; name != NULL && k < FAULTS_KIND_COUNT; k++)
        if (strcmp(name, names[k]) == 0)
            return k;
    return -1;
}

__attribute__((constructor)) static void begin(void)
{
    const char *path = getenv("FAULTS_REPORT"), *part = getenv("FAULTS_SHORT");
    const int fd = path ? open(path, O_RDWR | O_CLOEXEC) : -1;
    if (fd < 0)
        return;
    void *map = mmap(NULL, sizeof *told.report, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    close(fd);
    if (map == MAP_FAILED)
        return;
    told.kind = kind_named(getenv("FAULTS_KIND"));
    told.nth = number("FAULTS_NTH");
    told.error = (int)number("FAULTS_ERRNO");
    told.signal = (int)number("FAULTS_SIGNAL");
    told.divide = part == NULL ? 0 : strcmp(part, "half") == 0 ? 2 : 1;
    told.interrupt = number("FAULTS_EINTR") != 0;
    told.limited = getenv("FAULTS_SPACE") != NULL;
    atomic_store(&told.space, (long long)number("FAULTS_SPACE"));
    told.no_tmpfile = number("FAULTS_NO_TMPFILE") != 0;
    told.no_threads = number("FAULTS_NO_THREADS") != 0;
    told.bus = number("FAULTS_BUS") != 0;
    told.report = map;
}
