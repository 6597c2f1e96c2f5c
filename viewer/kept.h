/*
 * kept.h - decoded blocks as they are kept between frames: nodes by e_parent.
 *
 * In the file a block's nodes lie by normal cluster, as they compress best. A kept block is drawn many
 * times: sorted by e_parent, those that can pass their upper test are its beginning, and the rest is not
 * even looked at. [Oka04] 3.1
 */
#ifndef SPV_KEPT_H
#define SPV_KEPT_H

#include "select.h"

/*
 * Sorts a decoded payload's nodes by e_parent, largest first, in place; equal ones stay in order. What
 * belongs to a node moves with it: its colour, its triangle. groups, and children of inner blocks, which
 * count in the file's order, are zeroed. fails SPC_NO_MEMORY: the payload is as it was
 */
enum spc_status spv_kept_sort(const struct spc_reader *reader, uint32_t block, uint8_t *payload, struct spc_error *err);

/*
 * How many nodes of a sorted block may pass their upper test from here, or that of their triangle: the
 * first so many; all of them in triangles mode.
 *
 * in     eye     of spv_eye_of_cluster for the view that is tested
 *        codes   [node_count] e_parent of the nodes, little-endian, stride bytes from one to the next
 */
uint32_t spv_kept_prefix(const struct spv_view *tested, const struct spc_block *b, const struct spc_cluster *c,
                         const double eye[3], const uint8_t *codes, size_t stride);

#endif
