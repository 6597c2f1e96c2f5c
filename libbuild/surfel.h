/*
 * surfel.h - how large a disk a point stands for, and how it lies: by what is near it.
 */
#ifndef SPB_SURFEL_H
#define SPB_SURFEL_H

#include "knn.h"

struct spb_surfel {
    float normal[3];                /* length 1, up to rounding */
    float radius;                   /* units, above 0 */
};

/*
 * Whether the SPB_NEAR places near a point at from are on a line with it: in a row of a scanner, whose next
 * row is further away than so many points. Then SPB_NEAR_MAX places are to be found.
 */
bool spb_surfel_on_line(const double from[3], const struct spb_near *near);

/*
 * The disk of a point at from with these places near it, of which those beyond SPB_NEAR count if it is on a
 * line. given is its normal in the file, of any
 * length, or NULL; where it is no direction the normal is estimated. Pure; only sqrt is used.
 */
void spb_surfel_make(const double from[3], const struct spb_near *near, const float given[3],
                     struct spb_surfel *out);

#endif
