/*
 * How much of the room that I4 leaves for float32 is used, by eyes that are sought for using most.
 *
 * Let c be a node and p its parent, at a tie: p is coarse by a hair, so c must be fine. In exact numbers
 *     q_c <= q_p + eps L0,  L0 = dist(c, p) + max(0, R_p - R_c)
 * by the triangle inequality. In float32 p fails its lower test when q_p comes out dp too small, and c
 * fails its upper one when the two sides of that come out dl too large and dr too small. No path is
 * bare, then, as long as
 *     dp + dl + dr <= 2^-20 q_c + eps (L - L0)
 * for every eye. The left over the right is the share used. It is computed in long double from the
 * bits in the file and the eye's doubles; for L stand the least that the format allows, 2^-21 of the
 * diagonals above L0, and, beside it, what is stored.
 */
#include "mesh_case.h"
#include "oracle_case.h"
#include "suite.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* ---- exact ------------------------------------------------------------------------------------- */

struct exact {                      /* a node, from the bits of its record; units, from the eye */
    long double at[3], radius, e_self, e_parent, link;
    uint16_t e_parent_code;
};

/* Float bits of a length code, without the library: the upper half of a float, by one bit. */
static long double length_of(uint16_t code)
{
    const int exponent = code >> 8, fraction = code & 0xFF;
    return code == 0 ? 0 : ldexpl(256 + fraction, exponent - 127 - 8);
}

static long double link_of(uint8_t code, int base)
{
    return ldexpl(8 + (code & 7), base + (code >> 3) - 3);
}

static void rebuild(const struct oracle_case *c, const struct oracle_node *n, struct exact *out)
{
    const struct spc_block *b = &c->tree.blocks[n->block];
    const int unit = c->tree.header->unit_exp;
    for (int a = 0; a < 3; a++) {
        const long double from_eye = (long double)c->tree.clusters[n->cluster].origin[a] - c->view.camera.eye[a];
        out->at[a] = ldexpl(from_eye, -unit) + ldexpl(load_u16(n->record + ND_X + 2 * a), b->step_exp - unit);
    }
    out->radius = length_of(load_u16(n->record + ND_RADIUS));
    out->e_self = length_of(load_u16(n->record + ND_E_SELF));
    out->e_parent_code = load_u16(n->record + ND_E_PARENT);
    out->e_parent = length_of(out->e_parent_code);
    out->link = link_of(n->record[ND_LINK], b->link_base);
}

static long double rho_of(const struct exact *n)
{
    return sqrtl(n->at[0] * n->at[0] + n->at[1] * n->at[1] + n->at[2] * n->at[2]) - n->radius;
}

static double diagonal(const struct spc_cluster *k)
{
    double d2 = 0;
    for (int a = 0; a < 3; a++)
        d2 += ((double)k->box[a + 3] - (double)k->box[a]) * ((double)k->box[a + 3] - (double)k->box[a]);
    return sqrt(d2);
}

static void same(const struct oracle_case *c, uint32_t i)
{
    const struct oracle_node *n = &c->tree.nodes[i];
    struct exact e;
    rebuild(c, n, &e);
    bool good = e.radius == (long double)n->radius && e.e_self == (long double)n->e_self &&
                (n->parent == SPC_NONE || (e.e_parent == (long double)n->e_parent && e.link == (long double)n->link));
    for (int a = 0; a < 3; a++) {
        const long double from_eye = (long double)n->center[a] - c->view.camera.eye[a];
        good = good && e.at[a] == ldexpl(from_eye, -c->tree.header->unit_exp);
    }
    if (!good)
        oracle_fail(c, "node %u is not decoded as its bits say", i);
}

static void rebuild_all(struct oracle_case *c)
{
    for (int a = 0; a < 3; a++)     /* at a corner of the box: differences there are exact in long double */
        c->view.camera.eye[a] = c->tree.header->box_min[a];
    for (uint32_t i = 0; i < c->tree.node_count; i++)
        same(c, i);
}

START_TEST(decoded_values_are_what_their_bits_say)
{
    oracle_each(rebuild_all);
}
END_TEST

/* ---- the share used ---------------------------------------------------------------------------- */

struct use {
    double least, stored;           /* of the room that the format guarantees, and of what is there */
    bool bare;                      /* both tests fail */
};

/* The sides of the upper test as I4 has it. Volatile: what wider registers would keep must be a float. */
static double upper_side(const struct spv_interval *in, const struct oracle_node *n)
{
    const volatile float room = in->eps * spc_link_decode(n->record[ND_LINK], in->link_base);
    const volatile float sum = spc_len_decode(load_u16(n->record + ND_E_PARENT)) + room;
    return (double)sum;
}

static double lower_side(float q)
{
    const volatile float side = q * (1 - 0x1p-20f);
    return (double)side;
}

/* Does a shader draw neither, the parent for its lower test, the node for its upper one? */
static bool is_bare(const struct oracle_node *n, const struct oracle_node *above, struct spv_interval in,
                    struct spv_interval in_above)
{
    uint8_t record[SPC_NODE_BYTES];
    memcpy(record, above->record, sizeof record);
    store_u16(record + ND_E_PARENT, SPC_LEN_ROOT);      /* passes any upper test */
    in.lower = false;
    return !spv_interval_point(&in_above, record) && !spv_interval_point(&in, n->record);
}

