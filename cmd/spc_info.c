/* spc-info: what is in an archive, and proof that it is whole. */
#include "info.h"
#include "meta.h"

#include <getopt.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char HELP[] =
    "usage: spc-info [options] FILE\n"
    "Says what is in an .spc archive, and proves that it is whole.\n"
    "\n"
    "      --clusters         a line a cluster: counts, bytes, lengths, size, cone of\n"
    "                         normals; r_min comes of e_self, r_max of e_parent\n"
    "      --blocks ID        a line a block of cluster ID, in prefix order\n"
    "      --histogram OF     e, radius: octaves of the nodes' lengths;\n"
    "                         normals: directions; size: the clusters' stored bytes\n"
    "      --bytes            what stored bytes are spent on, the precision they buy\n"
    "      --verify[=LEVEL]   1: header, directory; 2: every byte; 3 (default): also\n"
    "                         rules between nodes. Exit 3 when one is broken\n"
    "      --recover OUT      build OUT from what is whole of a damaged FILE: exit 0\n"
    "                         nothing was lost, 1 something, 3 nothing is left\n"
    "      --force            let --recover replace an archive\n"
    "      --json             one object on standard output, lengths in file units\n"
    "  -h, --help    -V, --version\n"
    "\n"
    "  spc-info statue.spc\n"
    "  spc-info --clusters statue.spc | less -S\n"
    "  spc-info --verify statue.spc || spc-info statue.spc --recover rescued.spc\n";

enum { OPT_VERIFY = 256, OPT_JSON, OPT_CLUSTERS, OPT_BLOCKS, OPT_HISTOGRAM, OPT_BYTES,
       OPT_RECOVER, OPT_FORCE };
static const struct option LONG[] = {
    {"verify", 2, NULL, OPT_VERIFY}, {"json", 0, NULL, OPT_JSON},
    {"clusters", 0, NULL, OPT_CLUSTERS}, {"blocks", 1, NULL, OPT_BLOCKS},
    {"histogram", 1, NULL, OPT_HISTOGRAM}, {"recover", 1, NULL, OPT_RECOVER},
    {"bytes", 0, NULL, OPT_BYTES}, {"force", 0, NULL, OPT_FORCE},
    {"help", 0, NULL, 'h'}, {"version", 0, NULL, 'V'}, {0},
};

/* ---- facts of the archive that the header does not hold ------------------------------------------- */

struct facts {
    uint64_t bytes[2];              /* stored payloads by enum spc_block_kind */
    uint64_t raw_bytes[2];
    uint64_t zstd_blocks;
    uint32_t levels;                /* of clusters */
    json_t *meta;                   /* NULL when it is no JSON */
};

static void collect(const struct spc_reader *r, struct facts *f)
{
    const struct spc_header *h = spc_reader_header(r);
    size_t bytes = 0;
    const char *meta = spc_reader_meta(r, &bytes);
    struct spc_cluster last;
    *f = (struct facts){.meta = json_loadb(meta, bytes, 0, NULL)};
    for (uint32_t i = 0; i < h->block_count; i++) {
        struct spc_block b;
        spc_reader_block(r, i, &b);
        f->bytes[b.kind] += b.stored_bytes;
        f->raw_bytes[b.kind] += b.raw_bytes;
        f->zstd_blocks += b.codec == SPC_CODEC_ZSTD;
    }
    spc_reader_cluster(r, h->cluster_count - 1, &last);
    f->levels = last.level + 1;
}

static const char *codec_text(const struct spc_header *h, const struct facts *f)
{
    return f->zstd_blocks == 0 ? "raw" : f->zstd_blocks == h->block_count ? "zstd" : "mixed";
}

static uint64_t dropped(const struct spc_header *h)
{
    return h->dropped_bad_index + h->dropped_non_finite + h->dropped_degenerate;
}

/* ---- for people ------------------------------------------------------------------------------------ */

static void print_sources(const struct facts *f)
{
    json_t *sources = json_object_get(f->meta, "sources");
    for (size_t i = 0; i < json_array_size(sources); i++) {
        const char *name = NULL, *format = NULL;
        json_int_t vertices = 0, faces = 0;
        char a[CLI_TEXT], b[CLI_TEXT];
        if (json_unpack(json_array_get(sources, i), "{s:s, s:s, s:I, s:I}", "name", &name, "format",
                        &format, "vertices", &vertices, "faces", &faces) != 0)
            continue;
        printf("source     ");
        cli_put_name(stdout, name);
        printf(" (");
        cli_put_name(stdout, format);
        printf("): %s vertices, %s faces\n", cli_count_text((uint64_t)vertices, a),
               cli_count_text((uint64_t)faces, b));
    }
}

