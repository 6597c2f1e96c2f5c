/*
 * bench_cut.h - what a frame processes, against what it had to; and what other methods would have processed.
 */
#ifndef BENCH_CUT_H
#define BENCH_CUT_H

#include "bench_paths.h"
#include "bench_views.h"

/*
 * The exact cut: of what is drawn, the nodes and triangles whose ball touches the picture; of a closed surface,
 * those in normal clusters that may face the eye. Its bytes: each at the mean of its block's nodes. Nothing that
 * is processed beyond it could be seen; what is behind other things is part of it.
 */
struct bench_cut {
    uint64_t processed;             /* nodes in the chosen blocks */
    uint64_t nodes, triangles;      /* that pass their tests */
    uint64_t bytes;                 /* of the chosen blocks in the file */
    uint64_t exact;                 /* nodes and triangles of the exact cut */
    double exact_bytes;
};

/* fails  as spc_block_decode */
enum spc_status bench_cut_count(const struct spc_reader *reader, const struct spv_view *view,
                                const struct spv_selection *selection, struct bench_cut *out, struct spc_error *err);

/*
 * One list for the whole model, ordered by e_parent: its nodes up to the last whose interval may reach the nearest
 * point of the model's box.
 * src  [DVS03] 4
 */
void bench_cut_one_cluster(const struct spc_reader *reader, const struct bench_paths *paths,
                           const struct spv_view *view, struct bench_cut *out);

/*
 * From the root down: leaves out a ball outside the picture with all below it, draws a node of which e_self is
 * below q, or that has no children, else goes on with its children; a leaf that is too near is a triangle.
 * The error is this archive's, so that both draw as well: the rule, not QSplat's bound.
 *
 * in   views[count], eps[eps_count] of hybrid mode; eps_count <= 16
 * out  [count * eps_count] processed: visited; nodes, triangles: drawn
 * fails  as spc_tree_load, SPC_CANCELLED
 * src  [RL00] 2.2
 */
enum { BENCH_EPS_MAX = 16 };
enum spc_status bench_cut_traversal(const struct spc_reader *reader, const struct bench_view *views, uint32_t count,
                                    const double *eps_px, uint32_t eps_count, struct bench_cut *out,
                                    struct spc_error *err);

#endif
