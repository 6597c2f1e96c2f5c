#define _GNU_SOURCE                 /* O_TMPFILE */
#include "tmpfile.h"

#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct spb_tmpfile {
    int fd;
    atomic_uint_fast64_t end, read;
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

enum spc_status spb_tmpfile_create(const char *folder, struct spb_tmpfile **out,
                                   struct spc_error *err)
{
    *out = NULL;
    struct spb_tmpfile *file = calloc(1, sizeof *file);
    if (file == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a temporary file");
    file->fd = open_unnamed(folder);
    if (file->fd < 0) {
        const int os_errno = errno;
        free(file);
        return spc_fail_os(err, os_errno, "cannot create a temporary file in '%s'", folder);
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

enum spc_status spb_tmpfile_append(struct spb_tmpfile *file, const void *bytes, size_t n,
                                   uint64_t *off, struct spc_error *err)
{
    const uint8_t *p = bytes;
    uint64_t at = atomic_fetch_add(&file->end, n);
    *off = at;
    while (n > 0) {
        const ssize_t done = pwrite(file->fd, p, n, (off_t)at);
        if (done < 0 && errno == EINTR)
            continue;
        if (done <= 0)
            return spc_fail_os(err, done < 0 ? errno : ENOSPC, "cannot write the temporary file");
        p += done;
        at += (uint64_t)done;
        n -= (size_t)done;
    }
    return SPC_OK;
}

enum spc_status spb_tmpfile_read(struct spb_tmpfile *file, uint64_t off, void *bytes, size_t n,
                                 struct spc_error *err)
{
    uint8_t *p = bytes;
    atomic_fetch_add(&file->read, n);
    while (n > 0) {
        const ssize_t done = pread(file->fd, p, n, (off_t)off);
        if (done < 0 && errno == EINTR)
            continue;
        if (done < 0)
            return spc_fail_os(err, errno, "cannot read the temporary file");
        if (done == 0)
            return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "the temporary file is too short");
        p += done;
        off += (uint64_t)done;
        n -= (size_t)done;
    }
    return SPC_OK;
}

uint64_t spb_tmpfile_bytes_written(const struct spb_tmpfile *file)
{
    return atomic_load(&file->end);
}

uint64_t spb_tmpfile_bytes_read(const struct spb_tmpfile *file)
{
    return atomic_load(&file->read);
}
