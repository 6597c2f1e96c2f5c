#include "usage.h"

#include "cli.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

/* VmHWM: unlike the figure of getrusage it is this program's alone, not that of who started it. */
static uint64_t peak_resident(void)
{
    char line[256];
    unsigned long long kib = 0;
    FILE *f = fopen("/proc/self/status", "r");
    while (f != NULL && fgets(line, sizeof line, f) != NULL)
        if (sscanf(line, "VmHWM: %llu kB", &kib) == 1)
            break;
    if (f != NULL)
        fclose(f);
    return (uint64_t)kib * 1024;
}

static uint64_t number_in(const char *path)
{
    unsigned long long v = 0;
    FILE *f = fopen(path, "r");
    if (f == NULL)
        return 0;
    if (fscanf(f, "%llu", &v) != 1)
        v = 0;
    fclose(f);
    return (uint64_t)v;
}

/* "0::/path" is version 2, "4:memory:/path" version 1; the root group has no figure of its own. */
static uint64_t peak_of_group(void)
{
    char line[512], path[640];
    uint64_t peak = 0;
    FILE *f = fopen("/proc/self/cgroup", "r");
    while (f != NULL && peak == 0 && fgets(line, sizeof line, f) != NULL) {
        line[strcspn(line, "\n")] = '\0';
        char *name = strchr(line, ':'), *group = name ? strchr(name + 1, ':') : NULL;
        if (group == NULL || strcmp(group, ":/") == 0)
            continue;
        *group++ = '\0';
        if (strcmp(name, ":memory") == 0)
            snprintf(path, sizeof path, "/sys/fs/cgroup/memory%s/memory.max_usage_in_bytes", group);
        else if (strcmp(name, ":") == 0)
            snprintf(path, sizeof path, "/sys/fs/cgroup%s/memory.peak", group);
        else
            continue;
        peak = number_in(path);
    }
    if (f != NULL)
        fclose(f);
    return peak;
}

static double seconds_of(struct timeval t)
{
    return (double)t.tv_sec + (double)t.tv_usec * 1e-6;
}

double usage_cpu_seconds(void)
{
    struct rusage use;
    getrusage(RUSAGE_SELF, &use);
    return seconds_of(use.ru_utime) + seconds_of(use.ru_stime);
}

struct usage usage_since(double began, double cpu_before)
{
    return (struct usage){cli_seconds() - began, usage_cpu_seconds() - cpu_before, peak_resident(),
                          peak_of_group()};
}
