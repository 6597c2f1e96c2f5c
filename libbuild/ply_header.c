/*
 * The header of a PLY file, as found rather than as specified.
 *
 * Line ends. Files come with LF, CRLF and CR, and with mixtures. Every CR, LF or CR LF ends a line;
 * the one doubtful case is CR LF behind end_header, where the LF may be the first byte of binary
 * data. It is taken for data when most lines before it ended in a CR alone.
 *
 * Lines. Lines that begin with no keyword (ZBrush and others leave some, "bye" is a known one) are
 * passed over and remarked: if such a line was a mangled property, the sizes will not add up and
 * the remark tells why. Empty lines are passed over. An element named twice is refused when we
 * would have to choose: vertex, face (or faces), tristrips. Of a property named twice the first
 * counts.
 *
 * Types. The eight types, by both names. Anything else (int64, say) has no size that writers agree
 * on, so it is refused, in text bodies too.
 *
 * Colours. red green blue [alpha], else diffuse_red ... [diffuse_alpha], else r g b [a]; the first
 * complete set counts. A plain 'alpha' also serves the other two. Fewer than three: no colour.
 *
 * Normals. nx ny nz, else normal_x normal_y normal_z, of points without faces; of a mesh they are passed
 * over like any other property, faces have their own.
 *
 * Truth. Each row takes a least number of bytes, so counts that cannot fit the file are refused
 * here, before anybody makes room for them.
 */
#include "ply_int.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { WORDS_MAX = 6 };                 /* 'property list uchar int vertex_indices' and one spare */

enum vertex_name {                      /* in the order of vertex_names[] */
    NAME_X, NAME_Y, NAME_Z,
    NAME_RED, NAME_ALPHA = NAME_RED + 3,
    NAME_DIFFUSE,
    NAME_R = NAME_DIFFUSE + 4,
    NAME_NX = NAME_R + 4,
    NAME_NORMAL = NAME_NX + 3,
    NAME_COUNT = NAME_NORMAL + 3
};

static const char *const vertex_names[NAME_COUNT] = {
    "x", "y", "z", "red", "green", "blue", "alpha",
    "diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha", "r", "g", "b", "a",
    "nx", "ny", "nz", "normal_x", "normal_y", "normal_z"
};

struct header_reader {
    struct spb_bytes *bytes;
    struct ply_header *header;
    uint32_t vertex_property[NAME_COUNT];   /* 1 + number of the property of that name; 0: none */

    char line[PLY_LINE_MAX + 1];
    size_t length;
    bool cut;                           /* the line was longer */
    uint64_t number, line_off;
    uint64_t cr_lines, other_lines;

    char *word[WORDS_MAX];              /* into line, which they cut up */
    size_t word_count;
};

static enum spc_status fail_line(const struct header_reader *r, enum spc_status status,
                                 struct spc_error *err, const char *fmt, ...)
    __attribute__((format(printf, 4, 5)));

static enum spc_status fail_line(const struct header_reader *r, enum spc_status status,
                                 struct spc_error *err, const char *fmt, ...)
{
    char text[160];
    va_list args;

    va_start(args, fmt);
    vsnprintf(text, sizeof text, fmt, args);
    va_end(args);
    return spc_fail(err, status, r->line_off, "header line %" PRIu64 ": %s", r->number, text);
}

/* Copies what fits of a word from the file, with '?' for bytes that no message should carry. */
static void copy_printable(char *out, const char *word)
{
    size_t length = 0;
    for (; word[length] && length < PLY_NAME_MAX; length++)
        out[length] = word[length] > ' ' && word[length] < 127 ? word[length] : '?';
    out[length] = 0;
}

/* ---- lines ---------------------------------------------------------------------------------- */

static bool is_end_header(const struct header_reader *r)
{
    static const char word[] = "end_header";
    const size_t length = sizeof word - 1;
    const char *p = r->line;

    while (*p == ' ' || *p == '\t')
        p++;
    return strncmp(p, word, length) == 0 &&
           (p[length] == 0 || p[length] == ' ' || p[length] == '\t');
}

