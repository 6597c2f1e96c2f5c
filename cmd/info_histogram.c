/*
 * info_histogram.c - spc-info's histograms: lengths in octaves, normals by direction, stored sizes.
 *
 * Bins are fixed before the first node is read, so one pass suffices and memory is that of the
 * largest block. Octaves, because the errors of one archive span five decades and the next level
 * of the tree is about an octave away.
 */
#include "info.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    LENGTH_MIN = -160, LENGTH_OCTAVES = 320,    /* lengths in units are floats */
    SIZE_OCTAVES = 64,              /* of bytes */
    SIZE_STEPS = 4,                 /* an octave: clusters are about equal */
    ZERO_BIN = 0, FIRST_OCTAVE = 1,
    FEW_AXES = 8,                   /* fewer say less than the signs of x, y and z do */
    OCTANTS = 8,
    CODES = 1 << 16,                /* of normals */
    BAR = 35, LINE = 80,
};

bool info_histogram_of(const char *word, enum info_of *of)
{
    static const struct {
        const char *word;
        enum info_of of;
    } all[] = {{"e", INFO_E}, {"radius", INFO_RADIUS}, {"normals", INFO_NORMALS}, {"size", INFO_SIZE}};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        if (strcmp(word, all[i].word) == 0) {
            *of = all[i].of;
            return true;
        }
    return false;
}

/* ---- bins --------------------------------------------------------------------------------------- */

static void octave_bins(struct info_histogram *out, int unit_exp)
{
    const bool size = out->of == INFO_SIZE;
    out->first_octave = size ? 0 : LENGTH_MIN;
    out->steps = size ? SIZE_STEPS : 1;
    out->bin_count = FIRST_OCTAVE + (size ? SIZE_OCTAVES * SIZE_STEPS : LENGTH_OCTAVES);
    for (int i = FIRST_OCTAVE; i < (int)out->bin_count; i++) {
        const int at = i - FIRST_OCTAVE, step = at % out->steps;
        const double start = ldexp(1, out->first_octave + at / out->steps + unit_exp);
        out->bins[i].min = start * (out->steps + step) / out->steps;
        out->bins[i].max = start * (out->steps + step + 1) / out->steps;
    }
}

static uint32_t octave_of(const struct info_histogram *hist, double v)
{
    if (!(v > 0))
        return ZERO_BIN;
    int octave;
    const double mantissa = 2 * frexp(v, &octave) - 1;      /* 0 to 1 in its octave */
    const int at = (octave - 1 - hist->first_octave) * hist->steps + (int)(mantissa * hist->steps);
    const int last = (int)hist->bin_count - 1 - FIRST_OCTAVE;
    return (uint32_t)(at < 0 ? 0 : at > last ? last : at) + FIRST_OCTAVE;
}

static int from_top(const void *a, const void *b)
{
    const struct info_bin *p = a, *q = b;
    return (p->axis[2] < q->axis[2]) - (p->axis[2] > q->axis[2]);
}

static void direction_bins(struct info_histogram *out, const struct spc_reader *r)
{
    const uint32_t axes = spc_reader_header(r)->normal_clusters;
    out->bin_count = axes < FEW_AXES ? OCTANTS : axes;
    for (uint32_t k = 0; k < out->bin_count; k++)
        if (axes < FEW_AXES)
            for (uint32_t a = 0; a < 3; a++)
                out->bins[k].axis[a] = k >> (2 - a) & 1 ? -sqrt(1.0 / 3) : sqrt(1.0 / 3);
        else
            spc_reader_axis(r, k, out->bins[k].axis);
    qsort(out->bins, out->bin_count, sizeof *out->bins, from_top);
}

/* The bin of each normal code: what is looked up for a billion nodes is computed for 65 thousand. */
static void direction_table(const struct info_histogram *hist, uint8_t bin_of[CODES])
{
    for (uint32_t code = 0; code < CODES; code++) {
        double n[3], nearest = -2;
        bin_of[code] = 0;
        if (!spc_normal_valid((uint16_t)code))
            continue;
        spc_normal_decode((uint16_t)code, n);
        for (uint32_t k = 0; k < hist->bin_count; k++) {
            const double *axis = hist->bins[k].axis;
            const double dot = n[0] * axis[0] + n[1] * axis[1] + n[2] * axis[2];
            if (dot > nearest) {
                nearest = dot;
                bin_of[code] = (uint8_t)k;
            }
        }
    }
}

