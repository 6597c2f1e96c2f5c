/*
 * control.c - a turntable in view coordinates.
 *
 * The state is two angles, the pivot, and where the pivot lies seen from the eye. Turning changes the
 * angles only, so that the pivot cannot leave its pixel; panning and zooming change only its place,
 * by exact rays of pixels. The eye follows from these, and the camera from eye and target as they are
 * written into text, so that spc-render draws what the window showed.
 */
#include "control.h"

#include <math.h>
#include <string.h>

static const double PI = 3.14159265358979323846;
static const double POLE = 89.99;               /* degrees; dragging ends just short of the poles */
static const double STEP_DEG = 10;              /* of an arrow key */
static const double ZOOM = 0.85;                /* of a step of the wheel */
static const double ANIMATION_S = 0.25;
static const double ANCHOR_S = 0.4;             /* steps of the wheel within this time are one zoom */
static const double SCENE_MAX = 1e280;          /* leaves room for distances that are seen as a pixel */
static const double POSE_MAX = 1e295;

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double length(const double v[3])
{
    return hypot(hypot(v[0], v[1]), v[2]);
}

static double largest(const double v[3])
{
    return fmax(fabs(v[0]), fmax(fabs(v[1]), fabs(v[2])));
}

static bool finite3(const double v[3])
{
    return isfinite(v[0]) && isfinite(v[1]) && isfinite(v[2]);
}

/* ---- limits --------------------------------------------------------------------------------------- */

/* Least distance of what is looked at where coordinates go up to reach: control.h says why. */
static double nearest_at(const struct spv_control *c, double reach)
{
    const double x = c->camera.width / (2 * c->camera.focal_px);
    const double y = c->camera.height / (2 * c->camera.focal_px);
    return fmax(4096 * 0x1p-52 * c->camera.focal_px * (1 + x * x + y * y) * reach, 1e-280);
}

static double nearest(const struct spv_control *c)
{
    return nearest_at(c, c->reach);
}

static double farthest(const struct spv_control *c)
{
    const double least = fmin(c->camera.width, c->camera.height) / (2 * c->camera.focal_px);
    return 1000 * fmax(c->radius * (1 + 1 / least), 1000 * nearest(c));
}

static double eye_distance(const struct spv_control *c, const double eye[3])
{
    const double d[3] = {eye[0] - c->middle[0], eye[1] - c->middle[1], eye[2] - c->middle[2]};
    return length(d);
}

/* Where the surface, or else the plane through the pivot, lies under a pixel. */
static bool surface_at(const struct spv_control *c, double x, double y, double *depth)
{
    double z = NAN;
    if (c->depth == NULL || !c->depth(c->ctx, &c->camera, x, y, &z) || !(z > 0))
        return false;
    *depth = fmin(fmax(z, nearest(c)), 2 * farthest(c));
    return true;
}

static double depth_at(const struct spv_control *c, double x, double y)
{
    double depth;
    if (surface_at(c, x, y, &depth))
        return depth;
    depth = c->at.offset[2];
    if (!(depth >= nearest(c)))     /* the pivot is behind the eye */
        depth = fmax(eye_distance(c, c->pose.eye), nearest(c));
    return fmin(depth, 2 * farthest(c));
}

/* View coordinates of what a pixel shows, at depth 1. */
static void ray_of(const struct spv_control *c, double x, double y, double ray[3])
{
    ray[0] = (x - c->camera.width / 2.0) / c->camera.focal_px;
    ray[1] = (c->camera.height / 2.0 - y) / c->camera.focal_px;
    ray[2] = 1;
}

/* ---- from stance to camera, and back ---------------------------------------------------------------- */

static bool axes_of(const struct spv_control *c, const struct spv_stance *at, struct spv_camera *axes)
{
    static const double origin[3] = {0, 0, 0};
    double toward[3], top[3];
    spv_camera_turn(c->front, c->side, c->vertical, at->azimuth, at->elevation, toward, top);
    if (!spv_camera_look(axes, toward, origin, top, c->pose.fov_deg * (PI / 180), c->camera.width,
                         c->camera.height))
        return false;
    if (at->roll != 0) {
        for (int a = 0; a < 3; a++)
            top[a] = cos(at->roll) * axes->up[a] + sin(at->roll) * axes->right[a];
        return spv_camera_look(axes, toward, origin, top, c->pose.fov_deg * (PI / 180), c->camera.width,
                               c->camera.height);
    }
    return true;
}

/* What lies at eye in view coordinates of the axes is at p. */
static void to_view(const struct spv_camera *axes, const double eye[3], const double p[3], double out[3])
{
    const double d[3] = {p[0] - eye[0], p[1] - eye[1], p[2] - eye[2]};
    out[0] = dot(d, axes->right);
    out[1] = dot(d, axes->up);
    out[2] = dot(d, axes->forward);
}

