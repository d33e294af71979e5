"""Joints of a stage: where they are, and the axes that they leave free, one after another."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from artsim.common.names import unused_name
from artsim.common.products import matmul
from artsim.loading.usd_bodies import StageReader, rigid
from artsim.loading.usd_values import flag, number, rotation, token, vectors
from artsim.model.joints import LARGEST
from artsim.model.kinematics import Array
from artsim.model.objects import Repair
from artsim.model.transforms import compose_transform

_AXES = ("X", "Y", "Z")


@dataclass(eq=False)
class FreeAxis:
    """One axis that a joint leaves free.

    Attributes
    ----------
    name : str
    slides : bool
    axis : int
        Of the joint's frame.
    lower, upper : float
        Radians or metres; infinite where there is no end.
    limit : str
        As USD calls it: ``rotX`` and so on.
    """

    name: str
    slides: bool
    axis: int
    lower: float
    upper: float

    @property
    def limit(self) -> str:
        return ("trans" if self.slides else "rot") + _AXES[self.axis]

    @property
    def type(self) -> str:
        if self.slides:
            return "prismatic"
        return "revolute" if np.isfinite(self.lower) or np.isfinite(self.upper) else "continuous"


@dataclass(eq=False)
class UsdJoint:
    """A joint between two bodies."""

    name: str
    prim: Any
    bodies: tuple[int, int]
    """(int, int)."""
    frames: tuple[Array, Array]
    """pair of (4, 4) float. The joint's frame in each of them, rigid."""
    free: list[FreeAxis]
    """From the first body to the second; empty where it holds."""
    static: tuple[str, ...]
    """Paths of what it names that is no body."""


def read_joints(reader: StageReader) -> list[UsdJoint]:
    """Every joint that is enabled, in the stage's order.

    Raises
    ------
    AssetError
        When a joint's bodies cannot be told, or it is of a kind that no chain of axes is.
    """
    from pxr import UsdPhysics

    joints = []
    names: set[str] = set()
    for prim in reader.prims:
        kind = str(prim.GetTypeName())
        if not prim.IsA(UsdPhysics.Joint):
            if kind.endswith("Joint"):
                reader.repairs.append(
                    Repair(f"prim {prim.GetPath()}", f"left out: {kind} is no joint of UsdPhysics, and is not read")
                )
            continue
        if not flag(UsdPhysics.Joint(prim).GetJointEnabledAttr(), True):
            continue
        ends = [_end(reader, prim, side) for side in (0, 1)]
        if ends[0][0] == ends[1][0]:
            raise reader.error(prim, "joins a body to itself, or to nothing", "name the two bodies that it joins")
        free = _free_axes(reader, prim)
        if len(free) == 6 and 0 in (ends[0][0], ends[1][0]) and all(_is_endless(axis) for axis in free):
            reader.repairs.append(Repair(f"prim {prim.GetPath()}", "left out: it leaves all six axes free"))
            continue
        name = str(prim.GetName())
        if len(free) > 1:
            words = ", ".join(axis.limit for axis in free)
            what = f"{kind} that leaves {len(free)} axes free: read as a chain of joints of one axis each ({words})"
            reader.repairs.append(Repair(f"prim {prim.GetPath()}", what))
        for axis in free:
            axis.name = unused_name(f"{name}_{axis.limit}" if len(free) > 1 else name, names)
        static = tuple(path for body, path, _ in ends if body == 0 and path)
        frames = (ends[0][2], ends[1][2])
        joints.append(UsdJoint(unused_name(name, set()), prim, (ends[0][0], ends[1][0]), frames, free, static))
    return joints


def _is_endless(axis: FreeAxis) -> bool:
    return not (np.isfinite(axis.lower) or np.isfinite(axis.upper))


