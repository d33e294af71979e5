"""Physics of an articulated object, embedded: PyBullet moves its joints under efforts, friction, damping and limits.

What Bullet does not do exactly by itself is put right after each of its steps:

- Joints that follow others (``mimic``, the thread of a screw) do so exactly: after a step in which all joints moved
  freely, the motion that obeys is the nearest in the metric of the mass matrix (Gauss's principle of least constraint).
  Bullet's gear constraints would let them drift.
- Joints that went past a limit are put back on it and stop there, and what hangs on them feels the blow: stops do not
  bounce. Bullet's would let fast joints through by tenths of a radian.
- Damping is implicit: Bullet's own is explicit, and unstable for light links at the end of heavy chains.

Parts of an object do not collide with each other. Joined parts stand fractions of a millimetre apart, which is within
Bullet's margins; and no joint state lets parts of a sound object overlap (:mod:`artsim.checks.validity` looks for it),
so that there is nothing to lose. They do collide with whatever else is put into the simulation.
"""

from __future__ import annotations

import tempfile
import weakref
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from artsim.errors import ConfigError
from artsim.export.robot import GRAVITY, BoxShape, Link, LinkJoint, MeshShape, Robot, as_robot
from artsim.model.convex_bodies import add_bodies
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.renderers.bullet import import_pybullet, silence_output

Control = Literal["effort", "velocity"]
_ANY_SPEED = 1e4


