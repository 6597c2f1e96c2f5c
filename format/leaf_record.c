/*
 * leaf_record.c - see leaf_record.h. The operations and their order are part of the format.
 *
 * Loops without branches, a few values at a time, so that the compiler makes vectors of them; no
 * fused operations, so every machine gets the same bytes.
 */
#include "leaf_record.h"

#include "bytes.h"
#include "layout.h"

#include <math.h>

#if defined(__x86_64__) && defined(__GLIBC__) && !defined(__clang__) &&                     \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define VECTORS __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define VECTORS
#endif

enum { SHIFT_MAX = 36 };            /* position step over lattice step: 16 + 36 bits are exact */
static const double OUTWARD = 1 + 0x1p-40;          /* far above the roundings below */

bool leaf_frame_init(struct leaf_frame *f, const double origin[3], int step_exp, int vertex_exp,
                     int unit_exp)
{
    const int shift = step_exp - vertex_exp;
    if (shift < 0 || shift > SHIFT_MAX)
        return false;
    f->step = ldexp(1, shift);
    f->scale = ldexp(1, vertex_exp - unit_exp);
    for (int a = 0; a < 3; a++) {
        const double number = ldexp(origin[a], -vertex_exp);
        if (!(fabs(number) <= 0x1p53) || floor(number) != number)
            return false;
        f->origin[a] = (int64_t)number;
    }
    return true;
}

struct work {                       /* per triangle, from step to step */
    double corner[3][3][LEAF_BATCH];            /* the smallest corner first */
    double edge[2][3][LEAF_BATCH];              /* corners 1 and 2 from corner 0 */
    double longest[LEAF_BATCH];                 /* squared */
    double center[3][LEAF_BATCH];               /* on the block's lattice, from the origin */
    double far[LEAF_BATCH];                     /* from there to the farthest corner */
};

static inline double larger(double a, double b)
{
    return a > b ? a : b;
}

/* Turned so that the corner with the smallest x, then y, then z comes first: of equals, the last. */
VECTORS static void turn(const struct leaf_batch *b, struct work *w, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        const double x0 = b->corner[0][0][i], x1 = b->corner[1][0][i], x2 = b->corner[2][0][i];
        const double y0 = b->corner[0][1][i], y1 = b->corner[1][1][i], y2 = b->corner[2][1][i];
        const double z0 = b->corner[0][2][i], z1 = b->corner[1][2][i], z2 = b->corner[2][2][i];
        const bool below10 = (x1 < x0) | ((x1 == x0) & ((y1 < y0) | ((y1 == y0) & (z1 < z0))));
        const double mx = below10 ? x1 : x0, my = below10 ? y1 : y0, mz = below10 ? z1 : z0;
        const bool second = (x2 < mx) | ((x2 == mx) & ((y2 < my) | ((y2 == my) & (z2 < mz))));
        const bool first = below10 & !second;
        w->corner[0][0][i] = second ? x2 : first ? x1 : x0;
        w->corner[1][0][i] = second ? x0 : first ? x2 : x1;
        w->corner[2][0][i] = second ? x1 : first ? x0 : x2;
        w->corner[0][1][i] = second ? y2 : first ? y1 : y0;
        w->corner[1][1][i] = second ? y0 : first ? y2 : y1;
        w->corner[2][1][i] = second ? y1 : first ? y0 : y2;
        w->corner[0][2][i] = second ? z2 : first ? z1 : z0;
        w->corner[1][2][i] = second ? z0 : first ? z2 : z1;
        w->corner[2][2][i] = second ? z1 : first ? z0 : z2;
    }
    for (int a = 0; a < 3; a++)
        for (uint32_t i = 0; i < n; i++) {
            w->edge[0][a][i] = w->corner[1][a][i] - w->corner[0][a][i];
            w->edge[1][a][i] = w->corner[2][a][i] - w->corner[0][a][i];
        }
}

/*
 * Centre of the smallest circle around the triangle: the circumcentre of an acute one, else the
 * middle of the longest edge; then the nearest lattice vertex, then the block's lattice.
 */
