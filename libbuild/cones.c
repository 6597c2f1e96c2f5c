/*
 * cones.c - cones of normals: of a block's normal clusters, and of the cluster.
 *
 * A node's cone holds the winding normals of all that lies below it, in other clusters too.
 */
#include "pack_int.h"

#include "vec.h"
#include "vectors.h"

struct batch {
    uint16_t normal[PACK_BATCH];
    float cone[PACK_BATCH];
    uint8_t group[PACK_BATCH];
    double n[3][PACK_BATCH];        /* unit normals */
    double axis[3][PACK_BATCH];     /* of the groups */
    double about_group[PACK_BATCH], about_axis[PACK_BATCH];
    uint32_t count;
};

/* As spc_normal_decode. */
SPB_VECTORS static void decode_normals(const uint16_t *code, double n[3][PACK_BATCH], uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        const int u = (code[i] & 0xFF) - 127, v = (code[i] >> 8) - 127;
        const int au = u < 0 ? -u : u, av = v < 0 ? -v : v;
        const int z = 127 - au - av;
        const int fx = u < 0 ? av - 127 : 127 - av, fy = v < 0 ? au - 127 : 127 - au;
        const int x = z >= 0 ? u : fx, y = z >= 0 ? v : fy;
        const double length = sqrt((double)(x * x + y * y + z * z));
        n[0][i] = x / length;
        n[1][i] = y / length;
        n[2][i] = z / length;
    }
}

void pack_normals_sum(const uint16_t *normals, uint32_t count, double sum[3])
{
    double n[3][PACK_BATCH];
    sum[0] = sum[1] = sum[2] = 0;
    for (uint32_t first = 0; first < count; first += PACK_BATCH) {
        const uint32_t m = count - first < PACK_BATCH ? count - first : PACK_BATCH;
        decode_normals(normals + first, n, m);
        for (uint32_t i = 0; i < m; i++)
            for (int a = 0; a < 3; a++)
                sum[a] += n[a][i];
    }
}

void pack_cone_axis(const double sum[3], float cone[3], double axis[3])
{
    const double length = vec_length(sum);
    for (int a = 0; a < 3; a++) {
        /* GCC 12 makes vectors of this and takes the way to float and back for nothing */
        volatile float rounded = length > 0 ? (float)(sum[a] / length) : (float)(a == 2);
        cone[a] = rounded;
        axis[a] = (double)cone[a];
    }
    vec_scale(axis, 1 / vec_length(axis), axis);
}

/*
 * Cosine of the cone about an axis that holds a cone: of the sum of the angle between axis and normal,
 * whose cosine is dot, and the cone's half angle. -1 for every direction.
 */
SPB_INLINE double joined(double dot, double b)
{
    const double below = dot < 1 ? dot : 1;
    const double a = below > -1 ? below : -1;
    const double both = a * b - sqrt(1 - a * a) * sqrt(1 - b * b) - 1e-7;
    const double cosine = both > -1 ? both : -1;
    return a <= -b ? -1 : cosine;   /* past 180 degrees */
}

SPB_VECTORS static void join(struct batch *t, const double axis[3])
{
    const double x = axis[0], y = axis[1], z = axis[2];
    for (uint32_t i = 0; i < t->count; i++)
        t->about_axis[i] = joined(x * t->n[0][i] + y * t->n[1][i] + z * t->n[2][i],
                                  (double)t->cone[i]);
    for (uint32_t i = 0; i < t->count; i++)
        t->about_group[i] = joined(t->axis[0][i] * t->n[0][i] + t->axis[1][i] * t->n[1][i] +
                                   t->axis[2][i] * t->n[2][i], (double)t->cone[i]);
}

static void flush(struct pack *p, struct batch *t, double *cosine)
{
    decode_normals(t->normal, t->n, t->count);
    join(t, p->axis);
    for (uint32_t i = 0; i < t->count; i++) {
        p->cosine = smaller_of(p->cosine, t->about_axis[i]);
        cosine[t->group[i]] = smaller_of(cosine[t->group[i]], t->about_group[i]);
    }
    t->count = 0;
}

void pack_cones(struct pack *p, const struct pack_block *b, double cosine[SPC_NORMAL_CLUSTERS_MAX])
{
    const struct pack_kind *s = &p->kind[b->kind];
    struct batch t = {.count = 0};
    for (uint32_t g = 0; g < SPC_NORMAL_CLUSTERS_MAX; g++)
        cosine[g] = 1;
    for (uint32_t f = 0; f < b->family_count; f++) {
        const struct pack_family *family = pack_family_of(p, b, f);
        if (t.count + family->count > PACK_BATCH)
            flush(p, &t, cosine);
        for (uint32_t i = family->first; i < family->first + family->count; i++, t.count++) {
            t.normal[t.count] = s->normal[i];
            t.cone[t.count] = s->cone[i];
            t.group[t.count] = (uint8_t)family->group;
            for (int a = 0; a < 3; a++)
                t.axis[a][t.count] = p->shared->axis[family->group][a];
        }
    }
    flush(p, &t, cosine);
}
