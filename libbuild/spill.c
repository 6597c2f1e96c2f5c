#include "spill.h"

#include <stdlib.h>
#include <string.h>
#include <sys/uio.h>

enum { PAGES_MIN = 16, VECTORS_MAX = 1024 };

static enum spc_status no_memory(struct spc_error *err)
{
    return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to sort records by place");
}

enum spc_status spb_spill_init(struct spb_spill *spill, struct spb_tmpfile *file,
                               uint32_t record_bytes, uint64_t memory, struct spc_error *err)
{
    *spill = (struct spb_spill){.file = file, .record_bytes = record_bytes};
    spill->page_bytes = SPB_PAGE_BYTES / record_bytes * record_bytes;
    uint64_t pages = memory / (SPB_PAGE_BYTES + sizeof *spill->next);
    pages = pages < PAGES_MIN ? PAGES_MIN : pages > SPC_NONE ? SPC_NONE : pages;
    spill->page_max = (uint32_t)pages;
    spill->pages = malloc((size_t)pages * spill->page_bytes);
    spill->next = malloc((size_t)pages * sizeof *spill->next);
    if (spill->pages == NULL || spill->next == NULL) {
        spb_spill_release(spill);
        return no_memory(err);
    }
    for (uint32_t i = 0; i < spill->page_max; i++)
        spill->next[i] = i + 1 < spill->page_max ? i + 1 : SPC_NONE;
    return SPC_OK;
}

enum spc_status spb_spill_pile(struct spb_spill *spill, struct spb_pile *pile,
                               struct spc_error *err)
{
    *pile = (struct spb_pile){.first_page = SPC_NONE, .last_page = SPC_NONE};
    if (spill->pile_count == spill->pile_max) {
        const uint32_t grown = spill->pile_max ? 2 * spill->pile_max : 64;
        struct spb_pile **piles = realloc(spill->piles, grown * sizeof *piles);
        if (piles == NULL)
            return no_memory(err);
        spill->piles = piles;
        spill->pile_max = grown;
    }
    spill->piles[spill->pile_count++] = pile;
    return SPC_OK;
}

static enum spc_status add_extent(struct spb_pile *pile, struct spb_extent extent,
                                  struct spc_error *err)
{
    if (pile->extent_count == pile->extent_max) {
        const uint32_t grown = pile->extent_max ? 2 * pile->extent_max : 1;
        struct spb_extent *extents = realloc(pile->extents, grown * sizeof *extents);
        if (extents == NULL)
            return no_memory(err);
        pile->extents = extents;
        pile->extent_max = grown;
    }
    pile->extents[pile->extent_count++] = extent;
    return SPC_OK;
}

/* Writes a pile's pages as one extent, or more where there are very many, and frees them. */
static enum spc_status write_pile(struct spb_spill *spill, struct spb_pile *pile,
                                  struct spc_error *err)
{
    struct iovec parts[VECTORS_MAX];
    while (pile->page_count > 0) {
        struct spb_extent extent = {0, 0};
        int n = 0;
        uint32_t page = pile->first_page;
        for (; n < VECTORS_MAX && page != SPC_NONE; n++, page = spill->next[page]) {
            const size_t bytes = page == pile->last_page ? pile->last_used : spill->page_bytes;
            parts[n] = (struct iovec){spill->pages + (size_t)page * spill->page_bytes, bytes};
            extent.bytes += bytes;
        }
        enum spc_status status = spb_tmpfile_append_parts(spill->file, parts, n, &extent.off, err);
        if (status == SPC_OK)
            status = add_extent(pile, extent, err);
        if (status != SPC_OK)
            return status;
        for (; n > 0; n--) {
            const uint32_t freed = pile->first_page;
            pile->first_page = spill->next[freed];
            spill->next[freed] = spill->free_first;
            spill->free_first = freed;
            pile->page_count--;
        }
    }
    pile->first_page = pile->last_page = SPC_NONE;
    return SPC_OK;
}

