/*
 * The OBJ reader: lines, vertices, faces, what is passed over and what is refused. Textures and
 * materials: test_obj_colors.c. Real files when the environment says with SPC_DATA where they are.
 */
#include "obj.h"

#include <math.h>

#include "scan_case.h"

/* Reads text, and again with CR LF and CR in place of LF: all must give the same. */
static void read_text(const char *text, struct scan *s)
{
    static const char *const ends[] = {"\r\n", "\r"};
    scan_read_bytes(text, strlen(text), s);
    for (int e = 0; e < 2; e++) {
        struct file_text f = {.big = false};
        struct scan other;
        for (const char *p = text; *p; p++)
            put_bytes(&f, *p == '\n' ? ends[e] : p, *p == '\n' ? strlen(ends[e]) : 1);
        scan_read(&f, &other);
        SCAN_CHECK(other.status == s->status);
        SCAN_CHECK(s->status != SPC_OK || scan_same(s, &other));
        if (s->status == SPC_OK)
            ck_assert_str_eq(s->remark, other.remark);
        else
            ck_assert_str_eq(s->err.what, other.err.what);
        scan_free(&other);
    }
}

static void expect_vertex(const struct scan *s, size_t i, double x, double y, double z)
{
    SCAN_CHECK(i < s->vertex_count);
    SCAN_CHECK(s->xyz[i][0] == x && s->xyz[i][1] == y && s->xyz[i][2] == z);
}

static void expect_color(const struct scan *s, size_t i, unsigned r, unsigned g, unsigned b,
                         unsigned a)
{
    const uint8_t *const c = s->rgba[i];
    ck_assert_msg(c[0] == r && c[1] == g && c[2] == b && c[3] == a, "colour %u %u %u %u", c[0],
                  c[1], c[2], c[3]);
}

#define FOUR "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.5\n"

START_TEST(corners_come_in_all_four_styles)
{
    struct scan s;
    read_text("# a comment\nmtllib a.mtl\no thing\n" FOUR "vt 0 0\nvn 0 0 1\ng one two\ns off\n"
              "f 1 2 3\nf 1/1 2/1 4/1\nf 1//1 3//1 4//1\nf 2/1/1 3/1/1 4/1/1\nf 1// 2// 3//\n", &s);
    scan_expect_ok(&s);
    ck_assert_str_eq(s.info.format, "obj");
    ck_assert_uint_eq(s.vertex_count, 4);
    ck_assert_uint_eq(s.triangle_count, 5);
    expect_vertex(&s, 3, 0, 1, 0.5);
    scan_expect_triangle(&s, 0, 0, 1, 2);
    scan_expect_triangle(&s, 1, 0, 1, 3);
    scan_expect_triangle(&s, 2, 0, 2, 3);
    scan_expect_triangle(&s, 3, 1, 2, 3);
    scan_expect_triangle(&s, 4, 0, 1, 2);
    ck_assert(!s.info.colors && !s.info.wide);
    ck_assert_str_eq(s.remark, "");
    scan_free(&s);
}
END_TEST

START_TEST(polygons_become_fans_and_short_faces_are_counted)
{
    struct scan s;
    read_text(FOUR "f 1 2 3 4\nf 2 3\nfo 4 3 2 1\nf\nf 1\n", &s);
    scan_expect_ok(&s);
    ck_assert_uint_eq(s.faces_in, 5);
    ck_assert_uint_eq(s.split_extra, 2);
    ck_assert_uint_eq(s.faces_short, 3);
    scan_expect_triangle(&s, 0, 0, 1, 2);
    scan_expect_triangle(&s, 1, 0, 2, 3);
    scan_expect_triangle(&s, 2, 3, 2, 1);
    scan_expect_triangle(&s, 3, 3, 1, 0);
    scan_free(&s);
}
END_TEST

START_TEST(negative_indices_count_back_from_the_vertices_before_their_line)
{
    struct scan s;
    read_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nf 1 2 4\nv 5 5 5\nf -1 -4 2\nf -5 1 2\n"
              "v 6 6 6\nf -1/-1 -2//-7 -3/-4/-5\n", &s);
    scan_expect_ok(&s);
    scan_expect_triangle(&s, 0, 0, 1, 2);
    scan_expect_triangle(&s, 1, 0, 1, 3);
    scan_expect_triangle(&s, 2, 3, 0, 1);
    scan_expect_triangle(&s, 3, SPB_BAD_INDEX, 0, 1);
    scan_expect_triangle(&s, 4, 4, 3, 2);
    scan_free(&s);
}
END_TEST

