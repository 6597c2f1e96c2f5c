/*
 * Files past 2^31 and 2^32 bytes. Disks need not hold them: scans have holes, and the pwrite below,
 * in the place of libc's, writes only the ends of long runs of zeros.
 */
#define _GNU_SOURCE                 /* pwritev, under the name that tmpfile.c calls it by */
#include "distribute.h"
#include "scan_case.h"

#include <fcntl.h>
#include <time.h>

enum { ENDS = 4096 };

static ssize_t write_at(int fd, const void *bytes, size_t n, off_t off)
{
    return lseek(fd, off, SEEK_SET) < 0 ? -1 : write(fd, bytes, n);
}

ssize_t pwrite(int fd, const void *bytes, size_t n, off_t off)
{
    const size_t most = 0x7ffff000;     /* a call of Linux moves no more */
    const size_t part = n > most ? most : n;
    if (part <= 2 * ENDS)
        return write_at(fd, bytes, part, off);
    if (write_at(fd, bytes, ENDS, off) != ENDS ||
        write_at(fd, (const uint8_t *)bytes + part - ENDS, ENDS, off + (off_t)(part - ENDS)) != ENDS)
        return -1;
    return (ssize_t)part;
}

ssize_t pwritev(int fd, const struct iovec *parts, int count, off_t off)
{
    return count > 0 ? pwrite(fd, parts[0].iov_base, parts[0].iov_len, off) : 0;
}

/* ---- temporary files --------------------------------------------------------------------------- */

static void fill(uint8_t bytes[ENDS], uint32_t seed)
{
    for (uint32_t i = 0; i < ENDS; i++)
        bytes[i] = (uint8_t)((i + seed) * 2654435761u >> 24);
}

START_TEST(a_temporary_file_of_six_gigabytes_gives_back_what_it_got)
{
    const size_t long_bytes = (size_t)3 << 30;
    uint8_t *const zeros = calloc(long_bytes, 1);   /* never touched: takes no memory */
    struct spb_temp temp = {.folder = scan_folder};
    struct spb_tmpfile *file;
    uint8_t bytes[ENDS], again[ENDS];
    uint64_t off[3], skipped = 0;
    ck_assert_ptr_nonnull(zeros);
    ck_assert_int_eq(spb_tmpfile_create(&temp, &file, NULL), SPC_OK);
    for (uint32_t k = 0; k < 3; k++) {
        fill(bytes, k);
        ck_assert_int_eq(spb_tmpfile_append(file, bytes, ENDS, &off[k], NULL), SPC_OK);
        ck_assert_uint_eq(off[k], k * (ENDS + (uint64_t)long_bytes));
        if (k < 2)
            ck_assert_int_eq(spb_tmpfile_append(file, zeros, long_bytes, &skipped, NULL), SPC_OK);
    }
    ck_assert_uint_gt(off[1], (uint64_t)1 << 31);
    ck_assert_uint_gt(off[2], (uint64_t)1 << 32);
    for (uint32_t k = 0; k < 3; k++) {
        fill(bytes, k);
        ck_assert_int_eq(spb_tmpfile_read(file, off[k], again, ENDS, NULL), SPC_OK);
        ck_assert_mem_eq(bytes, again, ENDS);
    }
    ck_assert_uint_eq(temp.written, off[2] + ENDS);
    spb_tmpfile_free(file);
    free(zeros);
}
END_TEST

