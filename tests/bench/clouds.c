/*
 * clouds: what scripts/points measures with.
 *
 *     bench-clouds points SCAN OUT.ply        the vertices of a mesh, without its faces
 *     bench-clouds random|rowsN OUT.ply       100,000 points: a random sample of a sphere; rows around a
 *                                             cylinder, N times as far apart as points in a row
 *     bench-clouds sphere|cylinder OUT.ply    meshes of these
 *     bench-clouds cover REFERENCE.png PICTURE.png
 *
 * cover prints pixels of the reference that are not transparent; holes: those covered in it with their
 * 3 x 3 neighbourhood and empty in the picture; overhang: covered pixels of the picture more than one pixel,
 * and more than three, away from any of the reference.
 */
#include "source.h"

#include <math.h>
#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { POINTS = 100000 };

static const double TURN = 6.28318530717958647692;

static void header(FILE *f, const char *type, uint64_t vertices, uint64_t faces)
{
    fprintf(f, "ply\nformat binary_little_endian 1.0\nelement vertex %llu\nproperty %s x\nproperty %s y\n"
            "property %s z\n", (unsigned long long)vertices, type, type, type);
    if (faces > 0)
        fprintf(f, "element face %llu\nproperty list uchar int vertex_indices\n", (unsigned long long)faces);
    fputs("end_header\n", f);
}

static int copy_points(const char *scan, FILE *f)
{
    struct spb_vertex_batch *batch = malloc(sizeof *batch);
    struct spb_source *source = NULL;
    struct spc_error err = {0};
    enum spc_status status = spb_source_open(scan, NULL, &source, &err);
    if (status == SPC_OK && batch != NULL) {
        header(f, "double", spb_source_info(source)->vertex_count, 0);
        status = spb_source_begin_vertices(source, &err);
        while (status == SPC_OK && (status = spb_source_vertices(source, batch, &err)) == SPC_OK &&
               batch->count > 0)
            fwrite(batch->xyz, sizeof *batch->xyz, batch->count, f);
    }
    spb_source_close(source);
    free(batch);
    if (status != SPC_OK)
        fprintf(stderr, "%s: %s\n", scan, err.what);
    return status != SPC_OK;
}

static double random_unit(void)
{
    static uint64_t state = 1;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) / 0x1p53;
}

static void put_point(FILE *f, double r, double angle, double z)
{
    const double p[3] = {r * cos(angle), r * sin(angle), z};
    fwrite(p, sizeof p, 1, f);
}

static int make_random(FILE *f)
{
    header(f, "double", POINTS, 0);
    for (int i = 0; i < POINTS; i++) {
        const double z = 2 * random_unit() - 1;
        put_point(f, sqrt(1 - z * z), TURN * random_unit(), z);
    }
    return 0;
}

static int make_rows(FILE *f, int apart)
{
    const int rows = (int)(sqrt(POINTS * 2 / (TURN * apart)) + 0.5), row = POINTS / rows;
    header(f, "double", (uint64_t)rows * (uint64_t)row, 0);
    for (int i = 0; i < rows; i++)
        for (int k = 0; k < row; k++)
            put_point(f, 1, TURN * (k + 0.37 * i) / row, 2 * (i + 0.5) / rows - 1);
    return 0;
}

/* The cylinder ends where make_rows has its last row of sixty, about. */
static int make_mesh(FILE *f, bool sphere)
{
    enum { ALONG = 200, AROUND = 400 };
    header(f, "double", (ALONG + 1) * (AROUND + 1), 2 * ALONG * AROUND);
    for (int i = 0; i <= ALONG; i++)
        for (int k = 0; k <= AROUND; k++) {
            const double u = (double)i / ALONG, z = sphere ? cos(TURN / 2 * u) : 1.96 * u - 0.98;
            put_point(f, sphere ? sin(TURN / 2 * u) : 1, TURN * k / AROUND, z);
        }
    for (int i = 0; i < ALONG; i++)
        for (int k = 0; k < AROUND; k++) {
            const int a = i * (AROUND + 1) + k, below = a + AROUND + 1;
            const int corners[6] = {a, below, a + 1, a + 1, below, below + 1};
            for (int t = 0; t < 2; t++) {
                fputc(3, f);
                fwrite(corners + 3 * t, sizeof *corners, 3, f);
            }
        }
    return 0;
}

/* ---- pictures ------------------------------------------------------------------------------------- */

struct picture {
    png_image png;
    uint8_t *rgba;
};

static struct picture load(const char *path)
{
    struct picture p = {.png = {.version = PNG_IMAGE_VERSION}};
    if (!png_image_begin_read_from_file(&p.png, path))
        exit(1);
    p.png.format = PNG_FORMAT_RGBA;
    p.rgba = malloc(PNG_IMAGE_SIZE(p.png));
    if (p.rgba == NULL || !png_image_finish_read(&p.png, NULL, p.rgba, 0, NULL))
        exit(1);
    return p;
}

static bool covered(const struct picture *p, int x, int y)
{
    const int width = (int)p->png.width, height = (int)p->png.height;
    return x >= 0 && y >= 0 && x < width && y < height && p->rgba[4 * ((size_t)y * p->png.width + (size_t)x) + 3] > 0;
}

/* How many of the pixels up to reach away are covered. */
static int around(const struct picture *p, int x, int y, int reach)
{
    int n = 0;
    for (int j = -reach; j <= reach; j++)
        for (int i = -reach; i <= reach; i++)
            n += covered(p, x + i, y + j);
    return n;
}

static int cover(const char *reference_path, const char *path)
{
    const struct picture reference = load(reference_path), picture = load(path);
    long all = 0, holes = 0, over = 0, far = 0;
    for (int y = 0; y < (int)reference.png.height; y++)
        for (int x = 0; x < (int)reference.png.width; x++) {
            const bool is = covered(&picture, x, y);
            all += covered(&reference, x, y);
            holes += !is && around(&reference, x, y, 1) == 9;
            over += is && around(&reference, x, y, 1) == 0;
            far += is && around(&reference, x, y, 3) == 0;
        }
    printf("%ld %ld %ld %ld\n", all, holes, over, far);
    return 0;
}

int main(int argc, char **argv)
{
    if (argc == 4 && strcmp(argv[1], "cover") == 0)
        return cover(argv[2], argv[3]);
    FILE *f = argc == 3 || argc == 4 ? fopen(argv[argc - 1], "wb") : NULL;
    if (f == NULL)
        return 2;
    const char *what = argv[1];
    const int failed = strcmp(what, "points") == 0   ? copy_points(argv[2], f)
                       : strcmp(what, "random") == 0 ? make_random(f)
                       : strncmp(what, "rows", 4) == 0 ? make_rows(f, atoi(what + 4))
                                                       : make_mesh(f, strcmp(what, "sphere") == 0);
    return fclose(f) != 0 || failed;
}
