/* verify_int.h - how the levels of verification report. */
#ifndef SPC_VERIFY_INT_H
#define SPC_VERIFY_INT_H

#include "format_int.h"

struct spc_check {                  /* one invariant under test */
    spc_finding_fn fn;
    void *ctx;
    const char *invariant;
    uint64_t places;                /* where it broke, counted */
    struct spc_error *total;        /* the first fault of all invariants */
};

void spc_check_begin(struct spc_check *check, spc_finding_fn fn, void *ctx, const char *invariant);
void spc_check_fault(struct spc_check *check, enum spc_status status, uint64_t at_off,
                     const char *what);
void spc_check_end(struct spc_check *check);    /* reports "ok" unless a fault was reported */

/* Level 3. Faults go into total; the return value is a failure to verify at all. */
enum spc_status spc_verify_tree(const struct spc_reader *reader, spc_finding_fn fn, void *ctx,
                                struct spc_error *total, struct spc_error *err);

#endif
