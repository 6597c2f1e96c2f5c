"""Codec zstd: planes, columns and families (sections 6.4, 6.4.1 and 6.4.2).

Columns come in a fixed order and tell how long the later ones are, so they are
read through a cursor over the table."""
import math

from codes import add_color, length_value, link_code, need, pow2, unzigzag
from records import (COLORS, INNER, Node, PRELUDE, read_record, Record, unpack_array,
                     ZSTD)
import triangles
from zstdframe import inflate


def plane_count(archive, b):
    """Entries of the table: one a byte of every column."""
    colors = 4 if archive.flag(COLORS) else 0
    nodes = 3 * 2 + 2 + 2 + 2 + 1 + colors
    families = 1 + 1 + 1 + 2 + 1 if b.kind == INNER else 1 + 1 + 2 + 1
    if b.has_triangles:
        nodes = 1 + 1 + 1 + 2 + 3 * b.vertex_width + colors
    return families + nodes + 2


def read_table(archive, b):
    """Prelude and table: b.planes gets (mode, stored bytes) each."""
    what = "block %d" % b.index
    table = 32 + 4 * plane_count(archive, b)
    need(len(b.stored) >= table, "%s: table of planes is cut" % what)
    b.prelude = read_record(b.stored, 0, PRELUDE)
    p = b.prelude
    need(1 <= p.family_count <= b.node_count, "%s: family_count" % what)
    need(max(p.e_shift, p.radius_shift, p.height_shift) <= 8, "%s: shift" % what)
    need(p.position_bits <= 127, "%s: position_bits" % what)
    need(b.has_triangles or not any(p.vertex_base), "%s: vertex_base" % what)
    need(not b.has_triangles or not (p.radius_shift or p.height_shift or p.position_bits),
         "%s: a shift of what triangles tell" % what)
    b.planes, at = [], table
    for entry in unpack_array(b.stored, 32, plane_count(archive, b), "u32"):
        mode, size = entry >> 30, entry & (1 << 30) - 1
        need(mode != 3, "%s: mode of a plane" % what)
        need(at + size <= len(b.stored), "%s: plane leaves the block" % what)
        b.planes.append((mode, b.stored[at:at + size]))
        at += size
    need(at == len(b.stored), "%s: bytes behind the planes" % what)


def inflate_all(archive):
    """Tables of all zstd blocks; frames become the bytes they decode to."""
    wanted = []
    for b in archive.blocks:
        if b.codec == ZSTD:
            read_table(archive, b)
            wanted += [(b, i) for i, (mode, data) in enumerate(b.planes)
                       if mode == 0 and data]
    decoded = inflate([b.planes[i][1] for b, i in wanted])
    for (b, i), data in zip(wanted, decoded):
        b.planes[i] = (0, data)


class Cursor:
    """Takes columns off the table, in their order."""

    def __init__(self, b):
        self.planes = b.planes
        self.at = 0
        self.taken = b.columns = []     # their values, for the worked example
        self.what = "block %d" % b.index

    def plane(self, count):
        mode, data = self.planes[self.at]
        self.at += 1
        if count == 0:
            need(mode == 0 and not data, "%s: an empty plane" % self.what)
            return b""
        if mode == 2:
            need(len(data) <= 1 and data != b"\0", "%s: a plane of one byte" % self.what)
            return (data or b"\0") * count
        need(len(data) == count, "%s: size of a plane" % self.what)
        return data

    def column(self, count, width):
        parts = [self.plane(count) for _ in range(width)]
        values = [int.from_bytes(v, "little") for v in zip(*parts)]
        self.taken.append(values)
        return values

    def end(self):
        need(self.at == len(self.planes), "%s: planes left over" % self.what)


class Family:
    """Nodes are numbers in canonical order; parent is one too, or None."""

    def __init__(self, size, group, parent=None):
        self.size, self.group, self.parent = size, group, parent
        self.first = 0


def read_planes(archive, b):
    cursor = Cursor(b)
    nodes = [Node() for _ in range(b.node_count)]
    if b.kind == INNER:
        families = read_inner(archive, b, cursor, nodes)
    else:
        families = read_leaves(archive, b, cursor, nodes)
    normal_clusters = archive.header.normal_clusters
    cosines = cursor.column(normal_clusters, 2)
    cursor.end()
    b.groups = [Record() for _ in range(normal_clusters)]
    for g, cosine in zip(b.groups, cosines):
        g.count, g.cosine = 0, cosine - (cosine >> 15 << 16)
    b.canonical, b.families = nodes, families
    b.told = [f.size for f in families]
    b.nodes = []
    for f in sorted(families, key=lambda f: f.group):       # stable: canonical inside
        b.groups[f.group].count += f.size
        b.nodes += nodes[f.first:f.first + f.size]


def read_groups(archive, cursor, count):
    """Ranks in a list whose numbers move to the front when they are taken."""
    recent, groups = list(range(128)), []
    for rank in cursor.column(count, 1):
        need(rank < 128, "%s: rank of a group" % cursor.what)
        recent.insert(0, recent.pop(rank))
        groups.append(recent[0])
    need(max(groups) < archive.header.normal_clusters, "%s: group" % cursor.what)
    return groups


# --- section 6.4.1 ---

