/*
 * render_pictures.c - pictures of one archive into files.
 *
 * A single picture decodes blocks as it draws them. Of several, blocks stay in memory from one to the next as
 * far as the budget goes; a picture that needs more than that is drawn like a single one.
 */
#include "render_pictures.h"

#include "count.h"
#include "png_file.h"
#include "scene.h"
#include "whole_file.h"

#include <errno.h>
#include <jansson.h>
#include <stdlib.h>
#include <string.h>

struct session {
    struct render_options o;
    struct spv_ctx *ctx;
    struct spv_draw *draw;
    struct spv_scene *scene;
    struct spv_selection selection;
    struct spv_drawn drawn;
    uint8_t *samples;               /* of one picture */
    uint8_t *rgba;                  /* what is written */
    json_t *stats;                  /* list of pictures, or NULL */
    double open_ms;
};

/* ---- statistics --------------------------------------------------------------------------------- */

/* read: bytes of blocks */
static enum spc_status add_stats(struct session *s, const struct spv_view *view, double frame_ms, uint64_t read,
                                 struct spc_error *err)
{
    const struct spv_selection *sel = &s->selection;
    struct spv_count count;
    const enum spc_status status = spv_count(spv_scene_reader(s->scene, 0), view, sel, &count, err);
    if (status != SPC_OK)
        return status;
    if (json_array_size(s->stats) == 0)         /* the head is read once */
        read += spc_reader_header(spv_scene_reader(s->scene, 0))->head_bytes;
    json_t *one = json_pack(
        "{s:I, s:I, s:I, s:I, s:I, s:{s:I, s:I, s:I, s:I}, s:I, s:f, s:f, s:I, s:s}",
        "nodes_drawn", (json_int_t)count.nodes_drawn, "nodes_processed", (json_int_t)count.nodes_processed,
        "triangles_drawn", (json_int_t)count.triangles_drawn, "clusters_total", (json_int_t)sel->clusters_total,
        "clusters_drawn", (json_int_t)sel->clusters_drawn, "culled", "frustum", (json_int_t)sel->culled_frustum,
        "backface", (json_int_t)sel->culled_backface, "range", (json_int_t)sel->culled_range, "occlusion",
        (json_int_t)s->drawn.clusters_hidden, "bytes_read", (json_int_t)read, "frame_ms", frame_ms,
        "open_ms", s->open_ms, "fallback_splats", (json_int_t)0, "renderer", spv_draw_name(s->draw));
    if (one == NULL || json_array_append_new(s->stats, one) != 0)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for the statistics");
    return SPC_OK;
}

/* One picture: its object; several: an object with their list. */
static enum spc_status write_stats(const struct session *s, struct spc_error *err)
{
    static const char what[] = "the statistics";
    const bool one = s->o.frames == 0 && !s->o.six_views;
    struct spv_whole_file file;
    enum spc_status status = spv_whole_begin(&file, s->o.stats, what, err);
    if (status != SPC_OK)
        return status;
    json_t *out = one ? json_incref(json_array_get(s->stats, 0)) : json_pack("{s:O}", "pictures", s->stats);
    if (out == NULL)
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for %s", what);
    else if (json_dumpf(out, file.out, JSON_INDENT(2)) != 0)
        status = spc_fail_os(err, errno != 0 ? errno : EIO, "cannot write %s", what);
    json_decref(out);
    return spv_whole_end(&file, status, what, err);
}

/* ---- a picture ---------------------------------------------------------------------------------- */

/* From memory, if there is room for all that the view needs. */
static enum spc_status draw_kept(struct session *s, const struct spv_view *view,
                                 const struct spv_draw_options *options, bool *drawn, struct spc_error *err)
{
    struct spv_scene_stats stats;
    uint32_t missing = 1;
    *drawn = false;
    enum spc_status status = spv_scene_load(s->scene, view, &missing, err);
    if (status != SPC_OK || missing > 0)
        return status;
    *drawn = true;
    status = spv_scene_frame(s->scene, view, NULL, options, s->samples, &stats, err);
    s->drawn = stats.drawn;
    return status;
}

static void put_background(const struct picture_options *o, uint8_t *rgba, size_t pixels)
{
    for (size_t i = 0; i < pixels && !o->transparent; i++) {
        uint8_t *p = rgba + 4 * i;
        for (int c = 0; c < 3 && p[3] < 255; c++)
            p[c] = (uint8_t)((p[c] * p[3] + o->background[c] * (255 - p[3]) + 127) / 255);
        p[3] = 255;
    }
}

