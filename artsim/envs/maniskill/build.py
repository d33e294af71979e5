"""An object as an articulation in one of ManiSkill's sub-scenes, made in memory through ManiSkill's own builder."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import sapien
from mani_skill.envs.scene import ManiSkillScene
from numpy.typing import NDArray
from sapien.wrapper.articulation_builder import LinkBuilder
from scipy.spatial.transform import Rotation

from artsim.envs.maniskill.places import T_world_object
from artsim.loading.decomposition import decompose
from artsim.model.appearance import Coat
from artsim.model.convex_bodies import add_bodies
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.model.robot import DECAY, GRAVITY, BoxShape, Link, LinkJoint, MeshShape, Robot, as_robot
from artsim.renderers.sapien_stage import render_body

OBJECT_BIT = 28
"""Bit of collision group 2 that parts of an object share with each other, and with the ground: those do not collide."""


@dataclass(frozen=True, eq=False)
class Built:
    """An object of K parts and F free joints in a sub-scene, as an articulation with D degrees of freedom."""

    articulation: Any
    links: list[Any]
    """Body of each part. Its frame stands at the part's joint, with the axes of the rest frame."""
    origins: Array
    """(K, 3) float. Origin of each of these frames in the rest frame, at rest, metres."""
    place: NDArray[np.int64]
    """(K,) int. Where the articulation's ``qpos`` holds the way of each part's joint from its rest state; 0 for the
    root."""
    follow: Array
    """(D, F), offset : (D,) float. ``qpos = follow @ way + offset`` for the way of each free joint from its rest state:
    joints that follow others."""
    offset: Array
    inertia: Array
    """(D,) float. Of what each joint carries, at rest: kg m^2 or kg."""


def build(
    scene: ManiSkillScene,
    obj: ArticulatedObject,
    coats: Sequence[Coat],
    number: int,
    gravity: bool,
    pieces: bool = False,
) -> Built:
    """Put an object on the ground of a sub-scene, its base fixed.

    Damping, friction and masses are those of :func:`artsim.model.robot.as_robot`, as in :mod:`artsim.physics.world`; a
    loaded object moves as its convex hulls do, and looks as its own surface does.

    Parameters
    ----------
    scene : ManiSkillScene
    obj : ArticulatedObject
    coats : sequence of Coat, length K
        Not looked at where nothing is drawn.
    number : int
        Sub-scene.
    gravity : bool
        Whether gravity pulls on the parts.
    pieces : bool
        Whether parts of a loaded object collide as convex pieces instead of their hulls.

    Raises
    ------
    AssetError
        When a part encloses no solid.
    """
    robot = as_robot(add_bodies(decompose(obj, progress=False) if pieces else obj))
    builder = scene.create_articulation_builder()
    T = T_world_object(obj)
    builder.initial_pose = sapien_pose(T[:3, 3], T[:3, :3])
    builder.set_scene_idxs([number])
    joint_of = {joint.child: joint for joint in robot.joints}
    for i, link in enumerate(robot.links):
        joint = joint_of.get(i)
        parent = None if joint is None else builder.link_builders[joint.parent]
        made = _LinkBuilder(i, parent, link, obj, coats)
        if joint is None:
            made.set_joint_properties("fixed", [], sapien.Pose(), sapien.Pose())
        else:
            _set_joint(made, joint, link.origin - robot.links[joint.parent].origin)
        builder.link_builders.append(made)
    articulation = builder.build(name=f"object-{number}")
    body = articulation._objs[0]
    by_name = {link.entity.name: link for link in body.links}
    for link in body.links:
        link.disable_gravity = not gravity
        link.linear_damping = link.angular_damping = 0.0
    names = [joint.name.removeprefix(f"scene-{number}-object-{number}_") for joint in body.active_joints]
    joints, weights = {joint.name: joint for joint in robot.joints}, _weights(robot)
    for made_joint, name in zip(body.active_joints, names, strict=True):
        # PhysX multiplies the force in the joint with it: for a hinge it is a radius in metres.
        made_joint.set_friction(joints[name].friction / weights[name])
    part_links = [link for link in robot.links if link.part >= 0]
    place = [0, *(names.index(joint.name) for joint in robot.obj.tree.joints[1:])]
    follow, offset = _mimic_gears(robot, names)
    return Built(
        articulation,
        [by_name[link.name] for link in part_links],
        np.array([link.origin for link in part_links]),
        np.array(place, dtype=np.int64),
        follow,
        offset,
        np.array([joints[name].damping * DECAY for name in names]),
    )


