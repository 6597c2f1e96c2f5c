/*
 * quantise.c - decoded values of a cluster's nodes, and the errors and links that hold for them.
 *
 * Inner nodes lie on their lattice already (combine.c) unless the cluster's 16 bits do not reach:
 * then the centre moves once more, R and H grow by what it moved, and the error by twice that, so
 * every promise holds for what a viewer decodes. Leaves are the format's disk of their triangle.
 * Errors become final here, bottom-up, children before parents, in codes: e_self of a node is
 * never below a child's.
 *
 * A cluster's owner lies in the parent cluster, which is quantised later. The tops need the
 * owner's error and position now, so they are declared: the owner may move by at most owner_shift,
 * and its error counts on all of it. No lattice step exceeds max(spb_center_step, 2^-15, finest).
 */
#include "pack_int.h"

#include "bytes.h"
#include "layout.h"
#include "vec.h"

#include <assert.h>
#include <string.h>

enum {
    STEP_COARSEST = -15,            /* of a 16-bit lattice over the whole scan */
    DIAGONAL_MAX = 8,               /* of any cluster's box: centres in [0, 1], radii below 2 */
    HEIGHT_UNUSED = 15,             /* low bits of an inner node's height code, all ones */
};
static const double OUTWARD = 1 + 0x1p-44;
static const double LINK_OUTWARD = 1 + 0x1p-40;     /* the format's: spc_link_record */
static const double HALF_DIAGONAL = 0.8661;         /* above sqrt(3) / 2 */

static int exponent_of(double v)    /* v < 2^e */
{
    int e = 0;
    frexp(v, &e);
    return e;
}

static int finest_step(const struct pack *p)
{
    return spb_space_finest(p->shared->space);
}

struct lattice {
    int finest, coarsest;           /* steps: 16 bits reach over the cluster; divides the origin */
};

static struct lattice choose_lattice(struct pack *p)
{
    double side = 0;
    for (int a = 0; a < 3; a++)
        side = larger_of(side, p->max[a] - p->min[a]);
    /* One huge disk must not push the origin so far off that small ones lose their bits. */
    int cap = side > 0 ? exponent_of(side) - 3 : 0;
    cap = cap < -30 ? -30 : cap;
    struct lattice l = {finest_step(p), p->coarsest_wanted < cap ? p->coarsest_wanted : cap};
    if (l.coarsest < l.finest)
        l.coarsest = l.finest;
    for (;;) {
        double reach = 0;
        for (int a = 0; a < 3; a++) {
            p->origin[a] = times_exp2(floor(times_exp2(p->min[a], -l.coarsest)), l.coarsest);
            reach = larger_of(reach, p->max[a] - p->origin[a] + times_exp2(1, l.coarsest - 1));
        }
        const int step = exponent_of(reach / 65535);
        l.finest = step > l.finest ? step : l.finest;
        if (l.finest <= l.coarsest)
            return l;
        l.coarsest = l.finest;
    }
}

static void set_frame(struct pack *p)
{
    const struct spb_space *space = p->shared->space;
    p->frame = (struct spc_frame){
        .flags = p->shared->options.flags, .normal_clusters = p->shared->options.normal_clusters,
        .unit_exp = space->unit_exp, .vertex_exp = space->vertex_exp,
    };
    for (int a = 0; a < 3; a++)
        p->frame.origin[a] = space->origin[a] + times_exp2(p->origin[a], space->unit_exp);
}

static double far_corner(const struct spb_node *n, const double c[3], double out[3])
{
    for (int a = 0; a < 3; a++)
        out[a] = larger_of((double)n->box[a + 3] - c[a], c[a] - (double)n->box[a]);
    return vec_length(out);
}

/* Decoded centre, R and H of an inner node. Returns how far the centre moved. */
static double quantise_pill(const struct pack *p, struct pack_inner *q, const struct spb_node *n,
                            const struct lattice *l)
{
    double center[3], shift[3], normal[3], far[3];
    q->step_exp = q->step_exp > l->coarsest ? l->coarsest : q->step_exp;
    q->step_exp = q->step_exp < l->finest ? l->finest : q->step_exp;
    for (int a = 0; a < 3; a++)
        center[a] = times_exp2(floor(times_exp2(n->center[a], -q->step_exp) + 0.5), q->step_exp);
    vec_sub(center, p->origin, q->at);
    vec_sub(center, n->center, shift);
    const double moved = vec_length(shift);
    const double radius = smaller_of(n->radius + moved, far_corner(n, center, far) * OUTWARD);
    q->radius_code = spb_length_code(radius);
    q->radius = (double)spc_len_decode(q->radius_code);
    spc_normal_decode(n->normal, normal);
    const double slab = fabs(normal[0]) * far[0] + fabs(normal[1]) * far[1] +
                        fabs(normal[2]) * far[2];
    double height = smaller_of(n->height + fabs(vec_dot(normal, shift)), slab);
    height = smaller_of(height * OUTWARD + 0x1p-48 * q->radius, q->radius);
    int code = q->radius > 0 ? (int)(height / q->radius * 256) - 2 : 0;
    code = code > 0 ? code : 0;
    while (code < 255 && q->radius * (code + 1) / 256 < height)
        code++;
    q->height_code = (uint8_t)(code | HEIGHT_UNUSED);
    q->height = q->radius * (q->height_code + 1) / 256;
    return moved * OUTWARD;
}

