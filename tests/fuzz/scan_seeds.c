#include "scan_seeds.h"

#include "ply_case.h"

/* ---- PLY: each of these in text and in both byte orders -------------------------------------- */

static void put_strips(struct file_text *f, int format)
{
    static const int values[] = { 0, 1, 2, 3, -1, 3, 2, 1 };
    put(f, "element vertex 4\n" PLY_XYZ "element tristrips 1\n"
        "property list int int vertex_indices\nend_header\n");
    ply_vertices(f, format, 4);
    ply_value(f, format, T_INT, 8);
    for (int i = 0; i < 8; i++)
        ply_value(f, format, T_INT, values[i]);
    ply_row_end(f, format);
}

/* Faces first, lists in the vertices, values between those that are wanted. */
static void put_lists(struct file_text *f, int format)
{
    put(f, "comment a scan\nobj_info num_cols 2\nelement face 2\nproperty uchar flags\n"
        "property list ushort uint vertex_index\nproperty list uchar float texcoord\n"
        "element vertex 3\nproperty double x\nproperty list uchar short more\n"
        "property short y\nproperty int z\nelement edge 1\nproperty int vertex1\nend_header\n");
    for (int i = 0; i < 2; i++) {
        ply_value(f, format, T_UCHAR, i);
        ply_value(f, format, T_USHORT, 3 + i);
        for (int k = 0; k < 3 + i; k++)
            ply_value(f, format, T_UINT, k);
        ply_value(f, format, T_UCHAR, i);
        for (int k = 0; k < i; k++)
            ply_value(f, format, T_FLOAT, 0.5);
        ply_row_end(f, format);
    }
    for (int i = 0; i < 3; i++) {
        ply_value(f, format, T_DOUBLE, 0.1 * i);
        ply_value(f, format, T_UCHAR, i);
        for (int k = 0; k < i; k++)
            ply_value(f, format, T_SHORT, -k);
        ply_value(f, format, T_SHORT, i);
        ply_value(f, format, T_INT, -i);
        ply_row_end(f, format);
    }
    ply_value(f, format, T_INT, 7);
    ply_row_end(f, format);
}

static void put_colors(struct file_text *f, int format, int type, double full, const char *names)
{
    put(f, "element vertex 3\n" PLY_XYZ);
    for (int c = 0; c < 4; c++)
        put(f, "property %s %s%s\n", ply_types[type].name, names,
            (const char *const[]){ "red", "green", "blue", "alpha" }[c]);
    put(f, "element face 1\n" PLY_INDEX_LIST "end_header\n");
    for (int i = 0; i < 3; i++) {
        for (int a = 0; a < 3; a++)
            ply_value(f, format, T_FLOAT, i == a);
        for (int c = 0; c < 4; c++)
            ply_value(f, format, type, full * c / 3);
        ply_row_end(f, format);
    }
    ply_face(f, format, 3, (const int[]){ 0, 1, 2 });
}

static void put_polygon(struct file_text *f, int format)
{
    put(f, "element vertex 5\n" PLY_XYZ "element face 3\n" PLY_INDEX_LIST "end_header\n");
    ply_vertices(f, format, 5);
    ply_face(f, format, 5, (const int[]){ 0, 1, 2, 3, 4 });
    ply_face(f, format, 2, (const int[]){ 0, 1 });
    ply_face(f, format, 4, (const int[]){ 3, -1, 99, 0 });
}

static bool ply_seed(uint32_t k, struct file_text *f)
{
    const int format = (int)(k % PLY_FORMAT_COUNT);
    *f = ply_start(format);
    switch (k / PLY_FORMAT_COUNT) {
    case 0: put_polygon(f, format); return true;
    case 1: put_strips(f, format); return true;
    case 2: put_lists(f, format); return true;
    case 3: put_colors(f, format, T_UCHAR, 255, ""); return true;
    case 4: put_colors(f, format, T_USHORT, 65535, "diffuse_"); return true;
    case 5: put_colors(f, format, T_FLOAT, 1, ""); return true;
    default: free(f->data); return false;
    }
}

/* ---- STL -------------------------------------------------------------------------------------- */

static void put_facets(struct file_text *f, const char *name, uint32_t declared, uint32_t count,
                       unsigned word)
{
    put(f, "%-80s", name);
    put_int(f, 4, declared);
    for (uint32_t i = 0; i < count; i++) {
        for (int k = 0; k < 12; k++)
            put_real(f, 4, k == 2 || (k > 2 && k % 4 == (int)i % 4));
        put_int(f, 2, word * i);
    }
}

