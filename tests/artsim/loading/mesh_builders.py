"""Small mesh files for tests, written by hand, and what their surfaces measure."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np

from artsim.loading.mesh_files import Bounds, read_mesh
from artsim.loading.meshes import LoadLimits

WEDGE = ([[0, 0, 0], [0.1, 0, 0], [0.1, 0.2, 0], [0, 0.2, 0], [0, 0, 0.3], [0.1, 0, 0.3]],
         [[0, 3, 2], [0, 2, 1], [0, 1, 5], [0, 5, 4], [3, 4, 5], [3, 5, 2], [0, 4, 3], [1, 2, 5]])  # fmt: skip
"""Vertices and triangles of a closed wedge, 0.1 x 0.2 x 0.3."""

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
NOTCHED = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\n"
"""A square of side 4 with a notch down to (2, 1): area 10."""


def read(content: bytes | str, kind: str) -> tuple[np.ndarray, np.ndarray, str]:
    """Vertices, triangles and everything that is said of a mesh file."""
    data = content.encode() if isinstance(content, str) else content
    vertices, faces, notes = triangles(data, kind, Path(f"m{kind}"))
    return vertices, faces, "\n".join(notes)


def triangles(data: bytes, kind: str, where: Path) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    """Vertices, triangles and what is said of a mesh file, each by itself."""
    surface = read_mesh(data, kind, Bounds(where, LoadLimits().max_faces))
    return surface.vertices, surface.faces, surface.notes


def area(vertices: np.ndarray, faces: np.ndarray) -> float:
    """Of a surface."""
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    """Within a closed surface that faces outwards."""
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    return float(np.einsum("ni,ni->", a, np.cross(b, c)) / 6.0)


def numbers(values: Any) -> str:
    """As text."""
    return " ".join(f"{v:g}" for v in np.ravel(values))


def dae_geometry(name: str, vertices: Any, primitives: str) -> str:
    """A ``<geometry>`` whose primitives name the vertices ``#v-NAME``."""
    flat = np.ravel(vertices)
    return (
        f'<geometry id="{name}"><mesh><source id="p-{name}"><float_array id="a-{name}" count="{len(flat)}">'
        f"{numbers(flat)}</float_array><technique_common>"
        f'<accessor source="#a-{name}" count="{len(flat) // 3}" stride="3"><param name="X"/><param name="Y"/>'
        f'<param name="Z"/></accessor></technique_common></source><vertices id="v-{name}">'
        f'<input semantic="POSITION" source="#p-{name}"/></vertices>{primitives}</mesh></geometry>'
    )


def dae_triangles(name: str, faces: Any, tag: str = "triangles", before: str = "") -> str:
    """A primitive of a geometry; ``before`` stands before its list, such as ``<vcount>``."""
    corners = np.ravel(faces)
    return (
        f'<{tag} count="{len(faces)}"><input semantic="VERTEX" source="#v-{name}" offset="0"/>{before}'
        f"<p>{numbers(corners)}</p></{tag}>"
    )


WEDGE_DAE = dae_geometry("g", WEDGE[0], dae_triangles("g", WEDGE[1]))
SHOWN = '<node id="n"><instance_geometry url="#g"/></node>'


def dae(geometries: str = WEDGE_DAE, scene: str = SHOWN, asset: str = "", libraries: str = "") -> str:
    """A COLLADA document."""
    return (
        '<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
        f"<asset>{asset}</asset><library_geometries>{geometries}</library_geometries>{libraries}"
        f'<library_visual_scenes><visual_scene id="s">{scene}</visual_scene></library_visual_scenes>'
        '<scene><instance_visual_scene url="#s"/></scene></COLLADA>'
    )


def gltf(*arrays: np.ndarray, as_value: bool = False, **members: Any) -> Any:
    """A glTF document that shows mesh 0; each array becomes an accessor of its own."""
    views, accessors, content = [], [], b""
    kinds = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
    for array in arrays:
        content += bytes(-len(content) % 4)
        views.append({"buffer": 0, "byteOffset": len(content), "byteLength": array.nbytes})
        width = 1 if array.ndim == 1 else array.shape[1]
        accessors.append({
            "bufferView": len(views) - 1, "componentType": kinds[array.dtype.str[1:]], "count": len(array),
            "type": "SCALAR" if width == 1 else f"VEC{width}",
        })  # fmt: skip
        content += array.tobytes()
    uri = "data:application/octet-stream;base64," + base64.b64encode(content).decode()
    document: dict[str, Any] = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(content), "uri": uri}],
    }  # fmt: skip
    document.update(members)
    return document if as_value else json.dumps(document)


POINTS = np.array(WEDGE[0], "<f4")
CORNERS = np.ravel(WEDGE[1]).astype("<u2")


def urdf(mesh: str, count: int = 1, scale: str = "") -> str:
    """An object of a box and of a part that shows a mesh."""
    shape = f'<visual><geometry><mesh filename="{mesh}"{scale}/></geometry></visual>' * count
    return two_parts(shape)


def two_parts(visuals: str) -> str:
    """An object of a box and of a part with some visuals."""
    return (
        '<robot name="r"><link name="a"><visual><geometry><box size="1 1 1"/></geometry></visual></link>'
        f'<link name="b">{visuals}</link><joint name="j" type="revolute"><parent link="a"/><child link="b"/>'
        '<axis xyz="0 0 1"/><limit lower="0" upper="1"/></joint></robot>'
    )
