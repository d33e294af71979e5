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
from scipy.sparse import csr_matrix
from torch import Tensor

from artperl.core.clouds import Clouds
from artperl.core.neighbours import planes, tree_of
from artperl.perception.network import Perceived, Votes

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


@dataclass(frozen=True, eq=False)
class Walks:
    """Walks among the N points of a cloud. What is said of the points is smoothed by :meth:`mean_of_ends`."""

    step: csr_matrix
    """(N, N) sparse float. Share of the walks at each point that go on to another one."""
    stay: Array
    """(N, 1) float. Share of the walks that end at each point."""

    @staticmethod
    def of(points: Array, diagonal: float) -> Walks:
        """Walks among points (N, 3) of an object with such a diagonal, in the unit of the points.

        A step to a neighbour counts half if the way back is none to a neighbour.
        """
        near = tree_of(points).query(points, range(1, min(_NEIGHBOURS + 1, len(points)) + 1))[1]
        normal, (N, k) = planes(points, near)[1], (len(near), near.shape[1] - 1)
        apart, facing = points[near[:, 1:]] - points[:, None], normal[near[:, 1:]]
        off = np.maximum(*(np.abs((apart * own).sum(axis=2)) for own in (normal[:, None], facing)))
        crease = 1.0 - np.abs((normal[:, None] * facing).sum(axis=2))
        weight = np.exp(-((off / (_STEP * diagonal)) ** 2) - crease / _CREASE)
        one_way = csr_matrix((weight.ravel(), near[:, 1:].ravel(), k * np.arange(N + 1)), shape=(N, N))
        both = 0.5 * (one_way + one_way.T)
        total = _STAY + np.asarray(both.sum(axis=1))
        return Walks(both.multiply(1.0 / total).tocsr(), _STAY / total)

    def mean_of_ends(self, values: Array) -> Array:
        """(N, P) mean of values (N, P) over where walks from each point end: see :data:`_MIX`."""
        own = self.stay * values
        last, now = values, own + self.step @ values
        ends: Array = _MIX[0] * last + _MIX[1] * now
        for mix in _MIX[2:]:
            last, now = now, 2.0 * (own + self.step @ now) - last
            ends += mix * now
        return ends


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
