/*
 * Elements in any order, two passes, and faces to triangles.
 *
 * A file is a row of elements. Where an element starts is known for the first, by arithmetic for
 * those behind elements of fixed size, and otherwise once somebody has read or walked over what
 * lies before; element_off[] keeps it. So "vertex first" costs nothing, and "face first" one walk
 * over the faces.
 *
 * Faces are the lists vertex_indices or vertex_index of element face (or faces) and the strips of
 * element tristrips; lists elsewhere (range_grid, multi_patch, edge) are not. If a file has both,
 * faces come first whatever their order. A list is read PLY_ITEMS_MAX values at a time, and
 * between two calls only two corners are kept, so that polygons and strips of any length take
 * constant memory.
 *
 * A polygon becomes a fan of its first corner. In a strip each value beyond the second of a run
 * makes a triangle; every other one is turned so that all face as the first does; -1 starts a new
 * run (so does 2^32 - 1, which is -1 stored by a writer that declared uint; 65535 in a ushort list
 * is taken as a vertex). Runs of one or two values make nothing.
 *
 * The element behind the last face, and all others to the end of the file, are walked over when
 * the face pass ends: a file that breaks its promise there is refused as well, and bytes behind
 * the last element are remarked.
 */
#include "ply.h"

#include <assert.h>
#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "number.h"
#include "ply_int.h"

/* ---- errors and colours --------------------------------------------------------------------- */

enum spc_status spb_ply_fail_row(const struct ply *ply, enum spc_status status, uint64_t at_off,
                                 struct spc_error *err, const char *fmt, ...)
{
    char text[120];
    va_list args;

    va_start(args, fmt);
    vsnprintf(text, sizeof text, fmt, args);
    va_end(args);
    return spc_fail(err, status, at_off, "%s %" PRIu64 " of %" PRIu64 ": %s", ply->element->name,
                    ply->row, ply->element->count, text);
}

enum spc_status spb_ply_fail_end(const struct ply *ply, bool begun, struct spc_error *err)
{
    const struct ply_element *const e = ply->element;
    char hint[80] = "";

    if (e->rows_wrapped > 0)
        snprintf(hint, sizeof hint, " (%" PRIu64 " rows before it went on in the next line)",
                 e->rows_wrapped);
    return spc_fail(err, SPC_INPUT_TRUNCATED, ply->bytes->file_bytes,
                    "%s %" PRIu64 " of %" PRIu64 " is %s: the file ends%s", e->name, ply->row,
                    e->count, begun ? "cut short" : "missing", hint);
}

enum spc_status spb_ply_fail_list(const struct ply *ply, uint64_t at_off, uint64_t count,
                                  struct spc_error *err)
{
    return spb_ply_fail_row(ply, SPC_INPUT_FORMAT, at_off, err,
                            "a list of %" PRIu64 " values cannot be in a file of %" PRIu64 " bytes",
                            count, ply->bytes->file_bytes);
}

/* Real colours of full scale 1 that overshoot are clamped; no writer's 0 to 255 ends below this. */
static const double COLOR_OVERSHOOT = 16;

uint8_t spb_ply_color(struct ply *ply, unsigned type, unsigned role, double value)
{
    const bool real = type >= PLY_F32;
    double full = 255;

    if (!(value > 0))
        return 0;                               /* nan too */
    if (real || type == PLY_U16) {
        if (ply->color_looking && role != PLY_ALPHA && value > ply->color_max[real] &&
            isfinite(value))
            ply->color_max[real] = value;
        full = ply->color_full[real];
    }
    return value >= full ? 255 : (uint8_t)(value * 255 / full + 0.5);
}

/* ---- rows of either kind of body ------------------------------------------------------------ */

static enum spc_status row_begin(struct ply *ply, struct spc_error *err)
{
    return ply->header.ascii ? spb_ply_ascii_row_begin(ply, err)
                             : spb_ply_binary_row_begin(ply, err);
}

static enum spc_status row_end(struct ply *ply, struct spc_error *err)
{
    const enum spc_status status = ply->header.ascii ? spb_ply_ascii_row_end(ply, err) : SPC_OK;
    ply->row++;
    return status;
}

/* Passes over the properties [from, to) of the row under way. */
static enum spc_status pass_properties(struct ply *ply, uint32_t from, uint32_t to,
                                       struct spc_error *err)
{
    enum spc_status status = SPC_OK;

