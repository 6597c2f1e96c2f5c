/*
 * glsl.h - the shaders, GLSL 3.30.
 *
 * Coordinates: units, from the eye; after u_view x is to the right, y up, z forward. Depth is
 * NEAR / z in a float buffer, larger is nearer: relative precision at any distance.
 */
#ifndef SPV_GLSL_H
#define SPV_GLSL_H

/* Decoding and the interval test; interval.h says the same in C. */
#define GLSL_NODE                                                                               \
    "uniform vec4 u_place;\n"       /* cluster origin from the eye of the tests; step */        \
    "uniform vec2 u_range;\n"       /* e_self up to here has no lower test; link base */        \
    "uniform float u_eps;\n"                                                                    \
    "float len_of(uint code) { return uintBitsToFloat(code << 15); }\n"                         \
    "vec3 center_of(uvec4 r, vec4 place) {\n"                                                   \
    "    return place.xyz + vec3(r.x & 0xFFFFu, r.x >> 16, r.y & 0xFFFFu) * place.w;\n"         \
    "}\n"                                                                                       \
    "vec3 normal_of(uvec4 r) {\n"                                                               \
    "    vec2 p = vec2(r.y >> 16 & 0xFFu, r.y >> 24) - 127.0;\n"                                \
    "    float z = 127.0 - abs(p.x) - abs(p.y);\n"                                              \
    "    if (z < 0.0)\n"                                                                        \
    "        p = vec2(p.x < 0.0 ? -1.0 : 1.0, p.y < 0.0 ? -1.0 : 1.0) * (127.0 - abs(p.yx));\n" \
    "    return normalize(vec3(p, z));\n"                                                       \
    "}\n"                                                                                       \
    "float q_of(uvec4 r) {\n"                                                                   \
    "    return u_eps * (length(center_of(r, u_place)) - len_of(r.w & 0xFFFFu));\n"                      \
    "}\n"                                                                                       \
    "float link_of(uvec4 r) {\n"                                                                \
    "    uint code = r.w >> 24;\n"                                                              \
    "    uint exponent = uint(int(u_range.y) + int(code >> 3) + 127);\n"                           \
    "    return uintBitsToFloat(exponent << 23 | (code & 7u) << 20);\n"                         \
    "}\n"                                                                                       \
    "bool point_drawn(uvec4 r) {\n"                                                             \
    "    float q = q_of(r);\n"                                                                  \
    "    uint e_parent = r.z >> 16;\n"                                                          \
    "    float e_self = len_of(r.z & 0xFFFFu);\n"                                               \
    "    if (!(e_self < q || e_self <= u_range.x))\n"                                           \
    "        return false;\n"                                                                   \
    "    return e_parent == 0xFF00u ||\n"                                                       \
    "        q * (1.0 - 1.0 / 1048576.0) <= len_of(e_parent) + u_eps * link_of(r);\n"           \
    "}\n"                                                                                       \
    "bool triangle_drawn(uvec4 r) { return q_of(r) <= len_of(r.z & 0xFFFFu); }\n"

#define GLSL_FRAME                                                                              \
    "uniform mat3 u_view;\n"                                                                    \
    "uniform float u_focal;\n"      /* px */                                                    \
    "uniform vec2 u_center, u_size;\n"      /* px: where the axis meets the target; its size */

/*
 * One splat: a point of the size of its pill's bounding square, or, where points cannot (too
 * large, or crossing the eye's plane), a quad of four vertices.
 */
