/*
 * info_bytes.c - what the bytes of an archive are spent on, and what precision they buy.
 *
 * Precision is measured on what is stored, not read off the builder's constants: a lattice is the
 * coarsest one that holds the positions, rounding is the low bits that no code uses. Fewer nodes
 * than GROUP_MIN may lie on a coarser lattice by chance; they are left out.
 */
#include "info.h"
#include "meta.h"

#include "bytes.h"
#include "layout.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    CODES = 1 << 16, OCTAVES = 256, OCTAVE_SHIFT = 8,
    GROUP_MIN = 16,                 /* inner nodes of one octave and block that tell a lattice */
    OCT_HALF = 127,
    SAMPLES = 4,                    /* a side of a cell of normals */
    WORD = 24,
};

struct pass {
    const struct spc_reader *reader;
    struct info_bytes *out;
    uint64_t (*counts)[CODES];      /* [3]: of leaves' radii, of their edges, of lattice shares */
    uint32_t used[2][4];            /* bits that some code of a kind uses: radius, error, height, normal */
};
enum { LEAF_RADIUS, LEAF_EDGE, CENTER_SHARE, COUNTS };
enum { RADIUS, ERROR, HEIGHT, NORMAL };

/* ---- lattices and codes ------------------------------------------------------------------------- */

static int zero_bits(uint32_t used, int most)
{
    int n = 0;
    while (n < most && !(used >> n & 1))
        n++;
    return n;
}

static void note_codes(struct pass *p, enum spc_block_kind kind, const uint8_t *record)
{
    uint32_t *used = p->used[kind];
    used[RADIUS] |= load_u16(record + ND_RADIUS);
    used[ERROR] |= load_u16(record + ND_E_SELF);
    used[HEIGHT] |= (uint32_t)record[ND_HEIGHT] + 1;
    used[NORMAL] |= (uint32_t)abs(record[ND_NORMAL] - OCT_HALF);
    used[NORMAL] |= (uint32_t)abs(record[ND_NORMAL + 1] - OCT_HALF);
}

/* Centres of one block by octaves of their radii: the builder's lattices follow these. */
static void note_centers(struct pass *p, const struct info_block *b)
{
    uint32_t nodes[OCTAVES] = {0}, used[OCTAVES] = {0};
    const uint8_t *records = b->payload + b->layout.nodes;
    for (uint32_t i = 0; i < b->block.node_count; i++) {
        const uint8_t *record = records + (size_t)ND_SIZE * i;
        const uint32_t octave = load_u16(record + ND_RADIUS) >> OCTAVE_SHIFT;
        nodes[octave]++;
        used[octave] |= load_u16(record + ND_X) | load_u16(record + ND_Y) | load_u16(record + ND_Z);
    }
    const int step_exp = b->block.step_exp - spc_reader_header(p->reader)->unit_exp;
    for (uint32_t i = 0; i < b->block.node_count; i++) {
        const uint16_t radius = load_u16(records + (size_t)ND_SIZE * i + ND_RADIUS);
        const uint32_t octave = radius >> OCTAVE_SHIFT;
        if (nodes[octave] < GROUP_MIN || used[octave] == 0 || radius == SPC_LEN_ZERO)
            continue;
        const double share = ldexp(1, step_exp + zero_bits(used[octave], 16)) /
                             (double)spc_len_decode(radius);
        p->out->center_step = fmax(p->out->center_step, share);
        p->out->centers_measured++;
        p->counts[CENTER_SHARE][spc_len_encode_up(share)]++;
    }
}

static enum spc_status note_block(void *ctx, const struct info_block *b, struct spc_error *err)
{
    struct pass *p = ctx;
    const bool leaf = b->block.kind == SPC_BLOCK_LEAF;
    for (uint32_t i = 0; i < b->block.node_count; i++) {
        const uint8_t *record = b->payload + b->layout.nodes + (size_t)ND_SIZE * i;
        note_codes(p, b->block.kind, record);
        if (leaf) {
            p->counts[LEAF_RADIUS][load_u16(record + ND_RADIUS)]++;
            p->counts[LEAF_EDGE][load_u16(record + ND_E_SELF)]++;
        }
    }
    if (!leaf)
        note_centers(p, b);
    return spc_block_streams(p->reader, b->index, p->out->streams, err);
}

/* Value that half of what was counted reaches at most, in units. */
static double median(const uint64_t counts[CODES])
{
    uint64_t all = 0, sum = 0;
    for (uint32_t code = 0; code < CODES; code++)
        all += counts[code];
    for (uint32_t code = 0; code < CODES; code++) {
        sum += counts[code];
        if (all > 0 && 2 * sum >= all)
            return (double)spc_len_decode((uint16_t)code);
    }
    return 0;
}

/* ---- directions --------------------------------------------------------------------------------- */

