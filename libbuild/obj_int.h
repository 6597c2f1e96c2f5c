/*
 * obj_int.h - what the files of the OBJ reader share.
 *
 *   obj_lines.c     words, line ends, continued lines, ranges of lines
 *   obj.c           the counting pass, remarks, the table
 *   obj_sniff.c     does a file look like OBJ?
 *   obj_vertices.c  v lines
 *   obj_faces.c     f lines: polygons to triangles
 *   obj_paint.c     materials and textures: colours of corners
 */
#ifndef SPB_OBJ_INT_H
#define SPB_OBJ_INT_H

#include <string.h>

#include "mtl.h"
#include "number.h"
#include "obj.h"

enum {
    OBJ_WORD_MAX = SPB_NUMBER_MAX + 64, /* characters that are whole in the window at a word */
    OBJ_RANGES_MAX = 256,
    OBJ_VALUES_MAX = 7,                 /* x y z r g b a */
    OBJ_SHOWN_MAX = 24                  /* characters of a word in a message */
};

/* ---- obj_lines.c: a file as lines of words ---------------------------------------------------- */

struct obj_text {
    struct spb_bytes *bytes;
    const struct spb_progress *progress;        /* told at each fill of the window; or NULL */
    uint64_t line;                      /* number of the one under way, from 1, as editors count */
};

/* Bytes [off, end) of the file, whole lines. */
struct obj_range {
    uint64_t off, end;
    uint64_t line;                      /* number of the first */
    uint64_t vertices, uvs;             /* v and vt lines before it */
};

/* Where lines of one kind lie: few ranges, in order, that others may be among. */
struct obj_ranges {
    uint32_t count;
    uint64_t gap;                       /* bytes; what lies closer is one range */
    struct obj_range list[OBJ_RANGES_MAX];
};

/* Adds the line that begins at range->off. */
void spb_obj_note(struct obj_ranges *ranges, const struct obj_range *range);

/* The part of obj_need that reads. fails SPC_IO, SPC_CANCELLED */
enum spc_status spb_obj_fill(struct obj_text *text, size_t want, struct spc_error *err);

/*
 * Passes over the rest of the line, of any length, with those that it continues in, and its end.
 * fails SPC_IO, SPC_CANCELLED
 */
enum spc_status spb_obj_pass_line(struct obj_text *text, struct spc_error *err);

/* Steps over a backslash and the line end behind it; false: there is none, nothing was passed. */
bool spb_obj_continues(struct obj_text *text);

/*
 * The rest of the line from the next word on, without the blanks at its end, as a name of at most
 * MTL_NAME_MAX bytes. The line is not passed to its end. fails SPC_IO, SPC_CANCELLED
 */
enum spc_status spb_obj_name(struct obj_text *text, char name[MTL_NAME_MAX + 1], size_t *length,
                             struct spc_error *err);

/* "line 7: " and what is wrong with it. The status is TRUNCATED where the file ends in that line. */
enum spc_status spb_obj_fail_line(const struct obj_text *text, struct spc_error *err,
                                  const char *fmt, ...) __attribute__((format(printf, 3, 4)));

/* The same of the word at pos: "line 7: 'abc' is not a number". */
enum spc_status spb_obj_fail_word(const struct obj_text *text, const char *should,
                                  struct spc_error *err);

/* Copies the printable part of the word at p, OBJ_SHOWN_MAX characters at most and a zero. */
void spb_obj_show(const struct spb_bytes *bytes, const uint8_t *p, char shown[OBJ_SHOWN_MAX + 4]);

static inline bool obj_is_blank(uint8_t c)
{
    return c == ' ' || c == '\t' || c == '\v' || c == '\f';
}

/* What may follow a word; the zero behind the window does where it is the end of the file. */
static inline bool obj_word_ends(const struct obj_text *t, const uint8_t *p)
{
    return obj_is_blank(*p) || *p == '\n' || *p == '\r' || *p == '#' || *p == '\\' ||
           (p == t->bytes->buf + t->bytes->end && spb_bytes_last(t->bytes));
}

/* Brings a whole word of up to OBJ_WORD_MAX characters into the window. */
static inline enum spc_status obj_need(struct obj_text *t, struct spc_error *err)
{
    return spb_bytes_have(t->bytes) > OBJ_WORD_MAX || spb_bytes_last(t->bytes)
               ? SPC_OK : spb_obj_fill(t, OBJ_WORD_MAX + 1, err);
}

/*
 * Moves to the next word of the line, over blanks and continued lines. *more is false, and pos
 * stands on it, where a line end, a comment or the end of the file comes instead.
 */
static inline enum spc_status obj_to_word(struct obj_text *t, bool *more, struct spc_error *err)
{
    struct spb_bytes *const b = t->bytes;
    for (;;) {
        const uint8_t *p = b->buf + b->pos;
        while (obj_is_blank(*p))
            p++;
        b->pos = (size_t)(p - b->buf);
        if (spb_bytes_have(b) <= OBJ_WORD_MAX && !spb_bytes_last(b)) {
            const enum spc_status status = spb_obj_fill(t, OBJ_WORD_MAX + 1, err);
            if (status != SPC_OK)
                return status;
            continue;
        }
        if (*p == '\\' && spb_obj_continues(t))
            continue;
        *more = *p != '\n' && *p != '\r' && *p != '#' && b->pos < b->end;
        return SPC_OK;
    }
}

