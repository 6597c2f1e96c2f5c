/*
 * window.h - a window on a screen, its OpenGL context and what the user does in it.
 *
 * All functions but spv_window_wake belong to the thread that made the window, which must be the
 * program's first. Pixels are those of the picture (framebuffer), whatever the screen's scale.
 */
#ifndef SPV_WINDOW_H
#define SPV_WINDOW_H

#include "ctx.h"
#include "event.h"

struct spv_window;

/*
 * A window of width x height px of a screen without scale, enlarged by the screen's scale, with a double
 * buffered context that is current: OpenGL 4.5 core where there is it, else 3.3.
 * fails  SPC_FEATURE (no display, no such context), SPC_NO_MEMORY
 */
enum spc_status spv_window_create(const char *title, int width, int height, struct spv_window **out,
                                  struct spc_error *err);
void spv_window_free(struct spv_window *window);

struct spv_ctx *spv_window_ctx(const struct spv_window *window);    /* borrowed */

/* Pixels of the picture; 0 x 0 while the window is an icon. */
void spv_window_size(const struct spv_window *window, int *width, int *height);
double spv_window_scale(const struct spv_window *window);           /* 2: letters must be twice as large */

/*
 * Collects events. Without any it sleeps until one comes or spv_window_wake is called, for timeout_s at
 * most: 0 not at all, negative without end.
 */
void spv_window_wait(struct spv_window *window, double timeout_s);
void spv_window_wake(struct spv_window *window);                    /* from any thread */

/*
 * The next event of those collected; false when there is none left. RESIZE comes also when the window must
 * be shown again. Control+V and shift+insert are PASTE events, without a KEY. Keys that make a character are
 * that one, as '?' or '+' with shift; on a keyboard without Latin letters they are what that place has on a
 * US one.
 */
bool spv_window_event(struct spv_window *window, struct spv_event *event);

void spv_window_swap(struct spv_window *window);                    /* shows what was drawn */
void spv_window_title(struct spv_window *window, const char *title);
const char *spv_window_clipboard(struct spv_window *window);        /* until the next call; NULL: holds no text */
void spv_window_set_clipboard(struct spv_window *window, const char *text);

/* Full screen and back, on the screen that shows most of the window. False when that is not to be had. */
bool spv_window_toggle_full_screen(struct spv_window *window);

#endif
