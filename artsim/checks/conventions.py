"""Rest frames of families and of real objects side by side: extents, the root, and where joints point.

Everything is measured on the objects themselves: nothing but :func:`doubts` says what a frame should be.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from artsim.model.joints import Joint
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject

_ALONG = np.cos(np.deg2rad(25.0))
"""Cosine from which an axis is along one of the frame's; others are oblique."""
_ONE_SIDED = 0.8
"""Share of a joint's range to one side of the rest state, from which the range has a direction."""

_CONVENTION = 2
"""Real objects that make a convention."""
_EXTENT = 0.2
"""Difference of medians, in diagonals: an exchange of two axes shows in families that are not as long as wide."""
_MAIN = 0.5
"""Share of the boxes from which a root is the body of the object."""

_CLEAR = 0.9
"""Cosine from which parts open along an axis of the frame: those of real furniture have 0.96 and more."""
_SIZES = (0.01, 20.0)
"""Metres between which diagonals of things are; PartNet-Mobility's are 1.4 to 3."""
_OTHER_UNIT = 20.0
"""Times that an object of the same kind is as large: inches and centimetres differ from metres by 40 and 100."""


@dataclass(frozen=True, eq=False)
class Frame:
    """How objects of one category lie in their rest frames.

    Attributes
    ----------
    count : int
        Objects.
    extents : (3,) float
        Medians of x, y, z over the diagonal.
    joints : dict
        Share of the objects that have a joint of a sort: see :func:`joint_sort`.
    root_share : float
        Median volume of the root's box over that of all boxes of parts.
    root_side : (3,) float
        Median place of the root's box centre, in diagonals.
    """

    count: int
    extents: Array
    joints: dict[str, float]
    root_share: float
    root_side: Array

    @staticmethod
    def of(objects: Iterable[ArticulatedObject]) -> Frame:
        """The frame of objects of one category, of which there is at least one."""
        extents, shares, sides = [], [], []
        sorts: Counter[str] = Counter()
        for obj in objects:
            volume = obj.box_size.prod(axis=1)
            extents.append(np.ptp(obj.bounds, axis=0) / obj.diagonal)
            shares.append(volume[0] / volume.sum())
            sides.append(obj.box_center[0] / obj.diagonal)
            # Each object counts once for a sort, or an oven with nine knobs would hide all doors.
            sorts.update({joint_sort(joint) for joint in obj.tree.joints[1:]})
        joints = {sort: count / len(extents) for sort, count in sorted(sorts.items())}
        return Frame(
            len(extents), np.median(extents, axis=0), joints, float(np.median(shares)), np.median(sides, axis=0)
        )

    def directions(self, kind: str) -> dict[str, float]:
        """Share of objects with a joint of a kind, such as "turns y", by its sign: "+", "-", or "" for both."""
        return {sort[: -len(kind)]: share for sort, share in self.joints.items() if sort.endswith(kind)}


def joint_sort(joint: Joint) -> str:
    """How a joint moves, such as "+turns y": the direction away from rest, where its range has one.

    Joints that turn are alike whether they are continuous or have limits.
    """
    axis = np.asarray(joint.axis)
    k = int(np.abs(axis).argmax())
    name = "xyz"[k] if abs(axis[k]) >= _ALONG else "oblique"
    sign = ""
    if np.isfinite([joint.lower, joint.upper]).all() and joint.upper > joint.lower and name != "oblique":
        above = (joint.upper - joint.rest) / (joint.upper - joint.lower)
        direction = 1.0 if above >= _ONE_SIDED else -1.0 if above <= 1.0 - _ONE_SIDED else 0.0
        sign = {1.0: "+", -1.0: "-", 0.0: ""}[direction * float(np.sign(axis[k]))]
    return f"{sign}{'slides' if joint.type == 'prismatic' else 'turns'} {name}"


