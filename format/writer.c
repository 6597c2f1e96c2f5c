/*
 * writer.c - writes an archive: chunks as they come, the head last, the name when all is safe.
 *
 * The file is unnamed (O_TMPFILE) until it is complete and synced; then it is linked to its name,
 * or, with force, linked to path.part and exchanged with the old one, which stays path.part until
 * the folder is synced too. Where the file system has no unnamed files it is written as path.part
 * under a lock. A path.part that nobody has locked is stale, left by a run that was killed: the
 * next run removes it.
 *
 * Calls that a signal interrupts begin anew: whether to end is asked elsewhere, by the build.
 */
#define _GNU_SOURCE                 /* O_TMPFILE, renameat2, sync_file_range */
#include "format_int.h"

#include "bytes.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
#include <xxhash.h>

struct spc_writer {
    int fd, dir_fd;
    int old_fd;                     /* the old target, locked while its name is path.part; or -1 */
    bool force, unnamed, sealed;
    bool part_linked;               /* path.part is ours to remove */
    bool renamed;                   /* over an old target: cannot be taken back */
    char *path, *name, *part_name;  /* name and part_name: inside dir_fd */
    struct spc_header header;       /* as announced at begin */
    size_t meta_bytes;
    uint64_t at;                    /* next chunk */
    uint64_t flushed;               /* bytes before it are on their way to the disk */
    uint32_t block_next;
    uint8_t *clusters, *blocks;     /* encoded records */
    uint8_t *chunk;
    size_t chunk_max;
};

static int open_in(int dir_fd, const char *name, int flags)
{
    int fd;
    do
        fd = openat(dir_fd, name, flags | O_CLOEXEC, 0666);
    while (fd < 0 && errno == EINTR);
    return fd;
}

static int lock(int fd)
{
    int result;
    do
        result = flock(fd, LOCK_EX | LOCK_NB);
    while (result != 0 && errno == EINTR);
    return result;
}

static int sync_file(int fd)
{
    int result;
    do
        result = fsync(fd);
    while (result != 0 && errno == EINTR);
    return result;
}

static enum spc_status write_at(int fd, const uint8_t *bytes, size_t n, uint64_t off,
                                struct spc_error *err)
{
    while (n > 0) {
        const ssize_t done = pwrite(fd, bytes, n, (off_t)off);
        if (done < 0 && errno == EINTR)
            continue;
        if (done <= 0)
            return spc_fail_os(err, done < 0 ? errno : ENOSPC, "cannot write the archive");
        bytes += done;
        off += (uint64_t)done;
        n -= (size_t)done;
    }
    return SPC_OK;
}

static enum spc_status split_path(struct spc_writer *w, struct spc_error *err)
{
    const char *slash = strrchr(w->path, '/');
    char *dir = slash == NULL ? strdup(".")
                : slash == w->path ? strdup("/") : strndup(w->path, (size_t)(slash - w->path));
    w->name = strdup(slash ? slash + 1 : w->path);
    w->part_name = malloc(strlen(w->path) + 8);
    enum spc_status status = SPC_OK;
    if (dir == NULL || w->name == NULL || w->part_name == NULL) {
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a path");
    } else if (w->name[0] == '\0') {
        status = spc_fail(err, SPC_IO, SPC_NO_OFF, "the target names a folder");
    } else {
        sprintf(w->part_name, "%s.part", w->name);
        w->dir_fd = open_in(AT_FDCWD, dir, O_RDONLY | O_DIRECTORY);
        if (w->dir_fd < 0)
            status = spc_fail_os(err, errno, "cannot open the target's folder");
    }
    free(dir);
    return status;
}

