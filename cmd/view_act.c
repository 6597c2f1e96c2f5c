/* view_act.c - what events ask for. */
#include "view.h"

#include <math.h>
#include <stdlib.h>
#include <unistd.h>

enum { SCREENSHOTS_MAX = 1000000 };
static const double EPS_STEP = 1.41421356237309515, EPS_MIN = 1.0 / 64, EPS_MAX = 256;

/* ---- archives ----------------------------------------------------------------------------------- */

static bool depth_at(void *ctx, const struct spv_camera *camera, double x, double y, double *depth)
{
    struct view *v = ctx;
    (void)camera;                   /* the picture is of a moment ago; so is what was pointed at */
    return spv_draw_depth(v->draw, (int)floor(x * v->drawn_samples), (int)floor(y * v->drawn_samples), depth);
}

/* Frames archive i, or all of them: i the count. */
static void frame_scene(struct view *v, uint32_t i, bool first)
{
    double low[3] = {0, 0, 0}, high[3] = {0, 0, 0};
    const double *up = v->o.picture.up;
    if (i < spv_scene_count(v->scene)) {
        const struct spc_header *h = spc_reader_header(spv_scene_reader(v->scene, i));
        memcpy(low, h->box_min, sizeof low);
        memcpy(high, h->box_max, sizeof high);
    } else {
        spv_scene_box(v->scene, low, high);
    }
    if (spv_scene_count(v->scene) == 0)
        memset(low, 0, sizeof low), memset(high, 0, sizeof high);
    if (first)
        spv_control_init(&v->control, low, high, up, v->o.picture.fov_deg, v->width, v->height, depth_at, v);
    else
        spv_control_scene(&v->control, low, high, up);
    v->changed = true;
}

enum spc_status view_open(struct view *v, const char *path, struct spc_error *err)
{
    const enum spc_status status = spv_scene_open(v->scene, path, err);
    if (status != SPC_OK) {
        view_tell(v, path, err);
        return status;
    }
    const uint32_t count = spv_scene_count(v->scene);
    const struct spc_header *h = spc_reader_header(spv_scene_reader(v->scene, count - 1));
    v->times.bytes += h->head_bytes;
    if (count == 1)
        picture_take_up(spv_scene_reader(v->scene, 0), &v->o.picture);
    frame_scene(v, count, false);
    v->next_fit = 0;
    if (v->window != NULL && count == 1) {
        char title[300];
        const char *base = strrchr(path, '/');
        snprintf(title, sizeof title, "%s - spc-view", base != NULL ? base + 1 : path);
        spv_window_title(v->window, title);
    }
    return SPC_OK;
}

void view_resize(struct view *v, int width, int height)
{
    v->width = width;
    v->height = height;
    v->changed = true;
}

/* ---- back ends ---------------------------------------------------------------------------------- */

/* On the window's context; without window as spc-render does. */
static enum spc_status make_draw(struct view *v, enum picture_renderer renderer, struct spv_ctx **ctx,
                                 struct spv_draw **draw, struct spc_error *err)
{
    struct picture_options o = v->o.picture;
    *ctx = NULL;
    *draw = NULL;
    o.renderer = renderer;
    if (v->window == NULL)
        return picture_renderer(&o, ctx, draw, err);
    if (renderer == PICTURE_AUTO && !spv_ctx_is_software(spv_window_ctx(v->window)))
        renderer = PICTURE_GL;
    if (renderer == PICTURE_GL)
        return spv_gl_create(spv_window_ctx(v->window), draw, err);
    return spv_soft_create(o.threads, draw, err);
}

enum spc_status view_choose_draw(struct view *v, enum picture_renderer renderer, struct spc_error *err)
{
    struct spv_ctx *ctx;
    struct spv_draw *draw;
    enum spc_status status = make_draw(v, renderer, &ctx, &draw, err);
    if (status == SPC_OK && v->scene != NULL)
        status = spv_scene_use(v->scene, draw, err);
    if (status != SPC_OK) {
        spv_draw_free(draw);
        spv_ctx_free(ctx);
        return status;
    }
    spv_draw_free(v->draw);
    spv_ctx_free(v->ctx);
    v->draw = draw;
    v->ctx = ctx;
    v->draws_gl = strstr(spv_draw_name(draw), "OpenGL") != NULL;
    v->changed = true;
    return SPC_OK;
}

static void switch_draw(struct view *v)
{
    struct spc_error err = {0};
    if (view_choose_draw(v, v->draws_gl ? PICTURE_SOFT : PICTURE_GL, &err) == SPC_OK)
        view_say(v, "%s", spv_draw_name(v->draw));
    else
        view_say(v, "%s", err.what);
}

/* ---- actions ------------------------------------------------------------------------------------ */

static void scale_eps(struct view *v, double factor)
{
    /* An eps beyond these was asked for: a key comes back from there, and goes no further. */
    const double low = fmin(EPS_MIN, v->pace.finest), high = fmax(EPS_MAX, v->pace.finest);
    const double eps = fmin(fmax(v->pace.finest * factor, low), high);
    spv_pace_set(&v->pace, eps, v->pace.target);
    view_say(v, "eps %.3g px", eps);
}

