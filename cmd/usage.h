/* usage.h - what a run has cost: time, and memory at its most. */
#ifndef USAGE_H
#define USAGE_H

#include <stdint.h>

struct usage {
    double wall_s, cpu_s;           /* cpu: of all threads, system calls included */
    uint64_t peak_bytes;            /* resident memory at its most */
    uint64_t group_bytes;           /* the control group's at its most, page cache included; 0: in none */
};

double usage_cpu_seconds(void);

/* began: of cli_seconds; cpu_before: of usage_cpu_seconds then */
struct usage usage_since(double began, double cpu_before);

#endif
