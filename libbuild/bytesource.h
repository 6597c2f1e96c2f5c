/*
 * bytesource.h - a file as a window of bytes that moves forward, for every scan reader.
 *
 * Readers look straight into the window: buf[pos] is the next byte, buf[end] the first byte that
 * is not there, and buf[end] is always a readable zero, so that a loop over digits or blanks needs
 * no bound of its own. The size of the file is taken at open; bytes added later are not seen, and
 * a file cut short while it is read simply ends earlier.
 */
#ifndef SPB_BYTESOURCE_H
#define SPB_BYTESOURCE_H

#include "progress.h"
#include "tmpfile.h"

enum { SPB_BYTES_WINDOW = 256 * 1024 };     /* most that spb_bytes_need can be asked for */

struct spb_bytes {
    int fd;                     /* -1: closed, or in memory */
    const uint8_t *memory;      /* in place of a file; borrowed */
    size_t memory_step;         /* most that one read from there gives */
    struct spb_tmpfile *copy;   /* of a pipe: fd is this one's; else NULL */
    uint8_t *buf;               /* window_bytes + 1 bytes; or none, as long as nothing is read */
    uint8_t none[1];
    size_t window_bytes;        /* SPB_BYTES_WINDOW, or what a smaller file needs */
    size_t pos, end;            /* pos <= end <= window_bytes */
    uint64_t buf_off;           /* file offset of buf[0] */
    uint64_t file_bytes;
};

/*
 * Opens a file at its first byte; "-" is standard input. What comes through a pipe is copied to a
 * temporary file of temp first, since scans are read twice; without temp (NULL) pipes are refused.
 * *bytes must stay where it is. On failure it is closed.
 *
 * fails  SPC_IO (open; the copy), SPC_INPUT_FORMAT (a directory, terminal or device), SPC_NO_MEMORY,
 *        SPC_CANCELLED
 */
enum spc_status spb_bytes_open(struct spb_bytes *bytes, const char *path, struct spb_temp *temp,
                               const struct spb_progress *progress, struct spc_error *err);

/*
 * The same over size bytes of memory, which must live until close. One read gives step bytes at
 * most, so that values lie across the window's end as they do in large files.
 */
void spb_bytes_open_memory(struct spb_bytes *bytes, const void *memory, size_t size, size_t step);
void spb_bytes_close(struct spb_bytes *bytes);

/* Frees the window, until something is read again. Pointers into it die. */
void spb_bytes_pause(struct spb_bytes *bytes);

/* Moves the window; off may lie behind the end of the file, where nothing is. Reads nothing. */
void spb_bytes_seek(struct spb_bytes *bytes, uint64_t off);

/* The part of spb_bytes_need that reads. */
enum spc_status spb_bytes_fill(struct spb_bytes *bytes, size_t want, struct spc_error *err);

/* Bytes in the window from pos on. */
static inline size_t spb_bytes_have(const struct spb_bytes *bytes)
{
    return bytes->end - bytes->pos;
}

/* File offset of the next byte. */
static inline uint64_t spb_bytes_off(const struct spb_bytes *bytes)
{
    return bytes->buf_off + bytes->pos;
}

/* Bytes from the next one to the end of the file. */
static inline uint64_t spb_bytes_rest(const struct spb_bytes *bytes)
{
    const uint64_t off = spb_bytes_off(bytes);
    return off < bytes->file_bytes ? bytes->file_bytes - off : 0;
}

/* True when the window reaches the end of the file: nothing follows buf[end]. */
static inline bool spb_bytes_last(const struct spb_bytes *bytes)
{
    return bytes->buf_off + bytes->end >= bytes->file_bytes;
}

/*
 * Brings want bytes (at most SPB_BYTES_WINDOW) into the window, fewer only when the file ends
 * before: the caller looks at spb_bytes_have. Pointers into the window die.
 *
 * fails  SPC_IO, SPC_NO_MEMORY
 */
static inline enum spc_status spb_bytes_need(struct spb_bytes *bytes, size_t want,
                                             struct spc_error *err)
{
    return spb_bytes_have(bytes) >= want ? SPC_OK : spb_bytes_fill(bytes, want, err);
}

/* Passes over count bytes, which may lead behind the end of the file but not past 2^64. */
static inline void spb_bytes_skip(struct spb_bytes *bytes, uint64_t count)
{
    if (count <= spb_bytes_have(bytes))
        bytes->pos += (size_t)count;
    else
        spb_bytes_seek(bytes, spb_bytes_off(bytes) + count);
}

#endif
