/* Pictures of all kinds, and the colours that triangles take from them. */
#include "texture.h"

#include "image.h"
#include "image_case.h"

#include <math.h>

static char path[400];
static struct spb_temp temp;

static void begin(void)
{
    scan_start();
    snprintf(path, sizeof path, "%s/picture", scan_folder);
    temp = (struct spb_temp){.folder = scan_folder};
}

static void end(void)
{
    unlink(path);
    scan_finish();
}

static uint8_t *make(size_t width, size_t height, void (*color)(size_t x, size_t y, uint8_t rgba[4]))
{
    uint8_t *const rgba = malloc(width * height * 4);
    SCAN_CHECK(rgba != NULL);
    for (size_t y = 0; y < height; y++)
        for (size_t x = 0; x < width; x++)
            color(x, y, rgba + (y * width + x) * 4);
    return rgba;
}

static void few_colors(size_t x, size_t y, uint8_t rgba[4])
{
    rgba[0] = (uint8_t)(x * 37 % 5 * 51);
    rgba[1] = (uint8_t)(y * 11 % 4 * 80);
    rgba[2] = (uint8_t)((x + y) % 3 * 100);
    rgba[3] = (uint8_t)((x ^ y) % 4 * 85);
}

static void smooth(size_t x, size_t y, uint8_t rgba[4])
{
    rgba[0] = (uint8_t)(20 + 2 * x);
    rgba[1] = (uint8_t)(230 - 2 * y);
    rgba[2] = (uint8_t)(40 + x + y);
    rgba[3] = 255;
}

/* ---- pictures ----------------------------------------------------------------------------------- */

START_TEST(png_of_every_kind_is_read_pixel_by_pixel)
{
    static const struct picture_kind kinds[] = {
        {PNG_COLOR_TYPE_RGB, 8, false}, {PNG_COLOR_TYPE_RGB, 16, false},
        {PNG_COLOR_TYPE_RGB_ALPHA, 8, false}, {PNG_COLOR_TYPE_RGB_ALPHA, 16, true},
        {PNG_COLOR_TYPE_GRAY, 8, false}, {PNG_COLOR_TYPE_GRAY, 16, false}, {PNG_COLOR_TYPE_GRAY, 1, false},
        {PNG_COLOR_TYPE_GRAY, 2, true}, {PNG_COLOR_TYPE_GRAY, 4, false},
        {PNG_COLOR_TYPE_GRAY_ALPHA, 8, true}, {PNG_COLOR_TYPE_GRAY_ALPHA, 16, false},
        {PNG_COLOR_TYPE_PALETTE, 8, false}, {PNG_COLOR_TYPE_PALETTE, 8, true}, {PNG_COLOR_TYPE_RGB, 8, true},
    };
    static const size_t sizes[][2] = {{37, 53}, {1, 1}, {70, 5}, {3, 90}};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds * 4; i++) {
        const struct picture_kind *const kind = &kinds[i / 4];
        const size_t width = sizes[i % 4][0], height = sizes[i % 4][1];
        uint8_t *const rgba = make(width, height, few_colors), row[400], wanted[4];
        struct spb_image *image;
        struct spc_error err = {0};
        picture_png(path, rgba, width, height, kind);
        ck_assert_msg(spb_image_open(path, &temp, &image, &err) == SPC_OK, "%s", err.what);
        ck_assert_uint_eq(spb_image_width(image), width);
        ck_assert_uint_eq(spb_image_height(image), height);
        for (size_t y = 0; y < height; y++) {
            ck_assert_int_eq(spb_image_row(image, row, &err), SPC_OK);
            for (size_t x = 0; x < width; x++) {
                picture_reduce(kind, rgba + (y * width + x) * 4, wanted);
                if (memcmp(row + x * 4, wanted, 4) != 0)
                    ck_abort_msg("kind %d, pixel %d %d", (int)i / 4, (int)x, (int)y);
            }
        }
        spb_image_close(image);
        free(rgba);
    }
}
END_TEST

