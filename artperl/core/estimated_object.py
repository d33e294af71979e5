"""An estimate as an articulated object: a box for each part, with openings for what lies inside, joints and limits."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import product
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from artsim.common.products import apply, matmul
from artsim.errors import ConfigError
from artsim.making.assembly import Assembly, JointSpec, continuous, prismatic, revolute
from artsim.making.solids import box, union
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import compose_transform, rotation_about

_GAP = 0.004
"""Diagonals between a part and what lies in its openings; and the thinnest wall that is left."""
_TURNS, _PER_TURN = 12, 8
"""Parts of a turn's range, and states in each: arcs between these leave the box by less than the gap."""
_HARDLY = 1.5
"""Times the volume of the largest: many small rooms of a knob are one."""
_DENSITY = 300.0
"""kg/m^3 of what is known as a box alone: furniture and appliances, hollow, have about as much."""


Box = tuple[Array, Array]
"""Lower and upper corner (3,)."""


class Parts(Protocol):
    """What an estimate says of K parts; see :class:`artperl.core.estimate.Estimate`."""

    @property
    def T_camera_part(self) -> Array: ...
    @property
    def translation(self) -> Array: ...
    @property
    def size(self) -> Array: ...
    @property
    def state(self) -> Array: ...
    @property
    def joint_type(self) -> tuple[str, ...]: ...
    @property
    def joint_parent(self) -> NDArray[np.int64]: ...
    @property
    def joint_axis(self) -> Array: ...
    @property
    def joint_origin(self) -> Array: ...
    @property
    def joint_limits(self) -> Array: ...
    @property
    def part_names(self) -> tuple[str, ...]: ...


def estimated_object(estimate: Parts, category: str = "object", name: str = "estimate") -> tuple[
    ArticulatedObject, Array, Array
]:  # fmt: skip
    """The object that an estimate describes, where it is, and its joint states.

    A part is its box, less where later parts reach into it while they move: a cabinet has an opening for each drawer,
    and room for the back edge of a door. A screw, of whose thread an estimate knows nothing, becomes a hinge.

    Parameters
    ----------
    estimate : Parts
        Such as :class:`artperl.core.estimate.Estimate`.
    category, name : str

    Returns
    -------
    obj : ArticulatedObject
        As :func:`artsim.export.export` takes it; at rest at 0.
    T_camera_object : (4, 4) float
    q : (K,) float
        States, cut to the limits.

    Raises
    ------
    ConfigError
        When a box has no size.
    """
    T = np.asarray(estimate.T_camera_part, dtype=np.float64)
    if not (np.isfinite(estimate.size).all() and (estimate.size > 0).all()):
        raise ConfigError("a box of the estimate has no size", name, "give a cloud that shows the object")
    back, at = np.swapaxes(T[:, :3, :3], 1, 2), T[:, :3, 3]
    center, axes = apply(back, estimate.translation - at), apply(back, estimate.joint_axis)
    origins = apply(back, estimate.joint_origin - at)
    low, high = center - 0.5 * estimate.size, center + 0.5 * estimate.size
    gap = _GAP * float(np.linalg.norm(high.max(axis=0) - low.min(axis=0)))
    names = _names(estimate)
    parents = [int(parent) for parent in estimate.joint_parent]
    made, q = Assembly(density=_DENSITY), np.zeros(len(T))
    joints: list[JointSpec | None] = [None]
    for k in range(1, len(names)):
        spec, q[k] = _joint(estimate, k, names[int(estimate.joint_parent[k])], axes[k], origins[k])
        joints.append(spec)
    filled: list[Box] = []
    for k, part in enumerate(names):
        inside = [
            room for j in range(k + 1, len(names))
            for room in _rooms((low[k], high[k]), _reached(j, _meet(parents, j, k), parents, joints, (low, high)), gap)
        ]  # fmt: skip
        own = boxes_without(low[k], high[k], inside, gap)
        made.add(part, union(box(start, end) for start, end in own), joints[k], label=re.sub(r"_[0-9]+$", "", part))
        filled += own
    ends = np.array(filled)
    middle = 0.5 * (ends[:, 0].min(axis=0) + ends[:, 1].max(axis=0))
    return made.build(category, name), matmul(T[0], compose_transform(middle)), q


def _meet(parents: Sequence[int], j: int, k: int) -> int:
    """The nearest part that both j and k hang from, or are."""
    above = [k]
    while above[-1] > 0:
        above.append(parents[above[-1]])
    while j not in above:
        j = parents[j]
    return j


