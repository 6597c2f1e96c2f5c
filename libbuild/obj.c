/*
 * An OBJ file says nowhere what it holds, so opening it reads it through: the counting pass. It
 * parses vertices, for their colours and to know whether they need double, counts faces without
 * looking into them, and notes in which ranges of the file either lie, so that the later passes
 * leave out normals, texture coordinates and each other.
 *
 * Keywords are lower case. Free-form curves and surfaces, lines and points are counted and
 * remarked, so are lines that begin with no keyword; groups, objects, materials, normals and what
 * else does not shape triangles is passed over in silence.
 */
#include "obj.h"

#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include "obj_int.h"

/* ---- keywords --------------------------------------------------------------------------------- */

static const struct {
    const char *word;
    enum obj_keyword keyword;
} KEYWORDS[] = {
    {"usemtl", OBJ_MATERIAL}, {"mtllib", OBJ_LIBRARY}, {"g", OBJ_PASSED}, {"o", OBJ_PASSED},
    {"s", OBJ_PASSED}, {"l", OBJ_LINE}, {"p", OBJ_POINT}, {"mg", OBJ_PASSED},
    {"curv", OBJ_CURVE}, {"curv2", OBJ_CURVE}, {"surf", OBJ_CURVE}, {"bzp", OBJ_CURVE},
    {"bsp", OBJ_CURVE}, {"cdc", OBJ_CURVE}, {"cdp", OBJ_CURVE}, {"res", OBJ_PASSED},
    {"cstype", OBJ_PASSED}, {"deg", OBJ_PASSED}, {"bmat", OBJ_PASSED}, {"step", OBJ_PASSED},
    {"parm", OBJ_PASSED}, {"trim", OBJ_PASSED}, {"hole", OBJ_PASSED}, {"scrv", OBJ_PASSED},
    {"sp", OBJ_PASSED}, {"end", OBJ_PASSED}, {"con", OBJ_PASSED}, {"bevel", OBJ_PASSED},
    {"c_interp", OBJ_PASSED}, {"d_interp", OBJ_PASSED}, {"lod", OBJ_PASSED},
    {"maplib", OBJ_PASSED}, {"usemap", OBJ_PASSED}, {"shadow_obj", OBJ_PASSED},
    {"trace_obj", OBJ_PASSED}, {"ctech", OBJ_PASSED}, {"stech", OBJ_PASSED},
};

enum obj_keyword spb_obj_keyword(const struct obj_text *t, const uint8_t *p)
{
    if (p[0] == 'v') {
        if (obj_word_ends(t, p + 1))
            return OBJ_VERTEX;
        if ((p[1] == 't' || p[1] == 'n' || p[1] == 'p') && obj_word_ends(t, p + 2))
            return p[1] == 't' ? OBJ_UV : OBJ_PASSED;
        return OBJ_UNKNOWN;
    }
    if (p[0] == 'f' && (obj_word_ends(t, p + 1) || (p[1] == 'o' && obj_word_ends(t, p + 2))))
        return OBJ_FACE;
    for (size_t i = 0; i < sizeof KEYWORDS / sizeof *KEYWORDS; i++) {
        const char *const word = KEYWORDS[i].word;
        size_t length = 0;          /* no call: most lines of some files come here */
        while (word[length] != '\0' && p[length] == (uint8_t)word[length])
            length++;
        if (word[length] == '\0' && obj_word_ends(t, p + length))
            return KEYWORDS[i].keyword;
    }
    return OBJ_UNKNOWN;
}

/* ---- the counting pass ------------------------------------------------------------------------ */

/* Real colours of full scale 1 that overshoot are clamped; no writer's 0 to 255 ends below this. */
static const double COLOR_OVERSHOOT = 16;

static enum spc_status count_vertex(struct obj *o, struct spc_error *err)
{
    const struct spb_bytes *const b = o->text.bytes;
    double value[OBJ_VALUES_MAX];
    int count;
    bool spare = false;

    o->text.bytes->pos++;
    enum spc_status status = spb_obj_values(o, value, &count, true, err);
    if (status == SPC_OK && b->buf[b->pos] != '\n')
        status = obj_to_word(&o->text, &spare, err);
    o->spare += spare || count == 5;
    o->colored += count >= 6;
    for (int k = 3; count >= 6 && k < 6; k++)
        if (value[k] > o->color_max && value[k] < HUGE_VAL)
            o->color_max = value[k];
    o->vertex_count++;
    return status;
}

