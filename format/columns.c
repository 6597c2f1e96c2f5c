#include "columns.h"

#include "bytes.h"
#include "format_int.h"

#include <stdlib.h>

/* Plane counts: they follow from what the block holds. */
enum {
    NODE_PLANES = 3 * 2 + 2 + 2 + 2 + 1,            /* position, normal, radius, e_self, height */
    COLOR_PLANES = 4,
    INNER_PLANES = 1 + 1 + 1 + 2 + 1,               /* kids, orphans, groups; e_parent, links */
    LEAF_PLANES = 1 + 1 + 2 + 1,                    /* sizes, groups, e_parent, links */
    TRIANGLE_PLANES = 1 + 1 + 1 + 2,                /* edges, third, loose, explicit corners */
    GROUP_PLANES = 2,                               /* cosines */
};
enum { KID_CODE = 15, KID_HERE = 16 };              /* child code; family in this block */

static uint32_t plane_count(const struct columns *c)
{
    const bool colors = c->layout->colors != 0;
    if (c->block->kind == SPC_BLOCK_INNER)
        return INNER_PLANES + NODE_PLANES + (colors ? COLOR_PLANES : 0) + GROUP_PLANES;
    if (!c->triangles)
        return LEAF_PLANES + NODE_PLANES + (colors ? COLOR_PLANES : 0) + GROUP_PLANES;
    return LEAF_PLANES + TRIANGLE_PLANES + 3 * c->block->vertex_width +
           (colors ? COLOR_PLANES : 0) + GROUP_PLANES;
}

static uint8_t *node_at(const struct columns *c, uint8_t *payload, uint32_t i)
{
    return payload + c->layout->nodes + (size_t)ND_SIZE * c->place[i];
}

static const uint8_t *node_in(const struct columns *c, const uint8_t *payload, uint32_t i)
{
    return payload + c->layout->nodes + (size_t)ND_SIZE * c->place[i];
}

static enum spc_status corrupt(const struct columns *c, const char *what, struct spc_error *err)
{
    return spc_fail(err, SPC_CORRUPT, c->block->off, "columns of the block: %s", what);
}

static void release(struct columns *c)
{
    free(c->place);
    free(c->like);
    free(c->families);
}

static enum spc_status init(struct columns *c, const struct spc_block *b,
                            const struct spc_block_layout *l, const struct spc_frame *frame,
                            uint32_t family_count, struct spc_error *err)
{
    *c = (struct columns){.block = b, .layout = l, .frame = frame, .n = b->node_count,
                          .triangles = l->indices != 0, .family_count = family_count};
    c->place = malloc(c->n * sizeof *c->place);
    c->like = malloc(c->n * sizeof *c->like);
    c->families = malloc((family_count + 1) * sizeof *c->families);
    if (c->place != NULL && c->like != NULL && c->families != NULL)
        return SPC_OK;
    release(c);
    return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for the columns of a block");
}

/* ---- order: canonical to drawing order ------------------------------------------------------- */

/* Families, whose sizes add up to n, into their groups, each in canonical order. */
static void place_families(struct columns *c, uint32_t count[SPC_NORMAL_CLUSTERS_MAX])
{
    uint32_t next[SPC_NORMAL_CLUSTERS_MAX], at = 0, node = 0;
    memset(count, 0, SPC_NORMAL_CLUSTERS_MAX * sizeof *count);
    for (uint32_t f = 0; f < c->family_count; f++)
        count[c->families[f].group] += c->families[f].size;
    for (uint32_t g = 0; g < SPC_NORMAL_CLUSTERS_MAX; g++) {
        next[g] = at;
        at += count[g];
    }
    for (uint32_t f = 0; f < c->family_count; f++) {
        const struct spc_family *family = &c->families[f];
        for (uint32_t k = 0; k < family->size; k++, node++) {
            const bool child = c->block->kind == SPC_BLOCK_INNER && family->parent != COLUMNS_NO_NODE;
            c->place[node] = next[family->group]++;
            c->like[node] = child ? family->parent : (uint16_t)(node - 1);  /* the first: NO_NODE */
        }
    }
}

/* ---- encoding ---------------------------------------------------------------------------------- */

struct buffers {                    /* [n + 1] each */
    uint8_t *byte;
    uint16_t *word;
};

static uint32_t child_code_at(const struct columns *c, const uint8_t *payload, uint32_t i)
{
    const uint32_t at = c->place[i];
    return payload[c->layout->children + at / 2] >> 4 * (at & 1) & 15;
}

/* Normal clusters, the one met last first: neighbours mostly face the same way. */
struct recent {
    uint8_t group[SPC_NORMAL_CLUSTERS_MAX];
};

