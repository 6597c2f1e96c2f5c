/*
 * PLY files that are to be refused, and that nothing happens to the reader whatever the bytes:
 * every prefix, every bit of a header, random bytes. Files are small, so the reader's window is
 * exactly as large as the file and a memory checker sees each step over its end.
 */
#include "ply.h"

#include <math.h>

#include "ply_case.h"

static void expect_text_fails(const char *text, enum spc_status status, const char *part)
{
    struct scan s;
    scan_read_bytes(text, strlen(text), &s);
    scan_expect_failure(&s, status, part);
    scan_free(&s);
}

/* ---- headers -------------------------------------------------------------------------------- */

START_TEST(files_of_no_known_format_are_named_as_such)
{
    static const struct {
        const char *text, *part;
    } cases[] = {
        { "", "empty" }, { "p", "not a scan" }, { "pl\n", "not a scan" }, { "plyx\n", "not a scan" },
        { "PLY\n", "known format (PLY, SPC, " }, { " ply\n", "not a scan" }, { "solid x\n", "not a scan" },
        { "\x1f\x8b\x08 and so on", "gzip" }, { "PK\x03\x04 and so on", "zip" },
        { "version https://git-lfs.github.com/spec/v1\n", "Git LFS pointer" },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        expect_text_fails(cases[i].text, SPC_INPUT_FORMAT, cases[i].part);
}
END_TEST

START_TEST(what_is_not_a_regular_file_is_refused)
{
    struct scan s;
    scan_read_path(scan_folder, &s);
    scan_expect_failure(&s, SPC_INPUT_FORMAT, "a directory");
    scan_read_path("/dev/null", &s);
    scan_expect_failure(&s, SPC_INPUT_FORMAT, "device");
    scan_read_path("/nonexistent/file.ply", &s);
    scan_expect_failure(&s, SPC_IO, "cannot open");
    ck_assert_int_ne(s.err.os_errno, 0);
}
END_TEST

#define START "ply\nformat ascii 1.0\n"
#define VERTEX "element vertex 1\n" PLY_XYZ
#define END "end_header\n0 0 0\n"

START_TEST(headers_that_make_no_sense_are_refused_naming_the_line)
{
    static const struct {
        const char *text, *part;
    } cases[] = {
        { "ply x\n" VERTEX END, "line 1: 'ply' should stand here alone" },
        { "ply\n" VERTEX END, "no line 'format'" },
        { "ply\nformat ascii 1.0\nformat ascii 1.0\n" VERTEX END, "line 3: a second 'format'" },
        { "ply\nformat\n" VERTEX END, "line 2: format '' is none of" },
        { "ply\nformat binary 1.0\n" VERTEX END, "line 2: format 'binary' is none of" },
        { "ply\nformat ascii 2.0\n" VERTEX END, "line 2: version '2.0'" },
        { START "element vertex\n" END, "line 3: 'element' without name and count" },
        { START "element vertex -1\n" END, "line 3: '-1' is not a count" },
        { START "element vertex 1.0\n" END, "line 3: '1.0' is not a count" },
        { START "element vertex 18446744073709551616\n" END, "is not a count" },
        { START "element vertex 99999999999999999999\n" END, "is not a count" },
        { START "property float x\n" END, "line 3: a property before any element" },
        { START "element vertex 1\nproperty float\n" END, "line 4: 'property' without type and name" },
        { START "element vertex 1\nproperty\n" END, "line 4: 'property' without" },
        { START "element face 1\nproperty list uchar int\n" END, "line 4: 'property' without" },
        { START "element vertex 1\nproperty int64 x\n" END, "line 4: 'int64' is none of PLY's types" },
        { START "element vertex 1\nproperty uint64 x\n" END, "'uint64' is none of" },
        { START "element vertex 1\nproperty long x\n" END, "'long' is none of" },
        { START "element vertex 1\nproperty Float x\n" END, "'Float' is none of" },
        { START "element face 1\nproperty list uchar size_t i\n" END, "'size_t' is none of" },
        { START "element face 1\nproperty list half int i\n" END, "'half' is none of" },
        { START "element face 1\nproperty list float int i\n" END, "a list cannot be counted in 'float'" },
        { START "element face 1\nproperty list float64 int i\n" END, "cannot be counted" },
        { START VERTEX VERTEX END, "line 7: a second element 'vertex'" },
        { START VERTEX "element face 0\nelement face 0\n" END, "line 8: a second element 'face'" },
        { START VERTEX "element face 0\nelement faces 0\n" END, "a second element 'faces'" },
        { START VERTEX "element tristrips 0\nelement tristrips 0\n" END, "a second element 'tristrips'" },
        { START "element face 0\n" END, "no element 'vertex'" },
        { START "element vertex 1\nproperty float x\nproperty float y\n" END, "no property 'z'" },
        { START "element vertex 1\nproperty list uchar float x\nproperty float y\nproperty float z\n" END,
          "no property 'x'" },
        { START "element vertex 1\n" END, "no property 'x'" },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        expect_text_fails(cases[i].text, SPC_INPUT_FORMAT, cases[i].part);
}
END_TEST

START_TEST(a_header_fault_gives_the_byte_of_its_line)
{
    struct scan s;
    static const char text[] = START "element vertex 1\nproperty int128 x\n";
    scan_read_bytes(text, sizeof text - 1, &s);
    ck_assert_uint_eq(s.err.at_off, sizeof START - 1 + sizeof "element vertex 1\n" - 1);
}
END_TEST

START_TEST(a_header_without_end_is_cut_short)
{
    expect_text_fails("ply", SPC_INPUT_TRUNCATED, "in line 1");
    expect_text_fails("ply\n", SPC_INPUT_TRUNCATED, "in line 2");
    expect_text_fails(START VERTEX, SPC_INPUT_TRUNCATED, "inside its header, in line 7");
    expect_text_fails(START VERTEX "end_heade", SPC_INPUT_TRUNCATED, "in line 7");
    expect_text_fails(START VERTEX "end_headerx", SPC_INPUT_TRUNCATED, "in line 7");
}
END_TEST

START_TEST(headers_have_limits)
{
    struct file_text f = { .big = false };
    struct scan s;

    put(&f, START "element vertex 1\nproperty float ");
    for (int i = 0; i < 2000; i++)
        put(&f, "x");
    put(&f, "\n" END);
    scan_read(&f, &s);
    scan_expect_failure(&s, SPC_INPUT_FORMAT, "line 4: longer than 1023 characters");

    put(&f, START);
    for (int i = 0; i < 70000; i++)
        put(&f, "comment 12345678\n");
    put(&f, VERTEX END);
    scan_read(&f, &s);
    scan_expect_failure(&s, SPC_INPUT_FORMAT, "no 'end_header' in the first 1048576 bytes");

    for (int extra = 0; extra < 2; extra++) {
        put(&f, START VERTEX);
        for (int i = 0; i < 255 + extra; i++)
            put(&f, "element e%d 0\n", i);
        put(&f, END);
        scan_read(&f, &s);
        if (extra)
            scan_expect_failure(&s, SPC_INPUT_FORMAT, "more than 256 elements");
        else
            scan_expect_ok(&s);
        scan_free(&s);

        put(&f, START VERTEX "element wide 0\n");
        for (int i = 0; i < 4093 + extra; i++)
            put(&f, "property double p%d\n", i);
        put(&f, END);
        scan_read(&f, &s);
        if (extra)
            scan_expect_failure(&s, SPC_INPUT_FORMAT, "more than 4096 properties");
        else
            scan_expect_ok(&s);
        scan_free(&s);
    }
}
END_TEST

START_TEST(a_row_of_the_largest_size_is_read)
{
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        struct file_text f = ply_start(format);
        struct scan s;
        put(&f, "element vertex 20\n");
        for (int i = 0; i < 4093; i++)
            put(&f, "property double p%d\n", i);
        put(&f, PLY_XYZ "end_header\n");
        for (int i = 0; i < 20; i++) {
            for (int k = 0; k < 4096; k++)
                ply_value(&f, format, k < 4093 ? T_DOUBLE : T_FLOAT, k < 4093 ? -1e99 : i);
            ply_row_end(&f, format);
        }
        scan_read(&f, &s);
        scan_expect_ok(&s);
        ck_assert(s.xyz[19][0] == 19 && s.xyz[0][2] == 0);
        scan_free(&s);
    }
}
END_TEST

START_TEST(counts_that_cannot_fit_the_file_are_refused_at_open)
{
    static const char *const counts[] = { "5", "1000", "4294967296", "18446744073709551615",
                                          "1537228672809129302" /* times 12 wraps to 8 */ };
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
            struct file_text f = ply_start(format);
            struct spb_source *source = NULL;
            struct spc_error err = { 0 };
            put(&f, "element vertex %s\n" PLY_XYZ "end_header\n", counts[i]);
            if (format > 0)
                ply_vertices(&f, format, 4);
            else
                put(&f, "0 0 0\n0 0 0\n0 0 0\n0 0 0");
            scan_write(f.data, f.bytes);
            free(f.data);
            ck_assert_int_eq(spb_source_open(scan_path, NULL, &source, &err), SPC_INPUT_TRUNCATED);
            ck_assert_ptr_null(source);
            ck_assert_ptr_nonnull(strstr(err.what, "element 'vertex'"));
        }
    }
    /* Each element by itself would fit. */
    expect_text_fails(START "element vertex 2\n" PLY_XYZ "element face 2\n" PLY_INDEX_LIST
                      "end_header\n0 0 0\n0 0 0\n0 ", SPC_INPUT_TRUNCATED, "element 'face': 2 rows");
    /* And this fits to the byte. */
    static const char exact[] = START "element vertex 2\n" PLY_XYZ "element face 2\n" PLY_INDEX_LIST
        "end_header\n0 0 0\n0 0 0\n0\n0";
    struct scan s;
    scan_read_bytes(exact, sizeof exact - 1, &s);
    scan_expect_ok(&s);
    scan_free(&s);
}
END_TEST

