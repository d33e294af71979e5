"""Putting things down: at rest on a level surface, none overlapping another."""

import weakref
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any

import numpy as np

from artsim.common.elementary import arccos, arctan2, cos
from artsim.common.extras import require_extra
from artsim.common.products import apply, dot, matmul, unit
from artsim.model.appearance import Coat
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject, Part
from artsim.model.transforms import rotation_about
from artsim.renderers.scene import Thing, used_vertices

GAP = 0.004
"""Metres between any two things."""
_STEADY = np.deg2rad(2.5)
"""What must be tipped further than this before it falls over stays the way it was made to stand."""
_TURN = (-0.6, 0.6)  # radians about the vertical for what stands upright; what lies lies any way
_YIELD = 0.02  # of the height of its centre of mass: how deep a thing may sink in to find its footing
_LEVEL = 1e-6  # of an object's size: corners that touch the ground together
_TRIES = 200
_CHOICE = 12  # places that are compared for each thing
_TALL = 0.15  # metres: what is higher stands rather at the back, what is lower at the front
_HIDDEN = 0.4  # of its width and height: what covers more of a thing hides it
_UPRIGHT = cos(np.deg2rad(30.0))  # what leans less is turned like what stands upright


@dataclass(frozen=True)
class Area:
    """A level rectangle to put things on."""

    low: tuple[float, float]
    high: tuple[float, float]
    """Corners in world x and y, metres."""
    height: float = 0.0
    """World z, metres."""


@dataclass
class Arrangement:
    """Things put down one after another.

    Tall things tend to stand at the back (+X), none before another where that can be, and everything close together.
    """

    area: Area
    things: list[Thing] = field(default_factory=list)
    crowded: bool = False
    """Things may hide one another, and the tall need not stand at the back."""

    def put(
        self,
        obj: ArticulatedObject,
        q: Array,
        coats: tuple[Coat, ...],
        rng: np.random.Generator,
        upright: bool = False,
    ) -> Thing | None:
        """Put an object down where there is room for it.

        Parameters
        ----------
        obj : ArticulatedObject
        q : (K,) float
        coats : tuple of Coat
        rng : numpy Generator
        upright : bool
            It is held, and need not stand or lie steadily.

        Returns
        -------
        Thing or None
            None where no room was found.
        """
        resting = np.eye(3) if upright else resting_rotation(obj)
        turn = (-np.pi, np.pi) if resting[2, 2] < _UPRIGHT else _TURN
        at_origin = Thing(obj, q, np.eye(4), coats).vertices
        tall = float(np.ptp(dot(at_origin, resting[2])))
        best, least, found = None, np.inf, 0
        for _ in range(_TRIES):
            rotation = matmul(rotation_about((0, 0, 1), rng.uniform(*turn)), resting)
            posed = apply(rotation, at_origin)
            low, high = posed.min(axis=0), posed.max(axis=0)
            room_low, room_high = np.asarray(self.area.low) - low[:2], np.asarray(self.area.high) - high[:2]
            if (room_low > room_high).any():
                continue
            spread = 0.25 + 0.75 * found / _CHOICE
            middle, half = 0.5 * (room_low + room_high), 0.5 * (room_high - room_low)
            place = middle + rng.uniform(-1.0, 1.0, 2) * half * max(spread, rng.random())
            T = np.eye(4)
            T[:3, :3], T[:3, 3] = rotation, (*place, self.area.height - low[2])
            thing = Thing(obj, q, T, coats)
            if any(not are_apart(thing, other) for other in self.things):
                continue
            found += 1
            off = (place - 0.5 * (np.add(self.area.low, self.area.high))) / np.subtract(self.area.high, self.area.low)
            back = 0.0 if self.crowded else 0.4 * np.clip((tall - _TALL) / _TALL, -1.0, 1.0)
            cost = float(abs(off[0] - back) + 0.5 * abs(off[1]))
            if not self.crowded:
                cost += sum(_hides(thing, other) + _hides(other, thing) for other in self.things)
            if cost < least:
                best, least = thing, cost
            if found == _CHOICE:
                break
        if best is not None:
            self.things.append(best)
        return best


def _hides(front: Thing, back: Thing) -> bool:
    """Whether one thing may hide a good part of another from who looks towards +X."""
    (low, high), (far_low, far_high) = ((t.part_boxes[:, 0].min(0), t.part_boxes[:, 1].max(0)) for t in (front, back))
    overlap = min(high[1], far_high[1]) - max(low[1], far_low[1])
    beside = overlap < _HIDDEN * (far_high[1] - far_low[1])
    return bool(low[0] + high[0] < far_low[0] + far_high[0] and high[2] > _HIDDEN * far_high[2] and not beside)


