#include "pack_int.h"

#include "bytes.h"
#include "layout.h"
#include "vec.h"

#include <assert.h>
#include <stdlib.h>

enum spc_status spb_pack_shared_init(struct spb_pack_shared *shared,
                                     const struct spb_pack_options *options,
                                     const struct spb_space *space, struct spb_spool *spool,
                                     const struct spb_record_format *format, struct spc_error *err)
{
    const uint32_t groups = options->normal_clusters;
    *shared = (struct spb_pack_shared){.options = *options, .space = space, .spool = spool,
                                       .format = *format};
    shared->axis_of = malloc(65536);
    shared->scratches = pack_scratches_create(options->level);
    if (shared->axis_of == NULL || shared->scratches == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for the normal clusters");
    spc_axes_standard(groups, shared->axes);
    for (uint32_t g = 0; g < groups; g++) {
        for (int a = 0; a < 3; a++)
            shared->axis[g][a] = shared->axes[g][a] / 32767.0;
        vec_scale(shared->axis[g], 1 / vec_length(shared->axis[g]), shared->axis[g]);
    }
    for (uint32_t code = 0; code < 65536; code++)
        shared->axis_of[code] =
            (uint8_t)spc_axis_nearest((const int16_t(*)[3])shared->axes, groups, (uint16_t)code);
    return SPC_OK;
}

void spb_pack_shared_release(struct spb_pack_shared *shared)
{
    free(shared->axis_of);
    pack_scratches_free(shared->scratches);
    shared->axis_of = NULL;
    shared->scratches = NULL;
}

/* ---- the directory record ---------------------------------------------------------------------- */

static void fill_ranges(const struct pack *p, struct spc_cluster *c)
{
    c->e_self_min = spc_len_decode(p->range.e_self[0]);
    c->e_self_max = spc_len_decode(p->range.e_self[1]);
    c->e_parent_min = spc_len_decode(p->range.e_parent[0]);
    c->e_parent_max = spc_len_decode(p->range.e_parent[1]);
    c->radius_min = spc_len_decode(p->range.radius[0]);
    c->radius_max = spc_len_decode(p->range.radius[1]);
}

/* A child cluster's position relative to this one's, units; exact. */
static double origin_shift(const struct pack *p, const struct spc_cluster *child, int a)
{
    return times_exp2(child->origin[a] - p->out->record.origin[a], -p->shared->space->unit_exp);
}

static double point_distance(const float sphere[4], const double at[3])
{
    const double d[3] = {at[0] - (double)sphere[0], at[1] - (double)sphere[1],
                         at[2] - (double)sphere[2]};
    return vec_length(d);
}

static void center_sphere(const float box[6], float sphere[4])
{
    for (int a = 0; a < 3; a++)
        sphere[a] = (float)(((double)box[a] + (double)box[a + 3]) / 2);
    sphere[3] = 0;
}

static void fill_bounds(const struct pack *p, struct spc_cluster *c)
{
    memcpy(c->box, p->box, sizeof c->box);
    memcpy(c->sub_box, p->box, sizeof c->sub_box);
    for (uint32_t k = 0; k < c->child_count; k++) {
        const struct spc_cluster *child = &spb_spool_get(p->shared->spool, p->children[k])->record;
        for (int a = 0; a < 3; a++) {
            const double shift = origin_shift(p, child, a);
            c->sub_box[a] = fminf(c->sub_box[a], float_below((double)child->sub_box[a] + shift));
            c->sub_box[a + 3] =
                fmaxf(c->sub_box[a + 3], float_above((double)child->sub_box[a + 3] + shift));
        }
    }
    center_sphere(c->box, c->sphere);
    center_sphere(c->sub_box, c->sub_sphere);
    const double own[3] = {(double)c->sphere[0], (double)c->sphere[1], (double)c->sphere[2]};
    double radius = pack_leaves_reach(p, own);
    for (uint32_t i = 0; i < p->kind[SPC_BLOCK_INNER].count; i++)
        radius = larger_of(radius, vec_distance(p->inner[i].at, own) + p->inner[i].radius);
    c->sphere[3] = float_above(radius);
    radius = point_distance(c->sub_sphere, own) + (double)c->sphere[3];
    for (uint32_t k = 0; k < c->child_count; k++) {
        const struct spc_cluster *child = &spb_spool_get(p->shared->spool, p->children[k])->record;
        double at[3];
        for (int a = 0; a < 3; a++)
            at[a] = (double)child->sub_sphere[a] + origin_shift(p, child, a);
        radius = larger_of(radius, point_distance(c->sub_sphere, at) + (double)child->sub_sphere[3]);
    }
    c->sub_sphere[3] = float_above(radius);
}

static void fill_record(struct pack *p)
{
    struct spc_cluster *c = &p->out->record;
    c->inner_count = p->kind[SPC_BLOCK_INNER].count;
    c->leaf_count = p->kind[SPC_BLOCK_LEAF].count;
    c->block_count = p->block_count;
    c->child_count = p->owner_count;
    c->leaves_below = c->leaf_count;
    memcpy(c->origin, p->frame.origin, sizeof c->origin);
    fill_ranges(p, c);
    fill_bounds(p, c);
    c->cone[3] = float_below(p->cosine);
    for (uint32_t k = p->block_count; k-- > 0;) {   /* link ranges: this and all later blocks */
        float *link = &p->out->blocks[k].link_max;
        if (k + 1 < p->block_count)
            *link = fmaxf(*link, p->out->blocks[k + 1].link_max);
        c->link_max = *link;
    }
    c->sub_link_max = c->link_max;
    c->sub_radius_max = c->radius_max;
    for (uint32_t k = 0; k < c->child_count; k++) {
        const struct spc_cluster *child = &spb_spool_get(p->shared->spool, p->children[k])->record;
        c->leaves_below += child->leaves_below;
        c->sub_link_max = fmaxf(c->sub_link_max, child->sub_link_max);
        c->sub_radius_max = fmaxf(c->sub_radius_max, child->sub_radius_max);
    }
}

/* ---- closing ----------------------------------------------------------------------------------- */

struct memory {
    uint8_t *bytes;                 /* NULL: only counted */
    size_t used;
};

static void *part_of(struct memory *m, size_t count, size_t size)
{
    uint8_t *array = m->bytes ? m->bytes + m->used : NULL;
    m->used += (count * size + 15) / 16 * 16;
    return array;
}

/* All arrays of a cluster of node_max nodes, one after another. Returns their bytes. */
static size_t lay_out(struct pack *p, uint8_t *bytes)
{
    const size_t n = p->node_max;
    struct memory m = {bytes, 0};
    for (int k = 0; k < 2; k++) {
        struct pack_kind *s = &p->kind[k];
        s->normal = part_of(&m, n, sizeof *s->normal);
        s->cone = part_of(&m, n, sizeof *s->cone);
        s->rgba = part_of(&m, n, sizeof *s->rgba);
        s->families = part_of(&m, n, sizeof *s->families);
        s->list = part_of(&m, n, sizeof *s->list);
    }
    struct pack_leaves *l = &p->leaves;
    l->record = part_of(&m, n, sizeof *l->record);
    for (int a = 0; a < 3; a++)
        l->at[a] = part_of(&m, n, sizeof *l->at[a]);
    l->normal = part_of(&m, n, sizeof *l->normal);
    l->e_self = part_of(&m, n, sizeof *l->e_self);
    l->radius = part_of(&m, n, sizeof *l->radius);
    l->height = part_of(&m, n, sizeof *l->height);
    l->key = part_of(&m, n, sizeof *l->key);
    if (p->shared->options.flags & SPC_FLAG_COLORS)
        l->rgba = part_of(&m, n, sizeof *l->rgba);
    p->inner = part_of(&m, n, sizeof *p->inner);
    p->levels = part_of(&m, n < 65537 ? 65537 : n, sizeof *p->levels);
    p->scratch = part_of(&m, 2 * n + 2, sizeof *p->scratch);
    p->children = part_of(&m, n, sizeof *p->children);
    p->normals = part_of(&m, 2 * n, sizeof *p->normals);
    p->blocks = part_of(&m, 2 * n, sizeof *p->blocks);
    return m.used;
}

static bool pack_create(struct pack *p)
{
    struct pack dry = *p;
    p->memory = pack_scratch_take(p->shared->scratches);
    p->out = calloc(1, sizeof *p->out);
    void *arrays = p->memory ? pack_scratch_buffer(p->memory, PACK_ARRAYS, lay_out(&dry, NULL)) : NULL;
    if (arrays == NULL || p->out == NULL)
        return false;
    lay_out(p, arrays);
    p->out->inner_e_min = UINT16_MAX;
    return true;
}

static void pack_release(struct pack *p)
{
    if (p->memory != NULL)
        pack_scratch_give(p->shared->scratches, p->memory);
    spb_cluster_free(p->out);
}

static enum spc_status pack_all(struct pack *p, uint32_t *number, struct spc_error *err)
{
    pack_collect(p);
    pack_cone_axis(p->normal_sum, p->out->record.cone, p->axis);
    enum spc_status status = pack_quantise(p, err);
    if (status != SPC_OK)
        return status;
    pack_order(p);
    p->out->children = malloc((p->owner_count + 1) * sizeof *p->out->children);
    p->out->blocks = calloc(p->block_count, sizeof *p->out->blocks);
    p->out->stored_off = calloc(p->block_count, sizeof *p->out->stored_off);
    if (p->out->children == NULL || p->out->blocks == NULL || p->out->stored_off == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to pack a cluster");
    memcpy(p->out->children, p->children, p->owner_count * sizeof *p->children);
    for (uint32_t k = 0; k < p->block_count && status == SPC_OK; k++)
        status = pack_payload(p, k, err);
    if (status != SPC_OK)
        return status;
    fill_record(p);
    struct spb_cluster *out = p->out;
    p->out = NULL;
    return spb_spool_add(p->shared->spool, out, number, err);
}

static enum spc_status close_cluster(const struct spb_pack_tree *tree, uint32_t owner, bool root,
                                     uint32_t *number, uint16_t *owner_e, uint16_t *tops_e,
                                     struct spc_error *err)
{
    struct pack p = {.tree = tree, .shared = tree->shared, .cosine = 1,
                     .owner = root ? NULL : &tree->nodes[owner],
                     .node_max = tree->nodes[owner].pending + 1,
                     .range = {{UINT16_MAX, 0}, {UINT16_MAX, 0}, {UINT16_MAX, 0}}};
    const enum spc_status status = pack_create(&p)
        ? pack_all(&p, number, err)
        : spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to pack a cluster");
    *owner_e = p.owner_e;
    *tops_e = p.tops_e;
    pack_release(&p);
    return status;
}

enum spc_status spb_pack_close(const struct spb_pack_tree *tree, uint32_t owner,
                               struct spc_error *err)
{
    struct spb_node *n = &tree->nodes[owner];
    uint16_t owner_e = 0, tops_e = 0;
    uint32_t number = 0;
    const enum spc_status status =
        close_cluster(tree, owner, false, &number, &owner_e, &tops_e, err);
    if (status != SPC_OK)
        return status;
    n->owner = true;
    n->pending = 0;
    n->link = number;
    n->e_self = owner_e;
    n->e_below = tops_e;
    return SPC_OK;
}

enum spc_status spb_pack_close_root(const struct spb_pack_tree *tree, uint32_t *number,
                                    struct spc_error *err)
{
    uint16_t owner_e = 0, tops_e = 0;
    return close_cluster(tree, 0, true, number, &owner_e, &tops_e, err);
}
