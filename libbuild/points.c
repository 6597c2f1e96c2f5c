/*
 * points.c - the nearest places of all points, part by part.
 *
 * First each part's records are put into the order of a k-d tree and written anew; of its subtrees of
 * some hundred points, the pages, the boxes stay in memory. Then each part is read again. What is
 * nearest inside it is found in memory, a bucket of neighbouring points at a time; where their reach
 * goes over into pages of other parts those are fetched, the nearest first, through a small cache. Along
 * a surface that is an eighth of what there is.
 *
 * Records are written back where they are: who reads a page meanwhile looks at the coordinates, which
 * stay the same.
 */
#include "points.h"

#include "pool.h"
#include "surfel.h"
#include "vec.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

enum {
    PAGE = 1024,                    /* most points of a page */
    RUNS = PAGE / SPB_BUCKET,
    CACHED = 64,                    /* pages, a thread */
    AROUND_MAX = 4096,              /* pages around one that are kept in a list */
    CHUNK_BYTES = 1 << 20,
};

static enum spc_status no_memory(struct spc_error *err)
{
    return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to estimate points");
}

/* ---- vertices to records -------------------------------------------------------------------------- */

struct reading {
    uint8_t vertices[SPB_BATCH_MAX * SPB_VERTEX_BYTES_MAX];
    uint8_t records[SPB_BATCH_MAX * 44];
    double keys[SPB_BATCH_MAX][4];
    uint32_t cells[SPB_BATCH_MAX];
};

static uint32_t make_records(const struct spb_vertices *v, const struct spb_record_format *format,
                             const uint8_t *vertex, uint32_t count, uint8_t *records)
{
    const uint32_t xyz_bytes = v->wide ? 24 : 12;
    uint32_t kept = 0;
    for (uint32_t i = 0; i < count; i++, vertex += v->bytes) {
        uint8_t *record = records + (size_t)kept * format->bytes;
        double xyz[3];
        spb_vertex_load(v, vertex, xyz);
        if (!isfinite(xyz[0]) || !isfinite(xyz[1]) || !isfinite(xyz[2]))
            continue;
        memcpy(record, vertex, xyz_bytes);
        memset(record + xyz_bytes, 0, 16);
        if (v->normals)
            memcpy(record + xyz_bytes, vertex + xyz_bytes, 12);
        if (v->colors)
            memcpy(record + xyz_bytes + 16, vertex + v->bytes - 4, 4);
        kept++;
    }
    return kept;
}

static enum spc_status read_batch(const struct spb_vertices *v, const struct spb_space *space,
                                  uint64_t first, uint32_t count, struct reading *r,
                                  struct spb_distributor *out, struct spc_error *err)
{
    const uint8_t *vertices = r->vertices;
    enum spc_status status = SPC_OK;
    if (v->table != NULL)
        vertices = v->table + first * v->bytes;
    else
        status = spb_tmpfile_read(v->file, v->off + first * v->bytes, r->vertices,
                                  (size_t)count * v->bytes, err);
    if (status != SPC_OK)
        return status;
    const uint32_t kept = make_records(v, &out->format, vertices, count, r->records);
    spb_record_keys(&out->format, space, r->records, kept, r->keys);
    spb_distributor_cells(out, (const double(*)[4])r->keys, kept, r->cells);
    for (uint32_t i = 0; i < kept && status == SPC_OK; i++)
        status = spb_distributor_add(out, r->cells[i], r->keys[i],
                                     r->records + (size_t)i * out->format.bytes, err);
    return status;
}

enum spc_status spb_points_read(const struct spb_vertices *v, const struct spb_space *space,
                                struct spb_distributor *out, struct spb_progress *progress,
                                struct spc_error *err)
{
    struct reading *r = malloc(sizeof *r);
    enum spc_status status = r ? SPC_OK : no_memory(err);
    for (uint64_t first = 0; first < v->count && status == SPC_OK; first += SPB_BATCH_MAX) {
        const uint64_t left = v->count - first;
        status = read_batch(v, space, first, (uint32_t)(left < SPB_BATCH_MAX ? left : SPB_BATCH_MAX),
                            r, out, err);
        if (status == SPC_OK && spb_progress_tell(progress, "read points", first, v->count))
            status = spc_fail(err, SPC_CANCELLED, SPC_NO_OFF, "cancelled");
    }
    free(r);
    return status == SPC_OK ? spb_distributor_flush(out, err) : status;
}

