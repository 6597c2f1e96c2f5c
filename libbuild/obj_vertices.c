/*
 * Vertices: v x y z, with a weight (of rational curves, ignored) or a colour behind.
 *
 * OBJ has no types: whether coordinates need double is for their text to say. They do when some
 * coordinate is not what a program that holds floats would have printed, with as many digits as
 * are there: when the float next to it lies further away than half a unit of the last digit. So
 * "0.1" and "123.456787" are floats, however many digits follow, and 447751.123 is none, for the
 * nearest floats are 0.03 apart there. Counting digits instead would take "%.9g" of floats for
 * doubles, and "%.3f" of map coordinates for floats.
 */
#include "obj_int.h"

#include <inttypes.h>
#include <math.h>

/* Half a unit of the last digit of the number in [p, end), in units of the number. */
static double half_digit(const uint8_t *p, const uint8_t *end)
{
    static const double pow10[23] = {
        1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
        1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22
    };
    bool point = false;
    int64_t power = 0, exponent = 0;

    for (; p < end && (*p | 32) != 'e'; p++) {
        power -= point;
        point |= *p == '.';
    }
    if (p < end && spb_number_int(p + 1, &exponent) && exponent > -10000 && exponent < 10000)
        power += exponent;
    double half = 0.5;
    for (; power < -22 && half > 0; power += 22)
        half /= 1e22;
    for (; power > 22 && half < HUGE_VAL; power -= 22)
        half *= 1e22;
    return power < -22 || power > 22 ? half : power < 0 ? half / pow10[-power] : half * pow10[power];
}

static bool is_float(const uint8_t *p, const uint8_t *end, double x)
{
    const double size = fabs(x), away = fabs((double)(float)x - x);
    if (!(away > 0) || !isfinite(x))
        return true;
    if (end - p <= 7 && size < 1e7 && size > 1e-6)
        return true;                    /* six digits and a point always are */
    /* Half a unit is what rounding takes at most, and often does; x itself has been rounded too. */
    return away <= half_digit(p, end) * 1.000001 + size * 0x1p-52;
}

static enum spc_status value_here(struct obj *o, double *value, bool *more, bool must,
                                  bool counting, struct spc_error *err)
{
    struct obj_text *const t = &o->text;
    struct spb_bytes *const b = t->bytes;
    const enum spc_status status = obj_to_word(t, more, err);

    if (status != SPC_OK || !*more)
        return status;
    const uint8_t *const word = b->buf + b->pos;
    const uint8_t *const p = spb_number_real(word, value);
    if (!p || !obj_word_ends(t, p)) {
        *more = false;
        return must ? spb_obj_fail_word(t, "a number", err) : SPC_OK;
    }
    if (counting && must && !o->wide)
        o->wide = !is_float(word, p, *value);
    b->pos = (size_t)(p - b->buf);
    return SPC_OK;
}

enum spc_status spb_obj_values(struct obj *o, double value[OBJ_VALUES_MAX], int *count,
                               bool counting, struct spc_error *err)
{
    const struct spb_bytes *const b = o->text.bytes;
    bool more = true;

    *count = 0;
    while (*count < OBJ_VALUES_MAX && (*count < 3 || b->buf[b->pos] != '\n')) {
        const enum spc_status status =
            value_here(o, &value[*count], &more, *count < 3, counting, err);
        if (status != SPC_OK)
            return status;
        if (!more)
            break;
        ++*count;
    }
    if (*count >= 3)
        return SPC_OK;
    return spb_obj_fail_line(&o->text, err, "a vertex with %d of 3 coordinates", *count);
}

static uint8_t color_byte(const struct obj *o, double value)
{
    if (!(value > 0))
        return 0;                       /* nan too */
    return value >= o->color_full ? 255 : (uint8_t)(value * 255 / o->color_full + 0.5);
}

static void put_vertex(const struct obj *o, const double value[OBJ_VALUES_MAX], int count,
                       double xyz[3], uint8_t rgba[4])
{
    memcpy(xyz, value, 3 * sizeof *xyz);
    memset(rgba, 255, 4);
    for (int k = 3; count >= 6 && k < count; k++)
        rgba[k - 3] = color_byte(o, value[k]);
}

enum spc_status spb_obj_vertices(struct obj *o, struct spb_vertex_batch *out, struct spc_error *err)
{
    const struct spb_bytes *const b = o->text.bytes;
    double value[OBJ_VALUES_MAX];
    int count;

    while (out->count < SPB_BATCH_MAX && o->row < o->vertex_count) {
        bool more;
        enum spc_status status = spb_obj_next_line(o, &more, err);
        if (status != SPC_OK)
            return status;
        if (!more)
            return spc_fail(err, SPC_INPUT_TRUNCATED, b->file_bytes,
                            "vertex %" PRIu64 " of %" PRIu64 " is missing: the file was changed",
                            o->row, o->vertex_count);
        if (spb_obj_keyword(&o->text, b->buf + b->pos) == OBJ_VERTEX) {
            o->text.bytes->pos++;
            status = spb_obj_values(o, value, &count, false, err);
            if (status != SPC_OK)
                return status;
            put_vertex(o, value, count, out->xyz[out->count], out->rgba[out->count]);
            out->count++;
            o->row++;
        }
        status = obj_end_line(&o->text, err);
        if (status != SPC_OK)
            return status;
    }
    return SPC_OK;
}
