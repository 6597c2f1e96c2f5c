/*
 * bench.h - what the measuring programs share: CPU time, archives that must open, one block.
 *
 * Time is that of the thread on a processor: other programs slow it down (caches, clocks), but do
 * not count. Programs interleave what they compare and report medians.
 */
#ifndef BENCH_H
#define BENCH_H

#include "spc.h"

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static inline double bench_cpu(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

static inline int bench_compare(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static inline double bench_median(double *values, size_t count)
{
    qsort(values, count, sizeof *values, bench_compare);
    return (values[(count - 1) / 2] + values[count / 2]) / 2;
}

static inline void bench_must(enum spc_status status, const char *file, const struct spc_error *err)
{
    if (status == SPC_OK)
        return;
    fprintf(stderr, "%s: %s: %s\n", file, spc_status_text(status), err->what);
    exit(1);
}

static inline void *bench_memory(size_t bytes)
{
    void *p = aligned_alloc(64, (bytes + 64) / 64 * 64);
    if (p == NULL) {
        fprintf(stderr, "no memory for %zu bytes\n", bytes);
        exit(1);
    }
    return p;
}

struct bench_archive {
    const char *path;
    struct spc_reader *reader;
    const struct spc_header *header;
    uint8_t *payload;               /* room for any block */
    uint64_t decoded_bytes;         /* of all blocks */
};

static inline struct bench_archive bench_open(const char *path)
{
    struct bench_archive a = {.path = path};
    struct spc_error err = {0};
    size_t largest = 0;
    bench_must(spc_reader_open(path, &a.reader, &err), path, &err);
    a.header = spc_reader_header(a.reader);
    for (uint32_t i = 0; i < a.header->block_count; i++) {
        struct spc_block b;
        spc_reader_block(a.reader, i, &b);
        a.decoded_bytes += b.raw_bytes;
        largest = b.raw_bytes > largest ? b.raw_bytes : largest;
    }
    a.payload = bench_memory(largest);
    return a;
}

static inline void bench_close(struct bench_archive *a)
{
    spc_reader_close(a->reader);
    free(a->payload);
}

static inline void bench_decode(const struct bench_archive *a, uint32_t index, bool check)
{
    struct spc_error err = {0};
    bench_must(spc_block_decode(a->reader, index, check, a->payload, &err), a->path, &err);
}

/* CPU seconds of decoding all blocks, each pass at least SPAN long. */
static inline double bench_decode_all(const struct bench_archive *a, bool check)
{
    static const double SPAN = 0.05;
    const double began = bench_cpu();
    double spent = 0;
    int passes = 0;
    while (spent < SPAN) {
        for (uint32_t i = 0; i < a->header->block_count; i++)
            bench_decode(a, i, check);
        passes++;
        spent = bench_cpu() - began;
    }
    return spent / passes;
}

#endif
