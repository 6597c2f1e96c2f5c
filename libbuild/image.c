/*
 * Both libraries report errors by a jump, back to where the row or the header was asked for; what
 * they hold then is released with the image. They read through a bytesource, which refuses pipes.
 *
 * What opens as a picture but does not read as one to its end fails as SPC_INPUT_FORMAT: for who
 * asks that is no reason to stop. Temporary files and memory that fail are.
 */
#include "image.h"

#include "bytesource.h"

#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <jpeglib.h>
#include <jerror.h>
#include <png.h>

struct spb_image {
    struct spb_bytes bytes;
    uint32_t width, height, row;        /* row: the next */
    enum spc_status status;             /* what made a library jump; with err */
    struct spc_error *err;
    jmp_buf jump;

    png_structp png;
    png_infop png_info;
    struct spb_tmpfile *passes;         /* rows of an interlaced PNG; NULL: not interlaced */
    uint64_t pass_off;                  /* of the last pass */

    bool is_jpeg, cmyk, inverted;
    struct jpeg_decompress_struct jpeg;
    struct jpeg_error_mgr jpeg_error;
    struct jpeg_source_mgr jpeg_source;
    struct jpeg_progress_mgr jpeg_progress;
    uint8_t *out;                       /* where the row under way goes */
    uint8_t *line;                      /* [width][4] as the JPEG library gives it */
};

static enum spc_status no_memory(struct spc_error *err)
{
    return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to read a picture");
}

static enum spc_status broken(struct spb_image *image, const char *why)
{
    return image->status = spc_fail(image->err, SPC_INPUT_FORMAT, SPC_NO_OFF, "%s", why);
}

/* Brings bytes into the window. That they cannot be read is the picture's own failure. */
static enum spc_status see(struct spb_image *image, size_t bytes)
{
    const enum spc_status status = spb_bytes_need(&image->bytes, bytes, NULL);
    if (status == SPC_NO_MEMORY)
        return image->status = no_memory(image->err);
    return status == SPC_OK ? SPC_OK : broken(image, "cannot be read");
}

static bool fill(struct spb_image *image)
{
    return see(image, 1) == SPC_OK;
}

static enum spc_status check_size(struct spb_image *image)
{
    if (image->width == 0 || image->height == 0)
        return broken(image, "has no pixels");
    if (image->width > SPB_IMAGE_SIDE_MAX || image->height > SPB_IMAGE_SIDE_MAX ||
        (uint64_t)image->width * image->height > SPB_IMAGE_PIXELS_MAX)
        return broken(image, "has more than 2^16 pixels a side or 2^30 in all");
    return SPC_OK;
}

/* ---- PNG -------------------------------------------------------------------------------------- */

static void png_fails(png_structp png, png_const_charp text)
{
    struct spb_image *const image = png_get_error_ptr(png);
    if (image->status == SPC_OK && strstr(text, "emory"))       /* the library has no codes */
        image->status = no_memory(image->err);
    else if (image->status == SPC_OK)
        broken(image, "is a broken PNG");
    longjmp(image->jump, 1);
}

static void png_warns(png_structp png, png_const_charp text)
{
    (void)png, (void)text;
}

static void png_reads(png_structp png, png_bytep out, size_t count)
{
    struct spb_image *const image = png_get_io_ptr(png);
    struct spb_bytes *const b = &image->bytes;
    while (count > 0) {
        if (!fill(image) || spb_bytes_have(b) == 0)
            png_error(png, "ends");
        const size_t n = spb_bytes_have(b) < count ? spb_bytes_have(b) : count;
        memcpy(out, b->buf + b->pos, n);
        spb_bytes_skip(b, n);
        out += n;
        count -= n;
    }
}

/* The passes of an interlaced PNG: each completes the rows of the one before. */
static enum spc_status read_passes(struct spb_image *image, struct spb_temp *temp, int count)
{
    const size_t row_bytes = (size_t)image->width * 4;
    enum spc_status status = spb_tmpfile_create(temp, &image->passes, image->err);

    image->line = calloc(1, row_bytes);
    if (status == SPC_OK && !image->line)
        status = no_memory(image->err);
    for (int pass = 0; pass < count && status == SPC_OK; pass++) {
        const uint64_t before = image->pass_off;
        for (uint32_t y = 0; y < image->height && status == SPC_OK; y++) {
            uint64_t off;
            if (pass > 0)
                status = spb_tmpfile_read(image->passes, before + y * row_bytes, image->line,
                                          row_bytes, image->err);
            if (status == SPC_OK) {
                png_read_row(image->png, image->line, NULL);
                status = spb_tmpfile_append(image->passes, image->line, row_bytes, &off, image->err);
            }
            if (y == 0)
                image->pass_off = off;
        }
        if (pass > 0)
            spb_tmpfile_discard(image->passes, before, row_bytes * image->height);
    }
    return status;
}

