"""How near an articulation comes to the true one, whatever its parts are called and however many it has.

Parts are sets of points of one cloud. Their number and order are free, so they are matched one to one by the Hungarian
method. Two comparisons differ in how they match and in what they tell:

- :func:`joint_errors` matches by intersection over union of points, and tells each true part's overlap and joint.
- :func:`part_distances` follows the public evaluation of Particulate (Li et al. 2025, arXiv 2512.11798): parts are
  matched by the distance of their mean points. The generalised IoU of their axis-parallel boxes and their chamfer
  distance count as they are and with every joint at its open end. Each is averaged over the estimated parts, then over
  the true ones; the figure is the mean of both. A part without a partner counts -1 and half the object's diagonal.
  Lengths are those of an object whose longest side is 1. Chamfer distances are sums over both directions of mean
  squared distances. That evaluation knows the whole surface. Here one view stands for it, so boxes are those of what
  is seen. They are widened by 0.5 % of the longest side, since a front that is seen alone has no depth.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist
from scipy.spatial.transform import Rotation

from artperl.core.estimate import Estimate
from artperl.evaluation.metrics import axis_error
from artsim.observing.sample import Sample

Array = NDArray[np.float64]

VISIBLE = 20
"""Points from which a part counts: fewer say neither its extent nor its joint."""
_WIDER = 0.005
_COMPARED = 512
"""Points of a part of which the nearest are sought; more change the third digit."""


@dataclass(frozen=True, eq=False)
class Articulation:
    """K parts of a cloud of N points and how they move. Camera frame, metres, radians."""

    part: NDArray[np.int64]
    """(N,) part of each point; -1 for none."""
    joint_type: tuple[str, ...]
    """Of each part; "free" for the root."""
    joint_parent: NDArray[np.int64]
    """(K,) -1 for the root."""
    joint_axis: Array
    """(K, 3) as posed."""
    joint_origin: Array
    """(K, 3) as posed."""
    travel: Array
    """(K,) from the state that is seen to the open end, the limit that is farther from rest."""

    @classmethod
    def of(cls, seen: Sample | Estimate) -> Articulation:
        """The true one of a sample, or that of an estimate, whose references have their joints at rest at 0."""
        if isinstance(seen, Sample):
            axis, origin, state, rest = (
                seen.joint_axis_camera, seen.joint_origin_camera, seen.joint_state, seen.joint_rest
            )  # fmt: skip
        else:
            axis, origin, state, rest = seen.joint_axis, seen.joint_origin, seen.state, np.zeros(len(seen.state))
        ways = np.clip(seen.joint_limits - rest[:, None], -np.pi, np.pi)  # what turns without end opens by half a turn
        farther = np.where(np.abs(ways[:, 0]) > np.abs(ways[:, 1]), ways[:, 0], ways[:, 1])
        travel = np.where(np.array(seen.joint_parent) < 0, 0.0, rest + farther - state)
        return cls(seen.part.astype(np.int64), seen.joint_type, np.array(seen.joint_parent), axis, origin, travel)

    def slides(self, k: int) -> bool:
        """Whether a part slides; others turn."""
        return self.joint_type[k] == "prismatic"

    def counted(self) -> NDArray[np.int64]:
        """Parts that are seen well enough to count."""
        return np.flatnonzero(np.bincount(self.part[self.part >= 0], minlength=1) >= VISIBLE)

    def opened(self, points: ArrayLike) -> Array:
        """(N, 3) where the points are with every joint at its open end."""
        moved = np.array(points, np.float64)
        for k in range(len(self.joint_type)):
            own, link = self.part == k, k
            while link >= 0:  # a part goes along with those that carry it
                step = self.travel[link] * self.joint_axis[link]
                if self.slides(link):
                    moved[own] += step
                else:
                    origin = self.joint_origin[link]
                    moved[own] = Rotation.from_rotvec(step).apply(moved[own] - origin) + origin
                link = self.joint_parent[link]
        return moved


class JointErrors(NamedTuple):
    """Errors of each true part that counts; those without a partner have the worst values."""

    part: NDArray[np.int64]
    """(P,) number of the true part."""
    partner: NDArray[np.int64]
    """(P,) number of the estimated part; -1 for none."""
    iou: Array
    """(P,) of points, 0 to 1."""
    type_right: NDArray[np.bool_]
    """(P,) whether it slides, turns or is the root as the true one."""
    axis: Array
    """(P,) angle between the joints' axes, degrees; 90 without a partner that moves."""
    origin: Array
    """(P,) distance between the axes as lines, over the cloud's diagonal; 0.5 without a partner that moves."""


