/*
 * surfel.c - a disk from the nearest places.
 *
 * Radius: a share of the distance to the furthest of them, which covers the gaps of a random sample, and
 * those between rows of a scanner, if the next row is among them. A point far from all others would become a giant:
 * their own spacing, the median over all of the nearest one's distance, limits it.
 *
 * Normal: that of the plane nearest to the places in the sense of least squares, if the file has none.
 * Its sign means nothing; the largest component is positive. Of places on a line every plane through
 * it is as good: it is the one that the axis furthest from the line has for a normal.
 *
 * Why shares and limits are what they are: spec/decisions.md.
 */
#include "surfel.h"

#include "vec.h"
#include "vectors.h"

/* Settable when compiling, so that other choices can be measured. */
#ifndef SPB_SURFEL_SHARE
#define SPB_SURFEL_SHARE 0.55       /* of the distance to the furthest place */
#endif
#ifndef SPB_SURFEL_LIMIT
#define SPB_SURFEL_LIMIT 6          /* spacings */
#endif

static const double ON_LINE = 0x1p-5;   /* share of squared distances that is beside it, at most */
static const double ALONE = 0x1p-7; /* units: everything is in one place, and its unit 2^10 ulps */

enum { PLACES = SPB_NEAR_MAX + 1 }; /* with the point's own */

struct places {
    double axis[3][PLACES];         /* from the point's own, which is the first */
    uint32_t count;
};

/* ---- radius -------------------------------------------------------------------------------------- */

/* Squared distances to the nearest other place, of each. */
SPB_VECTORS static void find_nearest(const struct places *p, double *nearest)
{
    for (uint32_t i = 0; i < p->count; i++)
        nearest[i] = HUGE_VAL;
    for (uint32_t k = 0; k + 1 < p->count; k++) {
        const double x = p->axis[0][k], y = p->axis[1][k], z = p->axis[2][k];
        double least = nearest[k];
        for (uint32_t i = k + 1; i < p->count; i++) {
            const double dx = p->axis[0][i] - x, dy = p->axis[1][i] - y, dz = p->axis[2][i] - z;
            const double square = dx * dx + dy * dy + dz * dz;
            nearest[i] = smaller_of(square, nearest[i]);
            least = smaller_of(square, least);
        }
        nearest[k] = least;
    }
}

/* Of two middle ones the larger: of two places there is only one distance. */
static double median(double *v, uint32_t count)
{
    for (uint32_t i = 1; i < count; i++) {
        const double x = v[i];
        uint32_t at = i;
        for (; at > 0 && v[at - 1] > x; at--)
            v[at] = v[at - 1];
        v[at] = x;
    }
    return v[count / 2];
}

static double radius_of(const struct places *p, double furthest)
{
    double nearest[PLACES];
    if (p->count == 1)
        return ALONE;
    find_nearest(p, nearest);
    const double share = SPB_SURFEL_SHARE * sqrt(furthest);
    return smaller_of(share, SPB_SURFEL_LIMIT * sqrt(median(nearest, p->count)));
}

/* ---- normal -------------------------------------------------------------------------------------- */

static bool direction(const double v[3], double out[3])
{
    double largest = 0;
    for (int a = 0; a < 3; a++) {
        if (!isfinite(v[a]))
            return false;
        largest = larger_of(largest, fabs(v[a]));
    }
    if (!(largest > 0))
        return false;
    for (int a = 0; a < 3; a++)
        out[a] = v[a] / largest;
    vec_scale(out, 1 / vec_length(out), out);
    return true;
}

/* Sums of products about the mean, over the squared distance of the furthest place. */
static void spread_of(const struct places *p, double scale, double m[3][3])
{
    double mean[3];
    for (int a = 0; a < 3; a++) {
        double sum = 0;
        for (uint32_t i = 0; i < p->count; i++)
            sum += p->axis[a][i];
        mean[a] = sum / p->count;
    }
    for (int a = 0; a < 3; a++)
        for (int b = a; b < 3; b++) {
            double sum = 0;
            for (uint32_t i = 0; i < p->count; i++)
                sum += (p->axis[a][i] - mean[a]) * (p->axis[b][i] - mean[b]);
            m[a][b] = m[b][a] = sum * scale;
        }
}

