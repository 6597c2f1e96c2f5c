/*
 * draw_gl.c - the OpenGL 3.3 back end: life, programs, frames and tiles. draw_gl_int.h says who does the rest.
 */
#include "draw_gl_int.h"

#include "glsl.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { TILE_DEFAULT = 2048 };

/* ---- set-up ------------------------------------------------------------------------------------ */

static void find_uniforms(struct spv_gl *gl, struct program *p)
{
    const struct { GLint *at; const char *name; } uniforms[] = {
        {&p->place, "u_place"}, {&p->range, "u_range"}, {&p->eps, "u_eps"}, {&p->view, "u_view"},
        {&p->focal, "u_focal"}, {&p->center, "u_center"}, {&p->size, "u_size"},
        {&p->limit, "u_limit"}, {&p->pad, "u_pad"}, {&p->near, "u_near"}, {&p->quads, "u_quads"},
        {&p->fast, "u_fast"}, {&p->ambient, "u_ambient"}, {&p->base_hi, "u_base_hi"},
        {&p->base_lo, "u_base_lo"}, {&p->eye_rest, "u_eye_rest"}, {&p->lattice, "u_lattice"},
        {&p->width, "u_width"}, {&p->all, "u_all"}, {&p->colored, "u_colored"}, {&p->at, "u_at"},
        {&p->paint, "u_paint"}, {&p->rect, "u_rect"}, {&p->depth, "u_depth"}, {&p->scale, "u_scale"},
        {&p->background, "u_background"}, {&p->guard, "u_guard"},
    };
    for (size_t i = 0; i < sizeof uniforms / sizeof *uniforms; i++)
        *uniforms[i].at = gl->api.GetUniformLocation(p->id, uniforms[i].name);
}

static enum spc_status make_program(struct spv_gl *gl, const char *vertex, const char *fragment,
                                    struct program *p, struct spc_error *err)
{
    const enum spc_status status = spv_gl_program(&gl->api, vertex, fragment, &p->id, err);
    if (status == SPC_OK)
        find_uniforms(gl, p);
    return status;
}

static enum spc_status check_context(struct spv_gl *gl, struct spc_error *err)
{
    const struct spv_gl_api *f = &gl->api;
    GLint major = 0, minor = 0, side = 0, texture = 0, view[2] = {0, 0}, texels = 0;
    GLfloat points[2] = {0, 0};
    const GLubyte *renderer = f->GetString(GL_RENDERER);
    f->GetIntegerv(GL_MAJOR_VERSION, &major);
    f->GetIntegerv(GL_MINOR_VERSION, &minor);
    f->GetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &side);
    f->GetIntegerv(GL_MAX_TEXTURE_SIZE, &texture);
    f->GetIntegerv(GL_MAX_VIEWPORT_DIMS, view);
    f->GetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &texels);
    f->GetFloatv(GL_POINT_SIZE_RANGE, points);
    snprintf(gl->base.name, sizeof gl->base.name, "%s, OpenGL %d.%d",
             renderer != NULL ? (const char *)renderer : "unknown", major, minor);
    gl->side_max = (int)fmin(fmin(side, texture), fmin(view[0], view[1]));
    if (gl->side_max <= 2 * GUARD)
        return spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "OpenGL draws no pictures of a useful size");
    gl->texels_max = texels > 0 ? (size_t)texels : 0;
    gl->point_limit = fminf(points[1], 2 * GUARD);
    gl->query = major > 4 || (major == 4 && minor >= 3) ? GL_ANY_SAMPLES_PASSED_CONSERVATIVE : GL_ANY_SAMPLES_PASSED;
    return SPC_OK;
}

static void release(struct spv_draw *draw)
{
    struct spv_gl *gl = spv_gl_of(draw);
    const struct spv_gl_api *f = &gl->api;
    spv_gl_drop(draw, gl->stream);
    spv_gl_hide_release(gl);
    f->DeleteProgram(gl->splat.id);
    f->DeleteProgram(gl->triangle.id);
    f->DeleteProgram(gl->box.id);
    f->DeleteProgram(gl->show.id);
    f->DeleteBuffers(1, &gl->tops);
    f->DeleteFramebuffers(1, &gl->frame);
    f->DeleteTextures(1, &gl->color);
    f->DeleteRenderbuffers(1, &gl->depth);
    f->DeleteVertexArrays(1, &gl->vao);
    free(gl->payload);
    free(gl->parts);
    free(gl->clusters);
    free(gl->top_bytes);
    free(gl);
}

bool spv_gl_room(void **array, size_t *max, size_t count, size_t each)
{
    if (count <= *max)
        return true;
    free(*array);
    *max = 0;
    *array = count > SIZE_MAX / 2 / each ? NULL : malloc((count + count / 2) * each);
    *max = *array != NULL ? count + count / 2 : 0;
    return *array != NULL;
}

