#include "ref_raster.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/*
 * How a pixel is judged: by its ray alone, in the coordinates of the scene, never by projected corners.
 *
 * Let A, B, C be the corners as seen from the eye and d the ray of a pixel, scaled so that d . forward = 1.
 * Cramer's rule gives d = (a A + b B + c C) / det with a = d . (B x C), b = d . (C x A), c = d . (A x B),
 * det = A . (B x C). The ray hits the triangle in front of the eye exactly when a, b, c all have the sign
 * of det, wherever the corners lie: a triangle through the plane of the eye needs no clipped polygon, its
 * half behind the eye has the wrong signs. The hit has depth det / (d . n), n = (B - A) x (C - A), and its
 * barycentric weights in space are a, b, c over their sum, so interpolation with them is perspective-correct.
 *
 * Clipping a polygon and dividing by depth lost: near the eye plane it projects to huge, inexact coordinates.
 *
 * Each edge form is computed from its two corners in one fixed order and then only negated, so that two
 * triangles on one edge see the same number with opposite signs; the slack covers corners, where more than
 * two edges meet and their roundings need not agree.
 *
 * Lengths from about 1e-90 to 1e+90 work; triangles whose products overflow or vanish beyond that,
 * or whose corners are not finite, cover nothing.
 */

/* An edge form is exact to about 10 ulps of |corner| |edge| |ray|; no picture resolves an angle of 4e-15. */
#define EDGE_SLACK (16.0 * DBL_EPSILON)
/* Below this share of |corner| |edge| |edge| the sign of det is noise: a line, or a triangle seen edge-on. */
#define FLAT_SHARE (64.0 * DBL_EPSILON)
/* Nearest depth that counts as in front of the eye, in distances from eye to target. */
#define NEAR_SHARE 1e-12
/* Error assumed for a coordinate when boxes are found, as a share of its distance; thousands of ulps. */
#define BOX_SHARE 1e-12

enum { RIGHT, UP, FORWARD };

struct view {
    double eye[3];
    double axis[3][3];                  /* RIGHT, UP, FORWARD: orthonormal */
    double step;                        /* half a pixel on the plane at depth 1 */
    double ray_max;                     /* longest ray to a pixel centre, at depth 1 */
    double near_depth;
    int width, height;
};

/* A linear function of the ray d = right * RIGHT + up * UP + FORWARD. */
struct form {
    double right, up, forward;
};

struct box {
    int x0, x1, y0, y1;                 /* both ends included; empty when x0 > x1 or y0 > y1 */
};

struct face {
    struct form weight[3];              /* of each corner: not negative inside, zero on the opposite edge */
    double slack[3];
    struct form facing;                 /* d . n, positive where the weights are */
    double det, normal_len;
    double depth_min, depth_max;        /* of the three corners */
    struct box box;
    uint8_t rgba[3][4];
    uint32_t number;
};

static void subtract(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[i] - b[i];
}

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

static double length(const double a[3])
{
    return sqrt(dot(a, a));
}

static void scale(double a[3], double factor)
{
    for (int i = 0; i < 3; i++)
        a[i] *= factor;
}

/* A camera that defines no picture is a bug of the test: an empty reference agrees with an empty picture. */
static void view_init(struct view *view, const struct ref_camera *camera)
{
    assert(camera->width > 0 && camera->height > 0);
    assert(camera->fov_y_deg > 0.0 && camera->fov_y_deg < 180.0);
    double *right = view->axis[RIGHT], *up = view->axis[UP], *forward = view->axis[FORWARD];
    subtract(camera->target, camera->eye, forward);
    double distance = length(forward);
    assert(distance > 0.0 && isfinite(distance));
    scale(forward, 1.0 / distance);
    cross(forward, camera->up, right);
    double sideways = length(right);
    assert(sideways > 1e-12 * length(camera->up));     /* up must not lie along the view; false for NaN */
    scale(right, 1.0 / sideways);
    cross(right, forward, up);

    for (int i = 0; i < 3; i++)
        view->eye[i] = camera->eye[i];
    view->width = camera->width;
    view->height = camera->height;
    view->step = tan(camera->fov_y_deg * (acos(-1.0) / 360.0)) / (double)camera->height;
    view->near_depth = NEAR_SHARE * distance;
    double half_width = view->step * (double)camera->width, half_height = view->step * (double)camera->height;
    view->ray_max = sqrt(1.0 + half_width * half_width + half_height * half_height);
}