static void recent_init(struct recent *r)
{
    for (uint32_t g = 0; g < SPC_NORMAL_CLUSTERS_MAX; g++)
        r->group[g] = (uint8_t)g;
}

/* The one at rank comes to the front. */
static uint8_t recent_take(struct recent *r, uint32_t rank)
{
    const uint8_t group = r->group[rank];
    memmove(r->group + 1, r->group, rank);
    r->group[0] = group;
    return group;
}

static void put_groups(const struct columns *c, struct buffers *b, struct planes_writer *w)
{
    struct recent recent;
    recent_init(&recent);
    for (uint32_t f = 0; f < c->family_count; f++) {
        uint8_t rank = 0;
        while (recent.group[rank] != c->families[f].group)
            rank++;
        b->byte[f] = rank;
        recent_take(&recent, rank);
    }
    planes_put8(w, b->byte, c->family_count);
}

/* What a family's e_parent and link are told from: its largest t, rounded up, and radius. */
static uint16_t family_error(const struct columns *c, const uint8_t *payload, uint32_t first, uint32_t size)
{
    uint16_t t = 0;
    for (uint32_t k = first; k < first + size; k++) {
        const uint16_t e = load_u16(node_in(c, payload, k) + ND_E_SELF);
        t = e > t ? e : t;
    }
    return (uint16_t)(((uint32_t)t + (1u << c->e_shift) - 1) >> c->e_shift);
}

static uint8_t family_link(const struct columns *c, const uint8_t *payload, uint32_t first, uint32_t size)
{
    uint16_t radius = 0;
    for (uint32_t k = first; k < first + size; k++) {
        const uint16_t r = load_u16(node_in(c, payload, k) + ND_RADIUS);
        radius = r > radius ? r : radius;
    }
    return spc_link_bound((double)spc_len_decode(radius), c->block->link_base);
}

static void put_inner_families(const struct columns *c, const uint8_t *payload, struct buffers *b,
                               struct planes_writer *w)
{
    uint32_t orphans = 0, first = 0;
    for (uint32_t i = 0; i < c->n; i++)
        b->byte[i] = (uint8_t)child_code_at(c, payload, i);
    for (uint32_t f = 0; f < c->family_count; f++)
        if (c->families[f].parent != COLUMNS_NO_NODE)
            b->byte[c->families[f].parent] |= KID_HERE;
    planes_put8(w, b->byte, c->n);
    for (uint32_t f = 0; f < c->family_count; f++)
        b->byte[f] = c->families[f].parent == COLUMNS_NO_NODE ? c->families[f].size : 0;
    planes_put8(w, b->byte, c->family_count);
    put_groups(c, b, w);
    for (uint32_t f = 0; f < c->family_count; first += c->families[f++].size) {
        if (c->families[f].parent != COLUMNS_NO_NODE)
            continue;
        const uint8_t *p = node_in(c, payload, first);
        b->word[orphans] = (uint16_t)(load_u16(p + ND_E_PARENT) >> c->e_shift);
        b->byte[orphans++] = (uint8_t)(p[ND_LINK] - family_link(c, payload, first, c->families[f].size));
    }
    planes_put16(w, b->word, orphans);
    planes_put8(w, b->byte, orphans);
}

static void put_leaf_families(const struct columns *c, const uint8_t *payload, struct buffers *b,
                              struct planes_writer *w)
{
    uint32_t first = 0;
    for (uint32_t f = 0; f < c->family_count; f++)
        b->byte[f] = c->families[f].size;
    planes_put8(w, b->byte, c->family_count);
    put_groups(c, b, w);
    for (uint32_t f = 0; f < c->family_count; first += c->families[f++].size) {
        const uint32_t size = c->families[f].size;
        const uint8_t *p = node_in(c, payload, first);
        b->word[f] = (uint16_t)((load_u16(p + ND_E_PARENT) >> c->e_shift) - family_error(c, payload, first, size));
        b->byte[f] = (uint8_t)(p[ND_LINK] - family_link(c, payload, first, size));
    }
    planes_put16(w, b->word, c->family_count);
    planes_put8(w, b->byte, c->family_count);
}

/* Low bits that no code needs; sizes that the caller promised. False: not a block of the format. */
static bool measure(struct columns *c, const uint8_t *payload)
{
    uint32_t count[SPC_NORMAL_CLUSTERS_MAX], sum = 0;
    for (uint32_t f = 0; f < c->family_count; f++) {
        if (c->families[f].size < 1 || c->families[f].size > SPC_CHILDREN_MAX ||
            c->families[f].group >= c->frame->normal_clusters)
            return false;
        sum += c->families[f].size;
    }
    if (sum != c->n)
        return false;
    place_families(c, count);
    for (uint32_t g = 0; g < c->frame->normal_clusters; g++)
        if (load_u16(payload + c->layout->groups + 4 * g) != count[g])
            return false;
    node_columns_measure(c, payload);
    return true;
}

