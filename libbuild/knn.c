#include "knn.h"

#include "split.h"
#include "vectors.h"

/* ---- the tree ------------------------------------------------------------------------------------ */

SPB_VECTORS static void measure(const struct spb_key *keys, uint32_t count, double min[4],
                                double max[4])
{
    for (int a = 0; a < 4; a++)
        min[a] = max[a] = keys[0].v[a];
    for (uint32_t i = 1; i < count; i++)
        for (int a = 0; a < 4; a++) {
            min[a] = smaller_of(keys[i].v[a], min[a]);
            max[a] = larger_of(keys[i].v[a], max[a]);
        }
}

/* Keys below the plane to the left, in their order; how many there are. */
static uint32_t part_keys(struct spb_key *keys, struct spb_key *scratch, uint32_t count, int axis,
                          double plane)
{
    uint32_t left = 0, right = 0;
    for (uint32_t i = 0; i < count; i++) {
        const struct spb_key key = keys[i];
        const bool goes_left = key.v[axis] < plane;
        keys[left] = key;
        scratch[right] = key;
        left += goes_left;
        right += !goes_left;
    }
    memcpy(keys + left, scratch, right * sizeof *keys);
    return left;
}

struct builder {
    struct spb_key *keys, *scratch;
    struct spb_kd *out;
};

/* As deep as the lattice of keys has bits, some hundred levels, whatever the data (plan.c). */
static void build(struct builder *b, uint32_t first, uint32_t count)
{
    struct spb_kd_node *n = &b->out->nodes[b->out->node_count++];
    struct spb_split split;
    double min[4], max[4];
    measure(b->keys + first, count, min, max);
    memcpy(n->min, min, sizeof n->min);
    memcpy(n->max, max, sizeof n->max);
    n->first = first;
    n->count = count;
    n->right = 0;
    if (count <= SPB_BUCKET || !spb_split_box(n->min, n->max, &split))
        return;
    const uint32_t left = part_keys(b->keys + first, b->scratch, count, split.axis, split.plane);
    build(b, first, left);
    n->right = b->out->node_count;
    build(b, first + left, count - left);
}

void spb_kd_build(struct spb_key *keys, struct spb_key *scratch, uint32_t count,
                  struct spb_kd_node *nodes, struct spb_kd *out)
{
    struct builder b = {keys, scratch, out};
    *out = (struct spb_kd){.nodes = nodes};
    build(&b, 0, count);
}

void spb_kd_coordinates(struct spb_kd *kd, const struct spb_key *keys, struct spb_key *room,
                        uint32_t count)
{
    double *out = room->v;
    for (int a = 0; a < 3; a++, out += count) {
        for (uint32_t i = 0; i < count; i++)
            out[i] = keys[i].v[a];
        kd->axis[a] = out;
    }
}

/* ---- what is near -------------------------------------------------------------------------------- */

/* Differences and sums round monotonically: in this order of operations nothing inside is nearer. */
SPB_INLINE double gap(double min, double max, double other_min, double other_max)
{
    const double below = other_min - max, above = min - other_max;
    const double most = larger_of(below, above);
    return larger_of(most, 0);
}

double spb_box_distance(const double min[3], const double max[3], const double other_min[3],
                        const double other_max[3])
{
    const double x = gap(min[0], max[0], other_min[0], other_max[0]);
    const double y = gap(min[1], max[1], other_min[1], other_max[1]);
    const double z = gap(min[2], max[2], other_min[2], other_max[2]);
    return x * x + y * y + z * z;
}

static int compare(const double a[4], const double b[4])
{
    for (int k = 0; k < 4; k++)
        if (a[k] != b[k])
            return a[k] < b[k] ? -1 : 1;
    return 0;
}

