/* view.c - begins and ends a session; the loop of a user, and that of a script. */
#include "view.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>

static const double IDLE_S = 10, LOADING_S = 0.04, RETRY_S = 0.5;
static const double PAUSE_S = 0.15;             /* between two moves of one movement: no picture is refined then */

/* ---- a user -------------------------------------------------------------------------------------- */

/* How long nothing has to be drawn, s; 0: draw now. */
static double rest(const struct view *v)
{
    if (v->changed || v->moving || !view_finest(v))
        return 0;
    if (v->notice[0] != '\0')
        return fmax(0.01, v->notice_until - cli_seconds());
    if (view_loading(v))
        return LOADING_S;
    return v->stats.blocks_failed > 0 ? RETRY_S : IDLE_S;
}

/* After it was still for a moment: with several samples a pixel. */
static bool wants_smooth(const struct view *v)
{
    return v->smooth && !v->changed && !v->moving && view_settled(v) && v->drawn_samples < (int)v->o.samples &&
           spv_scene_count(v->scene) > 0;
}

static void take_events(struct view *v)
{
    struct spv_event event;
    while (spv_window_event(v->window, &event))
        view_event(v, &event);
}

static int run_user(struct view *v)
{
    double last = cli_seconds(), moved_last = -PAUSE_S, wait = 0;
    bool failed = false;
    while (!v->quit) {
        spv_window_wait(v->window, wait);
        take_events(v);
        const double now = cli_seconds();
        const bool moved = spv_control_step(&v->control, now - last);
        last = now;
        if (v->notice[0] != '\0' && now > v->notice_until) {
            v->notice[0] = '\0';
            v->changed = true;
        }
        if (moved)
            moved_last = now;
        v->moving = spv_control_moving(&v->control) || now - moved_last < PAUSE_S;
        const bool due = rest(v) == 0 || view_loading(v) || v->stats.blocks_failed > 0;
        if (due || wants_smooth(v))
            failed = !view_frame(v);        /* there may be room later */
        wait = v->quit || wants_smooth(v) ? 0 : failed ? RETRY_S : rest(v);
    }
    return EXIT_DONE;
}

/* ---- a script ------------------------------------------------------------------------------------ */

static bool frame(struct view *v)
{
    struct spv_event event;
    v->moving = spv_control_step(&v->control, SPV_SCRIPT_FRAME_S) || spv_control_moving(&v->control);
    while (v->window != NULL && spv_window_event(v->window, &event))
        if (event.kind == SPV_EVENT_CLOSE)      /* the picture's size is the script's */
            view_event(v, &event);
    if (v->window != NULL)
        spv_window_wait(v->window, 0);
    return view_frame(v);
}

/* Until nothing is missing that can be had; what cannot be read is tried once more, and then given up. */
static bool settle(struct view *v)
{
    do {
        while (spv_scene_wait(v->scene))
            ;
        if (!frame(v))
            return false;
    } while (!v->quit && (spv_scene_busy(v->scene) > 0 || !view_finest(v) || v->moving ||
                          (!view_settled(v) && v->stats.bytes_read > 0)));
    return true;
}

static void set_eps(struct view *v, double eps_px)
{
    spv_pace_set(&v->pace, eps_px, v->pace.target);
    v->changed = true;
}

/* A file that cannot be opened ends a script: nobody is there to read the message. */
static int do_event(struct view *v, const struct spv_event *event)
{
    struct spc_error err = {0};
    if (event->kind != SPV_EVENT_DROP) {
        view_event(v, event);
        return EXIT_DONE;
    }
    const enum spc_status status = view_open(v, event->path, &err);
    v->message[0] = '\0';
    if (status != SPC_OK)
        cli_error(event->path, &err, NULL);
    return cli_exit_code(status);
}

/* A camera that a script asks for and does not get would be missed in the pictures only. */
static int place(struct view *v, const struct spv_step *step)
{
    const struct spv_pose *now = &v->control.pose, *asked = &step->pose;
    struct spc_error err = {0};
    spv_script_control(step, &v->control);
    v->changed = true;
    if (!step->arrives || (memcmp(now->eye, asked->eye, sizeof now->eye) == 0 &&
                           memcmp(now->target, asked->target, sizeof now->target) == 0))
        return EXIT_DONE;
    spc_fail(&err, SPC_INPUT_BAD, SPC_NO_OFF, "line %u: the camera looks along its vertical axis, or nowhere",
             step->line);
    cli_error(v->o.script, &err, NULL);
    return EXIT_FAILED;
}

