/*
 * What a pass delivers is kept as a hash, so that nothing is allocated and passes can be compared.
 * Which order, what is broken off, and how little a read gives is decided by a hash of the bytes:
 * the same bytes do the same again.
 */
#include "fuzz_scan.h"

#include "fuzz.h"
#include "mutate.h"
#include "obj.h"
#include "off.h"
#include "ply.h"
#include "stl.h"

#include <assert.h>
#include <string.h>
#include <xxhash.h>

static struct spb_vertex_batch vertex_batch;        /* large: not for the stack */
static struct spb_face_batch face_batch;

struct pass {                       /* all that one pass did */
    enum spc_status status;
    uint64_t count, hash, faces_in, split_extra, faces_short;
};

static void hold_error(enum spc_status status, const struct spc_error *err)
{
    const char *const end = memchr(err->what, 0, sizeof err->what);
    assert(status == err->status && end != NULL);
    assert(status == SPC_OK || end > err->what);
    for (const char *p = err->what; p < end; p++)
        assert(*p >= ' ' && *p <= '~');
}

static void add_hash(struct pass *pass, const void *data, size_t size)
{
    pass->hash = XXH64(data, size, pass->hash);
}

/* Progress goes forward and ends inside the file. */
static void hold_done(const struct spb_source *source, uint64_t *done)
{
    const uint64_t now = spb_source_bytes_done(source);
    assert(now >= *done && now <= spb_source_info(source)->file_bytes);
    *done = now;
}

static struct pass vertex_pass(struct spb_source *source, unsigned batches_max)
{
    const struct spb_source_info *const info = spb_source_info(source);
    struct spb_vertex_batch *const b = &vertex_batch;
    struct spc_error err = {0};
    struct pass pass = { .status = spb_source_begin_vertices(source, &err) };
    uint64_t done = 0;

    for (; pass.status == SPC_OK && batches_max > 0; batches_max--) {
        pass.status = spb_source_vertices(source, b, &err);
        assert(b->count <= SPB_BATCH_MAX && (pass.status == SPC_OK || b->count == 0));
        hold_done(source, &done);
        if (b->count == 0)
            break;
        pass.count += b->count;
        for (size_t i = 0; i < b->count; i++) {     /* batches may be cut anywhere */
            add_hash(&pass, b->xyz[i], sizeof b->xyz[i]);
            if (info->colors)
                add_hash(&pass, b->rgba[i], sizeof b->rgba[i]);
            if (info->normals)
                add_hash(&pass, b->normal[i], sizeof b->normal[i]);
        }
    }
    hold_error(pass.status, &err);
    assert(pass.count <= info->vertex_count);
    if (pass.status == SPC_OK && batches_max > 0)
        assert(pass.count == info->vertex_count);
    return pass;
}

static struct pass face_pass(struct spb_source *source, unsigned batches_max)
{
    const struct spb_source_info *const info = spb_source_info(source);
    struct spb_face_batch *const b = &face_batch;
    struct spc_error err = {0};
    struct pass pass = { .status = spb_source_begin_faces(source, &err) };
    uint64_t done = 0;

    for (; pass.status == SPC_OK && batches_max > 0; batches_max--) {
        pass.status = spb_source_faces(source, b, &err);
        assert(b->count <= SPB_BATCH_MAX && (pass.status == SPC_OK || b->count == 0));
        hold_done(source, &done);
        if (pass.status != SPC_OK)
            break;
        pass.faces_in += b->faces_in;
        pass.split_extra += b->split_extra;
        pass.faces_short += b->faces_short;
        pass.count += b->count;
        for (size_t i = 0; i < b->count; i++)
            add_hash(&pass, b->corner[i], sizeof b->corner[i]);
        assert(info->strips || pass.faces_in <= info->face_count);
        if (b->count == 0)
            break;
    }
    hold_error(pass.status, &err);
    if (pass.status == SPC_OK && batches_max > 0) {
        assert(pass.faces_in + pass.split_extra == pass.count + pass.faces_short);
        assert(info->strips || pass.faces_in == info->face_count);
    }
    return pass;
}

static void hold_same(const struct pass *a, const struct pass *b)
{
    assert(a->status == b->status);
    if (a->status != SPC_OK)
        return;                     /* the batch with the fault may begin elsewhere */
    assert(a->count == b->count && a->hash == b->hash && a->faces_in == b->faces_in);
    assert(a->split_extra == b->split_extra && a->faces_short == b->faces_short);
}

static void hold_info(const struct spb_source_info *info, size_t size)
{
    assert(info->format != NULL && info->file_bytes == size);
    assert(info->salvage == NULL && !info->archive);
    /* Each takes a byte at least: what a file claims is not believed. */
    assert(info->vertex_count <= size && info->face_count <= size);
}

static struct spb_source *open_bytes(const struct spb_format *format, const uint8_t *bytes,
                                     size_t size, size_t step)
{
    struct spb_source *source = NULL;
    struct spc_error err = {0};
    const enum spc_status status = spb_source_open_memory(format, bytes, size, step, &source,
                                                          &err);
    hold_error(status, &err);
    assert((status == SPC_OK) == (source != NULL));
    if (source)
        hold_info(spb_source_info(source), size);
    return source;
}

enum { WHOLE = 1 << 30 };           /* as many batches as there are; or bytes a read */

/* The passes again, through reads of other sizes and in the other order. */
static void read_other_way(const struct spb_format *format, const uint8_t *bytes, size_t size,
                           size_t step, const struct pass *vertices, const struct pass *faces)
{
    struct spb_source *const source = open_bytes(format, bytes, size, step);
    assert(source != NULL);
    const struct pass f = face_pass(source, WHOLE);
    const struct pass v = vertex_pass(source, WHOLE);
    hold_same(&v, vertices);
    hold_same(&f, faces);
    spb_source_close(source);
}

int fuzz_scan(const struct spb_format *format, const uint8_t *bytes, size_t size)
{
    uint64_t random = XXH64(bytes, size, 0);
    const uint64_t how = mutate_random(&random);
    const size_t step = how & 1 ? WHOLE : 1 + how % 61;

    (void)format->sniff(bytes, size < 512 ? size : 512, size);
    struct spb_source *const source = open_bytes(format, bytes, size, step);
    if (!source)
        return 0;
    if (how & 2)
        vertex_pass(source, how & 4);
    if (how & 8)
        face_pass(source, how & 16);
    const struct pass v = vertex_pass(source, WHOLE);
    const struct pass f = face_pass(source, WHOLE);
    if (how & 32) {
        const struct pass again = face_pass(source, WHOLE);
        hold_same(&again, &f);
    }
    if (how & 64) {
        const struct pass again = vertex_pass(source, WHOLE);
        hold_same(&again, &v);
    }
    assert(memchr(spb_source_remark(source), 0, 1000) != NULL);
    spb_source_close(source);
    if ((how >> 7) % 4 == 0)
        read_other_way(format, bytes, size, step == WHOLE ? 1 + how % 17 : WHOLE, &v, &f);
    return 0;
}

int fuzz_ply(const uint8_t *bytes, size_t size)
{
    return fuzz_scan(&spb_ply_format, bytes, size);
}

int fuzz_stl(const uint8_t *bytes, size_t size)
{
    return fuzz_scan(&spb_stl_format, bytes, size);
}

int fuzz_off(const uint8_t *bytes, size_t size)
{
    return fuzz_scan(&spb_off_format, bytes, size);
}

int fuzz_obj(const uint8_t *bytes, size_t size)
{
    return fuzz_scan(&spb_obj_format, bytes, size);
}