enum spc_status spv_gl_check(const struct spv_gl *gl, struct spc_error *err)
{
    const GLenum first = gl->api.GetError();
    for (int k = 0; k < 16 && gl->api.GetError() != GL_NO_ERROR; k++)
        ;                           /* a lost context never stops complaining */
    if (first == GL_NO_ERROR)
        return SPC_OK;
    if (first == GL_OUT_OF_MEMORY)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "OpenGL is out of memory");
    return spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "OpenGL failed while drawing: error 0x%04X", first);
}

/* ---- uniforms ---------------------------------------------------------------------------------- */

/* What holds for the whole tile. */
static void set_tile(const struct gl_frame *f, const struct program *p)
{
    const struct spv_gl_api *gl = &f->gl->api;
    const struct spv_camera *c = &f->in->view->camera;
    const float view[9] = {         /* columns */
        (float)c->right[0], (float)c->up[0], (float)c->forward[0],
        (float)c->right[1], (float)c->up[1], (float)c->forward[1],
        (float)c->right[2], (float)c->up[2], (float)c->forward[2],
    };
    gl->UseProgram(p->id);
    gl->UniformMatrix3fv(p->view, 1, GL_FALSE, view);
    gl->Uniform1f(p->focal, (float)c->focal_px);
    gl->Uniform2f(p->center, (float)f->center[0], (float)f->center[1]);
    gl->Uniform2f(p->size, (float)f->gl->target_width, (float)f->gl->target_height);
    gl->Uniform1f(p->eps, (float)f->in->tested->eps);
    gl->Uniform1f(p->ambient, f->in->options->ambient);
    if (p == &f->gl->splat) {
        gl->Uniform1f(p->limit, f->gl->point_limit);
        gl->Uniform1f(p->pad, (float)(1.05 / 64 / c->focal_px));    /* 1/64 px and roundings (I5) */
        gl->Uniform1i(p->fast, f->in->options->splat == SPV_SPLAT_FAST);
    } else {
        gl->Uniform1i(p->all, f->in->view->mode == SPV_TRIANGLES);
    }
}

void spv_gl_use_part(struct gl_frame *f, uint32_t part)
{
    const struct spv_gl_api *gl = &f->gl->api;
    const struct gl_part *p = &f->gl->parts[part];
    const struct program *triangle = &f->gl->triangle;
    if (f->part_set == part)
        return;
    f->part_set = part;
    gl->UseProgram(f->gl->splat.id);
    gl->Uniform1f(f->gl->splat.near, p->near);
    gl->UseProgram(triangle->id);
    gl->Uniform1f(triangle->near, p->near);
    gl->Uniform3f(triangle->eye_rest, p->eye_rest[0], p->eye_rest[1], p->eye_rest[2]);
    gl->Uniform1f(triangle->lattice, p->lattice);
    gl->Uniform1i(triangle->colored, p->colored);
}

/* ---- parts ------------------------------------------------------------------------------------- */

/*
 * The lattice point nearest to the eye, as far as it lies near the scan: corners are counted from
 * it in integers. Further off the rest is large, and the same for all corners.
 */
static void place_eye(struct gl_part *p, const struct spv_camera *c)
{
    const struct spc_header *h = p->header;
    for (int a = 0; a < 3; a++) {
        const double at = fmin(fmax(c->eye[a], h->box_min[a]), h->box_max[a]);
        const double lattice = floor(ldexp(at, -h->vertex_exp) + 0.5);
        p->eye_lattice[a] = (int64_t)lattice;
        p->eye_rest[a] = (float)ldexp(ldexp(lattice, h->vertex_exp) - c->eye[a], -h->unit_exp);
    }
}

/*
 * Depth is near / z: near is the same length for all parts, an exact power of two in each part's unit.
 * 2^-40 of the smallest unit, unless what is farthest would then be lost at the other end.
 */
static void place_near(struct spv_gl *gl, const struct frame_input *in)
{
    int near = INT32_MAX, far = INT32_MIN;
    for (uint32_t k = 0; k < in->part_count; k++) {
        const struct spc_header *h = gl->parts[k].header;
        double most = 0;
        int exponent;
        for (int a = 0; a < 3; a++)
            most = fmax(most, fmax(fabs(h->box_min[a] - in->view->camera.eye[a]),
                                   fabs(h->box_max[a] - in->view->camera.eye[a])));
        frexp(most, &exponent);
        near = h->unit_exp - 40 < near ? h->unit_exp - 40 : near;
        far = exponent > far ? exponent : far;
    }
    near = near > far - 118 ? near : far - 118;
    gl->near_exp = near;
    for (uint32_t k = 0; k < in->part_count; k++)
        gl->parts[k].near = ldexpf(1, near - gl->parts[k].header->unit_exp);
}

