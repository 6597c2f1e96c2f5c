#include "ref_raster.h"

#include <check.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/*
 * The reference judges the renderer, so nothing judges the reference but these cases: each compares it with
 * a closed formula, or with rays cut with triangles by another method (Moeller and Trumbore).
 */

static const double pi = 3.14159265358979323846;

/* Looks along -z from the origin with +y up, so that a point (x, y, -z) is seen at offsets (x / z, y / z). */
static struct ref_camera plain_camera(int width, int height, double fov_y_deg)
{
    return (struct ref_camera){.eye = {0, 0, 0}, .target = {0, 0, -1}, .up = {0, 1, 0},
                               .fov_y_deg = fov_y_deg, .width = width, .height = height};
}

/* Nothing round: every axis and rounding takes part. */
static struct ref_camera tilted_camera(int width, int height)
{
    return (struct ref_camera){.eye = {3.1, -2.3, 1.7}, .target = {0.2, 0.4, -0.3}, .up = {0.3, 0.2, 1.1},
                               .fov_y_deg = 47.0, .width = width, .height = height};
}

static void normalise(double a[3])
{
    double len = sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    for (int i = 0; i < 3; i++)
        a[i] /= len;
}

static double dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross3(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

/* Point at picture position (px, py), pixel centres at .5, at a depth along the view axis. */
static void unproject(const struct ref_camera *camera, double px, double py, double depth, double out[3])
{
    double forward[3], right[3], up[3];
    for (int i = 0; i < 3; i++)
        forward[i] = camera->target[i] - camera->eye[i];
    normalise(forward);
    cross3(forward, camera->up, right);
    normalise(right);
    cross3(right, forward, up);
    double half = tan(camera->fov_y_deg / 2.0 * pi / 180.0);
    double aspect = (double)camera->width / (double)camera->height;
    double across = (2.0 * px / (double)camera->width - 1.0) * half * aspect;
    double above = (1.0 - 2.0 * py / (double)camera->height) * half;
    for (int i = 0; i < 3; i++)
        out[i] = camera->eye[i] + depth * (forward[i] + across * right[i] + above * up[i]);
}

static void set_corner(struct ref_triangle *t, int i, double x, double y, double z)
{
    t->corner[i][0] = x;
    t->corner[i][1] = y;
    t->corner[i][2] = z;
}

static void paint(struct ref_triangle *t, uint8_t red, uint8_t green, uint8_t blue)
{
    for (int i = 0; i < 3; i++) {
        t->rgba[i][0] = red;
        t->rgba[i][1] = green;
        t->rgba[i][2] = blue;
        t->rgba[i][3] = 255;
    }
}

/* Two triangles a b c and a c d. */
static void quad(struct ref_triangle t[2], const double a[3], const double b[3], const double c[3],
                 const double d[3])
{
    const double *corner[2][3] = {{a, b, c}, {a, c, d}};
    memset(t, 0, 2 * sizeof *t);
    for (int k = 0; k < 2; k++) {
        for (int i = 0; i < 3; i++)
            memcpy(t[k].corner[i], corner[k][i], sizeof t[k].corner[i]);
        paint(&t[k], 255, 255, 255);
    }
}

/* The rectangle of picture positions [x0, x1] x [y0, y1] at one depth, parallel to the picture. */
static void picture_quad(struct ref_triangle t[2], const struct ref_camera *camera, double x0, double y0,
                         double x1, double y1, double depth)
{
    double corner[4][3];
    unproject(camera, x0, y0, depth, corner[0]);
    unproject(camera, x1, y0, depth, corner[1]);
    unproject(camera, x1, y1, depth, corner[2]);
    unproject(camera, x0, y1, depth, corner[3]);
    quad(t, corner[0], corner[1], corner[2], corner[3]);
}

static struct ref_image draw(const struct ref_triangle *t, size_t n, const struct ref_camera *camera,
                             double ambient)
{
    struct ref_image image;
    ck_assert_int_eq(ref_raster(t, n, camera, ambient, &image), 0);
    ck_assert_int_eq(image.width, camera->width);
    ck_assert_int_eq(image.height, camera->height);
    return image;
}

static size_t at(const struct ref_image *image, int x, int y)
{
    return (size_t)y * (size_t)image->width + (size_t)x;
}

static bool is_covered(const struct ref_image *image, int x, int y)
{
    return image->triangle[at(image, x, y)] != UINT32_MAX;
}

/* For checks per pixel: ck_assert writes a message for each success too, which took most of the time. */
static void expect(bool right, const char *what, int x, int y)
{
    if (!right)
        ck_abort_msg("%s at pixel %d %d", what, x, y);
}

/* Counts, and checks what holds for every picture: the three arrays agree on what is empty, no odd depth. */
static size_t count_covered(const struct ref_image *image)
{
    size_t count = 0;
    for (int y = 0; y < image->height; y++)
        for (int x = 0; x < image->width; x++) {
            double depth = image->depth[at(image, x, y)];
            const uint8_t *rgb = &image->rgb[3 * at(image, x, y)];
            if (is_covered(image, x, y)) {
                expect(depth > 0.0 && isfinite(depth), "depth of a hit", x, y);
                count++;
                continue;
            }
            expect(isinf(depth) && depth > 0.0, "depth of an empty pixel", x, y);
            expect(rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0, "background", x, y);
        }
    return count;
}

/* Fixed seeds, so that a failure repeats; splitmix64. */
static double random_between(uint64_t *state, double lo, double hi)
{
    uint64_t z = (*state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return lo + (hi - lo) * (double)(z >> 11) * 0x1p-53;
}

START_TEST(square_facing_the_eye_covers_exactly_its_pixels)
{
    struct ref_camera cameras[2] = {plain_camera(120, 80, 60.0), tilted_camera(120, 80)};
    struct ref_triangle t[2];
    picture_quad(t, &cameras[_i], 20.0, 10.0, 60.0, 30.0, 7.5);
    struct ref_image image = draw(t, 2, &cameras[_i], 0.3);
    ck_assert_uint_eq(count_covered(&image), 40 * 20);
    for (int y = 0; y < 80; y++)
        for (int x = 0; x < 120; x++) {
            bool inside = x >= 20 && x < 60 && y >= 10 && y < 30;
            expect(is_covered(&image, x, y) == inside, "cover", x, y);
            expect(!inside || fabs(image.depth[at(&image, x, y)] - 7.5) < 1e-12, "depth", x, y);
        }
    ref_image_release(&image);
}
END_TEST

START_TEST(up_is_the_top_row_and_right_of_forward_is_the_right_column)
{
    /* Seen from +x towards the origin with z up, +y lies to the right; up leans forward on purpose. */
    struct ref_camera camera = {.eye = {10, 0, 0}, .target = {0, 0, 0}, .up = {-0.7, 0, 1},
                                .fov_y_deg = 40.0, .width = 41, .height = 31};
    struct ref_triangle t[3];
    memset(t, 0, sizeof t);
    double middle[3][3] = {{0, 0, 0}, {0, 0, 3}, {0, 3, 0}};
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < 3; i++)
            set_corner(&t[k], i, 0, middle[k][1] + 0.3 * cos(2.0 * i), middle[k][2] + 0.3 * sin(2.0 * i));
        paint(&t[k], 200, 200, 200);
    }
    struct ref_image image = draw(t, 3, &camera, 1.0);
    /* An offset of 3 / 10 in rows: 3 / 10 / tan(20 degrees) of half the height. */
    int shift = (int)lround(0.3 / tan(pi / 9.0) * 15.5);
    ck_assert_uint_eq(image.triangle[at(&image, 20, 15)], 0);
    ck_assert_uint_eq(image.triangle[at(&image, 20, 15 - shift)], 1);
    ck_assert_uint_eq(image.triangle[at(&image, 20 + shift, 15)], 2);
    ck_assert(!is_covered(&image, 20, 15 + shift));
    ck_assert(!is_covered(&image, 20 - shift, 15));
    ref_image_release(&image);
}
END_TEST

