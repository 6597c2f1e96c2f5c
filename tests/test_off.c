/*
 * OFF files of every kind of keyword, as programs write them and as they should not; and a real
 * one, where the environment says with SPC_DATA where it is.
 */
#include "off.h"

#include <math.h>

#include "mesh_case.h"
#include "scan_case.h"

static void start(void)
{
    case_start();
    scan_start();
}

static void finish(void)
{
    scan_finish();
    case_finish();
}

static void read_text(const char *text, struct scan *s)
{
    scan_read_bytes(text, strlen(text), s);
}

/* Three vertices (i, 0.5, -i), a triangle of them. */
static void expect_small(const struct scan *s, const char *remark)
{
    scan_expect_ok(s);
    ck_assert_str_eq(s->info.format, "off ascii");
    ck_assert(!s->info.by_place && !s->info.strips && !s->info.archive);
    ck_assert_uint_eq(s->vertex_count, 3);
    for (int i = 0; i < 3; i++)
        SCAN_CHECK(s->xyz[i][0] == i && s->xyz[i][1] == 0.5 && s->xyz[i][2] == -i);
    ck_assert_uint_eq(s->triangle_count, 1);
    scan_expect_triangle(s, 0, 0, 1, 2);
    ck_assert_str_eq(s->remark, remark);
}

static void expect_text(const char *text, const char *remark)
{
    struct scan s;
    read_text(text, &s);
    expect_small(&s, remark);
    ck_assert(!s.info.colors && !s.info.wide);
    scan_free(&s);
}

static void expect_refused(const char *text, enum spc_status status, const char *part)
{
    struct scan s;
    read_text(text, &s);
    scan_expect_failure(&s, status, part);
    scan_free(&s);
}

#define ROWS "0 0.5 0\n1 .5 -1\n2 5e-1 -2\n3 0 1 2\n"

/* ---- the header ----------------------------------------------------------------------------- */

START_TEST(keyword_and_counts_stand_on_any_lines)
{
    expect_text("OFF\n3 1 0\n" ROWS, "");
    expect_text("OFF 3 1 0\n" ROWS, "");
    expect_text("OFF 3 1\n" ROWS, "");
    expect_text("OFF\n3\n1\n7\n" ROWS, "");
    expect_text("off\n3 1 3\n" ROWS, "");
    expect_text("  \n\nOFF\n\n\n3 1 9\n\n" ROWS, "");
    expect_text("\xef\xbb\xbfOFF\n3 1 0\n" ROWS, "");
    expect_text("# by hand\n#\nOFF # keyword\n# more\n3 # vertices\n1 0 # faces\n#\n" ROWS, "");
    expect_text("OFF#\n3 1#\n" ROWS, "");
    expect_text("OFF\r\n3 1 0\r\n0 0.5 0\r\n1 .5 -1\r\n2 .5 -2\r\n3 0 1 2\r\n", "");
    expect_text("OFF\r3 1 0\r0 0.5 0\r1 .5 -1\r2 .5 -2\r3 0 1 2", "");
}
END_TEST

START_TEST(a_file_without_keyword_is_taken_only_if_sure)
{
    expect_text("3 1 0\n" ROWS, "");
    expect_text("# by hand\n3 1 0\n" ROWS, "");
    expect_refused("3 1\n" ROWS, SPC_INPUT_FORMAT, "known format");
    expect_refused("3 1 2\n" ROWS, SPC_INPUT_FORMAT, "known format");
    expect_refused("3 1000 0\n" ROWS, SPC_INPUT_FORMAT, "known format");
    expect_refused("3.5 1 0\n" ROWS, SPC_INPUT_FORMAT, "known format");
    expect_refused("3 1 0\n0 0\n" ROWS, SPC_INPUT_FORMAT, "known format");
    expect_refused("3 1 0\nthe end of it, and more\n", SPC_INPUT_FORMAT, "known format");
    expect_refused("OFFSET 3 1 0\n" ROWS, SPC_INPUT_FORMAT, "known format");
    expect_refused("SOFF\n3 1 0\n" ROWS, SPC_INPUT_FORMAT, "known format");
}
END_TEST