static const char *const stl_texts[] = {
    "solid one\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1.5 0 -2e-3\n"
    "   vertex 0 1 0\n  endloop\n endfacet\nendsolid one\n",
    "solid\r\nfacet normal nan nan nan outer loop vertex 0 0 0 vertex 1 0 0 vertex 447751.123 1 0 "
    "endloop endfacet\r\nendsolid\r\n# end\r\nSOLID b\r\nFACET OUTER LOOP VERTEX 1 2 3 VERTEX 4 5 6 "
    "VERTEX 7 8 9 ENDLOOP ENDFACET\r\n",
};

static bool stl_seed(uint32_t k, struct file_text *f)
{
    enum { TEXTS = sizeof stl_texts / sizeof *stl_texts };
    *f = (struct file_text){ .big = false };
    switch (k) {
    case TEXTS: put_facets(f, "made by hand", 2, 2, 0); return true;
    case TEXTS + 1: put_facets(f, "solid with colours", 3, 3, 0x8421); return true;
    case TEXTS + 2: put_facets(f, "COLOR=\x10\x20\x30\x40,MATERIAL=", 3, 3, 0x421); return true;
    case TEXTS + 3: put_facets(f, "a wrong count", 9, 2, 0); return true;
    default: break;
    }
    if (k < TEXTS)
        put(f, "%s", stl_texts[k]);
    return k < TEXTS;
}

/* ---- OFF -------------------------------------------------------------------------------------- */

static const char *const off_texts[] = {
    "OFF\n4 3 0\n0 0 0\n1 0 0\n1 1.5 -2e-3\n0 1 447751.123\n3 0 1 2\n4 0 1 2 3\n2 0 1\n",
    "# made by hand\nCOFF 3 1 3 # counts\n0 0 0 255 0 0 255\n1 0 0 0 255 0 128\n0 1 0 0 0 255 0\n"
    "3 0 1 2 0.5 0.5 0.5\n",
    "STCNOFF\n3\n2\n5\n0 0 0 0 0 1 .5 1 0 0 1\n1 0 0 0 0 1 .5 1 0 1 1\n0 1 0 0 0 1 0 1e-1 0 1 0\n\n"
    "3 0\n1 2\r\n3 -1 99 2 200 100 0 # colour\n bye",
    "3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    "\xef\xbb\xbfNOFF\r\n3 1\r\n0 0 0 0 0 1\r\n1 0 0 0 0 1\r\n0 1 0 0 0 1\r\n3 2 1 0\r\n",
};

static bool off_seed(uint32_t k, struct file_text *f)
{
    *f = (struct file_text){ .big = false };
    if (k >= sizeof off_texts / sizeof *off_texts)
        return false;
    put(f, "%s", off_texts[k]);
    return true;
}

/* ---- OBJ -------------------------------------------------------------------------------------- */

static const char *const obj_texts[] = {
    "# made by hand\nmtllib a.mtl\no one\nv 0 0 0\nv 1 0 0\nv 1 1.5 -2e-3\nv 0 1 447751.123\nvt 0 0\nvt 1 0\n"
    "vn 0 0 1\ng a b\nusemtl c\ns off\nf 1/1/1 2/2/1 3/1/1\nf 1//1 2//1 3//1 4//1\nf 1/1 3/2 4/1\n",
    "v 0 0 0 255 0 0\r\nv 1 0 0 0 255 0\r\nv 0 1 0 0 0 255 # blue\r\nf -3 -2 -1\r\nv 1 1 0\r\nf -1 -2 \\\r\n-3\r\n"
    "f 0 9 1\r\nl 1 2\r\np 1\r\n",
    "\xef\xbb\xbfv 0 0 0 1\rv 1 0 0 1\rv 0 1 0 0.5\rfo 1 2 3\rcurv 0 1 1 2\rf 1 2",
    "v nan 0 0\nv 1 inf 0\n\nv 0 1 1e39 0.5 1 0.25 1\n",
};

static bool obj_seed(uint32_t k, struct file_text *f)
{
    *f = (struct file_text){ .big = false };
    if (k >= sizeof obj_texts / sizeof *obj_texts)
        return false;
    put(f, "%s", obj_texts[k]);
    return true;
}

bool scan_seed(int format, uint32_t k, struct file_text *out)
{
    switch (format) {
    case SCAN_PLY: return ply_seed(k, out);
    case SCAN_STL: return stl_seed(k, out);
    case SCAN_OBJ: return obj_seed(k, out);
    default: return off_seed(k, out);
    }
}
