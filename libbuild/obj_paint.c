/*
 * Colours from materials and textures, for the corners of faces.
 *
 * The counting pass remembers which materials are used and which libraries are named. Behind it the
 * libraries are read, then the textures of used materials, as pyramids on disk (texture.h), and the
 * vt lines, as floats to a temporary file of which a fixed number of pieces is in memory. Whatever
 * is missing or broken costs its colours, not the scan.
 *
 * Corners are coloured when a used material has a texture that can be read: then vertices' own
 * colours count no more. Without any, when vertices have no colours and the materials do have some:
 * two of them differ, or one is no grey. The grey of a default material says nothing.
 *
 * Names in libraries are of the machine that wrote them: backslashes separate folders, absolute
 * ones are rarely here. A file is looked for beside the library, then beside the scan; first by the
 * name as it is, then by its last part.
 */
#include "obj_int.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>

enum {
    LIBRARIES_MAX = 64,
    PATH_BYTES = 8192,
    PIECE_LOG2 = 8,                     /* uv a piece: 2 KB, for faces in any order */
    PIECES = 1024,                      /* in memory: 2 MB */
    UV_BATCH = 1 << 12                  /* written at once */
};

struct uv_cache {
    uint64_t piece[PIECES];             /* that lie here, or SPC_NO_OFF */
    float uv[PIECES][1 << PIECE_LOG2][2];
};

struct obj_paint {
    struct mtl mtl;                     /* the materials used */
    struct mtl files;                   /* pictures asked for, by path: their textures */
    struct spb_textures *textures;      /* NULL: none */
    struct spb_tmpfile *uv_file;        /* float [uv_count][2] */
    uint32_t material;                  /* of the faces to come; MTL_NONE: none */
    uint64_t missing;                   /* libraries and textures that were not read */
    struct uv_cache *uvs;               /* NULL: not needed yet, or no more for now */
    char path[PATH_BYTES];
    uint32_t library_count;
    char (*libraries)[MTL_NAME_MAX + 1];        /* [LIBRARIES_MAX], until they have been read */
};

static enum spc_status no_memory(struct spc_error *err)
{
    return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for materials");
}

/* The first that is missing is named, others are counted. */
static void miss(struct obj *o, const char *kind, const char *name, const char *why)
{
    char shown[64];
    const size_t length = strlen(name), cut = length >= sizeof shown ? length - sizeof shown + 1 : 0;
    if (o->paint->missing++ > 0)
        return;
    snprintf(shown, sizeof shown, "%s", name + cut);
    for (char *p = shown; *p; p++)
        if ((unsigned char)*p < ' ' || *p == 127)
            *p = '?';
    snprintf(o->paint_remark, sizeof o->paint_remark, "%s '%s' %.100s: ignored", kind,
             shown, why);
}

/* ---- the counting pass ------------------------------------------------------------------------ */

static enum spc_status make_paint(struct obj *o, struct spc_error *err)
{
    struct obj_paint *const p = calloc(1, sizeof *p);
    if (!p)
        return no_memory(err);
    o->paint = p;
    p->libraries = malloc(LIBRARIES_MAX * sizeof *p->libraries);
    const enum spc_status status = p->libraries ? spb_mtl_init(&p->mtl, err) : no_memory(err);
    return status == SPC_OK ? spb_mtl_init(&p->files, err) : status;
}

enum spc_status spb_obj_paint_name(struct obj *o, enum obj_keyword keyword, struct spc_error *err)
{
    enum spc_status status = o->paint ? SPC_OK : make_paint(o, err);
    char name[MTL_NAME_MAX + 1];
    size_t length;

    o->text.bytes->pos += 6;            /* both words have six letters */
    if (status == SPC_OK)
        status = spb_obj_name(&o->text, name, &length, err);
    if (status != SPC_OK)
        return status;
    struct obj_paint *const p = o->paint;
    if (keyword == OBJ_MATERIAL)
        return spb_mtl_add(&p->mtl, name, length, err);
    for (uint32_t i = 0; i < p->library_count; i++)
        if (strcmp(p->libraries[i], name) == 0)
            return SPC_OK;
    if (length > 0 && p->library_count < LIBRARIES_MAX)
        memcpy(p->libraries[p->library_count++], name, length + 1);
    return SPC_OK;
}

/* ---- files ------------------------------------------------------------------------------------ */

