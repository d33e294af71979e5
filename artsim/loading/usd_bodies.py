"""Rigid bodies of a stage and their shapes, in metres and Z up; and which of its static shapes are not the object's."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from artsim.common.names import unused_name
from artsim.common.products import matmul, norm
from artsim.errors import AssetError
from artsim.loading.meshes import LoadLimits, UnusableMeshError
from artsim.loading.scene_objects import WORLD
from artsim.loading.urdf_document import InlineMesh
from artsim.loading.usd_shapes import KINDS, surface
from artsim.loading.usd_values import flag, token
from artsim.model.convex_bodies import convex_hull, is_convex
from artsim.model.joints import LARGEST
from artsim.model.kinematics import Array
from artsim.model.objects import Mesh, Repair

_THIN = 1e-4
"""Metres of thickness that a flat mesh has where it collides."""
_FLAT = 1e-9
"""Share of the largest scale of a transform below which another is none."""
_HULL = "convexHull"
_UNREAD = ("PointInstancer", "Plane", "BasisCurves", "NurbsPatch", "Points", "TetMesh")
_GROUND_NAMES = ("ground", "floor", "terrain")
_WIDE = 2.0
"""Times the object's width and depth from which a static shape below it is the ground that it stands on."""
_NEAR = 0.5
"""Share of the object's diagonal up to which a static shape that no joint names may be away from it."""


@dataclass(eq=False)
class UsdBody:
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

    def boxes(self) -> dict[str, Array]:
        """(2, 3) corners of each of its shapes in the world, by the path of its prim."""
        T = self.T_world_body
        placed = {m.name: matmul(m.vertices, T[:3, :3].T) + T[:3, 3] for m in (*self.solid, *self.shown)}
        return {name: np.stack([points.min(axis=0), points.max(axis=0)]) for name, points in placed.items()}


