"""
What a test asks about pictures: png.py QUESTION PNG...; exit 1 with a line where the answer is no.

size WxH A           A has this size
covers A B           every pixel that A covers is covered in B, and some are
tile X Y A SHEET     A is the part of SHEET at column X, row Y of tiles of its size
smooth A             A has alpha between none and all, and all
differ PERCENT A B   so many per cent of the pixels differ, or more
"""
import struct
import sys
import zlib


def unfilter(kind, line, above, bpp):
    for i in range(len(line)):
        a = line[i - bpp] if i >= bpp else 0
        b = above[i]
        c = above[i - bpp] if i >= bpp else 0
        if kind == 1:
            line[i] = (line[i] + a) & 255
        elif kind == 2:
            line[i] = (line[i] + b) & 255
        elif kind == 3:
            line[i] = (line[i] + (a + b) // 2) & 255
        elif kind == 4:
            near = min((abs(b - c), 0, a), (abs(a - c), 1, b), (abs(a + b - 2 * c), 2, c))
            line[i] = (line[i] + near[2]) & 255


def read(path):
    data = open(path, "rb").read()
    assert data[:8] == b"\x89PNG\r\n\x1a\n", path + " is no PNG"
    at, packed = 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        if kind == b"IHDR":
            width, height, depth, color = struct.unpack(">IIBB", data[at + 8:at + 18])
        elif kind == b"IDAT":
            packed += data[at + 8:at + 8 + size]
        at += 12 + size
    assert depth == 8 and color in (2, 6)
    bpp = 3 if color == 2 else 4
    raw, row, above, lines = zlib.decompress(packed), width * bpp + 1, bytearray(width * bpp), []
    for y in range(height):
        line = bytearray(raw[y * row + 1:(y + 1) * row])
        unfilter(raw[y * row], line, above, bpp)
        lines.append(line)
        above = line
    return width, height, bpp, lines


def main():
    question, names = sys.argv[1], sys.argv[2:]
    if question == "size":
        width, height, _, _ = read(names[1])
        return "it is %dx%d" % (width, height) if "%dx%d" % (width, height) != names[0] else None
    if question == "tile":
        width, height, bpp, lines = read(names[2])
        x, y = int(names[0]) * width * bpp, int(names[1]) * height
        _, _, depth, sheet = read(names[3])
        part = [line[x:x + width * bpp] for line in sheet[y:y + height]]
        return None if depth == bpp and part == lines else "another tile"
    if question == "smooth":
        _, _, bpp, lines = read(names[0])
        alpha = set(bytes(v for line in lines for v in line[3::4])) if bpp == 4 else {255}
        return None if 255 in alpha and len(alpha - {0, 255}) > 1 else "alpha is %s" % sorted(alpha)
    if question == "covers":
        _, _, p, a = read(names[0])
        _, _, q, b = read(names[1])
        assert p == q == 4 and len(a) == len(b)
        bare = sum(s > 0 and t == 0 for k, l in zip(a, b) for s, t in zip(k[3::4], l[3::4]))
        some = sum(s > 0 for k in a for s in k[3::4])
        return "%d of %d pixels are bare" % (bare, some) if bare or not some else None
    if question == "differ":
        width, height, p, a = read(names[1])
        w, h, q, b = read(names[2])
        assert (width, height, p) == (w, h, q), "pictures of other kinds"
        count = sum(k[i:i + p] != l[i:i + p] for k, l in zip(a, b) for i in range(0, len(k), p))
        return "%d pixels of %d differ" % (count, w * h) if 100 * count < float(names[0]) * w * h else None
    raise SystemExit(__doc__)


said = main()
if said:
    print(" ".join(sys.argv[2:]) + ": " + said)
    sys.exit(1)