START_TEST(field_of_view_spans_the_picture_height)
{
    /* A wall 2 tan(25 degrees) high at depth 1 fills the rows exactly, and 30 of the 90 columns. */
    struct ref_camera camera = plain_camera(90, 30, 50.0);
    double h = tan(25.0 * pi / 180.0) * (1.0 + 1e-9);
    struct ref_triangle t[2];
    quad(t, (double[]){-h, -h, -1}, (double[]){h, -h, -1}, (double[]){h, h, -1}, (double[]){-h, h, -1});
    struct ref_image image = draw(t, 2, &camera, 1.0);
    ck_assert_uint_eq(count_covered(&image), 30 * 30);
    ck_assert(is_covered(&image, 30, 0) && is_covered(&image, 59, 29));
    ck_assert(!is_covered(&image, 29, 15) && !is_covered(&image, 60, 15));
    ref_image_release(&image);
}
END_TEST

START_TEST(edges_through_pixel_centres_count_as_covered)
{
    struct ref_camera cameras[2] = {plain_camera(64, 48, 90.0), tilted_camera(64, 48)};
    struct ref_triangle t[2];
    picture_quad(t, &cameras[_i], 10.5, 5.5, 30.5, 20.5, 4.0);
    struct ref_image image = draw(t, 2, &cameras[_i], 0.5);
    ck_assert_uint_eq(count_covered(&image), 21 * 16);
    ck_assert(is_covered(&image, 10, 5) && is_covered(&image, 30, 20));
    ck_assert(!is_covered(&image, 9, 5) && !is_covered(&image, 31, 20));
    ref_image_release(&image);

    /* Also the corner of a single triangle that points at a pixel centre from outside. */
    double a[3], b[3], c[3];
    unproject(&cameras[_i], 40.5, 40.5, 4.0, a);
    unproject(&cameras[_i], 43.0, 41.2, 5.0, b);
    unproject(&cameras[_i], 43.0, 39.6, 3.0, c);
    quad(t, a, b, c, a);
    image = draw(t, 1, &cameras[_i], 0.5);
    ck_assert(is_covered(&image, 40, 40) && is_covered(&image, 41, 40));
    ck_assert(!is_covered(&image, 39, 40) && !is_covered(&image, 40, 41) && !is_covered(&image, 40, 39));
    ref_image_release(&image);
}
END_TEST

/* A bumpy sheet that fills the picture, its corners on pixel centres so that edges and fans meet them. */
START_TEST(mesh_without_gaps_leaves_no_pixel_empty)
{
    enum { SIDE = 32, PITCH = 4, PIXELS = SIDE * PITCH };
    static double corner[SIDE + 2][SIDE + 2][3];
    static struct ref_triangle t[2 * (SIDE + 1) * (SIDE + 1)];
    struct ref_camera camera = tilted_camera(PIXELS, PIXELS);
    uint64_t seed = 100 + (uint64_t)_i;
    for (int y = 0; y < SIDE + 2; y++)
        for (int x = 0; x < SIDE + 2; x++) {
            double depth = random_between(&seed, 3.0, 9.0);
            double jump = _i % 2 ? floor(random_between(&seed, -1.0, 2.0)) : 0.0;
            unproject(&camera, PITCH * x + jump - 1.5, PITCH * y - jump - 1.5, depth, corner[y][x]);
        }
    size_t n = 0;
    for (int y = 0; y <= SIDE; y++)
        for (int x = 0; x <= SIDE; x++, n += 2)
            if (random_between(&seed, 0.0, 1.0) < 0.5)
                quad(&t[n], corner[y][x], corner[y][x + 1], corner[y + 1][x + 1], corner[y + 1][x]);
            else
                quad(&t[n], corner[y + 1][x], corner[y][x], corner[y][x + 1], corner[y + 1][x + 1]);
    struct ref_image image = draw(t, n, &camera, 0.2);
    ck_assert_uint_eq(count_covered(&image), PIXELS * PIXELS);
    ref_image_release(&image);
}
END_TEST