def read_inner(archive, b, cursor, nodes):
    n, count = b.node_count, b.prelude.family_count
    kids = cursor.column(n, 1)
    need(max(kids) < 32, "%s: kids" % cursor.what)
    orphans = cursor.column(count, 1)
    need(max(orphans) <= 4, "%s: orphans" % cursor.what)
    groups = read_groups(archive, cursor, count)
    errors = cursor.column(sum(1 for o in orphans if o), 2)
    links = cursor.column(sum(1 for o in orphans if o), 1)
    for node, kid in zip(nodes, kids):
        node.nibble, node.joined = kid & 15, kid >= 16
        need(node.nibble <= 12, "%s: kids" % cursor.what)
    families = replay_families(kids, orphans, groups, cursor.what)
    set_orphan_errors(b, families, nodes, errors)
    parents = [f.parent for f in families for _ in range(f.size)]
    read_node_columns(archive, b, cursor, nodes, parents)
    for node, parent in zip(nodes, parents):
        if parent is not None:
            bound = link_bound(archive, b, nodes[parent], node)
            node.link = link_code(bound, b.link_base)
    set_links(b, [nodes[f.first:f.first + f.size] for f in families if f.parent is None],
              links)
    return families


def inner_children(nibble):
    return nibble - (8 if nibble >= 8 else 4 if nibble >= 4 else 1 if nibble else 0)


def replay_families(kids, orphans, groups, what):
    stack, families, met = [], [], 0
    for orphan, group in zip(orphans, groups):
        if orphan:
            family = Family(orphan, group)
        else:
            need(stack, "%s: a family without a parent" % what)
            parent = stack.pop()
            family = Family(inner_children(kids[parent] & 15), group, parent)
            need(family.size >= 1, "%s: an empty family" % what)
        family.first = met
        met += family.size
        need(met <= len(kids), "%s: families have too many nodes" % what)
        stack += [i for i in reversed(range(family.first, met)) if kids[i] & 16]
        families.append(family)
    need(not stack and met == len(kids), "%s: families do not use the nodes up" % what)
    return families


def set_orphan_errors(b, families, nodes, errors):
    orphans = [f for f in families if f.parent is None]
    for f, error in zip(orphans, errors):
        for node in nodes[f.first:f.first + f.size]:
            node.e_parent = error << b.prelude.e_shift & 0xFFFF


def set_links(b, families, links):
    """Of families whose nodes share their link."""
    for members, link in zip(families, links):
        floor = link_code(length_value(max(m.radius for m in members)), b.link_base)
        for m in members:
            m.link = (link + floor) & 0xFF


def link_bound(archive, b, parent, node):
    """The bound of 6.4.1, in f64 and in the order written there."""
    dx, dy, dz = node.x - parent.x, node.y - parent.y, node.z - parent.z
    d = math.sqrt(dx * dx + dy * dy + dz * dz)
    grow = max(0.0, length_value(parent.radius) - length_value(node.radius))
    return (pow2(d, b.step_exp - archive.header.unit_exp) + grow
            + b.diagonal * 2.0 ** -20) * (1 + 2.0 ** -40)


def read_leaves(archive, b, cursor, nodes):
    n, count, shift = b.node_count, b.prelude.family_count, b.prelude.e_shift
    sizes = cursor.column(count, 1)
    need(min(sizes) >= 1 and max(sizes) <= 4 and sum(sizes) == n, "%s: sizes" % cursor.what)
    groups = read_groups(archive, cursor, count)
    errors = cursor.column(count, 2)
    links = cursor.column(count, 1)
    if b.has_triangles:
        b.vertex_base = b.prelude.vertex_base
        triangles.read_triangles(archive, b, cursor, nodes)
    else:
        read_node_columns(archive, b, cursor, nodes, [None] * n)
    families, first = [], 0
    for size, group, error in zip(sizes, groups, errors):
        family = Family(size, group)
        family.first = first
        members = nodes[first:first + size]
        first += size
        t = max(m.e_self for m in members)
        e = (error + (t + (1 << shift) - 1 >> shift)) << shift & 0xFFFF
        for m in members:
            m.e_parent = e
        families.append(family)
    set_links(b, [nodes[f.first:f.first + f.size] for f in families], links)
    return families


# --- section 6.4.2 ---

def read_node_columns(archive, b, cursor, nodes, parents):
    n, p = b.node_count, b.prelude
    xs, ys, zs = (cursor.column(n, 2) for _ in range(3))
    us, vs = cursor.column(n, 1), cursor.column(n, 1)
    radii, errors = cursor.column(n, 2), cursor.column(n, 2)
    heights = cursor.column(n, 1)
    colors = None
    if archive.flag(COLORS):
        colors = [cursor.column(n, 1) for _ in range(4)]
    start = Node()
    start.normal = (127, 127)
    coarse = p.position_bits + b.step_exp - archive.header.unit_exp
    for i, node in enumerate(nodes):
        before = nodes[i - 1] if i else start
        m = before if parents[i] is None else nodes[parents[i]]
        node.radius = add_shifted(m.radius, radii[i], p.radius_shift, -1)
        s = min(max((node.radius >> 8) - 127 - coarse, 0), 15)
        node.x = add_shifted(m.x, xs[i], s, 1)
        node.y = add_shifted(m.y, ys[i], s, 1)
        node.z = add_shifted(m.z, zs[i], s, 1)
        node.normal = bytes((m.normal[k] + unzigzag(z)) & 0xFF
                            for k, z in enumerate((us[i], vs[i])))
        if parents[i] is not None:
            node.e_parent = m.e_self
        set_error(b, node, m, errors[i])
        node.height = heights[i] << p.height_shift & 0xFF | (1 << p.height_shift) - 1
        if colors:
            node.rgba = add_color(m.rgba, [c[i] for c in colors])


def add_shifted(model, z, shift, sign):
    """The value whose upper bits differ from the model's by zigzag z; what goes
    beyond 16 bits is dropped (6.4)."""
    return (model >> shift) + sign * unzigzag(z) << shift & 0xFFFF


def set_error(b, node, model, value):
    if b.kind == INNER:
        node.e_self = node.e_parent - (value << b.prelude.e_shift) & 0xFFFF
    else:
        node.e_self = model.e_self - unzigzag(value) & 0xFFFF
