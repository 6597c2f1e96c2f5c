/*
 * What is in memory and what stands in: judged by a tree of all decoded nodes, while reads are late, fail
 * at random, and memory is short.
 */
#include "mesh_case.h"
#include "oracle_case.h"
#include "resident.h"
#include "suite.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

struct reading {                    /* what happens to reads */
    uint64_t seed;
    unsigned fail_percent, late_percent;
    atomic_uint reads;
};

static enum spc_status read_badly(void *ctx, const struct spc_reader *reader, uint32_t block,
                                  uint8_t *payload, struct spc_error *err)
{
    struct reading *how = ctx;
    uint64_t random = how->seed + 77 * block + 7919 * atomic_fetch_add(&how->reads, 1);
    const double fate = 100 * case_random(&random), delay = 100 * case_random(&random);
    if (delay < how->late_percent)
        nanosleep(&(struct timespec){.tv_nsec = 200000}, NULL);
    if (fate < how->fail_percent)
        return spc_fail(err, SPC_IO, SPC_NO_OFF, "this read fails");
    return spc_block_decode(reader, block, true, payload, err);
}

/* As the file has it: the tree knows no other order. */
static enum spc_status read_plainly(void *ctx, const struct spc_reader *reader, uint32_t block, uint8_t *payload,
                                    struct spc_error *err)
{
    (void)ctx;
    return spc_block_decode(reader, block, true, payload, err);
}

/* ---- what a frame draws ------------------------------------------------------------------------ */

static void draw_block(const struct oracle_case *c, const struct spv_item *ready, uint8_t *drawn)
{
    const struct oracle_tree *t = &c->tree;
    struct spv_interval in = oracle_interval(t, ready->block, &c->view);
    const bool leaf = t->blocks[ready->block].kind == SPC_BLOCK_LEAF;
    in.missing = ready->missing;
    for (uint32_t s = t->stored_first[ready->block]; s < t->stored_first[ready->block + 1]; s++) {
        const struct oracle_node *n = &t->nodes[t->stored[s]];
        const void *bytes = (const uint8_t *)ready->kept + (size_t)(s - t->stored_first[ready->block]) * SPC_NODE_BYTES;
        if (memcmp(bytes, n->record, SPC_NODE_BYTES) != 0)
            oracle_fail(c, "block %u holds other bytes than decoding gives", ready->block);
        drawn[t->stored[s]] |= spv_interval_point(&in, n->record) ? ORACLE_POINT : 0;
        if (leaf && oracle_hybrid(t, &c->view) && spv_interval_triangle(&in, n->record))
            drawn[t->stored[s]] |= ORACLE_TRIANGLE;
    }
}

static void draw_tops(const struct oracle_case *c, uint32_t id, uint8_t *drawn)
{
    const struct oracle_tree *t = &c->tree;
    for (uint32_t i = 0; i < t->node_count; i++) {
        const struct oracle_node *n = &t->nodes[i];
        if (n->cluster != id || (n->parent != SPC_NONE && t->nodes[n->parent].cluster == id))
            continue;
        struct spv_interval upper = oracle_interval(t, n->block, &c->view);
        upper.lower = false;
        drawn[i] |= spv_interval_point(&upper, n->record) ? ORACLE_POINT : 0;
    }
}

static void draw_frame(struct oracle_case *c, const struct spv_resident_frame *frame)
{
    memset(c->shader, 0, c->tree.node_count);
    for (uint32_t i = 0; i < frame->part.item_count; i++)
        draw_block(c, &frame->part.items[i], c->shader);
    for (uint32_t i = 0; i < frame->part.top_count; i++)
        draw_tops(c, frame->part.tops[i], c->shader);
}

static void expect_covered(const struct oracle_case *c, const struct spv_resident_frame *frame)
{
    uint32_t bare;
    oracle_paths(&c->tree, c->shader, &bare);
    if (bare != SPC_NONE && c->view.mode != SPV_TRIANGLES)
        oracle_fail(c, "with %u blocks missing nothing is drawn from the root to leaf %u of cluster %u",
                    frame->missing, bare, c->tree.nodes[bare].cluster);
}

