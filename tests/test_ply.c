/*
 * PLY files that are to be read: the header, values, colours and text rows; and real files, where
 * the environment says with SPC_DATA where they are. Elements and faces: test_ply_faces.c; what is
 * to be refused: test_ply_bad.c.
 */
#include "ply.h"

#include <math.h>

#include "ply_case.h"

/* ---- header --------------------------------------------------------------------------------- */

/* Writes the header of f with other line ends, up to where the body starts. */
static void change_line_ends(struct file_text *f, const char *end)
{
    struct file_text out = { .big = f->big };
    static const char last[] = "end_header\n";
    const char *const text = (const char *)f->data;
    const size_t header = (size_t)(strstr(text, last) - text) + sizeof last - 1;

    for (size_t i = 0; i < header; i++) {
        if (text[i] == '\n')
            put(&out, "%s", end);
        else
            put_bytes(&out, text + i, 1);
    }
    put_bytes(&out, text + header, f->bytes - header);
    free(f->data);
    *f = out;
}

START_TEST(header_lines_may_end_in_lf_crlf_or_cr)
{
    static const char *const ends[] = { "\n", "\r\n", "\r" };
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        for (size_t e = 0; e < 3; e++) {
            struct file_text f = ply_small(format);
            struct scan s;
            change_line_ends(&f, ends[e]);
            scan_read(&f, &s);
            ply_expect_small(&s);
            ck_assert_str_eq(s.info.format, format == 0 ? "ply ascii" : format == 1 ? "ply le" : "ply be");
            ck_assert_uint_eq(s.info.face_count, 2);
            ck_assert(!s.info.strips && !s.info.colors && !s.info.wide);
            ck_assert_str_eq(s.remark, "");
            scan_free(&s);
        }
    }
}
END_TEST

START_TEST(a_first_data_byte_that_looks_like_a_line_end_is_kept)
{
    static const char *const ends[] = { "\n", "\r\n", "\r" };
    static const uint8_t firsts[] = { '\n', '\r', ' ' };
    for (size_t e = 0; e < 3; e++) {
        for (size_t k = 0; k < 3; k++) {
            /* Behind LF and CR LF no byte is doubtful; behind CR a data byte LF is. */
            struct file_text f = { .big = false };
            struct scan s;
            put(&f, "ply\nformat binary_little_endian 1.0\ncomment\nelement vertex 1\n"
                "property uchar x\nproperty uchar y\nproperty uchar z\nend_header\n");
            put_int(&f, 1, firsts[k]);
            put_int(&f, 1, 1);
            put_int(&f, 1, 2);
            change_line_ends(&f, ends[e]);
            scan_read(&f, &s);
            scan_expect_ok(&s);
            ck_assert_msg(s.xyz[0][0] == firsts[k] && s.xyz[0][1] == 1 && s.xyz[0][2] == 2,
                          "ends %zu first %zu", e, k);
            ck_assert_str_eq(s.remark, "");
            scan_free(&s);
        }
    }
}
END_TEST

/* Reads a header with the small body behind it. */
static void expect_header_reads_small(int format, const char *header, const char *remark)
{
    struct file_text small = ply_small(format), f = { .big = false };
    static const char last[] = "end_header\n";
    const char *const text = (const char *)small.data;
    const size_t body = (size_t)(strstr(text, last) - text) + sizeof last - 1;
    struct scan s;

    put_bytes(&f, header, strlen(header));
    put_bytes(&f, text + body, small.bytes - body);
    free(small.data);
    scan_read(&f, &s);
    ply_expect_small(&s);
    ck_assert_str_eq(s.remark, remark);
    scan_free(&s);
}

#define BINARY "format binary_little_endian 1.0\n"
#define BODY_OF_SMALL "element vertex 4\n" PLY_XYZ "element face 2\n" PLY_INDEX_LIST

START_TEST(end_header_may_be_followed_by_blanks_and_odd_ends)
{
    expect_header_reads_small(1, "ply\n" BINARY BODY_OF_SMALL "end_header \t \n", "");
    expect_header_reads_small(1, "ply \n" BINARY BODY_OF_SMALL "  end_header\r\n", "");
    expect_header_reads_small(1, "ply\r\n" BINARY BODY_OF_SMALL "end_header\n", "");
    expect_header_reads_small(1, "ply\r" BINARY BODY_OF_SMALL "end_header\r", "");
    expect_header_reads_small(0, "ply\nformat ascii 1.0\n" BODY_OF_SMALL "end_header\r\n", "");
    expect_header_reads_small(0, "\xef\xbb\xbfply\nformat ascii 1.0\n" BODY_OF_SMALL "end_header\n", "");
    expect_header_reads_small(0, "ply\nformat ascii\n" BODY_OF_SMALL "end_header\n", "");
}
END_TEST

