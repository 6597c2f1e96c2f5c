/*
 * Which kind. A file of exactly 84 + 50 n bytes whose count says n is binary, even if it begins
 * with "solid", as many do. Otherwise what begins with "solid" (or "facet") and goes on as text is
 * text; and what has facets where a binary file has them, with normals of length 1 or 0, is a
 * binary file whose count is wrong.
 *
 * Wrong counts. If whole facets follow the header, they are what is read: programs that were
 * stopped, and some that run, leave a count that is not. If the last facet is cut short and the
 * count promises it, the file is refused; if the count is satisfied before, what follows is passed
 * over. Both are remarked.
 *
 * Corners are in the file three a facet, without numbers: vertices 3i, 3i + 1, 3i + 2, one and the
 * same where their places are (info.by_place). So the face pass reads nothing.
 */
#include "stl.h"

#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "stl_int.h"

/* ---- which kind ----------------------------------------------------------------------------- */

static float load_float(const uint8_t *p)
{
    const uint32_t bits = load_u32(p);
    float v;
    memcpy(&v, &bits, sizeof v);
    return v;
}

static bool count_fits(const uint8_t *head, size_t head_bytes, uint64_t file_bytes)
{
    if (head_bytes < STL_HEADER_BYTES)
        return false;
    return file_bytes - STL_HEADER_BYTES ==
           (uint64_t)load_u32(head + STL_NAME_BYTES) * STL_FACET_BYTES;
}

static bool is_word(const uint8_t *p, const uint8_t *end, const char *word)
{
    for (; *word; word++, p++)
        if (p == end || (*p | 32) != *word)
            return false;
    return p == end || spb_is_blank(*p);
}

static bool begins_as_text(const uint8_t *head, size_t head_bytes, uint64_t file_bytes)
{
    const uint8_t *const end = head + head_bytes, *p = head;
    bool control = false, keyword = false;

    if (head_bytes >= 3 && memcmp(head, "\xef\xbb\xbf", 3) == 0)
        p += 3;
    while (p < end && spb_is_blank(*p))
        p++;
    if (is_word(p, end, "facet"))
        return true;
    if (!is_word(p, end, "solid"))
        return false;
    for (; p < end; p++) {
        control = control || (*p < ' ' && !spb_is_blank(*p));
        keyword = keyword || is_word(p, end, "facet") || is_word(p, end, "endsolid");
        if (is_word(p, end, "facet") && p + 6 < end && is_word(p + 6, end, "normal"))
            return true;
    }
    /* Counts of binary files have zeros. A name may be longer than what is seen here. */
    return !control && (keyword || file_bytes > head_bytes);
}

static bool plausible_facet(const uint8_t *p)
{
    double value[12], square = 0;

    for (int i = 0; i < 12; i++)
        value[i] = (double)load_float(p + 4 * i);
    for (int i = 0; i < 3; i++)
        square += value[i] * value[i];
    for (int i = 3; i < 12; i++)
        if (!(fabs(value[i]) < 1e30) || (value[i] != 0 && fabs(value[i]) < 1e-30))
            return false;
    return !(square > 0) || (square > 0.5 && square < 2);
}

static bool looks_like_facets(const uint8_t *head, size_t head_bytes)
{
    bool any = false;                   /* zeros, as damage leaves them, are no facets */

    for (size_t at = STL_HEADER_BYTES; at + STL_FACET_BYTES <= head_bytes; at += STL_FACET_BYTES) {
        const uint8_t *const corner = head + at + STL_CORNERS_OFF;
        if (!plausible_facet(head + at))
            return false;
        any = any || (memcmp(corner, corner + 12, 12) != 0 && memcmp(corner, corner + 24, 12) != 0 &&
                      memcmp(corner + 12, corner + 24, 12) != 0);
    }
    return any;
}

static bool stl_sniff(const uint8_t *head, size_t head_bytes, uint64_t file_bytes)
{
    return count_fits(head, head_bytes, file_bytes) || begins_as_text(head, head_bytes, file_bytes) ||
           looks_like_facets(head, head_bytes);
}

/* ---- open ----------------------------------------------------------------------------------- */

static enum spc_status count_binary(struct stl *stl, struct spc_error *err)
{
    struct spb_bytes *const b = stl->bytes;

