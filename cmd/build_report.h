/* build_report.h - what spc-build says of a build: warnings, summary, JSON, and what to do about errors. */
#ifndef BUILD_REPORT_H
#define BUILD_REPORT_H

#include "meta.h"
#include "usage.h"

struct build_result {
    const struct spb_build_options *options;
    const struct spb_scan_facts *facts;         /* [1 + options->more_count] */
    struct spb_build_report report;
    struct usage usage;
};

/* Faces that were dropped, what readers passed over, digits that were spent. */
void build_warn(const struct build_result *r);

/* For people, on stderr: lines about one archive; or, in a batch, one line. */
void build_print_summary(const struct build_result *r);
void build_print_line(const struct build_result *r, size_t number, size_t of);

/* The object of --json. NULL without memory: meta_no_memory. */
json_t *build_json(const struct build_result *r);

/* "name: fault; remedy" for an error of spb_build about a file. The text lives until the next call. */
const char *build_remedy(const struct build_result *r, const struct spc_error *err, bool in_scan);

#endif
