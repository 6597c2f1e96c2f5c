/*
 * info_tables.c - spc-info's tables: a line a cluster, a line a block.
 *
 * The width of a column comes from what bounds it (a total of the header, 6 characters of a
 * length), not from a first pass over the rows: the first line is out at once, however long the
 * directory. Rows stop when nobody reads them.
 */
#include "info.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- lengths ----------------------------------------------------------------------------------- */

double info_file_units(const struct spc_header *h, double units)
{
    return ldexp(units, h->unit_exp);
}

static double largest_side(const struct spc_header *h)
{
    double side = 0;
    for (int a = 0; a < 3; a++)
        side = fmax(side, h->box_max[a] - h->box_min[a]);
    return side;
}

double info_scale(const struct spc_header *h)
{
    const double side = largest_side(h);
    const double fine = h->e_min > 0 ? info_file_units(h, (double)h->e_min) : side;
    if (!(fine > 0) || !(side > 0))
        return 1;
    double thousands = floor(log10(fine) / 3);
    while (side / pow(10, 3 * thousands) >= 1e5)
        thousands++;
    return pow(10, 3 * thousands);
}

const char *info_scale_text(double scale, char text[CLI_TEXT])
{
    if (scale == 1)
        return "file units";
    snprintf(text, CLI_TEXT, "%g file units", scale);
    return text;
}

/* "1.20e-07" becomes "1.20e-7". */
static void strip_exponent(char *text)
{
    char *to = strchr(text, 'e') + 1;
    const char *from = to;
    if (*from == '-')
        to++;
    from++;
    while (*from == '0')
        from++;
    memmove(to, from, strlen(from) + 1);
}

const char *info_length_text(double v, char text[CLI_TEXT])
{
    if (v == 0 || isinf(v))
        return v == 0 ? "0" : "inf";
    if (v >= 0.000995 && v < 99999.5) {
        const int digits = v >= 99.95 ? 0 : v >= 9.995 ? 1 : v >= 0.9995 ? 2 : v >= 0.09995 ? 3 : 4;
        snprintf(text, CLI_TEXT, "%.*f", digits, v);
        return text;
    }
    for (int digits = 2; digits >= 0; digits--) {
        snprintf(text, CLI_TEXT, "%.*e", digits, v);
        strip_exponent(text);
        if (strlen(text) <= 6)
            break;
    }
    return text;
}

/* ---- columns ----------------------------------------------------------------------------------- */

enum { COLUMNS_MAX = 20, LENGTH_WIDTH = 6 };

struct column {
    const char *name, *group;       /* group: word over this and the columns before it, or NULL */
    int width;                      /* at least that of the name */
};

struct table {
    struct column columns[COLUMNS_MAX];
    int count, at;                  /* at: next cell of the row */
    double unit;                    /* shown units in a unit of the archive */
};

static void column(struct table *t, const char *group, const char *name, int width)
{
    const int least = (int)strlen(name);
    t->columns[t->count++] = (struct column){name, group, width > least ? width : least};
}

static int digits_of(uint64_t v)
{
    int n = 1;
    while (v >= 10) {
        v /= 10;
        n++;
    }
    return n;
}

static void cell(struct table *t, const char *text)
{
    printf("%s%*s", t->at > 0 ? " " : "", t->columns[t->at].width, text);
    t->at++;
    if (t->at == t->count) {
        putchar('\n');
        t->at = 0;
    }
}

static void cell_count(struct table *t, uint64_t v)
{
    char text[CLI_TEXT];
    snprintf(text, sizeof text, "%llu", (unsigned long long)v);
    cell(t, text);
}

static void cell_length(struct table *t, double units)
{
    char text[CLI_TEXT];
    cell(t, info_length_text(units * t->unit, text));
}

static void cell_range(struct table *t, const float range[2])
{
    cell_length(t, (double)range[0]);
    cell_length(t, (double)range[1]);
}

static void table_head(struct table *t)
{
    int end = 0, used = 0;
    for (int i = 0; i < t->count; i++) {
        end += t->columns[i].width + (i > 0);
        if (t->columns[i].group != NULL) {
            printf("%*s", end - used, t->columns[i].group);
            used = end;
        }
    }
    putchar('\n');
    for (int i = 0; i < t->count; i++)
        cell(t, t->columns[i].name);
}

