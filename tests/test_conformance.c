#include "mesh_case.h"
#include "suite.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The archives of spec/conformance, by the list in its README. */

static enum spc_status status_of(const char *path)
{
    struct spc_reader *r = NULL;
    size_t size = 0;
    uint8_t *file = case_slurp(path, &size);
    ck_assert_uint_le(size, 65536);
    uint8_t *bytes = malloc(size);  /* of exactly that size */
    memcpy(bytes, file, size);
    free(file);
    enum spc_status status = spc_reader_open_memory(bytes, size, &r, NULL);
    if (status == SPC_OK)
        status = spc_verify(r, 3, NULL, NULL, NULL);
    spc_reader_close(r);
    free(bytes);
    return status;
}

static int files_in(const char *folder)
{
    DIR *dir = opendir(folder);
    int n = 0;
    ck_assert_msg(dir != NULL, "run from the top of the tree");
    for (struct dirent *e; (e = readdir(dir)) != NULL;)
        n += strstr(e->d_name, ".spc") != NULL;
    closedir(dir);
    return n;
}

START_TEST(every_archive_has_the_status_that_the_list_gives)
{
    char line[300], name[100], want[40], path[200];
    int good = 0, bad = 0;
    FILE *list = fopen("spec/conformance/README.md", "r");
    ck_assert_msg(list != NULL, "run from the top of the tree");
    while (fgets(line, sizeof line, list) != NULL) {
        if (sscanf(line, "| %99[a-z0-9/.-] | %39[A-Z_] |", name, want) != 2)
            continue;
        snprintf(path, sizeof path, "spec/conformance/%s", name);
        ck_assert_msg(strcmp(spc_status_name(status_of(path)), want) == 0, "%s: %s, not %s", name,
                      spc_status_name(status_of(path)), want);
        if (strcmp(want, "OK") == 0)
            good++;
        else
            bad++;
    }
    fclose(list);
    ck_assert_int_ge(good, 12);
    ck_assert_int_ge(bad, 12);
    ck_assert_int_eq(good, files_in("spec/conformance/good"));
    ck_assert_int_eq(bad, files_in("spec/conformance/bad"));
}
END_TEST

int main(void)
{
    return SUITE("conformance", NULL, NULL, every_archive_has_the_status_that_the_list_gives);
}
