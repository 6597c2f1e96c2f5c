/*
 * salvage.h - what was found of a damaged archive, and what was lost.
 *
 * How much there was is known only from what is whole: the header tells blocks and triangles, the
 * directory where each of them belongs.
 */
#ifndef SPB_SALVAGE_H
#define SPB_SALVAGE_H

#include "spc.h"

enum { SPB_LOST_MAX = 16 };         /* clusters named one by one; the others are counted */

struct spb_salvage {
    bool header, directory, meta;   /* whole */
    struct spc_error fault;         /* of the head; SPC_OK where it is whole */
    uint64_t blocks, blocks_of;     /* whole, and how many there were; of is 0 without a header */
    uint64_t blocks_foreign;        /* whole too, but of another archive: passed over */
    uint64_t triangles, triangles_of;
    uint64_t lost_clusters;         /* that lost triangles; known with a directory alone */
    struct spb_lost {
        uint32_t cluster;
        uint64_t triangles, triangles_of;
        double min[3], max[3];      /* of the whole cluster, file units */
    } lost[SPB_LOST_MAX];           /* the first of them */
};

#endif