def _end(reader: StageReader, prim: Any, side: int) -> tuple[int, str, Array]:
    """Body at one end of a joint, the path that is named there, and the joint's frame in the body."""
    from pxr import UsdPhysics

    schema = UsdPhysics.Joint(prim)
    relation = schema.GetBody0Rel() if side == 0 else schema.GetBody1Rel()
    position = schema.GetLocalPos0Attr() if side == 0 else schema.GetLocalPos1Attr()
    turn = schema.GetLocalRot0Attr() if side == 0 else schema.GetLocalRot1Attr()
    targets = relation.GetTargets()
    if len(targets) > 1:
        raise reader.error(prim, f"names {len(targets)} bodies at one end", "name one")
    affine, body, path = reader.T_world_stage, 0, ""
    if targets:
        target = reader.stage.GetPrimAtPath(targets[0])
        if not target:
            raise reader.error(prim, f"its body {targets[0]} does not exist", "name a body of the file")
        affine, body, path = reader.affine(target), reader.owner(target), str(targets[0])
    T_prim_joint = compose_transform(next(iter(vectors(position)), np.zeros(3)))
    anchor = matmul(affine, T_prim_joint)[:3, 3]
    if not (np.abs(anchor) <= LARGEST).all():
        raise reader.error(
            prim, f"its frame in body {side} is not finite, or too far", "write a finite localPos and localRot"
        )
    T_world_joint = compose_transform(anchor, matmul(rigid(affine, reader.where(prim))[:3, :3], rotation(turn)))
    return body, path, matmul(np.linalg.inv(reader.bodies[body].T_world_body), T_world_joint)


def _free_axes(reader: StageReader, prim: Any) -> list[FreeAxis]:
    """The axes that a joint leaves free, from its first body to its second."""
    from pxr import UsdPhysics

    if prim.IsA(UsdPhysics.FixedJoint):
        return []
    for schema, slides in ((UsdPhysics.RevoluteJoint, False), (UsdPhysics.PrismaticJoint, True)):
        if prim.IsA(schema):
            joint = schema(prim)
            lower, upper = joint.GetLowerLimitAttr(), joint.GetUpperLimitAttr()
            return _bounded(reader, [(slides, _axis(joint), number(lower, -np.inf), number(upper, np.inf))])
    if prim.IsA(UsdPhysics.SphericalJoint):
        return _bounded(reader, _cone(UsdPhysics.SphericalJoint(prim)))
    if prim.IsA(UsdPhysics.DistanceJoint):
        raise reader.error(
            prim, "a PhysicsDistanceJoint is not supported: it is no chain of axes", "disable it, or remove it"
        )
    found = []
    for slides, word in ((True, "trans"), (False, "rot")):
        for axis, letter in enumerate(_AXES):
            limit, low, high = f"{word}{letter}", -np.inf, np.inf
            if prim.HasAPI(UsdPhysics.LimitAPI, limit):
                api = UsdPhysics.LimitAPI.Get(prim, limit)
                low, high = number(api.GetLowAttr(), -np.inf), number(api.GetHighAttr(), np.inf)
            if low != high or low != 0.0:
                found.append((slides, axis, low, high))
    return _bounded(reader, found)


def _axis(joint: Any) -> int:
    return _AXES.index(token(joint.GetAxisAttr(), "X", _AXES))


def _cone(joint: Any) -> list[tuple[bool, int, float, float]]:
    """A ball joint: its axis swings towards the next axis, then towards the one after, then turns about itself.

    Its cone is read as bounds of either swing; a negative angle is none.
    """
    axis = _axis(joint)
    first, second = (
        value if np.isfinite(value) and value >= 0 else np.inf
        for value in (number(joint.GetConeAngle0LimitAttr(), -1.0), number(joint.GetConeAngle1LimitAttr(), -1.0))
    )
    about_first, about_second = (axis + 2) % 3, (axis + 1) % 3
    swings = [(False, about, -end, end) for about, end in ((about_first, first), (about_second, second)) if end > 0]
    return [*swings, (False, axis, -np.inf, np.inf)]


def _bounded(reader: StageReader, found: list[tuple[bool, int, float, float]]) -> list[FreeAxis]:
    """Axes in radians and metres, without those that are locked: low above high, in USD's way."""
    axes = []
    for slides, axis, low, high in found:
        lower, upper = (value * reader.meters if slides else float(np.deg2rad(value)) for value in (low, high))
        if lower <= upper:
            axes.append(FreeAxis("", slides, axis, lower, upper))
    return axes
