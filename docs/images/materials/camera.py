#!/usr/bin/env python3
"""Copies a .glb and gives the copy one camera, which sees all of it from the front, a little from above and the right.

    python3 camera.py MODEL.glb COPY.glb ASPECT

Whatever draws the copy sees the same. Cameras of the model itself are dropped. What is seen are the boxes of
the POSITION accessors, placed by their nodes as they rest.
"""
import json
import math
import struct
import sys

FIELD = 0.7  # of view, radians up and down
FROM = (0.3, 0.2, 1.0)
ROOM = 1.04
SCALES = {5120: 127, 5121: 255, 5122: 32767, 5123: 65535}  # of normalised integers


def chunks_of(data):
    at, out = 12, []
    while at < len(data):
        length, kind = struct.unpack_from("<I4s", data, at)
        out.append((kind, data[at + 8 : at + 8 + length]))
        at += 8 + length
    return out


def product(a, b):
    """Of two 4x4 matrices by columns."""
    return [sum(a[k * 4 + row] * b[col * 4 + k] for k in range(4)) for col in range(4) for row in range(4)]


def matrix_of(node):
    if "matrix" in node:
        return node["matrix"]
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    turn = (
        (1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)),
        (2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)),
        (2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)),
    )
    scale, move = node.get("scale", (1, 1, 1)), node.get("translation", (0, 0, 0))
    columns = [[turn[c][r] * scale[c] for r in range(3)] + [0] for c in range(3)]
    return columns[0] + columns[1] + columns[2] + list(move) + [1]


def box_of(document, primitive):
    accessor = document["accessors"][primitive["attributes"]["POSITION"]]
    unit = SCALES[accessor["componentType"]] if accessor.get("normalized") else 1
    return [[value / unit for value in accessor[end]] for end in ("min", "max")]


def corners(document):
    out = []

    def visit(index, above):
        node = document["nodes"][index]
        world = product(above, matrix_of(node))
        if "mesh" in node:
            for primitive in document["meshes"][node["mesh"]]["primitives"]:
                box = box_of(document, primitive)
                for i in range(8):
                    p = [box[i >> axis & 1][axis] for axis in range(3)] + [1]
                    out.append([sum(world[c * 4 + row] * p[c] for c in range(4)) for row in range(3)])
        for child in node.get("children", ()):
            visit(child, world)

    for root in document["scenes"][document.get("scene", 0)]["nodes"]:
        visit(root, matrix_of({}))
    return out


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def unit(a):
    return [x / math.sqrt(dot(a, a)) for x in a]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def add_camera(document, aspect):
    points = corners(document)
    low, high = ([end(p[axis] for p in points) for axis in range(3)] for end in (min, max))
    centre = [(a + b) / 2 for a, b in zip(low, high)]
    back = unit(FROM)
    right = unit(cross((0, 1, 0), back))
    up = cross(back, right)
    across, along = math.tan(FIELD / 2) * aspect, math.tan(FIELD / 2)
    radius, distance = 0, 0
    for p in points:
        q = [a - b for a, b in zip(p, centre)]
        radius = max(radius, math.sqrt(dot(q, q)))
        distance = max(
            distance, dot(q, back) + abs(dot(q, right)) / across * ROOM, dot(q, back) + abs(dot(q, up)) / along * ROOM
        )
    eye = [c + distance * b for c, b in zip(centre, back)]
    for node in document["nodes"]:
        node.pop("camera", None)
    perspective = {"yfov": FIELD, "aspectRatio": aspect, "znear": distance / 100, "zfar": distance + 10 * radius}
    document["cameras"] = [{"type": "perspective", "perspective": perspective}]
    matrix = right + [0] + up + [0] + back + [0] + eye + [1]
    document["nodes"].append({"name": "camera", "camera": 0, "matrix": matrix})
    document["scenes"][document.get("scene", 0)]["nodes"].append(len(document["nodes"]) - 1)


def main(source, target, aspect):
    with open(source, "rb") as file:
        chunks = chunks_of(file.read())
    document = json.loads(chunks[0][1])
    add_camera(document, float(aspect))
    text = json.dumps(document).encode()
    chunks[0] = (b"JSON", text + b" " * (-len(text) % 4))
    body = b"".join(struct.pack("<I4s", len(data), kind) + data for kind, data in chunks)
    with open(target, "wb") as file:
        file.write(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)


if __name__ == "__main__":
    main(*sys.argv[1:])
