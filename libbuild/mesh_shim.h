/*
 * mesh_shim.h - OpenMesh at the edge: topology of one bounded patch. The only door to C++.
 *
 * Used where half-edges are worth their memory, never for a whole scan: today to cross-check, in
 * tests, what the builder finds out by hashing edges.
 */
#ifndef SPB_MESH_SHIM_H
#define SPB_MESH_SHIM_H

#include "spc.h"

#ifdef __cplusplus
extern "C" {
#endif

struct spb_mesh_topology {
    uint64_t faces_refused;         /* would make an edge of more than two faces, or of one side twice */
    uint64_t boundary_edges;
    uint64_t components;            /* of faces joined by edges; isolated vertices do not count */
};

/*
 * in     xyz[vertex_count][3], face[face_count][3]: indices below vertex_count, three distinct ones
 * fails  SPC_NO_MEMORY, SPC_INTERNAL
 */
enum spc_status spb_mesh_topology(const double (*xyz)[3], size_t vertex_count,
                                  const uint32_t (*face)[3], size_t face_count,
                                  struct spb_mesh_topology *out, struct spc_error *err);

/*
 * Reads a scan with the library's own reader, for tests to compare ours with: what it makes of the
 * file, which is less than the file holds where faces would make an edge of more than two.
 * fails  SPC_IO (it cannot), SPC_NO_MEMORY, SPC_INTERNAL
 */
enum spc_status spb_mesh_read(const char *path, uint64_t *vertices, uint64_t *faces,
                              struct spc_error *err);

#ifdef __cplusplus
}
#endif

#endif
