/*
 * distribute.h - face records on disk, by the cell of a grid their key lies in.
 *
 * A bucket is one cell's records, in input order. The cells are those of the fixed lattice that
 * splitting uses (split.h), so a set of buckets can be split without reading it, as long as it is
 * at least two cells wide.
 */
#ifndef SPB_DISTRIBUTE_H
#define SPB_DISTRIBUTE_H

#include "space.h"
#include "spill.h"

struct spb_bucket {
    struct spb_pile pile;
    double min[3], max[3];          /* tight box of the keys */
    int cell_exp;                   /* cells are 2^cell_exp units wide */
};

struct spb_distributor {
    struct spb_spill spill;
    struct spb_record_format format;
    int cell_exp;
    double per_cell;                /* 2^-cell_exp, 0 for one cell */
    double first[3];                /* number of the first cell, per axis */
    uint32_t dim[3];
    struct spb_bucket **cells;      /* [dim x * y * z], NULL where nothing fell */
    struct spb_bucket **buckets;    /* [bucket_count] the cells in use, by first use */
    uint32_t bucket_count, bucket_max;
};

/*
 * A grid over keys in [min, max]: cells of 2^-cells_log2 of the longest side or a little larger;
 * 0 puts everything into one bucket. cells_log2 <= SPB_CELLS_LOG2_MAX. Extents are as long as
 * memory bytes allow: about twice memory / cells in use. fails SPC_NO_MEMORY
 */
enum { SPB_CELLS_LOG2_MAX = 6 };
enum spc_status spb_distributor_init(struct spb_distributor *d, struct spb_tmpfile *file,
                                     const struct spb_record_format *format, const double min[3],
                                     const double max[3], int cells_log2, uint64_t memory,
                                     struct spc_error *err);

/*
 * Cells for records that are to be parted: four along a part, whose split planes are a quarter of a
 * box's side apart; a surface of n parts is about sqrt(n) parts wide.
 */
int spb_cells_for_parts(uint64_t parts);

/* The finest cells, up to cells_log2, of which memory has a quarter page for each if all are used. */
int spb_cells_within(int cells_log2, uint64_t memory);

/* Numbers of the cells that keys lie in; of each key three values are looked at. Any thread. */
void spb_distributor_cells(const struct spb_distributor *d, const double (*keys)[4],
                           uint32_t count, uint32_t *cells);

/* Appends one record, whose key lies in cell. fails SPC_IO, SPC_NO_MEMORY */
enum spc_status spb_distributor_add(struct spb_distributor *d, uint32_t cell, const double key[3],
                                    const uint8_t *record, struct spc_error *err);

/* Writes what is buffered and frees the buffers. The buckets are complete then. */
enum spc_status spb_distributor_flush(struct spb_distributor *d, struct spc_error *err);

/* Frees everything but the buckets, which the caller takes over (spb_bucket_free). */
void spb_distributor_release(struct spb_distributor *d);
void spb_bucket_free(struct spb_bucket *bucket);

#endif
