/*
 * points.h - points without faces: each becomes a disk, by what is nearest to it.
 *
 * Two steps, around plan.h: spb_points_read gives the vertices to the distributor, spb_points_estimate
 * looks, part by part, for the nearest places of each point, also in other parts, and writes what it
 * finds into the records. The same whatever the parts are (knn.h).
 */
#ifndef SPB_POINTS_H
#define SPB_POINTS_H

#include "plan.h"
#include "survey.h"
#include "vertices.h"

/* Bytes that estimating takes: for a point of a part that is under way, beside its record, and for a thread. */
enum { SPB_POINT_BYTES = 2 * 32 + 2 * 64, SPB_POINTS_A_THREAD = 4 << 20 };

/* Bytes of lists for so many points of all parts. */
static inline uint64_t spb_points_lists(uint64_t points)
{
    return points / 8;
}

/*
 * All finite vertices as records to the distributor, which it flushes. Others are counted by the table.
 * fails  as vertices and the distributor do; SPC_CANCELLED
 */
enum spc_status spb_points_read(const struct spb_vertices *vertices, const struct spb_space *space,
                                struct spb_distributor *out, struct spb_progress *progress,
                                struct spc_error *err);

struct spb_points_input {
    struct spb_tmpfile *file;       /* of the plan's records */
    const struct spb_space *space;
    struct spb_record_format format;
    bool normals;                   /* records have them already */
    unsigned threads;
    struct spb_progress *progress;
};

/*
 * Fills in the normals and radii of the records of all parts, whose order becomes that of a k-d tree, and
 * counts the triangles' edges.
 * fails  SPC_NO_MEMORY, SPC_IO, SPC_CANCELLED
 */
enum spc_status spb_points_estimate(struct spb_plan *plan, const struct spb_points_input *in,
                                    struct spb_survey *survey, struct spc_error *err);

#endif
