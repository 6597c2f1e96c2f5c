/*
 * camera.h - where the eye is and how pixels map to rays.
 *
 * View coordinates: x to the right, y up, z forward, from the eye. Pixel (0, 0) is the top left
 * corner of the picture; centres lie at halves.
 */
#ifndef SPV_CAMERA_H
#define SPV_CAMERA_H

#include "spc.h"

struct spv_camera {
    double eye[3];                  /* file units */
    double right[3], up[3], forward[3];         /* orthonormal */
    int width, height;              /* px */
    double focal_px;                /* height / (2 tan(fov / 2)) */
};

/*
 * Looks from eye to target. up need not be perpendicular, only not parallel to the view.
 *
 * in     fov_rad  vertical, 0 < fov_rad < pi; eye and target differ
 * out    (return) false when the vectors do not define a view
 */
bool spv_camera_look(struct spv_camera *camera, const double eye[3], const double target[3],
                     const double up[3], double fov_rad, int width, int height);

/*
 * Looks at the middle of the box from azimuth and elevation, up being the vertical axis: azimuth 0
 * is the front, positive turns to the right of the model's front, elevation 90 looks down. The
 * distance is from the middle of the box; <= 0: as near as the whole box stays in the picture.
 */
bool spv_camera_orbit(struct spv_camera *camera, const double box_min[3], const double box_max[3],
                      double azimuth_rad, double elevation_rad, double distance,
                      const double up[3], double fov_rad, int width, int height);

/*
 * The axes that azimuth and elevation are measured by, orthonormal: the front is +z for y up, -y for
 * z up, and what follows for other axes; side is the model's right, seen from the front.
 *
 * out    (return) false when up is no direction
 */
bool spv_camera_basis(const double up[3], double front[3], double side[3], double vertical[3]);

/*
 * Where the eye is, seen from what it looks at, and where its picture's top is: of length 1 and
 * perpendicular. top turns with the elevation, so that looking straight down is a view like any other.
 */
void spv_camera_turn(const double front[3], const double side[3], const double vertical[3],
                     double azimuth_rad, double elevation_rad, double toward[3], double top[3]);

/*
 * Distance from the middle of a box at which all of it lies in the picture, with a margin. The
 * camera's place does not matter. half: of the box's sides; of a point, that any distance frames, 1.
 */
double spv_camera_framing(const struct spv_camera *camera, const double half[3]);

/*
 * Accepted error as an angle: a length e at distance r is at most
 * e / r focal sec^2(corner) pixels on screen, so eps pixels hold in the whole picture.
 *
 * in     eps_px > 0;  out  (return) 0 < eps < 2^20, else the nearest of these (I1)
 */
double spv_camera_eps(const struct spv_camera *camera, double eps_px);

#endif