/* Offsets of the centre of column x and row y on the plane at depth 1; exactly symmetric about the axis. */
static double ray_right(const struct view *view, int x)
{
    return (2.0 * (double)x + 1.0 - (double)view->width) * view->step;
}

static double ray_up(const struct view *view, int y)
{
    return ((double)view->height - 1.0 - 2.0 * (double)y) * view->step;
}

static struct form form_of(const struct view *view, const double vector[3], double factor)
{
    return (struct form){factor * dot(vector, view->axis[RIGHT]), factor * dot(vector, view->axis[UP]),
                         factor * dot(vector, view->axis[FORWARD])};
}

static bool comes_first(const double a[3], const double b[3])
{
    for (int i = 0; i < 3; i++)
        if (a[i] != b[i])
            return a[i] < b[i];
    return true;
}

/* The weight that vanishes on the edge from a to b: d . ((a - eye) x (b - eye)) times sign. */
static struct form edge_form(const struct view *view, const double a[3], const double b[3], double sign,
                             double *slack)
{
    bool keep = comes_first(a, b);
    const double *first = keep ? a : b, *second = keep ? b : a;
    double from_eye[3], along[3], side[3];
    subtract(first, view->eye, from_eye);
    subtract(second, first, along);     /* not second - eye: the difference of corners loses fewer digits */
    cross(from_eye, along, side);
    *slack = EDGE_SLACK * view->ray_max * length(from_eye) * length(along);
    return form_of(view, side, keep ? sign : -sign);
}

/*
 * Widens [lo, hi] by the offset along / depth, with both known to size * BOX_SHARE only and depth positive:
 * a corner close to the eye plane reaches to infinity, towards the side on which it lies.
 */
static void widen(double along, double depth, double size, double *lo, double *hi)
{
    double error = BOX_SHARE * size, least = along - error, most = along + error;
    double close = depth > error ? depth - error : 0.0, far = depth + error;
    *lo = fmin(*lo, least >= 0.0 ? least / far : close > 0.0 ? least / close : -INFINITY);
    *hi = fmax(*hi, most <= 0.0 ? most / far : close > 0.0 ? most / close : INFINITY);
}

/*
 * Pixels that the part in front of the eye may cover, one pixel generous; seen: the corners in view axes.
 * This only saves time: where an edge passes the eye plane the box is unbounded on the side of the crossing.
 */
static struct box box_of(const struct view *view, double seen[3][3])
{
    double lo[2] = {INFINITY, INFINITY}, hi[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < 3; i++) {
        const double *a = seen[i], *b = seen[(i + 1) % 3];
        double a_len = length(a), b_len = length(b);
        bool crosses = (a[FORWARD] > 0.0) != (b[FORWARD] > 0.0);
        for (int k = RIGHT; k <= UP; k++) {
            if (a[FORWARD] > 0.0)
                widen(a[k], a[FORWARD], a_len, &lo[k], &hi[k]);
            if (crosses) {
                double share = a[FORWARD] / (a[FORWARD] - b[FORWARD]);
                widen(a[k] + share * (b[k] - a[k]), 0.0, a_len + b_len, &lo[k], &hi[k]);
            }
        }
    }
    double last_x = (double)view->width - 1.0, last_y = (double)view->height - 1.0, pixel = 2.0 * view->step;
    double x0 = floor(0.5 * last_x + lo[RIGHT] / pixel) - 1.0;
    double x1 = ceil(0.5 * last_x + hi[RIGHT] / pixel) + 1.0;
    double y0 = floor(0.5 * last_y - hi[UP] / pixel) - 1.0;
    double y1 = ceil(0.5 * last_y - lo[UP] / pixel) + 1.0;
    /* Clamped as doubles: a far corner fits no int. One past either end keeps an empty box empty. */
    return (struct box){(int)fmin(fmax(x0, 0.0), last_x + 1.0), (int)fmax(fmin(x1, last_x), -1.0),
                        (int)fmin(fmax(y0, 0.0), last_y + 1.0), (int)fmax(fmin(y1, last_y), -1.0)};
}