class _LinkBuilder(LinkBuilder):  # type: ignore[misc]  # SAPIEN has no types
    """Builds a link from arrays instead of files."""

    def __init__(
        self, index: int, parent: LinkBuilder | None, link: Link, obj: ArticulatedObject, coats: Sequence[Coat]
    ):
        super().__init__(index, parent)
        self.set_name(link.name)
        self._link, self._obj, self._coats = link, obj, coats
        self.collision_groups = [1, 1, 1 << OBJECT_BIT, 0]
        if link.part >= 0 and len(obj.parts[link.part].faces):
            self.visual_records = [link.part]  # told that there are some, the builder asks for the component

    def build_render_component(self) -> Any:
        """The part's own surface under its coat."""
        k, scale = self._link.part, self._obj.scale
        part = self._obj.parts[k]
        local = replace(part, vertices=part.vertices - self._link.origin / scale, body=None)
        component = render_body(sapien, local, self._coats[k], scale, {})
        component.name = self.name
        return component

    def build_physx_component(self, link_parent: Any = None) -> Any:
        """Convex pieces, mass and inertia."""
        component = sapien.physx.PhysxArticulationLinkComponent(link_parent)
        for shape in self._link.collision:
            made = _collision(shape, self._link.origin)
            made.set_collision_groups(self.collision_groups)
            component.attach(made)
        inertia = self._link.inertia
        moments, axes = inertia.principal()
        component.mass = inertia.mass
        component.cmass_local_pose = sapien_pose(inertia.center - self._link.origin, axes)
        component.inertia = moments.astype(np.float32)
        component.name = self.name
        return component


def _collision(shape: BoxShape | MeshShape, origin: Array) -> Any:
    physx = sapien.physx
    material = physx.get_default_material()
    if isinstance(shape, MeshShape):
        vertices = (shape.vertices - origin).astype(np.float32)
        try:
            return physx.PhysxCollisionShapeConvexMesh(vertices, np.ones(3, np.float32), material)
        except RuntimeError:  # PhysX refuses the thinnest hulls
            low, high = shape.vertices.min(axis=0), shape.vertices.max(axis=0)
            shape = BoxShape(0.5 * (low + high), np.maximum(high - low, 1e-4))
    box = physx.PhysxCollisionShapeBox((0.5 * shape.size).astype(np.float32), material)
    box.local_pose = sapien.Pose(shape.center - origin)
    return box


def _set_joint(builder: LinkBuilder, joint: LinkJoint, step: Array) -> None:
    """A joint about or along the x axis of its frame. Angles go on counting after a turn, unlike in other kinds.

    A joint that follows another stops where that one does.
    """
    kind = "prismatic" if joint.type == "prismatic" else "revolute_unwrapped"
    limits = (joint.lower, joint.upper) if joint.mimic is None else (-np.inf, np.inf)
    frame = _frame_along(joint.axis)
    builder.set_joint_name(joint.name)
    builder.set_joint_properties(
        kind, [limits], sapien_pose(step, frame), sapien_pose(np.zeros(3), frame), 0.0, joint.damping
    )


def _frame_along(axis: Array) -> Array:
    """(3, 3) rotation whose first column is a unit axis."""
    side = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    side /= np.linalg.norm(side)
    return np.stack([axis, side, np.cross(axis, side)], axis=1)


def sapien_pose(position: Array, rotation: Array) -> Any:
    """SAPIEN's pose of a (3,) position and a (3, 3) rotation."""
    return sapien.Pose(position, Rotation.from_matrix(rotation).as_quat()[[3, 0, 1, 2]])


def _weights(robot: Robot) -> dict[str, float]:
    """What each joint carries, newtons, by the joint's name."""
    mass = [link.inertia.mass for link in robot.links]
    for joint in reversed(robot.joints):  # children before parents
        mass[joint.parent] += mass[joint.child]
    return {joint.name: mass[joint.child] * GRAVITY for joint in robot.joints}


def _mimic_gears(robot: Robot, names: list[str]) -> tuple[Array, Array]:
    """(D, F) and (D,): degrees of freedom as a linear function of the free joints."""
    unit = np.eye(len(robot.obj))
    states = [robot.states(q) for q in (np.zeros(len(robot.obj)), *unit[robot.obj.tree.free_joints])]
    offset, *moved = (np.array([state[name] for name in names]) for state in states)
    follow = np.array([column - offset for column in moved]).reshape(len(moved), len(names)).T
    return follow, offset
