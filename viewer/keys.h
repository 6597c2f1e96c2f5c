/* keys.h - names of keys, for scripts and for people. */
#ifndef SPV_KEYS_H
#define SPV_KEYS_H

#include "event.h"

#include <stddef.h>

enum { SPV_KEY_TEXT = 32 };         /* bytes of the longest name with all modifiers, and its zero */

/* Key of a name of length bytes, any case: 'escape', 'f12', 'space', or the character itself; 0: none. */
int spv_key_find(const char *name, size_t length);

/* "Ctrl+Shift+Page Up" as people read it; empty for what is no key. Returns text. */
const char *spv_key_text(int key, unsigned modifiers, char text[SPV_KEY_TEXT]);

/* SPV_SHIFT, SPV_CONTROL or SPV_ALT of 'shift', 'ctrl' or 'alt', any case; 0: none of them. */
unsigned spv_key_modifier(const char *name, size_t length);

#endif
