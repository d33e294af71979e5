"""The articulated object: a kinematic tree, the meshes of its parts and what is known about it."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artsim.common.names import printable
from artsim.common.products import norm
from artsim.common.showing import Showable, export_of
from artsim.common.tables import brief, centimetres, cut, joint_value, label_of, plural, table, three_digits
from artsim.errors import AssetError, ConfigError, KinematicsError
from artsim.model.details import NO_DETAIL, Detail, DetailFrame, detail_of_faces, numbered, on_faces
from artsim.model.details import Mesh as Mesh
from artsim.model.inertia import Inertia
from artsim.model.joints import LARGEST
from artsim.model.kinematics import Array, KinematicTree
from artsim.model.params import Params

if TYPE_CHECKING:
    import trimesh

_MAX_REPAIR = 1000
"""Characters of a repair as text: names out of files may be of any length."""

_ON_DETAIL = 3e-6
"""Diagonals by which a point of a cloud, whose coordinates are of single precision, may miss its surface."""
MAX_PARTS = 254
"""Part ids are stored in a byte; 255 marks the background."""


@dataclass(frozen=True)
class Repair:
    """One thing in a source file that was mended or left out while loading."""

    where: str
    """Element concerned, for example ``joint 'joint_2'``."""
    what: str
    """What was found and what was done about it."""
    note: bool = False
    """Whether the object is all that the file says, nothing of which was assumed, changed or dropped."""

    def __str__(self) -> str:
        return printable(f"{self.where}: {self.what}", _MAX_REPAIR)


@dataclass(frozen=True)
class JointDynamics:
    """What drives and opposes the motion of a joint, at native size; None where the source file does not say."""

    effort: float | None = None
    velocity: float | None = None
    """Limits: N m or N, rad/s or m/s."""
    damping: float | None = None
    friction: float | None = None
    """N m s or N s/m; N m or N."""
    least_effort: float | None = None
    """What the effort limit is at least, where ``effort`` does not say it."""
    spring: float | None = None
    """N m/rad or N/m: what pulls the joint to its rest state."""
    hold: float | None = None
    """N m or N: with which a magnet, gasket or latch holds the joint at rest; it fades as the joint opens."""
    hold_over: float | None = None
    """Radians or metres over which it fades to nothing."""


UNKNOWN_DYNAMICS = JointDynamics()
"""Of a joint of which the source file says nothing."""


@dataclass(frozen=True, eq=False)
class Body:
    """What physics needs of a part."""

    pieces: tuple[Mesh, ...]
    """Collision geometry in the rest frame, at rest, native units. That of procedural objects is convex, and its union
    is the part's surface."""
    density: float
    """kg/m^3."""
    solid: Mesh | None = None
    """Closed surface of what has the mass, where the part's own surface need not be closed."""
    inertia: Inertia | None = None
    """What the source file says of it, in native units; it counts instead of what follows from surface and density."""
    joint: JointDynamics = UNKNOWN_DYNAMICS
    """Of the joint that carries the part."""

    __repr__ = brief


@dataclass(frozen=True, eq=False)
class Part:
    """One rigid part."""

    name: str
    """Link name in the source file."""
    label: str
    """Semantic name where the source gives one ("lid", "drawer"), else the link name."""
    vertices: Array
    """(V, 3) float. In the rest frame, at rest, native units (before the object's scale)."""
    faces: NDArray[np.int32]
    """(F, 3) int32. Triangles; empty for a part without geometry."""
    body: Body | None = None
    """Where the source knows it: procedural objects do."""
    details: tuple[Detail, ...] = ()
    """Labelled pieces of its surface."""

    __repr__ = brief

    @cached_property
    def bounds(self) -> Array:
        """(2, 3) corners of the axis-aligned box of the surface, native units; NaN without geometry."""
        if len(self.faces) == 0:
            return np.full((2, 3), np.nan)
        named = np.zeros(len(self.vertices), dtype=bool)
        named[self.faces] = True  # sorting millions of numbers would take seconds
        used = self.vertices[named]
        # Which of 0.0 and -0.0 is the smaller depends on the processor: adding 0.0 leaves one of them.
        return np.stack([used.min(axis=0), used.max(axis=0)]) + 0.0

    def two_sided_faces(self) -> NDArray[np.int32]:
        """(F, 3) triangles; unless the surface is a closed solid, each facing both ways.

        Rasterisers leave out triangles that face away, and real meshes are wound any way.
        """
        import trimesh

        mesh = trimesh.Trimesh(self.vertices, self.faces, process=False)
        mesh.merge_vertices()
        return self.faces if mesh.is_volume else np.concatenate([self.faces, self.faces[:, ::-1]])

    def moved(self, offset: Array) -> Part:
        """The part translated by (3,) metres."""
        body = self.body
        if body is not None:
            pieces = tuple((vertices + offset, faces) for vertices, faces in body.pieces)
            solid = None if body.solid is None else (body.solid[0] + offset, body.solid[1])
            inertia = body.inertia and replace(body.inertia, center=body.inertia.center + offset)
            body = replace(body, pieces=pieces, solid=solid, inertia=inertia)
        details = tuple(detail.moved(offset) for detail in self.details)
        return replace(self, vertices=self.vertices + offset, body=body, details=details)

    @cached_property
    def detail_of_face(self) -> NDArray[np.int64]:
        """(F,) which of ``details`` each face belongs to; -1 for none."""
        return detail_of_faces(self.vertices, self.faces, self.details)


