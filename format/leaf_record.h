/*
 * leaf_record.h - the disks of leaves from their decoded triangles (spec section 6.5).
 *
 * Writers and readers run the same operations, in double and each correctly rounded, so in hybrid
 * archives leaves need not be stored. Triangles come in batches, their numbers side by side, for
 * vector units; a batch of one gives the same bytes.
 */
#ifndef SPC_LEAF_RECORD_H
#define SPC_LEAF_RECORD_H

#include "spc.h"

enum { LEAF_BATCH = 64 };

struct leaf_frame {
    int64_t origin[3];              /* cluster's origin as a lattice number, exact */
    double step;                    /* of positions, in lattice steps: a power of two */
    double scale;                   /* units per lattice step, a power of two */
};

/* False when the cluster's origin or the block's step do not fit the lattice. */
bool leaf_frame_init(struct leaf_frame *frame, const double origin[3], int step_exp,
                     int vertex_exp, int unit_exp);

struct leaf_batch {
    double corner[3][3][LEAF_BATCH];            /* in: [corner][axis], lattice, from the origin */
    int32_t position[3][LEAF_BATCH];            /* out: -1 where it does not fit 16 bits */
    int32_t normal[2][LEAF_BATCH];
    int32_t radius[LEAF_BATCH], e_self[LEAF_BATCH], height[LEAF_BATCH];
};

/* The first n <= LEAF_BATCH triangles. */
void leaf_batch_run(const struct leaf_frame *frame, struct leaf_batch *batch, uint32_t n);

/*
 * x, y, z, normal, e_self, radius and height of triangle i into record[16]; e_parent and link are
 * the caller's. False when the position does not fit.
 */
bool leaf_batch_store(const struct leaf_batch *batch, uint32_t i, uint8_t *record);

#endif
