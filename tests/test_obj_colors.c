/* OBJ files with materials and textures: which colours the corners of their faces get. */
#include "obj.h"

#include "build.h"
#include "image_case.h"

#include <sys/stat.h>

static struct spb_temp temp;

static const char *at(const char *name)
{
    static char paths[4][400];
    static int next;
    char *const path = paths[next++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", scan_folder, name);
    return path;
}

static void begin(void)
{
    scan_start();
    temp = (struct spb_temp){.folder = scan_folder};
}

static void end(void)
{
    static const char *const names[] = {
        "a.mtl", "b.mtl", "two words.mtl", "a.png", "b.png", "c.jpg", "two words.png", "sub/a.png", "sub/a.mtl",
        "out0.spc", "out1.spc", "out2.spc", "out3.spc",
        "b.obj", "c.obj",
    };
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        unlink(at(names[i]));
    rmdir(at("sub"));
    scan_finish();
}

static void put_file(const char *name, const char *text)
{
    FILE *const file = fopen(at(name), "wb");
    ck_assert_ptr_nonnull(file);
    fputs(text, file);
    fclose(file);
}

/* Yellow and blue above, red and green below. */
static void put_picture(const char *name)
{
    static const uint8_t quarters[16] = {255, 255, 0, 255, 0, 0, 255, 255, 255, 0, 0, 255, 0, 255, 0, 255};
    picture_png(at(name), quarters, 2, 2, &picture_plain);
}

struct colored {
    struct spb_source_info info;
    size_t count;
    uint8_t rgba[64][3][4];
    char remark[600];
};

static struct colored read_text(const char *text)
{
    const struct spb_source_options options = {.temp = &temp};
    struct colored c = {.count = 0};
    struct spb_source *source;
    struct spc_error err = {0};
    scan_write(text, strlen(text));
    ck_assert_msg(spb_source_open(scan_path, &options, &source, &err) == SPC_OK, "%s", err.what);
    c.info = *spb_source_info(source);
    for (int round = 0; round < 2; round++) {
        ck_assert_int_eq(spb_source_begin_faces(source, &err), SPC_OK);
        memset(scan_faces.rgba, 7, sizeof scan_faces.rgba);
        ck_assert_msg(spb_source_faces(source, &scan_faces, &err) == SPC_OK, "%s", err.what);
        ck_assert_uint_le(scan_faces.count, 64);
        ck_assert(round == 0 || memcmp(c.rgba, scan_faces.rgba, scan_faces.count * 12) == 0);
        c.count = scan_faces.count;
        memcpy(c.rgba, scan_faces.rgba, c.count * 12);
    }
    snprintf(c.remark, sizeof c.remark, "%s", spb_source_remark(source));
    spb_source_close(source);
    return c;
}

static void expect(const struct colored *c, size_t triangle, int corner, unsigned rgb)
{
    const uint8_t *const got = c->rgba[triangle][corner];
    ck_assert(triangle < c->count);
    ck_assert_msg(got[0] == rgb >> 16 && got[1] == (rgb >> 8 & 255) && got[2] == (rgb & 255) &&
                  got[3] == 255, "triangle %d corner %d: %02x%02x%02x, wanted %06x", (int)triangle, corner,
                  got[0], got[1], got[2], rgb);
}

enum { RED = 0xff0000, GREEN = 0x00ff00, BLUE = 0x0000ff, YELLOW = 0xffff00, WHITE = 0xffffff };

#define QUAD "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
#define UVS "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
#define FACE "f 1/1 2/2 3/3 4/4\n"

static void expect_quad(const struct colored *c, size_t first)
{
    expect(c, first, 0, RED);
    expect(c, first, 1, GREEN);
    expect(c, first, 2, BLUE);
    expect(c, first + 1, 0, RED);
    expect(c, first + 1, 1, BLUE);
    expect(c, first + 1, 2, YELLOW);
}

START_TEST(a_textured_quad_has_the_colours_of_its_corners)
{
    put_picture("a.png");
    put_file("a.mtl", "newmtl m\nKd 0.5 0.5 0.5\nmap_Kd a.png\n");
    const struct colored c = read_text("mtllib a.mtl\n" QUAD UVS "usemtl m\n" FACE
                                       "f -4/-4 -3/-3/9 -2/-2 -1/-1\nf 1/1/1 2/2/2 3/3/3 4/4/4\n");
    ck_assert(c.info.corner_colors && !c.info.colors);
    ck_assert_str_eq(c.remark, "");
    expect_quad(&c, 0);
    expect_quad(&c, 2);
    expect_quad(&c, 4);
}
END_TEST

START_TEST(names_of_files_are_found_as_people_write_them)
{
    static const char *const maps[] = {
        "sub/a.png", "sub\\a.png", "C:\\Users\\me\\scans\\a.png", "/nowhere/at/all/a.png", "two words.png",
        "..\\up\\two words.png", "\"two words.png\"", "two words.png   ", "-clamp on a.png", "-s 1 1 1 a.png",
        "-o 0 0 0 -s 1 1 -blendu on -mm 0 1 -bm 2 -texres 3 -imfchan m -t 1 1 1 two words.png",
        "-s 1 a.png", "-boost 1.5 -cc off -type sphere -blendv off a.png", "\ta.png",
    };
    mkdir(at("sub"), 0700);
    put_picture("sub/a.png");
    put_picture("a.png");
    put_picture("two words.png");
    for (size_t i = 0; i < sizeof maps / sizeof *maps; i++) {
        char text[300];
        snprintf(text, sizeof text, "# a library\r\n\tnewmtl  m n \r\n illum 2\r\nmap_Kd %s\r\n", maps[i]);
        put_file("a.mtl", text);
        const struct colored c = read_text("mtllib C:\\here\\a.mtl\n" QUAD UVS "usemtl m n\n" FACE);
        ck_assert_msg(c.info.corner_colors, "%s: %s", maps[i], c.remark);
        expect_quad(&c, 0);
    }
    unlink(at("a.mtl"));
    unlink(at("a.png"));
    put_file("sub/a.mtl", "newmtl m\nmap_kd a.png\n");          /* beside its library */
    const struct colored c = read_text("mtllib sub/a.mtl\n" QUAD UVS "usemtl m\n" FACE);
    ck_assert(c.info.corner_colors);
    expect_quad(&c, 0);
}
END_TEST

START_TEST(options_move_and_scale_the_picture)
{
    put_picture("a.png");
    put_file("a.mtl", "newmtl o\nmap_Kd -o 0.5 0 a.png\nnewmtl s\nmap_Kd -s -1 1 a.png\n"
                      "newmtl c\nmap_Kd -clamp on -o 3 0 0 a.png\nnewmtl v\nmap_Kd -s 1 2 -o 0 0.4 a.png\n");
    const struct colored c = read_text("mtllib a.mtl\n" QUAD "vt 0.1 0.1\nvt 0.2 0.1\nvt 0.1 0.2\n"
                                       "usemtl o\nf 1/1 2/2 3/3\nusemtl s\nf 1/1 2/2 3/3\n"
                                       "usemtl c\nf 1/1 2/2 3/3\nusemtl v\nf 1/1 2/2 3/3\n");
    for (int k = 0; k < 3; k++) {
        expect(&c, 0, k, GREEN);
        expect(&c, 1, k, GREEN);
        expect(&c, 2, k, GREEN);
        expect(&c, 3, k, YELLOW);
    }
}
END_TEST

START_TEST(libraries_are_named_in_many_ways)
{
    static const char *const heads[] = {
        "mtllib a.mtl b.mtl\n", "mtllib a.mtl\nmtllib b.mtl\n", "mtllib a.mtl\nmtllib a.mtl\nmtllib  b.mtl \n",
        "mtllib two words.mtl\nmtllib b.mtl\n",
    };
    put_picture("a.png");
    put_file("a.mtl", "newmtl m\nmap_Kd a.png\n");
    put_file("two words.mtl", "newmtl m\nmap_Kd a.png\nnewmtl m\nKd 1 0 0\n");
    put_file("b.mtl", "newmtl n\nKd 1 0 0\nnewmtl m\nKd 0 0 1\n");
    for (size_t i = 0; i < 4; i++) {
        char text[500];
        snprintf(text, sizeof text, "%s" QUAD UVS "usemtl m\n" FACE "usemtl n\n" FACE, heads[i]);
        const struct colored c = read_text(text);
        ck_assert_msg(c.remark[0] == 0, "%s", c.remark);
        expect_quad(&c, 0);
        expect(&c, 2, 0, RED);
    }
}
END_TEST

START_TEST(what_is_missing_or_broken_is_remarked)
{
    static const struct { const char *mtl, *part; } cases[] = {
        {"newmtl m\nKd 0 1 0\nmap_Kd x.png\n", "texture 'x.png' was not found: ignored"},
        {"newmtl m\nKd 0 1 0\nmap_Kd x.png\nnewmtl n\nmap_Kd y.png\n", "'x.png' was not found: ignored (and 1 more)"},
        {"newmtl m\nKd 0 1 0\nmap_Kd x.png\nnewmtl n\nmap_Kd x.png\n", "'x.png' was not found: ignored"},
        {"newmtl m\nKd 0 1 0\nmap_Kd b.png\n", "texture 'b.png' is neither PNG nor JPEG: ignored"},
        {"newmtl m\nKd 0 1 0\nmap_Kd sub\n", "texture 'sub' was not found: ignored"},
        {NULL, "material library 'a.mtl' was not found: ignored"},
    };
    mkdir(at("sub"), 0700);
    put_file("b.png", "no picture");
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        unlink(at("a.mtl"));
        if (cases[i].mtl)
            put_file("a.mtl", cases[i].mtl);
        const struct colored c = read_text("mtllib a.mtl\n" QUAD UVS "usemtl m\n" FACE "usemtl n\n" FACE);
        ck_assert_msg(strstr(c.remark, cases[i].part) != NULL, "%s", c.remark);
        ck_assert_ptr_null(strstr(c.remark, scan_folder));
        ck_assert(c.info.corner_colors == (cases[i].mtl != NULL));
        if (c.info.corner_colors) {
            expect(&c, 0, 0, GREEN);
            expect(&c, 2, 0, WHITE);
        }
    }
}
END_TEST

