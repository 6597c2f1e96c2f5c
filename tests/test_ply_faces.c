/*
 * PLY files that are to be read: elements, lists, polygons and strips; then random files that mix
 * all of it, whose contents the test knows because it made them.
 */
#include "ply.h"

#include "ply_case.h"

/* ---- elements and lists --------------------------------------------------------------------- */

START_TEST(lists_may_be_counted_in_any_integer_type)
{
    static const int corners[] = { 3, 2, 1, 0 };
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        for (int type = 0; type < T_FLOAT * PLY_TYPE_COUNT; type++) {
            const int count_type = type / PLY_TYPE_COUNT, index_type = type % PLY_TYPE_COUNT;
            struct file_text f = ply_start(format);
            struct scan s;
            put(&f, "element vertex 4\n" PLY_XYZ "element %s 2\nproperty list %s %s %s\nend_header\n",
                type % 2 ? "face" : "faces", ply_types[count_type].name, ply_types[index_type].name,
                type % 3 ? "vertex_index" : "vertex_indices");
            ply_vertices(&f, format, 4);
            for (int n = 3; n <= 4; n++) {
                ply_value(&f, format, count_type, n);
                for (int i = 0; i < n; i++)
                    ply_value(&f, format, index_type, corners[i]);
                ply_row_end(&f, format);
            }
            scan_read(&f, &s);
            scan_expect_ok(&s);
            ck_assert_uint_eq(s.triangle_count, 3);
            scan_expect_triangle(&s, 0, 3, 2, 1);
            scan_expect_triangle(&s, 2, 3, 1, 0);
            scan_free(&s);
        }
    }
}
END_TEST

START_TEST(corners_that_name_no_vertex_are_marked)
{
    static const int types[] = { T_CHAR, T_SHORT, T_INT, T_FLOAT, T_DOUBLE };
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        for (size_t t = 0; t < sizeof types / sizeof *types; t++) {
            struct file_text f = ply_start(format);
            struct scan s;
            put(&f, "element vertex 1\n" PLY_XYZ "element face 2\nproperty list uchar %s vertex_index\n"
                "end_header\n", ply_types[types[t]].name);
            ply_vertices(&f, format, 1);
            for (int i = 0; i < 2; i++) {
                ply_value(&f, format, T_UCHAR, 3);
                ply_value(&f, format, types[t], i == 0 ? -1 : 100);
                ply_value(&f, format, types[t], i == 0 ? 5 : -128);
                ply_value(&f, format, types[t], ply_types[types[t]].real && i == 0 ? 1.5 : 7);
                ply_row_end(&f, format);
            }
            scan_read(&f, &s);
            scan_expect_ok(&s);
            scan_expect_triangle(&s, 0, SPB_BAD_INDEX, 5, ply_types[types[t]].real ? SPB_BAD_INDEX : 7);
            scan_expect_triangle(&s, 1, 100, SPB_BAD_INDEX, 7);
            scan_free(&s);
        }
    }
}
END_TEST

/* camera, range_grid and so on, of which nothing is wanted; written alike in header and body. */
static void put_element_header(struct file_text *f, int kind)
{
    static const char *const headers[] = {
        "element face 2\n" PLY_INDEX_LIST,
        "element vertex 4\n" PLY_XYZ,
        "element camera 1\nproperty float view_px\nproperty int viewportx\n",
        "element range_grid 3\nproperty list uchar int vertex_indices\n",
        "element multi_patch 2\nproperty list uchar int vertex_indices\nproperty list ushort double d\n",
        "element edge 0\nproperty int vertex1\n",
        "element material 2\nproperty list char short s\nproperty uchar ambient_red\n",
    };
    put(f, "%s", headers[kind]);
}

