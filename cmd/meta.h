/* meta.h - the metadata of archives that the tools build (spec section 3), and JSON as a whole. */
#ifndef META_H
#define META_H

#include "build.h"

#include <jansson.h>

/*
 * Objects of JSON are made of many small allocations, and one that fails leaves out a member. So
 * failures are counted from meta_init on: text may be shown unless meta_no_memory.
 */
void meta_init(void);
bool meta_no_memory(void);

/* A file name as JSON: names are bytes, JSON is UTF-8; what is not becomes '?'. */
json_t *meta_name(const char *name);

/* An entry of sources[], by the last part of the path. */
json_t *meta_source(const char *path, const char *format, uint64_t vertices, uint64_t faces);

/* The whole object; takes the reference to sources. NULL without memory. */
json_t *meta_new(const char *tool, const struct spb_build_options *options,
                 const struct spc_header *header, json_t *sources);

/* An object's text as flags of json_dumps say, from malloc, and its end; NULL without memory. */
char *meta_text(json_t *meta, size_t flags);

#endif
