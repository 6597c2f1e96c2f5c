/* Points as disks: what is nearest against brute force whatever the parts are, radii, normals, odd clouds. */
#include "points.h"
#include "suite.h"
#include "surfel.h"
#include "vec.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MOST = 20000 };

struct cloud {
    uint32_t count;
    double (*xyz)[3];
    float (*normal)[3];             /* NULL: none */
};

static uint64_t state;

static double random_unit(void)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (double)(state >> 11) / 0x1p53;
}

static void random_direction(double v[3])
{
    double square;
    do {
        for (int a = 0; a < 3; a++)
            v[a] = 2 * random_unit() - 1;
        square = vec_dot(v, v);
    } while (square > 1 || square < 0.01);
    vec_scale(v, 1 / sqrt(square), v);
}

/* ---- clouds -------------------------------------------------------------------------------------- */

static void on_a_sphere(double p[3], uint32_t i)
{
    (void)i;
    random_direction(p);
}

static void in_clusters(double p[3], uint32_t i)
{
    random_direction(p);
    vec_scale(p, ldexp(1, -(int)(i % 30)) * random_unit(), p);
    p[i % 3] += (double)(i % 7);
}

static void on_a_line(double p[3], uint32_t i)
{
    const double t = i % 5 == 0 ? random_unit() : (double)i / 512;
    p[0] = t;
    p[1] = 2 * t;
    p[2] = -t;
}

static void in_rows(double p[3], uint32_t i)
{
    p[0] = (double)(i % 100) / 128;
    p[1] = (double)(i / 100) * 10 / 128;
    p[2] = 0;
}

static void on_a_lattice(double p[3], uint32_t i)
{
    p[0] = i % 12;
    p[1] = i / 12 % 12;
    p[2] = i / 144;
}

static void often_nowhere(double p[3], uint32_t i)      /* what a scanner says where nothing came back */
{
    random_direction(p);
    if (i % 3 == 0)
        memset(p, 0, 3 * sizeof *p);
    else if (i % 3 == 1)
        p[0] = floor(p[0] * 4) / 4, p[1] = floor(p[1] * 4) / 4, p[2] = 0;
}

static void in_one_place(double p[3], uint32_t i)
{
    (void)i;
    p[0] = 1;
    p[1] = 2;
    p[2] = 3;
}

static void georeferenced(double p[3], uint32_t i)
{
    random_direction(p);
    p[0] = 5e6 + (double)(i % 50) * 1e-3;
    p[1] = 4e5 + (double)(i / 50) * 1e-3;
    p[2] = 1e-4 * p[2];
}

static void one_far_away(double p[3], uint32_t i)
{
    random_direction(p);
    if (i % 500 == 0)
        vec_scale(p, 3 + (double)i, p);
}

typedef void (*point_fn)(double p[3], uint32_t i);
static const struct {
    const char *name;
    point_fn fn;
    uint32_t count;
} CLOUDS[] = {
    {"sphere", on_a_sphere, 2000},      {"clusters", in_clusters, 2000},  {"line", on_a_line, 700},
    {"rows", in_rows, 2000},            {"lattice", on_a_lattice, 1728},  {"nowhere", often_nowhere, 1500},
    {"one place", in_one_place, 900},   {"far", georeferenced, 2000},     {"outliers", one_far_away, 2000},
    {"one", on_a_sphere, 1},            {"two", on_a_sphere, 2},          {"three", on_a_sphere, 3},
    {"thirteen", on_a_sphere, 13},      {"fourteen", on_a_sphere, 14},
};
enum { CLOUD_COUNT = sizeof CLOUDS / sizeof *CLOUDS };

static struct cloud make_cloud(point_fn fn, uint32_t count)
{
    struct cloud c = {count, malloc(count * sizeof *c.xyz), NULL};
    state = count;
    for (uint32_t i = 0; i < count; i++)
        fn(c.xyz[i], i);
    return c;
}

/* ---- as the build does it ------------------------------------------------------------------------- */

