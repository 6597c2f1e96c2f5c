/*
 * Binary bodies, of either byte order.
 *
 * Vertices of fixed size, which are nearly all, go a column at a time: one loop per channel with
 * its type settled outside. Faces whose only list is the index list go through one loop that is
 * compiled for each common type of index and byte order. All else takes the general steps.
 */
#include "ply_int.h"

#include <inttypes.h>

#include "number.h"

static inline uint16_t get_u16(const uint8_t *p, bool big)
{
    const uint16_t v = load_u16(p);
    return big ? __builtin_bswap16(v) : v;
}

static inline uint32_t get_u32(const uint8_t *p, bool big)
{
    const uint32_t v = load_u32(p);
    return big ? __builtin_bswap32(v) : v;
}

static inline double get_f32(const uint8_t *p, bool big)
{
    const uint32_t bits = get_u32(p, big);
    float v;
    memcpy(&v, &bits, sizeof v);
    return (double)v;
}

static inline double get_f64(const uint8_t *p, bool big)
{
    uint64_t bits = load_u64(p);
    double v;
    if (big)
        bits = __builtin_bswap64(bits);
    memcpy(&v, &bits, sizeof v);
    return v;
}

static int64_t whole(double v)
{
    if (v > -0x1p63 && v < 0x1p63 && (double)(int64_t)v == v)
        return (int64_t)v;
    return SPB_NOT_WHOLE;
}

static inline int64_t get_int(unsigned type, const uint8_t *p, bool big)
{
    switch (type) {
    case PLY_I8: return (int8_t)*p;
    case PLY_U8: return *p;
    case PLY_I16: return (int16_t)get_u16(p, big);
    case PLY_U16: return get_u16(p, big);
    case PLY_I32: return (int32_t)get_u32(p, big);
    case PLY_U32: return get_u32(p, big);
    case PLY_F32: return whole(get_f32(p, big));
    default: return whole(get_f64(p, big));
    }
}

static inline double get_real(unsigned type, const uint8_t *p, bool big)
{
    switch (type) {
    case PLY_F32: return get_f32(p, big);
    case PLY_F64: return get_f64(p, big);
    default: return (double)get_int(type, p, big);
    }
}

/* ---- the general steps ---------------------------------------------------------------------- */

enum spc_status spb_ply_binary_row_begin(struct ply *ply, struct spc_error *err)
{
    const uint64_t rest = spb_bytes_rest(ply->bytes);

    if (rest < ply->element->row_bytes)
        return spb_ply_fail_end(ply, rest > 0, err);
    return SPC_OK;
}

/* Brings a value or values of the row under way into the window. */
static enum spc_status need_values(struct ply *ply, size_t bytes, struct spc_error *err)
{
    const enum spc_status status = spb_bytes_need(ply->bytes, bytes, err);

    if (status == SPC_OK && spb_bytes_have(ply->bytes) < bytes)
        return spb_ply_fail_end(ply, true, err);
    return status;
}

enum spc_status spb_ply_binary_list_count(struct ply *ply, const struct ply_property *property,
                                          uint64_t *count, struct spc_error *err)
{
    struct spb_bytes *const b = ply->bytes;
    const uint32_t bytes = ply_type_bytes(property->count_type);
    const enum spc_status status = need_values(ply, bytes, err);

    if (status != SPC_OK)
        return status;
    const int64_t value = get_int(property->count_type, b->buf + b->pos, ply->header.big_endian);
    if (value < 0)
        return spb_ply_fail_row(ply, SPC_INPUT_FORMAT, spb_bytes_off(b), err,
                                "%" PRId64 " is not a count of a list", value);
    *count = (uint64_t)value;
    const uint64_t list_bytes = *count * ply_type_bytes(property->type);    /* below 2^35 */
    if (list_bytes > b->file_bytes)
        return spb_ply_fail_list(ply, spb_bytes_off(b), *count, err);
    b->pos += bytes;
    return list_bytes > spb_bytes_rest(b) ? spb_ply_fail_end(ply, true, err) : SPC_OK;
}

enum spc_status spb_ply_binary_items(struct ply *ply, const struct ply_property *property,
                                     size_t count, int64_t *items, struct spc_error *err)
{
    struct spb_bytes *const b = ply->bytes;
    const size_t item_bytes = ply_type_bytes(property->type);
    const bool big = ply->header.big_endian;
    const enum spc_status status = need_values(ply, count * item_bytes, err);

    if (status != SPC_OK)
        return status;
    const uint8_t *p = b->buf + b->pos;
    for (size_t i = 0; i < count; i++, p += item_bytes)
        items[i] = get_int(property->type, p, big);
    b->pos += count * item_bytes;
    return SPC_OK;
}

