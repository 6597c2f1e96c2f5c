/* spc-build: a scan becomes an archive. */
#include "build.h"
#include "cli.h"
#include "meta.h"
#include "usage.h"

#include <getopt.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char HELP[] =
    "usage: spc-build [options] SCAN -o OUT.spc\n"
    "Converts a scan (PLY: ascii or binary, faces or triangle strips; or an .spc archive, anew\n"
    "with other options) to an .spc archive.\n"
    "\n"
    "  -o, --output FILE      the archive; not overwritten without --force\n"
    "      --memory SIZE      memory for building, K M G (default 1G, at least 64M)\n"
    "      --threads N        threads (default: all cores)\n"
    "      --temp DIR         folder of temporary files (default: beside the output)\n"
    "      --force            replace an existing archive, once the new one is complete\n"
    "      --strict           fail when a face cannot be used, instead of dropping it\n"
    "      --no-triangles     points only: smaller, but blurred near the eye\n"
    "      --cull auto|none|back  are back faces never seen? auto: when the surface is closed\n"
    "      --error bound|paper    errors as proved bounds, or as the thesis defines them\n"
    "      --codec raw|zstd[:LEVEL]   how blocks are stored (default zstd:1)\n"
    "      --cluster-nodes N  most nodes a cluster (default 28672)\n"
    "      --block-nodes N    most nodes a block (default 32768)\n"
    "      --normal-clusters N    directions nodes are grouped by, 1 to 128 (128 when closed, else 1)\n"
    "      --progress MODE    auto, always, never or json\n"
    "      --json             the summary as JSON on standard output\n"
    "  -q, --quiet            no summary\n"
    "  -h, --help    -V, --version\n"
    "\n"
    "  spc-build statue.ply -o statue.spc\n"
    "  spc-build --memory 4G --temp /fast huge.ply -o huge.spc\n";

enum { OPT_MEMORY = 256, OPT_THREADS, OPT_TEMP, OPT_FORCE, OPT_STRICT, OPT_NO_TRIANGLES, OPT_CULL,
       OPT_ERROR, OPT_CODEC, OPT_CLUSTER_NODES, OPT_BLOCK_NODES, OPT_NORMAL_CLUSTERS, OPT_PROGRESS,
       OPT_JSON, OPT_PART_FACES, OPT_SLICE_LOG2,
       OPT_VERTICES_ON_DISK };

static const struct option LONG[] = {
    {"output", 1, NULL, 'o'}, {"memory", 1, NULL, OPT_MEMORY},
    {"threads", 1, NULL, OPT_THREADS}, {"temp", 1, NULL, OPT_TEMP},
    {"force", 0, NULL, OPT_FORCE}, {"strict", 0, NULL, OPT_STRICT},
    {"no-triangles", 0, NULL, OPT_NO_TRIANGLES}, {"cull", 1, NULL, OPT_CULL},
    {"error", 1, NULL, OPT_ERROR}, {"codec", 1, NULL, OPT_CODEC},
    {"cluster-nodes", 1, NULL, OPT_CLUSTER_NODES}, {"block-nodes", 1, NULL, OPT_BLOCK_NODES},
    {"normal-clusters", 1, NULL, OPT_NORMAL_CLUSTERS}, {"progress", 1, NULL, OPT_PROGRESS},
    {"json", 0, NULL, OPT_JSON}, {"quiet", 0, NULL, 'q'},
    {"part-faces", 1, NULL, OPT_PART_FACES},        /* for tests: many small parts, */
    {"vertices-on-disk", 0, NULL, OPT_VERTICES_ON_DISK},        /* little memory, */
    {"slice-log2", 1, NULL, OPT_SLICE_LOG2},        /* and faces in no order */
    {"help", 0, NULL, 'h'}, {"version", 0, NULL, 'V'}, {0},
};

struct arguments {
    struct spb_build_options build;
    enum cli_progress_mode progress;
    bool json, quiet;
};

static int choose(const char *option, const char *word, const char *const *words, int count,
                  int *out)
{
    for (int i = 0; i < count; i++)
        if (strcmp(word, words[i]) == 0) {
            *out = i;
            return EXIT_DONE;
        }
    return cli_usage("--%s does not know '%s'", option, word);
}

