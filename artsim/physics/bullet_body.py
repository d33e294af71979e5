"""Accelerations by PyBullet: the object as a multibody whose base stands still, in a world of its own."""

import tempfile
import weakref
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from artsim.common.extras import import_pybullet, silence_output
from artsim.loading.primitives import box
from artsim.model.kinematics import Array
from artsim.model.robot import BoxShape, Link, MeshShape, Robot
from artsim.physics.options import PhysicsOptions

_ANY_SPEED = 1e4


class BulletBody:
    """An object in PyBullet. Other things may be put into its world: they collide with the object's parts.

    Attributes
    ----------
    client, number : int
        PyBullet's ids of the world and of the object in it.
    mass_unit : float
        kg that PyBullet counts as one: divide masses and forces by it that are given to, or multiply those that are
        taken from, the world itself.

    Raises
    ------
    RenderError
        When PyBullet is not installed.
    """

    def __init__(self, robot: Robot, options: PhysicsOptions):
        self._bullet = import_pybullet()
        self.mass_unit = _mass_unit(robot.links)
        with silence_output():
            self.client: int = self._bullet.connect(self._bullet.DIRECT)
        self._end = weakref.finalize(self, _disconnect, self._bullet, self.client)
        bullet, world, count = self._bullet, {"physicsClientId": self.client}, len(robot.joints)
        bullet.setTimeStep(options.time_step, **world)
        bullet.setGravity(0.0, 0.0, -options.gravity, **world)
        bullet.setPhysicsEngineParameter(deterministicOverlappingPairs=1, numSolverIterations=100, **world)
        self.number = _create_body(bullet, self.client, robot, self.mass_unit)
        # Bullet numbers links by depth; the names that it gave count them as they came.
        infos = [bullet.getJointInfo(self.number, number, **world) for number in range(count)]
        order = np.argsort([int(info[1].decode().removeprefix("joint")) for info in infos])
        self._numbers = [int(number) for number in order]
        for number, link in zip(self._numbers, robot.links[1:], strict=True):
            # One setting for each call: asked for many at once, Bullet leaves some out.
            moments = (np.linalg.eigvalsh(link.inertia.tensor) / self.mass_unit).tolist()
            settings: list[dict[str, Any]] = [{"localInertiaDiagonal": moments}, {"maxJointVelocity": _ANY_SPEED}]
            settings += [{"linearDamping": 0.0}, {"angularDamping": 0.0}]
            for setting in settings:
                bullet.changeDynamics(self.number, number, **setting, **world)
        if count:  # a joint that is told nothing has a motor that holds it
            free = {"targetVelocities": [0.0] * count, "forces": [0.0] * count}
            bullet.setJointMotorControlArray(self.number, self._numbers, bullet.VELOCITY_CONTROL, **free, **world)
        self.put(np.zeros(count), np.zeros(count))
        if count:
            with silence_output():  # the first mass matrix comes with remarks on the rounding of axes
                self._mass()

    def close(self) -> None:
        """Free the world; happens by itself when the body is no longer used."""
        self._end()

    def put(self, values: Array, speeds: Array) -> None:
        """Set values and speeds of the joints, (J,) each."""
        self._values = values
        if len(values):
            self._bullet.resetJointStatesMultiDof(
                self.number,
                self._numbers,
                values[:, None].tolist(),
                speeds[:, None].tolist(),
                physicsClientId=self.client,
            )

    def advance(self, efforts: Array) -> tuple[Array, Array]:
        """(J,) speeds one time step later, of joints that move freely under efforts (J,); and the (J, J) mass matrix
        as they were put."""
        bullet, world = self._bullet, {"physicsClientId": self.client}
        if not self._numbers:
            bullet.stepSimulation(**world)
            return np.zeros(0), np.zeros((0, 0))
        mass = self._mass()
        forces = (efforts / self.mass_unit).tolist()
        bullet.setJointMotorControlArray(self.number, self._numbers, bullet.TORQUE_CONTROL, forces=forces, **world)
        bullet.stepSimulation(**world)
        states = bullet.getJointStates(self.number, self._numbers, **world)
        return np.array([state[1] for state in states]), mass

    def _mass(self) -> Array:
        """(J, J) mass matrix, kg."""
        ordered = np.empty(len(self._values))
        ordered[self._numbers] = self._values
        found = self._bullet.calculateMassMatrix(self.number, ordered.tolist(), physicsClientId=self.client)
        return self.mass_unit * np.array(found)[np.ix_(self._numbers, self._numbers)]


def _mass_unit(links: Sequence[Link]) -> float:
    """A power of two, which changes no rounding, in which moments of inertia are at most 1/4.

    Bullet makes no mass matrix once an inertia tensor is asymmetric by 1e-14, as rounding leaves a large one.
    """
    arms = [link.inertia.center - link.origin for link in links]
    moments = [np.trace(link.inertia.tensor) + link.inertia.mass * a @ a for link, a in zip(links, arms, strict=True)]
    return float(2.0 ** max(0, int(np.ceil(np.log2(4.0 * max(moments))))))


def _create_body(bullet: ModuleType, client: int, robot: Robot, mass_unit: float) -> int:
    """The object as a multibody whose base stands still; joints are free, and at rest at 0."""
    base, *links = robot.links
    from scipy.spatial.transform import Rotation  # takes longer to import than artsim itself

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
    vertices, faces = box(shape.size)
    return MeshShape("box", vertices + shape.center, faces)


def _disconnect(bullet: ModuleType, client: int) -> None:
    with silence_output():
        bullet.disconnect(client)