/* Around a corner on a pixel centre all edge signs are roundings; the fan must cover the pixel still. */
START_TEST(fan_around_a_pixel_centre_covers_it)
{
    enum { BLADES = 7, FANS = 500 };
    struct ref_camera camera = tilted_camera(9, 9);
    uint64_t seed = 7;
    for (int fan = 0; fan < FANS; fan++) {
        double hub[3], rim[BLADES][3], turn = random_between(&seed, 0.0, 7.0);
        unproject(&camera, 4.5, 4.5, random_between(&seed, 0.5, 20.0), hub);
        for (int i = 0; i < BLADES; i++) {
            double angle = turn + 2.0 * pi * i / BLADES, reach = random_between(&seed, 1.0, 30.0);
            unproject(&camera, 4.5 + reach * cos(angle), 4.5 + reach * sin(angle),
                      random_between(&seed, 0.5, 20.0), rim[i]);
        }
        struct ref_triangle t[2 * BLADES];
        for (int i = 0; i < BLADES; i++)
            quad(&t[i], hub, rim[i], rim[(i + 1) % BLADES], hub);
        struct ref_image image = draw(t, BLADES, &camera, 0.5);
        ck_assert_msg(is_covered(&image, 4, 4), "fan %d", fan);
        ref_image_release(&image);
    }
}
END_TEST

static void sphere_point(double radius, double distance, double theta, double phi, double out[3])
{
    out[0] = radius * sin(theta) * cos(phi);
    out[1] = radius * sin(theta) * sin(phi);
    out[2] = radius * cos(theta) - distance;
}

/* A sphere of radius R at distance D shows a disc of radius R / sqrt(D^2 - R^2) at depth 1. */
START_TEST(sphere_shows_the_disc_shade_and_depth_of_perspective)
{
    enum { RINGS = 128, SECTORS = 256, SIDE = 301 };
    const double radius = 2.0, distance = 5.0, ambient = 0.2;
    struct ref_camera camera = plain_camera(SIDE, SIDE, 60.0);
    static struct ref_triangle t[2 * RINGS * SECTORS];
    size_t n = 0;
    for (int i = 0; i < RINGS; i++)
        for (int k = 0; k < SECTORS; k++, n += 2) {
            double a[3], b[3], c[3], d[3], theta = pi * i / RINGS, phi = 2.0 * pi * k / SECTORS;
            double next_theta = theta + pi / RINGS, next_phi = phi + 2.0 * pi / SECTORS;
            sphere_point(radius, distance, theta, phi, a);
            sphere_point(radius, distance, next_theta, phi, b);
            sphere_point(radius, distance, next_theta, next_phi, c);
            sphere_point(radius, distance, theta, next_phi, d);
            quad(&t[n], a, b, c, d);
        }
    struct ref_image image = draw(t, n, &camera, ambient);
    double disc = radius / sqrt(distance * distance - radius * radius);
    double disc_px = disc / tan(pi / 6.0) * SIDE / 2.0;
    double area = (double)count_covered(&image), expected = pi * disc_px * disc_px;
    ck_assert_msg(fabs(area / expected - 1.0) < 0.002, "area %g, disc %g", area, expected);
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            double from_middle = hypot(x - SIDE / 2, y - SIDE / 2), s = from_middle * disc / disc_px;
            bool inside = from_middle < disc_px, near_rim = fabs(from_middle - disc_px) <= 0.6;
            expect(near_rim || is_covered(&image, x, y) == inside, "cover", x, y);
            if (from_middle > disc_px - 5.0)
                continue;
            /* (1 + s^2) z^2 - 2 D z + D^2 - R^2 = 0; the mesh lies inside the sphere by its sagitta. */
            double q = 1.0 + s * s, tangent = distance * distance - radius * radius;
            double root = sqrt(distance * distance - q * tangent);
            double z = (distance - root) / q, light = root / (radius * sqrt(q));
            size_t pixel = at(&image, x, y);
            expect(fabs(image.depth[pixel] - z) < 0.01, "depth", x, y);
            expect(fabs(image.rgb[3 * pixel] - 255.0 * (ambient + 0.8 * light)) < 5.0, "light", x, y);
        }
    ref_image_release(&image);
}
END_TEST

/* Plane p . n = offset, ray (s, u, -1) z from the eye at the origin: z = offset / (s nx + u ny - nz). */
START_TEST(tilted_plane_has_its_analytic_depth_and_light_at_every_pixel)
{
    const int width = 97, height = 61;
    const double normal[3] = {0.48, 0.6, -0.64}, offset = 4.0, ambient = 0.25;
    struct ref_camera camera = plain_camera(width, height, 70.0);
    const double in_plane[2][3] = {{0.8, 0, 0.6}, {0.36, -0.8, -0.48}};
    double corner[4][3];
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < 3; i++)
            corner[k][i] = offset * normal[i] + (k % 3 ? 40.0 : -40.0) * in_plane[0][i] +
                           (k / 2 ? 40.0 : -40.0) * in_plane[1][i];
    struct ref_triangle t[2];
    quad(t, corner[0], corner[1], corner[2], corner[3]);
    struct ref_image image = draw(t, 2, &camera, ambient);
    int seen = 0;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            double step = tan(35.0 * pi / 180.0) / (0.5 * height);
            double s = (x + 0.5 - 0.5 * width) * step, u = (0.5 * height - y - 0.5) * step;
            double slope = s * normal[0] + u * normal[1] - normal[2], z = offset / slope;
            /* The rectangle reaches 40 from its middle at depth 2.56, so only steeper rays may pass it. */
            expect(is_covered(&image, x, y) || slope < 0.2, "cover", x, y);
            if (!is_covered(&image, x, y))
                continue;
            seen++;
            double light = fabs(slope) / sqrt(s * s + u * u + 1.0);
            size_t pixel = at(&image, x, y);
            expect(fabs(image.depth[pixel] - z) < 1e-11 * z, "depth", x, y);
            expect(fabs(image.rgb[3 * pixel + 1] - 255.0 * (ambient + 0.75 * light)) < 0.5001, "light", x, y);
        }
    ck_assert_int_gt(seen, width * height / 2);
    ref_image_release(&image);
}
END_TEST

