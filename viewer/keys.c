#include "keys.h"

#include <stdio.h>
#include <string.h>

static const struct {
    int key;
    const char *name, *text;        /* in scripts, for people */
} KEYS[] = {
    {SPV_KEY_ESCAPE, "escape", "Esc"}, {SPV_KEY_ENTER, "enter", "Enter"}, {SPV_KEY_TAB, "tab", "Tab"},
    {SPV_KEY_BACKSPACE, "backspace", "Backspace"}, {SPV_KEY_DELETE, "delete", "Delete"},
    {SPV_KEY_LEFT, "left", "Left"}, {SPV_KEY_RIGHT, "right", "Right"}, {SPV_KEY_UP, "up", "Up"},
    {SPV_KEY_DOWN, "down", "Down"}, {SPV_KEY_PAGE_UP, "pageup", "Page Up"},
    {SPV_KEY_PAGE_DOWN, "pagedown", "Page Down"}, {SPV_KEY_HOME, "home", "Home"}, {SPV_KEY_END, "end", "End"},
    {' ', "space", "Space"}, {'#', "hash", "#"},    /* # begins a comment */
};

static const struct {
    unsigned modifier;
    const char *name, *text;
} MODIFIERS[] = {
    {SPV_CONTROL, "ctrl", "Ctrl+"}, {SPV_ALT, "alt", "Alt+"}, {SPV_SHIFT, "shift", "Shift+"},
};

/* In ASCII, whatever the locale. */
static char lower(char c)
{
    return c >= 'A' && c <= 'Z' ? (char)(c - 'A' + 'a') : c;
}

static bool same(const char *name, size_t length, const char *word)
{
    if (length != strlen(word))
        return false;
    for (size_t i = 0; i < length; i++)
        if (lower(name[i]) != word[i])
            return false;
    return true;
}

int spv_key_find(const char *name, size_t length)
{
    if (length == 1 && name[0] > ' ' && name[0] < 0x7F)
        return lower(name[0]);
    for (size_t i = 0; i < sizeof KEYS / sizeof *KEYS; i++)
        if (same(name, length, KEYS[i].name))
            return KEYS[i].key;
    for (int f = 0; f < 12; f++) {
        char word[16];
        snprintf(word, sizeof word, "f%d", f + 1);
        if (same(name, length, word))
            return SPV_KEY_F1 + f;
    }
    return 0;
}

const char *spv_key_text(int key, unsigned modifiers, char text[SPV_KEY_TEXT])
{
    char name[16] = "";
    if (key > ' ' && key < 0x7F)
        snprintf(name, sizeof name, "%c", key >= 'a' && key <= 'z' ? key - 'a' + 'A' : key);
    else if (key >= SPV_KEY_F1 && key <= SPV_KEY_F12)
        snprintf(name, sizeof name, "F%d", key - SPV_KEY_F1 + 1);
    for (size_t i = 0; i < sizeof KEYS / sizeof *KEYS; i++)
        if (KEYS[i].key == key)
            snprintf(name, sizeof name, "%s", KEYS[i].text);
    text[0] = '\0';
    for (size_t i = 0; name[0] != '\0' && i < sizeof MODIFIERS / sizeof *MODIFIERS; i++)
        if (modifiers & MODIFIERS[i].modifier)
            strcat(text, MODIFIERS[i].text);
    return strcat(text, name);
}

unsigned spv_key_modifier(const char *name, size_t length)
{
    for (size_t i = 0; i < sizeof MODIFIERS / sizeof *MODIFIERS; i++)
        if (same(name, length, MODIFIERS[i].name))
            return MODIFIERS[i].modifier;
    return 0;
}