START_TEST(buckets_that_begin_behind_four_gigabytes_are_read_rightly)
{
    const struct spb_record_format format = spb_record_format(false, false);
    const double min[3] = {0, 0, 0}, max[3] = {1, 1, 1}, key[3] = {0.5, 0.5, 0.5};
    const size_t long_bytes = ((size_t)1 << 32) - 20000;    /* the bucket lies across the border */
    const uint32_t count = 10000;
    uint8_t *const zeros = calloc(long_bytes, 1), *records = calloc(count, format.bytes);
    struct spb_temp temp = {.folder = scan_folder};
    struct spb_tmpfile *file;
    struct spb_distributor d;
    uint8_t record[96] = {0};
    uint64_t off;
    ck_assert_int_eq(spb_tmpfile_create(&temp, &file, NULL), SPC_OK);
    ck_assert_int_eq(spb_tmpfile_append(file, zeros, long_bytes, &off, NULL), SPC_OK);
    ck_assert_int_eq(spb_distributor_init(&d, file, &format, min, max, 0, 1 << 20, NULL), SPC_OK);
    for (uint32_t i = 0; i < count; i++) {
        memcpy(record, &i, sizeof i);
        SCAN_CHECK(spb_distributor_add(&d, 0, key, record, NULL) == SPC_OK);
    }
    ck_assert_int_eq(spb_distributor_flush(&d, NULL), SPC_OK);
    ck_assert_uint_eq(d.bucket_count, 1);
    struct spb_pile_reader reader = {&d.buckets[0]->pile, file, 0, 0};
    ck_assert_int_eq(spb_pile_read(&reader, records, (uint64_t)count * format.bytes, NULL), SPC_OK);
    for (uint32_t i = 0; i < count; i++)
        SCAN_CHECK(memcmp(records + (size_t)i * format.bytes, &i, sizeof i) == 0);
    spb_bucket_free(d.buckets[0]);
    spb_distributor_release(&d);
    spb_tmpfile_free(file);
    free(records);
    free(zeros);
}
END_TEST

/* ---- scans ------------------------------------------------------------------------------------- */

/*
 * A tetrahedron behind an element that nobody wants, of rows * 8 bytes that are a hole; cut: the
 * file ends inside the last face.
 */
static void write_holey(uint64_t rows, bool cut)
{
    struct file_text head = {0}, tail = {0};
    put(&head, "ply\nformat binary_little_endian 1.0\nelement sample %llu\nproperty double t\n"
        "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 4\nproperty list uchar uint vertex_indices\nend_header\n",
        (unsigned long long)rows);
    for (int v = 0; v < 4; v++)
        for (int a = 0; a < 3; a++)
            put_real(&tail, 4, v == a + 1 ? 1 : 0);
    for (uint32_t f = 0; f < 4; f++) {
        put_int(&tail, 1, 3);
        for (uint32_t k = 0, v = 0; k < 3; k++, v++) {
            v += v == f;
            put_int(&tail, 4, f == 3 && k == 2 ? 0xFFFFFFFE : v);
        }
    }
    scan_write(head.data, head.bytes);
    const int fd = open(scan_path, O_WRONLY | O_CLOEXEC);
    const off_t off = (off_t)(head.bytes + rows * 8);
    const size_t bytes = tail.bytes - (cut ? 3 : 0);
    ck_assert_int_eq(pwrite(fd, tail.data, bytes, off), (ssize_t)bytes);
    close(fd);
    free(head.data);
    free(tail.data);
}

static struct spb_source *open_holey(uint64_t rows, bool cut, struct spc_error *err)
{
    struct spb_source *source = NULL;
    write_holey(rows, cut);
    spb_source_open(scan_path, NULL, &source, err);
    return source;
}

static const uint64_t row_counts[] = {(uint64_t)1 << 28, ((uint64_t)1 << 29) - 5, ((uint64_t)1 << 29) + 1,
                                      ((uint64_t)1 << 32) + 7};

