#include "kept.h"

#include "bytes.h"
#include "layout.h"

#include <math.h>
#include <stdlib.h>

enum { GROUPED_MIN = 1024 };        /* leaves of a block that are worth 128 tests of cones */

bool spv_kept_grouped(const struct spc_block *b)
{
    return b->kind == SPC_BLOCK_LEAF && b->node_count >= GROUPED_MIN;
}

/* Places by code, largest first: a counting sort, one byte after the other, each keeping what was equal. */
static void sort_codes(const uint8_t *nodes, uint32_t first, uint32_t n, uint32_t *order, uint32_t *other)
{
    for (uint32_t i = 0; i < n; i++)
        order[i] = first + i;
    for (size_t byte = 0; byte < 2; byte++) {
        uint32_t start[257] = {0};
        for (uint32_t i = 0; i < n; i++)
            start[256 - nodes[(size_t)SPC_NODE_BYTES * order[i] + ND_E_PARENT + byte]]++;
        for (int k = 1; k <= 256; k++)
            start[k] += start[k - 1];
        for (uint32_t i = 0; i < n; i++) {
            const uint32_t node = order[i];
            const unsigned code = nodes[(size_t)SPC_NODE_BYTES * node + ND_E_PARENT + byte];
            other[start[255 - code]++] = node;
        }
        uint32_t *swap = order;
        order = other;
        other = swap;
    }
}

/* Each group by itself: small ones by insertion, which costs what there is to do. */
static void sort_groups(const uint8_t *nodes, const uint8_t *groups, uint32_t group_count, uint32_t *order,
                        uint32_t *other)
{
    enum { FEW = 48 };
    uint32_t first = 0;
    for (uint32_t g = 0; g < group_count; g++) {
        const uint32_t n = load_u16(groups + 4 * (size_t)g);
        if (n > FEW)
            sort_codes(nodes, first, n, order + first, other);
        for (uint32_t i = 0; i < n && n <= FEW; i++) {
            const uint16_t code = load_u16(nodes + (size_t)SPC_NODE_BYTES * (first + i) + ND_E_PARENT);
            uint32_t k = first + i;
            for (; k > first && load_u16(nodes + (size_t)SPC_NODE_BYTES * order[k - 1] + ND_E_PARENT) < code; k--)
                order[k] = order[k - 1];
            order[k] = first + i;
        }
        first += n;
    }
}

/* Elements of a payload's array into their new places. room: n times bytes. */
static void permute(uint8_t *array, size_t bytes, const uint32_t *order, uint32_t n, uint8_t *room)
{
    for (uint32_t i = 0; i < n; i++)
        memcpy(room + bytes * i, array + bytes * order[i], bytes);
    memcpy(array, room, bytes * n);
}

enum spc_status spv_kept_sort(const struct spc_reader *reader, uint32_t block, uint8_t *payload, struct spc_error *err)
{
    const struct spc_header *h = spc_reader_header(reader);
    struct spc_block b;
    struct spc_block_layout l;
    spc_reader_block(reader, block, &b);
    spc_block_layout(&b, h->flags, h->normal_clusters, &l);
    const uint32_t n = b.node_count;
    uint32_t *order = malloc((size_t)n * (2 * sizeof *order + SPC_NODE_BYTES) + 1);
    if (order == NULL)
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to sort a block");
    uint8_t *room = (uint8_t *)(order + 2 * (size_t)n);
    if (spv_kept_grouped(&b))
        sort_groups(payload + l.nodes, payload + l.groups, h->normal_clusters, order, order + n);
    else
        sort_codes(payload + l.nodes, 0, n, order, order + n);
    permute(payload + l.nodes, SPC_NODE_BYTES, order, n, room);
    if (l.colors)
        permute(payload + l.colors, 4, order, n, room);
    if (l.indices)
        permute(payload + l.indices, 6, order, n, room);
    if (!spv_kept_grouped(&b))
        memset(payload + l.groups, 0, 4 * (size_t)h->normal_clusters);
    if (l.children)
        memset(payload + l.children, 0, (n + 1) / 2);
    free(order);
    return SPC_OK;
}

/* How many of n codes, which fall, reach least. */
static uint32_t prefix_of(const uint8_t *codes, size_t stride, uint32_t n, double least)
{
    uint32_t low = 0, high = n;     /* those before low do, those from high on do not */
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        if ((double)spc_len_decode(load_u16(codes + stride * middle)) >= least)         /* of the root: infinity */
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static void add_range(struct spv_ranges *out, uint32_t first, uint32_t n)
{
    const uint32_t last = out->count - 1;
    if (n == 0)
        return;
    if (out->count > 0 && (uint32_t)(out->first[last] + out->nodes[last]) == first) {
        out->nodes[last] += (int)n;
        return;
    }
    out->first[out->count] = (int)first;
    out->nodes[out->count++] = (int)n;
}

void spv_kept_ranges(const struct spc_reader *reader, const struct spv_view *tested, const struct spc_block *b,
                     const struct spc_cluster *c, const double eye[3], const uint8_t *codes, size_t stride,
                     const uint8_t *groups, struct spv_ranges *out)
{
    const double least = tested->eps * (sqrt(spv_box_distance2(c, eye)) * (1 - 0x1p-18) - (double)b->link_max);
    const bool all = tested->mode == SPV_TRIANGLES || (double)b->e_parent_min >= least;
    uint32_t first = 0;
    out->count = 0;
    if (!spv_kept_grouped(b)) {
        add_range(out, 0, all ? b->node_count : prefix_of(codes, stride, b->node_count, least));
        return;
    }
    const bool cull = spv_culls_back(reader, tested);
    for (uint32_t g = 0; g < spc_reader_header(reader)->normal_clusters; g++) {
        const uint32_t n = load_u16(groups + 4 * (size_t)g);
        const uint32_t take = n == 0 || all ? n : prefix_of(codes + stride * first, stride, n, least);
        if (take > 0 && !(cull && spv_group_behind(reader, c, eye, g, groups)))
            add_range(out, first, take);
        first += n;
    }
}
