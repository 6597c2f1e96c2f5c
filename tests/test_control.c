#include "control.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "suite.h"

static uint64_t random_state;

static uint64_t random_u64(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return random_state;
}

static double uniform(double from, double to)
{
    return from + (to - from) * (double)(random_u64() >> 11) * 0x1p-53;
}

/* A scene: a ball that fills its box, seen where rays meet it. */
struct ball {
    double middle[3], radius;
};

static bool ball_depth(void *ctx, const struct spv_camera *k, double x, double y, double *depth)
{
    const struct ball *ball = ctx;
    const double rx = (x - k->width / 2.0) / k->focal_px, ry = (k->height / 2.0 - y) / k->focal_px;
    double ray[3], m[3], rr = 0, rm = 0, mm = 0;
    for (int a = 0; a < 3; a++) {
        ray[a] = rx * k->right[a] + ry * k->up[a] + k->forward[a];
        m[a] = (ball->middle[a] - k->eye[a]) / ball->radius;
        rr += ray[a] * ray[a];
        rm += ray[a] * m[a];
        mm += m[a] * m[a];
    }
    const double root = rm * rm - rr * (mm - 1);
    if (!(root >= 0) || !(rm > 0))
        return false;
    const double t = (rm - sqrt(root)) / rr;
    *depth = (t > 0 ? t : (rm + sqrt(root)) / rr) * ball->radius;
    return true;
}

static const double SCENES[][4] = {             /* middle, half side */
    {0, 0, 0, 1}, {0, 0, 0, 1e-12}, {0, 0, 0, 1e12}, {5e5, 5.4e6, 120, 0.5}, {5e5, 5.4e6, 120, 300},
    {-3e-12, 1e-12, 0, 1e-12}, {1e12, -4e12, 0, 1e11}, {0, 0, 0, 1e-60}, {1e60, 0, 0, 1e60},
};
enum { SCENE_COUNT = sizeof SCENES / sizeof *SCENES };
static const double UPS[][3] = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}, {0, -1, 0}, {0, 0, -1}, {-1, 0, 0}, {1, 2, -1}};

static void start(struct spv_control *c, struct ball *ball, const double scene[4], const double up[3],
                  double fov, int width, int height)
{
    double low[3], high[3];
    for (int a = 0; a < 3; a++) {
        ball->middle[a] = scene[a];
        low[a] = scene[a] - scene[3];
        high[a] = scene[a] + scene[3];
    }
    ball->radius = scene[3];
    ck_assert(spv_control_init(c, low, high, up, fov, width, height, ball_depth, ball));
}

static void project(const struct spv_camera *k, const double p[3], double px[2])
{
    double v[3] = {0, 0, 0};
    for (int a = 0; a < 3; a++) {
        v[0] += (p[a] - k->eye[a]) * k->right[a];
        v[1] += (p[a] - k->eye[a]) * k->up[a];
        v[2] += (p[a] - k->eye[a]) * k->forward[a];
    }
    px[0] = k->width / 2.0 + k->focal_px * v[0] / v[2];
    px[1] = k->height / 2.0 - k->focal_px * v[1] / v[2];
}

static bool surface(const struct spv_control *c, double x, double y, double p[3])
{
    const struct spv_camera *k = &c->camera;
    double depth;
    if (!ball_depth(c->ctx, k, x, y, &depth))
        return false;
    for (int a = 0; a < 3; a++)
        p[a] = k->eye[a] + depth * ((x - k->width / 2.0) / k->focal_px * k->right[a] +
                                    (k->height / 2.0 - y) / k->focal_px * k->up[a] + k->forward[a]);
    return true;
}

static void assert_near(const struct spv_control *c, const double p[3], double x, double y, double most,
                        const char *what)
{
    double px[2];
    project(&c->camera, p, px);
    if (!(hypot(px[0] - x, px[1] - y) < most))
        ck_abort_msg("%s: off by %g px at eye %g %g %g", what, hypot(px[0] - x, px[1] - y), c->camera.eye[0],
                     c->camera.eye[1], c->camera.eye[2]);
}

static void assert_at(const struct spv_control *c, const double p[3], double x, double y, const char *what)
{
    assert_near(c, p, x, y, 1e-3, what);
}

