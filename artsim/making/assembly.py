"""Assemblies: solids put together by joints, as the families of procedural objects describe them."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from artsim.common.products import apply, unit
from artsim.errors import AssetError, KinematicsError
from artsim.making.outlines import Vector
from artsim.making.solids import Solid
from artsim.model.details import detail_of
from artsim.model.joints import Joint, Mimic
from artsim.model.kinematics import Array, KinematicTree
from artsim.model.objects import ArticulatedObject, Body, Part, content_sha256
from artsim.model.transforms import rotation_about


@dataclass(frozen=True)
class JointSpec:
    """A joint to a parent part; see :func:`revolute` and its siblings.

    Axis and origin are written in the assembly's frame, at rest. State 0 is the rest state.
    """

    type: str
    parent: str
    axis: Vector
    origin: Vector = (0.0, 0.0, 0.0)
    lower: float = -np.inf
    upper: float = np.inf
    pitch: float = 0.0
    mimic: tuple[str, float] | None = None
    """Part whose joint is followed, and the multiplier."""


def revolute(parent: str, axis: Vector, origin: Vector, lower: float, upper: float, **more: Any) -> JointSpec:
    """Hinge about an axis through ``origin``, limits in radians."""
    return JointSpec("revolute", parent, axis, origin, lower, upper, **more)


def continuous(parent: str, axis: Vector, origin: Vector, **more: Any) -> JointSpec:
    """Freely turning joint."""
    return JointSpec("continuous", parent, axis, origin, **more)


def swivel(
    parent: str, axis: Vector, origin: Vector, limit: float | None = None, lower: float | None = None
) -> JointSpec:
    """Joint that turns freely, or by up to ``limit`` radians either way; or from ``lower`` to that."""
    if limit is None:
        return continuous(parent, axis, origin)
    return revolute(parent, axis, origin, -limit if lower is None else lower, limit)


def prismatic(
    parent: str, axis: Vector, lower: float, upper: float, origin: Vector = (0.0, 0.0, 0.0), **more: Any
) -> JointSpec:
    """Slide along an axis, limits in metres; ``origin`` is where the axis is drawn."""
    return JointSpec("prismatic", parent, axis, origin, lower, upper, **more)


def screw(parent: str, axis: Vector, origin: Vector, lower: float, upper: float, pitch: float) -> JointSpec:
    """Thread: turns and advances ``pitch`` metres for each radian."""
    return JointSpec("screw", parent, axis, origin, lower, upper, pitch)


class Assembly:
    """A list of parts, the root first and parents before children.

    The frame is the family's own choice as long as Z is up and the front faces -X; :meth:`build` moves the origin to
    the centre of the rest-state box.

    Parameters
    ----------
    root : str, optional
        Name of the root; it may be added later, as any part.
    solid : Solid, optional
        Of the root; it may be empty at first, and grow: ``assembly.body += box(...)``.
    density : float
        kg/m^3: of the root, and of each part that is added without one.
    """

    def __init__(self, root: str | None = None, solid: Solid | None = None, density: float = 600.0) -> None:
        self.density = density
        self._names: list[str] = []
        self._labels: list[str] = []
        self._solids: list[Solid] = []
        self._densities: list[float] = []
        self._joints: list[JointSpec | None] = []
        self._features: dict[str, bool] = {}
        if root is not None:
            self._append(root, solid or Solid(), None, root, density)

    @property
    def body(self) -> Solid:
        """The root's solid."""
        return self._solids[0]

    @body.setter
    def body(self, solid: Solid) -> None:
        self._solids[0] = solid

    def record(self, **features: bool) -> None:
        """Note whether the object has handles or legs, which are no parts of their own: ``record(handles=True)``."""
        self._features.update(features)

    def add(
        self,
        name: str,
        solid: Solid,
        joint: JointSpec | None = None,
        label: str | None = None,
        density: float | None = None,
    ) -> str:
        """Add a part.

        Parameters
        ----------
        name : str
            Unique: "lid", "drawer_2".
        solid : Solid
            As it stands at rest.
        joint : JointSpec, optional
            None for the root.
        label : str, optional
            Semantic name; the name without a trailing number by default.
        density : float, optional
            kg/m^3; that of the assembly by default.

        Returns
        -------
        str
            The name.

        Raises
        ------
        KinematicsError
            When another part has this name.
        """
        if name in self._names:
            raise KinematicsError(f"two parts are called {name!r}")
        stem, _, number = name.rpartition("_")
        label = label or (stem if number.isdigit() else name)
        self._append(name, solid, joint, label, self.density if density is None else density)
        return name

    def add_numbered(self, label: str, solid: Solid, joint: JointSpec, density: float | None = None) -> str:
        """Add the next part of a label: "drawer_0", then "drawer_1"; see :meth:`add`."""
        return self.add(f"{label}_{self._labels.count(label)}", solid, joint, density=density)

    def _append(self, name: str, solid: Solid, joint: JointSpec | None, label: str, density: float) -> None:
        self._names.append(name)
        self._labels.append(label)
        self._solids.append(solid)
        self._densities.append(density)
        self._joints.append(joint)

    def __len__(self) -> int:
        return len(self._names)

    @property
    def labels(self) -> tuple[str, ...]:
        """Semantic names of the parts, the root's first."""
        return tuple(self._labels)

    @property
    def features(self) -> frozenset[str]:
        """What :meth:`record` noted."""
        return frozenset(name for name, there in self._features.items() if there)

    def extents(self) -> Array:
        """(3,) sides of the box of the whole assembly at rest, along X, Y and Z, metres."""
        bounds = np.array([solid.bounds() for solid in self._solids if solid.pieces])
        sides: Array = bounds[:, 1].max(axis=0) - bounds[:, 0].min(axis=0)
        return sides

    @property
    def joint_types(self) -> tuple[str, ...]:
        """Types of the joints, the root's first, as :class:`~artsim.model.joints.Joint` names them."""
        return tuple("free" if joint is None else joint.type for joint in self._joints)

    @property
    def joint_axes(self) -> Array:
        """(K, 3) unit axes, in the assembly's frame; zeros for the root."""
        return np.array([np.zeros(3) if joint is None else unit(joint.axis) for joint in self._joints])

    def open_at_rest(self, name: str, angle: float) -> None:
        """Let a part that is there rest turned about its hinge; what hangs on it turns with it.

        Parameters
        ----------
        name : str
            Of a part with a revolute joint.
        angle : float
            Radians from where the part stands; the limits move the other way, so that the range stays.

        Raises
        ------
        KinematicsError
            When the part has no revolute joint.
        """
        first = self._names.index(name)
        hinge = self._joints[first]
        if hinge is None or hinge.type != "revolute":
            raise KinematicsError("only a part with a revolute joint can be opened at rest", name)
        about = np.asarray(hinge.origin, dtype=np.float64)
        rotation = rotation_about(hinge.axis, angle)
        turning = {name}
        for k in range(first, len(self._names)):
            joint = self._joints[k]
            if k > first and (joint is None or joint.parent not in turning):
                continue
            turning.add(self._names[k])
            _check_filled(self._names[k], self._solids[k])  # pieces that are made, not planned, round in one way only
            self._solids[k] = self._solids[k].turned(hinge.axis, angle, about)
            if k > first and joint is not None:
                origin = about + apply(rotation, np.asarray(joint.origin) - about)
                self._joints[k] = replace(joint, axis=apply(rotation, np.asarray(joint.axis)), origin=origin)
        self._joints[first] = replace(hinge, lower=hinge.lower - angle, upper=hinge.upper - angle)

    def build(self, category: str, object_id: str) -> ArticulatedObject:
        """The object, in its rest frame.

        Raises
        ------
        AssetError
            When the root, or a piece of a part, is empty.
        KinematicsError
            When the joints do not form a tree.
        """
        for name, solid in zip(self._names, self._solids, strict=True):
            _check_filled(name, solid)
        whole = self._parts()
        bounds = np.stack([part.bounds for part in whole])
        center = 0.5 * (bounds[:, 0].min(axis=0) + bounds[:, 1].max(axis=0))
        index = {name: k for k, name in enumerate(self._names)}
        joints = tuple(self._joint(k, spec, index, center) for k, spec in enumerate(self._joints))
        parts = tuple(part.moved(-center) for part in whole)
        tree = KinematicTree(joints)
        content = [part.vertices.tobytes() + part.faces.tobytes() for part in parts]
        return ArticulatedObject(
            object_id=object_id,
            category=category,
            parts=parts,
            native_tree=tree,
            sha256=content_sha256([repr(tree.to_dict()).encode(), *content]),
            source=f"{category}:{object_id}",
            source_joints={joint.name: (k, 1.0) for k, joint in enumerate(joints) if k > 0},
            features=tuple(sorted(self.features)),
        )

    def _parts(self) -> list[Part]:
        """In the assembly's frame."""
        parts = []
        for name, label, solid, density in zip(self._names, self._labels, self._solids, self._densities, strict=True):
            vertices, faces = solid.union()
            pieces, marks = solid.piece_meshes(), solid.marks
            details = []
            for mark in dict.fromkeys(mark for mark in marks if mark is not None):
                own = tuple(piece for piece, its in zip(pieces, marks, strict=True) if its is mark)
                if len(own) == len(pieces):  # the part itself is the handle, and its label says so
                    continue
                points = np.concatenate([corners for corners, _ in own])
                details.append(detail_of(mark.label, points, vertices, mark.outward, own))
            parts.append(Part(name, label, vertices, faces, Body(pieces, density), tuple(details)))
        return parts

    def _joint(self, k: int, spec: JointSpec | None, index: dict[str, int], center: Any) -> Joint:
        if spec is None:
            return Joint("root", "free", -1)
        name = self._names[k]
        if spec.parent not in index:
            raise KinematicsError(f"no part is called {spec.parent!r}", f"joint of {name!r}")
        x, y, z = unit(spec.axis).tolist()
        ox, oy, oz = (np.asarray(spec.origin, dtype=np.float64) - center).tolist()
        mimic = None if spec.mimic is None else Mimic(index[spec.mimic[0]], spec.mimic[1])
        return Joint(
            name=f"{name}_joint",
            type=spec.type,
            parent=index[spec.parent],
            axis=(x, y, z),
            origin=(ox, oy, oz),
            lower=float(spec.lower),
            upper=float(spec.upper),
            pitch=float(spec.pitch),
            mimic=mimic,
        )


def _check_filled(name: str, solid: Solid) -> None:
    if not solid.pieces or any(piece.is_empty() for piece in solid.pieces):
        raise AssetError("a piece of its solid encloses nothing", name, "look for swapped corners or flat outlines")