static void fill_table(struct spb_vertices *v, const struct cloud *c)
{
    for (int a = 0; a < 3; a++) {
        v->min[a] = HUGE_VAL;
        v->max[a] = -HUGE_VAL;
    }
    for (uint32_t i = 0; i < c->count; i++) {
        uint8_t *at = v->table + (size_t)i * v->bytes;
        memcpy(at, c->xyz[i], 24);
        if (v->normals)
            memcpy(at + 24, c->normal[i], 12);
        memcpy(at + v->bytes - 4, &i, 4);       /* its number, as colour */
        for (int a = 0; a < 3; a++) {
            v->min[a] = fmin(v->min[a], c->xyz[i][a]);
            v->max[a] = fmax(v->max[a], c->xyz[i][a]);
        }
    }
}

/* Disks of a cloud, [count] by number, and the keys they were found by. */
static void estimate(const struct cloud *c, uint64_t part_points, unsigned threads,
                     struct spb_surfel *out, double (*keys)[4], struct spb_survey *survey)
{
    struct spb_temp temp = {.folder = getenv("TMPDIR") ? getenv("TMPDIR") : "/tmp"};
    struct spb_progress progress = {NULL, NULL};
    struct spb_vertices v = {.count = c->count, .wide = true, .colors = true, .normals = c->normal != NULL,
                             .bytes = c->normal ? 40 : 28, .table = malloc((size_t)c->count * 40)};
    const struct spb_record_format format = spb_point_format(true, true);
    struct spb_space space;
    struct spb_tmpfile *file;
    struct spb_distributor d;
    struct spb_plan plan;
    double min[3], max[3];
    fill_table(&v, c);
    spb_space_init(&space, v.min, v.max);
    for (int a = 0; a < 3; a++) {
        min[a] = spb_space_from_file(&space, a, v.min[a]);
        max[a] = spb_space_from_file(&space, a, v.max[a]);
    }
    ck_assert_int_eq(spb_tmpfile_create(&temp, &file, NULL), SPC_OK);
    ck_assert_int_eq(spb_distributor_init(&d, file, &format, min, max, part_points < c->count ? 3 : 0,
                                          1 << 22, NULL), SPC_OK);
    ck_assert_int_eq(spb_points_read(&v, &space, &d, &progress, NULL), SPC_OK);
    ck_assert_int_eq(spb_plan_make(&plan, &d, file, &space, part_points, 1 << 22, &progress, NULL), SPC_OK);
    const struct spb_points_input in = {file, &space, format, v.normals, threads, &progress};
    spb_survey_init(survey);
    ck_assert_int_eq(spb_points_estimate(&plan, &in, survey, NULL), SPC_OK);
    uint8_t *records = malloc((size_t)c->count * format.bytes);
    uint32_t seen = 0;
    for (uint32_t i = 0; i < plan.part_count; i++) {
        const uint32_t n = (uint32_t)plan.parts[i].count;
        double (*at)[4] = malloc(n * sizeof *at);
        ck_assert_int_eq(spb_part_read(&plan.parts[i], file, format.bytes, records, NULL), SPC_OK);
        spb_record_keys(&format, &space, records, n, at);
        for (uint32_t k = 0; k < n; k++, seen++) {
            const uint8_t *record = records + (size_t)k * format.bytes;
            uint32_t number;
            memcpy(&number, record + format.bytes - 4, 4);
            if (number >= c->count || memcmp(record, c->xyz[number], 24) != 0)
                ck_abort_msg("record %u of part %u is no point", k, i);
            memcpy(out[number].normal, record + 24, 12);
            memcpy(&out[number].radius, record + 36, 4);
            memcpy(keys[number], at[k], sizeof *keys);
        }
        free(at);
    }
    ck_assert_uint_eq(seen, c->count);
    free(records);
    spb_plan_release(&plan);
    spb_tmpfile_free(file);
    free(v.table);
}

/* ---- brute force ---------------------------------------------------------------------------------- */

static int by_place(const void *a, const void *b)
{
    const double *x = a, *y = b;
    for (int k = 0; k < 4; k++)
        if (x[k] != y[k])
            return x[k] < y[k] ? -1 : 1;
    return 0;
}

static void find_near(const double (*keys)[4], uint32_t count, uint32_t i, struct spb_near *near)
{
    double (*all)[4] = malloc(count * sizeof *all);
    for (uint32_t k = 0; k < count; k++) {
        double d[3];
        vec_sub(keys[k], keys[i], d);
        all[k][0] = vec_dot(d, d);
        memcpy(all[k] + 1, keys[k], 3 * sizeof(double));
    }
    qsort(all, count, sizeof *all, by_place);
    near->count = 0;
    for (uint32_t k = 0; k < count && near->count < SPB_NEAR_MAX; k++)
        if (all[k][0] > 0 && (near->count == 0 || by_place(all[k], near->at[near->count - 1]) != 0))
            memcpy(near->at[near->count++], all[k], sizeof *all);
    free(all);
}

