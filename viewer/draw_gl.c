/*
 * draw_gl.c - the OpenGL 3.3 back end, and the only file that calls GL.
 *
 * A picture is drawn into a framebuffer larger than it by GUARD pixels on every side: a point
 * vanishes when its centre leaves the framebuffer, so points of up to 2 GUARD pixels are never
 * cut short at the picture's border. Larger splats, and those that cross the eye's plane, are
 * quads, in a second pass over the blocks that can hold any. Pictures larger than a tile are drawn
 * in tiles.
 */
#include "draw_int.h"

#include "bytes.h"
#include "ctx.h"
#include "gl_api.h"
#include "glsl.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { GUARD = 32, TILE_DEFAULT = 2048 };
static const float NEAR_PLANE = 0x1p-40f;           /* units: nearer than that nothing is drawn */

enum { BUF_NODES, BUF_COLORS, BUF_INDICES, BUF_VERTICES, BUF_VERTEX_COLORS, BUF_COUNT };

struct program {
    GLuint id;
    GLint origin, step, eps, link_base, lower, view, focal, center, size, limit, pad, near, quads,
        fast, ambient, base_hi, base_lo, eye_rest, lattice, width, all, colored;
};

struct spv_gl {
    struct spv_draw base;
    struct spv_gl_api api;
    struct program splat, triangle;
    GLuint vao, frame, color, depth, buffers[BUF_COUNT], textures[BUF_COUNT];
    int target_side_max;            /* px */
    int target_width, target_height;
    float point_limit;              /* px */
    uint8_t *payload;               /* decoded block */
    size_t payload_max;
};

struct frame {                      /* what one call of spv_gl_frame shares */
    struct spv_gl *gl;
    const struct spc_reader *reader;
    const struct spc_header *header;
    const struct spv_view *view;
    const struct spv_draw_options *options;
    int x0, y0, width, height;      /* the tile in the picture, px, from the top left */
    int64_t eye_lattice[3];
    float eye_rest[3];
};

/* ---- set-up ------------------------------------------------------------------------------------ */

static enum spc_status load_api(struct spv_gl *gl, const struct spv_ctx *ctx,
                                struct spc_error *err)
{
#define X(type, name)                                                                          \
    gl->api.name = (type)spv_ctx_function(ctx, "gl" #name);                                    \
    if (gl->api.name == NULL)                                                                  \
        return spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "OpenGL lacks gl" #name);
    SPV_GL_FUNCTIONS(X)
#undef X
    return SPC_OK;
}

static enum spc_status compile(struct spv_gl *gl, GLenum kind, const char *text, GLuint *out,
                               struct spc_error *err)
{
    GLint ok = 0;
    *out = gl->api.CreateShader(kind);
    gl->api.ShaderSource(*out, 1, &text, NULL);
    gl->api.CompileShader(*out);
    gl->api.GetShaderiv(*out, GL_COMPILE_STATUS, &ok);
    if (ok)
        return SPC_OK;
    char log[120] = "";
    gl->api.GetShaderInfoLog(*out, sizeof log, NULL, log);
    return spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "a shader does not compile: %s", log);
}

static void find_uniforms(struct spv_gl *gl, struct program *p)
{
    const struct { GLint *at; const char *name; } uniforms[] = {
        {&p->origin, "u_origin"}, {&p->step, "u_step"}, {&p->eps, "u_eps"},
        {&p->link_base, "u_link_base"}, {&p->lower, "u_lower"}, {&p->view, "u_view"},
        {&p->focal, "u_focal"}, {&p->center, "u_center"}, {&p->size, "u_size"},
        {&p->limit, "u_limit"}, {&p->pad, "u_pad"}, {&p->near, "u_near"}, {&p->quads, "u_quads"},
        {&p->fast, "u_fast"}, {&p->ambient, "u_ambient"}, {&p->base_hi, "u_base_hi"},
        {&p->base_lo, "u_base_lo"}, {&p->eye_rest, "u_eye_rest"}, {&p->lattice, "u_lattice"},
        {&p->width, "u_width"}, {&p->all, "u_all"}, {&p->colored, "u_colored"},
    };
    for (size_t i = 0; i < sizeof uniforms / sizeof *uniforms; i++)
        *uniforms[i].at = gl->api.GetUniformLocation(p->id, uniforms[i].name);
}

