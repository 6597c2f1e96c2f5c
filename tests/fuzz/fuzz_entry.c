/*
 * fuzz_entry.c - libFuzzer's side of a target: compiled once for each, as FUZZ_TARGET; with
 * FUZZ_RESEAL where the bytes are an archive.
 */
#include "fuzz.h"

#include "mutate.h"

size_t LLVMFuzzerMutate(uint8_t *bytes, size_t size, size_t size_max);
int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);
size_t LLVMFuzzerCustomMutator(uint8_t *bytes, size_t size, size_t size_max, unsigned seed);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    return FUZZ_TARGET(bytes, size);
}

#ifdef FUZZ_RESEAL
/* Once in four what libFuzzer would do, so that what is not a field changes too, sizes included. */
size_t LLVMFuzzerCustomMutator(uint8_t *bytes, size_t size, size_t size_max, unsigned seed)
{
    uint64_t random = seed;
    if (mutate_random(&random) % 4 == 0)
        size = LLVMFuzzerMutate(bytes, size, size_max);
    return mutate_and_reseal(bytes, size, &random);
}
#endif
