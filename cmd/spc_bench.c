/* spc-bench: what speed costs in accuracy, measured on an archive against the scan it was built from. */
#include "bench_trade.h"
#include "sample.h"
#include "meta.h"

#include <getopt.h>
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>

static const char HELP[] =
    "usage: spc-bench [options] FILE --reference SCAN --out DIR\n"
    "Draws an archive at several accuracies and compares with all triangles of its\n"
    "scan: a table here; trade.csv, trade.json and, by gnuplot, plots in DIR.\n"
    "\n"
    "      --reference SCAN   what the archive was built from; again for each of\n"
    "                         several (default: the archive's own triangles)\n"
    "      --out DIR          the folder of the files      --force  write over them\n"
    "      --eps PX[,PX...]   accuracies (default 0.25,0.5,1,2,4,8,16)\n"
    "      --mode hybrid|points|triangles   again for each (default: all three)\n"
    "      --view NAME        again for each (default: all nine)\n"
    "      --baseline one-cluster|traversal|all-triangles|all-points|all\n"
    "                         rows for other methods; again for each\n"
    "      --repeat K         frames that a time is the median of (default 5)\n"
    "      --recommend        one line: which eps to take\n"
    "      --fps N --error PX --shade LEVELS   what it is to keep in every view\n"
    "      --json             the report as one object on standard output\n"
    "  -h, --help[=all]       this, or all options      -V, --version\n"
    "\n"
    "  spc-bench statue.spc --reference statue.ply --out statue-trade\n"
    "  spc-bench statue.spc --recommend --fps 30\n"
    "  spc-bench statue.spc --reference statue.ply --recommend --error 1\n";

static const char HELP_MORE[] =
    "\n"
    "      --size WxH         pixels (default 1024x1024)\n"
    "      --samples N        N x N samples a pixel, 1 to 8 (default 1)\n"
    "      --fov DEG          vertical field of view (default 45)\n"
    "      --up X,Y,Z         vertical axis (default: the archive's, else 0,1,0)\n"
    "      --splat exact|fast     outline of splats (default exact)\n"
    "      --renderer auto|soft|gl   as of spc-render\n"
    "      --threads N        of soft, and of the reference (default: all cores)\n"
    "      --memory SIZE      for blocks, then for pictures of the reference\n"
    "                         (default 1G); the scan's vertices are beside it\n"
    "      --no-cull          draw what could not be seen, too\n"
    "      --progress auto|always|never|json\n"
    "\n"
    "Views: front, right, back, left, above, below; near and close, at 1/4 and 1/16\n"
    "of the framing distance from the surface; inside, from the box's middle.\n";

enum { OPT_REFERENCE = 256, OPT_OUT, OPT_FORCE, OPT_EPS, OPT_MODE, OPT_VIEW, OPT_BASELINE, OPT_REPEAT,
       OPT_RECOMMEND, OPT_FPS, OPT_ERROR, OPT_SHADE, OPT_JSON, OPT_PROGRESS, OPT_SAMPLES };
static const struct option LONG[] = {
    {"reference", 1, NULL, OPT_REFERENCE}, {"out", 1, NULL, OPT_OUT}, {"force", 0, NULL, OPT_FORCE},
    {"eps", 1, NULL, OPT_EPS}, {"mode", 1, NULL, OPT_MODE}, {"view", 1, NULL, OPT_VIEW},
    {"baseline", 1, NULL, OPT_BASELINE}, {"repeat", 1, NULL, OPT_REPEAT},
    {"samples", 1, NULL, OPT_SAMPLES}, {"recommend", 0, NULL, OPT_RECOMMEND},
    {"fps", 1, NULL, OPT_FPS}, {"error", 1, NULL, OPT_ERROR}, {"shade", 1, NULL, OPT_SHADE},
    {"json", 0, NULL, OPT_JSON}, {"progress", 1, NULL, OPT_PROGRESS}, {"size", 1, NULL, PICTURE_SIZE},
    {"fov", 1, NULL, PICTURE_FOV}, {"up", 1, NULL, PICTURE_UP}, {"splat", 1, NULL, PICTURE_SPLAT},
    {"renderer", 1, NULL, PICTURE_RENDERER}, {"threads", 1, NULL, PICTURE_THREADS},
    {"memory", 1, NULL, PICTURE_MEMORY}, {"no-cull", 0, NULL, PICTURE_NO_CULL}, {"help", 2, NULL, 'h'},
    {"version", 0, NULL, 'V'}, {0},
};

enum { SIDE_MIN = 16, SIDE_MAX = 8192 };

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static int parse_eps(const char *value, struct bench_options *o)
{
    char copy[256];
    char *rest = copy, *word;
    if (strlen(value) >= sizeof copy)
        return cli_usage("--eps takes at most %d numbers", BENCH_EPS_MAX);
    strcpy(copy, value);
    o->eps_count = 0;
    while (rest != NULL) {
        word = rest;
        rest = strchr(word, ',');
        if (rest != NULL)
            *rest++ = '\0';
        if (o->eps_count == BENCH_EPS_MAX)
            return cli_usage("--eps takes at most %d numbers", BENCH_EPS_MAX);
        double *eps = &o->eps_px[o->eps_count++];
        if (!cli_double(word, eps) || !(*eps >= 1e-3 && *eps <= 1e4))
            return cli_usage("--eps takes 0.001 to 10000 pixels, several with commas between, not '%s'", value);
    }
    qsort(o->eps_px, o->eps_count, sizeof *o->eps_px, by_size);
    for (uint32_t i = 1; i < o->eps_count; i++)
        if (o->eps_px[i] == o->eps_px[i - 1])
            return cli_usage("--eps names %g twice", o->eps_px[i]);
    return EXIT_DONE;
}

