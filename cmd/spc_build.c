/* spc-build: a scan becomes an archive. */
#include "build_run.h"

#include <getopt.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>

static const char HELP[] =
    "usage: spc-build [options] SCAN... -o OUT.spc       one archive of all scans\n"
    "       spc-build [options] SCAN... --out-dir DIR    one archive each\n"
    "SCAN is a PLY, OBJ, STL or OFF file, an .spc archive, a folder of scans, or -\n"
    "for standard input. What a file is, its content says.\n"
    "\n"
    "  -o, --output FILE       the archive; not overwritten without --force\n"
    "      --out-dir DIR       the folder of the archives; a failed scan stops none\n"
    "      --list FILE         more scans, one a line (- for standard input)\n"
    "      --force             replace archives, once the new ones are complete\n"
    "      --memory SIZE       memory for building: K M G (default 1G, at least 64M)\n"
    "      --temp DIR          folder of temporary files (default: beside the output)\n"
    "      --strict            fail if a face cannot be used or would lose its shape\n"
    "      --offset X,Y,Z --scale S --up AXIS --unit NAME --crs EPSG:N\n"
    "                          where the scan lies in the world: kept in the archive\n"
    "      --progress MODE     auto, always, never or json    -q, --quiet  no summary\n"
    "      --json              the summary as JSON on standard output\n"
    "  -h, --help[=all]        this, or all options             -V, --version\n"
    "\n"
    "  spc-build statue.ply -o statue.spc\n"
    "  spc-build --memory 4G --temp /fast huge.ply -o huge.spc\n"
    "  spc-build museum/ --out-dir archives/\n"
    "  zcat scan.ply.gz | spc-build - -o scan.spc\n";

static const char HELP_MORE[] =
    "\n"
    "      --threads N         threads (default: all cores)\n"
    "      --update            with --out-dir: pass over scans older than theirs\n"
    "      --detail LENGTH     faces at least so large keep their shape; by default those\n"
    "                          that are many in their place\n"
    "      --no-triangles      points only: smaller, but blurred near the eye\n"
    "      --cull auto|none|back   are back faces never seen? auto: if it is closed\n"
    "      --error bound|paper     errors as proved bounds, or as in the thesis\n"
    "      --codec raw|zstd[:LEVEL]    how blocks are stored (default zstd:1)\n"
    "      --cluster-nodes N   most nodes a cluster (default 28672)\n"
    "      --block-nodes N     most nodes a block (default 32768)\n"
    "      --normal-clusters N directions nodes are grouped by, 1 to 128\n"
    "                          (default: 128 when closed, else 1)\n"
    "      --up takes x, y, z, -x, -y or -z; --unit m, dm, cm, mm, um, km, in, ft,\n"
    "      yd or us-ft. world = scale * coordinate + offset, in unit and CRS named.\n";

enum { OPT_MEMORY = 256, OPT_THREADS, OPT_TEMP, OPT_FORCE, OPT_STRICT, OPT_NO_TRIANGLES, OPT_CULL,
       OPT_ERROR, OPT_CODEC, OPT_CLUSTER_NODES, OPT_BLOCK_NODES, OPT_NORMAL_CLUSTERS, OPT_PROGRESS,
       OPT_JSON, OPT_OUT_DIR, OPT_LIST, OPT_UPDATE, OPT_OFFSET, OPT_SCALE, OPT_UP, OPT_UNIT, OPT_CRS,
       OPT_DETAIL, OPT_PART_FACES, OPT_SLICE_LOG2, OPT_VERTICES_ON_DISK };

