#include "spc.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

const char *spc_status_text(enum spc_status status)
{
    switch (status) {
#define X(name, value, text) \
    case SPC_##name:         \
        return text;
        SPC_STATUS_LIST(X)
#undef X
    }
    return "unknown status";
}

const char *spc_status_name(enum spc_status status)
{
    switch (status) {
#define X(name, value, text) \
    case SPC_##name:         \
        return #name;
        SPC_STATUS_LIST(X)
#undef X
    }
    return "UNKNOWN";
}

/* Bytes of a file may end up in a message: nothing that a terminal would act on gets through. */
static void mask_controls(char *text)
{
    for (; *text; text++)
        if ((unsigned char)*text < 0x20 || *text == 0x7F)
            *text = '?';
}

static void fill(struct spc_error *err, enum spc_status status, int os_errno, uint64_t at_off,
                 const char *fmt, va_list args)
{
    if (err == NULL || err->status != SPC_OK)
        return;                     /* the first error is the cause; later ones are its echo */
    err->status = status;
    err->os_errno = os_errno;
    err->at_off = at_off;
    vsnprintf(err->what, sizeof err->what, fmt, args);
    if (os_errno != 0) {
        const size_t used = strlen(err->what);
        snprintf(err->what + used, sizeof err->what - used, ": %s", strerror(os_errno));
    }
    mask_controls(err->what);
}

enum spc_status spc_fail(struct spc_error *err, enum spc_status status, uint64_t at_off,
                         const char *fmt, ...)
{
    va_list args;
    va_start(args, fmt);
    fill(err, status, 0, at_off, fmt, args);
    va_end(args);
    return status;
}

enum spc_status spc_fail_os(struct spc_error *err, int os_errno, const char *fmt, ...)
{
    va_list args;
    va_start(args, fmt);
    fill(err, SPC_IO, os_errno, SPC_NO_OFF, fmt, args);
    va_end(args);
    return SPC_IO;
}
