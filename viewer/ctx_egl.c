/*
 * ctx_egl.c - the only file that knows EGL.
 *
 * The library is opened by name when a context is asked for, and stays: Mesa leaves handlers in
 * threads that must find it. Displays are not terminated either: EGL hands out the same one again
 * for the same device without counting, so that would end other contexts of this process.
 */
#include "ctx_int.h"

#define EGL_NO_X11
#define EGL_NO_PLATFORM_SPECIFIC_TYPES
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>

#define EGL_FUNCTIONS(X)                                    \
    X(PFNEGLGETPROCADDRESSPROC, GetProcAddress)             \
    X(PFNEGLGETDISPLAYPROC, GetDisplay)                     \
    X(PFNEGLINITIALIZEPROC, Initialize)                     \
    X(PFNEGLQUERYSTRINGPROC, QueryString)                   \
    X(PFNEGLBINDAPIPROC, BindAPI)                           \
    X(PFNEGLCHOOSECONFIGPROC, ChooseConfig)                 \
    X(PFNEGLCREATECONTEXTPROC, CreateContext)               \
    X(PFNEGLDESTROYCONTEXTPROC, DestroyContext)             \
    X(PFNEGLCREATEPBUFFERSURFACEPROC, CreatePbufferSurface) \
    X(PFNEGLDESTROYSURFACEPROC, DestroySurface)             \
    X(PFNEGLMAKECURRENTPROC, MakeCurrent)                   \
    X(PFNEGLGETCURRENTCONTEXTPROC, GetCurrentContext)

struct egl {
    struct spv_ctx base;
#define X(type, name) type name;
    EGL_FUNCTIONS(X)
#undef X
    PFNEGLQUERYDEVICESEXTPROC query_devices;        /* these three are extensions: NULL without */
    PFNEGLQUERYDEVICESTRINGEXTPROC query_device_string;
    PFNEGLGETPLATFORMDISPLAYEXTPROC get_platform_display;
    EGLDisplay display;
    EGLContext context;
    EGLSurface surface;             /* EGL_NO_SURFACE where none is needed */
};

enum { DEVICES_MAX = 64 };

static spv_gl_fn egl_function(const struct spv_ctx *ctx, const char *name)
{
    return (spv_gl_fn)((const struct egl *)ctx)->GetProcAddress(name);
}

static bool egl_is_current(const struct spv_ctx *ctx)
{
    const struct egl *e = (const struct egl *)ctx;
    return e->context != EGL_NO_CONTEXT && e->GetCurrentContext() == e->context;
}

/* Leaves the display as if nothing had been made on it. */
static void drop_context(struct egl *e)
{
    if (egl_is_current(&e->base))
        e->MakeCurrent(e->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (e->context != EGL_NO_CONTEXT)
        e->DestroyContext(e->display, e->context);
    if (e->surface != EGL_NO_SURFACE)
        e->DestroySurface(e->display, e->surface);
    e->context = EGL_NO_CONTEXT;
    e->surface = EGL_NO_SURFACE;
}

static void egl_free(struct spv_ctx *ctx)
{
    drop_context((struct egl *)ctx);
    free(ctx);
}

/* Is word one of the words of list, which spaces part? */
static bool has_word(const char *list, const char *word)
{
    const size_t length = strlen(word);
    while (list != NULL && *list != '\0') {
        const size_t here = strcspn(list, " ");
        if (here == length && memcmp(list, word, length) == 0)
            return true;
        list += here + strspn(list + here, " ");
    }
    return false;
}

static enum spc_status load_egl(struct egl *e, struct spc_error *err)
{
    void *library = dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL);
    if (library == NULL)
        return spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "there is no EGL here: no libEGL.so.1");
#define X(type, name)                                                                           \
    e->name = (type)dlsym(library, "egl" #name);                                                \
    if (e->name == NULL)                                                                        \
        return spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "EGL lacks egl" #name);
    EGL_FUNCTIONS(X)
#undef X
    const char *have = e->QueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    if (has_word(have, "EGL_EXT_platform_base"))
        e->get_platform_display =
            (PFNEGLGETPLATFORMDISPLAYEXTPROC)e->GetProcAddress("eglGetPlatformDisplayEXT");
    const bool both = has_word(have, "EGL_EXT_device_base");
    if (both || has_word(have, "EGL_EXT_device_enumeration"))
        e->query_devices = (PFNEGLQUERYDEVICESEXTPROC)e->GetProcAddress("eglQueryDevicesEXT");
    if (both || has_word(have, "EGL_EXT_device_query"))
        e->query_device_string =
            (PFNEGLQUERYDEVICESTRINGEXTPROC)e->GetProcAddress("eglQueryDeviceStringEXT");
    if (!has_word(have, "EGL_EXT_platform_device"))
        e->query_devices = NULL;
    return SPC_OK;
}

