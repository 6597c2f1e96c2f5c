#include "chain.h"

#include <stdlib.h>
#include <string.h>

#include "source_int.h"

struct chain {
    struct spb_source *const *members;
    uint32_t count;
    uint32_t at;                    /* member under way */
    bool begun;                     /* its pass has */
    uint64_t first;                 /* number of its first vertex */
    uint64_t bytes_before;          /* of the members before it */
    bool colors, normals;
};

static const struct spb_source_info *info_at(const struct chain *c)
{
    return spb_source_info(c->members[c->at]);
}

static enum spc_status begin(struct chain *c)
{
    if (c->begun)                   /* left in the middle */
        spb_source_pause(c->members[c->at]);
    c->at = 0;
    c->begun = false;
    c->first = c->bytes_before = 0;
    return SPC_OK;
}

static enum spc_status chain_begin(void *state, struct spc_error *err)
{
    (void)err;
    return begin(state);
}

/* The pass over the member is over. False when there is no next one. */
static bool next_member(struct chain *c)
{
    if (c->at + 1 == c->count)
        return false;
    spb_source_pause(c->members[c->at]);
    c->first += info_at(c)->vertex_count;
    c->bytes_before += info_at(c)->file_bytes;
    c->at++;
    c->begun = false;
    return true;
}

static enum spc_status chain_vertices(void *state, struct spb_vertex_batch *out,
                                      struct spc_error *err)
{
    struct chain *c = state;
    do {
        struct spb_source *member = c->members[c->at];
        enum spc_status status = c->begun ? SPC_OK : spb_source_begin_vertices(member, err);
        c->begun = true;
        if (status == SPC_OK)
            status = spb_source_vertices(member, out, err);
        if (status != SPC_OK)
            return status;
        if (out->count > 0) {
            if (c->colors && !info_at(c)->colors)
                memset(out->rgba, 255, sizeof out->rgba[0] * out->count);
            if (c->normals && !info_at(c)->normals)     /* no direction: estimated */
                memset(out->normal, 0, sizeof out->normal[0] * out->count);
            return SPC_OK;
        }
    } while (next_member(c));
    return SPC_OK;
}

static void number_corners(const struct chain *c, struct spb_face_batch *batch)
{
    const uint64_t count = info_at(c)->vertex_count;
    for (size_t i = 0; i < batch->count; i++)
        for (int k = 0; k < 3; k++) {
            uint64_t *corner = &batch->corner[i][k];
            *corner = *corner < count ? *corner + c->first : SPB_BAD_INDEX;
        }
}

static enum spc_status chain_faces(void *state, struct spb_face_batch *out, struct spc_error *err)
{
    struct chain *c = state;
    uint64_t faces_in = 0, split_extra = 0, faces_short = 0;    /* of batches without a triangle */
    do {
        struct spb_source *member = c->members[c->at];
        enum spc_status status = c->begun ? SPC_OK : spb_source_begin_faces(member, err);
        c->begun = true;
        if (status == SPC_OK)
            status = spb_source_faces(member, out, err);
        if (status != SPC_OK)
            return status;
        out->faces_in = faces_in += out->faces_in;
        out->split_extra = split_extra += out->split_extra;
        out->faces_short = faces_short += out->faces_short;
        number_corners(c, out);
    } while (out->count == 0 && next_member(c));
    return SPC_OK;
}

static uint64_t chain_bytes_done(const void *state)
{
    const struct chain *c = state;
    return c->bytes_before + (c->begun ? spb_source_bytes_done(c->members[c->at]) : 0);
}

static const char *chain_remark(void *state)
{
    (void)state;
    return "";                      /* members have their own */
}

static const struct spb_format chain_format = {
    .name = "chain",
    .close = free,
    .begin_vertices = chain_begin,
    .begin_faces = chain_begin,
    .vertices = chain_vertices,
    .faces = chain_faces,
    .bytes_done = chain_bytes_done,
    .remark = chain_remark,
};

/* Strips count for what they will about give: faces of two kinds cannot be told apart in a sum. */
static void add_info(const struct spb_source_info *member, struct spb_source_info *sum)
{
    sum->vertex_count += member->vertex_count;
    sum->face_count += member->strips ? 2 * member->vertex_count : member->face_count;
    sum->colors |= member->colors;
    sum->corner_colors |= member->corner_colors;
    sum->wide |= member->wide;
    sum->normals |= member->normals;
    sum->by_place |= member->by_place;
    sum->file_bytes += member->file_bytes;
}

enum spc_status spb_source_chain(struct spb_source *const *members, uint32_t count,
                                 struct spb_source **out, struct spc_error *err)
{
    struct spb_source_info info = {.format = "several"};
    struct chain *c = calloc(1, sizeof *c);
    if (c == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a scan reader");
    for (uint32_t i = 0; i < count; i++) {
        add_info(spb_source_info(members[i]), &info);
        spb_source_pause(members[i]);
    }
    *c = (struct chain){.members = members, .count = count, .colors = info.colors,
                        .normals = info.normals};
    const enum spc_status status = spb_source_wrap(&chain_format, c, &info, out, err);
    if (status != SPC_OK)
        free(c);
    return status;
}

uint32_t spb_source_member(const struct spb_source *source)
{
    const struct chain *c = spb_source_state(source, &chain_format);
    return c != NULL ? c->at : 0;
}
