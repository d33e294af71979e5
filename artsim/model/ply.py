"""PLY: clouds coloured by part, and meshes."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artsim.common.palette import PALETTE
from artsim.model.frame import BACKGROUND

_OTHER = 128
"""Grey of points that belong to no part."""
_TYPES = {"<f4": "float", "|u1": "uchar", "<i4": "int"}
"""What PLY calls NumPy's types."""


def cloud_ply(points: NDArray[Any], part: NDArray[np.uint8]) -> bytes:
    """A cloud as binary PLY: x, y, z; the colour of each point's part; ``part``.

    Parameters
    ----------
    points : (N, 3) float
    part : (N,) uint8
    """
    colours = PALETTE[part % len(PALETTE)]
    colours = np.where((part == BACKGROUND)[:, None], np.uint8(_OTHER), colours)  # other things are no part
    return _header("vertex", rows := _vertices(points, colours, part)) + b"end_header\n" + rows.tobytes()


def mesh_ply(vertices: ArrayLike, faces: ArrayLike, colour: ArrayLike) -> bytes:
    """A mesh as binary PLY.

    Parameters
    ----------
    vertices : (V, 3) float
    faces : (F, 3) int
    colour : (3,) int
        Of every vertex, 0 to 255.
    """
    vertices, faces = np.asarray(vertices), np.asarray(faces)
    rows = _vertices(vertices, np.broadcast_to(np.asarray(colour), vertices.shape))
    triangles = np.zeros(len(faces), np.dtype([("count", "u1"), ("corners", "<i4", 3)]))
    triangles["count"], triangles["corners"] = 3, faces
    header = f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n".encode()
    return _header("vertex", rows) + header + rows.tobytes() + triangles.tobytes()


def _vertices(points: NDArray[Any], colours: NDArray[Any], part: NDArray[np.uint8] | None = None) -> NDArray[Any]:
    fields = [(name, "<f4") for name in "xyz"] + [(name, "|u1") for name in ("red", "green", "blue")]
    rows = np.zeros(len(points), np.dtype(fields + ([] if part is None else [("part", "|u1")])))
    for i, (axis, channel) in enumerate(zip("xyz", ("red", "green", "blue"), strict=True)):
        rows[axis], rows[channel] = points[:, i], colours[:, i]
    if part is not None:
        rows["part"] = part
    return rows


def _header(element: str, rows: NDArray[Any]) -> bytes:
    """All of the header but its last line, and other elements."""
    assert rows.dtype.names is not None
    properties = "".join(f"property {_TYPES[rows.dtype[name].str]} {name}\n" for name in rows.dtype.names)
    return f"ply\nformat binary_little_endian 1.0\nelement {element} {len(rows)}\n{properties}".encode()
