/* spc-render: a picture of an archive, without a display. */
#include "cli.h"
#include "count.h"
#include "ctx.h"
#include "draw.h"
#include "meta.h"
#include "png_file.h"

#include <getopt.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static const char HELP[] =
    "usage: spc-render [options] FILE -o OUT.png\n"
    "Draws an .spc archive into a PNG, without a display; the whole model by default.\n"
    "\n"
    "  -o, --output FILE      the picture\n"
    "      --size WxH         pixels (default 1024x1024)\n"
    "      --orbit AZ,EL[,DIST]   degrees around the model's middle; 0,0 is the front\n"
    "      --eye X,Y,Z --target X,Y,Z   a free camera\n"
    "      --up X,Y,Z         vertical axis (default: the archive's, else 0,1,0)\n"
    "      --fov DEG          vertical field of view (default 45)\n"
    "      --eps PX           accepted error on screen (default 1)\n"
    "      --mode hybrid|points|triangles   (default hybrid)\n"
    "      --splat exact|fast     outline of splats (default exact)\n"
    "      --renderer auto|soft|gl   soft: on all cores, without OpenGL\n"
    "      --threads N        threads of soft (default: all cores)\n"
    "      --background RRGGBB|none   none: transparent (default 202428)\n"
    "      --no-cull          draw what could not be seen, too\n"
    "      --stats FILE.json  counts and times of the frame\n"
    "  -h, --help    -V, --version\n"
    "\n"
    "  spc-render statue.spc -o statue.png\n"
    "  spc-render --orbit 30,20 --eps 2 --size 1920x1080 statue.spc -o statue.png\n";

enum { OPT_SIZE = 256, OPT_ORBIT, OPT_EYE, OPT_TARGET, OPT_UP, OPT_FOV, OPT_EPS, OPT_MODE,
       OPT_SPLAT, OPT_RENDERER, OPT_THREADS, OPT_BACKGROUND, OPT_NO_CULL, OPT_STATS };
static const struct option LONG[] = {
    {"output", 1, NULL, 'o'}, {"size", 1, NULL, OPT_SIZE}, {"orbit", 1, NULL, OPT_ORBIT},
    {"eye", 1, NULL, OPT_EYE}, {"target", 1, NULL, OPT_TARGET}, {"up", 1, NULL, OPT_UP},
    {"fov", 1, NULL, OPT_FOV}, {"eps", 1, NULL, OPT_EPS}, {"mode", 1, NULL, OPT_MODE},
    {"splat", 1, NULL, OPT_SPLAT}, {"renderer", 1, NULL, OPT_RENDERER},
    {"threads", 1, NULL, OPT_THREADS}, {"background", 1, NULL, OPT_BACKGROUND}, {"no-cull", 0, NULL, OPT_NO_CULL},
    {"stats", 1, NULL, OPT_STATS}, {"help", 0, NULL, 'h'}, {"version", 0, NULL, 'V'}, {0},
};

enum { SIDE_MAX = 65535 };
enum { RENDERER_AUTO, RENDERER_SOFT, RENDERER_GL };

struct arguments {
    const char *archive, *out, *stats;
    int width, height;
    double azimuth, elevation, distance;            /* degrees; distance 0: framed */
    double eye[3], target[3], up[3];
    bool has_eye, has_target, has_up, has_orbit;
    double fov_deg, eps_px;
    int mode, splat, renderer;
    uint32_t threads;               /* 0: all cores */
    bool no_cull, transparent;
    uint8_t background[3];
};

/* ---- options ------------------------------------------------------------------------------------ */

static bool parse_size(const char *text, int *width, int *height)
{
    char copy[32];
    uint32_t w, h;
    char *x;
    if (strlen(text) >= sizeof copy)
        return false;
    strcpy(copy, text);
    x = strchr(copy, 'x');
    if (x == NULL)
        return false;
    *x = '\0';
    if (!cli_u32(copy, 1, SIDE_MAX, &w) || !cli_u32(x + 1, 1, SIDE_MAX, &h))
        return false;
    *width = (int)w;
    *height = (int)h;
    return true;
}

