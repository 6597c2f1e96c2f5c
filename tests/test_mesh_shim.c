/*
 * The builder's closed-and-consistent test against OpenMesh's half-edges, and the readers of STL and
 * OFF against its readers. Only with MESH=1.
 */
#include "mesh_case.h"
#include "mesh_shim.h"
#include "source.h"
#include "suite.h"

#include <stdio.h>
#include <stdlib.h>

static bool closed_by_openmesh(const struct case_mesh *m)
{
    struct spb_mesh_topology t;
    struct spc_error err = {0};
    ck_assert_int_eq(spb_mesh_topology((const double(*)[3])m->xyz, m->vertex_count,
                                       (const uint32_t(*)[3])m->face, m->face_count, &t, &err),
                     SPC_OK);
    return t.faces_refused == 0 && t.boundary_edges == 0;
}

static void swap_corners(uint32_t face[3])
{
    const uint32_t corner = face[0];
    face[0] = face[1];
    face[1] = corner;
}

START_TEST(openmesh_agrees_on_what_is_closed_and_consistent)
{
    uint64_t state = 9;
    int closed = 0;
    for (int i = 0; i < 40; i++) {
        struct case_mesh m = i % 5 == 4 ? case_sheet(200, (uint64_t)i) : case_sphere(300, (uint64_t)i);
        const uint32_t at = (uint32_t)(case_random(&state) * m.face_count);
        if (i % 5 == 2)
            swap_corners(m.face[at]);
        if (i % 5 == 3) {                                   /* one face less, anywhere */
            memcpy(m.face[at], m.face[m.face_count - 1], sizeof m.face[at]);
            m.face_count--;
        }
        struct spc_reader *r = case_archive(&m);
        const bool ours = (spc_reader_header(r)->flags & SPC_FLAG_CULL_BACK) != 0;
        ck_assert_int_eq(ours, closed_by_openmesh(&m));
        closed += ours;
        spc_reader_close(r);
        case_mesh_free(&m);
    }
    ck_assert_int_eq(closed, 16);
}
END_TEST

START_TEST(components_are_counted)
{
    struct spb_mesh_topology t;
    const double xyz[6][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 0, 0}, {6, 0, 0}, {5, 1, 0}};
    const uint32_t face[3][3] = {{0, 1, 2}, {3, 4, 5}, {0, 1, 3}};
    ck_assert_int_eq(spb_mesh_topology(xyz, 6, face, 2, &t, NULL), SPC_OK);
    ck_assert_uint_eq(t.components, 2);
    ck_assert_uint_eq(t.boundary_edges, 6);
    ck_assert_int_eq(spb_mesh_topology(xyz, 6, face, 3, &t, NULL), SPC_OK);
    ck_assert_uint_eq(t.faces_refused, 1);                  /* 0 1 has a face on that side already */
}
END_TEST

/* Corners one behind the other, without numbers, or numbered. */
static const char *write_text(const struct case_mesh *m, bool stl)
{
    const char *const path = case_path(stl ? "mesh.stl" : "mesh.off");
    FILE *const f = fopen(path, "w");
    ck_assert_ptr_nonnull(f);
    fprintf(f, stl ? "solid mesh\n" : "OFF\n%u %u 0\n", m->vertex_count, m->face_count);
    for (uint32_t i = 0; i < m->vertex_count && !stl; i++)
        fprintf(f, "%.9g %.9g %.9g\n", m->xyz[i][0], m->xyz[i][1], m->xyz[i][2]);
    for (uint32_t i = 0; i < m->face_count; i++) {
        fprintf(f, stl ? "facet normal 0 0 0\nouter loop\n" : "3");
        for (int k = 0; k < 3; k++) {
            const double *const p = m->xyz[m->face[i][k]];
            if (stl)
                fprintf(f, "vertex %.9g %.9g %.9g\n", p[0], p[1], p[2]);
            else
                fprintf(f, " %u", m->face[i][k]);
        }
        fprintf(f, stl ? "endloop\nendfacet\n" : "\n");
    }
    fprintf(f, stl ? "endsolid mesh\n" : "");
    ck_assert_int_eq(fclose(f), 0);
    return path;
}

static int compare_places(const void *a, const void *b)
{
    const double *const p = a, *const q = b;
    for (int i = 0; i < 3; i++)
        if (p[i] != q[i])
            return p[i] < q[i] ? -1 : 1;
    return 0;
}

/* Vertices of a scan, one for each place if the scan has no numbers for them. */
static uint64_t count_vertices(const char *path, uint64_t *faces)
{
    struct spb_vertex_batch *const b = malloc(sizeof *b);
    struct spb_source *source = NULL;
    ck_assert_int_eq(spb_source_open(path, NULL, &source, NULL), SPC_OK);
    const struct spb_source_info info = *spb_source_info(source);
    double (*const xyz)[3] = malloc((info.vertex_count + 1) * sizeof *xyz);
    uint64_t count = 0, places = 0;
    ck_assert_int_eq(spb_source_begin_vertices(source, NULL), SPC_OK);
    for (b->count = 1; b->count > 0;) {
        ck_assert_int_eq(spb_source_vertices(source, b, NULL), SPC_OK);
        memcpy(xyz + count, b->xyz, b->count * sizeof *xyz);
        count += b->count;
    }
    qsort(xyz, info.by_place ? count : 0, sizeof *xyz, compare_places);
    for (uint64_t i = 0; i < count; i++)
        places += !info.by_place || i == 0 || compare_places(xyz[i], xyz[i - 1]) != 0;
    *faces = info.face_count;
    spb_source_close(source);
    free(xyz);
    free(b);
    return places;
}

static void compare_readers(const char *path, uint64_t dropped)
{
    uint64_t vertices = 0, faces = 0, their_vertices = 0, their_faces = 0;
    struct spc_error err = {0};
    const enum spc_status status = spb_mesh_read(path, &their_vertices, &their_faces, &err);
    ck_assert_msg(status == SPC_OK, "%s: %s", path, err.what);
    vertices = count_vertices(path, &faces);
    ck_assert_uint_eq(vertices, their_vertices);
    ck_assert_uint_eq(faces, their_faces + dropped);
}

START_TEST(openmesh_reads_as_many_vertices_and_faces)
{
    const char *const data = getenv("SPC_DATA");
    char path[400];
    for (int stl = 0; stl < 2; stl++) {
        struct case_mesh m = case_sphere(3000, 4);
        compare_readers(write_text(&m, stl), 0);
        case_mesh_free(&m);
    }
    if (data == NULL)
        return;
    snprintf(path, sizeof path, "%s/scans/lion_vase_poly.off", data);
    compare_readers(path, 0);
    snprintf(path, sizeof path, "%s/scans/CamelBox.stl", data);
    compare_readers(path, 48);              /* it keeps no face of fewer than three places either */
}
END_TEST

int main(void)
{
    return SUITE("mesh_shim", case_start, case_finish,
                 openmesh_agrees_on_what_is_closed_and_consistent, components_are_counted,
                 openmesh_reads_as_many_vertices_and_faces);
}
