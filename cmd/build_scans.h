/* build_scans.h - which scans a command line of spc-build names, and what their archives are called. */
#ifndef BUILD_SCANS_H
#define BUILD_SCANS_H

#include "spc.h"

struct build_scans {                /* all zero: none */
    char **path;                    /* [count] */
    size_t count, room;
    size_t passed_over;             /* files of folders whose names are no scan's */
    bool from_stdin;                /* one of them is "-" */
};

/*
 * Adds a file as it is; of a folder the files in it that are named *.ply, *.obj, *.stl or *.off, in
 * the order of their names. fails  SPC_NO_MEMORY, SPC_IO, SPC_INPUT_EMPTY (a folder without a scan)
 */
enum spc_status build_scans_add(struct build_scans *scans, const char *name, struct spc_error *err);

/*
 * Adds what a list names, a file or folder a line; "-" is standard input. Blank lines and those that
 * begin with # are none. each: called for every name. fails  SPC_IO, SPC_NO_MEMORY, those of each
 */
typedef enum spc_status (*build_scans_fn)(void *ctx, const char *name, struct spc_error *err);
enum spc_status build_scans_list(const char *list, build_scans_fn each, void *ctx,
                                 struct spc_error *err);

void build_scans_free(struct build_scans *scans);

/*
 * The archive of scan i in folder: its name with .spc for its ending, or behind it where another
 * scan's archive would be called the same. From malloc; NULL without memory.
 */
char *build_scans_target(const struct build_scans *scans, size_t i, const char *folder);

#endif
