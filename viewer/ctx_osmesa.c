/*
 * ctx_osmesa.c - the only file that knows OSMesa.
 *
 * Pictures go to a framebuffer object, so the buffer that OSMesa insists on stays tiny.
 */
#include "ctx_int.h"

#include <GL/osmesa.h>
#include <stdlib.h>

enum { SIDE = 16 };

struct osmesa {
    struct spv_ctx base;
    OSMesaContext mesa;
    unsigned char buffer[SIDE * SIDE * 4];
};

static spv_gl_fn osmesa_function(const struct spv_ctx *ctx, const char *name)
{
    (void)ctx;
    return (spv_gl_fn)OSMesaGetProcAddress(name);
}

static bool osmesa_is_current(const struct spv_ctx *ctx)
{
    return OSMesaGetCurrentContext() == ((const struct osmesa *)ctx)->mesa;
}

static void osmesa_free(struct spv_ctx *ctx)
{
    struct osmesa *o = (struct osmesa *)ctx;
    if (o->mesa != NULL)
        OSMesaDestroyContext(o->mesa);
    free(o);
}

enum spc_status spv_ctx_osmesa(struct spv_ctx **out, struct spc_error *err)
{
    static const struct spv_ctx_kind kind = {osmesa_function, osmesa_is_current, osmesa_free};
    static const int attributes[] = {
        OSMESA_FORMAT, OSMESA_RGBA, OSMESA_DEPTH_BITS, 0, OSMESA_PROFILE, OSMESA_CORE_PROFILE,
        OSMESA_CONTEXT_MAJOR_VERSION, 3, OSMESA_CONTEXT_MINOR_VERSION, 3, 0,
    };
    *out = NULL;
    struct osmesa *o = calloc(1, sizeof *o);
    if (o == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for an OpenGL context");
    o->base = (struct spv_ctx){&kind, "OSMesa"};
    o->mesa = OSMesaCreateContextAttribs(attributes, NULL);
    if (o->mesa == NULL || !OSMesaMakeCurrent(o->mesa, o->buffer, GL_UNSIGNED_BYTE, SIDE, SIDE)) {
        osmesa_free(&o->base);
        return spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "OSMesa gives no OpenGL 3.3 core context");
    }
    *out = &o->base;
    return SPC_OK;
}
