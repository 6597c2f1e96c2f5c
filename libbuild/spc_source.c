/*
 * Archives as scans, whole or damaged.
 *
 * Both passes run over one list of leaf blocks, eight bytes each: of a whole archive it is the
 * directory's, of a damaged one what the search accepted. A block is proved, decoded and handed on;
 * then the next takes its place, so beyond that list memory is that of the largest block.
 *
 * The search trusts nothing but chunks that prove themselves (spec 6.1). What else is whole narrows
 * it down: blocks must have the exponents and flags of the header, or else of the first block
 * found; with a directory their checksums must be in it, in its order. By checksum, not by place: a
 * copy that left out unreadable sectors moves everything behind them. And in order, one block for
 * each entry, because equal blocks may be there twice with right. A leaf block counts once it has
 * been decoded, so that the passes need not fail.
 */
#define _DEFAULT_SOURCE             /* madvise */
#include "spc_source.h"

#include "bytes.h"
#include "layout.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

/* Looking a strange block up passes the whole directory. In all so many entries: seconds. */
static const uint64_t LOOKUPS_MAX = (uint64_t)1 << 29;

struct spc {
    const uint8_t *bytes;           /* the file, mapped */
    uint64_t size;
    struct spc_remains remains;
    struct spb_salvage salvage;
    bool salvaging;
    uint64_t *off;                  /* [count] chunks of the leaf blocks to read */
    size_t count, room;
    struct spc_frame like;          /* flags, exponents and axes that every block must have */
    bool like_known;
    uint64_t vertex_count;
    bool wide;
    uint32_t next_block;            /* of the directory, in the search */
    uint64_t lookups;
    uint32_t lost_last;             /* cluster that lost triangles last */

    size_t next;                    /* of the pass: the block that is loaded next */
    uint32_t row;                   /* in the block that is loaded */
    uint64_t vertex_base;           /* number of its first vertex */
    bool loaded;
    struct spc_block block;
    struct spc_frame frame;
    struct spc_block_layout layout;
    uint8_t *payload;
    uint32_t payload_bytes;
};

/* ---- blocks ------------------------------------------------------------------------------------ */

static bool is_like(const struct spc *s, const struct spc_frame *frame)
{
    return frame->flags == (uint8_t)s->like.flags && frame->unit_exp == s->like.unit_exp &&
           frame->vertex_exp == s->like.vertex_exp &&
           frame->normal_clusters == s->like.normal_clusters;
}

/* Decodes the leaf block in s->block and s->frame into the payload. */
static enum spc_status decode(struct spc *s, struct spc_error *err)
{
    if (s->block.raw_bytes > s->payload_bytes) {
        free(s->payload);
        s->payload = malloc(s->block.raw_bytes);
        s->payload_bytes = s->payload ? s->block.raw_bytes : 0;
        if (s->payload == NULL)
            return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to read a block");
    }
    spc_block_layout(&s->block, s->frame.flags, s->frame.normal_clusters, &s->layout);
    return spc_chunk_decode(s->bytes, &s->block, &s->frame, s->payload, err);
}

/*
 * Mapped pages count as memory of the process, however clean; with a page the system maps its
 * neighbours too. Advice only.
 */
static void let_go(const struct spc *s, uint64_t begin, uint64_t end)
{
    enum { NEIGHBOURS = 128 << 10 };
    const uint64_t page = (uint64_t)sysconf(_SC_PAGESIZE);
    begin = begin > NEIGHBOURS ? begin - NEIGHBOURS : 0;
    begin -= begin % page;
    end = end + NEIGHBOURS < s->size ? end + NEIGHBOURS : s->size;
    (void)madvise((void *)(s->bytes + begin), (size_t)(end - begin), MADV_DONTNEED);
}

static enum spc_status load_next(struct spc *s, struct spc_error *err)
{
    const uint64_t off = s->off[s->next];
    uint64_t at = off;
    if (!spc_chunk_find(s->bytes, s->size, &at, &s->block, &s->frame) || at != off ||
        s->block.kind != SPC_BLOCK_LEAF || !is_like(s, &s->frame))
        return spc_fail(err, SPC_CHECKSUM, off, "checksum of a block does not match");
    const enum spc_status status = decode(s, err);
    let_go(s, off, off + spc_block_chunk_bytes(&s->block));
    s->loaded = status == SPC_OK;
    s->row = 0;
    s->next++;
    return status;
}

static enum spc_status add_block(struct spc *s, uint64_t off, struct spc_error *err)
{
    if (s->count == s->room) {
        const size_t room = s->room ? 2 * s->room : 256;
        uint64_t *more = realloc(s->off, room * sizeof *more);
        if (more == NULL)
            return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a list of blocks");
        s->off = more;
        s->room = room;
    }
    s->off[s->count++] = off;
    return SPC_OK;
}

