/*
 * overlay.c - letters from strokes.
 *
 * No font file can be relied upon where this runs, and bitmaps suit one size only. So letters are a table
 * of strokes, of which coverage is computed once a size: a pixel's is how far its middle is from the
 * nearest stroke, over one pixel.
 */
#include "overlay.h"

#include "letters.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FIRST = ' ', LETTER_COUNT = sizeof LETTERS / sizeof *LETTERS, CURVE_STEPS = 8 };
_Static_assert(LETTER_COUNT == 95, "a row a printable character");

struct spv_text {
    int line, advance;              /* px, a letter's cell */
    uint8_t cover[];                /* [LETTER_COUNT][line][advance] */
};

struct point {
    double x, y;
};

struct pen {
    uint8_t *cell;
    int width, height;
    double step_x, step_y, radius;  /* px a column, px a row, px */
};

/* ---- letters ------------------------------------------------------------------------------------ */

static double distance(struct point p, struct point a, struct point b)
{
    const double dx = b.x - a.x, dy = b.y - a.y, length2 = dx * dx + dy * dy;
    double t = length2 > 0 ? ((p.x - a.x) * dx + (p.y - a.y) * dy) / length2 : 0;
    t = fmin(fmax(t, 0), 1);
    return hypot(p.x - a.x - t * dx, p.y - a.y - t * dy);
}

static void line_to(const struct pen *pen, struct point a, struct point b, double radius)
{
    for (int y = 0; y < pen->height; y++)
        for (int x = 0; x < pen->width; x++) {
            const double far = distance((struct point){x + 0.5, y + 0.5}, a, b) - radius;
            const double cover = 255 * fmin(fmax(0.5 - far, 0), 1);
            uint8_t *at = pen->cell + (size_t)y * (size_t)pen->width + x;
            if (cover > *at)
                *at = (uint8_t)(cover + 0.5);
        }
}

static void curve_to(const struct pen *pen, struct point a, struct point by, struct point b)
{
    struct point last = a;
    for (int i = 1; i <= CURVE_STEPS; i++) {
        const double t = (double)i / CURVE_STEPS, u = 1 - t;
        const struct point next = {u * u * a.x + 2 * u * t * by.x + t * t * b.x,
                                   u * u * a.y + 2 * u * t * by.y + t * t * b.y};
        line_to(pen, last, next, pen->radius);
        last = next;
    }
}

/* Columns and rows are the middles of pixels at the size they were drawn for, so that stems are sharp. */
static struct point place(const struct pen *pen, const char *at, bool *bends)
{
    *bends = at[1] < 'a';
    const int row = at[1] - (*bends ? 'A' : 'a');
    struct point p = {(at[0] - '0' + 0.5) * pen->step_x, (row + 1.5) * pen->step_y};
    if (pen->step_y < 2) {          /* at small sizes, on whole pixels; twice that needs no help */
        p.x = floor(p.x) + 0.5;
        p.y = floor(p.y) + 0.5;
    }
    return p;
}

static void draw_letter(const struct pen *pen, const char *strokes)
{
    while (*strokes != '\0') {
        bool bends = false, bent = false;
        struct point at = place(pen, strokes, &bends), by = at;
        strokes += 2;
        if (*strokes == ' ' || *strokes == '\0')
            line_to(pen, at, at, pen->radius * 1.4);
        for (; *strokes != ' ' && *strokes != '\0'; strokes += 2) {
            const struct point next = place(pen, strokes, &bends);
            if (bends && bent) {
                const struct point half = {(by.x + next.x) / 2, (by.y + next.y) / 2};
                curve_to(pen, at, by, half);
                at = half;
            } else if (!bends) {
                if (bent)
                    curve_to(pen, at, by, next);
                else
                    line_to(pen, at, next, pen->radius);
                at = next;
            }
            by = next;
            bent = bends;
        }
        strokes += *strokes == ' ';
    }
}

