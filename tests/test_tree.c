/*
 * The stages of the tree: the same nodes with vectors and without, and the same as the plain
 * functions of the format and the definitions of split.h and bound.c say.
 */
#include "plain_face.h"
#include "codes.h"
#include "plain_tree.h"
#include "split.h"
#include "suite.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

enum { FACES = 5000, NODE_BYTES = offsetof(struct spb_node, rgba) + 4 };

static uint64_t state = 1;

static uint32_t random_below(uint32_t n)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(state >> 33) % n;
}

static double random_unit(void)
{
    return (double)random_below(1u << 30) / 0x1p30;
}

/* ---- splitting --------------------------------------------------------------------------------- */

/* kind 0: anywhere; 1: on a coarse lattice, many equal; 2: on a line; 3: all equal; 4: tiny sides; 5: one far off */
static void random_keys(struct spb_key *keys, uint32_t n, int kind)
{
    for (uint32_t i = 0; i < n; i++) {
        for (int a = 0; a < 3; a++) {
            const double v = random_unit();
            keys[i].v[a] = kind == 0 ? v : kind == 1 ? floor(v * 8) / 8 : kind == 2 ? (a == 1) * v
                         : kind == 3 ? 0.3 : kind == 4 ? 0.5 + floor(v * 9) * 0x1p-52
                         : i == 0 ? 1 : v / 1024;
            keys[i].v[a] = keys[i].v[a] + 1 - 1;
        }
        keys[i].v[SPB_KEY_FACE] = i;
    }
}

static int by_place(const void *a, const void *b)
{
    const struct spb_key *x = a, *y = b;
    for (int k = 0; k < 4; k++)
        if (x->v[k] != y->v[k])
            return x->v[k] < y->v[k] ? -1 : 1;
    return 0;
}

/* Keys in order within both halves; returns how many go left. By frexp and ldexp, as split.h says. */
static uint32_t plain_halve(struct spb_key *keys, uint32_t n)
{
    double min[3], max[3], side = 0;
    int axis = 0, e = 0;
    uint32_t left = 0;
    for (int a = 0; a < 3; a++) {
        min[a] = max[a] = keys[0].v[a];
        for (uint32_t i = 1; i < n; i++) {
            min[a] = fmin(min[a], keys[i].v[a]);
            max[a] = fmax(max[a], keys[i].v[a]);
        }
        if (max[a] - min[a] > side) {
            side = max[a] - min[a];
            axis = a;
        }
    }
    qsort(keys, n, sizeof *keys, by_place);
    if (!(side > 0))
        return n / 2;
    frexp(side, &e);
    const double plane = ldexp(floor(ldexp((min[axis] + max[axis]) / 2, 2 - e) + 0.5), e - 2);
    struct spb_key *copy = malloc(n * sizeof *copy);
    memcpy(copy, keys, n * sizeof *copy);
    uint32_t right = 0;
    for (uint32_t i = 0; i < n; i++)
        left += copy[i].v[axis] < plane;
    for (uint32_t i = 0, l = 0; i < n; i++)
        keys[copy[i].v[axis] < plane ? l++ : left + right++] = copy[i];
    free(copy);
    return left;
}

/* Compares the nodes below one, numbered depth first, with the plain rule. Returns the height. */
static uint32_t compare_node(const struct spb_tree *t, uint32_t node, struct spb_key *keys,
                             uint32_t n, uint32_t *next)
{
    uint32_t from[5] = {0}, count = 0, height = 0;
    if (n == 1) {
        ck_assert_uint_eq(t->nodes[node].child_count, 0);
        ck_assert_uint_eq(t->nodes[node].link, (uint32_t)keys[0].v[SPB_KEY_FACE]);
        return 1;
    }
    qsort(keys, n, sizeof *keys, by_place);
    uint32_t border[3] = {0, n, n};
    if (n > 4)
        border[1] = plain_halve(keys, n);
    const uint32_t halves = n > 4 ? 2 : 1;
    uint32_t size[2] = {border[1], n - border[1]};
    const uint32_t small = size[0] <= size[1] ? 0 : 1;
    for (uint32_t h = 0; h < halves; h++) {
        if (n <= 4 || (h == small && size[h] < 4 && size[1 - h] <= 4)) {
            qsort(keys + border[h], size[h], sizeof *keys, by_place);
            for (uint32_t k = 0; k < size[h]; k++)
                from[++count] = border[h] + k + 1;
            continue;
        }
        if (size[h] > 4)
            from[++count] = border[h] + plain_halve(keys + border[h], size[h]);
        from[++count] = border[h] + size[h];
    }
    ck_assert_uint_eq(t->nodes[node].child_count, count);
    const uint32_t first = t->nodes[node].child_first;
    ck_assert_uint_eq(first, *next);
    *next += count;
    for (uint32_t k = 0; k < count; k++) {
        const uint32_t h = compare_node(t, first + k, keys + from[k], from[k + 1] - from[k], next);
        height = h > height ? h : height;
    }
    return height + 1;
}

