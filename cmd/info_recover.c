/*
 * info_recover.c - spc-info --recover: an archive built anew from what is whole of a damaged one.
 *
 * Triangles are what counts: inner nodes and directory are made again from them. So nothing was lost
 * if every triangle is there, and the metadata; how many there were only a whole header knows. The
 * options of the new archive are those of the old one as far as its header, its metadata or its
 * first whole block tells them.
 */
#include "info.h"
#include "meta.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct recovery {
    const char *path;
    struct spc_remains remains;
    json_t *meta;                   /* of the damaged archive; NULL: not readable */
    struct spb_scan_facts facts;
    struct spb_build_options build;
    struct spb_build_report report;
};

/* ---- options ----------------------------------------------------------------------------------- */

static uint32_t within(uint32_t v, uint32_t min, uint32_t max)
{
    return v < min ? min : v > max ? max : v;
}

static const char *old_option(const struct recovery *r, const char *name)
{
    const char *word = json_string_value(json_object_get(json_object_get(r->meta, "options"), name));
    return word ? word : "";
}

/* What was not culled stays so; what was is told anew, for a surface with holes is open. */
static enum spb_cull cull_of(const struct recovery *r, uint32_t flags)
{
    if (!(flags & SPC_FLAG_CULL_BACK))
        return SPB_CULL_NONE;
    return strcmp(old_option(r, "cull"), "back") == 0 ? SPB_CULL_BACK : SPB_CULL_AUTO;
}

static void take_header(struct recovery *r, const struct spc_header *h)
{
    struct spb_build_options *b = &r->build;
    const uint32_t automatic = h->flags & SPC_FLAG_CULL_BACK ? 128 : 1;
    b->cluster_nodes = within(h->cluster_nodes, 16, 1u << 24);
    b->block_nodes = within(h->block_nodes, 4, 65535);
    b->normal_clusters = h->normal_clusters == automatic ? 0 : h->normal_clusters;
}

static void choose_options(struct recovery *r)
{
    const struct spc_header *h = r->remains.header;
    struct spb_build_options *b = &r->build;
    struct spc_frame frame = {.flags = 0};
    struct spc_block block;
    uint64_t at = 0;
    if (spc_chunk_find(r->remains.bytes, r->remains.size, &at, &block, &frame))
        b->codec = block.codec;
    const uint32_t flags = h ? h->flags : frame.flags;
    const char *codec = old_option(r, "codec");
    uint32_t level = 1;
    if (strncmp(codec, "zstd:", 5) == 0 && cli_u32(codec + 5, 1, 19, &level))
        b->level = (int)level;
    b->paper_error = (flags & SPC_FLAG_ERROR_PAPER) != 0;
    b->cull = cull_of(r, flags);
    if (h != NULL)
        take_header(r, h);
}

/* 0 stands for a number that nobody knows. */
static json_t *known(uint64_t n)
{
    return n ? json_integer((json_int_t)n) : json_null();
}

static char *make_meta(void *ctx, const struct spc_header *header)
{
    struct recovery *r = ctx;
    const struct spb_salvage *v = &r->report.salvage;
    json_t *sources = json_incref(json_object_get(r->meta, "sources"));
    if (sources == NULL)
        sources = meta_sources(&r->build);
    struct meta_coordinates coordinates;
    meta_read_coordinates(r->meta, &coordinates);
    json_t *meta = meta_new("spc-info --recover", &r->build, header, &coordinates, sources);
    json_object_set_new(meta, "recovered",
                        json_pack("{s:I, s:o}", "triangles", (json_int_t)v->triangles, "of",
                                  known(v->triangles_of)));
    json_object_set(meta, "coding", json_object_get(r->meta, "coding"));
    return meta_text(meta, JSON_COMPACT);
}

/* ---- what was found ---------------------------------------------------------------------------- */

static bool all_there(const struct recovery *r)
{
    const struct spb_salvage *v = &r->report.salvage;
    return v->header && r->meta != NULL && v->triangles == v->triangles_of &&
           r->report.header.leaf_count == v->triangles;
}

static void print_head(const struct recovery *r)
{
    const struct spb_salvage *v = &r->report.salvage;
    if (v->fault.status == SPC_OK)
        puts("head       whole");
    else
        printf("head       damaged: %s\n", v->fault.what);
    if (r->meta == NULL)
        puts("metadata   lost: sources and level of compression are not known");
}

static void print_counts(const struct spb_salvage *v)
{
    char a[CLI_TEXT], b[CLI_TEXT], c[CLI_TEXT];
    if (v->blocks_of > 0)
        printf("blocks     %s of %s are whole, %s damaged or missing\n", cli_count_text(v->blocks, a),
               cli_count_text(v->blocks_of, b), cli_count_text(v->blocks_of - v->blocks, c));
    else
        printf("blocks     %s are whole, of an unknown number\n", cli_count_text(v->blocks, a));
    if (v->blocks_foreign > 0)
        printf("strange    %s whole blocks of another archive, or twice in the file: passed over\n",
               cli_count_text(v->blocks_foreign, a));
    if (v->triangles_of > 0)
        printf("triangles  %s of %s recovered\n", cli_count_text(v->triangles, a),
               cli_count_text(v->triangles_of, b));
    else
        printf("triangles  %s recovered, of an unknown number\n", cli_count_text(v->triangles, a));
}

static void print_lost(const struct spb_salvage *v)
{
    char a[CLI_TEXT], b[CLI_TEXT];
    for (uint64_t i = 0; i < v->lost_clusters && i < SPB_LOST_MAX; i++) {
        const struct spb_lost *l = &v->lost[i];
        printf("lost       %s of %s triangles of cluster %u, inside %.9g %.9g %.9g .. %.9g %.9g %.9g\n",
               cli_count_text(l->triangles, a), cli_count_text(l->triangles_of, b), l->cluster,
               l->min[0], l->min[1], l->min[2], l->max[0], l->max[1], l->max[2]);
    }
    if (v->lost_clusters > SPB_LOST_MAX)
        printf("lost       triangles of %s more clusters\n",
               cli_count_text(v->lost_clusters - SPB_LOST_MAX, a));
}

