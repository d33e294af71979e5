"""What every reader of mesh files shares: the surface it makes, the bounds it keeps, and what it says."""

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from artsim.errors import AssetError

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

FAR = 1e18
"""Squares of coordinates beyond it do not fit float32, which renderers calculate in."""

NO_POINT = "not finite, or of vertices that are missing"

_MAX_PIECES = 10_000
"""Primitives and copies of them in one file. Each costs some 100 microseconds, however small it is."""

_FEW = 1000
"""Vertices that any mesh may have: limits on triangles this low are for tests."""

_MAX_NOTES = 12
"""A damaged file of a thousand geometries would otherwise fill the screen."""

_THIN = 1e-6
"""Share of its length by which a surface is a line: squares of less are lost in double precision."""
_NOTHING = 1e-9
"""Metres below which a whole shape is a point: an atom is a tenth of it."""


class UnusableMeshError(Exception):
    """One mesh cannot be used, and why; the loader leaves it out and says so."""


@dataclass(frozen=True)
class Surface:
    """Triangles of one mesh file, in the file's frame, metres."""

    vertices: Array
    """(V, 3) float. Finite; each is a corner of some triangle."""
    faces: NDArray[np.int32]
    """(F, 3) int32."""
    notes: tuple[str, ...] = ()
    """What was left out, assumed or mended."""
    corners: Indices | None = None
    """(F, 3) int, optional. Which corner of the file's polygons each triangle's corner is, where the reader keeps
    it."""


@dataclass(frozen=True)
class Bounds:
    """How large a mesh may be. Readers ask before they expand anything."""

    where: Path
    """The file, for messages."""
    max_faces: int
    """Triangles, and vertices."""

    def check(self, count: int, what: str) -> None:
        """Refuse more than ``max_faces`` of something; raises AssetError."""
        limit = self.max_faces if what == "triangles" else max(self.max_faces, _FEW)
        if count > limit:
            raise AssetError(
                f"the object has more than {limit} {what}: this mesh alone has {_readable(count)}",
                self.where,
                "decimate it, or raise the limit with limits=LoadLimits(max_faces=...) if you trust the file",
            )

    def check_pieces(self, count: int) -> None:
        """Refuse too many primitives, or copies of them; raises AssetError."""
        if count > _MAX_PIECES:
            raise AssetError(
                f"the mesh is made up of {_readable(count)} pieces, over the limit of {_MAX_PIECES}",
                self.where,
                "export it again with its pieces joined into one",
            )


def _readable(count: int) -> str:
    return str(count) if count < 10**15 else f"over 10^{len(str(min(count, 10**4000))) - 1}"


@dataclass
class Draft:
    """A surface while its file is read."""

    declared: int | None = None
    """Faces that the file declares, counted without the code that reads them."""
    accounted: int = 0
    """Faces that were read, or left out with a note."""
    notes: list[str] = field(default_factory=list)
    pieces: list[tuple[Array, Indices]] = field(default_factory=list)
    corners: Indices | None = None

    def note(self, text: str) -> None:
        """Say something about the mesh."""
        self.notes.append(text)

    def left_out(self, count: int, what: str, why: str = "") -> None:
        """Say how many of something are left out, and why, unless none is."""
        if count:
            self.note(f"{count} {what} left out" + (f": {why}" if why else ""))

    def add(self, vertices: Array, faces: Indices) -> None:
        """Append a piece: (V, 3) vertices and (F, 3) triangles that name them."""
        self.pieces.append((vertices, faces))

    def surface(self) -> Surface:
        """The whole surface, without triangles that cannot be used and vertices that no triangle names.

        Raises
        ------
        UnusableMeshError
            When the file declares faces and none arrived.
        """
        if self.declared is not None and self.declared != self.accounted:
            if self.accounted == 0:
                raise UnusableMeshError(f"declares {_readable(self.declared)} faces, none of which could be read")
            self.note(f"declares {_readable(self.declared)} faces, but {self.accounted} were found")
        vertices, faces = join_pieces(self.pieces)
        near = np.abs(vertices) <= FAR  # false for what is not a number, too
        corners = self.corners
        if not near.all() or faces.min(initial=0) < 0:
            usable = (faces >= 0).all(axis=1)
            if len(vertices):  # without any, no triangle can be used
                usable &= np.all(near, axis=1)[faces].all(axis=1)
            self.left_out(int((~usable).sum()), "triangles", NO_POINT)
            vertices, faces = join_pieces([(vertices, faces[usable])])
            corners = None if corners is None else corners[usable]
        return Surface(vertices, faces.astype(np.int32), _shorten(self.notes), corners)


