/*
 * soft_nodes.c - which nodes of a block are drawn, and where they are.
 *
 * The tests are those of interval.h, operation by operation, on vectors of nodes. What passes is
 * decoded straight into view coordinates: along the picture's axes a node near the view's axis keeps
 * its digits however far it is, as a narrow view of something distant needs.
 */
#include "soft_int.h"

#include "bytes.h"
#include "interval.h"
#include "paint.h"

struct decode {                     /* a block's records into view coordinates, units */
    float origin[3];                /* of the cluster */
    float step[3][3];               /* view axis, record axis */
    float axes[3][3];
};

static void make_interval(const struct soft_block *b, struct spv_interval *out)
{
    *out = (struct spv_interval){
        .origin = {(float)-b->tested_eye[0], (float)-b->tested_eye[1], (float)-b->tested_eye[2]},
        .step = ldexpf(1, b->b.step_exp - b->frame->header->unit_exp),
        .eps = (float)b->frame->tested->eps,
        .link_base = b->b.link_base,
        .lower = b->lower,
        .missing = b->missing,
    };
}

static void make_decode(const struct soft_block *b, float step, struct decode *out)
{
    for (int v = 0; v < 3; v++) {
        const double *axis = b->frame->axes[v];
        out->origin[v] =
            (float)-(axis[0] * b->eye[0] + axis[1] * b->eye[1] + axis[2] * b->eye[2]);
        for (int a = 0; a < 3; a++) {
            out->axes[v][a] = (float)axis[a];
            out->step[v][a] = (float)axis[a] * step;
        }
    }
}

SPV_INLINE float length_of(uint32_t code)
{
    return soft_float(code << 15);
}

SPV_INLINE void test_body(const struct spv_interval *in, const uint8_t *records, uint32_t n,
                          bool triangles, uint8_t *pass)
{
    const uint32_t upper = in->lower ? 0 : 1;
    for (uint32_t i = 0; i < n; i++) {
        const uint8_t *r = records + (size_t)SPC_NODE_BYTES * i;
        const uint32_t xy = load_u32(r), zn = load_u32(r + 4), errors = load_u32(r + 8),
                       rest = load_u32(r + 12);
        const float x = in->origin[0] + (float)(int)(xy & 0xFFFF) * in->step;
        const float y = in->origin[1] + (float)(int)(xy >> 16) * in->step;
        const float z = in->origin[2] + (float)(int)(zn & 0xFFFF) * in->step;
        const float rho = sqrtf(x * x + y * y + z * z) - length_of(rest & 0xFFFF);
        const float q = in->eps * rho, e_self = length_of(errors & 0xFFFF);
        if (triangles) {
            pass[i] = q <= e_self;
        } else {
            const uint32_t code = rest >> 24, e_parent = errors >> 16;
            const float link =
                soft_float((uint32_t)(in->link_base + 127 + (int)(code >> 3)) << 23 |
                           (code & 7) << 20);
            const uint32_t reach = q * (1 - 0x1p-20f) <= length_of(e_parent) + in->eps * link;
            const uint32_t fine = (e_self < q) | (e_self <= in->missing) | upper;
            pass[i] = (uint8_t)(fine & (reach | (e_parent == SPC_LEN_ROOT)));
        }
    }
}

SPV_INLINE void decode_body(const struct decode *d, struct soft_scratch *s, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t xy = s->record[0][i], zn = s->record[1][i];
        const float x = (float)(int)(xy & 0xFFFF), y = (float)(int)(xy >> 16),
                    z = (float)(int)(zn & 0xFFFF);
        const float u = (float)(int)(zn >> 16 & 0xFF) - 127, v = (float)(int)(zn >> 24) - 127;
        const float nz = 127 - soft_abs(u) - soft_abs(v);
        const float nx = nz < 0 ? (u < 0 ? soft_abs(v) - 127 : 127 - soft_abs(v)) : u;
        const float ny = nz < 0 ? (v < 0 ? soft_abs(u) - 127 : 127 - soft_abs(u)) : v;
        const float scale = 1 / sqrtf(nx * nx + ny * ny + nz * nz);
        for (int a = 0; a < 3; a++) {
            s->center[a][i] =
                d->origin[a] + (d->step[a][0] * x + d->step[a][1] * y + d->step[a][2] * z);
            s->normal[a][i] =
                scale * (d->axes[a][0] * nx + d->axes[a][1] * ny + d->axes[a][2] * nz);
        }
    }
}

