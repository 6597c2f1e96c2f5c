/*
 * Text bodies. A row is a line, and yet:
 *
 * - A row that has read its last declared value passes over what is left of its line. Files exist
 *   whose rows carry a list more than the header says; a reader that only counts values derails.
 * - A row whose line ends too early goes on in the next line: some writers wrap long polygons.
 * - Blank lines, and lines of comment or obj_info, may stand before any row.
 *
 * A row that does both, going on in the next line and leaving a part of it, is no wrapped row but
 * one with a value missing, which would take its neighbour's: it is refused. Otherwise both kinds
 * are counted and remarked, because a header that is wrong shows there first.
 *
 * The declared type of a value is not enforced. Writers put 2283 in a list counted in uchar, and
 * vertex numbers as 12.0; what the text says is clear, and taken. Values that are passed over need
 * not be numbers. Coordinates keep all digits of the text even where the header says float.
 *
 * Speed: a value is taken straight from the window, which is made to hold all of it beforehand;
 * the zero behind the window stops every loop.
 */
#include "ply_int.h"

#include <inttypes.h>
#include <string.h>

#include "number.h"

enum {
    VALUE_MAX = SPB_NUMBER_MAX + 64,    /* sign, point and exponent included */
    SHOWN_MAX = 24                      /* characters of a bad value in a message */
};

static inline bool is_blank(uint8_t c)
{
    return c == ' ' || (unsigned)(c - '\t') < 5u;
}

static inline bool is_line_end(uint8_t c)
{
    return c == '\n' || c == '\r';
}

/*
 * Moves to the next value, over blanks and line ends. Afterwards a value of up to VALUE_MAX
 * characters is whole in the window; at the end of the file the window is empty.
 */
static inline enum spc_status to_value(struct ply *ply, struct spc_error *err)
{
    struct spb_bytes *const b = ply->bytes;
    for (;;) {
        const uint8_t *p = b->buf + b->pos;
        for (; is_blank(*p); p++)
            ply->wrapped |= is_line_end(*p);
        b->pos = (size_t)(p - b->buf);
        if (spb_bytes_have(b) > VALUE_MAX || spb_bytes_last(b))
            return SPC_OK;
        const enum spc_status status = spb_bytes_fill(b, VALUE_MAX + 1, err);
        if (status != SPC_OK)
            return status;
    }
}

/* The window stands on what should have been: "a number", "a count of a list". */
static enum spc_status fail_value(const struct ply *ply, const char *should, struct spc_error *err)
{
    const struct spb_bytes *const b = ply->bytes;
    const uint8_t *const value = b->buf + b->pos;
    char shown[SHOWN_MAX + 4];
    size_t length = 0;

    while (length < SHOWN_MAX && length < spb_bytes_have(b) && !is_blank(value[length])) {
        const uint8_t c = value[length];
        shown[length++] = c > ' ' && c < 127 ? (char)c : '?';
    }
    const bool more = length < spb_bytes_have(b) && !is_blank(value[length]);
    memcpy(shown + length, more ? "..." : "", more ? 4 : 1);
    return spb_ply_fail_row(ply, SPC_INPUT_FORMAT, spb_bytes_off(b), err, "'%s' is not %s", shown,
                            should);
}

/* A value may end at a blank or at the end of the file, not in the middle of a word. */
static inline bool value_ends(const struct spb_bytes *b, const uint8_t *p)
{
    return is_blank(*p) || (p == b->buf + b->end && spb_bytes_last(b));
}

static inline enum spc_status take_real(struct ply *ply, double *out, struct spc_error *err)
{
    struct spb_bytes *const b = ply->bytes;
    const enum spc_status status = to_value(ply, err);

    if (status != SPC_OK)
        return status;
    if (spb_bytes_have(b) == 0)
        return spb_ply_fail_end(ply, true, err);
    const uint8_t *const p = spb_number_real(b->buf + b->pos, out);
    if (!p || !value_ends(b, p))
        return fail_value(ply, "a number", err);
    b->pos = (size_t)(p - b->buf);
    return SPC_OK;
}

enum spc_status spb_ply_ascii_items(struct ply *ply, const struct ply_property *property,
                                    size_t count, int64_t *items, struct spc_error *err)
{
    struct spb_bytes *const b = ply->bytes;

    (void)property;
    for (size_t i = 0; i < count; i++) {
        const enum spc_status status = to_value(ply, err);
        if (status != SPC_OK)
            return status;
        if (spb_bytes_have(b) == 0)
            return spb_ply_fail_end(ply, true, err);
        const uint8_t *const p = spb_number_int(b->buf + b->pos, &items[i]);
        if (!p || !value_ends(b, p))
            return fail_value(ply, "a vertex number", err);
        b->pos = (size_t)(p - b->buf);
    }
    return SPC_OK;
}

enum spc_status spb_ply_ascii_list_count(struct ply *ply, const struct ply_property *property,
                                         uint64_t *count, struct spc_error *err)
{
    struct spb_bytes *const b = ply->bytes;
    const enum spc_status status = to_value(ply, err);
    int64_t value;

    (void)property;
    if (status != SPC_OK)
        return status;
    if (spb_bytes_have(b) == 0)
        return spb_ply_fail_end(ply, true, err);
    const uint8_t *const p = spb_number_int(b->buf + b->pos, &value);
    if (!p || !value_ends(b, p) || value < 0)   /* SPB_NOT_WHOLE is negative too */
        return fail_value(ply, "a count of a list", err);
    *count = (uint64_t)value;
    if (*count > b->file_bytes / 2)
        return spb_ply_fail_list(ply, spb_bytes_off(b), *count, err);
    b->pos = (size_t)(p - b->buf);
    return SPC_OK;
}