/* Marks a kind by its name, first to end - 1 of them. */
static bool take_kind(const char *word, int first, int end, struct bench_options *o)
{
    for (int kind = first; kind < end; kind++)
        if (strcmp(word, BENCH_KIND_NAMES[kind]) == 0) {
            o->kinds[kind] = true;
            return true;
        }
    return false;
}

static int take_baseline(const char *word, struct bench_options *o)
{
    const bool all = strcmp(word, "all") == 0;
    for (int kind = BENCH_MODES; kind < BENCH_KINDS && all; kind++)
        o->kinds[kind] = true;
    return all || take_kind(word, BENCH_MODES, BENCH_KINDS, o) ? EXIT_DONE
                                                              : cli_usage("--baseline does not know '%s'", word);
}

static int take_budget(const char *option, const char *value, double *out)
{
    return cli_double(value, out) && *out > 0 ? EXIT_DONE
                                              : cli_usage("--%s takes a number above 0, not '%s'", option, value);
}

static int take_option(int c, const char *value, struct bench_options *o)
{
    uint32_t view = 0;
    switch (c) {
    case OPT_REFERENCE:
        if (o->scan_count == BENCH_SCANS_MAX)
            return cli_usage("--reference takes at most %d scans", BENCH_SCANS_MAX);
        o->scans[o->scan_count++] = value;
        return EXIT_DONE;
    case OPT_OUT: o->out = value; return EXIT_DONE;
    case OPT_FORCE: o->force = true; return EXIT_DONE;
    case OPT_RECOMMEND: o->recommend = true; return EXIT_DONE;
    case OPT_JSON: o->json = true; return EXIT_DONE;
    case OPT_EPS: return parse_eps(value, o);
    case OPT_FPS: return take_budget("fps", value, &o->fps);
    case OPT_ERROR: return take_budget("error", value, &o->error_px);
    case OPT_SHADE: return take_budget("shade", value, &o->shade);
    case OPT_BASELINE: return take_baseline(value, o);
    case OPT_MODE:
        return take_kind(value, 0, BENCH_MODES, o) ? EXIT_DONE : cli_usage("--mode does not know '%s'", value);
    case OPT_VIEW:
        if (!bench_view_named(value, &view))
            return cli_usage("--view does not know '%s'", value);
        o->views[view] = true;
        return EXIT_DONE;
    case OPT_REPEAT:
        return cli_u32(value, 1, BENCH_REPEAT_MAX, &o->repeat)
                   ? EXIT_DONE : cli_usage("--repeat takes 1 to %d, not '%s'", BENCH_REPEAT_MAX, value);
    case OPT_SAMPLES:
        return cli_u32(value, 1, SPV_SAMPLES_MAX, &o->samples)
                   ? EXIT_DONE : cli_usage("--samples takes 1 to %d, not '%s'", SPV_SAMPLES_MAX, value);
    case OPT_PROGRESS:
        return cli_progress_mode(value, &o->progress)
                   ? EXIT_DONE : cli_usage("--progress takes auto, always, never or json, not '%s'", value);
    default:
        return c >= PICTURE_SIZE ? picture_option(c, value, &o->picture) : cli_usage("unknown option");
    }
}

/* Where none is named, all are meant; for a recommendation, the mode that keeps its promise. */
static void fill_in(struct bench_options *o)
{
    bool mode = false, view = false;
    for (int kind = 0; kind < BENCH_MODES; kind++)
        mode = mode || o->kinds[kind];
    for (int kind = 0; kind < BENCH_MODES && !mode; kind++)
        o->kinds[kind] = o->out != NULL || kind == BENCH_HYBRID;
    for (int v = 0; v < BENCH_VIEWS; v++)
        view = view || o->views[v];
    for (int v = 0; v < BENCH_VIEWS && !view; v++)
        o->views[v] = true;
}

static int check_options(const struct bench_options *o)
{
    const bool budget = o->fps > 0 || o->error_px > 0 || o->shade > 0;
    const int w = o->picture.width, h = o->picture.height;
    if (o->out == NULL && !o->recommend)
        return cli_usage("no folder is named (--out DIR)");
    if (o->recommend != budget)
        return cli_usage(budget ? "--fps, --error and --shade go with --recommend"
                                : "--recommend needs --fps N, --error PX or --shade LEVELS");
    if (w < SIDE_MIN || h < SIDE_MIN || w > SIDE_MAX || h > SIDE_MAX)
        return cli_usage("--size takes sides of %d to %d here", SIDE_MIN, SIDE_MAX);
    return picture_check(&o->picture);
}

int main(int argc, char **argv)
{
    static struct bench_options o = {.repeat = 5, .samples = 1, .eps_px = {0.25, 0.5, 1, 2, 4, 8, 16}, .eps_count = 7,
                                     .progress = CLI_PROGRESS_AUTO};
    int c;
    cli_init("spc-bench");
    meta_init();
    o.picture = picture_defaults();
    opterr = 0;
    while ((c = getopt_long(argc, argv, "hV", LONG, NULL)) != -1) {
        int code;
        if (cli_common(c, argv, HELP, HELP_MORE, &code))
            return code;
        code = take_option(c, optarg, &o);
        if (code != EXIT_DONE)
            return code;
    }
    if (argc - optind != 1)
        return argc == optind ? cli_usage("no archive is named")
                              : cli_usage("'%s' is one file too many", argv[optind + 1]);
    o.archive = argv[optind];
    const int code = check_options(&o);
    if (code != EXIT_DONE)
        return code;
    fill_in(&o);
    cli_catch_signals();
    signal(SIGPIPE, SIG_IGN);       /* nobody reads the progress any more: no reason to stop */
    return cli_finish(bench_run(&o));
}