class StageReader:
    """The bodies of a stage: the world first, then each prim with RigidBodyAPI in the stage's order.

    Attributes
    ----------
    prims : list of Usd.Prim
        Those that may be bodies, joints or shapes.
    bodies : list of UsdBody
    meters, kilograms : float
        Of one unit of the stage.
    T_world_stage : (4, 4) float
        Affine: carries the stage's coordinates to metres, Z up.
    """

    def __init__(self, stage: Any, file: Path, limits: LoadLimits, repairs: list[Repair]):
        from pxr import Usd, UsdGeom, UsdPhysics

        self._geom, self._physics = UsdGeom, UsdPhysics
        self.stage, self.file, self.limits, self.repairs = stage, file, limits, repairs
        self.meters = float(UsdGeom.GetStageMetersPerUnit(stage))
        self.kilograms = float(UsdPhysics.GetStageKilogramsPerUnit(stage))
        for name, value in (("metersPerUnit", self.meters), ("kilogramsPerUnit", self.kilograms)):
            if not 0.0 < value <= LARGEST:
                raise AssetError(f"{name} is {value:g}, which is no size of a unit", file, f"write {name} = 1")
        self.T_world_stage = np.diag([self.meters, self.meters, self.meters, 1.0])
        if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y:
            turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
            self.T_world_stage[:3, :3] = self.meters * turn
        self._cache = UsdGeom.XformCache(Usd.TimeCode.Default())
        self.prims = [prim for prim in stage.Traverse(Usd.TraverseInstanceProxies()) if _says_something(prim)]
        self._index: dict[Any, int] = {}
        self.names = {WORLD}
        world = rigid(self.T_world_stage, str(file))
        self.bodies = [UsdBody(WORLD, None, world, self.T_world_stage)]
        self._read_bodies()
        self._read_shapes()

    def affine(self, prim: Any) -> Array:
        """(4, 4) transform of a prim's own coordinates to the world's: Z up, metres."""
        matrix = np.array(self._cache.GetLocalToWorldTransform(prim), dtype=np.float64).T  # USD's vectors are rows
        return matmul(self.T_world_stage, matrix)

    def owner(self, prim: Any) -> int:
        """The body that a prim belongs to: the nearest one above it, or the world."""
        while prim and not prim.IsPseudoRoot():
            if prim.GetPath() in self._index:
                return self._index[prim.GetPath()]
            prim = prim.GetParent()
        return 0

    def error(self, prim: Any, what: str, fix: str) -> AssetError:
        return AssetError(what, self.where(prim), fix)

    def where(self, prim: Any) -> str:
        return f"{self.file}: prim {prim.GetPath()}"

    # --- bodies ---

    def _read_bodies(self) -> None:
        physics = self._physics
        found = []
        for prim in self.prims:
            api = physics.RigidBodyAPI(prim)
            if prim.HasAPI(physics.RigidBodyAPI) and flag(api.GetRigidBodyEnabledAttr(), True):
                found.append(prim)
        if len(found) > self.limits.max_links:
            raise AssetError(f"it has over {self.limits.max_links} bodies", self.file, "raise LoadLimits.max_links")
        joined = self._joined()
        loose = [prim for prim in found if prim.GetPath() not in joined]
        placed = [p for p in loose if flag(physics.RigidBodyAPI(p).GetKinematicEnabledAttr(), False)]
        if len(placed) == len(found):
            placed = []
        for prim in found:
            if prim in placed:  # nothing but a script moves it: it stands where it is, as static shapes do
                continue
            self._index[prim.GetPath()] = len(self.bodies)
            affine = self.affine(prim)
            name = unused_name(str(prim.GetName()), self.names)
            self.bodies.append(UsdBody(name, prim, rigid(affine, self.where(prim)), affine))

    def _joined(self) -> set[Any]:
        """Paths that joints name, and those above them."""
        paths: set[Any] = set()
        for prim in self.prims:
            if prim.IsA(self._physics.Joint):
                joint = self._physics.Joint(prim)
                for target in (*joint.GetBody0Rel().GetTargets(), *joint.GetBody1Rel().GetTargets()):
                    paths.update(target.GetPrefixes())
        return paths

    # --- shapes ---

    def _read_shapes(self) -> None:
        count = 0
        skipped = set()
        lost: dict[int, UnusableMeshError] = {}
        for prim in self.prims:
            kind = str(prim.GetTypeName())
            if kind not in KINDS:
                if kind in _UNREAD and self._is_shown(prim):
                    skipped.add(kind)
                continue
            count += 1
            if count > self.limits.max_shapes:
                raise AssetError(
                    f"it has over {self.limits.max_shapes} shapes", self.file, "raise LoadLimits.max_shapes"
                )
            owner = self.owner(prim)
            body = self.bodies[owner]
            shown, solid = self._is_shown(prim), self._collides(prim, body)
            if not (shown or solid):
                continue
            T_body_prim = matmul(np.linalg.inv(body.T_world_body), self.affine(prim))
            path = str(prim.GetPath())
            try:
                mesh = surface(prim, T_body_prim, self.limits.max_faces)
            except UnusableMeshError as problem:
                self.repairs.append(Repair(f"prim {path}", f"{problem}: left out"))
                lost.setdefault(owner, problem)
                continue
            if shown:
                body.shown.append(InlineMesh(path, *mesh))
            if solid:
                body.solid.append(InlineMesh(path, *self._collision_mesh(prim, mesh)))
        for owner, first in lost.items():
            body = self.bodies[owner]
            if body.prim is not None and not (body.shown or body.solid):
                raise self.error(
                    body.prim, f"none of its shapes can be used: {first}", "correct the shape, or leave out the body"
                )
        for kind in sorted(skipped):
            self.repairs.append(Repair("prims", f"of type {kind} left out: they are no surface of an object"))

    def _is_shown(self, prim: Any) -> bool:
        imageable = self._geom.Imageable(prim)
        tokens = self._geom.Tokens
        seen = imageable.ComputePurpose() in (tokens.default_, tokens.render)
        return bool(seen and imageable.ComputeVisibility() != tokens.invisible)

    def _collides(self, prim: Any, body: UsdBody) -> bool:
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
        if approximation != _HULL or prim.GetTypeName() != "Mesh" or is_convex(*mesh):  # primitives are convex
            return mesh
        return convex_hull(mesh[0], _THIN)

    # --- what is not the object's ---

    def leave_out_ground(self, bodies: Sequence[int], frames: Sequence[str]) -> None:
        """Leave out static shapes that the object stands on, or among.

        Parameters
        ----------
        bodies : sequence of int
            What the object is made of.
        frames : sequence of str
            Paths of static prims that something of the object moves against: they are part of it, and what is far from
            it and them, or far larger, is not.
        """
        static = self.bodies[0].boxes()
        own = {path for path in static if any(f"{path}/".startswith(f"{frame}/") for frame in frames)}
        boxes = [box for b in bodies for box in self.bodies[b].boxes().values()]
        if not boxes:
            return
        low, high = _union(boxes)
        reach = np.stack(_union([*boxes, *(static[path] for path in own)]))
        size = float(norm(reach[1] - reach[0]))

        def is_ground(path: str) -> bool:
            box = static[path]
            lies_below = box[1, 2] <= 0.5 * (low + high)[2]
            wide = ((box[1] - box[0])[:2] >= _WIDE * (high - low)[:2]).all()
            named = any(name.lower().startswith(_GROUND_NAMES) for name in path.split("/"))
            return bool(lies_below and (wide or named))

        def is_apart(path: str) -> bool:
            box = static[path]
            gap = norm(np.maximum(np.maximum(box[0] - reach[1], reach[0] - box[1]), 0.0))
            return bool(own) and bool(gap > _NEAR * size or norm(box[1] - box[0]) > _WIDE * size)

        others = [path for path in static if path not in own]
        grounds = [path for path in others if is_ground(path)]
        self._leave_out(grounds, "left out: it is the ground that the object stands on")
        apart = [path for path in others if path not in grounds and is_apart(path)]
        self._leave_out(apart, "left out: no joint names it, and it is far from the object, or far larger")

    def leave_out_all_of_world(self) -> None:
        """Leave out all static shapes."""
        self._leave_out(list(self.bodies[0].boxes()), "left out: nothing joins the object to it")

    def _leave_out(self, paths: Sequence[str], why: str) -> None:
        world, gone = self.bodies[0], frozenset(paths)
        world.shown = [mesh for mesh in world.shown if mesh.name not in gone]
        world.solid = [mesh for mesh in world.solid if mesh.name not in gone]
        self.repairs += [Repair(f"prim {path}", why) for path in paths]


def _says_something(prim: Any) -> bool:
    kind = str(prim.GetTypeName())
    return kind in KINDS or kind in _UNREAD or kind.endswith("Joint") or bool(prim.GetAppliedSchemas())


def _union(boxes: Sequence[Array]) -> tuple[Array, Array]:
    return np.min([box[0] for box in boxes], axis=0), np.max([box[1] for box in boxes], axis=0)


def rigid(affine: Array, where: str) -> Array:
    """The rigid transform of the same origin whose axes are nearest those of an affine one.

    One that mirrors does so along all three axes at once, as USD has it: what is left is a rotation.

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
    found = np.eye(4)
    found[:3, :3] = np.sign(np.linalg.det(u @ v)) * (u @ v)
    found[:3, 3] = affine[:3, 3]
    if np.abs(affine[:3, :3] - affine[0, 0] * np.eye(3)).max() == 0.0:
        found[:3, :3] = np.eye(3)  # to the last digit
    return found
