"""Vertices of meshes as clouds: OBJ, STL, OFF, PLY. Faces, materials and other files are not looked at."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from artperl.inputs.bounds import MAX_TEXT_BYTES, MAX_VERTICES, check_count, guard, read_file
from artperl.inputs.text import parse_columns
from artsim.errors import AssetError, ConfigError
from artsim.loading.mesh_files import Bounds
from artsim.loading.mesh_files.obj import read_vertices
from artsim.loading.mesh_files.ply import Tables, read_header
from artsim.loading.mesh_files.stl import read_stl as read_triangles

Array = NDArray[np.float64]

_FIX = "save the cloud as .ply or .npy"
_SAID = ("it is a mesh: its vertices are the cloud",)
_MOST_HEAD = 10_000


def read_obj(path: Path) -> tuple[Array, tuple[str, ...]]:
    """(N, 3) vertices of an OBJ file. Raises ConfigError when a vertex is no three numbers."""

    def read(data: bytes, bounds: Bounds) -> Array:
        return _numbers(read_vertices(data, bounds), data)

    points = _read(path, read)
    return points, _SAID if len(points) else ()


def _numbers(points: Array, data: bytes) -> Array:
    """Points of a text, in which no word is anything else than a number."""
    if np.isnan(points).any() and b"nan" not in data.lower():
        raise ValueError("a vertex is no three numbers")
    return points


def read_ply(path: Path) -> tuple[Array, tuple[str, ...]]:
    """(N, 3) vertices of a PLY file, and what of it is not used. Raises ConfigError when it is cut off."""

    def read() -> tuple[Array, tuple[str, ...]]:
        data = read_file(path, "cloud")
        order, elements, _ = read_header(data)
        if order == "" and len(data) > MAX_TEXT_BYTES:
            raise ValueError(f"more than {MAX_TEXT_BYTES // 1_000_000} MB of text are not read")
        check_count(3 * sum(element.count for element in elements if element.name == "vertex"), path, "a cloud")
        tables = Tables(data)
        found = {element.name: tables.read(element) for element in tables.elements}
        if order == "" and tables.left:
            raise ValueError(f"it has {tables.left} more than its header declares")
        vertex = {name.lower(): values for name, values in found.get("vertex", {}).items()}
        points = [vertex.pop(axis) for axis in "xyz" if isinstance(vertex.get(axis), np.ndarray)]
        if len(points) < 3:
            raise ConfigError("it has no vertices with x, y, z", path, _FIX)
        cloud = np.stack(points, axis=1).astype(np.float64)
        others = (f"not used: {', '.join(vertex)[:200]}",) if vertex else ()
        return _numbers(cloud, data) if order == "" else cloud, others + (_SAID if found.get("face") else ())

    return guard(read, path, "cloud", _FIX)


def read_stl(path: Path) -> tuple[Array, tuple[str, ...]]:
    """(N, 3) corners of the triangles of an STL file, each once. Raises ConfigError when it is cut off."""
    return _read(path, lambda data, bounds: np.unique(read_triangles(data, bounds).vertices, axis=0)), _SAID


def _read(path: Path, read: Callable[[bytes, Bounds], Array]) -> Array:
    """What one of artsim's readers of meshes finds."""

    def find() -> Array:
        try:
            return read(read_file(path, "cloud", MAX_TEXT_BYTES), Bounds(path, MAX_VERTICES))
        except AssetError as error:
            raise ValueError(f"more than {MAX_VERTICES:,} vertices are not read") from error

    points: Array = guard(find, path, "cloud", _FIX)
    return points


def read_off(path: Path) -> tuple[Array, tuple[str, ...]]:
    """(N, 3) vertices of an OFF file. Raises ConfigError when it is no text, or cut off."""

    def read() -> Array:
        data = read_file(path, "cloud", MAX_TEXT_BYTES)
        # Counts stand in the first line, after OFF, or in the next one that is no comment.
        found = re.match(
            rb"\s*(?:[A-Z0-9]{0,4}OFF)?(?:\s|#[^\r\n]*[\r\n])*(\d{1,9})\s+(\d{1,12})\b[^\r\n]*", data[:_MOST_HEAD]
        )
        if found is None:
            raise ConfigError("it has no OFF header", path, _FIX)
        count, rest = int(found[1]), data[found.end() :]
        if 6 * count - 1 > len(rest):
            raise ConfigError(f"it is cut off: it does not hold its {count:,} vertices", path, _FIX)
        check_count(3 * count, path, "a mesh")
        points = parse_columns(rest, [0, 1, 2], None, 0, count) if count else np.zeros((0, 3))
        if len(points) != count:
            raise ConfigError(f"it is cut off: it does not hold its {count:,} vertices", path, _FIX)
        return points

    return guard(read, path, "cloud", _FIX), _SAID
