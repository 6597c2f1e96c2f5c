"""The tables of the specification, and how a record is read from bytes.

A field is (offset, type, count, name). The same tables serve the reader, the
dump and the annotated hexdump, so that they cannot disagree.
"""
import math
import struct

from codes import need

SIZES = {"u8": 1, "i8": 1, "u16": 2, "u32": 4, "u64": 8, "i16": 2, "i32": 4, "i64": 8,
         "f32": 4, "f64": 8, "x": 1}
LETTERS = {"u8": "B", "i8": "b", "u16": "H", "u32": "I", "u64": "Q", "i16": "h", "i32": "i",
           "i64": "q", "f32": "f", "f64": "d", "x": "B"}

MAGIC = bytes([0x89, 0x53, 0x50, 0x43, 0x0D, 0x0A, 0x1A, 0x0A])
VERSION = 0xFFFF
NO_CLUSTER = 0xFFFFFFFF
TRIANGLES, COLORS, CULL_BACK, ERROR_PAPER = 1, 2, 4, 8
RAW, ZSTD = 0, 1
INNER, LEAF = 0, 1
TAGS = (b"AXES", b"CLUS", b"BLKS", b"META")
RECORD_BYTES = (6, 320, 64, 1)

# type x: bytes that must be 0
HEADER = [                                              # section 2
    (0, "u8", 8, "magic"), (8, "u16", 1, "version"), (10, "u16", 1, "bytes"),
    (12, "u32", 1, "reserved_bits"), (16, "u32", 1, "spare_bits"),
    (20, "u32", 1, "flags"), (24, "u8", 16, "id"), (40, "u64", 1, "file_bytes"),
    (48, "u64", 1, "head_bytes"), (56, "u64", 1, "node_count"),
    (64, "u64", 1, "leaf_count"), (72, "u64", 1, "triangle_count"),
    (80, "u64", 1, "vertex_count"), (88, "u32", 1, "cluster_count"),
    (92, "u32", 1, "block_count"), (96, "u32", 1, "cluster_nodes"),
    (100, "u32", 1, "block_nodes"), (104, "u32", 1, "normal_clusters"),
    (108, "u32", 1, "height"), (112, "i32", 1, "unit_exp"),
    (116, "i32", 1, "vertex_exp"), (120, "f64", 6, "box"),
    (168, "u64", 1, "faces_in"), (176, "u64", 1, "split_extra"),
    (184, "u64", 1, "points_in"), (192, "u64", 1, "dropped_bad_index"),
    (200, "u64", 1, "dropped_non_finite"), (208, "u64", 1, "dropped_degenerate"),
    (216, "f32", 1, "e_min"), (220, "f32", 1, "e_max"),
    (480, "x", 24, "zero"), (504, "u64", 1, "hash"),
]
SECTION = [                                             # section 3
    (0, "u8", 4, "tag"), (4, "u32", 1, "record_bytes"), (8, "u64", 1, "off"),
    (16, "u64", 1, "bytes"), (24, "u64", 1, "hash"),
]
AXIS = [(0, "i16", 3, "axis")]
CLUSTER = [                                             # section 4.1
    (0, "u32", 1, "parent"), (4, "u32", 1, "child_first"),
    (8, "u32", 1, "child_count"), (12, "u16", 1, "level"), (14, "u8", 1, "top_count"),
    (15, "u8", 1, "top_leaf_bits"), (16, "u32", 1, "inner_count"),
    (20, "u32", 1, "leaf_count"), (24, "u32", 1, "block_first"),
    (28, "u32", 1, "block_count"), (32, "u64", 1, "data_off"),
    (40, "u64", 1, "data_bytes"), (48, "u64", 1, "leaves_below"),
    (56, "f64", 3, "origin"), (80, "f32", 6, "box"), (104, "f32", 6, "sub_box"),
    (128, "f32", 4, "sphere"), (144, "f32", 4, "sub_sphere"),
    (160, "f32", 1, "e_self_min"), (164, "f32", 1, "e_self_max"),
    (168, "f32", 1, "e_parent_min"), (172, "f32", 1, "e_parent_max"),
    (176, "f32", 1, "radius_min"), (180, "f32", 1, "radius_max"),
    (184, "f32", 1, "sub_radius_max"), (188, "f32", 1, "link_max"),
    (192, "f32", 1, "sub_link_max"), (196, "x", 4, "zero_1"), (200, "f32", 4, "cone"),
    (312, "x", 8, "zero_2"),
]
NODE = [                                                # section 6.2
    (0, "u16", 1, "x"), (2, "u16", 1, "y"), (4, "u16", 1, "z"), (6, "u8", 2, "normal"),
    (8, "u16", 1, "e_self"), (10, "u16", 1, "e_parent"), (12, "u16", 1, "radius"),
    (14, "u8", 1, "height"), (15, "u8", 1, "link"),
]
TOP = NODE + [                                          # section 4.1
    (16, "u8", 4, "rgba"), (20, "i16", 1, "step_exp"), (22, "i16", 1, "link_base"),
]
BLOCK = [                                               # section 4.2
    (0, "u64", 1, "off"), (8, "u32", 1, "stored_bytes"), (12, "f32", 1, "diagonal"),
    (16, "u32", 1, "node_count"), (20, "u32", 1, "vertex_count"),
    (24, "u32", 1, "cluster"), (28, "u8", 1, "kind"), (29, "u8", 1, "codec"),
    (30, "u8", 1, "vertex_width"), (31, "x", 1, "zero"), (32, "f32", 1, "e_parent_max"),
    (36, "f32", 1, "e_parent_min"), (40, "f32", 1, "e_self_min"),
    (44, "f32", 1, "link_max"), (48, "f32", 1, "radius_max"), (52, "i16", 1, "step_exp"),
    (54, "i16", 1, "link_base"), (56, "u64", 1, "hash"),
]
CHUNK = [                                               # section 6.1
    (0, "u8", 4, "magic"), (4, "i16", 1, "unit_exp"), (6, "i16", 1, "vertex_exp"),
    (8, "u64", 1, "hash"), (16, "u8", 1, "kind"), (17, "u8", 1, "codec"),
    (18, "u8", 1, "vertex_width"), (19, "u8", 1, "flags"), (20, "u32", 1, "node_count"),
    (24, "u32", 1, "vertex_count"), (28, "u32", 1, "stored_bytes"),
    (32, "f32", 1, "diagonal"), (36, "i16", 1, "step_exp"), (38, "i8", 1, "link_base"),
    (39, "u8", 1, "normal_clusters"), (40, "f64", 3, "origin"),
]
PRELUDE = [                                             # section 6.4
    (0, "u32", 1, "family_count"), (4, "u8", 1, "e_shift"), (5, "u8", 1, "radius_shift"),
    (6, "u8", 1, "height_shift"), (7, "u8", 1, "position_bits"),
    (8, "i64", 3, "vertex_base"),
]
GROUP = [(0, "u16", 1, "count"), (2, "i16", 1, "cosine")]   # section 6.3