/* The plane almost holds the eye: its depth is a quotient of two roundings, the corners are what is left. */
START_TEST(depth_stays_between_the_corners_at_a_grazing_angle)
{
    struct ref_camera camera = tilted_camera(9, 9);
    uint64_t seed = 21;
    int seen = 0;
    for (int k = 0; k < 300; k++) {
        double a[3], b[3], c[3], lift = pow(10.0, random_between(&seed, -13, -6));
        unproject(&camera, 1.5, 3.5, 2.0, a);
        unproject(&camera, 7.5, 5.5, 2.0, b);
        unproject(&camera, 4.5, 4.5 + lift, 9.0, c);
        struct ref_triangle t[2];
        quad(t, a, b, c, a);
        struct ref_image image = draw(t, 1, &camera, 0.5);
        double depth = image.depth[at(&image, 4, 4)];
        seen += is_covered(&image, 4, 4);
        ck_assert_msg(isinf(depth) || (depth > 2.0 - 1e-14 && depth < 9.0 + 1e-14), "depth %.17g", depth);
        ref_image_release(&image);
    }
    ck_assert_int_gt(seen, 200);
}
END_TEST

START_TEST(shade_does_not_depend_on_the_side_or_winding)
{
    struct ref_camera camera = tilted_camera(40, 40);
    double a[3], b[3], c[3];
    unproject(&camera, 5.0, 5.0, 3.0, a);
    unproject(&camera, 35.0, 12.0, 6.0, b);
    unproject(&camera, 12.0, 36.0, 4.0, c);
    struct ref_triangle one[2], two[2];
    quad(one, a, b, c, a);
    quad(two, a, c, b, a);
    struct ref_image first = draw(one, 1, &camera, 0.1), second = draw(two, 1, &camera, 0.1);
    ck_assert_uint_gt(count_covered(&first), 300);
    ck_assert_mem_eq(first.rgb, second.rgb, 3 * 40 * 40);
    ck_assert_mem_eq(first.triangle, second.triangle, 40 * 40 * sizeof(uint32_t));
    for (int i = 0; i < 40 * 40; i++)
        if (first.triangle[i] == 0)
            expect(fabs(first.depth[i] - second.depth[i]) < 1e-13, "depth", i % 40, i / 40);
    ref_image_release(&first);
    ref_image_release(&second);
}
END_TEST

/* The eye stands over a floor that reaches behind it: the triangles pass through the eye plane. */
START_TEST(floor_under_the_eye_covers_all_rows_below_the_horizon)
{
    const int width = 64, height = 48;
    const double far = 1e6, step = tan(pi / 4.0) / 24.0;
    struct ref_camera camera = plain_camera(width, height, 90.0);
    /* case 0: level. case 1: looking down 30 degrees, so the horizon is tan(30 degrees) above the axis. */
    if (_i == 1)
        camera.target[1] = -tan(pi / 6.0);
    struct ref_triangle t[2];
    quad(t, (double[]){-far, -1, far}, (double[]){far, -1, far}, (double[]){far, -1, -far},
         (double[]){-far, -1, -far});
    struct ref_image image = draw(t, 2, &camera, 0.5);
    double horizon = _i == 1 ? tan(pi / 6.0) : 0.0;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            double u = (23.5 - y) * step;
            expect(is_covered(&image, x, y) == (u < horizon), "cover", x, y);
            if (u >= horizon)
                continue;
            double drop = _i == 1 ? sin(pi / 6.0) - u * cos(pi / 6.0) : -u;     /* of the ray, per depth */
            expect(fabs(image.depth[at(&image, x, y)] - 1.0 / drop) < 1e-9 / drop, "depth", x, y);
        }
    count_covered(&image);
    ref_image_release(&image);
}
END_TEST

START_TEST(triangles_behind_the_eye_or_flat_cover_nothing)
{
    struct ref_camera camera = plain_camera(50, 50, 80.0);
    struct ref_triangle t[10];
    memset(t, 0, sizeof t);
    const double corner[10][3][3] = {
        {{-9, -9, 1}, {9, -9, 1}, {0, 9, 1}},                       /* behind */
        {{-9, -9, 0}, {9, -9, 0}, {0, 9, 0}},                       /* in the eye plane, around the eye */
        {{-9, -9, 0}, {9, -9, 0}, {0, 9, 5}},                       /* touches the eye plane from behind */
        {{-1, -1, -3}, {0, 0, -3}, {2, 2, -3}},                     /* a line */
        {{0.1, 0.2, -3}, {0.1, 0.2, -3}, {2, 2, -3}},               /* two equal corners */
        {{0.1, 0.2, -3}, {0.1, 0.2, -3}, {0.1, 0.2, -3}},           /* a point */
        {{0, -1, -2}, {0, 1, -3}, {0, 0.5, -9}},                    /* edge-on: the eye lies in its plane */
        {{0, -1, 2}, {0, 1, 3}, {0, 0.5, -9}},                      /* the same through the eye plane */
        {{0.3, 0.1, -3}, {0.6, 0.2, -6}, {0.9, 0.3, -9}},           /* a line through the eye */
        {{0, 0, 0}, {1, 1, -3}, {-1, 1, -3}}};                      /* a corner in the eye */
    for (int k = 0; k < 10; k++) {
        memcpy(t[k].corner, corner[k], sizeof t[k].corner);
        paint(&t[k], 255, 255, 255);
        struct ref_image image = draw(&t[k], 1, &camera, 0.5);
        ck_assert_msg(count_covered(&image) == 0, "triangle %d", k);
        ref_image_release(&image);
    }
}
END_TEST