    for (uint32_t i = from; i < to && status == SPC_OK; i++) {
        const struct ply_property *const p = &ply->header.property[i];
        status = ply->header.ascii ? spb_ply_ascii_pass(ply, p, err)
                                   : spb_ply_binary_pass(ply, p, err);
    }
    return status;
}

/* ---- elements ------------------------------------------------------------------------------- */

static void enter_element(struct ply *ply, uint32_t index)
{
    ply->element = &ply->header.element[index];
    ply->element->rows_spare = ply->element->rows_wrapped = 0;
    ply->row = 0;
    ply->in_list = false;
    ply->pass_off = spb_bytes_off(ply->bytes);
}

/* Leaves the element being read, all of whose rows are done. */
static void leave_element(struct ply *ply)
{
    const ptrdiff_t index = ply->element - ply->header.element;
    const uint64_t off = spb_bytes_off(ply->bytes);

    ply->element_off[index + 1] = off;
    ply->pass_bytes += off - ply->pass_off;
    ply->element = NULL;
}

static enum spc_status skip_element(struct ply *ply, struct spc_error *err)
{
    const struct ply_element *const e = ply->element;
    const uint32_t first = e->property_first;
    enum spc_status status = SPC_OK;

    if (e->property_count == 0)
        return SPC_OK;
    if (!ply->header.ascii && e->list_count == 0) {
        const uint64_t rest = spb_bytes_rest(ply->bytes);
        if (rest / e->row_bytes < e->count) {
            ply->row = rest / e->row_bytes;
            return spb_ply_fail_end(ply, rest % e->row_bytes > 0, err);
        }
        spb_bytes_skip(ply->bytes, e->count * e->row_bytes);
        return SPC_OK;
    }
    while (ply->row < e->count && status == SPC_OK) {
        status = row_begin(ply, err);
        if (status == SPC_OK)
            status = pass_properties(ply, first, first + e->property_count, err);
        if (status == SPC_OK)
            status = row_end(ply, err);
    }
    return status;
}

/* Moves to the start of an element, or for index element_count to the end of the last. */
static enum spc_status locate(struct ply *ply, uint32_t index, struct spc_error *err)
{
    uint32_t at = index;

    while (ply->element_off[at] == SPC_NO_OFF)
        at--;                                   /* the first is always known */
    spb_bytes_seek(ply->bytes, ply->element_off[at]);
    for (; at < index; at++) {
        enter_element(ply, at);
        const enum spc_status status = skip_element(ply, err);
        if (status != SPC_OK)
            return status;
        leave_element(ply);
    }
    return SPC_OK;
}

static enum spc_status begin_element(struct ply *ply, uint32_t index, struct spc_error *err)
{
    const uint64_t pass_bytes = ply->pass_bytes;
    const enum spc_status status = locate(ply, index, err);

    ply->pass_bytes = pass_bytes;               /* what is passed over is not of this pass */
    if (status == SPC_OK)
        enter_element(ply, index);
    return status;
}

/* Passes over what follows the last element read, to learn whether the file keeps its promise. */
static enum spc_status see_end(struct ply *ply, struct spc_error *err)
{
    const uint64_t pass_bytes = ply->pass_bytes;
    enum spc_status status;

    if (ply->end_seen)
        return SPC_OK;
    status = locate(ply, ply->header.element_count, err);
    ply->pass_bytes = pass_bytes;
    if (status != SPC_OK)
        return status;
    if (ply->header.ascii)
        status = spb_ply_ascii_rest(ply, err);
    else
        ply->bytes_spare = spb_bytes_rest(ply->bytes);
    ply->end_seen = status == SPC_OK;
    return status;
}

/* ---- the two passes ------------------------------------------------------------------------- */

static enum spc_status keep_failure(struct ply *ply, enum spc_status status)
{
    ply->failed = status;
    return status;
}

static enum spc_status refuse_failed(const struct ply *ply, struct spc_error *err)
{
    return spc_fail(err, ply->failed, SPC_NO_OFF, "this pass has failed before");
}

static enum spc_status ply_vertices(void *state, struct spb_vertex_batch *out,
                                    struct spc_error *err);

static bool color_scale_unsure(const struct ply *ply)
{
    for (int i = PLY_RED; i <= PLY_BLUE && ply->header.colors; i++)
        if (ply->header.channel[i].type == PLY_U16 || ply->header.channel[i].type >= PLY_F32)
            return true;
    return false;
}

