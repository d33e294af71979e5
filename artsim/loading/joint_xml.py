"""Joints of a URDF document: their types, axes and limits, with what is assumed where the document leaves it open.

========================================  =============================================================================
The document                              is read as
========================================  =============================================================================
revolute, no limit, or neither end        turns freely, as in PyBullet, MuJoCo and SAPIEN
revolute, an end of 10,000 rad or more    turns freely; where the other end is less, up to one turn from that
prismatic, no limit, or neither end       held at 0
prismatic, an end of 10,000 m or more     1 m from 0, or from the other end
one end                                   the other is 0, as URDF has it
lower above upper                         swapped
an axis of another length than 1          its direction; travel stays in metres, as URDF and MuJoCo have it
an axis of length 0                       fixed
========================================  =============================================================================
"""

from collections.abc import Collection
from pathlib import Path

import numpy as np
from lxml import etree

from artsim.common.products import norm, unit
from artsim.loading.urdf_document import MimicRelation, UrdfJoint
from artsim.loading.xml_values import Element
from artsim.model.kinematics import Array
from artsim.model.objects import Repair

MOVING_TYPES = ("revolute", "continuous", "prismatic")
KNOWN_TYPES = (*MOVING_TYPES, "fixed", "floating")
ENDLESS = 1e4
"""Radians or metres from which a limit means that there is none: exporters write 1e5, 1e10 or the largest float."""
_SLIDE = 1.0  # metres of travel either way where a slide has no end
_TURN = 2.0 * np.pi
# No hinge turns four times; whole numbers look like degrees from two turns on, where wrists of robots still end.
_DEGREES_FROM, _WHOLE_DEGREES_FROM = 4.0 * _TURN, 2.0 * _TURN
_CHILDREN = ("origin", "axis", "limit", "mimic", "parent", "child")
_OTHER_TYPES = {
    "planar": "two slides and a turn: write two prismatic joints and one revolute, with links without geometry between",
    "spherical": "three turns: write three revolute joints about x, y and z, with links without geometry between",
    "ball": "three turns: write three revolute joints about x, y and z, with links without geometry between",
    "universal": "two turns: write two revolute joints, with a link without geometry between",
    "screw": "a turn that slides: write a continuous joint that carries a prismatic one with a <mimic> of it",
    "hinge": "a turn: write type=\"revolute\"",
    "slide": "a slide: write type=\"prismatic\"",
    "free": "no joint: write type=\"floating\", or \"fixed\"",
}  # fmt: skip


def read_joint(joint: etree._Element, links: Collection[str], file: Path, repairs: list[Repair]) -> UrdfJoint:
    """A joint.

    ``links`` are the names of the document's links. Raises AssetError when its type is none that is read, it hangs on
    no link, or a value of it is not usable.
    """
    element = Element(f"joint {joint.get('name')!r}", file, repairs)
    kind = joint.get("type")
    if kind is not None and kind.strip().lower() != kind and kind.strip().lower() in KNOWN_TYPES:
        element.say(f"type {kind!r} read as {kind.strip().lower()!r}")
        kind = kind.strip().lower()
    if kind not in KNOWN_TYPES:
        meaning = _OTHER_TYPES.get(str(kind).strip().lower())
        raise element.error(
            f"joint type {kind!r} is not supported", f"use one of {', '.join(KNOWN_TYPES)}"
            + (f"; this is {meaning}" if meaning else ""),
        )  # fmt: skip
    strange = sorted(set(joint.keys()) & set(_CHILDREN))
    if strange:
        element.say(
            f"<joint> has {', '.join(strange)} as attributes, which are not read: URDF has elements of that name"
        )
    parent, child = (_end(joint, end, links, element) for end in ("parent", "child"))
    origin = element.origin(joint)
    name = str(joint.get("name"))
    if kind not in MOVING_TYPES:  # whatever else it says has no meaning
        return UrdfJoint(name, kind, parent, child, origin, np.array([1.0, 0.0, 0.0]), 0.0, 0.0)
    mimic = _read_mimic(joint, element)
    axis = _read_axis(joint, kind, element)
    if axis is None:
        return UrdfJoint(name, "fixed", parent, child, origin, np.array([1.0, 0.0, 0.0]), 0.0, 0.0)
    kind, lower, upper = _read_limits(joint, kind, element)
    return UrdfJoint(name, kind, parent, child, origin, axis, lower, upper, mimic)


def _end(joint: etree._Element, end: str, links: Collection[str], element: Element) -> str:
    found = element.child(joint, end)
    link = None if found is None else element.text(found, "link", own=True)
    if link is None or link not in links:
        raise element.error(f"its {end} link {link!r} does not exist", "name a link of the file")
    return link


def _read_mimic(joint: etree._Element, element: Element) -> MimicRelation | None:
    mimic = element.child(joint, "mimic")
    if mimic is None:
        return None
    source = element.text(mimic, "joint")
    if source is None:
        raise element.error("its <mimic> names no joint", 'write <mimic joint="..."/>, or remove it')
    multiplier = float(element.finite(mimic, "multiplier", 1, "1")[0])
    return MimicRelation(source, multiplier, float(element.finite(mimic, "offset", 1, "0")[0]))


