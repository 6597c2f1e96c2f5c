#include "build_scans.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

static enum spc_status no_memory(struct spc_error *err)
{
    return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for the list of scans");
}

/* Takes the name over. */
static enum spc_status append(struct build_scans *s, char *name, struct spc_error *err)
{
    if (name != NULL && s->count == s->room) {
        const size_t room = s->room ? 2 * s->room : 16;
        char **path = realloc(s->path, room * sizeof *path);
        if (path != NULL) {
            s->path = path;
            s->room = room;
        }
    }
    if (name == NULL || s->count == s->room) {
        free(name);
        return no_memory(err);
    }
    s->from_stdin |= strcmp(name, "-") == 0;
    s->path[s->count++] = name;
    return SPC_OK;
}

static char *joined(const char *folder, const char *name)
{
    const size_t n = strlen(folder) + strlen(name) + 2;
    char *path = malloc(n);
    if (path != NULL)
        snprintf(path, n, "%s%s%s", folder, folder[strlen(folder) - 1] == '/' ? "" : "/", name);
    return path;
}

/* ---- folders ----------------------------------------------------------------------------------- */

static bool named_as_scan(const char *name)
{
    static const char *const endings[] = {".ply", ".obj", ".stl", ".off"};
    const char *dot = strrchr(name, '.');
    if (name[0] == '.' || dot == NULL)
        return false;
    for (size_t i = 0; i < sizeof endings / sizeof *endings; i++)
        if (strcasecmp(dot, endings[i]) == 0)
            return true;
    return false;
}

static enum spc_status add_entry(struct build_scans *s, const char *folder, const char *name,
                                 struct spc_error *err)
{
    struct stat st;
    char *path = joined(folder, name);
    if (path == NULL)
        return no_memory(err);
    if (stat(path, &st) == 0 && S_ISDIR(st.st_mode)) {
        free(path);                 /* folders in folders have to be named */
        return SPC_OK;
    }
    if (named_as_scan(name))
        return append(s, path, err);
    s->passed_over += name[0] != '.';
    free(path);
    return SPC_OK;
}

static int by_name(const void *a, const void *b)
{
    return strcmp(*(char *const *)a, *(char *const *)b);
}

static enum spc_status add_folder(struct build_scans *s, const char *folder, struct spc_error *err)
{
    const size_t before = s->count;
    enum spc_status status = SPC_OK;
    DIR *dir = opendir(folder);
    if (dir == NULL)
        return spc_fail_os(err, errno, "cannot list the folder");
    for (;;) {
        errno = 0;
        const struct dirent *entry = readdir(dir);
        if (entry == NULL && errno != 0)
            status = spc_fail_os(err, errno, "cannot list the folder");
        if (entry == NULL || status != SPC_OK)
            break;
        status = add_entry(s, folder, entry->d_name, err);
    }
    closedir(dir);
    if (status != SPC_OK)
        return status;
    if (s->count == before)
        return spc_fail(err, SPC_INPUT_EMPTY, SPC_NO_OFF,
                        "no file in this folder is named *.ply, *.obj, *.stl or *.off");
    qsort(s->path + before, s->count - before, sizeof *s->path, by_name);
    return SPC_OK;
}

/* ---- the list ---------------------------------------------------------------------------------- */

enum spc_status build_scans_add(struct build_scans *s, const char *name, struct spc_error *err)
{
    struct stat st;
    if (stat(name, &st) == 0 && S_ISDIR(st.st_mode))
        return add_folder(s, name, err);
    return append(s, strdup(name), err);
}

enum spc_status build_scans_list(const char *list, build_scans_fn each, void *ctx,
                                 struct spc_error *err)
{
    char *line = NULL;
    size_t room = 0;
    ssize_t n;
    enum spc_status status = SPC_OK;
    FILE *f = strcmp(list, "-") == 0 ? stdin : fopen(list, "r");
    if (f == NULL)
        return spc_fail_os(err, errno, "cannot open the list");
    errno = 0;
    while (status == SPC_OK && (n = getline(&line, &room, f)) >= 0) {
        while (n > 0 && strchr("\r\n", line[n - 1]) != NULL)
            line[--n] = '\0';
        if (n > 0 && line[0] != '#')
            status = each(ctx, line, err);
        errno = 0;
    }
    if (status == SPC_OK && (ferror(f) || errno == ENOMEM))
        status = spc_fail_os(err, errno, "cannot read the list");
    free(line);
    if (f != stdin)
        fclose(f);
    return status;
}

void build_scans_free(struct build_scans *s)
{
    for (size_t i = 0; i < s->count; i++)
        free(s->path[i]);
    free(s->path);
    *s = (struct build_scans){0};
}

/* ---- names of archives ------------------------------------------------------------------------- */

static const char *base_of(const char *path)
{
    const char *slash = strrchr(path, '/');
    if (strcmp(path, "-") == 0)
        return "stdin";
    return slash != NULL ? slash + 1 : path;
}

static size_t stem_bytes(const char *base)
{
    const char *dot = strrchr(base, '.');
    return dot != NULL && dot != base ? (size_t)(dot - base) : strlen(base);
}

static bool share_stem(const char *a, const char *b)
{
    const size_t n = stem_bytes(a);
    return n == stem_bytes(b) && strncmp(a, b, n) == 0;
}

char *build_scans_target(const struct build_scans *s, size_t i, const char *folder)
{
    const char *base = base_of(s->path[i]);
    size_t n = stem_bytes(base);
    for (size_t k = 0; k < s->count; k++)
        if (k != i && share_stem(base, base_of(s->path[k])))
            n = strlen(base);
    char *name = malloc(n + 5);
    if (name == NULL)
        return NULL;
    snprintf(name, n + 5, "%.*s.spc", (int)n, base);
    char *path = joined(folder, name);
    free(name);
    return path;
}