/* A loop each, or the choice between them would be in it. */
SPV_INLINE void test_either(const struct spv_interval *in, const uint8_t *records, uint32_t n, bool triangles,
                            uint8_t *pass)
{
    if (triangles)
        test_body(in, records, n, true, pass);
    else
        test_body(in, records, n, false, pass);
}

SPV_VERSIONS(test, test_either,
             (const struct spv_interval *in, const uint8_t *records, uint32_t n, bool triangles, uint8_t *pass),
             (in, records, n, triangles, pass));
SPV_VERSIONS(decode, decode_body, (const struct decode *d, struct soft_scratch *s, uint32_t count), (d, s, count));

uint32_t spv_soft_gather(const struct soft_block *b, struct soft_scratch *s, uint32_t first,
                         uint32_t n, bool triangles)
{
    const uint8_t *records = b->payload + b->l.nodes + (size_t)SPC_NODE_BYTES * first;
    const enum spv_lanes lanes = b->frame->lanes;
    struct spv_interval in;
    struct decode d;
    uint32_t count = 0;
    make_interval(b, &in);
    if (b->frame->view->mode == SPV_TRIANGLES)
        memset(s->pass, triangles, n);
    else
        test[lanes](&in, records, n, triangles, s->pass);
    memset(s->pass + n, 0, SOFT_STRIDE);
    for (uint32_t i = 0; i < n; i += SOFT_STRIDE) {
        const uint32_t end = n - i < SOFT_STRIDE ? n : i + SOFT_STRIDE;
        if (load_u64(s->pass + i) == 0)         /* as often: of what is near each other much fails together */
            continue;
        for (uint32_t k = i; k < end; k++) {    /* written first, kept if it counts: no branch */
            const uint8_t *r = records + (size_t)SPC_NODE_BYTES * k;
            s->index[count] = first + k;
            s->record[0][count] = load_u32(r);
            s->record[1][count] = load_u32(r + 4);
            s->record[2][count] = load_u32(r + 12);
            count += s->pass[k];
        }
    }
    if (count > 0) {
        make_decode(b, in.step, &d);
        decode[lanes](&d, s, count);
    }
    return count;
}

/* Numbers of normal clusters, whose nodes lie one after another. */
static void paint_groups(const struct soft_block *b, struct soft_scratch *s, uint32_t count)
{
    const uint8_t *groups = b->payload + b->l.groups;
    uint32_t group = 0, end = b->l.groups ? load_u16(groups) : UINT32_MAX;
    for (uint32_t i = 0; i < count; i++) {
        while (s->index[i] >= end)
            end += load_u16(groups + 4 * (size_t)++group);
        s->base[i] = spv_paint_color(SPV_PAINT_NORMALS, 0, 0, group, false);
    }
}

void spv_soft_colors(const struct soft_block *b, struct soft_scratch *s, uint32_t count, bool triangles)
{
    const enum spv_paint paint = b->frame->paint;
    const uint8_t *colors = b->payload + b->l.colors;
    if (paint == SPV_PAINT_NORMALS) {
        paint_groups(b, s, count);
        return;
    }
    if (paint == SPV_PAINT_SCAN && b->l.colors) {
        for (uint32_t i = 0; i < count; i++)
            s->base[i] = load_u32(colors + 4 * (size_t)s->index[i]);
        return;
    }
    const uint32_t color = paint == SPV_PAINT_SCAN ? 0xFFFFFFFFu
                                                   : spv_paint_color(paint, b->b.cluster, b->c.level, 0, triangles);
    for (uint32_t i = 0; i < count; i++)
        s->base[i] = color;
}
