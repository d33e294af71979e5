"""Maps of whole objects: surfaces, collision pieces and joints go together."""

from collections.abc import Callable, Collection
from dataclasses import replace
from itertools import pairwise

import numpy as np
from manifold3d import Manifold
from numpy.typing import NDArray

from artsim.model.details import detail_of, on_faces
from artsim.model.joints import Joint, Mimic
from artsim.model.kinematics import Array, KinematicTree
from artsim.model.objects import UNKNOWN_DYNAMICS, ArticulatedObject, Body, Mesh, Part
from artsim.model.stretching import AxisMap

_ON_PLANE = 1e-9
"""Share of the extent within which a corner lies on a plane that cuts the surface."""
_EXACT = 1e-9
"""Share of the volume by which a mapped piece may differ from its hull and count as convex."""


def cut_at(mesh: Mesh, axis: int, value: float) -> Mesh:
    """The surface with every triangle cut in two where coordinate ``axis`` equals ``value``.

    Neighbours share the new corners: a closed surface stays closed.
    """
    vertices, faces = mesh
    offset = vertices[:, axis] - value
    slack = _ON_PLANE * max(float(np.ptp(vertices[:, axis])), 1e-300) if len(vertices) else 0.0
    side = np.where(np.abs(offset) <= slack, 0, np.sign(offset)).astype(np.int64)
    sides = side[faces]
    crossing = (sides.min(axis=1, initial=1) < 0) & (sides.max(axis=1, initial=-1) > 0)
    if not crossing.any():
        return mesh
    touched, their = faces[crossing], sides[crossing]
    touching = (their == 0).any(axis=1)
    lone = np.where(
        touching, np.argmax(their == 0, axis=1), np.argmax(their == -np.sign(their.sum(axis=1))[:, None], 1)
    )
    a, b, c = (np.take_along_axis(touched, ((lone + i) % 3)[:, None], axis=1)[:, 0].astype(np.int64) for i in range(3))
    ends = np.concatenate(
        [np.stack([b, c], 1)[touching], np.stack([a, b], 1)[~touching], np.stack([a, c], 1)[~touching]]
    )
    ends = np.where(side[ends[:, :1]] < 0, ends, ends[:, ::-1])  # from below upwards, as every neighbour does
    edges, index = np.unique(ends, axis=0, return_inverse=True)
    low, high = vertices[edges[:, 0]], vertices[edges[:, 1]]
    share = (value - low[:, axis]) / (high[:, axis] - low[:, axis])
    added = low + share[:, None] * (high - low)
    added[:, axis] = value
    index = index.reshape(-1) + len(vertices)
    count, others = int(touching.sum()), int((~touching).sum())
    m, n, o = index[:count], index[count : count + others], index[count + others :]
    two = [(a[touching], b[touching], m), (a[touching], m, c[touching])]
    three = [
        (a[~touching], n, o), (n, b[~touching], c[~touching]), (n, c[~touching], o)
    ]  # fmt: skip
    new = np.concatenate([np.stack(corners, axis=1) for corners in (*two, *three)])
    return np.concatenate([vertices, added]), np.concatenate([faces[~crossing], new]).astype(np.int32)


def stretched(obj: ArticulatedObject, axis: int, along: AxisMap, carried: Collection[int] = ()) -> ArticulatedObject:
    """The object with one coordinate mapped; carried parts keep their shape, and go where the middle of their box goes.

    No joint of another part may mind (:func:`artsim.model.stretching.stretchable_axes`).
    """

    def place(points: Array) -> Array:
        moved = points.copy()
        moved[..., axis] = along(points[..., axis])
        return moved

    def cut(mesh: Mesh) -> Mesh:
        for knot in along.knots[1:-1]:
            mesh = cut_at(mesh, axis, float(knot))
        return mesh

    def surface(mesh: Mesh) -> Mesh:
        vertices, faces = cut(mesh)
        return place(vertices), faces

    def pieces(piece: Mesh) -> list[Mesh]:
        vertices, faces = cut(piece)
        whole = _volume(place(vertices), faces)
        mapped = place(piece[0]), piece[1]
        hull = Manifold.hull_points(place(vertices))
        if max(abs(_volume(*mapped) - whole), abs(hull.volume() - whole)) <= _EXACT * abs(whole):
            return [mapped]  # a box stays a box
        coordinate, slack = vertices[:, axis], _ON_PLANE * float(np.ptp(vertices[:, axis]))
        ends = np.concatenate([[-np.inf], along.knots[1:-1], [np.inf]])
        slabs = [(coordinate >= a - slack) & (coordinate <= b + slack) for a, b in pairwise(ends)]
        hulls = [Manifold.hull_points(place(vertices[slab])) for slab in slabs if slab.sum() > 3]
        return [_mesh(solid) for solid in hulls if solid.volume() > _EXACT * abs(whole)]

    def move(points: Array, k: int) -> Array:
        if k not in carried:
            return place(points)
        center = obj.parts[k].bounds.mean(axis=0)
        return points + (place(center) - center)

    joints = [
        joint if k == 0 else replace(joint, origin=triple(move(np.asarray(joint.origin), k)))
        for k, joint in enumerate(obj.native_tree.joints)
    ]
    parts = [
        part.moved(move(np.zeros(3), k))
        if k in carried
        else _mapped(part, surface, lambda body: [new for piece in body.pieces for new in pieces(piece)])
        for k, part in enumerate(obj.parts)
    ]
    return replace(obj, parts=tuple(parts), native_tree=KinematicTree(joints))


