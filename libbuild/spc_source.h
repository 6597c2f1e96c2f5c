/*
 * spc_source.h - an .spc archive as a scan: the triangles of its leaves, the vertices of its blocks.
 *
 * Vertices are points of the archive's lattice, exactly. Blocks do not share them: a vertex on a
 * border between blocks comes once with each.
 */
#ifndef SPB_SPC_SOURCE_H
#define SPB_SPC_SOURCE_H

#include "source_int.h"

/* Whole archives: the first fault that is met is the error, as the format library tells it. */
extern const struct spb_format spb_spc_format;

/*
 * The same for a damaged archive, its open: searches the file for whole blocks, whatever its head,
 * and gives what they hold. info->salvage tells what that is.
 * fails  SPC_INPUT_EMPTY (no triangle is left), SPC_VERSION, SPC_FEATURE, SPC_IO, SPC_NO_MEMORY,
 *        SPC_CANCELLED
 */
enum spc_status spb_spc_salvage(struct spb_bytes *bytes, const struct spb_source_options *options,
                                struct spb_source_info *info, void **state, struct spc_error *err);

#endif