static void from_view(const struct spv_camera *axes, const double eye[3], const double v[3], double out[3])
{
    for (int a = 0; a < 3; a++)
        out[a] = eye[a] + (v[0] * axes->right[a] + v[1] * axes->up[a] + v[2] * axes->forward[a]);
}

/* An eye that would go beyond the limit stays on it; one that was put beyond comes no farther. */
static void keep_in_reach(const struct spv_control *c, const struct spv_camera *axes, struct spv_stance *at,
                          double eye[3])
{
    const double limit = fmax(farthest(c), eye_distance(c, c->pose.eye));
    const double distance = eye_distance(c, eye);
    if (!(distance > limit))
        return;
    for (int a = 0; a < 3; a++)
        eye[a] = c->middle[a] + (eye[a] - c->middle[a]) * (limit / distance);
    to_view(axes, eye, at->pivot, at->offset);
}

/* The vertical axis reads better than what is exactly up, and means the same unless the view is steep. */
static void choose_up(const struct spv_control *c, const struct spv_stance *at, const struct spv_camera *axes,
                      double up[3])
{
    const bool plain = at->roll == 0 && fabs(at->elevation) < PI / 3;
    for (int a = 0; a < 3; a++)
        up[a] = (plain ? c->vertical[a] : axes->up[a]) + 0.0;   /* no minus before a zero */
}

/*
 * Takes a new stance, and the eye that it means where that is known better than from a pivot that may be
 * far away, else NULL. One that is no view leaves everything as it was.
 */
static bool take_with(struct spv_control *c, const struct spv_stance *stance, const double *eye)
{
    struct spv_stance at = *stance;
    struct spv_pose pose = c->pose;
    struct spv_camera axes, camera;
    if (!finite3(at.pivot) || !finite3(at.offset) || !axes_of(c, &at, &axes))
        return false;
    const double back[3] = {-at.offset[0], -at.offset[1], -at.offset[2]};
    from_view(&axes, at.pivot, back, pose.eye);
    if (eye != NULL)
        memcpy(pose.eye, eye, sizeof pose.eye);
    keep_in_reach(c, &axes, &at, pose.eye);
    /* As far as the pivot, unless rounding would then turn the view by what can be seen. */
    double ahead = at.offset[2] >= nearest(c) ? at.offset[2] : c->radius;
    ahead = fmax(ahead, 16 * nearest_at(c, fmax(c->reach, largest(pose.eye))));
    const double target[3] = {0, 0, ahead};
    from_view(&axes, pose.eye, target, pose.target);
    choose_up(c, &at, &axes, pose.up);
    if (!finite3(pose.eye) || !finite3(pose.target) || !finite3(at.offset) ||
        !spv_camera_look(&camera, pose.eye, pose.target, pose.up, pose.fov_deg * (PI / 180), c->camera.width,
                         c->camera.height))
        return false;
    c->at = at;
    c->pose = pose;
    c->camera = camera;
    c->changed = true;
    c->grabbed.holds = c->anchor.holds = false;
    return true;
}

static bool take(struct spv_control *c, const struct spv_stance *stance)
{
    return take_with(c, stance, NULL);
}

/* Angles of a camera that was given by its axes. */
static void angles_of(const struct spv_control *c, const struct spv_camera *camera, struct spv_stance *at)
{
    const double f = -dot(camera->forward, c->front), s = -dot(camera->forward, c->side);
    const double v = -dot(camera->forward, c->vertical);
    struct spv_camera level;
    at->elevation = atan2(v, hypot(f, s));
    at->azimuth = atan2(s, f);
    if (hypot(f, s) < 1e-9)         /* straight up or down: the picture's top tells */
        at->azimuth = v > 0 ? atan2(-dot(camera->up, c->side), -dot(camera->up, c->front))
                            : atan2(dot(camera->up, c->side), dot(camera->up, c->front));
    at->roll = 0;
    if (axes_of(c, at, &level))
        at->roll = atan2(dot(camera->up, level.right), dot(camera->up, level.up));
    if (fabs(at->roll) < 1e-7)
        at->roll = 0;               /* rounding of the text */
}

