/*
 * bench_reference.c - the scan itself, all triangles of it, as the judge's pictures.
 *
 * The vertex table is in memory, faces stream past it in pieces; a piece is drawn into all pictures at once, each
 * cut into bands of rows where there are more threads than pictures. Every row sees the triangles in the order of
 * the scan, so the pictures do not depend on threads or memory.
 */
#include "bench_trade.h"

#include "pool.h"
#include "source.h"
#include "vertices.h"

#include <math.h>
#include <stdlib.h>

enum { PIECE = 16384 };
static const double AMBIENT = 0.2;  /* of spc-render's light */

struct scan {
    struct spb_source *source;
    struct spb_vertices vertices;
};

struct reference {
    const struct bench_options *options;
    const struct spc_header *header;
    struct spb_temp temp;
    const char **file;
    struct scan *scans;             /* [count] */
    uint32_t count, threads;
    struct ref_raster *rasters[2 * BENCH_VIEWS];        /* a fine and a plain one a view */
    uint32_t raster_count;
    uint32_t bands;
    struct ref_triangle *piece;     /* [PIECE] */
    size_t piece_count;
    uint64_t first;                 /* number of the piece's first triangle */
    uint64_t done, total;           /* bytes of scans, in all passes */
    struct spb_face_batch batch;
};

/* ---- the scans ---------------------------------------------------------------------------------- */

static const char *path_of(const struct reference *r, uint32_t i)
{
    return r->options->scan_count > 0 ? r->options->scans[i] : r->options->archive;
}

static enum spc_status not_this(struct spc_error *err, const char *what)
{
    return spc_fail(err, SPC_INPUT_BAD, SPC_NO_OFF, "the archive was not built from this scan: %s", what);
}

