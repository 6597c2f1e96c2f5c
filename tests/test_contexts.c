/* OpenGL without a display, and pictures put onto what a context draws on. */
#include "gl_int.h"
#include "show.h"
#include "suite.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A context of EGL; NULL, and a word why, on a machine without. */
static struct spv_ctx *egl(enum spv_ctx_wish wish)
{
    struct spv_ctx *ctx = NULL;
    struct spc_error err = {0};
    const enum spc_status status = spv_ctx_egl(wish, &ctx, &err);
    if (status == SPC_OK)
        return ctx;
    ck_assert_int_eq(status, SPC_FEATURE);
    ck_assert_ptr_null(ctx);
    ck_assert_uint_gt(strlen(err.what), 10);
    printf("skipped: %s\n", err.what);
    return NULL;
}

/* The context is current and does as it is told: a framebuffer object is cleared and read. */
static void check_context(const struct spv_ctx *ctx)
{
    struct spv_gl_api f;
    struct spc_error err = {0};
    ck_assert(spv_ctx_is_current(ctx));
    ck_assert_uint_gt(strlen(spv_ctx_name(ctx)), 2);
    ck_assert_msg(spv_gl_load(ctx, &f, &err) == SPC_OK, "%s", err.what);
    GLuint frame, color;
    f.GenFramebuffers(1, &frame);
    f.GenRenderbuffers(1, &color);
    f.BindRenderbuffer(GL_RENDERBUFFER, color);
    f.RenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, 4, 4);
    f.BindFramebuffer(GL_FRAMEBUFFER, frame);
    f.FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, color);
    ck_assert_uint_eq(f.CheckFramebufferStatus(GL_FRAMEBUFFER), GL_FRAMEBUFFER_COMPLETE);
    f.ClearColor(1, 0.2f, 0, 1);
    f.Clear(GL_COLOR_BUFFER_BIT);
    uint8_t rgba[4] = {0};
    f.ReadPixels(2, 2, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, rgba);
    ck_assert_int_eq(rgba[0], 255);
    ck_assert_int_eq(rgba[1], 51);
    ck_assert_int_eq(rgba[2], 0);
    f.DeleteFramebuffers(1, &frame);
    f.DeleteRenderbuffers(1, &color);
    ck_assert_uint_eq(f.GetError(), GL_NO_ERROR);
}

START_TEST(contexts_come_and_go_one_after_another)
{
    for (int i = 0; i < 2; i++) {
        struct spv_ctx *ctx = egl(SPV_CTX_ANY);
        if (ctx == NULL)
            return;
        check_context(ctx);
        spv_ctx_free(ctx);
    }
    struct spv_ctx *mesa = NULL;
    ck_assert_int_eq(spv_ctx_osmesa(&mesa, NULL), SPC_OK);
    check_context(mesa);
    ck_assert(spv_ctx_is_software(mesa));
    spv_ctx_free(mesa);
    spv_ctx_free(NULL);
}
END_TEST

/* EGL hands both the same display: the end of one must not be that of the other. */
START_TEST(a_context_outlives_another)
{
    struct spv_ctx *first = egl(SPV_CTX_ANY), *second = first == NULL ? NULL : egl(SPV_CTX_ANY);
    if (second == NULL)
        return;
    ck_assert(!spv_ctx_is_current(first));
    check_context(second);
    spv_ctx_free(first);
    check_context(second);
    spv_ctx_free(second);
}
END_TEST

START_TEST(who_wants_a_gpu_gets_one_or_none)
{
    struct spv_ctx *ctx = egl(SPV_CTX_GPU);
    if (ctx == NULL)
        return;
    ck_assert(!spv_ctx_is_software(ctx));
    check_context(ctx);
    spv_ctx_free(ctx);
}
END_TEST