/* Where it lies in the world, as far as somebody has said so. */
static void print_coordinates(const struct spc_header *h, const struct facts *f)
{
    struct meta_coordinates c;
    meta_read_coordinates(f->meta, &c);
    if (c.has_offset || c.has_scale) {
        printf("world box  ");
        for (int a = 0; a < 6; a++)
            printf("%.12g%s", (a < 3 ? h->box_min[a] : h->box_max[a - 3]) * c.scale + c.offset[a % 3],
                   a == 2 ? " .. " : a == 5 ? "" : " ");
        printf(" (x %.9g + %.12g %.12g %.12g)\n", c.scale, c.offset[0], c.offset[1], c.offset[2]);
    }
    if (c.unit[0] || c.up[0] || c.crs[0])
        printf("world      %s%s%s%s%s%s%s\n", c.crs, c.crs[0] && c.unit[0] ? ", " : "",
               c.unit[0] ? "unit " : "", c.unit, (c.crs[0] || c.unit[0]) && c.up[0] ? ", " : "",
               c.up[0] ? "up is " : "", c.up);
}

/* faces_in + split_extra + points_in = leaves + dropped */
static void print_accounts(const struct spc_header *h)
{
    char a[CLI_TEXT], b[CLI_TEXT];
    if (h->points_in > 0)
        printf("read       %s points", cli_count_text(h->points_in, a));
    else
        printf("read       %s faces", cli_count_text(h->faces_in, a));
    if (h->split_extra > 0)
        printf(" + %s by splitting polygons", cli_count_text(h->split_extra, a));
    printf(" = %s leaves", cli_count_text(h->leaf_count, b));
    if (dropped(h) > 0)
        printf(" + %s dropped: %llu bad index, %llu not finite, %llu degenerate",
               cli_count_text(dropped(h), a), (unsigned long long)h->dropped_bad_index,
               (unsigned long long)h->dropped_non_finite, (unsigned long long)h->dropped_degenerate);
    putchar('\n');
}

/* What the scan lost when it was coded. */
static void print_coding(const struct spc_header *h, const struct facts *f)
{
    struct meta_coding c;
    char a[CLI_TEXT], b[CLI_TEXT];
    meta_read_coding(f->meta, h, &c);
    if (c.coarsest_step > ldexp(1, h->vertex_exp))
        printf("           of up to %.3g where no detail is fine\n", c.coarsest_step);
    if (c.moved > 0)
        printf("changed    %s of %.2g to %.2g across lost their shape on it\n",
               cli_count_text(c.moved, a), c.least, c.most);
    if (c.flat > 0)
        printf("%s%s so thin that they have no area on it\n", c.moved > 0 ? "           " : "changed    ",
               cli_count_text(c.flat, b));
}

static void print_text(const char *path, const struct spc_reader *r, const struct facts *f)
{
    const struct spc_header *h = spc_reader_header(r);
    char a[CLI_TEXT], b[CLI_TEXT], c[CLI_TEXT];
    cli_put_name(stdout, path);
    printf(": .spc archive, development version, %s\n", cli_bytes_text(h->file_bytes, a));
    print_sources(f);
    print_accounts(h);
    printf("nodes      %s, of them %s leaves; %u levels\n", cli_count_text(h->node_count, a),
           cli_count_text(h->leaf_count, b), h->height);
    if (h->flags & SPC_FLAG_TRIANGLES)
        printf("triangles  %s with %s vertices, on a lattice of %.3g\n",
               cli_count_text(h->triangle_count, a), cli_count_text(h->vertex_count, b),
               ldexp(1, h->vertex_exp));
    else
        printf("triangles  none: points only\n");
    print_coding(h, f);
    printf("clusters   %u on %u levels, in %u blocks; %u normal clusters\n", h->cluster_count,
           f->levels, h->block_count, h->normal_clusters);
    printf("colours    %s\n", h->flags & SPC_FLAG_COLORS ? "RGBA" : "none");
    printf("surface    %s\n", h->flags & SPC_FLAG_CULL_BACK
                                  ? "closed: back faces are not drawn"
                                  : "open or unknown: both sides are drawn");
    printf("box        %.9g %.9g %.9g .. %.9g %.9g %.9g\n", h->box_min[0], h->box_min[1],
           h->box_min[2], h->box_max[0], h->box_max[1], h->box_max[2]);
    printf("size       %.6g x %.6g x %.6g\n", h->box_max[0] - h->box_min[0],
           h->box_max[1] - h->box_min[1], h->box_max[2] - h->box_min[2]);
    print_coordinates(h, f);
    printf("error      %.3g .. %.3g (%s)\n", info_file_units(h, (double)h->e_min),
           info_file_units(h, (double)h->e_max),
           h->flags & SPC_FLAG_ERROR_PAPER ? "as the thesis defines it" : "proved bounds");
    printf("storage    %s: inner nodes %s, leaves and triangles %s, head %s\n", codec_text(h, f),
           cli_bytes_text(f->bytes[SPC_BLOCK_INNER], a),
           cli_bytes_text(f->bytes[SPC_BLOCK_LEAF], b), cli_bytes_text(h->head_bytes, c));
    printf("           %.2f bytes a %s\n", (double)h->file_bytes / (double)h->leaf_count,
           h->points_in > 0 ? "point" : "triangle");
    printf("first picture  %s: head and root cluster, one range of the file\n",
           cli_bytes_text(info_first_picture(r), a));
}

