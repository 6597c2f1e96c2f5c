#include "build_report.h"

#include "cli.h"

#include <math.h>
#include <stdio.h>

static const char *scan_name(const struct build_result *r, uint32_t i)
{
    return i == 0 ? r->options->scan : r->options->more[i - 1];
}

/* ---- warnings ---------------------------------------------------------------------------------- */

static const char *things(const struct spc_header *h)
{
    return h->points_in > 0 ? "point" : "face";
}

static const char *leaf_word(const struct spc_header *h)
{
    return h->points_in > 0 ? "point" : "triangle";
}

static void warn_dropped(const struct build_result *r)
{
    const struct spc_header *h = &r->report.header;
    const char *file = r->options->more_count == 0 ? r->options->scan : r->options->out;
    const struct { uint64_t count; const char *why; } drops[] = {
        {h->dropped_bad_index, "with an index that names no vertex"},
        {h->dropped_non_finite, h->points_in > 0 ? "that are not finite" : "with a vertex that is not finite"},
        {h->dropped_degenerate, "with fewer than 3 distinct corners"},
    };
    for (size_t i = 0; i < 3; i++)
        if (drops[i].count > 0)
            cli_warn(file, "dropped %llu %s%s %s", (unsigned long long)drops[i].count, things(h),
                     drops[i].count == 1 ? "" : "s", drops[i].why);
}

/*
 * Near x = 500 000 a float has steps of 0.03: a scan of millimetres that was moved there as floats
 * has lost its surface before it came here. A short edge of fewer steps than this shows it.
 */
static void warn_spent_digits(const struct build_result *r)
{
    enum { STEPS = 8 };
    const struct spb_build_report *b = &r->report;
    if (b->short_edge > 0 && b->short_edge < STEPS * b->step)
        cli_warn(r->options->more_count == 0 ? r->options->scan : r->options->out,
                 "far from the origin its coordinates resolve only %.2g, a short edge is %.2g: detail was "
                 "lost before; export it as double, or moved to the origin (and give --offset here)",
                 b->step, b->short_edge);
}

/* A length of two digits, not above v or not below. */
static double round_digits(double v, bool up)
{
    const double unit = pow(10, floor(log10(v)) - 1);
    return (up ? ceil(v / unit) : floor(v / unit)) * unit;
}

static const char *shapes_remedy(const struct build_result *r)
{
    static char text[160];
    const struct spb_build_report *b = &r->report;
    const double all = round_digits(b->shapes.least, false), some = round_digits(b->detail_least, true);
    if (b->detail_least < 0x1p-1000)
        snprintf(text, sizeof text, "such small numbers hold no more: multiply them by 1e100, say, and give "
                 "--scale 1e-100 here");
    else if (b->shapes.least >= b->detail_least)
        snprintf(text, sizeof text, "--detail %.2g keeps them", all);
    else if (b->shapes.most >= some)
        snprintf(text, sizeof text, "--detail %.2g keeps those that an archive of this size can hold; for the "
                 "others convert the fine part on its own", some);
    else
        snprintf(text, sizeof text, "an archive of this size cannot hold them: convert the fine part on its own");
    return text;
}

/* The lattice is chosen by what there is much of. */
static void warn_shapes(const struct build_result *r)
{
    const struct spb_build_report *b = &r->report;
    if (b->shapes.moved > 0)
        cli_warn(r->options->more_count == 0 ? r->options->scan : r->options->out,
                 "%llu %s%s of %.2g to %.2g across lost their shape: vertices are moved by up to %.2g; %s",
                 (unsigned long long)b->shapes.moved, leaf_word(&b->header), b->shapes.moved == 1 ? "" : "s",
                 b->shapes.least, b->shapes.most, ldexp(sqrt(0.75), b->coarse_exp), shapes_remedy(r));
}

void build_warn(const struct build_result *r)
{
    warn_dropped(r);
    for (uint32_t i = 0; i <= r->options->more_count; i++)
        if (r->facts[i].remark[0] != '\0')
            cli_warn(scan_name(r, i), "%s", r->facts[i].remark);
    warn_spent_digits(r);
    warn_shapes(r);
}

/* ---- for people -------------------------------------------------------------------------------- */