/* The byte just passed ended a line. */
static enum spc_status pass_line_end(struct header_reader *r, bool is_cr, struct spc_error *err)
{
    struct spb_bytes *const b = r->bytes;
    const enum spc_status status = is_cr ? spb_bytes_need(b, 1, err) : SPC_OK;

    if (status != SPC_OK)
        return status;
    if (is_cr && spb_bytes_have(b) > 0 && b->buf[b->pos] == '\n' &&
        !(is_end_header(r) && r->cr_lines > r->other_lines)) {
        b->pos++;
        is_cr = false;
    }
    if (is_cr)
        r->cr_lines++;
    else
        r->other_lines++;
    return SPC_OK;
}

static enum spc_status read_line(struct header_reader *r, struct spc_error *err)
{
    struct spb_bytes *const b = r->bytes;

    r->number++;
    r->line_off = spb_bytes_off(b);
    r->length = 0;
    r->cut = false;
    for (;;) {
        const enum spc_status status = spb_bytes_need(b, 1, err);
        if (status != SPC_OK)
            return status;
        r->line[r->length] = 0;
        const bool at_end = spb_bytes_have(b) == 0;
        if (at_end && is_end_header(r))
            return SPC_OK;
        if (at_end)
            return spc_fail(err, SPC_INPUT_TRUNCATED, b->file_bytes,
                            "the file ends inside its header, in line %" PRIu64, r->number);
        if (spb_bytes_off(b) >= PLY_HEADER_BYTES_MAX)
            return spc_fail(err, SPC_INPUT_FORMAT, SPC_NO_OFF,
                            "no 'end_header' in the first %d bytes", PLY_HEADER_BYTES_MAX);
        const char c = (char)b->buf[b->pos++];
        if (c == '\n' || c == '\r')
            return pass_line_end(r, c == '\r', err);
        if (r->length < PLY_LINE_MAX)
            r->line[r->length++] = c ? c : '?';
        else
            r->cut = true;
    }
}

static void split_words(struct header_reader *r)
{
    char *p = r->line;

    r->word_count = 0;
    while (r->word_count < WORDS_MAX) {
        p += strspn(p, " \t\v\f");
        if (!*p)
            break;
        r->word[r->word_count++] = p;
        p += strcspn(p, " \t\v\f");
        if (*p)
            *p++ = 0;
    }
}

/* ---- keywords ------------------------------------------------------------------------------- */

static enum spc_status on_format(struct header_reader *r, struct spc_error *err)
{
    static const char *const names[] = { "ascii", "binary_little_endian", "binary_big_endian" };
    struct ply_header *const h = r->header;
    char shown[PLY_NAME_MAX + 1] = "";
    size_t i = 0;

    if (h->format_known)
        return fail_line(r, SPC_INPUT_FORMAT, err, "a second 'format'");
    if (r->word_count > 1) {
        copy_printable(shown, r->word[1]);
        while (i < 3 && strcmp(r->word[1], names[i]) != 0)
            i++;
    }
    if (r->word_count < 2 || i == 3)
        return fail_line(r, SPC_INPUT_FORMAT, err, "format '%s' is none of ascii, "
                         "binary_little_endian, binary_big_endian", shown);
    if (r->word_count > 2 && strcmp(r->word[2], "1.0") != 0) {
        copy_printable(shown, r->word[2]);
        return fail_line(r, SPC_INPUT_FORMAT, err, "version '%s' of PLY is not known, only 1.0",
                         shown);
    }
    h->format_known = true;
    h->ascii = i == 0;
    h->big_endian = i == 2;
    return SPC_OK;
}

static bool parse_count(const char *word, uint64_t *out)
{
    uint64_t value = 0;

    if (!*word)
        return false;
    for (; *word; word++) {
        if (*word < '0' || *word > '9' || !mul_ok(value, 10, &value) ||
            __builtin_add_overflow(value, (uint64_t)(*word - '0'), &value))
            return false;
    }
    *out = value;
    return true;
}

static enum spc_status on_element(struct header_reader *r, struct spc_error *err)
{
    struct ply_header *const h = r->header;
    struct ply_element *const e = &h->element[h->element_count];
    char shown[PLY_NAME_MAX + 1];
    uint32_t *known = NULL;

