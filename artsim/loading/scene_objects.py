"""Which object of a scene is meant: bodies that fly free of each other are objects of their own.

What hangs on the world, through joints or none, is one object, and so is each free body with all that it carries. Of
several, the only one that is articulated counts, or, where none is, the only free one. Else somebody has to choose.
"""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from artsim.common.names import printable
from artsim.errors import SceneError
from artsim.loading.urdf_document import MimicRelation, Shape
from artsim.model.inertia import Inertia
from artsim.model.kinematics import Array
from artsim.model.objects import UNKNOWN_DYNAMICS, JointDynamics, Repair

WORLD = "world"
_LISTED = 20
_MOVING = ("revolute", "continuous", "prismatic")


@dataclass(frozen=True, eq=False)
class WorldJoint:
    """A joint in the world's frame, at the zero of all joints."""

    name: str
    type: str
    """As of :class:`~artsim.loading.urdf_document.UrdfJoint`."""
    anchor: Array
    """(3,) float. A point on the axis, metres."""
    axis: Array
    """(3,) float. Unit."""
    lower: float = -np.inf
    upper: float = np.inf
    """Radians or metres; infinite where there is no end."""
    mimic: MimicRelation | None = None
    dynamics: JointDynamics = UNKNOWN_DYNAMICS


@dataclass(eq=False)
class WorldLink:
    """A link in the world's frame, at the zero of all joints."""

    name: str
    parent: int = -1
    """Index of the link that carries it; -1 for the world."""
    joint: WorldJoint | None = None
    """None for the world."""
    shapes: list[Shape] = field(default_factory=list)
    collision: list[Shape] = field(default_factory=list)
    """What it shows and what collides; their origins map to the world's frame."""
    inertia: Inertia | None = None
    """In the world's frame."""


def chosen(links: Sequence[WorldLink], file: Path, repairs: list[Repair], body: str | None = None) -> list[WorldLink]:
    """The links of one object, after a world that shows what belongs to it.

    Parameters
    ----------
    links : sequence of WorldLink
        The world first, parents before children.
    file : Path
        For messages.
    repairs : list of Repair
        Added to.
    body : str, optional
        The link that is the object's root, or ``world`` for what hangs on the world.

    Raises
    ------
    SceneError
        When the file holds several objects, or none of this name. It has their names.
    """
    scene = _Scene(links)
    if body is not None:
        return scene.part(body, file)
    objects = scene.objects()
    if not objects:
        return list(links)
    candidates = objects
    if len(objects) > 1:
        candidates = [name for name in objects if scene.is_articulated(name)] or [n for n in objects if n != WORLD]
    if len(candidates) > 1:
        first = shlex.quote(printable(candidates[0], 100))
        kind = "articulated objects" if scene.is_articulated(candidates[0]) else "objects"
        raise SceneError(
            f"it holds {len(candidates)} {kind}: {_list(candidates)}",
            file,
            f"choose one: --body {first}, in Python body={candidates[0]!r}; for programs without this option: "
            f"artsim export {shlex.quote(str(file))} --body {first} --out FOLDER",
            tuple(candidates),
        )
    (name,) = candidates
    others = [other for other in objects if other != name]
    heads = scene.articulated_heads() if name == WORLD else []
    if others:
        said = f"{name!r} is taken, and other objects are left out: {_list(others)}; --body NAME takes another"
        repairs.append(Repair("file", said))
    if len(heads) > 1:
        said = f"{len(heads)} articulated bodies are taken as one object: {_list(heads)}; --body NAME takes one of them"
        repairs.append(Repair("file", said))
    return scene.part(name, file)


class _Scene:
    """Links by the object that they belong to: each is named after its root, the world or a free body."""

    def __init__(self, links: Sequence[WorldLink]):
        self.links = links
        self._owner = [0] * len(links)
        self._head = [0] * len(links)  # the body that is held by the world, or is free, and carries the link
        self._is_solid = [bool(link.shapes or link.collision) for link in links]
        for k, link in enumerate(links[1:], start=1):
            is_free = link.joint is not None and link.joint.type == "floating"
            self._owner[k] = k if is_free else self._owner[link.parent]
            self._head[k] = self._head[link.parent] or k
        carries = list(self._is_solid)
        for k in range(len(links) - 1, 0, -1):
            carries[links[k].parent] |= carries[k]
        self._moves = [
            link.joint is not None and link.joint.type in _MOVING and carries[k] for k, link in enumerate(links)
        ]

    def objects(self) -> list[str]:
        """Names of objects that show or touch something."""
        return [
            self.links[k].name for k in sorted({self._owner[k] for k in range(len(self.links)) if self._is_solid[k]})
        ]

    def is_articulated(self, name: str) -> bool:
        """Whether an object has a joint that moves something of it."""
        return any(self._moves[k] and self.links[self._owner[k]].name == name for k in range(len(self.links)))

    def articulated_heads(self) -> list[str]:
        """Bodies fixed to the world that carry joints which move something."""
        heads = sorted({self._head[k] for k in range(len(self.links)) if self._moves[k] and not self._owner[k]})
        joints = [(k, self.links[k].joint) for k in heads]
        return [self.links[k].name for k, joint in joints if joint is not None and joint.type == "fixed"]

    def part(self, name: str, file: Path) -> list[WorldLink]:
        """A link and all that it carries, below a world that shows nothing unless it is that link."""
        links = self.links
        root = next((k for k, link in enumerate(links) if link.name == name), None)
        if root is None:
            names = tuple(self.objects())
            raise SceneError(
                f"it has no body {name!r}; its objects are {_list(names)}", file, "name a body of it", names
            )
        kept = {root: 0} if root == 0 else {0: 0, root: 1}
        for k in range(root + 1, len(links)):
            if links[k].parent in kept and self._owner[k] == self._owner[root] and (root == 0 or links[k].parent > 0):
                kept[k] = len(kept)
        joints = {link.joint.name for link in (links[k] for k in kept if k != root) if link.joint is not None}
        found = []
        for k in kept:
            joint, parent = links[k].joint, kept.get(links[k].parent, 0 if k else -1)
            if joint is not None and k == root and joint.type != "floating":
                joint = replace(joint, type="fixed", mimic=None)
            elif joint is not None and joint.mimic is not None and joint.mimic.joint not in joints:
                joint = replace(joint, mimic=None)
            link = replace(links[k], parent=parent, joint=joint)
            found.append(replace(link, shapes=[], collision=[]) if root and not k else link)
        return found


def _list(names: Sequence[str]) -> str:
    more = f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    return ", ".join(printable(name, 60) for name in names[:_LISTED]) + more