static void print_text(const struct recovery *r)
{
    const struct spb_salvage *v = &r->report.salvage;
    char a[CLI_TEXT], b[CLI_TEXT];
    print_head(r);
    print_counts(v);
    if (v->triangles_of > v->triangles && !v->directory)
        puts("lost       triangles of unknown places: the directory is damaged");
    print_lost(v);
    printf("%s: %s triangles, %s; %s\n", r->build.out,
           cli_count_text(r->report.header.leaf_count, a),
           cli_bytes_text(r->report.header.file_bytes, b),
           all_there(r) ? "nothing is lost"
           : v->header && v->triangles == v->triangles_of ? "no triangle is lost"
           : v->header ? "with loss" : "whether triangles are lost is not known");
}

static json_t *lost_json(const struct spb_salvage *v)
{
    json_t *list = json_array();
    for (uint64_t i = 0; i < v->lost_clusters && i < SPB_LOST_MAX; i++) {
        const struct spb_lost *l = &v->lost[i];
        json_array_append_new(
            list, json_pack("{s:I, s:I, s:I, s:{s:[f, f, f], s:[f, f, f]}}", "cluster",
                            (json_int_t)l->cluster, "triangles", (json_int_t)l->triangles, "of",
                            (json_int_t)l->triangles_of, "box", "min", l->min[0], l->min[1],
                            l->min[2], "max", l->max[0], l->max[1], l->max[2]));
    }
    return list;
}

/* False without memory. */
static bool print_json(const struct recovery *r)
{
    const struct spb_salvage *v = &r->report.salvage;
    json_t *out = json_pack(
        "{s:s, s:o, s:b, s:b, s:b, s:b, s:s?, s:{s:I, s:o, s:I}, s:{s:I, s:o}, s:o, s:o, s:I}",
        "schema", "spc-recover/1", "output", meta_name(r->build.out), "all", (int)all_there(r),
        "header", (int)v->header, "directory", (int)v->directory, "metadata", (int)(r->meta != NULL),
        "fault", v->fault.status == SPC_OK ? NULL : spc_status_name(v->fault.status), "blocks",
        "whole", (json_int_t)v->blocks, "of", known(v->blocks_of), "strange",
        (json_int_t)v->blocks_foreign, "triangles", "recovered",
        (json_int_t)r->report.header.leaf_count, "of", known(v->triangles_of), "lost_clusters",
        v->directory ? json_integer((json_int_t)v->lost_clusters) : json_null(), "lost",
        lost_json(v), "file_bytes", (json_int_t)r->report.header.file_bytes);
    char *text = meta_text(out, JSON_INDENT(2));
    if (text != NULL)
        puts(text);
    free(text);
    return text != NULL;
}

/* ---- all of it --------------------------------------------------------------------------------- */

static int build_failed(const char *file, const struct spc_error *err)
{
    cli_error(file, err,
              err->status == SPC_EXISTS ? "--force replaces it" : cli_disk_remedy(err, "free some space there"));
    switch (err->status) {
    case SPC_INPUT_EMPTY:
    case SPC_INPUT_BAD:
    case SPC_VERSION:
    case SPC_FEATURE: return EXIT_INVALID;
    default: return EXIT_FAILED;
    }
}

static int no_memory(const char *path, const char *what)
{
    struct spc_error err = {0};
    spc_fail(&err, SPC_NO_MEMORY, SPC_NO_OFF, "%s", what);
    cli_error(path, &err, NULL);
    return EXIT_FAILED;
}

static int rebuild(struct recovery *r, bool json)
{
    struct spc_error err = {0};
    const char *file = NULL;
    choose_options(r);
    cli_catch_signals();
    cli_progress_begin(CLI_PROGRESS_AUTO, r->path, 0, 0);
    const enum spc_status status = spb_build(&r->build, &r->report, &file, &err);
    cli_progress_end();
    if (status != SPC_OK)
        return build_failed(file, &err);
    if (!json)
        print_text(r);
    else if (!print_json(r))
        return no_memory(r->build.out, "the archive is complete, but no memory for the report");
    if (cli_unreadable())
        cli_warn(r->path, "part of it cannot be read: the disk fails, or it was cut short");
    return all_there(r) ? EXIT_DONE : EXIT_FAILED;
}

int info_recover(const char *path, const char *out, bool force, bool json)
{
    struct recovery r = {.path = path};
    struct spc_error err = {0};
    if (spc_remains_open(path, &r.remains, &err) != SPC_OK) {
        cli_error(path, &err, NULL);
        return err.status == SPC_NOT_SPC ? EXIT_INVALID : EXIT_FAILED;
    }
    if (r.remains.meta != NULL)
        r.meta = json_loadb(r.remains.meta, r.remains.meta_bytes, 0, NULL);
    spb_build_defaults(&r.build);
    r.build.scan = path;
    r.build.facts = &r.facts;
    r.build.out = out;
    r.build.force = force;
    r.build.salvage = true;
    r.build.progress = (struct spb_progress){cli_progress, NULL};
    r.build.meta = make_meta;
    r.build.meta_ctx = &r;
    /* Without memory for them metadata would be lost in silence. */
    const int code = meta_no_memory() ? no_memory(path, "no memory for the metadata") : rebuild(&r, json);
    json_decref(r.meta);
    spc_remains_close(&r.remains);
    return cli_finish(code);
}
