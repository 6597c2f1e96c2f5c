/*
 * bench_trade.h - the trade of speed for accuracy of one archive: what spc-bench measures and how it tells.
 *
 *   paths      leaves with what is above them       views      where from
 *   reference  all triangles, drawn another way     metrics    how far a picture is from that
 *   cut        what a frame had to process          rows       all of it, a row a view, accuracy and mode
 *   report     table, CSV, JSON, plots              recommend  which eps to take
 */
#ifndef BENCH_TRADE_H
#define BENCH_TRADE_H

#include "bench_cut.h"
#include "bench_metrics.h"
#include "bench_paths.h"
#include "bench_views.h"

#include <jansson.h>

enum { BENCH_SCANS_MAX = 64, BENCH_REPEAT_MAX = 1000 };

enum bench_kind {                   /* of rows: modes first, in the order of enum spv_mode, then baselines */
    BENCH_HYBRID, BENCH_POINTS, BENCH_TRIANGLES,
    BENCH_ONE_CLUSTER, BENCH_TRAVERSAL, BENCH_ALL_TRIANGLES, BENCH_ALL_POINTS,
    BENCH_KINDS,
    BENCH_MODES = BENCH_ONE_CLUSTER
};
extern const char *const BENCH_KIND_NAMES[BENCH_KINDS];

/* What accuracy does not change is measured once, and listed under each. */
static inline bool bench_is_constant(enum bench_kind kind)
{
    return kind == BENCH_TRIANGLES || kind == BENCH_ALL_TRIANGLES || kind == BENCH_ALL_POINTS;
}

struct bench_options {
    const char *archive, *out;      /* out may be NULL when all that is asked for is what to take */
    const char *scans[BENCH_SCANS_MAX];
    uint32_t scan_count;            /* 0: the archive's own triangles are the reference */
    struct picture_options picture;
    double eps_px[BENCH_EPS_MAX];   /* ascending */
    uint32_t eps_count;
    bool kinds[BENCH_KINDS], views[BENCH_VIEWS];
    uint32_t repeat;
    uint32_t samples;               /* of our pictures, a pixel and axis */
    bool force, json, recommend;
    double fps, error_px, shade;    /* what is asked for; 0: nothing */
    enum cli_progress_mode progress;
};

/* ---- rows --------------------------------------------------------------------------------------- */

/* What is measured: name in files, digits there. Not measured, or without meaning: NAN. */
#define BENCH_COLUMN_LIST(X)                                                                        \
    X(NODES_PROCESSED, "nodes_processed", 0)        /* in the chosen blocks */                      \
    X(NODES_TESTED, "nodes_tested", 0)              /* by what draws: without what is hidden */     \
    X(NODES_DRAWN, "nodes_drawn", 0)                                                                \
    X(TRIANGLES_DRAWN, "triangles_drawn", 0)                                                        \
    X(BYTES, "bytes", 0)                                                                            \
    X(EXACT, "exact_elements", 0)                   /* nodes and triangles of the exact cut */      \
    X(EXACT_BYTES, "exact_bytes", 0)                                                                \
    X(PROCESSED_RATIO, "processed_ratio", 3)        /* nodes_processed / exact_elements */          \
    X(BYTES_RATIO, "bytes_ratio", 3)                                                                \
    X(FRAME_MS, "frame_ms", 3)                      /* median */                                    \
    X(FRAME_MS_MIN, "frame_ms_min", 3)                                                              \
    X(FRAME_MS_MAX, "frame_ms_max", 3)                                                              \
    X(RESIDENT, "resident", 0)                      /* 0: blocks were decoded in each frame */      \
    X(PSNR, "psnr_db", 2)                                                                           \
    X(SSIM, "ssim", 5)                                                                              \
    X(SHADE_MEAN, "shade_mean", 3)                                                                  \
    X(SHADE_MAX, "shade_max", 1)                                                                    \
    X(OVERLAP, "overlap", 6)                                                                        \
    X(OVERLAP_TOLERANT, "overlap_tolerant", 6)                                                      \
    X(COVERED, "covered_pixels", 0)                                                                 \
    X(HOLES, "hole_pixels", 0)                                                                      \
    X(OFF, "off_pixels", 0)                                                                         \
    X(ERROR_MEAN, "error_px_mean", 4)                                                               \
    X(ERROR_P999, "error_px_p999", 4)                                                               \
    X(ERROR_MAX, "error_px_max", 4)                                                                 \
    X(ERROR_POINTS, "error_points", 0)                                                              \
    X(DOUBLES, "doubles_share", 6)
