/*
 * scene.h - archives on their way into pictures: opened, selected, in memory as far as the budget goes,
 * drawn by one back end.
 */
#ifndef SPV_SCENE_H
#define SPV_SCENE_H

#include "draw.h"

enum { SPV_SCENE_ARCHIVES_MAX = 64 };

struct spv_scene_options {
    uint64_t budget;                /* bytes of decoded blocks, of all archives together */
    uint64_t upload_bytes;          /* that a back end is given in a frame; 0: any */
    unsigned threads;               /* that read and decode; 0: one a core */
};

struct spv_scene_stats {            /* of one frame, all archives together */
    struct spv_drawn drawn;
    uint64_t nodes_total;           /* in the archives */
    uint64_t nodes_chosen;          /* in the chosen blocks */
    uint64_t bytes_chosen;          /* their chunks */
    uint32_t clusters_total, clusters_drawn;
    uint32_t culled_frustum, culled_backface, culled_range;
    uint32_t blocks_missing, blocks_failed;     /* wanted, not there yet; of them those that cannot be read */
    uint32_t blocks_hidden;         /* of the missing: not asked for, because they could not be seen */
    uint32_t tops;                  /* clusters of which the tops stand in */
    uint64_t bytes_read;            /* of chunks, since the frame before */
    uint64_t bytes_resident;        /* decoded */
    double select_ms, draw_ms;
};

struct spv_scene;

/* draw must outlive the scene, or its use in it. fails SPC_NO_MEMORY */
enum spc_status spv_scene_create(const struct spv_scene_options *options, struct spv_draw *draw,
                                 struct spv_scene **out, struct spc_error *err);
void spv_scene_free(struct spv_scene *scene);

/*
 * Adds an archive. fails as spc_reader_open, SPC_LIMIT: there are SPV_SCENE_ARCHIVES_MAX; the scene is as before
 */
enum spc_status spv_scene_open(struct spv_scene *scene, const char *path, struct spc_error *err);

/* Another back end from now on: what was kept by the last one is given up. fails SPC_NO_MEMORY: nothing changed */
enum spc_status spv_scene_use(struct spv_scene *scene, struct spv_draw *draw, struct spc_error *err);

uint32_t spv_scene_count(const struct spv_scene *scene);
const struct spc_reader *spv_scene_reader(const struct spv_scene *scene, uint32_t i);
const char *spv_scene_path(const struct spv_scene *scene, uint32_t i);

/* Box of all archives, file units; false: there are none. */
bool spv_scene_box(const struct spv_scene *scene, double box_min[3], double box_max[3]);

/*
 * Draws what is there, never waits for a disk. view, frozen (as tested), options, rgba as in spv_draw_frame.
 * What a frame needs that is missing is asked for; while nothing is, what comes next along the camera's
 * motion.
 *
 * fails  as spv_draw_frame; blocks that cannot be read are no failure (spv_scene_fault)
 */
enum spc_status spv_scene_frame(struct spv_scene *scene, const struct spv_view *view, const struct spv_view *frozen,
                                const struct spv_draw_options *options, uint8_t *rgba,
                                struct spv_scene_stats *stats, struct spc_error *err);

/*
 * Reads what the view needs, without drawing, until all of it is there, the budget is full, or the rest
 * cannot be read. *missing: blocks that are not there. fails SPC_NO_MEMORY
 */
enum spc_status spv_scene_load(struct spv_scene *scene, const struct spv_view *view, uint32_t *missing,
                               struct spc_error *err);

/* Bytes of blocks that frames and loads have read so far, as stored. */
uint64_t spv_scene_bytes_read(const struct spv_scene *scene);

/* Blocks that are being read. */
unsigned spv_scene_busy(const struct spv_scene *scene);

/* Waits until some block was read; false when none is being read. */
bool spv_scene_wait(struct spv_scene *scene);

/* The archive that could not be read last, and why; SPV_SCENE_ARCHIVES_MAX: all is well. */
uint32_t spv_scene_fault(const struct spv_scene *scene, struct spc_error *err);

#endif