/* What can be told before any face is read. Vertices that no face uses may lie outside the archive's box. */
static enum spc_status check_scans(const struct reference *r, struct spc_error *err)
{
    const struct spc_header *h = r->header;
    double min[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, max[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    uint64_t faces = 0;
    bool counted = true;
    for (uint32_t i = 0; i < r->count; i++) {
        const struct spb_source_info *info = spb_source_info(r->scans[i].source);
        faces += info->face_count;
        counted = counted && !info->strips && !info->archive;
        for (int a = 0; a < 3; a++) {
            min[a] = fmin(min[a], r->scans[i].vertices.min[a]);
            max[a] = fmax(max[a], r->scans[i].vertices.max[a]);
        }
    }
    if (counted && faces != h->faces_in) {
        char text[80];
        snprintf(text, sizeof text, "it has %llu faces, not %llu", (unsigned long long)faces,
                 (unsigned long long)h->faces_in);
        return not_this(err, text);
    }
    const double moved = ldexp(1, h->unit_exp - 10);        /* more than vertices are moved by */
    for (int a = 0; a < 3; a++)
        if (!(min[a] <= h->box_min[a] + moved && max[a] >= h->box_max[a] - moved))
            return not_this(err, "it lies elsewhere");
    return SPC_OK;
}

static int tell_vertices(void *ctx, const char *phase, uint64_t done, uint64_t total)
{
    (void)ctx;
    return bench_tell(phase, done, total, NULL) != SPC_OK;
}

static enum spc_status open_scan(struct reference *r, uint32_t i, struct spc_error *err)
{
    struct spb_progress progress = {.fn = tell_vertices};
    const struct spb_source_options options = {.progress = &progress, .temp = &r->temp};
    struct scan *s = &r->scans[i];
    *r->file = path_of(r, i);
    enum spc_status status = spb_source_open(path_of(r, i), &options, &s->source, err);
    if (status == SPC_OK && spb_source_info(s->source)->face_count == 0)
        return spc_fail(err, SPC_INPUT_EMPTY, SPC_NO_OFF, "it holds no triangles to compare with");
    if (status == SPC_OK)
        status = spb_vertices_read(s->source, &r->temp, UINT64_MAX, &progress, &s->vertices, err);
    return status;
}

/* ---- drawing ------------------------------------------------------------------------------------ */

/* Job: one band of one picture. */
static enum spc_status draw_band(void *ctx, size_t job, struct spc_error *err)
{
    struct reference *r = ctx;
    const size_t raster = job % r->raster_count, band = job / r->raster_count;
    const int side = r->options->picture.height * (raster % 2 == 0 ? BENCH_SAMPLES : 1);
    const int first = (int)((size_t)side * band / r->bands), end = (int)((size_t)side * (band + 1) / r->bands);
    (void)err;
    ref_raster_add(r->rasters[raster], r->piece, r->piece_count, r->first, first, end);
    return SPC_OK;
}

static enum spc_status draw_piece(struct reference *r, struct spc_error *err)
{
    const enum spc_status status =
        spb_pool_run((size_t)r->raster_count * r->bands, r->threads, draw_band, NULL, r, err);
    r->first += r->piece_count;
    r->piece_count = 0;
    return status;
}

static void put_corner(const struct reference *r, const struct scan *s, size_t i, int c, struct ref_triangle *out)
{
    const struct spb_vertices *v = &s->vertices;
    const uint8_t *bytes = v->table + r->batch.corner[i][c] * v->bytes;
    spb_vertex_load(v, bytes, out->corner[c]);
    if (r->batch.colored)
        memcpy(out->rgba[c], r->batch.rgba[i][c], 4);
    else if (v->colors)
        memcpy(out->rgba[c], bytes + v->bytes - 4, 4);
    else
        memset(out->rgba[c], 255, 4);
}

/* Faces that are none, by their corners, were dropped from the archive, too. */
static enum spc_status draw_batch(struct reference *r, const struct scan *s, struct spc_error *err)
{
    enum spc_status status = SPC_OK;
    for (size_t i = 0; i < r->batch.count && status == SPC_OK; i++) {
        if (!spb_face_wanted(&s->vertices, r->batch.corner[i]))
            continue;
        for (int c = 0; c < 3; c++)
            put_corner(r, s, i, c, &r->piece[r->piece_count]);
        if (++r->piece_count == PIECE)
            status = draw_piece(r, err);
    }
    return status;
}

static enum spc_status draw_scan(struct reference *r, uint32_t i, struct spc_error *err)
{
    struct scan *s = &r->scans[i];
    *r->file = path_of(r, i);
    enum spc_status status = spb_source_begin_faces(s->source, err);
    while (status == SPC_OK) {
        status = spb_source_faces(s->source, &r->batch, err);
        if (status != SPC_OK || r->batch.count == 0)
            break;
        status = draw_batch(r, s, err);
        if (status == SPC_OK)
            status = bench_tell("draw reference", r->done + spb_source_bytes_done(s->source), r->total, err);
    }
    if (status == SPC_OK && r->piece_count > 0)
        status = draw_piece(r, err);
    r->done += spb_source_info(s->source)->file_bytes;
    spb_source_pause(s->source);
    return status;
}

/* ---- views -------------------------------------------------------------------------------------- */

static enum spc_status begin_views(struct reference *r, const struct bench_view *views, uint32_t count,
                                   struct spc_error *err)
{
    r->raster_count = 0;
    for (uint32_t i = 0; i < 2 * count; i++) {
        struct ref_camera camera = views[i / 2].reference;
        camera.width *= i % 2 == 0 ? BENCH_SAMPLES : 1;
        camera.height *= i % 2 == 0 ? BENCH_SAMPLES : 1;
        r->rasters[i] = ref_raster_begin(&camera, AMBIENT);
        if (r->rasters[i] == NULL)
            return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a reference of %d x %d: %llu MB",
                            camera.width, camera.height,
                            (unsigned long long)(ref_raster_bytes(camera.width, camera.height) >> 20));
        r->raster_count++;
    }
    r->bands = (r->threads + r->raster_count - 1) / r->raster_count;
    r->first = 0;
    return SPC_OK;
}

/* The pictures of count views, drawn in one pass over all scans. */
static enum spc_status draw_views(struct reference *r, const struct bench_view *views, uint32_t count,
                                  struct bench_truth *truths, struct spc_error *err)
{
    enum spc_status status = begin_views(r, views, count, err);
    for (uint32_t i = 0; i < r->count && status == SPC_OK; i++)
        status = draw_scan(r, i, err);
    for (uint32_t v = 0; v < count && status == SPC_OK; v++) {
        struct ref_image fine, centre;
        ref_raster_end(r->rasters[2 * v], &fine);
        ref_raster_end(r->rasters[2 * v + 1], &centre);
        r->rasters[2 * v] = r->rasters[2 * v + 1] = NULL;
        if (!bench_truth_init(&truths[v], &fine, &centre, BENCH_BACKGROUND))
            status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for the reference");
    }
    for (uint32_t i = 0; i < 2 * count; i++) {
        ref_raster_end(r->rasters[i], NULL);
        r->rasters[i] = NULL;
    }
    return status;
}

static uint32_t views_at_once(const struct bench_options *o, uint32_t count)
{
    const int w = o->picture.width, h = o->picture.height;
    const uint64_t each = ref_raster_bytes(w * BENCH_SAMPLES, h * BENCH_SAMPLES) + ref_raster_bytes(w, h);
    const uint64_t fit = o->picture.memory / each;
    return fit < 1 ? 1 : fit < count ? (uint32_t)fit : count;
}

static enum spc_status open_scans(struct reference *r, struct spc_error *err)
{
    enum spc_status status = SPC_OK;
    for (uint32_t i = 0; i < r->count && status == SPC_OK; i++)
        status = open_scan(r, i, err);
    if (status == SPC_OK)
        status = check_scans(r, err);
    return status;
}

enum spc_status bench_reference(const struct bench_options *o, const struct spc_reader *reader,
                                const struct bench_view *views, uint32_t count, struct bench_truth *truths,
                                const char **file, struct spc_error *err)
{
    const char *temp = getenv("TMPDIR");
    struct reference *r = calloc(1, sizeof *r);
    *file = NULL;
    if (r == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for the reference");
    *r = (struct reference){.options = o, .header = spc_reader_header(reader), .file = file,
                            .temp.folder = temp != NULL && temp[0] != '\0' ? temp : "/tmp",
                            .count = o->scan_count > 0 ? o->scan_count : 1, .threads = o->picture.threads};
    r->threads = r->threads > 0 ? r->threads : spb_pool_cores();
    r->scans = calloc(r->count, sizeof *r->scans);
    r->piece = malloc(PIECE * sizeof *r->piece);
    enum spc_status status = r->scans && r->piece ? open_scans(r, err)
                                                  : spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for scans");
    const uint32_t group = views_at_once(o, count);
    for (uint32_t i = 0; i < r->count && status == SPC_OK; i++)
        r->total += spb_source_info(r->scans[i].source)->file_bytes * ((count + group - 1) / group);
    for (uint32_t v = 0; v < count && status == SPC_OK; v += group)
        status = draw_views(r, views + v, v + group < count ? group : count - v, truths + v, err);
    for (uint32_t i = 0; i < r->count && r->scans != NULL; i++) {
        spb_vertices_release(&r->scans[i].vertices);
        spb_source_close(r->scans[i].source);
    }
    free(r->scans);
    free(r->piece);
    free(r);
    return status;
}