/* All of it; nodes are given once each, and after those below them. */
static void split_all(struct spb_key *keys, uint32_t n, struct spb_tree *tree)
{
    struct spb_splitter splitter;
    uint32_t begin = 0, end = 1, given = 0;
    uint8_t *seen = calloc(2 * n, 1);
    ck_assert_int_eq(spb_split_begin(&splitter, keys, n, tree, NULL), SPC_OK);
    while (begin < end) {
        ck_assert_int_eq(spb_split_next(&splitter, &begin, &end, NULL), SPC_OK);
        for (uint32_t i = end; i-- > begin; given++) {
            const struct spb_node *node = &tree->nodes[i];
            for (uint32_t k = 0; k < node->child_count; k++)
                ck_assert(seen[node->child_first + k]);
            ck_assert(!seen[i]++);
        }
    }
    ck_assert_uint_eq(given, tree->node_count);
    spb_split_end(&splitter);
    free(seen);
}

START_TEST(splitting_follows_the_rule)
{
    struct spb_tree tree = {0};
    struct spb_key *keys = malloc(FACES * sizeof *keys), *again = malloc(FACES * sizeof *keys);
    for (int kind = 0; kind < 6; kind++)
        for (uint32_t n = 1; n <= FACES; n = n < 40 ? n + 1 : n * 5) {
            uint32_t next = 1;
            random_keys(keys, n, kind);
            memcpy(again, keys, n * sizeof *keys);
            split_all(keys, n, &tree);
            ck_assert_uint_eq(compare_node(&tree, 0, again, n, &next), tree.height);
            ck_assert_uint_eq(next, tree.node_count);
        }
    free(tree.nodes);
    free(keys);
    free(again);
}
END_TEST

/* ---- keys and nodes ------------------------------------------------------------------------------------- */

/* Acute, obtuse, needles, zero areas, one point; some of them large. */
static void random_corners(double corner[3][3])
{
    const double size = ldexp(1, -(int)random_below(20));
    const uint32_t kind = random_below(8);
    for (int k = 0; k < 3; k++)
        for (int a = 0; a < 3; a++)
            corner[k][a] = kind == 0 && a > 0 ? 0.25 : (random_unit() + 0x1p-30 * random_unit()) * size;
    if (kind == 1)
        memcpy(corner[2], corner[0], sizeof corner[0]);
    if (kind == 2)
        for (int a = 0; a < 3; a++)
            corner[2][a] = corner[1][a] + 0x1p-12 * random_unit();
}

struct scene {
    struct spb_space space;
    struct spb_record_format format;
    uint8_t *records;
    struct spb_node nodes[2][FACES];            /* with vectors, without */
};

static struct scene *make_scene(bool wide, bool colors)
{
    struct scene *s = malloc(sizeof *s);
    const double min[3] = {0, -0.1, 0}, max[3] = {1, 0.9, 1};
    spb_space_init(&s->space, min, max);
    spb_space_set_vertices(&s->space, 0x1p-15);
    s->format = spb_record_format(wide, colors);
    s->records = malloc((size_t)FACES * s->format.bytes);
    for (uint32_t i = 0; i < FACES; i++) {
        double corner[3][3];
        uint8_t rgba[3][4];
        random_corners(corner);
        for (int k = 0; k < 12; k++)
            rgba[k / 4][k % 4] = (uint8_t)random_below(256);
        plain_record_store(&s->format, (const double(*)[3])corner, (const uint8_t(*)[4])rgba,
                         s->records + (size_t)i * s->format.bytes);
        s->nodes[0][i] = s->nodes[1][i] = (struct spb_node){.link = FACES - 1 - i};
        if (i % 7 == 0)             /* an inner node: leaves are to be told apart */
            s->nodes[0][i].child_count = s->nodes[1][i].child_count = 2;
    }
    spb_leaves_make(&s->space, &s->format, s->records, s->nodes[0], FACES);
    plain_leaves_make(&s->space, &s->format, s->records, s->nodes[1], FACES);
    return s;
}