    if (r->word_count < 3)
        return fail_line(r, SPC_INPUT_FORMAT, err, "'element' without name and count");
    if (h->element_count == PLY_ELEMENT_MAX)
        return fail_line(r, SPC_INPUT_FORMAT, err, "more than %d elements", PLY_ELEMENT_MAX);
    copy_printable(shown, r->word[2]);
    if (!parse_count(r->word[2], &e->count))
        return fail_line(r, SPC_INPUT_FORMAT, err, "'%s' is not a count", shown);
    copy_printable(e->name, r->word[1]);
    if (strcmp(r->word[1], "vertex") == 0)
        known = &h->vertex;
    else if (strcmp(r->word[1], "face") == 0 || strcmp(r->word[1], "faces") == 0)
        known = &h->faces;
    else if (strcmp(r->word[1], "tristrips") == 0)
        known = &h->strips;
    if (known && *known != PLY_NO_ELEMENT)
        return fail_line(r, SPC_INPUT_FORMAT, err, "a second element '%s'", e->name);
    if (known)
        *known = h->element_count;
    e->kind = PLY_OTHER;
    e->property_first = h->property_count;
    h->element_count++;
    return SPC_OK;
}

static enum spc_status parse_type(const struct header_reader *r, const char *word, uint8_t *type,
                                  struct spc_error *err)
{
    static const struct {
        const char *name;
        uint8_t type;
    } types[] = {
        { "char", PLY_I8 }, { "int8", PLY_I8 }, { "uchar", PLY_U8 }, { "uint8", PLY_U8 },
        { "short", PLY_I16 }, { "int16", PLY_I16 }, { "ushort", PLY_U16 }, { "uint16", PLY_U16 },
        { "int", PLY_I32 }, { "int32", PLY_I32 }, { "uint", PLY_U32 }, { "uint32", PLY_U32 },
        { "float", PLY_F32 }, { "float32", PLY_F32 }, { "double", PLY_F64 }, { "float64", PLY_F64 },
    };
    char shown[PLY_NAME_MAX + 1];

    for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
        if (strcmp(word, types[i].name) == 0) {
            *type = types[i].type;
            return SPC_OK;
        }
    }
    copy_printable(shown, word);
    return fail_line(r, SPC_INPUT_FORMAT, err,
                     "'%s' is none of PLY's types, so its size is unknown", shown);
}

/* Remembers which properties the wanted names belong to; the first of a name counts. */
static void note_property(struct header_reader *r, const char *name, bool is_list)
{
    struct ply_header *const h = r->header;
    struct ply_element *const e = &h->element[h->element_count - 1];
    const uint32_t element = h->element_count - 1;

    if (element == h->vertex && !is_list) {
        for (size_t i = 0; i < NAME_COUNT; i++) {
            if (strcmp(name, vertex_names[i]) == 0 && r->vertex_property[i] == 0)
                r->vertex_property[i] = h->property_count + 1;
        }
    }
    if ((element == h->faces || element == h->strips) && is_list && e->kind == PLY_OTHER &&
        (strcmp(name, "vertex_indices") == 0 || strcmp(name, "vertex_index") == 0)) {
        e->kind = element == h->faces ? PLY_FACES : PLY_STRIPS;
        e->index_property = h->property_count;
    }
}

static enum spc_status on_property(struct header_reader *r, struct spc_error *err)
{
    struct ply_header *const h = r->header;
    struct ply_property *const p = &h->property[h->property_count];
    const bool is_list = r->word_count > 1 && strcmp(r->word[1], "list") == 0;
    const size_t type_word = is_list ? 3 : 1;
    enum spc_status status = SPC_OK;

