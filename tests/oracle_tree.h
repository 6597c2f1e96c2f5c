/*
 * oracle_tree.h - for tests of viewing: a whole archive as one tree, its nodes tested one by one.
 *
 * Selection and shaders work with ranges, prefixes and intervals over blocks. This joins all
 * clusters by their parent relation instead and knows none of that: what it draws is what the
 * rules I1, I4 and I6 say of each node, or what a recursive traversal says of the tree.
 */
#ifndef ORACLE_TREE_H
#define ORACLE_TREE_H

#include "interval.h"
#include "select.h"

enum { ORACLE_POINT = 1, ORACLE_TRIANGLE = 2 };     /* of a node: its splat, its triangle */

struct oracle_node {
    double center[3], normal[3];    /* file units; unit length */
    double radius, height, link;    /* units */
    double e_self, e_parent;        /* units; e_parent of the root: infinity */
    uint16_t code_self, code_parent;
    bool leaf;
    uint32_t parent;                /* node; SPC_NONE: the root */
    uint32_t child_first, child_count;          /* in oracle_tree.child */
    uint32_t triangle;              /* leaves: in oracle_tree.corner */
    uint32_t cluster, block, index_in_block;
    uint32_t axis;                  /* its normal cluster's, and the cosine stored for that */
    double cosine;
    uint8_t record[SPC_NODE_BYTES];
};

struct oracle_tree {
    const struct spc_reader *reader;
    const struct spc_header *header;
    struct spc_cluster *clusters;
    struct spc_block *blocks;
    uint32_t node_count, leaf_count;
    struct oracle_node *nodes;      /* parents before children, clusters by their ids */
    uint32_t *child;                /* those of one node next to each other */
    uint32_t *stored;               /* node by place in the file: block after block */
    uint32_t *stored_first;         /* [block_count + 1] into stored */
    double (*corner)[3][3];         /* [leaf_count] file units; with SPC_FLAG_TRIANGLES */
    double size;                    /* diagonal of the box, file units */
};

/* Any failure, and any place where the clusters do not fit together, fails the test. */
void oracle_load(struct oracle_tree *tree, const struct spc_reader *reader);
void oracle_free(struct oracle_tree *tree);

/* Has the leaf a triangle to give way to in this view? */
bool oracle_hybrid(const struct oracle_tree *tree, const struct spv_view *view);

/* A point from the eye, in units. */
void oracle_from_eye(const struct oracle_tree *tree, const struct spv_view *view,
                     const double p[3], double out[3]);

double oracle_q(const struct oracle_tree *tree, const struct oracle_node *node,
                const struct spv_view *view);

/* I4 alone, in double. */
bool oracle_upper(const struct oracle_node *node, double q, double eps);

/* What a shader is given for a block. */
struct spv_interval oracle_interval(const struct oracle_tree *tree, uint32_t block,
                                    const struct spv_view *view);

/* What is drawn, as drawn[node_count] of ORACLE_ bits: by the tests in double, in float32, ... */
void oracle_draw_double(const struct oracle_tree *tree, const struct spv_view *view,
                        uint8_t *drawn);
void oracle_draw_float(const struct oracle_tree *tree, const struct spv_view *view,
                       uint8_t *drawn);

/* ... and by recursion from the root, in double: the first node that is fine enough, else on. */
void oracle_draw_recursion(const struct oracle_tree *tree, const struct spv_view *view,
                           uint8_t *drawn);

/*
 * How often each path is drawn. *bare: a leaf whose path is not drawn at all, else SPC_NONE.
 * out  (return) paths that are drawn twice or more
 */
uint32_t oracle_paths(const struct oracle_tree *tree, const uint8_t *drawn, uint32_t *bare);

#endif
