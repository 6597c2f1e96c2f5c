/*
 * Level 0 is the picture, each further one half of it, rounded up. A pixel is the mean of the four
 * below that are there, weighted by their alpha: what an atlas leaves transparent between its
 * islands does not darken their borders. Alpha serves for nothing else, since in OBJ the alpha of a
 * colour map is no opacity. Means are of the stored values, as everywhere where colours are
 * averaged here.
 *
 * Sampling. A corner's colour stands for its third of the triangle, so it is taken at the point with
 * barycentric coordinates 2/3, 1/6, 1/6: the three are a quadrature of the triangle, and lie within
 * it by a sixth of its heights. The mean is over a box around it as wide as a quarter of the
 * triangle's least height, but a pixel at most of a level where the box covers 2 to 4 pixels, each
 * weighted by how much of it lies inside. So what lies beside the triangle in an atlas hardly bleeds
 * in, and next to nothing where a triangle is smaller than a pixel.
 */
#include "texture.h"

#include "image.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    TILE = 32,                      /* pixels a side */
    TILE_BYTES = TILE * TILE * 3,
    LEVELS_MAX = 18,                /* 2^16 to 1, and one that a rounding may add */
    WAYS = 4,
    SETS = 256,                     /* with WAYS: 3 MB of tiles */
    TEXTURES_MAX = 16384
};

struct level {
    uint32_t width, height, tiles_x;
    uint64_t *strip_off;            /* [strips] of TILE rows each, in the file */
};

struct texture {
    int level_count;
    struct level levels[LEVELS_MAX];
};

struct way {
    uint64_t off;                   /* of the tile, in the file; SPC_NO_OFF: none */
    uint64_t used;                  /* when */
};

struct cache {
    uint64_t clock;
    struct way ways[SETS][WAYS];
    uint8_t tiles[SETS][WAYS][TILE_BYTES];
};

struct spb_textures {
    struct spb_tmpfile *file;
    struct spb_temp *temp;
    struct texture **list;
    uint32_t count;
    struct cache *cache;            /* NULL: not needed yet, or no more for now */
};

static enum spc_status no_memory(struct spc_error *err)
{
    return spc_fail(err, SPC_NO_MEMORY, SPC_NO_OFF, "no memory for a texture");
}

/* ---- pyramids --------------------------------------------------------------------------------- */

struct making {                     /* of one texture */
    struct spb_tmpfile *file;
    struct texture *texture;
    uint8_t *strips[LEVELS_MAX];    /* [rows][width][4] */
    uint8_t *half[LEVELS_MAX];      /* [width of the next level][4] */
    uint8_t *tiles;                 /* of the strip that is written */
    uint32_t y[LEVELS_MAX];         /* rows so far */
};

static enum spc_status shape(struct making *m, uint32_t width, uint32_t height, struct spc_error *err)
{
    struct texture *const t = m->texture;
    for (int k = 0; k < LEVELS_MAX; k++) {
        struct level *const l = &t->levels[k];
        l->width = width;
        l->height = height;
        l->tiles_x = (width + TILE - 1) / TILE;
        l->strip_off = calloc((height + TILE - 1) / TILE, sizeof *l->strip_off);
        m->strips[k] = calloc(height < TILE ? height : TILE, (size_t)width * 4);
        m->half[k] = malloc((size_t)(width + 1) / 2 * 4);
        t->level_count = k + 1;
        if (!l->strip_off || !m->strips[k] || !m->half[k])
            return no_memory(err);
        if (width == 1 && height == 1)
            break;
        width = (width + 1) / 2;
        height = (height + 1) / 2;
    }
    m->tiles = calloc(t->levels[0].tiles_x, TILE_BYTES);
    return m->tiles ? SPC_OK : no_memory(err);
}

