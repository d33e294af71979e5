"""PartNet-Mobility's annotation of joints as an object: ``mobility_v2.json``, ``mobility_v3.json``.

Version 2 is a list of rigid bodies; version 3 is an object with this list under ``mobility`` and the parts' names under
``partnet``. Each body has an ``id``, a ``parent`` (-1 for none), a kind of ``joint``, ``parts`` by their numbers, and
``jointData``. Everything is in the frame of the meshes, with Y up.

========================================  =============================================================================
The annotation                            is read as
========================================  =============================================================================
hinge, with limits, with ``noLimit``      revolute, by limits in degrees; continuous
slider                                    prismatic; with ``noLimit``: 1 m either way
slider that ``rotates``                   a screw: ``rotationLimit`` degrees for the whole slide, else one turn
limits from large to small                the axis the other way round
limits of a hinge over a whole turn       whole turns nearer to 0, as in PartNet-Mobility's own URDF files
free, static, heavy, fixed                held by its parent; the root
junk that carries nothing                 left out
several roots                             one part
``null`` in a point or a direction        0
========================================  =============================================================================
"""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from artsim.common.products import norm
from artsim.errors import AssetError
from artsim.loading.joint_xml import settle_limits
from artsim.loading.json_values import number, text, triple, whole
from artsim.loading.meshes import MeshReader
from artsim.loading.mobility_meshes import PartMeshes, part_meshes
from artsim.loading.urdf_document import MimicRelation, Shape, UrdfJoint, UrdfLink, UrdfRobot
from artsim.loading.xml_values import Element
from artsim.model.kinematics import Array
from artsim.model.objects import Repair
from artsim.model.transforms import compose_transform

_HELD = ("free", "static", "heavy", "fixed", "junk", "")
_MOVES = {"hinge": "revolute", "slider": "prismatic"}
_BASE = "base"

