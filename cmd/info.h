/*
 * info.h - the parts of spc-info: tables of the directory.
 *
 * Text goes to stdout in columns that one may cut by spaces; lengths in text are in a power of a
 * thousand file units that suits the archive and is named above them. JSON is in file units.
 */
#ifndef INFO_H
#define INFO_H

#include "cli.h"

#include <jansson.h>

/* ---- lengths ----------------------------------------------------------------------------------- */

double info_file_units(const struct spc_header *h, double units);

/* File units of one shown unit: the smallest errors get digits, the largest side fits a column. */
double info_scale(const struct spc_header *h);

/* "file units" or "0.001 file units". */
const char *info_scale_text(double scale, char text[CLI_TEXT]);

/* At most 6 characters, three digits where they fit; v >= 0, infinity included. */
const char *info_length_text(double v, char text[CLI_TEXT]);

/* JSON has no infinity: null, as the root's e_parent. */
json_t *info_length_json(double file_units);

/* ---- tables: memory does not grow with their length --------------------------------------------- */

void info_print_clusters(const struct spc_reader *r);
void info_print_blocks(const struct spc_reader *r, uint32_t cluster);

/* Members of an object that is being printed: they begin with its comma. */
void info_json_clusters(const struct spc_reader *r);
void info_json_blocks(const struct spc_reader *r, uint32_t cluster);

#endif