static enum spc_status write_strip(struct making *m, int k, uint32_t rows, struct spc_error *err)
{
    struct level *const l = &m->texture->levels[k];
    for (uint32_t y = 0; y < rows; y++)
        for (uint32_t x = 0; x < l->width; x++)
            memcpy(m->tiles + (size_t)(x / TILE) * TILE_BYTES + (y * TILE + x % TILE) * 3,
                   m->strips[k] + ((size_t)y * l->width + x) * 4, 3);
    return spb_tmpfile_append(m->file, m->tiles, (size_t)l->tiles_x * TILE_BYTES,
                              &l->strip_off[(m->y[k] - 1) / TILE], err);
}

/* The mean of up to four pixels. */
static void mean_of(const uint8_t *const in[4], int count, uint8_t out[4])
{
    unsigned sum[3] = {0, 0, 0}, plain[3] = {0, 0, 0}, alpha = 0;
    for (int i = 0; i < count; i++) {
        alpha += in[i][3];
        for (int c = 0; c < 3; c++) {
            sum[c] += (unsigned)in[i][c] * in[i][3];
            plain[c] += in[i][c];
        }
    }
    const unsigned n = (unsigned)count;
    for (int c = 0; c < 3; c++)
        out[c] = (uint8_t)(alpha > 0 ? (sum[c] + alpha / 2) / alpha : (plain[c] + n / 2) / n);
    out[3] = (uint8_t)((alpha + n / 2) / n);
}

static void halve(const uint8_t *upper, const uint8_t *lower, uint32_t width, uint8_t *out)
{
    for (uint32_t x = 0; x < width; x += 2, out += 4) {
        const uint8_t *in[4];
        int count = 0;
        for (uint32_t i = x; i < x + 2 && i < width; i++) {
            in[count++] = upper + (size_t)i * 4;
            if (lower)
                in[count++] = lower + (size_t)i * 4;
        }
        mean_of(in, count, out);
    }
}

/* One row of level k, and what it completes above. */
static enum spc_status add_row(struct making *m, const uint8_t *row, struct spc_error *err)
{
    enum spc_status status = SPC_OK;
    for (int k = 0; k < m->texture->level_count; k++) {
        const struct level *const l = &m->texture->levels[k];
        const size_t row_bytes = (size_t)l->width * 4;
        const uint32_t y = m->y[k]++;
        const bool last = m->y[k] == l->height;
        uint8_t *const at = m->strips[k] + y % TILE * row_bytes;
        memcpy(at, row, row_bytes);
        if (y % 2 == 1)
            halve(at - row_bytes, at, l->width, m->half[k]);
        else if (last)
            halve(at, NULL, l->width, m->half[k]);
        if (last || y % TILE == TILE - 1)
            status = write_strip(m, k, y % TILE + 1, err);
        if (status != SPC_OK || (y % 2 == 0 && !last))
            break;
        row = m->half[k];
    }
    return status;
}

static void free_texture(struct texture *t)
{
    for (int k = 0; t && k < t->level_count; k++)
        free(t->levels[k].strip_off);
    free(t);
}

static enum spc_status make(struct spb_textures *s, struct spb_image *image, struct making *m,
                            const struct spb_progress *progress, struct spc_error *err)
{
    const uint32_t width = spb_image_width(image), height = spb_image_height(image);
    enum spc_status status = shape(m, width, height, err);
    uint8_t *const row = malloc((size_t)width * 4);
    m->file = s->file;
    if (status == SPC_OK && !row)
        status = no_memory(err);
    for (uint32_t y = 0; y < height && status == SPC_OK; y++) {
        status = spb_image_row(image, row, err);
        if (status == SPC_OK)
            status = add_row(m, row, err);
        if (status == SPC_OK && y % TILE == 0 && spb_progress_tell(progress, "read textures", y, height))
            status = spc_fail(err, SPC_CANCELLED, SPC_NO_OFF, "cancelled");
    }
    free(row);
    for (int k = 0; k < LEVELS_MAX; k++) {
        free(m->strips[k]);
        free(m->half[k]);
    }
    free(m->tiles);
    return status;
}

