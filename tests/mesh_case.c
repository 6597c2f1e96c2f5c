#include "mesh_case.h"

#include "bytes.h"

#include <check.h>
#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static char folder[64];

double case_random(uint64_t *state)
{
    uint64_t x = *state += 0x9E3779B97F4A7C15u;
    x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9u;
    x = (x ^ x >> 27) * 0x94D049BB133111EBu;
    return (double)((x ^ x >> 31) >> 11) * 0x1p-53;
}

static void *get(size_t n, size_t size)
{
    void *p = calloc(n + 1, size);
    ck_assert_ptr_nonnull(p);
    return p;
}

/* ---- meshes ------------------------------------------------------------------------------------ */

/* Rings of latitude between two poles; radius by a few waves and a little noise. */
struct case_mesh case_sphere(uint32_t n, uint64_t seed)
{
    uint32_t rings = (uint32_t)sqrt(n / 4.0);
    rings = rings < 2 ? 2 : rings;
    const uint32_t around = 2 * rings < 3 ? 3 : 2 * rings;
    struct case_mesh m = {.vertex_count = rings * around + 2, .face_count = 2 * rings * around};
    m.xyz = get(m.vertex_count, sizeof *m.xyz);
    m.face = get(m.face_count, sizeof *m.face);
    uint64_t state = seed;
    const double k[3] = {3 + 4 * case_random(&state), 3 + 4 * case_random(&state),
                         2 + 3 * case_random(&state)};
    for (uint32_t r = 0; r < rings; r++)
        for (uint32_t a = 0; a < around; a++) {
            const double t = 3.14159265358979 * (r + 1) / (rings + 1);
            const double p = 2 * 3.14159265358979 * a / around;
            const double radius = 1 + 0.1 * sin(k[0] * t) * cos(floor(k[1]) * p) +
                                  0.05 * sin(k[2] * t) + 0.02 / rings * case_random(&state);
            double *v = m.xyz[r * around + a];
            v[0] = radius * sin(t) * cos(p);
            v[1] = radius * sin(t) * sin(p);
            v[2] = radius * cos(t);
        }
    const uint32_t north = rings * around, south = north + 1;
    m.xyz[north][2] = 1.05;
    m.xyz[south][2] = -1.05;
    uint32_t f = 0;
    for (uint32_t a = 0; a < around; a++) {
        const uint32_t b = (a + 1) % around;
        memcpy(m.face[f++], (uint32_t[3]){north, a, b}, 12);
        for (uint32_t r = 0; r + 1 < rings; r++) {
            const uint32_t u = r * around, d = u + around;
            memcpy(m.face[f++], (uint32_t[3]){u + a, d + a, d + b}, 12);
            memcpy(m.face[f++], (uint32_t[3]){u + a, d + b, u + b}, 12);
        }
        memcpy(m.face[f++], (uint32_t[3]){south, (rings - 1) * around + b,
                                          (rings - 1) * around + a}, 12);
    }
    ck_assert_uint_eq(f, m.face_count);
    return m;
}

struct case_mesh case_soup(uint32_t n, uint64_t seed)
{
    struct case_mesh m = {.vertex_count = 3 * n, .face_count = n};
    m.xyz = get(m.vertex_count, sizeof *m.xyz);
    m.face = get(m.face_count, sizeof *m.face);
    uint64_t state = seed;
    for (uint32_t i = 0; i < n; i++) {
        const int kind = (int)(6 * case_random(&state));
        const double size = kind == 5 ? 1e-5 : 0.05;
        double (*v)[3] = &m.xyz[3 * i];
        for (int a = 0; a < 3; a++) {
            v[0][a] = case_random(&state);
            v[1][a] = v[0][a] + size * (case_random(&state) - 0.5);
            v[2][a] = v[0][a] + size * (case_random(&state) - 0.5);
        }
        if (kind == 1)              /* needle */
            for (int a = 0; a < 3; a++)
                v[2][a] = v[1][a] + 1e-6 * case_random(&state);
        if (kind == 2)              /* zero area: the third corner on the edge, or on a corner */
            for (int a = 0; a < 3; a++)
                v[2][a] = i % 2 ? v[1][a] : v[0][a] + 0.25 * (v[1][a] - v[0][a]);
        if (kind == 3) {            /* right angle, axis aligned */
            v[1][0] = v[0][0] + size;
            v[1][1] = v[2][0] = v[0][0] * 0 + v[0][1];
            v[2][0] = v[0][0];
            v[2][1] = v[0][1] + size;
            v[1][2] = v[2][2] = v[0][2];
        }
        memcpy(m.face[i], (uint32_t[3]){3 * i, 3 * i + 1, 3 * i + 2}, 12);
    }
    return m;
}