/* Removes path.part when nobody holds its lock. */
static enum spc_status remove_stale_part(struct spc_writer *w, struct spc_error *err)
{
    const int fd = open_in(w->dir_fd, w->part_name, O_RDWR | O_NOFOLLOW);
    if (fd < 0)
        return SPC_OK;              /* none, or not ours to touch: creating will tell */
    enum spc_status status = SPC_OK;
    if (lock(fd) != 0)
        status = errno == EWOULDBLOCK
            ? spc_fail(err, SPC_BUSY, SPC_NO_OFF, "another run is writing '%s'", w->part_name)
            : spc_fail_os(err, errno, "cannot lock '%s'", w->part_name);
    else if (unlinkat(w->dir_fd, w->part_name, 0) != 0 && errno != ENOENT)
        status = spc_fail_os(err, errno, "cannot remove the stale '%s'", w->part_name);
    close(fd);
    return status;
}

/* The name still leads to the file we hold: nobody took it for stale before it was locked. */
static bool name_is_ours(const struct spc_writer *w)
{
    struct stat by_name, by_fd;
    return fstatat(w->dir_fd, w->part_name, &by_name, AT_SYMLINK_NOFOLLOW) == 0 &&
           fstat(w->fd, &by_fd) == 0 && by_name.st_ino == by_fd.st_ino &&
           by_name.st_dev == by_fd.st_dev;
}

static enum spc_status create_part(struct spc_writer *w, struct spc_error *err)
{
    for (int attempt = 0; attempt < 100; attempt++) {
        const enum spc_status status = remove_stale_part(w, err);
        if (status != SPC_OK)
            return status;
        w->fd = open_in(w->dir_fd, w->part_name, O_RDWR | O_CREAT | O_EXCL);
        if (w->fd < 0 && errno == EEXIST)
            continue;
        if (w->fd < 0)
            return spc_fail_os(err, errno, "cannot create the archive");
        const bool locked = lock(w->fd) == 0;
        if (!locked && errno != EWOULDBLOCK) {
            w->part_linked = true;
            return spc_fail_os(err, errno, "cannot lock '%s'", w->part_name);
        }
        if (locked && name_is_ours(w)) {
            w->part_linked = true;
            return SPC_OK;
        }
        close(w->fd);
        w->fd = -1;
    }
    return spc_fail(err, SPC_BUSY, SPC_NO_OFF, "another run is writing '%s'", w->part_name);
}

static void path_of_fd(const struct spc_writer *w, char path[64])
{
    snprintf(path, 64, "/proc/self/fd/%d", w->fd);
}

/* An unnamed file that can be named later, which takes /proc; -1: there are none here. */
static int open_unnamed(struct spc_writer *w)
{
#ifdef O_TMPFILE
    char path[64];
    w->fd = open_in(w->dir_fd, ".", O_TMPFILE | O_RDWR);
    path_of_fd(w, path);
    if (w->fd < 0 || access(path, F_OK) == 0)
        return w->fd;
    close(w->fd);
#endif
    return -1;
}

static enum spc_status create_file(struct spc_writer *w, struct spc_error *err)
{
    struct stat st;
    if (fstatat(w->dir_fd, w->name, &st, 0) == 0) {
        if (S_ISDIR(st.st_mode))
            return spc_fail(err, SPC_IO, SPC_NO_OFF, "the target is a folder");
        if (!w->force)
            return spc_fail(err, SPC_EXISTS, SPC_NO_OFF, "the target exists");
        if (!S_ISREG(st.st_mode))
            return spc_fail(err, SPC_IO, SPC_NO_OFF, "the target is not a plain file");
    } else if (!w->force && fstatat(w->dir_fd, w->name, &st, AT_SYMLINK_NOFOLLOW) == 0) {
        return spc_fail(err, SPC_EXISTS, SPC_NO_OFF, "the target is a link that leads nowhere");
    }
    w->fd = open_unnamed(w);
    if (w->fd >= 0) {
        w->unnamed = true;
        (void)remove_stale_part(w, NULL);
        return SPC_OK;
    }
    return create_part(w, err);
}

