/*
 * gen_shapes.h - the surfaces of gen_scan.c; included once, by it, so that one command compiles all.
 *
 * A shape is three functions: plan() sets the counts, vertex() and face() give any vertex and any face
 * by its number. Numbers are 32 bit because a PLY index is; counts are 64 bit.
 */
#ifndef GEN_SHAPES_H
#define GEN_SHAPES_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

/*
 * Each noise has its own seed and remembers one cell, since neighbours in the mesh mostly ask for the
 * same. So one noise serves one purpose: two that took turns would evict each other's cell.
 */
enum { N_STONE = 0, N_CHIP = 4, N_FOLD, N_FOLD2, N_HAIRLINE, N_HAIR, N_LOCK = N_HAIR + 2, N_STRATA = N_LOCK + 2,
       N_STAIN, N_LICHEN = N_STAIN + 2, N_SPECK = N_LICHEN + 2, N_WARP, N_RIVER = N_WARP + 2,
       N_LAND, NOISE_COUNT = N_LAND + 8 };
enum { LAND_OCTAVES = 8, LAND_SLOPE_OCTAVES = 3 };

struct noise { uint32_t seed; int32_t cell[3]; double c[8]; };  /* c: of 1 u v uv w uw vw uvw */

enum { R_Z, R_RX, R_RY, R_CY, R_TILT, R_SQUARE, R_COUNT };
struct row { double v[R_COUNT], d[R_COUNT]; };          /* a profile's values and their slopes */

struct vertex { double p[3]; uint8_t rgb[3]; };

struct gen;
struct shape {
    const char *name;
    void (*plan)(struct gen *g);
    void (*vertex)(struct gen *g, uint32_t id, struct vertex *out);
    void (*face)(const struct gen *g, uint32_t quad, uint32_t half, uint32_t out[3]);
    double extent;                                      /* no coordinate is larger */
};

struct gen {
    uint64_t triangles, seed;                           /* as asked for */
    const struct shape *shape;
    bool color;

    uint64_t vertex_count, face_count;
    uint64_t m, h;                                      /* cells across and up; columns and rows of a grid */
    double step;                                        /* typical edge, object units */
    uint64_t key;
    struct noise noise[NOISE_COUNT];
    uint32_t row_k;                                     /* the row that is cached */
    struct row row;
};

/* ---- numbers ------------------------------------------------------------------------------------ */

static uint64_t mix64(uint64_t x)
{
    x += 0x9e3779b97f4a7c15u;
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
    x = (x ^ x >> 27) * 0x94d049bb133111ebu;
    return x ^ x >> 31;
}

static double signed21(uint64_t bits)                   /* the low 21 bits, to [-1, 1) */
{
    return (double)(int64_t)(bits & 0x1fffff) / 1048576.0 - 1.0;
}

static double clamp01(double x) { return x < 0 ? 0 : x > 1 ? 1 : x; }

/* from and to may come in either order */
static inline double smoothstep(double from, double to, double x)
{
    const double t = clamp01((x - from) * (1 / (to - from)));
    return t * t * (3 - 2 * t);
}

static double mixd(double a, double b, double t) { return a + (b - a) * t; }

static inline double ease(double t) { return t * t * (3 - 2 * t); }

static uint32_t lattice_hash(uint32_t h)
{
    h = (h ^ h >> 16) * 0x7feb352du;
    h = (h ^ h >> 15) * 0x846ca68bu;
    return h ^ h >> 16;
}

static void noise_enter(struct noise *n, int32_t x, int32_t y, int32_t z)
{
    const uint32_t kx = 0x8da6b343u, ky = 0xd8163841u, kz = 0xcb1ab31fu;
    const uint32_t at = n->seed + (uint32_t)x * kx + (uint32_t)y * ky + (uint32_t)z * kz;
    const uint32_t step[8] = { 0, kx, ky, kx + ky, kz, kx + kz, ky + kz, kx + ky + kz };
    double v[8];
    for (int i = 0; i < 8; i++)
        v[i] = (double)(int32_t)lattice_hash(at + step[i]) / 2147483648.0;
    for (int bit = 1; bit < 8; bit *= 2)                /* corner values to coefficients */
        for (int i = 0; i < 8; i++)
            v[i] -= i & bit ? v[i - bit] : 0;
    memcpy(n->c, v, sizeof v);
    n->cell[0] = x;
    n->cell[1] = y;
    n->cell[2] = z;
}