static void put_element_body(struct file_text *f, int format, int kind)
{
    static const int corners[] = { 0, 1, 2, 3 };
    if (kind == 0 || kind == 3) {
        for (int i = 0; i < (kind == 0 ? 2 : 3); i++)
            ply_face(f, format, kind == 0 ? 3 + i : i, corners);
    } else if (kind == 1) {
        ply_vertices(f, format, 4);
    } else if (kind == 2) {
        ply_value(f, format, T_FLOAT, 1e-3);
        ply_value(f, format, T_INT, -640);
        ply_row_end(f, format);
    } else if (kind == 4 || kind == 6) {
        for (int i = 0; i < 2; i++) {
            ply_value(f, format, kind == 4 ? T_UCHAR : T_CHAR, i);
            for (int k = 0; k < i; k++)
                ply_value(f, format, kind == 4 ? T_INT : T_SHORT, 7);
            ply_value(f, format, kind == 4 ? T_USHORT : T_UCHAR, 3);
            for (int k = 0; k < 3 && kind == 4; k++)
                ply_value(f, format, T_DOUBLE, 0.25 * k);
            ply_row_end(f, format);
        }
    }
}

START_TEST(elements_may_come_in_any_order)
{
    uint64_t random = 77;
    for (int round = 0; round < 150; round++) {
        const int format = round % 3;
        struct file_text f = ply_start(format);
        struct scan s;
        int order[7] = { 0, 1, 2, 3, 4, 5, 6 };
        for (int i = 6; i > 0; i--) {
            const int k = (int)(ply_random(&random) % (unsigned)(i + 1)), t = order[i];
            order[i] = order[k];
            order[k] = t;
        }
        for (int i = 0; i < 7; i++)
            put_element_header(&f, order[i]);
        put(&f, "end_header\n");
        for (int i = 0; i < 7; i++)
            put_element_body(&f, format, order[i]);
        scan_read(&f, &s);
        ply_expect_small(&s);
        ck_assert_str_eq(s.remark, "");
        scan_free(&s);
    }
}
END_TEST

START_TEST(a_face_element_holds_other_lists_and_values_too)
{
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        for (int many = 0; many < 2; many++) {
            struct file_text f = ply_start(format);
            struct scan s;
            put(&f, "element vertex 4\n" PLY_XYZ "element face 3\nproperty int flags\n%s"
                "property list uchar int vertex_indices\nproperty float quality\n%sproperty uchar red\n"
                "end_header\n", many ? "property list ushort double before\n" : "",
                many ? "property list uchar float texcoord\n" : "");
            ply_vertices(&f, format, 4);
            for (int i = 0; i < 3; i++) {
                ply_value(&f, format, T_INT, 1000 + i);
                for (int k = 0; k < 1 + i && many; k++)
                    ply_value(&f, format, k ? T_DOUBLE : T_USHORT, k ? 0.5 : i);
                for (int k = 0; k < 4 + i; k++)
                    ply_value(&f, format, k ? T_INT : T_UCHAR, k ? k - 1 : 3 + i);
                ply_value(&f, format, T_FLOAT, 1e10);
                for (int k = 0; k < 3 && many; k++)
                    ply_value(&f, format, k ? T_FLOAT : T_UCHAR, k ? 0.25 : 2);
                ply_value(&f, format, T_UCHAR, 200);
                ply_row_end(&f, format);
            }
            scan_read(&f, &s);
            scan_expect_ok(&s);
            ck_assert_uint_eq(s.triangle_count, 6);
            ck_assert_uint_eq(s.split_extra, 3);
            scan_expect_triangle(&s, 5, 0, 3, 4);
            ck_assert_str_eq(s.remark, "");
            scan_free(&s);
        }
    }
}
END_TEST

START_TEST(vertices_may_carry_lists)
{
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        struct file_text f = ply_start(format);
        struct scan s;
        put(&f, "element vertex 5000\nproperty float x\nproperty list uchar double seen_from\n"
            "property float y\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
            "property short z\nproperty list int uchar tail\nend_header\n");
        for (int i = 0; i < 5000; i++) {
            ply_value(&f, format, T_FLOAT, i);
            ply_value(&f, format, T_UCHAR, i % 5);
            for (int k = 0; k < i % 5; k++)
                ply_value(&f, format, T_DOUBLE, k + 0.125);
            ply_value(&f, format, T_FLOAT, -i);
            for (int k = 0; k < 3; k++)
                ply_value(&f, format, T_UCHAR, (i + k) % 256);
            ply_value(&f, format, T_SHORT, i % 9 - 4);
            ply_value(&f, format, T_INT, i % 3);
            for (int k = 0; k < i % 3; k++)
                ply_value(&f, format, T_UCHAR, 9);
            ply_row_end(&f, format);
        }
        scan_read(&f, &s);
        scan_expect_ok(&s);
        for (int i = 0; i < 5000; i++) {
            SCAN_CHECK(s.xyz[i][0] == i && s.xyz[i][1] == -i && s.xyz[i][2] == i % 9 - 4);
            SCAN_CHECK(s.rgba[i][0] == i % 256 && s.rgba[i][2] == (i + 2) % 256 && s.rgba[i][3] == 255);
        }
        scan_free(&s);
    }
}
END_TEST

