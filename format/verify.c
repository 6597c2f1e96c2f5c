/*
 * verify.c - proves that an archive is whole, level by level (spec section 9).
 *
 * Level 2 looks at every byte and at each block alone; level 3 (verify_tree.c) at the tree. Each invariant is
 * reported once as held or broken, with its first places.
 */
#include "verify_int.h"

#include "bytes.h"

#include <math.h>
#include <stdlib.h>

enum { PLACES_MAX = 10 };

void spc_check_begin(struct spc_check *check, spc_finding_fn fn, void *ctx, const char *invariant)
{
    check->fn = fn;
    check->ctx = ctx;
    check->invariant = invariant;
    check->places = 0;
}

void spc_check_fault(struct spc_check *check, enum spc_status status, uint64_t at_off,
                     const char *what)
{
    struct spc_finding finding = {.invariant = check->invariant};
    spc_fail(&finding.error, status, at_off, "%s", what);
    if (check->total->status == SPC_OK)
        *check->total = finding.error;
    if (check->places++ < PLACES_MAX && check->fn != NULL)
        check->fn(check->ctx, &finding);
}

void spc_check_end(struct spc_check *check)
{
    const struct spc_finding finding = {.invariant = check->invariant, .ok = true};
    if (check->places == 0 && check->fn != NULL)
        check->fn(check->ctx, &finding);
}

/* ---- level 2: chunks ------------------------------------------------------------------------- */

enum { L2_CHUNKS, L2_RANGES, L2_ORDER, L2_BOXES, L2_SUBTREES, L2_COUNT };
static const char *const L2_NAMES[L2_COUNT] = {
    "every chunk: checksum, header, padding, codes",
    "ranges of blocks and clusters are exactly those of their nodes",
    "blocks are in prefix order, links of later blocks never grow",
    "boxes and spheres hold their nodes with radii",
    "boxes, spheres and counts of subtrees hold their clusters",
};

struct ranges {                     /* what a cluster's nodes turn out to span */
    float e_self_min, e_self_max, e_parent_min, e_parent_max, radius_min, radius_max, link_max;
};

static void widen(float v, float *min, float *max)
{
    *min = v < *min ? v : *min;
    *max = v > *max ? v : *max;
}

static bool inside_box(const float box[6], const double rel[3], double radius)
{
    for (int a = 0; a < 3; a++)
        if (rel[a] - radius < (double)box[a] || rel[a] + radius > (double)box[a + 3])
            return false;
    return true;
}

static bool inside_sphere(const float s[4], const double rel[3], double radius)
{
    const double d[3] = {rel[0] - (double)s[0], rel[1] - (double)s[1], rel[2] - (double)s[2]};
    const double dist = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    return dist + radius <= (double)s[3];
}

/* Diagonal of a box, rounded up: as blocks carry it for their links. */
static float box_diagonal(const float box[6])
{
    double square = 0;
    for (int a = 0; a < 3; a++) {
        const double side = (double)box[a + 3] - (double)box[a];
        square += side * side;
    }
    const double diagonal = sqrt(square);
    const float f = (float)diagonal;
    return (double)f < diagonal ? nextafterf(f, HUGE_VALF) : f;
}