/* path becomes folder (folder_bytes of it) and name; false: there is no such file. */
static bool look(char path[PATH_BYTES], const char *folder, size_t folder_bytes, const char *name)
{
    struct stat st;
    if (strcmp(name, "-") == 0)         /* would be standard input */
        return false;
    const int n = snprintf(path, PATH_BYTES, "%.*s%s", (int)folder_bytes, folder, name);
    return n > 0 && n < PATH_BYTES && stat(path, &st) == 0 && S_ISREG(st.st_mode);
}

static size_t folder_bytes(const char *path)
{
    const char *const slash = strrchr(path, '/');
    return slash ? (size_t)(slash - path) + 1 : 0;
}

/* Finds a file by the name that some other gives it; folder ends in a slash, or is empty. */
static bool find_file(char path[PATH_BYTES], const char *name, const char *folder, const char *scan)
{
    char local[PATH_BYTES];
    if (strlen(name) >= sizeof local)
        return false;
    memcpy(local, name, strlen(name) + 1);
    for (char *p = local; *p; p++)
        if (*p == '\\')
            *p = '/';
    const char *const last = local + folder_bytes(local);
    if (local[0] == '/' && look(path, "", 0, local))
        return true;
    return look(path, folder, strlen(folder), local) || look(path, scan, folder_bytes(scan), local) ||
           look(path, folder, strlen(folder), last) || look(path, scan, folder_bytes(scan), last);
}

/* ---- libraries -------------------------------------------------------------------------------- */

static enum spc_status read_library(struct obj *o, const char *name, const char *scan, bool *found,
                                    struct spc_error *err)
{
    struct obj_paint *const p = o->paint;
    struct spc_error why = {.status = SPC_OK};
    *found = find_file(p->path, name, "", scan);
    if (!*found)
        return SPC_OK;
    const enum spc_status status = spb_mtl_read(&p->mtl, p->path, &why);
    if (status == SPC_NO_MEMORY)
        return no_memory(err);
    if (status != SPC_OK)
        miss(o, "material library", name, why.what);
    return SPC_OK;
}

/* One name with blanks, or several: the former first, which is never an accident. */
static enum spc_status read_libraries(struct obj *o, const char *scan, struct spc_error *err)
{
    struct obj_paint *const p = o->paint;
    for (uint32_t i = 0; i < p->library_count; i++) {
        bool found;
        enum spc_status status = read_library(o, p->libraries[i], scan, &found, err);
        if (status != SPC_OK)
            return status;
        bool some = found;
        char *rest = NULL, whole[MTL_NAME_MAX + 1];
        memcpy(whole, p->libraries[i], sizeof whole);
        for (char *word = strtok_r(p->libraries[i], " \t", &rest); word && !found;
             word = strtok_r(NULL, " \t", &rest)) {
            bool one;
            status = read_library(o, word, scan, &one, err);
            if (status != SPC_OK)
                return status;
            some |= one;
        }
        if (!some)
            miss(o, "material library", whole, "was not found");
    }
    return SPC_OK;
}

/* ---- textures --------------------------------------------------------------------------------- */

/* The picture at p->path, or the one that was not found by that name; each once. */
static enum spc_status add_texture(struct obj *o, const char *name, bool found,
                                   const struct spb_source_options *options, uint32_t *number,
                                   struct spc_error *err)
{
    struct obj_paint *const p = o->paint;
    const char *const key = found ? p->path : name;
    struct spc_error why = {.status = SPC_OK};
    enum spc_status status = spb_mtl_add(&p->files, key, strlen(key), err);
    const uint32_t file = spb_mtl_find(&p->files, key, strlen(key));
    *number = MTL_NONE;
    if (status != SPC_OK || file == MTL_NONE)
        return status;
    struct mtl_material *const f = &p->files.materials[file];
    *number = f->texture;
    if (f->defined)
        return SPC_OK;
    f->defined = true;
    if (!found) {
        miss(o, "texture", name, "was not found");
        return SPC_OK;
    }
    if (!p->textures)
        status = spb_textures_create(options->temp, &p->textures, err);
    if (status == SPC_OK)
        status = spb_textures_add(p->textures, p->path, options->progress, number, &why);
    if (status == SPC_INPUT_FORMAT) {
        miss(o, "texture", name, why.what);
        return SPC_OK;
    }
    if (status != SPC_OK && why.status != SPC_OK && err)
        *err = why;
    if (status == SPC_OK)
        f->texture = *number;
    return status;
}

