/*
 * heap.h - a binary max-heap of numbers in caller memory.
 *
 * Orders a cluster canonically, in the builder and in the reader (spec section 7).
 */
#ifndef SPC_HEAP_H
#define SPC_HEAP_H

#include <stdint.h>

struct heap {
    uint64_t *keys;
    uint32_t count;
};

static inline void heap_push(struct heap *h, uint64_t key)
{
    uint32_t i = h->count++;
    while (i > 0 && h->keys[(i - 1) / 2] < key) {
        h->keys[i] = h->keys[(i - 1) / 2];
        i = (i - 1) / 2;
    }
    h->keys[i] = key;
}

static inline uint64_t heap_pop(struct heap *h)
{
    const uint64_t top = h->keys[0];
    const uint64_t last = h->keys[--h->count];
    uint32_t i = 0;
    for (;;) {
        uint32_t k = 2 * i + 1;
        if (k >= h->count)
            break;
        if (k + 1 < h->count && h->keys[k + 1] > h->keys[k])
            k++;
        if (h->keys[k] <= last)
            break;
        h->keys[i] = h->keys[k];
        i = k;
    }
    h->keys[i] = last;
    return top;
}

/* Largest e_self first, among equals the node emitted first. */
static inline uint64_t heap_key(uint16_t e_self, uint32_t emitted)
{
    return (uint64_t)e_self << 32 | (UINT32_MAX - emitted);
}

static inline uint32_t heap_key_emitted(uint64_t key)
{
    return UINT32_MAX - (uint32_t)key;
}

#endif
