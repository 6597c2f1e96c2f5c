/*
 * gl_show.c - a picture as a texture, and from there onto the window.
 *
 * Where it replaces what is there, it is blitted, else drawn as a triangle. For 1024 x 1024 pixels llvmpipe
 * takes 3.7 ms of CPU for the blit, 5.2 for the triangle, 7.7 when that blends, upload included; a textured
 * triangle with interpolated coordinates takes 8.5. Turning the picture upside down costs the blit nothing.
 */
#include "show.h"

#include "gl_int.h"

#include <stdlib.h>

/* One triangle that covers the viewport, which is the rectangle to be filled. */
static const char VERTEX[] =
    "#version 330 core\n"
    "void main() { gl_Position = vec4(4 * (gl_VertexID & 1) - 1, 2 * (gl_VertexID & 2) - 1, 0.0, 1.0); }\n";

static const char FRAGMENT[] =
    "#version 330 core\n"
    "uniform sampler2D u_picture;\n"
    "uniform ivec2 u_corner;\n"         /* window's pixel, from below, of the picture's top left, which is above it */
    "out vec4 o_color;\n"
    "void main() {\n"
    "    ivec2 at = ivec2(gl_FragCoord.xy) - u_corner;\n"
    "    o_color = texelFetch(u_picture, ivec2(at.x, -1 - at.y), 0);\n"
    "}\n";

struct spv_show {
    struct spv_gl_api api;
    GLuint program, texture, vao, frame;
    GLint corner;
    int texture_width, texture_height, texture_max;     /* px */
    int width, height;                                  /* px, of the window */
};

/* What of GL's state is touched here, to be put back. */
struct state {
    GLint draw, read, viewport[4], program, vao, unit, texture, row_length, alignment;
    GLboolean depth, blend, scissor, cull;
};

static void switch_to(const struct spv_gl_api *f, GLenum what, bool on)
{
    if (on)
        f->Enable(what);
    else
        f->Disable(what);
}

static void keep(const struct spv_show *s, struct state *old)
{
    const struct spv_gl_api *f = &s->api;
    f->GetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &old->draw);
    f->GetIntegerv(GL_READ_FRAMEBUFFER_BINDING, &old->read);
    f->GetIntegerv(GL_VIEWPORT, old->viewport);
    f->GetIntegerv(GL_CURRENT_PROGRAM, &old->program);
    f->GetIntegerv(GL_VERTEX_ARRAY_BINDING, &old->vao);
    f->GetIntegerv(GL_ACTIVE_TEXTURE, &old->unit);
    f->ActiveTexture(GL_TEXTURE0);
    f->GetIntegerv(GL_TEXTURE_BINDING_2D, &old->texture);
    f->GetIntegerv(GL_UNPACK_ROW_LENGTH, &old->row_length);
    f->GetIntegerv(GL_UNPACK_ALIGNMENT, &old->alignment);
    old->depth = f->IsEnabled(GL_DEPTH_TEST);
    old->blend = f->IsEnabled(GL_BLEND);
    old->scissor = f->IsEnabled(GL_SCISSOR_TEST);
    old->cull = f->IsEnabled(GL_CULL_FACE);
    f->BindFramebuffer(GL_FRAMEBUFFER, 0);
    f->Disable(GL_DEPTH_TEST);
    f->Disable(GL_SCISSOR_TEST);
    f->Disable(GL_CULL_FACE);
}

static void put_back(const struct spv_show *s, const struct state *old)
{
    const struct spv_gl_api *f = &s->api;
    f->BindFramebuffer(GL_DRAW_FRAMEBUFFER, (GLuint)old->draw);
    f->BindFramebuffer(GL_READ_FRAMEBUFFER, (GLuint)old->read);
    f->Viewport(old->viewport[0], old->viewport[1], old->viewport[2], old->viewport[3]);
    f->UseProgram((GLuint)old->program);
    f->BindVertexArray((GLuint)old->vao);
    f->BindTexture(GL_TEXTURE_2D, (GLuint)old->texture);
    f->ActiveTexture((GLenum)old->unit);
    f->PixelStorei(GL_UNPACK_ROW_LENGTH, old->row_length);
    f->PixelStorei(GL_UNPACK_ALIGNMENT, old->alignment);
    switch_to(f, GL_DEPTH_TEST, old->depth);
    switch_to(f, GL_BLEND, old->blend);
    switch_to(f, GL_SCISSOR_TEST, old->scissor);
    switch_to(f, GL_CULL_FACE, old->cull);
}

