/*
 * gen_statue.h - the statue of gen_scan.c; included once, by gen_shapes.h.
 *
 * A profile swept around z (plinth, mouldings, a draped bust, neck, head), rows closer together on the
 * head, then carved: cloth, hair and weather along the normal, the face by strokes that push what lies
 * in an ellipsoid. All of it is a function of the place on the smooth body, so order does not matter.
 */
#ifndef GEN_STATUE_H
#define GEN_STATUE_H

struct knot { double v[R_COUNT], density; };            /* density: rows per length up to the next knot */

static const struct knot profile[] = {
    { { 0.000, .360, .360, 0, 0, 1 }, 1.0 },            /* plinth */
    { { 0.140, .360, .360, 0, 0, 1 }, 1.5 },
    { { 0.150, .350, .350, 0, 0, 1 }, 1.0 },
    { { 0.154, .300, .300, 0, 0, .5 }, 1.0 },
    { { 0.160, .272, .272, 0, 0, 0 }, 1.3 },            /* torus, hollow, torus */
    { { 0.190, .292, .292, 0, 0, 0 }, 1.3 },
    { { 0.222, .272, .272, 0, 0, 0 }, 1.3 },
    { { 0.230, .245, .245, 0, 0, 0 }, 1.0 },
    { { 0.260, .200, .200, 0, 0, 0 }, 1.0 },
    { { 0.330, .172, .172, 0, 0, 0 }, 1.0 },
    { { 0.385, .180, .180, 0, 0, 0 }, 1.3 },
    { { 0.400, .212, .212, 0, 0, 0 }, 1.3 },
    { { 0.422, .222, .222, 0, 0, 0 }, 1.3 },
    { { 0.444, .210, .210, 0, 0, 0 }, 1.0 },
    { { 0.455, .165, .165, 0, 0, 0 }, 1.0 },
    { { 0.480, .180, .150, 0, 0, 0 }, 1.0 },            /* cut of the bust */
    { { 0.580, .310, .195, 0, 0, 0 }, 1.2 },
    { { 0.730, .420, .228, 0, 0, 0 }, 1.2 },
    { { 0.880, .465, .225, .02, 0, 0 }, 1.2 },
    { { 0.985, .450, .200, .03, 0, 0 }, 1.2 },          /* shoulders */
    { { 1.060, .390, .172, .04, .05, 0 }, 1.2 },
    { { 1.105, .285, .150, .04, .10, 0 }, 1.3 },
    { { 1.145, .180, .138, .035, .15, 0 }, 1.4 },
    { { 1.210, .132, .134, .025, .15, 0 }, 1.5 },       /* neck */
    { { 1.310, .122, .130, .015, .20, 0 }, 1.6 },
    { { 1.375, .128, .145, .000, .30, 0 }, 1.8 },
    { { 1.412, .148, .186, -.025, .32, 0 }, 2.0 },      /* jaw */
    { { 1.460, .164, .206, -.030, .28, 0 }, 2.0 },
    { { 1.540, .180, .218, -.020, .16, 0 }, 2.0 },
    { { 1.630, .194, .228, -.005, .05, 0 }, 2.0 },
    { { 1.720, .200, .234, .000, 0, 0 }, 1.8 },
    { { 1.800, .192, .226, .000, 0, 0 }, 1.6 },
    { { 1.865, .166, .20175, .000, 0, 0 }, 1.6 },
    { { 1.905, .130, .158, .000, 0, 0 }, 1.0 },         /* the dome closes it */
};
enum { KNOT_COUNT = sizeof profile / sizeof profile[0] };
static const double dome_rise = 0.0722;                 /* goes on with the slope of the last segment */
static const double statue_aspect = 6.4;                /* rows per cell across */

/* A stroke of the chisel: pushes what lies in an ellipsoid; x is mirrored. */
struct stroke { double at[3], inv[3], push[3]; };
#define STROKE(x, y, z, rx, ry, rz, px, py, pz) \
    { { x, y, z }, { 1 / (rx), 1 / (ry), 1 / (rz) }, { px, py, pz } }
