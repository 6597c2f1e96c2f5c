#include "fuzz_seeds.h"

#include "mesh_case.h"

#include <assert.h>

/* Small, so that a change meets a field and not one of many equal triangles. */
uint8_t *fuzz_seed(uint32_t k, size_t *size)
{
    static const struct {
        uint32_t triangles, cluster_nodes, block_nodes, normal_clusters;
        bool colors, zstd, hybrid, wide;
    } seeds[FUZZ_SEEDS] = {
        {16, 16, 4, 1, false, false, true, false},  /* the one that every bit of is flipped */
        {4, 16, 4, 3, true, true, true, false},
        {60, 16, 6, 5, false, false, true, false},
        {60, 24, 8, 5, true, true, true, false},
        {40, 16, 5, 17, true, false, false, false},
        {150, 100, 40, 128, false, true, true, false},
        {30, 16, 8, 9, false, false, true, true},
        {1, 16, 4, 1, false, false, true, false},
    };
    assert(k < FUZZ_SEEDS);
    struct case_mesh m = k == 5 ? case_sphere(seeds[k].triangles, k)
                                : case_soup(seeds[k].triangles, k);
    if (seeds[k].colors)
        case_color(&m);
    m.wide = seeds[k].wide;
    for (uint32_t i = 0; m.wide && i < m.vertex_count; i++)     /* tiny triangles far apart: the */
        for (int a = 0; a < 3; a++) {                           /* lattice is fine, blocks span it */
            const double first = m.xyz[i - i % 3][a];
            m.xyz[i][a] = first + 1e-9 * (m.xyz[i][a] - first);
        }
    struct spb_build_options o = case_options(case_write(&m, "seed.ply"), case_path("seed.spc"));
    o.codec = seeds[k].zstd ? SPC_CODEC_ZSTD : SPC_CODEC_RAW;
    o.triangles = seeds[k].hybrid;
    o.cluster_nodes = seeds[k].cluster_nodes;
    o.block_nodes = seeds[k].block_nodes;
    o.normal_clusters = seeds[k].normal_clusters;
    spc_reader_close(case_build(&o));
    case_mesh_free(&m);
    return case_slurp(o.out, size);
}
