#include "faces.h"

#include "pool.h"

#include <math.h>
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
 * What a corner is known by where vertices have no numbers that mean anything, as in the blocks of
 * an archive or in STL: its place, the same bits in each of them. Welding would take a table.
 */
static uint64_t place_name(const struct spb_vertices *v, const uint8_t *vertex)
{
    double xyz[3];
    uint64_t h = 0;
    spb_vertex_load(v, vertex, xyz);
    for (int a = 0; a < 3; a++) {
        uint64_t bits;
        xyz[a] += 0;                /* one zero of the two */
        memcpy(&bits, &xyz[a], sizeof bits);
        h = mix(h + bits + 0x9E3779B97F4A7C15u);
    }
    return h;
}

/* ---- one batch ---------------------------------------------------------------------------------- */

struct job {
    struct spb_face_batch batch;
    uint8_t vertices[SPB_BATCH_MAX][3][28];     /* of the wanted faces' corners */
    uint32_t kept;                  /* faces that become records */
    uint8_t records[SPB_BATCH_MAX * 84];        /* [kept] without gaps */
    double keys[SPB_BATCH_MAX][4];              /* [kept] as of spb_record_keys */
    uint32_t cells[SPB_BATCH_MAX];              /* [kept] */
    struct spb_bins bins[SPB_BATCH_MAX];        /* [kept] as of spb_survey_measure */
    struct spb_measures measures;
    uint64_t bad_index, non_finite, degenerate, edge_sum;
};

static bool finite_vertex(const struct spb_vertices *v, const uint8_t *vertex)
{
    double xyz[3];
    spb_vertex_load(v, vertex, xyz);
    return isfinite(xyz[0]) && isfinite(xyz[1]) && isfinite(xyz[2]);
}

/*
 * The bytes of a vertex are those of a corner in a record: coordinates first, colours last. The
 * corners' own colours, if any (else NULL), come first; with neither they are white.
 */
static void store_record(const struct spb_vertices *v, const uint8_t vertex[3][28],
                         const uint8_t (*rgba)[4], bool colors, uint8_t *record)
{
    static const uint8_t white[4] = {255, 255, 255, 255};
    const uint32_t xyz_bytes = v->wide ? 24 : 12;
    for (uint32_t k = 0; k < 3; k++)
        memcpy(record + k * xyz_bytes, vertex[k], xyz_bytes);
    for (uint32_t k = 0; k < 3 && colors; k++)
        memcpy(record + 3 * xyz_bytes + 4 * k, rgba ? rgba[k] : v->colors ? vertex[k] + xyz_bytes : white, 4);
}

static void keep_face(const struct spb_vertices *v, const struct spb_record_format *format,
                      struct job *job, size_t i)
{
    const uint8_t (*vertex)[28] = (const uint8_t(*)[28])job->vertices[i];
    const uint64_t *corner = job->batch.corner[i];
    uint64_t name[3] = {corner[0], corner[1], corner[2]};
    for (int k = 0; k < 3; k++)
        if (!finite_vertex(v, vertex[k])) {
            job->non_finite++;
            return;
        }
    for (int k = 0; k < 3 && v->by_place; k++)
        name[k] = place_name(v, vertex[k]);
    if (!v->archive && (name[0] == name[1] || name[1] == name[2] || name[2] == name[0])) {
        job->degenerate++;          /* by place; by number it would not be here */
        return;
    }
    for (int k = 0; k < 3; k++)
        job->edge_sum += edge_hash(name[k], name[(k + 1) % 3]);
    store_record(v, vertex, job->batch.colored ? (const uint8_t(*)[4])job->batch.rgba[i] : NULL, format->colors,
                 job->records + (size_t)job->kept++ * format->bytes);
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
    job->kept = 0;
    job->bad_index = job->non_finite = job->degenerate = job->edge_sum = 0;
    for (size_t i = 0; i < job->batch.count; i++) {
        const uint64_t *corner = job->batch.corner[i];
        if (v->table != NULL && i + AHEAD < job->batch.count)
            fetch_ahead(v, job->batch.corner[i + AHEAD]);
        if (!spb_face_wanted(v, corner)) {
            const bool bad = corner[0] >= v->count || corner[1] >= v->count || corner[2] >= v->count;
            *(bad ? &job->bad_index : &job->degenerate) += 1;
            continue;
        }
        for (int k = 0; k < 3 && v->table != NULL; k++)
            memcpy(job->vertices[i][k], v->table + corner[k] * v->bytes, v->bytes);
        keep_face(v, &r->out->format, job, i);
    }
    spb_record_keys(&r->out->format, r->in->space, job->records, job->kept, job->keys);
    spb_survey_measure(&r->out->format, r->in->space, job->records, job->kept, &job->measures,
                       job->bins);
    spb_distributor_cells(r->out, (const double(*)[4])job->keys, job->kept, job->cells);
    return SPC_OK;
}

/* In the order of the batches, so that sums of doubles do not depend on timing either. */
static enum spc_status take_batch(void *ctx, size_t slot, struct spc_error *err)
{
    struct reading *r = ctx;
    struct spb_face_stats *s = r->stats;
    const struct job *job = &r->jobs[slot];
    s->bad_index += job->bad_index;
    s->non_finite += job->non_finite;
    s->degenerate += job->degenerate;
    s->edge_sum += job->edge_sum;
    spb_survey_add(&s->survey, &job->measures, job->bins, job->kept);
    for (uint32_t i = 0; i < job->kept; i++) {
        const enum spc_status status =
            spb_distributor_add(r->out, job->cells[i], job->keys[i],
                                job->records + (size_t)i * r->out->format.bytes, err);
        if (status != SPC_OK)
            return status;
    }
    s->kept += job->kept;
    return SPC_OK;
}

enum spc_status spb_faces_read(const struct spb_faces_input *in, struct spb_distributor *out,
                               struct spb_face_stats *stats, struct spc_error *err)
{
    const size_t slots = in->threads > 1 ? 2 * (size_t)in->threads : 1;
    struct reading r = {in, out, stats, malloc(slots * sizeof *r.jobs)};
    const struct spb_pipe pipe = {read_batch, work_batch, take_batch, &r};
    *stats = (struct spb_face_stats){.kept = 0};
    spb_survey_init(&stats->survey);
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
