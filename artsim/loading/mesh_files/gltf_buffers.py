"""The JSON values of a glTF file, and the numbers in its buffers: every size is checked before it is used."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from artsim.loading.mesh_files.surface import Array, Bounds, Draft, UnusableMeshError, quote_name

_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_MAX_ZEROS = 1000
"""Positions for each that a sparse accessor lists; the others are 0, which few can be."""

_TOLERANCE = 1e-3
"""Programs write bounds in a few digits; vertices that are lost change them more."""


@dataclass(frozen=True)
class Items:
    """An object out of JSON, whose members are asked for by the kind that they must have."""

    value: dict[str, Any]

    def object(self, name: str) -> Items:
        """A member that is an object; an empty one where there is none."""
        return Items(_of_kind(self.value.get(name, {}), dict, name))

    def array(self, name: str) -> list[Any]:
        """A member that is an array; an empty one where there is none."""
        return list(_of_kind(self.value.get(name, []), list, name))

    def list(self, name: str) -> list[Items]:
        """A member that is an array of objects."""
        return [Items(_of_kind(item, dict, name)) for item in _of_kind(self.value.get(name, []), list, name)]


def _of_kind(value: Any, kind: type, name: str) -> Any:
    if not isinstance(value, kind):
        raise UnusableMeshError(f"its {name!r} is no {'object' if kind is dict else 'array'}")
    return value


def integer(value: Any, below: int) -> int:
    """A whole number from 0.

    Raises
    ------
    UnusableMeshError
        When it is none, or too large.
    """
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < below:
        raise UnusableMeshError(f"holds {quote_name(value)} where a number from 0 to {below - 1} belongs")
    return value


class Buffers:
    """Accessors of a glTF file, each read when first asked for.

    Parameters
    ----------
    document : Items
    chunk : bytes, optional
        What a ``.glb`` file holds besides its JSON: its first buffer.
    neighbour : callable
        Gives the bytes of a file that the document names.
    bounds : Bounds
    """

    def __init__(self, document: Items, chunk: bytes | None, neighbour: Callable[[str], bytes], bounds: Bounds):
        self._chunk, self._neighbour, self._bounds = chunk, neighbour, bounds
        self._accessors = document.list("accessors")
        self._views = document.list("bufferViews")
        self._files = document.list("buffers")
        self._contents: dict[int, bytes] = {}
        self._points: dict[int, Array] = {}

    def count(self, number: Any) -> int:
        """How many items an accessor declares."""
        accessor = self._accessors[integer(number, len(self._accessors))]
        return integer(accessor.value.get("count"), 2**53)

    def points(self, number: Any, label: str, draft: Draft) -> Array:
        """(V, 3) positions of an accessor, compared with the bounds that it declares."""
        number = integer(number, len(self._accessors))
        if number not in self._points:
            accessor = self._accessors[number]
            listed = (
                self.count(number) if "bufferView" in accessor.value else accessor.object("sparse").value.get("count")
            )
            if not isinstance(listed, int) or self.count(number) > _MAX_ZEROS * listed:
                raise UnusableMeshError(f"{label} has positions without data")
            points = self._points[number] = self.values(number, 3)
            self._compare(points, accessor, label, draft)
        return self._points[number]

    def _compare(self, points: Array, accessor: Items, label: str, draft: Draft) -> None:
        declared = [accessor.array(name) for name in ("min", "max")]
        plain = all(len(d) == 3 and all(isinstance(v, int | float) for v in d) for d in declared)
        if not plain or accessor.value.get("normalized") or len(points) == 0:
            return
        low, high = np.array(declared, np.float64)
        found = np.stack([points.min(axis=0), points.max(axis=0)])
        size = max(float((high - low).max()), float((found[1] - found[0]).max()))
        if not (np.abs(found - [low, high]) <= _TOLERANCE * size).all():
            draft.note(f"{label}: its vertices are not where its file says that they are")

    def values(self, number: Any, width: int) -> Array:
        """(N, width) numbers of an accessor.

        Raises
        ------
        UnusableMeshError
            When it lies outside its buffer or is of another width.
        AssetError
            When it is over the bounds.
        """
        accessor = self._accessors[integer(number, len(self._accessors))]
        kind, count = accessor.value.get("componentType"), self.count(number)
        if (
            not isinstance(kind, int)
            or kind not in _COMPONENTS
            or _WIDTHS.get(str(accessor.value.get("type"))) != width
        ):
            raise UnusableMeshError(f"accessor {number} is not of a kind that belongs here")
        self._bounds.check(count // (3 if width == 1 else 1), "vertices" if width > 1 else "triangles")
        component = np.dtype(_COMPONENTS[kind])
        if "bufferView" in accessor.value:
            found = self._items(accessor, accessor.value["bufferView"], component, width, count)
        else:
            found = np.zeros((count, width), component)
        if "sparse" in accessor.value:
            found = self._sparse(accessor.object("sparse"), found, component)
        if accessor.value.get("normalized") is True and component.kind != "f":
            return np.maximum(found / float(np.iinfo(component).max), -1.0)
        return found.astype(np.float64)

    def _sparse(self, sparse: Items, found: np.ndarray, component: np.dtype[Any]) -> np.ndarray:
        """The items of an accessor with those replaced that it lists one by one."""
        count = integer(sparse.value.get("count"), len(found) + 1)
        at, to = sparse.object("indices"), sparse.object("values")
        kind = at.value.get("componentType")
        if kind not in (5121, 5123, 5125):
            raise UnusableMeshError("sparse indices are of no known kind")
        places = self._items(at, at.value.get("bufferView"), np.dtype(_COMPONENTS[kind]), 1, count, packed=True).ravel()
        if count and int(places.max()) >= len(found):
            raise UnusableMeshError("a sparse index is out of range")
        values = self._items(to, to.value.get("bufferView"), component, found.shape[1], count, packed=True)
        found = found.copy()
        found[places] = values
        return found

    def _items(
        self, where: Items, view_number: Any, component: np.dtype[Any], width: int, count: int, packed: bool = False
    ) -> np.ndarray:
        """(count, width) raw numbers in a view of a buffer."""
        view = self._views[integer(view_number, len(self._views))]
        if "EXT_meshopt_compression" in view.object("extensions").value:
            raise UnusableMeshError("needs the glTF extension 'EXT_meshopt_compression', which is not read")
        content = self._content(integer(view.value.get("buffer"), len(self._files)))
        start = integer(view.value.get("byteOffset", 0), 2**53)
        length = integer(view.value.get("byteLength"), 2**53)
        if start + length > len(content):
            raise UnusableMeshError("a buffer view ends after its buffer")
        size = component.itemsize * width
        stride = size if packed else integer(view.value.get("byteStride", size), 2**16) or size
        offset = integer(where.value.get("byteOffset", 0), 2**53)
        if count == 0:
            return np.zeros((0, width), component)
        if offset + stride * (count - 1) + size > length:
            raise UnusableMeshError(f"an accessor of {count} items ends after its buffer view")
        return np.ndarray((count, width), component, content, start + offset, strides=(stride, component.itemsize))

    def _content(self, number: int) -> bytes:
        if number not in self._contents:
            self._contents[number] = self._read(number)
        return self._contents[number]

    def _read(self, number: int) -> bytes:
        buffer = self._files[number]
        uri, length = buffer.value.get("uri"), integer(buffer.value.get("byteLength"), 2**53)
        if uri is None:
            if number != 0 or self._chunk is None:
                raise UnusableMeshError(f"buffer {number} has no data")
            content = self._chunk
        elif not isinstance(uri, str):
            raise UnusableMeshError(f"buffer {number} has no address")
        elif uri.startswith("data:"):
            content = _data_uri(uri)
        else:
            content = self._neighbour(uri)
        if len(content) < length:
            raise UnusableMeshError(f"buffer {number} declares {length} bytes, but holds {len(content)}")
        return content[:length]


def _data_uri(uri: str) -> bytes:
    head, _, body = uri.partition(",")
    if not head.endswith(";base64"):
        raise UnusableMeshError("a buffer is data in an encoding that is not read")
    try:
        return base64.b64decode(body, validate=True)
    except (binascii.Error, ValueError) as error:
        raise UnusableMeshError(f"a buffer is not in base64 ({error})") from error
