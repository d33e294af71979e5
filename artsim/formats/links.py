"""Objects as formats have them in which handles, knobs and buttons are links: fixed to the part that carries them."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from artsim.model.details import GRIPS
from artsim.model.joints import Joint
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject

_LINKS = (*GRIPS, "button")


@dataclass(frozen=True, eq=False)
class Link:
    """A part without its grips, or a grip."""

    label: str
    parent: int
    """Number among the links; -1 of the root."""
    joint: Joint | None
    """At the object's size; None of a grip, which is fixed."""
    vertices: Array
    """(V, 3) float. Rest frame, at rest, metres."""
    faces: NDArray[np.int64]
    """(F, 3). May be empty."""
    axes: Array
    """(3, 3) float. Columns are the axes of its box, in the rest frame."""
    center: Array
    size: Array
    """(3,) float. Of its box, metres, along these axes."""


def links_of(obj: ArticulatedObject) -> list[Link]:
    """The links of an object: its parts in their order, then their grips in the order of ``obj.details``."""
    return [*_bodies(obj), *_grips(obj)]


def _bodies(obj: ArticulatedObject) -> Iterator[Link]:
    for part, joint, center in zip(obj.parts, obj.tree.joints, obj.box_center, strict=True):
        grips = [n for n, detail in enumerate(part.details) if detail.label in _LINKS]
        faces = part.faces[~np.isin(part.detail_of_face, grips)] if grips else part.faces
        vertices, faces_of_these = _only(part.vertices * obj.scale, faces)
        low, high = (vertices.min(axis=0), vertices.max(axis=0)) if len(vertices) else (center, center)
        box = 0.5 * (low + high), high - low
        yield Link(part.label, joint.parent, joint, vertices, faces_of_these, np.eye(3), *box)


def _grips(obj: ArticulatedObject) -> Iterator[Link]:
    details = iter(obj.details)
    for k, part in enumerate(obj.parts):
        for number in range(len(part.details)):
            detail = next(details)
            if detail.label in _LINKS:
                surface = _only(part.vertices * obj.scale, part.faces[part.detail_of_face == number])
                T = detail.T_rest_detail
                yield Link(detail.label, k, None, *surface, T[:3, :3], T[:3, 3], detail.size)


def _only(vertices: Array, faces: NDArray[np.int32]) -> tuple[Array, NDArray[np.int64]]:
    """A surface with the vertices that it uses."""
    used, numbers = np.unique(faces, return_inverse=True)
    return vertices[used], numbers.reshape(-1, 3)