static bool parse_background(const char *text, struct arguments *a)
{
    a->transparent = strcmp(text, "none") == 0;
    if (a->transparent)
        return true;
    if (strlen(text) != 6 || strspn(text, "0123456789abcdefABCDEF") != 6)
        return false;
    const unsigned long v = strtoul(text, NULL, 16);
    for (int i = 0; i < 3; i++)
        a->background[i] = (uint8_t)(v >> (16 - 8 * i));
    return true;
}

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

static int parse_orbit(const char *value, struct arguments *a)
{
    double v[3] = {0, 0, 0};
    if (!cli_doubles(value, v, 2) && (!cli_doubles(value, v, 3) || !(v[2] > 0)))
        return cli_usage("--orbit takes AZ,EL or AZ,EL,DIST with DIST above 0, not '%s'", value);
    a->azimuth = v[0];
    a->elevation = v[1];
    a->distance = v[2];
    a->has_orbit = true;
    return EXIT_DONE;
}

static int parse_option(int c, const char *value, struct arguments *a)
{
    static const char *const modes[] = {"hybrid", "points", "triangles"};
    static const char *const splats[] = {"exact", "fast"};
    static const char *const renderers[] = {"auto", "soft", "gl"};
    switch (c) {
    case 'o': a->out = value; return EXIT_DONE;
    case OPT_STATS: a->stats = value; return EXIT_DONE;
    case OPT_NO_CULL: a->no_cull = true; return EXIT_DONE;
    case OPT_ORBIT: return parse_orbit(value, a);
    case OPT_MODE: return choose("mode", value, modes, 3, &a->mode);
    case OPT_SPLAT: return choose("splat", value, splats, 2, &a->splat);
    case OPT_RENDERER: return choose("renderer", value, renderers, 3, &a->renderer);
    case OPT_THREADS:
        if (!cli_u32(value, 1, 1024, &a->threads))
            return cli_usage("--threads takes 1 to 1024, not '%s'", value);
        return EXIT_DONE;
    case OPT_SIZE:
        if (!parse_size(value, &a->width, &a->height))
            return cli_usage("--size takes WxH, 1 to %d each, not '%s'", SIDE_MAX, value);
        return EXIT_DONE;
    case OPT_EYE:
        a->has_eye = true;
        if (!cli_doubles(value, a->eye, 3))
            return cli_usage("--eye takes X,Y,Z, not '%s'", value);
        return EXIT_DONE;
    case OPT_TARGET:
        a->has_target = true;
        if (!cli_doubles(value, a->target, 3))
            return cli_usage("--target takes X,Y,Z, not '%s'", value);
        return EXIT_DONE;
    case OPT_UP:
        if (!cli_doubles(value, a->up, 3))
            return cli_usage("--up takes X,Y,Z, not '%s'", value);
        a->has_up = true;
        return EXIT_DONE;
    case OPT_FOV:
        if (!cli_double(value, &a->fov_deg) || !(a->fov_deg >= 0.01 && a->fov_deg <= 179))
            return cli_usage("--fov takes 0.01 to 179 degrees, not '%s'", value);
        return EXIT_DONE;
    case OPT_EPS:
        if (!cli_double(value, &a->eps_px) || !(a->eps_px > 0))
            return cli_usage("--eps takes pixels above 0, not '%s'", value);
        return EXIT_DONE;
    case OPT_BACKGROUND:
        if (!parse_background(value, a))
            return cli_usage("--background takes RRGGBB or none, not '%s'", value);
        return EXIT_DONE;
    default:
        return cli_usage("unknown option");
    }
}

static bool same_file(const char *a, const char *b)
{
    struct stat x, y;
    return stat(a, &x) == 0 && stat(b, &y) == 0 && x.st_dev == y.st_dev && x.st_ino == y.st_ino;
}

