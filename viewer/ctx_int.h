/*
 * ctx_int.h - what every kind of context begins with.
 */
#ifndef SPV_CTX_INT_H
#define SPV_CTX_INT_H

#include "ctx.h"

struct spv_ctx_kind {
    spv_gl_fn (*function)(const struct spv_ctx *ctx, const char *name);
    bool (*is_current)(const struct spv_ctx *ctx);
    void (*free)(struct spv_ctx *ctx);
};

struct spv_ctx {                    /* first member of a kind's own struct */
    const struct spv_ctx_kind *kind;
    const char *name;               /* of static storage */
};

#endif