START_TEST(indices_that_name_no_vertex_are_delivered_or_marked)
{
    struct scan s;
    read_text(FOUR "f 0 1 2\nf 1 2 5\nf 1 2 99999999999999999999999\nf 1 2 123456789012345678\n", &s);
    scan_expect_ok(&s);
    scan_expect_triangle(&s, 0, SPB_BAD_INDEX, 0, 1);
    scan_expect_triangle(&s, 1, 0, 1, 4);
    scan_expect_triangle(&s, 2, 0, 1, SPB_BAD_INDEX);
    scan_expect_triangle(&s, 3, 0, 1, 123456789012345677);
    scan_free(&s);
}
END_TEST

/* Objects of a vertex block and a face block each, far enough apart to be ranges of their own. */
START_TEST(ranges_far_apart_keep_counting)
{
    enum { OBJECTS = 700, FILLER = 1500 };
    struct file_text f = {.big = false};
    struct scan s;
    for (int k = 0; k < OBJECTS; k++) {
        put(&f, "o object%d\nv %d 0 0\nv %d 1 0\nv %d 0 1\n", k, k, k, k);
        for (int i = 0; i < FILLER && k < 350; i++)
            put(&f, "vn 0.123456 0.654321 0.777777 # %d of many\n", i);
        put(&f, "f -3 -2 -1\n");
        for (int i = 0; i < FILLER && k % 2 == 1; i++)
            put(&f, "vt 0.123456 0.654321 0.777777 # %d of many\n", i);
    }
    scan_read(&f, &s);
    scan_expect_ok(&s);
    ck_assert_uint_eq(s.vertex_count, 3 * OBJECTS);
    ck_assert_uint_eq(s.triangle_count, OBJECTS);
    for (int k = 0; k < OBJECTS; k++) {
        const uint64_t first = 3 * (uint64_t)k;
        scan_expect_triangle(&s, (size_t)k, first, first + 1, first + 2);
        SCAN_CHECK(s.xyz[3 * k + 1][0] == k);
    }
    scan_free(&s);
}
END_TEST

START_TEST(passes_leave_out_what_they_do_not_want)
{
    struct file_text f = {.big = false};
    struct spb_source *source;
    for (int i = 0; i < 5000; i++)
        put(&f, "v %d 0 0\n", i);
    const uint64_t vertices = f.bytes;
    for (int i = 0; i < 20000; i++)
        put(&f, "vn 0.123456 0.654321 0.777777\n");
    const uint64_t before = f.bytes;
    for (int i = 0; i < 5000; i++)
        put(&f, "f 1 2 %d\n", i);
    const uint64_t end = f.bytes;
    scan_write(f.data, f.bytes);
    free(f.data);
    ck_assert_int_eq(spb_source_open(scan_path, NULL, &source, NULL), SPC_OK);
    ck_assert_int_eq(spb_source_begin_vertices(source, NULL), SPC_OK);
    do
        ck_assert_int_eq(spb_source_vertices(source, &scan_vertices, NULL), SPC_OK);
    while (scan_vertices.count > 0);
    ck_assert_uint_eq(spb_source_bytes_done(source), vertices);
    ck_assert_int_eq(spb_source_begin_faces(source, NULL), SPC_OK);
    ck_assert_uint_eq(spb_source_bytes_done(source), 0);
    do
        ck_assert_int_eq(spb_source_faces(source, &scan_faces, NULL), SPC_OK);
    while (scan_faces.count > 0);
    ck_assert_uint_eq(spb_source_bytes_done(source), end - before);
    spb_source_close(source);
}
END_TEST

START_TEST(lines_go_on_behind_a_backslash)
{
    struct scan s;
    read_text("v 0 0 0\nv\\\n 1 \\\n\\\n0 0\nv 1\\\n 1\t 0 \\\n\nv 0 1 0.5\nf 1\\\n 2 \\\n 3\\\n 4\n"
              "g a \\\nf 9 9 9\n# no \\\nf 4 3 2\nf 1 2 4 # nor C:\\here\\\nf 2 3 4\n\\\nf 1 2 3", &s);
    scan_expect_ok(&s);
    ck_assert_uint_eq(s.vertex_count, 4);
    expect_vertex(&s, 1, 1, 0, 0);
    expect_vertex(&s, 2, 1, 1, 0);
    ck_assert_uint_eq(s.triangle_count, 6);
    scan_expect_triangle(&s, 1, 0, 2, 3);
    scan_expect_triangle(&s, 2, 3, 2, 1);
    scan_expect_triangle(&s, 3, 0, 1, 3);
    scan_expect_triangle(&s, 4, 1, 2, 3);
    scan_expect_triangle(&s, 5, 0, 1, 2);
    scan_free(&s);
}
END_TEST

