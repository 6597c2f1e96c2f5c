/* paint.h - colours that say what a node or a triangle belongs to: the same bytes in every back end. */
#ifndef SPV_PAINT_H
#define SPV_PAINT_H

#include "draw.h"

/*
 * Colour of a node (triangle false) or a leaf's triangle (true), before light: r, g, b, 255 from the low
 * byte up. Integers alone, so that no back end rounds otherwise.
 *
 * in     cluster, level, group  of the node: cluster number, its level, its normal cluster
 * out    (return) white for SPV_PAINT_SCAN: the scan's own colours are the caller's matter
 */
uint32_t spv_paint_color(enum spv_paint paint, uint32_t cluster, uint32_t level, uint32_t group, bool triangle);

#endif
