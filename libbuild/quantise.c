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

/* Where centres may lie: an inner node's does not move far, a leaf's lies in its triangle's box. */
static void reach_of(const struct spb_node *n, double min[3], double max[3])
{
    for (int a = 0; a < 3; a++) {
        const bool leaf = n->child_count == 0;
        min[a] = smaller_of(min[a], leaf ? (double)n->box[a] : n->center[a]);
        max[a] = larger_of(max[a], leaf ? (double)n->box[a + 3] : n->center[a]);
    }
}

static struct lattice choose_lattice(struct pack *p)
{
    double min[3], max[3], side = 0;
    int wanted = -1000;
    for (int a = 0; a < 3; a++) {
        min[a] = HUGE_VAL;
        max[a] = -HUGE_VAL;
    }
    for (uint32_t i = 0; i < p->node_count; i++) {
        const struct spb_node *n = &p->tree->nodes[p->nodes[i].node];
        const int step = n->child_count > 0 ? spb_center_step(n->radius) : wanted;
        wanted = step > wanted ? step : wanted;
        reach_of(n, min, max);
    }
    for (int a = 0; a < 3; a++)
        side = larger_of(side, max[a] - min[a]);
    /* One huge disk must not push the origin so far off that small ones lose their bits. */
    int cap = side > 0 ? exponent_of(side) - 3 : 0;
    cap = cap < -30 ? -30 : cap;
    struct lattice l = {finest_step(p), wanted < cap ? wanted : cap};
    if (l.coarsest < l.finest)
        l.coarsest = l.finest;
    for (;;) {
        double reach = 0;
        for (int a = 0; a < 3; a++) {
            p->origin[a] = times_exp2(floor(times_exp2(min[a], -l.coarsest)), l.coarsest);
            reach = larger_of(reach, max[a] - p->origin[a] + times_exp2(1, l.coarsest - 1));
        }
        const int step = exponent_of(reach / 65535);
        l.finest = step > l.finest ? step : l.finest;
        if (l.finest <= l.coarsest)
            return l;
        l.coarsest = l.finest;
    }
}

static double far_corner(const struct spb_node *n, const double c[3], double out[3])
{
    for (int a = 0; a < 3; a++)
        out[a] = larger_of((double)n->box[a + 3] - c[a], c[a] - (double)n->box[a]);
    return vec_length(out);
}

