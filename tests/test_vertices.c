/* Cells that vertices lie in, told from a sample, in memory and on disk. */
#include "suite.h"
#include "vertices.h"

#include <math.h>
#include <stdlib.h>

enum { SIDE = 1500, COUNT = SIDE * SIDE };      /* more than the sample looks at */

static struct spb_space unit_cube(void)
{
    struct spb_space space;
    spb_space_init(&space, (const double[3]){0, 0, 0}, (const double[3]){0.999, 0.999, 0.999});
    return space;
}

static uint64_t cells_of(const float (*xyz)[3], bool on_disk, int cells_log2)
{
    const struct spb_space space = unit_cube();
    struct spb_temp temp = {.folder = "/tmp"};
    struct spb_vertices v = {.count = COUNT, .bytes = 12};
    uint64_t used = 0;
    if (on_disk) {
        ck_assert_int_eq(spb_tmpfile_create(&temp, &v.file, NULL), SPC_OK);
        ck_assert_int_eq(spb_tmpfile_append(v.file, "before", 6, &v.off, NULL), SPC_OK);
        ck_assert_int_eq(spb_tmpfile_append(v.file, xyz, (size_t)COUNT * 12, &v.off, NULL), SPC_OK);
    } else {
        v.table = (uint8_t *)(uintptr_t)xyz;
    }
    ck_assert_int_eq(spb_vertices_cells(&v, &space, cells_log2, &used, NULL), SPC_OK);
    ck_assert(!on_disk || temp.read < (uint64_t)COUNT * 12 * 2 / 3);
    spb_tmpfile_free(v.file);
    return used;
}

START_TEST(a_plane_uses_one_layer_of_cells)
{
    float (*xyz)[3] = malloc((size_t)COUNT * sizeof *xyz);
    for (uint32_t i = 0; i < COUNT; i++) {
        xyz[i][0] = (float)(i / SIDE) / SIDE;
        xyz[i][1] = (float)(i % SIDE) / SIDE;
        xyz[i][2] = i % 1000 == 999 ? NAN : 0.3f;
    }
    for (int log2 = 0; log2 <= 6; log2++)
        for (int on_disk = 0; on_disk < 2; on_disk++)
            ck_assert_uint_eq(cells_of((const float(*)[3])xyz, on_disk, log2), (uint64_t)1 << 2 * log2);
    free(xyz);
}
END_TEST

START_TEST(loose_vertices_use_them_all)
{
    float (*xyz)[3] = malloc((size_t)COUNT * sizeof *xyz);
    uint64_t state = 1;
    for (uint32_t i = 0; i < COUNT; i++)
        for (int a = 0; a < 3; a++) {
            state = state * 6364136223846793005u + 1442695040888963407u;
            xyz[i][a] = (float)((double)(state >> 40) / 0x1.01p24);
        }
    ck_assert_uint_eq(cells_of((const float(*)[3])xyz, false, 4), 4096);
    ck_assert_uint_eq(cells_of((const float(*)[3])xyz, true, 4), 4096);
    free(xyz);
}
END_TEST

int main(void)
{
    return SUITE("vertices", NULL, NULL, a_plane_uses_one_layer_of_cells, loose_vertices_use_them_all);
}
