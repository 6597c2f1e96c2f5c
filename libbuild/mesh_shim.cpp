/*
 * mesh_shim.cpp - the only C++ file. No exception, type or allocation of OpenMesh leaves it, and it
 * keeps no state between calls.
 */
#include "mesh_shim.h"

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/Utils/PropertyManager.hh>

#include <iostream>
#include <new>
#include <vector>

using Mesh = OpenMesh::TriMesh_ArrayKernelT<>;

/* OpenMesh complains about refused faces on cerr; we count them instead. */
class QuietErrors {
public:
    QuietErrors() : before(omerr().is_enabled()) { omerr().disable(); }
    ~QuietErrors()
    {
        if (before)
            omerr().enable();
    }

private:
    bool before;
};

static uint64_t count_components(Mesh &mesh)
{
    std::vector<bool> seen(mesh.n_faces(), false);
    std::vector<Mesh::FaceHandle> stack;
    uint64_t components = 0;
    for (auto start : mesh.faces()) {
        if (seen[size_t(start.idx())])
            continue;
        components++;
        seen[size_t(start.idx())] = true;
        stack.push_back(start);
        while (!stack.empty()) {
            const Mesh::FaceHandle face = stack.back();
            stack.pop_back();
            for (auto other : mesh.ff_range(face))
                if (!seen[size_t(other.idx())]) {
                    seen[size_t(other.idx())] = true;
                    stack.push_back(other);
                }
        }
    }
    return components;
}

extern "C" enum spc_status spb_mesh_topology(const double (*xyz)[3], size_t vertex_count,
                                             const uint32_t (*face)[3], size_t face_count,
                                             struct spb_mesh_topology *out, struct spc_error *err)
try {
    const QuietErrors quiet;
    Mesh mesh;
    *out = {};
    mesh.reserve(vertex_count, 3 * face_count / 2, face_count);
    std::vector<Mesh::VertexHandle> handles(vertex_count);
    for (size_t i = 0; i < vertex_count; i++)
        handles[i] = mesh.add_vertex(Mesh::Point(float(xyz[i][0]), float(xyz[i][1]), float(xyz[i][2])));
    for (size_t i = 0; i < face_count; i++)
        out->faces_refused +=
            !mesh.add_face(handles[face[i][0]], handles[face[i][1]], handles[face[i][2]]).is_valid();
    for (auto edge : mesh.edges())
        out->boundary_edges += mesh.is_boundary(edge);
    out->components = count_components(mesh);
    return SPC_OK;
} catch (const std::bad_alloc &) {
    return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a mesh");
} catch (...) {
    return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "the mesh library failed");
}

extern "C" enum spc_status spb_mesh_read(const char *path, uint64_t *vertices, uint64_t *faces,
                                         struct spc_error *err)
try {
    const QuietErrors quiet;
    OpenMesh::PolyMesh_ArrayKernelT<> mesh;
    if (!OpenMesh::IO::read_mesh(mesh, path))
        return spc_fail(err, SPC_IO, SPC_NO_OFF, "the mesh library cannot read it");
    *vertices = mesh.n_vertices();
    *faces = mesh.n_faces();
    return SPC_OK;
} catch (const std::bad_alloc &) {
    return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a mesh");
} catch (...) {
    return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "the mesh library failed");
}
