/*
 * gen_scan.c - makes scan-like surfaces of any size as PLY: the input of tests and measurements.
 *
 *   cc -std=c11 -O2 -ffp-contract=off scripts/gen_scan.c -o gen_scan -lm
 *   gen_scan --triangles 10000000 --color -o statue.ply
 *   gen_scan --triangles 1000000 --shape terrain --double --offset 500000,5400000,100 -o hill.ply
 *   gen_scan --triangles 100000000 -o - | spc-build ...
 *
 * Here are options and output; the surfaces are in gen_shapes.h and gen_statue.h. A vertex and a face
 * are pure functions of (options, seed, number), so nothing is held in memory but one write buffer, and
 * --shuffle is a permutation of the face numbers. Each vertex is computed once.
 *
 * Same options, same bytes, on every machine and compiler with IEEE doubles: only integer hashes,
 * + - * / and sqrt, which are exactly defined; no sin, exp or pow, no fused and no fast arithmetic.
 *
 * Closed shapes share one topology, a box of m x m x h cells: two caps and 4m columns, so there is no
 * pole with needles, no seam with double vertices, and 12 triangles are the smallest. A statue is a
 * profile swept around z; the columns are angles, the caps are discs. Its face looks towards -y.
 */
#define _POSIX_C_SOURCE 200809L
#include <errno.h>
#include <fcntl.h>
#include <float.h>
#include <getopt.h>
#include <inttypes.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#if defined __FAST_MATH__ || FLT_EVAL_METHOD != 0
#error "fast or extended arithmetic would make the bytes depend on the compiler"
#endif
#ifdef __clang__
#pragma STDC FP_CONTRACT OFF
#endif

enum { EXIT_DONE = 0, EXIT_FAILED = 1, EXIT_USAGE = 2 };
enum { BUFFER_BYTES = 1 << 18, RECORD_BYTES_MAX = 256 };
#define TRIANGLES_MAX (UINT64_C(1) << 34)               /* planning stays far from overflow */
enum format { FORMAT_LE, FORMAT_BE, FORMAT_ASCII };

#include "gen_shapes.h"

struct output {
    const char *path;
    enum format format;
    bool color, wide, shuffle;
    double offset[3], scale;
    int fd;
    size_t used;
    uint8_t buffer[BUFFER_BYTES];
};

static const char usage_text[] =
    "usage: gen_scan --triangles N [options] -o OUT.ply\n"
    "  --triangles N   at least this many; rounded up to whole rows of the grid (closed shapes: 12 or more)\n"
    "  --seed S        another surface of the same kind (1)\n"
    "  --shape NAME    statue   closed bust on a pedestal, 2 units high (default)\n"
    "                  terrain  open height field of 1000 x 1000 units\n"
    "                  sphere   closed, radius 1       plane  flat, open, 2 x 2 units\n"
    "                  soup     loose small triangles in a cube, needles and zero areas among them\n"
    "  --format F      le (binary, default), be, ascii\n"
    "  --color         vertices carry red green blue\n"
    "  --double        coordinates are double instead of float; needed where --offset is large\n"
    "  --scale S       multiplies coordinates (1), before\n"
    "  --offset X,Y,Z  is added\n"
    "  --shuffle       faces in a pseudo-random order\n"
    "  -o, --output F  file to write, replaced if it is there; - is standard output\n"
    "  -h, --help      this text\n"
    "Same options, same bytes. Exit 0 done, 1 failed, 2 usage. Counts go to stderr.\n";

/* ---- output ------------------------------------------------------------------------------------- */

static bool flush(struct output *o)
{
    size_t done = 0;
    while (done < o->used) {
        const ssize_t n = write(o->fd, o->buffer + done, o->used - done);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0) {
            errno = n == 0 ? EIO : errno;
            return false;
        }
        done += (size_t)n;
    }
    o->used = 0;
    return true;
}