static enum spc_status take_parts(struct spv_gl *gl, const struct frame_input *in, struct spc_error *err)
{
    if (!spv_gl_room((void **)&gl->parts, &gl->parts_max, in->part_count, sizeof *gl->parts))
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to draw archives");
    for (uint32_t k = 0; k < in->part_count; k++) {
        struct gl_part *p = &gl->parts[k];
        const struct spc_header *h = spc_reader_header(in->parts[k].reader);
        *p = (struct gl_part){.part = &in->parts[k], .header = h,
                              .lattice = ldexpf(1, h->vertex_exp - h->unit_exp)};
        p->colored = (h->flags & SPC_FLAG_COLORS) && in->options->paint == SPV_PAINT_SCAN;
        place_eye(p, &in->view->camera);
    }
    place_near(gl, in);
    return SPC_OK;
}

/* ---- order ------------------------------------------------------------------------------------- */

static int nearer(const void *a, const void *b)
{
    const struct gl_cluster *p = a, *q = b;
    if (p->distance2 != q->distance2)
        return p->distance2 < q->distance2 ? -1 : 1;
    if (p->part != q->part)
        return p->part < q->part ? -1 : 1;
    return p->first < q->first ? -1 : p->first > q->first;
}

/* All parts' items by cluster, near first: what is near hides what is far. */
static enum spc_status near_first(struct gl_frame *f, struct spc_error *err)
{
    struct spv_gl *gl = f->gl;
    size_t count = 0;
    for (uint32_t p = 0; p < f->in->part_count; p++)
        count += f->in->parts[p].item_count;
    if (!spv_gl_room((void **)&gl->clusters, &gl->clusters_max, count, sizeof *gl->clusters))
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to order clusters");
    f->cluster_count = 0;
    for (uint32_t p = 0; p < f->in->part_count; p++) {
        const struct spc_reader *reader = f->in->parts[p].reader;
        const int unit = gl->parts[0].header->unit_exp;
        struct gl_cluster *last = NULL;
        for (uint32_t i = 0; i < f->in->parts[p].item_count; i++) {
            struct spc_block b;
            spc_reader_block(reader, f->in->parts[p].items[i].block, &b);
            if (last == NULL || last->cluster != b.cluster) {
                last = &gl->clusters[f->cluster_count++];
                *last = (struct gl_cluster){.part = p, .cluster = b.cluster, .first = i};
                last->distance2 = spv_cluster_distance2(reader, &f->in->view->camera, b.cluster, unit);
            }
            last->count++;
        }
    }
    if (f->cluster_count > 1)
        qsort(gl->clusters, f->cluster_count, sizeof *gl->clusters, nearer);
    return SPC_OK;
}

/* ---- frame ------------------------------------------------------------------------------------- */

static enum spc_status draw_tile(struct gl_frame *f, struct spc_error *err)
{
    const struct spv_camera *c = &f->in->view->camera;
    struct gl_asked *asked = &f->gl->asked[f->gl->turn];
    enum spc_status status = spv_gl_target(f->gl, f->width, f->height, err);
    if (status != SPC_OK)
        return status;
    f->center[0] = GUARD - f->x0 + c->width / 2.0;
    f->center[1] = GUARD - (c->height - f->y0 - f->height) + c->height / 2.0;
    f->part_set = SPC_NONE;
    set_tile(f, &f->gl->splat);
    set_tile(f, &f->gl->triangle);
    asked->count = 0;
    asked->nodes_total = 0;
    for (uint32_t p = 0; p < f->in->part_count && status == SPC_OK; p++)
        status = spv_gl_draw_tops(f, p, &asked->nodes_total, err);
    if (status == SPC_OK)
        status = spv_gl_draw_clusters(f, err);
    if (status == SPC_OK)
        status = spv_gl_probe(f, err);
    return status;
}

static enum spc_status draw_tiles(struct gl_frame *f, int side, uint8_t *rgba, struct spv_drawn *drawn,
                                  struct spc_error *err)
{
    const struct spv_camera *c = &f->in->view->camera;
    f->gl->one_tile = c->width <= side && c->height <= side;
    for (f->y0 = 0; f->y0 < c->height; f->y0 += side)
        for (f->x0 = 0; f->x0 < c->width; f->x0 += side) {
            f->width = c->width - f->x0 < side ? c->width - f->x0 : side;
            f->height = c->height - f->y0 < side ? c->height - f->y0 : side;
            enum spc_status status = draw_tile(f, err);
            if (status == SPC_OK && rgba != NULL) {
                spv_gl_read_tile(f, drawn);
                status = spv_gl_read(f, rgba, err);
            }
            if (status != SPC_OK)
                return status;
        }
    if (rgba == NULL)
        spv_gl_read_later(f, drawn);
    return SPC_OK;
}