static const char GLSL_SPLAT_VS[] =
    "#version 330 core\n"
    "layout(location = 0) in uvec4 a_node;\n"
    "layout(location = 1) in vec4 a_color;\n"
    "layout(location = 2) in vec4 a_place;\n"      /* cluster origin from the picture's eye; step */
    GLSL_NODE GLSL_FRAME
    "uniform float u_limit, u_pad, u_near;\n"
    "uniform int u_quads, u_all;\n"
    "flat out vec3 v_center, v_normal;\n"
    "flat out vec2 v_pill;\n"
    "flat out vec3 v_color;\n"
    "flat out float v_rough;\n"
    "void reject() { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); gl_PointSize = 1.0; }\n"
    "void main() {\n"
    "    v_center = vec3(0.0); v_normal = vec3(0.0); v_pill = vec2(0.0); v_color = vec3(0.0);\n"
    "    v_rough = float(a_node.w >> 16 & 0xFFu) / 255.0;\n"
    "    if (u_all == 0 && !point_drawn(a_node)) { reject(); return; }\n"
    "    vec3 c = u_view * center_of(a_node, a_place);\n"
    "    vec3 n = u_view * normal_of(a_node);\n"
    "    float R = len_of(a_node.w & 0xFFFFu);\n"
    "    float H = R * float((a_node.w >> 16 & 0xFFu) + 1u) / 256.0;\n"
    "    float pad = u_pad * (length(c) + R);\n"
    "    R += pad; H += pad;\n"
    "    vec3 half_box = R * sqrt(max(vec3(0.0), 1.0 - n * n)) + H * abs(n);\n"
    "    float z0 = c.z - half_box.z, z1 = c.z + half_box.z;\n"
    "    if (z1 <= u_near) { reject(); return; }\n"
    "    vec2 lo = c.xy - half_box.xy, hi = c.xy + half_box.xy;\n"
    "    bool crosses = z0 <= u_near;\n"
    "    z0 = max(z0, u_near);\n"          /* only what lies before the eye has a projection */
    "    vec2 px_lo = u_center + u_focal * min(lo / z0, lo / z1);\n"
    "    vec2 px_hi = u_center + u_focal * max(hi / z0, hi / z1);\n"
    "    if (any(greaterThan(px_lo, u_size + 1.0)) || any(lessThan(px_hi, vec2(-1.0)))) {\n"
    "        reject(); return;\n"
    "    }\n"
    "    vec2 extent = px_hi - px_lo;\n"
    "    float size = max(extent.x, extent.y) + 1.0 / 16.0;\n"     /* and the grid points snap to */
    "    bool large = crosses || size > u_limit;\n"
    "    if (large != (u_quads != 0)) { reject(); return; }\n"
    "    v_center = c; v_normal = n; v_pill = vec2(R, H); v_color = a_color.rgb;\n"
    "    if (u_quads != 0) {\n"
    "        px_lo = clamp(px_lo - 1.0 / 16.0, vec2(0.0), u_size);\n"
    "        px_hi = clamp(px_hi + 1.0 / 16.0, vec2(0.0), u_size);\n"
    "        vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);\n"
    "        gl_Position = vec4(mix(px_lo, px_hi, corner) / u_size * 2.0 - 1.0, 0.0, 1.0);\n"
    "        gl_PointSize = 1.0;\n"
    "    } else {\n"
    "        gl_Position = vec4((px_lo + px_hi) / u_size - 1.0, 0.0, 1.0);\n"
    "        gl_PointSize = size;\n"
    "    }\n"
    "}\n";

/*
 * Exact: does the ray through the pixel's centre meet the cylinder? foot + s d is the ray, foot its
 * point nearest to the centre, relative to it, so nothing large cancels. Depth is that of the
 * disk's plane, kept inside the cylinder. A pill that is high for its radius holds triangles of
 * many directions: its light tends to their average, away from that of its one normal.
 */
static const char GLSL_SPLAT_FS[] =
    "#version 330 core\n"
    "flat in vec3 v_center, v_normal;\n"
    "flat in vec2 v_pill;\n"
    "flat in vec3 v_color;\n"
    "flat in float v_rough;\n"
    "uniform float u_focal, u_near, u_ambient;\n"
    "uniform vec2 u_center;\n"
    "uniform int u_fast;\n"
    "out vec4 o_color;\n"
    "void main() {\n"
    "    vec3 d = normalize(vec3((gl_FragCoord.xy - u_center) / u_focal, 1.0));\n"
    "    float along = dot(v_center, d);\n"
    "    float s = 0.0;\n"
    "    if (u_fast == 0) {\n"
    "        vec3 foot = d * along - v_center;\n"
    "        float a = dot(v_normal, d), b = dot(v_normal, foot);\n"
    "        vec3 across = d - v_normal * a, beside = foot - v_normal * b;\n"
    "        float A = dot(across, across), B = dot(beside, across);\n"
    "        float C = dot(beside, beside) - v_pill.x * v_pill.x;\n"
    "        float lo = -1e30, hi = 1e30;\n"
    "        if (abs(a) > 1e-6) {\n"
    "            vec2 t = (vec2(-v_pill.y, v_pill.y) - b) / a;\n"
    "            lo = min(t.x, t.y); hi = max(t.x, t.y);\n"
    "        } else if (abs(b) > v_pill.y) discard;\n"
    "        if (A > 1e-12) {\n"
    "            float D = B * B - A * C;\n"
    "            if (D < 0.0) discard;\n"
    "            float root = sqrt(D);\n"
    "            lo = max(lo, (-B - root) / A); hi = min(hi, (-B + root) / A);\n"
    "        } else if (C > 0.0) discard;\n"
    "        if (lo > hi || along + hi <= 0.0) discard;\n"
    "        s = clamp(abs(a) > 1e-6 ? -b / a : 0.0, lo, hi);\n"
    "    }\n"
    "    float z = max((along + s) * d.z, 2.0 * u_near);\n"
    "    gl_FragDepth = u_near / z;\n"
    "    float facing = dot(v_normal, d);\n"
    "    float light = sqrt(mix(facing * facing, 0.4, v_rough * v_rough));\n"
    "    o_color = vec4(v_color * (u_ambient + (1.0 - u_ambient) * light), 1.0);\n"
    "}\n";

