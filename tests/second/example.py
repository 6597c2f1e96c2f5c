"""The worked example of the specification (section 12), from a small archive:
every byte in rows of eight, then the columns of zstd blocks, the triangles and
the leaves, step by step. It prints Markdown, which the specification holds as
it is, so that a test can tell when the two part."""
import math
import os
import struct

from codes import length_value, link_code, unzigzag
from head import layout
from hexdump import column_names, element, group_text
from leaf import Steps
from records import (BLOCK, CHUNK, CLUSTER, COLORS, HEADER, INNER, NODE, PRELUDE, RAW,
                     read_field, SECTION, SIZES, TOP, unpack_array)
from tree import child_counts

ROW = 8
WIDTH = 96              # of a line; the specification has 100, less the indent
TEXT = WIDTH - 31       # of it behind offset and bytes
LENGTHS = ("e_self", "e_parent", "radius")
FLAGS = ("triangles", "colors", "cull_back", "error_paper")


def real32(value):
    """The shortest text that names this f32."""
    for digits in range(1, 10):
        text = "%.*g" % (digits, value)
        if struct.unpack("<f", struct.pack("<f", float(text)))[0] == value:
            break
    return text


def real64(value):
    """The shortest text that names this f64."""
    text = repr(value)
    return text[:-2] if text.endswith(".0") else text


def length_text(code):
    return "0x%04x = %s" % (code, real32(length_value(code)))


def words(values):
    return " ".join("%d" % v for v in values)


class Rows:
    """Rows of eight bytes; what begins in a row is named beside it."""

    def __init__(self, data, out):
        self.data, self.out, self.at = data, out, 0
        self.row, self.names = 0, ""

    def add(self, size, text, joint=", "):
        """The next size bytes. Parts of an array are joined by a space."""
        if self.at + size > self.row + ROW or len(self.names + joint + text) > TEXT:
            self.end()
        self.names += (joint if self.names and text else "") + text
        self.at += size
        while self.at > self.row + ROW:
            self.flush(self.row + ROW)

    def flush(self, end):
        self.line(self.data[self.row:end].hex(" "), self.names)
        self.row, self.names = end, ""

    def line(self, data, text):
        line = "%04x  %-23s  %s" % (self.row, data, text)
        self.out("    " + line.rstrip())

    def end(self):
        if self.at > self.row:
            self.flush(self.at)

    def title(self, text):
        self.end()
        self.out("    # " + text)

    def zeros(self, end, text="zeros"):
        """Up to the byte end; long runs are told by their length."""
        self.end()
        count = end - self.at
        if count > ROW:
            self.at = end
            self.line("00 x %d" % count, text)
            self.row = end
        elif count:
            self.add(count, text)
            self.end()

    def record(self, table, title):
        start = self.at
        self.title(title)
        for offset, kind, count, name in table:
            if start + offset > self.at:
                self.end()
                self.at = self.row = start + offset
            if kind == "x":
                self.add(count, name) if count <= ROW else self.zeros(self.at + count, name)
                continue
            self.field(kind, count, name)
        self.end()

    def field(self, kind, count, name):
        value = read_field(self.data, self.at, kind, count)
        if name in ("magic", "tag", "id", "rgba", "normal"):
            text = name
            if name == "normal":
                text += " " + words(value)
            elif count == 4 and name != "rgba":
                text += ' "%s"' % value.decode("ascii")
            self.add(SIZES[kind] * count, text)
            return
        values = value if isinstance(value, tuple) else (value,)
        for i, v in enumerate(values):
            text = field_text(kind, name, v)
            self.add(SIZES[kind], text if i else name + " " + text, " " if i else ", ")


def field_text(kind, name, value):
    if kind in ("f32", "f64"):
        return real32(value) if kind == "f32" else real64(value)
    if name == "hash":
        return "0x%016x" % value
    if name in LENGTHS:
        return "0x%04x" % value
    if name == "flags":
        names = [word for bit, word in enumerate(FLAGS) if value >> bit & 1]
        return "%d (%s)" % (value, ", ".join(names) or "none")
    return "%d" % value


# --- the bytes ---

