"""A box of 0.1 x 0.2 x 0.3 m as each mesh format has it, for tests that change one thing of it."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np

CORNERS = np.array([[x, y, z] for z in (0, 0.3) for x, y in ((0, 0), (0.1, 0), (0.1, 0.2), (0, 0.2))])
QUADS = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
TRIANGLES = np.array([t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))])
AREA = 0.22

_COLLADA = "http://www.collada.org/2005/11/COLLADASchema"


def obj() -> str:
    vertices = "".join(f"v {x:g} {y:g} {z:g}\n" for x, y, z in CORNERS)
    return vertices + "".join("f " + " ".join(str(i + 1) for i in quad) + "\n" for quad in QUADS)


def primitive(kind: str, *lists: str, count: int = 1, inputs: str = "") -> str:
    """A COLLADA primitive of the box's vertices."""
    vertex = '<input semantic="VERTEX" source="#v" offset="0"/>'
    return f'<{kind} count="{count}">{vertex}{inputs}{"".join(lists)}</{kind}>'


def quads() -> str:
    return primitive(
        "polylist",
        f"<vcount>{'4 ' * 6}</vcount><p>{' '.join(str(i) for quad in QUADS for i in quad)}</p>",
        count=6,
    )


def dae(
    unit: str = "1", up: str = "Z_UP", faces: str = "", nodes: str = "", more: str = "", corners: Any = CORNERS
) -> str:
    numbers = " ".join(f"{value:g}" for value in np.ravel(corners))
    nodes = nodes or '<node><instance_geometry url="#g"/></node>'
    return (
        f'<?xml version="1.0"?><COLLADA xmlns="{_COLLADA}" version="1.4.1"><asset><unit meter="{unit}"/>'
        f'<up_axis>{up}</up_axis></asset><library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" '
        f'count="{np.size(corners)}">{numbers}</float_array><technique_common><accessor source="#a" '
        f'count="{len(corners)}" stride="3"/></technique_common></source><vertices id="v"><input semantic="POSITION" '
        f'source="#p"/></vertices>{faces or quads()}</mesh></geometry></library_geometries>{more}'
        f'<library_visual_scenes><visual_scene id="s">{nodes}</visual_scene></library_visual_scenes>'
        f'<scene><instance_visual_scene url="#s"/></scene></COLLADA>'
    )


POINTS, INDICES = CORNERS.astype("<f4").tobytes(), TRIANGLES.astype("<u2").tobytes()


def gltf(**changes: Any) -> dict[str, Any]:
    """The document of a glTF file whose one buffer is ``POINTS + INDICES``."""
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"byteLength": len(POINTS + INDICES)}],
        "bufferViews": [
            {"buffer": 0, "byteLength": len(POINTS)},
            {"buffer": 0, "byteOffset": len(POINTS), "byteLength": len(INDICES)},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"},
        ],
    } | changes


def glb(document: dict[str, Any], buffer: bytes = POINTS + INDICES) -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    buffer += bytes(-len(buffer) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(buffer), 0x004E4942) + buffer
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def ply() -> str:
    header = (
        "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 6\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = [*("{:g} {:g} {:g}".format(*corner) for corner in CORNERS), *("4 {} {} {} {}".format(*q) for q in QUADS)]
    return header + "\n".join(rows) + "\n"


def stl_text() -> str:
    rows = ["solid box"]
    for triangle in TRIANGLES:
        corners = ["vertex {:g} {:g} {:g}".format(*CORNERS[i]) for i in triangle]
        rows += ["facet normal 0 0 1", "\touter loop", *("  " + corner for corner in corners), "endloop", "endfacet"]
    return "\n".join([*rows, "endsolid box", ""])


def stl_bytes(header: bytes = b"") -> bytes:
    facets = (bytes(12) + CORNERS[t].astype("<f4").tobytes() + bytes(2) for t in TRIANGLES)
    return header.ljust(80) + struct.pack("<I", len(TRIANGLES)) + b"".join(facets)