/* Edge-on triangles where no coordinate is round, so that their area in the picture is rounding, not zero. */
START_TEST(flat_triangles_in_odd_places_cover_nothing)
{
    struct ref_camera camera = tilted_camera(60, 60);
    uint64_t seed = 11;
    for (int k = 0; k < 400; k++) {
        double a[3], b[3], c[3], x = random_between(&seed, 0, 60), y = random_between(&seed, 0, 60);
        double dx = random_between(&seed, -30, 30), dy = random_between(&seed, -30, 30);
        unproject(&camera, x, y, random_between(&seed, 1, 9), a);
        unproject(&camera, x + dx, y + dy, random_between(&seed, 1, 9), b);
        unproject(&camera, x + 0.37 * dx, y + 0.37 * dy, random_between(&seed, 1, 9), c);
        struct ref_triangle t[2];
        quad(t, a, b, c, a);
        struct ref_image image = draw(t, 1, &camera, 0.5);
        ck_assert_msg(count_covered(&image) == 0, "triangle %d", k);
        ref_image_release(&image);
    }
}
END_TEST

START_TEST(extreme_coordinates_stay_out_of_the_picture_or_in_range)
{
    struct ref_camera camera = plain_camera(33, 21, 80.0);
    const double odd[] = {NAN, INFINITY, -INFINITY, 1e308, -1e308, 1e200,
                          1e30, -1e30, 1e-300, 1e-30, 0.0, -1.0};
    const int odd_count = (int)(sizeof odd / sizeof odd[0]);
    uint64_t seed = 3;
    for (int k = 0; k < 5000; k++) {
        struct ref_triangle t;
        memset(&t, 0, sizeof t);
        paint(&t, 90, 90, 90);
        for (int i = 0; i < 9; i++)
            t.corner[i / 3][i % 3] = k < 2500 && random_between(&seed, 0, 1) < 0.6
                                         ? random_between(&seed, -5, 5)
                                         : odd[(int)random_between(&seed, 0, odd_count)];
        struct ref_image image = draw(&t, 1, &camera, 0.5);
        count_covered(&image);
        ref_image_release(&image);
    }
    /* Far outside on each side, in front of the eye. */
    for (int k = 0; k < 8; k++) {
        double x = 1e9 * cos(pi * k / 4), y = 1e9 * sin(pi * k / 4);
        struct ref_triangle t;
        memset(&t, 0, sizeof t);
        set_corner(&t, 0, x, y, -1);
        set_corner(&t, 1, x + 1e8, y, -2);
        set_corner(&t, 2, x, y + 1e8, -3);
        struct ref_image image = draw(&t, 1, &camera, 0.5);
        ck_assert_uint_eq(count_covered(&image), 0);
        ref_image_release(&image);
    }
    /* A wall far larger than the picture covers all of it. */
    struct ref_triangle wall[2];
    const double w = 1e12;
    quad(wall, (double[]){-w, -w, -9}, (double[]){w, -w, -9}, (double[]){w, w, -9}, (double[]){-w, w, -9});
    struct ref_image image = draw(wall, 2, &camera, 0.5);
    ck_assert_uint_eq(count_covered(&image), 33 * 21);
    for (int i = 0; i < 33 * 21; i++)
        ck_assert_double_eq_tol(image.depth[i], 9.0, 1e-9);
    ref_image_release(&image);
}
END_TEST

/* Colour at the hit point by its position in space, for a triangle that recedes from depth 2 to 30. */
START_TEST(colours_are_interpolated_perspective_correctly)
{
    const int width = 80, height = 60;
    struct ref_camera camera = plain_camera(width, height, 60.0);
    struct ref_triangle t;
    memset(&t, 0, sizeof t);
    set_corner(&t, 0, -1.5, -1, -2);
    set_corner(&t, 1, 1.5, -1, -2);
    set_corner(&t, 2, 0, 9, -30);
    for (int i = 0; i < 3; i++)
        t.rgba[i][i] = (uint8_t)(255 - 50 * i);
    struct ref_image image = draw(&t, 1, &camera, 1.0);
    ck_assert_uint_gt(count_covered(&image), 500);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            if (!is_covered(&image, x, y))
                continue;
            /* On the plane: py = -1 + 10 w2, -pz = 2 + 28 w2, px = 1.5 (w1 - w0); u = py / -pz. */
            double step = tan(pi / 6.0) / 30.0, s = (x + 0.5 - 40.0) * step, u = (30.0 - y - 0.5) * step;
            double w2 = (1.0 + 2.0 * u) / (10.0 - 28.0 * u), px = s * (2.0 + 28.0 * w2);
            double w1 = 0.5 * (1.0 - w2 + px / 1.5), w0 = 1.0 - w1 - w2;
            const uint8_t *rgb = &image.rgb[3 * at(&image, x, y)];
            expect(fabs(rgb[0] - 255.0 * w0) < 0.5001, "red", x, y);
            expect(fabs(rgb[1] - 205.0 * w1) < 0.5001, "green", x, y);
            expect(fabs(rgb[2] - 155.0 * w2) < 0.5001, "blue", x, y);
        }
    ref_image_release(&image);
}
END_TEST

/* Moeller and Trumbore. Returns depth, 0 for a miss, -1 where the ray comes too close to an edge to tell. */
static double ray_hit(const struct ref_triangle *t, const double eye[3], const double ray[3])
{
    double ab[3], ac[3], to_eye[3], p[3], q[3];
    for (int i = 0; i < 3; i++) {
        ab[i] = t->corner[1][i] - t->corner[0][i];
        ac[i] = t->corner[2][i] - t->corner[0][i];
        to_eye[i] = eye[i] - t->corner[0][i];
    }
    cross3(ray, ac, p);
    cross3(to_eye, ab, q);
    double det = dot3(ab, p);
    double b = dot3(to_eye, p) / det, c = dot3(ray, q) / det, depth = dot3(ac, q) / det;
    double inside = fmin(fmin(b, c), fmin(1.0 - b - c, depth));
    return inside > 1e-9 ? depth : inside < -1e-9 ? 0.0 : -1.0;
}

enum { CROWD = 120 };

