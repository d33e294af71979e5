"""PLY: a header that says what follows, then rows of numbers in text or in bytes."""

import re
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artsim.loading.mesh_files.polygons import strips, triangulate
from artsim.loading.mesh_files.surface import Array, Bounds, Draft, Indices, Surface, UnusableMeshError, quote_name
from artsim.loading.mesh_files.text import numbers

_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "int64": "i8", "uint64": "u8", "float": "f4", "double": "f8", "float32": "f4", "float64": "f8",
}  # fmt: skip
_CODES = dict(zip(("i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f8"), "bBhHiIqQd", strict=True))
"""What the lengths of lists are called by :mod:`struct`."""
_MAX_HEADER = 100_000
_MAX_LISTS = 2_000_000
"""Lists that are read one by one, in some 0.2 microseconds each."""

_CUT_OFF = "ends before what its header declares"
_ORDER = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_CORNERS = ("vertex_indices", "vertex_index")


@dataclass
class Property:
    """One column of an element: numbers of a type, or lists of them."""

    name: str
    type: str
    count_type: str | None = None

    @property
    def size(self) -> int:
        """Bytes of a value."""
        return np.dtype(self.type).itemsize

    @property
    def head(self) -> int:
        """Bytes of a list's length; 0 where it is no list."""
        return np.dtype(self.count_type).itemsize if self.count_type else 0


@dataclass
class Element:
    """One table of a PLY file."""

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)

    @property
    def least(self) -> int:
        """Bytes that a row has at least."""
        return sum(p.head or p.size for p in self.properties)


@dataclass
class _Lists:
    """A column of lists: how long each is, and all their values."""

    counts: Indices
    values: Indices


def read_ply(data: bytes, bounds: Bounds) -> Surface:
    """The surface of a PLY file, its faces and triangle strips; raises as ``read_mesh``."""
    tables = Tables(data)
    draft = Draft(declared=sum(e.count for e in tables.elements if e.name == "face"))
    for element in tables.elements:
        if element.name in ("vertex", "face", "tristrips"):
            bounds.check(element.count, "vertices" if element.name == "vertex" else "triangles")
    # Every table is read, because what is not wanted of it must be skipped.
    found = {element.name: tables.read(element) for element in tables.elements}
    points = _points(found.get("vertex", {}))
    if "face" in found:
        _add_faces(found["face"], points, bounds, draft)
    if "tristrips" in found:
        _add_strips(found["tristrips"], points, bounds, draft)
    if tables.left:
        draft.note(f"has {tables.left} more than its header declares")
    return draft.surface()


def read_header(data: bytes) -> tuple[str, list[Element], int]:
    """Byte order ("" for text), elements, and where their values begin; raises UnusableMeshError."""
    found = re.search(rb"(?:^|[\r\n])end_header[ \t]*(\r\n|\r|\n)", data[:_MAX_HEADER])
    if not data.startswith(b"ply") or found is None:
        raise UnusableMeshError("has no PLY header")
    order: str | None = None
    elements: list[Element] = []
    for row in re.split(rb"[\r\n]+", data[: found.start()])[1:]:
        words = row.decode("ascii", "replace").split()
        match words:
            case ["format", kind, *_] if kind in _ORDER:
                order = _ORDER[kind]
            case ["element", name, count] if count.isdecimal() and len(count) < 19:
                elements.append(Element(name, int(count)))
            case ["property", "list", count_type, kind, name] if (
                elements and kind in _TYPES and _TYPES.get(count_type, "f")[0] != "f"
            ):
                elements[-1].properties.append(Property(name, _TYPES[kind], _TYPES[count_type]))
            case ["property", kind, name] if elements and kind in _TYPES:
                elements[-1].properties.append(Property(name, _TYPES[kind]))
            case [] | ["comment" | "obj_info", *_]:
                pass
            case _:
                raise UnusableMeshError(f"its header says {quote_name(' '.join(words))}, which is not understood")
    if order is None:
        raise UnusableMeshError("its header names no format that is read")
    names = [element.name for element in elements]
    if len(set(names)) < len(names):
        raise UnusableMeshError("its header declares an element twice")
    return order, elements, found.end()


