/* What the head of a damaged archive still says: every part on its own. */
#include "bytes.h"
#include "layout.h"
#include "mesh_case.h"
#include "suite.h"

#include <stdlib.h>
#include <xxhash.h>

static uint8_t *archive(size_t *size)
{
    struct case_mesh m = case_sphere(1500, 2);
    spc_reader_close(case_archive(&m));
    case_mesh_free(&m);
    return case_slurp(case_path("scan.spc"), size);
}

/* What is there, in this order: header, directory, metadata. */
static void expect(const uint8_t *bytes, size_t size, const char *parts, enum spc_status fault)
{
    struct spc_remains m;
    ck_assert_int_eq(spc_remains_open_memory(bytes, size, &m, NULL), SPC_OK);
    const char found[] = {m.header ? 'h' : '-', m.directory ? 'd' : '-', m.meta ? 'm' : '-', 0};
    ck_assert_str_eq(found, parts);
    ck_assert_int_eq(m.fault.status, fault);
    spc_remains_close(&m);
}

static void expect_flipped(uint8_t *bytes, size_t size, uint64_t at, const char *parts,
                           enum spc_status fault)
{
    bytes[at] ^= 1;
    expect(bytes, size, parts, fault);
    bytes[at] ^= 1;
}

static uint64_t section(const uint8_t *bytes, int s)
{
    return load_u64(bytes + HD_SECTIONS + SE_SIZE * s + SE_OFF);
}

START_TEST(each_part_of_a_head_stands_for_itself)
{
    size_t size = 0;
    uint8_t *b = archive(&size);
    expect(b, size, "hdm", SPC_OK);
    expect_flipped(b, size, 1, "---", SPC_NOT_SPC);
    expect_flipped(b, size, HD_VERSION, "---", SPC_CHECKSUM);
    expect_flipped(b, size, HD_BOX + 3, "---", SPC_CHECKSUM);
    expect_flipped(b, size, section(b, SE_AXES), "hdm", SPC_CHECKSUM);
    expect_flipped(b, size, section(b, SE_CLUS) + 9, "h-m", SPC_CHECKSUM);
    expect_flipped(b, size, section(b, SE_BLKS) + BL_HASH, "h-m", SPC_CHECKSUM);
    expect_flipped(b, size, section(b, SE_META) + 1, "hd-", SPC_CHECKSUM);
    free(b);
}
END_TEST

START_TEST(a_cut_archive_keeps_the_parts_before_the_cut)
{
    size_t size = 0;
    uint8_t *b = archive(&size);
    const uint64_t blocks_end =
        section(b, SE_BLKS) + (uint64_t)BL_SIZE * load_u32(b + HD_BLOCK_COUNT);
    for (size_t cut = 0; cut < size; cut += cut < HD_SIZE + 8 ? 1 : 61) {
        uint8_t *exact = malloc(cut + !cut);    /* memory checkers see a step over its end */
        memcpy(exact, b, cut);
        expect(exact, cut, cut < HD_SIZE ? "---" : cut < blocks_end ? "h--"
                           : cut < load_u64(b + HD_HEAD_BYTES) ? "hd-" : "hdm",
               cut == 0 ? SPC_NOT_SPC : SPC_TRUNCATED);
        free(exact);
    }
    b = realloc(b, size + 64);
    memset(b + size, 0, 64);
    expect(b, size + 64, "hdm", SPC_CORRUPT);
    free(b);
}
END_TEST

START_TEST(a_version_that_is_not_known_is_no_damage)
{
    size_t size = 0;
    uint8_t *b = archive(&size);
    store_u16(b + HD_VERSION, 7);
    expect(b, size, "---", SPC_CHECKSUM);
    store_u64(b + HD_HASH, XXH64(b, HD_HASH, 0));
    expect(b, size, "---", SPC_VERSION);
    free(b);
}
END_TEST

int main(void)
{
    return SUITE("remains", case_start, case_finish, each_part_of_a_head_stands_for_itself,
                 a_cut_archive_keeps_the_parts_before_the_cut,
                 a_version_that_is_not_known_is_no_damage);
}
