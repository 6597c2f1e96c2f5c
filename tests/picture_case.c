#include "picture_case.h"

#include "bytes.h"
#include "ctx.h"
#include "png_file.h"

#include <check.h>
#include <stdio.h>
#include <stdlib.h>

static enum picture_by used = PICTURE_BY_GL;
static struct spv_draw *soft;

void picture_use(enum picture_by by, unsigned threads)
{
    struct spc_error err = {0};
    used = by;
    spv_draw_free(soft);
    soft = NULL;
    if (by == PICTURE_BY_SOFT && spv_soft_create(threads, &soft, &err) != SPC_OK)
        ck_abort_msg("no renderer: %s", err.what);
}

struct spv_draw *picture_soft(void)
{
    return soft;
}

static struct spv_draw *renderer(void)
{
    static struct spv_ctx *ctx;
    static struct spv_draw *gl;
    struct spc_error err = {0};
    if (gl == NULL) {
        if (spv_ctx_osmesa(&ctx, &err) != SPC_OK || spv_gl_create(ctx, &gl, &err) != SPC_OK)
            ck_abort_msg("no renderer: %s", err.what);
    }
    return gl;
}

struct picture picture_draw(const struct spc_reader *reader, const struct spv_view *view,
                            const struct spv_draw_options *options)
{
    struct picture p = {.width = view->camera.width, .height = view->camera.height};
    const size_t n = (size_t)p.width * (size_t)p.height;
    struct spc_error err = {0};
    p.rgba = malloc(n * 4);
    p.cover = malloc(n);
    enum spc_status status = spv_select(reader, view, &p.selection, &err);
    if (status == SPC_OK)
        status = spv_draw_selection(used == PICTURE_BY_GL ? renderer() : soft, reader, view, &p.selection, options,
                                    p.rgba, &p.drawn, &err);
    if (status != SPC_OK)
        ck_abort_msg("cannot draw: %s", err.what);
    for (size_t i = 0; i < n; i++)
        p.cover[i] = p.rgba[4 * i + 3];
    return p;
}

void picture_release(struct picture *p)
{
    free(p->rgba);
    free(p->cover);
    spv_selection_release(&p->selection);
}

struct ref_image picture_reference(const struct spc_reader *reader, const struct spv_view *view,
                                   double fov_rad, const double eye[3], const double target[3],
                                   const double up[3])
{
    const struct spc_header *h = spc_reader_header(reader);
    struct ref_triangle *triangles = calloc(h->triangle_count, sizeof *triangles);
    struct ref_image image;
    size_t n = 0;
    for (uint32_t k = 0; k < h->block_count; k++) {
        struct spc_block b;
        struct spc_block_layout l;
        spc_reader_block(reader, k, &b);
        if (b.kind != SPC_BLOCK_LEAF)
            continue;
        spc_block_layout(&b, h->flags, h->normal_clusters, &l);
        uint8_t *payload = malloc(l.bytes);
        ck_assert_int_eq(spc_block_decode(reader, k, true, payload, NULL), SPC_OK);
        for (uint32_t i = 0; i < b.node_count; i++, n++)
            for (uint32_t c = 0; c < 3; c++)
                spc_vertex_decode(reader, &b, &l, payload,
                                  load_u16(payload + l.indices + 6 * i + 2 * c),
                                  triangles[n].corner[c], triangles[n].rgba[c]);
        free(payload);
    }
    struct ref_camera camera = {.fov_y_deg = fov_rad * 180 / 3.14159265358979323846,
                                .width = view->camera.width, .height = view->camera.height};
    memcpy(camera.eye, eye, sizeof camera.eye);
    memcpy(camera.target, target, sizeof camera.target);
    memcpy(camera.up, up, sizeof camera.up);
    ck_assert_int_eq(ref_raster(triangles, n, &camera, 0.2, &image), 0);
    free(triangles);
    return image;
}

struct spv_view picture_view(const struct picture_view *v)
{
    struct spv_view view = {.mode = v->mode, .cull = true};
    ck_assert(spv_camera_look(&view.camera, v->eye, v->target, v->up, v->fov_rad, v->width,
                              v->height));
    view.eps = spv_camera_eps(&view.camera, v->eps_px);
    return view;
}

static void keep_pictures(const struct picture *p, const struct ref_image *r, const char *name)
{
    const char *folder = getenv("SPC_PICTURES");
    char path[300];
    if (folder == NULL)
        return;
    const size_t n = (size_t)p->width * (size_t)p->height;
    uint8_t *rgba = malloc(n * 4);
    for (size_t i = 0; i < n; i++) {
        memcpy(rgba + 4 * i, r->rgb + 3 * i, 3);
        rgba[4 * i + 3] = r->triangle[i] == UINT32_MAX ? 0 : 255;
    }
    snprintf(path, sizeof path, "%s/%s-reference.png", folder, name);
    spv_png_write(path, rgba, p->width, p->height, true, NULL);
    snprintf(path, sizeof path, "%s/%s.png", folder, name);
    spv_png_write(path, p->rgba, p->width, p->height, true, NULL);
    free(rgba);
}

struct ref_compare picture_compare(const struct spc_reader *reader, const struct picture_view *v,
                                   const struct spv_draw_options *options, const char *name)
{
    const struct spv_view view = picture_view(v);
    struct picture p = picture_draw(reader, &view, options);
    struct ref_image r = picture_reference(reader, &view, v->fov_rad, v->eye, v->target, v->up);
    struct ref_compare c;
    ref_compare_cover(&r, p.cover, &c);
    keep_pictures(&p, &r, name);
    picture_release(&p);
    ref_image_release(&r);
    return c;
}
