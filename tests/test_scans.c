/*
 * Real scans, when the environment names their folder in SPC_DATA: each converts with the leaves it should
 * have, verifies, and looks from six sides like all its triangles. Prints the figures.
 */
#include "mesh_case.h"
#include "picture_case.h"
#include "source.h"
#include "suite.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const struct {
    const char *name;
    uint64_t leaves;
} SCANS[] = {
    {"igea.ply", 268686}, {"dragon_vrip_res2.ply", 202520}, {"horse.ply", 96966},
    {"kexueguanMesh.ply", 188876}, {"NZBWF1_J.ply", 213462}, {"test_mesh.ply", 76294},
};

struct soup {
    struct ref_triangle *triangles;
    size_t count;
    double min[3], max[3];
};

/* The scan's own triangles, not the archive's. */
static struct soup read_scan(const char *path)
{
    struct soup s = {.min = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, .max = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}};
    struct spb_source *source = NULL;
    struct spb_vertex_batch *v = malloc(sizeof *v);
    struct spb_face_batch *f = malloc(sizeof *f);
    ck_assert_int_eq(spb_source_open(path, NULL, &source, NULL), SPC_OK);
    const struct spb_source_info *info = spb_source_info(source);
    double (*xyz)[3] = malloc(info->vertex_count * sizeof *xyz);
    size_t n = 0, max = 0;
    ck_assert_int_eq(spb_source_begin_vertices(source, NULL), SPC_OK);
    while (spb_source_vertices(source, v, NULL) == SPC_OK && v->count > 0)
        for (size_t i = 0; i < v->count; i++, n++)
            for (int a = 0; a < 3; a++) {
                xyz[n][a] = v->xyz[i][a];
                s.min[a] = fmin(s.min[a], xyz[n][a]);
                s.max[a] = fmax(s.max[a], xyz[n][a]);
            }
    ck_assert_int_eq(spb_source_begin_faces(source, NULL), SPC_OK);
    while (spb_source_faces(source, f, NULL) == SPC_OK && f->count > 0)
        for (size_t i = 0; i < f->count; i++) {
            if (s.count == max) {
                max = 2 * max + 4096;
                s.triangles = realloc(s.triangles, max * sizeof *s.triangles);
            }
            memset(&s.triangles[s.count], 255, sizeof *s.triangles);
            for (int k = 0; k < 3; k++)
                memcpy(s.triangles[s.count].corner[k], xyz[f->corner[i][k]], sizeof *xyz);
            s.count++;
        }
    spb_source_close(source);
    free(xyz);
    free(v);
    free(f);
    return s;
}

static struct ref_compare compare(const struct spc_reader *reader, const struct soup *s,
                                  const double azimuth, const double elevation, double eps_px,
                                  enum spv_mode mode)
{
    const struct spv_draw_options options = {.splat = SPV_SPLAT_EXACT, .ambient = 0.2f};
    const double up[3] = {0, 1, 0}, fov = 0.7853981633974483;
    struct spv_view view = {.mode = mode, .cull = true};
    struct ref_camera camera = {.fov_y_deg = 45, .width = 1024, .height = 1024};
    struct ref_image image;
    struct ref_compare c;
    ck_assert(spv_camera_orbit(&view.camera, s->min, s->max, azimuth, elevation, 0, up, fov, 1024, 1024));
    view.eps = spv_camera_eps(&view.camera, eps_px);
    for (int a = 0; a < 3; a++) {
        camera.eye[a] = view.camera.eye[a];
        camera.target[a] = view.camera.eye[a] + view.camera.forward[a] * (s->max[0] - s->min[0]);
        camera.up[a] = view.camera.up[a];
    }
    ck_assert_int_eq(ref_raster(s->triangles, s->count, &camera, 0.2, &image), 0);
    struct picture p = picture_draw(reader, &view, &options);
    ref_compare_cover(&image, p.cover, &c);
    picture_release(&p);
    ref_image_release(&image);
    return c;
}

START_TEST(scans_look_from_six_sides_like_all_their_triangles)
{
    static const double sides[6][2] = {{0, 0}, {90, 0}, {180, 0}, {270, 0}, {0, 90}, {0, -90}};
    const char *data = getenv("SPC_DATA");
    char path[400];
    for (size_t i = 0; data != NULL && i < sizeof SCANS / sizeof *SCANS; i++) {
        snprintf(path, sizeof path, "%s/scans/%s", data, SCANS[i].name);
        struct spb_build_options o;
        spb_build_defaults(&o);
        o.scan = path;
        o.out = case_path("scan.spc");
        o.force = true;
        struct spc_reader *r = case_build(&o);
        struct soup s = read_scan(path);
        ck_assert_uint_eq(spc_reader_header(r)->leaf_count, SCANS[i].leaves);
        case_verify(r);
        static const struct { double eps; enum spv_mode mode; const char *text; } kinds[] = {
            {1, SPV_HYBRID, "hybrid 1 px"}, {4, SPV_HYBRID, "hybrid 4 px"}, {1, SPV_POINTS, "points 1 px"},
        };
        for (int k = 0; k < 3; k++) {
            double least = 1, least_tolerant = 1;
            uint64_t holes = 0;
            for (int side = 0; side < 6; side++) {
                const double degree = 3.14159265358979323846 / 180;
                const struct ref_compare c = compare(r, &s, sides[side][0] * degree,
                                                     sides[side][1] * degree, kinds[k].eps, kinds[k].mode);
                least = fmin(least, c.overlap);
                least_tolerant = fmin(least_tolerant, c.overlap_tolerant);
                holes += c.holes;
            }
            printf("%-22s %-12s overlap %.4f, with tolerance %.4f, hole pixels %d\n", SCANS[i].name,
                   kinds[k].text, least, least_tolerant, (int)holes);
            fflush(stdout);
            ck_assert_uint_eq(holes, 0);
            ck_assert(k > 0 || (least >= 0.985 && least_tolerant >= 0.995));
        }
        free(s.triangles);
        spc_reader_close(r);
    }
}
END_TEST

int main(void)
{
    return SUITE("scans", case_start, case_finish,
                 scans_look_from_six_sides_like_all_their_triangles);
}