def print_bytes(archive, out):
    rows = Rows(archive.data, out)
    rows.record([f for f in HEADER if f[0] < 224], "header (section 2)")
    used = len(archive.sections)
    for i in range(used):
        rows.record(SECTION, "header: record %d of the sections (section 3)" % i)
    rows.zeros(480, "unused records of sections")
    rows.record([(o - 480, *rest) for o, *rest in HEADER if o >= 480], "header: its end")
    for i, s in enumerate(archive.sections):
        rows.zeros(s.off)
        print_section(archive, rows, i, s)
    for b in archive.blocks:
        rows.zeros(b.off)
        rows.record(CHUNK, "block %d: chunk header (6.1)" % b.index)
        if b.codec == RAW:
            print_raw(archive, rows, b)
        else:
            print_planes(archive, rows, b)
        rows.zeros(b.off + b.chunk_bytes, "padding")


def print_section(archive, rows, index, s):
    if index == 0:
        rows.title("AXES")
        for i, axis in enumerate(archive.axes):
            rows.add(6, "axis %d: %s" % (i, words(axis)))
            rows.end()
    elif index == 1:
        for c in archive.clusters:
            rows.record([f for f in CLUSTER if f[0] < 216], "CLUS: cluster %d (4.1)" % c.index)
            for t in range(c.top_count):
                rows.record(TOP, "CLUS: cluster %d, top %d" % (c.index, t))
            unused = "unused tops, zero_2" if c.top_count < 4 else "zero_2"
            rows.zeros(s.off + 320 * (c.index + 1), unused)
    elif index == 2:
        for b in archive.blocks:
            rows.record(BLOCK, "BLKS: block %d (4.2)" % b.index)
    else:
        rows.title(s.tag.decode("ascii", "replace"))
        if s.bytes:
            rows.add(s.bytes, "text" if index == 3 else "unknown")
            rows.end()


def print_raw(archive, rows, b):
    start = rows.at
    places, size = layout(archive, b)
    for name, (at, length) in places.items():
        rows.zeros(start + at)
        if name == "nodes":
            for i in range(b.node_count):
                rows.record(NODE, "block %d: node %d (6.2)" % (b.index, i))
            continue
        rows.title("block %d: %s (6.3)" % (b.index, name))
        step, kind, count = element(b, name)
        while rows.at < start + at + length:
            value = read_field(rows.data, rows.at, kind, count)
            text = group_text(value) if name == "groups" else words(
                value if count > 1 else (value,))
            rows.add(step, text)
            rows.end()
    rows.zeros(start + size)


def print_planes(archive, rows, b):
    rows.record(PRELUDE, "block %d: prelude (6.4)" % b.index)
    rows.title("block %d: table of planes" % b.index)
    names = ["%s, byte %d" % (name, k) if width > 1 else name
             for name, width in column_names(archive, b) for k in range(width)]
    sizes = []
    for name in names:
        entry = read_field(rows.data, rows.at, "u32", 1)
        sizes.append(entry & (1 << 30) - 1)
        rows.add(4, "%s: mode %d, bytes %d" % (name, entry >> 30, sizes[-1]))
        rows.end()
    rows.title("block %d: planes" % b.index)
    for name, size in zip(names, sizes):
        if size:
            rows.add(size, name)
            rows.end()


# --- the columns of zstd blocks ---

