#include "pace.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>

#include "suite.h"

static uint64_t random_state;

static double uniform(double from, double to)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return from + (to - from) * (double)(random_state >> 11) * 0x1p-53;
}

/* A renderer that takes a + b / eps^2 seconds, give or take a share. */
struct renderer {
    double a, b, noise;
};

static double draw(const struct renderer *r, double eps)
{
    return (r->a + r->b / (eps * eps)) * (1 + uniform(-r->noise, r->noise));
}

static const double TARGET = 1.0 / 30;

/* Frames of a movement until no later one of 200 takes longer than the target by more than over. */
static int frames_until(struct spv_pace *p, const struct renderer *r, double over)
{
    int last = 0;
    for (int i = 1; i <= 200; i++) {
        const double cost = draw(r, p->eps);
        if (cost > TARGET * over)
            last = i;
        spv_pace_next(p, cost, true);
    }
    return last;
}

START_TEST(frames_come_in_time_within_a_handful_and_do_not_swing)
{
    static const double as[] = {0, 0.001, 0.01, 0.02}, bs[] = {0.05, 0.3, 2, 20};
    for (int i = 0; i < 16; i++) {
        const struct renderer r = {as[i % 4], bs[i / 4], 0};
        struct spv_pace p;
        spv_pace_init(&p, 1, TARGET);
        p.moving = true;            /* in the middle of a movement: no frame at rest to tell */
        const int frames = frames_until(&p, &r, 1.05);
        ck_assert_msg(frames <= 7, "a %g, b %g: %d frames", r.a, r.b, frames);
        const double settled = p.eps;
        ck_assert(draw(&r, settled) <= TARGET * 1.05);
        /* No coarser than was needed, and without noise it stands. */
        ck_assert_msg(settled == 1 || draw(&r, settled) > 0.6 * TARGET, "%g: %g", settled, draw(&r, settled));
        for (int k = 0; k < 20; k++)
            ck_assert(spv_pace_next(&p, draw(&r, p.eps), true) == settled);
    }
}
END_TEST

START_TEST(coarsening_never_passes_its_aim)
{
    static const double as[] = {0, 0.005, 0.02};
    for (int i = 0; i < 3; i++) {
        const struct renderer r = {as[i], 20, 0};
        struct spv_pace p;
        spv_pace_init(&p, 1, TARGET);
        p.moving = true;
        double last = p.eps;
        const double aim = sqrt(r.b / (0.9 * TARGET - r.a));
        for (int k = 0; k < 50; k++) {
            spv_pace_next(&p, draw(&r, p.eps), true);
            ck_assert(p.eps >= last && p.eps <= aim * (1 + 1e-9));
            last = p.eps;
        }
    }
}
END_TEST

START_TEST(noise_does_not_make_it_swing)
{
    random_state = 4;
    static const double as[] = {0, 0.01, 0.02};
    for (int i = 0; i < 3; i++) {
        const struct renderer r = {as[i], 1, 0.1};
        struct spv_pace p;
        double low = DBL_MAX, high = 0, most = 0;
        int changes = 0;
        spv_pace_init(&p, 1, TARGET);
        p.moving = true;
        for (int k = 0; k < 2000; k++) {
            const double cost = draw(&r, p.eps), last = p.eps;
            spv_pace_next(&p, cost, true);
            if (k < 20)
                continue;
            changes += p.eps != last;
            low = fmin(low, p.eps);
            high = fmax(high, p.eps);
            most = fmax(most, cost);
        }
        ck_assert_msg(high / low < 1.25, "eps from %g to %g", low, high);
        ck_assert_msg(changes < 200, "%d changes", changes);
        ck_assert_msg(most < 1.25 * TARGET, "%g", most / TARGET);
    }
}
END_TEST

START_TEST(a_cost_that_jumps_by_ten_is_met_and_given_back)
{
    for (int noisy = 0; noisy < 2; noisy++) {
        struct renderer r = {0.002, 0.1, noisy ? 0.1 : 0};
        struct spv_pace p;
        random_state = 5;
        spv_pace_init(&p, 0.5, TARGET);
        p.moving = true;
        frames_until(&p, &r, 1.05);
        const double before = p.eps;
        r.b *= 10;
        const int frames = frames_until(&p, &r, 1.25);
        ck_assert_msg(frames <= 4, "%d", frames);
        /* What is right is sqrt(10) times as coarse; overshoot is bounded. */
        ck_assert(p.eps / before > 2.5 && p.eps / before < 4);
        r.b /= 10;
        int back = 0;
        while (back < 50 && p.eps > 1.25 * before) {
            const double last = p.eps, cost = draw(&r, p.eps);
            spv_pace_next(&p, cost, true);
            ck_assert(p.eps <= last || cost > TARGET);
            ck_assert(noisy || draw(&r, p.eps) <= TARGET);      /* finer, but never too fine */
            back++;
        }
        ck_assert_msg(back <= 12, "%d", back);
    }
}
END_TEST

