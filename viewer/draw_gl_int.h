/*
 * draw_gl_int.h - what the files of the OpenGL back end share.
 *
 *   draw_gl.c    life, programs, frames, tiles
 *   gl_target.c  the framebuffer: size, reading back, presenting
 *   gl_store.c   blocks on the card
 *   gl_block.c   draws blocks, and tops of clusters that are missing
 *   gl_hide.c    leaves out what lies behind
 *
 * A picture is drawn into a framebuffer larger than it by GUARD pixels on every side: a point vanishes when
 * its centre leaves the viewport, so points of up to 2 GUARD pixels are never cut short at the picture's
 * border. Larger splats, and those that cross the eye's plane, are quads, in a second pass over the blocks
 * that can hold any. Pictures larger than a tile are drawn in tiles.
 */
#ifndef SPV_DRAW_GL_INT_H
#define SPV_DRAW_GL_INT_H

#include "draw_int.h"
#include "gl_int.h"

enum { GUARD = 32 };

/* Vertex attributes of the splat program. */
enum { AT_NODE, AT_COLOR, AT_PLACE };

struct program {
    GLuint id;
    GLint place, eps, range, view, focal, center, size, limit, pad, near, quads, fast, ambient, base_hi, base_lo,
        eye_rest, lattice, at, width, all, colored, paint, rect, depth, scale, background, guard;
};

/* A block on the card: its payload as it is in one buffer, looked at as texels of 16 and of 4 bytes. */
enum { VIEW_NODES, VIEW_WORDS, VIEW_COUNT };
struct gl_block {
    GLuint buffer, textures[VIEW_COUNT];
    struct spc_block_layout l;
    int64_t vertex_base[3];
    uint8_t facts[];                /* groups of the payload; kept: behind them [node_count][2], e_parent */
};

struct gl_part {                    /* of the frame */
    const struct spv_part *part;
    const struct spc_header *header;
    float near;                     /* units: the same length in all parts */
    float lattice;                  /* step of vertices, units */
    int64_t eye_lattice[3];         /* lattice point that corners count from */
    float eye_rest[3];              /* from the eye to it, units */
    bool colored;
};

struct gl_cluster {                 /* to draw: items side by side in a part's list */
    double distance2;               /* of its box from the eye, in the first part's unit */
    uint32_t part, cluster, first, count;
    bool asked;                     /* whether it is hidden */
    bool seen;                      /* in some tile */
    uint64_t nodes;                 /* that were tested */
};

struct gl_asked {                   /* queries */
    GLuint *ids;
    uint32_t *of;                   /* number of the cluster or probe */
    uint64_t *nodes;                /* of the cluster */
    uint64_t nodes_total;           /* of the frame, if nothing were hidden */
    uint32_t count, max;            /* in use; made by GL */
};

struct spv_gl {
    struct spv_draw base;
    struct spv_gl_api api;
    struct program splat, triangle, box, show;
    GLuint vao, frame, color, depth, tops;
    int side_max;                   /* px, of the framebuffer */
    int allocated_width, allocated_height, target_width, target_height;     /* px, guard included */
    int picture_width, picture_height;      /* of the last tile */
    bool one_tile;                  /* which is the whole frame */
    int near_exp;                   /* of depths: 2^near_exp file units over the distance */
    size_t texels_max;              /* of a buffer that a shader reads */
    float point_limit;              /* px */
    GLenum query;                   /* cheapest kind that never says hidden of what is seen */
    bool software, occlude;
    struct gl_block *stream;        /* for what is not kept; room for all groups */
    uint8_t *payload;               /* decoded block */
    size_t payload_max;
    struct gl_part *parts;
    struct gl_cluster *clusters;
    uint8_t *top_bytes;
    size_t parts_max, clusters_max, top_bytes_max;
    struct gl_asked asked[2], probed;       /* clusters, of this frame and the one before; probes */
    unsigned turn;                  /* which of asked is this frame's */
};

struct gl_frame {                   /* what one call shares */
    struct spv_gl *gl;
    const struct frame_input *in;
    size_t cluster_count;           /* gl->clusters, near first */
    uint32_t part_set;              /* whose uniforms are set */
    int x0, y0, width, height;      /* the tile in the picture, px, from the top left */
    double center[2];               /* px in the target, from below: where the view's axis meets it */
};

