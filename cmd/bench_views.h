/*
 * bench_views.h - the views that the trade is measured in: the same for the same archive.
 *
 * Six around the model, which is framed; two close-ups, at a quarter and a sixteenth of the framing distance
 * from the surface; one from the middle of the box, looking out.
 */
#ifndef BENCH_VIEWS_H
#define BENCH_VIEWS_H

#include "picture.h"
#include "ref_raster.h"

enum { BENCH_VIEWS = 9 };

struct bench_view {
    const char *name;
    struct spv_camera camera;
    struct ref_camera reference;    /* the same view, for those who know no viewer */
};

/* False for a word that is no view's name. */
bool bench_view_named(const char *word, uint32_t *view);

/*
 * in   o       size, field of view and vertical axis
 *      points  [count][3] on the surface, file units: one of them is what close-ups look at; count may be 0
 * out  (return) false when the vertical axis is none
 */
bool bench_views(const struct picture_options *o, const struct spc_header *h, const double (*points)[3],
                 size_t count, struct bench_view views[BENCH_VIEWS]);

#endif
