/*
 * bench_run.c - every view, accuracy and mode once, and what each has cost.
 *
 * Blocks of a row are in memory before its clock starts; the picture is read back into plain memory, which counts.
 * One frame goes ahead unmeasured. Where the blocks do not fit the budget each frame decodes them, and says so.
 */
#include "bench_trade.h"

#include "meta.h"
#include "sample.h"
#include "scene.h"

#include <math.h>
#include <stdlib.h>

const uint8_t BENCH_BACKGROUND[3] = {0x20, 0x24, 0x28};

/* Of the time, about: a million triangles, all views. */
static struct cli_share SHARES[] = {
    {"sample", 0, 0.02}, {"read vertices", 0.02, 0.02}, {"draw reference", 0.04, 0.36}, {"traverse", 0.4, 0.02},
    {"measure", 0.42, 0.58}, {NULL, 0, 0},
};

enum spc_status bench_tell(const char *phase, uint64_t done, uint64_t total, struct spc_error *err)
{
    return cli_progress(SHARES, phase, done, total) == 0 ? SPC_OK
                                                         : spc_fail(err, SPC_CANCELLED, SPC_NO_OFF, "cancelled");
}

struct run {
    struct bench_options o;
    struct bench_result result;
    struct spv_ctx *ctx;
    struct spv_draw *draw;
    struct spv_scene *scene;
    const struct spc_header *header;
    struct spv_selection selection;
    struct bench_paths *paths;
    struct bench_truth truths[BENCH_VIEWS];
    struct bench_cut *traversal;    /* [view_count * eps_count], or NULL */
    uint8_t *rgba, *samples;        /* a picture, and what it is the mean of */
    size_t pixels;
    const char *file;               /* what an error is about */
};

static enum spc_status no_memory(struct spc_error *err)
{
    return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to measure");
}

/* ---- a row -------------------------------------------------------------------------------------- */