static enum spc_status make_program(struct spv_gl *gl, const char *vertex, const char *fragment,
                                    struct program *p, struct spc_error *err)
{
    GLuint vs = 0, fs = 0;
    GLint ok = 0;
    enum spc_status status = compile(gl, GL_VERTEX_SHADER, vertex, &vs, err);
    if (status == SPC_OK)
        status = compile(gl, GL_FRAGMENT_SHADER, fragment, &fs, err);
    if (status == SPC_OK) {
        p->id = gl->api.CreateProgram();
        gl->api.AttachShader(p->id, vs);
        gl->api.AttachShader(p->id, fs);
        gl->api.LinkProgram(p->id);
        gl->api.GetProgramiv(p->id, GL_LINK_STATUS, &ok);
        if (!ok)
            status = spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "a shader program does not link");
        else
            find_uniforms(gl, p);
    }
    gl->api.DeleteShader(vs);
    gl->api.DeleteShader(fs);
    return status;
}

static enum spc_status check_context(struct spv_gl *gl, struct spc_error *err)
{
    GLint major = 0, minor = 0, side = 0, buffer = 0;
    GLfloat points[2] = {0, 0};
    gl->api.GetIntegerv(GL_MAJOR_VERSION, &major);
    gl->api.GetIntegerv(GL_MINOR_VERSION, &minor);
    gl->api.GetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &side);
    gl->api.GetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &buffer);
    gl->api.GetFloatv(GL_POINT_SIZE_RANGE, points);
    snprintf(gl->base.name, sizeof gl->base.name, "%s, OpenGL %d.%d",
             (const char *)gl->api.GetString(GL_RENDERER), major, minor);
    if (major < 3 || (major == 3 && minor < 3))
        return spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "OpenGL %d.%d is older than 3.3", major,
                        minor);
    if (buffer < 3 * 65536)
        return spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "OpenGL's texture buffers are too small");
    gl->target_side_max = side;
    gl->point_limit = fminf(points[1], 2 * GUARD);
    return SPC_OK;
}

static void release(struct spv_draw *draw)
{
    struct spv_gl *gl = (struct spv_gl *)draw;
    const struct spv_gl_api *f = &gl->api;
    f->DeleteProgram(gl->splat.id);
    f->DeleteProgram(gl->triangle.id);
    f->DeleteBuffers(BUF_COUNT, gl->buffers);
    f->DeleteTextures(BUF_COUNT, gl->textures);
    f->DeleteFramebuffers(1, &gl->frame);
    f->DeleteRenderbuffers(1, &gl->color);
    f->DeleteRenderbuffers(1, &gl->depth);
    f->DeleteVertexArrays(1, &gl->vao);
    free(gl->payload);
    free(gl);
}

static enum spc_status set_target(struct spv_gl *gl, int width, int height, struct spc_error *err)
{
    const struct spv_gl_api *f = &gl->api;
    if (gl->target_width != width || gl->target_height != height) {
        f->BindRenderbuffer(GL_RENDERBUFFER, gl->color);
        f->RenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, width, height);
        f->BindRenderbuffer(GL_RENDERBUFFER, gl->depth);
        f->RenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT32F, width, height);
        f->BindFramebuffer(GL_FRAMEBUFFER, gl->frame);
        f->FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                                   gl->color);
        f->FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, gl->depth);
        if (f->CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
            return spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "OpenGL cannot draw %d x %d pixels",
                            width, height);
        gl->target_width = width;
        gl->target_height = height;
    }
    f->BindFramebuffer(GL_FRAMEBUFFER, gl->frame);
    f->Viewport(0, 0, width, height);
    f->Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    return SPC_OK;
}

/* ---- uniforms ---------------------------------------------------------------------------------- */

