/*
 * survey.h - what the faces of a scan measure: box, volume, how short edges are, and how large faces.
 */
#ifndef SPB_SURVEY_H
#define SPB_SURVEY_H

#include "space.h"

enum { SPB_EDGE_BINS = 2304 };

struct spb_survey {
    double file_min[3], file_max[3];            /* of the corners, file coordinates */
    double volume;                  /* 6 x signed volume, units; outward winding is positive */
    uint64_t edge_bins[SPB_EDGE_BINS];          /* shortest edges that are not 0, by exponent */
    uint64_t size_bins[SPB_EDGE_BINS];          /* longest edges that are not 0, likewise */
};

void spb_survey_init(struct spb_survey *survey);

/* What count records measure, and for each the bins of its shortest and its longest edge. */
struct spb_measures {
    double file_min[3], file_max[3], volume;
};
struct spb_bins {
    int16_t edge, size;             /* -1 when all edges are 0 */
};
void spb_survey_measure(const struct spb_record_format *format, const struct spb_space *space,
                        const uint8_t *records, uint32_t count, struct spb_measures *measures,
                        struct spb_bins *bins);

/* The bin of one squared edge, units; -1 of an infinite one. */
int16_t spb_survey_bin(double square);

/* Adds them. In one order always: volumes are rounded. */
void spb_survey_add(struct spb_survey *survey, const struct spb_measures *measures,
                    const struct spb_bins *bins, uint32_t count);

/* A short edge of the scan: the tenth percentile of the shortest edges, rounded down to a power
 * of two of its square; 0 when every edge is 0. Units. */
double spb_survey_short_edge(const struct spb_survey *survey);

/* Faces whose longest edge is below 2^size_exp units, but not 0. */
uint64_t spb_survey_smaller(const struct spb_survey *survey, int size_exp);

#endif
