/*
 * The dispatcher: opens the file, asks each format in turn whether it knows the first bytes, and
 * forwards. The name of a file decides nothing: scans are renamed more often than converted. A new
 * format is one file and one line in formats[]; those with a firm mark come first, those that can
 * only guess last.
 */
#include "source.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "obj.h"
#include "off.h"
#include "ply.h"
#include "source_int.h"
#include "spc_source.h"
#include "stl.h"

enum { SNIFF_BYTES = 512 };

static const struct spb_format *const formats[] = {
    &spb_ply_format,
    &spb_spc_format,
    &spb_stl_format,
    &spb_off_format,
    &spb_obj_format,
};

enum { FORMAT_COUNT = sizeof formats / sizeof *formats };

struct spb_source {
    const struct spb_format *format;
    void *state;
    struct spb_bytes bytes;
    struct spb_source_info info;
};

/* What else people hand over in place of a scan: say so, and what to do. */
static const struct {
    const char *mark;
    size_t mark_bytes;
    const char *what;
} strangers[] = {
    { "\x1f\x8b", 2, "compressed with gzip: unpack it first" },
    { "PK\x03\x04", 4, "a zip file: unpack it first" },
    { "BZh", 3, "compressed with bzip2: unpack it first" },
    { "\xfd" "7zXZ", 5, "compressed with xz: unpack it first" },
    { "\x28\xb5\x2f\xfd", 4, "compressed with zstd: unpack it first" },
    { "version https://git-lfs", 23, "a Git LFS pointer, not the scan: run 'git lfs pull'" },
};

static enum spc_status fail_unknown(const struct spb_bytes *bytes, struct spc_error *err)
{
    char names[96] = "";

    if (bytes->file_bytes == 0)
        return spc_fail(err, SPC_INPUT_FORMAT, 0, "the file is empty");
    for (size_t i = 0; i < sizeof strangers / sizeof *strangers; i++) {
        if (spb_bytes_have(bytes) >= strangers[i].mark_bytes &&
            memcmp(bytes->buf, strangers[i].mark, strangers[i].mark_bytes) == 0)
            return spc_fail(err, SPC_INPUT_FORMAT, 0, "the file is %s", strangers[i].what);
    }
    for (size_t i = 0; i < FORMAT_COUNT; i++) {
        if (i > 0)
            strncat(names, ", ", sizeof names - strlen(names) - 1);
        strncat(names, formats[i]->name, sizeof names - strlen(names) - 1);
    }
    return spc_fail(err, SPC_INPUT_FORMAT, 0, "not a scan in a known format (%s)", names);
}

static enum spc_status find_format(struct spb_source *source, struct spc_error *err)
{
    struct spb_bytes *const bytes = &source->bytes;
    const enum spc_status status = spb_bytes_need(bytes, SNIFF_BYTES, err);

    if (status != SPC_OK)
        return status;
    for (size_t i = 0; i < FORMAT_COUNT && !source->format; i++) {
        const size_t have = spb_bytes_have(bytes);
        if (formats[i]->sniff(bytes->buf, have < SNIFF_BYTES ? have : SNIFF_BYTES,
                              bytes->file_bytes))
            source->format = formats[i];
    }
    return source->format ? SPC_OK : fail_unknown(bytes, err);
}

/* What stands behind a source: a file, damaged perhaps, or bytes of a known format. */
struct origin {
    const char *path;
    bool salvage;
    const void *memory;
    size_t size, step;
    const struct spb_format *format;    /* of memory */
};

static enum spc_status open_origin(struct spb_source *source, const struct origin *from,
                                   const struct spb_source_options *options, struct spc_error *err)
{
    struct spb_bytes *const bytes = &source->bytes;
    enum spc_status status = SPC_OK;

    if (from->memory)
        spb_bytes_open_memory(bytes, from->memory, from->size, from->step);
    else
        status = spb_bytes_open(bytes, from->path, options->temp, options->progress, err);
    source->info.file_bytes = bytes->file_bytes;
    source->format = from->salvage ? &spb_spc_format : from->format;
    if (status == SPC_OK && from->salvage)
        return spb_spc_salvage(bytes, options, &source->info, &source->state, err);
    if (status == SPC_OK && !source->format)
        status = find_format(source, err);
    if (status != SPC_OK)
        return status;
    return source->format->open(bytes, options, &source->info, &source->state, err);
}