/* ---- bodies --------------------------------------------------------------------------------- */

START_TEST(a_body_cut_short_names_element_and_row)
{
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        struct file_text f = ply_start(format);
        struct scan s;
        size_t rows[200];
        put(&f, "element vertex 4\n" PLY_XYZ "element face 100\n" PLY_INDEX_LIST "end_header\n");
        ply_vertices(&f, format, 4);
        for (int i = 0; i < 100; i++) {
            rows[i] = f.bytes;
            ply_face(&f, format, 3, (const int[]){ 1000, 2000, 3000 });
        }
        scan_read_bytes(f.data, rows[59], &s);
        scan_expect_failure(&s, SPC_INPUT_TRUNCATED, "face 59 of 100 is missing: the file ends");
        ck_assert_uint_eq(s.err.at_off, rows[59]);
        scan_free(&s);
        scan_read_bytes(f.data, rows[59] + 1, &s);
        scan_expect_failure(&s, SPC_INPUT_TRUNCATED, "face 59 of 100 is cut short: the file ends");
        scan_free(&s);
        scan_read_bytes(f.data, rows[60] - 7, &s);
        scan_expect_failure(&s, SPC_INPUT_TRUNCATED, "face 59 of 100 is cut short");
        scan_free(&s);
        free(f.data);
    }
}
END_TEST