/* What holds for the whole tile. */
static void set_frame(const struct frame *f, const struct program *p)
{
    const struct spv_gl_api *gl = &f->gl->api;
    const struct spv_camera *c = &f->view->camera;
    const float view[9] = {         /* columns */
        (float)c->right[0], (float)c->up[0], (float)c->forward[0],
        (float)c->right[1], (float)c->up[1], (float)c->forward[1],
        (float)c->right[2], (float)c->up[2], (float)c->forward[2],
    };
    gl->UseProgram(p->id);
    gl->UniformMatrix3fv(p->view, 1, GL_FALSE, view);
    gl->Uniform1f(p->focal, (float)c->focal_px);
    gl->Uniform2f(p->center, (float)(GUARD - f->x0 + c->width / 2.0),
                  (float)(GUARD - (c->height - f->y0 - f->height) + c->height / 2.0));
    gl->Uniform2f(p->size, (float)f->gl->target_width, (float)f->gl->target_height);
    gl->Uniform1f(p->eps, (float)f->view->eps);
    gl->Uniform1f(p->near, NEAR_PLANE);
    gl->Uniform1f(p->ambient, f->options->ambient);
    if (p == &f->gl->splat) {
        gl->Uniform1f(p->limit, f->gl->point_limit);
        gl->Uniform1f(p->pad, (float)(1.05 / 64 / c->focal_px));    /* 1/64 px and roundings (I5) */
        gl->Uniform1i(p->fast, f->options->splat == SPV_SPLAT_FAST);
    } else {
        static const char *const names[] = {"u_nodes", "u_colors", "u_indices", "u_vertices"};
        static const int units[] = {BUF_NODES, BUF_VERTEX_COLORS, BUF_INDICES, BUF_VERTICES};
        for (int i = 0; i < 4; i++)
            gl->Uniform1i(gl->GetUniformLocation(p->id, names[i]), units[i]);
        gl->Uniform3f(p->eye_rest, f->eye_rest[0], f->eye_rest[1], f->eye_rest[2]);
        gl->Uniform1f(p->lattice,
                      ldexpf(1, f->header->vertex_exp - f->header->unit_exp));
        gl->Uniform1i(p->all, f->view->mode == SPV_TRIANGLES);
        gl->Uniform1i(p->colored, (f->header->flags & SPC_FLAG_COLORS) != 0);
    }
}

/* Origin of the block's cluster from the eye, and how its records decode. */
static void set_block(const struct frame *f, const struct program *p, const struct spc_block *b,
                      const double eye[3])
{
    const struct spv_gl_api *gl = &f->gl->api;
    gl->UseProgram(p->id);
    gl->Uniform3f(p->origin, (float)-eye[0], (float)-eye[1], (float)-eye[2]);
    gl->Uniform1f(p->step, ldexpf(1, b->step_exp - f->header->unit_exp));
    gl->Uniform1i(p->link_base, b->link_base);
    if (p == &f->gl->splat)
        gl->Uniform1i(p->lower, b->kind == SPC_BLOCK_INNER ||
                                    (f->view->mode == SPV_HYBRID &&
                                     (f->header->flags & SPC_FLAG_TRIANGLES)));
}

/*
 * The lattice point nearest to the eye, as far as it lies near the scan: corners are counted from
 * it in integers. Further off the rest is large, and the same for all corners.
 */
static void place_eye(struct frame *f)
{
    const struct spv_camera *c = &f->view->camera;
    for (int a = 0; a < 3; a++) {
        const double at = fmin(fmax(c->eye[a], f->header->box_min[a]), f->header->box_max[a]);
        const double lattice = floor(ldexp(at, -f->header->vertex_exp) + 0.5);
        f->eye_lattice[a] = (int64_t)lattice;
        f->eye_rest[a] = (float)ldexp(ldexp(lattice, f->header->vertex_exp) - c->eye[a],
                                      -f->header->unit_exp);
    }
}

/* ---- blocks ------------------------------------------------------------------------------------ */

static void upload(struct spv_gl *gl, int buffer, GLenum format, const uint8_t *bytes, size_t n)
{
    const struct spv_gl_api *f = &gl->api;
    f->BindBuffer(GL_ARRAY_BUFFER, gl->buffers[buffer]);
    f->BufferData(GL_ARRAY_BUFFER, (GLsizeiptr)n, bytes, GL_STREAM_DRAW);
    f->ActiveTexture(GL_TEXTURE0 + (GLenum)buffer);
    f->BindTexture(GL_TEXTURE_BUFFER, gl->textures[buffer]);
    f->TexBuffer(GL_TEXTURE_BUFFER, format, gl->buffers[buffer]);
}

