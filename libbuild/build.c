#include "build.h"

#include "budget.h"
#include "chain.h"
#include "detail.h"
#include "faces.h"
#include "layout.h"
#include "points.h"
#include "pool.h"
#include "top.h"

#include <errno.h>
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <time.h>

const char *const spb_phase_name[SPB_PHASE_COUNT] = {
    "open scans", "read vertices", "sort corners", "read faces", "plan parts", "estimate points",
    "build parts", "write archive",
};

void spb_build_defaults(struct spb_build_options *options)
{
    *options = (struct spb_build_options){
        .triangles = true,
        .detail = SPB_DETAIL_AUTO,
        .codec = SPC_CODEC_ZSTD,
        .level = 1,
        .cluster_nodes = 28672,     /* at most 21 845 leaves with their vertices: one block */
        .block_nodes = 32768,
        .memory = (uint64_t)1 << 30,
    };
}

struct build {
    const struct spb_build_options *options;
    struct spb_build_report *report;
    struct spb_progress progress;
    struct spb_source **scans;      /* [scan_count] */
    uint32_t scan_count;
    struct spb_source *source;      /* the only scan, or their chain */
    struct spb_budget budget;
    struct spb_temp temp;
    struct spb_phase_cost charged;  /* sums when a phase was charged last */
    struct spb_vertices vertices;
    struct spb_corner_sort *corners;            /* where vertices are on disk and faces jump */
    struct spb_space space;
    uint8_t *cells;                 /* of the space */
    struct spb_face_stats stats;
    struct spb_tmpfile *faces_file, *spool_file;
    struct spb_distributor distributor;
    struct spb_plan plan;
    struct spb_spool *spool;
    struct spb_pack_shared shared;
    struct spb_top top;
    struct spc_writer *writer;
    uint32_t root, height;
    bool points;                    /* the scan has no faces */
    bool in_scan;                   /* the stage under way reads the scan: errors are its */
};

/* ---- what it costs -----------------------------------------------------------------------------*/

