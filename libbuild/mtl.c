/*
 * A library is lines: newmtl NAME begins a material, Kd its colour, map_Kd [options] FILE the picture
 * that it is covered with. Everything else is about light and passed over. Keywords are taken in
 * any case, since writers differ (map_kd). File names go on to the end of the line, blanks and all.
 * The colour of a material with a picture is not multiplied with it: half of the programs that
 * write both mean the picture as it is.
 */
#include "mtl.h"

#include "bytesource.h"
#include "number.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LINE_MAX_BYTES = 4096, SLOTS_AT_FIRST = 256 };

static enum spc_status no_memory(struct spc_error *err)
{
    return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for materials");
}

enum spc_status spb_mtl_init(struct mtl *m, struct spc_error *err)
{
    *m = (struct mtl){.slots = malloc(SLOTS_AT_FIRST * sizeof *m->slots), .slot_count = SLOTS_AT_FIRST};
    if (!m->slots)
        return no_memory(err);
    memset(m->slots, 255, SLOTS_AT_FIRST * sizeof *m->slots);
    return SPC_OK;
}

void spb_mtl_release(struct mtl *m)
{
    free(m->materials);
    free(m->text);
    free(m->slots);
    *m = (struct mtl){.count = 0};
}

/* ---- names ------------------------------------------------------------------------------------ */

/* Copies a name into the text; MTL_NONE in *out: there is no room left. */
static enum spc_status keep(struct mtl *m, const char *name, size_t length, uint32_t *out,
                            struct spc_error *err)
{
    *out = MTL_NONE;
    if (m->text_bytes + length + 1 > MTL_TEXT_MAX)
        return SPC_OK;
    if (m->text_bytes + length + 1 > m->text_room) {
        const size_t room = 2 * (m->text_bytes + length + 1);
        char *const text = realloc(m->text, room);
        if (!text)
            return no_memory(err);
        m->text = text;
        m->text_room = room;
    }
    *out = (uint32_t)m->text_bytes;
    memcpy(m->text + m->text_bytes, name, length);
    m->text[m->text_bytes + length] = 0;
    m->text_bytes += length + 1;
    return SPC_OK;
}

/* The slot that holds the name, or the empty one where it belongs. */
static uint32_t slot_of(const struct mtl *m, const char *name, size_t length)
{
    uint64_t h = 0xcbf29ce484222325u;
    for (size_t i = 0; i < length; i++)
        h = (h ^ (uint8_t)name[i]) * 0x100000001b3u;
    uint32_t slot = (uint32_t)(h ^ h >> 32) % m->slot_count;
    for (; m->slots[slot] != MTL_NONE; slot = (slot + 1) % m->slot_count) {
        const char *const there = m->text + m->materials[m->slots[slot]].name;
        if (strlen(there) == length && memcmp(there, name, length) == 0)
            break;
    }
    return slot;
}

/* Twice the slots, when half of them are taken. */
static enum spc_status more_slots(struct mtl *m, struct spc_error *err)
{
    if (2 * m->count < m->slot_count)
        return SPC_OK;
    uint32_t *const slots = malloc(2 * m->slot_count * sizeof *slots);
    if (!slots)
        return no_memory(err);
    free(m->slots);
    m->slots = slots;
    m->slot_count *= 2;
    memset(slots, 255, m->slot_count * sizeof *slots);
    for (uint32_t i = 0; i < m->count; i++) {
        const char *const name = m->text + m->materials[i].name;
        slots[slot_of(m, name, strlen(name))] = i;
    }
    return SPC_OK;
}

/* A name ends at a zero in it, on both sides alike. */
static size_t name_length(const char *name, size_t length)
{
    const char *const zero = length > 0 ? memchr(name, 0, length) : NULL;
    return zero ? (size_t)(zero - name) : length;
}

uint32_t spb_mtl_find(const struct mtl *m, const char *name, size_t length)
{
    return m->slots ? m->slots[slot_of(m, name, name_length(name, length))] : MTL_NONE;
}