START_TEST(other_dimensions_and_binary_are_refused_by_name)
{
    expect_refused("4OFF\n3 1 0\n" ROWS, SPC_INPUT_FORMAT, "four or more dimensions");
    expect_refused("nOFF 5\n3 1 0\n" ROWS, SPC_INPUT_FORMAT, "four or more dimensions");
    expect_refused("STCN4OFF\n3 1 0\n" ROWS, SPC_INPUT_FORMAT, "four or more dimensions");
    expect_refused("OFF BINARY\n", SPC_INPUT_FORMAT, "binary OFF");
    expect_refused("COFF  binary\n\x01\x02", SPC_INPUT_FORMAT, "binary OFF");
}
END_TEST

START_TEST(counts_that_cannot_be_are_refused)
{
    expect_refused("OFF\n", SPC_INPUT_TRUNCATED, "before the count of vertices");
    expect_refused("OFF\n3", SPC_INPUT_TRUNCATED, "before the count of faces");
    expect_refused("OFF\nthree 1 0\n", SPC_INPUT_FORMAT, "'three' is not a count of vertices");
    expect_refused("OFF\n3 -1 0\n" ROWS, SPC_INPUT_FORMAT, "'-1' is not a count of faces");
    expect_refused("OFF\n3 1.5 0\n" ROWS, SPC_INPUT_FORMAT, "'1.5' is not a count of faces");
    expect_refused("OFF\n3000 1 0\n" ROWS, SPC_INPUT_TRUNCATED, "3000 vertices and 1 faces are promised");
    expect_refused("OFF\n3 4611686018427387904 0\n" ROWS, SPC_INPUT_TRUNCATED, "are promised");
    expect_refused("OFF\n999999999999999999 1 0\n" ROWS, SPC_INPUT_TRUNCATED, "are promised");
}
END_TEST

/* ---- vertices ------------------------------------------------------------------------------- */

START_TEST(normals_and_texture_are_passed_over)
{
    expect_text("NOFF\n3 1 0\n0 .5 0 0 0 1\n1 .5 -1 nan x 1\n2 .5 -2 0 0 1\n3 0 1 2\n", "");
    expect_text("STOFF\n3 1 0\n0 .5 0 0 1\n1 .5 -1 0 1\n2 .5 -2 0 1\n3 0 1 2\n", "");
    expect_text("STNOFF\n3 1 0\n0 .5 0 0 0 1 0 1\n1 .5 -1 0 0 1 0 1\n2 .5 -2 0 0 1 0 1\n3 0 1 2\n", "");
}
END_TEST

static void expect_rgba(const char *head, const char *colors[3], const uint8_t want[3][4])
{
    struct file_text f = { .big = false };
    struct scan s;
    put(&f, "%s\n3 1 0\n", head);
    for (int i = 0; i < 3; i++)
        put(&f, "%d 0.5 %d %s\n", i, -i, colors[i]);
    put(&f, "3 0 1 2\n");
    scan_read(&f, &s);
    expect_small(&s, "");
    ck_assert(s.info.colors);
    for (int i = 0; i < 3; i++)
        for (int c = 0; c < 4; c++)
            ck_assert_msg(s.rgba[i][c] == want[i][c], "%s: vertex %d channel %d is %d", colors[0], i, c,
                          s.rgba[i][c]);
    scan_free(&s);
}

