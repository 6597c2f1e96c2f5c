/* fuzz_seeds.h - the archives that changes begin with. */
#ifndef FUZZ_SEEDS_H
#define FUZZ_SEEDS_H

#include <stddef.h>
#include <stdint.h>

/*
 * Archive k of FUZZ_SEEDS, from malloc: small ones of both codecs, with and without colours and
 * triangles. Inside case_start and case_finish of mesh_case.h.
 */
enum { FUZZ_SEEDS = 8 };
uint8_t *fuzz_seed(uint32_t k, size_t *size);

#endif