/*
 * Triangles fetch their leaf's record, their corners and colours: three vertices each, no
 * attributes. A corner is computed from its lattice point as two integers, so that it is the same
 * number whichever block it comes from: no cracks.
 *
 * Rasterisers snap corners to 1/256 px and the lattice moves them, too: at the rim of a surface that
 * would lose pixels whose centre lies on the very edge. So edges move outward by 1/64 px, as splats
 * do. Where two of them meet at a needle's tip their crossing is far off: no further than 2 px.
 */
static const char GLSL_TRIANGLE_VS[] =
    "#version 330 core\n"
    "uniform usamplerBuffer u_nodes, u_words;\n"   /* the whole block in 16 and in 4 bytes */
    "uniform ivec4 u_at;\n"         /* where nodes, indices, vertices and colours begin, in their own size */
    "uniform ivec3 u_base_hi, u_base_lo;\n"     /* block's base minus the eye's, in 2^16 and 1 */
    "uniform vec3 u_eye_rest;\n"                /* from the eye to its lattice point */
    "uniform float u_lattice;\n"
    "uniform int u_width, u_all, u_colored;\n"
    "uniform vec3 u_paint;\n"       /* for what has no colours */
    GLSL_NODE GLSL_FRAME
    "uniform float u_near;\n"
    "out vec3 v_color;\n"
    "flat out vec3 v_normal;\n"
    "uint word(int at) { return texelFetch(u_words, at).x; }\n"
    "uint half_word(int at) { return word(at >> 1) >> (16 * (at & 1)) & 0xFFFFu; }\n"
    "int vertex_of(int corner) { return int(half_word(u_at.y + corner)); }\n"
    "void axis_of(int number, int axis, out int hi, out int lo) {\n"
    "    uint low = u_width == 2 ? half_word(u_at.z + number) : word(u_at.z + number * (u_width >> 2));\n"
    "    int sum = u_base_lo[axis] + int(low & 0xFFFFu);\n"
    "    hi = u_base_hi[axis] + (sum >> 16) + int(low >> 16);\n"
    "    if (u_width > 4) hi += int(word(u_at.z + number * 2 + 1) << 16);\n"
    "    lo = sum & 0xFFFF;\n"
    "}\n"
    "vec3 corner_of(int corner) {\n"
    "    int first = 3 * vertex_of(corner);\n"
    "    ivec3 hi, lo;\n"
    "    axis_of(first, 0, hi.x, lo.x);\n"
    "    axis_of(first + 1, 1, hi.y, lo.y);\n"
    "    axis_of(first + 2, 2, hi.z, lo.z);\n"
    "    return u_view * ((vec3(hi) * 65536.0 + vec3(lo)) * u_lattice + u_eye_rest);\n"
    "}\n"
    "vec3 color_of(int corner) {\n"
    "    uint rgba = word(u_at.w + vertex_of(corner));\n"
    "    return vec3(rgba & 0xFFu, rgba >> 8 & 0xFFu, rgba >> 16 & 0xFFu) / 255.0;\n"
    "}\n"
    "vec2 outward(vec3 at, vec3 next, vec3 last) {\n"      /* px by which a corner moves */
    "    if (min(at.z, min(next.z, last.z)) <= 4.0 * u_near) return vec2(0.0);\n"
    "    vec2 p = u_focal * at.xy / at.z;\n"
    "    vec2 a = u_focal * next.xy / next.z - p, b = u_focal * last.xy / last.z - p;\n"
    "    float area = a.x * b.y - a.y * b.x, la = length(a), lb = length(b);\n"
    "    if (area == 0.0 || la == 0.0 || lb == 0.0) return vec2(0.0);\n"
    "    a /= la; b /= lb;\n"
    "    vec2 move = -(a + b) / max(abs(a.x * b.y - a.y * b.x), 1e-9) / 64.0;\n"
    "    float far = length(move);\n"
    "    return far > 2.0 ? move * (2.0 / far) : move;\n"
    "}\n"
    "void main() {\n"
    "    int triangle = gl_VertexID / 3, corner = gl_VertexID - 3 * triangle;\n"
    "    uvec4 node = texelFetch(u_nodes, u_at.x + triangle);\n"
    "    v_color = u_paint; v_normal = vec3(0.0);\n"
    "    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);\n"
    "    if (u_all == 0 && !triangle_drawn(node)) return;\n"
    "    int first = 3 * triangle;\n"
    "    vec3 at = corner_of(gl_VertexID);\n"
    "    vec2 move = outward(at, corner_of(first + (corner + 1) % 3), corner_of(first + (corner + 2) % 3));\n"
    "    v_normal = u_view * normal_of(node);\n"
    "    if (u_colored != 0) v_color = color_of(gl_VertexID);\n"
    "    vec2 px = u_focal * at.xy * 2.0 + (2.0 * (u_center + move) - u_size) * at.z;\n"
    "    gl_Position = vec4(px / u_size, at.z - 2.0 * u_near, at.z);\n"
    "}\n";

