/*
 * planes.h - columns of numbers as byte planes, each its own zstd frame (spec section 6.4).
 *
 * The bytes of equal weight of a column form a plane. Measured on real hierarchies, planes
 * compressed alone beat planes in one frame, and levels above 1 gain two per cent.
 */
#ifndef SPC_PLANES_H
#define SPC_PLANES_H

#include "encoder.h"

/* A plane's table entry: mode in the upper two bits, stored bytes in the others. */
enum { PLANE_MODE_SHIFT = 30, PLANE_BYTES_MASK = (1 << PLANE_MODE_SHIFT) - 1 };

struct planes_writer {
    struct spc_encoder *encoder;
    uint8_t *out;
    size_t out_max, used;           /* the table first, then what is stored */
    uint32_t plane, plane_count;
    uint8_t *scratch;               /* [count_max] one plane */
    enum spc_status status;         /* the first failure; later calls do nothing */
};

/*
 * plane_count planes of at most count_max values each will follow, into out[out_max]. Takes count_max
 * bytes of what is reserved in the encoder.
 */
enum spc_status planes_begin(struct planes_writer *w, struct spc_encoder *encoder,
                             uint32_t plane_count, uint32_t count_max, uint8_t *out, size_t out_max,
                             struct spc_error *err);
void planes_put8(struct planes_writer *w, const uint8_t *values, uint32_t count);
void planes_put16(struct planes_writer *w, const uint16_t *values, uint32_t count);
void planes_put64(struct planes_writer *w, const uint64_t *values, uint32_t width, uint32_t count);
enum spc_status planes_finish(struct planes_writer *w, size_t *bytes, struct spc_error *err);

struct planes_reader {
    void *zstd;
    const uint8_t *in;
    size_t in_bytes, at;
    uint32_t plane, plane_count;
    uint8_t *scratch;               /* [8][count_max] planes of a column */
    uint32_t count_max;
    bool broken;                    /* a plane is not what it should be; values are zero then */
};

enum spc_status planes_open(struct planes_reader *r, uint32_t plane_count, uint32_t count_max,
                            const uint8_t *in, size_t in_bytes, struct spc_error *err);
void planes_get8(struct planes_reader *r, uint8_t *values, uint32_t count);
void planes_get16(struct planes_reader *r, uint16_t *values, uint32_t count);
void planes_get64(struct planes_reader *r, uint64_t *values, uint32_t width, uint32_t count);

/* Frees; false when something was broken or bytes are left over. */
bool planes_close(struct planes_reader *r);

/* Differences modulo 2^bits, small ones of both signs to small numbers. */
static inline uint8_t zigzag8(uint8_t d)
{
    return (uint8_t)(d << 1 ^ (d & 0x80 ? 0xFF : 0));
}

static inline uint8_t unzigzag8(uint8_t z)
{
    return (uint8_t)(z >> 1 ^ (z & 1 ? 0xFF : 0));
}

static inline uint16_t zigzag16(uint16_t d)
{
    return (uint16_t)(d << 1 ^ (d & 0x8000 ? 0xFFFF : 0));
}

static inline uint16_t unzigzag16(uint16_t z)
{
    return (uint16_t)(z >> 1 ^ (z & 1 ? 0xFFFF : 0));
}

static inline uint64_t zigzag64(uint64_t d)
{
    return d << 1 ^ (d >> 63 ? UINT64_MAX : 0);
}

static inline uint64_t unzigzag64(uint64_t z)
{
    return z >> 1 ^ (z & 1 ? UINT64_MAX : 0);
}

#endif
