"""Parts from votes: points that say the same of their own part are one part, however many there are.

A network that names parts by numbers has to count them, and one drawer too few renames all that follow. Where the next
edge of a drawer is, and which way it slides, can be seen from each of its points.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.special import log_softmax
from torch import Tensor

from artperl.core.labels import label_log_odds
from artperl.core.part_order import visible_order
from artperl.core.ways import WAYS, way_distances
from artperl.perception.network import Perceived, Votes
from artsim.common.compiled import compiled

Array = NDArray[np.float64]

_APART = 0.3
"""Of a box's side: votes whose centres differ by more are of two parts."""
_UNLIKE = 0.6
"""Of a box's side: votes whose sides differ by more are of two parts."""
_SLACK = 0.03
"""Diagonals by which any two votes may differ."""
_NEAR = 0.6
"""Share of these differences within which votes back each other."""
_FEWEST = 0.012
"""Of all points: votes that make a part."""
_FEW = 3
"""Votes that make a part of any cloud."""
_INSIDE = 0.5
"""Share of a box that lies in that of a part with more votes: it is no other part, but one of unsure edges."""
_OWN, _WELL_INSIDE = 0.5, 0.45
"""Share of the points well inside a part's box, so far from its middle, that vote for it: what is said by points on the
edge of two parts has few of its own."""
_DOUBT = 0.02
"""Probability that a point is of a part whatever it votes."""


@dataclass(frozen=True, eq=False)
class PerceivedTree(Perceived):
    """What is perceived of B clouds whose parts were found by :func:`group_votes`."""

    joint: Tensor
    """(B, P, 9) float. As :func:`artperl.core.clouds.joint_rows` has it."""
    parent: Tensor
    """(B, P) int64."""
    way_distance: Tensor
    """(B, P, W, 2) float. How far votes, of the cloud and of its mirror image, are from each of
    :data:`artperl.core.ways.WAYS`."""


def group_votes(votes: Votes) -> PerceivedTree:
    """Parts of which points tell, in the order that :func:`artperl.core.part_order.visible_order` gives them."""
    place, box, level = (t.double().cpu().numpy() for t in (votes.canonical, votes.box, votes.level_logits))
    joints = torch.stack([votes.joint, votes.mirrored_joint], dim=1).double().cpu().numpy()
    rows = [_group(*own) for own in zip(place, box, joints, log_softmax(level, axis=-1), strict=True)]
    fields = {name: torch.from_numpy(np.stack([row[name] for row in rows])) for name in rows[0]}
    return PerceivedTree(
        canonical=votes.canonical, spread=votes.spread, own_logits=votes.own_logits, log_diagonal=votes.log_diagonal,
        **{name: t.to(votes.canonical) if t.is_floating_point() else t.to(votes.canonical.device)
           for name, t in fields.items()},
    )  # fmt: skip


def _group(place: Array, box: Array, joint: Array, level_log_odds: Array) -> dict[str, NDArray[Any]]:
    """Of one cloud and P rows for parts, what :class:`PerceivedTree` says of parts; (2, N, 9) votes for joints."""
    rows, level = level_log_odds.shape[1], level_log_odds.argmax(1)
    level[level_log_odds[:, 0].argmax()] = 0  # there is a root
    members, depth, fewest = [np.flatnonzero(level == 0)], [0], max(_FEW, round(_FEWEST * len(box)))
    for deep in range(1, rows):
        own = np.flatnonzero(level == deep)
        found = sorted(clusters(place[own], box[own], fewest), key=len, reverse=True)[: rows - len(members)]
        members += [own[group] for group in found]
        depth += [deep] * len(found)
    boxes = np.stack([np.median(box[own], axis=0) for own in members])
    joints = np.stack([np.median(joint[0, own], axis=0) for own in members])
    ways = np.zeros((len(members), len(WAYS), 2))
    for k, own in enumerate(members[1:], start=1):  # the root does not open
        ways[k] = np.transpose([way_distances(votes[own], boxes[k, 3:]) for votes in joint])
    joints[0] = 0.0
    parents = _parents(depth, boxes)
    order = visible_order(parents, boxes[:, :3], boxes[:, 3:])
    number, K = np.argsort(order), len(order)
    log_odds = np.full((len(box), rows), -np.inf)
    for n, k in enumerate(order):
        fit = label_log_odds(level_log_odds[:, depth[k]], differences(box, boxes[k]) if k else 0.0)
        log_odds[:, n] = np.logaddexp(fit, np.log(_DOUBT / K))

    def pad(values: NDArray[Any]) -> NDArray[Any]:
        return np.concatenate([values[order], np.zeros((rows - K, *values.shape[1:]), dtype=values.dtype)])

    return {
        "part_logits": log_odds, "valid_logits": np.where(np.arange(rows) < K, 1.0, -1.0),
        "box_center": pad(boxes[:, :3]), "box_size": pad(boxes[:, 3:]), "joint": pad(joints),
        "way_distance": pad(ways),
        "parent": pad(np.where(parents < 0, 0, number[parents])),
    }  # fmt: skip