struct case_mesh case_sheet(uint32_t n, uint64_t seed)
{
    uint32_t side = (uint32_t)sqrt(n / 2.0);
    side = side < 1 ? 1 : side;
    struct case_mesh m = {.vertex_count = (side + 1) * (side + 1), .face_count = 2 * side * side};
    m.xyz = get(m.vertex_count, sizeof *m.xyz);
    m.face = get(m.face_count, sizeof *m.face);
    uint64_t state = seed;
    for (uint32_t y = 0; y <= side; y++)
        for (uint32_t x = 0; x <= side; x++) {
            double *v = m.xyz[y * (side + 1) + x];
            v[0] = (double)x / side;
            v[1] = (double)y / side;
            v[2] = 0.05 * sin(9 * v[0]) * cos(7 * v[1]) + 0.002 * case_random(&state);
        }
    uint32_t f = 0;
    for (uint32_t y = 0; y < side; y++)
        for (uint32_t x = 0; x < side; x++) {
            const uint32_t a = y * (side + 1) + x, b = a + 1, c = a + side + 1, d = c + 1;
            memcpy(m.face[f++], (uint32_t[3]){a, b, d}, 12);
            memcpy(m.face[f++], (uint32_t[3]){a, d, c}, 12);
        }
    return m;
}

void case_color(struct case_mesh *m)
{
    m->rgba = get(m->vertex_count, sizeof *m->rgba);
    for (uint32_t i = 0; i < m->vertex_count; i++) {
        m->rgba[i][0] = (uint8_t)(255 * fabs(sin(5 * m->xyz[i][0])));
        m->rgba[i][1] = (uint8_t)(255 * fabs(cos(4 * m->xyz[i][1])));
        m->rgba[i][2] = (uint8_t)(i % 251);
        m->rgba[i][3] = 255;
    }
}

void case_transform(struct case_mesh *m, double scale, const double offset[3])
{
    for (uint32_t i = 0; i < m->vertex_count; i++)
        for (int a = 0; a < 3; a++)
            m->xyz[i][a] = m->xyz[i][a] * scale + offset[a];
}

void case_add(struct case_mesh *m, struct case_mesh other, double scale, const double offset[3])
{
    m->xyz = realloc(m->xyz, (m->vertex_count + other.vertex_count) * sizeof *m->xyz);
    m->face = realloc(m->face, (m->face_count + other.face_count) * sizeof *m->face);
    ck_assert(m->xyz != NULL && m->face != NULL);
    case_transform(&other, scale, offset);
    memcpy(m->xyz + m->vertex_count, other.xyz, other.vertex_count * sizeof *m->xyz);
    for (uint32_t i = 0; i < other.face_count; i++)
        for (int c = 0; c < 3; c++)
            m->face[m->face_count + i][c] = m->vertex_count + other.face[i][c];
    m->vertex_count += other.vertex_count;
    m->face_count += other.face_count;
    case_mesh_free(&other);
}

void case_mesh_free(struct case_mesh *m)
{
    free(m->xyz);
    free(m->rgba);
    free(m->face);
    *m = (struct case_mesh){0};
}

/* ---- files ------------------------------------------------------------------------------------- */

void case_start(void)
{
    strcpy(folder, "/tmp/spc-test-XXXXXX");
    ck_assert_ptr_nonnull(mkdtemp(folder));
}

void case_finish(void)
{
    DIR *dir = opendir(folder);
    for (struct dirent *e; dir != NULL && (e = readdir(dir)) != NULL;)
        if (strcmp(e->d_name, ".") != 0 && strcmp(e->d_name, "..") != 0)
            unlink(case_path(e->d_name));
    if (dir != NULL)
        closedir(dir);
    rmdir(folder);
}

const char *case_path(const char *name)
{
    static char paths[64][400];
    static int next;
    next = (next + 1) % 64;
    snprintf(paths[next], sizeof paths[next], "%s/%s", folder, name);
    return paths[next];
}

