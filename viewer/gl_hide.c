/*
 * gl_hide.c - leaves out clusters that lie behind what is already drawn in this frame.
 *
 * Clusters are drawn near first. Before each later share of them the card is asked of each of its clusters
 * whether a rectangle in the picture around all that it may cover, at the depth of the nearest that it may
 * reach, would show at any pixel; if not, the card leaves the cluster's drawing out by itself. The depth test
 * takes only what is strictly nearer, so a pixel that refuses the rectangle refuses all of the cluster, then
 * and later: the picture is the same, byte by byte, whatever the answers are. A rectangle with one depth is
 * larger and nearer than the box, and has no interpolated depths that round.
 */
#include "draw_gl_int.h"

#include <math.h>
#include <stdlib.h>

/* What is nearest is drawn without asking: at least so many clusters, and a share of all nodes. */
enum { UNASKED_MIN = 8, SHARES = 4 };

/* ---- rectangles -------------------------------------------------------------------------------- */

struct reach {                      /* of a box, view coordinates, units */
    double lo[2], hi[2];            /* of x / z, y / z */
    double z_min, z_max;
};

/* Corners of the box grown by pad. False when it comes too near to the eye's plane for that. */
static bool project(const struct spv_camera *c, const float box[6], const double eye[3], double pad,
                    struct reach *out)
{
    const double *axes[3] = {c->right, c->up, c->forward};
    *out = (struct reach){{HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL}, HUGE_VAL, -HUGE_VAL};
    for (int corner = 0; corner < 8; corner++) {
        double at[3] = {0, 0, 0}, size = 0;
        for (int a = 0; a < 3; a++) {
            const double d = (corner >> a & 1 ? (double)box[a + 3] + pad : (double)box[a] - pad) - eye[a];
            size += fabs(d);
            for (int v = 0; v < 3; v++)
                at[v] += axes[v][a] * d;
        }
        if (!(at[2] > 1e-6 * size))
            return false;
        for (int v = 0; v < 2; v++) {
            out->lo[v] = fmin(out->lo[v], at[v] / at[2]);
            out->hi[v] = fmax(out->hi[v], at[v] / at[2]);
        }
        out->z_min = fmin(out->z_min, at[2]);
        out->z_max = fmax(out->z_max, at[2]);
    }
    return true;
}

bool spv_gl_rect(const struct gl_frame *f, uint32_t part, uint32_t cluster, struct gl_rect *out)
{
    const struct spv_camera *camera = &f->in->view->camera;
    const struct spc_reader *reader = f->in->parts[part].reader;
    const double focal = camera->focal_px, near = (double)f->gl->parts[part].near;
    struct spc_cluster c;
    struct reach reach;
    double eye[3], size = 0;
    spc_reader_cluster(reader, cluster, &c);
    spv_eye_of_cluster(reader, &c, camera, eye);
    for (int a = 0; a < 3; a++)
        size += fmax(fabs((double)c.box[a] - eye[a]), fabs((double)c.box[a + 3] - eye[a]));
    /* A pill sticks out of its ball, and 1/64 px and roundings come to it. */
    const double radius = (double)c.radius_max, pad = 0.4143 * radius + size * (1.0 / 32 / focal + 0x1p-20);
    if (!project(camera, c.box, eye, pad, &reach))
        return false;
    double margin = 3 + focal * 0x1p-20, toward = 0;        /* px; tips of needles move by 2 */
    if (f->in->options->splat == SPV_SPLAT_FAST) {
        /* Squares reach beyond the pill by half their side, and are as near as the ray's foot there. */
        const double x = fmax(fabs(reach.lo[0]), fabs(reach.hi[0])), y = fmax(fabs(reach.lo[1]), fabs(reach.hi[1]));
        const double slant = sqrt(1 + x * x + y * y), side = 3.5 * (radius + pad) * focal * slant * slant / reach.z_min;
        margin += side;
        toward = reach.z_max * slant * 1.5 * side / focal;
    }
    const double z = reach.z_min - toward;
    if (!(z > 4 * near))
        return false;
    for (int v = 0; v < 2; v++) {
        out->px[v] = (float)fmax(-1e6, fmin(1e6, f->center[v] + focal * reach.lo[v] - margin));
        out->px[v + 2] = (float)fmax(-1e6, fmin(1e6, f->center[v] + focal * reach.hi[v] + margin));
    }
    /* Depths of steep triangles are interpolated: off by a share of how deep the box is. */
    const double span = near / z - near / reach.z_max;
    out->depth = (float)((near / z + span / 16) * (1 + 0x1p-16));
    out->inside = out->px[0] < (float)(GUARD + f->width) && out->px[2] > GUARD &&
                  out->px[1] < (float)(GUARD + f->height) && out->px[3] > GUARD;
    return out->depth < 1;
}

