"""Bodies and joints of a stage as links from the root outwards, at the zero of all joints."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from artsim.common.names import unused_name
from artsim.common.products import matmul, unit
from artsim.loading.scene_objects import WorldJoint, WorldLink
from artsim.loading.urdf_document import InlineMesh, Shape
from artsim.loading.usd_bodies import StageReader, UsdBody
from artsim.loading.usd_dynamics import read_dynamics, read_inertia
from artsim.loading.usd_joints import FreeAxis, UsdJoint
from artsim.loading.usd_mimics import read_mimics
from artsim.model.kinematics import Array
from artsim.model.objects import Repair

_SAME = 1e-5
"""Share of the stage's size by which a body may stand beside the zero of its joint because joints are in single
precision; then the place of the body, which is in double precision, counts."""
_MEETS = 1e-3
"""Share of the stage's size up to which two joints of the same bodies have their zeros at the same place."""
_X = np.array([1.0, 0.0, 0.0])


def read_links(reader: StageReader, joints: list[UsdJoint]) -> list[WorldLink]:
    """The world, then every body after its parent, each after the links of its further axes.

    Raises
    ------
    AssetError
        When joints close a chain.
    """
    _leave_out_surroundings(reader, joints)
    return _Tree(reader, joints).links()


def _leave_out_surroundings(reader: StageReader, joints: list[UsdJoint]) -> None:
    """Leave out static shapes that are not of what the world holds, or all of them where it holds nothing."""
    groups = _groups(len(reader.bodies), joints)
    held = next(group for group in groups if 0 in group)
    bodies = [body for body in held if body]
    if bodies:
        holders = [str(reader.bodies[body].prim.GetPath()) for body in bodies]
        frames = [path for joint in joints if joint.free for path in joint.static]
        frames = [path for path in frames if not any(holder.startswith(f"{path}/") for holder in holders)]
        reader.leave_out_ground(bodies, frames)
    elif len(groups) > 1:
        reader.leave_out_all_of_world()


def _groups(count: int, joints: Sequence[UsdJoint]) -> list[list[int]]:
    """Bodies that hang together, each group in the stage's order."""
    neighbours: dict[int, set[int]] = defaultdict(set)
    for joint in joints:
        for side in (0, 1):
            neighbours[joint.bodies[side]].add(joint.bodies[1 - side])
    groups: list[list[int]] = []
    seen: set[int] = set()
    for start in range(count):
        if start in seen:
            continue
        group, waiting = {start}, [start]
        while waiting:
            new = neighbours[waiting.pop()] - group
            group |= new
            waiting += new
        seen |= group
        groups.append(sorted(group))
    return groups


# --- the tree ---


@dataclass(eq=False)
class _Step:
    """One axis of the way from a body to the next: which joint leaves it free, and the sign of its values."""

    joint: UsdJoint
    axis: FreeAxis
    sign: float


