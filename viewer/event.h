/*
 * event.h - what a user does: from a window or a script, to whoever acts on it.
 */
#ifndef SPV_EVENT_H
#define SPV_EVENT_H

#include <stdbool.h>

enum spv_event_kind {
    SPV_EVENT_KEY,                  /* key went down, or repeats */
    SPV_EVENT_KEY_UP,
    SPV_EVENT_BUTTON,               /* button went down at x, y; clicks: 2 for the second of a double click */
    SPV_EVENT_BUTTON_UP,
    SPV_EVENT_MOVE,                 /* pointer is at x, y now */
    SPV_EVENT_WHEEL,                /* steps at x, y; away from the user is positive */
    SPV_EVENT_RESIZE,               /* the picture has width x height pixels now */
    SPV_EVENT_DROP,                 /* a file was dropped: path */
    SPV_EVENT_PASTE,                /* text came from the clipboard: path */
    SPV_EVENT_CLOSE
};

/* Printable keys are their lower-case ASCII character (layout applied). */
enum spv_key {
    SPV_KEY_ESCAPE = 256, SPV_KEY_ENTER, SPV_KEY_TAB, SPV_KEY_BACKSPACE, SPV_KEY_DELETE,
    SPV_KEY_LEFT, SPV_KEY_RIGHT, SPV_KEY_UP, SPV_KEY_DOWN, SPV_KEY_PAGE_UP, SPV_KEY_PAGE_DOWN, SPV_KEY_HOME,
    SPV_KEY_END, SPV_KEY_F1, SPV_KEY_F12 = SPV_KEY_F1 + 11
};

enum spv_button { SPV_BUTTON_LEFT, SPV_BUTTON_RIGHT, SPV_BUTTON_MIDDLE };
enum { SPV_SHIFT = 1, SPV_CONTROL = 2, SPV_ALT = 4 };

struct spv_event {
    enum spv_event_kind kind;
    int key, button, clicks;
    unsigned modifiers;             /* SPV_SHIFT ... */
    bool repeats;                   /* key held down */
    double x, y;                    /* px of the picture, from its top left */
    double steps;
    int width, height;              /* px */
    const char *path;               /* until the next event is taken */
};

#endif
