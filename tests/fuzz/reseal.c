#include "reseal.h"

#include "bytes.h"
#include "layout.h"
#include "spc.h"

#include <xxhash.h>

static uint8_t *section_record(uint8_t *bytes, int s)
{
    return bytes + HD_SECTIONS + SE_SIZE * s;
}

uint32_t reseal_records(const uint8_t *bytes, size_t size, int section, uint64_t *first)
{
    const uint64_t record = section == SE_CLUS ? CL_SIZE : BL_SIZE;
    if (size < HD_SIZE)
        return 0;
    const uint8_t *se = bytes + HD_SECTIONS + SE_SIZE * section;
    const uint64_t off = load_u64(se + SE_OFF);
    const uint64_t length = load_u64(se + SE_BYTES);
    *first = off;
    if (off > size)
        return 0;
    return (uint32_t)((length < size - off ? length : size - off) / record);
}

/* Everything from the directory up is a function of the blocks' sizes. */
struct sums {
    uint64_t at, nodes, leaves, vertices;
};

static void count_block(const uint8_t *bytes, uint8_t *record, struct sums *sums,
                        uint32_t counts[2])
{
    struct spc_block b = {.node_count = load_u32(record + BL_NODE_COUNT),
                          .vertex_count = load_u32(record + BL_VERTEX_COUNT),
                          .kind = (enum spc_block_kind)record[BL_KIND],
                          .vertex_width = record[BL_VERTEX_WIDTH]};
    struct spc_block_layout layout;
    if (spc_block_layout(&b, load_u32(bytes + HD_FLAGS), load_u32(bytes + HD_NORMAL_CLUSTERS),
                         &layout) &&
        record[BL_CODEC] == SPC_CODEC_RAW)
        store_u32(record + BL_STORED_BYTES, layout.bytes);
    b.stored_bytes = load_u32(record + BL_STORED_BYTES);
    store_u64(record + BL_OFF, sums->at);
    sums->at += spc_block_chunk_bytes(&b);
    sums->vertices += b.vertex_count;
    counts[b.kind == SPC_BLOCK_LEAF] += b.node_count;
}

static void count_cluster(uint8_t *bytes, uint8_t *cluster, uint64_t blocks_off, uint32_t blocks,
                          uint32_t *next_block, struct sums *sums)
{
    uint32_t counts[2] = {0, 0};
    const uint64_t begin = sums->at;
    store_u32(cluster + CL_BLOCK_FIRST, *next_block);
    store_u64(cluster + CL_DATA_OFF, begin);
    const uint32_t left = blocks - *next_block;
    const uint32_t want = load_u32(cluster + CL_BLOCK_COUNT);
    for (uint32_t k = 0; k < (want < left ? want : left); k++, ++*next_block)
        count_block(bytes, bytes + blocks_off + (uint64_t)BL_SIZE * *next_block, sums, counts);
    store_u64(cluster + CL_DATA_BYTES, sums->at - begin);
    store_u32(cluster + CL_INNER_COUNT, counts[0]);
    store_u32(cluster + CL_LEAF_COUNT, counts[1]);
    sums->nodes += (uint64_t)counts[0] + counts[1];
    sums->leaves += counts[1];
}

static size_t reseal_counts(uint8_t *bytes, size_t size)
{
    uint64_t clusters_off = 0, blocks_off = 0;
    const uint32_t clusters = reseal_records(bytes, size, SE_CLUS, &clusters_off);
    const uint32_t blocks = reseal_records(bytes, size, SE_BLKS, &blocks_off);
    struct sums sums = {.at = align_up(load_u64(bytes + HD_HEAD_BYTES), SPC_CHUNK_ALIGN)};
    uint32_t next_block = 0;
    for (uint32_t id = 0; id < clusters; id++)
        count_cluster(bytes, bytes + clusters_off + (uint64_t)CL_SIZE * id, blocks_off, blocks,
                      &next_block, &sums);
    store_u32(bytes + HD_CLUSTER_COUNT, clusters);
    store_u32(bytes + HD_BLOCK_COUNT, blocks);
    store_u64(bytes + HD_NODE_COUNT, sums.nodes);
    store_u64(bytes + HD_LEAF_COUNT, sums.leaves);
    store_u64(bytes + HD_VERTEX_COUNT, sums.vertices);
    const uint32_t triangles = load_u32(bytes + HD_FLAGS) & SPC_FLAG_TRIANGLES;
    store_u64(bytes + HD_TRIANGLE_COUNT, triangles ? sums.leaves : 0);
    static const uint16_t none[] = {HD_SPLIT_EXTRA, HD_POINTS_IN, HD_DROPPED_BAD_INDEX,
                                    HD_DROPPED_NON_FINITE, HD_DROPPED_DEGENERATE};
    for (size_t i = 0; i < sizeof none / sizeof *none; i++)
        store_u64(bytes + none[i], 0);
    store_u64(bytes + HD_FACES_IN, sums.leaves);
    if (sums.at >= HD_SIZE && sums.at < size)
        size = (size_t)sums.at;
    store_u64(bytes + HD_FILE_BYTES, size);
    return size;
}

