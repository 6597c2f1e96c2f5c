#include "build_run.h"

#include "build_report.h"
#include "build_scans.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* Of the time, about: ten to a hundred million triangles, binary PLY. */
static const struct cli_share SHARES[] = {
    {"copy pipe", 0, 0}, {"count", 0, 0.05}, {"read vertices", 0.05, 0.02}, {"sort corners", 0.07, 0.03},
    {"answer corners", 0.1, 0.05}, {"read faces", 0.15, 0.1}, {"read points", 0.15, 0.1},
    {"plan parts", 0.25, 0.02}, {"measure detail", 0.27, 0}, {"build parts", 0.27, 0.72},
    {"estimate points", 0.27, 0.45}, {"build parts of points", 0.72, 0.27}, {"write archive", 0.99, 0.01}, {NULL, 0, 0},
};

/* ---- one archive --------------------------------------------------------------------------------- */

/* An archive built anew stays where it was, and what its scan lost before does not come back. */
static void take_from_archive(const char *archive, struct meta_coordinates *c, json_t **coding)
{
    struct spc_reader *reader = NULL;
    struct meta_coordinates old;
    size_t bytes = 0;
    if (spc_reader_open(archive, &reader, NULL) != SPC_OK)
        return;
    const char *text = spc_reader_meta(reader, &bytes);
    json_t *meta = json_loadb(text, bytes, 0, NULL);
    meta_read_coordinates(meta, &old);
    meta_default_coordinates(c, &old);
    if (*coding == NULL)
        *coding = json_incref(json_object_get(meta, "coding"));
    json_decref(meta);
    spc_reader_close(reader);
}

static char *make_meta(void *ctx, const struct spc_header *header)
{
    struct build_run *a = ctx;
    const struct spb_build_options *b = &a->build;
    struct meta_coordinates c = a->coordinates;
    json_t *coding = meta_coding_json(a->report);
    if (strcmp(b->facts[0].format, "spc") == 0)
        take_from_archive(b->scan, &c, &coding);
    json_t *meta = meta_new("spc-build", b, header, &c, meta_sources(b));
    if (coding != NULL)
        json_object_set_new(meta, "coding", coding);
    return meta_text(meta, JSON_COMPACT);
}

/* Tells an error; what is in fault, and how it can be helped. Keeps it in *err. */
static enum spc_status build_archive(struct build_run *a, struct build_result *r,
                                     struct spc_error *err)
{
    const char *file = NULL;
    const double began = cli_seconds(), cpu_before = usage_cpu_seconds();
    *r = (struct build_result){.options = &a->build, .facts = a->build.facts};
    memset(a->build.facts, 0, (1 + (size_t)a->build.more_count) * sizeof *a->build.facts);
    a->report = &r->report;
    const enum spc_status status = spb_build(&a->build, &r->report, &file, err);
    cli_progress_result(err);
    if (status != SPC_OK) {
        cli_error(file, err, build_remedy(r, err, file != a->build.out));
        return status;
    }
    r->usage = usage_since(began, cpu_before);
    build_warn(r);
    return SPC_OK;
}

static int fail_plain(const char *file, enum spc_status status, const char *what)
{
    struct spc_error err = {0};
    spc_fail(&err, status, SPC_NO_OFF, "%s", what);
    cli_error(file, &err, NULL);
    return EXIT_FAILED;
}

/* The end of a run with --json. */
static int print_json(const char *of, json_t *out)
{
    char *text = meta_text(out, JSON_INDENT(2));
    if (text == NULL)
        return fail_plain(of, SPC_NO_MEMORY, "the archive is complete, but no memory for the summary");
    puts(text);
    free(text);
    return EXIT_DONE;
}

static int build_one(struct build_run *a, const struct build_scans *scans)
{
    struct build_result r;
    struct spc_error err = {0};
    a->build.scan = scans->path[0];
    a->build.more = (const char *const *)scans->path + 1;
    a->build.more_count = (uint32_t)scans->count - 1;
    a->build.facts = calloc(scans->count, sizeof *a->build.facts);
    if (a->build.facts == NULL)
        return fail_plain(a->build.scan, SPC_NO_MEMORY, "no memory for the list of scans");
    cli_progress_begin(a->progress, a->build.scan, 0, 0);
    int code = build_archive(a, &r, &err) == SPC_OK ? EXIT_DONE : EXIT_FAILED;
    if (code == EXIT_DONE && a->json)
        code = print_json(a->build.out, build_json(&r));
    if (code == EXIT_DONE && !a->quiet)
        build_print_summary(&r);
    free(a->build.facts);
    return code;
}

