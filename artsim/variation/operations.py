"""What may be done to an object: each operation draws its numbers, and says what it did.

An operation is a function of an object, a generator, a strength between 0 and 1, and other objects of the category. It
returns the new object and a record of names and numbers that JSON can hold, or None where it finds nothing to do.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artsim.model.kinematics import Array, KinematicTree
from artsim.model.objects import ArticulatedObject
from artsim.model.stretching import APART, SIDEWAYS, AxisMap, coupled_axes, draw_axis_map, stretchable_axes
from artsim.model.transforms import rotation_about
from artsim.variation.geometry import fitted, resized, stretched, triple

Change = tuple[ArticulatedObject, dict[str, Any]]
Operation = Callable[[ArticulatedObject, np.random.Generator, float, Sequence[ArticulatedObject]], Change | None]

_WHOLE = 0.2
"""Standard deviation of the logarithm of the factors of the whole object's sides."""
_SMALL = 0.15
"""Diagonal of a part over the object's, below which it is carried instead of stretched."""
_RANGE, _RANGE_BOUNDS = 0.3, (0.4, 1.25)
"""Standard deviation of the logarithm of a joint's range, and between which factors it stays."""
_LEAN, _SHIFT = np.deg2rad(1.5), 0.004
"""Standard deviations of an axis's lean in radians, and of its shift in diagonals."""
_HALF_TURN = np.pi + 1e-6
"""Axes of joints that turn farther stay: what is round about them would wobble."""
_MOST, _OUT_OF_SHAPE = 2.5, 2.0
"""Largest factor of a side of an exchanged part, and of the factors of two of its sides over each other."""


def stretch(
    obj: ArticulatedObject, rng: np.random.Generator, strength: float, others: Sequence[ArticulatedObject]
) -> Change | None:
    """Stretch between the edges of parts where no joint minds, and the whole object along every axis.

    Small parts that carry none, such as dials and buttons, keep their shape: their joints mind nothing.
    """
    tree, size = obj.native_tree, obj.diagonal / obj.scale
    carried = [k for k in _leaves(tree) if np.linalg.norm(np.ptp(obj.parts[k].bounds, axis=0)) < _SMALL * size]
    boxes = np.stack([part.bounds for k, part in enumerate(obj.parts) if len(part.faces) and k not in carried])
    others_axes = np.delete(tree.axes, carried, axis=0)
    types = [kind for k, kind in enumerate(tree.types) if k not in carried]
    maps = {}
    for axis in stretchable_axes(others_axes, types):
        drawn = draw_axis_map(boxes[:, :, axis].ravel(), APART * size, axis == SIDEWAYS, rng)
        if len(drawn.knots) > 2:
            maps["xyz"[axis]] = {
                "from": drawn.knots.tolist(),
                "to": (drawn.knots + strength * (drawn.goals - drawn.knots)).tolist(),
            }
    factors = np.ones(3)
    for group in coupled_axes(others_axes, types):
        factors[group] = np.exp(strength * _WHOLE * np.clip(rng.standard_normal(), -2.5, 2.5))
    for name, record in maps.items():
        along = AxisMap(np.array(record["from"]), np.array(record["to"]))
        obj = stretched(obj, "xyz".index(name), along, carried)
    record = {"between_edges": maps, "factors": factors.tolist(), "carried": [obj.parts[k].name for k in carried]}
    return resized(obj, factors, carried), record


def change_limits(
    obj: ArticulatedObject, rng: np.random.Generator, strength: float, others: Sequence[ArticulatedObject]
) -> Change | None:
    """Multiply the ranges of joints, on both sides of the rest state."""
    tree = obj.native_tree
    joints, record = list(tree.joints), {}
    for k in _own_joints(tree):
        joint = joints[k]
        factor = float(np.clip(np.exp(strength * _RANGE * rng.standard_normal()), *_RANGE_BOUNDS))
        turns = joint.type == "revolute"
        if turns and joint.upper - joint.lower < 2.0 * np.pi:
            factor = min(factor, 2.0 * np.pi / (joint.upper - joint.lower))
        if not 0.0 < joint.upper - joint.lower < np.inf:
            continue
        lower, upper = (joint.rest + factor * (end - joint.rest) for end in (joint.lower, joint.upper))
        joints[k] = replace(joint, lower=lower, upper=upper)
        record[obj.parts[k].name] = {"factor": factor, "lower": lower, "upper": upper}
    return (replace(obj, native_tree=KinematicTree(joints)), record) if record else None


def move_axes(
    obj: ArticulatedObject, rng: np.random.Generator, strength: float, others: Sequence[ArticulatedObject]
) -> Change | None:
    """Lean and shift the axis of one hinge that turns by at most half a turn, or lean that of a slide."""
    tree = obj.native_tree
    able = [
        k
        for k in _own_joints(tree)
        if tree.types[k] == "prismatic" or (tree.types[k] == "revolute" and np.ptp(tree.limits[k]) <= _HALF_TURN)
    ]
    if not able:
        return None
    k = int(rng.choice(able))
    joint, axis = tree.joints[k], tree.axes[k]
    across = _across(axis, rng)
    lean = float(strength * _LEAN * rng.standard_normal())
    shift = strength * _SHIFT * obj.diagonal / obj.scale * float(rng.standard_normal()) * _across(axis, rng)
    shift = np.zeros(3) if joint.type == "prismatic" else shift
    new = rotation_about(across, lean) @ axis
    moved = replace(joint, axis=triple(new / np.linalg.norm(new)), origin=triple(tree.origins[k] + shift))
    joints = [moved if i == k else other for i, other in enumerate(tree.joints)]
    record = {"part": obj.parts[k].name, "lean_deg": float(np.rad2deg(lean)), "shift": shift.tolist()}
    return replace(obj, native_tree=KinematicTree(joints)), record