START_TEST(jpeg_of_every_kind_is_read)
{
    enum { SIDE = 90 };
    uint8_t *const rgba = make(SIDE, SIDE, smooth), row[SIDE * 4];
    for (int kind = 0; kind < 6; kind++) {
        static const int components[] = {3, 1, 4};
        const int n = components[kind / 2];
        struct spb_image *image;
        struct spc_error err = {0};
        picture_jpeg(path, rgba, SIDE, SIDE, n, kind % 2);
        ck_assert_msg(spb_image_open(path, &temp, &image, &err) == SPC_OK, "%s", err.what);
        for (size_t y = 0; y < SIDE; y++) {
            ck_assert_int_eq(spb_image_row(image, row, &err), SPC_OK);
            for (size_t x = 0; x < SIDE; x++)
                for (size_t k = 0; k < 3; k++) {
                    const int wanted = rgba[(y * SIDE + x) * 4 + (n == 1 ? 0 : k)];
                    if (abs(row[x * 4 + k] - wanted) > 8)
                        ck_abort_msg("kind %d pixel %d %d: %d, wanted %d", kind, (int)x, (int)y,
                                     row[x * 4 + k], wanted);
                }
            ck_assert_uint_eq(row[3], 255);
        }
        spb_image_close(image);
    }
    free(rgba);
}
END_TEST

/* Reads all rows; what comes must be this. */
static enum spc_status read_all(struct spc_error *err)
{
    struct spb_image *image = NULL;
    enum spc_status status = spb_image_open(path, &temp, &image, err);
    uint8_t *const row = malloc(SPB_IMAGE_SIDE_MAX * 4);
    for (uint32_t y = 0; status == SPC_OK && y < spb_image_height(image); y++)
        status = spb_image_row(image, row, err);
    free(row);
    spb_image_close(image);
    return status;
}

static struct file_text slurp(void)
{
    struct file_text f = {.big = true};
    FILE *const file = fopen(path, "rb");
    uint8_t piece[4096];
    size_t n;
    while ((n = fread(piece, 1, sizeof piece, file)) > 0)
        put_bytes(&f, piece, n);
    fclose(file);
    return f;
}

static void spill_out(const void *data, size_t bytes)
{
    FILE *const file = fopen(path, "wb");
    ck_assert_uint_eq(fwrite(data, 1, bytes, file), bytes);
    fclose(file);
}

START_TEST(broken_pictures_are_refused_without_harm)
{
    uint8_t *const rgba = make(60, 40, few_colors);
    const uint64_t seed = 7;
    uint64_t random = seed;
    printf("seed %" PRIu64 "\n", seed);
    for (int kind = 0; kind < 4; kind++) {
        if (kind < 2)
            picture_png(path, rgba, 60, 40, &(struct picture_kind){PNG_COLOR_TYPE_RGB, 8, kind == 1});
        else
            picture_jpeg(path, rgba, 60, 40, 3, kind == 3);
        struct file_text f = slurp();
        for (size_t n = 0; n < f.bytes - (kind < 2 ? 12 : 200); n += 1 + n / 40) {
            struct spc_error err = {0};
            spill_out(f.data, n);
            ck_assert_int_eq(read_all(&err), SPC_INPUT_FORMAT);
            ck_assert_str_ne(err.what, "");
        }
        for (int round = 0; round < 300; round++) {
            random = random * 6364136223846793005u + 1442695040888963407u;
            const size_t at = (size_t)(random >> 33) % f.bytes;
            const uint8_t old = f.data[at];
            f.data[at] ^= (uint8_t)(1u << (random >> 20 & 7));
            spill_out(f.data, f.bytes);
            const enum spc_status status = read_all(NULL);
            SCAN_CHECK(status == SPC_OK || status == SPC_INPUT_FORMAT);
            f.data[at] = old;
        }
        free(f.data);
    }
    free(rgba);
}
END_TEST

static uint32_t crc(const uint8_t *p, size_t n)
{
    uint32_t c = 0xffffffff;
    for (size_t i = 0; i < n; i++) {
        c ^= p[i];
        for (int k = 0; k < 8; k++)
            c = c & 1 ? 0xedb88320 ^ c >> 1 : c >> 1;
    }
    return ~c;
}

