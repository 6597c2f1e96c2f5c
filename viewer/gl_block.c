/*
 * gl_block.c - draws blocks, and tops of clusters that are missing.
 *
 * Where a node is tested and where it is drawn are two things: the uniforms' place is seen from the eye of
 * the tests, the attribute's from the picture's. Of a block the attribute is one for all nodes; tops of many
 * clusters have one each and are one draw, their tests made here.
 */
#include "draw_gl_int.h"

#include "bytes.h"
#include "kept.h"
#include "interval.h"
#include "paint.h"

#include <math.h>
#include <stdlib.h>

enum { TOP_COLOR = SPC_NODE_BYTES, TOP_PLACE = TOP_COLOR + 4, TOP_BYTES = TOP_PLACE + 16 };

struct placing {                    /* of a cluster, and of what is drawn of it */
    const struct gl_part *part;
    struct spc_cluster c;
    double eye[3], eye_tested[3];   /* cluster coordinates */
};

struct drawing {                    /* of a block */
    const struct placing *at;
    const struct gl_block *on_card;
    struct spc_block b;
    float step, lowest;             /* units; nodes of e_self up to lowest have no lower test */
};

static void place_cluster(const struct gl_frame *f, uint32_t part, uint32_t cluster, struct placing *out)
{
    const struct spc_reader *reader = f->in->parts[part].reader;
    out->part = &f->gl->parts[part];
    spc_reader_cluster(reader, cluster, &out->c);
    spv_eye_of_cluster(reader, &out->c, &f->in->view->camera, out->eye);
    spv_eye_of_cluster(reader, &out->c, &f->in->tested->camera, out->eye_tested);
}

/* ---- splats ------------------------------------------------------------------------------------ */

/* Can the block hold a splat that is no point? Its radii against the nearest it can be. */
static bool needs_quads(const struct gl_frame *f, const struct placing *at, float radius_max)
{
    const struct spv_camera *camera = &f->in->view->camera;
    const double near2 = spv_box_distance2(&at->c, at->eye);
    /* A splat's square is at most 2 (sqrt(2) R) f sec^2 / z; z / distance is least in a corner. */
    const double x = camera->width / (2 * camera->focal_px);
    const double y = camera->height / (2 * camera->focal_px);
    const double sec2 = 1 + x * x + y * y;
    const double extent = 2 * 1.4143 * (double)radius_max * 1.1;
    const double z = sqrt(near2) / sqrt(sec2) - extent;
    return z <= 0 || extent * camera->focal_px * sec2 / z + 2 > (double)f->gl->point_limit;
}

static void bind_array(const struct spv_gl_api *gl, GLuint at, GLuint divisor)
{
    gl->EnableVertexAttribArray(at);
    gl->VertexAttribDivisor(at, divisor);
}

static void bind_color(const struct spv_gl_api *gl, uint32_t rgba)
{
    gl->DisableVertexAttribArray(AT_COLOR);
    gl->VertexAttrib4f(AT_COLOR, (float)(rgba & 0xFF) / 255, (float)(rgba >> 8 & 0xFF) / 255,
                       (float)(rgba >> 16 & 0xFF) / 255, 1);
}

/* Attributes of nodes first and on. colors: bytes into the buffer, 0: the color that is set */
static void bind_splats(const struct gl_frame *f, const struct gl_block *on_card, uint32_t colors, GLint first,
                        GLuint divisor)
{
    const struct spv_gl_api *gl = &f->gl->api;
    const uint8_t *base = NULL;     /* of the buffer that is bound */
    gl->BindBuffer(GL_ARRAY_BUFFER, on_card->buffer);
    gl->VertexAttribIPointer(AT_NODE, 4, GL_UNSIGNED_INT, SPC_NODE_BYTES,
                             base + on_card->l.nodes + SPC_NODE_BYTES * (size_t)first);
    bind_array(gl, AT_NODE, divisor);
    if (colors) {
        gl->VertexAttribPointer(AT_COLOR, 4, GL_UNSIGNED_BYTE, GL_TRUE, 4, base + colors + 4 * (size_t)first);
        bind_array(gl, AT_COLOR, divisor);
    }
}

