"""Serial chains that never touch themselves: joint limits narrowed until all links keep clear of one another."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from artsim.common.elementary import cos
from artsim.common.products import dot, matmul, norm, unit
from artsim.making.assembly import JointSpec
from artsim.making.draws import Rng
from artsim.making.outlines import Vector
from artsim.making.solids import Solid, cylinder
from artsim.model.joints import Joint
from artsim.model.kinematics import Array, KinematicTree

Index = NDArray[np.int64]

_STATES = 256
_DESCENTS = 4
_ROUNDS = 30


@dataclass
class Link:
    """A link of a serial chain under construction."""

    name: str
    joint: JointSpec | None = None  # to the link before
    # Share of its limits that the joint keeps when two links come too close; nearly 1 for a joint that turns about the
    # link's own direction, as that matters little.
    narrowing: float = 0.8
    solid: Solid = field(default_factory=Solid)
    capsules: list[Array] = field(default_factory=list)  # (7,): start, end, radius of rods around the solid, at rest

    def rod(self, start: Vector, end: Vector, radius: float, end_radius: float | None = None) -> None:
        """Add a round rod to the solid, and the capsule around it."""
        self.solid += cylinder(start, end, radius, end_radius, 20)
        self.guard(start, end, max(radius, end_radius or 0.0))

    def guard(self, start: Vector, end: Vector, radius: float) -> None:
        """Add the capsule around a rod with flat ends: 0.6 radii shorter at either end, and 17 % thicker."""
        start, end = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
        length = float(norm(end - start))
        inset = min(0.6 * radius, 0.5 * length) / max(length, 1e-9) * (end - start)
        self.capsules.append(np.array([*(start + inset), *(end - inset), 1.17 * radius]))


def narrow_limits(links: list[Link], margin: float) -> bool:
    """Narrow the limits of a chain's joints until links that no joint connects keep ``margin`` metres apart.

    Each link but the root hangs on the one before it; their joints are replaced. Tested in fixed random states, every
    other one with most joints close to a limit or at it, and in states around the closest of those, again and again.
    Two links that are close at rest may come closer: to half their distance at rest. False when capsules touch at rest.
    """
    pairs = _Pairs(links)
    if not pairs.first.size:
        return True
    wanted = np.minimum(margin, 0.5 * pairs.gaps(np.zeros((1, len(links)))))
    if wanted.min() <= 0:
        return False
    rng = np.random.default_rng(0)
    unit = rng.random((_STATES, len(links)))
    unit[::2] = 0.5 - 0.5 * cos(np.pi * unit[::2])
    unit[::4] = np.round(unit[::4])
    for _ in range(_ROUNDS):
        bounds = np.array([_interval(link.joint) for link in links])
        tight = _tight_pairs(pairs, wanted, bounds, unit, rng)
        if not tight.any():
            return True
        for k in pairs.joints_between(tight):
            joint = links[k].joint
            assert joint is not None
            if np.isfinite(joint.lower):
                share = links[k].narrowing
                links[k].joint = replace(joint, lower=share * joint.lower, upper=share * joint.upper)
    return False


def _tight_pairs(pairs: _Pairs, wanted: Array, bounds: Array, unit: Array, rng: Rng) -> NDArray[np.bool_]:
    """(P,) which pairs come closer than wanted; ``unit`` is the share of its range that each joint goes first."""
    for step in range(_DESCENTS + 1):
        spare = pairs.gaps(bounds[:, 0] + unit * (bounds[:, 1] - bounds[:, 0])) - wanted
        tight: NDArray[np.bool_] = np.any(spare < 0, axis=0)
        if tight.any() or step == _DESCENTS:
            break
        closest = unit[np.argsort(spare.min(axis=1), kind="stable")[:24]]
        near = np.repeat(closest, 8, axis=0)
        unit = np.clip(near + rng.normal(0.0, 0.25 / (step + 1), near.shape), 0.0, 1.0)
    return tight


def _interval(joint: JointSpec | None) -> tuple[float, float]:
    if joint is None:
        return 0.0, 0.0
    return (joint.lower, joint.upper) if np.isfinite(joint.lower) else (-np.pi, np.pi)


class _Pairs:
    """Pairs (P,) of capsules, ``first`` and ``second``, on links that no joint connects."""

    def __init__(self, links: list[Link]):
        owner = np.repeat(np.arange(len(links)), [len(link.capsules) for link in links])
        self.capsules = np.array([c for link in links for c in link.capsules])
        self.first, self.second = np.nonzero(owner[:, None] + 1 < owner)
        self.owner = owner
        joints = [Joint("root", "free", -1)]
        for k, link in enumerate(links[1:], 1):
            assert link.joint is not None
            x, y, z = unit(link.joint.axis).tolist()
            ox, oy, oz = (float(v) for v in link.joint.origin)
            joints.append(Joint(link.name, link.joint.type, k - 1, (x, y, z), (ox, oy, oz), -np.inf, np.inf))
        self.tree = KinematicTree(joints)

    def joints_between(self, chosen: NDArray[np.bool_]) -> set[int]:
        """Joints between the two links of any chosen pair."""
        ends = zip(self.owner[self.first[chosen]], self.owner[self.second[chosen]], strict=True)
        return {k for a, b in ends for k in range(a + 1, b + 1)}

    def gaps(self, states: Array) -> Array:
        """(S, P) distances in S states, in metres; negative where two capsules overlap."""
        T = self.tree.forward_kinematics(states)[:, self.owner]
        ends = np.stack([self.capsules[:, :3], self.capsules[:, 3:6]], axis=-1)
        points = matmul(T[..., :3, :3], ends) + T[..., :3, 3:]
        start, end = points[..., 0], points[..., 1]
        radius = self.capsules[:, 6]
        middle = _segment_distance(start, end - start, self.first, self.second)
        gaps: Array = middle - radius[self.first] - radius[self.second]
        return gaps


def _segment_distance(start: Array, along: Array, first: Index, second: Index) -> Array:
    """(S, P) distances of pairs of segments, which are (S, N, 3) start points and vectors to their ends."""
    u, v, w = along[:, first], along[:, second], start[:, first] - start[:, second]
    length = np.maximum(dot(along, along), 1e-12)
    uu, vv = length[:, first], length[:, second]
    uv, uw, vw, ww = (dot(a, b) for a, b in ((u, v), (u, w), (v, w), (w, w)))
    s = np.clip((uv * vw - vv * uw) / np.maximum(uu * vv - uv * uv, 1e-12), 0.0, 1.0)
    t = np.clip((uv * s + vw) / vv, 0.0, 1.0)
    s = np.clip((uv * t - uw) / uu, 0.0, 1.0)
    squared = ww + s * (s * uu + 2.0 * uw - 2.0 * t * uv) + t * (t * vv - 2.0 * vw)
    distance: Array = np.sqrt(np.maximum(squared, 0.0))
    return distance