static enum spc_status read_textures(struct obj *o, const struct spb_source_options *options,
                                     bool *some, struct spc_error *err)
{
    struct obj_paint *const p = o->paint;
    enum spc_status status = SPC_OK;
    for (uint32_t i = 0; i < p->mtl.count && status == SPC_OK; i++) {
        struct mtl_material *const m = &p->mtl.materials[i];
        if (m->map == MTL_NONE)
            continue;
        const char *const name = p->mtl.text + m->map;
        const char *const folder = m->folder == MTL_NONE ? "" : p->mtl.text + m->folder;
        const bool found = find_file(p->path, name, folder, options->path);
        status = add_texture(o, name, found, options, &m->texture, err);
        *some |= status == SPC_OK && m->texture != MTL_NONE;
    }
    return status;
}

/* ---- uv --------------------------------------------------------------------------------------- */

/* u and v of a vt line; not a number where they are none. */
static enum spc_status take_uv(struct obj *o, float uv[2], struct spc_error *err)
{
    struct obj_text *const t = &o->text;
    struct spb_bytes *const b = t->bytes;
    uv[0] = NAN;
    uv[1] = 0;                          /* of one-dimensional textures */
    for (int a = 0; a < 2; a++) {
        bool more;
        double value;
        const enum spc_status status = obj_to_word(t, &more, err);
        if (status != SPC_OK || !more)
            return status;
        const uint8_t *const p = spb_number_real(b->buf + b->pos, &value);
        uv[a] = p && obj_word_ends(t, p) ? (float)value : NAN;
        if (!p)
            break;
        b->pos = (size_t)(p - b->buf);
    }
    return SPC_OK;
}

static enum spc_status read_uvs(struct obj *o, struct spb_temp *temp, struct spc_error *err)
{
    struct obj_paint *const p = o->paint;
    float (*const batch)[2] = malloc(UV_BATCH * sizeof *batch);
    enum spc_status status = batch ? spb_tmpfile_create(temp, &p->uv_file, err) : no_memory(err);
    uint64_t count = 0;
    bool more = true;
    spb_obj_begin_pass(o, &o->uv_lines);
    while (status == SPC_OK) {
        status = spb_obj_next_line(o, &more, err);
        const bool here = status == SPC_OK && more &&
            spb_obj_keyword(&o->text, o->text.bytes->buf + o->text.bytes->pos) == OBJ_UV;
        if (here) {
            o->text.bytes->pos += 2;
            status = take_uv(o, batch[count++ % UV_BATCH], err);
        }
        const size_t n = count % UV_BATCH ? count % UV_BATCH : UV_BATCH;
        uint64_t off = 0;
        if (status == SPC_OK && count > 0 && ((here && n == UV_BATCH) || (!more && n < UV_BATCH)))
            status = spb_tmpfile_append(p->uv_file, batch, n * sizeof *batch, &off, err);
        if (status != SPC_OK || !more)
            break;
        status = spb_obj_pass_line(&o->text, err);
    }
    free(batch);
    if (status == SPC_OK && count != o->uv_count)
        status = spc_fail(err, SPC_INPUT_TRUNCATED, SPC_NO_OFF, "vt lines are missing: the file was changed");
    return status;
}

/* One vt line; *known is false where it is none, or says no finite numbers. */
static enum spc_status get_uv(struct obj *o, uint64_t number, double uv[2], bool *known,
                              struct spc_error *err)
{
    struct obj_paint *const p = o->paint;
    const uint64_t piece = number >> PIECE_LOG2;
    const size_t slot = piece % PIECES;
    *known = number < o->uv_count;
    if (!*known)
        return SPC_OK;
    if (!p->uvs) {
        p->uvs = malloc(sizeof *p->uvs);
        if (!p->uvs)
            return no_memory(err);
        memset(p->uvs->piece, 255, sizeof p->uvs->piece);
    }
    struct uv_cache *const c = p->uvs;
    if (c->piece[slot] != piece) {
        const uint64_t first = piece << PIECE_LOG2, rest = o->uv_count - first;
        const size_t n = rest >> PIECE_LOG2 ? (size_t)1 << PIECE_LOG2 : (size_t)rest;
        c->piece[slot] = SPC_NO_OFF;
        const enum spc_status status = spb_tmpfile_read(p->uv_file, first * sizeof c->uv[0][0],
                                                        c->uv[slot], n * sizeof c->uv[0][0], err);
        if (status != SPC_OK)
            return status;
        c->piece[slot] = piece;
    }
    const float *const there = c->uv[slot][number & ((1u << PIECE_LOG2) - 1)];
    uv[0] = (double)there[0];
    uv[1] = (double)there[1];
    *known = isfinite(uv[0]) && isfinite(uv[1]);
    return SPC_OK;
}