START_TEST(pictures_that_claim_to_be_huge_are_refused_at_once)
{
    static const uint32_t sizes[][2] = {{0x7fffffff, 0x7fffffff}, {65537, 1}, {1, 65537}, {65536, 16385}};
    uint8_t *const rgba = make(8, 8, few_colors);
    picture_png(path, rgba, 8, 8, &picture_plain);
    struct file_text f = slurp();
    for (size_t i = 0; i < 4; i++) {
        struct spc_error err = {0};
        for (int k = 0; k < 4; k++) {
            f.data[16 + k] = (uint8_t)(sizes[i][0] >> (24 - 8 * k));
            f.data[20 + k] = (uint8_t)(sizes[i][1] >> (24 - 8 * k));
        }
        const uint32_t sum = crc(f.data + 12, 17);
        for (int k = 0; k < 4; k++)
            f.data[29 + k] = (uint8_t)(sum >> (24 - 8 * k));
        spill_out(f.data, f.bytes);
        ck_assert_int_eq(read_all(&err), SPC_INPUT_FORMAT);
        ck_assert_ptr_nonnull(strstr(err.what, "2^30"));
    }
    free(f.data);
    picture_jpeg(path, rgba, 8, 8, 3, true);
    f = slurp();
    for (size_t i = 2; i + 9 < f.bytes; i++)
        if (f.data[i] == 0xff && f.data[i + 1] == 0xc2)
            memcpy(f.data + i + 5, "\x3f\xff\x3f\xff", 4);      /* 16383 x 16383 */
    spill_out(f.data, f.bytes);
    struct spc_error err = {0};
    ck_assert_int_eq(read_all(&err), SPC_INPUT_FORMAT);
    ck_assert_ptr_nonnull(strstr(err.what, "progressive"));
    free(f.data);
    free(rgba);
}
END_TEST

/* ---- colours ------------------------------------------------------------------------------------ */

static const struct spb_placement plain_placement = {.scale = {1, 1}};
static const double LOWER[3][2] = {{0, 0}, {1, 0}, {1, 1}}, UPPER[3][2] = {{0, 0}, {1, 1}, {0, 1}};

static struct spb_textures *textures_of(uint8_t *rgba, size_t width, size_t height,
                                        const struct picture_kind *kind)
{
    struct spb_textures *t;
    uint32_t number;
    struct spc_error err = {0};
    picture_png(path, rgba, width, height, kind);
    ck_assert_int_eq(spb_textures_create(&temp, &t, &err), SPC_OK);
    ck_assert_msg(spb_textures_add(t, path, NULL, &number, &err) == SPC_OK, "%s", err.what);
    ck_assert_uint_eq(number, 0);
    free(rgba);
    return t;
}

static void paint(struct spb_textures *t, const struct spb_placement *place, const double uv[3][2],
                  uint8_t rgba[3][4])
{
    ck_assert_int_eq(spb_textures_paint(t, 0, place, uv, rgba, NULL), SPC_OK);
}

static void expect(const uint8_t rgba[4], int r, int g, int b, int tolerance)
{
    ck_assert_msg(abs(rgba[0] - r) <= tolerance && abs(rgba[1] - g) <= tolerance &&
                  abs(rgba[2] - b) <= tolerance && rgba[3] == 255, "colour %d %d %d, wanted %d %d %d",
                  rgba[0], rgba[1], rgba[2], r, g, b);
}

/* Yellow and blue above, red and green below, whatever the size. */
static size_t quarters_side;
static void quarters(size_t x, size_t y, uint8_t rgba[4])
{
    const bool right = x >= quarters_side / 2, low = y >= quarters_side / 2;
    rgba[0] = right ? 0 : 255;
    rgba[1] = right == low ? 255 : 0;
    rgba[2] = right && !low ? 255 : 0;
    rgba[3] = 255;
}

START_TEST(a_quad_has_the_colours_of_its_corners)
{
    for (quarters_side = 2; quarters_side <= 512; quarters_side *= 2) {
        struct spb_textures *const t = textures_of(make(quarters_side, quarters_side, quarters),
                                                   quarters_side, quarters_side, &picture_plain);
        uint8_t c[3][4];
        for (int whole = -3; whole <= 3; whole += 3) {  /* repeats, whatever whole is added */
            double lower[3][2], upper[3][2];
            for (int k = 0; k < 6; k++) {
                lower[k / 2][k % 2] = LOWER[k / 2][k % 2] + whole;
                upper[k / 2][k % 2] = UPPER[k / 2][k % 2] - 2 * whole;
            }
            paint(t, &plain_placement, (const double(*)[2])lower, c);
            expect(c[0], 255, 0, 0, 0);
            expect(c[1], 0, 255, 0, 0);
            expect(c[2], 0, 0, 255, 0);
            paint(t, &plain_placement, (const double(*)[2])upper, c);
            expect(c[0], 255, 0, 0, 0);
            expect(c[1], 0, 0, 255, 0);
            expect(c[2], 255, 255, 0, 0);
        }
        spb_textures_free(t);
    }
}
END_TEST