def _reached(
    j: int, top: int, parents: Sequence[int], joints: Sequence[JointSpec | None], ends: Box
) -> list[Box]:  # fmt: skip
    """Boxes that hold part j in all states of the joints between it and the part ``top``, which rests."""
    boxes, k = [(ends[0][j], ends[1][j])], j
    while k != top:
        whole = np.min([low for low, _ in boxes], axis=0), np.max([high for _, high in boxes], axis=0)
        joint = joints[k]
        assert joint is not None
        boxes, k = swept(whole, joint), parents[k]
    return boxes


def swept(box: Box, joint: JointSpec) -> list[Box]:
    """Boxes that hold a box in all states of a joint: one for a slide, one for each twelfth of a turn's range."""
    lower, upper = (joint.lower, joint.upper) if np.isfinite(joint.upper - joint.lower) else (-np.pi, np.pi)
    axis, corners = np.asarray(joint.axis), np.array(list(product(*zip(*box, strict=True))))
    if joint.type == "prismatic":
        moved = np.stack([corners + lower * axis, corners + upper * axis])[None]
    else:
        states = np.linspace(lower, upper, _TURNS * _PER_TURN + 1)
        turns = np.stack([rotation_about(axis, state) for state in states])
        every = (corners - joint.origin) @ np.swapaxes(turns, 1, 2) + joint.origin
        moved = np.stack([every[n * _PER_TURN : (n + 1) * _PER_TURN + 1] for n in range(_TURNS)])
    return [(own.min(axis=(0, 1)), own.max(axis=(0, 1))) for own in moved]


def _rooms(box: Box, others: Sequence[Box], gap: float) -> list[Box]:
    """What is to be taken from a box for others: one room for all where it is hardly larger than the largest."""
    own = [(np.maximum(a - gap, box[0]), np.minimum(b + gap, box[1])) for a, b in others]
    own = [(a, b) for a, b in own if (a < b).all()]
    if not own:
        return []
    one = np.min([a for a, _ in own], axis=0), np.max([b for _, b in own], axis=0)
    largest = max(float(np.prod(b - a)) for a, b in own)
    return [one] if float(np.prod(one[1] - one[0])) <= _HARDLY * largest else own


def boxes_without(low: Array, high: Array, others: Sequence[Box], least: float) -> list[Box]:
    """Boxes that fill a box (low, high) less others; what is thinner than ``least``, of either, is passed over.

    The whole box, where the others leave nothing of it.
    """
    left = [(low, high)]
    for a, b in others:
        parts = []
        for one, two in left:
            if (a >= two - least).any() or (b <= one + least).any():
                parts.append((one, two))
                continue
            one, two = one.copy(), two.copy()
            for axis in range(3):
                for beyond, at in ((a[axis] - one[axis], a[axis]), (two[axis] - b[axis], b[axis])):
                    if beyond > least:
                        start, end = one.copy(), two.copy()
                        if at == a[axis]:
                            end[axis] = one[axis] = at
                        else:
                            start[axis] = two[axis] = at
                        parts.append((start, end))
        left = parts
    return left or [(low, high)]


def _joint(estimate: Parts, k: int, parent: str, axis: Array, origin: Array) -> tuple[JointSpec, float]:
    """The joint of part k, and its state within the limits."""
    kind, state = estimate.joint_type[k], float(estimate.state[k])
    lower, upper = (float(end) for end in estimate.joint_limits[k]) if len(estimate.joint_limits) else (-np.inf, np.inf)
    if kind == "prismatic":
        lower, upper = (lower, upper) if np.isfinite([lower, upper]).all() else (min(state, 0.0), max(state, 0.0))
        return prismatic(parent, axis, lower, upper, origin), float(np.clip(state, lower, upper))
    if kind in ("fixed", "free"):
        return revolute(parent, (0, 0, 1), origin, 0.0, 0.0), 0.0
    if not np.isfinite([lower, upper]).all():
        return continuous(parent, axis, origin), state
    return revolute(parent, axis, origin, lower, upper), float(np.clip(state, lower, upper))


def _names(estimate: Parts) -> list[str]:
    """A proper name for each part, the same ones numbered."""
    names: list[str] = []
    for k in range(len(estimate.joint_type)):
        given = estimate.part_names[k] if k < len(estimate.part_names) else "part"
        name = re.sub(r"\W", "_", given) if re.match(r"[A-Za-z_]", given) else f"part_{given}"
        names.append(name if name not in names and list(estimate.part_names).count(given) == 1 else f"{name}_{k}")
    return names
