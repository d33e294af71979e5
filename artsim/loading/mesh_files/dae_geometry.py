"""The triangles of one ``<geometry>`` of a COLLADA file."""

from dataclasses import dataclass

import numpy as np
from lxml import etree

from artsim.loading.mesh_files.dae_document import Document, array, attribute, integers
from artsim.loading.mesh_files.polygons import divide_with_holes, fans, strips, triangulate
from artsim.loading.mesh_files.surface import Array, Bounds, Draft, Indices, UnusableMeshError, join_pieces, quote_name

_NOT_READ = ("lines", "linestrips", "points")
_PRIMITIVES = ("triangles", "polylist", "polygons", "trifans", "tristrips")
_MAX_STRIDE = 256
_MAX_HOLES = 5e5
"""Corners of polygons with holes in one geometry: each polygon is divided by a call of its own."""


@dataclass(frozen=True)
class Geometry:
    """(V, 3) vertices and (F, 3) triangles."""

    vertices: Array
    faces: Indices


@dataclass(frozen=True)
class _Corners:
    """How the corners of a primitive are numbered."""

    points: Array
    stride: int
    offset: int

    def of(self, element: etree._Element | None) -> Indices:
        """The vertex of each corner in a list; numbers that are left over count as a corner that is missing."""
        found = integers(element)
        over = len(found) % self.stride
        if over:
            found = np.append(found, np.full(self.stride - over, -1))
        return found[self.offset :: self.stride]


def read_geometry(element: etree._Element, document: Document, bounds: Bounds, draft: Draft) -> Geometry | None:
    """All triangles of a geometry, or None where it has none; says what is left out."""
    name = f"geometry {quote_name(attribute(element))}"
    mesh = element.find("mesh")
    if mesh is None:
        kind = element[0].tag if len(element) else "nothing"
        draft.note(f"{name} is of a kind that is not read ({quote_name(kind)}): left out")
        return None
    said = Draft()
    pieces: list[tuple[Array, Indices]] = []
    for primitive in mesh:
        if primitive.tag in _NOT_READ:
            said.note(f"{primitive.tag} left out")
        elif primitive.tag in _PRIMITIVES:
            document.num_primitives += 1
            bounds.check_pieces(document.num_primitives)
            try:
                corners = _corners(primitive, document)
                faces = _faces(primitive, corners, bounds, said)
            except UnusableMeshError as problem:
                said.note(f"<{primitive.tag}> left out: {problem}")
                continue
            pieces.append((corners.points, faces))
    for text in said.notes:
        draft.note(f"{name}: {text}")
    if not pieces:
        draft.note(f"{name} has no faces")
        return None
    # Copies of a geometry must not multiply vertices that nothing shows.
    return Geometry(*join_pieces(pieces))


def _corners(primitive: etree._Element, document: Document) -> _Corners:
    inputs = primitive.findall("input")
    offsets = [_natural(i, "offset", 0) for i in inputs]
    vertex = next((i for i in inputs if i.get("semantic") == "VERTEX"), None)
    position = vertex
    if vertex is not None:
        vertices = document.find(vertex.get("source"))
        found = [] if vertices is None else vertices.findall("input")
        position = next((i for i in found if i.get("semantic") == "POSITION"), None)
    source = None if position is None else document.find(position.get("source"))
    if vertex is None or source is None:
        raise UnusableMeshError("it has no positions")
    if max(offsets) >= _MAX_STRIDE:
        raise UnusableMeshError(f"it declares {max(offsets)} numbers a corner")
    return _Corners(_points(source, document), max(offsets) + 1, _natural(vertex, "offset", 0))


def _natural(element: etree._Element, name: str, default: int) -> int:
    text = element.get(name)
    if text is None:
        return default
    if not text.strip().isdecimal() or len(text) > 12:
        raise UnusableMeshError(f"{name} {quote_name(text)} of its <{element.tag}> is no number")
    return int(text)


def _points(source: etree._Element, document: Document) -> Array:
    """(V, 3) positions of a source, each array read once."""
    if source not in document.points:
        document.points[source] = _read_points(source, document)
    return document.points[source]


