"""An object as links and joints of the kinds that simulators know: what every file format is written from."""

import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.typing import NDArray

from artsim.common.names import safe_name, unused_name
from artsim.errors import AssetError
from artsim.model.details import DetailFrame
from artsim.model.inertia import Inertia, combine_inertias
from artsim.model.joints import Joint
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject, Mesh
from artsim.model.part_inertia import part_inertia

GRAVITY = 9.81
DECAY = 0.5
"""Seconds in which a joint's damping takes away most (1 - 1/e) of its speed."""
SPRING_TIME = 0.002
"""Seconds in which a spring brings a light key back, at least: damping over stiffness. MuJoCo takes springs as they are
when a step of 2 ms begins, which throws keys about that nothing damps so much."""
SLIDING_FRICTION = 0.05
"""Friction of a slide over the weight that it carries."""
PIN_RADIUS = 0.002
"""Metres; friction of a hinge is that of a pin of this radius that carries the weight."""
STRENGTH = 5.0
"""Effort limit over what holds the carried weight, held horizontally at its whole reach."""
TURN_SPEED, SLIDE_SPEED = 4.0 * np.pi, 2.0
"""Velocity limits, rad/s and m/s."""
STROKE_TIME = 0.2
"""Least seconds that a joint needs for its whole range: in a time step of 2 ms it goes 1 % of it at most, and
simulators stop it where its limit is."""
HELPER_SHARE = 0.01
"""Share of a screw part's mass that its helper link takes over from it."""

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


@dataclass(frozen=True, eq=False)
class BoxShape:
    """A box along the axes of the rest frame: centre and side lengths, (3,) metres."""

    center: Array
    size: Array
    detail: str = ""
    """Name of the handle, knob or other labelled piece that it is of."""


@dataclass(frozen=True, eq=False)
class MeshShape:
    """A mesh in the rest frame, metres, with the name of its file."""

    name: str
    vertices: Array
    faces: NDArray[np.int32]
    detail: str = ""
    """As of a box."""


@dataclass(frozen=True, eq=False)
class Link:
    """One rigid body."""

    name: str
    part: int
    """The part that it is; -1 for the helper link between the two joints of a screw, which has no shape."""
    origin: Array
    """(3,) float. Its frame's origin in the rest frame, at rest, metres. Axes are those of the rest frame."""
    inertia: Inertia
    visual: MeshShape | None = None
    collision: tuple[BoxShape | MeshShape, ...] = ()
    """Each convex."""
    details: tuple[DetailFrame, ...] = ()
    """Its handles, knobs, panes and other labelled pieces."""


@dataclass(frozen=True, eq=False)
class LinkJoint:
    """A revolute, continuous or prismatic joint between two links, at the child's frame origin."""

    name: str
    type: str
    parent: int
    child: int
    """Links."""
    axis: Array
    """(3,) float. Unit."""
    lower: float
    upper: float
    """Radians or metres; infinite where it turns without end. A screw's turning joint is ``continuous`` and has limits
    nevertheless: URDF holds them in the sliding joint alone."""
    effort: float
    velocity: float
    """Limits: N m or N, rad/s or m/s."""
    damping: float
    friction: float
    """N m s or N s/m; N m or N."""
    inertia: float
    """Of all that it carries at rest, along or about its axis: kg or kg m^2."""
    mimic: tuple[str, float, float] | None = None
    """Name of the joint followed, multiplier, offset."""
    spring: float = 0.0
    """N m/rad or N/m: pulls it to 0."""
    hold: float = 0.0
    hold_over: float = 0.0
    """A latch, magnet or gasket holds it at 0 with so many N m or N, less and less until it is so far open."""

    def held(self, value: float) -> float:
        """Effort of its latch at a state, against the way that it opens."""
        if self.hold == 0.0 or not abs(value) < self.hold_over:
            return 0.0
        opens = 1.0 if self.upper >= -self.lower else -1.0
        return -opens * self.hold * (1.0 - abs(value) / self.hold_over) if value * opens >= 0.0 else 0.0


