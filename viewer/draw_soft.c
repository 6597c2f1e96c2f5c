/*
 * draw_soft.c - the back end without GL: blocks to threads, framebuffer to picture.
 *
 * A block is decoded, where nobody kept it, tested and drawn by one thread; all threads draw into one
 * framebuffer, whose pixels only ever grow (soft_int.h). Blocks near the eye
 * come first: what they hide costs little afterwards. Pictures of more than BAND_PX pixels are drawn
 * in bands, for the framebuffer's memory; each decodes what reaches into it.
 */
#include "soft_int.h"

#include "bytes.h"
#include "kept.h"
#include "layout.h"
#include "threads.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define BAND_PX ((size_t)1 << 26)
enum {
    JOB_PX = 1 << 16,               /* what a thread clears or writes out at a time */
    BATCHES = 3,                    /* of about equal numbers of nodes: more cost more than they hide */
    UNITS_APART = 64,               /* octaves between units that depths still tell */
};

struct spv_soft {
    struct spv_draw base;
    struct spv_threads *threads;
    struct soft_scratch **scratch;  /* one a thread */
    struct worker *workers;
    struct soft_frame *frames;      /* one a part: the same but for reader, eye and unit; the last is of no part */
    uint32_t frames_max;            /* parts */
    int unit_exp;                   /* of depths */
    _Atomic uint64_t *words;
    size_t words_max;
    struct placed *placed;          /* what is drawn, near first */
    size_t placed_max;
    struct soft_map map;
    enum spv_lanes lanes;
};

struct worker {                     /* one a thread */
    uint8_t *payload;               /* decoded block */
    size_t payload_max;
    struct spc_error err;           /* of the first block by order that failed here */
    size_t failed;
};

static struct spv_soft *soft_of(struct spv_draw *draw)
{
    return (struct spv_soft *)draw;
}

void spv_soft_narrow(struct spv_draw *draw, enum spv_lanes lanes)
{
    struct spv_soft *soft = soft_of(draw);
    soft->lanes = lanes < soft->lanes ? lanes : soft->lanes;
}

static void release(struct spv_draw *draw)
{
    struct spv_soft *soft = soft_of(draw);
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
    free(soft->frames);
    free((void *)soft->words);
    free(soft->placed);
    free(soft->map.farthest);
    free(soft);
}

/* ---- framebuffer ------------------------------------------------------------------------------- */

/* Of rows in the framebuffer, words: an odd number of cache lines, or a column's pixels would share few of them. */
static size_t pitch_of(const struct spv_tile *tile)
{
    return 8 * (((size_t)tile->width + 7) / 8 | 1);
}

static size_t tile_words(const struct soft_frame *f)
{
    return f->pitch * (size_t)f->tile.height;
}

static bool clear(void *ctx, unsigned worker, size_t i)
{
    const struct soft_frame *f = ctx;
    const size_t first = i * JOB_PX, left = tile_words(f) - first;
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
        f->eye[a] = f->header != NULL ? ldexp(c->eye[a], -f->header->unit_exp) : 0;
    }
    f->focal = c->focal_px;
    f->center[0] = c->width / 2.0 - f->tile.x0;
    f->center[1] = c->height / 2.0 - f->tile.y0;
    f->flat_px = (float)(c->focal_px / 256);        /* light changes by less than half of 1/255 */
}

static enum spc_status take_words(struct spv_soft *soft, const struct spv_tile *tile, struct spc_error *err)
{
    const size_t n = pitch_of(tile) * (size_t)tile->height, each = sizeof *soft->words;
    if (n <= soft->words_max)
        return SPC_OK;
    free((void *)soft->words);
    soft->words_max = 0;
    soft->words = n > SIZE_MAX / each ? NULL : aligned_alloc(64, align_up(n * each, 64));
    if (soft->words == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to draw %d x %d pixels: %zu MB", tile->width,
                        tile->height, n / (((size_t)1 << 20) / each));
    soft->words_max = n;
    return SPC_OK;
}