def resting_rotation(obj: ArticulatedObject) -> Array:
    """How an object at rest stands or lies on the ground: (nearly) upright where that is steady, else as low as can be.

    Every part weighs as much as its convex hull, at the density of its body where it has one.

    Returns
    -------
    (3, 3) float
        Rotation from the rest frame to a world with Z up.
    """
    from scipy.spatial import ConvexHull, QhullError

    posed = Thing(obj, obj.tree.rest, np.eye(4), ()).vertices
    try:
        hull = ConvexHull(posed)
    except QhullError:  # flat: it lies as it is
        return np.eye(3)
    corners, middle = posed[hull.vertices], _center_of_mass(obj)
    normals = np.concatenate([[(0.0, 0.0, -1.0)], np.unique(np.round(hull.equations[:, :3], 4), axis=0)])
    normals = unit(normals)
    reach = matmul(corners, normals.T).max(axis=0)
    height = reach - dot(normals, middle)  # of the centre of mass above the ground, each normal pointing down
    level = _LEVEL * float(np.ptp(posed, axis=0).max())
    leaning = normals[:, 2] > -_UPRIGHT
    for n in (0, *np.lexsort((height, leaning))):
        touching = corners[dot(corners, normals[n]) > reach[n] - max(level, _YIELD * height[n])]
        if _steadiness(touching, normals[n], middle, float(height[n])) > _STEADY:
            return np.eye(3) if n == 0 else _turn_down(normals[n])
    return np.eye(3)


def _steadiness(touching: Array, down: Array, middle: Array, height: float) -> float:
    """Angle in radians by which a body that touches the ground at some points must be tipped until it falls over."""
    from scipy.spatial import ConvexHull, QhullError

    plane = _turn_down(down)[:2]
    try:
        base = ConvexHull(matmul(touching - middle, plane.T))
    except (QhullError, ValueError):  # an edge or a corner
        return 0.0
    return arctan2(float((-base.equations[:, 2]).min()), height)


def _turn_down(normal: Array) -> Array:
    """(3, 3) rotation by the least angle that makes a unit vector point down."""
    down = np.array([0.0, 0.0, -1.0])
    axis, cosine = np.cross(normal, down), float(np.clip(dot(normal, down), -1.0, 1.0))
    if dot(axis, axis) < 1e-16:
        return np.eye(3) if cosine > 0 else np.diag([1.0, -1.0, -1.0])
    return rotation_about(axis, arccos(cosine))


def _center_of_mass(obj: ArticulatedObject) -> Array:
    """(3,) at rest, rest frame, metres."""
    total, moment = 0.0, np.zeros(3)
    for part in obj.parts:
        volume, center = _hull_volume(part)
        mass = volume * (1.0 if part.body is None else part.body.density)
        total, moment = total + mass, moment + mass * center * obj.scale
    return moment / max(total, 1e-300)


def _hull_volume(part: Part) -> tuple[float, Array]:
    """Volume and centroid of a part's convex hull, native units; next to no volume for a flat part."""
    from scipy.spatial import ConvexHull, QhullError

    if len(part.faces) == 0:
        return 0.0, np.zeros(3)
    points = used_vertices(part)
    inside = points.mean(axis=0)
    try:
        hull = ConvexHull(points)
    except QhullError:
        return 1e-12, inside
    tetrahedra = points[hull.simplices] - inside
    volumes = np.abs(dot(tetrahedra[:, 0], np.cross(tetrahedra[:, 1], tetrahedra[:, 2]))) / 6.0
    return float(volumes.sum()), inside + (volumes[:, None] * tetrahedra.sum(axis=1) / 4.0).sum(axis=0) / volumes.sum()


def are_apart(one: Thing, other: Thing, gap: float = GAP) -> bool:
    """Whether the surfaces of two things that stand on one plane keep a distance, metres.

    Neither is then inside the other: the lowest point of a thing inside a solid would lie on that solid's underside.

    Raises
    ------
    ConfigError
        When python-fcl is not installed.
    """
    first, second = one.part_boxes, other.part_boxes
    low, high = first[:, None, 0], first[:, None, 1]
    near = ((low <= second[None, :, 1] + gap) & (second[None, :, 0] <= high + gap)).all(axis=2)
    return all(_distance(one, int(i), other, int(j)) >= gap for i, j in zip(*near.nonzero(), strict=True))


def _distance(one: Thing, i: int, other: Thing, j: int) -> float:
    """Metres between the surfaces of two posed parts; 0 where they cross."""
    fcl, first, second = _import_fcl(), _model(one.obj, i), _model(other.obj, j)
    T, S = one.T_world_part[i], other.T_world_part[j]
    here = fcl.CollisionObject(first, fcl.Transform(T[:3, :3], T[:3, 3]))
    there = fcl.CollisionObject(second, fcl.Transform(S[:3, :3], S[:3, 3]))
    if fcl.collide(here, there, fcl.CollisionRequest(), fcl.CollisionResult()):
        return 0.0
    return max(float(fcl.distance(here, there, fcl.DistanceRequest(), fcl.DistanceResult())), 0.0)


_models: weakref.WeakKeyDictionary[Part, tuple[float, Any]] = weakref.WeakKeyDictionary()


def _model(obj: ArticulatedObject, k: int) -> Any:
    """FCL's model of a part, kept as long as the part."""
    from artsim.model.collision import surface_model

    scale, model = _models.get(obj.parts[k], (0.0, None))
    if scale != obj.scale:
        model = surface_model(obj, k)
        _models[obj.parts[k]] = obj.scale, model
    return model


def _import_fcl() -> ModuleType:
    with require_extra("scene"):
        import fcl
    return fcl
