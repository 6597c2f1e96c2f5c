/*
 * ctx_window.c - the only file that knows GLFW.
 *
 * A process has one window: GLFW is started with it and ended with it.
 */
#include "window.h"

#include "ctx_int.h"
#include "event_queue.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SCANCODES = 512 };

struct spv_window {
    struct spv_ctx base;
    GLFWwindow *glfw;
    struct spv_event_queue queue;
    short down[SCANCODES];          /* key that was reported for a scancode, until it goes up; 0: none */
    int key_queued;                 /* scancode of the KEY that was queued last, whose character may follow; -1 */
    bool full_screen;               /* full screen now; these are where the window was, in screen coordinates */
    int x, y, width, height;
    bool pointed;                   /* the pointer has been seen, */
    double at[2];                   /* there, as the screen counts */
};

/* ---- keys ----------------------------------------------------------------------------------------- */

static unsigned modifiers_of(int mods)
{
    return (mods & GLFW_MOD_SHIFT ? SPV_SHIFT : 0u) | (mods & GLFW_MOD_CONTROL ? SPV_CONTROL : 0u) |
           (mods & GLFW_MOD_ALT ? SPV_ALT : 0u);
}

static int special_key(int key)
{
    static const struct { int glfw, key; } keys[] = {
        {GLFW_KEY_ESCAPE, SPV_KEY_ESCAPE}, {GLFW_KEY_ENTER, SPV_KEY_ENTER}, {GLFW_KEY_KP_ENTER, SPV_KEY_ENTER},
        {GLFW_KEY_TAB, SPV_KEY_TAB}, {GLFW_KEY_BACKSPACE, SPV_KEY_BACKSPACE}, {GLFW_KEY_DELETE, SPV_KEY_DELETE},
        {GLFW_KEY_LEFT, SPV_KEY_LEFT}, {GLFW_KEY_RIGHT, SPV_KEY_RIGHT}, {GLFW_KEY_UP, SPV_KEY_UP},
        {GLFW_KEY_DOWN, SPV_KEY_DOWN}, {GLFW_KEY_PAGE_UP, SPV_KEY_PAGE_UP},
        {GLFW_KEY_PAGE_DOWN, SPV_KEY_PAGE_DOWN}, {GLFW_KEY_HOME, SPV_KEY_HOME}, {GLFW_KEY_END, SPV_KEY_END},
        {GLFW_KEY_SPACE, ' '},
    };
    if (key >= GLFW_KEY_F1 && key <= GLFW_KEY_F12)
        return SPV_KEY_F1 + (key - GLFW_KEY_F1);
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
        if (keys[i].glfw == key)
            return keys[i].key;
    return 0;
}

static int lower(int letter)
{
    return letter >= 'A' && letter <= 'Z' ? letter - 'A' + 'a' : letter;
}

static bool is_printable(unsigned code)
{
    return code > ' ' && code < 0x7F;
}

/* What a key stands for without modifiers; 0: nothing of interest. GLFW's own names are those of a US keyboard. */
static int key_of(int key, int scancode)
{
    const int special = special_key(key);
    if (special != 0)
        return special;
    if (key != GLFW_KEY_UNKNOWN && key >= GLFW_KEY_KP_0 && key <= GLFW_KEY_KP_9)
        return '0' + (key - GLFW_KEY_KP_0);
    const char *name = glfwGetKeyName(key, scancode);
    if (name != NULL && is_printable((unsigned char)name[0]) && name[1] == '\0')
        return lower(name[0]);
    return key > 0 && is_printable((unsigned)key) ? lower(key) : 0;
}

/* ---- what GLFW calls ------------------------------------------------------------------------------- */

static struct spv_window *window_of(GLFWwindow *glfw)
{
    return glfwGetWindowUserPointer(glfw);
}

static void push(struct spv_window *w, const struct spv_event *event)
{
    w->key_queued = -1;
    spv_events_push(&w->queue, event, glfwGetTime());
}