static void upload_block(struct frame *f, const struct spc_block *b,
                         const struct spc_block_layout *l, const uint8_t *payload)
{
    struct spv_gl *gl = f->gl;
    const size_t n = b->node_count, v = b->vertex_count;
    upload(gl, BUF_NODES, GL_RGBA32UI, payload + l->nodes, n * SPC_NODE_BYTES);
    if (l->colors)
        upload(gl, BUF_COLORS, GL_RGBA8, payload + l->colors, n * 4);
    if (l->indices) {
        upload(gl, BUF_INDICES, GL_R16UI, payload + l->indices, n * 6);
        upload(gl, BUF_VERTICES,
               b->vertex_width == 2 ? GL_R16UI : b->vertex_width == 4 ? GL_R32UI : GL_RG32UI,
               payload + l->vertices, v * 3 * b->vertex_width);
    }
    if (l->vertex_colors)
        upload(gl, BUF_VERTEX_COLORS, GL_RGBA8, payload + l->vertex_colors, v * 4);
}

static void bind_splats(const struct frame *f, GLint first, GLuint divisor, bool colors)
{
    const struct spv_gl_api *gl = &f->gl->api;
    gl->BindBuffer(GL_ARRAY_BUFFER, f->gl->buffers[BUF_NODES]);
    gl->VertexAttribIPointer(0, 4, GL_UNSIGNED_INT, SPC_NODE_BYTES,
                             (const uint8_t *)NULL + SPC_NODE_BYTES * first);
    gl->VertexAttribDivisor(0, divisor);
    gl->EnableVertexAttribArray(0);
    if (colors) {
        gl->BindBuffer(GL_ARRAY_BUFFER, f->gl->buffers[BUF_COLORS]);
        gl->VertexAttribPointer(1, 4, GL_UNSIGNED_BYTE, GL_TRUE, 4,
                                (const uint8_t *)NULL + 4 * first);
        gl->VertexAttribDivisor(1, divisor);
        gl->EnableVertexAttribArray(1);
    } else {
        gl->DisableVertexAttribArray(1);
        gl->VertexAttrib4f(1, 1, 1, 1, 1);
    }
}

/* Can the block hold a splat that is no point? Its radii against the nearest it can be. */
static bool needs_quads(const struct frame *f, const struct spc_block *b,
                        const struct spc_cluster *c, const double eye[3])
{
    double near2 = 0;
    for (int a = 0; a < 3; a++) {
        const double out = fmax((double)c->box[a] - eye[a], eye[a] - (double)c->box[a + 3]);
        near2 += out > 0 ? out * out : 0;
    }
    /* A splat's square is at most 2 (sqrt(2) R) f sec^2 / z; z / distance is least in a corner. */
    const double x = f->view->camera.width / (2 * f->view->camera.focal_px);
    const double y = f->view->camera.height / (2 * f->view->camera.focal_px);
    const double sec2 = 1 + x * x + y * y;
    const double extent = 2 * 1.4143 * (double)b->radius_max * 1.1;
    const double z = sqrt(near2) / sqrt(sec2) - extent;
    return z <= 0 || extent * f->view->camera.focal_px * sec2 / z + 2 > (double)f->gl->point_limit;
}

static void draw_splats(const struct frame *f, const struct spc_block *b,
                        const struct spc_cluster *c, const double eye[3],
                        const struct spv_ranges *ranges, bool colors)
{
    const struct spv_gl_api *gl = &f->gl->api;
    const struct program *p = &f->gl->splat;
    set_block(f, p, b, eye);
    gl->Uniform1i(p->quads, 0);
    bind_splats(f, 0, 0, colors);
    gl->MultiDrawArrays(GL_POINTS, ranges->first, ranges->nodes, (GLsizei)ranges->count);
    if (!needs_quads(f, b, c, eye))
        return;
    gl->Uniform1i(p->quads, 1);
    for (uint32_t r = 0; r < ranges->count; r++) {
        bind_splats(f, ranges->first[r], 1, colors);
        gl->DrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, ranges->nodes[r]);
    }
}

