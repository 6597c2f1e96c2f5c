/*
 * detail.h - lattices of the vertices, by cells of space: finer where a scan is finer than elsewhere.
 *
 * One lattice, chosen by the tenth percentile of the edges, would make blocks and needles of an inset
 * that was scanned a hundred times more finely. A vertex is snapped by the cell that it lies in and by
 * nothing else, so all its triangles, in whatever cluster, have it at one place. Lattices are powers
 * of two, multiples of the finest, which is the archive's; where no cell is finer, nothing changes.
 */
#ifndef SPB_DETAIL_H
#define SPB_DETAIL_H

#include "plan.h"
#include "survey.h"

#define SPB_DETAIL_AUTO (-1.0)
enum { SPB_DETAIL_STEPS_LOG2 = 4 }; /* a face of 2^4 steps keeps its shape: corners move by 7/8 of one */

struct spb_detail_input {
    const struct spb_plan *plan;
    struct spb_tmpfile *file;       /* of the plan's records, which stay */
    struct spb_record_format format;
    const struct spb_survey *survey;
    double size;                    /* units: faces with a longest edge of at least that keep their
                                       shape; SPB_DETAIL_AUTO: those that are many where they are */
    unsigned threads;
    struct spb_progress *progress;
};

/*
 * Refines the space's lattice, which must have been chosen, and gives it a table of cells, *cells, the
 * caller's to free; NULL where one lattice does. A function of the faces alone, in no order. Reads them
 * once if any are small, else nothing.
 * fails  SPC_NO_MEMORY, SPC_IO, SPC_CANCELLED
 */
enum spc_status spb_detail_find(const struct spb_detail_input *in, struct spb_space *space,
                                uint8_t **cells, struct spc_error *err);

#endif