static void on_key(GLFWwindow *glfw, int key, int scancode, int action, int mods)
{
    struct spv_window *w = window_of(glfw);
    short *down = &w->down[(unsigned)scancode % SCANCODES];
    struct spv_event e = {.kind = SPV_EVENT_KEY, .modifiers = modifiers_of(mods), .repeats = action == GLFW_REPEAT};
    if (action == GLFW_RELEASE) {
        e.kind = SPV_EVENT_KEY_UP;
        e.key = *down;
        *down = 0;
        if (e.key != 0)
            push(w, &e);
        return;
    }
    e.key = e.repeats && *down != 0 ? *down : key_of(key, scancode);
    if ((e.modifiers == SPV_CONTROL && e.key == 'v') || (e.modifiers == SPV_SHIFT && key == GLFW_KEY_INSERT)) {
        const char *text = e.repeats ? NULL : glfwGetClipboardString(glfw);
        if (text != NULL)
            push(w, &(struct spv_event){.kind = SPV_EVENT_PASTE, .path = text});
        return;
    }
    if (e.key == 0)
        return;
    *down = (short)e.key;
    push(w, &e);
    w->key_queued = scancode;
}

/* Follows at once the key that made it, and knows shift and the layout better. */
static void on_character(GLFWwindow *glfw, unsigned code)
{
    struct spv_window *w = window_of(glfw);
    if (w->key_queued < 0 || !is_printable(code) || w->queue.count == 0)
        return;
    struct spv_event *e = &w->queue.events[(w->queue.first + w->queue.count - 1) % SPV_EVENTS_MAX];
    if (e->kind != SPV_EVENT_KEY || e->key >= SPV_KEY_ESCAPE)
        return;
    e->key = lower((int)code);
    w->down[(unsigned)w->key_queued % SCANCODES] = (short)e->key;
    w->key_queued = -1;
}

/* The pointer, in pixels of the picture: GLFW's unit is the screen's, which may be larger. */
static void pointer(GLFWwindow *glfw, double x, double y, struct spv_event *e)
{
    int width, height, width_px, height_px;
    glfwGetWindowSize(glfw, &width, &height);
    glfwGetFramebufferSize(glfw, &width_px, &height_px);
    e->x = width > 0 ? x * width_px / width : x;
    e->y = height > 0 ? y * height_px / height : y;
}

/* Modifiers for events that GLFW gives none with. */
static unsigned modifiers_now(GLFWwindow *glfw)
{
    static const struct { int key; unsigned modifier; } keys[] = {
        {GLFW_KEY_LEFT_SHIFT, SPV_SHIFT}, {GLFW_KEY_RIGHT_SHIFT, SPV_SHIFT},
        {GLFW_KEY_LEFT_CONTROL, SPV_CONTROL}, {GLFW_KEY_RIGHT_CONTROL, SPV_CONTROL},
        {GLFW_KEY_LEFT_ALT, SPV_ALT}, {GLFW_KEY_RIGHT_ALT, SPV_ALT},
    };
    unsigned modifiers = 0;
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
        modifiers |= glfwGetKey(glfw, keys[i].key) == GLFW_PRESS ? keys[i].modifier : 0;
    return modifiers;
}

/*
 * Where the pointer was when the event came: by the move before it. The screen's own answer is where it is by
 * now, which after a slow frame is where a drag ends, not where it began.
 */
static void pointer_now(GLFWwindow *glfw, struct spv_event *event)
{
    const struct spv_window *w = window_of(glfw);
    double x = w->at[0], y = w->at[1];
    if (!w->pointed)
        glfwGetCursorPos(glfw, &x, &y);
    pointer(glfw, x, y, event);
}

static void on_button(GLFWwindow *glfw, int button, int action, int mods)
{
    struct spv_event e = {.kind = action == GLFW_PRESS ? SPV_EVENT_BUTTON : SPV_EVENT_BUTTON_UP,
                          .modifiers = modifiers_of(mods)};
    if (button == GLFW_MOUSE_BUTTON_LEFT)
        e.button = SPV_BUTTON_LEFT;
    else if (button == GLFW_MOUSE_BUTTON_RIGHT)
        e.button = SPV_BUTTON_RIGHT;
    else if (button == GLFW_MOUSE_BUTTON_MIDDLE)
        e.button = SPV_BUTTON_MIDDLE;
    else
        return;
    pointer_now(glfw, &e);
    push(window_of(glfw), &e);
}

static void on_move(GLFWwindow *glfw, double x, double y)
{
    struct spv_window *w = window_of(glfw);
    w->pointed = true;
    w->at[0] = x;
    w->at[1] = y;
    struct spv_event e = {.kind = SPV_EVENT_MOVE, .modifiers = modifiers_now(glfw)};
    pointer(glfw, x, y, &e);
    push(window_of(glfw), &e);
}