/* Reads all vertices for their largest colours. An error in them comes again in the pass itself. */
static enum spc_status look_at_colors(struct ply *ply, struct spc_error *err)
{
    struct spb_vertex_batch *const batch = malloc(sizeof *batch);

    if (!batch)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a PLY reader");
    ply->color_looking = true;
    while (ply_vertices(ply, batch, NULL) == SPC_OK && batch->count > 0)
        continue;
    ply->color_looking = false;
    ply->color_known = true;
    ply->color_full[0] = ply->color_max[0] > 255 ? 65535 : 255;
    ply->color_full[1] = ply->color_max[1] > 255 ? 65535
                         : ply->color_max[1] > COLOR_OVERSHOOT ? 255 : 1;
    free(batch);
    return SPC_OK;
}

static enum spc_status ply_begin_vertices(void *state, struct spc_error *err)
{
    struct ply *const ply = state;
    enum spc_status status;

    ply->pass_bytes = 0;
    ply->element = NULL;
    status = keep_failure(ply, begin_element(ply, ply->header.vertex, err));
    if (status != SPC_OK || ply->color_known || !color_scale_unsure(ply))
        return status;
    status = look_at_colors(ply, err);
    if (status != SPC_OK)
        return keep_failure(ply, status);
    ply->header.element[ply->header.vertex].rows_spare = 0;
    ply->header.element[ply->header.vertex].rows_wrapped = 0;
    return ply_begin_vertices(ply, err);
}

static enum spc_status ply_vertices(void *state, struct spb_vertex_batch *out,
                                    struct spc_error *err)
{
    struct ply *const ply = state;
    enum spc_status status = SPC_OK;

    out->count = 0;
    if (ply->failed != SPC_OK)
        return refuse_failed(ply, err);
    if (!ply->element)
        return SPC_OK;
    assert(ply->element->kind == PLY_VERTEX);
    status = ply->header.ascii ? spb_ply_ascii_vertices(ply, out, err)
                               : spb_ply_binary_vertices(ply, out, err);
    if (status == SPC_OK && ply->row == ply->element->count)
        leave_element(ply);
    return keep_failure(ply, status);
}

static enum spc_status ply_begin_faces(void *state, struct spc_error *err)
{
    struct ply *const ply = state;
    const struct ply_header *const h = &ply->header;

    ply->pass_bytes = 0;
    ply->element = NULL;
    if (h->faces != PLY_NO_ELEMENT)
        return keep_failure(ply, begin_element(ply, h->faces, err));
    if (h->strips != PLY_NO_ELEMENT)
        return keep_failure(ply, begin_element(ply, h->strips, err));
    return keep_failure(ply, SPC_OK);
}

static void add_triangle(struct spb_face_batch *out, uint64_t a, uint64_t b, uint64_t c)
{
    uint64_t *const corner = out->corner[out->count++];
    corner[0] = a;
    corner[1] = b;
    corner[2] = c;
}

static void add_polygon_corner(struct ply *ply, int64_t item, struct spb_face_batch *out)
{
    const uint64_t corner = item < 0 ? SPB_BAD_INDEX : (uint64_t)item;

    if (ply->run >= 2)
        add_triangle(out, ply->back[0], ply->back[1], corner);
    out->split_extra += ply->run > 2;
    ply->back[ply->run > 0] = corner;
    ply->run++;
}

static void add_strip_corner(struct ply *ply, int64_t item, struct spb_face_batch *out)
{
    const uint64_t corner = item < 0 ? SPB_BAD_INDEX : (uint64_t)item;

    if (item == -1 || item == UINT32_MAX) {
        ply->run = 0;
        return;
    }
    if (ply->run >= 2) {
        const bool turned = ply->run & 1;
        add_triangle(out, ply->back[turned], ply->back[!turned], corner);
        out->faces_in++;
    }
    ply->back[0] = ply->back[1];
    ply->back[1] = corner;
    ply->run++;
}

static enum spc_status open_list(struct ply *ply, struct spb_face_batch *out,
                                 struct spc_error *err)
{
    const struct ply_element *const e = ply->element;
    const struct ply_property *const list = &ply->header.property[e->index_property];
    enum spc_status status = row_begin(ply, err);

