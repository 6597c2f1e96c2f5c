/* Distributing face records by place: nothing is lost, buffers stay within their memory. */
#include "distribute.h"
#include "suite.h"

#include <stdlib.h>
#include <string.h>

enum { RECORDS = 300000 };

static uint64_t random_next(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return *state >> 33;
}

/* Keys all over a cube: every cell of any grid gets some. */
static void distribute_volume(struct spb_distributor *d, struct spb_tmpfile *file, uint64_t memory)
{
    const struct spb_record_format format = spb_record_format(false, false);
    const double min[3] = {0, 0, 0}, max[3] = {1, 1, 1};
    uint8_t record[96] = {0};
    uint64_t state = 1;
    ck_assert_int_eq(spb_distributor_init(d, file, &format, min, max,
                                          spb_cells_within(SPB_CELLS_LOG2_MAX, memory), memory, NULL), SPC_OK);
    for (uint32_t i = 0; i < RECORDS; i++) {
        double key[1][4] = {{0}};
        uint32_t cell;
        for (int a = 0; a < 3; a++)
            key[0][a] = (double)random_next(&state) / 0x1p31;
        memcpy(record, &i, sizeof i);
        spb_distributor_cells(d, (const double(*)[4])key, 1, &cell);
        if (spb_distributor_add(d, cell, key[0], record, NULL) != SPC_OK)
            ck_abort_msg("record %u is not taken", i);
    }
}

static void release_all(struct spb_distributor *d)
{
    for (uint32_t i = 0; i < d->bucket_count; i++)
        spb_bucket_free(d->buckets[i]);
    spb_distributor_release(d);
}

START_TEST(buffers_stay_within_their_memory)
{
    for (int log2 = 20; log2 <= 30; log2 += 2) {
        struct spb_temp temp = {.folder = "/tmp"};
    struct spb_tmpfile *file;
        struct spb_distributor d;
        ck_assert_int_eq(spb_tmpfile_create(&temp, &file, NULL), SPC_OK);
        distribute_volume(&d, file, (uint64_t)1 << log2);
        ck_assert_uint_le((uint64_t)d.spill.page_max * (SPB_PAGE_BYTES + 4), (uint64_t)1 << log2);
        release_all(&d);
        spb_tmpfile_free(file);
    }
}
END_TEST

START_TEST(every_record_comes_back_once_and_in_order)
{
    struct spb_temp temp = {.folder = "/tmp"};
    struct spb_tmpfile *file;
    struct spb_distributor d;
    uint32_t total = 0;
    uint8_t *seen = calloc(RECORDS, 1);
    ck_assert_int_eq(spb_tmpfile_create(&temp, &file, NULL), SPC_OK);
    distribute_volume(&d, file, (uint64_t)1 << 25);
    ck_assert_int_eq(spb_distributor_flush(&d, NULL), SPC_OK);
    const uint32_t bytes = d.format.bytes;
    for (uint32_t k = 0; k < d.bucket_count; k++) {
        const uint64_t count = d.buckets[k]->pile.count;
        struct spb_pile_reader reader = {&d.buckets[k]->pile, file, 0, 0};
        uint8_t *records = malloc((size_t)count * bytes);
        uint32_t last = 0, number;
        ck_assert_int_eq(spb_pile_read(&reader, records, count * bytes, NULL), SPC_OK);
        for (uint64_t i = 0; i < count; i++, total++) {
            memcpy(&number, records + i * bytes, sizeof number);
            if (number >= RECORDS || seen[number]++ || (i > 0 && number <= last))
                ck_abort_msg("record %u of bucket %u is out of place", number, k);
            last = number;
        }
        free(records);
    }
    ck_assert_uint_eq(total, RECORDS);
    free(seen);
    release_all(&d);
    spb_tmpfile_free(file);
}
END_TEST

int main(void)
{
    return SUITE("distribute", NULL, NULL, buffers_stay_within_their_memory,
                 every_record_comes_back_once_and_in_order);
}
