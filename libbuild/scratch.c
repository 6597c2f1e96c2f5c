#include "scratch.h"

#include <pthread.h>
#include <stdlib.h>

struct pack_scratches {
    pthread_mutex_t lock;
    struct pack_scratch *first;
    int level;
};

struct pack_scratches *pack_scratches_create(int level)
{
    struct pack_scratches *s = calloc(1, sizeof *s);
    if (s == NULL)
        return NULL;
    pthread_mutex_init(&s->lock, NULL);
    s->level = level;
    return s;
}

static void scratch_free(struct pack_scratch *scratch)
{
    spc_encoder_free(scratch->encoder);
    for (int k = 0; k < PACK_BUFFERS; k++)
        free(scratch->bytes[k]);
    free(scratch);
}

void pack_scratches_free(struct pack_scratches *s)
{
    if (s == NULL)
        return;
    while (s->first != NULL) {
        struct pack_scratch *next = s->first->next;
        scratch_free(s->first);
        s->first = next;
    }
    pthread_mutex_destroy(&s->lock);
    free(s);
}

struct pack_scratch *pack_scratch_take(struct pack_scratches *s)
{
    pthread_mutex_lock(&s->lock);
    struct pack_scratch *scratch = s->first;
    if (scratch != NULL)
        s->first = scratch->next;
    pthread_mutex_unlock(&s->lock);
    if (scratch != NULL)
        return scratch;
    scratch = calloc(1, sizeof *scratch);
    if (scratch != NULL && spc_encoder_create(s->level, &scratch->encoder, NULL) != SPC_OK) {
        free(scratch);
        return NULL;
    }
    return scratch;
}

void pack_scratch_give(struct pack_scratches *s, struct pack_scratch *scratch)
{
    pthread_mutex_lock(&s->lock);
    scratch->next = s->first;
    s->first = scratch;
    pthread_mutex_unlock(&s->lock);
}

void *pack_scratch_buffer(struct pack_scratch *scratch, enum pack_buffer buffer, size_t bytes)
{
    if (bytes > scratch->size[buffer]) {
        const size_t grown = bytes + bytes / 4;     /* the next cluster is often a little larger */
        free(scratch->bytes[buffer]);
        scratch->bytes[buffer] = malloc(grown);
        scratch->size[buffer] = scratch->bytes[buffer] ? grown : 0;
    }
    return scratch->bytes[buffer];
}