/* Value noise in [-1, 1]; |coordinates| stay far below 2^20. */
static inline double noise3(struct noise *n, double x, double y, double z)
{
    const double big = 1048576.0;                       /* makes truncation a floor */
    const int32_t ix = (int32_t)(x + big), iy = (int32_t)(y + big), iz = (int32_t)(z + big);
    if (ix != n->cell[0] || iy != n->cell[1] || iz != n->cell[2])
        noise_enter(n, ix, iy, iz);
    const double *c = n->c;
    const double u = ease(x + big - ix), v = ease(y + big - iy), w = ease(z + big - iz);
    return (c[0] + u * c[1]) + v * (c[2] + u * c[3]) + w * ((c[4] + u * c[5]) + v * (c[6] + u * c[7]));
}

/* Turns and scales between octaves, so that lattices do not line up. */
static inline void next_octave(double q[3], double by)
{
    const double x = q[0], y = q[1], z = q[2];
    q[0] = by * (0.80 * y + 0.60 * z);
    q[1] = by * (-0.80 * x + 0.36 * y - 0.48 * z);
    q[2] = by * (-0.60 * x - 0.48 * y + 0.64 * z);
}

static double fbm(struct noise *n, int octaves, double x, double y, double z)
{
    double q[3] = { x, y, z }, sum = 0, amp = 0.5;
    for (int i = 0; i < octaves; i++, amp *= 0.5) {
        sum += amp * noise3(&n[i], q[0], q[1], q[2]);
        next_octave(q, 2.03);
    }
    return sum;
}

/* A wave of period 1 in [0, 1], smooth crests, narrower valleys: a fold of cloth. */
static double fold_wave(double x)
{
    const double f = x + 1024 - (double)(int32_t)(x + 1024), t = 2 * f - 1;
    return 1 - t * t * t * t;
}

static double sqrt_round(double x) { return (double)(uint64_t)(sqrt(x) + 0.5); }

/* ---- the box topology of closed shapes ---------------------------------------------------------- */

static void box_plan(struct gen *g, double m)
{
    g->m = m < 1 ? 1 : (uint64_t)m;
    const uint64_t caps = 4 * g->m * g->m, ring = 8 * g->m;
    g->h = g->triangles <= caps + ring ? 1 : (g->triangles - caps + ring - 1) / ring;
    g->face_count = caps + ring * g->h;
    g->vertex_count = g->face_count / 2 + 2;            /* Euler, a closed surface without handles */
}

/* Vertex numbers: bottom inside, rings from bottom to top, top inside. */
struct spot { int part; uint32_t i, j; };               /* part -1, 0, +1; side: column i, ring j */

static struct spot box_spot(const struct gen *g, uint32_t id)
{
    const uint32_t m = (uint32_t)g->m, inside = (m - 1) * (m - 1), rings = 4 * m * ((uint32_t)g->h + 1);
    if (id >= inside && id - inside < rings)
        return (struct spot){ 0, (id - inside) % (4 * m), (id - inside) / (4 * m) };
    const int part = id < inside ? -1 : 1;
    const uint32_t at = part < 0 ? id : id - inside - rings;
    return (struct spot){ part, 1 + at % (m - 1), 1 + at / (m - 1) };
}

static uint32_t cap_vertex(const struct gen *g, bool top, uint32_t i, uint32_t j)
{
    const uint32_t m = (uint32_t)g->m, h = (uint32_t)g->h, inside = (m - 1) * (m - 1);
    const uint32_t ring = inside + (top ? 4 * m * h : 0);
    if (j == 0)
        return ring + i;
    if (i == m)
        return ring + m + j;
    if (j == m)
        return ring + 3 * m - i;
    if (i == 0)
        return ring + 4 * m - j;
    return (top ? inside + 4 * m * (h + 1) : 0) + (j - 1) * (m - 1) + (i - 1);
}