enum spc_status spb_ply_binary_pass(struct ply *ply, const struct ply_property *property,
                                    struct spc_error *err)
{
    enum spc_status status = SPC_OK;
    uint64_t count = 1;

    if (property->count_type)
        status = spb_ply_binary_list_count(ply, property, &count, err);
    if (status != SPC_OK)
        return status;
    const uint64_t bytes = count * ply_type_bytes(property->type);
    if (bytes > spb_bytes_rest(ply->bytes))
        return spb_ply_fail_end(ply, true, err);
    spb_bytes_skip(ply->bytes, bytes);
    return SPC_OK;
}

/* ---- vertices ------------------------------------------------------------------------------- */

/* One coordinate of count rows, stride bytes apart, to out[0], out[3], ... */
static void coordinate_column(const uint8_t *p, size_t stride, size_t count, unsigned type,
                              bool big, double *out)
{
    if (type == PLY_F32) {
        for (size_t i = 0; i < count; i++)
            out[i * 3] = get_f32(p + i * stride, big);
    } else if (type == PLY_F64) {
        for (size_t i = 0; i < count; i++)
            out[i * 3] = get_f64(p + i * stride, big);
    } else {
        for (size_t i = 0; i < count; i++)
            out[i * 3] = get_real(type, p + i * stride, big);
    }
}

/* One colour channel to out[0], out[4], ... */
static void color_column(struct ply *ply, const uint8_t *p, size_t stride, size_t count,
                         unsigned type, unsigned role, uint8_t *out)
{
    if (type == PLY_NO_TYPE) {
        for (size_t i = 0; i < count; i++)
            out[i * 4] = 255;
    } else if (type == PLY_U8) {
        for (size_t i = 0; i < count; i++)
            out[i * 4] = p[i * stride];
    } else {
        for (size_t i = 0; i < count; i++)
            out[i * 4] = spb_ply_color(ply, type, role,
                                       get_real(type, p + i * stride, ply->header.big_endian));
    }
}

/* One component of normals to out[0], out[3], ... */
static void normal_column(const uint8_t *p, size_t stride, size_t count, unsigned type, bool big,
                          float *out)
{
    for (size_t i = 0; i < count; i++)
        out[i * 3] = (float)get_real(type, p + i * stride, big);
}

/* Vertices of fixed size: as many as the window holds, at a time. */
static enum spc_status fixed_vertices(struct ply *ply, struct spb_vertex_batch *out,
                                      struct spc_error *err)
{
    struct spb_bytes *const b = ply->bytes;
    const struct ply_channel *const channel = ply->header.channel;
    const size_t stride = ply->element->row_bytes;

    while (out->count < SPB_BATCH_MAX && ply->row < ply->element->count) {
        const enum spc_status status = spb_bytes_need(b, stride, err);
        if (status != SPC_OK)
            return status;
        size_t count = spb_bytes_have(b) / stride;
        if (count == 0)
            return spb_ply_fail_end(ply, spb_bytes_have(b) > 0, err);
        if (count > SPB_BATCH_MAX - out->count)
            count = SPB_BATCH_MAX - out->count;
        if (count > ply->element->count - ply->row)
            count = (size_t)(ply->element->count - ply->row);
        const uint8_t *const rows = b->buf + b->pos;
        for (int i = PLY_X; i <= PLY_Z; i++)
            coordinate_column(rows + channel[i].off, stride, count, channel[i].type,
                              ply->header.big_endian, &out->xyz[out->count][i]);
        for (int i = PLY_RED; i <= PLY_ALPHA && ply->header.colors; i++)
            color_column(ply, rows + channel[i].off, stride, count, channel[i].type,
                         (unsigned)i, &out->rgba[out->count][i - PLY_RED]);
        for (int i = PLY_NX; i <= PLY_NZ && ply->header.normals; i++)
            normal_column(rows + channel[i].off, stride, count, channel[i].type,
                          ply->header.big_endian, &out->normal[out->count][i - PLY_NX]);
        b->pos += count * stride;
        ply->row += count;
        out->count += count;
    }
    return SPC_OK;
}