class Columns:
    """The columns of a block as lines: name, values, what they tell."""

    def __init__(self, archive, b, out):
        self.archive, self.b, self.out = archive, b, out
        self.columns = iter(zip(column_names(archive, b), b.columns))
        self.nodes = b.canonical

    def next(self, tell):
        """tell: of the values, a text."""
        (name, _), values = next(self.columns)
        shown = words(values) or "-"
        for i, text in enumerate(tell(values).split("\n")):
            put(self.out, "%-14s %-16s %s" % ("" if i else name, "" if i else shown, text), 32)

    def all(self):
        if self.b.kind == INNER:
            self.inner()
        else:
            self.leaves()
        self.next(lambda values: "of the normal clusters: over 32767, %s"
                  % " ".join("%.6f" % (g.cosine / 32767) for g in self.b.groups))

    def inner(self):
        p, nodes = self.b.prelude, self.nodes
        self.next(lambda values: "\n".join(map(self.kid, values)))
        self.next(lambda values: "sizes of families without a parent here; 0: with one")
        self.next(lambda values: "ranks; normal clusters %s" % words(
            [self.group(i) for i in self.firsts()]))
        self.next(lambda values: "<< e_shift %d: e_parent %s" % (p.e_shift, " ".join(
            "0x%04x" % (v << p.e_shift & 0xFFFF) for v in values)))
        orphans = [nodes[f.first:f.first + f.size] for f in self.b.families
                   if f.parent is None]
        self.next(lambda values: "\n".join(map(self.link, values, orphans)))
        self.node_columns(nodes)

    def kid(self, value):
        count, inner = child_counts(value & 15)
        if not count:
            return "the children are another cluster"
        place = ("here" if value >> 4 else "in another block") if inner else "none inner"
        return "nibble %d: %d children, %s" % (
            value & 15, count, "%d of them inner, %s" % (inner, place) if inner else place)

    def firsts(self):
        """The first node of each family."""
        at = 0
        for size in self.b.told:
            yield at
            at += size

    def group(self, number):
        return self.b.groups.index(self.nodes[number].group)

    def leaves(self):
        b, shift = self.b, self.b.prelude.e_shift
        families = [self.nodes[i:i + size] for i, size in zip(self.firsts(), b.told)]
        self.next(lambda values: "leaves of each family")
        self.next(lambda values: "ranks; normal clusters %s" % words(
            [self.group(i) for i in self.firsts()]))
        self.next(lambda values: "\n".join(
            "+ ((0x%04x + %d) >> %d), << %d: e_parent 0x%04x" % (
                max(n.e_self for n in family), (1 << shift) - 1, shift, shift,
                family[0].e_parent) for family in families))
        self.next(lambda values: "\n".join(map(self.link, values, families)))
        if b.has_triangles:
            self.triangles()
        else:
            self.node_columns(self.nodes)

    def link(self, value, family):
        radius = max(n.R for n in family)
        return "+ %d (R = %s), modulo 256: link %d, L = %s" % (
            link_code(radius, self.b.link_base), real32(radius), family[0].link,
            real32(family[0].L))

    def triangles(self):
        self.next(lambda values: "0: loose")
        self.next(lambda values: "0: a new vertex")
        self.next(lambda values: "three a loose triangle")
        self.next(lambda values: "none" if not values else "vertices")
        for axis in "xyz":
            self.next(lambda values: "u: " + words(map(unzigzag, values)))
        self.colors(self.b.vertex_rgba)

    def node_columns(self, nodes):
        b, p = self.b, self.b.prelude
        coarse = p.position_bits + b.step_exp - self.archive.header.unit_exp
        shifts = words(min(max((n.radius >> 8) - 127 - coarse, 0), 15) for n in nodes)
        for axis in "xyz":
            self.next(lambda values: "u: %s, s: %s, %s: %s" % (
                words(map(unzigzag, values)), shifts, axis, words(getattr(n, axis)
                                                                  for n in nodes)))
        for k in range(2):
            self.next(lambda values: "u: %s, from 127: %s" % (
                words(map(unzigzag, values)), words(n.normal[k] for n in nodes)))
        self.next(lambda values: "u: %s, subtracted, << radius_shift %d: %s" % (
            words(map(unzigzag, values)), p.radius_shift,
            " ".join("0x%04x" % n.radius for n in nodes)))
        told = "<< e_shift %d, from e_parent" % p.e_shift
        if b.kind != INNER:
            told = "u, from the leaf before"
        self.next(lambda values: "%s: %s" % (told, " ".join(
            "0x%04x" % n.e_self for n in nodes)))
        self.next(lambda values: "<< height_shift %d, low bits 1: %s" % (
            p.height_shift, words(n.height for n in nodes)))
        self.colors([n.rgba for n in nodes])

    def colors(self, rgba):
        if self.archive.flag(COLORS):
            for k in range(4):
                self.next(lambda values: "u: %s; %s" % (
                    words(map(unzigzag, values)), words(c[k] for c in rgba)))


def put(out, line, indent=8):
    """A line of a code block; what is too long goes on in the next, indented."""
    while len(line) > WIDTH:
        at = line.rfind(" ", indent + 1, WIDTH + 1)
        if at < 0:
            break
        out("    " + line[:at].rstrip())
        line = " " * indent + line[at + 1:]
    out("    " + line.rstrip())


# --- triangles (6.4.3) and leaves (6.5) ---

