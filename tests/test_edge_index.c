/* Writers' index of the edge ring gives the codes that the ring itself gives. */
#include "edge_index.h"
#include "suite.h"

enum { VERTICES = 60 };

static uint32_t next(uint64_t *state, uint32_t n)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(*state >> 33) % n;
}

static void compare(const struct edge_index *x, uint32_t vertices, uint32_t found[3])
{
    for (uint32_t a = 0; a < vertices; a++) {
        ck_assert_uint_eq(corner_index_find(x, a), corner_find(&x->ring, a));
        for (uint32_t b = 0; b < vertices; b++) {
            const uint32_t code = edge_index_find(x, a, b);
            ck_assert_uint_eq(code, edge_find(&x->ring, a, b));
            found[code == EDGE_LOOSE ? 0 : code < EDGE_AGAINST ? 1 : 2]++;
        }
    }
}

/* Few vertices: edges meet often. Many triangles: the ring goes round. */
START_TEST(codes_are_the_rings)
{
    static uint32_t memory[2 * VERTICES];
    struct edge_index x;
    uint64_t state = 7;
    uint32_t found[3] = {0}, vertices = 3;
    edge_index_init(&x, memory, VERTICES);
    for (uint32_t v = 0; v < vertices; v++)
        edge_index_add_vertex(&x, v);
    compare(&x, vertices, found);
    for (int i = 0; i < 700; i++) {
        if (vertices < VERTICES && next(&state, 4) == 0)
            edge_index_add_vertex(&x, vertices++);
        const uint32_t a = next(&state, vertices), b = next(&state, vertices);
        edge_index_push_triangle(&x, a, b, next(&state, vertices), next(&state, 3) == 0);
        corner_index_push(&x, next(&state, next(&state, vertices) + 1));   /* some seldom */
        compare(&x, vertices, found);
    }
    for (int k = 0; k < 3; k++)
        ck_assert_uint_gt(found[k], 1000);
}
END_TEST

int main(void)
{
    return SUITE("edge_index", NULL, NULL, codes_are_the_rings);
}
