#include "text.h"

#include <math.h>
#include <string.h>

/* Digits behind the point, less the exponent: the last digit stands for 10 to minus that. */
static int last_place(const uint8_t *p, const uint8_t *end)
{
    int places = 0, exponent = 0;
    bool fraction = false, negative = false;

    for (; p < end && (*p | 32) != 'e'; p++) {
        places += fraction;
        fraction = fraction || *p == '.';
    }
    if (p < end)
        p++;
    for (; p < end; p++) {
        negative = negative || *p == '-';
        if (*p >= '0' && *p <= '9' && exponent < 1000)
            exponent = exponent * 10 + (*p - '0');
    }
    return places - (negative ? -exponent : exponent);
}

bool spb_text_wider_than_float(const uint8_t *begin, const uint8_t *end, double value)
{
    static const double half_place[] = {
        0.5e0, 0.5e-1, 0.5e-2, 0.5e-3, 0.5e-4, 0.5e-5, 0.5e-6, 0.5e-7, 0.5e-8, 0.5e-9
    };
    enum { PLACES = sizeof half_place / sizeof *half_place };
    const double lost = fabs(value - (double)(float)value);

    if (!(lost > 0))
        return false;                   /* nan and inf too */
    if (isinf(lost))
        return true;
    const int places = last_place(begin, end);
    const double half = places >= 0 && places < PLACES ? half_place[places] : 0.5 * pow(10, -places);
    return lost > half + fabs(value) * 0x1p-52;     /* doubles are not exact either */
}

enum spc_status spb_text_pass_value(struct spb_text *text, struct spc_error *err)
{
    struct spb_bytes *const b = text->bytes;

    for (;;) {
        while (b->pos < b->end && !spb_is_blank(b->buf[b->pos]) && b->buf[b->pos] != text->comment)
            b->pos++;
        if (b->pos < b->end || spb_bytes_last(b))
            return SPC_OK;
        const enum spc_status status = spb_bytes_need(b, 1, err);
        if (status != SPC_OK)
            return status;
    }
}

enum spc_status spb_text_pass_line(struct spb_text *text, bool *spare, struct spc_error *err)
{
    struct spb_bytes *const b = text->bytes;
    for (;;) {
        const uint8_t *p = b->buf + b->pos;
        const uint8_t *const end = b->buf + b->end;
        for (; p < end && !spb_is_line_end(*p); p++)
            *spare |= !spb_is_blank(*p);
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

void spb_text_show(const struct spb_text *text, char shown[SPB_TEXT_SHOWN])
{
    const uint8_t *const value = spb_text_at(text);
    const size_t have = spb_bytes_have(text->bytes);
    size_t length = 0;

    while (length < SPB_TEXT_SHOWN - 4 && length < have && !spb_is_blank(value[length])) {
        const uint8_t c = value[length];
        shown[length++] = c > ' ' && c < 127 ? (char)c : '?';
    }
    const bool more = length < have && !spb_is_blank(value[length]);
    memcpy(shown + length, more ? "..." : "", more ? 4 : 1);
}