/* Draws into rgba[height][width][4]. */
static enum spc_status draw(struct session *s, const struct spv_camera *camera, uint8_t *rgba, struct spc_error *err)
{
    const struct picture_options *p = &s->o.picture;
    const struct spc_reader *reader = spv_scene_reader(s->scene, 0);
    const struct spv_draw_options options = {.splat = p->splat, .ambient = 0.2f};
    const struct spv_view view = {.camera = spv_sample_camera(camera, (int)s->o.samples),
                                  .eps = spv_camera_eps(camera, p->eps_px), .mode = p->mode, .cull = !p->no_cull};
    const double began = cli_seconds();
    uint64_t read = spv_scene_bytes_read(s->scene);
    bool drawn = false;
    enum spc_status status = spv_select(reader, &view, &s->selection, err);
    if (status == SPC_OK && (s->o.frames > 1 || s->o.six_views))
        status = draw_kept(s, &view, &options, &drawn, err);
    if (status == SPC_OK && !drawn)
        status = spv_draw_selection(s->draw, reader, &view, &s->selection, &options, s->samples, &s->drawn, err);
    if (status != SPC_OK)
        return status;
    spv_sample_average(s->samples, (int)s->o.samples, camera->width, camera->height, rgba);
    put_background(p, rgba, (size_t)camera->width * (size_t)camera->height);
    const double frame_ms = 1e3 * (cli_seconds() - began);
    read = spv_scene_bytes_read(s->scene) - read + (drawn ? 0 : s->selection.bytes);
    return s->stats != NULL ? add_stats(s, &view, frame_ms, read, err) : SPC_OK;
}

/* ---- which pictures ----------------------------------------------------------------------------- */

static int bad_camera(void)
{
    return cli_usage("the camera looks along its vertical axis, or nowhere");
}

static int failed(const char *file, const struct spc_error *err)
{
    cli_error(file, err, NULL);
    return cli_exit_code(err->status);
}

static bool make_camera(const struct session *s, const struct picture_options *p, struct spv_camera *camera)
{
    const struct spc_header *h = spc_reader_header(spv_scene_reader(s->scene, 0));
    return picture_camera(p, h->box_min, h->box_max, camera);
}

static int write_png(const struct session *s, const char *file, const uint8_t *rgba, int width, int height)
{
    struct spc_error err = {0};
    if (spv_png_write(file, rgba, width, height, s->o.picture.transparent, &err) == SPC_OK)
        return EXIT_DONE;
    cli_error(file, &err, NULL);
    return EXIT_FAILED;
}

static int render_one(struct session *s, const struct picture_options *p, const char *file)
{
    struct spv_camera camera;
    struct spc_error err = {0};
    if (!make_camera(s, p, &camera))
        return bad_camera();
    if (draw(s, &camera, s->rgba, &err) != SPC_OK)
        return failed(s->o.archive, &err);
    return write_png(s, file, s->rgba, p->width, p->height);
}

/* OUT.png, 7 -> OUT0007.png; NULL: no memory. To be freed. */
static char *frame_name(const char *out, uint32_t frame)
{
    const char *slash = strrchr(out, '/'), *dot = strrchr(out, '.');
    const size_t stem = dot != NULL && dot > (slash ? slash + 1 : out) ? (size_t)(dot - out) : strlen(out);
    const size_t size = strlen(out) + 16;
    char *name = malloc(size);
    if (name != NULL)
        snprintf(name, size, "%.*s%04u%s", (int)stem, out, frame, out + stem);
    return name;
}

static int render_frames(struct session *s)
{
    int code = EXIT_DONE;
    for (uint32_t k = 0; k < s->o.frames && code == EXIT_DONE; k++) {
        cli_progress(NULL, "draw pictures", k, s->o.frames);
        struct picture_options p = s->o.picture;
        char *name = frame_name(s->o.out, k + 1);
        p.azimuth += s->o.turn_deg * k / s->o.frames;
        if (name == NULL) {
            const struct spc_error err = {.status = SPC_NO_MEMORY, .what = "no memory for a name"};
            code = failed(s->o.archive, &err);
        } else if (cli_same_file(s->o.archive, name)) {
            code = cli_usage("the archive itself cannot be written to: '%s'", name);
        } else if (s->o.stats != NULL && cli_same_output(s->o.stats, name)) {
            code = cli_usage("a picture and --stats are the same file: '%s'", name);
        } else {
            code = render_one(s, &p, name);
        }
        free(name);
    }
    return code;
}