START_TEST(files_without_faces_end_the_pass_at_once)
{
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        struct file_text f = ply_start(format);
        struct scan s;
        put(&f, "element vertex 4\n" PLY_XYZ "element range_grid 2\n" PLY_INDEX_LIST "end_header\n");
        ply_vertices(&f, format, 4);
        put_element_body(&f, format, 0);        /* looks like faces, but is a range_grid */
        scan_read(&f, &s);
        scan_expect_ok(&s);
        ck_assert_uint_eq(s.info.face_count, 0);
        ck_assert_uint_eq(s.triangle_count, 0);
        ck_assert_str_eq(s.remark, "");
        scan_free(&s);

        f = ply_start(format);
        put(&f, "element vertex 1\n" PLY_XYZ "element face 1\nproperty list uchar int corners\n"
            "end_header\n");
        ply_vertices(&f, format, 1);
        ply_face(&f, format, 1, (const int[]){ 0 });
        scan_read(&f, &s);
        scan_expect_ok(&s);
        ck_assert_uint_eq(s.info.face_count, 0);
        ck_assert_ptr_nonnull(strstr(s.remark, "no list 'vertex_indices'"));
        scan_free(&s);
    }
}
END_TEST

/* ---- polygons and strips -------------------------------------------------------------------- */

START_TEST(a_polygon_of_thousands_of_corners_is_one_fan_over_batches)
{
    const int sizes[] = { 4098, 3, 20000, 255, 257, 4 };
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        struct file_text f = ply_start(format);
        struct scan s;
        size_t at = 0;
        put(&f, "element vertex 1\n" PLY_XYZ "element face 6\nproperty list int int vertex_indices\n"
            "property uchar flag\nend_header\n");
        ply_vertices(&f, format, 1);
        for (int n = 0; n < 6; n++) {
            ply_value(&f, format, T_INT, sizes[n]);
            for (int i = 0; i < sizes[n]; i++)
                ply_value(&f, format, T_INT, n * 100000 + i);
            ply_value(&f, format, T_UCHAR, 1);
            ply_row_end(&f, format);
        }
        scan_read(&f, &s);
        scan_expect_ok(&s);
        ck_assert_uint_eq(s.faces_in, 6);
        for (int n = 0; n < 6; n++) {
            for (int i = 2; i < sizes[n]; i++) {
                const uint64_t base = (uint64_t)n * 100000;
                scan_expect_triangle(&s, at++, base, base + (uint64_t)i - 1, base + (uint64_t)i);
            }
        }
        ck_assert_uint_eq(s.triangle_count, at);
        scan_free(&s);
    }
}
END_TEST

START_TEST(many_polygons_fill_batches_exactly)
{
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        for (int corners = 1; corners <= 9; corners++) {
            struct file_text f = ply_start(format);
            struct scan s;
            const int faces = 9000;
            put(&f, "element vertex 1\n" PLY_XYZ "element face %d\n" PLY_INDEX_LIST "end_header\n", faces);
            ply_vertices(&f, format, 1);
            for (int n = 0; n < faces; n++) {
                int corner[9];
                for (int i = 0; i < corners; i++)
                    corner[i] = n * 10 + i;
                ply_face(&f, format, corners, corner);
            }
            scan_read(&f, &s);
            scan_expect_ok(&s);
            ck_assert_uint_eq(s.faces_short, (size_t)(corners < 3 ? faces : 0));
            ck_assert_uint_eq(s.triangle_count, (size_t)(corners < 3 ? 0 : faces * (corners - 2)));
            for (size_t i = 0; i < s.triangle_count; i++) {
                const uint64_t per = (uint64_t)corners - 2, n = i / per * 10, k = i % per;
                scan_expect_triangle(&s, i, n, n + k + 1, n + k + 2);
            }
            scan_free(&s);
        }
    }
}
END_TEST