static const struct stroke strokes[] = {
    STROKE(.070, -.20, 1.722, .085, .12, .034, 0, -.022, 0),            /* brow */
    STROKE(.074, -.20, 1.674, .062, .12, .044, 0, .046, 0),             /* eye: socket, ball, lids, pupil */
    STROKE(.072, -.18, 1.670, .036, .14, .024, 0, -.026, 0),
    STROKE(.072, -.20, 1.690, .044, .14, .010, 0, -.010, 0),
    STROKE(.072, -.20, 1.652, .040, .14, .008, 0, -.007, 0),
    STROKE(.072, -.19, 1.671, .009, .12, .009, 0, .008, 0),
    STROKE(0, -.23, 1.668, .036, .14, .080, 0, -.036, 0),               /* nose: bridge, ridge, tip, wings */
    STROKE(0, -.24, 1.612, .036, .16, .074, 0, -.048, 0),
    STROKE(0, -.24, 1.576, .038, .16, .036, 0, -.036, -.004),
    STROKE(.027, -.23, 1.570, .020, .14, .024, .002, -.018, 0),
    STROKE(.016, -.24, 1.553, .011, .14, .009, 0, .007, 0),
    STROKE(.100, -.17, 1.632, .095, .16, .075, .010, -.013, 0),         /* cheek bone, hollow, fold */
    STROKE(.125, -.14, 1.530, .085, .16, .095, -.013, .004, 0),
    STROKE(.064, -.21, 1.545, .024, .12, .050, 0, .006, 0),
    STROKE(0, -.21, 1.505, .100, .16, .070, 0, -.014, 0),               /* mouth */
    STROKE(0, -.22, 1.515, .056, .14, .018, 0, -.014, 0),
    STROKE(0, -.22, 1.488, .050, .14, .020, 0, -.017, 0),
    STROKE(0, -.22, 1.502, .066, .16, .008, 0, .015, 0),
    STROKE(0, -.22, 1.535, .010, .14, .022, 0, .002, 0),
    STROKE(0, -.22, 1.462, .070, .14, .022, 0, .010, 0),                /* chin */
    STROKE(0, -.20, 1.428, .095, .16, .060, 0, -.030, 0),
    STROKE(.205, .020, 1.625, .060, .042, .068, .044, .010, 0),         /* ear and its hollow */
    STROKE(.215, .012, 1.632, .060, .020, .040, -.030, 0, 0),
    STROKE(.055, -.10, 1.270, .040, .12, .150, 0, -.012, 0),            /* neck: cords, larynx */
    STROKE(0, -.11, 1.300, .026, .10, .040, 0, -.014, 0),
};
enum { STROKE_COUNT = sizeof strokes / sizeof strokes[0] };

static double knot_length(int i)
{
    double sum = 0;
    for (int c = R_Z; c <= R_RX; c++)
        sum += (profile[i + 1].v[c] - profile[i].v[c]) * (profile[i + 1].v[c] - profile[i].v[c]);
    return sqrt(sum) * profile[i].density;
}

/* Harmonic mean of the slopes on both sides: the curve never overshoots its knots. */
static double knot_slope(int i, int c)
{
    if (i == 0 || i == KNOT_COUNT - 1) {
        const int j = i == 0 ? 0 : i - 1;
        return (profile[j + 1].v[c] - profile[j].v[c]) / knot_length(j);
    }
    const double a = (profile[i].v[c] - profile[i - 1].v[c]) / knot_length(i - 1);
    const double b = (profile[i + 1].v[c] - profile[i].v[c]) / knot_length(i);
    return a * b <= 0 ? 0 : 2 * a * b / (a + b);
}

static void statue_row(struct gen *g, uint32_t k)
{
    double total = 0, from = 0;
    for (int i = 0; i < KNOT_COUNT - 1; i++)
        total += knot_length(i);
    const double at = total * k / (double)g->h;
    int i = 0;
    while (i < KNOT_COUNT - 2 && from + knot_length(i) < at)
        from += knot_length(i++);
    const double len = knot_length(i), t = (at - from) / len;
    const double per_row = total / (double)g->h;
    for (int c = 0; c < R_COUNT; c++) {
        const double a = profile[i].v[c], b = profile[i + 1].v[c];
        const double sa = knot_slope(i, c) * len, sb = knot_slope(i + 1, c) * len;
        const double c2 = 3 * (b - a) - 2 * sa - sb, c3 = 2 * (a - b) + sa + sb;
        g->row.v[c] = a + t * (sa + t * (c2 + t * c3));
        g->row.d[c] = (sa + t * (2 * c2 + t * 3 * c3)) / len * per_row;
    }
    g->row_k = k;
}

static inline void unit(double v[3])
{
    const double f = 1 / sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3; i++)
        v[i] *= f;
}

