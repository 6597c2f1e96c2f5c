/*
 * script.c - commands become steps.
 *
 * A command is played by two counters: its frame, and the part of that frame. Each kind says what part
 * it has at these counters, until it has none.
 */
#include "script_int.h"

#include <string.h>

uint64_t spv_script_frames(const struct spv_script *s)
{
    uint64_t frames = 0;
    for (size_t i = 0; i < s->count && s->commands[i].kind != COMMAND_QUIT; i++)
        frames += s->commands[i].kind == COMMAND_WAIT || s->commands[i].kind == COMMAND_SCREENSHOT
            ? 1 : s->commands[i].frames;
    return frames;
}

static double between(double from, double to, unsigned i, unsigned n)
{
    return i >= n ? to : from + (to - from) * i / n;
}

static void pose_of(const struct command *c, struct spv_pose *pose)
{
    memcpy(pose->eye, c->number, sizeof pose->eye);
    memcpy(pose->target, c->number + 3, sizeof pose->target);
    memcpy(pose->up, c->number + 6, sizeof pose->up);
}

/* Straight on, eye and target each; the last frame is there exactly. */
static void path_pose(const struct spv_player *p, const struct command *c, struct spv_pose *pose)
{
    struct spv_pose to = {.fov_deg = 0};
    pose_of(c, &to);
    *pose = to;
    for (int a = 0; a < 3; a++) {
        pose->eye[a] = between(p->from.eye[a], to.eye[a], p->frame + 1, c->frames);
        pose->target[a] = between(p->from.target[a], to.target[a], p->frame + 1, c->frames);
    }
}

static void pointer_event(struct spv_step *s, const struct command *c, enum spv_event_kind kind, double x, double y)
{
    s->kind = SPV_STEP_EVENT;
    s->event = (struct spv_event){.kind = kind, .button = c->key, .clicks = 1, .modifiers = c->modifiers,
                                  .x = x, .y = y};
}

/* Press, a move a frame, release after the last. */
static bool drag_part(const struct spv_player *p, const struct command *c, struct spv_step *s)
{
    const double *n = c->number;
    const unsigned done = p->frame + 1;
    if (p->frame == c->frames)
        pointer_event(s, c, SPV_EVENT_BUTTON_UP, n[2], n[3]);
    else if (p->frame == 0 && p->part == 0)
        pointer_event(s, c, SPV_EVENT_BUTTON, n[0], n[1]);
    else if (p->part == (p->frame == 0))
        pointer_event(s, c, SPV_EVENT_MOVE, between(n[0], n[2], done, c->frames), between(n[1], n[3], done, c->frames));
    else
        return false;
    return p->frame < c->frames || p->part == 0;
}

static bool key_part(const struct spv_player *p, const struct command *c, struct spv_step *s)
{
    if (p->frame != 0 && p->frame != c->frames)
        return false;
    const bool down = p->frame == 0 && p->part == 0;
    if (p->part > (c->frames == 0))
        return false;
    s->kind = SPV_STEP_EVENT;
    s->event = (struct spv_event){.kind = down ? SPV_EVENT_KEY : SPV_EVENT_KEY_UP, .key = c->key,
                                  .modifiers = c->modifiers};
    return true;
}

/* A click, its release, the second of a double click, its release. */
static bool click_part(const struct spv_player *p, const struct command *c, struct spv_step *s)
{
    if (p->part > 3)
        return false;
    pointer_event(s, c, p->part % 2 == 0 ? SPV_EVENT_BUTTON : SPV_EVENT_BUTTON_UP, c->number[0], c->number[1]);
    s->event.clicks = p->part < 2 ? 1 : 2;
    return true;
}

