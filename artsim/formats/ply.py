"""PLY: the clouds of samples, coloured by part, and meshes."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artsim.common.outputs import write_output
from artsim.common.palette import PALETTE
from artsim.datasets.dataset import Dataset
from artsim.datasets.pieces import Output
from artsim.datasets.shards import sample_key
from artsim.formats.base import Piece, PlainFormat
from artsim.model.frame import BACKGROUND
from artsim.observing.sample import Sample

_OTHER = 128
"""Grey of points that belong to no part."""
_TYPES = {"<f4": "float", "|u1": "uchar", "<i4": "int"}
"""What PLY calls NumPy's types."""


class PlyFormat(PlainFormat):
    """``<split>/<index>.ply``: one cloud for each sample, camera frame, metres."""

    def write_samples(self, dataset: Dataset, piece: Piece, samples: Iterable[Sample], output: Output) -> Any:
        """Write one file for each sample."""
        for sample in samples:
            output.write(f"{piece.split}/{sample_key(sample.index)}.ply", cloud_ply(sample))
        return None


def save_ply(sample: Sample, path: str | Path) -> None:
    """Write the cloud of a sample as PLY; see :func:`cloud_ply`.

    Raises
    ------
    ConfigError
        When the file cannot be written.
    """
    write_output(Path(path), cloud_ply(sample))


def cloud_ply(sample: Sample) -> bytes:
    """The cloud of a sample as binary PLY: x, y, z in the camera frame, metres; the part's colour; ``part``."""
    colours = PALETTE[sample.part % len(PALETTE)]
    colours = np.where((sample.part == BACKGROUND)[:, None], np.uint8(_OTHER), colours)  # other things are no part
    return _header("vertex", rows := _vertices(sample.points, colours, sample.part)) + b"end_header\n" + rows.tobytes()


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
