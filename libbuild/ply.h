/*
 * ply.h - the PLY reader: Stanford's Polygon File Format as forty programs write it.
 *
 * Used through source.h. What it makes of the format's loose ends is told on top of ply_header.c
 * (header), ply_ascii.c (text bodies) and ply.c (faces, strips, order of elements).
 */
#ifndef SPB_PLY_H
#define SPB_PLY_H

#include "source_int.h"

extern const struct spb_format spb_ply_format;

#endif
