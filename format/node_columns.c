/*
 * node_columns.c - nodes told from the nodes they are like (spec section 6.4.2).
 *
 * In an inner block that is the parent, where it lies in the block; else, and in a block of leaves
 * without triangles, the node before. Radii and errors shrink, normals turn little, and a centre lies
 * within the parent's disk or beside a neighbour's, on a lattice as coarse as the node's own radius
 * allows: small numbers all of them.
 */
#include "columns.h"

#include "bytes.h"
#include "format_int.h"

#include <math.h>
#include <stdlib.h>

static const uint8_t NOTHING[ND_SIZE] = {[ND_NORMAL] = 127, [ND_NORMAL + 1] = 127};
static const uint8_t WHITE[4] = {255, 255, 255, 255};

/* scale: units per position step. */
static inline uint8_t link_code(const uint8_t *p, const uint8_t *parent, double scale,
                                double diagonal, int link_base)
{
    double square = 0;
    for (int a = 0; a < 3; a++) {
        const double d = load_u16(p + ND_X + 2 * a) - load_u16(parent + ND_X + 2 * a);
        square += d * d;
    }
    const double radius = (double)spc_len_decode(load_u16(p + ND_RADIUS));
    const double above = (double)spc_len_decode(load_u16(parent + ND_RADIUS));
    const double more = above > radius ? above - radius : 0;
    return spc_link_bound((sqrt(square) * scale + more + diagonal * 0x1p-20) * (1 + 0x1p-40),
                          link_base);
}

uint8_t spc_link_record(const struct spc_block *b, const struct spc_frame *frame,
                        const uint8_t *p, const uint8_t *parent)
{
    return link_code(p, parent, ldexp(1, b->step_exp - frame->unit_exp), (double)b->diagonal,
                     b->link_base);
}

static const uint8_t *model_of(const struct columns *c, const uint8_t *payload, uint32_t i)
{
    return c->like[i] == COLUMNS_NO_NODE
        ? NOTHING
        : payload + c->layout->nodes + (size_t)ND_SIZE * c->place[c->like[i]];
}

static const uint8_t *record_of(const struct columns *c, const uint8_t *payload, uint32_t i)
{
    return payload + c->layout->nodes + (size_t)ND_SIZE * c->place[i];
}

/* ---- encoding ---------------------------------------------------------------------------------- */

static bool positions_fit(const struct columns *c, const uint8_t *payload)
{
    for (uint32_t i = 0; i < c->n; i++) {
        const uint8_t *p = payload + c->layout->nodes + (size_t)ND_SIZE * i;
        const int shift = position_shift(c, load_u16(p + ND_RADIUS));
        const uint32_t any = load_u16(p + ND_X) | load_u16(p + ND_Y) | load_u16(p + ND_Z);
        if (any & ((1u << shift) - 1))
            return false;
    }
    return true;
}

static int low_zeros(uint32_t all)
{
    int k = 0;
    while (k < 8 && !(all >> k & 1))
        k++;
    return k;
}

void node_columns_measure(struct columns *c, const uint8_t *payload)
{
    uint32_t errors = 0, radii = 0, heights = 0;
    for (uint32_t i = 0; i < c->n; i++) {
        const uint8_t *p = payload + c->layout->nodes + (size_t)ND_SIZE * i;
        errors |= load_u16(p + ND_E_PARENT);
        if (c->triangles)
            continue;               /* all else follows from the triangle */
        errors |= load_u16(p + ND_E_SELF);
        radii |= load_u16(p + ND_RADIUS);
        heights |= (uint32_t)~p[ND_HEIGHT] & 255;
    }
    c->e_shift = low_zeros(errors);
    if (c->triangles)
        return;
    c->radius_shift = low_zeros(radii);
    c->height_shift = low_zeros(heights);
    while (c->position_bits < 127 && !positions_fit(c, payload))
        c->position_bits++;
}

static void put_positions(const struct columns *c, const uint8_t *payload, uint16_t *word,
                          struct planes_writer *w)
{
    for (int a = 0; a < 3; a++) {
        for (uint32_t i = 0; i < c->n; i++) {
            const uint8_t *p = record_of(c, payload, i);
            const int shift = position_shift(c, load_u16(p + ND_RADIUS));
            const int was = load_u16(model_of(c, payload, i) + ND_X + 2 * a) >> shift;
            word[i] = zigzag16((uint16_t)((load_u16(p + ND_X + 2 * a) >> shift) - was));
        }
        planes_put16(w, word, c->n);
    }
}

