/*
 * ply_int.h - what the four files of the PLY reader share.
 *
 *   ply_header.c  the header: elements, properties, what is wanted of them, whether it can be true
 *   ply_ascii.c   values, rows and batches from text
 *   ply_binary.c  the same from bytes
 *   ply.c         elements in any order, polygons and strips to triangles, remarks, the table
 */
#ifndef SPB_PLY_INT_H
#define SPB_PLY_INT_H

#include "bytes.h"
#include "ply.h"
#include "text.h"

enum {
    PLY_HEADER_BYTES_MAX = 1 << 20,
    PLY_LINE_MAX = 1023,                /* longer lines only as comment or obj_info */
    PLY_ELEMENT_MAX = 256,
    PLY_PROPERTY_MAX = 4096,
    PLY_NAME_MAX = 31,                  /* characters of an element's name that are kept */
    PLY_ITEMS_MAX = 512                 /* list values taken at a time */
};

enum ply_type {                         /* 0 in ply_property.count_type: not a list */
    PLY_NO_TYPE, PLY_I8, PLY_U8, PLY_I16, PLY_U16, PLY_I32, PLY_U32, PLY_F32, PLY_F64
};

enum ply_role {                         /* what a vertex property is good for */
    PLY_X, PLY_Y, PLY_Z, PLY_RED, PLY_GREEN, PLY_BLUE, PLY_ALPHA, PLY_NX, PLY_NY, PLY_NZ, PLY_ROLE_COUNT,
    PLY_NO_ROLE = PLY_ROLE_COUNT
};

enum ply_kind { PLY_OTHER, PLY_VERTEX, PLY_FACES, PLY_STRIPS };

struct ply_property {
    uint8_t type, count_type, role;
};

struct ply_element {
    char name[PLY_NAME_MAX + 1];        /* printable */
    enum ply_kind kind;
    uint64_t count;
    uint32_t property_first, property_count, list_count;
    uint32_t index_property;            /* faces, strips: the list of vertex numbers */
    uint32_t row_bytes;                 /* least; binary: of a row whose lists are empty */
    uint64_t rows_spare, rows_wrapped;  /* ascii, found when last read: see ply_ascii.c */
};

struct ply_channel {                    /* a vertex property in a binary row of fixed size */
    uint8_t type;                       /* PLY_NO_TYPE: not there */
    uint32_t off;
};

#define PLY_NO_ELEMENT UINT32_MAX

struct ply_header {
    bool format_known, ascii, big_endian;
    uint32_t element_count, property_count;
    uint32_t vertex, faces, strips;     /* elements, or PLY_NO_ELEMENT */
    bool colors;
    bool normals;                       /* roles are given to them only where there are no faces */
    bool faces_unread;                  /* a face or strip element without a list to read */
    uint64_t body_off;
    uint64_t unknown_count;             /* lines that begin with no keyword of PLY */
    char unknown[PLY_NAME_MAX + 1];     /* first word of the first of them */
    struct ply_channel channel[PLY_ROLE_COUNT];
    struct ply_element element[PLY_ELEMENT_MAX];
    struct ply_property property[PLY_PROPERTY_MAX];
};

struct ply {
    struct spb_bytes *bytes;
    struct ply_header header;
    uint64_t element_off[PLY_ELEMENT_MAX + 1];  /* SPC_NO_OFF: not yet known; last: end of all */

    enum spc_status failed;             /* the pass has: nothing more comes from it */
    struct ply_element *element;        /* being read; NULL: none */
    uint64_t row;                       /* of it: next, or under way */
    uint64_t row_off;                   /* ascii: where that row began */
    uint64_t pass_off, pass_bytes;      /* start in this element; done in elements before it */

    struct spb_text text;               /* ascii; wrapped: the row under way goes over a line end */
    bool in_list;                       /* between two values of a face's or strip's list */
    uint64_t list_left;                 /* values of it still to come */
    uint64_t run;                       /* values of the polygon, or of the strip's run, so far */
    uint64_t back[2];                   /* polygon: first and last corner; strip: last two */

    bool color_looking, color_known;    /* the first vertex pass looks what full colour is: */
    double color_max[2];                /* largest red, green or blue: 16-bit, real */
    double color_full[2];               /* what stands for 255 */
    bool end_seen;
    uint64_t bytes_spare;               /* behind the last element */
    char remark[400];
};