/* Returns an exit code. */
static int do_step(struct view *v, const struct spv_step *step)
{
    switch (step->kind) {
    case SPV_STEP_FRAME: return frame(v) ? EXIT_DONE : EXIT_FAILED;
    case SPV_STEP_WAIT: return settle(v) ? EXIT_DONE : EXIT_FAILED;
    case SPV_STEP_EVENT: return do_event(v, &step->event);
    case SPV_STEP_EPS: set_eps(v, step->number[0]); return EXIT_DONE;
    case SPV_STEP_MODE: v->mode = (enum spv_mode)step->number[0]; break;
    case SPV_STEP_SPLAT: v->splat = (enum spv_splat)step->number[0]; break;
    case SPV_STEP_POSE: return place(v, step);
    case SPV_STEP_SCREENSHOT: return frame(v) ? view_save(v, step->path) : EXIT_FAILED;
    default: spv_script_control(step, &v->control); break;
    }
    v->changed = true;
    return EXIT_DONE;
}

static int run_script(struct view *v, const struct spv_script *script)
{
    struct spv_player player = {.script = script};
    int code = EXIT_DONE;
    while (code == EXIT_DONE && !v->quit) {
        const struct spv_step step = spv_script_next(&player, &v->control.pose);
        if (step.kind == SPV_STEP_END)
            break;
        code = do_step(v, &step);
    }
    return code;
}

static enum spc_status read_script(const char *path, struct spv_script **out, struct spc_error *err)
{
    FILE *f = fopen(path, "re");
    if (f == NULL)
        return spc_fail_os(err, errno, "cannot open the script");
    char *text = malloc(SPV_SCRIPT_BYTES + 1);
    const size_t n = text != NULL ? fread(text, 1, SPV_SCRIPT_BYTES + 1, f) : 0;
    enum spc_status status = text == NULL ? spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a script")
                             : ferror(f) ? spc_fail_os(err, errno, "cannot read the script")
                                         : spv_script_parse(text, n, out, err);
    for (char *p = err->what; *p != '\0'; p++)     /* of what is no script, too */
        *p = (unsigned char)*p < 0x20 || *p == 0x7F ? '?' : *p;
    free(text);
    fclose(f);
    return status;
}

/* ---- begin and end ------------------------------------------------------------------------------- */

/* An empty window at once: what shows pictures is made ready by the first one, which may take a while. */
static void show_empty(struct view *v)
{
    const uint8_t *b = v->o.picture.background, pixel[4] = {b[0], b[1], b[2], 255};
    spv_show_size(v->show, v->width, v->height);
    spv_show_clear(v->show, (uint32_t)b[0] << 16 | (uint32_t)b[1] << 8 | b[2]);
    spv_show_picture(v->show, pixel, 1, 1, 0, 0, 0, NULL);
    spv_window_swap(v->window);
}

/* A window, where there is a display and nobody wants to do without. */
static enum spc_status open_window(struct view *v, struct spc_error *err)
{
    if (v->o.offscreen)
        return SPC_OK;
    enum spc_status status = spv_window_create("spc-view", v->width, v->height, &v->window, err);
    if (status == SPC_FEATURE && (v->o.script != NULL || v->o.screenshot != NULL)) {
        v->o.offscreen = true;
        *err = (struct spc_error){0};
        return SPC_OK;
    }
    if (status == SPC_OK)
        status = spv_show_create(spv_window_ctx(v->window), &v->show, err);
    if (status == SPC_OK && v->o.script == NULL && v->o.screenshot == NULL)
        spv_window_size(v->window, &v->width, &v->height);
    if (status == SPC_OK)
        show_empty(v);
    return status;
}

static enum spc_status begin(struct view *v, struct spc_error *err)
{
    const struct picture_options *p = &v->o.picture;
    const struct spv_scene_options scene = {.budget = p->memory, .threads = p->threads,
                                            .upload_bytes = (uint64_t)32 << 20};
    static const double ORIGIN[3] = {0, 0, 0};
    v->width = p->width;
    v->height = p->height;
    v->mode = p->mode;
    v->splat = p->splat;
    v->statistics = v->smooth = true;
    v->drawn_samples = 1;
    const double asked = cli_seconds();
    spv_pace_init(&v->pace, p->eps_px, v->o.nodes > 0 ? v->o.nodes : v->o.fps > 0 ? 1 / v->o.fps : 0);
    enum spc_status status = open_window(v, err);
    v->times.began = cli_seconds();
    v->times.window_ms = 1e3 * (v->times.began - asked);
    const double scale = v->window != NULL ? spv_window_scale(v->window) : 1;
    if (status == SPC_OK)
        status = spv_text_create((int)(SPV_TEXT_LINE_DEFAULT * scale), &v->text, err);
    if (status == SPC_OK)
        status = view_choose_draw(v, p->renderer, err);
    if (status == SPC_OK)
        status = spv_scene_create(&scene, v->draw, &v->scene, err);
    if (status == SPC_OK)
        spv_control_init(&v->control, ORIGIN, ORIGIN, p->up, p->fov_deg, v->width, v->height, NULL, NULL);
    return status;
}

