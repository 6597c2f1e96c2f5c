/*
 * spc.h - read and write .spc archives of sequential point clusters.
 *
 * The one public header of the format library. It needs libc, zstd and xxhash, holds no global
 * state, starts no thread and never prints. spec/spc-1.md defines every byte and every decoding
 * rule; names here are the names there.
 *
 *   open    spc_reader_open maps the file and checks header and directory; O(directory).
 *   select  spc_reader_cluster, spc_reader_block: what is where, without touching a node.
 *   decode  spc_block_decode: one block into caller memory, checked against its checksum.
 *   prove   spc_verify: every byte and every invariant.
 *   rescue  spc_remains_open, spc_chunk_find: what is whole of a damaged archive.
 *   write   spc_writer: blocks in file order, the head last, the target name only when all is safe.
 *
 * Caveats. Pointers that a reader returns are borrowed and die at spc_reader_close. Header and
 * directory are copied at open; chunks stay in the file, and when another process cuts it short
 * decoding one of them raises SIGBUS: replace archives by rename, never in place. A reader may be
 * used by several threads at once; a writer by one.
 *
 * Units: unless said otherwise a length is in the archive's unit, 2^unit_exp file units, and a
 * position is absolute, in file units (double).
 */
#ifndef SPC_H
#define SPC_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SPC_TOOL_VERSION "0.1.0"

/* ---- status ------------------------------------------------------------------------------- */

#define SPC_STATUS_LIST(X)                                                  \
    X(OK, 0, "success")                                                     \
    X(IO, 10, "read or write failed")                                       \
    X(NO_MEMORY, 11, "out of memory")                                       \
    X(EXISTS, 12, "the target exists")                                      \
    X(BUSY, 13, "another program is writing the target")                    \
    X(CANCELLED, 14, "cancelled")                                           \
    X(NOT_SPC, 20, "not an .spc archive")                                   \
    X(VERSION, 21, "written in a version this program does not know")       \
    X(TRUNCATED, 22, "archive ends before its data")                        \
    X(CORRUPT, 23, "archive breaks a rule of the format")                   \
    X(CHECKSUM, 24, "checksum does not match")                              \
    X(FEATURE, 25, "archive needs a feature this program does not have")    \
    X(LIMIT, 26, "a size is over a limit of the format")                    \
    X(INPUT_FORMAT, 30, "scan is not in a format that can be read")         \
    X(INPUT_TRUNCATED, 31, "scan ends before its data")                     \
    X(INPUT_EMPTY, 32, "scan holds nothing to draw")                        \
    X(INPUT_BAD, 33, "scan holds faces that cannot be used")                \
    X(INTERNAL, 90, "internal error")

enum spc_status {
#define X(name, value, text) SPC_##name = (value),
    SPC_STATUS_LIST(X)
#undef X
};

struct spc_error {          /* owned by the caller; all-zero means none */
    enum spc_status status;
    int os_errno;           /* 0 when no system call failed */
    uint64_t at_off;        /* file byte of the fault, or UINT64_MAX */
    char what[200];         /* one line, no file name, no newline */
};

/* Text of a status; "unknown status" for a number outside the list. Static storage. */
const char *spc_status_text(enum spc_status status);

/* Name of a status without its prefix, as in the list ("CORRUPT"). Static storage. */
const char *spc_status_name(enum spc_status status);

/* Fills err (may be NULL) unless it already holds an error; returns status. at_off as above. */
enum spc_status spc_fail(struct spc_error *err, enum spc_status status, uint64_t at_off,
                         const char *fmt, ...) __attribute__((format(printf, 4, 5)));

/* The same for a failed system call: keeps errno and appends its text. */
enum spc_status spc_fail_os(struct spc_error *err, int os_errno, const char *fmt, ...)
    __attribute__((format(printf, 3, 4)));

#define SPC_NO_OFF UINT64_MAX
#define SPC_NONE UINT32_MAX

/* ---- values (spec section 5) ---------------------------------------------------------------- */

/*
 * Length code: the upper 16 of the 31 magnitude bits of a float32, rounded up. 0 is 0; 0x0100 to
 * 0xFEFF are the finite values, in order, steps of 1/256 of an octave's start; SPC_LEN_ROOT is no length: only
 * the root's e_parent carries it. All other codes are invalid.
 */