/* spc_normal_decode between the codes, u and v not negative. */
static void direction(double u, double v, double n[3])
{
    n[2] = OCT_HALF - u - v;
    n[0] = n[2] >= 0 ? u : OCT_HALF - v;
    n[1] = n[2] >= 0 ? v : OCT_HALF - u;
    const double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int a = 0; a < 3; a++)
        n[a] /= length;
}

/* Cosine of the angle from a direction in the cell at u, v to the nearest of the cell's corners. */
static double nearest_corner(const double n[3], int u, int v, int step)
{
    double nearest = -1;
    for (int k = 0; k < 4; k++) {
        const int cu = u + (k & 1 ? step : 0), cv = v + (k & 2 ? step : 0);
        double m[3];
        if (cu > OCT_HALF || cv > OCT_HALF)
            continue;               /* folded over the edge: no nearer than those this side */
        direction(cu, cv, m);
        nearest = fmax(nearest, n[0] * m[0] + n[1] * m[1] + n[2] * m[2]);
    }
    return nearest;
}

/* Largest angle between a direction and the nearest code, of those with numbers k * step. */
static double worst_angle_deg(int step)
{
    double least = 1;
    for (int u = 0; u < OCT_HALF; u += step)
        for (int v = 0; v < OCT_HALF; v += step)
            for (int s = 0; s < (SAMPLES + 1) * (SAMPLES + 1); s++) {
                const double du = (double)(s / (SAMPLES + 1)) * step / SAMPLES;
                const double dv = (double)(s % (SAMPLES + 1)) * step / SAMPLES;
                double n[3];
                if (u + du > OCT_HALF || v + dv > OCT_HALF)
                    continue;
                direction(u + du, v + dv, n);
                least = fmin(least, nearest_corner(n, u, v, step));
            }
    return acos(fmin(1, least)) * (180 / acos(-1));
}

/* ---- one pass ------------------------------------------------------------------------------------ */

/* Cells without detail have a coarser lattice than the header's. */
static double coarsest_step(const struct spc_reader *r)
{
    struct meta_coding coding;
    size_t bytes = 0;
    const char *text = spc_reader_meta(r, &bytes);
    json_t *meta = json_loadb(text, bytes, 0, NULL);
    meta_read_coding(meta, spc_reader_header(r), &coding);
    json_decref(meta);
    return coding.coarsest_step;
}

static void conclude(struct pass *p)
{
    const struct spc_header *h = spc_reader_header(p->reader);
    struct info_bytes *out = p->out;
    for (int k = 0; k < 2; k++)
        out->excess[k] = (struct info_excess){
            .radius = ldexp(1, zero_bits(p->used[k][RADIUS], 8) - 8),
            .error = ldexp(1, zero_bits(p->used[k][ERROR], 8) - 8),
            .height = ldexp(1, zero_bits(p->used[k][HEIGHT], 8) - 8),
            .normal_deg = worst_angle_deg(1 << zero_bits(p->used[k][NORMAL], 6)),
        };
    out->vertex_step = ldexp(1, h->vertex_exp);
    out->vertex_moved = coarsest_step(p->reader) * sqrt(3) / 2;
    out->leaf_radius = info_file_units(h, median(p->counts[LEAF_RADIUS]));
    out->leaf_edge = info_file_units(h, median(p->counts[LEAF_EDGE]));
    out->center_step_median = median(p->counts[CENTER_SHARE]);
    out->inner_count = h->node_count - h->leaf_count;
    out->diagonal = hypot(hypot(h->box_max[0] - h->box_min[0], h->box_max[1] - h->box_min[1]),
                          h->box_max[2] - h->box_min[2]);
}

static uint64_t data_start(const struct spc_reader *r)
{
    struct spc_cluster root;
    spc_reader_cluster(r, 0, &root);
    return root.data_off;
}

uint64_t info_first_picture(const struct spc_reader *r)
{
    struct spc_cluster root;
    spc_reader_cluster(r, 0, &root);
    return root.data_off + root.data_bytes;
}