/* ---- for programs ---------------------------------------------------------------------------------- */

static json_t *vec_json(const double v[3])
{
    return json_pack("[f, f, f]", v[0], v[1], v[2]);
}

static json_t *info_json(const struct spc_reader *r, const struct facts *f)
{
    const struct spc_header *h = spc_reader_header(r);
    json_t *sources = json_object_get(f->meta, "sources");
    json_t *out = json_pack(
        "{s:s, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:i, s:I, s:s}", "schema", "spc-info/1",
        "faces_in", (json_int_t)h->faces_in, "split_extra", (json_int_t)h->split_extra, "points_in",
        (json_int_t)h->points_in, "leaves", (json_int_t)h->leaf_count, "nodes",
        (json_int_t)h->node_count, "clusters", (json_int_t)h->cluster_count, "blocks",
        (json_int_t)h->block_count, "triangles", (json_int_t)h->triangle_count, "vertices",
        (json_int_t)h->vertex_count, "height", (int)h->height, "file_bytes",
        (json_int_t)h->file_bytes, "codec", codec_text(h, f));
    json_t *more = json_pack(
        "{s:{s:o, s:o}, s:{s:f, s:f}, s:b, s:{s:I, s:I, s:I}, s:O}", "box", "min",
        vec_json(h->box_min), "max", vec_json(h->box_max), "error", "min",
        info_file_units(h, (double)h->e_min), "max", info_file_units(h, (double)h->e_max), "closed",
        (h->flags & SPC_FLAG_CULL_BACK) != 0, "dropped", "bad_index",
        (json_int_t)h->dropped_bad_index, "non_finite", (json_int_t)h->dropped_non_finite,
        "degenerate", (json_int_t)h->dropped_degenerate, "sources",
        sources ? sources : json_null());
    json_t *rest = json_pack(
        "{s:i, s:i, s:b, s:s, s:i, s:i, s:I, s:I, s:{s:I, s:I}}", "unit_exp", (int)h->unit_exp,
        "vertex_exp", (int)h->vertex_exp, "colors", (h->flags & SPC_FLAG_COLORS) != 0,
        "error_kind", h->flags & SPC_FLAG_ERROR_PAPER ? "paper" : "bound", "normal_clusters",
        (int)h->normal_clusters, "cluster_levels", (int)f->levels, "head_bytes",
        (json_int_t)h->head_bytes, "first_picture_bytes", (json_int_t)info_first_picture(r),
        "stored_bytes", "inner", (json_int_t)f->bytes[SPC_BLOCK_INNER], "leaf",
        (json_int_t)f->bytes[SPC_BLOCK_LEAF]);
    json_object_update_new(out, more);
    json_object_update_new(out, rest);
    json_t *coding = json_object_get(f->meta, "coding");
    json_object_set(out, "coding", coding ? coding : json_null());
    json_object_set(out, "meta", f->meta ? f->meta : json_null());
    return out;
}

/* ---- faults -------------------------------------------------------------------------------------- */

static int fault(const char *path, const struct spc_error *err)
{
    cli_error(path, err, NULL);
    return err->status == SPC_IO || err->status == SPC_NO_MEMORY || cli_unreadable() ? EXIT_FAILED : EXIT_INVALID;
}

/* ---- verification ---------------------------------------------------------------------------------- */

struct findings {
    json_t *list;                   /* NULL: print */
    int broken;
};