START_TEST(shaders_that_do_not_compile_or_link_say_why_in_a_line)
{
    static const char good[] = "#version 330 core\nvoid main() { gl_Position = vec4(0.0); }\n";
    struct spv_ctx *ctx = NULL;
    struct spv_gl_api f;
    GLuint id = 7;
    ck_assert_int_eq(spv_ctx_osmesa(&ctx, NULL), SPC_OK);
    ck_assert_int_eq(spv_gl_load(ctx, &f, NULL), SPC_OK);
    struct spc_error err = {0};
    ck_assert_int_eq(spv_gl_program(&f, good, "#version 330 core\nvoid main() { x = 1; }\n", &id, &err), SPC_FEATURE);
    ck_assert_uint_eq(id, 0);
    ck_assert_ptr_nonnull(strstr(err.what, "compile"));
    ck_assert_ptr_null(strpbrk(err.what, "\n?"));
    err = (struct spc_error){0};
    ck_assert_int_eq(spv_gl_program(&f, "#version 330 core\nout vec2 v;\n"
                                    "void main() { v = vec2(1.0); gl_Position = v.xxxx; }\n",
                                    "#version 330 core\nin vec3 v;\nout vec4 o;\n"
                                    "void main() { o = vec4(v, 1.0); }\n", &id, &err), SPC_FEATURE);
    ck_assert_uint_eq(id, 0);
    ck_assert_ptr_nonnull(strstr(err.what, "link"));
    ck_assert_ptr_null(strpbrk(err.what, "\n?"));
    ck_assert_int_eq(spv_gl_program(&f, good, "#version 330 core\nvoid main() {}\n", &id, NULL), SPC_OK);
    ck_assert_uint_ne(id, 0);
    f.DeleteProgram(id);
    spv_ctx_free(ctx);
}
END_TEST

/* ---- pictures: OSMesa's own buffer is a window of 16 x 16 --------------------------------------- */

enum { SIDE = 16, PICTURE = 20 };

static void make_picture(uint8_t *rgba)
{
    for (int i = 0; i < PICTURE * PICTURE; i++) {
        rgba[4 * i] = (uint8_t)(i % PICTURE * 10);
        rgba[4 * i + 1] = (uint8_t)(i / PICTURE * 10);
        rgba[4 * i + 2] = 99;
        rgba[4 * i + 3] = (uint8_t)(i % 3 * 127);
    }
}

static int channel(const uint8_t *picture, int x, int y, int at_x, int at_y, bool blend, int c)
{
    static const int ground[3] = {0x10, 0x20, 0x30};
    const int from_x = x - at_x, from_y = y - at_y;
    if (from_x < 0 || from_y < 0 || from_x >= PICTURE || from_y >= PICTURE)
        return ground[c];
    const uint8_t *p = picture + (from_y * PICTURE + from_x) * 4;
    return blend ? (p[c] * p[3] + ground[c] * (255 - p[3]) + 127) / 255 : p[c];
}

/* State that a back end may have set, and that would spoil pictures. */
static void make_state(const struct spv_ctx *ctx, const struct spv_gl_api *f, GLuint *names)
{
    const PFNGLSCISSORPROC scissor = (PFNGLSCISSORPROC)spv_ctx_function(ctx, "glScissor");
    scissor(4, 4, 2, 2);
    f->GenVertexArrays(1, &names[0]);
    f->GenFramebuffers(1, &names[1]);
    f->GenTextures(1, &names[2]);
    f->BindVertexArray(names[0]);
    f->BindFramebuffer(GL_FRAMEBUFFER, names[1]);
    f->ActiveTexture(GL_TEXTURE0);
    f->BindTexture(GL_TEXTURE_2D, names[2]);
    f->ActiveTexture(GL_TEXTURE3);
    f->Enable(GL_DEPTH_TEST);
    f->Enable(GL_SCISSOR_TEST);
    f->Enable(GL_CULL_FACE);
    f->DepthFunc(GL_NEVER);
    f->Viewport(1, 2, 3, 4);
    f->PixelStorei(GL_UNPACK_ALIGNMENT, 8);
    f->PixelStorei(GL_UNPACK_ROW_LENGTH, 5);
}

