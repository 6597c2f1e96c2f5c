/*
 * tmpfile.h - an unnamed temporary file that only grows.
 *
 * Unlinked from birth: whatever happens to the process, nothing stays behind. Appending and
 * reading are safe from several threads.
 */
#ifndef SPB_TMPFILE_H
#define SPB_TMPFILE_H

#include "spc.h"

struct spb_tmpfile;

/* Creates it in folder. fails SPC_IO, SPC_NO_MEMORY */
enum spc_status spb_tmpfile_create(const char *folder, struct spb_tmpfile **out,
                                   struct spc_error *err);
void spb_tmpfile_free(struct spb_tmpfile *file);

/* Appends bytes; *off is where they lie. fails SPC_IO (a full disk, say) */
enum spc_status spb_tmpfile_append(struct spb_tmpfile *file, const void *bytes, size_t n,
                                   uint64_t *off, struct spc_error *err);

/* Reads n bytes at off, all of which must have been appended. fails SPC_IO */
enum spc_status spb_tmpfile_read(struct spb_tmpfile *file, uint64_t off, void *bytes, size_t n,
                                 struct spc_error *err);

uint64_t spb_tmpfile_bytes_written(const struct spb_tmpfile *file);
uint64_t spb_tmpfile_bytes_read(const struct spb_tmpfile *file);

#endif
