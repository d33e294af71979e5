"""Boxes, cylinders, capsules, spheres and ellipsoids that a file describes in numbers.

The same bits on every processor, as :mod:`artsim.common.elementary` says; trimesh leaves them to BLAS and the C
library.
"""

from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from artsim.common.elementary import cos, sin
from artsim.common.products import unit
from artsim.model.kinematics import Array
from artsim.model.objects import Mesh

_SECTIONS = 64
_SUBDIVISIONS = 4


def box(size: Array) -> Mesh:
    """A box (3,) about the origin."""
    vertices, faces = _unit_box()
    return vertices * size, faces


@cache
def _unit_box() -> Mesh:
    import trimesh

    mesh = trimesh.creation.box((1.0, 1.0, 1.0))
    return np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int32)


def cylinder(radius: float, length: float) -> Mesh:
    """A cylinder about z, its middle at the origin: 64 sides."""
    vertices, faces = _unit_cylinder()
    return vertices * (radius, radius, length), faces


@cache
def _unit_cylinder() -> Mesh:
    return _turn([-0.5, 0.5], [1.0, 1.0], (-0.5, 0.5))


def capsule(radius: float, length: float) -> Mesh:
    """A cylinder about z, its middle at the origin, with half a ball on either end: 64 sides, 16 rings to a half."""
    ball, ends, faces = _unit_capsule()
    return radius * ball + (0.5 * length) * ends, faces


@cache
def _unit_capsule() -> tuple[Array, Array, NDArray[np.int32]]:
    """Points of the unit ball (V, 3), which way (V, 3) each goes as the capsule grows longer, and the triangles."""
    angles = np.arange(_SECTIONS // 4) * (0.5 * np.pi / (_SECTIONS // 4))
    heights, radii = sin(angles), cos(angles)
    ball, faces = _turn([*-heights[::-1], *heights], [*radii[::-1], *radii], (-1.0, 1.0))
    upper = np.zeros((len(ball), 3))
    upper[:, 2] = -1.0
    upper[len(heights) * _SECTIONS : 2 * len(heights) * _SECTIONS, 2] = 1.0
    upper[-1, 2] = 1.0
    return ball, upper, faces


def _turn(heights: list[float], radii: list[float], ends: tuple[float, float]) -> Mesh:
    """Closed surface of rings about z, from the lowest to the highest, and of the two points that close it."""
    angles = np.arange(_SECTIONS) * (2.0 * np.pi / _SECTIONS)
    circle = np.stack([cos(angles), sin(angles)], axis=1)
    rings: list[Array] = [
        np.column_stack([radius * circle, np.full(_SECTIONS, height)])
        for height, radius in zip(heights, radii, strict=True)
    ]
    a = np.arange(_SECTIONS)
    b = (a + 1) % _SECTIONS
    starts = range(0, len(rings) * _SECTIONS, _SECTIONS)
    corners = [triangle for i, j in pairwise(starts) for triangle in ((a + i, b + i, b + j), (a + i, b + j, a + j))]
    bottom = np.full(_SECTIONS, len(rings) * _SECTIONS)
    corners += [(b, a, bottom), (a + starts[-1], b + starts[-1], bottom + 1)]
    faces: NDArray[np.int32] = np.concatenate([np.stack(triangle, axis=1) for triangle in corners]).astype(np.int32)
    return np.concatenate([*rings, [(0.0, 0.0, ends[0]), (0.0, 0.0, ends[1])]]), faces


def sphere(radius: float) -> Mesh:
    """A sphere about the origin: an icosahedron whose faces are divided in four, four times."""
    vertices, faces = _unit_sphere()
    return radius * vertices, faces


def ellipsoid(radii: Array) -> Mesh:
    """An ellipsoid about the origin with (3,) half axes along x, y and z; triangles as of a sphere."""
    vertices, faces = _unit_sphere()
    return vertices * radii, faces


@cache
def _unit_sphere() -> Mesh:
    """Made once: a thousand of them would take a second."""
    import trimesh

    solid = trimesh.creation.icosahedron()
    vertices, faces = np.asarray(solid.vertices, dtype=np.float64), np.asarray(solid.faces)
    for _ in range(_SUBDIVISIONS):
        vertices, faces = trimesh.remesh.subdivide(vertices, faces)
        vertices = unit(vertices)
    return vertices, faces.astype(np.int32)