class Tables:
    """The tables of a PLY file, to be read one after another.

    Attributes
    ----------
    elements : list of Element
        What the header declares.
    is_text : bool

    Raises
    ------
    UnusableMeshError
        When there is no such header, or the file does not hold what it declares.
    """

    def __init__(self, data: bytes):
        self._order, self.elements, self._at = read_header(data)
        self._data: bytes | memoryview = data
        self.is_text = self._order == ""
        if self.is_text:
            # Text becomes bytes: doubles, one after another. Rows, not numbers, are what PLY declares; but no file is
            # known whose rows span lines.
            self._data = numbers(data[self._at :], np.float64, np.nan).view(np.uint8).data
            self._order, self._at = "<", 0
            for p in (p for element in self.elements for p in element.properties):
                p.type, p.count_type = "f8", "f8" if p.count_type else None
        room = len(self._data) - self._at
        for element in self.elements:
            if element.count and (element.least == 0 or element.count * element.least > room):
                raise UnusableMeshError(
                    f"declares {element.count} rows of {quote_name(element.name)}, more than its bytes can hold"
                )

    @property
    def left(self) -> str:
        """What is not read yet, for messages; empty where all of it is."""
        count = (len(self._data) - self._at) // (8 if self.is_text else 1)
        return f"{count} {'numbers' if self.is_text else 'bytes'}" if count else ""

    def read(self, element: Element) -> dict[str, Any]:
        """The columns of the next table, by their names: arrays of numbers, or lists."""
        if element.count == 0:
            return {}
        _, (lengths,), _ = self._walk(element, 1)
        lists = {i: n for i, n in enumerate(lengths.tolist()) if element.properties[i].count_type}
        columns: list[tuple[Any, ...]] = []
        for i, p in enumerate(element.properties):
            columns += [(f"n{i}", self._order + p.count_type)] if p.count_type else []
            columns.append((f"v{i}", self._order + p.type, (lists[i],) if i in lists else ()))
        row = np.dtype(columns)
        if row.itemsize * element.count <= len(self._data) - self._at:  # mostly all rows are as long as the first
            block = np.frombuffer(self._data, row, element.count, self._at)
            if all((block[f"n{i}"] == n).all() for i, n in lists.items()):
                self._at += row.itemsize * element.count
                return {
                    p.name: _Lists(np.full(element.count, lists[i]), _whole(block[f"v{i}"].ravel()))
                    if i in lists
                    else block[f"v{i}"]
                    for i, p in enumerate(element.properties)
                }
        starts, counts, self._at = self._walk(element, element.count)
        return {p.name: self._column(p, starts[:, i], counts[:, i]) for i, p in enumerate(element.properties)}

    def _walk(self, element: Element, rows: int) -> tuple[Indices, Indices, int]:
        """Where the columns of rows are, which may differ in length.

        Returns
        -------
        starts, counts : (rows, columns) int
            Where the values of each column start, and how many there are.
        int
            Place after the rows.
        """
        end = len(self._data)
        lists = [bool(p.count_type) for p in element.properties]
        if rows * sum(lists) > _MAX_LISTS:
            raise UnusableMeshError(f"has over {_MAX_LISTS} lists of different lengths")
        if rows * element.least > end - self._at:
            raise UnusableMeshError(_CUT_OFF)
        # Bytes up to each list, and after the last one: rows are walked in a loop, which is to do little.
        steps: list[tuple[int, int, int, Callable[..., tuple[Any, ...]]]] = []
        skip = 0
        for p in element.properties:
            if p.count_type:
                steps.append((skip, p.head, p.size, struct.Struct(self._order + _CODES[p.count_type]).unpack_from))
                skip = 0
            else:
                skip += p.size
        found: list[int] = []
        data, at = self._data, self._at
        for _ in range(rows if steps else 0):
            for before, head, size, unpack in steps:
                at += before
                declared = unpack(data, at)[0] if at + head <= end else -1
                count = int(declared) if 0 <= declared <= end - at else -1
                if count != declared or count < 0:
                    raise UnusableMeshError("has a list that ends after the file, or whose length is no whole number")
                found.append(count)
                at += head + count * size
            at += skip
        at = at if steps else at + rows * skip
        if at > end:
            raise UnusableMeshError(_CUT_OFF)
        counts = np.ones((rows, len(lists)), np.int64)
        counts[:, lists] = np.array(found, np.int64).reshape(rows, sum(lists))
        heads, sizes = (np.array([getattr(p, name) for p in element.properties]) for name in ("head", "size"))
        ends = self._at + np.cumsum(counts * sizes + heads).reshape(rows, -1)
        return ends - counts * sizes, counts, at

    def _column(self, p: Property, starts: Indices, counts: Indices) -> Any:
        """The values of a column that start at given places."""
        within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        places = np.repeat(starts, counts) + p.size * within
        every = np.ndarray((len(self._data) - p.size + 1,), self._order + p.type, self._data, strides=(1,))
        return _Lists(counts, _whole(every[places])) if p.count_type else every[places]


def _whole(values: NDArray[Any]) -> Indices:
    """Whole numbers of vertices; -2 where a value is none (-1 ends a strip)."""
    if values.dtype.kind in "iu" and values.dtype.itemsize < 8:
        return values.astype(np.int64)
    with np.errstate(invalid="ignore"):
        fit = (values >= -1) & (values < 2**53)
        return np.where(fit & (values == np.floor(values)), np.where(fit, values, 0).astype(np.int64), -2)


def _points(table: dict[str, Any]) -> Array:
    if any(not isinstance(table.get(axis), np.ndarray) for axis in "xyz"):
        raise UnusableMeshError("has no vertices with x, y and z")
    return np.stack([np.asarray(table[axis], np.float64) for axis in "xyz"], axis=1)


def _corners(table: dict[str, Any]) -> _Lists:
    found = next((table[name] for name in _CORNERS if isinstance(table.get(name), _Lists)), None)
    if found is None:
        if not table:
            return _Lists(np.zeros(0, np.int64), np.zeros(0, np.int64))
        raise UnusableMeshError(f"its faces have no list named {' or '.join(_CORNERS)}")
    return found


def _add_faces(table: dict[str, Any], points: Array, bounds: Bounds, draft: Draft) -> None:
    lists = _corners(table)
    bounds.check(len(lists.values) - 2 * len(lists.counts), "triangles")
    made = triangulate(points, lists.values, lists.counts)
    draft.accounted += len(lists.counts)
    made.tell(draft)
    draft.add(points, lists.values[made.corners])


def _add_strips(table: dict[str, Any], points: Array, bounds: Bounds, draft: Draft) -> None:
    """Strips of triangles, each ended by -1 or by its list's end."""
    lists = _corners(table)
    bounds.check(len(lists.values), "triangles")
    runs = np.insert(lists.values, np.cumsum(lists.counts), -1)
    draft.add(points, strips(runs))
