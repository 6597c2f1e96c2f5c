#include "camera.h"

#include <math.h>

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* Scaled first, so that neither 1e-300 nor 1e300 leaves the range of double when squared. */
static bool normalize(double v[3])
{
    const double most = fmax(fabs(v[0]), fmax(fabs(v[1]), fabs(v[2])));
    if (!(most > 0) || !isfinite(most))
        return false;
    for (int a = 0; a < 3; a++)
        v[a] /= most;
    const double length = sqrt(dot(v, v));
    for (int a = 0; a < 3; a++)
        v[a] /= length;
    return true;
}

bool spv_camera_look(struct spv_camera *camera, const double eye[3], const double target[3],
                     const double up[3], double fov_rad, int width, int height)
{
    double vertical[3];
    camera->width = width;
    camera->height = height;
    camera->focal_px = height / (2 * tan(fov_rad / 2));
    for (int a = 0; a < 3; a++) {
        camera->eye[a] = eye[a];
        camera->forward[a] = target[a] - eye[a];
        vertical[a] = up[a];
    }
    if (!normalize(camera->forward) || !normalize(vertical))
        return false;
    cross(camera->forward, vertical, camera->right);
    if (sqrt(dot(camera->right, camera->right)) < 1e-9 || !normalize(camera->right))
        return false;
    cross(camera->right, camera->forward, camera->up);
    return true;
}

double spv_camera_framing(const struct spv_camera *c, const double half[3])
{
    const double margin = 1.02;
    const double tan_x = c->width / (2 * c->focal_px);
    const double tan_y = c->height / (2 * c->focal_px);
    double distance = 0;
    for (int corner = 0; corner < 8; corner++) {
        double p[3];
        for (int a = 0; a < 3; a++)
            p[a] = corner >> a & 1 ? half[a] : -half[a];
        const double toward = -dot(p, c->forward);
        distance = fmax(distance, toward + margin * fabs(dot(p, c->right)) / tan_x);
        distance = fmax(distance, toward + margin * fabs(dot(p, c->up)) / tan_y);
    }
    return distance > 0 ? distance : 1;
}

bool spv_camera_basis(const double up[3], double front[3], double side[3], double vertical[3])
{
    for (int a = 0; a < 3; a++)
        vertical[a] = up[a];
    if (!normalize(vertical))
        return false;
    const double reference[3] = {fabs(vertical[0]) < 0.9, fabs(vertical[0]) >= 0.9, 0};
    cross(reference, vertical, front);
    normalize(front);
    cross(vertical, front, side);
    return true;
}

void spv_camera_turn(const double front[3], const double side[3], const double vertical[3],
                     double azimuth_rad, double elevation_rad, double toward[3], double top[3])
{
    for (int a = 0; a < 3; a++) {
        toward[a] = cos(elevation_rad) *
                        (cos(azimuth_rad) * front[a] + sin(azimuth_rad) * side[a]) +
                    sin(elevation_rad) * vertical[a];
        top[a] = -sin(elevation_rad) *
                     (cos(azimuth_rad) * front[a] + sin(azimuth_rad) * side[a]) +
                 cos(elevation_rad) * vertical[a];
    }
}

bool spv_camera_orbit(struct spv_camera *camera, const double box_min[3], const double box_max[3],
                      double azimuth_rad, double elevation_rad, double distance,
                      const double up[3], double fov_rad, int width, int height)
{
    double vertical[3], side[3], front[3], toward[3], top[3], half[3];
    if (!spv_camera_basis(up, front, side, vertical))
        return false;
    spv_camera_turn(front, side, vertical, azimuth_rad, elevation_rad, toward, top);
    const double origin[3] = {0, 0, 0};     /* the axes first: they tell the distance */
    if (!spv_camera_look(camera, toward, origin, top, fov_rad, width, height))
        return false;
    for (int a = 0; a < 3; a++)
        half[a] = box_max[a] / 2 - box_min[a] / 2;
    if (!(distance > 0))
        distance = spv_camera_framing(camera, half);
    for (int a = 0; a < 3; a++)
        camera->eye[a] = box_min[a] / 2 + box_max[a] / 2 + distance * toward[a];
    return true;
}

double spv_camera_eps(const struct spv_camera *camera, double eps_px)
{
    const double x = camera->width / (2 * camera->focal_px);
    const double y = camera->height / (2 * camera->focal_px);
    const double eps = eps_px / (camera->focal_px * (1 + x * x + y * y));
    return fmin(fmax(eps, 0x1p-100), 0x1p20 * (1 - 0x1p-24));
}
