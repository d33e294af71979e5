"""Labelled pieces of a part that are no parts of their own: handles, knobs, buttons, panels, panes, displays."""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artsim.common.elementary import cos, sin
from artsim.common.products import apply, cross, dot, matmul, norm, unit
from artsim.model.kinematics import Array

Mesh = tuple[Array, NDArray[np.int32]]
"""Vertices (V, 3) and triangles (F, 3)."""
DETAILS = ("handle", "knob", "button", "panel", "glass", "display", "latch")
"""Labels of details. PartNet-Mobility's names of visuals say these and their like."""
GRIPS = ("handle", "knob", "latch")
"""Those that one takes hold of."""
_ON_SURFACE = 1e-7
"""Metres by which a face of a union may miss the plane of the piece whose face it was."""
_VISUAL = re.compile(r"(?:[a-z]+_)*?(handle|knob|button|glass|screen|display|display_panel|latch|lock)[-_]?[0-9]*")
_SAME = {"screen": "display", "display_panel": "display", "lock": "latch"}


@dataclass(frozen=True, eq=False)
class Detail:
    """A labelled piece of a part.

    Its frame has its origin in the middle of the piece, x away from the part (out of a pane, towards the hand that
    takes a handle), and z along the piece's longest side across x.
    """

    label: str
    """One of ``DETAILS``."""
    T_rest_detail: Array
    """(4, 4) its frame in the rest frame, at rest, native units."""
    size: Array
    """(3,) sides of its box along the axes of its frame, native units."""
    pieces: tuple[Mesh, ...] = ()
    """Convex meshes that it is made of, in the rest frame, native units; empty where ``faces`` says what is its."""
    faces: NDArray[np.int64] | None = None
    """Faces of its part's surface that are its; None where ``pieces`` say so."""

    def moved(self, offset: Array) -> "Detail":
        """Translated by (3,)."""
        T = self.T_rest_detail.copy()
        T[:3, 3] += offset
        pieces = tuple((vertices + offset, faces) for vertices, faces in self.pieces)
        return Detail(self.label, T, self.size, pieces, self.faces)


@dataclass(frozen=True, eq=False)
class DetailFrame:
    """Where a detail is: its frame and box at the size of its object."""

    name: str
    """Unique in its object: "handle_1"."""
    label: str
    part: int
    """Part that carries it."""
    T_rest_detail: Array
    """(4, 4) its frame in the rest frame, at rest, metres; see :class:`Detail`."""
    size: Array
    """(3,) sides of its box along the axes of its frame, metres."""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, DetailFrame) and self.to_dict() == other.to_dict()

    __hash__ = None  # type: ignore[assignment]

    def to_dict(self) -> dict[str, Any]:
        """As :meth:`from_dict` reads it."""
        return {**vars(self), "T_rest_detail": self.T_rest_detail.tolist(), "size": self.size.tolist()}

    @staticmethod
    def from_dict(data: Any) -> "DetailFrame":
        """A detail out of a record; a ValueError says why there is none."""
        try:
            T, size = (np.array(data[key], dtype=np.float64) for key in ("T_rest_detail", "size"))
            texts = tuple(data[key] for key in ("name", "label"))
            part = data["part"]
        except (TypeError, KeyError) as error:
            raise ValueError(f"a detail is {data!r:.60}") from error
        finite = np.isfinite(T).all() and np.isfinite(size).all()
        if T.shape != (4, 4) or size.shape != (3,) or not finite or type(part) is not int or part < 0:
            raise ValueError(f"a detail is {data!r:.60}")
        if not all(isinstance(text, str) for text in texts):
            raise ValueError(f"a detail is {data!r:.60}")
        return DetailFrame(texts[0], texts[1], part, T, size)


def numbered(details: Iterable[DetailFrame]) -> tuple[DetailFrame, ...]:
    """Details in the order of their parts, each named by its label and its number among those."""
    counts = Counter[str]()
    named = []
    for detail in details:
        counts[detail.label] += 1
        named.append(replace(detail, name=f"{detail.label}_{counts[detail.label]}"))
    return tuple(named)


def detail_of(
    label: str,
    points: Array,
    surface: Array,
    outward: Array | None = None,
    pieces: tuple[Mesh, ...] = (),
    faces: NDArray[np.int64] | None = None,
) -> Detail:
    """A detail with a frame.

    Parameters
    ----------
    label : str
    points : (N, 3) float
        Of its surface, rest frame.
    surface : (M, 3) float
        Of its part, which says where outward is when nothing else does.
    outward : (3,) float, optional
        Unit.
    pieces, faces
        See :class:`Detail`.
    """
    if outward is None:
        outward = _outward(label, points, surface)
    along = _longest(points, outward)
    R = np.column_stack([outward, cross(along, outward), along])
    local = apply(R.T, points)
    low, high = local.min(axis=0), local.max(axis=0)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, apply(R, 0.5 * (low + high))
    return Detail(label, T, high - low, pieces, faces)


