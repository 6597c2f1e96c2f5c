"""Header, sections and directory (sections 2, 3, 4 and 10), checked in the
order that section 2 gives a reader."""
import math

from codes import Bad, length_valid, need, ROOT_MARK, xxh64
from records import (AXIS, BLOCK, check_record, CLUSTER, COLORS, HEADER, INNER, LEAF,
                     MAGIC, NO_CLUSTER, read_record, RECORD_BYTES, SECTION, TAGS, TOP,
                     TRIANGLES, VERSION, ZSTD)


class Archive:
    """Everything read so far. data: the whole file."""

    def __init__(self, data):
        self.data = data
        self.header = None
        self.sections = []
        self.axes = []
        self.clusters = []
        self.blocks = []
        self.meta = b""

    def flag(self, bit):
        return bool(self.header.flags & bit)


def align(value, step):
    return -(-value // step) * step


def read_head(data):
    archive = Archive(data)
    read_header(archive)
    read_sections(archive)
    archive.axes = [r.axis for r in section_records(archive, 0, AXIS)]
    for axis in archive.axes:
        need(abs(math.hypot(*axis) / 32767 - 1) <= 0.001, "length of an axis")
    archive.clusters = section_records(archive, 1, CLUSTER)
    archive.blocks = section_records(archive, 2, BLOCK)
    meta = archive.sections[3]
    archive.meta = data[meta.off:meta.off + meta.bytes]
    check_blocks(archive)
    check_clusters(archive)
    return archive


# --- section 2 ---

def read_header(archive):
    data = archive.data
    need(data and data[:8] == MAGIC[:len(data)], "no magic number", "NOT_SPC")
    need(len(data) >= 512, "the header is cut", "TRUNCATED")
    h = archive.header = read_record(data, 0, HEADER)
    archive.sections = [read_record(data, 224 + 32 * i, SECTION) for i in range(8)]
    need(h.version == VERSION, "version %d" % h.version, "VERSION")
    need(xxh64(data[:504]) == h.hash, "hash of the header", "CHECKSUM")
    need(h.reserved_bits == 0, "reserved bits are set", "FEATURE")
    need(h.flags & ~15 == 0, "unknown flags", "FEATURE")
    need(h.file_bytes <= len(data), "the file is cut", "TRUNCATED")
    need(h.file_bytes >= len(data), "bytes behind the archive")
    check_limits(archive)
    check_record(h, HEADER, "header")
    check_counts(archive)


def check_limits(archive):
    """Section 10, as far as the header goes."""
    h = archive.header
    limits = ((h.cluster_count, 1 << 24, "clusters"), (h.block_count, 1 << 26, "blocks"),
              (h.block_nodes, 65535, "nodes a block"),
              (h.cluster_nodes, 1 << 24, "nodes a cluster"),
              (h.normal_clusters, 128, "normal clusters"), (h.height, 65535, "height"),
              (archive.sections[3].bytes, 64 << 20, "metadata"))
    for value, limit, what in limits:
        need(value <= limit, "too many: %s" % what, "LIMIT")
    for value, what in ((h.unit_exp, "unit"), (h.vertex_exp, "lattice")):
        need(-1100 <= value <= 1023, "exponent of the %s" % what, "LIMIT")
    need(-80 <= h.vertex_exp - h.unit_exp <= 80, "exponents of unit and lattice", "LIMIT")


def check_counts(archive):
    h = archive.header
    need(h.bytes == 512, "size of the header")
    need(h.cluster_count >= 1 and h.block_count >= 1, "no cluster or no block")
    need(h.cluster_nodes >= 1 and h.block_nodes >= 1, "no node in a cluster or block")
    need(1 <= h.normal_clusters, "no normal cluster")
    need(1 <= h.leaf_count <= h.node_count and h.height >= 1, "no leaf or no node")
    need(h.triangle_count == (h.leaf_count if archive.flag(TRIANGLES) else 0),
         "triangle_count")
    need(archive.flag(TRIANGLES) or h.vertex_count == 0, "vertices without triangles")
    dropped = h.dropped_bad_index + h.dropped_non_finite + h.dropped_degenerate
    need(h.faces_in + h.split_extra + h.points_in == h.leaf_count + dropped,
         "faces do not add up to leaves")
    need(all(map(math.isfinite, h.box)), "the box is not finite")
    need(all(h.box[i] <= h.box[i + 3] for i in range(3)), "the box is empty")
    if h.node_count == h.leaf_count:
        need(h.e_min == 0 and h.e_max == 0, "errors without inner nodes")


# --- section 3 ---

def read_sections(archive):
    data, h = archive.data, archive.header
    counts = (h.normal_clusters, h.cluster_count, h.block_count, None)
    end, used = 512, 0
    for i, s in enumerate(archive.sections):
        if i >= 4 and not (any(s.tag) or s.record_bytes or s.off or s.bytes or s.hash):
            continue
        need(used == i, "a section behind an unused one")
        used += 1
        if i < 4:
            need(s.tag == TAGS[i] and s.record_bytes == RECORD_BYTES[i], "tag of a section")
            need(counts[i] is None or s.bytes == counts[i] * s.record_bytes,
                 "size of section %s" % s.tag.decode())
        else:
            need(any(s.tag) and s.tag not in TAGS and s.record_bytes >= 1,
                 "tag of an optional section")
            need(s.bytes % s.record_bytes == 0, "size of an optional section")
        need(s.off == align(end, 64), "place of section %d" % i)
        need(s.off + s.bytes <= len(data), "section %d leaves the file" % i)
        end = s.off + s.bytes
    archive.sections = archive.sections[:used]
    need(h.head_bytes == end, "head_bytes")
    for s in archive.sections:
        need(xxh64(data[s.off:s.off + s.bytes]) == s.hash,
             "hash of section %r" % s.tag, "CHECKSUM")
    for s in archive.sections:
        end = s.off + s.bytes
        need(not any(data[end:align(end, 64)]), "bytes behind a section")


def section_records(archive, index, table):
    s = archive.sections[index]
    return [read_record(archive.data, at, table)
            for at in range(s.off, s.off + s.bytes, s.record_bytes)]


# --- section 4.2 ---

def check_blocks(archive):
    end = align(archive.header.head_bytes, 64)
    for i, b in enumerate(archive.blocks):
        what = "block %d" % i
        b.index = i
        check_record(b, BLOCK, what)
        need(b.off == end, "%s: offset" % what)
        b.chunk_bytes = align(64 + b.stored_bytes, 64)
        end += b.chunk_bytes
        check_block_shape(archive, b, what)
        need(-1100 <= b.step_exp <= 1023 and
             -80 <= b.step_exp - archive.header.unit_exp <= 80,
             "%s: exponent of the step" % what)
        need(-126 <= b.link_base <= 96, "%s: link_base" % what)
        check_lattice(archive, b, what)
        size = layout(archive, b)[1]
        need(b.stored_bytes <= size + size // 128 + 65536, "%s: stored_bytes" % what)
    need(end == archive.header.file_bytes, "chunks do not end the file")
    need(sum(b.node_count for b in archive.blocks) == archive.header.node_count,
         "nodes of the blocks")
    need(sum(b.vertex_count for b in archive.blocks) == archive.header.vertex_count,
         "vertices of the blocks")


def check_block_shape(archive, b, what):
    need(b.node_count <= 65535 and b.vertex_count <= 65535, "%s: too large" % what)
    need(1 <= b.node_count <= archive.header.block_nodes, "%s: node_count" % what)
    need(b.kind in (INNER, LEAF), "%s: kind" % what)
    need(b.codec <= ZSTD, "%s: codec" % what, "FEATURE")
    b.has_triangles = b.kind == LEAF and archive.flag(TRIANGLES)
    if b.has_triangles:
        need(b.vertex_width in (2, 4, 8), "%s: vertex_width" % what)
        need(1 <= b.vertex_count <= 3 * b.node_count, "%s: vertex_count" % what)
    else:
        need(b.vertex_width == 0 and b.vertex_count == 0, "%s: vertices" % what)


def layout(archive, b):
    """The arrays of a payload: {name: (offset, bytes)}, and its size."""
    n, v, colors = b.node_count, b.vertex_count, archive.flag(COLORS)
    arrays = [("nodes", 16 * n)]
    if colors:
        arrays.append(("colors", 4 * n))
    arrays.append(("groups", 4 * archive.header.normal_clusters))
    if b.kind == INNER:
        arrays.append(("children", (n + 1) // 2))
    if b.has_triangles:
        arrays += [("indices", 6 * n), ("vertex_base", 24),
                   ("vertices", 3 * v * b.vertex_width)]
        if colors:
            arrays.append(("vertex_colors", 4 * v))
    places, end = {}, 0
    for name, size in arrays:
        places[name] = (align(end, 16), size)
        end = align(end, 16) + size
    return places, align(end, 16)


def check_lattice(archive, b, what):
    if b.has_triangles:
        finer = b.step_exp - archive.header.vertex_exp
        need(0 <= finer <= 36, "%s: step and lattice" % what)


# --- section 4.1 ---

def check_clusters(archive):
    clusters, h = archive.clusters, archive.header
    child, block = 1, 0
    for i, c in enumerate(clusters):
        what = "cluster %d" % i
        c.index = i
        check_record(c, CLUSTER, what)
        need(c.child_first == (child if c.child_count else 0), "%s: child_first" % what)
        child += c.child_count
        need(child <= len(clusters), "%s: child_count" % what)
        need(c.block_count >= 1 and c.block_first == block, "%s: blocks" % what)
        block += c.block_count
        need(block <= len(archive.blocks), "%s: block_count" % what)
        need(c.inner_count + c.leaf_count <= h.cluster_nodes, "%s: too many nodes" % what)
        need(all(map(math.isfinite, c.origin)), "%s: origin" % what)
        check_place(archive, c, what)
        read_tops(archive, c, what)
    need(child == len(clusters) and block == len(archive.blocks), "clusters or blocks left over")
    check_parents(archive)


def check_parents(archive):
    clusters = archive.clusters
    for c in clusters:
        for child in clusters[c.child_first:c.child_first + c.child_count]:
            need(child.parent == c.index, "cluster %d: parent" % child.index)
            need(child.level == c.level + 1, "cluster %d: level" % child.index)
    need(clusters[0].parent == NO_CLUSTER and clusters[0].level == 0, "cluster 0: parent")
    for c in reversed(clusters):
        children = clusters[c.child_first:c.child_first + c.child_count]
        need(c.leaves_below == c.leaf_count + sum(d.leaves_below for d in children),
             "cluster %d: leaves_below" % c.index)
    need(clusters[0].leaves_below == archive.header.leaf_count, "leaves of the tree")


def check_place(archive, c, what):
    """Blocks of a cluster: one range of the file, in prefix order (4.2)."""
    blocks = archive.blocks[c.block_first:c.block_first + c.block_count]
    c.blocks = blocks
    need(c.data_off == blocks[0].off, "%s: data_off" % what)
    need(c.data_bytes == sum(b.chunk_bytes for b in blocks), "%s: data_bytes" % what)
    for b in blocks:
        need(b.cluster == c.index, "block %d: cluster" % b.index)
    counts = [sum(b.node_count for b in blocks if b.kind == k) for k in (INNER, LEAF)]
    need(counts == [c.inner_count, c.leaf_count], "%s: node counts" % what)
    for one, two in zip(blocks, blocks[1:]):
        need(two.e_parent_max <= one.e_parent_max, "block %d: prefix order" % two.index)
    for kind in (INNER, LEAF):
        same = [b for b in blocks if b.kind == kind]
        for one, two in zip(same, same[1:]):
            need(two.e_parent_max <= one.e_parent_min, "block %d: prefix order" % two.index)


def read_tops(archive, c, what):
    at = archive.sections[1].off + 320 * c.index + 216
    count = c.top_count
    if c.index == 0:
        need(count == 1, "%s: top_count" % what)
    else:
        need(2 <= count <= 4, "%s: top_count" % what)
    need(c.top_leaf_bits < 1 << count, "%s: top_leaf_bits" % what)
    kinds = [c.top_leaf_bits >> t & 1 for t in range(count)]
    need(kinds == sorted(kinds), "%s: a leaf top before an inner one" % what)
    need(not any(archive.data[at + 24 * count:at + 96]), "%s: unused tops" % what)
    c.tops = [read_record(archive.data, at + 24 * t, TOP) for t in range(count)]
    for top, kind in zip(c.tops, kinds):
        top.kind = kind
        check_node_codes(top, c.index == 0, what + ": top")
        if not archive.flag(COLORS):
            need(top.rgba == b"\xff\xff\xff\xff", "%s: colour of a top" % what)


# --- section 6.2 ---

def check_node_codes(node, may_be_root, what):
    """Every code is a valid one; e_parent is at least e_self (promise 4 of
    section 8 for leaves, saturation for inner nodes)."""
    need(max(node.normal) <= 254, "%s: normal code" % what)
    need(length_valid(node.e_self) and length_valid(node.radius), "%s: length code" % what)
    if node.e_parent == ROOT_MARK:
        need(may_be_root, "%s: mark of the root" % what)
    else:
        need(length_valid(node.e_parent), "%s: length code" % what)
    need(node.e_self <= node.e_parent, "%s: e_self above e_parent" % what)


def open_archive(path):
    try:
        with open(path, "rb") as file:
            data = file.read()
    except OSError as error:
        raise Bad("IO", str(error))
    return read_head(data)
