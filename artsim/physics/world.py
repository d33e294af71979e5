"""Physics of an articulated object, embedded: joints move under efforts, friction, damping and limits.

PyBullet or MuJoCo says how joints would move freely in the next time step. What they lose and what holds them is
computed here, the same for both, in the joints that can be chosen:

- Joints that follow others (``mimic``, the thread of a screw) do so exactly: of all motions that obey, theirs is the
  nearest to the free one in the metric of the mass matrix (Gauss's principle of least constraint).
- Damping is implicit: an explicit one is unstable for light links at the end of heavy chains.
- Friction and motors hold speeds as far as their strength goes (:mod:`artsim.physics.friction`).
- Joints that went past a limit are put back on it and stop there, and what hangs on them feels the blow: stops do not
  bounce.

Parts of an object do not collide with each other. Joined parts stand fractions of a millimetre apart, which is within
Bullet's margins; and no joint state lets parts of a sound object overlap (:mod:`artsim.checks.validity` looks for it),
so that there is nothing to lose. In PyBullet they collide with whatever else is put into the simulation.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from artsim.errors import ConfigError
from artsim.loading.decomposition import decompose
from artsim.model.convex_bodies import add_bodies
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.model.robot import LinkJoint, Robot, as_robot
from artsim.physics.bullet_body import BulletBody
from artsim.physics.friction import held_speeds
from artsim.physics.mujoco_body import MujocoBody
from artsim.physics.options import Control, PhysicsOptions


class Body(Protocol):
    """An object in a physics engine: says how its J joints would move freely."""

    def put(self, values: Array, speeds: Array) -> None: ...

    def advance(self, efforts: Array) -> tuple[Array, Array]: ...

    def close(self) -> None: ...


ENGINES: dict[str, Callable[[Robot, PhysicsOptions], Body]] = {"pybullet": BulletBody, "mujoco": MujocoBody}
"""Name of each engine -> what puts an object into it."""


def engine_of(options: PhysicsOptions) -> str:
    """Name of the engine that options ask for: ``auto`` is PyBullet where it is installed, else MuJoCo."""
    if options.engine != "auto":
        return options.engine
    return "mujoco" if importlib.util.find_spec("pybullet") is None else "pybullet"


class Simulation:
    """An object whose base stands still, in a physics world of its own.

    Its rest frame is the world's. Friction is Coulomb's: a joint at rest stays until the effort exceeds it. Damping is
    viscous. Masses follow from densities; what holds damping, friction and efforts is told in
    :mod:`artsim.model.robot`, so that a simulation here moves as the exported file does elsewhere.

    Parameters
    ----------
    obj : ArticulatedObject
        Procedural, or loaded: a loaded part, whose source tells no density, counts as its convex hull, and as hollow.
    options : PhysicsOptions, optional

    Attributes
    ----------
    engine : str
        Key of ``ENGINES``.
    body : BulletBody or MujocoBody
        The object in the engine, for those who want to reach the engine itself.
    effort_limit, velocity_limit : (F,) float
        Of each of ``obj.tree.free_joints``: N m or N, rad/s or m/s.

    Raises
    ------
    ArtsimError
        When the engine is not installed.
    AssetError
        When a procedural part encloses no solid.
    """

    def __init__(self, obj: ArticulatedObject, options: PhysicsOptions | None = None):
        self.obj, self.options = obj, options or PhysicsOptions()
        self.engine = engine_of(self.options)
        pieced = decompose(obj, progress=False) if self.options.collision == "pieces" else obj
        robot = as_robot(add_bodies(pieced))
        joints = robot.joints
        names = {joint.name: j for j, joint in enumerate(joints)}
        self._measured = [names[joint.name] for joint in robot.obj.tree.joints[1:]]
        self._driven = [self._measured[k - 1] for k in obj.tree.free_joints]
        driven = [joints[j] for j in self._driven]
        self.effort_limit = np.array([joint.effort for joint in driven])
        self.velocity_limit = np.array([joint.velocity for joint in driven])
        self._lower = np.array([joint.lower for joint in driven])
        self._upper = np.array([joint.upper for joint in driven])
        follow, self._offset = np.eye(len(joints)), np.zeros(len(joints))
        for j, source, multiplier, offset in _gears(joints):
            follow[j] = multiplier * follow[source]
            self._offset[j] = multiplier * self._offset[source] + offset
        self._follow = follow[:, self._driven]
        damping = self.options.damping * np.array([joint.damping for joint in joints])
        self._damping = self._follow.T @ (damping[:, None] * self._follow)
        self._spring = self._follow.T @ (np.array([joint.spring for joint in joints])[:, None] * self._follow)
        self._latched = [(j, joint) for j, joint in enumerate(joints) if joint.hold]
        self._friction = self.options.friction * np.array([joint.friction for joint in joints])
        self.body = ENGINES[self.engine](robot, self.options)
        self.reset()

    def __deepcopy__(self, memo: dict[int, Any]) -> Simulation:
        """The same object in the same state, in a world of its own; what else was put into this one is not in it."""
        copy = Simulation(self.obj, self.options)
        copy._put(self._value.copy(), self._rate.copy())
        return copy

    def close(self) -> None:
        """Free the world; happens by itself when the simulation is no longer used."""
        self.body.close()

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
        self._put(np.clip(state[tree.free_joints], self._lower, self._upper), speed[tree.free_joints])

    def _put(self, value: Array, rate: Array) -> None:
        """Set value and speed of every joint from those, (F,) each, that can be chosen."""
        self._value, self._rate = value, rate
        self.body.put(self._follow @ value + self._offset, self._follow @ rate)

    @property
    def state(self) -> Array:
        """(K,) joint states, radians or metres; the root's is 0."""
        values = self._follow @ self._value + self._offset
        return self.obj.tree.rest + np.append(0.0, values[self._measured])

    @property
    def velocity(self) -> Array:
        """(K,) speeds of the joints, rad/s or m/s; the root's is 0."""
        return np.append(0.0, (self._follow @ self._rate)[self._measured])

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
        efforts, target, strength = np.zeros(len(self._follow)), np.zeros(len(self._follow)), self._friction.copy()
        if control == "velocity":
            target[self._driven], strength[self._driven] = wanted, self.effort_limit
        for _ in range(self.options.substeps):
            if control == "effort":
                slow = self._rate * np.sign(wanted) <= self.velocity_limit
                efforts[self._driven] = np.where(slow, wanted, 0.0)
            self._advance(efforts, target, strength)

    def _advance(self, efforts: Array, target: Array, strength: Array) -> None:
        """One time step under efforts, (J,), with joints held at target speeds as far as strengths go, (J,) each."""
        time_step, follow, pushed = self.options.time_step, self._follow, np.sign(efforts[self._driven])
        if self._latched:
            values, efforts = follow @ self._value + self._offset, efforts.copy()
            for j, joint in self._latched:
                efforts[j] += joint.held(float(values[j]))
        free, mass = self.body.advance(efforts)
        if not len(self._driven):
            return
        pulled = follow.T @ mass
        # Springs act as they stand at the end of the step: stiff ones on light parts stay calm.
        momentum = pulled @ free - time_step * (self._spring @ self._value)
        mass = pulled @ follow + time_step * self._damping + time_step**2 * self._spring
        rate = held_speeds(mass, momentum, follow, target, time_step * strength)
        # What drives a light knob past its velocity limit within one step has let go of it by then.
        most = np.maximum(pushed * self._rate, self.velocity_limit)
        rate = np.where((pushed != 0.0) & (pushed * rate > most), pushed * most, rate)
        value = self._value + time_step * rate
        inside = np.clip(value, self._lower, self._upper)
        stopped = (value != inside) & ((value - inside) * rate > 0)
        if stopped.any():
            moves = ~stopped
            # The impulses of friction and motors are those of this step; the stop adds its own.
            momentum, rate = mass @ rate, np.where(moves, rate, 0.0)
            rate[moves] = np.linalg.solve(mass[np.ix_(moves, moves)], momentum[moves])
        self._put(inside, rate)


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