START_TEST(faces_of_fewer_than_three_corners_are_counted)
{
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        struct file_text f = ply_start(format);
        struct scan s;
        static const int corners[] = { 5, 6, 7 };
        put(&f, "element vertex 1\n" PLY_XYZ "element face 6\n" PLY_INDEX_LIST "end_header\n");
        ply_vertices(&f, format, 1);
        for (int n = 0; n < 6; n++)
            ply_face(&f, format, n == 2 ? 3 : n % 3, corners);
        scan_read(&f, &s);
        scan_expect_ok(&s);
        ck_assert_uint_eq(s.faces_in, 6);
        ck_assert_uint_eq(s.faces_short, 5);
        ck_assert_uint_eq(s.triangle_count, 1);
        scan_expect_triangle(&s, 0, 5, 6, 7);
        scan_free(&s);
    }
}
END_TEST

START_TEST(strips_turn_every_other_triangle_and_restart_at_minus_one)
{
    static const int strip[] = { 0, 1, 2, 3, 4, -1, -1, 7, 8, -1, 10, 11, 12, 13, 13, 14, -1, -3, 20, 21 };
    enum { COUNT = sizeof strip / sizeof *strip };
    static const uint64_t wanted[][3] = {
        { 0, 1, 2 }, { 2, 1, 3 }, { 2, 3, 4 },
        { 10, 11, 12 }, { 12, 11, 13 }, { 12, 13, 13 }, { 13, 13, 14 },
        { SPB_BAD_INDEX, 20, 21 },
        { 5, 6, 7 }, { 7, 6, 8 },
    };
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        for (int unsigned_type = 0; unsigned_type < 2; unsigned_type++) {
            struct file_text f = ply_start(format);
            struct scan s;
            put(&f, "element vertex 1\n" PLY_XYZ "element tristrips 3\nproperty list int %s "
                "vertex_indices\nend_header\n", unsigned_type ? "uint" : "int");
            ply_vertices(&f, format, 1);
            ply_value(&f, format, T_INT, COUNT);
            for (int i = 0; i < COUNT; i++) {
                /* -1 stored as uint restarts too; -3 would be a vertex then. */
                const bool wraps = unsigned_type && strip[i] == -1;
                ply_value(&f, format, T_INT, format == 0 && wraps ? 4294967295.0 : strip[i]);
            }
            ply_row_end(&f, format);
            ply_value(&f, format, T_INT, 0);
            ply_row_end(&f, format);
            ply_value(&f, format, T_INT, 4);
            for (int i = 0; i < 4; i++)
                ply_value(&f, format, T_INT, 5 + i);
            ply_row_end(&f, format);
            scan_read(&f, &s);
            scan_expect_ok(&s);
            ck_assert(s.info.strips);
            ck_assert_uint_eq(s.info.face_count, 3);
            ck_assert_uint_eq(s.triangle_count, 10);
            ck_assert_uint_eq(s.faces_in, 10);
            ck_assert_uint_eq(s.split_extra + s.faces_short, 0);
            for (size_t i = 0; i < 10; i++) {
                const bool minus3 = i == 7 && unsigned_type && format > 0;
                scan_expect_triangle(&s, i, minus3 ? 4294967293 : wanted[i][0], wanted[i][1], wanted[i][2]);
            }
            scan_free(&s);
        }
    }
}
END_TEST

START_TEST(a_long_strip_goes_on_over_batches)
{
    enum { COUNT = 30011 };
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        struct file_text f = ply_start(format);
        struct scan s;
        size_t at = 0;
        put(&f, "element tristrips 1\nproperty list uint int vertex_index\nelement vertex 1\n" PLY_XYZ
            "end_header\n");
        ply_value(&f, format, T_UINT, COUNT);
        for (int i = 0; i < COUNT; i++)
            ply_value(&f, format, T_INT, i % 1000 == 999 ? -1 : i);
        ply_row_end(&f, format);
        ply_vertices(&f, format, 1);
        scan_read(&f, &s);
        scan_expect_ok(&s);
        for (uint64_t i = 0; i < COUNT; i++) {
            const uint64_t place = i % 1000;
            if (place == 999 || place < 2)
                continue;
            if (place % 2 == 0)
                scan_expect_triangle(&s, at++, i - 2, i - 1, i);
            else
                scan_expect_triangle(&s, at++, i - 1, i - 2, i);
        }
        ck_assert_uint_eq(s.triangle_count, at);
        scan_free(&s);
    }
}
END_TEST

