/* fuzz_corpus FOLDER: writes the archives that fuzzing begins with; a test, as its helpers want. */
#include "fuzz_seeds.h"

#include "mesh_case.h"
#include "suite.h"

#include <stdio.h>
#include <stdlib.h>

static const char *folder;

START_TEST(seeds_are_written)
{
    for (uint32_t k = 0; k < FUZZ_SEEDS; k++) {
        char path[4096];
        size_t size = 0;
        uint8_t *bytes = fuzz_seed(k, &size);
        snprintf(path, sizeof path, "%s/seed%u", folder, k);
        FILE *f = fopen(path, "wb");
        ck_assert_ptr_nonnull(f);
        ck_assert_uint_eq(fwrite(bytes, 1, size, f), size);
        ck_assert_int_eq(fclose(f), 0);
        free(bytes);
    }
}
END_TEST

int main(int argc, char **argv)
{
    if (argc != 2) {
        fprintf(stderr, "usage: fuzz_corpus FOLDER\n");
        return 2;
    }
    folder = argv[1];
    return SUITE("fuzz_corpus", case_start, case_finish, seeds_are_written);
}