    if (h->element_count == 0)
        return fail_line(r, SPC_INPUT_FORMAT, err, "a property before any element");
    if (r->word_count < type_word + 2)
        return fail_line(r, SPC_INPUT_FORMAT, err, "'property' without type and name");
    if (h->property_count == PLY_PROPERTY_MAX)
        return fail_line(r, SPC_INPUT_FORMAT, err, "more than %d properties", PLY_PROPERTY_MAX);
    *p = (struct ply_property){ .role = PLY_NO_ROLE };
    if (is_list)
        status = parse_type(r, r->word[2], &p->count_type, err);
    if (status == SPC_OK)
        status = parse_type(r, r->word[type_word], &p->type, err);
    if (status != SPC_OK)
        return status;
    if (p->count_type >= PLY_F32)
        return fail_line(r, SPC_INPUT_FORMAT, err, "a list cannot be counted in '%s'", r->word[2]);
    note_property(r, r->word[type_word + 1], is_list);
    h->property_count++;
    h->element[h->element_count - 1].property_count++;
    h->element[h->element_count - 1].list_count += is_list;
    return SPC_OK;
}

/* One line behind the first; *done at end_header. */
static enum spc_status on_line(struct header_reader *r, bool *done, struct spc_error *err)
{
    enum spc_status (*on_keyword)(struct header_reader *, struct spc_error *) = NULL;
    const char *keyword;

    split_words(r);
    if (r->word_count == 0)
        return SPC_OK;
    keyword = r->word[0];
    *done = strcmp(keyword, "end_header") == 0;
    if (*done || strcmp(keyword, "comment") == 0 || strcmp(keyword, "obj_info") == 0)
        return SPC_OK;
    if (strcmp(keyword, "format") == 0)
        on_keyword = on_format;
    else if (strcmp(keyword, "element") == 0)
        on_keyword = on_element;
    else if (strcmp(keyword, "property") == 0)
        on_keyword = on_property;
    if (on_keyword && r->cut)
        return fail_line(r, SPC_INPUT_FORMAT, err, "longer than %d characters", PLY_LINE_MAX);
    if (on_keyword)
        return on_keyword(r, err);
    if (r->header->unknown_count++ == 0)
        copy_printable(r->header->unknown, keyword);
    return SPC_OK;
}

/* ---- what it means -------------------------------------------------------------------------- */

static void choose_colors(struct header_reader *r)
{
    static const int sets[] = { NAME_RED, NAME_DIFFUSE, NAME_R };
    struct ply_header *const h = r->header;

    for (size_t s = 0; s < sizeof sets / sizeof *sets && !h->colors; s++) {
        const uint32_t *const set = &r->vertex_property[sets[s]];
        if (!set[0] || !set[1] || !set[2])
            continue;
        for (int i = 0; i < 3; i++)
            h->property[set[i] - 1].role = (uint8_t)(PLY_RED + i);
        if (set[3])
            h->property[set[3] - 1].role = PLY_ALPHA;
        else if (r->vertex_property[NAME_ALPHA])
            h->property[r->vertex_property[NAME_ALPHA] - 1].role = PLY_ALPHA;
        h->colors = true;
    }
}

/* After faces that nobody can read were forgotten. */
static void choose_normals(struct header_reader *r)
{
    static const int sets[] = { NAME_NX, NAME_NORMAL };
    struct ply_header *const h = r->header;
    const bool meshed = (h->faces != PLY_NO_ELEMENT && h->element[h->faces].count > 0) ||
                        (h->strips != PLY_NO_ELEMENT && h->element[h->strips].count > 0);

    for (size_t s = 0; s < sizeof sets / sizeof *sets && !h->normals && !meshed; s++) {
        const uint32_t *const set = &r->vertex_property[sets[s]];
        if (!set[0] || !set[1] || !set[2])
            continue;
        for (int i = 0; i < 3; i++)
            h->property[set[i] - 1].role = (uint8_t)(PLY_NX + i);
        h->normals = true;
    }
}

static enum spc_status check_vertex(struct header_reader *r, struct spc_error *err)
{
    struct ply_header *const h = r->header;

