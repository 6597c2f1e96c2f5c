/*
 * control.h - from what a user does to where the camera is.
 *
 * A turntable: the eye turns about a pivot and about the vertical axis, without roll. Pointer, wheel
 * and keys come as events, time as steps; there is no clock, no window and no memory beyond the
 * struct. What an event asks of others than the camera is returned as an action.
 *
 *   orbit   left drag. The pivot, at first the middle of the scene, stays on its pixel; one that is
 *           not in the picture is replaced by what the middle of the picture shows.
 *   pan     right or middle drag, or shift and left. The surface that was grabbed stays under the
 *           pointer; where there is none, a plane through the pivot does.
 *   zoom    wheel: what is under the pointer stays there, its distance shrinks by a factor.
 *   fly     keys move by time, at a speed that goes with the distance ahead; dragging looks around.
 *
 * Lengths are file units. Limits keep everything finite and sharp: nothing comes nearer than where a
 * pixel shows 4096 steps of a double at the scene's coordinates, and the eye goes no farther from the
 * scene than a thousand times the distance from which all of it is seen. 4096 steps also keep what
 * rounding moves, eye and target, below a thousandth of a pixel.
 */
#ifndef SPV_CONTROL_H
#define SPV_CONTROL_H

#include "camera.h"
#include "event.h"
#include "keys.h"

/* What keys ask for. The first group is the viewer's, the second the control does itself. */
enum spv_action {
    SPV_ACTION_NONE, SPV_ACTION_BACK, SPV_ACTION_QUIT, SPV_ACTION_HELP, SPV_ACTION_STATISTICS,
    SPV_ACTION_FINER, SPV_ACTION_COARSER, SPV_ACTION_MODE, SPV_ACTION_SPLAT, SPV_ACTION_PAINT,
    SPV_ACTION_FREEZE, SPV_ACTION_OCCLUSION, SPV_ACTION_ANTIALIAS, SPV_ACTION_RENDERER,
    SPV_ACTION_SCREENSHOT, SPV_ACTION_COPY, SPV_ACTION_PASTE, SPV_ACTION_NEXT, SPV_ACTION_FULLSCREEN,

    SPV_ACTION_OWN, SPV_ACTION_FIT = SPV_ACTION_OWN, SPV_ACTION_HOME,
    SPV_ACTION_FRONT, SPV_ACTION_VIEW_BACK, SPV_ACTION_LEFT, SPV_ACTION_RIGHT, SPV_ACTION_TOP, SPV_ACTION_BOTTOM,
    SPV_ACTION_TURN_LEFT, SPV_ACTION_TURN_RIGHT, SPV_ACTION_TURN_UP, SPV_ACTION_TURN_DOWN,
    SPV_ACTION_ZOOM_IN, SPV_ACTION_ZOOM_OUT, SPV_ACTION_FLY,
    SPV_ACTION_AHEAD, SPV_ACTION_ASTERN, SPV_ACTION_PORT, SPV_ACTION_STARBOARD, SPV_ACTION_SINK, SPV_ACTION_RISE
};

/*
 * How far the surface under a pixel is.
 *
 * in     camera   as it is now; the picture last drawn may show an earlier one
 * out    *depth   along camera->forward;  (return) false: nothing is there
 */
typedef bool (*spv_depth_fn)(void *ctx, const struct spv_camera *camera, double x, double y, double *depth);

struct spv_pose {                   /* as spc-render takes it; text and camera are made from this alone */
    double eye[3], target[3], up[3];
    double fov_deg;
};

struct spv_stance {                 /* where the camera is, by its pivot */
    double azimuth, elevation, roll;            /* rad; roll only of a camera that was given */
    double pivot[3];                /* file units */
    double offset[3];               /* the pivot in view coordinates */
};

struct spv_grip {                   /* a point that keeps its pixel */
    bool holds;
    double x, y, depth;
    double point[3];                /* file units */
};

enum spv_drag { SPV_DRAG_NONE, SPV_DRAG_ORBIT, SPV_DRAG_PAN, SPV_DRAG_LOOK };

