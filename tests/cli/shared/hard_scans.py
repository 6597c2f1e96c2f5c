"""Writes a scan that is hard to divide: hard_scans.py KIND TRIANGLES OUT.ply

outlier   a small patch of terrain, and one triangle ten million times its size away
place     every triangle has its corners within one lattice step
same      one triangle, over and over
plane     a flat grid        line    triangles along one line, without area
cell      nine tenths of the triangles in one thousandth of the box
needle    triangles a million times longer than wide
powers    triangles whose size and place halve again and again
"""
import array
import math
import random
import sys


def grid(n, height):
    side = math.isqrt(n // 2) + 1
    points = [(i / side, j / side, height(i, j)) for i in range(side + 1) for j in range(side + 1)]
    faces = []
    for i in range(side):
        for j in range(side):
            a = i * (side + 1) + j
            b = a + side + 1
            faces += [(a, b, a + 1), (a + 1, b, b + 1)]
    return points, faces[:n]


def loose(n, corners):
    points, faces = [], []
    for i in range(n):
        points += corners(i)
        faces.append((3 * i, 3 * i + 1, 3 * i + 2))
    return points, faces


def rough(i, j):
    return math.sin(i * 0.7) * math.cos(j * 0.9) * 0.003


def around(at, size, rnd):
    return [tuple(c + size * rnd.uniform(-1, 1) for c in at) for _ in range(3)]


def make(kind, n, rnd):
    if kind == "outlier":
        points, faces = grid(n - 1, rough)
        first = len(points)
        points += [(1e7, 1e7, 1e7), (1e7 + 1, 1e7, 1e7), (1e7, 1e7 + 1, 1e7)]
        return points, faces + [(first, first + 1, first + 2)]
    if kind == "place":
        return loose(n, lambda i: around((1e6, 1e6, 1e6), 1e-9, rnd))
    if kind == "same":
        points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
        return points, [(0, 1, 2)] * n
    if kind == "plane":
        return grid(n, lambda i, j: 0)
    if kind == "line":
        return loose(n, lambda i: [(i / n, 0, 0), ((i + 0.5) / n, 0, 0), ((i + 1) / n, 0, 0)])
    if kind == "cell":
        return loose(n, lambda i: around([rnd.random() * (0.001 if i % 10 else 1) for _ in range(3)], 1e-4, rnd))
    if kind == "needle":
        return loose(n, lambda i: [(rnd.random(), y := rnd.random(), z := rnd.random()),
                                   (rnd.random(), y + 1e-6, z), (rnd.random(), y, z + 1e-6)])
    if kind == "powers":
        return loose(n, lambda i: around((2.0 ** -(i % 40),) * 3, 2.0 ** -(i % 40 + 4), rnd))
    raise SystemExit(__doc__)


def main():
    kind, n, path = sys.argv[1], int(sys.argv[2]), sys.argv[3]
    points, faces = make(kind, n, random.Random(7))
    with open(path, "wb") as out:
        out.write(f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
                  "property double x\nproperty double y\nproperty double z\n"
                  f"element face {len(faces)}\nproperty list uchar int vertex_indices\n"
                  "end_header\n".encode())
        flat = array.array("d", (c for p in points for c in p))
        out.write(flat.tobytes())
        rows = bytearray()
        for f in faces:
            rows += b"\x03" + array.array("i", f).tobytes()
        out.write(rows)


main()