bool spv_control_place(struct spv_control *c, const struct spv_pose *pose)
{
    struct spv_camera camera;
    if (!finite3(pose->eye) || !finite3(pose->target) || !finite3(pose->up) ||
        !(largest(pose->eye) <= POSE_MAX) || !(largest(pose->target) <= POSE_MAX) ||
        !(pose->fov_deg >= 0.01 && pose->fov_deg <= 179))
        return false;
    if (!spv_camera_look(&camera, pose->eye, pose->target, pose->up, pose->fov_deg * (PI / 180),
                         c->camera.width, c->camera.height))
        return false;
    c->pose = *pose;
    c->camera = camera;
    angles_of(c, &camera, &c->at);
    memcpy(c->at.pivot, pose->target, sizeof c->at.pivot);
    to_view(&camera, pose->eye, pose->target, c->at.offset);
    c->left_s = 0;
    c->grabbed.holds = c->anchor.holds = false;
    c->changed = true;
    return true;
}

/* ---- fits and animations ------------------------------------------------------------------------------ */

/* The same view, told from another pivot. */
static void set_pivot(struct spv_control *c, const double pivot[3])
{
    if (!finite3(pivot))
        return;
    memcpy(c->at.pivot, pivot, sizeof c->at.pivot);
    to_view(&c->camera, c->pose.eye, pivot, c->at.offset);
}

static void fitted(const struct spv_control *c, double azimuth, double elevation, double distance,
                   struct spv_stance *at)
{
    struct spv_camera axes;
    *at = (struct spv_stance){.azimuth = azimuth, .elevation = elevation};
    memcpy(at->pivot, c->middle, sizeof at->pivot);
    if (!(distance > 0) && axes_of(c, at, &axes))
        distance = fmax(spv_camera_framing(&axes, c->half), 2 * nearest(c));
    at->offset[2] = fmin(fmax(distance, nearest(c)), farthest(c));
}

/* c->at, whose pivot is that of to already, goes to to. */
static void animate(struct spv_control *c, const struct spv_stance *to)
{
    c->from = c->at;
    c->to = *to;
    /* The short way round. */
    c->to.azimuth = c->from.azimuth + remainder(to->azimuth - c->from.azimuth, 2 * PI);
    c->left_s = ANIMATION_S;
}

static void animate_fit(struct spv_control *c, double azimuth, double elevation)
{
    struct spv_stance to;
    fitted(c, azimuth, elevation, 0, &to);
    set_pivot(c, to.pivot);
    animate(c, &to);
}

/* Distances by their ratio, so that a long way looks even; behind the eye there is none. */
static void blend_offset(const struct spv_stance *from, const struct spv_stance *to, double t, double out[3])
{
    const double a = from->offset[2], b = to->offset[2];
    if (a > 0.1 * length(from->offset) && b > 0.1 * length(to->offset)) {
        const double z = a * pow(b / a, t);
        for (int i = 0; i < 2; i++)
            out[i] = z * (from->offset[i] / a * (1 - t) + to->offset[i] / b * t);
        out[2] = z;
        return;
    }
    for (int i = 0; i < 3; i++)
        out[i] = from->offset[i] * (1 - t) + to->offset[i] * t;
}

static void step_animation(struct spv_control *c, double seconds)
{
    c->left_s = fmax(c->left_s - seconds, 0);
    if (!(c->left_s > 0)) {
        struct spv_stance to = c->to;
        to.azimuth = remainder(to.azimuth, 2 * PI);
        take(c, &to);
        return;
    }
    const double rest = c->left_s / ANIMATION_S;
    const double t = 1 - rest * rest * rest;            /* fast first, then it settles */
    struct spv_stance at = c->to;
    at.azimuth = c->from.azimuth + (c->to.azimuth - c->from.azimuth) * t;
    at.elevation = c->from.elevation + (c->to.elevation - c->from.elevation) * t;
    at.roll = c->from.roll + (c->to.roll - c->from.roll) * t;
    blend_offset(&c->from, &c->to, t, at.offset);
    take(c, &at);
}

void spv_control_orbit(struct spv_control *c, double azimuth_deg, double elevation_deg, double distance)
{
    struct spv_stance at;
    if (!isfinite(azimuth_deg) || !isfinite(elevation_deg))
        return;
    fitted(c, remainder(azimuth_deg, 360) * (PI / 180), remainder(elevation_deg, 360) * (PI / 180), distance, &at);
    c->left_s = 0;
    take(c, &at);
}

void spv_control_fit(struct spv_control *c)
{
    struct spv_stance at;
    fitted(c, c->at.azimuth, c->at.elevation, 0, &at);
    c->left_s = 0;
    take(c, &at);
}

/* ---- drags, wheel --------------------------------------------------------------------------------------- */

static void turn(struct spv_control *c, double azimuth, double elevation)
{
    const double pole = POLE * (PI / 180);
    struct spv_stance at = c->at;
    at.azimuth = remainder(at.azimuth + azimuth, 2 * PI);
    at.elevation = fmin(fmax(at.elevation + elevation, -pole), pole);
    c->left_s = 0;
    take(c, &at);
}

