/*
 * bench_plots.c - three plots, drawn by gnuplot from a script that holds its own data: whoever wants them another
 * way changes the script and runs it.
 */
#include "bench_trade.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static void put_number(FILE *out, double v)
{
    if (isfinite(v))
        fprintf(out, " %.6g", v);
    else
        fputs(" NaN", out);
}

/*
 * A block of data a kind, of those that know no eps only the ends of its range: eps, ms, MB, thousands of nodes and
 * of exact ones, error of shades, error in pixels.
 */
static void put_data(const struct bench_result *r, enum bench_kind kind, FILE *out)
{
    fprintf(out, "$d%d << EOD\n", kind);
    const uint32_t count = r->options->eps_count, step = bench_is_constant(kind) && count > 1 ? count - 1 : 1;
    for (uint32_t at = 0; at < count; at += step) {
        const struct bench_mean m = bench_mean_of(r, kind, r->options->eps_px[at]);
        const double value[] = {
            r->options->eps_px[at], m.mean[BENCH_FRAME_MS], m.mean[BENCH_BYTES] / (1024 * 1024),
            m.mean[BENCH_NODES_PROCESSED] / 1e3, m.mean[BENCH_EXACT] / 1e3, m.mean[BENCH_SHADE_MEAN],
            m.max[BENCH_ERROR_MAX],
        };
        for (size_t i = 0; i < sizeof value / sizeof *value; i++)
            put_number(out, value[i]);
        fputc('\n', out);
    }
    fputs("EOD\n", out);
}

static bool has(const struct bench_result *r, enum bench_kind kind, enum bench_column column)
{
    return isfinite(bench_mean_of(r, kind, r->options->eps_px[0]).mean[column]);
}

/* A line a kind with data in that column; from the first on, labelled with eps. */
static void put_plot(const struct bench_result *r, const char *file, const char *title, const char *x_label,
                     const char *y_label, const char *using, enum bench_column column, FILE *out)
{
    bool first = true;
    fprintf(out, "\nset output '%s'\nset title '%s'\nset xlabel '%s'\nset ylabel '%s'\nplot ", file, title, x_label,
            y_label);
    for (int kind = 0; kind < BENCH_KINDS; kind++) {
        if (!r->options->kinds[kind] || !has(r, (enum bench_kind)kind, column))
            continue;
        fprintf(out, "%s$d%d using %s with linespoints lw 2 pt 7 ps 0.6 lc %d title '%s'", first ? "" : ", \\\n     ",
                kind, using, kind + 1, BENCH_KIND_NAMES[kind]);
        if (strncmp(using, "1:", 2) != 0 && (kind == BENCH_HYBRID || kind == BENCH_POINTS))
            fprintf(out, ", \\\n     $d%d using %s:1 with labels offset char 1,0.7 font ',11' notitle", kind, using);
        first = false;
    }
    fputs(first ? "NaN notitle\n" : "\n", out);
}

void bench_plots_write(const struct bench_result *r, FILE *out)
{
    static const char label[] = "mean error of shades, levels of 255";
    fputs("# gnuplot plots.gp: the trade as pictures; all figures are means over the views\n"
          "set terminal svg size 960,640 font 'sans,14' background 'white'\n"
          "set key outside right top\nset grid lc rgb '#dddddd'\nset border lc rgb '#666666'\n"
          "set autoscale noextend\nset offsets 0, graph 0.08, graph 0.08, 0\nset xrange [0:*]\n"
          "set yrange [0:*]\nset datafile missing 'NaN'\n\n", out);
    double off = 0;                 /* gnuplot warns of an empty range where all pictures are equal */
    for (size_t k = 0; k < r->row_count; k++)
        off = fmax(off, r->rows[k].value[BENCH_SHADE_MEAN]);
    if (off == 0)
        fputs("set yrange [0:1]\n\n", out);
    for (int kind = 0; kind < BENCH_KINDS; kind++)
        if (r->options->kinds[kind])
            put_data(r, (enum bench_kind)kind, out);
    put_plot(r, "error-time.svg", "error against time, at each eps in pixels", "frame, ms", label,
             "2:6", BENCH_FRAME_MS, out);
    put_plot(r, "error-bytes.svg", "error against bytes, at each eps in pixels", "blocks of a frame in the file, MB",
             label, "3:6", BENCH_SHADE_MEAN, out);
    const double *eps = r->options->eps_px;
    double least = HUGE_VAL, most = 1e-3;
    for (size_t k = 0; k < r->row_count; k++) {
        const struct bench_mean m = bench_mean_of(r, r->rows[k].kind, r->rows[k].eps_px);
        least = fmin(least, fmax(1e-3, m.mean[BENCH_NODES_PROCESSED] / 1e3));
        most = fmax(most, m.mean[BENCH_NODES_PROCESSED] / 1e3);
    }
    fprintf(out, "\nset logscale xy\nset offsets 0, 0, 0, 0\nset xrange [%g:%g]\nset yrange [%g:%g]\n", eps[0] / 1.2,
            eps[r->options->eps_count - 1] * 1.2, least / 1.3, most * 1.3);
    put_plot(r, "nodes-eps.svg", "nodes that a frame processes", "eps, px", "thousands of nodes", "1:4",
             BENCH_NODES_PROCESSED, out);
}

/* The child's: never returns. What gnuplot says goes to stderr, like all that is for people. */
static void become_gnuplot(const char *folder)
{
    char *const arguments[] = {"gnuplot", "plots.gp", NULL};
    if (chdir(folder) != 0)
        _exit(126);
    dup2(STDERR_FILENO, STDOUT_FILENO);
    execvp(arguments[0], arguments);
    _exit(errno == ENOENT ? 127 : 126);
}

int bench_plots_draw(const char *folder)
{
    int status = 0;
    fflush(NULL);
    const pid_t child = fork();
    if (child == 0)
        become_gnuplot(folder);
    while (child > 0 && waitpid(child, &status, 0) < 0 && errno == EINTR)
        ;
    if (child > 0 && WIFEXITED(status) && WEXITSTATUS(status) == 0)
        return EXIT_DONE;
    if (child > 0 && WIFEXITED(status) && WEXITSTATUS(status) == 127)
        cli_warn(folder, "no plots, for there is no gnuplot (Debian: gnuplot-nox); then run 'gnuplot plots.gp' there");
    else
        cli_warn(folder, "no plots: gnuplot failed; 'gnuplot plots.gp' there tries again");
    return EXIT_DONE;               /* the figures are there */
}
