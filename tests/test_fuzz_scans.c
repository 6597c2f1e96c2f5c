/*
 * The scan targets of tests/fuzz/ over inputs that are made here: every seed, every cut of one,
 * every byte changed, and random changes. The first line of a failure names the input, as in
 * test_fuzz_replay.c. FUZZ_REPLAYS=n sets the number of random changes.
 */
#include "fuzz.h"
#include "mutate.h"
#include "scan_seeds.h"

#include <signal.h>

static int (*const targets[SCAN_FORMATS])(const uint8_t *, size_t) = {
    fuzz_ply, fuzz_stl, fuzz_off, fuzz_obj
};

static char input[200];             /* what is running, for the handler */

static void name_input(int sig)
{
    (void)!write(STDOUT_FILENO, input, strlen(input));
    signal(sig, SIG_DFL);
    raise(sig);
}

static void start(void)
{
    scan_start();
    signal(SIGABRT, name_input);
    signal(SIGSEGV, name_input);
}

static void run(int format, uint32_t seed, const uint8_t *bytes, size_t size, const char *what,
                uint64_t number)
{
    uint8_t *const copy = malloc(size ? size : 1);      /* just this size, for sanitizers */
    memcpy(copy, bytes, size);
    snprintf(input, sizeof input, "input: %s seed %u, %s %llu, %zu bytes\n",
             scan_seed_names[format], seed, what, (unsigned long long)number, size);
    targets[format](copy, size);
    free(copy);
}

/* f is format's seed k, until there are no more. */
#define FOR_EACH_SEED(format, k, f)                         \
    for (int format = 0; format < SCAN_FORMATS; format++)   \
        for (uint32_t k = 0; scan_seed(format, k, &f); free(f.data), k++)

START_TEST(seeds_are_read_and_pass)
{
    struct file_text f;
    FOR_EACH_SEED(format, k, f) {
        struct scan s;
        scan_read_bytes(f.data, f.bytes, &s);
        ck_assert_msg(s.status == SPC_OK, "%s seed %u: %s", scan_seed_names[format], k,
                      s.err.what);
        ck_assert_int_eq(strncmp(s.info.format, scan_seed_names[format], 3), 0);
        ck_assert_uint_gt(s.vertex_count, 0);
        scan_free(&s);
        run(format, k, f.data, f.bytes, "whole", 0);
    }
}
END_TEST

START_TEST(every_prefix_passes)
{
    struct file_text f;
    FOR_EACH_SEED(format, k, f)
        for (size_t n = 0; n < f.bytes; n++)
            run(format, k, f.data, n, "prefix", n);
}
END_TEST

START_TEST(every_changed_byte_passes)
{
    static const uint8_t changes[] = { 0x01, 0x10, 0x80, 0xff };
    struct file_text f;
    FOR_EACH_SEED(format, k, f)
        for (size_t i = 0; i < f.bytes; i++)
            for (size_t c = 0; c < sizeof changes; c++) {
                f.data[i] ^= changes[c];
                run(format, k, f.data, f.bytes, "byte", 4 * i + c);
                f.data[i] ^= changes[c];
            }
}
END_TEST

/* Changes one place: a byte, a digit, a piece cut out or put in once more. */
static void change(struct file_text *f, uint64_t *random)
{
    const uint64_t r = mutate_random(random);
    const size_t at = f->bytes ? (size_t)(r >> 16) % f->bytes : 0;
    const size_t piece = f->bytes ? 1 + (size_t)(r >> 8) % 32 % (f->bytes - at) : 0;
    uint8_t copy[32];

    if (piece == 0)
        return;
    switch (r % 4) {
    case 0: f->data[at] = (uint8_t)(r >> 40); break;
    case 1: f->data[at] = (uint8_t)('0' + (r >> 40) % 10); break;
    case 2:
        memmove(f->data + at, f->data + at + piece, f->bytes - at - piece);
        f->bytes -= piece;
        break;
    default:
        memcpy(copy, f->data + at, piece);
        put_bytes(f, copy, piece);
        memmove(f->data + at + piece, f->data + at, f->bytes - piece - at);
        memcpy(f->data + at, copy, piece);
        break;
    }
}

START_TEST(random_changes_pass)
{
    const char *const count = getenv("FUZZ_REPLAYS");
    const uint64_t total = count ? strtoull(count, NULL, 10) : 1000;
    struct file_text f;
    FOR_EACH_SEED(format, k, f)
        for (uint64_t i = 0; i < total; i++) {
            struct file_text copy = { .big = false };
            uint64_t random = i + 1000003 * k;
            put_bytes(&copy, f.data, f.bytes);
            for (uint64_t n = 1 + i % 4; n > 0; n--)
                change(&copy, &random);
            run(format, k, copy.data, copy.bytes, "random change", i);
            free(copy.data);
        }
}
END_TEST

int main(void)
{
    return SUITE("fuzz_scans", start, scan_finish, seeds_are_read_and_pass, every_prefix_passes,
                 every_changed_byte_passes, random_changes_pass);
}