void spv_control_turn(struct spv_control *c, double azimuth_deg, double elevation_deg)
{
    if (isfinite(azimuth_deg) && isfinite(elevation_deg))
        turn(c, remainder(azimuth_deg, 360) * (PI / 180), elevation_deg * (PI / 180));
}

/* Takes hold of what is at depth under a pixel. */
static void grip(const struct spv_control *c, struct spv_grip *g, double x, double y, double depth)
{
    double p[3];
    ray_of(c, x, y, p);
    for (int a = 0; a < 3; a++)
        p[a] *= depth;
    from_view(&c->camera, c->pose.eye, p, g->point);
    g->x = x;
    g->y = y;
    g->depth = depth;
    g->holds = true;
}

/*
 * Brings the point to depth under a pixel. From the point each time: steps that add up would round each
 * time, by as much as the pivot is far.
 */
static bool carry(struct spv_control *c, const struct spv_grip *g, double x, double y, double depth)
{
    struct spv_stance at = c->at;
    struct spv_camera axes;
    double back[3], eye[3];
    if (!axes_of(c, &at, &axes))
        return false;
    ray_of(c, x, y, back);
    for (int a = 0; a < 3; a++)
        back[a] *= -depth;
    from_view(&axes, g->point, back, eye);
    /* At the outer limit it stops, rather than slide along it. */
    if (eye_distance(c, eye) > fmax(farthest(c), eye_distance(c, c->pose.eye)))
        return false;
    to_view(&axes, eye, at.pivot, at.offset);
    return take(c, &at);
}

/* Turning about what cannot be seen confuses: then about what the middle of the picture shows. */
static void need_pivot(struct spv_control *c)
{
    const double *o = c->at.offset;
    const double z = c->camera.focal_px / o[2];
    if (o[2] >= nearest(c) && fabs(o[0] * z) <= c->camera.width / 2.0 && fabs(o[1] * z) <= c->camera.height / 2.0)
        return;
    struct spv_grip g;
    const double x = c->camera.width / 2.0, y = c->camera.height / 2.0;
    grip(c, &g, x, y, depth_at(c, x, y));
    set_pivot(c, g.point);
}

/* Turns the view about the eye; the pivot stays in the scene. */
static void look(struct spv_control *c, double azimuth, double elevation)
{
    const double pole = POLE * (PI / 180);
    struct spv_stance at = c->at;
    struct spv_camera axes;
    at.azimuth = remainder(at.azimuth + azimuth, 2 * PI);
    at.elevation = fmin(fmax(at.elevation + elevation, -pole), pole);
    if (!axes_of(c, &at, &axes))
        return;
    const double eye[3] = {c->pose.eye[0], c->pose.eye[1], c->pose.eye[2]};
    to_view(&axes, eye, at.pivot, at.offset);
    c->left_s = 0;
    take_with(c, &at, eye);
}

static void pan(struct spv_control *c, double from_x, double from_y, double x, double y)
{
    if (!c->grabbed.holds)          /* something else moved the camera */
        grip(c, &c->grabbed, from_x, from_y, depth_at(c, from_x, from_y));
    c->grabbed.holds = carry(c, &c->grabbed, x, y, c->grabbed.depth);
}

static void press(struct spv_control *c, const struct spv_event *e)
{
    const bool left = e->button == SPV_BUTTON_LEFT;
    c->left_s = 0;
    c->button = e->button;
    c->drag = !left || (e->modifiers & SPV_SHIFT && !c->flying) ? SPV_DRAG_PAN
        : c->flying ? SPV_DRAG_LOOK : SPV_DRAG_ORBIT;
    if (c->drag == SPV_DRAG_PAN)
        grip(c, &c->grabbed, c->x, c->y, depth_at(c, c->x, c->y));
    else if (c->drag == SPV_DRAG_ORBIT)
        need_pivot(c);
}

/* The point under the pointer becomes the pivot and comes to the middle, as far away as it is. */
static void centre(struct spv_control *c)
{
    double depth;
    struct spv_grip g;
    c->drag = SPV_DRAG_NONE;        /* a hand that trembles must not stop it */
    if (!surface_at(c, c->x, c->y, &depth))
        return;
    grip(c, &g, c->x, c->y, depth);
    set_pivot(c, g.point);
    struct spv_stance to = c->at;
    to.offset[0] = to.offset[1] = 0;
    to.offset[2] = depth;
    animate(c, &to);
}

