/*
 * stl_int.h - what the three files of the STL reader share.
 *
 *   stl.c         which kind it is, binary facets, the face pass, remarks, the table
 *   stl_color.c   whether a binary file's attribute words are colours, and which
 *   stl_ascii.c   facets from text
 */
#ifndef SPB_STL_INT_H
#define SPB_STL_INT_H

#include "bytes.h"
#include "stl.h"
#include "text.h"

enum {
    STL_NAME_BYTES = 80,                /* binary: a header of anything, */
    STL_HEADER_BYTES = 84,              /* a count, */
    STL_FACET_BYTES = 50,               /* and facets: normal, three corners, */
    STL_CORNERS_OFF = 12,
    STL_WORD_OFF = 48,                  /* attribute word */
    STL_BATCH_FACETS = SPB_BATCH_MAX / 3
};

enum stl_colors { STL_PLAIN, STL_VISCAM, STL_MAGICS };

struct stl {
    struct spb_bytes *bytes;
    bool ascii;
    uint64_t count;                     /* facets */
    uint64_t next;                      /* of the pass under way */
    bool in_faces;                      /* that pass */
    enum spc_status failed;             /* it has: nothing more comes from it */

    enum stl_colors colors;
    uint8_t plain[4];                   /* of facets without a colour of their own */
    bool all_plain;                     /* there are no others */
    uint32_t declared;                  /* binary */
    uint64_t bytes_spare;               /* binary: behind the last facet */

    struct spb_text text;
    bool in_solid;
    bool wide;                          /* ascii, found by counting, as what follows */
    bool end_missing;
    uint64_t lines, lines_outside;      /* passed over in this pass; in the file */
    char remark[400];
};

/* ---- stl_ascii.c ---------------------------------------------------------------------------- */

/*
 * Reads the text once: sets count, wide and what is remarked.
 * fails  SPC_INPUT_FORMAT, SPC_INPUT_TRUNCATED, naming the facet; SPC_IO, SPC_CANCELLED
 */
enum spc_status spb_stl_ascii_count(struct stl *stl, const struct spb_progress *progress,
                                    struct spc_error *err);
void spb_stl_ascii_begin(struct stl *stl);
enum spc_status spb_stl_ascii_vertices(struct stl *stl, struct spb_vertex_batch *out,
                                       struct spc_error *err);

/* ---- stl_color.c ---------------------------------------------------------------------------- */

/* Sets colors, plain and all_plain of a binary file. fails SPC_IO */
enum spc_status spb_stl_look_at_colors(struct stl *stl, struct spc_error *err);
void spb_stl_color(const struct stl *stl, unsigned word, uint8_t rgba[4]);

#endif
