"""The solid: a union of convex pieces, made when they are needed, some of which are labelled."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import wraps
from typing import Any, TypeVar

import numpy as np
from manifold3d import Manifold, OpType
from numpy.typing import NDArray

from artsim.common.products import apply, unit
from artsim.making.outlines import Vector
from artsim.model.kinematics import Array
from artsim.model.transforms import rotation_about


@dataclass(frozen=True, eq=False)
class Mark:
    """What some pieces of a part are together: its handle, a knob, a pane. Equal marks are one and the same thing."""

    label: str
    outward: Array | None = None
    """(3,) unit: from the part towards who takes hold of it; None where nothing says so."""


_Piece = tuple[Manifold, Mark | None]


class _Later:
    """Pieces that are made when they are first asked for: who wants to know how many doors there are needs none."""

    __slots__ = ("_made", "_make")

    def __init__(self, make: Callable[[], Iterable[_Piece]]) -> None:
        self._make: Callable[[], Iterable[_Piece]] | None = make
        self._made: tuple[_Piece, ...] = ()

    def pieces(self) -> tuple[_Piece, ...]:
        if self._make is not None:
            self._made, self._make = tuple(self._make()), None
        return self._made


class Solid:
    """A union of convex pieces, which are made when they are first needed.

    Parameters
    ----------
    pieces : sequence of Manifold
        Each convex. They may overlap or touch one another.
    """

    __slots__ = ("_later",)

    def __init__(self, pieces: Sequence[Manifold] = ()) -> None:
        later = _Later(lambda: ((piece, None) for piece in pieces))
        self._later: tuple[_Later, ...] = (later,) if pieces else ()

    @staticmethod
    def _of(*later: _Later) -> Solid:
        solid = Solid()
        solid._later = later
        return solid

    @staticmethod
    def made_by(make: Callable[[], Solid]) -> Solid:
        """The solid that a function makes, once it is needed."""
        return Solid._of(_Later(lambda: make()._pieces()))

    def _pieces(self) -> list[_Piece]:
        return [piece for later in self._later for piece in later.pieces()]

    @property
    def pieces(self) -> tuple[Manifold, ...]:
        """Each convex."""
        return tuple(piece for piece, _ in self._pieces())

    @property
    def marks(self) -> tuple[Mark | None, ...]:
        """Of each piece."""
        return tuple(mark for _, mark in self._pieces())

    def __add__(self, other: Solid) -> Solid:
        return Solid._of(*self._later, *other._later)

    def called(self, label: str, outward: Vector | None = None) -> Solid:
        """The same solid as one labelled piece of its part: ``bar.called("handle", FRONT)``; see :class:`Mark`."""
        mark = Mark(label, None if outward is None else unit(np.array(outward, dtype=np.float64)))
        return Solid._of(_Later(lambda: ((piece, mark) for piece in self.pieces)))

    def moved(self, offset: Vector) -> Solid:
        """Translated by (x, y, z)."""
        x, y, z = (float(v) for v in offset)
        return Solid._of(_Later(lambda: ((p.translate((x, y, z)), mark) for p, mark in self._pieces())))

    def turned(self, axis: Vector, angle: float, about: Vector = (0.0, 0.0, 0.0)) -> Solid:
        """Rotated by ``angle`` radians about an axis through the point ``about``."""
        rotation = rotation_about(axis, angle)
        point = np.array(about, dtype=np.float64)
        return self._mapped(rotation, point - apply(rotation, point))

    def rotated(self, rotation: Array) -> Solid:
        """Turned about the origin by a (3, 3) rotation."""
        return self._mapped(rotation, np.zeros(3))

    def mirrored(self, axis: int, about: float = 0.0) -> Solid:
        """Reflected in the plane where coordinate ``axis`` (0, 1, 2) equals ``about``."""
        linear, offset = np.eye(3), np.zeros(3)
        linear[axis, axis], offset[axis] = -1.0, 2.0 * about
        return self._mapped(linear, offset)

    def scaled(self, factors: Vector) -> Solid:
        """Scaled by (x, y, z) factors about the origin."""
        return self._mapped(np.diag(np.asarray(factors, dtype=np.float64)), np.zeros(3))

    def _mapped(self, linear: Array, offset: Array) -> Solid:
        matrix = np.column_stack([linear, offset])

        def mapped() -> Iterator[_Piece]:
            marks: dict[Mark | None, Mark | None] = {None: None}
            for piece, mark in self._pieces():
                if mark is not None and mark not in marks:
                    outward = None if mark.outward is None else unit(apply(linear, mark.outward))
                    marks[mark] = Mark(mark.label, outward)
                yield piece.transform(matrix), marks[mark]

        return Solid._of(_Later(mapped))

    def bounds(self) -> Array:
        """(2, 3) corners of the axis-aligned box."""
        boxes = np.array([p.bounding_box() for p in self.pieces])
        return np.stack([boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)])

    def union(self) -> tuple[Array, NDArray[np.int32]]:
        """Vertices (V, 3) and faces (F, 3) of the watertight surface."""
        return mesh_of(Manifold.batch_boolean(list(self.pieces), OpType.Add))

    def piece_meshes(self) -> tuple[tuple[Array, NDArray[np.int32]], ...]:
        """Vertices and faces of every convex piece."""
        return tuple(mesh_of(p) for p in self.pieces)


Shape = TypeVar("Shape", bound=Callable[..., Solid])


def deferred(shape: Shape) -> Shape:
    """A function that returns a solid, to be called when the solid's pieces are first needed.

    Its arguments are kept as they are now: arrays are copied, and numbers drawn must be drawn before.
    """

    @wraps(shape)
    def later(*given: Any, **options: Any) -> Solid:
        kept, more = [_kept(value) for value in given], {name: _kept(value) for name, value in options.items()}
        return Solid.made_by(lambda: shape(*kept, **more))

    return later  # type: ignore[return-value]


def _kept(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.copy()
    return type(value)(_kept(v) for v in value) if type(value) in (list, tuple) else value


def mesh_of(manifold: Manifold) -> tuple[Array, NDArray[np.int32]]:
    """Vertices (V, 3) and faces (F, 3) of a manifold."""
    mesh = manifold.to_mesh64()
    vertices = np.ascontiguousarray(np.asarray(mesh.vert_properties)[:, :3], dtype=np.float64)
    return vertices, np.ascontiguousarray(mesh.tri_verts, dtype=np.int32)


def union(solids: Iterable[Solid]) -> Solid:
    """All pieces of several solids."""
    return Solid._of(*(later for solid in solids for later in solid._later))
