/* picture_case.h - draws an archive, by either back end, and compares with the reference picture. */
#ifndef PICTURE_CASE_H
#define PICTURE_CASE_H

#include "draw.h"
#include "ref_raster.h"

struct picture {
    int width, height;
    uint8_t *rgba;
    uint8_t *cover;                 /* alpha != 0 */
    struct spv_selection selection;
    struct spv_drawn drawn;
};

/* The back end of picture_draw: OSMesa, or the one without GL, on so many threads. */
enum picture_by { PICTURE_BY_GL, PICTURE_BY_SOFT };
void picture_use(enum picture_by by, unsigned threads);

/* That of PICTURE_BY_SOFT. */
struct spv_draw *picture_soft(void);

/* The renderer is made on first use; any failure fails the test. */
struct picture picture_draw(const struct spc_reader *reader, const struct spv_view *view,
                            const struct spv_draw_options *options);
void picture_release(struct picture *picture);

/* All triangles of the archive by the reference rasteriser, from the same camera. */
struct ref_image picture_reference(const struct spc_reader *reader, const struct spv_view *view,
                                   double fov_rad, const double eye[3], const double target[3],
                                   const double up[3]);

/* A view from eye to target with up, and its reference. */
struct picture_view {
    double eye[3], target[3], up[3], fov_rad;
    int width, height;
    double eps_px;
    enum spv_mode mode;
};
struct spv_view picture_view(const struct picture_view *v);

/* Draws both and compares. Writes the two as PNG when the environment names a folder in SPC_PICTURES. */
struct ref_compare picture_compare(const struct spc_reader *reader, const struct picture_view *v,
                                   const struct spv_draw_options *options, const char *name);

#endif
