/*
 * frames [--no-cull] FROM MODE EPS ARCHIVE...: what a frame costs without a card once its blocks are decoded, as CSV.
 *
 * Six frames around the whole model, or from a third of that distance (FROM: whole, near), at 1024 x 1024 by one
 * thread. Times are CPU time of the program: choosing blocks, and drawing; each frame's is the least of ROUNDS,
 * and of the frames the median, as are the counts. read are the bytes of all six frames' blocks, each once.
 */
#include "bench.h"
#include "draw.h"
#include "kept.h"
#include "views.h"

#include <string.h>

enum { AROUND = 6, ROUNDS = 3, COLUMNS = 6 };

struct store {                      /* decoded blocks, by number */
    uint8_t **payloads;
    uint64_t bytes;                 /* of their chunks */
};

static double cpu_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

static void keep(const struct bench_archive *a, const struct spv_selection *s, struct store *store)
{
    for (uint32_t i = 0; i < s->block_count; i++) {
        const uint32_t block = s->blocks[i].block;
        struct spc_error err = {0};
        struct spc_block b;
        if (store->payloads[block] != NULL)
            continue;
        spc_reader_block(a->reader, block, &b);
        store->payloads[block] = bench_memory(b.raw_bytes);
        store->bytes += spc_block_chunk_bytes(&b);
        bench_must(spc_block_decode(a->reader, block, true, store->payloads[block], &err), a->path, &err);
        bench_must(spv_kept_sort(a->reader, block, store->payloads[block], &err), a->path, &err);
    }
}

static void one_frame(struct spv_draw *soft, const struct bench_archive *a, const struct spv_view *view,
                      struct store *store, uint8_t *picture, double out[COLUMNS])
{
    const struct spv_draw_options options = {.splat = SPV_SPLAT_EXACT, .ambient = 0.2f};
    struct spv_selection s = {0};
    struct spv_drawn drawn;
    struct spc_error err = {0};
    double choose[ROUNDS], draw[ROUNDS];
    bench_must(spv_select(a->reader, view, &s, &err), a->path, &err);
    keep(a, &s, store);
    struct spv_item *items = bench_memory(s.block_count * sizeof *items);
    struct spv_part part = {.reader = a->reader, .items = items, .item_count = s.block_count};
    for (uint32_t i = 0; i < s.block_count; i++)
        items[i] = (struct spv_item){s.blocks[i].block, store->payloads[s.blocks[i].block], -1};
    for (int k = 0; k < ROUNDS; k++) {
        double began = cpu_ms();
        bench_must(spv_select(a->reader, view, &s, &err), a->path, &err);
        choose[k] = cpu_ms() - began;
        began = cpu_ms();
        bench_must(spv_draw_frame(soft, view, NULL, &part, 1, &options, picture, &drawn, &err), a->path, &err);
        draw[k] = cpu_ms() - began;
    }
    qsort(choose, ROUNDS, sizeof *choose, bench_compare);
    qsort(draw, ROUNDS, sizeof *draw, bench_compare);
    const double columns[COLUMNS] = {choose[0], choose[0] + draw[0], (double)drawn.nodes_processed,
                                     (double)drawn.nodes, (double)drawn.triangles, s.block_count};
    memcpy(out, columns, sizeof columns);
    free(items);
    spv_selection_release(&s);
}

static void measure(struct spv_draw *soft, const char *path, enum spv_mode mode, bool near, double eps_px, bool cull)
{
    struct bench_archive a = bench_open(path);
    struct store store = {.payloads = calloc(a.header->block_count, sizeof *store.payloads)};
    uint8_t *picture = bench_memory((size_t)4 * SIZE_PX * SIZE_PX);
    double frames[COLUMNS][AROUND];
    for (int v = 0; v < AROUND; v++) {
        struct spv_view view = views_around(a.header, v, AROUND, near, eps_px);
        double columns[COLUMNS];
        view.mode = mode;
        view.cull = cull;
        one_frame(soft, &a, &view, &store, picture, columns);
        for (int k = 0; k < COLUMNS; k++)
            frames[k][v] = columns[k];
    }
    printf("%s,%llu", path, (unsigned long long)store.bytes);
    for (int k = 0; k < COLUMNS; k++)
        printf(",%.*f", k < 2 ? 4 : 0, bench_median(frames[k], AROUND));
    putchar('\n');
    for (uint32_t i = 0; i < a.header->block_count; i++)
        free(store.payloads[i]);
    free(store.payloads);
    free(picture);
    bench_close(&a);
}

int main(int argc, char **argv)
{
    static const char *const modes[] = {"hybrid", "points", "triangles"};
    struct spc_error err = {0};
    struct spv_draw *soft = NULL;
    const bool cull = argc < 2 || strcmp(argv[1], "--no-cull") != 0;
    int mode = 0;
    argv += cull ? 0 : 1;
    argc -= cull ? 0 : 1;
    while (argc >= 5 && mode < 3 && strcmp(argv[2], modes[mode]) != 0)
        mode++;
    if (argc < 5 || mode == 3 || !(atof(argv[3]) > 0)) {
        fprintf(stderr, "usage: bench-frames [--no-cull] whole|near hybrid|points|triangles EPS ARCHIVE...\n");
        return 2;
    }
    bench_must(spv_soft_create(1, &soft, &err), "threads", &err);
    puts("archive,read,choose_ms,frame_ms,tested,nodes,triangles,blocks");
    for (int i = 4; i < argc; i++)
        measure(soft, argv[i], (enum spv_mode)mode, strcmp(argv[1], "near") == 0, atof(argv[3]), cull);
    spv_draw_free(soft);
    return 0;
}