START_TEST(blanks_comments_and_marks_do_not_matter)
{
    struct scan s;
    read_text("\xef\xbb\xbf\n \t \n#\n\tv\t0  0\t0 \n  v 1 0 0 # one\nv 1 1 0 #two\n\n\n f  1\t2 3#\n\t#\n", &s);
    scan_expect_ok(&s);
    ck_assert_uint_eq(s.vertex_count, 3);
    expect_vertex(&s, 1, 1, 0, 0);
    scan_expect_triangle(&s, 0, 0, 1, 2);
    ck_assert_str_eq(s.remark, "");
    scan_free(&s);
}
END_TEST

START_TEST(what_is_passed_over_is_told)
{
    struct scan s;
    read_text(FOUR "l 1 2 3\nl 1 2\np 1\nvp 0.5\ncstype bezier\ncurv 0 1 1 2 3 4\nsurf 0 1 0 1 1 2 3 4\n"
              "parm u 0 1\nend\nV 1 2 3\nF 1 2 3\nhello\nvertex 1\nf 1 2 3\nv 1 2 3 4 5\n", &s);
    scan_expect_ok(&s);
    ck_assert_uint_eq(s.vertex_count, 5);
    ck_assert_uint_eq(s.triangle_count, 1);
    ck_assert_ptr_nonnull(strstr(s.remark, "2 lines and 1 points"));
    ck_assert_ptr_nonnull(strstr(s.remark, "2 free-form curves"));
    ck_assert_ptr_nonnull(strstr(s.remark, "4 lines begin with no keyword of OBJ, the first with 'V'"));
    ck_assert_ptr_nonnull(strstr(s.remark, "1 vertices have spare"));
    scan_free(&s);
}
END_TEST

START_TEST(points_alone_are_points)
{
    struct scan s;
    read_text(FOUR, &s);
    scan_expect_ok(&s);
    ck_assert_uint_eq(s.vertex_count, 4);
    ck_assert_uint_eq(s.info.face_count, 0);
    scan_free(&s);
}
END_TEST

START_TEST(values_that_are_not_finite_are_delivered)
{
    struct scan s;
    read_text("v nan 0 1.#QNAN\nv inf -inf 1e999\nv 1 2 3\nf 1 2 3\n", &s);
    scan_expect_ok(&s);
    SCAN_CHECK(isnan(s.xyz[0][0]) && isnan(s.xyz[0][2]));
    SCAN_CHECK(s.xyz[1][0] == HUGE_VAL && s.xyz[1][1] == -HUGE_VAL && s.xyz[1][2] == HUGE_VAL);
    ck_assert(!s.info.wide);
    scan_free(&s);
}
END_TEST

/* ---- colours ------------------------------------------------------------------------------------ */

START_TEST(a_fourth_value_is_a_weight_and_six_are_a_colour)
{
    struct scan s;
    read_text("v 0 0 0 1\nv 1 0 0 0.5\nv 1 1 0 1 # w\nf 1 2 3\n", &s);
    scan_expect_ok(&s);
    ck_assert(!s.info.colors);
    scan_free(&s);
    read_text("v 0 0 0 1 0.5 0\nv 1 0 0 0 0 1 0.5\nv 1 1 0\nv 1 1 1 0.2\nv 1 1 2 nan -1 1.01\n"
              "f 1 2 3\n", &s);
    scan_expect_ok(&s);
    ck_assert(s.info.colors);
    expect_color(&s, 0, 255, 128, 0, 255);
    expect_color(&s, 1, 0, 0, 255, 128);
    expect_color(&s, 2, 255, 255, 255, 255);
    expect_color(&s, 3, 255, 255, 255, 255);
    expect_color(&s, 4, 0, 0, 255, 255);
    ck_assert_ptr_nonnull(strstr(s.remark, "2 of 5 vertices have no colour"));
    scan_free(&s);
}
END_TEST

