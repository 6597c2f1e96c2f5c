/*
 * shares ARCHIVE...: what each way of leaving nodes out is worth by itself, as CSV, sums over twelve views.
 *
 * At 1024 x 1024, hybrid, around the whole model and from a third of that distance to its middle. Of nodes:
 * one_list   the beginning of one list of all by e_parent, up to what the nearest point of the model's box
 *            asks for: sequential point trees
 * prefix     the same, a list a cluster, by the nearest point of the cluster's box
 * chosen     of prefix, in the blocks that a viewer chooses (picture, cones of clusters, too coarse)
 * tested     of chosen, less normal clusters seen from behind where a viewer keeps these apart (kept.h)
 * Of prefix, whether in the picture or not, where back faces are never seen:
 * cones      in clusters whose whole cone is seen from behind
 * groups     in these, or in a normal cluster seen from behind: of every block, and of those kept apart
 * behind     whose own normal faces away: what no rule could do better than
 * axis       in a normal cluster whose axis points away along the view, whatever its normals: the thesis' rule;
 *            wrong: those of them whose own normal faces the eye
 * read are the bytes of the chosen blocks, stored those of the file. A node counts where its own error
 * interval begins, without the room for a triangle's corners (links): a viewer tests a few more.
 */
#include "bench.h"
#include "interval.h"
#include "kept.h"
#include "views.h"

#include <string.h>

enum { AROUND = 12 };

static const double SHARES_PX[] = {1, 2, 4, 8};

struct node {
    float at[3], normal[3];         /* the centre, as clusters count; unit length */
    float e_parent;
};

struct part {                       /* a block, decoded once */
    struct spc_block block;
    struct spc_cluster cluster;
    uint8_t *groups;
    struct node *nodes;             /* by normal cluster, in each by e_parent, largest first */
};

struct sums {
    uint64_t one_list, prefix, chosen, tested, cones, groups, kept, behind, axis, wrong, read;
};

static int by_parent(const void *a, const void *b)
{
    const float x = ((const struct node *)a)->e_parent, y = ((const struct node *)b)->e_parent;
    return (x < y) - (x > y);
}

static struct part load_part(const struct bench_archive *a, uint32_t index)
{
    struct part p;
    struct spc_block_layout l;
    spc_reader_block(a->reader, index, &p.block);
    spc_reader_cluster(a->reader, p.block.cluster, &p.cluster);
    spc_block_layout(&p.block, a->header->flags, a->header->normal_clusters, &l);
    bench_decode(a, index, false);
    p.groups = bench_memory(4 * (size_t)a->header->normal_clusters);
    p.nodes = bench_memory(p.block.node_count * sizeof *p.nodes);
    memcpy(p.groups, a->payload + l.groups, 4 * (size_t)a->header->normal_clusters);
    const double step = ldexp(1, p.block.step_exp - a->header->unit_exp);
    for (uint32_t i = 0; i < p.block.node_count; i++) {
        const uint8_t *record = a->payload + l.nodes + (size_t)SPC_NODE_BYTES * i;
        struct node *n = &p.nodes[i];
        double normal[3];
        spc_normal_decode(load_u16(record + ND_NORMAL), normal);
        for (int k = 0; k < 3; k++) {
            n->at[k] = (float)(load_u16(record + ND_X + 2 * k) * step);
            n->normal[k] = (float)normal[k];
        }
        n->e_parent = spc_len_decode(load_u16(record + ND_E_PARENT));
    }
    struct node *group = p.nodes;
    for (uint32_t g = 0; g < a->header->normal_clusters; g++) {
        const size_t count = load_u16(p.groups + 4 * (size_t)g);
        qsort(group, count, sizeof *group, by_parent);
        group += count;
    }
    return p;
}