static uint16_t larger(uint16_t a, uint16_t b)
{
    return a > b ? a : b;
}

/*
 * How large a disk may be is not only a matter of where it is: one over many normals or colours is wrong
 * all over its area. As much again of the radius as they deviate, from 0.7 to 1.2 of it.
 */
static double appearance(const struct spb_node *n, double radius)
{
    return radius * smaller_of(1.2, sqrt(8 * (double)n->spread + 0.5));
}

/* e_self: bounds both distances between disk and triangles (see bound.c), and never less for looks. */
static uint16_t own_error(const struct pack *p, const struct spb_node *n, double radius,
                          double height, double moved)
{
    if (p->shared->options.flags & SPC_FLAG_ERROR_PAPER)
        return spb_length_code(n->reach);
    const double reach = smaller_of(n->reach + moved + larger_of(0, radius - n->radius), 2 * radius);
    const double looks = appearance(n, radius);
    return spb_length_code(larger_of(looks, larger_of(reach, height)) * OUTWARD);
}

/* Largest e_self of a family, and at least e. */
static uint16_t family_error(const struct pack *p, enum spc_block_kind kind, uint32_t family, uint16_t e)
{
    if (family == PACK_NONE)
        return e;
    const struct pack_family *f = &p->kind[kind].families[family];
    for (uint32_t i = f->first; i < f->first + f->count; i++)
        e = larger(e, kind == SPC_BLOCK_LEAF ? p->leaves.e_self[i] : p->inner[i].e_self);
    return e;
}

/* Of a node's children: with the bits of an inner node's code. */
static uint16_t error_below(const struct pack *p, const struct pack_inner *q, const struct spb_node *n)
{
    uint16_t e = n->owner ? n->e_below : SPC_LEN_ZERO;
    for (int kind = 0; kind < 2; kind++)
        e = family_error(p, (enum spc_block_kind)kind, q->children[kind], e);
    return spb_length_code((double)spc_len_decode(e));
}

static void quantise_inner(struct pack *p, struct pack_inner *q, const struct lattice *l)
{
    const bool paper = (p->shared->options.flags & SPC_FLAG_ERROR_PAPER) != 0;
    const struct spb_node *n = &p->tree->nodes[q->node];
    const double moved = quantise_pill(p, q, n, l);
    q->e_self = n->owner ? n->e_self
                         : larger(own_error(p, n, q->radius, q->height, moved), error_below(p, q, n));
    assert(!n->owner || paper || (double)spc_len_decode(n->e_self) >= q->height);
    (void)paper;
}

/* Children before parents. Pills lie far apart in the tree: they are asked for some nodes ahead. */
static void quantise_pills(struct pack *p, const struct lattice *l)
{
    const uint32_t ahead = 16;
    for (uint32_t i = p->kind[SPC_BLOCK_INNER].count; i-- > 0;) {
        const struct spb_node *far = &p->tree->nodes[p->inner[i < ahead ? 0 : i - ahead].node];
        __builtin_prefetch(far);
        __builtin_prefetch((const uint8_t *)(far + 1) - 1);
        quantise_inner(p, &p->inner[i], l);
    }
}

/* Family of the tops of a kind, or PACK_NONE: the first. */
static uint32_t tops_of(const struct pack *p, int kind)
{
    const struct pack_kind *s = &p->kind[kind];
    return s->family_count > 0 && s->families[0].parent == PACK_OWNER ? 0 : PACK_NONE;
}

