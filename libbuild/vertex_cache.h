/*
 * vertex_cache.h - vertices on disk, for faces that refer to them in order or nearly so.
 *
 * Most scans list faces along their vertices: a few pieces of the table serve thousands of faces,
 * and the table is read about once. Where faces jump about the same pieces are read over and over;
 * the cache notices early, and corner_sort.h takes over.
 */
#ifndef SPB_VERTEX_CACHE_H
#define SPB_VERTEX_CACHE_H

#include "vertices.h"

struct spb_vertex_cache;

/* vertices are on disk and must live as long. fails SPC_NO_MEMORY */
enum spc_status spb_vertex_cache_create(const struct spb_vertices *vertices, uint64_t memory,
                                        struct spb_vertex_cache **out, struct spc_error *err);
void spb_vertex_cache_free(struct spb_vertex_cache *cache);

/* fails SPC_IO; SPC_INTERNAL once the cache does not serve (spb_vertex_cache_failed) */
enum spc_status spb_vertex_cache_get(struct spb_vertex_cache *cache, uint64_t corner,
                                     uint8_t *vertex, struct spc_error *err);

/* More has been read than sorting the corners would have moved. */
bool spb_vertex_cache_failed(const struct spb_vertex_cache *cache);

#endif