static void check_state(const struct spv_gl_api *f, const GLuint *names, bool blends)
{
    const struct { GLenum what; GLint is; } values[] = {
        {GL_VERTEX_ARRAY_BINDING, (GLint)names[0]}, {GL_DRAW_FRAMEBUFFER_BINDING, (GLint)names[1]},
        {GL_READ_FRAMEBUFFER_BINDING, (GLint)names[1]}, {GL_ACTIVE_TEXTURE, GL_TEXTURE3}, {GL_CURRENT_PROGRAM, 0},
        {GL_UNPACK_ALIGNMENT, 8}, {GL_UNPACK_ROW_LENGTH, 5}, {GL_DEPTH_TEST, 1}, {GL_SCISSOR_TEST, 1},
        {GL_CULL_FACE, 1}, {GL_BLEND, blends},
    };
    for (size_t i = 0; i < sizeof values / sizeof *values; i++) {
        GLint is = -1;
        f->GetIntegerv(values[i].what, &is);
        ck_assert_msg(is == values[i].is, "0x%x is %d, was %d", values[i].what, is, values[i].is);
    }
    GLint viewport[4], texture;
    f->GetIntegerv(GL_VIEWPORT, viewport);
    for (int i = 0; i < 4; i++)
        ck_assert_int_eq(viewport[i], i + 1);
    f->ActiveTexture(GL_TEXTURE0);
    f->GetIntegerv(GL_TEXTURE_BINDING_2D, &texture);
    f->ActiveTexture(GL_TEXTURE3);
    ck_assert_int_eq(texture, (GLint)names[2]);
    ck_assert_uint_eq(f->GetError(), GL_NO_ERROR);
}

START_TEST(pictures_are_shown_whatever_the_state_and_leave_it)
{
    static const int places[][2] = {{0, 0}, {5, 3}, {-7, -2}, {-19, -19}, {15, 15}, {-20, 0}, {0, 16}, {-3, 9},
                                    {-2147483647 - 1, 0}, {2147483647, 2147483647}};
    uint8_t picture[PICTURE * PICTURE * 4], screen[SIDE * SIDE * 4];
    struct spv_ctx *ctx = NULL;
    struct spv_show *show = NULL;
    struct spv_gl_api f;
    GLuint names[3];
    make_picture(picture);
    ck_assert_int_eq(spv_ctx_osmesa(&ctx, NULL), SPC_OK);
    ck_assert_int_eq(spv_gl_load(ctx, &f, NULL), SPC_OK);
    ck_assert_int_eq(spv_show_create(ctx, &show, NULL), SPC_OK);
    spv_show_size(show, SIDE, SIDE);
    make_state(ctx, &f, names);
    for (size_t i = 0; i < 2 * sizeof places / sizeof *places; i++) {
        const int *at = places[i / 2];
        const bool blend = i % 2 != 0, blends = i % 4 < 2;
        if (blends)
            f.Enable(GL_BLEND);
        else
            f.Disable(GL_BLEND);
        spv_show_clear(show, 0x102030);
        ck_assert_int_eq(spv_show_picture(show, picture, PICTURE, PICTURE, at[0], at[1], blend ? SPV_SHOW_BLEND : 0,
                                          NULL), SPC_OK);
        spv_show_read(show, screen);
        check_state(&f, names, blends);
        for (int y = 0; y < SIDE; y++)
            for (int x = 0; x < SIDE; x++)
                for (int c = 0; c < 3; c++) {
                    const bool far = at[0] < -1000 || at[0] > 1000;
                    const int wanted = channel(picture, x, y, far ? 100 : at[0], at[1], blend && !far, c);
                    const int is = screen[(y * SIDE + x) * 4 + c];
                    ck_assert_msg(abs(is - wanted) <= blend, "%d, %d at %d, %d: %d, not %d", x, y, at[0], at[1], is,
                                  wanted);
                }
    }
    spv_show_free(show);
    spv_ctx_free(ctx);
}
END_TEST

int main(void)
{
    return SUITE("contexts", NULL, NULL, contexts_come_and_go_one_after_another, a_context_outlives_another,
                 who_wants_a_gpu_gets_one_or_none, shaders_that_do_not_compile_or_link_say_why_in_a_line,
                 pictures_are_shown_whatever_the_state_and_leave_it);
}