/* The line whose first word is at pos, without what is left of it. */
static enum spc_status count_line(struct obj *o, enum obj_keyword keyword, struct spc_error *err)
{
    struct obj_text *const t = &o->text;
    switch (keyword) {
    case OBJ_VERTEX:
        return count_vertex(o, err);
    case OBJ_FACE:
        o->face_count++;
        return SPC_OK;
    case OBJ_UV:
        o->uv_count++;
        return SPC_OK;
    case OBJ_MATERIAL:
    case OBJ_LIBRARY:
        return spb_obj_paint_name(o, keyword, err);
    case OBJ_LINE:
        o->lines++;
        return SPC_OK;
    case OBJ_POINT:
        o->points++;
        return SPC_OK;
    case OBJ_CURVE:
        o->curves++;
        return SPC_OK;
    case OBJ_UNKNOWN:
        if (o->unknown++ == 0)
            spb_obj_show(t->bytes, t->bytes->buf + t->bytes->pos, o->first_unknown);
        return SPC_OK;
    default:
        return SPC_OK;
    }
}

static enum spc_status count_all(struct obj *o, uint64_t *known, struct spc_error *err)
{
    struct obj_text *const t = &o->text;
    struct spb_bytes *const b = t->bytes;
    enum spc_status status = obj_need(t, err);

    if (status == SPC_OK && spb_bytes_have(b) >= 3 && memcmp(b->buf, "\xef\xbb\xbf", 3) == 0)
        b->pos += 3;
    while (status == SPC_OK) {
        bool more;
        struct obj_range here = {.line = t->line, .vertices = o->vertex_count, .uvs = o->uv_count};
        enum obj_keyword keyword = OBJ_PASSED;
        here.off = spb_bytes_off(b);
        status = obj_to_word(t, &more, err);
        if (status != SPC_OK || spb_bytes_have(b) == 0)
            break;
        if (more) {
            keyword = spb_obj_keyword(t, b->buf + b->pos);
            status = count_line(o, keyword, err);
            *known += keyword != OBJ_UNKNOWN;
        }
        if (status == SPC_OK)
            status = obj_end_line(t, err);
        here.end = spb_bytes_off(b);
        if (keyword == OBJ_VERTEX)
            spb_obj_note(&o->vertex_lines, &here);
        else if (keyword == OBJ_UV)
            spb_obj_note(&o->uv_lines, &here);
        else if (keyword == OBJ_FACE || keyword == OBJ_MATERIAL)
            spb_obj_note(&o->face_lines, &here);
    }
    return status;
}

/* ---- the later passes ------------------------------------------------------------------------- */

void spb_obj_begin_pass(struct obj *o, const struct obj_ranges *ranges)
{
    o->failed = SPC_OK;
    o->ranges = ranges;
    o->range = 0;
    o->in_range = false;
    o->pass_bytes = 0;
    o->row = 0;
    o->vertices_before = o->uvs_before = 0;
    o->in_face = false;
}

static void enter_range(struct obj *o)
{
    const struct obj_range *const r = &o->ranges->list[o->range];
    spb_bytes_seek(o->text.bytes, r->off);
    o->text.line = r->line;
    o->vertices_before = r->vertices;
    o->uvs_before = r->uvs;
    o->range_off = r->off;
    o->in_range = true;
}

enum spc_status spb_obj_next_line(struct obj *o, bool *more, struct spc_error *err)
{
    struct obj_text *const t = &o->text;
    for (;;) {
        if (!o->in_range) {
            *more = o->range < o->ranges->count;
            if (!*more)
                return SPC_OK;
            enter_range(o);
        }
        enum spc_status status = obj_need(t, err);
        if (status != SPC_OK)
            return status;
        if (spb_bytes_have(t->bytes) == 0 ||
            spb_bytes_off(t->bytes) >= o->ranges->list[o->range].end) {
            o->pass_bytes += spb_bytes_off(t->bytes) - o->range_off;
            o->in_range = false;
            o->range++;
            continue;
        }
        status = obj_to_word(t, more, err);
        if (status != SPC_OK || *more)
            return status;
        status = obj_end_line(t, err);
        if (status != SPC_OK)
            return status;
    }
}

static enum spc_status refuse_failed(const struct obj *o, struct spc_error *err)
{
    return spc_fail(err, o->failed, SPC_NO_OFF, "this pass has failed before");
}

static enum spc_status obj_begin_vertices(void *state, struct spc_error *err)
{
    struct obj *const o = state;
    (void)err;
    spb_obj_begin_pass(o, &o->vertex_lines);
    return SPC_OK;
}

static enum spc_status obj_begin_faces(void *state, struct spc_error *err)
{
    struct obj *const o = state;
    (void)err;
    spb_obj_begin_pass(o, &o->face_lines);
    spb_obj_paint_begin(o);
    return SPC_OK;
}

static enum spc_status obj_vertices(void *state, struct spb_vertex_batch *out,
                                    struct spc_error *err)
{
    struct obj *const o = state;