def _parents(depth: Sequence[int], boxes: Array) -> NDArray[np.int64]:
    """(K,) parts that boxes (K, 6) hang from, -1 for the root: of those one level up, the nearest."""
    parents = [-1]
    for k in range(1, len(depth)):
        above = max(d for d in depth if d < depth[k])
        choice = [j for j in range(k) if depth[j] == above]
        gaps = np.abs(boxes[choice, :3] - boxes[k, :3]) - 0.5 * (boxes[choice, 3:] + boxes[k, 3:])
        parents.append(choice[int(np.linalg.norm(np.maximum(gaps, 0.0), axis=1).argmin())])
    return np.array(parents)


def clusters(place: Array, box: Array, fewest: int) -> list[NDArray[np.int64]]:
    """Which votes are of one part each; stray votes are of none.

    Parameters
    ----------
    place : (N, 3) float
        Where the points that vote lie in the rest frame.
    box : (N, 6) float
        Votes.
    fewest : int
        Votes that make a part.

    Returns
    -------
    list of (n,) int
    """
    backed = _backed(np.ascontiguousarray(box, dtype=np.float64))
    left, middles = np.ones(len(box), dtype=bool), np.empty((0, 6))
    support = backed.sum(axis=1)
    while left.any():
        first = int(np.where(left, support, 0).argmax())
        if support[first] < fewest:
            break
        middle = np.median(box[backed[first] & left], axis=0)
        voters = differences(box, middle) < 1.0
        gone = left & (voters | (np.arange(len(box)) == first))
        support -= backed[:, gone].sum(axis=1)
        left &= ~gone
        inside = (np.abs(place - middle[:3]) < _WELL_INSIDE * middle[3:]).all(axis=1)
        if (voters & inside).sum() >= _OWN * inside.sum() and not (overlap(middles, middle) > _INSIDE).any():
            middles = np.concatenate([middles, middle[None]])
    if not len(middles):
        return []
    apart = differences(box[:, None], middles[None])
    own = np.where(apart.min(1) < 1.0, apart.argmin(1), -1)
    return [np.flatnonzero(own == n) for n in range(len(middles)) if (own == n).sum() >= fewest]


@compiled
def _backed(box: Array) -> NDArray[np.bool_]:
    """(N, N) votes that back each other: whose :func:`differences` are below :data:`_NEAR`."""
    N = len(box)
    backed = np.empty((N, N), dtype=np.bool_)
    for i in range(N):
        for j in range(i + 1):
            near = True
            for axis in range(3):
                side, sides = box[i, 3 + axis], box[j, 3 + axis]
                center = abs(box[i, axis] - box[j, axis]) / (_APART * min(side, sides) + _SLACK)
                size = abs(side - sides) / (_UNLIKE * max(side, sides) + _SLACK)
                if not (center < _NEAR and size < _NEAR):
                    near = False
                    break
            backed[i, j] = backed[j, i] = near
    return backed


def overlap(box: Array, other: Array) -> Array:
    """Share of the smaller of two boxes (..., 6), a little thicker than they are, that lies in the other one."""
    side, sides = box[..., 3:] + _SLACK, other[..., 3:] + _SLACK
    low = np.maximum(box[..., :3] - 0.5 * side, other[..., :3] - 0.5 * sides)
    high = np.minimum(box[..., :3] + 0.5 * side, other[..., :3] + 0.5 * sides)
    common = np.maximum(high - low, 0.0).prod(axis=-1)
    share: Array = common / np.minimum(side.prod(axis=-1), sides.prod(axis=-1))
    return share


def differences(box: Array, other: Array) -> Array:
    """How far boxes (..., 6) are from being those of one part: 1 where they may just be."""
    worst: Array = np.zeros(np.broadcast_shapes(box.shape, other.shape)[:-1])
    for axis in range(3):  # one after the other: all pairs of a cloud's votes fill the memory that is near
        side, sides = box[..., 3 + axis], other[..., 3 + axis]
        center = np.abs(box[..., axis] - other[..., axis]) / (_APART * np.minimum(side, sides) + _SLACK)
        size = np.abs(side - sides) / (_UNLIKE * np.maximum(side, sides) + _SLACK)
        worst = np.maximum(worst, np.maximum(center, size))
    return worst
