/*
 * Lines and words of an OBJ file.
 *
 * A line ends at LF, CR or CR LF, whichever the file mixes. A backslash right before a line end
 * continues the line in the next, between any two words. A '#' that begins a word starts a comment,
 * which ends with its own line: one that names a Windows folder ends in a backslash and still
 * swallows nothing. The same goes for names with a '#' in them.
 *
 * Nothing is ever kept of a line but its part in the window, so lines may have any length. A word
 * that must be understood is whole in the window; longer ones than OBJ_WORD_MAX are no numbers.
 */
#include "obj_int.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>

enum { RANGE_GAP = 64 * 1024 };     /* reading over less costs no more than a seek */

enum spc_status spb_obj_fill(struct obj_text *t, size_t want, struct spc_error *err)
{
    if (spb_progress_tell(t->progress, "count", spb_bytes_off(t->bytes), t->bytes->file_bytes))
        return spc_fail(err, SPC_CANCELLED, SPC_NO_OFF, "cancelled");
    return spb_bytes_fill(t->bytes, want, err);
}

/* ---- ranges ----------------------------------------------------------------------------------- */

static void merge(struct obj_ranges *r)
{
    uint32_t kept = 0;
    for (uint32_t i = 1; i < r->count; i++) {
        if (r->list[i].off - r->list[kept].end <= r->gap)
            r->list[kept].end = r->list[i].end;
        else
            r->list[++kept] = r->list[i];
    }
    r->count = kept + 1;
}

void spb_obj_note(struct obj_ranges *r, const struct obj_range *line)
{
    if (r->gap == 0)
        r->gap = RANGE_GAP;
    if (r->count > 0 && line->off - r->list[r->count - 1].end <= r->gap) {
        r->list[r->count - 1].end = line->end;
        return;
    }
    while (r->count == OBJ_RANGES_MAX) {
        r->gap *= 2;
        merge(r);
    }
    r->list[r->count++] = *line;
}

/* ---- line ends -------------------------------------------------------------------------------- */

/* A byte of v is zero. */
static inline bool has_zero(uint64_t v)
{
    return ((v - UINT64_C(0x0101010101010101)) & ~v & UINT64_C(0x8080808080808080)) != 0;
}

/* The first CR or LF in [p, end), or end: one look for both, where memchr would take two. */
static const uint8_t *find_line_end(const uint8_t *p, const uint8_t *end)
{
    for (; end - p >= 8; p += 8) {
        uint64_t v;
        memcpy(&v, p, sizeof v);
        if (has_zero(v ^ UINT64_C(0x0a0a0a0a0a0a0a0a)) || has_zero(v ^ UINT64_C(0x0d0d0d0d0d0d0d0d)))
            break;
    }
    while (p < end && *p != '\n' && *p != '\r')
        p++;
    return p;
}

/* Steps over the CR, LF or CR LF at pos. */
static enum spc_status pass_end(struct obj_text *t, struct spc_error *err)
{
    struct spb_bytes *const b = t->bytes;
    const bool cr = b->buf[b->pos++] == '\r';
    enum spc_status status = SPC_OK;

    t->line++;
    if (cr && spb_bytes_have(b) == 0 && !spb_bytes_last(b))
        status = spb_obj_fill(t, 1, err);
    if (status == SPC_OK && cr && spb_bytes_have(b) > 0 && b->buf[b->pos] == '\n')
        b->pos++;
    return status;
}