/* ---- the search -------------------------------------------------------------------------------- */

/* Blocks of a cluster follow each other, so only the cluster met last can come again. */
static void lose_triangles(struct spc *s, const struct spc_block *b)
{
    struct spb_salvage *v = &s->salvage;
    struct spc_cluster c;
    if (v->lost_clusters == 0 || s->lost_last != b->cluster) {
        s->lost_last = b->cluster;
        if (++v->lost_clusters > SPB_LOST_MAX)
            return;
        struct spb_lost *lost = &v->lost[v->lost_clusters - 1];
        spc_reader_cluster(s->remains.directory, b->cluster, &c);
        *lost = (struct spb_lost){.cluster = b->cluster, .triangles_of = c.leaf_count};
        for (int a = 0; a < 3; a++) {
            lost->min[a] = c.origin[a] + ldexp((double)c.box[a], s->like.unit_exp);
            lost->max[a] = c.origin[a] + ldexp((double)c.box[a + 3], s->like.unit_exp);
        }
    }
    if (v->lost_clusters <= SPB_LOST_MAX)
        v->lost[v->lost_clusters - 1].triangles += b->node_count;
}

static void lose_blocks(struct spc *s, uint32_t first, uint32_t end)
{
    for (uint32_t k = first; k < end; k++) {
        struct spc_block b;
        spc_reader_block(s->remains.directory, k, &b);
        if (b.kind == SPC_BLOCK_LEAF)
            lose_triangles(s, &b);
    }
}

/* The first entry of the directory, not passed yet, that is this block; SPC_NONE: there is none. */
static uint32_t look_up(struct spc *s, uint64_t hash)
{
    const uint32_t count = s->remains.header->block_count;
    for (uint32_t k = s->next_block; k < count && s->lookups < LOOKUPS_MAX; k++, s->lookups++) {
        struct spc_block b;
        spc_reader_block(s->remains.directory, k, &b);
        if (b.hash == hash)
            return k;
    }
    return SPC_NONE;
}

static bool belongs(struct spc *s, uint32_t *entry)
{
    if (!s->like_known) {           /* no header: the first block speaks for all */
        s->like = s->frame;
        s->like_known = true;
    }
    if (!is_like(s, &s->frame))
        return false;
    if (s->remains.directory == NULL)
        return true;
    *entry = look_up(s, s->block.hash);
    return *entry != SPC_NONE;
}

/* Floats hold the vertices of most scans: half the memory and temporary space of doubles. */
static void look_at_width(struct spc *s)
{
    for (uint32_t i = 0; i < s->block.vertex_count && !s->wide; i++) {
        double xyz[3];
        spc_vertex_at(&s->block, &s->frame, &s->layout, s->payload, i, xyz, NULL);
        for (int a = 0; a < 3; a++)
            s->wide = s->wide || (double)(float)xyz[a] != xyz[a];
    }
}

/* A chunk that proved itself: s->block, s->frame. */
static enum spc_status take_chunk(struct spc *s, struct spc_error *err)
{
    struct spb_salvage *v = &s->salvage;
    uint32_t entry = SPC_NONE;
    if (!belongs(s, &entry)) {
        v->blocks_foreign++;
        return SPC_OK;
    }
    if (entry != SPC_NONE) {
        lose_blocks(s, s->next_block, entry);
        s->next_block = entry + 1;
    }
    if (s->block.kind == SPC_BLOCK_LEAF && (s->frame.flags & SPC_FLAG_TRIANGLES)) {
        const enum spc_status status = decode(s, NULL);
        if (status == SPC_NO_MEMORY)
            return spc_fail(err, status, SPC_NO_OFF, "no memory to read a block");
        if (status != SPC_OK) {     /* whole, but never an archive's */
            if (entry != SPC_NONE)
                lose_blocks(s, entry, entry + 1);
            return SPC_OK;
        }
        look_at_width(s);
        v->triangles += s->block.node_count;
        s->vertex_count += s->block.vertex_count;
        if (add_block(s, s->block.off, err) != SPC_OK)
            return SPC_NO_MEMORY;
    }
    v->blocks++;
    return SPC_OK;
}

