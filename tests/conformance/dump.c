/*
 * dump.c - prints what the C library decodes, in the words of tests/second/spc_second.py: axes,
 * normal clusters, nodes in canonical order with their parents, triangles. For comparison.
 */
#include "bytes.h"
#include "layout.h"
#include "spc.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

struct dump {
    const struct spc_reader *r;
    struct spc_cluster c;
    struct spc_tree *tree;
    struct spc_block *blocks;
    struct spc_block_layout *layouts;
    uint8_t **payloads;
    uint32_t *number;               /* [node] canonical */
    uint32_t *owner;                /* [cluster] canonical number of its owner */
};

static void *get(size_t n, size_t size)
{
    void *p = calloc(n + 1, size);
    if (p == NULL)
        abort();
    return p;
}

static void real(double v)
{
    if (isinf(v))
        printf(" inf");
    else
        printf(" %.13a", v);
}

static void hex(const uint8_t *p, uint32_t n)
{
    putchar(' ');
    for (uint32_t i = 0; i < n; i++)
        printf("%02x", p[i]);
}

static void dump_block(struct dump *d, uint32_t k)
{
    const struct spc_header *h = spc_reader_header(d->r);
    const uint32_t index = d->c.block_first + k;
    struct spc_error err = {0};
    spc_reader_block(d->r, index, &d->blocks[k]);
    spc_block_layout(&d->blocks[k], h->flags, h->normal_clusters, &d->layouts[k]);
    const struct spc_block_layout *l = &d->layouts[k];
    uint8_t *p = d->payloads[k] = get(l->bytes, 1);
    if (spc_block_decode(d->r, index, true, p, &err) != SPC_OK) {
        fprintf(stderr, "%s\n", err.what);
        exit(3);
    }
    for (uint32_t g = 0; g < h->normal_clusters; g++)
        printf("block %u group %u %u %d\n", index, g, load_u16(p + l->groups + 4 * g),
               (int16_t)load_u16(p + l->groups + 4 * g + 2));
    if (l->indices) {
        printf("block %u vertex_base", index);
        for (int a = 0; a < 3; a++)
            printf(" %lld", (long long)load_u64(p + l->vertex_base + 8 * a));
        putchar('\n');
    }
}

static void dump_node(const struct dump *d, uint32_t id, uint32_t i)
{
    const uint32_t node = d->tree->order[i], block = d->tree->block_of[node];
    const struct spc_node *n = &d->tree->nodes[node];
    const struct spc_block_layout *l = &d->layouts[block - d->c.block_first];
    const uint8_t *p = d->payloads[block - d->c.block_first];
    const uint32_t at = d->tree->index_in_block[node], parent = d->tree->parent[node];
    printf("node %u ", i);
    if (parent != SPC_PARENT_OWNER)
        printf("%u", d->number[parent]);
    else if (id > 0)
        printf("^%u", d->owner[id]);
    else
        printf("-");
    printf(" %u %c %u", block, l->children ? 'i' : 'l',
           l->children ? p[l->children + at / 2] >> 4 * (at & 1) & 15 : 0);
    for (int a = 0; a < 3; a++)
        real(n->center[a]);
    printf(" R");
    real(n->radius);
    printf(" H");
    real(n->height);
    printf(" L");
    real(n->link);
    printf(" e %u ", n->e_self);
    if (n->e_parent == SPC_LEN_ROOT)
        printf("root");
    else
        printf("%u", n->e_parent);
    printf(" t");
    real((double)spc_len_decode(n->e_self));
    printf(" normal %u %u rgba", n->normal_code & 255, n->normal_code >> 8);
    hex(n->rgba, 4);
    putchar('\n');
}

static void dump_triangle(const struct dump *d, uint32_t i)
{
    const uint32_t node = d->tree->order[i], k = d->tree->block_of[node] - d->c.block_first;
    const struct spc_block_layout *l = &d->layouts[k];
    if (l->indices == 0)
        return;
    const uint8_t *corner = d->payloads[k] + l->indices + 6 * d->tree->index_in_block[node];
    printf("triangle %u", i);
    for (int m = 0; m < 3; m++) {
        double xyz[3];
        uint8_t rgba[4];
        const uint32_t v = load_u16(corner + 2 * m);
        spc_vertex_decode(d->r, &d->blocks[k], l, d->payloads[k], v, xyz, rgba);
        printf(" %u", v);
        for (int a = 0; a < 3; a++)
            real(xyz[a]);
        hex(rgba, 4);
    }
    putchar('\n');
}

static bool dump_cluster(struct dump *d, uint32_t id)
{
    struct spc_error err = {0};
    spc_reader_cluster(d->r, id, &d->c);
    if (spc_tree_load(d->r, id, &d->tree, &err) != SPC_OK) {
        fprintf(stderr, "%s\n", err.what);
        return false;
    }
    const uint32_t n = d->tree->node_count, blocks = d->c.block_count;
    d->blocks = get(blocks, sizeof *d->blocks);
    d->layouts = get(blocks, sizeof *d->layouts);
    d->payloads = get(blocks, sizeof *d->payloads);
    d->number = get(n, sizeof *d->number);
    for (uint32_t k = 0; k < blocks; k++)
        dump_block(d, k);
    for (uint32_t i = 0; i < n; i++) {
        const uint32_t node = d->tree->order[i];
        d->number[node] = i;
        if (node < d->tree->inner_count && d->tree->child_cluster[node] != SPC_NO_CHILD_CLUSTER)
            d->owner[d->tree->child_cluster[node]] = i;
    }
    for (uint32_t i = 0; i < n; i++)
        dump_node(d, id, i);
    for (uint32_t i = 0; i < n; i++)
        dump_triangle(d, i);
    for (uint32_t k = 0; k < blocks; k++)
        free(d->payloads[k]);
    free(d->payloads);
    free(d->layouts);
    free(d->blocks);
    free(d->number);
    spc_tree_free(d->tree);
    return true;
}

int main(int argc, char **argv)
{
    struct spc_reader *r = NULL;
    struct spc_error err = {0};
    if (argc != 2) {
        fprintf(stderr, "usage: conformance_dump FILE\n");
        return 2;
    }
    if (spc_reader_open(argv[1], &r, &err) != SPC_OK) {
        fprintf(stderr, "%s\n", err.what);
        return 3;
    }
    const struct spc_header *h = spc_reader_header(r);
    struct dump d = {.r = r, .owner = get(h->cluster_count, sizeof *d.owner)};
    bool ok = true;
    for (uint32_t id = 0; id < h->cluster_count && ok; id++)
        ok = dump_cluster(&d, id);
    if (ok)
        printf("end\n");
    free(d.owner);
    spc_reader_close(r);
    return ok ? 0 : 3;
}
