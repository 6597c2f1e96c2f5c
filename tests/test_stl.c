/*
 * STL files, binary and ascii, as programs write them and as they should not; and a real one, where
 * the environment says with SPC_DATA where it is.
 */
#include "stl.h"

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

/* ---- writing -------------------------------------------------------------------------------- */

static struct file_text binary_start(const char *name, uint32_t count)
{
    struct file_text f = { .big = false };
    char header[80] = "";
    memcpy(header, name, strlen(name));
    put_bytes(&f, header, sizeof header);
    put_int(&f, 4, count);
    return f;
}

/* Facet i: corners (i, 0.5, -k) and an attribute word. */
static void binary_facet(struct file_text *f, int i, unsigned word)
{
    const double normal[3] = { 0, 0, 1 };
    for (int a = 0; a < 3; a++)
        put_real(f, 4, normal[a]);
    for (int k = 0; k < 3; k++) {
        put_real(f, 4, i);
        put_real(f, 4, 0.5);
        put_real(f, 4, -k);
    }
    put_int(f, 2, word);
}

static struct file_text binary_file(const char *name, uint32_t declared, int count)
{
    struct file_text f = binary_start(name, declared);
    for (int i = 0; i < count; i++)
        binary_facet(&f, i, 0);
    return f;
}

static void ascii_facet(struct file_text *f, int i)
{
    put(f, "facet normal 0 0 1\n outer loop\n  vertex %d 0.5 0\n  vertex %d 0.5 -1\n"
        "  vertex %d 0.5 -2\n endloop\nendfacet\n", i, i, i);
}

static void expect_facets(const struct scan *s, size_t count)
{
    scan_expect_ok(s);
    ck_assert_uint_eq(s->info.face_count, count);
    ck_assert_uint_eq(s->vertex_count, 3 * count);
    ck_assert_uint_eq(s->triangle_count, count);
    ck_assert(s->info.by_place && !s->info.strips && !s->info.archive);
    for (size_t i = 0; i < count; i++) {
        scan_expect_triangle(s, i, 3 * i, 3 * i + 1, 3 * i + 2);
        for (size_t k = 0; k < 3; k++) {
            const double *const xyz = s->xyz[3 * i + k];
            SCAN_CHECK(xyz[0] == (double)i && xyz[1] == 0.5 && xyz[2] == -(double)k);
        }
    }
}

static void expect_text(const char *text, size_t count, const char *remark)
{
    struct scan s;
    scan_read_bytes(text, strlen(text), &s);
    expect_facets(&s, count);
    ck_assert_str_eq(s.info.format, "stl ascii");
    ck_assert_str_eq(s.remark, remark);
    scan_free(&s);
}

static void expect_refused(const char *text, enum spc_status status, const char *part)
{
    struct scan s;
    scan_read_bytes(text, strlen(text), &s);
    scan_expect_failure(&s, status, part);
    scan_free(&s);
}

/* ---- binary --------------------------------------------------------------------------------- */

/* More than a window and a batch, and none of either a whole number of facets. */
START_TEST(binary_facets_are_read_over_windows_and_batches)
{
    static const int counts[] = { 0, 1, 2, 1365, 1366, 5242, 5243, 20000 };
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        struct file_text f = binary_file("made by hand", (uint32_t)counts[i], counts[i]);
        struct scan s;
        scan_read(&f, &s);
        expect_facets(&s, (size_t)counts[i]);
        ck_assert_str_eq(s.info.format, "stl binary");
        ck_assert(!s.info.colors && !s.info.wide);
        ck_assert_str_eq(s.remark, "");
        scan_free(&s);
    }
}
END_TEST

START_TEST(binary_that_begins_with_solid_is_binary)
{
    static const char *const names[] = {
        "solid", "solid facet normal 0 0 1 outer loop", "SOLID ascii\nfacet normal", "facet normal"
    };
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        struct file_text f = binary_file(names[i], 3, 3);
        struct scan s;
        scan_read(&f, &s);
        expect_facets(&s, 3);
        ck_assert_str_eq(s.info.format, "stl binary");
        scan_free(&s);
    }
    struct file_text f = binary_file("solid with a wrong count", 7, 3);
    struct scan s;
    scan_read(&f, &s);
    expect_facets(&s, 3);
    ck_assert_str_eq(s.info.format, "stl binary");
    scan_free(&s);
}
END_TEST