enum { PHASES_AFTER_S = 5 };        /* of short runs nobody asks where the time went */

static void print_phases(const struct spb_build_report *r)
{
    const double leaves = (double)r->header.leaf_count * 1e-9;
    for (int p = 0; p < SPB_PHASE_COUNT; p++) {
        const struct spb_phase_cost *c = &r->phases[p];
        if (c->wall_s >= 0.01)
            fprintf(stderr, "    %-16s %8.2f s %8.2f s CPU %7.0f ns CPU a %s\n", spb_phase_name[p],
                    c->wall_s, c->cpu_s, c->cpu_s / leaves,
                    r->header.points_in > 0 ? "point" : "triangle");
    }
}

static uint64_t dropped(const struct spc_header *h)
{
    return h->dropped_bad_index + h->dropped_non_finite + h->dropped_degenerate;
}

/* Where everything went: faces_in + split_extra + points_in = leaves + dropped. */
static void print_accounts(const struct spc_header *h)
{
    char a[CLI_TEXT], b[CLI_TEXT], c[CLI_TEXT], d[CLI_TEXT];
    if (dropped(h) == 0 && h->split_extra == 0)
        return;                     /* the first line has said it */
    fprintf(stderr, "  %s %ss read", cli_count_text(h->faces_in + h->points_in, a), things(h));
    if (h->split_extra > 0)
        fprintf(stderr, " + %s by splitting polygons", cli_count_text(h->split_extra, b));
    fprintf(stderr, " = %s kept + %s dropped\n", cli_count_text(h->leaf_count, c),
            cli_count_text(dropped(h), d));
}

/* What is warned of has been said. */
static void print_coding(const struct spb_build_report *b)
{
    char text[CLI_TEXT];
    if (b->shapes.flat > 0)
        fprintf(stderr, "  %s %s%s so thin that the vertices' lattice leaves no area\n",
                cli_count_text(b->shapes.flat, text), leaf_word(&b->header), b->shapes.flat == 1 ? " is" : "s are");
    if (b->coarse_exp > b->header.vertex_exp)
        fprintf(stderr, "  fine detail in places: vertices there on a lattice of %.2g, elsewhere of up to %.2g\n",
                ldexp(1, b->header.vertex_exp), ldexp(1, b->coarse_exp));
}

void build_print_summary(const struct build_result *r)
{
    char a[CLI_TEXT], d[CLI_TEXT], e[CLI_TEXT], f[CLI_TEXT];
    const struct spb_build_report *b = &r->report;
    const struct spc_header *h = &b->header;
    const struct usage *u = &r->usage;
    cli_put_name(stderr, r->options->out);
    fprintf(stderr, ": %s %ss, %s nodes in %u clusters, %s (%.2f bytes a %s)\n",
            cli_count_text(h->leaf_count, a), leaf_word(h), cli_count_text(h->node_count, d),
            h->cluster_count, cli_bytes_text(h->file_bytes, e),
            (double)h->file_bytes / (double)h->leaf_count, leaf_word(h));
    print_accounts(h);
    print_coding(b);
    fprintf(stderr, "  %.2f s, %.2f s CPU, peak memory %s of %s, temporary files %s written, "
            "%s read, %u part%s\n", u->wall_s, u->cpu_s, cli_bytes_text(u->peak_bytes, a),
            cli_bytes_text(r->options->memory, d), cli_bytes_text(b->temp_written, e),
            cli_bytes_text(b->temp_read, f), b->parts, b->parts == 1 ? "" : "s");
    if (u->group_bytes > 0 && u->wall_s >= PHASES_AFTER_S)
        fprintf(stderr, "  the control group's peak, page cache and other programs included: %s\n",
                cli_bytes_text(u->group_bytes, a));
    if (u->wall_s >= PHASES_AFTER_S)
        print_phases(b);
}

