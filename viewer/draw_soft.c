/*
 * draw_soft.c - the back end without GL: blocks to threads, framebuffer to picture.
 *
 * A block is decoded, tested and drawn by one thread, straight out of that thread's buffer; all
 * threads draw into one framebuffer, whose pixels only ever grow (soft_int.h). Blocks near the eye
 * come first: what they hide costs little afterwards. Pictures of more than BAND_PX pixels are drawn
 * in bands, for the framebuffer's memory; each decodes what reaches into it.
 */
#include "soft_int.h"

#include "bytes.h"
#include "threads.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define BAND_PX ((size_t)1 << 26)
enum { JOB_PX = 1 << 16 };          /* what a thread clears or writes out at a time */

struct spv_soft {
    struct spv_threads *threads;
    struct soft_scratch **scratch;  /* one a thread */
    struct worker *workers;
    struct soft_frame frame;
    size_t words_max;
    bool wide;
};

struct worker {                     /* one a thread */
    uint8_t *payload;               /* decoded block */
    size_t payload_max;
    struct spc_error err;           /* of the first block by order that failed here */
    size_t failed;
};

enum spc_status spv_soft_create(unsigned threads, struct spv_soft **out, struct spc_error *err)
{
    *out = NULL;
    struct spv_soft *soft = calloc(1, sizeof *soft);
    if (soft != NULL)
        soft->threads = spv_threads_create(threads);
    if (soft != NULL && soft->threads != NULL) {
        const unsigned n = spv_threads_count(soft->threads);
        bool whole = true;
        soft->scratch = calloc(n, sizeof *soft->scratch);
        soft->workers = calloc(n, sizeof *soft->workers);
        for (unsigned t = 0; t < n && soft->scratch != NULL; t++)
            whole &= (soft->scratch[t] = calloc(1, sizeof **soft->scratch)) != NULL;
        if (whole && soft->scratch != NULL && soft->workers != NULL) {
            soft->wide = spv_wide_here();
            *out = soft;
            return SPC_OK;
        }
    }
    spv_soft_free(soft);
    return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for the renderer");
}

void spv_soft_free(struct spv_soft *soft)
{
    if (soft == NULL)
        return;
    const unsigned n = soft->threads ? spv_threads_count(soft->threads) : 0;
    for (unsigned t = 0; t < n; t++) {
        if (soft->scratch != NULL && soft->scratch[t] != NULL)
            free(soft->scratch[t]->vertices);
        if (soft->scratch != NULL)
            free(soft->scratch[t]);
        if (soft->workers != NULL)
            free(soft->workers[t].payload);
    }
    spv_threads_free(soft->threads);
    free(soft->scratch);
    free(soft->workers);
    free(soft->frame.words);
    free(soft);
}

const char *spv_soft_name(const struct spv_soft *soft)
{
    return soft->wide ? "soft, 256-bit vectors" : "soft";
}

void spv_soft_narrow(struct spv_soft *soft)
{
    soft->wide = false;
}

unsigned spv_soft_threads(const struct spv_soft *soft)
{
    return spv_threads_count(soft->threads);
}

void spv_soft_drawn(const struct spv_soft *soft, uint64_t *nodes, uint64_t *triangles)
{
    *nodes = *triangles = 0;
    for (unsigned t = 0; t < spv_soft_threads(soft); t++) {
        *nodes += soft->scratch[t]->points;
        *triangles += soft->scratch[t]->triangles;
    }
}

/* ---- framebuffer ------------------------------------------------------------------------------- */

static size_t tile_px(const struct soft_frame *f)
{
    return (size_t)f->tile.width * (size_t)f->tile.height;
}

static bool clear(void *ctx, unsigned worker, size_t i)
{
    const struct soft_frame *f = ctx;
    const size_t first = i * JOB_PX, left = tile_px(f) - first;
    (void)worker;
    memset((void *)(f->words + first), 0, (left < JOB_PX ? left : JOB_PX) * sizeof *f->words);
    return true;
}

static void take_camera(struct soft_frame *f, const struct spv_camera *c)
{
    for (int a = 0; a < 3; a++) {
        f->axes[0][a] = c->right[a];
        f->axes[1][a] = -c->up[a];
        f->axes[2][a] = c->forward[a];
        f->eye[a] = ldexp(c->eye[a], -f->header->unit_exp);
    }
    f->focal = c->focal_px;
    f->center[0] = c->width / 2.0 - f->tile.x0;
    f->center[1] = c->height / 2.0 - f->tile.y0;
    f->flat_px = (float)(c->focal_px / 256);        /* light changes by less than half of 1/255 */
}

