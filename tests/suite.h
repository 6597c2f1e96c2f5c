/* suite.h - runs the tests of one file: main() { return SUITE(name, setup, teardown, tests...); } */
#ifndef SUITE_H
#define SUITE_H

#include <check.h>
#include <stddef.h>

typedef void (*suite_fixture)(void);

/* setup and teardown run around each test and may be NULL. Slow tests get two minutes. */
static inline int suite_run(const char *name, suite_fixture setup, suite_fixture teardown,
                            const TTest *const *tests, size_t count)
{
    Suite *suite = suite_create(name);
    TCase *tc = tcase_create(name);
    tcase_set_timeout(tc, 120);
    if (setup != NULL)
        tcase_add_checked_fixture(tc, setup, teardown);
    for (size_t i = 0; i < count; i++)
        tcase_add_test(tc, tests[i]);
    suite_add_tcase(suite, tc);
    SRunner *runner = srunner_create(suite);
    srunner_run_all(runner, CK_ENV);
    const int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed != 0;
}

#define SUITE(name, setup, teardown, ...)                                                       \
    suite_run(name, setup, teardown, (const TTest *const[]){__VA_ARGS__},                       \
              sizeof((const TTest *const[]){__VA_ARGS__}) / sizeof(const TTest *))

#endif
