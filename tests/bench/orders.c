/*
 * orders ARCHIVE...: what another order of the nodes inside a block would change, as CSV.
 *
 * Nothing here is the format: decoded nodes are put in an order, each is told from the one before
 * it as differences, and every byte plane is a zstd frame of level 1. So orders are compared by one
 * coder; the format's own, which tells inner nodes from parents, stands beside them.
 *
 * Orders also decide what a viewer may leave out inside a block. Kept are, per accuracy and over
 * the views: all nodes of the chosen blocks; the prefix by e_parent that a block's nearest point
 * and largest link leave; and the normal clusters that are not seen wholly from behind.
 */
#include "views.h"

#include "bytes.h"
#include "layout.h"

#include <string.h>
#include <zstd.h>

enum order { STORED, BY_E_PARENT, BY_MORTON, ORDERS };
enum { PLANES = 16 };

struct sums {
    uint64_t nodes[2], format_bytes[2], order_bytes[2][ORDERS];    /* by enum spc_block_kind */
    uint64_t kept[ACCURACIES], kept_prefix[ACCURACIES], kept_groups[ACCURACIES];
};

/* ---- bytes -------------------------------------------------------------------------------------- */

struct place {
    uint64_t key;
    uint32_t node;
};

static int compare_places(const void *a, const void *b)
{
    const struct place *p = a, *q = b;
    if (p->key != q->key)
        return (p->key > q->key) - (p->key < q->key);
    return (p->node > q->node) - (p->node < q->node);
}

static uint64_t morton(const uint8_t *record)
{
    uint64_t key = 0;
    for (int bit = 15; bit >= 0; bit--)
        for (int a = 0; a < 3; a++)
            key = key << 1 | (load_u16(record + ND_X + 2 * a) >> bit & 1);
    return key;
}

static uint64_t key_of(const uint8_t *record, enum order order)
{
    switch (order) {
    case BY_E_PARENT: return UINT16_MAX - load_u16(record + ND_E_PARENT);
    case BY_MORTON: return morton(record);
    default: return 0;
    }
}

static uint16_t zigzag(uint16_t d)
{
    return (uint16_t)(d << 1 ^ (d & 0x8000 ? 0xFFFF : 0));
}

/* Differences of the columns of a record, as byte planes[PLANES][n]. */
static void split_planes(const uint8_t *record, const uint8_t *model, uint8_t *planes, size_t n,
                         size_t i)
{
    static const uint8_t WIDE[] = {ND_X, ND_Y, ND_Z, ND_E_SELF, ND_E_PARENT, ND_RADIUS};
    static const uint8_t NARROW[] = {ND_NORMAL, ND_NORMAL + 1, ND_HEIGHT, ND_LINK};
    size_t plane = 0;
    for (size_t c = 0; c < sizeof WIDE; c++) {
        const uint16_t d = zigzag((uint16_t)(load_u16(record + WIDE[c]) - load_u16(model + WIDE[c])));
        planes[n * plane++ + i] = (uint8_t)d;
        planes[n * plane++ + i] = (uint8_t)(d >> 8);
    }
    for (size_t c = 0; c < sizeof NARROW; c++) {
        const int8_t d = (int8_t)(record[NARROW[c]] - model[NARROW[c]]);
        planes[n * plane++ + i] = (uint8_t)(d << 1 ^ (d < 0 ? 0xFF : 0));
    }
}

static uint64_t order_bytes(const uint8_t *records, uint32_t n, enum order order)
{
    static const uint8_t ZERO[ND_SIZE];
    struct place *places = bench_memory(n * sizeof *places);
    uint8_t *planes = bench_memory((size_t)n * PLANES);
    const size_t room = ZSTD_compressBound(n);
    uint8_t *packed = bench_memory(room);
    uint64_t bytes = 0;
    for (uint32_t i = 0; i < n; i++)
        places[i] = (struct place){key_of(records + (size_t)ND_SIZE * i, order), i};
    qsort(places, n, sizeof *places, compare_places);
    for (uint32_t i = 0; i < n; i++)
        split_planes(records + (size_t)ND_SIZE * places[i].node,
                     i > 0 ? records + (size_t)ND_SIZE * places[i - 1].node : ZERO, planes, n, i);
    for (size_t p = 0; p < PLANES; p++) {
        const size_t size = ZSTD_compress(packed, room, planes + p * n, n, 1);
        bytes += ZSTD_isError(size) || size > n ? n : size;
    }
    free(packed);
    free(planes);
    free(places);
    return bytes;
}

