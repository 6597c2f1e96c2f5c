"""The canonical text dump; its form is defined in spc_second.py."""
import math

from codes import ROOT_MARK, length_value
from records import BLOCK, CLUSTER, HEADER, SECTION, TOP

HIDDEN = ("zero", "zero_1", "zero_2")


def real(value):
    """C's printf("%.13a") of a double."""
    if math.isinf(value):
        return "inf" if value > 0 else "-inf"
    if value == 0:
        return ("-" if math.copysign(1, value) < 0 else "") + "0x0.0000000000000p+0"
    return value.hex()


def text_of(value, kind):
    if isinstance(value, (bytes, bytearray)):
        return value.hex()
    values = value if isinstance(value, tuple) else (value,)
    if kind in ("f32", "f64"):
        return " ".join(real(v) for v in values)
    return " ".join("%d" % v for v in values)


def dump_record(out, head, record, table):
    for _, kind, _, name in table:
        if name not in HIDDEN:
            out("%s.%s %s" % (head, name, text_of(getattr(record, name), kind)))


def escape(data):
    return "".join(chr(c) if 32 <= c < 127 and c != 92 else "\\%02x" % c for c in data)


def dump(archive, out):
    dump_record(out, "header", archive.header, HEADER)
    for i, s in enumerate(archive.sections):
        dump_record(out, "section %d" % i, s, SECTION)
    for i, axis in enumerate(archive.axes):
        out("axis %d %d %d %d" % (i, *axis))
    out("meta %s" % escape(archive.meta))
    for cluster in archive.clusters:
        dump_cluster(archive, cluster, out)
    out("end")


def dump_cluster(archive, cluster, out):
    dump_record(out, "cluster %d" % cluster.index, cluster, CLUSTER)
    for t, top in enumerate(cluster.tops):
        dump_record(out, "cluster %d top %d" % (cluster.index, t), top, TOP)
    for b in cluster.blocks:
        dump_block(b, out)
    for node in cluster.order:
        dump_node(node, out)
    for node in cluster.order:
        if node.corners:
            dump_triangle(node, out)


def dump_block(b, out):
    dump_record(out, "block %d" % b.index, b, BLOCK)
    for i, g in enumerate(b.groups):
        out("block %d group %d %d %d" % (b.index, i, g.count, g.cosine))
    if b.has_triangles:
        out("block %d vertex_base %d %d %d" % (b.index, *b.vertex_base))


def parent_text(node):
    if node.parent is None:
        return "-"
    if node.parent.cluster is node.cluster:
        return "%d" % node.parent.number
    return "^%d" % node.parent.number


def dump_node(node, out):
    e_parent = "root" if node.e_parent == ROOT_MARK else "%d" % node.e_parent
    out("node %d %s %d %s %d %s R %s H %s L %s e %d %s t %s normal %d %d rgba %s"
        % (node.number, parent_text(node), node.block.index, "il"[node.kind],
           node.nibble, " ".join(map(real, node.center)), real(node.R), real(node.H),
           real(node.L), node.e_self, e_parent, real(length_value(node.e_self)),
           node.normal[0], node.normal[1], node.rgba.hex()))


def dump_triangle(node, out):
    parts = []
    for corner in node.corners:
        parts.append("%d %s %s" % (corner, " ".join(map(real, node.block.vertices[corner])),
                                   node.block.vertex_rgba[corner].hex()))
    out("triangle %d %s" % (node.number, " ".join(parts)))