enum spc_status spv_show_create(const struct spv_ctx *ctx, struct spv_show **out, struct spc_error *err)
{
    *out = NULL;
    struct spv_show *s = calloc(1, sizeof *s);
    if (s == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to show pictures");
    const struct spv_gl_api *f = &s->api;
    enum spc_status status = spv_gl_load(ctx, &s->api, err);
    if (status == SPC_OK)
        status = spv_gl_program(f, VERTEX, FRAGMENT, &s->program, err);
    if (status != SPC_OK) {
        free(s);
        return status;
    }
    s->corner = f->GetUniformLocation(s->program, "u_corner");      /* u_picture is unit 0 without being told */
    f->GetIntegerv(GL_MAX_TEXTURE_SIZE, &s->texture_max);
    f->GenVertexArrays(1, &s->vao);
    f->GenTextures(1, &s->texture);
    f->GenFramebuffers(1, &s->frame);
    *out = s;
    return SPC_OK;
}

void spv_show_free(struct spv_show *show)
{
    if (show == NULL)
        return;
    show->api.DeleteProgram(show->program);
    show->api.DeleteVertexArrays(1, &show->vao);
    show->api.DeleteTextures(1, &show->texture);
    show->api.DeleteFramebuffers(1, &show->frame);
    free(show);
}

void spv_show_size(struct spv_show *show, int width, int height)
{
    show->width = width;
    show->height = height;
}

void spv_show_clear(struct spv_show *show, uint32_t rgb)
{
    const struct spv_gl_api *f = &show->api;
    struct state old;
    keep(show, &old);
    f->ClearColor((float)(rgb >> 16 & 0xFF) / 255, (float)(rgb >> 8 & 0xFF) / 255, (float)(rgb & 0xFF) / 255, 1);
    f->Clear(GL_COLOR_BUFFER_BIT);
    put_back(show, &old);
}

/* Part of a picture: where it begins in it and on the window, from the top left, and its size. */
struct part {
    int from_x, from_y, x, y, width, height;
};

static bool clip_axis(int64_t at, int64_t size, int64_t limit, int *from, int *to, int *length)
{
    const int64_t first = at < 0 ? 0 : at, last = at + size < limit ? at + size : limit;
    *from = (int)(first - at);
    *to = (int)first;
    *length = (int)(last - first);
    return first < last;
}

/* The texture only grows, so that pictures of changing sizes need no new one each. */
static bool make_texture(struct spv_show *s, const struct part *p)
{
    const struct spv_gl_api *f = &s->api;
    f->BindTexture(GL_TEXTURE_2D, s->texture);
    if (p->width <= s->texture_width && p->height <= s->texture_height)
        return true;
    const int width = p->width > s->texture_width ? p->width : s->texture_width;
    const int height = p->height > s->texture_height ? p->height : s->texture_height;
    f->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    f->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    f->TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
    while (f->GetError() != GL_NO_ERROR)
        continue;
    f->TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, NULL);
    const bool ok = f->GetError() == GL_NO_ERROR;
    s->texture_width = ok ? width : 0;
    s->texture_height = ok ? height : 0;
    return ok;
}

static bool show_part(struct spv_show *s, const uint8_t *rgba, int row_px, const struct part *p, bool blends)
{
    const struct spv_gl_api *f = &s->api;
    if (!make_texture(s, p))
        return false;
    f->PixelStorei(GL_UNPACK_ROW_LENGTH, row_px);
    f->TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, p->width, p->height, GL_RGBA, GL_UNSIGNED_BYTE,
                     rgba + ((size_t)p->from_y * (size_t)row_px + (size_t)p->from_x) * 4);
    const int above = s->height - p->y;             /* row above the part, from below */
    if (!blends) {
        f->BindFramebuffer(GL_READ_FRAMEBUFFER, s->frame);
        f->FramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, s->texture, 0);
        f->BlitFramebuffer(0, 0, p->width, p->height, p->x, above, p->x + p->width, above - p->height,
                           GL_COLOR_BUFFER_BIT, GL_NEAREST);
        return true;
    }
    f->Viewport(p->x, above - p->height, p->width, p->height);
    f->Uniform2i(s->corner, p->x, above);
    f->DrawArrays(GL_TRIANGLES, 0, 3);
    return true;
}

enum spc_status spv_show_picture(struct spv_show *show, const uint8_t *rgba, int width, int height, int x, int y,
                                 unsigned flags, struct spc_error *err)
{
    const struct spv_gl_api *f = &show->api;
    struct part all, p;
    struct state old;
    if (!clip_axis(x, width, show->width, &all.from_x, &all.x, &all.width) ||
        !clip_axis(y, height, show->height, &all.from_y, &all.y, &all.height))
        return SPC_OK;
    const bool blends = (flags & SPV_SHOW_BLEND) != 0;
    keep(show, &old);
    f->UseProgram(show->program);
    f->BindVertexArray(show->vao);
    f->PixelStorei(GL_UNPACK_ALIGNMENT, 4);
    switch_to(f, GL_BLEND, blends);
    f->BlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    bool ok = true;                 /* windows wider than a texture may be are shown in pieces */
    for (int down = 0; down < all.height && ok; down += show->texture_max)
        for (int across = 0; across < all.width && ok; across += show->texture_max) {
            p = (struct part){all.from_x + across, all.from_y + down, all.x + across, all.y + down,
                              all.width - across, all.height - down};
            p.width = p.width < show->texture_max ? p.width : show->texture_max;
            p.height = p.height < show->texture_max ? p.height : show->texture_max;
            ok = show_part(show, rgba, width, &p, blends);
        }
    put_back(show, &old);
    return ok ? SPC_OK : spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF,
                                  "OpenGL has no memory for a picture of %d x %d pixels", all.width, all.height);
}

void spv_show_read(struct spv_show *show, uint8_t *rgba)
{
    const struct spv_gl_api *f = &show->api;
    const size_t row = (size_t)show->width * 4;
    struct state old;
    keep(show, &old);
    f->PixelStorei(GL_PACK_ALIGNMENT, 4);
    for (int y = 0; y < show->height; y++)
        f->ReadPixels(0, show->height - 1 - y, show->width, 1, GL_RGBA, GL_UNSIGNED_BYTE, rgba + (size_t)y * row);
    for (size_t i = 3; i < row * (size_t)show->height; i += 4)
        rgba[i] = 255;
    put_back(show, &old);
}
