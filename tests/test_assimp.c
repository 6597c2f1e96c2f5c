/*
 * Readers of scans against those of Assimp, on files that it reads correctly: the same triangles, in the
 * same order, corner by corner, up to rounding; and the same colours. Only with MESH=1.
 *
 * Assimp keeps no doubles, welds or parts vertices as it likes, and sorts faces by material: so corners are
 * compared by place, and scans here have one material.
 */
#include "mesh_case.h"
#include "source.h"
#include "suite.h"

#include <assimp/cimport.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct soup {                       /* triangles by place */
    float (*xyz)[3][3];
    uint8_t (*rgba)[3][4];
    size_t count;
    bool colors;
};

static void soup_free(struct soup *s)
{
    free(s->xyz);
    free(s->rgba);
}

static struct soup soup_of(size_t count)
{
    struct soup s = {calloc(count + 1, sizeof *s.xyz), calloc(count + 1, sizeof *s.rgba), 0, false};
    ck_assert(s.xyz != NULL && s.rgba != NULL);
    return s;
}

/* ---- ours -------------------------------------------------------------------------------------- */

static struct spb_vertex_batch vertex_batch;
static struct spb_face_batch face_batch;

static void read_vertices(struct spb_source *source, float (*xyz)[3], uint8_t (*rgba)[4])
{
    uint64_t n = 0;
    ck_assert_int_eq(spb_source_begin_vertices(source, NULL), SPC_OK);
    do {
        ck_assert_int_eq(spb_source_vertices(source, &vertex_batch, NULL), SPC_OK);
        for (size_t i = 0; i < vertex_batch.count; i++, n++) {
            for (int a = 0; a < 3; a++)
                xyz[n][a] = (float)vertex_batch.xyz[i][a];
            memcpy(rgba[n], vertex_batch.rgba[i], 4);
        }
    } while (vertex_batch.count > 0);
}

static struct soup read_ours(const char *path)
{
    struct spb_source *source = NULL;
    struct spc_error err = {0};
    ck_assert_msg(spb_source_open(path, NULL, &source, &err) == SPC_OK, "%s: %s", path, err.what);
    const struct spb_source_info *info = spb_source_info(source);
    struct soup s = soup_of((size_t)info->face_count * (info->strips ? 1 : 8));
    float (*xyz)[3] = calloc(info->vertex_count + 1, sizeof *xyz);
    uint8_t (*rgba)[4] = calloc(info->vertex_count + 1, sizeof *rgba);
    read_vertices(source, xyz, rgba);
    s.colors = info->colors;
    ck_assert_int_eq(spb_source_begin_faces(source, NULL), SPC_OK);
    do {
        ck_assert_int_eq(spb_source_faces(source, &face_batch, NULL), SPC_OK);
        for (size_t i = 0; i < face_batch.count; i++, s.count++)
            for (int k = 0; k < 3; k++) {
                const uint64_t v = face_batch.corner[i][k];
                ck_assert_uint_lt(v, info->vertex_count);
                memcpy(s.xyz[s.count][k], xyz[v], sizeof *xyz);
                memcpy(s.rgba[s.count][k], rgba[v], sizeof *rgba);
            }
    } while (face_batch.count > 0);
    free(xyz);
    free(rgba);
    spb_source_close(source);
    return s;
}

/* ---- Assimp's ---------------------------------------------------------------------------------- */

static void take_mesh(const struct aiMesh *mesh, struct soup *s)
{
    s->colors |= mesh->mColors[0] != NULL;
    for (unsigned i = 0; i < mesh->mNumFaces; i++) {
        const struct aiFace *face = &mesh->mFaces[i];
        ck_assert_uint_eq(face->mNumIndices, 3);
        for (int k = 0; k < 3; k++) {
            const struct aiVector3D p = mesh->mVertices[face->mIndices[k]];
            const float xyz[3] = {p.x, p.y, p.z};
            memcpy(s->xyz[s->count][k], xyz, sizeof xyz);
            if (mesh->mColors[0] == NULL)
                continue;
            const struct aiColor4D c = mesh->mColors[0][face->mIndices[k]];
            const float rgba[4] = {c.r, c.g, c.b, c.a};
            for (int a = 0; a < 4; a++)
                s->rgba[s->count][k][a] = (uint8_t)(rgba[a] * 255 + 0.5f);
        }
        s->count++;
    }
}

static struct soup read_theirs(const char *path)
{
    const struct aiScene *scene = aiImportFile(path, 0);
    ck_assert_msg(scene != NULL, "%s: %s", path, aiGetErrorString());
    size_t count = 0;
    for (unsigned i = 0; i < scene->mNumMeshes; i++)
        count += scene->mMeshes[i]->mNumFaces;
    struct soup s = soup_of(count);
    for (unsigned i = 0; i < scene->mNumMeshes; i++)
        take_mesh(scene->mMeshes[i], &s);
    aiReleaseImport(scene);
    return s;
}

/* From text Assimp takes numbers that are off by some last places. */
static bool same_places(const float (*a)[3], const float (*b)[3])
{
    for (int i = 0; i < 9; i++) {
        const float x = a[i / 3][i % 3], y = b[i / 3][i % 3];
        if (!(fabsf(x - y) <= 4e-7f * fabsf(x) + 1e-30f))
            return false;
    }
    return true;
}

