/*
 * obj.h - the OBJ reader: Wavefront's text format as scanners and photogrammetry write it.
 *
 * Used through source.h. What it makes of the format's loose ends is told on top of obj_lines.c
 * (lines and words), obj.c (counting) and obj_faces.c (faces).
 */
#ifndef SPB_OBJ_H
#define SPB_OBJ_H

#include "source_int.h"

extern const struct spb_format spb_obj_format;

#endif