/* What is handed out is in memory, and that is within its budget. */
static void expect_within(const struct oracle_case *c, const struct spv_resident_frame *frame, uint64_t budget)
{
    uint64_t sum = 0;
    for (uint32_t i = 0; i < frame->part.item_count; i++)
        sum += c->tree.blocks[frame->part.items[i].block].raw_bytes;
    if (sum > frame->resident_bytes || frame->resident_bytes > budget)
        oracle_fail(c, "%llu bytes are drawn, %llu in memory, %llu allowed", (unsigned long long)sum,
                    (unsigned long long)frame->resident_bytes, (unsigned long long)budget);
}

static struct spv_resident *create(const struct oracle_case *c, uint64_t budget, struct reading *how)
{
    struct spv_resident *r = NULL;
    const struct spv_resident_options o = {.budget = budget, .threads = 3, .decode = how ? read_badly : read_plainly,
                                             .decode_ctx = how};
    ck_assert_int_eq(spv_resident_create(c->reader, &o, &r, NULL), SPC_OK);
    return r;
}

/* A frame is drawn, then what it missed is asked for. */
static struct spv_resident_frame *next_frame(struct spv_resident *r, const struct spv_selection *selection)
{
    struct spv_resident_frame *frame = spv_resident_frame(r, selection);
    spv_resident_ask(r);
    return frame;
}

static uint64_t all_bytes(const struct oracle_case *c)
{
    uint64_t sum = 0;
    for (uint32_t k = 0; k < c->tree.header->block_count; k++)
        sum += c->tree.blocks[k].raw_bytes;
    return sum;
}

/* ---- tests ------------------------------------------------------------------------------------- */

/* Late, failing, short of memory, the camera jumping: at every moment every path has a node. */
static void ragged(struct oracle_case *c)
{
    for (uint32_t k = 0; k < oracle_views(6); k++) {
        oracle_look(c, 100 * k);
        struct reading how = {.seed = c->seed, .fail_percent = 10 * oracle_pick(c, 6),
                              .late_percent = 20 * oracle_pick(c, 5)};
        const uint64_t budget = (uint64_t)(case_random(&c->state) * 1.2 * (double)all_bytes(c));
        struct spv_resident *r = create(c, budget, &how);
        for (uint32_t f = 0; f < 24; f++) {
            if (f % 6 == 0)
                oracle_look(c, 100 * k + f);
            oracle_select(c);
            const struct spv_resident_frame *frame = spv_resident_frame(r, &c->selection);
            expect_within(c, frame, budget);
            draw_frame(c, frame);
            expect_covered(c, frame);
            spv_resident_ask(r);
            if (f % 3 == 1)
                spv_resident_prefetch(r, &c->selection);
            if (f % 2 == 1)
                spv_resident_wait(r);
        }
        spv_resident_free(r);
    }
}

START_TEST(whatever_is_missing_every_path_has_a_node)
{
    oracle_each(ragged);
}
END_TEST

/* With memory and patience a frame becomes what the selection says, and stays so without reading. */
static void settle(struct oracle_case *c)
{
    for (uint32_t k = 0; k < oracle_views(4); k++) {
        oracle_look(c, k);
        oracle_select(c);
        struct spv_resident *r = create(c, all_bytes(c), NULL);
        const struct spv_resident_frame *frame = next_frame(r, &c->selection);
        uint64_t read = 0;
        uint32_t rounds = 0;
        while (frame->missing > 0) {
            if (rounds++ > 4 * c->tree.header->block_count)
                oracle_fail(c, "%u blocks never come", frame->missing);
            spv_resident_wait(r);
            frame = next_frame(r, &c->selection);
            read += frame->read_bytes;
        }
        if (frame->part.top_count != 0 || frame->part.item_count != c->selection.block_count)
            oracle_fail(c, "%u blocks and %u tops for %u that were chosen", frame->part.item_count,
                        frame->part.top_count, c->selection.block_count);
        for (uint32_t i = 0; i < frame->part.item_count; i++)
            ck_assert(frame->part.items[i].block == c->selection.blocks[i].block &&
                      frame->part.items[i].missing < 0);
        draw_frame(c, frame);
        oracle_draw_float(&c->tree, &c->view, c->exact);
        for (uint32_t i = 0; i < c->tree.node_count; i++)
            if (c->chosen[c->tree.nodes[i].block] && c->shader[i] != c->exact[i])
                oracle_fail(c, "node %u is drawn as %d, not as %d", i, c->shader[i], c->exact[i]);
        ck_assert(!spv_resident_wait(r));
        ck_assert_uint_eq(read, c->selection.bytes);
        frame = next_frame(r, &c->selection);
        ck_assert_uint_eq(frame->read_bytes, 0);
        spv_resident_free(r);
    }
}