static void draw_splats(const struct gl_frame *f, const struct drawing *d, const struct spv_ranges *ranges,
                        uint32_t colors)
{
    const struct spv_gl_api *gl = &f->gl->api;
    const struct program *p = &f->gl->splat;
    gl->Uniform1i(p->quads, 0);
    bind_splats(f, d->on_card, colors, 0, 0);
    gl->MultiDrawArrays(GL_POINTS, ranges->first, ranges->nodes, (GLsizei)ranges->count);
    if (!needs_quads(f, d->at, d->b.radius_max))
        return;
    gl->Uniform1i(p->quads, 1);
    for (uint32_t r = 0; r < ranges->count; r++) {
        bind_splats(f, d->on_card, colors, ranges->first[r], 1);
        gl->DrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, ranges->nodes[r]);
    }
}

/* ---- blocks ------------------------------------------------------------------------------------ */

static void set_splats(const struct gl_frame *f, const struct drawing *d)
{
    const struct spv_gl_api *gl = &f->gl->api;
    const struct program *p = &f->gl->splat;
    const double *eye = d->at->eye, *tested = d->at->eye_tested;
    gl->UseProgram(p->id);
    gl->Uniform1i(p->all, 0);
    gl->Uniform4f(p->place, (float)-tested[0], (float)-tested[1], (float)-tested[2], d->step);
    gl->Uniform2f(p->range, d->lowest, (float)d->b.link_base);
    gl->DisableVertexAttribArray(AT_PLACE);
    gl->VertexAttrib4f(AT_PLACE, (float)-eye[0], (float)-eye[1], (float)-eye[2], d->step);
}

static void set_triangles(const struct gl_frame *f, const struct drawing *d)
{
    const struct spv_gl_api *gl = &f->gl->api;
    const struct program *p = &f->gl->triangle;
    const struct gl_block *on_card = d->on_card;
    const double *tested = d->at->eye_tested;
    GLint hi[3], lo[3];
    for (int a = 0; a < 3; a++) {
        const int64_t base = on_card->vertex_base[a] - d->at->part->eye_lattice[a];
        hi[a] = (GLint)(base >> 16);
        lo[a] = (GLint)(base & 0xFFFF);
    }
    gl->UseProgram(p->id);
    gl->Uniform4f(p->place, (float)-tested[0], (float)-tested[1], (float)-tested[2], d->step);
    gl->Uniform3i(p->base_hi, hi[0], hi[1], hi[2]);
    gl->Uniform3i(p->base_lo, lo[0], lo[1], lo[2]);
    gl->Uniform1i(p->width, (GLint)d->b.vertex_width);
    gl->Uniform4i(p->at, (GLint)(on_card->l.nodes / SPC_NODE_BYTES), (GLint)(on_card->l.indices / 2),
                  (GLint)(on_card->l.vertices / (d->b.vertex_width == 2 ? 2 : 4)),
                  (GLint)(on_card->l.vertex_colors / 4));
    gl->DisableVertexAttribArray(AT_NODE);
    gl->DisableVertexAttribArray(AT_COLOR);
    gl->DisableVertexAttribArray(AT_PLACE);
    for (int v = 0; v < VIEW_COUNT; v++) {
        gl->ActiveTexture(GL_TEXTURE0 + (GLenum)v);
        gl->BindTexture(GL_TEXTURE_BUFFER, on_card->textures[v]);
    }
}

static void draw_triangles(const struct gl_frame *f, const struct spv_ranges *ranges)
{
    struct spv_ranges corners = *ranges;
    for (uint32_t r = 0; r < corners.count; r++) {
        corners.first[r] *= 3;
        corners.nodes[r] *= 3;
    }
    f->gl->api.MultiDrawArrays(GL_TRIANGLES, corners.first, corners.nodes, (GLsizei)corners.count);
}

/* Those nodes of normal cluster g that are in the ranges, which hold all of a normal cluster or nothing. */
static void range_of_group(const struct gl_block *on_card, uint32_t g, const struct spv_ranges *ranges,
                           struct spv_ranges *out)
{
    int first = 0;
    const int nodes = load_u16(on_card->facts + 4 * g);
    for (uint32_t k = 0; k < g; k++)
        first += load_u16(on_card->facts + 4 * k);
    out->count = 0;
    for (uint32_t r = 0; r < ranges->count && nodes > 0; r++)
        if (first >= ranges->first[r] && first < ranges->first[r] + ranges->nodes[r]) {
            out->count = 1;
            out->first[0] = first;
            out->nodes[0] = nodes;
        }
}

