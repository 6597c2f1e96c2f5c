"""zstd frames: where one ends (RFC 8878), and how many are decoded at once.

The decoder itself is the command `zstd`. It takes any number of files, so one
process decodes all frames of an archive."""
import os
import subprocess
import tempfile

from codes import need

MAGIC = 0xFD2FB528
BATCH = 1000            # files a process: keeps the command line short


def take(data, at, count):
    need(at + count <= len(data), "a zstd frame is cut")
    return int.from_bytes(data[at:at + count], "little")


def frame_bytes(data):
    """The size of the frame at the start of data, told from its headers."""
    need(take(data, 0, 4) == MAGIC, "no zstd frame")
    descriptor = take(data, 4, 1)
    single = descriptor >> 5 & 1
    need(descriptor & 8 == 0, "reserved bit of a zstd frame")
    dictionary = (0, 1, 2, 4)[descriptor & 3]
    size_bytes = (single, 2, 4, 8)[descriptor >> 6]
    at = 5 + (1 - single)
    need(take(data, at, dictionary) == 0, "a zstd frame with a dictionary")
    at += dictionary + size_bytes
    last = 0
    while not last:
        block = take(data, at, 3)
        last, kind, size = block & 1, block >> 1 & 3, block >> 3
        need(kind != 3, "reserved block of a zstd frame")
        at += 3 + (1 if kind == 1 else size)
    return at + (4 if descriptor & 4 else 0)


def inflate(frames):
    """Decodes each of frames, a list of bytes."""
    for frame in frames:
        need(frame_bytes(frame) == len(frame), "bytes behind a zstd frame")
    out = []
    with tempfile.TemporaryDirectory() as folder:
        for first in range(0, len(frames), BATCH):
            out += inflate_batch(folder, frames[first:first + BATCH])
    return out


def inflate_batch(folder, frames):
    names = [os.path.join(folder, "%d.zst" % i) for i in range(len(frames))]
    for name, frame in zip(names, frames):
        with open(name, "wb") as file:
            file.write(frame)
    # The specification limits no window, so this takes the widest the command knows.
    done = subprocess.run(["zstd", "-d", "-q", "-f", "--long=31"] + names,
                          stdin=subprocess.DEVNULL,
                          stderr=subprocess.DEVNULL, check=False)
    need(done.returncode == 0, "a zstd frame does not decode")
    out = []
    for name in names:
        with open(name[:-4], "rb") as file:
            out.append(file.read())
    return out
