/* count.h - what a frame draws, counted on the processor with the shader's own arithmetic. */
#ifndef SPV_COUNT_H
#define SPV_COUNT_H

#include "select.h"

struct spv_count {
    uint64_t nodes_processed;       /* in the chosen blocks */
    uint64_t nodes_drawn;           /* splats that pass their tests */
    uint64_t triangles_drawn;
    uint64_t bytes_read;            /* chunks of the chosen blocks, and the head */
};

/* fails as spc_block_decode */
enum spc_status spv_count(const struct spc_reader *reader, const struct spv_view *view,
                          const struct spv_selection *selection, struct spv_count *out,
                          struct spc_error *err);

#endif
