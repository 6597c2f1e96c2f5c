/* build_run.h - what spc-build was asked for, and doing it: one archive, or one of each scan. */
#ifndef BUILD_RUN_H
#define BUILD_RUN_H

#include "cli.h"
#include "meta.h"

struct build_run {
    struct spb_build_options build; /* scans, facts and callbacks are the run's to set; out, unless out_dir */
    enum cli_progress_mode progress;
    bool json, quiet;
    bool update;                    /* with out_dir: scans older than their archives are passed over */
    const struct spb_build_report *report;      /* of the archive under way */
    const char *out_dir;            /* NULL: one archive of all scans */
    const char *list;               /* file that names further scans, or NULL */
    struct meta_coordinates coordinates;
};

/* names: of scans and folders, ends with NULL. Says what it does and what fails; returns the exit code. */
int build_run(struct build_run *run, char **names);

#endif