@dataclass(frozen=True, eq=False)
class Robot:
    """Links (the root first) and joints (each after its parent's) of an object."""

    obj: ArticulatedObject
    links: tuple[Link, ...]
    joints: tuple[LinkJoint, ...]

    @property
    def name(self) -> str:
        """Category and id, as any file format can hold them."""
        return safe_name(f"{self.obj.category}_{self.obj.object_id}")

    @property
    def meshes(self) -> list[MeshShape]:
        """Every mesh that needs a file."""
        shapes = [s for link in self.links for s in (link.visual, *link.collision)]
        return [shape for shape in shapes if isinstance(shape, MeshShape)]

    def states(self, q: Array) -> dict[str, float]:
        """Value of each joint for a (K,) state of the object, metres and radians."""
        q = self.obj.tree.complete_state(q)
        values = {joint.name: float(q[k]) for k, joint in enumerate(self.obj.tree.joints) if k > 0}
        for joint in self.joints:
            if joint.name not in values and joint.mimic is not None:  # the sliding joint of a screw
                source, multiplier, offset = joint.mimic
                values[joint.name] = multiplier * values[source] + offset
        return values


def as_robot(obj: ArticulatedObject) -> Robot:
    """Write an object as links and joints.

    A screw becomes a prismatic joint, a helper link and a continuous joint, which the first follows. In the other order
    SAPIEN would couple the two, by a tendon whose force on the thread is that of a metre for each radian.

    Raises
    ------
    AssetError
        When a part has no body or no proper name, or the object is not at rest at q = 0.
    """
    tree = obj.tree
    where = f"{obj.category} {obj.object_id}"
    words = [word for part in obj.parts for word in (part.name, part.label)] + [joint.name for joint in tree.joints]
    for word in words:
        if not _NAME.fullmatch(word):
            raise AssetError(
                f"cannot write the name {word!r}",
                where,
                "use letters, digits and _ only, or pass a loaded object through artsim.export.prepare first",
            )
    if np.any(tree.rest):
        raise AssetError("is not at rest at q = 0", where, "pass a loaded object through artsim.export.prepare first")
    own = [part_inertia(obj, k) for k in range(len(obj))]
    carried = [
        combine_inertias(own[j] for j in range(k, len(obj)) if _carries(tree.parents, k, j)) for k in range(len(obj))
    ]
    used = {part.name for part in obj.parts} | {joint.name for joint in tree.joints}
    links: list[Link] = []
    joints: list[LinkJoint] = []
    index: list[int] = []  # link of each part
    for k, joint in enumerate(tree.joints):
        origin = tree.origins[k] if k > 0 else np.zeros(3)
        inertia = own[k]
        if k > 0:
            parent = index[joint.parent]
            if joint.type == "screw":
                slide = unused_name(f"{obj.parts[k].name}_slide", used)
                joints.append(_slide(slide, joint, parent, len(links), carried[k]))
                parent = len(links)
                helper = unused_name(f"{obj.parts[k].name}_thread", used)
                links.append(Link(helper, -1, origin, inertia.share(HELPER_SHARE)))
                inertia = inertia.share(1.0 - HELPER_SHARE)
            joints.append(_joint(obj, k, parent, len(links), carried[k]))
        index.append(len(links))
        links.append(_link(obj, k, origin, inertia))
    return Robot(obj, tuple(links), tuple(joints))


def _carries(parents: Sequence[int] | NDArray[np.int64], k: int, j: int) -> bool:
    """Whether part j hangs on part k, or is it."""
    while j > k:
        j = int(parents[j])
    return j == k


