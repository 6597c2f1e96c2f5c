#define _GNU_SOURCE                 /* MAP_ANONYMOUS, SIGXFSZ */
#include "cli.h"

#include <errno.h>
#include <fcntl.h>
#include <getopt.h>
#include <jansson.h>
#include <malloc.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

static const char *tool_name = "spc";

/*
 * A page of a mapped file that cannot be read (a failing disk, a file that was cut short) raises
 * SIGBUS. It becomes zeros: checksums then find what is missing, and --recover goes on behind it.
 */
static volatile sig_atomic_t unreadable;

static void on_unreadable(int number, siginfo_t *info, void *context)
{
    const uintptr_t page = (uintptr_t)sysconf(_SC_PAGESIZE);
    void *at = (void *)((uintptr_t)info->si_addr / page * page);
    const int saved = errno;
    (void)context;
    if (info->si_code != BUS_ADRERR ||
        mmap(at, page, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1, 0) == MAP_FAILED)
        signal(number, SIG_DFL);    /* the access comes again, and ends the process */
    unreadable = 1;
    errno = saved;
}

/*
 * glibc would answer ever larger requests from heaps that it keeps a thread, and lose as much to gaps
 * as is in use: --memory would not hold. Large buffers go back to the system when they are freed.
 */
static void give_memory_back(void)
{
#ifdef M_MMAP_THRESHOLD
    enum { LARGE = 4 << 20 };
    mallopt(M_MMAP_THRESHOLD, LARGE);
#endif
}

/*
 * Where standard streams are closed, the next files that are opened take their numbers: messages would
 * go into the archive. Reading or writing what stands in for them fails, as it would have; messages vanish.
 */
static void fill_standard_streams(void)
{
    static const int modes[] = {O_WRONLY, O_RDONLY, O_WRONLY};
    for (int fd = 0; fd < 3; fd++)
        if (fcntl(fd, F_GETFD) < 0 && errno == EBADF)
            (void)open("/dev/null", modes[fd]);         /* the lowest number that is free: this one */
}

void cli_init(const char *tool)
{
    struct sigaction action = {.sa_flags = SA_SIGINFO};
    tool_name = tool;
    fill_standard_streams();
    give_memory_back();
    action.sa_sigaction = on_unreadable;
    sigemptyset(&action.sa_mask);
    sigaction(SIGBUS, &action, NULL);
    signal(SIGXFSZ, SIG_IGN);       /* the write fails instead */
}

bool cli_unreadable(void)
{
    return unreadable != 0;
}

void cli_put_name(FILE *out, const char *name)
{
    for (; *name; name++)
        fputc((unsigned char)*name < 0x20 || *name == 0x7F ? '?' : *name, out);
}

static void put_head(const char *file)
{
    cli_progress_end();
    fprintf(stderr, "%s: ", tool_name);
    if (file != NULL) {
        fputc('\'', stderr);
        cli_put_name(stderr, file);
        fputs("': ", stderr);
    }
}

void cli_error(const char *file, const struct spc_error *err, const char *remedy)
{
    put_head(file);
    if (unreadable && err->status != SPC_IO && err->status != SPC_NO_MEMORY) {
        fputs("part of it cannot be read: the disk fails, or it was cut short\n", stderr);
        return;
    }
    fputs(err->what[0] ? err->what : spc_status_text(err->status), stderr);
    if (err->at_off != SPC_NO_OFF && err->at_off != 0)
        fprintf(stderr, " (byte %llu)", (unsigned long long)err->at_off);
    if (remedy != NULL)
        fprintf(stderr, "; %s", remedy);
    fputc('\n', stderr);
}

const char *cli_disk_remedy(const struct spc_error *err, const char *full)
{
    switch (err->os_errno) {
    case ENOSPC:
    case EDQUOT: return full;
    case EMFILE: return "fewer scans at once, or a higher 'ulimit -n'";
    case EFBIG: return "files of that size are not allowed here, see 'ulimit -f'";
    default: return NULL;
    }
}

void cli_warn(const char *file, const char *fmt, ...)
{
    va_list args;
    put_head(file);
    fputs("warning: ", stderr);
    va_start(args, fmt);
    vfprintf(stderr, fmt, args);
    va_end(args);
    fputc('\n', stderr);
}

void cli_list(const char *file, const char *fault)
{
    fputs("  '", stderr);
    cli_put_name(stderr, file);
    fprintf(stderr, "'%s%s\n", fault != NULL ? ": " : "", fault != NULL ? fault : "");
}

