/*
 * tmpfile.h - an unnamed temporary file that only grows.
 *
 * Unlinked from birth: whatever happens to the process, nothing stays behind. Appending, reading
 * and discarding are safe from several threads.
 */
#ifndef SPB_TMPFILE_H
#define SPB_TMPFILE_H

#include "spc.h"

#include <stdatomic.h>
#include <sys/uio.h>

struct spb_temp {                   /* where they are, and what they cost; {folder} and zeros */
    const char *folder;
    atomic_uint_fast64_t written, read;         /* bytes, of all files */
    atomic_bool failed;             /* an error was that of one of them */
};

struct spb_tmpfile;

/* Creates it in temp, which must live as long. fails SPC_IO, SPC_NO_MEMORY */
enum spc_status spb_tmpfile_create(struct spb_temp *temp, struct spb_tmpfile **out,
                                   struct spc_error *err);
void spb_tmpfile_free(struct spb_tmpfile *file);

/* Appends bytes; *off is where they lie. fails SPC_IO (a full disk, say) */
enum spc_status spb_tmpfile_append(struct spb_tmpfile *file, const void *bytes, size_t n,
                                   uint64_t *off, struct spc_error *err);

/* The same for the bytes of count parts, which it uses up, as one piece. */
enum spc_status spb_tmpfile_append_parts(struct spb_tmpfile *file, struct iovec *parts, int count,
                                         uint64_t *off, struct spc_error *err);

/* Bytes that have been appended. */
uint64_t spb_tmpfile_bytes(const struct spb_tmpfile *file);

/* Its descriptor, for those who read it as a file; the file's own. */
int spb_tmpfile_fd(const struct spb_tmpfile *file);

/* Room for n bytes at the end, which are to be written before they are read: where it is. */
uint64_t spb_tmpfile_reserve(struct spb_tmpfile *file, uint64_t n);

/* Writes n bytes at off, into such room or over what was written. fails SPC_IO */
enum spc_status spb_tmpfile_write(struct spb_tmpfile *file, uint64_t off, const void *bytes, size_t n,
                                  struct spc_error *err);

/* Reads n bytes at off, all of which must have been appended. fails SPC_IO */
enum spc_status spb_tmpfile_read(struct spb_tmpfile *file, uint64_t off, void *bytes, size_t n,
                                 struct spc_error *err);

/* Bytes that will be read soon: the system may fetch them meanwhile. */
void spb_tmpfile_prefetch(struct spb_tmpfile *file, uint64_t off, uint64_t n);

/* Bytes that will not be read again: their blocks are given back where the file system can. */
void spb_tmpfile_discard(struct spb_tmpfile *file, uint64_t off, uint64_t n);

#endif