static const struct option LONG[] = {
    {"output", 1, NULL, 'o'}, {"memory", 1, NULL, OPT_MEMORY},
    {"threads", 1, NULL, OPT_THREADS}, {"temp", 1, NULL, OPT_TEMP},
    {"force", 0, NULL, OPT_FORCE}, {"strict", 0, NULL, OPT_STRICT},
    {"no-triangles", 0, NULL, OPT_NO_TRIANGLES}, {"cull", 1, NULL, OPT_CULL},
    {"error", 1, NULL, OPT_ERROR}, {"codec", 1, NULL, OPT_CODEC},
    {"cluster-nodes", 1, NULL, OPT_CLUSTER_NODES}, {"block-nodes", 1, NULL, OPT_BLOCK_NODES},
    {"normal-clusters", 1, NULL, OPT_NORMAL_CLUSTERS}, {"progress", 1, NULL, OPT_PROGRESS},
    {"json", 0, NULL, OPT_JSON}, {"quiet", 0, NULL, 'q'}, {"out-dir", 1, NULL, OPT_OUT_DIR},
    {"list", 1, NULL, OPT_LIST}, {"update", 0, NULL, OPT_UPDATE}, {"offset", 1, NULL, OPT_OFFSET},
    {"scale", 1, NULL, OPT_SCALE}, {"up", 1, NULL, OPT_UP}, {"unit", 1, NULL, OPT_UNIT},
    {"crs", 1, NULL, OPT_CRS}, {"detail", 1, NULL, OPT_DETAIL},
    {"part-faces", 1, NULL, OPT_PART_FACES},        /* for tests: many small parts, */
    {"vertices-on-disk", 0, NULL, OPT_VERTICES_ON_DISK},        /* little memory, */
    {"slice-log2", 1, NULL, OPT_SLICE_LOG2},        /* and faces in no order */
    {"help", 2, NULL, 'h'}, {"version", 0, NULL, 'V'}, {0},
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

/* Words that the metadata keeps as they are. */
static int parse_coordinates(int c, const char *value, struct meta_coordinates *m)
{
    static const char *const ups[] = {"x", "y", "z", "-x", "-y", "-z"};
    static const char *const units[] = {"m", "dm", "cm", "mm", "um", "km", "in", "ft", "yd", "us-ft"};
    int which = 0, code = EXIT_DONE;
    uint32_t n = 0;
    switch (c) {
    case OPT_OFFSET:
        if (!cli_doubles(value, m->offset, 3))
            return cli_usage("--offset takes X,Y,Z, not '%s'", value);
        m->has_offset = true;
        return EXIT_DONE;
    case OPT_SCALE:
        if (!cli_double(value, &m->scale) || !(m->scale > 0))
            return cli_usage("--scale takes a positive number, not '%s'", value);
        m->has_scale = true;
        return EXIT_DONE;
    case OPT_UP:
        code = choose("up", value, ups, sizeof ups / sizeof *ups, &which);
        snprintf(m->up, sizeof m->up, "%s", ups[which]);
        return code;
    case OPT_UNIT:
        code = choose("unit", value, units, sizeof units / sizeof *units, &which);
        snprintf(m->unit, sizeof m->unit, "%s", units[which]);
        return code;
    default:
        if (strncmp(value, "EPSG:", 5) != 0 || !cli_u32(value + 5, 1, 999999999, &n))
            return cli_usage("--crs takes EPSG: and a number, such as EPSG:25832, not '%s'", value);
        snprintf(m->crs, sizeof m->crs, "%s", value);
        return EXIT_DONE;
    }
}

static int parse_size(int c, const char *value, struct spb_build_options *b)
{
    if (c == OPT_MEMORY && (!cli_size(value, &b->memory) || b->memory < (uint64_t)64 << 20))
        return cli_usage("--memory takes a size of at least 64M, not '%s'", value);
    if (c == OPT_DETAIL && (!cli_double(value, &b->detail) || !(b->detail >= 0)))
        return cli_usage("--detail takes a length of 0 or more, not '%s'", value);
    return EXIT_DONE;
}

static int parse_option(int c, const char *value, struct build_run *a)
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
    case OPT_OUT_DIR: a->out_dir = value; return EXIT_DONE;
    case OPT_LIST: a->list = value; return EXIT_DONE;
    case OPT_UPDATE: a->update = true; return EXIT_DONE;
    case OPT_OFFSET:
    case OPT_SCALE:
    case OPT_UP:
    case OPT_UNIT:
    case OPT_CRS: return parse_coordinates(c, value, &a->coordinates);
    case OPT_CODEC: return parse_codec(value, b);
    case OPT_MEMORY:
    case OPT_DETAIL: return parse_size(c, value, b);
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

/* ---- the command line ---------------------------------------------------------------------------- */

/* Many scans of one archive are all open at once. */
static void allow_files(void)
{
    struct rlimit limit;
    if (getrlimit(RLIMIT_NOFILE, &limit) == 0) {
        limit.rlim_cur = limit.rlim_max;
        (void)setrlimit(RLIMIT_NOFILE, &limit);     /* else opening tells */
    }
}

int main(int argc, char **argv)
{
    struct build_run a = {.progress = CLI_PROGRESS_AUTO, .coordinates.scale = 1};
    int c;
    cli_init("spc-build");
    meta_init();
    spb_build_defaults(&a.build);
    opterr = 0;
    while ((c = getopt_long(argc, argv, "o:qhV", LONG, NULL)) != -1) {
        int code;
        if (cli_common(c, argv, HELP, HELP_MORE, &code))
            return code;
        code = parse_option(c, optarg, &a);
        if (code != EXIT_DONE)
            return code;
    }
    if (optind == argc && a.list == NULL)
        return cli_usage("no scan is named");
    if ((a.build.out == NULL) == (a.out_dir == NULL))
        return cli_usage(a.build.out == NULL ? "no output is named (-o OUT.spc, or --out-dir DIR)"
                                             : "-o and --out-dir exclude each other");
    if (a.update && a.out_dir == NULL)
        return cli_usage("--update goes with --out-dir");
    allow_files();
    cli_catch_signals();
    signal(SIGPIPE, SIG_IGN);       /* nobody reads the progress any more: no reason to stop */
    return cli_finish(build_run(&a, argv + optind));
}
