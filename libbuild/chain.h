/*
 * chain.h - several scans as one source, one behind the other.
 */
#ifndef SPB_CHAIN_H
#define SPB_CHAIN_H

#include "source.h"

/*
 * Vertices of all members in their order, and faces with vertices counted on. A member's corner
 * that names no vertex of its own is bad, whatever the next one holds. What only some members
 * have, such as colours, the others get as white; what only archives promise holds no more.
 *
 * in     members  [count], at least 1; the caller closes them after the chain
 * fails  SPC_NO_MEMORY
 */
enum spc_status spb_source_chain(struct spb_source *const *members, uint32_t count,
                                 struct spb_source **out, struct spc_error *err);

/* Which member the last call was about: whose fault an error is. 0 of a source that is no chain. */
uint32_t spb_source_member(const struct spb_source *source);

#endif
