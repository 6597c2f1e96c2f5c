/*
 * pace.h - how coarse a picture may be while the camera moves, so that frames come in time.
 *
 * The user's eps is the finest that is drawn. While the camera moves, the cost of each frame, against
 * the target, makes the next one coarser or finer; when it rests, each frame halves eps until it is
 * the user's. Cost is what the caller counts: seconds of work, without waiting for the display, or
 * nodes; the target has the same unit.
 *
 * Damping. Costs are taken as a + b / eps^2 with unknown a and b. Where a frame cost r times what is
 * aimed at, eps is multiplied by r^g: g = 1/2 would be right for a = 0 and is too little otherwise, so
 * that coarsening (g = 1/2) nears its aim from one side and does not swing; refining (g = 1/4) goes
 * half as far, because too slow a frame is felt and too coarse a one hardly. The aim is 0.9 of the
 * target, and nothing changes between 0.7 and 1 of it, which noise of some tenth stays within. The
 * first slow frame after good ones may be a hiccup and counts as twice the target at most; after that a
 * frame changes eps by a factor of 8 at most.
 */
#ifndef SPV_PACE_H
#define SPV_PACE_H

#include <stdbool.h>

enum { SPV_PACE_COARSEST = 64 };    /* eps is at most this many times the user's */

struct spv_pace {                   /* read eps */
    double eps;                     /* px, of the next frame */
    double finest;                  /* px, the user's */
    double target;                  /* seconds or nodes a frame; 0: always the finest */
    double moving_eps;              /* what the last movement came to; 0: none yet */
    bool moving, slow;              /* of the last frame */
};

/* eps_px > 0, target >= 0: others are taken as 1 and 0. */
void spv_pace_init(struct spv_pace *pace, double eps_px, double target);

/* The user wants another eps or target; what is known of the frames' cost stays. */
void spv_pace_set(struct spv_pace *pace, double eps_px, double target);

/*
 * A frame was drawn with pace->eps.
 *
 * in     cost     of that frame; 0 or NaN: not known, and eps stays
 *        moving   whether the next frame is one of a movement
 * out    (return) pace->eps of the next frame, between the user's and SPV_PACE_COARSEST times that
 */
double spv_pace_next(struct spv_pace *pace, double cost, bool moving);

/* Whether the next frame's eps is the user's: at rest none after it is needed. */
bool spv_pace_settled(const struct spv_pace *pace);

#endif
