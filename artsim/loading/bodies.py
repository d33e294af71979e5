"""Links of a URDF file become rigid bodies: fixed joints merged, screws joined, what shows nothing left out."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from artsim.common.products import apply, dot, matmul, unit
from artsim.errors import AssetError
from artsim.loading.urdf_document import UrdfJoint, UrdfRobot
from artsim.model.kinematics import Array
from artsim.model.objects import Part, Repair


@dataclass(eq=False)
class RigidBody:
    """Links that never move against each other, in the base link's frame at the file's zero state."""

    links: list[str]
    joint: UrdfJoint | None  # the moving joint that carries the body; None for the root
    parent: RigidBody | None
    T_base_joint: Array
    T_base_link: dict[str, Array]
    vertices: Array
    faces: NDArray[np.int32]
    slide: UrdfJoint | None = None  # screws: the prismatic joint merged into this one
    slide_rate: float = 0.0  # screws: value of the slide joint for each radian
    pitch: float = 0.0  # screws: metres along the turning axis for each radian
    details: dict[str, NDArray[np.int64]] = field(default_factory=dict)  # faces of shapes named as details are

    def part(self, labels: Mapping[str, str]) -> Part:
        label = next((labels[link] for link in self.links if link in labels), None)
        solid = self.links[0] if label is None else next(link for link in self.links if link in labels)
        return Part(solid, label or solid, self.vertices, self.faces)


def merge_fixed_links(robot: UrdfRobot, file: Path, repairs: list[Repair]) -> list[RigidBody]:
    """Bodies of the tree, root first, parents before children, siblings in the file's order."""
    children: dict[str, list[UrdfJoint]] = defaultdict(list)
    for joint in robot.joints:
        children[joint.parent].append(joint)
    root = _root_link(robot, children, file, repairs)
    solid = {link.name for link in robot.links if link.shapes or link.unusable}

    def new_body(link: str, joint: UrdfJoint | None, parent: RigidBody | None, T: Array) -> RigidBody:
        return RigidBody([link], joint, parent, T, {link: T}, np.zeros((0, 3)), np.zeros((0, 3), np.int32))

    bodies = [new_body(root, None, None, np.eye(4))]
    body_of = {root: bodies[0]}
    stack = [root]
    while stack:
        link = stack.pop()
        body = body_of[link]
        if body.links[0] == link and body is not bodies[0]:
            bodies.append(body)
        for joint in children[link]:
            T = matmul(body.T_base_link[link], joint.origin)
            if joint.type == "fixed" or _places_root(joint, link, root, children, solid, repairs):
                body.links.append(joint.child)
                body.T_base_link[joint.child] = T
                body_of[joint.child] = body
            elif joint.type == "floating":
                raise AssetError(
                    f"a floating joint inside the object is not supported: link {joint.child!r} flies free of {link!r}",
                    f"{file}: joint {joint.name!r}",
                    'write type="fixed" to hold it there, or keep each floating object in a separate file',
                )
            else:
                body_of[joint.child] = new_body(joint.child, joint, body, T)
        stack += [joint.child for joint in reversed(children[link])]
    lost = [link.name for link in robot.links if link.name not in body_of]
    if lost:
        raise AssetError(f"links {', '.join(lost[:5])} form a cycle that hangs on nothing", file, "remove one joint")
    merged_links = [link for body in bodies for link in body.links[1:]]
    if merged_links:
        repairs.append(Repair("fixed joints", f"merged into their parent: {', '.join(merged_links)}", note=True))
    return bodies


def _root_link(robot: UrdfRobot, children: Mapping[str, list[UrdfJoint]], file: Path, repairs: list[Repair]) -> str:
    carried_by: dict[str, str] = {}
    for joint in robot.joints:
        if joint.child in carried_by:
            raise AssetError(
                f"link {joint.child!r} is carried by two joints, {carried_by[joint.child]!r} and {joint.name!r}",
                file,
                "closed chains are not trees: remove one of the joints",
            )
        carried_by[joint.child] = joint.name
    roots = [link for link in robot.links if link.name not in carried_by]
    if not roots:
        raise AssetError("every link has a parent: the joints form a cycle", file, "remove the joint that closes it")
    used = [r for r in roots if r.shapes or r.unusable or r.empty or children.get(r.name)] or roots[:1]
    if len(used) > 1:
        names = ", ".join(r.name for r in used[:5])
        raise AssetError(f"{len(used)} links have no parent: {names}", file, "join them with a fixed joint")
    for stray in roots:
        if stray is not used[0]:
            repairs.append(Repair(f"link {stray.name!r}", "left out: no joint reaches it and it has no geometry"))
    return str(used[0].name)


