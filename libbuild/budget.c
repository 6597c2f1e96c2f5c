#include "budget.h"

enum {
    FIXED_BYTES = 12 << 20,         /* code, libraries, stacks, what malloc loses */
    LISTS_A_FACE_SHIFT = 2,         /* a quarter byte: records of clusters, extents, plan */
    BYTES_A_FACE = 400,             /* a part: its records, keys and nodes */
    BYTES_A_NODE = 360,             /* packing a cluster */
    PART_FACES_MIN = 4096,
    PART_FACES_EVEN = 65536,        /* smaller parts are not worth a thread */
    PARTS_A_THREAD = 4,             /* keep the cores busy to the end */
    ARCHIVE_BYTES_A_FACE = 3,
};

static uint64_t at_least(uint64_t v, uint64_t least)
{
    return v > least ? v : least;
}

static uint64_t less(uint64_t v, uint64_t taken)
{
    return v > taken ? v - taken : 0;
}

static void make_parts(const struct spb_budget_input *in, uint64_t room, struct spb_budget *out)
{
    const uint64_t packing = (uint64_t)in->cluster_nodes * BYTES_A_NODE;
    const uint64_t smallest = packing + (uint64_t)PART_FACES_MIN * BYTES_A_FACE;
    out->waiting = room / 4;
    room -= out->waiting;
    out->threads = in->threads;
    if (out->threads > room / smallest)             /* even the smallest parts must fit */
        out->threads = (unsigned)at_least(room / smallest, 1);
    out->part_faces = less(room / out->threads, packing) / BYTES_A_FACE;
    const uint64_t even = at_least(in->faces / (PARTS_A_THREAD * (uint64_t)out->threads),
                                   PART_FACES_EVEN);
    out->part_faces = at_least(out->part_faces < even ? out->part_faces : even, PART_FACES_MIN);
}

void spb_budget_make(const struct spb_budget_input *in, struct spb_budget *out)
{
    const uint64_t lists = FIXED_BYTES + (in->faces >> LISTS_A_FACE_SHIFT);
    const uint64_t room = at_least(less(in->memory, lists), in->memory / 4);
    const uint64_t table = in->vertices * in->vertex_bytes;
    *out = (struct spb_budget){.table = room / 2};
    const bool on_disk = table > out->table;
    out->buffers = on_disk ? room / 2 : room - table;
    out->buffers = out->buffers / 8 * 7;            /* batches of faces on their way */
    make_parts(in, room, out);
    out->temp = in->faces * in->record_bytes + (on_disk ? in->faces * 3 * in->vertex_bytes : 0);
    out->output = in->faces * ARCHIVE_BYTES_A_FACE;
}
