"""Values of the .spc format: hash, codes of section 5, exact lengths.

Lengths are compared exactly, as integers that count a power of two of a unit,
because a rounded comparison could hide a bound that is short by one bit.
"""
import math

ROOT_MARK = 0xFF00          # section 5: e_parent of the root
LENGTH_MIN = 0x0100
LENGTH_MAX = 0xFEFF


class Bad(Exception):
    """An archive that breaks a rule; status is a word of section 2."""

    def __init__(self, status, message):
        super().__init__(message)
        self.status = status


def need(condition, message, status="CORRUPT"):
    if not condition:
        raise Bad(status, message)


# --- XXH64 (section 1), after the public xxHash specification ---

P1 = 0x9E3779B185EBCA87
P2 = 0xC2B2AE3D27D4EB4F
P3 = 0x165667B19E3779F9
P4 = 0x85EBCA77C2B2AE63
P5 = 0x27D4EB2F165667C5
M64 = (1 << 64) - 1


def rotl(x, n):
    return ((x << n) | (x >> (64 - n))) & M64


def xxh_round(acc, lane):
    return rotl((acc + lane * P2) & M64, 31) * P1 & M64


def xxh_stripes(data, seed):
    """The four accumulators over all whole stripes of 32 bytes, merged."""
    acc = [(seed + P1 + P2) & M64, (seed + P2) & M64, seed, (seed - P1) & M64]
    whole = len(data) & ~31
    for at in range(0, whole, 32):
        for i in range(4):
            lane = int.from_bytes(data[at + 8 * i:at + 8 * i + 8], "little")
            acc[i] = xxh_round(acc[i], lane)
    out = (rotl(acc[0], 1) + rotl(acc[1], 7) + rotl(acc[2], 12) + rotl(acc[3], 18)) & M64
    for a in acc:
        out = ((out ^ xxh_round(0, a)) * P1 + P4) & M64
    return out


def xxh_tail(acc, data, at):
    while at + 8 <= len(data):
        lane = int.from_bytes(data[at:at + 8], "little")
        acc = (rotl(acc ^ xxh_round(0, lane), 27) * P1 + P4) & M64
        at += 8
    if at + 4 <= len(data):
        lane = int.from_bytes(data[at:at + 4], "little")
        acc = (rotl(acc ^ (lane * P1 & M64), 23) * P2 + P3) & M64
        at += 4
    for byte in data[at:]:
        acc = rotl(acc ^ (byte * P5 & M64), 11) * P1 & M64
    return acc


def xxh64(data, seed=0):
    data = bytes(data)
    acc = xxh_stripes(data, seed) if len(data) >= 32 else (seed + P5) & M64
    acc = xxh_tail((acc + len(data)) & M64, data, len(data) & ~31)
    acc = (acc ^ (acc >> 33)) * P2 & M64
    acc = (acc ^ (acc >> 29)) * P3 & M64
    return acc ^ (acc >> 32)


# --- length codes (section 5) ---

def length_valid(code):
    return code == 0 or LENGTH_MIN <= code <= LENGTH_MAX


def length_value(code):
    """The f32 with the bits code << 15; infinity for the mark of the root."""
    if code == ROOT_MARK:
        return math.inf
    if code == 0:
        return 0.0
    return math.ldexp(256 + (code & 255), (code >> 8) - 127 - 8)


def length_code(value):
    """The smallest code whose value is at least `value`, the largest above all
    (section 6.5, step 5)."""
    if value == 0:
        return 0
    if math.isinf(value):
        return LENGTH_MAX
    mantissa, exponent = math.frexp(value)
    code = ((exponent - 1 + 127) << 8) + math.ceil((2 * mantissa - 1) * 256)
    return min(max(code, LENGTH_MIN), LENGTH_MAX)


# --- link and height codes (section 5) ---

def link_value(code, base):
    return math.ldexp(8 + (code & 7), base + (code >> 3) - 3)


def link_code(value, base):
    """The smallest code whose value is at least `value`, 255 if none is."""
    if value <= math.ldexp(1, base):
        return 0
    if math.isinf(value):
        return 255
    mantissa, exponent = math.frexp(value)
    return min(255, (exponent - 1 - base) * 8 + math.ceil((2 * mantissa - 1) * 8))


def height_value(code, radius):
    return radius * (code + 1) / 256


# --- normal codes (section 5) ---

def normal_vector(nu, nv):
    """The integer vector of a normal code; its length is not 127."""
    u, v = nu - 127, nv - 127
    w = 127 - abs(u) - abs(v)
    if w >= 0:
        return u, v, w
    return ((127 - abs(v)) * (-1 if u < 0 else 1),
            (127 - abs(u)) * (-1 if v < 0 else 1), w)


# --- differences (section 6.4) ---

def unzigzag(z):
    return z >> 1 if z & 1 == 0 else -(z >> 1) - 1


def add_color(model, z):
    """Differences of r, g, b, a to the model's; green's is part of red's and blue's."""
    green = unzigzag(z[1])
    extra = (green, 0, green, 0)
    return bytes((model[k] + unzigzag(z[k]) + extra[k]) & 0xFF for k in range(4))


# --- exact arithmetic ---

def ratio_at(value, shift):
    """A float as a count of 2^-shift; shift must be large enough."""
    top, bottom = value.as_integer_ratio()
    assert (1 << shift) % bottom == 0, "%r needs a finer scale" % value
    return (top << shift) // bottom


def low_bit(value):
    """The exponent of the lowest set bit of a float; 0 for 0."""
    top, bottom = value.as_integer_ratio()
    if top == 0:
        return 0
    return (top & -top).bit_length() - bottom.bit_length()


def pow2(value, exponent):
    """value 2^exponent in f64; what is too large is infinity."""
    try:
        return math.ldexp(value, exponent)
    except OverflowError:
        return math.inf


def f32_above(value):
    """The smallest f32 that is at least the f64 `value`; infinity above all."""
    if value == 0:
        return 0.0
    ulp = max(math.frexp(value)[1] - 24, -149)
    near = math.ldexp(math.ceil(math.ldexp(value, -ulp)), ulp)
    return near if near < 2.0 ** 128 else math.inf


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def sub(a, b):
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]