VECTORS static void find_center(const struct leaf_frame *f, struct work *w, struct leaf_batch *b,
                                uint32_t n)
{
    const double step = f->step, per_step = 1 / f->step;
    double first[LEAF_BATCH], second[LEAF_BATCH];   /* weights of the edges */
    for (uint32_t i = 0; i < n; i++) {
        const double ax = w->edge[0][0][i], ay = w->edge[0][1][i], az = w->edge[0][2][i];
        const double bx = w->edge[1][0][i], by = w->edge[1][1][i], bz = w->edge[1][2][i];
        const double cx = bx - ax, cy = by - ay, cz = bz - az;
        const double s0 = cx * cx + cy * cy + cz * cz;
        const double s1 = bx * bx + by * by + bz * bz;
        const double s2 = ax * ax + ay * ay + az * az;
        const double most = larger(s0, larger(s1, s2));
        const double w0 = s0 * (s1 + s2 - s0), w1 = s1 * (s0 + s2 - s1), w2 = s2 * (s0 + s1 - s2);
        const bool acute = most < s0 + s1 + s2 - most;
        const bool is0 = s0 == most, is1 = !is0 & (s1 == most);
        const double sum = acute ? w0 + w1 + w2 : 1;
        const double plain1 = is1 ? 0 : 0.5, plain2 = (is0 | is1) ? 0.5 : 0;
        first[i] = (acute ? w1 : plain1) / sum;
        second[i] = (acute ? w2 : plain2) / sum;
        w->longest[i] = most;
    }
    for (int a = 0; a < 3; a++)
        for (uint32_t i = 0; i < n; i++) {
            const double off = first[i] * w->edge[0][a][i] + second[i] * w->edge[1][a][i];
            const double at = w->corner[0][a][i] + floor(off + 0.5);
            const double q = floor(at * per_step + 0.5);
            const bool fits = (q >= 0) & (q <= 65535);
            b->position[a][i] = (int32_t)(fits ? q : -1);
            w->center[a][i] = q * step;
        }
    for (uint32_t i = 0; i < n; i++) {
        double most = 0;
        for (int k = 0; k < 3; k++) {
            const double x = w->corner[k][0][i] - w->center[0][i];
            const double y = w->corner[k][1][i] - w->center[1][i];
            const double z = w->corner[k][2][i] - w->center[2][i];
            most = larger(most, x * x + y * y + z * z);
        }
        w->far[i] = sqrt(most);
    }
}

/* Smallest length codes whose values are >= v >= 0, as spc_len_encode_up. */
VECTORS static void length_codes(const double *v, int32_t *code, uint32_t n)
{
    const double least = 0x1p-126, most = 0x1.fep127;
    double kept[LEAF_BATCH];
    float nearest[LEAF_BATCH], value[LEAF_BATCH];
    int32_t bits[LEAF_BATCH];
    for (uint32_t i = 0; i < n; i++) {
        const double low = v[i] < least ? least : v[i];
        kept[i] = low > most ? most : low;
        nearest[i] = (float)kept[i];
    }
    memcpy(bits, nearest, n * sizeof *bits);
    for (uint32_t i = 0; i < n; i++)
        bits[i] = bits[i] >> 15 << 15;
    memcpy(value, bits, n * sizeof *bits);
    for (uint32_t i = 0; i < n; i++) {
        const int32_t up = (double)value[i] < kept[i] ? 1 : 0;
        code[i] = v[i] > 0 ? (bits[i] >> 15) + up : 0;
    }
}

VECTORS static void find_lengths(const struct leaf_frame *f, const struct work *w,
                                 struct leaf_batch *b, uint32_t n)
{
    const double scale = f->scale, coarse = 8 * f->step;
    double v[LEAF_BATCH] = {0};
    for (uint32_t i = 0; i < n; i++)
        v[i] = w->far[i] * scale * OUTWARD;
    length_codes(v, b->radius, n);
    for (uint32_t i = 0; i < n; i++)
        v[i] = sqrt(w->longest[i]) * scale * OUTWARD;
    length_codes(v, b->e_self, n);
    for (uint32_t i = 0; i < n; i++) {
        const int32_t least = b->radius[i] > 0 ? b->radius[i] + 256 : 0;
        const int32_t twice = coarse > w->far[i] ? least : 0;   /* moved far for its size */
        b->e_self[i] = twice > b->e_self[i] ? twice : b->e_self[i];
    }
}

