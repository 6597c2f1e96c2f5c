/*
 * bandwidth FOLDER [MIB]: what this machine moves a second, to compare a build with. Prints JSON.
 *
 * memory: copying between two arrays far larger than the caches, bytes read plus bytes written, on
 * all cores at once. disk: a file of MIB (1024) written in long pieces and synced, then read back
 * with nothing of it in the page cache. Bytes a second.
 */
#define _GNU_SOURCE
#include <fcntl.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { PIECE = 1 << 20, COPY_BYTES = 128 << 20, COPIES = 8, THREADS_MAX = 256 };

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

static void fail(const char *what)
{
    perror(what);
    exit(1);
}

static void *copy(void *arg)
{
    uint8_t *from = malloc(COPY_BYTES), *to = malloc(COPY_BYTES);
    pthread_barrier_t *barrier = arg;
    if (from == NULL || to == NULL)
        fail("malloc");
    memset(from, 1, COPY_BYTES);
    memset(to, 2, COPY_BYTES);
    pthread_barrier_wait(barrier);
    for (int i = 0; i < COPIES; i++) {
        from[i] = (uint8_t)i;
        memcpy(to, from, COPY_BYTES);
        from[i] = to[i + 1];
    }
    pthread_barrier_wait(barrier);
    free(from);
    free(to);
    return NULL;
}

static double copy_rate(long threads)
{
    pthread_t ids[THREADS_MAX];
    pthread_barrier_t barrier;
    pthread_barrier_init(&barrier, NULL, (unsigned)threads + 1);
    for (long t = 0; t < threads; t++)
        if (pthread_create(&ids[t], NULL, copy, &barrier) != 0)
            fail("pthread_create");
    pthread_barrier_wait(&barrier);
    const double began = now();
    pthread_barrier_wait(&barrier);
    const double took = now() - began;
    for (long t = 0; t < threads; t++)
        pthread_join(ids[t], NULL);
    return 2.0 * COPY_BYTES * COPIES * (double)threads / took;
}

static int open_unnamed(const char *folder)
{
    char *name = malloc(strlen(folder) + 32);
    sprintf(name, "%s/bandwidth.XXXXXX", folder);
    const int fd = mkstemp(name);
    if (fd < 0)
        fail(name);
    unlink(name);
    free(name);
    return fd;
}

/* Bytes a second; forgets the pages, so that the next one goes to the disk as well. */
static double move_file(int fd, uint8_t *piece, long mib, bool writing)
{
    const double began = now();
    for (long i = 0; i < mib; i++) {
        const off_t off = (off_t)i * PIECE;
        const ssize_t n = writing ? pwrite(fd, piece, PIECE, off) : pread(fd, piece, PIECE, off);
        if (n != PIECE)
            fail(writing ? "write" : "read");
    }
    if (writing && fdatasync(fd) != 0)
        fail("fdatasync");
    const double took = now() - began;
    posix_fadvise(fd, 0, 0, POSIX_FADV_DONTNEED);
    return (double)mib * PIECE / took;
}

int main(int argc, char **argv)
{
    const long mib = argc > 2 ? atol(argv[2]) : 1024;
    long cores = sysconf(_SC_NPROCESSORS_ONLN);
    if (argc < 2 || mib < 1) {
        fprintf(stderr, "usage: bandwidth FOLDER [MIB]\n");
        return 2;
    }
    cores = cores > THREADS_MAX ? THREADS_MAX : cores;
    uint8_t *piece = malloc(PIECE);
    if (piece == NULL)
        fail("malloc");
    uint64_t noise = 88172645463325252u;            /* a disk that compresses must not notice */
    for (size_t i = 0; i < PIECE; i++) {
        noise ^= noise << 13;
        noise ^= noise >> 7;
        noise ^= noise << 17;
        piece[i] = (uint8_t)noise;
    }
    const int fd = open_unnamed(argv[1]);
    const double written = move_file(fd, piece, mib, true);
    const double read = move_file(fd, piece, mib, false);
    close(fd);
    free(piece);
    printf("{\"cores\": %ld, \"copy_1\": %.4g, \"copy_all\": %.4g, \"disk_write\": %.4g, \"disk_read\": %.4g}\n",
           cores, copy_rate(1), copy_rate(cores), written, read);
    return 0;
}
