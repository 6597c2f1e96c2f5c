/* usage.h - what a run has cost: time, and memory at its most. */
#ifndef USAGE_H
#define USAGE_H

#include <stdint.h>

struct usage {
    double wall_s, cpu_s;           /* cpu: of all threads, system calls included */
    uint64_t peak_bytes;            /* resident memory at its most */
    uint64_t group_bytes;           /* the control group's at its most, page cache included; 0: in none */
};

/* began: of cli_seconds */
struct usage usage_since(double began);

#endif