static struct use use_of(const struct oracle_case *c, uint32_t i)
{
    const struct oracle_node *n = &c->tree.nodes[i], *above = &c->tree.nodes[n->parent];
    const struct spv_interval in = oracle_interval(&c->tree, n->block, &c->view);
    const struct spv_interval in_above = oracle_interval(&c->tree, above->block, &c->view);
    const float q = spv_interval_q(&in, n->record), q_above = spv_interval_q(&in_above, above->record);
    const long double eps = c->view.eps;
    struct exact e, p;
    rebuild(c, n, &e);
    rebuild(c, above, &p);
    long double between2 = 0;
    for (int a = 0; a < 3; a++)
        between2 += (e.at[a] - p.at[a]) * (e.at[a] - p.at[a]);
    const long double l0 = sqrtl(between2) + fmaxl(0, p.radius - e.radius);
    const long double exact_q = eps * rho_of(&e), exact_above = eps * rho_of(&p);
    const long double dp = exact_above - (long double)q_above;
    const long double dl = (long double)lower_side(q) - exact_q * (1 - 0x1p-20L);
    const long double dr = e.e_parent + eps * e.link - (long double)upper_side(&in, n);
    const long double slack = 0x1p-21L * (diagonal(&c->tree.clusters[n->cluster]) +
                                          diagonal(&c->tree.clusters[above->cluster]));
    const long double lost = dp + dl + dr, room = 0x1p-20L * exact_q;
    return (struct use){
        .least = (double)(lost / (room + eps * slack)),
        .stored = (double)(lost / (room + eps * (e.link - l0))),
        .bare = is_bare(n, above, in, in_above),
    };
}

/* The eye, and the eps at which the parent is at its tie. False: no eps does that. */
static bool tie(struct oracle_case *c, uint32_t i, const double eye[3])
{
    const struct oracle_node *above = &c->tree.nodes[c->tree.nodes[i].parent];
    struct exact p;
    for (int a = 0; a < 3; a++)
        c->view.camera.eye[a] = eye[a];
    rebuild(c, above, &p);
    const long double rho = rho_of(&p);
    if (!(rho > 0) || !(p.e_self > 0))
        return false;
    c->view.eps = (double)(p.e_self / rho);
    return c->view.eps > 0x1p-100 && c->view.eps < 0x1p20;
}

static double log_between(struct oracle_case *c, double low, double high)
{
    return low * pow(high / low, case_random(&c->state));
}

/* Around the parent: from its rim to far away. */
static void start_eye(struct oracle_case *c, uint32_t i, double *away, double eye[3])
{
    const struct oracle_node *n = &c->tree.nodes[i], *above = &c->tree.nodes[n->parent];
    double d[3], length = 0, line = 0;
    const bool behind = oracle_pick(c, 2);      /* in one line with both: there L is tight */
    for (int a = 0; a < 3; a++) {
        line += (above->center[a] - n->center[a]) * (above->center[a] - n->center[a]);
        d[a] = behind ? above->center[a] - n->center[a] : case_random(&c->state) - 0.5;
    }
    for (int a = 0; a < 3; a++) {
        d[a] = behind && line == 0 ? a == 0 : d[a];
        length += d[a] * d[a];
    }
    *away = ldexp(above->radius, c->tree.header->unit_exp) * (1 + log_between(c, 1e-7, 1e9));
    for (int a = 0; a < 3; a++)
        eye[a] = above->center[a] + *away / sqrt(length) * d[a];
}

static double best[2];              /* of all archives: least, stored */

/* Local search: steps that shrink, kept when more is used. */
static void climb(struct oracle_case *c, uint32_t steps)
{
    const uint32_t i = 1 + oracle_pick(c, c->tree.node_count - 1);
    const bool seek_stored = oracle_pick(c, 2);
    double eye[3], next[3], away, most = -INFINITY;
    start_eye(c, i, &away, eye);
    double step = 0.3 * away;
    for (uint32_t k = 0; k < steps; k++, step *= k % 8 == 0 ? 0.5 : 1) {
        for (int a = 0; a < 3; a++)
            next[a] = eye[a] + (k == 0 ? 0 : step * (2 * case_random(&c->state) - 1));
        if (!tie(c, i, next))
            continue;
        const struct use u = use_of(c, i);
        best[0] = fmax(best[0], u.least);
        best[1] = fmax(best[1], u.stored);
        if (u.bare)
            oracle_fail(c, "node %u and its parent %u both fail in float32", i, c->tree.nodes[i].parent);
        if (u.least >= 1 || u.stored >= 1)
            oracle_fail(c, "node %u: float32 takes %.3f of the room that I4 leaves, %.3f of its link's", i, u.least,
                        u.stored);
        const double now = seek_stored ? u.stored : u.least;
        if (now > most) {
            most = now;
            memcpy(eye, next, sizeof eye);
        }
    }
}

static void climb_all(struct oracle_case *c)
{
    for (uint32_t k = 0; k < oracle_views(60) && c->tree.node_count > 1; k++)
        climb(c, 64);
}

START_TEST(float32_takes_less_than_the_room_that_links_leave)
{
    best[0] = best[1] = -INFINITY;
    oracle_each(climb_all);
    printf("of the room that I4 leaves float32 takes %.3f at most; of what links leave when stored, %.3f\n", best[0],
           best[1]);
    ck_assert_double_gt(best[0], 0.1);          /* else the search seeks nothing */
}
END_TEST

int main(void)
{
    if (!oracle_start())
        return 1;
    const int failed = SUITE("margin", case_start, case_finish, decoded_values_are_what_their_bits_say,
                             float32_takes_less_than_the_room_that_links_leave);
    oracle_finish();
    return failed;
}
