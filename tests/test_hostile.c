/*
 * Archives made to deceive: each is changed in one way and then made to agree with itself again,
 * checksums and all, so that nothing but the rule in question can refuse it.
 */
#include "bytes.h"
#include "fuzz_seeds.h"
#include "layout.h"
#include "mesh_case.h"
#include "reseal.h"
#include "suite.h"

#include <stdlib.h>

enum { ALL = RESEAL_HASHES | RESEAL_CHUNKS | RESEAL_COUNTS };

static struct { uint8_t *bytes; size_t size; } a;

static void begin(uint32_t seed)
{
    free(a.bytes);
    a.bytes = fuzz_seed(seed, &a.size);
}

static uint8_t *record(int section, uint32_t i)
{
    uint64_t first = 0;
    const uint32_t n = reseal_records(a.bytes, a.size, section, &first);
    ck_assert_uint_lt(i, n);
    return a.bytes + first + (uint64_t)(section == SE_CLUS ? CL_SIZE : BL_SIZE) * i;
}

static enum spc_status open_status(void)
{
    struct spc_reader *r = NULL;
    a.size = reseal(a.bytes, a.size, ALL);
    const enum spc_status status = spc_reader_open_memory(a.bytes, a.size, &r, NULL);
    spc_reader_close(r);
    return status;
}

START_TEST(tops_of_invalid_codes_do_not_open)
{
    static const struct { int off, bytes; uint16_t value; } codes[] = {
        {ND_RADIUS, 2, 0xFFFF}, {ND_RADIUS, 2, SPC_LEN_ROOT}, {ND_E_SELF, 2, 0x0001},
        {ND_E_SELF, 2, SPC_LEN_MAX}, {ND_E_PARENT, 2, SPC_LEN_ROOT + 1}, {ND_NORMAL, 1, 0xFF},
    };
    for (size_t i = 0; i < sizeof codes / sizeof *codes; i++) {
        begin(2);
        uint8_t value[2];
        store_u16(value, codes[i].value);
        memcpy(record(SE_CLUS, 1) + CL_TOPS + TP_NODE + codes[i].off, value, (size_t)codes[i].bytes);
        ck_assert_int_eq(open_status(), SPC_CORRUPT);
    }
}
END_TEST

START_TEST(nodes_at_infinity_do_not_open)
{
    begin(2);
    store_u16(record(SE_CLUS, 1) + CL_TOPS + TP_STEP_EXP, SPC_EXP_MAX);
    ck_assert_int_eq(open_status(), SPC_CORRUPT);
    begin(2);
    store_u16(record(SE_BLKS, 1) + BL_STEP_EXP, SPC_EXP_MAX);
    ck_assert_int_eq(open_status(), SPC_CORRUPT);
}
END_TEST

static void finish(void)
{
    free(a.bytes);
    a.bytes = NULL;
    case_finish();
}

int main(void)
{
    return SUITE("hostile", case_start, finish, tops_of_invalid_codes_do_not_open,
                 nodes_at_infinity_do_not_open);
}