enum spc_status spv_text_create(int line_px, struct spv_text **out, struct spc_error *err)
{
    *out = NULL;
    const int line = line_px < SPV_TEXT_LINE_MIN ? SPV_TEXT_LINE_MIN
                     : line_px > SPV_TEXT_LINE_MAX ? SPV_TEXT_LINE_MAX : line_px;
    const int advance = (line * LETTER_COLUMNS + LETTER_ROWS / 2) / LETTER_ROWS;
    const size_t cell = (size_t)line * (size_t)advance;
    struct spv_text *text = calloc(1, sizeof *text + LETTER_COUNT * cell);
    if (text == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for letters");
    text->line = line;
    text->advance = advance;
    struct pen pen = {.width = advance, .height = line, .step_x = (double)advance / LETTER_COLUMNS,
                      .step_y = (double)line / LETTER_ROWS};
    pen.radius = fmax(0.6 * pen.step_y, 0.55);
    for (size_t i = 0; i < LETTER_COUNT; i++) {
        pen.cell = text->cover + i * cell;
        draw_letter(&pen, LETTERS[i]);
    }
    *out = text;
    return SPC_OK;
}

void spv_text_free(struct spv_text *text)
{
    free(text);
}

int spv_text_line(const struct spv_text *text)
{
    return text->line;
}

int spv_text_advance(const struct spv_text *text)
{
    return text->advance;
}

static int to_int(uint64_t value)
{
    return value > INT_MAX ? INT_MAX : (int)value;
}

void spv_text_measure(const struct spv_text *text, const char *words, int *width, int *height)
{
    uint64_t longest = 0, lines = 1;
    for (;;) {
        const size_t length = strcspn(words, "\n");
        longest = length > longest ? length : longest;
        words += length;
        if (*words++ == '\0')
            break;
        lines++;
    }
    *width = to_int(longest * (uint64_t)text->advance);
    *height = to_int(lines * (uint64_t)text->line);
}

/* ---- pixels ------------------------------------------------------------------------------------- */

/* color over *to with cover/255 of its alpha; both straight. */
static void blend(uint8_t *to, uint32_t color, unsigned cover)
{
    const unsigned a = ((color & 0xFF) * cover + 127) / 255, under = to[3] * (255 - a);
    const unsigned sum = 255 * a + under;           /* 255 times the new alpha */
    if (a == 0)
        return;
    for (int c = 0; c < 3; c++) {
        const unsigned new = color >> (24 - 8 * c) & 0xFF;
        to[c] = (uint8_t)((new * 255 * a + to[c] * under + sum / 2) / sum);
    }
    to[3] = (uint8_t)((sum + 127) / 255);
}

static struct spv_rect clip(const struct spv_canvas *canvas, int64_t x, int64_t y, int64_t width, int64_t height)
{
    const int64_t x0 = x < 0 ? 0 : x, y0 = y < 0 ? 0 : y;
    const int64_t x1 = x + width > canvas->width ? canvas->width : x + width;
    const int64_t y1 = y + height > canvas->height ? canvas->height : y + height;
    if (x0 >= x1 || y0 >= y1)
        return (struct spv_rect){0, 0, 0, 0};
    return (struct spv_rect){(int)x0, (int)y0, (int)(x1 - x0), (int)(y1 - y0)};
}

static uint8_t *pixel(const struct spv_canvas *canvas, int x, int y)
{
    return canvas->rgba + ((size_t)y * (size_t)canvas->width + (size_t)x) * 4;
}

void spv_fill(const struct spv_canvas *canvas, int x, int y, int width, int height, uint32_t color)
{
    const struct spv_rect r = clip(canvas, x, y, width, height);
    for (int row = r.y; row < r.y + r.height; row++)
        for (int column = r.x; column < r.x + r.width; column++)
            blend(pixel(canvas, column, row), color, 255);
}

static void put_letter(const struct spv_text *text, const struct spv_canvas *canvas, int64_t x, int64_t y,
                       unsigned char letter, uint32_t color)
{
    const struct spv_rect r = clip(canvas, x, y, text->advance, text->line);
    const size_t index = letter >= FIRST && letter < FIRST + LETTER_COUNT ? letter - FIRST : '?' - FIRST;
    const uint8_t *cover = text->cover + index * (size_t)text->line * (size_t)text->advance;
    for (int row = r.y; row < r.y + r.height; row++)
        for (int column = r.x; column < r.x + r.width; column++)
            blend(pixel(canvas, column, row), color, cover[(row - y) * text->advance + (column - x)]);
}

/* One line of length bytes, of which those from room on are left out. */
static void put_line(const struct spv_text *text, const struct spv_canvas *canvas, int64_t x, int64_t y,
                     const char *words, size_t length, size_t room, uint32_t color)
{
    if (y >= canvas->height || y + text->line <= 0)
        return;
    size_t i = 0;                   /* what lies left of the canvas needs no steps, nor does what lies right */
    if (x < 0) {
        const uint64_t left = (uint64_t)-x / (uint64_t)text->advance;
        i = left > length ? length : (size_t)left;
    }
    for (; i < length && i < room; i++) {
        const int64_t at = x + (int64_t)i * text->advance;
        if (at >= canvas->width)
            break;
        const bool dots = length > room && i + 2 >= room;
        put_letter(text, canvas, at, y, dots ? '.' : (unsigned char)words[i], color);
    }
}

void spv_text_draw(const struct spv_text *text, const struct spv_canvas *canvas, int x, int y, const char *words,
                   uint32_t color)
{
    for (int64_t top = y; top < canvas->height; top += text->line) {
        const size_t length = strcspn(words, "\n");
        put_line(text, canvas, x, top, words, length, SIZE_MAX, color);
        words += length;
        if (*words++ == '\0')
            break;
    }
}

/* ---- panels ------------------------------------------------------------------------------------- */

static const uint32_t GROUND = 0x0C0E12D0, WORDS = 0xF0F0F0FF, TITLE = 0xFFD479FF, KEYS = 0x9CDCFEFF,
                      BAR = 0x4C9BE8FF, BAR_GROUND = 0xFFFFFF30;

static int pad_of(const struct spv_text *text)
{
    return text->line / 2;
}

static size_t at_least_0(int64_t value)
{
    return value < 0 ? 0 : (size_t)value;
}

/* Letters that fit beside each other on a canvas, with a panel's border. */
static size_t room_on(const struct spv_text *text, const struct spv_canvas *canvas)
{
    return at_least_0(((int64_t)canvas->width - 2 * pad_of(text)) / text->advance);
}

static struct spv_rect ground(const struct spv_canvas *canvas, int64_t x, int64_t y, int64_t width, int64_t height)
{
    const struct spv_rect r = clip(canvas, x, y, width, height);
    spv_fill(canvas, r.x, r.y, r.width, r.height, GROUND);
    return r;
}

struct spv_rect spv_panel_stats(const struct spv_text *text, const struct spv_canvas *canvas,
                                const char *const *lines, int count)
{
    const int pad = pad_of(text) / 2;
    const size_t room = at_least_0(((int64_t)canvas->width - 2 * pad) / text->advance);
    size_t longest = 0;
    for (int i = 0; i < count; i++) {
        const size_t length = strcspn(lines[i], "\n");
        longest = length > longest ? length : longest;
    }
    longest = longest > room ? room : longest;
    if (count <= 0 || longest == 0)
        return (struct spv_rect){0, 0, 0, 0};
    const int64_t height = (int64_t)count * text->line + pad, top = canvas->height - height;
    const struct spv_rect r = ground(canvas, 0, top, (int64_t)longest * text->advance + 2 * pad, height);
    for (int i = 0; i < count; i++)
        put_line(text, canvas, pad, top + pad / 2 + (int64_t)i * text->line, lines[i], strcspn(lines[i], "\n"), room,
                 WORDS);
    return r;
}

/* Letters of the longest of keys and words of some rows. */
static void columns_of(const struct spv_help_row *rows, int count, size_t *keys, size_t *words)
{
    *keys = *words = 0;
    for (int i = 0; i < count; i++) {
        const size_t k = rows[i].keys == NULL ? 0 : strlen(rows[i].keys), w = strlen(rows[i].words);
        *keys = k > *keys ? k : *keys;
        *words = w > *words ? w : *words;
    }
}

struct spv_rect spv_panel_help(const struct spv_text *text, const struct spv_canvas *canvas, const char *title,
                               const struct spv_help_row *rows, int count)
{
    const int pad = pad_of(text), head = text->line + pad;
    size_t keys, words;
    columns_of(rows, count, &keys, &words);
    const int64_t each = (int64_t)(keys + words + 2) * text->advance;     /* px, a column */
    const int64_t fit = ((int64_t)canvas->height - 2 * pad - head) / text->line;
    const int64_t beside = ((int64_t)canvas->width - 2 * pad + 2 * text->advance) / (each + 2 * text->advance);
    int64_t columns = fit < 1 ? 1 : (count + fit - 1) / fit;
    columns = columns > beside ? beside : columns;
    columns = columns < 1 ? 1 : columns;
    const int64_t down = (count + columns - 1) / columns;
    int64_t width = columns * (each + 2 * text->advance) - 2 * text->advance;
    width = 2 * pad + (width > (int64_t)strlen(title) * text->advance ? width : (int64_t)strlen(title) * text->advance);
    const int64_t height = 2 * pad + head + down * text->line;
    const int64_t left = width < canvas->width ? (canvas->width - width) / 2 : 0;
    const int64_t top = height < canvas->height ? (canvas->height - height) / 2 : 0;
    const struct spv_rect r = ground(canvas, left, top, width, height);
    put_line(text, canvas, left + pad, top + pad, title, strlen(title), room_on(text, canvas), TITLE);
    for (int i = 0; i < count; i++) {
        const int64_t x = left + pad + i / down * (each + 2 * text->advance);
        const int64_t y = top + pad + head + i % down * text->line;
        const int64_t beyond = x + (int64_t)(keys + 2) * text->advance;
        const size_t room = at_least_0((canvas->width - pad - beyond) / text->advance);
        if (rows[i].keys == NULL) {
            put_line(text, canvas, x, y, rows[i].words, strlen(rows[i].words), SIZE_MAX, TITLE);
            continue;
        }
        put_line(text, canvas, x, y, rows[i].keys, strlen(rows[i].keys), SIZE_MAX, KEYS);
        put_line(text, canvas, beyond, y, rows[i].words, strlen(rows[i].words), room, WORDS);
    }
    return r;
}

/* The next line of at most room letters, which ends before a space where it can. Returns where the rest begins. */
static const char *wrap(const char *words, size_t room, size_t *length)
{
    const size_t all = strcspn(words, "\n");
    *length = all;
    if (all > room) {
        size_t end = room;
        while (end > 0 && words[end] != ' ')
            end--;
        *length = end > 0 ? end : room;
    }
    const char *rest = words + *length;
    if (*rest == ' ' || *rest == '\n')
        rest++;
    return rest;
}

struct spv_rect spv_panel_message(const struct spv_text *text, const struct spv_canvas *canvas, const char *title,
                                  const char *message)
{
    enum { ROOM_MAX = 72 };         /* letters a line, beyond which reading is hard */
    const int pad = pad_of(text);
    size_t room = room_on(text, canvas), longest = title == NULL ? 0 : strlen(title), length;
    room = room > ROOM_MAX ? ROOM_MAX : room < 1 ? 1 : room;
    const int64_t head = title == NULL ? 0 : text->line + pad;
    const int64_t fit = canvas->height / text->line + 1;        /* lines that could be seen */
    int64_t lines = 0;
    for (const char *rest = message; lines == 0 || (*rest != '\0' && lines < fit); lines++) {
        rest = wrap(rest, room, &length);
        longest = length > longest ? length : longest;
    }
    longest = longest > room ? room : longest;
    const int64_t width = (int64_t)longest * text->advance + 2 * pad;
    const int64_t height = head + lines * text->line + 2 * pad;
    const int64_t left = width < canvas->width ? (canvas->width - width) / 2 : 0;
    const int64_t top = height < canvas->height ? (canvas->height - height) / 2 : 0;
    const struct spv_rect r = ground(canvas, left, top, width, height);
    if (title != NULL)
        put_line(text, canvas, left + pad, top + pad, title, strlen(title), room, TITLE);
    for (int64_t i = 0; i < lines; i++) {
        const char *line = message;
        message = wrap(message, room, &length);
        put_line(text, canvas, left + pad, top + pad + head + i * text->line, line, length, room, WORDS);
    }
    return r;
}

struct spv_rect spv_panel_progress(const struct spv_text *text, const struct spv_canvas *canvas, const char *words,
                                   double share, bool below)
{
    enum { LETTERS_MIN = 32 };
    const int pad = pad_of(text);
    const size_t room = room_on(text, canvas), all = strcspn(words, "\n");
    size_t letters = all < LETTERS_MIN ? LETTERS_MIN : all;
    letters = letters > room ? room : letters;
    const int64_t bar = (int64_t)letters * text->advance, width = bar + 2 * pad;
    const int64_t height = 2 * text->line + 2 * pad - pad / 2;
    const int64_t left = width < canvas->width ? (canvas->width - width) / 2 : 0;
    const int64_t top = height < canvas->height ? (canvas->height - height) * (below ? 3 : 2) / 4 : 0;
    const struct spv_rect r = ground(canvas, left, top, width, height);
    const double full = share >= 0 ? fmin(share, 1) : 0;        /* not a number: empty */
    const int y = (int)(top + pad + text->line + pad / 2), x = (int)left + pad, thick = text->line / 2;
    put_line(text, canvas, x, top + pad, words, all, room, WORDS);
    spv_fill(canvas, x, y, (int)bar, thick, BAR_GROUND);
    spv_fill(canvas, x, y, (int)(full * (double)bar + 0.5), thick, BAR);
    return r;
}
