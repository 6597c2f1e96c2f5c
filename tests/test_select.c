/* Selection alone: cameras, angles, and that what is left out could not be seen. */
#include "bytes.h"
#include "interval.h"
#include "mesh_case.h"
#include "select.h"
#include "suite.h"

#include <math.h>
#include <stdlib.h>

/* ---- cameras ----------------------------------------------------------------------------------- */

START_TEST(a_camera_has_right_handed_unit_axes_and_refuses_nonsense)
{
    struct spv_camera c;
    const double eye[3] = {3, 2, 1}, target[3] = {0, 0, 0}, up[3] = {0, 5, 0};
    ck_assert(spv_camera_look(&c, eye, target, up, 1, 640, 480));
    for (int a = 0; a < 3; a++) {
        const double cross = c.right[(a + 1) % 3] * c.up[(a + 2) % 3] -
                             c.right[(a + 2) % 3] * c.up[(a + 1) % 3];
        ck_assert_double_eq_tol(cross, -c.forward[a], 1e-12);
    }
    ck_assert_double_eq_tol(c.focal_px, 240 / tan(0.5), 1e-9);
    ck_assert_double_gt(c.up[1], 0);
    ck_assert(!spv_camera_look(&c, eye, eye, up, 1, 640, 480));
    ck_assert(!spv_camera_look(&c, up, target, up, 1, 640, 480));
    const double tiny_eye[3] = {1e-200, 0, 0}, huge_eye[3] = {1e200, 1e200, 0};
    ck_assert(spv_camera_look(&c, tiny_eye, target, up, 1, 640, 480));
    ck_assert_double_eq(c.forward[0], -1);
    ck_assert(spv_camera_look(&c, huge_eye, target, up, 1, 640, 480));
    ck_assert_double_eq_tol(c.forward[0], -sqrt(0.5), 1e-12);
}
END_TEST

START_TEST(an_orbit_frames_the_whole_box_and_hardly_more)
{
    const double min[3] = {-3, 10, 100}, max[3] = {1, 11, 140};
    for (int i = 0; i < 200; i++) {
        struct spv_camera c;
        const double up[3] = {i % 3 == 0, i % 3 == 1, i % 3 == 2};
        double most = 0;
        ck_assert(spv_camera_orbit(&c, min, max, 0.7 * i, 0.3 * i, 0, up, i % 2 ? 0.4 : 1.6,
                                   i % 4 ? 500 : 1500, 700));
        for (int corner = 0; corner < 8; corner++) {
            double x = 0, y = 0, z = 0;
            for (int a = 0; a < 3; a++) {
                const double d = (corner >> a & 1 ? max[a] : min[a]) - c.eye[a];
                x += d * c.right[a];
                y += d * c.up[a];
                z += d * c.forward[a];
            }
            ck_assert_double_gt(z, 0);
            most = fmax(most, fmax(fabs(x / z * c.focal_px) / (c.width / 2.0),
                                   fabs(y / z * c.focal_px) / (c.height / 2.0)));
        }
        ck_assert_double_le(most, 1);
        ck_assert_double_ge(most, 0.9);
    }
}
END_TEST

START_TEST(a_pixel_of_error_is_an_angle_that_holds_in_the_corners)
{
    struct spv_camera c;
    const double eye[3] = {0, 0, 5}, target[3] = {0, 0, 0}, up[3] = {0, 1, 0};
    ck_assert(spv_camera_look(&c, eye, target, up, 1.5, 1000, 1000));
    const double eps = spv_camera_eps(&c, 1);
    /* A short radial step of e = eps r in the corner's direction moves the picture by a pixel. */
    const double t = 500 / c.focal_px * sqrt(2), theta = atan(t);
    const double step = c.focal_px * (tan(theta + eps / 2) - tan(theta - eps / 2));
    ck_assert_double_eq_tol(step, 1, 1e-3);
    ck_assert_double_gt(spv_camera_eps(&c, 1e-300), 0);
    ck_assert_double_lt(spv_camera_eps(&c, 1e300), 0x1p20);
}
END_TEST

/* ---- culling ------------------------------------------------------------------------------------ */

struct world {
    struct spc_reader *reader;
    bool *chosen;                   /* [block_count] */
    uint8_t **payload;              /* [block_count] decoded */
};

