/*
 * OBJ has no mark. A file is one when it begins like one: with a vertex, a normal, a texture
 * coordinate or a face that has numbers behind it; or with nothing but lines of keywords, among
 * comments and blank lines; or with a comment that fills all that is seen, but no script's.
 */
#include "obj_int.h"

/* The word at p, short of end, is whole and is this one. */
static bool is_word(const uint8_t *p, const uint8_t *end, const char *word)
{
    const size_t length = strlen(word);
    return (size_t)(end - p) > length && memcmp(p, word, length) == 0 &&
           (obj_is_blank(p[length]) || p[length] == '\n' || p[length] == '\r');
}

static const uint8_t *pass_blanks(const uint8_t *p, const uint8_t *end)
{
    while (p < end && obj_is_blank(*p))
        p++;
    return p;
}

static bool is_number_start(const uint8_t *p, const uint8_t *end)
{
    p += p < end && (*p == '-' || *p == '+');
    p += p < end && *p == '.';
    return p < end && (unsigned)(*p - '0') < 10u;
}

static const char *const NUMBERED[] = {"v", "vn", "vt", "f", "fo"};     /* at least two numbers */
static const char *const NAMED[] = {"o", "g", "s", "mg", "vp", "usemtl", "mtllib", "l", "p", "cstype",
                                    "deg", "curv", "curv2", "surf", "lod", "usemap", "maplib"};

enum line_is { LINE_BLANK, LINE_KEYWORD, LINE_OBJ, LINE_STRANGE };

static enum line_is look(const uint8_t *p, const uint8_t *end)
{
    p = pass_blanks(p, end);
    if (p == end || *p == '\n' || *p == '\r' || *p == '#')
        return LINE_BLANK;
    for (size_t i = 0; i < sizeof NUMBERED / sizeof *NUMBERED; i++) {
        if (!is_word(p, end, NUMBERED[i]))
            continue;
        p = pass_blanks(p + strlen(NUMBERED[i]), end);
        if (!is_number_start(p, end))
            return LINE_STRANGE;
        while (p < end && !obj_is_blank(*p) && *p != '\n' && *p != '\r')
            p++;
        return is_number_start(pass_blanks(p, end), end) ? LINE_OBJ : LINE_KEYWORD;
    }
    for (size_t i = 0; i < sizeof NAMED / sizeof *NAMED; i++)
        if (is_word(p, end, NAMED[i]))
            return LINE_KEYWORD;
    return LINE_STRANGE;
}

bool spb_obj_sniff(const uint8_t *head, size_t head_bytes, uint64_t file_bytes)
{
    const uint8_t *p = head, *const end = head + head_bytes;
    const bool whole = file_bytes <= head_bytes;
    size_t of[LINE_STRANGE + 1] = {0};

    if (head_bytes >= 3 && memcmp(p, "\xef\xbb\xbf", 3) == 0)
        p += 3;
    if (memchr(p, 0, (size_t)(end - p)) || (end - p >= 2 && memcmp(p, "#!", 2) == 0))
        return false;
    while (p < end) {
        const uint8_t *q = p;
        while (q < end && *q != '\n' && *q != '\r')
            q++;
        /* A line that the head cuts is looked at only where it has to speak for all. */
        if (q < end || whole || of[LINE_KEYWORD] + of[LINE_STRANGE] == 0)
            of[look(p, q < end ? q + 1 : end)]++;
        if (of[LINE_OBJ] > 0)
            return true;
        p = q < end ? q + 1 : end;
    }
    return of[LINE_STRANGE] == 0 && !whole;
}