static void column_range(struct table *t, const char *group)
{
    column(t, NULL, "min", LENGTH_WIDTH);
    column(t, group, "max", LENGTH_WIDTH);
}

static double shown_unit(const struct spc_header *h)
{
    return info_file_units(h, 1) / info_scale(h);
}

/* ---- clusters ---------------------------------------------------------------------------------- */

enum { CHILDREN, INNER, LEAVES, BLOCKS, BYTES, COUNTS };
enum { E_SELF, E_PARENT, RADIUS, RANGES };

struct cluster_row {                /* a cluster, or the sum of all */
    uint64_t counts[COUNTS];
    float ranges[RANGES][2];
    double sides[3];
    double cone_deg;
};

static double cone_degrees(const struct spc_cluster *c)
{
    return acos(fmax(-1, fmin(1, (double)c->cone[3]))) * (180 / acos(-1));
}

static void sides_of(const float box[6], double sides[3])
{
    for (int a = 0; a < 3; a++)
        sides[a] = (double)box[a + 3] - (double)box[a];
}

static struct cluster_row row_of(const struct spc_cluster *c)
{
    struct cluster_row row = {
        .counts = {c->child_count, c->inner_count, c->leaf_count, c->block_count, c->data_bytes},
        .ranges = {{c->e_self_min, c->e_self_max}, {c->e_parent_min, c->e_parent_max},
                   {c->radius_min, c->radius_max}},
        .cone_deg = cone_degrees(c),
    };
    sides_of(c->box, row.sides);
    return row;
}

static void add_row(struct cluster_row *sum, const struct cluster_row *row)
{
    for (int i = 0; i < COUNTS; i++)
        sum->counts[i] += row->counts[i];
    for (int i = 0; i < RANGES; i++) {
        sum->ranges[i][0] = fminf(sum->ranges[i][0], row->ranges[i][0]);
        sum->ranges[i][1] = fmaxf(sum->ranges[i][1], row->ranges[i][1]);
    }
}

static void cluster_columns(struct table *t, const struct spc_header *h)
{
    const int id = digits_of(h->cluster_count - 1);
    column(t, NULL, "id", id < 5 ? 5 : id);     /* "total" fits */
    column(t, NULL, "lvl", 0);
    column(t, NULL, "parent", id);
    column(t, NULL, "kids", id);
    column(t, NULL, "inner", digits_of(h->node_count - h->leaf_count));
    column(t, NULL, "leaves", digits_of(h->leaf_count));
    column(t, NULL, "blocks", digits_of(h->block_count));
    column(t, NULL, "bytes", digits_of(h->file_bytes));
    column_range(t, "e_self");
    column_range(t, "e_parent");
    column_range(t, "radius");
    column(t, NULL, "x", LENGTH_WIDTH);
    column(t, NULL, "y", LENGTH_WIDTH);
    column(t, "box size", "z", LENGTH_WIDTH);
    column(t, "cone", "deg", 4);
}

static void cluster_cells(struct table *t, const struct cluster_row *row)
{
    char text[CLI_TEXT];
    for (int i = 0; i < COUNTS; i++)
        cell_count(t, row->counts[i]);
    for (int i = 0; i < RANGES; i++)
        cell_range(t, row->ranges[i]);
    for (int a = 0; a < 3; a++)
        cell_length(t, row->sides[a]);
    snprintf(text, sizeof text, "%.0f", row->cone_deg);
    cell(t, text);
}

