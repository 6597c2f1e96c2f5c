/*
 * choose ARCHIVE...: what a view makes a viewer read and test, and what choosing it costs, as CSV.
 *
 * Twelve views around the whole model, and twelve from a third of that distance to its middle, at 1024 x 1024.
 * "cut" are the nodes and triangles that pass their tests, with some of them inside of the picture, seen from
 * behind or hidden as they may be: what nobody can do without who does not know what is seen. "tested" is
 * what a viewer tests that keeps its blocks (kept.h), "read" the bytes of the chunks it chose, "cut_bytes" as
 * many bytes of each block as it has nodes of the cut. Times are CPU time of one core, medians.
 */
#include "bench.h"
#include "interval.h"
#include "kept.h"
#include "views.h"

#include <string.h>

enum { ROUNDS = 15, AROUND = 12 };

static const double CHOOSE_PX[] = {1, 2, 4};

/* Some of the node's ball is in the picture; to float precision. */
static bool in_picture(const struct spv_camera *c, const struct spv_interval *in, const uint8_t *record)
{
    const double r = (double)spc_len_decode(load_u16(record + ND_RADIUS));
    const double slope[2] = {c->width / (2 * c->focal_px), c->height / (2 * c->focal_px)};
    double p[3], z = 0, side[2] = {0, 0};
    for (int a = 0; a < 3; a++) {
        p[a] = (double)in->origin[a] + load_u16(record + ND_X + 2 * a) * (double)in->step;
        z += p[a] * c->forward[a];
        side[0] += p[a] * c->right[a];
        side[1] += p[a] * c->up[a];
    }
    bool in_it = z > -r;
    for (int k = 0; k < 2; k++)
        in_it &= fabs(side[k]) - slope[k] * z <= r * sqrt(1 + slope[k] * slope[k]);
    return in_it;
}

struct sums {
    double cut, cut_bytes;
    uint64_t tested;
};

/* One block of a selection, decoded and sorted in a->payload. */
static void add_block(const struct bench_archive *a, const struct spv_view *view, uint32_t index, bool cut,
                      struct sums *sums)
{
    struct spc_block b;
    struct spc_cluster c;
    struct spc_block_layout l;
    struct spv_ranges ranges;
    struct spc_error err = {0};
    double eye[3];
    uint32_t count = 0;
    spc_reader_block(a->reader, index, &b);
    spc_reader_cluster(a->reader, b.cluster, &c);
    spv_eye_of_cluster(a->reader, &c, &view->camera, eye);
    spc_block_layout(&b, a->header->flags, a->header->normal_clusters, &l);
    bench_decode(a, index, false);
    bench_must(spv_kept_sort(a->reader, index, a->payload, &err), a->path, &err);
    const uint8_t *nodes = a->payload + l.nodes;
    if (!cut) {
        spv_kept_ranges(a->reader, view, &b, &c, eye, nodes + ND_E_PARENT, SPC_NODE_BYTES, a->payload + l.groups,
                        &ranges);
        for (uint32_t r = 0; r < ranges.count; r++)
            sums->tested += (uint64_t)ranges.nodes[r];
        return;
    }
    const bool leaf = b.kind == SPC_BLOCK_LEAF, hybrid = leaf && (a->header->flags & SPC_FLAG_TRIANGLES);
    const struct spv_interval in = {.origin = {(float)-eye[0], (float)-eye[1], (float)-eye[2]},
                                    .step = ldexpf(1, b.step_exp - a->header->unit_exp), .eps = (float)view->eps,
                                    .missing = -1, .link_base = b.link_base, .lower = !leaf || hybrid};
    for (uint32_t i = 0; i < b.node_count; i++) {
        const uint8_t *record = nodes + (size_t)SPC_NODE_BYTES * i;
        count += (spv_interval_point(&in, record) || (hybrid && spv_interval_triangle(&in, record))) &&
                 in_picture(&view->camera, &in, record);
    }
    sums->cut += count;
    sums->cut_bytes += (double)count / b.node_count * (double)spc_block_chunk_bytes(&b);
}

static void measure(const struct bench_archive *a, int v, bool near, double eps_px)
{
    struct spv_view view = views_around(a->header, v, AROUND, near, eps_px), all = view;
    struct spv_selection s = {0}, everything = {0};
    struct spc_error err = {0};
    struct sums sums = {0};
    double us[ROUNDS];
    for (int k = 0; k < ROUNDS; k++) {
        const double began = bench_cpu();
        bench_must(spv_select(a->reader, &view, &s, &err), a->path, &err);
        us[k] = 1e6 * (bench_cpu() - began);
    }
    all.cull = false;
    bench_must(spv_select(a->reader, &all, &everything, &err), a->path, &err);
    for (uint32_t i = 0; i < s.block_count; i++)
        add_block(a, &view, s.blocks[i].block, false, &sums);
    for (uint32_t i = 0; i < everything.block_count; i++)
        add_block(a, &all, everything.blocks[i].block, true, &sums);
    const uint32_t visited = s.clusters_drawn + s.culled_frustum + s.culled_backface + s.culled_range;
    printf("%s,%d,%s,%g,%u,%u,%.0f,%.0f,%llu,%.2f,%.0f,%llu,%.2f\n", a->path, v, near ? "near" : "whole", eps_px,
           s.clusters_total, visited, bench_median(us, ROUNDS), sums.cut, (unsigned long long)sums.tested,
           (double)sums.tested / sums.cut, sums.cut_bytes, (unsigned long long)s.bytes,
           (double)s.bytes / sums.cut_bytes);
    fflush(stdout);
    spv_selection_release(&s);
    spv_selection_release(&everything);
}

int main(int argc, char **argv)
{
    printf("archive,view,from,eps_px,clusters,visited,select_us,cut,tested,tested_per_cut,cut_bytes,read,"
           "read_per_cut\n");
    for (int i = 1; i < argc; i++) {
        struct bench_archive a = bench_open(argv[i]);
        for (size_t e = 0; e < sizeof CHOOSE_PX / sizeof *CHOOSE_PX; e++)
            for (int v = 0; v < 2 * AROUND; v++)
                measure(&a, v % AROUND, v >= AROUND, CHOOSE_PX[e]);
        bench_close(&a);
    }
    return 0;
}
