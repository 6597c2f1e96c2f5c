/* meta.h - the metadata of archives that the tools build (spec section 3). */
#ifndef META_H
#define META_H

#include "build.h"

#include <jansson.h>

/* A file name as JSON: names are bytes, JSON is UTF-8; what is not becomes '?'. */
json_t *meta_name(const char *name);

/* An entry of sources[], by the last part of the path. */
json_t *meta_source(const char *path, const char *format, uint64_t vertices, uint64_t faces);

/* The whole object; takes the reference to sources. NULL without memory. */
json_t *meta_new(const char *tool, const struct spb_build_options *options,
                 const struct spc_header *header, json_t *sources);

/* Its text, from malloc, and the end of the object. */
char *meta_text(json_t *meta);

#endif