START_TEST(faces_and_strips_in_one_file_come_in_that_order)
{
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        struct file_text f = ply_start(format);
        struct scan s;
        static const int corners[] = { 3, 4, 5, 6 };
        put(&f, "element tristrips 1\n" PLY_INDEX_LIST "element vertex 2\n" PLY_XYZ "element face 1\n"
            PLY_INDEX_LIST "end_header\n");
        ply_face(&f, format, 4, corners);
        ply_vertices(&f, format, 2);
        ply_face(&f, format, 3, corners + 1);
        scan_read(&f, &s);
        scan_expect_ok(&s);
        ck_assert(s.info.strips);
        ck_assert_uint_eq(s.info.face_count, 2);
        ck_assert_uint_eq(s.triangle_count, 3);
        ck_assert_uint_eq(s.faces_in, 3);
        scan_expect_triangle(&s, 0, 4, 5, 6);
        scan_expect_triangle(&s, 1, 3, 4, 5);
        scan_expect_triangle(&s, 2, 5, 4, 6);
        scan_free(&s);
    }
}
END_TEST

/* ---- passes --------------------------------------------------------------------------------- */

START_TEST(passes_may_be_left_early_and_taken_in_any_order)
{
    struct file_text f = ply_start(0);
    struct spb_source *source;

    put(&f, "element face 9000\n" PLY_INDEX_LIST "element vertex 9000\n" PLY_XYZ "end_header\n");
    for (int i = 0; i < 9000; i++)
        ply_face(&f, 0, 3, (const int[]){ i, 1, 2 });
    ply_vertices(&f, 0, 9000);
    scan_write(f.data, f.bytes);
    ck_assert_int_eq(spb_source_open(scan_path, NULL, &source, NULL), SPC_OK);
    for (int i = 0; i < 6; i++) {
        if (i % 3 == 0) {
            ck_assert_int_eq(spb_source_begin_vertices(source, NULL), SPC_OK);
            ck_assert_int_eq(spb_source_vertices(source, &scan_vertices, NULL), SPC_OK);
            ck_assert_uint_eq(scan_vertices.count, SPB_BATCH_MAX);
            ck_assert(scan_vertices.xyz[1][0] == 1);
        } else {
            ck_assert_int_eq(spb_source_begin_faces(source, NULL), SPC_OK);
            ck_assert_int_eq(spb_source_faces(source, &scan_faces, NULL), SPC_OK);
            ck_assert_uint_eq(scan_faces.count, SPB_BATCH_MAX);
            ck_assert_uint_eq(scan_faces.corner[77][0], 77);
        }
        ck_assert_uint_gt(spb_source_bytes_done(source), SPB_BATCH_MAX * 8);
    }
    spb_source_close(source);
    spb_source_close(NULL);
    free(f.data);
}
END_TEST