/* Draws ranges in the scan's own colours, or in one for each normal cluster, or one for all. */
static void draw_painted(const struct gl_frame *f, const struct drawing *d, const struct spv_ranges *ranges,
                         bool triangles)
{
    const struct spv_gl_api *gl = &f->gl->api;
    const enum spv_paint paint = f->in->options->paint;
    const uint32_t groups = paint == SPV_PAINT_NORMALS ? d->at->part->header->normal_clusters : 1;
    const uint32_t colors = paint == SPV_PAINT_SCAN ? d->on_card->l.colors : 0;
    for (uint32_t g = 0; g < groups; g++) {
        const uint32_t rgba = spv_paint_color(paint, d->b.cluster, d->at->c.level, g, triangles);
        struct spv_ranges of_group;
        if (groups > 1)
            range_of_group(d->on_card, g, ranges, &of_group);
        const struct spv_ranges *drawn = groups > 1 ? &of_group : ranges;
        if (drawn->count == 0)
            continue;
        if (triangles) {
            gl->Uniform3f(f->gl->triangle.paint, (float)(rgba & 0xFF) / 255, (float)(rgba >> 8 & 0xFF) / 255,
                          (float)(rgba >> 16 & 0xFF) / 255);
            draw_triangles(f, drawn);
        } else {
            bind_color(gl, rgba);
            draw_splats(f, d, drawn, colors);
        }
    }
}

static enum spc_status draw_item(const struct gl_frame *f, const struct placing *at, const struct spv_item *item,
                                 uint64_t *tested, struct spc_error *err)
{
    const struct spc_reader *reader = at->part->part->reader;
    const struct spc_header *h = at->part->header;
    const enum spv_mode mode = f->in->view->mode;
    struct drawing d = {.at = at, .on_card = item->kept};
    struct spv_ranges ranges;
    spc_reader_block(reader, item->block, &d.b);
    const bool sorted = f->in->options->paint != SPV_PAINT_NORMALS;        /* by which the file sorts them */
    if (item->kept == NULL || !sorted) {
        const enum spc_status status = spv_gl_stream(f->gl, reader, item->block, sorted, &d.on_card, err);
        if (status != SPC_OK)
            return status;
    }
    const uint8_t *groups = d.on_card->facts, *codes = groups + 4 * (size_t)h->normal_clusters;
    if (sorted)
        spv_kept_ranges(reader, f->in->tested, &d.b, &at->c, at->eye_tested, codes, 2, groups, &ranges);
    else
        spv_visible_ranges(reader, f->in->tested, &d.b, &at->c, at->eye_tested, groups, &ranges);
    for (uint32_t r = 0; r < ranges.count; r++)
        *tested += (uint64_t)ranges.nodes[r];
    if (ranges.count == 0)
        return SPC_OK;
    const bool gives_way = d.b.kind == SPC_BLOCK_INNER || (mode == SPV_HYBRID && (h->flags & SPC_FLAG_TRIANGLES));
    d.step = ldexpf(1, d.b.step_exp - h->unit_exp);
    d.lowest = gives_way ? item->missing : 3e38f;
    if (mode != SPV_TRIANGLES) {
        set_splats(f, &d);
        draw_painted(f, &d, &ranges, false);
    }
    if (d.on_card->l.indices && mode != SPV_POINTS) {
        set_triangles(f, &d);
        draw_painted(f, &d, &ranges, true);
    }
    return SPC_OK;
}

enum spc_status spv_gl_draw_cluster(struct gl_frame *f, struct gl_cluster *cluster, struct spc_error *err)
{
    const struct spv_item *items = f->in->parts[cluster->part].items + cluster->first;
    struct placing at;
    enum spc_status status = SPC_OK;
    spv_gl_use_part(f, cluster->part);
    place_cluster(f, cluster->part, cluster->cluster, &at);
    for (uint32_t i = 0; i < cluster->count && status == SPC_OK; i++)
        status = draw_item(f, &at, &items[i], &cluster->nodes, err);
    return status;
}