    if (status == SPC_OK)
        status = pass_properties(ply, e->property_first, e->index_property, err);
    if (status == SPC_OK)
        status = ply->header.ascii ? spb_ply_ascii_list_count(ply, list, &ply->list_left, err)
                                   : spb_ply_binary_list_count(ply, list, &ply->list_left, err);
    if (status != SPC_OK)
        return status;
    ply->in_list = true;
    ply->run = 0;
    if (e->kind == PLY_FACES) {
        out->faces_in++;
        out->faces_short += ply->list_left < 3;
    }
    return SPC_OK;
}

/* Reads on in the list, no further than the batch has room; closes the row behind its end. */
static enum spc_status read_list(struct ply *ply, struct spb_face_batch *out,
                                 struct spc_error *err)
{
    const struct ply_element *const e = ply->element;
    const struct ply_property *const list = &ply->header.property[e->index_property];
    size_t count = SPB_BATCH_MAX - out->count;      /* a value makes one triangle at most */
    int64_t items[PLY_ITEMS_MAX];
    enum spc_status status;

    if (count > PLY_ITEMS_MAX)
        count = PLY_ITEMS_MAX;
    if (count > ply->list_left)
        count = (size_t)ply->list_left;
    status = ply->header.ascii ? spb_ply_ascii_items(ply, list, count, items, err)
                               : spb_ply_binary_items(ply, list, count, items, err);
    if (status != SPC_OK)
        return status;
    for (size_t i = 0; i < count; i++) {
        if (e->kind == PLY_STRIPS)
            add_strip_corner(ply, items[i], out);
        else
            add_polygon_corner(ply, items[i], out);
    }
    ply->list_left -= count;
    if (ply->list_left > 0)
        return SPC_OK;
    ply->in_list = false;
    status = pass_properties(ply, e->index_property + 1, e->property_first + e->property_count,
                             err);
    return status == SPC_OK ? row_end(ply, err) : status;
}

/* One step of the face pass: many faces, or a face, or a part of one. */
static enum spc_status step_faces(struct ply *ply, struct spb_face_batch *out,
                                  struct spc_error *err)
{
    const struct ply_element *const e = ply->element;
    enum spc_status status = SPC_OK;

    if (!ply->in_list && !ply->header.ascii && e->kind == PLY_FACES && e->list_count == 1) {
        status = spb_ply_binary_faces(ply, out, err);
        if (status != SPC_OK || out->count == SPB_BATCH_MAX)
            return status;
    }
    if (!ply->in_list && ply->row < e->count)
        status = open_list(ply, out, err);
    if (status == SPC_OK && ply->in_list)
        status = read_list(ply, out, err);
    return status;
}

static enum spc_status ply_faces(void *state, struct spb_face_batch *out, struct spc_error *err)
{
    struct ply *const ply = state;
    enum spc_status status = SPC_OK;

    out->count = 0;
    out->faces_in = out->split_extra = out->faces_short = 0;
    if (ply->failed != SPC_OK)
        return refuse_failed(ply, err);
    while (ply->element && out->count < SPB_BATCH_MAX && status == SPC_OK) {
        assert(ply->element->kind == PLY_FACES || ply->element->kind == PLY_STRIPS);
        if (ply->row < ply->element->count) {
            status = step_faces(ply, out, err);
            continue;
        }
        const bool strips_follow = ply->element->kind == PLY_FACES &&
                                   ply->header.strips != PLY_NO_ELEMENT;
        leave_element(ply);
        if (strips_follow)
            status = begin_element(ply, ply->header.strips, err);
    }
    if (status == SPC_OK && out->count == 0)
        status = see_end(ply, err);
    return keep_failure(ply, status);
}

static uint64_t ply_bytes_done(const void *state)
{
    const struct ply *const ply = state;
    return ply->pass_bytes + (ply->element ? spb_bytes_off(ply->bytes) - ply->pass_off : 0);
}

/* ---- remark --------------------------------------------------------------------------------- */

static void add_remark(struct ply *ply, const char *fmt, ...) __attribute__((format(printf, 2, 3)));

static void add_remark(struct ply *ply, const char *fmt, ...)
{
    const size_t length = strlen(ply->remark);
    char text[160];
    va_list args;

    va_start(args, fmt);
    vsnprintf(text, sizeof text, fmt, args);
    va_end(args);
    snprintf(ply->remark + length, sizeof ply->remark - length, "%s%s", length ? "; " : "", text);
}

