/* Events between a window and whoever acts on them. */
#include "event_queue.h"
#include "suite.h"

#include <stdlib.h>
#include <string.h>

static struct spv_event_queue q;

static void clear(void)
{
    spv_events_release(&q);
}

static void push(enum spv_event_kind kind, int key, double x, double now_s)
{
    spv_events_push(&q, &(struct spv_event){.kind = kind, .key = key, .x = x}, now_s);
}

static struct spv_event take(void)
{
    struct spv_event e = {.kind = SPV_EVENT_CLOSE};
    ck_assert(spv_events_take(&q, &e));
    return e;
}

START_TEST(events_come_in_order_many_times_around)
{
    int in = 0, out = 0;
    for (int round = 0; round < 50; round++) {
        for (int i = 0; i < 7 + round; i++)
            push(SPV_EVENT_KEY, in++, 0, 0);
        for (int i = 0; i < 7 + round; i++)
            ck_assert_int_eq(take().key, out++);
    }
    struct spv_event e;
    ck_assert(!spv_events_take(&q, &e));
}
END_TEST

START_TEST(a_move_after_a_move_takes_its_place)
{
    push(SPV_EVENT_MOVE, 0, 1, 0);
    push(SPV_EVENT_MOVE, 0, 2, 0);
    push(SPV_EVENT_BUTTON_UP, 0, 2, 0);
    push(SPV_EVENT_MOVE, 0, 3, 0);
    push(SPV_EVENT_RESIZE, 0, 4, 0);
    push(SPV_EVENT_RESIZE, 0, 5, 0);
    ck_assert_int_eq(q.count, 4);
    ck_assert_double_eq(take().x, 2);
    ck_assert_int_eq(take().kind, SPV_EVENT_BUTTON_UP);
    ck_assert_double_eq(take().x, 3);
    ck_assert_double_eq(take().x, 5);
}
END_TEST

START_TEST(a_full_queue_gives_up_moves_then_repeats_and_nothing_else)
{
    for (int i = 0; i < SPV_EVENTS_MAX; i++)        /* moves and keys by turns, one repeat */
        spv_events_push(&q, &(struct spv_event){.kind = i % 2 ? SPV_EVENT_KEY : SPV_EVENT_MOVE, .key = i,
                                                .repeats = i == 101}, 0);
    for (int i = 0; i < SPV_EVENTS_MAX / 2; i++)
        push(SPV_EVENT_KEY_UP, i, 0, 0);
    ck_assert_int_eq(q.count, SPV_EVENTS_MAX);
    push(SPV_EVENT_KEY_UP, 1000, 0, 0);             /* for the repeat */
    push(SPV_EVENT_KEY_UP, 1001, 0, 0);             /* lost */
    push(SPV_EVENT_CLOSE, 0, 0, 0);                 /* for the last */
    ck_assert_int_eq(q.count, SPV_EVENTS_MAX);
    for (int i = 1; i < SPV_EVENTS_MAX; i += 2)
        if (i != 101)
            ck_assert_int_eq(take().key, i);
    for (int i = 0; i < SPV_EVENTS_MAX / 2; i++)
        ck_assert_int_eq(take().key, i);
    ck_assert_int_eq(take().kind, SPV_EVENT_CLOSE);
    ck_assert_int_eq(q.count, 0);
}
END_TEST

static int click(int button, double x, double y, double now_s)
{
    spv_events_push(&q, &(struct spv_event){.kind = SPV_EVENT_BUTTON, .button = button, .x = x, .y = y}, now_s);
    return take().clicks;
}

START_TEST(a_double_click_is_near_in_time_and_place_with_one_button)
{
    ck_assert_int_eq(click(0, 10, 10, 0.0), 1);     /* the very first, at the time 0 */
    ck_assert_int_eq(click(0, 14, 6, 0.29), 2);
    ck_assert_int_eq(click(0, 14, 6, 0.4), 1);      /* a third begins anew */
    ck_assert_int_eq(click(0, 14, 6, 0.5), 2);
    ck_assert_int_eq(click(0, 14, 6, 5.0), 1);
    ck_assert_int_eq(click(0, 14, 6, 5.31), 1);     /* too late */
    ck_assert_int_eq(click(0, 18.5, 6, 5.4), 1);    /* too far */
    ck_assert_int_eq(click(0, 18.5, 10.5, 5.5), 1);
    ck_assert_int_eq(click(1, 18.5, 10.5, 5.6), 1); /* another button */
    ck_assert_int_eq(click(1, 18.5, 10.5, 5.7), 2);
}
END_TEST

START_TEST(paths_are_copied_and_live_until_the_next_one_is_taken)
{
    char path[] = "first.spc";
    spv_events_push(&q, &(struct spv_event){.kind = SPV_EVENT_DROP, .path = path}, 0);
    path[0] = 'F';
    spv_events_push(&q, &(struct spv_event){.kind = SPV_EVENT_PASTE, .path = path}, 0);
    spv_events_push(&q, &(struct spv_event){.kind = SPV_EVENT_DROP, .path = path}, 0);
    ck_assert_str_eq(take().path, "first.spc");
    ck_assert_str_eq(take().path, "First.spc");
    for (int i = 0; i < 2 * SPV_EVENTS_MAX; i++)    /* too many: lost, not leaked */
        spv_events_push(&q, &(struct spv_event){.kind = SPV_EVENT_DROP, .path = path}, 0);
    push(SPV_EVENT_CLOSE, 0, 0, 0);
    ck_assert_int_eq(q.count, SPV_EVENTS_MAX);
}
END_TEST

int main(void)
{
    return SUITE("event_queue", clear, clear, events_come_in_order_many_times_around,
                 a_move_after_a_move_takes_its_place, a_full_queue_gives_up_moves_then_repeats_and_nothing_else,
                 a_double_click_is_near_in_time_and_place_with_one_button,
                 paths_are_copied_and_live_until_the_next_one_is_taken);
}