START_TEST(materials_colour_a_scan_when_they_say_something)
{
    static const struct { const char *mtl; bool colored; unsigned m, n; } cases[] = {
        {"newmtl m\nKd 0.8 0.8 0.8\n", false, 0, 0},
        {"newmtl m\nKd 0.8 0.8 0.8\nnewmtl n\nKd 0.8 0.8 0.8\n", false, 0, 0},
        {"newmtl m\nKd 0.8 0.8 0.8\nnewmtl unused\nKd 1 0 0\n", false, 0, 0},
        {"newmtl m\nKd 0 0 0\nnewmtl n\nKd 1 1 1\n", true, 0, WHITE},
        {"newmtl m\nKd 1 0.5 0\n", true, 0xff8000, WHITE},
        {"newmtl m\nKd 2 -1 nan\nnewmtl n\nKd 0.2\n", true, RED, 0x333333},
        {"newmtl m\nKd spectral a.rfl 1\nnewmtl n\nKd xyz 1 1 1\n", false, 0, 0},
        {"Kd 1 0 0\n", false, 0, 0}, {"", false, 0, 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        put_file("a.mtl", cases[i].mtl);
        const struct colored c = read_text("mtllib a.mtl\n" QUAD FACE "usemtl m\n" FACE "usemtl n\n" FACE
                                           "usemtl other\n" FACE);
        ck_assert_msg(c.info.corner_colors == cases[i].colored, "%s", cases[i].mtl);
        if (!cases[i].colored)
            continue;
        expect(&c, 0, 0, WHITE);
        expect(&c, 2, 0, cases[i].m);
        expect(&c, 5, 2, cases[i].n);
        expect(&c, 7, 1, WHITE);
    }
}
END_TEST

#define PINK "v 0 0 0 1 0 1\nv 1 0 0 1 0 1\nv 1 1 0 1 0 1\nv 0 1 0\n"

START_TEST(textures_win_over_vertices_and_vertices_over_materials)
{
    put_picture("a.png");
    put_file("a.mtl", "newmtl m\nmap_Kd a.png\nnewmtl n\nKd 0 1 0\n");
    struct colored c = read_text("mtllib a.mtl\n" PINK UVS "usemtl n\n" FACE);
    ck_assert(!c.info.corner_colors && c.info.colors);
    ck_assert_ptr_nonnull(strstr(c.remark, "1 of 4 vertices have no colour"));
    c = read_text("mtllib a.mtl\n" PINK UVS "usemtl m\n" FACE "usemtl n\n" FACE);
    ck_assert(c.info.corner_colors && !c.info.colors);
    ck_assert_ptr_nonnull(strstr(c.remark, "colours of vertices are not used"));
    expect_quad(&c, 0);
    expect(&c, 2, 1, GREEN);
}
END_TEST

START_TEST(corners_without_a_place_in_the_picture_take_the_materials_colour)
{
    put_picture("a.png");
    put_file("a.mtl", "newmtl m\nKd 0 0 1\nmap_Kd a.png\n");
    const struct colored c = read_text("mtllib a.mtl\nusemtl m\n" QUAD UVS "vt nan 0\nvt x\nvt\nvt 1e400 1\nvt 0\n"
                                       "f 1 2 3\nf 1/1 2/2 3\nf 1/1 2/2 3/99\nf 1/1 2/2 3/0\nf 1/5 2/2 3/3\n"
                                       "f 1/6 2/2 3/3\nf 1/7 2/2 3/3\nf 1/8 2/2 3/3\nf 1/-10 2/2 3/3\n"
                                       "f 1/9 2/2 3/3\n");
    for (size_t i = 0; i < 9; i++)
        for (int k = 0; k < 3; k++)
            expect(&c, i, k, BLUE);
    expect(&c, 9, 0, RED);
}
END_TEST

START_TEST(material_and_uv_hold_over_objects_and_ranges)
{
    struct file_text f = {.big = false};
    put_picture("a.png");
    put_file("a.mtl", "newmtl m\nmap_Kd a.png\nnewmtl n\nKd 0 1 0\n");
    put(&f, "mtllib a.mtl\nusemtl n\n" QUAD UVS FACE "usemtl m\n");
    for (int i = 0; i < 9000; i++)
        put(&f, "vn 0.25 0.5 0.75 # more than a gap\n");
    put(&f, "o second\n" QUAD UVS "g x\ns 1\nf -4/-4 -3/-3 -2/-2 -1/-1\n");
    for (int i = 0; i < 9000; i++)
        put(&f, "vt 7.7 7.7 # more than a gap\n");
    put(&f, QUAD UVS "f -4/-4 -3/-3 -2/-2 -1/-1\nf 1/1 2/2 3/3 4/4%c", 0);
    const struct colored c = read_text((const char *)f.data);
    free(f.data);
    expect(&c, 0, 0, GREEN);
    for (size_t i = 2; i < 8; i += 2)
        expect_quad(&c, i);
}
END_TEST

START_TEST(without_temporary_files_nothing_is_textured)
{
    struct scan s;
    put_picture("a.png");
    put_file("a.mtl", "newmtl m\nKd 0.8 0.8 0.8\nmap_Kd a.png\n");
    scan_read_bytes("mtllib a.mtl\n" QUAD UVS "usemtl m\n" FACE, strlen("mtllib a.mtl\n" QUAD UVS "usemtl m\n" FACE),
                    &s);
    scan_expect_ok(&s);
    ck_assert(!s.info.corner_colors);
    scan_free(&s);
}
END_TEST

START_TEST(random_libraries_do_no_harm)
{
    static const char *const words[] = {
        "newmtl", " m", " n", "\n", "\r", "map_Kd", " -s", " -o", " 1", " 0.5", " -clamp", " on", " a.png", "Kd",
        " nan", " -mm", "\\", " \"", "\"", "-", " ", "\t", "\xff", "#", "/", "..",
    };
    const uint64_t seed = 12;
    uint64_t random = seed;
    printf("seed %" PRIu64 "\n", seed);
    put_picture("a.png");
    for (int round = 0; round < 300; round++) {
        struct file_text f = {.big = false};
        put(&f, "newmtl m\n");
        for (int i = 0; i < round % 60 + 1; i++) {
            random = random * 6364136223846793005u + 1442695040888963407u;
            put(&f, "%s", words[(random >> 33) % (sizeof words / sizeof *words)]);
        }
        if (round % 50 == 0)
            for (int i = 0; i < 3000; i++)
                put(&f, "long line ");
        put_bytes(&f, "", 1);
        put_file("a.mtl", (const char *)f.data);
        free(f.data);
        read_text("mtllib a.mtl\n" QUAD UVS "usemtl m\n" FACE "usemtl n\n" FACE);
    }
}
END_TEST

/* More names than the table takes: the rest is white, and nothing grows without end. */
START_TEST(materials_without_end_are_bounded)
{
    struct file_text f = {.big = false}, m = {.big = false};
    struct spb_source *source;
    const struct spb_source_options options = {.temp = &temp};
    put(&f, "mtllib a.mtl\n" QUAD);
    for (int i = 0; i < 20000; i++) {
        put(&f, "usemtl m%d\nf 1 2 3\n", i);
        put(&m, "newmtl m%d\nKd 0 1 0\n", i);
    }
    put_bytes(&m, "", 1);
    put_file("a.mtl", (const char *)m.data);
    scan_write(f.data, f.bytes);
    free(m.data);
    free(f.data);
    ck_assert_int_eq(spb_source_open(scan_path, &options, &source, NULL), SPC_OK);
    ck_assert_ptr_nonnull(strstr(spb_source_remark(source), "3616 materials"));
    ck_assert_int_eq(spb_source_begin_faces(source, NULL), SPC_OK);
    for (size_t done = 0; done < 20000; done += scan_faces.count) {
        ck_assert_int_eq(spb_source_faces(source, &scan_faces, NULL), SPC_OK);
        for (size_t i = 0; i < scan_faces.count; i++)
            SCAN_CHECK(scan_faces.rgba[i][2][0] == (done + i < 16384 ? 0 : 255));
    }
    spb_source_close(source);
}
END_TEST

/* ---- archives ------------------------------------------------------------------------------------- */

/* A terrain of side * side * 2 triangles with two textures and some plain faces, vt lines shuffled. */
static void put_terrain(int side)
{
    enum { PICTURE = 600 };
    struct file_text f = {.big = false};
    uint8_t *const rgba = malloc(PICTURE * PICTURE * 4);
    for (size_t i = 0; i < PICTURE * PICTURE; i++) {
        rgba[4 * i] = (uint8_t)(i * 7 + i / PICTURE);
        rgba[4 * i + 1] = (uint8_t)(i / PICTURE * 3);
        rgba[4 * i + 2] = (uint8_t)((i * 2654435761u) >> 24);
        rgba[4 * i + 3] = 255;
    }
    picture_png(at("a.png"), rgba, PICTURE, PICTURE, &picture_plain);
    picture_jpeg(at("c.jpg"), rgba, PICTURE, PICTURE, 3, false);
    free(rgba);
    put_file("a.mtl", "newmtl m\nmap_Kd a.png\nnewmtl n\nmap_Kd c.jpg\nnewmtl o\nKd 1 0 0\n");
    const int count = (side + 1) * (side + 1);
    put(&f, "mtllib a.mtl\n");
    for (int i = 0; i < count; i++)
        put(&f, "v %d %d %.3f\n", i % (side + 1), i / (side + 1), i * 37 % 11 * 0.05);
    for (int i = 0; i < count; i++) {
        const int j = (int)((int64_t)i * 7919 % count);
        put(&f, "vt %.5f %.5f\n", j % (side + 1) * 1.7 / side, j / (side + 1) * 1.0 / side);
    }
    for (int i = 0; i < side * side; i++) {
        const int a = i / side * (side + 1) + i % side + 1, b = a + side + 1;
        if (i % (side * 5) == 0)
            put(&f, "usemtl %c\n", "mno"[i / (side * 5) % 3]);
        put(&f, "f %d/%d %d/%d %d/%d %d/%d\n", a, a, a + 1, a + 1, b + 1, b + 1, b, b);
    }
    scan_write(f.data, f.bytes);
    free(f.data);
}

static struct file_text slurp(const char *name)
{
    struct file_text f = {.big = false};
    FILE *const file = fopen(at(name), "rb");
    uint8_t piece[4096];
    size_t n;
    ck_assert_ptr_nonnull(file);
    while ((n = fread(piece, 1, sizeof piece, file)) > 0)
        put_bytes(&f, piece, n);
    fclose(file);
    return f;
}

START_TEST(archives_of_textured_scans_have_the_same_bytes_however_they_are_built)
{
    struct file_text first = {.big = false};
    put_terrain(120);
    for (int i = 0; i < 4; i++) {
        static struct spb_build_report report;
        struct spb_build_options o;
        struct spc_error err = {0};
        char name[20], out[400];
        snprintf(name, sizeof name, "out%d.spc", i);
        snprintf(out, sizeof out, "%s", at(name));
        spb_build_defaults(&o);
        o.scan = scan_path;
        o.out = out;
        o.memory = i % 2 ? (uint64_t)64 << 20 : (uint64_t)1 << 30;
        o.threads = i < 2 ? 1 : 4;
        o.part_faces = i == 2 ? 3000 : 0;
        o.vertices_on_disk = i == 3;
        o.slice_log2 = i == 3 ? 11 : 0;
        ck_assert_msg(spb_build(&o, &report, NULL, &err) == SPC_OK, "%s", err.what);
        ck_assert_uint_eq(report.header.leaf_count, 2 * 120 * 120);
        ck_assert(report.header.flags & SPC_FLAG_COLORS);
        struct file_text f = slurp(name);
        if (i == 0) {
            first = f;
            continue;
        }
        ck_assert_uint_eq(f.bytes, first.bytes);
        ck_assert(memcmp(f.data, first.data, f.bytes) == 0);
        free(f.data);
    }
    free(first.data);
}
END_TEST

START_TEST(colours_reach_the_archive)
{
    static struct spb_build_report report;
    struct spb_build_options o;
    struct spc_error err = {0};
    put_picture("a.png");
    put_file("a.mtl", "newmtl m\nmap_Kd a.png\n");
    scan_write("mtllib a.mtl\n" QUAD UVS "usemtl m\n" FACE, strlen("mtllib a.mtl\n" QUAD UVS "usemtl m\n" FACE));
    spb_build_defaults(&o);
    o.scan = scan_path;
    o.out = at("out0.spc");
    ck_assert_msg(spb_build(&o, &report, NULL, &err) == SPC_OK, "%s", err.what);
    /* Read as a scan again: an archive of two triangles, whose corners have kept their colours. */
    struct scan s;
    scan_read_path(at("out0.spc"), &s);
    scan_expect_ok(&s);
    ck_assert(s.info.colors);
    unsigned seen = 0;
    for (size_t i = 0; i < s.triangle_count; i++)
        for (int k = 0; k < 3; k++) {
            const double *const xyz = s.xyz[s.corner[i][k]];
            const uint8_t *const c = s.rgba[s.corner[i][k]];
            const unsigned rgb = (unsigned)c[0] << 16 | (unsigned)c[1] << 8 | c[2];
            const unsigned wanted = xyz[1] < 0.5 ? (xyz[0] < 0.5 ? RED : GREEN) : xyz[0] < 0.5 ? YELLOW : BLUE;
            ck_assert_uint_eq(rgb, wanted);
            seen++;
        }
    ck_assert_uint_eq(seen, 6);
    scan_free(&s);
}
END_TEST

/* Textured, with colours at its vertices, and plain: each keeps what it has. */
START_TEST(scans_with_colours_of_all_kinds_make_one_archive)
{
    static struct spb_build_report report;
    static char second[400], third[400];
    const char *const more[] = {second, third};
    struct spb_build_options o;
    struct spc_error err = {0};
    struct scan s;
    put_picture("a.png");
    put_file("a.mtl", "newmtl m\nmap_Kd a.png\n");
    scan_write("mtllib a.mtl\n" QUAD UVS "usemtl m\n" FACE, strlen("mtllib a.mtl\n" QUAD UVS "usemtl m\n" FACE));
    put_file("b.obj", "v 5 0 0 1 0 1\nv 6 0 0 1 0 1\nv 6 1 0 1 0 1\nf 1 2 3\n");
    put_file("c.obj", "v 8 0 0\nv 9 0 0\nv 9 1 0\nf 1 2 3\n");
    snprintf(second, sizeof second, "%s", at("b.obj"));
    snprintf(third, sizeof third, "%s", at("c.obj"));
    for (int order = 0; order < 3; order++) {           /* at last without the second */
        const char *const turned[] = {third, scan_path};
        spb_build_defaults(&o);
        o.scan = order == 0 ? scan_path : order == 1 ? second : third;
        o.more = order == 0 ? more : order == 1 ? turned : turned + 1;
        o.more_count = order == 2 ? 1 : 2;
        o.out = at("out0.spc");
        o.force = true;
        ck_assert_msg(spb_build(&o, &report, NULL, &err) == SPC_OK, "%s", err.what);
        scan_read_path(at("out0.spc"), &s);
        scan_expect_ok(&s);
        ck_assert_uint_eq(s.triangle_count, order == 2 ? 3 : 4);
        ck_assert(s.info.colors);
        for (size_t i = 0; i < s.vertex_count; i++) {
            const double x = s.xyz[i][0], y = s.xyz[i][1];
            const unsigned quad = y < 0.5 ? (x < 0.5 ? RED : GREEN) : x < 0.5 ? YELLOW : BLUE;
            const unsigned wanted = x > 7 ? WHITE : x > 4 ? 0xff00ff : quad;
            const uint8_t *const c = s.rgba[i];
            ck_assert_uint_eq((unsigned)c[0] << 16 | (unsigned)c[1] << 8 | c[2], wanted);
        }
        scan_free(&s);
    }
}
END_TEST

START_TEST(a_pause_changes_no_colours)
{
    const struct spb_source_options options = {.temp = &temp};
    struct spb_source *source;
    put_picture("a.png");
    put_file("a.mtl", "newmtl m\nmap_Kd a.png\n");
    scan_write("mtllib a.mtl\n" QUAD UVS "usemtl m\n" FACE, strlen("mtllib a.mtl\n" QUAD UVS "usemtl m\n" FACE));
    ck_assert_int_eq(spb_source_open(scan_path, &options, &source, NULL), SPC_OK);
    for (int round = 0; round < 3; round++) {
        struct colored c = {.count = 2};
        ck_assert_int_eq(spb_source_begin_faces(source, NULL), SPC_OK);
        ck_assert_int_eq(spb_source_faces(source, &scan_faces, NULL), SPC_OK);
        ck_assert(scan_faces.colored);
        memcpy(c.rgba, scan_faces.rgba, 24);
        expect_quad(&c, 0);
        spb_source_pause(source);
    }
    spb_source_close(source);
}
END_TEST

int main(void)
{
    return SUITE("obj_colors", begin, end,
                 a_textured_quad_has_the_colours_of_its_corners,
                 names_of_files_are_found_as_people_write_them,
                 options_move_and_scale_the_picture,
                 libraries_are_named_in_many_ways,
                 what_is_missing_or_broken_is_remarked,
                 materials_colour_a_scan_when_they_say_something,
                 textures_win_over_vertices_and_vertices_over_materials,
                 corners_without_a_place_in_the_picture_take_the_materials_colour,
                 material_and_uv_hold_over_objects_and_ranges,
                 without_temporary_files_nothing_is_textured,
                 random_libraries_do_no_harm,
                 materials_without_end_are_bounded,
                 archives_of_textured_scans_have_the_same_bytes_however_they_are_built,
                 colours_reach_the_archive,
                 scans_with_colours_of_all_kinds_make_one_archive,
                 a_pause_changes_no_colours);
}
