"""Labels that hold together: points that lie on one smooth surface are, as a rule, of one part.

Perception labels each point by itself, and errs where shapes are unusual, such as a drawer that is wider than those
beside it. Steps and creases between parts are in the cloud, however. Random walks from each point, which cross smooth
surface easily and steps hardly ever, end somewhere near it; the point is of the part that is perceived there (Grady,
"Multilabel random walker image segmentation using prior models", CVPR 2005; here to a fixed number of steps).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree
from torch import Tensor

from artperl.core.clouds import Clouds
from artperl.core.neighbours import planes
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
    N = len(points)
    k = min(_NEIGHBOURS, N - 1)
    near = cKDTree(points).query(points, range(1, k + 2), workers=1)[1]
    normal = planes(points[near])[1]
    here, there = np.repeat(np.arange(N), k), near[:, 1:].ravel()
    apart = points[there] - points[here]
    off = np.maximum(*(np.abs((normal[end] * apart).sum(1)) for end in (here, there))) / (_STEP * diagonal)
    bent = (1.0 - np.abs((normal[here] * normal[there]).sum(1))) / _CREASE
    weight = sparse.csr_array((np.exp(-(off**2) - bent), (here, there)), shape=(N, N))
    weight = 0.5 * (weight + weight.T)
    total = _STAY + weight.sum(axis=1)
    onward, stay = sparse.diags_array(1.0 / total) @ weight, (_STAY / total)[:, None] * values
    for _ in range(_STEPS):
        values = stay + onward @ values
    return values


def smooth_perceived(clouds: Clouds, seen: Perceived | Votes) -> Perceived | Votes:
    """What is perceived of one cloud, its labels, or votes, smoothed by :func:`smooth_labels`."""
    points, diagonal = _double(clouds.points), float(seen.log_diagonal.exp()[0])

    def together(values: Tensor) -> Tensor:
        return torch.from_numpy(smooth_labels(points, _double(values), diagonal))[None]

    if not isinstance(seen, Votes):
        logits = together(seen.part_logits.softmax(-1)).clamp(min=1e-6).log()
        return replace(seen, part_logits=logits.to(seen.part_logits))
    level = seen.level_logits.softmax(-1)
    moves = 1.0 - level[..., :1]
    said = torch.cat([seen.box, seen.joint], dim=-1)
    every = together(torch.cat([level, moves * said, level[..., :1] * said], dim=-1)).to(said)
    level, moving, still = every.split([level.shape[2], said.shape[2], said.shape[2]], dim=2)
    # What moves and what does not are no mean of each other, where a walk goes from one to the other.
    root = level.argmax(-1, keepdim=True) == 0
    said = torch.where(root, still / level[..., :1], moving / level[..., 1:].sum(-1, keepdim=True))
    return replace(seen, level_logits=level.clamp(min=1e-6).log(), box=said[..., :6], joint=said[..., 6:])


def _double(values: Tensor) -> Array:
    """The first row, in double precision."""
    return values[0].double().cpu().numpy()
