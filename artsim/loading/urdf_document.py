"""What a URDF document says, checked: links with their shapes, and joints between them.

Other formats are written as the same links and joints.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from artsim.model.inertia import Inertia
from artsim.model.kinematics import Array
from artsim.model.objects import UNKNOWN_DYNAMICS, JointDynamics


class _Primitive:
    def __str__(self) -> str:
        return type(self).__name__.lower()


@dataclass(frozen=True)
class Box(_Primitive):
    """Centred box of (3,) side lengths; one of them may be 0."""

    size: Array


@dataclass(frozen=True)
class Cylinder(_Primitive):
    """Centred cylinder along z."""

    radius: float
    length: float


@dataclass(frozen=True)
class Capsule(_Primitive):
    """Centred capsule along z: ``length`` is that of the cylinder between the two half spheres."""

    radius: float
    length: float


@dataclass(frozen=True)
class Sphere(_Primitive):
    """Centred sphere."""

    radius: float


@dataclass(frozen=True)
class MeshFile:
    """A mesh by the name that the document gives it, and its (3,) scale (negative: mirrored), if it has one."""

    filename: str
    scale: Array | None = None

    def __str__(self) -> str:
        return f"mesh {self.filename!r}"


@dataclass(frozen=True, eq=False)
class InlineMesh:
    """A mesh that stands in the document itself, or was read with it: (V, 3) metres and (F, 3) triangles."""

    name: str
    vertices: Array
    faces: NDArray[np.int32]

    def __str__(self) -> str:
        return f"mesh {self.name!r}"


Geometry: TypeAlias = Box | Cylinder | Capsule | Sphere | MeshFile | InlineMesh
"""A shape of a link."""


@dataclass(frozen=True)
class Shape:
    """A geometry in its link."""

    geometry: Geometry
    origin: Array
    """(4, 4) float. Maps the geometry's frame to the link's."""
    name: str = ""
    """Of its element; PartNet-Mobility's say what is shown: "handle-12"."""


@dataclass(frozen=True)
class UrdfLink:
    """A link."""

    name: str
    shapes: tuple[Shape, ...] = ()
    """What it shows."""
    unusable: tuple[str, ...] = ()
    """Why other shapes of it cannot be shown."""
    empty: tuple[str, ...] = ()
    """What shapes of it have no extent, so that there is nothing to show."""
    details: tuple[Shape, ...] = ()
    """Collision shapes of URDF that are named as details are."""
    collision: tuple[Shape, ...] = ()
    """What collides; of MJCF and USD alone."""
    inertia: Inertia | None = None
    """In the link's frame; of MJCF and USD alone."""


@dataclass(frozen=True)
class MimicRelation:
    """The value of a joint is ``multiplier`` times that of ``joint``, plus ``offset``."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True)
class UrdfJoint:
    """A joint."""

    name: str
    type: str
    parent: str
    child: str
    """Type is revolute, continuous, prismatic, fixed or floating; parent and child are links."""
    origin: Array
    """(4, 4) float. Maps the joint's frame at zero to the parent's."""
    axis: Array
    """(3,) float. Unit vector in the joint's frame."""
    lower: float
    upper: float
    """Radians or metres; infinite where it turns freely."""
    mimic: MimicRelation | None = None
    dynamics: JointDynamics = UNKNOWN_DYNAMICS
    """Of MJCF and USD alone."""


@dataclass(frozen=True)
class UrdfRobot:
    """Links and joints in the document's order."""

    links: tuple[UrdfLink, ...]
    joints: tuple[UrdfJoint, ...]
    explicit: bool = False
    """Whether it says of every joint that follows another that it does. PartNet-Mobility's URDF files leave it unsaid
    how far a screw goes for each turn."""
    labels: Mapping[str, str] = field(default_factory=dict)
    """What links are, where the document says so."""
    helpers: tuple[str, ...] = ()
    """Links without a shape between the two joints of a screw."""
    noun: str = "link"
    """What the document calls a link, for messages."""