static void add_bytes(const struct bench_archive *a, uint32_t index, struct sums *s)
{
    struct spc_error err = {0};
    struct spc_block b;
    struct spc_block_layout l;
    uint64_t streams[SPC_STREAM_COUNT] = {0};
    spc_reader_block(a->reader, index, &b);
    spc_block_layout(&b, a->header->flags, a->header->normal_clusters, &l);
    bench_decode(a, index, false);
    bench_must(spc_block_streams(a->reader, index, streams, &err), a->path, &err);
    for (int k = SPC_STREAM_POSITION; k <= SPC_STREAM_GROUP; k++)
        s->format_bytes[b.kind] += streams[k];
    s->nodes[b.kind] += b.node_count;
    for (int order = 0; order < ORDERS; order++)
        s->order_bytes[b.kind][order] +=
            order_bytes(a->payload + l.nodes, b.node_count, (enum order)order);
}

/* ---- what may be left out ------------------------------------------------------------------------ */

/* Least distance from the eye to a ball in the cluster: select.c's bound. */
static double nearest(const struct spc_cluster *c, const double eye[3])
{
    double box = 0, center = 0;
    for (int a = 0; a < 3; a++) {
        const double out = fmax(0, fmax((double)c->box[a] - eye[a], eye[a] - (double)c->box[a + 3]));
        box += out * out;
        center += ((double)c->sphere[a] - eye[a]) * ((double)c->sphere[a] - eye[a]);
    }
    return fmax(sqrt(box), sqrt(center) - (double)c->sphere[3]);
}

static void add_kept(const struct bench_archive *a, const struct spv_view *view, uint32_t index,
                     int k, struct sums *s)
{
    struct spc_block b;
    struct spc_cluster c;
    struct spc_block_layout l;
    double eye[3];
    spc_reader_block(a->reader, index, &b);
    spc_reader_cluster(a->reader, b.cluster, &c);
    spc_block_layout(&b, a->header->flags, a->header->normal_clusters, &l);
    spv_eye_of_cluster(a->reader, &c, &view->camera, eye);
    bench_decode(a, index, false);
    const double low = view->eps * (nearest(&c, eye) - (double)b.link_max);
    const bool behind = spv_culls_back(a->reader, view);
    s->kept[k] += b.node_count;
    for (uint32_t i = 0; i < b.node_count; i++) {
        const uint8_t *record = a->payload + l.nodes + (size_t)ND_SIZE * i;
        s->kept_prefix[k] += (double)spc_len_decode(load_u16(record + ND_E_PARENT)) >= low;
    }
    for (uint32_t g = 0; g < a->header->normal_clusters; g++) {
        const uint8_t *group = a->payload + l.groups + 4 * (size_t)g;
        const uint32_t count = load_u16(group);
        double axis[3];
        spc_reader_axis(a->reader, g, axis);
        const double cosine = (int16_t)load_u16(group + 2) / 32767.0;
        if (count > 0 && !(behind && spv_all_behind(eye, c.sphere, axis, cosine)))
            s->kept_groups[k] += count;
    }
}

static void add_views(const struct bench_archive *a, struct sums *s)
{
    struct spv_selection selection = {0};
    for (int k = 0; k < ACCURACIES; k++)
        for (int v = 0; v < VIEWS; v++) {
            const struct spv_view view = views_at(a->header, v, k);
            struct spc_error err = {0};
            bench_must(spv_select(a->reader, &view, &selection, &err), a->path, &err);
            for (uint32_t i = 0; i < selection.block_count; i++)
                add_kept(a, &view, selection.blocks[i].block, k, s);
        }
    spv_selection_release(&selection);
}

static void print_sums(const char *path, const struct sums *s)
{
    printf("%s", path);
    for (int kind = 0; kind < 2; kind++) {
        printf(",%llu,%llu", (unsigned long long)s->nodes[kind],
               (unsigned long long)s->format_bytes[kind]);
        for (int order = 0; order < ORDERS; order++)
            printf(",%llu", (unsigned long long)s->order_bytes[kind][order]);
    }
    for (int k = 0; k < ACCURACIES; k++)
        printf(",%llu,%llu,%llu", (unsigned long long)s->kept[k],
               (unsigned long long)s->kept_prefix[k], (unsigned long long)s->kept_groups[k]);
    putchar('\n');
}

int main(int argc, char **argv)
{
    if (argc < 2) {
        fprintf(stderr, "usage: bench-orders ARCHIVE...\n");
        return 2;
    }
    fputs("archive", stdout);
    for (int kind = 0; kind < 2; kind++) {
        const char *of = kind == SPC_BLOCK_INNER ? "inner" : "leaf";
        printf(",%s_nodes,%s_format,%s_stored,%s_e_parent,%s_morton", of, of, of, of, of);
    }
    for (int k = 0; k < ACCURACIES; k++)
        printf(",kept_%g,prefix_%g,groups_%g", ACCURACY_PX[k], ACCURACY_PX[k], ACCURACY_PX[k]);
    putchar('\n');
    for (int i = 1; i < argc; i++) {
        struct bench_archive a = bench_open(argv[i]);
        struct sums s = {0};
        for (uint32_t k = 0; k < a.header->block_count; k++)
            add_bytes(&a, k, &s);
        add_views(&a, &s);
        print_sums(argv[i], &s);
        bench_close(&a);
    }
    return 0;
}
