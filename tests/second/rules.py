"""Rules between values: derived leaves, links, ranges and shapes of the
directory, the promises of section 8, the law of section 11. What the promises
bound is compared exactly, in integers (see codes.py); boxes, spheres and cones
have the room that section 4.1 leaves them."""
import math
import random

from codes import (dot, f32_above, length_value, link_code, low_bit, need, ratio_at,
                   ROOT_MARK, sub)
from planes import link_bound
from records import COLORS, ERROR_PAPER, INNER, LEAF, TRIANGLES
from triangles import mean_color
from leaf import derive_leaf, winding


def check_all(archive):
    for b in archive.blocks:
        if b.has_triangles:
            check_leaves(archive, b)
            check_vertex_order(b)
    check_promise_codes(archive)
    check_errors(archive)
    scale = choose_scale(archive)
    place_nodes(archive, scale)
    check_links(archive, scale)
    check_ranges(archive)
    for cluster in archive.clusters:
        check_shapes(archive, cluster, scale)
        axis, cosine = cluster.cone[:3], cluster.cone[3]
        need(abs(math.hypot(*axis) - 1) <= 0.00001 and -1 <= cosine <= 1,
             "cluster %d: cone" % cluster.index)
    if archive.flag(TRIANGLES):
        check_box(archive)
        check_triangles(archive, scale)
    check_law(archive)


# --- section 6.5, and the rules of 6.3 ---

def check_leaves(archive, b):
    """A leaf's record and colour are those of its triangle."""
    for node in b.nodes:
        points = [b.lattice[c] for c in node.corners]
        told = (node.x, node.y, node.z, node.normal, node.radius, node.e_self, node.height)
        derived = derive_leaf(archive, b, points)
        need(told == derived, "block %d: a leaf does not follow from its triangle: %r, not %r"
             % (b.index, told, derived))
        if archive.flag(COLORS):
            need(node.rgba == mean_color([b.vertex_rgba[c] for c in node.corners]),
                 "block %d: colour of a leaf" % b.index)


def check_vertex_order(b):
    """Vertices are numbered in the order of their first use, canonically."""
    seen = 0
    for node in b.canonical:
        for corner in node.corners:
            need(corner <= seen, "block %d: order of the vertices" % b.index)
            seen += corner == seen
    need(seen == b.vertex_count, "block %d: a vertex is not used" % b.index)


# --- section 8, promises 2 and 3; section 6.4.1, links ---

def check_promise_codes(archive):
    for cluster in archive.clusters:
        for node in cluster.order:
            parent, what = node.parent, "block %d" % node.block.index
            if parent is None:
                need(node.e_parent == ROOT_MARK, "%s: the root's mark" % what)
                continue
            need(node.e_parent == parent.e_self, "%s: e_parent" % what)
            need(node.e_self <= parent.e_self, "%s: e_self grows" % what)
            if node.kind == INNER and not archive.flag(ERROR_PAPER):
                need(length_value(node.e_self) >= node.H, "%s: e_self is below H" % what)
            if parent.block is node.block:
                bound = link_bound(archive, node.block, parent, node)
                need(node.link == link_code(bound, node.block.link_base),
                     "%s: link code" % what)


def check_errors(archive):
    errors = [length_value(n.e_self) for c in archive.clusters for n in c.order
              if n.kind == INNER]
    if errors:
        need(archive.header.e_min == min(errors) and archive.header.e_max == max(errors),
             "e_min or e_max of the header")


# --- exact places ---

def choose_scale(archive):
    """Bits behind the unit that hold every length without rounding."""
    unit = archive.header.unit_exp
    fine = min([b.step_exp for b in archive.blocks]
               + [low_bit(o) for c in archive.clusters for o in c.origin]
               + [archive.header.vertex_exp])
    # f32 values end at 2^-149, heights take 8 bits more, 2^-21 (D + D') 21.
    return max(149 + 32, unit - fine + 1)


def place_nodes(archive, scale):
    """Counts of 2^-scale units: centre, radius of each node; origin of clusters."""
    unit = archive.header.unit_exp
    for cluster in archive.clusters:
        cluster.at = tuple(units(o, scale - unit) for o in cluster.origin)
        for node in cluster.order:
            shift = node.block.step_exp - unit + scale
            offset = (node.x << shift, node.y << shift, node.z << shift)
            node.offset = offset
            node.at = tuple(o + p for o, p in zip(cluster.at, offset))
            need(tuple(units(c, scale - unit) for c in node.center) == node.at,
                 "block %d: the step is finer than f64" % node.block.index)
            node.reach = ratio_at(node.R, scale)