def join_pieces(pieces: list[tuple[Array, Indices]]) -> tuple[Array, Indices]:
    """One piece of several: without the vertices that no triangle names, and with those that pieces share once.

    Numbers that name no vertex become -1.
    """
    vertices, faces, offset = [np.zeros((0, 3))], [np.zeros((0, 3), np.int64)], 0
    place: dict[int, int] = {}
    for points, triangles in pieces:
        if id(points) not in place:
            place[id(points)] = offset
            vertices.append(points)
            offset += len(points)
        own = triangles + place[id(points)]
        if len(triangles) and (triangles.min() < 0 or triangles.max() >= len(points)):
            own = np.where((triangles >= 0) & (triangles < len(points)), own, -1)
        faces.append(own)
    all_vertices = vertices[1] if len(vertices) == 2 else np.concatenate(vertices)
    all_faces = faces[1] if len(faces) == 2 else np.concatenate(faces)
    used = np.zeros(len(all_vertices) + 1, dtype=bool)
    used[all_faces] = True  # -1 names the last, which stands for none
    if used[:-1].all():
        return all_vertices, all_faces
    number = np.cumsum(used) - 1
    number[-1] = -1
    return all_vertices[used[:-1]], number[all_faces]


def _shorten(notes: list[str]) -> tuple[str, ...]:
    """Each note once, with how often it was made; the last ones in a word."""
    counted = [text if count == 1 else f"{text} ({count} times)" for text, count in Counter(notes).items()]
    if len(counted) <= _MAX_NOTES:
        return tuple(counted)
    return (*counted[:_MAX_NOTES], f"and {len(counted) - _MAX_NOTES} other problems")


def quote_name(name: object) -> str:
    """A name out of a file, safe to print: quoted, without control characters, and short."""
    text = ascii(name) if isinstance(name, str) else ascii(str(name))
    return text if len(text) <= 60 else f"{text[:56]}...'"


def transform_affine(T: Array, points: Array) -> Array:
    """(N, 3) points carried by an affine (4, 4) transform, the same bits on every processor (no BLAS)."""
    x, y, z = points.T
    return np.stack([T[i, 0] * x + T[i, 1] * y + T[i, 2] * z + T[i, 3] for i in range(3)], axis=1)


def compose_affine(A: Array, B: Array) -> Array:
    """(4, 4) product of two transforms, without BLAS."""
    return np.add.reduce(A[:, :, None] * B[None, :, :], axis=1)


def mirrors(T: Array) -> bool:
    """Whether a transform turns surfaces inside out."""
    a, b, c = T[:3, :3].tolist()
    return bool(
        a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
        < 0.0
    )


def is_thin(vertices: Array, faces: NDArray[np.int32]) -> bool:
    """Whether a surface is a point or a line; one that is flat is not."""
    used = vertices  # readers leave none out
    if len(used) < 3:
        return True
    from_middle = used - used.mean(axis=0)
    # Second moments, smallest first: their roots are the extents along the principal axes.
    extents = np.sqrt(np.linalg.eigvalsh(from_middle.T @ from_middle).clip(0.0))
    return bool(extents[1] <= _THIN * extents[2] or extents[2] < _NOTHING)
