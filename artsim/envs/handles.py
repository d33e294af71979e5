"""Handles and the joints that they move: B of them at once, each of another object, under the forces of B hands.

One joint moves in each object; what hangs on it is carried along, and the others stand still. Inertia, gravity,
damping, friction, springs, latches and stops are those of :class:`artsim.physics.Simulation` and of the exported files.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from artsim.model.convex_bodies import add_bodies
from artsim.model.details import GRIPS, DetailFrame
from artsim.model.inertia import combine_inertias
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.model.robot import GRAVITY, LinkJoint, as_robot

STIFFNESS, DAMPING = 600.0, 40.0
"""N/m and N s/m between a hand and what it holds: those of an arm under impedance control."""
GRIP = 70.0
"""Newtons at which fingers slip off: the force of the Franka Hand."""
_TIME_STEP = 1 / 120
"""Seconds; what is stiff is treated implicitly."""


@dataclass(frozen=True, eq=False)
class Handle:
    """A handle of a part, and the joint that it moves; (3,) in the object's rest frame, metres."""

    obj: ArticulatedObject
    detail: DetailFrame
    joint: LinkJoint
    """Turned so that it opens towards positive states."""
    origin: Array
    """Of the joint."""
    center: Array
    """Of the mass that it carries, at rest."""
    mass: float
    parts: tuple[int, ...]
    """That move."""

    @property
    def place(self) -> Array:
        """Its middle, at rest."""
        place: Array = self.detail.T_rest_detail[:3, 3]
        return place

    def object_state(self, q: float) -> Array:
        """(K,) state of the object at rest but for this joint, which is open by q."""
        k, tree = self.detail.part, self.obj.tree
        state = tree.rest.copy()
        state[k] += q if np.dot(tree.axes[k], self.joint.axis) > 0 else -q
        return state

    @property
    def lever(self) -> float:
        """Metres that it moves at rest for each radian, or metre, of its joint."""
        if self.joint.type == "prismatic":
            return 1.0
        return float(np.linalg.norm(np.cross(self.joint.axis, self.place - self.origin)))


def find_handles(obj: ArticulatedObject) -> list[Handle]:
    """Handles, knobs and latches of parts whose joint has two ends, follows no other, and is followed by none."""
    robot = as_robot(add_bodies(obj))
    followed = {joint.mimic[0] for joint in robot.joints if joint.mimic is not None}
    found = []
    for joint in robot.joints:
        part = robot.links[joint.child].part
        coupled = joint.mimic is not None or joint.name in followed
        if coupled or joint.type == "continuous" or not 0.0 < joint.upper - joint.lower < np.inf:
            continue
        carried = [joint.child]
        for other in robot.joints:  # parents stand before children
            carried += [other.child] if other.parent in carried else []
        body = combine_inertias(robot.links[link].inertia for link in carried)
        parts = tuple(sorted({robot.links[link].part for link in carried}))
        opening = joint
        if -joint.lower > joint.upper:
            opening = replace(joint, axis=-joint.axis, lower=-joint.upper, upper=-joint.lower)
        origin = robot.links[joint.child].origin
        made = [
            Handle(obj, detail, opening, origin, body.center, body.mass, parts)
            for detail in obj.details
            if detail.part == part and detail.label in GRIPS
        ]
        found += [handle for handle in made if handle.lever > 1e-3]
    return found


