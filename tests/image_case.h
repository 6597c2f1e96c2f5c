/* image_case.h - for tests of textures: writes PNG and JPEG of any kind. */
#ifndef IMAGE_CASE_H
#define IMAGE_CASE_H

#include "scan_case.h"

#include <jpeglib.h>
#include <png.h>

struct picture_kind {
    int png_type;                       /* PNG_COLOR_TYPE_*; palette: of the first 256 colours met */
    int depth;
    bool interlaced;
};

static const struct picture_kind picture_plain = {PNG_COLOR_TYPE_RGB, 8, false};

/* What is left of a colour in a kind of picture that holds less. */
static inline void picture_reduce(const struct picture_kind *kind, const uint8_t in[4], uint8_t out[4])
{
    memcpy(out, in, 4);
    if (!(kind->png_type & PNG_COLOR_MASK_COLOR)) {
        const unsigned most = (1u << (kind->depth < 8 ? kind->depth : 8)) - 1;
        out[0] = out[1] = out[2] = (uint8_t)(in[0] * most / 255 * 255 / most);
    }
    if (!(kind->png_type & PNG_COLOR_MASK_ALPHA))
        out[3] = 255;
}

static inline unsigned palette_index(png_color *palette, int *count, const uint8_t rgba[4])
{
    for (int i = 0; i < *count; i++)
        if (palette[i].red == rgba[0] && palette[i].green == rgba[1] && palette[i].blue == rgba[2])
            return (unsigned)i;
    SCAN_CHECK(*count < 256);
    palette[*count] = (png_color){rgba[0], rgba[1], rgba[2]};
    return (unsigned)(*count)++;
}

/* One row as libpng wants it. */
static inline void picture_row(const struct picture_kind *kind, png_color *palette, int *colors,
                               const uint8_t *rgba, size_t width, uint8_t *out)
{
    memset(out, 0, width * 8);
    size_t bit = 0;
    for (size_t x = 0; x < width; x++, rgba += 4) {
        unsigned sample[4];
        int n = 0;
        if (kind->png_type == PNG_COLOR_TYPE_PALETTE) {
            sample[n++] = palette_index(palette, colors, rgba);
        } else if (kind->png_type & PNG_COLOR_MASK_COLOR) {
            for (; n < 3; n++)
                sample[n] = rgba[n];
        } else {
            sample[n++] = kind->depth < 8 ? rgba[0] * ((1u << kind->depth) - 1) / 255 : rgba[0];
        }
        if (kind->png_type & PNG_COLOR_MASK_ALPHA)
            sample[n++] = rgba[3];
        for (int i = 0; i < n; i++) {
            if (kind->depth == 16)
                out[bit / 8] = out[bit / 8 + 1] = (uint8_t)sample[i];
            else
                out[bit / 8] |= (uint8_t)(sample[i] << (8 - (size_t)kind->depth - bit % 8));
            bit += (size_t)kind->depth;
        }
    }
}

static inline void picture_png(const char *path, const uint8_t *rgba, size_t width, size_t height,
                               const struct picture_kind *kind)
{
    FILE *const file = fopen(path, "wb");
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png_create_info_struct(png);
    png_color palette[256] = {{0, 0, 0}};
    uint8_t *const rows = malloc(height * width * 8);
    uint8_t **const row = malloc(height * sizeof *row);
    int colors = 0;
    SCAN_CHECK(file && png && info && rows && row);
    for (size_t y = 0; y < height; y++) {
        row[y] = rows + y * width * 8;
        picture_row(kind, palette, &colors, rgba + y * width * 4, width, row[y]);
    }
    png_init_io(png, file);
    png_set_compression_level(png, 1);
    png_set_IHDR(png, info, (png_uint_32)width, (png_uint_32)height, kind->depth, kind->png_type,
                 kind->interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    if (kind->png_type == PNG_COLOR_TYPE_PALETTE)
        png_set_PLTE(png, info, palette, colors);
    png_write_info(png, info);
    png_write_image(png, row);
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    fclose(file);
    free(row);
    free(rows);
}

/* components: 1 grey, 3 colours, 4 CMYK as Adobe writes it. Quality 100. */
static inline void picture_jpeg(const char *path, const uint8_t *rgba, size_t width, size_t height,
                                int components, bool progressive)
{
    FILE *const file = fopen(path, "wb");
    struct jpeg_compress_struct jpeg;
    struct jpeg_error_mgr error;
    uint8_t *line = malloc(width * 4);
    SCAN_CHECK(file && line);
    jpeg.err = jpeg_std_error(&error);
    jpeg_create_compress(&jpeg);
    jpeg_stdio_dest(&jpeg, file);
    jpeg.image_width = (JDIMENSION)width;
    jpeg.image_height = (JDIMENSION)height;
    jpeg.input_components = components;
    jpeg.in_color_space = components == 1 ? JCS_GRAYSCALE : components == 3 ? JCS_RGB : JCS_CMYK;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, 100, TRUE);
    if (components == 4)
        jpeg_set_colorspace(&jpeg, JCS_YCCK);           /* with Adobe's marker */
    if (progressive)
        jpeg_simple_progression(&jpeg);
    jpeg_start_compress(&jpeg, TRUE);
    for (size_t y = 0; y < height; y++) {
        for (size_t x = 0; x < width; x++)
            for (int k = 0; k < components; k++)
                line[x * (size_t)components + (size_t)k] = k == 3 ? 255 : rgba[(y * width + x) * 4 + (size_t)k];
        jpeg_write_scanlines(&jpeg, &line, 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    fclose(file);
    free(line);
}

#endif
