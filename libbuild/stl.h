/*
 * stl.h - the STL reader: binary and ascii, with the colours of two conventions.
 *
 * Used through source.h. What it makes of the format's loose ends is told on top of stl.c (which
 * of the two, counts, colours) and stl_ascii.c (text).
 */
#ifndef SPB_STL_H
#define SPB_STL_H

#include "source_int.h"

extern const struct spb_format spb_stl_format;

#endif
