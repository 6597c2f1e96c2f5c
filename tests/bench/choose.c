/*
 * choose ARCHIVE...: what choosing blocks costs, as CSV: CPU time of one core, medians.
 *
 * Six views of the whole model and six from near its surface, at 2 px and 1024 x 1024. "visited" are
 * clusters that were looked at: those drawn and those left out.
 */
#include "bench.h"
#include "views.h"

enum { ROUNDS = 41 };

/* From where view v looks, but a sixteenth of the way from the middle of the box. */
static void approach(const struct spc_header *h, struct spv_view *view)
{
    for (int a = 0; a < 3; a++) {
        const double middle = (h->box_min[a] + h->box_max[a]) / 2;
        view->camera.eye[a] = middle + (view->camera.eye[a] - middle) / 4;
    }
}

static void measure(const struct bench_archive *a, int v, bool near)
{
    struct spv_view view = views_at(a->header, v, 1);
    struct spv_selection s = {0};
    struct spc_error err = {0};
    double us[ROUNDS];
    if (near)
        approach(a->header, &view);
    for (int k = 0; k < ROUNDS; k++) {
        const double began = bench_cpu();
        bench_must(spv_select(a->reader, &view, &s, &err), a->path, &err);
        us[k] = 1e6 * (bench_cpu() - began);
    }
    printf("%s,%d,%s,%u,%u,%u,%u,%.0f\n", a->path, v, near ? "near" : "whole", s.clusters_total,
           s.clusters_drawn + s.culled_frustum + s.culled_backface + s.culled_range, s.clusters_drawn, s.block_count,
           bench_median(us, ROUNDS));
    spv_selection_release(&s);
}

int main(int argc, char **argv)
{
    printf("archive,view,from,clusters,visited,drawn,blocks,select_us\n");
    for (int i = 1; i < argc; i++) {
        struct bench_archive a = bench_open(argv[i]);
        for (int v = 0; v < 2 * VIEWS; v++)
            measure(&a, v % VIEWS, v >= VIEWS);
        bench_close(&a);
    }
    return 0;
}