def print_triangles(b, out):
    edges, pushed = b.mesh.edges.items, 0
    met = 0                                     # vertices seen
    for i, (node, code) in enumerate(zip(b.canonical, b.columns[4])):
        count = 3 if code == 0 else 2
        now, pushed = edges[pushed:pushed + count], pushed + count
        if code == 0:
            text = "loose"
        else:
            back = code if code <= 127 else code - 127
            start, end, opposite = edges[pushed - count - back]
            text = "edge seen %d pushes ago, %d %d opposite %d, walked %s" % (
                back, start, end, opposite, "as it is" if code <= 127 else "back")
        put(out, "triangle %d: %s; corners %s" % (i, text, words(node.corners)))
        put(out, "    pushes the edges " + ", ".join("%d %d opposite %d" % e for e in now))
        for v in node.corners:
            if v == met:
                print_vertex(b, v, out)
                met += 1


def print_vertex(b, v, out):
    p, q, o = b.mesh.new[v]
    told = [unzigzag(column[v]) for column in b.columns[8:11]]
    if v == 0:
        model = "from 0"
    elif p == q == o:
        model = "from vertex %d" % o
    else:
        model = "from %d + %d - %d" % (p, q, o)
    put(out, "    vertex %d: %s by (%s): offsets %s; %s in file units" % (
        v, model, words(told), words(b.offsets[v]), " ".join(map(real64, b.vertices[v]))))


def numbers(values):
    return "(%s)" % ", ".join(map(real64, values))


def print_leaf(archive, b, i, out):
    """The seven steps of section 6.5 for leaf i."""
    s = Steps(archive, b, [b.lattice[c] for c in b.canonical[i].corners])
    put(out, "leaf %d" % i)
    put(out, "1  A = %s, B = %s, C = %s" % tuple(map(numbers, s.corners)))
    m = max(s.squares)
    acute = m < sum(s.squares) - m
    put(out, "2  s0 = %d, s1 = %d, s2 = %d, m = %d: %s" % (
        *s.squares, m, "acute" if acute else "not acute"))
    put(out, "3  f = %s, g = %s" % (real64(s.f), real64(s.g)))
    put(out, "4  k = %s, S = %d: x y z = %s, P = %s" % (
        numbers(s.k), s.step, words(s.xyz), numbers(s.p)))
    put(out, "5  F = %s, sqrt(m) = %s" % (real64(s.reach), real64(math.sqrt(m))))
    radius = length_text(s.radius)
    put(out, "   radius %s, t %s, e_self 0x%04x" % (radius, length_text(s.t), s.e_self))
    put(out, "6  n = %s: normal %s" % (numbers(s.n), words(s.normal)))
    put(out, "7  (X, Y, Z) = %s, q = %s, H' = %s" % (
        numbers(s.vector), real64(s.q), real64(s.wanted)))
    put(out, "   height %d" % s.height)


# --- all ---

def print_nodes(archive, out):
    for cluster in archive.clusters:
        for node in cluster.order:
            parent = "the root" if node.parent is None else (
                "child of node %d of cluster %d" % (node.parent.number,
                                                    node.parent.cluster.index))
            put(out, "cluster %d, node %d: %s, block %d, %s" % (
                cluster.index, node.number, "inner" if node.kind == INNER else "leaf",
                node.block.index, parent))
            put(out, "    center %s; e_self = %s, R = %s, H = %s, L = %s" % (
                " ".join(map(real64, node.center)), real32(length_value(node.e_self)),
                real32(node.R), real32(node.H), real32(node.L)))


def example(archive, path, out):
    name = os.path.basename(path)
    out("## 12. Worked example")
    out("")
    out("All of `conformance/good/%s`, as `tests/second/spc_second.py example` prints it."
        % name)
    out("A row is an offset, up to eight bytes, both hexadecimal, and the fields that begin there,")
    out("in their order; `00 x 58` is 58 bytes 0.")
    out("")
    print_bytes(archive, out)
    for b in archive.blocks:
        if b.codec == RAW:
            continue
        out("")
        out("The columns of block %d, %s, put together from their planes: name, values, what they"
            % (b.index, "inner nodes" if b.kind == INNER else "leaves"))
        out("tell (u as in section 6.4).")
        out("")
        Columns(archive, b, out).all()
        if b.has_triangles:
            out("")
            out("So its triangles and vertices are, by section 6.4.3:")
            out("")
            print_triangles(b, out)
            out("")
            out("And its leaves, by the steps of section 6.5, f64 with as many digits as tell them")
            out("apart:")
            out("")
            for i in range(b.node_count):
                print_leaf(archive, b, i, out)
    out("")
    out("The nodes in canonical order, centers in file units, other lengths in units of 2^%d:"
        % archive.header.unit_exp)
    out("")
    print_nodes(archive, out)
