/*
 * decode CODEC=ARCHIVE...: what each codec costs on one core, as CSV.
 *
 * Decoding is timed over all blocks, warm, without and with checksums. Packing is spc_block_encode
 * alone: payloads and families are read back from the archive first, and what comes out must be
 * the archive's own bytes, so the work is the builder's. The archives take turns in every round.
 */
#include "bench.h"

#include "bytes.h"
#include "layout.h"

#include <string.h>

enum { ROUNDS = 15, PACK_ROUNDS = 3, ARCHIVES_MAX = 16 };

struct entry {
    char codec[16];
    struct spc_encoder *encoder;
    struct bench_archive archive;
    uint64_t color_bytes;
    double decode[ROUNDS], check[ROUNDS], pack[PACK_ROUNDS];
};

/* ---- packing ---------------------------------------------------------------------------------- */

struct families {                   /* of one block */
    struct spc_family *list;
    uint32_t count;
    uint32_t nodes;                 /* met so far */
};

static uint8_t group_of(const uint8_t *groups, uint32_t index)
{
    uint8_t k = 0;
    for (uint32_t end = load_u16(groups); end <= index; end += load_u16(groups + 4 * (size_t)k))
        k++;
    return k;
}

/* The families of one block, in canonical order; their parents are numbered in that order, too. */
static struct families families_of(const struct spc_tree *t, uint32_t block,
                                   const uint8_t *groups, uint32_t *number)
{
    struct families f = {.list = bench_memory(t->node_count * sizeof *f.list)};
    uint32_t last = SPC_NONE;
    for (uint32_t i = 0; i < t->node_count; i++) {
        const uint32_t node = t->order[i], parent = t->parent[node];
        if (t->block_of[node] != block)
            continue;
        number[node] = f.nodes++;
        if (f.count == 0 || parent != last) {
            const bool here = parent != SPC_PARENT_OWNER && t->block_of[parent] == block;
            f.list[f.count++] = (struct spc_family){
                .parent = here ? (uint16_t)number[parent] : 0xFFFF,
                .group = group_of(groups, t->index_in_block[node])};
            last = parent;
        }
        f.list[f.count - 1].size++;
    }
    return f;
}

static struct spc_frame frame_of(const struct bench_archive *a, const struct spc_cluster *c)
{
    struct spc_frame frame = {a->header->flags, a->header->normal_clusters, a->header->unit_exp,
                              a->header->vertex_exp, {0}};
    memcpy(frame.origin, c->origin, sizeof frame.origin);
    return frame;
}

static double pack_block(const struct entry *e, const struct spc_tree *t,
                         const struct spc_cluster *c, uint32_t index, uint32_t *number)
{
    const struct bench_archive *a = &e->archive;
    struct spc_error err = {0};
    struct spc_block b;
    struct spc_block_layout l;
    uint64_t size;
    const uint8_t *file = spc_reader_bytes(a->reader, &size);
    spc_reader_block(a->reader, index, &b);
    spc_block_layout(&b, a->header->flags, a->header->normal_clusters, &l);
    bench_decode(a, index, false);
    struct families f = families_of(t, index, a->payload + l.groups, number);
    const struct spc_frame frame = frame_of(a, c);
    uint8_t *stored = bench_memory(spc_block_stored_bound(l.bytes));
    const uint32_t bytes = b.stored_bytes;
    const double began = bench_cpu();
    bench_must(spc_block_encode(&b, &l, &frame, f.list, f.count, a->payload, e->encoder, stored, &err),
               a->path, &err);
    const double spent = bench_cpu() - began;
    if (b.stored_bytes != bytes || memcmp(stored, file + b.off + CH_SIZE, bytes) != 0) {
        fprintf(stderr, "%s: block %u packs to other bytes than it holds\n", a->path, index);
        exit(1);
    }
    free(stored);
    free(f.list);
    return spent;
}

