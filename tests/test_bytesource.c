/*
 * The pread below takes the place of libc's in this program, so that reads can be interrupted, cut
 * short and failed; it is made of lseek and read.
 */
#include "bytesource.h"

#include <errno.h>
#include <sys/stat.h>

#include "scan_case.h"

static struct {
    size_t most;                        /* bytes a read gives at most; 0: no limit */
    int interrupt_every;                /* 0: never */
    int fail_at;                        /* number of the read that fails; 0: none */
    int shrink_at;                      /* number of the read from which on the file has ended */
    int calls;
} fault;

ssize_t pread(int fd, void *buf, size_t bytes, off_t off)
{
    fault.calls++;
    if (fault.interrupt_every && fault.calls % fault.interrupt_every == 0) {
        errno = EINTR;
        return -1;
    }
    if (fault.fail_at && fault.calls == fault.fail_at) {
        errno = EIO;
        return -1;
    }
    if (fault.shrink_at && fault.calls >= fault.shrink_at)
        return 0;
    if (fault.most && bytes > fault.most)
        bytes = fault.most;
    if (lseek(fd, off, SEEK_SET) < 0)
        return -1;
    return read(fd, buf, bytes);
}

static uint8_t byte_at(size_t off)
{
    return (uint8_t)(off * 31 + (off >> 8) * 7 + 1);
}

/* Both writers of files also end all faults: with CK_FORK=no tests share this process. */

static void write_pattern(size_t bytes)
{
    memset(&fault, 0, sizeof fault);
    uint8_t *const data = malloc(bytes + 1);
    for (size_t i = 0; i < bytes; i++)
        data[i] = byte_at(i);
    scan_write(data, bytes);
    free(data);
}

/* Walks through the file in steps and compares every byte. */
static void walk(size_t file_bytes, size_t step)
{
    struct spb_bytes b;
    size_t off = 0;

    ck_assert_int_eq(spb_bytes_open(&b, scan_path, NULL, NULL, NULL), SPC_OK);
    ck_assert_uint_eq(b.file_bytes, file_bytes);
    while (off < file_bytes) {
        const size_t want = file_bytes - off < step ? file_bytes - off : step;
        SCAN_CHECK(spb_bytes_need(&b, step, NULL) == SPC_OK);
        SCAN_CHECK(spb_bytes_have(&b) >= want);
        SCAN_CHECK(spb_bytes_off(&b) == off);
        SCAN_CHECK(spb_bytes_rest(&b) == file_bytes - off);
        SCAN_CHECK(b.buf[b.end] == 0);
        for (size_t i = 0; i < want; i++)
            SCAN_CHECK(b.buf[b.pos + i] == byte_at(off + i));
        spb_bytes_skip(&b, want);
        off += want;
    }
    ck_assert_int_eq(spb_bytes_need(&b, 1, NULL), SPC_OK);
    ck_assert_uint_eq(spb_bytes_have(&b), 0);
    ck_assert(spb_bytes_last(&b));
    spb_bytes_close(&b);
}

START_TEST(every_byte_comes_in_order_whatever_the_step)
{
    static const size_t steps[] = { 1, 13, 4096, 100000, SPB_BYTES_WINDOW };
    write_pattern(700001);
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++)
        walk(700001, steps[i]);
    write_pattern(0);
    walk(0, 1);
    write_pattern(SPB_BYTES_WINDOW);
    walk(SPB_BYTES_WINDOW, SPB_BYTES_WINDOW);
}
END_TEST

START_TEST(interrupted_and_short_reads_are_continued)
{
    write_pattern(300007);
    fault.interrupt_every = 3;
    fault.most = 777;
    walk(300007, 5000);
    ck_assert_int_gt(fault.calls, 300);
}
END_TEST

