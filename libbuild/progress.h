/* progress.h - how far a build is, told to whoever asked. */
#ifndef SPB_PROGRESS_H
#define SPB_PROGRESS_H

#include <stdint.h>

/*
 * Called at most once a batch with what is done of the phase, in the phase's own measure (bytes
 * read, parts built, bytes written). Non-zero cancels the build. Where
 * one is asked for, NULL serves as none.
 */
struct spb_progress {
    int (*fn)(void *ctx, const char *phase, uint64_t done, uint64_t total);     /* may be NULL */
    void *ctx;
};

static inline int spb_progress_tell(const struct spb_progress *p, const char *phase, uint64_t done,
                                    uint64_t total)
{
    return p && p->fn ? p->fn(p->ctx, phase, done, total) : 0;
}

#endif