static void next_mode(struct view *v)
{
    static const char *const names[] = {"points far away, triangles near", "points alone", "triangles alone"};
    v->mode = (enum spv_mode)((v->mode + 1) % 3);
    view_say(v, "%s", names[v->mode]);
}

static void next_paint(struct view *v)
{
    static const char *const names[SPV_PAINT_COUNT] = {"the scan's colours", "a colour a cluster",
                                                       "a colour a level of the hierarchy",
                                                       "a colour a normal cluster", "points orange, triangles blue"};
    v->paint = (enum spv_paint)((v->paint + 1) % SPV_PAINT_COUNT);
    view_say(v, "%s", names[v->paint]);
}

static void screenshot(struct view *v)
{
    char path[64];
    do                              /* none is written over */
        snprintf(path, sizeof path, "spc-view-%03u.png", ++v->screenshots);
    while (access(path, F_OK) == 0 && v->screenshots < SCREENSHOTS_MAX);
    if (v->screenshots == SCREENSHOTS_MAX)
        view_say(v, "there are too many pictures in this folder");
    else if (view_save(v, path) == EXIT_DONE)
        view_say(v, "saved as %s", path);
}

static void copy_camera(struct view *v)
{
    char text[SPV_CONTROL_TEXT];
    if (v->window == NULL || !spv_control_format(&v->control, text, sizeof text))
        return;
    spv_window_set_clipboard(v->window, text);
    view_say(v, "camera copied: spc-render %s", text);
}

static void paste_camera(struct view *v, const char *text)
{
    if (text == NULL || !spv_control_parse(&v->control, text))
        view_say(v, "the clipboard holds no camera (--eye X,Y,Z --target X,Y,Z --up X,Y,Z --fov DEG)");
    v->changed = true;
}

static void back(struct view *v)
{
    if (v->help)
        v->help = false;
    else if (v->message[0] != '\0' && spv_scene_count(v->scene) > 0)
        v->message[0] = '\0';
    else
        v->quit = true;
    v->changed = true;
}

static void freeze(struct view *v)
{
    v->frozen = !v->frozen;
    view_say(v, v->frozen ? "what is drawn is frozen: look around it" : "no longer frozen");
}

static void toggle(struct view *v, bool *what, const char *on, const char *off)
{
    *what = !*what;
    view_say(v, "%s", *what ? on : off);
}

static void next_archive(struct view *v)
{
    const uint32_t count = spv_scene_count(v->scene);
    frame_scene(v, v->next_fit, false);
    if (v->next_fit < count)
        view_say(v, "%s", spv_scene_path(v->scene, v->next_fit));
    v->next_fit = v->next_fit >= count ? 0 : v->next_fit + 1;
}

void view_action(struct view *v, enum spv_action action)
{
    switch (action) {
    case SPV_ACTION_BACK: back(v); break;
    case SPV_ACTION_QUIT: v->quit = true; break;
    case SPV_ACTION_HELP: v->help = !v->help; break;
    case SPV_ACTION_STATISTICS: v->statistics = !v->statistics; break;
    case SPV_ACTION_FINER: scale_eps(v, 1 / EPS_STEP); break;
    case SPV_ACTION_COARSER: scale_eps(v, EPS_STEP); break;
    case SPV_ACTION_MODE: next_mode(v); break;
    case SPV_ACTION_PAINT: next_paint(v); break;
    case SPV_ACTION_FREEZE: freeze(v); break;
    case SPV_ACTION_OCCLUSION: toggle(v, &v->no_occlusion, "what is hidden is drawn", "hidden: left out"); break;
    case SPV_ACTION_ANTIALIAS: toggle(v, &v->smooth, "smooth when still", "one sample a pixel"); break;
    case SPV_ACTION_RENDERER: switch_draw(v); break;
    case SPV_ACTION_SCREENSHOT: screenshot(v); break;
    case SPV_ACTION_COPY: copy_camera(v); break;
    case SPV_ACTION_PASTE: paste_camera(v, v->window != NULL ? spv_window_clipboard(v->window) : NULL); break;
    case SPV_ACTION_NEXT: next_archive(v); break;
    case SPV_ACTION_SPLAT:
        v->splat = v->splat == SPV_SPLAT_EXACT ? SPV_SPLAT_FAST : SPV_SPLAT_EXACT;
        view_say(v, v->splat == SPV_SPLAT_EXACT ? "exact splats" : "fast splats");
        break;
    case SPV_ACTION_FULLSCREEN:
        if (v->window != NULL)
            spv_window_toggle_full_screen(v->window);
        break;
    default:
        return;
    }
    v->changed = true;
}

void view_event(struct view *v, const struct spv_event *event)
{
    struct spc_error err = {0};
    if (event->kind == SPV_EVENT_DROP) {
        v->message[0] = '\0';
        view_open(v, event->path, &err);
        return;
    }
    if (event->kind == SPV_EVENT_PASTE) {
        paste_camera(v, event->path);
        return;
    }
    if (event->kind == SPV_EVENT_CLOSE)
        v->quit = true;
    if (event->kind == SPV_EVENT_RESIZE)
        view_resize(v, event->width, event->height);
    view_action(v, spv_control_event(&v->control, event));
}