/* ---- parts and pages ------------------------------------------------------------------------------ */

struct page {                       /* records of a part; of a place where many are, one */
    float min[3], max[3];
    uint32_t first, count;
};

struct part {
    uint64_t off, count;            /* of its records in the file */
    double min[3], max[3];
    struct page *pages;
    uint32_t page_count, page_max;
};

struct estimate {
    const struct spb_points_input *in;
    struct spb_plan *plan;
    struct part *parts;             /* [plan->part_count] */
    uint32_t pages_most;            /* of one part */
    pthread_mutex_t lock;
    struct spb_survey *survey;
    size_t done_before;             /* steps of parts, for progress */
};

struct workspace {                  /* of one part */
    uint8_t *records;
    struct spb_key *keys, *scratch;
    struct spb_kd_node *nodes;
    struct spb_kd kd;
};

static void workspace_release(struct workspace *w)
{
    free(w->records);
    free(w->keys);
    free(w->scratch);
    free(w->nodes);
}

static enum spc_status workspace_init(struct workspace *w, uint64_t count, uint32_t record_bytes,
                                      struct spc_error *err)
{
    *w = (struct workspace){
        .records = malloc((size_t)count * record_bytes),
        .keys = malloc((size_t)count * sizeof *w->keys),
        .scratch = malloc((size_t)count * sizeof *w->scratch),
        .nodes = malloc(2 * (size_t)count * sizeof *w->nodes),     /* few are touched */
    };
    return w->records && w->keys && w->scratch && w->nodes ? SPC_OK : no_memory(err);
}

static void build_tree(const struct estimate *e, struct workspace *w, uint32_t count)
{
    spb_record_keys(&e->in->format, e->in->space, w->records, count, &w->keys[0].v);
    spb_kd_build(w->keys, w->scratch, count, w->nodes, &w->kd);
}

static bool is_page(const struct spb_kd_node *n)
{
    return n->count <= PAGE || n->right == 0;
}

/* The node after all that are below this one. */
static uint32_t skip_node(const struct spb_kd *kd, uint32_t node)
{
    while (kd->nodes[node].right != 0)
        node = kd->nodes[node].right;
    return node + 1;
}

static enum spc_status list_pages(const struct spb_kd *kd, struct part *part, struct spc_error *err)
{
    memcpy(part->min, kd->nodes[0].min, sizeof part->min);
    memcpy(part->max, kd->nodes[0].max, sizeof part->max);
    for (uint32_t i = 0; i < kd->node_count;) {
        const struct spb_kd_node *n = &kd->nodes[i];
        if (!is_page(n)) {
            i++;
            continue;
        }
        if (part->page_count == part->page_max) {
            const uint32_t grown = part->page_max + part->page_max / 2 + 16;
            struct page *pages = realloc(part->pages, grown * sizeof *pages);
            if (pages == NULL)
                return no_memory(err);
            part->pages = pages;
            part->page_max = grown;
        }
        struct page *page = &part->pages[part->page_count++];
        for (int a = 0; a < 3; a++) {
            page->min[a] = float_below(n->min[a]);
            page->max[a] = float_above(n->max[a]);
        }
        page->first = n->first;
        page->count = n->count > PAGE || (n->right == 0 && n->count > SPB_BUCKET) ? 1 : n->count;
        i = skip_node(kd, i);
    }
    return SPC_OK;
}

static enum spc_status write_ordered(const struct estimate *e, const struct workspace *w,
                                     const struct part *part, struct spc_error *err)
{
    const uint32_t bytes = e->in->format.bytes;
    const uint32_t most = CHUNK_BYTES / bytes;
    uint8_t *chunk = malloc((size_t)most * bytes);
    enum spc_status status = chunk ? SPC_OK : no_memory(err);
    for (uint64_t first = 0; first < part->count && status == SPC_OK; first += most) {
        const uint64_t n = part->count - first < most ? part->count - first : most;
        for (uint64_t i = 0; i < n; i++)
            memcpy(chunk + i * bytes, w->records + (size_t)w->keys[first + i].v[SPB_KEY_FACE] * bytes,
                   bytes);
        status = spb_tmpfile_write(e->in->file, part->off + first * bytes, chunk, (size_t)n * bytes, err);
    }
    free(chunk);
    return status;
}

