/* Words and panels on a picture: what they change and what they must not. */
#include "suite.h"
#include "overlay.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { GUARD = 4096 };              /* bytes before and behind a canvas that nobody may write */

struct board {
    struct spv_canvas canvas;
    uint8_t *memory;
    size_t bytes;
};

static struct board board_of(int width, int height, uint8_t fill)
{
    struct board b = {{NULL, width, height}, NULL, (size_t)width * (size_t)height * 4};
    b.memory = malloc(b.bytes + 2 * GUARD);
    ck_assert_ptr_nonnull(b.memory);
    memset(b.memory, 0xA5, b.bytes + 2 * GUARD);
    b.canvas.rgba = b.memory + GUARD;
    memset(b.canvas.rgba, fill, b.bytes);
    return b;
}

static void check_guards(const struct board *b)
{
    int changed = 0;
    for (size_t i = 0; i < GUARD; i++)
        changed += b->memory[i] != 0xA5 || b->memory[GUARD + b->bytes + i] != 0xA5;
    ck_assert_int_eq(changed, 0);
}

static struct spv_text *letters(int line)
{
    struct spv_text *text = NULL;
    ck_assert_int_eq(spv_text_create(line, &text, NULL), SPC_OK);
    return text;
}

/* Outside of r nothing was changed. */
static void check_rect(const struct board *b, struct spv_rect r, uint8_t fill)
{
    ck_assert_int_ge(r.x, 0);
    ck_assert_int_ge(r.y, 0);
    ck_assert_int_le(r.x + r.width, b->canvas.width);
    ck_assert_int_le(r.y + r.height, b->canvas.height);
    int changed = 0;
    for (int y = 0; y < b->canvas.height; y++)
        for (int x = 0; x < b->canvas.width; x++)
            if (x < r.x || y < r.y || x >= r.x + r.width || y >= r.y + r.height)
                for (int c = 0; c < 4; c++)
                    changed += b->canvas.rgba[(y * b->canvas.width + x) * 4 + c] != fill;
    ck_assert_int_eq(changed, 0);
}

/* The sum of what a text covers of a white one, 0 where it covers nothing. */
static uint64_t ink(const struct spv_text *text, const char *words)
{
    struct board b = board_of(300, 200, 0);
    uint64_t sum = 0;
    spv_text_draw(text, &b.canvas, 0, 0, words, 0xFFFFFFFF);
    for (size_t i = 3; i < b.bytes; i += 4)
        sum += b.canvas.rgba[i];
    free(b.memory);
    return sum;
}

START_TEST(every_letter_shows_and_is_unlike_every_other)
{
    const int sizes[] = {16, 18, 20, 32, 48};
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
        struct spv_text *text = letters(sizes[s]);
        const int width = spv_text_advance(text), height = spv_text_line(text);
        const size_t bytes = (size_t)width * (size_t)height * 4;
        uint8_t *all = calloc(95, bytes);
        for (int i = 0; i < 95; i++) {
            const char word[2] = {(char)(' ' + i), 0};
            ck_assert_int_eq(ink(text, word) > 0, i > 0);
            const struct spv_canvas canvas = {all + (size_t)i * bytes, width, height};
            spv_text_draw(text, &canvas, 0, 0, word, 0xFFFFFFFF);
            for (int j = 0; j < i; j++) {   /* so many pixels' worth of ink that an eye sees it */
                int differs = 0;
                for (size_t k = 3; k < bytes; k += 4)
                    differs += abs(all[(size_t)i * bytes + k] - all[(size_t)j * bytes + k]);
                ck_assert_msg(differs >= 2 * 255, "'%c' and '%c' at %d px differ by %d", ' ' + i, ' ' + j, sizes[s],
                              differs);
            }
        }
        free(all);
        spv_text_free(text);
    }
}
END_TEST

/* In pixels of 16 px letters: stems are whole pixels, not grey ones on two. */
START_TEST(stems_are_sharp_at_the_sizes_of_screens)
{
    const int sizes[] = {16, 20, 24, 32};
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
        struct spv_text *text = letters(sizes[s]);
        struct board b = board_of(spv_text_advance(text), spv_text_line(text), 0);
        spv_text_draw(text, &b.canvas, 0, 0, "l", 0xFFFFFFFF);
        int most = 0;
        for (int x = 0; x < b.canvas.width; x++) {
            const int a = b.canvas.rgba[(b.canvas.height * 6 / 16 * b.canvas.width + x) * 4 + 3];
            most = a > most ? a : most;
        }
        ck_assert_int_ge(most, 250);
        free(b.memory);
        spv_text_free(text);
    }
}
END_TEST

