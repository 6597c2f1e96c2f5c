/*
 * space.h - the coordinates in which the tree is built, and faces as fixed-size records.
 *
 * Build coordinates: file coordinates minus the space's origin, in units of 2^unit_exp, so that the
 * scan lies in about [0, 1]^3. Only powers of two scale them: multiplying a scan by 2^k changes
 * unit_exp and the origin, no build coordinate (I9).
 */
#ifndef SPB_SPACE_H
#define SPB_SPACE_H

#include "spc.h"

struct spb_space {
    double origin[3];               /* file units; a multiple of every lattice step used */
    int unit_exp;                   /* K: 2^K is the smallest power above the longest side */
    int ulp_exp;                    /* exponent of the ulp of the largest |coordinate| */
    int vertex_exp;                 /* lattice of the vertices; set by spb_space_set_vertices */
    int coarse_exp;                 /* the lattice where no cell is finer */
    const uint8_t *cells;           /* NULL, or of each cell (detail.h) by how many bits its lattice is
                                       coarser than that: spb_space_cell */
};

/*
 * Space of a scan with these bounds (finite, min <= max), file units. False: the scan is so small that
 * normal numbers are no lattice of 2^10 steps across it, and its own numbers resolve more.
 */
bool spb_space_init(struct spb_space *space, const double min[3], const double max[3]);

/*
 * Chooses the vertex lattice: edge is a short edge of the scan (tenth percentile), in units; 0
 * when every edge is 0. Steps of edge/32 or finer, inside what 46 bits of the longest side and
 * the ulp of the coordinates allow.
 */
void spb_space_set_vertices(struct spb_space *space, double edge);

/*
 * The same for vertices that lie on a lattice already, of 2^lattice_exp: they stay where they are.
 * (But when its 46 bits were used up, and rounding has moved the bounds to a power of two: then
 * the next coarser one.)
 */
void spb_space_use_lattice(struct spb_space *space, int lattice_exp);

/* Makes the lattice of vertices finer by so many bits, or by what the limits allow. */
void spb_space_refine(struct spb_space *space, int bits);

/* The finest lattice that vertices could have: vertex_exp is not below. */
int spb_space_limit(const struct spb_space *space);

/* Exponent, in units, of the finest step a position may have: that of vertices. */
int spb_space_finest(const struct spb_space *space);

/* File coordinate -> build coordinate, as the file says it (not snapped). */
double spb_space_from_file(const struct spb_space *space, int axis, double x);

/* Build coordinate -> the nearest vertex lattice point: its number counted from the origin. */
double spb_space_snap(const struct spb_space *space, double u);

/* The same for a corner, in space->cells if there are any. */
void spb_space_snap_corner(const struct spb_space *space, const double u[3], double number[3]);

/* Cell of a corner, units: 2^6 a unit, along x first. */
enum { SPB_DETAIL_LOG2 = 6 };
static inline uint32_t spb_space_cell(const double u[3])
{
    const double side = 1 << SPB_DETAIL_LOG2;
    uint32_t cell = 0;
    for (int a = 2; a >= 0; a--) {
        const double at = u[a] * side, last = side - 1;
        cell = cell << SPB_DETAIL_LOG2 | (uint32_t)(at >= last ? last : at > 0 ? at : 0);
    }
    return cell;
}

/* Number of the origin itself on the vertex lattice, counted from file coordinate 0; exact. */
int64_t spb_space_origin_number(const struct spb_space *space, int axis);

/* ---- face records ----------------------------------------------------------------------------- */

/*
 * A record holds the corners of a face, file coordinates as float or double, as the scan has them, and
 * their colours if any. Of a point without faces it is place, normal (3 floats), radius (a float, in
 * units: 0 until points.h has found it) and colour if any: the triangle that it stands for is
 * equilateral, with that circumcircle. All that reads corners takes both kinds.
 */
struct spb_record_format {
    bool wide, colors, points;
    uint32_t bytes;
};
struct spb_record_format spb_record_format(bool wide, bool colors);
struct spb_record_format spb_point_format(bool wide, bool colors);

/* Where in a point's record the normal is, and after it the radius. */
static inline uint32_t spb_point_normal(const struct spb_record_format *format)
{
    return format->wide ? 24 : 12;
}

/* The corners of a point's triangle, [corner][axis], file units; counterclockwise around its normal. */
void spb_point_corners(const struct spb_record_format *format, const struct spb_space *space,
                       const uint8_t *record, double corner[9]);

/* The corners of any record, likewise. */
void spb_record_corners(const struct spb_record_format *format, const struct spb_space *space,
                        const uint8_t *record, double corner[9]);

/*
 * Where faces lie for splitting: the middle of a face's box, or a point, on a lattice of 2^-52 units, of records
 * [0, count); and their numbers: keys[i] is x, y, z, i. A function of the face alone, the same in
 * planning and building.
 */
void spb_record_keys(const struct spb_record_format *format, const struct spb_space *space,
                     const uint8_t *records, uint32_t count, double (*keys)[4]);

#endif
