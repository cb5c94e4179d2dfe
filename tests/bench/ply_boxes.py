#!/usr/bin/env python3
"""Writes boxes of a mesh that moves, from two frames in PLY, such as the first two of a scene of the Scalable-CCD data:

    tests/bench/ply_boxes.py FIRST.ply SECOND.ply DIR/NAME      NAME-vertices.f64, NAME-edges.f64 and NAME-faces.f64

Each box holds what moves in a straight line between the frames, a double further out. Needs python3-plyfile.
"""
import sys

import numpy
from plyfile import PlyData


def main(first, second, name):
    frames = [PlyData.read(path) for path in (first, second)]
    places = [numpy.stack([frame["vertex"][axis] for axis in "xyz"], axis=1).astype(float) for frame in frames]
    faces, others = (numpy.stack(frame["face"].data[frame["face"].properties[0].name]) for frame in frames)
    if len(places[0]) != len(places[1]) or not numpy.array_equal(faces, others):
        sys.exit("%s: another mesh than %s" % (second, first))
    edges = numpy.unique(numpy.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    vertices = numpy.arange(len(places[0])).reshape(-1, 1)
    for kind, corners in ("vertices", vertices), ("edges", edges), ("faces", faces):
        both = numpy.concatenate([place[corners] for place in places], axis=1)
        bounds = numpy.nextafter(both.min(axis=1), -numpy.inf), numpy.nextafter(both.max(axis=1), numpy.inf)
        numpy.concatenate(bounds, axis=1).astype("<f8").tofile("%s-%s.f64" % (name, kind))


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
