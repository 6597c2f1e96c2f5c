/*
 * Rows. A vertex or face is a line, as in PLY, and the same loose ends are taken up: what a vertex
 * does not need is passed over to the end of its line, rows whose line ends too early go on in the
 * next, and a row that does both is refused as one that lacks a value.
 *
 * A vertex is x y z, then what the keyword says, in this order: normal, colour, texture. A colour
 * has three values or four; the first vertex tells. Whether they reach to 255 or to 1 only the
 * whole file tells: they go to 1 if none is larger, or if some have a point and none is much
 * larger. Opening reads the vertices for that, and to know whether they need double.
 *
 * A face is a count and as many vertex numbers; what stands behind them on the line is its colour,
 * which an archive has no place for: remarked. Polygons become fans of their first corner.
 */
#include "off.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "off_int.h"

/* Real colours of full scale 1 that overshoot are clamped; no writer's 0 to 255 ends below this. */
static const double COLOR_OVERSHOOT = 16;

/* ---- errors --------------------------------------------------------------------------------- */

static enum spc_status fail_row(const struct off *off, enum spc_status status, uint64_t at_off,
                                struct spc_error *err, const char *fmt, ...)
    __attribute__((format(printf, 5, 6)));

static enum spc_status fail_row(const struct off *off, enum spc_status status, uint64_t at_off,
                                struct spc_error *err, const char *fmt, ...)
{
    char text[110];
    va_list args;

    va_start(args, fmt);
    vsnprintf(text, sizeof text, fmt, args);
    va_end(args);
    return spc_fail(err, status, at_off, "%s %" PRIu64 " of %" PRIu64 "%s",
                    off->in_faces ? "face" : "vertex", off->row,
                    off->in_faces ? off->face_count : off->vertex_count, text);
}

static enum spc_status fail_end(const struct off *off, bool begun, struct spc_error *err)
{
    return fail_row(off, SPC_INPUT_TRUNCATED, off->text.bytes->file_bytes, err,
                    " is %s: the file ends", begun ? "cut short" : "missing");
}

static enum spc_status fail_value(const struct off *off, const char *should, struct spc_error *err)
{
    char shown[SPB_TEXT_SHOWN];

    spb_text_show(&off->text, shown);
    return fail_row(off, SPC_INPUT_FORMAT, spb_bytes_off(off->text.bytes), err, ": '%s' is not %s",
                    shown, should);
}

/* ---- rows ----------------------------------------------------------------------------------- */

static inline enum spc_status row_begin(struct off *off, struct spc_error *err)
{
    const enum spc_status status = off_to_value(off, err);

    if (status == SPC_OK && spb_text_ended(&off->text))
        return fail_end(off, false, err);
    off->text.wrapped = false;
    off->row_off = spb_bytes_off(off->text.bytes);
    return status;
}

static inline enum spc_status to_value(struct off *off, struct spc_error *err)
{
    const enum spc_status status = off_to_value(off, err);

    if (status == SPC_OK && spb_text_ended(&off->text))
        return fail_end(off, true, err);
    return status;
}

/* To the end of the line; counts what was there, and whether the row went over several. */
static inline enum spc_status row_end(struct off *off, uint64_t *spare_rows, uint64_t *wrapped_rows,
                                      struct spc_error *err)
{
    bool spare = false, any = false;
    enum spc_status status = spb_text_to_value_in_line(&off->text, &spare, err);

    if (status == SPC_OK && spare && off->text.wrapped)
        return fail_row(off, SPC_INPUT_FORMAT, off->row_off, err, ": its line holds too few values");
    if (status == SPC_OK)
        status = spb_text_pass_line(&off->text, &any, err);
    *spare_rows += spare;
    *wrapped_rows += off->text.wrapped;
    off->row++;
    return status;
}

static enum spc_status pass_values(struct off *off, int count, struct spc_error *err)
{
    enum spc_status status = SPC_OK;

    for (int i = 0; i < count && status == SPC_OK; i++) {
        status = to_value(off, err);
        if (status == SPC_OK)
            status = spb_text_pass_value(&off->text, err);
    }
    return status;
}

/* ---- vertices ------------------------------------------------------------------------------- */

/* How many values the first vertex's colour has: what is left on its line, less the texture. */
static enum spc_status count_color_values(struct off *off, struct spc_error *err)
{
    const uint64_t at_off = spb_bytes_off(off->text.bytes);
    enum spc_status status = SPC_OK;
    int count = 0;
    bool more = true;

    while (status == SPC_OK) {
        status = spb_text_to_value_in_line(&off->text, &more, err);
        if (!more || count > 8)
            break;
        if (status == SPC_OK)
            status = spb_text_pass_value(&off->text, err);
        count++;
    }
    if (off->kind.texture)
        count -= 2;
    if (status == SPC_OK && count != 3 && count != 4)
        return fail_row(off, SPC_INPUT_FORMAT, at_off, err,
                        ": the keyword promises colours, but no three or four values are there");
    off->color_values = count;
    spb_bytes_seek(off->text.bytes, at_off);
    return status;
}