enum spc_status spc_writer_create(const char *path, bool force, struct spc_writer **out,
                                  struct spc_error *err)
{
    *out = NULL;
    struct spc_writer *w = calloc(1, sizeof *w);
    if (w == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to write an archive");
    w->fd = w->dir_fd = w->old_fd = -1;
    w->force = force;
    w->path = strdup(path);
    enum spc_status status = SPC_OK;
    if (w->path == NULL)
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to write an archive");
    if (status == SPC_OK)
        status = split_path(w, err);
    if (status == SPC_OK)
        status = create_file(w, err);
    if (status == SPC_OK)
        *out = w;
    else
        spc_writer_close(w);
    return status;
}

/* Sections one after another behind the header, each from a multiple of 64. Returns head_bytes. */
static uint64_t place_sections(const struct spc_header *h, size_t meta_bytes,
                               struct spc_section sections[SE_COUNT])
{
    const uint64_t bytes[SE_COUNT] = {(uint64_t)h->normal_clusters * 6,
                                      (uint64_t)h->cluster_count * CL_SIZE,
                                      (uint64_t)h->block_count * BL_SIZE, meta_bytes};
    uint64_t end = HD_SIZE;
    for (int s = 0; s < SE_COUNT; s++) {
        sections[s].off = align_up(end, SPC_CHUNK_ALIGN);
        sections[s].bytes = bytes[s];
        end = sections[s].off + bytes[s];
    }
    return end;
}

enum spc_status spc_writer_begin(struct spc_writer *w, const struct spc_header *header,
                                 size_t meta_bytes, struct spc_error *err)
{
    struct spc_section sections[SE_COUNT];
    if (header->cluster_count > SPC_CLUSTERS_MAX || header->block_count > SPC_BLOCKS_MAX ||
        meta_bytes > SPC_META_BYTES_MAX)
        return spc_fail(err, SPC_LIMIT, SPC_NO_OFF,
                        "%u clusters of %u blocks are over the format's limits: make them larger",
                        header->cluster_count, header->block_count);
    w->header = *header;
    w->meta_bytes = meta_bytes;
    w->header.head_bytes = place_sections(header, meta_bytes, sections);
    w->at = spc_data_start(w->header.head_bytes);
    w->clusters = calloc(header->cluster_count, CL_SIZE);
    w->blocks = calloc(header->block_count, BL_SIZE);
    if (w->clusters == NULL || w->blocks == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for the directory");
    return SPC_OK;
}

/*
 * Sends what was written to the disk as it comes, so that no more than two steps of it are left for
 * the sync at the end, which no signal can cut short. The call tells an error only once: it counts.
 */
static enum spc_status flush_step(struct spc_writer *w, struct spc_error *err)
{
    const uint64_t step = (uint64_t)8 << 20;
    if (w->at - w->flushed < step)
        return SPC_OK;
    const uint64_t before = w->flushed < step ? w->flushed : step;
    if ((before > 0 && sync_file_range(w->fd, (off64_t)(w->flushed - before), (off64_t)before,
                                       SYNC_FILE_RANGE_WAIT_BEFORE | SYNC_FILE_RANGE_WRITE |
                                           SYNC_FILE_RANGE_WAIT_AFTER) != 0) ||
        sync_file_range(w->fd, (off64_t)w->flushed, (off64_t)(w->at - w->flushed),
                        SYNC_FILE_RANGE_WRITE) != 0)
        if (errno == EIO || errno == ENOSPC || errno == EDQUOT)
            return spc_fail_os(err, errno, "cannot write the archive to the disk");
    w->flushed = w->at;
    return SPC_OK;
}

enum spc_status spc_writer_cluster(struct spc_writer *w, uint32_t id, struct spc_cluster *c,
                                   struct spc_block *blocks, const void *const *stored,
                                   struct spc_error *err)
{
    struct spc_frame frame = {
        .flags = w->header.flags, .normal_clusters = w->header.normal_clusters,
        .unit_exp = w->header.unit_exp, .vertex_exp = w->header.vertex_exp,
    };
    memcpy(frame.origin, c->origin, sizeof frame.origin);
    c->block_first = w->block_next;
    c->data_off = w->at;
    for (uint32_t k = 0; k < c->block_count; k++) {
        struct spc_block *b = &blocks[k];
        const size_t bytes = (size_t)spc_block_chunk_bytes(b);
        if (bytes > w->chunk_max) {
            uint8_t *grown = realloc(w->chunk, bytes);
            if (grown == NULL)
                return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to write a block");
            w->chunk = grown;
            w->chunk_max = bytes;
        }
        b->cluster = id;
        b->off = w->at;
        b->hash = 0;
        spc_chunk_encode(b, &frame, w->chunk);
        memcpy(w->chunk + CH_SIZE, stored[k], b->stored_bytes);
        memset(w->chunk + CH_SIZE + b->stored_bytes, 0, bytes - CH_SIZE - b->stored_bytes);
        b->hash = spc_chunk_hash(w->chunk, bytes);
        store_u64(w->chunk + CH_HASH, b->hash);
        const enum spc_status status = write_at(w->fd, w->chunk, bytes, w->at, err);
        if (status != SPC_OK)
            return status;
        spc_block_record_encode(b, w->blocks + (size_t)BL_SIZE * w->block_next);
        w->at += bytes;
        w->block_next++;
    }
    c->data_bytes = w->at - c->data_off;
    spc_cluster_encode(c, w->clusters + (size_t)CL_SIZE * id);
    return flush_step(w, err);
}

static void encode_axes(uint32_t count, uint8_t *out)
{
    int16_t axes[SPC_NORMAL_CLUSTERS_MAX][3];
    spc_axes_standard(count, axes);
    for (uint32_t k = 0; k < count; k++)
        for (uint32_t a = 0; a < 3; a++)
            store_u16(out + 6 * k + 2 * a, (uint16_t)axes[k][a]);
}

/* The id names the content: hashes of all sections, and the header without id and hashes. */
static void make_id(struct spc_header *h, const struct spc_section sections[SE_COUNT])
{
    uint8_t bytes[HD_SIZE];
    memset(h->id, 0, sizeof h->id);
    spc_header_encode(h, sections, bytes);
    store_u64(h->id, XXH64(bytes, HD_SIZE, 1));
    store_u64(h->id + 8, XXH64(bytes, HD_SIZE, 2));
}

static enum spc_status write_head(struct spc_writer *w, struct spc_header *h, const char *meta,
                                  struct spc_error *err)
{
    uint8_t header[HD_SIZE], axes[6 * SPC_NORMAL_CLUSTERS_MAX];
    const void *parts[SE_COUNT] = {axes, w->clusters, w->blocks, meta};
    struct spc_section sections[SE_COUNT];
    enum spc_status status = SPC_OK;
    h->head_bytes = place_sections(h, w->meta_bytes, sections);
    h->file_bytes = w->at;
    encode_axes(h->normal_clusters, axes);
    for (int s = 0; s < SE_COUNT && status == SPC_OK; s++) {
        sections[s].hash = XXH64(parts[s], sections[s].bytes, 0);
        status = write_at(w->fd, parts[s], sections[s].bytes, sections[s].off, err);
    }
    if (status != SPC_OK)
        return status;
    make_id(h, sections);
    spc_header_encode(h, sections, header);
    return write_at(w->fd, header, HD_SIZE, 0, err);
}

/* Gives the unnamed file the name path.part, clearing away a stale one. */
static enum spc_status link_part(struct spc_writer *w, const char *fd_path, struct spc_error *err)
{
    if (lock(w->fd) != 0)
        return spc_fail_os(err, errno, "cannot lock the archive");
    for (int attempt = 0; attempt < 100; attempt++) {
        if (linkat(AT_FDCWD, fd_path, w->dir_fd, w->part_name, AT_SYMLINK_FOLLOW) == 0) {
            w->part_linked = true;
            return SPC_OK;
        }
        if (errno != EEXIST)
            return spc_fail_os(err, errno, "cannot name the archive");
        if (remove_stale_part(w, NULL) == SPC_BUSY)     /* another run is about to rename its own */
            nanosleep(&(struct timespec){.tv_nsec = 20000000}, NULL);
    }
    return spc_fail(err, SPC_BUSY, SPC_NO_OFF, "another run is writing '%s'", w->part_name);
}

static int exchange(const struct spc_writer *w)
{
    return renameat2(w->dir_fd, w->part_name, w->dir_fd, w->name, RENAME_EXCHANGE);
}

/* path.part gets the target's name, and an old target, locked, that of path.part. */
static enum spc_status replace(struct spc_writer *w, struct spc_error *err)
{
    struct stat st;
    w->old_fd = open_in(w->dir_fd, w->name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY);
    if (w->old_fd >= 0 && fstat(w->old_fd, &st) == 0 && S_ISREG(st.st_mode) &&
        lock(w->old_fd) == 0 && exchange(w) == 0)
        return SPC_OK;
    w->renamed = fstatat(w->dir_fd, w->name, &st, AT_SYMLINK_NOFOLLOW) == 0 || errno != ENOENT;
    if (renameat(w->dir_fd, w->part_name, w->dir_fd, w->name) != 0)
        return spc_fail_os(err, errno, "cannot name the archive");
    w->part_linked = false;
    return SPC_OK;
}

static enum spc_status name_file(struct spc_writer *w, struct spc_error *err)
{
    char fd_path[64];
    path_of_fd(w, fd_path);
    if (w->force) {
        const enum spc_status status = w->unnamed ? link_part(w, fd_path, err) : SPC_OK;
        return status == SPC_OK ? replace(w, err) : status;
    }
    /* A rename would replace; a link fails when the name is taken. Close removes path.part. */
    if ((w->unnamed ? linkat(AT_FDCWD, fd_path, w->dir_fd, w->name, AT_SYMLINK_FOLLOW)
                    : linkat(w->dir_fd, w->part_name, w->dir_fd, w->name, 0)) == 0)
        return SPC_OK;
    return errno == EEXIST ? spc_fail(err, SPC_EXISTS, SPC_NO_OFF, "the target appeared in the meantime")
                           : spc_fail_os(err, errno, "cannot name the archive");
}

/* Takes back what name_file did: the old target, or none. */
static void unname_file(struct spc_writer *w)
{
    if (w->force && w->part_linked)
        (void)exchange(w);
    else if (!w->renamed)
        unlinkat(w->dir_fd, w->name, 0);
}

enum spc_status spc_writer_seal(struct spc_writer *w, struct spc_header *header, const char *meta,
                                struct spc_error *err)
{
    if (header->cluster_count != w->header.cluster_count ||
        header->block_count != w->block_next ||
        header->normal_clusters != w->header.normal_clusters ||
        header->flags != w->header.flags || header->unit_exp != w->header.unit_exp ||
        header->vertex_exp != w->header.vertex_exp)
        return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "the archive is not what was announced");
    enum spc_status status = write_head(w, header, meta, err);
    if (status == SPC_OK && sync_file(w->fd) != 0)
        status = spc_fail_os(err, errno, "cannot write the archive to the disk");
    w->sealed = status == SPC_OK;
    return status;
}

enum spc_status spc_writer_finish(struct spc_writer *w, struct spc_error *err)
{
    if (!w->sealed)
        return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "the archive is not complete");
    enum spc_status status = name_file(w, err);
    if (status == SPC_OK && sync_file(w->dir_fd) != 0 && errno != EINVAL) {
        status = spc_fail_os(err, errno, "cannot write the target's folder to the disk");
        unname_file(w);
    }
    return status;
}

void spc_writer_close(struct spc_writer *w)
{
    if (w == NULL)
        return;
    if (w->part_linked)
        unlinkat(w->dir_fd, w->part_name, 0);
    if (w->old_fd >= 0)
        close(w->old_fd);
    if (w->fd >= 0)
        close(w->fd);
    if (w->dir_fd >= 0)
        close(w->dir_fd);
    free(w->path);
    free(w->name);
    free(w->part_name);
    free(w->clusters);
    free(w->blocks);
    free(w->chunk);
    free(w);
}