static void free_scene(struct scene *s)
{
    free(s->records);
    free(s);
}

/* What the format's own functions make of the face. */
static void check_leaf(const struct scene *s, const struct spb_node *leaf)
{
    struct plain_face face;
    double e[3][3], n[3], normal[3], longest = 0, height = 0;
    plain_record_load(&s->format, &s->space, s->records + (size_t)leaf->link * s->format.bytes,
                    &face);
    for (int k = 0; k < 9; k++)
        face.corner[k / 3][k % 3] = plain_from_lattice(
            &s->space, spb_space_snap(&s->space, face.corner[k / 3][k % 3]));
    for (int k = 0; k < 3; k++) {
        vec_sub(face.corner[(k + 1) % 3], face.corner[k], e[k]);
        longest = larger_of(longest, vec_length(e[k]));
        ck_assert_double_ge(leaf->radius, vec_distance(leaf->center, face.corner[k]));
    }
    ck_assert_uint_eq(leaf->e_self, spc_len_encode_up(longest));
    double back[3] = {-e[2][0], -e[2][1], -e[2][2]};
    vec_cross(e[0], back, n);
    const double twice = vec_length(n);
    const double up[3] = {0, 0, 1};
    vec_scale(twice > 0 ? n : up, 1 / (twice > 0 ? twice : 1), n);
    ck_assert_uint_eq(leaf->normal, spc_normal_encode(n));
    spc_normal_decode(leaf->normal, normal);
    for (int k = 0; k < 3; k++) {
        double d[3];
        vec_sub(face.corner[k], leaf->center, d);
        height = larger_of(height, fabs(vec_dot(d, normal)));
        for (int a = 0; a < 3; a++)
            d[a] -= (double)leaf->sample_step * leaf->sample[a][k];
        ck_assert_double_le(vec_length(d), (double)leaf->slack);
        for (int a = 0; a < 3; a++) {
            const double least = smaller_of(face.corner[0][a],
                                            smaller_of(face.corner[1][a], face.corner[2][a]));
            ck_assert(leaf->box[a] == float_below(least));
            ck_assert_double_ge((double)leaf->box[a + 3], face.corner[k][a]);
        }
    }
    ck_assert_double_ge(leaf->height, height);
    ck_assert(leaf->cone == (twice > 0 ? float_below(vec_dot(normal, n) - 1e-12) : -1));
    for (int a = 0; a < 4; a++)
        ck_assert_uint_eq(leaf->rgba[a],
                          (uint32_t)(face.rgba[0][a] + face.rgba[1][a] + face.rgba[2][a] + 1) / 3);
}

START_TEST(keys_are_those_of_the_faces)
{
    struct spb_key *keys = malloc(FACES * sizeof *keys);
    for (int kind = 0; kind < 4; kind++) {
        struct scene *s = make_scene(kind & 1, kind & 2);
        spb_record_keys(&s->format, &s->space, s->records, FACES, &keys[0].v);
        for (uint32_t i = 0; i < FACES; i++) {
            struct plain_face face;
            double key[3];
            plain_record_load(&s->format, &s->space, s->records + (size_t)i * s->format.bytes, &face);
            plain_face_key(&face, key);
            for (int a = 0; a < 3; a++) {
                const double x = face.corner[0][a], y = face.corner[1][a], z = face.corner[2][a];
                const double middle = (fmin(x, fmin(y, z)) + fmax(x, fmax(y, z))) / 2;
                ck_assert(key[a] == ldexp(rint(ldexp(middle, 52)), -52));
            }
            if (memcmp(key, keys[i].v, sizeof key) != 0 || keys[i].v[SPB_KEY_FACE] != i)
                ck_abort_msg("key %u is another", i);
        }
        free_scene(s);
    }
    free(keys);
}
END_TEST