/* ---- counting ----------------------------------------------------------------------------------- */

struct pass {
    const struct spc_reader *reader;
    struct info_histogram *hist;
    uint8_t *bin_of;                /* [CODES], for directions */
};

static uint32_t bin_of_node(const struct pass *p, const struct spc_node *node)
{
    switch (p->hist->of) {
    case INFO_E:
        return octave_of(p->hist, (double)spc_len_decode(node->e_self));
    case INFO_RADIUS:
        return octave_of(p->hist, node->radius);
    default:
        return p->bin_of[node->normal_code];
    }
}

static enum spc_status count_block(void *ctx, const struct info_block *b, struct spc_error *err)
{
    const struct pass *p = ctx;
    (void)err;
    for (uint32_t i = 0; i < b->block.node_count; i++) {
        struct spc_node node;
        spc_node_decode(p->reader, &b->block, &b->layout, b->payload, i, &node);
        p->hist->bins[bin_of_node(p, &node)].count[b->block.kind]++;
    }
    p->hist->total += b->block.node_count;
    return SPC_OK;
}

static enum spc_status count_nodes(const struct spc_reader *r, struct info_histogram *out,
                                   struct spc_error *err)
{
    struct pass p = {.reader = r, .hist = out};
    if (out->of == INFO_NORMALS) {
        p.bin_of = malloc(CODES);
        if (p.bin_of == NULL)
            return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a table of normals");
        direction_table(out, p.bin_of);
    }
    const enum spc_status status = info_walk(r, "histogram", count_block, &p, err);
    free(p.bin_of);
    return status;
}

enum spc_status info_histogram_fill(const struct spc_reader *r, enum info_of of,
                                    struct info_histogram *out, struct spc_error *err)
{
    const struct spc_header *h = spc_reader_header(r);
    *out = (struct info_histogram){.of = of};
    if (of == INFO_NORMALS)
        direction_bins(out, r);
    else
        octave_bins(out, of == INFO_SIZE ? 0 : h->unit_exp);
    if (of != INFO_SIZE)
        return count_nodes(r, out, err);
    for (uint32_t id = 0; id < h->cluster_count; id++) {
        struct spc_cluster c;
        spc_reader_cluster(r, id, &c);
        out->bins[octave_of(out, (double)c.data_bytes)].count[0]++;
    }
    out->total = h->cluster_count;
    return SPC_OK;
}

/* ---- output ------------------------------------------------------------------------------------- */

static uint64_t count_of(const struct info_bin *bin)
{
    return bin->count[0] + bin->count[1];
}

/* Octaves outside the first and last filled one are not shown; directions all are. */
static void shown_bins(const struct info_histogram *hist, uint32_t *first, uint32_t *end)
{
    *first = 0;
    *end = hist->bin_count;
    if (hist->of == INFO_NORMALS)
        return;
    while (*first < *end && count_of(&hist->bins[*first]) == 0)
        ++*first;
    while (*end > *first && count_of(&hist->bins[*end - 1]) == 0)
        --*end;
}

static const char *title(const struct spc_reader *r, const struct info_histogram *hist, char text[LINE])
{
    const struct spc_header *h = spc_reader_header(r);
    char unit[CLI_TEXT];
    const char *lengths = info_scale_text(info_scale(h), unit);
    switch (hist->of) {
    case INFO_E:
        snprintf(text, LINE, "e_self of nodes, in %s; # inner nodes, = leaves (longest edge)", lengths);
        break;
    case INFO_RADIUS:
        snprintf(text, LINE, "radius of nodes, in %s; # inner nodes, = leaves", lengths);
        break;
    case INFO_NORMALS:
        if (h->normal_clusters < FEW_AXES)
            return "normals of nodes, by octant; # inner nodes, = leaves";
        snprintf(text, LINE, "normals of nodes, by the nearest of %u axes; # inner nodes, = leaves",
                 h->normal_clusters);
        break;
    default:
        return "stored bytes of clusters; # clusters";
    }
    return text;
}

