#include "bench_views.h"

#include <math.h>
#include <string.h>

enum { AROUND = 6, CLOSE = 2, INSIDE = AROUND + CLOSE };

static const struct {
    const char *name;
    double azimuth, elevation;      /* degrees */
    double share;                   /* of the framing distance, from the surface */
} VIEWS[BENCH_VIEWS] = {
    {"front", 0, 0, 0}, {"right", 90, 0, 0}, {"back", 180, 0, 0}, {"left", 270, 0, 0},
    {"above", 45, 35, 0}, {"below", 225, -35, 0}, {"near", 45, 35, 1.0 / 4}, {"close", 45, 35, 1.0 / 16},
    {"inside", 0, 0, 0},
};

static const double DEGREE = 3.14159265358979323846 / 180;

bool bench_view_named(const char *word, uint32_t *view)
{
    for (uint32_t v = 0; v < BENCH_VIEWS; v++)
        if (strcmp(word, VIEWS[v].name) == 0) {
            *view = v;
            return true;
        }
    return false;
}

/* How far a point is in front of the camera, and from the axis that it looks along. */
static double from_axis(const struct spv_camera *c, const double p[3], double *ahead)
{
    double d[3], along = 0, square = 0;
    for (int a = 0; a < 3; a++) {
        d[a] = p[a] - c->eye[a];
        along += d[a] * c->forward[a];
    }
    for (int a = 0; a < 3; a++) {
        const double off = d[a] - along * c->forward[a];
        square += off * off;
    }
    *ahead = along;
    return sqrt(square);
}

/* What the camera has before it in the middle: of the points about as near to its axis as any, the nearest. */
static void middle_point(const struct spv_camera *c, const struct spc_header *h, const double (*points)[3],
                         size_t count, double out[3])
{
    double least = HUGE_VAL, nearest = HUGE_VAL, ahead;
    for (int a = 0; a < 3; a++)
        out[a] = h->box_min[a] / 2 + h->box_max[a] / 2;
    for (size_t i = 0; i < count; i++)
        least = fmin(least, from_axis(c, points[i], &ahead));
    for (size_t i = 0; i < count; i++)
        if (from_axis(c, points[i], &ahead) <= 2 * least && ahead < nearest) {
            nearest = ahead;
            memcpy(out, points[i], 3 * sizeof *out);
        }
}

static void reference_of(struct bench_view *v, double distance, double fov_deg)
{
    const struct spv_camera *c = &v->camera;
    v->reference = (struct ref_camera){.fov_y_deg = fov_deg, .width = c->width, .height = c->height};
    for (int a = 0; a < 3; a++) {
        v->reference.eye[a] = c->eye[a];
        v->reference.target[a] = c->eye[a] + distance * c->forward[a];
        v->reference.up[a] = c->up[a];
    }
}

bool bench_views(const struct picture_options *o, const struct spc_header *h, const double (*points)[3],
                 size_t count, struct bench_view views[BENCH_VIEWS])
{
    double half[3], point[3];
    for (int a = 0; a < 3; a++)
        half[a] = h->box_max[a] / 2 - h->box_min[a] / 2;
    for (int v = 0; v < BENCH_VIEWS; v++) {
        struct spv_camera *c = &views[v].camera;
        views[v].name = VIEWS[v].name;
        if (!spv_camera_orbit(c, h->box_min, h->box_max, VIEWS[v].azimuth * DEGREE, VIEWS[v].elevation * DEGREE, 0,
                              o->up, o->fov_deg * DEGREE, o->width, o->height))
            return false;
        const double framing = spv_camera_framing(c, half);
        if (v >= AROUND && v < INSIDE)
            middle_point(c, h, points, count, point);
        for (int a = 0; a < 3 && v >= AROUND && v < INSIDE; a++)
            c->eye[a] = point[a] - VIEWS[v].share * framing * c->forward[a];
        for (int a = 0; a < 3 && v == INSIDE; a++)
            c->eye[a] = h->box_min[a] / 2 + h->box_max[a] / 2;
        reference_of(&views[v], framing, o->fov_deg);
    }
    return true;
}
