/*
 * off_int.h - what the two files of the OFF reader share.
 *
 *   off_header.c  whether it is OFF; keyword, counts
 *   off.c         vertices, faces, remarks, the table
 */
#ifndef SPB_OFF_INT_H
#define SPB_OFF_INT_H

#include "off.h"
#include "text.h"

enum off_word { OFF_NONE, OFF_KEYWORD, OFF_HIGHER };    /* no keyword; of more than three dimensions */

struct off_kind {                       /* what the letters before OFF promise of a vertex */
    bool normals, colors, texture;
};

struct off {
    struct spb_text text;
    struct off_kind kind;
    uint64_t vertex_count, face_count;
    uint64_t vertex_off, face_off;
    int color_values;                   /* 3 or 4 a vertex; 0: none */
    double color_max;                   /* of the whole file */
    bool color_point;                   /* any with a point */
    double color_full;                  /* what stands for 255 */
    bool wide;

    bool looking;                       /* the pass of open */
    bool in_faces;                      /* the face pass */
    enum spc_status failed;             /* the pass under way has: nothing more comes from it */
    uint64_t row, row_off;              /* next, or under way */
    bool in_face;                       /* between two corners */
    uint64_t corners_left, run;         /* of it: to come, and seen */
    uint64_t first, last;               /* corners of it */
    uint64_t vertices_spare, vertices_wrapped;  /* rows, in the pass; see off.c */
    uint64_t faces_colored, faces_wrapped;
    uint64_t bytes_spare;               /* behind the last face */
    char remark[400];
};

/*
 * The keyword at p, up to the zero behind end; *kind is set for OFF_KEYWORD, *length for all but
 * OFF_NONE.
 */
enum off_word spb_off_keyword(const uint8_t *p, const uint8_t *end, struct off_kind *kind,
                              size_t *length);

bool spb_off_sniff(const uint8_t *head, size_t head_bytes, uint64_t file_bytes);

/* Reads keyword and counts; sets kind, counts, vertex_off. fails SPC_INPUT_*, SPC_IO */
enum spc_status spb_off_header_read(struct off *off, struct spc_error *err);

/* To the next value, over comments as well. fails SPC_IO */
static inline enum spc_status off_to_value(struct off *off, struct spc_error *err)
{
    for (;;) {
        bool spare = false;
        enum spc_status status = spb_text_to_value(&off->text, err);
        if (status != SPC_OK || spb_text_ended(&off->text) || *spb_text_at(&off->text) != '#')
            return status;
        off->text.wrapped = true;
        status = spb_text_pass_line(&off->text, &spare, err);
        if (status != SPC_OK)
            return status;
    }
}

#endif