static void drag(struct spv_control *c, double x, double y)
{
    const double from_x = c->x, from_y = c->y;
    c->x = x;
    c->y = y;
    const double turned = PI / c->camera.height;
    const double looked = fmin(turned, 1 / c->camera.focal_px);
    if (c->drag == SPV_DRAG_ORBIT)
        turn(c, -(x - from_x) * turned, (y - from_y) * turned);
    else if (c->drag == SPV_DRAG_LOOK)
        look(c, -(x - from_x) * looked, (y - from_y) * looked);
    else if (c->drag == SPV_DRAG_PAN)
        pan(c, from_x, from_y, x, y);
}

/* All distances from what is under the pixel shrink; the pixel goes on showing it. */
static void zoom(struct spv_control *c, double x, double y, double steps)
{
    struct spv_grip *const g = &c->anchor;
    /* The picture last drawn may be older than the last step: what was found first counts. */
    if (!g->holds || fabs(x - g->x) > 2 || fabs(y - g->y) > 2)
        grip(c, g, x, y, depth_at(c, x, y));
    double depth = g->depth * pow(ZOOM, fmin(fmax(steps, -50), 50));
    if (steps > 0)
        depth = fmin(fmax(depth, nearest(c)), g->depth);
    c->left_s = 0;
    g->holds = carry(c, g, g->x, g->y, depth);
    g->depth = depth;
    c->anchor_age = 0;
}

/* ---- keys ------------------------------------------------------------------------------------------------ */

enum { REPEATS = 1, ANY_SHIFT = 2, FLIES = 4 };     /* while it is held; whether shifted or not; only in flight */

/* The one table of keys: what they do and what the help says. Without words: the line above has them. */
static const struct row {
    int key;                        /* 0: pointer, named by keys */
    unsigned modifiers, flags;
    enum spv_action action;
    const char *keys, *words;
} ROWS[] = {
    {0, 0, 0, SPV_ACTION_NONE, "Left drag", "turn about the pivot (flying: look around)"},
    {0, 0, 0, SPV_ACTION_NONE, "Right drag, Shift+Left drag", "move what was grabbed"},
    {0, 0, 0, SPV_ACTION_NONE, "Wheel", "towards what is under the pointer, or away"},
    {0, 0, 0, SPV_ACTION_NONE, "Double click", "turn about this point from now on"},
    {SPV_KEY_LEFT, 0, REPEATS, SPV_ACTION_TURN_LEFT, NULL, "turn by steps"},
    {SPV_KEY_RIGHT, 0, REPEATS, SPV_ACTION_TURN_RIGHT, NULL, NULL},
    {SPV_KEY_UP, 0, REPEATS, SPV_ACTION_TURN_UP, NULL, NULL},
    {SPV_KEY_DOWN, 0, REPEATS, SPV_ACTION_TURN_DOWN, NULL, NULL},
    {SPV_KEY_PAGE_UP, 0, REPEATS, SPV_ACTION_ZOOM_IN, NULL, "towards the middle of the picture, or away"},
    {SPV_KEY_PAGE_DOWN, 0, REPEATS, SPV_ACTION_ZOOM_OUT, NULL, NULL},
    {'f', 0, 0, SPV_ACTION_FIT, NULL, "show all of the model"},
    {SPV_KEY_HOME, 0, 0, SPV_ACTION_HOME, NULL, "show all of it, from its front"},
    {'1', 0, 0, SPV_ACTION_FRONT, NULL, "from the front, the back, left, right, above, below"},
    {'2', 0, 0, SPV_ACTION_VIEW_BACK, NULL, NULL},
    {'3', 0, 0, SPV_ACTION_LEFT, NULL, NULL},
    {'4', 0, 0, SPV_ACTION_RIGHT, NULL, NULL},
    {'5', 0, 0, SPV_ACTION_TOP, NULL, NULL},
    {'6', 0, 0, SPV_ACTION_BOTTOM, NULL, NULL},
    {'v', 0, 0, SPV_ACTION_FLY, NULL, "fly, or turn about the pivot again"},
    {'w', 0, FLIES, SPV_ACTION_AHEAD, NULL, "flying: ahead, left, back, right, down, up; Shift faster, Ctrl slower"},
    {'a', 0, FLIES, SPV_ACTION_PORT, NULL, NULL},
    {'s', 0, FLIES, SPV_ACTION_ASTERN, NULL, NULL},
    {'d', 0, FLIES, SPV_ACTION_STARBOARD, NULL, NULL},
    {'q', 0, FLIES, SPV_ACTION_SINK, NULL, NULL},
    {'e', 0, FLIES, SPV_ACTION_RISE, NULL, NULL},
    {'+', 0, REPEATS | ANY_SHIFT, SPV_ACTION_FINER, NULL, "finer: less error on screen"},
    {'=', 0, REPEATS | ANY_SHIFT, SPV_ACTION_FINER, NULL, NULL},
    {']', 0, REPEATS, SPV_ACTION_FINER, NULL, NULL},
    {'-', 0, REPEATS, SPV_ACTION_COARSER, NULL, "coarser: more error, faster"},
    {'[', 0, REPEATS, SPV_ACTION_COARSER, NULL, NULL},
    {'m', 0, 0, SPV_ACTION_MODE, NULL, "hybrid, points, triangles"},
    {'p', 0, 0, SPV_ACTION_SPLAT, NULL, "outline of splats: exact, fast"},
    {'c', 0, 0, SPV_ACTION_PAINT, NULL, "colour by cluster, level, normal cluster, points and triangles"},
    {'a', 0, 0, SPV_ACTION_ANTIALIAS, NULL, "smooth edges while nothing moves"},
    {'x', 0, 0, SPV_ACTION_FREEZE, NULL, "keep what is drawn, to see it from elsewhere"},
    {'o', 0, 0, SPV_ACTION_OCCLUSION, NULL, "skip what is hidden, or not"},
    {'r', 0, 0, SPV_ACTION_RENDERER, NULL, "draw by graphics card or processor"},
    {'i', 0, 0, SPV_ACTION_STATISTICS, NULL, "line of statistics"},
    {'n', 0, 0, SPV_ACTION_NEXT, NULL, "next archive"},
    {'s', SPV_CONTROL, 0, SPV_ACTION_SCREENSHOT, NULL, "save the picture"},
    {SPV_KEY_F12, 0, 0, SPV_ACTION_SCREENSHOT, NULL, NULL},
    {'c', SPV_CONTROL, 0, SPV_ACTION_COPY, NULL, "copy the camera, as options of spc-render"},
    {'v', SPV_CONTROL, 0, SPV_ACTION_PASTE, NULL, "take the camera from such text"},
    {SPV_KEY_F1 + 10, 0, 0, SPV_ACTION_FULLSCREEN, NULL, "whole screen, or window"},
    {'h', 0, 0, SPV_ACTION_HELP, NULL, "this help"},
    {SPV_KEY_F1, 0, 0, SPV_ACTION_HELP, NULL, NULL},
    {SPV_KEY_ESCAPE, 0, 0, SPV_ACTION_BACK, NULL, "end the flight, close the help, or quit"},
    {'q', 0, 0, SPV_ACTION_QUIT, NULL, "quit (flying: Ctrl+Q)"},
    {'q', SPV_CONTROL, 0, SPV_ACTION_QUIT, NULL, NULL},
};
enum { ROW_COUNT = sizeof ROWS / sizeof *ROWS };