static double seconds(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

static struct spb_phase_cost cost_now(const struct build *b)
{
    return (struct spb_phase_cost){seconds(CLOCK_MONOTONIC), seconds(CLOCK_PROCESS_CPUTIME_ID),
                                   atomic_load(&b->temp.written), atomic_load(&b->temp.read)};
}

/* Adds to the phase what was spent since the last charge. */
static void charge(struct build *b, enum spb_phase phase)
{
    struct spb_phase_cost *since = &b->charged;
    const struct spb_phase_cost now = cost_now(b);
    struct spb_phase_cost *out = &b->report->phases[phase];
    out->wall_s += now.wall_s - since->wall_s;
    out->cpu_s += now.cpu_s - since->cpu_s;
    out->temp_written += now.temp_written - since->temp_written;
    out->temp_read += now.temp_read - since->temp_read;
    *since = now;
}

/* ---- reading ----------------------------------------------------------------------------------- */

static const char *scan_name(const struct build *b, uint32_t i)
{
    return i == 0 ? b->options->scan : b->options->more[i - 1];
}

static enum spc_status open_scan(struct build *b, struct spc_error *err)
{
    const struct spb_source_options in = {.progress = &b->progress, .temp = &b->temp};
    const char *name = scan_name(b, b->scan_count);
    struct spb_source **out = &b->scans[b->scan_count];
    const enum spc_status status = b->options->salvage ? spb_source_salvage(name, &in, out, err)
                                                       : spb_source_open(name, &in, out, err);
    if (status != SPC_OK)
        return status;
    const struct spb_source_info *info = spb_source_info(*out);
    if (info->salvage != NULL)
        b->report->salvage = *info->salvage;
    if (b->options->facts != NULL) {
        struct spb_scan_facts *facts = &b->options->facts[b->scan_count];
        *facts = (struct spb_scan_facts){.vertices = info->vertex_count, .faces = info->face_count};
        snprintf(facts->format, sizeof facts->format, "%s", info->format);
    }
    b->report->vertices += info->vertex_count;
    if (info->face_count == 0 && info->vertex_count == 0)
        return spc_fail(err, SPC_INPUT_EMPTY, SPC_NO_OFF, "it holds neither faces nor points");
    if (b->scan_count > 0 && b->points != (info->face_count == 0))
        return spc_fail(err, SPC_INPUT_BAD, SPC_NO_OFF, "it holds %s, but those before hold %s",
                        b->points ? "faces" : "points without faces", b->points ? "points alone" : "faces");
    b->points = info->face_count == 0;
    if (b->points && !info->normals && b->options->cull == SPB_CULL_BACK)
        return spc_fail(err, SPC_INPUT_BAD, SPC_NO_OFF,
                        "it holds points without normals: what their back is cannot be known");
    b->scan_count++;
    return SPC_OK;
}

static enum spc_status open_source(struct build *b, struct spc_error *err)
{
    const uint32_t count = 1 + b->options->more_count;
    enum spc_status status = SPC_OK;
    b->scans = calloc(count, sizeof *b->scans);
    if (b->scans == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for %u scans", count);
    b->in_scan = true;
    while (b->scan_count < count && status == SPC_OK) {
        status = open_scan(b, err);
        if (status == SPC_OK && count > 1)      /* until it is its turn */
            spb_source_pause(b->scans[b->scan_count - 1]);
    }
    if (status != SPC_OK)
        return status;
    b->in_scan = false;
    if (count > 1)
        return spb_source_chain(b->scans, count, &b->source, err);
    b->source = b->scans[0];
    return SPC_OK;
}

static void close_source(struct build *b)
{
    if (b->source != NULL && b->source != b->scans[0])
        spb_source_close(b->source);
    for (uint32_t i = 0; b->scans != NULL && i < 1 + b->options->more_count; i++)
        spb_source_close(b->scans[i]);
    free(b->scans);
}

/* The file that an error is about. */
static const char *file_at_fault(const struct build *b)
{
    if (!b->in_scan || atomic_load(&b->temp.failed))
        return b->options->out;
    return scan_name(b, b->source != NULL ? spb_source_member(b->source) : b->scan_count);
}

/* Readers that wait for their turn keep what they know of their headers: 30 KB, of PLY and of OBJ. */
static uint64_t open_scans_bytes(const struct build *b)
{
    enum { A_SCAN = 36 << 10 };
    return (uint64_t)b->options->more_count * A_SCAN;
}

static struct spb_record_format record_format(const struct build *b)
{
    const struct spb_source_info *info = spb_source_info(b->source);
    return b->points ? spb_point_format(info->wide, info->colors)
                     : spb_record_format(info->wide, spb_source_colored(info));
}

/* Leaves to come; of strips about as many. */
static uint64_t leaves_to_come(const struct build *b)
{
    const struct spb_source_info *info = spb_source_info(b->source);
    return b->points ? info->vertex_count : info->strips ? info->vertex_count * 2 : info->face_count;
}

static enum spc_status make_budget(struct build *b, struct spc_error *err)
{
    const struct spb_source_info *info = spb_source_info(b->source);
    const struct spb_record_format format = record_format(b);
    const uint64_t memory = b->options->memory, open = open_scans_bytes(b);
    const struct spb_budget_input in = {
        .memory = memory > open ? memory - open : 0,
        .threads = b->options->threads ? b->options->threads : spb_pool_cores(),
        .points = b->points, .faces = leaves_to_come(b),
        .vertices = info->vertex_count, .vertex_bytes = spb_vertex_bytes(info),
        .record_bytes = format.bytes, .cluster_nodes = b->options->cluster_nodes,
        .block_nodes = b->options->block_nodes,
    };
    spb_budget_make(&in, &b->budget);
    if (b->options->part_faces > 0)
        b->budget.part_faces = b->options->part_faces;
    if (b->options->slice_log2 > 0 || b->options->vertices_on_disk)
        b->budget.table = 0;
    spb_pool_reserve(b->budget.threads);
    if (b->budget.least + open <= memory)
        return SPC_OK;
    if (b->budget.least <= memory)
        return spc_fail(err, SPC_LIMIT, SPC_NO_OFF,
                        "%u scans at once take at least %llu MB of memory to build, --memory is %llu MB",
                        b->scan_count, (unsigned long long)((b->budget.least + open) >> 20) + 1,
                        (unsigned long long)(memory >> 20));
    return spc_fail(err, SPC_LIMIT, SPC_NO_OFF,
                    "clusters of %u nodes in blocks of %u take at least %llu MB of memory to build, "
                    "--memory is %llu MB", b->options->cluster_nodes, b->options->block_nodes,
                    (unsigned long long)((b->budget.least + open) >> 20) + 1,
                    (unsigned long long)(memory >> 20));
}

/* Before the long work rather than after it: is there room for what will surely be written? */
static enum spc_status check_space(const char *folder, uint64_t needed, const char *of,
                                   struct spc_error *err)
{
    struct statvfs fs;
    if (statvfs(folder, &fs) != 0)
        return SPC_OK;              /* creating a file there will tell */
    const double available = (double)fs.f_bavail * (double)fs.f_frsize;
    if (available >= (double)needed)
        return SPC_OK;
    const bool large = needed >= (uint64_t)1 << 30;     /* units of 1024, as the tools print them */
    const double unit = large ? 0x1p30 : 0x1p20;
    return spc_fail_os(err, ENOSPC, "%s takes about %.1f %s in '%.80s', which has %.1f %s left", of,
                       (double)needed / unit, large ? "GB" : "MB", folder, available / unit,
                       large ? "GB" : "MB");
}

static enum spc_status too_small(const double min[3], const double max[3], struct spc_error *err)
{
    double side = 0;
    for (int a = 0; a < 3; a++)
        side = fmax(side, max[a] - min[a]);
    return spc_fail(err, SPC_INPUT_BAD, SPC_NO_OFF,
                    "it is %.2g across, less than doubles can resolve: multiply its coordinates by 1e100, say, and "
                    "give --scale 1e-100 here", side);
}

static enum spc_status read_vertices(struct build *b, struct spc_error *err)
{
    const enum spc_status status = spb_vertices_read(b->source, &b->temp, b->budget.table,
                                                     &b->progress, &b->vertices, err);
    if (status != SPC_OK)
        return status;
    if (b->vertices.non_finite == b->vertices.count)
        return spc_fail(err, SPC_INPUT_EMPTY, SPC_NO_OFF, "it holds no vertex with finite coordinates");
    for (int a = 0; a < 3; a++)
        if (b->vertices.max[a] - b->vertices.min[a] > 0x1p1000)
            return spc_fail(err, SPC_INPUT_BAD, SPC_NO_OFF,
                            "its coordinates span more than a double can measure");
    return spb_space_init(&b->space, b->vertices.min, b->vertices.max)
        ? SPC_OK : too_small(b->vertices.min, b->vertices.max, err);
}

/* Reading faces and taking them in turns: more threads would wait for the one that reads. */
static unsigned reading_threads(const struct build *b)
{
    return b->budget.threads < 4 ? b->budget.threads : 4;
}

/* A cache takes a part of the buffers while faces are distributed. */
static uint64_t cache_memory(const struct build *b)
{
    return b->vertices.table == NULL && !b->points ? b->budget.buffers / 4 : 0;
}

static enum spc_status sort_corners(struct build *b, struct spc_error *err)
{
    charge(b, SPB_READ_FACES);      /* what the cache has cost in vain */
    enum spc_status status = check_space(b->temp.folder, b->budget.temp + b->budget.sort,
                                         "temporary data", err);
    b->in_scan = status == SPC_OK;
    if (status == SPC_OK)
        status = spb_corner_sort_create(b->source, &b->vertices, &b->temp, b->budget.buffers,
                                        b->options->slice_log2, reading_threads(b), &b->progress,
                                        &b->corners, err);
    charge(b, SPB_SORT_CORNERS);
    return status;
}

/*
 * Cells of half the size that parts ask for, since surfaces are uneven; coarser where a page for
 * each cell that is used, going by a sample of the vertices, would take more than memory.
 */
static enum spc_status choose_cells(struct build *b, uint64_t memory, int *log2,
                                    struct spc_error *err)
{
    const uint64_t parts = leaves_to_come(b) / b->budget.part_faces + 1;
    enum spc_status status = SPC_OK;
    *log2 = spb_cells_for_parts(parts > 1 ? 4 * parts : 1);
    const int surely = spb_cells_within(*log2, memory / 4);
    for (; *log2 > surely; --*log2) {
        uint64_t used = 0;
        status = spb_vertices_cells(&b->vertices, &b->space, *log2, &used, err);
        if (status != SPC_OK || used * SPB_PAGE_BYTES <= memory)
            break;
    }
    return status;
}

static void release_buckets(struct build *b)
{
    for (uint32_t i = 0; i < b->distributor.bucket_count; i++)
        spb_bucket_free(b->distributor.buckets[i]);
    spb_distributor_release(&b->distributor);
    spb_tmpfile_free(b->faces_file);
    b->faces_file = NULL;
}

static enum spc_status distribute(struct build *b, struct spb_vertex_cache *cache,
                                  struct spc_error *err)
{
    const struct spb_record_format format = record_format(b);
    const struct spb_faces_input in = {b->source, &b->vertices, cache, b->corners, &b->space,
                                       reading_threads(b), &b->progress};
    const uint64_t memory = b->budget.buffers - cache_memory(b);
    int cells_log2 = 0;
    double min[3], max[3];
    for (int a = 0; a < 3; a++) {
        min[a] = spb_space_from_file(&b->space, a, b->vertices.min[a]);
        max[a] = spb_space_from_file(&b->space, a, b->vertices.max[a]);
    }
    b->in_scan = false;
    enum spc_status status = spb_tmpfile_create(&b->temp, &b->faces_file, err);
    if (status == SPC_OK)
        status = choose_cells(b, memory, &cells_log2, err);
    if (status == SPC_OK)
        status = spb_distributor_init(&b->distributor, b->faces_file, &format, min, max, cells_log2,
                                      memory, err);
    b->in_scan = status == SPC_OK;
    if (status == SPC_OK)
        status = b->points ? spb_points_read(&b->vertices, &b->space, &b->distributor, &b->progress, err)
                           : spb_faces_read(&in, &b->distributor, &b->stats, err);
    return status;
}

/* With a cache at first; when that does not serve the corners are sorted, and it begins anew. */
static enum spc_status distribute_faces(struct build *b, struct spc_error *err)
{
    struct spb_vertex_cache *cache = NULL;
    enum spc_status status = SPC_OK;
    if (b->vertices.table != NULL || b->corners != NULL)
        return distribute(b, NULL, err);
    if (b->options->slice_log2 == 0) {
        status = spb_vertex_cache_create(&b->vertices, cache_memory(b), &cache, err);
        if (status == SPC_OK)
            status = distribute(b, cache, err);
        const bool failed = cache != NULL && spb_vertex_cache_failed(cache);
        spb_vertex_cache_free(cache);
        if (!failed)
            return status;
        release_buckets(b);
    }
    status = sort_corners(b, err);
    return status == SPC_OK ? distribute(b, NULL, err) : status;
}

/* The space of the vertices that faces use; *other when it is another one than that of all. */
static enum spc_status space_of_used(const struct build *b, struct spb_space *used, bool *other,
                                     struct spc_error *err)
{
    const struct spb_survey *s = &b->stats.survey;
    *other = false;
    if (b->stats.kept == 0)
        return SPC_OK;
    if (!spb_space_init(used, s->file_min, s->file_max))
        return too_small(s->file_min, s->file_max, err);
    *other = used->unit_exp != b->space.unit_exp || used->ulp_exp != b->space.ulp_exp;
    return SPC_OK;
}

/* A file of doubles may hold what once were floats: then they resolve no more than those. */
static void judge_precision(struct build *b)
{
    const struct spb_survey *s = &b->stats.survey;
    double largest = 0;
    int exponent;
    for (int a = 0; a < 3; a++)
        largest = fmax(largest, fmax(fabs(s->file_min[a]), fabs(s->file_max[a])));
    frexp(largest, &exponent);
    b->report->step = ldexp(1, exponent - (b->vertices.beyond_float ? DBL_MANT_DIG : FLT_MANT_DIG));
    b->report->short_edge = ldexp(spb_survey_short_edge(s), b->space.unit_exp);
}

static void keep_remarks(struct build *b)
{
    for (uint32_t i = 0; i < b->scan_count && b->options->facts != NULL; i++)
        snprintf(b->options->facts[i].remark, sizeof b->options->facts[i].remark, "%s",
                 spb_source_remark(b->scans[i]));
}

/* What follows the points in the file is looked at as that behind faces would be. */
static enum spc_status see_end(struct build *b, struct spc_error *err)
{
    struct spb_face_batch *batch = malloc(sizeof *batch);
    enum spc_status status = batch ? spb_source_begin_faces(b->source, err)
                                   : spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to read");
    if (status == SPC_OK)
        status = spb_source_faces(b->source, batch, err);
    free(batch);
    return status;
}

static enum spc_status read_points(struct build *b, struct spc_error *err)
{
    struct spb_face_stats *s = &b->stats;
    s->non_finite = b->vertices.non_finite;
    s->kept = b->vertices.count - s->non_finite;
    if (b->options->strict && s->non_finite > 0)
        return spc_fail(err, SPC_INPUT_BAD, SPC_NO_OFF, "%llu points are not finite",
                        (unsigned long long)s->non_finite);
    enum spc_status status = see_end(b, err);
    if (status == SPC_OK)
        status = distribute(b, NULL, err);
    keep_remarks(b);
    spb_survey_init(&s->survey);
    memcpy(s->survey.file_min, b->vertices.min, sizeof s->survey.file_min);
    memcpy(s->survey.file_max, b->vertices.max, sizeof s->survey.file_max);
    const bool beyond_float = b->vertices.beyond_float;
    spb_vertices_release(&b->vertices);
    b->vertices.beyond_float = beyond_float;        /* to be judged with the edges */
    return status;
}

/*
 * A stray vertex that no face uses would make the unit so large that the surface shrinks to a few
 * lattice points. Who uses it is known once the faces are read; then they are read again.
 */
static enum spc_status read_faces(struct build *b, struct spc_error *err)
{
    struct spb_space used;
    bool other = false;
    if (b->points)
        return read_points(b, err);
    enum spc_status status = distribute_faces(b, err);
    if (status == SPC_OK)
        status = space_of_used(b, &used, &other, err);
    if (status == SPC_OK && other) {
        release_buckets(b);
        b->space = used;
        memcpy(b->vertices.min, b->stats.survey.file_min, sizeof b->vertices.min);
        memcpy(b->vertices.max, b->stats.survey.file_max, sizeof b->vertices.max);
        status = distribute_faces(b, err);
    }
    if (status != SPC_OK)
        return status;
    keep_remarks(b);
    const uint64_t dropped = b->stats.bad_index + b->stats.non_finite + b->stats.degenerate;
    if (b->stats.kept == 0)
        return spc_fail(err, SPC_INPUT_EMPTY, SPC_NO_OFF, "it holds no usable triangle (%llu dropped)",
                        (unsigned long long)dropped);
    if (b->options->strict && dropped > 0)
        return spc_fail(err, SPC_INPUT_BAD, SPC_NO_OFF,
                        "%llu faces cannot be used: %llu with a bad index, %llu with a non-finite "
                        "vertex, %llu with fewer than 3 distinct corners",
                        (unsigned long long)dropped, (unsigned long long)b->stats.bad_index,
                        (unsigned long long)b->stats.non_finite,
                        (unsigned long long)b->stats.degenerate);
    judge_precision(b);
    if (spb_source_info(b->source)->archive)
        spb_space_use_lattice(&b->space, spb_source_info(b->source)->lattice_exp);
    else
        spb_space_set_vertices(&b->space, spb_survey_short_edge(&b->stats.survey));
    spb_vertices_release(&b->vertices);
    spb_corner_sort_free(b->corners);
    b->corners = NULL;
    return SPC_OK;
}

/* ---- building ---------------------------------------------------------------------------------- */

static uint32_t archive_flags(const struct build *b, bool colors)
{
    uint32_t flags = 0;
    if (b->options->triangles && !b->points)
        flags |= SPC_FLAG_TRIANGLES;
    if (colors)
        flags |= SPC_FLAG_COLORS;
    if (b->options->paper_error)
        flags |= SPC_FLAG_ERROR_PAPER;
    if (b->options->cull == SPB_CULL_BACK ||
        (b->options->cull == SPB_CULL_AUTO && b->report->closed))
        flags |= SPC_FLAG_CULL_BACK;
    return flags;
}

static enum spc_status build_part(void *ctx, size_t i, struct spc_error *err)
{
    struct build *b = ctx;
    return spb_top_part(&b->top, (uint32_t)i, err);
}

static int part_done(void *ctx, size_t done)
{
    const struct build *b = ctx;
    return spb_progress_tell(&b->progress, b->points ? "build parts of points" : "build parts", done,
                             b->plan.part_count);
}

/* Groups by normal serve back-face culling alone; elsewhere they would only cost bytes. */
static uint32_t normal_clusters(const struct build *b, uint32_t flags)
{
    if (b->options->normal_clusters > 0)
        return b->options->normal_clusters;
    return flags & SPC_FLAG_CULL_BACK ? SPC_NORMAL_CLUSTERS_MAX : 1;
}

static enum spc_status estimate_points(struct build *b, const struct spb_record_format *format,
                                       struct spc_error *err)
{
    const struct spb_points_input in = {b->faces_file, &b->space, *format,
                                        spb_source_info(b->source)->normals, b->budget.threads,
                                        &b->progress};
    charge(b, SPB_PLAN);
    const enum spc_status status = spb_points_estimate(&b->plan, &in, &b->stats.survey, err);
    charge(b, SPB_ESTIMATE_POINTS);
    if (status != SPC_OK)
        return status;
    judge_precision(b);
    if (memcmp(b->stats.survey.file_min, b->stats.survey.file_max, sizeof b->stats.survey.file_min) == 0)
        b->report->short_edge = 0;  /* one place: its disks are made up */
    spb_space_set_vertices(&b->space, spb_survey_short_edge(&b->stats.survey));
    return SPC_OK;
}

/* Where faces are too small for the lattice. Vertices of archives lie on theirs and stay. */
static enum spc_status find_detail(struct build *b, const struct spb_record_format *format,
                                   struct spc_error *err)
{
    const double size = b->options->detail;
    const struct spb_detail_input in = {
        .plan = &b->plan, .file = b->faces_file, .format = *format, .survey = &b->stats.survey,
        .size = size < 0 ? SPB_DETAIL_AUTO : ldexp(size, -b->space.unit_exp),
        .threads = b->budget.threads, .progress = &b->progress,
    };
    return spb_source_info(b->source)->archive ? SPC_OK
                                               : spb_detail_find(&in, &b->space, &b->cells, err);
}

static enum spc_status plan_parts(struct build *b, struct spc_error *err)
{
    const struct spb_record_format format = b->distributor.format;
    const struct spb_build_options *o = b->options;
    b->report->closed = b->stats.edge_sum == 0 && b->stats.survey.volume > 0;
    const uint32_t flags = archive_flags(b, format.colors);
    const struct spb_pack_options pack = {
        .cluster_nodes = o->cluster_nodes, .block_nodes = o->block_nodes,
        .normal_clusters = normal_clusters(b, flags), .flags = flags, .codec = o->codec,
        .level = o->level,
    };
    b->report->header.flags = pack.flags;
    enum spc_status status =
        spb_plan_make(&b->plan, &b->distributor, b->faces_file, &b->space, b->budget.part_faces,
                      b->budget.buffers, &b->progress, err);
    if (status == SPC_OK && b->points)
        status = estimate_points(b, &format, err);
    if (status == SPC_OK)
        status = find_detail(b, &format, err);
    if (status == SPC_OK)
        status = spb_tmpfile_create(&b->temp, &b->spool_file, err);
    if (status == SPC_OK)
        status = spb_spool_create(b->spool_file, &b->spool, err);
    if (status == SPC_OK)
        status = spb_pack_shared_init(&b->shared, &pack, &b->space, b->spool, &format, err);
    if (status != SPC_OK)
        return status;
    b->report->parts = b->plan.part_count;
    return spb_top_init(&b->top, &b->plan, b->faces_file, &b->shared, b->budget.waiting,
                        b->budget.joins, b->budget.threads, err);
}

static enum spc_status build_tree(struct build *b, struct spc_error *err)
{
    enum spc_status status =
        spb_pool_run(b->plan.part_count, b->budget.threads, build_part, part_done, b, err);
    if (status == SPC_OK)
        status = spb_top_finish(&b->top, &b->root, &b->height, err);
    return status;
}

/* ---- writing ----------------------------------------------------------------------------------- */

/*
 * Snapping to one lattice keeps order: the box of the snapped vertices is the snapped box. In cells it may not.
 * corners: as of spb_spool_shapes.
 */
static void fill_box(const struct build *b, const double corners[2][3], struct spc_header *h)
{
    const bool as_found = b->space.cells != NULL && !b->points;
    for (int a = 0; a < 3; a++) {
        const double *ends[2] = {b->stats.survey.file_min, b->stats.survey.file_max};
        double *out[2] = {h->box_min, h->box_max};
        for (int e = 0; e < 2; e++)
            out[e][a] = ldexp((as_found ? corners[e][a]
                                        : spb_space_snap(&b->space, spb_space_from_file(&b->space, a, ends[e][a]))) +
                                  (double)spb_space_origin_number(&b->space, a),
                              b->space.vertex_exp);
    }
}

static void fill_header(struct build *b, struct spc_header *h)
{
    const struct spb_face_stats *s = &b->stats;
    struct spb_shapes *shapes = &b->report->shapes;
    double corners[2][3];
    spb_spool_count(b->spool, h);
    spb_spool_shapes(b->spool, shapes, corners[0], corners[1]);
    shapes->least = ldexp(shapes->least, b->space.unit_exp);
    shapes->most = ldexp(shapes->most, b->space.unit_exp);
    b->report->coarse_exp = b->space.coarse_exp;
    b->report->detail_least = ldexp(1, spb_space_limit(&b->space) + SPB_DETAIL_STEPS_LOG2);
    fill_box(b, (const double(*)[3])corners, h);
    h->triangle_count = h->flags & SPC_FLAG_TRIANGLES ? h->leaf_count : 0;
    h->cluster_nodes = b->options->cluster_nodes;
    h->block_nodes = b->options->block_nodes;
    h->normal_clusters = b->shared.options.normal_clusters;
    h->height = b->height;
    h->unit_exp = b->space.unit_exp;
    h->vertex_exp = b->space.vertex_exp;
    h->faces_in = s->faces_in;
    h->points_in = b->points ? b->report->vertices : 0;
    h->split_extra = s->split_extra;
    h->dropped_bad_index = s->bad_index;
    h->dropped_non_finite = s->non_finite;
    h->dropped_degenerate = s->degenerate;
}

static enum spc_status write_archive(struct build *b, struct spc_error *err)
{
    struct spc_header *h = &b->report->header;
    fill_header(b, h);
    if (h->faces_in + h->split_extra + h->points_in !=
            h->leaf_count + h->dropped_bad_index + h->dropped_non_finite + h->dropped_degenerate ||
        h->leaf_count != b->stats.kept)
        return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "the counts of faces and leaves do not add up");
    if (b->options->strict && b->report->shapes.moved > 0) {
        b->in_scan = true;
        return spc_fail(err, SPC_INPUT_BAD, SPC_NO_OFF,
                        "%llu %s of %.2g to %.2g across would lose their shape",
                        (unsigned long long)b->report->shapes.moved, b->points ? "points" : "triangles",
                        b->report->shapes.least, b->report->shapes.most);
    }
    char *meta = b->options->meta
        ? b->options->meta(b->options->meta_ctx, h)
        : strdup("{}");
    if (meta == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for the metadata");
    enum spc_status status = spc_writer_begin(b->writer, h, strlen(meta), err);
    if (status == SPC_OK)
        status = spb_spool_write(b->spool, b->root, b->writer, &b->progress, err);
    if (status == SPC_OK)
        status = spc_writer_seal(b->writer, h, meta, err);
    if (status == SPC_OK && spb_progress_tell(&b->progress, "write archive", 1, 1))
        status = spc_fail(err, SPC_CANCELLED, SPC_NO_OFF, "cancelled");     /* the last moment */
    if (status == SPC_OK)
        status = spc_writer_finish(b->writer, err);
    free(meta);
    return status;
}

/* Folder of the output: temporary files lie beside it, on the same disk. */
static char *folder_of(const char *path)
{
    const char *slash = strrchr(path, '/');
    if (slash == NULL)
        return strdup(".");
    return slash == path ? strdup("/") : strndup(path, (size_t)(slash - path));
}

/* force replaces an archive, by a rename: never a scan, nor a device or pipe such as /dev/null. */
static enum spc_status check_target(const struct build *b, struct spc_error *err)
{
    const struct spb_build_options *o = b->options;
    struct stat target;
    if (stat(o->out, &target) != 0 || S_ISDIR(target.st_mode))
        return SPC_OK;              /* the writer tells */
    if (!S_ISREG(target.st_mode))
        return spc_fail(err, SPC_IO, SPC_NO_OFF, "the target is a device or pipe, no plain file");
    for (uint32_t i = 0; i < b->scan_count; i++)
        if (spb_source_is_file(b->scans[i], &target))
            return spc_fail(err, SPC_IO, SPC_NO_OFF, "the target is the %s itself",
                            o->salvage ? "archive" : "scan");
    return SPC_OK;
}

static void release(struct build *b)
{
    spb_top_release(&b->top);
    release_buckets(b);
    spb_plan_release(&b->plan);
    spb_pack_shared_release(&b->shared);
    spb_spool_free(b->spool);
    spb_tmpfile_free(b->spool_file);
    spb_vertices_release(&b->vertices);
    spb_corner_sort_free(b->corners);
    close_source(b);
    spc_writer_close(b->writer);
    free(b->cells);
}

static enum spc_status prepare(struct build *b, struct spc_error *err)
{
    char *out = folder_of(b->options->out);
    enum spc_status status = open_source(b, err);
    if (status == SPC_OK) {         /* before the long work: a target that cannot be written */
        b->in_scan = false;
        status = make_budget(b, err);
        if (status == SPC_OK)
            status = check_target(b, err);
        if (status == SPC_OK)
            status = spc_writer_create(b->options->out, b->options->force, &b->writer, err);
        if (status == SPC_OK)
            status = check_space(b->temp.folder, b->budget.temp, "temporary data", err);
        if (status == SPC_OK && out != NULL)
            status = check_space(out, b->budget.output, "the archive", err);
        b->in_scan = status == SPC_OK;
    }
    free(out);
    return status;
}

static enum spc_status run_phases(struct build *b, struct spc_error *err)
{
    static enum spc_status (*const phase[SPB_PHASE_COUNT])(struct build *, struct spc_error *) = {
        prepare, read_vertices, NULL, read_faces, plan_parts, NULL, build_tree, write_archive,
    };
    enum spc_status status = SPC_OK;
    b->charged = cost_now(b);
    for (int p = 0; p < SPB_PHASE_COUNT && status == SPC_OK; p++) {
        if (phase[p] == NULL)       /* part of the one before or after, where it is needed */
            continue;
        b->in_scan = p <= SPB_READ_FACES;
        status = phase[p](b, err);
        charge(b, (enum spb_phase)p);
    }
    b->report->temp_written = atomic_load(&b->temp.written);
    b->report->temp_read = atomic_load(&b->temp.read);
    return status;
}

enum spc_status spb_build(const struct spb_build_options *options, struct spb_build_report *report,
                          const char **file, struct spc_error *err)
{
    struct build b = {.options = options, .report = report, .progress = options->progress};
    *report = (struct spb_build_report){0};
    char *temp = options->temp ? strdup(options->temp) : folder_of(options->out);
    enum spc_status status = SPC_OK;
    if (temp == NULL)
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to start");
    b.temp.folder = temp;
    if (status == SPC_OK)
        status = run_phases(&b, err);
    if (file != NULL)
        *file = file_at_fault(&b);
    release(&b);
    free(temp);
    return status;
}
