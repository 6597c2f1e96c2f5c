/*
 * shapes.c - what the lattice has made of the triangles of a cluster: those that are no longer what
 * they were are counted, so that nobody loses them without being told.
 *
 * Looked at closely are only those that may be: small ones, and those without area.
 */
#include "pack_int.h"

#include "vec.h"
#include "vectors.h"

/* Of its longest edge, what a corner may move by: 2^-4. And below which share of it a height is none. */
static const double MOVED = 0x1p-4, FLAT = 0x1p-20;

/* Small or flat, as they are now. Returns whether any is. */
SPB_VECTORS static int32_t find_suspects(const struct leaf_batch *b, double small, int32_t *suspect,
                                         uint32_t count)
{
    int32_t any = 0;
    for (uint32_t i = 0; i < count; i++) {
        const double ax = b->corner[1][0][i] - b->corner[0][0][i];
        const double ay = b->corner[1][1][i] - b->corner[0][1][i];
        const double az = b->corner[1][2][i] - b->corner[0][2][i];
        const double bx = b->corner[2][0][i] - b->corner[0][0][i];
        const double by = b->corner[2][1][i] - b->corner[0][1][i];
        const double bz = b->corner[2][2][i] - b->corner[0][2][i];
        const double s0 = square_of(ax, ay, az), s1 = square_of(bx, by, bz);
        const double s2 = square_of(bx - ax, by - ay, bz - az);
        const double x = ay * bz - az * by, y = az * bx - ax * bz, z = ax * by - ay * bx;
        const bool is_small = (s0 < small) & (s1 < small) & (s2 < small);
        const bool is_flat = (x == 0) & (y == 0) & (z == 0);
        suspect[i] = is_small ? 1 : is_flat ? 2 : 0;
        any |= suspect[i];
    }
    return any;
}

static double longest_of(const double c[3][3])
{
    double most = 0;
    for (int k = 0; k < 3; k++) {
        double edge[3];
        vec_sub(c[(k + 1) % 3], c[k], edge);
        most = larger_of(most, vec_dot(edge, edge));
    }
    return most;
}

static double twice_area(const double c[3][3])
{
    double a[3], b[3], n[3];
    vec_sub(c[1], c[0], a);
    vec_sub(c[2], c[0], b);
    vec_cross(a, b, n);
    return vec_length(n);
}

/* was, is: corners in lattice steps. */
static void judge(const double was[3][3], const double is[3][3], double step, struct spb_shapes *out)
{
    const double longest = longest_of(was);         /* squared */
    double moved = 0;
    for (int k = 0; k < 3; k++) {
        double by[3];
        vec_sub(is[k], was[k], by);
        moved = larger_of(moved, vec_dot(by, by));
    }
    if (moved > MOVED * MOVED * longest && longest > 0) {
        const double size = sqrt(longest) * step;
        out->least = out->moved == 0 || size < out->least ? size : out->least;
        out->most = larger_of(out->most, size);
        out->moved++;
    } else if (!(twice_area(is) > 0) && twice_area(was) > FLAT * longest) {
        out->flat++;
    }
}

void pack_shapes(struct pack *p, const double file[3][3][PACK_BATCH], const struct leaf_batch *b,
                 const double shift[3], uint32_t count)
{
    const struct spb_space *space = p->shared->space;
    const double step = times_exp2(1, spb_space_finest(space));
    const double small = times_exp2(18, space->coarse_exp - space->vertex_exp);     /* 16, and moved */
    int32_t suspect[PACK_BATCH];
    if (find_suspects(b, small * small, suspect, count) == 0)
        return;
    for (uint32_t i = 0; i < count; i++) {
        double was[3][3], is[3][3];
        for (int k = 0; k < 9 && suspect[i]; k++) {
            const int a = k % 3;
            was[k / 3][a] = spb_space_from_file(space, a, file[k / 3][a][i]) / step;
            is[k / 3][a] = b->corner[k / 3][a][i] - shift[a];
        }
        if (suspect[i])
            judge((const double(*)[3])was, (const double(*)[3])is, step, &p->out->shapes);
    }
}