START_TEST(of_a_binary_list_cut_short_nothing_is_delivered)
{
    for (int format = 1; format < PLY_FORMAT_COUNT; format++) {
        struct file_text f = ply_start(format);
        struct spb_source *source;
        struct spc_error err = { 0 };
        put(&f, "element vertex 1\n" PLY_XYZ "element face 3\nproperty list int int vertex_index\nend_header\n");
        ply_vertices(&f, format, 1);
        for (int i = 0; i < 20000; i++)
            ply_value(&f, format, T_INT, i < 2 ? 0 : i == 2 ? 19998 : i);
        scan_write(f.data, f.bytes);
        free(f.data);
        ck_assert_int_eq(spb_source_open(scan_path, NULL, &source, NULL), SPC_OK);
        ck_assert_int_eq(spb_source_begin_faces(source, NULL), SPC_OK);
        ck_assert_int_eq(spb_source_faces(source, &scan_faces, &err), SPC_INPUT_TRUNCATED);
        ck_assert_uint_eq(scan_faces.count, 0);
        ck_assert_str_eq(err.what, "face 2 of 3 is cut short: the file ends");
        spb_source_close(source);
    }
}
END_TEST

START_TEST(an_element_that_nobody_wants_must_be_whole_too)
{
    static const char *const rows[] = { "property float q\n", "property list uchar float q\n" };
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        for (int list = 0; list < 2; list++) {
            for (int first = 0; first < 2; first++) {
                struct file_text f = ply_start(format);
                struct scan s;
                put(&f, "element face 9\n" PLY_INDEX_LIST "%selement vertex 1\n" PLY_XYZ "%send_header\n",
                    first ? "element other 9\nproperty list uchar float q\n" : "",
                    first ? "" : "element other 9\n");
                if (!first) {
                    f.bytes -= strlen("end_header\n");
                    put(&f, "%send_header\n", rows[list]);
                }
                for (int i = 0; i < 9; i++)
                    ply_face(&f, format, 3, (const int[]){ 10000, 20000, 30000 });
                if (!first)
                    ply_vertices(&f, format, 1);
                for (int i = 0; i < 5; i++) {
                    if (list || first)
                        ply_value(&f, format, T_UCHAR, 1);
                    ply_value(&f, format, T_FLOAT, 1.5);
                    ply_row_end(&f, format);
                }
                scan_read(&f, &s);
                ck_assert_int_eq(s.status, SPC_INPUT_TRUNCATED);
                ck_assert_ptr_nonnull(strstr(s.err.what, "other"));
                scan_free(&s);
            }
        }
    }
}
END_TEST