/* A job: puts a part into order. */
static enum spc_status order_part(void *ctx, size_t i, struct spc_error *err)
{
    struct estimate *e = ctx;
    struct part *part = &e->parts[i];
    struct workspace w;
    const uint32_t bytes = e->in->format.bytes;
    part->count = e->plan->parts[i].count;
    if (part->count >= (uint64_t)1 << 31)
        return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "a part is too large to estimate in memory");
    enum spc_status status = workspace_init(&w, part->count, bytes, err);
    if (status == SPC_OK)
        status = spb_part_read(&e->plan->parts[i], e->in->file, bytes, w.records, err);
    if (status == SPC_OK) {
        build_tree(e, &w, (uint32_t)part->count);
        status = list_pages(&w.kd, part, err);
    }
    part->off = spb_tmpfile_reserve(e->in->file, part->count * bytes);
    if (status == SPC_OK)
        status = write_ordered(e, &w, part, err);
    workspace_release(&w);
    return status;
}

/* Each part becomes one bucket, in one extent. */
static enum spc_status move_parts(struct estimate *e, struct spc_error *err)
{
    struct spb_plan *plan = e->plan;
    for (uint32_t i = 0; i < plan->bucket_count; i++)
        spb_bucket_free(plan->buckets[i]);
    plan->bucket_count = 0;
    if (plan->bucket_max < plan->part_count) {
        struct spb_bucket **buckets = realloc(plan->buckets, plan->part_count * sizeof *buckets);
        if (buckets == NULL)
            return no_memory(err);
        plan->buckets = buckets;
        plan->bucket_max = plan->part_count;
    }
    for (uint32_t i = 0; i < plan->part_count; i++) {
        struct part *part = &e->parts[i];
        struct spb_bucket *bucket = calloc(1, sizeof *bucket);
        struct spb_extent *extent = malloc(sizeof *extent);
        if (bucket == NULL || extent == NULL) {
            free(bucket);
            free(extent);
            return no_memory(err);
        }
        *extent = (struct spb_extent){part->off, part->count * e->in->format.bytes};
        bucket->pile = (struct spb_pile){.count = part->count, .extents = extent, .extent_count = 1,
                                         .extent_max = 1};
        memcpy(bucket->min, part->min, sizeof bucket->min);
        memcpy(bucket->max, part->max, sizeof bucket->max);
        plan->buckets[plan->bucket_count++] = bucket;
        plan->parts[i].pieces[0] = (struct spb_piece){bucket, 0, part->count};
        plan->parts[i].piece_count = 1;
        e->pages_most = part->page_count > e->pages_most ? part->page_count : e->pages_most;
    }
    return SPC_OK;
}

/* ---- pages of other parts -------------------------------------------------------------------------- */

struct cached {
    uint32_t part, page;            /* SPC_NONE: empty */
    uint32_t count;
    uint64_t used;                  /* when */
    double axis[3][PAGE];
    double min[RUNS][3], max[RUNS][3];          /* of SPB_BUCKET points each */
};

struct found {                      /* a page or a part */
    double distance;                /* squared */
    uint32_t part, page;
};

struct search {                     /* of one part */
    const struct estimate *e;
    uint32_t own;
    uint64_t clock;
    struct cached *cache;           /* [CACHED] */
    uint8_t *raw;                   /* a page's records */
    struct spb_key *keys;           /* [PAGE] */
    struct found *around;           /* [around_count] pages within reach of the page under way */
    uint32_t around_count;
    double reach;                   /* squared; below 0: there are too many */
    struct found *pages;            /* [larger of AROUND_MAX and pages_most] */
    struct found *parts;            /* [part_count] */
};

static void search_release(struct search *s)
{
    free(s->cache);
    free(s->raw);
    free(s->keys);
    free(s->around);
    free(s->pages);
    free(s->parts);
}

static enum spc_status search_init(struct search *s, const struct estimate *e, uint32_t own,
                                   struct spc_error *err)
{
    const size_t pages = e->pages_most > AROUND_MAX ? e->pages_most : AROUND_MAX;
    *s = (struct search){
        .e = e, .own = own,
        .cache = malloc(CACHED * sizeof *s->cache),
        .raw = malloc((size_t)PAGE * e->in->format.bytes),
        .keys = malloc(PAGE * sizeof *s->keys),
        .around = malloc(AROUND_MAX * sizeof *s->around),
        .pages = malloc(pages * sizeof *s->pages),
        .parts = malloc(e->plan->part_count * sizeof *s->parts),
    };
    if (!s->cache || !s->raw || !s->keys || !s->around || !s->pages || !s->parts)
        return no_memory(err);
    for (int i = 0; i < CACHED; i++) {
        s->cache[i].part = SPC_NONE;
        s->cache[i].used = 0;
    }
    return SPC_OK;
}

