/*
 * gather.h - the corners of faces whose vertex table lies on disk, without random access to it.
 *
 * The table is cut into slices that fit memory. One pass over the faces writes, for every slice,
 * which of its vertices corners ask for, in the order of the faces. Then slice after slice is
 * loaded and what is asked for is written behind each other. A second pass over the faces meets
 * the same corners in the same order and takes, for each, what comes next of its slice. Everything
 * is read and written in long pieces, however the faces refer to vertices.
 */
#ifndef SPB_GATHER_H
#define SPB_GATHER_H

#include "spill.h"
#include "vertices.h"

struct spb_gather;

/*
 * Reads all faces of source once and prepares the second pass. vertices are on disk, and are
 * released. memory bounds the buffers and the slice; slice_log2 > 0 sets the vertices a slice to
 * its power of two instead (tests).
 * fails  what the source fails with; SPC_IO, SPC_NO_MEMORY, SPC_CANCELLED
 */
enum spc_status spb_gather_create(struct spb_source *source, struct spb_vertices *vertices,
                                  struct spb_temp *temp, uint64_t memory, int slice_log2,
                                  unsigned threads, struct spb_progress *progress,
                                  struct spb_gather **out, struct spc_error *err);
void spb_gather_free(struct spb_gather *gather);

/* Starts a pass over the corners; may be done again. */
void spb_gather_begin(struct spb_gather *gather);

/* The vertex of the next corner, whose number it must be. fails SPC_IO */
enum spc_status spb_gather_next(struct spb_gather *gather, uint64_t corner, uint8_t *vertex,
                                struct spc_error *err);

/* Of such faces the corners are gathered; others will be dropped by their numbers alone. */
static inline bool spb_face_wanted(const struct spb_vertices *v, const uint64_t corner[3])
{
    return corner[0] < v->count && corner[1] < v->count && corner[2] < v->count &&
           (v->archive || (corner[0] != corner[1] && corner[1] != corner[2] &&
                           corner[2] != corner[0]));
}

#endif