/*
 * Depths of all parts are in one unit. Of archives that lie further apart than floats reach, those of
 * smaller ones count as near: what is seen of a larger one from there lies behind them.
 */
static void share_unit(struct spv_soft *soft, uint32_t parts)
{
    int low = INT_MAX, high = INT_MIN;
    for (uint32_t p = 0; p < parts; p++) {
        const int unit = soft->frames[p].header->unit_exp;
        low = unit < low ? unit : low;
        high = unit > high ? unit : high;
    }
    const int common = soft->unit_exp = parts == 0 || high - low < UNITS_APART ? high : low + UNITS_APART;
    for (uint32_t p = 0; p < parts; p++) {
        const int apart = common - soft->frames[p].header->unit_exp;
        soft->frames[p].unit = ldexpf(1, apart < -UNITS_APART ? -UNITS_APART : apart);
    }
}

static enum spc_status begin(struct spv_soft *soft, const struct frame_input *in, const struct spv_tile *tile,
                             struct spc_error *err)
{
    const enum spc_status status = take_words(soft, tile, err);
    if (status != SPC_OK)
        return status;
    const bool alone = spv_threads_count(soft->threads) == 1;
    for (uint32_t p = 0; p <= in->part_count; p++) {
        struct soft_frame *f = &soft->frames[p];
        const struct spc_reader *reader = p < in->part_count ? in->parts[p].reader : NULL;
        *f = (struct soft_frame){.reader = reader, .header = reader != NULL ? spc_reader_header(reader) : NULL,
                                 .view = in->view, .tested = in->tested, .splat = in->options->splat,
                                 .paint = in->options->paint, .ambient = in->options->ambient, .tile = *tile,
                                 .words = soft->words, .pitch = pitch_of(tile), .alone = alone, .lanes = soft->lanes};
        take_camera(f, &in->view->camera);
    }
    share_unit(soft, in->part_count);
    spv_threads_run(soft->threads, (tile_words(soft->frames) + JOB_PX - 1) / JOB_PX, clear, soft->frames);
    return SPC_OK;
}

struct resolve {
    const struct soft_frame *frame;
    uint8_t *rgba;
    uint32_t background;
};

static bool resolve_row(void *ctx, unsigned worker, size_t y)
{
    const struct resolve *r = ctx;
    const struct soft_frame *f = r->frame;
    const size_t width = (size_t)f->tile.width;
    const _Atomic uint64_t *from = f->words + y * f->pitch;
    uint8_t *to = r->rgba + 4 * (((size_t)f->tile.y0 + y) * (size_t)f->view->camera.width +
                                 (size_t)f->tile.x0);
    (void)worker;
    for (size_t x = 0; x < width; x++) {
        const uint64_t word = atomic_load_explicit(&from[x], memory_order_relaxed);
        store_u32(to + 4 * x, word != 0 ? (uint32_t)word : r->background);
    }
    return true;
}

static void end(struct spv_soft *soft, const struct spv_draw_options *options, uint8_t *rgba)
{
    struct resolve r = {.frame = &soft->frames[0], .rgba = rgba, .background = load_u32(options->background)};
    spv_threads_run(soft->threads, (size_t)r.frame->tile.height, resolve_row, &r);
}

/* ---- blocks ------------------------------------------------------------------------------------ */

#define TOPS SPC_NONE               /* in place of an item: the cluster's tops */

enum fate { NOT_REACHED, HIDDEN, DRAWN };

struct placed {                     /* an item of a part, or a cluster's tops */
    double distance2;               /* of the cluster's box from the eye */
    uint32_t part, cluster, item, nodes;
    enum fate fate;                 /* over all tiles */
};

struct draw {
    struct spv_soft *soft;
    const struct frame_input *in;
    struct placed *placed;
    const struct soft_map *map;     /* of what is drawn already, or NULL */
};