START_TEST(comments_and_obj_info_stand_anywhere)
{
    struct file_text f = { .big = false };

    put(&f, "ply\ncomment first\nobj_info num_cols 512\n" BINARY "comment\n\ncommenT is not one\n"
        "element vertex 4\ncomment element vertex 9\nproperty float x\nobj_info end_header\n"
        "property float y\n   \nproperty\tfloat  z \ncomment ");
    for (int i = 0; i < 500; i++)
        put(&f, "a very long comment ");
    put(&f, "\nelement face 2\ncomment\n" PLY_INDEX_LIST "comment last\nend_header\n%c", 0);
    expect_header_reads_small(1, (const char *)f.data, "1 header lines begin with no keyword of PLY, "
                              "the first with 'commenT'");
    free(f.data);
}
END_TEST

START_TEST(lines_without_keyword_are_passed_over_and_remarked)
{
    expect_header_reads_small(1, "ply\n" BINARY BODY_OF_SMALL "bye\nwhat \x01\nend_header\n",
                              "2 header lines begin with no keyword of PLY, the first with 'bye'");
    expect_header_reads_small(1, "ply\n" BINARY BODY_OF_SMALL "b\x01\x7f\xff yz\nend_header\n",
                              "1 header lines begin with no keyword of PLY, the first with 'b??" "?'");
}
END_TEST

START_TEST(a_header_without_body_may_end_the_file)
{
    static const char *const texts[] = {
        "ply\nformat ascii 1.0\nelement vertex 0\nend_header",
        "ply\nformat ascii 1.0\nelement vertex 0\n" PLY_XYZ "element face 0\n" PLY_INDEX_LIST "end_header\n",
        "ply\n" BINARY "element vertex 0\nproperty list char float x\nelement face 0\nend_header \r",
        "ply\n" BINARY "element nothing 18446744073709551615\nelement vertex 0\nend_header\n",
        "ply\nformat ascii 1.0\nelement nothing 9999999999\nelement vertex 0\nend_header\n",
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        struct scan s;
        scan_read_bytes(texts[i], strlen(texts[i]), &s);
        scan_expect_ok(&s);
        ck_assert_uint_eq(s.info.vertex_count, 0);
        ck_assert_uint_eq(s.info.face_count, 0);
        scan_free(&s);
    }
}
END_TEST

START_TEST(every_scalar_type_goes_by_both_names)
{
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        for (int type = 0; type < PLY_TYPE_COUNT * 2; type++) {
            const struct ply_type_case *const t = &ply_types[type / 2];
            const char *const name = type % 2 ? t->other_name : t->name;
            struct file_text f = ply_start(format);
            struct scan s;
            put(&f, "element vertex 3\nproperty %s x\nproperty %s y\nproperty %s z\nend_header\n",
                name, name, name);
            for (int i = 0; i < 9; i++) {
                ply_value(&f, format, type / 2, i % 3 == 0 ? t->least : i % 3 == 1 ? t->most : i);
                if (i % 3 == 2)
                    ply_row_end(&f, format);
            }
            scan_read(&f, &s);
            scan_expect_ok(&s);
            for (int i = 0; i < 3; i++) {
                ck_assert_msg(s.xyz[i][0] == t->least && s.xyz[i][1] == t->most, "%s", name);
                ck_assert(s.xyz[i][2] == i * 3 + 2);
            }
            ck_assert_msg(s.info.wide == (type / 2 == T_DOUBLE || type / 2 == T_INT || type / 2 == T_UINT),
                          "%s", name);
            scan_free(&s);
        }
    }
}
END_TEST