START_TEST(whole_facets_are_read_whatever_the_header_counts)
{
    static const uint32_t declared[] = { 0, 1, 6, 1000, UINT32_MAX };
    for (size_t i = 0; i < sizeof declared / sizeof *declared; i++) {
        struct file_text f = binary_file("", declared[i], 5);
        char remark[100];
        struct scan s;
        scan_read(&f, &s);
        expect_facets(&s, 5);
        snprintf(remark, sizeof remark, "the header counts %" PRIu32 " facets, 5 are there and were read",
                 declared[i]);
        ck_assert_str_eq(s.remark, remark);
        scan_free(&s);
    }
}
END_TEST

START_TEST(bytes_behind_the_counted_facets_are_remarked)
{
    struct file_text f = binary_file("", 4, 4);
    struct scan s;
    put(&f, "a signature");
    scan_read(&f, &s);
    expect_facets(&s, 4);
    ck_assert_str_eq(s.remark, "11 bytes behind the last facet");
    scan_free(&s);
}
END_TEST

START_TEST(a_binary_file_cut_short_is_refused_and_names_the_facet)
{
    for (size_t cut = 1; cut < 200; cut++) {
        struct file_text f = binary_file("cut", 4, 4);
        char part[80];
        struct scan s;
        f.bytes -= cut;
        const size_t there = (f.bytes - 84) / 50;
        scan_read(&f, &s);
        if (cut % 50 == 0) {                    /* whole facets: the count is what is wrong */
            expect_facets(&s, there);
        } else if (there == 0) {                /* nothing to know it by */
            scan_expect_failure(&s, SPC_INPUT_FORMAT, "known format");
        } else {
            snprintf(part, sizeof part, "facet %zu of 4 is cut short", there);
            scan_expect_failure(&s, SPC_INPUT_TRUNCATED, part);
        }
        scan_free(&s);
    }
}
END_TEST

START_TEST(a_count_of_none_before_a_facet_cut_short_is_refused)
{
    struct file_text f = binary_file("never finished", 0, 3);
    struct scan s;
    f.bytes -= 7;
    scan_read(&f, &s);
    scan_expect_failure(&s, SPC_INPUT_TRUNCATED, "facet 2 of 0 is cut short");
    scan_free(&s);
}
END_TEST

START_TEST(what_has_no_facets_at_their_place_is_no_stl)
{
    uint64_t state = 88172645463325252u;
    struct file_text f = { .big = false };
    struct scan s;
    for (int i = 0; i < 84 + 50 * 6; i++)
        put_int(&f, 1, (int64_t)(case_random(&state) * 256));
    scan_read(&f, &s);
    scan_expect_failure(&s, SPC_INPUT_FORMAT, "not a scan in a known format");
    ck_assert(strstr(s.err.what, "STL") != NULL);
    scan_free(&s);
    f = binary_start("zeros", 9);
    for (int i = 0; i < 100; i++)
        put_int(&f, 1, 0);
    scan_read(&f, &s);
    scan_expect_failure(&s, SPC_INPUT_FORMAT, "not a scan in a known format");
    scan_free(&s);
    f = binary_start("numbers, but no normals", 9);
    for (int i = 0; i < 24; i++) {
        put_real(&f, 4, i + 3);
        put_int(&f, i % 12 == 11 ? 2 : 0, 0);
    }
    scan_read(&f, &s);
    scan_expect_failure(&s, SPC_INPUT_FORMAT, "not a scan in a known format");
    scan_free(&s);
}
END_TEST

START_TEST(numbers_that_are_none_are_delivered)
{
    struct file_text f = binary_start("", 1);
    struct scan s;
    for (int i = 0; i < 12; i++)
        put_real(&f, 4, i < 3 ? nan("") : i == 4 ? HUGE_VAL : i == 5 ? nan("") : i);
    put_int(&f, 2, 0);
    scan_read(&f, &s);
    scan_expect_ok(&s);
    ck_assert(s.xyz[0][0] == 3 && isinf(s.xyz[0][1]) && isnan(s.xyz[0][2]));
    scan_free(&s);
}
END_TEST

/* ---- colours -------------------------------------------------------------------------------- */

