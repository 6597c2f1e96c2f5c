"""The parent relation (section 7): every cluster's nodes in canonical order,
with their parents, told from child counts alone."""
from codes import dot, need, normal_vector, ROOT_MARK
from records import INNER, LEAF, NODE


class Places:
    """Where the next family goes: a free place for each block and normal cluster."""

    def __init__(self, archive, cluster):
        self.axes = archive.axes
        self.what = "cluster %d" % cluster.index
        self.blocks = cluster.blocks
        for b in self.blocks:
            b.emitted = []          # sizes of the families
            b.free, at = [], 0
            for g in b.groups:
                b.free.append(at)
                at += g.count
            b.smallest = min(node.e_parent for node in b.nodes)
            b.smallest_left = sum(1 for node in b.nodes if node.e_parent == b.smallest)

    def block(self, kind, e):
        for b in self.blocks:
            if b.kind == kind:
                if b.smallest < e or (b.smallest == e and b.smallest_left > 0):
                    return b
        need(False, "%s: no block for a family" % self.what)

    def take(self, kind, size, e, vector, above=None):
        """The nodes of the family of e_parent e below a node of that normal, in the
        block above."""
        b = self.block(kind, e)
        group = self.nearest(vector)
        first = b.free[group]
        last = sum(g.count for g in b.groups[:group + 1])
        need(first + size <= last, "%s: a family does not fit" % self.what)
        b.free[group] += size
        b.emitted.append(size)
        if e == b.smallest:
            b.smallest_left -= size
        nodes = b.nodes[first:first + size]
        for node in nodes:
            need(node.e_parent == e, "%s: e_parent is not the parent's e_self" % self.what)
        if b is not above:
            need(len({node.link for node in nodes}) == 1,
                 "%s: links of a family that is told alone" % self.what)
        return nodes

    def nearest(self, vector):
        best, most = 0, None
        for i, axis in enumerate(self.axes):
            d = dot(axis, vector)
            if most is None or d > most:
                best, most = i, d
        return best

    def end(self):
        for b in self.blocks:
            at = 0
            for g, free in zip(b.groups, b.free):
                at += g.count
                need(free == at, "%s: nodes without a parent" % self.what)


def child_counts(nibble):
    """Children, and how many of them are inner; 0 children: an owner."""
    for base, count in ((8, 4), (4, 3), (1, 2)):
        if nibble >= base:
            need(nibble - base <= count, "children of a node")
            return count, nibble - base
    return 0, 0


def replay(archive):
    """Sets of every cluster: order, owners; of every node: number, parent, depth."""
    for cluster in archive.clusters:
        replay_cluster(archive, cluster)
    height = max(node.depth for c in archive.clusters for node in c.order)
    need(height == archive.header.height, "height")


def replay_cluster(archive, cluster):
    places = Places(archive, cluster)
    cluster.order = []
    tops = emit_tops(cluster, places)
    visit(cluster, places, tops)
    places.end()
    check_block_order(cluster)
    owners = [n for n in cluster.order if n.kind == INNER and n.nibble == 0]
    need(len(owners) == cluster.child_count, "cluster %d: owners" % cluster.index)
    for i, owner in enumerate(owners):
        archive.clusters[cluster.child_first + i].owner = owner


def emit(cluster, nodes, parent):
    for node in nodes:
        node.cluster = cluster
        node.number = len(cluster.order)
        node.parent = parent
        node.depth = parent.depth + 1 if parent else 1
        node.children = []
        cluster.order.append(node)
        if parent:
            parent.children.append(node)


def emit_tops(cluster, places):
    owner = cluster.owner if cluster.index else None
    e = owner.e_self if owner else ROOT_MARK
    vector = normal_vector(*cluster.tops[0].normal)
    nodes = []
    for kind in (INNER, LEAF):
        size = sum(1 for top in cluster.tops if top.kind == kind)
        if size:
            family = places.take(kind, size, e, vector)
            emit(cluster, family, owner)
            nodes += family
    for top, node in zip(cluster.tops, nodes):
        check_top(cluster, top, node)
    return [node for node in nodes if node.kind == INNER]


def check_top(cluster, top, node):
    """Section 4.1: a top is a copy of its node."""
    what = "cluster %d: a top is no copy of its node" % cluster.index
    need(tuple(getattr(top, name) for _, _, _, name in NODE) == node.record(), what)
    need(top.rgba == node.rgba, what)
    need((top.step_exp, top.link_base) == (node.block.step_exp, node.block.link_base), what)


def visit(cluster, places, tops):
    """Depth first, with a stack of its own: trees may be thousands of levels high."""
    stack = list(reversed(tops))
    while stack:
        node = stack.pop()
        if node.nibble == 0:        # an owner: its children are in another cluster
            continue
        count, inner = child_counts(node.nibble)
        family = []
        if inner:
            family = places.take(INNER, inner, node.e_self, node.vector, node.block)
            emit(cluster, family, node)
        if count > inner:
            emit(cluster, places.take(LEAF, count - inner, node.e_self, node.vector), node)
        stack += reversed(family)


def check_block_order(cluster):
    """The order that codec zstd tells is the one that section 7 tells; raw
    blocks learn it here."""
    told = {b.index: [] for b in cluster.blocks}
    for node in cluster.order:
        told[node.block.index].append(node)
    for b in cluster.blocks:
        order = told[b.index]
        if b.canonical is not None:
            need(all(a is c for a, c in zip(order, b.canonical)),
                 "block %d: canonical order" % b.index)
            need(b.emitted == b.told, "block %d: families" % b.index)
            check_joined(b)
        b.canonical = order


def check_joined(b):
    """Section 6.4.1: kids has bit 4 where the inner children lie in the block."""
    for node in b.canonical:
        if node.kind == INNER:
            here = any(child.kind == INNER and child.block is b and child.cluster is node.cluster
                       for child in node.children)
            need(here == node.joined, "block %d: kids" % b.index)
