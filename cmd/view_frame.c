/* view_frame.c - a frame: drawn, labelled, shown, saved. */
#include "view.h"

#include "png_file.h"

#include <stdlib.h>

static bool room(uint8_t **buffer, size_t *max, size_t bytes)
{
    if (bytes <= *max)
        return true;
    free(*buffer);
    *buffer = malloc(bytes);
    *max = *buffer != NULL ? bytes : 0;
    return *buffer != NULL;
}

static struct spv_draw_options options_of(const struct view *v)
{
    const struct picture_options *p = &v->o.picture;
    struct spv_draw_options o = {.splat = v->splat, .paint = v->paint, .ambient = 0.2f,
                                 .no_occlusion = v->no_occlusion};
    if (!p->transparent) {
        memcpy(o.background, p->background, 3);
        o.background[3] = 255;
    }
    return o;
}

static struct spv_view view_of(const struct view *v, int samples)
{
    const struct spv_camera *camera = &v->control.camera;
    return (struct spv_view){.camera = spv_sample_camera(camera, samples),
                             .eps = spv_camera_eps(camera, v->pace.eps), .mode = v->mode,
                             .cull = !v->o.picture.no_cull};
}

/* Blocks that are seen to be missing and can be read. */
static bool lacks(const struct view *v)
{
    return v->stats.blocks_missing - v->stats.blocks_hidden > v->stats.blocks_failed;
}

/* When nothing came and nothing was asked for, there is no room for more: what is here is needed more. */
bool view_loading(const struct view *v)
{
    return lacks(v) && (v->stats.bytes_read > 0 || spv_scene_busy(v->scene) > 0);
}

bool view_finest(const struct view *v)
{
    return spv_pace_settled(&v->pace) && v->drawn_eps <= v->pace.finest;
}

bool view_settled(const struct view *v)
{
    return view_finest(v) && !view_loading(v);
}

/* Into v->rgba, or, on a card, into the back end's own picture (keep false). */
static enum spc_status draw(struct view *v, int samples, bool keep, struct spc_error *err)
{
    const struct spv_view view = view_of(v, samples);
    const struct spv_draw_options options = options_of(v);
    const size_t pixels = (size_t)v->width * (size_t)v->height, n = (size_t)samples;
    const bool into = keep || !v->draws_gl || samples > 1;
    if ((into && !room(&v->rgba, &v->rgba_max, pixels * 4)) ||
        (samples > 1 && !room(&v->samples, &v->samples_max, pixels * 4 * n * n)))
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a picture of %d x %d", v->width, v->height);
    uint8_t *to = !into ? NULL : samples > 1 ? v->samples : v->rgba;
    const enum spc_status status =
        spv_scene_frame(v->scene, &view, v->frozen ? &v->frozen_view : NULL, &options, to, &v->stats, err);
    if (status == SPC_OK && samples > 1)
        spv_sample_average(v->samples, samples, v->width, v->height, v->rgba);
    v->drawn_samples = samples;
    v->drawn_eps = v->pace.eps;
    if (!v->frozen)
        v->frozen_view = view;
    return status;
}

static void show(struct view *v, bool into)
{
    if (v->window == NULL)
        return;
    spv_show_size(v->show, v->width, v->height);
    if (!into)
        spv_gl_present(v->draw, v->o.picture.background, v->width, v->height);
    view_words(v);
    if (into)
        spv_show_picture(v->show, v->rgba, v->width, v->height, 0, 0, 0, NULL);
    spv_window_swap(v->window);
}

/* The message, on nothing. */
static void show_failure(struct view *v)
{
    const size_t bytes = (size_t)v->width * (size_t)v->height * 4;
    if (v->window == NULL || !room(&v->rgba, &v->rgba_max, bytes))
        return;
    memset(v->rgba, 0, bytes);
    v->stats = (struct spv_scene_stats){0};
    v->drawn_samples = 0;           /* words go onto this picture */
    show(v, true);
}

static bool anything_drawn(const struct view *v)
{
    return v->stats.drawn.nodes_processed > 0 || v->stats.tops > 0;
}

static void take_times(struct view *v)
{
    const double now = cli_seconds();
    struct view_times *t = &v->times;
    t->frames++;
    t->bytes += v->stats.bytes_read;
    t->frame_ms = 1e3 * (now - t->frame_began);
    t->shown_fps = t->shown_fps > 0 ? 0.8 * t->shown_fps + 200 / t->frame_ms : 1e3 / t->frame_ms;
    if (t->first_ms == 0 && anything_drawn(v)) {
        t->first_ms = 1e3 * (now - t->began);
        t->first_bytes = t->bytes;
    }
    if (t->settled_ms == 0 && anything_drawn(v) && view_finest(v) && !lacks(v)) {
        t->settled_ms = 1e3 * (now - t->began);
        t->settled_bytes = t->bytes;
    }
}

bool view_frame(struct view *v)
{
    struct spc_error err = {0};
    v->times.frame_began = cli_seconds();
    const bool still = !v->moving && !v->changed && v->smooth && view_settled(v);
    const int samples = still ? (int)v->o.samples : 1;
    const bool into = v->window == NULL || !v->draws_gl || samples > 1;
    v->changed = false;
    const enum spc_status status = draw(v, samples, into, &err);
    if (status != SPC_OK) {
        view_tell(v, NULL, &err);
        v->changed = false;         /* the next attempt is due after a while */
        show_failure(v);
        return false;
    }
    const double seconds = 1e-3 * (v->stats.draw_ms + v->stats.select_ms);
    if (v->stats.blocks_failed > 0 && v->damage.status == SPC_OK)
        v->damaged = spv_scene_fault(v->scene, &v->damage);
    spv_pace_next(&v->pace, v->o.nodes > 0 ? (double)v->stats.drawn.nodes_processed : seconds, v->moving);
    show(v, into);
    take_times(v);
    view_log_frame(v);
    return true;
}

int view_save(struct view *v, const char *path)
{
    struct spc_error err = {0};
    const int samples = v->smooth ? (int)v->o.samples : 1;
    bool archive = false;
    for (uint32_t i = 0; i < spv_scene_count(v->scene); i++)
        archive |= cli_same_file(path, spv_scene_path(v->scene, i));
    if (archive)
        spc_fail(&err, SPC_IO, SPC_NO_OFF, "an archive that is open cannot be written to");
    else if (draw(v, samples, true, &err) == SPC_OK) {
        v->times.bytes += v->stats.bytes_read;
        if (spv_png_write(path, v->rgba, v->width, v->height, v->o.picture.transparent, &err) == SPC_OK)
            return EXIT_DONE;
    }
    if (v->window != NULL && v->o.script == NULL && v->o.screenshot == NULL)
        view_tell(v, path, &err);
    else
        cli_error(path, &err, NULL);
    return EXIT_FAILED;
}
