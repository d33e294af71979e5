"""Vertices of PLY files: ascii, and binary of both byte orders."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from artperl.inputs.bounds import check_count, guard, read_file
from artperl.inputs.text import parse_columns
from artsim.errors import ConfigError

Array = NDArray[np.float64]

_FIX = "save the cloud again, as PLY with x, y, z"
_MOST_HEADER = 100_000
_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass
class _Element:
    name: str
    count: int
    properties: list[tuple[str, str]] = field(default_factory=list)
    has_list: bool = False


def read_ply(path: Path) -> tuple[Array, tuple[str, ...]]:
    """(N, 3) vertices, and what of the file is not used.

    Raises
    ------
    ConfigError
        When the file is no PLY, is cut off, or has no vertices.
    """
    return guard(lambda: _read(path), path, "cloud", _FIX)


def _read(path: Path) -> tuple[Array, tuple[str, ...]]:
    data = read_file(path, "cloud")
    order, elements, start = _header(data, path)
    before = elements[: next((n for n, e in enumerate(elements) if e.name == "vertex"), len(elements))]
    if len(before) == len(elements):
        raise ConfigError("it has no vertices", path, _FIX)
    vertex = elements[len(before)]
    names = [name.lower() for name, _ in vertex.properties]
    if vertex.has_list or not all(axis in names for axis in "xyz"):
        raise ConfigError("its vertices have no plain x, y, z", path, _FIX)
    if any(element.has_list for element in before):
        raise ConfigError("its vertices come after lists", path, "write the vertices first")
    check_count(3 * vertex.count, path, "a cloud")
    columns = [names.index(axis) for axis in "xyz"]
    if order == "":
        if 2 * len(names) * vertex.count - 1 > len(data) - start:  # a digit and a blank for each value
            raise _cut_off(vertex.count, path)
        skipped = sum(element.count for element in before)
        points = parse_columns(data[start:], columns, None, skipped, vertex.count)
    else:
        start += sum(e.count * np.dtype([(n, order + t) for n, t in e.properties]).itemsize for e in before)
        row = np.dtype([(f"{n}", order + kind) for n, (_, kind) in enumerate(vertex.properties)])
        if start + row.itemsize * vertex.count > len(data):
            raise _cut_off(vertex.count, path)
        records = np.frombuffer(data, row, vertex.count, start)
        points = np.empty((vertex.count, 3))
        for n, column in enumerate(columns):
            points[:, n] = records[f"{column}"]
    if len(points) != vertex.count:
        raise _cut_off(vertex.count, path)
    return points, _unused(names, elements)


def _header(data: bytes, path: Path) -> tuple[str, list[_Element], int]:
    """Byte order ("" for ascii), elements, and where the values begin."""
    end = data.find(b"end_header", 0, _MOST_HEADER)
    if not data.startswith(b"ply") or end < 0:
        raise ConfigError("it has no PLY header", path, _FIX)
    start = end + len(b"end_header")
    start += 2 if data[start : start + 2] == b"\r\n" else 1
    order, elements = None, list[_Element]()
    for line in data[:end].decode("latin-1").replace("\r", "\n").split("\n"):
        words = line.split()
        if words[:1] == ["format"] and len(words) == 3:
            order = _ORDERS.get(words[1])
        elif words[:1] == ["element"] and len(words) == 3:
            elements.append(_Element(words[1], int(words[2])))
        elif words[:2] == ["property", "list"] and elements:
            elements[-1].has_list = True
        elif words[:1] == ["property"] and len(words) == 3 and elements:
            elements[-1].properties.append((words[2], _TYPES[words[1]]))
    if order is None or any(element.count < 0 for element in elements):
        raise ConfigError("its PLY header is damaged", path, _FIX)
    return order, elements, start


def _cut_off(count: int, path: Path) -> ConfigError:
    return ConfigError(f"it is cut off: it does not hold its {count:,} vertices", path, "copy or save it again")


def _unused(names: list[str], elements: list[_Element]) -> tuple[str, ...]:
    others = [name for name in names if name not in ("x", "y", "z")]
    notes = [f"not used: {', '.join(others)[:200]}"] if others else []
    if any(element.name == "face" and element.count for element in elements):
        notes.append("it is a mesh: its vertices are the cloud")
    return tuple(notes)