struct spv_control {                /* read camera, pose and flying; the rest is the control's */
    struct spv_camera camera;
    struct spv_pose pose;
    bool flying;

    double middle[3], half[3], radius, reach;   /* reach: the largest coordinate */
    double front[3], side[3], vertical[3];
    struct spv_stance at;
    bool changed;
    spv_depth_fn depth;
    void *ctx;

    enum spv_drag drag;
    int button;
    double x, y;                    /* pointer */
    struct spv_grip grabbed, anchor;            /* the wheel goes on towards what it found first */
    double anchor_age;              /* s */
    double left_s;                  /* of an animation; 0: none */
    struct spv_stance from, to;
    unsigned held, modifiers;       /* keys that fly, as bits from SPV_ACTION_AHEAD */
};

/*
 * A camera in front of the scene, all of which it shows.
 *
 * in     box_min <= box_max, file units, up to 1e280; a point is a scene
 *        up        vertical axis, any direction;  fov_deg vertical, 0.01 to 179
 *        depth     may be NULL: nothing is anywhere; ctx is passed to it
 * out    (return)  false when an argument is out of range
 */
bool spv_control_init(struct spv_control *control, const double box_min[3], const double box_max[3],
                      const double up[3], double fov_deg, int width, int height, spv_depth_fn depth, void *ctx);

/* Another scene, same field of view and picture, seen from its front. Fails as init does. */
bool spv_control_scene(struct spv_control *control, const double box_min[3], const double box_max[3],
                       const double up[3]);

/*
 * Takes what the user did. SPV_EVENT_PASTE with text that spv_control_parse takes sets the camera;
 * SPV_EVENT_DROP is left to others. Coordinates that are not finite and empty pictures are ignored.
 *
 * out    (return)  what others have to do, below SPV_ACTION_OWN
 */
enum spv_action spv_control_event(struct spv_control *control, const struct spv_event *event);

/*
 * Lets time pass: flies and animates.
 *
 * in     seconds   since the last step; flying takes at most 0.25 of them
 * out    (return)  whether the camera changed since the last step, by events too
 */
bool spv_control_step(struct spv_control *control, double seconds);

/* Whether the camera moves on without events: an animation runs, or a key that flies is held. */
bool spv_control_moving(const struct spv_control *control);

/* ---- for scripts and options: at once, without animation --------------------------------------- */

/* From azimuth and elevation, degrees, as spv_camera_orbit; distance <= 0: all of the scene is seen. */
void spv_control_orbit(struct spv_control *control, double azimuth_deg, double elevation_deg, double distance);

/* Turns about the pivot, as dragging does. */
void spv_control_turn(struct spv_control *control, double azimuth_deg, double elevation_deg);

/* All of the scene, from where the camera looks now. */
void spv_control_fit(struct spv_control *control);

/* Exactly this pose; the target becomes the pivot. False, and nothing changes, when it is no view. */
bool spv_control_place(struct spv_control *control, const struct spv_pose *pose);

/* ---- words --------------------------------------------------------------------------------------- */

enum { SPV_CONTROL_TEXT = 384, SPV_CONTROL_KEYS = 96 };

/*
 * The camera as spc-render takes it: --eye X,Y,Z --target X,Y,Z --up X,Y,Z --fov DEG, with 17 digits.
 * It draws the same picture. In the C locale, as all numbers of the tools.
 *
 * in     size      of text, bytes; SPV_CONTROL_TEXT is always enough
 * out    (return)  false when it is not: text is then empty
 */
bool spv_control_format(const struct spv_control *control, char *text, size_t size);

/*
 * Sets the camera from such text: the four options in any order, once each, finite numbers, a view.
 * False, and nothing changes, for anything else. What is formatted from then on is the same bit for bit.
 */
bool spv_control_parse(struct spv_control *control, const char *text);

/*
 * Line i of the help: keys that do one thing, and what they do. Words live as long as the program.
 *
 * out    (return)  false past the last line
 */
bool spv_control_help(size_t i, char keys[SPV_CONTROL_KEYS], const char **words);

#endif