    out->count = 0;
    if (o->failed != SPC_OK)
        return refuse_failed(o, err);
    return o->failed = spb_obj_vertices(o, out, err);
}

static enum spc_status obj_faces(void *state, struct spb_face_batch *out, struct spc_error *err)
{
    struct obj *const o = state;

    out->count = 0;
    out->faces_in = out->split_extra = out->faces_short = 0;
    if (o->failed != SPC_OK)
        return refuse_failed(o, err);
    out->colored = o->paint != NULL;
    return o->failed = spb_obj_faces(o, out, err);
}

static uint64_t obj_bytes_done(const void *state)
{
    const struct obj *const o = state;
    return o->pass_bytes + (o->in_range ? spb_bytes_off(o->text.bytes) - o->range_off : 0);
}

/* ---- remark ----------------------------------------------------------------------------------- */

static void add_remark(struct obj *o, const char *fmt, ...) __attribute__((format(printf, 2, 3)));

static void add_remark(struct obj *o, const char *fmt, ...)
{
    const size_t length = strlen(o->remark);
    char text[240];
    va_list args;

    va_start(args, fmt);
    vsnprintf(text, sizeof text, fmt, args);
    va_end(args);
    snprintf(o->remark + length, sizeof o->remark - length, "%s%s", length ? "; " : "", text);
}

static const char *obj_remark(void *state)
{
    struct obj *const o = state;

    o->remark[0] = 0;
    if (o->lines + o->points > 0)
        add_remark(o, "%" PRIu64 " lines and %" PRIu64 " points ('l', 'p') were passed over",
                   o->lines, o->points);
    if (o->curves > 0)
        add_remark(o, "%" PRIu64 " free-form curves and surfaces were ignored", o->curves);
    if (o->unknown > 0)
        add_remark(o, "%" PRIu64 " lines begin with no keyword of OBJ, the first with '%s'",
                   o->unknown, o->first_unknown);
    if (o->spare > 0)
        add_remark(o, "%" PRIu64 " vertices have spare values", o->spare);
    if (o->colored > 0 && o->paint)
        add_remark(o, "the colours of vertices are not used, those of textures are");
    else if (o->colored > 0 && o->colored < o->vertex_count)
        add_remark(o, "%" PRIu64 " of %" PRIu64 " vertices have no colour and are white",
                   o->vertex_count - o->colored, o->vertex_count);
    if (o->colored > 0 && !o->paint && o->color_full > 1)
        add_remark(o, "colours reach %g and are taken as 0 to %.0f", o->color_max, o->color_full);
    if (o->paint_remark[0])
        add_remark(o, "%s", o->paint_remark);
    return o->remark;
}

/* ---- open and close --------------------------------------------------------------------------- */

static void obj_close(void *state)
{
    struct obj *const o = state;
    spb_obj_paint_free(o->paint);
    free(o);
}

static void obj_pause(void *state)
{
    struct obj *const o = state;
    spb_obj_paint_pause(o->paint);
}

static enum spc_status obj_open(struct spb_bytes *bytes, const struct spb_source_options *options,
                                struct spb_source_info *info, void **state, struct spc_error *err)
{
    struct obj *const o = calloc(1, sizeof *o);
    uint64_t known = 0;

    if (!o)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for an OBJ reader");
    o->text = (struct obj_text){.bytes = bytes, .progress = options->progress, .line = 1};
    enum spc_status status = count_all(o, &known, err);
    if (status == SPC_OK && known == 0)
        status = spc_fail(err, SPC_INPUT_FORMAT, SPC_NO_OFF,
                          "not a scan in a known format: no line begins with a keyword of OBJ");
    if (status == SPC_OK)
        status = spb_obj_paint_prepare(o, options, err);
    if (status != SPC_OK) {
        obj_close(o);
        return status;
    }
    o->text.progress = NULL;            /* the later passes are told of by those who ask for them */
    o->color_full = o->color_max > 255 ? 65535 : o->color_max > COLOR_OVERSHOOT ? 255 : 1;
    info->format = "obj";
    info->vertex_count = o->vertex_count;
    info->face_count = o->face_count;
    info->colors = o->colored > 0 && !o->paint;
    info->corner_colors = o->paint != NULL;
    info->wide = o->wide;
    *state = o;
    return SPC_OK;
}

const struct spb_format spb_obj_format = {
    .name = "OBJ",
    .sniff = spb_obj_sniff,
    .open = obj_open,
    .close = obj_close,
    .pause = obj_pause,
    .begin_vertices = obj_begin_vertices,
    .begin_faces = obj_begin_faces,
    .vertices = obj_vertices,
    .faces = obj_faces,
    .bytes_done = obj_bytes_done,
    .remark = obj_remark,
};