/* ---- a batch ------------------------------------------------------------------------------------- */

struct failure {
    char *name, *what;
    enum spc_status status;
};

struct batch {
    struct build_run *a;
    struct build_scans scans;
    struct failure *failed;         /* [listed_count] */
    size_t failed_count, listed_count;          /* fewer are listed when memory is short */
    size_t done, skipped;
    bool told;                      /* what could not be added has been */
    json_t *converted;              /* NULL without --json */
};

static void note_failure(struct batch *b, const char *name, const struct spc_error *err)
{
    struct failure *failed = realloc(b->failed, (b->listed_count + 1) * sizeof *failed);
    char *copy = strdup(name);
    char *what = strdup(err->what[0] ? err->what : spc_status_text(err->status));
    b->failed_count++;
    if (failed != NULL)
        b->failed = failed;
    if (failed == NULL || copy == NULL || what == NULL) {
        free(copy);
        free(what);
        return;
    }
    failed[b->listed_count++] = (struct failure){copy, what, err->status};
}

/* For scans that a command line or a list names: those that cannot be added are failures of their own. */
static enum spc_status add_scan(void *ctx, const char *name, struct spc_error *err)
{
    struct batch *b = ctx;
    struct spc_error own = {0};
    const enum spc_status status = build_scans_add(&b->scans, name, &own);
    if (status == SPC_OK)
        return SPC_OK;
    cli_error(name, &own, NULL);
    if (b->a->out_dir == NULL || status == SPC_NO_MEMORY) {
        b->told = true;
        return spc_fail(err, status, SPC_NO_OFF, "%s", own.what);
    }
    note_failure(b, name, &own);
    return SPC_OK;
}

static bool is_up_to_date(const char *scan, const char *archive)
{
    struct stat s, t;
    return strcmp(scan, "-") != 0 && stat(scan, &s) == 0 && stat(archive, &t) == 0 &&
           (t.st_mtim.tv_sec > s.st_mtim.tv_sec ||
            (t.st_mtim.tv_sec == s.st_mtim.tv_sec && t.st_mtim.tv_nsec >= s.st_mtim.tv_nsec));
}

static enum spc_status convert(struct batch *b, size_t i, const struct build_target *target,
                               struct spc_error *err)
{
    struct build_run *a = b->a;
    struct build_result r;
    struct spb_scan_facts facts;
    const char *scan = b->scans.path[i];
    if (target->taken) {            /* two folders may hold scans of one name */
        spc_fail(err, SPC_EXISTS, SPC_NO_OFF, "its archive would be called '%.100s', as that of an earlier scan",
                 target->path);
        cli_error(scan, err, "convert it on its own, with -o");
        return err->status;
    }
    if (a->update && is_up_to_date(scan, target->path)) {
        b->skipped++;
        return SPC_OK;
    }
    a->build.scan = scan;
    a->build.out = target->path;
    a->build.facts = &facts;
    a->build.force |= a->update;
    cli_progress_begin(a->progress, scan, i + 1, b->scans.count);
    if (build_archive(a, &r, err) != SPC_OK)
        return err->status;
    b->done++;
    if (!a->quiet)
        build_print_line(&r, i + 1, b->scans.count);
    if (b->converted != NULL)
        json_array_append_new(b->converted, build_json(&r));
    return SPC_OK;
}

static json_t *batch_json(struct batch *b)
{
    json_t *failed = json_array();
    for (size_t i = 0; i < b->listed_count; i++)
        json_array_append_new(failed, json_pack("{s:o, s:s, s:o}", "scan", meta_name(b->failed[i].name),
                                                "status", spc_status_name(b->failed[i].status), "error",
                                                meta_name(b->failed[i].what)));
    return json_pack("{s:O, s:o, s:I, s:I}", "converted", b->converted, "failed", failed, "up_to_date",
                     (json_int_t)b->skipped, "passed_over", (json_int_t)b->scans.passed_over);
}

