/*
 * Damage by accident: single bits turned anywhere in an archive, and ends cut off. Verification
 * must find every one. SPC_FLIPS=n turns so many bits and cuts n / 4 times, in archives of
 * SPC_FLIPS_TRIANGLES; make flips takes larger ones.
 */
#include "mesh_case.h"
#include "suite.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { KINDS = 4 };                 /* raw, zstd; plain, coloured */

static uint64_t setting(const char *name, uint64_t otherwise)
{
    const char *text = getenv(name);
    return text ? strtoull(text, NULL, 10) : otherwise;
}

static uint8_t *build(int kind, size_t *size)
{
    struct case_mesh m = case_sphere((uint32_t)setting("SPC_FLIPS_TRIANGLES", 500), 11);
    if (kind & 2)
        case_color(&m);
    struct spb_build_options o = case_options(case_write(&m, "a.ply"), case_path("a.spc"));
    o.codec = kind & 1 ? SPC_CODEC_ZSTD : SPC_CODEC_RAW;
    struct spc_reader *r = case_build(&o);
    case_verify(r);
    spc_reader_close(r);
    case_mesh_free(&m);
    return case_slurp(o.out, size);
}

static enum spc_status examine(const uint8_t *bytes, size_t size)
{
    struct spc_reader *r = NULL;
    enum spc_status status = spc_reader_open_memory(bytes, size, &r, NULL);
    if (status == SPC_OK)
        status = spc_verify(r, 3, NULL, NULL, NULL);
    spc_reader_close(r);
    return status;
}

/* How often each answer was given; the numbers of the statuses are below 100. */
static void print_answers(const char *what, int kind, size_t size, uint64_t n,
                          const uint64_t answers[100])
{
    printf("%s, %s%s, %zu bytes: %llu of %llu found (", what, kind & 1 ? "zstd" : "raw",
           kind & 2 ? " with colours" : "", size, (unsigned long long)(n - answers[SPC_OK]),
           (unsigned long long)n);
    const char *comma = "";
    for (int s = 1; s < 100; s++)
        if (answers[s] != 0) {
            printf("%s%llu %s", comma, (unsigned long long)answers[s],
                   spc_status_name((enum spc_status)s));
            comma = ", ";
        }
    printf(")\n");
    fflush(stdout);                 /* a failed test's process does not */
}

START_TEST(every_turned_bit_is_found)
{
    const int kind = _i;
    const uint64_t n = setting("SPC_FLIPS", 20000) / KINDS;
    uint64_t answers[100] = {0}, state = 100 + (uint64_t)kind;
    size_t size = 0;
    uint8_t *bytes = build(kind, &size);
    for (uint64_t i = 0; i < n; i++) {
        const size_t at = (size_t)(case_random(&state) * (double)size);
        const uint8_t bit = (uint8_t)(1 << (int)(8 * case_random(&state)));
        bytes[at] ^= bit;
        const enum spc_status status = examine(bytes, size);
        bytes[at] ^= bit;
        answers[status]++;
        if (status == SPC_OK)
            printf("not found: byte %zu turned by 0x%02x\n", at, bit);
    }
    ck_assert_int_eq(examine(bytes, size), SPC_OK);
    print_answers("turned bits", kind, size, n, answers);
    ck_assert_uint_eq(answers[SPC_OK], 0);
    free(bytes);
}
END_TEST

/* The ends of cut archives are ends of heap blocks too: a sanitizer sees a read behind them. */
START_TEST(every_cut_is_found)
{
    const int kind = _i;
    const uint64_t n = setting("SPC_FLIPS", 20000) / 4 / KINDS;
    uint64_t answers[100] = {0}, state = 200 + (uint64_t)kind;
    size_t size = 0;
    uint8_t *bytes = build(kind, &size);
    for (uint64_t i = 0; i < n; i++) {
        const size_t cut = (size_t)(case_random(&state) * (double)size);
        uint8_t *copy = malloc(cut);
        memcpy(copy, bytes, cut);
        const enum spc_status status = examine(copy, cut);
        free(copy);
        answers[status]++;
        if (status == SPC_OK)
            printf("not found: cut at %zu\n", cut);
    }
    print_answers("cuts", kind, size, n, answers);
    ck_assert_uint_eq(answers[SPC_OK], 0);
    free(bytes);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("flips");
    TCase *tc = tcase_create("flips");
    tcase_set_timeout(tc, 3600);
    tcase_add_checked_fixture(tc, case_start, case_finish);
    tcase_add_loop_test(tc, every_turned_bit_is_found, 0, KINDS);
    tcase_add_loop_test(tc, every_cut_is_found, 0, KINDS);
    suite_add_tcase(suite, tc);
    SRunner *runner = srunner_create(suite);
    srunner_run_all(runner, CK_ENV);
    const int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed != 0;
}
