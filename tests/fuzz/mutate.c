#include "mutate.h"

#include "bytes.h"
#include "layout.h"
#include "reseal.h"
#include "spc.h"

struct field {
    uint16_t off, bytes;
};

struct table {
    const struct field *fields;
    uint32_t count, record_bytes;
};

#define X(name, off, bytes) {off, bytes},
static const struct field HEADER[] = {SPC_HEADER_LAYOUT(X)};
static const struct field SECTION[] = {SPC_SECTION_LAYOUT(X)};
static const struct field CLUSTER[] = {SPC_CLUSTER_LAYOUT(X)};
static const struct field TOP[] = {SPC_TOP_LAYOUT(X)};
static const struct field BLOCK[] = {SPC_BLOCK_LAYOUT(X)};
static const struct field CHUNK[] = {SPC_CHUNK_LAYOUT(X)};
static const struct field NODE[] = {SPC_NODE_LAYOUT(X)};
#undef X

/* What a codec keeps at the front of a payload: sizes that lead beyond its end if they are wrong. */
enum { PAYLOAD_FRONT = 128 };
static const struct field FRONT[] = {{0, PAYLOAD_FRONT}};

#define TABLE(rows, size) {rows, sizeof rows / sizeof *rows, size}
enum { T_HEADER, T_SECTION, T_CLUSTER, T_TOP, T_BLOCK, T_CHUNK, T_NODE, T_FRONT, T_COUNT };
static const struct table TABLES[T_COUNT] = {
    [T_HEADER] = TABLE(HEADER, HD_SIZE), [T_SECTION] = TABLE(SECTION, SE_SIZE),
    [T_CLUSTER] = TABLE(CLUSTER, CL_SIZE), [T_TOP] = TABLE(TOP, TP_SIZE),
    [T_BLOCK] = TABLE(BLOCK, BL_SIZE), [T_CHUNK] = TABLE(CHUNK, CH_SIZE),
    [T_NODE] = TABLE(NODE, ND_SIZE), [T_FRONT] = TABLE(FRONT, PAYLOAD_FRONT),
};

uint64_t mutate_random(uint64_t *state)
{
    uint64_t x = *state += 0x9E3779B97F4A7C15u;
    x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9u;
    x = (x ^ x >> 27) * 0x94D049BB133111EBu;
    return x ^ x >> 31;
}

static uint32_t below(uint64_t *random, uint64_t n)
{
    return n ? (uint32_t)(mutate_random(random) % n) : 0;
}

/* Offset of a record of a table; false when the archive holds none, or not all of it. */
static bool pick_record(const uint8_t *bytes, size_t size, int table, uint64_t *random,
                        uint64_t *off)
{
    uint64_t first = 0;
    *off = 0;
    if (size < HD_SIZE)
        return false;
    if (table == T_SECTION)
        *off = HD_SECTIONS + (uint64_t)SE_SIZE * below(random, SE_COUNT);
    if (table == T_CLUSTER || table == T_TOP) {
        const uint32_t n = reseal_records(bytes, size, SE_CLUS, &first);
        *off = first + (uint64_t)CL_SIZE * below(random, n);
        if (table == T_TOP)
            *off += CL_TOPS + (uint64_t)TP_SIZE * below(random, SPC_TOPS_MAX);
    }
    if (table >= T_BLOCK) {
        const uint32_t n = reseal_records(bytes, size, SE_BLKS, &first);
        *off = first + (uint64_t)BL_SIZE * below(random, n);
        if (table != T_BLOCK) {
            if (!range_fits(*off, BL_SIZE, size))
                return false;
            const uint32_t nodes = load_u32(bytes + *off + BL_NODE_COUNT);
            *off = load_u64(bytes + *off + BL_OFF);
            if (table != T_CHUNK && *off <= size)
                *off += CH_SIZE + (table == T_NODE ? (uint64_t)ND_SIZE * below(random, nodes) : 0);
        }
    }
    return range_fits(*off, TABLES[table].record_bytes, size);
}