static struct world world_make(const struct case_mesh *mesh, uint32_t cluster_nodes)
{
    struct world w;
    struct spb_build_options o = case_options(case_write(mesh, "a.ply"), case_path("a.spc"));
    o.cluster_nodes = cluster_nodes;
    w.reader = case_build(&o);
    const uint32_t n = spc_reader_header(w.reader)->block_count;
    w.chosen = calloc(n, sizeof *w.chosen);
    w.payload = calloc(n, sizeof *w.payload);
    for (uint32_t k = 0; k < n; k++) {
        struct spc_block b;
        spc_reader_block(w.reader, k, &b);
        w.payload[k] = malloc(b.raw_bytes);
        ck_assert_int_eq(spc_block_decode(w.reader, k, true, w.payload[k], NULL), SPC_OK);
    }
    return w;
}

static void world_free(struct world *w)
{
    for (uint32_t k = 0; k < spc_reader_header(w->reader)->block_count; k++)
        free(w->payload[k]);
    free(w->payload);
    free(w->chosen);
    spc_reader_close(w->reader);
}

/* Does any corner of the node's bounding cube project into the picture (or lie about the eye)? */
static bool may_be_seen(const struct spv_camera *c, const struct spc_node *n, double unit)
{
    const double reach = n->radius * unit;
    double d[3] = {0, 0, 0};
    for (int a = 0; a < 3; a++) {
        d[0] += (n->center[a] - c->eye[a]) * c->right[a];
        d[1] += (n->center[a] - c->eye[a]) * c->up[a];
        d[2] += (n->center[a] - c->eye[a]) * c->forward[a];
    }
    if (d[2] + reach < 0)
        return false;
    const double x = c->width / 2.0 / c->focal_px, y = c->height / 2.0 / c->focal_px;
    return fabs(d[0]) - reach * sqrt(1 + x * x) < x * d[2] &&
           fabs(d[1]) - reach * sqrt(1 + y * y) < y * d[2];
}

/* Every node that is drawn and may be seen lies in a chosen block. Returns how many do. */
static uint64_t expect_nothing_missing(const struct world *w, const struct spv_view *view)
{
    const struct spc_header *h = spc_reader_header(w->reader);
    const double unit = ldexp(1, h->unit_exp);
    uint64_t seen = 0;
    for (uint32_t k = 0; k < h->block_count; k++) {
        struct spc_block b;
        struct spc_block_layout l;
        struct spc_cluster c;
        double eye[3];
        spc_reader_block(w->reader, k, &b);
        spc_reader_cluster(w->reader, b.cluster, &c);
        spc_block_layout(&b, h->flags, h->normal_clusters, &l);
        spv_eye_of_cluster(w->reader, &c, &view->camera, eye);
        const bool leaf = b.kind == SPC_BLOCK_LEAF;
        const struct spv_interval in = {
            .origin = {(float)-eye[0], (float)-eye[1], (float)-eye[2]},
            .step = ldexpf(1, b.step_exp - h->unit_exp), .eps = (float)view->eps,
            .link_base = b.link_base, .lower = !leaf || view->mode == SPV_HYBRID, .missing = -1,
        };
        for (uint32_t i = 0; i < b.node_count; i++) {
            const uint8_t *record = w->payload[k] + l.nodes + 16 * i;
            struct spc_node n;
            if (!spv_interval_point(&in, record) &&
                !(leaf && view->mode == SPV_HYBRID && spv_interval_triangle(&in, record)))
                continue;
            spc_node_decode(w->reader, &b, &l, w->payload[k], i, &n);
            if (!may_be_seen(&view->camera, &n, unit))
                continue;
            seen++;
            if (!w->chosen[k])
                ck_abort_msg("node %u of block %u (cluster %u, kind %d) is drawn, not chosen", i, k,
                             b.cluster, (int)b.kind);
        }
    }
    return seen;
}

static struct spv_view random_view(uint64_t *state, int i)
{
    struct spv_view view = {.mode = i % 3 == 0 ? SPV_POINTS : SPV_HYBRID, .cull = true};
    double eye[3], target[3];
    const double up[3] = {0, 0.1, 1};
    const double far = i % 5 == 0 ? 30 : i % 5 == 1 ? 3 : 0.7;
    for (int a = 0; a < 3; a++) {
        eye[a] = far * (case_random(state) - 0.5) + 0.3;
        target[a] = case_random(state) - 0.2;
    }
    ck_assert(spv_camera_look(&view.camera, eye, target, up, 0.02 + 2.5 * case_random(state),
                              50 + i % 700, 50 + i % 333));
    view.eps = spv_camera_eps(&view.camera, exp2(12 * case_random(state) - 4));
    return view;
}

