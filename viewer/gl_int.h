/*
 * gl_int.h - what the files that call GL share.
 */
#ifndef SPV_GL_INT_H
#define SPV_GL_INT_H

#include "ctx.h"
#include "gl_api.h"

/*
 * Addresses of all functions of api. The context must be current.
 * fails  SPC_FEATURE (older than 3.3, a function is missing)
 */
enum spc_status spv_gl_load(const struct spv_ctx *ctx, struct spv_gl_api *api, struct spc_error *err);

/*
 * A program of two shaders.
 * out    id      0 on failure
 * fails  SPC_FEATURE, with the first words of the compiler's or linker's log
 */
enum spc_status spv_gl_program(const struct spv_gl_api *api, const char *vertex, const char *fragment,
                               GLuint *id, struct spc_error *err);

#endif
