/* plain_face.h - face records one at a time, as batches of vectors must take them. */
#ifndef PLAIN_FACE_H
#define PLAIN_FACE_H

#include "space.h"

struct plain_face {
    double corner[3][3];            /* build coordinates, [corner][axis], as the file says them */
    uint8_t rgba[3][4];
};

void plain_record_store(const struct spb_record_format *format, const double corner[3][3],
                      const uint8_t rgba[3][4], uint8_t *record);
void plain_record_load(const struct spb_record_format *format, const struct spb_space *space,
                     const uint8_t *record, struct plain_face *out);

/* The middle of its box, on a lattice of 2^-52 units. */
void plain_face_key(const struct plain_face *face, double key[3]);

/* Number of a lattice point -> build coordinate; exact. */
double plain_from_lattice(const struct spb_space *space, double number);

#endif