START_TEST(leaves_are_the_same_without_vectors)
{
    for (int kind = 0; kind < 4; kind++) {
        struct scene *s = make_scene(kind & 1, kind & 2);
        for (uint32_t i = 0; i < FACES; i++) {
            if (memcmp(&s->nodes[0][i], &s->nodes[1][i], NODE_BYTES) != 0)
                ck_abort_msg("leaf %u differs without vectors", i);
            if (i % 7 != 0)
                check_leaf(s, &s->nodes[0][i]);
        }
        free_scene(s);
    }
}
END_TEST

/* The reach over leaves by its definition: see bound.c. */
static double plain_reach(const struct spb_node *node, const struct spb_node *children,
                          uint32_t count)
{
    static const double RADIUS[4] = {0, 0.5, 0.8660, 1.0823922002923941};
    double n[3], u[3], v[3], reach = 0;
    spc_normal_decode(node->normal, n);
    const double axis[3] = {fabs(n[0]) < 0.6, fabs(n[0]) >= 0.6, 0};
    vec_cross(n, axis, u);
    vec_scale(u, 1 / vec_length(u), u);
    vec_cross(n, u, v);
    for (int patch = 0; patch < 24; patch++) {
        double best = HUGE_VAL;
        for (uint32_t i = 0; i < count; i++) {
            double d[3], m[3], most = 0;
            vec_sub(children[i].center, node->center, d);
            spc_normal_decode(children[i].normal, m);
            const double c = smaller_of(1, fabs(vec_dot(n, m)));
            const double off = fabs(vec_dot(d, n)) + children[i].radius * sqrt(1 - c * c);
            for (int k = 0; k < 4; k++) {
                const int corner = (patch + (k & 1)) % 8;
                const double r = node->radius * RADIUS[patch / 8 + k / 2];
                const double diagonal = corner & 1 ? 0x1.6a09e667f3bcdp-1 : 1;
                const double x = r * diagonal * ((corner + 1) % 4 == 3 ? 0 : corner < 2 || corner > 6 ? 1 : -1);
                const double y = r * diagonal * (corner % 4 == 0 ? 0 : corner < 4 ? 1 : -1);
                const double dx = x - vec_dot(d, u), dy = y - vec_dot(d, v);
                const double in_plane = larger_of(0, sqrt(dx * dx + dy * dy) - children[i].radius * c);
                most = larger_of(most, sqrt(in_plane * in_plane + off * off) + children[i].reach);
            }
            best = smaller_of(best, most);
        }
        reach = larger_of(reach, best);
    }
    return smaller_of(reach, 2 * node->radius) * (1 + 0x1p-44);
}

/* What a child adds to the variance of a node's normals and colours. */
static double spread_of(const struct spb_node *node, const struct spb_node *child)
{
    double n[3], m[3], square = 0;
    spc_normal_decode(node->normal, n);
    spc_normal_decode(child->normal, m);
    for (int a = 0; a < 3; a++)
        square += pow((node->rgba[a] - child->rgba[a]) / 255.0, 2) / 3;
    return (double)child->spread + 2 - 2 * smaller_of(1, fabs(vec_dot(n, m))) + square;
}

/* Point k of a node: within its slack of a triangle below. */
static void sample_of(const struct spb_node *node, int k, double out[3])
{
    for (int a = 0; a < 3; a++)
        out[a] = node->center[a] + (double)node->sample_step * node->sample[a][k];
}

/* From a place to the nearest of the children's points; their slack comes on top. */
static double to_samples(const double p[3], const struct spb_node *children, uint32_t count, double *slack)
{
    double best = HUGE_VAL;
    *slack = 0;
    for (uint32_t i = 0; i < count; i++)
        for (int k = 0; k < children[i].sample_count; k++) {
            double s[3];
            sample_of(&children[i], k, s);
            best = fmin(best, vec_distance(p, s));
            *slack = fmax(*slack, (double)children[i].slack);
        }
    return best;
}