/* ---- prepare ---------------------------------------------------------------------------------- */

/* The materials' own colours say something: two differ, or one is no grey. */
static bool materials_differ(const struct mtl *mtl)
{
    const struct mtl_material *first = NULL;
    for (uint32_t i = 0; i < mtl->count; i++) {
        const struct mtl_material *const m = &mtl->materials[i];
        if (!m->defined)
            continue;
        if (m->rgba[0] != m->rgba[1] || m->rgba[1] != m->rgba[2])
            return true;
        if (first && memcmp(first->rgba, m->rgba, sizeof m->rgba) != 0)
            return true;
        first = m;
    }
    return false;
}

static void tell_more_missing(struct obj *o)
{
    size_t length = strlen(o->paint_remark);
    if (o->paint->missing > 1)
        snprintf(o->paint_remark + length, sizeof o->paint_remark - length, " (and %" PRIu64 " more)",
                 o->paint->missing - 1);
    length = strlen(o->paint_remark);
    if (o->paint->mtl.left_out > 0)
        snprintf(o->paint_remark + length, sizeof o->paint_remark - length,
                 "%s%" PRIu64 " materials beyond %d were ignored", length ? "; " : "",
                 o->paint->mtl.left_out, MTL_MATERIALS_MAX);
}

enum spc_status spb_obj_paint_prepare(struct obj *o, const struct spb_source_options *options,
                                      struct spc_error *err)
{
    struct obj_paint *const p = o->paint;
    enum spc_status status = SPC_OK;
    bool textured = false;
    if (!p)
        return SPC_OK;
    if (options->path && p->mtl.count > 0)
        status = read_libraries(o, options->path, err);
    if (status == SPC_OK && options->path && options->temp && o->uv_count > 0)
        status = read_textures(o, options, &textured, err);
    if (status == SPC_OK && textured)
        status = read_uvs(o, options->temp, err);
    if (status != SPC_OK)
        return status;
    tell_more_missing(o);
    spb_mtl_release(&p->files);
    free(p->libraries);
    p->libraries = NULL;
    if (!textured && (o->colored > 0 || !materials_differ(&p->mtl))) {
        spb_obj_paint_free(p);
        o->paint = NULL;
    }
    return SPC_OK;
}

void spb_obj_paint_free(struct obj_paint *p)
{
    if (!p)
        return;
    spb_mtl_release(&p->mtl);
    spb_mtl_release(&p->files);
    spb_textures_free(p->textures);
    spb_tmpfile_free(p->uv_file);
    free(p->uvs);
    free(p->libraries);
    free(p);
}

void spb_obj_paint_pause(struct obj_paint *p)
{
    if (!p)
        return;
    spb_textures_pause(p->textures);
    free(p->uvs);
    p->uvs = NULL;
}

/* ---- the face pass ---------------------------------------------------------------------------- */

void spb_obj_paint_begin(struct obj *o)
{
    if (o->paint)
        o->paint->material = MTL_NONE;
}

enum spc_status spb_obj_paint_use(struct obj *o, struct spc_error *err)
{
    char name[MTL_NAME_MAX + 1];
    size_t length;
    o->text.bytes->pos += 6;
    const enum spc_status status = spb_obj_name(&o->text, name, &length, err);
    o->paint->material = spb_mtl_find(&o->paint->mtl, name, length);
    return status;
}

enum spc_status spb_obj_paint_triangle(struct obj *o, const uint64_t uv[3], uint8_t rgba[3][4],
                                       struct spc_error *err)
{
    struct obj_paint *const p = o->paint;
    const struct mtl_material *m = NULL;
    double at[3][2];
    bool known = true;
    enum spc_status status = SPC_OK;

    memset(rgba, 255, 12);
    if (p->material == MTL_NONE)
        return SPC_OK;
    m = &p->mtl.materials[p->material];
    for (int k = 0; k < 3; k++)
        memcpy(rgba[k], m->rgba, 4);
    if (m->texture == MTL_NONE)
        return SPC_OK;
    for (int k = 0; k < 3 && known && status == SPC_OK; k++)
        status = get_uv(o, uv[k], at[k], &known, err);
    if (status != SPC_OK || !known)
        return status;
    return spb_textures_paint(p->textures, m->texture, &m->placement, (const double(*)[2])at, rgba, err);
}