START_TEST(vertices_and_faces_behind_a_large_element_are_found)
{
    for (size_t i = 0; i < sizeof row_counts / sizeof *row_counts; i++) {
        struct spc_error err = {0};
        struct spb_source *source = open_holey(row_counts[i], false, &err);
        ck_assert_msg(source != NULL, "%s", err.what);
        for (int pass = 0; pass < 2; pass++) {
            ck_assert_int_eq(spb_source_begin_faces(source, NULL), SPC_OK);
            ck_assert_int_eq(spb_source_faces(source, &scan_faces, NULL), SPC_OK);
            ck_assert_uint_eq(scan_faces.count, 4);
            ck_assert_uint_eq(scan_faces.corner[0][0], 1);
            ck_assert_uint_eq(scan_faces.corner[3][2], 0xFFFFFFFE);
            ck_assert_int_eq(spb_source_begin_vertices(source, NULL), SPC_OK);
            ck_assert_int_eq(spb_source_vertices(source, &scan_vertices, NULL), SPC_OK);
            ck_assert_uint_eq(scan_vertices.count, 4);
            ck_assert_double_eq(scan_vertices.xyz[3][2], 1);
            ck_assert_double_eq(scan_vertices.xyz[3][0], 0);
        }
        spb_source_close(source);
    }
}
END_TEST

START_TEST(where_a_large_scan_ends_too_early_is_told_with_all_digits)
{
    const uint64_t rows = ((uint64_t)1 << 29) + 1;
    struct spc_error err = {0};
    struct spb_source *source = open_holey(rows, true, &err);
    ck_assert_msg(source != NULL, "%s", err.what);
    ck_assert_int_eq(spb_source_begin_faces(source, NULL), SPC_OK);
    ck_assert_int_eq(spb_source_faces(source, &scan_faces, &err), SPC_INPUT_TRUNCATED);
    ck_assert_uint_gt(err.at_off, rows * 8);
    ck_assert_uint_lt(err.at_off, rows * 8 + 1000);
    spb_source_close(source);
}
END_TEST

/* ---- counts ------------------------------------------------------------------------------------ */

/* Nothing is read and no memory taken for counts that the file cannot hold. */
START_TEST(counts_past_32_bits_in_a_small_file_are_refused_at_once)
{
    static const char *const counts[] = {"2147483647", "2147483648", "4294967295", "4294967296", "4294967297",
                                         "9223372036854775807", "9223372036854775808", "18446744073709551615",
                                         "18446744073709551616", "99999999999999999999999"};
    static const char *const formats[] = {"ascii", "binary_little_endian", "binary_big_endian"};
    static const char *const elements[] = {"vertex", "face", "sample"};
    const clock_t began = clock();
    for (size_t c = 0; c < sizeof counts / sizeof *counts; c++)
        for (int f = 0; f < 3; f++)
            for (int e = 0; e < 3; e++) {
                struct file_text t = {0};
                struct spb_source *source = NULL;
                struct spc_error err = {0};
                put(&t, "ply\nformat %s 1.0\n", formats[f]);
                put(&t, "element sample %s\nproperty double t\n", e == 2 ? counts[c] : "0");
                put(&t, "element vertex %s\nproperty float x\nproperty float y\nproperty float z\n",
                    e == 0 ? counts[c] : "3");
                put(&t, "element face %s\nproperty list uchar int vertex_indices\nend_header\n",
                    e == 1 ? counts[c] : "1");
                put(&t, "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n0123456789012345678901234567890123456789");
                scan_write(t.data, t.bytes);
                free(t.data);
                const enum spc_status status = spb_source_open(scan_path, NULL, &source, &err);
                ck_assert_msg(status == SPC_INPUT_TRUNCATED || status == SPC_INPUT_FORMAT, "%s %s %s: %d",
                              formats[f], elements[e], counts[c], (int)status);
                ck_assert_ptr_null(source);
                ck_assert_msg(strstr(err.what, elements[e]) != NULL || strstr(err.what, counts[c]) != NULL,
                              "'%s'", err.what);
            }
    ck_assert_double_lt((double)(clock() - began) / CLOCKS_PER_SEC, 2.0);
}
END_TEST

int main(void)
{
    return SUITE("large", scan_start, scan_finish, a_temporary_file_of_six_gigabytes_gives_back_what_it_got,
                 buckets_that_begin_behind_four_gigabytes_are_read_rightly,
                 vertices_and_faces_behind_a_large_element_are_found,
                 where_a_large_scan_ends_too_early_is_told_with_all_digits,
                 counts_past_32_bits_in_a_small_file_are_refused_at_once);
}
