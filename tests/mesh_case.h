/*
 * mesh_case.h - for tests of building and viewing: small scans in memory, built into archives.
 *
 * Scans are written as PLY to a folder of the test's own; case_start and case_finish are check
 * fixtures that make it and remove it with all that is in it.
 */
#ifndef MESH_CASE_H
#define MESH_CASE_H

#include "build.h"

#include <stdint.h>

struct case_mesh {
    double (*xyz)[3];
    uint8_t (*rgba)[4];             /* NULL: no colours */
    uint32_t (*face)[3];
    uint32_t vertex_count, face_count;
    bool wide;                      /* coordinates written as double */
};

/* A closed bumpy sphere of about n triangles, outward wound; every seed another. */
struct case_mesh case_sphere(uint32_t n, uint64_t seed);

/* Disconnected triangles in the unit cube: ordinary, needles, zero-area, right-angled, tiny. */
struct case_mesh case_soup(uint32_t n, uint64_t seed);

/* An open wavy sheet over a grid of about n triangles. */
struct case_mesh case_sheet(uint32_t n, uint64_t seed);

void case_color(struct case_mesh *mesh);                    /* gives each vertex a colour */
void case_transform(struct case_mesh *mesh, double scale, const double offset[3]);
/* Joins other, scaled and moved, to a mesh without colours; other is freed. */
void case_add(struct case_mesh *mesh, struct case_mesh other, double scale, const double offset[3]);
void case_mesh_free(struct case_mesh *mesh);

/* Uniform in [0, 1), from a state that it advances. */
double case_random(uint64_t *state);

void case_start(void);
void case_finish(void);

/* Path in the test's folder, in one of 64 buffers that are used in turn. */
const char *case_path(const char *name);

/* Writes a mesh as binary PLY; returns case_path(name). */
const char *case_write(const struct case_mesh *mesh, const char *name);

/* Defaults for tests: small clusters and blocks, so that small scans have many. */
struct spb_build_options case_options(const char *scan, const char *out);

/* Builds and opens; any failure fails the test. */
struct spc_reader *case_build(const struct spb_build_options *options);
struct spc_reader *case_archive(const struct case_mesh *mesh);      /* the two together, defaults */

/* Whole content of a file; *bytes its size. From malloc. */
uint8_t *case_slurp(const char *path, size_t *bytes);

/* Verifies at level 3 and fails the test with the finding otherwise. */
void case_verify(const struct spc_reader *reader);

/* All triangles of an archive: corners in file units [n][3][3]. From malloc; *n their number. */
double (*case_triangles(const struct spc_reader *reader, size_t *n))[3][3];

#endif