static void store_prelude(const struct columns *c, const uint8_t *payload, uint8_t *out)
{
    memset(out, 0, CO_SIZE);
    store_u32(out + CO_FAMILY_COUNT, c->family_count);
    out[CO_E_SHIFT] = (uint8_t)c->e_shift;
    out[CO_RADIUS_SHIFT] = (uint8_t)c->radius_shift;
    out[CO_HEIGHT_SHIFT] = (uint8_t)c->height_shift;
    out[CO_POSITION_BITS] = (uint8_t)c->position_bits;
    if (c->triangles)
        memcpy(out + CO_VERTEX_BASE, payload + c->layout->vertex_base, CO_VERTEX_BASE_LEN);
}

static enum spc_status put_all(struct columns *c, const uint8_t *payload, struct buffers *b,
                               struct planes_writer *w, struct spc_error *err)
{
    if (c->block->kind == SPC_BLOCK_INNER)
        put_inner_families(c, payload, b, w);
    else
        put_leaf_families(c, payload, b, w);
    enum spc_status status = SPC_OK;
    if (c->triangles)
        status = triangle_columns_put(c, payload, w, err);
    else
        node_columns_put(c, payload, w);
    for (uint32_t g = 0; g < c->frame->normal_clusters; g++)
        b->word[g] = load_u16(payload + c->layout->groups + 4 * g + 2);
    planes_put16(w, b->word, c->frame->normal_clusters);
    return status;
}

/* Arrays that encoding takes, all together. */
static size_t memory_of(const struct spc_block *b, bool triangles, uint32_t family_count, uint32_t most)
{
    const size_t n = b->node_count;
    return encoder_share(n * sizeof(uint32_t)) + encoder_share(n * sizeof(uint16_t)) +
           encoder_share((family_count + (size_t)1) * sizeof(struct spc_family)) +
           encoder_share(most) + encoder_share(most * sizeof(uint16_t)) +
           encoder_share((size_t)3 * most) +
           (triangles ? triangle_columns_memory(b->node_count, b->vertex_count)
                      : node_columns_memory(b->node_count));
}

static void take_arrays(struct columns *c, struct spc_encoder *e, uint32_t most, struct buffers *b)
{
    c->place = encoder_take(e, c->n * sizeof *c->place);
    c->like = encoder_take(e, c->n * sizeof *c->like);
    c->families = encoder_take(e, (c->family_count + (size_t)1) * sizeof *c->families);
    b->byte = encoder_take(e, most);
    b->word = encoder_take(e, most * sizeof *b->word);
}

enum spc_status columns_encode(const struct spc_block *block, const struct spc_block_layout *layout,
                               const struct spc_frame *frame, const struct spc_family *families,
                               uint32_t family_count, const uint8_t *payload,
                               struct spc_encoder *encoder, uint8_t *out, size_t out_max,
                               size_t *out_bytes, struct spc_error *err)
{
    struct columns c = {.block = block, .layout = layout, .frame = frame, .n = block->node_count,
                        .triangles = layout->indices != 0, .family_count = family_count};
    struct buffers b;
    struct planes_writer w;
    const uint32_t most = block->node_count + SPC_NORMAL_CLUSTERS_MAX;
    enum spc_status status =
        encoder_reserve(encoder, memory_of(block, c.triangles, family_count, most), err);
    if (status != SPC_OK)
        return status;
    take_arrays(&c, encoder, most, &b);
    memcpy(c.families, families, family_count * sizeof *families);
    if (out_max < CO_SIZE || !measure(&c, payload))
        return spc_fail(err, SPC_INTERNAL, SPC_NO_OFF, "families do not make the block");
    status = planes_begin(&w, encoder, plane_count(&c), 3 * most, out + CO_SIZE, out_max - CO_SIZE, err);
    if (status != SPC_OK)
        return status;
    store_prelude(&c, payload, out);
    status = put_all(&c, payload, &b, &w, err);
    const enum spc_status end = planes_finish(&w, out_bytes, err);
    *out_bytes += CO_SIZE;
    return status == SPC_OK ? end : status;
}

/* ---- decoding ---------------------------------------------------------------------------------- */

