/*
 * budget.h - what --memory buys: the sizes of all large buffers of a build, by arithmetic.
 *
 * Reading and distributing, planning, building parts, writing: the phases take turns, each takes
 * its buffers at its start and gives them back. What is not counted here is in FIXED_BYTES.
 */
#ifndef SPB_BUDGET_H
#define SPB_BUDGET_H

#include "source.h"
#include "space.h"

struct spb_budget {
    uint64_t table;                 /* bytes: larger vertex tables are kept on disk */
    uint64_t buffers;               /* bytes: for gathering, and for distributing */
    uint64_t part_faces;            /* most faces of a part */
    unsigned threads;               /* that build parts */
    uint64_t waiting;               /* bytes: of built parts that wait for their neighbours */
    unsigned joins;                 /* nodes above the parts that are built at once */
    uint64_t least;                 /* bytes: less memory than this does not do */
    uint64_t temp;                  /* bytes of disk that temporary files take at their most */
    uint64_t sort;                  /* more of them, where corners are sorted */
    uint64_t output;                /* and the archive, at least */
};

struct spb_budget_input {
    uint64_t memory;
    unsigned threads;
    bool points;                    /* faces are points */
    uint64_t faces;                 /* triangles to come; for strips an estimate */
    uint64_t vertices;
    uint32_t vertex_bytes, record_bytes;
    uint32_t cluster_nodes, block_nodes;
};

void spb_budget_make(const struct spb_budget_input *in, struct spb_budget *out);

#endif