/* Returns false when the triangle cannot cover any pixel of rows row_first to row_end - 1. */
static bool face_init(struct face *face, const struct view *view, const struct ref_triangle *triangle,
                      uint32_t number, int row_first, int row_end)
{
    double seen[3][3];
    face->depth_min = INFINITY;
    face->depth_max = -INFINITY;
    for (int i = 0; i < 3; i++) {
        double from_eye[3];
        subtract(triangle->corner[i], view->eye, from_eye);
        for (int k = 0; k < 3; k++)
            seen[i][k] = dot(from_eye, view->axis[k]);
        if (!isfinite(dot(seen[i], seen[i])))
            return false;
        face->depth_min = fmin(face->depth_min, seen[i][FORWARD]);
        face->depth_max = fmax(face->depth_max, seen[i][FORWARD]);
    }
    if (face->depth_max <= view->near_depth)
        return false;
    face->box = box_of(view, seen);
    face->box.y0 = face->box.y0 > row_first ? face->box.y0 : row_first;
    face->box.y1 = face->box.y1 < row_end - 1 ? face->box.y1 : row_end - 1;
    if (face->box.x0 > face->box.x1 || face->box.y0 > face->box.y1)
        return false;

    double from_eye[3], ab[3], ac[3], normal[3];
    subtract(triangle->corner[0], view->eye, from_eye);
    subtract(triangle->corner[1], triangle->corner[0], ab);
    subtract(triangle->corner[2], triangle->corner[0], ac);
    cross(ab, ac, normal);
    double det = dot(from_eye, normal), largest = length(from_eye) * length(ab) * length(ac);
    if (!isfinite(largest) || !(fabs(det) > FLAT_SHARE * largest))
        return false;
    double sign = det > 0.0 ? 1.0 : -1.0;
    for (int i = 0; i < 3; i++) {
        const double *from = triangle->corner[(i + 1) % 3], *to = triangle->corner[(i + 2) % 3];
        face->weight[i] = edge_form(view, from, to, sign, &face->slack[i]);
        if (!isfinite(face->slack[i]))
            return false;
    }
    face->facing = form_of(view, normal, sign);
    face->det = fabs(det);
    face->normal_len = length(normal);
    memcpy(face->rgba, triangle->rgba, sizeof face->rgba);
    face->number = number;
    return true;
}

/* light = |n . v|; the ray is -v times a length, and facing is the ray times an n of length normal_len. */
static void shade(const struct face *face, const double weight[3], double facing, double ray_len,
                  double ambient, uint8_t rgb[3])
{
    double light = fmin(facing / (face->normal_len * ray_len), 1.0);
    double strength = ambient + (1.0 - ambient) * light;
    double inside[3], sum = 0.0;
    for (int i = 0; i < 3; i++) {
        inside[i] = fmax(weight[i], 0.0);       /* a hit within the slack of an edge counts as on the edge */
        sum += inside[i];
    }
    for (int c = 0; c < 3; c++) {
        double value = 0.0;
        for (int i = 0; i < 3; i++)
            value += (sum > 0.0 ? inside[i] / sum : 1.0 / 3.0) * (double)face->rgba[i][c];
        rgb[c] = (uint8_t)fmin(floor(value * strength + 0.5), 255.0);
    }
}