static void fill_cached(struct cached *c, const struct spb_key *keys)
{
    for (int a = 0; a < 3; a++)
        for (uint32_t i = 0; i < c->count; i++)
            c->axis[a][i] = keys[i].v[a];
    for (uint32_t first = 0, r = 0; first < c->count; first += SPB_BUCKET, r++)
        for (int a = 0; a < 3; a++) {
            c->min[r][a] = c->max[r][a] = c->axis[a][first];
            for (uint32_t i = first + 1; i < first + SPB_BUCKET && i < c->count; i++) {
                c->min[r][a] = smaller_of(c->axis[a][i], c->min[r][a]);
                c->max[r][a] = larger_of(c->axis[a][i], c->max[r][a]);
            }
        }
}

/* A page out of the cache, or into it in place of the one that was not used for longest. */
static enum spc_status fetch_page(struct search *s, uint32_t part, uint32_t page, struct cached **out,
                                  struct spc_error *err)
{
    const struct spb_points_input *in = s->e->in;
    const struct page *p = &s->e->parts[part].pages[page];
    struct cached *oldest = &s->cache[0];
    for (int i = 0; i < CACHED; i++) {
        struct cached *c = &s->cache[i];
        if (c->part == part && c->page == page) {
            c->used = ++s->clock;
            *out = c;
            return SPC_OK;
        }
        oldest = c->used < oldest->used ? c : oldest;
    }
    const uint32_t bytes = in->format.bytes;
    const enum spc_status status =
        spb_tmpfile_read(in->file, s->e->parts[part].off + (uint64_t)p->first * bytes, s->raw,
                         (size_t)p->count * bytes, err);
    if (status != SPC_OK)
        return status;
    spb_record_keys(&in->format, in->space, s->raw, p->count, &s->keys[0].v);
    oldest->part = part;
    oldest->page = page;
    oldest->count = p->count;
    oldest->used = ++s->clock;
    fill_cached(oldest, s->keys);
    *out = oldest;
    return SPC_OK;
}

static double page_distance(const double min[3], const double max[3], const struct page *p)
{
    const double page_min[3] = {(double)p->min[0], (double)p->min[1], (double)p->min[2]};
    const double page_max[3] = {(double)p->max[0], (double)p->max[1], (double)p->max[2]};
    return spb_box_distance(min, max, page_min, page_max);
}

static int by_distance(const void *a, const void *b)
{
    const double x = ((const struct found *)a)->distance, y = ((const struct found *)b)->distance;
    return (x > y) - (x < y);
}

static enum spc_status look_at_pages(struct search *s, struct spb_group *g, uint32_t count,
                                     struct spc_error *err)
{
    qsort(s->pages, count, sizeof *s->pages, by_distance);
    for (uint32_t i = 0; i < count && s->pages[i].distance <= g->worst; i++) {
        struct cached *c = NULL;
        const enum spc_status status = fetch_page(s, s->pages[i].part, s->pages[i].page, &c, err);
        if (status != SPC_OK)
            return status;
        for (uint32_t first = 0, r = 0; first < c->count; first += SPB_BUCKET, r++) {
            const double *const axis[3] = {c->axis[0] + first, c->axis[1] + first, c->axis[2] + first};
            const uint32_t n = c->count - first < SPB_BUCKET ? c->count - first : SPB_BUCKET;
            if (spb_box_distance(g->min, g->max, c->min[r], c->max[r]) <= g->worst)
                spb_group_look(g, axis, n, c->min[r], c->max[r]);
        }
    }
    return SPC_OK;
}

/* Pages of other parts within a page's own length, in which its points' places mostly are. */
static void list_around(struct search *s, const double min[3], const double max[3])
{
    const struct estimate *e = s->e;
    s->around_count = 0;
    s->reach = 0;
    for (int a = 0; a < 3; a++)
        s->reach += (max[a] - min[a]) * (max[a] - min[a]);
    for (uint32_t i = 0; i < e->plan->part_count; i++) {
        const struct part *part = &e->parts[i];
        if (i == s->own || spb_box_distance(min, max, part->min, part->max) > s->reach)
            continue;
        for (uint32_t k = 0; k < part->page_count; k++) {
            if (page_distance(min, max, &part->pages[k]) > s->reach)
                continue;
            if (s->around_count == AROUND_MAX) {
                s->reach = -1;
                return;
            }
            s->around[s->around_count++] = (struct found){0, i, k};
        }
    }
}

