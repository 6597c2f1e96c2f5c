/*
 * detail.c - see detail.h.
 *
 * Scans of marching cubes have a few tiny triangles everywhere: up to 4 in 1000. A lattice for those
 * would cost every archive bytes and show nothing. So small faces count where they are many in their
 * cell.
 */
#include "detail.h"

#include "pool.h"
#include "vec.h"

#include <stdatomic.h>
#include <stdlib.h>

enum {
    SIDE = 1 << SPB_DETAIL_LOG2,
    CELLS = SIDE * SIDE * SIDE,
    BITS = 3, DEPTHS = 12,          /* finer by 3, 6, ... 36 bits: all that the limits leave */
    FACES_LEAST = 64, SHARE = 16,      /* many: so many, and 1 in 16 of the cell's */
    LEFT = 64,                      /* of these 1 in 64 may be too small even so */
    CHUNK = 1024,                   /* records read at once */
};

struct cell {
    atomic_uint faces;              /* with a corner here, */
    atomic_uint small[DEPTHS];      /* and those that need a finer lattice, by how much */
};

struct finding {
    const struct spb_detail_input *in;
    const struct spb_space *space;
    double least;                   /* squared longest edge, units */
    struct cell *cells;             /* [CELLS] */
};

/* ---- counting ---------------------------------------------------------------------------------- */

/* By how many bits the lattice is too coarse for a face whose squared longest edge is s; not below 1: it is. */
static int bits_short(const struct spb_space *space, double s)
{
    const int square = exponent_above(s) - 1;
    return spb_space_finest(space) + SPB_DETAIL_STEPS_LOG2 - (square - (square & 1)) / 2;
}

/* Corners in units; returns the squared longest edge. */
static double load_face(const struct finding *f, const uint8_t *record, double corner[3][3])
{
    double xyz[9], longest = 0;
    spb_record_corners(&f->in->format, f->space, record, xyz);
    for (int k = 0; k < 9; k++)
        corner[k / 3][k % 3] = spb_space_from_file(f->space, k % 3, xyz[k]);
    for (int k = 0; k < 3; k++) {
        double edge[3];
        vec_sub(corner[(k + 1) % 3], corner[k], edge);
        longest = larger_of(longest, vec_dot(edge, edge));
    }
    return longest;
}

static void count_face(struct finding *f, const uint8_t *record)
{
    double corner[3][3];
    const double s = load_face(f, record, corner);
    const int bits = s > 0 && s >= f->least ? bits_short(f->space, s) : 0;
    const int depth = (bits - 1) / BITS < DEPTHS ? (bits - 1) / BITS : DEPTHS - 1;
    uint32_t at[3];
    for (int k = 0; k < 3; k++) {
        at[k] = spb_space_cell(corner[k]);
        if ((k > 0 && at[k] == at[0]) || (k > 1 && at[k] == at[1]))
            continue;
        struct cell *cell = &f->cells[at[k]];
        atomic_fetch_add_explicit(&cell->faces, 1, memory_order_relaxed);
        if (bits > 0)
            atomic_fetch_add_explicit(&cell->small[depth], 1, memory_order_relaxed);
    }
}

static enum spc_status count_piece(struct finding *f, const struct spb_piece *piece, uint8_t *records,
                                   struct spc_error *err)
{
    const uint32_t bytes = f->in->format.bytes;
    struct spb_pile_reader reader = {&piece->bucket->pile, f->in->file, 0, 0};
    spb_pile_skip(&reader, piece->first * bytes);
    for (uint64_t done = 0; done < piece->count;) {
        const uint64_t n = piece->count - done < CHUNK ? piece->count - done : CHUNK;
        if (spb_pool_cancelled())
            return spc_fail(err, SPC_CANCELLED, SPC_NO_OFF, "cancelled");
        const enum spc_status status = spb_pile_read(&reader, records, n * bytes, err);
        if (status != SPC_OK)
            return status;
        for (uint64_t i = 0; i < n; i++)
            count_face(f, records + i * bytes);
        done += n;
    }
    return SPC_OK;
}

