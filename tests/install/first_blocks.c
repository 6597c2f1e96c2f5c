/*
 * first_blocks ARCHIVE: a program as others write it, with nothing but the installed header and library.
 * Prints the number of nodes, and how many of them the first blocks of all clusters hold. C and C++.
 */
#include <spc.h>

#include <stdio.h>
#include <stdlib.h>

int main(int argc, char **argv)
{
    struct spc_reader *reader = NULL;
    struct spc_error err;
    unsigned long long nodes = 0;
    memset(&err, 0, sizeof err);
    if (argc != 2 || spc_reader_open(argv[1], &reader, &err) != SPC_OK) {
        fprintf(stderr, "first_blocks: %s\n", argc == 2 ? err.what : "names no archive");
        return 1;
    }
    const struct spc_header *header = spc_reader_header(reader);
    for (uint32_t id = 0; id < header->cluster_count && err.status == SPC_OK; id++) {
        struct spc_cluster cluster;
        struct spc_block block;
        spc_reader_cluster(reader, id, &cluster);
        spc_reader_block(reader, cluster.block_first, &block);
        void *payload = aligned_alloc(16, ((size_t)block.raw_bytes + 15) / 16 * 16);
        if (payload == NULL)
            spc_fail(&err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for cluster %u", (unsigned)id);
        else if (spc_block_decode(reader, cluster.block_first, true, payload, &err) == SPC_OK)
            nodes += block.node_count;
        free(payload);
    }
    printf("%llu nodes, %llu in first blocks\n", (unsigned long long)header->node_count, nodes);
    if (err.status != SPC_OK)
        fprintf(stderr, "first_blocks: %s\n", err.what);
    spc_reader_close(reader);
    return err.status == SPC_OK ? 0 : 1;
}