START_TEST(list_counts_that_are_negative_or_absurd_are_refused)
{
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        static const int types[] = { T_CHAR, T_SHORT, T_INT, T_UINT, T_USHORT };
        for (int t = 0; t < 5; t++) {
            for (int where = 0; where < 3; where++) {
                static const char *const names[] = { "face", "face", "vertex" };
                const double count = t < 3 ? -1 : t == 3 ? 4294967295.0 : 65535;
                struct file_text f = ply_start(format);
                struct scan s;
                size_t at = 0;
                char part[80];
                put(&f, "element vertex 1\n" PLY_XYZ "%s%s %s vertex_index\nend_header\n",
                    where == 2 ? "property list " : where == 1 ?
                    "element face 2\n" PLY_INDEX_LIST "property list " : "element face 2\nproperty list ",
                    ply_types[types[t]].name, "int");
                ply_vertices(&f, format, 1);
                if (where == 2 && format == 0)
                    f.bytes -= 2;               /* go on in the row */
                if (where == 2 && format == 0)
                    put(&f, " ");
                for (int i = 0; i < 2 && where < 2; i++) {
                    if (where == 1)
                        ply_value(&f, format, T_UCHAR, 0);
                    at = f.bytes;
                    ply_value(&f, format, types[t], i == 0 ? 0 : count);
                    ply_row_end(&f, format);
                }
                if (where == 2) {
                    at = f.bytes;
                    ply_value(&f, format, types[t], count);
                    ply_row_end(&f, format);
                }
                scan_read(&f, &s);
                snprintf(part, sizeof part, "%s %d of %d: ", names[where], where < 2, where < 2 ? 2 : 1);
                scan_expect_failure(&s, SPC_INPUT_FORMAT, part);
                ck_assert_ptr_nonnull(strstr(s.err.what, t < 3 ? "count of a list" : "cannot be in a file"));
                ck_assert_uint_eq(s.err.at_off, at);
                scan_free(&s);
            }
        }
    }
}
END_TEST