def differences(family: Frame, real: Frame) -> list[str]:
    """What of a family's frame is not as real objects have it.

    Parameters
    ----------
    family, real : Frame
        Extents of fewer than two real objects, and directions of fewer than two, are no convention.

    Returns
    -------
    list of str
        Empty when the family lies as real objects do.
    """
    found = []
    for k, name in enumerate("xyz"):
        if real.count >= _CONVENTION and abs(family.extents[k] - real.extents[k]) > _EXTENT:
            found.append(f"extent {name} is {family.extents[k]:.2f}, real {real.extents[k]:.2f}")
    if (family.root_share > _MAIN) != (real.root_share > _MAIN) and abs(family.root_share - real.root_share) > _EXTENT:
        found.append(f"the root has {family.root_share:.2f} of the boxes, real {real.root_share:.2f}")
    for kind in (f"{moves} {axis}" for moves in ("turns", "slides") for axis in "xyz"):
        ours, theirs = family.directions(kind), real.directions(kind)
        if sum(theirs.values()) * real.count < _CONVENTION:
            continue
        if not ours:
            found.append(f"nothing {kind}, of real objects {100 * sum(theirs.values()):.0f} %")
        elif set(theirs) in ({"+"}, {"-"}):
            (sign,) = theirs
            other = ours.get({"+": "-", "-": "+"}[sign], 0.0)
            if other > ours.get(sign, 0.0):
                found.append(f"{kind}: real ones towards {sign}, the family's the other way")
    return found


def opening(obj: ArticulatedObject) -> str:
    """Where the moving parts of an object first go as they open, such as "-x", in the rest frame.

    Parts count by the area of their boxes' largest faces: doors, not knobs. Empty where they go to no side.
    """
    tree, total = obj.tree, np.zeros(3)
    for k, joint in enumerate(tree.joints[1:], start=1):
        lower, upper = tree.limits[k]
        sign = 1.0 if np.isinf(upper) or upper - joint.rest >= joint.rest - lower else -1.0
        axis, arm = np.asarray(joint.axis), obj.box_center[k] - np.asarray(joint.origin)
        moves = axis if joint.type == "prismatic" else np.cross(axis, arm)
        size, length = np.sort(obj.box_size[k]), float(np.linalg.norm(moves))
        if upper > lower and length > 0.0:
            total += sign * size[1] * size[2] / length * moves
    k = int(np.abs(total).argmax())
    return f"{'-' if total[k] < 0 else '+'}{'xyz'[k]}" if abs(total[k]) > _CLEAR * np.linalg.norm(total) else ""


def doubts(objects: Sequence[ArticulatedObject], names: Sequence[str]) -> Iterator[tuple[str, str]]:
    """What looks wrong with the frames, units and joints of objects that are of one category.

    Yields
    ------
    name, what : str
        Of the object, or "all"; and what is wrong, with its fix.
    """
    if not objects:
        return
    sides = [opening(obj) for obj in objects]
    usual, count = Counter(side for side in sides if side).most_common(1)[0] if any(sides) else ("", 0)
    if usual == "+x":
        yield "all", f"{count} of {len(objects)} open towards +X, and fronts are to be towards -X. {_turn(np.pi)}"
    middle = float(np.median([obj.diagonal for obj in objects]))
    for obj, name, side in zip(objects, names, sides, strict=True):
        times = obj.diagonal / middle
        if not _SIZES[0] < obj.diagonal < _SIZES[1] or not 1.0 / _OTHER_UNIT < times < _OTHER_UNIT:
            yield (
                name,
                (
                    f"it is {obj.diagonal:.3g} m across, and the object in the middle {middle:.3g} m. "
                    'Fix: metres; of meshes in millimetres, scale="0.001 0.001 0.001"'
                ),
            )
        spans = np.ptp(obj.tree.limits, axis=1)
        if not (spans > 0).any():
            yield name, "nothing moves. Fix: joints with limits, lower below upper"
        for joint, span in zip(obj.tree.joints, spans, strict=True):
            if joint.type == "revolute" and np.isfinite(span) and span > 2.0 * np.pi + 0.01:
                yield name, f"joint {joint.name!r} turns by {span:.4g} rad. Fix: limits in radians, degrees / 57.2958"
        if usual != "+x" and side not in ("", usual) and 2 * count > len(objects):
            yield (
                name,
                f"its parts open towards {side.upper()}, those of most towards {usual.upper()}. "
                + ("Fix: stand it upright" if "z" in side + usual else _turn(_yaw(usual) - _yaw(side))),
            )


def _yaw(side: str) -> float:
    """Radians about Z from +x."""
    return {"+x": 0.0, "+y": 0.5 * np.pi, "-x": np.pi, "-y": 1.5 * np.pi}[side]


def _turn(yaw: float) -> str:
    return f'Fix: a fixed joint above the root link, with <origin rpy="0 0 {yaw % (2.0 * np.pi):.4f}"/>'
