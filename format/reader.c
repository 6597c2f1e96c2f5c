/*
 * reader.c - opens an archive: mapping, checks, borrowed views.
 *
 * Everything that a later access relies on is checked once here, header and directory only, so
 * opening costs O(directory) whatever the size of the file. Of a file the head is copied first: what
 * was checked stays so, whatever happens to the file. Chunks are borrowed; each is checked as it is read.
 */
#include "format_int.h"

#include "bytes.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

static enum spc_status check_head(const struct spc_reader *r, struct spc_error *err)
{
    static const char *const names[SE_SLOTS] = {
        "axes", "cluster directory", "block directory", "metadata",
        "first optional section", "second optional section", "third optional section",
        "fourth optional section"};
    uint64_t at = HD_SIZE;
    for (int s = 0; s < SE_SLOTS && (s < SE_COUNT || r->sections[s].tag != 0); s++) {
        const struct spc_section *se = &r->sections[s];
        if (XXH64(r->head + se->off, se->bytes, 0) != se->hash)
            return spc_fail(err, SPC_CHECKSUM, se->off, "checksum of the %s does not match",
                            names[s]);
        if (!all_zero(r->head + at, se->off - at))
            return spc_fail(err, SPC_CORRUPT, at, "padding before the %s is not zero", names[s]);
        at = se->off + se->bytes;
    }
    const uint64_t data = spc_data_start(r->header.head_bytes);
    if (data > r->size || !all_zero(r->head + at, data - at))
        return spc_fail(err, SPC_CORRUPT, at, "padding behind the head is not zero");
    const uint8_t *axes = r->head + r->sections[SE_AXES].off;
    for (uint32_t k = 0; k < r->header.normal_clusters; k++) {
        double axis[3];
        for (int a = 0; a < 3; a++)
            axis[a] = (int16_t)load_u16(axes + 6 * k + 2 * (uint32_t)a) / 32767.0;
        const double length = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
        if (!(length > 0.999 && length < 1.001))
            return spc_fail(err, SPC_CORRUPT, r->sections[SE_AXES].off + 6 * k,
                            "axis %u is not a direction", k);
    }
    return SPC_OK;
}

static enum spc_status open_checked(struct spc_reader *r, struct spc_error *err)
{
    enum spc_status status = spc_header_decode(r->head, r->size, &r->header, r->sections, err);
    if (status == SPC_OK)
        status = check_head(r, err);
    if (status == SPC_OK)
        status = spc_directory_check(r, err);
    return status;
}