/* In flight the keys that fly come first, with Shift and Ctrl as well: faster, slower. */
static const struct row *find_row(const struct spv_control *c, const struct spv_event *e)
{
    for (int pass = 0; pass < 2; pass++)
        for (const struct row *r = ROWS; r < ROWS + ROW_COUNT; r++) {
            const unsigned ignored = r->flags & ANY_SHIFT ? SPV_SHIFT : 0;
            if (r->key == 0 || r->key != e->key || (r->flags & FLIES ? !c->flying || pass == 1 : pass == 0))
                continue;
            if (r->flags & FLIES ? !(e->modifiers & SPV_ALT) && !(r->key == 'q' && e->modifiers & SPV_CONTROL)
                                 : (e->modifiers & ~ignored) == r->modifiers)
                return r;
        }
    return NULL;
}

static void set_flying(struct spv_control *c, bool flying)
{
    c->flying = flying;
    c->held = 0;
    c->drag = SPV_DRAG_NONE;
    c->left_s = 0;
}

static void turn_by_key(struct spv_control *c, double azimuth_deg, double elevation_deg)
{
    const double degree = PI / 180;
    if (c->flying)
        look(c, -azimuth_deg * degree, -elevation_deg * degree);
    else {
        need_pivot(c);
        turn(c, azimuth_deg * degree, elevation_deg * degree);
    }
}

