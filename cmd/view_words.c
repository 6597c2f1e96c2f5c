/* view_words.c - what stands on the picture. */
#include "view.h"

#include "bytes.h"

#include <stdarg.h>
#include <stdlib.h>

enum { HELP_ROWS_MAX = 64, LINE = 240 };
static const double NOTICE_S = 3;

void view_say(struct view *v, const char *fmt, ...)
{
    va_list list;
    va_start(list, fmt);
    vsnprintf(v->notice, sizeof v->notice, fmt, list);
    va_end(list);
    v->notice_until = cli_seconds() + NOTICE_S;
    v->changed = true;
}

void view_tell(struct view *v, const char *file, const struct spc_error *err)
{
    const char *base = file != NULL ? strrchr(file, '/') : NULL;
    if (file != NULL)
        snprintf(v->message, sizeof v->message, "'%s': %s", base != NULL ? base + 1 : file, err->what);
    else
        snprintf(v->message, sizeof v->message, "%s", err->what);
    v->changed = true;
}

/* ---- lines -------------------------------------------------------------------------------------- */

static const char *short_count(uint64_t n, char text[CLI_TEXT])
{
    static const char *const units[] = {"", " k", " M", " G"};
    double v = (double)n;
    int u = 0;
    if (n == UINT64_MAX)
        return "?";
    for (; v >= 999.5 && u < 3; u++)
        v /= 1000;
    snprintf(text, CLI_TEXT, u == 0 || v >= 99.95 ? "%.0f%s" : v >= 9.995 ? "%.1f%s" : "%.2f%s", v, units[u]);
    return text;
}

static void line_of_nodes(const struct view *v, char line[LINE])
{
    static const char *const modes[] = {"hybrid", "points", "triangles"};
    static const char *const paints[] = {"", ", clusters", ", levels", ", normal clusters", ", kinds"};
    const struct spv_scene_stats *s = &v->stats;
    char nodes[CLI_TEXT], triangles[CLI_TEXT], tested[CLI_TEXT], all[CLI_TEXT];
    snprintf(line, LINE, "eps %.3g px   %.1f fps   %s nodes and %s triangles drawn, %s tested, %s in all   %s%s%s%s",
             v->drawn_eps, v->times.shown_fps, short_count(s->drawn.nodes, nodes),
             short_count(s->drawn.triangles, triangles), short_count(s->drawn.nodes_processed, tested),
             short_count(s->nodes_total, all), modes[v->mode], v->splat == SPV_SPLAT_FAST ? ", fast" : "",
             paints[v->paint], v->frozen ? ", frozen" : "");
}

static void line_of_clusters(const struct view *v, char line[LINE])
{
    const struct spv_scene_stats *s = &v->stats;
    char drawn[CLI_TEXT], all[CLI_TEXT], read[CLI_TEXT], kept[CLI_TEXT];
    const uint32_t lacking = s->blocks_missing - s->blocks_hidden;
    int n = snprintf(line, LINE, "clusters %s of %s   left out: %u outside, %u facing away, %u by range, %u hidden",
                     short_count(s->clusters_drawn, drawn), short_count(s->clusters_total, all), s->culled_frustum,
                     s->culled_backface, s->culled_range, s->drawn.clusters_hidden);
    if (n > 0 && n < LINE)
        n += snprintf(line + n, LINE - (size_t)n, "   read %s, %s in memory", cli_bytes_text(v->times.bytes, read),
                      cli_bytes_text(s->bytes_resident, kept));
    if (lacking > s->blocks_failed && n > 0 && n < LINE)
        n += snprintf(line + n, LINE - (size_t)n, view_loading(v) ? "   loading %u" : "   no room for %u",
                      lacking - s->blocks_failed);
    if (s->blocks_failed > 0 && n > 0 && n < LINE)
        snprintf(line + n, LINE - (size_t)n, "   %u cannot be read", s->blocks_failed);
}

