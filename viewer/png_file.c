#include "png_file.h"

#include "whole_file.h"

#include <errno.h>
#include <png.h>
#include <setjmp.h>

/* Everything between setjmp and longjmp, without locals that change in between. */
static bool encode(FILE *file, png_structp png, png_infop info, const uint8_t *rgba, int width,
                   int height, bool alpha)
{
    if (setjmp(png_jmpbuf(png)) != 0)
        return false;
    png_init_io(png, file);
    png_set_IHDR(png, info, (png_uint_32)width, (png_uint_32)height, 8,
                 alpha ? PNG_COLOR_TYPE_RGB_ALPHA : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_compression_level(png, 3);
    png_write_info(png, info);
    if (!alpha)
        png_set_filler(png, 0, PNG_FILLER_AFTER);
    for (int y = 0; y < height; y++)
        png_write_row(png, rgba + (size_t)y * (size_t)width * 4);
    png_write_end(png, info);
    return true;
}

static void on_error(png_structp png, png_const_charp text)
{
    (void)text;                     /* errno says more: libpng only fails to write here */
    longjmp(png_jmpbuf(png), 1);
}

enum spc_status spv_png_write(const char *path, const uint8_t *rgba, int width, int height,
                              bool alpha, struct spc_error *err)
{
    static const char what[] = "the picture";
    struct spv_whole_file file;
    enum spc_status status = spv_whole_begin(&file, path, what, err);
    if (status != SPC_OK)
        return status;
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, on_error, NULL);
    png_infop info = png ? png_create_info_struct(png) : NULL;
    errno = 0;
    if (info == NULL)
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to write a picture");
    else if (!encode(file.out, png, info, rgba, width, height, alpha))
        status = spc_fail_os(err, errno ? errno : EIO, "cannot write %s", what);
    png_destroy_write_struct(&png, &info);
    return spv_whole_end(&file, status, what, err);
}