static void insert(struct spb_near *near, const double place[4])
{
    uint32_t at = near->count;
    while (at > 0 && place[0] < near->at[at - 1][0])
        at--;
    while (at > 0 && place[0] == near->at[at - 1][0]) {
        const int order = compare(place, near->at[at - 1]);
        if (order == 0)
            return;                 /* known already */
        if (order > 0)
            break;
        at--;
    }
    if (at == near->room)
        return;
    if (near->count < near->room)
        near->count++;
    for (uint32_t k = near->count - 1; k > at; k--)
        memcpy(near->at[k], near->at[k - 1], sizeof near->at[k]);
    memcpy(near->at[at], place, sizeof near->at[at]);
    if (near->count == near->room)
        near->worst = near->at[near->room - 1][0];
}

SPB_VECTORS static void measure_distances(const double *const axis[3], uint32_t count,
                                          const double from[3], double *out)
{
    const double x = from[0], y = from[1], z = from[2];
    const double *xs = axis[0], *ys = axis[1], *zs = axis[2];
    for (uint32_t i = 0; i < count; i++) {
        const double dx = xs[i] - x, dy = ys[i] - y, dz = zs[i] - z;
        out[i] = dx * dx + dy * dy + dz * dz;
    }
}

void spb_group_look(struct spb_group *g, const double *const axis[3], uint32_t count,
                    const double min[3], const double max[3])
{
    double square[SPB_BUCKET];
    double worst = 0;
    for (uint32_t q = 0; q < g->count; q++) {
        struct spb_near *near = &g->near[q];
        const double from[3] = {g->axis[0][q], g->axis[1][q], g->axis[2][q]};
        if (spb_box_distance(from, from, min, max) <= near->worst) {
            measure_distances(axis, count, from, square);
            for (uint32_t i = 0; i < count; i++)
                if (square[i] <= near->worst && square[i] > 0)
                    insert(near, (double[4]){square[i], axis[0][i], axis[1][i], axis[2][i]});
        }
        worst = larger_of(worst, near->worst);
    }
    g->worst = worst;
}

static void look_at_node(struct spb_group *g, const struct spb_kd *kd, const struct spb_kd_node *n)
{
    const uint32_t places = n->count > SPB_BUCKET ? 1 : n->count;
    const double *const axis[3] = {kd->axis[0] + n->first, kd->axis[1] + n->first,
                                   kd->axis[2] + n->first};
    spb_group_look(g, axis, places, n->min, n->max);
}

static void look_below(struct spb_group *g, const struct spb_kd *kd, uint32_t node, uint32_t own)
{
    const struct spb_kd_node *n = &kd->nodes[node];
    if (n->right == 0) {
        if (node != own)
            look_at_node(g, kd, n);
        return;
    }
    uint32_t child[2] = {node + 1, n->right};
    double distance[2];
    for (int c = 0; c < 2; c++)
        distance[c] = spb_box_distance(g->min, g->max, kd->nodes[child[c]].min, kd->nodes[child[c]].max);
    const int nearer = distance[1] < distance[0] || (distance[1] == distance[0] && own >= child[1]);
    for (int c = 0; c < 2; c++) {
        const int k = c == 0 ? nearer : !nearer;
        if (distance[k] <= g->worst)
            look_below(g, kd, child[k], own);
    }
}

void spb_group_init(struct spb_group *g, const struct spb_kd *kd, uint32_t bucket, uint32_t room)
{
    const struct spb_kd_node *n = &kd->nodes[bucket];
    g->count = n->count > SPB_BUCKET ? 1 : n->count;
    for (int a = 0; a < 3; a++)
        memcpy(g->axis[a], kd->axis[a] + n->first, g->count * sizeof *g->axis[a]);
    memcpy(g->min, n->min, sizeof g->min);
    memcpy(g->max, n->max, sizeof g->max);
    for (uint32_t q = 0; q < g->count; q++) {
        g->near[q].count = 0;
        g->near[q].room = room;
        g->near[q].worst = HUGE_VAL;
    }
    look_at_node(g, kd, n);
    look_below(g, kd, 0, bucket);
}
