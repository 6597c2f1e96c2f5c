/*
 * Keyword and counts.
 *
 * The keyword is [ST][C][N][4][n]OFF: texture, colours, normals, which some write in another
 * order; four or n dimensions, which are refused. Counts may follow on its line. The edges' count
 * is ignored, and may be missing if the other two are on one line. Comments run from # to the end
 * of a line, anywhere.
 *
 * Geomview also reads files without keyword. A file that begins with two counts and a zero, has
 * room for as many rows, and goes on with a line of three numbers is taken for one.
 *
 * A row takes a least number of bytes, so counts that the file cannot hold are refused here.
 */
#include "off_int.h"

#include <inttypes.h>
#include <string.h>

#include "bytes.h"

enum { VERTEX_BYTES = 6, FACE_BYTES = 2 };      /* "0 0 0\n", "0\n" */

enum off_word spb_off_keyword(const uint8_t *p, const uint8_t *end, struct off_kind *kind,
                              size_t *length)
{
    const uint8_t *const begin = p;
    bool higher = false;

    *kind = (struct off_kind){ .normals = false };
    for (; p < end && (*p == 'C' || *p == 'N' || *p == 'S'); p++) {
        kind->colors = kind->colors || *p == 'C';
        kind->normals = kind->normals || *p == 'N';
        if (*p == 'S' && (end - p < 2 || *++p != 'T'))
            return OFF_NONE;
        kind->texture = kind->texture || *p == 'T';
    }
    for (; p < end && (*p == '4' || *p == 'n'); p++)
        higher = true;
    if (end - p < 3 || (p[0] | 32) != 'o' || (p[1] | 32) != 'f' || (p[2] | 32) != 'f')
        return OFF_NONE;
    p += 3;
    if (p < end && !spb_is_blank(*p) && *p != '#')
        return OFF_NONE;
    *length = (size_t)(p - begin);
    return higher ? OFF_HIGHER : OFF_KEYWORD;
}

/* ---- sniffing ------------------------------------------------------------------------------- */

static const uint8_t *pass_blanks_and_comments(const uint8_t *p, const uint8_t *end)
{
    while (p < end && (spb_is_blank(*p) || *p == '#')) {
        if (*p == '#')
            while (p < end && !spb_is_line_end(*p))
                p++;
        else
            p++;
    }
    return p;
}

/* The numbers of the line at *p: *count of them, the first three in value; false: something else. */
static bool line_of_numbers(const uint8_t **at, const uint8_t *end, double value[3], int *count)
{
    const uint8_t *p = *at;

    for (*count = 0;;) {
        double v;
        while (p < end && spb_is_blank(*p) && !spb_is_line_end(*p))
            p++;
        if (p == end || spb_is_line_end(*p))
            break;
        p = spb_number_real(p, &v);
        if (!p || p >= end || !spb_is_blank(*p))
            return false;
        if (*count < 3)
            value[*count] = v;
        ++*count;
    }
    *at = p;
    return p < end;
}

/* head is as long as it is said, without a zero behind it: so p must be a copy. */
static bool bare_counts(const uint8_t *p, const uint8_t *end, uint64_t file_bytes)
{
    double value[3];
    int count;

    if (!line_of_numbers(&p, end, value, &count) || count != 3)
        return false;
    if (!(value[0] >= 3 && value[0] < 1e15 && value[1] >= 1 && value[1] < 1e15 && value[2] == 0) ||
        value[0] != (double)(uint64_t)value[0] || value[1] != (double)(uint64_t)value[1])
        return false;
    if (value[0] * VERTEX_BYTES + value[1] * FACE_BYTES > (double)file_bytes)
        return false;
    p = pass_blanks_and_comments(p, end);
    return line_of_numbers(&p, end, value, &count) && count == 3;
}

bool spb_off_sniff(const uint8_t *head, size_t head_bytes, uint64_t file_bytes)
{
    enum { COPY_BYTES = 512 };
    uint8_t copy[COPY_BYTES + 1];
    struct off_kind kind;
    size_t length;

    if (head_bytes > COPY_BYTES)
        head_bytes = COPY_BYTES;
    memcpy(copy, head, head_bytes);
    copy[head_bytes] = 0;
    const uint8_t *const end = copy + head_bytes, *p = copy;
    if (head_bytes >= 3 && memcmp(p, "\xef\xbb\xbf", 3) == 0)
        p += 3;
    p = pass_blanks_and_comments(p, end);
    return spb_off_keyword(p, end, &kind, &length) != OFF_NONE || bare_counts(p, end, file_bytes);
}