/* Half of the quad q[0..3], which is counter-clockwise; either diagonal, by chance. */
static void half_quad(const struct gen *g, uint32_t quad, uint32_t half, const uint32_t q[4], uint32_t out[3])
{
    const uint32_t turn = (quad * 0x9e3779b1u ^ (uint32_t)g->key) * 0x85ebca6bu >> 31;
    out[0] = q[turn];
    out[1] = q[turn + 1 + half];
    out[2] = q[(turn + 2 + half) & 3];
}

static void box_face(const struct gen *g, uint32_t quad, uint32_t half, uint32_t out[3])
{
    const uint32_t m = (uint32_t)g->m, h = (uint32_t)g->h, cap = m * m, side = 4 * m * h;
    if (quad >= cap && quad - cap < side) {
        const uint32_t k = (quad - cap) / (4 * m), c = (quad - cap) % (4 * m), c1 = c + 1 == 4 * m ? 0 : c + 1;
        const uint32_t at = (m - 1) * (m - 1) + k * 4 * m, up = at + 4 * m;
        half_quad(g, quad, half, (uint32_t[4]){ at + c, at + c1, up + c1, up + c }, out);
        return;
    }
    const bool top = quad >= cap;
    const uint32_t at = top ? quad - cap - side : quad, i = at % m, j = at / m;
    const uint32_t a = cap_vertex(g, top, i, j), b = cap_vertex(g, top, i + 1, j);
    const uint32_t c = cap_vertex(g, top, i + 1, j + 1), d = cap_vertex(g, top, i, j + 1);
    half_quad(g, quad, half, top ? (uint32_t[4]){ a, b, c, d } : (uint32_t[4]){ a, d, c, b }, out);
}

/* About tan(pi/4 x), exact at -1, 0, 1: makes equal steps along a box edge nearly equal angles. */
static double even_angle(double x)
{
    const double a = 0.785398, b = 0.161491, xx = x * x;
    return x * (a + xx * (b + xx * (1 - a - b)));
}

/* c, the column over m (0 to 4, and jitter), to a point on the square [-1, 1]^2, counter-clockwise from -x -y. */
static void square_point(double c, double out[2])
{
    const double e = c < 0 ? c + 4 : c;
    const int side = e < 1 ? 0 : e < 2 ? 1 : e < 3 ? 2 : 3;
    const double w = 2 * (e - side) - 1;
    out[0] = side == 0 ? w : side == 1 ? 1 : side == 2 ? -w : -1;
    out[1] = side == 0 ? -1 : side == 1 ? w : side == 2 ? 1 : -w;
}

static void square_direction(double a, double b, double out[2])
{
    const double x = even_angle(a), y = even_angle(b), f = 1 / sqrt(x * x + y * y);
    out[0] = x * f;
    out[1] = y * f;
}

/* ---- colour ------------------------------------------------------------------------------------- */

static void tint(double c[3], double r, double g, double b, double t)
{
    c[0] = mixd(c[0], r, t);
    c[1] = mixd(c[1], g, t);
    c[2] = mixd(c[2], b, t);
}

static void store_rgb(struct vertex *v, const double c[3], double light)
{
    for (int i = 0; i < 3; i++)
        v->rgb[i] = (uint8_t)(clamp01(c[i] * light / 255) * 255 + 0.5);
}

/* Weathered stone: strata with thin dark seams, rain streaks, lichen, grain; hollow > 0 is dirtier. */
static void stone_color(struct gen *g, const double p[3], double hollow, struct vertex *v)
{
    double c[3] = { 216, 206, 188 };
    const double s = p[2] * 4.5 + p[0] * 0.6 + 0.8 * noise3(&g->noise[N_STRATA], p[0] * 2, p[1] * 2, p[2] * 2);
    const double band = fold_wave(s), seam = 1 - clamp01(fold_wave(s * 0.5) * 8);
    const double rain = fbm(&g->noise[N_STAIN], 2, p[0] * 13, p[1] * 13, p[2] * 2.2);
    const double moss = fbm(&g->noise[N_LICHEN], 2, p[0] * 8, p[1] * 8, p[2] * 8);
    tint(c, 196, 166, 128, 0.55 * band);
    tint(c, 104, 84, 66, 0.8 * seam);
    tint(c, 92, 92, 84, 0.6 * smoothstep(0.08, 0.4, rain));
    tint(c, 138, 140, 66, 0.75 * smoothstep(0.26, 0.34, moss));
    tint(c, 60, 54, 46, 0.6 * clamp01(hollow));
    store_rgb(v, c, 1 + 0.07 * noise3(&g->noise[N_SPECK], p[0] * 160, p[1] * 160, p[2] * 160));
}

