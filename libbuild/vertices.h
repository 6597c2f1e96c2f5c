/*
 * vertices.h - the vertex table of one scan: in memory, or on disk where it is too large for that.
 */
#ifndef SPB_VERTICES_H
#define SPB_VERTICES_H

#include "progress.h"
#include "space.h"
#include "source.h"
#include "tmpfile.h"

enum { SPB_VERTEX_BYTES_MAX = 40 };

struct spb_vertices {
    uint64_t count;
    bool wide, colors, normals, by_place, archive;      /* as in spb_source_info */
    uint32_t bytes;                 /* of one: 3 floats or (wide) doubles, file units; 3 floats of
                                       normal, if any; 4 of colour, if any */
    uint8_t *table;                 /* [count][bytes], or NULL: on disk */
    struct spb_tmpfile *file;
    uint64_t off;                   /* of the table in the file, in one piece */
    double min[3], max[3];          /* of the finite vertices; min > max when there is none */
    uint64_t non_finite;
    bool beyond_float;              /* some coordinate is none that a float can hold */
};

/*
 * Reads all vertices of source, into memory when the table takes at most memory bytes.
 * fails  what the source fails with; SPC_NO_MEMORY; SPC_IO; SPC_CANCELLED
 */
enum spc_status spb_vertices_read(struct spb_source *source, struct spb_temp *temp, uint64_t memory,
                                  struct spb_progress *progress, struct spb_vertices *out,
                                  struct spc_error *err);
void spb_vertices_release(struct spb_vertices *vertices);

/* Bytes of one, as stored here. */
static inline uint32_t spb_vertex_bytes(const struct spb_source_info *info)
{
    return (info->wide ? 24u : 12u) + (info->normals ? 12u : 0u) + (info->colors ? 4u : 0u);
}

/* Of such faces the corners are looked up; others are dropped by their numbers alone. */
static inline bool spb_face_wanted(const struct spb_vertices *v, const uint64_t corner[3])
{
    return corner[0] < v->count && corner[1] < v->count && corner[2] < v->count &&
           (v->archive || (corner[0] != corner[1] && corner[1] != corner[2] &&
                           corner[2] != corner[0]));
}

/* The coordinates of one, from its bytes. */
void spb_vertex_load(const struct spb_vertices *vertices, const uint8_t *bytes, double xyz[3]);

/*
 * How many cells of a grid of 2^cells_log2 along the box's longest side hold vertices, by a sample
 * of them spread over the table. fails SPC_NO_MEMORY, SPC_IO
 */
enum spc_status spb_vertices_cells(const struct spb_vertices *vertices,
                                   const struct spb_space *space, int cells_log2, uint64_t *used,
                                   struct spc_error *err);

#endif