/* The piles with at least half as many pages as the fullest. */
static enum spc_status make_room(struct spb_spill *spill, struct spc_error *err)
{
    uint32_t most = 0;
    for (uint32_t i = 0; i < spill->pile_count; i++)
        most = spill->piles[i]->page_count > most ? spill->piles[i]->page_count : most;
    for (uint32_t i = 0; i < spill->pile_count; i++)
        if (spill->piles[i]->page_count > 0 && spill->piles[i]->page_count >= (most + 1) / 2) {
            const enum spc_status status = write_pile(spill, spill->piles[i], err);
            if (status != SPC_OK)
                return status;
        }
    return SPC_OK;
}

static enum spc_status new_page(struct spb_spill *spill, struct spb_pile *pile,
                                struct spc_error *err)
{
    if (spill->free_first == SPC_NONE) {
        const enum spc_status status = make_room(spill, err);
        if (status != SPC_OK)
            return status;
    }
    const uint32_t page = spill->free_first;
    spill->free_first = spill->next[page];
    spill->next[page] = SPC_NONE;
    if (pile->page_count == 0)
        pile->first_page = page;
    else
        spill->next[pile->last_page] = page;
    pile->last_page = page;
    pile->page_count++;
    pile->last_used = 0;
    return SPC_OK;
}

enum spc_status spb_spill_put(struct spb_spill *spill, struct spb_pile *pile, const void *record,
                              struct spc_error *err)
{
    if (pile->page_count == 0 || pile->last_used == spill->page_bytes) {
        const enum spc_status status = new_page(spill, pile, err);
        if (status != SPC_OK)
            return status;
    }
    memcpy(spill->pages + (size_t)pile->last_page * spill->page_bytes + pile->last_used, record,
           spill->record_bytes);
    pile->last_used += spill->record_bytes;
    pile->count++;
    return SPC_OK;
}

enum spc_status spb_spill_settle(struct spb_spill *spill, struct spc_error *err)
{
    enum spc_status status = SPC_OK;
    for (uint32_t i = 0; i < spill->pile_count && status == SPC_OK; i++)
        status = write_pile(spill, spill->piles[i], err);
    spb_spill_release(spill);
    return status;
}

void spb_spill_release(struct spb_spill *spill)
{
    free(spill->pages);
    free(spill->next);
    free(spill->piles);
    *spill = (struct spb_spill){0};
}

void spb_pile_release(struct spb_pile *pile)
{
    free(pile->extents);
    *pile = (struct spb_pile){0};
}

enum spc_status spb_pile_read(struct spb_pile_reader *reader, void *bytes, uint64_t n,
                              struct spc_error *err)
{
    uint8_t *out = bytes;
    while (n > 0) {
        if (reader->extent == reader->pile->extent_count)
            return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "a pile of records is too short");
        const struct spb_extent *extent = &reader->pile->extents[reader->extent];
        const uint64_t left = extent->bytes - reader->done;
        const uint64_t part = n < left ? n : left;
        const enum spc_status status =
            spb_tmpfile_read(reader->file, extent->off + reader->done, out, (size_t)part, err);
        if (status != SPC_OK)
            return status;
        out += part;
        n -= part;
        spb_pile_skip(reader, part);
    }
    return SPC_OK;
}

void spb_pile_skip(struct spb_pile_reader *reader, uint64_t n)
{
    while (n > 0 && reader->extent < reader->pile->extent_count) {
        const uint64_t left = reader->pile->extents[reader->extent].bytes - reader->done;
        const uint64_t part = n < left ? n : left;
        reader->done += part;
        n -= part;
        if (part == left) {
            reader->extent++;
            reader->done = 0;
        }
    }
}

void spb_pile_prefetch(const struct spb_pile *pile, struct spb_tmpfile *file)
{
    for (uint32_t i = 0; i < pile->extent_count; i++)
        spb_tmpfile_prefetch(file, pile->extents[i].off, pile->extents[i].bytes);
}

void spb_pile_discard(const struct spb_pile *pile, struct spb_tmpfile *file)
{
    for (uint32_t i = 0; i < pile->extent_count; i++)
        spb_tmpfile_discard(file, pile->extents[i].off, pile->extents[i].bytes);
}
