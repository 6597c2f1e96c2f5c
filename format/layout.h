/*
 * layout.h - where every field lies, by the names of spec/spc-1.md.
 *
 * X(NAME, offset, bytes): in order, without gaps; tests compare the rows with the tables of the
 * spec and check that they tile their record.
 */
#ifndef SPC_LAYOUT_H
#define SPC_LAYOUT_H

#include <stdint.h>

#define SPC_MAGIC "\x89SPC\r\n\x1A\n"
enum { SPC_VERSION_DEVELOPMENT = 0xFFFF };

/* spec section 2, table "header" */
#define SPC_HEADER_LAYOUT(X)            \
    X(HD_MAGIC, 0, 8)                   \
    X(HD_VERSION, 8, 2)                 \
    X(HD_BYTES, 10, 2)                  \
    X(HD_RESERVED_BITS, 12, 4)          \
    X(HD_SPARE_BITS, 16, 4)             \
    X(HD_FLAGS, 20, 4)                  \
    X(HD_ID, 24, 16)                    \
    X(HD_FILE_BYTES, 40, 8)             \
    X(HD_HEAD_BYTES, 48, 8)             \
    X(HD_NODE_COUNT, 56, 8)             \
    X(HD_LEAF_COUNT, 64, 8)             \
    X(HD_TRIANGLE_COUNT, 72, 8)         \
    X(HD_VERTEX_COUNT, 80, 8)           \
    X(HD_CLUSTER_COUNT, 88, 4)          \
    X(HD_BLOCK_COUNT, 92, 4)            \
    X(HD_CLUSTER_NODES, 96, 4)          \
    X(HD_BLOCK_NODES, 100, 4)           \
    X(HD_NORMAL_CLUSTERS, 104, 4)       \
    X(HD_HEIGHT, 108, 4)                \
    X(HD_UNIT_EXP, 112, 4)              \
    X(HD_VERTEX_EXP, 116, 4)            \
    X(HD_BOX, 120, 48)                  \
    X(HD_FACES_IN, 168, 8)              \
    X(HD_SPLIT_EXTRA, 176, 8)           \
    X(HD_POINTS_IN, 184, 8)             \
    X(HD_DROPPED_BAD_INDEX, 192, 8)     \
    X(HD_DROPPED_NON_FINITE, 200, 8)    \
    X(HD_DROPPED_DEGENERATE, 208, 8)    \
    X(HD_E_MIN, 216, 4)                 \
    X(HD_E_MAX, 220, 4)                 \
    X(HD_SECTIONS, 224, 256)            \
    X(HD_ZERO, 480, 24)                 \
    X(HD_HASH, 504, 8)
enum { HD_SIZE = 512 };

/* spec section 3, table "section" */
#define SPC_SECTION_LAYOUT(X)           \
    X(SE_TAG, 0, 4)                     \
    X(SE_RECORD_BYTES, 4, 4)            \
    X(SE_OFF, 8, 8)                     \
    X(SE_BYTES, 16, 8)                  \
    X(SE_HASH, 24, 8)
enum { SE_SIZE = 32, SE_COUNT = 4, SE_SLOTS = 8 };  /* optional ones behind the first four */
enum {                                  /* tags, and their order in the file */
    SE_TAG_AXES = 0x53455841,           /* "AXES" */
    SE_TAG_CLUS = 0x53554C43,           /* "CLUS" */
    SE_TAG_BLKS = 0x534B4C42,           /* "BLKS" */
    SE_TAG_META = 0x4154454D,           /* "META" */
};
enum { SE_AXES, SE_CLUS, SE_BLKS, SE_META };

/* spec section 4.1, table "cluster" */
#define SPC_CLUSTER_LAYOUT(X)           \
    X(CL_PARENT, 0, 4)                  \
    X(CL_CHILD_FIRST, 4, 4)             \
    X(CL_CHILD_COUNT, 8, 4)             \
    X(CL_LEVEL, 12, 2)                  \
    X(CL_TOP_COUNT, 14, 1)              \
    X(CL_TOP_LEAF_BITS, 15, 1)          \
    X(CL_INNER_COUNT, 16, 4)            \
    X(CL_LEAF_COUNT, 20, 4)             \
    X(CL_BLOCK_FIRST, 24, 4)            \
    X(CL_BLOCK_COUNT, 28, 4)            \
    X(CL_DATA_OFF, 32, 8)               \
    X(CL_DATA_BYTES, 40, 8)             \
    X(CL_LEAVES_BELOW, 48, 8)           \
    X(CL_ORIGIN, 56, 24)                \
    X(CL_BOX, 80, 24)                   \
    X(CL_SUB_BOX, 104, 24)              \
    X(CL_SPHERE, 128, 16)               \
    X(CL_SUB_SPHERE, 144, 16)           \
    X(CL_E_SELF_MIN, 160, 4)            \
    X(CL_E_SELF_MAX, 164, 4)            \
    X(CL_E_PARENT_MIN, 168, 4)          \
    X(CL_E_PARENT_MAX, 172, 4)          \
    X(CL_RADIUS_MIN, 176, 4)            \
    X(CL_RADIUS_MAX, 180, 4)            \
    X(CL_SUB_RADIUS_MAX, 184, 4)        \
    X(CL_LINK_MAX, 188, 4)              \
    X(CL_SUB_LINK_MAX, 192, 4)          \
    X(CL_ZERO_1, 196, 4)                \
    X(CL_CONE, 200, 16)                 \
    X(CL_TOPS, 216, 96)                 \
    X(CL_ZERO_2, 312, 8)
