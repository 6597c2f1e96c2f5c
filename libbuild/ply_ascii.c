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
 */
#include "ply_int.h"

#include <inttypes.h>
#include <string.h>

/* The window stands on what should have been: "a number", "a count of a list". */
static enum spc_status fail_value(const struct ply *ply, const char *should, struct spc_error *err)
{
    char shown[SPB_TEXT_SHOWN];

    spb_text_show(&ply->text, shown);
    return spb_ply_fail_row(ply, SPC_INPUT_FORMAT, spb_bytes_off(ply->bytes), err, "'%s' is not %s",
                            shown, should);
}

static inline enum spc_status take_real(struct ply *ply, double *out, struct spc_error *err)
{
    const enum spc_status status = spb_text_to_value(&ply->text, err);

    if (status != SPC_OK)
        return status;
    if (spb_text_ended(&ply->text))
        return spb_ply_fail_end(ply, true, err);
    return spb_text_real(&ply->text, out) ? SPC_OK : fail_value(ply, "a number", err);
}

enum spc_status spb_ply_ascii_items(struct ply *ply, const struct ply_property *property,
                                    size_t count, int64_t *items, struct spc_error *err)
{
    (void)property;
    for (size_t i = 0; i < count; i++) {
        const enum spc_status status = spb_text_to_value(&ply->text, err);
        if (status != SPC_OK)
            return status;
        if (spb_text_ended(&ply->text))
            return spb_ply_fail_end(ply, true, err);
        if (!spb_text_int(&ply->text, &items[i]))
            return fail_value(ply, "a vertex number", err);
    }
    return SPC_OK;
}

enum spc_status spb_ply_ascii_list_count(struct ply *ply, const struct ply_property *property,
                                         uint64_t *count, struct spc_error *err)
{
    struct spb_bytes *const b = ply->bytes;
    const enum spc_status status = spb_text_to_value(&ply->text, err);
    const size_t pos = b->pos;
    int64_t value;

    (void)property;
    if (status != SPC_OK)
        return status;
    if (spb_text_ended(&ply->text))
        return spb_ply_fail_end(ply, true, err);
    if (!spb_text_int(&ply->text, &value))
        return fail_value(ply, "a count of a list", err);
    if (value < 0) {                            /* SPB_NOT_WHOLE too */
        b->pos = pos;
        return fail_value(ply, "a count of a list", err);
    }
    *count = (uint64_t)value;
    if (*count > b->file_bytes / 2)
        return spb_ply_fail_list(ply, b->buf_off + pos, *count, err);
    return SPC_OK;
}

static enum spc_status pass_value(struct ply *ply, struct spc_error *err)
{
    const enum spc_status status = spb_text_to_value(&ply->text, err);

    if (status != SPC_OK)
        return status;
    if (spb_text_ended(&ply->text))
        return spb_ply_fail_end(ply, true, err);
    return spb_text_pass_value(&ply->text, err);
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

static bool starts_comment(const uint8_t *p)
{
    const char *const word = *p == 'c' ? "comment" : "obj_info";
    const size_t length = strlen(word);
    return strncmp((const char *)p, word, length) == 0 && (spb_is_blank(p[length]) || !p[length]);
}

enum spc_status spb_ply_ascii_row_begin(struct ply *ply, struct spc_error *err)
{
    for (;;) {
        enum spc_status status = spb_text_to_value(&ply->text, err);
        if (status != SPC_OK)
            return status;
        if (spb_text_ended(&ply->text))
            return spb_ply_fail_end(ply, false, err);
        const uint8_t *const p = spb_text_at(&ply->text);
        if ((*p != 'c' && *p != 'o') || !starts_comment(p))
            break;
        bool spare = false;
        status = spb_text_pass_line(&ply->text, &spare, err);
        if (status != SPC_OK)
            return status;
    }
    ply->text.wrapped = false;
    ply->row_off = spb_bytes_off(ply->bytes);
    return SPC_OK;
}

enum spc_status spb_ply_ascii_row_end(struct ply *ply, struct spc_error *err)
{
    bool spare = false;
    const enum spc_status status = spb_text_pass_line(&ply->text, &spare, err);

    if (status == SPC_OK && spare && ply->text.wrapped)
        return spb_ply_fail_row(ply, SPC_INPUT_FORMAT, ply->row_off, err,
                                "its line holds too few values");
    ply->element->rows_spare += spare;
    ply->element->rows_wrapped += ply->text.wrapped;
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
    const enum spc_status status = spb_text_to_value(&ply->text, err);
    ply->bytes_spare = spb_bytes_rest(ply->bytes);
    return status;
}
