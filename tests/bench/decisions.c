/*
 * decisions ARCHIVE...: what an archive built with other choices costs, as CSV, a line each.
 *
 * Bytes, decoding of all blocks, and per accuracy, summed over the views: nodes that a viewer runs
 * through its tests (those of the chosen blocks, less the normal clusters seen from behind), splats
 * and triangles that pass them, blocks, which are draw calls, and the ranges that these draw. cut are
 * splats and triangles with their centres in the picture, cut_bytes their share of the bytes of their
 * blocks, read_bytes those of the chosen blocks; near_ the same from near.
 * disk_bytes are those that tell the leaves' centres, normals, radii, heights and errors.
 */
#include "views.h"

#include "bytes.h"
#include "interval.h"

#include <string.h>

enum { ROUNDS = 5 };

struct picture {
    uint64_t processed, drawn, ranges, blocks, cut, read_bytes;
    double cut_bytes;
};

static bool in_picture(const struct spv_camera *c, const struct spv_interval *in, const uint8_t *record)
{
    double x = 0, y = 0, z = 0;
    for (int a = 0; a < 3; a++) {
        const double at = (double)in->origin[a] + load_u16(record + ND_X + 2 * a) * (double)in->step;
        x += at * c->right[a];
        y += at * c->up[a];
        z += at * c->forward[a];
    }
    return z > 0 && 2 * fabs(x) * c->focal_px <= c->width * z && 2 * fabs(y) * c->focal_px <= c->height * z;
}

/* As in the viewer: nodes that pass their tests, of a normal cluster of a block. Adds to *cut. */
static uint64_t drawn_of(const struct bench_archive *a, const struct spv_view *view,
                         const struct spc_block *b, const double eye[3], const uint8_t *records,
                         uint32_t count, uint64_t *cut)
{
    const bool leaf = b->kind == SPC_BLOCK_LEAF;
    const bool triangles = leaf && (a->header->flags & SPC_FLAG_TRIANGLES);
    const struct spv_interval in = {
        .origin = {(float)-eye[0], (float)-eye[1], (float)-eye[2]},
        .step = ldexpf(1, b->step_exp - a->header->unit_exp), .eps = (float)view->eps,
        .link_base = b->link_base, .lower = !leaf || triangles, .missing = -1,
    };
    uint64_t drawn = 0;
    for (uint32_t i = 0; i < count; i++) {
        const uint8_t *record = records + (size_t)SPC_NODE_BYTES * i;
        if (!spv_interval_point(&in, record) && !(triangles && spv_interval_triangle(&in, record)))
            continue;
        drawn++;
        *cut += in_picture(&view->camera, &in, record);
    }
    return drawn;
}

/* The normal clusters of a block that may face the eye; neighbours are one range. */
static void add_block(const struct bench_archive *a, const struct spv_view *view, uint32_t index,
                      struct picture *sum)
{
    struct spc_block b;
    struct spc_cluster c;
    struct spc_block_layout l;
    double eye[3], axis[3];
    bool open = false;
    uint64_t cut = 0;
    spc_reader_block(a->reader, index, &b);
    spc_reader_cluster(a->reader, b.cluster, &c);
    spc_block_layout(&b, a->header->flags, a->header->normal_clusters, &l);
    spv_eye_of_cluster(a->reader, &c, &view->camera, eye);
    bench_decode(a, index, false);
    const bool cull = spv_culls_back(a->reader, view);
    const uint8_t *records = a->payload + l.nodes;
    for (uint32_t g = 0; g < a->header->normal_clusters; g++) {
        const uint8_t *group = a->payload + l.groups + 4 * (size_t)g;
        const uint32_t count = load_u16(group);
        if (count == 0)
            continue;
        spc_reader_axis(a->reader, g, axis);
        const bool seen = !cull || !spv_all_behind(eye, c.sphere, axis,
                                                   (int16_t)load_u16(group + 2) / 32767.0);
        sum->ranges += seen && !open;
        open = seen;
        if (seen) {
            sum->processed += count;
            sum->drawn += drawn_of(a, view, &b, eye, records, count, &cut);
        }
        records += (size_t)SPC_NODE_BYTES * count;
    }
    sum->cut += cut;
    sum->cut_bytes += (double)spc_block_chunk_bytes(&b) * (double)cut / b.node_count;
}

