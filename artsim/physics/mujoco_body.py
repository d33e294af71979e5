"""Accelerations by MuJoCo: the object's links and joints as bodies whose base stands still."""

from typing import Any

import numpy as np

from artsim.common.extras import import_mujoco
from artsim.model.kinematics import Array
from artsim.model.robot import Robot
from artsim.physics.options import PhysicsOptions


class MujocoBody:
    """An object in MuJoCo. It has inertia and no shape: nothing can be put beside it.

    Attributes
    ----------
    model, data : MjModel, MjData

    Raises
    ------
    ConfigError
        When MuJoCo is not installed.
    """

    def __init__(self, robot: Robot, options: PhysicsOptions):
        mujoco = import_mujoco("physics", extra="envs")

        self._mujoco, self._time_step = mujoco, options.time_step
        spec = mujoco.MjSpec()
        spec.compiler.degree, spec.compiler.fusestatic = False, False
        spec.option.gravity = [0.0, 0.0, -options.gravity]
        spec.option.timestep = options.time_step
        incoming = {joint.child: joint for joint in robot.joints}
        bodies: list[Any] = []
        for i, link in enumerate(robot.links):
            joint = incoming.get(i)
            parent = spec.worldbody if joint is None else bodies[joint.parent]
            offset = link.origin if joint is None else link.origin - robot.links[joint.parent].origin
            tensor = link.inertia.tensor
            entries = [tensor[a, b] for a, b in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
            body = parent.add_body(name=link.name, pos=offset, explicitinertial=True, mass=link.inertia.mass)
            body.ipos, body.fullinertia = link.inertia.center - link.origin, entries
            if joint is not None:
                kind = mujoco.mjtJoint.mjJNT_SLIDE if joint.type == "prismatic" else mujoco.mjtJoint.mjJNT_HINGE
                body.add_joint(name=joint.name, type=kind, axis=joint.axis)
            bodies.append(body)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self._dofs = np.array([self.model.joint(joint.name).dofadr[0] for joint in robot.joints], dtype=np.int64)

    def put(self, values: Array, speeds: Array) -> None:
        """Set values and speeds of the joints, (J,) each."""
        self.data.qpos[self._dofs], self.data.qvel[self._dofs] = values, speeds

    def advance(self, efforts: Array) -> tuple[Array, Array]:
        """(J,) speeds one time step later, of joints that move freely under efforts (J,); and the (J, J) mass matrix
        as they were put."""
        model, data, dofs = self.model, self.data, self._dofs
        data.qfrc_applied[dofs] = efforts
        self._mujoco.mj_forward(model, data)
        mass = np.empty((model.nv, model.nv))
        for column, unit in enumerate(np.eye(model.nv)):
            self._mujoco.mj_mulM(model, data, mass[column], unit)
        return (data.qvel + self._time_step * data.qacc)[dofs], mass[np.ix_(dofs, dofs)]

    def close(self) -> None:
        """Free the model; nothing else holds it."""