START_TEST(real_coordinates_come_exactly)
{
    static const double values[] = { 0.1, -1e-30, 416155.123456789, 1.0 / 3, 5e-324, 1e300 };
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        struct file_text f = ply_start(format);
        struct scan s;
        put(&f, "element vertex 6\nproperty double z\nproperty float y\nproperty float x\nend_header\n");
        for (int i = 0; i < 6; i++) {
            ply_value(&f, format, T_DOUBLE, values[i]);
            ply_value(&f, format, T_FLOAT, i == 0 ? NAN : i == 1 ? INFINITY : 0.5f * (float)i);
            ply_value(&f, format, T_FLOAT, i == 0 ? -INFINITY : (double)0.1f);
            ply_row_end(&f, format);
        }
        scan_read(&f, &s);
        scan_expect_ok(&s);
        ck_assert(s.info.wide);
        for (int i = 0; i < 6; i++)
            ck_assert(s.xyz[i][2] == values[i]);
        ck_assert(isnan(s.xyz[0][1]) && s.xyz[1][1] == (double)INFINITY && s.xyz[3][1] == 1.5);
        ck_assert(s.xyz[0][0] == -(double)INFINITY && s.xyz[5][0] == (double)0.1f);
        scan_free(&s);
    }
}
END_TEST

START_TEST(of_a_property_named_twice_the_first_counts)
{
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        struct file_text f = ply_start(format);
        struct scan s;
        put(&f, "element vertex 1\n" PLY_XYZ "property float x\nproperty double z\nend_header\n");
        for (int i = 0; i < 5; i++)
            ply_value(&f, format, i == 4 ? T_DOUBLE : T_FLOAT, i + 1);
        ply_row_end(&f, format);
        scan_read(&f, &s);
        scan_expect_ok(&s);
        ck_assert(s.xyz[0][0] == 1 && s.xyz[0][1] == 2 && s.xyz[0][2] == 3);
        ck_assert(!s.info.wide);
        scan_free(&s);
    }
}
END_TEST

/* ---- colours -------------------------------------------------------------------------------- */

/* One vertex with the given channel types and values; four numbers of the result. */
static void read_color(int format, const char *const names[4], const int types[4],
                       const double values[4], struct scan *s)
{
    struct file_text f = ply_start(format);

    put(&f, "element vertex 1\n" PLY_XYZ);
    for (int i = 0; i < 4; i++) {
        if (names[i])
            put(&f, "property %s %s\n", ply_types[types[i]].name, names[i]);
    }
    put(&f, "end_header\n");
    for (int i = 0; i < 3; i++)
        ply_value(&f, format, T_FLOAT, 0);
    for (int i = 0; i < 4; i++) {
        if (names[i])
            ply_value(&f, format, types[i], values[i]);
    }
    ply_row_end(&f, format);
    scan_read(&f, s);
    scan_expect_ok(s);
}

START_TEST(colours_come_in_every_type)
{
    static const char *const names[] = { "red", "green", "blue", "alpha" };
    static const struct {
        int type;
        double values[4];
        uint8_t wanted[4];
    } cases[] = {
        { T_UCHAR, { 0, 1, 254, 255 }, { 0, 1, 254, 255 } },
        { T_USHORT, { 0, 65535, 32768, 128 }, { 0, 255, 128, 0 } },
        { T_USHORT, { 129, 385, 386, 65406 }, { 1, 1, 2, 254 } },
        { T_FLOAT, { 0, 1, 0.5, 0.25 }, { 0, 255, 128, 64 } },
        { T_FLOAT, { -0.5, 1.5, NAN, INFINITY }, { 0, 255, 0, 255 } },
        { T_DOUBLE, { 0.001, 0.998, -INFINITY, 0.1 }, { 0, 254, 0, 26 } },
        { T_CHAR, { -128, 0, 127, 1 }, { 0, 0, 127, 1 } },
        { T_SHORT, { -1, 255, 256, 77 }, { 0, 255, 255, 77 } },
        { T_INT, { -5, 255, 100000, 3 }, { 0, 255, 255, 3 } },
        { T_UINT, { 0, 255, 4294967295.0, 9 }, { 0, 255, 255, 9 } },
    };
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
            const int t = cases[i].type, types[] = { t, t, t, t };
            struct scan s;
            read_color(format, names, types, cases[i].values, &s);
            ck_assert(s.info.colors);
            ck_assert_msg(memcmp(s.rgba[0], cases[i].wanted, 4) == 0, "case %zu: %u %u %u %u", i,
                          s.rgba[0][0], s.rgba[0][1], s.rgba[0][2], s.rgba[0][3]);
            scan_free(&s);
        }
    }
}
END_TEST