static int parse_codec(const char *word, struct spb_build_options *b)
{
    uint32_t level = 1;
    if (strcmp(word, "raw") == 0) {
        b->codec = SPC_CODEC_RAW;
        return EXIT_DONE;
    }
    if (strncmp(word, "zstd", 4) != 0 ||
        (word[4] != '\0' && (word[4] != ':' || !cli_u32(word + 5, 1, 19, &level))))
        return cli_usage("--codec takes raw, zstd or zstd:1 to zstd:19, not '%s'", word);
    b->codec = SPC_CODEC_ZSTD;
    b->level = (int)level;
    return EXIT_DONE;
}

static int parse_option(int c, const char *value, struct arguments *a)
{
    static const char *const culls[] = {"auto", "none", "back"};
    static const char *const errors[] = {"bound", "paper"};
    struct spb_build_options *b = &a->build;
    uint32_t n = 0;
    int which = 0, code = EXIT_DONE;
    switch (c) {
    case 'o': b->out = value; return EXIT_DONE;
    case 'q': a->quiet = true; return EXIT_DONE;
    case OPT_TEMP: b->temp = value; return EXIT_DONE;
    case OPT_FORCE: b->force = true; return EXIT_DONE;
    case OPT_STRICT: b->strict = true; return EXIT_DONE;
    case OPT_NO_TRIANGLES: b->triangles = false; return EXIT_DONE;
    case OPT_VERTICES_ON_DISK: b->vertices_on_disk = true; return EXIT_DONE;
    case OPT_JSON: a->json = true; return EXIT_DONE;
    case OPT_CODEC: return parse_codec(value, b);
    case OPT_MEMORY:
        if (!cli_size(value, &b->memory) || b->memory < (uint64_t)64 << 20)
            return cli_usage("--memory takes a size of at least 64M, not '%s'", value);
        return EXIT_DONE;
    case OPT_THREADS:
        if (!cli_u32(value, 1, 1024, &n))
            return cli_usage("--threads takes 1 to 1024, not '%s'", value);
        b->threads = n;
        return EXIT_DONE;
    case OPT_CULL:
        code = choose("cull", value, culls, 3, &which);
        b->cull = (enum spb_cull)which;
        return code;
    case OPT_ERROR:
        code = choose("error", value, errors, 2, &which);
        b->paper_error = which == 1;
        return code;
    case OPT_CLUSTER_NODES:
        if (!cli_u32(value, 16, 1u << 24, &b->cluster_nodes))
            return cli_usage("--cluster-nodes takes 16 to 16777216, not '%s'", value);
        return EXIT_DONE;
    case OPT_BLOCK_NODES:
        if (!cli_u32(value, 4, 65535, &b->block_nodes))
            return cli_usage("--block-nodes takes 4 to 65535, not '%s'", value);
        return EXIT_DONE;
    case OPT_NORMAL_CLUSTERS:
        if (!cli_u32(value, 1, 128, &b->normal_clusters))
            return cli_usage("--normal-clusters takes 1 to 128, not '%s'", value);
        return EXIT_DONE;
    case OPT_PART_FACES:
        if (!cli_u32(value, 1, UINT32_MAX, &n))
            return cli_usage("--part-faces takes a count, not '%s'", value);
        b->part_faces = n;
        return EXIT_DONE;
    case OPT_SLICE_LOG2:
        if (!cli_u32(value, 1, 32, &n))
            return cli_usage("--slice-log2 takes 1 to 32, not '%s'", value);
        b->slice_log2 = (int)n;
        return EXIT_DONE;
    case OPT_PROGRESS:
        if (!cli_progress_mode(value, &a->progress))
            return cli_usage("--progress takes auto, always, never or json, not '%s'", value);
        return EXIT_DONE;
    default:
        return cli_usage("unknown option");
    }
}

/* ---- metadata and summary ----------------------------------------------------------------------- */

static char *make_meta(void *ctx, const struct spc_header *header, const char *format,
                       uint64_t vertices, uint64_t faces)
{
    const struct spb_build_options *b = ctx;
    json_t *sources = json_pack("[o]", meta_source(b->scan, format, vertices, faces));
    return meta_text(meta_new("spc-build", b, header, sources), JSON_COMPACT);
}

