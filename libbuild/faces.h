/*
 * faces.h - faces become records: the pass that looks at every face once.
 */
#ifndef SPB_FACES_H
#define SPB_FACES_H

#include "distribute.h"
#include "corner_sort.h"
#include "vertex_cache.h"

enum { SPB_EDGE_BINS = 2304 };

struct spb_face_stats {
    uint64_t faces_in, split_extra;             /* as the source counts them */
    uint64_t kept;                              /* records made: the leaves to be */
    uint64_t bad_index, non_finite, degenerate; /* dropped, by reason */
    uint64_t edge_sum;              /* 0 when every directed edge meets its reverse, up to chance */
    double min[3], max[3];          /* of the records' corners, build coordinates */
    double file_min[3], file_max[3];            /* the same in file coordinates */
    double volume;                  /* 6 x signed volume, units; outward winding is positive */
    uint64_t edge_bins[SPB_EDGE_BINS];          /* shortest edges that are not 0, by exponent */
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

/* A short edge of the scan: the tenth percentile of the shortest edges, rounded down to a power
 * of two of its square; 0 when every edge is 0. Units. */
double spb_face_short_edge(const struct spb_face_stats *stats);

#endif