static void expect_color(const struct scan *s, size_t facet, int r, int g, int b, int a)
{
    for (size_t k = 3 * facet; k < 3 * facet + 3; k++)
        if (s->rgba[k][0] != r || s->rgba[k][1] != g || s->rgba[k][2] != b || s->rgba[k][3] != a)
            ck_abort_msg("facet %zu is %d %d %d %d, wanted %d %d %d %d", facet, s->rgba[k][0],
                         s->rgba[k][1], s->rgba[k][2], s->rgba[k][3], r, g, b, a);
}

static void read_words(const char *name, size_t name_bytes, const unsigned *words, size_t count,
                       struct scan *s)
{
    struct file_text f = binary_start("", (uint32_t)count);
    memcpy(f.data, name, name_bytes);
    for (size_t i = 0; i < count; i++)
        binary_facet(&f, (int)i, words[i]);
    scan_read(&f, s);
    expect_facets(s, count);
}

START_TEST(viscam_colors_are_valid_with_bit_15_and_blue_lowest)
{
    static const unsigned words[] = { 0x8000 | 31, 0x8000 | 31 << 5, 0x8000 | 31 << 10, 0, 0x8000 | 1 };
    struct scan s;
    read_words("", 0, words, 5, &s);
    ck_assert(s.info.colors);
    expect_color(&s, 0, 0, 0, 255, 255);
    expect_color(&s, 1, 0, 255, 0, 255);
    expect_color(&s, 2, 255, 0, 0, 255);
    expect_color(&s, 3, 255, 255, 255, 255);
    expect_color(&s, 4, 0, 0, 8, 255);
    scan_free(&s);
}
END_TEST

START_TEST(magics_colors_are_valid_without_bit_15_and_red_lowest)
{
    static const unsigned words[] = { 31, 31 << 5, 31 << 10, 0x8000, 0 };
    static const char name[] = "a part COLOR=\x10\x20\x30\x40,MATERIAL=";
    struct scan s;
    read_words(name, sizeof name - 1, words, 5, &s);
    ck_assert(s.info.colors);
    expect_color(&s, 0, 255, 0, 0, 255);
    expect_color(&s, 1, 0, 255, 0, 255);
    expect_color(&s, 2, 0, 0, 255, 255);
    expect_color(&s, 3, 0x10, 0x20, 0x30, 0x40);
    expect_color(&s, 4, 0, 0, 0, 255);
    scan_free(&s);
    static const unsigned zeros[4];
    read_words(name, sizeof name - 1, zeros, 4, &s);
    expect_color(&s, 2, 0x10, 0x20, 0x30, 0x40);
    scan_free(&s);
}
END_TEST

static void expect_plain(const unsigned *words, size_t count)
{
    struct scan s;
    read_words("COLOR =", 7, words, count, &s);
    ck_assert(!s.info.colors);
    scan_free(&s);
}

START_TEST(words_that_are_no_colors_are_not_taken_for_them)
{
    unsigned words[400];
    for (unsigned i = 0; i < 400; i++)
        words[i] = i == 7 || i == 8 || i == 9 ? 0x8000 | i : 0;     /* stray */
    expect_plain(words, 400);
    for (unsigned i = 0; i < 400; i++)
        words[i] = 0xffff;                                          /* never filled */
    expect_plain(words, 400);
    for (unsigned i = 0; i < 400; i++)
        words[i] = i * 164;                                         /* numbers of patches */
    expect_plain(words, 400);
    expect_plain((const unsigned[]){ 0x8123, 0, 0 }, 3);            /* only one */
}
END_TEST

/* Judged by samples: a file of more facets than they cover. */
START_TEST(colors_of_large_files_are_found)
{
    const uint32_t count = 350000;
    struct file_text f = binary_start("", count);
    struct scan s;
    for (uint32_t i = 0; i < count; i++)
        binary_facet(&f, (int)i, i % 50 == 0 ? 0x8000 | i % 31 : 0);
    scan_once = true;
    scan_read(&f, &s);
    scan_once = false;
    scan_expect_ok(&s);
    ck_assert(s.info.colors);
    expect_color(&s, 50, 0, 0, (50 % 31 * 255 + 15) / 31, 255);
    expect_color(&s, count - 1, 255, 255, 255, 255);
    scan_free(&s);
}
END_TEST

/* ---- text ----------------------------------------------------------------------------------- */