START_TEST(the_largest_colour_of_the_file_tells_what_full_is)
{
    struct scan s;
    read_text("v 0 0 0 1 1 0\nv 1 0 0 200 100 50 255 # and alpha\nv 1 1 0 0 0 0 0 spare\nf 1 2 3\n", &s);
    scan_expect_ok(&s);
    expect_color(&s, 0, 1, 1, 0, 255);
    expect_color(&s, 1, 200, 100, 50, 255);
    expect_color(&s, 2, 0, 0, 0, 0);
    ck_assert_ptr_nonnull(strstr(s.remark, "colours reach 200 and are taken as 0 to 255"));
    ck_assert_ptr_nonnull(strstr(s.remark, "1 vertices have spare"));
    scan_free(&s);
    read_text("v 0 0 0 65535 0 257\nf 1 1 1\n", &s);
    scan_expect_ok(&s);
    expect_color(&s, 0, 255, 0, 1, 255);
    scan_free(&s);
}
END_TEST

/* ---- float or double ------------------------------------------------------------------------------ */

START_TEST(coordinates_need_double_when_no_float_prints_like_them)
{
    static const struct { const char *text; bool wide; } cases[] = {
        {"0.1", false}, {"0.10000000", false}, {"0.100000001", false}, {"0.1000000015", false},
        {"0.1000000014901161", false}, {"0.10000000000000001", true}, {"123.456787", false},
        {"123.456788", true}, {"447751.123", true}, {"447751.125", false}, {"447751.12", false},
        {"447751.14", true}, {"447751.1", false},
        {"110509.273438", false}, {"110509.273439", true}, {"-16777217", true}, {"16777216", false},
        {"1e39", true}, {"-1e38", false},
        {"1e-40", false}, {"1e-50", true}, {"123456e-3", false}, {"12345678e-3", false}, {"123456784e-3", true},
        {"0.000000000000000000000000000001", false}, {"1e300", true}, {"-0.123456", false},
        {"5400000.5", false}, {"5400000.123", true}, {"inf", false}, {"+1.5E+3", false},
        {"447750.0000000000000000000000000000000000000", false},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct file_text f = {.big = false};
        struct scan s;
        put(&f, "v 0 0 0\nv 1 %s 0\nv 1 1 0\nf 1 2 3\n", cases[i].text);
        scan_read(&f, &s);
        scan_expect_ok(&s);
        ck_assert_msg(s.info.wide == cases[i].wide, "%s", cases[i].text);
        ck_assert(s.xyz[1][1] == strtod(cases[i].text, NULL));
        scan_free(&s);
    }
}
END_TEST

START_TEST(printed_floats_are_never_taken_for_doubles)
{
    static const char *const formats[] = {"%.9g", "%.8e", "%f", "%.3f", "%.12f", "%.17g", "%g", "%.7f"};
    const uint64_t seed = 4711;
    uint64_t random = seed;
    struct file_text f = {.big = false};
    struct scan s;
    printf("seed %" PRIu64 "\n", seed);
    for (int i = 0; i < 30000; i++) {
        put(&f, "v");
        for (int k = 0; k < 3; k++) {
            random = random * 6364136223846793005u + 1442695040888963407u;
            const uint32_t bits = (uint32_t)(random >> 33) % 0x60000000u + 0x20000000u;
            float value;
            char text[200];
            memcpy(&value, &bits, sizeof value);
            if (fabsf(value) > 1e30f)
                value = 1;
            snprintf(text, sizeof text, formats[(i + k) % 8], (double)value);
            put(&f, " %s", text);
        }
        put(&f, "\n");
    }
    put(&f, "f 1 2 3\n");
    scan_read(&f, &s);
    scan_expect_ok(&s);
    ck_assert(!s.info.wide);
    scan_free(&s);
}
END_TEST

/* ---- what is refused ------------------------------------------------------------------------------ */

