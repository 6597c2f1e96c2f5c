/*
 * fuzz.h - what any bytes may be put into.
 *
 * A target takes size bytes that may be anything and returns 0. It must not crash, and it holds
 * what it gets to what spc.h says with assert. bytes must be a heap block of exactly that size, so
 * that a sanitizer sees a read behind its end.
 */
#ifndef FUZZ_H
#define FUZZ_H

#include <stddef.h>
#include <stdint.h>

int fuzz_open(const uint8_t *bytes, size_t size);       /* head: header, directory, records */
int fuzz_decode(const uint8_t *bytes, size_t size);     /* every block, node, vertex and top */
int fuzz_verify(const uint8_t *bytes, size_t size);     /* spc_verify at level 3, every tree */

/* As a scan: see fuzz_scan.h. */
int fuzz_ply(const uint8_t *bytes, size_t size);
int fuzz_stl(const uint8_t *bytes, size_t size);
int fuzz_off(const uint8_t *bytes, size_t size);
int fuzz_obj(const uint8_t *bytes, size_t size);

#endif
