/*
 * select.h - which blocks a picture needs.
 *
 * Camera and directory in, blocks out: no GL, no node is read. Everything here is conservative
 * (I7): a block is left out only if nothing in it could be drawn and seen. The exact tests run
 * where the nodes are, in the shader.
 */
#ifndef SPV_SELECT_H
#define SPV_SELECT_H

#include "camera.h"

enum { SPV_RANGES_MAX = 128 };
enum spv_mode { SPV_HYBRID, SPV_POINTS, SPV_TRIANGLES };

struct spv_view {
    struct spv_camera camera;
    double eps;                     /* accepted error, an angle: spv_camera_eps */
    enum spv_mode mode;
    bool cull;                      /* off: everything that could be drawn, seen or not */
};

struct spv_chosen {
    uint32_t block;
    float error;                    /* largest projected error that leaving it out would show, px */
};

struct spv_visit {                  /* a cluster that is still to be looked at */
    uint32_t cluster;
    bool inside;                    /* nothing below its parent lies outside of the picture */
};

struct spv_selection {
    struct spv_chosen *blocks;      /* by cluster, coarse first, in prefix order inside */
    uint32_t block_count, block_max;
    uint32_t clusters_total, clusters_drawn;
    uint32_t culled_frustum, culled_backface, culled_range;     /* clusters met and left out */
    uint64_t nodes;                 /* in the chosen blocks */
    uint64_t bytes;                 /* their chunks */
    struct spv_visit *stack;
    uint32_t stack_max;
};

/*
 * Fills selection (zeroed, or from an earlier frame).
 * fails  SPC_NO_MEMORY
 */
enum spc_status spv_select(const struct spc_reader *reader, const struct spv_view *view,
                           struct spv_selection *selection, struct spc_error *err);
void spv_selection_release(struct spv_selection *selection);

/* Camera position in a cluster's coordinates: from its origin, in units. */
void spv_eye_of_cluster(const struct spc_reader *reader, const struct spc_cluster *cluster,
                        const struct spv_camera *camera, double eye[3]);

/* Square of the distance from the eye to the cluster's box, units; 0 inside. eye: in the cluster's coordinates. */
double spv_box_distance2(const struct spc_cluster *cluster, const double eye[3]);

/* The same of a cluster by its number, in units of 2^unit_exp, which may be another archive's. */
double spv_cluster_distance2(const struct spc_reader *reader, const struct spv_camera *camera, uint32_t cluster,
                             int unit_exp);

/*
 * May back faces be left out? Only of a closed surface, and only from outside its box: there every
 * ray meets a front face first, so nothing that is seen is missing. From within, the eye may be
 * inside the surface and look at its back.
 */
bool spv_culls_back(const struct spc_reader *reader, const struct spv_view *view);

/*
 * True when every triangle of a group is seen from behind: its points lie in the sphere, its
 * winding normals in the cone. eye, sphere: same coordinates.
 */
bool spv_all_behind(const double eye[3], const float sphere[4], const double axis[3],
                    double cosine);

/* The same for normal cluster g of a decoded block; groups: of its payload. */
bool spv_group_behind(const struct spc_reader *reader, const struct spc_cluster *cluster, const double eye[3],
                      uint32_t g, const uint8_t *groups);

struct spv_ranges {                 /* of a block's nodes */
    uint32_t count;
    int first[SPV_RANGES_MAX], nodes[SPV_RANGES_MAX];
};

/*
 * Nodes of a decoded block that may face the eye: its normal clusters, neighbours joined; all of them
 * where back faces are seen.
 *
 * in     eye  of spv_eye_of_cluster;  groups  of the block's payload
 */
void spv_visible_ranges(const struct spc_reader *reader, const struct spv_view *view,
                        const struct spc_block *block, const struct spc_cluster *cluster,
                        const double eye[3], const uint8_t *groups, struct spv_ranges *out);

#endif