/* A context on e->display, current without a surface, or with one of a pixel where EGL insists on it. */
static bool make_context(struct egl *e)
{
    static const EGLint versions[][2] = {{4, 5}, {3, 3}}, pbuffer[] = {EGL_WIDTH, 1, EGL_HEIGHT, 1, EGL_NONE};
    if (e->display == EGL_NO_DISPLAY || !e->Initialize(e->display, NULL, NULL) ||
        !e->BindAPI(EGL_OPENGL_API))
        return false;
    const char *have = e->QueryString(e->display, EGL_EXTENSIONS);
    const bool bare = has_word(have, "EGL_KHR_surfaceless_context");
    const EGLint wanted[] = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE,
                             bare ? 0 : EGL_PBUFFER_BIT, EGL_NONE};
    EGLConfig config = NULL;
    EGLint count = 0;
    if (!e->ChooseConfig(e->display, wanted, &config, 1, &count) || count < 1)
        return false;
    for (int i = 0; i < 2 && e->context == EGL_NO_CONTEXT; i++) {
        const EGLint attributes[] = {
            EGL_CONTEXT_MAJOR_VERSION, versions[i][0], EGL_CONTEXT_MINOR_VERSION, versions[i][1],
            EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE,
        };
        e->context = e->CreateContext(e->display, config, EGL_NO_CONTEXT, attributes);
    }
    if (e->context == EGL_NO_CONTEXT)
        return false;
    if (!bare)
        e->surface = e->CreatePbufferSurface(e->display, config, pbuffer);
    if ((bare || e->surface != EGL_NO_SURFACE) &&
        e->MakeCurrent(e->display, e->surface, e->surface, e->context))
        return true;
    drop_context(e);
    return false;
}

static bool on_platform(struct egl *e, EGLenum platform, void *native, const char *name)
{
    e->display = e->get_platform_display(platform, native, NULL);
    e->base.name = name;
    return make_context(e);
}

/* GPUs first. A device that does not say that it is software is taken for a GPU. */
static bool on_device(struct egl *e, enum spv_ctx_wish wish)
{
    EGLDeviceEXT devices[DEVICES_MAX];
    EGLint count = 0;
    if (!e->query_devices(DEVICES_MAX, devices, &count))
        return false;
    for (int software = 0; software <= (wish == SPV_CTX_ANY); software++)
        for (int i = 0; i < count && i < DEVICES_MAX; i++) {
            const char *have = e->query_device_string == NULL
                                   ? NULL : e->query_device_string(devices[i], EGL_EXTENSIONS);
            if (has_word(have, "EGL_MESA_device_software") != (software != 0) ||
                !on_platform(e, EGL_PLATFORM_DEVICE_EXT, devices[i],
                             software ? "EGL, software device" : "EGL, GPU device"))
                continue;
            if (wish == SPV_CTX_ANY || !spv_ctx_is_software(&e->base))
                return true;
            drop_context(e);
        }
    return false;
}

static bool on_any(struct egl *e, enum spv_ctx_wish wish)
{
    if (e->query_devices != NULL && e->get_platform_display != NULL) {
        if (on_device(e, wish))
            return true;
        if (wish == SPV_CTX_GPU)    /* what follows finds no GPU that is not among the devices */
            return false;
    }
    const char *have = e->QueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    if (e->get_platform_display != NULL && has_word(have, "EGL_MESA_platform_surfaceless") &&
        on_platform(e, EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, "EGL, surfaceless")) {
        if (wish == SPV_CTX_ANY || !spv_ctx_is_software(&e->base))
            return true;
        drop_context(e);
    }
    e->display = e->GetDisplay(EGL_DEFAULT_DISPLAY);
    e->base.name = "EGL, default display";
    if (!make_context(e))
        return false;
    if (wish == SPV_CTX_ANY || !spv_ctx_is_software(&e->base))
        return true;
    drop_context(e);
    return false;
}

enum spc_status spv_ctx_egl(enum spv_ctx_wish wish, struct spv_ctx **out, struct spc_error *err)
{
    static const struct spv_ctx_kind kind = {egl_function, egl_is_current, egl_free};
    *out = NULL;
    struct egl *e = calloc(1, sizeof *e);
    if (e == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for an OpenGL context");
    e->base = (struct spv_ctx){&kind, "EGL"};
    e->context = EGL_NO_CONTEXT;
    e->surface = EGL_NO_SURFACE;
    enum spc_status status = load_egl(e, err);
    if (status == SPC_OK && !on_any(e, wish))
        status = spc_fail(err, SPC_FEATURE, SPC_NO_OFF, wish == SPV_CTX_GPU
                          ? "EGL finds no GPU with OpenGL 3.3" : "EGL gives no OpenGL 3.3 core context");
    if (status == SPC_OK)
        *out = &e->base;
    else
        free(e);
    return status;
}