#include "gen_statue.h"

/* ---- sphere ------------------------------------------------------------------------------------- */

static void sphere_plan(struct gen *g)
{
    box_plan(g, sqrt_round((double)g->triangles / 12));
}

static void sphere_vertex(struct gen *g, uint32_t id, struct vertex *out)
{
    const struct spot at = box_spot(g, id);
    const double m = (double)g->m;
    double q[3] = { 2 * at.i / m - 1, 2 * at.j / m - 1, at.part };
    if (at.part == 0) {
        square_point(at.i / m, q);
        q[2] = 2 * at.j / (double)g->h - 1;
    }
    for (int i = 0; i < 3; i++)
        out->p[i] = even_angle(q[i]);
    unit(out->p);
    if (g->color)
        stone_color(g, out->p, 0, out);
}

/* ---- open grids: plane, terrain ----------------------------------------------------------------- */

static void grid_plan(struct gen *g)
{
    const double m = sqrt_round((double)g->triangles / 2);
    g->m = m < 1 ? 1 : (uint64_t)m;
    g->h = (g->triangles + 2 * g->m - 1) / (2 * g->m);
    g->face_count = 2 * g->m * g->h;
    g->vertex_count = (g->m + 1) * (g->h + 1);
}

static void grid_face(const struct gen *g, uint32_t quad, uint32_t half, uint32_t out[3])
{
    const uint32_t m = (uint32_t)g->m, at = quad / m * (m + 1) + quad % m, up = at + m + 1;
    half_quad(g, quad, half, (uint32_t[4]){ at, at + 1, up + 1, up }, out);
}

static void plane_vertex(struct gen *g, uint32_t id, struct vertex *out)
{
    const uint32_t m = (uint32_t)g->m, i = id % (m + 1), j = id / (m + 1);
    out->p[0] = 2.0 * i / m - 1;
    out->p[1] = 2.0 * j / (double)g->h - 1;
    out->p[2] = 0;
    if (g->color)
        stone_color(g, (double[3]){ out->p[0], 0.3, out->p[1] }, 0, out);
}

/* Ridges that feed on each other; x, y and the height in units of the map. */
static double ridges(struct gen *g, double x, double y, const double warp[2], int octaves)
{
    double q[3] = { x * 4 + 0.4 * warp[0], y * 4 + 0.4 * warp[1], 0.37 }, sum = 0, amp = 0.55, feed = 1;
    for (int i = 0; i < octaves; i++, amp *= 0.46) {
        const double n = 1 - fabs(noise3(&g->noise[N_LAND + i], q[0], q[1], q[2])), r = n * n;
        sum += r * amp * feed;
        feed = clamp01(r * 1.4);
        next_octave(q, 2.03);
    }
    return 0.20 * sum;
}

static void land_color(struct gen *g, double x, double y, double z, double valley, double river, const double warp[2],
                       struct vertex *out)
{
    const double e = 0.003, z0 = ridges(g, x, y, warp, LAND_SLOPE_OCTAVES);
    const double sx = (ridges(g, x + e, y, warp, LAND_SLOPE_OCTAVES) - z0) / e;
    const double sy = (ridges(g, x, y + e, warp, LAND_SLOPE_OCTAVES) - z0) / e;
    const double slope = sqrt(sx * sx + sy * sy) * valley;
    const double patch = noise3(&g->noise[N_LICHEN], x * 60, y * 60, 1);
    const double grain = noise3(&g->noise[N_SPECK], x * 900, y * 900, 1);
    double c[3] = { 104, 128, 66 };
    tint(c, 164, 152, 88, smoothstep(-0.1, 0.1, patch) * smoothstep(0.06, 0.02, z));    /* fields */
    tint(c, 62, 92, 50, smoothstep(0.03, 0.06, z + 0.008 * patch));                     /* woods */
    tint(c, 138, 128, 114, smoothstep(0.5, 0.9, slope + 0.15 * grain));                 /* rock */
    tint(c, 240, 242, 246, smoothstep(0.105, 0.115, z + 0.006 * patch) * smoothstep(1.2, 0.8, slope));
    tint(c, 70, 104, 122, smoothstep(0.4, 0.6, river));                                 /* water */
    store_rgb(out, c, 1 + 0.06 * grain);
}

