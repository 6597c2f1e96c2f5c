/* Loops of packing that become vectors give what the plain functions give, to the last bit. */
#include "plain_face.h"
#include "bytes.h"
#include "pack_int.h"
#include "suite.h"
#include "vec.h"

#include <stdlib.h>

enum { N = 1000 };                  /* leaves: no multiple of a batch */

static double next(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) * 0x1p-53;
}

/* ---- a cluster of leaves, all tops ------------------------------------------------------------- */

struct sample {
    struct spb_space space;
    struct spb_pack_shared shared;
    struct spb_pack_tree tree;
    struct pack p;
    struct pack_family families[N];
    uint32_t list[N], record[N];
    uint16_t at[3][N], normal[N], e_self[N], radius[N], cone_normal[N];
    uint64_t key[N][3];
    float cone[N];
    uint8_t height[N], records[N * 36];
    struct spb_cluster out;
};

/* Small triangles in a box at an offset; every tenth has no area. */
static struct sample *sample_create(void)
{
    struct sample *s = calloc(1, sizeof *s);
    const double min[3] = {5, -7, 0}, max[3] = {5 + 1.5, -6, 1};
    uint64_t state = 11;
    spb_space_init(&s->space, min, max);
    spb_space_set_vertices(&s->space, 0x1p-8);
    s->shared = (struct spb_pack_shared){.space = &s->space, .format = spb_record_format(false, false)};
    s->shared.options.normal_clusters = 128;
    s->shared.scratches = pack_scratches_create(1);
    s->tree = (struct spb_pack_tree){.shared = &s->shared, .records = s->records};
    for (int i = 0; i < N; i++) {
        float xyz[9];
        for (int k = 0; k < 9; k++)
            xyz[k] = (float)(k < 3 ? min[k] + (max[k] - min[k]) * next(&state)
                                   : (double)xyz[k % 3] + (i % 10 ? 0.05 * next(&state) : 0));
        memcpy(s->records + 36 * (size_t)i, xyz, sizeof xyz);
        s->record[i] = (uint32_t)(N - 1 - i);
        s->families[i] = (struct pack_family){.first = (uint32_t)i, .count = 1, .group = (uint32_t)i % 128};
        s->list[i] = (uint32_t)i;
        s->cone_normal[i] = (uint16_t)((uint32_t)(255 * next(&state)) | (uint32_t)(255 * next(&state)) << 8);
        s->cone[i] = i % 7 ? (float)(2 * next(&state) - 1) : -1;
    }
    s->p = (struct pack){.tree = &s->tree, .shared = &s->shared, .cosine = 1, .axis = {0.6, 0, 0.8},
                         .out = &s->out};
    s->p.kind[SPC_BLOCK_LEAF] = (struct pack_kind){
        .count = N, .normal = s->cone_normal, .cone = s->cone, .families = s->families, .list = s->list,
        .family_count = N};
    s->p.leaves = (struct pack_leaves){.record = s->record, .at = {s->at[0], s->at[1], s->at[2]},
        .normal = s->normal, .e_self = s->e_self, .radius = s->radius, .height = s->height, .key = s->key};
    s->p.frame = (struct spc_frame){.unit_exp = s->space.unit_exp, .vertex_exp = s->space.vertex_exp};
    for (int a = 0; a < 3; a++) {
        s->p.frame.origin[a] = s->space.origin[a];
        s->p.max[a] = 1;
    }
    s->p.memory = pack_scratch_take(s->shared.scratches);
    return s;
}

static void sample_free(struct sample *s)
{
    pack_scratch_give(s->shared.scratches, s->p.memory);
    pack_scratches_free(s->shared.scratches);
    free(s);
}

/* Corners as space.c snaps them, one by one. */
static void corners_of(const struct sample *s, uint32_t i, int64_t corner[3][3])
{
    struct plain_face face;
    plain_record_load(&s->shared.format, &s->space, s->records + 36 * (size_t)s->record[i], &face);
    for (int k = 0; k < 3; k++)
        for (int a = 0; a < 3; a++)
            corner[k][a] = (int64_t)spb_space_snap(&s->space, face.corner[k][a]) +
                           spb_space_origin_number(&s->space, a);
}

enum { POINTS = 30 };

static const double *point(int j)
{
    static double at[3];
    uint64_t state = (uint64_t)j;
    for (int a = 0; a < 3; a++)
        at[a] = next(&state);
    return at;
}

