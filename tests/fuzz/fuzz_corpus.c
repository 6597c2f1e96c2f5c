/*
 * fuzz_corpus FOLDER: writes what fuzzing begins with, archives and scans of each format, each into a
 * folder of it; a test, as its helpers want.
 */
#include "fuzz_seeds.h"

#include "mesh_case.h"
#include "scan_seeds.h"
#include "suite.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>

static const char *folder;

static void write_seed(const char *name, uint32_t number, const void *bytes, size_t size)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    ck_assert_msg(mkdir(path, 0777) == 0 || errno == EEXIST, "cannot make %s", path);
    snprintf(path, sizeof path, "%s/%s/%u", folder, name, number);
    FILE *f = fopen(path, "wb");
    ck_assert_msg(f != NULL, "cannot write %s", path);
    ck_assert_uint_eq(fwrite(bytes, 1, size, f), size);
    ck_assert_int_eq(fclose(f), 0);
}

START_TEST(seeds_are_written)
{
    for (uint32_t k = 0; k < FUZZ_SEEDS; k++) {
        size_t size = 0;
        uint8_t *bytes = fuzz_seed(k, &size);
        write_seed("archive", k, bytes, size);
        free(bytes);
    }
}
END_TEST

START_TEST(scans_are_written)
{
    struct file_text f = { .big = false };
    for (int format = 0; format < SCAN_FORMATS; format++)
        for (uint32_t k = 0; scan_seed(format, k, &f); k++) {
            write_seed(scan_seed_names[format], k, f.data, f.bytes);
            free(f.data);
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
    return SUITE("fuzz_corpus", case_start, case_finish, seeds_are_written,
                 scans_are_written);
}