static enum spc_status draw_parts(struct spv_draw *draw, const struct frame_input *in, uint8_t *rgba,
                                  struct spv_drawn *drawn, struct spc_error *err)
{
    struct spv_gl *gl = spv_gl_of(draw);
    const struct spv_camera *c = &in->view->camera;
    struct gl_frame f = {.gl = gl, .in = in};
    const int side_max = gl->side_max - 2 * GUARD;
    int side = rgba == NULL ? side_max : in->options->tile > 0 ? in->options->tile : TILE_DEFAULT;
    side = side < side_max ? side : side_max;
    if (rgba == NULL && (c->width > side || c->height > side))
        return spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "OpenGL draws %d x %d pixels at most", side, side);
    drawn->nodes = drawn->triangles = UINT64_MAX;
    spv_gl_check(gl, NULL);         /* what others did is not this frame's */
    enum spc_status status = take_parts(gl, in, err);
    if (status == SPC_OK)
        status = near_first(&f, err);
    if (status == SPC_OK)
        status = draw_tiles(&f, side, rgba, drawn, err);
    if (status == SPC_OK)
        status = spv_gl_check(gl, err);
    spv_gl_finish_hidden(&f, status == SPC_OK, rgba != NULL && status == SPC_OK ? drawn : NULL);
    return status;
}

/* ---- life -------------------------------------------------------------------------------------- */

bool spv_gl_is_software(const struct spv_draw *draw)
{
    return ((const struct spv_gl *)draw)->software;
}

static bool depth_at(struct spv_draw *draw, int x, int y, double *depth)
{
    const struct spv_gl *gl = spv_gl_of(draw);
    if (!gl->one_tile || x < 0 || y < 0 || x >= gl->picture_width || y >= gl->picture_height)
        return false;
    const float v = spv_gl_read_depth(gl, x, y);
    if (!(v > 0))
        return false;
    *depth = ldexp(1 / (double)v, gl->near_exp);
    return true;
}

static const struct draw_ops OPS = {release, draw_parts, depth_at, spv_gl_keep, spv_gl_drop};

static enum spc_status make_programs(struct spv_gl *gl, struct spc_error *err)
{
    const struct { struct program *p; const char *vertex, *fragment; } programs[] = {
        {&gl->splat, GLSL_SPLAT_VS, GLSL_SPLAT_FS},
        {&gl->triangle, GLSL_TRIANGLE_VS, GLSL_TRIANGLE_FS},
        {&gl->box, GLSL_BOX_VS, GLSL_BOX_FS},
        {&gl->show, GLSL_SHOW_VS, GLSL_SHOW_FS},
    };
    enum spc_status status = SPC_OK;
    for (size_t i = 0; i < sizeof programs / sizeof *programs && status == SPC_OK; i++)
        status = make_program(gl, programs[i].vertex, programs[i].fragment, programs[i].p, err);
    if (status != SPC_OK)
        return status;
    const struct spv_gl_api *f = &gl->api;
    f->UseProgram(gl->triangle.id);
    f->Uniform1i(f->GetUniformLocation(gl->triangle.id, "u_nodes"), VIEW_NODES);
    f->Uniform1i(f->GetUniformLocation(gl->triangle.id, "u_words"), VIEW_WORDS);
    f->UseProgram(gl->show.id);
    f->Uniform1i(f->GetUniformLocation(gl->show.id, "u_picture"), 0);
    f->Uniform1i(gl->show.guard, GUARD);
    f->UseProgram(0);
    return SPC_OK;
}

enum spc_status spv_gl_create(const struct spv_ctx *ctx, struct spv_draw **out, struct spc_error *err)
{
    *out = NULL;
    struct spv_gl *gl = calloc(1, sizeof *gl);
    if (gl == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for the renderer");
    gl->base.ops = &OPS;
    enum spc_status status = spv_gl_load(ctx, &gl->api, err);
    if (status != SPC_OK) {
        free(gl);
        return status;
    }
    gl->software = spv_ctx_is_software(ctx);
    gl->occlude = !gl->software;        /* where the processor draws, asking costs more than it saves */
    status = check_context(gl, err);
    if (status == SPC_OK)
        status = make_programs(gl, err);
    if (status == SPC_OK && !spv_gl_stream_create(gl))
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for the renderer");
    if (status != SPC_OK) {
        release(&gl->base);
        return status;
    }
    const struct spv_gl_api *f = &gl->api;
    f->GenVertexArrays(1, &gl->vao);
    f->GenBuffers(1, &gl->tops);
    f->GenFramebuffers(1, &gl->frame);
    f->GenTextures(1, &gl->color);
    f->GenRenderbuffers(1, &gl->depth);
    *out = &gl->base;
    return SPC_OK;
}