def _places_root(
    joint: UrdfJoint,
    link: str,
    root: str,
    children: Mapping[str, list[UrdfJoint]],
    solid: Collection[str],
    repairs: list[Repair],
) -> bool:
    """Whether a floating joint only places the whole object in its world: the object's own pose covers that."""
    if joint.type != "floating" or link != root or root in solid or len(children[root]) != 1:
        return False
    repairs.append(Repair(f"joint {joint.name!r}", "floats the whole object: left to the object's pose", note=True))
    return True


def without_empty_leaves(bodies: list[RigidBody], repairs: list[Repair], noun: str = "link") -> list[RigidBody]:
    """Bodies without those that show nothing, carry nothing and drive nothing (tool frames, sensor frames)."""
    drivers = {body.joint.mimic.joint for body in bodies if body.joint is not None and body.joint.mimic is not None}
    kept = list(bodies)
    for body in reversed(bodies):  # children before parents
        if body.joint is None or len(body.faces) or body.joint.name in drivers:
            continue
        if not any(other.parent is body for other in kept):
            kept.remove(body)
            repairs.append(Repair(f"{noun} {body.links[0]!r}", "left out: it moves, but shows and carries nothing"))
    return kept


def join_screws(
    bodies: list[RigidBody], known: Collection[str], repairs: list[Repair], guessed: bool = True
) -> list[RigidBody]:
    """One screw part in place of a helper link between a prismatic and a turning joint on one axis.

    Helpers that the file's annotation knows of need no mention. With ``guessed``, a slide and a continuous joint that
    nothing relates are a screw, too, as PartNet-Mobility writes them.
    """
    kept = list(bodies)
    for helper in bodies:
        carried = [b for b in bodies if b.parent is helper]
        if helper.joint is None or len(helper.faces) or len(carried) != 1:
            continue
        body = carried[0]
        by_type = {b.joint.type: b for b in (helper, body) if b.joint is not None}
        turn, slide = by_type.get("continuous") or by_type.get("revolute"), by_type.get("prismatic")
        if turn is None or slide is None or body.joint is None:
            continue
        if not guessed and not _follows(slide, turn):
            continue
        along = float(dot(axis_in_base(slide), axis_in_base(turn)))
        rate = _slide_rate(turn, slide)
        if abs(abs(along) - 1.0) > 1e-6 or rate == 0.0:
            continue
        others = [b.joint.mimic.joint for b in bodies if b not in (helper, body) and b.joint and b.joint.mimic]
        if slide.joint is None or turn.joint is None or slide.joint.name in others:
            continue
        pitch = rate * float(np.sign(along))
        body.links = body.links + helper.links
        body.T_base_link = helper.T_base_link | body.T_base_link
        if helper.links[0] not in known:
            repairs.append(
                Repair(
                    f"link {helper.links[0]!r}",
                    f"helper of a screw: joints {helper.joint.name!r} and {body.joint.name!r} joined into one of "
                    f"{pitch:.6g} m/rad",
                )
            )
        body.slide, body.slide_rate, body.pitch = slide.joint, rate, pitch
        body.T_base_joint, body.joint, body.parent = turn.T_base_joint, turn.joint, helper.parent
        kept.remove(helper)
    return kept


def in_order(bodies: list[RigidBody], order: Sequence[str], repairs: list[Repair]) -> tuple[list[RigidBody], bool]:
    """Bodies in the order of a list of their links, and whether there was one that fits."""
    by_name = {body.links[0]: body for body in bodies}
    ordered = [by_name[name] for name in order if name in by_name]
    position = {body: i for i, body in enumerate(ordered)}
    fits = len(order) == len(position) == len(bodies) and all(
        (body.parent is None) == (i == 0) and (body.parent is None or position[body.parent] < i)
        for i, body in enumerate(ordered)
    )
    if order and not fits:
        repairs.append(Repair("meta.json", "its list of parts is not that of the file: ignored"))
    return (ordered, True) if fits else (bodies, False)


def axis_in_base(body: RigidBody) -> Array:
    """Unit axis of a body's joint in the base link's frame."""
    assert body.joint is not None
    return unit(apply(body.T_base_joint[:3, :3], body.joint.axis))


def _follows(slide: RigidBody, turn: RigidBody) -> bool:
    """Whether a slide's joint is said to follow a turning one."""
    assert turn.joint is not None
    return slide.joint is not None and slide.joint.mimic is not None and slide.joint.mimic.joint == turn.joint.name


def _slide_rate(turn: RigidBody, slide: RigidBody) -> float:
    """Slide for each radian of turn: what a mimic relation says, else one turn for the whole slide."""
    assert turn.joint is not None
    assert slide.joint is not None
    if slide.joint.mimic is not None and slide.joint.mimic.joint == turn.joint.name:
        mimic = slide.joint.mimic
        return 0.0 if mimic.offset else mimic.multiplier
    if turn.joint.type != "continuous":  # a hinge and a slide, each of its own
        return 0.0
    return (slide.joint.upper - slide.joint.lower) / (2.0 * np.pi)
