#include "gl_int.h"

#include <assert.h>
#include <string.h>

enum spc_status spv_gl_load(const struct spv_ctx *ctx, struct spv_gl_api *api, struct spc_error *err)
{
    assert(spv_ctx_is_current(ctx));
#define X(type, name)                                                                           \
    api->name = (type)spv_ctx_function(ctx, "gl" #name);                                        \
    if (api->name == NULL)                                                                      \
        return spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "OpenGL lacks gl" #name);
    SPV_GL_FUNCTIONS(X)
#undef X
    GLint major = 0, minor = 0;
    api->GetIntegerv(GL_MAJOR_VERSION, &major);
    api->GetIntegerv(GL_MINOR_VERSION, &minor);
    if (major < 3 || (major == 3 && minor < 3))
        return spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "OpenGL %d.%d is older than 3.3", major, minor);
    return SPC_OK;
}

bool spv_ctx_is_software(const struct spv_ctx *ctx)
{
    static const char *const names[] = {"llvmpipe", "softpipe", "Software Rasterizer", "SWR",
                                        "SwiftShader", "GDI Generic", "Apple Software"};
    const PFNGLGETSTRINGPROC get = (PFNGLGETSTRINGPROC)spv_ctx_function(ctx, "glGetString");
    const char *name = get == NULL ? NULL : (const char *)get(GL_RENDERER);
    for (size_t i = 0; name != NULL && i < sizeof names / sizeof *names; i++)
        if (strstr(name, names[i]) != NULL)
            return true;
    return false;
}

/* Logs have several lines, an error one. */
static void one_line(char *log)
{
    for (; *log != '\0'; log++)
        if ((unsigned char)*log < ' ')
            *log = log[1] == '\0' ? '\0' : ' ';
}

static enum spc_status compile(const struct spv_gl_api *api, GLenum kind, const char *text, GLuint *out,
                               struct spc_error *err)
{
    GLint ok = 0;
    char log[120] = "";
    *out = api->CreateShader(kind);
    api->ShaderSource(*out, 1, &text, NULL);
    api->CompileShader(*out);
    api->GetShaderiv(*out, GL_COMPILE_STATUS, &ok);
    if (ok)
        return SPC_OK;
    api->GetShaderInfoLog(*out, sizeof log, NULL, log);
    one_line(log);
    return spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "a shader does not compile: %s", log);
}

enum spc_status spv_gl_program(const struct spv_gl_api *api, const char *vertex, const char *fragment,
                               GLuint *id, struct spc_error *err)
{
    GLuint vs = 0, fs = 0;
    GLint ok = 0;
    char log[120] = "";
    *id = 0;
    enum spc_status status = compile(api, GL_VERTEX_SHADER, vertex, &vs, err);
    if (status == SPC_OK)
        status = compile(api, GL_FRAGMENT_SHADER, fragment, &fs, err);
    if (status == SPC_OK) {
        *id = api->CreateProgram();
        api->AttachShader(*id, vs);
        api->AttachShader(*id, fs);
        api->LinkProgram(*id);
        api->GetProgramiv(*id, GL_LINK_STATUS, &ok);
    }
    if (status == SPC_OK && !ok) {
        api->GetProgramInfoLog(*id, sizeof log, NULL, log);
        one_line(log);
        status = spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "a shader program does not link: %s", log);
        api->DeleteProgram(*id);
        *id = 0;
    }
    api->DeleteShader(vs);          /* 0 is ignored */
    api->DeleteShader(fs);
    return status;
}