class HeldJoints:
    """The joints of B handles under B hands.

    Parameters
    ----------
    handles : sequence of Handle

    Attributes
    ----------
    q, speed : (B,) float
        Radians or metres, 0 at rest and positive where it is open; and their rates.
    reach : (B,) float
        State of the joint when open.
    hand : (B, 3) float
        Where the hands are, rest frames, metres.
    holds : (B,) bool
    force : (B, 3) float
        That hands exert, newtons.
    """

    def __init__(self, handles: Sequence[Handle]):
        def stacked(name: str) -> Array:
            return np.array([getattr(handle.joint, name) for handle in handles], dtype=np.float64)

        self._axis, self.reach, self._low = stacked("axis"), stacked("upper"), stacked("lower")
        self._inertia, self._damping, self._friction = stacked("inertia"), stacked("damping"), stacked("friction")
        self._spring, self._hold, self._hold_over = stacked("spring"), stacked("hold"), stacked("hold_over")
        self._slides = np.array([handle.joint.type == "prismatic" for handle in handles])[:, None]
        self._origin = np.array([handle.origin for handle in handles])
        self._place = np.array([handle.place for handle in handles])
        self._center = np.array([handle.center for handle in handles])
        self._weight = GRAVITY * np.array([handle.mass for handle in handles])
        self.q, self.speed = np.zeros(len(handles)), np.zeros(len(handles))
        self.hand, self._offset = self._place.copy(), np.zeros((len(handles), 3))
        self.holds, self.force = np.zeros(len(handles), dtype=bool), np.zeros((len(handles), 3))

    def carried(self, points: Array, q: Array) -> Array:
        """Where points (B, 3) of the moving parts at rest are in states (B,)."""
        arm = points - self._origin
        along = (arm * self._axis).sum(axis=1, keepdims=True) * self._axis
        sine, cosine = np.sin(q)[:, None], np.cos(q)[:, None]
        turned = self._origin + along + cosine * (arm - along) + sine * np.cross(self._axis, arm)
        there: Array = np.where(self._slides, points + q[:, None] * self._axis, turned)
        return there

    def lever(self, points: Array) -> Array:
        """(B, 3) velocity of moving points (B, 3) for a joint speed of 1."""
        lever: Array = np.where(self._slides, self._axis, np.cross(self._axis, points - self._origin))
        return lever

    @property
    def place(self) -> Array:
        """(B, 3) where the handles are."""
        return self.carried(self._place, self.q)

    def grasp(self, chosen: NDArray[np.bool_]) -> None:
        """Close some hands (B,) where they are, each on its handle."""
        fresh = chosen & ~self.holds
        self._offset[fresh] = (self.hand - self.place)[fresh]
        self.holds = self.holds | chosen

    def held_place(self, q: Array) -> Array:
        """(B, 3) where hands that exert no force are when their joints are in states (B,)."""
        return self.carried(self._place, q) + self._offset

    def move(self, velocity: Array, seconds: float) -> None:
        """Move hands at (B, 3) m/s; what they hold follows, and slips off where it takes more than ``GRIP``."""
        dt = seconds / max(1, round(seconds / _TIME_STEP))
        for _ in range(round(seconds / dt)):
            self.hand = self.hand + dt * velocity
            there = self.place
            lever = self.lever(there) * self.holds[:, None]
            pull = STIFFNESS * (self.hand - self._offset - there)
            weight = -self._weight * self.lever(self.carried(self._center, self.q))[:, 2]
            latch = np.where((self.q >= 0) & (self.q < self._hold_over), self._hold, 0.0)
            latch = latch * (1.0 - self.q / np.maximum(self._hold_over, 1e-9))
            effort = (lever * (pull + DAMPING * velocity)).sum(axis=1) + weight - self._spring * self.q - latch
            square = (lever * lever).sum(axis=1)
            lost = dt * (self._damping + DAMPING * square) + dt * dt * (self._spring + STIFFNESS * square)
            momentum = self._inertia * self.speed + dt * effort
            slowed = np.sign(momentum) * np.maximum(np.abs(momentum) - dt * self._friction, 0.0)
            self.speed = slowed / (self._inertia + lost)
            q = np.clip(self.q + dt * self.speed, self._low, self.reach)
            self.speed = np.where(q == self.q + dt * self.speed, self.speed, 0.0)
            self.q = q
            apart = STIFFNESS * (self.hand - self.held_place(self.q)) + DAMPING * (
                velocity - lever * self.speed[:, None]
            )
            self.force = apart * self.holds[:, None]
            self.holds = self.holds & (np.linalg.norm(self.force, axis=1) <= GRIP)