static void warn_dropped(const struct spb_build_options *b, const struct spb_build_report *r)
{
    const struct spc_header *h = &r->header;
    const struct { uint64_t count; const char *why; } drops[] = {
        {h->dropped_bad_index, "with an index that names no vertex"},
        {h->dropped_non_finite, "with a vertex that is not finite"},
        {h->dropped_degenerate, "with fewer than 3 distinct corners"},
    };
    for (size_t i = 0; i < 3; i++)
        if (drops[i].count > 0)
            cli_warn(b->scan, "dropped %llu face%s %s", (unsigned long long)drops[i].count,
                     drops[i].count == 1 ? "" : "s", drops[i].why);
    if (r->remark[0] != '\0')
        cli_warn(b->scan, "%s", r->remark);
}

enum { PHASES_AFTER_S = 5 };        /* of short runs nobody asks where the time went */

static void print_phases(const struct spb_build_report *r)
{
    const double faces = (double)r->header.leaf_count * 1e-9;
    for (int p = 0; p < SPB_PHASE_COUNT; p++) {
        const struct spb_phase_cost *c = &r->phases[p];
        if (c->wall_s >= 0.01)
            fprintf(stderr, "    %-16s %8.2f s %8.2f s CPU %7.0f ns CPU a triangle\n",
                    spb_phase_name[p], c->wall_s, c->cpu_s, c->cpu_s / faces);
    }
}

static void print_summary(const struct spb_build_options *b, const struct spb_build_report *r,
                          const struct usage *u)
{
    char a[CLI_TEXT], d[CLI_TEXT], e[CLI_TEXT], f[CLI_TEXT];
    const struct spc_header *h = &r->header;
    fprintf(stderr, "%s: %s triangles, %s nodes in %u clusters, %s (%.2f bytes a triangle)\n",
            b->out, cli_count_text(h->leaf_count, a), cli_count_text(h->node_count, d),
            h->cluster_count, cli_bytes_text(h->file_bytes, e),
            (double)h->file_bytes / (double)h->leaf_count);
    fprintf(stderr, "  %.2f s, %.2f s CPU, peak memory %s of %s, temporary files %s written, "
            "%s read, %u part%s\n", u->wall_s, u->cpu_s, cli_bytes_text(u->peak_bytes, a),
            cli_bytes_text(b->memory, d), cli_bytes_text(r->temp_written, e),
            cli_bytes_text(r->temp_read, f), r->parts, r->parts == 1 ? "" : "s");
    if (u->group_bytes > 0 && u->wall_s >= PHASES_AFTER_S)
        fprintf(stderr, "  the control group's peak, page cache and other programs included: %s\n",
                cli_bytes_text(u->group_bytes, a));
    if (u->wall_s >= PHASES_AFTER_S)
        print_phases(r);
}

static json_t *phases_json(const struct spb_build_report *r)
{
    json_t *out = json_array();
    for (int p = 0; p < SPB_PHASE_COUNT; p++) {
        const struct spb_phase_cost *c = &r->phases[p];
        json_array_append_new(out, json_pack("{s:s, s:f, s:f, s:I, s:I}", "name", spb_phase_name[p],
                                             "wall_s", c->wall_s, "cpu_s", c->cpu_s,
                                             "temp_written_bytes", (json_int_t)c->temp_written,
                                             "temp_read_bytes", (json_int_t)c->temp_read));
    }
    return out;
}

