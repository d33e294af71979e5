"""Labels that hold together: points that lie on one smooth surface are, as a rule, of one part.

Perception labels each point by itself, and errs where shapes are unusual, such as a drawer that is wider than those
beside it. Steps and creases between parts are in the cloud, however. Random walks from each point, which cross smooth
surface easily and steps hardly ever, end somewhere near it; the point is of the part that is perceived there (Grady,
"Multilabel random walker image segmentation using prior models", CVPR 2005; here to a fixed number of steps).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import comb

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from artperl.core.clouds import Clouds
from artperl.core.neighbours import planes, tree_of
from artperl.perception.network import Perceived, Votes
from artsim.common.compiled import compiled

Array = NDArray[np.float64]

_NEIGHBOURS = 5
_STEP = 0.003
"""Distance of a neighbour from a point's tangent plane, in diagonals, that hardly any walk crosses."""
_CREASE = 0.3
"""Difference of the cosine of the angle between normals from 1 that few walks cross."""
_STAY = 0.03
"""Weight of where a walk begins, against 1 of each neighbour on the same plane."""
_STEPS = 100
_TERMS = 40
"""Chebyshev polynomials that stand for all steps. Together they differ by less than 1e-4 from these."""
_MIX = np.array([comb(_STEPS, (_STEPS - n) // 2) / 2.0 ** (_STEPS - (n > 0)) * (n % 2 == 0) for n in range(_TERMS + 1)])
_MIX /= _MIX.sum()
"""Weights of Chebyshev polynomials T_n that add up to x^100: chances that a walk of 100 steps on a line ends n away,
hardly ever more than four standard deviations of ten (Sachdeva and Vishnoi 2014, theorem 3.3). The matrix of a step
takes the place of x, so that 40 products do for 100."""
_WIDE = 8
"""Values of a point that are worked on together."""


@dataclass(frozen=True, eq=False)
class Walks:
    """Walks among the N points of a cloud. What is said of the points is smoothed by :meth:`mean_of_ends`.

    Attributes
    ----------
    order : (N,) int64
        The points as they stand below, those beside one another near each other.
    first : (N + 1,) int64
        Where the steps from each point begin.
    target : (S,) int64
        Where each step goes.
    share : (S,) float
        Of the walks that take it.
    stay : (N,) float
        Share of the walks that end at each point.
    """

    order: NDArray[np.int64]
    first: NDArray[np.int64]
    target: NDArray[np.int64]
    share: Array
    stay: Array

    @staticmethod
    def of(points: Array, diagonal: float) -> Walks:
        """Walks among points (N, 3) of an object with such a diagonal, in the unit of the points."""
        tree = tree_of(points)
        here = points[tree.indices]
        near = np.argsort(tree.indices)[tree.query(here, range(1, min(_NEIGHBOURS + 1, len(points)) + 1))[1]]
        return Walks(tree.indices, *_steps(here, near, planes(here, near)[1], _STEP * diagonal))

    def mean_of_ends(self, values: Array) -> Array:
        """(N, P) mean of values (N, P) over where walks from each point end."""
        count, columns = values.shape
        wide = np.zeros((count, -(-columns // _WIDE) * _WIDE))
        wide[:, :columns] = values[self.order]
        _walk(self.first, self.target, self.share, self.stay, wide, _MIX)
        ends = np.empty_like(values)
        ends[self.order] = wide[:, :columns]
        return ends


def smooth_labels(points: Array, values: Array, diagonal: float) -> Array:
    """(N, P) probabilities of parts, or what else is said of each point: the mean over where walks from it end.

    Parameters
    ----------
    points : (N, 3) float
    values : (N, P) float
        Of each point by itself.
    diagonal : float
        Of the object, in the unit of the points.
    """
    return Walks.of(points, diagonal).mean_of_ends(values)


@compiled
def _steps(
    points: Array, near: NDArray[np.int64], normal: Array, step: float
) -> tuple[NDArray[np.int64], NDArray[np.int64], Array, Array]:
    """Fields of :class:`Walks`, for points (N, 3), their neighbours (N, 1 + k), themselves first, and normals (N, 3).

    A step to a neighbour counts half if the way back is none to a neighbour.
    """
    N, k = len(near), near.shape[1] - 1
    weight, mutual = np.empty((N, k)), np.empty((N, k), dtype=np.bool_)
    number = np.zeros(N + 1, dtype=np.int64)
    for i in range(N):
        for n in range(k):
            j = near[i, n + 1]
            here, there, cosine = 0.0, 0.0, 0.0
            for axis in range(3):
                apart = points[j, axis] - points[i, axis]
                here += normal[i, axis] * apart
                there += normal[j, axis] * apart
                cosine += normal[i, axis] * normal[j, axis]
            off = max(abs(here), abs(there)) / step
            weight[i, n] = np.exp(-(off * off) - (1.0 - abs(cosine)) / _CREASE)
            back = False
            for m in range(k):
                back |= near[j, m + 1] == i
            mutual[i, n] = back
            number[i + 1] += 1
            if not back:
                weight[i, n] *= 0.5
                number[j + 1] += 1
    first = np.cumsum(number)
    place = first[:-1].copy()
    target, share, total = np.empty(first[N], dtype=np.int64), np.empty(first[N]), np.full(N, _STAY)
    for i in range(N):
        for n in range(k):
            j = near[i, n + 1]
            target[place[i]], share[place[i]] = j, weight[i, n]
            place[i] += 1
            total[i] += weight[i, n]
            if not mutual[i, n]:
                target[place[j]], share[place[j]] = i, weight[i, n]
                place[j] += 1
                total[j] += weight[i, n]
    for i in range(N):
        for e in range(first[i], first[i + 1]):
            share[e] /= total[i]
    return first, target, share, _STAY / total


@compiled
def _walk(
    first: NDArray[np.int64], target: NDArray[np.int64], share: Array, stay: Array, values: Array, mix: Array
) -> None:
    """Replace values (N, a multiple of 8) by the means over where walks end: see :data:`_MIX`, of which this takes
    ``mix``."""
    N = len(values)
    own, last, now, ends = np.empty((N, _WIDE)), np.empty((N, _WIDE)), np.empty((N, _WIDE)), np.empty((N, _WIDE))
    for begin in range(0, values.shape[1], _WIDE):
        for i in range(N):
            for c in range(_WIDE):
                value = values[i, begin + c]
                own[i, c], last[i, c], now[i, c] = stay[i] * value, 0.0, value
                ends[i, c] = mix[0] * value
        for n in range(1, len(mix)):
            twice, less, part = (2.0, 1.0, mix[n]) if n > 1 else (1.0, 0.0, mix[n])
            for i in range(N):
                p, q, r, s = own[i, 0], own[i, 1], own[i, 2], own[i, 3]
                t, u, v, w = own[i, 4], own[i, 5], own[i, 6], own[i, 7]
                for e in range(first[i], first[i + 1]):
                    j, weight = target[e], share[e]
                    p += weight * now[j, 0]
                    q += weight * now[j, 1]
                    r += weight * now[j, 2]
                    s += weight * now[j, 3]
                    t += weight * now[j, 4]
                    u += weight * now[j, 5]
                    v += weight * now[j, 6]
                    w += weight * now[j, 7]
                last[i, 0], last[i, 1] = twice * p - less * last[i, 0], twice * q - less * last[i, 1]
                last[i, 2], last[i, 3] = twice * r - less * last[i, 2], twice * s - less * last[i, 3]
                last[i, 4], last[i, 5] = twice * t - less * last[i, 4], twice * u - less * last[i, 5]
                last[i, 6], last[i, 7] = twice * v - less * last[i, 6], twice * w - less * last[i, 7]
            now, last = last, now
            if part != 0.0:
                for i in range(N):
                    for c in range(_WIDE):
                        ends[i, c] += part * now[i, c]
        values[:, begin : begin + _WIDE] = ends


def smooth_perceived(
    clouds: Clouds, seen: Perceived | Votes, with_parts: bool = True
) -> tuple[Perceived | Votes, Array]:
    """What is perceived of one cloud, its labels, or votes, smoothed; and the probability of each point to be its own.

    Parameters
    ----------
    clouds : Clouds
    seen : Perceived or Votes
    with_parts : bool
        Otherwise only the probability is smoothed.

    Returns
    -------
    Perceived or Votes
    own : (N,) float
        That a point is of the object, as neighbours have it, too.
    """
    said = [seen.own_logits.sigmoid()[..., None]]
    if with_parts:
        said.append(_said_of_parts(seen) if isinstance(seen, Votes) else seen.part_logits.softmax(-1))
    walks = Walks.of(_double(clouds.points), float(seen.log_diagonal.exp()[0]))
    ends = walks.mean_of_ends(_double(torch.cat(said, dim=-1)))
    own = ends[:, 0]
    if not with_parts:
        return seen, own
    every = torch.from_numpy(ends[:, 1:])[None].to(seen.canonical)
    if isinstance(seen, Votes):
        return _with_said(seen, every), own
    return replace(seen, part_logits=every.clamp(min=1e-6).log()), own


def _said_of_parts(seen: Votes) -> Tensor:
    """(1, N, C) what votes say of parts, in numbers whose mean makes sense.

    What moves and what does not are no mean of each other, where a walk goes from one to the other.
    """
    level, said = seen.level_logits.softmax(-1), torch.cat([seen.box, seen.joint], dim=-1)
    return torch.cat([level, (1.0 - level[..., :1]) * said, level[..., :1] * said], dim=-1)


def _with_said(seen: Votes, every: Tensor) -> Votes:
    """The votes with other means of :func:`_said_of_parts`."""
    width = seen.box.shape[2] + seen.joint.shape[2]
    level, moving, still = every.split([seen.level_logits.shape[2], width, width], dim=2)
    root = level.argmax(-1, keepdim=True) == 0
    said = torch.where(root, still / level[..., :1], moving / level[..., 1:].sum(-1, keepdim=True))
    return replace(seen, level_logits=level.clamp(min=1e-6).log(), box=said[..., :6], joint=said[..., 6:])


def _double(values: Tensor) -> Array:
    """The first row, in double precision."""
    return values[0].double().cpu().numpy()
