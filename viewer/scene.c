#include "scene.h"

#include "resident.h"
#include "threads.h"

#include <math.h>
#include <stdlib.h>
#include <time.h>

enum { AHEAD_FRAMES = 12 };         /* how far motion is looked ahead: a few reads take as long */

struct archive {
    char *path;
    struct spc_reader *reader;
    struct spv_resident *resident;
    uint64_t bytes;                             /* of all its blocks, decoded */
    struct spv_selection selection, ahead;
    struct spv_resident_frame *frame;           /* of this picture */
};

struct spv_scene {
    struct spv_scene_options options;
    struct spv_draw *draw;
    struct archive *archives[SPV_SCENE_ARCHIVES_MAX];
    uint32_t count;
    struct spv_part parts[SPV_SCENE_ARCHIVES_MAX];
    struct spv_view last;           /* of the frame before */
    bool has_last;
    uint32_t fault;                 /* archive, or SPV_SCENE_ARCHIVES_MAX */
    uint64_t bytes_read;            /* of blocks so far, as stored */
};

static double now_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

/* ---- archives ---------------------------------------------------------------------------------- */

static void close_archive(struct archive *a)
{
    if (a == NULL)
        return;
    spv_resident_free(a->resident);
    spv_selection_release(&a->selection);
    spv_selection_release(&a->ahead);
    spc_reader_close(a->reader);
    free(a->path);
    free(a);
}

static uint64_t decoded_bytes(const struct spc_reader *reader)
{
    uint64_t bytes = 0;
    for (uint32_t i = 0; i < spc_reader_header(reader)->block_count; i++) {
        struct spc_block b;
        spc_reader_block(reader, i, &b);
        bytes += b.raw_bytes;
    }
    return bytes;
}

/* What an archive has of the budget in any case: a small one beside a large one would else not fit its least block. */
static uint64_t least_share(const struct spv_scene *s, const struct archive *a)
{
    const uint64_t equal = s->options.budget / (2 * (uint64_t)s->count);
    return a->bytes < equal ? a->bytes : equal;
}

/* All archives share the budget: half of it evenly, as far as they need that, the rest by what they need beyond. */
static uint64_t share(const struct spv_scene *s, const struct archive *a)
{
    uint64_t rest = s->options.budget;
    double beyond = 0;
    for (uint32_t i = 0; i < s->count; i++) {
        const uint64_t least = least_share(s, s->archives[i]);
        rest -= least;
        beyond += (double)(s->archives[i]->bytes - least);
    }
    const uint64_t least = least_share(s, a);
    const double part = beyond > 0 ? (double)(a->bytes - least) / beyond : 1.0 / s->count;
    return least + (uint64_t)((double)rest * part * (1 - 0x1p-40));     /* all together no more than there is */
}

static enum spc_status make_resident(const struct spv_scene *s, const struct archive *a, struct spv_draw *draw,
                                     struct spv_resident **out, struct spc_error *err)
{
    struct spv_resident_options o = {.budget = share(s, a), .upload_bytes = s->options.upload_bytes,
                                     .threads = s->options.threads};
    spv_draw_store(draw, &o.store);
    return spv_resident_create(a->reader, &o, out, err);
}

/* Budgets follow from what is open: all are made anew. */
static enum spc_status make_all(struct spv_scene *s, struct spv_draw *draw, struct spc_error *err)
{
    struct spv_resident *made[SPV_SCENE_ARCHIVES_MAX] = {0};
    enum spc_status status = SPC_OK;
    for (uint32_t i = 0; i < s->count && status == SPC_OK; i++)
        status = make_resident(s, s->archives[i], draw, &made[i], err);
    for (uint32_t i = 0; i < s->count; i++) {
        struct spv_resident **kept = &s->archives[i]->resident;
        spv_resident_free(status == SPC_OK ? *kept : made[i]);
        if (status == SPC_OK)
            *kept = made[i];
    }
    return status;
}