/* Case 0 in front of the eye, case 1 all around it: many pass through the eye plane and each other. */
static void crowd(struct ref_triangle *t, const struct ref_camera *camera, int kind, uint64_t *seed)
{
    for (int k = 0; k < CROWD; k++) {
        double span = kind == 0 ? 1.5 : 4.0;
        for (int axis = 0; axis < 3; axis++) {
            double middle = kind == 0 ? random_between(seed, -1, 1)
                                      : camera->eye[axis] + random_between(seed, -3, 3);
            for (int i = 0; i < 3; i++)
                t[k].corner[i][axis] = middle + random_between(seed, -span, span) * (k % 5 ? 0.3 : 1.0);
        }
        for (int i = 0; i < 12; i++)
            t[k].rgba[i / 4][i % 4] = (uint8_t)random_between(seed, 0, 256);
    }
}

START_TEST(every_pixel_shows_the_nearest_triangle_that_its_ray_hits)
{
    const int width = 53, height = 37;
    struct ref_camera camera = tilted_camera(width, height);
    struct ref_triangle t[CROWD];
    uint64_t seed = 40 + (uint64_t)_i;
    crowd(t, &camera, _i % 2, &seed);
    struct ref_image image = draw(t, CROWD, &camera, 0.3);
    ck_assert_uint_gt(count_covered(&image), 200);
    int doubtful = 0;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            double ray[3], best = INFINITY;
            uint32_t nearest = UINT32_MAX;
            bool doubt = false;
            unproject(&camera, x + 0.5, y + 0.5, 1.0, ray);
            for (int i = 0; i < 3; i++)
                ray[i] -= camera.eye[i];
            for (uint32_t k = 0; k < CROWD; k++) {
                double depth = ray_hit(&t[k], camera.eye, ray);
                doubt = doubt || depth < 0.0;
                if (depth > 0.0 && depth < best) {
                    best = depth;
                    nearest = k;
                }
            }
            doubtful += doubt;
            if (doubt)
                continue;
            size_t pixel = at(&image, x, y);
            expect(image.triangle[pixel] == nearest, "triangle", x, y);
            expect(isinf(best) || fabs(image.depth[pixel] - best) < 1e-9 * best, "depth", x, y);
        }
    ck_assert_int_lt(doubtful, 5);
    ref_image_release(&image);
}
END_TEST

START_TEST(picture_does_not_depend_on_the_order_of_the_triangles)
{
    const int width = 71, height = 53;
    struct ref_camera camera = tilted_camera(width, height);
    struct ref_triangle t[CROWD], mixed[CROWD];
    uint32_t from[CROWD];
    uint64_t seed = 90 + (uint64_t)_i;
    crowd(t, &camera, _i % 2, &seed);
    for (uint32_t k = 0; k < CROWD; k++)
        from[k] = k;
    for (uint32_t k = CROWD - 1; k > 0; k--) {
        uint32_t other = (uint32_t)random_between(&seed, 0, k + 1), kept = from[k];
        from[k] = from[other];
        from[other] = kept;
    }
    for (int k = 0; k < CROWD; k++)
        mixed[k] = t[from[k]];
    struct ref_image one = draw(t, CROWD, &camera, 0.3), two = draw(mixed, CROWD, &camera, 0.3);
    ck_assert_uint_gt(count_covered(&one), 400);
    ck_assert_uint_eq(count_covered(&one), count_covered(&two));
    ck_assert_mem_eq(one.depth, two.depth, (size_t)(width * height) * sizeof *one.depth);
    ck_assert_mem_eq(one.rgb, two.rgb, (size_t)(width * height) * 3);
    for (int i = 0; i < width * height; i++)
        if (two.triangle[i] != UINT32_MAX)
            ck_assert_uint_eq(one.triangle[i], from[two.triangle[i]]);
    ref_image_release(&one);
    ref_image_release(&two);
}
END_TEST

/* Bands from the last to the first, and pieces of any size: as threads do it. */
START_TEST(pieces_and_bands_of_rows_give_the_picture_of_the_whole)
{
    enum { BAND = 11 };
    const int width = 71, height = 53;
    struct ref_camera camera = tilted_camera(width, height);
    struct ref_triangle t[CROWD];
    uint64_t seed = 400 + (uint64_t)_i;
    crowd(t, &camera, _i % 2, &seed);
    struct ref_image whole = draw(t, CROWD, &camera, 0.3), banded;
    struct ref_raster *raster = ref_raster_begin(&camera, 0.3);
    ck_assert_ptr_nonnull(raster);
    for (size_t first = 0, n; first < CROWD; first += n) {
        n = 1 + (size_t)random_between(&seed, 0, CROWD / 2.0);
        n = n < CROWD - first ? n : CROWD - first;
        for (int y = height / BAND * BAND; y >= 0; y -= BAND)
            ref_raster_add(raster, t + first, n, first, y, y + BAND < height ? y + BAND : height);
    }
    ref_raster_end(raster, &banded);
    ck_assert_mem_eq(whole.depth, banded.depth, (size_t)(width * height) * sizeof *whole.depth);
    ck_assert_mem_eq(whole.triangle, banded.triangle, (size_t)(width * height) * sizeof *whole.triangle);
    ck_assert_mem_eq(whole.rgb, banded.rgb, (size_t)(width * height) * 3);
    ref_image_release(&whole);
    ref_image_release(&banded);
}
END_TEST

START_TEST(pictures_from_one_pixel_to_4096_squared_work)
{
    const int size[][2] = {{1, 1}, {1, 4096}, {4096, 1}, {2, 1}, {1, 2}, {4096, 4096}};
    for (size_t k = 0; k < sizeof size / sizeof size[0]; k++) {
        struct ref_camera camera = tilted_camera(size[k][0], size[k][1]);
        struct ref_triangle t[2];
        picture_quad(t, &camera, -1.0, -1.0, size[k][0] + 1.0, size[k][1] + 1.0, 3.0);
        struct ref_image image = draw(t, 2, &camera, 0.5);
        int gaps = 0;
        for (int y = 0; y < size[k][1]; y++)
            for (int x = 0; x < size[k][0]; x++)
                gaps += !is_covered(&image, x, y);
        ck_assert_int_eq(gaps, 0);
        ref_image_release(&image);
    }
}
END_TEST

