/*
 * window_probe.c - a window that says what happens to it: window_probe SECONDS [OUT]
 *
 * Prints a line an event and one a picture shown, and ends with a CLOSE, at the key 'q' or after SECONDS.
 * On the left a pattern that tells each pixel from its neighbours is shown, in the middle one half of it
 * blended over the background. After each picture the window is read back and compared; OUT receives the
 * window's pixels of the last picture, as "P6" PPM. Key 'c' puts "probe" onto the clipboard, 'f' is full
 * screen, 'w' is a wait that another thread ends.
 */
#include "show.h"
#include "window.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static const uint32_t GROUND = 0x203040;
enum { SIDE = 150, BLEND_X = 100, BLEND_Y = 40, OFF_X = -30, OFF_Y = -20 };

struct probe {
    struct spv_window *window;
    struct spv_show *show;
    uint8_t *pattern;               /* [SIDE][SIDE][4] */
    uint8_t *screen;
    int width, height;
};

static double seconds(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

static void must(enum spc_status status, const struct spc_error *err)
{
    if (status == SPC_OK)
        return;
    fprintf(stderr, "window_probe: %s\n", err->what);
    exit(1);
}

static void make_pattern(uint8_t *rgba)
{
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            uint8_t *p = rgba + (y * SIDE + x) * 4;
            p[0] = (uint8_t)x;
            p[1] = (uint8_t)(255 - y);
            p[2] = (uint8_t)(x * y);
            p[3] = (uint8_t)(x < SIDE / 3 ? 0 : x < 2 * SIDE / 3 ? 128 : 255);
        }
}

/* What the window should hold at x, y: background, the pattern cut off at the top left, the pattern blended. */
static void expected(const struct probe *p, int x, int y, int *rgb)
{
    for (int c = 0; c < 3; c++)
        rgb[c] = (int)(GROUND >> (16 - 8 * c) & 0xFF);
    const int from_x = x - OFF_X, from_y = y - OFF_Y, over_x = x - BLEND_X, over_y = y - BLEND_Y;
    if (from_x < SIDE && from_y < SIDE)
        for (int c = 0; c < 3; c++)
            rgb[c] = p->pattern[(from_y * SIDE + from_x) * 4 + c];
    if (over_x >= 0 && over_x < SIDE && over_y >= 0 && over_y < SIDE) {
        const uint8_t *over = p->pattern + (over_y * SIDE + over_x) * 4;
        for (int c = 0; c < 3; c++)
            rgb[c] = (over[c] * over[3] + rgb[c] * (255 - over[3]) + 127) / 255;
    }
}

/* Pixels of the window that differ; by 1 where colours were blended is no difference. */
static int compare(const struct probe *p)
{
    int wrong = 0;
    for (int y = 0; y < p->height; y++)
        for (int x = 0; x < p->width; x++) {
            int rgb[3], most = 0;
            expected(p, x, y, rgb);
            for (int c = 0; c < 3; c++) {
                const int d = abs(rgb[c] - p->screen[((size_t)y * (size_t)p->width + (size_t)x) * 4 + (size_t)c]);
                most = d > most ? d : most;
            }
            const bool blended = x >= BLEND_X && y >= BLEND_Y && x < BLEND_X + SIDE && y < BLEND_Y + SIDE;
            wrong += most > blended;
        }
    return wrong;
}

static void show(struct probe *p)
{
    struct spc_error err = {0};
    spv_window_size(p->window, &p->width, &p->height);
    p->screen = realloc(p->screen, (size_t)p->width * (size_t)p->height * 4 + 1);
    if (p->screen == NULL)
        exit(1);
    spv_show_size(p->show, p->width, p->height);
    spv_show_clear(p->show, GROUND);
    must(spv_show_picture(p->show, p->pattern, SIDE, SIDE, OFF_X, OFF_Y, 0, &err), &err);
    must(spv_show_picture(p->show, p->pattern, SIDE, SIDE, BLEND_X, BLEND_Y, SPV_SHOW_BLEND, &err), &err);
    spv_show_read(p->show, p->screen);
    printf("shown %dx%d wrong %d\n", p->width, p->height, compare(p));
    spv_window_swap(p->window);
}

static void write_ppm(const struct probe *p, const char *path)
{
    FILE *f = fopen(path, "wb");
    if (f == NULL)
        exit(1);
    fprintf(f, "P6\n%d %d\n255\n", p->width, p->height);
    for (size_t i = 0; i < (size_t)p->width * (size_t)p->height; i++)
        fwrite(p->screen + 4 * i, 1, 3, f);
    fclose(f);
}