static void do_own(struct spv_control *c, enum spv_action action)
{
    const double x = c->camera.width / 2.0, y = c->camera.height / 2.0;
    switch (action) {
    case SPV_ACTION_FIT: animate_fit(c, c->at.azimuth, c->at.elevation); break;
    case SPV_ACTION_HOME:
    case SPV_ACTION_FRONT: animate_fit(c, 0, 0); break;
    case SPV_ACTION_VIEW_BACK: animate_fit(c, PI, 0); break;
    case SPV_ACTION_LEFT: animate_fit(c, -PI / 2, 0); break;
    case SPV_ACTION_RIGHT: animate_fit(c, PI / 2, 0); break;
    case SPV_ACTION_TOP: animate_fit(c, 0, PI / 2); break;
    case SPV_ACTION_BOTTOM: animate_fit(c, 0, -PI / 2); break;
    case SPV_ACTION_TURN_LEFT: turn_by_key(c, -STEP_DEG, 0); break;
    case SPV_ACTION_TURN_RIGHT: turn_by_key(c, STEP_DEG, 0); break;
    case SPV_ACTION_TURN_UP: turn_by_key(c, 0, STEP_DEG); break;
    case SPV_ACTION_TURN_DOWN: turn_by_key(c, 0, -STEP_DEG); break;
    case SPV_ACTION_ZOOM_IN: zoom(c, x, y, 1); break;
    case SPV_ACTION_ZOOM_OUT: zoom(c, x, y, -1); break;
    case SPV_ACTION_FLY: set_flying(c, !c->flying); break;
    default: break;
    }
}

static enum spv_action key_down(struct spv_control *c, const struct spv_event *e)
{
    const struct row *r = find_row(c, e);
    c->modifiers = e->modifiers;
    if (r == NULL || (e->repeats && !(r->flags & (REPEATS | FLIES))))
        return SPV_ACTION_NONE;
    if (r->flags & FLIES) {
        c->held |= 1u << (r->action - SPV_ACTION_AHEAD);
        c->left_s = 0;
        return SPV_ACTION_NONE;
    }
    if (r->action == SPV_ACTION_BACK && c->flying) {
        set_flying(c, false);
        return SPV_ACTION_NONE;
    }
    if (r->action < SPV_ACTION_OWN)
        return r->action;
    do_own(c, r->action);
    return SPV_ACTION_NONE;
}

static void key_up(struct spv_control *c, const struct spv_event *e)
{
    c->modifiers = e->modifiers;
    for (const struct row *r = ROWS; r < ROWS + ROW_COUNT; r++)
        if (r->flags & FLIES && r->key == e->key)
            c->held &= ~(1u << (r->action - SPV_ACTION_AHEAD));
}

bool spv_control_help(size_t i, char keys[SPV_CONTROL_KEYS], const char **words)
{
    const struct row *r = ROWS, *end = ROWS + ROW_COUNT;
    for (; r < end; r++)
        if (r->words != NULL && i-- == 0)
            break;
    if (r == end)
        return false;
    *words = r->words;
    keys[0] = '\0';
    do {
        char one[SPV_KEY_TEXT];
        const char *text = r->key == 0 ? r->keys : spv_key_text(r->key, r->modifiers, one);
        if (strlen(keys) + strlen(text) + 3 > SPV_CONTROL_KEYS)
            break;
        if (keys[0] != '\0')
            strcat(keys, ", ");
        strcat(keys, text);
    } while (++r < end && r->words == NULL);
    return true;
}

/* ---- events and time --------------------------------------------------------------------------------------- */

static void resize(struct spv_control *c, int width, int height)
{
    const struct spv_pose *p = &c->pose;
    struct spv_camera camera;
    if (width <= 0 || height <= 0 || width > 1 << 20 || height > 1 << 20 ||
        (width == c->camera.width && height == c->camera.height) ||
        !spv_camera_look(&camera, p->eye, p->target, p->up, p->fov_deg * (PI / 180), width, height))
        return;
    c->camera = camera;
    c->drag = SPV_DRAG_NONE;        /* its pixels are others now */
    c->grabbed.holds = c->anchor.holds = false;
    c->changed = true;
}

static void button_down(struct spv_control *c, const struct spv_event *e)
{
    c->x = e->x;
    c->y = e->y;
    if (e->button == SPV_BUTTON_LEFT && e->clicks == 2 && !c->flying)
        centre(c);
    else
        press(c, e);
}

enum spv_action spv_control_event(struct spv_control *c, const struct spv_event *event)
{
    struct spv_event e = *event;
    const bool points = e.kind == SPV_EVENT_BUTTON || e.kind == SPV_EVENT_MOVE || e.kind == SPV_EVENT_WHEEL;
    if (points && (!isfinite(e.x) || !isfinite(e.y)))
        return SPV_ACTION_NONE;
    e.x = fmin(fmax(e.x, -1e6), 1e6);
    e.y = fmin(fmax(e.y, -1e6), 1e6);
    switch (e.kind) {
    case SPV_EVENT_KEY: return key_down(c, &e);
    case SPV_EVENT_KEY_UP: key_up(c, &e); break;
    case SPV_EVENT_BUTTON: button_down(c, &e); break;
    case SPV_EVENT_BUTTON_UP:
        if (e.button == c->button)
            c->drag = SPV_DRAG_NONE;
        break;
    case SPV_EVENT_MOVE: drag(c, e.x, e.y); break;
    case SPV_EVENT_WHEEL:
        if (isfinite(e.steps) && e.steps != 0)
            zoom(c, e.x, e.y, e.steps);
        break;
    case SPV_EVENT_RESIZE: resize(c, e.width, e.height); break;
    case SPV_EVENT_PASTE:
        if (e.path != NULL)
            spv_control_parse(c, e.path);
        break;
    case SPV_EVENT_CLOSE: return SPV_ACTION_QUIT;
    case SPV_EVENT_DROP: break;
    }
    return SPV_ACTION_NONE;
}