enum spc_status info_bytes_fill(const struct spc_reader *r, struct info_bytes *out,
                                struct spc_error *err)
{
    struct pass p = {.reader = r, .out = out, .counts = calloc(COUNTS, sizeof *p.counts)};
    *out = (struct info_bytes){.head = data_start(r), .total = spc_reader_header(r)->file_bytes};
    if (p.counts == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to count codes");
    const enum spc_status status = info_walk(r, "bytes", note_block, &p, err);
    if (status == SPC_OK)
        conclude(&p);
    free(p.counts);
    return status;
}

/* ---- for people ----------------------------------------------------------------------------------- */

static void put_stream(const char *text, uint64_t bytes, const struct info_bytes *b,
                       const struct spc_header *h)
{
    if (bytes > 0)
        printf("%-26s %14llu %6.2f %8.3f\n", text, (unsigned long long)bytes,
               100 * (double)bytes / (double)b->total, (double)bytes / (double)h->leaf_count);
}

/* "1/42" of something; "0" and shares above a half as they are. */
static const char *share_text(double share, double of, char text[WORD])
{
    const double v = of > 0 ? share / of : 0;
    if (v > 0 && v <= 0.5)
        snprintf(text, WORD, "1/%.*f", 1 / v < 9.95 ? 1 : 0, 1 / v);
    else
        snprintf(text, WORD, "%.3g", v);
    return text;
}

static void print_vertices(const struct info_bytes *b)
{
    char of_radius[WORD], of_edge[WORD], of_box[WORD];
    printf("vertices   lattice %.3g%s: moved by at most %.3g, half its diagonal;\n"
           "           %s of the median leaf radius, %s of the median of the\n"
           "           leaves' longest edges, %s of the box diagonal\n", b->vertex_step,
           b->vertex_moved > b->vertex_step ? " or coarser" : "", b->vertex_moved,
           share_text(b->vertex_moved, b->leaf_radius, of_radius),
           share_text(b->vertex_moved, b->leaf_edge, of_edge),
           share_text(b->vertex_moved, b->diagonal, of_box));
}

static void print_centers(const struct info_bytes *b)
{
    char most[WORD], half[WORD];
    if (b->centers_measured > 0)
        printf("centres    of inner nodes: lattices of at most %s of their radius,\n"
               "           median %s (measured on %.1f %% of them)\n", share_text(b->center_step, 1, most),
               share_text(b->center_step_median, 1, half),
               100 * (double)b->centers_measured / (double)b->inner_count);
}

static void print_codes(const char *label, const char *error, const struct info_excess *e)
{
    char height[WORD];
    printf("%-10s normals within %.2f degrees; rounded up by at most: radii %.2f %%,\n"
           "           %s %.2f %%, heights %s of the radius\n", label, e->normal_deg,
           100 * e->radius, error, 100 * e->error, share_text(e->height, 1, height));
}

void info_bytes_print(const struct spc_reader *r, const struct info_bytes *b)
{
    const struct spc_header *h = spc_reader_header(r);
    printf("%-26s %14s %6s %8s\n", "what the bytes are", "bytes", "%",
           h->flags & SPC_FLAG_TRIANGLES ? "/triangle" : "/leaf");
    for (int s = 0; s < SPC_STREAM_COUNT; s++)
        put_stream(spc_stream_text((enum spc_stream)s), b->streams[s], b, h);
    put_stream("head", b->head, b, h);
    put_stream("total", b->total, b, h);
    putchar('\n');
    print_vertices(b);
    if (b->inner_count > 0) {
        print_centers(b);
        print_codes("inner", "errors", &b->excess[SPC_BLOCK_INNER]);
    }
    print_codes("leaves", "longest edges", &b->excess[SPC_BLOCK_LEAF]);
}

/* ---- for programs ---------------------------------------------------------------------------------- */

static json_t *stream_json(const char *name, uint64_t bytes, const struct info_bytes *b,
                           const struct spc_header *h)
{
    char lower[WORD];
    size_t n = 0;
    for (; name[n] != '\0' && n < WORD - 1; n++)
        lower[n] = (char)tolower((unsigned char)name[n]);
    lower[n] = '\0';
    return json_pack("{s:s, s:I, s:f, s:f}", "stream", lower, "stored_bytes", (json_int_t)bytes,
                     "percent", 100 * (double)bytes / (double)b->total, "bytes_a_leaf",
                     (double)bytes / (double)h->leaf_count);
}

static json_t *excess_json(const struct info_excess *e)
{
    return json_pack("{s:f, s:f, s:f, s:f}", "radius", e->radius, "error", e->error,
                     "height_of_radius", e->height, "normal_deg", e->normal_deg);
}

static json_t *precision_json(const struct info_bytes *b)
{
    return json_pack(
        "{s:f, s:f, s:f, s:f, s:f, s:{s:f, s:f, s:I}, s:o, s:o}", "vertex_step", b->vertex_step,
        "vertex_moved_max", b->vertex_moved, "leaf_radius_median", b->leaf_radius,
        "leaf_longest_edge_median", b->leaf_edge, "box_diagonal", b->diagonal,
        "center_step_of_radius", "max", b->center_step, "median", b->center_step_median,
        "nodes_measured", (json_int_t)b->centers_measured, "inner",
        b->inner_count > 0 ? excess_json(&b->excess[SPC_BLOCK_INNER]) : json_null(), "leaf",
        excess_json(&b->excess[SPC_BLOCK_LEAF]));
}

json_t *info_bytes_json(const struct spc_reader *r, const struct info_bytes *b)
{
    static const char *const NAMES[] = {
#define X(name, text) #name,
        SPC_STREAM_LIST(X)
#undef X
    };
    const struct spc_header *h = spc_reader_header(r);
    json_t *streams = json_array();
    for (int s = 0; s < SPC_STREAM_COUNT; s++)
        json_array_append_new(streams, stream_json(NAMES[s], b->streams[s], b, h));
    json_array_append_new(streams, stream_json("HEAD", b->head, b, h));
    return json_pack("{s:o, s:o}", "streams", streams, "precision", precision_json(b));
}
