#include "corner_sort.h"

#include "pool.h"

#include <stdlib.h>
#include <string.h>

enum { CHUNK = 16384, WINDOW_MIN = 4096, WINDOW_MAX = 1 << 20, SLICE_LOG2_MAX = 32 };

struct window {                     /* of the values of one slice */
    uint64_t off, left;             /* not read yet: bytes of the file */
    uint32_t at, end;               /* of the buffer */
};

struct spb_corner_sort {
    int slice_log2;
    uint32_t slice_count;
    uint32_t bytes;                 /* of a vertex */
    struct spb_tmpfile *values;
    uint64_t *value_off;            /* [slice_count + 1] */
    struct window *windows;         /* [slice_count] */
    uint8_t *buffers;               /* [slice_count][window_bytes] */
    uint32_t window_bytes;          /* whole vertices */
};

static enum spc_status no_memory(struct spc_error *err)
{
    return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to sort the corners of faces");
}

/* ---- which vertices are asked for -------------------------------------------------------------- */

struct asking {
    struct spb_spill spill;
    struct spb_pile *piles;         /* [slice_count] of uint32_t: numbers inside the slice */
    struct spb_face_batch batch;
};

static enum spc_status ask_batch(struct asking *a, const struct spb_corner_sort *g,
                                 const struct spb_vertices *v, struct spc_error *err)
{
    for (size_t i = 0; i < a->batch.count; i++) {
        if (!spb_face_wanted(v, a->batch.corner[i]))
            continue;
        for (int k = 0; k < 3; k++) {
            const uint64_t corner = a->batch.corner[i][k];
            const uint32_t inside = (uint32_t)(corner & (((uint64_t)1 << g->slice_log2) - 1));
            const enum spc_status status =
                spb_spill_put(&a->spill, &a->piles[corner >> g->slice_log2], &inside, err);
            if (status != SPC_OK)
                return status;
        }
    }
    return SPC_OK;
}

static enum spc_status ask_all(struct asking *a, const struct spb_corner_sort *g,
                               struct spb_source *source, const struct spb_vertices *v,
                               struct spb_progress *progress, struct spc_error *err)
{
    const uint64_t file_bytes = spb_source_info(source)->file_bytes;
    enum spc_status status = SPC_OK;
    for (uint32_t s = 0; s < g->slice_count && status == SPC_OK; s++)
        status = spb_spill_pile(&a->spill, &a->piles[s], err);
    if (status == SPC_OK)
        status = spb_source_begin_faces(source, err);
    while (status == SPC_OK) {
        status = spb_source_faces(source, &a->batch, err);
        if (status != SPC_OK || a->batch.count == 0)
            break;
        status = ask_batch(a, g, v, err);
        if (status == SPC_OK && spb_progress_tell(progress, "sort corners",
                                                  spb_source_bytes_done(source), file_bytes))
            status = spc_fail(err, SPC_CANCELLED, SPC_NO_OFF, "cancelled");
    }
    return status == SPC_OK ? spb_spill_settle(&a->spill, err) : status;
}

/* ---- slice after slice, the values ------------------------------------------------------------- */

struct chunk {
    uint32_t count;
    uint32_t asked[CHUNK];
    uint8_t values[CHUNK * 28];
};

struct answering {                  /* of one slice */
    struct spb_corner_sort *g;
    struct spb_pile_reader asked;
    uint64_t left;                  /* records of it */
    const uint8_t *slice;
    struct chunk *chunks;
    struct spb_progress *progress;
    uint32_t number;
};

static enum spc_status read_asked(void *ctx, size_t slot, bool *end, struct spc_error *err)
{
    struct answering *a = ctx;
    struct chunk *c = &a->chunks[slot];
    c->count = (uint32_t)(a->left < CHUNK ? a->left : CHUNK);
    a->left -= c->count;
    *end = c->count == 0;
    if (spb_progress_tell(a->progress, "answer corners", a->number, a->g->slice_count))
        return spc_fail(err, SPC_CANCELLED, SPC_NO_OFF, "cancelled");
    return spb_pile_read(&a->asked, c->asked, (uint64_t)c->count * sizeof *c->asked, err);
}

static enum spc_status find_values(void *ctx, size_t slot, struct spc_error *err)
{
    const struct answering *a = ctx;
    struct chunk *c = &a->chunks[slot];
    const size_t bytes = a->g->bytes;
    (void)err;
    for (uint32_t i = 0; i < c->count; i++)
        memcpy(c->values + i * bytes, a->slice + c->asked[i] * bytes, bytes);
    return SPC_OK;
}

static enum spc_status write_values(void *ctx, size_t slot, struct spc_error *err)
{
    struct answering *a = ctx;
    const struct chunk *c = &a->chunks[slot];
    uint64_t off;
    return spb_tmpfile_append(a->g->values, c->values, (size_t)c->count * a->g->bytes, &off, err);
}

static enum spc_status answer_all(struct spb_corner_sort *g, const struct spb_vertices *v,
                                  struct spb_tmpfile *asked_file, const struct spb_pile *piles,
                                  unsigned threads, struct spb_progress *progress,
                                  struct spc_error *err)
{
    const size_t slots = 2 * (size_t)threads + 1;
    const uint64_t whole = (uint64_t)1 << g->slice_log2;
    uint8_t *slice = malloc((size_t)(v->count < whole ? v->count : whole) * g->bytes + 1);
    struct chunk *chunks = malloc(slots * sizeof *chunks);
    enum spc_status status = slice && chunks ? SPC_OK : no_memory(err);
    for (uint32_t s = 0; s < g->slice_count && status == SPC_OK; s++) {
        const uint64_t first = s * whole;
        const uint64_t count = v->count - first < whole ? v->count - first : whole;
        struct answering a = {.g = g, .asked = {&piles[s], asked_file, 0, 0},
                              .left = piles[s].count, .slice = slice, .chunks = chunks,
                              .progress = progress, .number = s};
        const struct spb_pipe pipe = {read_asked, find_values, write_values, &a};
        status = spb_tmpfile_read(v->file, v->off + first * g->bytes, slice,
                                  (size_t)count * g->bytes, err);
        if (status == SPC_OK)
            status = spb_pool_pipe(&pipe, slots, threads, err);
        spb_pile_discard(&piles[s], asked_file);
        g->value_off[s + 1] = g->value_off[s] + piles[s].count * g->bytes;
    }
    free(chunks);
    free(slice);
    return status;
}

