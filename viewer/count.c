#include "count.h"

#include "interval.h"

#include <stdlib.h>

static void count_block(const struct spc_header *h, const struct spv_view *view,
                        const struct spc_block *b, const double eye[3], const uint8_t *nodes,
                        struct spv_count *out)
{
    const bool leaf = b->kind == SPC_BLOCK_LEAF;
    const bool triangles = leaf && (h->flags & SPC_FLAG_TRIANGLES) && view->mode != SPV_POINTS;
    const struct spv_interval in = {
        .origin = {(float)-eye[0], (float)-eye[1], (float)-eye[2]},
        .step = ldexpf(1, b->step_exp - h->unit_exp),
        .eps = (float)view->eps,
        .link_base = b->link_base,
        .lower = !leaf || triangles,
        .missing = -1,
    };
    out->nodes_processed += b->node_count;
    for (uint32_t i = 0; i < b->node_count; i++) {
        const uint8_t *record = nodes + (size_t)SPC_NODE_BYTES * i;
        if (view->mode == SPV_TRIANGLES) {
            out->triangles_drawn++;
            continue;
        }
        out->nodes_drawn += spv_interval_point(&in, record);
        out->triangles_drawn += triangles && spv_interval_triangle(&in, record);
    }
}

enum spc_status spv_count(const struct spc_reader *reader, const struct spv_view *view,
                          const struct spv_selection *selection, struct spv_count *out,
                          struct spc_error *err)
{
    const struct spc_header *h = spc_reader_header(reader);
    *out = (struct spv_count){.bytes_read = h->head_bytes + selection->bytes};
    for (uint32_t i = 0; i < selection->block_count; i++) {
        struct spc_block b;
        struct spc_cluster c;
        struct spc_block_layout l;
        double eye[3];
        spc_reader_block(reader, selection->blocks[i].block, &b);
        spc_reader_cluster(reader, b.cluster, &c);
        spv_eye_of_cluster(reader, &c, &view->camera, eye);
        spc_block_layout(&b, h->flags, h->normal_clusters, &l);
        uint8_t *payload = malloc(l.bytes);
        if (payload == NULL)
            return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to decode a block");
        const enum spc_status status =
            spc_block_decode(reader, selection->blocks[i].block, false, payload, err);
        if (status == SPC_OK)
            count_block(h, view, &b, eye, payload + l.nodes, out);
        free(payload);
        if (status != SPC_OK)
            return status;
    }
    return SPC_OK;
}
