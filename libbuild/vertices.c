#include "vertices.h"

#include "bytes.h"

#include <math.h>
#include <stdlib.h>

static void widen(struct spb_vertices *v, const double p[3])
{
    if (!isfinite(p[0]) || !isfinite(p[1]) || !isfinite(p[2])) {
        v->non_finite++;
        return;
    }
    for (int a = 0; a < 3; a++) {
        v->min[a] = p[a] < v->min[a] ? p[a] : v->min[a];
        v->max[a] = p[a] > v->max[a] ? p[a] : v->max[a];
    }
}

static enum spc_status allocate(struct spb_vertices *v, struct spc_error *err)
{
    uint64_t xyz_bytes = 0, rgba_bytes = 0;
    if (!mul_ok(v->count, v->wide ? 24 : 12, &xyz_bytes) || !mul_ok(v->count, 4, &rgba_bytes) ||
        xyz_bytes > SIZE_MAX / 2)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "too many vertices for this machine");
    v->xyz = malloc((size_t)xyz_bytes + 1);
    if (v->colors)
        v->rgba = malloc((size_t)rgba_bytes + 1);
    if (v->xyz == NULL || (v->colors && v->rgba == NULL))
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF,
                        "no memory for the vertex table of %llu MB",
                        (unsigned long long)((xyz_bytes + (v->colors ? rgba_bytes : 0)) >> 20));
    return SPC_OK;
}

static enum spc_status read_all(struct spb_source *source, struct spb_progress *progress,
                                struct spb_vertices *v, struct spb_vertex_batch *batch,
                                struct spc_error *err)
{
    const uint64_t file_bytes = spb_source_info(source)->file_bytes;
    uint64_t at = 0;
    enum spc_status status = spb_source_begin_vertices(source, err);
    while (status == SPC_OK) {
        status = spb_source_vertices(source, batch, err);
        if (status != SPC_OK || batch->count == 0)
            break;
        if (batch->count > v->count - at)
            return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "more vertices than declared");
        for (size_t i = 0; i < batch->count; i++, at++) {
            widen(v, batch->xyz[i]);
            for (int a = 0; a < 3; a++)
                if (v->wide)
                    ((double *)v->xyz)[3 * at + (uint64_t)a] = batch->xyz[i][a];
                else
                    ((float *)v->xyz)[3 * at + (uint64_t)a] = (float)batch->xyz[i][a];
            if (v->colors)
                memcpy(v->rgba[at], batch->rgba[i], 4);
        }
        if (spb_progress_tell(progress, "read vertices", spb_source_bytes_done(source), file_bytes))
            return spc_fail(err, SPC_CANCELLED, SPC_NO_OFF, "cancelled");
    }
    if (status == SPC_OK && at != v->count)
        status = spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "fewer vertices than declared");
    return status;
}

enum spc_status spb_vertices_read(struct spb_source *source, struct spb_progress *progress,
                                  struct spb_vertices *out, struct spc_error *err)
{
    const struct spb_source_info *info = spb_source_info(source);
    *out = (struct spb_vertices){.count = info->vertex_count, .wide = info->wide,
                                 .colors = info->colors, .archive = info->archive};
    for (int a = 0; a < 3; a++) {
        out->min[a] = INFINITY;
        out->max[a] = -INFINITY;
    }
    struct spb_vertex_batch *batch = malloc(sizeof *batch);
    enum spc_status status = batch ? allocate(out, err)
                                   : spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to read");
    if (status == SPC_OK)
        status = read_all(source, progress, out, batch, err);
    free(batch);
    if (status != SPC_OK)
        spb_vertices_release(out);
    return status;
}

void spb_vertices_release(struct spb_vertices *vertices)
{
    free(vertices->xyz);
    free(vertices->rgba);
    *vertices = (struct spb_vertices){0};
}