/* ---- questions --------------------------------------------------------------------------------- */

static bool asked_room(const struct spv_gl *gl, struct gl_asked *a, size_t count)
{
    if (count <= a->max)
        return true;
    GLuint *ids = realloc(a->ids, count * sizeof *ids);
    if (ids != NULL)
        a->ids = ids;
    uint32_t *of = realloc(a->of, count * sizeof *of);
    if (of != NULL)
        a->of = of;
    uint64_t *nodes = realloc(a->nodes, count * sizeof *nodes);
    if (nodes != NULL)
        a->nodes = nodes;
    if (ids == NULL || of == NULL || nodes == NULL)
        return false;
    gl->api.GenQueries((GLsizei)(count - a->max), ids + a->max);
    a->max = (uint32_t)count;
    return true;
}

static void asked_release(const struct spv_gl *gl, struct gl_asked *a)
{
    if (a->max > 0)
        gl->api.DeleteQueries((GLsizei)a->max, a->ids);
    free(a->ids);
    free(a->of);
    free(a->nodes);
}

void spv_gl_hide_release(struct spv_gl *gl)
{
    asked_release(gl, &gl->asked[0]);
    asked_release(gl, &gl->asked[1]);
    asked_release(gl, &gl->probed);
}

static void begin_asking(const struct gl_frame *f)
{
    const struct spv_gl_api *gl = &f->gl->api;
    gl->UseProgram(f->gl->box.id);
    gl->Uniform2f(f->gl->box.size, (float)f->gl->target_width, (float)f->gl->target_height);
    gl->DepthMask(GL_FALSE);
    gl->ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    gl->DisableVertexAttribArray(AT_NODE);
    gl->DisableVertexAttribArray(AT_COLOR);
    gl->DisableVertexAttribArray(AT_PLACE);
}