static void check_cloud(const char *name, const struct cloud *c, uint64_t part_points, unsigned threads)
{
    struct spb_surfel *found = malloc(c->count * sizeof *found), wanted;
    double (*keys)[4] = malloc(c->count * sizeof *keys);
    struct spb_survey survey;
    uint64_t edges = 0;
    estimate(c, part_points, threads, found, keys, &survey);
    for (uint32_t i = 0; i < c->count; i++) {
        struct spb_near near;
        if (c->count > 600 && i % 13 != 0)
            continue;
        find_near((const double(*)[4])keys, c->count, i, &near);
        spb_surfel_make(keys[i], &near, NULL, &wanted);
        if (memcmp(&wanted, &found[i], sizeof wanted) != 0)
            ck_abort_msg("%s, parts of %u: point %u has radius %.9g, not %.9g, or another normal", name,
                         (unsigned)part_points, i, (double)found[i].radius, (double)wanted.radius);
        const double n[3] = {(double)found[i].normal[0], (double)found[i].normal[1],
                             (double)found[i].normal[2]};
        if (!(found[i].radius > 0) || fabs(vec_length(n) - 1) > 1e-6)
            ck_abort_msg("%s: point %u is no disk", name, i);
    }
    for (int i = 0; i < SPB_EDGE_BINS; i++)
        edges += survey.edge_bins[i];
    ck_assert_uint_eq(edges, c->count);
    free(keys);
    free(found);
}

START_TEST(what_is_near_is_what_brute_force_finds)
{
    static const uint32_t parts[] = {UINT32_MAX, 400, 60, 8};
    for (int i = 0; i < CLOUD_COUNT; i++) {
        struct cloud c = make_cloud(CLOUDS[i].fn, CLOUDS[i].count);
        for (unsigned p = 0; p < 4; p++)
            check_cloud(CLOUDS[i].name, &c, parts[p], p == 0 ? 1 : 3);
        free(c.xyz);
    }
}
END_TEST

/* ---- disks ---------------------------------------------------------------------------------------- */

