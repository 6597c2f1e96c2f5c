#include "space.h"

#include "vec.h"
#include "vectors.h"

#include <math.h>
#include <string.h>

enum {
    VERTEX_BITS_MIN = 10,           /* lattice at least this fine, in bits of the longest side */
    VERTEX_BITS_MAX = 46,           /* and at most: products of three stay inside a double's range */
    EDGE_BITS = 5,                  /* steps per short edge: 2^5 */
};

static int exponent_of(double v)    /* v < 2^e, v >= 2^(e-1) */
{
    int e = 0;
    frexp(v, &e);
    return e;
}

bool spb_space_init(struct spb_space *space, const double min[3], const double max[3])
{
    double side = 0, largest = 0;
    for (int a = 0; a < 3; a++) {
        side = larger_of(side, max[a] - min[a]);
        largest = larger_of(largest, larger_of(fabs(min[a]), fabs(max[a])));
    }
    if (isinf(side))                /* opposite ends of the range of double */
        side = 0x1p1023;
    space->ulp_exp = largest > 0 ? exponent_of(largest) - 53 : -1074;
    const bool beyond = space->ulp_exp < -1022;     /* steps and scales are normal numbers */
    if (beyond)
        space->ulp_exp = -1022;
    /* A scan of one point has no side: any unit serves, the ulp keeps it near the data. */
    space->unit_exp = side > 0 ? exponent_of(side) : space->ulp_exp + VERTEX_BITS_MIN;
    if (space->unit_exp <= space->ulp_exp)          /* subnormal: below every lattice */
        space->unit_exp = space->ulp_exp + 1;
    int step = space->unit_exp - VERTEX_BITS_MIN;
    if (step < space->ulp_exp)
        step = space->ulp_exp;
    for (int a = 0; a < 3; a++)
        space->origin[a] = times_exp2(floor(times_exp2(min[a], -step)), step);
    space->vertex_exp = space->coarse_exp = step;
    space->cells = NULL;
    return !beyond || !(side > 0) || exponent_of(side) - VERTEX_BITS_MIN >= -1022;
}

int spb_space_limit(const struct spb_space *space)
{
    const int finest = space->unit_exp - VERTEX_BITS_MAX;
    return finest > space->ulp_exp ? finest : space->ulp_exp;
}

static void set_step(struct spb_space *space, int step)
{
    const int coarsest = space->vertex_exp;         /* as init left it: divides the origin */
    if (step < spb_space_limit(space))
        step = spb_space_limit(space);
    if (step > coarsest)
        step = coarsest;
    space->vertex_exp = space->coarse_exp = step;
}

void spb_space_set_vertices(struct spb_space *space, double edge)
{
    set_step(space, edge > 0 ? space->unit_exp + exponent_of(edge) - 1 - EDGE_BITS
                             : space->vertex_exp);
}

void spb_space_use_lattice(struct spb_space *space, int lattice_exp)
{
    set_step(space, lattice_exp);
}

void spb_space_refine(struct spb_space *space, int bits)
{
    const int coarse = space->coarse_exp;
    set_step(space, space->vertex_exp - bits);
    space->coarse_exp = coarse;
}

int spb_space_finest(const struct spb_space *space)
{
    return space->vertex_exp - space->unit_exp;     /* not below the ulp either */
}

double spb_space_from_file(const struct spb_space *space, int axis, double x)
{
    return times_exp2(x - space->origin[axis], -space->unit_exp);
}

double spb_space_snap(const struct spb_space *space, double u)
{
    return floor(times_exp2(u, space->unit_exp - space->vertex_exp) + 0.5);
}

void spb_space_snap_corner(const struct spb_space *space, const double u[3], double number[3])
{
    const int coarser = space->cells ? space->cells[spb_space_cell(u)] : 0;
    const double to_steps = times_exp2(1, space->unit_exp - space->vertex_exp - coarser);
    const double to_finest = times_exp2(1, coarser);
    for (int a = 0; a < 3; a++)
        number[a] = floor(u[a] * to_steps + 0.5) * to_finest;
}

int64_t spb_space_origin_number(const struct spb_space *space, int axis)
{
    return (int64_t)times_exp2(space->origin[axis], -space->vertex_exp);
}

struct spb_record_format spb_record_format(bool wide, bool colors)
{
    return (struct spb_record_format){wide, colors, false, (wide ? 72u : 36u) + (colors ? 12u : 0u)};
}

