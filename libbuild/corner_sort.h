/*
 * corner_sort.h - the corners of faces whose vertex table lies on disk, without random access to it.
 *
 * The table is cut into slices that fit memory. One pass over the faces writes, for every slice,
 * which of its vertices corners ask for, in the order of the faces. Then slice after slice is
 * loaded and what is asked for is written behind each other. A second pass over the faces meets
 * the same corners in the same order and takes, for each, what comes next of its slice. Everything
 * is read and written in long pieces, however the faces refer to vertices.
 */
#ifndef SPB_CORNER_SORT_H
#define SPB_CORNER_SORT_H

#include "spill.h"
#include "vertices.h"

struct spb_corner_sort;

/*
 * Reads all faces of source once and prepares the second pass. vertices are on disk. memory bounds
 * the buffers and the slice; slice_log2 > 0 sets the vertices a slice to its power of two instead
 * (tests).
 * fails  what the source fails with; SPC_IO, SPC_NO_MEMORY, SPC_CANCELLED
 */
enum spc_status spb_corner_sort_create(struct spb_source *source,
                                       const struct spb_vertices *vertices, struct spb_temp *temp,
                                       uint64_t memory, int slice_log2, unsigned threads,
                                       struct spb_progress *progress,
                                       struct spb_corner_sort **out, struct spc_error *err);
void spb_corner_sort_free(struct spb_corner_sort *sort);

/* Starts a pass over the corners; may be done again. */
void spb_corner_sort_begin(struct spb_corner_sort *sort);

/* The vertex of the next corner, whose number it must be. fails SPC_IO; SPC_INTERNAL (the scan changed) */
enum spc_status spb_corner_sort_next(struct spb_corner_sort *sort, uint64_t corner, uint8_t *vertex,
                                     struct spc_error *err);

#endif