static uint8_t *store_u32(uint8_t *p, uint32_t v, bool be)
{
    if (be)
        v = v >> 24 | (v >> 8 & 0xff00) | (v << 8 & 0xff0000) | v << 24;
    p[0] = (uint8_t)v;
    p[1] = (uint8_t)(v >> 8);
    p[2] = (uint8_t)(v >> 16);
    p[3] = (uint8_t)(v >> 24);
    return p + 4;
}

static uint8_t *store_f32(uint8_t *p, float v, bool be)
{
    uint32_t bits;
    memcpy(&bits, &v, sizeof bits);
    return store_u32(p, bits, be);
}

static uint8_t *store_f64(uint8_t *p, double v, bool be)
{
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits);
    p = store_u32(p, (uint32_t)(be ? bits >> 32 : bits), be);
    return store_u32(p, (uint32_t)(be ? bits : bits >> 32), be);
}

static void put_text(struct output *o, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

static void put_text(struct output *o, const char *format, ...)
{
    va_list ap;
    va_start(ap, format);
    const int n = vsnprintf((char *)o->buffer + o->used, BUFFER_BYTES - o->used, format, ap);
    va_end(ap);
    o->used += n > 0 ? (size_t)n : 0;
}

static void put_vertex(struct output *o, const struct vertex *v)
{
    const bool be = o->format == FORMAT_BE;
    double x[3];
    for (int i = 0; i < 3; i++)
        x[i] = v->p[i] * o->scale + o->offset[i];
    if (o->format == FORMAT_ASCII) {
        for (int i = 0; i < 3; i++)
            put_text(o, o->wide ? "%.17g%s" : "%.9g%s", o->wide ? x[i] : (double)(float)x[i], i < 2 ? " " : "");
        if (o->color)
            put_text(o, " %u %u %u", v->rgb[0], v->rgb[1], v->rgb[2]);
        o->buffer[o->used++] = '\n';
        return;
    }
    uint8_t *p = o->buffer + o->used;
    for (int i = 0; i < 3; i++)
        p = o->wide ? store_f64(p, x[i], be) : store_f32(p, (float)x[i], be);
    for (int i = 0; i < 3 && o->color; i++)
        *p++ = v->rgb[i];
    o->used = (size_t)(p - o->buffer);
}

static void put_face(struct output *o, const uint32_t f[3])
{
    if (o->format == FORMAT_ASCII) {
        put_text(o, "3 %" PRIu32 " %" PRIu32 " %" PRIu32 "\n", f[0], f[1], f[2]);
        return;
    }
    uint8_t *p = o->buffer + o->used;
    *p++ = 3;
    for (int i = 0; i < 3; i++)
        p = store_u32(p, f[i], o->format == FORMAT_BE);
    o->used += 13;
}

static void put_header(struct output *o, const struct gen *g)
{
    static const char *const names[] = { "binary_little_endian", "binary_big_endian", "ascii" };
    const char *real = o->wide ? "double" : "float";
    put_text(o, "ply\nformat %s 1.0\n", names[o->format]);
    put_text(o, "comment gen_scan %s seed %" PRIu64 "\n", g->shape->name, g->seed);
    put_text(o, "element vertex %" PRIu64 "\n", g->vertex_count);
    put_text(o, "property %s x\nproperty %s y\nproperty %s z\n", real, real, real);
    if (o->color)
        put_text(o, "property uchar red\nproperty uchar green\nproperty uchar blue\n");
    put_text(o, "element face %" PRIu64 "\nproperty list uchar uint vertex_indices\nend_header\n", g->face_count);
}

/* ---- shuffled faces ----------------------------------------------------------------------------- */

/*
 * permute - a bijection of 0..n-1: Feistel rounds on digit pairs (l, r) of base a x b, a b >= n, which
 * add a hash of one digit to the other; results of n and more walk on along their cycle.
 */
static uint64_t permute(uint64_t x, uint64_t n, uint64_t a, uint64_t b, uint64_t key)
{
    do {
        uint64_t l = x / b, r = x % b;
        for (uint64_t round = 0; round < 3; round++) {
            l = (l + ((mix64((key + 2 * round) ^ r << 8) >> 32) * a >> 32)) % a;
            r = (r + ((mix64((key + 2 * round + 1) ^ l << 8) >> 32) * b >> 32)) % b;
        }
        x = l * b + r;
    } while (x >= n);
    return x;
}

static bool write_vertices(struct output *o, struct gen *g)
{
    struct vertex v = { { 0, 0, 0 }, { 0, 0, 0 } };
    for (uint64_t i = 0; i < g->vertex_count; i++) {
        if (o->used > BUFFER_BYTES - RECORD_BYTES_MAX && !flush(o))
            return false;
        g->shape->vertex(g, (uint32_t)i, &v);
        put_vertex(o, &v);
    }
    return true;
}

static bool write_faces(struct output *o, const struct gen *g)
{
    const uint64_t n = g->face_count, a = (uint64_t)sqrt_round((double)n), b = (n + a - 1) / a;
    for (uint64_t i = 0; i < n; i++) {
        if (o->used > BUFFER_BYTES - RECORD_BYTES_MAX && !flush(o))
            return false;
        const uint64_t f = o->shuffle ? permute(i, n, a, b, g->key) : i;
        uint32_t corner[3];
        g->shape->face(g, (uint32_t)(f / 2), (uint32_t)(f % 2), corner);
        put_face(o, corner);
    }
    return flush(o);
}

static int fail(const struct output *o, const char *what)
{
    fprintf(stderr, "gen_scan: cannot %s '%s': %s\n", what, strcmp(o->path, "-") == 0 ? "standard output" : o->path,
            strerror(errno));
    return EXIT_FAILED;
}

/* A file cut short is removed: it must not pass for a scan. Devices and pipes are left alone. */
static int write_scan(struct output *o, struct gen *g)
{
    const bool to_stdout = strcmp(o->path, "-") == 0;
    o->fd = to_stdout ? STDOUT_FILENO : open(o->path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (o->fd < 0)
        return fail(o, "open");
    put_header(o, g);
    bool ok = write_vertices(o, g) && write_faces(o, g);
    int first = ok ? 0 : errno;
    struct stat st;
    const bool plain = !to_stdout && fstat(o->fd, &st) == 0 && S_ISREG(st.st_mode);
    if (close(o->fd) != 0 && ok) {
        ok = false;
        first = errno;
    }
    if (ok)
        return EXIT_DONE;
    if (plain)
        unlink(o->path);
    errno = first;
    return fail(o, "write");
}

/* ---- options ------------------------------------------------------------------------------------ */

static int usage(const char *what, const char *value)
{
    fprintf(stderr, "gen_scan: %s '%s'; see gen_scan --help\n", what, value);
    return EXIT_USAGE;
}

static bool parse_count(const char *text, uint64_t *out)
{
    char *end;
    errno = 0;
    *out = strtoull(text, &end, 10);
    return text[0] >= '0' && text[0] <= '9' && *end == '\0' && errno == 0;
}

/* count numbers with commas between them */
static bool parse_reals(const char *text, int count, double *out)
{
    for (int i = 0; i < count; i++) {
        char *end;
        out[i] = strtod(text, &end);
        if (end == text || !isfinite(out[i]) || *end != (i + 1 < count ? ',' : '\0'))
            return false;
        text = end + 1;
    }
    return true;
}

static bool set_option(int c, const char *value, struct gen *g, struct output *o)
{
    static const char *const formats[] = { "le", "be", "ascii" };
    switch (c) {
    case 't':
        return parse_count(value, &g->triangles) && g->triangles > 0;
    case 's':
        return parse_count(value, &g->seed);
    case 'p':
        for (size_t i = 0; i < sizeof shapes / sizeof shapes[0]; i++)
            if (strcmp(value, shapes[i].name) == 0) {
                g->shape = &shapes[i];
                return true;
            }
        return false;
    case 'f':
        for (int i = FORMAT_LE; i <= FORMAT_ASCII; i++)
            if (strcmp(value, formats[i]) == 0) {
                o->format = (enum format)i;
                return true;
            }
        return false;
    case 'x':
        return parse_reals(value, 3, o->offset);
    case 'm':
        return parse_reals(value, 1, &o->scale) && o->scale > 0;
    case 'o':
        o->path = value;
        return true;
    case 'c':
        return g->color = o->color = true;
    case 'd':
        return o->wide = true;
    default:
        return o->shuffle = true;
    }
}

/* Returns -1 to go on, else the exit code. */
static int parse_options(int argc, char **argv, struct gen *g, struct output *o)
{
    static const struct option options[] = {
        { "triangles", required_argument, NULL, 't' }, { "seed", required_argument, NULL, 's' },
        { "shape", required_argument, NULL, 'p' },     { "format", required_argument, NULL, 'f' },
        { "color", no_argument, NULL, 'c' },           { "double", no_argument, NULL, 'd' },
        { "offset", required_argument, NULL, 'x' },    { "scale", required_argument, NULL, 'm' },
        { "shuffle", no_argument, NULL, 'r' },         { "output", required_argument, NULL, 'o' },
        { "help", no_argument, NULL, 'h' },            { NULL, 0, NULL, 0 },
    };
    int c;
    while ((c = getopt_long(argc, argv, "o:h", options, NULL)) != -1) {
        if (c == 'h')
            return fputs(usage_text, stdout) < 0 || fflush(stdout) != 0 ? EXIT_FAILED : EXIT_DONE;
        if (c == '?')
            return EXIT_USAGE;                          /* getopt has said why */
        if (!set_option(c, optarg, g, o))
            return usage("bad value", optarg);
    }
    if (optind < argc)
        return usage("unexpected argument", argv[optind]);
    if (g->triangles == 0)
        return usage("missing option", "--triangles N");
    if (o->path == NULL)
        return usage("missing option", "-o OUT.ply");
    return -1;
}

/* Indices are 32 bit, and no coordinate may become infinite. */
static int plan(struct gen *g, const struct output *o)
{
    if (g->triangles <= TRIANGLES_MAX)
        g->shape->plan(g);
    if (g->triangles > TRIANGLES_MAX || g->vertex_count > UINT32_MAX)
        return usage("more than 2^32 - 1 vertices for shape", g->shape->name);
    for (int i = 0; i < 3; i++)
        if (!(g->shape->extent * o->scale + fabs(o->offset[i]) <= (o->wide ? DBL_MAX : (double)FLT_MAX)))
            return usage("too large for the coordinates of type", o->wide ? "double" : "float");
    g->key = mix64(g->seed);
    for (uint32_t i = 0; i < NOISE_COUNT; i++) {
        g->noise[i].seed = (uint32_t)mix64(g->key + i);
        g->noise[i].cell[0] = INT32_MIN;                /* no cell yet */
    }
    return -1;
}

int main(int argc, char **argv)
{
    static struct gen g = { .seed = 1, .shape = &shapes[0] };
    static struct output o = { .scale = 1 };
    int code = parse_options(argc, argv, &g, &o);
    if (code < 0)
        code = plan(&g, &o);
    if (code >= 0)
        return code;
    signal(SIGPIPE, SIG_IGN);                           /* a closed pipe is a write error like others, */
    signal(SIGXFSZ, SIG_IGN);                           /* so is a limit on the size of files */
    code = write_scan(&o, &g);
    if (code == EXIT_DONE)
        fprintf(stderr, "gen_scan: %s, %" PRIu64 " vertices, %" PRIu64 " triangles\n", g.shape->name, g.vertex_count,
                g.face_count);
    return code;
}
