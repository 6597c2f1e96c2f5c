/*
 * plain_tree.h - stages of the tree compiled without their vectors, beside those of the library,
 * so that a test can compare both.
 */
#ifndef PLAIN_TREE_H
#define PLAIN_TREE_H

#ifdef SPB_NO_VECTORS               /* in the copies of the stages */
#define spb_leaves_make plain_leaves_make
#define spb_inner_make plain_inner_make
#define spb_reach_bounds plain_reach_bounds
#define spb_paper_errors plain_paper_errors
#define spb_samples_of_leaf plain_samples_of_leaf
#define spb_samples_of_node plain_samples_of_node
#define spb_patches_make plain_patches_make
#define spb_length_code plain_length_code
#define spb_center_step plain_center_step
#endif

#include "family.h"

#ifndef SPB_NO_VECTORS
void plain_leaves_make(const struct spb_space *space, const struct spb_record_format *format,
                       const uint8_t *records, struct spb_node *nodes, uint32_t count);
void plain_inner_make(struct spb_node *nodes, uint32_t begin, uint32_t end, bool paper, int finest);
#endif

#endif