static enum spc_status look_around(struct search *s, struct spb_group *g, struct spc_error *err)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < s->around_count; i++) {
        const struct found *f = &s->around[i];
        const double distance = page_distance(g->min, g->max, &s->e->parts[f->part].pages[f->page]);
        if (distance <= g->worst)
            s->pages[n++] = (struct found){distance, f->part, f->page};
    }
    return n > 0 ? look_at_pages(s, g, n, err) : SPC_OK;
}

/* Both hold one place, which is the same: there may be thousands of parts of it. */
static bool same_place(const struct spb_group *g, const struct part *part)
{
    bool same = true;
    for (int a = 0; a < 3; a++)
        same &= g->min[a] == g->max[a] && part->min[a] == g->min[a] && part->max[a] == g->min[a];
    return same;
}

/* Points far from others, or without so many in their part: part after part, the nearest first. */
static enum spc_status look_everywhere(struct search *s, struct spb_group *g, struct spc_error *err)
{
    const struct estimate *e = s->e;
    enum spc_status status = SPC_OK;
    uint32_t n = 0;
    for (uint32_t i = 0; i < e->plan->part_count; i++) {
        const double distance = spb_box_distance(g->min, g->max, e->parts[i].min, e->parts[i].max);
        if (i != s->own && distance <= g->worst && !same_place(g, &e->parts[i]))
            s->parts[n++] = (struct found){distance, i, 0};
    }
    qsort(s->parts, n, sizeof *s->parts, by_distance);
    for (uint32_t i = 0; i < n && s->parts[i].distance <= g->worst && status == SPC_OK; i++) {
        const struct part *part = &e->parts[s->parts[i].part];
        uint32_t pages = 0;
        for (uint32_t k = 0; k < part->page_count; k++) {
            const double distance = page_distance(g->min, g->max, &part->pages[k]);
            if (distance <= g->worst)
                s->pages[pages++] = (struct found){distance, s->parts[i].part, k};
        }
        status = look_at_pages(s, g, pages, err);
    }
    return status;
}

/* ---- estimating ------------------------------------------------------------------------------------ */

struct filling {
    const struct estimate *e;
    struct workspace *w;
    struct search *search;
    struct spb_group *group;
    uint64_t bins[SPB_EDGE_BINS];
};

/* Points of a bucket; where there are more than neighbours all are in the first one's place. */
static void fill_records(struct filling *f, const struct spb_kd_node *n)
{
    const struct spb_record_format *format = &f->e->in->format;
    const struct spb_group *g = f->group;
    for (uint32_t i = 0; i < n->count; i++) {
        const uint32_t q = i < g->count ? i : 0;
        const double from[3] = {g->axis[0][q], g->axis[1][q], g->axis[2][q]};
        uint8_t *at = f->w->records + (size_t)(n->first + i) * format->bytes + spb_point_normal(format);
        struct spb_surfel surfel;
        float given[3];
        memcpy(given, at, sizeof given);
        spb_surfel_make(from, &g->near[q], f->e->in->normals ? given : NULL, &surfel);
        memcpy(at, surfel.normal, 12);
        memcpy(at + 12, &surfel.radius, 4);
        const double radius = (double)surfel.radius;
        f->bins[spb_survey_bin(3 * radius * radius)]++;
    }
}

static enum spc_status find_near(struct filling *f, uint32_t node, uint32_t room, struct spc_error *err)
{
    spb_group_init(f->group, &f->w->kd, node, room);
    if (f->e->plan->part_count == 1)
        return SPC_OK;
    return f->group->worst <= f->search->reach ? look_around(f->search, f->group, err)
                                               : look_everywhere(f->search, f->group, err);
}

static bool any_on_line(const struct spb_group *g)
{
    bool any = false;
    for (uint32_t q = 0; q < g->count; q++) {
        const double from[3] = {g->axis[0][q], g->axis[1][q], g->axis[2][q]};
        any |= spb_surfel_on_line(from, &g->near[q]);
    }
    return any;
}