enum spc_status spv_soft_begin(struct spv_soft *soft, const struct spc_reader *reader,
                               const struct spv_view *view, const struct spv_draw_options *options,
                               const struct spv_tile *tile, struct spc_error *err)
{
    struct soft_frame *f = &soft->frame;
    _Atomic uint64_t *words = f->words;
    const size_t n = (size_t)tile->width * (size_t)tile->height;
    if (n > soft->words_max) {
        free(words);
        f->words = NULL;
        soft->words_max = 0;
        words = n > SIZE_MAX / sizeof *words ? NULL : aligned_alloc(64, align_up(n * sizeof *words, 64));
        if (words == NULL)
            return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to draw %d x %d pixels: %zu MB",
                            tile->width, tile->height, n / (((size_t)1 << 20) / sizeof *words));
        soft->words_max = n;
    }
    *f = (struct soft_frame){.reader = reader, .header = spc_reader_header(reader), .view = view,
                             .splat = options->splat, .ambient = options->ambient, .tile = *tile,
                             .words = words, .alone = spv_soft_threads(soft) == 1,
                             .wide = soft->wide};
    take_camera(f, &view->camera);
    for (unsigned t = 0; t < spv_soft_threads(soft); t++)
        soft->scratch[t]->points = soft->scratch[t]->triangles = 0;
    spv_threads_run(soft->threads, (n + JOB_PX - 1) / JOB_PX, clear, f);
    return SPC_OK;
}

struct resolve {
    const struct soft_frame *frame;
    uint8_t *rgba;
};

static bool resolve_row(void *ctx, unsigned worker, size_t y)
{
    const struct resolve *r = ctx;
    const struct soft_frame *f = r->frame;
    const size_t width = (size_t)f->tile.width;
    const _Atomic uint64_t *from = f->words + y * width;
    uint8_t *to = r->rgba + 4 * (((size_t)f->tile.y0 + y) * (size_t)f->view->camera.width +
                                 (size_t)f->tile.x0);
    (void)worker;
    for (size_t x = 0; x < width; x++)
        store_u32(to + 4 * x, (uint32_t)atomic_load_explicit(&from[x], memory_order_relaxed));
    return true;
}

void spv_soft_end(struct spv_soft *soft, uint8_t *rgba)
{
    struct resolve r = {.frame = &soft->frame, .rgba = rgba};
    spv_threads_run(soft->threads, (size_t)soft->frame.tile.height, resolve_row, &r);
}

/* ---- blocks ------------------------------------------------------------------------------------ */

struct draw {
    struct spv_soft *soft;
    const struct spv_soft_source *source;
    const uint32_t *blocks;
};

/* May something in the box be seen in the tile? Only asked where the tile is not the picture. */
static bool reaches_tile(const struct soft_frame *f, const struct spc_cluster *c, const double eye[3])
{
    const double pad = 0.4143 * (double)c->radius_max;      /* of a cylinder out of its ball */
    const double edges[4] = {-1, f->tile.width + 1, -1, f->tile.height + 1};        /* px */
    for (int p = 0; p < 4; p++) {
        double far = 0, scale = 0;
        for (int a = 0; a < 3; a++) {
            const double slope = (edges[p] - f->center[p / 2]) / f->focal;
            const double n = (p % 2 ? -1 : 1) * (f->axes[p / 2][a] - slope * f->axes[2][a]);
            const double at = (n > 0 ? (double)c->box[a + 3] + pad : (double)c->box[a] - pad) - eye[a];
            far += n * at;
            scale += fabs(n * at);
        }
        if (far < -1e-6 * scale)
            return false;
    }
    return true;
}

static bool draw_decoded(const struct soft_block *b, struct soft_scratch *s, struct spc_error *err)
{
    const struct soft_frame *f = b->frame;
    const bool triangles = b->l.indices && f->view->mode != SPV_POINTS;
    struct spv_ranges ranges;
    spv_visible_ranges(f->reader, f->view, &b->b, &b->c, b->eye, b->payload + b->l.groups, &ranges);
    if (triangles && ranges.count > 0 && !spv_soft_project(b, s)) {
        spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to draw a block");
        return false;
    }
    for (uint32_t r = 0; r < ranges.count; r++) {
        const uint32_t first = (uint32_t)ranges.first[r], n = (uint32_t)ranges.nodes[r];
        if (triangles)
            spv_soft_triangles(b, s, first, n);
        if (f->view->mode != SPV_TRIANGLES)
            spv_soft_points(b, s, first, n);
    }
    return true;
}

static bool draw_block(void *ctx, unsigned worker, size_t i)
{
    const struct draw *d = ctx;
    const struct soft_frame *f = &d->soft->frame;
    struct worker *w = &d->soft->workers[worker];
    struct soft_block b = {.frame = f};
    spc_reader_block(f->reader, d->blocks[i], &b.b);
    spc_reader_cluster(f->reader, b.b.cluster, &b.c);
    spv_eye_of_cluster(f->reader, &b.c, &f->view->camera, b.eye);
    const struct spv_camera *c = &f->view->camera;
    if ((f->tile.width < c->width || f->tile.height < c->height) && !reaches_tile(f, &b.c, b.eye))
        return true;
    spc_block_layout(&b.b, f->header->flags, f->header->normal_clusters, &b.l);
    b.lower = b.b.kind == SPC_BLOCK_INNER ||
              (f->view->mode == SPV_HYBRID && (f->header->flags & SPC_FLAG_TRIANGLES));
    b.payload = d->source->payload(d->source->ctx, worker, d->blocks[i], &w->err);
    if (b.payload != NULL && draw_decoded(&b, d->soft->scratch[worker], &w->err))
        return true;
    w->failed = i;
    return false;
}