static enum spc_status search(struct spc *s, const struct spb_progress *progress,
                              struct spc_error *err)
{
    enum spc_status status = SPC_OK;
    uint64_t at = 0;
    while (status == SPC_OK && spc_chunk_find(s->bytes, s->size, &at, &s->block, &s->frame)) {
        const uint64_t begin = at;
        status = take_chunk(s, err);
        at += spc_block_chunk_bytes(&s->block);
        let_go(s, begin, at);
        if (status == SPC_OK && spb_progress_tell(progress, "search", at, s->size))
            status = spc_fail(err, SPC_CANCELLED, SPC_NO_OFF, "cancelled");
    }
    if (status == SPC_OK && s->remains.directory != NULL)
        lose_blocks(s, s->next_block, s->remains.header->block_count);
    return status;
}

/* ---- open and close ---------------------------------------------------------------------------- */

static void spc_close(void *state)
{
    struct spc *s = state;
    if (s == NULL)
        return;
    spc_remains_close(&s->remains);
    if (s->bytes != NULL)
        munmap((void *)s->bytes, (size_t)s->size);
    free(s->off);
    free(s->payload);
    free(s);
}

static enum spc_status map(struct spb_bytes *file, struct spc **out, struct spc_error *err)
{
    *out = NULL;
    if (file->file_bytes == 0)
        return spc_fail(err, SPC_INPUT_EMPTY, 0, "the file is empty");
    struct spc *s = calloc(1, sizeof *s);
    if (s == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for an archive reader");
    s->size = file->file_bytes;
    void *bytes = mmap(NULL, (size_t)s->size, PROT_READ, MAP_SHARED, file->fd, 0);
    if (bytes == MAP_FAILED) {
        free(s);
        return spc_fail_os(err, errno, "cannot map");
    }
    s->bytes = bytes;
    (void)posix_madvise(bytes, (size_t)s->size, POSIX_MADV_SEQUENTIAL);
    const enum spc_status status =
        spc_remains_open_memory(s->bytes, (size_t)s->size, &s->remains, err);
    if (status != SPC_OK) {
        spc_close(s);
        return status;
    }
    const struct spc_header *h = s->remains.header;
    if (h != NULL) {
        s->like = (struct spc_frame){.flags = h->flags, .normal_clusters = h->normal_clusters,
                                     .unit_exp = h->unit_exp, .vertex_exp = h->vertex_exp};
        s->like_known = true;
    }
    *out = s;
    return SPC_OK;
}

static enum spc_status list_leaf_blocks(struct spc *s, struct spc_error *err)
{
    enum spc_status status = SPC_OK;
    for (uint32_t k = 0; k < s->remains.header->block_count && status == SPC_OK; k++) {
        struct spc_block b;
        spc_reader_block(s->remains.directory, k, &b);
        if (b.kind == SPC_BLOCK_LEAF)
            status = add_block(s, b.off, err);
    }
    return status;
}

/* Lattice numbers of at most 24 bits are floats, if their step is one. */
static bool box_is_wide(const struct spc_header *h)
{
    double largest = 0;
    for (int a = 0; a < 3; a++)
        largest = fmax(largest, fmax(fabs(h->box_min[a]), fabs(h->box_max[a])));
    return h->vertex_exp < -126 || !(largest < 0x1p127) ||
           !(ldexp(largest, -h->vertex_exp) <= 0x1p24);
}

static enum spc_status open_whole(struct spc *s, struct spc_error *err)
{
    const struct spc_error *fault = &s->remains.fault;
    const struct spc_header *h = s->remains.header;
    if (fault->status != SPC_OK)
        return spc_fail(err, fault->status, fault->at_off, "%s", fault->what);
    s->vertex_count = h->vertex_count;
    s->salvage.triangles = h->triangle_count;
    s->wide = box_is_wide(h);
    return list_leaf_blocks(s, err);
}

static enum spc_status open_damaged(struct spc *s, const struct spb_progress *progress,
                                    struct spc_error *err)
{
    const struct spc_remains *m = &s->remains;
    struct spb_salvage *v = &s->salvage;
    if (m->fault.status == SPC_VERSION || m->fault.status == SPC_FEATURE)
        return spc_fail(err, m->fault.status, m->fault.at_off, "%s", m->fault.what);
    v->header = m->header != NULL;
    v->directory = m->directory != NULL;
    v->meta = m->meta != NULL;
    v->fault = m->fault;
    if (m->header != NULL) {
        v->blocks_of = m->header->block_count;
        v->triangles_of = m->header->triangle_count;
    }
    s->salvaging = true;
    return search(s, progress, err);
}

static void fill_info(const struct spc *s, struct spb_source_info *info)
{
    info->format = "spc";
    info->vertex_count = s->vertex_count;
    info->face_count = s->salvage.triangles;
    info->colors = (s->like.flags & SPC_FLAG_COLORS) != 0;
    info->wide = s->wide;
    info->by_place = true;      /* blocks have vertices of their own */
    info->archive = true;
    info->lattice_exp = s->like.vertex_exp;
    info->salvage = s->salvaging ? &s->salvage : NULL;
}

static enum spc_status finish_open(struct spc *s, enum spc_status status,
                                   struct spb_source_info *info, void **state,
                                   struct spc_error *err)
{
    if (status == SPC_OK && s->like_known && !(s->like.flags & SPC_FLAG_TRIANGLES))
        status = spc_fail(err, SPC_INPUT_EMPTY, SPC_NO_OFF,
                          "the archive holds points only: there are no triangles to build from");
    else if (status == SPC_OK && s->salvage.triangles == 0)
        status = spc_fail(err, SPC_INPUT_EMPTY, SPC_NO_OFF,
                          s->like_known ? "no block with triangles is whole"
                                        : "nothing in it is a whole block of an .spc archive");
    if (status != SPC_OK) {
        spc_close(s);
        return status;
    }
    fill_info(s, info);
    *state = s;
    return SPC_OK;
}

static enum spc_status spc_open(struct spb_bytes *bytes, const struct spb_source_options *options,
                                struct spb_source_info *info, void **state, struct spc_error *err)
{
    (void)options;
    struct spc *s = NULL;
    const enum spc_status status = map(bytes, &s, err);
    return s == NULL ? status : finish_open(s, open_whole(s, err), info, state, err);
}

enum spc_status spb_spc_salvage(struct spb_bytes *bytes, const struct spb_source_options *options,
                                struct spb_source_info *info, void **state, struct spc_error *err)
{
    struct spc *s = NULL;
    const enum spc_status status = map(bytes, &s, err);
    return s == NULL ? status : finish_open(s, open_damaged(s, options->progress, err), info, state, err);
}

/* ---- the two passes ---------------------------------------------------------------------------- */

static enum spc_status spc_begin(void *state, struct spc_error *err)
{
    struct spc *s = state;
    (void)err;
    s->next = 0;
    s->vertex_base = 0;
    s->loaded = false;
    return SPC_OK;
}

/* Brings the row'th of what a block has so many of within reach. False: no more, or an error. */
static bool reach(struct spc *s, enum spc_status *status, struct spc_error *err, bool vertices)
{
    if (s->loaded && s->row < (vertices ? s->block.vertex_count : s->block.node_count))
        return true;
    if (s->loaded)
        s->vertex_base += s->block.vertex_count;
    s->loaded = false;
    if (s->next == s->count)
        return false;
    *status = load_next(s, err);
    return *status == SPC_OK;
}

static enum spc_status spc_vertices(void *state, struct spb_vertex_batch *out,
                                    struct spc_error *err)
{
    struct spc *s = state;
    enum spc_status status = SPC_OK;
    out->count = 0;
    while (out->count < SPB_BATCH_MAX && reach(s, &status, err, true)) {
        spc_vertex_at(&s->block, &s->frame, &s->layout, s->payload, s->row++,
                      out->xyz[out->count], out->rgba[out->count]);
        out->count++;
    }
    return status;
}

static enum spc_status spc_faces(void *state, struct spb_face_batch *out, struct spc_error *err)
{
    struct spc *s = state;
    enum spc_status status = SPC_OK;
    out->count = 0;
    out->split_extra = out->faces_short = 0;
    while (out->count < SPB_BATCH_MAX && reach(s, &status, err, false)) {
        const uint8_t *index = s->payload + s->layout.indices + (size_t)6 * s->row++;
        for (int k = 0; k < 3; k++)
            out->corner[out->count][k] = s->vertex_base + load_u16(index + 2 * k);
        out->count++;
    }
    out->faces_in = out->count;
    return status;
}

static uint64_t spc_bytes_done(const void *state)
{
    const struct spc *s = state;
    return s->next < s->count ? s->off[s->next] : s->size;
}

static const char *spc_remark(void *state)
{
    (void)state;
    return "";
}

/* The mark's first bytes survive copies that change the line ends behind them. */
static bool spc_sniff(const uint8_t *head, size_t head_bytes, uint64_t file_bytes)
{
    (void)file_bytes;
    return head_bytes >= 4 && memcmp(head, SPC_MAGIC, 4) == 0;
}

const struct spb_format spb_spc_format = {
    .name = "SPC",
    .sniff = spc_sniff,
    .open = spc_open,
    .close = spc_close,
    .begin_vertices = spc_begin,
    .begin_faces = spc_begin,
    .vertices = spc_vertices,
    .faces = spc_faces,
    .bytes_done = spc_bytes_done,
    .remark = spc_remark,
};