/* No point of the disk is further from the children's points than the reach less their slack. */
static void check_samples(const struct spb_node *node, const struct spb_node *children, bool leaves)
{
    const double off = 1e-12 * (node->radius + (double)node->slack);
    double n[3], u[3], v[3], p[3], slack;
    spc_normal_decode(node->normal, n);
    tangents(n, u, v);
    ck_assert_uint_le(node->sample_count, SPB_SAMPLES);
    for (int k = 0; k < node->sample_count; k++) {
        sample_of(node, k, p);
        const double moved = to_samples(p, children, node->child_count, &slack);
        ck_assert_double_le(moved, (double)node->slack - slack + off);
    }
    for (int k = 0; k < 96 && !leaves && node->reach < 2 * node->radius; k++) {
        const double angle = 0.1 * k, r = k < 64 ? node->radius : node->radius * random_unit();
        for (int a = 0; a < 3; a++)
            p[a] = node->center[a] + r * (cos(angle) * u[a] + sin(angle) * v[a]);
        const double far = to_samples(p, children, node->child_count, &slack);
        ck_assert_double_le(far + slack, node->reach + off);
    }
}

/* Four disks around a place, so that the disk over them is farthest from them in its middle. */
static void random_ring(struct spb_node *leaves)
{
    const double d = 0.01 * (1 + random_unit()), q = d * (0.3 + 0.2 * random_unit());
    const double up = 0.2 * d * random_unit(), reach = 0.1 * d * random_unit();
    for (int k = 0; k < 4; k++) {
        leaves[k].normal = 127 | 127 << 8;
        leaves[k].radius = q;
        leaves[k].area = 1;
        leaves[k].reach = reach;
        leaves[k].sample_count = 1;             /* its centre */
        leaves[k].slack = 0;
        memset(leaves[k].sample, 0, sizeof leaves[k].sample);
        for (int a = 0; a < 3; a++) {
            leaves[k].center[a] = 0.5 + (a == 2 ? k < 2 ? up : -up : a == k % 2 ? k < 2 ? d : -d : 0);
            leaves[k].box[a] = float_below(leaves[k].center[a] - 2 * q);
            leaves[k].box[a + 3] = float_above(leaves[k].center[a] + 2 * q);
        }
    }
}

/*
 * A tree over random leaves, some of them without area or all the same. kind 0: wide, its levels one
 * after another; 1: a chain of families; 2: families anywhere.
 */
static uint32_t random_tree(struct scene *s, int kind, struct spb_node *nodes)
{
    uint32_t count = 1, leaf = 0;
    memset(nodes, 0, 2 * FACES * sizeof *nodes);
    for (uint32_t i = 0; i < count && count + 4 <= 2 * FACES; i++) {
        if (kind == 1 ? nodes[i].link == 1 : kind == 2 && i > 0 && random_below(3) != 0 && i + 1 < count)
            continue;
        nodes[i].child_first = count;
        nodes[i].child_count = (uint8_t)(2 + random_below(3));
        const uint32_t inner = random_below(nodes[i].child_count);
        for (uint32_t k = 0; k < nodes[i].child_count; k++)
            nodes[count + k].link = k != inner;
        count += nodes[i].child_count;
    }
    for (uint32_t i = 0; i < count; i++) {
        if (nodes[i].child_count != 0)
            continue;
        do
            leaf = (leaf + 1) % FACES;
        while (s->nodes[0][leaf].child_count != 0);
        nodes[i] = s->nodes[0][leaf];
        if (i / 4 % 8 == 0)
            nodes[i].area = 0;
        if (i / 16 % 8 == 0 && i > 0 && nodes[i - 1].child_count == 0)
            nodes[i] = nodes[i - 1];
    }
    for (uint32_t i = 0; i < count; i++) {
        uint32_t leaves = 0;
        for (uint32_t k = 0; k < nodes[i].child_count; k++)
            leaves += nodes[nodes[i].child_first + k].child_count == 0;
        if (leaves == 4 && random_below(2) == 0)
            random_ring(&nodes[nodes[i].child_first]);
    }
    return count;
}