class _Tree:
    """Follows joints from the root outwards, from whichever end comes first."""

    def __init__(self, reader: StageReader, joints: list[UsdJoint]):
        self._reader, self._joints = reader, joints
        self._mimics, self._held = read_mimics(reader, joints)
        self._between: dict[frozenset[int], list[UsdJoint]] = defaultdict(list)
        self._next: dict[int, dict[int, None]] = defaultdict(dict)
        for joint in joints:
            self._between[frozenset(joint.bodies)].append(joint)
            for side in (0, 1):
                self._next[joint.bodies[side]].setdefault(joint.bodies[1 - side])
        self._joint_names = {axis.name for joint in joints for axis in joint.free}
        self._size = _size(reader.bodies)
        self._T_world_zero = {0: reader.bodies[0].T_world_body}
        self._position = {0: 0}
        self._links = [self._link(0, -1, None)]

    def links(self) -> list[WorldLink]:
        self._walk(0)
        for body in self._roots():
            if body in self._position:
                continue
            found = self._reader.bodies[body]
            self._T_world_zero[body] = found.T_world_body
            free = WorldJoint(self._unused(f"{found.name}_floats"), "floating", found.T_world_body[:3, 3], _X)
            self._add(body, self._link(body, 0, free))
            self._walk(body)
        return self._links

    def _unused(self, name: str) -> str:
        return unused_name(name, self._joint_names)

    def _add(self, body: int, link: WorldLink) -> None:
        self._position[body] = len(self._links)
        self._links.append(link)

    def _walk(self, root: int) -> None:
        waiting: list[tuple[int, int]] = [(root, -1)]
        while waiting:
            body, parent = waiting.pop(0)
            for child in self._next[body]:
                if child == parent:
                    continue
                if child in self._position:
                    joint = self._between[frozenset((body, child))][-1]
                    raise self._reader.error(
                        joint.prim,
                        f"{joint.prim.GetTypeName()} closes a chain, and closed chains are not trees",
                        "remove or disable one joint",
                    )
                self._hang(body, child)
                waiting.append((child, body))

    def _hang(self, body: int, child: int) -> None:
        """Add the links of a body, as one or more joints hang it on another."""
        joints = self._between[frozenset((body, child))]
        T_child = self._zero_of(joints[0], body)
        reader = self._reader
        for other in joints[1:]:
            apart = np.abs(self._zero_of(other, body) - T_child).max()
            if not (apart <= _MEETS * max(self._size, 1e-9) and (other.free or not joints[0].free)):
                raise reader.error(
                    other.prim,
                    f"holds the bodies that {joints[0].prim.GetPath()} joins, too, and closes a chain",
                    "remove or disable one of the two",
                )
        stands = matmul(self._T_world_zero[body], np.linalg.inv(reader.bodies[body].T_world_body))
        own = matmul(stands, reader.bodies[child].T_world_body)
        if np.abs(T_child - own).max() <= _SAME * max(self._size, 1e-9):
            T_child = own
        self._T_world_zero[child] = T_child
        if len(joints) > 1:
            names = ", ".join(str(joint.prim.GetPath()) for joint in joints)
            reader.repairs.append(
                Repair(
                    f"prim {reader.bodies[child].prim.GetPath()}", f"several joints carry it, read as a chain: {names}"
                )
            )
        steps = [_Step(joint, axis, 1.0) for joint in joints for axis in joint.free]
        first = joints[0].bodies.index(body)  # the chain starts at the first body of the first joint
        for step in steps:  # values say how the second body moves against the first
            step.sign = 1.0 if step.joint.bodies[0] == body else -1.0
        steps = steps[::-1] if first == 1 else steps
        parent = self._position[body]
        for step in steps[:-1]:
            helper = unused_name(f"{reader.bodies[child].name}_{step.axis.name}", reader.names)
            self._links.append(WorldLink(helper, parent, self._joint(step, child)))
            parent = len(self._links) - 1
        if steps:
            last = self._joint(steps[-1], child)
        else:
            last = WorldJoint(self._unused(joints[0].name), "fixed", self._frame(joints[0], child)[:3, 3], _X)
        self._add(child, self._link(child, parent, last))

    def _zero_of(self, joint: UsdJoint, body: int) -> Array:
        """(4, 4) pose of the body at the other end, where the joint's frames meet."""
        side = joint.bodies.index(body)
        T_world_joint = matmul(self._T_world_zero[body], joint.frames[side])
        return matmul(T_world_joint, np.linalg.inv(joint.frames[1 - side]))

    def _frame(self, joint: UsdJoint, child: int) -> Array:
        return matmul(self._T_world_zero[child], joint.frames[joint.bodies.index(child)])

    def _roots(self) -> list[int]:
        """Bodies in the order in which one is taken for a root: articulation roots, those that none carries, others."""
        from pxr import UsdPhysics

        carried = {joint.bodies[1] for joint in self._joints}

        def rank(body: int) -> tuple[bool, bool, int]:
            return not self._reader.bodies[body].prim.HasAPI(UsdPhysics.ArticulationRootAPI), body in carried, body

        return sorted(range(1, len(self._reader.bodies)), key=rank)

    def _link(self, body: int, parent: int, joint: WorldJoint | None) -> WorldLink:
        reader, found, T_world_zero = self._reader, self._reader.bodies[body], self._T_world_zero[body]
        shapes, collision = ([Shape(mesh, T_world_zero) for mesh in meshes] for meshes in (found.shown, found.solid))
        inertia = None
        if found.prim is not None:
            solid = [(mesh.vertices, mesh.faces) for mesh in found.solid]
            T_body_prim = matmul(np.linalg.inv(found.T_world_body), found.affine)
            inertia = read_inertia(found.prim, T_body_prim, solid, reader.meters, reader.kilograms)
        in_world = None if inertia is None else inertia.transformed(T_world_zero)
        return WorldLink(found.name, parent, joint, shapes, collision, in_world)

    def _joint(self, step: _Step, child: int) -> WorldJoint:
        """A joint in the world: its motion is that of the child, whichever end of the joint that is."""
        joint, axis, reader = step.joint, step.axis, self._reader
        frame = self._frame(joint, child)
        direction = step.sign * unit(frame[:3, axis.axis])
        single = "linear" if axis.slides else "angular"
        dynamics = read_dynamics(
            joint.prim, axis.limit if len(joint.free) > 1 else single, reader.meters, reader.kilograms
        )
        lower = upper = self._held.get(axis.name, np.nan)
        kind = axis.type
        if np.isnan(lower):
            lower, upper = axis.lower, axis.upper
        elif kind == "continuous":
            kind = "revolute"
        mimic = self._mimics.get(axis.name)
        return WorldJoint(axis.name, kind, frame[:3, 3], direction, lower, upper, mimic, dynamics)


def _size(bodies: Sequence[UsdBody]) -> float:
    """Metres that bodies are apart, or are large."""
    points = [body.T_world_body[:3, 3] for body in bodies[1:]]
    meshes: list[InlineMesh] = [mesh for body in bodies for mesh in body.shown]
    reach = [float(np.abs(mesh.vertices).max()) for mesh in meshes]
    return max([float(np.ptp(points, axis=0).max()) if points else 0.0, *reach])