/* Opposite keys cancel. Half of what lies ahead at most, so that a slow frame does not fly through it. */
static void fly(struct spv_control *c, double seconds)
{
    double way[3], depth = 0, vertical[3];
    static const double origin[3] = {0, 0, 0};
    const double ahead = (c->held & 1) - (double)(c->held >> 1 & 1);
    const double aside = (double)(c->held >> 3 & 1) - (c->held >> 2 & 1);
    const double above = (double)(c->held >> 5 & 1) - (c->held >> 4 & 1);
    to_view(&c->camera, origin, c->vertical, vertical);
    for (int a = 0; a < 3; a++)
        way[a] = above * vertical[a];
    way[0] += aside;
    way[2] += ahead;
    const double outside = eye_distance(c, c->pose.eye) - c->radius;
    if (!surface_at(c, c->camera.width / 2.0, c->camera.height / 2.0, &depth))
        depth = fmax(outside, c->radius / 4);
    depth = fmax(fmin(depth, farthest(c)), fmax(c->radius * 1e-4, nearest(c)));
    const double speed = depth * (c->modifiers & SPV_SHIFT ? 4 : 1) / (c->modifiers & SPV_CONTROL ? 4 : 1);
    const double by = fmin(speed * fmin(seconds, 0.25), depth / 2);
    struct spv_stance at = c->at;
    for (int a = 0; a < 3; a++)
        at.offset[a] -= way[a] * by;
    if (way[0] != 0 || way[1] != 0 || way[2] != 0)
        take(c, &at);
}

bool spv_control_step(struct spv_control *c, double seconds)
{
    if (!(seconds > 0))
        seconds = 0;
    c->anchor_age += seconds;
    if (c->anchor_age > ANCHOR_S)
        c->anchor.holds = false;
    if (c->left_s > 0)
        step_animation(c, seconds);
    else if (c->flying && c->held != 0 && seconds > 0)
        fly(c, seconds);
    const bool changed = c->changed;
    c->changed = false;
    return changed;
}

bool spv_control_moving(const struct spv_control *c)
{
    return c->left_s > 0 || (c->flying && c->held != 0);
}

/* ---- begin --------------------------------------------------------------------------------------------------- */

bool spv_control_scene(struct spv_control *c, const double box_min[3], const double box_max[3],
                       const double up[3])
{
    if (!finite3(box_min) || !finite3(box_max) || !finite3(up) || !(largest(up) > 0) ||
        !(largest(box_min) <= SCENE_MAX) || !(largest(box_max) <= SCENE_MAX))
        return false;
    for (int a = 0; a < 3; a++)
        if (box_min[a] > box_max[a])
            return false;
    spv_camera_basis(up, c->front, c->side, c->vertical);
    for (int a = 0; a < 3; a++) {
        c->middle[a] = box_min[a] / 2 + box_max[a] / 2;
        c->half[a] = box_max[a] / 2 - box_min[a] / 2;
    }
    c->radius = length(c->half) > 0 ? length(c->half) : 1;
    c->reach = fmax(c->radius, fmax(largest(box_min), largest(box_max)));
    memcpy(c->pose.eye, c->middle, sizeof c->pose.eye);
    set_flying(c, false);
    struct spv_stance at;
    fitted(c, 0, 0, 0, &at);
    return take(c, &at);
}

bool spv_control_init(struct spv_control *c, const double box_min[3], const double box_max[3],
                      const double up[3], double fov_deg, int width, int height, spv_depth_fn depth, void *ctx)
{
    *c = (struct spv_control){.pose.fov_deg = fov_deg, .depth = depth, .ctx = ctx};
    if (!(fov_deg >= 0.01 && fov_deg <= 179) || width <= 0 || height <= 0)
        return false;
    c->camera.width = width;
    c->camera.height = height;
    c->camera.focal_px = height / (2 * tan(fov_deg * (PI / 180) / 2));
    return spv_control_scene(c, box_min, box_max, up);
}