static enum spc_status one_vertex(struct ply *ply, double xyz[3], uint8_t rgba[4],
                                  float normal[3], struct spc_error *err)
{
    struct spb_bytes *const b = ply->bytes;
    const struct ply_element *const e = ply->element;
    const struct ply_property *const properties = &ply->header.property[e->property_first];
    enum spc_status status = spb_ply_binary_row_begin(ply, err);

    rgba[3] = 255;
    for (uint32_t k = 0; k < e->property_count && status == SPC_OK; k++) {
        const struct ply_property *const p = &properties[k];
        const uint32_t bytes = ply_type_bytes(p->type);
        if (p->role == PLY_NO_ROLE) {
            status = spb_ply_binary_pass(ply, p, err);
            continue;
        }
        status = need_values(ply, bytes, err);
        if (status != SPC_OK)
            break;
        const double value = get_real(p->type, b->buf + b->pos, ply->header.big_endian);
        b->pos += bytes;
        if (p->role <= PLY_Z)
            xyz[p->role] = value;
        else if (p->role >= PLY_NX)
            normal[p->role - PLY_NX] = (float)value;
        else
            rgba[p->role - PLY_RED] = spb_ply_color(ply, p->type, p->role, value);
    }
    return status;
}

enum spc_status spb_ply_binary_vertices(struct ply *ply, struct spb_vertex_batch *out,
                                        struct spc_error *err)
{
    if (ply->element->list_count == 0 && ply->element->count > 0)
        return fixed_vertices(ply, out, err);
    while (out->count < SPB_BATCH_MAX && ply->row < ply->element->count) {
        const enum spc_status status = one_vertex(ply, out->xyz[out->count], out->rgba[out->count],
                                                  out->normal[out->count], err);
        if (status != SPC_OK)
            return status;
        ply->row++;
        out->count++;
    }
    return SPC_OK;
}

/* ---- faces ---------------------------------------------------------------------------------- */

struct face_layout {
    size_t before, after;               /* bytes around the list, its count excluded */
    unsigned count_type, type;
};

static inline uint64_t get_corner(unsigned type, const uint8_t *p, bool big)
{
    const int64_t v = get_int(type, p, big);
    return v < 0 ? SPB_BAD_INDEX : (uint64_t)v;
}

/* type and big are constants where this is called, so that no switch is left in the loop. */
static inline __attribute__((always_inline)) void
take_faces(struct ply *ply, struct spb_face_batch *out, const struct face_layout *layout,
           unsigned type, bool big)
{
    struct spb_bytes *const b = ply->bytes;
    const size_t item = ply_type_bytes(type);
    const size_t head = layout->before + ply_type_bytes(layout->count_type);
    uint64_t rows = ply->element->count - ply->row;

    for (; rows > 0 && spb_bytes_have(b) >= head; rows--) {
        const uint8_t *p = b->buf + b->pos;
        const int64_t count = get_int(layout->count_type, p + layout->before, big);
        if (count < 3 || count > 255 || (size_t)count - 2 > SPB_BATCH_MAX - out->count)
            break;
        const size_t bytes = head + (size_t)count * item + layout->after;
        if (spb_bytes_have(b) < bytes)
            break;
        p += head;
        const uint64_t first = get_corner(type, p, big);
        uint64_t previous = get_corner(type, p + item, big);
        for (int64_t k = 2; k < count; k++) {
            uint64_t *const corner = out->corner[out->count++];
            corner[0] = first;
            corner[1] = previous;
            corner[2] = previous = get_corner(type, p + (size_t)k * item, big);
        }
        b->pos += bytes;
        ply->row++;
        out->faces_in++;
        out->split_extra += (uint64_t)count - 3;
    }
}

enum spc_status spb_ply_binary_faces(struct ply *ply, struct spb_face_batch *out,
                                     struct spc_error *err)
{
    const struct ply_element *const e = ply->element;
    const struct ply_property *const list = &ply->header.property[e->index_property];
    struct face_layout layout = { .count_type = list->count_type, .type = list->type };
    const bool big = ply->header.big_endian;
    const enum spc_status status = spb_bytes_need(ply->bytes, e->row_bytes, err);

    if (status != SPC_OK)
        return status;
    for (uint32_t k = 0; k < e->property_count; k++) {
        const uint32_t property = e->property_first + k;
        if (property < e->index_property)
            layout.before += ply_type_bytes(ply->header.property[property].type);
        else if (property > e->index_property)
            layout.after += ply_type_bytes(ply->header.property[property].type);
    }
    if (layout.type == PLY_I32 && big)
        take_faces(ply, out, &layout, PLY_I32, true);
    else if (layout.type == PLY_I32)
        take_faces(ply, out, &layout, PLY_I32, false);
    else if (layout.type == PLY_U32 && big)
        take_faces(ply, out, &layout, PLY_U32, true);
    else if (layout.type == PLY_U32)
        take_faces(ply, out, &layout, PLY_U32, false);
    else
        take_faces(ply, out, &layout, layout.type, big);
    return SPC_OK;
}