/* Decodes into the worker's own buffer, sorted as kept blocks are if that is asked for; NULL: it failed. */
static const uint8_t *decode(const struct soft_frame *f, struct worker *w, const struct spc_block *b,
                             uint32_t block, bool sorted)
{
    if (b->raw_bytes > w->payload_max) {
        free(w->payload);
        w->payload_max = 0;
        w->payload = malloc(b->raw_bytes);
        if (w->payload == NULL) {
            spc_fail(&w->err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to decode a block");
            return NULL;
        }
        w->payload_max = b->raw_bytes;
    }
    enum spc_status status = spc_block_decode(f->reader, block, true, w->payload, &w->err);
    if (status == SPC_OK && sorted)
        status = spv_kept_sort(f->reader, block, w->payload, &w->err);
    return status == SPC_OK ? w->payload : NULL;
}

/* What has to be tested. */
static void choose_nodes(const struct soft_block *b, bool sorted, struct spv_ranges *out)
{
    const struct soft_frame *f = b->frame;
    const uint8_t *codes = b->payload + b->l.nodes + ND_E_PARENT, *groups = b->payload + b->l.groups;
    if (sorted)
        spv_kept_ranges(f->reader, f->tested, &b->b, &b->c, b->tested_eye, codes, SPC_NODE_BYTES, groups, out);
    else
        spv_visible_ranges(f->reader, f->tested, &b->b, &b->c, b->tested_eye, groups, out);
}

static bool draw_decoded(const struct soft_block *b, bool sorted, struct soft_scratch *s, struct spc_error *err)
{
    const struct soft_frame *f = b->frame;
    const bool triangles = b->l.indices && f->view->mode != SPV_POINTS;
    struct spv_ranges ranges;
    choose_nodes(b, sorted, &ranges);
    s->projected = false;
    for (uint32_t r = 0; r < ranges.count; r++) {
        s->counts.tested += (uint64_t)ranges.nodes[r];
        const uint32_t first = (uint32_t)ranges.first[r], n = (uint32_t)ranges.nodes[r];
        if (triangles && !spv_soft_triangles(b, s, first, n)) {
            spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to draw a block");
            return false;
        }
        if (f->view->mode != SPV_TRIANGLES)
            spv_soft_points(b, s, first, n);
    }
    return true;
}

static bool draw_item(struct soft_block *b, const struct spv_item *item, struct worker *w, struct soft_scratch *s)
{
    const struct soft_frame *f = b->frame;
    spc_reader_block(f->reader, item->block, &b->b);
    spc_block_layout(&b->b, f->header->flags, f->header->normal_clusters, &b->l);
    b->lower = b->b.kind == SPC_BLOCK_INNER ||
               (f->view->mode == SPV_HYBRID && (f->header->flags & SPC_FLAG_TRIANGLES));
    b->missing = item->missing;
    const bool sorted = f->paint != SPV_PAINT_NORMALS;         /* by which the file sorts them */
    b->payload = item->kept != NULL && sorted ? item->kept : decode(f, w, &b->b, item->block, sorted);
    return b->payload != NULL && draw_decoded(b, sorted, s, &w->err);
}

/* Each top is a block of one node: a record, and behind it its colour. */
static void draw_tops(struct soft_block *b, uint32_t cluster, struct soft_scratch *s)
{
    uint8_t payload[SPC_NODE_BYTES + 4];
    b->payload = payload;
    b->l = (struct spc_block_layout){.colors = b->frame->header->flags & SPC_FLAG_COLORS ? SPC_NODE_BYTES : 0};
    b->lower = false;
    for (uint32_t t = 0; t < b->c.top_count; t++) {
        const struct spc_top *top = &b->c.tops[t];
        memcpy(payload, top->record, SPC_NODE_BYTES);
        memcpy(payload + SPC_NODE_BYTES, top->rgba, 4);
        b->b = (struct spc_block){.cluster = cluster, .node_count = 1, .step_exp = top->step_exp,
                                  .link_base = top->link_base};
        s->counts.tested++;
        spv_soft_points(b, s, 0, 1);
    }
}

static bool draw_placed(void *ctx, unsigned worker, size_t i)
{
    const struct draw *d = ctx;
    struct placed *at = &d->placed[i];
    const struct soft_frame *f = &d->soft->frames[at->part];
    struct soft_scratch *s = d->soft->scratch[worker];
    struct worker *w = &d->soft->workers[worker];
    struct soft_block b = {.frame = f};
    const struct soft_counts before = s->counts;
    bool drawn = true;
    spc_reader_cluster(f->reader, at->cluster, &b.c);
    spv_eye_of_cluster(f->reader, &b.c, &f->view->camera, b.eye);
    spv_eye_of_cluster(f->reader, &b.c, &f->tested->camera, b.tested_eye);
    const enum soft_sight sight = spv_soft_sight(f, d->map, &b.c, b.eye);
    if (sight == SOFT_HIDDEN && at->fate == NOT_REACHED)
        at->fate = HIDDEN;
    if (sight != SOFT_SEEN)
        return true;
    if (at->item != TOPS)
        drawn = draw_item(&b, &d->in->parts[at->part].items[at->item], w, s);
    else if (f->view->mode != SPV_TRIANGLES)
        draw_tops(&b, at->cluster, s);
    if (at->fate == DRAWN)
        s->counts = before;         /* counted in another tile */
    at->fate = DRAWN;
    w->failed = i;                  /* if so */
    return drawn;
}

/* Draws those from first to end. */
static enum spc_status draw_batch(struct draw *d, size_t first, size_t end, struct spc_error *err)
{
    struct spv_soft *soft = d->soft;
    const struct worker *failed = NULL;
    const unsigned n = spv_threads_count(soft->threads);
    for (unsigned t = 0; t < n; t++)
        soft->workers[t].err = (struct spc_error){0};
    d->placed = soft->placed + first;
    spv_threads_run(soft->threads, end - first, draw_placed, d);
    for (unsigned t = 0; t < n; t++) {
        const struct worker *w = &soft->workers[t];
        if (w->err.status != SPC_OK && (failed == NULL || w->failed < failed->failed))
            failed = w;
    }
    if (failed != NULL && err != NULL)
        *err = failed->err;
    return failed != NULL ? failed->err.status : SPC_OK;
}

/* Near ones first, in batches of whole clusters; each is looked at against what those before have drawn. */
static enum spc_status draw_items(struct spv_soft *soft, const struct frame_input *in, size_t count,
                                  struct spc_error *err)
{
    struct draw d = {.soft = soft, .in = in};
    enum spc_status status = SPC_OK;
    uint64_t nodes = 0, seen = 0;
    for (size_t i = 0; i < count; i++)
        nodes += soft->placed[i].nodes;
    for (size_t i = 0, end, batch = 1; i < count && status == SPC_OK; i = end, batch++) {
        for (end = i; end < count && (end == i || BATCHES * seen < batch * nodes || in->options->no_occlusion ||
                                      soft->placed[end].cluster == soft->placed[end - 1].cluster); end++)
            seen += soft->placed[end].nodes;
        if (batch > 1) {
            if (!spv_soft_map(soft->threads, soft->frames, &soft->map))
                return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to see what is hidden");
            d.map = &soft->map;
        }
        status = draw_batch(&d, i, end, err);
    }
    return status;
}

/* What the clusters that are asked about are in the finished tile, into hidden as bits. */
static enum spc_status probe(struct spv_soft *soft, const struct frame_input *in, struct spc_error *err)
{
    bool mapped = false;
    for (uint32_t p = 0; p < in->part_count; p++) {
        struct spv_part *part = &in->parts[p];
        for (uint32_t i = 0; i < part->probe_count; i++) {
            struct spc_cluster c;
            double eye[3];
            if (!mapped && !spv_soft_map(soft->threads, soft->frames, &soft->map))
                return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to see what is hidden");
            mapped = true;
            spc_reader_cluster(part->reader, part->probes[i], &c);
            spv_eye_of_cluster(part->reader, &c, &in->view->camera, eye);
            part->hidden[i] |= (uint8_t)(1u << spv_soft_sight(&soft->frames[p], &soft->map, &c, eye));
        }
    }
    return SPC_OK;
}

/* From what it was in each tile, as bits: hidden in some, seen in none. */
static void judge_probes(const struct frame_input *in, bool whole)
{
    for (uint32_t p = 0; p < in->part_count; p++)
        for (uint32_t i = 0; i < in->parts[p].probe_count; i++) {
            uint8_t *hidden = &in->parts[p].hidden[i];
            *hidden = whole && (*hidden & 1 << SOFT_HIDDEN) && !(*hidden & 1 << SOFT_SEEN);
        }
}

/* ---- frame ------------------------------------------------------------------------------------- */

static int nearer(const void *a, const void *b)
{
    const struct placed *p = a, *q = b;
    if (p->distance2 != q->distance2)
        return p->distance2 < q->distance2 ? -1 : 1;
    if (p->part != q->part)
        return p->part < q->part ? -1 : 1;
    if (p->cluster != q->cluster)
        return p->cluster < q->cluster ? -1 : 1;
    return p->item < q->item ? -1 : p->item > q->item;
}

static enum spc_status take_places(struct spv_soft *soft, const struct frame_input *in, struct spc_error *err)
{
    size_t n = 0;
    for (uint32_t p = 0; p < in->part_count; p++)
        n += (size_t)in->parts[p].item_count + in->parts[p].top_count;
    if (n > soft->placed_max || soft->placed == NULL || in->part_count > soft->frames_max) {
        free(soft->placed);
        free(soft->frames);
        soft->placed = malloc(n * sizeof *soft->placed + 1);
        soft->frames = malloc(((size_t)in->part_count + 1) * sizeof *soft->frames);
        soft->placed_max = n;
        soft->frames_max = in->part_count;
    }
    if (soft->placed != NULL && soft->frames != NULL)
        return SPC_OK;
    free(soft->placed);
    soft->placed = NULL;
    return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to order blocks");
}

/* Orders all parts' items and tops; their number into *count. */
static enum spc_status near_first(struct spv_soft *soft, const struct frame_input *in, size_t *count,
                                  struct spc_error *err)
{
    const enum spc_status status = take_places(soft, in, err);
    size_t n = 0;
    for (uint32_t p = 0; p < in->part_count && status == SPC_OK; p++) {
        const struct spv_part *part = &in->parts[p];
        const int unit = spc_reader_header(in->parts[0].reader)->unit_exp;
        for (uint32_t i = 0; i < part->item_count + part->top_count; i++) {
            struct placed *at = &soft->placed[n++];
            struct spc_block b = {.cluster = i < part->item_count ? 0 : part->tops[i - part->item_count]};
            if (i < part->item_count)
                spc_reader_block(part->reader, part->items[i].block, &b);
            *at = (struct placed){.part = p, .cluster = b.cluster, .item = i < part->item_count ? i : TOPS,
                                  .nodes = i < part->item_count ? b.node_count : SPC_TOPS_MAX};
            at->distance2 = spv_cluster_distance2(part->reader, &in->view->camera, b.cluster, unit);
        }
    }
    if (status == SPC_OK)
        qsort(soft->placed, n, sizeof *soft->placed, nearer);
    *count = n;
    return status;
}

/* Clusters of which nothing was drawn in any tile. */
static uint32_t count_hidden(const struct placed *placed, size_t count)
{
    uint32_t hidden = 0;
    for (size_t i = 0, end; i < count; i = end) {
        bool some = false, drawn = false;
        for (end = i; end < count && placed[end].part == placed[i].part && placed[end].cluster == placed[i].cluster;
             end++) {
            some |= placed[end].fate == HIDDEN;
            drawn |= placed[end].fate == DRAWN;
        }
        hidden += some && !drawn;
    }
    return hidden;
}

static void add_up(const struct spv_soft *soft, size_t count, struct spv_drawn *drawn)
{
    for (unsigned t = 0; t < spv_threads_count(soft->threads); t++) {
        struct soft_counts *c = &soft->scratch[t]->counts;
        drawn->nodes += c->points;
        drawn->triangles += c->triangles;
        drawn->nodes_processed += c->tested;
        *c = (struct soft_counts){0};
    }
    drawn->clusters_hidden = count_hidden(soft->placed, count);
}

static enum spc_status draw_parts(struct spv_draw *draw, const struct frame_input *in, uint8_t *rgba,
                                  struct spv_drawn *drawn, struct spc_error *err)
{
    struct spv_soft *soft = soft_of(draw);
    const int width = in->view->camera.width, height = in->view->camera.height, tile = in->options->tile;
    const int band = (size_t)width < BAND_PX ? (int)(BAND_PX / (size_t)width) : 1;
    const int step_x = tile > 0 ? tile : width, step_y = tile > 0 ? tile : band;
    size_t count;
    enum spc_status status = near_first(soft, in, &count, err);
    for (int y = 0; y < height && status == SPC_OK; y += step_y)
        for (int x = 0; x < width && status == SPC_OK; x += step_x) {
            const struct spv_tile at = {x, y, width - x < step_x ? width - x : step_x,
                                        height - y < step_y ? height - y : step_y};
            status = begin(soft, in, &at, err);
            if (status == SPC_OK)
                status = draw_items(soft, in, count, err);
            if (status == SPC_OK)
                status = probe(soft, in, err);
            if (status == SPC_OK)
                end(soft, in->options, rgba);
        }
    judge_probes(in, status == SPC_OK);
    add_up(soft, count, drawn);
    return status;
}

static bool depth_at(struct spv_draw *draw, int x, int y, double *depth)
{
    const struct spv_soft *soft = soft_of(draw);
    const struct soft_frame *f = soft->frames;
    if (f == NULL || soft->words == NULL || f->tile.x0 != 0 || f->tile.y0 != 0 || x < 0 || y < 0 ||
        x >= f->tile.width || y >= f->tile.height)
        return false;
    const uint64_t word = atomic_load_explicit(&soft->words[(size_t)y * f->pitch + (size_t)x],
                                               memory_order_relaxed);
    if (word == 0)
        return false;
    *depth = ldexp(1 / (double)soft_float((uint32_t)(word >> 32)), soft->unit_exp);
    return true;
}

/* ---- life -------------------------------------------------------------------------------------- */

static void *keep(struct spv_draw *draw, const struct spc_reader *reader, uint32_t block, uint8_t *payload)
{
    (void)draw;
    (void)reader;
    (void)block;
    return payload;
}

static void drop(struct spv_draw *draw, void *kept)
{
    (void)draw;
    free(kept);
}

static const struct draw_ops OPS = {release, draw_parts, depth_at, keep, drop};

enum spc_status spv_soft_create(unsigned threads, struct spv_draw **out, struct spc_error *err)
{
    *out = NULL;
    struct spv_soft *soft = calloc(1, sizeof *soft);
    if (soft != NULL) {
        soft->base.ops = &OPS;
        soft->threads = spv_threads_create(threads);
    }
    if (soft != NULL && soft->threads != NULL) {
        const unsigned n = spv_threads_count(soft->threads);
        bool whole = true;
        soft->scratch = calloc(n, sizeof *soft->scratch);
        soft->workers = calloc(n, sizeof *soft->workers);
        for (unsigned t = 0; t < n && soft->scratch != NULL; t++)
            whole &= (soft->scratch[t] = calloc(1, sizeof **soft->scratch)) != NULL;
        if (whole && soft->scratch != NULL && soft->workers != NULL) {
            soft->lanes = spv_lanes_here();
            snprintf(soft->base.name, sizeof soft->base.name, "soft, %s, %u thread%s",
                     SPV_LANES_NAME[soft->lanes], n, n == 1 ? "" : "s");
            *out = &soft->base;
            return SPC_OK;
        }
    }
    if (soft != NULL)
        release(&soft->base);
    return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for the renderer");
}