@dataclass(frozen=True, eq=False)
class ArticulatedObject(Showable):
    """A kinematic tree with geometry, in its rest frame.

    The rest frame has Z up and the front towards -X; its origin is the centre of the axis-aligned box
    of the whole object in its rest state.

    Attributes
    ----------
    object_id, category : str
    parts : tuple of Part
        Root first, parents before children.
    native_tree : KinematicTree
        In native units (before ``scale``).
    sha256 : str
        Digest of the source content.
    scale : float
        Size of this object over its native size; every public length below includes it.
    T_base_rest : (4, 4) float
        Maps the rest frame to the source file's base-link frame, native units.
    repairs : tuple of Repair
    source : str
        Where the object came from.
    source_joints : mapping
        For each joint of the source file: (part index, multiplier), so that the file's own joint value is
        ``multiplier * q[part]``. Screw parts list two file joints.
    features : tuple of str
        What the family of a procedural object records of it besides its parts: "handles", "legs".
    params : Params, optional
        What makes a procedural object: :func:`artsim.make` makes it from them again.
    """

    object_id: str
    category: str
    parts: tuple[Part, ...]
    native_tree: KinematicTree
    sha256: str
    scale: float = 1.0
    T_base_rest: Array = None  # type: ignore[assignment]  # identity, set below
    repairs: tuple[Repair, ...] = ()
    source: str = ""
    source_joints: Mapping[str, tuple[int, float]] = None  # type: ignore[assignment]  # empty, set below
    features: tuple[str, ...] = ()
    params: Params | None = None

    def __post_init__(self) -> None:
        if self.T_base_rest is None:
            object.__setattr__(self, "T_base_rest", np.eye(4))
        if self.source_joints is None:
            object.__setattr__(self, "source_joints", {})
        if len(self.parts) != len(self.native_tree):
            raise KinematicsError(
                f"{len(self.parts)} parts do not fit a tree of {len(self.native_tree)}", self.object_id
            )
        if len(self.parts) > MAX_PARTS:
            raise AssetError(f"{len(self.parts)} parts; part ids fit {MAX_PARTS}", self.source or self.object_id)

    def __len__(self) -> int:
        return len(self.parts)

    def __str__(self) -> str:
        tree = self.tree
        rows: list[tuple[str, ...]] = [("part", "name", "joint", "from", "to", "size, cm", "triangles")]
        for k, (part, joint) in enumerate(zip(self.parts, tree.joints, strict=True)):
            ends = [joint_value(end, joint.type) if k else "" for end in (joint.lower, joint.upper)]
            kind = joint.type if joint.mimic is None else f"{joint.type} (follows {joint.mimic.source})"
            rows.append(
                (str(k), label_of(part.label), kind, *ends, centimetres(self.box_size[k]), f"{len(part.faces):,}")
            )
        inside = (
            f"{plural(len(self), 'part')}, {plural(len(tree.free_joints), 'free joint')}, {self.num_faces:,} triangles"
        )
        size = "no geometry"
        if self.has_surface.any():
            size = f"{centimetres(self.bounds[1] - self.bounds[0])} cm, diagonal {three_digits(100 * self.diagonal)} cm"
        who = f"{label_of(self.category)} {label_of(self.object_id)}"
        return "\n".join(
            [
                cut(f"{who}   from {printable(self.source or 'memory', 60)}"),
                f"{inside}, {plural(len(self.repairs), 'repair')}",
                f"{size}, scale {self.scale:.4g}",
                "",
                *table(rows, left=3),
            ]
        )

    def __repr__(self) -> str:
        who = f"{type(self).__name__} {label_of(self.category)} {label_of(self.object_id)}"
        return f"<{who}: {plural(len(self), 'part')}, {plural(len(self.tree.free_joints), 'free joint')}>"

    @cached_property
    def tree(self) -> KinematicTree:
        """The kinematic tree at the object's scale."""
        return self.native_tree if self.scale == 1.0 else self.native_tree.scaled(self.scale)

    @cached_property
    def part_bounds(self) -> Array:
        """(K, 2, 3) box corners of each part in the rest frame, metres; without geometry, its joint's origin twice."""
        bounds = np.stack([p.bounds for p in self.parts])
        empty = np.isnan(bounds[:, 0, 0])
        bounds[empty] = self.native_tree.origins[empty, None, :]
        return bounds * self.scale

    @cached_property
    def box_center(self) -> Array:
        """(K, 3) centre of each part's amodal box in the rest frame, metres."""
        return self.part_bounds.mean(axis=1)

    @cached_property
    def box_size(self) -> Array:
        """(K, 3) side lengths of each part's amodal box in the rest frame, metres."""
        return self.part_bounds[:, 1] - self.part_bounds[:, 0]

    @cached_property
    def has_surface(self) -> NDArray[np.bool_]:
        """(K,) whether each part has geometry."""
        return np.array([len(p.faces) > 0 for p in self.parts])

    @cached_property
    def bounds(self) -> Array:
        """(2, 3) corners of the box of the whole object in its rest state, metres."""
        solid = self.has_surface
        return np.stack([self.part_bounds[solid, 0].min(axis=0), self.part_bounds[solid, 1].max(axis=0)])

    @cached_property
    def diagonal(self) -> float:
        """Diagonal of the box of the whole object in its rest state, metres."""
        return float(norm(self.bounds[1] - self.bounds[0]))

    @cached_property
    def details(self) -> tuple[DetailFrame, ...]:
        """Handles, knobs, panes and other labelled pieces of the parts, in their order."""
        found = []
        for k, part in enumerate(self.parts):
            for detail in part.details:
                T = detail.T_rest_detail.copy()
                T[:3, 3] *= self.scale
                found.append(DetailFrame("", detail.label, k, T, detail.size * self.scale))
        return numbered(found)

    def detail_of_points(self, points: Array, part: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """(N,) which of ``details`` points of the surface belong to: its number, or 255.

        Parameters
        ----------
        points : (N, 3) float
            Rest frame, at rest, metres.
        part : (N,) uint8
            Part of each.
        """
        found = np.full(len(points), NO_DETAIL, dtype=np.uint8)
        first = 0
        for k, of in enumerate(self.parts):
            own = np.flatnonzero(part == k) if of.details else np.zeros(0, dtype=np.int64)
            for number in range(len(of.details) if len(own) else 0):
                faces = of.faces[of.detail_of_face == number]
                there = on_faces(points[own] / self.scale, of.vertices, faces, _ON_DETAIL * self.diagonal / self.scale)
                found[own[there]] = min(first + number, NO_DETAIL)
            first += len(of.details)
        return found

    @property
    def num_faces(self) -> int:
        """Triangles over all parts."""
        return sum(len(p.faces) for p in self.parts)

    @property
    def is_rigid(self) -> bool:
        """Whether no joint can move."""
        low, high = self.tree.limits[self.tree.free_joints].T
        return not bool((high > low).any())

    def scaled(self, scale: float) -> ArticulatedObject:
        """The same object at ``scale`` times its native size: itself, if it has that scale. Geometry is shared."""
        if not 1.0 / LARGEST <= scale <= LARGEST:
            raise ConfigError(f"an object cannot have scale {scale}")
        return self if scale == self.scale else replace(self, scale=float(scale))

    def with_diagonal(self, diagonal: float) -> ArticulatedObject:
        """The same object scaled so that its rest-state box has this diagonal, metres."""
        return self.scaled(diagonal / (self.diagonal / self.scale))

    def source_state(self, q: ArrayLike) -> dict[str, float]:
        """Joint values in the source file's own names and convention for a (K,) state of this object.

        Lengths are in native units, so that the values can be given to any simulator that loads the file.
        """
        q = self.tree.complete_state(q)
        native = np.array([q[k] / (self.scale if t == "prismatic" else 1.0) for k, t in enumerate(self.tree.types)])
        return {name: multiplier * float(native[k]) for name, (k, multiplier) in self.source_joints.items()}

    def export(self, folder: str | Path, formats: Sequence[str] = ("urdf",)) -> dict[str, Any]:
        """Write the object for simulators; see :func:`artsim.export.prepare` and :func:`artsim.export.export`.

        Parameters
        ----------
        folder : path
            Made if missing.
        formats : sequence of str
            Of "urdf", "mjcf", "usd", "usdz" and "simready".

        Returns
        -------
        dict
            Content of ``meta.json``.

        Raises
        ------
        ConfigError
            When a format is unknown, or what cuts hollow parts into convex pieces is not installed.
        """
        return export_of(self, folder, formats)

    def part_mesh(self, k: int) -> trimesh.Trimesh:
        """Part k as a trimesh in the rest frame, at rest, metres."""
        import trimesh

        part = self.parts[k]
        return trimesh.Trimesh(part.vertices * self.scale, part.faces, process=False)


def content_sha256(chunks: Sequence[bytes]) -> str:
    """Hex digest of byte strings, each with its length so that boundaries count."""
    digest = hashlib.sha256()
    for chunk in chunks:
        digest.update(len(chunk).to_bytes(8, "little"))
        digest.update(chunk)
    return digest.hexdigest()