void build_print_line(const struct build_result *r, size_t number, size_t of)
{
    char a[CLI_TEXT], b[CLI_TEXT], c[CLI_TEXT];
    const struct spc_header *h = &r->report.header;
    fprintf(stderr, "[%zu/%zu] ", number, of);
    cli_put_name(stderr, r->options->out);
    fprintf(stderr, ": %s %ss", cli_count_text(h->leaf_count, a), leaf_word(h));
    if (dropped(h) > 0)
        fprintf(stderr, " (%s dropped)", cli_count_text(dropped(h), b));
    fprintf(stderr, ", %s, %.2f s\n", cli_bytes_text(h->file_bytes, c), r->usage.wall_s);
}

/* ---- for programs ------------------------------------------------------------------------------ */

static json_t *phases_json(const struct spb_build_report *r)
{
    json_t *out = json_array();
    for (int p = 0; p < SPB_PHASE_COUNT; p++) {
        const struct spb_phase_cost *c = &r->phases[p];
        json_array_append_new(out, json_pack("{s:s, s:f, s:f, s:I, s:I}", "name", spb_phase_name[p],
                                             "wall_s", c->wall_s, "cpu_s", c->cpu_s,
                                             "temp_written_bytes", (json_int_t)c->temp_written,
                                             "temp_read_bytes", (json_int_t)c->temp_read));
    }
    return out;
}

static json_t *remarks_json(const struct build_result *r)
{
    json_t *out = json_array();
    for (uint32_t i = 0; i <= r->options->more_count; i++)
        if (r->facts[i].remark[0] != '\0')
            json_array_append_new(out, json_pack("{s:o, s:o}", "scan", meta_name(scan_name(r, i)), "remark",
                                                 meta_name(r->facts[i].remark)));
    return out;
}

json_t *build_json(const struct build_result *r)
{
    const struct spb_build_report *b = &r->report;
    const struct spc_header *h = &b->header;
    const struct usage *u = &r->usage;
    json_t *out = json_pack(
        "{s:o, s:o, s:o, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:b, s:{s:I, s:I, s:I}}",
        "output", meta_name(r->options->out), "sources", meta_sources(r->options), "remarks",
        remarks_json(r), "faces_in", (json_int_t)h->faces_in, "split_extra",
        (json_int_t)h->split_extra, "points_in", (json_int_t)h->points_in, "leaves",
        (json_int_t)h->leaf_count, "nodes", (json_int_t)h->node_count, "clusters",
        (json_int_t)h->cluster_count, "file_bytes", (json_int_t)h->file_bytes, "closed",
        (int)b->closed, "dropped", "bad_index", (json_int_t)h->dropped_bad_index, "non_finite",
        (json_int_t)h->dropped_non_finite, "degenerate", (json_int_t)h->dropped_degenerate);
    json_object_update_new(out, json_pack(
        "{s:f, s:f, s:I, s:I, s:I, s:I, s:I, s:i, s:o}", "wall_s", u->wall_s, "cpu_s", u->cpu_s,
        "memory_bytes", (json_int_t)r->options->memory, "peak_bytes", (json_int_t)u->peak_bytes,
        "group_peak_bytes", (json_int_t)u->group_bytes, "temp_written_bytes",
        (json_int_t)b->temp_written, "temp_read_bytes", (json_int_t)b->temp_read, "parts",
        (int)b->parts, "phases", phases_json(b)));
    json_t *coding = meta_coding_json(b);
    json_object_set_new(out, "coding", coding ? coding : json_null());
    return out;
}

const char *build_remedy(const struct build_result *r, const struct spc_error *err, bool in_scan)
{
    switch (err->status) {
    case SPC_EXISTS: return "--force replaces it";
    case SPC_BUSY: return "wait for it, or choose another name";
    case SPC_NO_MEMORY: return "a smaller --memory or fewer --threads may help";
    case SPC_INPUT_TRUNCATED: return "copy or export the scan again";
    case SPC_NOT_SPC:
    case SPC_TRUNCATED:
    case SPC_CORRUPT:
    case SPC_CHECKSUM: return in_scan ? "'spc-info --recover' rebuilds an archive from what is whole of it" : NULL;
    case SPC_INPUT_BAD:
        if (r->report.shapes.moved > 0)
            return shapes_remedy(r);
        return r->options->strict ? "without --strict they are dropped" : NULL;
    case SPC_IO: return cli_disk_remedy(err, "free some space there, or move temporary files with --temp");
    default: return NULL;
    }
}