static void *wake_soon(void *window)
{
    nanosleep(&(struct timespec){0, 100000000}, NULL);
    spv_window_wake(window);
    return NULL;
}

/* A wait that only another thread ends: says whether it did, and what waiting costs. */
static void wait_for_thread(struct probe *p)
{
    struct spv_event e;
    pthread_t thread;
    for (int i = 0; i < 20; i++) {  /* until nothing comes any more */
        spv_window_wait(p->window, 0.01);
        while (spv_window_event(p->window, &e))
            continue;
    }
    if (pthread_create(&thread, NULL, wake_soon, p->window) != 0)
        exit(1);
    const double wall = seconds(CLOCK_MONOTONIC), cpu = seconds(CLOCK_PROCESS_CPUTIME_ID);
    spv_window_wait(p->window, 5);
    printf("woken %s idle %s\n", seconds(CLOCK_MONOTONIC) - wall < 3 ? "yes" : "no",
           seconds(CLOCK_PROCESS_CPUTIME_ID) - cpu < 0.05 ? "yes" : "no");
    pthread_join(thread, NULL);
}

static const char *key_name(int key)
{
    static char name[16];
    snprintf(name, sizeof name, key < SPV_KEY_ESCAPE ? "%c" : "#%d", key < SPV_KEY_ESCAPE ? key : key - SPV_KEY_ESCAPE);
    return name;
}

static void say(const struct spv_event *e)
{
    switch (e->kind) {
    case SPV_EVENT_KEY:
        printf("key %s modifiers %u%s\n", key_name(e->key), e->modifiers, e->repeats ? " again" : "");
        break;
    case SPV_EVENT_KEY_UP: printf("up %s\n", key_name(e->key)); break;
    case SPV_EVENT_BUTTON:
        printf("button %d clicks %d modifiers %u at %.0f %.0f\n", e->button, e->clicks, e->modifiers, e->x, e->y);
        break;
    case SPV_EVENT_BUTTON_UP: printf("released %d at %.0f %.0f\n", e->button, e->x, e->y); break;
    case SPV_EVENT_MOVE: printf("move %.0f %.0f modifiers %u\n", e->x, e->y, e->modifiers); break;
    case SPV_EVENT_WHEEL: printf("wheel %.0f at %.0f %.0f\n", e->steps, e->x, e->y); break;
    case SPV_EVENT_RESIZE: printf("resize %dx%d\n", e->width, e->height); break;
    case SPV_EVENT_DROP: printf("drop %s\n", e->path); break;
    case SPV_EVENT_PASTE: printf("paste %s\n", e->path); break;
    case SPV_EVENT_CLOSE: printf("close\n"); break;
    }
}

/* False when the probe is to end. */
static bool act(struct probe *p, const struct spv_event *e, bool *dirty)
{
    say(e);
    *dirty |= e->kind == SPV_EVENT_RESIZE;
    if (e->kind == SPV_EVENT_KEY && e->key == 'c')
        spv_window_set_clipboard(p->window, "probe");
    if (e->kind == SPV_EVENT_KEY && e->key == 'f' && !e->repeats)
        printf("full screen %s\n", spv_window_toggle_full_screen(p->window) ? "yes" : "no");
    if (e->kind == SPV_EVENT_KEY && e->key == 'w')
        wait_for_thread(p);
    return e->kind != SPV_EVENT_CLOSE && !(e->kind == SPV_EVENT_KEY && e->key == 'q');
}

int main(int argc, char **argv)
{
    struct probe p = {0};
    struct spc_error err = {0};
    struct spv_event e;
    bool dirty = true, going = true;
    const double end = seconds(CLOCK_MONOTONIC) + (argc > 1 ? atof(argv[1]) : 5);
    setvbuf(stdout, NULL, _IOLBF, 0);
    must(spv_window_create("window_probe", 400, 300, &p.window, &err), &err);
    must(spv_show_create(spv_window_ctx(p.window), &p.show, &err), &err);
    p.pattern = malloc(SIDE * SIDE * 4);
    if (p.pattern == NULL)
        return 1;
    make_pattern(p.pattern);
    while (going && seconds(CLOCK_MONOTONIC) < end) {
        if (dirty)
            show(&p);
        dirty = false;
        spv_window_wait(p.window, 0.2);
        while (going && spv_window_event(p.window, &e))
            going = act(&p, &e, &dirty);
    }
    if (argc > 2)
        write_ppm(&p, argv[2]);
    printf("end %s\n", going ? "by time" : "as told");
    spv_show_free(p.show);
    spv_window_free(p.window);
    free(p.pattern);
    free(p.screen);
    return 0;
}