T_BASE_MESH = np.array([[0.0, 0.0, -1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""Maps the frame of the meshes to one with Z up, as the fixed joint of PartNet-Mobility's URDF files does."""


@dataclass(frozen=True, eq=False)
class _Body:
    """A rigid body of the annotation."""

    number: int
    parent: int
    kind: str
    """Of its joint."""
    label: str
    parts: tuple[int, ...]
    origin: Array
    axis: Array
    """(3,) float. Of its joint; the axis is 0 where it has none."""
    limit: dict[str, Any]

    @property
    def link(self) -> str:
        return f"link_{self.number}"

    @property
    def joint(self) -> str:
        return f"joint_{self.number}"


def is_mobility(document: object) -> bool:
    """Whether a JSON value is such an annotation."""
    rows = document.get("mobility") if isinstance(document, dict) else document
    return isinstance(rows, list) and bool(rows) and all(isinstance(row, dict) and "joint" in row for row in rows)


def read_mobility(document: Any, file: Path, reader: MeshReader) -> tuple[UrdfRobot, list[Repair], list[bytes]]:
    """Links and joints of an annotation, as :func:`artsim.loading.documents.read_document` gives them.

    Links have the names that PartNet-Mobility's URDF files give them.
    """
    rows = document["mobility"] if isinstance(document, dict) else document
    if len(rows) > reader.limits.max_links:
        raise AssetError(
            f"{len(rows)} bodies are over the limit of {reader.limits.max_links}", file, "raise LoadLimits.max_links"
        )
    repairs: list[Repair] = []
    names: dict[int, str] = {}
    bodies = [_body(row, f"{file}: body {i}", names, repairs) for i, row in enumerate(rows)]
    bodies = _without_junk(_checked(bodies, file), repairs)
    meshes = part_meshes(document, file, names, {body.number for body in bodies}, reader, repairs)
    return _document(bodies, names, meshes, file, repairs), repairs, meshes.contents


def _body(row: dict[str, Any], where: str, names: dict[int, str], repairs: list[Repair]) -> _Body:
    own = whole(row.get("id"), "id", where)
    where = f"{where} (id {own})"
    kind = row["joint"] if isinstance(row["joint"], str) else str(row["joint"])
    if kind not in _HELD and kind not in _MOVES:
        raise AssetError(
            f"its joint {kind[:60]!r} is of no kind that is read",
            where,
            f"use one of {', '.join((*_MOVES, *_HELD[:5]))}",
        )
    parts = row.get("parts") or []
    if not isinstance(parts, list) or not all(isinstance(part, dict) for part in parts):
        raise AssetError("its 'parts' are no list of objects", where, 'write "parts": [{"id": 0, "name": "..."}]')
    numbers = []
    for part in parts:
        numbers.append(whole(part.get("id"), "id", f"{where}: part"))
        names.setdefault(numbers[-1], str(part.get("name") or numbers[-1])[:200])
    label = row.get("name") or (names[numbers[0]] if numbers else f"link_{own}")
    origin, axis = np.zeros(3), np.zeros(3)
    limit: dict[str, Any] = {}
    if kind in _MOVES:
        data = row.get("jointData")
        ends = data.get("axis") if isinstance(data, dict) else None
        if not isinstance(data, dict) or not isinstance(ends, dict):
            raise AssetError(
                f"is a {kind} without an axis", where,
                'write "jointData": {"axis": {"origin": [0, 0, 0], "direction": [0, 1, 0]}, "limit": ...}',
            )  # fmt: skip
        origin, axis = (_point(ends.get(key), key, own, where, repairs) for key in ("origin", "direction"))
        limit = data["limit"] if isinstance(data.get("limit"), dict) else {}
    return _Body(
        own, whole(row.get("parent", -1), "parent", where), kind, text(label, "name", where), tuple(numbers), origin,
        axis, limit,
    )  # fmt: skip


def _point(value: object, key: str, own: int, where: str, repairs: list[Repair]) -> Array:
    """(3,) numbers, 0 where one is missing."""
    known = value if value is not None else [None, None, None]
    if isinstance(known, list) and None in known:
        repairs.append(Repair(f"joint 'joint_{own}'", f"its {key} has no number in places: read as 0"))
        known = [0.0 if entry is None else entry for entry in known]
    return triple(known, key, where)


def _checked(bodies: list[_Body], file: Path) -> list[_Body]:
    """The bodies, each with a number of its own and a parent that is there; raises AssetError."""
    numbers = Counter(body.number for body in bodies)
    for body in bodies:
        where = f"{file}: body {body.number}"
        if numbers[body.number] > 1:
            raise AssetError(f"{numbers[body.number]} bodies have the id {body.number}", where, "give each its own")
        if body.parent != -1 and body.parent not in numbers:
            raise AssetError(f"its parent {body.parent} does not exist", where, 'write "parent": -1 for a root')
        if body.parent == -1 and body.kind in _MOVES:
            raise AssetError(
                f"is a {body.kind} without a parent", where, 'name what carries it, or write "joint": "free"'
            )
    if not any(body.parent == -1 for body in bodies):
        raise AssetError("every body has a parent: they form a cycle", file, 'write "parent": -1 for the root')
    return bodies


def _without_junk(bodies: list[_Body], repairs: list[Repair]) -> list[_Body]:
    """Bodies without those that are called junk and carry nothing, unless they are all that there is."""
    carried = {body.parent for body in bodies}
    kept = [body for body in bodies if body.kind != "junk" or body.number in carried]
    if not kept:
        return bodies
    for body in bodies:
        if body not in kept:
            repairs.append(Repair(f"link {body.link!r}", f"{body.label} left out: the annotation calls it junk"))
    return kept


def _document(
    bodies: list[_Body], names: dict[int, str], meshes: PartMeshes, file: Path, repairs: list[Repair]
) -> UrdfRobot:
    by_number = {body.number: body for body in bodies}
    links, joints, helpers = [UrdfLink(_BASE)], [], []
    roots = [body.link for body in bodies if body.parent == -1]
    if len(roots) > 1:
        repairs.append(Repair("roots", f"{', '.join(roots[:5])} have no parent: taken as one part"))
    for body in bodies:
        links.append(_link(body, names, meshes))
        parent = by_number.get(body.parent)
        if parent is None:
            turned = UrdfJoint(body.joint, "fixed", _BASE, body.link, T_BASE_MESH, np.array([1.0, 0, 0]), 0.0, 0.0)
            joints.append(turned)
            continue
        element = Element(f"joint {body.joint!r}", file, repairs)
        joint = _joint(body, parent.link, compose_transform(body.origin - parent.origin), element)
        if joint.type == "prismatic" and body.limit.get("rotates"):
            helper, pair = _screw(body, joint, element)
            links.append(helper)
            joints += pair
            helpers.append(helper.name)
        else:
            joints.append(joint)
    labels = {body.link: body.label for body in bodies}
    return UrdfRobot(tuple(links), tuple(joints), labels=labels, helpers=tuple(helpers))


def _link(body: _Body, names: dict[int, str], meshes: PartMeshes) -> UrdfLink:
    shapes, unusable = list(meshes.of_link.get(body.number, ())), []
    for part in body.parts:
        found = meshes.of_part.get(part, ())
        shapes += found
        if not found and body.number not in meshes.of_link:
            unusable.append(f"part {part} ({names[part]}) has no mesh {meshes.where}")
    place = compose_transform(-body.origin)
    return UrdfLink(body.link, tuple(Shape(geometry, place) for geometry in shapes), tuple(unusable))


def _joint(body: _Body, parent: str, origin: Array, element: Element) -> UrdfJoint:
    """The joint of a body on its parent; the origin maps its frame to the parent's."""
    kind, axis, low, high = "fixed", np.array([1.0, 0.0, 0.0]), 0.0, 0.0
    if body.kind in _MOVES:
        if np.abs(body.axis).max() > 0:
            axis = body.axis / norm(body.axis)
            kind, turned, low, high = _limits(body, element)
            axis = -axis if turned else axis
        else:
            element.say("has no direction, along which nothing moves: read as fixed")
    return UrdfJoint(body.joint, kind, parent, body.link, origin, axis, low, high)


def _limits(body: _Body, element: Element) -> tuple[str, bool, float, float]:
    """Type, whether the axis is to be turned round, and limits in radians or metres."""
    kind, limit = _MOVES[body.kind], body.limit
    ends = [limit.get(key) for key in ("a", "b")]
    if limit.get("noLimit") or None in ends:
        if not limit.get("noLimit"):
            element.say(f"is a {body.kind} without limits: read as without an end")
        kind = "continuous" if kind == "revolute" else kind
        low, high = -np.inf, np.inf
        turned = False
    else:
        where = f"{element.file}: {element.name}"
        low, high = (number(end, key, where) for end, key in zip(ends, ("a", "b"), strict=True))
        turned = low > high
        if turned:
            low, high = -low, -high
        if kind == "revolute":
            turns = np.ceil((-360.0 - low) / 360.0) if low < -360.0 else -np.ceil((high - 360.0) / 360.0)
            if (low < -360.0 or high > 360.0) and high - low <= 720.0:
                low, high = low + 360.0 * turns, high + 360.0 * turns
                element.say(f"limits moved by {abs(turns):g} whole turns, as far as they are over one", note=True)
            low, high = float(np.deg2rad(low)), float(np.deg2rad(high))
    kind, low, high = settle_limits(kind, low, high, element)
    return kind, turned, low, high


def _screw(body: _Body, slide: UrdfJoint, element: Element) -> tuple[UrdfLink, list[UrdfJoint]]:
    """A link without a shape that slides, and the joint that turns the body on it."""
    helper = UrdfLink(f"{body.link}_helper")
    turn = f"{body.joint}_turn"
    degrees = body.limit.get("rotationLimit")
    if body.limit.get("noRotationLimit") or not degrees:
        element.say("is a screw of unknown pitch: taken as one turn for its whole slide")
        degrees = 360.0
    angle = float(np.deg2rad(number(degrees, "rotationLimit", f"{element.file}: {element.name}")))
    follows = MimicRelation(turn, (slide.upper - slide.lower) / angle, 0.0)
    slides = UrdfJoint(
        slide.name, "prismatic", slide.parent, helper.name, slide.origin, slide.axis, slide.lower, slide.upper, follows
    )
    return helper, [
        slides, UrdfJoint(turn, "continuous", helper.name, body.link, np.eye(4), slide.axis, -np.inf, np.inf)
    ]  # fmt: skip