START_TEST(seeks_go_anywhere)
{
    static const size_t offs[] = { 600000, 0, 5, 599999, 300000, 300010, 299990, 700000, 700001 };
    struct spb_bytes b;

    write_pattern(700001);
    ck_assert_int_eq(spb_bytes_open(&b, scan_path, NULL, NULL, NULL), SPC_OK);
    for (size_t i = 0; i < sizeof offs / sizeof *offs; i++) {
        spb_bytes_seek(&b, offs[i]);
        ck_assert_int_eq(spb_bytes_need(&b, 1, NULL), SPC_OK);
        ck_assert_uint_eq(spb_bytes_off(&b), offs[i]);
        if (offs[i] < 700001)
            ck_assert_uint_eq(b.buf[b.pos], byte_at(offs[i]));
        else
            ck_assert_uint_eq(spb_bytes_have(&b), 0);
    }
    spb_bytes_seek(&b, UINT64_C(1) << 62);
    ck_assert_uint_eq(spb_bytes_rest(&b), 0);
    ck_assert_int_eq(spb_bytes_need(&b, 10, NULL), SPC_OK);
    ck_assert_uint_eq(spb_bytes_have(&b), 0);
    spb_bytes_seek(&b, 3);
    spb_bytes_skip(&b, 500000);
    ck_assert_int_eq(spb_bytes_need(&b, 1, NULL), SPC_OK);
    ck_assert_uint_eq(b.buf[b.pos], byte_at(500003));
    spb_bytes_close(&b);
    spb_bytes_close(&b);
    spb_bytes_close(NULL);
}
END_TEST

START_TEST(a_failed_read_names_errno_and_byte)
{
    struct spb_bytes b;
    struct spc_error err = { 0 };

    write_pattern(600000);
    fault.fail_at = 2;
    ck_assert_int_eq(spb_bytes_open(&b, scan_path, NULL, NULL, &err), SPC_OK);
    ck_assert_int_eq(spb_bytes_need(&b, 1, &err), SPC_OK);
    spb_bytes_skip(&b, spb_bytes_have(&b));
    ck_assert_int_eq(spb_bytes_need(&b, 1, &err), SPC_IO);
    ck_assert_int_eq(err.os_errno, EIO);
    ck_assert_ptr_nonnull(strstr(err.what, "262144"));
    spb_bytes_close(&b);
}
END_TEST

START_TEST(a_file_cut_short_while_it_is_read_just_ends)
{
    struct spb_bytes b;

    write_pattern(600000);
    fault.shrink_at = 2;
    ck_assert_int_eq(spb_bytes_open(&b, scan_path, NULL, NULL, NULL), SPC_OK);
    ck_assert_int_eq(spb_bytes_need(&b, 1, NULL), SPC_OK);
    spb_bytes_skip(&b, SPB_BYTES_WINDOW - 4);
    ck_assert_int_eq(spb_bytes_need(&b, 100, NULL), SPC_OK);
    ck_assert_uint_eq(spb_bytes_have(&b), 4);
    ck_assert(spb_bytes_last(&b));
    ck_assert_uint_eq(b.file_bytes, SPB_BYTES_WINDOW);
    spb_bytes_close(&b);
}
END_TEST

START_TEST(only_regular_files_are_opened)
{
    struct spb_bytes b;
    struct spc_error err = { 0 };

    ck_assert_int_eq(spb_bytes_open(&b, scan_folder, NULL, NULL, &err), SPC_INPUT_FORMAT);
    ck_assert_ptr_nonnull(strstr(err.what, "directory"));
    ck_assert_int_eq(b.fd, -1);
    err = (struct spc_error){ 0 };
    ck_assert_int_eq(mkfifo(scan_path, 0600), 0);
    ck_assert_int_eq(spb_bytes_open(&b, scan_path, NULL, NULL, &err), SPC_INPUT_FORMAT);    /* and at once */
    ck_assert_ptr_nonnull(strstr(err.what, "pipe"));
    ck_assert_int_eq(unlink(scan_path), 0);
    err = (struct spc_error){ 0 };
    ck_assert_int_eq(spb_bytes_open(&b, scan_path, NULL, NULL, &err), SPC_IO);
    ck_assert_int_eq(err.os_errno, ENOENT);
}
END_TEST