def exchange_part(
    obj: ArticulatedObject, rng: np.random.Generator, strength: float, others: Sequence[ArticulatedObject]
) -> Change | None:
    """Give one leaf part the shape of another object's part with the same label and type of joint.

    It is fitted to the box of the part that it replaces, and reflected where its joint lies at the other side.
    """
    pairs = [
        (k, number, j, mirrored)
        for k in _leaves(obj.native_tree)
        for number, other in enumerate(others)
        for j in range(1, len(other))
        if (mirrored := _fit(obj, k, other, j)) is not None
    ]
    if not pairs:
        return None
    k, number, j, mirrored = pairs[rng.integers(len(pairs))]
    own, other = obj.parts[k], others[number].parts[j]
    new = replace(fitted(other, own.bounds, mirrored), name=own.name, label=own.label)
    new = new if own.body is not None else replace(new, body=None)
    parts = tuple(new if i == k else part for i, part in enumerate(obj.parts))
    record = {
        "part": own.name,
        "by": {"object_id": others[number].object_id, "sha256": others[number].sha256, "part": other.name},
        "reflected": ["xyz"[i] for i in np.flatnonzero(mirrored)],
    }
    return replace(obj, parts=parts), record


def leave_out(
    obj: ArticulatedObject, rng: np.random.Generator, strength: float, others: Sequence[ArticulatedObject]
) -> Change | None:
    """Remove a leaf part with its joint; another joint that can move stays."""
    tree = obj.native_tree
    followed = {joint.mimic.source for joint in tree.joints if joint.mimic is not None}
    moving = [k for k in tree.free_joints if tree.limits[k, 1] > tree.limits[k, 0]]
    able = [k for k in _leaves(tree) if k not in followed and set(moving) - {k}]
    if not able:
        return None
    gone = int(rng.choice(able))
    kept = [k for k in range(len(tree)) if k != gone]
    index = {k: i for i, k in enumerate(kept)} | {-1: -1}
    joints = []
    for k in kept:
        joint = tree.joints[k]
        mimic = None if joint.mimic is None else replace(joint.mimic, source=index[joint.mimic.source])
        joints.append(replace(joint, parent=index[joint.parent], mimic=mimic))
    parts = tuple(obj.parts[k] for k in kept)
    return replace(obj, parts=parts, native_tree=KinematicTree(joints), source_joints={}), {
        "part": obj.parts[gone].name,
        "label": obj.parts[gone].label,
    }


OPERATIONS: dict[str, tuple[Operation, float]] = {
    "leave out": (leave_out, 0.25),
    "exchange": (exchange_part, 0.6),
    "stretch": (stretch, 0.85),
    "limits": (change_limits, 0.6),
    "axes": (move_axes, 0.4),
}
"""Operations in the order in which they follow each other, and how often each is drawn."""


def _own_joints(tree: KinematicTree) -> list[int]:
    """Joints that follow none and are followed by none."""
    followed = {joint.mimic.source for joint in tree.joints if joint.mimic is not None}
    return [int(k) for k in tree.free_joints if k not in followed]


def _leaves(tree: KinematicTree) -> list[int]:
    """Parts that carry none, the root left out."""
    carrying = set(tree.parents.tolist())
    return [k for k in range(1, len(tree)) if k not in carrying]


def _fit(obj: ArticulatedObject, k: int, other: ArticulatedObject, j: int) -> NDArray[np.bool_] | None:
    """(3,) along which axes part j of another object is reflected to stand for part k; None where it cannot."""
    own, new = obj.parts[k], other.parts[j]
    if own.label != new.label or obj.tree.types[k] != other.tree.types[j] or not (len(own.faces) and len(new.faces)):
        return None
    if own.body is not None and new.body is None:
        return None
    axis, its_axis = obj.tree.axes[k], other.tree.axes[j]
    if abs(float(axis @ its_axis)) < 0.9:
        return None
    size, its_size = obj.box_size[k], other.box_size[j]
    if (np.minimum(size, its_size) <= 1e-6 * obj.diagonal).any():
        return None
    factor = size / its_size * (other.diagonal / obj.diagonal)
    if factor.max() > _MOST or factor.min() < 1.0 / _MOST or factor.max() / factor.min() > _OUT_OF_SHAPE:
        return None
    if obj.tree.types[k] == "prismatic":
        return (np.abs(axis) > 0.5) & (float(axis @ its_axis) < 0)
    place = (obj.tree.origins[k] - obj.box_center[k]) / (0.5 * size)
    its_place = (other.tree.origins[j] - other.box_center[j]) / (0.5 * its_size)
    beside = (np.abs(axis) < 0.5) & (np.abs(place) > 0.5) & (np.abs(its_place) > 0.5)
    mirrored: NDArray[np.bool_] = beside & (place * its_place < 0)
    return mirrored


def _across(axis: Array, rng: np.random.Generator) -> Array:
    """A direction at right angles to an axis."""
    drawn = np.cross(axis, rng.standard_normal(3))
    across: Array = drawn / np.linalg.norm(drawn)
    return across
