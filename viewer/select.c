#include "select.h"

#include "bytes.h"

#include <math.h>
#include <stdlib.h>

/* Shaders work in float32: what they may find drawable, selection must not leave out. */
static const double LOW = 1 - 0x1p-18, HIGH = 1 + 0x1p-18;

struct select {
    const struct spc_reader *reader;
    const struct spc_header *header;
    const struct spv_view *view;
    struct spv_selection *out;
    double planes[5][3];            /* inward normals of planes through the eye */
    double per_unit;                /* units a file unit; 0: too many for a double */
    bool cull_back;
    uint32_t stack_count;
};

/* Not fmax: that is a call, for numbers that are none, of which there are none here. */
static inline double larger(double a, double b)
{
    return a > b ? a : b;
}

static inline double smaller(double a, double b)
{
    return a < b ? a : b;
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Side planes one pixel outside the picture, and the plane of the eye. */
static void make_planes(const struct spv_camera *c, double planes[5][3])
{
    const double x = (c->width / 2.0 + 1) / c->focal_px;
    const double y = (c->height / 2.0 + 1) / c->focal_px;
    for (int a = 0; a < 3; a++) {
        planes[0][a] = c->forward[a] * x + c->right[a];
        planes[1][a] = c->forward[a] * x - c->right[a];
        planes[2][a] = c->forward[a] * y + c->up[a];
        planes[3][a] = c->forward[a] * y - c->up[a];
        planes[4][a] = c->forward[a];
    }
}

/* The box grown by pad lies wholly outside one plane; *inside: of none does any of it lie outside. */
static bool outside(const struct select *s, const float box[6], const double eye[3], double pad, bool *inside)
{
    double low[3], high[3];
    *inside = true;
    for (int a = 0; a < 3; a++) {
        low[a] = (double)box[a] - pad - eye[a];
        high[a] = (double)box[a + 3] + pad - eye[a];
    }
    for (int p = 0; p < 5; p++) {
        const double *n = s->planes[p];
        double far = 0, near = 0, scale = 0;
        for (int a = 0; a < 3; a++) {
            const double x = n[a] * low[a], y = n[a] * high[a];
            far += larger(x, y);
            near += smaller(x, y);
            scale += larger(fabs(x), fabs(y));
        }
        if (far < -1e-6 * scale)
            return true;
        *inside &= near > 1e-6 * scale;
    }
    return false;
}

/*
 * Range of rho = |eye - c| - R over nodes whose balls lie in the box and the sphere. Inside, rho
 * may be negative: by as much as a radius.
 */
static void rho_range(const float box[6], const float sphere[4], const double eye[3], double *low,
                      double *high)
{
    double near2 = 0, far2 = 0, d[3];
    for (int a = 0; a < 3; a++) {
        const double below = (double)box[a] - eye[a], above = eye[a] - (double)box[a + 3];
        const double near = larger(0, larger(below, above));
        const double far_abs = larger(larger(-below, -above), near);
        near2 += near * near;
        far2 += far_abs * far_abs;
        d[a] = (double)sphere[a] - eye[a];
    }
    const double center = sqrt(dot(d, d));
    *low = larger(sqrt(near2), center - (double)sphere[3]);
    if (!(*low > 0))
        *low = -HUGE_VAL;
    *high = smaller(sqrt(far2), center + (double)sphere[3]);
}

void spv_eye_of_cluster(const struct spc_reader *reader, const struct spc_cluster *cluster,
                        const struct spv_camera *camera, double eye[3])
{
    for (int a = 0; a < 3; a++)
        eye[a] = ldexp(camera->eye[a] - cluster->origin[a], -spc_reader_header(reader)->unit_exp);
}

double spv_box_distance2(const struct spc_cluster *c, const double eye[3])
{
    double sum = 0;
    for (int a = 0; a < 3; a++) {
        const double out = larger(0, larger((double)c->box[a] - eye[a], eye[a] - (double)c->box[a + 3]));
        sum += out * out;
    }
    return sum;
}

double spv_cluster_distance2(const struct spc_reader *reader, const struct spv_camera *camera, uint32_t cluster,
                             int unit_exp)
{
    struct spc_cluster c;
    double eye[3];
    spc_reader_cluster(reader, cluster, &c);
    spv_eye_of_cluster(reader, &c, camera, eye);
    return ldexp(spv_box_distance2(&c, eye), 2 * (spc_reader_header(reader)->unit_exp - unit_exp));
}

bool spv_culls_back(const struct spc_reader *reader, const struct spv_view *view)
{
    const struct spc_header *h = spc_reader_header(reader);
    bool inside = true;
    for (int a = 0; a < 3; a++)
        inside &= view->camera.eye[a] >= h->box_min[a] && view->camera.eye[a] <= h->box_max[a];
    return view->cull && (h->flags & SPC_FLAG_CULL_BACK) && !inside;
}

bool spv_all_behind(const double eye[3], const float sphere[4], const double axis[3],
                    double cosine)
{
    double to_eye[3];
    for (int a = 0; a < 3; a++)
        to_eye[a] = eye[a] - (double)sphere[a];
    const double distance = sqrt(dot(to_eye, to_eye));
    if (cosine <= -1 || distance <= (double)sphere[3])
        return false;
    /* n . (eye - p) is largest for the normal nearest to the eye and the point nearest to it. */
    const double c = larger(-1, smaller(1, dot(to_eye, axis) / distance));
    if (c >= cosine)
        return false;               /* the eye is inside the cone */
    const double nearest = c * cosine + sqrt(1 - c * c) * sqrt(1 - smaller(1, cosine * cosine));
    return distance * nearest + (double)sphere[3] < -1e-6 * distance;
}

/* Could a node of the subtree pass its upper test? */
static bool subtree_in_range(const struct spv_view *v, const struct spc_cluster *c, double low)
{
    if (v->mode == SPV_TRIANGLES)
        return true;
    return (double)c->e_parent_max + v->eps * (double)c->sub_link_max >= v->eps * low * LOW;
}

static bool block_in_range(const struct select *s, const struct spc_block *b, double low,
                           double high, bool *end)
{
    const struct spv_view *v = s->view;
    const bool leaf = b->kind == SPC_BLOCK_LEAF;
    if (v->mode == SPV_TRIANGLES)
        return leaf && (s->header->flags & SPC_FLAG_TRIANGLES);
    if ((double)b->e_parent_max + v->eps * (double)b->link_max < v->eps * low * LOW) {
        *end = true;                /* and so are all later ones: the prefix ends */
        return false;
    }
    /* Leaves always have something to draw: below t their triangle, or, without, the point. */
    return leaf || (double)b->e_self_min < v->eps * high * HIGH;
}

static enum spc_status choose(struct select *s, uint32_t index, const struct spc_block *b,
                              float error, struct spc_error *err)
{
    struct spv_selection *out = s->out;
    if (out->block_count == out->block_max) {
        const uint32_t grown = out->block_max ? 2 * out->block_max : 256;
        struct spv_chosen *blocks = realloc(out->blocks, grown * sizeof *blocks);
        if (blocks == NULL)
            return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to select blocks");
        out->blocks = blocks;
        out->block_max = grown;
    }
    out->blocks[out->block_count++] = (struct spv_chosen){index, error};
    out->nodes += b->node_count;
    out->bytes += spc_block_chunk_bytes(b);
    return SPC_OK;
}

static enum spc_status choose_blocks(struct select *s, const struct spc_cluster *c, double low, double high,
                                     struct spc_error *err)
{
    bool end = false;
    const uint32_t before = s->out->block_count;
    for (uint32_t k = 0; k < c->block_count && !end; k++) {
        struct spc_block b;
        spc_reader_block(s->reader, c->block_first + k, &b);
        if (!block_in_range(s, &b, low, high, &end))
            continue;
        const double near = larger(low, 0x1p-60);
        const double px = (double)b.e_parent_max / near * s->view->camera.focal_px;
        const enum spc_status status =
            choose(s, c->block_first + k, &b, (float)smaller(px, 1e30), err);
        if (status != SPC_OK)
            return status;
    }
    if (s->out->block_count > before)
        s->out->clusters_drawn++;
    else
        s->out->culled_range++;
    return SPC_OK;
}

static enum spc_status push_children(struct select *s, const struct spc_cluster *c, bool inside,
                                     struct spc_error *err)
{
    struct spv_selection *out = s->out;
    if (s->stack_count + c->child_count > out->stack_max) {
        const uint32_t grown = 2 * (s->stack_count + c->child_count) + 64;
        struct spv_visit *stack = realloc(out->stack, grown * sizeof *stack);
        if (stack == NULL)
            return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to select clusters");
        out->stack = stack;
        out->stack_max = grown;
    }
    for (uint32_t k = c->child_count; k-- > 0;)
        out->stack[s->stack_count++] = (struct spv_visit){c->child_first + k, inside};
    return SPC_OK;
}

/* A cylinder of radius R and half height up to R sticks out of its ball by 0.4143 R. */
static double rim(float radius)
{
    return 0.4143 * (double)radius;
}

static void place_eye(const struct select *s, const struct spc_cluster *c, double eye[3])
{
    if (!(s->per_unit > 0))
        spv_eye_of_cluster(s->reader, c, &s->view->camera, eye);
    else
        for (int a = 0; a < 3; a++)
            eye[a] = (s->view->camera.eye[a] - c->origin[a]) * s->per_unit;
}

/* What a cluster without children has below itself is itself: its second tests would be its first. */
static enum spc_status visit(struct select *s, struct spv_visit at, struct spc_error *err)
{
    struct spc_cluster c;
    double eye[3], low, high;
    bool inside = at.inside || !s->view->cull;
    spc_reader_cluster(s->reader, at.cluster, &c);
    place_eye(s, &c, eye);
    rho_range(c.sub_box, c.sub_sphere, eye, &low, &high);
    if (!subtree_in_range(s->view, &c, low)) {
        s->out->culled_range++;
        return SPC_OK;
    }
    if (!inside && outside(s, c.sub_box, eye, rim(c.sub_radius_max), &inside)) {
        s->out->culled_frustum++;
        return SPC_OK;
    }
    const double axis[3] = {(double)c.cone[0], (double)c.cone[1], (double)c.cone[2]};
    if (s->cull_back &&
        spv_all_behind(eye, c.sub_sphere, axis, (double)c.cone[3] - 1e-6)) {
        s->out->culled_backface++;
        return SPC_OK;
    }
    if (c.child_count == 0)
        return choose_blocks(s, &c, low, high, err);
    enum spc_status status = push_children(s, &c, inside, err);
    if (status != SPC_OK)
        return status;
    if (!inside && outside(s, c.box, eye, rim(c.radius_max), &inside)) {
        s->out->culled_frustum++;
        return SPC_OK;
    }
    rho_range(c.box, c.sphere, eye, &low, &high);
    return choose_blocks(s, &c, low, high, err);
}

enum spc_status spv_select(const struct spc_reader *reader, const struct spv_view *view,
                           struct spv_selection *out, struct spc_error *err)
{
    struct select s = {.reader = reader, .header = spc_reader_header(reader), .view = view,
                       .out = out};
    const struct spc_cluster root = {.child_first = 0, .child_count = 1};
    out->block_count = out->clusters_drawn = 0;
    out->culled_frustum = out->culled_backface = out->culled_range = 0;
    out->nodes = out->bytes = 0;
    out->clusters_total = s.header->cluster_count;
    s.cull_back = spv_culls_back(reader, view);
    make_planes(&view->camera, s.planes);
    const int exponent = -s.header->unit_exp;       /* a power of two that is normal: a product is exact */
    s.per_unit = exponent > -1022 && exponent < 1023 ? ldexp(1, exponent) : 0;
    enum spc_status status = push_children(&s, &root, false, err);
    while (status == SPC_OK && s.stack_count > 0)
        status = visit(&s, out->stack[--s.stack_count], err);
    return status;
}

bool spv_group_behind(const struct spc_reader *reader, const struct spc_cluster *c, const double eye[3], uint32_t g,
                      const uint8_t *groups)
{
    const double cosine = (int16_t)load_u16(groups + 4 * (size_t)g + 2) / 32767.0;
    double axis[3];
    spc_reader_axis(reader, g, axis);
    return spv_all_behind(eye, c->sphere, axis, cosine);
}

void spv_visible_ranges(const struct spc_reader *reader, const struct spv_view *view,
                        const struct spc_block *b, const struct spc_cluster *c,
                        const double eye[3], const uint8_t *groups, struct spv_ranges *out)
{
    int at = 0;
    out->count = 0;
    if (!spv_culls_back(reader, view)) {
        out->count = 1;
        out->first[0] = 0;
        out->nodes[0] = (int)b->node_count;
        return;
    }
    for (uint32_t g = 0; g < spc_reader_header(reader)->normal_clusters; g++) {
        const int nodes = load_u16(groups + 4 * g);
        const uint32_t last = out->count - 1;
        if (nodes > 0 && !spv_group_behind(reader, c, eye, g, groups)) {
            if (out->count > 0 && out->first[last] + out->nodes[last] == at)
                out->nodes[last] += nodes;
            else {
                out->first[out->count] = at;
                out->nodes[out->count++] = nodes;
            }
        }
        at += nodes;
    }
}

void spv_selection_release(struct spv_selection *selection)
{
    free(selection->blocks);
    free(selection->stack);
    *selection = (struct spv_selection){0};
}