void info_print_clusters(const struct spc_reader *r)
{
    const struct spc_header *h = spc_reader_header(r);
    struct table t = {.unit = shown_unit(h)};
    struct spc_cluster c;
    char text[CLI_TEXT];
    spc_reader_cluster(r, h->cluster_count - 1, &c);
    printf("%u cluster%s on %u level%s; lengths in %s; cone: half angle, 180 for all\n",
           h->cluster_count, h->cluster_count == 1 ? "" : "s", c.level + 1,
           c.level == 0 ? "" : "s", info_scale_text(info_scale(h), text));
    cluster_columns(&t, h);
    table_head(&t);
    spc_reader_cluster(r, 0, &c);
    struct cluster_row sum = row_of(&c);        /* its cone holds the cones of all */
    memset(sum.counts, 0, sizeof sum.counts);
    sides_of(c.sub_box, sum.sides);
    for (uint32_t id = 0; id < h->cluster_count && !ferror(stdout); id++) {
        spc_reader_cluster(r, id, &c);
        cell_count(&t, id);
        cell_count(&t, c.level);
        if (c.parent == SPC_NONE)
            cell(&t, "-");
        else
            cell_count(&t, c.parent);
        const struct cluster_row row = row_of(&c);
        cluster_cells(&t, &row);
        add_row(&sum, &row);
    }
    cell(&t, "total");
    cell(&t, "-");
    cell(&t, "-");
    cluster_cells(&t, &sum);
}

/* ---- blocks of a cluster ------------------------------------------------------------------------ */

enum { SUMMED = 4, SUMS = 4 };       /* columns stored to vertices have a sum */

static const char *kind_text(const struct spc_block *b)
{
    return b->kind == SPC_BLOCK_INNER ? "inner" : "leaf";
}

static const char *codec_text(const struct spc_block *b)
{
    return b->codec == SPC_CODEC_RAW ? "raw" : "zstd";
}

static void block_columns(struct table *t, const struct spc_header *h, const struct spc_cluster *c)
{
    const int index = digits_of(h->block_count - 1), bytes = digits_of(c->data_bytes);
    column(t, NULL, "index", index);
    column(t, NULL, "kind", 5);
    column(t, NULL, "codec", 4);
    column(t, NULL, "offset", digits_of(h->file_bytes));
    column(t, NULL, "stored", bytes);
    column(t, NULL, "decoded", bytes);
    column(t, NULL, "nodes", digits_of((uint64_t)c->inner_count + c->leaf_count));
    column(t, NULL, "vertices", 0);
    column_range(t, "e_parent");
    column(t, "e_self", "min", LENGTH_WIDTH);
    column(t, "link", "max", LENGTH_WIDTH);
    column(t, "radius", "max", LENGTH_WIDTH);
    column(t, NULL, "step", LENGTH_WIDTH);
}

static void block_row(struct table *t, uint32_t index, const struct spc_block *b, double step)
{
    cell_count(t, index);
    cell(t, kind_text(b));
    cell(t, codec_text(b));
    cell_count(t, b->off);
    cell_count(t, b->stored_bytes);
    cell_count(t, b->raw_bytes);
    cell_count(t, b->node_count);
    cell_count(t, b->vertex_count);
    cell_range(t, (const float[2]){b->e_parent_min, b->e_parent_max});
    cell_length(t, (double)b->e_self_min);
    cell_length(t, (double)b->link_max);
    cell_length(t, (double)b->radius_max);
    cell_length(t, step);
}

void info_print_blocks(const struct spc_reader *r, uint32_t cluster)
{
    const struct spc_header *h = spc_reader_header(r);
    struct table t = {.unit = shown_unit(h)};
    struct spc_cluster c;
    struct spc_block b;
    char text[CLI_TEXT];
    uint64_t sums[SUMS] = {0};
    spc_reader_cluster(r, cluster, &c);
    printf("blocks of cluster %u on level %u, in prefix order; lengths in %s\n", cluster, c.level,
           info_scale_text(info_scale(h), text));
    block_columns(&t, h, &c);
    table_head(&t);
    for (uint32_t k = 0; k < c.block_count && !ferror(stdout); k++) {
        spc_reader_block(r, c.block_first + k, &b);
        block_row(&t, c.block_first + k, &b, ldexp(1, b.step_exp - h->unit_exp));
        sums[0] += b.stored_bytes;
        sums[1] += b.raw_bytes;
        sums[2] += b.node_count;
        sums[3] += b.vertex_count;
    }
    cell(&t, "total");
    while (t.at < SUMMED)
        cell(&t, "-");
    for (int i = 0; i < SUMS; i++)
        cell_count(&t, sums[i]);
    while (t.at > 0)
        cell(&t, "-");
}

/* ---- JSON --------------------------------------------------------------------------------------- */

json_t *info_length_json(double file_units)
{
    return isinf(file_units) ? json_null() : json_real(file_units);
}

