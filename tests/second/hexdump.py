"""Annotated hexdump of a small archive: offset, bytes, field, value. Every byte
of the file appears once; the bytes of a plane's frame are not explained."""
from head import layout
from dump import escape, text_of
from records import (BLOCK, CHUNK, CLUSTER, COLORS, HEADER, INNER, NODE,
                     PRELUDE, RAW, read_field, SECTION, SIZES, TOP)

ROW = 16


class Printer:
    def __init__(self, archive, out):
        self.data, self.out, self.at = archive.data, out, 0

    def bytes(self, count, name, value=""):
        """The next bytes, the name beside the first row."""
        for i in range(0, count, ROW):
            row = self.data[self.at + i:self.at + min(i + ROW, count)].hex(" ")
            line = "%08x  %-47s  %s" % (self.at + i, row, "" if i else
                                        (name + " " + value).strip())
            self.out(line.rstrip())
        self.at += count

    def fill(self, end, name="zeros"):
        if end > self.at:
            self.bytes(end - self.at, name)

    def record(self, table, name):
        start = self.at
        self.out("# %s" % name)
        for offset, kind, count, field in table:
            self.fill(start + offset)
            if kind == "x":
                self.bytes(count, field)
                continue
            value = read_field(self.data, self.at, kind, count)
            if field in ("tag", "magic") and kind == "u8" and count == 4:
                text = escape(value)
            else:
                text = text_of(value, kind)
            self.bytes(SIZES[kind] * count, field, text)


def hexdump(archive, out):
    p = Printer(archive, out)
    p.record([f for f in HEADER if f[0] < 224], "header")
    for i in range(8):
        p.record(SECTION, "section %d" % i)
    p.record([(o - 480, *rest) for o, *rest in HEADER if o >= 480], "header, its end")
    for i, s in enumerate(archive.sections):
        p.fill(s.off)
        print_section(archive, p, i, s)
    p.fill(archive.blocks[0].off)
    for b in archive.blocks:
        p.record(CHUNK, "block %d: chunk header" % b.index)
        if b.codec == RAW:
            print_raw(archive, p, b)
        else:
            print_planes(archive, p, b)
        p.fill(b.off + b.chunk_bytes, "zeros up to a multiple of 64")


def print_section(archive, p, index, s):
    if index == 0:
        p.out("# AXES")
        for i, axis in enumerate(archive.axes):
            p.bytes(6, "axis %d:" % i, text_of(axis, "i16"))
    elif index == 1:
        for i in range(archive.header.cluster_count):
            print_cluster(p, i, s)
    elif index == 2:
        for i in range(archive.header.block_count):
            p.record(BLOCK, "BLKS: block %d" % i)
    else:
        p.out("# %s" % s.tag.decode("ascii", "replace"))
        p.bytes(s.bytes, "text" if index == 3 else "unknown")


def print_cluster(p, i, s):
    p.record([f for f in CLUSTER if f[0] < 216], "CLUS: cluster %d" % i)
    for t in range(4):
        p.record(TOP, "CLUS: cluster %d, top %d" % (i, t))
    p.fill(s.off + 320 * (i + 1), "zero_2")


# --- section 6.3 ---

def print_raw(archive, p, b):
    start = p.at
    places, size = layout(archive, b)
    for name, (at, length) in places.items():
        p.fill(start + at)
        if name == "nodes":
            for i in range(b.node_count):
                p.record(NODE, "block %d: node %d" % (b.index, i))
            continue
        p.out("# block %d: %s" % (b.index, name))
        step, kind, count = element(b, name)
        while p.at < start + at + length:
            value = read_field(p.data, p.at, kind, count)
            p.bytes(step, "", group_text(value) if name == "groups"
                    else text_of(value, kind))
    p.fill(start + size, "zeros up to a multiple of 16")


def element(b, name):
    """Bytes, type and count of one element of an array."""
    if name == "groups":
        return 4, "u16", 2
    if name == "children":
        return 1, "u8", 1
    if name == "indices":
        return 6, "u16", 3
    if name == "vertex_base":
        return 24, "i64", 3
    if name == "vertices":
        kind = {2: "u16", 4: "u32", 8: "u64"}[b.vertex_width]
        return 3 * b.vertex_width, kind, 3
    return 4, "u8", 4


def group_text(value):
    return "count %d, cosine %d" % (value[0], value[1] - (value[1] >> 15 << 16))


# --- section 6.4 ---

def column_names(archive, b):
    """Names and bytes of the columns, in their order."""
    rgba = [("r", 1), ("g", 1), ("b", 1), ("a", 1)] if archive.flag(COLORS) else []
    nodes = [("x", 2), ("y", 2), ("z", 2), ("nu", 1), ("nv", 1), ("radius", 2),
             ("e_self", 2), ("height", 1)] + rgba
    if b.kind == INNER:
        first = [("kids", 1), ("orphans", 1), ("groups", 1), ("orphan errors", 2),
                 ("orphan links", 1)]
    else:
        first = [("sizes", 1), ("groups", 1), ("errors", 2), ("links", 1)]
    if b.has_triangles:
        width = b.vertex_width
        nodes = [("edge", 1), ("third", 1), ("loose", 1), ("explicit", 2), ("x", width),
                 ("y", width), ("z", width)] + rgba
    return first + nodes + [("cosines", 2)]


def print_planes(archive, p, b):
    start = p.at
    p.record(PRELUDE, "block %d: prelude" % b.index)
    p.out("# block %d: table of planes" % b.index)
    names = ["%s, byte %d" % (name, k) if width > 1 else name
             for name, width in column_names(archive, b) for k in range(width)]
    sizes = []
    for name in names:
        entry = read_field(p.data, p.at, "u32", 1)
        sizes.append(entry & (1 << 30) - 1)
        p.bytes(4, "%s:" % name, "mode %d, %d bytes" % (entry >> 30, sizes[-1]))
    p.out("# block %d: planes" % b.index)
    for name, size in zip(names, sizes):
        p.bytes(size, name)
    p.fill(start + b.stored_bytes)
