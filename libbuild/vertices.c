#include "vertices.h"

#include "bytes.h"
#include "vec.h"

#include <math.h>
#include <stdlib.h>

static void widen(struct spb_vertices *v, const double p[3])
{
    if (!isfinite(p[0]) || !isfinite(p[1]) || !isfinite(p[2])) {
        v->non_finite++;
        return;
    }
    for (int a = 0; a < 3; a++) {
        v->min[a] = smaller_of(p[a], v->min[a]);
        v->max[a] = larger_of(p[a], v->max[a]);
    }
}

static void store(const struct spb_vertices *v, const struct spb_vertex_batch *batch, size_t i,
                  uint8_t *out)
{
    const double *xyz = batch->xyz[i];
    if (v->wide) {
        memcpy(out, xyz, 24);
    } else {
        const float narrow[3] = {(float)xyz[0], (float)xyz[1], (float)xyz[2]};
        memcpy(out, narrow, 12);
    }
    if (v->normals)
        memcpy(out + (v->wide ? 24 : 12), batch->normal[i], 12);
    if (v->colors)
        memcpy(out + v->bytes - 4, batch->rgba[i], 4);
}

void spb_vertex_load(const struct spb_vertices *v, const uint8_t *bytes, double xyz[3])
{
    float narrow[3];
    if (v->wide) {
        memcpy(xyz, bytes, 24);
        return;
    }
    memcpy(narrow, bytes, 12);
    for (int a = 0; a < 3; a++)
        xyz[a] = (double)narrow[a];
}

struct reading {
    struct spb_vertices *v;
    struct spb_vertex_batch batch;
    uint8_t packed[SPB_BATCH_MAX * SPB_VERTEX_BYTES_MAX];         /* of a batch, on its way to disk */
};

/* One batch to its place; batches are appended by one thread, so the table is one piece. */
static enum spc_status place(struct reading *r, uint64_t at, struct spc_error *err)
{
    struct spb_vertices *v = r->v;
    const struct spb_vertex_batch *batch = &r->batch;
    uint8_t *out = v->table ? v->table + at * v->bytes : r->packed;
    uint64_t off;
    for (size_t i = 0; i < batch->count; i++) {
        widen(v, batch->xyz[i]);
        store(v, batch, i, out + i * v->bytes);
        for (int a = 0; a < 3 && v->wide && !v->beyond_float; a++)
            v->beyond_float = batch->xyz[i][a] != (double)(float)batch->xyz[i][a];
    }
    if (v->table != NULL)
        return SPC_OK;
    const enum spc_status status =
        spb_tmpfile_append(v->file, r->packed, batch->count * v->bytes, &off, err);
    if (at == 0)
        v->off = off;
    return status;
}

static enum spc_status read_all(struct spb_source *source, struct spb_progress *progress,
                                struct reading *r, struct spc_error *err)
{
    const uint64_t file_bytes = spb_source_info(source)->file_bytes;
    uint64_t at = 0;
    enum spc_status status = spb_source_begin_vertices(source, err);
    while (status == SPC_OK) {
        status = spb_source_vertices(source, &r->batch, err);
        if (status != SPC_OK || r->batch.count == 0)
            break;
        if (r->batch.count > r->v->count - at)
            return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "more vertices than declared");
        status = place(r, at, err);
        at += r->batch.count;
        if (status == SPC_OK &&
            spb_progress_tell(progress, "read vertices", spb_source_bytes_done(source), file_bytes))
            status = spc_fail(err, SPC_CANCELLED, SPC_NO_OFF, "cancelled");
    }
    if (status == SPC_OK && at != r->v->count)
        status = spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "fewer vertices than declared");
    return status;
}

static enum spc_status make_room(struct spb_vertices *v, struct spb_temp *temp, uint64_t memory,
                                 struct spc_error *err)
{
    uint64_t bytes = 0;
    if (!mul_ok(v->count, v->bytes, &bytes) || bytes > INT64_MAX)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "too many vertices for this machine");
    if (bytes > memory)
        return spb_tmpfile_create(temp, &v->file, err);
    v->table = malloc((size_t)bytes + 1);
    return v->table ? SPC_OK
                    : spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF,
                               "no memory for the vertex table of %llu MB",
                               (unsigned long long)(bytes >> 20));
}