/* ---- ply_header.c --------------------------------------------------------------------------- */

/*
 * Reads the header from the file's start; bytes then stands on the body's first byte.
 *
 * fails  SPC_INPUT_FORMAT naming the line; SPC_INPUT_TRUNCATED (no end, or rows that cannot fit
 *        the file); SPC_IO
 */
enum spc_status spb_ply_header_read(struct spb_bytes *bytes, struct ply_header *header,
                                    struct spc_error *err);

/* Bytes of a value; 0 for PLY_NO_TYPE. */
static inline uint32_t ply_type_bytes(unsigned type)
{
    static const uint8_t bytes[] = { 0, 1, 1, 2, 2, 4, 4, 4, 8 };
    return bytes[type];
}

/* ---- ply.c ---------------------------------------------------------------------------------- */

/* "face 7 of 12" and what is wrong with it, as one error. */
enum spc_status spb_ply_fail_row(const struct ply *ply, enum spc_status status, uint64_t at_off,
                                 struct spc_error *err, const char *fmt, ...)
    __attribute__((format(printf, 5, 6)));

/* The file ends before ply->row (or, begun, inside it). */
enum spc_status spb_ply_fail_end(const struct ply *ply, bool begun, struct spc_error *err);

/* A list of count values, count_type read at at_off, cannot be in this file: says why. */
enum spc_status spb_ply_fail_list(const struct ply *ply, uint64_t at_off, uint64_t count,
                                  struct spc_error *err);

/*
 * 0..255 from a colour property of the given type and role. Bytes are what they are. Of 16-bit and
 * real colours writers disagree what full is: 65535 or 255, 1 or 255 or 65535. The largest red,
 * green or blue of the file tells; the first pass reads the vertices twice to know it.
 */
uint8_t spb_ply_color(struct ply *ply, unsigned type, unsigned role, double value);

/* ---- ply_ascii.c, ply_binary.c: rows of ply->element ---------------------------------------- */

/*
 * Both files offer the same five steps: begin a row, read a list's count, read count list values
 * as vertex numbers (SPB_NOT_WHOLE where they are none), pass over one property, end a row. The
 * sixth reads a batch of vertices, which is where speed matters.
 *
 * fails  SPC_INPUT_TRUNCATED, SPC_INPUT_FORMAT, SPC_IO
 */
enum spc_status spb_ply_ascii_row_begin(struct ply *ply, struct spc_error *err);
enum spc_status spb_ply_ascii_list_count(struct ply *ply, const struct ply_property *property,
                                         uint64_t *count, struct spc_error *err);
enum spc_status spb_ply_ascii_items(struct ply *ply, const struct ply_property *property,
                                    size_t count, int64_t *items, struct spc_error *err);
enum spc_status spb_ply_ascii_pass(struct ply *ply, const struct ply_property *property,
                                   struct spc_error *err);
enum spc_status spb_ply_ascii_row_end(struct ply *ply, struct spc_error *err);
enum spc_status spb_ply_ascii_vertices(struct ply *ply, struct spb_vertex_batch *out,
                                       struct spc_error *err);
/* Sets bytes_spare: what follows that is no blank. fails SPC_IO */
enum spc_status spb_ply_ascii_rest(struct ply *ply, struct spc_error *err);

enum spc_status spb_ply_binary_row_begin(struct ply *ply, struct spc_error *err);
enum spc_status spb_ply_binary_list_count(struct ply *ply, const struct ply_property *property,
                                          uint64_t *count, struct spc_error *err);
enum spc_status spb_ply_binary_items(struct ply *ply, const struct ply_property *property,
                                     size_t count, int64_t *items, struct spc_error *err);
enum spc_status spb_ply_binary_pass(struct ply *ply, const struct ply_property *property,
                                    struct spc_error *err);
enum spc_status spb_ply_binary_vertices(struct ply *ply, struct spb_vertex_batch *out,
                                        struct spc_error *err);
/*
 * Takes as many whole faces of 3 to 255 corners as the window and the batch hold, which may be
 * none; only for elements whose one list is the index list.
 */
enum spc_status spb_ply_binary_faces(struct ply *ply, struct spb_face_batch *out,
                                     struct spc_error *err);

#endif
