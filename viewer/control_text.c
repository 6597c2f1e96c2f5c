/* control_text.c - the camera as a line of text that spc-render takes. */
#include "control.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

bool spv_control_format(const struct spv_control *c, char *text, size_t size)
{
    const struct spv_pose *p = &c->pose;
    const int n = snprintf(text, size,
                           "--eye %.17g,%.17g,%.17g --target %.17g,%.17g,%.17g --up %.17g,%.17g,%.17g --fov %.17g",
                           p->eye[0], p->eye[1], p->eye[2], p->target[0], p->target[1], p->target[2], p->up[0],
                           p->up[1], p->up[2], p->fov_deg);
    if (n >= 0 && (size_t)n < size)
        return true;
    if (size > 0)
        text[0] = '\0';
    return false;
}

static const char *skip_space(const char *text)
{
    return text + strspn(text, " \t\r\n");
}

/* count numbers with commas between; the end of them, or NULL. */
static const char *read_numbers(const char *text, double *out, int count)
{
    for (int i = 0; i < count; i++) {
        char *end;
        /* strtod would also take spaces, infinities and hexadecimal digits. */
        if (text[strspn(text, "+-.")] < '0' || text[strspn(text, "+-.")] > '9')
            return NULL;
        const size_t digits = strspn(text, "0123456789+-.eE");
        out[i] = strtod(text, &end);
        if (end != text + digits || !isfinite(out[i]))
            return NULL;
        text = end;
        if (i + 1 < count && *text++ != ',')
            return NULL;
    }
    return text;
}

bool spv_control_parse(struct spv_control *c, const char *text)
{
    struct spv_pose pose = {.fov_deg = 0};
    const struct {
        const char *name;
        double *out;
        int count;
    } options[] = {{"--eye", pose.eye, 3}, {"--target", pose.target, 3}, {"--up", pose.up, 3},
                   {"--fov", &pose.fov_deg, 1}};
    unsigned seen = 0;
    for (text = skip_space(text); *text != '\0'; text = skip_space(text)) {
        const size_t word = strcspn(text, " \t\r\n");
        int i = 0;
        while (i < 4 && (strlen(options[i].name) != word || strncmp(text, options[i].name, word) != 0))
            i++;
        if (i == 4 || seen >> i & 1)
            return false;
        seen |= 1u << i;
        text = read_numbers(skip_space(text + word), options[i].out, options[i].count);
        if (text == NULL)
            return false;
    }
    return seen == 15 && spv_control_place(c, &pose);
}
