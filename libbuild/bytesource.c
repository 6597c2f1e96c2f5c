/*
 * pread rather than read: the reader seeks between passes, and an offset of our own cannot be moved
 * by anybody else who holds the descriptor.
 */
#include "bytesource.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static enum spc_status check_regular(const struct stat *st, struct spc_error *err)
{
    if (S_ISREG(st->st_mode))
        return SPC_OK;
    if (S_ISDIR(st->st_mode))
        return spc_fail(err, SPC_INPUT_FORMAT, SPC_NO_OFF, "a directory, not a scan");
    return spc_fail(err, SPC_INPUT_FORMAT, SPC_NO_OFF,
                    "a pipe or device: a scan is read twice, so it must be a regular file");
}

enum spc_status spb_bytes_open(struct spb_bytes *bytes, const char *path, struct spc_error *err)
{
    struct stat st;
    enum spc_status status;

    *bytes = (struct spb_bytes){ .fd = -1 };
    /* O_NONBLOCK: opening a pipe that nobody writes would wait; regular files do not notice. */
    do
        bytes->fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    while (bytes->fd < 0 && errno == EINTR);
    if (bytes->fd < 0)
        return spc_fail_os(err, errno, "cannot open");
    if (fstat(bytes->fd, &st) != 0) {
        status = spc_fail_os(err, errno, "cannot read the file's size");
        goto out;
    }
    status = check_regular(&st, err);
    if (status != SPC_OK)
        goto out;
    bytes->file_bytes = (uint64_t)st.st_size;
    /* No larger than the file: less memory, and memory checkers see a step over its end. */
    bytes->window_bytes = SPB_BYTES_WINDOW;
    if (bytes->file_bytes < SPB_BYTES_WINDOW)
        bytes->window_bytes = (size_t)bytes->file_bytes;
    bytes->buf = malloc(bytes->window_bytes + 1);
    if (!bytes->buf) {
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a read buffer");
        goto out;
    }
    bytes->buf[0] = 0;
    /* Advice only, so a refusal changes nothing. */
    (void)posix_fadvise(bytes->fd, 0, 0, POSIX_FADV_SEQUENTIAL);
out:
    if (status != SPC_OK)
        spb_bytes_close(bytes);
    return status;
}

void spb_bytes_close(struct spb_bytes *bytes)
{
    if (!bytes)
        return;
    free(bytes->buf);
    if (bytes->fd >= 0)
        close(bytes->fd);
    *bytes = (struct spb_bytes){ .fd = -1 };
}

void spb_bytes_seek(struct spb_bytes *bytes, uint64_t off)
{
    if (off >= bytes->buf_off && off - bytes->buf_off <= bytes->end) {
        bytes->pos = (size_t)(off - bytes->buf_off);
        return;
    }
    bytes->buf_off = off;
    bytes->pos = bytes->end = 0;
    bytes->buf[0] = 0;
}

enum spc_status spb_bytes_fill(struct spb_bytes *bytes, size_t want, struct spc_error *err)
{
    const size_t kept = spb_bytes_have(bytes);

    memmove(bytes->buf, bytes->buf + bytes->pos, kept);
    bytes->buf_off += bytes->pos;
    bytes->pos = 0;
    bytes->end = kept;
    bytes->buf[bytes->end] = 0;
    while (bytes->end < want && !spb_bytes_last(bytes)) {
        const uint64_t off = bytes->buf_off + bytes->end;
        size_t room = bytes->window_bytes - bytes->end;
        if (room > bytes->file_bytes - off)
            room = (size_t)(bytes->file_bytes - off);
        const ssize_t got = pread(bytes->fd, bytes->buf + bytes->end, room, (off_t)off);
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0)
            return spc_fail_os(err, errno, "read failed at byte %llu", (unsigned long long)off);
        if (got == 0)
            bytes->file_bytes = off;            /* somebody cut the file short */
        bytes->end += (size_t)got;
        bytes->buf[bytes->end] = 0;
    }
    return SPC_OK;
}