@dataclass(frozen=True)
class PhysicsOptions:
    """How an object moves."""

    time_step: float = 1 / 480
    """Seconds of one step of the integrator."""
    substeps: int = 24
    """Steps of the integrator for each control step: 24 make 20 control steps per second."""
    gravity: float = GRAVITY
    """m/s^2, downwards."""
    damping: float = 1.0
    """Factor on every joint's damping; 0 takes it away."""
    friction: float = 1.0
    """Factor on every joint's friction; 0 takes it away."""

    def __post_init__(self) -> None:
        if not 0.0 < self.time_step <= 0.02:
            raise ConfigError(
                f"a step of {self.time_step} s is not stable", "time_step", "use up to 0.02, such as 1/480"
            )
        if self.substeps < 1:
            raise ConfigError(f"{self.substeps} steps do not move anything", "substeps", "use 1 or more")
        for name in ("gravity", "damping", "friction"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise ConfigError(f"{value} is not 0 or more", name, "use 0 to leave it out")

    @property
    def control_step(self) -> float:
        """Seconds of one control step."""
        return self.time_step * self.substeps


class Simulation:
    """An object whose base stands still, in a PyBullet world of its own.

    Its rest frame is the world's. Friction is Coulomb's: a joint at rest stays until the effort exceeds it. Damping is
    viscous. Masses follow from densities; what holds damping, friction and efforts is told in
    :mod:`artsim.export.robot`, so that a simulation here moves as the exported file does elsewhere.

    Parameters
    ----------
    obj : ArticulatedObject
        Procedural, or loaded: a loaded part, whose source tells no density, counts as its convex hull, and as hollow.
    options : PhysicsOptions, optional

    Attributes
    ----------
    client, body : int
        PyBullet's ids of the world and of the object in it, for those who want to add things.
    mass_unit : float
        kg that PyBullet counts as one: divide masses and forces by it that are given to, or multiply those that are
        taken from, the world itself.
    effort_limit, velocity_limit : (F,) float
        Of each of ``obj.tree.free_joints``: N m or N, rad/s or m/s.

    Raises
    ------
    RenderError
        When PyBullet is not installed.
    AssetError
        When a procedural part encloses no solid.
    """

    def __init__(self, obj: ArticulatedObject, options: PhysicsOptions | None = None):
        self.obj, self.options = obj, options or PhysicsOptions()
        self._bullet = import_pybullet()
        self._robot = as_robot(add_bodies(obj))
        self.mass_unit = _mass_unit(self._robot.links)
        names = {joint.name: j for j, joint in enumerate(self._robot.joints)}
        part_joint = [names[joint.name] for joint in self._robot.obj.tree.joints[1:]]
        self._driven = [part_joint[k - 1] for k in obj.tree.free_joints]
        driven = [self._robot.joints[j] for j in self._driven]
        self.effort_limit = np.array([joint.effort for joint in driven])
        self.velocity_limit = np.array([joint.velocity for joint in driven])
        with silence_output():
            self.client: int = self._bullet.connect(self._bullet.DIRECT)
        self.close = weakref.finalize(self, _disconnect, self._bullet, self.client)
        """Free the world; happens by itself when the simulation is no longer used."""
        self._build(part_joint)
        self.reset()

    def _build(self, part_joint: Sequence[int]) -> None:
        bullet, world, joints = self._bullet, {"physicsClientId": self.client}, self._robot.joints
        bullet.setTimeStep(self.options.time_step, **world)
        bullet.setGravity(0.0, 0.0, -self.options.gravity, **world)
        bullet.setPhysicsEngineParameter(deterministicOverlappingPairs=1, numSolverIterations=100, **world)
        self.body = _create_body(bullet, self.client, self._robot, self.mass_unit)
        # Bullet numbers links by depth; the names that it gave count them as they came.
        infos = [bullet.getJointInfo(self.body, number, **world) for number in range(len(joints))]
        order = np.argsort([int(info[1].decode().removeprefix("joint")) for info in infos])
        self._numbers = [int(number) for number in order]
        for number, link in zip(self._numbers, self._robot.links[1:], strict=True):
            # One setting for each call: asked for many at once, Bullet leaves some out.
            moments = (np.linalg.eigvalsh(link.inertia.tensor) / self.mass_unit).tolist()
            settings: list[dict[str, Any]] = [{"localInertiaDiagonal": moments}, {"maxJointVelocity": _ANY_SPEED}]
            settings += [{"linearDamping": 0.0}, {"angularDamping": 0.0}]
            for setting in settings:
                bullet.changeDynamics(self.body, number, **setting, **world)
        # Coulomb's friction is a motor that holds speed 0 as strongly as the friction is.
        self._friction = [joint.friction * self.options.friction / self.mass_unit for joint in joints]
        self._lower = np.array([joints[j].lower for j in self._driven])
        self._upper = np.array([joints[j].upper for j in self._driven])
        self._follow, self._offset = np.eye(len(joints)), np.zeros(len(joints))
        for j, source, multiplier, offset in _gears(joints):
            self._follow[j] = multiplier * self._follow[source]
            self._offset[j] = multiplier * self._offset[source] + offset
        self._follow = self._follow[:, self._driven]
        damping = np.array([joint.damping * self.options.damping / self.mass_unit for joint in joints])
        self._damping = self._follow.T @ (damping[:, None] * self._follow)
        self._always = len(joints) > len(self._driven) or bool(self._damping.any())
        self._measured = [self._numbers[j] for j in part_joint]
        with silence_output():  # the first mass matrix comes with remarks on the rounding of axes
            self._momentum(np.zeros(len(joints)), np.zeros(len(joints)))

    def reset(self, q: ArrayLike | None = None, velocity: ArrayLike | None = None) -> None:
        """Start anew.

        Parameters
        ----------
        q, velocity : (K,) float, optional
            States (cut to the limits) and speeds of the joints; at rest, and still, by default. Joints that follow
            others do so whatever their own entries say.

        Raises
        ------
        KinematicsError
            When a shape does not fit, or a value is not finite.
        """
        tree = self.obj.tree
        state = tree.complete_state(tree.rest if q is None else q) - tree.rest
        speed = tree.complete_state(np.zeros(len(tree)) if velocity is None else velocity)
        chosen = np.clip(state[tree.free_joints], self._lower, self._upper)
        self._put(chosen, speed[tree.free_joints])

    @property
    def state(self) -> Array:
        """(K,) joint states, radians or metres; the root's is 0."""
        return self.obj.tree.rest + self._read(0)

    @property
    def velocity(self) -> Array:
        """(K,) speeds of the joints, rad/s or m/s; the root's is 0."""
        return self._read(1)

    def step(self, action: ArrayLike, control: Control = "effort") -> None:
        """One control step.

        Parameters
        ----------
        action : (F,) float
            For each of ``obj.tree.free_joints``: the effort on it (N m or N), cut to its limit, and idle while the
            joint is faster than its velocity limit; or the speed (rad/s or m/s), cut to its limit, that a motor as
            strong as the effort limit holds it at, whatever the friction.
        control : str

        Raises
        ------
        ConfigError
            When the action has another shape, or is not finite.
        """
        given = np.asarray(action, dtype=np.float64)
        if given.shape != self.effort_limit.shape or not np.isfinite(given).all():
            names = ", ".join(self.obj.parts[k].label for k in self.obj.tree.free_joints)
            raise ConfigError(
                f"an action of shape {given.shape} is not {len(self.effort_limit)} finite numbers",
                f"{self.obj.category} {self.obj.object_id}",
                f"pass one for each free joint ({names})",
            )
        limit = self.effort_limit if control == "effort" else self.velocity_limit
        wanted = np.clip(given, -limit, limit)
        bullet, world = self._bullet, {"physicsClientId": self.client}
        driven = [self._numbers[j] for j in self._driven]
        self._drive(self._numbers, [0.0] * len(self._numbers), self._friction)
        if control == "velocity":
            self._drive(driven, wanted.tolist(), (self.effort_limit / self.mass_unit).tolist())
        for _ in range(self.options.substeps):
            if control == "effort" and driven:  # Bullet forgets efforts after each step
                effort = np.where(self._rate * np.sign(wanted) < self.velocity_limit, wanted, 0.0)
                bullet.setJointMotorControlArray(
                    self.body, driven, bullet.TORQUE_CONTROL, forces=(effort / self.mass_unit).tolist(), **world
                )
            bullet.stepSimulation(**world)
            self._settle()

    def _drive(self, numbers: Sequence[int], speeds: Sequence[float], strengths: Sequence[float]) -> None:
        self._bullet.setJointMotorControlArray(
            self.body,
            numbers,
            self._bullet.VELOCITY_CONTROL,
            targetVelocities=speeds,
            forces=strengths,
            physicsClientId=self.client,
        )

    def _settle(self) -> None:
        """After a step of Bullet: couple joints, damp them (``(M + dt D) v' = M v``) and stop them at their limits."""
        states = self._bullet.getJointStates(self.body, self._numbers, physicsClientId=self.client)
        value, speed = np.array([state[:2] for state in states]).reshape(-1, 2).T
        chosen, rate = value[self._driven], speed[self._driven]
        inside = np.clip(chosen, self._lower, self._upper)
        outside = chosen != inside
        if self._always or outside.any():
            momentum, mass = self._momentum(value, speed)
            mass += self.options.time_step * self._damping
            rate = np.linalg.solve(mass, momentum)
            moves = ~(outside & ((chosen - inside) * rate > 0))
            rate = np.where(moves, rate, 0.0)
            rate[moves] = np.linalg.solve(mass[np.ix_(moves, moves)], momentum[moves])
        self._put(inside, rate)

    def _momentum(self, value: Array, speed: Array) -> tuple[Array, Array]:
        """(F,) momentum and (F, F) mass matrix of the joints that can be chosen, with all that follows them."""
        ordered = np.empty(len(value))
        ordered[self._numbers] = value
        mass = np.array(self._bullet.calculateMassMatrix(self.body, ordered.tolist(), physicsClientId=self.client))
        pulled = self._follow.T @ mass[np.ix_(self._numbers, self._numbers)]
        return pulled @ speed, pulled @ self._follow

    def _put(self, chosen: Array, rate: Array) -> None:
        """Set value and speed of every joint from those, (F,) each, that can be chosen."""
        self._rate = rate
        if not self._numbers:
            return
        values, speeds = self._follow @ chosen + self._offset, self._follow @ rate
        self._bullet.resetJointStatesMultiDof(
            self.body, self._numbers, values[:, None].tolist(), speeds[:, None].tolist(), physicsClientId=self.client
        )

    def _read(self, field: int) -> Array:
        """(K,) field of the state of each part's joint; Bullet's joints are 0 at rest."""
        states = self._bullet.getJointStates(self.body, self._measured, physicsClientId=self.client)
        return np.array([0.0, *(state[field] for state in states)])


def _mass_unit(links: Sequence[Link]) -> float:
    """A power of two, which changes no rounding, in which moments of inertia are at most 1/4.

    Bullet makes no mass matrix once an inertia tensor is asymmetric by 1e-14, as rounding leaves a large one.
    """
    arms = [link.inertia.center - link.origin for link in links]
    moments = [np.trace(link.inertia.tensor) + link.inertia.mass * a @ a for link, a in zip(links, arms, strict=True)]
    return float(2.0 ** max(0, int(np.ceil(np.log2(4.0 * max(moments))))))


def _gears(joints: Sequence[LinkJoint]) -> list[tuple[int, int, float, float]]:
    """(joint, its source, multiplier, offset) of each joint that follows another, sources before followers."""
    names = {joint.name: j for j, joint in enumerate(joints)}
    waiting = {j: joint.mimic for j, joint in enumerate(joints) if joint.mimic is not None}
    gears: list[tuple[int, int, float, float]] = []
    while waiting:  # comes to an end: a tree's mimic relations have no loops
        for j in [j for j, mimic in waiting.items() if names[mimic[0]] not in waiting]:
            source, multiplier, offset = waiting.pop(j)
            gears.append((j, names[source], multiplier, offset))
    return gears


def _create_body(bullet: ModuleType, client: int, robot: Robot, mass_unit: float) -> int:
    """The object as a multibody whose base stands still; joints are free, and at rest at 0."""
    base, *links = robot.links
    frames = [Rotation.from_matrix(link.inertia.principal()[1]).as_quat().tolist() for link in links]
    return int(
        bullet.createMultiBody(
            baseMass=0.0,
            baseCollisionShapeIndex=_collision_shape(bullet, client, base),
            linkMasses=[link.inertia.mass / mass_unit for link in links],
            linkCollisionShapeIndices=[_collision_shape(bullet, client, link) for link in links],
            linkVisualShapeIndices=[-1] * len(links),
            linkPositions=[(robot.links[j.child].origin - robot.links[j.parent].origin).tolist() for j in robot.joints],
            linkOrientations=[[0.0, 0.0, 0.0, 1.0]] * len(links),
            linkInertialFramePositions=[(link.inertia.center - link.origin).tolist() for link in links],
            linkInertialFrameOrientations=frames,
            linkParentIndices=[joint.parent for joint in robot.joints],
            linkJointTypes=[
                bullet.JOINT_PRISMATIC if joint.type == "prismatic" else bullet.JOINT_REVOLUTE for joint in robot.joints
            ],
            linkJointAxis=[joint.axis.tolist() for joint in robot.joints],
            physicsClientId=client,
        )
    )


def _collision_shape(bullet: ModuleType, client: int, link: Link) -> int:
    """Convex pieces of a link in its own frame; -1 for a link without."""
    if not link.collision:
        return -1
    lines, first = [], 1
    for number, shape in enumerate(link.collision):
        mesh = shape if isinstance(shape, MeshShape) else _box_mesh(shape)
        lines.append(f"o piece{number}\n")
        lines += [f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in (mesh.vertices - link.origin).tolist()]
        lines += [f"f {a} {b} {c}\n" for a, b, c in (mesh.faces + first).tolist()]
        first += len(mesh.vertices)
    with tempfile.TemporaryDirectory(prefix="artsim-physics-") as folder, silence_output():
        path = Path(folder) / "pieces.obj"
        path.write_text("".join(lines))
        return int(bullet.createCollisionShape(bullet.GEOM_MESH, fileName=str(path), physicsClientId=client))


def _box_mesh(shape: BoxShape) -> MeshShape:
    import trimesh

    box = trimesh.creation.box(shape.size)
    return MeshShape("box", np.asarray(box.vertices) + shape.center, np.asarray(box.faces, dtype=np.int32))


def _disconnect(bullet: ModuleType, client: int) -> None:
    with silence_output():
        bullet.disconnect(client)
