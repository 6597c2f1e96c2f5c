/*
 * spill.h - records of one size, sorted into piles, on disk.
 *
 * A pile is a list in the order of appending. All piles of a spill share one pool of pages; when it
 * is used up the fullest piles are written out, each as one extent, so that extents are as long as
 * memory allows, however the records are spread.
 */
#ifndef SPB_SPILL_H
#define SPB_SPILL_H

#include "tmpfile.h"

struct spb_extent {                 /* bytes [off, off + bytes) of the file */
    uint64_t off, bytes;
};

struct spb_pile {
    uint64_t count;                 /* records */
    struct spb_extent *extents;     /* oldest first */
    uint32_t extent_count, extent_max;
    uint32_t first_page, last_page, page_count; /* not written yet */
    uint32_t last_used;             /* bytes of the last page */
};

struct spb_spill {
    struct spb_tmpfile *file;
    uint32_t record_bytes;
    uint32_t page_bytes;            /* whole records */
    uint8_t *pages;
    uint32_t *next;                 /* [page_max] chains of piles and of free pages */
    uint32_t page_max, free_first;
    struct spb_pile **piles;        /* that were added, not owned */
    uint32_t pile_count, pile_max;
};

enum { SPB_PAGE_BYTES = 8192 };

/* A pool of memory bytes, of which untouched ones cost nothing. fails SPC_NO_MEMORY */
enum spc_status spb_spill_init(struct spb_spill *spill, struct spb_tmpfile *file,
                               uint32_t record_bytes, uint64_t memory, struct spc_error *err);

/* An empty pile, which must stay where it is until the spill is settled. fails SPC_NO_MEMORY */
enum spc_status spb_spill_pile(struct spb_spill *spill, struct spb_pile *pile,
                               struct spc_error *err);

/* Appends one record. fails SPC_IO, SPC_NO_MEMORY */
enum spc_status spb_spill_put(struct spb_spill *spill, struct spb_pile *pile, const void *record,
                              struct spc_error *err);

/* Writes what is left and frees the pool: the piles are complete. fails SPC_IO, SPC_NO_MEMORY */
enum spc_status spb_spill_settle(struct spb_spill *spill, struct spc_error *err);

/* Frees the pool without writing; the piles stay, for spb_pile_release. */
void spb_spill_release(struct spb_spill *spill);
void spb_pile_release(struct spb_pile *pile);

struct spb_pile_reader {            /* {pile, file} and zeros: at the beginning */
    const struct spb_pile *pile;
    struct spb_tmpfile *file;
    uint32_t extent;
    uint64_t done;                  /* bytes of the extent */
};

/* The next n bytes of a settled pile. fails SPC_IO, SPC_INTERNAL (there are not as many) */
enum spc_status spb_pile_read(struct spb_pile_reader *reader, void *bytes, uint64_t n,
                              struct spc_error *err);
void spb_pile_skip(struct spb_pile_reader *reader, uint64_t n);

/* The records will be read soon. */
void spb_pile_prefetch(const struct spb_pile *pile, struct spb_tmpfile *file);

/* The records are no longer needed: gives their disk space back. */
void spb_pile_discard(const struct spb_pile *pile, struct spb_tmpfile *file);

#endif
