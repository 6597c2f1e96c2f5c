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
    if (shared->axis_of == NULL)
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
    shared->axis_of = NULL;
}

/* ---- which nodes ------------------------------------------------------------------------------- */

static void add_node(struct pack *p, uint32_t node, uint32_t parent)
{
    const struct spb_node *n = &p->tree->nodes[node];
    p->nodes[p->node_count] =
        (struct pack_node){.node = node, .parent = parent, .leaf = n->child_count == 0};
    if (n->child_count != 0)
        p->inner_count++;
    else
        p->nodes[p->node_count].leaf_number = p->node_count - p->inner_count;
    p->node_count++;
}

/* Triangles of the leaves, on the vertex lattice. */
static enum spc_status load_leaves(struct pack *p, struct spc_error *err)
{
    const struct spb_pack_shared *shared = p->shared;
    p->leaves = malloc((p->node_count - p->inner_count + 1) * sizeof *p->leaves);
    if (p->leaves == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to pack a cluster");
    for (uint32_t i = 0; i < p->node_count; i++) {
        const struct spb_node *n = &p->tree->nodes[p->nodes[i].node];
        struct pack_leaf *leaf = &p->leaves[p->nodes[i].leaf_number];
        struct spb_face face;
        if (!p->nodes[i].leaf)
            continue;
        spb_record_load(&shared->format, shared->space,
                        p->tree->records + (size_t)n->link * shared->format.bytes, &face);
        for (int k = 0; k < 3; k++)
            for (int a = 0; a < 3; a++)
                leaf->corner[k][a] = (int64_t)spb_space_snap(shared->space, face.corner[k][a]) +
                                     spb_space_origin_number(shared->space, a);
        memset(leaf->rgba, 255, sizeof leaf->rgba);
        if (shared->options.flags & SPC_FLAG_COLORS)
            memcpy(leaf->rgba, face.rgba, sizeof leaf->rgba);
    }
    return SPC_OK;
}

struct spc_frame pack_frame(const struct pack *p)
{
    const struct spb_space *space = p->shared->space;
    struct spc_frame frame = {
        .flags = p->shared->options.flags, .normal_clusters = p->shared->options.normal_clusters,
        .unit_exp = space->unit_exp, .vertex_exp = space->vertex_exp,
    };
    for (int a = 0; a < 3; a++)
        frame.origin[a] = space->origin[a] + times_exp2(p->origin[a], space->unit_exp);
    return frame;
}

/* Breadth first from the tops; below an owner everything is in other clusters already. */
static void collect(struct pack *p, uint32_t owner)
{
    if (p->owner == NULL)
        add_node(p, 0, PACK_OWNER);
    else
        for (uint32_t k = 0; k < p->owner->child_count; k++)
            add_node(p, p->tree->nodes[owner].child_first + k, PACK_OWNER);
    for (uint32_t i = 0; i < p->node_count; i++) {
        const struct spb_node *n = &p->tree->nodes[p->nodes[i].node];
        if (n->child_count == 0 || n->owner)
            continue;
        p->nodes[i].child_first = p->node_count;
        for (uint32_t k = 0; k < n->child_count; k++)
            add_node(p, n->child_first + k, i);
    }
}

/* ---- the directory record ---------------------------------------------------------------------- */

static void fill_ranges(const struct pack *p, struct spc_cluster *c)
{
    p->out->inner_e_min = UINT16_MAX;
    uint16_t self[2] = {UINT16_MAX, 0}, parent[2] = {UINT16_MAX, 0}, radius[2] = {UINT16_MAX, 0};
    for (uint32_t i = 0; i < p->node_count; i++) {
        const struct pack_node *q = &p->nodes[i];
        const uint16_t codes[3] = {q->e_self, q->e_parent, q->radius_code};
        uint16_t *ranges[3] = {self, parent, radius};
        for (int r = 0; r < 3; r++) {
            ranges[r][0] = codes[r] < ranges[r][0] ? codes[r] : ranges[r][0];
            ranges[r][1] = codes[r] > ranges[r][1] ? codes[r] : ranges[r][1];
        }
        if (!q->leaf && q->e_self < p->out->inner_e_min)
            p->out->inner_e_min = q->e_self;
        if (!q->leaf && q->e_self > p->out->inner_e_max)
            p->out->inner_e_max = q->e_self;
    }
    c->e_self_min = spc_len_decode(self[0]);
    c->e_self_max = spc_len_decode(self[1]);
    c->e_parent_min = spc_len_decode(parent[0]);
    c->e_parent_max = spc_len_decode(parent[1]);
    c->radius_min = spc_len_decode(radius[0]);
    c->radius_max = spc_len_decode(radius[1]);
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
    double radius = 0;
    for (uint32_t i = 0; i < p->node_count; i++) {
        double at[3];
        vec_sub(p->nodes[i].center, p->origin, at);
        radius = larger_of(radius, point_distance(c->sphere, at) + p->nodes[i].radius);
    }
    c->sphere[3] = float_above(radius);
    const double own[3] = {(double)c->sphere[0], (double)c->sphere[1], (double)c->sphere[2]};
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

/* A unit float vector near v; cosines against it are measured, so its rounding does not matter. */
static void store_axis(const double v[3], float cone[4], double axis[3])
{
    const double length = vec_length(v);
    for (int a = 0; a < 3; a++)
        cone[a] = length > 0 ? (float)(v[a] / length) : (float)(a == 2);
    for (int a = 0; a < 3; a++)
        axis[a] = (double)cone[a];
    vec_scale(axis, 1 / vec_length(axis), axis);
}

/* A node's cone holds all that lies below it, in other clusters too: so does the cluster's. */
static void fill_cone(const struct pack *p, struct spc_cluster *c)
{
    double sum[3] = {0, 0, 0}, axis[3], cosine = 1;
    for (uint32_t i = 0; i < p->node_count; i++) {
        double n[3];
        spc_normal_decode(p->tree->nodes[p->nodes[i].node].normal, n);
        for (int a = 0; a < 3; a++)
            sum[a] += n[a];
    }
    store_axis(sum, c->cone, axis);
    for (uint32_t i = 0; i < p->node_count; i++)
        cosine = smaller_of(cosine, pack_cone_about(axis, &p->tree->nodes[p->nodes[i].node]));
    c->cone[3] = float_below(cosine);
}

static void fill_tops(const struct pack *p, struct spc_cluster *c)
{
    const uint32_t tops = p->owner ? p->owner->child_count : 1;
    for (uint32_t pass = 0; pass < 2; pass++)
        for (uint32_t i = 0; i < tops; i++) {
            if (p->nodes[i].leaf == (pass == 0))
                continue;
            c->tops_are_leaf[c->top_count] = pass == 1;
            memcpy(c->tops[c->top_count++].rgba, p->tree->nodes[p->nodes[i].node].rgba, 4);
        }
}

void pack_copy_top(struct pack *p, uint32_t node, const struct spc_block *b,
                   const uint8_t *record)
{
    struct spc_cluster *c = &p->out->record;
    const uint32_t tops = p->owner ? p->owner->child_count : 1;
    uint32_t t = 0;                 /* its place: inner tops first, each kind in child order */
    if (node >= tops)
        return;
    for (uint32_t k = 0; k < tops; k++)
        t += p->nodes[k].leaf == p->nodes[node].leaf ? k < node : !p->nodes[k].leaf;
    memcpy(c->tops[t].record, record, ND_SIZE);
    c->tops[t].step_exp = (int16_t)b->step_exp;
    c->tops[t].link_base = (int16_t)b->link_base;
}

static void fill_record(struct pack *p)
{
    struct spc_cluster *c = &p->out->record;
    c->inner_count = p->inner_count;
    c->leaf_count = p->node_count - p->inner_count;
    c->block_count = p->block_count;
    c->child_count = p->owner_count;
    c->leaves_below = c->leaf_count;
    const struct spc_frame frame = pack_frame(p);
    memcpy(c->origin, frame.origin, sizeof c->origin);
    fill_ranges(p, c);
    fill_bounds(p, c);
    fill_cone(p, c);
    fill_tops(p, c);
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

static void pack_release(struct pack *p)
{
    for (int k = 0; k < 2; k++) {
        free(p->sequence[k].nodes);
        free(p->sequence[k].families);
        free(p->sequence[k].list);
    }
    free(p->nodes);
    free(p->leaves);
    free(p->blocks);
    if (p->out != NULL && p->out->children != p->children)
        free(p->children);
    spb_cluster_free(p->out);
}

static enum spc_status pack_all(struct pack *p, uint32_t *number, struct spc_error *err)
{
    pack_quantise(p);
    enum spc_status status = pack_order(p, err);
    if (status != SPC_OK)
        return status;
    p->out->children = p->children;
    p->out->blocks = calloc(p->block_count, sizeof *p->out->blocks);
    p->out->stored_off = calloc(p->block_count, sizeof *p->out->stored_off);
    if (p->out->blocks == NULL || p->out->stored_off == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to pack a cluster");
    for (uint32_t k = 0; k < p->block_count && status == SPC_OK; k++)
        status = pack_payload(p, k, err);
    if (status != SPC_OK)
        return status;
    fill_record(p);
    struct spb_cluster *out = p->out;
    p->out = NULL;
    p->children = NULL;
    return spb_spool_add(p->shared->spool, out, number, err);
}

static enum spc_status close_cluster(const struct spb_pack_tree *tree, uint32_t owner, bool root,
                                     uint32_t *number, uint16_t *owner_e, uint16_t *tops_e,
                                     struct spc_error *err)
{
    struct pack p = {.tree = tree, .shared = tree->shared,
                     .owner = root ? NULL : &tree->nodes[owner]};
    const uint32_t max = tree->nodes[owner].pending + 1;
    enum spc_status status = SPC_OK;
    p.nodes = malloc(max * sizeof *p.nodes);
    p.out = calloc(1, sizeof *p.out);
    if (p.nodes == NULL || p.out == NULL)
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to pack a cluster");
    if (status == SPC_OK) {
        collect(&p, owner);
        assert(p.node_count == tree->nodes[owner].pending + root);
        status = load_leaves(&p, err);
    }
    if (status == SPC_OK)
        status = pack_all(&p, number, err);
    if (status == SPC_OK) {
        *owner_e = p.owner_e;
        *tops_e = 0;
        for (uint32_t k = 0; p.owner != NULL && k < p.owner->child_count; k++)
            *tops_e = p.nodes[k].e_self > *tops_e ? p.nodes[k].e_self : *tops_e;
    }
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
