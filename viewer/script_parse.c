/*
 * script_parse.c - a text becomes commands.
 *
 * A line is cut into words in place, in the script's own copy of the text; names of files stay there.
 */
#include "script_int.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { WORDS_MAX = 24 };

struct line {
    char *words[WORDS_MAX];
    int count, next;
    unsigned number;
    struct spc_error *err;
    const char *base;               /* the script's text */
};

static bool fail(const struct line *l, const char *word, const char *what)
{
    spc_fail(l->err, SPC_INPUT_FORMAT, SPC_NO_OFF, "line %u: '%.60s' %s", l->number, word, what);
    return false;
}

static bool take_word(struct line *l, const char **word, const char *what)
{
    if (l->next == l->count)
        return fail(l, l->words[0], what);
    *word = l->words[l->next++];
    return true;
}

static bool is_number(const char *word, double *out)
{
    char *end;
    /* strtod would also take infinities and hexadecimal digits. */
    if (word[strspn(word, "0123456789+-.eE")] != '\0' || word[strcspn(word, "0123456789")] == '\0')
        return false;
    *out = strtod(word, &end);
    return *end == '\0' && isfinite(*out);
}

static bool take_numbers(struct line *l, double *out, int count)
{
    for (int i = 0; i < count; i++) {
        const char *word;
        if (!take_word(l, &word, "takes more numbers"))
            return false;
        if (!is_number(word, &out[i]))
            return fail(l, word, "is not a number");
    }
    return true;
}

static bool take_whole(struct line *l, unsigned max, unsigned *out)
{
    double number;
    if (!take_numbers(l, &number, 1))
        return false;
    if (!(number >= 1 && number <= max) || number != floor(number))
        return fail(l, l->words[l->next - 1], "is not a whole number in range");
    *out = (unsigned)number;
    return true;
}

static bool take_choice(struct line *l, const char *const *list, int count, int *out)
{
    const char *word;
    if (!take_word(l, &word, "takes another word"))
        return false;
    for (int i = 0; i < count; i++)
        if (strcmp(word, list[i]) == 0) {
            *out = i;
            return true;
        }
    return fail(l, word, "is not known here");
}

static void take_modifiers(struct line *l, unsigned *out)
{
    for (unsigned m; l->next < l->count; l->next++, *out |= m)
        if ((m = spv_key_modifier(l->words[l->next], strlen(l->words[l->next]))) == 0)
            return;
}

static bool take_named(struct line *l, const char *name, double out[3])
{
    int i;
    return take_choice(l, &name, 1, &i) && take_numbers(l, out, 3);
}

/* eye X Y Z target X Y Z [up X Y Z], the first word being taken already or not. */
static bool take_pose(struct line *l, bool named, struct command *c)
{
    if (!(named ? take_numbers(l, c->number, 3) : take_named(l, "eye", c->number)) ||
        !take_named(l, "target", c->number + 3))
        return false;
    return l->next == l->count || take_named(l, "up", c->number + 6);
}

static bool take_key(struct line *l, struct command *c)
{
    const char *word;
    if (!take_word(l, &word, "takes the name of a key"))
        return false;
    c->key = spv_key_find(word, strlen(word));
    if (c->key == 0)
        return fail(l, word, "is not a key");
    take_modifiers(l, &c->modifiers);
    return l->next == l->count || take_whole(l, SPV_SCRIPT_FRAMES, &c->frames);
}

static bool take_drag(struct line *l, struct command *c)
{
    static const char *const buttons[] = {"left", "right", "middle"};       /* as enum spv_button */
    if (!take_choice(l, buttons, 3, &c->key) || !take_numbers(l, c->number, 4) ||
        !take_whole(l, SPV_SCRIPT_FRAMES, &c->frames))
        return false;
    take_modifiers(l, &c->modifiers);
    return true;
}

static bool take_size(struct line *l, struct command *c)
{
    unsigned width, height;
    if (!take_whole(l, 65535, &width) || !take_whole(l, 65535, &height))
        return false;
    c->number[0] = width;
    c->number[1] = height;
    return true;
}

static bool take_path(struct line *l, struct command *c)
{
    const char *word;
    if (!take_word(l, &word, "takes the name of a file"))
        return false;
    c->path_off = (size_t)(word - l->base);
    return true;
}

static bool take_positive(struct line *l, double *out)
{
    if (!take_numbers(l, out, 1))
        return false;
    return *out > 0 || fail(l, l->words[l->next - 1], "is not above 0");
}

static const char *const NAMES[] = {        /* as enum command_kind */
    "frames", "wait", "fit", "orbit", "turn", "eye", "path", "key", "drag", "wheel", "doubleclick", "resize", "eps",
    "mode", "splat", "open", "screenshot", "quit"};
enum { NAME_COUNT = sizeof NAMES / sizeof *NAMES };