enum { SPC_LEN_ZERO = 0, SPC_LEN_MIN = 0x0100, SPC_LEN_MAX = 0xFEFF, SPC_LEN_ROOT = 0xFF00 };

/* Smallest code whose value is >= v, for 0 <= v; above the largest value, SPC_LEN_MAX. */
uint16_t spc_len_encode_up(double v);

/* Largest code whose value is <= v, for v >= 0; used for bounds from below. */
uint16_t spc_len_encode_down(double v);

/* Value of a code, exact; +infinity for SPC_LEN_ROOT. */
static inline float spc_len_decode(uint16_t code)
{
    const uint32_t bits = (uint32_t)code << 15;
    float v;
    memcpy(&v, &bits, sizeof v);
    return v;
}

static inline bool spc_len_valid(uint16_t code)
{
    return code == SPC_LEN_ZERO || (code >= SPC_LEN_MIN && code <= SPC_LEN_MAX);
}

/*
 * Normal code: octahedral, two bytes nu | nv << 8, each 0..254 for -127..127. Decoding gives
 * integers on the octahedron; the unit normal is that vector over its length.
 */
uint16_t spc_normal_encode(const double n[3]);                 /* nearest of the codes around n */
void spc_normal_decode_int(uint16_t code, int n[3]);           /* |x|+|y|+|z| = 127 */
void spc_normal_decode(uint16_t code, double n[3]);            /* unit length */
static inline bool spc_normal_valid(uint16_t code)
{
    return (code & 0xFF) != 0xFF && code >> 8 != 0xFF;
}

/* Link code: (1 + m/8) 2^(base + e), code = e << 3 | m; see struct spc_block. */
uint8_t spc_link_encode_up(double v, int base);
static inline float spc_link_decode(uint8_t code, int base)
{
    const uint32_t bits = (uint32_t)(base + (code >> 3) + 127) << 23 | (uint32_t)(code & 7) << 20;
    float v;
    memcpy(&v, &bits, sizeof v);
    return v;
}
int spc_link_base(double link_max);                            /* base for a block's largest */

/* ---- what an archive holds ------------------------------------------------------------------ */

enum spc_flags {                    /* header field flags */
    SPC_FLAG_TRIANGLES = 1 << 0,    /* leaves carry their triangles (hybrid) */
    SPC_FLAG_COLORS = 1 << 1,       /* nodes and vertices carry RGBA */
    SPC_FLAG_CULL_BACK = 1 << 2,    /* closed, wound consistently: back faces are never seen */
    SPC_FLAG_ERROR_PAPER = 1 << 3,  /* e_self is the thesis' e_g, not a bound */
};

struct spc_header {
    uint32_t flags;                 /* enum spc_flags */
    uint8_t id[16];                 /* from the content */
    uint64_t file_bytes, head_bytes;
    uint64_t node_count, leaf_count;/* nodes include leaves */
    uint64_t triangle_count, vertex_count;
    uint32_t cluster_count, block_count;
    uint32_t cluster_nodes, block_nodes;        /* largest allowed when it was built */
    uint32_t normal_clusters;       /* axes in use, 1..128 */
    uint32_t height;                /* levels of the tree; 1 when the root is a leaf */
    int32_t unit_exp;               /* K: lengths are in 2^K file units */
    int32_t vertex_exp;             /* vertices lie on multiples of 2^vertex_exp file units */
    double box_min[3], box_max[3];  /* of all vertices, file units */
    uint64_t faces_in, split_extra, points_in;
    uint64_t dropped_bad_index, dropped_non_finite, dropped_degenerate;
    float e_min, e_max;             /* inner nodes' e_self, in units; 0, 0 without inner nodes */
};

/* One node as stored: 16 bytes, little-endian, ready for a GPU buffer (spec section 6). */
enum { SPC_NODE_BYTES = 16 };

struct spc_node {                   /* one node, decoded */
    double center[3];               /* file units, absolute, exact */
    double normal[3];
    double radius, height, link;    /* units; R, H, L */
    uint16_t e_self, e_parent;      /* length codes */
    uint16_t normal_code;
    uint8_t rgba[4];                /* white and opaque without SPC_FLAG_COLORS */
};

struct spc_top {                    /* copy of a cluster's top node: drawn while it is not loaded */
    uint8_t record[SPC_NODE_BYTES];
    uint8_t rgba[4];
    int16_t step_exp, link_base;    /* of the block it came from */
};

