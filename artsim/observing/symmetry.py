"""Ways in which an object looks the same turned round, with parts exchanged: no method can tell them apart.

Scissors with two equal blades look the same after half a turn about their long axis, with the blades exchanged. An
estimate that mixes them up is as good as any. The search tries the rotations of a cube, and compares boxes, joints and
surfaces; so it finds half and quarter turns about the axes of the rest frame, and no others.
"""

from dataclasses import dataclass, replace
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.observing.interference import FOREIGN
from artsim.observing.sample import Sample

TOLERANCE = 0.01
"""Of the surfaces' chamfer distances, in diagonals: below it, two procedural objects count as near-duplicates, too."""
_BOX_TOLERANCE = 0.03
"""Of boxes and axes, in diagonals: wider, since a box is decided by its outermost points."""
_ANGLE_TOLERANCE = np.deg2rad(3.0)
"""Of axes and of the ranges of joints that turn."""
_DENSE, _PROBES = 20_000, 500
"""Points on each part's surface to measure distances to, and from: the spacing of dense ones is half the tolerance."""


@dataclass(frozen=True, eq=False)
class Symmetry:
    """An object in its rest frame equals itself turned, with its parts renumbered."""

    rotation: Array
    """(3, 3) float. Maps the place of part k to that of part ``parts[k]``, about the origin of the rest frame."""
    parts: NDArray[np.int64]
    """(K,) int64."""


def symmetries(obj: ArticulatedObject, tolerance: float = TOLERANCE) -> tuple[Symmetry, ...]:
    """All symmetries of an object but for the identity.

    Parameters
    ----------
    obj : ArticulatedObject
    tolerance : float
        Largest chamfer distance of a part's surface from that of its counterpart, in diagonals.
    """
    obj = obj.with_diagonal(1.0)
    possible = [
        Symmetry(rotation, parts)
        for rotation in _cube_rotations()[1:]
        if (parts := _counterparts(obj, rotation)) is not None and _same_joints(obj, rotation, parts)
    ]
    if not possible:  # of most objects, whose surfaces take long
        return ()
    clouds = [surface_points(obj, k) for k in range(len(obj))]
    trees = [cKDTree(cloud) if len(cloud) else None for cloud in clouds]
    return tuple(
        own for own in possible
        if all(_apart(clouds[k] @ own.rotation.T, trees[j], clouds[j]) <= tolerance for k, j in enumerate(own.parts))
    )  # fmt: skip


def equivalent_sample(sample: Sample, symmetry: Symmetry) -> Sample:
    """The same view with the truth written in the other of two equal ways: poses, boxes, joints, part ids and NPCS.

    Part k of the new truth is part ``parts[k]`` of the old one, and its rest frame is turned by the symmetry.
    """
    rotation, parts = symmetry.rotation, symmetry.parts
    turned = np.eye(4)
    turned[:3, :3] = rotation
    edge, sign, side = _edges(sample.joint_parent, sample.joint_axis, rotation, parts)
    number = np.append(np.argsort(parts), np.arange(len(parts), FOREIGN + 1))
    state = np.where(edge >= 0, sign * (sample.joint_state - sample.joint_rest)[edge], 0.0) + sample.joint_rest
    return replace(
        sample,
        T_camera_part=sample.T_camera_part[parts] @ turned,
        box_center=sample.box_center[parts] @ rotation,
        box_size=np.abs(sample.box_size[parts] @ rotation),
        visible_fraction=sample.visible_fraction[parts],
        joint_axis_camera=side[:, None] * sample.joint_axis_camera[edge],
        joint_origin_camera=sample.joint_origin_camera[edge],
        joint_state=state,
        part=number[sample.part].astype(np.uint8),
        npcs=((sample.npcs - 0.5) @ rotation.astype(np.float32) + np.float32(0.5)).astype(np.float32),
    )


def _cube_rotations() -> list[Array]:
    """The 24 proper rotations that map the axes onto one another, the identity first."""
    found = []
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            if np.linalg.det(matrix) > 0:
                found.append(matrix)
    return found


