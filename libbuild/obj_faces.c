/*
 * Faces: f v, f v/vt, f v//vn or f v/vt/vn for each corner, with numbers from 1, or from -1
 * backwards from the last vertex before the line; so a pass counts the v lines among the faces.
 *
 * A polygon becomes a fan of its first corner; it is read corner by corner, so that it may have
 * any number of them and go on in the next batch. "1//" is read as 1, for some programs leave the
 * slashes where nothing follows; "1/" is torn.
 */
#include "obj_int.h"

#include <inttypes.h>

/* An index as the file says it; 0, which names nothing, where it fits no 64 bits. */
static const uint8_t *take_index(const uint8_t *p, int64_t *out)
{
    const bool negative = *p == '-';
    const uint8_t *const first = p += negative;
    uint64_t value = 0;

    for (; (unsigned)(*p - '0') < 10u; p++)
        value = value * 10 + (uint64_t)(*p - '0');
    *out = p - first > 18 ? 0 : negative ? -(int64_t)value : (int64_t)value;
    return p > first ? p : NULL;
}

/* The three numbers of a corner; of those not there 0. NULL: no corner. */
static const uint8_t *take_corner(const struct obj_text *t, const uint8_t *p, int64_t index[3])
{
    index[1] = index[2] = 0;
    p = take_index(p, &index[0]);
    if (!p || *p != '/')
        return p;
    if (p[1] == '/') {
        if (obj_word_ends(t, p + 2))
            return p + 2 == t->bytes->buf + t->bytes->end ? NULL : p + 2;
        return take_index(p + 2, &index[2]);
    }
    p = take_index(p + 1, &index[1]);
    return p && *p == '/' ? take_index(p + 1, &index[2]) : p;
}

/* What an index names, counted from 0, where before of its kind come before the line. */
static uint64_t number_of(int64_t index, uint64_t before)
{
    if (index > 0)
        return (uint64_t)index - 1;
    if (index == 0 || (uint64_t)-index > before)
        return SPB_BAD_INDEX;
    return before - (uint64_t)-index;
}

static enum spc_status add_corner(struct obj *o, const int64_t index[3], struct spb_face_batch *out,
                                  struct spc_error *err)
{
    const uint64_t corner = number_of(index[0], o->vertices_before);
    const uint64_t uv[3] = {o->first_uv, o->last_uv, number_of(index[1], o->uvs_before)};
    enum spc_status status = SPC_OK;

    if (o->run >= 2) {
        uint64_t *const triangle = out->corner[out->count];
        triangle[0] = o->first;
        triangle[1] = o->last;
        triangle[2] = corner;
        if (o->paint)
            status = spb_obj_paint_triangle(o, uv, out->rgba[out->count], err);
        out->count++;
        out->faces_in += o->run == 2;
        out->split_extra += o->run > 2;
    }
    if (o->run == 0) {
        o->first = corner;
        o->first_uv = uv[2];
    }
    o->last = corner;
    o->last_uv = uv[2];
    o->run++;
    return status;
}

/* Reads on in the face, no further than the batch has room; passes its line at its end. */
static enum spc_status read_face(struct obj *o, struct spb_face_batch *out, struct spc_error *err)
{
    struct obj_text *const t = &o->text;
    struct spb_bytes *const b = t->bytes;
    int64_t index[3];
    bool more;

    while (out->count < SPB_BATCH_MAX) {
        enum spc_status status = obj_to_word(t, &more, err);
        if (status != SPC_OK)
            return status;
        if (!more)
            break;
        const uint8_t *const p = take_corner(t, b->buf + b->pos, index);
        if (!p || !obj_word_ends(t, p))
            return spb_obj_fail_word(t, "a corner of a face", err);
        b->pos = (size_t)(p - b->buf);
        status = add_corner(o, index, out, err);
        if (status != SPC_OK)
            return status;
    }
    if (out->count == SPB_BATCH_MAX)
        return SPC_OK;
    out->faces_in += o->run < 3;
    out->faces_short += o->run < 3;
    o->in_face = false;
    o->row++;
    return obj_end_line(t, err);
}

/* To the next face: pos stands behind its keyword. */
static enum spc_status to_face(struct obj *o, bool *more, struct spc_error *err)
{
    const struct spb_bytes *const b = o->text.bytes;
    for (;;) {
        enum spc_status status = spb_obj_next_line(o, more, err);
        if (status != SPC_OK || !*more)
            return status;
        const enum obj_keyword keyword = spb_obj_keyword(&o->text, b->buf + b->pos);
        if (keyword == OBJ_FACE) {
            o->text.bytes->pos += b->buf[b->pos + 1] == 'o' ? 2 : 1;
            o->in_face = true;
            o->run = 0;
            return SPC_OK;
        }
        o->vertices_before += keyword == OBJ_VERTEX;
        o->uvs_before += keyword == OBJ_UV;
        if (keyword == OBJ_MATERIAL && o->paint)
            status = spb_obj_paint_use(o, err);
        if (status == SPC_OK)
            status = spb_obj_pass_line(&o->text, err);
        if (status != SPC_OK)
            return status;
    }
}

enum spc_status spb_obj_faces(struct obj *o, struct spb_face_batch *out, struct spc_error *err)
{
    enum spc_status status = SPC_OK;
    bool more = true;

    while (out->count < SPB_BATCH_MAX && status == SPC_OK) {
        if (!o->in_face)
            status = to_face(o, &more, err);
        if (status == SPC_OK && !more)
            break;
        if (status == SPC_OK)
            status = read_face(o, out, err);
    }
    if (status == SPC_OK && !more && o->row != o->face_count)
        return spc_fail(err, SPC_INPUT_TRUNCATED, o->text.bytes->file_bytes,
                        "%" PRIu64 " faces were counted, now there are %" PRIu64
                        ": the file was changed", o->face_count, o->row);
    return status;
}