enum { SPC_TOPS_MAX = 4 };

struct spc_cluster {
    uint32_t parent;                /* SPC_NONE for cluster 0, the root's */
    uint32_t child_first, child_count;          /* children are adjacent */
    uint32_t level;                 /* 0 for the root's */
    uint32_t top_count;             /* 1..4 */
    bool tops_are_leaf[SPC_TOPS_MAX];
    uint32_t inner_count, leaf_count;
    uint32_t block_first, block_count;          /* in prefix order */
    uint64_t data_off, data_bytes;  /* all its blocks: one range of the file */
    uint64_t leaves_below;          /* of the whole subtree, itself included */
    double origin[3];               /* file units; boxes, spheres and positions count from it */
    float box[6];                   /* own nodes with radii: min xyz, max xyz; units */
    float sub_box[6];               /* the same over the whole subtree */
    float sphere[4], sub_sphere[4]; /* centre, radius; units, rounded outward */
    float e_self_min, e_self_max;   /* min r_min and r_min range as lengths; leaves count t */
    float e_parent_min, e_parent_max;           /* r_max range; +inf where the root is */
    float radius_min, radius_max, sub_radius_max;
    float link_max, sub_link_max;
    float cone[4];                  /* winding normals of all triangles below: axis, cosine of the
                                       half angle; -1: every direction */
    struct spc_top tops[SPC_TOPS_MAX];
};

enum spc_block_kind { SPC_BLOCK_INNER = 0, SPC_BLOCK_LEAF = 1 };
enum spc_codec { SPC_CODEC_RAW = 0, SPC_CODEC_ZSTD = 1 };

struct spc_block {
    uint64_t off;                   /* of its chunk */
    uint32_t stored_bytes;          /* payload as stored, behind the chunk header */
    uint32_t node_count, vertex_count;
    uint32_t cluster;
    enum spc_block_kind kind;
    enum spc_codec codec;
    uint32_t vertex_width;          /* bytes an axis of a vertex offset: 2, 4 or 8; 0 without */
    float e_parent_max, e_parent_min;           /* +inf where the root is */
    float e_self_min;               /* leaves: smallest t */
    float link_max;                 /* of this and all later blocks of the cluster */
    float radius_max;
    float diagonal;                 /* of the cluster's box: part of the links, see section 8 */
    int32_t step_exp;               /* positions: origin + q 2^step_exp, file units */
    int32_t link_base;
    uint64_t hash;                  /* of its chunk, padding included (section 6.1) */
    uint32_t raw_bytes;             /* payload decoded: spc_block_layout(...).bytes; not stored */
};

/* What the numbers of a cluster's blocks count from. */
struct spc_frame {
    uint32_t flags, normal_clusters;            /* of the archive */
    int32_t unit_exp, vertex_exp;
    double origin[3];               /* of the cluster, file units */
};

/* The inner or the leaf children of one node: they lie side by side in one block. */
struct spc_family {
    uint16_t parent;                /* in the same block, by canonical order; 0xFFFF: elsewhere */
    uint8_t size;                   /* 1..4 */
    uint8_t group;                  /* normal cluster */
};

/*
 * A decoded payload is arrays one after another, each from a multiple of 16 bytes; an absent array
 * has offset 0 and the first array is never absent. Offsets are from the payload's start.
 */
struct spc_block_layout {
    uint32_t nodes;                 /* u8 [node_count][16] */
    uint32_t colors;                /* u8 [node_count][4] */
    uint32_t groups;                /* u16 [normal_clusters][2]: nodes, cosine (section 6.3) */
    uint32_t children;              /* u4 [node_count]: inner blocks only (section 7) */
    uint32_t indices;               /* u16 [node_count][3]: leaf blocks with triangles */
    uint32_t vertex_base;           /* i64 [3]: lattice point the offsets count from */
    uint32_t vertices;              /* u16|u32|u64 [vertex_count][3] */
    uint32_t vertex_colors;         /* u8 [vertex_count][4] */
    uint32_t bytes;
};

/* False when the sizes are over the limits of the format. flags and axes as in the header. */
bool spc_block_layout(const struct spc_block *block, uint32_t flags, uint32_t normal_clusters,
                      struct spc_block_layout *out);