START_TEST(colors_reach_to_255_or_to_1)
{
    expect_rgba("COFF", (const char *[]){ "255 0 10", "0 1 0", "1 2 3" },
                (const uint8_t[3][4]){ { 255, 0, 10, 255 }, { 0, 1, 0, 255 }, { 1, 2, 3, 255 } });
    expect_rgba("COFF", (const char *[]){ "255 0 10 128", "0 1 0 0", "1 2 3 255" },
                (const uint8_t[3][4]){ { 255, 0, 10, 128 }, { 0, 1, 0, 0 }, { 1, 2, 3, 255 } });
    expect_rgba("COFF", (const char *[]){ "16 2 3", "0 0 0", "0 0 0" },
                (const uint8_t[3][4]){ { 16, 2, 3, 255 }, { 0, 0, 0, 255 }, { 0, 0, 0, 255 } });
    expect_rgba("COFF", (const char *[]){ "1 0 0 1", "0 1 0 0", "0 0 0 1" },
                (const uint8_t[3][4]){ { 255, 0, 0, 255 }, { 0, 255, 0, 0 }, { 0, 0, 0, 255 } });
    expect_rgba("COFF", (const char *[]){ "1.1 0.5 0", "-0.1 nan 0", "0.2 1e-9 .6" },
                (const uint8_t[3][4]){ { 255, 128, 0, 255 }, { 0, 0, 0, 255 }, { 51, 0, 153, 255 } });
    expect_rgba("COFF", (const char *[]){ "255.0 127.6 0", "0 0 0", "0 0 0" },
                (const uint8_t[3][4]){ { 255, 128, 0, 255 }, { 0, 0, 0, 255 }, { 0, 0, 0, 255 } });
    expect_rgba("COFF", (const char *[]){ "1 1 1 255", "0 0 0 255", "0 0 0 255" },
                (const uint8_t[3][4]){ { 1, 1, 1, 255 }, { 0, 0, 0, 255 }, { 0, 0, 0, 255 } });
    expect_rgba("CNOFF", (const char *[]){ "0 0 1 255 0 10", "0 0 1 0 1 0", "0 0 1 1 2 3" },
                (const uint8_t[3][4]){ { 255, 0, 10, 255 }, { 0, 1, 0, 255 }, { 1, 2, 3, 255 } });
    expect_rgba("STCOFF", (const char *[]){ "9 8 7 6 .1 .2", "9 8 7 6 .1 .2", "9 8 0 255 .1 .2 #" },
                (const uint8_t[3][4]){ { 9, 8, 7, 6 }, { 9, 8, 7, 6 }, { 9, 8, 0, 255 } });
}
END_TEST

START_TEST(a_keyword_that_promises_colors_must_have_some)
{
    expect_refused("COFF\n3 1 0\n" ROWS, SPC_INPUT_FORMAT, "vertex 0 of 3: the keyword promises colours");
    expect_refused("COFF\n3 1 0\n1 2 3 4 5\n" ROWS, SPC_INPUT_FORMAT, "promises colours");
    expect_refused("COFF\n3 1 0\n1 2 3 4 5 6 7 8 9 9 9 9\n" ROWS, SPC_INPUT_FORMAT, "promises colours");
    expect_refused("COFF\n3 1 0\n0 0 0 1 1 1\n0 0 0 1 x 1\n" ROWS, SPC_INPUT_FORMAT,
                   "vertex 1 of 3: 'x' is not a number");
}
END_TEST

START_TEST(rows_with_too_much_or_over_two_lines_are_remarked)
{
    expect_text("OFF\n3 1 0\n0 .5 0 7 7 7\n1 .5 -1\n2 .5 -2 x\n3 0 1 2\n", "2 vertices have spare values");
    expect_text("OFF\n3 1 0\n0 .5\n0\n1 .5 -1\n2 # two\n .5 -2\n3 0 1 2\n", "2 vertices go on in the next line");
    expect_text("OFF\n3 1 0\n0 .5 0\n1 .5 -1\n2 .5 -2\n3 0\n1\n\n2\n", "1 faces go on in the next line");
    expect_text("OFF\n3 1 0\n" ROWS "some more\n", "10 bytes behind the last face");
    expect_text("OFF\n3 1 0\n" ROWS "# some more\n", "");
    expect_refused("OFF\n3 1 0\n0 .5\n1 .5 -1\n2 .5 -2\n3 0 1 2\n", SPC_INPUT_FORMAT,
                   "vertex 0 of 3: its line holds too few values");
    expect_refused("OFF\n4 2 0\n0 .5 0\n" ROWS "4 0 1\n3 0 1 2\n", SPC_INPUT_FORMAT,
                   "face 1 of 2: its line holds too few values");
}
END_TEST

static bool is_wide(const char *number)
{
    struct file_text f = { .big = false };
    struct scan s;
    put(&f, "OFF\n3 1 0\n0 0 0\n1 %s 1\n0 1 0\n3 0 1 2\n", number);
    scan_read(&f, &s);
    scan_expect_ok(&s);
    const bool wide = s.info.wide;
    scan_free(&s);
    return wide;
}