START_TEST(malformed_lines_are_named)
{
    static const struct { const char *text, *part; } cases[] = {
        {FOUR "v 1 abc 2\nf 1 2 3\n", "line 5: 'abc' is not a number"},
        {FOUR "\n#\nv 1 2\nf 1 2 3\n", "line 7: a vertex with 2 of 3 coordinates"},
        {FOUR "v # 1 2 3\nf 1 2 3\n", "line 5: a vertex with 0 of 3 coordinates"},
        {FOUR "v 1 \\\n2 \\\n3x\nf 1 2 3\n", "line 7: '3x' is not a number"},
        {FOUR "f 1 2 3\nf 1 2 x\nf 1 2 3\n", "line 6: 'x' is not a corner of a face"},
        {FOUR "f 1 2 3\n# \nf 1 2 3/\nf 1 2 3\n", "line 7: '3/' is not a corner of a face"},
        {FOUR "f 1 2 3.5\nf 1 2 3\n", "line 5: '3.5' is not a corner of a face"},
        {FOUR "f 1 2 /3\nf 1 2 3\n", "line 5: '/3' is not"},
        {FOUR "f 1 2 3/4/\nf 1 2 3\n", "line 5: '3/4/' is not"},
        {FOUR "f 1 2 3/4/5/6\nf 1 2 3\n", "line 5: '3/4/5/6' is not"},
        {FOUR "f 1 2 -\nf 1 2 3\n", "line 5: '-' is not"},
        {FOUR "f 1 2 \\ 3\nf 1 2 3\n", "line 5: '\\' is not"},
        {FOUR "f 1 2 aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa\nf 1\n", "'aaaaaaaaaaaaaaaaaaaaaaaa...' is not"},
        {FOUR "f 1 2 \x01\xff\nf 1\n", "'?\?' is not"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct scan s;
        read_text(cases[i].text, &s);
        scan_expect_failure(&s, SPC_INPUT_FORMAT, cases[i].part);
        ck_assert(s.err.at_off < strlen(cases[i].text));
        scan_free(&s);
    }
}
END_TEST

START_TEST(a_cut_file_is_whole_or_named)
{
    static const char text[] = "v 0 0 0\nv 10 0 0\nv 10 10 0\nf 1 2 3\nf 1/1/1 2//2 3/3";
    struct scan s;
    read_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3", &s);
    scan_expect_ok(&s);
    ck_assert_uint_eq(s.triangle_count, 1);
    scan_free(&s);
    for (size_t n = 1; n < sizeof text - 1; n++) {
        scan_read_bytes(text, n, &s);
        const char last = text[n - 1];
        const bool torn = n > 37 && last == '/';
        if (torn)
            scan_expect_failure(&s, SPC_INPUT_TRUNCATED, "line 5: '");
        else if (n > 8 && n < 16 && s.status != SPC_OK)
            scan_expect_failure(&s, SPC_INPUT_TRUNCATED, "line 2: a vertex with ");
        else if (n > 27)
            scan_expect_ok(&s);
        SCAN_CHECK(s.status == SPC_OK || s.status == SPC_INPUT_TRUNCATED ||
                   s.status == SPC_INPUT_FORMAT);
        scan_free(&s);
    }
}
END_TEST

/* A torn word is one that the file ends in, not one that what is left of the file is small behind. */
START_TEST(a_bad_word_before_the_end_is_no_cut)
{
    static const int blanks[] = {1, 10, 60, 70, 300000};
    for (size_t i = 0; i < sizeof blanks / sizeof *blanks; i++) {
        struct file_text f = {.big = false};
        struct scan s;
        put(&f, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3/");
        for (int n = 0; n < blanks[i]; n++)
            put_bytes(&f, " ", 1);
        scan_read(&f, &s);
        scan_expect_failure(&s, SPC_INPUT_FORMAT, "line 4: '3/' is not a corner of a face");
        scan_free(&s);
    }
}
END_TEST

START_TEST(text_that_is_no_obj_is_not_taken_for_one)
{
    static const char *const texts[] = {
        "hello world\n", "1 2 3\n4 5 6\n", "#!/bin/sh\necho v 1 2 3\n", "o Freunde, nicht diese Toene\n",
        "v for vendetta\nf for fun\n", "# only a comment\n", "g\n",
        "int main(void)\n{\n}\n", "vt\n", "newmtl a\nKd 1 1 1\n", "x y z\n1 2 3\n",
    };
    struct file_text f = {.big = false};
    struct scan s;
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        scan_read_bytes(texts[i], strlen(texts[i]), &s);
        scan_expect_failure(&s, SPC_INPUT_FORMAT, "not a scan in a known format");
    }
    for (int i = 0; i < 200; i++)
        put(&f, "# a comment, and nothing else: %d\n", i);
    scan_read(&f, &s);
    scan_expect_failure(&s, SPC_INPUT_FORMAT, "no line begins with a keyword of OBJ");
}
END_TEST

START_TEST(files_may_begin_with_anything_obj_has)
{
    static const char *const heads[] = {
        "# comment\n", "\n\n", "\xef\xbb\xbf# mark\n", "mtllib a b.mtl\n", "o x\n", "g\n", "s 1\n",
        "vn 0 0 1\n", "vt 0 1\n", "usemtl m\n", "strange line\n", "\t # x\n", "vp 1\n", "g \\\n a\n",
    };
    struct file_text f = {.big = false};
    struct scan s;
    for (size_t i = 0; i < sizeof heads / sizeof *heads; i++) {
        put(&f, "%s" FOUR "f 1 2 3\n", heads[i]);
        scan_read(&f, &s);
        scan_expect_ok(&s);
        scan_free(&s);
    }
    for (int i = 0; i < 2000; i++)
        put(&f, "# a long comment before all: %d\n", i);
    put(&f, FOUR "f 1 2 3\n");
    scan_read(&f, &s);
    scan_expect_ok(&s);
    scan_free(&s);
    put(&f, "mtllib ");
    for (int i = 0; i < 100; i++)
        put(&f, "a very long name ");
    put(&f, "\n" FOUR "f 1 2 3\n");
    scan_read(&f, &s);
    scan_expect_ok(&s);
    scan_free(&s);
}
END_TEST

/* ---- size ----------------------------------------------------------------------------------------- */

/* Moves a text over the border of the window, byte by byte. */
START_TEST(lines_may_lie_anywhere_in_the_window)
{
    static const char tail[] = "v 1.5 2.5 3.5 0.5 1 0 # c\\\r\nv 2 \\\r\n3 \\\n4\rl 1 2\n\nusemtl m\n"
                               "f 1/2/3 \\\r\n-2//-1 3\r\n# x\nf 3 2 1 1 # y\nv -1 0 0.25";
    for (size_t shift = 0; shift < sizeof tail + 4; shift++) {
        struct file_text f = {.big = false};
        struct scan s;
        put(&f, "v 9 9 9\n#");
        const size_t room = SPB_BYTES_WINDOW - f.bytes - 1 - shift;
        char *const filler = malloc(room);
        memset(filler, shift % 2 ? 'x' : '\\', room);
        put_bytes(&f, filler, room);
        free(filler);
        put_bytes(&f, "\n", 1);
        put_bytes(&f, tail, sizeof tail - 1);
        put_bytes(&f, "\n", shift % 2);
        scan_read(&f, &s);
        scan_expect_ok(&s);
        SCAN_CHECK(s.vertex_count == 4 && s.triangle_count == 3 && s.faces_in == 2);
        expect_vertex(&s, 1, 1.5, 2.5, 3.5);
        expect_vertex(&s, 2, 2, 3, 4);
        expect_vertex(&s, 3, -1, 0, 0.25);
        scan_expect_triangle(&s, 0, 0, 1, 2);
        scan_expect_triangle(&s, 1, 2, 1, 0);
        scan_expect_triangle(&s, 2, 2, 0, 0);
        scan_free(&s);
    }
}
END_TEST

START_TEST(lines_are_counted_over_the_border_of_the_window)
{
    for (size_t shift = 0; shift < 12; shift++) {
        struct file_text f = {.big = false};
        struct scan s;
        put(&f, "v 9 9 9\n#");
        const size_t room = SPB_BYTES_WINDOW - f.bytes - shift;
        char *const filler = malloc(room);
        memset(filler, 'x', room);
        put_bytes(&f, filler, room);
        free(filler);
        put(&f, "\r\n\r\n\r#\r\nv 1 x 2\n");
        scan_read(&f, &s);
        scan_expect_failure(&s, SPC_INPUT_FORMAT, "line 6: 'x' is not a number");
        scan_free(&s);
    }
}
END_TEST

START_TEST(a_face_of_a_million_corners_is_one_fan)
{
    enum { CORNERS = 300000 };
    struct file_text f = {.big = false};
    struct scan s;
    put(&f, FOUR "f");
    for (int i = 0; i < CORNERS; i++)
        put(&f, i % 7 == 0 ? " \\\n%d//1" : " %d", i % 4 + 1);
    put(&f, "\nf 1 2 3\n");
    scan_read(&f, &s);
    scan_expect_ok(&s);
    ck_assert_uint_eq(s.triangle_count, CORNERS - 2 + 1);
    ck_assert_uint_eq(s.split_extra, CORNERS - 3);
    for (size_t i = 0; i + 2 < CORNERS; i++)
        SCAN_CHECK(s.corner[i][0] == 0 && s.corner[i][1] == (i + 1) % 4 && s.corner[i][2] == (i + 2) % 4);
    scan_free(&s);
}
END_TEST

static void read_filled(int byte, size_t bytes, const char *before, const char *behind, struct scan *s)
{
    struct file_text f = {.big = false};
    char *const filler = malloc(bytes);
    memset(filler, byte, bytes);
    put(&f, "#%600s\n%s", "so that the first bytes are text", before);
    put_bytes(&f, filler, bytes);
    put(&f, "%s", behind);
    free(filler);
    scan_once = true;
    scan_read(&f, s);
    scan_once = false;
}

START_TEST(lines_of_any_length_take_constant_memory)
{
    enum { LONG = 3000000 };
    static const char fill[] = {'x', '#', '\\', '\0', ' ', '\t', '/', '1'};
    struct scan s;
    for (size_t i = 0; i < sizeof fill; i++) {
        read_filled(fill[i], LONG, FOUR "# ", "\nf 1 2 3\n", &s);
        scan_expect_ok(&s);
        ck_assert_uint_eq(s.triangle_count, 1);
        scan_free(&s);
        read_filled(fill[i], LONG, FOUR "usemtl ", " \\\n\nf 1 2 3\n", &s);
        scan_expect_ok(&s);
        ck_assert_uint_eq(s.triangle_count, 1);
        scan_free(&s);
        read_filled(fill[i], LONG, FOUR "f 1 2 3", "\n", &s);
        const bool nothing = fill[i] == ' ' || fill[i] == '\t' || fill[i] == '#';
        SCAN_CHECK(s.status == (nothing ? SPC_OK : SPC_INPUT_FORMAT));
        scan_free(&s);
        read_filled(fill[i], LONG, FOUR "f 1 2 3\nv 1 2 ", "\n", &s);
        SCAN_CHECK(s.status == SPC_INPUT_FORMAT);
        scan_free(&s);
    }
    read_filled('\n', LONG, FOUR, "f 1 2 3\n", &s);
    scan_expect_ok(&s);
    scan_free(&s);
    read_filled('\r', LONG, FOUR, "f 1 2 x", &s);
    scan_expect_failure(&s, SPC_INPUT_TRUNCATED, "line 3000006: 'x' is not");
    scan_free(&s);
}
END_TEST

static struct spb_progress stopping;
static int stop(void *ctx, const char *phase, uint64_t done, uint64_t total)
{
    int *const left = ctx;
    SCAN_CHECK(done <= total && strcmp(phase, "count") == 0);
    return (*left)-- <= 0;
}

START_TEST(counting_tells_its_progress_and_can_be_cancelled)
{
    struct file_text f = {.big = false};
    struct spb_source *source;
    struct spc_error err = {0};
    int left = 1;
    for (int i = 0; i < 50000; i++)
        put(&f, "v %d 0 0 # so that there are some windows\n", i);
    scan_write(f.data, f.bytes);
    free(f.data);
    stopping = (struct spb_progress){stop, &left};
    const struct spb_source_options options = {.progress = &stopping};
    ck_assert_int_eq(spb_source_open(scan_path, &options, &source, &err), SPC_CANCELLED);
    left = 1000;
    ck_assert_int_eq(spb_source_open(scan_path, &options, &source, &err), SPC_OK);
    ck_assert_int_lt(left, 995);
    spb_source_close(source);
}
END_TEST

START_TEST(a_file_that_changes_between_the_passes_is_found_out)
{
    struct spb_source *source;
    struct spc_error err = {0};
    scan_write(FOUR "f 1 2 3\n", strlen(FOUR) + 8);
    ck_assert_int_eq(spb_source_open(scan_path, NULL, &source, &err), SPC_OK);
    ck_assert_int_eq(spb_source_begin_vertices(source, NULL), SPC_OK);
    ck_assert_int_eq(spb_source_begin_faces(source, NULL), SPC_OK);
    spb_source_close(source);
    /* More than a window, so that it is read anew. */
    struct file_text f = {.big = false};
    for (int i = 0; i < 60000; i++)
        put(&f, "v 1 2 3\nf 1 1 1\n");
    scan_write(f.data, f.bytes);
    ck_assert_int_eq(spb_source_open(scan_path, NULL, &source, &err), SPC_OK);
    memset(f.data, '#', f.bytes);
    scan_write(f.data, f.bytes);
    free(f.data);
    ck_assert_int_eq(spb_source_begin_vertices(source, NULL), SPC_OK);
    enum spc_status status;
    while ((status = spb_source_vertices(source, &scan_vertices, &err)) == SPC_OK)
        SCAN_CHECK(scan_vertices.count > 0);
    ck_assert_int_eq(status, SPC_INPUT_TRUNCATED);
    ck_assert_int_eq(spb_source_vertices(source, &scan_vertices, &err), SPC_INPUT_TRUNCATED);
    ck_assert_int_eq(spb_source_begin_faces(source, NULL), SPC_OK);
    while ((status = spb_source_faces(source, &scan_faces, &err)) == SPC_OK)
        SCAN_CHECK(scan_faces.count > 0);
    ck_assert_int_eq(status, SPC_INPUT_TRUNCATED);
    spb_source_close(source);
}
END_TEST

/* Any bytes, mostly those that mean something: must end, with whatever status. */
START_TEST(random_bytes_do_no_harm)
{
    static const char alphabet[] = "vvfff  \n\n\n\r\\#/--0123456789.e+nta\t\x00\xff" "usemtl";
    const uint64_t seed = 99;
    uint64_t random = seed;
    printf("seed %" PRIu64 "\n", seed);
    for (int round = 0; round < 3000; round++) {
        struct file_text f = {.big = false};
        struct scan s;
        put(&f, "v 1 2 3\nf 1 1 1\n");
        for (int i = 0; i < round % 200; i++) {
            random = random * 6364136223846793005u + 1442695040888963407u;
            put_bytes(&f, &alphabet[(random >> 33) % (sizeof alphabet - 1)], 1);
        }
        scan_read(&f, &s);
        scan_free(&s);
    }
}
END_TEST

START_TEST(real_scans_have_the_counts_they_should)
{
    static const struct { const char *name; size_t vertices, faces; } scans[] = {
        {"nefertiti.obj", 49971, 99938}, {"stanford-bunny.obj", 35947, 69451},
        {"tinsimp_0.obj", 43838, 88670},
    };
    const char *const data = getenv("SPC_DATA");
    for (size_t i = 0; data && i < sizeof scans / sizeof *scans; i++) {
        char path[400];
        struct scan s;
        snprintf(path, sizeof path, "%s/scans/%s", data, scans[i].name);
        scan_read_path(path, &s);
        scan_expect_ok(&s);
        ck_assert_uint_eq(s.vertex_count, scans[i].vertices);
        ck_assert_uint_eq(s.triangle_count, scans[i].faces);
        for (size_t k = 0; k < s.triangle_count; k++)
            SCAN_CHECK(s.corner[k][0] < s.vertex_count && s.corner[k][1] < s.vertex_count &&
                       s.corner[k][2] < s.vertex_count);
        scan_free(&s);
    }
}
END_TEST

int main(void)
{
    return SUITE("obj", scan_start, scan_finish,
                 corners_come_in_all_four_styles,
                 polygons_become_fans_and_short_faces_are_counted,
                 negative_indices_count_back_from_the_vertices_before_their_line,
                 indices_that_name_no_vertex_are_delivered_or_marked,
                 ranges_far_apart_keep_counting,
                 passes_leave_out_what_they_do_not_want,
                 lines_go_on_behind_a_backslash,
                 blanks_comments_and_marks_do_not_matter,
                 what_is_passed_over_is_told,
                 points_alone_are_points,
                 values_that_are_not_finite_are_delivered,
                 a_fourth_value_is_a_weight_and_six_are_a_colour,
                 the_largest_colour_of_the_file_tells_what_full_is,
                 coordinates_need_double_when_no_float_prints_like_them,
                 printed_floats_are_never_taken_for_doubles,
                 malformed_lines_are_named,
                 a_cut_file_is_whole_or_named,
                 a_bad_word_before_the_end_is_no_cut,
                 text_that_is_no_obj_is_not_taken_for_one,
                 files_may_begin_with_anything_obj_has,
                 lines_may_lie_anywhere_in_the_window,
                 lines_are_counted_over_the_border_of_the_window,
                 a_face_of_a_million_corners_is_one_fan,
                 lines_of_any_length_take_constant_memory,
                 counting_tells_its_progress_and_can_be_cancelled,
                 a_file_that_changes_between_the_passes_is_found_out,
                 random_bytes_do_no_harm,
                 real_scans_have_the_counts_they_should);
}