START_TEST(scale_offset_and_clamp_place_the_picture)
{
    quarters_side = 64;
    struct spb_textures *const t = textures_of(make(64, 64, quarters), 64, 64, &picture_plain);
    const double tiny[3][2] = {{0.1, 0.1}, {0.11, 0.1}, {0.1, 0.11}};
    const double far[3][2] = {{7.25, -3.4}, {7.26, -3.4}, {7.25, -3.41}};
    struct spb_placement place = plain_placement;
    uint8_t c[3][4];
    paint(t, &place, tiny, c);
    expect(c[0], 255, 0, 0, 0);
    place.offset[0] = 0.5;
    paint(t, &place, tiny, c);
    expect(c[0], 0, 255, 0, 0);
    place.scale[1] = 8;
    paint(t, &place, tiny, c);
    expect(c[0], 0, 0, 255, 0);
    place = plain_placement;
    paint(t, &place, far, c);
    expect(c[0], 255, 255, 0, 0);       /* 0.25, 0.6 */
    place.clamp = true;
    paint(t, &place, far, c);
    expect(c[0], 0, 255, 0, 0);         /* 1, 0 */
    spb_textures_free(t);
}
END_TEST

static void noise(size_t x, size_t y, uint8_t rgba[4])
{
    const uint32_t h = (uint32_t)(x * 2654435761u ^ y * 40503u) * 2246822519u;
    rgba[0] = h >> 31 ? 200 : 100;
    rgba[1] = h >> 30 & 1 ? 255 : 0;
    rgba[2] = (uint8_t)(x + y);
    rgba[3] = 255;
}

START_TEST(large_triangles_take_the_mean)
{
    struct spb_textures *const t = textures_of(make(1000, 700, noise), 1000, 700, &picture_plain);
    uint8_t c[3][4];
    paint(t, &plain_placement, LOWER, c);
    for (int k = 0; k < 3; k++) {
        ck_assert_int_le(abs(c[k][0] - 150), 4);
        ck_assert_int_le(abs(c[k][1] - 128), 8);
    }
    spb_textures_free(t);
}
END_TEST

/* Sizes that halve with a rest must not shift what repeats. */
START_TEST(pictures_of_odd_sizes_repeat_exactly)
{
    struct spb_textures *const t = textures_of(make(1001, 701, noise), 1001, 701, &picture_plain);
    for (int i = 0; i < 200; i++) {
        const double u = i % 16 / 16.0, v = i / 16 / 16.0, size = i % 3 ? 0.0625 : 0.5;
        const double near[3][2] = {{u, v}, {u + size, v}, {u, v + size}};
        const double far[3][2] = {{u + 5, v - 3}, {u + size + 5, v - 3}, {u + 5, v + size - 3}};
        uint8_t a[3][4], b[3][4];
        paint(t, &plain_placement, near, a);
        paint(t, &plain_placement, far, b);
        for (int k = 0; k < 3; k++)
            expect(a[k], b[k][0], b[k][1], b[k][2], 1);
    }
    spb_textures_free(t);
}
END_TEST

static void white_floor(size_t x, size_t y, uint8_t rgba[4])
{
    (void)x;
    memset(rgba, y == 32 ? 255 : 0, 3);
    rgba[3] = 255;
}

/* Of 33 rows the last is a row of its own in the next level; the box lies half on it and below. */
START_TEST(a_last_row_without_a_partner_counts_as_it_is)
{
    static const double below[3][2] = {{0, -9}, {1, -9}, {0, -8}};
    const struct spb_placement clamped = {.scale = {1, 1}, .clamp = true};
    struct spb_textures *const t = textures_of(make(33, 33, white_floor), 33, 33, &picture_plain);
    uint8_t c[3][4];
    paint(t, &clamped, below, c);
    for (int k = 0; k < 3; k++)
        expect(c[k], 171, 171, 171, 2);
    spb_textures_free(t);
}
END_TEST

/* Islands of an atlas: a triangle of white in black, sixteen pixels high. */
static void island(size_t x, size_t y, uint8_t rgba[4])
{
    const double u = ((double)x + 0.5) / 64, v = 1 - ((double)y + 0.5) / 64;
    const bool white = u > 0.25 && v > 0.25 && u + v < 0.75;
    memset(rgba, white ? 255 : 0, 3);
    rgba[3] = 255;
}

START_TEST(what_lies_beside_a_triangle_hardly_bleeds_in)
{
    static const double uv[3][2] = {{0.25, 0.25}, {0.5, 0.25}, {0.25, 0.5}};
    struct spb_textures *const t = textures_of(make(64, 64, island), 64, 64, &picture_plain);
    uint8_t c[3][4];
    paint(t, &plain_placement, uv, c);
    for (int k = 0; k < 3; k++)
        ck_assert_int_ge(c[k][0], 230);
    spb_textures_free(t);
}
END_TEST

