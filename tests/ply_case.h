/*
 * ply_case.h - for tests of the PLY reader: writes PLY of any type in the three formats.
 */
#ifndef PLY_CASE_H
#define PLY_CASE_H

#include "scan_case.h"

enum { PLY_FORMAT_COUNT = 3, PLY_TYPE_COUNT = 8 };

static const char *const ply_formats[PLY_FORMAT_COUNT] = {
    "ascii", "binary_little_endian", "binary_big_endian"
};

static const struct ply_type_case {
    const char *name, *other_name;
    size_t bytes;
    bool real, is_signed;
    double least, most;                 /* whole values that every such type holds */
} ply_types[PLY_TYPE_COUNT] = {
    { "char", "int8", 1, false, true, -128, 127 },
    { "uchar", "uint8", 1, false, false, 0, 255 },
    { "short", "int16", 2, false, true, -32768, 32767 },
    { "ushort", "uint16", 2, false, false, 0, 65535 },
    { "int", "int32", 4, false, true, -2147483648.0, 2147483647 },
    { "uint", "uint32", 4, false, false, 0, 4294967295.0 },
    { "float", "float32", 4, true, true, -16777216, 16777216 },
    { "double", "float64", 8, true, true, -9007199254740992.0, 9007199254740992.0 },
};

enum { T_CHAR, T_UCHAR, T_SHORT, T_USHORT, T_INT, T_UINT, T_FLOAT, T_DOUBLE };

/* Starts a file in one of the three formats, up to and with the format line. */
static inline struct file_text ply_start(int format)
{
    struct file_text f = { .big = format == 2 };
    put(&f, "ply\nformat %s 1.0\n", ply_formats[format]);
    return f;
}

/* One value of the body; in text a blank follows. */
static inline void ply_value(struct file_text *f, int format, int type, double value)
{
    if (format == 0)
        put(f, "%.17g ", value);
    else if (ply_types[type].real)
        put_real(f, ply_types[type].bytes, value);
    else
        put_int(f, ply_types[type].bytes, (int64_t)value);
}

static inline void ply_row_end(struct file_text *f, int format)
{
    if (format == 0)
        put(f, "\n");
}

/* count vertices (i, i / 2, -i) as floats, behind a header that the caller wrote. */
static inline void ply_vertices(struct file_text *f, int format, int count)
{
    for (int i = 0; i < count; i++) {
        ply_value(f, format, T_FLOAT, i);
        ply_value(f, format, T_FLOAT, i / 2.0);
        ply_value(f, format, T_FLOAT, -i);
        ply_row_end(f, format);
    }
}

/* A list counted in uchar of ints. */
static inline void ply_face(struct file_text *f, int format, int count, const int *corners)
{
    ply_value(f, format, T_UCHAR, count);
    for (int i = 0; i < count; i++)
        ply_value(f, format, T_INT, corners[i]);
    ply_row_end(f, format);
}

#define PLY_XYZ "property float x\nproperty float y\nproperty float z\n"
#define PLY_INDEX_LIST "property list uchar int vertex_indices\n"

/* Four vertices, a triangle, a quad; what a test needs when the body does not matter. */
static inline struct file_text ply_small(int format)
{
    static const int corners[] = { 0, 1, 2, 3 };
    struct file_text f = ply_start(format);

    put(&f, "element vertex 4\n" PLY_XYZ "element face 2\n" PLY_INDEX_LIST "end_header\n");
    ply_vertices(&f, format, 4);
    ply_face(&f, format, 3, corners);
    ply_face(&f, format, 4, corners);
    return f;
}

static inline void ply_expect_small(struct scan *s)
{
    scan_expect_ok(s);
    ck_assert_uint_eq(s->vertex_count, 4);
    ck_assert_uint_eq(s->triangle_count, 3);
    for (int i = 0; i < 4; i++) {
        ck_assert(s->xyz[i][0] == i);
        ck_assert(s->xyz[i][1] == i / 2.0);
        ck_assert(s->xyz[i][2] == -i);
    }
    scan_expect_triangle(s, 0, 0, 1, 2);
    scan_expect_triangle(s, 1, 0, 1, 2);
    scan_expect_triangle(s, 2, 0, 2, 3);
    ck_assert_uint_eq(s->faces_in, 2);
    ck_assert_uint_eq(s->split_extra, 1);
    ck_assert_uint_eq(s->faces_short, 0);
}

static inline uint64_t ply_random(uint64_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return *state;
}

#endif
