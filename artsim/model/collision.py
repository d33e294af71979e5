"""Do parts of an object run into each other? Surfaces tested over the joint range, overlaps measured exactly."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from manifold3d import Error, Manifold, Mesh64
from numpy.typing import NDArray
from scipy.stats import qmc

from artsim.common.extras import require_extra
from artsim.model.draws import joint_intervals
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject

with require_extra("collision checks"):
    import fcl

PENETRATION = 1e-6
"""Metres by which parts that no joint connects may overlap."""
JOINED_OVERLAP = 1e-3
"""Share of the smaller part's volume by which two parts that a joint connects may overlap."""
STATES_PER_JOINT = 21
JOINT_STATES = 64


@dataclass(frozen=True)
class Collision:
    """Two parts that overlap."""

    parts: tuple[int, int]
    state: Array
    """(K,) float."""
    depth: float
    """Mean thickness of the overlap in metres; infinite where a surface is not closed, so that it has none."""


def sweep_states(obj: ArticulatedObject) -> Array:
    """(S, K) states: at rest, 21 over the range of each joint with the others at rest, 64 Sobol states of all joints.

    Limits are kept; a joint without limits makes a whole turn.
    """
    tree = obj.tree
    free = tree.free_joints
    intervals = joint_intervals(obj)
    states = [tree.rest[None]]
    for k in free:
        along = np.repeat(tree.rest[None], STATES_PER_JOINT, axis=0)
        along[:, k] = np.linspace(intervals[k, 0], intervals[k, 1], STATES_PER_JOINT)
        states.append(along)
    if len(free):
        together = np.repeat(tree.rest[None], JOINT_STATES, axis=0)
        unit = qmc.Sobol(len(free), rng=0).random(JOINT_STATES)
        together[:, free] = intervals[free, 0] + unit * (intervals[free, 1] - intervals[free, 0])
        states.append(together)
    return tree.complete_state(np.concatenate(states))


