#include "bench_trade.h"

#include "meta.h"
#include "whole_file.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const struct {
    const char *name;
    int digits;
} COLUMNS[BENCH_COLUMNS] = {
#define X(id, name, digits) {name, digits},
    BENCH_COLUMN_LIST(X)
#undef X
};

/* ---- the folder --------------------------------------------------------------------------------- */

static const char *const FILES[] = {"trade.csv", "trade.json", "plots.gp"};
enum { FILE_COUNT = sizeof FILES / sizeof *FILES };

/* To be freed; NULL without memory. */
static char *in_folder(const struct bench_options *o, const char *name)
{
    const size_t n = strlen(o->out) + strlen(name) + 2;
    char *path = malloc(n);
    if (path != NULL)
        snprintf(path, n, "%s/%s", o->out, name);
    return path;
}

static int fault(const char *file, enum spc_status status, int os_errno, const char *what, const char *remedy)
{
    struct spc_error err = {0};
    if (os_errno != 0)
        spc_fail_os(&err, os_errno, "%s", what);
    else
        spc_fail(&err, status, SPC_NO_OFF, "%s", what);
    cli_error(file, &err, remedy != NULL ? remedy : cli_disk_remedy(&err, "room is needed there"));
    return EXIT_FAILED;
}

int bench_report_begin(const struct bench_options *o, bool *made)
{
    struct stat st;
    *made = mkdir(o->out, 0777) == 0;
    if (!*made && errno != EEXIST)
        return fault(o->out, SPC_IO, errno, "cannot make the folder", NULL);
    if (stat(o->out, &st) != 0 || !S_ISDIR(st.st_mode))
        return fault(o->out, SPC_IO, 0, "is no folder", "--out takes one, or the name of a new one");
    for (size_t i = 0; i < FILE_COUNT && !o->force; i++) {
        char *path = in_folder(o, FILES[i]);
        if (path == NULL)
            return fault(o->out, SPC_NO_MEMORY, 0, "no memory for a name", NULL);
        const bool there = lstat(path, &st) == 0;
        free(path);
        if (there)
            return fault(o->out, SPC_EXISTS, 0, "holds a trade already", "--force writes over it");
    }
    return EXIT_DONE;
}

void bench_report_undo(const struct bench_options *o)
{
    for (size_t i = 0; i < FILE_COUNT; i++) {
        char *path = in_folder(o, FILES[i]);
        if (path != NULL)
            (void)unlink(path);     /* some were written before another failed */
        free(path);
    }
    (void)rmdir(o->out);            /* not when there is something else in it */
}

/* Writes a file of the folder by fn. Returns the exit code, a fault is told. */
static int write_file(const struct bench_result *r, const char *name,
                      void (*fn)(const struct bench_result *r, FILE *out))
{
    struct spc_error err = {0};
    struct spv_whole_file file;
    char *path = in_folder(r->options, name);
    if (path == NULL)
        return fault(r->options->out, SPC_NO_MEMORY, 0, "no memory for a name", NULL);
    enum spc_status status = spv_whole_begin(&file, path, "it", &err);
    if (status == SPC_OK) {
        fn(r, file.out);
        status = spv_whole_end(&file, SPC_OK, "it", &err);
    }
    if (status != SPC_OK)
        cli_error(path, &err, cli_disk_remedy(&err, "room is needed there"));
    free(path);
    return status == SPC_OK ? EXIT_DONE : EXIT_FAILED;
}

/* ---- CSV ---------------------------------------------------------------------------------------- */

static void put_csv(const struct bench_result *r, FILE *out)
{
    fputs("view,mode,eps_px", out);
    for (size_t i = 0; i < BENCH_COLUMNS; i++)
        fprintf(out, ",%s", COLUMNS[i].name);
    fputc('\n', out);
    for (size_t k = 0; k < r->row_count; k++) {
        const struct bench_row *row = &r->rows[k];
        fprintf(out, "%s,%s,%g", r->views[row->view].name, BENCH_KIND_NAMES[row->kind], row->eps_px);
        for (size_t i = 0; i < BENCH_COLUMNS; i++)
            if (isnan(row->value[i]))
                fputc(',', out);
            else
                fprintf(out, ",%.*f", COLUMNS[i].digits, row->value[i]);
        fputc('\n', out);
    }
}

/* ---- JSON --------------------------------------------------------------------------------------- */

static json_t *number(double v)
{
    if (!isfinite(v))
        return json_null();
    return v == floor(v) && fabs(v) < 0x1p53 ? json_integer((json_int_t)v) : json_real(v);
}

static json_t *views_json(const struct bench_result *r)
{
    json_t *out = json_array();
    for (uint32_t v = 0; v < r->view_count; v++) {
        const struct ref_camera *c = &r->views[v].reference;
        json_array_append_new(out, json_pack("{s:s, s:[f, f, f], s:[f, f, f], s:[f, f, f], s:f}", "name",
                                             r->views[v].name, "eye", c->eye[0], c->eye[1], c->eye[2], "target",
                                             c->target[0], c->target[1], c->target[2], "up", c->up[0], c->up[1],
                                             c->up[2], "fov_deg", c->fov_y_deg));
    }
    return out;
}

