"""Vertices of meshes as clouds: OBJ, STL, OFF. Faces, materials and other files are not looked at."""

from __future__ import annotations

import re
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from artperl.inputs.bounds import MAX_TEXT_BYTES, MAX_VERTICES, check_count, guard, read_file
from artperl.inputs.text import parse_columns
from artsim.errors import ConfigError

Array = NDArray[np.float64]

_FIX = "save the cloud as .ply or .npy"
_SAID = ("it is a mesh: its vertices are the cloud",)
_MOST_HEAD = 10_000
_TOO_MANY = f"more than {MAX_VERTICES:,} vertices are not read"
_STL_HEAD, _STL_FACE = 84, 50


def read_obj(path: Path) -> tuple[Array, tuple[str, ...]]:
    """(N, 3) vertices of an OBJ file. Raises ConfigError when a line is no vertex."""

    def read() -> Array:
        data = read_file(path, "cloud", MAX_TEXT_BYTES).replace(b"\r", b"\n")
        return _lines_of(rb"^[ \t]*v[ \t]+([^\n]*)", data)

    points = guard(read, path, "cloud", _FIX)
    return points, _SAID if len(points) else ()


def read_stl(path: Path) -> tuple[Array, tuple[str, ...]]:
    """(N, 3) corners of the triangles of an STL file, each once. Raises ConfigError when it is cut off."""

    def read() -> Array:
        data = read_file(path, "cloud", MAX_TEXT_BYTES)
        faces = int.from_bytes(data[_STL_HEAD - 4 : _STL_HEAD], "little") if len(data) >= _STL_HEAD else 0
        if len(data) == _STL_HEAD + _STL_FACE * faces:
            if 3 * faces > MAX_VERTICES:
                raise ValueError(_TOO_MANY)
            triangles = np.frombuffer(data, np.uint8, offset=_STL_HEAD).reshape(faces, _STL_FACE)[:, 12:48]
            corners = np.ascontiguousarray(triangles).view("<f4").reshape(-1, 3).astype(np.float64)
        else:
            if not data.lstrip().startswith(b"solid"):
                raise ConfigError("it is no STL, or cut off", path, _FIX)
            corners = _lines_of(rb"\bvertex[ \t]+([^\r\n]*)", data)
        return np.unique(corners, axis=0)

    return guard(read, path, "cloud", _FIX), _SAID


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


def _lines_of(pattern: bytes, data: bytes) -> Array:
    """(N, 3) numbers at the beginning of what a pattern finds."""
    found = [match[1] for match in islice(re.finditer(pattern, data, re.MULTILINE), MAX_VERTICES + 1)]
    if len(found) > MAX_VERTICES:
        raise ValueError(_TOO_MANY)
    return parse_columns(b"\n".join(found), [0, 1, 2], None)
