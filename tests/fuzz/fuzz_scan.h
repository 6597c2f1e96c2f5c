/*
 * fuzz_scan.h - one target for every scan reader: any bytes as a scan of one format.
 *
 * Besides what fuzz.h says, holds the reader to what source.h promises: batches in their limits,
 * counts as told, I11, every pass the same when it is begun again, and the same for any size of
 * what a read gives. Files stay in memory, batches are static: a run takes microseconds.
 */
#ifndef FUZZ_SCAN_H
#define FUZZ_SCAN_H

#include "source_int.h"

int fuzz_scan(const struct spb_format *format, const uint8_t *bytes, size_t size);

#endif