struct spb_record_format spb_point_format(bool wide, bool colors)
{
    return (struct spb_record_format){wide, colors, true, (wide ? 40u : 28u) + (colors ? 4u : 0u)};
}

/* Coordinate number k of nine, file units. */
SPB_INLINE double load_coordinate(const uint8_t *record, bool is_wide, int k)
{
    double wide;
    float narrow;
    if (is_wide) {
        memcpy(&wide, record + 8 * k, sizeof wide);
        return wide;
    }
    memcpy(&narrow, record + 4 * k, sizeof narrow);
    return (double)narrow;
}

SPB_INLINE double middle_of(double x, double y, double z)
{
    const double min = smaller_of(x, smaller_of(y, z)), max = larger_of(x, larger_of(y, z));
    return (min + max) / 2 + 1 - 1;         /* adding 1 rounds to multiples of 2^-52 */
}

SPB_INLINE void keys_of(bool wide, uint32_t bytes, const struct spb_space *space,
                        const uint8_t *records, uint32_t count, double (*keys)[4])
{
    const double scale = ldexp(1, -space->unit_exp);        /* never below 2^-1074 nor above 2^1023 */
    for (uint32_t i = 0; i < count; i++) {
        const uint8_t *record = records + (size_t)i * bytes;
        for (int a = 0; a < 3; a++) {
            const double origin = space->origin[a];
            keys[i][a] = middle_of((load_coordinate(record, wide, a) - origin) * scale,
                                   (load_coordinate(record, wide, a + 3) - origin) * scale,
                                   (load_coordinate(record, wide, a + 6) - origin) * scale);
        }
        keys[i][3] = (double)i;
    }
}

SPB_INLINE void point_keys(bool wide, uint32_t bytes, const struct spb_space *space,
                           const uint8_t *records, uint32_t count, double (*keys)[4])
{
    const double scale = ldexp(1, -space->unit_exp);
    for (uint32_t i = 0; i < count; i++) {
        const uint8_t *record = records + (size_t)i * bytes;
        for (int a = 0; a < 3; a++)
            keys[i][a] = (load_coordinate(record, wide, a) - space->origin[a]) * scale + 1 - 1;
        keys[i][3] = (double)i;
    }
}

/*
 * The first corner is along the projected axis that the normal is furthest from. Its radius is in
 * units, so that it fits a float whatever the file's.
 */
void spb_point_corners(const struct spb_record_format *format, const struct spb_space *space,
                       const uint8_t *record, double corner[9])
{
    float stored[4];
    memcpy(stored, record + spb_point_normal(format), sizeof stored);
    const double n[3] = {(double)stored[0], (double)stored[1], (double)stored[2]};
    const double radius = times_exp2((double)stored[3], space->unit_exp);
    double first[3] = {0, 0, 0}, second[3];
    int least = 0;
    for (int a = 1; a < 3; a++)
        least = fabs(n[a]) < fabs(n[least]) ? a : least;
    first[least] = 1;
    for (int a = 0; a < 3; a++)
        first[a] -= n[least] * n[a];
    vec_scale(first, 1 / vec_length(first), first);
    vec_cross(n, first, second);
    for (int a = 0; a < 3; a++) {
        const double at = load_coordinate(record, format->wide, a);
        const double along = radius * first[a], across = radius * 0x1.bb67ae8584caap-1 * second[a];
        corner[a] = at + along;
        corner[3 + a] = at - along / 2 + across;
        corner[6 + a] = at - along / 2 - across;
    }
}

void spb_record_corners(const struct spb_record_format *format, const struct spb_space *space,
                        const uint8_t *record, double corner[9])
{
    if (format->points)
        spb_point_corners(format, space, record, corner);
    for (int k = 0; k < 9 && !format->points; k++)
        corner[k] = load_coordinate(record, format->wide, k);
}

void spb_record_keys(const struct spb_record_format *format, const struct spb_space *space,
                     const uint8_t *records, uint32_t count, double (*keys)[4])
{
    if (format->points)
        point_keys(format->wide, format->bytes, space, records, count, keys);
    else if (format->wide)
        keys_of(true, format->bytes, space, records, count, keys);
    else
        keys_of(false, format->bytes, space, records, count, keys);
}