def _read_axis(joint: etree._Element, kind: str, element: Element) -> Array | None:
    """Unit axis in the joint's frame; None where it has no length."""
    axis = element.child(joint, "axis")
    if axis is None:
        return np.array([1.0, 0.0, 0.0])
    strange = sorted(set(axis.keys()) - {"xyz"})
    if strange:
        element.say(f"<axis> has {', '.join(strange)}, which is not read")
    if element.text(axis, "xyz", own=True) is None:
        element.say("<axis> has no xyz: read as 1 0 0, as URDF has it")
    direction = element.finite(axis, "xyz", 3, "1 0 0", own=True)
    largest = float(np.abs(direction).max())
    if largest < 1e-9:
        element.say("has a zero axis, along which nothing moves: read as fixed")
        return None
    length = largest * float(norm(direction / largest))  # of huge numbers, too
    if abs(length - 1.0) > 1e-6:
        travel = ", travel stays in metres as URDF and MuJoCo have it" if kind == "prismatic" else ""
        element.say(f"axis of length {length:.6g} normalised{travel}", note=kind != "prismatic")
    return unit(direction / largest)


def _read_limits(joint: etree._Element, kind: str, element: Element) -> tuple[str, float, float]:
    """Type, lower and upper limit."""
    free = ("continuous", -np.inf, np.inf)
    limit = element.child(joint, "limit")
    if limit is None:
        limit = joint.find("axis/limit")
        if limit is not None:
            element.say("<limit> inside <axis> read as its limit")
    lower, upper = (None, None) if limit is None else _ends(limit, element)
    if kind == "continuous":
        if lower is not None or upper is not None:
            element.say("is continuous: its limits are ignored")
        return free
    if lower is None and upper is None:
        missing = "a limit" if limit is None else "lower and upper in its limit"
        if kind == "revolute":
            as_others = "" if limit is None else ", as PyBullet, MuJoCo and SAPIEN do (URDF's text would hold it at 0)"
            element.say(f"is revolute without {missing}: read as continuous{as_others}")
            return free
        element.say(f"is prismatic without {missing}: held at 0")
        return kind, 0.0, 0.0
    for end, value in (("lower", lower), ("upper", upper)):
        if value is None:
            element.say(f"limit without {end}: 0, as URDF has it")
    low, high = lower or 0.0, upper or 0.0
    if low > high:
        element.say(f"limits {low:g} and {high:g} swapped")
        low, high = high, low
    if kind == "revolute" and max(abs(low), abs(high)) < ENDLESS:
        _doubt_degrees(low, high, element)
    return settle_limits(kind, low, high, element)


def settle_limits(kind: str, low: float, high: float, element: Element) -> tuple[str, float, float]:
    """Type and limits of a joint with these ends, radians or metres; infinite ones mean none. ``low`` is the lesser."""
    if kind == "continuous":
        return kind, -np.inf, np.inf
    if max(abs(low), abs(high)) >= ENDLESS:
        return _without_end(kind, low, high, element)
    if low == high:
        element.say(f"cannot move: both of its limits are {low:g}")
    return kind, low + 0.0, high + 0.0


def _ends(limit: etree._Element, element: Element) -> tuple[float | None, float | None]:
    """Lower and upper limit as they are written; effort and velocity, which may be anything, are not read."""
    own = (limit.text or "").strip()
    texts = [element.text(limit, end) for end in ("lower", "upper")]
    if own and texts == [None, None]:
        values = element.parsed(own, f"<limit> {own[:60]!r}", (2,)).tolist()
        element.say("<limit> has its numbers as text: read as lower and upper")
        return values[0], values[1]
    lower, upper = (
        None if text is None else float(element.numbers(limit, end, 1)[0])
        for end, text in zip(("lower", "upper"), texts, strict=True)
    )
    if any(value == 0 and np.signbit(value) for value in (lower, upper) if value is not None):
        element.say("limit -0 read as 0", note=True)
    return lower, upper


def _without_end(kind: str, low: float, high: float, element: Element) -> tuple[str, float, float]:
    """Limits so far away that they mean none."""
    endless = f"limits {low:g} and {high:g} mean that it has no end"
    low_ends, high_ends = abs(low) < ENDLESS, abs(high) < ENDLESS
    if kind == "revolute" and not (low_ends or high_ends):
        element.say(f"{endless}: read as continuous")
        return "continuous", -np.inf, np.inf
    reach = _TURN if kind == "revolute" else _SLIDE
    if not (low_ends or high_ends):
        low, high = -reach, reach
    elif low_ends:
        high = max(low, 0.0) + reach if kind == "prismatic" else low + reach
    else:
        low = min(high, 0.0) - reach if kind == "prismatic" else high - reach
    unit = "rad, a whole turn" if kind == "revolute" else "m"
    element.say(f"{endless}: bounded to {low:.6g} and {high:.6g} {unit}")
    return kind, low, high


def _doubt_degrees(low: float, high: float, element: Element) -> None:
    span = high - low
    whole = float(low).is_integer() and float(high).is_integer()
    if span > _DEGREES_FROM or (whole and span > _WHOLE_DEGREES_FROM):
        element.say(
            f"limits {low:g} and {high:g} rad are {span / _TURN:.1f} turns: they look like degrees, and are taken as "
            f'radians; if they are degrees, write lower="{np.deg2rad(low):.6g}" upper="{np.deg2rad(high):.6g}"'
        )
