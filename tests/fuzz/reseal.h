/*
 * reseal.h - makes a changed archive agree with itself again.
 *
 * A reader refuses most changes at a checksum or at the first count that does not add up. What is
 * to be tried lies behind: so what was changed stays, and what follows from it is computed again.
 */
#ifndef RESEAL_H
#define RESEAL_H

#include <stddef.h>
#include <stdint.h>

enum reseal {
    RESEAL_HASHES = 1,              /* of chunks, sections and header */
    RESEAL_CHUNKS = 2,              /* chunk headers repeat the directory */
    RESEAL_COUNTS = 4,              /* sizes and places of blocks, sums over them, size of the file */
};

/*
 * Applies what is asked for, wherever the ranges that the bytes themselves name lie inside them.
 * Returns the new size: size, or less where RESEAL_COUNTS finds bytes behind the last chunk.
 */
size_t reseal(uint8_t *bytes, size_t size, unsigned what);

/* Records of a section of whole records: *first its offset, the result their number; 0 if none fit. */
uint32_t reseal_records(const uint8_t *bytes, size_t size, int section, uint64_t *first);

#endif