def _read_points(source: etree._Element, document: Document) -> Array:
    accessor = source.find("technique_common/accessor")
    numbers = source.find("float_array") if accessor is None else document.find(accessor.get("source"))
    if numbers is None:
        numbers = source.find("float_array")
    if numbers is None:
        raise UnusableMeshError("its positions are missing")
    found = array(numbers)
    stride, offset, axes = 3, 0, [0, 1, 2]
    count = len(found) // 3
    if accessor is not None:
        stride, offset = _natural(accessor, "stride", 1), _natural(accessor, "offset", 0)
        count = _natural(accessor, "count", 0)
        names = [param.get("name") for param in accessor.findall("param")]
        if all(axis in names for axis in "XYZ"):
            axes = [names.index(axis) for axis in "XYZ"]
    if stride <= max(axes):
        raise UnusableMeshError("its positions are not three numbers each")
    if count and offset + stride * (count - 1) + max(axes) >= len(found):
        raise UnusableMeshError(f"it declares {count} positions, but holds {len(found)} numbers")
    return found[offset + stride * np.arange(count)[:, None] + axes]


def _faces(primitive: etree._Element, corners: _Corners, bounds: Bounds, said: Draft) -> Indices:
    """Vertex numbers of a primitive's triangles."""
    lists = primitive.findall("p")
    declared = _natural(primitive, "count", 0)
    if primitive.tag in ("trifans", "tristrips"):
        if primitive.tag == "tristrips":
            runs = [np.append(corners.of(p), -1) for p in lists]
            faces = strips(np.concatenate([np.zeros(0, np.int64), *runs]))
        else:
            faces = np.concatenate([np.zeros((0, 3), np.int64), *(fans(corners.of(p)) for p in lists)])
        found = len(lists)
    else:
        if primitive.tag == "polygons":
            each = [corners.of(p) for p in lists]
            counts = np.array([len(p) for p in each], np.int64)
            numbers = np.concatenate([np.zeros(0, np.int64), *each])
        else:
            numbers = corners.of(lists[0] if lists else None)
            counts = _counts(primitive, len(numbers))
        if counts.sum() != len(numbers):
            raise UnusableMeshError(f"it declares {counts.sum()} corners, but holds {len(numbers)}")
        bounds.check(len(numbers) - 2 * len(counts), "triangles")
        made = triangulate(corners.points, numbers, counts)
        made.tell(said)
        faces, found = numbers[made.corners], len(counts)
        with_holes = primitive.findall("ph")
        if with_holes:
            faces, found = np.concatenate([faces, _with_holes(with_holes, corners, said)]), found + len(with_holes)
    if primitive.get("count") is not None and declared != found:
        said.note(f"<{primitive.tag}> declares {declared} faces, but holds {found}")
    return faces


def _counts(primitive: etree._Element, corners: int) -> Indices:
    if primitive.tag == "triangles":
        counts = np.full(-(-corners // 3), 3)
        if corners % 3:
            counts[-1] = corners % 3  # said to have too few corners
        return counts
    counts = integers(primitive.find("vcount"))
    if (counts < 0).any() or counts.max(initial=0) > corners:
        raise UnusableMeshError("its <vcount> holds numbers that are no counts")
    return counts


def _with_holes(polygons: list[etree._Element], corners: _Corners, said: Draft) -> Indices:
    """Triangles of polygons that have holes."""
    faces, work = [np.zeros((0, 3), np.int64)], _MAX_HOLES
    for place, polygon in enumerate(polygons):
        if work < 0:
            said.left_out(len(polygons) - place, "polygons with holes", "dividing them takes too long")
            break
        outlines = [corners.of(polygon.find("p")), *(corners.of(hole) for hole in polygon.findall("h"))]
        numbers = np.concatenate(outlines)
        work -= len(numbers) ** 1.5 + 60
        good = (numbers >= 0) & (numbers < len(corners.points))
        if not good.all() or min(map(len, outlines)) < 3 or not np.isfinite(corners.points[numbers]).all():
            said.note("polygon with holes left out")
            continue
        triangles, crossing = divide_with_holes([corners.points[outline] for outline in outlines])
        if crossing:
            said.note("polygon whose holes cross its boundary: divided as well as it can be")
        faces.append(numbers[triangles])
    return np.concatenate(faces)