static void draw_face(const struct view *view, const struct face *face, double ambient, struct ref_image *out)
{
    for (int y = face->box.y0; y <= face->box.y1; y++) {
        double up = ray_up(view, y), row[3];
        for (int i = 0; i < 3; i++)
            row[i] = face->weight[i].forward + up * face->weight[i].up;
        double facing_row = face->facing.forward + up * face->facing.up;
        for (int x = face->box.x0; x <= face->box.x1; x++) {
            double right = ray_right(view, x), weight[3];
            bool inside = true;
            for (int i = 0; i < 3; i++) {
                weight[i] = row[i] + right * face->weight[i].right;
                inside = inside && weight[i] >= -face->slack[i];
            }
            double facing = facing_row + right * face->facing.right;
            if (!inside || !(facing > 0.0))
                continue;
            /* The corners bound the depth of a hit; the quotient may not, on a plane at a grazing angle. */
            double depth = fmin(fmax(face->det / facing, face->depth_min), face->depth_max);
            size_t at = (size_t)y * (size_t)view->width + (size_t)x;
            if (!(depth > view->near_depth) || depth >= out->depth[at])
                continue;
            out->depth[at] = depth;
            out->triangle[at] = face->number;
            shade(face, weight, facing, sqrt(1.0 + right * right + up * up), ambient, &out->rgb[3 * at]);
        }
    }
}

struct ref_raster {
    struct view view;
    double ambient;
    struct ref_image image;
};

static bool image_init(struct ref_image *image, int width, int height)
{
    *image = (struct ref_image){.width = width, .height = height};
    if ((size_t)width > (size_t)PTRDIFF_MAX / sizeof *image->depth / (size_t)height)
        return false;
    const size_t pixels = (size_t)width * (size_t)height;
    image->depth = malloc(pixels * sizeof *image->depth);
    image->triangle = malloc(pixels * sizeof *image->triangle);
    image->rgb = calloc(pixels, 3);
    if (!image->depth || !image->triangle || !image->rgb)
        return false;
    for (size_t i = 0; i < pixels; i++) {
        image->depth[i] = INFINITY;
        image->triangle[i] = UINT32_MAX;
    }
    return true;
}

uint64_t ref_raster_bytes(int width, int height)
{
    const struct ref_image *none = NULL;
    return (uint64_t)width * (uint64_t)height * (sizeof *none->depth + sizeof *none->triangle + 3);
}

struct ref_raster *ref_raster_begin(const struct ref_camera *camera, double ambient)
{
    assert(ambient >= 0.0 && ambient <= 1.0);
    struct ref_raster *raster = malloc(sizeof *raster);
    if (!raster)
        return NULL;
    view_init(&raster->view, camera);
    raster->ambient = ambient;
    if (image_init(&raster->image, camera->width, camera->height))
        return raster;
    ref_raster_end(raster, NULL);
    return NULL;
}

void ref_raster_add(struct ref_raster *raster, const struct ref_triangle *triangles, size_t n, uint64_t first,
                    int row_first, int row_end)
{
    for (size_t i = 0; i < n; i++) {
        const uint64_t number = first + i < UINT32_MAX ? first + i : UINT32_MAX - 1;
        struct face face;
        if (face_init(&face, &raster->view, &triangles[i], (uint32_t)number, row_first, row_end))
            draw_face(&raster->view, &face, raster->ambient, &raster->image);
    }
}

void ref_raster_end(struct ref_raster *raster, struct ref_image *out)
{
    if (!raster)
        return;
    if (out)
        *out = raster->image;
    else
        ref_image_release(&raster->image);
    free(raster);
}

int ref_raster(const struct ref_triangle *triangles, size_t n, const struct ref_camera *camera,
               double ambient, struct ref_image *out)
{
    struct ref_raster *raster = ref_raster_begin(camera, ambient);
    *out = (struct ref_image){0};
    if (!raster)
        return -1;
    ref_raster_add(raster, triangles, n, 0, 0, camera->height);
    ref_raster_end(raster, out);
    return 0;
}

void ref_image_release(struct ref_image *image)
{
    if (!image)
        return;
    free(image->depth);
    free(image->triangle);
    free(image->rgb);
    *image = (struct ref_image){0};
}

/* One of the two pictures of a comparison: the reference has triangle, the other has cover. */
struct mask {
    const uint32_t *triangle;
    const uint8_t *cover;
    int width, height;
};