/* Families of an inner block: depth first, orphans as they come. Fills sizes and parents. */
static bool replay(struct columns *c, const uint8_t *kids, const uint8_t *orphans, uint16_t *stack)
{
    uint32_t depth = 0, next = 0;
    for (uint32_t f = 0; f < c->family_count; f++) {
        struct spc_family *family = &c->families[f];
        if (orphans[f] == 0 && depth == 0)
            return false;
        family->parent = orphans[f] ? COLUMNS_NO_NODE : stack[--depth];
        family->size = orphans[f] ? orphans[f]
                                  : (uint8_t)spc_inner_children_of(kids[family->parent] & KID_CODE);
        if (family->size < 1 || family->size > SPC_CHILDREN_MAX || family->size > c->n - next)
            return false;
        for (uint32_t k = family->size; k-- > 0;)
            if (kids[next + k] & KID_HERE)
                stack[depth++] = (uint16_t)(next + k);
        next += family->size;
    }
    return next == c->n && depth == 0;
}

static bool kids_ok(const uint8_t *kids, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++)
        if ((kids[i] & KID_CODE) > 12 || kids[i] > (KID_CODE | KID_HERE))
            return false;
    return true;
}

static bool get_groups(struct columns *c, struct buffers *b, struct planes_reader *r)
{
    struct recent recent;
    recent_init(&recent);
    planes_get8(r, b->byte, c->family_count);
    for (uint32_t f = 0; f < c->family_count; f++) {
        if (b->byte[f] >= SPC_NORMAL_CLUSTERS_MAX)
            return false;
        c->families[f].group = recent_take(&recent, b->byte[f]);
        if (c->families[f].group >= c->frame->normal_clusters)
            return false;
    }
    return true;
}

static void store_counts(const struct columns *c, const uint32_t *count, uint8_t *payload)
{
    for (uint32_t g = 0; g < c->frame->normal_clusters; g++)
        store_u16(payload + c->layout->groups + 4 * g, (uint16_t)count[g]);
}

/* kids[n] is read first; byte and word are free then. Links stay in byte: finish_families. */
static bool get_inner_families(struct columns *c, struct planes_reader *r, uint8_t *kids,
                               struct buffers *b, uint8_t *payload)
{
    uint32_t count[SPC_NORMAL_CLUSTERS_MAX], orphans = 0, first = 0;
    planes_get8(r, kids, c->n);
    planes_get8(r, b->byte, c->family_count);
    if (!kids_ok(kids, c->n) || !replay(c, kids, b->byte, b->word) || !get_groups(c, b, r))
        return false;
    place_families(c, count);
    store_counts(c, count, payload);
    for (uint32_t i = 0; i < c->n; i++)
        payload[c->layout->children + c->place[i] / 2] |=
            (uint8_t)((kids[i] & KID_CODE) << 4 * (c->place[i] & 1));
    for (uint32_t f = 0; f < c->family_count; f++)
        orphans += c->families[f].parent == COLUMNS_NO_NODE;
    planes_get16(r, b->word, orphans);
    planes_get8(r, b->byte, orphans);
    orphans = 0;
    for (uint32_t f = 0; f < c->family_count; first += c->families[f++].size) {
        if (c->families[f].parent != COLUMNS_NO_NODE)
            continue;
        const uint16_t e_parent = (uint16_t)(b->word[orphans++] << c->e_shift);
        for (uint32_t k = first; k < first + c->families[f].size; k++)
            store_u16(node_at(c, payload, k) + ND_E_PARENT, e_parent);
    }
    return true;
}

static bool get_leaf_families(struct columns *c, struct planes_reader *r, struct buffers *b,
                              uint8_t *payload)
{
    uint32_t count[SPC_NORMAL_CLUSTERS_MAX], sum = 0;
    bool ok = true;
    planes_get8(r, b->byte, c->family_count);
    for (uint32_t f = 0; f < c->family_count; f++) {
        c->families[f].size = b->byte[f];
        ok &= b->byte[f] >= 1 && b->byte[f] <= SPC_CHILDREN_MAX;
        sum += b->byte[f];
    }
    if (!ok || sum != c->n || !get_groups(c, b, r))
        return false;
    place_families(c, count);
    store_counts(c, count, payload);
    planes_get16(r, b->word, c->family_count);
    planes_get8(r, b->byte, c->family_count);
    return true;
}

static void store_link(const struct columns *c, uint8_t *payload, uint32_t first, uint32_t size, uint8_t more)
{
    const uint8_t link = (uint8_t)(more + family_link(c, payload, first, size));
    for (uint32_t k = first; k < first + size; k++)
        node_at(c, payload, k)[ND_LINK] = link;
}