class Sweep:
    """The parts of an object, made ready to be tested for overlap in many states.

    Surfaces are tested triangle by triangle (FCL); where two of them cross, the overlap is measured exactly
    (manifold3d): its mean thickness is twice its volume over its surface.
    """

    def __init__(self, obj: ArticulatedObject):
        self.obj = obj
        self.solids = [_manifold(obj, k) for k in range(len(obj))]
        self._surfaces = [surface_model(obj, k) for k in range(len(obj))]

    @property
    def watertight(self) -> NDArray[np.bool_]:
        """(K,) whether each part's surface is closed, consistently oriented and encloses a volume."""
        return np.array([_volume(solid) > 0 for solid in self.solids])

    @cached_property
    def joined(self) -> set[tuple[int, int]]:
        """Pairs of parts that a joint connects."""
        return {(int(self.obj.tree.parents[k]), k) for k in range(1, len(self.obj))}

    def collisions(self, states: Array | None = None) -> Iterator[Collision]:
        """Overlaps of parts that no joint connects, deeper than ``PENETRATION``; at most one for each pair."""
        pairs = [pair for pair in combinations(range(len(self.obj)), 2) if pair not in self.joined]
        return self._overlaps(pairs, states, lambda pair, volume, depth: depth > PENETRATION)

    def added_overlaps(self, own: Sweep, depth: float, states: Array | None = None) -> Iterator[Collision]:
        """Overlaps of these surfaces deeper than ``depth`` in states in which those of ``own`` do not cross.

        Any pair of parts counts; at most one overlap for each. ``own`` is the same object with other surfaces.
        """
        pairs = list(combinations(range(len(self.obj)), 2))
        return self._overlaps(pairs, states, lambda pair, volume, deep: deep > depth, own)

    def joined_overlaps(self, states: Array | None = None) -> Iterator[Collision]:
        """Overlaps of parts that a joint connects, larger than ``JOINED_OVERLAP``; at most one for each pair."""

        def too_much(pair: tuple[int, int], volume: float, depth: float) -> bool:
            smaller = min(_volume(self.solids[pair[0]]), _volume(self.solids[pair[1]]))
            return not volume <= JOINED_OVERLAP * smaller

        return self._overlaps(sorted(self.joined), states, too_much)

    def _overlaps(
        self,
        pairs: Sequence[tuple[int, int]],
        states: Array | None,
        matters: Callable[[tuple[int, int], float, float], bool],
        unless: Sweep | None = None,
    ) -> Iterator[Collision]:
        states = sweep_states(self.obj) if states is None else states
        T = self.obj.tree.forward_kinematics(states)
        low, high = _posed_boxes(self.obj, T)
        for i, j in pairs:
            if self._surfaces[i] is None or self._surfaces[j] is None:
                continue
            near = ((low[:, i] <= high[:, j]) & (low[:, j] <= high[:, i])).all(axis=1).nonzero()[0]
            relative = np.linalg.inv(T[near, i]) @ T[near, j]
            _, first = np.unique(np.round(relative, 9).reshape(len(near), 16), axis=0, return_index=True)
            for n in np.sort(first):  # states in which the two stand differently to each other
                # Closed solids are compared at rest even if no surfaces cross: one may lie inside the other.
                solid = self.solids[i] is not None and self.solids[j] is not None
                if not (near[n] == 0 and solid) and not self._crossing(i, j, relative[n]):
                    continue
                if unless is not None and unless._crossing(i, j, relative[n]):
                    continue
                volume, depth = self._overlap(i, j, relative[n])
                if matters((i, j), volume, depth):
                    yield Collision((i, j), states[near[n]], depth)
                    break

    def _crossing(self, i: int, j: int, T_i_j: Array) -> bool:
        """Whether two surfaces cross."""
        here = fcl.CollisionObject(self._surfaces[i], fcl.Transform())
        there = fcl.CollisionObject(self._surfaces[j], fcl.Transform(T_i_j[:3, :3], T_i_j[:3, 3]))
        return bool(fcl.collide(here, there, fcl.CollisionRequest(), fcl.CollisionResult()))

    def _overlap(self, i: int, j: int, T_i_j: Array) -> tuple[float, float]:
        """Volume and mean thickness of an overlap; NaN and infinite where a surface is not closed."""
        first, second = self.solids[i], self.solids[j]
        if first is None or second is None:
            return np.nan, np.inf
        overlap = first ^ second.transform(T_i_j[:3])
        volume = overlap.volume()
        return volume, 2.0 * volume / max(overlap.surface_area(), 1e-300)


def _posed_boxes(obj: ArticulatedObject, T: Array) -> tuple[Array, Array]:
    """(S, K, 3) lower and upper corners of boxes around the posed parts' own boxes."""
    center, half = obj.box_center, 0.5 * obj.box_size
    middle = (T[..., :3, :3] @ center[..., None])[..., 0] + T[..., :3, 3]
    reach = (np.abs(T[..., :3, :3]) @ half[..., None])[..., 0]
    return middle - reach, middle + reach


def surface_model(obj: ArticulatedObject, k: int) -> fcl.BVHModel | None:
    """Part k's triangles as FCL takes them, rest frame, metres; None for a part without geometry."""
    part = obj.parts[k]
    if len(part.faces) == 0:
        return None
    model = fcl.BVHModel()
    model.beginModel(len(part.vertices), len(part.faces))
    model.addSubModel(part.vertices * obj.scale, part.faces.astype(np.int64))
    model.endModel()
    return model


def _manifold(obj: ArticulatedObject, k: int) -> Manifold | None:
    """The part as an exact solid; None where its surface is not closed."""
    part = obj.parts[k]
    if len(part.faces) == 0:
        return None
    solid = Manifold(Mesh64(part.vertices * obj.scale, part.faces.astype(np.uint64)))
    return solid if solid.status() == Error.NoError and not solid.is_empty() else None


def _volume(solid: Manifold | None) -> float:
    return np.nan if solid is None else float(solid.volume())
