# What an X server without a screen shows: screen.py XWD [PPM]. Exit 0 when its top left is the PPM, all of it;
# without one, when anything is shown at all.
import struct
import sys

xwd = open(sys.argv[1], "rb").read()
header = struct.unpack(">25I", xwd[:100])
(size, _, _, depth, width, height, _, low_first, _, _, _, bits, row, _, red, green, blue, _, _, colors) = header[:20]
assert bits == 32 and (red, green, blue) == (0xFF0000, 0xFF00, 0xFF), "the screen has other pixels"
pixels = xwd[size + 12 * colors:]
order = (2, 1, 0) if low_first == 0 else (1, 2, 3)

if len(sys.argv) < 3:
    sys.exit(0 if any(pixels[c::4].strip(b"\0") for c in order) else 1)

magic, sizes, most, ppm = open(sys.argv[2], "rb").read().split(b"\n", 3)
wide, high = map(int, sizes.split())
assert magic == b"P6" and wide <= width and high <= height
wrong = 0
for y in range(high):
    line = pixels[y * row:y * row + 4 * wide]
    own = ppm[3 * wide * y:3 * wide * (y + 1)]
    for channel in range(3):
        shown = line[order[channel]::4]
        wrong += sum(a != b for a, b in zip(shown, own[channel::3]))
if wrong:
    print(wrong, "values differ")
sys.exit(1 if wrong else 0)
