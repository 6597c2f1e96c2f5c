/*
 * resident.h - which blocks are kept, decoded, and what stands in for those that are not there yet.
 *
 * Threads read and decode, the caller's thread does all else and never waits. A frame gets what is there:
 * of a cluster with missing blocks those before the first missing one, whose nodes are drawn down to a
 * coarser error, or its tops out of the directory: no path is without a node, whatever is missing.
 *
 *   frame  what can be drawn now, and which clusters miss something
 *   (the caller draws, and learns which of these clusters could not be seen anyway)
 *   ask    for what is missing and could be seen; gives up what is needed least
 *
 * src  [Oka04] 3.1: prefixes; the rule of what stands in: spec section 9
 */
#ifndef SPV_RESIDENT_H
#define SPV_RESIDENT_H

#include "draw.h"

struct spv_resident_options {
    uint64_t budget;                /* bytes that decoded blocks may take; what is on its way counts */
    uint64_t upload_bytes;          /* that are given to the store in a frame, but for one block; 0: all */
    unsigned threads;               /* that read and decode, 1..64 */
    struct spv_store store;         /* where blocks are kept; keep NULL: in plain memory */
    /* Fills payload[raw_bytes] of a block, on any thread; NULL: decoded, and sorted as kept.h says. For tests. */
    enum spc_status (*decode)(void *ctx, const struct spc_reader *reader, uint32_t block,
                              uint8_t *payload, struct spc_error *err);
    void *decode_ctx;
};

struct spv_resident_frame {
    struct spv_part part;           /* its hidden is there to be written to */
    uint32_t missing;               /* wanted blocks that are not here yet */
    uint32_t failed;                /* of them, those whose last read failed */
    uint64_t read_bytes;            /* of chunks that came since the last frame */
    uint64_t resident_bytes;        /* decoded, now */
};

struct spv_resident;

/* reader and store must live as long. fails SPC_NO_MEMORY */
enum spc_status spv_resident_create(const struct spc_reader *reader,
                                    const struct spv_resident_options *options,
                                    struct spv_resident **out, struct spc_error *err);
void spv_resident_free(struct spv_resident *resident);      /* waits for reads under way */

/*
 * A frame of the selection: takes in what has been read, and says what can be drawn. The frame is
 * resident's; it and what it names hold until the next call.
 */
struct spv_resident_frame *spv_resident_frame(struct spv_resident *resident,
                                              const struct spv_selection *selection);

/*
 * Asks for what the last frame missed, coarse first, but for clusters whose hidden is set; gives up what is
 * needed least where memory is short.
 */
void spv_resident_ask(struct spv_resident *resident);

/* Asks for blocks that will be wanted soon, after those that are wanted now; fills idle threads only. */
void spv_resident_prefetch(struct spv_resident *resident, const struct spv_selection *selection);

/* Blocks that the last frame missed and that are not asked for, because they could not be seen. */
uint32_t spv_resident_hidden(const struct spv_resident *resident);

/* Reads under way. */
unsigned spv_resident_busy(const struct spv_resident *resident);

/* Waits until some read has ended; false when none is under way. */
bool spv_resident_wait(struct spv_resident *resident);

/* The error that was met last, and its block; *err is all zero when there was none. */
uint32_t spv_resident_error(const struct spv_resident *resident, struct spc_error *err);

#endif