START_TEST(with_time_a_frame_is_what_was_selected)
{
    oracle_each(settle);
}
END_TEST

static void drain(struct spv_resident *r)
{
    while (spv_resident_wait(r))
        ;
}

static uint64_t chosen_bytes(const struct oracle_case *c)
{
    uint64_t sum = 0;
    for (uint32_t i = 0; i < c->selection.block_count; i++)
        sum += c->tree.blocks[c->selection.blocks[i].block].raw_bytes;
    return sum;
}

/* Memory for any one view is enough for all of them in turn: nothing that has left takes room. */
static void wander(struct oracle_case *c)
{
    uint64_t most = 0;
    for (uint32_t k = 0; k < 8; k++) {
        oracle_look(c, k);
        oracle_select(c);
        most = chosen_bytes(c) > most ? chosen_bytes(c) : most;
    }
    struct spv_resident *r = create(c, most, NULL);
    for (uint32_t k = 0; k < 24; k++) {
        oracle_look(c, k % 8);
        oracle_select(c);
        const struct spv_resident_frame *frame = next_frame(r, &c->selection);
        for (uint32_t f = 0; frame->missing > 0; f++) {
            if (f > c->tree.header->block_count)
                oracle_fail(c, "%u blocks never come, %llu of %llu bytes are taken", frame->missing,
                            (unsigned long long)frame->resident_bytes, (unsigned long long)most);
            drain(r);
            frame = next_frame(r, &c->selection);
            expect_within(c, frame, most);
        }
    }
    spv_resident_free(r);
}

START_TEST(what_has_left_takes_no_room)
{
    oracle_each(wander);
}
END_TEST

/* With too little memory the coarse blocks come, and then it is quiet. */
static void starve_in(struct oracle_case *c)
{
    const uint64_t budget = chosen_bytes(c) * 2 / 3;
    struct spv_resident *r = create(c, budget, NULL);
    const struct spv_resident_frame *frame = NULL;
    uint64_t read = 0;
    for (uint32_t f = 0; f < 2 * c->tree.header->block_count + 4; f++) {
        frame = next_frame(r, &c->selection);
        read += frame->read_bytes;
        drain(r);
    }
    if (read > c->selection.bytes)
        oracle_fail(c, "%llu bytes read, though all of them are %llu", (unsigned long long)read,
                    (unsigned long long)c->selection.bytes);
    ck_assert_uint_eq(next_frame(r, &c->selection)->read_bytes, 0);
    spv_resident_free(r);
}

static void starve(struct oracle_case *c)
{
    for (uint32_t k = 0; k < oracle_views(3); k++) {
        oracle_frame(c, k);
        oracle_select(c);
        starve_in(c);
    }
}

START_TEST(with_too_little_memory_it_is_quiet_in_the_end)
{
    oracle_each(starve);
}
END_TEST