/* All of a model at any accuracy: nothing is left out for being out of sight. */
static struct spv_view view_of(const struct run *r, uint32_t v, enum bench_kind kind, double eps_px)
{
    static const enum spv_mode modes[BENCH_KINDS] = {
        SPV_HYBRID, SPV_POINTS, SPV_TRIANGLES, SPV_HYBRID, SPV_HYBRID, SPV_TRIANGLES, SPV_POINTS,
    };
    const struct spv_camera *c = &r->result.views[v].camera;
    const bool all = kind == BENCH_ALL_POINTS || kind == BENCH_ALL_TRIANGLES;
    return (struct spv_view){.camera = *c,
                             .eps = spv_camera_eps(c, kind == BENCH_ALL_POINTS ? 1e-9 : eps_px),
                             .mode = modes[kind], .cull = !all && !r->o.picture.no_cull};
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The mean of the samples, over the background where a pixel is covered in part. */
static void average(struct run *r)
{
    const struct picture_options *p = &r->o.picture;
    if (r->o.samples == 1)
        return;
    spv_sample_average(r->samples, (int)r->o.samples, p->width, p->height, r->rgba);
    for (size_t i = 0; i < r->pixels; i++) {
        uint8_t *at = r->rgba + 4 * i;
        for (int c = 0; c < 3 && at[3] > 0 && at[3] < 255; c++)
            at[c] = (uint8_t)((at[c] * at[3] + BENCH_BACKGROUND[c] * (255 - at[3]) + 127) / 255);
    }
}

/* ms[repeat] of frames that are drawn as given; the picture stays in rgba. */
static enum spc_status draw_frames(struct run *r, const struct spv_view *view, bool resident, double *ms,
                                   struct spv_drawn *drawn, struct spc_error *err)
{
    const struct spv_draw_options options = {.splat = r->o.picture.splat, .ambient = 0.2f};
    enum spc_status status = SPC_OK;
    for (uint32_t k = 0; k <= r->o.repeat && status == SPC_OK; k++) {
        struct spv_scene_stats stats = {0};
        const double began = cli_seconds();
        if (resident) {
            status = spv_scene_frame(r->scene, view, NULL, &options, r->samples, &stats, err);
            *drawn = stats.drawn;
        } else {
            status = spv_select(r->result.reader, view, &r->selection, err);
            if (status == SPC_OK)
                status = spv_draw_selection(r->draw, r->result.reader, view, &r->selection, &options, r->samples, drawn,
                                            err);
        }
        if (status == SPC_OK)
            average(r);
        if (k > 0)
            ms[k - 1] = 1e3 * (cli_seconds() - began);
    }
    return status;
}

/* Lengths on screen are counted in pixels; what is drawn has the view's samples. */
static enum spc_status measure_frames(struct run *r, const struct spv_view *pixels, double *value,
                                      struct spc_error *err)
{
    struct spv_view sampled = *pixels;
    const struct spv_view *view = &sampled;
    sampled.camera = spv_sample_camera(&pixels->camera, (int)r->o.samples);
    const uint32_t n = r->o.repeat;
    uint32_t missing = 1;
    struct spv_drawn drawn = {0};
    double *ms = malloc(n * sizeof *ms);
    enum spc_status status = ms != NULL ? spv_scene_load(r->scene, view, &missing, err) : no_memory(err);
    if (status == SPC_OK)
        status = draw_frames(r, view, missing == 0, ms, &drawn, err);
    if (status == SPC_OK) {
        qsort(ms, n, sizeof *ms, by_size);
        value[BENCH_FRAME_MS] = ms[(n - 1) / 2] / 2 + ms[n / 2] / 2;
        value[BENCH_FRAME_MS_MIN] = ms[0];
        value[BENCH_FRAME_MS_MAX] = ms[n - 1];
        value[BENCH_RESIDENT] = missing == 0;
        value[BENCH_NODES_TESTED] = (double)drawn.nodes_processed;
    }
    free(ms);
    return status;
}

static void put_cut(const struct bench_cut *c, double *value)
{
    value[BENCH_NODES_PROCESSED] = (double)c->processed;
    value[BENCH_NODES_DRAWN] = (double)c->nodes;
    value[BENCH_TRIANGLES_DRAWN] = (double)c->triangles;
    value[BENCH_BYTES] = (double)c->bytes;
    value[BENCH_EXACT] = (double)c->exact;
    value[BENCH_EXACT_BYTES] = c->exact_bytes;
    value[BENCH_PROCESSED_RATIO] = c->exact > 0 ? (double)c->processed / (double)c->exact : NAN;
    value[BENCH_BYTES_RATIO] = c->exact > 0 ? (double)c->bytes / c->exact_bytes : NAN;
}

static void put_distance(const struct bench_distance *d, double *value)
{
    value[BENCH_ERROR_MEAN] = d->mean;
    value[BENCH_ERROR_P999] = d->p999;
    value[BENCH_ERROR_MAX] = d->max;
    value[BENCH_ERROR_POINTS] = (double)d->points;
    value[BENCH_DOUBLES] = d->doubles;
}

static enum spc_status compare(struct run *r, uint32_t v, double *value, struct spc_error *err)
{
    struct bench_image m;
    if (r->truths[v].rgb == NULL)
        return SPC_OK;              /* none was asked for */
    if (!bench_compare(&r->truths[v], r->rgba, BENCH_BACKGROUND, &m))
        return no_memory(err);
    value[BENCH_PSNR] = m.psnr_db;
    value[BENCH_SSIM] = m.ssim;
    value[BENCH_SHADE_MEAN] = m.shade_mean;
    value[BENCH_SHADE_MAX] = m.shade_max;
    value[BENCH_OVERLAP] = m.overlap;
    value[BENCH_OVERLAP_TOLERANT] = m.overlap_tolerant;
    value[BENCH_COVERED] = (double)m.covered;
    value[BENCH_HOLES] = (double)m.holes;
    value[BENCH_OFF] = (double)m.off;
    return SPC_OK;
}

static enum spc_status measure_drawn(struct run *r, struct bench_row *row, struct spc_error *err)
{
    const bool triangles = r->header->flags & SPC_FLAG_TRIANGLES;
    const struct spv_view view = view_of(r, row->view, row->kind, row->eps_px);
    struct bench_cut cut;
    struct bench_distance distance;
    enum spc_status status = spv_select(r->result.reader, &view, &r->selection, err);
    if (status == SPC_OK)
        status = bench_cut_count(r->result.reader, &view, &r->selection, &cut, err);
    if (status == SPC_OK)
        status = measure_frames(r, &view, row->value, err);
    if (status == SPC_OK)
        status = compare(r, row->view, row->value, err);
    if (status != SPC_OK)
        return status;
    put_cut(&cut, row->value);
    if (triangles)                  /* else there is nothing to be far from */
        status = bench_paths_measure(r->paths, &view, triangles, &distance, err);
    if (status == SPC_OK && triangles && distance.missed > 0)
        status = spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "%llu leaves have nothing drawn for them",
                          (unsigned long long)distance.missed);
    if (status == SPC_OK && triangles)
        put_distance(&distance, row->value);
    return status;
}

