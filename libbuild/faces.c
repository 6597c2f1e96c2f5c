#include "faces.h"

#include "pool.h"
#include "vec.h"

#include <stdlib.h>
#include <string.h>

static uint64_t mix(uint64_t x)     /* splitmix64's finish */
{
    x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9u;
    x = (x ^ x >> 27) * 0x94D049BB133111EBu;
    return x ^ x >> 31;
}

/* An edge and its reverse cancel: the sum over a closed, consistently wound surface is 0. */
static uint64_t edge_hash(uint64_t a, uint64_t b)
{
    const uint64_t lo = a < b ? a : b;
    const uint64_t hi = a < b ? b : a;
    const uint64_t h = mix(mix(lo + 0x9E3779B97F4A7C15u) + hi);
    if (a == b)
        return 0;
    return a < b ? h : 0 - h;
}

/*
 * What a corner is known by. Blocks of an archive have vertices of their own, so there it is the
 * place, which is the same bits in each of them; welding by place would take a table.
 */
static uint64_t corner_name(const struct spb_vertices *v, uint64_t corner, const double xyz[3])
{
    uint64_t h = 0;
    if (!v->archive)
        return corner;
    for (int a = 0; a < 3; a++) {
        uint64_t bits;
        memcpy(&bits, &xyz[a], sizeof bits);
        h = mix(h + bits + 0x9E3779B97F4A7C15u);
    }
    return h;
}

/* ---- one batch ---------------------------------------------------------------------------------- */

struct kept {                       /* a face that becomes a record */
    size_t cell;
    double key[3];
    uint8_t record[84];
};

struct sums {                       /* of a batch; bins only of what is there */
    uint64_t bad_index, non_finite, degenerate, edge_sum;
    double min[3], max[3], file_min[3], file_max[3];
    double volume;
};

struct job {
    struct spb_face_batch batch;
    uint8_t vertices[SPB_BATCH_MAX][3][28];     /* of the wanted faces' corners */
    uint32_t kept_count;
    struct kept kept[SPB_BATCH_MAX];
    int16_t bin[SPB_BATCH_MAX];                 /* [kept_count] of the shortest edge, or -1 */
    struct sums sums;
};

static int edge_bin(double square)
{
    int exponent = 0;
    frexp(square, &exponent);
    const int bin = exponent + SPB_EDGE_BINS - 64;
    return bin < 0 ? 0 : bin >= SPB_EDGE_BINS ? SPB_EDGE_BINS - 1 : bin;
}

/* Returns the bin of its shortest edge, -1 when all are 0. */
static int measure(const uint64_t name[3], const double xyz[3][3], const struct spb_face *face,
                   struct sums *s)
{
    double shortest = HUGE_VAL, n[3];
    for (int k = 0; k < 3; k++) {
        double e[3];
        for (int a = 0; a < 3; a++) {
            s->min[a] = smaller_of(face->corner[k][a], s->min[a]);
            s->max[a] = larger_of(face->corner[k][a], s->max[a]);
            s->file_min[a] = smaller_of(xyz[k][a], s->file_min[a]);
            s->file_max[a] = larger_of(xyz[k][a], s->file_max[a]);
        }
        vec_sub(face->corner[(k + 1) % 3], face->corner[k], e);
        const double square = vec_dot(e, e);
        shortest = square > 0 ? smaller_of(square, shortest) : shortest;
        s->edge_sum += edge_hash(name[k], name[(k + 1) % 3]);
    }
    vec_cross(face->corner[1], face->corner[2], n);
    s->volume += vec_dot(face->corner[0], n);
    return shortest < HUGE_VAL ? edge_bin(shortest) : -1;
}

static bool finite_face(const double xyz[3][3])
{
    for (int k = 0; k < 3; k++)
        if (!isfinite(xyz[k][0]) || !isfinite(xyz[k][1]) || !isfinite(xyz[k][2]))
            return false;
    return true;
}

static void keep_face(const struct spb_faces_input *in, const struct spb_distributor *out,
                      struct job *job, size_t i)
{
    const struct spb_vertices *v = in->vertices;
    const uint8_t (*vertex)[28] = job->vertices[i];
    double xyz[3][3];
    uint64_t name[3];
    uint8_t rgba[3][4];
    struct spb_face face;
    for (int k = 0; k < 3; k++)
        spb_vertex_load(v, vertex[k], xyz[k]);
    if (!finite_face((const double(*)[3])xyz)) {
        job->sums.non_finite++;
        return;
    }
    for (int k = 0; k < 3; k++) {
        name[k] = corner_name(v, job->batch.corner[i][k], xyz[k]);
        if (v->colors)
            memcpy(rgba[k], vertex[k] + v->bytes - 4, 4);
    }
    struct kept *kept = &job->kept[job->kept_count];
    spb_record_store(&out->format, (const double(*)[3])xyz, (const uint8_t(*)[4])rgba,
                     kept->record);
    spb_record_load(&out->format, in->space, kept->record, &face);
    job->bin[job->kept_count++] =
        (int16_t)measure(name, (const double(*)[3])xyz, &face, &job->sums);
    spb_face_key(&face, kept->key);
    kept->cell = spb_distributor_cell(out, kept->key);
}

static void fetch_ahead(const struct spb_vertices *v, const uint64_t corner[3])
{
    for (int k = 0; k < 3; k++)
        if (corner[k] < v->count)
            __builtin_prefetch(v->table + corner[k] * v->bytes);
}

/* ---- the batches -------------------------------------------------------------------------------- */

struct reading {
    const struct spb_faces_input *in;
    struct spb_distributor *out;
    struct spb_face_stats *stats;
    struct job *jobs;
};