/* ---- the second pass ---------------------------------------------------------------------------- */

void spb_corner_sort_begin(struct spb_corner_sort *g)
{
    for (uint32_t s = 0; s < g->slice_count; s++)
        g->windows[s] = (struct window){.off = g->value_off[s],
                                        .left = g->value_off[s + 1] - g->value_off[s]};
}

static enum spc_status refill(struct spb_corner_sort *g, uint32_t s, struct spc_error *err)
{
    struct window *w = &g->windows[s];
    const uint32_t n = w->left < g->window_bytes ? (uint32_t)w->left : g->window_bytes;
    if (n == 0)
        return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "the scan changed while it was read");
    const enum spc_status status =
        spb_tmpfile_read(g->values, w->off, g->buffers + (size_t)s * g->window_bytes, n, err);
    w->off += n;
    w->left -= n;
    w->at = 0;
    w->end = n;
    return status;
}

enum spc_status spb_corner_sort_next(struct spb_corner_sort *g, uint64_t corner, uint8_t *vertex,
                                     struct spc_error *err)
{
    const uint32_t s = (uint32_t)(corner >> g->slice_log2);
    struct window *w = &g->windows[s];
    if (w->at == w->end) {
        const enum spc_status status = refill(g, s, err);
        if (status != SPC_OK)
            return status;
    }
    memcpy(vertex, g->buffers + (size_t)s * g->window_bytes + w->at, g->bytes);
    w->at += g->bytes;
    return SPC_OK;
}

/* ---- all of it ---------------------------------------------------------------------------------- */

static void choose_slices(struct spb_corner_sort *g, uint64_t count, uint64_t memory, int slice_log2)
{
    g->slice_log2 = slice_log2;
    if (slice_log2 <= 0)
        for (g->slice_log2 = 10; g->slice_log2 < SLICE_LOG2_MAX; g->slice_log2++)
            if (((uint64_t)2 << g->slice_log2) * g->bytes > memory / 4 * 3)
                break;
    g->slice_count = (uint32_t)(((count - 1) >> g->slice_log2) + 1);
    uint64_t window = memory / 8 / g->slice_count;
    window = window < WINDOW_MIN ? WINDOW_MIN : window > WINDOW_MAX ? WINDOW_MAX : window;
    g->window_bytes = (uint32_t)(window / g->bytes * g->bytes);
}

static enum spc_status fill(struct spb_corner_sort *g, struct spb_source *source,
                            const struct spb_vertices *v, struct spb_temp *temp, uint64_t memory,
                            unsigned threads, struct spb_progress *progress, struct spc_error *err)
{
    struct spb_tmpfile *file = NULL;
    struct asking *a = calloc(1, sizeof *a);
    if (a != NULL)
        a->piles = calloc(g->slice_count, sizeof *a->piles);
    g->value_off = calloc((size_t)g->slice_count + 1, sizeof *g->value_off);
    g->windows = calloc(g->slice_count, sizeof *g->windows);
    enum spc_status status =
        a && a->piles && g->value_off && g->windows ? SPC_OK : no_memory(err);
    if (status == SPC_OK)
        status = spb_tmpfile_create(temp, &file, err);
    if (status == SPC_OK)
        status = spb_tmpfile_create(temp, &g->values, err);
    if (status == SPC_OK)
        status = spb_spill_init(&a->spill, file, sizeof(uint32_t), memory, err);
    if (status == SPC_OK)
        status = ask_all(a, g, source, v, progress, err);
    if (status == SPC_OK)
        status = answer_all(g, v, file, a->piles, threads, progress, err);
    if (a != NULL) {
        spb_spill_release(&a->spill);
        for (uint32_t s = 0; a->piles != NULL && s < g->slice_count; s++)
            spb_pile_release(&a->piles[s]);
        free(a->piles);
    }
    free(a);
    spb_tmpfile_free(file);
    return status;
}

enum spc_status spb_corner_sort_create(struct spb_source *source,
                                       const struct spb_vertices *vertices, struct spb_temp *temp,
                                       uint64_t memory, int slice_log2, unsigned threads,
                                       struct spb_progress *progress,
                                       struct spb_corner_sort **out, struct spc_error *err)
{
    struct spb_corner_sort *g = calloc(1, sizeof *g);
    *out = NULL;
    if (g == NULL)
        return no_memory(err);
    g->bytes = vertices->bytes;
    choose_slices(g, vertices->count, memory, slice_log2);
    enum spc_status status =
        fill(g, source, vertices, temp, memory, threads, progress, err);
    if (status == SPC_OK) {
        g->buffers = malloc((size_t)g->slice_count * g->window_bytes);
        status = g->buffers ? SPC_OK : no_memory(err);
    }
    if (status != SPC_OK) {
        spb_corner_sort_free(g);
        return status;
    }
    *out = g;
    return SPC_OK;
}

void spb_corner_sort_free(struct spb_corner_sort *sort)
{
    if (sort == NULL)
        return;
    spb_tmpfile_free(sort->values);
    free(sort->value_off);
    free(sort->windows);
    free(sort->buffers);
    free(sort);
}