START_TEST(text_is_wide_when_a_float_would_lose_digits)
{
    ck_assert(!is_wide("0.1") && !is_wide("-0.326964736") && !is_wide("447751.12") && !is_wide("inf"));
    ck_assert(is_wide("447751.123") && is_wide("0.10000000000001") && is_wide("1e300"));
}
END_TEST

START_TEST(zero_faces_are_a_point_cloud)
{
    struct scan s;
    read_text("OFF\n2 0 0\n0 0 0\n1 2 3\n", &s);
    scan_expect_ok(&s);
    ck_assert_uint_eq(s.vertex_count, 2);
    ck_assert_uint_eq(s.triangle_count, 0);
    scan_free(&s);
    read_text("OFF\n0 0 0\n", &s);
    scan_expect_ok(&s);
    ck_assert_uint_eq(s.vertex_count, 0);
    scan_free(&s);
}
END_TEST

/* ---- faces ---------------------------------------------------------------------------------- */

START_TEST(polygons_become_fans_and_bad_corners_are_delivered)
{
    struct scan s;
    read_text("OFF\n4 6 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n5 0 1 2 3 0\n2 0 1\n0\n3 -1 99 2\n1 0\n"
              "3 0 1.5 18446744073709551616\n", &s);
    scan_expect_ok(&s);
    ck_assert_uint_eq(s.triangle_count, 5);
    scan_expect_triangle(&s, 0, 0, 1, 2);
    scan_expect_triangle(&s, 1, 0, 2, 3);
    scan_expect_triangle(&s, 2, 0, 3, 0);
    scan_expect_triangle(&s, 3, SPB_BAD_INDEX, 99, 2);
    scan_expect_triangle(&s, 4, 0, SPB_BAD_INDEX, SPB_BAD_INDEX);
    ck_assert_uint_eq(s.faces_in, 6);
    ck_assert_uint_eq(s.faces_short, 3);
    ck_assert_uint_eq(s.split_extra, 2);
    scan_free(&s);
}
END_TEST

START_TEST(face_colors_are_remarked)
{
    expect_text("OFF\n3 1 0\n0 .5 0\n1 .5 -1\n2 .5 -2\n3 0 1 2 255 0 0\n",
                "1 faces have a colour, which is passed over");
    expect_text("OFF\n3 1 0\n0 .5 0\n1 .5 -1\n2 .5 -2\n3 0 1 2 .5 .5 .5 1.0",
                "1 faces have a colour, which is passed over");
    expect_refused("OFF\n3 1 0\n0 .5 0\n1 .5 -1\n2 .5 -2\n4 0 1 2\n3 0 1 2\n", SPC_INPUT_FORMAT,
                   "face 0 of 1: its line holds too few values");
}
END_TEST

START_TEST(faults_in_faces_name_them)
{
    expect_refused("OFF\n3 1 0\n0 0 0\n0 0 0\n0 0 0\nx 0 1 2\n", SPC_INPUT_FORMAT,
                   "face 0 of 1: 'x' is not a count of corners");
    expect_refused("OFF\n3 1 0\n0 0 0\n0 0 0\n0 0 0\n-3 0 1 2\n", SPC_INPUT_FORMAT, "'-3' is not a count");
    expect_refused("OFF\n3 1 0\n0 0 0\n0 0 0\n0 0 0\n999 0 1 2\n", SPC_INPUT_FORMAT,
                   "'999' is not a count that this file can hold");
    expect_refused("OFF\n3 2 0\n" ROWS "3 0 1 2x\n", SPC_INPUT_FORMAT, "face 1 of 2: '2x' is not a vertex number");
    expect_refused("OFF\n3 2 0\n" ROWS "3 0 1\n", SPC_INPUT_TRUNCATED, "face 1 of 2 is cut short");
    expect_refused("OFF\n3 2 0\n" ROWS, SPC_INPUT_TRUNCATED, "face 1 of 2 is missing");
    expect_refused("OFF\n4 0 0\n1 2 3\n1 2 3\n1 2 3\n1 2  \n\n", SPC_INPUT_TRUNCATED, "vertex 3 of 4 is cut short");
}
END_TEST