enum { CL_SIZE = 320 };

/* spec section 4.1, table "top" */
#define SPC_TOP_LAYOUT(X)               \
    X(TP_NODE, 0, 16)                   \
    X(TP_RGBA, 16, 4)                   \
    X(TP_STEP_EXP, 20, 2)               \
    X(TP_LINK_BASE, 22, 2)
enum { TP_SIZE = 24 };

/* spec section 4.2, table "block" */
#define SPC_BLOCK_LAYOUT(X)             \
    X(BL_OFF, 0, 8)                     \
    X(BL_STORED_BYTES, 8, 4)            \
    X(BL_DIAGONAL, 12, 4)               \
    X(BL_NODE_COUNT, 16, 4)             \
    X(BL_VERTEX_COUNT, 20, 4)           \
    X(BL_CLUSTER, 24, 4)                \
    X(BL_KIND, 28, 1)                   \
    X(BL_CODEC, 29, 1)                  \
    X(BL_VERTEX_WIDTH, 30, 1)           \
    X(BL_ZERO, 31, 1)                   \
    X(BL_E_PARENT_MAX, 32, 4)           \
    X(BL_E_PARENT_MIN, 36, 4)           \
    X(BL_E_SELF_MIN, 40, 4)             \
    X(BL_LINK_MAX, 44, 4)               \
    X(BL_RADIUS_MAX, 48, 4)             \
    X(BL_STEP_EXP, 52, 2)               \
    X(BL_LINK_BASE, 54, 2)              \
    X(BL_HASH, 56, 8)
enum { BL_SIZE = 64 };

/* spec section 6.1, table "chunk header" */
#define SPC_CHUNK_LAYOUT(X)             \
    X(CH_MAGIC, 0, 4)                   \
    X(CH_UNIT_EXP, 4, 2)                \
    X(CH_VERTEX_EXP, 6, 2)              \
    X(CH_HASH, 8, 8)                    \
    X(CH_KIND, 16, 1)                   \
    X(CH_CODEC, 17, 1)                  \
    X(CH_VERTEX_WIDTH, 18, 1)           \
    X(CH_FLAGS, 19, 1)                  \
    X(CH_NODE_COUNT, 20, 4)             \
    X(CH_VERTEX_COUNT, 24, 4)           \
    X(CH_STORED_BYTES, 28, 4)           \
    X(CH_DIAGONAL, 32, 4)               \
    X(CH_STEP_EXP, 36, 2)               \
    X(CH_LINK_BASE, 38, 1)              \
    X(CH_NORMAL_CLUSTERS, 39, 1)        \
    X(CH_ORIGIN, 40, 24)
enum { CH_SIZE = 64, CH_MAGIC_VALUE = 0x4B435053 };     /* "SPCK" */

/* spec section 6.2, table "node" */
#define SPC_NODE_LAYOUT(X)              \
    X(ND_X, 0, 2)                       \
    X(ND_Y, 2, 2)                       \
    X(ND_Z, 4, 2)                       \
    X(ND_NORMAL, 6, 2)                  \
    X(ND_E_SELF, 8, 2)                  \
    X(ND_E_PARENT, 10, 2)               \
    X(ND_RADIUS, 12, 2)                 \
    X(ND_HEIGHT, 14, 1)                 \
    X(ND_LINK, 15, 1)
enum { ND_SIZE = 16 };

/* spec section 6.4, table "prelude" */
#define SPC_COLUMNS_LAYOUT(X)           \
    X(CO_FAMILY_COUNT, 0, 4)            \
    X(CO_E_SHIFT, 4, 1)                 \
    X(CO_RADIUS_SHIFT, 5, 1)            \
    X(CO_HEIGHT_SHIFT, 6, 1)            \
    X(CO_POSITION_BITS, 7, 1)           \
    X(CO_VERTEX_BASE, 8, 24)
enum { CO_SIZE = 32 };

/* Offsets by name, and the length of a field as NAME_LEN. */
enum {
#define X(name, off, bytes) name = (off), name##_LEN = (bytes),
    SPC_HEADER_LAYOUT(X)
    SPC_SECTION_LAYOUT(X)
    SPC_CLUSTER_LAYOUT(X)
    SPC_TOP_LAYOUT(X)
    SPC_BLOCK_LAYOUT(X)
    SPC_CHUNK_LAYOUT(X)
    SPC_NODE_LAYOUT(X)
    SPC_COLUMNS_LAYOUT(X)
#undef X
};

/* spec section 8, limits: a reader refuses what is over them before it allocates. */
#define SPC_CLUSTERS_MAX (1u << 24)
#define SPC_BLOCKS_MAX (1u << 26)
#define SPC_BLOCK_NODES_MAX 65535u
#define SPC_BLOCK_VERTICES_MAX 65535u
#define SPC_CLUSTER_NODES_MAX (1u << 24)
#define SPC_NORMAL_CLUSTERS_MAX 128u
#define SPC_META_BYTES_MAX (64u << 20)
#define SPC_HEIGHT_MAX 65535u
enum {
    SPC_CHUNK_ALIGN = 64,
    SPC_ARRAY_ALIGN = 16,
    SPC_EXP_MIN = -1100, SPC_EXP_MAX = 1023,    /* of unit, step and vertex lattice */
    SPC_EXP_SPAN = 80,              /* of step and vertex lattice, around the unit's */
    SPC_CHILDREN_MAX = 4,
};

#endif