static void end_asking(const struct gl_frame *f)
{
    const struct spv_gl_api *gl = &f->gl->api;
    gl->DepthMask(GL_TRUE);
    gl->ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

/* Room for it was made. */
static void ask(const struct gl_frame *f, struct gl_asked *a, uint32_t of, const struct gl_rect *r)
{
    const struct spv_gl_api *gl = &f->gl->api;
    gl->Uniform4f(f->gl->box.rect, r->px[0], r->px[1], r->px[2], r->px[3]);
    gl->Uniform1f(f->gl->box.depth, r->depth);
    gl->BeginQuery(f->gl->query, a->ids[a->count]);
    gl->DrawArrays(GL_TRIANGLE_STRIP, 0, 4);
    gl->EndQuery(f->gl->query);
    a->of[a->count++] = of;
}

static bool was_seen(const struct spv_gl *gl, GLuint id)
{
    GLuint seen = 1;                /* if this fails, too */
    gl->api.GetQueryObjectuiv(id, GL_QUERY_RESULT, &seen);
    return seen != 0;
}

/* ---- clusters ---------------------------------------------------------------------------------- */

static enum spc_status draw_unasked(struct gl_frame *f, size_t first, size_t end, struct spc_error *err)
{
    enum spc_status status = SPC_OK;
    for (size_t i = first; i < end && status == SPC_OK; i++) {
        f->gl->clusters[i].seen = true;
        status = spv_gl_draw_cluster(f, &f->gl->clusters[i], err);
    }
    return status;
}

static enum spc_status draw_asked(struct gl_frame *f, size_t first, size_t end, struct spc_error *err)
{
    const struct spv_gl_api *gl = &f->gl->api;
    struct gl_asked *a = &f->gl->asked[f->gl->turn];
    enum spc_status status = SPC_OK;
    uint32_t next = a->count;
    begin_asking(f);
    for (size_t i = first; i < end; i++) {
        struct gl_cluster *c = &f->gl->clusters[i];
        struct gl_rect r;
        c->asked = spv_gl_rect(f, c->part, c->cluster, &r);
        if (c->asked)
            ask(f, a, (uint32_t)i, &r);
    }
    end_asking(f);
    for (size_t i = first; i < end && status == SPC_OK; i++) {
        struct gl_cluster *c = &f->gl->clusters[i];
        c->seen |= !c->asked;
        if (c->asked)
            gl->BeginConditionalRender(a->ids[next++], GL_QUERY_WAIT);
        status = spv_gl_draw_cluster(f, c, err);
        if (c->asked)
            gl->EndConditionalRender();
    }
    return status;
}

enum spc_status spv_gl_draw_clusters(struct gl_frame *f, struct spc_error *err)
{
    struct gl_asked *a = &f->gl->asked[f->gl->turn];
    const size_t count = f->cluster_count;
    enum spc_status status = SPC_OK;
    size_t first = count / SHARES > UNASKED_MIN ? count / SHARES : UNASKED_MIN;
    if (!f->gl->occlude || f->in->options->no_occlusion)
        first = count;
    first = first < count ? first : count;
    a->count = 0;
    for (size_t i = 0; i < count; i++)
        f->gl->clusters[i].nodes = 0;           /* of this tile */
    if (first < count && !asked_room(f->gl, a, count))
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to ask what is hidden");
    status = draw_unasked(f, 0, first, err);
    while (first < count && status == SPC_OK) {     /* each time as many as there are already */
        const size_t end = count - first < first ? count : 2 * first;
        status = draw_asked(f, first, end, err);
        first = end;
    }
    for (size_t i = 0; i < count; i++)
        a->nodes_total += f->gl->clusters[i].nodes;
    for (uint32_t i = 0; i < a->count; i++)
        a->nodes[i] = f->gl->clusters[a->of[i]].nodes;
    return status;
}

/* ---- probes ------------------------------------------------------------------------------------ */

enum spc_status spv_gl_probe(struct gl_frame *f, struct spc_error *err)
{
    struct gl_asked *a = &f->gl->probed;
    size_t count = 0;
    a->count = 0;
    for (uint32_t p = 0; p < f->in->part_count; p++)
        count += f->in->parts[p].probe_count;
    if (count == 0)
        return SPC_OK;
    if (!asked_room(f->gl, a, count))
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to ask what is hidden");
    begin_asking(f);
    uint32_t number = 0;
    for (uint32_t p = 0; p < f->in->part_count; p++)
        for (uint32_t k = 0; k < f->in->parts[p].probe_count; k++, number++) {
            struct gl_rect r;
            if (!spv_gl_rect(f, p, f->in->parts[p].probes[k], &r))
                f->in->parts[p].hidden[k] = 2;      /* seen */
            else if (r.inside)
                ask(f, a, number, &r);
        }
    end_asking(f);
    return SPC_OK;
}

/* hidden[k] is 0 before the first tile; 1: hidden where it was; 2: seen. */
static void read_probes(struct gl_frame *f)
{
    struct gl_asked *a = &f->gl->probed;
    uint32_t number = 0, at = 0;
    for (uint32_t p = 0; p < f->in->part_count; p++)
        for (uint32_t k = 0; k < f->in->parts[p].probe_count; k++, number++)
            if (at < a->count && a->of[at] == number) {
                const uint8_t now = was_seen(f->gl, a->ids[at++]) ? 2 : 1;
                uint8_t *hidden = &f->in->parts[p].hidden[k];
                *hidden = now > *hidden ? now : *hidden;
            }
}

/* Nodes that were tested, and clusters that were hidden, of the frame or tile that asked. */
static uint64_t read_clusters(const struct spv_gl *gl, const struct gl_asked *a, struct gl_cluster *clusters,
                              uint32_t *hidden)
{
    uint64_t nodes = a->nodes_total;
    *hidden = 0;
    for (uint32_t i = 0; i < a->count; i++) {
        const bool seen = was_seen(gl, a->ids[i]);
        if (clusters != NULL)
            clusters[a->of[i]].seen |= seen;
        nodes -= seen ? 0 : a->nodes[i];
        *hidden += !seen;
    }
    return nodes;
}

void spv_gl_read_tile(struct gl_frame *f, struct spv_drawn *drawn)
{
    uint32_t hidden;
    read_probes(f);
    drawn->nodes_processed += read_clusters(f->gl, &f->gl->asked[f->gl->turn], f->gl->clusters, &hidden);
}

void spv_gl_read_later(struct gl_frame *f, struct spv_drawn *drawn)
{
    struct spv_gl *gl = f->gl;
    struct gl_asked *now = &gl->asked[gl->turn], *before = &gl->asked[gl->turn ^= 1];
    read_probes(f);
    drawn->nodes_processed = read_clusters(gl, before->count > 0 && now->count > 0 ? before : now, NULL,
                                           &drawn->clusters_hidden);
}

void spv_gl_finish_hidden(struct gl_frame *f, bool whole, struct spv_drawn *drawn)
{
    for (uint32_t p = 0; p < f->in->part_count; p++)
        for (uint32_t k = 0; k < f->in->parts[p].probe_count; k++)
            f->in->parts[p].hidden[k] = whole && f->in->parts[p].hidden[k] == 1;
    for (size_t i = 0; i < f->cluster_count && drawn != NULL; i++)
        drawn->clusters_hidden += !f->gl->clusters[i].seen;
}

void spv_gl_occlude(struct spv_draw *draw, bool on)
{
    spv_gl_of(draw)->occlude = on;
}
