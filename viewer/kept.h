/*
 * kept.h - decoded blocks as they are kept between frames: nodes by e_parent.
 *
 * In the file a block's nodes lie by normal cluster, as they compress best. A kept block is drawn many
 * times: sorted by e_parent, those that can pass their upper test are its beginning, and the rest is not
 * even looked at. [Oka04] 3.1
 *
 * Of leaves that are many, which are drawn near the eye and mostly all, those that face away are worth
 * leaving out: they stay by normal cluster, and each cluster's are sorted. Elsewhere the tests of 128
 * cones would cost more than they save.
 */
#ifndef SPV_KEPT_H
#define SPV_KEPT_H

#include "select.h"

/*
 * Sorts a decoded payload's nodes, in place; equal ones stay in order. What belongs to a node moves with
 * it: its colour, its triangle. Where normal clusters are given up, groups are zeroed, as are the children
 * of inner blocks, which count in the file's order. fails SPC_NO_MEMORY: the payload is as it was
 */
enum spc_status spv_kept_sort(const struct spc_reader *reader, uint32_t block, uint8_t *payload, struct spc_error *err);

/* Do the nodes stay by normal cluster? */
bool spv_kept_grouped(const struct spc_block *b);

/*
 * The nodes of a sorted block that may pass their upper test from here, or that of their triangle, and may
 * face the eye; in triangles mode all that may face it.
 *
 * in     eye     of spv_eye_of_cluster for the view that is tested
 *        codes   [node_count] e_parent of the nodes, little-endian, stride bytes from one to the next
 *        groups  of the payload
 */
void spv_kept_ranges(const struct spc_reader *reader, const struct spv_view *tested, const struct spc_block *b,
                     const struct spc_cluster *c, const double eye[3], const uint8_t *codes, size_t stride,
                     const uint8_t *groups, struct spv_ranges *out);

#endif
