/*
 * ctx.h - ways to get an OpenGL context.
 */
#ifndef SPV_CTX_H
#define SPV_CTX_H

#include "spc.h"

struct spv_ctx;

typedef void (*spv_gl_fn)(void);

/*
 * A context without a display, rendered by the processor: OpenGL 3.3 core or later. It is current
 * on the calling thread until it is freed. fails SPC_FEATURE (no such context), SPC_NO_MEMORY
 */
enum spc_status spv_ctx_osmesa(struct spv_ctx **out, struct spc_error *err);
void spv_ctx_free(struct spv_ctx *ctx);

/* Address of a GL function by name; NULL when there is none. */
spv_gl_fn spv_ctx_function(const struct spv_ctx *ctx, const char *name);

#endif
