#!/usr/bin/env python3
"""A second reader of .spc archives, written from spec/spc-1.md alone.

    spc_second.py check FILE...     OK, or STATUS: what is wrong; a line a file
    spc_second.py dump FILE         everything decoded, as text
    spc_second.py hexdump FILE      every byte with its meaning, for small archives
    spc_second.py example FILE      section 12 of the specification, from such an archive

It shares nothing with the C library, so that an error in one is seen by the
other. It needs Python 3 and, for codec zstd, the command `zstd`. It is slow.
Exit 0: whole; 3: the archive is refused; 1: the file cannot be read; 2: usage.

STATUS is NOT_SPC, TRUNCATED, VERSION, CHECKSUM, FEATURE, LIMIT or CORRUPT, as
in section 2 of the specification.

THE DUMP

Lines end in \\n; words are separated by one space. An archive is checked before
anything is printed. In what follows

    INT    decimal, as printf("%lld") or ("%llu")
    REAL   the value as f64, as printf("%.13a") in C; "inf" for infinity
    HEX    bytes in file order, two lower-case digits each, no spaces

A record prints one line a field, "HEAD.name value ...", in the order of its table
in the specification. Arrays print all their elements on the line; u8 arrays
(magic, id, tag, normal, rgba) print as one HEX word, all others as INT or, for
f32 and f64, REAL. Fields named zero, zero_1 and zero_2 and, within header and
cluster, the sections and tops are not printed. Lines, in this order:

    header.NAME ...                 table "header"
    section S.NAME ...              table "section", of the used sections, S from 0;
                                    tag as HEX
    axis I X Y Z                    AXES, INT each
    meta TEXT                       bytes 0x20 to 0x7e but \\ as they are, others
                                    as \\ and two hexadecimal digits
    then for each cluster C:
    cluster C.NAME ...              table "cluster"
    cluster C top T.NAME ...        table "top": the fields of table "node", then
                                    rgba, step_exp, link_base; the used ones
    then for each block B of C:
    block B.NAME ...                table "block"
    block B group G COUNT COSINE    of its payload, every normal cluster
    block B vertex_base X Y Z       leaf blocks with triangles only
    then for each node of C, in canonical order:
    node I P B KIND CHILDREN X Y Z R r H h L l e SELF PARENT t T normal NU NV rgba HEX
        I         number in the canonical order of the cluster, from 0
        P         that of its parent; ^ and the number in the parent cluster for
                  a top; - for the root
        B         block; KIND: i inner, l leaf; CHILDREN: the nibble, 0 for a leaf
        X Y Z     decoded centre, file units, REAL
        r h l     R, H, L in units, REAL (behind the words R, H, L)
        SELF PARENT   codes e_self, e_parent, INT; "root" for the root's mark
        T         the value of e_self in units, REAL
        NU NV     normal code, INT
        HEX       colour; ffffffff without flag colors
    then for each leaf of C with a triangle, in canonical order:
    triangle I V X Y Z HEX V X Y Z HEX V X Y Z HEX
        I the leaf; for each corner, in stored order, its number in the block,
        its coordinates in file units (REAL) and its colour
    and after the last cluster:
    end
"""
import os
import sys

sys.dont_write_bytecode = True      # leaves no folder in the tree

import blocks
from codes import Bad
from dump import dump
from example import example
import head
from hexdump import hexdump
import rules
import tree


def read_all(path):
    """Opens and checks everything; raises Bad."""
    archive = head.open_archive(path)
    blocks.read_chunks(archive)
    tree.replay(archive)
    rules.check_all(archive)
    return archive


def check(paths):
    worst = 0
    for path in paths:
        prefix = path + ": " if len(paths) > 1 else ""
        try:
            read_all(path)
            print(prefix + "OK")
        except Bad as bad:
            print("%s%s: %s" % (prefix, bad.status, bad))
            worst = max(worst, 1 if bad.status == "IO" else 3)
    return worst


def show(path, printer):
    try:
        archive = read_all(path)
    except Bad as bad:
        sys.stderr.write("%s: %s\n" % (bad.status, bad))
        return 1 if bad.status == "IO" else 3
    printer(archive, lambda line: sys.stdout.write(line + "\n"))
    return 0


def main(args):
    if len(args) >= 2 and args[0] == "check":
        return check(args[1:])
    if len(args) == 2 and args[0] == "dump":
        return show(args[1], dump)
    if len(args) == 2 and args[0] == "hexdump":
        return show(args[1], hexdump)
    if len(args) == 2 and args[0] == "example":
        return show(args[1], lambda archive, out: example(archive, args[1], out))
    sys.stderr.write("usage: spc_second.py check|dump|hexdump|example FILE\n")
    return 2


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except BrokenPipeError:         # the reader of the dump has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
