/*
 * remains.c - what a damaged archive still says of itself.
 *
 * A reader refuses an archive at the first fault. Here each part of the head is taken on its own:
 * the header by its checksum, every section by the one in the header's table. A file that is cut
 * short or has grown contradicts its header in one field only, so the header is judged against the
 * size that it names itself, and the directory too: its chunks may lie where nothing is any more.
 */
#include "format_int.h"

#include "bytes.h"

#include <stdlib.h>
#include <sys/mman.h>
#include <xxhash.h>

static bool section_whole(const struct spc_reader *r, int s, uint64_t size)
{
    const struct spc_section *se = &r->sections[s];
    return range_fits(se->off, se->bytes, size) &&
           XXH64(r->bytes + se->off, se->bytes, 0) == se->hash;
}

static void read_head(struct spc_remains *m)
{
    struct spc_reader *r = m->head;
    const uint64_t size = m->size;
    if (size < HD_SIZE)
        return;
    r->bytes = r->head = m->bytes;
    r->size = load_u64(m->bytes + HD_FILE_BYTES);
    if (r->size < HD_SIZE ||
        spc_header_decode(m->bytes, r->size, &r->header, r->sections, NULL) != SPC_OK)
        return;
    m->header = &r->header;
    if (section_whole(r, SE_META, size)) {
        m->meta = (const char *)m->bytes + r->sections[SE_META].off;
        m->meta_bytes = (size_t)r->sections[SE_META].bytes;
    }
    if (section_whole(r, SE_CLUS, size) && section_whole(r, SE_BLKS, size) &&
        spc_directory_check(r, NULL) == SPC_OK)
        m->directory = r;
}

/* Whether a version that is not known is one, or damage to its two bytes: the header's hash knows. */
static bool version_damaged(const struct spc_remains *m)
{
    return m->fault.status == SPC_VERSION &&
           load_u64(m->bytes + HD_HASH) != XXH64(m->bytes, HD_HASH, 0);
}

enum spc_status spc_remains_open_memory(const void *bytes, size_t size, struct spc_remains *out,
                                        struct spc_error *err)
{
    struct spc_reader *whole = NULL;
    *out = (struct spc_remains){.bytes = bytes, .size = size};
    out->head = calloc(1, sizeof *out->head);
    if (out->head == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to open an archive");
    read_head(out);
    if (spc_reader_open_memory(bytes, size, &whole, &out->fault) == SPC_NO_MEMORY) {
        spc_remains_close(out);
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to open an archive");
    }
    spc_reader_close(whole);
    if (version_damaged(out)) {
        out->fault = (struct spc_error){0};
        spc_fail(&out->fault, SPC_CHECKSUM, HD_HASH, "header checksum does not match");
    }
    return SPC_OK;
}

enum spc_status spc_remains_open(const char *path, struct spc_remains *out, struct spc_error *err)
{
    const uint8_t *bytes = NULL;
    uint64_t size = 0;
    *out = (struct spc_remains){.bytes = NULL};
    enum spc_status status = spc_map_file(path, &bytes, &size, err);
    if (status != SPC_OK)
        return status;
    status = spc_remains_open_memory(bytes, (size_t)size, out, err);
    if (status == SPC_OK)
        out->mapped = true;
    else
        munmap((void *)bytes, (size_t)size);
    return status;
}

void spc_remains_close(struct spc_remains *m)
{
    if (m == NULL)
        return;
    if (m->mapped)
        munmap((void *)m->bytes, (size_t)m->size);
    free(m->head);
    *m = (struct spc_remains){.bytes = NULL};
}
