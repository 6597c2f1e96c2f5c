/*
 * render ARCHIVE...: what a picture costs without a graphics card, as CSV.
 *
 * The same frames by OpenGL through OSMesa and by the back end without GL, in turns; times are user
 * CPU time of all threads. "draw" is the second with all blocks decoded before: what a frame costs
 * whoever keeps them. "differ" is the share of covered pixels that are not the same within 16 of 255.
 */
#include "bench.h"
#include "ctx.h"
#include "draw.h"
#include "kept.h"
#include "views.h"

#include <string.h>
#include <sys/resource.h>

enum { ROUNDS = 5, ACCURACIES_DRAWN = 3 };

static double wall_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

static double user_ms(void)
{
    struct rusage r;
    getrusage(RUSAGE_SELF, &r);
    return (double)r.ru_utime.tv_sec * 1e3 + (double)r.ru_utime.tv_usec * 1e-3;
}

struct kept {                       /* decoded blocks, by number */
    uint8_t **payloads;
};

static void keep(const struct bench_archive *a, const struct spv_selection *s, struct kept *k)
{
    struct spc_error err = {0};
    k->payloads = calloc(a->header->block_count, sizeof *k->payloads);
    for (uint32_t i = 0; i < s->block_count; i++) {
        struct spc_block b;
        const uint32_t block = s->blocks[i].block;
        spc_reader_block(a->reader, block, &b);
        k->payloads[block] = bench_memory(b.raw_bytes);
        bench_must(spc_block_decode(a->reader, block, true, k->payloads[block], &err), a->path, &err);
        bench_must(spv_kept_sort(a->reader, block, k->payloads[block], &err), a->path, &err);
    }
}

static void drop(const struct bench_archive *a, struct kept *k)
{
    for (uint32_t i = 0; i < a->header->block_count; i++)
        free(k->payloads[i]);
    free(k->payloads);
}

static double differ(const uint8_t *a, const uint8_t *b)
{
    size_t covered = 0, other = 0;
    for (size_t i = 0; i < (size_t)SIZE_PX * SIZE_PX; i++) {
        bool same = true;
        for (size_t c = 4 * i; c < 4 * i + 4; c++)
            same &= abs(a[c] - b[c]) <= 16;
        covered += a[4 * i + 3] != 0 || b[4 * i + 3] != 0;
        other += !same;
    }
    return covered ? (double)other / (double)covered : 0;
}

struct renderers {
    struct spv_draw *gl, *soft;
    uint8_t *by_gl, *by_soft;
};

static void measure(const struct renderers *r, const struct bench_archive *a, int accuracy,
                    enum spv_mode mode, enum spv_splat splat)
{
    static const char *const modes[] = {"hybrid", "points", "triangles"};
    const struct spv_draw_options options = {.splat = splat, .ambient = 0.2f};
    struct spv_view view = views_at(a->header, 4, accuracy);
    struct spv_selection s = {0};
    struct spc_error err = {0};
    double ms[4][ROUNDS];
    struct spv_drawn drawn;
    struct kept kept;
    view.mode = mode;
    bench_must(spv_select(a->reader, &view, &s, &err), a->path, &err);
    keep(a, &s, &kept);
    struct spv_item *items = bench_memory(s.block_count * sizeof *items);
    struct spv_part part = {.reader = a->reader, .items = items, .item_count = s.block_count};
    for (uint32_t i = 0; i < s.block_count; i++)
        items[i] = (struct spv_item){s.blocks[i].block, kept.payloads[s.blocks[i].block], -1};
    for (int k = 0; k < ROUNDS; k++) {
        double began = user_ms();
        if (r->gl != NULL)
            bench_must(spv_draw_selection(r->gl, a->reader, &view, &s, &options, r->by_gl, NULL, &err), a->path, &err);
        ms[0][k] = user_ms() - began;
        began = user_ms();
        bench_must(spv_draw_selection(r->soft, a->reader, &view, &s, &options, r->by_soft, NULL, &err), a->path, &err);
        ms[1][k] = user_ms() - began;
        const double wall = wall_ms();
        began = user_ms();
        bench_must(spv_draw_frame(r->soft, &view, NULL, &part, 1, &options, r->by_soft, &drawn, &err), a->path, &err);
        ms[2][k] = user_ms() - began;
        ms[3][k] = wall_ms() - wall;
    }
    free(items);
    printf("%s,%s,%s,%g,%llu,%llu,%llu,%.0f,%.0f,%.1f,%.1f,%.1f,%.5f\n", a->path, modes[mode],
           splat == SPV_SPLAT_EXACT ? "exact" : "fast", ACCURACY_PX[accuracy],
           (unsigned long long)s.nodes, (unsigned long long)drawn.nodes, (unsigned long long)drawn.triangles,
           bench_median(ms[0], ROUNDS), bench_median(ms[1], ROUNDS), bench_median(ms[2], ROUNDS),
           bench_median(ms[3], ROUNDS), (double)drawn.nodes / 1e3 / bench_median(ms[3], ROUNDS),
           r->gl != NULL ? differ(r->by_gl, r->by_soft) : 0);
    fflush(stdout);
    drop(a, &kept);
    spv_selection_release(&s);
}

int main(int argc, char **argv)
{
    struct renderers r = {.by_gl = bench_memory((size_t)4 * SIZE_PX * SIZE_PX),
                          .by_soft = bench_memory((size_t)4 * SIZE_PX * SIZE_PX)};
    struct spc_error err = {0};
    struct spv_ctx *ctx = NULL;
    if (getenv("SPC_NO_GL") == NULL) {
        bench_must(spv_ctx_osmesa(&ctx, &err), "OSMesa", &err);
        bench_must(spv_gl_create(ctx, &r.gl, &err), "OSMesa", &err);
    }
    bench_must(spv_soft_create(0, &r.soft, &err), "threads", &err);
    printf("archive,mode,splat,eps_px,nodes_processed,nodes_drawn,triangles_drawn,gl_ms,soft_ms,draw_ms,draw_wall_ms,"
           "msplats_per_s,differ\n");
    for (int i = 1; i < argc; i++) {
        struct bench_archive a = bench_open(argv[i]);
        for (int k = 0; k < ACCURACIES_DRAWN; k++)
            for (int m = 0; m < 4; m++)
                measure(&r, &a, k, m % 2 ? SPV_POINTS : SPV_HYBRID,
                        m < 2 ? SPV_SPLAT_EXACT : SPV_SPLAT_FAST);
        bench_close(&a);
    }
    spv_draw_free(r.soft);
    spv_draw_free(r.gl);
    spv_ctx_free(ctx);
    free(r.by_gl);
    free(r.by_soft);
    return 0;
}