static void look_at_color(struct off *off, const uint8_t *p, double value)
{
    const uint8_t *const end = spb_text_at(&off->text);

    if (value > off->color_max && value < (double)UINT32_MAX)
        off->color_max = value;
    off->color_point = off->color_point || memchr(p, '.', (size_t)(end - p)) != NULL;
}

static uint8_t scale_color(const struct off *off, double value)
{
    if (!(value > 0))
        return 0;                               /* nan too */
    return value >= off->color_full ? 255 : (uint8_t)(value * 255 / off->color_full + 0.5);
}

static enum spc_status read_color(struct off *off, uint8_t rgba[4], struct spc_error *err)
{
    enum spc_status status = SPC_OK;

    rgba[3] = 255;
    for (int c = 0; c < off->color_values && status == SPC_OK; c++) {
        double value = 0;
        status = to_value(off, err);
        const uint8_t *const begin = spb_text_at(&off->text);
        if (status == SPC_OK && !spb_text_real(&off->text, &value))
            return fail_value(off, "a number", err);
        if (status == SPC_OK && off->looking)
            look_at_color(off, begin, value);
        rgba[c] = scale_color(off, value);
    }
    return status;
}

static inline enum spc_status read_xyz(struct off *off, double xyz[3], struct spc_error *err)
{
    for (int a = 0; a < 3; a++) {
        const enum spc_status status = to_value(off, err);
        const uint8_t *const begin = spb_text_at(&off->text);
        if (status != SPC_OK)
            return status;
        if (!spb_text_real(&off->text, &xyz[a]))
            return fail_value(off, "a number", err);
        if (off->looking && !off->wide)
            off->wide = spb_text_wider_than_float(begin, spb_text_at(&off->text), xyz[a]);
    }
    return SPC_OK;
}

static enum spc_status read_vertex(struct off *off, double xyz[3], uint8_t rgba[4],
                                   struct spc_error *err)
{
    enum spc_status status = row_begin(off, err);

    if (status == SPC_OK)
        status = read_xyz(off, xyz, err);
    if (status == SPC_OK && off->kind.normals)
        status = pass_values(off, 3, err);
    if (status == SPC_OK && off->kind.colors && off->color_values == 0)
        status = count_color_values(off, err);
    if (status == SPC_OK && off->kind.colors)
        status = read_color(off, rgba, err);
    if (status == SPC_OK && off->kind.texture)
        status = pass_values(off, 2, err);
    return status == SPC_OK ? row_end(off, &off->vertices_spare, &off->vertices_wrapped, err) : status;
}

static enum spc_status off_begin_vertices(void *state, struct spc_error *err)
{
    struct off *const off = state;

    (void)err;
    spb_bytes_seek(off->text.bytes, off->vertex_off);
    off->row = off->vertices_spare = off->vertices_wrapped = 0;
    off->in_faces = false;
    off->failed = SPC_OK;
    return SPC_OK;
}

static enum spc_status refuse_failed(const struct off *off, struct spc_error *err)
{
    return spc_fail(err, off->failed, SPC_NO_OFF, "this pass has failed before");
}

static enum spc_status off_vertices(void *state, struct spb_vertex_batch *out,
                                    struct spc_error *err)
{
    struct off *const off = state;

    out->count = 0;
    if (off->failed != SPC_OK)
        return refuse_failed(off, err);
    while (out->count < SPB_BATCH_MAX && off->row < off->vertex_count && off->failed == SPC_OK) {
        off->failed = read_vertex(off, out->xyz[out->count], out->rgba[out->count], err);
        out->count++;
    }
    return off->failed;
}

/* Reads the vertices for what only all of them tell; the faces begin behind. */
static enum spc_status look_at_vertices(struct off *off, const struct spb_progress *progress,
                                        struct spc_error *err)
{
    struct spb_bytes *const b = off->text.bytes;
    enum spc_status status = off_begin_vertices(off, err);

    off->looking = true;
    while (status == SPC_OK && off->row < off->vertex_count) {
        double xyz[3];
        uint8_t rgba[4];
        status = read_vertex(off, xyz, rgba, err);
        if (off->row % SPB_BATCH_MAX == 0 && status == SPC_OK &&
            spb_progress_tell(progress, "count", spb_bytes_off(b), b->file_bytes))
            status = spc_fail(err, SPC_CANCELLED, SPC_NO_OFF, "cancelled");
    }
    off->looking = false;
    off->face_off = spb_bytes_off(b);
    off->color_full = off->color_max > 255 ? 65535 : 255;
    if (off->color_max <= 1 || (off->color_point && off->color_max <= COLOR_OVERSHOOT))
        off->color_full = 1;
    return status;
}

/* ---- faces ---------------------------------------------------------------------------------- */

static enum spc_status off_begin_faces(void *state, struct spc_error *err)
{
    struct off *const off = state;

    (void)err;
    spb_bytes_seek(off->text.bytes, off->face_off);
    off->row = off->faces_colored = off->faces_wrapped = 0;
    off->in_faces = true;
    off->in_face = false;
    off->failed = SPC_OK;
    return SPC_OK;
}

