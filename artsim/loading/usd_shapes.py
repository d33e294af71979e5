"""Surfaces of USD prims: meshes, cubes, spheres, cylinders, capsules and cones."""

from typing import Any

import numpy as np

from artsim.loading import primitives
from artsim.loading.mesh_files.polygons import triangulate
from artsim.loading.mesh_files.surface import UnusableMeshError, is_thin, mirrors, transform_affine
from artsim.loading.usd_values import integers, number, token, vectors
from artsim.model.kinematics import Array
from artsim.model.objects import Mesh

KINDS = ("Mesh", "Cube", "Sphere", "Cylinder", "Capsule", "Cone")
"""Types of prims that are read."""
_LARGEST = 1e6
"""Metres that nothing is away."""
_UPRIGHT = {"X": [[0, 0, 1], [1, 0, 0], [0, 1, 0]], "Y": [[0, 1, 0], [0, 0, 1], [1, 0, 0]], "Z": np.eye(3).tolist()}
"""Rotations that carry the Z axis to the axis of a prim."""


def surface(prim: Any, T: Array, max_faces: int) -> Mesh:
    """Vertices and triangles of a prim, by an affine transform (4, 4) out of its own frame.

    Raises
    ------
    UnusableMeshError
        When it has no triangle, too many, no extent, or a coordinate out of range.
    """
    kind = str(prim.GetTypeName())
    vertices, faces = _mesh(prim, max_faces) if kind == "Mesh" else _primitive(prim, kind)
    if len(faces) == 0:
        raise UnusableMeshError(f"{prim.GetPath()} has no faces")
    if mirrors(T):
        faces = faces[:, ::-1]
    moved = transform_affine(T, vertices)
    if not (np.abs(moved) <= _LARGEST).all():
        raise UnusableMeshError(f"{prim.GetPath()} has a coordinate that is not finite, or over {_LARGEST:g} m")
    if is_thin(moved, faces):
        raise UnusableMeshError(f"{prim.GetPath()} has no extent: all of it lies on a line or in a point")
    return moved, np.ascontiguousarray(faces, dtype=np.int32)


def _mesh(prim: Any, max_faces: int) -> Mesh:
    from pxr import UsdGeom

    mesh = UsdGeom.Mesh(prim)
    points = vectors(mesh.GetPointsAttr())
    counts, corners = integers(mesh.GetFaceVertexCountsAttr()), integers(mesh.GetFaceVertexIndicesAttr())
    if len(corners) > 3 * max_faces or len(points) > max_faces:
        raise UnusableMeshError(f"{prim.GetPath()} has over {max_faces} triangles")
    if (counts < 0).any() or counts.sum() != len(corners):
        raise UnusableMeshError(f"{prim.GetPath()} has {len(corners)} corners, which its counts of corners do not fit")
    holes = integers(mesh.GetHoleIndicesAttr())
    if len(holes):
        kept = np.ones(len(counts), dtype=bool)
        kept[holes[(holes >= 0) & (holes < len(counts))]] = False
        corners, counts = corners[np.repeat(kept, counts)], counts[kept]
    faces = corners[triangulate(points, corners, counts).corners]
    if token(mesh.GetOrientationAttr(), "") == UsdGeom.Tokens.leftHanded:
        faces = faces[:, ::-1]
    return points, faces.astype(np.int32)


def _primitive(prim: Any, kind: str) -> Mesh:
    from pxr import UsdGeom

    if kind == "Cube":
        return primitives.box(np.full(3, number(UsdGeom.Cube(prim).GetSizeAttr(), 2.0)))
    if kind == "Sphere":
        return primitives.sphere(number(UsdGeom.Sphere(prim).GetRadiusAttr(), 1.0))
    shape = getattr(UsdGeom, kind)(prim)
    radius, height = number(shape.GetRadiusAttr(), 1.0), number(shape.GetHeightAttr(), 2.0)
    make = {"Cylinder": primitives.cylinder, "Capsule": primitives.capsule, "Cone": _cone}[kind]
    vertices, faces = make(radius, height)
    return vertices @ np.array(_UPRIGHT[token(shape.GetAxisAttr(), "Z", ("X", "Y", "Z"))], dtype=np.float64).T, faces


def _cone(radius: float, height: float) -> Mesh:
    """A cone about z, its tip up and its middle at the origin."""
    vertices, faces = primitives.cylinder(radius, height)
    pointed: Array = np.where((vertices[:, 2] > 0)[:, None], [0.0, 0.0, 0.5 * height], vertices)
    at_tip = pointed[faces, 2] > 0
    return pointed, np.where(at_tip, len(pointed) - 1, faces)[at_tip.sum(axis=1) < 2]
