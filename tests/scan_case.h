/*
 * scan_case.h - for tests of scan readers: builds files in memory, reads them through source.h.
 *
 * scan_start and scan_finish are check fixtures: a folder for the test's files, gone afterwards.
 * scan_read writes the bytes to a file of exactly that size and reads all of it, each pass twice
 * and in both orders (once with scan_once), and checks what holds for every file: batches in their
 * limits, I11, the second time as the first.
 */
#ifndef SCAN_CASE_H
#define SCAN_CASE_H

#include <check.h>
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "source.h"
#include "suite.h"

/* For loops: ck_assert writes to a pipe each time it passes. */
#define SCAN_CHECK(what)                    \
    do {                                    \
        if (!(what))                        \
            ck_abort_msg("%s", "no: " #what); \
    } while (0)

/* ---- files in memory ------------------------------------------------------------------------ */

struct file_text {
    uint8_t *data;
    size_t bytes, room;
    bool big;                           /* byte order of put_int and put_real */
};

static inline void put_bytes(struct file_text *f, const void *data, size_t bytes)
{
    if (f->room - f->bytes < bytes) {
        f->room = (f->room + bytes) * 2;
        f->data = realloc(f->data, f->room);
        SCAN_CHECK(f->data != NULL);
    }
    if (bytes > 0)
        memcpy(f->data + f->bytes, data, bytes);
    f->bytes += bytes;
}

static inline void put(struct file_text *f, const char *fmt, ...)
    __attribute__((format(printf, 2, 3)));

static inline void put(struct file_text *f, const char *fmt, ...)
{
    char text[2048];
    va_list args;

    va_start(args, fmt);
    const int length = vsnprintf(text, sizeof text, fmt, args);
    va_end(args);
    SCAN_CHECK(length >= 0 && (size_t)length < sizeof text);
    put_bytes(f, text, (size_t)length);
}

static inline void put_int(struct file_text *f, size_t bytes, int64_t value)
{
    uint8_t raw[8];
    for (size_t i = 0; i < bytes; i++)
        raw[f->big ? bytes - 1 - i : i] = (uint8_t)((uint64_t)value >> (8 * i));
    put_bytes(f, raw, bytes);
}

static inline void put_real(struct file_text *f, size_t bytes, double value)
{
    const float narrow = (float)value;
    uint32_t bits32;
    int64_t bits64;

    memcpy(&bits32, &narrow, sizeof bits32);
    memcpy(&bits64, &value, sizeof bits64);
    put_int(f, bytes, bytes == 4 ? (int64_t)bits32 : bits64);
}

/* ---- reading -------------------------------------------------------------------------------- */

static char scan_folder[256];
static char scan_path[300];
static bool scan_once;                              /* leave out the second reading */
static struct spb_vertex_batch scan_vertices;       /* large: not for the stack */
static struct spb_face_batch scan_faces;

static inline void scan_start(void)
{
    const char *const tmp = getenv("TMPDIR");
    snprintf(scan_folder, sizeof scan_folder, "%s/scan_XXXXXX", tmp && *tmp ? tmp : "/tmp");
    ck_assert_ptr_nonnull(mkdtemp(scan_folder));
    snprintf(scan_path, sizeof scan_path, "%s/file.scan", scan_folder);
}

static inline void scan_finish(void)
{
    unlink(scan_path);
    rmdir(scan_folder);
}

struct scan {
    enum spc_status status;             /* of the first step that failed */
    struct spc_error err;
    struct spb_source_info info;
    size_t vertex_count, triangle_count;
    double (*xyz)[3];
    uint8_t (*rgba)[4];
    uint64_t (*corner)[3];
    uint64_t faces_in, split_extra, faces_short;
    char remark[400];
};

static inline void scan_free(struct scan *s)
{
    free(s->xyz);
    free(s->rgba);
    free(s->corner);
    *s = (struct scan){ .status = SPC_OK };
}

/* Room for count more items of size bytes; check ends the test when there is none. */
static inline void *scan_grow(void *items, size_t used, size_t count, size_t bytes)
{
    void *const grown = realloc(items, (used + count + 1) * bytes);
    SCAN_CHECK(grown != NULL);
    return grown;
}

static inline enum spc_status scan_pass_vertices(struct spb_source *source, struct scan *s)
{
    struct spb_vertex_batch *const b = &scan_vertices;
    enum spc_status status = spb_source_begin_vertices(source, &s->err);

    s->vertex_count = 0;
    while (status == SPC_OK) {
        memset(b->rgba, 0x5a, sizeof b->rgba);
        status = spb_source_vertices(source, b, &s->err);
        SCAN_CHECK(b->count <= SPB_BATCH_MAX);
        if (status != SPC_OK || b->count == 0)
            break;
        s->xyz = scan_grow(s->xyz, s->vertex_count, b->count, sizeof *s->xyz);
        s->rgba = scan_grow(s->rgba, s->vertex_count, b->count, sizeof *s->rgba);
        memcpy(s->xyz + s->vertex_count, b->xyz, b->count * sizeof *s->xyz);
        memcpy(s->rgba + s->vertex_count, b->rgba, b->count * sizeof *s->rgba);
        s->vertex_count += b->count;
    }
    if (status == SPC_OK)
        ck_assert_uint_eq(s->vertex_count, s->info.vertex_count);
    return status;
}

static inline enum spc_status scan_pass_faces(struct spb_source *source, struct scan *s)
{
    struct spb_face_batch *const b = &scan_faces;
    enum spc_status status = spb_source_begin_faces(source, &s->err);

    s->triangle_count = 0;
    s->faces_in = s->split_extra = s->faces_short = 0;
    while (status == SPC_OK) {
        status = spb_source_faces(source, b, &s->err);
        SCAN_CHECK(b->count <= SPB_BATCH_MAX);
        if (status != SPC_OK)
            break;
        s->faces_in += b->faces_in;
        s->split_extra += b->split_extra;
        s->faces_short += b->faces_short;
        if (b->count == 0)
            break;
        s->corner = scan_grow(s->corner, s->triangle_count, b->count, sizeof *s->corner);
        memcpy(s->corner + s->triangle_count, b->corner, b->count * sizeof *s->corner);
        s->triangle_count += b->count;
        SCAN_CHECK(s->faces_in + s->split_extra == s->triangle_count + s->faces_short);
    }
    if (status == SPC_OK) {
        ck_assert_uint_eq(s->faces_in + s->split_extra, s->triangle_count + s->faces_short);
        if (!s->info.strips)
            ck_assert_uint_eq(s->faces_in, s->info.face_count);
    }
    return status;
}

static inline bool scan_same(const struct scan *a, const struct scan *b)
{
    return a->vertex_count == b->vertex_count && a->triangle_count == b->triangle_count &&
           (!a->xyz || memcmp(a->xyz, b->xyz, a->vertex_count * sizeof *a->xyz) == 0) &&
           (!a->xyz || !a->info.colors ||
            memcmp(a->rgba, b->rgba, a->vertex_count * sizeof *a->rgba) == 0) &&
           (!a->corner || memcmp(a->corner, b->corner, a->triangle_count * sizeof *a->corner) == 0);
}

static inline void scan_read_path(const char *path, struct scan *s)
{
    struct scan again = { .status = SPC_OK };
    struct spb_source *source = NULL;

    *s = (struct scan){ .status = SPC_OK };
    s->status = spb_source_open(path, NULL, &source, &s->err);
    if (s->status != SPC_OK) {
        ck_assert_ptr_null(source);
        ck_assert_int_eq(s->err.status, s->status);
        ck_assert_str_ne(s->err.what, "");
        return;
    }
    s->info = *spb_source_info(source);
    s->status = scan_pass_vertices(source, s);
    const enum spc_status face_status = scan_pass_faces(source, s);
    if (s->status == SPC_OK)
        s->status = face_status;
    snprintf(s->remark, sizeof s->remark, "%s", spb_source_remark(source));
    if (s->status == SPC_OK && !scan_once) {
        again.info = s->info;
        ck_assert_int_eq(scan_pass_faces(source, &again), SPC_OK);
        ck_assert_int_eq(scan_pass_vertices(source, &again), SPC_OK);
        ck_assert(scan_same(s, &again));
        ck_assert_str_eq(s->remark, spb_source_remark(source));
    } else if (s->status != SPC_OK) {
        ck_assert_int_eq(s->err.status, s->status);
        ck_assert_str_ne(s->err.what, "");
    }
    spb_source_close(source);
    scan_free(&again);
}

static inline void scan_write(const void *data, size_t bytes)
{
    FILE *const file = fopen(scan_path, "wb");
    ck_assert_ptr_nonnull(file);
    ck_assert_uint_eq(fwrite(data, 1, bytes, file), bytes);
    ck_assert_int_eq(fclose(file), 0);
}

static inline void scan_read_bytes(const void *data, size_t bytes, struct scan *s)
{
    scan_write(data, bytes);
    scan_read_path(scan_path, s);
}

/* Reads and frees what was built. */
static inline void scan_read(struct file_text *f, struct scan *s)
{
    scan_read_bytes(f->data, f->bytes, s);
    free(f->data);
    *f = (struct file_text){ .big = f->big };
}

/* The reading failed so, with a message that holds part. */
static inline void scan_expect_failure(const struct scan *s, enum spc_status status,
                                       const char *part)
{
    ck_assert_msg(s->status == status, "status %d, wanted %d (%s)", (int)s->status, (int)status,
                  s->err.what);
    ck_assert_msg(strstr(s->err.what, part) != NULL, "'%s' is not in '%s'", part, s->err.what);
}

static inline void scan_expect_ok(const struct scan *s)
{
    ck_assert_msg(s->status == SPC_OK, "%s", s->err.what);
}

static inline void scan_expect_triangle(const struct scan *s, size_t i, uint64_t a, uint64_t b,
                                        uint64_t c)
{
    SCAN_CHECK(i < s->triangle_count);
    if (s->corner[i][0] != a || s->corner[i][1] != b || s->corner[i][2] != c)
        ck_abort_msg("triangle %zu is %" PRIu64 " %" PRIu64 " %" PRIu64 ", wanted %" PRIu64 " %" PRIu64
                     " %" PRIu64, i, s->corner[i][0], s->corner[i][1], s->corner[i][2], a, b, c);
}

#endif