static enum spc_status open_face(struct off *off, struct spb_face_batch *out, struct spc_error *err)
{
    struct spb_bytes *const b = off->text.bytes;
    const enum spc_status status = row_begin(off, err);
    int64_t count;

    if (status != SPC_OK)
        return status;
    const size_t pos = b->pos;
    const bool whole = spb_text_int(&off->text, &count) && count >= 0;     /* SPB_NOT_WHOLE is less */
    if (!whole || (uint64_t)count > b->file_bytes / 2) {
        b->pos = pos;
        return fail_value(off, whole ? "a count that this file can hold" : "a count of corners", err);
    }
    off->corners_left = (uint64_t)count;
    off->run = 0;
    off->in_face = true;
    out->faces_in++;
    out->faces_short += count < 3;
    return SPC_OK;
}

static inline void add_corner(struct off *off, int64_t item, struct spb_face_batch *out)
{
    const uint64_t corner = item < 0 ? SPB_BAD_INDEX : (uint64_t)item;

    if (off->run >= 2) {
        uint64_t *const triangle = out->corner[out->count++];
        triangle[0] = off->first;
        triangle[1] = off->last;
        triangle[2] = corner;
        out->split_extra += off->run > 2;
    }
    if (off->run == 0)
        off->first = corner;
    off->last = corner;
    off->run++;
}

/* Reads on in the face, no further than the batch has room; closes the row behind its end. */
static enum spc_status read_face(struct off *off, struct spb_face_batch *out, struct spc_error *err)
{
    for (; off->corners_left > 0 && out->count < SPB_BATCH_MAX; off->corners_left--) {
        const enum spc_status status = to_value(off, err);
        int64_t item;
        if (status != SPC_OK)
            return status;
        if (!spb_text_int(&off->text, &item))
            return fail_value(off, "a vertex number", err);
        add_corner(off, item, out);
    }
    if (off->corners_left > 0)
        return SPC_OK;
    off->in_face = false;
    return row_end(off, &off->faces_colored, &off->faces_wrapped, err);
}

static enum spc_status off_faces(void *state, struct spb_face_batch *out, struct spc_error *err)
{
    struct off *const off = state;
    enum spc_status status = SPC_OK;

    out->count = 0;
    out->faces_in = out->split_extra = out->faces_short = 0;
    if (off->failed != SPC_OK)
        return refuse_failed(off, err);
    while (status == SPC_OK && out->count < SPB_BATCH_MAX &&
           (off->in_face || off->row < off->face_count)) {
        if (!off->in_face)
            status = open_face(off, out, err);
        if (status == SPC_OK)
            status = read_face(off, out, err);
    }
    if (status == SPC_OK && out->count == 0) {
        status = off_to_value(off, err);
        off->bytes_spare = spb_bytes_rest(off->text.bytes);
    }
    off->failed = status;
    return status;
}

static uint64_t off_bytes_done(const void *state)
{
    const struct off *const off = state;
    return spb_bytes_off(off->text.bytes) - (off->in_faces ? off->face_off : off->vertex_off);
}

/* ---- remark --------------------------------------------------------------------------------- */

static void add_remark(struct off *off, uint64_t count, const char *what)
{
    const size_t length = strlen(off->remark);

    if (count > 0)
        snprintf(off->remark + length, sizeof off->remark - length, "%s%" PRIu64 " %s",
                 length ? "; " : "", count, what);
}

static const char *off_remark(void *state)
{
    struct off *const off = state;

    off->remark[0] = 0;
    add_remark(off, off->vertices_spare, "vertices have spare values");
    add_remark(off, off->vertices_wrapped, "vertices go on in the next line");
    add_remark(off, off->faces_wrapped, "faces go on in the next line");
    add_remark(off, off->faces_colored, "faces have a colour, which is passed over");
    add_remark(off, off->bytes_spare, "bytes behind the last face");
    return off->remark;
}

/* ---- open and close ------------------------------------------------------------------------- */

static void off_close(void *state)
{
    free(state);
}

static enum spc_status off_open(struct spb_bytes *bytes, const struct spb_source_options *options,
                                struct spb_source_info *info, void **state, struct spc_error *err)
{
    struct off *const off = calloc(1, sizeof *off);

    if (!off)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for an OFF reader");
    off->text = (struct spb_text){ .bytes = bytes, .comment = '#' };
    off->color_full = 1;
    enum spc_status status = spb_off_header_read(off, err);
    if (status == SPC_OK)
        status = look_at_vertices(off, options->progress, err);
    if (status != SPC_OK) {
        off_close(off);
        return status;
    }
    info->format = "off ascii";
    info->vertex_count = off->vertex_count;
    info->face_count = off->face_count;
    info->colors = off->color_values > 0;
    info->wide = off->wide;
    *state = off;
    return SPC_OK;
}

const struct spb_format spb_off_format = {
    .name = "OFF",
    .sniff = spb_off_sniff,
    .open = off_open,
    .close = off_close,
    .begin_vertices = off_begin_vertices,
    .begin_faces = off_begin_faces,
    .vertices = off_vertices,
    .faces = off_faces,
    .bytes_done = off_bytes_done,
    .remark = off_remark,
};
