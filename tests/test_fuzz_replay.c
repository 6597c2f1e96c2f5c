/*
 * The targets of tests/fuzz/ over inputs that are made here: archives, every cut of one, every
 * changed bit of its structure, and random changes with and without checksums put right.
 *
 * The first line of a failure names the input. Under a sanitizer that takes
 * ASAN_OPTIONS=handle_abort=0:abort_on_error=1. FUZZ_REPLAYS=n sets the number of random changes.
 */
#include "bytes.h"
#include "fuzz.h"
#include "fuzz_seeds.h"
#include "layout.h"
#include "mesh_case.h"
#include "mutate.h"
#include "reseal.h"
#include "suite.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static char input[200];             /* what is running, for the handler */

static void name_input(int sig)
{
    (void)!write(STDOUT_FILENO, input, strlen(input));
    signal(sig, SIG_DFL);
    raise(sig);
}

static void start(void)
{
    case_start();
    signal(SIGABRT, name_input);
    signal(SIGSEGV, name_input);
}

/* Every target on a block of just this size. */
static void run(const uint8_t *bytes, size_t size, const char *what, uint64_t number)
{
    uint8_t *copy = malloc(size);
    memcpy(copy, bytes, size);
    snprintf(input, sizeof input, "input: %s %llu, %zu bytes\n", what, (unsigned long long)number,
             size);
    fuzz_open(copy, size);
    fuzz_decode(copy, size);
    fuzz_verify(copy, size);
    free(copy);
}

START_TEST(archives_pass_every_target)
{
    bool widths[9] = {false};
    for (uint32_t k = 0; k < FUZZ_SEEDS; k++) {
        size_t size = 0;
        uint8_t *bytes = fuzz_seed(k, &size);
        struct spc_reader *r = NULL;
        ck_assert_uint_lt(size, 65536);
        ck_assert_int_eq(spc_reader_open_memory(bytes, size, &r, NULL), SPC_OK);
        case_verify(r);
        for (uint32_t i = 0; i < spc_reader_header(r)->block_count; i++) {
            struct spc_block b;
            spc_reader_block(r, i, &b);
            widths[b.vertex_width] = true;
        }
        spc_reader_close(r);
        run(bytes, size, "seed", k);
        free(bytes);
    }
    ck_assert_msg(widths[0] && widths[2] && widths[4] && widths[8], "a width has no seed");
}
END_TEST

/* Resealing what is whole changes nothing, or no change would reach what lies behind the seals. */
START_TEST(archives_stay_as_they_are_when_resealed)
{
    for (uint32_t k = 0; k < FUZZ_SEEDS; k++) {
        size_t size = 0;
        uint8_t *bytes = fuzz_seed(k, &size);
        uint8_t *copy = malloc(size);
        memcpy(copy, bytes, size);
        ck_assert_uint_eq(reseal(copy, size, RESEAL_HASHES | RESEAL_CHUNKS | RESEAL_COUNTS), size);
        ck_assert_int_eq(memcmp(bytes, copy, size), 0);
        free(copy);
        free(bytes);
    }
}
END_TEST

START_TEST(every_prefix_passes_every_target)
{
    size_t size = 0;
    uint8_t *bytes = fuzz_seed(0, &size);
    uint8_t *copy = malloc(size);
    for (size_t n = 0; n < size; n++) {
        run(bytes, n, "prefix", n);
        memcpy(copy, bytes, n);
        run(copy, reseal(copy, n, RESEAL_HASHES | RESEAL_COUNTS), "resealed prefix", n);
    }
    free(copy);
    free(bytes);
}
END_TEST

static const unsigned SEALS[] = {
    0, RESEAL_HASHES, RESEAL_HASHES | RESEAL_CHUNKS, RESEAL_HASHES | RESEAL_CHUNKS | RESEAL_COUNTS,
};
enum { SEALS_COUNT = sizeof SEALS / sizeof *SEALS };