static void draw_triangles(const struct frame *f, const struct spc_block *b,
                           const struct spc_block_layout *l, const uint8_t *payload,
                           const double eye[3], const struct spv_ranges *ranges)
{
    const struct spv_gl_api *gl = &f->gl->api;
    const struct program *p = &f->gl->triangle;
    GLint hi[3], lo[3];
    struct spv_ranges corners = *ranges;
    set_block(f, p, b, eye);
    for (int a = 0; a < 3; a++) {
        const int64_t base = (int64_t)load_u64(payload + l->vertex_base + 8 * a) - f->eye_lattice[a];
        hi[a] = (GLint)(base >> 16);
        lo[a] = (GLint)(base & 0xFFFF);
    }
    gl->Uniform3i(p->base_hi, hi[0], hi[1], hi[2]);
    gl->Uniform3i(p->base_lo, lo[0], lo[1], lo[2]);
    gl->Uniform1i(p->width, (GLint)b->vertex_width);
    gl->DisableVertexAttribArray(0);
    gl->DisableVertexAttribArray(1);
    for (uint32_t r = 0; r < corners.count; r++) {
        corners.first[r] *= 3;
        corners.nodes[r] *= 3;
    }
    gl->MultiDrawArrays(GL_TRIANGLES, corners.first, corners.nodes, (GLsizei)corners.count);
}

static enum spc_status draw_block(struct frame *f, uint32_t index, struct spc_error *err)
{
    struct spv_gl *gl = f->gl;
    struct spc_block b;
    struct spc_cluster c;
    struct spc_block_layout l;
    struct spv_ranges ranges;
    double eye[3];
    spc_reader_block(f->reader, index, &b);
    spc_reader_cluster(f->reader, b.cluster, &c);
    spv_eye_of_cluster(f->reader, &c, &f->view->camera, eye);
    spc_block_layout(&b, f->header->flags, f->header->normal_clusters, &l);
    if (l.bytes > gl->payload_max) {
        free(gl->payload);
        gl->payload_max = 0;
        gl->payload = malloc(l.bytes);
        if (gl->payload == NULL)
            return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to decode a block");
        gl->payload_max = l.bytes;
    }
    const enum spc_status status = spc_block_decode(f->reader, index, true, gl->payload, err);
    if (status != SPC_OK)
        return status;
    spv_visible_ranges(f->reader, f->view, &b, &c, eye, gl->payload + l.groups, &ranges);
    if (ranges.count == 0)
        return SPC_OK;
    upload_block(f, &b, &l, gl->payload);
    if (f->view->mode != SPV_TRIANGLES)
        draw_splats(f, &b, &c, eye, &ranges, l.colors != 0);
    if (l.indices && f->view->mode != SPV_POINTS)
        draw_triangles(f, &b, &l, gl->payload, eye, &ranges);
    return SPC_OK;
}

/* ---- frame ------------------------------------------------------------------------------------- */

/* The tile's pixels into the picture; GL's rows run upwards. */
static enum spc_status read_tile(const struct frame *f, uint8_t *rgba, struct spc_error *err)
{
    const struct spv_gl_api *gl = &f->gl->api;
    const size_t row = (size_t)f->width * 4;
    uint8_t *tile = malloc(row * (size_t)f->height);
    if (tile == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a picture");
    gl->PixelStorei(GL_PACK_ALIGNMENT, 4);
    gl->ReadPixels(GUARD, GUARD, f->width, f->height, GL_RGBA, GL_UNSIGNED_BYTE, tile);
    for (int y = 0; y < f->height; y++) {
        const size_t to = ((size_t)(f->y0 + y) * (size_t)f->view->camera.width + (size_t)f->x0) * 4;
        memcpy(rgba + to, tile + row * (size_t)(f->height - 1 - y), row);
    }
    free(tile);
    if (gl->GetError() != GL_NO_ERROR)
        return spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "OpenGL failed while drawing");
    return SPC_OK;
}