static void land_vertex(struct gen *g, uint32_t id, struct vertex *out)
{
    const double map = 1000;
    const uint32_t m = (uint32_t)g->m, i = id % (m + 1), j = id / (m + 1);
    const uint64_t r = mix64(id ^ g->key);
    const double x = (i + 0.2 * signed21(r)) / m, y = (j + 0.2 * signed21(r >> 21)) / (double)g->h;
    const double fuzz = 0.03 / (m < 1000 ? 1000 : m) * signed21(r >> 42);
    const double warp[2] = { noise3(&g->noise[N_WARP], x * 3, y * 3, 0.5),
                             noise3(&g->noise[N_WARP + 1], x * 3, y * 3, 0.5) };
    const double bed = fabs(x - 0.5 - 0.22 * noise3(&g->noise[N_RIVER], 0.5, y * 2.5, 0.5) - 0.02 * warp[0]);
    const double valley = 0.12 + 0.88 * smoothstep(0.01, 0.30, bed);
    const double river = smoothstep(0.02, 0.006, bed);
    const double z = ridges(g, x, y, warp, LAND_OCTAVES) * valley - 0.012 * river + fuzz;
    out->p[0] = x * map;
    out->p[1] = y * map;
    out->p[2] = z * map;
    if (g->color)
        land_color(g, x, y, z, valley, river, warp, out);
}

/* ---- soup --------------------------------------------------------------------------------------- */

static void soup_plan(struct gen *g)
{
    const double n = (double)g->triangles;
    double root = n;
    for (int i = 0; i < 100; i++)                       /* Newton: cbrt differs between libms */
        root = (2 * root + n / (root * root)) / 3;
    g->step = root < 8 ? 0.125 : 1 / root;
    g->face_count = g->triangles;
    g->vertex_count = 3 * g->triangles;
}

/* Of 100 triangles 1 is a point, 1 has two equal corners, 2 lie on a line, 10 are needles. */
static void soup_vertex(struct gen *g, uint32_t id, struct vertex *out)
{
    const uint32_t triangle = id / 3, corner = id % 3;
    const uint64_t at = mix64(triangle ^ g->key), how = mix64(at), away = mix64(at + corner + 1);
    const uint32_t kind = (uint32_t)(how % 100), axis = (uint32_t)(how >> 32) % 3;
    const double size = g->step * (0.6 + 0.4 * signed21(how >> 40));
    for (uint32_t i = 0; i < 3; i++) {
        double d = signed21(away >> 21 * i);
        if (kind == 0 || (kind == 1 && corner == 0) || (kind < 4 && kind > 1 && i != axis))
            d = 0;
        else if (kind == 1)
            d = signed21(how >> 21 * i);
        else if (kind >= 4 && kind < 14)
            d = signed21(how >> 21 * i) * (corner == 0 ? -1 : 1) + 0.001 * d;
        out->p[i] = (1 - 1.1 * g->step) * signed21(at >> 21 * i) + size * d;
    }
    const double c[3] = { 150 + 90 * out->p[0], 150 + 90 * out->p[1], 150 + 90 * out->p[2] };
    if (g->color)
        store_rgb(out, c, 1 + 0.3 * signed21(how >> 13));
}

static void soup_face(const struct gen *g, uint32_t quad, uint32_t half, uint32_t out[3])
{
    (void)g;
    for (uint32_t i = 0; i < 3; i++)
        out[i] = 3 * (2 * quad + half) + i;
}

static const struct shape shapes[] = {                  /* the first is the default */
    { "statue", statue_plan, statue_vertex, box_face, 4 },
    { "terrain", grid_plan, land_vertex, grid_face, 2000 },
    { "sphere", sphere_plan, sphere_vertex, box_face, 1 },
    { "soup", soup_plan, soup_vertex, soup_face, 1 },
    { "plane", grid_plan, plane_vertex, grid_face, 1 },
};

#endif
