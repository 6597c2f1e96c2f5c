"""Chunks and payloads (sections 6.1 to 6.3). Whatever the codec, a block's
payload becomes the attributes that read_raw sets: nodes, groups and, in leaf
blocks with triangles, vertices."""
import math

from codes import (height_value, length_value, link_value, need, normal_vector, pow2,
                   xxh64)
from head import check_node_codes, layout
from records import (check_record, CHUNK, COLORS, GROUP, INNER, Node, NODE, RAW, read_record,
                     unpack_array)
import planes


def read_chunks(archive):
    """Every chunk: hash, header, padding, payload."""
    for b in archive.blocks:
        read_chunk_header(archive, b)
    planes.inflate_all(archive)
    for b in archive.blocks:
        if b.codec == RAW:
            read_raw(archive, b)
        else:
            planes.read_planes(archive, b)
        decode_values(archive, b)


def read_chunk_header(archive, b):
    what = "block %d" % b.index
    chunk = archive.data[b.off:b.off + b.chunk_bytes]
    seed = int.from_bytes(chunk[:8], "little")
    need(xxh64(chunk[16:], seed) == b.hash, "%s: hash of the chunk" % what, "CHECKSUM")
    c = b.chunk = read_record(chunk, 0, CHUNK)
    check_record(c, CHUNK, what + ": chunk header")
    need(c.magic == b"SPCK", "%s: chunk magic" % what)
    need(c.flags == archive.header.flags & 255, "%s: chunk header: flags" % what)
    for name in ("unit_exp", "vertex_exp", "normal_clusters"):
        need(getattr(c, name) == getattr(archive.header, name),
             "%s: chunk header: %s" % (what, name))
    for name in ("hash", "kind", "codec", "vertex_width", "node_count", "vertex_count",
                 "stored_bytes", "diagonal", "step_exp", "link_base"):
        need(getattr(c, name) == getattr(b, name), "%s: chunk header: %s" % (what, name))
    # Bytes, not values: a repeated -0 has to be a -0.
    origin = archive.sections[1].off + 320 * b.cluster + 56
    need(chunk[40:64] == archive.data[origin:origin + 24], "%s: chunk header: origin" % what)
    diagonal = archive.sections[2].off + 64 * b.index + 12
    need(chunk[32:36] == archive.data[diagonal:diagonal + 4],
         "%s: chunk header: diagonal" % what)
    need(not any(chunk[64 + b.stored_bytes:]), "%s: padding of the chunk" % what)
    b.stored = chunk[64:64 + b.stored_bytes]


# --- section 6.3 ---

def read_raw(archive, b):
    what = "block %d" % b.index
    places, size = layout(archive, b)
    need(b.stored_bytes == size, "%s: size of the payload" % what)
    end = 0
    for at, length in places.values():
        need(not any(b.stored[end:at]), "%s: bytes between arrays" % what)
        end = at + length
    need(not any(b.stored[end:]), "%s: bytes behind the arrays" % what)
    read_nodes(archive, b, places)
    at = places["groups"][0]
    b.groups = [read_record(b.stored, at + 4 * g, GROUP)
                for g in range(archive.header.normal_clusters)]
    b.canonical = None          # section 7 has to tell
    if b.has_triangles:
        read_triangles(archive, b, places)


def read_nodes(archive, b, places):
    stored = b.stored
    b.nodes = [Node(read_record(stored, places["nodes"][0] + 16 * i, NODE))
               for i in range(b.node_count)]
    if archive.flag(COLORS):
        for i, node in enumerate(b.nodes):
            at = places["colors"][0] + 4 * i
            node.rgba = stored[at:at + 4]
    if b.kind == INNER:
        at, size = places["children"]
        for i, node in enumerate(b.nodes):
            node.nibble = stored[at + i // 2] >> 4 * (i & 1) & 15
        need(b.node_count % 2 == 0 or stored[at + size - 1] >> 4 == 0,
             "block %d: last half byte of children" % b.index)


def read_triangles(archive, b, places):
    stored, v = b.stored, b.vertex_count
    numbers = unpack_array(stored, places["indices"][0], 3 * b.node_count, "u16")
    for i, node in enumerate(b.nodes):
        node.corners = numbers[3 * i:3 * i + 3]
        need(max(node.corners) < v, "block %d: index" % b.index)
    b.vertex_base = unpack_array(stored, places["vertex_base"][0], 3, "i64")
    kind = {2: "u16", 4: "u32", 8: "u64"}[b.vertex_width]
    flat = unpack_array(stored, places["vertices"][0], 3 * v, kind)
    b.offsets = [flat[3 * i:3 * i + 3] for i in range(v)]
    b.vertex_rgba = [b"\xff\xff\xff\xff"] * v
    if archive.flag(COLORS):
        at = places["vertex_colors"][0]
        b.vertex_rgba = [stored[at + 4 * i:at + 4 * i + 4] for i in range(v)]


# --- section 5: values of a decoded payload, and the rules of 6.2 and 6.3 ---

def decode_values(archive, b):
    what = "block %d" % b.index
    cluster = archive.clusters[b.cluster]
    step = math.ldexp(1, b.step_exp)
    for node in b.nodes:
        node.block, node.kind = b, b.kind
        check_node_codes(node, True, what)
        node.R = length_value(node.radius)
        node.H = height_value(node.height, node.R)
        node.L = link_value(node.link, b.link_base)
        node.center = tuple(o + q * step
                            for o, q in zip(cluster.origin, (node.x, node.y, node.z)))
        node.vector = normal_vector(*node.normal)
        if b.kind == INNER:
            need(node.nibble <= 12, "%s: children of a node" % what)
    need(all(math.isfinite(o + 65535 * step) for o in cluster.origin),
         "%s: positions are not finite" % what)
    check_groups(b, what)
    if b.has_triangles:
        decode_vertices(archive, b, what)


def check_groups(b, what):
    need(sum(g.count for g in b.groups) == b.node_count, "%s: counts of groups" % what)
    at = 0
    for g in b.groups:
        need(g.cosine >= -32767, "%s: cosine of a group" % what)
        for node in b.nodes[at:at + g.count]:
            node.group = g
        at += g.count


def decode_vertices(archive, b, what):
    limit = 1 << 53
    need(all(-limit <= base <= limit for base in b.vertex_base), "%s: vertex_base" % what)
    unit = archive.header.vertex_exp
    b.lattice = []
    b.vertices = []
    for offset in b.offsets:
        point = tuple(base + o for base, o in zip(b.vertex_base, offset))
        need(all(-limit <= p <= limit for p in point), "%s: vertex" % what)
        b.lattice.append(point)
        value = tuple(pow2(p, unit) for p in point)
        need(all(map(math.isfinite, value)), "%s: vertex is not finite" % what)
        b.vertices.append(value)
