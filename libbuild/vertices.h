/*
 * vertices.h - the vertex table of one scan, for gathering the corners of faces.
 */
#ifndef SPB_VERTICES_H
#define SPB_VERTICES_H

#include "progress.h"
#include "source.h"

struct spb_vertices {
    uint64_t count;
    bool wide, colors, archive;     /* as in spb_source_info */
    void *xyz;                      /* float or (wide) double [count][3], file units */
    uint8_t (*rgba)[4];             /* [count], NULL without colors */
    double min[3], max[3];          /* of the finite vertices; min > max when there is none */
    uint64_t non_finite;
};

/*
 * Reads all vertices of source into memory.
 * fails  what the source fails with; SPC_NO_MEMORY; SPC_CANCELLED
 */
enum spc_status spb_vertices_read(struct spb_source *source, struct spb_progress *progress,
                                  struct spb_vertices *out, struct spc_error *err);
void spb_vertices_release(struct spb_vertices *vertices);

#endif