static enum spc_status fetch_corner(const struct spb_faces_input *in, uint64_t corner,
                                    uint8_t *vertex, struct spc_error *err)
{
    return in->corners ? spb_corner_sort_next(in->corners, corner, vertex, err)
                       : spb_vertex_cache_get(in->cache, corner, vertex, err);
}

static enum spc_status read_batch(void *ctx, size_t slot, bool *end, struct spc_error *err)
{
    struct reading *r = ctx;
    const struct spb_faces_input *in = r->in;
    struct job *job = &r->jobs[slot];
    enum spc_status status = spb_source_faces(in->source, &job->batch, err);
    if (status != SPC_OK)
        return status;
    r->stats->faces_in += job->batch.faces_in;
    r->stats->split_extra += job->batch.split_extra;
    r->stats->degenerate += job->batch.faces_short;
    *end = job->batch.count == 0;
    for (size_t i = 0; i < job->batch.count && in->vertices->table == NULL; i++)
        for (int k = 0; k < 3 && spb_face_wanted(in->vertices, job->batch.corner[i]); k++) {
            status = fetch_corner(in, job->batch.corner[i][k], job->vertices[i][k], err);
            if (status != SPC_OK)
                return status;
        }
    if (spb_progress_tell(in->progress, "read faces", spb_source_bytes_done(in->source),
                          spb_source_info(in->source)->file_bytes))
        return spc_fail(err, SPC_CANCELLED, SPC_NO_OFF, "cancelled");
    return SPC_OK;
}

static enum spc_status work_batch(void *ctx, size_t slot, struct spc_error *err)
{
    enum { AHEAD = 16 };
    const struct reading *r = ctx;
    const struct spb_vertices *v = r->in->vertices;
    struct job *job = &r->jobs[slot];
    (void)err;
    job->kept_count = 0;
    job->sums = (struct sums){
        .min = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, .max = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL},
        .file_min = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, .file_max = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}};
    for (size_t i = 0; i < job->batch.count; i++) {
        const uint64_t *corner = job->batch.corner[i];
        if (v->table != NULL && i + AHEAD < job->batch.count)
            fetch_ahead(v, job->batch.corner[i + AHEAD]);
        if (!spb_face_wanted(v, corner)) {
            const bool bad = corner[0] >= v->count || corner[1] >= v->count || corner[2] >= v->count;
            *(bad ? &job->sums.bad_index : &job->sums.degenerate) += 1;
            continue;
        }
        for (int k = 0; k < 3 && v->table != NULL; k++)
            memcpy(job->vertices[i][k], v->table + corner[k] * v->bytes, v->bytes);
        keep_face(r->in, r->out, job, i);
    }
    return SPC_OK;
}

/* In the order of the batches, so that sums of doubles do not depend on timing either. */
static enum spc_status take_batch(void *ctx, size_t slot, struct spc_error *err)
{
    struct reading *r = ctx;
    struct spb_face_stats *s = r->stats;
    const struct job *job = &r->jobs[slot];
    s->bad_index += job->sums.bad_index;
    s->non_finite += job->sums.non_finite;
    s->degenerate += job->sums.degenerate;
    s->edge_sum += job->sums.edge_sum;
    s->volume += job->sums.volume;
    for (int a = 0; a < 3; a++) {
        s->min[a] = smaller_of(job->sums.min[a], s->min[a]);
        s->max[a] = larger_of(job->sums.max[a], s->max[a]);
        s->file_min[a] = smaller_of(job->sums.file_min[a], s->file_min[a]);
        s->file_max[a] = larger_of(job->sums.file_max[a], s->file_max[a]);
    }
    for (uint32_t i = 0; i < job->kept_count; i++) {
        const struct kept *kept = &job->kept[i];
        if (job->bin[i] >= 0)
            s->edge_bins[job->bin[i]]++;
        const enum spc_status status =
            spb_distributor_add(r->out, kept->cell, kept->key, kept->record, err);
        if (status != SPC_OK)
            return status;
        s->kept++;
    }
    return SPC_OK;
}

enum spc_status spb_faces_read(const struct spb_faces_input *in, struct spb_distributor *out,
                               struct spb_face_stats *stats, struct spc_error *err)
{
    const size_t slots = in->threads > 1 ? 2 * (size_t)in->threads : 1;
    struct reading r = {in, out, stats, malloc(slots * sizeof *r.jobs)};
    const struct spb_pipe pipe = {read_batch, work_batch, take_batch, &r};
    *stats = (struct spb_face_stats){.kept = 0};
    for (int a = 0; a < 3; a++) {
        stats->min[a] = stats->file_min[a] = HUGE_VAL;
        stats->max[a] = stats->file_max[a] = -HUGE_VAL;
    }
    if (r.jobs == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to read faces");
    if (in->corners != NULL)
        spb_corner_sort_begin(in->corners);
    enum spc_status status = spb_source_begin_faces(in->source, err);
    if (status == SPC_OK)
        status = spb_pool_pipe(&pipe, slots, in->threads, err);
    free(r.jobs);
    return status == SPC_OK ? spb_distributor_flush(out, err) : status;
}

double spb_face_short_edge(const struct spb_face_stats *stats)
{
    uint64_t total = 0, below = 0;
    for (int i = 0; i < SPB_EDGE_BINS; i++)
        total += stats->edge_bins[i];
    for (int i = 0; i < SPB_EDGE_BINS && total > 0; i++) {
        below += stats->edge_bins[i];
        if (below > total / 10) {
            const int square = i - (SPB_EDGE_BINS - 64) - 1;    /* squares of the bin are >= 2^square */
            return times_exp2(1, (square - (square & 1)) / 2);
        }
    }
    return 0;
}