/* ---- reading ---------------------------------------------------------------------------------- */

struct spc_reader;

/*
 * Maps path and checks, in this order: size, magic, version, header checksum, header values,
 * section ranges and checksums, then every directory range once. Blocks are not read.
 *
 * fails  SPC_IO, SPC_NO_MEMORY, SPC_NOT_SPC, SPC_VERSION, SPC_TRUNCATED, SPC_CORRUPT,
 *        SPC_CHECKSUM, SPC_FEATURE (unknown bits that may not be ignored), SPC_LIMIT
 */
enum spc_status spc_reader_open(const char *path, struct spc_reader **out, struct spc_error *err);

/* The same over bytes in memory, which must stay until close. */
enum spc_status spc_reader_open_memory(const void *bytes, size_t size, struct spc_reader **out,
                                       struct spc_error *err);

void spc_reader_close(struct spc_reader *reader);

const struct spc_header *spc_reader_header(const struct spc_reader *reader);
const uint8_t *spc_reader_bytes(const struct spc_reader *reader, uint64_t *size);
const char *spc_reader_meta(const struct spc_reader *reader, size_t *bytes);    /* JSON, no NUL */
void spc_reader_axis(const struct spc_reader *reader, uint32_t k, double axis[3]);

/* Decode one directory record. The index must be below the header's count. */
void spc_reader_cluster(const struct spc_reader *reader, uint32_t id, struct spc_cluster *out);
void spc_reader_block(const struct spc_reader *reader, uint32_t index, struct spc_block *out);

/* Bytes of a block's chunk in the file: header, payload, padding. */
uint64_t spc_block_chunk_bytes(const struct spc_block *block);

/*
 * Checks the chunk's checksum and decodes its payload into out[block.raw_bytes], 16-byte aligned.
 * With check false the checksum is skipped (it was checked before); content is still validated.
 *
 * fails  SPC_CHECKSUM, SPC_CORRUPT (codes out of range, counts that do not sum), SPC_NO_MEMORY
 */
enum spc_status spc_block_decode(const struct spc_reader *reader, uint32_t index, bool check,
                                 void *out, struct spc_error *err);

/* What the bytes of an archive's blocks are spent on. */
#define SPC_STREAM_LIST(X)                                                  \
    X(POSITION, "positions of nodes")                                       \
    X(NORMAL, "normals")                                                    \
    X(RADIUS, "radii")                                                      \
    X(HEIGHT, "heights")                                                    \
    X(ERROR, "errors")                                                      \
    X(LINK, "links")                                                        \
    X(RELATION, "parent relation")                                          \
    X(GROUP, "normal clusters")                                             \
    X(TRIANGLE, "triangles")                                                \
    X(VERTEX, "vertices")                                                   \
    X(COLOR, "colours of nodes")                                            \
    X(VERTEX_COLOR, "colours of vertices")                                  \
    X(FRAME, "headers, tables, padding")
enum spc_stream {
#define X(name, text) SPC_STREAM_##name,
    SPC_STREAM_LIST(X)
#undef X
    SPC_STREAM_COUNT
};
const char *spc_stream_text(enum spc_stream stream);

/* Adds a block's bytes in the file to bytes[SPC_STREAM_COUNT]; nothing is decoded. */
enum spc_status spc_block_streams(const struct spc_reader *reader, uint32_t index,
                                  uint64_t bytes[SPC_STREAM_COUNT], struct spc_error *err);

/* Node i of a decoded payload. */
void spc_node_decode(const struct spc_reader *reader, const struct spc_block *block,
                     const struct spc_block_layout *layout, const uint8_t *payload, uint32_t i,
                     struct spc_node *out);

/*
 * Chunks without the directory (section 6.1): the next whole one at or behind *at in bytes[size],
 * its own checksum held. False: there is none. Its ranges and cluster stay unknown.
 */
bool spc_chunk_find(const uint8_t *bytes, uint64_t size, uint64_t *at, struct spc_block *block,
                    struct spc_frame *frame);

/* Decodes a chunk that was found, into out[block->raw_bytes]. fails as spc_block_decode */
enum spc_status spc_chunk_decode(const uint8_t *bytes, const struct spc_block *block,
                                 const struct spc_frame *frame, void *out, struct spc_error *err);

