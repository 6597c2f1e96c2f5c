/*
 * info.h - the parts of spc-info: tables of the directory, histograms over nodes and clusters, bytes
 * and the precision they buy.
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

/* ---- recovery ---------------------------------------------------------------------------------- */

/*
 * Builds out from what is whole of the archive path and tells what was lost, as text or one JSON
 * object. Returns the exit code: EXIT_DONE all was there, EXIT_FAILED with loss or for another
 * reason that it tells, EXIT_INVALID nothing to recover.
 */
int info_recover(const char *path, const char *out, bool force, bool json);

/* ---- blocks: memory is that of the largest ------------------------------------------------------ */

struct info_block {
    uint32_t index;
    struct spc_block block;
    struct spc_block_layout layout;
    const uint8_t *payload;         /* decoded, its checksum held */
};
typedef enum spc_status (*info_block_fn)(void *ctx, const struct info_block *block,
                                         struct spc_error *err);

/* Calls fn for every block in file order; ends with the first status that is not SPC_OK. */
enum spc_status info_walk(const struct spc_reader *r, const char *phase, info_block_fn fn,
                          void *ctx, struct spc_error *err);

/* ---- histograms -------------------------------------------------------------------------------- */

enum info_of { INFO_NOTHING, INFO_E, INFO_RADIUS, INFO_NORMALS, INFO_SIZE };

/* False for a word that is none of e, radius, normals, size. */
bool info_histogram_of(const char *word, enum info_of *of);

enum { INFO_BINS_MAX = 512 };
struct info_histogram {
    enum info_of of;
    uint32_t bin_count;
    int first_octave, steps;        /* of octaves: the first one, bins in each */
    uint64_t total;
    struct info_bin {
        uint64_t count[2];          /* by enum spc_block_kind; of clusters, all in the first */
        double min, max;            /* octaves: file units, or bytes; a bin of zeros has both 0 */
        double axis[3];             /* directions */
    } bins[INFO_BINS_MAX];
};

/*
 * Counts; of nodes, by decoding one block after another into a buffer for the largest.
 * fails  SPC_NO_MEMORY, and as spc_block_decode
 */
enum spc_status info_histogram_fill(const struct spc_reader *r, enum info_of of,
                                    struct info_histogram *out, struct spc_error *err);
void info_histogram_print(const struct spc_reader *r, const struct info_histogram *hist);
json_t *info_histogram_json(const struct info_histogram *hist);

/* ---- bytes, and the precision they buy ----------------------------------------------------------- */

struct info_excess {                /* shares by which a code may exceed its value */
    double radius, error;           /* of the value */
    double height;                  /* of the radius */
    double normal_deg;              /* half way between directions that are used */
};

struct info_bytes {
    uint64_t streams[SPC_STREAM_COUNT];         /* of all blocks */
    uint64_t head, total;           /* head: up to the first chunk; total: the file */
    double vertex_step, vertex_moved;           /* file units: lattice, and half its diagonal */
    double leaf_radius, leaf_edge;  /* medians, file units; edge: the longest of a leaf */
    double diagonal;                /* of the box, file units */
    double center_step, center_step_median;     /* of inner nodes, shares of their radii */
    uint64_t centers_measured, inner_count;
    struct info_excess excess[2];   /* by enum spc_block_kind */
};

/* One pass. fails  SPC_NO_MEMORY, and as spc_block_decode */
enum spc_status info_bytes_fill(const struct spc_reader *r, struct info_bytes *out,
                                struct spc_error *err);
void info_bytes_print(const struct spc_reader *r, const struct info_bytes *b);
json_t *info_bytes_json(const struct spc_reader *r, const struct info_bytes *b);

/* Head and root cluster, which follow each other: all that a first picture needs. */
uint64_t info_first_picture(const struct spc_reader *r);

#endif
