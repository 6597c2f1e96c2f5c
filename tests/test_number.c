#include "number.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "suite.h"

static uint64_t random_state;

static uint64_t random_u64(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return random_state;
}

/* Parses from an exactly sized copy, so that a memory checker sees a step behind the zero. */
static bool parse(const char *text, double *out, size_t *used)
{
    const size_t bytes = strlen(text) + 1;
    uint8_t *const copy = malloc(bytes);
    memcpy(copy, text, bytes);
    const uint8_t *const end = spb_number_real(copy, out);
    *used = end ? (size_t)(end - copy) : 0;
    free(copy);
    return end != NULL;
}

static void expect_as_strtod(const char *text)
{
    double got = -77;
    size_t used = 0;
    char *end;
    const double want = strtod(text, &end);

    /* Not ck_assert: that writes to a pipe each time it passes. */
    if (!parse(text, &got, &used))
        ck_abort_msg("'%s' was refused", text);
    if (used != (size_t)(end - text))
        ck_abort_msg("'%s': %zu characters used", text, used);
    if (memcmp(&got, &want, sizeof got) != 0)
        ck_abort_msg("'%s': %a is not %a", text, got, want);
}

START_TEST(plain_numbers_read_as_strtod_reads_them)
{
    static const char *const texts[] = {
        "0", "-0", "+0", "1", "-1", "+1.5", ".5", "5.", "-.5e1", "1e5", "1E5", "1e+5", "1e-5",
        "0.0321981", "-0.0503247", "416155", "309.78", "1e22", "1e23", "1e-22", "1e-23", "1e27",
        "1e28", "1e-27", "1e-28", "9007199254740991", "9007199254740992", "9007199254740993",
        "9007199254740995", "18446744073709551615", "18446744073709551616", "9999999999999999999",
        "0.10000000000000001", "0.1000000000000000055511151231257827", "1.7976931348623157e308",
        "1.7976931348623159e308", "1e400", "-1e400", "4.9e-324", "2.4e-324", "1e-400", "0e999999999",
        "2.2250738585072011e-308", "000000000000000000000000000000001.5", "0.00000000000000000000001",
        "00000000000000000000", "0.000000000000000000000000", "123456789012345678901234567890.125",
        "1e99999999999", "1e-99999999999", "-12345678901234567890e-30", "8.5e-1 ", "7 8", "7e5x"
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
        expect_as_strtod(texts[i]);
}
END_TEST

START_TEST(halfway_cases_round_to_even)
{
    char text[80];
    for (int i = 0; i < 200; i++) {
        /* Exactly between two doubles of 2^53 .. 2^54, and one unit to either side. */
        const uint64_t odd = (UINT64_C(1) << 53) + 2 * (uint64_t)i + 1;
        snprintf(text, sizeof text, "%llu", (unsigned long long)odd);
        expect_as_strtod(text);
        snprintf(text, sizeof text, "%llu.%d", (unsigned long long)odd, i);
        expect_as_strtod(text);
        /* The same made by a quotient: odd / 2^k has k decimals. */
        snprintf(text, sizeof text, "%.17g", (double)odd / 1024.0);
        expect_as_strtod(text);
        snprintf(text, sizeof text, "%llu%03de-3", (unsigned long long)odd, i % 2 ? 0 : 1);
        expect_as_strtod(text);
    }
}
END_TEST

START_TEST(random_numbers_read_as_strtod_reads_them)
{
    random_state = 20240611;
    printf("seed %llu\n", (unsigned long long)random_state);
    for (int i = 0; i < 400000; i++) {
        char text[64];
        const int digits = 1 + (int)(random_u64() % 22), point = (int)(random_u64() % 24);
        size_t length = 0;
        for (int k = 0; k < digits; k++) {
            if (k == point)
                text[length++] = '.';
            text[length++] = (char)('0' + random_u64() % 10);
        }
        if (random_u64() % 3 == 0)
            length += (size_t)snprintf(text + length, 8, "e%d", (int)(random_u64() % 61) - 30);
        text[length] = 0;
        expect_as_strtod(text);
    }
}
END_TEST

START_TEST(quotients_by_large_powers_round_once)
{
    /* By 10^27 the quotient has so few bits to spare that its remainder decides one in 8192. */
    random_state = 20240613;
    printf("seed %llu\n", (unsigned long long)random_state);
    for (int i = 0; i < 100000; i++) {
        char text[64];
        snprintf(text, sizeof text, "%llue%d", (unsigned long long)(random_u64() % 9999999999999999999u),
                 i % 2 ? -27 : 27);
        expect_as_strtod(text);
    }
}
END_TEST

START_TEST(doubles_printed_with_17_digits_come_back)
{
    random_state = 20240612;
    printf("seed %llu\n", (unsigned long long)random_state);
    for (int i = 0; i < 300000; i++) {
        const uint64_t bits = random_u64();
        double value, got;
        char text[64];
        size_t used;
        memcpy(&value, &bits, sizeof value);
        if (i % 2)
            value = (double)(int64_t)(bits >> 20) / 65536.0 / 1048576.0;    /* sizes of scans */
        if (!isfinite(value))
            continue;
        snprintf(text, sizeof text, "%.17g", value);
        if (!parse(text, &got, &used) || memcmp(&got, &value, sizeof got) != 0)
            ck_abort_msg("'%s'", text);
    }
}
END_TEST

START_TEST(names_of_nan_and_infinity_are_known)
{
    static const struct {
        const char *text;
        size_t used;
        double value;
    } cases[] = {
        { "nan", 3, NAN }, { "NaN", 3, NAN }, { "-nan", 4, NAN }, { "nan(ind)", 8, NAN },
        { "-nan(0x7f)", 10, NAN }, { "nan(", 3, NAN }, { "inf", 3, INFINITY }, { "-Inf", 4, -INFINITY },
        { "+INFINITY", 9, INFINITY }, { "infinit", 3, INFINITY }, { "1.#INF", 6, INFINITY },
        { "-1.#INF00", 9, -INFINITY }, { "1.#QNAN", 7, NAN }, { "-1.#IND0", 8, NAN },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        double got = 0;
        size_t used = 0;
        ck_assert_msg(parse(cases[i].text, &got, &used), "%s", cases[i].text);
        ck_assert_uint_eq(used, cases[i].used);
        ck_assert_msg(isnan(cases[i].value) ? isnan(got) : got == cases[i].value, "%s",
                      cases[i].text);
    }
}
END_TEST

START_TEST(what_is_no_number_is_refused)
{
    static const char *const texts[] = {
        "", "-", "+", ".", "-.", "e5", ".e5", "1e", "1e+", "1.5e-", "abc", "--1", "+-1", "in", "na",
        "1.#", "1.#X", ",5", "#"
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        double got;
        size_t used;
        ck_assert_msg(!parse(texts[i], &got, &used), "'%s'", texts[i]);
    }
}
END_TEST

START_TEST(very_long_numbers_are_read_up_to_the_limit)
{
    char text[SPB_NUMBER_MAX + 16];
    double got;
    size_t used;

    memset(text, '1', sizeof text);
    text[SPB_NUMBER_MAX] = 0;
    ck_assert(parse(text, &got, &used));
    ck_assert(isinf(got));
    text[1] = '.';
    expect_as_strtod(text);
    text[1] = '1';
    text[SPB_NUMBER_MAX] = '1';
    text[SPB_NUMBER_MAX + 1] = 0;
    ck_assert(!parse(text, &got, &used));
}
END_TEST

START_TEST(whole_numbers_are_told_from_others)
{
    static const struct {
        const char *text;
        int64_t value;
    } cases[] = {
        { "0", 0 }, { "-1", -1 }, { "+3", 3 }, { "3.0", 3 }, { "-2.50e1", -25 }, { "1e3", 1000 },
        { "4294967295", 4294967295 }, { "999999999999999999", 999999999999999999 },
        { "1000000000000000000", 1000000000000000000 }, { "1.5", SPB_NOT_WHOLE },
        { "nan", SPB_NOT_WHOLE }, { "inf", SPB_NOT_WHOLE }, { "1e30", SPB_NOT_WHOLE },
        { "-1e30", SPB_NOT_WHOLE }, { "99999999999999999999999", SPB_NOT_WHOLE },
        { "1.#IND", SPB_NOT_WHOLE }, { "0000000000000000000000012", 12 },
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        int64_t got = 77;
        const uint8_t *const text = (const uint8_t *)cases[i].text;
        const uint8_t *const end = spb_number_int(text, &got);
        ck_assert_ptr_eq(end, text + strlen(cases[i].text));
        ck_assert_msg(got == cases[i].value, "%s: %lld", cases[i].text, (long long)got);
    }
    int64_t got;
    ck_assert_ptr_null(spb_number_int((const uint8_t *)"x", &got));
    ck_assert_ptr_null(spb_number_int((const uint8_t *)"-", &got));
}
END_TEST

int main(void)
{
    return SUITE("number", NULL, NULL,
                 plain_numbers_read_as_strtod_reads_them,
                 halfway_cases_round_to_even,
                 random_numbers_read_as_strtod_reads_them,
                 quotients_by_large_powers_round_once,
                 doubles_printed_with_17_digits_come_back,
                 names_of_nan_and_infinity_are_known,
                 what_is_no_number_is_refused,
                 very_long_numbers_are_read_up_to_the_limit,
                 whole_numbers_are_told_from_others);
}