/* Vertex i of its payload, file units, exact. rgba may be NULL. */
void spc_vertex_at(const struct spc_block *block, const struct spc_frame *frame,
                   const struct spc_block_layout *layout, const uint8_t *payload, uint32_t i,
                   double xyz[3], uint8_t rgba[4]);

/*
 * What a damaged archive still says of itself: each part is there only where its own checksum and
 * rules hold, whatever else is broken. Of a whole archive everything is.
 */
struct spc_remains {
    const uint8_t *bytes;           /* the file, for spc_chunk_find */
    uint64_t size;
    const struct spc_header *header;            /* or NULL */
    const struct spc_reader *directory;         /* or NULL; for spc_reader_cluster and
                                       spc_reader_block alone: chunks may lie behind the file's end */
    const char *meta;               /* JSON without NUL, or NULL */
    size_t meta_bytes;
    struct spc_error fault;         /* why spc_reader_open refuses the archive; SPC_OK: it does not */
    struct spc_reader *head;        /* of the implementation */
    bool mapped;
};

/* Damage is no failure. fails  SPC_IO, SPC_NO_MEMORY, SPC_NOT_SPC (empty, or no regular file) */
enum spc_status spc_remains_open(const char *path, struct spc_remains *out, struct spc_error *err);

/* The same over bytes in memory, which must stay until close. fails  SPC_NO_MEMORY */
enum spc_status spc_remains_open_memory(const void *bytes, size_t size, struct spc_remains *out,
                                        struct spc_error *err);
void spc_remains_close(struct spc_remains *remains);

/* Top i of a cluster, as the node it is. */
void spc_top_decode(const struct spc_reader *reader, const struct spc_cluster *cluster, uint32_t i,
                    struct spc_node *out);

/* Vertex i of a decoded leaf payload, file units, exact. rgba may be NULL. */
void spc_vertex_decode(const struct spc_reader *reader, const struct spc_block *block,
                       const struct spc_block_layout *layout, const uint8_t *payload, uint32_t i,
                       double xyz[3], uint8_t rgba[4]);

/* ---- parent relation (spec section 7) ------------------------------------------------------- */

#define SPC_PARENT_OWNER UINT32_MAX         /* the parent is the owner, in the parent cluster */
#define SPC_NO_CHILD_CLUSTER UINT32_MAX

/*
 * A whole cluster with its parent relation. Node numbers count through the cluster's inner nodes
 * (stored order, block after block), then its leaves.
 */
struct spc_tree {
    uint32_t node_count, inner_count;
    struct spc_node *nodes;         /* [node_count] */
    uint32_t *parent;               /* [node_count] node number or SPC_PARENT_OWNER */
    uint32_t *child_cluster;        /* [inner_count] id, or SPC_NO_CHILD_CLUSTER */
    uint32_t *order;                /* [node_count] canonical order: parents before children */
    uint32_t *block_of;             /* [node_count] block index */
    uint32_t *index_in_block;       /* [node_count] */
};

/* Decodes a cluster and replays its relation. Free with spc_tree_free. fails as spc_block_decode */
enum spc_status spc_tree_load(const struct spc_reader *reader, uint32_t cluster,
                              struct spc_tree **out, struct spc_error *err);
void spc_tree_free(struct spc_tree *tree);

/* ---- proof ------------------------------------------------------------------------------------ */

/* One finding: an invariant held or broke. Called once per invariant and again per broken place. */
struct spc_finding {
    const char *invariant;          /* one line, static */
    bool ok;
    struct spc_error error;         /* where and what, when not ok */
};
typedef void (*spc_finding_fn)(void *ctx, const struct spc_finding *finding);

/*
 * Level 1: directory. Level 2: every byte, every chunk, every code. Level 3: parent relation, law,
 * monotone errors, links, pills. Reports through fn (may be NULL) and goes on where it can.
 * Returns SPC_OK when nothing was found, else the status of the first fault.
 */
enum spc_status spc_verify(const struct spc_reader *reader, int level, spc_finding_fn fn, void *ctx,
                           struct spc_error *err);

/* ---- writing ---------------------------------------------------------------------------------- */

struct spc_writer;

/*
 * Creates the file: unnamed beside path where the system can, else path.part under a lock. Called
 * before the long work, so that a target that cannot be written is known at once.
 *
 * fails  SPC_EXISTS without force, SPC_BUSY, SPC_IO, SPC_NO_MEMORY
 */