/* All at once, in steps as the splitter gives them, and without vectors one by one. */
START_TEST(inner_nodes_are_the_same_without_vectors)
{
    struct scene *s = make_scene(false, true);
    const int finest = spb_space_finest(&s->space);
    const size_t bytes = 2 * FACES * sizeof(struct spb_node);
    struct spb_node *all = malloc(bytes), *steps = malloc(bytes), *plain = malloc(bytes);
    for (int kind = 0; kind < 6; kind++) {
        const bool paper = kind >= 3;
        const uint32_t count = random_tree(s, kind % 3, all);
        ck_assert_uint_gt(count, FACES);            /* more than are made at once */
        memcpy(steps, all, bytes);
        memcpy(plain, all, bytes);
        spb_inner_make(all, 0, count, paper, finest);
        for (uint32_t end = count, size; end > 0; end -= size) {
            size = 1 + random_below(end < 100 ? end : 100);
            spb_inner_make(steps, end - size, end, paper, finest);
        }
        for (uint32_t i = count; i-- > 0;) {
            const struct spb_node *children = &all[all[i].child_first];
            double area = 0;
            plain_inner_make(plain, i, i + 1, paper, finest);
            if (memcmp(&all[i], &plain[i], NODE_BYTES) != 0)
                ck_abort_msg("node %u of tree %d differs without vectors", i, kind);
            if (memcmp(&steps[i], &plain[i], NODE_BYTES) != 0)
                ck_abort_msg("node %u of tree %d differs in steps", i, kind);
            if (all[i].child_count == 0)
                continue;
            for (uint32_t k = 0; k < all[i].child_count; k++)
                area += children[k].area;
            ck_assert(all[i].area == area);
            for (int a = 0; a < 6; a++) {
                float side = children[0].box[a];
                for (uint32_t k = 1; k < all[i].child_count; k++)
                    side = a < 3 ? fminf(side, children[k].box[a]) : fmaxf(side, children[k].box[a]);
                ck_assert(all[i].box[a] == side);
            }
            const int asked = spb_center_step(all[i].radius), step = asked < finest ? finest : asked;
            for (int a = 0; a < 3; a++)
                ck_assert(fmod(all[i].center[a], ldexp(1, step)) == 0);
            double spread = 0;
            for (uint32_t k = 0; k < all[i].child_count; k++)
                spread += spread_of(&all[i], &children[k]) *
                          (area > 0 ? children[k].area / area : 1.0 / all[i].child_count);
            ck_assert_double_eq_tol((double)all[i].spread, spread, 1e-6 * (1 + spread));
            bool leaves = true;
            for (uint32_t k = 0; k < all[i].child_count; k++)
                leaves &= children[k].child_count == 0;
            if (!paper && leaves)
                ck_assert(all[i].reach == plain_reach(&all[i], children, all[i].child_count));
            if (!paper)
                check_samples(&all[i], children, leaves);
        }
    }
    free(all);
    free(steps);
    free(plain);
    free_scene(s);
}
END_TEST

START_TEST(codes_are_those_of_the_format)
{
    for (uint32_t i = 0; i < 200000; i++) {
        const double v = ldexp(random_unit(), (int)random_below(300) - 160);
        const float at = spc_len_decode((uint16_t)random_below(0xFE00));
        ck_assert_uint_eq(length_code_up(v), spc_len_encode_up(v));
        ck_assert_uint_eq(length_code_up((double)at), spc_len_encode_up((double)at));
    }
    ck_assert_uint_eq(length_code_up(0), spc_len_encode_up(0));
    for (uint32_t code = 0; code < 65536; code++) {
        double n[3];
        if ((code & 0xFF) == 0xFF || code >> 8 == 0xFF)
            continue;
        spc_normal_decode((uint16_t)code, n);
        const double u = (double)(code & 0xFF) - 127, v = (double)(code >> 8) - 127;
        const struct oct o = oct_decode(u, v);
        ck_assert(o.x == n[0] && o.y == n[1] && o.z == n[2]);
        ck_assert_uint_eq(oct_code(u, v), code);
    }
    for (double v = 1e-30; v < 1e30; v *= 1.37) {
        ck_assert(exponent_above(v) == ilogb(v) + 1);
        ck_assert(float_below(v) <= v && float_above(-v) >= -v);
    }
    ck_assert_int_eq(exponent_above(0x1p-1060), -1059);
}
END_TEST

int main(void)
{
    return SUITE("tree", NULL, NULL, splitting_follows_the_rule, keys_are_those_of_the_faces,
                 leaves_are_the_same_without_vectors, inner_nodes_are_the_same_without_vectors,
                 codes_are_those_of_the_format);
}
