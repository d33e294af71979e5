"""Sim-readiness gates: checks that an object can be handed to a simulator as it is.

Every gate fails closed: what cannot be checked has failed.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from artsim.checks.strict_urdf import (
    convex_collision_geometry,
    strict_inertia,
    strict_kinematics,
    strict_urdf,
)
from artsim.errors import ArtsimError
from artsim.loading.object_files import find_urdf, is_urdf
from artsim.model.collision import Collision, Sweep
from artsim.model.convex_bodies import is_convex
from artsim.model.objects import ArticulatedObject
from artsim.model.part_inertia import part_inertia

_SHOWN = 5


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
        shown = "; ".join(self.problems[:_SHOWN])
        more = f"; and {len(self.problems) - _SHOWN} more" if len(self.problems) > _SHOWN else ""
        return f"{self.name}: {shown}{more}" if self.problems else f"{self.name}: passed"


def check(obj: ArticulatedObject, names: Collection[str] | None = None) -> list[Gate]:
    """All gates of a procedural object that need no file, or those of these names.

    The physics is that of the parts' bodies.
    """
    physics = {"convex collision geometry": lambda: _collision_geometry(obj), "inertia": lambda: _inertia(obj)}
    gates = {**_geometry(obj), **physics}
    return _run({name: gate for name, gate in gates.items() if names is None or name in names})


def check_file(
    obj: ArticulatedObject, path: str | Path, package_roots: Mapping[str, str | Path] | None = None
) -> list[Gate]:
    """All gates of an object and the file that it was loaded from, or exported to: the physics is the file's.

    Package roots are those that it was loaded with. Of MJCF and USD files, the physics is that of the parts' bodies.

    :mod:`artsim.physics.simulators` adds a look by three simulators.
    """
    if not is_urdf(find_urdf(Path(path))):
        return check(obj)
    return _run(
        {
            "strict URDF": lambda: strict_urdf(path, package_roots),
            **_geometry(obj),
            "convex collision geometry": lambda: convex_collision_geometry(path, package_roots),
            "inertia": lambda: strict_inertia(path),
        }
    )


def _geometry(obj: ArticulatedObject) -> dict[str, Callable[[], list[str]]]:
    sweep = Sweep(obj)
    return {
        "kinematics": lambda: strict_kinematics(obj),
        "collision free": lambda: [_say(obj, c) for c in sweep.collisions()],
        "joined parts apart": lambda: [_say(obj, c) for c in sweep.joined_overlaps()],
        "watertight": lambda: [f"{obj.parts[k].name} is not closed" for k in np.flatnonzero(~sweep.watertight)],
    }


def _run(gates: dict[str, Callable[[], list[str]]]) -> list[Gate]:
    return [Gate(name, tuple(_run_gate(gate))) for name, gate in gates.items()]


def _run_gate(gate: Callable[[], list[str]]) -> list[str]:
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
        elif not all(is_convex(vertices, faces) for vertices, faces in part.body.pieces):
            problems.append(f"{part.name} has pieces that are not convex")
    return problems


def _inertia(obj: ArticulatedObject) -> list[str]:
    problems = []
    for k, part in enumerate(obj.parts):
        inertia = part_inertia(obj, k)
        moments = np.linalg.eigvalsh(inertia.tensor)
        possible = moments[0] > 0 and moments[2] <= (moments[0] + moments[1]) * (1 + 1e-9)
        if not (inertia.mass > 0 and possible):
            problems.append(f"{part.name} has mass {inertia.mass:.3g} kg, principal moments {moments}")
    return problems
