/* mutate.h - changes of an archive that know where its fields are. */
#ifndef MUTATE_H
#define MUTATE_H

#include <stddef.h>
#include <stdint.h>

/* Next of a sequence of random numbers; splitmix64. */
uint64_t mutate_random(uint64_t *state);

/*
 * Changes one field, value or byte of bytes[size] in place: of header, section table, directory,
 * chunk headers, raw nodes, or anywhere. Without checksums: see reseal.h.
 */
void mutate(uint8_t *bytes, size_t size, uint64_t *random);

/* Some changes, and most times checksums and counts put right again. Returns the new size. */
size_t mutate_and_reseal(uint8_t *bytes, size_t size, uint64_t *random);

#endif
