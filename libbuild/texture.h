/*
 * texture.h - pictures as pyramids on disk, and colours out of them.
 *
 * A picture is read once, row by row, and written as square tiles of itself and of its halves, down
 * to one pixel, to one temporary file for all. Colours come through a cache of tiles whose size is
 * fixed: what they are depends on no memory.
 */
#ifndef SPB_TEXTURE_H
#define SPB_TEXTURE_H

#include "progress.h"
#include "tmpfile.h"

struct spb_textures;

/* fails SPC_NO_MEMORY, SPC_IO */
enum spc_status spb_textures_create(struct spb_temp *temp, struct spb_textures **out,
                                    struct spc_error *err);
void spb_textures_free(struct spb_textures *textures);

/* Frees the cache until a colour is asked for. textures may be NULL. */
void spb_textures_pause(struct spb_textures *textures);

/*
 * Reads the picture at path; *number is what it is called by.
 * fails  SPC_INPUT_FORMAT (no picture that can be read: what says why, and nothing is lost by going
 *        on), SPC_IO, SPC_NO_MEMORY, SPC_CANCELLED
 */
enum spc_status spb_textures_add(struct spb_textures *textures, const char *path,
                                 const struct spb_progress *progress, uint32_t *number,
                                 struct spc_error *err);

struct spb_placement {              /* how a material lays a picture: u * scale + offset */
    double scale[2], offset[2];
    bool clamp;                     /* its edge goes on; else it repeats */
};

/*
 * Colours for the corners of a triangle, whose uv are finite, u to the right and v upwards: means
 * over boxes that fit into it, each nearer to its corner than to the others.
 * fails  SPC_IO, SPC_NO_MEMORY
 */
enum spc_status spb_textures_paint(struct spb_textures *textures, uint32_t number,
                                   const struct spb_placement *placement, const double uv[3][2],
                                   uint8_t rgba[3][4], struct spc_error *err);

#endif