/* Scans one decoded block. Returns its link_max; the other ranges go into r. */
static float scan_block(const struct spc_reader *reader, const struct spc_cluster *c,
                        const struct spc_block *b, const struct spc_block_layout *l,
                        const uint8_t *payload, struct ranges *r, struct spc_check *checks)
{
    float e_parent_min = HUGE_VALF, e_parent_max = 0, e_self_min = HUGE_VALF, radius_max = 0;
    float link_max = 0;
    bool boxes_ok = true;
    for (uint32_t i = 0; i < b->node_count; i++) {
        struct spc_node n;
        spc_node_decode(reader, b, l, payload, i, &n);
        const float e_self = spc_len_decode(n.e_self);
        const float e_parent = spc_len_decode(n.e_parent);
        widen(e_parent, &e_parent_min, &e_parent_max);
        e_self_min = e_self < e_self_min ? e_self : e_self_min;
        radius_max = (float)n.radius > radius_max ? (float)n.radius : radius_max;
        link_max = (float)n.link > link_max ? (float)n.link : link_max;
        widen(e_self, &r->e_self_min, &r->e_self_max);
        widen(e_parent, &r->e_parent_min, &r->e_parent_max);
        widen((float)n.radius, &r->radius_min, &r->radius_max);
        double rel[3];
        for (int a = 0; a < 3; a++)
            rel[a] = ldexp(n.center[a] - c->origin[a], -reader->header.unit_exp);
        boxes_ok &= inside_box(c->box, rel, n.radius) && inside_sphere(c->sphere, rel, n.radius);
    }
    if (e_parent_min != b->e_parent_min || e_parent_max != b->e_parent_max ||
        e_self_min != b->e_self_min || radius_max != b->radius_max ||
        box_diagonal(c->box) != b->diagonal)
        spc_check_fault(&checks[L2_RANGES], SPC_CORRUPT, b->off,
                        "a block's ranges are not those of its nodes");
    if (!boxes_ok)
        spc_check_fault(&checks[L2_BOXES], SPC_CORRUPT, b->off,
                        "a node sticks out of its cluster's box or sphere");
    return link_max;
}

static void check_order(const struct spc_cluster *c, const struct spc_block *blocks,
                        const float *links, struct spc_check *check)
{
    float later = 0;                /* largest link of this and all later blocks */
    float e_min[2] = {HUGE_VALF, HUGE_VALF};
    for (uint32_t k = c->block_count; k-- > 0;) {
        later = links[k] > later ? links[k] : later;
        if (blocks[k].link_max != later)
            spc_check_fault(check, SPC_CORRUPT, blocks[k].off,
                            "a block's link range is not that of this and all later blocks");
    }
    for (uint32_t k = 0; k < c->block_count; k++) {
        const struct spc_block *b = &blocks[k];
        if (b->e_parent_max > e_min[b->kind] ||
            (k > 0 && b->e_parent_max > blocks[k - 1].e_parent_max))
            spc_check_fault(check, SPC_CORRUPT, b->off, "blocks are not in prefix order");
        e_min[b->kind] = b->e_parent_min;
    }
}

static enum spc_status check_cluster_blocks(const struct spc_reader *reader, uint32_t id,
                                            struct spc_check *checks, struct spc_error *err)
{
    struct spc_cluster c;
    spc_reader_cluster(reader, id, &c);
    struct ranges r = {HUGE_VALF, 0, HUGE_VALF, 0, HUGE_VALF, 0, 0};
    struct spc_block *blocks = calloc(c.block_count, sizeof *blocks);
    float *links = calloc(c.block_count, sizeof *links);
    enum spc_status status = SPC_OK;
    bool whole = true;
    if (blocks == NULL || links == NULL)
        status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to verify a cluster");
    for (uint32_t k = 0; k < c.block_count && status == SPC_OK; k++) {
        struct spc_block_layout layout;
        struct spc_error error = {0};
        spc_reader_block(reader, c.block_first + k, &blocks[k]);
        spc_block_layout(&blocks[k], reader->header.flags, reader->header.normal_clusters, &layout);
        uint8_t *payload = malloc(layout.bytes);
        if (payload == NULL) {
            status = spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a block");
        } else if (spc_block_decode(reader, c.block_first + k, true, payload, &error) == SPC_OK) {
            links[k] = scan_block(reader, &c, &blocks[k], &layout, payload, &r, checks);
        } else {
            spc_check_fault(&checks[L2_CHUNKS], error.status, error.at_off, error.what);
            whole = false;
        }
        free(payload);
    }
    if (status == SPC_OK && whole) {
        check_order(&c, blocks, links, &checks[L2_ORDER]);
        if (r.e_self_min != c.e_self_min || r.e_self_max != c.e_self_max ||
            r.e_parent_min != c.e_parent_min || r.e_parent_max != c.e_parent_max ||
            r.radius_min != c.radius_min || r.radius_max != c.radius_max ||
            blocks[0].link_max != c.link_max)
            spc_check_fault(&checks[L2_RANGES], SPC_CORRUPT,
                            reader->sections[SE_CLUS].off + (uint64_t)id * CL_SIZE,
                            "a cluster's ranges are not those of its nodes");
    }
    free(links);
    free(blocks);
    return status;
}