    if (spb_bytes_have(b) < STL_HEADER_BYTES)
        return spc_fail(err, SPC_INPUT_TRUNCATED, b->file_bytes,
                        "the file ends inside its header of %d bytes", STL_HEADER_BYTES);
    stl->declared = load_u32(b->buf + b->pos + STL_NAME_BYTES);
    const uint64_t body = b->file_bytes - STL_HEADER_BYTES;
    const uint64_t there = body / STL_FACET_BYTES;
    stl->count = there;
    if (body % STL_FACET_BYTES == 0 && (there > 0 || stl->declared == 0))
        return SPC_OK;
    if (stl->declared > there || stl->declared == 0)
        return spc_fail(err, SPC_INPUT_TRUNCATED, b->file_bytes,
                        "facet %" PRIu64 " of %" PRIu32 " is %s: the file ends", there,
                        stl->declared, body % STL_FACET_BYTES ? "cut short" : "missing");
    stl->count = stl->declared;
    stl->bytes_spare = body - stl->count * STL_FACET_BYTES;
    return SPC_OK;
}

static enum spc_status open_kind(struct stl *stl, const struct spb_source_options *options,
                                 struct spc_error *err)
{
    enum { HEAD_BYTES = 512 };
    struct spb_bytes *const b = stl->bytes;
    enum spc_status status = spb_bytes_need(b, HEAD_BYTES, err);

    if (status != SPC_OK)
        return status;
    const size_t have = spb_bytes_have(b) < HEAD_BYTES ? spb_bytes_have(b) : HEAD_BYTES;
    const uint8_t *const head = b->buf + b->pos;
    stl->ascii = !count_fits(head, have, b->file_bytes) && begins_as_text(head, have, b->file_bytes);
    if (stl->ascii)
        return spb_stl_ascii_count(stl, options->progress, err);
    status = count_binary(stl, err);
    return status == SPC_OK ? spb_stl_look_at_colors(stl, err) : status;
}

static void stl_close(void *state)
{
    free(state);
}

static enum spc_status stl_open(struct spb_bytes *bytes, const struct spb_source_options *options,
                                struct spb_source_info *info, void **state, struct spc_error *err)
{
    struct stl *const stl = calloc(1, sizeof *stl);

    if (!stl)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for an STL reader");
    stl->bytes = bytes;
    stl->text = (struct spb_text){ .bytes = bytes, .comment = '\n' };
    const enum spc_status status = open_kind(stl, options, err);
    if (status != SPC_OK) {
        stl_close(stl);
        return status;
    }
    info->format = stl->ascii ? "stl ascii" : "stl binary";
    info->vertex_count = 3 * stl->count;
    info->face_count = stl->count;
    info->colors = stl->colors != STL_PLAIN;
    info->wide = stl->wide;
    info->by_place = true;
    *state = stl;
    return SPC_OK;
}

/* ---- the two passes ------------------------------------------------------------------------- */

static enum spc_status stl_begin_vertices(void *state, struct spc_error *err)
{
    struct stl *const stl = state;

    (void)err;
    stl->next = 0;
    stl->in_faces = false;
    stl->failed = SPC_OK;
    if (stl->ascii)
        spb_stl_ascii_begin(stl);
    else
        spb_bytes_seek(stl->bytes, STL_HEADER_BYTES);
    return SPC_OK;
}

static void take_facets(const struct stl *stl, const uint8_t *p, size_t count,
                        struct spb_vertex_batch *out)
{
    double *xyz = out->xyz[out->count];

    for (size_t i = 0; i < count; i++, xyz += 9)
        for (int k = 0; k < 9; k++)
            xyz[k] = (double)load_float(p + i * STL_FACET_BYTES + STL_CORNERS_OFF + 4 * k);
    for (size_t i = 0; i < count && stl->colors != STL_PLAIN; i++) {
        uint8_t (*const rgba)[4] = &out->rgba[out->count + 3 * i];
        spb_stl_color(stl, load_u16(p + i * STL_FACET_BYTES + STL_WORD_OFF), rgba[0]);
        memcpy(rgba[1], rgba[0], 4);
        memcpy(rgba[2], rgba[0], 4);
    }
}

static enum spc_status binary_vertices(struct stl *stl, struct spb_vertex_batch *out,
                                       struct spc_error *err)
{
    struct spb_bytes *const b = stl->bytes;