/* Passes over the rest of the line: at once where its end is next. */
static inline enum spc_status obj_end_line(struct obj_text *t, struct spc_error *err)
{
    if (t->bytes->buf[t->bytes->pos] != '\n')
        return spb_obj_pass_line(t, err);
    t->bytes->pos++;
    t->line++;
    return SPC_OK;
}

/* ---- the reader ------------------------------------------------------------------------------- */

enum obj_keyword {                      /* what a line is */
    OBJ_VERTEX, OBJ_FACE, OBJ_UV, OBJ_LINE, OBJ_POINT, OBJ_MATERIAL, OBJ_LIBRARY, OBJ_CURVE,
    OBJ_PASSED, OBJ_UNKNOWN
};

struct obj_paint;

struct obj {
    struct obj_text text;
    struct obj_ranges vertex_lines, uv_lines;
    struct obj_ranges face_lines;       /* with usemtl among them */
    struct obj_paint *paint;            /* NULL: the file names no material, or none gives colours */

    /* found by the counting pass */
    uint64_t vertex_count, uv_count, face_count;
    uint64_t lines, points, curves, unknown;            /* elements or lines passed over */
    char first_unknown[OBJ_SHOWN_MAX + 4];
    uint64_t colored;                   /* vertices with a colour */
    uint64_t spare;                     /* v lines with words that are no value of a vertex */
    double color_max;                   /* largest red, green or blue */
    double color_full;                  /* what stands for 255 */
    bool wide;

    /* of the pass under way */
    enum spc_status failed;             /* it has: nothing more comes from it */
    const struct obj_ranges *ranges;
    uint32_t range;                     /* of them: under way or next */
    bool in_range;
    uint64_t range_off, pass_bytes;     /* start of the range under way; done in those before */
    uint64_t row;                       /* vertices, or faces, delivered */
    uint64_t vertices_before, uvs_before;       /* v, vt lines before this one, in a face pass */
    bool in_face;                       /* between two corners */
    uint64_t run;                       /* corners of it so far */
    uint64_t first, last;               /* corners of it */
    uint64_t first_uv, last_uv;
    char paint_remark[200];             /* what is missing of libraries and textures */
    char remark[600];
};

/* What the line is whose first word stands at p. */
enum obj_keyword spb_obj_keyword(const struct obj_text *text, const uint8_t *p);

/*
 * The numbers of a v line, from behind its keyword: *count of them, at least 3. Words that are no
 * number end them; the line is not passed to its end. Sets obj->wide while counting.
 * fails  SPC_INPUT_FORMAT, SPC_INPUT_TRUNCATED, SPC_IO
 */
enum spc_status spb_obj_values(struct obj *obj, double value[OBJ_VALUES_MAX], int *count,
                               bool counting, struct spc_error *err);

/*
 * Starts a pass over ranges; and moves to the next line of them, of which pos then stands on the
 * first word. *more is false at the end.
 */
void spb_obj_begin_pass(struct obj *obj, const struct obj_ranges *ranges);
enum spc_status spb_obj_next_line(struct obj *obj, bool *more, struct spc_error *err);

enum spc_status spb_obj_vertices(struct obj *obj, struct spb_vertex_batch *out,
                                 struct spc_error *err);
enum spc_status spb_obj_faces(struct obj *obj, struct spb_face_batch *out, struct spc_error *err);

/* ---- obj_paint.c ------------------------------------------------------------------------------ */

/*
 * In the counting pass, of a line usemtl or mtllib whose keyword is at pos: remembers the name.
 * fails SPC_NO_MEMORY, SPC_IO, SPC_CANCELLED
 */
enum spc_status spb_obj_paint_name(struct obj *obj, enum obj_keyword keyword, struct spc_error *err);

/*
 * Behind the counting pass: reads libraries and textures, decides whether corners are coloured by
 * them, and frees what is not needed. What is missing or broken goes into obj->paint_remark.
 * fails  SPC_NO_MEMORY, SPC_IO (temporary files, or the scan), SPC_CANCELLED
 */
enum spc_status spb_obj_paint_prepare(struct obj *obj, const struct spb_source_options *options,
                                      struct spc_error *err);
void spb_obj_paint_free(struct obj_paint *paint);

/* Frees what is kept for speed alone, until it is made again. paint may be NULL. */
void spb_obj_paint_pause(struct obj_paint *paint);

/* In a face pass: from here on no material; the one whose usemtl is at pos. */
void spb_obj_paint_begin(struct obj *obj);
enum spc_status spb_obj_paint_use(struct obj *obj, struct spc_error *err);

/* Colours of a triangle with these vt lines, counted from 0; SPB_BAD_INDEX: none. fails SPC_IO */
enum spc_status spb_obj_paint_triangle(struct obj *obj, const uint64_t uv[3], uint8_t rgba[3][4],
                                       struct spc_error *err);

bool spb_obj_sniff(const uint8_t *head, size_t head_bytes, uint64_t file_bytes);

#endif
