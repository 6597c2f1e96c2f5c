#include "picture.h"

#include "meta.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

struct picture_options picture_defaults(void)
{
    return (struct picture_options){.width = 1024, .height = 1024, .up = {0, 1, 0}, .fov_deg = 45, .eps_px = 1,
                                    .background = {0x20, 0x24, 0x28}, .memory = (uint64_t)1 << 30};
}

/* ---- values ------------------------------------------------------------------------------------ */

static int parse_size(const char *value, struct picture_options *o)
{
    char copy[32];
    uint32_t w, h;
    const char *x = strchr(value, 'x');
    const size_t length = x != NULL ? (size_t)(x - value) : sizeof copy;
    if (length < sizeof copy) {
        memcpy(copy, value, length);
        copy[length] = '\0';
        if (cli_u32(copy, 1, PICTURE_SIDE_MAX, &w) && cli_u32(x + 1, 1, PICTURE_SIDE_MAX, &h)) {
            o->width = (int)w;
            o->height = (int)h;
            return EXIT_DONE;
        }
    }
    return cli_usage("--size takes WxH, 1 to %d each, not '%s'", PICTURE_SIDE_MAX, value);
}

static int parse_background(const char *value, struct picture_options *o)
{
    o->transparent = strcmp(value, "none") == 0;
    if (o->transparent)
        return EXIT_DONE;
    if (strlen(value) != 6 || strspn(value, "0123456789abcdefABCDEF") != 6)
        return cli_usage("--background takes RRGGBB or none, not '%s'", value);
    const unsigned long v = strtoul(value, NULL, 16);
    for (int i = 0; i < 3; i++)
        o->background[i] = (uint8_t)(v >> (16 - 8 * i));
    return EXIT_DONE;
}

static int parse_orbit(const char *value, struct picture_options *o)
{
    double v[3] = {0, 0, 0};
    if (!cli_doubles(value, v, 2) && (!cli_doubles(value, v, 3) || !(v[2] > 0)))
        return cli_usage("--orbit takes AZ,EL or AZ,EL,DIST with DIST above 0, not '%s'", value);
    o->azimuth = v[0];
    o->elevation = v[1];
    o->distance = v[2];
    o->has_orbit = true;
    return EXIT_DONE;
}

static int parse_point(const char *option, const char *value, double out[3], bool *has)
{
    *has = true;
    return cli_doubles(value, out, 3) ? EXIT_DONE : cli_usage("--%s takes X,Y,Z, not '%s'", option, value);
}

/* One of three words, the last may be missing, into its number. */
static int choose(const char *option, const char *word, const char *const words[3], int *out)
{
    for (int i = 0; i < 3 && words[i] != NULL; i++)
        if (strcmp(word, words[i]) == 0) {
            *out = i;
            return EXIT_DONE;
        }
    return cli_usage("--%s does not know '%s'", option, word);
}

static int parse_word(int option, const char *value, struct picture_options *o)
{
    static const char *const modes[3] = {"hybrid", "points", "triangles"};
    static const char *const splats[3] = {"exact", "fast", NULL};
    static const char *const renderers[3] = {"auto", "soft", "gl"};
    int k = 0, code = EXIT_DONE;
    if (option == PICTURE_MODE) {
        code = choose("mode", value, modes, &k);
        o->mode = (enum spv_mode)k;
    } else if (option == PICTURE_SPLAT) {
        code = choose("splat", value, splats, &k);
        o->splat = (enum spv_splat)k;
    } else {
        code = choose("renderer", value, renderers, &k);
        o->renderer = (enum picture_renderer)k;
    }
    return code;
}

