/*
 * cli.h - what the tools share: values of options, messages, progress, exit codes.
 *
 * stdout is data, stderr is for people. Libraries never print; these do.
 */
#ifndef CLI_H
#define CLI_H

#include "spc.h"

#include <stdio.h>

enum { EXIT_DONE = 0, EXIT_FAILED = 1, EXIT_USAGE = 2, EXIT_INVALID = 3 };

/*
 * Name of the running tool, for messages; set first. Unreadable pages of mapped files become zeros,
 * standard streams that are closed stay unusable, but no other file takes their place.
 */
void cli_init(const char *tool);

/* True once a page was unreadable: nothing that was read can be called whole. */
bool cli_unreadable(void);

/* "tool: 'file': fault; remedy" on stderr. file and the remedy may be NULL. */
void cli_error(const char *file, const struct spc_error *err, const char *remedy);
/* What to do about a disk, a file or a table of files that can take no more, or NULL; full: about a full disk. */
const char *cli_disk_remedy(const struct spc_error *err, const char *full);
void cli_warn(const char *file, const char *fmt, ...) __attribute__((format(printf, 2, 3)));

/* File names come from outside: what a terminal would act on is written as '?'. */
void cli_put_name(FILE *out, const char *name);

/* "  'file': fault" on stderr, a line of a list. fault may be NULL. */
void cli_list(const char *file, const char *fault);

/* "tool: text" and a hint at --help; returns EXIT_USAGE. */
int cli_usage(const char *fmt, ...) __attribute__((format(printf, 1, 2)));

/*
 * Does what getopt_long's -h[=all], -V and '?' ask of every tool: prints help, and more where all of it is asked
 * for (NULL: there is no more), the version, or what is wrong. False: c is none of these. *code: to exit with.
 */
bool cli_common(int c, char **argv, const char *help, const char *more, int *code);

/* What a tool that reads an archive exits with. */
int cli_exit_code(enum spc_status status);

/* Flushes stdout; EXIT_FAILED with a message when that fails (a full disk), else code. */
int cli_finish(int code);

/* ---- values; false when text is not wholly a value in range ------------------------------------ */

bool cli_size(const char *text, uint64_t *bytes);           /* 512M, 1.5G, 100000; K M G are 1024 */
bool cli_u32(const char *text, uint32_t min, uint32_t max, uint32_t *out);
bool cli_double(const char *text, double *out);             /* finite */
bool cli_doubles(const char *text, double *out, int count); /* X,Y,Z */

/* Both are there, and the same file, by whatever names. */
bool cli_same_file(const char *a, const char *b);

/* What is written to the one is lost in the other: one file, there or not yet. Devices take both. */
bool cli_same_output(const char *a, const char *b);

/* ---- words ------------------------------------------------------------------------------------- */

/* Sizes with a unit (1024), counts with groups of three. Buffers of CLI_TEXT bytes. */
enum { CLI_TEXT = 32 };
const char *cli_bytes_text(uint64_t bytes, char text[CLI_TEXT]);
const char *cli_count_text(uint64_t count, char text[CLI_TEXT]);

/* ---- progress ----------------------------------------------------------------------------------- */

enum cli_progress_mode { CLI_PROGRESS_AUTO, CLI_PROGRESS_ALWAYS, CLI_PROGRESS_NEVER, CLI_PROGRESS_JSON };

/* False for a word that is no mode. */
bool cli_progress_mode(const char *word, enum cli_progress_mode *mode);

/* A phase's part of the whole time, and that of the phases before it; phase NULL ends a table. */
struct cli_share {
    const char *phase;
    double before, share;
};

/*
 * Shows phases as they advance, with rate and, by the table of shares, the time that is left: on a
 * terminal that can erase it one line, first after a second, then five times a second; always: a line
 * a change; json: an object a line on stderr. number, of: of the files of a batch, or 0.
 */
void cli_progress_begin(enum cli_progress_mode mode, const char *file, size_t number, size_t of);

/* spb_progress.fn; ctx: the table of shares, or NULL: the time that the phase takes. */
int cli_progress(void *ctx, const char *phase, uint64_t done, uint64_t total);
void cli_progress_end(void);        /* wipes the line */

/* The same at the end of a file's work; json: says how it ended, err->status SPC_OK for well. */
void cli_progress_result(const struct spc_error *err);

/*
 * From now on SIGINT, SIGTERM and SIGHUP make cli_progress return non-zero instead of ending the
 * process, unless they are ignored already; a file over the limit of sizes is an error, no signal.
 */
void cli_catch_signals(void);

/* Seconds of a clock that only goes forward. */
double cli_seconds(void);

#endif
