/*
 * faces.h - faces become records: the pass that looks at every face once.
 */
#ifndef SPB_FACES_H
#define SPB_FACES_H

#include "distribute.h"
#include "corner_sort.h"
#include "survey.h"
#include "vertex_cache.h"

struct spb_face_stats {
    uint64_t faces_in, split_extra;             /* as the source counts them */
    uint64_t kept;                              /* records made: the leaves to be */
    uint64_t bad_index, non_finite, degenerate; /* dropped, by reason */
    uint64_t edge_sum;              /* 0 when every directed edge meets its reverse, up to chance */
    struct spb_survey survey;
};

/*
 * Reads all faces of source, drops the unusable with their reason, and hands the rest to the
 * distributor as records of its format. Flushes the distributor. Vertices that are on disk come out
 * of the cache, or out of sorted corners.
 * fails  what source, cache or corners, and distributor fail with; SPC_CANCELLED
 */
struct spb_faces_input {
    struct spb_source *source;
    const struct spb_vertices *vertices;
    struct spb_vertex_cache *cache;             /* NULL: see corners */
    struct spb_corner_sort *corners;            /* NULL: vertices are in memory, or in the cache */
    const struct spb_space *space;
    unsigned threads;
    struct spb_progress *progress;
};
enum spc_status spb_faces_read(const struct spb_faces_input *in, struct spb_distributor *out,
                               struct spb_face_stats *stats, struct spc_error *err);

#endif