START_TEST(text_that_is_no_number_names_element_row_and_byte)
{
    static const struct {
        const char *body, *part;
        size_t at;
    } cases[] = {
        { "0 0 0\n0 x1 0\n3 0 1 2\n", "vertex 1 of 2: 'x1' is not a number", 8 },
        { "0 0 0\n0 1,5 0\n3 0 1 2\n", "vertex 1 of 2: '1,5' is not a number", 8 },
        { "0 0 0\n0 0 0x10\n3 0 1 2\n", "vertex 1 of 2: '0x10' is not a number", 10 },
        { "0 0 0\n0 0 1..2\n3 0 1 2\n", "'1..2' is not a number", 10 },
        { "0 0 0\n0 0 \x01\xff\n3 0 1 2\n", "'?\?' is not a number", 10 },
        { "0 0 0\n0 0 a23456789012345678901234567890\n3 0 1 2\n",
          "'a23456789012345678901234...' is not a number", 10 },
        { "0 0 0\n0 0 0\n3 0 one 2\n", "face 0 of 1: 'one' is not a vertex number", 16 },
        { "0 0 0\n0 0 0\nthree 0 1 2\n", "face 0 of 1: 'three' is not a count of a list", 12 },
        { "0 0 0\n0 0 0\n3.5 0 1 2\n", "face 0 of 1: '3.5' is not a count of a list", 12 },
        { "0 0 0\n0 0 0\n3x 0 1 2\n", "'3x' is not a count", 12 },
        { "0 0\n0 0 0\n3 0 1 2\n", "vertex 0 of 2: its line holds too few values", 0 },
        { "0 0 0\n0 0\n3 0 1 2\n", "vertex 1 of 2: its line holds too few values", 6 },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct file_text f = ply_start(0);
        struct scan s;
        put(&f, "element vertex 2\n" PLY_XYZ "element face 1\n" PLY_INDEX_LIST "end_header\n");
        const size_t body = f.bytes;
        put(&f, "%s", cases[i].body);
        scan_read(&f, &s);
        scan_expect_failure(&s, SPC_INPUT_FORMAT, cases[i].part);
        ck_assert_uint_eq(s.err.at_off, body + cases[i].at);
        scan_free(&s);
    }
}
END_TEST

START_TEST(a_nul_byte_in_text_is_no_blank)
{
    struct file_text f = { .big = false };
    struct scan s;
    put(&f, START "element vertex 2\n" PLY_XYZ "end_header\n0 0 0\n0 %c 0\n", 0);
    scan_read(&f, &s);
    scan_expect_failure(&s, SPC_INPUT_FORMAT, "vertex 1 of 2: '?' is not a number");
    scan_free(&s);
    put(&f, START "element vertex 2\n" PLY_XYZ "end_header\n0 0 0\n0 0%c0 0\n", 0);
    scan_read(&f, &s);
    scan_expect_failure(&s, SPC_INPUT_FORMAT, "vertex 1 of 2: '0?0' is not a number");
    scan_free(&s);
}
END_TEST

START_TEST(a_number_longer_than_the_window_is_refused)
{
    struct file_text f = { .big = false };
    struct scan s;
    put(&f, START "element vertex 1\n" PLY_XYZ "end_header\n0 0 0.");
    for (int i = 0; i < 600000; i++)
        put(&f, "1");
    put(&f, "\n");
    scan_read(&f, &s);
    scan_expect_failure(&s, SPC_INPUT_FORMAT, "vertex 0 of 1: '0.1111111111111111111111...' is not");
    scan_free(&s);
}
END_TEST

START_TEST(rows_short_of_values_are_mentioned_when_the_file_ends_early)
{
    /* Every row is a value short, so that two lines make one row and all is used up half way. */
    struct file_text f = ply_start(0);
    struct scan s;
    put(&f, "element vertex 100\nproperty float x\nproperty float y\nproperty float z\n"
        "property float q\nend_header\n");
    for (int i = 0; i < 100; i++)
        put(&f, "%d000 %d000\n", i, i);
    scan_read(&f, &s);
    scan_expect_failure(&s, SPC_INPUT_TRUNCATED,
                        "vertex 50 of 100 is missing: the file ends (50 rows before it went on in the next line)");
    scan_free(&s);
}
END_TEST

