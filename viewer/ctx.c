#include "ctx_int.h"

void spv_ctx_free(struct spv_ctx *ctx)
{
    if (ctx != NULL)
        ctx->kind->free(ctx);
}

spv_gl_fn spv_ctx_function(const struct spv_ctx *ctx, const char *name)
{
    return ctx->kind->function(ctx, name);
}

bool spv_ctx_is_current(const struct spv_ctx *ctx)
{
    return ctx->kind->is_current(ctx);
}

const char *spv_ctx_name(const struct spv_ctx *ctx)
{
    return ctx->name;
}
