/*
 * What a first picture reads: the head, and behind it all of cluster 0. Two reads that follow each
 * other, known after the first 512 bytes; everything else of the file may be missing.
 */
#include "layout.h"
#include "mesh_case.h"
#include "suite.h"

#include <stdlib.h>
#include <string.h>

enum { MIB = 1 << 20 };

static uint64_t first_picture(const struct spc_reader *r)
{
    const struct spc_header *h = spc_reader_header(r);
    struct spc_cluster root;
    spc_reader_cluster(r, 0, &root);
    const uint64_t head = (h->head_bytes + SPC_CHUNK_ALIGN - 1) / SPC_CHUNK_ALIGN * SPC_CHUNK_ALIGN;
    ck_assert_uint_eq(root.data_off, head);
    return head + root.data_bytes;
}

/* All blocks of cluster 0, and no other, lie one after another from the end of the head. */
static void check_contiguous(const struct spc_reader *r)
{
    const uint64_t end = first_picture(r);
    struct spc_cluster root;
    struct spc_block b;
    spc_reader_cluster(r, 0, &root);
    uint64_t at = root.data_off;
    ck_assert_uint_eq(root.block_first, 0);
    for (uint32_t k = 0; k < root.block_count; k++) {
        spc_reader_block(r, k, &b);
        ck_assert_uint_eq(b.cluster, 0);
        ck_assert_uint_eq(b.off, at);
        at += spc_block_chunk_bytes(&b);
    }
    ck_assert_uint_eq(at, end);
    ck_assert_uint_le(end, spc_reader_header(r)->file_bytes);
}

/* With zeros for what is not read yet, the archive opens and its root cluster decodes. */
static void check_enough(const struct spc_reader *r)
{
    struct spc_reader *partial = NULL;
    struct spc_cluster root;
    struct spc_error err = {0};
    uint64_t size;
    const uint8_t *bytes = spc_reader_bytes(r, &size);
    uint8_t *copy = calloc(1, (size_t)size);
    ck_assert_ptr_nonnull(copy);
    memcpy(copy, bytes, (size_t)first_picture(r));
    ck_assert_msg(spc_reader_open_memory(copy, (size_t)size, &partial, &err) == SPC_OK, "%s", err.what);
    spc_reader_cluster(partial, 0, &root);
    for (uint32_t k = 0; k < root.block_count; k++) {
        struct spc_block b;
        spc_reader_block(partial, k, &b);
        uint8_t *payload = aligned_alloc(16, b.raw_bytes);
        ck_assert_msg(spc_block_decode(partial, k, true, payload, &err) == SPC_OK, "%s", err.what);
        free(payload);
    }
    if (root.block_count < spc_reader_header(partial)->block_count) {
        struct spc_block b;
        spc_reader_block(partial, root.block_count, &b);
        uint8_t *payload = aligned_alloc(16, b.raw_bytes);
        ck_assert_int_ne(spc_block_decode(partial, root.block_count, true, payload, NULL), SPC_OK);
        free(payload);
    }
    spc_reader_close(partial);
    free(copy);
}

static void check_mesh(struct case_mesh mesh, uint32_t cluster_nodes, uint32_t clusters_min)
{
    struct spb_build_options o = case_options(case_write(&mesh, "scan.ply"), case_path("scan.spc"));
    o.cluster_nodes = cluster_nodes;
    struct spc_reader *r = case_build(&o);
    ck_assert_uint_ge(spc_reader_header(r)->cluster_count, clusters_min);
    check_contiguous(r);
    check_enough(r);
    spc_reader_close(r);
    case_mesh_free(&mesh);
}

START_TEST(a_first_picture_is_one_range_and_needs_nothing_else)
{
    check_mesh(case_soup(1, 1), 64, 1);
    check_mesh(case_soup(2000, 2), 32, 40);
    check_mesh(case_sheet(3000, 3), 64, 20);
    check_mesh(case_sphere(10000, 4), 700, 10);
    check_mesh(case_sphere(40000, 5), 2000, 10);
}
END_TEST

START_TEST(a_default_archive_gives_its_first_picture_from_a_mebibyte_or_a_hundredth)
{
    struct case_mesh mesh = case_sphere(300000, 6);
    struct spb_build_options o;
    case_color(&mesh);
    spb_build_defaults(&o);
    o.scan = case_write(&mesh, "scan.ply");
    o.out = case_path("scan.spc");
    struct spc_reader *r = case_build(&o);
    const uint64_t file = spc_reader_header(r)->file_bytes, first = first_picture(r);
    ck_assert_uint_ge(spc_reader_header(r)->leaf_count, 290000);
    ck_assert_uint_gt(file, MIB);
    ck_assert_uint_le(first, file / 100 > MIB ? file / 100 : MIB);
    check_contiguous(r);
    check_enough(r);
    spc_reader_close(r);
    case_mesh_free(&mesh);
}
END_TEST

int main(void)
{
    return SUITE("first_picture", case_start, case_finish,
                 a_first_picture_is_one_range_and_needs_nothing_else,
                 a_default_archive_gives_its_first_picture_from_a_mebibyte_or_a_hundredth);
}
