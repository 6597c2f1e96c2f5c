#include "png_file.h"

#include <errno.h>
#include <png.h>
#include <setjmp.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

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

/* A half-written picture must not pass for one; devices and pipes are not ours to remove. */
static bool is_plain(FILE *file)
{
    struct stat st;
    return fstat(fileno(file), &st) == 0 && S_ISREG(st.st_mode);
}

enum spc_status spv_png_write(const char *path, const uint8_t *rgba, int width, int height,
                              bool alpha, struct spc_error *err)
{
    FILE *file = fopen(path, "wb");
    if (file == NULL)
        return spc_fail_os(err, errno, "cannot create the picture");
    enum spc_status status = SPC_OK;
    const bool plain = is_plain(file);
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, on_error, NULL);
    png_infop info = png ? png_create_info_struct(png) : NULL;
    errno = 0;
    if (info == NULL)
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to write a picture");
    else if (!encode(file, png, info, rgba, width, height, alpha))
        status = spc_fail_os(err, errno ? errno : EIO, "cannot write the picture");
    png_destroy_write_struct(&png, &info);
    if (fclose(file) != 0 && status == SPC_OK)
        status = spc_fail_os(err, errno, "cannot write the picture");
    if (status != SPC_OK && plain)
        unlink(path);
    return status;
}
