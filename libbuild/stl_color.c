/*
 * The attribute word of a binary facet was meant to be zero. Two conventions put a colour there,
 * five bits a channel, and disagree in everything else:
 *
 * - Magics: the header holds "COLOR=" and four bytes, red green blue alpha, of the whole part. A
 *   word with bit 15 clear is the facet's own colour, red lowest; with bit 15 set the facet has the
 *   part's. Writers that give the part a colour and leave all words zero mean no black part: if
 *   there is no word but zero, all have the part's.
 * - VisCAM and SolidView: nothing in the header. A word with bit 15 set is a colour, blue lowest;
 *   other facets have none, and are white here.
 *
 * Others keep numbers of patches in the word, or what the memory held. So words are taken for
 * VisCAM's only if at least two facets, and one in a hundred, have bit 15 set, while those without
 * it are zero but for one in a hundred; and not if all that is set is 0xFFFF, which is memory more
 * often than white. A file of many facets is judged by samples from all over it.
 */
#include "stl_int.h"

#include <string.h>

enum { SAMPLES = 64, SAMPLE_FACETS = SPB_BYTES_WINDOW / STL_FACET_BYTES };

struct words {
    uint64_t seen, valid, full, numbers;    /* bit 15 set; of them 0xFFFF; clear, but not zero */
};

static const uint8_t *part_color(const uint8_t name[STL_NAME_BYTES])
{
    static const char mark[] = "COLOR=";
    const size_t length = sizeof mark - 1;

    for (size_t i = 0; i + length + 4 <= STL_NAME_BYTES; i++)
        if (memcmp(name + i, mark, length) == 0)
            return name + i + length;
    return NULL;
}

static enum spc_status count_words(struct stl *stl, uint64_t first, uint64_t count,
                                   struct words *words, struct spc_error *err)
{
    struct spb_bytes *const b = stl->bytes;

    spb_bytes_seek(b, STL_HEADER_BYTES + first * STL_FACET_BYTES);
    const enum spc_status status = spb_bytes_need(b, (size_t)count * STL_FACET_BYTES, err);
    if (status != SPC_OK)
        return status;
    count = spb_bytes_have(b) / STL_FACET_BYTES < count ? spb_bytes_have(b) / STL_FACET_BYTES : count;
    const uint8_t *p = b->buf + b->pos + STL_WORD_OFF;
    for (uint64_t i = 0; i < count; i++, p += STL_FACET_BYTES) {
        const unsigned word = load_u16(p);
        words->valid += word >> 15;
        words->full += word == 0xffff;
        words->numbers += word > 0 && word < 0x8000;
    }
    words->seen += count;
    return SPC_OK;
}

enum spc_status spb_stl_look_at_colors(struct stl *stl, struct spc_error *err)
{
    struct spb_bytes *const b = stl->bytes;
    struct words words = {0};
    uint8_t name[STL_NAME_BYTES];

    memcpy(name, b->buf, sizeof name);          /* open has brought it */
    const uint8_t *const part = part_color(name);
    for (uint64_t i = 0; i < SAMPLES; i++) {
        const uint64_t first = stl->count / SAMPLES * i + stl->count % SAMPLES * i / SAMPLES;
        const uint64_t behind = stl->count / SAMPLES * (i + 1) + stl->count % SAMPLES * (i + 1) / SAMPLES;
        const uint64_t count = behind - first < SAMPLE_FACETS ? behind - first : SAMPLE_FACETS;
        const enum spc_status status = count_words(stl, first, count, &words, err);
        if (status != SPC_OK)
            return status;
    }
    memset(stl->plain, 255, sizeof stl->plain);
    if (part) {
        stl->colors = STL_MAGICS;
        memcpy(stl->plain, part, sizeof stl->plain);
        stl->all_plain = words.valid == 0 && words.numbers == 0;
    } else if (words.valid >= 2 && words.valid >= words.seen / 100 && words.valid > words.full &&
               words.numbers <= words.seen / 100) {
        stl->colors = STL_VISCAM;
    }
    return SPC_OK;
}

static uint8_t five_bits(unsigned word, unsigned shift)
{
    const unsigned v = word >> shift & 31;
    return (uint8_t)((v * 255 + 15) / 31);
}

void spb_stl_color(const struct stl *stl, unsigned word, uint8_t rgba[4])
{
    const bool own = !stl->all_plain && (word >> 15 != 0) == (stl->colors == STL_VISCAM);
    const unsigned red = stl->colors == STL_VISCAM ? 10 : 0;

    memcpy(rgba, stl->plain, 4);
    if (!own)
        return;
    rgba[0] = five_bits(word, red);
    rgba[1] = five_bits(word, 5);
    rgba[2] = five_bits(word, 10 - red);
    rgba[3] = 255;
}
