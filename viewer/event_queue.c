#include "event_queue.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static struct spv_event *nth(struct spv_event_queue *q, int i)
{
    return &q->events[(q->first + i) % SPV_EVENTS_MAX];
}

void spv_events_release(struct spv_event_queue *queue)
{
    for (int i = 0; i < queue->count; i++)
        free((char *)nth(queue, i)->path);
    free(queue->taken_path);
    *queue = (struct spv_event_queue){0};
}

static void count_click(struct spv_event_queue *q, struct spv_event *event, double now_s)
{
    const bool again = q->clicks == 1 && event->button == q->click_button &&
                       now_s - q->click_s <= SPV_DOUBLE_CLICK_S &&
                       fabs(event->x - q->click_x) <= SPV_DOUBLE_CLICK_PX &&
                       fabs(event->y - q->click_y) <= SPV_DOUBLE_CLICK_PX;
    q->clicks = again ? 2 : 1;      /* a third one begins anew */
    q->click_button = event->button;
    q->click_s = now_s;
    q->click_x = event->x;
    q->click_y = event->y;
    event->clicks = q->clicks;
}

static void remove_nth(struct spv_event_queue *q, int i)
{
    free((char *)nth(q, i)->path);
    for (; i + 1 < q->count; i++)
        *nth(q, i) = *nth(q, i + 1);
    q->count--;
}

static bool is_repeat(const struct spv_event *event)
{
    return event->kind == SPV_EVENT_KEY && event->repeats;
}

static bool make_room(struct spv_event_queue *q, const struct spv_event *event)
{
    if (q->count < SPV_EVENTS_MAX)
        return true;
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < q->count; i++)
            if (pass == 0 ? nth(q, i)->kind == SPV_EVENT_MOVE : is_repeat(nth(q, i))) {
                remove_nth(q, i);
                return true;
            }
    if (event->kind != SPV_EVENT_CLOSE)
        return false;
    remove_nth(q, q->count - 1);
    return true;
}

void spv_events_push(struct spv_event_queue *queue, const struct spv_event *event, double now_s)
{
    struct spv_event e = *event;
    if (e.kind == SPV_EVENT_BUTTON)
        count_click(queue, &e, now_s);
    struct spv_event *last = queue->count > 0 ? nth(queue, queue->count - 1) : NULL;
    if (last != NULL && last->kind == e.kind && (e.kind == SPV_EVENT_MOVE || e.kind == SPV_EVENT_RESIZE)) {
        *last = e;
        return;
    }
    if (e.path != NULL && (e.path = strdup(e.path)) == NULL)
        return;
    if (make_room(queue, &e))
        *nth(queue, queue->count++) = e;
    else
        free((char *)e.path);
}

bool spv_events_take(struct spv_event_queue *queue, struct spv_event *event)
{
    free(queue->taken_path);
    queue->taken_path = NULL;
    if (queue->count == 0)
        return false;
    *event = *nth(queue, 0);
    queue->taken_path = (char *)event->path;
    queue->first = (queue->first + 1) % SPV_EVENTS_MAX;
    queue->count--;
    return true;
}