/* A block that cannot be read is told of, tried again, and shown once it can be. */
static void recover(struct oracle_case *c)
{
    struct reading how = {.seed = 1, .fail_percent = 100};
    struct spc_error err;
    oracle_look(c, 3);
    oracle_select(c);
    if (c->selection.block_count == 0)
        return;
    struct spv_resident *r = create(c, all_bytes(c), &how);
    const struct spv_resident_frame *frame = NULL;
    for (int f = 0; f < 8; f++) {
        frame = next_frame(r, &c->selection);
        drain(r);
    }
    frame = next_frame(r, &c->selection);
    ck_assert_uint_eq(frame->part.item_count, 0);
    ck_assert_uint_gt(frame->failed, 0);
    spv_resident_error(r, &err);
    ck_assert_str_eq(err.what, "this read fails");
    how.fail_percent = 0;
    for (uint32_t f = 0; f < 200 + 4 * c->tree.header->block_count && frame->missing > 0; f++) {
        frame = next_frame(r, &c->selection);
        spv_resident_wait(r);
    }
    ck_assert_uint_eq(frame->missing, 0);
    spv_resident_free(r);
}

START_TEST(failed_reads_are_told_and_tried_again)
{
    oracle_each(recover);
}
END_TEST

/* ---- the store --------------------------------------------------------------------------------- */

static uint32_t kept_now, kept_ever, refused;

static void *keep_counted(struct spv_draw *draw, const struct spc_reader *reader, uint32_t block, uint8_t *payload)
{
    (void)draw;
    (void)reader;
    (void)block;
    if (refused > 0) {
        refused--;
        free(payload);
        return NULL;
    }
    kept_now++;
    kept_ever++;
    return payload;
}

static void drop_counted(struct spv_draw *draw, void *kept)
{
    (void)draw;
    kept_now--;
    free(kept);
}

static struct spv_resident *create_counted(const struct oracle_case *c, uint64_t upload_bytes)
{
    const struct spv_resident_options o = {.budget = all_bytes(c), .upload_bytes = upload_bytes, .threads = 2,
                                           .store = {NULL, keep_counted, drop_counted}};
    struct spv_resident *r = NULL;
    kept_now = kept_ever = 0;
    ck_assert_int_eq(spv_resident_create(c->reader, &o, &r, NULL), SPC_OK);
    return r;
}

/* However much was read, a frame is not held up by more than it allows for. */
static void upload(struct oracle_case *c)
{
    oracle_frame(c, 1);
    oracle_select(c);
    struct spv_resident *r = create_counted(c, 1);
    const struct spv_resident_frame *frame = next_frame(r, &c->selection);
    for (uint32_t f = 0; frame->missing > 0; f++) {
        const uint32_t before = kept_ever;
        if (f > 4 * c->tree.header->block_count + 40)      /* one that is refused waits for 30 frames */
            oracle_fail(c, "%u blocks never come", frame->missing);
        refused = f == 2;
        drain(r);
        frame = next_frame(r, &c->selection);
        ck_assert_uint_le(kept_ever - before, 1);
    }
    spv_resident_free(r);
    ck_assert_uint_eq(kept_now, 0);
}

START_TEST(a_frame_gives_the_store_what_it_is_allowed_to)
{
    oracle_each(upload);
}
END_TEST

/* Clusters that could not be seen are not read; once they can be, they are. */
static void hide(struct oracle_case *c)
{
    oracle_frame(c, 2);
    oracle_select(c);
    struct spv_resident *r = create_counted(c, 0);
    for (int round = 0; round < 3; round++) {
        struct spv_resident_frame *frame = spv_resident_frame(r, &c->selection);
        memset(frame->part.hidden, 1, frame->part.probe_count);
        spv_resident_ask(r);
        ck_assert_uint_eq(spv_resident_busy(r), 0);
    }
    const struct spv_resident_frame *frame = next_frame(r, &c->selection);
    ck_assert(frame->missing == 0 || spv_resident_busy(r) > 0);
    spv_resident_free(r);
}

START_TEST(what_is_hidden_is_not_read)
{
    oracle_each(hide);
}
END_TEST

int main(void)
{
    if (!oracle_start())
        return 1;
    const int failed = SUITE("resident", case_start, case_finish, whatever_is_missing_every_path_has_a_node,
                             with_time_a_frame_is_what_was_selected, what_has_left_takes_no_room,
                             with_too_little_memory_it_is_quiet_in_the_end, failed_reads_are_told_and_tried_again,
                             a_frame_gives_the_store_what_it_is_allowed_to, what_is_hidden_is_not_read);
    oracle_finish();
    return failed;
}
