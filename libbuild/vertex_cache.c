#include "vertex_cache.h"

#include <stdlib.h>
#include <string.h>

enum {
    PIECE_LOG2 = 12,                /* vertices */
    PIECES_MIN = 16,
    ALLOWED_BYTES = 32 << 20,       /* read at first, and for every corner beyond that: */
    ALLOWED_A_CORNER = 24,          /* sorting writes and reads 4 bytes of number and 12 of vertex */
};

struct spb_vertex_cache {
    const struct spb_vertices *v;
    uint32_t *place_of;             /* [pieces of the table] or SPC_NONE */
    uint32_t *piece_at;             /* [place_count] or SPC_NONE */
    uint8_t *bytes;                 /* [place_count][1 << PIECE_LOG2][v->bytes] */
    uint32_t place_count, oldest;
    uint64_t bytes_read, corners;
    bool failed;
};

enum spc_status spb_vertex_cache_create(const struct spb_vertices *v, uint64_t memory,
                                        struct spb_vertex_cache **out, struct spc_error *err)
{
    const uint64_t piece_bytes = (uint64_t)v->bytes << PIECE_LOG2;
    const uint64_t pieces = ((v->count - 1) >> PIECE_LOG2) + 1;
    uint64_t places = memory / piece_bytes < PIECES_MIN ? PIECES_MIN : memory / piece_bytes;
    places = places < pieces ? places : pieces;
    struct spb_vertex_cache *c = calloc(1, sizeof *c);
    *out = NULL;
    if (c != NULL) {
        c->v = v;
        c->place_count = (uint32_t)places;
        c->place_of = malloc((size_t)pieces * sizeof *c->place_of);
        c->piece_at = malloc((size_t)places * sizeof *c->piece_at);
        c->bytes = malloc((size_t)(places * piece_bytes));
    }
    if (c == NULL || !c->place_of || !c->piece_at || !c->bytes) {
        spb_vertex_cache_free(c);
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for vertices");
    }
    memset(c->place_of, 0xFF, (size_t)pieces * sizeof *c->place_of);
    memset(c->piece_at, 0xFF, (size_t)places * sizeof *c->piece_at);
    *out = c;
    return SPC_OK;
}

void spb_vertex_cache_free(struct spb_vertex_cache *c)
{
    if (c == NULL)
        return;
    free(c->place_of);
    free(c->piece_at);
    free(c->bytes);
    free(c);
}

bool spb_vertex_cache_failed(const struct spb_vertex_cache *c)
{
    return c->failed;
}

static enum spc_status load(struct spb_vertex_cache *c, uint64_t piece, struct spc_error *err)
{
    const uint64_t first = piece << PIECE_LOG2, rest = c->v->count - first;
    const uint64_t n = rest < (uint64_t)1 << PIECE_LOG2 ? rest : (uint64_t)1 << PIECE_LOG2;
    const uint32_t place = c->oldest;
    c->oldest = (c->oldest + 1) % c->place_count;
    c->bytes_read += n * c->v->bytes;
    if (c->bytes_read > ALLOWED_BYTES + c->corners * ALLOWED_A_CORNER) {
        c->failed = true;
        return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "the faces refer to vertices all over");
    }
    if (c->piece_at[place] != SPC_NONE)
        c->place_of[c->piece_at[place]] = SPC_NONE;
    c->piece_at[place] = SPC_NONE;
    const enum spc_status status = spb_tmpfile_read(
        c->v->file, c->v->off + first * c->v->bytes,
        c->bytes + ((size_t)place << PIECE_LOG2) * c->v->bytes, (size_t)(n * c->v->bytes), err);
    if (status != SPC_OK)
        return status;
    c->piece_at[place] = (uint32_t)piece;
    c->place_of[piece] = place;
    return SPC_OK;
}

enum spc_status spb_vertex_cache_get(struct spb_vertex_cache *c, uint64_t corner, uint8_t *vertex,
                                     struct spc_error *err)
{
    const uint64_t piece = corner >> PIECE_LOG2, inside = corner & ((1u << PIECE_LOG2) - 1);
    c->corners++;
    if (c->place_of[piece] == SPC_NONE) {
        const enum spc_status status = load(c, piece, err);
        if (status != SPC_OK)
            return status;
    }
    const uint32_t place = c->place_of[piece];
    memcpy(vertex, c->bytes + (((size_t)place << PIECE_LOG2) + inside) * c->v->bytes, c->v->bytes);
    return SPC_OK;
}
