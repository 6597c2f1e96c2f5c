#include "meta.h"

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

json_t *meta_source(const char *path, const char *format, uint64_t vertices, uint64_t faces)
{
    return json_pack("{s:o, s:s, s:I, s:I}", "name", meta_name(base_name(path)), "format", format,
                     "vertices", (json_int_t)vertices, "faces", (json_int_t)faces);
}

json_t *meta_new(const char *tool, const struct spb_build_options *b,
                 const struct spc_header *header, json_t *sources)
{
    static const char *const culls[] = {"auto", "none", "back"};
    char codec[16] = "raw";
    if (b->codec == SPC_CODEC_ZSTD)
        snprintf(codec, sizeof codec, "zstd:%d", b->level);
    return json_pack(
        "{s:{s:s, s:s}, s:{s:s, s:s, s:s, s:b, s:i, s:i, s:i}, s:o}", "generator", "name", tool,
        "version", SPC_TOOL_VERSION, "options", "error", b->paper_error ? "paper" : "bound", "cull",
        culls[b->cull], "codec", codec, "triangles", (int)b->triangles, "cluster_nodes",
        (int)b->cluster_nodes, "block_nodes", (int)b->block_nodes, "normal_clusters",
        (int)header->normal_clusters, "sources", sources);
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