static double distance_to(const double low[3], const double high[3], const double eye[3])
{
    double square = 0;
    for (int k = 0; k < 3; k++) {
        const double off = fmax(0, fmax(low[k] - eye[k], eye[k] - high[k]));
        square += off * off;
    }
    return sqrt(square);
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static uint32_t reaching(const struct node *nodes, uint32_t count, double least)
{
    uint32_t low = 0, high = count;
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        if ((double)nodes[middle].e_parent >= least)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static uint64_t facing_away(const struct node *nodes, uint32_t count, const double eye[3])
{
    const float from[3] = {(float)eye[0], (float)eye[1], (float)eye[2]};
    uint64_t away = 0;
    for (uint32_t i = 0; i < count; i++) {
        const struct node *n = &nodes[i];
        away += n->normal[0] * (from[0] - n->at[0]) + n->normal[1] * (from[1] - n->at[1]) +
                    n->normal[2] * (from[2] - n->at[2]) <= 0;
    }
    return away;
}

static void add_part(const struct bench_archive *a, const struct spv_view *view, const struct part *p, bool chosen,
                     double least_of_all, struct sums *s)
{
    const struct spc_cluster *c = &p->cluster;
    double eye[3], low[3], high[3];
    spv_eye_of_cluster(a->reader, c, &view->camera, eye);
    for (int k = 0; k < 3; k++) {
        low[k] = (double)c->box[k];
        high[k] = (double)c->box[k + 3];
    }
    const double least = view->eps * distance_to(low, high, eye);
    const double axis[3] = {(double)c->cone[0], (double)c->cone[1], (double)c->cone[2]};
    const bool cull = spv_culls_back(a->reader, view), kept = spv_kept_grouped(&p->block);
    const bool cone = cull && spv_all_behind(eye, c->sub_sphere, axis, (double)c->cone[3]);
    const struct node *group = p->nodes;
    for (uint32_t g = 0; g < a->header->normal_clusters; g++) {
        const uint32_t count = load_u16(p->groups + 4 * (size_t)g), n = reaching(group, count, least);
        double way[3];
        s->one_list += reaching(group, count, least_of_all);
        if (n > 0) {
            const bool away = cull && (cone || spv_group_behind(a->reader, c, eye, g, p->groups));
            s->prefix += n;
            s->cones += cone ? n : 0;
            s->groups += away ? n : 0;
            s->kept += away && (cone || kept) ? n : 0;
            const uint64_t behind = cull ? facing_away(group, n, eye) : 0;
            s->behind += behind;
            spc_reader_axis(a->reader, g, way);
            if (cull && dot(way, view->camera.forward) > 0) {
                s->axis += n;
                s->wrong += n - behind;
            }
            s->chosen += chosen ? n : 0;
            s->tested += chosen && !(away && kept) ? n : 0;
        }
        group += count;
    }
}

static void measure(const struct bench_archive *a, const struct part *parts, bool near, double eps_px)
{
    const struct spc_header *h = a->header;
    const double unit = ldexp(1, -h->unit_exp);
    bool *chosen = bench_memory(h->block_count);
    struct spv_selection selection = {0};
    struct spc_error err = {0};
    struct sums s = {0};
    for (int v = 0; v < AROUND; v++) {
        const struct spv_view view = views_around(h, v, AROUND, near, eps_px);
        const double least = view.eps * unit * distance_to(h->box_min, h->box_max, view.camera.eye);
        bench_must(spv_select(a->reader, &view, &selection, &err), a->path, &err);
        memset(chosen, 0, h->block_count);
        for (uint32_t i = 0; i < selection.block_count; i++)
            chosen[selection.blocks[i].block] = true;
        for (uint32_t i = 0; i < h->block_count; i++)
            add_part(a, &view, &parts[i], chosen[i], least, &s);
        s.read += selection.bytes;
    }
    const uint64_t counts[] = {h->node_count * AROUND, s.one_list, s.prefix, s.chosen, s.tested, s.cones, s.groups,
                               s.kept, s.behind, s.axis, s.wrong, s.read, h->file_bytes * AROUND};
    printf("%s,%s,%g,%d,%u", a->path, near ? "near" : "whole", eps_px, AROUND, h->cluster_count);
    for (size_t k = 0; k < sizeof counts / sizeof *counts; k++)
        printf(",%llu", (unsigned long long)counts[k]);
    putchar('\n');
    spv_selection_release(&selection);
    free(chosen);
}

int main(int argc, char **argv)
{
    if (argc < 2) {
        fprintf(stderr, "usage: bench-shares ARCHIVE...\n");
        return 2;
    }
    puts("archive,from,eps_px,views,clusters,nodes,one_list,prefix,chosen,tested,cones,groups,kept,behind,axis,"
         "wrong,read,stored");
    for (int i = 1; i < argc; i++) {
        struct bench_archive a = bench_open(argv[i]);
        struct part *parts = bench_memory(a.header->block_count * sizeof *parts);
        for (uint32_t b = 0; b < a.header->block_count; b++)
            parts[b] = load_part(&a, b);
        for (size_t e = 0; e < 2 * (sizeof SHARES_PX / sizeof *SHARES_PX); e++)
            measure(&a, parts, e % 2 == 1, SHARES_PX[e / 2]);
        for (uint32_t b = 0; b < a.header->block_count; b++) {
            free(parts[b].groups);
            free(parts[b].nodes);
        }
        free(parts);
        bench_close(&a);
    }
    return 0;
}