/* The first camera, as the options say. */
static int place_camera(struct view *v)
{
    const struct picture_options *p = &v->o.picture;
    struct spv_pose pose = {.fov_deg = p->fov_deg};
    if (p->has_orbit)
        spv_control_orbit(&v->control, p->azimuth, p->elevation, p->distance);
    if (!p->has_eye)
        return EXIT_DONE;
    memcpy(pose.eye, p->eye, sizeof pose.eye);
    memcpy(pose.target, p->target, sizeof pose.target);
    memcpy(pose.up, p->up, sizeof pose.up);
    return spv_control_place(&v->control, &pose)
               ? EXIT_DONE : cli_usage("the camera looks along its vertical axis, or nowhere");
}

/* To a user a file that cannot be opened is a message; a script, or a screenshot, fails. */
static int open_files(struct view *v)
{
    for (int i = 0; i < v->o.file_count; i++) {
        struct spc_error err = {0};
        const enum spc_status status = view_open(v, v->o.files[i], &err);
        if (status == SPC_OK)
            continue;
        cli_error(v->o.files[i], &err, NULL);
        if (v->o.script == NULL && v->o.screenshot == NULL)
            continue;
        v->message[0] = '\0';
        return i >= SPV_SCENE_ARCHIVES_MAX ? EXIT_FAILED : cli_exit_code(status);
    }
    return place_camera(v);
}

/* A user sees it on the picture; else nobody would know that pictures lack something. */
static int tell_damage(const struct view *v)
{
    struct spc_error err = v->damage;
    if (err.status == SPC_OK && !cli_unreadable())
        return EXIT_DONE;
    const bool known = err.status != SPC_OK && v->damaged < spv_scene_count(v->scene);
    spc_fail(&err, SPC_TRUNCATED, SPC_NO_OFF, "part of it cannot be read");     /* unless it is known better */
    cli_error(known ? spv_scene_path(v->scene, v->damaged) : v->o.file_count == 1 ? v->o.files[0] : NULL, &err,
              "what can be read is drawn");
    return cli_exit_code(err.status);
}

static int run(struct view *v, const struct spv_script *script)
{
    int code = open_files(v);
    if (code == EXIT_DONE)
        code = view_log_begin(v);
    if (code != EXIT_DONE)
        return code;
    if (script != NULL)
        code = run_script(v, script);
    else if (v->o.screenshot != NULL)
        code = settle(v) ? EXIT_DONE : EXIT_FAILED;
    else
        code = run_user(v);
    if (code == EXIT_DONE && v->o.screenshot != NULL)
        code = view_save(v, v->o.screenshot);
    else if (code == EXIT_FAILED && v->message[0] != '\0')
        fprintf(stderr, "spc-view: %s\n", v->message);
    return code == EXIT_DONE && (script != NULL || v->o.screenshot != NULL) ? tell_damage(v) : code;
}

int view_session(const struct view_options *o)
{
    struct view *v = calloc(1, sizeof *v);
    struct spv_script *script = NULL;
    struct spc_error err = {0};
    const char *file = NULL;
    int code = EXIT_FAILED;
    enum spc_status status = v != NULL ? SPC_OK : spc_fail(&err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory");
    if (status == SPC_OK && o->script != NULL) {
        file = o->script;
        status = read_script(o->script, &script, &err);
    }
    if (status == SPC_OK) {
        file = NULL;
        v->o = *o;
        status = begin(v, &err);
    }
    if (status == SPC_OK)
        code = run(v, script);
    else
        cli_error(file, &err, NULL);
    if (v != NULL) {
        code = view_log_end(v, code);
        spv_scene_free(v->scene);
        spv_draw_free(v->draw);
        spv_ctx_free(v->ctx);
        spv_show_free(v->show);
        spv_window_free(v->window);
        spv_text_free(v->text);
        free(v->rgba);
        free(v->samples);
    }
    spv_script_free(script);
    free(v);
    return code;
}