static void on_finding(void *ctx, const struct spc_finding *finding)
{
    struct findings *f = ctx;
    f->broken += !finding->ok;
    if (f->list != NULL) {
        json_t *entry = json_pack("{s:s, s:b}", "invariant", finding->invariant, "ok", finding->ok);
        if (!finding->ok) {
            json_object_set_new(entry, "status",
                                json_string(spc_status_name(finding->error.status)));
            json_object_set_new(entry, "what", json_string(finding->error.what));
            if (finding->error.at_off != SPC_NO_OFF)
                json_object_set_new(entry, "byte",
                                    json_integer((json_int_t)finding->error.at_off));
        }
        json_array_append_new(f->list, entry);
        return;
    }
    printf("%-4s %s", finding->ok ? "ok" : "FAIL", finding->invariant);
    if (!finding->ok) {
        printf(": %s", finding->error.what);
        if (finding->error.at_off != SPC_NO_OFF)
            printf(" (byte %llu)", (unsigned long long)finding->error.at_off);
    }
    putchar('\n');
}

/* Exit code; findings go to stdout, or into out. */
static int verify(const char *path, const struct spc_reader *reader, int level, json_t *out)
{
    struct findings findings = {.list = out ? json_array() : NULL};
    struct spc_error err = {0};
    const enum spc_status status = spc_verify(reader, level, on_finding, &findings, &err);
    if (out != NULL)
        json_object_set_new(out, "verify",
                            json_pack("{s:i, s:b, s:o}", "level", level, "ok", status == SPC_OK,
                                      "invariants", findings.list));
    if (status != SPC_OK || cli_unreadable())
        return fault(path, &err);
    if (out == NULL) {
        cli_put_name(stdout, path);
        printf(" is whole (level %d)\n", level);
    }
    return EXIT_DONE;
}

/* ---- what was asked for ----------------------------------------------------------------------------- */

struct request {
    bool json, clusters, blocks, bytes;
    uint32_t blocks_of;             /* cluster */
    uint32_t verify;                /* level; 0: not */
    enum info_of histogram;
    const char *recover;            /* the archive to build; NULL: none */
    bool force;
};

struct measured {                   /* from the nodes; NULL: not asked for, or not readable */
    const struct info_histogram *hist;
    const struct info_bytes *bytes;
};

static void gap(int *parts)
{
    if ((*parts)++ > 0)
        putchar('\n');
}

static int answer_text(const char *path, const struct spc_reader *reader, const struct request *q,
                       const struct facts *facts, const struct measured *m)
{
    int parts = 0;
    if (!q->clusters && !q->blocks && !q->bytes && q->histogram == INFO_NOTHING && q->verify == 0)
        print_text(path, reader, facts);
    if (q->clusters) {
        gap(&parts);
        info_print_clusters(reader);
    }
    if (q->blocks) {
        gap(&parts);
        info_print_blocks(reader, q->blocks_of);
    }
    if (m->hist != NULL) {
        gap(&parts);
        info_histogram_print(reader, m->hist);
    }
    if (m->bytes != NULL) {
        gap(&parts);
        info_bytes_print(reader, m->bytes);
    }
    if (q->verify == 0)
        return EXIT_DONE;
    gap(&parts);
    return verify(path, reader, (int)q->verify, NULL);
}

/* Tables may be longer than memory: they follow the other members, row by row. */
static int answer_json(const char *path, const struct spc_reader *reader, const struct request *q,
                       const struct facts *facts, const struct measured *m)
{
    json_t *out = info_json(reader, facts);
    const int code = q->verify ? verify(path, reader, (int)q->verify, out) : EXIT_DONE;
    if (m->hist != NULL)
        json_object_set_new(out, "histogram", info_histogram_json(m->hist));
    if (m->bytes != NULL)
        json_object_set_new(out, "bytes", info_bytes_json(reader, m->bytes));
    char *text = json_dumps(out, JSON_INDENT(2));
    json_decref(out);
    if (text == NULL || meta_no_memory()) {
        free(text);
        return code;                /* inspect tells */
    }
    fwrite(text, 1, strlen(text) - strlen("\n}"), stdout);
    free(text);
    if (q->clusters)
        info_json_clusters(reader);
    if (q->blocks)
        info_json_blocks(reader, q->blocks_of);
    fputs("\n}\n", stdout);
    return code;
}

