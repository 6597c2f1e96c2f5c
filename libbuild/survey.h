/*
 * survey.h - what the faces of a scan measure: box, volume, and how short edges are.
 */
#ifndef SPB_SURVEY_H
#define SPB_SURVEY_H

#include "space.h"

enum { SPB_EDGE_BINS = 2304 };

struct spb_survey {
    double file_min[3], file_max[3];            /* of the corners, file coordinates */
    double volume;                  /* 6 x signed volume, units; outward winding is positive */
    uint64_t edge_bins[SPB_EDGE_BINS];          /* shortest edges that are not 0, by exponent */
};

void spb_survey_init(struct spb_survey *survey);

/* What count records measure, and for each the bin of its shortest edge, -1 when all are 0. */
struct spb_measures {
    double file_min[3], file_max[3], volume;
};
void spb_survey_measure(const struct spb_record_format *format, const struct spb_space *space,
                        const uint8_t *records, uint32_t count, struct spb_measures *measures,
                        int16_t *bins);

/* The bin of one squared edge, units; -1 of an infinite one. */
int16_t spb_survey_bin(double square);

/* Adds them. In one order always: volumes are rounded. */
void spb_survey_add(struct spb_survey *survey, const struct spb_measures *measures,
                    const int16_t *bins, uint32_t count);

/* A short edge of the scan: the tenth percentile of the shortest edges, rounded down to a power
 * of two of its square; 0 when every edge is 0. Units. */
double spb_survey_short_edge(const struct spb_survey *survey);

#endif
