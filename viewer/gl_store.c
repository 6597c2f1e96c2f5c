/*
 * gl_store.c - blocks on the card.
 *
 * A block is one buffer, its payload as it is: arrays in it begin at multiples of 16 bytes, so that vertex
 * attributes and texels of any size can start there. Shaders that fetch look at the whole buffer, as texels
 * of 16 bytes for nodes and of 4 for all else, and count from where an array begins: a texture of a part of
 * a buffer would need OpenGL 4.3.
 */
#include "draw_gl_int.h"

#include "bytes.h"
#include "kept.h"
#include "layout.h"

#include <stdlib.h>

/* room: of what is remembered beside the buffer, bytes */
static struct gl_block *block_create(const struct spv_gl *gl, size_t room)
{
    struct gl_block *b = calloc(1, sizeof *b + room);
    if (b != NULL) {
        gl->api.GenBuffers(1, &b->buffer);
        gl->api.GenTextures(VIEW_COUNT, b->textures);
    }
    return b;
}

static void block_free(const struct spv_gl *gl, struct gl_block *b)
{
    if (b == NULL)
        return;
    gl->api.DeleteTextures(VIEW_COUNT, b->textures);
    gl->api.DeleteBuffers(1, &b->buffer);
    free(b);
}

static enum spc_status block_fill(const struct spv_gl *gl, struct gl_block *to, const struct spc_reader *reader,
                                  const struct spc_block *b, const uint8_t *payload, GLenum usage,
                                  struct spc_error *err)
{
    static const GLenum formats[VIEW_COUNT] = {GL_RGBA32UI, GL_R32UI};
    const struct spv_gl_api *f = &gl->api;
    const struct spc_header *h = spc_reader_header(reader);
    spc_block_layout(b, h->flags, h->normal_clusters, &to->l);
    if (to->l.indices && to->l.bytes / 4 > gl->texels_max)
        return spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "OpenGL's texture buffers are too small");
    memcpy(to->facts, payload + to->l.groups, 4 * (size_t)h->normal_clusters);
    uint8_t *codes = to->facts + 4 * (size_t)h->normal_clusters;
    for (uint32_t i = 0; i < b->node_count; i++)
        memcpy(codes + 2 * (size_t)i, payload + to->l.nodes + (size_t)SPC_NODE_BYTES * i + ND_E_PARENT, 2);
    f->BindBuffer(GL_ARRAY_BUFFER, to->buffer);
    f->BufferData(GL_ARRAY_BUFFER, (GLsizeiptr)to->l.bytes, payload, usage);
    if (to->l.indices == 0)
        return SPC_OK;
    for (int a = 0; a < 3; a++)
        to->vertex_base[a] = (int64_t)load_u64(payload + to->l.vertex_base + 8 * a);
    for (int v = 0; v < VIEW_COUNT; v++) {
        f->ActiveTexture(GL_TEXTURE0 + (GLenum)v);
        f->BindTexture(GL_TEXTURE_BUFFER, to->textures[v]);
        f->TexBuffer(GL_TEXTURE_BUFFER, formats[v], to->buffer);
    }
    return SPC_OK;
}

void *spv_gl_keep(struct spv_draw *draw, const struct spc_reader *reader, uint32_t block, uint8_t *payload)
{
    const struct spv_gl *gl = spv_gl_of(draw);
    struct spc_block b;
    spc_reader_block(reader, block, &b);
    spv_gl_check(gl, NULL);         /* so that what follows is this block's */
    struct gl_block *kept = block_create(gl, 4 * (size_t)spc_reader_header(reader)->normal_clusters +
                                                       2 * (size_t)b.node_count);
    if (kept != NULL && (block_fill(gl, kept, reader, &b, payload, GL_STATIC_DRAW, NULL) != SPC_OK ||
                         spv_gl_check(gl, NULL) != SPC_OK)) {
        block_free(gl, kept);
        kept = NULL;
    }
    free(payload);
    return kept;
}

void spv_gl_drop(struct spv_draw *draw, void *kept)
{
    block_free(spv_gl_of(draw), kept);
}

bool spv_gl_stream_create(struct spv_gl *gl)
{
    gl->stream = block_create(gl, 4 * (size_t)SPV_RANGES_MAX + 2 * (size_t)SPC_BLOCK_NODES_MAX);
    return gl->stream != NULL;
}

enum spc_status spv_gl_stream(struct spv_gl *gl, const struct spc_reader *reader, uint32_t block, bool sorted,
                              const struct gl_block **out, struct spc_error *err)
{
    struct spc_block b;
    spc_reader_block(reader, block, &b);
    if (!spv_gl_room((void **)&gl->payload, &gl->payload_max, b.raw_bytes, 1))
        return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory to decode a block");
    enum spc_status status = spc_block_decode(reader, block, true, gl->payload, err);
    if (status == SPC_OK && sorted)
        status = spv_kept_sort(reader, block, gl->payload, err);
    if (status == SPC_OK)
        status = block_fill(gl, gl->stream, reader, &b, gl->payload, GL_STREAM_DRAW, err);
    *out = gl->stream;
    return status;
}