static json_t *length_json(const struct spc_header *h, double units)
{
    return info_length_json(info_file_units(h, units));
}

static json_t *range_json(const struct spc_header *h, const float range[2])
{
    return json_pack("{s:o, s:o}", "min", length_json(h, (double)range[0]), "max",
                     length_json(h, (double)range[1]));
}

/* The values are floats times a power of two: 9 digits name them. */
static void put_row(json_t *row, bool first)
{
    fputs(first ? "\n    " : ",\n    ", stdout);
    json_dumpf(row, stdout, JSON_REAL_PRECISION(9));
    json_decref(row);
}

static json_t *cluster_json(const struct spc_header *h, uint32_t id, const struct spc_cluster *c)
{
    const struct cluster_row row = row_of(c);
    json_t *out = json_pack(
        "{s:I, s:I, s:o, s:I, s:I, s:I, s:I, s:I, s:I, s:I}", "id", (json_int_t)id, "level",
        (json_int_t)c->level, "parent",
        c->parent == SPC_NONE ? json_null() : json_integer((json_int_t)c->parent), "child_first",
        (json_int_t)c->child_first, "children", (json_int_t)c->child_count, "inner",
        (json_int_t)c->inner_count, "leaves", (json_int_t)c->leaf_count, "block_first",
        (json_int_t)c->block_first, "blocks", (json_int_t)c->block_count, "bytes",
        (json_int_t)c->data_bytes);
    json_t *lengths = json_pack(
        "{s:o, s:o, s:o, s:[o, o, o], s:{s:[f, f, f], s:f}}", "e_self",
        range_json(h, row.ranges[E_SELF]), "e_parent", range_json(h, row.ranges[E_PARENT]),
        "radius", range_json(h, row.ranges[RADIUS]), "box_size", length_json(h, row.sides[0]),
        length_json(h, row.sides[1]), length_json(h, row.sides[2]), "cone", "axis",
        (double)c->cone[0], (double)c->cone[1], (double)c->cone[2], "half_angle_deg",
        row.cone_deg);
    json_object_update_new(out, lengths);
    return out;
}

void info_json_clusters(const struct spc_reader *r)
{
    const struct spc_header *h = spc_reader_header(r);
    fputs(",\n  \"cluster_table\": [", stdout);
    for (uint32_t id = 0; id < h->cluster_count && !ferror(stdout); id++) {
        struct spc_cluster c;
        spc_reader_cluster(r, id, &c);
        put_row(cluster_json(h, id, &c), id == 0);
    }
    fputs("\n  ]", stdout);
}

static json_t *block_json(const struct spc_header *h, uint32_t index, const struct spc_block *b)
{
    json_t *out = json_pack(
        "{s:I, s:I, s:s, s:s, s:I, s:I, s:I, s:I, s:I}", "index", (json_int_t)index, "cluster",
        (json_int_t)b->cluster, "kind", kind_text(b), "codec", codec_text(b), "offset",
        (json_int_t)b->off, "stored_bytes", (json_int_t)b->stored_bytes, "decoded_bytes",
        (json_int_t)b->raw_bytes, "nodes", (json_int_t)b->node_count, "vertices",
        (json_int_t)b->vertex_count);
    json_t *lengths = json_pack(
        "{s:o, s:o, s:o, s:o, s:o}", "e_parent",
        range_json(h, (const float[2]){b->e_parent_min, b->e_parent_max}), "e_self_min",
        length_json(h, (double)b->e_self_min), "link_max", length_json(h, (double)b->link_max),
        "radius_max", length_json(h, (double)b->radius_max), "step",
        json_real(ldexp(1, b->step_exp)));
    json_object_update_new(out, lengths);
    return out;
}

void info_json_blocks(const struct spc_reader *r, uint32_t cluster)
{
    const struct spc_header *h = spc_reader_header(r);
    struct spc_cluster c;
    spc_reader_cluster(r, cluster, &c);
    fputs(",\n  \"block_table\": [", stdout);
    for (uint32_t k = 0; k < c.block_count && !ferror(stdout); k++) {
        struct spc_block b;
        spc_reader_block(r, c.block_first + k, &b);
        put_row(block_json(h, c.block_first + k, &b), k == 0);
    }
    fputs("\n  ]", stdout);
}