enum bench_column {
#define X(id, name, digits) BENCH_##id,
    BENCH_COLUMN_LIST(X)
#undef X
    BENCH_COLUMNS
};

struct bench_row {
    uint32_t view;                  /* in bench_result.views */
    enum bench_kind kind;
    double eps_px;                  /* of triangles and all-*: what they are listed under, they have none */
    double value[BENCH_COLUMNS];
};

struct bench_result {
    const struct bench_options *options;
    const struct spc_reader *reader;
    struct bench_view views[BENCH_VIEWS];
    uint32_t view_count;
    struct bench_row *rows;
    size_t row_count;
    const char *renderer;
    bool own;                       /* the reference is the archive's own triangles */
    char *json;                     /* the report as text, while it is being written */
};

/* ---- parts -------------------------------------------------------------------------------------- */

/* How far the work is. fails  SPC_CANCELLED */
enum spc_status bench_tell(const char *phase, uint64_t done, uint64_t total, struct spc_error *err);

/* Colour of empty pixels, in both pictures. */
extern const uint8_t BENCH_BACKGROUND[3];

/*
 * All triangles of the scans in the views, as many views at once as memory goes, as truths[count]; release all of
 * them in any case. *file: what an error is about.
 *
 * fails  as spb_source_open and spb_vertices_read; SPC_INPUT_BAD: it is not what the archive was built from;
 *        SPC_INPUT_EMPTY: no faces; SPC_CANCELLED
 */
enum spc_status bench_reference(const struct bench_options *o, const struct spc_reader *reader,
                                const struct bench_view *views, uint32_t count, struct bench_truth *truths,
                                const char **file, struct spc_error *err);

/* Measures all rows and reports. Returns the exit code; errors are told. */
int bench_run(const struct bench_options *options);

/* The folder of the output: makes it, refuses one that holds a trade without force. Returns EXIT_DONE, or tells. */
int bench_report_begin(const struct bench_options *o, bool *made);

/* Removes the folder that was made, after a failure. */
void bench_report_undo(const struct bench_options *o);

/* Table, files, plots; recommendation. */
int bench_report(struct bench_result *r);

/* Of the rows of one kind and accuracy, all views. */
struct bench_mean {
    uint32_t views;
    double mean[BENCH_COLUMNS], sum[BENCH_COLUMNS];             /* NAN where a view has none */
    double min[BENCH_COLUMNS], max[BENCH_COLUMNS];              /* of those that have some */
};
struct bench_mean bench_mean_of(const struct bench_result *r, enum bench_kind kind, double eps_px);

/* The script of gnuplot, and gnuplot on it; where there is none, that is told. Returns EXIT_DONE. */
void bench_plots_write(const struct bench_result *r, FILE *out);
int bench_plots_draw(const char *folder);

struct bench_choice {
    bool met;                       /* else eps_px is what comes nearest; NAN: nothing was measured */
    enum bench_kind kind;
    double eps_px;
    char text[480];                 /* one line for people */
};

/*
 * Which accuracy to take, judged by the view in which it does worst: of those that keep all that is asked for the
 * smallest where a speed is asked for, else the largest.
 *
 *   fps    the median frame takes at most 1 / fps
 *   error  no point of the surface is drawn further off than so many pixels, and there is no hole pixel
 *   shade  the mean error of shades is at most so many levels of 255
 */
void bench_recommend(const struct bench_result *r, struct bench_choice *out);

#endif