const char *case_write(const struct case_mesh *m, const char *name)
{
    const char *path = case_path(name);
    FILE *f = fopen(path, "wb");
    ck_assert_ptr_nonnull(f);
    const char *type = m->wide ? "double" : "float";
    fprintf(f, "ply\nformat binary_little_endian 1.0\nelement vertex %u\n"
               "property %s x\nproperty %s y\nproperty %s z\n", m->vertex_count, type, type, type);
    if (m->rgba)
        fprintf(f, "property uchar red\nproperty uchar green\nproperty uchar blue\n"
                   "property uchar alpha\n");
    fprintf(f, "element face %u\nproperty list uchar int vertex_indices\nend_header\n",
            m->face_count);
    for (uint32_t i = 0; i < m->vertex_count; i++) {
        float narrow[3];
        for (int a = 0; a < 3; a++)
            narrow[a] = (float)m->xyz[i][a];
        fwrite(m->wide ? (void *)m->xyz[i] : (void *)narrow, m->wide ? 8 : 4, 3, f);
        if (m->rgba)
            fwrite(m->rgba[i], 1, 4, f);
    }
    for (uint32_t i = 0; i < m->face_count; i++) {
        fputc(3, f);
        fwrite(m->face[i], 4, 3, f);
    }
    ck_assert_int_eq(fclose(f), 0);
    return path;
}

struct spb_build_options case_options(const char *scan, const char *out)
{
    struct spb_build_options o;
    spb_build_defaults(&o);
    o.scan = scan;
    o.out = out;
    o.force = true;
    o.cluster_nodes = 700;
    o.block_nodes = 150;
    o.threads = 2;
    return o;
}

struct spc_reader *case_build(const struct spb_build_options *options)
{
    struct spb_build_report report;
    struct spc_error err = {0};
    struct spc_reader *reader = NULL;
    if (spb_build(options, &report, NULL, &err) != SPC_OK)
        ck_abort_msg("the build fails: %s", err.what);
    if (spc_reader_open(options->out, &reader, &err) != SPC_OK)
        ck_abort_msg("the archive does not open: %s", err.what);
    return reader;
}

struct spc_reader *case_archive(const struct case_mesh *mesh)
{
    const char *scan = case_write(mesh, "scan.ply");
    const struct spb_build_options o = case_options(scan, case_path("scan.spc"));
    return case_build(&o);
}

uint8_t *case_slurp(const char *path, size_t *bytes)
{
    FILE *f = fopen(path, "rb");
    ck_assert_ptr_nonnull(f);
    fseek(f, 0, SEEK_END);
    *bytes = (size_t)ftell(f);
    rewind(f);
    uint8_t *data = get(*bytes, 1);
    ck_assert_uint_eq(fread(data, 1, *bytes, f), *bytes);
    fclose(f);
    return data;
}

static void print_broken(void *ctx, const struct spc_finding *finding)
{
    (void)ctx;
    if (!finding->ok)
        printf("%s: %s\n", finding->invariant, finding->error.what);
}

void case_verify(const struct spc_reader *reader)
{
    struct spc_error err = {0};
    if (spc_verify(reader, 3, print_broken, NULL, &err) != SPC_OK)
        ck_abort_msg("the archive is not whole: %s", err.what);
}

double (*case_triangles(const struct spc_reader *reader, size_t *n))[3][3]
{
    const struct spc_header *h = spc_reader_header(reader);
    double (*out)[3][3] = get(h->triangle_count, sizeof *out);
    *n = 0;
    for (uint32_t k = 0; k < h->block_count; k++) {
        struct spc_block b;
        struct spc_block_layout l;
        spc_reader_block(reader, k, &b);
        if (b.kind != SPC_BLOCK_LEAF)
            continue;
        spc_block_layout(&b, h->flags, h->normal_clusters, &l);
        uint8_t *payload = get(l.bytes, 1);
        ck_assert_int_eq(spc_block_decode(reader, k, true, payload, NULL), SPC_OK);
        for (uint32_t i = 0; i < b.node_count; i++, ++*n)
            for (uint32_t c = 0; c < 3; c++)
                spc_vertex_decode(reader, &b, &l, payload,
                                  load_u16(payload + l.indices + 6 * i + 2 * c), out[*n][c], NULL);
        free(payload);
    }
    return out;
}