/* The swept body: point p, normal n. slide is the jitter along the profile, in rows. */
static void statue_side(struct gen *g, uint32_t k, double slide, const double dir[2], double p[3], double n[3])
{
    if (k != g->row_k)
        statue_row(g, k);
    double v[R_COUNT], square = 1;
    const double *d = g->row.d;
    for (int c = 0; c < R_COUNT; c++)
        v[c] = g->row.v[c] + slide * d[c];
    if (v[R_SQUARE] > 0) {                              /* towards |x|^8 + |y|^8 = 1 */
        double x8 = dir[0] * dir[0], y8 = dir[1] * dir[1];
        x8 *= x8, y8 *= y8;
        square = mixd(1, 1 / sqrt(sqrt(sqrt(x8 * x8 + y8 * y8))), v[R_SQUARE]);
    }
    const double y = v[R_RY] * square * dir[1];
    p[0] = v[R_RX] * square * dir[0];
    p[1] = v[R_CY] + y;
    p[2] = v[R_Z] + v[R_TILT] * y;
    const double u[3] = { -v[R_RX] * dir[1], v[R_RY] * dir[0], v[R_TILT] * v[R_RY] * dir[0] };
    const double w[3] = { d[R_RX] * dir[0], d[R_RY] * dir[1] + d[R_CY],
                          d[R_Z] + (d[R_TILT] * v[R_RY] + v[R_TILT] * d[R_RY]) * dir[1] };
    n[0] = u[1] * w[2] - u[2] * w[1];
    n[1] = u[2] * w[0] - u[0] * w[2];
    n[2] = u[0] * w[1] - u[1] * w[0];
    unit(n);
}

static void statue_cap(bool top, double a, double b, double p[3], double n[3])
{
    const double *v = profile[top ? KNOT_COUNT - 1 : 0].v;
    const double aa = fabs(a), bb = fabs(b), s = aa > bb ? aa : bb;
    double dir[2] = { 1, 0 };
    if (s > 0)
        square_direction(a / s, b / s, dir);
    double x8 = dir[0] * dir[0], y8 = dir[1] * dir[1];
    x8 *= x8, y8 *= y8;
    const double square = top ? 1 : 1 / sqrt(sqrt(sqrt(x8 * x8 + y8 * y8)));
    p[0] = v[R_RX] * s * square * dir[0];
    p[1] = v[R_CY] + v[R_RY] * s * square * dir[1];
    p[2] = v[R_Z] + (top ? dome_rise * (1 - s * s) : 0);
    n[0] = top ? 2 * dome_rise * s / v[R_RX] * dir[0] : 0;
    n[1] = top ? 2 * dome_rise * s / v[R_RY] * dir[1] : 0;
    n[2] = top ? 1 : -1;
    unit(n);
}

/* Height of the cloth: a tunic with hanging folds, a mantle over one shoulder with slanting ones. */
static double cloth_height(struct gen *g, const double p[3], double *hollow)
{
    const double front = smoothstep(0.06, -0.10, p[1]), ax = fabs(p[0]);
    const double neck = 1.135 - front * 0.16 * (1 - smoothstep(0.02, 0.22, ax));
    const double on = smoothstep(0.008, -0.008, p[2] - neck) * smoothstep(0.475, 0.50, p[2]);
    if (on <= 0)
        return 0;
    const double w1 = noise3(&g->noise[N_FOLD], p[0] * 3, p[1] * 3, p[2] * 2.2);
    const double w2 = noise3(&g->noise[N_FOLD2], p[0] * 7, p[1] * 7, p[2] * 5);
    const double border = 0.75 * p[0] + 0.10 * p[1] + 0.04 * w1 + 0.72 - 0.80 * p[2]
                        + 0.9 * smoothstep(-0.10, 0.22, p[1]);   /* the back is all mantle */
    const double mantle = smoothstep(-0.007, 0.007, border);
    const double hang = fold_wave(p[0] * 7 + 0.7 * w1 + 0.22 * w2 + 0.9 * ax * (p[2] - 0.9));
    const double sling = fold_wave((0.75 * p[0] - 0.80 * p[2]) * 8.5 + 3 * p[1] + 0.8 * w1 + 0.25 * w2);
    const double fold = mixd(hang * (0.8 + 0.4 * w2), sling * (0.9 + 0.5 * w1), mantle);
    const double hem = fold_wave(clamp01((0.045 - fabs(border - 0.03)) * 25) * 0.5);
    *hollow += on * smoothstep(0.5, 0.0, fold) * 0.8;
    return on * (0.014 + 0.030 * fold + mantle * 0.018 + mantle * 0.006 * hem);
}

