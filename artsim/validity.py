"""Sim-readiness gates: checks that an object can be handed to a simulator as it is.

Every gate fails closed: what cannot be checked has failed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from artsim.collision import Collision, Sweep
from artsim.errors import ArtsimError
from artsim.inertia import mass_properties
from artsim.kinematics import Array
from artsim.objects import ArticulatedObject
from artsim.strict import strict_kinematics

CONVEX = 1e-6
"""Share of its hull's volume by which a collision piece may fall short of it."""


@dataclass(frozen=True)
class Gate:
    """Outcome of one check.

    Attributes
    ----------
    name : str
    problems : tuple of str
        Empty when the object has passed.
    """

    name: str
    problems: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether nothing was found."""
        return not self.problems

    def __str__(self) -> str:
        return f"{self.name}: {'passed' if self.passed else '; '.join(self.problems)}"


def check(obj: ArticulatedObject) -> list[Gate]:
    """All gates that need nothing but the object.

    Those that read its URDF file are in :mod:`artsim.strict`, those that load it into simulators in
    :mod:`artsim.simulators`.
    """
    sweep = Sweep(obj)
    gates: dict[str, Callable[[], list[str]]] = {
        "kinematics": lambda: strict_kinematics(obj),
        "collision free": lambda: [_say(obj, c) for c in sweep.collisions()],
        "joined parts apart": lambda: [_say(obj, c) for c in sweep.joined_overlaps()],
        "watertight": lambda: [f"{obj.parts[k].name} is not closed" for k in np.flatnonzero(~sweep.watertight)],
        "convex collision geometry": lambda: _collision_geometry(obj),
        "inertia": lambda: _inertia(obj),
    }
    return [Gate(name, tuple(_closed(gate))) for name, gate in gates.items()]


def _closed(gate: Callable[[], list[str]]) -> list[str]:
    """The problems a gate finds; an error is one."""
    try:
        return gate()
    except (ArtsimError, ValueError, RuntimeError) as error:
        return [f"cannot be checked ({error})"]


def _say(obj: ArticulatedObject, collision: Collision) -> str:
    i, j = collision.parts
    depth = f" by {1e3 * collision.depth:.3g} mm" if np.isfinite(collision.depth) else ""
    moved = np.flatnonzero(np.abs(collision.state - obj.tree.rest) > 1e-9)
    state = ", ".join(f"{obj.parts[k].name} = {collision.state[k]:.3g}" for k in moved) or "rest"
    return f"{obj.parts[i].name} and {obj.parts[j].name} overlap{depth} at {state}"


def _collision_geometry(obj: ArticulatedObject) -> list[str]:
    problems = []
    for part in obj.parts:
        if part.body is None or not part.body.pieces:
            problems.append(f"{part.name} has none")
        elif not all(_is_convex(vertices, faces) for vertices, faces in part.body.pieces):
            problems.append(f"{part.name} has pieces that are not convex")
    return problems


def _is_convex(vertices: Array, faces: Array) -> bool:
    corners = (vertices - vertices[0])[faces]
    volume = np.einsum("ni,ni->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    try:
        whole = ConvexHull(vertices - vertices[0]).volume
    except QhullError:  # flat
        return False
    return bool(volume >= (1.0 - CONVEX) * whole)


def _inertia(obj: ArticulatedObject) -> list[str]:
    problems = []
    for part in obj.parts:
        if part.body is None:
            problems.append(f"{part.name} has no density")
            continue
        properties = mass_properties(part)
        moments = np.linalg.eigvalsh(properties.inertia)
        if not (properties.mass > 0 and moments[0] > 0 and moments[2] <= moments[0] + moments[1] * (1 + 1e-9)):
            problems.append(f"{part.name} has mass {properties.mass:.3g} kg, principal moments {moments}")
    return problems