static double pack_all(const struct entry *e)
{
    const struct bench_archive *a = &e->archive;
    double spent = 0;
    for (uint32_t id = 0; id < a->header->cluster_count; id++) {
        struct spc_error err = {0};
        struct spc_tree *tree = NULL;
        struct spc_cluster c;
        spc_reader_cluster(a->reader, id, &c);
        bench_must(spc_tree_load(a->reader, id, &tree, &err), a->path, &err);
        uint32_t *number = bench_memory(tree->node_count * sizeof *number);
        for (uint32_t k = 0; k < c.block_count; k++)
            spent += pack_block(e, tree, &c, c.block_first + k, number);
        free(number);
        spc_tree_free(tree);
    }
    return spent;
}

/* ---- the table --------------------------------------------------------------------------------- */

static struct entry open_entry(const char *argument)
{
    struct entry e = {.encoder = NULL};
    struct spc_error err = {0};
    int level = 1;
    const char *equals = strchr(argument, '=');
    if (equals == NULL || equals == argument || equals - argument >= (int)sizeof e.codec) {
        fprintf(stderr, "'%s' is not CODEC=ARCHIVE\n", argument);
        exit(2);
    }
    memcpy(e.codec, argument, (size_t)(equals - argument));
    if (strncmp(e.codec, "zstd:", 5) == 0)
        level = atoi(e.codec + 5);
    e.archive = bench_open(equals + 1);
    bench_must(spc_encoder_create(level, &e.encoder, &err), e.archive.path, &err);
    uint64_t streams[SPC_STREAM_COUNT] = {0};
    for (uint32_t i = 0; i < e.archive.header->block_count; i++)
        bench_must(spc_block_streams(e.archive.reader, i, streams, &err), e.archive.path, &err);
    e.color_bytes = streams[SPC_STREAM_COLOR] + streams[SPC_STREAM_VERTEX_COLOR];
    return e;
}

/* Who comes first after another archive pays for the caches: a pass for nobody, and turns. */
static void time_entry(struct entry *e, int round)
{
    if (round < PACK_ROUNDS)
        e->pack[round] = pack_all(e);
    bench_decode_all(&e->archive, false);
    for (int k = 0; k < 2; k++) {
        const bool check = (round + k) % 2 != 0;
        (check ? e->check : e->decode)[round] = bench_decode_all(&e->archive, check);
    }
}

static void print_entry(struct entry *e)
{
    const struct spc_header *h = e->archive.header;
    const double n = (double)h->leaf_count, decode = bench_median(e->decode, ROUNDS);
    const double check = bench_median(e->check, ROUNDS);
    printf("%s,%llu,%llu,%.4f,%.4f,%.3f,%.2f,%.2f,%.1f,%.4f\n", e->codec,
           (unsigned long long)h->leaf_count, (unsigned long long)h->file_bytes,
           (double)h->file_bytes / n, (double)(h->file_bytes - e->color_bytes) / n,
           bench_median(e->pack, PACK_ROUNDS), 1e9 * decode / n, 1e9 * check / n,
           1e-6 * (double)h->file_bytes / decode, 1e-9 * (double)e->archive.decoded_bytes / decode);
}

int main(int argc, char **argv)
{
    static struct entry entries[ARCHIVES_MAX];
    const int count = argc - 1;
    if (count < 1 || count > ARCHIVES_MAX) {
        fprintf(stderr, "usage: bench-decode CODEC=ARCHIVE...\n");
        return 2;
    }
    for (int i = 0; i < count; i++)
        entries[i] = open_entry(argv[i + 1]);
    for (int round = 0; round < ROUNDS; round++)
        for (int i = 0; i < count; i++)
            time_entry(&entries[i], round);
    puts("codec,triangles,file_bytes,bytes_a_triangle,bytes_without_colours,pack_cpu_s,decode_ns,"
         "decode_checked_ns,decode_stored_mb_s,decode_decoded_gb_s");
    for (int i = 0; i < count; i++) {
        print_entry(&entries[i]);
        bench_close(&entries[i].archive);
        spc_encoder_free(entries[i].encoder);
    }
    return 0;
}