enum spc_status spb_textures_add(struct spb_textures *s, const char *path,
                                 const struct spb_progress *progress, uint32_t *number,
                                 struct spc_error *err)
{
    struct making m = {.texture = calloc(1, sizeof *m.texture)};
    struct spb_image *image = NULL;
    enum spc_status status = SPC_OK;

    if (s->count == TEXTURES_MAX)
        status = spc_fail(err, SPC_INPUT_FORMAT, SPC_NO_OFF, "is one of too many");
    if (status == SPC_OK && !m.texture)
        status = no_memory(err);
    if (status == SPC_OK)
        status = spb_image_open(path, s->temp, &image, err);
    if (status == SPC_OK)
        status = make(s, image, &m, progress, err);
    spb_image_close(image);
    if (status == SPC_OK) {
        struct texture **const list = realloc(s->list, (s->count + 1) * sizeof *list);
        if (list) {
            s->list = list;
            list[*number = s->count++] = m.texture;
            return SPC_OK;
        }
        status = no_memory(err);
    }
    free_texture(m.texture);
    return status;
}

enum spc_status spb_textures_create(struct spb_temp *temp, struct spb_textures **out,
                                    struct spc_error *err)
{
    struct spb_textures *const s = calloc(1, sizeof *s);
    *out = NULL;
    if (!s)
        return no_memory(err);
    s->temp = temp;
    const enum spc_status status = spb_tmpfile_create(temp, &s->file, err);
    if (status != SPC_OK) {
        spb_textures_free(s);
        return status;
    }
    *out = s;
    return SPC_OK;
}

void spb_textures_free(struct spb_textures *s)
{
    if (!s)
        return;
    for (uint32_t i = 0; i < s->count; i++)
        free_texture(s->list[i]);
    free(s->list);
    free(s->cache);
    spb_tmpfile_free(s->file);
    free(s);
}

void spb_textures_pause(struct spb_textures *s)
{
    if (!s)
        return;
    free(s->cache);
    s->cache = NULL;
}

static enum spc_status make_cache(struct spb_textures *s, struct spc_error *err)
{
    if (s->cache)
        return SPC_OK;
    s->cache = malloc(sizeof *s->cache);
    if (!s->cache)
        return no_memory(err);
    s->cache->clock = 0;
    memset(s->cache->ways, 255, sizeof s->cache->ways);
    return SPC_OK;
}

/* ---- colours ---------------------------------------------------------------------------------- */

/* The tile at off of the file; it stays until the next call. */
static enum spc_status get_tile(struct spb_textures *s, uint64_t off, const uint8_t **tile,
                                struct spc_error *err)
{
    const uint64_t set = off / TILE_BYTES * UINT64_C(0x9E3779B97F4A7C15) >> 32 & (SETS - 1);
    struct cache *const c = s->cache;
    struct way *const ways = c->ways[set];
    int oldest = 0;
    for (int i = 0; i < WAYS; i++) {
        if (ways[i].off == off) {
            ways[i].used = ++c->clock;
            *tile = c->tiles[set][i];
            return SPC_OK;
        }
        if (ways[i].off == SPC_NO_OFF || (ways[oldest].off != SPC_NO_OFF &&
                                          ways[i].used < ways[oldest].used))
            oldest = i;
    }
    ways[oldest].off = SPC_NO_OFF;
    const enum spc_status status = spb_tmpfile_read(s->file, off, c->tiles[set][oldest], TILE_BYTES, err);
    if (status != SPC_OK)
        return status;
    ways[oldest] = (struct way){off, ++c->clock};
    *tile = c->tiles[set][oldest];
    return SPC_OK;
}

/* A pixel's number inside [0, size). */
static uint32_t inside(int64_t i, uint32_t size, bool clamp)
{
    if (i >= 0 && i < (int64_t)size)
        return (uint32_t)i;
    if (clamp)
        return i < 0 ? 0 : size - 1;
    i %= (int64_t)size;
    return (uint32_t)(i < 0 ? i + (int64_t)size : i);
}