static int check_arguments(struct arguments *a)
{
    if (a->out == NULL)
        return cli_usage("no picture is named (-o OUT.png)");
    if (same_file(a->archive, a->out) || (a->stats != NULL && same_file(a->archive, a->stats)))
        return cli_usage("the archive itself cannot be written to");
    if (a->has_eye != a->has_target)
        return cli_usage("--eye and --target go together");
    if (a->has_eye && a->has_orbit)
        return cli_usage("--orbit and --eye exclude each other");
    return EXIT_DONE;
}

/* ---- the picture -------------------------------------------------------------------------------- */

/* The axis that the archive's metadata names. */
static void take_up(const struct spc_reader *reader, double up[3])
{
    struct meta_coordinates c;
    size_t bytes = 0;
    const char *text = spc_reader_meta(reader, &bytes);
    json_t *meta = json_loadb(text, bytes, 0, NULL);
    meta_read_coordinates(meta, &c);
    json_decref(meta);
    const char *axis = c.up[0] == '-' ? c.up + 1 : c.up;
    if (axis[0] < 'x' || axis[0] > 'z')
        return;
    for (int a = 0; a < 3; a++)
        up[a] = axis[0] - 'x' != a ? 0 : c.up[0] == '-' ? -1 : 1;
}

static bool make_camera(const struct arguments *a, const struct spc_header *h,
                        struct spv_camera *camera)
{
    const double degree = 3.14159265358979323846 / 180;
    if (a->has_eye)
        return spv_camera_look(camera, a->eye, a->target, a->up, a->fov_deg * degree, a->width,
                               a->height);
    return spv_camera_orbit(camera, h->box_min, h->box_max, a->azimuth * degree,
                            a->elevation * degree, a->distance, a->up, a->fov_deg * degree,
                            a->width, a->height);
}

static void put_background(const struct arguments *a, uint8_t *rgba)
{
    const size_t n = (size_t)a->width * (size_t)a->height;
    for (size_t i = 0; i < n && !a->transparent; i++)
        if (rgba[4 * i + 3] == 0)
            memcpy(rgba + 4 * i, a->background, 3);
}

struct result {
    struct spv_selection selection;
    struct spv_count count;
    double open_ms, frame_ms;
    char renderer[128];
};

static enum spc_status write_stats(const char *path, const struct result *r,
                                   struct spc_error *err)
{
    const struct spv_selection *s = &r->selection;
    json_t *out = json_pack(
        "{s:I, s:I, s:I, s:I, s:I, s:{s:I, s:I, s:I, s:I}, s:I, s:f, s:f, s:I, s:s}",
        "nodes_drawn", (json_int_t)r->count.nodes_drawn, "nodes_processed",
        (json_int_t)r->count.nodes_processed, "triangles_drawn",
        (json_int_t)r->count.triangles_drawn, "clusters_total", (json_int_t)s->clusters_total,
        "clusters_drawn", (json_int_t)s->clusters_drawn, "culled", "frustum",
        (json_int_t)s->culled_frustum, "backface", (json_int_t)s->culled_backface, "range",
        (json_int_t)s->culled_range, "occlusion", (json_int_t)0, "bytes_read",
        (json_int_t)r->count.bytes_read, "frame_ms", r->frame_ms, "open_ms", r->open_ms,
        "fallback_splats", (json_int_t)0, "renderer", r->renderer);
    const int failed = out == NULL || json_dump_file(out, path, JSON_INDENT(2)) != 0;
    json_decref(out);
    return failed ? spc_fail(err, SPC_IO, SPC_NO_OFF, "cannot write the statistics") : SPC_OK;
}

/*
 * GL when it was asked for, or where a graphics card draws it. The one context there is without a
 * display, OSMesa, is drawn by the processor: auto does not even make one.
 */
static enum spc_status open_renderer(const struct arguments *a, struct spv_ctx **ctx, struct spv_draw **draw,
                                     struct spc_error *err)
{
    if (a->renderer != RENDERER_GL)
        return spv_soft_create(a->threads, draw, err);
    const enum spc_status status = spv_ctx_osmesa(ctx, err);
    return status == SPC_OK ? spv_gl_create(*ctx, draw, err) : status;
}

