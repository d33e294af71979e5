"""Wavefront OBJ: vertices and polygons in text. No other file is opened, whatever the text names."""

import re
from dataclasses import dataclass

import numpy as np

from artsim.loading.mesh_files.polygons import triangulate
from artsim.loading.mesh_files.surface import Array, Bounds, Draft, Indices, Surface, UnusableMeshError, quote_name
from artsim.loading.mesh_files.text import (
    FEW_WORDS,
    Rows,
    first_numbers,
    first_of_each,
    numbers,
    numbers_per_row,
    plain_text,
    substitute,
)

_HARMLESS = ("vt", "vn", "g", "o", "s", "usemtl", "mtllib", "usemap", "maplib", "mg", "lod", "bevel", "c_interp",
             "d_interp", "shadow_obj", "trace_obj")  # fmt: skip
"""Statements that say nothing about where the surface is."""

_HARMLESS_WORDS = frozenset(word[:8] for word in _HARMLESS)  # as Rows.words cuts them


@dataclass(frozen=True)
class Statements:
    """What the text of a Wavefront file says of its surface."""

    rows: Rows
    points: Array
    """(V, 3) float. NaN where no number can be read."""
    vertex_rows: np.ndarray
    face_rows: np.ndarray
    """(R,) bool. Which rows declare a vertex or a face."""
    counts: Indices
    """(P,) int. Corners of each face."""
    references: bytes
    """The corners of all faces, such as ``1/2/3 4/5/6``, a face a row."""

    def indices(self, wanted: Indices, declared: np.ndarray) -> Indices:
        """(C,) number, from 0, of what each corner refers to; out of range where it refers to nothing.

        Parameters
        ----------
        wanted : (C,) int
            From 1, or negative to count back from the face's own row.
        declared : (R,) bool
            Which rows declare what is referred to.
        """
        if len(wanted) != self.counts.sum():  # a corner that begins with a slash
            raise UnusableMeshError("its faces cannot be read")
        if (wanted < 0).any():
            so_far = np.repeat(np.cumsum(declared)[self.face_rows], self.counts)
            # Whoever counts back beyond the first vertex must not come out at the last ones.
            return np.where(wanted < 0, np.maximum(wanted + so_far, -1), wanted - 1)
        return wanted - 1


def statements(data: bytes, bounds: Bounds) -> Statements:
    """Find vertices and faces in the text of a Wavefront file.

    Raises
    ------
    AssetError
        When it has more of them than the bounds allow.
    """
    rows = _rows(data)
    vertex_rows, face_rows = rows.which(b"v"), rows.which(b"f")
    bounds.check(int(face_rows.sum()), "triangles")
    points = _vertices(rows, vertex_rows, bounds)
    references = _strip_comment(rows.rest(face_rows, b"f"))
    return Statements(rows, points, vertex_rows, face_rows, numbers_per_row(references), references)


def read_vertices(data: bytes, bounds: Bounds) -> Array:
    """(V, 3) vertices, whether or not a face names them; NaN where no number can be read.

    Raises
    ------
    AssetError
        When there are more than the bounds allow.
    """
    rows = _rows(data)
    return _vertices(rows, rows.which(b"v"), bounds)


def _rows(data: bytes) -> Rows:
    text = plain_text(data)
    if b"\\" in text:
        text = text.replace(b"\\ \n", b" ").replace(b"\\\n", b" ")
    return Rows(text)


def _vertices(rows: Rows, which: np.ndarray, bounds: Bounds) -> Array:
    bounds.check(int(which.sum()), "vertices")
    return first_numbers(_strip_comment(rows.rest(which, b"v")), 3)  # a row may go on with a weight or a colour


def _strip_comment(text: bytes) -> bytes:
    return substitute(rb"#[^\n]*", b"", text) if b"#" in text else text


def read_obj(data: bytes, bounds: Bounds) -> Surface:
    """The surface of a Wavefront file; raises as ``read_mesh``."""
    return _surface(statements(data, bounds), _declaration(data), bounds)