static const char GLSL_TRIANGLE_FS[] =
    "#version 330 core\n"
    "in vec3 v_color;\n"
    "flat in vec3 v_normal;\n"
    "uniform float u_focal, u_near, u_ambient;\n"
    "uniform vec2 u_center;\n"
    "out vec4 o_color;\n"
    "void main() {\n"
    "    vec3 d = normalize(vec3((gl_FragCoord.xy - u_center) / u_focal, 1.0));\n"
    "    gl_FragDepth = u_near * gl_FragCoord.w;\n"
    "    float light = abs(dot(v_normal, d));\n"
    "    o_color = vec4(v_color * (u_ambient + (1.0 - u_ambient) * light), 1.0);\n"
    "}\n";

/* A rectangle in the picture at one depth: asks whether anything of it would show. */
static const char GLSL_BOX_VS[] =
    "#version 330 core\n"
    "uniform vec4 u_rect;\n"        /* px */
    "uniform vec2 u_size;\n"
    "void main() {\n"
    "    vec2 px = mix(u_rect.xy, u_rect.zw, vec2(gl_VertexID & 1, gl_VertexID >> 1));\n"
    "    gl_Position = vec4(px / u_size * 2.0 - 1.0, 0.0, 1.0);\n"
    "}\n";

static const char GLSL_BOX_FS[] =
    "#version 330 core\n"
    "uniform float u_depth;\n"
    "void main() { gl_FragDepth = u_depth; }\n";

/* The picture without its guard band, as large as the window, over a background. */
static const char GLSL_SHOW_VS[] =
    "#version 330 core\n"
    "void main() {\n"
    "    gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0);\n"
    "}\n";

static const char GLSL_SHOW_FS[] =
    "#version 330 core\n"
    "uniform sampler2D u_picture;\n"
    "uniform int u_guard;\n"        /* px */
    "uniform vec2 u_scale, u_size;\n"       /* window px to picture px; size of the picture */
    "uniform vec3 u_background;\n"
    "out vec4 o_color;\n"
    "void main() {\n"
    "    ivec2 at = ivec2(min(gl_FragCoord.xy * u_scale, u_size - 0.5));\n"
    "    vec4 color = texelFetch(u_picture, at + u_guard, 0);\n"
    "    o_color = vec4(mix(u_background, color.rgb, color.a), 1.0);\n"
    "}\n";

#endif