/* False without memory. */
static bool print_json(const struct spb_build_options *b, const struct spb_build_report *r,
                       const struct usage *u)
{
    const struct spc_header *h = &r->header;
    json_t *out = json_pack(
        "{s:o, s:[o], s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:b, s:{s:I, s:I, s:I}}",
        "output", meta_name(b->out), "sources", meta_source(b->scan, r->format, r->vertices, r->faces),
        "faces_in", (json_int_t)h->faces_in, "split_extra", (json_int_t)h->split_extra, "points_in",
        (json_int_t)h->points_in, "leaves", (json_int_t)h->leaf_count, "nodes",
        (json_int_t)h->node_count, "clusters", (json_int_t)h->cluster_count, "file_bytes",
        (json_int_t)h->file_bytes, "closed", (int)r->closed, "dropped", "bad_index",
        (json_int_t)h->dropped_bad_index, "non_finite", (json_int_t)h->dropped_non_finite,
        "degenerate", (json_int_t)h->dropped_degenerate);
    json_t *spent = json_pack(
        "{s:f, s:f, s:I, s:I, s:I, s:I, s:I, s:i, s:o}", "wall_s", u->wall_s, "cpu_s", u->cpu_s,
        "memory_bytes", (json_int_t)b->memory, "peak_bytes", (json_int_t)u->peak_bytes,
        "group_peak_bytes", (json_int_t)u->group_bytes, "temp_written_bytes",
        (json_int_t)r->temp_written, "temp_read_bytes", (json_int_t)r->temp_read, "parts",
        (int)r->parts, "phases", phases_json(r));
    json_object_update_new(out, spent);
    char *text = meta_text(out, JSON_INDENT(2));
    if (text != NULL)
        puts(text);
    free(text);
    return text != NULL;
}

static const char *remedy_for(const struct spc_error *err, bool in_scan, bool strict)
{
    switch (err->status) {
    case SPC_EXISTS: return "--force replaces it";
    case SPC_BUSY: return "wait for it, or choose another name";
    case SPC_NO_MEMORY: return "a smaller --memory or fewer --threads may help";
    case SPC_INPUT_TRUNCATED: return "copy or export the scan again";
    case SPC_NOT_SPC:
    case SPC_TRUNCATED:
    case SPC_CORRUPT:
    case SPC_CHECKSUM: return in_scan ? "'spc-info --recover' rebuilds an archive from what is whole of it" : NULL;
    case SPC_INPUT_BAD: return strict ? "without --strict they are dropped" : NULL;
    case SPC_IO: return cli_disk_remedy(err, "free some space there, or move temporary files with --temp");
    default: return NULL;
    }
}

static int build_one(struct arguments *a)
{
    struct spb_build_report report;
    struct spc_error err = {0};
    bool in_scan = false;
    const double began = cli_seconds();
    a->build.meta = make_meta;
    a->build.meta_ctx = &a->build;
    a->build.progress = (struct spb_progress){cli_progress, NULL};
    cli_catch_signals();
    signal(SIGPIPE, SIG_IGN);       /* nobody reads the progress any more: no reason to stop */
    cli_progress_begin(a->progress, a->build.scan);
    const enum spc_status status = spb_build(&a->build, &report, &in_scan, &err);
    cli_progress_end();
    if (status != SPC_OK) {
        cli_error(in_scan ? a->build.scan : a->build.out, &err, remedy_for(&err, in_scan, a->build.strict));
        return EXIT_FAILED;
    }
    const struct usage usage = usage_since(began);
    warn_dropped(&a->build, &report);
    if (a->json && !print_json(&a->build, &report, &usage)) {
        cli_error(a->build.out, &(struct spc_error){.status = SPC_NO_MEMORY,
                                                    .what = "the archive is complete, but no memory for the summary"},
                  NULL);
        return EXIT_FAILED;
    }
    if (!a->quiet)
        print_summary(&a->build, &report, &usage);
    return cli_finish(EXIT_DONE);
}

int main(int argc, char **argv)
{
    struct arguments a = {.progress = CLI_PROGRESS_AUTO};
    int c;
    cli_init("spc-build");
    meta_init();
    spb_build_defaults(&a.build);
    opterr = 0;
    while ((c = getopt_long(argc, argv, "o:qhV", LONG, NULL)) != -1) {
        if (c == 'h') {
            fputs(HELP, stdout);
            return cli_finish(EXIT_DONE);
        }
        if (c == 'V')
            return cli_version();
        if (c == '?')
            return cli_usage("'%s' is no option, or lacks its value", argv[optind - 1]);
        const int code = parse_option(c, optarg, &a);
        if (code != EXIT_DONE)
            return code;
    }
    if (optind == argc)
        return cli_usage("no scan is named");
    if (optind + 1 < argc)
        return cli_usage("one scan at a time: '%s' is left over", argv[optind + 1]);
    if (a.build.out == NULL)
        return cli_usage("no output is named (-o OUT.spc)");
    a.build.scan = argv[optind];
    return build_one(&a);
}