START_TEST(text_is_read_over_windows_and_batches)
{
    static const int counts[] = { 1, 1365, 1366, 9000 };
    for (size_t c = 0; c < sizeof counts / sizeof *counts; c++) {
        struct file_text f = { .big = false };
        struct scan s;
        put(&f, "solid statue\n");
        for (int i = 0; i < counts[c]; i++)
            ascii_facet(&f, i);
        put(&f, "endsolid statue\n");
        scan_read(&f, &s);
        expect_facets(&s, (size_t)counts[c]);
        ck_assert_str_eq(s.remark, "");
        ck_assert(!s.info.wide && !s.info.colors);
        scan_free(&s);
    }
}
END_TEST

#define CORNERS "vertex 0 .5 0 vertex 0 5e-1 -1 vertex -0 +0.50 -2.e0 endloop endfacet"
#define FACET "facet normal 0 0 1 outer loop " CORNERS "\n"

START_TEST(keywords_blanks_and_line_ends_are_free)
{
    expect_text("solid\n" FACET "endsolid\n", 1, "");
    expect_text("SOLID X\nFACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX 0 0.5 0\nVertex 0 .5E0 -1\nVERTEX 0 "
                "0.5 -2\nENDLOOP\nENDFACET\nENDSOLID X", 1, "");
    expect_text("\xef\xbb\xbfsolid\r\n\r\n" FACET "\r\nendsolid\r\n", 1, "");
    expect_text("solid x\rfacet normal 0 0 1\router loop\rvertex 0 0.5 0\rvertex 0 0.5 -1\r"
                "vertex 0 0.5 -2\rendloop\rendfacet\rendsolid x\r", 1, "");
    expect_text("\n \t solid x\nfacet\tnormal\v0\f0 1\n\n\nouter\n\nloop vertex\n0\n0.5\n0 vertex 0 0.5 "
                "-1\n\nvertex 0 0.5 -2 endloop\nendfacet endsolid", 1, "");
    expect_text(FACET "endsolid\n", 1, "");
}
END_TEST

START_TEST(names_say_anything)
{
    expect_text("solid facet normal vertex endsolid\n" FACET "endsolid solid facet endloop\n", 1, "");
    expect_text("solid \xc3\xa4\xff\xfe \"quoted\" # 1 2 3\n" FACET "endsolid \xff\n", 1, "");
    expect_text("solid\tname\n" FACET "endsolid", 1, "");
    char text[2000] = "solid ";
    memset(text + 6, 'x', 1200);
    strcpy(text + 1206, "\n" FACET "endsolid\n");
    expect_text(text, 1, "");
}
END_TEST

START_TEST(normals_are_passed_over)
{
    expect_text("solid\nfacet normal nan nan nan outer loop " CORNERS "\nendsolid\n", 1, "");
    expect_text("solid\nfacet normal -nan(ind) 1.#QNAN 1,5 outer loop " CORNERS "\nendsolid\n", 1, "");
    expect_text("solid\nfacet normal\nouter loop " CORNERS "\nendsolid\n", 1, "");
    expect_text("solid\nfacet outer loop " CORNERS "\nendsolid\n", 1, "");
    expect_refused("solid\nfacet normal 1 2 3 4 5 6 7 8 9 outer loop " CORNERS, SPC_INPUT_FORMAT,
                   "facet 0: '8' is not 'outer'");
}
END_TEST

START_TEST(several_solids_are_one_scan)
{
    struct file_text f = { .big = false };
    struct scan s;
    for (int i = 0; i < 5; i++) {
        put(&f, "solid part %d\n", i);
        ascii_facet(&f, i);
        put(&f, "endsolid part %d\n\n", i);
    }
    put(&f, "solid empty\nendsolid empty\n");
    scan_read(&f, &s);
    expect_facets(&s, 5);
    ck_assert_str_eq(s.remark, "");
    scan_free(&s);
}
END_TEST

START_TEST(missing_ends_and_strange_lines_are_remarked)
{
    expect_text("solid x\n" FACET, 1, "the last solid has no 'endsolid'");
    expect_text("solid x\n" FACET "endsolid\n# made by a program\n\x1a", 1,
                "2 lines outside of solids were passed over");
    expect_text("solid x\nendsolid x\n", 0, "");
}
END_TEST

