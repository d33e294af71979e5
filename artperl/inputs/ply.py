"""Vertices of PLY files: ascii, and binary of both byte orders."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from artperl.inputs.bounds import check_count, guard, read_file
from artperl.inputs.text import parse_columns
from artsim.errors import ConfigError
from artsim.loading.mesh_files.ply import Element, read_header

Array = NDArray[np.float64]

_FIX = "save the cloud again, as PLY with x, y, z"


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
    order, elements, start = read_header(data)
    before = elements[: next((n for n, e in enumerate(elements) if e.name == "vertex"), len(elements))]
    if len(before) == len(elements):
        raise ConfigError("it has no vertices", path, _FIX)
    vertex = elements[len(before)]
    names = [each.name.lower() for each in vertex.properties]
    if _has_list(vertex) or not all(axis in names for axis in "xyz"):
        raise ConfigError("its vertices have no plain x, y, z", path, _FIX)
    if any(map(_has_list, before)):
        raise ConfigError("its vertices come after lists", path, "write the vertices first")
    check_count(3 * vertex.count, path, "a cloud")
    columns = [names.index(axis) for axis in "xyz"]
    if order == "":
        if 2 * len(names) * vertex.count - 1 > len(data) - start:  # a digit and a blank for each value
            raise _cut_off(vertex.count, path)
        skipped = sum(element.count for element in before)
        points = parse_columns(data[start:], columns, None, skipped, vertex.count)
    else:
        start += sum(element.count * element.least_bytes for element in before)
        row = np.dtype([(f"{n}", order + each.type) for n, each in enumerate(vertex.properties)])
        if start + row.itemsize * vertex.count > len(data):
            raise _cut_off(vertex.count, path)
        records = np.frombuffer(data, row, vertex.count, start)
        points = np.empty((vertex.count, 3))
        for n, column in enumerate(columns):
            points[:, n] = records[f"{column}"]
    if len(points) != vertex.count:
        raise _cut_off(vertex.count, path)
    return points, _unused(names, elements)


def _has_list(element: Element) -> bool:
    return any(each.count_type is not None for each in element.properties)


def _cut_off(count: int, path: Path) -> ConfigError:
    return ConfigError(f"it is cut off: it does not hold its {count:,} vertices", path, "copy or save it again")


def _unused(names: list[str], elements: list[Element]) -> tuple[str, ...]:
    others = [name for name in names if name not in ("x", "y", "z")]
    notes = [f"not used: {', '.join(others)[:200]}"] if others else []
    if any(element.name == "face" and element.count for element in elements):
        notes.append("it is a mesh: its vertices are the cloud")
    return tuple(notes)