enum spc_status spc_writer_create(const char *path, bool force, struct spc_writer **out,
                                  struct spc_error *err);

/*
 * Reserves the head. Of header, cluster_count, block_count, normal_clusters, flags, unit_exp and
 * vertex_exp are read, and must be the same at finish. Once, before the first cluster.
 * fails  SPC_NO_MEMORY, SPC_LIMIT (more clusters, blocks or metadata than a reader takes)
 */
enum spc_status spc_writer_begin(struct spc_writer *writer, const struct spc_header *header,
                                 size_t meta_bytes, struct spc_error *err);

/*
 * Appends a cluster: clusters come in order of their ids.
 *
 * in     blocks[cluster->block_count] in prefix order, stored[k]: blocks[k].stored_bytes payload
 * out    cluster->block_first, data_off, data_bytes; blocks[k].cluster, off, hash
 */
enum spc_status spc_writer_cluster(struct spc_writer *writer, uint32_t id,
                                   struct spc_cluster *cluster, struct spc_block *blocks,
                                   const void *const *stored, struct spc_error *err);

/*
 * Writes the head and syncs the file, which has no name yet; meta[meta_bytes].
 * out    header->file_bytes, head_bytes, id
 * fails  SPC_IO, SPC_INTERNAL
 */
enum spc_status spc_writer_seal(struct spc_writer *writer, struct spc_header *header,
                                const char *meta, struct spc_error *err);

/*
 * Gives the sealed file its name and syncs the folder. An old target is back when that fails,
 * where the file system can exchange two names.
 * fails  SPC_IO, SPC_EXISTS (the target appeared meanwhile), SPC_BUSY, SPC_INTERNAL
 */
enum spc_status spc_writer_finish(struct spc_writer *writer, struct spc_error *err);

/* Frees the writer. Without a successful finish nothing is left under the target's name. */
void spc_writer_close(struct spc_writer *writer);

/*
 * What encoding needs, kept from block to block; for one thread at a time. level: zstd's.
 * fails  SPC_NO_MEMORY
 */
struct spc_encoder;
enum spc_status spc_encoder_create(int level, struct spc_encoder **out, struct spc_error *err);
void spc_encoder_free(struct spc_encoder *encoder);

/*
 * Encodes a payload (struct spc_block_layout) with block->codec.
 *
 * in     families[family_count] in canonical order: together all nodes of the block. With
 *        triangles, leaf records are those of spc_leaf_record, vertices are numbered by first use
 *        in canonical order, and leaves of a family share e_parent and link. In inner blocks links
 *        of nodes whose parent lies in the block are those of spc_link_record.
 *        payload[layout->bytes]
 * out    stored[spc_block_stored_bound(layout->bytes)]; block->stored_bytes
 * fails  SPC_NO_MEMORY, SPC_INTERNAL
 */
size_t spc_block_stored_bound(uint32_t raw_bytes);
enum spc_status spc_block_encode(struct spc_block *block, const struct spc_block_layout *layout,
                                 const struct spc_frame *frame, const struct spc_family *families,
                                 uint32_t family_count, const uint8_t *payload,
                                 struct spc_encoder *encoder, uint8_t *stored,
                                 struct spc_error *err);

/*
 * A leaf's disk from its triangle (section 6.5): fills x, y, z, normal, e_self, radius and height
 * of record[16]; e_parent and link are the caller's. corner: lattice numbers. False when the disk
 * does not fit the block's positions.
 */
bool spc_leaf_record(const struct spc_frame *frame, int step_exp, const int64_t corner[3][3],
                     uint8_t *record);

/* Link code of a node whose parent lies in the same block (section 6.4.2), from both records. */
uint8_t spc_link_record(const struct spc_block *block, const struct spc_frame *frame,
                        const uint8_t *record, const uint8_t *parent);

/* Axis table of the format for a count of normal clusters: Q15 integers, see spec section 6.3. */
void spc_axes_standard(uint32_t count, int16_t axes[][3]);

/* Number of the axis nearest to a normal code: largest dot product, lowest number on ties. */
uint32_t spc_axis_nearest(const int16_t axes[][3], uint32_t count, uint16_t normal_code);

#ifdef __cplusplus
}
#endif

#endif