enum spc_status spb_mtl_add(struct mtl *m, const char *name, size_t length, struct spc_error *err)
{
    length = name_length(name, length);
    enum spc_status status = more_slots(m, err);
    if (status != SPC_OK)
        return status;
    const uint32_t slot = slot_of(m, name, length);
    uint32_t kept = MTL_NONE;
    if (m->slots[slot] != MTL_NONE)
        return SPC_OK;
    if (m->count < MTL_MATERIALS_MAX)
        status = keep(m, name, length, &kept, err);
    if (status != SPC_OK)
        return status;
    if (kept == MTL_NONE) {
        m->left_out++;
        return SPC_OK;
    }
    if ((m->count & (m->count - 1)) == 0) {     /* full: a power of two, and 0 */
        struct mtl_material *const more =
            realloc(m->materials, (m->count ? 2 * (size_t)m->count : 1) * sizeof *more);
        if (!more)
            return no_memory(err);
        m->materials = more;
    }
    m->materials[m->count] = (struct mtl_material){
        .name = kept, .rgba = {255, 255, 255, 255}, .map = MTL_NONE, .folder = MTL_NONE,
        .texture = MTL_NONE, .placement = {.scale = {1, 1}},
    };
    m->slots[slot] = m->count++;
    return SPC_OK;
}

/* ---- lines ------------------------------------------------------------------------------------ */

static bool is_blank(char c)
{
    return c == ' ' || (unsigned char)(c - '\t') < 5;
}

static char *pass_blanks(char *p)
{
    while (is_blank(*p))
        p++;
    return p;
}

static char *pass_word(char *p)
{
    while (*p && !is_blank(*p))
        p++;
    return p;
}

/* Steps over the word at *p when it is this one, in any case, and over the blanks behind it. */
static bool take_word(char **p, const char *word)
{
    char *q = *p;
    for (; *word; word++, q++) {
        const char c = *q >= 'A' && *q <= 'Z' ? (char)(*q + 32) : *q;
        if (c != *word)
            return false;
    }
    if (*q && !is_blank(*q))
        return false;
    *p = pass_blanks(q);
    return true;
}

/* A number that is a word of its own, with another word behind it or not. */
static bool take_number(char **p, double *out)
{
    const uint8_t *const q = spb_number_real((const uint8_t *)*p, out);
    if (!q || (*q && !is_blank((char)*q)))
        return false;
    *p = pass_blanks(*p + (q - (const uint8_t *)*p));
    return true;
}

/* Up to three numbers, of which two count, but never the last word: that is the file's name. */
static void take_vector(char **p, double out[2])
{
    for (int k = 0; k < 3; k++) {
        char *q = *p;
        double value;
        if (!take_number(&q, &value) || !*q)
            return;
        if (k < 2)
            out[k] = value;
        *p = q;
    }
}

/* The options before a picture's name. */
static void take_options(char **p, struct spb_placement *place)
{
    static const struct {
        const char *word;
        int words;                      /* behind it */
    } OTHERS[] = {
        {"-blendu", 1}, {"-blendv", 1}, {"-cc", 1}, {"-mm", 2}, {"-texres", 1}, {"-imfchan", 1},
        {"-boost", 1}, {"-bm", 1}, {"-type", 1},
    };
    for (bool more = true; more && **p == '-';) {
        double unused[2];
        more = true;
        if (take_word(p, "-s"))
            take_vector(p, place->scale);
        else if (take_word(p, "-o"))
            take_vector(p, place->offset);
        else if (take_word(p, "-t"))
            take_vector(p, unused);
        else if (take_word(p, "-clamp")) {
            place->clamp = take_word(p, "on");
            if (!place->clamp)
                take_word(p, "off");
        } else {
            more = false;
            for (size_t i = 0; i < sizeof OTHERS / sizeof *OTHERS && !more; i++) {
                more = take_word(p, OTHERS[i].word);
                for (int k = 0; more && k < OTHERS[i].words; k++)
                    *p = pass_blanks(pass_word(*p));
            }
        }
    }
}

