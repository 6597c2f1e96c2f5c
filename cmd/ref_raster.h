/*
 * ref_raster.h - the reference picture: every triangle, nothing clever.
 *
 * Judges the renderer, in tests and for spc-bench, so it shares no code with it: no selection, no splats, no
 * hierarchy, double precision throughout, one sample at each pixel centre.
 */
#ifndef REF_RASTER_H
#define REF_RASTER_H

#include <stddef.h>
#include <stdint.h>

struct ref_camera {
    double eye[3], target[3], up[3];    /* looks from eye to target; up need not be perpendicular */
    double fov_y_deg;                   /* vertical field of view, whole picture height */
    int width, height;                  /* pixels; row 0 is the top row */
};

struct ref_triangle {
    double corner[3][3];
    uint8_t rgba[3][4];                 /* colour of each corner */
};

struct ref_image {
    int width, height;
    double *depth;                      /* [height * width] distance along the view axis; INFINITY: empty */
    uint32_t *triangle;                 /* [height * width] number of the nearest triangle, UINT32_MAX: empty */
    uint8_t *rgb;                       /* [height * width * 3] shaded, background 0 */
};

/*
 * Renders n triangles, both sides seen. A pixel is covered when the ray through its centre hits a
 * triangle in front of the eye; edges count as hit (covering a shared edge twice is harmless, missing it is not).
 * Shade: light = |n . v|, n the unit normal of the triangle, v the unit direction from the hit
 * point to the eye; rgb = colour interpolated perspective-correctly, times (ambient + (1 - ambient) * light), rounded.
 * Triangles that pass through the plane of the eye are clipped there, not dropped.
 * Returns 0, or -1 when memory runs out. Free with ref_image_release.
 */
int ref_raster(const struct ref_triangle *triangles, size_t n, const struct ref_camera *camera,
               double ambient, struct ref_image *out);
void ref_image_release(struct ref_image *image);

/*
 * The same for triangles that come in pieces. Rows do not depend on each other: several threads may add the same
 * piece to one raster, each to rows of its own; the picture is the same however rows are shared out, as long as
 * every row is given all pieces in one order.
 */
struct ref_raster;

/* camera is one that defines a view. NULL without memory. */
struct ref_raster *ref_raster_begin(const struct ref_camera *camera, double ambient);

/*
 * Adds triangles[n], numbered from first on (those from UINT32_MAX - 1 on share that number), to rows row_first to
 * row_end - 1.
 */
void ref_raster_add(struct ref_raster *raster, const struct ref_triangle *triangles, size_t n, uint64_t first,
                    int row_first, int row_end);

/* Hands the picture over, the caller's from then on, and frees the raster; out NULL: frees both. raster may be NULL */
void ref_raster_end(struct ref_raster *raster, struct ref_image *out);

/* Bytes that a raster of so many pixels takes. */
uint64_t ref_raster_bytes(int width, int height);

/*
 * Comparison of covered pixels, reference against a picture's coverage (cover[y * width + x] != 0).
 * overlap: covered in both / covered in either (1 when both are empty).
 * overlap_tolerant: a pixel covered in one picture counts as matched when the other picture covers any
 *   pixel of its 3 x 3 neighbourhood: matched / covered in either.
 * holes: pixels covered in the reference together with their whole 3 x 3 neighbourhood (which lies
 *   inside the picture), and empty in the other.
 * extra_px_max: largest Chebyshev distance in pixels from a pixel covered in the other picture but
 *   not in the reference to the nearest covered reference pixel (0 when there is none).
 */
struct ref_compare {
    double overlap, overlap_tolerant;
    uint64_t holes;
    int extra_px_max;
    int hole_x, hole_y;                 /* the first hole, or -1 */
};
void ref_compare_cover(const struct ref_image *reference, const uint8_t *cover,
                       struct ref_compare *out);

#endif
