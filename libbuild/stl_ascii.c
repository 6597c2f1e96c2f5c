/*
 * Text: any number of solids, one behind the other, of facets of three vertices.
 *
 *     solid NAME
 *     facet normal X Y Z outer loop vertex X Y Z vertex X Y Z vertex X Y Z endloop endfacet
 *     endsolid NAME
 *
 * Keywords in any case, any blanks and line ends between values. Only a name is a matter of lines:
 * it is what follows on the line of solid and endsolid, whatever it says. Normals are passed over
 * (they may be missing or not be numbers): the corners have one. A solid may lack its ends, which
 * is remarked for the last; lines outside of solids are passed over and counted; inside, what is
 * not in its place is refused, and so are facets of more or fewer corners.
 *
 * The file says nowhere how many facets there are, so it is read once to count them. That pass
 * looks at the coordinates as well: whether they need double.
 */
#include "stl_int.h"

#include <inttypes.h>

enum { NORMAL_WORDS_MAX = 8 };

static enum spc_status fail_end(const struct stl *stl, struct spc_error *err)
{
    return spc_fail(err, SPC_INPUT_TRUNCATED, stl->bytes->file_bytes,
                    "facet %" PRIu64 " is cut short: the file ends", stl->next);
}

static enum spc_status fail_value(const struct stl *stl, const char *should, struct spc_error *err)
{
    char shown[SPB_TEXT_SHOWN];

    spb_text_show(&stl->text, shown);
    return spc_fail(err, SPC_INPUT_FORMAT, spb_bytes_off(stl->bytes),
                    "facet %" PRIu64 ": '%s' is not %s", stl->next, shown, should);
}

/* To a value of the facet under way. */
static inline enum spc_status to_value(struct stl *stl, struct spc_error *err)
{
    const enum spc_status status = spb_text_to_value(&stl->text, err);

    if (status == SPC_OK && spb_text_ended(&stl->text))
        return fail_end(stl, err);
    return status;
}

static inline enum spc_status expect(struct stl *stl, const char *word, struct spc_error *err)
{
    const enum spc_status status = to_value(stl, err);

    if (status != SPC_OK || spb_text_word(&stl->text, word))
        return status;
    char should[16] = "'";
    strncat(should, word, sizeof should - 3);
    strncat(should, "'", 2);
    return fail_value(stl, should, err);
}

/* Moves behind the next 'facet', over what stands between facets. *end: there is none. */
static enum spc_status to_facet(struct stl *stl, bool *end, struct spc_error *err)
{
    for (;;) {
        bool spare = false;
        enum spc_status status = spb_text_to_value(&stl->text, err);
        *end = status == SPC_OK && spb_text_ended(&stl->text);
        if (status != SPC_OK || *end)
            return status;
        if (spb_text_word(&stl->text, "facet")) {
            stl->in_solid = true;
            return SPC_OK;
        }
        if (spb_text_word(&stl->text, "solid"))
            stl->in_solid = true;
        else if (spb_text_word(&stl->text, "endsolid"))
            stl->in_solid = false;
        else if (stl->in_solid)
            return fail_value(stl, "'facet' or 'endsolid'", err);
        else
            stl->lines++;
        status = spb_text_pass_line(&stl->text, &spare, err);
        if (status != SPC_OK)
            return status;
    }
}

/* The normal, if there is one, to behind 'outer'. */
static enum spc_status pass_normal(struct stl *stl, struct spc_error *err)
{
    for (int i = 0;; i++) {
        enum spc_status status = to_value(stl, err);
        if (status != SPC_OK || spb_text_word(&stl->text, "outer"))
            return status;
        if (i == NORMAL_WORDS_MAX)
            return fail_value(stl, "'outer'", err);
        status = spb_text_pass_value(&stl->text, err);
        if (status != SPC_OK)
            return status;
    }
}

static inline enum spc_status read_corner(struct stl *stl, bool counting, double xyz[3],
                                          struct spc_error *err)
{
    enum spc_status status = expect(stl, "vertex", err);

    for (int a = 0; a < 3 && status == SPC_OK; a++) {
        status = to_value(stl, err);
        const uint8_t *const begin = spb_text_at(&stl->text);
        if (status != SPC_OK)
            return status;
        if (!spb_text_real(&stl->text, &xyz[a]))
            return fail_value(stl, "a number", err);
        if (counting && !stl->wide)
            stl->wide = spb_text_wider_than_float(begin, spb_text_at(&stl->text), xyz[a]);
    }
    return status;
}

static enum spc_status read_facet(struct stl *stl, bool counting, double xyz[3][3],
                                  struct spc_error *err)
{
    enum spc_status status = pass_normal(stl, err);

    if (status == SPC_OK)
        status = expect(stl, "loop", err);
    for (int k = 0; k < 3 && status == SPC_OK; k++)
        status = read_corner(stl, counting, xyz[k], err);
    if (status == SPC_OK)
        status = expect(stl, "endloop", err);
    if (status == SPC_OK)
        status = expect(stl, "endfacet", err);
    return status;
}

void spb_stl_ascii_begin(struct stl *stl)
{
    static const uint8_t mark[] = { 0xef, 0xbb, 0xbf };     /* of some Windows editors */
    struct spb_bytes *const b = stl->bytes;

    spb_bytes_seek(b, 0);
    if (spb_bytes_need(b, sizeof mark, NULL) == SPC_OK && spb_bytes_have(b) >= sizeof mark &&
        memcmp(b->buf + b->pos, mark, sizeof mark) == 0)
        b->pos += sizeof mark;
    stl->in_solid = false;
    stl->lines = 0;
}

enum spc_status spb_stl_ascii_count(struct stl *stl, const struct spb_progress *progress,
                                    struct spc_error *err)
{
    const uint64_t file_bytes = stl->bytes->file_bytes;
    bool end = false;

    spb_stl_ascii_begin(stl);
    for (stl->next = 0;; stl->next++) {
        double xyz[3][3];
        enum spc_status status = to_facet(stl, &end, err);
        if (status == SPC_OK && end)
            break;
        if (status == SPC_OK)
            status = read_facet(stl, true, xyz, err);
        if (status != SPC_OK)
            return status;
        if (stl->next % STL_BATCH_FACETS == 0 &&
            spb_progress_tell(progress, "count", spb_bytes_off(stl->bytes), file_bytes))
            return spc_fail(err, SPC_CANCELLED, SPC_NO_OFF, "cancelled");
    }
    stl->end_missing = stl->in_solid;
    stl->lines_outside = stl->lines;
    stl->count = stl->next;
    return SPC_OK;
}

enum spc_status spb_stl_ascii_vertices(struct stl *stl, struct spb_vertex_batch *out,
                                       struct spc_error *err)
{
    while (stl->next < stl->count && out->count + 3 <= SPB_BATCH_MAX) {
        bool end = false;
        enum spc_status status = to_facet(stl, &end, err);
        if (status == SPC_OK && end)            /* it was longer when it was counted */
            status = fail_end(stl, err);
        if (status == SPC_OK)
            status = read_facet(stl, false, &out->xyz[out->count], err);
        if (status != SPC_OK)
            return status;
        stl->next++;
        out->count += 3;
    }
    return SPC_OK;
}