static void repeat_directory(const uint8_t *bytes, size_t size, const uint8_t *record,
                             uint8_t *chunk)
{
    static const uint8_t same[][3] = {      /* chunk header, block record, bytes */
        {CH_KIND, BL_KIND, 1}, {CH_CODEC, BL_CODEC, 1},
        {CH_VERTEX_WIDTH, BL_VERTEX_WIDTH, 1}, {CH_NODE_COUNT, BL_NODE_COUNT, 4},
        {CH_VERTEX_COUNT, BL_VERTEX_COUNT, 4}, {CH_STORED_BYTES, BL_STORED_BYTES, 4},
        {CH_DIAGONAL, BL_DIAGONAL, 4}, {CH_STEP_EXP, BL_STEP_EXP, 2},
        {CH_LINK_BASE, BL_LINK_BASE, 1},
    };
    uint64_t clusters_off = 0;
    const uint32_t clusters = reseal_records(bytes, size, SE_CLUS, &clusters_off);
    const uint32_t cluster = load_u32(record + BL_CLUSTER);
    store_u32(chunk + CH_MAGIC, CH_MAGIC_VALUE);
    store_u16(chunk + CH_UNIT_EXP, load_u16(bytes + HD_UNIT_EXP));
    store_u16(chunk + CH_VERTEX_EXP, load_u16(bytes + HD_VERTEX_EXP));
    chunk[CH_FLAGS] = bytes[HD_FLAGS];
    chunk[CH_NORMAL_CLUSTERS] = bytes[HD_NORMAL_CLUSTERS];
    for (size_t i = 0; i < sizeof same / sizeof *same; i++)
        memcpy(chunk + same[i][0], record + same[i][1], same[i][2]);
    if (cluster < clusters)
        memmove(chunk + CH_ORIGIN, bytes + clusters_off + (uint64_t)CL_SIZE * cluster + CL_ORIGIN,
                CH_ORIGIN_LEN);
}

/* Chunks may not lie in the head: there the next one's change would undo this one's. */
static void reseal_blocks(uint8_t *bytes, size_t size, unsigned what)
{
    uint64_t first = 0;
    const uint32_t blocks = reseal_records(bytes, size, SE_BLKS, &first);
    const uint64_t data = first + (uint64_t)BL_SIZE * blocks;
    for (uint32_t k = 0; k < blocks; k++) {
        uint8_t *record = bytes + first + (uint64_t)BL_SIZE * k;
        const struct spc_block b = {.off = load_u64(record + BL_OFF),
                                    .stored_bytes = load_u32(record + BL_STORED_BYTES)};
        const uint64_t chunk_bytes = spc_block_chunk_bytes(&b);
        if (b.off < data || !range_fits(b.off, chunk_bytes, size))
            continue;
        if (what & RESEAL_CHUNKS) {
            repeat_directory(bytes, size, record, bytes + b.off);
            const uint64_t used = CH_SIZE + (uint64_t)b.stored_bytes;
            memset(bytes + b.off + used, 0, (size_t)(chunk_bytes - used));
        }
        if (what & RESEAL_HASHES) {
            uint8_t *chunk = bytes + b.off;
            const uint64_t hash = XXH64(chunk + CH_KIND, (size_t)chunk_bytes - CH_KIND, load_u64(chunk));
            store_u64(record + BL_HASH, hash);
            store_u64(chunk + CH_HASH, hash);
        }
    }
}

size_t reseal(uint8_t *bytes, size_t size, unsigned what)
{
    if (size < HD_SIZE)
        return size;
    if (what & RESEAL_COUNTS)
        size = reseal_counts(bytes, size);
    if (what & (RESEAL_CHUNKS | RESEAL_HASHES))
        reseal_blocks(bytes, size, what);
    if (what & RESEAL_HASHES) {
        for (int s = 0; s < SE_COUNT; s++) {
            uint8_t *se = section_record(bytes, s);
            const uint64_t off = load_u64(se + SE_OFF), length = load_u64(se + SE_BYTES);
            if (range_fits(off, length, size))
                store_u64(se + SE_HASH, XXH64(bytes + off, (size_t)length, 0));
        }
        store_u64(bytes + HD_HASH, XXH64(bytes, HD_HASH, 0));
    }
    return size;
}
