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

enum spv_ctx_wish {
    SPV_CTX_ANY,                    /* a GPU if there is one, else the processor */
    SPV_CTX_GPU                     /* a GPU or none */
};

/*
 * A context of EGL without a display and without a surface: OpenGL 4.5 core where there is it, else
 * 3.3. Current as above. EGL is looked for when this is called, no program needs it to start.
 * fails  SPC_FEATURE (no EGL, no such context, no GPU), SPC_NO_MEMORY
 */
enum spc_status spv_ctx_egl(enum spv_ctx_wish wish, struct spv_ctx **out, struct spc_error *err);

/* Frees a context, and takes it off this thread. NULL and the context of a window are left alone. */
void spv_ctx_free(struct spv_ctx *ctx);

/* Address of a GL function by name; NULL when there is none. An address proves no support. */
spv_gl_fn spv_ctx_function(const struct spv_ctx *ctx, const char *name);

/* Is it this thread's context? Only then may GL be called. */
bool spv_ctx_is_current(const struct spv_ctx *ctx);

/* Where it comes from, such as "EGL, GPU device". Borrowed. */
const char *spv_ctx_name(const struct spv_ctx *ctx);

/* Does the processor draw, by the renderer's own name? The context must be current. */
bool spv_ctx_is_software(const struct spv_ctx *ctx);

#endif