START_TEST(bytes_done_tells_the_bytes_of_each_pass)
{
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        struct file_text f = ply_small(format);
        struct spb_source *source;
        const size_t vertex_bytes = format ? 4 * 12 : strlen("0 0 0 \n1 0.5 -1 \n2 1 -2 \n3 1.5 -3 \n");
        const size_t face_bytes = format ? 13 + 17 : strlen("3 0 1 2 \n4 0 1 2 3 \n");
        uint64_t done;

        scan_write(f.data, f.bytes);
        ck_assert_int_eq(spb_source_open(scan_path, NULL, &source, NULL), SPC_OK);
        ck_assert_uint_eq(spb_source_info(source)->file_bytes, f.bytes);
        ck_assert_int_eq(spb_source_begin_vertices(source, NULL), SPC_OK);
        ck_assert_uint_eq(spb_source_bytes_done(source), 0);
        ck_assert_int_eq(spb_source_vertices(source, &scan_vertices, NULL), SPC_OK);
        done = spb_source_bytes_done(source);
        ck_assert_uint_eq(done, vertex_bytes);
        ck_assert_int_eq(spb_source_vertices(source, &scan_vertices, NULL), SPC_OK);
        ck_assert_uint_eq(scan_vertices.count, 0);
        ck_assert_uint_eq(spb_source_bytes_done(source), vertex_bytes);
        ck_assert_int_eq(spb_source_begin_faces(source, NULL), SPC_OK);
        ck_assert_uint_eq(spb_source_bytes_done(source), 0);
        do
            ck_assert_int_eq(spb_source_faces(source, &scan_faces, NULL), SPC_OK);
        while (scan_faces.count > 0);
        ck_assert_uint_eq(spb_source_bytes_done(source), face_bytes);
        spb_source_close(source);
        free(f.data);

        /* Elements that are passed over on the way are not of the pass. */
        f = ply_start(format);
        put(&f, "element face 2\n" PLY_INDEX_LIST "element vertex 4\n" PLY_XYZ "element range_grid 3\n"
            PLY_INDEX_LIST "end_header\n");
        put_element_body(&f, format, 0);
        put_element_body(&f, format, 1);
        put_element_body(&f, format, 3);
        scan_write(f.data, f.bytes);
        ck_assert_int_eq(spb_source_open(scan_path, NULL, &source, NULL), SPC_OK);
        ck_assert_int_eq(spb_source_begin_vertices(source, NULL), SPC_OK);
        ck_assert_uint_eq(spb_source_bytes_done(source), 0);
        ck_assert_int_eq(spb_source_vertices(source, &scan_vertices, NULL), SPC_OK);
        ck_assert_uint_eq(spb_source_bytes_done(source), vertex_bytes);
        ck_assert_int_eq(spb_source_begin_faces(source, NULL), SPC_OK);
        do
            ck_assert_int_eq(spb_source_faces(source, &scan_faces, NULL), SPC_OK);
        while (scan_faces.count > 0);
        ck_assert_uint_eq(spb_source_bytes_done(source), face_bytes);
        spb_source_close(source);
        free(f.data);
    }
}
END_TEST

/* ---- random files --------------------------------------------------------------------------- */

struct random_file {                    /* what a random file holds; sizes are small */
    uint64_t random;
    int types[6];                       /* x y z red green blue */
    int order[3];                       /* elements: vertex, face, other */
    int count_type, index_type, spare_type;
    int vertex_count, face_count, other_count;
    bool vertex_list, face_list;
};

static int below(struct random_file *r, int limit)
{
    return (int)(ply_random(&r->random) % (unsigned)limit);
}

static void put_random_header(struct file_text *f, const struct random_file *r)
{
    static const char *const names[] = { "x", "y", "z", "red", "green", "blue" };
    for (int e = 0; e < 3; e++) {
        if (r->order[e] == 0) {
            put(f, "element vertex %d\n", r->vertex_count);
            for (int i = 0; i < 6; i++) {
                put(f, "property %s %s\n", ply_types[r->types[i]].name, names[i]);
                if (i == 2 && r->vertex_list)
                    put(f, "property list uchar %s l\n", ply_types[r->spare_type].name);
            }
        } else if (r->order[e] == 1) {
            put(f, "element face %d\nproperty %s q\nproperty list %s %s vertex_index\n", r->face_count,
                ply_types[r->spare_type].name, ply_types[r->count_type].name,
                ply_types[r->index_type].name);
            if (r->face_list)
                put(f, "property list uchar %s l\n", ply_types[r->spare_type].name);
        } else {
            put(f, "element other %d\nproperty %s q\n", r->other_count, ply_types[r->spare_type].name);
        }
    }
    put(f, "end_header\n");
}

/* Coordinates and corners follow from their places, so that the reader's can be told from them. */
static double coordinate(const struct random_file *r, int vertex, int axis)
{
    const int value = (vertex * (axis + 3)) % 100;
    return ply_types[r->types[axis]].real ? value / 8.0 : value;
}

static int corner_count(int face)
{
    return face * 5 % 8;
}

static int corner_at(int face, int place)
{
    return (face * 3 + place * 7) % 120;
}