def joint_errors(estimate: Articulation | None, truth: Articulation, points: ArrayLike) -> JointErrors:
    """Compare the parts of a cloud (N, 3) of two articulations, of which the estimate may be missing."""
    points = np.asarray(points, np.float64)
    parts = truth.counted()
    partner, iou = np.full(len(parts), -1), np.zeros(len(parts))
    right, axis, origin = np.zeros(len(parts), bool), np.full(len(parts), 90.0), np.full(len(parts), 0.5)
    if estimate is not None:
        numbers = estimate.counted()
        own, true = estimate.part == numbers[:, None], truth.part == parts[:, None]
        both = own.astype(float) @ true.T
        overlap = both / (own.sum(1)[:, None] + true.sum(1) - both)
        for m, k in zip(*linear_sum_assignment(overlap, maximize=True), strict=True):
            if overlap[m, k] == 0.0:
                continue
            e, t = int(numbers[m]), int(parts[k])
            partner[k], iou[k] = e, overlap[m, k]
            root = estimate.joint_parent[e] < 0
            right[k] = root == (truth.joint_parent[t] < 0) and estimate.slides(e) == truth.slides(t)
            if not root:
                axis[k] = axis_error(estimate.joint_axis[e], truth.joint_axis[t])
                apart = line_distance(
                    estimate.joint_axis[e], estimate.joint_origin[e], truth.joint_axis[t], truth.joint_origin[t]
                )
                origin[k] = apart / np.linalg.norm(np.ptp(points, axis=0))
    return JointErrors(parts, partner, iou, right, axis, origin)


def line_distance(axis_a: Array, origin_a: Array, axis_b: Array, origin_b: Array) -> float:
    """Least distance between two lines (3,), given by unit directions and points."""
    between, across = origin_b - origin_a, np.cross(axis_a, axis_b)
    length = np.linalg.norm(across)
    if length < 1e-6:
        return float(np.linalg.norm(np.cross(between, axis_a)))
    return float(abs(between @ across) / length)


class PartDistances(NamedTuple):
    """Means over estimated and true parts, as seen and with the joints open."""

    giou: float
    giou_opened: float
    chamfer: float
    chamfer_opened: float


def part_distances(
    estimate: Articulation | None, truth: Articulation, points: ArrayLike, rotation: ArrayLike
) -> PartDistances:
    """See the module.

    Parameters
    ----------
    estimate : Articulation, optional
        None where there is none: no part has a partner.
    truth : Articulation
    points : (N, 3) float
        Camera frame, metres.
    rotation : (3, 3) float
        From the frame that boxes are parallel to, that of the true root, to the camera.
    """
    points = np.asarray(points, np.float64)
    local = points @ np.asarray(rotation)
    side = np.ptp(local, axis=0)
    half = 0.5 * float(np.linalg.norm(side)) / side.max()
    if estimate is None:
        return PartDistances(-1.0, -1.0, half, half)
    sides = [(one, one.counted()) for one in (estimate, truth)]
    means = [np.array([points[one.part == k].mean(axis=0) for k in parts]) for one, parts in sides]
    pairs = list(zip(*linear_sum_assignment(cdist(*means)), strict=True)) if all(map(len, means)) else []
    found: list[float] = []
    for opened in (False, True):
        clouds = [
            [(one.opened(points) if opened else points)[one.part == k] @ rotation / side.max() for k in parts]
            for one, parts in sides
        ]
        for measure, worst in ((_box_giou, -1.0), (_chamfer, half)):
            total = sum(measure(clouds[0][m], clouds[1][k]) for m, k in pairs)
            shares = [(total + worst * (len(own) - len(pairs))) / len(own) for own in clouds if own]
            found.append(float(np.mean(shares)))
    return PartDistances(found[0], found[2], found[1], found[3])


def _box_giou(a: Array, b: Array) -> float:
    low, high = (np.array([edge(points, axis=0) for points in (a, b)]) for edge in (np.min, np.max))
    low, high = low - _WIDER, high + _WIDER
    inner = np.prod(np.clip(high.min(0) - low.max(0), 0.0, None))
    union = np.prod(high - low, axis=1).sum() - inner
    outer = np.prod(high.max(0) - low.min(0))
    return float(inner / union - (outer - union) / outer)


def _chamfer(a: Array, b: Array) -> float:
    a, b = (points[:: max(1, len(points) // _COMPARED)] for points in (a, b))
    return float((cKDTree(b).query(a)[0] ** 2).mean() + (cKDTree(a).query(b)[0] ** 2).mean())
