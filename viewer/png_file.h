/* png_file.h - a picture into a PNG file. */
#ifndef SPV_PNG_FILE_H
#define SPV_PNG_FILE_H

#include "spc.h"

/*
 * Writes rgba[height][width][4] to path, replacing it once it is whole; on failure what was there stays.
 * in     alpha  false: written as RGB
 * fails  SPC_IO, SPC_NO_MEMORY
 */
enum spc_status spv_png_write(const char *path, const uint8_t *rgba, int width, int height,
                              bool alpha, struct spc_error *err);

#endif