/* ---- tops -------------------------------------------------------------------------------------- */

static void store_float(uint8_t *to, float v)
{
    memcpy(to, &v, sizeof v);
}

/* Appends those tops of a cluster that pass their upper test; returns how many. */
static uint32_t take_tops(const struct gl_frame *f, const struct placing *at, uint32_t cluster, uint8_t *to)
{
    const struct spc_header *h = at->part->header;
    const enum spv_paint paint = f->in->options->paint;
    uint32_t taken = 0;
    for (uint32_t k = 0; k < at->c.top_count; k++) {
        const struct spc_top *top = &at->c.tops[k];
        struct spv_interval upper = {.step = ldexpf(1, top->step_exp - h->unit_exp), .eps = (float)f->in->tested->eps,
                                     .link_base = top->link_base};
        uint8_t *out = to + (size_t)taken * TOP_BYTES;
        for (int a = 0; a < 3; a++) {
            upper.origin[a] = (float)-at->eye_tested[a];
            store_float(out + TOP_PLACE + 4 * a, (float)-at->eye[a]);
        }
        if (!spv_interval_point(&upper, top->record))
            continue;
        memcpy(out, top->record, SPC_NODE_BYTES);
        store_float(out + TOP_PLACE + 12, upper.step);
        store_u32(out + TOP_COLOR, spv_paint_color(paint, cluster, at->c.level, 0, false));
        if (paint == SPV_PAINT_SCAN && (h->flags & SPC_FLAG_COLORS))
            memcpy(out + TOP_COLOR, top->rgba, sizeof top->rgba);
        taken++;
    }
    return taken;
}

static void bind_tops(const struct spv_gl_api *gl, GLuint divisor)
{
    const uint8_t *base = NULL;
    gl->VertexAttribIPointer(AT_NODE, 4, GL_UNSIGNED_INT, TOP_BYTES, base);
    gl->VertexAttribPointer(AT_COLOR, 4, GL_UNSIGNED_BYTE, GL_TRUE, TOP_BYTES, base + TOP_COLOR);
    gl->VertexAttribPointer(AT_PLACE, 4, GL_FLOAT, GL_FALSE, TOP_BYTES, base + TOP_PLACE);
    bind_array(gl, AT_NODE, divisor);
    bind_array(gl, AT_COLOR, divisor);
    bind_array(gl, AT_PLACE, divisor);
}

enum spc_status spv_gl_draw_tops(struct gl_frame *f, uint32_t part, uint64_t *tested, struct spc_error *err)
{
    const struct spv_part *from = &f->in->parts[part];
    const struct spv_gl_api *gl = &f->gl->api;
    const struct program *p = &f->gl->splat;
    uint32_t count = 0;
    if (from->top_count == 0 || f->in->view->mode == SPV_TRIANGLES)
        return SPC_OK;
    if (!spv_gl_room((void **)&f->gl->top_bytes, &f->gl->top_bytes_max, (size_t)from->top_count * SPC_TOPS_MAX,
                     TOP_BYTES))
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to draw tops");
    for (uint32_t k = 0; k < from->top_count; k++) {
        struct placing at;
        place_cluster(f, part, from->tops[k], &at);
        count += take_tops(f, &at, from->tops[k], f->gl->top_bytes + (size_t)count * TOP_BYTES);
        *tested += at.c.top_count;
    }
    if (count == 0)
        return SPC_OK;
    spv_gl_use_part(f, part);
    gl->UseProgram(p->id);
    gl->Uniform1i(p->all, 1);
    gl->BindBuffer(GL_ARRAY_BUFFER, f->gl->tops);
    gl->BufferData(GL_ARRAY_BUFFER, (GLsizeiptr)((size_t)count * TOP_BYTES), f->gl->top_bytes, GL_STREAM_DRAW);
    for (int quads = 0; quads < 2; quads++) {
        gl->Uniform1i(p->quads, quads);
        bind_tops(gl, (GLuint)quads);
        if (quads)
            gl->DrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, (GLsizei)count);
        else
            gl->DrawArrays(GL_POINTS, 0, (GLsizei)count);
    }
    return SPC_OK;
}
