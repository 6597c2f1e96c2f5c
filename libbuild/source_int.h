/*
 * source_int.h - what one scan format gives to the dispatcher in source.c.
 *
 * A format is one such table. state is what its open made; the dispatcher owns the bytes and the
 * info, lets open fill the latter, and keeps both alive until after close. Each function does what
 * the one of the same name in source.h promises.
 */
#ifndef SPB_SOURCE_INT_H
#define SPB_SOURCE_INT_H

#include "bytesource.h"
#include "source.h"

struct spb_format {
    const char *name;                   /* for "none of: ..." */

    /* Does the file look like this format? head: its first bytes, 512 of them or the whole file. */
    bool (*sniff)(const uint8_t *head, size_t head_bytes, uint64_t file_bytes);

    /* Reads the header. bytes stands at 0. info is zeroed but for file_bytes. */
    enum spc_status (*open)(struct spb_bytes *bytes, const struct spb_source_options *options,
                            struct spb_source_info *info, void **state, struct spc_error *err);
    void (*close)(void *state);
    void (*pause)(void *state);         /* gives up caches until a pass begins; NULL: there are none */

    enum spc_status (*begin_vertices)(void *state, struct spc_error *err);
    enum spc_status (*begin_faces)(void *state, struct spc_error *err);
    enum spc_status (*vertices)(void *state, struct spb_vertex_batch *out, struct spc_error *err);
    enum spc_status (*faces)(void *state, struct spb_face_batch *out, struct spc_error *err);
    uint64_t (*bytes_done)(const void *state);
    const char *(*remark)(void *state);
};

/*
 * For tests: opens size bytes of memory, which must live until close, as this format whatever they
 * look like. No read gives more than step bytes at a time. fails as spb_source_open
 */
enum spc_status spb_source_open_memory(const struct spb_format *format, const void *memory,
                                       size_t size, size_t step, struct spb_source **out,
                                       struct spc_error *err);

/* A source that is no file: state goes to its format's close. fails SPC_NO_MEMORY, state untouched */
enum spc_status spb_source_wrap(const struct spb_format *format, void *state,
                                const struct spb_source_info *info, struct spb_source **out,
                                struct spc_error *err);

/* The state of a source of that format, else NULL. */
void *spb_source_state(const struct spb_source *source, const struct spb_format *format);

#endif
