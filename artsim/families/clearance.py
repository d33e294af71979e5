"""Serial chains that never touch themselves: joint limits narrowed until all links keep clear of one another."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from artsim.assembly import JointSpec
from artsim.kinematics import Array, Joint, KinematicTree
from artsim.solids import Solid, Vector, cylinder

_STATES = 384
_ROUNDS = 40
_NARROW = 0.88
_NARROW_ROLL = 0.97


@dataclass
class Link:
    """A link of a serial chain under construction.

    Attributes
    ----------
    name : str
    joint : JointSpec or None
        To the link before; None for the first.
    solid : Solid
    capsules : list of (7,) float
        Start, end and radius of rods around the solid, in the assembly's frame at rest.
    """

    name: str
    joint: JointSpec | None = None
    solid: Solid = field(default_factory=Solid)
    capsules: list[Array] = field(default_factory=list)

    def rod(self, start: Vector, end: Vector, radius: float, end_radius: float | None = None) -> None:
        """Add a round rod to the solid, and the capsule around it."""
        self.solid += cylinder(start, end, radius, end_radius, 20)
        self.guard(start, end, max(radius, end_radius or 0.0))

    def guard(self, start: Vector, end: Vector, radius: float) -> None:
        """Add the capsule around a rod with flat ends: 0.6 radii shorter at either end, and 17 % thicker."""
        start, end = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
        length = float(np.linalg.norm(end - start))
        inset = min(0.6 * radius, 0.5 * length) / max(length, 1e-9) * (end - start)
        self.capsules.append(np.array([*(start + inset), *(end - inset), 1.17 * radius]))


def narrow_limits(links: list[Link], margin: float) -> None:
    """Narrow the limits of a chain's joints until links that no joint connects keep clear of one another.

    Tested in fixed quasi-random states, every other one with most joints close to a limit. Two links that are close
    at rest may be closer than ``margin``: half their distance at rest.

    Parameters
    ----------
    links : list of Link
        The first is the root, each of the others hangs on the one before it. Their joints are replaced.
    margin : float
        Metres between the capsules.
    """
    owner = np.repeat(np.arange(len(links)), [len(link.capsules) for link in links])
    capsules = np.array([c for link in links for c in link.capsules])
    first, second = np.nonzero(owner[:, None] + 1 < owner)
    wanted = np.minimum(margin, 0.5 * _gaps(links, capsules, owner, first, second, np.zeros((1, len(links)))))
    if wanted.size and wanted.min() <= 0:
        raise ValueError("two links of the chain touch at rest")
    rng = np.random.default_rng(0)
    unit = rng.random((_STATES, len(links)))
    unit[::2] = 0.5 - 0.5 * np.cos(np.pi * unit[::2])
    for _ in range(_ROUNDS):
        bounds = np.array([_interval(link.joint) for link in links])
        states = bounds[:, 0] + unit * (bounds[:, 1] - bounds[:, 0])
        tight = (_gaps(links, capsules, owner, first, second, states) < wanted).any(axis=0)
        if not tight.any():
            return
        pairs = zip(owner[first[tight]], owner[second[tight]], strict=True)
        concerned = {k for a, b in pairs for k in range(a + 1, b + 1)}
        for k in concerned:
            joint = links[k].joint
            assert joint is not None
            if np.isfinite(joint.lower):
                share = _NARROW_ROLL if _rolls(links[k - 1], joint) else _NARROW
                links[k].joint = replace(joint, lower=share * joint.lower, upper=share * joint.upper)


def _rolls(before: Link, joint: JointSpec) -> bool:
    """Whether a joint turns about the direction of the link before it, so that its limits matter less."""
    along = before.capsules[-1][3:6] - before.capsules[-1][:3]
    across = np.linalg.norm(np.cross(along, joint.axis))
    return joint.type == "revolute" and bool(across < 0.1 * np.linalg.norm(along))


def _interval(joint: JointSpec | None) -> tuple[float, float]:
    if joint is None:
        return 0.0, 0.0
    return (joint.lower, joint.upper) if np.isfinite(joint.lower) else (-np.pi, np.pi)


def _gaps(
    links: list[Link], capsules: Array, owner: NDArray[np.intp], first: Array, second: Array, states: Array
) -> Array:
    """(S, P) distances of pairs of capsules in S states; negative where they overlap."""
    joints = [Joint("root", "free", -1)]
    for k, link in enumerate(links[1:], 1):
        assert link.joint is not None
        x, y, z = (np.asarray(link.joint.axis, dtype=np.float64) / np.linalg.norm(link.joint.axis)).tolist()
        ox, oy, oz = (float(v) for v in link.joint.origin)
        joints.append(Joint(link.name, link.joint.type, k - 1, (x, y, z), (ox, oy, oz), -np.inf, np.inf))
    T = KinematicTree(joints).forward_kinematics(states)[:, owner]
    starts = np.einsum("sncd,nd->snc", T[..., :3, :3], capsules[:, :3]) + T[..., :3, 3]
    ends = np.einsum("sncd,nd->snc", T[..., :3, :3], capsules[:, 3:6]) + T[..., :3, 3]
    apart = _segment_distance(starts[:, first], ends[:, first], starts[:, second], ends[:, second])
    gaps: Array = apart - capsules[first, 6] - capsules[second, 6]
    return gaps


def _segment_distance(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Distances of segments from a to b and from c to d, (..., 3) each."""
    u, v, w = b - a, d - c, a - c
    uu, vv, uv = ((x * y).sum(axis=-1) for x, y in ((u, u), (v, v), (u, v)))
    uw, vw = (u * w).sum(axis=-1), (v * w).sum(axis=-1)
    uu, vv = np.maximum(uu, 1e-12), np.maximum(vv, 1e-12)
    s = np.clip((uv * vw - vv * uw) / np.maximum(uu * vv - uv * uv, 1e-12), 0.0, 1.0)
    t = np.clip((uv * s + vw) / vv, 0.0, 1.0)
    s = np.clip((uv * t - uw) / uu, 0.0, 1.0)
    distance: Array = np.linalg.norm(w + s[..., None] * u - t[..., None] * v, axis=-1)
    return distance
