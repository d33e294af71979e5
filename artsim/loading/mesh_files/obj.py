"""Wavefront OBJ: vertices and polygons in text. No other file is opened, whatever the text names."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from artsim.loading.mesh_files.polygons import triangulate
from artsim.loading.mesh_files.surface import Array, Bounds, Draft, Indices, Surface, UnusableMeshError, named
from artsim.loading.mesh_files.text import Rows, numbers, numbers_per_row, plain_text

_HARMLESS = ("vt", "vn", "g", "o", "s", "usemtl", "mtllib", "usemap", "maplib", "mg", "lod", "bevel", "c_interp",
             "d_interp", "shadow_obj", "trace_obj")  # fmt: skip
"""Statements that say nothing about where the surface is."""


@dataclass(frozen=True)
class Statements:
    """What the text of a Wavefront file says of its surface.

    Attributes
    ----------
    rows : Rows
    points : (V, 3) float
        NaN where no number can be read.
    vertex_rows, face_rows : (R,) bool
        Which rows declare a vertex or a face.
    counts : (P,) int
        Corners of each face.
    references : bytes
        The corners of all faces, such as ``1/2/3 4/5/6``, a face a row.
    """

    rows: Rows
    points: Array
    vertex_rows: np.ndarray
    face_rows: np.ndarray
    counts: Indices
    references: bytes

    def indices(self, references: bytes, declared: np.ndarray) -> Indices:
        """(C,) number, from 0, of what each corner refers to; out of range where it refers to nothing.

        Parameters
        ----------
        references : bytes
            One number a corner: from 1, or negative to count back from the face's own row.
        declared : (R,) bool
            Which rows declare what is referred to.
        """
        wanted = numbers(references, np.int64, 0, int(self.counts.sum()))
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
    text = plain_text(data)
    if b"\\" in text:
        text = re.sub(rb"\\ *\n", b" ", text)
    if b"#" in text:
        text = re.sub(rb"#[^\n]*", b"", text)
    rows = Rows(text)
    vertex_rows, face_rows = rows.which(b"v"), rows.which(b"f")
    bounds.check(int(vertex_rows.sum()), "vertices")
    bounds.check(int(face_rows.sum()), "triangles")
    places = rows.rest(vertex_rows, b"v")
    per_row = numbers_per_row(places)
    values = np.append(numbers(places, np.float64, np.nan, int(per_row.sum())), np.nan)
    # A row may go on with a weight or a colour.
    at = (np.cumsum(per_row) - per_row)[:, None] + np.arange(3)
    points = values[np.where(per_row[:, None] >= 3, at, len(values) - 1)]
    references = rows.rest(face_rows, b"f")
    return Statements(rows, points, vertex_rows, face_rows, numbers_per_row(references), references)


def read_obj(data: bytes, bounds: Bounds) -> Surface:
    """The surface of a Wavefront file; ``corners`` number the corners of its faces.

    Raises
    ------
    UnusableMeshError
    AssetError
    """
    found = statements(data, bounds)
    draft = Draft(declared=_declared(data))
    references = found.references
    if b"/" in references:
        references = re.sub(rb"/[^ \n]*", b"", references)
    if len(found.counts) and int(found.counts.sum()) > 3 * bounds.max_faces:
        bounds.check(int(found.counts.sum()) - 2 * len(found.counts), "triangles")
    corners = found.indices(references, found.vertex_rows)
    made = triangulate(found.points, corners, found.counts)
    bounds.check(len(made.corners), "triangles")
    draft.accounted = len(found.counts)
    made.tell(draft)
    _tell_others(found, draft)
    draft.add(found.points, corners[made.corners])
    draft.corners = made.corners
    return draft.surface()


def _tell_others(found: Statements, draft: Draft) -> None:
    """Name the statements that are not read."""
    other = ~found.vertex_rows & ~found.face_rows
    for word in (b"vt", b"vn", b"usemtl", b"g", b"o", b"s"):
        other &= ~found.rows.which(word)
    if not other.any():
        return
    for statement, count in found.rows.words(other).items():
        if statement in ("l", "p"):
            draft.left_out(count, "lines" if statement == "l" else "points")
        elif statement not in _HARMLESS:
            draft.left_out(count, f"rows that begin with {named(statement)}")


def _declared(data: bytes) -> int:
    """How many faces a Wavefront file declares."""
    if b"\r" not in data and b"\t" not in data and b"\n " not in data and not data.startswith((b" ", b"\xef")):
        return data.count(b"\nf ") + data.startswith(b"f ") + data.count(b"\nf\n")
    # One row may go on in the next, and a row that does might begin with an f.
    return len(re.findall(rb"(?<!\\)(?<!\\ )(?<!\\\r)(?:^|[\r\n]|\xef\xbb\xbf)[ \t\v\f]*f(?=\s|$)", data))