def _link(obj: ArticulatedObject, k: int, origin: Array, inertia: Inertia) -> Link:
    part = obj.parts[k]
    pieces = () if part.body is None else part.body.pieces
    details = tuple(detail for detail in obj.details if detail.part == k)
    owner = {v.tobytes(): its.name for own, its in zip(part.details, details, strict=True) for v, _ in own.pieces}
    return Link(
        part.name,
        k,
        origin,
        inertia,
        MeshShape(part.name, part.vertices * obj.scale, part.faces) if len(part.faces) else None,
        tuple(
            _convex(f"{part.name}-hull{i}", piece, obj.scale, owner.get(piece[0].tobytes(), ""))
            for i, piece in enumerate(pieces)
        ),
        details,
    )


def _convex(name: str, piece: Mesh, scale: float, detail: str) -> BoxShape | MeshShape:
    """A box where the piece is one, else its mesh."""
    vertices, faces = piece[0] * scale, piece[1]
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    near = np.minimum(np.abs(vertices - low), np.abs(vertices - high)).max()
    corners = np.unique(np.abs(vertices - low) < np.abs(vertices - high), axis=0)
    if len(vertices) == len(corners) == 8 and near < 1e-12:
        return BoxShape(0.5 * (low + high), high - low, detail)
    return MeshShape(name, vertices, faces, detail)


def _joint(obj: ArticulatedObject, k: int, parent: int, child: int, carried: Inertia) -> LinkJoint:
    """The joint of part k: with the strength, damping and friction that its source file says, at native size."""
    joint, body, mimic = obj.tree.joints[k], obj.parts[k].body, None
    if joint.mimic is not None:
        mimic = (obj.tree.joints[joint.mimic.source].name, joint.mimic.multiplier, joint.mimic.offset)
    kind = "continuous" if joint.type == "screw" else joint.type
    derived = _link_joint(joint.name, kind, parent, child, joint, joint.lower, joint.upper, carried, mimic)
    said = {} if body is None or obj.scale != 1.0 else asdict(body.joint)
    least = said.pop("least_effort", None) or 0.0
    derived = replace(derived, damping=max(derived.damping, SPRING_TIME * (said.get("spring") or 0.0)))
    known = replace(derived, **{name: value for name, value in said.items() if value is not None})
    return replace(known, effort=max(known.effort, least))


def _slide(name: str, joint: Joint, parent: int, child: int, carried: Inertia) -> LinkJoint:
    """The prismatic joint of a screw."""
    lower, upper = sorted((joint.lower * joint.pitch, joint.upper * joint.pitch))
    if not (np.isfinite(lower) and np.isfinite(upper)):
        raise AssetError("a screw without limits cannot be written", f"joint {joint.name!r}", "limit it")
    return _link_joint(name, "prismatic", parent, child, joint, lower, upper, carried, (joint.name, joint.pitch, 0.0))


def _link_joint(
    name: str,
    kind: str,
    parent: int,
    child: int,
    joint: Joint,
    lower: float,
    upper: float,
    carried: Inertia,
    mimic: tuple[str, float, float] | None,
) -> LinkJoint:
    """A joint with damping, friction and strength that fit what it carries."""
    axis, origin = np.asarray(joint.axis), np.asarray(joint.origin)
    weight = carried.mass * GRAVITY
    if kind == "prismatic":
        effort, velocity = STRENGTH * weight, SLIDE_SPEED
        inertia, friction = carried.mass, SLIDING_FRICTION * weight
    else:
        inertia = carried.about(origin, axis)
        reach = np.sqrt(inertia / carried.mass)
        effort, velocity = STRENGTH * weight * reach, TURN_SPEED
        friction = weight * PIN_RADIUS * min(1.0, reach)
    if 0.0 < upper - lower < np.inf:
        velocity = min(velocity, (upper - lower) / STROKE_TIME)
    return LinkJoint(
        name, kind, parent, child, axis, lower, upper, float(effort), float(velocity), inertia / DECAY, friction,
        inertia, mimic,
    )  # fmt: skip
