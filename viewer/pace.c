#include "pace.h"

#include <math.h>

static const double AIM = 0.9, LOW = 0.7;       /* of the target */
static const double COARSER_GAIN = 0.5, FINER_GAIN = 0.25;
static const double HICCUP = 2, STEP_MAX = 8;

static double clamp_eps(const struct spv_pace *p, double eps)
{
    return fmin(fmax(eps, p->finest), p->finest * SPV_PACE_COARSEST);
}

void spv_pace_set(struct spv_pace *p, double eps_px, double target)
{
    p->finest = eps_px > 0 && isfinite(eps_px) ? fmin(fmax(eps_px, 1e-100), 1e100) : 1;
    p->target = target > 0 && isfinite(target) ? target : 0;
    p->eps = p->target > 0 ? clamp_eps(p, p->eps) : p->finest;
}

void spv_pace_init(struct spv_pace *p, double eps_px, double target)
{
    *p = (struct spv_pace){.eps = 0};
    spv_pace_set(p, eps_px, target);
}

/* Factor of eps after a frame of a movement. */
static double correction(struct spv_pace *p, double ratio)
{
    const bool was_slow = p->slow;
    p->slow = ratio > 1;
    if (ratio >= LOW && ratio <= 1)
        return 1;
    if (ratio > 1) {
        if (!was_slow)
            ratio = fmin(ratio, HICCUP);
        return fmin(pow(ratio / AIM, COARSER_GAIN), STEP_MAX);
    }
    return fmax(pow(ratio / AIM, FINER_GAIN), 1 / STEP_MAX);
}

/*
 * The first frame of a movement: what the last movement came to. Without one, what the frame at rest
 * tells: that may have taken seconds, and so would this one.
 */
static double begin(struct spv_pace *p, double ratio)
{
    p->slow = false;
    if (p->moving_eps > 0)
        return p->moving_eps;
    return ratio > 1 ? p->eps * sqrt(ratio / AIM) : p->eps;
}

double spv_pace_next(struct spv_pace *p, double cost, bool moving)
{
    const bool known = p->target > 0 && cost > 0;
    const double ratio = known ? fmin(fmax(cost / p->target, 1e-12), 1e12) : AIM;
    if (!(p->target > 0))
        p->eps = p->finest;
    else if (!moving)
        p->eps = clamp_eps(p, p->eps / 2);
    else if (!p->moving)
        p->moving_eps = p->eps = clamp_eps(p, begin(p, ratio));
    else if (known)
        p->moving_eps = p->eps = clamp_eps(p, p->eps * correction(p, ratio));
    p->moving = moving;
    return p->eps;
}

bool spv_pace_settled(const struct spv_pace *p)
{
    return !(p->eps > p->finest);
}