/* The last lines must tell all: nobody scrolls back at night. */
static void print_batch(const struct batch *b, size_t left)
{
    fprintf(stderr, "%zu converted", b->done);
    if (b->skipped > 0)
        fprintf(stderr, ", %zu up to date", b->skipped);
    fprintf(stderr, ", %zu failed", b->failed_count);
    if (left > 0)
        fprintf(stderr, "; stopped before the other %zu", left);
    if (b->scans.passed_over > 0)
        fprintf(stderr, "; %zu file%s not named as a scan passed over", b->scans.passed_over,
                b->scans.passed_over == 1 ? "" : "s");
    fputs(b->failed_count > 0 ? ":\n" : "\n", stderr);
    for (size_t i = 0; i < b->listed_count; i++)
        cli_list(b->failed[i].name, b->failed[i].what);
}

/* Before the long work: a folder that is none would fail every scan once it has been read. */
static int make_folder(const char *folder)
{
    struct spc_error err = {0};
    struct stat st;
    if (mkdir(folder, 0777) == 0)
        return EXIT_DONE;
    if (errno != EEXIST)
        spc_fail_os(&err, errno, "cannot create the folder");
    else if (stat(folder, &st) != 0 || !S_ISDIR(st.st_mode))
        spc_fail(&err, SPC_IO, SPC_NO_OFF, "not a folder, so no archives can be put there");
    else
        return EXIT_DONE;
    cli_error(folder, &err, NULL);
    return EXIT_FAILED;
}

static int build_batch(struct batch *b)
{
    struct build_run *a = b->a;
    struct build_target *targets;
    size_t tried = 0;
    bool stopped = false;
    int code = make_folder(a->out_dir);
    if (code != EXIT_DONE)
        return code;
    targets = build_scans_targets(&b->scans, a->out_dir);
    if (targets == NULL)
        return fail_plain(a->out_dir, SPC_NO_MEMORY, "no memory for the archives' names");
    b->converted = a->json ? json_array() : NULL;
    for (; tried < b->scans.count && !stopped; tried++) {
        struct spc_error err = {0};
        convert(b, tried, &targets[tried], &err);
        if (err.status != SPC_OK)
            note_failure(b, b->scans.path[tried], &err);
        stopped = err.status == SPC_CANCELLED;
    }
    build_scans_targets_free(targets, b->scans.count);
    if (a->json)
        code = print_json(a->out_dir, batch_json(b));
    if (!a->quiet || b->failed_count > 0)
        print_batch(b, b->scans.count - tried);
    return b->failed_count > 0 ? EXIT_FAILED : code;
}

static void batch_free(struct batch *b)
{
    for (size_t i = 0; i < b->listed_count; i++) {
        free(b->failed[i].name);
        free(b->failed[i].what);
    }
    free(b->failed);
    json_decref(b->converted);
    build_scans_free(&b->scans);
}

/* ---- all of it ----------------------------------------------------------------------------------- */

static int check_arguments(const struct build_run *a, const struct build_scans *scans)
{
    size_t inputs = a->list != NULL && strcmp(a->list, "-") == 0;
    for (size_t i = 0; i < scans->count; i++)
        inputs += strcmp(scans->path[i], "-") == 0;
    if (inputs > 1)
        return cli_usage("standard input can be read once");
    return EXIT_DONE;
}

int build_run(struct build_run *a, char **names)
{
    struct batch b = {.a = a};
    struct spc_error err = {0};
    enum spc_status status = SPC_OK;
    a->build.meta = make_meta;
    a->build.meta_ctx = a;
    a->build.progress = (struct spb_progress){cli_progress, (void *)SHARES};
    for (; *names != NULL && status == SPC_OK; names++)
        status = add_scan(&b, *names, &err);
    if (status == SPC_OK && a->list != NULL) {
        status = build_scans_list(a->list, add_scan, &b, &err);
        if (status != SPC_OK && !b.told)
            cli_error(a->list, &err, NULL);
    }
    int code = status == SPC_OK ? check_arguments(a, &b.scans) : EXIT_FAILED;
    if (code == EXIT_DONE && b.scans.count == 0 && b.failed_count == 0)
        code = fail_plain(a->list, SPC_INPUT_EMPTY, "the list names no scan");
    if (code == EXIT_DONE)
        code = a->out_dir != NULL ? build_batch(&b) : build_one(a, &b.scans);
    batch_free(&b);
    return code;
}