static int render_six(struct session *s)
{
    static const double VIEWS[6][2] = {{0, 0}, {90, 0}, {180, 0}, {270, 0}, {0, 90}, {0, -90}};
    enum { COLUMNS = 3 };
    const struct picture_options *o = &s->o.picture;
    const size_t row = (size_t)o->width * 4, wide = row * COLUMNS;
    struct spc_error err = {0};
    uint8_t *sheet = malloc(wide * (size_t)o->height * (6 / COLUMNS));
    int code = EXIT_DONE;
    if (sheet == NULL) {
        spc_fail(&err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for six pictures of %d x %d", o->width, o->height);
        return failed(s->o.archive, &err);
    }
    for (int v = 0; v < 6 && code == EXIT_DONE; v++) {
        cli_progress(NULL, "draw views", (uint64_t)v, 6);
        struct picture_options p = *o;
        struct spv_camera camera;
        p.azimuth += VIEWS[v][0];
        p.elevation = VIEWS[v][1] != 0 ? VIEWS[v][1] : p.elevation;
        uint8_t *at = sheet + (size_t)(v / COLUMNS) * wide * (size_t)o->height + (size_t)(v % COLUMNS) * row;
        if (!make_camera(s, &p, &camera))
            code = bad_camera();
        else if (draw(s, &camera, s->rgba, &err) != SPC_OK)
            code = failed(s->o.archive, &err);
        for (int y = 0; y < o->height && code == EXIT_DONE; y++)
            memcpy(at + (size_t)y * wide, s->rgba + (size_t)y * row, row);
    }
    if (code == EXIT_DONE)
        code = write_png(s, s->o.out, sheet, o->width * COLUMNS, o->height * (6 / COLUMNS));
    free(sheet);
    return code;
}

/* ---- session ------------------------------------------------------------------------------------ */

static enum spc_status begin(struct session *s, struct spc_error *err)
{
    const struct picture_options *p = &s->o.picture;
    const size_t pixels = (size_t)p->width * (size_t)p->height, n = s->o.samples;
    const struct spv_scene_options options = {.budget = p->memory, .threads = p->threads};
    s->rgba = malloc(pixels * 4);
    s->samples = n == 1 ? s->rgba : malloc(pixels * n * n * 4);
    if (s->rgba == NULL || s->samples == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a picture of %d x %d: %zu MB", p->width,
                        p->height, (pixels * (n == 1 ? 1 : n * n + 1)) >> 18);
    s->stats = s->o.stats != NULL ? json_array() : NULL;
    enum spc_status status = picture_renderer(p, &s->ctx, &s->draw, err);
    if (status == SPC_OK)
        status = spv_scene_create(&options, s->draw, &s->scene, err);
    const double began = cli_seconds();
    if (status == SPC_OK)
        status = spv_scene_open(s->scene, s->o.archive, err);
    s->open_ms = 1e3 * (cli_seconds() - began);
    if (status != SPC_OK)
        return status;
    const struct spc_reader *reader = spv_scene_reader(s->scene, 0);
    picture_take_up(reader, &s->o.picture);
    if (p->mode == SPV_TRIANGLES && !(spc_reader_header(reader)->flags & SPC_FLAG_TRIANGLES))
        status = spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "it holds points only, no triangles");
    return status;
}

int render(const struct render_options *o)
{
    struct session s = {.o = *o};
    struct spc_error err = {0};
    int code;
    cli_progress_begin(CLI_PROGRESS_AUTO, o->archive, 0, 0);
    if (begin(&s, &err) != SPC_OK)
        code = failed(o->archive, &err);
    else
        code = o->six_views ? render_six(&s) : o->frames > 0 ? render_frames(&s)
                                                             : render_one(&s, &s.o.picture, o->out);
    cli_progress_end();
    if (code == EXIT_DONE && o->stats != NULL && write_stats(&s, &err) != SPC_OK) {
        cli_error(o->stats, &err, NULL);
        code = EXIT_FAILED;
    }
    spv_selection_release(&s.selection);
    spv_scene_free(s.scene);
    spv_draw_free(s.draw);
    spv_ctx_free(s.ctx);
    json_decref(s.stats);
    if (s.samples != s.rgba)
        free(s.samples);
    free(s.rgba);
    return code;
}