static enum spc_status draw(const struct arguments *a, const struct spc_reader *reader,
                            const struct spv_view *view, uint8_t *rgba, struct result *r,
                            struct spc_error *err)
{
    const struct spv_draw_options options = {.splat = (enum spv_splat)a->splat, .ambient = 0.2f};
    struct spv_draw *by = NULL;
    struct spv_ctx *ctx = NULL;
    enum spc_status status = open_renderer(a, &ctx, &by, err);
    if (status == SPC_OK) {
        const double began = cli_seconds();
        snprintf(r->renderer, sizeof r->renderer, "%s", spv_draw_name(by));
        status = spv_select(reader, view, &r->selection, err);
        if (status == SPC_OK)
            status = spv_draw_selection(by, reader, view, &r->selection, &options, rgba, NULL, err);
        r->frame_ms = 1e3 * (cli_seconds() - began);
    }
    spv_draw_free(by);
    spv_ctx_free(ctx);
    return status;
}

static int render(struct arguments *a)
{
    struct spc_reader *reader = NULL;
    struct spc_error err = {0};
    struct result result = {0};
    struct spv_view view = {.mode = (enum spv_mode)a->mode, .cull = !a->no_cull};
    const char *file = a->archive;
    int code = EXIT_FAILED;
    const double began = cli_seconds();
    uint8_t *rgba = malloc((size_t)a->width * (size_t)a->height * 4);
    enum spc_status status = rgba ? spc_reader_open(a->archive, &reader, &err)
                                  : spc_fail(&err, SPC_NO_MEMORY, SPC_NO_OFF,
                                             "no memory for a picture of %d x %d: %zu MB",
                                             a->width, a->height,
                                             ((size_t)a->width * (size_t)a->height) >> 18);
    result.open_ms = 1e3 * (cli_seconds() - began);
    if (status != SPC_OK)
        goto out;
    const struct spc_header *h = spc_reader_header(reader);
    if (!a->has_up)
        take_up(reader, a->up);
    if (view.mode == SPV_TRIANGLES && !(h->flags & SPC_FLAG_TRIANGLES)) {
        status = spc_fail(&err, SPC_FEATURE, SPC_NO_OFF, "it holds points only, no triangles");
        goto out;
    }
    if (!make_camera(a, h, &view.camera)) {
        code = cli_usage("the camera looks along its vertical axis, or nowhere");
        goto out;
    }
    view.eps = spv_camera_eps(&view.camera, a->eps_px);
    status = draw(a, reader, &view, rgba, &result, &err);
    if (status == SPC_OK && a->stats != NULL)
        status = spv_count(reader, &view, &result.selection, &result.count, &err);
    if (status != SPC_OK)
        goto out;
    put_background(a, rgba);
    file = a->out;
    status = spv_png_write(a->out, rgba, a->width, a->height, a->transparent, &err);
    if (status == SPC_OK && a->stats != NULL) {
        file = a->stats;
        status = write_stats(a->stats, &result, &err);
    }
    code = status == SPC_OK ? EXIT_DONE : EXIT_FAILED;
out:
    if (status != SPC_OK) {
        cli_error(file, &err, NULL);
        code = status >= SPC_NOT_SPC && status < SPC_INPUT_FORMAT && status != SPC_FEATURE
            ? EXIT_INVALID : EXIT_FAILED;
    }
    spv_selection_release(&result.selection);
    spc_reader_close(reader);
    free(rgba);
    return cli_finish(code);
}

int main(int argc, char **argv)
{
    struct arguments a = {.width = 1024, .height = 1024, .up = {0, 1, 0}, .fov_deg = 45,
                          .eps_px = 1, .background = {0x20, 0x24, 0x28}};
    int c;
    cli_init("spc-render");
    opterr = 0;
    while ((c = getopt_long(argc, argv, "o:hV", LONG, NULL)) != -1) {
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
        return cli_usage("no archive is named");
    if (optind + 1 < argc)
        return cli_usage("one archive at a time: '%s' is left over", argv[optind + 1]);
    a.archive = argv[optind];
    const int code = check_arguments(&a);
    return code == EXIT_DONE ? render(&a) : code;
}
