/*
 * event_queue.h - events in the order they came, between whoever gets them and whoever acts on them.
 *
 * What only the last one of counts does not queue up: a MOVE after a MOVE and a RESIZE after a RESIZE take
 * its place. A full queue gives up the oldest move, or else repeat of a key; what still finds no room is
 * lost, unless it is the wish to close. Clicks are counted here.
 */
#ifndef SPV_EVENT_QUEUE_H
#define SPV_EVENT_QUEUE_H

#include "event.h"

enum { SPV_EVENTS_MAX = 256 };
#define SPV_DOUBLE_CLICK_S 0.3
#define SPV_DOUBLE_CLICK_PX 4.0

struct spv_event_queue {            /* all-zero is an empty one */
    struct spv_event events[SPV_EVENTS_MAX];
    int first, count;
    char *taken_path;               /* of the event taken last */
    int click_button, clicks;       /* of the last BUTTON; clicks 0: none yet */
    double click_s, click_x, click_y;
};

/* Frees the paths of what was not taken. */
void spv_events_release(struct spv_event_queue *queue);

/* At the time now_s, of any origin. path is copied; without memory for it the event is lost. */
void spv_events_push(struct spv_event_queue *queue, const struct spv_event *event, double now_s);

/* False when there is none. The event's path lives until the next call. */
bool spv_events_take(struct spv_event_queue *queue, struct spv_event *event);

#endif
