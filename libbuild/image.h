/*
 * image.h - pictures row by row: PNG and JPEG of any kind, as eight bits of red, green, blue, alpha.
 *
 * Memory is that of some rows, whatever the picture says of itself. Only an interlaced PNG goes
 * through a temporary file, and a progressive JPEG is held as coefficients: larger ones than
 * SPB_IMAGE_PROGRESSIVE_MAX bytes of those are refused.
 */
#ifndef SPB_IMAGE_H
#define SPB_IMAGE_H

#include "tmpfile.h"

enum {
    SPB_IMAGE_SIDE_MAX = 1 << 16,               /* pixels */
    SPB_IMAGE_PIXELS_MAX = 1 << 30,
    SPB_IMAGE_PROGRESSIVE_MAX = 50 << 20,       /* 4096 x 4096 with colours at half the resolution */
    SPB_IMAGE_SCANS_MAX = 200                   /* each goes over the whole picture */
};

struct spb_image;

/*
 * Opens a picture and reads its header.
 * fails  SPC_INPUT_FORMAT (what says why: not found, no picture, broken, too large), SPC_NO_MEMORY;
 *        SPC_IO when the temporary file fails
 */
enum spc_status spb_image_open(const char *path, struct spb_temp *temp, struct spb_image **out,
                               struct spc_error *err);
void spb_image_close(struct spb_image *image);

uint32_t spb_image_width(const struct spb_image *image);
uint32_t spb_image_height(const struct spb_image *image);

/* The next row, from the top, as rgba[width][4]. fails as spb_image_open */
enum spc_status spb_image_row(struct spb_image *image, uint8_t *rgba, struct spc_error *err);

#endif