    while (stl->next < stl->count && out->count + 3 <= SPB_BATCH_MAX) {
        const enum spc_status status = spb_bytes_need(b, STL_FACET_BYTES, err);
        if (status != SPC_OK)
            return status;
        size_t count = spb_bytes_have(b) / STL_FACET_BYTES;
        if (count == 0)                         /* somebody cut the file short */
            return spc_fail(err, SPC_INPUT_TRUNCATED, b->file_bytes,
                            "facet %" PRIu64 " of %" PRIu64 " is missing: the file ends",
                            stl->next, stl->count);
        if (count > (SPB_BATCH_MAX - out->count) / 3)
            count = (SPB_BATCH_MAX - out->count) / 3;
        if (count > stl->count - stl->next)
            count = (size_t)(stl->count - stl->next);
        take_facets(stl, b->buf + b->pos, count, out);
        b->pos += count * STL_FACET_BYTES;
        stl->next += count;
        out->count += 3 * count;
    }
    return SPC_OK;
}

static enum spc_status stl_vertices(void *state, struct spb_vertex_batch *out,
                                    struct spc_error *err)
{
    struct stl *const stl = state;

    out->count = 0;
    if (stl->failed != SPC_OK)
        return spc_fail(err, stl->failed, SPC_NO_OFF, "this pass has failed before");
    stl->failed = stl->ascii ? spb_stl_ascii_vertices(stl, out, err) : binary_vertices(stl, out, err);
    return stl->failed;
}

static enum spc_status stl_begin_faces(void *state, struct spc_error *err)
{
    struct stl *const stl = state;

    (void)err;
    stl->next = 0;
    stl->in_faces = true;
    return SPC_OK;
}

static enum spc_status stl_faces(void *state, struct spb_face_batch *out, struct spc_error *err)
{
    struct stl *const stl = state;
    const uint64_t left = stl->count - stl->next;

    (void)err;
    out->count = left < SPB_BATCH_MAX ? (size_t)left : SPB_BATCH_MAX;
    out->faces_in = out->count;
    out->split_extra = out->faces_short = 0;
    for (size_t i = 0; i < out->count; i++, stl->next++)
        for (uint64_t k = 0; k < 3; k++)
            out->corner[i][k] = 3 * stl->next + k;
    return SPC_OK;
}

/* The face pass reads nothing, but takes its time: a share of the file stands for it. */
static uint64_t stl_bytes_done(const void *state)
{
    const struct stl *const stl = state;
    const uint64_t facet_bytes = stl->count ? stl->bytes->file_bytes / stl->count : 0;

    return stl->in_faces ? facet_bytes * stl->next : spb_bytes_off(stl->bytes);
}

/* ---- remark --------------------------------------------------------------------------------- */

static void add_remark(struct stl *stl, const char *fmt, ...) __attribute__((format(printf, 2, 3)));

static void add_remark(struct stl *stl, const char *fmt, ...)
{
    const size_t length = strlen(stl->remark);
    char text[160];
    va_list args;

    va_start(args, fmt);
    vsnprintf(text, sizeof text, fmt, args);
    va_end(args);
    snprintf(stl->remark + length, sizeof stl->remark - length, "%s%s", length ? "; " : "", text);
}

static const char *stl_remark(void *state)
{
    struct stl *const stl = state;

    stl->remark[0] = 0;
    if (!stl->ascii && stl->declared != stl->count)
        add_remark(stl, "the header counts %" PRIu32 " facets, %" PRIu64 " are there and were read",
                   stl->declared, stl->count);
    if (stl->bytes_spare > 0)
        add_remark(stl, "%" PRIu64 " bytes behind the last facet", stl->bytes_spare);
    if (stl->end_missing)
        add_remark(stl, "the last solid has no 'endsolid'");
    if (stl->lines_outside > 0)
        add_remark(stl, "%" PRIu64 " lines outside of solids were passed over", stl->lines_outside);
    return stl->remark;
}

const struct spb_format spb_stl_format = {
    .name = "STL",
    .sniff = stl_sniff,
    .open = stl_open,
    .close = stl_close,
    .begin_vertices = stl_begin_vertices,
    .begin_faces = stl_begin_faces,
    .vertices = stl_vertices,
    .faces = stl_faces,
    .bytes_done = stl_bytes_done,
    .remark = stl_remark,
};