/* Jumps to image->jump when the file is broken. */
static enum spc_status png_header(struct spb_image *image, struct spb_temp *temp)
{
    png_set_read_fn(image->png, image, png_reads);
    png_set_user_limits(image->png, 0x7fffffff, 0x7fffffff);    /* check_size says it better */
    png_set_chunk_malloc_max(image->png, 4 << 20);
    png_read_info(image->png, image->png_info);
    image->width = png_get_image_width(image->png, image->png_info);
    image->height = png_get_image_height(image->png, image->png_info);
    enum spc_status status = check_size(image);
    if (status != SPC_OK)
        return status;
    png_set_expand(image->png);         /* palettes, small greys, transparent colours */
    png_set_scale_16(image->png);
    png_set_gray_to_rgb(image->png);
    png_set_add_alpha(image->png, 255, PNG_FILLER_AFTER);
    const int passes = png_set_interlace_handling(image->png);
    png_read_update_info(image->png, image->png_info);
    if (png_get_rowbytes(image->png, image->png_info) != (size_t)image->width * 4)
        return broken(image, "is a PNG of an unknown kind");
    return passes > 1 ? read_passes(image, temp, passes) : SPC_OK;
}

static enum spc_status open_png(struct spb_image *image, struct spb_temp *temp)
{
    image->png = png_create_read_struct(PNG_LIBPNG_VER_STRING, image, png_fails, png_warns);
    if (image->png)
        image->png_info = png_create_info_struct(image->png);
    if (!image->png_info)
        return no_memory(image->err);
    if (setjmp(image->jump))
        return image->status;
    return png_header(image, temp);
}

/* ---- JPEG ------------------------------------------------------------------------------------- */

static void jpeg_fails(j_common_ptr jpeg)
{
    struct spb_image *const image = jpeg->client_data;
    if (image->status == SPC_OK && image->jpeg_error.msg_code == JERR_OUT_OF_MEMORY)
        image->status = no_memory(image->err);
    else if (image->status == SPC_OK)
        broken(image, "is a broken JPEG, or of a kind that cannot be read");
    longjmp(image->jump, 1);
}

static void jpeg_warns(j_common_ptr jpeg, int level)
{
    (void)jpeg, (void)level;
}

static void jpeg_nothing(j_decompress_ptr jpeg)
{
    (void)jpeg;
}

/* The library takes all bytes it was shown before it asks for more. */
static boolean jpeg_fills(j_decompress_ptr jpeg)
{
    struct spb_image *const image = jpeg->client_data;
    struct spb_bytes *const b = &image->bytes;
    b->pos = b->end;
    if (!fill(image) || spb_bytes_have(b) == 0)
        jpeg_fails((j_common_ptr)jpeg);
    image->jpeg_source.next_input_byte = b->buf + b->pos;
    image->jpeg_source.bytes_in_buffer = spb_bytes_have(b);
    return TRUE;
}

static void jpeg_skips(j_decompress_ptr jpeg, long count)
{
    struct jpeg_source_mgr *const source = jpeg->src;
    while (count > (long)source->bytes_in_buffer) {
        count -= (long)source->bytes_in_buffer;
        jpeg_fills(jpeg);
    }
    if (count > 0) {
        source->next_input_byte += count;
        source->bytes_in_buffer -= (size_t)count;
    }
}

static void jpeg_progresses(j_common_ptr jpeg)
{
    struct spb_image *const image = jpeg->client_data;
    if (image->jpeg.input_scan_number > SPB_IMAGE_SCANS_MAX)
        jpeg_fails(jpeg);
}

static uint64_t coefficient_bytes(const struct jpeg_decompress_struct *jpeg)
{
    uint64_t blocks = 0;
    for (int i = 0; i < jpeg->num_components; i++)
        blocks += (uint64_t)jpeg->comp_info[i].width_in_blocks * jpeg->comp_info[i].height_in_blocks;
    return blocks * DCTSIZE2 * sizeof(JCOEF);
}

static enum spc_status jpeg_header(struct spb_image *image)
{
    struct jpeg_decompress_struct *const jpeg = &image->jpeg;
    jpeg_create_decompress(jpeg);
    jpeg->client_data = image;
    jpeg->src = &image->jpeg_source;
    jpeg->progress = &image->jpeg_progress;
    jpeg_read_header(jpeg, TRUE);
    image->width = jpeg->image_width;
    image->height = jpeg->image_height;
    const enum spc_status status = check_size(image);
    if (status != SPC_OK)
        return status;
    if (jpeg_has_multiple_scans(jpeg) && coefficient_bytes(jpeg) > SPB_IMAGE_PROGRESSIVE_MAX)
        return broken(image, "is a progressive JPEG and too large for one: store it as baseline");
    image->cmyk = jpeg->jpeg_color_space == JCS_CMYK || jpeg->jpeg_color_space == JCS_YCCK;
    image->inverted = jpeg->saw_Adobe_marker;
    jpeg->out_color_space = image->cmyk ? JCS_CMYK : JCS_RGB;
    jpeg->dct_method = JDCT_ISLOW;      /* the same values on every machine */
    image->line = malloc((size_t)image->width * 4);
    if (!image->line)
        return no_memory(image->err);
    jpeg_start_decompress(jpeg);
    return SPC_OK;
}