enum spc_status spv_soft_draw(struct spv_soft *soft, const struct spv_soft_source *source,
                              const uint32_t *blocks, size_t count, struct spc_error *err)
{
    struct draw d = {.soft = soft, .source = source, .blocks = blocks};
    const struct worker *first = NULL;
    for (unsigned t = 0; t < spv_soft_threads(soft); t++)
        soft->workers[t].err = (struct spc_error){0};
    spv_threads_run(soft->threads, count, draw_block, &d);
    for (unsigned t = 0; t < spv_soft_threads(soft); t++) {
        const struct worker *w = &soft->workers[t];
        if (w->err.status != SPC_OK && (first == NULL || w->failed < first->failed))
            first = w;
    }
    if (first != NULL && err != NULL)
        *err = first->err;
    return first != NULL ? first->err.status : SPC_OK;
}

/* ---- frame ------------------------------------------------------------------------------------- */

/* Decodes into the worker's own buffer. */
static const uint8_t *decode(void *ctx, unsigned worker, uint32_t block, struct spc_error *err)
{
    struct spv_soft *soft = ctx;
    struct worker *w = &soft->workers[worker];
    struct spc_block b;
    spc_reader_block(soft->frame.reader, block, &b);
    if (b.raw_bytes > w->payload_max) {
        free(w->payload);
        w->payload_max = 0;
        w->payload = malloc(b.raw_bytes);
        if (w->payload == NULL) {
            spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to decode a block");
            return NULL;
        }
        w->payload_max = b.raw_bytes;
    }
    return spc_block_decode(soft->frame.reader, block, true, w->payload, err) == SPC_OK ? w->payload
                                                                                      : NULL;
}

struct placed {
    double distance2;               /* of the cluster's box from the eye */
    uint32_t order, block;
};

static int nearer(const void *a, const void *b)
{
    const struct placed *p = a, *q = b;
    if (p->distance2 != q->distance2)
        return p->distance2 < q->distance2 ? -1 : 1;
    return p->order < q->order ? -1 : p->order > q->order;
}

static double distance2(const struct spc_reader *reader, const struct spv_view *view, uint32_t block)
{
    struct spc_block b;
    struct spc_cluster c;
    double eye[3], sum = 0;
    spc_reader_block(reader, block, &b);
    spc_reader_cluster(reader, b.cluster, &c);
    spv_eye_of_cluster(reader, &c, &view->camera, eye);
    for (int a = 0; a < 3; a++) {
        const double out = fmax(0, fmax((double)c.box[a] - eye[a], eye[a] - (double)c.box[a + 3]));
        sum += out * out;
    }
    return sum;
}

static enum spc_status near_first(const struct spc_reader *reader, const struct spv_view *view,
                                  const struct spv_selection *selection, uint32_t **out,
                                  struct spc_error *err)
{
    const size_t n = selection->block_count;
    struct placed *placed = malloc((n + 1) * sizeof *placed);
    *out = malloc((n + 1) * sizeof **out);
    if (placed == NULL || *out == NULL) {
        free(placed);
        free(*out);
        *out = NULL;
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to order blocks");
    }
    for (uint32_t i = 0; i < n; i++) {
        const uint32_t block = selection->blocks[i].block;
        placed[i] = (struct placed){distance2(reader, view, block), i, block};
    }
    qsort(placed, n, sizeof *placed, nearer);
    for (size_t i = 0; i < n; i++)
        (*out)[i] = placed[i].block;
    free(placed);
    return SPC_OK;
}

enum spc_status spv_soft_frame(struct spv_soft *soft, const struct spc_reader *reader,
                               const struct spv_view *view, const struct spv_selection *selection,
                               const struct spv_draw_options *options, uint8_t *rgba,
                               struct spc_error *err)
{
    const struct spv_soft_source source = {decode, soft};
    const int width = view->camera.width, height = view->camera.height;
    const int band = (size_t)width < BAND_PX ? (int)(BAND_PX / (size_t)width) : 1;
    const int step_x = options->tile > 0 ? options->tile : width;
    const int step_y = options->tile > 0 ? options->tile : band;
    uint32_t *blocks = NULL;
    enum spc_status status = near_first(reader, view, selection, &blocks, err);
    for (int y = 0; y < height && status == SPC_OK; y += step_y)
        for (int x = 0; x < width && status == SPC_OK; x += step_x) {
            const struct spv_tile tile = {x, y, width - x < step_x ? width - x : step_x,
                                          height - y < step_y ? height - y : step_y};
            status = spv_soft_begin(soft, reader, view, options, &tile, err);
            if (status == SPC_OK)
                status = spv_soft_draw(soft, &source, blocks, selection->block_count, err);
            if (status == SPC_OK)
                spv_soft_end(soft, rgba);
        }
    free(blocks);
    return status;
}
