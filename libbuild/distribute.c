#include "distribute.h"

#include "vec.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BUFFER_BYTES = 8192 };

uint32_t spb_extent_records(uint32_t record_bytes)
{
    return BUFFER_BYTES / record_bytes;
}

/*
 * A grid of 2^n cells along the longest side touches up to 2^n + 1 an axis. A surface fills a
 * tenth of them, but loose triangles may fill all: with 64^3 cells 2.2 GB of buffers.
 */
static int cells_within(int cells_log2, uint64_t memory)
{
    for (; cells_log2 > 0; cells_log2--) {
        const uint64_t side = ((uint64_t)1 << cells_log2) + 1;
        if (side * side * side * BUFFER_BYTES <= memory)
            break;
    }
    return cells_log2;
}

enum spc_status spb_distributor_init(struct spb_distributor *d, struct spb_tmpfile *file,
                                     const struct spb_record_format *format, const double min[3],
                                     const double max[3], int cells_log2, uint64_t memory,
                                     struct spc_error *err)
{
    cells_log2 = cells_within(cells_log2, memory);
    *d = (struct spb_distributor){.file = file, .format = *format, .dim = {1, 1, 1}};
    d->buffer_records = spb_extent_records(format->bytes);
    double side = 0;
    for (int a = 0; a < 3; a++)
        side = larger_of(side, max[a] - min[a]);
    if (cells_log2 > 0 && side > 0) {
        frexp(side, &d->cell_exp);
        d->cell_exp -= cells_log2;
        for (int a = 0; a < 3; a++) {
            d->first[a] = floor(times_exp2(min[a], -d->cell_exp));
            d->dim[a] = (uint32_t)(floor(times_exp2(max[a], -d->cell_exp)) - d->first[a]) + 1;
        }
    } else {
        d->cell_exp = 1024;         /* one cell holds everything: never two cells wide */
    }
    d->cells = calloc((size_t)d->dim[0] * d->dim[1] * d->dim[2], sizeof *d->cells);
    if (d->cells == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for the grid of parts");
    return SPC_OK;
}

static size_t cell_of(const struct spb_distributor *d, const double key[3])
{
    size_t cell = 0;
    if (d->dim[0] == 1 && d->dim[1] == 1 && d->dim[2] == 1)
        return 0;
    for (int a = 3; a-- > 0;) {
        double i = floor(times_exp2(key[a], -d->cell_exp)) - d->first[a];
        if (!(i > 0))
            i = 0;
        if (i > d->dim[a] - 1)
            i = d->dim[a] - 1;
        cell = cell * d->dim[a] + (size_t)i;
    }
    return cell;
}

static struct spb_bucket *bucket_create(struct spb_distributor *d)
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
    b->buffer = malloc((size_t)d->buffer_records * d->format.bytes);
    if (b->buffer == NULL) {
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

static enum spc_status write_buffer(struct spb_distributor *d, struct spb_bucket *b,
                                    struct spc_error *err)
{
    if (b->extent_count == b->extent_max) {
        const uint32_t grown = b->extent_max ? 2 * b->extent_max : 4;
        uint64_t *extents = realloc(b->extents, grown * sizeof *extents);
        if (extents == NULL)
            return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for the list of parts");
        b->extents = extents;
        b->extent_max = grown;
    }
    const enum spc_status status =
        spb_tmpfile_append(d->file, b->buffer, (size_t)b->buffered * d->format.bytes,
                           &b->extents[b->extent_count], err);
    b->extent_count++;
    b->buffered = 0;
    return status;
}

enum spc_status spb_distributor_add(struct spb_distributor *d, const double key[3],
                                    const uint8_t *record, struct spc_error *err)
{
    struct spb_bucket **cell = &d->cells[cell_of(d, key)];
    if (*cell == NULL)
        *cell = bucket_create(d);
    struct spb_bucket *b = *cell;
    if (b == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a part");
    for (int a = 0; a < 3; a++) {
        b->min[a] = key[a] < b->min[a] ? key[a] : b->min[a];
        b->max[a] = key[a] > b->max[a] ? key[a] : b->max[a];
    }
    memcpy(b->buffer + (size_t)b->buffered * d->format.bytes, record, d->format.bytes);
    b->buffered++;
    b->count++;
    return b->buffered == d->buffer_records ? write_buffer(d, b, err) : SPC_OK;
}

enum spc_status spb_distributor_flush(struct spb_distributor *d, struct spc_error *err)
{
    for (uint32_t i = 0; i < d->bucket_count; i++) {
        struct spb_bucket *b = d->buckets[i];
        if (b->buffered > 0) {
            const enum spc_status status = write_buffer(d, b, err);
            if (status != SPC_OK)
                return status;
        }
        free(b->buffer);
        b->buffer = NULL;
    }
    return SPC_OK;
}

void spb_distributor_release(struct spb_distributor *d)
{
    free(d->cells);
    free(d->buckets);
    *d = (struct spb_distributor){0};
}

void spb_bucket_free(struct spb_bucket *bucket)
{
    if (bucket == NULL)
        return;
    free(bucket->extents);
    free(bucket->buffer);
    free(bucket);
}

enum spc_status spb_bucket_read(const struct spb_bucket *bucket, struct spb_tmpfile *file,
                                uint32_t record_bytes, uint64_t first, uint64_t count,
                                uint8_t *records, struct spc_error *err)
{
    const uint32_t per_extent = spb_extent_records(record_bytes);
    while (count > 0) {
        const uint64_t extent = first / per_extent;
        const uint64_t skip = first % per_extent;
        const uint64_t n = count < per_extent - skip ? count : per_extent - skip;
        const enum spc_status status =
            spb_tmpfile_read(file, bucket->extents[extent] + skip * record_bytes, records,
                             (size_t)(n * record_bytes), err);
        if (status != SPC_OK)
            return status;
        records += n * record_bytes;
        first += n;
        count -= n;
    }
    return SPC_OK;
}