static uint64_t load_any(const uint8_t *p, uint32_t width)
{
    uint8_t buffer[8] = {0};
    memcpy(buffer, p, width);
    return load_u64(buffer);
}

static void store_any(uint8_t *p, uint32_t width, uint64_t value)
{
    uint8_t buffer[8];
    store_u64(buffer, value);
    memcpy(p, buffer, width);
}

/* Ends of ranges, as integers and as floats of both sizes. */
static uint64_t interesting(uint64_t *random)
{
    static const uint64_t values[] = {
        0, 1, 2, 0xFF, 0x7F, 0x80, 0xFFFF, 0x7FFF, 0x8000, 0xFF00, 0xFEFF, 0x0100, 0xFFFFFFFF,
        0x7FFFFFFF, 0x80000000, UINT64_MAX, INT64_MAX, (uint64_t)INT64_MAX + 1,
        0x7F800000, 0xFF800000, 0x7FC00000, 0x7F7FFFFF, 0x00000001, 0x3F800000, 0xBF800000,
        0x7FF0000000000000, 0x7FF8000000000000, 0x7FEFFFFFFFFFFFFF, 0xFFEFFFFFFFFFFFFF,
        SPC_CLUSTERS_MAX, SPC_BLOCKS_MAX, SPC_BLOCK_NODES_MAX, SPC_CLUSTER_NODES_MAX,
        SPC_NORMAL_CLUSTERS_MAX, SPC_META_BYTES_MAX, (uint64_t)SPC_EXP_MIN, SPC_EXP_MAX,
    };
    return values[below(random, sizeof values / sizeof *values)];
}

static void change_value(uint8_t *p, uint32_t width, uint64_t *random)
{
    const uint64_t old = load_any(p, width);
    switch (below(random, 4)) {
    case 0: store_any(p, width, old ^ (uint64_t)1 << below(random, 8 * width)); break;
    case 1: store_any(p, width, old + below(random, 17) - 8); break;
    case 2: store_any(p, width, interesting(random)); break;
    default: store_any(p, width, mutate_random(random)); break;
    }
}

/* A field longer than 8 bytes is an array: one element of it, of a width that divides it. */
static void change_field(uint8_t *record, const struct field *f, uint64_t *random)
{
    static const uint8_t widths[] = {1, 2, 4, 8};
    uint32_t width = f->bytes;
    while (width > 8 || width == 0 || (width & (width - 1)) != 0 || f->bytes % width != 0)
        width = widths[below(random, sizeof widths)];
    change_value(record + f->off + width * below(random, f->bytes / width), width, random);
}

void mutate(uint8_t *bytes, size_t size, uint64_t *random)
{
    const int table = (int)below(random, T_COUNT + 1);
    uint64_t off = 0, other = 0;
    if (table < T_COUNT && pick_record(bytes, size, table, random, &off)) {
        const struct table *t = &TABLES[table];
        const struct field *f = &t->fields[below(random, t->count)];
        if (below(random, 8) == 0 && pick_record(bytes, size, table, random, &other))
            memmove(bytes + off + f->off, bytes + other + f->off, f->bytes);
        else
            change_field(bytes + off, f, random);
    } else if (size > 8) {
        const uint32_t width = 1u << below(random, 4);
        change_value(bytes + below(random, size - width + 1), width, random);
    }
}

size_t mutate_and_reseal(uint8_t *bytes, size_t size, uint64_t *random)
{
    for (uint32_t n = 1 + below(random, 4); n > 0; n--)
        mutate(bytes, size, random);
    const uint32_t how = below(random, 16);         /* once in sixteen: as it is */
    unsigned what = how == 0 ? 0 : RESEAL_HASHES;
    if (how >= 4)
        what |= RESEAL_CHUNKS;
    if (how >= 10)
        what |= RESEAL_COUNTS;
    return reseal(bytes, size, what);
}
