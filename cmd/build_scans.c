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
    if (stat(path, &st) == 0 && !S_ISREG(st.st_mode)) {
        free(path);                 /* folders in folders have to be named; a pipe might be waited for */
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
    if (strcmp(name, "-") != 0 && stat(name, &st) == 0 && S_ISDIR(st.st_mode))
        return add_folder(s, name, err);
    return append(s, strdup(name), err);
}

enum spc_status build_scans_list(const char *list, build_scans_fn each, void *ctx,
                                 struct spc_error *err)
{
    static const char mark[] = "\xef\xbb\xbf";       /* of some Windows editors */
    char *line = NULL;
    size_t room = 0, lines = 0;
    ssize_t n;
    enum spc_status status = SPC_OK;
    FILE *f = strcmp(list, "-") == 0 ? stdin : fopen(list, "r");
    if (f == NULL)
        return spc_fail_os(err, errno, "cannot open the list");
    errno = 0;
    while (status == SPC_OK && (n = getline(&line, &room, f)) >= 0) {
        while (n > 0 && strchr("\r\n", line[n - 1]) != NULL)
            line[--n] = '\0';
        const size_t begin = lines++ == 0 && strncmp(line, mark, 3) == 0 ? 3 : 0;
        if (line[begin] != '\0' && line[begin] != '#')
            status = each(ctx, line + begin, err);
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

struct name {
    const char *base;
    size_t stem;                    /* bytes of base before its ending */
    size_t index;
    char *path;                     /* of the archive */
};

static int by_stem(const void *a, const void *b)
{
    const struct name *x = a, *y = b;
    const size_t least = x->stem < y->stem ? x->stem : y->stem;
    const int order = strncmp(x->base, y->base, least);
    return order != 0 ? order : (x->stem > y->stem) - (x->stem < y->stem);
}

static int by_path(const void *a, const void *b)
{
    const struct name *x = a, *y = b;
    const int order = strcmp(x->path, y->path);
    return order != 0 ? order : (x->index > y->index) - (x->index < y->index);
}

static char *archive_path(const struct name *n, bool alone, const char *folder)
{
    const size_t bytes = alone ? n->stem : strlen(n->base);
    char *name = malloc(bytes + 5), *path = NULL;
    if (name != NULL) {
        snprintf(name, bytes + 5, "%.*s.spc", (int)bytes, n->base);
        path = joined(folder, name);
    }
    free(name);
    return path;
}

/* Sorted by stem, those that share one are neighbours; sorted by path, so are those that clash. */
static bool name_archives(struct name *names, size_t count, const char *folder, struct build_target *out)
{
    bool all = true;
    qsort(names, count, sizeof *names, by_stem);
    for (size_t i = 0; i < count; i++) {
        const bool alone = (i == 0 || by_stem(&names[i - 1], &names[i]) != 0) &&
                           (i + 1 == count || by_stem(&names[i + 1], &names[i]) != 0);
        names[i].path = out[names[i].index].path = archive_path(&names[i], alone, folder);
        all &= names[i].path != NULL;
    }
    if (!all)
        return false;
    qsort(names, count, sizeof *names, by_path);
    for (size_t i = 1; i < count; i++)
        out[names[i].index].taken = strcmp(names[i - 1].path, names[i].path) == 0;
    return true;
}

struct build_target *build_scans_targets(const struct build_scans *s, const char *folder)
{
    struct name *names = malloc((s->count + 1) * sizeof *names);
    struct build_target *out = calloc(s->count + 1, sizeof *out);
    bool done = names != NULL && out != NULL;
    for (size_t i = 0; i < s->count && done; i++) {
        const char *base = base_of(s->path[i]);
        names[i] = (struct name){.base = base, .stem = stem_bytes(base), .index = i};
    }
    done = done && name_archives(names, s->count, folder, out);
    free(names);
    if (done)
        return out;
    build_scans_targets_free(out, s->count);
    return NULL;
}

void build_scans_targets_free(struct build_target *targets, size_t count)
{
    for (size_t i = 0; targets != NULL && i < count; i++)
        free(targets[i].path);
    free(targets);
}
