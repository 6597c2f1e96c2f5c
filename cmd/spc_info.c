/* spc-info: what is in an archive, and proof that it is whole. */
#include "cli.h"

#include <getopt.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static const char HELP[] =
    "usage: spc-info [options] FILE\n"
    "Says what is in an .spc archive, and proves that it is whole.\n"
    "\n"
    "      --verify[=LEVEL]   1: header and directory; 2: every byte; 3 (default): also every\n"
    "                         rule between nodes. One line an invariant; exit 3 when one is broken\n"
    "      --json             one object on standard output\n"
    "  -h, --help    -V, --version\n"
    "\n"
    "  spc-info statue.spc\n"
    "  spc-info --verify statue.spc && echo whole\n";

enum { OPT_VERIFY = 256, OPT_JSON };
static const struct option LONG[] = {
    {"verify", 2, NULL, OPT_VERIFY}, {"json", 0, NULL, OPT_JSON},
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

static double in_file_units(const struct spc_header *h, double units)
{
    return ldexp(units, h->unit_exp);
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
                        &format, "vertices", &vertices, "faces", &faces) == 0)
            printf("source     %s (%s): %s vertices, %s faces\n", name, format,
                   cli_count_text((uint64_t)vertices, a), cli_count_text((uint64_t)faces, b));
    }
}

static void print_text(const char *path, const struct spc_reader *r, const struct facts *f)
{
    const struct spc_header *h = spc_reader_header(r);
    char a[CLI_TEXT], b[CLI_TEXT], c[CLI_TEXT];
    printf("%s: .spc archive, development version, %s\n", path, cli_bytes_text(h->file_bytes, a));
    print_sources(f);
    if (dropped(h) > 0)
        printf("dropped    %s of %s faces: %llu bad index, %llu not finite, %llu degenerate\n",
               cli_count_text(dropped(h), a), cli_count_text(h->faces_in + h->split_extra, b),
               (unsigned long long)h->dropped_bad_index,
               (unsigned long long)h->dropped_non_finite,
               (unsigned long long)h->dropped_degenerate);
    printf("nodes      %s, of them %s leaves; %u levels\n", cli_count_text(h->node_count, a),
           cli_count_text(h->leaf_count, b), h->height);
    if (h->flags & SPC_FLAG_TRIANGLES)
        printf("triangles  %s with %s vertices, on a lattice of %.3g\n",
               cli_count_text(h->triangle_count, a), cli_count_text(h->vertex_count, b),
               ldexp(1, h->vertex_exp));
    else
        printf("triangles  none: points only\n");
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
    printf("error      %.3g .. %.3g (%s)\n", in_file_units(h, (double)h->e_min),
           in_file_units(h, (double)h->e_max),
           h->flags & SPC_FLAG_ERROR_PAPER ? "as the thesis defines it" : "proved bounds");
    printf("storage    %s: inner nodes %s, leaves and triangles %s, head %s\n", codec_text(h, f),
           cli_bytes_text(f->bytes[SPC_BLOCK_INNER], a),
           cli_bytes_text(f->bytes[SPC_BLOCK_LEAF], b), cli_bytes_text(h->head_bytes, c));
    printf("           %.2f bytes a triangle\n", (double)h->file_bytes / (double)h->leaf_count);
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
        in_file_units(h, (double)h->e_min), "max", in_file_units(h, (double)h->e_max), "closed",
        (h->flags & SPC_FLAG_CULL_BACK) != 0, "dropped", "bad_index",
        (json_int_t)h->dropped_bad_index, "non_finite", (json_int_t)h->dropped_non_finite,
        "degenerate", (json_int_t)h->dropped_degenerate, "sources",
        sources ? sources : json_null());
    json_t *rest = json_pack(
        "{s:i, s:i, s:b, s:s, s:i, s:i, s:I, s:{s:I, s:I}}", "unit_exp", (int)h->unit_exp,
        "vertex_exp", (int)h->vertex_exp, "colors", (h->flags & SPC_FLAG_COLORS) != 0,
        "error_kind", h->flags & SPC_FLAG_ERROR_PAPER ? "paper" : "bound", "normal_clusters",
        (int)h->normal_clusters, "cluster_levels", (int)f->levels, "head_bytes",
        (json_int_t)h->head_bytes, "stored_bytes", "inner",
        (json_int_t)f->bytes[SPC_BLOCK_INNER], "leaf", (json_int_t)f->bytes[SPC_BLOCK_LEAF]);
    json_object_update_new(out, more);
    json_object_update_new(out, rest);
    json_object_set(out, "meta", f->meta ? f->meta : json_null());
    return out;
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

static int inspect(const char *path, int verify, bool json)
{
    struct spc_reader *reader = NULL;
    struct spc_error err = {0};
    struct facts facts;
    int code = EXIT_DONE;
    if (spc_reader_open(path, &reader, &err) != SPC_OK) {
        cli_error(path, &err, NULL);
        return err.status == SPC_IO || err.status == SPC_NO_MEMORY ? EXIT_FAILED : EXIT_INVALID;
    }
    collect(reader, &facts);
    json_t *out = json ? info_json(reader, &facts) : NULL;
    if (!json && verify == 0)
        print_text(path, reader, &facts);
    if (verify > 0) {
        struct findings findings = {.list = json ? json_array() : NULL};
        const enum spc_status status = spc_verify(reader, verify, on_finding, &findings, &err);
        if (json)
            json_object_set_new(out, "verify",
                                json_pack("{s:i, s:b, s:o}", "level", verify, "ok",
                                          status == SPC_OK, "invariants", findings.list));
        if (status != SPC_OK) {
            cli_error(path, &err, NULL);
            code = status == SPC_NO_MEMORY ? EXIT_FAILED : EXIT_INVALID;
        } else if (!json) {
            printf("%s is whole (level %d)\n", path, verify);
        }
    }
    if (json) {
        json_dumpf(out, stdout, JSON_INDENT(2));
        putchar('\n');
    }
    json_decref(out);
    json_decref(facts.meta);
    spc_reader_close(reader);
    return cli_finish(code);
}

int main(int argc, char **argv)
{
    bool json = false;
    uint32_t verify = 0;
    int c;
    cli_init("spc-info");
    opterr = 0;
    while ((c = getopt_long(argc, argv, "hV", LONG, NULL)) != -1) {
        switch (c) {
        case 'h':
            fputs(HELP, stdout);
            return cli_finish(EXIT_DONE);
        case 'V':
            return cli_version();
        case OPT_JSON:
            json = true;
            break;
        case OPT_VERIFY:
            verify = 3;
            if (optarg != NULL && !cli_u32(optarg, 1, 3, &verify))
                return cli_usage("--verify takes 1, 2 or 3, not '%s'", optarg);
            break;
        default:
            return cli_usage("'%s' is no option", argv[optind - 1]);
        }
    }
    if (optind == argc)
        return cli_usage("no archive is named");
    if (optind + 1 < argc)
        return cli_usage("one archive at a time: '%s' is left over", argv[optind + 1]);
    return inspect(argv[optind], (int)verify, json);
}