def _surface(found: Statements, declared: int, bounds: Bounds) -> Surface:
    """The surface that statements describe; its ``corners`` number the corners of all faces."""
    draft = Draft(declared=declared)
    total = int(found.counts.sum())
    bounds.check(total - 2 * len(found.counts), "triangles")
    corners = found.indices(first_of_each(found.references, total), found.vertex_rows)
    made = triangulate(found.points, corners, found.counts)
    draft.accounted = len(found.counts)
    made.tell(draft)
    _tell_others(found, draft)
    draft.add(found.points, corners[made.corners])
    draft.corners = made.corners
    return draft.surface()


@dataclass(frozen=True)
class Painted:
    """What a Wavefront file says of its surface's looks."""

    surface: Surface
    libraries: list[str]
    """Files that describe materials."""
    materials: list[str]
    """Names; the first, empty, is of faces without one."""
    material_of_face: Indices
    """(F,) int."""
    uv: Array
    """(F, 3, 2) float. Place of each corner in the material's picture; NaN where the file gives none."""


def read_painted(data: bytes, bounds: Bounds) -> Painted:
    """The surface of a Wavefront file, as :func:`read_obj` gives it, and its looks."""
    found = statements(data, bounds)
    surface = _surface(found, _declaration(data), bounds)
    assert surface.corners is not None
    libraries, used = found.rows.which(b"mtllib"), found.rows.which(b"usemtl")
    names = ["", *_names(found.rows.rest(used, b"usemtl"))]
    number = {name: k for k, name in enumerate(dict.fromkeys(names))}
    of_statement = np.array([number[name] for name in names])
    of_corner = np.repeat(of_statement[np.cumsum(used)[found.face_rows]], found.counts)
    places = first_numbers(_strip_comment(found.rows.rest(found.rows.which(b"vt"), b"vt")), 2)
    uv = np.append(places, [[np.nan, np.nan]], axis=0)
    textures = numbers(_textures(found.references), np.int64, 0, int(found.counts.sum()))
    index = found.indices(textures, found.rows.which(b"vt"))[surface.corners]
    index[(index < 0) | (index >= len(places))] = len(places)
    files = _names(found.rows.rest(libraries, b"mtllib"))
    return Painted(surface, files, list(number), of_corner[surface.corners[:, 0]], uv[index])


def _names(text: bytes) -> list[str]:
    return [name.strip().decode("utf-8", "replace") for name in text.split(b"\n")[:-1]]


def _textures(references: bytes) -> bytes:
    """The second number of each corner such as ``1/2/3``; 0 where there is none."""
    marked = substitute(rb"[^ \n/]+(?:/([^ \n/]*)(?:/[^ \n]*)?)?", rb"<\1>", references)
    return marked.replace(b"<>", b"0").replace(b"<", b"").replace(b">", b"")


def _tell_others(found: Statements, draft: Draft) -> None:
    """Name the statements that are not read."""
    other = ~found.vertex_rows & ~found.face_rows & ~found.rows.are_silent()
    for word in (b"vn", b"vt", b"usemtl", b"g", b"s"):
        if np.count_nonzero(other) <= FEW_WORDS:
            break
        other &= ~found.rows.which(word)
    for statement, count in found.rows.words(other).items():
        if statement in ("l", "p"):
            draft.left_out(count, "lines" if statement == "l" else "points")
        elif statement not in _HARMLESS_WORDS:
            draft.left_out(count, f"rows that begin with {quote_name(statement)}")


def _declaration(data: bytes) -> int:
    """How many faces a Wavefront file declares."""
    if b"\r" not in data and b"\t" not in data and b"\n " not in data and not data.startswith((b" ", b"\xef")):
        return data.count(b"\nf ") + data.startswith(b"f ") + data.count(b"\nf\n")
    while b"  " in data:
        data = data.replace(b"  ", b" ")
    # A row may go on in the next one, and that one may begin with an f.
    ends = rb"(?<!\\)(?<!\\ )(?<!\\\r)(?:^|[\r\n]|\xef\xbb\xbf)[ \t\v\f]*f(?=\s|$)"
    return sum(1 for _ in re.finditer(ends, data))