/* What other methods would process is counted; nothing of them is drawn. */
static void count_other(struct run *r, struct bench_row *row, const struct bench_cut *cut)
{
    for (size_t i = BENCH_EXACT; i <= BENCH_BYTES_RATIO; i++)
        row->value[i] = NAN;
    row->value[BENCH_NODES_PROCESSED] = (double)cut->processed;
    row->value[BENCH_BYTES] = (double)cut->bytes;
    if (row->kind == BENCH_TRAVERSAL) {
        const double each = (double)(r->header->file_bytes - r->header->head_bytes) / (double)r->header->node_count;
        row->value[BENCH_NODES_DRAWN] = (double)cut->nodes;
        row->value[BENCH_TRIANGLES_DRAWN] = (double)cut->triangles;
        row->value[BENCH_BYTES] = round((double)cut->processed * each);
    }
}

static enum spc_status measure_row(struct run *r, struct bench_row *row, uint32_t eps, struct spc_error *err)
{
    for (size_t i = 0; i < BENCH_COLUMNS; i++)
        row->value[i] = NAN;
    if (row->kind == BENCH_TRAVERSAL) {
        count_other(r, row, &r->traversal[row->view * r->o.eps_count + eps]);
    } else if (row->kind == BENCH_ONE_CLUSTER) {
        const struct spv_view view = view_of(r, row->view, row->kind, row->eps_px);
        struct bench_cut cut;
        bench_cut_one_cluster(r->result.reader, r->paths, &view, &cut);
        count_other(r, row, &cut);
    } else {
        return measure_drawn(r, row, err);
    }
    return SPC_OK;
}

/* ---- all rows ----------------------------------------------------------------------------------- */

static enum spc_status measure_kind(struct run *r, uint32_t v, enum bench_kind kind, size_t total,
                                    struct spc_error *err)
{
    enum spc_status status = SPC_OK;
    for (uint32_t e = 0; e < r->o.eps_count && status == SPC_OK; e++) {
        struct bench_row *row = &r->result.rows[r->result.row_count];
        *row = (struct bench_row){.view = v, .kind = kind, .eps_px = r->o.eps_px[e]};
        if (e > 0 && bench_is_constant(kind))
            memcpy(row->value, row[-1].value, sizeof row->value);
        else
            status = measure_row(r, row, e, err);
        r->result.row_count++;
        if (status == SPC_OK)
            status = bench_tell("measure", r->result.row_count, total, err);
    }
    return status;
}

static enum spc_status measure_all(struct run *r, struct spc_error *err)
{
    size_t total = 0;
    for (int kind = 0; kind < BENCH_KINDS; kind++)
        total += r->o.kinds[kind] ? (size_t)r->result.view_count * r->o.eps_count : 0;
    r->result.rows = calloc(total, sizeof *r->result.rows);
    enum spc_status status = r->result.rows != NULL ? SPC_OK : no_memory(err);
    for (uint32_t v = 0; v < r->result.view_count; v++)
        for (int kind = 0; kind < BENCH_KINDS && status == SPC_OK; kind++)
            if (r->o.kinds[kind])
                status = measure_kind(r, v, (enum bench_kind)kind, total, err);
    return status;
}

/* ---- before it ---------------------------------------------------------------------------------- */

static enum spc_status choose_views(struct run *r, struct spc_error *err)
{
    struct bench_view all[BENCH_VIEWS];
    double (*points)[3] = bench_paths_points(r->paths);
    if (points == NULL)
        return no_memory(err);
    const bool made = bench_views(&r->o.picture, r->header, (const double (*)[3])points, r->paths->leaf_count, all);
    free(points);
    if (!made)
        return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "the vertical axis is none");
    for (uint32_t v = 0; v < BENCH_VIEWS; v++)
        if (r->o.views[v])
            r->result.views[r->result.view_count++] = all[v];
    return SPC_OK;
}