START_TEST(text_that_is_not_in_its_place_names_the_facet)
{
    static const char two[] = "solid x\n" FACET FACET;
    expect_refused("solid x\n" FACET "triangle 1 2 3\nendsolid\n", SPC_INPUT_FORMAT,
                   "facet 1: 'triangle' is not 'facet' or 'endsolid'");
    expect_refused("solid x\n" FACET "facet normal 0 0 1 outer loop vertex 1 2 x3 " CORNERS,
                   SPC_INPUT_FORMAT, "facet 1: 'x3' is not a number");
    expect_refused("solid x\nfacet normal 0 0 1 outer loop vertex 1 2 3,5 vertex", SPC_INPUT_FORMAT,
                   "facet 0: '3,5' is not a number");
    expect_refused("solid x\nfacet normal 0 0 1 outer loop vertex 1 2 vertex 1", SPC_INPUT_FORMAT,
                   "facet 0: 'vertex' is not a number");
    expect_refused("solid x\nfacet normal 0 0 1 outer loop vertex 1 2 3 vertex 1 2 3 endloop endfacet\n",
                   SPC_INPUT_FORMAT, "facet 0: 'endloop' is not 'vertex'");
    expect_refused("solid x\nfacet normal 0 0 1 outer loop vertex 1 2 3 vertex 1 2 3 vertex 1 2 3 "
                   "vertex 1 2 3 endloop endfacet\n", SPC_INPUT_FORMAT, "'vertex' is not 'endloop'");
    expect_refused("solid x\nfacet normal 0 0 1 outer loops", SPC_INPUT_FORMAT, "'loops' is not 'loop'");
    for (size_t n = 10; n < strlen(two); n++) {         /* every cut */
        struct scan s;
        scan_read_bytes(two, n, &s);
        const bool whole = n == strlen(FACET) + 8 || n == strlen(FACET) + 7 || n == strlen(two) - 1;
        if (s.status != (whole ? SPC_OK : SPC_INPUT_TRUNCATED))
            ck_assert_msg(s.status == SPC_INPUT_FORMAT && strchr(" \n", two[n]) == NULL, "cut at %zu: %d %s",
                          n, (int)s.status, s.err.what);    /* inside a word, which is not one then */
        scan_free(&s);
    }
}
END_TEST

static bool text_is_wide(const char *number)
{
    struct file_text f = { .big = false };
    struct scan s;
    put(&f, "solid\nfacet normal 0 0 1 outer loop vertex 0 0 1 vertex 0 %s 0 vertex 1 2 3 endloop "
        "endfacet\nendsolid\n", number);
    scan_read(&f, &s);
    scan_expect_ok(&s);
    const bool wide = s.info.wide;
    scan_free(&s);
    return wide;
}

/* A float printed with as many digits as there are must read the same. */
START_TEST(text_is_wide_when_a_float_would_lose_digits)
{
    static const char *const narrow[] = {
        "0.1", "0", "-0.326964736", "1e-5", "3.40282347e38", "0.30000001192092896", "447751.12",
        "1.1754944e-38", "16777216", "nan", "inf", "123456.789062", "5.000000e+02", "-1.5e-12"
    };
    static const char *const wide[] = {
        "447751.123", "0.1000000000001", "16777217", "500000.001", "1e39", "5400000.25e0", "1e-60",
        "0.30000000000000004", "123456.789e-3", "-4.4775112345e5"
    };
    for (size_t i = 0; i < sizeof narrow / sizeof *narrow; i++)
        ck_assert_msg(!text_is_wide(narrow[i]), "%s", narrow[i]);
    for (size_t i = 0; i < sizeof wide / sizeof *wide; i++)
        ck_assert_msg(text_is_wide(wide[i]), "%s", wide[i]);
}
END_TEST

static int cancel(void *ctx, const char *phase, uint64_t done, uint64_t total)
{
    ck_assert_str_eq(phase, "count");
    ck_assert_uint_le(done, total);
    return ++*(int *)ctx == 3;
}

START_TEST(counting_tells_progress_and_can_be_cancelled)
{
    int calls = 0;
    const struct spb_progress progress = { cancel, &calls };
    const struct spb_source_options options = { .progress = &progress };
    struct file_text f = { .big = false };
    struct spb_source *source = NULL;
    put(&f, "solid x\n");
    for (int i = 0; i < 6000; i++)
        ascii_facet(&f, i);
    scan_write(f.data, f.bytes);
    free(f.data);
    ck_assert_int_eq(spb_source_open(scan_path, &options, &source, NULL), SPC_CANCELLED);
    ck_assert_int_eq(calls, 3);
    ck_assert_ptr_null(source);
}
END_TEST

