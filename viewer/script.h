/*
 * script.h - what spc-view is to do without a user: a text, a command a line.
 *
 * All of it is read before any of it is done, so that a fault in the last line costs nothing. Played,
 * it is a row of steps; frames last 1/60 s whatever they take, so that two runs draw the same pictures.
 *
 *   frames N                           draw N frames
 *   wait                               draw until all that is wanted is in memory and as fine as asked for
 *   fit                                show all of the model
 *   orbit AZ EL [DIST]                 degrees around the model, as spc-render --orbit
 *   turn AZ EL FRAMES                  turn by so much over so many frames
 *   eye X Y Z target X Y Z [up X Y Z]  a free camera; without up: the vertical axis
 *   path FRAMES eye X Y Z target X Y Z [up X Y Z]    there from where it is, over so many frames
 *   key NAME [shift] [ctrl] [alt] [FRAMES]           press, hold for so many frames, release
 *   drag left|right|middle X0 Y0 X1 Y1 FRAMES [shift] [ctrl] [alt]
 *   wheel X Y STEPS                    positive: towards what is under the pixel
 *   doubleclick X Y
 *   resize W H                         the picture, px
 *   eps PX                             accepted error on screen
 *   mode hybrid|points|triangles
 *   splat exact|fast
 *   open FILE                          drop a file on the window; the rest of the line is its name
 *   screenshot FILE                    draw a frame and save it; the rest of the line is its name
 *   quit                               no line after it is done
 *
 * Words are parted by spaces or tabs; # begins a comment, but in names of files only after a space.
 * Pixels count from the top left. Names of keys are those of keys.h. Commands draw only as many frames
 * as they name: what is set is seen in the next one.
 */
#ifndef SPV_SCRIPT_H
#define SPV_SCRIPT_H

#include "control.h"

enum {
    SPV_SCRIPT_BYTES = 1 << 20,     /* of a text */
    SPV_SCRIPT_LINE = 4096,         /* bytes of a line */
    SPV_SCRIPT_COMMANDS = 1 << 16,
    SPV_SCRIPT_FRAMES = 1000000     /* of a command */
};
#define SPV_SCRIPT_FRAME_S (1.0 / 60)

enum spv_step_kind {
    SPV_STEP_FRAME,                 /* let SPV_SCRIPT_FRAME_S pass, draw */
    SPV_STEP_WAIT,                  /* draw until nothing is missing */
    SPV_STEP_EVENT, SPV_STEP_FIT, SPV_STEP_ORBIT, SPV_STEP_TURN, SPV_STEP_POSE,         /* spv_script_control */
    SPV_STEP_EPS, SPV_STEP_MODE, SPV_STEP_SPLAT,        /* number[0]; number as of spc-render's lists */
    SPV_STEP_SCREENSHOT,            /* draw as for a frame, save as path */
    SPV_STEP_END
};

struct spv_step {
    enum spv_step_kind kind;
    struct spv_event event;
    struct spv_pose pose;           /* fov_deg 0: as it is; up 0: the vertical axis */
    bool arrives;                   /* a pose where its command ends, not one on the way */
    double number[3];
    const char *path;               /* of the script, until it is freed */
    unsigned line;                  /* counted from 1 */
};

struct spv_script;

struct spv_player {                 /* all-zero but script: at its beginning */
    const struct spv_script *script;
    size_t command;
    unsigned frame, part;           /* frames of this command so far; steps of this frame */
    struct spv_pose from;
};

/*
 * Reads a script from memory.
 *
 * in     text[bytes]  need not end with a zero
 * out    *out         to be freed; NULL on failure
 * fails  SPC_INPUT_FORMAT  a line is no command; err names line and word
 *        SPC_LIMIT         over one of the limits above
 *        SPC_NO_MEMORY
 */
enum spc_status spv_script_parse(const char *text, size_t bytes, struct spv_script **out, struct spc_error *err);
void spv_script_free(struct spv_script *script);

/* Frames that a script draws at least: a wait counts as one. */
uint64_t spv_script_frames(const struct spv_script *script);

/* The next step. pose: where the camera is now, from which paths begin. After the end: again the end. */
struct spv_step spv_script_next(struct spv_player *player, const struct spv_pose *pose);

/*
 * Does the steps that concern the camera; others do nothing. A pose that is no view, such as one on the
 * way through what it looks at, leaves the camera as it is.
 *
 * out    (return)  of events: what others have to do
 */
enum spv_action spv_script_control(const struct spv_step *step, struct spv_control *control);

#endif
