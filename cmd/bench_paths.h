/*
 * bench_paths.h - leaves spread over an archive, each with its path to the root: what is drawn for them, and how
 * far that is from their triangles.
 */
#ifndef BENCH_PATHS_H
#define BENCH_PATHS_H

#include "select.h"

enum { BENCH_LEAVES = 32768, BENCH_LEAF_POINTS = 7 };

struct bench_path_node {
    double center[3], normal[3];    /* file units; unit length */
    double radius, e_self, e_parent, link;      /* file units; the root's e_parent: infinity */
    uint32_t parent;                /* SPC_NONE: the root */
};

struct bench_leaf {
    uint32_t node;
    /* Corners, middles of edges, middle of the triangle, file units; without triangles, only the disk's centre. */
    double point[BENCH_LEAF_POINTS][3];
};

struct bench_paths {
    uint32_t point_count;           /* of each leaf */
    struct bench_path_node *nodes;
    struct bench_leaf *leaves;      /* every so many of all, in file order, at most BENCH_LEAVES and some */
    uint32_t node_count, node_max, leaf_count;
    uint64_t parents[65536];        /* nodes of the whole archive by their code of e_parent */
};

/* Reads all clusters, one in memory at a time. fails  as spc_tree_load, SPC_CANCELLED; release in any case */
enum spc_status bench_paths_read(const struct spc_reader *reader, struct bench_paths *out, struct spc_error *err);
void bench_paths_release(struct bench_paths *paths);

/* A point of every leaf, [leaf_count]: for bench_views. NULL without memory. */
double (*bench_paths_points(const struct bench_paths *paths))[3];

/*
 * How far what is drawn is from the surface, in pixels as eps counts them: the distance from a point of the
 * surface to the disk that is drawn for it, over the point's distance from the eye, as an angle. Of points in the
 * picture. A triangle that is drawn is the surface: 0. Where a path is drawn twice, the disk further off counts.
 */
struct bench_distance {
    uint64_t points;                /* 0: the rest says nothing */
    double mean, p999, max;         /* px */
    double doubles;                 /* share of the leaves in the picture whose path is drawn more than once */
    uint64_t missed;                /* leaves in the picture for which nothing is drawn: none */
};

/* view: with camera, eps and mode. triangles: the archive has some. fails  SPC_NO_MEMORY */
enum spc_status bench_paths_measure(const struct bench_paths *paths, const struct spv_view *view, bool triangles,
                                    struct bench_distance *out, struct spc_error *err);

#endif