def _outward(label: str, points: Array, surface: Array) -> Array:
    """A coordinate axis: that across a pane, or that along which what one takes hold of stands out of its part."""
    low, high = points.min(axis=0), points.max(axis=0)
    rest = surface[((surface < low - 1e-6) | (surface > high + 1e-6)).any(axis=1)]
    rest = surface if len(rest) == 0 else rest
    ends = np.stack([rest.min(axis=0), rest.max(axis=0)])
    out = np.stack([ends[0] - low, high - ends[1]])
    away = 0.5 * (low + high) - ends.mean(axis=0)
    if label in GRIPS and out.max() > _STANDS_OUT * (high - low).min():
        side, axis = np.unravel_index(np.argmax(out), out.shape)
        return np.eye(3)[axis] * (1.0 if side else -1.0)
    thin = int(np.argmin(np.ptp(ends, axis=0) if label in GRIPS else high - low))
    ahead = thin == 0 and label not in GRIPS  # a pane across X faces the front
    return np.eye(3)[thin] * (1.0 if away[thin] > 0 and not ahead else -1.0)


_STANDS_OUT = 0.2
"""Share of a handle's least side by which it stands out of its part, at least, where that tells its outward side."""


def _longest(points: Array, outward: Array) -> Array:
    """The long side of the narrowest rectangle around points seen along ``outward``: up or to the left if nearly so."""
    flat = np.eye(3) - outward[:, None] * outward
    up = unit(flat[int(np.argmax(np.abs(flat[2])))] if abs(outward[2]) > _UPRIGHT else flat[2])
    side = cross(outward, up)
    v, u = dot(points, up), dot(points, side)
    angle = 0.0
    for step in (np.deg2rad(5.0), np.deg2rad(0.5)):
        tried = angle + step * _FAN
        widths = np.ptp(cos(tried)[:, None] * u - sin(tried)[:, None] * v, axis=1)
        angle = float(tried[np.argmin(widths)])
    standing, lying = np.ptp(u), np.ptp(v)
    if min(standing, lying) <= _NEARLY * widths.min():
        angle = 0.0 if standing <= lying else 0.5 * np.pi
    along = cos(angle) * up + sin(angle) * side
    along = np.where(np.abs(along) < 1e-9, 0.0, along)
    return unit(along if along[np.argmax(np.abs(along))] > 0 else -along)


_FAN = np.arange(-18, 18)
_UPRIGHT, _NEARLY = 0.999, 1.05
"""Cosine above which a direction counts as up; width over the least one, up to which a rectangle may stand straight."""


def label_of_visual(name: str) -> str | None:
    """The label of a detail that a visual's name says, as in PartNet-Mobility: "handle-12"; None of any other."""
    found = _VISUAL.fullmatch(name)
    return None if found is None else _SAME.get(found[1], found[1])


NO_DETAIL = 255
"""Number of a point that is on no detail."""


def on_faces(points: Array, vertices: Array, faces: NDArray[np.int32], tolerance: float) -> NDArray[np.bool_]:
    """(N,) which points lie on triangles, up to a tolerance in the points' unit."""
    found = np.zeros(len(points), dtype=bool)
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    area = norm(normal)
    for f in np.flatnonzero(area > 0).tolist():
        near = ~found & (np.abs(dot(points - a[f], normal[f])) < tolerance * area[f])
        inside = np.flatnonzero(near)
        for one, two in ((a, b), (b, c), (c, a)):
            edge = two[f] - one[f]
            beyond = dot(np.cross(edge, points[inside] - one[f]), normal[f])
            inside = inside[beyond > -tolerance * area[f] * norm(edge)]
        found[inside] = True
    return found


def detail_of_faces(vertices: Array, faces: NDArray[np.int32], details: Sequence[Detail]) -> NDArray[np.int64]:
    """(F,) which detail each face of a part belongs to: its number, or -1."""
    found = np.full(len(faces), -1, dtype=np.int64)
    middles = vertices[faces].mean(axis=1) if len(faces) else np.zeros((0, 3))
    for number, detail in enumerate(details):
        if detail.faces is not None:
            found[detail.faces] = number
        for corners, own in detail.pieces:
            near = (middles >= corners.min(axis=0) - 1e-6) & (middles <= corners.max(axis=0) + 1e-6)
            candidates = np.flatnonzero(near.all(axis=1))
            a, b, c = (corners[own[:, i]] for i in range(3))
            normal = np.cross(b - a, c - a)
            length = norm(normal)
            outwards, offset = normal[length > 0] / length[length > 0, None], a[length > 0]
            beyond = matmul(middles[candidates], outwards.T) - dot(outwards, offset)
            found[candidates[beyond.max(axis=1) < _ON_SURFACE]] = number
    return found