static bool take_rest(struct line *l, struct command *c)
{
    static const char *const modes[] = {"hybrid", "points", "triangles"};
    static const char *const splats[] = {"exact", "fast"};
    switch (c->kind) {
    case COMMAND_FRAMES: return take_whole(l, SPV_SCRIPT_FRAMES, &c->frames);
    case COMMAND_ORBIT:
        return take_numbers(l, c->number, 2) && (l->next == l->count || take_positive(l, c->number + 2));
    case COMMAND_TURN: return take_numbers(l, c->number, 2) && take_whole(l, SPV_SCRIPT_FRAMES, &c->frames);
    case COMMAND_EYE: return take_pose(l, true, c);
    case COMMAND_PATH: return take_whole(l, SPV_SCRIPT_FRAMES, &c->frames) && take_pose(l, false, c);
    case COMMAND_KEY: return take_key(l, c);
    case COMMAND_DRAG: return take_drag(l, c);
    case COMMAND_WHEEL: return take_numbers(l, c->number, 3);
    case COMMAND_DOUBLECLICK: return take_numbers(l, c->number, 2);
    case COMMAND_RESIZE: return take_size(l, c);
    case COMMAND_EPS: return take_positive(l, c->number);
    case COMMAND_MODE: return take_choice(l, modes, 3, &c->key);
    case COMMAND_SPLAT: return take_choice(l, splats, 2, &c->key);
    case COMMAND_OPEN:
    case COMMAND_SCREENSHOT: return take_path(l, c);
    case COMMAND_WAIT:
    case COMMAND_FIT:
    case COMMAND_QUIT: break;
    }
    return true;
}

static bool is_space(char c)
{
    return c == ' ' || c == '\t' || c == '\r';
}

/* The end of what counts: before a comment, and before spaces. A name of a file may hold a # inside. */
static char *end_of(char *from, bool file)
{
    char *end = from + strlen(from);
    for (char *p = from; *p != '\0'; p++)
        if (*p == '#' && (!file || p == from || is_space(p[-1]))) {
            end = p;
            break;
        }
    while (end > from && is_space(end[-1]))
        end--;
    return end;
}

/* A name of a file is one word, with the spaces it has. */
static bool cut(char *text, struct line *l)
{
    l->count = l->next = 0;
    while (is_space(*text))
        text++;
    const size_t first = strcspn(text, " \t\r#");
    const bool file = (first == 4 && strncmp(text, "open", 4) == 0) ||
                      (first == 10 && strncmp(text, "screenshot", 10) == 0);
    *end_of(text, file) = '\0';
    while (*text != '\0') {
        if (l->count == WORDS_MAX)
            return fail(l, text, "is one word too many");
        l->words[l->count++] = text;
        if (file && l->count == 2)
            break;
        while (*text != '\0' && !is_space(*text))
            text++;
        while (is_space(*text))
            *text++ = '\0';
    }
    return true;
}

static bool parse_line(struct line *l, struct command *c)
{
    int kind;
    *c = (struct command){.line = l->number};
    if (!take_choice(l, NAMES, NAME_COUNT, &kind))
        return false;
    c->kind = (enum command_kind)kind;
    if (!take_rest(l, c))
        return false;
    return l->next == l->count || fail(l, l->words[l->next], "is one word too many");
}

static enum spc_status parse_all(struct spv_script *s, size_t bytes, size_t room, struct spc_error *err)
{
    struct line l = {.err = err, .base = s->text};
    for (char *text = s->text, *next; text < s->text + bytes; text = next) {
        char *end = memchr(text, '\n', (size_t)(s->text + bytes - text));
        end = end != NULL ? end : s->text + bytes;
        next = end + 1;
        *end = '\0';
        l.number++;
        if (end - text > SPV_SCRIPT_LINE)
            return spc_fail(err, SPC_LIMIT, SPC_NO_OFF, "line %u is longer than %d bytes", l.number, SPV_SCRIPT_LINE);
        if (strlen(text) != (size_t)(end - text))
            return spc_fail(err, SPC_INPUT_FORMAT, SPC_NO_OFF, "line %u holds a zero byte: no text", l.number);
        if (!cut(text, &l))
            return SPC_INPUT_FORMAT;
        if (l.count == 0)
            continue;
        if (s->count == room)
            return spc_fail(err, SPC_LIMIT, SPC_NO_OFF, "line %u: more than %zu commands", l.number, room);
        if (!parse_line(&l, &s->commands[s->count]))
            return SPC_INPUT_FORMAT;
        s->count++;
    }
    return SPC_OK;
}

enum spc_status spv_script_parse(const char *text, size_t bytes, struct spv_script **out, struct spc_error *err)
{
    size_t room = 1;                /* lines bound the commands */
    *out = NULL;
    if (bytes > SPV_SCRIPT_BYTES)
        return spc_fail(err, SPC_LIMIT, SPC_NO_OFF, "a script of more than %d bytes", SPV_SCRIPT_BYTES);
    for (size_t i = 0; i < bytes && room < SPV_SCRIPT_COMMANDS; i++)
        room += text[i] == '\n';
    struct spv_script *s = calloc(1, sizeof *s + room * sizeof *s->commands);
    if (s == NULL || (s->text = malloc(bytes + 1)) == NULL) {
        free(s);
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a script of %zu bytes", bytes);
    }
    if (bytes > 0)
        memcpy(s->text, text, bytes);
    s->text[bytes] = '\0';
    const enum spc_status status = parse_all(s, bytes, room, err);
    if (status == SPC_OK)
        *out = s;
    else
        spv_script_free(s);
    return status;
}

void spv_script_free(struct spv_script *s)
{
    if (s == NULL)
        return;
    free(s->text);
    free(s);
}