/* Commands of one step, none of which is a frame's. */
static bool single(const struct command *c, const char *text, struct spv_step *s)
{
    memcpy(s->number, c->number, sizeof s->number);
    switch (c->kind) {
    case COMMAND_WAIT: s->kind = SPV_STEP_WAIT; return true;
    case COMMAND_FIT: s->kind = SPV_STEP_FIT; return true;
    case COMMAND_ORBIT: s->kind = SPV_STEP_ORBIT; return true;
    case COMMAND_EPS: s->kind = SPV_STEP_EPS; return true;
    case COMMAND_EYE: s->kind = SPV_STEP_POSE; s->arrives = true; pose_of(c, &s->pose); return true;
    case COMMAND_MODE: s->kind = SPV_STEP_MODE; s->number[0] = c->key; return true;
    case COMMAND_SPLAT: s->kind = SPV_STEP_SPLAT; s->number[0] = c->key; return true;
    case COMMAND_SCREENSHOT: s->kind = SPV_STEP_SCREENSHOT; s->path = text + c->path_off; return true;
    case COMMAND_OPEN:
        s->kind = SPV_STEP_EVENT;
        s->event = (struct spv_event){.kind = SPV_EVENT_DROP, .path = text + c->path_off};
        return true;
    case COMMAND_WHEEL:
        pointer_event(s, c, SPV_EVENT_WHEEL, c->number[0], c->number[1]);
        s->event.steps = c->number[2];
        return true;
    case COMMAND_RESIZE:
        s->kind = SPV_STEP_EVENT;
        s->event = (struct spv_event){.kind = SPV_EVENT_RESIZE, .width = (int)c->number[0],
                                      .height = (int)c->number[1]};
        return true;
    default: return false;
    }
}

/* What comes at the player's place before the frame, if anything. */
static bool part_of(const struct spv_player *p, const struct command *c, struct spv_step *s)
{
    switch (c->kind) {
    case COMMAND_DRAG: return drag_part(p, c, s);
    case COMMAND_KEY: return key_part(p, c, s);
    case COMMAND_DOUBLECLICK: return click_part(p, c, s);
    case COMMAND_TURN:
        s->kind = SPV_STEP_TURN;
        s->number[0] = c->number[0] / c->frames;
        s->number[1] = c->number[1] / c->frames;
        return p->part == 0 && p->frame < c->frames;
    case COMMAND_PATH:
        s->kind = SPV_STEP_POSE;
        s->arrives = p->frame + 1 >= c->frames;
        path_pose(p, c, &s->pose);
        return p->part == 0 && p->frame < c->frames;
    default: return p->part == 0 && p->frame == 0 && single(c, p->script->text, s);
    }
}

struct spv_step spv_script_next(struct spv_player *p, const struct spv_pose *pose)
{
    while (p->command < p->script->count) {
        const struct command *c = &p->script->commands[p->command];
        struct spv_step step = {.kind = SPV_STEP_END, .line = c->line};
        if (c->kind == COMMAND_QUIT)
            return step;
        if (p->frame == 0 && p->part == 0)
            p->from = *pose;
        if (part_of(p, c, &step)) {
            p->part++;
            return step;
        }
        p->part = 0;
        if (p->frame < c->frames) {
            p->frame++;
            return (struct spv_step){.kind = SPV_STEP_FRAME, .line = c->line};
        }
        p->frame = 0;
        p->command++;
    }
    return (struct spv_step){.kind = SPV_STEP_END};
}

enum spv_action spv_script_control(const struct spv_step *s, struct spv_control *control)
{
    struct spv_pose pose = s->pose;
    switch (s->kind) {
    case SPV_STEP_EVENT: return spv_control_event(control, &s->event);
    case SPV_STEP_FIT: spv_control_fit(control); break;
    case SPV_STEP_ORBIT: spv_control_orbit(control, s->number[0], s->number[1], s->number[2]); break;
    case SPV_STEP_TURN: spv_control_turn(control, s->number[0], s->number[1]); break;
    case SPV_STEP_POSE:
        if (!(pose.fov_deg > 0))
            pose.fov_deg = control->pose.fov_deg;
        if (pose.up[0] == 0 && pose.up[1] == 0 && pose.up[2] == 0)
            memcpy(pose.up, control->vertical, sizeof pose.up);
        spv_control_place(control, &pose);
        break;
    default: break;
    }
    return SPV_ACTION_NONE;
}