static enum spc_status open_source(const struct origin *from,
                                   const struct spb_source_options *options,
                                   struct spb_source **out, struct spc_error *err)
{
    struct spb_source_options given = {.path = NULL};
    struct spb_source *source = calloc(1, sizeof *source);

    *out = NULL;
    if (!source)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a scan reader");
    if (options)
        given = *options;
    given.path = from->path;
    const enum spc_status status = open_origin(source, from, &given, err);
    if (status == SPC_OK)
        *out = source;
    else
        spb_source_close(source);
    return status;
}

enum spc_status spb_source_open(const char *path, const struct spb_source_options *options,
                                struct spb_source **out, struct spc_error *err)
{
    return open_source(&(struct origin){ .path = path }, options, out, err);
}

enum spc_status spb_source_salvage(const char *path, const struct spb_source_options *options,
                                   struct spb_source **out, struct spc_error *err)
{
    return open_source(&(struct origin){ .path = path, .salvage = true }, options, out, err);
}

enum spc_status spb_source_open_memory(const struct spb_format *format, const void *memory,
                                       size_t size, size_t step, struct spb_source **out,
                                       struct spc_error *err)
{
    const struct origin from = { .memory = memory, .size = size, .step = step, .format = format };

    return open_source(&from, NULL, out, err);
}

void spb_source_close(struct spb_source *source)
{
    if (!source)
        return;
    if (source->state)
        source->format->close(source->state);
    spb_bytes_close(&source->bytes);
    free(source);
}

enum spc_status spb_source_wrap(const struct spb_format *format, void *state,
                                const struct spb_source_info *info, struct spb_source **out,
                                struct spc_error *err)
{
    *out = malloc(sizeof **out);
    if (*out == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a scan reader");
    **out = (struct spb_source){.format = format, .state = state, .bytes = {.fd = -1}, .info = *info};
    return SPC_OK;
}

void *spb_source_state(const struct spb_source *source, const struct spb_format *format)
{
    return source->format == format ? source->state : NULL;
}

bool spb_source_is_file(const struct spb_source *source, const struct stat *file)
{
    struct stat own;
    return fstat(source->bytes.fd, &own) == 0 && own.st_dev == file->st_dev &&
           own.st_ino == file->st_ino;
}

void spb_source_pause(struct spb_source *source)
{
    if (source->bytes.fd >= 0)
        spb_bytes_pause(&source->bytes);
    if (source->format->pause)
        source->format->pause(source->state);
}

const struct spb_source_info *spb_source_info(const struct spb_source *source)
{
    return &source->info;
}

enum spc_status spb_source_begin_vertices(struct spb_source *source, struct spc_error *err)
{
    return source->format->begin_vertices(source->state, err);
}

enum spc_status spb_source_begin_faces(struct spb_source *source, struct spc_error *err)
{
    return source->format->begin_faces(source->state, err);
}

/* A failed call leaves an empty batch: nobody can take half of one for the whole. */

enum spc_status spb_source_vertices(struct spb_source *source, struct spb_vertex_batch *out,
                                    struct spc_error *err)
{
    const enum spc_status status = source->format->vertices(source->state, out, err);
    assert(out->count <= SPB_BATCH_MAX);
    if (status != SPC_OK)
        out->count = 0;
    return status;
}

enum spc_status spb_source_faces(struct spb_source *source, struct spb_face_batch *out,
                                 struct spc_error *err)
{
    out->colored = false;
    const enum spc_status status = source->format->faces(source->state, out, err);
    assert(out->count <= SPB_BATCH_MAX);
    if (status != SPC_OK)
        out->count = 0;
    return status;
}

uint64_t spb_source_bytes_done(const struct spb_source *source)
{
    return source->format->bytes_done(source->state);
}

const char *spb_source_remark(const struct spb_source *source)
{
    return source->format->remark(source->state);
}
