/* The builder's closed-and-consistent test against OpenMesh's half-edges. Only with MESH=1. */
#include "mesh_case.h"
#include "mesh_shim.h"
#include "suite.h"

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

int main(void)
{
    return SUITE("mesh_shim", case_start, case_finish,
                 openmesh_agrees_on_what_is_closed_and_consistent, components_are_counted);
}