static const char *ply_remark(void *state)
{
    struct ply *const ply = state;
    const struct ply_header *const h = &ply->header;

    ply->remark[0] = 0;
    if (h->unknown_count > 0)
        add_remark(ply, "%" PRIu64 " header lines begin with no keyword of PLY, "
                   "the first with '%s'", h->unknown_count, h->unknown);
    if (h->faces_unread)
        add_remark(ply, "an element of faces has no list 'vertex_indices' and was passed over");
    for (uint32_t i = 0; i < h->element_count; i++) {
        const struct ply_element *const e = &h->element[i];
        if (e->rows_spare > 0)
            add_remark(ply, "%" PRIu64 " rows of element '%s' have spare values", e->rows_spare,
                       e->name);
        if (e->rows_wrapped > 0)
            add_remark(ply, "%" PRIu64 " rows of element '%s' go on in the next line",
                       e->rows_wrapped, e->name);
    }
    if (ply->color_max[0] > 0 && ply->color_max[0] <= 255)
        add_remark(ply, "16-bit colours never exceed %.0f and are taken as bytes",
                   ply->color_max[0]);
    if (ply->color_full[1] > 1)
        add_remark(ply, "real colours reach %g and are taken as 0 to %.0f", ply->color_max[1],
                   ply->color_full[1]);
    if (ply->bytes_spare > 0)
        add_remark(ply, "%" PRIu64 " bytes behind the last element", ply->bytes_spare);
    return ply->remark;
}

/* ---- open and close ------------------------------------------------------------------------- */

static bool ply_sniff(const uint8_t *head, size_t head_bytes, uint64_t file_bytes)
{
    (void)file_bytes;
    if (head_bytes >= 3 && memcmp(head, "\xef\xbb\xbf", 3) == 0) {
        head += 3;
        head_bytes -= 3;
    }
    return head_bytes >= 3 && memcmp(head, "ply", 3) == 0 &&
           (head_bytes == 3 || head[3] == '\n' || head[3] == '\r' || head[3] == ' ' ||
            head[3] == '\t');
}

static void fill_info(const struct ply_header *h, struct spb_source_info *info)
{
    info->format = h->ascii ? "ply ascii" : h->big_endian ? "ply be" : "ply le";
    info->vertex_count = h->element[h->vertex].count;
    if (h->faces != PLY_NO_ELEMENT)
        info->face_count = h->element[h->faces].count;
    if (h->strips != PLY_NO_ELEMENT) {
        info->face_count += h->element[h->strips].count;    /* both fit one file: no overflow */
        info->strips = h->element[h->strips].count > 0;
    }
    info->colors = h->colors;
    info->normals = h->normals;
    for (int i = PLY_X; i <= PLY_Z; i++) {
        const uint8_t type = h->channel[i].type;
        info->wide = info->wide || type == PLY_F64 || type == PLY_I32 || type == PLY_U32;
    }
}

static void ply_close(void *state)
{
    free(state);
}

static enum spc_status ply_open(struct spb_bytes *bytes, const struct spb_source_options *options,
                                struct spb_source_info *info, void **state, struct spc_error *err)
{
    (void)options;
    struct ply *const ply = calloc(1, sizeof *ply);
    enum spc_status status;

    if (!ply)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a PLY reader");
    ply->bytes = bytes;
    ply->text = (struct spb_text){ .bytes = bytes, .comment = '\n' };
    ply->color_full[0] = 65535;
    ply->color_full[1] = 1;
    for (size_t i = 0; i <= PLY_ELEMENT_MAX; i++)
        ply->element_off[i] = SPC_NO_OFF;
    status = spb_ply_header_read(bytes, &ply->header, err);
    if (status != SPC_OK) {
        ply_close(ply);
        return status;
    }
    ply->element_off[0] = ply->header.body_off;
    fill_info(&ply->header, info);
    *state = ply;
    return SPC_OK;
}

const struct spb_format spb_ply_format = {
    .name = "PLY",
    .sniff = ply_sniff,
    .open = ply_open,
    .close = ply_close,
    .begin_vertices = ply_begin_vertices,
    .begin_faces = ply_begin_faces,
    .vertices = ply_vertices,
    .faces = ply_faces,
    .bytes_done = ply_bytes_done,
    .remark = ply_remark,
};