int picture_option(int option, const char *value, struct picture_options *o)
{
    switch (option) {
    case PICTURE_SIZE: return parse_size(value, o);
    case PICTURE_ORBIT: return parse_orbit(value, o);
    case PICTURE_EYE: return parse_point("eye", value, o->eye, &o->has_eye);
    case PICTURE_TARGET: return parse_point("target", value, o->target, &o->has_target);
    case PICTURE_UP: return parse_point("up", value, o->up, &o->has_up);
    case PICTURE_BACKGROUND: return parse_background(value, o);
    case PICTURE_MODE:
    case PICTURE_SPLAT:
    case PICTURE_RENDERER: return parse_word(option, value, o);
    case PICTURE_NO_CULL:
        o->no_cull = true;
        return EXIT_DONE;
    case PICTURE_FOV:
        if (!cli_double(value, &o->fov_deg) || !(o->fov_deg >= 0.01 && o->fov_deg <= 179))
            return cli_usage("--fov takes 0.01 to 179 degrees, not '%s'", value);
        return EXIT_DONE;
    case PICTURE_EPS:
        if (!cli_double(value, &o->eps_px) || !(o->eps_px > 0))
            return cli_usage("--eps takes pixels above 0, not '%s'", value);
        return EXIT_DONE;
    case PICTURE_THREADS:
        if (!cli_u32(value, 1, 1024, &o->threads))
            return cli_usage("--threads takes 1 to 1024, not '%s'", value);
        return EXIT_DONE;
    case PICTURE_MEMORY:
        if (!cli_size(value, &o->memory) || o->memory < (uint64_t)16 << 20)
            return cli_usage("--memory takes a size of at least 16M, not '%s'", value);
        return EXIT_DONE;
    default:
        return cli_usage("unknown option");
    }
}

int picture_check(const struct picture_options *o)
{
    if (o->has_eye != o->has_target)
        return cli_usage("--eye and --target go together");
    if (o->has_eye && o->has_orbit)
        return cli_usage("--orbit and --eye exclude each other");
    return EXIT_DONE;
}

/* ---- what follows from them --------------------------------------------------------------------- */

void picture_take_up(const struct spc_reader *reader, struct picture_options *o)
{
    struct meta_coordinates c;
    size_t bytes = 0;
    if (o->has_up)
        return;
    const char *text = spc_reader_meta(reader, &bytes);
    json_t *meta = json_loadb(text, bytes, 0, NULL);
    meta_read_coordinates(meta, &c);
    json_decref(meta);
    const char *axis = c.up[0] == '-' ? c.up + 1 : c.up;
    if (axis[0] < 'x' || axis[0] > 'z')
        return;
    for (int a = 0; a < 3; a++)
        o->up[a] = axis[0] - 'x' != a ? 0 : c.up[0] == '-' ? -1 : 1;
}

bool picture_camera(const struct picture_options *o, const double box_min[3], const double box_max[3],
                    struct spv_camera *camera)
{
    const double degree = 3.14159265358979323846 / 180;
    if (o->has_eye)
        return spv_camera_look(camera, o->eye, o->target, o->up, o->fov_deg * degree, o->width, o->height);
    return spv_camera_orbit(camera, box_min, box_max, o->azimuth * degree, o->elevation * degree, o->distance, o->up,
                            o->fov_deg * degree, o->width, o->height);
}

static enum spc_status context(enum picture_renderer renderer, bool card, struct spv_ctx **ctx,
                               struct spc_error *err)
{
    const enum spc_status status = spv_ctx_egl(card ? SPV_CTX_GPU : SPV_CTX_ANY, ctx, err);
    return status == SPC_OK || card || renderer == PICTURE_AUTO ? status : spv_ctx_osmesa(ctx, err);
}

/* fails  SPC_FEATURE: no such context, or, where a graphics card is wanted, the processor draws */
static enum spc_status try_gl(enum picture_renderer renderer, bool card, struct spv_ctx **ctx,
                              struct spv_draw **draw, struct spc_error *err)
{
    enum spc_status status = context(renderer, card, ctx, err);
    if (status == SPC_OK)
        status = spv_gl_create(*ctx, draw, err);
    if (status == SPC_OK && card && spv_gl_is_software(*draw))
        status = spc_fail(err, SPC_FEATURE, SPC_NO_OFF, "the processor draws");
    if (status != SPC_OK) {
        spv_draw_free(*draw);
        spv_ctx_free(*ctx);
        *draw = NULL;
        *ctx = NULL;
    }
    return status;
}

enum spc_status picture_renderer(const struct picture_options *o, struct spv_ctx **ctx, struct spv_draw **draw,
                                 struct spc_error *err)
{
    struct spc_error ignored = {0};
    *ctx = NULL;
    *draw = NULL;
    if (o->renderer == PICTURE_GL)
        return try_gl(o->renderer, false, ctx, draw, err);
    if (o->renderer == PICTURE_AUTO && try_gl(o->renderer, true, ctx, draw, &ignored) == SPC_OK)
        return SPC_OK;
    return spv_soft_create(o->threads, draw, err);
}
