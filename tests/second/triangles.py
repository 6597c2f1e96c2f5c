"""Codec zstd: triangles told by edges and corners (section 6.4.3)."""
from codes import add_color, need, unzigzag
from leaf import derive_leaf
from records import COLORS

RING = 256


class Ring:
    """The last 256 things pushed; back(1) is the last."""

    def __init__(self):
        self.items = []

    def push(self, item):
        self.items.append(item)

    def back(self, count, what):
        need(1 <= count <= min(RING, len(self.items)), "%s: nothing pushed so far back" % what)
        return self.items[-count]


class Mesh:
    """The state of 6.4.3. new[v] = (p, q, o), the models of vertex v."""

    def __init__(self, b, cursor):
        self.what = cursor.what
        self.limit = b.vertex_count
        self.edges, self.corners, self.new = Ring(), Ring(), []
        self.explicit = iter(())

    def corner(self, code, model):
        """The vertex that a corner code tells; model is for a new one."""
        if code == 0:
            vertex = len(self.new)
            need(vertex < self.limit, "%s: too many new vertices" % self.what)
            self.new.append(model or (vertex - 1, vertex - 1, vertex - 1))
        elif code == 255:
            vertex = next(self.explicit)
            need(vertex < len(self.new), "%s: an explicit vertex not seen" % self.what)
        else:
            vertex = self.corners.back(code, self.what)
        self.corners.push(vertex)
        return vertex

    def loose(self, codes):
        a, b, c = [self.corner(code, None) for code in codes]
        self.edges.push((b, a, c))
        return a, b, c

    def joined(self, code, third):
        back = code if code <= 127 else code - 127
        start, end, opposite = self.edges.back(back, self.what)
        a, b = (start, end) if code <= 127 else (end, start)
        return a, b, self.corner(third, (a, b, opposite))

    def triangle(self, corners):
        a, b, c = corners
        self.edges.push((c, b, a))
        self.edges.push((a, c, b))


def read_triangles(archive, b, cursor, nodes):
    n = b.node_count
    edges = cursor.column(n, 1)
    need(255 not in edges, "%s: edge" % cursor.what)
    loose_count = edges.count(0)
    thirds = cursor.column(n - loose_count, 1)
    looses = cursor.column(3 * loose_count, 1)
    explicit = cursor.column(thirds.count(255) + looses.count(255), 2)
    mesh = b.mesh = Mesh(b, cursor)
    mesh.explicit = iter(explicit)
    third, loose = iter(thirds), iter(looses)
    for node, edge in zip(nodes, edges):
        if edge == 0:
            node.corners = mesh.loose([next(loose) for _ in range(3)])
        else:
            node.corners = mesh.joined(edge, next(third))
        mesh.triangle(node.corners)
    need(len(mesh.new) == b.vertex_count, "%s: vertices are left over" % cursor.what)
    read_vertices(archive, b, cursor, mesh)
    for node in nodes:
        derive_node(archive, b, node)


def read_vertices(archive, b, cursor, mesh):
    v, width = b.vertex_count, b.vertex_width
    mask = (1 << 8 * width) - 1
    columns = [cursor.column(v, width) for _ in range(3)]
    colors = None
    if archive.flag(COLORS):
        colors = [cursor.column(v, 1) for _ in range(4)]
    b.offsets, b.vertex_rgba = [], []
    for i, (p, q, o) in enumerate(mesh.new):
        told = [unzigzag(c[i]) for c in columns]
        model, rgba = (0, 0, 0), b"\xff\xff\xff\xff"
        if i:
            x = b.offsets
            model = [x[p][k] + x[q][k] - x[o][k] for k in range(3)]
            rgba = bytes((m + k) // 2 for m, k in zip(b.vertex_rgba[p], b.vertex_rgba[q]))
        b.offsets.append(tuple((m + t) & mask for m, t in zip(model, told)))
        if colors:
            rgba = add_color(rgba, [c[i] for c in colors])
        b.vertex_rgba.append(rgba)


def derive_node(archive, b, node):
    """Section 6.5: the record and the colour of a leaf follow from its corners."""
    points = [tuple(base + o for base, o in zip(b.vertex_base, b.offsets[c]))
              for c in node.corners]
    (node.x, node.y, node.z, node.normal, node.radius, node.e_self,
     node.height) = derive_leaf(archive, b, points)
    if archive.flag(COLORS):
        node.rgba = mean_color([b.vertex_rgba[c] for c in node.corners])


def mean_color(corners):
    return bytes((x + y + z + 1) // 3 for x, y, z in zip(*corners))