/* Windows and batches end everywhere in values, polygons and comments. */
START_TEST(large_files_are_read_over_windows_and_batches)
{
    enum { VERTICES = 30000, SIDES = 9001 };
    struct file_text f = { .big = false };
    struct scan s;
    put(&f, "OFF\n%d %d 0\n", VERTICES, VERTICES / 3 + 1);
    for (int i = 0; i < VERTICES; i++) {
        put(&f, "%d.25 %d %d\n", i, -i, i % 7);
        if (i % 1000 == 0)
            put(&f, "#%*s\n", i / 20, "a comment");
    }
    for (int i = 0; i < VERTICES / 3; i++)
        put(&f, "3  %d %d %d\n", 3 * i, 3 * i + 1, 3 * i + 2);
    put(&f, "%d", SIDES);
    for (int i = 0; i < SIDES; i++)
        put(&f, " %d", i);
    scan_read(&f, &s);
    scan_expect_ok(&s);
    ck_assert_uint_eq(s.triangle_count, VERTICES / 3 + SIDES - 2);
    for (int i = 0; i < VERTICES; i++)
        SCAN_CHECK(s.xyz[i][0] == i + 0.25 && s.xyz[i][1] == -i && s.xyz[i][2] == i % 7);
    for (uint64_t i = 0; i < VERTICES / 3; i++)
        scan_expect_triangle(&s, i, 3 * i, 3 * i + 1, 3 * i + 2);
    for (uint64_t i = 0; i < SIDES - 2; i++)
        scan_expect_triangle(&s, VERTICES / 3 + i, 0, i + 1, i + 2);
    ck_assert_str_eq(s.remark, "");
    scan_free(&s);
}
END_TEST

static int cancel(void *ctx, const char *phase, uint64_t done, uint64_t total)
{
    ck_assert_str_eq(phase, "count");
    ck_assert_uint_le(done, total);
    return ++*(int *)ctx == 2;
}

START_TEST(looking_at_vertices_can_be_cancelled)
{
    int calls = 0;
    const struct spb_progress progress = { cancel, &calls };
    const struct spb_source_options options = { .progress = &progress };
    struct file_text f = { .big = false };
    struct spb_source *source = NULL;
    put(&f, "OFF 20000 0 0\n");
    for (int i = 0; i < 20000; i++)
        put(&f, "1 2 3\n");
    scan_write(f.data, f.bytes);
    free(f.data);
    ck_assert_int_eq(spb_source_open(scan_path, &options, &source, NULL), SPC_CANCELLED);
    ck_assert_int_eq(calls, 2);
}
END_TEST

START_TEST(a_real_file_has_its_polygons)
{
    const char *const data = getenv("SPC_DATA");
    char path[400];
    struct scan s;
    if (data == NULL)
        return;
    snprintf(path, sizeof path, "%s/scans/lion_vase_poly.off", data);
    scan_read_path(path, &s);
    scan_expect_ok(&s);
    ck_assert_uint_eq(s.vertex_count, 46206);
    ck_assert_uint_eq(s.faces_in, 23105);
    ck_assert_uint_eq(s.split_extra, 69303);
    ck_assert(s.info.wide);
    ck_assert_str_eq(s.remark, "");
    scan_free(&s);
    struct spb_build_options o = case_options(path, case_path("lion.spc"));
    struct spc_reader *r = case_build(&o);
    ck_assert_uint_eq(spc_reader_header(r)->leaf_count, 92408);
    ck_assert(spc_reader_header(r)->flags & SPC_FLAG_CULL_BACK);
    spc_reader_close(r);
}
END_TEST

int main(void)
{
    return SUITE("off", start, finish, keyword_and_counts_stand_on_any_lines,
                 a_file_without_keyword_is_taken_only_if_sure,
                 other_dimensions_and_binary_are_refused_by_name, counts_that_cannot_be_are_refused,
                 normals_and_texture_are_passed_over, colors_reach_to_255_or_to_1,
                 a_keyword_that_promises_colors_must_have_some,
                 rows_with_too_much_or_over_two_lines_are_remarked,
                 text_is_wide_when_a_float_would_lose_digits, zero_faces_are_a_point_cloud,
                 polygons_become_fans_and_bad_corners_are_delivered, face_colors_are_remarked,
                 faults_in_faces_name_them, large_files_are_read_over_windows_and_batches,
                 looking_at_vertices_can_be_cancelled, a_real_file_has_its_polygons);
}
