/* scan_seeds.h - the scans that changes begin with: small ones, of every kind that readers know. */
#ifndef SCAN_SEEDS_H
#define SCAN_SEEDS_H

#include "scan_case.h"

enum { SCAN_PLY, SCAN_STL, SCAN_OFF, SCAN_OBJ, SCAN_FORMATS };

static const char *const scan_seed_names[SCAN_FORMATS] = { "ply", "stl", "off", "obj" };

/* Scan k of a format, to be freed; false when there are only k. All can be read. */
bool scan_seed(int format, uint32_t k, struct file_text *out);

#endif