int cli_usage(const char *fmt, ...)
{
    va_list args;
    put_head(NULL);
    va_start(args, fmt);
    vfprintf(stderr, fmt, args);
    va_end(args);
    fprintf(stderr, "; '%s --help' lists the options\n", tool_name);
    return EXIT_USAGE;
}

bool cli_common(int c, char **argv, const char *help, const char *more, int *code)
{
    if (c == '?') {
        *code = cli_usage("'%s' is no option, or lacks its value", argv[optind - 1]);
    } else if (c == 'V') {
        printf("%s %s\n", tool_name, SPC_TOOL_VERSION);
        *code = cli_finish(EXIT_DONE);
    } else if (c == 'h' && more != NULL && optarg != NULL && strcmp(optarg, "all") != 0) {
        *code = cli_usage("--help takes all, or nothing, not '%s'", optarg);
    } else if (c == 'h') {
        fputs(help, stdout);
        if (more != NULL && optarg != NULL)
            fputs(more, stdout);
        *code = cli_finish(EXIT_DONE);
    } else {
        return false;
    }
    return true;
}

int cli_exit_code(enum spc_status status)
{
    const bool invalid = status >= SPC_NOT_SPC && status < SPC_INPUT_FORMAT && status != SPC_FEATURE;
    return status == SPC_OK ? EXIT_DONE : invalid ? EXIT_INVALID : EXIT_FAILED;
}

int cli_finish(int code)
{
    if (fflush(stdout) == 0 && !ferror(stdout))
        return code;
    fprintf(stderr, "%s: cannot write to standard output: %s\n", tool_name, strerror(errno));
    return code == EXIT_DONE ? EXIT_FAILED : code;
}

/* ---- values ------------------------------------------------------------------------------------ */

bool cli_double(const char *text, double *out)
{
    char *end = NULL;
    if (*text == '\0' || strchr(" \t\n", *text) != NULL)
        return false;
    *out = strtod(text, &end);
    return *end == '\0' && isfinite(*out);
}

bool cli_doubles(const char *text, double *out, int count)
{
    char copy[256];
    char *at = copy;
    if (strlen(text) >= sizeof copy)
        return false;
    strcpy(copy, text);
    for (int i = 0; i < count; i++) {
        char *comma = strchr(at, ',');
        if ((comma == NULL) != (i == count - 1))
            return false;
        if (comma != NULL)
            *comma = '\0';
        if (!cli_double(at, &out[i]))
            return false;
        at = comma + 1;
    }
    return true;
}

bool cli_same_file(const char *a, const char *b)
{
    struct stat x, y;
    return stat(a, &x) == 0 && stat(b, &y) == 0 && x.st_dev == y.st_dev && x.st_ino == y.st_ino;
}

/* The folder that a name is in. */
static bool folder_of(const char *path, size_t name, struct stat *out)
{
    char *folder = name > 0 ? strndup(path, name) : strdup(".");
    const bool there = folder != NULL && stat(folder, out) == 0;
    free(folder);
    return there;
}

bool cli_same_output(const char *a, const char *b)
{
    struct stat x, y;
    const bool a_there = stat(a, &x) == 0, b_there = stat(b, &y) == 0;
    const char *a_slash = strrchr(a, '/'), *b_slash = strrchr(b, '/');
    const size_t a_name = a_slash != NULL ? (size_t)(a_slash + 1 - a) : 0;
    const size_t b_name = b_slash != NULL ? (size_t)(b_slash + 1 - b) : 0;
    if (a_there && b_there)
        return S_ISREG(x.st_mode) && cli_same_file(a, b);
    return !a_there && !b_there && strcmp(a + a_name, b + b_name) == 0 && folder_of(a, a_name, &x) &&
           folder_of(b, b_name, &y) && x.st_dev == y.st_dev && x.st_ino == y.st_ino;
}

bool cli_size(const char *text, uint64_t *bytes)
{
    static const char units[] = "KMGT";
    char number[64];
    const size_t length = strlen(text);
    double value = 0, factor = 1;
    if (length == 0 || length >= sizeof number)
        return false;
    strcpy(number, text);
    const char *unit = strchr(units, number[length - 1] & ~0x20);
    if (unit != NULL && *unit != '\0') {
        factor = ldexp(1, 10 * (int)(unit - units + 1));
        number[length - 1] = '\0';
    }
    if (!cli_double(number, &value) || !(value >= 0) || !(value * factor < 0x1p63))
        return false;
    *bytes = (uint64_t)(value * factor);
    return true;
}

