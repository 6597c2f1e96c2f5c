/* spc-view: archives in a window, whatever their size. */
#include "view.h"

#include <getopt.h>
#include <stdio.h>
#include <string.h>

static const char HELP[] =
    "usage: spc-view [options] FILE...\n"
    "Shows .spc archives in a window, at once and whatever their size. h: the keys.\n"
    "\n"
    "      --size WxH         pixels (default 1024x1024)\n"
    "      --orbit AZ,EL[,DIST]   degrees around the model's middle; 0,0 is the front\n"
    "      --eye X,Y,Z --target X,Y,Z   a free camera\n"
    "      --up X,Y,Z         vertical axis (default: the archive's, else 0,1,0)\n"
    "      --fov DEG          vertical field of view (default 45)\n"
    "      --eps PX           accepted error on screen when still (default 1)\n"
    "      --fps N            frames a second that movement keeps, by a coarser\n"
    "                         picture (default 30; 0: as fine as when still)\n"
    "      --mode hybrid|points|triangles   (default hybrid)\n"
    "      --memory SIZE      for decoded blocks: K M G (default 1G)\n"
    "      --background RRGGBB    (default 202428)\n"
    "      --screenshot OUT.png   save the picture once it is complete, and end\n"
    "      --script FILE      replay keys, pointer and cameras\n"
    "  -h, --help[=all]       this, or all options      -V, --version\n"
    "\n"
    "  spc-view statue.spc\n"
    "  spc-view --eps 0.5 --memory 8G nave.spc choir.spc\n";

static const char HELP_MORE[] =
    "\n"
    "      --nodes N          instead of --fps: nodes that a frame of movement tests\n"
    "      --offscreen        no window (for --script and --screenshot)\n"
    "      --stats FILE.csv   a line a frame: counts, bytes, times\n"
    "      --json             a summary as JSON on standard output\n"
    "      --samples N        N x N samples a pixel when still, 1 to 8 (default 2)\n"
    "      --splat exact|fast     outline of splats (default exact)\n"
    "      --renderer auto|soft|gl   soft: on all cores, without OpenGL; auto: gl\n"
    "                         where a graphics card draws it, else soft\n"
    "      --threads N        threads of soft, and that read (default: all cores)\n"
    "      --no-cull          draw what could not be seen, too\n";

enum { OPT_SCRIPT = 256, OPT_STATS, OPT_SCREENSHOT, OPT_FPS, OPT_OFFSCREEN, OPT_JSON, OPT_SAMPLES, OPT_NODES };
static const struct option LONG[] = {
    {"size", 1, NULL, PICTURE_SIZE}, {"orbit", 1, NULL, PICTURE_ORBIT}, {"eye", 1, NULL, PICTURE_EYE},
    {"target", 1, NULL, PICTURE_TARGET}, {"up", 1, NULL, PICTURE_UP}, {"fov", 1, NULL, PICTURE_FOV},
    {"eps", 1, NULL, PICTURE_EPS}, {"mode", 1, NULL, PICTURE_MODE}, {"splat", 1, NULL, PICTURE_SPLAT},
    {"renderer", 1, NULL, PICTURE_RENDERER}, {"threads", 1, NULL, PICTURE_THREADS},
    {"background", 1, NULL, PICTURE_BACKGROUND}, {"no-cull", 0, NULL, PICTURE_NO_CULL},
    {"memory", 1, NULL, PICTURE_MEMORY}, {"script", 1, NULL, OPT_SCRIPT}, {"stats", 1, NULL, OPT_STATS},
    {"screenshot", 1, NULL, OPT_SCREENSHOT}, {"fps", 1, NULL, OPT_FPS}, {"offscreen", 0, NULL, OPT_OFFSCREEN},
    {"json", 0, NULL, OPT_JSON}, {"samples", 1, NULL, OPT_SAMPLES}, {"nodes", 1, NULL, OPT_NODES},
    {"help", 2, NULL, 'h'}, {"version", 0, NULL, 'V'}, {0},
};

static int take_option(int c, const char *value, struct view_options *o)
{
    switch (c) {
    case OPT_SCRIPT: o->script = value; return EXIT_DONE;
    case OPT_STATS: o->stats = value; return EXIT_DONE;
    case OPT_SCREENSHOT: o->screenshot = value; return EXIT_DONE;
    case OPT_OFFSCREEN: o->offscreen = true; return EXIT_DONE;
    case OPT_JSON: o->json = true; return EXIT_DONE;
    case OPT_FPS:
        if (!cli_double(value, &o->fps) || !(o->fps >= 0 && o->fps <= 1000))
            return cli_usage("--fps takes 0 to 1000, not '%s'", value);
        return EXIT_DONE;
    case OPT_NODES:
        if (!cli_u32(value, 1000, UINT32_MAX, &o->nodes))
            return cli_usage("--nodes takes at least 1000, not '%s'", value);
        return EXIT_DONE;
    case OPT_SAMPLES:
        if (!cli_u32(value, 1, SPV_SAMPLES_MAX, &o->samples))
            return cli_usage("--samples takes 1 to %d, not '%s'", SPV_SAMPLES_MAX, value);
        return EXIT_DONE;
    default:
        return c >= PICTURE_SIZE ? picture_option(c, value, &o->picture) : cli_usage("unknown option");
    }
}

static int check_options(const struct view_options *o)
{
    if (o->file_count == 0 && (o->script != NULL || o->screenshot != NULL || o->offscreen))
        return cli_usage("no archive is named");
    if (o->offscreen && o->script == NULL && o->screenshot == NULL)
        return cli_usage("--offscreen needs --script or --screenshot");
    if (o->script != NULL && strcmp(o->script, "-") == 0)
        return cli_usage("--script takes a file");
    if (o->stats != NULL && o->screenshot != NULL && cli_same_output(o->stats, o->screenshot))
        return cli_usage("--screenshot and --stats are the same file: '%s'", o->stats);
    for (int i = 0; i < o->file_count; i++)
        if ((o->stats != NULL && cli_same_file(o->files[i], o->stats)) ||
            (o->screenshot != NULL && cli_same_file(o->files[i], o->screenshot)))
            return cli_usage("an archive cannot be written to: '%s'", o->files[i]);
    if (o->script != NULL && ((o->stats != NULL && cli_same_file(o->script, o->stats)) ||
                              (o->screenshot != NULL && cli_same_file(o->script, o->screenshot))))
        return cli_usage("the script itself cannot be written to");
    return picture_check(&o->picture);
}

int main(int argc, char **argv)
{
    struct view_options o = {.picture = picture_defaults(), .fps = 30, .samples = VIEW_STILL_SAMPLES};
    int c;
    cli_init("spc-view");
    opterr = 0;
    while ((c = getopt_long(argc, argv, "hV", LONG, NULL)) != -1) {
        int code;
        if (cli_common(c, argv, HELP, HELP_MORE, &code))
            return code;
        code = take_option(c, optarg, &o);
        if (code != EXIT_DONE)
            return code;
    }
    o.files = argv + optind;
    o.file_count = argc - optind;
    const int code = check_options(&o);
    return code == EXIT_DONE ? cli_finish(view_session(&o)) : code;
}
