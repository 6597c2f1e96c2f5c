/*
 * overlay.h - words and panels into a picture, on the processor.
 *
 * Letters are strokes of a round pen, drawn at any size, all of one width; a byte that is not printable
 * ASCII shows as '?', a newline ends a line. Colours are 0xRRGGBBAA with straight alpha and go over what
 * is there, whose alpha is straight, too: a picture without a hole stays one, and an empty one becomes
 * a layer to be blended later. Nothing is written outside of the canvas, whatever the coordinates.
 */
#ifndef SPV_OVERLAY_H
#define SPV_OVERLAY_H

#include "spc.h"

struct spv_canvas {
    uint8_t *rgba;                  /* [height][width][4], row 0 the top one; borrowed */
    int width, height;              /* px */
};

struct spv_rect {
    int x, y, width, height;        /* px, from the top left; clipped to its canvas */
};

struct spv_text;

enum { SPV_TEXT_LINE_MIN = 16, SPV_TEXT_LINE_DEFAULT = 16, SPV_TEXT_LINE_MAX = 128 };

/* Letters for lines of line_px pixels, moved into the limits above. fails SPC_NO_MEMORY */
enum spc_status spv_text_create(int line_px, struct spv_text **out, struct spc_error *err);
void spv_text_free(struct spv_text *text);

int spv_text_line(const struct spv_text *text);             /* px from a line to the next */
int spv_text_advance(const struct spv_text *text);          /* px from a letter to the next */

/* Size of a text of any number of lines, px; INT_MAX where it would be larger. An empty one is one line high. */
void spv_text_measure(const struct spv_text *text, const char *words, int *width, int *height);

/* The first line's top left at x, y. */
void spv_text_draw(const struct spv_text *text, const struct spv_canvas *canvas, int x, int y, const char *words,
                   uint32_t color);

void spv_fill(const struct spv_canvas *canvas, int x, int y, int width, int height, uint32_t color);

/*
 * Panels: a dark, translucent rectangle and what stands on it. They return what they drew upon: nothing
 * else of the canvas changed. What does not fit is left out, at the right with ".." for it.
 */

/* Lines at the bottom left. */
struct spv_rect spv_panel_stats(const struct spv_text *text, const struct spv_canvas *canvas,
                                const char *const *lines, int count);

struct spv_help_row {
    const char *keys, *words;       /* keys NULL: a heading */
};

/* In the middle: keys beside what they do, in as many columns as the height makes necessary. */
struct spv_rect spv_panel_help(const struct spv_text *text, const struct spv_canvas *canvas, const char *title,
                               const struct spv_help_row *rows, int count);

/* In the middle: a message, wrapped at words, in words that are too long anywhere. title may be NULL. */
struct spv_rect spv_panel_message(const struct spv_text *text, const struct spv_canvas *canvas, const char *title,
                                  const char *message);

/* In the middle, or below it when something else stands there: words, and a bar of which share (0..1) is full. */
struct spv_rect spv_panel_progress(const struct spv_text *text, const struct spv_canvas *canvas, const char *words,
                                   double share, bool below);

#endif
