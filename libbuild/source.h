/*
 * source.h - a scan as a stream of vertices and triangles, whatever its file format.
 *
 * One reader per format fills the same two batches. A source is read in two passes, each in file
 * order and in constant memory: first every vertex, then every face. The file may hold them in any
 * order: the reader seeks. Each pass may be started again.
 */
#ifndef SPB_SOURCE_H
#define SPB_SOURCE_H

#include "progress.h"
#include "salvage.h"
#include "tmpfile.h"

enum { SPB_BATCH_MAX = 4096 };          /* elements a batch; bounds the reader's memory */

#define SPB_BAD_INDEX UINT64_MAX        /* a corner that names no vertex (negative, say) */

struct spb_source_info {
    const char *format;                 /* "ply ascii", "ply le", "ply be", ... static */
    uint64_t vertex_count;              /* declared, or counted where the format declares none */
    uint64_t face_count;                /* so too, faces or strips; 0 when there are none */
    bool strips;                        /* face_count counts triangle strips */
    bool colors;                        /* vertices carry colour; alpha 255 where the file has none */
    bool corner_colors;                 /* corners of faces do: textures, materials; see colored */
    bool wide;                          /* coordinates need double: declared double or 32-bit int */
    bool normals;                       /* vertices carry normals; only where there are no faces */
    uint64_t file_bytes;
    bool by_place;                      /* vertices in one place are one, whatever their numbers */
    /*
     * An archive: its faces have been judged when it was built and are all kept, its vertices lie
     * on a lattice of 2^lattice_exp.
     */
    bool archive;
    int lattice_exp;
    const struct spb_salvage *salvage;  /* what was found, of a damaged archive; else NULL */
};

struct spb_vertex_batch {
    size_t count;                       /* 0: the pass is over */
    double xyz[SPB_BATCH_MAX][3];       /* file units, exactly as the file says; may be NaN or inf */
    uint8_t rgba[SPB_BATCH_MAX][4];     /* filled when info.colors */
    float normal[SPB_BATCH_MAX][3];     /* filled when info.normals; of any length, may be NaN or inf */
};

/*
 * Polygons arrive as fans of their first corner, strips as triangles with the winding of the
 * first; a polygon or strip may span batches. Accounting (I11):
 * faces_in + split_extra = triangles delivered + faces_short.
 */
struct spb_face_batch {
    size_t count;                       /* triangles; 0: the pass is over */
    uint64_t corner[SPB_BATCH_MAX][3];  /* vertex numbers, not yet checked; or SPB_BAD_INDEX */
    bool colored;                       /* corners have colours of their own: */
    uint8_t rgba[SPB_BATCH_MAX][3][4];  /* filled when colored; else those of the vertices count */
    uint64_t faces_in;                  /* faces, or triangles of strips, that begin in this batch */
    uint64_t split_extra;               /* triangles beyond the first of each face */
    uint64_t faces_short;               /* faces of fewer than three corners */
};

/* Records of its faces have colours. */
static inline bool spb_source_colored(const struct spb_source_info *info)
{
    return info->colors || info->corner_colors;
}

struct spb_source;

struct spb_source_options {             /* what a reader may use; zeros: nothing */
    const struct spb_progress *progress;        /* of opening, where that reads the file; cancels it */
    struct spb_temp *temp;              /* for what memory should not hold; lives as long as the source */
    const char *path;                   /* of the scan, beside which others lie; spb_source_open sets it */
};

/*
 * Opens path and reads its header; a format without one is read through, to count. options may be
 * NULL.
 *
 * fails  SPC_IO (cannot open or read), SPC_INPUT_FORMAT (no known format, or a header that makes
 *        no sense: what names the line), SPC_INPUT_TRUNCATED (the header has no end, or promises
 *        more than the file can hold), SPC_NO_MEMORY, SPC_CANCELLED
 */
enum spc_status spb_source_open(const char *path, const struct spb_source_options *options,
                                struct spb_source **out, struct spc_error *err);

/*
 * Opens a damaged archive, whatever its first bytes are: a source of the triangles that are left.
 * fails  as spb_spc_salvage of spc_source.h
 */
enum spc_status spb_source_salvage(const char *path, const struct spb_source_options *options,
                                   struct spb_source **out, struct spc_error *err);
void spb_source_close(struct spb_source *source);
const struct spb_source_info *spb_source_info(const struct spb_source *source);

/* Does it read that very file? */
struct stat;
bool spb_source_is_file(const struct spb_source *source, const struct stat *file);

/* Gives up buffers until a pass begins again: the one under way is over. */
void spb_source_pause(struct spb_source *source);

/* Start a pass over the vertices, or over the faces. fails SPC_IO, SPC_INPUT_* */
enum spc_status spb_source_begin_vertices(struct spb_source *source, struct spc_error *err);
enum spc_status spb_source_begin_faces(struct spb_source *source, struct spc_error *err);

/*
 * The next batch of the pass begun last. A batch with count 0 ends the pass; a face batch may have
 * count 0 only then.
 * fails  SPC_IO, SPC_INPUT_TRUNCATED (naming element and row), SPC_INPUT_FORMAT (a row that is no
 *        number, naming element and row), with at_off the byte where it is known
 */
enum spc_status spb_source_vertices(struct spb_source *source, struct spb_vertex_batch *out,
                                    struct spc_error *err);
enum spc_status spb_source_faces(struct spb_source *source, struct spb_face_batch *out,
                                 struct spc_error *err);

/* File bytes consumed in the pass under way, for progress. */
uint64_t spb_source_bytes_done(const struct spb_source *source);

/*
 * After both passes: what the reader passed over that a user may want to know, as one line (bytes
 * behind the last element, ascii rows with spare values), or "" when there is nothing.
 */
const char *spb_source_remark(const struct spb_source *source);

#endif