START_TEST(no_triangles_give_an_empty_picture)
{
    struct ref_camera camera = plain_camera(5, 4, 60.0);
    struct ref_image image = draw(NULL, 0, &camera, 0.5);
    ck_assert_uint_eq(count_covered(&image), 0);
    ref_image_release(&image);
    ck_assert(!image.depth && !image.triangle && !image.rgb && image.width == 0 && image.height == 0);
    ref_image_release(&image);
    ref_image_release(NULL);
}
END_TEST

START_TEST(picture_too_large_for_memory_is_an_error)
{
    struct ref_camera camera = plain_camera(1 << 30, 1 << 30, 60.0);
    struct ref_image image;
    ck_assert_int_eq(ref_raster(NULL, 0, &camera, 0.5, &image), -1);
    ck_assert(!image.depth && !image.triangle && !image.rgb);
}
END_TEST

/* Masks drawn by hand: '#' both, 'r' reference only, 'o' other only, '.' neither. */
static struct ref_compare compare(const char *drawing, int width)
{
    uint32_t triangle[256];
    uint8_t cover[256];
    int pixels = (int)strlen(drawing), height = pixels / width;
    ck_assert(pixels <= 256 && pixels == width * height);
    for (int i = 0; i < pixels; i++) {
        triangle[i] = strchr("#r", drawing[i]) ? (uint32_t)i : UINT32_MAX;
        cover[i] = (uint8_t)(strchr("#o", drawing[i]) ? 1 << (i % 8) : 0);
    }
    struct ref_image image = {.width = width, .height = height, .triangle = triangle};
    struct ref_compare result;
    memset(&result, 0xA5, sizeof result);
    ref_compare_cover(&image, cover, &result);
    return result;
}

static void expect_compare(const char *drawing, int width, double overlap, double tolerant, int extra)
{
    struct ref_compare result = compare(drawing, width);
    ck_assert_double_eq_tol(result.overlap, overlap, 1e-15);
    ck_assert_double_eq_tol(result.overlap_tolerant, tolerant, 1e-15);
    ck_assert_int_eq(result.extra_px_max, extra);
    ck_assert_uint_eq(result.holes, 0);
    ck_assert_int_eq(result.hole_x, -1);
    ck_assert_int_eq(result.hole_y, -1);
}

START_TEST(overlap_is_shared_pixels_over_pixels_in_either)
{
    expect_compare("####"
                   "####", 4, 1.0, 1.0, 0);
    expect_compare("r##o"
                   "r##o", 4, 0.5, 1.0, 1);
    expect_compare("r..o"
                   "r...", 4, 0.0, 0.0, 3);
    expect_compare("#.rr", 4, 1.0 / 3.0, 1.0 / 3.0, 0);
    expect_compare("##rr", 4, 0.5, 0.75, 0);
    expect_compare("#.oo", 4, 1.0 / 3.0, 1.0 / 3.0, 3);
}
END_TEST

START_TEST(tolerant_overlap_takes_the_eight_neighbours_of_the_other_picture)
{
    expect_compare("r..."
                   ".o.."
                   "....", 4, 0.0, 1.0, 1);             /* a diagonal neighbour matches, both ways */
    expect_compare("r.o."
                   "....", 4, 0.0, 0.0, 2);             /* two pixels away does not */
    expect_compare("...r"
                   "o...", 4, 0.0, 0.0, 3);             /* the end of a row is no neighbour of the next */
    expect_compare("rr.."
                   "..o.", 4, 0.0, 2.0 / 3.0, 1);       /* each pixel is judged by itself */
    expect_compare("oo.."
                   "..r.", 4, 0.0, 2.0 / 3.0, 2);
}
END_TEST

START_TEST(empty_pictures_compare_as_equal_only_with_empty_ones)
{
    expect_compare("......", 3, 1.0, 1.0, 0);
    expect_compare(".", 1, 1.0, 1.0, 0);
    expect_compare("#", 1, 1.0, 1.0, 0);
    expect_compare("r", 1, 0.0, 0.0, 0);
    expect_compare("rr", 2, 0.0, 0.0, 0);
    /* Without a reference pixel the distance has no value: the larger side stands for it, never 0. */
    expect_compare("o", 1, 0.0, 0.0, 1);
    expect_compare("..o"
                   "...", 3, 0.0, 0.0, 3);
    expect_compare("."
                   "."
                   "o"
                   ".", 1, 0.0, 0.0, 4);
}
END_TEST

START_TEST(holes_are_missing_pixels_with_a_full_reference_neighbourhood)
{
    struct ref_compare one = compare("###.."
                                     "#r#.."
                                     "###..", 5);
    ck_assert_uint_eq(one.holes, 1);
    ck_assert_int_eq(one.hole_x, 1);
    ck_assert_int_eq(one.hole_y, 1);
    ck_assert_double_eq_tol(one.overlap, 8.0 / 9.0, 1e-15);
    ck_assert_double_eq_tol(one.overlap_tolerant, 1.0, 1e-15);

    /* The neighbourhood counts in the reference only; the first hole in row order is named. */
    struct ref_compare many = compare("rrrrrr"
                                      "rr#rrr"
                                      "rrrrrr"
                                      "rrrr.r", 6);
    ck_assert_uint_eq(many.holes, 5);                   /* (1,1) (3,1) (4,1), (1,2) (2,2) */
    ck_assert_int_eq(many.hole_x, 1);
    ck_assert_int_eq(many.hole_y, 1);
}
END_TEST