enum spc_status spb_obj_pass_line(struct obj_text *t, struct spc_error *err)
{
    struct spb_bytes *const b = t->bytes;
    bool comment = false;
    uint8_t before = 0;                 /* the byte before pos, passed over in this call */
    for (;;) {
        const uint8_t *const p = b->buf + b->pos, *const end = b->buf + b->end;
        const uint8_t *const q = find_line_end(p, end);
        const size_t length = (size_t)(q - p);
        if (length > 0)
            before = q[-1];
        if (!comment && (q == end || before == '\\'))
            comment = memchr(p, '#', length) != NULL;
        b->pos += length;
        enum spc_status status;
        if (q < end) {
            status = pass_end(t, err);
            if (status != SPC_OK || before != '\\' || comment)
                return status;
            before = 0;
        } else if (spb_bytes_last(b)) {
            return SPC_OK;
        }
        status = spb_bytes_have(b) > 0 || spb_bytes_last(b) ? SPC_OK : spb_obj_fill(t, 1, err);
        if (status != SPC_OK)
            return status;
    }
}

bool spb_obj_continues(struct obj_text *t)
{
    struct spb_bytes *const b = t->bytes;
    const uint8_t *const p = b->buf + b->pos;           /* the zero behind the window is no end */

    if (p[1] != '\n' && p[1] != '\r')
        return false;
    b->pos += p[1] == '\r' && p[2] == '\n' ? 3 : 2;
    t->line++;
    return true;
}

enum spc_status spb_obj_name(struct obj_text *t, char name[MTL_NAME_MAX + 1], size_t *length,
                             struct spc_error *err)
{
    const struct spb_bytes *const b = t->bytes;
    bool more;
    const enum spc_status status = obj_to_word(t, &more, err);
    const uint8_t *const p = b->buf + b->pos;
    size_t n = 0;

    *length = 0;
    if (status != SPC_OK)
        return status;
    for (; n < MTL_NAME_MAX && p + n < b->buf + b->end && p[n] != '\n' && p[n] != '\r'; n++) {
        name[n] = (char)p[n];
        if (!obj_is_blank(p[n]))
            *length = n + 1;
    }
    name[*length] = 0;
    return SPC_OK;
}

/* ---- errors ----------------------------------------------------------------------------------- */

void spb_obj_show(const struct spb_bytes *b, const uint8_t *p, char shown[OBJ_SHOWN_MAX + 4])
{
    const uint8_t *const end = b->buf + b->end;
    size_t length = 0;

    while (length < OBJ_SHOWN_MAX && p < end && !obj_is_blank(*p) && *p != '\n' && *p != '\r') {
        shown[length++] = *p > ' ' && *p < 127 ? (char)*p : '?';
        p++;
    }
    const bool more = p < end && !obj_is_blank(*p) && *p != '\n' && *p != '\r';
    memcpy(shown + length, more ? "..." : "", more ? 4 : 1);
}

/*
 * Does the file end before the word does? A copy that broke off tells so, mostly. Whatever the window
 * holds: what is far from the end is not cut.
 */
static bool word_is_cut(struct spb_bytes *b)
{
    enum { NEAR = 64 };
    if (spb_bytes_rest(b) > NEAR || spb_bytes_need(b, NEAR, NULL) != SPC_OK)
        return false;
    const uint8_t *p = b->buf + b->pos;
    const uint8_t *const end = b->buf + b->end;
    while (p < end && !obj_is_blank(*p) && *p != '\n' && *p != '\r')
        p++;
    return p == end;
}

enum spc_status spb_obj_fail_line(const struct obj_text *t, struct spc_error *err,
                                  const char *fmt, ...)
{
    char text[120];
    va_list args;

    va_start(args, fmt);
    vsnprintf(text, sizeof text, fmt, args);
    va_end(args);
    const bool cut = word_is_cut(t->bytes);
    return spc_fail(err, cut ? SPC_INPUT_TRUNCATED : SPC_INPUT_FORMAT, spb_bytes_off(t->bytes),
                    "line %" PRIu64 ": %s%s", t->line, text, cut ? ", and the file ends" : "");
}

enum spc_status spb_obj_fail_word(const struct obj_text *t, const char *should,
                                  struct spc_error *err)
{
    char shown[OBJ_SHOWN_MAX + 4];
    spb_obj_show(t->bytes, t->bytes->buf + t->bytes->pos, shown);
    return spb_obj_fail_line(t, err, "'%s' is not %s", shown, should);
}