/* How much of pixel i lies in [from, to]. */
static double share(double i, double from, double to)
{
    return (to < i + 1 ? to : i + 1) - (from > i ? from : i);
}

/* The mean over a box of level k, around (x, y) in its pixels. */
static enum spc_status mean_over(struct spb_textures *s, const struct level *l, double x, double y,
                                 double side, bool clamp, uint8_t rgba[4], struct spc_error *err)
{
    const double x0 = x - side / 2, x1 = x + side / 2, y0 = y - side / 2, y1 = y + side / 2;
    double sum[3] = {0, 0, 0}, weights = 0;
    for (double j = floor(y0); j < y1; j++)
        for (double i = floor(x0); i < x1; i++) {
            const uint32_t column = inside((int64_t)i, l->width, clamp);
            const uint32_t row = inside((int64_t)j, l->height, clamp);
            const double weight = share(i, x0, x1) * share(j, y0, y1);
            const uint8_t *tile;
            const enum spc_status status =
                get_tile(s, l->strip_off[row / TILE] + (uint64_t)(column / TILE) * TILE_BYTES, &tile, err);
            if (status != SPC_OK)
                return status;
            const uint8_t *const pixel = tile + (row % TILE * TILE + column % TILE) * 3;
            for (int c = 0; c < 3; c++)
                sum[c] += weight * pixel[c];
            weights += weight;
        }
    for (int c = 0; c < 3; c++)
        rgba[c] = (uint8_t)(sum[c] / weights + 0.5);
    rgba[3] = 255;
    return SPC_OK;
}

/* Side of the box for a triangle with these corners, all in pixels. */
static double box_side(const double p[3][2])
{
    const double LEAST = 1.0 / 64;      /* then nearly all of it is one pixel */
    double longest = 0;
    for (int k = 0; k < 3; k++) {
        const double dx = p[(k + 1) % 3][0] - p[k][0], dy = p[(k + 1) % 3][1] - p[k][1];
        const double length = sqrt(dx * dx + dy * dy);
        longest = length > longest ? length : longest;
    }
    const double twice_area = fabs((p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) -
                                   (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]));
    const double side = longest > 0 ? twice_area / longest / 4 : 0;
    return side > LEAST ? side : LEAST;     /* not a number either: infinite texels */
}

/* u or v inside the picture: [0, 1). */
static double in_picture(double t, bool clamp)
{
    if (clamp)
        return t > 0 ? t < 1 ? t : 1 : 0;
    return t - floor(t);
}

enum spc_status spb_textures_paint(struct spb_textures *s, uint32_t number,
                                   const struct spb_placement *place, const double uv[3][2],
                                   uint8_t rgba[3][4], struct spc_error *err)
{
    const struct texture *const t = s->list[number];
    const double size[2] = {t->levels[0].width, t->levels[0].height};
    double at[3][2], pixels[3][2];
    int k = 0;
    enum spc_status status = make_cache(s, err);
    for (int i = 0; i < 3; i++)
        for (int a = 0; a < 2; a++) {
            at[i][a] = uv[i][a] * place->scale[a] + place->offset[a];
            pixels[i][a] = at[i][a] * size[a];
        }
    double side = box_side((const double(*)[2])pixels), scale = 1;
    for (; side >= 4 && k < t->level_count - 1; k++) {
        side /= 2;
        scale /= 2;
    }
    side = side < 4 ? side : 4;
    for (int i = 0; i < 3 && status == SPC_OK; i++) {
        double x[2];
        for (int a = 0; a < 2; a++) {
            const double p = at[i][a] * (2.0 / 3) + at[(i + 1) % 3][a] / 6 + at[(i + 2) % 3][a] / 6;
            x[a] = in_picture(p, place->clamp) * size[a];
        }
        if (!isfinite(x[0]) || !isfinite(x[1])) {
            memset(rgba[i], 255, 4);
            continue;
        }
        status = mean_over(s, &t->levels[k], x[0] * scale, (size[1] - x[1]) * scale, side, place->clamp,
                           rgba[i], err);
    }
    return status;
}