/* ---- reading -------------------------------------------------------------------------------- */

static enum spc_status read_keyword(struct off *off, struct spc_error *err)
{
    struct spb_bytes *const b = off->text.bytes;
    struct off_kind kind;
    size_t length;
    bool more;

    switch (spb_off_keyword(b->buf + b->pos, b->buf + b->end, &kind, &length)) {
    case OFF_HIGHER:
        return spc_fail(err, SPC_INPUT_FORMAT, spb_bytes_off(b),
                        "OFF of four or more dimensions cannot be read, only of three");
    case OFF_KEYWORD:
        break;
    default:
        return SPC_OK;                          /* counts at once */
    }
    off->kind = kind;
    b->pos += length;
    const enum spc_status status = spb_text_to_value_in_line(&off->text, &more, err);
    if (status == SPC_OK && more && spb_text_word(&off->text, "binary"))
        return spc_fail(err, SPC_INPUT_FORMAT, spb_bytes_off(b),
                        "binary OFF cannot be read: save it as text");
    return status;
}

static enum spc_status read_count(struct off *off, const char *of, uint64_t *out,
                                  struct spc_error *err)
{
    const enum spc_status status = off_to_value(off, err);
    const struct spb_bytes *const b = off->text.bytes;
    const uint64_t at_off = spb_bytes_off(b);
    char shown[SPB_TEXT_SHOWN];
    int64_t value;

    if (status != SPC_OK)
        return status;
    if (spb_text_ended(&off->text))
        return spc_fail(err, SPC_INPUT_TRUNCATED, b->file_bytes,
                        "the file ends before the count of %s", of);
    spb_text_show(&off->text, shown);
    if (!spb_text_int(&off->text, &value) || value < 0)     /* SPB_NOT_WHOLE too */
        return spc_fail(err, SPC_INPUT_FORMAT, at_off, "'%s' is not a count of %s", shown, of);
    *out = (uint64_t)value;
    return SPC_OK;
}

static enum spc_status read_counts(struct off *off, struct spc_error *err)
{
    enum spc_status status = read_count(off, "vertices", &off->vertex_count, err);
    uint64_t edges;
    bool more = true;

    off->text.wrapped = false;
    if (status == SPC_OK)
        status = read_count(off, "faces", &off->face_count, err);
    if (status == SPC_OK && !off->text.wrapped)
        status = spb_text_to_value_in_line(&off->text, &more, err);
    if (status == SPC_OK && more)
        status = read_count(off, "edges", &edges, err);
    return status;
}

enum spc_status spb_off_header_read(struct off *off, struct spc_error *err)
{
    struct spb_bytes *const b = off->text.bytes;
    enum spc_status status = spb_bytes_need(b, 3, err);
    uint64_t vertex_bytes, face_bytes;

    if (status == SPC_OK && spb_bytes_have(b) >= 3 && memcmp(b->buf + b->pos, "\xef\xbb\xbf", 3) == 0)
        b->pos += 3;
    if (status == SPC_OK)
        status = off_to_value(off, err);
    if (status == SPC_OK)
        status = read_keyword(off, err);
    if (status == SPC_OK)
        status = read_counts(off, err);
    if (status != SPC_OK)
        return status;
    const uint64_t left = spb_bytes_rest(b) + 1;        /* the last line may lack its end */
    if (!mul_ok(off->vertex_count, VERTEX_BYTES, &vertex_bytes) ||
        !mul_ok(off->face_count, FACE_BYTES, &face_bytes) || vertex_bytes > left ||
        face_bytes > left - vertex_bytes)
        return spc_fail(err, SPC_INPUT_TRUNCATED, b->file_bytes,
                        "%" PRIu64 " vertices and %" PRIu64 " faces are promised, but only %" PRIu64
                        " bytes are there", off->vertex_count, off->face_count, left - 1);
    off->vertex_off = off->face_off = spb_bytes_off(b);
    return SPC_OK;
}