static json_t *rows_json(const struct bench_result *r)
{
    json_t *out = json_array();
    for (size_t k = 0; k < r->row_count; k++) {
        const struct bench_row *row = &r->rows[k];
        json_t *one = json_pack("{s:s, s:s, s:f}", "view", r->views[row->view].name, "mode",
                                BENCH_KIND_NAMES[row->kind], "eps_px", row->eps_px);
        for (size_t i = 0; i < BENCH_COLUMNS; i++)
            json_object_set_new(one, COLUMNS[i].name, number(row->value[i]));
        json_array_append_new(out, one);
    }
    return out;
}

static json_t *recommendation(const struct bench_result *r)
{
    struct bench_choice c;
    bench_recommend(r, &c);
    json_t *out = json_pack("{s:b, s:s}", "met", c.met, "text", c.text);
    json_object_set_new(out, "eps_px", number(c.eps_px));
    if (!isnan(c.eps_px))
        json_object_set_new(out, "mode", json_string(BENCH_KIND_NAMES[c.kind]));
    return out;
}

static json_t *reference_json(const struct bench_result *r)
{
    json_t *out = json_array();
    for (uint32_t i = 0; i < r->options->scan_count; i++) {
        const char *slash = strrchr(r->options->scans[i], '/');
        json_array_append_new(out, meta_name(slash != NULL ? slash + 1 : r->options->scans[i]));
    }
    return out;
}

static char *json_of(const struct bench_result *r)
{
    static const char definitions[] =
        "psnr_db: RGB, pixels covered in either picture. ssim: luminance, windows of 8x8 every 4 pixels, half of them "
        "covered in either picture. shade_*, off_pixels (by more than 5): luminance of 255, pixels covered wholly in "
        "both. overlap: covered pixels, in both / in either. hole_pixels: covered in the reference with their 3x3 "
        "neighbourhood, empty here. exact_elements: nodes and triangles that are drawn and touch the picture. "
        "error_px_*: points of the surface to the disks drawn for them, as an angle in pixels of eps. doubles_share: "
        "sampled leaves of which more than one ancestor is drawn. one-cluster, traversal: counted, not drawn.";
    const struct spc_header *h = spc_reader_header(r->reader);
    const struct bench_options *o = r->options;
    json_t *out = json_pack(
        "{s:s, s:{s:I, s:I, s:I, s:I, s:s}, s:s, s:o, s:s, s:i, s:i, s:i, s:i, s:i, s:s, s:o, s:o}", "tool",
        "spc-bench " SPC_TOOL_VERSION, "archive", "file_bytes", (json_int_t)h->file_bytes, "nodes",
        (json_int_t)h->node_count, "leaves", (json_int_t)h->leaf_count, "clusters", (json_int_t)h->cluster_count,
        "error", h->flags & SPC_FLAG_ERROR_PAPER ? "paper" : "bound", "reference", r->own ? "archive" : "scan",
        "scans", reference_json(r), "renderer", r->renderer, "width", o->picture.width, "height", o->picture.height,
        "repeat", (int)o->repeat, "samples", (int)(o->samples * o->samples),
        "reference_samples", BENCH_SAMPLES * BENCH_SAMPLES, "definitions", definitions,
        "views", views_json(r), "rows", rows_json(r));
    if (o->recommend)
        json_object_set_new(out, "recommend", recommendation(r));
    return meta_text(out, JSON_INDENT(2) | JSON_REAL_PRECISION(9));
}

static void put_json(const struct bench_result *r, FILE *out)
{
    fprintf(out, "%s\n", r->json);
}

/* ---- means over views --------------------------------------------------------------------------- */

struct bench_mean bench_mean_of(const struct bench_result *r, enum bench_kind kind, double eps_px)
{
    struct bench_mean m = {0};
    for (size_t i = 0; i < BENCH_COLUMNS; i++) {
        m.mean[i] = m.min[i] = m.max[i] = NAN;
        m.sum[i] = 0;
    }
    for (size_t k = 0; k < r->row_count; k++) {
        const struct bench_row *row = &r->rows[k];
        if (row->kind != kind || row->eps_px != eps_px)
            continue;
        m.views++;
        for (size_t i = 0; i < BENCH_COLUMNS; i++) {
            m.sum[i] += row->value[i];
            m.min[i] = fmin(m.min[i], row->value[i]);
            m.max[i] = fmax(m.max[i], row->value[i]);
        }
    }
    for (size_t i = 0; i < BENCH_COLUMNS && m.views > 0; i++)
        m.mean[i] = m.sum[i] / m.views;
    return m;
}

/* ---- table -------------------------------------------------------------------------------------- */