static inline struct spv_gl *spv_gl_of(struct spv_draw *draw)
{
    return (struct spv_gl *)draw;
}

/* array[count], larger if need be; its content is lost. fails (false): no memory, *max is 0 */
bool spv_gl_room(void **array, size_t *max, size_t count, size_t each);

/* What GL complains of, if it does. fails SPC_NO_MEMORY, SPC_FEATURE */
enum spc_status spv_gl_check(const struct spv_gl *gl, struct spc_error *err);

/* Makes uniforms of both programs those of a part. */
void spv_gl_use_part(struct gl_frame *f, uint32_t part);

/* ---- gl_target.c ------------------------------------------------------------------------------- */

/* Clears a target for a picture of so many pixels. fails SPC_FEATURE */
enum spc_status spv_gl_target(struct spv_gl *gl, int width, int height, struct spc_error *err);
/* Depth of a pixel of the last tile; 0: nothing is there. */
float spv_gl_read_depth(const struct spv_gl *gl, int x, int y);
enum spc_status spv_gl_read(const struct gl_frame *f, uint8_t *rgba, struct spc_error *err);

/* ---- gl_store.c -------------------------------------------------------------------------------- */

void *spv_gl_keep(struct spv_draw *draw, const struct spc_reader *reader, uint32_t block, uint8_t *payload);
void spv_gl_drop(struct spv_draw *draw, void *kept);

/* Room for blocks that are not kept. fails (false): no memory */
bool spv_gl_stream_create(struct spv_gl *gl);

/* Decodes a block into it. fails SPC_CHECKSUM, SPC_CORRUPT, SPC_NO_MEMORY, SPC_FEATURE */
enum spc_status spv_gl_stream(struct spv_gl *gl, const struct spc_reader *reader, uint32_t block, bool sorted,
                              const struct gl_block **out, struct spc_error *err);

/* ---- gl_block.c -------------------------------------------------------------------------------- */

/* Draws a cluster's items; the nodes tested are counted in it. Fails as spv_gl_stream. */
enum spc_status spv_gl_draw_cluster(struct gl_frame *f, struct gl_cluster *cluster, struct spc_error *err);

/* Draws the tops of clusters of which nothing is there. fails SPC_NO_MEMORY */
enum spc_status spv_gl_draw_tops(struct gl_frame *f, uint32_t part, uint64_t *tested, struct spc_error *err);

/* ---- gl_hide.c --------------------------------------------------------------------------------- */

struct gl_rect {
    float px[4];                    /* x0, y0, x1, y1 in the target, from below */
    float depth;
    bool inside;                    /* of the picture, at least in part */
};

/*
 * Rectangle around all pixels of a cluster's nodes and triangles, and a depth that none of them reaches.
 * False: it may be seen, without asking.
 */
bool spv_gl_rect(const struct gl_frame *f, uint32_t part, uint32_t cluster, struct gl_rect *out);

/* Draws all clusters of the frame, near first, and leaves out those that are hidden. */
enum spc_status spv_gl_draw_clusters(struct gl_frame *f, struct spc_error *err);

/* Asks, once all is drawn, which probes are hidden. fails SPC_NO_MEMORY */
enum spc_status spv_gl_probe(struct gl_frame *f, struct spc_error *err);

/*
 * Reads the answers of a tile, when the picture is read back anyway; or, later, those of the frame before,
 * which are there: then the figures are that frame's.
 */
void spv_gl_read_tile(struct gl_frame *f, struct spv_drawn *drawn);
void spv_gl_read_later(struct gl_frame *f, struct spv_drawn *drawn);

/* After the last tile: probes are hidden or not, none of them unless whole; clusters are counted unless NULL. */
void spv_gl_finish_hidden(struct gl_frame *f, bool whole, struct spv_drawn *drawn);
void spv_gl_hide_release(struct spv_gl *gl);

/* For tests: leaves out what lies behind, also where the processor draws and that does not pay; or never. */
void spv_gl_occlude(struct spv_draw *draw, bool on);

#endif
