#!/usr/bin/env python3
"""What is in a trace: frames.py FILE. All that is to be known of the format is in space/trace/README.md."""
import struct
import sys


def chunks(data):
    if data[:8] != b"ODEtrace":
        sys.exit("no trace")
    at = 8
    while at < len(data):
        kind, length, wanted = struct.unpack_from("<8sQQ", data, at)
        contents = data[at + 24:at + 24 + length]
        if len(contents) < length:
            sys.exit("the file ends within a chunk")
        checksum = 14695981039346656037
        for word, in struct.iter_unpack("<Q", data[at:at + 16] + contents):
            checksum = (checksum ^ word) * 1099511628211 % 2**64
        if checksum != wanted:
            sys.exit("a checksum is wrong")
        yield kind.decode().strip(), contents
        at += 24 + length


def lists(contents, real):
    """The numbers in each of a frame's five lists: (number, parent) of a geom, one number of all others."""
    sizes = struct.unpack_from("<5I", contents, 24)
    at = 48
    removed = struct.unpack_from("<%dI" % sizes[0], contents, at)
    at += (sizes[0] + sizes[0] % 2) * 4
    found = [removed]
    for count, size in zip(sizes[1:], (8 + 12 * real, 40 + 22 * real, 8 + 18 * real, 8 + 6 * real)):
        found.append([struct.unpack_from("<2I", contents, at + i * size) for i in range(count)])
        at += count * size
    return found


def main():
    if len(sys.argv) != 2 or sys.argv[1] in ("-h", "--help"):
        sys.exit(__doc__)
    with open(sys.argv[1], "rb") as file:
        data = file.read()
    real = 0
    geoms = set()
    for kind, contents in chunks(data):
        if kind == "header":
            version, _, real, every, length = struct.unpack_from("<5I", contents)
            print("version %d, reals of %d bytes, every %d, ODE: %s" %
                  (version, real, every, contents[20:20 + length].decode()))
        elif kind == "frame":
            collide, = struct.unpack_from("<Q", contents)
            removed, _, changed, moved, resized = lists(contents, real)
            geoms = geoms - set(removed) | {number for number, _ in changed}
            print("collide %d: %d geoms, %d gone, %d new or changed, %d moved" %
                  (collide, len(geoms), len(removed), len(changed), len(moved) + len(resized)))
        elif kind == "pairs":
            print("  %d pairs" % struct.unpack_from("<QQ", contents)[1])


main()
