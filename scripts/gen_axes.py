#!/usr/bin/env python3
"""Prints format/axes_table.inc: the 128 directions that nodes are grouped by.

A spherical Fibonacci lattice; rank: order of a farthest-point walk, so that the first N by rank
are well spread for any N; rows: along a short path over the sphere, so that the directions
seen from one side form few runs. Run once; the table is the definition.
"""
import math

N = 128
GOLDEN = (1 + 5 ** 0.5) / 2
points = []
for i in range(N):
    z = 1 - (2 * i + 1) / N
    a = 2 * math.pi * ((i / GOLDEN) % 1)
    r = math.sqrt(1 - z * z)
    points.append((r * math.cos(a), r * math.sin(a), z))


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def gap(a, b):
    return math.acos(max(-1, min(1, dot(a, b))))


rank = {0: 0}
while len(rank) < N:
    far = max((k for k in range(N) if k not in rank),
              key=lambda k: (min(gap(points[k], points[j]) for j in rank), -k))
    rank[far] = len(rank)

path = [0]
left = set(range(1, N))
while left:
    near = min(left, key=lambda k: (gap(points[path[-1]], points[k]), k))
    path.append(near)
    left.remove(near)
better = True
while better:                       # 2-opt
    better = False
    for i in range(1, N - 1):
        for j in range(i + 1, N):
            a, b, c = points[path[i - 1]], points[path[i]], points[path[j]]
            d = points[path[j + 1]] if j + 1 < N else None
            old = gap(a, b) + (gap(c, d) if d else 0)
            new = gap(a, c) + (gap(b, d) if d else 0)
            if new < old - 1e-12:
                path[i:j + 1] = reversed(path[i:j + 1])
                better = True
print("/* Printed by scripts/gen_axes.py: x, y, z in Q15, rank. */")
for k in path:
    print("    {%d, %d, %d, %d}," % (*[round(32767 * c) for c in points[k]], rank[k]))