static enum spc_status draw_tile(struct frame *f, const struct spv_part *part, uint8_t *rgba,
                                 struct spc_error *err)
{
    enum spc_status status =
        set_target(f->gl, f->width + 2 * GUARD, f->height + 2 * GUARD, err);
    if (status != SPC_OK)
        return status;
    set_frame(f, &f->gl->splat);
    set_frame(f, &f->gl->triangle);
    for (uint32_t i = 0; i < part->item_count && status == SPC_OK; i++)
        status = draw_block(f, part->items[i].block, err);
    return status == SPC_OK ? read_tile(f, rgba, err) : status;
}

static enum spc_status draw_parts(struct spv_draw *draw, const struct frame_input *in, uint8_t *rgba,
                                  struct spv_drawn *drawn, struct spc_error *err)
{
    struct spv_gl *gl = (struct spv_gl *)draw;
    const struct spv_view *view = in->view;
    const struct spv_part *part = &in->parts[0];
    struct frame f = {.gl = gl, .reader = part->reader, .header = spc_reader_header(part->reader),
                      .view = view, .options = in->options};
    int side = in->options->tile > 0 ? in->options->tile : TILE_DEFAULT;
    if (side > gl->target_side_max - 2 * GUARD)
        side = gl->target_side_max - 2 * GUARD;
    drawn->nodes = drawn->triangles = UINT64_MAX;
    place_eye(&f);
    for (f.y0 = 0; f.y0 < view->camera.height; f.y0 += side)
        for (f.x0 = 0; f.x0 < view->camera.width; f.x0 += side) {
            f.width = view->camera.width - f.x0 < side ? view->camera.width - f.x0 : side;
            f.height = view->camera.height - f.y0 < side ? view->camera.height - f.y0 : side;
            const enum spc_status status = draw_tile(&f, part, rgba, err);
            if (status != SPC_OK)
                return status;
        }
    return SPC_OK;
}

static void *keep(struct spv_draw *draw, const struct spc_reader *reader, uint32_t block, uint8_t *payload)
{
    (void)draw;
    (void)reader;
    (void)block;
    return payload;
}

static void drop(struct spv_draw *draw, void *kept)
{
    (void)draw;
    free(kept);
}

bool spv_gl_is_software(const struct spv_draw *draw)
{
    return strstr(draw->name, "llvmpipe") != NULL || strstr(draw->name, "softpipe") != NULL ||
           strstr(draw->name, "swrast") != NULL || strstr(draw->name, "SWR") != NULL;
}

static const struct draw_ops OPS = {release, draw_parts, keep, drop};

enum spc_status spv_gl_create(const struct spv_ctx *ctx, struct spv_draw **out, struct spc_error *err)
{
    *out = NULL;
    struct spv_gl *gl = calloc(1, sizeof *gl);
    if (gl == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for the renderer");
    gl->base.ops = &OPS;
    enum spc_status status = load_api(gl, ctx, err);
    if (status != SPC_OK) {
        free(gl);
        return status;
    }
    status = check_context(gl, err);
    if (status == SPC_OK)
        status = make_program(gl, GLSL_SPLAT_VS, GLSL_SPLAT_FS, &gl->splat, err);
    if (status == SPC_OK)
        status = make_program(gl, GLSL_TRIANGLE_VS, GLSL_TRIANGLE_FS, &gl->triangle, err);
    if (status != SPC_OK) {
        release(&gl->base);
        return status;
    }
    const struct spv_gl_api *f = &gl->api;
    f->GenVertexArrays(1, &gl->vao);
    f->BindVertexArray(gl->vao);
    f->GenBuffers(BUF_COUNT, gl->buffers);
    f->GenTextures(BUF_COUNT, gl->textures);
    f->GenFramebuffers(1, &gl->frame);
    f->GenRenderbuffers(1, &gl->color);
    f->GenRenderbuffers(1, &gl->depth);
    f->Enable(GL_DEPTH_TEST);
    f->Enable(GL_PROGRAM_POINT_SIZE);
    f->DepthFunc(GL_GREATER);
    f->ClearDepth(0);
    f->ClearColor(0, 0, 0, 0);
    *out = &gl->base;
    return SPC_OK;
}
