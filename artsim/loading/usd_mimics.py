"""Joints that follow others, as the schemas of artsim, Newton, PhysX and MuJoCo write it.

=======================  ============================================  ======================================
Schema                   multiplier, offset of the leader's value      units
=======================  ============================================  ======================================
``artsim:mimic:*``       ``multiplier``, ``offset``                    radians, metres
``NewtonMimicAPI``       ``mimicCoef1``, ``mimicCoef0``                the stage's; the offset in degrees
``PhysxMimicJointAPI``   ``-gearing``, ``-offset``                     the stage's; angles in degrees
``MjcEqualityJointAPI``  ``coef1``, ``coef0``, or those of             the stage's; angles in radians
                         ``polycoef``
=======================  ============================================  ======================================
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from artsim.loading.urdf_document import MimicRelation
from artsim.loading.usd_bodies import StageReader
from artsim.loading.usd_joints import FreeAxis, UsdJoint
from artsim.loading.usd_values import flag, number, numbers, token
from artsim.model.joints import LARGEST
from artsim.model.objects import Repair

_DEGREE = float(np.pi / 180.0)


def read_mimics(reader: StageReader, joints: list[UsdJoint]) -> tuple[dict[str, MimicRelation], dict[str, float]]:
    """What joints follow, and where others are held, by their names.

    Raises
    ------
    AssetError
        When a joint follows what is no joint of the object.
    """
    by_path = {joint.prim.GetPath(): joint for joint in joints}
    mimics: dict[str, MimicRelation] = {}
    held: dict[str, float] = {}
    for joint in joints:
        follower = _Follower(reader, joint, by_path)
        for axis in joint.free:
            found = follower.artsim() or follower.newton(axis) or follower.physx(axis) or follower.mujoco(axis)
            if found is None:
                continue
            leader, rate, offset = found
            if not (abs(rate) <= LARGEST and abs(offset) <= LARGEST):
                raise reader.error(
                    joint.prim, f"follows another by {rate:g} and {offset:g}", f"write numbers up to {LARGEST:g}"
                )
            if leader is not None:
                mimics[axis.name] = MimicRelation(leader.name, rate, offset)
                seen = axis.name
                while (relation := mimics.get(seen)) is not None:
                    seen = relation.joint
                    if seen == axis.name:
                        raise reader.error(
                            joint.prim, "joints follow each other in a circle", "let one of them be free"
                        )
            else:
                held[axis.name] = offset
                follower.say(f"follows nothing that moves: held at {offset:.6g}")
    return mimics, held


_Relation = tuple[FreeAxis | None, float, float]
"""The axis that is followed, None where there is none that moves; multiplier and offset in radians and metres."""


class _Follower:
    """What the schemas of one joint say that it follows; each returns None where it says nothing."""

    def __init__(self, reader: StageReader, joint: UsdJoint, by_path: Mapping[Any, UsdJoint]):
        self._reader, self._joint, self._by_path, self._prim = reader, joint, by_path, joint.prim
        # Schemas that usd-core has no plugin for are listed here alone.
        self._applied = [str(schema) for schema in joint.prim.GetPrimTypeInfo().GetAppliedAPISchemas()]

    def say(self, what: str) -> None:
        self._reader.repairs.append(Repair(f"prim {self._prim.GetPath()}", what))

    def artsim(self) -> _Relation | None:
        if self._target("artsim:mimic:joint") is None:
            return None
        leader = self._leader("artsim:mimic:joint")
        return leader, self._value("artsim:mimic:multiplier", 1.0), self._value("artsim:mimic:offset", 0.0)

    def newton(self, axis: FreeAxis) -> _Relation | None:
        if not self._follows_as_newton():
            return None
        if self._target("newton:mimicJoint") is None:
            self.say("has NewtonMimicAPI, but names no joint to follow: left free")
            return None
        self._say_bends([self._value(f"mjc:coef{power}", 0.0) for power in (2, 3, 4)])
        leader = self._leader("newton:mimicJoint", axis.limit)
        if leader is not None and leader.slides != axis.slides:
            self.say("a turn follows a slide, or the reverse, for which NewtonMimicAPI has no unit: taken as radians")
        rate, offset = self._value("newton:mimicCoef1", 1.0), self._value("newton:mimicCoef0", 0.0)
        return leader, rate * self._ratio(axis, leader, 1.0), offset * self._unit(axis, _DEGREE)

    def physx(self, axis: FreeAxis) -> _Relation | None:
        instances = [schema.partition(":")[2] for schema in self._applied if schema.startswith("PhysxMimicJointAPI:")]
        if len(self._joint.free) > 1:
            instances = [name for name in instances if name == axis.limit]
        if not instances:
            return None
        prefix = f"physxMimicJoint:{instances[0]}"
        followed = token(self._prim.GetAttribute(f"{prefix}:referenceJointAxis"), "rotX")
        if self._target(f"{prefix}:referenceJoint") is None:
            self.say("has PhysxMimicJointAPI, but names no joint to follow: left free")
            return None
        leader = self._leader(f"{prefix}:referenceJoint", followed)
        rate, offset = -self._value(f"{prefix}:gearing", 1.0), -self._value(f"{prefix}:offset", 0.0)
        return leader, rate * self._ratio(axis, leader, _DEGREE), offset * self._unit(axis, _DEGREE)

    def mujoco(self, axis: FreeAxis) -> _Relation | None:
        if "MjcEqualityJointAPI" not in self._applied or "NewtonMimicAPI" in self._applied:
            return None
        given = numbers(self._prim.GetAttribute("mjc:polycoef")).tolist()[:5] or [0.0, 1.0]
        given += [0.0] * (5 - len(given))
        offset, rate, *bends = [self._value(f"mjc:coef{power}", given[power]) for power in range(5)]
        self._say_bends(bends)
        leader = None if self._target("mjc:target") is None else self._leader("mjc:target", axis.limit)
        return leader, rate * self._ratio(axis, leader, 1.0), offset * self._unit(axis, 1.0)

    def _follows_as_newton(self) -> bool:
        return "NewtonMimicAPI" in self._applied and flag(self._prim.GetAttribute("newton:mimicEnabled"), True)

    def _say_bends(self, bends: list[float]) -> None:
        if any(bends):
            self.say("follows another along a curve: read as its tangent at 0")

    def _target(self, name: str) -> Any:
        return next(iter(self._prim.GetRelationship(name).GetTargets()), None)

    def _value(self, name: str, default: float) -> float:
        return number(self._prim.GetAttribute(name), default)

    def _leader(self, relation: str, limit: str = "") -> FreeAxis | None:
        """The axis that is followed: the one called so, where the joint has several; None where none moves."""
        path = self._target(relation)
        joint = self._by_path.get(path)
        if joint is None:
            raise self._reader.error(
                self._prim, f"{relation} names {path}, which is no joint of the object", "name a joint of the file"
            )
        return next((axis for axis in joint.free if axis.limit == limit), next(iter(joint.free), None))

    def _unit(self, axis: FreeAxis, angle: float) -> float:
        return self._reader.meters if axis.slides else angle

    def _ratio(self, axis: FreeAxis, leader: FreeAxis | None, angle: float) -> float:
        """Radians or metres of the follower's unit, over those of the leader's, where angles have this unit."""
        return 1.0 if leader is None else self._unit(axis, angle) / self._unit(leader, angle)