static enum spc_status count_part(void *ctx, size_t i, struct spc_error *err)
{
    struct finding *f = ctx;
    const struct spb_part *part = &f->in->plan->parts[i];
    uint8_t *records = malloc((size_t)CHUNK * f->in->format.bytes);
    enum spc_status status = SPC_OK;
    if (records == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to measure faces");
    for (uint32_t k = 0; k < part->piece_count && status == SPC_OK; k++)
        status = count_piece(f, &part->pieces[k], records, err);
    free(records);
    return status;
}

static int part_done(void *ctx, size_t done)
{
    const struct finding *f = ctx;
    return spb_progress_tell(f->in->progress, "measure detail", done, f->in->plan->part_count);
}

/* ---- choosing ---------------------------------------------------------------------------------- */

/* Bits by which a lattice must be finer for all but left of the cell's small faces. */
static uint8_t bits_for(const struct cell *cell, uint64_t left)
{
    uint64_t n = 0;
    for (int d = DEPTHS; d-- > 0;) {
        n += cell->small[d];
        if (n > left)
            return (uint8_t)(BITS * (d + 1));
    }
    return 0;
}

static uint8_t bits_of_cell(const struct finding *f, const struct cell *cell)
{
    uint64_t small = 0;
    for (int d = 0; d < DEPTHS; d++)
        small += cell->small[d];
    if (f->in->size >= 0)
        return bits_for(cell, 0);
    return small >= FACES_LEAST && small >= cell->faces / SHARE ? bits_for(cell, small / LEFT) : 0;
}

/* The finest that a neighbour has: a small face reaches no further. */
static uint8_t bits_around(const uint8_t *bits, int cell)
{
    const int at[3] = {cell % SIDE, cell / SIDE % SIDE, cell / SIDE / SIDE};
    uint8_t most = 0;
    for (int k = 0; k < 27; k++) {
        const int x = at[0] + k % 3 - 1, y = at[1] + k / 3 % 3 - 1, z = at[2] + k / 9 - 1;
        if (x < 0 || y < 0 || z < 0 || x >= SIDE || y >= SIDE || z >= SIDE)
            continue;
        const uint8_t there = bits[(z * SIDE + y) * SIDE + x];
        most = there > most ? there : most;
    }
    return most;
}

/* Bits by which each cell is finer, and the most of them. Faces that reach over a border keep both ends. */
static int choose_bits(const struct finding *f, uint8_t *own, uint8_t *out)
{
    int most = 0;
    for (int i = 0; i < CELLS; i++) {
        own[i] = bits_of_cell(f, &f->cells[i]);
        most = own[i] > most ? own[i] : most;
    }
    for (int i = 0; i < CELLS && most > 0; i++) {
        const uint8_t all = bits_for(&f->cells[i], 0);
        const uint8_t around = all > own[i] ? bits_around(own, i) : 0;
        const uint8_t shared = all < around ? all : around;
        out[i] = shared > own[i] ? shared : own[i];
    }
    return most;
}

/* From bits by which a cell is finer to those by which it is coarser than the finest. */
static void refine(struct spb_space *space, int most, uint8_t *cells)
{
    const int coarse = space->vertex_exp;
    spb_space_refine(space, most);
    const int got = coarse - space->vertex_exp;
    for (int i = 0; i < CELLS; i++)
        cells[i] = (uint8_t)(got - (cells[i] < got ? cells[i] : got));
    space->cells = got > 0 ? cells : NULL;
}

static bool any_to_find(const struct spb_detail_input *in, const struct spb_space *space)
{
    const int size_exp = spb_space_finest(space) + SPB_DETAIL_STEPS_LOG2;
    const uint64_t small = spb_survey_smaller(in->survey, size_exp);
    if (spb_space_limit(space) >= space->vertex_exp)
        return false;
    return in->size < 0 ? small >= FACES_LEAST : small > 0 && in->size < times_exp2(1, size_exp);
}

enum spc_status spb_detail_find(const struct spb_detail_input *in, struct spb_space *space,
                                uint8_t **cells, struct spc_error *err)
{
    struct finding f = {in, space, larger_of(in->size, 0) * larger_of(in->size, 0), NULL};
    *cells = NULL;
    if (!any_to_find(in, space))
        return SPC_OK;
    uint8_t *own = calloc(CELLS, 1), *out = calloc(CELLS, 1);
    f.cells = calloc(CELLS, sizeof *f.cells);
    enum spc_status status = SPC_OK;
    if (own == NULL || out == NULL || f.cells == NULL)
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to measure faces");
    if (status == SPC_OK)
        status = spb_pool_run(in->plan->part_count, in->threads, count_part, part_done, &f, err);
    const int most = status == SPC_OK ? choose_bits(&f, own, out) : 0;
    free(f.cells);
    free(own);
    if (most > 0)
        refine(space, most, out);
    if (space->cells == out)
        *cells = out;
    else
        free(out);
    return status;
}