/* Green, and what red and blue change beside it. */
void columns_color_difference(const uint8_t *rgba, const uint8_t *was, uint8_t d[4])
{
    d[1] = (uint8_t)(rgba[1] - was[1]);
    d[0] = (uint8_t)(rgba[0] - was[0] - d[1]);
    d[2] = (uint8_t)(rgba[2] - was[2] - d[1]);
    d[3] = (uint8_t)(rgba[3] - was[3]);
    for (int k = 0; k < 4; k++)
        d[k] = zigzag8(d[k]);
}

void columns_color_sum(const uint8_t d[4], const uint8_t *was, uint8_t *rgba)
{
    const uint8_t g = unzigzag8(d[1]);
    rgba[0] = (uint8_t)(was[0] + unzigzag8(d[0]) + g);
    rgba[1] = (uint8_t)(was[1] + g);
    rgba[2] = (uint8_t)(was[2] + unzigzag8(d[2]) + g);
    rgba[3] = (uint8_t)(was[3] + unzigzag8(d[3]));
}

static const uint8_t *color_model(const struct columns *c, const uint8_t *payload, uint32_t i)
{
    return c->like[i] == COLUMNS_NO_NODE
        ? WHITE : payload + c->layout->colors + 4 * (size_t)c->place[c->like[i]];
}

static void put_colors(const struct columns *c, const uint8_t *payload, uint8_t *byte,
                       struct planes_writer *w)
{
    for (int k = 0; k < 4; k++) {
        for (uint32_t i = 0; i < c->n; i++) {
            uint8_t d[4];
            columns_color_difference(payload + c->layout->colors + 4 * (size_t)c->place[i],
                                     color_model(c, payload, i), d);
            byte[i] = d[k];
        }
        planes_put8(w, byte, c->n);
    }
}

size_t node_columns_memory(uint32_t n)
{
    return encoder_share(n * sizeof(uint16_t)) + encoder_share(n);
}

void node_columns_put(const struct columns *c, const uint8_t *payload, struct planes_writer *w)
{
    uint16_t *word = encoder_take(w->encoder, c->n * sizeof *word);
    uint8_t *byte = encoder_take(w->encoder, c->n);
    put_positions(c, payload, word, w);
    for (int k = 0; k < 2; k++) {
        for (uint32_t i = 0; i < c->n; i++)
            byte[i] = zigzag8((uint8_t)(record_of(c, payload, i)[ND_NORMAL + k] -
                                        model_of(c, payload, i)[ND_NORMAL + k]));
        planes_put8(w, byte, c->n);
    }
    for (uint32_t i = 0; i < c->n; i++)
        word[i] = zigzag16((uint16_t)((load_u16(model_of(c, payload, i) + ND_RADIUS) >>
                                       c->radius_shift) -
                                      (load_u16(record_of(c, payload, i) + ND_RADIUS) >>
                                       c->radius_shift)));
    planes_put16(w, word, c->n);
    for (uint32_t i = 0; i < c->n; i++) {
        const uint8_t *p = record_of(c, payload, i);
        const bool inner = c->block->kind == SPC_BLOCK_INNER;
        const int from = inner ? load_u16(p + ND_E_PARENT)
                               : load_u16(model_of(c, payload, i) + ND_E_SELF);
        const uint16_t d = (uint16_t)(from - load_u16(p + ND_E_SELF));
        word[i] = (uint16_t)(inner ? d >> c->e_shift : zigzag16(d));
    }
    planes_put16(w, word, c->n);
    for (uint32_t i = 0; i < c->n; i++)
        byte[i] = (uint8_t)(record_of(c, payload, i)[ND_HEIGHT] >> c->height_shift);
    planes_put8(w, byte, c->n);
    if (c->layout->colors)
        put_colors(c, payload, byte, w);
}

/* ---- decoding ---------------------------------------------------------------------------------- */

struct node_arrays {                /* [n] each, in one allocation */
    uint16_t *position[3], *radius, *error;
    uint8_t *normal[2], *height, *color[4];
};