/* ---- panels ------------------------------------------------------------------------------------- */

static struct spv_rect help_panel(const struct view *v, const struct spv_canvas *canvas)
{
    static char keys[HELP_ROWS_MAX][SPV_CONTROL_KEYS];
    struct spv_help_row rows[HELP_ROWS_MAX];
    int count = 0;
    while (count < HELP_ROWS_MAX && spv_control_help((size_t)count, keys[count], &rows[count].words)) {
        rows[count].keys = keys[count];
        count++;
    }
    return spv_panel_help(v->text, canvas, "spc-view", rows, count);
}

/* On a card the words are a layer of their own: its rows are cleared before, shown after. */
struct layer {
    struct view *v;
    struct spv_canvas canvas;
    bool own;
};

static void put(const struct layer *l, struct spv_rect r)
{
    const size_t row = (size_t)l->canvas.width * 4;
    if (!l->own || r.height <= 0)
        return;
    uint8_t *at = l->canvas.rgba + (size_t)r.y * row;
    spv_show_picture(l->v->show, at, l->canvas.width, r.height, 0, r.y, SPV_SHOW_BLEND, NULL);
    memset(at, 0, row * (size_t)r.height);
}

static bool begin_layer(struct view *v, struct layer *l)
{
    const size_t bytes = (size_t)v->width * (size_t)v->height * 4;
    l->own = v->draws_gl && v->drawn_samples == 1;
    if (l->own && v->rgba_max < bytes) {
        free(v->rgba);
        v->rgba = malloc(bytes);
        v->rgba_max = v->rgba != NULL ? bytes : 0;
    }
    if (v->rgba == NULL)
        return false;
    if (l->own)
        memset(v->rgba, 0, bytes);
    l->v = v;
    l->canvas = (struct spv_canvas){v->rgba, v->width, v->height};
    return true;
}

static const char *message_of(struct view *v, char text[VIEW_MESSAGE])
{
    struct spc_error err = {0};
    if (v->message[0] != '\0')
        return v->message;
    if (cli_unreadable())
        return "an archive was cut short while it was open, or its disk cannot be read. Press escape to end.";
    if (spv_scene_count(v->scene) == 0)
        return "no archive is open. Drop one here, or press escape to end.";
    const uint32_t bad = spv_scene_fault(v->scene, &err);
    if (bad == SPV_SCENE_ARCHIVES_MAX || v->stats.blocks_failed == 0)
        return NULL;
    const char *path = spv_scene_path(v->scene, bad), *base = strrchr(path, '/');
    snprintf(text, VIEW_MESSAGE, "'%s': %s. What can be read is shown; spc-info --verify tells what is damaged, "
             "spc-info --recover saves the rest.", base != NULL ? base + 1 : path, err.what);
    return text;
}

void view_words(struct view *v)
{
    struct layer l;
    char lines[2][LINE], text[VIEW_MESSAGE];
    const char *const both[2] = {lines[0], lines[1]};
    const char *message = message_of(v, text);
    if (!begin_layer(v, &l))
        return;
    if (v->statistics) {
        line_of_nodes(v, lines[0]);
        line_of_clusters(v, lines[1]);
        put(&l, spv_panel_stats(v->text, &l.canvas, both, 2));
    }
    if (v->help)
        put(&l, help_panel(v, &l.canvas));
    else if (message != NULL)
        put(&l, spv_panel_message(v->text, &l.canvas, NULL, message));
    else if (v->notice[0] != '\0')
        put(&l, spv_panel_message(v->text, &l.canvas, NULL, v->notice));
    const uint32_t loading = v->stats.blocks_missing - v->stats.blocks_hidden;
    if (v->stats.tops > 0 && view_loading(v) && !v->help && message == NULL)
        put(&l, spv_panel_progress(v->text, &l.canvas, "loading",
                                   1 - (double)loading / (double)(loading + v->stats.clusters_drawn), true));
}