/* Decoded centre, R and H of an inner node. Returns how far the centre moved. */
static double quantise_pill(struct pack_node *q, const struct spb_node *n, const struct lattice *l)
{
    double shift[3], normal[3], far[3];
    q->step_exp = spb_center_step(n->radius);
    q->step_exp = q->step_exp > l->coarsest ? l->coarsest : q->step_exp;
    q->step_exp = q->step_exp < l->finest ? l->finest : q->step_exp;
    for (int a = 0; a < 3; a++)
        q->center[a] = times_exp2(floor(times_exp2(n->center[a], -q->step_exp) + 0.5), q->step_exp);
    vec_sub(q->center, n->center, shift);
    const double moved = vec_length(shift);
    const double radius = smaller_of(n->radius + moved, far_corner(n, q->center, far) * OUTWARD);
    q->radius_code = spb_length_code(radius);
    q->radius = (double)spc_len_decode(q->radius_code);
    q->normal = n->normal;
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

/* The format's disk of a triangle: readers make the same from the triangle alone. */
static void quantise_leaf(const struct pack *p, struct pack_node *q, int step)
{
    const struct spb_space *space = p->shared->space;
    uint8_t record[ND_SIZE] = {0};
    const struct spc_frame frame = pack_frame(p);
    const bool fits = spc_leaf_record(&frame, step + space->unit_exp,
                                      (const int64_t(*)[3])p->leaves[q->leaf_number].corner, record);
    assert(fits);
    (void)fits;
    q->step_exp = step;
    for (int a = 0; a < 3; a++)
        q->center[a] = p->origin[a] + times_exp2(load_u16(record + ND_X + 2 * a), step);
    q->normal = load_u16(record + ND_NORMAL);
    q->e_self = load_u16(record + ND_E_SELF);
    q->radius_code = load_u16(record + ND_RADIUS);
    q->radius = (double)spc_len_decode(q->radius_code);
    q->height_code = record[ND_HEIGHT];
    q->height = q->radius * (q->height_code + 1) / 256;
}

static uint16_t larger(uint16_t a, uint16_t b)
{
    return a > b ? a : b;
}

/* e_self: bounds both distances between disk and triangles; see bound.c. */
static uint16_t own_error(const struct pack *p, const struct spb_node *n, double radius,
                          double height, double moved)
{
    if (p->shared->options.flags & SPC_FLAG_ERROR_PAPER)
        return spb_length_code(n->reach);
    const double reach = smaller_of(n->reach + moved + larger_of(0, radius - n->radius), 2 * radius);
    return spb_length_code(larger_of(reach, height) * OUTWARD);
}

static uint16_t error_below(const struct pack *p, const struct pack_node *q,
                            const struct spb_node *n)
{
    uint16_t e = n->owner ? n->e_below : SPC_LEN_ZERO;
    for (uint32_t k = 0; k < n->child_count && !n->owner; k++)
        e = larger(e, p->nodes[q->child_first + k].e_self);
    return spb_length_code((double)spc_len_decode(e));
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
    p->owner_e = own_error(p, n, p->owner_radius, height, p->owner_shift);
    for (uint32_t k = 0; k < n->child_count; k++)
        p->owner_e = larger(p->owner_e,
                            spb_length_code((double)spc_len_decode(p->nodes[k].e_self)));
}

static void measure_box(struct pack *p)
{
    double square = 0;
    for (int a = 0; a < 3; a++) {
        p->box[a] = HUGE_VALF;
        p->box[a + 3] = -HUGE_VALF;
        for (uint32_t i = 0; i < p->node_count; i++) {
            const double at = p->nodes[i].center[a] - p->origin[a];
            p->box[a] = fminf(p->box[a], float_below(at - p->nodes[i].radius));
            p->box[a + 3] = fmaxf(p->box[a + 3], float_above(at + p->nodes[i].radius));
        }
        const double side = (double)p->box[a + 3] - (double)p->box[a];
        square += side * side;
    }
    p->diagonal = (double)float_above(sqrt(square));
    assert(p->diagonal <= DIAGONAL_MAX);
}

/* L of I4: distance to the parent's centre, its radius beyond the node's, and float32's share. */
static double link_of(const struct pack *p, const struct pack_node *q)
{
    double distance, radius, diagonals = p->diagonal;
    if (q->parent != PACK_OWNER) {
        const struct pack_node *parent = &p->nodes[q->parent];
        distance = vec_distance(q->center, parent->center);
        radius = parent->radius;
        diagonals += p->diagonal;
    } else if (p->owner != NULL) {
        distance = vec_distance(q->center, p->owner->center) + p->owner_shift;
        radius = p->owner_radius;
        diagonals += DIAGONAL_MAX;
    } else {
        return 0;
    }
    return (distance + larger_of(0, radius - q->radius) + diagonals * 0x1p-21) * LINK_OUTWARD;
}

void pack_quantise(struct pack *p)
{
    const struct lattice l = choose_lattice(p);
    const bool paper = (p->shared->options.flags & SPC_FLAG_ERROR_PAPER) != 0;
    for (uint32_t i = p->node_count; i-- > 0;) {
        struct pack_node *q = &p->nodes[i];
        const struct spb_node *n = &p->tree->nodes[q->node];
        if (q->leaf) {
            quantise_leaf(p, q, l.finest);
            continue;
        }
        const double moved = quantise_pill(q, n, &l);
        q->e_self = n->owner ? n->e_self
                             : larger(own_error(p, n, q->radius, q->height, moved),
                                      error_below(p, q, n));
        assert(!n->owner || paper || (double)spc_len_decode(n->e_self) >= q->height);
    }
    declare_owner(p);
    measure_box(p);
    for (uint32_t i = 0; i < p->node_count; i++) {
        struct pack_node *q = &p->nodes[i];
        q->e_parent = q->parent == PACK_OWNER ? p->owner_e : p->nodes[q->parent].e_self;
        q->link = link_of(p, q);
    }
}
