#include "budget.h"

#include "pack.h"
#include "points.h"
#include "tree.h"

enum {
    FIXED_BYTES = 12 << 20,         /* code, libraries, what malloc loses */
    FACES_AN_EXTENT_BYTE = 8,       /* lists of extents, and the plan */
    LIST_A_CLUSTER = 1200,          /* until the archive is written, its directory included */
    LIST_A_BLOCK = 250,             /* likewise */
    PART_BYTES_A_FACE = 32 + 3 * (int)sizeof(struct spb_node) / 2,      /* beside the record: keys, nodes */
    PACKING_A_NODE = 520,           /* scratch.h, and the coder's payload */
    PACKING_FIXED = 5 << 20,        /* a thread: zstd's tables, its heap with what that loses, its stack */
    TREES_A_JOIN = 5,               /* four children, and the one that is read or kept */
    WAITING_TREES = 36,             /* three siblings a level of a plan of 12 levels */
    PART_FACES_MIN = 1024,
    PART_FACES_EVEN = 65536,        /* smaller parts are not worth a thread */
    PARTS_A_THREAD = 4,             /* keep the cores busy to the end */
    ARCHIVE_BYTES_A_FACE = 3,
};

_Static_assert((int)PACKING_FIXED >= (int)SPB_POINTS_A_THREAD, "estimating points takes what packing does");

static uint64_t at_least(uint64_t v, uint64_t least)
{
    return v > least ? v : least;
}

static uint64_t at_most(uint64_t v, uint64_t most)
{
    return v < most ? v : most;
}

static uint64_t less(uint64_t v, uint64_t taken)
{
    return v > taken ? v - taken : 0;
}

/* A join and a part a thread are sure; the rest is shared out. */
static void make_parts(const struct spb_budget_input *in, uint64_t lists, struct spb_budget *out)
{
    const uint64_t triangles = at_least(in->faces, 2 * in->vertices);    /* of polygons, about */
    const uint64_t nodes = at_most(in->cluster_nodes, triangles * 3 / 2 + 1);
    const uint64_t join = TREES_A_JOIN * nodes * (sizeof(struct spb_node) + in->record_bytes * 3 / 4);
    const uint64_t packing = nodes * PACKING_A_NODE + PACKING_FIXED;
    const uint64_t face = (in->points ? at_least(PART_BYTES_A_FACE, SPB_POINT_BYTES) : PART_BYTES_A_FACE) +
                          in->record_bytes;
    const uint64_t smallest = packing + PART_FACES_MIN * face;
    out->least = lists + join + smallest;
    uint64_t room = at_least(less(in->memory, lists + join), smallest);
    out->waiting = at_most((room - smallest) / 3, WAITING_TREES * join / TREES_A_JOIN);
    out->joins = (unsigned)at_most(1 + out->waiting / join, in->threads);
    room -= out->waiting + (out->joins - 1) * join;
    out->threads = (unsigned)at_least(at_most(in->threads, room / smallest), 1);
    const uint64_t even = at_least(in->faces / (PARTS_A_THREAD * (uint64_t)out->threads),
                                   PART_FACES_EVEN);
    out->part_faces = at_least(at_most(less(room / out->threads, packing) / face, even), PART_FACES_MIN);
}

/* Clusters and blocks are half full or fuller, mostly: 1.5 nodes a face make 2.5 nodes' room. */
static uint64_t list_bytes(const struct spb_budget_input *in)
{
    const uint64_t room = in->faces * 5 / 2;
    const uint64_t points = in->points ? spb_points_lists(in->faces) : 0;
    return FIXED_BYTES + points + in->faces / FACES_AN_EXTENT_BYTE + room / in->cluster_nodes * LIST_A_CLUSTER +
           (room / at_most(in->cluster_nodes, in->block_nodes) +
            room / in->cluster_nodes * spb_pack_bands(in->cluster_nodes)) * LIST_A_BLOCK;
}

void spb_budget_make(const struct spb_budget_input *in, struct spb_budget *out)
{
    const uint64_t lists = list_bytes(in);
    const uint64_t room = at_least(less(in->memory, lists), in->memory / 4);
    const uint64_t table = in->vertices * in->vertex_bytes;
    *out = (struct spb_budget){.table = room / 2};
    const bool on_disk = table > out->table;
    out->buffers = on_disk ? room / 2 : room - table;
    out->buffers = out->buffers / 8 * 7;            /* batches of faces on their way */
    make_parts(in, lists, out);
    /* Points are written a second time while not all that was read has been given back. */
    out->temp = in->faces * in->record_bytes * (in->points ? 2 : 1) + (on_disk ? table : 0);
    out->sort = in->faces * 3 * in->vertex_bytes;
    out->output = in->faces * ARCHIVE_BYTES_A_FACE;
}