def resized(obj: ArticulatedObject, factors: Array, carried: Collection[int] = ()) -> ArticulatedObject:
    """The object times (3,) positive factors; carried parts keep their proportions, and grow by the least factor.

    Factors are equal on axes that a joint of another part turns into one another.
    """
    tree, least = obj.native_tree, float(factors.min())

    def place(points: Array, k: int) -> Array:
        if k not in carried:
            return points * factors
        center = obj.parts[k].bounds.mean(axis=0)
        return (points - center) * least + center * factors

    grown = np.linalg.norm(tree.axes * factors, axis=1)
    axes = tree.axes * factors / grown[:, None]
    for k in carried:
        grown[k], axes[k] = least, tree.axes[k]
    unit = np.where([kind == "prismatic" for kind in tree.types], grown, 1.0)

    def joint_of(k: int, joint: Joint) -> Joint:
        if k == 0:
            return joint
        mimic = joint.mimic
        if mimic is not None:
            share = float(unit[k] / unit[mimic.source])
            mimic = Mimic(mimic.source, mimic.multiplier * share, mimic.offset * float(unit[k]))
        return replace(
            joint,
            axis=triple(axes[k]),
            origin=triple(place(tree.origins[k], k)),
            lower=joint.lower * float(unit[k]),
            upper=joint.upper * float(unit[k]),
            rest=joint.rest * float(unit[k]),
            pitch=joint.pitch * float(grown[k]),
            mimic=mimic,
        )

    def part_of(k: int, part: Part) -> Part:
        def surface(mesh: Mesh) -> Mesh:
            return place(mesh[0], k), mesh[1]

        return _mapped(part, surface, lambda body: [surface(piece) for piece in body.pieces])

    joints = [joint_of(k, joint) for k, joint in enumerate(tree.joints)]
    parts = tuple(part_of(k, part) for k, part in enumerate(obj.parts))
    return replace(obj, parts=parts, native_tree=KinematicTree(joints))


def fitted(part: Part, bounds: Array, mirrored: NDArray[np.bool_]) -> Part:
    """The part with its box moved and stretched onto another (2, 3), reflected along some axes (3,)."""
    low, high = bounds
    own_low, own_high = part.bounds
    factor = (high - low) / np.maximum(own_high - own_low, 1e-12) * np.where(mirrored, -1.0, 1.0)
    center, goal = 0.5 * (own_low + own_high), 0.5 * (low + high)
    inside_out = bool(mirrored.sum() % 2)

    def surface(mesh: Mesh) -> Mesh:
        faces = mesh[1][:, ::-1] if inside_out else mesh[1]
        return (mesh[0] - center) * factor + goal, np.ascontiguousarray(faces)

    return _mapped(part, surface, lambda body: [surface(piece) for piece in body.pieces])


def centered(obj: ArticulatedObject) -> ArticulatedObject:
    """The object with the origin at the centre of its box at rest."""
    bounds = np.stack([part.bounds for part in obj.parts if len(part.faces)])
    center = 0.5 * (bounds[:, 0].min(axis=0) + bounds[:, 1].max(axis=0))
    joints = [
        joint if k == 0 else replace(joint, origin=triple(np.asarray(joint.origin) - center))
        for k, joint in enumerate(obj.native_tree.joints)
    ]
    return replace(obj, parts=tuple(part.moved(-center) for part in obj.parts), native_tree=KinematicTree(joints))


def _mapped(part: Part, surface: Callable[[Mesh], Mesh], pieces: Callable[[Body], list[Mesh]]) -> Part:
    vertices, faces = surface((part.vertices, part.faces))
    body = part.body
    if body is not None:  # what the file said of the physics was that of another shape
        body = replace(body, pieces=tuple(pieces(body)), inertia=None, joint=UNKNOWN_DYNAMICS)
    details = []
    for detail in part.details:
        own, kept = tuple(pieces(Body(detail.pieces, 0.0))), detail.faces
        if kept is None:
            points = np.concatenate([corners for corners, _ in own])
        else:  # faces may be cut in several
            moved, its = surface((part.vertices, part.faces[kept]))
            points = moved[its].reshape(-1, 3)
            slack = 1e-9 * float(np.ptp(vertices, axis=0).max())
            kept = np.flatnonzero(on_faces(vertices[faces].mean(axis=1), moved, its, slack))
        outward = detail.T_rest_detail[:3, 0]
        details.append(detail_of(detail.label, points, vertices, outward, own, kept))
    return replace(part, vertices=vertices, faces=faces, body=body, details=tuple(details))


def _volume(vertices: Array, faces: NDArray[np.int32]) -> float:
    corners = (vertices - vertices[0])[faces]
    return float(np.einsum("ni,ni->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))) / 6.0


def _mesh(solid: Manifold) -> Mesh:
    mesh = solid.to_mesh64()
    return np.array(mesh.vert_properties, dtype=np.float64)[:, :3], np.array(mesh.tri_verts, dtype=np.int32)


def triple(vector: Array) -> tuple[float, float, float]:
    """A (3,) array as a joint holds it."""
    x, y, z = vector.tolist()
    return x, y, z