bool cli_u32(const char *text, uint32_t min, uint32_t max, uint32_t *out)
{
    char *end = NULL;
    if (*text < '0' || *text > '9')
        return false;
    errno = 0;
    const unsigned long long v = strtoull(text, &end, 10);
    if (*end != '\0' || errno != 0 || v < min || v > max)
        return false;
    *out = (uint32_t)v;
    return true;
}

/* ---- words ------------------------------------------------------------------------------------- */

const char *cli_bytes_text(uint64_t bytes, char text[CLI_TEXT])
{
    static const char *const units[] = {"B", "KB", "MB", "GB", "TB"};
    double v = (double)bytes;
    int u = 0;
    while (v >= 1023.5 && u < 4) {
        v /= 1024;
        u++;
    }
    snprintf(text, CLI_TEXT, u == 0 || v >= 99.95 ? "%.0f %s" : v >= 9.995 ? "%.1f %s" : "%.2f %s", v,
             units[u]);
    return text;
}

const char *cli_count_text(uint64_t count, char text[CLI_TEXT])
{
    char digits[CLI_TEXT];
    const int n = snprintf(digits, sizeof digits, "%llu", (unsigned long long)count);
    int at = 0;
    for (int i = 0; i < n; i++) {
        if (i > 0 && (n - i) % 3 == 0)
            text[at++] = ' ';
        text[at++] = digits[i];
    }
    text[at] = '\0';
    return text;
}

/* ---- progress ---------------------------------------------------------------------------------- */

static struct {
    enum cli_progress_mode mode;
    const char *file, *phase;
    size_t number, of;
    double began, phase_began, shown;
    double overall;                 /* share of the work that is done; does not go back */
    bool line;                      /* something stands on the terminal's line */
} progress = {.mode = CLI_PROGRESS_NEVER};

static volatile sig_atomic_t stopped;

static void on_signal(int number)
{
    (void)number;
    stopped = 1;
}

void cli_catch_signals(void)
{
    static const int numbers[] = {SIGINT, SIGTERM, SIGHUP};
    struct sigaction action = {.sa_handler = on_signal}, before;
    sigemptyset(&action.sa_mask);
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)   /* nohup and & have some ignored */
        if (sigaction(numbers[i], NULL, &before) == 0 && before.sa_handler != SIG_IGN)
            sigaction(numbers[i], &action, NULL);
}

double cli_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

bool cli_progress_mode(const char *word, enum cli_progress_mode *mode)
{
    static const char *const words[] = {"auto", "always", "never", "json"};
    for (int i = 0; i < 4; i++)
        if (strcmp(word, words[i]) == 0) {
            *mode = (enum cli_progress_mode)i;
            return true;
        }
    return false;
}

/* A line that is drawn again and again needs a terminal that can erase it; an editor's shell cannot. */
static bool can_erase(void)
{
    const char *term = getenv("TERM");
    return isatty(STDERR_FILENO) && term != NULL && *term != '\0' && strcmp(term, "dumb") != 0;
}

void cli_progress_begin(enum cli_progress_mode mode, const char *file, size_t number, size_t of)
{
    if (mode == CLI_PROGRESS_AUTO)
        mode = can_erase() ? CLI_PROGRESS_AUTO : CLI_PROGRESS_NEVER;
    progress.mode = mode;
    progress.file = file;
    progress.number = number;
    progress.of = of;
    progress.phase = NULL;
    progress.began = cli_seconds();
    progress.shown = progress.overall = 0;
    progress.line = false;
}

/* A name as JSON; null when it is no UTF-8. */
static void put_quoted(const char *name)
{
    json_t *json = json_string(name);
    char *text = json_dumps(json, JSON_ENCODE_ANY);
    fputs(text != NULL ? text : "null", stderr);
    free(text);
    json_decref(json);
}

static void put_scan(void)
{
    fputs("{\"scan\":", stderr);
    put_quoted(progress.file);
    if (progress.of > 0)
        fprintf(stderr, ",\"number\":%zu,\"of\":%zu", progress.number, progress.of);
}

static void show_json(const char *phase, uint64_t done, uint64_t total, double now)
{
    put_scan();
    fprintf(stderr, ",\"phase\":\"%s\",\"done\":%llu,\"total\":%llu,\"overall\":%.3f,\"seconds\":%.1f}\n", phase,
            (unsigned long long)done, (unsigned long long)total, progress.overall,
            now - progress.began);
}