static enum spc_status open_jpeg(struct spb_image *image)
{
    image->is_jpeg = true;
    image->jpeg.err = jpeg_std_error(&image->jpeg_error);
    image->jpeg.client_data = image;
    image->jpeg_error.error_exit = jpeg_fails;
    image->jpeg_error.emit_message = jpeg_warns;
    image->jpeg_source.init_source = jpeg_nothing;
    image->jpeg_source.term_source = jpeg_nothing;
    image->jpeg_source.fill_input_buffer = jpeg_fills;
    image->jpeg_source.skip_input_data = jpeg_skips;
    image->jpeg_source.resync_to_restart = jpeg_resync_to_restart;
    image->jpeg_source.next_input_byte = image->bytes.buf + image->bytes.pos;
    image->jpeg_source.bytes_in_buffer = spb_bytes_have(&image->bytes);
    image->jpeg_progress.progress_monitor = jpeg_progresses;
    if (setjmp(image->jump))
        return image->status;
    return jpeg_header(image);
}

static void jpeg_to_rgba(const struct spb_image *image, uint8_t *rgba)
{
    for (uint32_t x = 0; x < image->width; x++, rgba += 4) {
        const uint8_t *const in = image->line + (size_t)x * (image->cmyk ? 4 : 3);
        for (int k = 0; k < 3; k++) {
            rgba[k] = in[k];
            if (image->cmyk) {          /* Adobe stores how much light is left, others ink */
                const unsigned light = image->inverted ? in[k] : 255u - in[k];
                const unsigned black = image->inverted ? in[3] : 255u - in[3];
                rgba[k] = (uint8_t)((light * black + 127) / 255);
            }
        }
        rgba[3] = 255;
    }
}

/* ---- either ----------------------------------------------------------------------------------- */

/* The caller's pointers would not survive a jump: they are in the image. */
static enum spc_status read_row(struct spb_image *image)
{
    if (setjmp(image->jump))
        return image->status;
    image->row++;
    if (image->is_jpeg) {
        jpeg_read_scanlines(&image->jpeg, &image->line, 1);
        jpeg_to_rgba(image, image->out);
    } else {
        png_read_row(image->png, image->out, NULL);
    }
    return SPC_OK;
}

enum spc_status spb_image_row(struct spb_image *image, uint8_t *rgba, struct spc_error *err)
{
    const size_t row_bytes = (size_t)image->width * 4;

    image->err = err;
    image->status = SPC_OK;
    if (image->passes)
        return spb_tmpfile_read(image->passes, image->pass_off + image->row++ * row_bytes, rgba,
                                row_bytes, err);
    image->out = rgba;
    return read_row(image);
}

enum spc_status spb_image_open(const char *path, struct spb_temp *temp, struct spb_image **out,
                               struct spc_error *err)
{
    struct spb_image *image = calloc(1, sizeof *image);
    enum spc_status status;

    *out = NULL;
    if (!image)
        return no_memory(err);
    image->err = err;
    status = spb_bytes_open(&image->bytes, path, NULL, NULL, err);
    if (status == SPC_NO_MEMORY)
        goto out;
    if (status != SPC_OK) {
        status = broken(image, "was not found");
        goto out;
    }
    status = see(image, 8);
    if (status != SPC_OK)
        goto out;
    if (spb_bytes_have(&image->bytes) >= 8 && png_sig_cmp(image->bytes.buf, 0, 8) == 0)
        status = open_png(image, temp);
    else if (spb_bytes_have(&image->bytes) >= 3 && memcmp(image->bytes.buf, "\xff\xd8\xff", 3) == 0)
        status = open_jpeg(image);
    else
        status = broken(image, "is neither PNG nor JPEG");
    if (status == SPC_OK) {
        *out = image;
        image = NULL;
    }
out:
    spb_image_close(image);
    return status;
}

void spb_image_close(struct spb_image *image)
{
    if (!image)
        return;
    if (image->png)
        png_destroy_read_struct(&image->png, &image->png_info, NULL);
    if (image->is_jpeg && !setjmp(image->jump))
        jpeg_destroy_decompress(&image->jpeg);
    spb_tmpfile_free(image->passes);
    spb_bytes_close(&image->bytes);
    free(image->line);
    free(image);
}

uint32_t spb_image_width(const struct spb_image *image)
{
    return image->width;
}

uint32_t spb_image_height(const struct spb_image *image)
{
    return image->height;
}
