#include "faces.h"

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

static void load_vertex(const struct spb_vertices *v, uint64_t i, double xyz[3])
{
    for (uint64_t a = 0; a < 3; a++)
        xyz[a] = v->wide ? ((const double *)v->xyz)[3 * i + a]
                         : (double)((const float *)v->xyz)[3 * i + a];
}

/* Counts a face that cannot be kept. */
static bool usable(const struct spb_vertices *v, const uint64_t corner[3], double xyz[3][3],
                   struct spb_face_stats *s)
{
    if (corner[0] >= v->count || corner[1] >= v->count || corner[2] >= v->count) {
        s->bad_index++;
        return false;
    }
    if (!v->archive &&              /* there distinct corners may have become one on the lattice */
        (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0])) {
        s->degenerate++;
        return false;
    }
    for (int k = 0; k < 3; k++) {
        load_vertex(v, corner[k], xyz[k]);
        if (!isfinite(xyz[k][0]) || !isfinite(xyz[k][1]) || !isfinite(xyz[k][2])) {
            s->non_finite++;
            return false;
        }
    }
    return true;
}

static void measure(const uint64_t name[3], const double xyz[3][3],
                    const struct spb_face *face, struct spb_face_stats *s)
{
    double shortest = HUGE_VAL, n[3];
    for (int k = 0; k < 3; k++) {
        double e[3];
        for (int a = 0; a < 3; a++) {
            s->min[a] = smaller_of(s->min[a], face->corner[k][a]);
            s->max[a] = larger_of(s->max[a], face->corner[k][a]);
            s->file_min[a] = smaller_of(s->file_min[a], xyz[k][a]);
            s->file_max[a] = larger_of(s->file_max[a], xyz[k][a]);
        }
        vec_sub(face->corner[(k + 1) % 3], face->corner[k], e);
        const double square = vec_dot(e, e);
        if (square > 0 && square < shortest)
            shortest = square;
        s->edge_sum += edge_hash(name[k], name[(k + 1) % 3]);
    }
    if (shortest < HUGE_VAL) {
        int exponent = 0;
        frexp(shortest, &exponent);
        const int bin = exponent + SPB_EDGE_BINS - 64;
        s->edge_bins[bin < 0 ? 0 : bin >= SPB_EDGE_BINS ? SPB_EDGE_BINS - 1 : bin]++;
    }
    vec_cross(face->corner[1], face->corner[2], n);
    s->volume += vec_dot(face->corner[0], n);
}

static enum spc_status take_batch(const struct spb_face_batch *batch, const struct spb_vertices *v,
                                  const struct spb_space *space, struct spb_distributor *out,
                                  struct spb_face_stats *s, struct spc_error *err)
{
    s->faces_in += batch->faces_in;
    s->split_extra += batch->split_extra;
    s->degenerate += batch->faces_short;
    for (size_t i = 0; i < batch->count; i++) {
        double xyz[3][3], key[3];
        uint64_t name[3];
        uint8_t rgba[3][4], record[96];
        struct spb_face face;
        if (!usable(v, batch->corner[i], xyz, s))
            continue;
        for (int k = 0; k < 3; k++)
            name[k] = corner_name(v, batch->corner[i][k], xyz[k]);
        for (int k = 0; k < 3 && v->colors; k++)
            memcpy(rgba[k], v->rgba[batch->corner[i][k]], 4);
        spb_record_store(&out->format, (const double(*)[3])xyz, (const uint8_t(*)[4])rgba, record);
        spb_record_load(&out->format, space, record, &face);
        measure(name, (const double(*)[3])xyz, &face, s);
        spb_face_key(&face, key);
        const enum spc_status status = spb_distributor_add(out, key, record, err);
        if (status != SPC_OK)
            return status;
        s->kept++;
    }
    return SPC_OK;
}

enum spc_status spb_faces_read(struct spb_source *source, const struct spb_vertices *vertices,
                               const struct spb_space *space, struct spb_distributor *out,
                               struct spb_face_stats *stats, struct spb_progress *progress,
                               struct spc_error *err)
{
    const uint64_t file_bytes = spb_source_info(source)->file_bytes;
    struct spb_face_batch *batch = malloc(sizeof *batch);
    *stats = (struct spb_face_stats){.kept = 0};
    for (int a = 0; a < 3; a++) {
        stats->min[a] = stats->file_min[a] = HUGE_VAL;
        stats->max[a] = stats->file_max[a] = -HUGE_VAL;
    }
    if (batch == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to read faces");
    enum spc_status status = spb_source_begin_faces(source, err);
    while (status == SPC_OK) {
        status = spb_source_faces(source, batch, err);
        if (status != SPC_OK)
            break;
        status = take_batch(batch, vertices, space, out, stats, err);
        if (batch->count == 0)
            break;
        if (status == SPC_OK && spb_progress_tell(progress, "read faces",
                                                  spb_source_bytes_done(source), file_bytes))
            status = spc_fail(err, SPC_CANCELLED, SPC_NO_OFF, "cancelled");
    }
    free(batch);
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