static enum spc_status open_archive(struct run *r, struct spc_error *err)
{
    struct picture_options *p = &r->o.picture;
    const struct spv_scene_options options = {.budget = p->memory, .threads = p->threads};
    r->pixels = (size_t)p->width * (size_t)p->height;
    const size_t n = r->o.samples;
    r->rgba = malloc(r->pixels * 4);
    r->samples = n == 1 ? r->rgba : malloc(r->pixels * 4 * n * n);
    r->paths = calloc(1, sizeof *r->paths);
    const bool room = r->rgba != NULL && r->samples != NULL && r->paths != NULL;
    enum spc_status status = room ? picture_renderer(p, &r->ctx, &r->draw, err) : no_memory(err);
    if (status == SPC_OK)
        status = spv_scene_create(&options, r->draw, &r->scene, err);
    if (status == SPC_OK)
        status = spv_scene_open(r->scene, r->o.archive, err);
    if (status != SPC_OK)
        return status;
    r->result.reader = spv_scene_reader(r->scene, 0);
    r->result.renderer = spv_draw_name(r->draw);
    r->header = spc_reader_header(r->result.reader);
    picture_take_up(r->result.reader, p);
    for (int kind = 0; kind < BENCH_KINDS && !(r->header->flags & SPC_FLAG_TRIANGLES); kind++)
        r->o.kinds[kind] = r->o.kinds[kind] && kind != BENCH_TRIANGLES && kind != BENCH_ALL_TRIANGLES;
    bool any = false;
    for (int kind = 0; kind < BENCH_KINDS; kind++)
        any |= r->o.kinds[kind];
    if (!any)
        return spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "it holds points only, no triangles");
    return bench_paths_read(r->result.reader, r->paths, err);
}

/* A speed alone needs no reference. */
static bool needs_reference(const struct bench_options *o)
{
    return o->out != NULL || o->error_px > 0 || o->shade > 0;
}

static enum spc_status run_all(struct run *r, struct spc_error *err)
{
    enum spc_status status = open_archive(r, err);
    if (status == SPC_OK)
        status = choose_views(r, err);
    if (status == SPC_OK && needs_reference(&r->o))
        status = bench_reference(&r->o, r->result.reader, r->result.views, r->result.view_count, r->truths, &r->file,
                                 err);
    if (status != SPC_OK)
        return status;
    r->file = NULL;
    if (r->o.kinds[BENCH_TRAVERSAL]) {
        r->traversal = calloc((size_t)r->result.view_count * r->o.eps_count, sizeof *r->traversal);
        if (r->traversal == NULL)
            return no_memory(err);
        status = bench_cut_traversal(r->result.reader, r->result.views, r->result.view_count, r->o.eps_px,
                                     r->o.eps_count, r->traversal, err);
    }
    return status == SPC_OK ? measure_all(r, err) : status;
}

/* ---- the end ------------------------------------------------------------------------------------ */

static const char *remedy_of(const struct run *r, const struct spc_error *err)
{
    if (err->status == SPC_INPUT_BAD)
        return "--reference takes the scan that the archive was built from, several times if there were more";
    if (err->status == SPC_INPUT_EMPTY)
        return r->o.scan_count > 0 ? "clouds of points have no surface to compare with"
                                   : "name the scan with --reference";
    if (err->status == SPC_NO_MEMORY)
        return "a smaller --size needs less";
    return NULL;
}

static int failed(const struct run *r, const struct spc_error *err)
{
    const char *file = r->file != NULL ? r->file : r->o.archive;
    cli_error(file, err, remedy_of(r, err));
    return file == r->o.archive ? cli_exit_code(err->status) : EXIT_FAILED;
}

static void release(struct run *r)
{
    for (uint32_t v = 0; v < BENCH_VIEWS; v++)
        bench_truth_release(&r->truths[v]);
    if (r->paths != NULL)
        bench_paths_release(r->paths);
    free(r->paths);
    free(r->traversal);
    free(r->result.rows);
    if (r->samples != r->rgba)
        free(r->samples);
    free(r->rgba);
    spv_selection_release(&r->selection);
    spv_scene_free(r->scene);
    spv_draw_free(r->draw);
    spv_ctx_free(r->ctx);
}

int bench_run(const struct bench_options *options)
{
    struct spc_error err = {0};
    struct run *r = calloc(1, sizeof *r);
    if (r == NULL) {
        spc_fail(&err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to measure");
        cli_error(options->archive, &err, NULL);
        return EXIT_FAILED;
    }
    r->o = *options;
    r->result.options = &r->o;
    r->result.own = options->scan_count == 0;
    bool made = false;
    int code = options->out != NULL ? bench_report_begin(&r->o, &made) : EXIT_DONE;
    if (code == EXIT_DONE) {
        cli_progress_begin(options->progress, options->archive, 0, 0);
        const enum spc_status status = run_all(r, &err);
        cli_progress_result(&err);
        code = status == SPC_OK ? bench_report(&r->result) : failed(r, &err);
    }
    if (code != EXIT_DONE && made)
        bench_report_undo(&r->o);
    release(r);
    free(r);
    return code;
}