START_TEST(leaves_are_the_formats)
{
    struct sample *s = sample_create();
    const int step = -12;
    double min[3] = {1, 1, 1}, max[3] = {0, 0, 0}, most[POINTS] = {0};
    ck_assert_int_eq(pack_leaves(&s->p, step, NULL), SPC_OK);
    ck_assert(s->p.leaves.wide == NULL);
    for (uint32_t i = 0; i < N; i++) {
        int64_t corner[3][3];
        uint8_t r[ND_SIZE] = {0};
        double at[3];
        corners_of(s, i, corner);
        ck_assert(spc_leaf_record(&s->p.frame, step + s->space.unit_exp, (const int64_t(*)[3])corner, r));
        const double radius = (double)spc_len_decode(load_u16(r + ND_RADIUS));
        for (int a = 0; a < 3; a++) {
            ck_assert_uint_eq(s->at[a][i], load_u16(r + ND_X + 2 * a));
            at[a] = ldexp(s->at[a][i], step);
            min[a] = smaller_of(min[a], at[a] - radius);
            max[a] = larger_of(max[a], at[a] + radius);
        }
        for (int k = 0; k < 3; k++)
            for (int a = 0; a < 3; a++)
                ck_assert_int_eq((int64_t)(s->key[i][k] >> 21 * a & 0x1FFFFF),
                                 corner[k][a] - spb_space_origin_number(&s->space, a));
        ck_assert_uint_eq(s->normal[i], load_u16(r + ND_NORMAL));
        ck_assert_uint_eq(s->e_self[i], load_u16(r + ND_E_SELF));
        ck_assert_uint_eq(s->radius[i], load_u16(r + ND_RADIUS));
        ck_assert_uint_eq(s->height[i], r[ND_HEIGHT]);
        for (int j = 0; j < POINTS; j++)
            most[j] = larger_of(most[j], vec_distance(at, point(j)) + radius);
    }
    for (int a = 0; a < 3; a++) {
        ck_assert_double_eq(s->p.leaves.min[a], min[a]);
        ck_assert_double_eq(s->p.leaves.max[a], max[a]);
    }
    for (int j = 0; j < POINTS; j++)
        ck_assert_double_eq(pack_leaves_reach(&s->p, point(j)), most[j]);
    sample_free(s);
}
END_TEST

/* ---- cones ------------------------------------------------------------------------------------- */

START_TEST(normals_add_up_as_decoded)
{
    static uint16_t code[65536];
    double sum[3], plain[3] = {0, 0, 0};
    uint32_t n = 0;
    for (uint32_t c = 0; c < 65536; c++) {
        double d[3];
        if ((c & 255) == 255 || c >> 8 == 255)
            continue;
        code[n++] = (uint16_t)c;
        spc_normal_decode((uint16_t)c, d);
        pack_normals_sum(&code[n - 1], 1, sum);
        for (int a = 0; a < 3; a++) {
            ck_assert_double_eq(sum[a], d[a]);
            plain[a] += d[a];
        }
    }
    pack_normals_sum(code, n, sum);
    for (int a = 0; a < 3; a++)
        ck_assert_double_eq(sum[a], plain[a]);
}
END_TEST

/* The angle between axis and normal, and the cone's half angle, together. */
static double plain_cone(const double axis[3], uint16_t normal, double b)
{
    double n[3];
    spc_normal_decode(normal, n);
    const double a = larger_of(-1, smaller_of(1, vec_dot(axis, n)));
    if (b <= -1 || a <= -b)
        return -1;
    return larger_of(-1, a * b - sqrt(1 - a * a) * sqrt(1 - b * b) - 1e-7);
}

START_TEST(cones_hold_all_of_a_group)
{
    struct sample *s = sample_create();
    double cosine[SPC_NORMAL_CLUSTERS_MAX], plain[SPC_NORMAL_CLUSTERS_MAX], all = 1;
    uint64_t state = 5;
    uint32_t whole = 0;
    for (int g = 0; g < 128; g++) {
        plain[g] = 1;
        for (int a = 0; a < 3; a++)
            s->shared.axis[g][a] = 2 * next(&state) - 1;
        vec_scale(s->shared.axis[g], 1 / vec_length(s->shared.axis[g]), s->shared.axis[g]);
    }
    for (uint32_t i = 0; i < N; i++) {      /* narrow about their axis, so that not all are -1 */
        s->families[i].group = i % 64;
        s->cone_normal[i] = spc_normal_encode(s->shared.axis[i % 64]);
        s->cone[i] = i % 64 == 7 ? -1 : 1 - (float)next(&state) / 4;
        const double *axis = s->shared.axis[i % 64];
        plain[i % 64] = smaller_of(plain[i % 64], plain_cone(axis, s->cone_normal[i], (double)s->cone[i]));
        all = smaller_of(all, plain_cone(s->p.axis, s->cone_normal[i], (double)s->cone[i]));
    }
    const struct pack_block b = {.kind = SPC_BLOCK_LEAF, .family_count = N, .count = N};
    pack_cones(&s->p, &b, cosine);
    for (int g = 0; g < 128; g++) {
        ck_assert_double_eq(cosine[g], plain[g]);
        whole += cosine[g] == -1;
    }
    ck_assert_uint_eq(whole, 1);
    ck_assert_double_eq(s->p.cosine, all);
    sample_free(s);
}
END_TEST

START_TEST(the_axis_of_a_cone_is_the_stored_one_to_the_last_bit)
{
    uint64_t state = 3;
    for (int i = 0; i < 1000; i++) {
        const double sum[3] = {next(&state) - 0.5, next(&state) - 0.5, next(&state) - 0.5};
        float cone[3];
        double axis[3], stored[3];
        pack_cone_axis(sum, cone, axis);
        for (int a = 0; a < 3; a++) {
            const volatile float read = cone[a];
            stored[a] = (double)read;
            ck_assert_double_eq_tol(stored[a], sum[a] / vec_length(sum), 0x1p-24);
        }
        const double shrink = 1 / vec_length(stored);
        for (int a = 0; a < 3; a++)
            ck_assert_double_eq(axis[a], stored[a] * shrink);
    }
}
END_TEST

int main(void)
{
    return SUITE("pack", NULL, NULL, leaves_are_the_formats, normals_add_up_as_decoded,
                 cones_hold_all_of_a_group, the_axis_of_a_cone_is_the_stored_one_to_the_last_bit);
}
