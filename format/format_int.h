/* format_int.h - shared between the files of format/, not included from outside. */
#ifndef SPC_FORMAT_INT_H
#define SPC_FORMAT_INT_H

#include "layout.h"
#include "spc.h"

struct spc_section {
    uint32_t tag, record_bytes;
    uint64_t off, bytes, hash;
};

/* Header record; out[HD_SIZE] includes its hash. */
void spc_header_encode(const struct spc_header *header, const struct spc_section sections[SE_COUNT],
                       uint8_t *out);
/*
 * Checks everything about the header alone, in the order of the spec: size, magic, version,
 * checksum, reserved bits, values. size is the file's.
 */
enum spc_status spc_header_decode(const uint8_t *in, uint64_t size, struct spc_header *out,
                                  struct spc_section sections[SE_SLOTS], struct spc_error *err);

/* Directory records. Decoding accepts any bytes; checking is spc_directory_check. */
void spc_cluster_encode(const struct spc_cluster *cluster, uint8_t *out);
void spc_cluster_decode(const uint8_t *in, struct spc_cluster *out);
void spc_block_record_encode(const struct spc_block *block, uint8_t *out);
void spc_block_record_decode(const uint8_t *in, struct spc_block *out);

/* Chunk header out[CH_SIZE] of a block; with its hash, which covers the rest of the chunk. */
void spc_chunk_encode(const struct spc_block *block, const struct spc_frame *frame, uint8_t *out);

/* The same read back: any bytes; off: where it lies. Ranges and cluster are not known from it. */
void spc_chunk_parse(const uint8_t *in, uint64_t off, struct spc_block *block,
                     struct spc_frame *frame);

/* Hash of a chunk but for its magic, exponents and hash; the first eight bytes are the seed. */
uint64_t spc_chunk_hash(const uint8_t *chunk, uint64_t chunk_bytes);

/* Exponents of an archive are within the limits, and near each other. */
bool spc_units_ok(int32_t unit_exp, int32_t vertex_exp);

/* Exponents and origin are within the limits, and every position is finite. */
bool spc_exponents_ok(const struct spc_block *block, const struct spc_frame *frame);

/* Sizes of a block agree with each other and the limits; fills layout. */
bool spc_block_ok(const struct spc_block *block, uint32_t flags, uint32_t normal_clusters,
                  struct spc_block_layout *layout);

/* Every range, count and order of the directory, once (level 1 of verify runs the same). */
enum spc_status spc_directory_check(const struct spc_reader *reader, struct spc_error *err);

/* First byte behind the head where chunks may begin. */
static inline uint64_t spc_data_start(uint64_t head_bytes)
{
    return (head_bytes + SPC_CHUNK_ALIGN - 1) & ~(uint64_t)(SPC_CHUNK_ALIGN - 1);
}

/* The codes of one node's record are those of the spec, and e_self <= e_parent. */
bool spc_record_ok(const uint8_t *record);

/* Codes, counts and groups of a decoded payload. at_off names the chunk in messages. */
enum spc_status spc_payload_check(const struct spc_block *block,
                                  const struct spc_block_layout *layout, uint32_t normal_clusters,
                                  const uint8_t *payload, struct spc_error *err);

struct spc_reader {
    const uint8_t *bytes;
    uint64_t size;
    const uint8_t *head;            /* bytes, or an own copy of all before the chunks */
    bool mapped;
    struct spc_header header;
    struct spc_section sections[SE_SLOTS];
};

/* Maps a whole regular file, at least a byte of it; munmap ends it. */
enum spc_status spc_map_file(const char *path, const uint8_t **bytes, uint64_t *size,
                             struct spc_error *err);

/* Child code of an inner node (spec section 7): 0 an owner, else 1, 4 or 8 for 2, 3, 4 children. */
static inline uint32_t spc_children_of(uint32_t code)
{
    return code == 0 ? 0 : code < 4 ? 2 : code < 8 ? 3 : 4;
}

/* And how many of them are inner ones, which is added to it. */
static inline uint32_t spc_inner_children_of(uint32_t code)
{
    return code == 0 ? 0 : code < 4 ? code - 1 : code < 8 ? code - 4 : code - 8;
}

/* Smallest link code whose value is >= v; 255 when none is. */
static inline uint8_t spc_link_bound(double v, int base)
{
    if (v <= (double)spc_link_decode(0, base))
        return 0;
    if (v > (double)spc_link_decode(255, base))
        return 255;
    const float nearest = (float)v;
    uint32_t bits;
    memcpy(&bits, &nearest, sizeof bits);
    uint32_t code = (bits >> 20) - ((uint32_t)(base + 127) << 3);   /* may lie a step below v */
    while ((double)spc_link_decode((uint8_t)code, base) < v)
        code++;
    return (uint8_t)code;
}

/* What the blocks of a cluster count from. */
struct spc_frame spc_reader_frame(const struct spc_reader *reader, uint32_t cluster);

#endif
