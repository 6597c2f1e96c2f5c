#define _GNU_SOURCE                 /* O_TMPFILE, fallocate, pwritev */
#include "tmpfile.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct spb_tmpfile {
    int fd;
    struct spb_temp *temp;
    atomic_uint_fast64_t end;
};

static int open_in(const char *path, int flags)
{
    int fd;
    do
        fd = open(path, flags | O_RDWR | O_CLOEXEC, 0600);
    while (fd < 0 && errno == EINTR);
    return fd;
}

/*
 * Without O_TMPFILE: one name for all runs of a user, for a moment. Nobody opens it a second time,
 * so whoever finds it taken removes it, whether its run is about to do that or was killed.
 */
static int open_named(const char *folder)
{
    const size_t max = strlen(folder) + 40;
    char *name = malloc(max);
    int fd = -1;
    if (name == NULL)
        return -1;
    snprintf(name, max, "%s/.spc-build-%lu", folder, (unsigned long)geteuid());
    for (int attempt = 0; attempt < 100 && fd < 0; attempt++) {
        fd = open_in(name, O_CREAT | O_EXCL);
        if (fd < 0 && (errno != EEXIST || (unlink(name) != 0 && errno != ENOENT)))
            break;
    }
    if (fd >= 0 && unlink(name) != 0 && errno != ENOENT) {
        const int os_errno = errno;
        close(fd);
        errno = os_errno;
        fd = -1;
    }
    free(name);
    return fd;
}

static int open_unnamed(const char *folder)
{
#ifdef O_TMPFILE
    const int fd = open_in(folder, O_TMPFILE | O_EXCL);
    if (fd >= 0)
        return fd;
#endif
    return open_named(folder);
}

enum spc_status spb_tmpfile_create(struct spb_temp *temp, struct spb_tmpfile **out,
                                   struct spc_error *err)
{
    *out = NULL;
    struct spb_tmpfile *file = calloc(1, sizeof *file);
    if (file == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a temporary file");
    file->temp = temp;
    file->fd = open_unnamed(temp->folder);
    if (file->fd < 0) {
        const int os_errno = errno;
        free(file);
        return spc_fail_os(err, os_errno, "cannot create a temporary file in '%s'", temp->folder);
    }
    *out = file;
    return SPC_OK;
}

/* A long path keeps its end: the message must have room for the cause. */
static enum spc_status fail_file(struct spb_tmpfile *file, int os_errno, const char *verb,
                                 struct spc_error *err)
{
    enum { SHOWN = 100 };
    const char *folder = file->temp->folder;
    const size_t n = strlen(folder);
    atomic_store(&file->temp->failed, true);
    return spc_fail_os(err, os_errno, "cannot %s a temporary file in '%s%s'", verb,
                       n > SHOWN ? "..." : "", n > SHOWN ? folder + n - SHOWN : folder);
}

void spb_tmpfile_free(struct spb_tmpfile *file)
{
    if (file == NULL)
        return;
    close(file->fd);
    free(file);
}

uint64_t spb_tmpfile_bytes(const struct spb_tmpfile *file)
{
    return atomic_load(&file->end);
}

int spb_tmpfile_fd(const struct spb_tmpfile *file)
{
    return file->fd;
}

/* Steps over what has been written; false when nothing is left. */
static bool advance(struct iovec **parts, int *count, size_t done)
{
    while (*count > 0 && done >= (*parts)->iov_len) {
        done -= (*parts)->iov_len;
        (*parts)++;
        (*count)--;
    }
    if (*count == 0)
        return false;
    (*parts)->iov_base = (uint8_t *)(*parts)->iov_base + done;
    (*parts)->iov_len -= done;
    return true;
}

uint64_t spb_tmpfile_reserve(struct spb_tmpfile *file, uint64_t n)
{
    return atomic_fetch_add(&file->end, n);
}

static enum spc_status write_parts(struct spb_tmpfile *file, struct iovec *parts, int count,
                                   uint64_t at, struct spc_error *err)
{
    while (advance(&parts, &count, 0)) {
        const ssize_t done = pwritev(file->fd, parts, count, (off_t)at);
        if (done < 0 && errno == EINTR)
            continue;
        if (done <= 0)
            return fail_file(file, done < 0 ? errno : ENOSPC, "write", err);
        at += (uint64_t)done;
        advance(&parts, &count, (size_t)done);
    }
    return SPC_OK;
}

enum spc_status spb_tmpfile_append_parts(struct spb_tmpfile *file, struct iovec *parts, int count,
                                         uint64_t *off, struct spc_error *err)
{
    size_t n = 0;
    for (int i = 0; i < count; i++)
        n += parts[i].iov_len;
    *off = spb_tmpfile_reserve(file, n);
    atomic_fetch_add(&file->temp->written, n);
    return write_parts(file, parts, count, *off, err);
}

enum spc_status spb_tmpfile_write(struct spb_tmpfile *file, uint64_t off, const void *bytes, size_t n,
                                  struct spc_error *err)
{
    struct iovec part = {(void *)(uintptr_t)bytes, n};
    atomic_fetch_add(&file->temp->written, n);
    return write_parts(file, &part, 1, off, err);
}

enum spc_status spb_tmpfile_append(struct spb_tmpfile *file, const void *bytes, size_t n,
                                   uint64_t *off, struct spc_error *err)
{
    struct iovec part = {(void *)(uintptr_t)bytes, n};
    return spb_tmpfile_append_parts(file, &part, 1, off, err);
}

enum spc_status spb_tmpfile_read(struct spb_tmpfile *file, uint64_t off, void *bytes, size_t n,
                                 struct spc_error *err)
{
    uint8_t *p = bytes;
    atomic_fetch_add(&file->temp->read, n);
    while (n > 0) {
        const ssize_t done = pread(file->fd, p, n, (off_t)off);
        if (done < 0 && errno == EINTR)
            continue;
        if (done < 0)
            return fail_file(file, errno, "read", err);
        if (done == 0)
            return fail_file(file, EIO, "read", err);
        p += done;
        off += (uint64_t)done;
        n -= (size_t)done;
    }
    return SPC_OK;
}

void spb_tmpfile_prefetch(struct spb_tmpfile *file, uint64_t off, uint64_t n)
{
    (void)posix_fadvise(file->fd, (off_t)off, (off_t)n, POSIX_FADV_WILLNEED);
}

void spb_tmpfile_discard(struct spb_tmpfile *file, uint64_t off, uint64_t n)
{
#ifdef FALLOC_FL_PUNCH_HOLE
    (void)fallocate(file->fd, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, (off_t)off, (off_t)n);
#else
    (void)file, (void)off, (void)n;
#endif
}