START_TEST(pixels_at_the_border_or_by_an_outline_are_no_holes)
{
    struct ref_compare border = compare("rrr"
                                        "r#r"
                                        "rrr", 3);
    ck_assert_uint_eq(border.holes, 0);                 /* every missing pixel touches the border */
    /* One missing neighbour is enough, whichever of the eight it is, also when the other covers it. */
    for (int k = 0; k < 9; k++)
        for (int filled = 0; filled < 2; filled++) {
            char drawing[] = "####r####";
            if (k == 4)
                continue;
            drawing[k] = filled ? 'o' : '.';
            struct ref_compare outline = compare(drawing, 3);
            ck_assert_uint_eq(outline.holes, 0);
            ck_assert_int_eq(outline.hole_x, -1);
            ck_assert_int_eq(outline.hole_y, -1);
        }
    /* A column that ends where the next row begins is not a neighbourhood. */
    ck_assert_uint_eq(compare("rr.rrr.rrr.r", 4).holes, 0);
    /* Pixels covered in both, or empty in both, are no holes. */
    ck_assert_uint_eq(compare("#########", 3).holes, 0);
    ck_assert_uint_eq(compare("####.####", 3).holes, 0);
}
END_TEST

START_TEST(extra_distance_is_the_largest_chebyshev_distance)
{
    expect_compare("#......"
                   "......."
                   ".....o."
                   ".......", 7, 0.5, 0.5, 5);
    expect_compare("o......"
                   "......."
                   "......."
                   "......#", 7, 0.5, 0.5, 6);
    expect_compare("o"
                   "."
                   "."
                   "#", 1, 0.5, 0.5, 3);
    /* The nearest reference pixel counts for each, the largest of these in the end. */
    expect_compare("#.o...r"
                   "......."
                   "......."
                   "o.....o", 7, 0.2, 0.2, 3);
    /* Pixels that the other lacks are not extra. */
    expect_compare("#.....r", 7, 0.5, 0.5, 0);
}
END_TEST

START_TEST(extra_distance_agrees_with_a_search_of_all_pairs)
{
    uint64_t seed = 500;
    for (int round = 0; round < 60; round++) {
        enum { W = 17, H = 13 };
        char drawing[W * H + 1] = {0};
        double density = random_between(&seed, 0.005, 0.2);
        for (int i = 0; i < W * H; i++)
            drawing[i] = random_between(&seed, 0, 1) > density ? '.'
                                                               : "#ro"[(int)random_between(&seed, 0, 3)];
        drawing[(int)random_between(&seed, 0, W * H)] = 'r';
        int most = 0;
        for (int i = 0; i < W * H; i++) {
            int nearest = W + H;
            for (int k = 0; k < W * H; k++) {
                int dx = abs(i % W - k % W), dy = abs(i / W - k / W), d = dx > dy ? dx : dy;
                if (strchr("#r", drawing[k]) && d < nearest)
                    nearest = d;
            }
            if (drawing[i] == 'o' && nearest > most)
                most = nearest;
        }
        ck_assert_msg(compare(drawing, W).extra_px_max == most, "round %d", round);
    }
}
END_TEST

static Suite *ref_raster_suite(void)
{
    Suite *suite = suite_create("ref_raster");
    TCase *cover = tcase_create("cover"), *value = tcase_create("value"), *masks = tcase_create("compare");
    tcase_set_timeout(cover, 60);
    tcase_set_timeout(value, 60);
    tcase_add_loop_test(cover, square_facing_the_eye_covers_exactly_its_pixels, 0, 2);
    tcase_add_test(cover, up_is_the_top_row_and_right_of_forward_is_the_right_column);
    tcase_add_test(cover, field_of_view_spans_the_picture_height);
    tcase_add_loop_test(cover, edges_through_pixel_centres_count_as_covered, 0, 2);
    tcase_add_loop_test(cover, mesh_without_gaps_leaves_no_pixel_empty, 0, 8);
    tcase_add_test(cover, fan_around_a_pixel_centre_covers_it);
    tcase_add_loop_test(cover, floor_under_the_eye_covers_all_rows_below_the_horizon, 0, 2);
    tcase_add_test(cover, triangles_behind_the_eye_or_flat_cover_nothing);
    tcase_add_test(cover, flat_triangles_in_odd_places_cover_nothing);
    tcase_add_test(cover, extreme_coordinates_stay_out_of_the_picture_or_in_range);
    tcase_add_test(cover, pictures_from_one_pixel_to_4096_squared_work);
    tcase_add_test(cover, no_triangles_give_an_empty_picture);
    tcase_add_test(cover, picture_too_large_for_memory_is_an_error);
    tcase_add_test(value, sphere_shows_the_disc_shade_and_depth_of_perspective);
    tcase_add_test(value, tilted_plane_has_its_analytic_depth_and_light_at_every_pixel);
    tcase_add_test(value, depth_stays_between_the_corners_at_a_grazing_angle);
    tcase_add_test(value, shade_does_not_depend_on_the_side_or_winding);
    tcase_add_test(value, colours_are_interpolated_perspective_correctly);
    tcase_add_loop_test(value, every_pixel_shows_the_nearest_triangle_that_its_ray_hits, 0, 10);
    tcase_add_loop_test(value, picture_does_not_depend_on_the_order_of_the_triangles, 0, 4);
    tcase_add_loop_test(value, pieces_and_bands_of_rows_give_the_picture_of_the_whole, 0, 4);
    tcase_add_test(masks, overlap_is_shared_pixels_over_pixels_in_either);
    tcase_add_test(masks, tolerant_overlap_takes_the_eight_neighbours_of_the_other_picture);
    tcase_add_test(masks, empty_pictures_compare_as_equal_only_with_empty_ones);
    tcase_add_test(masks, holes_are_missing_pixels_with_a_full_reference_neighbourhood);
    tcase_add_test(masks, pixels_at_the_border_or_by_an_outline_are_no_holes);
    tcase_add_test(masks, extra_distance_is_the_largest_chebyshev_distance);
    tcase_add_test(masks, extra_distance_agrees_with_a_search_of_all_pairs);
    suite_add_tcase(suite, cover);
    suite_add_tcase(suite, value);
    suite_add_tcase(suite, masks);
    return suite;
}

int main(void)
{
    SRunner *runner = srunner_create(ref_raster_suite());
    srunner_run_all(runner, CK_NORMAL);
    int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