static struct picture picture_at(const struct bench_archive *a, int accuracy, bool near)
{
    struct spv_selection selection = {0};
    struct picture sum = {0};
    for (int v = 0; v < (near ? NEAR_VIEWS : VIEWS); v++) {
        const struct spv_view view = near ? views_near(a->reader, v, accuracy) : views_at(a->header, v, accuracy);
        struct spc_error err = {0};
        bench_must(spv_select(a->reader, &view, &selection, &err), a->path, &err);
        for (uint32_t i = 0; i < selection.block_count; i++)
            add_block(a, &view, selection.blocks[i].block, &sum);
        sum.blocks += selection.block_count;
        sum.read_bytes += selection.bytes;
    }
    spv_selection_release(&selection);
    return sum;
}

struct leaves {
    uint64_t disk_bytes;
    double decode_s;
};

static struct leaves leaves_of(const struct bench_archive *a)
{
    uint64_t streams[SPC_STREAM_COUNT] = {0};
    double times[ROUNDS];
    struct spc_error err = {0};
    for (int round = 0; round < ROUNDS; round++) {
        times[round] = 0;
        for (uint32_t i = 0; i < a->header->block_count; i++) {
            struct spc_block b;
            spc_reader_block(a->reader, i, &b);
            if (b.kind != SPC_BLOCK_LEAF)
                continue;
            if (round == 0)
                bench_must(spc_block_streams(a->reader, i, streams, &err), a->path, &err);
            const double began = bench_cpu();
            bench_decode(a, i, false);
            times[round] += bench_cpu() - began;
        }
    }
    return (struct leaves){
        streams[SPC_STREAM_POSITION] + streams[SPC_STREAM_NORMAL] + streams[SPC_STREAM_RADIUS] +
            streams[SPC_STREAM_HEIGHT] + streams[SPC_STREAM_ERROR],
        bench_median(times, ROUNDS)};
}

static void print_archive(const char *path)
{
    struct bench_archive a = bench_open(path);
    const struct spc_header *h = a.header;
    double decode[ROUNDS];
    for (int round = 0; round < ROUNDS; round++)
        decode[round] = bench_decode_all(&a, true);
    const struct leaves leaves = leaves_of(&a);
    printf("%s,%llu,%llu,%llu,%llu,%.6f,%llu,%.6f", path, (unsigned long long)h->leaf_count,
           (unsigned long long)h->node_count, (unsigned long long)h->file_bytes,
           (unsigned long long)h->head_bytes, bench_median(decode, ROUNDS),
           (unsigned long long)leaves.disk_bytes, leaves.decode_s);
    struct picture framed[ACCURACIES];
    for (int k = 0; k < ACCURACIES; k++) {
        const struct picture p = framed[k] = picture_at(&a, k, false);
        printf(",%llu,%llu,%llu,%llu", (unsigned long long)p.processed, (unsigned long long)p.drawn,
               (unsigned long long)p.blocks, (unsigned long long)p.ranges);
    }
    for (int k = 0; k < ACCURACIES; k++)
        printf(",%llu,%llu,%.0f", (unsigned long long)framed[k].cut, (unsigned long long)framed[k].read_bytes,
               framed[k].cut_bytes);
    for (int k = 0; k < ACCURACIES; k++) {
        const struct picture p = picture_at(&a, k, true);
        printf(",%llu,%llu,%llu,%.0f", (unsigned long long)p.processed, (unsigned long long)p.cut,
               (unsigned long long)p.read_bytes, p.cut_bytes);
    }
    putchar('\n');
    bench_close(&a);
}

int main(int argc, char **argv)
{
    if (argc < 2) {
        fprintf(stderr, "usage: bench-decisions ARCHIVE...\n");
        return 2;
    }
    fputs("archive,leaves,nodes,file_bytes,head_bytes,decode_cpu_s,disk_bytes,leaf_decode_cpu_s", stdout);
    for (int k = 0; k < ACCURACIES; k++)
        printf(",processed_%g,drawn_%g,blocks_%g,ranges_%g", ACCURACY_PX[k], ACCURACY_PX[k],
               ACCURACY_PX[k], ACCURACY_PX[k]);
    for (int k = 0; k < ACCURACIES; k++)
        printf(",cut_%g,read_bytes_%g,cut_bytes_%g", ACCURACY_PX[k], ACCURACY_PX[k], ACCURACY_PX[k]);
    for (int k = 0; k < ACCURACIES; k++)
        printf(",near_processed_%g,near_cut_%g,near_read_bytes_%g,near_cut_bytes_%g", ACCURACY_PX[k], ACCURACY_PX[k],
               ACCURACY_PX[k], ACCURACY_PX[k]);
    putchar('\n');
    for (int i = 1; i < argc; i++)
        print_archive(argv[i]);
    return 0;
}