static enum spc_status fill_page(struct filling *f, uint32_t node, uint32_t end, struct spc_error *err)
{
    const struct spb_kd *kd = &f->w->kd;
    enum spc_status status = SPC_OK;
    if (spb_pool_cancelled())
        return spc_fail(err, SPC_CANCELLED, SPC_NO_OFF, "cancelled");
    if (f->e->plan->part_count > 1)
        list_around(f->search, kd->nodes[node].min, kd->nodes[node].max);
    for (; node < end && status == SPC_OK; node++) {
        if (kd->nodes[node].right != 0)
            continue;
        status = find_near(f, node, SPB_NEAR, err);
        if (status == SPC_OK && any_on_line(f->group))
            status = find_near(f, node, SPB_NEAR_MAX, err);
        if (status == SPC_OK)
            fill_records(f, &kd->nodes[node]);
    }
    return status;
}

static enum spc_status fill_part(struct filling *f, struct spc_error *err)
{
    const struct spb_kd *kd = &f->w->kd;
    enum spc_status status = SPC_OK;
    for (uint32_t i = 0; i < kd->node_count && status == SPC_OK;) {
        const uint32_t end = is_page(&kd->nodes[i]) ? skip_node(kd, i) : i;
        if (end > i)
            status = fill_page(f, i, end, err);
        i = end > i ? end : i + 1;
    }
    return status;
}

static void add_bins(struct estimate *e, const uint64_t *bins)
{
    pthread_mutex_lock(&e->lock);
    for (int i = 0; i < SPB_EDGE_BINS; i++) {
        e->survey->edge_bins[i] += bins[i];
        e->survey->size_bins[i] += bins[i];     /* their triangles are equilateral */
    }
    pthread_mutex_unlock(&e->lock);
}

/* A job: finds what is nearest to the points of a part, and writes what they become. */
static enum spc_status estimate_part(void *ctx, size_t i, struct spc_error *err)
{
    struct estimate *e = ctx;
    const struct part *part = &e->parts[i];
    const size_t bytes = (size_t)part->count * e->in->format.bytes;
    struct workspace w;
    struct search search = {0};
    struct filling *f = calloc(1, sizeof *f);
    struct spb_group *group = malloc(sizeof *group);
    enum spc_status status = workspace_init(&w, part->count, e->in->format.bytes, err);
    if (status == SPC_OK && (f == NULL || group == NULL))
        status = no_memory(err);
    if (status == SPC_OK)
        status = search_init(&search, e, (uint32_t)i, err);
    if (status == SPC_OK)
        status = spb_tmpfile_read(e->in->file, part->off, w.records, bytes, err);
    if (status == SPC_OK) {
        build_tree(e, &w, (uint32_t)part->count);
        spb_kd_coordinates(&w.kd, w.keys, w.scratch, (uint32_t)part->count);
        f->e = e;
        f->w = &w;
        f->search = &search;
        f->group = group;
        status = fill_part(f, err);
    }
    if (status == SPC_OK)
        status = spb_tmpfile_write(e->in->file, part->off, w.records, bytes, err);
    if (status == SPC_OK)
        add_bins(e, f->bins);
    search_release(&search);
    workspace_release(&w);
    free(group);
    free(f);
    return status;
}

static int part_done(void *ctx, size_t done)
{
    const struct estimate *e = ctx;
    return spb_progress_tell(e->in->progress, "estimate points", e->done_before + done,
                             2 * (uint64_t)e->plan->part_count);
}

enum spc_status spb_points_estimate(struct spb_plan *plan, const struct spb_points_input *in,
                                    struct spb_survey *survey, struct spc_error *err)
{
    struct estimate e = {.in = in, .plan = plan, .survey = survey,
                         .parts = calloc(plan->part_count, sizeof *e.parts)};
    if (e.parts == NULL)
        return no_memory(err);
    pthread_mutex_init(&e.lock, NULL);
    enum spc_status status =
        spb_pool_run(plan->part_count, in->threads, order_part, part_done, &e, err);
    e.done_before = plan->part_count;
    if (status == SPC_OK)
        status = move_parts(&e, err);
    if (status == SPC_OK)
        status = spb_pool_run(plan->part_count, in->threads, estimate_part, part_done, &e, err);
    pthread_mutex_destroy(&e.lock);
    for (uint32_t i = 0; i < plan->part_count; i++)
        free(e.parts[i].pages);
    free(e.parts);
    return status;
}