static bool box_within(const struct spc_cluster *in, const float inner[6],
                       const struct spc_cluster *out, const float outer[6], int unit_exp)
{
    for (int a = 0; a < 3; a++) {
        const double shift = ldexp(in->origin[a] - out->origin[a], -unit_exp);
        if ((double)inner[a] + shift < (double)outer[a] ||
            (double)inner[a + 3] + shift > (double)outer[a + 3])
            return false;
    }
    return true;
}

static bool sphere_within(const struct spc_cluster *in, const float inner[4],
                          const struct spc_cluster *out, const float outer[4], int unit_exp)
{
    double rel[3];
    for (int a = 0; a < 3; a++)
        rel[a] = (double)inner[a] + ldexp(in->origin[a] - out->origin[a], -unit_exp);
    return inside_sphere(outer, rel, (double)inner[3]);
}

static void check_subtrees(const struct spc_reader *reader, struct spc_check *check)
{
    const int unit = reader->header.unit_exp;
    for (uint32_t id = 0; id < reader->header.cluster_count; id++) {
        struct spc_cluster c, child;
        spc_reader_cluster(reader, id, &c);
        uint64_t leaves = c.leaf_count;
        float link = c.link_max, radius = c.radius_max;
        bool ok = box_within(&c, c.box, &c, c.sub_box, unit) &&
                  sphere_within(&c, c.sphere, &c, c.sub_sphere, unit);
        for (uint32_t k = 0; k < c.child_count; k++) {
            spc_reader_cluster(reader, c.child_first + k, &child);
            leaves += child.leaves_below;
            link = child.sub_link_max > link ? child.sub_link_max : link;
            radius = child.sub_radius_max > radius ? child.sub_radius_max : radius;
            ok &= box_within(&child, child.sub_box, &c, c.sub_box, unit) &&
                  sphere_within(&child, child.sub_sphere, &c, c.sub_sphere, unit);
        }
        if (!ok || leaves != c.leaves_below || link != c.sub_link_max ||
            radius != c.sub_radius_max)
            spc_check_fault(check, SPC_CORRUPT,
                            reader->sections[SE_CLUS].off + (uint64_t)id * CL_SIZE,
                            "a cluster's subtree bounds do not hold its children");
    }
}

static enum spc_status verify_chunks(const struct spc_reader *reader, spc_finding_fn fn, void *ctx,
                                     struct spc_error *total, struct spc_error *err)
{
    struct spc_check checks[L2_COUNT];
    enum spc_status status = SPC_OK;
    for (int i = 0; i < L2_COUNT; i++) {
        spc_check_begin(&checks[i], fn, ctx, L2_NAMES[i]);
        checks[i].total = total;
    }
    for (uint32_t id = 0; id < reader->header.cluster_count && status == SPC_OK; id++)
        status = check_cluster_blocks(reader, id, checks, err);
    check_subtrees(reader, &checks[L2_SUBTREES]);
    for (int i = 0; i < L2_COUNT && status == SPC_OK; i++)
        spc_check_end(&checks[i]);
    return status;
}

enum spc_status spc_verify(const struct spc_reader *reader, int level, spc_finding_fn fn, void *ctx,
                           struct spc_error *err)
{
    struct spc_error total = {0};
    struct spc_check head;
    struct spc_error error = {0};
    spc_check_begin(&head, fn, ctx, "header, directory and metadata: checksums, ranges, counts");
    head.total = &total;
    /* Open has checked all of this; it is repeated because the file may have changed since. */
    struct spc_reader *again = NULL;
    if (spc_reader_open_memory(reader->bytes, (size_t)reader->size, &again, &error) != SPC_OK)
        spc_check_fault(&head, error.status, error.at_off, error.what);
    spc_reader_close(again);
    spc_check_end(&head);
    enum spc_status status = SPC_OK;
    if (level >= 2 && total.status == SPC_OK)
        status = verify_chunks(reader, fn, ctx, &total, err);
    if (level >= 3 && status == SPC_OK && total.status == SPC_OK)
        status = spc_verify_tree(reader, fn, ctx, &total, err);
    if (status == SPC_OK && total.status != SPC_OK) {
        if (err != NULL)
            *err = total;
        status = total.status;
    }
    return status;
}