/* [begin, end) of bytes[size], one bit at a time, resealed in the ways from first to last. */
static void flip_range(const uint8_t *bytes, size_t size, uint64_t begin, uint64_t end, int first,
                       int last)
{
    uint8_t *copy = malloc(size);
    for (uint64_t bit = 8 * begin; bit < 8 * end; bit++)
        for (int s = first; s <= last; s++) {
            memcpy(copy, bytes, size);
            copy[bit / 8] ^= (uint8_t)(1 << bit % 8);
            run(copy, reseal(copy, size, SEALS[s]), s ? "resealed bit" : "bit", bit);
        }
    free(copy);
}

START_TEST(every_bit_of_the_structure_passes_every_target)
{
    size_t size = 0;
    uint64_t first = 0;
    uint8_t *bytes = fuzz_seed(0, &size);
    const uint8_t *meta = bytes + HD_SECTIONS + SE_SIZE * SE_META;
    flip_range(bytes, size, 0, load_u64(meta + SE_OFF), 0, SEALS_COUNT - 1);
    const uint32_t blocks = reseal_records(bytes, size, SE_BLKS, &first);
    ck_assert_uint_gt(blocks, 1);
    for (uint32_t k = 0; k < blocks; k++) {
        const uint64_t off = load_u64(bytes + first + (uint64_t)BL_SIZE * k + BL_OFF);
        flip_range(bytes, size, off, off + CH_SIZE, 0, SEALS_COUNT - 1);
    }
    free(bytes);
}
END_TEST

/* What a codec makes of it, and of payloads that end early. */
START_TEST(every_bit_of_a_compressed_payload_passes_every_target)
{
    size_t size = 0;
    uint64_t first = 0;
    uint8_t *bytes = fuzz_seed(1, &size);
    const uint32_t blocks = reseal_records(bytes, size, SE_BLKS, &first);
    flip_range(bytes, size, first, first + (uint64_t)BL_SIZE * blocks, 1, SEALS_COUNT - 1);
    for (uint32_t k = 0; k < blocks; k++) {
        const uint8_t *record = bytes + first + (uint64_t)BL_SIZE * k;
        const uint64_t off = load_u64(record + BL_OFF) + CH_SIZE;
        ck_assert_uint_eq(record[BL_CODEC], SPC_CODEC_ZSTD);
        flip_range(bytes, size, off, off + load_u32(record + BL_STORED_BYTES), 1, 1);
    }
    free(bytes);
}
END_TEST

START_TEST(random_changes_pass_every_target)
{
    const char *count = getenv("FUZZ_REPLAYS");
    const uint64_t total = count ? strtoull(count, NULL, 10) : 6000;
    uint64_t opened = 0;
    for (uint32_t k = 0; k < FUZZ_SEEDS; k++) {
        size_t size = 0;
        uint8_t *bytes = fuzz_seed(k, &size);
        uint8_t *copy = malloc(size);
        for (uint64_t i = k; i < total; i += FUZZ_SEEDS) {
            uint64_t random = i;
            struct spc_reader *r = NULL;
            memcpy(copy, bytes, size);
            const size_t n = mutate_and_reseal(copy, size, &random);
            run(copy, n, "random change", i);
            opened += spc_reader_open_memory(copy, n, &r, NULL) == SPC_OK;
            spc_reader_close(r);
        }
        free(copy);
        free(bytes);
    }
    printf("%llu of %llu changed archives opened\n", (unsigned long long)opened,
           (unsigned long long)total);
    ck_assert_msg(opened >= total / 8, "changes are stopped at the door: %llu of %llu opened",
                  (unsigned long long)opened, (unsigned long long)total);
}
END_TEST

int main(void)
{
    return SUITE("fuzz_replay", start, case_finish, archives_pass_every_target,
                 archives_stay_as_they_are_when_resealed, every_prefix_passes_every_target,
                 every_bit_of_the_structure_passes_every_target,
                 every_bit_of_a_compressed_payload_passes_every_target,
                 random_changes_pass_every_target);
}
