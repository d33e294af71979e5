"""Bodies of parts whose file says what collides and what it weighs, as MJCF and USD do."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from artsim.common.products import matmul
from artsim.loading.bodies import RigidBody
from artsim.loading.meshes import MeshReader, check_range
from artsim.loading.urdf_document import UrdfRobot
from artsim.loading.zero_pose import combined
from artsim.model.convex_bodies import DEFAULT_DENSITY, convex_hull
from artsim.model.inertia import Inertia
from artsim.model.kinematics import Array
from artsim.model.objects import UNKNOWN_DYNAMICS, Body, JointDynamics, Mesh, Part
from artsim.model.transforms import transform_points

_THIN = 0.01
"""Share of its length as which a flat part counts as thick."""
_SPECK = 1e-4
"""Least side of the box, metres, that stands for a part without a surface."""


def with_described_bodies(
    parts: Sequence[Part],
    bodies: Sequence[RigidBody],
    robot: UrdfRobot,
    reader: MeshReader,
    T_rest_part: Array,
    file: Path,
) -> list[Part]:
    """Parts with the bodies that the document gives them; without, where it says nothing of one.

    ``bodies`` are what each part is made of; ``T_rest_part`` (K, 4, 4) maps the base link's frame, as each part carries
    it from the file's zero to rest, to the rest frame. Raises AssetError when something lies too far away to compute
    with.
    """
    links = {link.name: link for link in robot.links}
    if not any(link.collision or link.inertia is not None for link in links.values()):
        return list(parts)
    found = []
    for part, body, T in zip(parts, bodies, T_rest_part, strict=True):
        pieces: list[Mesh] = []
        inertias: list[Inertia] = []
        for name in body.links:
            link, T_rest_link = links[name], matmul(T, body.T_base_link[name])
            for shape in link.collision:
                vertices, faces = reader.shape(shape.geometry)
                vertices = transform_points(matmul(T_rest_link, shape.origin), vertices)
                check_range(vertices, f"{file}: body {name!r}")
                pieces.append((vertices, faces))
            if link.inertia is not None:
                inertias.append(link.inertia.transformed(T_rest_link))
                check_range(inertias[-1].center, f"{file}: body {name!r}")
        joint = UNKNOWN_DYNAMICS if body.joint is None else body.joint.dynamics
        found.append(replace(part, body=_body(part, pieces, combined(inertias), joint)))
    return found


def _body(part: Part, pieces: list[Mesh], inertia: Inertia | None, joint: JointDynamics) -> Body | None:
    """A body whose mass, spread over the solid that the part's surface encloses, or else over its hull, is the same."""
    if inertia is None and not pieces:
        return None
    import trimesh

    solid: Mesh | None = None
    volume = 0.0
    if len(part.faces):
        surface = trimesh.Trimesh(part.vertices, part.faces, process=False)
        surface.merge_vertices()
        with np.errstate(divide="ignore", invalid="ignore"):  # without a volume, which is what is asked
            volume = float(surface.volume) if surface.is_volume else 0.0
    if volume <= 0.0:
        points = np.concatenate([part.vertices, *(vertices for vertices, _ in pieces)])
        if len(points) == 0:
            points = np.zeros((1, 3)) if inertia is None else inertia.center[None]
        solid = convex_hull(points, max(_THIN * float(np.ptp(points, axis=0).max()), _SPECK))
        volume = float(trimesh.Trimesh(*solid, process=False).volume)
    density = DEFAULT_DENSITY if inertia is None else inertia.mass / volume
    return Body(tuple(pieces), density, solid, inertia, joint)
