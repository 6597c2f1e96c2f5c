/* gl_target.c - the framebuffer that pictures are drawn into. */
#include "draw_gl_int.h"

#include <stdlib.h>

enum { GROWS_BY = 256 };            /* px: so that a window that is dragged larger finds room */

static int grown(int side, int allocated, int side_max)
{
    const int rounded = (side + GROWS_BY - 1) / GROWS_BY * GROWS_BY;
    if (side <= allocated)
        return allocated;
    return rounded < side_max ? rounded : side_max;
}

static enum spc_status allocate(struct spv_gl *gl, int width, int height, struct spc_error *err)
{
    const struct spv_gl_api *f = &gl->api;
    gl->allocated_width = gl->allocated_height = 0;
    f->ActiveTexture(GL_TEXTURE0);
    f->BindTexture(GL_TEXTURE_2D, gl->color);
    f->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    f->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    f->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
    f->TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, NULL);
    f->BindTexture(GL_TEXTURE_2D, 0);
    f->BindRenderbuffer(GL_RENDERBUFFER, gl->depth);
    f->RenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT32F, width, height);
    f->BindFramebuffer(GL_FRAMEBUFFER, gl->frame);
    f->FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, gl->color, 0);
    f->FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, gl->depth);
    if (f->CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE ||
        spv_gl_check(gl, NULL) != SPC_OK)
        return spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "OpenGL cannot draw %d x %d pixels", width, height);
    gl->allocated_width = width;
    gl->allocated_height = height;
    return SPC_OK;
}

/* Everything that is relied on: others may have drawn since. */
static void set_state(const struct spv_gl *gl)
{
    const struct spv_gl_api *f = &gl->api;
    f->BindVertexArray(gl->vao);
    f->Disable(GL_BLEND);
    f->Disable(GL_CULL_FACE);
    f->Disable(GL_STENCIL_TEST);
    f->Enable(GL_DEPTH_TEST);
    f->Enable(GL_SCISSOR_TEST);
    f->Enable(GL_PROGRAM_POINT_SIZE);
    f->DepthFunc(GL_GREATER);
    f->DepthMask(GL_TRUE);
    f->ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    f->ClearDepth(0);
    f->ClearColor(0, 0, 0, 0);
}

enum spc_status spv_gl_target(struct spv_gl *gl, int width, int height, struct spc_error *err)
{
    const struct spv_gl_api *f = &gl->api;
    gl->picture_width = width;
    gl->picture_height = height;
    gl->target_width = width + 2 * GUARD;
    gl->target_height = height + 2 * GUARD;
    if (gl->target_width > gl->allocated_width || gl->target_height > gl->allocated_height) {
        const enum spc_status status =
            allocate(gl, grown(gl->target_width, gl->allocated_width, gl->side_max),
                     grown(gl->target_height, gl->allocated_height, gl->side_max), err);
        if (status != SPC_OK)
            return status;
    }
    set_state(gl);
    f->BindFramebuffer(GL_FRAMEBUFFER, gl->frame);
    f->Viewport(0, 0, gl->target_width, gl->target_height);
    f->Scissor(GUARD, GUARD, width, height);        /* nobody sees what is drawn beyond */
    f->Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    return SPC_OK;
}

/* The tile's pixels into the picture; GL's rows run upwards. */
enum spc_status spv_gl_read(const struct gl_frame *f, uint8_t *rgba, struct spc_error *err)
{
    const struct spv_gl_api *gl = &f->gl->api;
    const size_t row = (size_t)f->width * 4;
    uint8_t *tile = malloc(row * (size_t)f->height);
    if (tile == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a picture");
    gl->PixelStorei(GL_PACK_ALIGNMENT, 4);
    gl->ReadPixels(GUARD, GUARD, f->width, f->height, GL_RGBA, GL_UNSIGNED_BYTE, tile);
    for (int y = 0; y < f->height; y++) {
        const size_t to = ((size_t)(f->y0 + y) * (size_t)f->in->view->camera.width + (size_t)f->x0) * 4;
        memcpy(rgba + to, tile + row * (size_t)(f->height - 1 - y), row);
        for (size_t x = 3; x < row; x += 4)
            if (rgba[to + x] == 0)
                memcpy(rgba + to + x - 3, f->in->options->background, 4);
    }
    free(tile);
    return SPC_OK;
}

float spv_gl_read_depth(const struct spv_gl *gl, int x, int y)
{
    const struct spv_gl_api *f = &gl->api;
    float depth = 0;
    f->BindFramebuffer(GL_FRAMEBUFFER, gl->frame);
    f->ReadPixels(GUARD + x, GUARD + gl->picture_height - 1 - y, 1, 1, GL_DEPTH_COMPONENT, GL_FLOAT, &depth);
    return depth;
}

void spv_gl_present(struct spv_draw *draw, const uint8_t background[3], int width, int height)
{
    const struct spv_gl *gl = spv_gl_of(draw);
    const struct spv_gl_api *f = &gl->api;
    f->BindFramebuffer(GL_FRAMEBUFFER, 0);
    f->Viewport(0, 0, width, height);
    f->Disable(GL_BLEND);
    f->Disable(GL_CULL_FACE);
    f->Disable(GL_DEPTH_TEST);
    f->Disable(GL_SCISSOR_TEST);
    f->ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    f->ClearColor((float)background[0] / 255, (float)background[1] / 255, (float)background[2] / 255, 1);
    f->Clear(GL_COLOR_BUFFER_BIT);
    if (gl->allocated_width == 0 || width <= 0 || height <= 0)
        return;                     /* nothing has been drawn yet */
    f->BindVertexArray(gl->vao);
    f->DisableVertexAttribArray(AT_NODE);
    f->DisableVertexAttribArray(AT_COLOR);
    f->DisableVertexAttribArray(AT_PLACE);
    f->UseProgram(gl->show.id);
    f->ActiveTexture(GL_TEXTURE0);
    f->BindTexture(GL_TEXTURE_2D, gl->color);
    f->Uniform2f(gl->show.scale, (float)gl->picture_width / (float)width,
                 (float)gl->picture_height / (float)height);
    f->Uniform2f(gl->show.size, (float)gl->picture_width, (float)gl->picture_height);
    f->Uniform3f(gl->show.background, (float)background[0] / 255, (float)background[1] / 255,
                 (float)background[2] / 255);
    f->DrawArrays(GL_TRIANGLES, 0, 3);
    f->BindTexture(GL_TEXTURE_2D, 0);
    f->UseProgram(0);
}