START_TEST(one_slow_frame_is_a_hiccup)
{
    struct spv_pace p;
    spv_pace_init(&p, 1, TARGET);
    p.moving = true;
    for (int i = 0; i < 5; i++)
        spv_pace_next(&p, TARGET * 0.8, true);
    const double before = p.eps;
    spv_pace_next(&p, 2, true);
    ck_assert(p.eps > before && p.eps < 1.6 * before);
    spv_pace_next(&p, 2, true);     /* twice: no hiccup */
    ck_assert(p.eps > 4 * before);
}
END_TEST

START_TEST(at_rest_it_refines_by_halves_and_a_movement_goes_on_where_the_last_ended)
{
    const struct renderer r = {0, 20, 0};
    struct spv_pace p;
    int frames = 0;
    spv_pace_init(&p, 0.75, TARGET);
    spv_pace_next(&p, draw(&r, p.eps), true);
    ck_assert(draw(&r, p.eps) < TARGET);        /* the frame at rest told at once */
    frames_until(&p, &r, 1.05);
    const double coarse = p.eps;
    ck_assert(!spv_pace_settled(&p));
    for (double last = p.eps; !spv_pace_settled(&p); frames++, last = p.eps)
        ck_assert(spv_pace_next(&p, 1, false) == fmax(last / 2, 0.75));
    ck_assert_int_eq(frames, (int)ceil(log2(coarse / 0.75)));
    ck_assert(p.eps == 0.75 && spv_pace_next(&p, 1, false) == 0.75);
    ck_assert(spv_pace_next(&p, 999, true) == coarse);
}
END_TEST

START_TEST(eps_stays_between_the_users_and_the_cap)
{
    struct spv_pace p;
    static const double odd[] = {0, -1, NAN, INFINITY, 1e300, 1e-300, DBL_MAX, 5e-324};
    random_state = 6;
    spv_pace_init(&p, 2, TARGET);
    for (int i = 0; i < 100; i++)
        spv_pace_next(&p, 1e9, true);
    ck_assert(p.eps == 128);
    for (int i = 0; i < 100; i++)
        spv_pace_next(&p, 1e-9, true);
    ck_assert(p.eps == 2);
    for (int i = 0; i < 20000; i++) {
        spv_pace_next(&p, uniform(0, 1) < 0.3 ? odd[(int)uniform(0, 8)] : pow(10, uniform(-6, 6)), uniform(0, 1) < 0.7);
        ck_assert(p.eps >= 2 && p.eps <= 128);
    }
    spv_pace_set(&p, 500, TARGET);
    ck_assert(p.eps == 500);
    spv_pace_next(&p, 1e9, true);
    spv_pace_set(&p, 0.01, TARGET);
    ck_assert(p.eps == 0.64);
    spv_pace_init(&p, NAN, NAN);
    ck_assert(p.eps == 1 && p.target == 0);
}
END_TEST

START_TEST(without_a_target_or_a_cost_nothing_changes)
{
    struct spv_pace p;
    spv_pace_init(&p, 2, 0);
    for (int i = 0; i < 10; i++)
        ck_assert(spv_pace_next(&p, 100, i % 2 == 0) == 2);
    spv_pace_set(&p, 2, TARGET);
    spv_pace_next(&p, 1, true);
    spv_pace_next(&p, 1, true);
    const double eps = p.eps;
    ck_assert(eps > 2 && spv_pace_next(&p, 0, true) == eps && spv_pace_next(&p, NAN, true) == eps);
    spv_pace_set(&p, 2, 0);
    ck_assert(p.eps == 2);
}
END_TEST

START_TEST(a_budget_of_nodes_is_held_as_well)
{
    struct spv_pace p;
    spv_pace_init(&p, 1, 1e6);
    for (int i = 0; i < 10; i++)
        spv_pace_next(&p, 5e3 + 3e8 / (p.eps * p.eps), true);
    ck_assert(3e8 / (p.eps * p.eps) < 1e6 && 3e8 / (p.eps * p.eps) > 0.6e6);
}
END_TEST

int main(void)
{
    return SUITE("pace", NULL, NULL, frames_come_in_time_within_a_handful_and_do_not_swing,
                 coarsening_never_passes_its_aim, noise_does_not_make_it_swing,
                 a_cost_that_jumps_by_ten_is_met_and_given_back, one_slow_frame_is_a_hiccup,
                 at_rest_it_refines_by_halves_and_a_movement_goes_on_where_the_last_ended,
                 eps_stays_between_the_users_and_the_cap, without_a_target_or_a_cost_nothing_changes,
                 a_budget_of_nodes_is_held_as_well);
}
