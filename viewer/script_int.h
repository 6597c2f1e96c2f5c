/* script_int.h - commands as script_parse.c reads them and script.c plays them. */
#ifndef SPV_SCRIPT_INT_H
#define SPV_SCRIPT_INT_H

#include "script.h"

enum command_kind {
    COMMAND_FRAMES, COMMAND_WAIT, COMMAND_FIT, COMMAND_ORBIT, COMMAND_TURN, COMMAND_EYE, COMMAND_PATH, COMMAND_KEY,
    COMMAND_DRAG, COMMAND_WHEEL, COMMAND_DOUBLECLICK, COMMAND_RESIZE, COMMAND_EPS, COMMAND_MODE, COMMAND_SPLAT,
    COMMAND_OPEN, COMMAND_SCREENSHOT, COMMAND_QUIT
};

struct command {
    enum command_kind kind;
    unsigned line, frames, modifiers;
    int key;                        /* or button, or place in a list of words */
    double number[9];               /* eye, target, up; or what the command names, in its order */
    size_t path_off;                /* in the script's text */
};

struct spv_script {
    char *text;                     /* names of files end with a zero here */
    size_t count;
    struct command commands[];
};

#endif