static void compare(const char *path, size_t count)
{
    struct soup ours = read_ours(path), theirs = read_theirs(path);
    ck_assert_uint_eq(ours.count, theirs.count);
    ck_assert_uint_eq(ours.count, count);
    ck_assert_int_eq(ours.colors, theirs.colors);
    for (size_t i = 0; i < ours.count; i++) {
        ck_assert_msg(same_places((const float(*)[3])ours.xyz[i], (const float(*)[3])theirs.xyz[i]),
                      "%s: triangle %zu", path, i);
        if (ours.colors)
            ck_assert_msg(memcmp(ours.rgba[i], theirs.rgba[i], sizeof *ours.rgba) == 0,
                          "%s: colours of triangle %zu", path, i);
    }
    soup_free(&ours);
    soup_free(&theirs);
}

/* ---- scans ------------------------------------------------------------------------------------- */

static FILE *create(const char *path)
{
    FILE *f = fopen(path, "wb");
    ck_assert_ptr_nonnull(f);
    return f;
}

static const char *write_obj(const struct case_mesh *m)
{
    const char *path = case_path("mesh.obj");
    FILE *f = create(path);
    for (uint32_t i = 0; i < m->vertex_count; i++)
        fprintf(f, "v %.9g %.9g %.9g\n", m->xyz[i][0], m->xyz[i][1], m->xyz[i][2]);
    for (uint32_t i = 0; i < m->face_count; i++)
        fprintf(f, "f %u %u %u\n", m->face[i][0] + 1, m->face[i][1] + 1, m->face[i][2] + 1);
    ck_assert_int_eq(fclose(f), 0);
    return path;
}

static const char *write_off(const struct case_mesh *m)
{
    const char *path = case_path("mesh.off");
    FILE *f = create(path);
    fprintf(f, "OFF\n%u %u 0\n", m->vertex_count, m->face_count);
    for (uint32_t i = 0; i < m->vertex_count; i++)
        fprintf(f, "%.9g %.9g %.9g\n", m->xyz[i][0], m->xyz[i][1], m->xyz[i][2]);
    for (uint32_t i = 0; i < m->face_count; i++)
        fprintf(f, "3 %u %u %u\n", m->face[i][0], m->face[i][1], m->face[i][2]);
    ck_assert_int_eq(fclose(f), 0);
    return path;
}

static const char *write_stl(const struct case_mesh *m, bool text)
{
    const char *path = case_path(text ? "text.stl" : "binary.stl");
    FILE *f = create(path);
    const char head[80] = "made by a test";
    const float no_normal[3] = {0, 0, 1};
    if (text)
        fprintf(f, "solid mesh\n");
    else
        fwrite(head, 1, 80, f), fwrite(&m->face_count, 4, 1, f);
    for (uint32_t i = 0; i < m->face_count; i++) {
        text ? (void)fprintf(f, "facet normal 0 0 1\nouter loop\n") : (void)fwrite(no_normal, 4, 3, f);
        for (int k = 0; k < 3; k++) {
            const double *p = m->xyz[m->face[i][k]];
            const float narrow[3] = {(float)p[0], (float)p[1], (float)p[2]};
            if (text)
                fprintf(f, "vertex %.9g %.9g %.9g\n", p[0], p[1], p[2]);
            else
                fwrite(narrow, 4, 3, f);
        }
        text ? (void)fprintf(f, "endloop\nendfacet\n") : (void)fwrite("\0\0", 1, 2, f);
    }
    if (text)
        fprintf(f, "endsolid mesh\n");
    ck_assert_int_eq(fclose(f), 0);
    return path;
}

START_TEST(assimp_reads_the_same_triangles)
{
    struct case_mesh meshes[] = {case_sphere(3000, 11), case_sheet(3000, 12)};
    for (size_t i = 0; i < sizeof meshes / sizeof *meshes; i++) {
        struct case_mesh *m = &meshes[i];
        compare(case_write(m, "mesh.ply"), m->face_count);
        compare(write_obj(m), m->face_count);
        compare(write_off(m), m->face_count);
        compare(write_stl(m, true), m->face_count);
        compare(write_stl(m, false), m->face_count);
        case_color(m);
        compare(case_write(m, "colors.ply"), m->face_count);
        case_mesh_free(m);
    }
}
END_TEST

START_TEST(assimp_reads_the_same_of_real_scans)
{
    static const struct { const char *name; size_t triangles; } scans[] = {
        {"NZBWF1_J.ply", 213462}, {"dragon_vrip_res2.ply", 202520}, {"horse.ply", 96966},
        {"kexueguanMesh.ply", 188876}, {"CamelBox.stl", 49260}, {"nefertiti.obj", 99938},
        {"stanford-bunny.obj", 69451}, {"tinsimp_0.obj", 88670},
    };
    const char *data = getenv("SPC_DATA");
    char path[400];
    for (size_t i = 0; i < sizeof scans / sizeof *scans && data != NULL; i++) {
        snprintf(path, sizeof path, "%s/scans/%s", data, scans[i].name);
        compare(path, scans[i].triangles);
    }
}
END_TEST

int main(void)
{
    return SUITE("assimp", case_start, case_finish, assimp_reads_the_same_triangles,
                 assimp_reads_the_same_of_real_scans);
}