static enum spc_status copy_head(struct spc_reader *r, struct spc_error *err)
{
    enum spc_status status = spc_header_decode(r->bytes, r->size, &r->header, r->sections, err);
    if (status != SPC_OK)
        return status;
    const uint64_t data = spc_data_start(r->header.head_bytes);
    const size_t n = (size_t)(data < r->size ? data : r->size);
    uint8_t *head = malloc(n);
    if (head == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a head of %zu bytes", n);
    memcpy(head, r->bytes, n);
    r->head = head;
    return SPC_OK;
}

static void release(struct spc_reader *r)
{
    if (r->head != r->bytes)
        free((void *)r->head);
    free(r);
}

static enum spc_status open_bytes(const void *bytes, size_t size, bool copy, struct spc_reader **out,
                                  struct spc_error *err)
{
    *out = NULL;
    struct spc_reader *r = calloc(1, sizeof *r);
    if (r == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to open an archive");
    r->bytes = r->head = bytes;
    r->size = size;
    enum spc_status status = SPC_OK;
    if (copy)
        status = copy_head(r, err);
    if (status == SPC_OK)
        status = open_checked(r, err);
    if (status == SPC_OK)
        *out = r;
    else
        release(r);
    return status;
}

enum spc_status spc_reader_open_memory(const void *bytes, size_t size, struct spc_reader **out,
                                       struct spc_error *err)
{
    return open_bytes(bytes, size, false, out, err);
}

enum spc_status spc_map_file(const char *path, const uint8_t **bytes, uint64_t *size,
                             struct spc_error *err)
{
    struct stat st;
    enum spc_status status = SPC_OK;
    int fd;
    do
        fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);     /* a pipe without a writer is refused, not waited for */
    while (fd < 0 && errno == EINTR);
    if (fd < 0)
        return spc_fail_os(err, errno, "cannot open");
    if (fstat(fd, &st) != 0) {
        status = spc_fail_os(err, errno, "cannot read its size");
    } else if (!S_ISREG(st.st_mode)) {
        status = spc_fail(err, SPC_NOT_SPC, SPC_NO_OFF, "not a regular file");
    } else if (st.st_size == 0) {
        status = spc_fail(err, SPC_NOT_SPC, 0, "the file is empty");
    } else {
        void *map = mmap(NULL, (size_t)st.st_size, PROT_READ, MAP_SHARED, fd, 0);
        if (map == MAP_FAILED)
            status = spc_fail_os(err, errno, "cannot map");
        *bytes = map;
        *size = (uint64_t)st.st_size;
    }
    close(fd);
    return status;
}

enum spc_status spc_reader_open(const char *path, struct spc_reader **out, struct spc_error *err)
{
    const uint8_t *bytes = NULL;
    uint64_t size = 0;
    *out = NULL;
    enum spc_status status = spc_map_file(path, &bytes, &size, err);
    if (status != SPC_OK)
        return status;
    status = open_bytes(bytes, (size_t)size, true, out, err);
    if (status == SPC_OK)
        (*out)->mapped = true;
    else
        munmap((void *)bytes, (size_t)size);
    return status;
}

void spc_reader_close(struct spc_reader *r)
{
    if (r == NULL)
        return;
    if (r->mapped)
        munmap((void *)r->bytes, (size_t)r->size);
    release(r);
}

const struct spc_header *spc_reader_header(const struct spc_reader *r)
{
    return &r->header;
}

const uint8_t *spc_reader_bytes(const struct spc_reader *r, uint64_t *size)
{
    *size = r->size;
    return r->bytes;
}

const char *spc_reader_meta(const struct spc_reader *r, size_t *bytes)
{
    *bytes = (size_t)r->sections[SE_META].bytes;
    return (const char *)r->head + r->sections[SE_META].off;
}

void spc_reader_axis(const struct spc_reader *r, uint32_t k, double axis[3])
{
    const uint8_t *p = r->head + r->sections[SE_AXES].off + (size_t)6 * k;
    for (int a = 0; a < 3; a++)
        axis[a] = (int16_t)load_u16(p + 2 * a) / 32767.0;
    const double length = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    for (int a = 0; a < 3; a++)
        axis[a] /= length;
}

void spc_reader_cluster(const struct spc_reader *r, uint32_t id, struct spc_cluster *out)
{
    spc_cluster_decode(r->head + r->sections[SE_CLUS].off + (uint64_t)id * CL_SIZE, out);
}

void spc_reader_block(const struct spc_reader *r, uint32_t index, struct spc_block *out)
{
    struct spc_block_layout layout;
    spc_block_record_decode(r->head + r->sections[SE_BLKS].off + (uint64_t)index * BL_SIZE, out);
    spc_block_layout(out, r->header.flags, r->header.normal_clusters, &layout);
    out->raw_bytes = layout.bytes;
}

struct spc_frame spc_reader_frame(const struct spc_reader *r, uint32_t cluster)
{
    const uint8_t *p = r->head + r->sections[SE_CLUS].off + (uint64_t)cluster * CL_SIZE + CL_ORIGIN;
    return (struct spc_frame){
        .flags = r->header.flags, .normal_clusters = r->header.normal_clusters,
        .unit_exp = r->header.unit_exp, .vertex_exp = r->header.vertex_exp,
        .origin = {load_f64(p), load_f64(p + 8), load_f64(p + 16)},
    };
}