static void take_color(char *p, uint8_t rgba[4], bool *colored)
{
    double value[3];
    for (int k = 0; k < 3; k++)
        if (!take_number(&p, &value[k])) {
            if (k != 1)
                return;                 /* "spectral", "xyz" */
            value[1] = value[2] = value[0];     /* one stands for all */
            break;
        }
    for (int k = 0; k < 3; k++)
        rgba[k] = value[k] >= 1 ? 255 : value[k] > 0 ? (uint8_t)(value[k] * 255 + 0.5) : 0;
    *colored = true;
}

struct library {
    struct mtl *mtl;
    uint32_t folder, material;          /* material: that lines are about; MTL_NONE: passed over */
};

/* One line, without blanks at its ends. */
static enum spc_status take_line(struct library *l, char *p, size_t length, struct spc_error *err)
{
    struct mtl *const m = l->mtl;
    char *const end = p + length;
    if (take_word(&p, "newmtl")) {
        l->material = spb_mtl_find(m, p, (size_t)(end - p) < MTL_NAME_MAX ? (size_t)(end - p)
                                                                          : MTL_NAME_MAX);
        if (l->material != MTL_NONE && m->materials[l->material].defined)
            l->material = MTL_NONE;
        if (l->material != MTL_NONE)
            m->materials[l->material].defined = true;
        return SPC_OK;
    }
    if (l->material == MTL_NONE)
        return SPC_OK;
    struct mtl_material *const material = &m->materials[l->material];
    if (take_word(&p, "kd"))
        take_color(p, material->rgba, &material->colored);
    if (!take_word(&p, "map_kd"))
        return SPC_OK;
    take_options(&p, &material->placement);
    if (end - p >= 2 && *p == '"' && end[-1] == '"') {
        p++;
        end[-1] = 0;
    }
    material->folder = l->folder;
    return *p ? keep(m, p, strlen(p), &material->map, err) : SPC_OK;
}

static enum spc_status trim_and_take(struct library *l, char *line, size_t length,
                                     struct spc_error *err)
{
    while (length > 0 && is_blank(line[length - 1]))
        length--;
    line[length] = 0;
    char *const p = pass_blanks(line);
    return take_line(l, p, (size_t)(line + length - p), err);
}

/* Longer lines than LINE_MAX_BYTES are passed over. */
static enum spc_status read_lines(struct library *l, struct spb_bytes *b, struct spc_error *err)
{
    char line[LINE_MAX_BYTES + 1];
    size_t length = 0;
    enum spc_status status = SPC_OK;
    while (status == SPC_OK) {
        status = spb_bytes_need(b, 1, NULL);
        if (status == SPC_NO_MEMORY)
            return no_memory(err);
        if (status != SPC_OK)
            return spc_fail(err, SPC_INPUT_FORMAT, SPC_NO_OFF, "cannot be read");
        if (spb_bytes_have(b) == 0)
            break;
        const char c = (char)b->buf[b->pos++];
        if (c != '\n' && c != '\r') {
            if (length < LINE_MAX_BYTES)
                line[length] = c;
            length++;
            continue;
        }
        if (length < LINE_MAX_BYTES)
            status = trim_and_take(l, line, length, err);
        length = 0;
    }
    if (status == SPC_OK && length < LINE_MAX_BYTES)
        status = trim_and_take(l, line, length, err);
    return status;
}

enum spc_status spb_mtl_read(struct mtl *m, const char *path, struct spc_error *err)
{
    struct library l = {.mtl = m, .folder = MTL_NONE, .material = MTL_NONE};
    const char *const slash = strrchr(path, '/');
    struct spb_bytes bytes;
    enum spc_status status = spb_bytes_open(&bytes, path, NULL, NULL, err);
    if (status == SPC_NO_MEMORY)
        return status;
    if (status != SPC_OK)
        return spc_fail(err, SPC_INPUT_FORMAT, SPC_NO_OFF, "was not found");
    status = keep(m, path, slash ? (size_t)(slash - path) + 1 : 0, &l.folder, err);
    if (status == SPC_OK)
        status = read_lines(&l, &bytes, err);
    spb_bytes_close(&bytes);
    return status;
}