/* A part that cannot be read is left out; the others follow: --verify says where else. */
static int measure(const char *path, const struct spc_reader *reader, const struct request *q,
                   struct info_histogram *hist, struct info_bytes *bytes, struct measured *m)
{
    struct spc_error err = {0};
    cli_progress_begin(CLI_PROGRESS_AUTO, path, 0, 0);
    if (q->histogram != INFO_NOTHING && info_histogram_fill(reader, q->histogram, hist, &err) == SPC_OK)
        m->hist = hist;
    if (q->bytes && err.status == SPC_OK && info_bytes_fill(reader, bytes, &err) == SPC_OK)
        m->bytes = bytes;
    cli_progress_end();
    return err.status == SPC_OK ? EXIT_DONE : fault(path, &err);
}

static int answer(const char *path, const struct spc_reader *reader, const struct request *q)
{
    const uint32_t clusters = spc_reader_header(reader)->cluster_count;
    struct facts facts;
    struct info_histogram hist;
    struct info_bytes bytes;
    struct measured m = {0};
    if (q->blocks && q->blocks_of >= clusters)
        return cli_usage("'%s' has the clusters 0 to %u and no %u", path, clusters - 1,
                         q->blocks_of);
    const int code = measure(path, reader, q, &hist, &bytes, &m);
    collect(reader, &facts);
    const int rest = (q->json ? answer_json : answer_text)(path, reader, q, &facts, &m);
    json_decref(facts.meta);
    return code != EXIT_DONE ? code : rest;
}

static int inspect(const char *path, const struct request *q)
{
    struct spc_reader *reader = NULL;
    struct spc_error err = {0};
    if (spc_reader_open(path, &reader, &err) != SPC_OK)
        return fault(path, &err);
    int code = answer(path, reader, q);
    spc_reader_close(reader);
    if (code == EXIT_DONE && meta_no_memory())
        code = fault(path, &(struct spc_error){.status = SPC_NO_MEMORY});
    else if (code == EXIT_DONE && cli_unreadable())
        code = fault(path, &(struct spc_error){.status = SPC_CORRUPT});
    return cli_finish(code);
}

/* EXIT_DONE, or the code of a message. */
static int take_option(int c, const char *value, struct request *q)
{
    switch (c) {
    case OPT_JSON:
        q->json = true;
        return EXIT_DONE;
    case OPT_VERIFY:
        q->verify = 3;
        if (value != NULL && !cli_u32(value, 1, 3, &q->verify))
            return cli_usage("--verify takes 1, 2 or 3, not '%s'", value);
        return EXIT_DONE;
    case OPT_CLUSTERS:
        q->clusters = true;
        return EXIT_DONE;
    case OPT_BLOCKS:
        q->blocks = true;
        if (!cli_u32(value, 0, SPC_NONE - 1, &q->blocks_of))
            return cli_usage("--blocks takes the id of a cluster, not '%s'", value);
        return EXIT_DONE;
    case OPT_BYTES:
        q->bytes = true;
        return EXIT_DONE;
    case OPT_HISTOGRAM:
        if (!info_histogram_of(value, &q->histogram))
            return cli_usage("--histogram takes e, radius, normals or size, not '%s'", value);
        return EXIT_DONE;
    case OPT_RECOVER:
        q->recover = value;
        return EXIT_DONE;
    case OPT_FORCE:
        q->force = true;
        return EXIT_DONE;
    default:
        return EXIT_USAGE;
    }
}

static int act(const char *path, const struct request *q)
{
    if (q->recover == NULL && q->force)
        return cli_usage("--force is for --recover alone");
    if (q->recover == NULL)
        return inspect(path, q);
    if (q->clusters || q->blocks || q->bytes || q->histogram != INFO_NOTHING || q->verify != 0)
        return cli_usage("--recover goes with --force and --json alone");
    return info_recover(path, q->recover, q->force, q->json);
}

int main(int argc, char **argv)
{
    struct request q = {0};
    int c;
    cli_init("spc-info");
    meta_init();
    signal(SIGPIPE, SIG_DFL);       /* 'spc-info --clusters | head' ends in silence, whoever started it */
    opterr = 0;
    while ((c = getopt_long(argc, argv, "hV", LONG, NULL)) != -1) {
        int code;
        if (cli_common(c, argv, HELP, NULL, &code))
            return code;
        code = take_option(c, optarg, &q);
        if (code != EXIT_DONE)
            return code;
    }
    if (optind == argc)
        return cli_usage("no archive is named");
    if (optind + 1 < argc)
        return cli_usage("one archive at a time: '%s' is left over", argv[optind + 1]);
    return act(argv[optind], &q);
}