def units(value, shift):
    """A float times 2^shift, a whole number."""
    if shift >= 0:
        return ratio_at(value, shift)
    top, bottom = value.as_integer_ratio()
    return (top // bottom) >> -shift


def at_most(square, bound):
    """sqrt(square) <= bound."""
    return bound >= 0 and square <= bound * bound


def check_links(archive, scale):
    """Promise 5, with the diagonals as the blocks hold them."""
    for cluster in archive.clusters:
        for node in cluster.order:
            parent = node.parent
            if parent is None:
                continue
            away = sub(node.at, parent.at)
            slack = ratio_at(node.block.diagonal, scale) + ratio_at(parent.block.diagonal, scale)
            need(slack & (1 << 21) - 1 == 0, "scale")
            room = (ratio_at(node.L, scale) - max(0, parent.reach - node.reach)
                    - (slack >> 21))
            need(at_most(dot(away, away), room),
                 "block %d: a link is too small" % node.block.index)


# --- section 4: ranges ---

def check_ranges(archive):
    for cluster in archive.clusters:
        check_cluster_ranges(cluster)
        later = 0.0
        for b in reversed(cluster.blocks):
            later = max(later, max(n.L for n in b.nodes))
            check_block_ranges(b, later)
    for cluster in reversed(archive.clusters):
        family = [cluster] + children(archive, cluster)
        for name, own in (("sub_radius_max", "radius_max"), ("sub_link_max", "link_max")):
            values = [getattr(cluster, own)] + [getattr(c, name) for c in family[1:]]
            need(getattr(cluster, name) == max(values), "cluster %d: %s" % (cluster.index, name))


def children(archive, cluster):
    return archive.clusters[cluster.child_first:cluster.child_first + cluster.child_count]


def check_cluster_ranges(cluster):
    nodes = cluster.order
    for name, values in (("e_self", [length_value(n.e_self) for n in nodes]),
                         ("e_parent", [length_value(n.e_parent) for n in nodes]),
                         ("radius", [n.R for n in nodes])):
        told = getattr(cluster, name + "_min"), getattr(cluster, name + "_max")
        need(told == (min(values), max(values)),
             "cluster %d: range of %s" % (cluster.index, name))
    need(cluster.link_max == max(n.L for n in nodes), "cluster %d: link_max" % cluster.index)


def check_block_ranges(b, links):
    parents = [length_value(n.e_parent) for n in b.nodes]
    told = b.e_parent_max, b.e_parent_min, b.e_self_min, b.link_max, b.radius_max
    found = (max(parents), min(parents), min(length_value(n.e_self) for n in b.nodes),
             links, max(n.R for n in b.nodes))
    need(told == found, "block %d: ranges %r, not %r" % (b.index, told, found))


# --- section 4: shapes ---

def room(values):
    """What 4.1 leaves: 2^-40 of the numbers that meet."""
    return max(map(abs, values)) >> 40


def check_shapes(archive, cluster, scale):
    what = "cluster %d" % cluster.index
    box = scaled(cluster.box, scale)
    sub_box = scaled(cluster.sub_box, scale)
    sphere, sub_sphere = scaled(cluster.sphere, scale), scaled(cluster.sub_sphere, scale)
    for node in cluster.order:
        ball = ([p - node.reach for p in node.offset] + [p + node.reach for p in node.offset])
        need(box_within(ball, box), "%s: box" % what)
        need(ball_within(node.offset, node.reach, sphere), "%s: sphere" % what)
    need(box_within(box, sub_box), "%s: sub_box" % what)
    need(ball_within(sphere[:3], sphere[3], sub_sphere), "%s: sub_sphere" % what)
    for child in children(archive, cluster):
        shift = sub(child.at, cluster.at)
        inner = scaled(child.sub_box, scale)
        inner = [inner[k] + shift[k % 3] for k in range(6)]
        need(box_within(inner, sub_box), "%s: sub_box of a child" % what)
        ball = scaled(child.sub_sphere, scale)
        center = tuple(ball[k] + shift[k] for k in range(3))
        need(ball_within(center, ball[3], sub_sphere), "%s: sub_sphere of a child" % what)
    size = sub(cluster.box[3:], cluster.box[:3])
    diagonal = f32_above(math.sqrt(dot(size, size)))
    for b in cluster.blocks:
        need(b.diagonal == diagonal, "block %d: diagonal %r, not %r"
             % (b.index, b.diagonal, diagonal))


def scaled(values, scale):
    need(all(map(math.isfinite, values)), "a box or sphere is not finite")
    return tuple(ratio_at(v, scale) for v in values)


def ball_within(center, radius, sphere):
    away = sub(center, sphere[:3])
    return at_most(dot(away, away), sphere[3] - radius + room((*center, *sphere, radius)))


def box_within(one, other):
    slack = room((*one, *other))
    return all(other[k] - slack <= one[k] and one[k + 3] <= other[k + 3] + slack
               for k in range(3))


def check_box(archive):
    """Section 2: the header's box is that of all corners. Readers of archives
    without triangles cannot tell."""
    points = [v for b in archive.blocks if b.has_triangles for v in b.vertices]
    for k in range(3):
        values = [p[k] for p in points]
        need((archive.header.box[k], archive.header.box[k + 3]) == (min(values), max(values)),
             "box of the header")


# --- sections 4.1, 6.3 and 8: what lies below a node ---

def check_triangles(archive, scale):
    """Cones hold the winding normals below; promises 1 and 4."""
    shift = archive.header.vertex_exp - archive.header.unit_exp + scale
    for cluster in archive.clusters:
        for leaf in cluster.order:
            if leaf.kind == LEAF:
                points = [leaf.block.lattice[c] for c in leaf.corners]
                points = [tuple(p << shift for p in point) for point in points]
                check_below(archive, leaf, points, scale)


def check_below(archive, leaf, points, scale):
    sides = sub(points[1], points[0]), sub(points[2], points[1]), sub(points[0], points[2])
    longest = max(dot(s, s) for s in sides)
    need(at_most(longest, ratio_at(length_value(leaf.e_self), scale)),
         "block %d: t is below the longest edge" % leaf.block.index)
    normal = unit_vector(winding(archive, leaf))
    node, cluster = leaf, None
    while node is not None:
        check_pill(archive, node, points, scale)
        check_cone(normal, unit_vector(group_axis(archive, node)), node.group.cosine / 32767,
                   "block %d: cone of a normal cluster" % node.block.index)
        if node.cluster is not cluster:
            cluster = node.cluster
            check_cone(normal, cluster.cone[:3], cluster.cone[3],
                       "cluster %d: cone" % cluster.index)
        node = node.parent


def group_axis(archive, node):
    return archive.axes[node.block.groups.index(node.group)]


def unit_vector(v):
    """v over its length; None for a triangle that spans no area."""
    length = math.hypot(*v)
    return tuple(x / length for x in v) if length else None


def check_cone(normal, axis, cosine, what):
    """The angle of normal and axis has at least that cosine. A triangle without
    area has every direction, so its cone must be full."""
    if cosine > -1:
        need(normal is not None and dot(normal, axis) >= cosine - 1e-6, what)


def check_pill(archive, node, points, scale):
    """Promise 1: the triangle lies in the node's ball and slab."""
    what = "block %d: a triangle leaves the pill" % node.block.index
    vector, high = node.vector, node.H
    limit = ratio_at(high, scale) ** 2 * dot(vector, vector)
    for point in points:
        away = sub(point, node.at)
        need(at_most(dot(away, away), node.reach), what + " (ball)")
        need(dot(away, vector) ** 2 <= limit, what + " (slab)")


# --- section 11 ---

def check_law(archive):
    bins = {}
    source = random.Random(1)
    for cluster in reversed(archive.clusters):
        for node in reversed(cluster.order):
            node.weight = (source.getrandbits(64) if node.kind == LEAF
                           else sum(child.weight for child in node.children))
            low = 0 if node.kind == LEAF else node.e_self
            bins[low] = bins.get(low, 0) + node.weight
            bins[node.e_parent] = bins.get(node.e_parent, 0) - node.weight
    for code, weight in bins.items():
        need(code in (0, ROOT_MARK) or weight == 0, "the law of section 11, code %d" % code)
