"""USD with UsdPhysics: rigid bodies, joints and colliders of a stage become links and joints.

========================================  =============================================================================
The stage                                 is read as
========================================  =============================================================================
metersPerUnit, kilogramsPerUnit, upAxis   metres, kilograms, Z up
a prim with RigidBodyAPI                  a link; what hangs on none of them is part of the world
revolute, prismatic, fixed joints         the same; without limits: continuous, and 1 m either way
a generic joint                           the one axis that its limits leave free, or fixed
shapes of purpose default and render      shown; purpose guide and proxy, and what is invisible, is not
shapes with CollisionAPI                  collision geometry; with ``convexHull``, their hull
mass, density, centre, inertia            as they are written; the rest from the collision geometry
``artsim:mimic:*`` attributes             mimic
spherical, distance joints, loops         an error
========================================  =============================================================================

The zero of a joint is where its two frames meet, wherever the bodies stand in the stage.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from artsim.common.products import matmul, unit
from artsim.errors import AssetError
from artsim.loading.meshes import LoadLimits, UnusableMeshError
from artsim.loading.urdf_document import Geometry, InlineMesh, MimicRelation, Shape, UrdfRobot
from artsim.loading.usd_dynamics import read_dynamics, read_inertia
from artsim.loading.usd_layers import open_stage, unreadable
from artsim.loading.usd_shapes import KINDS, surface
from artsim.loading.usd_values import flag, number, rotation, token, vectors
from artsim.loading.zero_pose import WORLD, WorldJoint, WorldLink, as_document, unused_name
from artsim.model.convex_bodies import convex_hull, is_convex
from artsim.model.kinematics import LARGEST, Array
from artsim.model.objects import Mesh, Repair

_SAME = 1e-5
"""Share of the stage's size by which a body may stand beside the zero of its joint because joints are in single
precision; then the place of the body, which is in double precision, counts."""
_THIN = 1e-4
"""Metres of thickness that a flat mesh has where it collides."""
_FLAT = 1e-9
"""Share of the largest scale of a transform below which another is none."""
_HULL = "convexHull"
_UNREAD = ("PointInstancer", "Plane", "BasisCurves", "NurbsPatch", "Points", "TetMesh")


def read_usd(file: Path, limits: LoadLimits, body: str | None = None) -> tuple[UrdfRobot, list[Repair], list[bytes]]:
    """Links and joints of a USD file.

    Parameters
    ----------
    file : Path
    limits : LoadLimits
    body : str, optional
        Which object of a scene: see :func:`artsim.loading.scene_objects.chosen`.

    Returns
    -------
    robot : UrdfRobot
        With collision geometry and inertia.
    repairs : list of Repair
    contents : list of bytes
        Other layers that it is made of.

    Raises
    ------
    AssetError
        Naming what cannot be read.
    ConfigError
        When usd-core is not installed.
    """
    stage, contents = open_stage(file, limits)
    from pxr import Tf

    repairs: list[Repair] = []
    try:
        links = _StageReader(stage, file, limits, repairs).links()
    except Tf.ErrorException as error:  # values are read when they are asked for
        raise unreadable(file, error) from error
    return as_document(links, file, repairs, body), repairs, contents


@dataclass(eq=False)
class _Body:
    """A rigid body, or the world (without a prim).

    ``T_world_body`` is rigid; ``affine`` carries the prim's own coordinates, scale included, to the world. Meshes are
    in the body's frame.
    """

    name: str
    prim: Any
    T_world_body: Array
    affine: Array
    shown: list[InlineMesh] = field(default_factory=list)
    solid: list[InlineMesh] = field(default_factory=list)


@dataclass(eq=False)
class _Joint:
    """A joint between two bodies: its frame in each of them (rigid), type, axis and limits in SI units."""

    name: str
    prim: Any
    bodies: tuple[int, int]
    frames: tuple[Array, Array]
    type: str
    axis: Array
    lower: float
    upper: float


class _StageReader:
    """Writes a stage as links and joints in the world, Z up, at the zero of all joints."""

    def __init__(self, stage: Any, file: Path, limits: LoadLimits, repairs: list[Repair]):
        from pxr import Usd, UsdGeom, UsdPhysics

        self._usd, self._geom, self._physics = Usd, UsdGeom, UsdPhysics
        self._stage, self._file, self._limits, self._repairs = stage, file, limits, repairs
        self._unit = float(UsdGeom.GetStageMetersPerUnit(stage))
        self._kilograms = float(UsdPhysics.GetStageKilogramsPerUnit(stage))
        self._T_world_stage = np.diag([self._unit, self._unit, self._unit, 1.0])
        if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y:
            turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
            self._T_world_stage[:3, :3] = self._unit * turn
        self._cache = UsdGeom.XformCache(Usd.TimeCode.Default())
        self._prims = list(stage.Traverse(Usd.TraverseInstanceProxies()))
        self._names: set[str] = {WORLD}
        world = _Body(WORLD, None, _rigid(self._T_world_stage, str(file)), self._T_world_stage)
        self._bodies = [world]
        self._index: dict[Any, int] = {}

    def links(self) -> list[WorldLink]:
        """The world, then every body after its parent."""
        for prim in self._prims:
            if prim.HasAPI(self._physics.RigidBodyAPI) and flag(
                self._physics.RigidBodyAPI(prim).GetRigidBodyEnabledAttr(), True
            ):
                if len(self._bodies) > self._limits.max_links:
                    raise AssetError(
                        f"it has over {self._limits.max_links} bodies", self._file, "raise LoadLimits.max_links"
                    )
                self._index[prim.GetPath()] = len(self._bodies)
                affine = self._affine(prim)
                name = unused_name(str(prim.GetName()), self._names)
                self._bodies.append(_Body(name, prim, _rigid(affine, self._where(prim)), affine))
        self._read_shapes()
        joints = self._read_joints()
        return self._tree(joints)

    def _affine(self, prim: Any) -> Array:
        """(4, 4) transform of a prim's own coordinates to the world's: Z up, metres."""
        matrix = np.array(self._cache.GetLocalToWorldTransform(prim), dtype=np.float64).T  # USD's vectors are rows
        return matmul(self._T_world_stage, matrix)

    def _owner(self, prim: Any) -> int:
        """The body that a prim belongs to: the nearest one above it, or the world."""
        while prim and not prim.IsPseudoRoot():
            if prim.GetPath() in self._index:
                return self._index[prim.GetPath()]
            prim = prim.GetParent()
        return 0

    # --- shapes ---

    def _read_shapes(self) -> None:
        count = 0
        skipped = set()
        for prim in self._prims:
            kind = str(prim.GetTypeName())
            if kind not in KINDS:
                if kind in _UNREAD:
                    skipped.add(kind)
                continue
            count += 1
            if count > self._limits.max_shapes:
                raise AssetError(
                    f"it has over {self._limits.max_shapes} shapes", self._file, "raise LoadLimits.max_shapes"
                )
            body = self._bodies[self._owner(prim)]
            shown, solid = self._is_shown(prim), self._collides(prim, body)
            if not (shown or solid):
                continue
            T_body_prim = matmul(np.linalg.inv(body.T_world_body), self._affine(prim))
            path = str(prim.GetPath())
            try:
                mesh = surface(prim, T_body_prim, self._limits.max_faces)
            except UnusableMeshError as problem:
                self._repairs.append(Repair(f"prim {path}", f"{problem}: left out"))
                continue
            if shown:
                body.shown.append(InlineMesh(path, *mesh))
            if solid:
                body.solid.append(InlineMesh(path, *self._collision_mesh(prim, mesh)))
        for kind in sorted(skipped):
            self._repairs.append(Repair("prims", f"of type {kind} left out: they are no surface of an object"))
        if not any(body.shown for body in self._bodies) and any(body.solid for body in self._bodies):
            self._repairs.append(Repair("file", "has nothing to be seen: its collision geometry is shown"))
            for body in self._bodies:
                body.shown = list(body.solid)

    def _is_shown(self, prim: Any) -> bool:
        imageable = self._geom.Imageable(prim)
        tokens = self._geom.Tokens
        seen = imageable.ComputePurpose() in (tokens.default_, tokens.render)
        return bool(seen and imageable.ComputeVisibility() != tokens.invisible)

    def _collides(self, prim: Any, body: _Body) -> bool:
        """Whether CollisionAPI is on a prim, or on one between it and its body."""
        while prim and not prim.IsPseudoRoot():
            if prim.HasAPI(self._physics.CollisionAPI):
                return flag(self._physics.CollisionAPI(prim).GetCollisionEnabledAttr(), True)
            if body.prim is not None and prim.GetPath() == body.prim.GetPath():
                return False
            prim = prim.GetParent()
        return False

    def _collision_mesh(self, prim: Any, mesh: Mesh) -> Mesh:
        api = self._physics.MeshCollisionAPI(prim)
        approximation = token(api.GetApproximationAttr(), "none") if api else "none"
        if approximation != _HULL or is_convex(*mesh):
            return mesh
        return convex_hull(mesh[0], _THIN)

    # --- joints ---

    def _read_joints(self) -> list[_Joint]:
        joints = []
        names: set[str] = set()
        for prim in self._prims:
            if not prim.IsA(self._physics.Joint) or not flag(self._physics.Joint(prim).GetJointEnabledAttr(), True):
                continue
            schema = self._physics.Joint(prim)
            ends = [self._end(prim, schema, side) for side in (0, 1)]
            if ends[0][0] == ends[1][0]:
                raise self._error(prim, "joins a body to itself, or to nothing", "name the two bodies that it joins")
            kind, axis, lower, upper = self._motion(prim)
            name = unused_name(str(prim.GetName()), names)
            frames = (ends[0][1], ends[1][1])
            joints.append(_Joint(name, prim, (ends[0][0], ends[1][0]), frames, kind, axis, lower, upper))
            if any("MimicJoint" in str(schema) for schema in prim.GetAppliedSchemas()):
                self._repairs.append(Repair(f"joint {name!r}", "follows another by PhysX's own schema: not read"))
        return joints

    def _end(self, prim: Any, schema: Any, side: int) -> tuple[int, Array]:
        """Body at one end of a joint, and the joint's frame in it."""
        relation = schema.GetBody0Rel() if side == 0 else schema.GetBody1Rel()
        position = schema.GetLocalPos0Attr() if side == 0 else schema.GetLocalPos1Attr()
        turn = schema.GetLocalRot0Attr() if side == 0 else schema.GetLocalRot1Attr()
        targets = relation.GetTargets()
        if len(targets) > 1:
            raise self._error(prim, f"names {len(targets)} bodies at one end", "name one")
        affine = self._T_world_stage
        body = 0
        if targets:
            target = self._stage.GetPrimAtPath(targets[0])
            if not target:
                raise self._error(prim, f"its body {targets[0]} does not exist", "name a body of the file")
            affine, body = self._affine(target), self._owner(target)
        T_prim_joint = np.eye(4)
        T_prim_joint[:3, 3] = next(iter(vectors(position)), np.zeros(3))
        T_world_joint = np.eye(4)
        T_world_joint[:3, 3] = matmul(affine, T_prim_joint)[:3, 3]
        T_world_joint[:3, :3] = matmul(_rigid(affine, self._where(prim))[:3, :3], rotation(turn))
        return body, matmul(np.linalg.inv(self._bodies[body].T_world_body), T_world_joint)

    def _motion(self, prim: Any) -> tuple[str, Array, float, float]:
        """Type, axis in the joint's frame, and limits in radians or metres."""
        physics = self._physics
        if prim.IsA(physics.FixedJoint):
            return "fixed", np.array([1.0, 0.0, 0.0]), 0.0, 0.0
        for schema, slides in ((physics.RevoluteJoint, False), (physics.PrismaticJoint, True)):
            if prim.IsA(schema):
                joint = schema(prim)
                ends = [number(at, e) for at, e in (
                    (joint.GetLowerLimitAttr(), -np.inf), (joint.GetUpperLimitAttr(), np.inf))]  # fmt: skip
                axis = "XYZ".index(token(joint.GetAxisAttr(), "X", ("X", "Y", "Z")))
                return self._limited(slides, axis, ends)
        if prim.IsA(physics.SphericalJoint) or prim.IsA(physics.DistanceJoint):
            raise self._error(
                prim, f"a {prim.GetTypeName()} is not supported", "write revolute or prismatic joints in its place"
            )
        free = []
        for slides, word in ((True, "trans"), (False, "rot")):
            for axis, letter in enumerate("XYZ"):
                api = physics.LimitAPI.Get(prim, f"{word}{letter}")
                ends = [-np.inf, np.inf]
                if api and prim.HasAPI(physics.LimitAPI, f"{word}{letter}"):
                    ends = [number(api.GetLowAttr(), -np.inf), number(api.GetHighAttr(), np.inf)]
                if ends[0] < ends[1]:
                    free.append((slides, axis, ends))
        if not free:
            return "fixed", np.array([1.0, 0.0, 0.0]), 0.0, 0.0
        if len(free) > 1:
            raise self._error(
                prim, f"a joint of {len(free)} free axes is not supported", "limit all axes but one, low above high"
            )
        return self._limited(*free[0])

    def _limited(self, slides: bool, axis: int, ends: list[float]) -> tuple[str, Array, float, float]:
        direction = np.eye(3)[axis]
        lower, upper = (value * self._unit if slides else float(np.deg2rad(value)) for value in ends)
        if lower > upper:  # USD's way to say that it is locked
            return "fixed", direction, 0.0, 0.0
        endless = not (np.isfinite(lower) or np.isfinite(upper))
        return "prismatic" if slides else "continuous" if endless else "revolute", direction, lower, upper

    # --- the tree ---

    def _tree(self, joints: list[_Joint]) -> list[WorldLink]:
        """Links from the root outwards: joints are followed from whichever end comes first."""
        at: dict[int, list[_Joint]] = {body: [] for body in range(len(self._bodies))}
        for joint in joints:
            for body in joint.bodies:
                at[body].append(joint)
        by_path = {joint.prim.GetPath(): joint.name for joint in joints}
        T_world_zero = {0: self._bodies[0].T_world_body}
        position = {0: 0}
        links = [self._link(0, T_world_zero[0], -1, None)]
        used: set[int] = set()
        size = self._size()

        def walk(root: int) -> None:
            waiting = [root]
            while waiting:
                body = waiting.pop(0)
                for joint in at[body]:
                    if id(joint) in used:
                        continue
                    used.add(id(joint))
                    side = joint.bodies.index(body)
                    child = joint.bodies[1 - side]
                    if child in position:
                        raise self._error(
                            joint.prim, "closes a chain, and closed chains are not trees", "remove or disable one joint"
                        )
                    T_child = matmul(
                        matmul(T_world_zero[body], joint.frames[side]), np.linalg.inv(joint.frames[1 - side])
                    )
                    own = matmul(self._moved(T_world_zero[body], body), self._bodies[child].T_world_body)
                    if np.abs(T_child - own).max() <= _SAME * max(size, 1e-9):
                        T_child = own
                    T_world_zero[child] = T_child
                    position[child] = len(links)
                    links.append(self._link(child, T_child, position[body], self._joint(joint, side, T_child, by_path)))
                    waiting.append(child)

        walk(0)
        for body in self._roots(joints):
            if body in position:
                continue
            T_world_zero[body] = self._bodies[body].T_world_body
            name = f"{self._bodies[body].name}_floats"
            free = WorldJoint(name, "floating", T_world_zero[body][:3, 3], np.array([1.0, 0.0, 0.0]))
            position[body] = len(links)
            links.append(self._link(body, T_world_zero[body], 0, free))
            walk(body)
        return links

    def _roots(self, joints: list[_Joint]) -> list[int]:
        """Bodies in the order in which one is taken for a root: articulation roots, those that none carries, others."""
        carried = {joint.bodies[1] for joint in joints}
        api = self._physics.ArticulationRootAPI

        def rank(body: int) -> tuple[bool, bool, int]:
            return not self._bodies[body].prim.HasAPI(api), body in carried, body

        return sorted(range(1, len(self._bodies)), key=rank)

    def _moved(self, T_world_zero: Array, body: int) -> Array:
        """(4, 4) motion of a body from where it stands in the stage to the zero of all joints."""
        return matmul(T_world_zero, np.linalg.inv(self._bodies[body].T_world_body))

    def _size(self) -> float:
        """Metres that bodies are apart, or are large."""
        points = [body.T_world_body[:3, 3] for body in self._bodies[1:]]
        reach = [float(np.abs(mesh.vertices).max()) for body in self._bodies for mesh in body.shown]
        return max([float(np.ptp(points, axis=0).max()) if points else 0.0, *reach])

    def _link(self, body: int, T_world_zero: Array, parent: int, joint: WorldJoint | None) -> WorldLink:
        found = self._bodies[body]
        shapes, collision = (
            [Shape(Geometry(inline=mesh), T_world_zero) for mesh in meshes] for meshes in (found.shown, found.solid)
        )
        inertia = None
        if found.prim is not None:
            solid = [(mesh.vertices, mesh.faces) for mesh in found.solid]
            T_body_prim = matmul(np.linalg.inv(found.T_world_body), found.affine)
            inertia = read_inertia(found.prim, T_body_prim, solid, self._unit, self._kilograms)
        in_world = None if inertia is None else inertia.transformed(T_world_zero)
        return WorldLink(found.name, parent, joint, shapes, collision, in_world)

    def _joint(self, joint: _Joint, side: int, T_world_child: Array, by_path: dict[Any, str]) -> WorldJoint:
        """A joint in the world: its motion is that of the child, whichever end of the joint that is."""
        frame = matmul(T_world_child, joint.frames[1 - side])
        axis = unit(matmul(frame[:3, :3], joint.axis[:, None])[:, 0])
        mimic = None
        targets = joint.prim.GetRelationship("artsim:mimic:joint").GetTargets()
        if targets:
            source = by_path.get(targets[0])
            if source is None:
                raise self._error(joint.prim, f"mimics {targets[0]}, which is no joint", "name a joint of the file")
            rate, offset = (
                number(joint.prim.GetAttribute(f"artsim:mimic:{word}"), default)
                for word, default in (("multiplier", 1.0), ("offset", 0.0))
            )
            mimic = MimicRelation(source, rate, offset)
        sign = 1.0 if side == 0 else -1.0  # values say how the second body moves against the first
        dynamics = read_dynamics(joint.prim, joint.type == "prismatic", self._unit, self._kilograms)
        return WorldJoint(joint.name, joint.type, frame[:3, 3], sign * axis, joint.lower, joint.upper, mimic, dynamics)

    def _error(self, prim: Any, what: str, fix: str) -> AssetError:
        return AssetError(what, self._where(prim), fix)

    def _where(self, prim: Any) -> str:
        return f"{self._file}: prim {prim.GetPath()}"


def _rigid(affine: Array, where: str) -> Array:
    """The rigid transform of the same origin whose axes are nearest those of an affine one.

    Raises
    ------
    AssetError
        When it is not finite, or flat.
    """
    scales = np.zeros(3)
    if (np.abs(affine) <= LARGEST).all():
        u, scales, v = np.linalg.svd(affine[:3, :3])
    if not scales.min() > _FLAT * scales.max():
        raise AssetError("its transform is not finite, or has a scale of 0", where, "write a transform with a scale")
    rigid = np.eye(4)
    rigid[:3, :3] = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ v))]) @ v
    rigid[:3, 3] = affine[:3, 3]
    if np.abs(affine[:3, :3] - affine[0, 0] * np.eye(3)).max() == 0.0 and affine[0, 0] > 0:
        rigid[:3, :3] = np.eye(3)  # to the last digit
    return rigid