START_TEST(what_is_drawn_and_may_be_seen_is_chosen)
{
    uint64_t state = 21;
    for (int m = 0; m < 3; m++) {
        struct case_mesh mesh = m == 0 ? case_sheet(6000, 1) : m == 1 ? case_soup(4000, 2)
                                                                 : case_sheet(3000, 5);
        struct world w = world_make(&mesh, m == 2 ? 24 : 300);
        struct spv_selection s = {0};
        uint64_t seen = 0, left_out = 0;
        const uint32_t blocks = spc_reader_header(w.reader)->block_count;
        for (int i = 0; i < 400; i++) {
            const struct spv_view view = random_view(&state, i);
            ck_assert_int_eq(spv_select(w.reader, &view, &s, NULL), SPC_OK);
            memset(w.chosen, 0, blocks * sizeof *w.chosen);
            for (uint32_t k = 0; k < s.block_count; k++)
                w.chosen[s.blocks[k].block] = true;
            left_out += blocks - s.block_count;
            seen += expect_nothing_missing(&w, &view);
        }
        ck_assert_uint_gt(seen, 100000);
        ck_assert_uint_gt(left_out, 400 * blocks / 4);          /* and it does leave things out */
        spv_selection_release(&s);
        world_free(&w);
        case_mesh_free(&mesh);
    }
}
END_TEST

/* A cone and a sphere against every normal and point they hold, by sampling. */
START_TEST(only_whole_groups_seen_from_behind_are_left_out)
{
    uint64_t state = 4;
    int behind = 0;
    for (int i = 0; i < 3000; i++) {
        double eye[3], axis[3], length = 0;
        const float sphere[4] = {0.1f, -0.2f, 0.3f, (float)(0.5 * case_random(&state))};
        const double half = 1.7 * case_random(&state);
        for (int a = 0; a < 3; a++) {
            eye[a] = 6 * (case_random(&state) - 0.5);
            axis[a] = case_random(&state) - 0.5;
            length += axis[a] * axis[a];
        }
        for (int a = 0; a < 3; a++)
            axis[a] /= sqrt(length);
        if (!spv_all_behind(eye, sphere, axis, cos(half)))
            continue;
        behind++;
        for (int k = 0; k < 200; k++) {
            double n[3], p[3], dot = 0, n2 = 0, p2 = 0;
            for (int a = 0; a < 3; a++) {
                n[a] = case_random(&state) - 0.5;
                p[a] = case_random(&state) - 0.5;
                n2 += n[a] * n[a];
                p2 += p[a] * p[a];
            }
            for (int a = 0; a < 3; a++)         /* into the cone: towards its axis */
                n[a] = axis[a] * cos(half) + (n[a] / sqrt(n2) - axis[a]) * 0.5 * sin(half) * 0.5;
            n2 = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
            const double c = (n[0] * axis[0] + n[1] * axis[1] + n[2] * axis[2]) / n2;
            if (c < cos(half))
                continue;
            for (int a = 0; a < 3; a++)
                dot += n[a] * (eye[a] - (double)sphere[a] - p[a] / sqrt(p2) * (double)sphere[3]);
            ck_assert_double_le(dot, 0);
        }
    }
    ck_assert_int_gt(behind, 200);
    const double eye[3] = {0, 0, 5}, axis[3] = {0, 0, -1}, away[3] = {0, 0, 1};
    const float sphere[4] = {0, 0, 0, 1};
    ck_assert(spv_all_behind(eye, sphere, axis, cos(1.2)));
    ck_assert(!spv_all_behind(eye, sphere, axis, cos(1.4)));    /* 90 - asin(1/5) = 1.369 */
    ck_assert(spv_all_behind(eye, sphere, axis, cos(1.36)));
    ck_assert(!spv_all_behind(eye, sphere, away, cos(0.1)));
    ck_assert(!spv_all_behind(eye, sphere, axis, -1));
}
END_TEST

int main(void)
{
    return SUITE("select", case_start, case_finish,
                 a_camera_has_right_handed_unit_axes_and_refuses_nonsense,
                 an_orbit_frames_the_whole_box_and_hardly_more,
                 a_pixel_of_error_is_an_angle_that_holds_in_the_corners,
                 what_is_drawn_and_may_be_seen_is_chosen,
                 only_whole_groups_seen_from_behind_are_left_out);
}
