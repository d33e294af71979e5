"""Joints of a kinematic tree, and their records in files."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from artsim.errors import KinematicsError

JOINT_TYPES = ("free", "revolute", "continuous", "prismatic", "screw")
"""Every joint type a tree can hold. Fixed joints do not appear: a loader merges them."""

LARGEST = 1e9
"""Metres or radians: squares of larger numbers, and their products, soon overflow."""

ROTATING = ("revolute", "continuous", "screw")

MAX_JOINTS = 1000
"""Objects have 254 parts at most."""

_FIELDS = {"name", "type", "parent", "axis", "origin", "lower", "upper", "rest", "pitch", "mimic"}


@dataclass(frozen=True)
class Mimic:
    """State of a joint as a linear function of another's: ``q = multiplier * q[source] + offset``."""

    source: int
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Joint:
    """The joint that carries one part."""

    name: str
    """Name in the source file."""
    type: str
    """One of ``JOINT_TYPES``."""
    parent: int
    """Index of the parent part; -1 for the root."""
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    """Unit direction in the rest frame, at rest."""
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """A point on the axis in the rest frame, at rest, metres."""
    lower: float = 0.0
    upper: float = 0.0
    """Limits in radians (revolute, screw) or metres (prismatic); infinite for ``continuous``."""
    rest: float = 0.0
    """State in which the object is in its rest state."""
    pitch: float = 0.0
    """Screw joints only: metres along the axis for each radian about it."""
    mimic: Mimic | None = None
    """Set when the state follows another joint."""


def joint_record(joint: Joint) -> dict[str, Any]:
    """A joint in JSON's terms, inverse of :func:`joint_of_record` (infinite limits become null)."""
    mimic = joint.mimic
    return {
        "name": joint.name,
        "type": joint.type,
        "parent": joint.parent,
        "axis": list(joint.axis),
        "origin": list(joint.origin),
        "lower": joint.lower if np.isfinite(joint.lower) else None,
        "upper": joint.upper if np.isfinite(joint.upper) else None,
        "rest": joint.rest,
        "pitch": joint.pitch,
        "mimic": None if mimic is None else [mimic.source, mimic.multiplier, mimic.offset],
    }


def joint_of_record(data: object, where: str) -> Joint:
    """The joint of a record.

    Raises
    ------
    KinematicsError
        When it is none; ``where`` names it.
    """

    def number(value: object, name: str) -> float:
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= LARGEST:
            raise KinematicsError(f"{name} is {value!r:.60}, which is no number in range", where)
        return float(value)

    def index(value: object, name: str) -> int:
        if type(value) is not int or not -1 <= value < MAX_JOINTS:
            raise KinematicsError(f"{name} is {value!r:.60}, which is no number of a joint", where)
        return value

    def items(value: object, name: str) -> list[object]:
        if not isinstance(value, list) or len(value) != 3:
            raise KinematicsError(f"{name} is {value!r:.60}, which is not three values", where)
        return value

    if not isinstance(data, Mapping) or not data.keys() >= _FIELDS:
        raise KinematicsError("lacks a field", where)
    if not isinstance(data["name"], str) or not isinstance(data["type"], str):
        raise KinematicsError("name and type are texts", where)
    x, y, z = (number(value, "axis") for value in items(data["axis"], "axis"))
    u, v, w = (number(value, "origin") for value in items(data["origin"], "origin"))
    mimic = None
    if data["mimic"] is not None:
        source, multiplier, offset = items(data["mimic"], "mimic")
        mimic = Mimic(index(source, "mimic"), number(multiplier, "mimic"), number(offset, "mimic"))
    return Joint(
        name=data["name"],
        type=data["type"],
        parent=index(data["parent"], "parent"),
        axis=(x, y, z),
        origin=(u, v, w),
        lower=-np.inf if data["lower"] is None else number(data["lower"], "lower"),
        upper=np.inf if data["upper"] is None else number(data["upper"], "upper"),
        rest=number(data["rest"], "rest"),
        pitch=number(data["pitch"], "pitch"),
        mimic=mimic,
    )
