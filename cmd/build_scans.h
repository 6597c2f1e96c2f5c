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
 * Adds a file as it is; of a folder the plain files in it that are named *.ply, *.obj, *.stl or *.off, in
 * the order of their names. fails  SPC_NO_MEMORY, SPC_IO, SPC_INPUT_EMPTY (a folder without a scan)
 */
enum spc_status build_scans_add(struct build_scans *scans, const char *name, struct spc_error *err);

/*
 * Adds what a list names, a file or folder a line; "-" is standard input. Blank lines and those that
 * begin with # are none, nor is a byte order mark at its begin a part of a name. each: called for
 * every name. fails  SPC_IO, SPC_NO_MEMORY, those of each
 */
typedef enum spc_status (*build_scans_fn)(void *ctx, const char *name, struct spc_error *err);
enum spc_status build_scans_list(const char *list, build_scans_fn each, void *ctx,
                                 struct spc_error *err);

void build_scans_free(struct build_scans *scans);

struct build_target {
    char *path;
    bool taken;                     /* the archive of an earlier scan is called the same */
};

/*
 * The archives of all scans, in folder: their names with .spc for the ending, or behind it where
 * another scan's archive would be called the same. [count]; NULL without memory.
 */
struct build_target *build_scans_targets(const struct build_scans *scans, const char *folder);
void build_scans_targets_free(struct build_target *targets, size_t count);

#endif