class Node:
    """A node of a payload; the values of section 5 are set by decode_values."""

    def __init__(self, record=None):
        for _, _, _, name in NODE:
            setattr(self, name, getattr(record, name) if record else 0)
        self.rgba = b"\xff\xff\xff\xff"
        self.nibble = 0             # inner nodes: of `children`
        self.corners = None         # leaves with triangles: three vertex numbers

    def record(self):
        return tuple(getattr(self, name) for _, _, _, name in NODE)


class Record:
    """The fields of one record, as attributes."""


def read_field(data, at, kind, count):
    values = struct.unpack_from("<%d%s" % (count, LETTERS[kind]), data, at)
    if kind in ("u8", "x") and count > 1:
        return bytes(values)
    return values[0] if count == 1 else values


def read_record(data, at, table):
    """Reads without judging; check_record judges."""
    record = Record()
    for offset, kind, count, name in table:
        setattr(record, name, read_field(data, at + offset, kind, count))
    return record


def check_record(record, table, what):
    """Section 1: zero fields are 0, NaN never occurs."""
    for _, kind, count, name in table:
        value = getattr(record, name)
        if kind == "x":
            need(not any(value) if count > 1 else value == 0, "%s: %s is not 0" % (what, name))
        if kind in ("f32", "f64"):
            for v in (value if count > 1 else (value,)):
                need(not math.isnan(v), "%s: %s is no number" % (what, name))


def unpack_array(data, at, count, kind):
    return struct.unpack_from("<%d%s" % (count, LETTERS[kind]), data, at)
