#include "bytes.h"
#include "planes.h"
#include "suite.h"

#include <stdlib.h>
#include <string.h>

enum { N = 3000, MAX = 4 * N };

/* One with room for N values a plane; the test ends it. */
static struct spc_encoder *encoder(void)
{
    struct spc_encoder *e = NULL;
    ck_assert_int_eq(spc_encoder_create(1, &e, NULL), SPC_OK);
    ck_assert_int_eq(encoder_reserve(e, encoder_share(N), NULL), SPC_OK);
    return e;
}

/* Compressible, but not constant. */
static void fill(uint8_t *values)
{
    for (uint32_t i = 0; i < N; i++)
        values[i] = (uint8_t)(i * i >> 7 & 3);
}

static size_t store(const uint8_t *values, uint8_t *out)
{
    struct planes_writer w;
    struct spc_encoder *e = encoder();
    size_t bytes = 0;
    ck_assert_int_eq(planes_begin(&w, e, 1, N, out, MAX, NULL), SPC_OK);
    planes_put8(&w, values, N);
    ck_assert_int_eq(planes_finish(&w, &bytes, NULL), SPC_OK);
    spc_encoder_free(e);
    return bytes;
}

static bool load(const uint8_t *in, size_t bytes, uint8_t *values)
{
    struct planes_reader r;
    ck_assert_int_eq(planes_open(&r, 1, N, in, bytes, NULL), SPC_OK);
    planes_get8(&r, values, N);
    return planes_close(&r);
}

START_TEST(columns_of_every_width_come_back)
{
    static uint8_t a[N], out[40 * N];
    static uint16_t b[N], b2[N];
    static uint64_t c[N], c2[N];
    static uint8_t a2[N];
    struct planes_writer w;
    struct spc_encoder *e = encoder();
    struct planes_reader r;
    size_t bytes = 0;
    uint64_t state = 1;
    for (uint32_t i = 0; i < N; i++) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        a[i] = (uint8_t)(state >> 56);                  /* stored plain */
        b[i] = (uint16_t)(i / 10);                      /* compressed; its high plane too */
        c[i] = (state >> 20 & 0xFFFF) | (uint64_t)7 << 40;      /* constant planes, zero planes */
    }
    ck_assert_int_eq(planes_begin(&w, e, 1 + 2 + 8, N, out, sizeof out, NULL), SPC_OK);
    planes_put8(&w, a, N);
    planes_put16(&w, b, N);
    planes_put64(&w, c, 8, N);
    ck_assert_int_eq(planes_finish(&w, &bytes, NULL), SPC_OK);
    spc_encoder_free(e);
    ck_assert_int_eq(planes_open(&r, 1 + 2 + 8, N, out, bytes, NULL), SPC_OK);
    planes_get8(&r, a2, N);
    planes_get16(&r, b2, N);
    planes_get64(&r, c2, 8, N);
    ck_assert(planes_close(&r));
    ck_assert(memcmp(a, a2, sizeof a) == 0 && memcmp(b, b2, sizeof b) == 0 &&
              memcmp(c, c2, sizeof c) == 0);
}
END_TEST

START_TEST(a_plane_is_one_frame)
{
    static uint8_t values[N], back[N], out[MAX], other[MAX];
    fill(values);
    const size_t bytes = store(values, out);
    const uint32_t frame = load_u32(out) & PLANE_BYTES_MASK;
    ck_assert_uint_eq(load_u32(out) >> PLANE_MODE_SHIFT, 0);
    ck_assert(load(out, bytes, back) && memcmp(values, back, N) == 0);
    memcpy(other, out, bytes);                          /* an empty frame to be skipped before it */
    store_u32(other, frame + 8);
    store_u32(other + 4, 0x184D2A50);
    store_u32(other + 8, 0);
    memcpy(other + 12, out + 4, frame);
    ck_assert(!load(other, bytes + 8, back));
    store_u32(other, frame + 8);                        /* and behind it */
    memcpy(other + 4, out + 4, frame);
    store_u32(other + 4 + frame, 0x184D2A50);
    store_u32(other + 8 + frame, 0);
    ck_assert(!load(other, bytes + 8, back));
    ck_assert(!load(out, bytes - 1, back));             /* cut, or with a byte too many */
    ck_assert(!load(out, bytes + 1, back));
}
END_TEST

/* A frame of one segment becomes one with a window of 1 GiB, and decodes to the same. */
START_TEST(a_window_is_no_larger_than_what_readers_keep)
{
    static uint8_t values[N], back[N], out[MAX];
    struct planes_writer w;
    struct spc_encoder *e = encoder();
    struct planes_reader r;
    size_t bytes = 0;
    fill(values);
    ck_assert_int_eq(planes_begin(&w, e, 1, N, out, MAX, NULL), SPC_OK);
    planes_put8(&w, values, 160);
    ck_assert_int_eq(planes_finish(&w, &bytes, NULL), SPC_OK);
    spc_encoder_free(e);
    ck_assert_uint_eq(out[4 + 4], 0x20);
    out[4 + 4] = 0;
    ck_assert_int_eq(planes_open(&r, 1, N, out, bytes, NULL), SPC_OK);
    planes_get8(&r, back, 160);
    ck_assert(!planes_close(&r));
}
END_TEST

int main(void)
{
    return SUITE("planes", NULL, NULL, columns_of_every_width_come_back, a_plane_is_one_frame,
                 a_window_is_no_larger_than_what_readers_keep);
}
