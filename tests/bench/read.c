/*
 * What reading a scan costs, without building: read SCAN... prints, for each, CPU time and bytes
 * of the file a second, of opening it and of the passes over vertices and faces.
 */
#include "bench.h"
#include "source.h"

static struct spb_vertex_batch vertices;
static struct spb_face_batch faces;

static enum spc_status read_vertices(struct spb_source *source, struct spc_error *err)
{
    enum spc_status status = spb_source_begin_vertices(source, err);
    while (status == SPC_OK) {
        status = spb_source_vertices(source, &vertices, err);
        if (vertices.count == 0)
            break;
    }
    return status;
}

static enum spc_status read_faces(struct spb_source *source, struct spc_error *err)
{
    enum spc_status status = spb_source_begin_faces(source, err);
    while (status == SPC_OK) {
        status = spb_source_faces(source, &faces, err);
        if (faces.count == 0)
            break;
    }
    return status;
}

static void tell(const char *what, double s, uint64_t bytes)
{
    printf("  %-9s %8.3f s CPU %8.0f MB/s\n", what, s, (double)bytes / s * 1e-6);
}

static enum spc_status measure(const char *path, struct spc_error *err)
{
    struct spb_temp temp = {.folder = "."};
    const struct spb_source_options options = {.temp = &temp};
    struct spb_source *source = NULL;
    const double begin = bench_cpu();
    enum spc_status status = spb_source_open(path, &options, &source, err);
    if (status != SPC_OK)
        return status;
    const struct spb_source_info info = *spb_source_info(source);
    const double opened = bench_cpu();
    printf("%s: %s, %llu vertices, %llu faces%s%s\n", path, info.format,
           (unsigned long long)info.vertex_count, (unsigned long long)info.face_count,
           info.wide ? ", double" : "", info.colors ? ", coloured" : "");
    tell("open", opened - begin, info.file_bytes);
    status = read_vertices(source, err);
    const double vertices_read = bench_cpu();
    tell("vertices", vertices_read - opened, spb_source_bytes_done(source));
    if (status == SPC_OK)
        status = read_faces(source, err);
    tell("faces", bench_cpu() - vertices_read, spb_source_bytes_done(source));
    tell("all", bench_cpu() - begin, info.file_bytes);
    spb_source_close(source);
    return status;
}

int main(int argc, char **argv)
{
    for (int i = 1; i < argc; i++) {
        struct spc_error err = {0};
        const enum spc_status status = measure(argv[i], &err);
        bench_must(status, argv[i], &err);
    }
    return 0;
}
