/* Several scans behind one another. */
#include "chain.h"

#include "suite.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char folder[64];

static void setup(void)
{
    snprintf(folder, sizeof folder, "%s", "/tmp/spc-chain-XXXXXX");
    ck_assert_ptr_nonnull(mkdtemp(folder));
}

static void teardown(void)
{
    char command[100];
    snprintf(command, sizeof command, "rm -r %s", folder);
    ck_assert_int_eq(system(command), 0);
}

static struct spb_source *open_text(const char *name, const char *text)
{
    char path[96];
    struct spb_source *source = NULL;
    struct spc_error err = {0};
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *f = fopen(path, "w");
    ck_assert_ptr_nonnull(f);
    fputs(text, f);
    fclose(f);
    ck_assert_msg(spb_source_open(path, NULL, &source, &err) == SPC_OK, "%s", err.what);
    return source;
}

#define HEAD(type, colors, vertices, faces)                                                        \
    "ply\nformat ascii 1.0\nelement vertex " vertices "\nproperty " type " x\nproperty " type      \
    " y\nproperty " type " z\n" colors "element face " faces                                       \
    "\nproperty list uchar int vertex_indices\nend_header\n"
#define RGB "property uchar red\nproperty uchar green\nproperty uchar blue\n"

/* A bare one, one without a usable face, and one with colours in double. */
static void open_three(struct spb_source *members[3])
{
    members[0] = open_text("a.ply", HEAD("float", "", "3", "2")
                           "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 3\n");
    members[1] = open_text("b.ply", HEAD("float", "", "2", "2") "5 5 5\n6 6 6\n2 0 1\n1 0\n");
    members[2] = open_text("c.ply", HEAD("double", RGB, "4", "1")
                           "0.1 0 0 1 2 3\n1 0 0 4 5 6\n1 1 0 7 8 9\n0 1 0 10 11 12\n4 0 1 2 3\n");
}

static void close_all(struct spb_source *chain, struct spb_source **members, int count)
{
    spb_source_close(chain);
    for (int i = 0; i < count; i++)
        spb_source_close(members[i]);
}

static struct spb_vertex_batch vertices;
static struct spb_face_batch faces;

static void expect_vertices(struct spb_source *chain)
{
    static const double x[] = {0, 1, 0, 5, 6, 0.1, 1, 1, 0};
    static const uint8_t red[] = {255, 255, 255, 255, 255, 1, 4, 7, 10};
    size_t n = 0;
    ck_assert_int_eq(spb_source_begin_vertices(chain, NULL), SPC_OK);
    do {
        ck_assert_int_eq(spb_source_vertices(chain, &vertices, NULL), SPC_OK);
        for (size_t i = 0; i < vertices.count; i++, n++) {
            ck_assert_uint_lt(n, 9);
            ck_assert(vertices.xyz[i][0] == x[n] && vertices.rgba[i][0] == red[n] && vertices.rgba[i][3] == 255);
        }
    } while (vertices.count > 0);
    ck_assert_uint_eq(n, 9);
}

static void expect_faces(struct spb_source *chain)
{
    static const uint64_t corner[][3] = {{0, 1, 2}, {0, 1, SPB_BAD_INDEX}, {5, 6, 7}, {5, 7, 8}};
    size_t n = 0;
    uint64_t faces_in = 0, split_extra = 0, faces_short = 0;
    ck_assert_int_eq(spb_source_begin_faces(chain, NULL), SPC_OK);
    do {
        ck_assert_int_eq(spb_source_faces(chain, &faces, NULL), SPC_OK);
        faces_in += faces.faces_in;
        split_extra += faces.split_extra;
        faces_short += faces.faces_short;
        ck_assert_uint_le(n + faces.count, 4);
        for (size_t i = 0; i < faces.count; i++, n++)
            ck_assert_msg(memcmp(faces.corner[i], corner[n], sizeof corner[n]) == 0,
                          "face %zu is %llu %llu %llu", n, (unsigned long long)faces.corner[i][0],
                          (unsigned long long)faces.corner[i][1], (unsigned long long)faces.corner[i][2]);
    } while (faces.count > 0);
    ck_assert_uint_eq(n, 4);
    ck_assert_uint_eq(faces_in, 5);
    ck_assert_uint_eq(split_extra, 1);
    ck_assert_uint_eq(faces_short, 2);
}

/* Numbers count on, a bad one stays bad though the next scan has such a vertex; white fills up. */
START_TEST(scans_follow_one_another)
{
    struct spb_source *members[3], *chain = NULL;
    open_three(members);
    ck_assert_int_eq(spb_source_chain(members, 3, &chain, NULL), SPC_OK);
    const struct spb_source_info *info = spb_source_info(chain);
    ck_assert(info->colors && info->wide && !info->by_place && !info->archive);
    ck_assert_uint_eq(info->vertex_count, 9);
    ck_assert_uint_eq(info->face_count, 5);
    for (int round = 0; round < 2; round++) {
        expect_vertices(chain);
        expect_faces(chain);
        ck_assert_uint_le(spb_source_bytes_done(chain), info->file_bytes);
    }
    ck_assert_int_eq(spb_source_begin_vertices(chain, NULL), SPC_OK);   /* left in the middle */
    ck_assert_int_eq(spb_source_vertices(chain, &vertices, NULL), SPC_OK);
    expect_faces(chain);
    close_all(chain, members, 3);
}
END_TEST

START_TEST(the_broken_one_is_known)
{
    struct spb_source *members[3], *chain = NULL;
    struct spc_error err = {0};
    open_three(members);
    spb_source_close(members[1]);
    members[1] = open_text("b.ply", HEAD("float", "", "2", "1") "5 5 5\n6 six 6\n3 0 1 1\n");
    ck_assert_int_eq(spb_source_chain(members, 3, &chain, NULL), SPC_OK);
    ck_assert_int_eq(spb_source_begin_vertices(chain, NULL), SPC_OK);
    ck_assert_int_eq(spb_source_vertices(chain, &vertices, &err), SPC_OK);
    ck_assert_uint_eq(spb_source_member(chain), 0);
    ck_assert_int_eq(spb_source_vertices(chain, &vertices, &err), SPC_INPUT_FORMAT);
    ck_assert_uint_eq(spb_source_member(chain), 1);
    ck_assert_uint_eq(vertices.count, 0);
    ck_assert_uint_eq(spb_source_member(members[2]), 0);
    close_all(chain, members, 3);
}
END_TEST

int main(void)
{
    return SUITE("chain", setup, teardown, scans_follow_one_another, the_broken_one_is_known);
}