static bool covered(const struct mask *mask, int x, int y)
{
    if (x < 0 || x >= mask->width || y < 0 || y >= mask->height)
        return false;
    size_t at = (size_t)y * (size_t)mask->width + (size_t)x;
    return mask->triangle ? mask->triangle[at] != UINT32_MAX : mask->cover[at] != 0;
}

/* Covered pixels of the 3 x 3 neighbourhood; 9 only where all of it lies inside the picture. */
static int covered_around(const struct mask *mask, int x, int y)
{
    int count = 0;
    for (int dy = -1; dy <= 1; dy++)
        for (int dx = -1; dx <= 1; dx++)
            count += covered(mask, x + dx, y + dy) ? 1 : 0;
    return count;
}

static void relax(int *distance, const int *neighbours, int width, int x)
{
    for (int nx = x - 1; nx <= x + 1; nx++)
        if (nx >= 0 && nx < width && neighbours[nx] + 1 < distance[x])
            distance[x] = neighbours[nx] + 1;
}

/*
 * Chebyshev distance to the nearest covered pixel, by one sweep down and one up: exact for this metric.
 * Without a covered pixel every distance is width + height, more than any real one.
 */
static void chebyshev(const struct mask *mask, int *distance)
{
    int width = mask->width, height = mask->height;
    for (int y = 0; y < height; y++) {
        int *row = distance + (size_t)y * (size_t)width;
        for (int x = 0; x < width; x++) {
            row[x] = covered(mask, x, y) ? 0 : width + height;
            if (y > 0)
                relax(row, row - width, width, x);
            if (x > 0 && row[x - 1] + 1 < row[x])
                row[x] = row[x - 1] + 1;
        }
    }
    for (int y = height - 1; y >= 0; y--) {
        int *row = distance + (size_t)y * (size_t)width;
        for (int x = width - 1; x >= 0; x--) {
            if (y < height - 1)
                relax(row, row + width, width, x);
            if (x < width - 1 && row[x + 1] + 1 < row[x])
                row[x] = row[x + 1] + 1;
        }
    }
}

/*
 * An empty reference has no nearest pixel, and a failed allocation finds none: both report the larger side of
 * the picture, one more than the largest real distance, so that neither passes for agreement.
 */
static int extra_px(const struct mask *reference, const struct mask *other)
{
    int width = reference->width, height = reference->height;
    int none = width > height ? width : height, most = 0;
    int *distance = malloc((size_t)width * (size_t)height * sizeof *distance);
    if (distance)
        chebyshev(reference, distance);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            if (!covered(other, x, y) || covered(reference, x, y))
                continue;
            int here = distance ? distance[(size_t)y * (size_t)width + (size_t)x] : none;
            here = here < none ? here : none;
            most = here > most ? here : most;
        }
    free(distance);
    return most;
}

void ref_compare_cover(const struct ref_image *reference, const uint8_t *cover,
                       struct ref_compare *out)
{
    const struct mask ref = {reference->triangle, NULL, reference->width, reference->height};
    const struct mask other = {NULL, cover, reference->width, reference->height};
    uint64_t either = 0, both = 0, matched = 0;
    *out = (struct ref_compare){.hole_x = -1, .hole_y = -1};
    for (int y = 0; y < ref.height; y++)
        for (int x = 0; x < ref.width; x++) {
            bool in_ref = covered(&ref, x, y), in_other = covered(&other, x, y);
            either += in_ref || in_other;
            both += in_ref && in_other;
            if (in_ref || in_other)
                matched += covered_around(in_ref ? &other : &ref, x, y) > 0;
            if (in_other || covered_around(&ref, x, y) < 9)
                continue;
            if (out->holes++ == 0) {
                out->hole_x = x;
                out->hole_y = y;
            }
        }
    out->overlap = either > 0 ? (double)both / (double)either : 1.0;
    out->overlap_tolerant = either > 0 ? (double)matched / (double)either : 1.0;
    out->extra_px_max = extra_px(&ref, &other);
}
