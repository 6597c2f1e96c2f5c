/* view_log.c - a line a frame as CSV, the summary as JSON. */
#include "view.h"

#include <errno.h>
#include <jansson.h>
#include <stdlib.h>
#include <string.h>

#define COLUMNS                                                                                                  \
    "frame,time_s,eye_x,eye_y,eye_z,eps_px,samples,nodes_drawn,triangles_drawn,nodes_processed,nodes_chosen,"    \
    "nodes_total,clusters_total,clusters_drawn,culled_frustum,culled_backface,culled_range,culled_occlusion,"    \
    "tops,blocks_missing,blocks_failed,blocks_hidden,bytes_chosen,bytes_read,bytes_resident,select_ms,draw_ms,"  \
    "frame_ms\n"

static int csv_failed(const struct view *v)
{
    struct spc_error err = {0};
    spc_fail_os(&err, errno, "cannot write the statistics");
    cli_error(v->o.stats, &err, NULL);
    return EXIT_FAILED;
}

int view_log_begin(struct view *v)
{
    if (v->o.stats == NULL)
        return EXIT_DONE;
    v->csv = fopen(v->o.stats, "we");
    if (v->csv != NULL)             /* a frame that is seen has its line there, whatever happens next */
        setvbuf(v->csv, NULL, _IOLBF, BUFSIZ);
    return v->csv != NULL && fputs(COLUMNS, v->csv) >= 0 ? EXIT_DONE : csv_failed(v);
}

/* UINT64_MAX: the back end cannot tell, an empty field. */
static const char *count_text(uint64_t count, char text[CLI_TEXT])
{
    if (count == UINT64_MAX)
        return "";
    snprintf(text, CLI_TEXT, "%llu", (unsigned long long)count);
    return text;
}

void view_log_frame(struct view *v)
{
    const struct spv_scene_stats *s = &v->stats;
    const double *eye = v->control.camera.eye;
    char nodes[CLI_TEXT], triangles[CLI_TEXT];
    if (v->csv == NULL)
        return;
    fprintf(v->csv, "%llu,%.4f,%.17g,%.17g,%.17g,%.6g,%d,%s,%s,", (unsigned long long)v->times.frames,
            cli_seconds() - v->times.began, eye[0], eye[1], eye[2], v->drawn_eps, v->drawn_samples,
            count_text(s->drawn.nodes, nodes), count_text(s->drawn.triangles, triangles));
    fprintf(v->csv, "%llu,%llu,%llu,%u,%u,%u,%u,%u,%u,%u,%u,%u,%u,", (unsigned long long)s->drawn.nodes_processed,
            (unsigned long long)s->nodes_chosen, (unsigned long long)s->nodes_total, s->clusters_total,
            s->clusters_drawn, s->culled_frustum, s->culled_backface, s->culled_range, s->drawn.clusters_hidden,
            s->tops, s->blocks_missing, s->blocks_failed, s->blocks_hidden);
    fprintf(v->csv, "%llu,%llu,%llu,%.3f,%.3f,%.3f\n", (unsigned long long)s->bytes_chosen,
            (unsigned long long)s->bytes_read, (unsigned long long)s->bytes_resident, s->select_ms, s->draw_ms,
            v->times.frame_ms);
}

int view_log_end(struct view *v, int code)
{
    const struct view_times *t = &v->times;
    if (v->csv != NULL) {
        const bool bad = ferror(v->csv) != 0;
        if ((fclose(v->csv) != 0 || bad) && code == EXIT_DONE)
            code = csv_failed(v);
        v->csv = NULL;
    }
    if (!v->o.json)
        return code;
    json_t *out = json_pack("{s:s, s:I, s:f, s:f, s:I, s:f, s:I, s:I}", "renderer",
                            v->draw != NULL ? spv_draw_name(v->draw) : "none", "frames", (json_int_t)t->frames,
                            "window_ms", t->window_ms,
                            "first_picture_ms", t->first_ms, "first_picture_bytes", (json_int_t)t->first_bytes,
                            "whole_picture_ms", t->settled_ms, "whole_picture_bytes", (json_int_t)t->settled_bytes,
                            "bytes_read", (json_int_t)t->bytes);
    char *text = out != NULL ? json_dumps(out, JSON_INDENT(2)) : NULL;
    json_decref(out);
    if (text == NULL || puts(text) < 0)
        code = EXIT_FAILED;
    free(text);
    return code;
}