static void put_random_body(struct file_text *f, int format, struct random_file *r)
{
    for (int e = 0; e < 3; e++) {
        const int kind = r->order[e];
        const int rows = kind == 0 ? r->vertex_count : kind == 1 ? r->face_count : r->other_count;
        for (int row = 0; row < rows; row++) {
            int spare = below(r, 4);
            for (int i = 0; i < 6 && kind == 0; i++) {
                if (i < 3)
                    ply_value(f, format, r->types[i], coordinate(r, row, i));
                else
                    ply_value(f, format, r->types[i], 100);
                for (int k = 0; k <= spare && i == 2 && r->vertex_list; k++)
                    ply_value(f, format, k ? r->spare_type : T_UCHAR, spare);
            }
            if (kind > 0)
                ply_value(f, format, r->spare_type, 1);
            for (int k = 0; k <= corner_count(row) && kind == 1; k++)
                ply_value(f, format, k ? r->index_type : r->count_type,
                          k ? corner_at(row, k - 1) : corner_count(row));
            for (int k = 0; k <= spare && kind == 1 && r->face_list; k++)
                ply_value(f, format, k ? r->spare_type : T_UCHAR, spare);
            ply_row_end(f, format);
        }
    }
}

static void expect_random_file(const struct random_file *r, const struct scan *s)
{
    size_t at = 0;

    scan_expect_ok(s);
    ck_assert_uint_eq(s->vertex_count, (size_t)r->vertex_count);
    ck_assert(s->info.colors);
    for (int i = 0; i < r->vertex_count; i++) {
        for (int k = 0; k < 3; k++) {
            SCAN_CHECK(s->xyz[i][k] == coordinate(r, i, k));
            SCAN_CHECK(s->rgba[i][k] == 100);       /* whatever the type: see spb_ply_color */
        }
    }
    for (int i = 0; i < r->face_count; i++) {
        for (int k = 2; k < corner_count(i); k++)
            scan_expect_triangle(s, at++, (uint64_t)corner_at(i, 0), (uint64_t)corner_at(i, k - 1),
                                 (uint64_t)corner_at(i, k));
    }
    ck_assert_uint_eq(s->triangle_count, at);
    ck_assert_uint_eq(s->faces_in, (size_t)r->face_count);
}

START_TEST(random_files_are_read_as_they_were_made)
{
    const uint64_t seed = 4711;
    printf("seed %" PRIu64 "\n", seed);
    for (int round = 0; round < 600; round++) {
        struct random_file r = { .random = seed + (uint64_t)round * 7919 };
        const int format = round % 3;
        struct file_text f = ply_start(format);
        struct scan s;
        for (int i = 0; i < 20; i++)
            ply_random(&r.random);
        for (int i = 0; i < 6; i++)
            r.types[i] = below(&r, PLY_TYPE_COUNT);
        r.order[0] = below(&r, 3);
        r.order[1] = (r.order[0] + 1 + below(&r, 2)) % 3;
        r.order[2] = 3 - r.order[0] - r.order[1];
        r.count_type = below(&r, T_FLOAT);
        r.index_type = below(&r, PLY_TYPE_COUNT);
        r.spare_type = below(&r, PLY_TYPE_COUNT);
        r.vertex_count = below(&r, 10) == 0 ? 9000 : below(&r, 50);
        r.face_count = below(&r, 10) == 0 ? 9000 : below(&r, 50);
        r.other_count = below(&r, 20);
        r.vertex_list = below(&r, 3) == 0;
        r.face_list = below(&r, 3) == 0;
        put_random_header(&f, &r);
        put_random_body(&f, format, &r);
        scan_read(&f, &s);
        expect_random_file(&r, &s);
        scan_free(&s);
    }
}
END_TEST

int main(void)
{
    return SUITE("ply_faces", scan_start, scan_finish,
                 lists_may_be_counted_in_any_integer_type,
                 corners_that_name_no_vertex_are_marked,
                 elements_may_come_in_any_order,
                 a_face_element_holds_other_lists_and_values_too,
                 vertices_may_carry_lists,
                 files_without_faces_end_the_pass_at_once,
                 a_polygon_of_thousands_of_corners_is_one_fan_over_batches,
                 many_polygons_fill_batches_exactly,
                 faces_of_fewer_than_three_corners_are_counted,
                 strips_turn_every_other_triangle_and_restart_at_minus_one,
                 a_long_strip_goes_on_over_batches,
                 faces_and_strips_in_one_file_come_in_that_order,
                 passes_may_be_left_early_and_taken_in_any_order,
                 bytes_done_tells_the_bytes_of_each_pass,
                 random_files_are_read_as_they_were_made);
}
