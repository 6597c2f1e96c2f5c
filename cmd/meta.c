#include "meta.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool no_memory;

static void *allocate(size_t bytes)
{
    void *p = malloc(bytes);
    if (p == NULL)
        no_memory = true;
    return p;
}

void meta_init(void)
{
    json_set_alloc_funcs(allocate, free);
}

bool meta_no_memory(void)
{
    return no_memory;
}

static const char *base_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

json_t *meta_name(const char *name)
{
    json_t *text = json_string(name);
    if (text != NULL)
        return text;
    char ascii[256];
    size_t i = 0;
    for (; name[i] && i < sizeof ascii - 1; i++)
        ascii[i] = (unsigned char)name[i] < 0x80 ? name[i] : '?';
    ascii[i] = '\0';
    return json_string(ascii);
}

json_t *meta_sources(const struct spb_build_options *b)
{
    json_t *out = json_array();
    for (uint32_t i = 0; i <= b->more_count; i++) {
        const struct spb_scan_facts *f = &b->facts[i];
        const char *path = i == 0 ? b->scan : b->more[i - 1];
        json_array_append_new(out, json_pack("{s:o, s:s, s:I, s:I}", "name", meta_name(base_name(path)),
                                             "format", f->format, "vertices", (json_int_t)f->vertices,
                                             "faces", (json_int_t)f->faces));
    }
    return out;
}

/* ---- coordinates ------------------------------------------------------------------------------- */

/* Archives come from anybody: what no tool writes, such as what a terminal would act on, is no word. */
static void copy_word(const json_t *from, const char *key, char *out, size_t bytes)
{
    const char *word = json_string_value(json_object_get(from, key));
    bool plain = word != NULL && strlen(word) < bytes;
    for (const char *p = word; plain && *p != '\0'; p++)
        plain = *p > ' ' && *p < 127;
    snprintf(out, bytes, "%s", plain ? word : "");
}

void meta_read_coordinates(const json_t *meta, struct meta_coordinates *c)
{
    const json_t *from = json_object_get(meta, "coordinates");
    const json_t *offset = json_object_get(from, "offset"), *scale = json_object_get(from, "scale");
    *c = (struct meta_coordinates){.has_offset = json_array_size(offset) == 3,
                                   .has_scale = json_is_number(scale), .scale = 1};
    for (size_t a = 0; a < 3 && c->has_offset; a++)
        c->offset[a] = json_number_value(json_array_get(offset, a));
    if (c->has_scale)
        c->scale = json_number_value(scale);
    copy_word(from, "up", c->up, sizeof c->up);
    copy_word(from, "unit", c->unit, sizeof c->unit);
    copy_word(from, "crs", c->crs, sizeof c->crs);
}

static void default_word(char *word, const char *other, size_t bytes)
{
    if (word[0] == '\0')
        snprintf(word, bytes, "%s", other);
}

void meta_default_coordinates(struct meta_coordinates *c, const struct meta_coordinates *other)
{
    if (!c->has_offset)
        memcpy(c->offset, other->offset, sizeof c->offset);
    if (!c->has_scale)
        c->scale = other->scale;
    c->has_offset |= other->has_offset;
    c->has_scale |= other->has_scale;
    default_word(c->up, other->up, sizeof c->up);
    default_word(c->unit, other->unit, sizeof c->unit);
    default_word(c->crs, other->crs, sizeof c->crs);
}

/* NULL when there is nothing to say. */
static json_t *coordinates_json(const struct meta_coordinates *c)
{
    json_t *out = json_object();
    if (c->has_offset)
        json_object_set_new(out, "offset", json_pack("[f, f, f]", c->offset[0], c->offset[1], c->offset[2]));
    if (c->has_scale)
        json_object_set_new(out, "scale", json_real(c->scale));
    const char *const words[][2] = {{"up", c->up}, {"unit", c->unit}, {"crs", c->crs}};
    for (size_t i = 0; i < 3; i++)
        if (words[i][1][0] != '\0')
            json_object_set_new(out, words[i][0], json_string(words[i][1]));
    if (json_object_size(out) > 0)
        return out;
    json_decref(out);
    return NULL;
}

/* ---- coding ------------------------------------------------------------------------------------ */

static uint64_t count_in(const json_t *from, const char *key)
{
    const json_int_t n = json_integer_value(json_object_get(from, key));
    return n > 0 ? (uint64_t)n : 0;
}

static double length_in(const json_t *from, const char *key)
{
    const double v = json_number_value(json_object_get(from, key));
    return v > 0 && v < HUGE_VAL ? v : 0;
}

void meta_read_coding(const json_t *meta, const struct spc_header *header, struct meta_coding *out)
{
    const json_t *from = json_object_get(meta, "coding");
    const double step = ldexp(1, header->vertex_exp), coarsest = length_in(from, "coarsest_step");
    *out = (struct meta_coding){.moved = count_in(from, "lost_shape"), .flat = count_in(from, "lost_area"),
                                .least = length_in(from, "smallest"), .most = length_in(from, "largest"),
                                .coarsest_step = coarsest > step ? coarsest : step};
}

json_t *meta_coding_json(const struct spb_build_report *r)
{
    const struct spb_shapes *s = &r->shapes;
    json_t *out = json_object();
    if (s->moved > 0)
        json_object_update_new(out, json_pack("{s:I, s:f, s:f}", "lost_shape", (json_int_t)s->moved,
                                              "smallest", s->least, "largest", s->most));
    if (s->flat > 0)
        json_object_set_new(out, "lost_area", json_integer((json_int_t)s->flat));
    if (r->coarse_exp > r->header.vertex_exp)
        json_object_set_new(out, "coarsest_step", json_real(ldexp(1, r->coarse_exp)));
    if (json_object_size(out) > 0)
        return out;
    json_decref(out);
    return NULL;
}

json_t *meta_new(const char *tool, const struct spb_build_options *b,
                 const struct spc_header *header, const struct meta_coordinates *coordinates,
                 json_t *sources)
{
    static const char *const culls[] = {"auto", "none", "back"};
    char codec[16] = "raw";
    if (b->codec == SPC_CODEC_ZSTD)
        snprintf(codec, sizeof codec, "zstd:%d", b->level);
    json_t *meta = json_pack(
        "{s:{s:s, s:s}, s:{s:s, s:s, s:s, s:b, s:i, s:i, s:i}, s:o}", "generator", "name", tool,
        "version", SPC_TOOL_VERSION, "options", "error", b->paper_error ? "paper" : "bound", "cull",
        culls[b->cull], "codec", codec, "triangles",
        (header->flags & SPC_FLAG_TRIANGLES) != 0, "cluster_nodes",
        (int)b->cluster_nodes, "block_nodes", (int)b->block_nodes, "normal_clusters",
        (int)header->normal_clusters, "sources", sources);
    if (b->detail >= 0)
        json_object_set_new(json_object_get(meta, "options"), "detail", json_real(b->detail));
    json_t *placed = coordinates != NULL ? coordinates_json(coordinates) : NULL;
    if (placed != NULL)
        json_object_set_new(meta, "coordinates", placed);
    return meta;
}

char *meta_text(json_t *meta, size_t flags)
{
    char *text = meta ? json_dumps(meta, flags) : NULL;
    json_decref(meta);
    if (!no_memory)
        return text;
    free(text);
    return NULL;
}