START_TEST(a_pass_that_failed_stays_failed_until_it_begins_anew)
{
    struct spb_source *source;
    struct spc_error err = { 0 };
    static const char text[] = START VERTEX "element face 2\n" PLY_INDEX_LIST "end_header\n0 0 0\n3 0 1 2\nx";

    scan_write(text, sizeof text - 1);
    ck_assert_int_eq(spb_source_open(scan_path, NULL, &source, NULL), SPC_OK);
    for (int i = 0; i < 2; i++) {
        ck_assert_int_eq(spb_source_begin_faces(source, NULL), SPC_OK);
        ck_assert_int_eq(spb_source_faces(source, &scan_faces, NULL), SPC_INPUT_FORMAT);
        ck_assert_uint_eq(scan_faces.count, 0);
        ck_assert_int_eq(spb_source_faces(source, &scan_faces, &err), SPC_INPUT_FORMAT);
        ck_assert_int_eq(spb_source_vertices(source, &scan_vertices, NULL), SPC_INPUT_FORMAT);
        ck_assert_int_eq(spb_source_begin_vertices(source, NULL), SPC_OK);
        ck_assert_int_eq(spb_source_vertices(source, &scan_vertices, NULL), SPC_OK);
        ck_assert_uint_eq(scan_vertices.count, 1);
    }
    spb_source_close(source);
}
END_TEST

/* ---- any bytes ------------------------------------------------------------------------------ */

/* One small file of everything. *header: bytes before the body. */
static struct file_text everything(int format, size_t *header)
{
    struct file_text f = ply_start(format);

    put(&f, "comment c\nelement camera 1\nproperty double v\nelement face 2\nproperty list uchar int "
        "vertex_indices\nproperty list uchar float t\nproperty uchar f\nelement vertex 3\nproperty float x\n"
        "property double y\nproperty short z\nproperty uchar red\nproperty ushort green\nproperty float blue\n"
        "property list char short seen\nelement tristrips 1\nproperty list int int vertex_indices\n"
        "obj_info o\nelement edge 1\nproperty list uint char e\nend_header\n");
    *header = f.bytes;
    ply_value(&f, format, T_DOUBLE, 0.5);
    ply_row_end(&f, format);
    for (int i = 0; i < 2; i++) {
        ply_value(&f, format, T_UCHAR, 3 + i);
        for (int k = 0; k < 3 + i; k++)
            ply_value(&f, format, T_INT, k);
        ply_value(&f, format, T_UCHAR, 1);
        ply_value(&f, format, T_FLOAT, 0.25);
        ply_value(&f, format, T_UCHAR, 9);
        ply_row_end(&f, format);
    }
    for (int i = 0; i < 3; i++) {
        ply_value(&f, format, T_FLOAT, i);
        ply_value(&f, format, T_DOUBLE, i / 3.0);
        ply_value(&f, format, T_SHORT, -i);
        ply_value(&f, format, T_UCHAR, 10);
        ply_value(&f, format, T_USHORT, 10000);
        ply_value(&f, format, T_FLOAT, 0.5);
        ply_value(&f, format, T_CHAR, 1);
        ply_value(&f, format, T_SHORT, 300);
        ply_row_end(&f, format);
    }
    for (int i = 0; i < 6; i++)
        ply_value(&f, format, T_INT, i == 0 ? 5 : i == 4 ? -1 : i);
    ply_row_end(&f, format);
    ply_value(&f, format, T_UINT, 2);
    ply_value(&f, format, T_CHAR, 0);
    ply_value(&f, format, T_CHAR, 1);
    ply_row_end(&f, format);
    return f;
}

START_TEST(every_prefix_gives_an_error_or_the_whole)
{
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        size_t header;
        struct file_text f = everything(format, &header);
        struct scan whole;
        scan_read_bytes(f.data, f.bytes, &whole);
        scan_expect_ok(&whole);
        ck_assert_uint_eq(whole.triangle_count, 4);
        /* In text the last value, its blank and the line end may go unnoticed. */
        const size_t needed = format == 0 ? f.bytes - 2 : f.bytes;
        for (size_t bytes = 0; bytes < f.bytes; bytes++) {
            struct scan s;
            scan_read_bytes(f.data, bytes, &s);
            if (bytes >= needed) {
                scan_expect_ok(&s);
                ck_assert(scan_same(&whole, &s));
            } else {
                ck_assert_msg(s.status == (bytes < 4 && bytes != 3 ? SPC_INPUT_FORMAT : SPC_INPUT_TRUNCATED) ||
                              (bytes >= header && s.status == SPC_INPUT_FORMAT),
                              "format %d, %zu bytes: %s", format, bytes, s.err.what);
            }
            scan_free(&s);
        }
        scan_free(&whole);
        free(f.data);
    }
}
END_TEST

