/*
 * pread rather than read: the reader seeks between passes, and an offset of our own cannot be moved
 * by anybody else who holds the descriptor.
 */
#include "bytesource.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static bool is_stdin(const char *path)
{
    return path[0] == '-' && path[1] == '\0';
}

/* O_NONBLOCK: opening a pipe that nobody writes would wait; regular files do not notice. */
static int open_file(const char *path)
{
    int fd;
    do
        fd = is_stdin(path) ? fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 0)
                            : open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
    while (fd < 0 && errno == EINTR);
    return fd;
}

/* ---- pipes ------------------------------------------------------------------------------------- */

enum { COPY_BYTES = 64 * 1024 };

/*
 * Waits a moment at most, so that the build can be cancelled. Who opens a named pipe before anybody
 * writes it would read its end at once; poll waits for the first writer.
 */
static enum spc_status copy_some(int from, struct spb_tmpfile *to, uint8_t *buf, bool *end,
                                 struct spc_error *err)
{
    enum { MOMENT_MS = 200 };
    uint64_t off;
    struct pollfd ready = {.fd = from, .events = POLLIN};
    if (poll(&ready, 1, MOMENT_MS) <= 0)
        return SPC_OK;
    const ssize_t got = read(from, buf, COPY_BYTES);
    if (got < 0 && errno != EINTR && errno != EAGAIN)
        return spc_fail_os(err, errno, "cannot read from the pipe");
    *end = got == 0;
    return got > 0 ? spb_tmpfile_append(to, buf, (size_t)got, &off, err) : SPC_OK;
}

/* All that comes out of the pipe, which takes the copy's place. */
static enum spc_status take_copy(struct spb_bytes *bytes, struct spb_temp *temp,
                                 const struct spb_progress *progress, struct spc_error *err)
{
    const int from = bytes->fd;
    uint8_t *buf = malloc(COPY_BYTES);
    enum spc_status status = buf ? spb_tmpfile_create(temp, &bytes->copy, err)
                                 : spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a read buffer");
    bytes->fd = -1;
    for (bool end = false; !end && status == SPC_OK;) {
        status = copy_some(from, bytes->copy, buf, &end, err);
        if (status == SPC_OK && spb_progress_tell(progress, "copy pipe", spb_tmpfile_bytes(bytes->copy), 0))
            status = spc_fail(err, SPC_CANCELLED, SPC_NO_OFF, "cancelled");
    }
    free(buf);
    close(from);
    if (status != SPC_OK)
        return status;
    bytes->fd = spb_tmpfile_fd(bytes->copy);
    bytes->file_bytes = spb_tmpfile_bytes(bytes->copy);
    return SPC_OK;
}

static enum spc_status take_file(struct spb_bytes *bytes, const struct stat *st,
                                 struct spb_temp *temp, const struct spb_progress *progress,
                                 struct spc_error *err)
{
    if (S_ISREG(st->st_mode)) {
        bytes->file_bytes = (uint64_t)st->st_size;
        return SPC_OK;
    }
    if (S_ISDIR(st->st_mode))
        return spc_fail(err, SPC_INPUT_FORMAT, SPC_NO_OFF, "a directory, not a scan");
    if (isatty(bytes->fd))
        return spc_fail(err, SPC_INPUT_FORMAT, SPC_NO_OFF, "a terminal, not a scan");
    if (!S_ISFIFO(st->st_mode) && !S_ISSOCK(st->st_mode))
        return spc_fail(err, SPC_INPUT_FORMAT, SPC_NO_OFF, "a device, not a scan");
    if (temp == NULL)
        return spc_fail(err, SPC_INPUT_FORMAT, SPC_NO_OFF,
                        "a pipe: a scan is read twice, so it must be a regular file");
    return take_copy(bytes, temp, progress, err);
}

/* ---- the window -------------------------------------------------------------------------------- */

/* No larger than the file: less memory, and memory checkers see a step over its end. */
static size_t window_bytes(uint64_t file_bytes)
{
    return file_bytes < SPB_BYTES_WINDOW ? (size_t)file_bytes : SPB_BYTES_WINDOW;
}

enum spc_status spb_bytes_open(struct spb_bytes *bytes, const char *path, struct spb_temp *temp,
                               const struct spb_progress *progress, struct spc_error *err)
{
    struct stat st;
    enum spc_status status;

    *bytes = (struct spb_bytes){ .fd = -1 };
    bytes->buf = bytes->none;
    bytes->fd = open_file(path);
    if (bytes->fd < 0)
        return spc_fail_os(err, errno, "cannot open");
    if (fstat(bytes->fd, &st) != 0)
        status = spc_fail_os(err, errno, "cannot read the file's size");
    else
        status = take_file(bytes, &st, temp, progress, err);
    if (status != SPC_OK) {
        spb_bytes_close(bytes);
        return status;
    }
    bytes->window_bytes = window_bytes(bytes->file_bytes);
    /* Advice only, so a refusal changes nothing. */
    (void)posix_fadvise(bytes->fd, 0, 0, POSIX_FADV_SEQUENTIAL);
    return SPC_OK;
}

void spb_bytes_open_memory(struct spb_bytes *bytes, const void *memory, size_t size, size_t step)
{
    *bytes = (struct spb_bytes){ .fd = -1, .memory = memory, .memory_step = step,
                                 .window_bytes = window_bytes(size), .file_bytes = size };
    bytes->buf = bytes->none;
}

void spb_bytes_close(struct spb_bytes *bytes)
{
    if (!bytes)
        return;
    if (bytes->buf != bytes->none)
        free(bytes->buf);
    if (bytes->copy)
        spb_tmpfile_free(bytes->copy);
    else if (bytes->fd >= 0)
        close(bytes->fd);
    *bytes = (struct spb_bytes){ .fd = -1 };
    bytes->buf = bytes->none;
}

void spb_bytes_pause(struct spb_bytes *bytes)
{
    bytes->buf_off += bytes->pos;
    bytes->pos = bytes->end = 0;
    if (bytes->buf != bytes->none)
        free(bytes->buf);
    bytes->buf = bytes->none;
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

static ssize_t read_some(const struct spb_bytes *bytes, void *out, size_t room, uint64_t off)
{
    if (!bytes->memory)
        return pread(bytes->fd, out, room, (off_t)off);
    if (room > bytes->memory_step)
        room = bytes->memory_step;
    memcpy(out, bytes->memory + off, room);
    return (ssize_t)room;
}

enum spc_status spb_bytes_fill(struct spb_bytes *bytes, size_t want, struct spc_error *err)
{
    const size_t kept = spb_bytes_have(bytes);

    if (bytes->buf == bytes->none) {
        bytes->buf = malloc(bytes->window_bytes + 1);
        if (!bytes->buf) {
            bytes->buf = bytes->none;
            return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a read buffer");
        }
    }
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
        const ssize_t got = read_some(bytes, bytes->buf + bytes->end, room, off);
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