/* A figure in width columns with as many digits as fit, '-' where there is none. */
static void cell(FILE *out, double v, int width, int digits)
{
    char text[400];                 /* any double with three digits */
    for (int d = digits; d >= 0; d--)
        if (snprintf(text, sizeof text, "%.*f", d, v) <= width)
            break;
    if (strlen(text) > (size_t)width)
        snprintf(text, sizeof text, "%.0e", v);
    fprintf(out, " %*s", width, isnan(v) ? "-" : text);
}

/* Thousands of a count, with all its digits where it is small. */
static void count_cell(FILE *out, double v, int width)
{
    cell(out, v / 1e3, width, v < 1e4 ? 3 : 1);
}

/* Over all views together: where hardly anything is in the picture, the ratio of one says little. */
static double ratio_of(const struct bench_result *r, enum bench_kind kind, double eps)
{
    double processed = 0, exact = 0;
    for (size_t k = 0; k < r->row_count; k++)
        if (r->rows[k].kind == kind && r->rows[k].eps_px == eps) {
            processed += r->rows[k].value[BENCH_NODES_PROCESSED];
            exact += r->rows[k].value[BENCH_EXACT];
        }
    return exact > 0 ? processed / exact : NAN;
}

static void put_line(const struct bench_result *r, enum bench_kind kind, double eps, FILE *out)
{
    const struct bench_mean m = bench_mean_of(r, kind, eps);
    char text[CLI_TEXT];
    for (int digits = 6; digits > 0 && snprintf(text, sizeof text, "%.*g", digits, eps) > 5; digits--)
        ;
    fprintf(out, "%-13s %5s", BENCH_KIND_NAMES[kind], bench_is_constant(kind) ? "any" : text);
    count_cell(out, m.mean[BENCH_NODES_PROCESSED], 7);
    count_cell(out, m.mean[BENCH_NODES_DRAWN] + m.mean[BENCH_TRIANGLES_DRAWN], 7);
    cell(out, ratio_of(r, kind, eps), 5, 1);
    cell(out, m.mean[BENCH_BYTES] / (1024 * 1024), 5, 2);
    cell(out, m.mean[BENCH_FRAME_MS], 5, 1);
    cell(out, m.max[BENCH_FRAME_MS], 5, 1);
    cell(out, m.min[BENCH_PSNR], 4, 1);
    cell(out, m.min[BENCH_SSIM], 5, 3);
    cell(out, m.sum[BENCH_HOLES], 4, 0);
    cell(out, m.max[BENCH_ERROR_MAX], 4, 2);
    fputc('\n', out);
}

static uint32_t lines_of(const struct bench_result *r, enum bench_kind kind)
{
    return bench_is_constant(kind) ? 1 : r->options->eps_count;
}

static void put_table(const struct bench_result *r, FILE *out)
{
    fprintf(out, "%u view%s of %d x %d, compared with %s\ndrawn by %s\n", r->view_count, r->view_count == 1 ? "" : "s",
            r->options->picture.width, r->options->picture.height, r->own ? "the archive's own triangles" : "the scan",
            r->renderer);
    fputs("mean over views; * the worst view (holes: of all)\n\n", out);
    static const char heads[] = "%-13s %5s %7s %7s %5s %5s %5s %5s %4s %5s %4s %4s\n";
    fprintf(out, heads, "mode", "eps", "nodes", "drawn", "to", "MB", "ms", "*ms", "*dB", "*SSIM", "hole", "*off");
    fprintf(out, heads, "", "px", "k", "k", "exact", "", "frame", "frame", "PSNR", "", "px", "px");
    for (int kind = 0; kind < BENCH_KINDS; kind++)
        for (uint32_t e = 0; r->options->kinds[kind] && e < lines_of(r, (enum bench_kind)kind); e++)
            put_line(r, (enum bench_kind)kind, r->options->eps_px[e], out);
}

/* ---- all of it ---------------------------------------------------------------------------------- */

static int write_all(const struct bench_result *r)
{
    int code = write_file(r, "trade.csv", put_csv);
    if (code == EXIT_DONE)
        code = write_file(r, "trade.json", put_json);
    if (code == EXIT_DONE)
        code = write_file(r, "plots.gp", bench_plots_write);
    return code == EXIT_DONE ? bench_plots_draw(r->options->out) : code;
}

int bench_report(struct bench_result *r)
{
    struct bench_choice choice;
    int code = EXIT_DONE;
    r->json = json_of(r);
    if (r->json == NULL)
        return fault(r->options->archive, SPC_NO_MEMORY, 0, "no memory for the report", NULL);
    if (r->options->out != NULL)
        code = write_all(r);
    bench_recommend(r, &choice);
    if (r->options->json)
        puts(r->json);
    else if (r->options->recommend)
        puts(choice.text);
    else
        put_table(r, stdout);
    free(r->json);
    r->json = NULL;
    return code;
}
