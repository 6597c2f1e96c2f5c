"""
terminal.py TERM[:COLUMNS] SCAN COMMAND...: runs a command that reads SCAN under a terminal, or with TERM '-'
into a pipe, and prints what came. Progress is due after a second, so the tool is held for longer than that once it has begun;
then little work is enough. Prints "progress: N" (lines of it that were drawn) and then what stays on the screen.
"""
import fcntl
import os
import pty
import re
import signal
import struct
import sys
import termios
import time


def start(term, columns, command):
    if term == "-":
        ours, theirs = os.pipe()
    else:
        ours, theirs = pty.openpty()
        fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    child = os.fork()
    if child == 0:
        os.environ["TERM"] = term
        os.dup2(theirs, 1)
        os.dup2(theirs, 2)
        os.execv(command[0], command)
    os.close(theirs)
    return child, ours


def has_open(child, path):
    """As a file, or in its memory."""
    folder = "/proc/%d/fd" % child
    try:
        if any(os.path.realpath(os.path.join(folder, name)) == path for name in os.listdir(folder)):
            return True
        with open("/proc/%d/maps" % child) as maps:
            return any(line.rstrip("\n").endswith(" " + path) for line in maps)
    except OSError:
        return False


def hold(child, scan):
    """Stops the tool in the middle of reading, for a little more than a second. False: it has ended before."""
    scan = os.path.realpath(scan)
    end = time.monotonic() + 20
    while not has_open(child, scan):
        if time.monotonic() > end or os.waitid(os.P_PID, child, os.WEXITED | os.WNOHANG | os.WNOWAIT):
            return False
        time.sleep(0.0005)
    os.kill(child, signal.SIGSTOP)
    time.sleep(1.1)
    os.kill(child, signal.SIGCONT)
    return True


def read_all(source):
    data = b""
    while True:
        try:
            piece = os.read(source, 65536)
        except OSError:         # how a terminal says that nobody writes any more
            piece = b""
        if not piece:
            return data.decode()
        data += piece


def screen(text):
    """What a terminal shows in the end; fails on an escape sequence other than 'erase to the end of the line'."""
    lines, line, at = [], "", 0
    for part in re.findall(r"\033\[K|.", text, re.S):
        if part == "\033[K":
            line = line[:at]
        elif part == "\r":
            at = 0
        elif part == "\n":
            lines.append(line)
            line, at = "", 0
        elif part < " ":
            sys.exit("a control character %r: %r" % (part, text))
        else:
            line = line[:at] + part + line[at + 1:]
            at += 1
    return "\n".join(lines + [line])


def main():
    term, scan, command = sys.argv[1], sys.argv[2], sys.argv[3:]
    term, _, columns = term.partition(":")
    columns = int(columns or 80)
    for _ in range(5):          # a busy machine may let it end before it can be held
        child, source = start(term, columns, command)
        if hold(child, scan):
            break
        text = read_all(source)
        os.waitpid(child, 0)
    else:
        sys.exit("the tool ended before it could be held: %r" % text)
    text = read_all(source)
    status = os.waitpid(child, 0)[1]
    if status != 0:
        sys.exit("the tool failed: %r" % text)
    if term == "-" and ("\033" in text or "\r" in text):
        sys.exit("a pipe gets what is for a terminal: %r" % text)
    for drawn in re.findall(r"\r([^\r\n\033]*)\033\[K", text):
        if len(drawn) >= columns:
            sys.exit("progress breaks the line of %d columns: %r" % (columns, drawn))
    print("progress: %d" % len(re.findall(r"spc-[a-z]+: [^\r\n]*\d %", text)))
    print(screen(text).rstrip("\n"))


main()