static void dots(size_t x, size_t y, uint8_t rgba[4])
{
    const bool dot = x % 2 == 0 && y % 2 == 0;
    memset(rgba, dot ? 200 : 0, 3);
    rgba[3] = dot ? 255 : 0;
}

START_TEST(transparent_pixels_do_not_darken)
{
    const struct picture_kind kind = {PNG_COLOR_TYPE_RGB_ALPHA, 8, false};
    struct spb_textures *const t = textures_of(make(64, 64, dots), 64, 64, &kind);
    uint8_t c[3][4];
    paint(t, &plain_placement, LOWER, c);
    for (int k = 0; k < 3; k++)
        expect(c[k], 200, 200, 200, 0);
    spb_textures_free(t);
}
END_TEST

START_TEST(strange_coordinates_do_no_harm)
{
    static const double strange[][3][2] = {
        {{0, 0}, {0, 0}, {0, 0}}, {{1, 1}, {1, 1}, {1, 1}}, {{1e30, 0}, {0, 1e30}, {0, 0}},
        {{1e308, 1e308}, {-1e308, 0}, {0, 0}}, {{0, 0}, {1, 0}, {0.5, 0}}, {{1e-300, 0}, {0, 1e-300}, {0, 0}},
        {{-0.0, 1}, {1, -0.0}, {4e9, -4e9}},
    };
    struct spb_textures *const t = textures_of(make(33, 65, noise), 33, 65, &picture_plain);
    for (size_t i = 0; i < sizeof strange / sizeof *strange; i++) {
        struct spb_placement place = plain_placement;
        uint8_t c[3][4];
        paint(t, &place, strange[i], c);
        place.clamp = true;
        paint(t, &place, strange[i], c);
        place.scale[0] = HUGE_VAL;
        paint(t, &place, strange[i], c);
    }
    spb_textures_free(t);
}
END_TEST

/* More tiles than the cache holds, in one order and in another. */
START_TEST(colours_do_not_depend_on_what_was_asked_before)
{
    enum { SIDE = 1500, COUNT = 6000 };
    struct spb_textures *const t = textures_of(make(SIDE, SIDE, noise), SIDE, SIDE, &picture_plain);
    static uint8_t first[COUNT][3][4];
    for (int round = 0; round < 2; round++)
        for (uint32_t k = 0; k < COUNT; k++) {
            const uint32_t i = round ? k : k * 2711 % COUNT;
            const double u = i * 0.6180339887, v = i * 0.7548776662, size = 0.002 + i % 7 * 0.004;
            const double uv[3][2] = {{u, v}, {u + size, v}, {u, v + size}};
            uint8_t c[3][4];
            SCAN_CHECK(spb_textures_paint(t, 0, &plain_placement, uv, c, NULL) == SPC_OK);
            if (round == 0)
                memcpy(first[i], c, sizeof c);
            else
                SCAN_CHECK(memcmp(first[i], c, sizeof c) == 0);
        }
    /* Of a triangle much smaller than a pixel: that pixel, v upwards. */
    for (size_t i = 0; i < 2000; i++) {
        const size_t x = i * 811 % SIDE, y = i * 397 % SIDE;
        const double u = ((double)x + 0.5) / SIDE, v = 1 - ((double)y + 0.5) / SIDE;
        const double uv[3][2] = {{u, v}, {u + 1e-6, v}, {u, v + 1e-6}};
        uint8_t c[3][4], wanted[4];
        noise(x, y, wanted);
        SCAN_CHECK(spb_textures_paint(t, 0, &plain_placement, uv, c, NULL) == SPC_OK);
        SCAN_CHECK(memcmp(c[1], wanted, 4) == 0);
    }
    spb_textures_free(t);
}
END_TEST

int main(void)
{
    return SUITE("texture", begin, end,
                 png_of_every_kind_is_read_pixel_by_pixel,
                 jpeg_of_every_kind_is_read,
                 broken_pictures_are_refused_without_harm,
                 pictures_that_claim_to_be_huge_are_refused_at_once,
                 a_quad_has_the_colours_of_its_corners,
                 scale_offset_and_clamp_place_the_picture,
                 large_triangles_take_the_mean,
                 pictures_of_odd_sizes_repeat_exactly,
                 a_last_row_without_a_partner_counts_as_it_is,
                 what_lies_beside_a_triangle_hardly_bleeds_in,
                 transparent_pixels_do_not_darken,
                 strange_coordinates_do_no_harm,
                 colours_do_not_depend_on_what_was_asked_before);
}