    if (h->vertex == PLY_NO_ELEMENT)
        return spc_fail(err, SPC_INPUT_FORMAT, SPC_NO_OFF, "the header has no element 'vertex'");
    h->element[h->vertex].kind = PLY_VERTEX;
    for (int i = NAME_X; i <= NAME_Z; i++) {
        if (r->vertex_property[i])
            h->property[r->vertex_property[i] - 1].role = (uint8_t)(PLY_X + i);
        else if (h->element[h->vertex].count > 0)
            return spc_fail(err, SPC_INPUT_FORMAT, SPC_NO_OFF,
                            "element 'vertex' has no property '%s'", vertex_names[i]);
    }
    choose_colors(r);
    return SPC_OK;
}

/* An element whose faces nobody can read is an element like any other. */
static void forget_unread(struct ply_header *h, uint32_t *known)
{
    if (*known == PLY_NO_ELEMENT || h->element[*known].kind != PLY_OTHER)
        return;
    h->faces_unread = h->faces_unread || h->element[*known].count > 0;
    *known = PLY_NO_ELEMENT;
}

static void measure_rows(struct ply_header *h)
{
    for (uint32_t i = 0; i < h->element_count; i++) {
        struct ply_element *const e = &h->element[i];
        for (uint32_t k = 0; k < e->property_count; k++) {
            const struct ply_property *const p = &h->property[e->property_first + k];
            if (p->role < PLY_ROLE_COUNT)
                h->channel[p->role] = (struct ply_channel){ .type = p->type, .off = e->row_bytes };
            /* In text a value takes a digit and a blank or line end. */
            e->row_bytes += h->ascii ? 2 : ply_type_bytes(p->count_type ? p->count_type : p->type);
        }
    }
}

static enum spc_status check_counts(const struct ply_header *h, uint64_t file_bytes,
                                    struct spc_error *err)
{
    /* The last line of a text body may lack its end: one byte more than there is. */
    uint64_t left = file_bytes - h->body_off + (h->ascii ? 1 : 0);

    for (uint32_t i = 0; i < h->element_count; i++) {
        const struct ply_element *const e = &h->element[i];
        uint64_t least = UINT64_MAX;
        if (!mul_ok(e->count, e->row_bytes, &least) || least > left)
            return spc_fail(err, SPC_INPUT_TRUNCATED, file_bytes,
                            "element '%s': %" PRIu64 " rows of at least %" PRIu32
                            " bytes are promised, but only %" PRIu64 " bytes are there",
                            e->name, e->count, e->row_bytes, left - (h->ascii && left > 0));
        left -= least;
    }
    return SPC_OK;
}

/* The first line: 'ply', perhaps behind the mark that some Windows editors put before text. */
static enum spc_status read_magic(struct header_reader *r, struct spc_error *err)
{
    struct spb_bytes *const b = r->bytes;
    enum spc_status status = spb_bytes_need(b, 3, err);

    if (status != SPC_OK)
        return status;
    if (spb_bytes_have(b) >= 3 && memcmp(b->buf + b->pos, "\xef\xbb\xbf", 3) == 0)
        b->pos += 3;
    status = read_line(r, err);
    if (status != SPC_OK)
        return status;
    split_words(r);
    if (r->word_count != 1 || strcmp(r->word[0], "ply") != 0)
        return fail_line(r, SPC_INPUT_FORMAT, err, "'ply' should stand here alone");
    return SPC_OK;
}

enum spc_status spb_ply_header_read(struct spb_bytes *bytes, struct ply_header *header,
                                    struct spc_error *err)
{
    struct header_reader r = { .bytes = bytes, .header = header };
    enum spc_status status;
    bool done = false;

    header->vertex = header->faces = header->strips = PLY_NO_ELEMENT;
    status = read_magic(&r, err);
    while (status == SPC_OK && !done) {
        status = read_line(&r, err);
        if (status == SPC_OK)
            status = on_line(&r, &done, err);
    }
    if (status != SPC_OK)
        return status;
    header->body_off = spb_bytes_off(bytes);
    if (!header->format_known)
        return spc_fail(err, SPC_INPUT_FORMAT, SPC_NO_OFF, "the header has no line 'format'");
    status = check_vertex(&r, err);
    if (status != SPC_OK)
        return status;
    forget_unread(header, &header->faces);
    forget_unread(header, &header->strips);
    choose_normals(&r);
    measure_rows(header);
    return check_counts(header, bytes->file_bytes, err);
}
