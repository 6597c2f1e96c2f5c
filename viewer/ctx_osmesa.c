/*
 * ctx_osmesa.c - the only file that knows OSMesa.
 *
 * Pictures go to a framebuffer object, so the buffer that OSMesa insists on stays tiny.
 */
#include "ctx.h"

#include <GL/osmesa.h>
#include <stdlib.h>

enum { SIDE = 16 };

struct spv_ctx {
    OSMesaContext mesa;
    unsigned char buffer[SIDE * SIDE * 4];
};

enum spc_status spv_ctx_osmesa(struct spv_ctx **out, struct spc_error *err)
{
    static const int attributes[] = {
        OSMESA_FORMAT, OSMESA_RGBA, OSMESA_DEPTH_BITS, 0, OSMESA_PROFILE, OSMESA_CORE_PROFILE,
        OSMESA_CONTEXT_MAJOR_VERSION, 3, OSMESA_CONTEXT_MINOR_VERSION, 3, 0,
    };
    *out = NULL;
    struct spv_ctx *ctx = calloc(1, sizeof *ctx);
    if (ctx == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for an OpenGL context");
    ctx->mesa = OSMesaCreateContextAttribs(attributes, NULL);
    if (ctx->mesa == NULL ||
        !OSMesaMakeCurrent(ctx->mesa, ctx->buffer, GL_UNSIGNED_BYTE, SIDE, SIDE)) {
        spv_ctx_free(ctx);
        return spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "OSMesa gives no OpenGL 3.3 core context");
    }
    *out = ctx;
    return SPC_OK;
}

void spv_ctx_free(struct spv_ctx *ctx)
{
    if (ctx == NULL)
        return;
    if (ctx->mesa != NULL)
        OSMesaDestroyContext(ctx->mesa);
    free(ctx);
}

spv_gl_fn spv_ctx_function(const struct spv_ctx *ctx, const char *name)
{
    (void)ctx;
    return (spv_gl_fn)OSMesaGetProcAddress(name);
}