static struct spb_surfel *disks_of(const struct cloud *c, double *unit)
{
    struct spb_surfel *out = malloc(c->count * sizeof *out);
    double (*keys)[4] = malloc(c->count * sizeof *keys);
    struct spb_survey survey;
    struct spb_space space;
    double min[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, max[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (uint32_t i = 0; i < c->count; i++)
        for (int a = 0; a < 3; a++) {
            min[a] = fmin(min[a], c->xyz[i][a]);
            max[a] = fmax(max[a], c->xyz[i][a]);
        }
    spb_space_init(&space, min, max);
    *unit = ldexp(1, space.unit_exp);
    estimate(c, 5000, 2, out, keys, &survey);
    free(keys);
    return out;
}

START_TEST(normals_of_a_sphere_are_its_radii)
{
    struct cloud c = make_cloud(on_a_sphere, 20000);
    double unit, worst = 1, mean = 0;
    struct spb_surfel *disks = disks_of(&c, &unit);
    for (uint32_t i = 0; i < c.count; i++) {
        double dot = 0;
        for (int a = 0; a < 3; a++)
            dot += (double)disks[i].normal[a] * c.xyz[i][a];
        worst = fmin(worst, fabs(dot));
        mean += acos(fmin(1, fabs(dot))) / c.count;
    }
    ck_assert_double_lt(mean, 0.5 * 3.14159265 / 180);
    ck_assert_double_gt(worst, cos(8 * 3.14159265 / 180));
    free(disks);
    free(c.xyz);
}
END_TEST

/* A plane of unit steps: 12 places are within 2, as many on a plane of rows of ten within 10. */
START_TEST(disks_cover_a_plane_and_rows)
{
    struct cloud c = {2500, malloc(2500 * sizeof *c.xyz), NULL};
    double unit;
    for (uint32_t i = 0; i < 2500; i++)
        memcpy(c.xyz[i], (double[3]){i % 50, i / 50, 0}, sizeof *c.xyz);
    struct spb_surfel *disks = disks_of(&c, &unit);
    for (uint32_t i = 0; i < 2500; i++) {
        const bool inside = i % 50 > 1 && i % 50 < 48 && i / 50 > 1 && i / 50 < 48;
        const double radius = (double)disks[i].radius * unit;
        if (!(radius > 0.7072 && (!inside || radius < 1.2)) || fabs((double)disks[i].normal[2]) < 0.999999)
            ck_abort_msg("point %u of a plane has radius %g", i, radius);
    }
    free(disks);
    for (uint32_t i = 0; i < 2500; i++)
        c.xyz[i][1] *= 10;
    disks = disks_of(&c, &unit);
    for (uint32_t i = 0; i < 2500; i++) {
        const double radius = (double)disks[i].radius * unit;
        if (!(radius > 5.0249 && radius < 6.001) || fabs((double)disks[i].normal[2]) < 0.999999)
            ck_abort_msg("point %u of rows has radius %g", i, radius);
    }
    free(disks);
    free(c.xyz);
}
END_TEST

START_TEST(an_outlier_is_no_giant)
{
    struct cloud c = make_cloud(on_a_sphere, 10000);
    double unit, mean = 0;
    memcpy(c.xyz[77], (double[3]){900, 0, 0}, sizeof *c.xyz);
    struct spb_surfel *disks = disks_of(&c, &unit);
    for (uint32_t i = 0; i < c.count; i++)
        mean += (double)disks[i].radius / c.count;
    ck_assert_double_lt((double)disks[77].radius, 8 * mean);
    ck_assert_double_gt((double)disks[77].radius, mean);
    free(disks);
    free(c.xyz);
}
END_TEST

START_TEST(normals_of_the_file_are_kept_where_they_are_some)
{
    struct cloud c = make_cloud(on_a_sphere, 3000), plain = c;
    double unit;
    struct spb_surfel *estimated = disks_of(&plain, &unit);
    c.normal = malloc(c.count * sizeof *c.normal);
    for (uint32_t i = 0; i < c.count; i++)
        memcpy(c.normal[i], (float[3]){3e30f, 0, -4e30f}, sizeof *c.normal);
    memcpy(c.normal[1], (float[3]){0, 0, 0}, sizeof *c.normal);
    memcpy(c.normal[2], (float[3]){NAN, 0, 1}, sizeof *c.normal);
    memcpy(c.normal[3], (float[3]){0, INFINITY, 1}, sizeof *c.normal);
    memcpy(c.normal[4], (float[3]){1e-40f, 0, 0}, sizeof *c.normal);
    struct spb_surfel *disks = disks_of(&c, &unit);
    for (uint32_t i = 0; i < c.count; i++) {
        ck_assert_mem_eq(&disks[i].radius, &estimated[i].radius, 4);
        if (i >= 1 && i <= 3)
            ck_assert_mem_eq(&disks[i], &estimated[i], sizeof *disks);
        else if (fabsf(disks[i].normal[0] - (i == 4 ? 1.0f : 0.6f)) > 1e-6f)
            ck_abort_msg("normal %u is not the file's", i);
    }
    free(disks);
    free(estimated);
    free(c.normal);
    free(c.xyz);
}
END_TEST

START_TEST(scaling_by_a_power_of_two_changes_nothing)
{
    static const int exponents[] = {-100, -1, 3, 100};
    for (int k = 0; k < 9; k++) {
        struct cloud c = make_cloud(CLOUDS[k].fn, 900);
        double unit;
        struct spb_surfel *first = disks_of(&c, &unit);
        for (int e = 0; e < 4; e++) {
            struct cloud scaled = {c.count, malloc(c.count * sizeof *c.xyz), NULL};
            for (uint32_t i = 0; i < c.count; i++)
                for (int a = 0; a < 3; a++)
                    scaled.xyz[i][a] = ldexp(c.xyz[i][a], exponents[e]);
            struct spb_surfel *disks = disks_of(&scaled, &unit);
            ck_assert_msg(memcmp(disks, first, c.count * sizeof *disks) == 0, "%s at 2^%d", CLOUDS[k].name,
                          exponents[e]);
            free(disks);
            free(scaled.xyz);
        }
        free(first);
        free(c.xyz);
    }
}
END_TEST

/* The triangle that a record stands for. */
START_TEST(corners_are_an_equilateral_triangle_around_the_point)
{
    struct spb_space space = {.unit_exp = 5};
    state = 1;
    for (int i = 0; i < 2000; i++) {
        const bool wide = i % 2;
        const struct spb_record_format format = spb_point_format(wide, false);
        double n[3], corner[9], at[3] = {0.5, -3, 8}, cross[3], u[3], v[3];
        random_direction(n);
        if (i < 12)
            memcpy(n, (double[3]){i % 6 == 0, i % 6 == 1, (i % 6 == 2) - (i % 6 > 2)}, sizeof n);
        const float narrow[3] = {0.5f, -3, 8}, rest[4] = {(float)n[0], (float)n[1], (float)n[2], 0.25f};
        uint8_t record[44];
        memcpy(record, wide ? (const void *)at : narrow, wide ? 24 : 12);
        memcpy(record + spb_point_normal(&format), rest, sizeof rest);
        spb_point_corners(&format, &space, record, corner);
        for (int k = 0; k < 3; k++) {
            if (fabs(vec_distance(corner + 3 * k, at) - 8) > 1e-5 ||
                fabs(vec_distance(corner + 3 * k, corner + 3 * ((k + 1) % 3)) - 8 * sqrt(3)) > 1e-5)
                ck_abort_msg("corner %d of disk %d is off", k, i);
        }
        vec_sub(corner + 3, corner, u);
        vec_sub(corner + 6, corner, v);
        vec_cross(u, v, cross);
        if (!(vec_dot(cross, n) > 0.99999 * vec_length(cross)))
            ck_abort_msg("disk %d does not lie across its normal", i);
    }
}
END_TEST

/* ---- from a file ---------------------------------------------------------------------------------- */

static struct spb_vertex_batch batch;           /* large: not for the stack */

static void check_file(const char *text, bool normals)
{
    char path[] = "/tmp/points_XXXXXX";
    const int fd = mkstemp(path);
    struct spb_source *source;
    ck_assert_int_ge(fd, 0);
    FILE *f = fdopen(fd, "w");
    fputs(text, f);
    ck_assert_int_eq(fclose(f), 0);
    ck_assert_int_eq(spb_source_open(path, NULL, &source, NULL), SPC_OK);
    unlink(path);
    ck_assert_int_eq(spb_source_info(source)->normals, normals);
    ck_assert_int_eq(spb_source_begin_vertices(source, NULL), SPC_OK);
    ck_assert_int_eq(spb_source_vertices(source, &batch, NULL), SPC_OK);
    ck_assert_uint_eq(batch.count, 2);
    for (int i = 0; i < 2 && normals; i++)
        for (int a = 0; a < 3; a++)
            ck_assert_float_eq(batch.normal[i][a], (float)(10 * (i + 1) + a));
    ck_assert_double_eq(batch.xyz[1][2], 6);
    spb_source_close(source);
}

START_TEST(normals_are_read_of_points_alone)
{
    check_file("ply\nformat ascii 1.0\nelement vertex 2\nproperty float nx\nproperty float x\nproperty float y\n"
               "property float z\nproperty float ny\nproperty double nz\nend_header\n"
               "10 1 2 3 11 12\n20 4 5 6 21 22\n", true);
    check_file("ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
               "property float normal_x\nproperty float normal_y\nproperty float normal_z\nelement face 0\n"
               "property list uchar int vertex_indices\nend_header\n1 2 3 10 11 12\n4 5 6 20 21 22\n", true);
    check_file("ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
               "property float nx\nproperty float ny\nproperty float nz\nelement face 1\n"
               "property list uchar int vertex_indices\nend_header\n1 2 3 10 11 12\n4 5 6 20 21 22\n3 0 1 0\n",
               false);
    check_file("ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
               "property float nx\nproperty float ny\nend_header\n1 2 3 10 11\n4 5 6 20 21\n", false);
}
END_TEST

int main(void)
{
    return SUITE("points", NULL, NULL, what_is_near_is_what_brute_force_finds,
                 normals_of_a_sphere_are_its_radii, disks_cover_a_plane_and_rows, an_outlier_is_no_giant,
                 normals_of_the_file_are_kept_where_they_are_some, scaling_by_a_power_of_two_changes_nothing,
                 corners_are_an_equilateral_triangle_around_the_point, normals_are_read_of_points_alone);
}
