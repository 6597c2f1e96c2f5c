#include "bench_trade.h"

#include <math.h>
#include <stdarg.h>

const char *const BENCH_KIND_NAMES[BENCH_KINDS] = {
    "hybrid", "points", "triangles", "one-cluster", "traversal", "all-triangles", "all-points",
};

/* An accuracy as it does in the view that suits it least. */
struct worst {
    double ms, error, shade, holes;
    uint32_t slowest, furthest, palest;         /* views */
};

/* NAN, what was not measured, is worse than anything: nobody keeps it. */
static void worsen(double v, uint32_t view, double *worst, uint32_t *where)
{
    if (!isnan(*worst) && !(v <= *worst)) {
        *worst = v;
        *where = view;
    }
}

static struct worst worst_of(const struct bench_result *r, enum bench_kind kind, double eps_px)
{
    struct worst w = {.ms = -1, .error = -1, .shade = -1};
    for (size_t i = 0; i < r->row_count; i++) {
        const struct bench_row *row = &r->rows[i];
        if (row->kind != kind || row->eps_px != eps_px)
            continue;
        worsen(row->value[BENCH_FRAME_MS], row->view, &w.ms, &w.slowest);
        worsen(row->value[BENCH_ERROR_MAX], row->view, &w.error, &w.furthest);
        worsen(row->value[BENCH_SHADE_MEAN], row->view, &w.shade, &w.palest);
        w.holes += row->value[BENCH_HOLES];
    }
    return w;
}

/* By how many times the worst of what is asked for is missed; up to 1 all is kept. */
static double excess(const struct bench_options *o, const struct worst *w)
{
    double most = 0;
    uint32_t ignored;
    if (o->fps > 0)
        worsen(w->ms * o->fps / 1e3, 0, &most, &ignored);
    if (o->error_px > 0)
        worsen(w->holes == 0 ? w->error / o->error_px : 1e9 * w->holes, 0, &most, &ignored);
    if (o->shade > 0)
        worsen(w->shade / o->shade, 0, &most, &ignored);
    return most;
}

struct text {
    char *at;
    size_t room;
};

__attribute__((format(printf, 2, 3))) static void add(struct text *t, const char *fmt, ...)
{
    va_list args;
    va_start(args, fmt);
    const int n = vsnprintf(t->at, t->room, fmt, args);
    va_end(args);
    const size_t used = n < 0 ? 0 : (size_t)n < t->room ? (size_t)n : t->room - 1;
    t->at += used;
    t->room -= used;
}

static void explain(const struct bench_result *r, const struct worst *w, struct bench_choice *out)
{
    const struct bench_options *o = r->options;
    struct text t = {out->text, sizeof out->text};
    add(&t, "eps %g in %s mode: ", out->eps_px, BENCH_KIND_NAMES[out->kind]);
    if (!out->met)
        add(&t, "comes nearest, but no eps measured keeps ");
    else
        add(&t, "the %s measured that keeps ", o->fps > 0 ? "finest" : "coarsest");
    if (o->fps > 0)
        add(&t, "%g frames/s", o->fps);
    if (o->error_px > 0)
        add(&t, "%san error of %g px", o->fps > 0 ? " and " : "", o->error_px);
    if (o->shade > 0)
        add(&t, "%sshades to %g of 255", o->fps > 0 || o->error_px > 0 ? " and " : "", o->shade);
    if (o->fps > 0)
        add(&t, "; slowest view '%s' %.1f ms, %.0f frames/s", r->views[w->slowest].name, w->ms, 1e3 / w->ms);
    if (o->error_px > 0)
        add(&t, "; largest error %.2f px in '%s', %.0f hole pixels", w->error, r->views[w->furthest].name, w->holes);
    if (o->shade > 0)
        add(&t, "; shades off by %.2f of 255 in '%s'", w->shade, r->views[w->palest].name);
}

void bench_recommend(const struct bench_result *r, struct bench_choice *out)
{
    const struct bench_options *o = r->options;
    struct worst chosen = {0};
    double least = HUGE_VAL;
    *out = (struct bench_choice){.eps_px = NAN, .text = "nothing was measured that answers it"};
    while (out->kind < BENCH_MODES && !o->kinds[out->kind])
        out->kind++;
    for (uint32_t e = 0; e < o->eps_count && out->kind < BENCH_MODES; e++) {
        const struct worst w = worst_of(r, out->kind, o->eps_px[e]);
        const double by = excess(o, &w);
        const bool keeps = by <= 1;
        /* eps ascend: of those that keep it the first for a speed, else the last; of others, the nearest */
        if (keeps ? !(out->met && o->fps > 0) : !out->met && by < least) {
            out->eps_px = o->eps_px[e];
            out->met = keeps;
            chosen = w;
        }
        least = fmin(least, by);
    }
    if (!isnan(out->eps_px))
        explain(r, &chosen, out);
}