START_TEST(colours_go_by_several_names_and_need_all_three)
{
    static const struct {
        const char *names[4];
        bool colors;
        uint8_t wanted[4];
    } cases[] = {
        { { "red", "green", "blue", "alpha" }, true, { 10, 20, 30, 40 } },
        { { "red", "green", "blue", NULL }, true, { 10, 20, 30, 255 } },
        { { "alpha", "blue", "green", "red" }, true, { 40, 30, 20, 10 } },
        { { "diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha" }, true, { 10, 20, 30, 40 } },
        { { "diffuse_red", "diffuse_green", "diffuse_blue", "alpha" }, true, { 10, 20, 30, 40 } },
        { { "r", "g", "b", "a" }, true, { 10, 20, 30, 40 } },
        { { "r", "g", "b", "alpha" }, true, { 10, 20, 30, 40 } },
        { { "r", "g", "b", NULL }, true, { 10, 20, 30, 255 } },
        { { "red", "green", NULL, "alpha" }, false, { 0 } },
        { { "red", "g", "b", "alpha" }, false, { 0 } },
        { { "alpha", NULL, NULL, NULL }, false, { 0 } },
        { { "Red", "Green", "Blue", NULL }, false, { 0 } },
    };
    static const int types[] = { T_UCHAR, T_UCHAR, T_UCHAR, T_UCHAR };
    static const double values[] = { 10, 20, 30, 40 };
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
            struct scan s;
            read_color(format, cases[i].names, types, values, &s);
            ck_assert_msg(s.info.colors == cases[i].colors, "case %zu", i);
            ck_assert_msg(!s.info.colors || memcmp(s.rgba[0], cases[i].wanted, 4) == 0, "case %zu", i);
            scan_free(&s);
        }
    }
}
END_TEST

START_TEST(colours_of_another_scale_than_their_type_are_taken_as_what_they_are)
{
    static const char *const names[] = { "red", "green", "blue", "alpha" };
    static const int types[] = { T_USHORT, T_USHORT, T_USHORT, T_UCHAR };
    static const int reals[] = { T_FLOAT, T_FLOAT, T_FLOAT, T_FLOAT };
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        struct scan s;
        read_color(format, names, types, (const double[]){ 232, 240, 220, 255 }, &s);
        ck_assert_str_eq(s.remark, "16-bit colours never exceed 240 and are taken as bytes");
        ck_assert_int_eq(memcmp(s.rgba[0], (uint8_t[]){ 232, 240, 220, 255 }, 4), 0);
        scan_free(&s);
        read_color(format, names, types, (const double[]){ 232, 256, 220, 255 }, &s);
        ck_assert_str_eq(s.remark, "");
        ck_assert_int_eq(memcmp(s.rgba[0], (uint8_t[]){ 1, 1, 1, 255 }, 4), 0);
        scan_free(&s);
        read_color(format, names, reals, (const double[]){ 17, 0, 250, 255 }, &s);
        ck_assert_str_eq(s.remark, "real colours reach 250 and are taken as 0 to 255");
        ck_assert_int_eq(memcmp(s.rgba[0], (uint8_t[]){ 17, 0, 250, 255 }, 4), 0);
        scan_free(&s);
        read_color(format, names, reals, (const double[]){ 65535, 0, 257, 256 }, &s);
        ck_assert_str_eq(s.remark, "real colours reach 65535 and are taken as 0 to 65535");
        ck_assert_int_eq(memcmp(s.rgba[0], (uint8_t[]){ 255, 0, 1, 1 }, 4), 0);
        scan_free(&s);
        read_color(format, names, reals, (const double[]){ 15.9, 0, 0.5, 1 }, &s);
        ck_assert_str_eq(s.remark, "");
        ck_assert_int_eq(memcmp(s.rgba[0], (uint8_t[]){ 255, 0, 128, 255 }, 4), 0);
        scan_free(&s);
    }
}
END_TEST

/* ---- text bodies ---------------------------------------------------------------------------- */

#define ASCII_SMALL "ply\nformat ascii 1.0\n" BODY_OF_SMALL "end_header\n"

static void read_text(const char *text, struct scan *s)
{
    scan_read_bytes(text, strlen(text), s);
}

