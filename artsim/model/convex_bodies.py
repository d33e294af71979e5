"""Bodies for objects whose source tells of surfaces only, so that they can be simulated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from artsim.model.kinematics import Array, KinematicTree
from artsim.model.objects import ArticulatedObject, Body, Mesh, Part

DEFAULT_DENSITY = 150.0
"""kg/m^3 of the convex hull of a part whose source says nothing about it: boards around air."""
_SPECK = 0.01
"""Least side of the box that stands for a part without volume, over the object's diagonal."""
_FLAT = 1e-3
"""A hull that fills less of its box has no volume worth the name."""


def add_bodies(obj: ArticulatedObject) -> ArticulatedObject:
    """The object with a body for every part, names that any file takes, and joints that are 0 at rest.

    Parts with a body keep it. A part of a loaded object, whose surface need not be closed, becomes its convex hull; one
    without volume, a thin box around it, or a speck at its joint.
    """
    joints = []
    for k, joint in enumerate(obj.native_tree.joints):
        mimic, rest = joint.mimic, joint.rest
        if mimic is not None:
            source_rest = obj.native_tree.joints[mimic.source].rest
            mimic = replace(mimic, offset=mimic.offset + mimic.multiplier * source_rest - rest)
        lower, upper = joint.lower - rest, joint.upper - rest
        joints.append(replace(joint, name=f"joint{k}", lower=lower, upper=upper, rest=0.0, mimic=mimic))
    parts = [_add_body(obj, k) for k in range(len(obj))]
    return replace(obj, parts=tuple(parts), native_tree=KinematicTree(joints))


def _add_body(obj: ArticulatedObject, k: int) -> Part:
    part = replace(obj.parts[k], name=f"part{k}", label=f"part{k}")
    if part.body is not None:
        return part
    points = part.vertices[np.unique(part.faces)] if len(part.faces) else obj.native_tree.origins[k : k + 1]
    vertices, faces = _hull(points, _SPECK * obj.diagonal / obj.scale)
    return replace(part, vertices=vertices, faces=faces, body=Body(((vertices, faces),), DEFAULT_DENSITY))


def _hull(points: Array, thickness: float) -> Mesh:
    """Convex hull of points; where it has next to no volume, a box around them with sides of at least ``thickness``."""
    import trimesh
    from scipy.spatial import QhullError

    low, high = points.min(axis=0), points.max(axis=0)
    try:
        hull = trimesh.convex.convex_hull(points)
    except (QhullError, ValueError):
        hull = None
    if hull is None or not hull.volume > _FLAT * np.prod(np.maximum(high - low, thickness)):
        hull = trimesh.creation.box(np.maximum(high - low, thickness))
        hull.apply_translation(0.5 * (low + high))
    return np.asarray(hull.vertices, dtype=np.float64), np.asarray(hull.faces, dtype=np.int32)
