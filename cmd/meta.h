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

/* The array sources[] of the options' facts, by the last parts of paths. */
json_t *meta_sources(const struct spb_build_options *options);

/*
 * How the archive's coordinates, which are the scan's own, lie in the world: world = scale x + offset,
 * in unit and CRS; up is an axis of the archive's. Facts for those who read the archive: no stored
 * value depends on them.
 */
struct meta_coordinates {
    bool has_offset, has_scale;
    double offset[3], scale;
    char up[4], unit[16], crs[24];  /* "z", "-y"; "m"; "EPSG:25832"; or "" */
};

/* The metadata's coordinates, as far as they are there and make sense. */
void meta_read_coordinates(const json_t *meta, struct meta_coordinates *out);

/* Takes over from other what c does not say. */
void meta_default_coordinates(struct meta_coordinates *c, const struct meta_coordinates *other);

/* What the vertices' lattice has changed in the scan, and where it is not the header's. */
struct meta_coding {
    uint64_t moved, flat;           /* triangles: as struct spb_shapes */
    double least, most;             /* file units */
    double coarsest_step;           /* file units: of the lattice where it is coarsest */
};

/* As far as it is there and makes sense; else nothing has changed, on the header's lattice. */
void meta_read_coding(const json_t *meta, const struct spc_header *header, struct meta_coding *out);

/* NULL when there is nothing to say. */
json_t *meta_coding_json(const struct spb_build_report *report);

/* The whole object; takes the reference to sources. coordinates may be NULL. NULL without memory. */
json_t *meta_new(const char *tool, const struct spb_build_options *options,
                 const struct spc_header *header, const struct meta_coordinates *coordinates,
                 json_t *sources);

/* An object's text as flags of json_dumps say, from malloc, and its end; NULL without memory. */
char *meta_text(json_t *meta, size_t flags);

#endif
