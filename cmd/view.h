/*
 * view.h - a session of spc-view: what is shown, who asks for it, and what is told of it.
 *
 *   view.c         begins and ends a session; the loop of a user, and that of a script
 *   view_act.c     what events ask for
 *   view_frame.c   a frame: drawn, labelled, shown, saved
 *   view_words.c   what stands on the picture
 *   view_log.c     a line a frame as CSV, the summary as JSON
 */
#ifndef VIEW_H
#define VIEW_H

#include "control.h"
#include "overlay.h"
#include "pace.h"
#include "picture.h"
#include "sample.h"
#include "scene.h"
#include "script.h"
#include "show.h"
#include "window.h"

struct view_options {
    struct picture_options picture;
    char **files;                   /* [file_count] archives */
    int file_count;
    const char *script, *stats, *screenshot;    /* files; NULL: none */
    double fps;                     /* that movement keeps; 0: eps stays */
    uint32_t nodes;                 /* instead: that a frame tests at most while moving; 0: fps counts */
    bool offscreen;                 /* no window */
    bool json;
    uint32_t samples;               /* a pixel and axis when still */
};

enum { VIEW_MESSAGE = 512, VIEW_STILL_SAMPLES = 2 };

struct view_times {                 /* of the session */
    double window_ms;               /* to make the window, with its context */
    double began;                   /* when the window was there, cli_seconds */
    double first_ms;                /* from then to the first picture; 0: not yet */
    uint64_t first_bytes;           /* read of the archives by then */
    double settled_ms;              /* to the first picture that lacked nothing */
    uint64_t settled_bytes;
    uint64_t bytes;                 /* read so far, heads included */
    uint64_t frames;
    double frame_began, frame_ms;
    double shown_fps;               /* damped, for people */
};

struct view {
    struct view_options o;
    struct spv_window *window;      /* NULL: offscreen */
    struct spv_show *show;
    struct spv_ctx *ctx;            /* without window */
    struct spv_draw *draw;
    bool draws_gl;
    struct spv_scene *scene;
    struct spv_control control;
    struct spv_pace pace;
    struct spv_text *text;
    int width, height;              /* px */
    enum spv_mode mode;
    enum spv_splat splat;
    enum spv_paint paint;
    bool no_occlusion, frozen, smooth, statistics, help, quit;
    struct spv_view frozen_view;
    uint32_t next_fit;              /* archive that N frames next; count: all */
    bool changed;                   /* camera or options, since the last frame */
    bool moving;
    int drawn_samples;              /* a pixel and axis, of the last frame */
    double drawn_eps;               /* px, of the last frame */
    uint8_t *rgba, *samples;        /* [height][width][4], and larger */
    size_t rgba_max, samples_max;
    struct spv_scene_stats stats;   /* of the last frame */
    struct spc_error damage;        /* of the first block that could not be read, */
    uint32_t damaged;               /* in this archive */
    char message[VIEW_MESSAGE];     /* in the middle, until escape or another file */
    char notice[VIEW_MESSAGE];      /* below, for a while */
    double notice_until;
    unsigned screenshots;
    FILE *csv;
    struct view_times times;
};

/* Shows archives until the user, or the script, ends it. Returns an exit code. */
int view_session(const struct view_options *o);

/* ---- view_frame.c --------------------------------------------------------------------------------- */

/* Draws and shows a frame. False: it failed; the message is on the picture, or in v->message. */
bool view_frame(struct view *v);

/* The same without words, into a file that is no archive of the scene. Returns an exit code. */
int view_save(struct view *v, const char *path);

/* Something that the picture lacks is on its way, or may be had later. */
bool view_loading(const struct view *v);

/* The last frame was drawn with the user's eps, and the next one will be. */
bool view_finest(const struct view *v);

/* It is, and nothing is missing that could be had. */
bool view_settled(const struct view *v);

/* ---- view_act.c ----------------------------------------------------------------------------------- */

void view_event(struct view *v, const struct spv_event *event);
void view_action(struct view *v, enum spv_action action);

/* Adds an archive, or says why not in v->message, which else stays. The camera frames all of them. */
enum spc_status view_open(struct view *v, const char *path, struct spc_error *err);
void view_resize(struct view *v, int width, int height);

/* Soft, GL, or, for auto, what is faster here. fails as the back ends do; nothing changes then */
enum spc_status view_choose_draw(struct view *v, enum picture_renderer renderer, struct spc_error *err);

/* ---- view_words.c --------------------------------------------------------------------------------- */

void view_say(struct view *v, const char *fmt, ...) __attribute__((format(printf, 2, 3)));      /* notice */
void view_tell(struct view *v, const char *file, const struct spc_error *err);                   /* message */

/* Puts words onto the picture, or onto the window over it. */
void view_words(struct view *v);

/* ---- view_log.c ----------------------------------------------------------------------------------- */

int view_log_begin(struct view *v);
void view_log_frame(struct view *v);
int view_log_end(struct view *v, int code);

#endif
