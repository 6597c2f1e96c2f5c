/*
 * streams.c - what the bytes of a block are spent on.
 *
 * The planes of the zstd codec come in the order that columns.c, node_columns.c and
 * triangle_columns.c put them in (spec section 6.4).
 */
#include "format_int.h"

#include "bytes.h"
#include "planes.h"

struct run {                        /* planes in a row that serve one stream */
    enum spc_stream stream;
    uint32_t planes;
};

const char *spc_stream_text(enum spc_stream stream)
{
    static const char *const TEXT[] = {
#define X(name, text) text,
        SPC_STREAM_LIST(X)
#undef X
    };
    return stream < SPC_STREAM_COUNT ? TEXT[stream] : "unknown";
}

enum { RUNS_MAX = 16 };

static uint32_t node_runs(struct run *r, bool colors)
{
    uint32_t n = 0;
    r[n++] = (struct run){SPC_STREAM_POSITION, 6};
    r[n++] = (struct run){SPC_STREAM_NORMAL, 2};
    r[n++] = (struct run){SPC_STREAM_RADIUS, 2};
    r[n++] = (struct run){SPC_STREAM_ERROR, 2};
    r[n++] = (struct run){SPC_STREAM_HEIGHT, 1};
    if (colors)
        r[n++] = (struct run){SPC_STREAM_COLOR, 4};
    return n;
}

static uint32_t list_runs(const struct spc_block *b, const struct spc_block_layout *l,
                          struct run r[RUNS_MAX])
{
    uint32_t n = 0;
    r[n++] = (struct run){SPC_STREAM_RELATION, b->kind == SPC_BLOCK_INNER ? 2 : 1};
    r[n++] = (struct run){SPC_STREAM_GROUP, 1};
    r[n++] = (struct run){SPC_STREAM_ERROR, 2};
    r[n++] = (struct run){SPC_STREAM_LINK, 1};
    if (l->indices != 0) {
        r[n++] = (struct run){SPC_STREAM_TRIANGLE, 5};
        r[n++] = (struct run){SPC_STREAM_VERTEX, 3 * b->vertex_width};
        if (l->vertex_colors)
            r[n++] = (struct run){SPC_STREAM_VERTEX_COLOR, 4};
    } else {
        n += node_runs(r + n, l->colors != 0);
    }
    r[n++] = (struct run){SPC_STREAM_GROUP, 2};
    return n;
}

static void add_raw(const struct spc_block *b, const struct spc_block_layout *l,
                    uint32_t normal_clusters, uint64_t *bytes)
{
    const uint64_t n = b->node_count, v = b->vertex_count;
    bytes[SPC_STREAM_POSITION] += 6 * n;
    bytes[SPC_STREAM_NORMAL] += 2 * n;
    bytes[SPC_STREAM_RADIUS] += 2 * n;
    bytes[SPC_STREAM_HEIGHT] += n;
    bytes[SPC_STREAM_ERROR] += 4 * n;
    bytes[SPC_STREAM_LINK] += n;
    bytes[SPC_STREAM_GROUP] += 4 * (uint64_t)normal_clusters;
    bytes[SPC_STREAM_COLOR] += l->colors ? 4 * n : 0;
    bytes[SPC_STREAM_RELATION] += l->children ? (n + 1) / 2 : 0;
    bytes[SPC_STREAM_TRIANGLE] += l->indices ? 6 * n : 0;
    bytes[SPC_STREAM_VERTEX] += l->indices ? 24 + 3 * v * b->vertex_width : 0;
    bytes[SPC_STREAM_VERTEX_COLOR] += l->vertex_colors ? 4 * v : 0;
}

enum spc_status spc_block_streams(const struct spc_reader *reader, uint32_t index,
                                  uint64_t bytes[SPC_STREAM_COUNT], struct spc_error *err)
{
    struct spc_block b;
    struct spc_block_layout l;
    struct run runs[RUNS_MAX];
    uint64_t before = 0, after = 0;
    spc_reader_block(reader, index, &b);
    spc_block_layout(&b, reader->header.flags, reader->header.normal_clusters, &l);
    for (int s = 0; s < SPC_STREAM_COUNT; s++)
        before += bytes[s];
    if (b.codec == SPC_CODEC_RAW) {
        add_raw(&b, &l, reader->header.normal_clusters, bytes);
    } else {
        const uint8_t *table = reader->bytes + b.off + CH_SIZE + CO_SIZE;
        const uint32_t count = list_runs(&b, &l, runs);
        uint32_t plane = 0;
        for (uint32_t r = 0; r < count; r++)
            for (uint32_t k = 0; k < runs[r].planes; k++, plane++) {
                if (CO_SIZE + 4 * (uint64_t)plane + 4 > b.stored_bytes)
                    return spc_fail(err, SPC_CORRUPT, b.off, "block %u has no table of planes",
                                    index);
                bytes[runs[r].stream] += load_u32(table + 4 * plane) & PLANE_BYTES_MASK;
            }
    }
    for (int s = 0; s < SPC_STREAM_COUNT; s++)
        after += bytes[s];
    if (after - before > spc_block_chunk_bytes(&b))
        return spc_fail(err, SPC_CORRUPT, b.off, "block %u says more than it holds", index);
    bytes[SPC_STREAM_FRAME] += spc_block_chunk_bytes(&b) - (after - before);
    return SPC_OK;
}
