/* The spec's byte tables against layout.h, both ways, and records against their own gaps. */
#include "layout.h"
#include "suite.h"

#include <ctype.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

struct row {
    const char *name;
    int off, bytes;
};

struct table {
    const char *name, *prefix;
    int size;
    const struct row *rows;
    size_t count;
};

#define X(name, off, bytes) {#name, off, bytes},
static const struct row HEADER[] = {SPC_HEADER_LAYOUT(X)};
static const struct row SECTION[] = {SPC_SECTION_LAYOUT(X)};
static const struct row CLUSTER[] = {SPC_CLUSTER_LAYOUT(X)};
static const struct row TOP[] = {SPC_TOP_LAYOUT(X)};
static const struct row BLOCK[] = {SPC_BLOCK_LAYOUT(X)};
static const struct row CHUNK[] = {SPC_CHUNK_LAYOUT(X)};
static const struct row NODE[] = {SPC_NODE_LAYOUT(X)};
static const struct row COLUMNS[] = {SPC_COLUMNS_LAYOUT(X)};
#undef X

#define TABLE(name, prefix, size, rows) {name, prefix, size, rows, sizeof rows / sizeof *rows}
static const struct table TABLES[] = {
    TABLE("header", "HD_", HD_SIZE, HEADER), TABLE("section", "SE_", SE_SIZE, SECTION),
    TABLE("cluster", "CL_", CL_SIZE, CLUSTER), TABLE("top", "TP_", TP_SIZE, TOP),
    TABLE("block", "BL_", BL_SIZE, BLOCK), TABLE("chunk header", "CH_", CH_SIZE, CHUNK),
    TABLE("node", "ND_", ND_SIZE, NODE), TABLE("prelude", "CO_", CO_SIZE, COLUMNS),
};

START_TEST(fields_tile_their_records)
{
    for (size_t t = 0; t < sizeof TABLES / sizeof *TABLES; t++) {
        int at = 0;
        for (size_t i = 0; i < TABLES[t].count; i++) {
            if (TABLES[t].rows[i].off != at)
                ck_abort_msg("%s begins at %d, not %d", TABLES[t].rows[i].name,
                             TABLES[t].rows[i].off, at);
            at += TABLES[t].rows[i].bytes;
        }
        ck_assert_int_eq(at, TABLES[t].size);
    }
}
END_TEST

static bool find_line(FILE *spec, char *line, int size, const char *begin)
{
    while (fgets(line, size, spec))
        if (strncmp(line, begin, strlen(begin)) == 0)
            return true;
    return false;
}

/* One row "| off | bytes | name | ..." of the spec against the row of layout.h. */
static void compare_row(const struct table *t, const struct row *row, const char *line)
{
    int off = -1, bytes = -1;
    char name[64] = "", upper[80];
    if (sscanf(line, "| %d | %d | %63[a-z_0-9] |", &off, &bytes, name) != 3)
        ck_abort_msg("table %s of the spec has no row for %s: %s", t->name, row->name, line);
    snprintf(upper, sizeof upper, "%s%s", t->prefix, name);
    for (char *c = upper; *c; c++)
        *c = (char)toupper(*c);
    ck_assert_str_eq(upper, row->name);
    ck_assert_int_eq(off, row->off);
    ck_assert_int_eq(bytes, row->bytes);
}

START_TEST(the_spec_has_the_same_tables)
{
    for (size_t i = 0; i < sizeof TABLES / sizeof *TABLES; i++) {
        const struct table *t = &TABLES[i];
        char begin[64], line[400];
        FILE *spec = fopen("spec/spc-1.md", "r");
        ck_assert_msg(spec != NULL, "run from the top of the tree");
        snprintf(begin, sizeof begin, "Table \"%s\", %d bytes", t->name, t->size);
        ck_assert_msg(find_line(spec, line, sizeof line, begin), "no %s", begin);
        ck_assert(find_line(spec, line, sizeof line, "|---"));
        for (size_t r = 0; r < t->count; r++) {
            ck_assert_ptr_nonnull(fgets(line, sizeof line, spec));
            compare_row(t, &t->rows[r], line);
        }
        ck_assert_ptr_nonnull(fgets(line, sizeof line, spec));
        ck_assert_msg(line[0] != '|', "table %s of the spec goes on: %s", t->name, line);
        fclose(spec);
    }
}
END_TEST

int main(void)
{
    return SUITE("layout", NULL, NULL, fields_tile_their_records, the_spec_has_the_same_tables);
}