/* Phases that count bytes; others count parts, blocks, points or rows of pictures. */
static bool counts_bytes(const char *phase)
{
    static const char *const phases[] = {"copy pipe", "count", "read vertices", "read faces", "search"};
    for (size_t i = 0; i < sizeof phases / sizeof *phases; i++)
        if (strcmp(phase, phases[i]) == 0)
            return true;
    return false;
}

/* A line of progress; what does not fit is left out. */
struct line {
    char text[160];
    size_t length;
};

static void add(struct line *line, const char *fmt, ...) __attribute__((format(printf, 2, 3)));

static void add(struct line *line, const char *fmt, ...)
{
    const size_t room = sizeof line->text - line->length;
    va_list args;
    va_start(args, fmt);
    const int n = vsnprintf(line->text + line->length, room, fmt, args);
    va_end(args);
    line->length += n < 0 ? 0 : (size_t)n < room ? (size_t)n : room - 1;
}

static void add_left(struct line *line, double left)
{
    if (left < 99.5)
        add(line, ", about %.0f s left", left);
    else if (left < 99.5 * 60)
        add(line, ", about %.0f min left", left / 60);
    else
        add(line, ", about %.1f h left", left / 3600);
}

/* A line that a narrow terminal breaks could not be erased: its end is cut, one column is left free. */
static void put_erasable(struct line *line)
{
    struct winsize size;
    if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 && line->length >= size.ws_col)
        line->text[size.ws_col - 1] = '\0';
    fprintf(stderr, "\r%s\033[K", line->text);
    progress.line = true;
}

static void show(const char *phase, uint64_t done, uint64_t total, double now)
{
    char text[CLI_TEXT];
    struct line line = {.length = 0};
    const double spent = now - progress.phase_began;
    const double elapsed = now - progress.began;
    if (progress.of > 0)
        add(&line, "[%zu/%zu] ", progress.number, progress.of);
    else
        add(&line, "%s: ", tool_name);
    if (total > 0)
        add(&line, "%s %.0f %%", phase, 100 * (double)done / (double)total);
    else
        add(&line, "%s %s", phase, cli_bytes_text(done, text));
    if (spent > 0.5 && done > 0 && counts_bytes(phase))
        add(&line, ", %s/s", cli_bytes_text((uint64_t)((double)done / spent), text));
    if (elapsed > 1 && progress.overall > 0.01)
        add_left(&line, elapsed / progress.overall - elapsed);
    if (progress.mode == CLI_PROGRESS_AUTO)
        put_erasable(&line);
    else
        fprintf(stderr, "%s\n", line.text);
}

static double share_of_all(const struct cli_share *shares, const char *phase, double done)
{
    for (; shares != NULL && shares->phase != NULL; shares++)
        if (strcmp(shares->phase, phase) == 0)
            return shares->before + shares->share * done;
    return shares != NULL ? 0 : done;
}

int cli_progress(void *ctx, const char *phase, uint64_t done, uint64_t total)
{
    if (stopped)
        return 1;
    if (progress.mode == CLI_PROGRESS_NEVER)
        return 0;
    const double now = cli_seconds();
    const bool changed = progress.phase == NULL || strcmp(progress.phase, phase) != 0;
    if (changed) {
        progress.phase = phase;
        progress.phase_began = now;
        if (ctx == NULL)
            progress.overall = 0;
    }
    progress.overall = fmax(progress.overall,
                            share_of_all(ctx, phase, total > 0 ? (double)done / (double)total : 0));
    const bool quiet = progress.mode == CLI_PROGRESS_AUTO
        ? now - progress.began < 1 || now - progress.shown < 0.2
        : !changed && now - progress.shown < 1;
    if (!quiet) {
        progress.shown = now;
        if (progress.mode == CLI_PROGRESS_JSON)
            show_json(phase, done, total, now);
        else
            show(phase, done, total, now);
    }
    return 0;
}

void cli_progress_end(void)
{
    if (progress.line)
        fputs("\r\033[K", stderr);
    progress.line = false;
}

void cli_progress_result(const struct spc_error *err)
{
    cli_progress_end();
    if (progress.mode != CLI_PROGRESS_JSON)
        return;
    put_scan();
    fprintf(stderr, ",\"result\":\"%s\"", err->status == SPC_OK ? "done" : "failed");
    if (err->status != SPC_OK) {
        fprintf(stderr, ",\"status\":\"%s\",\"error\":", spc_status_name(err->status));
        put_quoted(err->what);
    }
    fprintf(stderr, ",\"seconds\":%.1f}\n", cli_seconds() - progress.began);
}
