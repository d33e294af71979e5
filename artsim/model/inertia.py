"""Mass, centre of mass and inertia of parts, from their closed surface and the density of what they are made of."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from artsim.common.products import apply, dot, matmul
from artsim.model.kinematics import Array


@dataclass(frozen=True, eq=False)
class Inertia:
    """What a rigid body opposes to being pushed and turned."""

    mass: float
    """kg."""
    center: Array
    """(3,) float. Centre of mass in the rest frame, at rest, metres."""
    tensor: Array
    """(3, 3) float. About the centre of mass, along the axes of the rest frame, kg m^2."""

    def about(self, point: Array, axis: Array) -> float:
        """Moment of inertia about an axis (unit, (3,)) through a point, kg m^2."""
        arm = np.cross(axis, self.center - point)
        return float(dot(axis, apply(self.tensor, axis)) + self.mass * dot(arm, arm))

    def principal(self) -> tuple[Array, Array]:
        """Moments (3,), ascending, about the principal axes, and these axes (3, 3): right-handed, one a column."""
        moments, axes = np.linalg.eigh(self.tensor)
        axes[:, 2] *= np.sign(np.linalg.det(axes))
        return moments, axes

    def share(self, fraction: float) -> Inertia:
        """A fraction of the body's mass, spread in space as the whole is."""
        return Inertia(fraction * self.mass, self.center, fraction * self.tensor)

    def scaled(self, scale: float) -> Inertia:
        """Of a body of the same density, ``scale`` times as large."""
        return Inertia(scale**3 * self.mass, scale * self.center, scale**5 * self.tensor)

    def transformed(self, T_new_old: Array) -> Inertia:
        """The same body's in another frame, by a rigid transform (4, 4)."""
        turn = T_new_old[:3, :3]
        center = apply(turn, self.center) + T_new_old[:3, 3]
        return Inertia(self.mass, center, matmul(matmul(turn, self.tensor), turn.T))


def combine_inertias(inertias: Iterable[Inertia]) -> Inertia:
    """Several bodies as one (parallel axis theorem)."""
    bodies = list(inertias)
    mass = sum(body.mass for body in bodies)
    center = np.sum([body.mass * body.center for body in bodies], axis=0) / mass
    tensor = np.zeros((3, 3))
    for body in bodies:
        arm = body.center - center
        tensor += body.tensor + body.mass * (dot(arm, arm) * np.eye(3) - np.outer(arm, arm))
    return Inertia(mass, center, tensor)
