#define _GNU_SOURCE                 /* O_TMPFILE */
#include "whole_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { NAMES_MAX = 100, NAME = 48 };

/* A name in the folder of path that nobody else takes: short, whatever path's own is. To be freed. */
static char *part_name(const char *path, int number)
{
    const char *slash = strrchr(path, '/');
    const size_t folder = slash != NULL ? (size_t)(slash + 1 - path) : 0;
    char *name = malloc(folder + NAME);
    if (name != NULL)
        snprintf(name, folder + NAME, "%.*s.spc-%ld-%d.part", (int)folder, path, (long)getpid(), number);
    return name;
}

/* Without a name, so that nothing stays when the process ends; -1: this system or folder has no such files. */
static int open_unnamed(const char *path)
{
#ifdef O_TMPFILE
    const char *slash = strrchr(path, '/');
    char *folder = slash == NULL ? strdup(".") : strndup(path, (size_t)(slash - path) + (slash == path));
    const int fd = folder != NULL && access("/proc/self/fd", X_OK) == 0
                       ? open(folder, O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666) : -1;
    free(folder);
    return fd;
#else
    (void)path;
    return -1;
#endif
}

static int open_part(struct spv_whole_file *f)
{
    for (int k = 0; k < NAMES_MAX; k++) {
        f->part = part_name(f->path, k);
        const int fd = f->part != NULL ? open(f->part, O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666) : -1;
        if (fd >= 0)
            return fd;
        free(f->part);
        f->part = NULL;
        if (errno != EEXIST)
            break;
    }
    return -1;
}

/* What is to be replaced must be writable, as for a program that writes over it. */
static int open_beside(struct spv_whole_file *f, const struct stat *there)
{
    if (there != NULL && access(f->path, W_OK) != 0)
        return -1;
    int fd = open_unnamed(f->path);
    if (fd < 0)
        fd = open_part(f);
    if (fd >= 0 && there != NULL)
        (void)fchmod(fd, there->st_mode & 07777);
    if (fd < 0 && there != NULL) {
        f->direct = true;
        fd = open(f->path, O_WRONLY | O_TRUNC | O_CLOEXEC);
    }
    return fd;
}

enum spc_status spv_whole_begin(struct spv_whole_file *f, const char *path, const char *what, struct spc_error *err)
{
    struct stat there, itself;
    const bool exists = stat(path, &there) == 0;
    *f = (struct spv_whole_file){.direct = exists ? !S_ISREG(there.st_mode) : lstat(path, &itself) == 0};
    f->path = exists && !f->direct ? realpath(path, NULL) : strdup(path);
    if (f->path == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a name");
    const int fd = f->direct ? open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666)
                             : open_beside(f, exists ? &there : NULL);
    f->out = fd >= 0 ? fdopen(fd, "wb") : NULL;
    if (f->out != NULL)
        return SPC_OK;
    const enum spc_status status = spc_fail_os(err, errno, "cannot create %s", what);
    if (fd >= 0)
        close(fd);
    if (f->part != NULL)
        unlink(f->part);
    free(f->part);
    free(f->path);
    *f = (struct spv_whole_file){0};
    return status;
}

/* Links the unnamed file to a name of its own, from which it can replace what is there. */
static bool give_name(struct spv_whole_file *f)
{
    char fd_path[32];
    snprintf(fd_path, sizeof fd_path, "/proc/self/fd/%d", fileno(f->out));
    for (int k = 0; k < NAMES_MAX; k++) {
        f->part = part_name(f->path, k);
        if (f->part != NULL && linkat(AT_FDCWD, fd_path, AT_FDCWD, f->part, AT_SYMLINK_FOLLOW) == 0)
            return true;
        free(f->part);
        f->part = NULL;
        if (errno != EEXIST)
            break;
    }
    return false;
}

enum spc_status spv_whole_end(struct spv_whole_file *f, enum spc_status status, const char *what, struct spc_error *err)
{
    errno = 0;
    if (status == SPC_OK && (fflush(f->out) != 0 || ferror(f->out)))
        status = spc_fail_os(err, errno != 0 ? errno : EIO, "cannot write %s", what);
    if (status == SPC_OK && !f->direct && f->part == NULL && !give_name(f))
        status = spc_fail_os(err, errno, "cannot write %s", what);
    if (fclose(f->out) != 0 && status == SPC_OK)
        status = spc_fail_os(err, errno, "cannot write %s", what);
    if (status == SPC_OK && f->part != NULL && rename(f->part, f->path) != 0)
        status = spc_fail_os(err, errno, "cannot write %s", what);
    if (status != SPC_OK && f->part != NULL)
        unlink(f->part);
    free(f->part);
    free(f->path);
    *f = (struct spv_whole_file){0};
    return status;
}