static double scalar(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void assert_sane(const struct spv_control *c)
{
    const struct spv_camera *k = &c->camera;
    const double *axes[3] = {k->right, k->up, k->forward};
    for (int i = 0; i < 3; i++) {
        if (!isfinite(k->eye[i]))
            ck_abort_msg("the eye is at %g", k->eye[i]);
        for (int j = 0; j < 3; j++)
            if (!(fabs(scalar(axes[i], axes[j]) - (i == j)) <= 1e-12))
                ck_abort_msg("axes %d and %d: %.17g", i, j, scalar(axes[i], axes[j]));
    }
    if (!(k->focal_px > 0) || !isfinite(k->focal_px))
        ck_abort_msg("focal %g", k->focal_px);
}

static enum spv_action pointer(struct spv_control *c, enum spv_event_kind kind, int button, double x, double y)
{
    const struct spv_event e = {.kind = kind, .button = button, .x = x, .y = y, .clicks = 1};
    return spv_control_event(c, &e);
}

static void wheel(struct spv_control *c, double x, double y, double steps)
{
    spv_control_event(c, &(struct spv_event){.kind = SPV_EVENT_WHEEL, .x = x, .y = y, .steps = steps});
}

static enum spv_action key(struct spv_control *c, int k, unsigned modifiers)
{
    return spv_control_event(c, &(struct spv_event){.kind = SPV_EVENT_KEY, .key = k, .modifiers = modifiers});
}

static void settle(struct spv_control *c)
{
    for (int i = 0; i < 60 && spv_control_moving(c); i++)
        spv_control_step(c, 1.0 / 60);
    ck_assert(!spv_control_moving(c));
}

static double away(const struct spv_control *c, const double p[3])
{
    return hypot(hypot(c->camera.eye[0] - p[0], c->camera.eye[1] - p[1]), c->camera.eye[2] - p[2]);
}

/* ---- what users expect --------------------------------------------------------------------------- */

START_TEST(it_begins_as_spc_render_frames_and_presets_come_to_its_views)
{
    static const struct { int key; double az, el; } views[] = {
        {'1', 0, 0}, {'2', 180, 0}, {'3', -90, 0}, {'4', 90, 0}, {'5', 0, 90}, {'6', 0, -90}, {SPV_KEY_HOME, 0, 0}};
    const double degree = 3.14159265358979323846 / 180;
    for (size_t u = 0; u < 7; u++)
        for (size_t i = 0; i < 7; i++) {
            const double low[3] = {-1, -2, 3}, high[3] = {4, 2, 8};
            struct spv_control c;
            struct spv_camera want;
            ck_assert(spv_control_init(&c, low, high, UPS[u], 45, 800, 600, NULL, NULL));
            if (i > 0)
                spv_control_turn(&c, 33, 21);
            key(&c, views[i].key, 0);
            settle(&c);
            ck_assert(spv_camera_orbit(&want, low, high, views[i].az * degree, views[i].el * degree, 0, UPS[u],
                                       45 * degree, 800, 600));
            for (int a = 0; a < 3; a++) {
                ck_assert_double_eq_tol(c.camera.eye[a], want.eye[a], 1e-12);
                ck_assert_double_eq_tol(c.camera.up[a], want.up[a], 1e-12);
                ck_assert_double_eq_tol(c.camera.forward[a], want.forward[a], 1e-12);
            }
        }
}
END_TEST

START_TEST(the_pivot_stays_on_its_pixel_while_orbiting_and_nothing_rolls)
{
    random_state = 11;
    for (int round = 0; round < 300; round++) {
        struct spv_control c;
        struct ball ball;
        double px[2], p[3];
        const double *up = UPS[random_u64() % 7];
        start(&c, &ball, SCENES[random_u64() % SCENE_COUNT], up, uniform(5, 100), 1600, 900);
        wheel(&c, uniform(600, 1000), uniform(300, 600), uniform(-5, 40));
        project(&c.camera, c.at.pivot, px);
        pointer(&c, SPV_EVENT_BUTTON, SPV_BUTTON_LEFT, 800, 450);
        memcpy(p, c.at.pivot, sizeof p);
        project(&c.camera, p, px);
        double x = 800, y = 450;
        for (int i = 0; i < 100; i++) {
            x += uniform(-90, 90);
            y += uniform(-90, 90);
            pointer(&c, SPV_EVENT_MOVE, 0, x, y);
            assert_at(&c, p, px[0], px[1], "pivot");
            const double tilt = scalar(c.camera.right, up) / sqrt(scalar(up, up));
            ck_assert_double_eq_tol(tilt, 0, 1e-9);
            ck_assert(scalar(c.camera.up, up) > 0);
        }
        pointer(&c, SPV_EVENT_BUTTON_UP, SPV_BUTTON_LEFT, x, y);
    }
}
END_TEST

START_TEST(dragging_right_turns_the_model_right_and_down_shows_its_top)
{
    struct spv_control c;
    struct ball ball;
    start(&c, &ball, SCENES[0], UPS[0], 45, 1000, 1000);
    pointer(&c, SPV_EVENT_BUTTON, SPV_BUTTON_LEFT, 500, 500);
    pointer(&c, SPV_EVENT_MOVE, 0, 600, 500);
    ck_assert(c.camera.eye[0] < -0.1);          /* from the model's left: its front went right */
    ck_assert_double_eq_tol(c.camera.eye[1], 0, 1e-12);
    pointer(&c, SPV_EVENT_MOVE, 0, 600, 600);
    ck_assert(c.camera.eye[1] > 0.1);
    pointer(&c, SPV_EVENT_MOVE, 0, 600, 99999);
    ck_assert(c.camera.forward[1] < -0.9999 && c.camera.forward[1] > -1);
    pointer(&c, SPV_EVENT_BUTTON_UP, SPV_BUTTON_LEFT, 0, 0);
    spv_control_step(&c, 0);
    pointer(&c, SPV_EVENT_MOVE, 0, 0, 0);
    ck_assert(!spv_control_step(&c, 0.02));
}
END_TEST

START_TEST(what_was_grabbed_stays_under_the_pointer)
{
    random_state = 12;
    for (int round = 0; round < 400; round++) {
        struct spv_control c;
        struct ball ball;
        double p[3];
        start(&c, &ball, SCENES[random_u64() % SCENE_COUNT], UPS[random_u64() % 7], uniform(1, 120), 1600, 900);
        spv_control_turn(&c, uniform(-180, 180), uniform(-80, 80));
        wheel(&c, 800, 450, uniform(-5, 60));
        double x = uniform(700, 900), y = uniform(350, 550);
        if (!surface(&c, x, y, p))
            continue;
        struct spv_event e = {.kind = SPV_EVENT_BUTTON, .x = x, .y = y, .clicks = 1,
                              .button = round % 3 == 0 ? SPV_BUTTON_LEFT : round % 3 == 1 ? SPV_BUTTON_RIGHT
                                                                                           : SPV_BUTTON_MIDDLE,
                              .modifiers = round % 3 == 0 ? SPV_SHIFT : 0};
        spv_control_event(&c, &e);
        for (int i = 0; i < 50; i++) {
            x = uniform(0, 1600);
            y = uniform(0, 900);
            pointer(&c, SPV_EVENT_MOVE, 0, x, y);
            assert_at(&c, p, x, y, "grabbed");
        }
    }
}
END_TEST

START_TEST(zoom_keeps_the_point_under_the_cursor_and_never_goes_through_it)
{
    random_state = 13;
    for (int round = 0; round < 300; round++) {
        struct spv_control c;
        struct ball ball;
        double p[3], now_p[3];
        const double *scene = SCENES[random_u64() % SCENE_COUNT];
        start(&c, &ball, scene, UPS[random_u64() % 7], uniform(1, 120), 1600, 900);
        spv_control_turn(&c, uniform(-180, 180), uniform(-80, 80));
        const double x = uniform(600, 1000), y = uniform(250, 650);
        if (!surface(&c, x, y, p))
            continue;
        double last = away(&c, p);
        for (int i = 0; i < 200; i++) {
            ck_assert(surface(&c, x, y, now_p));
            wheel(&c, x, y, 1);
            spv_control_step(&c, 0.02);
            assert_near(&c, now_p, x, y, 3e-4, "zoomed");
            /* p is known no better than where it was first seen from: 1e-16 of that distance. */
            assert_near(&c, p, x, y, 0.02, "zoomed so far");
            const double now = away(&c, p);
            ck_assert(now > 0 && now <= last * (1 + 1e-6));
            if (i == 0)
                ck_assert_double_eq_tol(now / last, 0.85, 1e-6);
            last = now;
        }
        ck_assert(last < 0.05 * scene[3] || fabs(scene[1]) > 10 * scene[3]);
        for (int i = 0; i < 100; i++) {
            wheel(&c, x, y, -3);
            assert_near(&c, p, x, y, 0.02, "zoomed out");
            assert_sane(&c);
        }
        ck_assert(away(&c, ball.middle) > 100 * scene[3] && away(&c, ball.middle) < 1e6 * scene[3] + 1);
    }
}
END_TEST

/* The depth buffer of the picture that was drawn before the wheel turned. */
static bool stale_depth(void *ctx, const struct spv_camera *camera, double x, double y, double *depth)
{
    (void)camera;
    (void)x;
    (void)y;
    *depth = *(const double *)ctx;
    return true;
}

START_TEST(many_steps_of_the_wheel_before_the_next_picture_do_not_go_through)
{
    struct spv_control c;
    const double low[3] = {-1, -1, -1}, high[3] = {1, 1, 1}, up[3] = {0, 1, 0};
    double depth = 1;
    ck_assert(spv_control_init(&c, low, high, up, 45, 100, 100, stale_depth, &depth));
    const double from = c.camera.eye[2];
    for (int i = 0; i < 40; i++)
        wheel(&c, 50, 50, 1);
    ck_assert(from - c.camera.eye[2] < 1);
    spv_control_step(&c, 1);        /* a pause: then what is there counts anew */
    wheel(&c, 50, 50, 1);
    ck_assert_double_eq_tol(from - c.camera.eye[2], 1 + 0.15, 1e-2);
}
END_TEST

START_TEST(without_a_surface_zoom_goes_towards_the_depth_of_the_pivot)
{
    struct spv_control c;
    const double low[3] = {-1, -1, -1}, high[3] = {1, 1, 1}, up[3] = {0, 1, 0};
    ck_assert(spv_control_init(&c, low, high, up, 45, 100, 100, NULL, NULL));
    const double from = c.camera.eye[2];
    wheel(&c, 50, 50, 2);
    ck_assert_double_eq_tol(c.camera.eye[2], from * 0.85 * 0.85, 1e-9);
    for (int i = 0; i < 400; i++)
        wheel(&c, 50, 50, 50);
    ck_assert(c.camera.eye[2] > 0 && c.camera.eye[2] < 1e-6);
    const double near = c.camera.eye[2];
    wheel(&c, 90, 10, -30);
    ck_assert(c.camera.eye[2] > 100 * near);
}
END_TEST

START_TEST(a_double_click_brings_the_point_to_the_middle_and_turns_about_it)
{
    struct spv_control c;
    struct ball ball;
    double p[3], px[2];
    start(&c, &ball, SCENES[3], UPS[1], 45, 1000, 800);
    ck_assert(surface(&c, 600, 300, p));
    const double before = scalar(c.camera.forward, p) - scalar(c.camera.forward, c.camera.eye);
    struct spv_event e = {.kind = SPV_EVENT_BUTTON, .x = 600, .y = 300, .clicks = 2};
    spv_control_event(&c, &e);
    assert_at(&c, p, 600, 300, "before it moves");
    pointer(&c, SPV_EVENT_MOVE, 0, 602, 301);           /* a hand that trembles */
    double last = hypot(100, 100);
    for (int i = 0; i < 14; i++) {
        ck_assert(spv_control_moving(&c));
        ck_assert(spv_control_step(&c, 1.0 / 60));
        project(&c.camera, p, px);
        const double off = hypot(px[0] - 500, px[1] - 400);
        ck_assert(off < last);
        last = off;
    }
    settle(&c);
    assert_at(&c, p, 500, 400, "after");
    const double depth = scalar(c.camera.forward, p) - scalar(c.camera.forward, c.camera.eye);
    ck_assert_double_eq_tol(depth, before, 1e-6);
    pointer(&c, SPV_EVENT_BUTTON, SPV_BUTTON_LEFT, 100, 100);
    pointer(&c, SPV_EVENT_MOVE, 0, 400, 300);
    assert_at(&c, p, 500, 400, "turned");
    pointer(&c, SPV_EVENT_BUTTON_UP, SPV_BUTTON_LEFT, 400, 300);
    e.x = e.y = 1;                  /* nothing there: nothing happens */
    spv_control_step(&c, 0);
    spv_control_event(&c, &e);
    ck_assert(!spv_control_moving(&c) && !spv_control_step(&c, 0.1));
}
END_TEST

START_TEST(animations_take_a_quarter_second_and_the_short_way_and_end_when_the_user_acts)
{
    struct spv_control c;
    struct ball ball;
    start(&c, &ball, SCENES[0], UPS[0], 45, 1000, 800);
    spv_control_orbit(&c, 170, 0, 0);
    key(&c, '3', 0);                /* -90: by 100 degrees over the back, not by 260 */
    for (int i = 0; i < 14; i++) {
        spv_control_step(&c, 1.0 / 60);
        ck_assert(c.camera.eye[2] < 1e-9 || c.camera.eye[0] < 0);
    }
    ck_assert(spv_control_moving(&c));
    spv_control_step(&c, 2.0 / 60);
    ck_assert(!spv_control_moving(&c));
    key(&c, 'f', 0);
    key(&c, '1', 0);
    spv_control_step(&c, 0.1);
    pointer(&c, SPV_EVENT_BUTTON, SPV_BUTTON_RIGHT, 10, 10);
    ck_assert(!spv_control_moving(&c));
    start(&c, &ball, SCENES[4], UPS[0], 45, 1000, 800);
    const double far = away(&c, ball.middle);
    wheel(&c, 300, 300, 12);
    key(&c, 'f', 0);
    settle(&c);
    ck_assert_double_eq_tol(away(&c, ball.middle) / far, 1, 1e-9);
}
END_TEST

START_TEST(a_pivot_out_of_the_picture_is_replaced)
{
    struct spv_control c;
    struct ball ball;
    double p[3];
    start(&c, &ball, SCENES[0], UPS[0], 45, 1000, 1000);
    const struct spv_pose past = {{0, 0, 5}, {0, 3, 4.5}, {0, 1, 0}, 45};
    ck_assert(spv_control_place(&c, &past));
    spv_control_fit(&c);            /* the pivot is the middle of the scene again */
    wheel(&c, 300, 400, 20);
    pointer(&c, SPV_EVENT_BUTTON, SPV_BUTTON_LEFT, 0, 0);
    ck_assert(surface(&c, 500, 500, p));
    for (int a = 0; a < 3; a++)
        ck_assert_double_eq_tol(c.at.pivot[a], p[a], 1e-9);
    pointer(&c, SPV_EVENT_MOVE, 0, 300, 200);
    assert_at(&c, p, 500, 500, "new pivot");
}
END_TEST

START_TEST(flying_goes_by_time_at_a_speed_that_goes_with_the_distance)
{
    struct spv_control c;
    struct ball ball;
    start(&c, &ball, SCENES[0], UPS[1], 45, 1000, 1000);
    ck_assert_int_eq(key(&c, 'q', 0), SPV_ACTION_QUIT);
    ck_assert_int_eq(key(&c, 'a', 0), SPV_ACTION_ANTIALIAS);
    key(&c, 'v', 0);
    ck_assert(c.flying);
    const double far = -c.camera.eye[1] - 1;            /* from the surface; the front is -y */
    spv_control_step(&c, 0);
    key(&c, 'w', 0);
    ck_assert(spv_control_moving(&c));
    ck_assert(spv_control_step(&c, 0.1));
    ck_assert_double_eq_tol(-c.camera.eye[1] - 1, far * 0.9, 1e-9);
    key(&c, 'w', SPV_SHIFT);
    spv_control_step(&c, 0.1);
    ck_assert_double_eq_tol(-c.camera.eye[1] - 1, far * 0.9 * 0.6, 1e-9);
    key(&c, 'w', SPV_CONTROL);
    spv_control_step(&c, 0.1);
    ck_assert_double_eq_tol(-c.camera.eye[1] - 1, far * 0.9 * 0.6 * 0.975, 1e-9);
    key(&c, 's', 0);                /* opposite ones cancel */
    ck_assert(!spv_control_step(&c, 0.1));
    for (int k = 0; k < 2; k++)
        spv_control_event(&c, &(struct spv_event){.kind = SPV_EVENT_KEY_UP, .key = "ws"[k]});
    ck_assert(!spv_control_moving(&c));
    const double eye[3] = {c.camera.eye[0], c.camera.eye[1], c.camera.eye[2]};
    key(&c, 'd', 0);
    key(&c, 'e', 0);
    spv_control_step(&c, 0.1);
    ck_assert(c.camera.eye[0] > eye[0] && c.camera.eye[2] > eye[2]);
    ck_assert_int_eq(key(&c, SPV_KEY_ESCAPE, 0), SPV_ACTION_NONE);
    ck_assert(!c.flying && !spv_control_moving(&c));
    ck_assert_int_eq(key(&c, SPV_KEY_ESCAPE, 0), SPV_ACTION_BACK);
}
END_TEST

START_TEST(looking_around_leaves_the_eye_where_it_is)
{
    struct spv_control c;
    struct ball ball;
    start(&c, &ball, SCENES[3], UPS[1], 45, 1000, 1000);
    key(&c, 'v', 0);
    const double eye[3] = {c.camera.eye[0], c.camera.eye[1], c.camera.eye[2]};
    pointer(&c, SPV_EVENT_BUTTON, SPV_BUTTON_LEFT, 500, 500);
    pointer(&c, SPV_EVENT_MOVE, 0, 700, 400);
    ck_assert(c.camera.forward[0] > 0.1 && c.camera.forward[2] > 0.05);         /* to the right, up */
    for (int i = 0; i < 200; i++)
        pointer(&c, SPV_EVENT_MOVE, 0, 500 + 300 * sin(i), 500 + 200 * cos(i));
    for (int a = 0; a < 3; a++)
        ck_assert(c.camera.eye[a] == eye[a]);
}
END_TEST

/* ---- limits ---------------------------------------------------------------------------------------- */

static bool random_depth(void *ctx, const struct spv_camera *camera, double x, double y, double *depth)
{
    static const double odd[] = {0, -1, 1e300, 1e-300, DBL_MAX, 5e-324, INFINITY, NAN};
    (void)ctx;
    (void)x;
    (void)y;
    const uint64_t kind = random_u64() % 24;
    *depth = kind < 8 ? odd[kind] : pow(10, uniform(-3, 3)) * (1 + fabs(camera->eye[0]));
    return kind != 23;
}

static void random_event(struct spv_control *c)
{
    static const int keys[] = {'f', '1', '2', '3', '4', '5', '6', 'v', 'w', 'a', 's', 'd', 'q', 'e', SPV_KEY_HOME,
                               SPV_KEY_LEFT, SPV_KEY_RIGHT, SPV_KEY_UP, SPV_KEY_DOWN, SPV_KEY_PAGE_UP,
                               SPV_KEY_PAGE_DOWN, SPV_KEY_ESCAPE, 0, -1, 999};
    static const double odd[] = {NAN, INFINITY, -INFINITY, 1e300, -1e300, DBL_MAX};
    struct spv_event e = {.kind = (enum spv_event_kind)(random_u64() % (SPV_EVENT_CLOSE + 1)),
                          .key = keys[random_u64() % (sizeof keys / sizeof *keys)],
                          .button = (int)(random_u64() % 4), .clicks = 1 + (int)(random_u64() % 2),
                          .modifiers = (unsigned)(random_u64() % 8), .repeats = random_u64() % 4 == 0,
                          .x = uniform(-500, 3000), .y = uniform(-500, 3000), .steps = uniform(-9, 9),
                          .width = (int)(random_u64() % 70000) - 20, .height = (int)(random_u64() % 70000) - 20};
    if (random_u64() % 40 == 0)
        e.x = odd[random_u64() % 6];
    if (random_u64() % 40 == 0)
        e.steps = odd[random_u64() % 6];
    if (e.kind == SPV_EVENT_RESIZE && random_u64() % 4 != 0)
        e.kind = SPV_EVENT_MOVE;
    spv_control_event(c, &e);
}

START_TEST(storms_of_events_at_extreme_scales_leave_the_camera_whole)
{
    static const double boxes[][6] = {
        {-1, -1, -1, 1, 1, 1}, {0, 0, 0, 1e-12, 1e-12, 1e-12}, {-1e12, 0, 0, 1e12, 1e12, 1}, {0, 0, 0, 0, 0, 0},
        {5e5, 5.4e6, 100, 5e5 + 1e-3, 5.4e6 + 1e-3, 100}, {7, 7, 7, 7, 7, 7}, {1e12, 1e12, 1e12, 1e12, 1e12, 1e12},
        {-1e280, -1e280, -1e280, 1e280, 1e280, 1e280}, {0, 0, 0, 1e-280, 0, 0}, {0, 0, 0, 5e-324, 0, 0},
        {1e280, 1e280, 1e280, 1e280, 1e280, 1e280}, {-1e-3, -1e12, 0, 1e-3, 1e12, 0},
    };
    static const double fovs[] = {0.01, 45, 179, 60};
    static const double times[] = {0, 1.0 / 60, 0.3, 1e9, -1, NAN, INFINITY, 0.005};
    random_state = 20260101;
    printf("seed %llu\n", (unsigned long long)random_state);
    for (int round = 0; round < 600; round++) {
        struct spv_control c;
        const double *box = boxes[round % 12];
        ck_assert(spv_control_init(&c, box, box + 3, UPS[random_u64() % 7], fovs[random_u64() % 4],
                                   1 + (int)(random_u64() % 3000), 1 + (int)(random_u64() % 3000), random_depth, &c));
        assert_sane(&c);
        for (int i = 0; i < 250; i++) {
            random_event(&c);
            assert_sane(&c);
            spv_control_step(&c, times[random_u64() % 8]);
            assert_sane(&c);
        }
        const struct spv_pose pose = c.pose;
        char text[SPV_CONTROL_TEXT];
        ck_assert(spv_control_format(&c, text, sizeof text));
        ck_assert_msg(spv_control_parse(&c, text), "%s", text);
        ck_assert_int_eq(memcmp(&pose, &c.pose, sizeof pose), 0);
    }
}
END_TEST

START_TEST(a_point_is_framed_from_some_distance_and_can_be_gone_round)
{
    static const double points[][3] = {{0, 0, 0}, {3, -1, 2}, {1e-12, 0, 0}, {5e5, 5.4e6, 1}};
    for (int i = 0; i < 4; i++) {
        struct spv_control c;
        ck_assert(spv_control_init(&c, points[i], points[i], UPS[1], 45, 500, 500, NULL, NULL));
        ck_assert_double_eq_tol(away(&c, points[i]), 1, 1e-9);
        key(&c, 'v', 0);
        key(&c, 's', 0);
        spv_control_step(&c, 0.1);
        ck_assert(away(&c, points[i]) > 1.01 && away(&c, points[i]) < 2);
        key(&c, 'v', 0);
        for (int k = 0; k < 500; k++)
            wheel(&c, 250, 250, 1);
        ck_assert(away(&c, points[i]) > 1e-11);
    }
}
END_TEST

START_TEST(the_eye_goes_no_farther_than_where_a_scene_is_a_pixel)
{
    struct spv_control c;
    struct ball ball;
    start(&c, &ball, SCENES[4], UPS[1], 45, 500, 500);
    key(&c, 'v', 0);
    key(&c, 's', SPV_SHIFT);
    for (int i = 0; i < 20000; i++)
        spv_control_step(&c, 0.25);
    ck_assert(away(&c, ball.middle) > 1e5 && away(&c, ball.middle) < 1e7);
    assert_sane(&c);
    /* Given from beyond it stays there, and comes back. */
    const struct spv_pose pose = {{0, 0, 1e12}, {0, 0, 0}, {0, 1, 0}, 45};
    ck_assert(spv_control_place(&c, &pose));
    spv_control_turn(&c, 1, 0);
    ck_assert(c.camera.eye[2] > 0.9e12);
    spv_control_fit(&c);
    ck_assert(away(&c, ball.middle) < 1e4);
}
END_TEST

/* What is drawn follows text; its rounding may not turn the view by what can be seen. */
START_TEST(rounding_of_eye_and_target_does_not_turn_the_view)
{
    random_state = 14;
    for (int round = 0; round < 50; round++) {
        struct spv_control c;
        struct ball ball;
        double toward[3], top[3];
        start(&c, &ball, SCENES[3], UPS[1], 45, 1600, 900);
        spv_control_turn(&c, uniform(-180, 180), uniform(-80, 80));
        spv_control_event(&c, &(struct spv_event){.kind = SPV_EVENT_BUTTON, .x = 790, .y = 440, .clicks = 2});
        settle(&c);
        for (int i = 0; i < 100; i++)
            wheel(&c, 800, 450, 1);
        spv_control_turn(&c, uniform(-9, 9), uniform(-9, 9));
        spv_camera_turn(c.front, c.side, c.vertical, c.at.azimuth, c.at.elevation, toward, top);
        for (int a = 0; a < 3; a++)
            ck_assert_double_eq_tol(-toward[a] * c.camera.focal_px, c.camera.forward[a] * c.camera.focal_px, 2e-5);
    }
}
END_TEST

static bool nan_depth(void *ctx, const struct spv_camera *camera, double x, double y, double *depth)
{
    (void)ctx;
    (void)camera;
    (void)x;
    (void)y;
    *depth = NAN;
    return true;
}

START_TEST(values_that_are_no_numbers_are_as_if_nothing_came)
{
    static const double odd[] = {NAN, INFINITY, -INFINITY};
    struct spv_control c, d;
    struct ball ball;
    const double low[3] = {-1, -1, -1}, high[3] = {1, 1, 1}, up[3] = {0, 1, 0};
    start(&c, &ball, SCENES[0], UPS[0], 45, 500, 500);
    pointer(&c, SPV_EVENT_BUTTON, SPV_BUTTON_RIGHT, 250, 250);
    spv_control_step(&c, 0);
    for (int i = 0; i < 3; i++) {
        pointer(&c, SPV_EVENT_MOVE, 0, odd[i], 250);
        pointer(&c, SPV_EVENT_MOVE, 0, 250, odd[i]);
        wheel(&c, 250, 250, odd[i]);
        ck_assert(!spv_control_step(&c, odd[i] > 0 ? 0 : odd[i]));
    }
    key(&c, '2', 0);
    spv_control_step(&c, NAN);
    ck_assert(spv_control_moving(&c));
    ck_assert(spv_control_init(&c, low, high, up, 45, 500, 500, nan_depth, NULL));
    ck_assert(spv_control_init(&d, low, high, up, 45, 500, 500, NULL, NULL));
    wheel(&c, 100, 100, 2);
    wheel(&d, 100, 100, 2);
    ck_assert_int_eq(memcmp(&c.camera, &d.camera, sizeof c.camera), 0);
}
END_TEST

START_TEST(a_long_frame_does_not_fly_through_what_is_ahead)
{
    struct spv_control c;
    struct ball ball;
    start(&c, &ball, SCENES[0], UPS[0], 45, 500, 500);
    key(&c, 'v', 0);
    key(&c, 'w', SPV_SHIFT);
    double far = c.camera.eye[2] - 1;
    for (int i = 0; i < 10; i++) {
        spv_control_step(&c, 1e9);
        ck_assert_double_eq_tol(c.camera.eye[2] - 1, far / 2, 1e-9);
        far = c.camera.eye[2] - 1;
    }
}
END_TEST

START_TEST(what_is_no_scene_is_refused)
{
    struct spv_control c;
    const double low[3] = {0, 0, 0}, high[3] = {1, 1, 1}, up[3] = {0, 1, 0}, none[3] = {0, 0, 0};
    const double nan3[3] = {0, NAN, 0}, huge[3] = {1, 1e290, 1};
    ck_assert(spv_control_init(&c, low, high, up, 45, 10, 10, NULL, NULL));
    ck_assert(!spv_control_scene(&c, high, low, up));
    ck_assert(!spv_control_scene(&c, low, high, none));
    ck_assert(!spv_control_scene(&c, low, high, nan3));
    ck_assert(!spv_control_scene(&c, nan3, high, up));
    ck_assert(!spv_control_scene(&c, low, huge, up));
    ck_assert(c.vertical[1] == 1);
    assert_sane(&c);
    ck_assert(!spv_control_init(&c, low, high, up, 0, 10, 10, NULL, NULL));
    ck_assert(!spv_control_init(&c, low, high, up, 180, 10, 10, NULL, NULL));
    ck_assert(!spv_control_init(&c, low, high, up, NAN, 10, 10, NULL, NULL));
    ck_assert(!spv_control_init(&c, low, high, up, 45, 0, 10, NULL, NULL));
}
END_TEST

START_TEST(resizing_keeps_the_view_and_empty_pictures_are_ignored)
{
    struct spv_control c;
    struct ball ball;
    start(&c, &ball, SCENES[0], UPS[0], 45, 1000, 800);
    const struct spv_pose pose = c.pose;
    spv_control_step(&c, 0);
    spv_control_event(&c, &(struct spv_event){.kind = SPV_EVENT_RESIZE, .width = 0, .height = 0});
    ck_assert(!spv_control_step(&c, 0) && c.camera.width == 1000);
    spv_control_event(&c, &(struct spv_event){.kind = SPV_EVENT_RESIZE, .width = 300, .height = 400});
    ck_assert(spv_control_step(&c, 0) && c.camera.width == 300 && c.camera.height == 400);
    ck_assert_double_eq_tol(c.camera.focal_px, 200 / tan(22.5 * 3.14159265358979323846 / 180), 1e-9);
    ck_assert_int_eq(memcmp(&pose, &c.pose, sizeof pose), 0);
}
END_TEST

/* ---- words ------------------------------------------------------------------------------------------ */

START_TEST(the_camera_comes_back_from_its_text_bit_for_bit)
{
    random_state = 77;
    for (int round = 0; round < 2000; round++) {
        struct spv_control c, d;
        struct ball ball;
        char text[SPV_CONTROL_TEXT], again[SPV_CONTROL_TEXT];
        start(&c, &ball, SCENES[random_u64() % SCENE_COUNT], UPS[random_u64() % 7], uniform(1, 120), 1600, 900);
        start(&d, &ball, SCENES[0], UPS[0], 60, 1600, 900);
        spv_control_turn(&c, uniform(-180, 180), uniform(-90, 90));
        wheel(&c, uniform(0, 1600), uniform(0, 900), uniform(-5, 30));
        ck_assert(spv_control_format(&c, text, sizeof text));
        ck_assert_msg(spv_control_parse(&d, text), "%s", text);
        ck_assert_int_eq(memcmp(&c.camera, &d.camera, sizeof c.camera), 0);
        ck_assert(spv_control_format(&d, again, sizeof again));
        ck_assert_str_eq(text, again);
        /* And goes on from there without a jump, about the same depth. */
        const struct spv_camera was = d.camera;
        start(&d, &ball, SCENES[0], UPS[0], 60, 1600, 900);
        d = c;
        ck_assert(spv_control_parse(&d, text));
        spv_control_turn(&d, 0, 0);
        for (int a = 0; a < 3; a++)
            ck_assert_double_eq_tol(d.camera.forward[a], was.forward[a], 1e-6);
    }
}
END_TEST

START_TEST(a_camera_that_is_tilted_stays_so_until_it_is_fitted)
{
    struct spv_control c;
    struct ball ball;
    start(&c, &ball, SCENES[0], UPS[0], 45, 1000, 800);
    ck_assert(spv_control_parse(&c, " --up 1,1,0 --fov 30 --eye 0,0,9\t--target 0,0,-1e0\n"));
    ck_assert_double_eq_tol(c.camera.right[1], -sqrt(0.5), 1e-12);
    spv_control_turn(&c, 0, 0);
    ck_assert_double_eq_tol(c.camera.right[1], -sqrt(0.5), 1e-12);
    ck_assert_double_eq_tol(c.camera.eye[2], 9, 1e-12);
    key(&c, 'f', 0);
    settle(&c);
    ck_assert_double_eq_tol(c.camera.right[1], 0, 1e-12);
    /* Plan views keep their top. */
    ck_assert(spv_control_parse(&c, "--eye 0,9,0 --target 0,0,0 --up 1,0,0 --fov 30"));
    spv_control_turn(&c, 0, 0);
    ck_assert_double_eq_tol(c.camera.up[0], 1, 1e-3);
    ck_assert(c.at.roll == 0);
    ck_assert(spv_control_parse(&c, "--eye 0,-9,0 --target 0,0,0 --up 1,0,0 --fov 30"));
    spv_control_turn(&c, 0, 0);
    ck_assert_double_eq_tol(c.camera.up[0], 1, 1e-3);
    ck_assert(c.at.roll == 0);
}
END_TEST

START_TEST(other_text_is_no_camera)
{
    static const char *const texts[] = {
        "", "hello", "--eye", "--eye 1,2,3 --target 0,0,0 --up 0,1,0", "--eye 1,2,3 --target 0,0,0 --up 0,1,0 --fov",
        "--eye 1,2,3 --target 0,0,0 --up 0,1,0 --fov 45 --eye 1,2,3",
        "--eye 1,2,3 --target 0,0,0 --up 0,1,0 --fov 45 x", "--eye 1,2,3 --target 0,0,0 --up 0,1,0 --fov 45x",
        "--eye 1,2,3 --up 0,1,0 --fov 45", "--target 1,2,3 --up 0,1,0 --fov 45 ",
        "--eye 1,2 --target 0,0,0 --up 0,1,0 --fov 45",
        "--eye 1,2,3,4 --target 0,0,0 --up 0,1,0 --fov 45",
        "--eye 1, 2,3 --target 0,0,0 --up 0,1,0 --fov 45", "--eye nan,2,3 --target 0,0,0 --up 0,1,0 --fov 45",
        "--eye 1e999,2,3 --target 0,0,0 --up 0,1,0 --fov 45", "--eye 0x1,2,3 --target 0,0,0 --up 0,1,0 --fov 45",
        "--eye 1,2,3 --target 1,2,3 --up 0,1,0 --fov 45", "--eye 0,2,0 --target 0,0,0 --up 0,1,0 --fov 45",
        "--eye 1,2,3 --target 0,0,0 --up 0,0,0 --fov 45", "--eye 1,2,3 --target 0,0,0 --up 0,1,0 --fov 180",
        "--eye 1,2,3 --target 0,0,0 --up 0,1,0 --fov -1", "--eye=1,2,3 --target 0,0,0 --up 0,1,0 --fov 45",
        "--eye 1,2,3--target 0,0,0 --up 0,1,0 --fov 45", "--ey 1,2,3 --target 0,0,0 --up 0,1,0 --fov 45",
        "--eye 1e300,2,3 --target 0,0,0 --up 0,1,0 --fov 45",
    };
    struct spv_control c;
    struct ball ball;
    start(&c, &ball, SCENES[0], UPS[0], 45, 1000, 800);
    const struct spv_control was = c;
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
        ck_assert_msg(!spv_control_parse(&c, texts[i]), "'%s'", texts[i]);
    ck_assert_int_eq(memcmp(&was.camera, &c.camera, sizeof c.camera), 0);
    char text[SPV_CONTROL_TEXT] = "x";
    ck_assert(!spv_control_format(&c, text, 20));
    ck_assert_str_eq(text, "");
    spv_control_event(&c, &(struct spv_event){.kind = SPV_EVENT_PASTE,
                                              .path = "--eye 1,2,3 --target 0,0,0 --up 0,1,0 --fov 45"});
    ck_assert(c.camera.eye[2] == 3);
}
END_TEST

START_TEST(keys_do_what_the_help_says)
{
    struct spv_control c;
    struct ball ball;
    char keys[SPV_CONTROL_KEYS];
    const char *words = NULL;
    size_t lines = 0;
    bool found = false;
    start(&c, &ball, SCENES[0], UPS[0], 45, 1000, 800);
    while (spv_control_help(lines, keys, &words)) {
        ck_assert(strlen(keys) > 0 && strlen(words) > 0);
        found = found || strcmp(keys, "+, =, ]") == 0;
        lines++;
    }
    ck_assert(found && lines > 20 && lines < 60);
    ck_assert_int_eq(key(&c, '+', SPV_SHIFT), SPV_ACTION_FINER);
    ck_assert_int_eq(key(&c, '=', 0), SPV_ACTION_FINER);
    ck_assert_int_eq(key(&c, '[', 0), SPV_ACTION_COARSER);
    ck_assert_int_eq(key(&c, 'c', SPV_CONTROL), SPV_ACTION_COPY);
    ck_assert_int_eq(key(&c, 'c', 0), SPV_ACTION_PAINT);
    ck_assert_int_eq(key(&c, 'c', SPV_ALT), SPV_ACTION_NONE);
    ck_assert_int_eq(key(&c, SPV_KEY_F12, 0), SPV_ACTION_SCREENSHOT);
    struct spv_event e = {.kind = SPV_EVENT_KEY, .key = 'm', .repeats = true};
    ck_assert_int_eq(spv_control_event(&c, &e), SPV_ACTION_NONE);       /* held: once */
    e.key = '-';
    ck_assert_int_eq(spv_control_event(&c, &e), SPV_ACTION_COARSER);
    e.kind = SPV_EVENT_CLOSE;
    ck_assert_int_eq(spv_control_event(&c, &e), SPV_ACTION_QUIT);
    const double x = c.camera.eye[0];
    key(&c, SPV_KEY_RIGHT, 0);
    ck_assert(c.camera.eye[0] > x + 0.1);
}
END_TEST

START_TEST(keys_have_names_that_come_back)
{
    char text[SPV_KEY_TEXT];
    ck_assert_int_eq(spv_key_find("F12", 3), SPV_KEY_F12);
    ck_assert_int_eq(spv_key_find("f1", 2), SPV_KEY_F1);
    ck_assert_int_eq(spv_key_find("f13", 3), 0);
    ck_assert_int_eq(spv_key_find("Q", 1), 'q');
    ck_assert_int_eq(spv_key_find("PageUp", 6), SPV_KEY_PAGE_UP);
    ck_assert_int_eq(spv_key_find("pageuppy", 6), SPV_KEY_PAGE_UP);
    ck_assert_int_eq(spv_key_find("", 0), 0);
    ck_assert_int_eq(spv_key_find("space", 5), ' ');
    ck_assert_int_eq(spv_key_find("hash", 4), '#');
    ck_assert_str_eq(spv_key_text(SPV_KEY_PAGE_DOWN, SPV_SHIFT | SPV_CONTROL | SPV_ALT, text),
                     "Ctrl+Alt+Shift+Page Down");
    ck_assert_str_eq(spv_key_text('q', 0, text), "Q");
    ck_assert_str_eq(spv_key_text(5000, SPV_SHIFT, text), "");
    ck_assert_uint_eq(spv_key_modifier("CTRL", 4), SPV_CONTROL);
    ck_assert_uint_eq(spv_key_modifier("ctr", 3), 0);
}
END_TEST

int main(void)
{
    return SUITE("control", NULL, NULL, it_begins_as_spc_render_frames_and_presets_come_to_its_views,
                 the_pivot_stays_on_its_pixel_while_orbiting_and_nothing_rolls,
                 dragging_right_turns_the_model_right_and_down_shows_its_top,
                 what_was_grabbed_stays_under_the_pointer,
                 zoom_keeps_the_point_under_the_cursor_and_never_goes_through_it,
                 many_steps_of_the_wheel_before_the_next_picture_do_not_go_through,
                 without_a_surface_zoom_goes_towards_the_depth_of_the_pivot,
                 a_double_click_brings_the_point_to_the_middle_and_turns_about_it,
                 animations_take_a_quarter_second_and_the_short_way_and_end_when_the_user_acts,
                 a_pivot_out_of_the_picture_is_replaced, flying_goes_by_time_at_a_speed_that_goes_with_the_distance,
                 looking_around_leaves_the_eye_where_it_is,
                 storms_of_events_at_extreme_scales_leave_the_camera_whole,
                 a_point_is_framed_from_some_distance_and_can_be_gone_round,
                 the_eye_goes_no_farther_than_where_a_scene_is_a_pixel,
                 rounding_of_eye_and_target_does_not_turn_the_view,
                 values_that_are_no_numbers_are_as_if_nothing_came,
                 a_long_frame_does_not_fly_through_what_is_ahead, what_is_no_scene_is_refused,
                 resizing_keeps_the_view_and_empty_pictures_are_ignored,
                 the_camera_comes_back_from_its_text_bit_for_bit,
                 a_camera_that_is_tilted_stays_so_until_it_is_fitted, other_text_is_no_camera,
                 keys_do_what_the_help_says, keys_have_names_that_come_back);
}