START_TEST(text_rows_may_be_laid_out_freely)
{
    static const char *const bodies[] = {
        "0 0 0\n1 .5 -1\n2 1 -2\n3 1.5 -3\n3 0 1 2\n4 0 1 2 3\n",
        "0 0 0\n1 .5 -1\n2 1 -2\n3 1.5 -3\n3 0 1 2\n4 0 1 2 3",
        "0 0 0\r\n1 .5 -1\r\n2 1 -2\r\n3 1.5 -3\r\n3 0 1 2\r\n4 0 1 2 3\r\n",
        "0 0 0\r1 .5 -1\r2 1 -2\r3 1.5 -3\r3 0 1 2\r4 0 1 2 3\r",
        "\n\n 0\t0  0 \n\n1 +.5 -1.\n2e0 10e-1 -2\n  3 15.0E-1 -3\n\r\n3 0 1 2\n \t\n4 0 1 2 3\n\n \n",
        "comment now\n0 0 0\n1 .5 -1\nobj_info x\ncomment\n2 1 -2\n3 1.5 -3\n3 0.0 1 2\n4 0 1e0 2 3\n",
    };
    for (size_t i = 0; i < sizeof bodies / sizeof *bodies; i++) {
        struct file_text f = { .big = false };
        struct scan s;
        put(&f, ASCII_SMALL "%s", bodies[i]);
        scan_read(&f, &s);
        ply_expect_small(&s);
        ck_assert_str_eq(s.remark, "");
        scan_free(&s);
    }
}
END_TEST

START_TEST(spare_values_on_text_rows_are_passed_over_and_counted)
{
    struct scan s;
    read_text(ASCII_SMALL "0 0 0 9\n1 .5 -1\n2 1 -2 x y\n3 1.5 -3 \n3 0 1 2 9 0.5 0.5\n4 0 1 2 3", &s);
    ply_expect_small(&s);
    ck_assert_str_eq(s.remark, "2 rows of element 'vertex' have spare values; "
                     "1 rows of element 'face' have spare values");
    scan_free(&s);
}
END_TEST

START_TEST(text_rows_may_go_on_in_the_next_line)
{
    struct scan s;
    read_text(ASCII_SMALL "0\n0\n0\n1 .5\n-1\n2 1 -2\n3 1.5 -3\n3\n0 1 2\n4 0 1\r\n2\n\n3\n", &s);
    ply_expect_small(&s);
    ck_assert_str_eq(s.remark, "2 rows of element 'vertex' go on in the next line; "
                     "2 rows of element 'face' go on in the next line");
    scan_free(&s);
}
END_TEST

START_TEST(values_that_nobody_wants_need_not_be_numbers)
{
    struct file_text f = { .big = false };
    struct scan s;

    put(&f, "ply\nformat ascii 1.0\nelement vertex 2\n" PLY_XYZ "property int name\nproperty list uchar "
        "float more\nend_header\n1 2 3 abc 2 d ef\n4 5 6 ");
    for (int i = 0; i < 300000; i++)
        put(&f, "#");                           /* longer than the window */
    put(&f, " 1 x\n");
    scan_read(&f, &s);
    scan_expect_ok(&s);
    ck_assert(s.xyz[0][2] == 3 && s.xyz[1][0] == 4 && s.xyz[1][2] == 6);
    ck_assert_str_eq(s.remark, "");
    scan_free(&s);
}
END_TEST

START_TEST(text_reads_the_same_wherever_the_window_ends)
{
    /* Rows whose lengths vary, so that the window ends in every place of a row. */
    struct file_text f = { .big = false };
    struct scan s;
    enum { COUNT = 60000 };

    put(&f, "ply\nformat ascii 1.0\nelement vertex %d\n" PLY_XYZ "element face %d\n" PLY_INDEX_LIST
        "end_header\n", COUNT, COUNT);
    for (int i = 0; i < COUNT; i++)
        put(&f, "%d.%0*d %d\t-%.17g\n", i, i % 17 + 1, 5, i * 7, i / 3.0);
    for (int i = 0; i < COUNT; i++)
        put(&f, "%d %d %d %d%s", 3, i, i * 3, 7, i % 3 ? "\n" : " \r\n");
    scan_read(&f, &s);
    scan_expect_ok(&s);
    ck_assert_str_eq(s.remark, "");
    for (int i = 0; i < COUNT; i++) {
        SCAN_CHECK(fabs(s.xyz[i][0] - i - 5 / pow(10, i % 17 + 1)) < 1e-9);
        SCAN_CHECK(s.xyz[i][1] == i * 7 && s.xyz[i][2] == -(i / 3.0));
        scan_expect_triangle(&s, (size_t)i, (uint64_t)i, (uint64_t)i * 3, 7);
    }
    scan_free(&s);
}
END_TEST