enum spc_status spb_vertices_read(struct spb_source *source, struct spb_temp *temp, uint64_t memory,
                                  struct spb_progress *progress, struct spb_vertices *out,
                                  struct spc_error *err)
{
    const struct spb_source_info *info = spb_source_info(source);
    *out = (struct spb_vertices){.count = info->vertex_count, .wide = info->wide,
                                 .colors = info->colors, .normals = info->normals,
                                 .by_place = info->by_place, .archive = info->archive,
                                 .bytes = spb_vertex_bytes(info)};
    for (int a = 0; a < 3; a++) {
        out->min[a] = INFINITY;
        out->max[a] = -INFINITY;
    }
    struct reading *r = malloc(sizeof *r);
    enum spc_status status = r ? make_room(out, temp, memory, err)
                               : spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to read");
    if (status == SPC_OK) {
        r->v = out;
        status = read_all(source, progress, r, err);
    }
    free(r);
    if (status != SPC_OK)
        spb_vertices_release(out);
    return status;
}

void spb_vertices_release(struct spb_vertices *vertices)
{
    free(vertices->table);
    spb_tmpfile_free(vertices->file);
    *vertices = (struct spb_vertices){0};
}

/* ---- where they are ------------------------------------------------------------------------------ */

enum { PIECE = 1024, PIECES_MOST = 1024 };      /* of the sample: a million vertices */

static size_t cell_of(const struct spb_space *space, int cells_log2, const double xyz[3])
{
    const double most = times_exp2(1, cells_log2) - 1;
    size_t cell = 0;
    for (int a = 0; a < 3; a++) {
        const double k = floor(times_exp2(spb_space_from_file(space, a, xyz[a]), cells_log2));
        cell = cell << cells_log2 | (size_t)(k > 0 ? smaller_of(k, most) : 0);
    }
    return cell;
}

static void mark(const struct spb_vertices *v, const struct spb_space *space, int cells_log2,
                 const uint8_t *vertices, uint64_t count, uint8_t *marked, uint64_t *used)
{
    for (uint64_t i = 0; i < count; i++) {
        double xyz[3];
        spb_vertex_load(v, vertices + i * v->bytes, xyz);
        if (!isfinite(xyz[0]) || !isfinite(xyz[1]) || !isfinite(xyz[2]))
            continue;
        const size_t cell = cell_of(space, cells_log2, xyz);
        *used += !marked[cell];
        marked[cell] = 1;
    }
}

enum spc_status spb_vertices_cells(const struct spb_vertices *v, const struct spb_space *space,
                                   int cells_log2, uint64_t *used, struct spc_error *err)
{
    const uint64_t pieces = (v->count + PIECE - 1) / PIECE;
    const uint64_t stride = (pieces + PIECES_MOST - 1) / PIECES_MOST;
    uint8_t *marked = calloc((size_t)1 << 3 * cells_log2, 1);
    uint8_t *piece = malloc((size_t)PIECE * v->bytes);
    enum spc_status status = SPC_OK;
    *used = 0;
    if (marked == NULL || piece == NULL)
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to look at the vertices");
    for (uint64_t p = 0; p < pieces && status == SPC_OK; p += stride) {
        const uint64_t first = p * PIECE;
        const uint64_t count = v->count - first < PIECE ? v->count - first : PIECE;
        if (v->table == NULL)
            status = spb_tmpfile_read(v->file, v->off + first * v->bytes, piece,
                                      (size_t)(count * v->bytes), err);
        if (status == SPC_OK)
            mark(v, space, cells_log2, v->table ? v->table + first * v->bytes : piece, count, marked,
                 used);
    }
    free(marked);
    free(piece);
    return status;
}