START_TEST(every_bit_of_the_header_may_be_wrong)
{
    int read = 0, refused = 0;
    for (int format = 0; format < PLY_FORMAT_COUNT; format++) {
        size_t header;
        struct file_text f = everything(format, &header);
        for (size_t i = 0; i < header * 9; i++) {
            const uint8_t old = f.data[i / 9];
            struct scan s;
            f.data[i / 9] = (uint8_t)(old ^ (i % 9 < 8 ? 1u << i % 9 : 0xffu));
            scan_read_bytes(f.data, f.bytes, &s);
            if (s.status == SPC_OK)
                read++;
            else
                refused++;
            scan_free(&s);
            f.data[i / 9] = old;
        }
        free(f.data);
    }
    ck_assert_int_gt(read, 1000);               /* comments and names of no importance */
    ck_assert_int_gt(refused, 4000);
}
END_TEST

START_TEST(any_byte_of_the_body_may_be_wrong)
{
    uint64_t random = 1234567;
    printf("seed %" PRIu64 "\n", random);
    for (int round = 0; round < 6000; round++) {
        size_t header;
        struct file_text f = everything(round % 3, &header);
        struct scan s;
        const int faults = 1 + (int)(ply_random(&random) % 4);
        for (int i = 0; i < faults; i++) {
            static const char likely[] = "0123456789+-.eE \n\r\txnai#";
            const size_t at = header + ply_random(&random) % (f.bytes - header);
            f.data[at] = (uint8_t)ply_random(&random);
            if (round % 3 == 0)
                f.data[at] = (uint8_t)likely[ply_random(&random) % (sizeof likely - 1)];
        }
        scan_read(&f, &s);
        scan_free(&s);
    }
}
END_TEST

START_TEST(random_bytes_behind_a_header_are_survived)
{
    static const char *const lists[] = { "char char", "uchar int", "ushort double", "int short", "uint uchar" };
    uint64_t random = 7654321;
    printf("seed %" PRIu64 "\n", random);
    for (int round = 0; round < 4000; round++) {
        struct file_text f = ply_start(round % 3);
        const size_t bytes = ply_random(&random) % 600;
        struct scan s;
        put(&f, "element vertex %d\n" PLY_XYZ "%selement %s %d\nproperty list %s vertex_index\nend_header\n",
            (int)(ply_random(&random) % 20), round % 7 ? "" : "property list char int l\n",
            round % 5 ? "face" : "tristrips", (int)(ply_random(&random) % 60),
            lists[ply_random(&random) % 5]);
        for (size_t i = 0; i < bytes; i++) {
            const uint64_t r = ply_random(&random);
            put_int(&f, 1, round % 3 ? (int64_t)(r % 3 ? r >> 8 : r >> 8 & 7) :
                    (int64_t)"0123456789-. \n \n \n"[r % 18]);
        }
        scan_read(&f, &s);
        scan_free(&s);
    }
}
END_TEST

int main(void)
{
    return SUITE("ply_bad", scan_start, scan_finish,
                 files_of_no_known_format_are_named_as_such,
                 what_is_not_a_regular_file_is_refused,
                 headers_that_make_no_sense_are_refused_naming_the_line,
                 a_header_fault_gives_the_byte_of_its_line,
                 a_header_without_end_is_cut_short,
                 headers_have_limits,
                 a_row_of_the_largest_size_is_read,
                 counts_that_cannot_fit_the_file_are_refused_at_open,
                 a_body_cut_short_names_element_and_row,
                 of_a_binary_list_cut_short_nothing_is_delivered,
                 an_element_that_nobody_wants_must_be_whole_too,
                 list_counts_that_are_negative_or_absurd_are_refused,
                 text_that_is_no_number_names_element_row_and_byte,
                 a_nul_byte_in_text_is_no_blank,
                 a_number_longer_than_the_window_is_refused,
                 rows_short_of_values_are_mentioned_when_the_file_ends_early,
                 a_pass_that_failed_stays_failed_until_it_begins_anew,
                 every_prefix_gives_an_error_or_the_whole,
                 every_bit_of_the_header_may_be_wrong,
                 any_byte_of_the_body_may_be_wrong,
                 random_bytes_behind_a_header_are_survived);
}
