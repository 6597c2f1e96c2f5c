/*
 * bench-readers SCAN...: what reading alone costs, of any format, without building anything.
 *
 * Opens each scan and makes both passes, ROUNDS times in turn, from the page cache (a round before
 * them warms it). Prints a line of CSV a scan: its size, and MB (10^6 bytes) a second of CPU time
 * on one core, system calls included, of opening (which reads only formats without counts), of the
 * vertex pass, of the face pass, each over the bytes it reads, and of the file over all three.
 */
#include "bench.h"

#include "source.h"

enum { ROUNDS = 5, TIMES = 4 };

static struct spb_vertex_batch vertices;
static struct spb_face_batch faces;

struct reading {
    double seconds[TIMES][ROUNDS];  /* open, vertices, faces, sum */
    uint64_t bytes[TIMES];
    uint64_t vertex_count, triangle_count;
    const char *format;
};

static void read_once(const char *path, struct reading *r, int round)
{
    struct spb_source *source = NULL;
    struct spc_error err = {0};
    double at[TIMES];
    at[0] = bench_cpu();
    bench_must(spb_source_open(path, NULL, &source, &err), path, &err);
    at[1] = bench_cpu();
    r->vertex_count = r->triangle_count = 0;
    bench_must(spb_source_begin_vertices(source, &err), path, &err);
    do {
        bench_must(spb_source_vertices(source, &vertices, &err), path, &err);
        r->vertex_count += vertices.count;
    } while (vertices.count > 0);
    r->bytes[1] = spb_source_bytes_done(source);
    at[2] = bench_cpu();
    bench_must(spb_source_begin_faces(source, &err), path, &err);
    do {
        bench_must(spb_source_faces(source, &faces, &err), path, &err);
        r->triangle_count += faces.count;
    } while (faces.count > 0);
    r->bytes[2] = spb_source_bytes_done(source);
    at[3] = bench_cpu();
    r->bytes[0] = r->bytes[3] = spb_source_info(source)->file_bytes;
    r->format = spb_source_info(source)->format;
    spb_source_close(source);
    for (int t = 0; t < TIMES - 1 && round >= 0; t++)
        r->seconds[t][round] = at[t + 1] - at[t];
    if (round >= 0)
        r->seconds[3][round] = at[3] - at[0];
}

int main(int argc, char **argv)
{
    struct reading *const all = bench_memory((size_t)argc * sizeof *all);
    if (argc < 2) {
        fprintf(stderr, "usage: bench-readers SCAN...\n");
        return 2;
    }
    for (int round = -1; round < ROUNDS; round++)
        for (int i = 1; i < argc; i++)
            read_once(argv[i], &all[i], round);
    printf("scan,format,bytes,vertices,triangles,open_mb_s,vertices_mb_s,faces_mb_s,all_mb_s\n");
    for (int i = 1; i < argc; i++) {
        const struct reading *const r = &all[i];
        printf("%s,%s,%llu,%llu,%llu", argv[i], r->format, (unsigned long long)r->bytes[3],
               (unsigned long long)r->vertex_count, (unsigned long long)r->triangle_count);
        for (int t = 0; t < TIMES; t++)
            printf(",%.0f", (double)r->bytes[t] / 1e6 / bench_median(all[i].seconds[t], ROUNDS));
        printf("\n");
    }
    free(all);
    return 0;
}