static void *arrays_create(uint32_t n, struct node_arrays *out)
{
    uint16_t *word = malloc((size_t)n * (5 * sizeof *word + 7));
    if (word == NULL)
        return NULL;
    for (uint32_t k = 0; k < 3; k++)
        out->position[k] = word + (size_t)n * k;
    out->radius = word + (size_t)n * 3;
    out->error = word + (size_t)n * 4;
    uint8_t *byte = (uint8_t *)(word + (size_t)n * 5);
    for (uint32_t k = 0; k < 2; k++)
        out->normal[k] = byte + (size_t)n * k;
    out->height = byte + (size_t)n * 2;
    for (uint32_t k = 0; k < 4; k++)
        out->color[k] = byte + (size_t)n * (3 + k);
    return word;
}

/* child: its model is its parent. */
static void get_node(const struct columns *c, const struct node_arrays *in, uint32_t i, bool child,
                     double scale, uint8_t *payload)
{
    uint8_t *p = payload + c->layout->nodes + (size_t)ND_SIZE * c->place[i];
    const uint8_t *model = model_of(c, payload, i);
    const bool inner = c->block->kind == SPC_BLOCK_INNER;
    const uint32_t radius = (uint32_t)(load_u16(model + ND_RADIUS) >> c->radius_shift) -
                            unzigzag16(in->radius[i]);
    store_u16(p + ND_RADIUS, (uint16_t)(radius << c->radius_shift));
    const int shift = position_shift(c, load_u16(p + ND_RADIUS));
    for (int a = 0; a < 3; a++) {
        const uint32_t was = (uint32_t)load_u16(model + ND_X + 2 * a) >> shift;
        store_u16(p + ND_X + 2 * a,
                  (uint16_t)((was + unzigzag16(in->position[a][i])) << shift));
    }
    for (int k = 0; k < 2; k++)
        p[ND_NORMAL + k] = (uint8_t)(model[ND_NORMAL + k] + unzigzag8(in->normal[k][i]));
    if (child)
        store_u16(p + ND_E_PARENT, load_u16(model + ND_E_SELF));
    const uint32_t e = inner ? load_u16(p + ND_E_PARENT) - ((uint32_t)in->error[i] << c->e_shift)
                             : (uint32_t)load_u16(model + ND_E_SELF) - unzigzag16(in->error[i]);
    store_u16(p + ND_E_SELF, (uint16_t)e);
    p[ND_HEIGHT] = (uint8_t)(in->height[i] << c->height_shift | ((1 << c->height_shift) - 1));
    if (child)
        p[ND_LINK] = link_code(p, model, scale, (double)c->block->diagonal, c->block->link_base);
    if (c->layout->colors) {
        const uint8_t d[4] = {in->color[0][i], in->color[1][i], in->color[2][i], in->color[3][i]};
        columns_color_sum(d, color_model(c, payload, i),
                          payload + c->layout->colors + 4 * (size_t)c->place[i]);
    }
}

enum spc_status node_columns_get(const struct columns *c, struct planes_reader *r,
                                 uint8_t *payload, struct spc_error *err)
{
    struct node_arrays in;
    void *memory = arrays_create(c->n, &in);
    if (memory == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for the columns of a block");
    for (int a = 0; a < 3; a++)
        planes_get16(r, in.position[a], c->n);
    for (int k = 0; k < 2; k++)
        planes_get8(r, in.normal[k], c->n);
    planes_get16(r, in.radius, c->n);
    planes_get16(r, in.error, c->n);
    planes_get8(r, in.height, c->n);
    for (int k = 0; k < 4 && c->layout->colors; k++)
        planes_get8(r, in.color[k], c->n);
    const double scale = ldexp(1, c->block->step_exp - c->frame->unit_exp);
    for (uint32_t f = 0, i = 0; f < c->family_count; f++) {
        const struct spc_family *family = &c->families[f];
        const bool child = c->block->kind == SPC_BLOCK_INNER && family->parent != COLUMNS_NO_NODE;
        for (const uint32_t end = i + family->size; i < end; i++)
            get_node(c, &in, i, child, scale, payload);
    }
    free(memory);
    return SPC_OK;
}