/* Links of families whose parents lie elsewhere, once their radii are there. */
static void finish_inner_families(const struct columns *c, const struct buffers *b, uint8_t *payload)
{
    uint32_t orphans = 0, first = 0;
    for (uint32_t f = 0; f < c->family_count; first += c->families[f++].size)
        if (c->families[f].parent == COLUMNS_NO_NODE)
            store_link(c, payload, first, c->families[f].size, b->byte[orphans++]);
}

/* e_parent and link of leaves, once their t and radius are there. */
static bool finish_leaf_families(const struct columns *c, const struct buffers *b,
                                 uint8_t *payload)
{
    uint32_t first = 0;
    bool ok = true;
    for (uint32_t f = 0; f < c->family_count; first += c->families[f++].size) {
        const uint32_t size = c->families[f].size;
        const uint32_t e_parent = ((uint32_t)family_error(c, payload, first, size) + b->word[f]) << c->e_shift;
        ok &= e_parent <= SPC_LEN_ROOT;
        for (uint32_t k = first; k < first + size; k++)
            store_u16(node_at(c, payload, k) + ND_E_PARENT, (uint16_t)e_parent);
        store_link(c, payload, first, size, b->byte[f]);
    }
    return ok;
}

static bool load_prelude(struct columns *c, const uint8_t *in)
{
    c->e_shift = in[CO_E_SHIFT];
    c->radius_shift = in[CO_RADIUS_SHIFT];
    c->height_shift = in[CO_HEIGHT_SHIFT];
    c->position_bits = in[CO_POSITION_BITS];
    return c->e_shift <= 8 && c->radius_shift <= 8 && c->height_shift <= 8 &&
           c->position_bits <= 127 &&
           (c->triangles ? c->radius_shift + c->height_shift + c->position_bits == 0
                         : all_zero(in + CO_VERTEX_BASE, CO_VERTEX_BASE_LEN));
}

static enum spc_status get_all(struct columns *c, struct planes_reader *r, uint8_t *kids,
                               struct buffers *b, uint8_t *payload, struct spc_error *err)
{
    enum spc_status status;
    const bool inner = c->block->kind == SPC_BLOCK_INNER;
    if (!(inner ? get_inner_families(c, r, kids, b, payload)
                : get_leaf_families(c, r, b, payload)))
        return corrupt(c, "families", err);
    status = c->triangles ? triangle_columns_get(c, r, payload, err)
                          : node_columns_get(c, r, payload, err);
    if (status != SPC_OK)
        return status;
    if (inner)
        finish_inner_families(c, b, payload);
    else if (!finish_leaf_families(c, b, payload))
        return corrupt(c, "errors of leaves", err);
    uint16_t cosine[SPC_NORMAL_CLUSTERS_MAX];
    planes_get16(r, cosine, c->frame->normal_clusters);
    for (uint32_t g = 0; g < c->frame->normal_clusters; g++)
        store_u16(payload + c->layout->groups + 4 * g + 2, cosine[g]);
    return SPC_OK;
}

enum spc_status columns_decode(const struct spc_block *block, const struct spc_block_layout *layout,
                               const struct spc_frame *frame, const uint8_t *in, size_t in_bytes,
                               uint8_t *payload, struct spc_error *err)
{
    struct columns c;
    struct planes_reader r;
    const uint32_t n = block->node_count, most = n + SPC_NORMAL_CLUSTERS_MAX;
    if (in_bytes < CO_SIZE || load_u32(in) == 0 || load_u32(in) > n)
        return spc_fail(err, SPC_CORRUPT, block->off, "columns of the block: prelude");
    enum spc_status status = init(&c, block, layout, frame, load_u32(in + CO_FAMILY_COUNT), err);
    if (status != SPC_OK)
        return status;
    struct buffers b = {malloc(most), malloc(most * sizeof *b.word)};
    uint8_t *kids = malloc(n);
    memset(payload, 0, layout->bytes);
    if (b.byte == NULL || b.word == NULL || kids == NULL)
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for the columns of a block");
    else if (!load_prelude(&c, in))
        status = corrupt(&c, "prelude", err);
    if (status == SPC_OK)
        status = planes_open(&r, plane_count(&c), 3 * most, in + CO_SIZE, in_bytes - CO_SIZE, err);
    if (status == SPC_OK) {
        if (c.triangles)
            memcpy(payload + layout->vertex_base, in + CO_VERTEX_BASE, CO_VERTEX_BASE_LEN);
        status = get_all(&c, &r, kids, &b, payload, err);
        if (!planes_close(&r) && status == SPC_OK)
            status = corrupt(&c, "a plane is not what it should be", err);
    }
    free(kids);
    free(b.byte);
    free(b.word);
    release(&c);
    return status;
}
