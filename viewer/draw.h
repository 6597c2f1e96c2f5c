/*
 * draw.h - blocks of archives become a picture.
 *
 * One header for all back ends. A back end applies the exact tests of I1, I4 and I6 to each node and triangle of the
 * blocks it is given, and draws what passes: splats that contain their pill (I5), triangles near the eye. Light comes
 * from the eye, both sides are lit. What lies behind what is already drawn is left out, which no pixel shows.
 */
#ifndef SPV_DRAW_H
#define SPV_DRAW_H

#include "lanes.h"
#include "select.h"

struct spv_ctx;
struct spv_draw;                    /* a back end */

enum spv_splat {
    SPV_SPLAT_EXACT,                /* the pill's own outline, tested at each pixel */
    SPV_SPLAT_FAST,                 /* the square around it: no test, no depth of its own */
};

enum spv_paint {                    /* what colours say */
    SPV_PAINT_SCAN,                 /* the scan's own */
    SPV_PAINT_CLUSTERS,             /* one a cluster */
    SPV_PAINT_LEVELS,               /* one a level of the cluster hierarchy */
    SPV_PAINT_NORMALS,              /* one a normal cluster */
    SPV_PAINT_KINDS,                /* points against triangles */
    SPV_PAINT_COUNT
};

struct spv_draw_options {
    enum spv_splat splat;
    enum spv_paint paint;
    uint8_t background[4];          /* rgba where nothing is drawn */
    float ambient;                  /* share of light from everywhere, 0..1 */
    int tile;                       /* largest side drawn at once, px; 0: the default */
    bool no_occlusion;              /* draw what is hidden, too; the picture is the same */
};

struct spv_item {                   /* a block to draw */
    uint32_t block;
    void *kept;                     /* what keep() of the back end's store gave; NULL: decoded as it is drawn */
    float missing;                  /* E of spec section 9: nodes of e_self up to this are drawn, too; -1: none */
};

struct spv_part {                   /* what is drawn of one archive */
    const struct spc_reader *reader;
    const struct spv_item *items;
    uint32_t item_count;
    const uint32_t *tops;           /* [top_count] clusters of which the tops are drawn, by the upper test alone */
    uint32_t top_count;
    const uint32_t *probes;         /* [probe_count] clusters that are asked about */
    uint32_t probe_count;
    uint8_t *hidden;                /* out [probe_count] 1: all of it lies behind what is drawn in this picture */
};

struct spv_drawn {                  /* of one frame */
    uint64_t nodes_processed;       /* tested */
    uint64_t nodes, triangles;      /* drawn; UINT64_MAX: this back end cannot tell */
    uint32_t clusters_hidden;       /* left out because something is before them */
};

void spv_draw_free(struct spv_draw *draw);
const char *spv_draw_name(const struct spv_draw *draw);         /* for people; borrowed */

/*
 * Draws a frame.
 *
 * in     view     camera, eps and mode
 *        tested   whose eye and eps decide what is drawn, NULL: view. Another one freezes what is drawn
 * out    rgba[height][width][4], row 0 the top one; not covered: the background; covered: alpha 255.
 *                 NULL (GL only): the picture is not read back; spv_gl_present puts it into a window
 *        drawn    may be NULL
 * fails  SPC_CHECKSUM, SPC_CORRUPT (of items that are not kept), SPC_NO_MEMORY, SPC_FEATURE (the picture is too large)
 */
enum spc_status spv_draw_frame(struct spv_draw *draw, const struct spv_view *view, const struct spv_view *tested,
                               struct spv_part *parts, uint32_t part_count, const struct spv_draw_options *options,
                               uint8_t *rgba, struct spv_drawn *drawn, struct spc_error *err);

/*
 * How far what the last frame shows at a pixel is from the eye along the camera's forward, file units, to
 * float precision. False: nothing is there, or the frame was drawn in several tiles.
 */
bool spv_draw_depth(struct spv_draw *draw, int x, int y, double *depth);

/* The blocks of a selection for the same reader and view, decoded as they are drawn. As spv_draw_frame. */
enum spc_status spv_draw_selection(struct spv_draw *draw, const struct spc_reader *reader,
                                   const struct spv_view *view, const struct spv_selection *selection,
                                   const struct spv_draw_options *options, uint8_t *rgba,
                                   struct spv_drawn *drawn, struct spc_error *err);

/*
 * Where a back end keeps decoded blocks between frames: memory, or the graphics card's.
 * Both functions only on the thread that draws.
 */
struct spv_store {
    struct spv_draw *draw;
    /*
     * Takes payload[raw_bytes] of malloc, sorted by spv_kept_sort, its own from then on, also when it fails.
     * fails (NULL): no memory
     */
    void *(*keep)(struct spv_draw *draw, const struct spc_reader *reader, uint32_t block, uint8_t *payload);
    void (*drop)(struct spv_draw *draw, void *kept);
};
void spv_draw_store(struct spv_draw *draw, struct spv_store *out);

/* A GL 3.3 back end on the current context, which must outlive it. fails SPC_FEATURE, SPC_NO_MEMORY */
enum spc_status spv_gl_create(const struct spv_ctx *ctx, struct spv_draw **out, struct spc_error *err);

/*
 * Puts the last frame, which must fit one tile, into the context's own framebuffer of width x height pixels, over a
 * background colour.
 */
void spv_gl_present(struct spv_draw *draw, const uint8_t background[3], int width, int height);

/* Is it drawn by the processor? Then the back end without GL is faster. */
bool spv_gl_is_software(const struct spv_draw *draw);

/*
 * A back end without GL, on up to threads threads; 0: one a core. The picture is the same for any number of them.
 * options.tile 0: the whole picture, in bands when it is larger than 2^26 pixels. fails SPC_NO_MEMORY
 */
enum spc_status spv_soft_create(unsigned threads, struct spv_draw **out, struct spc_error *err);

/* For tests: does with no more than lanes. The picture is the same. */
void spv_soft_narrow(struct spv_draw *soft, enum spv_lanes lanes);

#endif
