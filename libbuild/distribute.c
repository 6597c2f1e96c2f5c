#include "distribute.h"

#include "vec.h"
#include "vectors.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int spb_cells_for_parts(uint64_t parts)
{
    int log2 = 2;
    if (parts <= 1)
        return 0;
    while (log2 < SPB_CELLS_LOG2_MAX && (uint64_t)1 << 2 * (log2 - 2) < parts)
        log2++;
    return log2;
}

/*
 * A grid of 2^n cells along the longest side touches up to 2^n + 1 an axis. A surface fills a
 * tenth of them; loose triangles may fill all.
 */
int spb_cells_within(int cells_log2, uint64_t memory)
{
    for (; cells_log2 > 0; cells_log2--) {
        const uint64_t side = ((uint64_t)1 << cells_log2) + 1;
        if (side * side * side * (SPB_PAGE_BYTES / 4) <= memory)
            break;
    }
    return cells_log2;
}

enum spc_status spb_distributor_init(struct spb_distributor *d, struct spb_tmpfile *file,
                                     const struct spb_record_format *format, const double min[3],
                                     const double max[3], int cells_log2, uint64_t memory,
                                     struct spc_error *err)
{
    *d = (struct spb_distributor){.format = *format, .dim = {1, 1, 1}};
    double side = 0;
    for (int a = 0; a < 3; a++)
        side = larger_of(side, max[a] - min[a]);
    if (cells_log2 > 0 && side > 0) {
        frexp(side, &d->cell_exp);
        d->cell_exp -= cells_log2;
        d->per_cell = times_exp2(1, -d->cell_exp);
        for (int a = 0; a < 3; a++) {
            d->first[a] = floor(min[a] * d->per_cell);
            d->dim[a] = (uint32_t)(floor(max[a] * d->per_cell) - d->first[a]) + 1;
        }
    } else {
        d->cell_exp = 1024;         /* one cell holds everything: never two cells wide */
    }
    d->cells = calloc((size_t)d->dim[0] * d->dim[1] * d->dim[2], sizeof *d->cells);
    if (d->cells == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for the grid of parts");
    return spb_spill_init(&d->spill, file, format->bytes, memory, err);
}

SPB_VECTORS void spb_distributor_cells(const struct spb_distributor *d, const double (*keys)[4],
                                       uint32_t count, uint32_t *cells)
{
    double last[3], stride[3] = {1, d->dim[0], (double)d->dim[0] * d->dim[1]};
    for (int a = 0; a < 3; a++)
        last[a] = d->dim[a] - 1;
    for (uint32_t i = 0; i < count; i++) {
        double cell = 0;
        for (int a = 0; a < 3; a++) {
            const double k = floor(keys[i][a] * d->per_cell) - d->first[a];
            cell += (k > 0 ? smaller_of(k, last[a]) : 0) * stride[a];
        }
        cells[i] = (uint32_t)(int32_t)cell;
    }
}

static struct spb_bucket *bucket_create(struct spb_distributor *d, struct spc_error *err)
{
    if (d->bucket_count == d->bucket_max) {
        const uint32_t grown = d->bucket_max ? 2 * d->bucket_max : 64;
        struct spb_bucket **buckets = realloc(d->buckets, grown * sizeof *buckets);
        if (buckets == NULL)
            return NULL;
        d->buckets = buckets;
        d->bucket_max = grown;
    }
    struct spb_bucket *b = calloc(1, sizeof *b);
    if (b == NULL)
        return NULL;
    if (spb_spill_pile(&d->spill, &b->pile, err) != SPC_OK) {
        free(b);
        return NULL;
    }
    b->cell_exp = d->cell_exp;
    for (int a = 0; a < 3; a++) {
        b->min[a] = INFINITY;
        b->max[a] = -INFINITY;
    }
    d->buckets[d->bucket_count++] = b;
    return b;
}

enum spc_status spb_distributor_add(struct spb_distributor *d, uint32_t cell, const double key[3],
                                    const uint8_t *record, struct spc_error *err)
{
    struct spb_bucket *b = d->cells[cell];
    if (b == NULL)
        b = d->cells[cell] = bucket_create(d, err);
    if (b == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a part");
    for (int a = 0; a < 3; a++) {
        b->min[a] = smaller_of(key[a], b->min[a]);
        b->max[a] = larger_of(key[a], b->max[a]);
    }
    return spb_spill_put(&d->spill, &b->pile, record, err);
}

enum spc_status spb_distributor_flush(struct spb_distributor *d, struct spc_error *err)
{
    return spb_spill_settle(&d->spill, err);
}

void spb_distributor_release(struct spb_distributor *d)
{
    spb_spill_release(&d->spill);
    free(d->cells);
    free(d->buckets);
    *d = (struct spb_distributor){0};
}

void spb_bucket_free(struct spb_bucket *bucket)
{
    if (bucket == NULL)
        return;
    spb_pile_release(&bucket->pile);
    free(bucket);
}
