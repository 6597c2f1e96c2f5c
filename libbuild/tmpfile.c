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

static int open_unnamed(const char *folder)
{
#ifdef O_TMPFILE
    const int fd = open(folder, O_TMPFILE | O_RDWR | O_EXCL | O_CLOEXEC, 0600);
    if (fd >= 0 || (errno != EOPNOTSUPP && errno != EISDIR && errno != EINVAL))
        return fd;
#endif
    char *name = malloc(strlen(folder) + 32);
    if (name == NULL)
        return -1;
    sprintf(name, "%s/.spc-build-XXXXXX", folder);
    const int named = mkstemp(name);
    if (named >= 0)
        unlink(name);
    free(name);
    return named;
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

void spb_tmpfile_free(struct spb_tmpfile *file)
{
    if (file == NULL)
        return;
    close(file->fd);
    free(file);
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

enum spc_status spb_tmpfile_append_parts(struct spb_tmpfile *file, struct iovec *parts, int count,
                                         uint64_t *off, struct spc_error *err)
{
    size_t n = 0;
    for (int i = 0; i < count; i++)
        n += parts[i].iov_len;
    uint64_t at = atomic_fetch_add(&file->end, n);
    *off = at;
    atomic_fetch_add(&file->temp->written, n);
    while (advance(&parts, &count, 0)) {
        const ssize_t done = pwritev(file->fd, parts, count, (off_t)at);
        if (done < 0 && errno == EINTR)
            continue;
        if (done <= 0)
            return spc_fail_os(err, done < 0 ? errno : ENOSPC,
                               "cannot write a temporary file in '%.100s'", file->temp->folder);
        at += (uint64_t)done;
        advance(&parts, &count, (size_t)done);
    }
    return SPC_OK;
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
            return spc_fail_os(err, errno, "cannot read a temporary file in '%.100s'",
                               file->temp->folder);
        if (done == 0)
            return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "the temporary file is too short");
        p += done;
        off += (uint64_t)done;
        n -= (size_t)done;
    }
    return SPC_OK;
}

void spb_tmpfile_discard(struct spb_tmpfile *file, uint64_t off, uint64_t n)
{
#ifdef FALLOC_FL_PUNCH_HOLE
    (void)fallocate(file->fd, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, (off_t)off, (off_t)n);
#else
    (void)file, (void)off, (void)n;
#endif
}