static void put_label(const struct info_histogram *hist, const struct info_bin *bin, double scale)
{
    char a[CLI_TEXT], b[CLI_TEXT];
    if (hist->of == INFO_NORMALS)
        printf("%6.2f %5.2f %5.2f", bin->axis[0], bin->axis[1], bin->axis[2]);
    else if (hist->of == INFO_SIZE)
        printf("%7s .. %-7s", cli_bytes_text((uint64_t)bin->min, a),
               cli_bytes_text((uint64_t)bin->max, b));
    else
        printf("%7s .. %-7s", info_length_text(bin->min / scale, a),
               info_length_text(bin->max / scale, b));
}

/* " ####===": a bin that holds anything has a bar. */
static void put_bar(const struct info_bin *bin, uint64_t tallest)
{
    const double all = (double)count_of(bin);
    const int length = tallest > 0 ? (int)ceil(BAR * all / (double)tallest) : 0;
    const int inner = all > 0 ? (int)lround(length * (double)bin->count[0] / all) : 0;
    if (length > 0)
        putchar(' ');
    for (int i = 0; i < length; i++)
        putchar(i < inner ? '#' : '=');
}

void info_histogram_print(const struct spc_reader *r, const struct info_histogram *hist)
{
    const double scale = info_scale(spc_reader_header(r));
    const double percent = 100 / (double)hist->total;
    char text[LINE];
    uint32_t first, end;
    uint64_t tallest = 0, sum = 0;
    shown_bins(hist, &first, &end);
    for (uint32_t i = first; i < end; i++)
        tallest = count_of(&hist->bins[i]) > tallest ? count_of(&hist->bins[i]) : tallest;
    puts(title(r, hist, text));
    printf("%s %10s %6s %6s\n", hist->of == INFO_NORMALS ? "     x     y     z" : "   from .. below  ",
           hist->of == INFO_SIZE ? "clusters" : "nodes", "%", "sum %");
    for (uint32_t i = first; i < end; i++) {
        const uint64_t n = count_of(&hist->bins[i]);
        sum += n;
        put_label(hist, &hist->bins[i], scale);
        printf(" %10llu %6.2f %6.2f", (unsigned long long)n, (double)n * percent,
               (double)sum * percent);
        put_bar(&hist->bins[i], tallest);
        putchar('\n');
    }
    printf("%18s %10llu %6.2f\n", "total", (unsigned long long)sum, (double)sum * percent);
}

static json_t *bin_json(const struct info_histogram *hist, const struct info_bin *bin)
{
    json_t *out = NULL;
    if (hist->of == INFO_NORMALS)
        out = json_pack("{s:[f, f, f]}", "axis", bin->axis[0], bin->axis[1], bin->axis[2]);
    else if (hist->of == INFO_SIZE)
        out = json_pack("{s:I, s:I}", "min_bytes", (json_int_t)bin->min, "max_bytes",
                        (json_int_t)bin->max);
    else
        out = json_pack("{s:o, s:o}", "min", info_length_json(bin->min), "max",
                        info_length_json(bin->max));
    json_object_set_new(out, "count", json_integer((json_int_t)count_of(bin)));
    if (hist->of != INFO_SIZE) {
        json_object_set_new(out, "inner", json_integer((json_int_t)bin->count[SPC_BLOCK_INNER]));
        json_object_set_new(out, "leaves", json_integer((json_int_t)bin->count[SPC_BLOCK_LEAF]));
    }
    return out;
}

json_t *info_histogram_json(const struct info_histogram *hist)
{
    static const char *const of[] = {"", "e", "radius", "normals", "size"};
    json_t *bins = json_array();
    uint32_t first, end;
    shown_bins(hist, &first, &end);
    for (uint32_t i = first; i < end; i++)
        json_array_append_new(bins, bin_json(hist, &hist->bins[i]));
    return json_pack("{s:s, s:I, s:o}", "of", of[hist->of], "total", (json_int_t)hist->total, "bins",
                     bins);
}
