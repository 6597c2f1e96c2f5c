"""Leaves from triangles (section 6.5). All arithmetic is f64, one rounding an
operation, in the order the section writes it."""
import math

from codes import height_value, length_code, length_value, LENGTH_MAX, need, normal_vector, pow2

SLACK = 1 + 2.0 ** -40


class Steps:
    """What the steps of section 6.5 give for one triangle."""

    def __init__(self, archive, b, points):
        h = archive.header
        self.what = "block %d" % b.index
        self.to_units = h.vertex_exp - h.unit_exp
        self.corners = local_corners(archive, b, points)
        self.side_a = minus(self.corners[1], self.corners[0])
        self.side_b = minus(self.corners[2], self.corners[0])
        side_c = minus(self.side_b, self.side_a)
        self.squares = dot(side_c, side_c), dot(self.side_b, self.side_b), \
            dot(self.side_a, self.side_a)
        self.f, self.g = weights(*self.squares)
        self.place(math.ldexp(1, b.step_exp - h.vertex_exp))
        self.lengths()
        self.n = cross(self.side_a, self.side_b)
        self.normal = normal_code(self.n)
        self.thickness()

    def place(self, step):
        """Step 4."""
        self.step = step
        axes = list(zip(self.corners[0], self.side_a, self.side_b))
        self.k = [a + math.floor((self.f * s + self.g * t) + 0.5) for a, s, t in axes]
        self.xyz = [math.floor(k / step + 0.5) for k in self.k]
        need(0 <= min(self.xyz) and max(self.xyz) <= 65535,
             "%s: a leaf lies outside its cluster" % self.what)
        self.p = tuple(x * step for x in self.xyz)

    def lengths(self):
        """Step 5."""
        self.away = [minus(corner, self.p) for corner in self.corners]
        self.reach = math.sqrt(max(dot(d, d) for d in self.away))
        self.radius = length_code(pow2(self.reach, self.to_units) * SLACK)
        self.t = self.e_self = length_code(
            pow2(math.sqrt(max(self.squares)), self.to_units) * SLACK)
        if 8 * self.step > self.reach and self.radius > 0:
            self.e_self = max(self.t, self.radius + 256)
            need(self.e_self <= LENGTH_MAX, "%s: t of a leaf" % self.what)

    def thickness(self):
        """Step 7."""
        x, y, z = self.vector = normal_vector(*self.normal)
        self.q = max(abs(dot(d, self.vector)) for d in self.away) / math.sqrt(
            x * x + y * y + z * z)
        radius = length_value(self.radius)
        self.wanted = pow2(self.q, self.to_units) * SLACK + radius * 2.0 ** -40
        fitting = [code for code in range(256) if height_value(code, radius) >= self.wanted]
        self.height = fitting[0] if fitting else 255


def derive_leaf(archive, b, points):
    """x, y, z, normal, radius, e_self, height of the leaf of lattice points."""
    s = Steps(archive, b, points)
    return (*s.xyz, s.normal, s.radius, s.e_self, s.height)


def local_corners(archive, b, points):
    """Step 1: lattice numbers minus the origin's."""
    origin = [lattice_number(o, archive.header.vertex_exp)
              for o in archive.clusters[b.cluster].origin]
    return turn([tuple(float(p - o) for p, o in zip(point, origin)) for point in points])


def lattice_number(value, exponent):
    """The origin counts whole steps of the lattice."""
    top, bottom = value.as_integer_ratio()
    down = bottom.bit_length() - 1 + exponent
    if down <= 0:
        return top << -down
    need(top & (1 << down) - 1 == 0, "an origin lies beside the lattice")
    return top >> down


def minus(p, q):
    return p[0] - q[0], p[1] - q[1], p[2] - q[2]


def dot(p, q):
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


def turn(corners):
    """Step 1: the smallest corner first, the cyclic order kept."""
    first = corners.index(min(corners))
    return corners[first:] + corners[:first]


def weights(s0, s1, s2):
    """Steps 2 and 3: the centre is A + f a + g b."""
    m = max(s0, s1, s2)
    if m < s0 + s1 + s2 - m:
        w0 = s0 * (s1 + s2 - s0)
        w1 = s1 * (s0 + s2 - s1)
        w2 = s2 * (s0 + s1 - s2)
        total = w0 + w1 + w2
        return w1 / total, w2 / total
    if s0 == m:
        return 0.5, 0.5
    return (0.0, 0.5) if s1 == m else (0.5, 0.0)


def cross(a, b):
    (ax, ay, az), (bx, by, bz) = a, b
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def winding(archive, leaf):
    """The cross product that section 4.1 takes a triangle's direction from."""
    b = leaf.block
    p, q, r = local_corners(archive, b, [b.lattice[c] for c in leaf.corners])
    return cross(minus(q, p), minus(r, p))


def normal_code(n):
    """Step 6."""
    nx, ny, nz = n
    h = abs(nx) + abs(ny) + abs(nz)
    i = 1 / h if h else 0.0
    u, v = nx * i, ny * i
    if nz < 0:
        u, v = ((1 - abs(v)) * (-1 if u < 0 else 1),
                (1 - abs(u)) * (-1 if v < 0 else 1))
    return bytes(math.floor(x * 127 + 0.5) + 127 for x in (u, v))