/* Height of the hair: locks, their direction bent by a slow noise, split by a finer one. */
static double hair_height(struct gen *g, const double p[3], double *hollow)
{
    const double line = 1.815 - 1.12 * (p[1] + 0.2) + 0.012 * noise3(&g->noise[N_HAIRLINE], p[0] * 30, p[1] * 30, 3);
    const double ear = clamp01(1.3 - 220 * ((p[1] - 0.02) * (p[1] - 0.02) + (p[2] - 1.62) * (p[2] - 1.62)));
    const double on = smoothstep(-0.006, 0.022, p[2] - line) * (1 - 0.9 * smoothstep(0.2, 0.6, ear));
    if (on <= 0)
        return 0;
    const double curl = noise3(&g->noise[N_HAIR], p[0] * 9, p[1] * 9, p[2] * 9);
    const double bend = noise3(&g->noise[N_HAIR + 1], p[0] * 5, p[1] * 5, p[2] * 5);
    const double lock = 1 - 2 * fabs(fbm(&g->noise[N_LOCK], 2, p[0] * 17 + bend, p[1] * 17 + curl, p[2] * 17));
    const double strand = fold_wave(3.2 * curl + 2.5 * bend + 9 * p[2]);
    *hollow += on * 1.2 * smoothstep(0.75, 0.25, lock) + on * 0.4 * (1 - strand);
    return on * (0.008 + 0.026 * lock + 0.009 * strand);
}

static void carve(struct gen *g, const double q[3], const double n[3], double fuzz, double p[3], double *hollow)
{
    const double face = smoothstep(1.12, 1.28, q[2]);    /* time is kinder to it */
    double t[3] = { q[0], q[1], q[2] };
    next_octave(t, 12);
    const double rough = fbm(&g->noise[N_STONE], 4, t[0], t[1], t[2]);
    const double chip = noise3(&g->noise[N_CHIP], t[0], t[1], t[2]) + 0.5 * rough;
    double up = mixd(0.010, 0.005, face) * rough - 0.022 * (1 - face) * smoothstep(0.74, 1.0, chip) + fuzz;
    up *= smoothstep(0, 0.01, q[2]);                    /* it stands flat */
    if (q[2] > 0.46 && q[2] < 1.2)
        up += cloth_height(g, q, hollow);
    if (q[2] > 1.3)
        up += hair_height(g, q, hollow);
    for (int i = 0; i < 3; i++)
        p[i] = q[i] + up * n[i];
    const double mirror = q[0] < 0 ? -1 : 1;
    for (int s = 0; q[2] > 1.1 && q[1] < 0.07 && s < STROKE_COUNT; s++) {  /* the back has none */
        const struct stroke *k = &strokes[s];
        const double z = (q[2] - k->at[2]) * k->inv[2], zz = 1 - z * z;
        if (zz <= 0)
            continue;
        const double x = (mirror * q[0] - k->at[0]) * k->inv[0], y = (q[1] - k->at[1]) * k->inv[1];
        const double r = zz - x * x - y * y, f = r <= 0 ? 0 : r * r * (2 - r);
        p[0] += mirror * f * k->push[0];
        p[1] += f * k->push[1];
        p[2] += f * k->push[2];
        *hollow += k->push[1] > 0 ? f * 0.35 : 0;
    }
}

static void statue_plan(struct gen *g)
{
    box_plan(g, sqrt_round((double)g->triangles / (8 * statue_aspect + 4)));
    g->step = 0.5 / (double)(g->m < 10 ? 10 : g->m);
    g->row_k = UINT32_MAX;
}

static void statue_vertex(struct gen *g, uint32_t id, struct vertex *out)
{
    const struct spot at = box_spot(g, id);
    const uint64_t r = mix64(id ^ g->key);
    const double m = (double)g->m, ji = 0.2 * signed21(r), jj = 0.2 * signed21(r >> 21);
    double q[3], n[3], hollow = 0;
    if (at.part == 0) {
        double square[2], dir[2];
        square_point((at.i + ji) / m, square);
        square_direction(square[0], square[1], dir);
        statue_side(g, at.j, at.j == 0 || at.j == g->h ? 0 : jj, dir, q, n);
    } else {
        statue_cap(at.part > 0, 2 * (at.i + ji) / m - 1, 2 * (at.j + jj) / m - 1, q, n);
    }
    carve(g, q, n, 0.05 * g->step * signed21(r >> 42), out->p, &hollow);
    if (g->color)
        stone_color(g, q, hollow, out);
    if (q[2] < 1.05)
        return;
    const double turn = 0.12 * smoothstep(1.05, 1.40, q[2]), f = 1 / (1 + turn * turn);
    const double c = (1 - turn * turn) * f, s = 2 * turn * f, x = out->p[0], y = out->p[1];
    out->p[0] = c * x - s * y;                          /* the head looks aside */
    out->p[1] = s * x + c * y;
}

#endif
