/*
 * gl_api.h - the GL functions in use, one row each; gl_api.c loads them by name.
 *
 * A pointer that was found proves nothing (drivers hand out stubs): the version of the context does.
 */
#ifndef SPV_GL_API_H
#define SPV_GL_API_H

#include <GL/glcorearb.h>

#define SPV_GL_FUNCTIONS(X)                                     \
    X(PFNGLACTIVETEXTUREPROC, ActiveTexture)                    \
    X(PFNGLATTACHSHADERPROC, AttachShader)                      \
    X(PFNGLBEGINCONDITIONALRENDERPROC, BeginConditionalRender)  \
    X(PFNGLBEGINQUERYPROC, BeginQuery)                          \
    X(PFNGLBINDBUFFERPROC, BindBuffer)                          \
    X(PFNGLBINDFRAMEBUFFERPROC, BindFramebuffer)                \
    X(PFNGLBINDRENDERBUFFERPROC, BindRenderbuffer)              \
    X(PFNGLBINDTEXTUREPROC, BindTexture)                        \
    X(PFNGLBINDVERTEXARRAYPROC, BindVertexArray)                \
    X(PFNGLBLENDFUNCSEPARATEPROC, BlendFuncSeparate)            \
    X(PFNGLBLITFRAMEBUFFERPROC, BlitFramebuffer)                \
    X(PFNGLBUFFERDATAPROC, BufferData)                          \
    X(PFNGLCHECKFRAMEBUFFERSTATUSPROC, CheckFramebufferStatus)  \
    X(PFNGLCLEARPROC, Clear)                                    \
    X(PFNGLCLEARCOLORPROC, ClearColor)                          \
    X(PFNGLCLEARDEPTHPROC, ClearDepth)                          \
    X(PFNGLCOLORMASKPROC, ColorMask)                            \
    X(PFNGLCOMPILESHADERPROC, CompileShader)                    \
    X(PFNGLCREATEPROGRAMPROC, CreateProgram)                    \
    X(PFNGLCREATESHADERPROC, CreateShader)                      \
    X(PFNGLDELETEBUFFERSPROC, DeleteBuffers)                    \
    X(PFNGLDELETEFRAMEBUFFERSPROC, DeleteFramebuffers)          \
    X(PFNGLDELETEPROGRAMPROC, DeleteProgram)                    \
    X(PFNGLDELETEQUERIESPROC, DeleteQueries)                    \
    X(PFNGLDELETERENDERBUFFERSPROC, DeleteRenderbuffers)        \
    X(PFNGLDELETESHADERPROC, DeleteShader)                      \
    X(PFNGLDELETETEXTURESPROC, DeleteTextures)                  \
    X(PFNGLDELETEVERTEXARRAYSPROC, DeleteVertexArrays)          \
    X(PFNGLDEPTHFUNCPROC, DepthFunc)                            \
    X(PFNGLDEPTHMASKPROC, DepthMask)                            \
    X(PFNGLDISABLEPROC, Disable)                                \
    X(PFNGLDISABLEVERTEXATTRIBARRAYPROC, DisableVertexAttribArray) \
    X(PFNGLDRAWARRAYSPROC, DrawArrays)                          \
    X(PFNGLDRAWARRAYSINSTANCEDPROC, DrawArraysInstanced)        \
    X(PFNGLENABLEPROC, Enable)                                  \
    X(PFNGLENABLEVERTEXATTRIBARRAYPROC, EnableVertexAttribArray) \
    X(PFNGLENDCONDITIONALRENDERPROC, EndConditionalRender)      \
    X(PFNGLENDQUERYPROC, EndQuery)                              \
    X(PFNGLFRAMEBUFFERRENDERBUFFERPROC, FramebufferRenderbuffer) \
    X(PFNGLFRAMEBUFFERTEXTURE2DPROC, FramebufferTexture2D)      \
    X(PFNGLGENBUFFERSPROC, GenBuffers)                          \
    X(PFNGLGENFRAMEBUFFERSPROC, GenFramebuffers)                \
    X(PFNGLGENQUERIESPROC, GenQueries)                          \
    X(PFNGLGENRENDERBUFFERSPROC, GenRenderbuffers)              \
    X(PFNGLGENTEXTURESPROC, GenTextures)                        \
    X(PFNGLGENVERTEXARRAYSPROC, GenVertexArrays)                \
    X(PFNGLGETERRORPROC, GetError)                              \
    X(PFNGLGETFLOATVPROC, GetFloatv)                            \
    X(PFNGLGETINTEGERVPROC, GetIntegerv)                        \
    X(PFNGLGETPROGRAMINFOLOGPROC, GetProgramInfoLog)            \
    X(PFNGLGETPROGRAMIVPROC, GetProgramiv)                      \
    X(PFNGLGETQUERYOBJECTUIVPROC, GetQueryObjectuiv)            \
    X(PFNGLGETSHADERINFOLOGPROC, GetShaderInfoLog)              \
    X(PFNGLGETSHADERIVPROC, GetShaderiv)                        \
    X(PFNGLGETSTRINGPROC, GetString)                            \
    X(PFNGLGETUNIFORMLOCATIONPROC, GetUniformLocation)          \
    X(PFNGLISENABLEDPROC, IsEnabled)                            \
    X(PFNGLLINKPROGRAMPROC, LinkProgram)                        \
    X(PFNGLMULTIDRAWARRAYSPROC, MultiDrawArrays)                \
    X(PFNGLPIXELSTOREIPROC, PixelStorei)                        \
    X(PFNGLREADPIXELSPROC, ReadPixels)                          \
    X(PFNGLRENDERBUFFERSTORAGEPROC, RenderbufferStorage)        \
    X(PFNGLSCISSORPROC, Scissor)                                \
    X(PFNGLSHADERSOURCEPROC, ShaderSource)                      \
    X(PFNGLTEXBUFFERPROC, TexBuffer)                            \
    X(PFNGLTEXIMAGE2DPROC, TexImage2D)                          \
    X(PFNGLTEXPARAMETERIPROC, TexParameteri)                    \
    X(PFNGLTEXSUBIMAGE2DPROC, TexSubImage2D)                    \
    X(PFNGLUNIFORM1FPROC, Uniform1f)                            \
    X(PFNGLUNIFORM1IPROC, Uniform1i)                            \
    X(PFNGLUNIFORM2FPROC, Uniform2f)                            \
    X(PFNGLUNIFORM2IPROC, Uniform2i)                            \
    X(PFNGLUNIFORM3FPROC, Uniform3f)                            \
    X(PFNGLUNIFORM3IPROC, Uniform3i)                            \
    X(PFNGLUNIFORM4FPROC, Uniform4f)                            \
    X(PFNGLUNIFORM4IPROC, Uniform4i)                            \
    X(PFNGLUNIFORMMATRIX3FVPROC, UniformMatrix3fv)              \
    X(PFNGLUSEPROGRAMPROC, UseProgram)                          \
    X(PFNGLVERTEXATTRIB4FPROC, VertexAttrib4f)                  \
    X(PFNGLVERTEXATTRIBDIVISORPROC, VertexAttribDivisor)        \
    X(PFNGLVERTEXATTRIBIPOINTERPROC, VertexAttribIPointer)      \
    X(PFNGLVERTEXATTRIBPOINTERPROC, VertexAttribPointer)        \
    X(PFNGLVIEWPORTPROC, Viewport)

struct spv_gl_api {
#define X(type, name) type name;
    SPV_GL_FUNCTIONS(X)
#undef X
};

#endif