VECTORS static void find_normals(const struct leaf_frame *f, const struct work *w,
                                 struct leaf_batch *b, uint32_t n)
{
    double slab[LEAF_BATCH];
    for (uint32_t i = 0; i < n; i++) {
        const double ax = w->edge[0][0][i], ay = w->edge[0][1][i], az = w->edge[0][2][i];
        const double bx = w->edge[1][0][i], by = w->edge[1][1][i], bz = w->edge[1][2][i];
        const double nx = ay * bz - az * by, ny = az * bx - ax * bz, nz = ax * by - ay * bx;
        const double sum = fabs(nx) + fabs(ny) + fabs(nz);
        const double per = sum > 0 ? 1 / sum : 0;
        const double u = nx * per, v = ny * per;
        const double fu = (1 - fabs(v)) * (u < 0 ? -1 : 1), fv = (1 - fabs(u)) * (v < 0 ? -1 : 1);
        const double cu = floor((nz < 0 ? fu : u) * 127 + 0.5);
        const double cv = floor((nz < 0 ? fv : v) * 127 + 0.5);
        b->normal[0][i] = (int32_t)cu + 127;
        b->normal[1][i] = (int32_t)cv + 127;
        /* the vector that the code stands for */
        const double z = 127 - fabs(cu) - fabs(cv);
        const double x = z >= 0 ? cu : (127 - fabs(cv)) * (cu < 0 ? -1 : 1);
        const double y = z >= 0 ? cv : (127 - fabs(cu)) * (cv < 0 ? -1 : 1);
        double most = 0;
        for (int k = 0; k < 3; k++)
            most = larger(most, fabs((w->corner[k][0][i] - w->center[0][i]) * x +
                                     (w->corner[k][1][i] - w->center[1][i]) * y +
                                     (w->corner[k][2][i] - w->center[2][i]) * z));
        slab[i] = most / sqrt(x * x + y * y + z * z);
    }
    int32_t bits[LEAF_BATCH];
    float value[LEAF_BATCH];
    for (uint32_t i = 0; i < n; i++)
        bits[i] = b->radius[i] << 15;
    memcpy(value, bits, n * sizeof *bits);
    for (uint32_t i = 0; i < n; i++) {
        const double radius = (double)value[i];
        const double h = slab[i] * f->scale * OUTWARD + radius * 0x1p-40;
        const double divisor = radius > 0 ? radius : 1;
        const double short_by = floor(h / divisor * 256) - 1;   /* one or two short */
        const double low = short_by < 0 ? 0 : short_by;
        double code = low > 255 ? 255 : low;
        code += radius * (code + 1) / 256 < h ? 1 : 0;
        code += radius * (code + 1) / 256 < h ? 1 : 0;
        b->height[i] = (int32_t)(code > 255 ? 255 : code);
    }
}

void leaf_batch_run(const struct leaf_frame *f, struct leaf_batch *b, uint32_t n)
{
    struct work w;
    turn(b, &w, n);
    find_center(f, &w, b, n);
    find_lengths(f, &w, b, n);
    find_normals(f, &w, b, n);
}

bool leaf_batch_store(const struct leaf_batch *b, uint32_t i, uint8_t *record)
{
    for (int a = 0; a < 3; a++)
        store_u16(record + ND_X + 2 * a, (uint16_t)b->position[a][i]);
    for (int k = 0; k < 2; k++)
        record[ND_NORMAL + k] = (uint8_t)b->normal[k][i];
    store_u16(record + ND_E_SELF, (uint16_t)b->e_self[i]);
    store_u16(record + ND_RADIUS, (uint16_t)b->radius[i]);
    record[ND_HEIGHT] = (uint8_t)b->height[i];
    return (b->position[0][i] | b->position[1][i] | b->position[2][i]) >= 0;
}

bool spc_leaf_record(const struct spc_frame *frame, int step_exp, const int64_t corner[3][3],
                     uint8_t *record)
{
    struct leaf_frame f;
    struct leaf_batch b;
    if (!leaf_frame_init(&f, frame->origin, step_exp, frame->vertex_exp, frame->unit_exp))
        return false;
    for (int k = 0; k < 3; k++)
        for (int a = 0; a < 3; a++)
            b.corner[k][a][0] = (double)(corner[k][a] - f.origin[a]);
    leaf_batch_run(&f, &b, 1);
    return leaf_batch_store(&b, 0, record);
}
