/* Records in piles: each pile comes back whole and in order, in few extents, whatever the memory. */
#include "spill.h"
#include "suite.h"

#include <stdlib.h>

enum { PILES = 50, FEW = 200000, MANY = 2000000 };

struct fixture {
    struct spb_temp temp;
    struct spb_tmpfile *file;
    struct spb_spill spill;
    struct spb_pile piles[PILES];
    uint32_t records;
};

/* Record i goes to a pile at random; the first ones are larger. */
static uint32_t pile_of(uint32_t i)
{
    const uint32_t h = i * 2654435761u >> 8;
    return h % PILES * (h / PILES % 7 + 1) / 7;
}

static void fill(struct fixture *f, uint32_t records, uint64_t memory)
{
    *f = (struct fixture){.temp = {.folder = "/tmp"}, .records = records};
    ck_assert_int_eq(spb_tmpfile_create(&f->temp, &f->file, NULL), SPC_OK);
    ck_assert_int_eq(spb_spill_init(&f->spill, f->file, sizeof(uint32_t), memory, NULL), SPC_OK);
    for (int k = 0; k < PILES; k++)
        ck_assert_int_eq(spb_spill_pile(&f->spill, &f->piles[k], NULL), SPC_OK);
    for (uint32_t i = 0; i < records; i++)
        if (spb_spill_put(&f->spill, &f->piles[pile_of(i)], &i, NULL) != SPC_OK)
            ck_abort_msg("record %u is not taken", i);
    ck_assert_int_eq(spb_spill_settle(&f->spill, NULL), SPC_OK);
}

static void release(struct fixture *f)
{
    for (int k = 0; k < PILES; k++)
        spb_pile_release(&f->piles[k]);
    spb_tmpfile_free(f->file);
}

/* Records of pile k in the order they were put, and nothing behind them. */
static void check_pile(const struct fixture *f, uint32_t k)
{
    const uint64_t count = f->piles[k].count;
    struct spb_pile_reader reader = {&f->piles[k], f->file, 0, 0};
    uint32_t *records = malloc(count * sizeof *records + 1), n = 0;
    ck_assert_int_eq(spb_pile_read(&reader, records, count * sizeof *records, NULL), SPC_OK);
    for (uint32_t i = 0; i < f->records; i++)
        if (pile_of(i) == k && (n >= count || records[n++] != i))
            ck_abort_msg("record %u of pile %u is another one", i, k);
    ck_assert_uint_eq(n, count);
    ck_assert_int_eq(spb_pile_read(&reader, records, 1, NULL), SPC_INTERNAL);
    free(records);
}

START_TEST(piles_come_back_in_order)
{
    for (uint64_t memory = 1; memory <= (uint64_t)1 << 22; memory *= 64) {
        struct fixture f;
        fill(&f, FEW, memory);
        for (uint32_t k = 0; k < PILES; k++)
            check_pile(&f, k);
        release(&f);
    }
}
END_TEST

START_TEST(skipping_is_reading)
{
    struct fixture f;
    fill(&f, FEW, 1 << 18);
    for (uint64_t skip = 0; skip < f.piles[3].count; skip += 997) {
        struct spb_pile_reader by_skip = {&f.piles[3], f.file, 0, 0}, by_read = by_skip;
        uint32_t a = 0, b = 1, *passed = malloc((size_t)skip * 4 + 4);
        spb_pile_skip(&by_skip, skip * 4);
        ck_assert_int_eq(spb_pile_read(&by_read, passed, skip * 4, NULL), SPC_OK);
        ck_assert_int_eq(spb_pile_read(&by_skip, &a, 4, NULL), SPC_OK);
        ck_assert_int_eq(spb_pile_read(&by_read, &b, 4, NULL), SPC_OK);
        ck_assert_uint_eq(a, b);
        free(passed);
    }
    release(&f);
}
END_TEST

/* Longer than an even share of memory, because the fullest piles are written first. */
START_TEST(extents_are_as_long_as_memory_allows)
{
    struct fixture f;
    uint32_t extents = 0;
    fill(&f, MANY, 1 << 20);
    for (int k = 0; k < PILES; k++)
        extents += f.piles[k].extent_count;
    ck_assert_uint_le(extents, MANY * 4 / ((1 << 20) / PILES));
    release(&f);
}
END_TEST

START_TEST(discarded_space_is_not_needed_again)
{
    struct fixture f;
    fill(&f, FEW, 1 << 18);
    spb_pile_discard(&f.piles[0], f.file);
    check_pile(&f, 1);
    release(&f);
}
END_TEST

int main(void)
{
    return SUITE("spill", NULL, NULL, piles_come_back_in_order, skipping_is_reading,
                 extents_are_as_long_as_memory_allows, discarded_space_is_not_needed_again);
}