static void declare_owner(struct pack *p)
{
    const struct spb_node *n = p->owner;
    if (n == NULL) {
        p->owner_e = SPC_LEN_ROOT;
        return;
    }
    const int step = finest_step(p) > STEP_COARSEST ? finest_step(p) : STEP_COARSEST;
    p->owner_shift = spb_center_step(n->radius) >= step ? 0 : times_exp2(HALF_DIAGONAL, step);
    p->owner_radius = (double)spc_len_decode(spb_length_code(n->radius + p->owner_shift));
    const double height = smaller_of(p->owner_radius,
                               (n->height + p->owner_shift + p->owner_radius / 16) * OUTWARD);
    p->tops_e = 0;
    for (int kind = 0; kind < 2; kind++)
        p->tops_e = family_error(p, (enum spc_block_kind)kind, tops_of(p, kind), p->tops_e);
    p->owner_e = larger(own_error(p, n, p->owner_radius, height, p->owner_shift),
                        spb_length_code((double)spc_len_decode(p->tops_e)));
}

static void measure_box(struct pack *p)
{
    double square = 0;
    for (int a = 0; a < 3; a++) {
        double min = p->leaves.min[a], max = p->leaves.max[a];
        for (uint32_t i = 0; i < p->kind[SPC_BLOCK_INNER].count; i++) {
            min = smaller_of(min, p->inner[i].at[a] - p->inner[i].radius);
            max = larger_of(max, p->inner[i].at[a] + p->inner[i].radius);
        }
        p->box[a] = float_below(min);
        p->box[a + 3] = float_above(max);
        const double side = (double)p->box[a + 3] - (double)p->box[a];
        square += side * side;
    }
    p->diagonal = (double)float_above(sqrt(square));
    assert(p->diagonal <= DIAGONAL_MAX);
}

/* ---- links ------------------------------------------------------------------------------------- */

struct above {                      /* what links of a family lead to */
    double at[3];
    double shift, radius, slack;
};

/* False: the root, without a link. */
static bool look_above(const struct pack *p, uint32_t parent, struct above *out)
{
    if (parent != PACK_OWNER) {
        const struct pack_inner *q = &p->inner[parent];
        *out = (struct above){{q->at[0], q->at[1], q->at[2]}, 0, q->radius,
                              (p->diagonal + p->diagonal) * 0x1p-21};
        return true;
    }
    if (p->owner == NULL)
        return false;
    vec_sub(p->owner->center, p->origin, out->at);
    out->shift = p->owner_shift;
    out->radius = p->owner_radius;
    out->slack = (p->diagonal + DIAGONAL_MAX) * 0x1p-21;
    return true;
}

/* L of I4: distance to the parent's centre, its radius beyond the node's, and float32's share. */
static double link_of(const struct above *above, const double at[3], double radius)
{
    const double distance = vec_distance(at, above->at) + above->shift;
    return (distance + larger_of(0, above->radius - radius) + above->slack) * LINK_OUTWARD;
}

static uint16_t parent_error(const struct pack *p, uint32_t parent)
{
    return parent == PACK_OWNER ? p->owner_e : p->inner[parent].e_self;
}

static void link_inner(struct pack *p)
{
    struct pack_kind *s = &p->kind[SPC_BLOCK_INNER];
    for (uint32_t f = 0; f < s->family_count; f++) {
        struct pack_family *family = &s->families[f];
        struct above above;
        const bool linked = look_above(p, family->parent, &above);
        family->e_parent = parent_error(p, family->parent);
        for (uint32_t i = family->first; i < family->first + family->count; i++)
            p->inner[i].link = linked ? link_of(&above, p->inner[i].at, p->inner[i].radius) : 0;
    }
}

static void link_leaves(struct pack *p)
{
    struct pack_kind *s = &p->kind[SPC_BLOCK_LEAF];
    const struct pack_leaves *l = &p->leaves;
    const double step = times_exp2(1, l->step_exp);
    for (uint32_t f = 0; f < s->family_count; f++) {
        struct pack_family *family = &s->families[f];
        struct above above;
        const bool linked = look_above(p, family->parent, &above);
        family->e_parent = parent_error(p, family->parent);
        family->link = 0;
        for (uint32_t i = family->first; linked && i < family->first + family->count; i++) {
            const double at[3] = {l->at[0][i] * step, l->at[1][i] * step, l->at[2][i] * step};
            const double link = link_of(&above, at, (double)spc_len_decode(l->radius[i]));
            family->link = larger_of(family->link, link);
        }
    }
}

enum spc_status pack_quantise(struct pack *p, struct spc_error *err)
{
    const struct lattice l = choose_lattice(p);
    set_frame(p);
    const enum spc_status status = pack_leaves(p, l.finest, err);
    if (status != SPC_OK)
        return status;
    if (tops_of(p, SPC_BLOCK_INNER) == PACK_NONE)
        p->kind[SPC_BLOCK_LEAF].families[0].group = p->shared->axis_of[p->leaves.normal[0]];
    quantise_pills(p, &l);
    declare_owner(p);
    measure_box(p);
    link_inner(p);
    link_leaves(p);
    return SPC_OK;
}