/* One rotation of Jacobi's: m[p][q] becomes 0; the columns of axes turn with it. */
static void rotate(double m[3][3], double axes[3][3], int p, int q)
{
    const int r = 3 - p - q;
    if (m[p][q] == 0)
        return;
    const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
    const double t = (theta >= 0 ? 1 : -1) / (fabs(theta) + sqrt(theta * theta + 1));
    const double c = 1 / sqrt(t * t + 1), s = t * c;
    const double rp = m[r][p], rq = m[r][q];
    m[p][p] -= t * m[p][q];
    m[q][q] += t * m[p][q];
    m[p][q] = m[q][p] = 0;
    m[r][p] = m[p][r] = c * rp - s * rq;
    m[r][q] = m[q][r] = s * rp + c * rq;
    for (int a = 0; a < 3; a++) {
        const double ap = axes[a][p], aq = axes[a][q];
        axes[a][p] = c * ap - s * aq;
        axes[a][q] = s * ap + c * aq;
    }
}

/* Below this share of the largest spread, two others are those of places on a line. */
static const double LINE = 0x1p-40;

/* Normal of a line along the unit vector: the axis furthest from it, made perpendicular. */
static void beside_line(const double along[3], double out[3])
{
    double v[3];
    int least = 0;
    for (int a = 1; a < 3; a++)
        least = fabs(along[a]) < fabs(along[least]) ? a : least;
    for (int a = 0; a < 3; a++)
        v[a] = (a == least) - along[least] * along[a];
    vec_scale(v, 1 / vec_length(v), out);
}

static void estimate(const struct places *p, double furthest, double out[3])
{
    enum { SWEEPS_MAX = 12 };       /* it converges after four or five */
    double m[3][3], axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    int least = 0, most = 0;
    spread_of(p, 1 / furthest, m);
    for (int sweep = 0; sweep < SWEEPS_MAX; sweep++) {
        const double off = fabs(m[0][1]) + fabs(m[0][2]) + fabs(m[1][2]);
        if (off <= 0x1p-30 * (fabs(m[0][0]) + fabs(m[1][1]) + fabs(m[2][2])))
            break;
        rotate(m, axes, 0, 1);
        rotate(m, axes, 0, 2);
        rotate(m, axes, 1, 2);
    }
    for (int a = 1; a < 3; a++) {
        least = m[a][a] < m[least][least] ? a : least;
        most = m[a][a] > m[most][most] ? a : most;
    }
    const int middle = most == least ? most : 3 - least - most;
    double axis[3] = {axes[0][least], axes[1][least], axes[2][least]};
    if (m[middle][middle] <= LINE * m[most][most])
        beside_line((const double[3]){axes[0][most], axes[1][most], axes[2][most]}, axis);
    if (!direction(axis, out))
        out[0] = out[1] = 0, out[2] = 1;
}

static void sign_of_largest(double v[3])
{
    int largest = 0;
    for (int a = 1; a < 3; a++)
        largest = fabs(v[a]) > fabs(v[largest]) ? a : largest;
    if (v[largest] < 0)
        vec_scale(v, -1, v);
}

bool spb_surfel_on_line(const double from[3], const struct spb_near *near)
{
    const uint32_t count = near->count < SPB_NEAR ? near->count : SPB_NEAR;
    double along[3], all = 0, beside = 0;
    if (count < SPB_NEAR)
        return false;
    const double *furthest = near->at[count - 1];
    vec_sub(furthest + 1, from, along);
    for (uint32_t i = 0; i < count; i++) {
        double v[3];
        vec_sub(near->at[i] + 1, from, v);
        const double dot = vec_dot(v, along);
        all += near->at[i][0];
        beside += near->at[i][0] - dot * dot / furthest[0];
    }
    return beside <= ON_LINE * all;
}

void spb_surfel_make(const double from[3], const struct spb_near *near, const float given[3],
                     struct spb_surfel *out)
{
    const uint32_t most = spb_surfel_on_line(from, near) ? SPB_NEAR_MAX : SPB_NEAR;
    const uint32_t count = near->count < most ? near->count : most;
    const double furthest = count > 0 ? near->at[count - 1][0] : 0;
    struct places p = {.count = count + 1};
    double normal[3] = {0, 0, 1};
    for (int a = 0; a < 3; a++) {
        p.axis[a][0] = 0;
        for (uint32_t i = 0; i < count; i++)
            p.axis[a][i + 1] = near->at[i][1 + a] - from[a];
    }
    out->radius = (float)radius_of(&p, furthest);
    if (given == NULL ||
        !direction((const double[3]){(double)given[0], (double)given[1], (double)given[2]}, normal)) {
        if (count > 0)
            estimate(&p, furthest, normal);
        sign_of_largest(normal);
    }
    for (int a = 0; a < 3; a++)
        out->normal[a] = (float)normal[a];
}
