/*
 * off.h - the OFF reader: the text kinds of Geomview's Object File Format in three dimensions.
 *
 * Used through source.h. What it makes of the format's loose ends is told on top of off_header.c
 * (keyword, counts, what a row of a vertex holds) and off.c (rows, polygons).
 */
#ifndef SPB_OFF_H
#define SPB_OFF_H

#include "source_int.h"

extern const struct spb_format spb_off_format;

#endif
