"""What a variation has to hold: the gates that its original passes, no new collisions, and no parts that float."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from artsim.checks.validity import check
from artsim.common.extras import require_extra
from artsim.model.collision import Sweep, surface_model
from artsim.model.draws import joint_intervals
from artsim.model.objects import ArticulatedObject

with require_extra("collision checks"):
    import fcl

_COLLISIONS = "collision free"
_NEW_COLLISIONS, _FLOATING = "no new collisions", "no floating parts"
_GAP, _GROWTH = 0.003, 1.7
"""A part may be that many diagonals farther from its parent than in the original, whose gaps may grow so much."""


@dataclass(frozen=True)
class Standard:
    """What an object passes, and its variations have to."""

    gates: tuple[str, ...]
    """Gates of :func:`artsim.checks.check` that it passes."""
    colliding: frozenset[tuple[str, str]]
    """Parts, by name, that run into each other although no joint connects them: surfaces of real objects often do. No
    other two parts of a variation may."""
    gaps: dict[str, float]
    """How far each part, by name, is from its parent at rest and at both ends of its joint, at most, in diagonals. No
    part of a variation may float farther from it."""

    @staticmethod
    def of(obj: ArticulatedObject) -> Standard:
        """The standard that an object sets."""
        passed = tuple(gate.name for gate in check(obj) if gate.passed)
        return Standard(passed, frozenset() if _COLLISIONS in passed else colliding_parts(obj), part_gaps(obj))

    def failed(self, obj: ArticulatedObject) -> list[str]:
        """What a variation fails of it: names of gates, ``no new collisions``, ``no floating parts``."""
        failed = [gate.name for gate in check(obj, self.gates) if not gate.passed]
        if _COLLISIONS not in self.gates and colliding_parts(obj) - self.colliding:
            failed.append(_NEW_COLLISIONS)
        if any(gap > _GROWTH * self.gaps.get(name, np.inf) + _GAP for name, gap in part_gaps(obj).items()):
            failed.append(_FLOATING)
        return failed


def colliding_parts(obj: ArticulatedObject) -> frozenset[tuple[str, str]]:
    """Names of parts that run into each other in some state although no joint connects them."""
    found = ((obj.parts[i].name, obj.parts[j].name) for i, j in (c.parts for c in Sweep(obj).collisions()))
    return frozenset((min(pair), max(pair)) for pair in found)


def part_gaps(obj: ArticulatedObject) -> dict[str, float]:
    """Largest distance of each part's surface from its parent's, at rest and at both ends of its joint, in diagonals.

    Parts without a surface, or whose parent has none, are left out.
    """
    tree, models = obj.tree, [surface_model(obj, k) for k in range(len(obj))]
    intervals = joint_intervals(obj)
    gaps = {}
    for k in range(1, len(obj)):
        parent = int(tree.parents[k])
        if models[k] is None or models[parent] is None:
            continue
        states = np.repeat(tree.rest[None], 3, axis=0)
        states[1:, k] = intervals[k]
        T = tree.forward_kinematics(states)
        gaps[obj.parts[k].name] = max(
            _distance(models[parent], models[k], np.linalg.inv(T[n, parent]) @ T[n, k]) / obj.diagonal for n in range(3)
        )
    return gaps


def _distance(first: fcl.BVHModel, second: fcl.BVHModel, T_first_second: np.ndarray) -> float:
    """Distance of two surfaces, metres; 0 where they cross."""
    here = fcl.CollisionObject(first, fcl.Transform())
    there = fcl.CollisionObject(second, fcl.Transform(T_first_second[:3, :3], T_first_second[:3, 3]))
    return max(0.0, float(fcl.distance(here, there, fcl.DistanceRequest(), fcl.DistanceResult())))
