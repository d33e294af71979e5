"""Bodies for objects whose source tells of surfaces only, so that they can be simulated."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from artsim.model.kinematics import Array, KinematicTree
from artsim.model.objects import ArticulatedObject, Body, Mesh, Part

if TYPE_CHECKING:
    import trimesh

DEFAULT_DENSITY = 150.0
"""kg/m^3 of the convex hull of a part whose source says nothing about it: boards around air."""
_SPECK = 0.01
"""Least side of the box that stands for a part without volume, over the object's diagonal."""
_SHEET = 1e-3
"""Thickness that a part has where it collides whose surface lies in a plane, over the object's diagonal."""
_PLANE = 1e-5
"""Share of its length as which the thickness of a plane passes."""
_FLAT = 1e-3
"""A hull that fills less of its box has no volume worth the name."""
_SHORT = 1e-6
"""Share of its volume by which a convex piece may fall short of its hull."""
_ROUNDING = 1e-8
"""Metres by which a file may have rounded a vertex."""


def add_bodies(obj: ArticulatedObject) -> ArticulatedObject:
    """The object with a body for every part, names that any file takes, and joints that are 0 at rest.

    Parts with a body keep it. A part of a loaded object, whose surface need not be closed, becomes its convex hull; one
    without volume, a thin box around it, or a speck at its joint.
    """
    parts = [_add_body(obj, k) for k in range(len(obj))]
    return replace(
        obj, parts=tuple(parts), native_tree=at_zero(obj.native_tree, [f"joint{k}" for k in range(len(obj))])
    )


def add_surface_bodies(obj: ArticulatedObject) -> ArticulatedObject:
    """The object with its surfaces as they are, a body for every part, proper names, and joints that are 0 at rest.

    Parts with a body keep it. A part of a loaded object collides as its source file says of its surface: as it is, or
    as a thin plate where it lies in a plane. Its mass is that of its convex hull (see :func:`add_bodies`).
    """
    used: set[str] = set()
    joints = [_proper_name(joint.name, used) for joint in obj.native_tree.joints]
    parts = []
    for k, part in enumerate(obj.parts):
        body = part.body
        if body is None:
            native = obj.diagonal / obj.scale
            hull = convex_hull(_points(obj, k), _SPECK * native)
            pieces = ((part.vertices, part.faces),) if len(part.faces) else ()
            if pieces and is_flat(_points(obj, k)):  # no simulator takes a sheet for a body
                pieces = (convex_hull(_points(obj, k), _SHEET * native),)
            body = Body(pieces, DEFAULT_DENSITY, hull)
        parts.append(
            replace(part, name=_proper_name(part.name, used), label=_proper_name(part.label, set()), body=body)
        )
    return replace(obj, parts=tuple(parts), native_tree=at_zero(obj.native_tree, joints))


def at_zero(tree: KinematicTree, names: Sequence[str]) -> KinematicTree:
    """The tree with joints of these names, that are 0 at rest."""
    joints = []
    for joint, name in zip(tree.joints, names, strict=True):
        mimic, rest = joint.mimic, joint.rest
        if mimic is not None:
            source_rest = tree.joints[mimic.source].rest
            mimic = replace(mimic, offset=mimic.offset + mimic.multiplier * source_rest - rest)
        lower, upper = joint.lower - rest, joint.upper - rest
        joints.append(replace(joint, name=name, lower=lower, upper=upper, rest=0.0, mimic=mimic))
    return KinematicTree(joints)


def _proper_name(name: str, used: set[str]) -> str:
    """A name of letters, digits and _, as any file can hold it, that is not yet used."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", name)
    name = name if re.match(r"[A-Za-z_]", name) else f"_{name}"
    while name in used:
        name += "_"
    used.add(name)
    return name


def _points(obj: ArticulatedObject, k: int) -> Array:
    """Corners of part k's surface; without one, the origin of its joint."""
    part = obj.parts[k]
    return part.vertices[np.unique(part.faces)] if len(part.faces) else obj.native_tree.origins[k : k + 1]


def _add_body(obj: ArticulatedObject, k: int) -> Part:
    part = replace(obj.parts[k], name=f"part{k}", label=f"part{k}")
    if part.body is not None:
        return part
    vertices, faces = convex_hull(_points(obj, k), _SPECK * obj.diagonal / obj.scale)
    return replace(part, vertices=vertices, faces=faces, body=Body(((vertices, faces),), DEFAULT_DENSITY))


def convex_hull(points: Array, thickness: float) -> Mesh:
    """Convex hull of points; where it has next to no volume, made ``thickness`` thick in every direction."""
    import trimesh

    low, high = points.min(axis=0), points.max(axis=0)
    hull = _hull(points)
    with np.errstate(divide="ignore", invalid="ignore"):  # one without a volume, which is what is asked
        flat = hull is None or not hull.volume > _FLAT * np.prod(np.maximum(high - low, thickness))
    if flat:
        hull = _hull(_thickened(points, thickness))
    if hull is None:  # of coordinates so large that the thickness is lost in them
        hull = trimesh.creation.box(np.maximum(high - low, thickness))
        hull.apply_translation(0.5 * (low + high))
    return np.asarray(hull.vertices, dtype=np.float64), np.asarray(hull.faces, dtype=np.int32)


def is_flat(points: Array) -> bool:
    """Whether points lie in a plane, as near as a file in single precision can tell."""
    from_middle = points - points.mean(axis=0)
    extents = np.ptp(from_middle @ _principal_axes(from_middle).T, axis=0)
    return bool(extents.min() <= _PLANE * extents.max())


def _hull(points: Array) -> trimesh.Trimesh | None:
    """Convex hull; None where the points lie in a plane."""
    import trimesh
    from scipy.spatial import QhullError

    try:
        return trimesh.convex.convex_hull(points)
    except (QhullError, ValueError):
        return None


def _thickened(points: Array, thickness: float) -> Array:
    """Points, moved both ways along each of their principal axes along which they take up less than a thickness."""
    for axis in _principal_axes(points - points.mean(axis=0)):
        lacking = thickness - float(np.ptp(points @ axis))
        if lacking > 0:
            points = np.concatenate([points - 0.5 * lacking * axis, points + 0.5 * lacking * axis])
    return points


def _principal_axes(from_middle: Array) -> Array:
    """(3, 3) principal axes of (N, 3) points about their middle, as rows."""
    # The full matrices of N points hold N x N numbers, and are needed for three axes of fewer than three points alone.
    axes: Array = np.linalg.svd(from_middle, full_matrices=len(from_middle) < 3)[2]
    return axes


def is_convex(vertices: Array, faces: NDArray[np.int32]) -> bool:
    """Whether a mesh encloses its whole convex hull."""
    from scipy.spatial import ConvexHull, QhullError

    corners = (vertices - vertices[0])[faces]
    volume = np.einsum("ni,ni->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    try:
        hull = ConvexHull(vertices - vertices[0])
    except QhullError:  # flat
        return False
    return bool(volume >= (1.0 - _SHORT) * hull.volume - _ROUNDING * hull.area)
