/* Vertices on disk: right for faces in order, given up early for faces that jump about. */
#include "suite.h"
#include "vertex_cache.h"

#include <stdlib.h>

enum { COUNT = 4000000, BATCH = 40000 };

struct fixture {
    struct spb_temp temp;
    struct spb_vertices v;
    struct spb_vertex_cache *cache;
};

static void setup(struct fixture *f, uint64_t memory)
{
    static float batch[BATCH][3];
    *f = (struct fixture){.temp = {.folder = "/tmp"}, .v = {.count = COUNT, .bytes = 12}};
    ck_assert_int_eq(spb_tmpfile_create(&f->temp, &f->v.file, NULL), SPC_OK);
    for (uint32_t i = 0; i < COUNT; i += BATCH) {
        uint64_t off;
        for (uint32_t k = 0; k < BATCH; k++)
            for (int a = 0; a < 3; a++)
                batch[k][a] = (float)((i + k) * 3 + (uint32_t)a);
        ck_assert_int_eq(spb_tmpfile_append(f->v.file, batch, sizeof batch, &off, NULL), SPC_OK);
    }
    ck_assert_int_eq(spb_vertex_cache_create(&f->v, memory, &f->cache, NULL), SPC_OK);
}

static void teardown(struct fixture *f)
{
    spb_vertex_cache_free(f->cache);
    spb_vertices_release(&f->v);
}

static enum spc_status get(struct fixture *f, uint64_t corner)
{
    uint8_t bytes[28];
    double xyz[3];
    const enum spc_status status = spb_vertex_cache_get(f->cache, corner, bytes, NULL);
    if (status != SPC_OK)
        return status;
    spb_vertex_load(&f->v, bytes, xyz);
    for (int a = 0; a < 3; a++)
        if (xyz[a] != (double)(float)(corner * 3 + (uint64_t)a))
            ck_abort_msg("vertex %llu is another one", (unsigned long long)corner);
    return SPC_OK;
}

/* As a grid's faces refer to its rows, with a jump to a far place now and then. */
START_TEST(faces_in_order_are_served)
{
    for (uint64_t memory = 0; memory <= 1 << 24; memory = memory * 4 + (1 << 20)) {
        struct fixture f;
        setup(&f, memory);
        for (uint64_t i = 0; i + 2001 < COUNT; i++) {
            if (get(&f, i) != SPC_OK || get(&f, i + 2000) != SPC_OK ||
                (i % 5000 == 0 && get(&f, i * 7919 % COUNT) != SPC_OK))
                ck_abort_msg("given up at vertex %llu", (unsigned long long)i);
        }
        ck_assert(!spb_vertex_cache_failed(f.cache));
        ck_assert_uint_le(f.temp.read, 2 * (uint64_t)COUNT * 12);
        teardown(&f);
    }
}
END_TEST

START_TEST(jumping_faces_are_given_up)
{
    struct fixture f;
    setup(&f, 1 << 22);
    enum spc_status status = SPC_OK;
    uint64_t i = 0;
    for (; i < COUNT && status == SPC_OK; i++)
        status = get(&f, i * 2654435761u % COUNT);
    ck_assert_int_eq(status, SPC_INTERNAL);
    ck_assert(spb_vertex_cache_failed(f.cache));
    ck_assert_uint_le(f.temp.read, (32 << 20) + i * 24);
    teardown(&f);
}
END_TEST

START_TEST(the_last_piece_may_be_short)
{
    struct fixture f;
    setup(&f, 0);
    for (uint64_t i = COUNT; i-- > COUNT - 10000;)
        ck_assert_int_eq(get(&f, i), SPC_OK);
    teardown(&f);
}
END_TEST

int main(void)
{
    return SUITE("vertex_cache", NULL, NULL, faces_in_order_are_served, jumping_faces_are_given_up,
                 the_last_piece_may_be_short);
}