/* A scan of several windows, in text or not, with an element to walk over between its two. */
static void write_scan(bool ascii)
{
    struct file_text f = { .big = false };
    const int count = 30000;

    memset(&fault, 0, sizeof fault);
    put(&f, "ply\nformat %s 1.0\nelement face %d\nproperty list uchar int vertex_indices\n"
        "element edge %d\nproperty list uchar short v\nelement vertex %d\nproperty float x\n"
        "property float y\nproperty float z\nend_header\n",
        ascii ? "ascii" : "binary_little_endian", count, count, count);
    for (int i = 0; i < count * 3; i++) {
        if (ascii && i / count < 2)
            put(&f, "3 %d %d %d\n", i % count, i / 3, i / 4);
        else if (ascii)
            put(&f, "%d 0.25 -%d\n", i, i / 2);
        for (int k = 0; k < 3 && !ascii; k++) {
            if (i / count < 2 && k == 0)
                put_int(&f, 1, 3);
            if (i / count == 1)
                put_int(&f, 2, i % 7);
            else
                put_int(&f, 4, i % count / (k + 1));
        }
    }
    scan_write(f.data, f.bytes);
    free(f.data);
}

START_TEST(each_read_of_a_scan_may_fail_or_find_the_end)
{
    int failed = 0, ended = 0;

    scan_once = true;                           /* or the second reading would fail too */
    for (int ascii = 0; ascii < 2; ascii++) {
        write_scan(ascii);
        for (int n = 1;; n++) {
            struct scan s;
            memset(&fault, 0, sizeof fault);
            fault.fail_at = n;
            scan_read_path(scan_path, &s);
            const bool whole = s.status == SPC_OK;
            if (!whole) {
                failed++;
                scan_expect_failure(&s, SPC_IO, "read failed at byte");
                ck_assert_int_eq(s.err.os_errno, EIO);
            }
            scan_free(&s);
            if (whole)
                break;
            memset(&fault, 0, sizeof fault);
            fault.shrink_at = n;
            scan_read_path(scan_path, &s);
            ended += s.status == SPC_INPUT_TRUNCATED || s.status == SPC_INPUT_FORMAT;
            scan_free(&s);
        }
    }
    ck_assert_int_gt(failed, 12);
    ck_assert_int_eq(ended, failed);
    scan_once = false;
}
END_TEST

START_TEST(what_was_walked_over_once_is_not_read_again)
{
    struct spb_source *source;

    write_scan(true);                           /* faces and edges, then vertices: 1.5 MB */
    ck_assert_int_eq(spb_source_open(scan_path, NULL, &source, NULL), SPC_OK);
    ck_assert_int_eq(spb_source_begin_vertices(source, NULL), SPC_OK);
    ck_assert_int_gt(fault.calls, 3);
    for (int i = 0; i < 5; i++) {
        fault.calls = 0;
        ck_assert_int_eq(spb_source_begin_vertices(source, NULL), SPC_OK);
        ck_assert_int_eq(fault.calls, 0);
        ck_assert_int_eq(spb_source_vertices(source, &scan_vertices, NULL), SPC_OK);
        ck_assert(scan_vertices.xyz[0][0] == 60000);
        ck_assert_int_eq(spb_source_begin_faces(source, NULL), SPC_OK);
        ck_assert_int_eq(spb_source_faces(source, &scan_faces, NULL), SPC_OK);
    }
    spb_source_close(source);
}
END_TEST

START_TEST(a_scan_reads_the_same_in_tiny_pieces)
{
    for (int ascii = 0; ascii < 2; ascii++) {
        struct scan whole, pieces;
        write_scan(ascii);
        memset(&fault, 0, sizeof fault);
        scan_read_path(scan_path, &whole);
        fault.most = 499;
        fault.interrupt_every = 5;
        scan_read_path(scan_path, &pieces);
        scan_expect_ok(&whole);
        scan_expect_ok(&pieces);
        ck_assert_uint_eq(whole.vertex_count, 30000);
        ck_assert_uint_eq(whole.triangle_count, 30000);
        ck_assert(scan_same(&whole, &pieces));
        scan_free(&whole);
        scan_free(&pieces);
    }
}
END_TEST

int main(void)
{
    return SUITE("bytesource", scan_start, scan_finish,
                 every_byte_comes_in_order_whatever_the_step,
                 interrupted_and_short_reads_are_continued,
                 seeks_go_anywhere,
                 a_failed_read_names_errno_and_byte,
                 a_file_cut_short_while_it_is_read_just_ends,
                 only_regular_files_are_opened,
                 each_read_of_a_scan_may_fail_or_find_the_end,
                 what_was_walked_over_once_is_not_read_again,
                 a_scan_reads_the_same_in_tiny_pieces);
}
