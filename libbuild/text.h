/*
 * text.h - values from the text of a scan: what the readers of ascii formats share.
 *
 * A value is what stands between blanks, line ends among them. It is taken straight from the
 * window, which is made to hold all of it beforehand; the zero behind the window stops every loop.
 */
#ifndef SPB_TEXT_H
#define SPB_TEXT_H

#include "bytesource.h"
#include "number.h"

enum {
    SPB_TEXT_VALUE_MAX = SPB_NUMBER_MAX + 64,   /* sign, point and exponent included */
    SPB_TEXT_SHOWN = 28                         /* of a bad value in a message, with its zero */
};

struct spb_text {
    struct spb_bytes *bytes;
    uint8_t comment;                    /* also ends a value: '#', or a blank where none does */
    bool wrapped;                       /* a line end has been passed over; the caller clears it */
};

static inline bool spb_is_blank(uint8_t c)
{
    return c == ' ' || (unsigned)(c - '\t') < 5u;
}

static inline bool spb_is_line_end(uint8_t c)
{
    return c == '\n' || c == '\r';
}

static inline const uint8_t *spb_text_at(const struct spb_text *text)
{
    return text->bytes->buf + text->bytes->pos;
}

/* After spb_text_to_value: there is none, the file has ended. */
static inline bool spb_text_ended(const struct spb_text *text)
{
    return spb_bytes_have(text->bytes) == 0;
}

/*
 * Moves to the next value, over blanks and line ends. Afterwards a value of up to
 * SPB_TEXT_VALUE_MAX characters is whole in the window; at the end of the file the window is
 * empty. fails SPC_IO
 */
static inline enum spc_status spb_text_to_value(struct spb_text *text, struct spc_error *err)
{
    struct spb_bytes *const b = text->bytes;
    for (;;) {
        const uint8_t *p = b->buf + b->pos;
        for (; spb_is_blank(*p); p++)
            text->wrapped |= spb_is_line_end(*p);
        b->pos = (size_t)(p - b->buf);
        if (spb_bytes_have(b) > SPB_TEXT_VALUE_MAX || spb_bytes_last(b))
            return SPC_OK;
        const enum spc_status status = spb_bytes_fill(b, SPB_TEXT_VALUE_MAX + 1, err);
        if (status != SPC_OK)
            return status;
    }
}

/*
 * The same within the line: *more is false, and nothing moved over, at its end, at a comment or at
 * the end of the file. fails SPC_IO
 */
static inline enum spc_status spb_text_to_value_in_line(struct spb_text *text, bool *more,
                                                        struct spc_error *err)
{
    struct spb_bytes *const b = text->bytes;
    for (;;) {
        const uint8_t *p = b->buf + b->pos;
        while (spb_is_blank(*p) && !spb_is_line_end(*p))
            p++;
        b->pos = (size_t)(p - b->buf);
        if (spb_bytes_have(b) > SPB_TEXT_VALUE_MAX || spb_bytes_last(b))
            break;
        const enum spc_status status = spb_bytes_fill(b, SPB_TEXT_VALUE_MAX + 1, err);
        if (status != SPC_OK)
            return status;
    }
    const uint8_t next = b->buf[b->pos];
    *more = spb_bytes_have(b) > 0 && !spb_is_line_end(next) && next != text->comment;
    return SPC_OK;
}

/* A value may end at p: at a blank, a comment or the end of the file, not in the middle of a word. */
static inline bool spb_text_ends(const struct spb_text *text, const uint8_t *p)
{
    const struct spb_bytes *const b = text->bytes;
    return spb_is_blank(*p) || *p == text->comment || (p == b->buf + b->end && spb_bytes_last(b));
}

/* Take the value that spb_text_to_value has moved to; false, and it stays, if it is no number. */
static inline bool spb_text_real(struct spb_text *text, double *out)
{
    const uint8_t *const p = spb_number_real(spb_text_at(text), out);
    if (!p || !spb_text_ends(text, p))
        return false;
    text->bytes->pos = (size_t)(p - text->bytes->buf);
    return true;
}

static inline bool spb_text_int(struct spb_text *text, int64_t *out)
{
    const uint8_t *const p = spb_number_int(spb_text_at(text), out);
    if (!p || !spb_text_ends(text, p))
        return false;
    text->bytes->pos = (size_t)(p - text->bytes->buf);
    return true;
}

/*
 * Is the value moved to just this word, in lower case, whatever case the file has? Takes it if so.
 */
static inline bool spb_text_word(struct spb_text *text, const char *word)
{
    const uint8_t *p = spb_text_at(text);
    for (; *word; word++, p++)
        if ((*p | 32) != *word)
            return false;
    if (!spb_text_ends(text, p))
        return false;
    text->bytes->pos = (size_t)(p - text->bytes->buf);
    return true;
}

/*
 * value has been read from [begin, end): would a float, printed with as many digits as stand
 * there, read otherwise? So text tells whether it was written from float or double.
 */
bool spb_text_wider_than_float(const uint8_t *begin, const uint8_t *end, double value);

/* Passes over the value moved to, of any length. fails SPC_IO */
enum spc_status spb_text_pass_value(struct spb_text *text, struct spc_error *err);

/*
 * Passes over the rest of the line and its end; the LF of a CR LF is left, as a blank line.
 * *spare |= something but blanks was there. fails SPC_IO
 */
enum spc_status spb_text_pass_line(struct spb_text *text, bool *spare, struct spc_error *err);

/* The value moved to, printable and cut to length, for a message. */
void spb_text_show(const struct spb_text *text, char shown[SPB_TEXT_SHOWN]);

#endif