START_TEST(bytes_that_are_no_letters_show_as_question_marks)
{
    struct spv_text *text = letters(16);
    ck_assert_uint_eq(ink(text, "\xC3\xA4\x01\x7F\t"), ink(text, "?????"));
    ck_assert_uint_ne(ink(text, "?????"), ink(text, "????"));
    int width, height;
    spv_text_measure(text, "ab\nabcd\n", &width, &height);
    ck_assert_int_eq(width, 4 * spv_text_advance(text));
    ck_assert_int_eq(height, 3 * spv_text_line(text));
    spv_text_measure(text, "", &width, &height);
    ck_assert_int_eq(width, 0);
    ck_assert_int_eq(height, spv_text_line(text));
    ck_assert_uint_eq(ink(text, "a\nb"), ink(text, "ab"));
    spv_text_free(text);
}
END_TEST

/* As worked out by hand: over what is opaque, over nothing, over what is half there. */
START_TEST(colors_are_mixed_with_straight_alpha)
{
    const struct { uint8_t under[4]; uint32_t color; uint8_t becomes[4]; } cases[] = {
        {{10, 20, 30, 255}, 0xFF8000FF, {255, 128, 0, 255}},
        {{10, 20, 30, 255}, 0xFF800000, {10, 20, 30, 255}},
        {{0, 100, 255, 255}, 0xFF640080, {128, 100, 127, 255}},
        {{77, 77, 77, 0}, 0x01020340, {1, 2, 3, 64}},
        {{0, 0, 200, 128}, 0xC8000080, {134, 0, 66, 192}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        uint8_t rgba[4];
        memcpy(rgba, cases[i].under, 4);
        spv_fill(&(struct spv_canvas){rgba, 1, 1}, 0, 0, 1, 1, cases[i].color);
        for (int c = 0; c < 4; c++)
            ck_assert_int_le(abs(rgba[c] - cases[i].becomes[c]), 1);
    }
}
END_TEST

static int any_int(unsigned *seed)
{
    static const int odd[] = {INT_MIN, INT_MIN + 1, INT_MAX, INT_MAX - 1, -1, 0, 1};
    const int r = rand_r(seed);
    return r % 4 == 0 ? odd[rand_r(seed) % 7] : r % 400 - 150;
}

START_TEST(nothing_is_written_outside_of_the_canvas)
{
    unsigned seed = 5;
    char words[600];
    struct spv_text *texts[] = {letters(0), letters(20), letters(33), letters(INT_MAX)};
    ck_assert_int_eq(spv_text_line(texts[0]), SPV_TEXT_LINE_MIN);
    ck_assert_int_eq(spv_text_line(texts[3]), SPV_TEXT_LINE_MAX);
    for (int i = 0; i < 2000; i++) {
        const struct spv_text *text = texts[rand_r(&seed) % 4];
        const bool tiny = i % 3 == 0;
        struct board b = board_of(1 + rand_r(&seed) % (tiny ? 4 : 200), 1 + rand_r(&seed) % (tiny ? 4 : 100), 7);
        const int length = rand_r(&seed) % (i % 2 ? 30 : 599);
        for (int c = 0; c < length; c++)
            words[c] = (char)(rand_r(&seed) % 20 == 0 ? '\n' : rand_r(&seed) % 6 == 0 ? ' ' : 1 + rand_r(&seed) % 255);
        words[length] = '\0';
        const char *lines[] = {words, "", "a line"};
        const struct spv_help_row rows[] = {{NULL, words}, {"key", "word"}, {words, words}, {"", ""}};
        const int count = rand_r(&seed) % 4;
        struct spv_rect r = {0, 0, b.canvas.width, b.canvas.height};
        switch (i % 7) {
        case 0: spv_text_draw(text, &b.canvas, any_int(&seed), any_int(&seed), words, 0xFFFFFFC0); break;
        case 1: spv_fill(&b.canvas, any_int(&seed), any_int(&seed), any_int(&seed), any_int(&seed), 0xFF0000FF); break;
        case 2: r = spv_panel_stats(text, &b.canvas, lines, count); break;
        case 3: r = spv_panel_help(text, &b.canvas, words, rows, count + 1); break;
        case 4: r = spv_panel_message(text, &b.canvas, count ? words : NULL, words); break;
        case 5: r = spv_panel_progress(text, &b.canvas, words, count / 2.0, count % 2 == 0); break;
        default: r = spv_panel_help(text, &b.canvas, words, rows, 0); break;
        }
        check_guards(&b);
        check_rect(&b, r, 7);
        free(b.memory);
    }
    for (int i = 0; i < 4; i++)
        spv_text_free(texts[i]);
}
END_TEST

static int pixels_of(const struct board *b, struct spv_rect r, uint32_t color)
{
    int count = 0;
    for (int y = r.y; y < r.y + r.height; y++)
        for (int x = r.x; x < r.x + r.width; x++) {
            const uint8_t *p = b->canvas.rgba + (y * b->canvas.width + x) * 4;
            count += p[0] == color >> 16 && p[1] == (color >> 8 & 0xFF) && p[2] == (color & 0xFF);
        }
    return count;
}

START_TEST(panels_stand_where_they_should_and_hold_all_their_words)
{
    struct spv_text *text = letters(16);
    const int line = spv_text_line(text), advance = spv_text_advance(text);
    struct board b = board_of(800, 600, 0);
    const char *lines[] = {"one", "and two"};
    struct spv_rect r = spv_panel_stats(text, &b.canvas, lines, 2);
    ck_assert_int_eq(r.x, 0);
    ck_assert_int_eq(r.y + r.height, 600);
    ck_assert_int_ge(r.width, 7 * advance);
    ck_assert_int_ge(r.height, 2 * line);
    const struct spv_help_row rows[] = {{NULL, "Camera"}, {"left drag", "orbit"}, {"q", "leave"}};
    r = spv_panel_help(text, &b.canvas, "help", rows, 3);
    ck_assert_int_le(abs(2 * r.x + r.width - 800), 1);
    ck_assert_int_le(abs(2 * r.y + r.height - 600), 1);
    ck_assert_int_ge(r.height, 4 * line);
    r = spv_panel_message(text, &b.canvas, NULL, "a word after a word after a word after a word after a word after a "
                                                 "word after a word after a word after a word after a word");
    ck_assert_int_ge(r.height, 2 * line);
    ck_assert_int_lt(r.height, 4 * line);
    const struct spv_rect beneath = spv_panel_progress(text, &b.canvas, "reading", 0.5, true);
    ck_assert_int_ge(beneath.y, r.y + r.height);
    free(b.memory);
    spv_text_free(text);
}
END_TEST

START_TEST(a_bar_is_as_full_as_it_says)
{
    struct spv_text *text = letters(16);
    struct board b = board_of(400, 100, 0);
    const double shares[] = {0.0, 0.25, 1.0, 2.0, -1.0, 0.0 / 0.0};
    int filled[6];
    for (int i = 0; i < 6; i++) {
        memset(b.canvas.rgba, 0, b.bytes);
        filled[i] = pixels_of(&b, spv_panel_progress(text, &b.canvas, "", shares[i], false), 0x4C9BE8);
    }
    ck_assert_int_eq(filled[0], 0);
    ck_assert_int_gt(filled[2], 1000);
    ck_assert_int_le(abs(4 * filled[1] - filled[2]), 4 * spv_text_line(text));
    ck_assert_int_eq(filled[3], filled[2]);
    ck_assert_int_eq(filled[4], 0);
    ck_assert_int_eq(filled[5], 0);
    free(b.memory);
    spv_text_free(text);
}
END_TEST

/* Ink of a panel's words, whatever its ground. */
static int words_in(const struct spv_text *text, int width, const char *message)
{
    struct board b = board_of(width, 300, 0);
    const int count = pixels_of(&b, spv_panel_message(text, &b.canvas, NULL, message), 0xF0F0F0);
    free(b.memory);
    return count;
}

START_TEST(a_message_loses_no_letter_when_it_is_wrapped)
{
    struct spv_text *text = letters(16);
    const char *messages[] = {"the archive is damaged near its end", "averylongnamewithoutanyspaceinit.spc",
                              "one\ntwo  three\n\nfour "};
    for (int i = 0; i < 3; i++)
        for (int width = 60; width < 400; width += 17)
            ck_assert_int_eq(words_in(text, width, messages[i]), words_in(text, 700, messages[i]));
    spv_text_free(text);
}
END_TEST

int main(void)
{
    return SUITE("overlay", NULL, NULL, every_letter_shows_and_is_unlike_every_other,
                 stems_are_sharp_at_the_sizes_of_screens, bytes_that_are_no_letters_show_as_question_marks,
                 colors_are_mixed_with_straight_alpha, nothing_is_written_outside_of_the_canvas,
                 panels_stand_where_they_should_and_hold_all_their_words, a_bar_is_as_full_as_it_says,
                 a_message_loses_no_letter_when_it_is_wrapped);
}