/* Passes over one value of any length. */
static enum spc_status pass_value(struct ply *ply, struct spc_error *err)
{
    struct spb_bytes *const b = ply->bytes;
    enum spc_status status = to_value(ply, err);

    if (status == SPC_OK && spb_bytes_have(b) == 0)
        return spb_ply_fail_end(ply, true, err);
    while (status == SPC_OK) {
        while (b->pos < b->end && !is_blank(b->buf[b->pos]))
            b->pos++;
        if (b->pos < b->end || spb_bytes_last(b))
            break;
        status = spb_bytes_need(b, 1, err);
    }
    return status;
}

enum spc_status spb_ply_ascii_pass(struct ply *ply, const struct ply_property *property,
                                   struct spc_error *err)
{
    enum spc_status status = SPC_OK;
    uint64_t count = 1;

    if (property->count_type)
        status = spb_ply_ascii_list_count(ply, property, &count, err);
    for (uint64_t i = 0; i < count && status == SPC_OK; i++)
        status = pass_value(ply, err);
    return status;
}

/* Passes over the rest of the line and its end; the LF of a CR LF is left, as a blank line. */
static enum spc_status pass_line(struct ply *ply, bool *spare, struct spc_error *err)
{
    struct spb_bytes *const b = ply->bytes;
    for (;;) {
        const uint8_t *p = b->buf + b->pos;
        const uint8_t *const end = b->buf + b->end;
        for (; p < end && !is_line_end(*p); p++)
            *spare |= !is_blank(*p);
        b->pos = (size_t)(p - b->buf);
        if (p < end)
            b->pos++;
        if (p < end || spb_bytes_last(b))
            return SPC_OK;
        const enum spc_status status = spb_bytes_need(b, 1, err);
        if (status != SPC_OK)
            return status;
    }
}

static bool starts_comment(const uint8_t *p)
{
    const char *const word = *p == 'c' ? "comment" : "obj_info";
    const size_t length = strlen(word);
    return strncmp((const char *)p, word, length) == 0 && (is_blank(p[length]) || !p[length]);
}

enum spc_status spb_ply_ascii_row_begin(struct ply *ply, struct spc_error *err)
{
    struct spb_bytes *const b = ply->bytes;
    for (;;) {
        enum spc_status status = to_value(ply, err);
        if (status != SPC_OK)
            return status;
        if (spb_bytes_have(b) == 0)
            return spb_ply_fail_end(ply, false, err);
        const uint8_t *const p = b->buf + b->pos;
        if ((*p != 'c' && *p != 'o') || !starts_comment(p))
            break;
        bool spare = false;
        status = pass_line(ply, &spare, err);
        if (status != SPC_OK)
            return status;
    }
    ply->wrapped = false;
    ply->row_off = spb_bytes_off(b);
    return SPC_OK;
}

enum spc_status spb_ply_ascii_row_end(struct ply *ply, struct spc_error *err)
{
    bool spare = false;
    const enum spc_status status = pass_line(ply, &spare, err);

    if (status == SPC_OK && spare && ply->wrapped)
        return spb_ply_fail_row(ply, SPC_INPUT_FORMAT, ply->row_off, err,
                                "its line holds too few values");
    ply->element->rows_spare += spare;
    ply->element->rows_wrapped += ply->wrapped;
    return status;
}

enum spc_status spb_ply_ascii_vertices(struct ply *ply, struct spb_vertex_batch *out,
                                       struct spc_error *err)
{
    const struct ply_element *const e = ply->element;
    const struct ply_property *const properties = &ply->header.property[e->property_first];

    while (out->count < SPB_BATCH_MAX && ply->row < e->count) {
        double *const xyz = out->xyz[out->count];
        uint8_t *const rgba = out->rgba[out->count];
        enum spc_status status = spb_ply_ascii_row_begin(ply, err);
        rgba[3] = 255;
        for (uint32_t k = 0; k < e->property_count && status == SPC_OK; k++) {
            const struct ply_property *const p = &properties[k];
            double value = 0;
            if (p->role == PLY_NO_ROLE) {
                status = spb_ply_ascii_pass(ply, p, err);
                continue;
            }
            status = take_real(ply, &value, err);
            if (p->role <= PLY_Z)
                xyz[p->role] = value;
            else if (p->role >= PLY_NX)
                out->normal[out->count][p->role - PLY_NX] = (float)value;
            else
                rgba[p->role - PLY_RED] = spb_ply_color(ply, p->type, p->role, value);
        }
        if (status == SPC_OK)
            status = spb_ply_ascii_row_end(ply, err);
        if (status != SPC_OK)
            return status;
        ply->row++;
        out->count++;
    }
    return SPC_OK;
}

enum spc_status spb_ply_ascii_rest(struct ply *ply, struct spc_error *err)
{
    const enum spc_status status = to_value(ply, err);
    ply->bytes_spare = spb_bytes_rest(ply->bytes);
    return status;
}
