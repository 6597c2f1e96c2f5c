/* spc-render: pictures of an archive, without a display. */
#include "cli.h"
#include "render_pictures.h"

#include <getopt.h>
#include <stdio.h>
#include <string.h>

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
    "      --samples N        N x N samples a pixel, 1 to 8: smooth edges\n"
    "      --background RRGGBB|none   none: transparent (default 202428)\n"
    "      --views 6          front, right, back, left, top, bottom in one picture\n"
    "      --frames N         N pictures around the model, OUT0001.png and so on\n"
    "      --stats FILE.json  counts and times of the pictures\n"
    "  -h, --help[=all]       this, or all options      -V, --version\n"
    "\n"
    "  spc-render statue.spc -o statue.png\n"
    "  spc-render --orbit 30,20 --samples 2 --size 1920x1080 statue.spc -o statue.png\n"
    "  spc-render --frames 360 --eps 2 statue.spc -o turn.png\n";

static const char HELP_MORE[] =
    "\n"
    "      --turn DEG         what --frames turn by together (default 360)\n"
    "      --splat exact|fast     outline of splats (default exact)\n"
    "      --renderer auto|soft|gl   soft: on all cores, without OpenGL; auto: gl\n"
    "                         where a graphics card draws it, else soft\n"
    "      --threads N        threads of soft (default: all cores)\n"
    "      --memory SIZE      for blocks that --frames and --views keep (default 1G)\n"
    "      --no-cull          draw what could not be seen, too\n";

enum { OPT_STATS = 256, OPT_FRAMES, OPT_TURN, OPT_VIEWS, OPT_SAMPLES };
static const struct option LONG[] = {
    {"output", 1, NULL, 'o'}, {"size", 1, NULL, PICTURE_SIZE}, {"orbit", 1, NULL, PICTURE_ORBIT},
    {"eye", 1, NULL, PICTURE_EYE}, {"target", 1, NULL, PICTURE_TARGET}, {"up", 1, NULL, PICTURE_UP},
    {"fov", 1, NULL, PICTURE_FOV}, {"eps", 1, NULL, PICTURE_EPS}, {"mode", 1, NULL, PICTURE_MODE},
    {"splat", 1, NULL, PICTURE_SPLAT}, {"renderer", 1, NULL, PICTURE_RENDERER},
    {"threads", 1, NULL, PICTURE_THREADS}, {"background", 1, NULL, PICTURE_BACKGROUND},
    {"no-cull", 0, NULL, PICTURE_NO_CULL}, {"memory", 1, NULL, PICTURE_MEMORY}, {"stats", 1, NULL, OPT_STATS},
    {"frames", 1, NULL, OPT_FRAMES}, {"turn", 1, NULL, OPT_TURN}, {"views", 1, NULL, OPT_VIEWS},
    {"samples", 1, NULL, OPT_SAMPLES}, {"help", 2, NULL, 'h'}, {"version", 0, NULL, 'V'}, {0},
};

static int take_option(int c, const char *value, struct render_options *o)
{
    switch (c) {
    case 'o':
        o->out = value;
        return EXIT_DONE;
    case OPT_STATS:
        o->stats = value;
        return EXIT_DONE;
    case OPT_FRAMES:
        if (!cli_u32(value, 1, RENDER_FRAMES_MAX, &o->frames))
            return cli_usage("--frames takes 1 to %d, not '%s'", RENDER_FRAMES_MAX, value);
        return EXIT_DONE;
    case OPT_TURN:
        if (!cli_double(value, &o->turn_deg))
            return cli_usage("--turn takes degrees, not '%s'", value);
        o->has_turn = true;
        return EXIT_DONE;
    case OPT_VIEWS:
        if (strcmp(value, "6") != 0)
            return cli_usage("--views takes 6, not '%s'", value);
        o->six_views = true;
        return EXIT_DONE;
    case OPT_SAMPLES:
        if (!cli_u32(value, 1, SPV_SAMPLES_MAX, &o->samples))
            return cli_usage("--samples takes 1 to %d, not '%s'", SPV_SAMPLES_MAX, value);
        return EXIT_DONE;
    default:
        return c >= PICTURE_SIZE ? picture_option(c, value, &o->picture) : cli_usage("unknown option");
    }
}

static int check_options(const struct render_options *o)
{
    if (o->out == NULL)
        return cli_usage("no picture is named (-o OUT.png)");
    if (cli_same_file(o->archive, o->out) || (o->stats != NULL && cli_same_file(o->archive, o->stats)))
        return cli_usage("the archive itself cannot be written to");
    if (o->stats != NULL && o->frames == 0 && cli_same_output(o->stats, o->out))
        return cli_usage("the picture and --stats are the same file: '%s'", o->stats);
    if (o->has_turn && o->frames == 0)
        return cli_usage("--turn needs --frames");
    if (o->frames > 0 && o->six_views)
        return cli_usage("--frames and --views exclude each other");
    if ((o->frames > 0 || o->six_views) && o->picture.has_eye)
        return cli_usage("--frames and --views go around the model: --eye has no part in it");
    if ((uint32_t)o->picture.width * o->samples > PICTURE_SIDE_MAX ||
        (uint32_t)o->picture.height * o->samples > PICTURE_SIDE_MAX)
        return cli_usage("--size times --samples is more than %d", PICTURE_SIDE_MAX);
    return picture_check(&o->picture);
}

int main(int argc, char **argv)
{
    struct render_options o = {.picture = picture_defaults(), .turn_deg = 360, .samples = 1};
    int c;
    cli_init("spc-render");
    opterr = 0;
    while ((c = getopt_long(argc, argv, "o:hV", LONG, NULL)) != -1) {
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
    return code == EXIT_DONE ? cli_finish(render(&o)) : code;
}