static void on_wheel(GLFWwindow *glfw, double across, double steps)
{
    (void)across;
    struct spv_event e = {.kind = SPV_EVENT_WHEEL, .modifiers = modifiers_now(glfw), .steps = steps};
    if (steps == 0)
        return;
    pointer_now(glfw, &e);
    push(window_of(glfw), &e);
}

static void on_size(GLFWwindow *glfw, int width, int height)
{
    if (width > 0 && height > 0)    /* not as an icon */
        push(window_of(glfw), &(struct spv_event){.kind = SPV_EVENT_RESIZE, .width = width, .height = height});
}

static void on_refresh(GLFWwindow *glfw)
{
    int width, height;
    glfwGetFramebufferSize(glfw, &width, &height);
    on_size(glfw, width, height);
}

static void on_drop(GLFWwindow *glfw, int count, const char **paths)
{
    for (int i = 0; i < count; i++)
        push(window_of(glfw), &(struct spv_event){.kind = SPV_EVENT_DROP, .path = paths[i]});
}

/* The program decides. */
static void on_close(GLFWwindow *glfw)
{
    glfwSetWindowShouldClose(glfw, GLFW_FALSE);
    push(window_of(glfw), &(struct spv_event){.kind = SPV_EVENT_CLOSE});
}

static void listen(GLFWwindow *glfw)
{
    glfwSetKeyCallback(glfw, on_key);
    glfwSetCharCallback(glfw, on_character);
    glfwSetMouseButtonCallback(glfw, on_button);
    glfwSetCursorPosCallback(glfw, on_move);
    glfwSetScrollCallback(glfw, on_wheel);
    glfwSetFramebufferSizeCallback(glfw, on_size);
    glfwSetWindowRefreshCallback(glfw, on_refresh);
    glfwSetDropCallback(glfw, on_drop);
    glfwSetWindowCloseCallback(glfw, on_close);
}

/* ---- context --------------------------------------------------------------------------------------- */

static spv_gl_fn window_function(const struct spv_ctx *ctx, const char *name)
{
    (void)ctx;
    return (spv_gl_fn)glfwGetProcAddress(name);
}

static bool window_is_current(const struct spv_ctx *ctx)
{
    return glfwGetCurrentContext() == ((const struct spv_window *)ctx)->glfw;
}

static void window_keeps_it(struct spv_ctx *ctx)
{
    (void)ctx;
}

/* What GLFW says of its last error, to be put behind our own words. */
static const char *reason(void)
{
    const char *text = NULL;
    glfwGetError(&text);
    return text == NULL ? "no reason given" : text;
}

static GLFWwindow *open_window(const char *title, int width, int height)
{
    static const int versions[][2] = {{4, 5}, {3, 3}};
    GLFWwindow *glfw = NULL;
    for (int i = 0; i < 2 && glfw == NULL; i++) {
        glfwDefaultWindowHints();
        glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, versions[i][0]);
        glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, versions[i][1]);
        glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
        glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
        glfwWindowHint(GLFW_DEPTH_BITS, 0);             /* pictures are put here, not drawn */
        glfwWindowHint(GLFW_STENCIL_BITS, 0);
        glfwWindowHint(GLFW_ALPHA_BITS, 0);             /* or the desktop shines through */
        glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
        glfw = glfwCreateWindow(width, height, title, NULL, NULL);
    }
    return glfw;
}