START_TEST(bytes_behind_the_last_element_are_remarked)
{
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        struct file_text f = ply_small(format);
        struct scan s;
        put(&f, "%s12345", format == 0 ? "\n  " : "");
        scan_read(&f, &s);
        ply_expect_small(&s);
        ck_assert_str_eq(s.remark, "5 bytes behind the last element");
        scan_free(&s);
    }
}
END_TEST

/* ---- real files ----------------------------------------------------------------------------- */

static const struct {
    const char *path;
    uint64_t vertices, faces;           /* faces, or triangles of strips */
    enum spc_status status;
    const char *says;                   /* in the error, or in the remark */
} real_files[] = {
    { "scans/horse.ply", 48485, 96966, SPC_OK, "" },
    { "scans/dragon_vrip_res2.ply", 100250, 202520, SPC_OK, "" },
    { "scans/igea.ply", 134345, 268686, SPC_OK, "" },
    { "scans/kexueguanMesh.ply", 101098, 188876, SPC_OK, "" },
    { "scans/NZBWF1_J.ply", 106016, 213462, SPC_OK, "" },
    { "scans/test_mesh.ply", 38487, 76294, SPC_OK, "16-bit colours never exceed 255" },
    { "scans/Guanyin.ply", 238154, 0, SPC_OK, "" },
    { "odd/google.draco__Box.ply", 24, 8, SPC_OK, "" },
    { "odd/lato315.ply", 62702, 120995, SPC_OK, "" },
    { "odd/MRL_MPJ.ply", 103526, 208310, SPC_OK, "" },
    { "odd/ArmadilloBack_0.ply", 19283, 0, SPC_OK, "" },
    { "broken/Chagul.PlyViewer__cowbugPoint.ply", 0, 0, SPC_INPUT_FORMAT, "vertex 19 of 2903" },
    { "broken/assimp.assimp__ant-half.ply", 0, 0, SPC_INPUT_TRUNCATED, "face 259 of 912 is missing" },
    { "broken/assimp.assimp__issue623.ply", 0, 0, SPC_INPUT_FORMAT, "vertex 0 of 24" },
    { "broken/mikedh.trimesh__fuze_ascii.ply", 502, 1000, SPC_OK, "1000 rows of element 'face' have spare" },
};

START_TEST(real_files_give_their_known_counts)
{
    const char *const data = getenv("SPC_DATA");
    for (size_t i = 0; data && i < sizeof real_files / sizeof *real_files; i++) {
        char path[4096];
        struct scan s;
        snprintf(path, sizeof path, "%s/%s", data, real_files[i].path);
        scan_read_path(path, &s);
        ck_assert_msg(s.status == real_files[i].status, "%s: %s", path, s.err.what);
        if (s.status == SPC_OK) {
            ck_assert_uint_eq(s.vertex_count, real_files[i].vertices);
            ck_assert_uint_eq(s.faces_in, real_files[i].faces);
            ck_assert_msg(*real_files[i].says || !*s.remark, "%s: %s", path, s.remark);
        }
        ck_assert_msg(strstr(s.status == SPC_OK ? s.remark : s.err.what, real_files[i].says) != NULL,
                      "%s: '%s' '%s'", path, s.err.what, s.remark);
        scan_free(&s);
    }
}
END_TEST

int main(void)
{
    return SUITE("ply", scan_start, scan_finish,
                 header_lines_may_end_in_lf_crlf_or_cr,
                 a_first_data_byte_that_looks_like_a_line_end_is_kept,
                 end_header_may_be_followed_by_blanks_and_odd_ends,
                 comments_and_obj_info_stand_anywhere,
                 lines_without_keyword_are_passed_over_and_remarked,
                 a_header_without_body_may_end_the_file,
                 every_scalar_type_goes_by_both_names,
                 real_coordinates_come_exactly,
                 of_a_property_named_twice_the_first_counts,
                 colours_come_in_every_type,
                 colours_go_by_several_names_and_need_all_three,
                 colours_of_another_scale_than_their_type_are_taken_as_what_they_are,
                 text_rows_may_be_laid_out_freely,
                 spare_values_on_text_rows_are_passed_over_and_counted,
                 text_rows_may_go_on_in_the_next_line,
                 values_that_nobody_wants_need_not_be_numbers,
                 text_reads_the_same_wherever_the_window_ends,
                 bytes_behind_the_last_element_are_remarked,
                 real_files_give_their_known_counts);
}