def surface_points(obj: ArticulatedObject, k: int) -> Array:
    """(N, 3) points spread evenly over a part's faces; always the same."""
    part = obj.parts[k]
    if len(part.faces) == 0:
        return np.zeros((0, 3))
    corners = obj.scale * part.vertices[part.faces]
    doubled = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    rng = np.random.default_rng(0)
    face = rng.choice(len(doubled), _DENSE, p=doubled / doubled.sum())
    u, v = rng.random((2, _DENSE))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    a, b, c = (corners[face, i] for i in range(3))
    points: Array = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    return points


def _counterparts(obj: ArticulatedObject, rotation: Array) -> NDArray[np.int64] | None:
    """(K,) part whose box lies where each part's box lies once turned; None where some box has no counterpart."""
    center, size = obj.box_center @ rotation.T, np.abs(obj.box_size @ rotation.T)
    away = np.abs(center[:, None] - obj.box_center).max(-1) + np.abs(size[:, None] - obj.box_size).max(-1)
    rows, columns = linear_sum_assignment(away)
    if away[rows, columns].max() > _BOX_TOLERANCE:
        return None
    return columns.astype(np.int64)


def _same_joints(obj: ArticulatedObject, rotation: Array, parts: NDArray[np.int64]) -> bool:
    """Whether the tree is the same once turned: each joint of the same kind, about the same line, with equal limits."""
    tree = obj.tree
    parent = np.array(tree.parents)
    edge, sign, _ = _edges(parent, tree.axes, rotation, parts)
    limits = tree.limits - tree.rest[:, None]
    for k in range(1, len(obj)):
        j = int(edge[k])
        if j < 0 or tree.types[k] != tree.types[j] or sign[k] == 0:
            return False
        own = limits[k] if sign[k] > 0 else -limits[k, ::-1]
        turns = tree.types[k] != "prismatic"
        bound = _ANGLE_TOLERANCE if turns else _BOX_TOLERANCE
        if not np.allclose(own, limits[j], atol=bound, rtol=0.0):
            return False
        offset = rotation @ tree.origins[k] - tree.origins[j]
        aside = offset - (offset @ tree.axes[j]) * tree.axes[j]
        if turns and np.linalg.norm(aside) > _BOX_TOLERANCE:
            return False
    return True


def _edges(
    parent: NDArray[np.int64], axis: Array, rotation: Array, parts: NDArray[np.int64]
) -> tuple[NDArray[np.int64], Array, Array]:
    """Joint that each joint becomes, and 1 or -1 by which its state and its axis are multiplied; 0 where axes differ.

    A joint is an edge of the tree. Where parent and child are exchanged, it moves the other way.
    """
    joint_of = {(int(parent[k]), k): (k, 1.0) for k in range(len(parts)) if parent[k] >= 0}
    joint_of |= {(child, above): (k, -s) for (above, child), (k, s) in list(joint_of.items())}
    edge, sign, side = np.full(len(parts), -1), np.zeros(len(parts)), np.zeros(len(parts))
    for k in range(len(parts)):
        if parent[k] < 0:
            edge[k] = k
            continue
        j, direction = joint_of.get((int(parts[parent[k]]), int(parts[k])), (-1, 0.0))
        cosine = float(rotation @ axis[k] @ axis[j]) if j >= 0 else 0.0
        side[k] = np.sign(cosine) * (abs(cosine) > np.cos(_ANGLE_TOLERANCE))
        edge[k], sign[k] = j, direction * side[k]
    return edge, sign, side


def _apart(turned: Array, tree: cKDTree | None, cloud: Array) -> float:
    """Chamfer distance of two clouds, mean of both directions; infinite where only one is empty."""
    if tree is None or len(turned) == 0:
        return 0.0 if tree is None and len(turned) == 0 else np.inf
    there, back = tree.query(turned[:_PROBES])[0], cKDTree(turned).query(cloud[:_PROBES])[0]
    return 0.5 * float(there.mean() + back.mean())
