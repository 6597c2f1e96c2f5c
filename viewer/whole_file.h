/* whole_file.h - a file that has its name only once it is complete. */
#ifndef SPV_WHOLE_FILE_H
#define SPV_WHOLE_FILE_H

#include "spc.h"

#include <stdio.h>

struct spv_whole_file {
    FILE *out;                      /* to be written to */
    char *path, *part;              /* where it goes, links followed; its name until then, NULL: it has none */
    bool direct;                    /* a device, a pipe, or in a folder that is closed: there at once */
};

/*
 * Begins a file. What was there stays until the end, whatever happens: a full disk, a signal, a kill. Where a
 * folder takes no new files, one that is there already is written over at once.
 *
 * what   the file, for messages: "the picture"
 * fails  SPC_IO: it cannot be created; SPC_NO_MEMORY
 */
enum spc_status spv_whole_begin(struct spv_whole_file *f, const char *path, const char *what, struct spc_error *err);

/*
 * Ends it, in any case: with status SPC_OK and no write that failed the file takes its name, else nothing is left of
 * it. Returns status, or what has failed since.
 */
enum spc_status spv_whole_end(struct spv_whole_file *f, enum spc_status status, const char *what,
                              struct spc_error *err);

#endif