/* ---- closed --------------------------------------------------------------------------------- */

/* A sphere as STL, some of its zeros negative. */
static void write_mesh(const struct case_mesh *m, bool text, const char *path)
{
    struct file_text f = binary_start("", m->face_count);
    if (text) {
        f.bytes = 0;
        put(&f, "solid sphere\n");
    }
    for (uint32_t i = 0; i < m->face_count; i++) {
        if (text)
            put(&f, "facet normal 0 0 0\nouter loop\n");
        for (int k = 0; k < 3 && !text; k++)
            put_real(&f, 4, 0);
        for (int k = 0; k < 3; k++) {
            double xyz[3];
            for (int a = 0; a < 3; a++) {
                xyz[a] = (double)(float)m->xyz[m->face[i][k]][a];
                xyz[a] = fabs(xyz[a]) < 0.05 ? (i % 2 ? -0.0 : 0.0) : xyz[a];
                if (!text)
                    put_real(&f, 4, xyz[a]);
            }
            if (text)
                put(&f, "vertex %.9g %.9g %.9g\n", xyz[0], xyz[1], xyz[2]);
        }
        if (text)
            put(&f, "endloop\nendfacet\n");
        else
            put_int(&f, 2, 0);
    }
    FILE *const file = fopen(path, "wb");
    ck_assert_ptr_nonnull(file);
    ck_assert_uint_eq(fwrite(f.data, 1, f.bytes, file), f.bytes);
    ck_assert_int_eq(fclose(file), 0);
    free(f.data);
}

START_TEST(closed_surfaces_are_found_closed_by_place)
{
    for (int text = 0; text < 2; text++)
        for (int open = 0; open < 2; open++) {
            struct case_mesh m = case_sphere(3000, 5);
            struct spb_build_options o = case_options(case_path("s.stl"), case_path("s.spc"));
            m.face_count -= (uint32_t)open;
            write_mesh(&m, text, o.scan);
            struct spc_reader *r = case_build(&o);
            const struct spc_header *h = spc_reader_header(r);
            ck_assert_int_eq((h->flags & SPC_FLAG_CULL_BACK) != 0, !open);
            ck_assert_uint_eq(h->leaf_count + h->dropped_degenerate, m.face_count);
            case_verify(r);
            spc_reader_close(r);
            case_mesh_free(&m);
        }
}
END_TEST

START_TEST(a_real_file_has_its_facets)
{
    const char *const data = getenv("SPC_DATA");
    char path[400];
    if (data == NULL)
        return;
    snprintf(path, sizeof path, "%s/scans/CamelBox.stl", data);
    struct spb_build_options o = case_options(path, case_path("camel.spc"));
    struct spc_reader *r = case_build(&o);
    ck_assert_uint_eq(spc_reader_header(r)->faces_in, 49260);
    ck_assert_uint_eq(spc_reader_header(r)->dropped_degenerate, 48);
    case_verify(r);
    spc_reader_close(r);
}
END_TEST

int main(void)
{
    return SUITE("stl", start, finish, binary_facets_are_read_over_windows_and_batches,
                 binary_that_begins_with_solid_is_binary,
                 whole_facets_are_read_whatever_the_header_counts,
                 bytes_behind_the_counted_facets_are_remarked,
                 a_binary_file_cut_short_is_refused_and_names_the_facet,
                 a_count_of_none_before_a_facet_cut_short_is_refused,
                 what_has_no_facets_at_their_place_is_no_stl, numbers_that_are_none_are_delivered,
                 viscam_colors_are_valid_with_bit_15_and_blue_lowest,
                 magics_colors_are_valid_without_bit_15_and_red_lowest,
                 words_that_are_no_colors_are_not_taken_for_them, colors_of_large_files_are_found,
                 text_is_read_over_windows_and_batches, keywords_blanks_and_line_ends_are_free,
                 names_say_anything, normals_are_passed_over, several_solids_are_one_scan,
                 missing_ends_and_strange_lines_are_remarked,
                 text_that_is_not_in_its_place_names_the_facet,
                 text_is_wide_when_a_float_would_lose_digits,
                 counting_tells_progress_and_can_be_cancelled,
                 closed_surfaces_are_found_closed_by_place, a_real_file_has_its_facets);
}