enum spc_status spv_scene_open(struct spv_scene *s, const char *path, struct spc_error *err)
{
    if (s->count == SPV_SCENE_ARCHIVES_MAX)
        return spc_fail(err, SPC_LIMIT, SPC_NO_OFF, "%d archives are open, no more can be", s->count);
    struct archive *a = calloc(1, sizeof *a);
    const size_t length = strlen(path) + 1;
    if (a == NULL || (a->path = malloc(length)) == NULL) {
        free(a);
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to open an archive");
    }
    memcpy(a->path, path, length);
    enum spc_status status = spc_reader_open(path, &a->reader, err);
    if (status == SPC_OK) {
        a->bytes = decoded_bytes(a->reader);
        s->archives[s->count++] = a;
        status = make_all(s, s->draw, err);
        s->count -= status != SPC_OK;
    }
    if (status != SPC_OK)
        close_archive(a);
    return status;
}

enum spc_status spv_scene_use(struct spv_scene *s, struct spv_draw *draw, struct spc_error *err)
{
    const enum spc_status status = make_all(s, draw, err);
    if (status == SPC_OK)
        s->draw = draw;
    return status;
}

enum spc_status spv_scene_create(const struct spv_scene_options *options, struct spv_draw *draw,
                                 struct spv_scene **out, struct spc_error *err)
{
    *out = calloc(1, sizeof **out);
    if (*out == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a scene");
    (*out)->options = *options;
    (*out)->draw = draw;
    (*out)->fault = SPV_SCENE_ARCHIVES_MAX;
    if (options->threads == 0)
        (*out)->options.threads = spv_threads_cores();
    return SPC_OK;
}

void spv_scene_free(struct spv_scene *s)
{
    if (s == NULL)
        return;
    for (uint32_t i = 0; i < s->count; i++)
        close_archive(s->archives[i]);
    free(s);
}

uint32_t spv_scene_count(const struct spv_scene *s)
{
    return s->count;
}

const struct spc_reader *spv_scene_reader(const struct spv_scene *s, uint32_t i)
{
    return s->archives[i]->reader;
}

const char *spv_scene_path(const struct spv_scene *s, uint32_t i)
{
    return s->archives[i]->path;
}

bool spv_scene_box(const struct spv_scene *s, double box_min[3], double box_max[3])
{
    for (int a = 0; a < 3; a++) {
        box_min[a] = HUGE_VAL;
        box_max[a] = -HUGE_VAL;
        for (uint32_t i = 0; i < s->count; i++) {
            const struct spc_header *h = spc_reader_header(s->archives[i]->reader);
            box_min[a] = fmin(box_min[a], h->box_min[a]);
            box_max[a] = fmax(box_max[a], h->box_max[a]);
        }
    }
    return s->count > 0;
}

/* ---- frames ------------------------------------------------------------------------------------ */

static enum spc_status select_all(struct spv_scene *s, const struct spv_view *view, struct spv_scene_stats *stats,
                                  struct spc_error *err)
{
    const double began = now_ms();
    for (uint32_t i = 0; i < s->count; i++) {
        struct spv_selection *chosen = &s->archives[i]->selection;
        const enum spc_status status = spv_select(s->archives[i]->reader, view, chosen, err);
        if (status != SPC_OK)
            return status;
        stats->nodes_total += spc_reader_header(s->archives[i]->reader)->node_count;
        stats->nodes_chosen += chosen->nodes;
        stats->bytes_chosen += chosen->bytes;
        stats->clusters_total += chosen->clusters_total;
        stats->clusters_drawn += chosen->clusters_drawn;
        stats->culled_frustum += chosen->culled_frustum;
        stats->culled_backface += chosen->culled_backface;
        stats->culled_range += chosen->culled_range;
    }
    stats->select_ms = now_ms() - began;
    return SPC_OK;
}

static void take_frames(struct spv_scene *s, struct spv_scene_stats *stats)
{
    struct spc_error err;
    for (uint32_t i = 0; i < s->count; i++) {
        struct archive *a = s->archives[i];
        a->frame = spv_resident_frame(a->resident, &a->selection);
        s->parts[i] = a->frame->part;
        stats->blocks_missing += a->frame->missing;
        stats->blocks_failed += a->frame->failed;
        stats->bytes_read += a->frame->read_bytes;
        s->bytes_read += a->frame->read_bytes;
        stats->tops += a->frame->part.top_count;
        spv_resident_error(a->resident, &err);
        if (a->frame->failed > 0 && err.status != SPC_OK)
            s->fault = i;
        else if (s->fault == i && a->frame->missing == 0)
            s->fault = SPV_SCENE_ARCHIVES_MAX;
    }
}

/*
 * Where the camera will be when it goes on as it does: moved by what it moved, times frames. A turn is
 * taken for what it does to the axes, which suffices for a guess.
 */
static struct spv_view look_ahead(const struct spv_view *last, const struct spv_view *now, double frames)
{
    struct spv_view v = *now;
    double eye[3], target[3];
    for (int a = 0; a < 3; a++) {
        eye[a] = now->camera.eye[a] + frames * (now->camera.eye[a] - last->camera.eye[a]);
        target[a] = eye[a] + now->camera.forward[a] + frames * (now->camera.forward[a] - last->camera.forward[a]);
    }
    const double fov = 2 * atan(now->camera.height / (2 * now->camera.focal_px));
    if (!spv_camera_look(&v.camera, eye, target, now->camera.up, fov, now->camera.width, now->camera.height))
        v.camera = now->camera;
    return v;
}

static bool moved(const struct spv_camera *a, const struct spv_camera *b)
{
    return memcmp(a->eye, b->eye, sizeof a->eye) != 0 || memcmp(a->forward, b->forward, sizeof a->forward) != 0;
}

static void ask(struct spv_scene *s, const struct spv_view *view, struct spv_scene_stats *stats)
{
    const bool moves = s->has_last && moved(&s->last.camera, &view->camera);
    for (uint32_t i = 0; i < s->count; i++) {
        struct archive *a = s->archives[i];
        spv_resident_ask(a->resident);
        stats->bytes_resident += a->frame->resident_bytes;
        stats->blocks_hidden += spv_resident_hidden(a->resident);
        if (!moves || spv_resident_busy(a->resident) >= s->options.threads)
            continue;
        const struct spv_view next = look_ahead(&s->last, view, AHEAD_FRAMES);
        if (spv_select(a->reader, &next, &a->ahead, NULL) == SPC_OK)
            spv_resident_prefetch(a->resident, &a->ahead);
    }
    s->last = *view;
    s->has_last = true;
}

enum spc_status spv_scene_frame(struct spv_scene *s, const struct spv_view *view, const struct spv_view *frozen,
                                const struct spv_draw_options *options, uint8_t *rgba,
                                struct spv_scene_stats *stats, struct spc_error *err)
{
    const struct spv_view *tested = frozen != NULL ? frozen : view;
    *stats = (struct spv_scene_stats){0};
    enum spc_status status = select_all(s, tested, stats, err);
    if (status != SPC_OK)
        return status;
    const double began = now_ms();
    take_frames(s, stats);
    status = spv_draw_frame(s->draw, view, tested, s->parts, s->count, options, rgba, &stats->drawn, err);
    if (status == SPC_OK)
        ask(s, tested, stats);
    stats->draw_ms = now_ms() - began;
    return status;
}

enum spc_status spv_scene_load(struct spv_scene *s, const struct spv_view *view, uint32_t *missing,
                               struct spc_error *err)
{
    for (;;) {
        struct spv_scene_stats stats = {0};
        const enum spc_status status = select_all(s, view, &stats, err);
        if (status != SPC_OK)
            return status;
        take_frames(s, &stats);
        *missing = stats.blocks_missing;
        for (uint32_t i = 0; i < s->count; i++)
            spv_resident_ask(s->archives[i]->resident);
        if (*missing == 0 || !spv_scene_wait(s))
            return SPC_OK;
    }
}

uint64_t spv_scene_bytes_read(const struct spv_scene *s)
{
    return s->bytes_read;
}

unsigned spv_scene_busy(const struct spv_scene *s)
{
    unsigned busy = 0;
    for (uint32_t i = 0; i < s->count; i++)
        busy += spv_resident_busy(s->archives[i]->resident);
    return busy;
}

bool spv_scene_wait(struct spv_scene *s)
{
    for (uint32_t i = 0; i < s->count; i++)
        if (spv_resident_wait(s->archives[i]->resident))
            return true;
    return false;
}

uint32_t spv_scene_fault(const struct spv_scene *s, struct spc_error *err)
{
    if (s->fault < s->count)
        spv_resident_error(s->archives[s->fault]->resident, err);
    return s->fault;
}