enum spc_status spv_window_create(const char *title, int width, int height, struct spv_window **out,
                                  struct spc_error *err)
{
    static const struct spv_ctx_kind kind = {window_function, window_is_current, window_keeps_it};
    *out = NULL;
    struct spv_window *w = calloc(1, sizeof *w);
    if (w == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a window");
    w->base = (struct spv_ctx){&kind, "window"};
    w->key_queued = -1;
    if (!glfwInit()) {
        const enum spc_status status = spc_fail(err, SPC_FEATURE, SPC_NO_OFF,
            "no display: use spc-render or --script (%s)", reason());
        free(w);
        return status;
    }
    w->glfw = open_window(title, width > 0 ? width : 1, height > 0 ? height : 1);
    if (w->glfw == NULL) {
        const enum spc_status status = spc_fail(err, SPC_FEATURE, SPC_NO_OFF,
            "no window with OpenGL 3.3: use spc-render or --script (%s)", reason());
        spv_window_free(w);
        return status;
    }
    glfwSetWindowUserPointer(w->glfw, w);
    glfwSetWindowSizeLimits(w->glfw, 64, 48, GLFW_DONT_CARE, GLFW_DONT_CARE);
    listen(w->glfw);
    glfwMakeContextCurrent(w->glfw);
    glfwSwapInterval(1);
    *out = w;
    return SPC_OK;
}

void spv_window_free(struct spv_window *window)
{
    if (window == NULL)
        return;
    if (window->glfw != NULL)
        glfwDestroyWindow(window->glfw);
    glfwTerminate();
    spv_events_release(&window->queue);
    free(window);
}

struct spv_ctx *spv_window_ctx(const struct spv_window *window)
{
    return (struct spv_ctx *)&window->base;
}

/* ---- the window ------------------------------------------------------------------------------------ */

void spv_window_size(const struct spv_window *window, int *width, int *height)
{
    *width = *height = 0;
    if (!glfwGetWindowAttrib(window->glfw, GLFW_ICONIFIED))
        glfwGetFramebufferSize(window->glfw, width, height);
}

double spv_window_scale(const struct spv_window *window)
{
    float x = 1, y = 1;
    glfwGetWindowContentScale(window->glfw, &x, &y);
    return fmaxf(x, y) > 0 ? fmaxf(x, y) : 1;
}

bool spv_window_event(struct spv_window *window, struct spv_event *event)
{
    return spv_events_take(&window->queue, event);
}

void spv_window_wait(struct spv_window *window, double timeout_s)
{
    if (timeout_s == 0 || window->queue.count > 0)
        glfwPollEvents();
    else if (timeout_s < 0)
        glfwWaitEvents();
    else
        glfwWaitEventsTimeout(timeout_s);
}

void spv_window_wake(struct spv_window *window)
{
    (void)window;
    glfwPostEmptyEvent();
}

void spv_window_swap(struct spv_window *window)
{
    glfwSwapBuffers(window->glfw);
}

void spv_window_title(struct spv_window *window, const char *title)
{
    glfwSetWindowTitle(window->glfw, title);
}

const char *spv_window_clipboard(struct spv_window *window)
{
    return glfwGetClipboardString(window->glfw);
}

void spv_window_set_clipboard(struct spv_window *window, const char *text)
{
    glfwSetClipboardString(window->glfw, text);
}

static int64_t overlap(int64_t a, int64_t a_size, int64_t b, int64_t b_size)
{
    const int64_t first = a > b ? a : b, last = a + a_size < b + b_size ? a + a_size : b + b_size;
    return last - first;
}

/* The screen that shows most of the window, as GLFW has no such question. */
static GLFWmonitor *screen_of(GLFWwindow *glfw)
{
    int count = 0, x, y, width, height;
    GLFWmonitor **screens = glfwGetMonitors(&count), *best = glfwGetPrimaryMonitor();
    int64_t most = 0;
    glfwGetWindowPos(glfw, &x, &y);
    glfwGetWindowSize(glfw, &width, &height);
    for (int i = 0; i < count; i++) {
        const GLFWvidmode *mode = glfwGetVideoMode(screens[i]);
        int left, top;
        if (mode == NULL)
            continue;
        glfwGetMonitorPos(screens[i], &left, &top);
        const int64_t across = overlap(x, width, left, mode->width), down = overlap(y, height, top, mode->height);
        if (across > 0 && down > 0 && across * down > most) {
            most = across * down;
            best = screens[i];
        }
    }
    return best;
}

bool spv_window_toggle_full_screen(struct spv_window *window)
{
    if (window->full_screen) {
        glfwSetWindowMonitor(window->glfw, NULL, window->x, window->y, window->width, window->height,
                             GLFW_DONT_CARE);
        window->full_screen = false;
        return true;
    }
    GLFWmonitor *screen = screen_of(window->glfw);
    const GLFWvidmode *mode = screen == NULL ? NULL : glfwGetVideoMode(screen);
    if (mode == NULL)
        return false;
    glfwGetWindowPos(window->glfw, &window->x, &window->y);
    glfwGetWindowSize(window->glfw, &window->width, &window->height);
    glfwSetWindowMonitor(window->glfw, screen, 0, 0, mode->width, mode->height, mode->refreshRate);
    window->full_screen = true;
    return true;
}
